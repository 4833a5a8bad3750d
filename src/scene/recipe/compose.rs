//! Composes one scene of a recipe: what is drawn, in which order.

use crate::color::Albedo;
use crate::error::{Error, Result};
use crate::pixel::LinearRgb;
use crate::scene::belt::SequencePlace;
use crate::scene::stack::DropColumn;
use crate::scene::{
    AreaLight, AssetVariant, Background, Bend, DrawLog, Draws, EdgeTreatment, Exposure, LightShape,
    LightTint, Object, Range, Recipe, Scene, Surface, draw_paths,
};
use std::f64::consts::PI;

/// Number of a scene in a dataset.
#[derive(Clone, Copy)]
pub(super) struct SceneNumber {
    pub(super) seed: u64,
    pub(super) k: u64,
    /// Everything is drawn as for the first picture of its sequence.
    pub(super) place: SequencePlace,
}

impl SceneNumber {
    /// The draws of its sequence.
    fn draws(self, log: &DrawLog) -> Draws<'_> {
        Draws::new(self.seed, self.place.first).logged(log)
    }

    /// What is drawn anew for each picture of a sequence.
    fn own_draws(self, log: &DrawLog) -> Draws<'_> {
        Draws::new(self.seed, self.k).logged(log)
    }
}

/// The backgrounds to choose from.
#[derive(Clone, Copy)]
pub(super) struct Places<'a> {
    /// For scenes with objects.
    pub(super) viewpoints: &'a [Background],
    /// For scenes without.
    pub(super) negatives: &'a [Background],
}

impl<'a> Places<'a> {
    fn of(&self, is_negative: bool) -> &'a [Background] {
        match is_negative {
            true => self.negatives,
            false => self.viewpoints,
        }
    }
}

impl Recipe {
    /// Composes a scene of a recipe whose switches have been applied.
    pub(super) fn compose(
        &self,
        number: SceneNumber,
        log: &DrawLog,
        places: Places<'_>,
        catalog: &[AssetVariant],
    ) -> Result<Scene> {
        let draws = number.draws(log);
        let is_negative = Range::chance(self.negatives, &draws, "negative");
        let background = pick_background(&draws, places.of(is_negative))?;
        let mut objects = match is_negative {
            true => Vec::new(),
            false => self.select_objects(number, log, catalog)?,
        };
        self.vary_objects(&mut objects, &draws);
        let surface = self.draw_surface(&draws, background);
        self.drop_column(background, surface, &draws)
            .stack(&mut objects)?;
        let scene = Scene {
            belt: self.belt.map(|belt| belt.draw(&draws, number.place)),
            finish: self.finish.draw(&draws, &number.own_draws(log)),
            ..self.lit_scene(&draws, background, surface, objects)
        };
        scene.check()?;
        Ok(scene)
    }

