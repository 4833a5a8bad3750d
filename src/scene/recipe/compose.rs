//! One scene of a recipe: what is drawn, in which order.

use crate::error::{Error, Result};
use crate::pixel::LinearRgb;
use crate::scene::stack::DropColumn;
use crate::scene::{
    AreaLight, AssetVariant, Background, DrawLog, Draws, Exposure, Grade, Object, Range, Recipe,
    Scene, SceneSettings, Surface,
};
use std::f64::consts::PI;

/// Which scene of a dataset.
#[derive(Clone, Copy)]
pub(super) struct SceneNumber {
    pub(super) seed: u64,
    pub(super) k: u64,
}

impl Recipe {
    /// A scene of a recipe whose switches have been applied.
    pub(super) fn compose(
        &self,
        number: SceneNumber,
        log: &DrawLog,
        backgrounds: &[Background],
        catalog: &[AssetVariant],
    ) -> Result<Scene> {
        let draws = Draws::new(number.seed, number.k).logged(log);
        let background = pick_background(&draws, backgrounds)?;
        let mut objects = if self.draw_negative(&draws) {
            Vec::new()
        } else {
            self.select_objects(number, log, catalog)?
        };
        self.vary_objects(&mut objects, &draws);
        let surface = self.draw_surface(&draws, background.size);
        self.drop_column(background, surface, &draws)
            .stack(&mut objects)?;
        let scene = self.lit_scene(&draws, background, surface, objects);
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

    /// The scene with these objects, its light drawn.
    fn lit_scene(
        &self,
        draws: &Draws,
        background: &Background,
        surface: Surface,
        objects: Vec<Object>,
    ) -> Scene {
        let lights = self.draw_lights(draws);
        Scene {
            image: self.image,
            plate: background.name.clone(),
            camera: background.camera,
            view: self.view.draw(draws),
            lens: self.lens.draw(draws, background.k1),
            surface,
            objects,
            ambient: ambient_radiance(&lights, self.ambient.draw(draws, "ambient")),
            lights,
            environment: self.environment.draw(draws),
            exposure: self.exposure(background, self.gain_ev.draw(draws, "gain_ev")),
            cast: self.cast,
            finish: self.finish.draw(draws),
            files: None,
            settings: SceneSettings::default(),
        }
    }

    /// Whether the scene stays empty.
    fn draw_negative(&self, draws: &Draws) -> bool {
        Range::chance(self.negatives, draws, "negative")
    }

    fn draw_surface(&self, draws: &Draws, size: [f64; 2]) -> Surface {
        Surface {
            size,
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
        match self.surface_albedo.or(background.albedo) {
            None => Exposure::MatchPlate { gain_ev },
            Some(albedo) => Exposure::MatchSurface { albedo, gain_ev },
        }
    }

    fn vary_objects(&self, objects: &mut [Object], draws: &Draws) {
        for (i, object) in objects.iter_mut().enumerate() {
            self.vary_object(object, draws, &format!("objects[{i}]"));
        }
    }

    /// Gives an object its scale and its colours.
    fn vary_object(&self, object: &mut Object, draws: &Draws, path: &str) {
        object.scale_by(self.scale.draw_field(draws, path, "scale"));
        object.grade = self.draw_grade(draws, path);
    }

    fn draw_grade(&self, draws: &Draws, path: &str) -> Grade {
        let (grade, path) = (&self.grade, format!("{path}.grade"));
        Grade {
            hue_deg: grade.hue_deg.draw_field(draws, &path, "hue_deg") as f32,
            saturation: grade.saturation.draw_field(draws, &path, "saturation") as f32,
            value: grade.value.draw_field(draws, &path, "value") as f32,
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
/// surface's centre; `share` itself, white, when there is no light.
///
/// # Method
/// A small Lambertian light of power P faces the centre from distance d and height h: its
/// irradiance there is `P h / (pi d^3)`. A constant environment of radiance L gives `pi L`.
fn ambient_radiance(lights: &[AreaLight], share: f64) -> LinearRgb {
    if lights.is_empty() {
        return LinearRgb::WHITE.scale(share as f32);
    }
    lights.iter().fold(LinearRgb::BLACK, |sum, light| {
        sum + light.color.scale(ambient_factor(light, share) as f32)
    })
}

/// Radiance all around that gives `share` of the irradiance of a small light at the centre.
fn ambient_factor(light: &AreaLight, share: f64) -> f64 {
    let [x, y, h] = light.position;
    let d = (x * x + y * y + h * h).sqrt();
    share * light.power * h / (PI * PI * d * d * d)
}