    fn drop_column<'a>(
        &'a self,
        background: &'a Background,
        surface: Surface,
        draws: &'a Draws<'a>,
    ) -> DropColumn<'a> {
        DropColumn {
            background: &background.name,
            surface,
            start: &self.start,
            options: &self.settle,
            draws,
        }
    }

    /// A scene with these objects and its light drawn, not yet moved by a belt or post-processed.
    fn lit_scene(
        &self,
        draws: &Draws,
        background: &Background,
        surface: Surface,
        objects: Vec<Object>,
    ) -> Scene {
        let lights = self.draw_lights(draws);
        Scene {
            plate: background.name.clone(),
            view: self.view.draw(draws),
            lens: self.lens.draw(draws, background),
            objects,
            ambient: ambient_radiance(&lights, self.ambient.draw(draws, "ambient")),
            lights,
            environment: self.environment.draw(draws),
            exposure: self.exposure(background, self.gain_ev.draw(draws, "gain_ev")),
            cast: self.cast(background),
            light_direction: self.light_direction.draw(draws),
            light_map: self.light_map.clone(),
            interreflection: self.draw_interreflection(draws, background),
            edges: EdgeTreatment::draw(&self.edges, draws),
            ..Scene::new(self.image, background.camera, surface)
        }
    }

    fn draw_surface(&self, draws: &Draws, background: &Background) -> Surface {
        let Background { size, wall, .. } = *background;
        Surface {
            size,
            wall: (self.walls.as_ref()).map_or(wall, |own| Some(own.draw(draws, size, wall))),
            friction: self.friction.draw(draws, "friction"),
            restitution: self.restitution.draw(draws, "restitution"),
        }
    }

    fn draw_lights(&self, draws: &Draws) -> Vec<AreaLight> {
        let numbered = self.lights.iter().enumerate();
        numbered
            .map(|(i, light)| light.draw(draws, &format!("lights[{i}]")))
            .collect()
    }

    fn exposure(&self, background: &Background, gain_ev: f64) -> Exposure {
        match self.albedo_of(background) {
            None => Exposure::MatchPlate { gain_ev },
            Some(albedo) => Exposure::MatchSurface { albedo, gain_ev },
        }
    }

    fn draw_interreflection(&self, draws: &Draws, background: &Background) -> LinearRgb {
        let share = self.interreflection.draw(draws, "interreflection") as f32;
        let albedo = self.albedo_of(background);
        albedo
            .map_or(LinearRgb::WHITE, |albedo| albedo.color())
            .scale(share)
    }

    fn albedo_of(&self, background: &Background) -> Option<Albedo> {
        self.surface_albedo.or(background.albedo)
    }

    /// The recipe's tint; if that is the default and the surface's own colour is known, the colour
    /// of the light on it.
    fn cast(&self, background: &Background) -> LightTint {
        match (self.albedo_of(background), self.cast) {
            (Some(Albedo::Color(albedo)), LightTint::MatchSurface { share, .. }) => {
                LightTint::MatchSurface { share, albedo }
            }
            (Some(Albedo::Color(albedo)), cast) if cast.is_white() => {
                LightTint::MatchSurface { share: 1.0, albedo }
            }
            (_, cast) => cast,
        }
    }

    /// Gives objects their scale and their colours.
    fn vary_objects(&self, objects: &mut [Object], draws: &Draws) {
        let paths = draw_paths(objects);
        for (object, path) in objects.iter_mut().zip(paths) {
            object.scale_by(self.scale.draw_field(draws, &path, "scale"));
            object.grade = self.grade.draw(draws, &format!("{path}.grade"));
            object.bend = self.draw_bend(draws, &format!("{path}.bend"));
        }
    }

    /// A bend about an axis of random direction; flat, and nothing drawn, if the range is 0.
    fn draw_bend(&self, draws: &Draws, path: &str) -> Bend {
        if self.bend_deg.is_zero() {
            return Bend::default();
        }
        Bend {
            deg: self.bend_deg.draw_field(draws, path, "deg"),
            axis_deg: Range::new(0.0, 180.0).draw_field(draws, path, "axis_deg"),
        }
    }
}

fn pick_background<'a>(draws: &Draws, backgrounds: &'a [Background]) -> Result<&'a Background> {
    match backgrounds.len() {
        0 => Err(Error::value(
            "backgrounds",
            "none, expected at least one labelled photo",
        )),
        n => Ok(&backgrounds[draws.choose("background", n)]),
    }
}

/// Radiance of the constant environment that gives `share` of the lights' irradiance at the
/// surface's centre; `share` itself, white, if there is no light.
///
/// # Method
/// A disk of power P and radius r faces the centre from distance d and height h: its irradiance
/// there is `P h / (pi d (d^2 + r^2))`, and that of a square of the same area at most 1 % less. A
/// constant environment of radiance L gives `pi L`.
fn ambient_radiance(lights: &[AreaLight], share: f64) -> LinearRgb {
    if lights.is_empty() {
        return LinearRgb::WHITE.scale(share as f32);
    }
    lights.iter().fold(LinearRgb::BLACK, |sum, light| {
        sum + light.color.scale(ambient_factor(light, share) as f32)
    })
}

/// Ambient radiance that gives `share` of the irradiance of a light at the centre.
fn ambient_factor(light: &AreaLight, share: f64) -> f64 {
    let [x, y, h] = light.position;
    let d2 = x * x + y * y + h * h;
    share * light.power * h / (PI * PI * d2.sqrt() * (d2 + squared_radius(light)))
}

/// Squared radius of a disk of the light's area, square metres.
fn squared_radius(light: &AreaLight) -> f64 {
    let [a, b] = light.size;
    match light.shape {
        LightShape::Rectangle => a * b / PI,
        LightShape::Ellipse => a * b / 4.0,
    }
}
