//! Recipe: the distributions that scenes are drawn from.

use crate::bounds::Bounds;
use crate::color::planckian;
use crate::error::{Error, Result};
use crate::pixel::LinearRgb;
use crate::scene::bounds::{
    ALBEDO, EV, FRICTION, GRADE, KELVIN, LIGHT_HEIGHT, LIGHT_OFFSET, LIGHT_SIZE, MOST_LIGHTS,
    MOST_OBJECTS, RADIANCE, SCALE, SHARE, TURN,
};
use crate::scene::check::{check_cast, check_count, check_image};
use crate::scene::stack::{Column, Start, too_large};
use crate::scene::{
    AreaLight, CameraSource, DrawLog, Drawn, Draws, EnvironmentRanges, Exposure, FinishRanges,
    Grade, LightShape, LightTint, Limit, Object, Range, Scene, SettleOptions, Source, Surface,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// What scenes are drawn from; every [`Range`] is a uniform distribution named by its path in this document.
///
/// A file only says what it wants otherwise: every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Recipe {
    /// Width and height of the pictures, pixels. Default: `[640, 480]`.
    pub image: [u32; 2],
    /// Sources of variation that are switched off; all other draws stay as they are. Default: none.
    pub off: Vec<Source>,
    /// Labelled photos of the place that are used, each a viewpoint: the first so many. Default: `"all"`.
    pub viewpoints: Limit,
    /// Photos of each asset that are used: the first so many. Default: `"all"`.
    pub photos: Limit,
    /// Objects in a scene. Default: `[4, 12]`.
    pub objects: Range,
    /// Share of the scenes that stay empty: pictures of the place alone, 0 to 1. Default: 0.
    pub negatives: f64,
    /// How many different choices of objects there are. Default: `"unique"`, a new one for every scene.
    pub selections: Selections,
    /// Factor on an object's size and thickness, its mass following. Default: `[0.9, 1.1]`.
    pub scale: Range,
    /// How objects start.
    pub start: Start,
    /// Change of an object's colours.
    pub grade: GradeRanges,
    /// Lights; `lights = []` makes scenes without shadows. Default: one.
    pub lights: Vec<LightRanges>,
    /// Irradiance of the constant environment on the surface, as a share of what the lights give at its centre; the
    /// radiance itself when there is no light. Default: `[0.3, 0.8]`.
    pub ambient: Range,
    /// Light from a picture of the surroundings, on top of `ambient`.
    pub environment: EnvironmentRanges,
    /// Brighter or darker than the plate, EV. Default: `[-0.3, 0.3]`.
    pub gain_ev: Range,
    /// Coefficient of friction in a scene, [`Surface::friction`]. Default: 0.5.
    pub friction: Range,
    /// Share of the speed that a bounce gives back, [`Surface::restitution`]. Default: 0.
    pub restitution: Range,
    /// What falls in place of a cut-out. Default: `box`.
    pub collider: Collider,
    /// Share of light that the surface reflects, where it is known: the exposure is then matched to the surface instead of
    /// the plate's white. Default: not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface_albedo: Option<f64>,
    /// Colour of the light: `{ match_surface = { share = 0.5 } }` takes half of the surface's. Default: white.
    pub cast: LightTint,
    /// What happens to the finished frame. Default: nothing.
    pub finish: FinishRanges,
    /// How objects come to rest.
    pub settle: SettleOptions,
}

/// What falls in place of a cut-out, as thick as the asset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collider {
    /// A box around the whole card.
    #[default]
    Box,
    /// A convex prism of the object's hull: cards come to lie closer, at some cost in time.
    Hull,
}

/// How many different choices of objects there are; in files `"unique"` or a number above 0.
///
/// A choice is the number of objects and the asset and photo of each; size, colour and start are drawn for every scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "SelectionsInFile", into = "SelectionsInFile")]
pub enum Selections {
    /// A new choice for every scene.
    #[default]
    Unique,
    /// So many; scene `k` has choice `k` modulo this.
    Of(u64),
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"unique\" or a number above 0")]
enum SelectionsInFile {
    Word(String),
    Number(u64),
}

impl TryFrom<SelectionsInFile> for Selections {
    type Error = String;

    fn try_from(written: SelectionsInFile) -> std::result::Result<Self, String> {
        match written {
            SelectionsInFile::Word(word) if word == "unique" => Ok(Self::Unique),
            SelectionsInFile::Word(word) => Err(format!(
                "\"{word}\", expected \"unique\" or a number above 0"
            )),
            SelectionsInFile::Number(0) => Err("0, expected \"unique\" or a number above 0".into()),
            SelectionsInFile::Number(n) => Ok(Self::Of(n)),
        }
    }
}

impl From<Selections> for SelectionsInFile {
    fn from(selections: Selections) -> Self {
        match selections {
            Selections::Unique => Self::Word("unique".into()),
            Selections::Of(n) => Self::Number(n),
        }
    }
}

/// Change of an object's colours, see [`Grade`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GradeRanges {
    /// Degrees. Default: `[-20, 20]`.
    pub hue_deg: Range,
    /// Factor. Default: `[0.8, 1.2]`.
    pub saturation: Range,
    /// Factor. Default: `[0.8, 1.2]`.
    pub value: Range,
}

/// An area light that faces the centre of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LightRanges {
    /// Outline. Default: `ellipse`.
    pub shape: LightShape,
    /// Height over the surface, metres. Default: `[0.8, 1.6]`.
    pub height: Range,
    /// Distance from the vertical through the surface's centre, metres. Default: `[0.0, 0.8]`.
    pub offset: Range,
    /// Direction of that offset, degrees from `+x` towards `+y`. Default: `[-180, 180]`.
    pub azimuth_deg: Range,
    /// Side length or diameter, metres: softness. Default: `[0.05, 0.6]`.
    pub size: Range,
    /// Power, watts; it cancels out when one light is matched to the plate. Default: `10`.
    pub power: Range,
    /// Red, green and blue, scene-linear. Default: `[1, 1, 1]`.
    pub color: [Range; 3],
    /// Colour temperature, kelvin, 1667 to 25 000, on top of `color`; power keeps its luminance. Default: that of white.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<Range>,
}

/// An asset as a recipe sees it: what may be chosen, without its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Name of the asset.
    pub asset: String,
    /// Width and height of the card of each of its photos, metres; at least one.
    pub photo_sizes: Vec<[f64; 2]>,
    /// Corners of the object's hull in each photo, as in [`Object::outline`]; empty where they are not known.
    pub photo_outlines: Vec<Vec<[f64; 2]>>,
    /// Thickness, metres.
    pub thickness: f64,
    /// Mass, kilograms.
    pub mass: f64,
}

/// A labelled photo of the place, as a recipe sees it: without its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Background {
    /// Name, kept as [`Scene::plate`].
    pub name: String,
    /// Width and height of the labelled rectangle, metres.
    pub size: [f64; 2],
    /// The camera that took it, or what that can be found from.
    pub camera: CameraSource,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            image: [640, 480],
            off: Vec::new(),
            viewpoints: Limit::All,
            photos: Limit::All,
            objects: Range::new(4.0, 12.0),
            negatives: 0.0,
            selections: Selections::Unique,
            scale: Range::new(0.9, 1.1),
            start: Start::default(),
            grade: GradeRanges::default(),
            lights: vec![LightRanges::default()],
            ambient: Range::new(0.3, 0.8),
            environment: EnvironmentRanges::default(),
            gain_ev: Range::new(-0.3, 0.3),
            friction: Range::fixed(Surface::new([0.0; 2]).friction),
            restitution: Range::fixed(0.0),
            collider: Collider::Box,
            surface_albedo: None,
            cast: LightTint::default(),
            finish: FinishRanges::default(),
            settle: SettleOptions::default(),
        }
    }
}

impl Default for GradeRanges {
    fn default() -> Self {
        Self {
            hue_deg: Range::new(-20.0, 20.0),
            saturation: Range::new(0.8, 1.2),
            value: Range::new(0.8, 1.2),
        }
    }
}

impl Default for LightRanges {
    fn default() -> Self {
        Self {
            shape: LightShape::Ellipse,
            height: Range::new(0.8, 1.6),
            offset: Range::new(0.0, 0.8),
            azimuth_deg: Range::new(-180.0, 180.0),
            size: Range::new(0.05, 0.6),
            power: Range::fixed(10.0),
            color: [Range::fixed(1.0); 3],
            temperature_k: None,
        }
    }
}

impl Recipe {
    /// Scene `k`: a pure function of the recipe, `seed` and `k`, the backgrounds and the stock (both in their order).
    ///
    /// Objects are dropped: they start in a stack over the surface, without overlap, within its walls. The camera and
    /// the exposure are left for the stages that know the photo.
    ///
    /// # Method
    /// Every number is drawn by its own path ([`Draws`]), so that one more object or another range re-rolls nothing
    /// else. Objects are drawn without repetition until the stock is used up, then again from all of it.
    /// # Errors
    /// A range that cannot be right; no background; no stock while objects are asked for; a card that fits the surface
    /// in no direction.
    pub fn scene(
        &self,
        seed: u64,
        k: u64,
        backgrounds: &[Background],
        stock: &[Choice],
    ) -> Result<Scene> {
        self.explained(seed, k, backgrounds, stock)
            .map(|(scene, _)| scene)
    }

    /// Scene `k` and every draw that it was made with, in order.
    ///
    /// # Errors
    /// As [`scene`](Self::scene).
    pub fn explained(
        &self,
        seed: u64,
        k: u64,
        backgrounds: &[Background],
        stock: &[Choice],
    ) -> Result<(Scene, Vec<Drawn>)> {
        let log = DrawLog::default();
        let recipe = self.narrowed();
        let scene = recipe.compose(seed, k, &log, recipe.viewpoints.of(backgrounds), stock)?;
        Ok((scene, log.into_draws()))
    }

    fn compose(
        &self,
        seed: u64,
        k: u64,
        log: &DrawLog,
        backgrounds: &[Background],
        stock: &[Choice],
    ) -> Result<Scene> {
        self.check()?;
        let draws = Draws::new(seed, k).logged(log);
        let background = pick_background(&draws, backgrounds)?;
        let empty =
            self.negatives > 0.0 && Range::new(0.0, 1.0).draw(&draws, "negative") < self.negatives;
        let mut objects = if empty {
            Vec::new()
        } else {
            self.choose(seed, k, log, stock)?
        };
        for (i, object) in objects.iter_mut().enumerate() {
            self.vary(object, &draws, &format!("objects[{i}]"));
        }
        let surface = Surface {
            size: background.size,
            friction: self.friction.draw(&draws, "friction"),
            restitution: self.restitution.draw(&draws, "restitution"),
        };
        let (start, options, place) = (&self.start, &self.settle, background.name.as_str());
        Column {
            place,
            surface,
            start,
            options,
            draws: &draws,
        }
        .stack(&mut objects)?;
        let lights: Vec<AreaLight> = self
            .lights
            .iter()
            .enumerate()
            .map(|(i, light)| light.draw(&draws, &format!("lights[{i}]")))
            .collect();
        let scene = Scene {
            image: self.image,
            plate: background.name.clone(),
            camera: background.camera,
            surface,
            objects,
            ambient: ambient(&lights, self.ambient.draw(&draws, "ambient")),
            lights,
            environment: self.environment.draw(&draws),
            exposure: self.exposure(self.gain_ev.draw(&draws, "gain_ev")),
            cast: self.cast,
            finish: self.finish.draw(&draws),
        };
        scene.check()?;
        Ok(scene)
    }

    /// Fails on the first asset that at its largest fits between the walls of some background in no direction: a scene with
    /// both would be refused, however late it comes.
    pub fn check_room(&self, backgrounds: &[Background], stock: &[Choice]) -> Result<()> {
        let recipe = self.narrowed();
        if recipe.objects.max < 1.0 {
            return Ok(());
        }
        for background in recipe.viewpoints.of(backgrounds) {
            let photos = stock.iter().flat_map(|choice| {
                recipe
                    .photos
                    .of(&choice.photo_sizes)
                    .iter()
                    .map(move |s| (choice, s))
            });
            for (choice, size) in photos {
                let largest = size.map(|side| side * recipe.scale.max);
                if !recipe.start.has_room(background.size, largest) {
                    let what = too_large(&choice.asset, largest, &background.name, background.size);
                    return Err(Error::value("objects", what));
                }
            }
        }
        Ok(())
    }

    /// Fails on the first value that cannot be right.
    pub fn check(&self) -> Result<()> {
        check_image(self.image)?;
        self.objects.check_count(
            "objects",
            &Bounds::new(0.0, MOST_OBJECTS as f64, "what comes to rest in a heap"),
        )?;
        SHARE.check("negatives", self.negatives)?;
        self.scale.check("scale", &SCALE)?;
        self.start.check()?;
        self.grade.hue_deg.check("grade.hue_deg", &TURN)?;
        self.grade.saturation.check("grade.saturation", &GRADE)?;
        self.grade.value.check("grade.value", &GRADE)?;
        check_count(self.lights.len(), "lights", MOST_LIGHTS)?;
        self.lights
            .iter()
            .enumerate()
            .try_for_each(|(i, light)| light.check(&format!("lights[{i}]")))?;
        self.ambient.check("ambient", &RADIANCE)?;
        self.environment.check()?;
        self.gain_ev.check("gain_ev", &EV)?;
        self.friction.check("friction", &FRICTION)?;
        self.restitution.check("restitution", &SHARE)?;
        if let Some(albedo) = self.surface_albedo {
            ALBEDO.check("surface_albedo", albedo)?;
        }
        check_cast(&self.cast)?;
        self.finish.check()?;
        self.settle.check()
    }

    fn exposure(&self, gain_ev: f64) -> Exposure {
        match self.surface_albedo {
            None => Exposure::MatchPlate { gain_ev },
            Some(albedo) => Exposure::MatchSurface { albedo, gain_ev },
        }
    }

    /// Assets and photos of one selection, at their own size and colour.
    fn choose(&self, seed: u64, k: u64, log: &DrawLog, stock: &[Choice]) -> Result<Vec<Object>> {
        let selection = match self.selections {
            Selections::Unique => k,
            Selections::Of(0) => return Err(Error::value("selections", "0, expected at least 1")),
            Selections::Of(n) => k % n,
        };
        let draws = Draws::new(seed, selection).logged(log);
        let count = self.objects.draw_count(&draws, "selection.objects");
        if count > 0 && stock.is_empty() {
            return Err(Error::value(
                "objects",
                format!("{count} asked for, but there is no asset to choose from"),
            ));
        }
        let mut left = Vec::new();
        (0..count)
            .map(|i| {
                if left.is_empty() {
                    left = (0..stock.len()).collect();
                }
                let choice = &stock
                    [left.swap_remove(draws.choose(&format!("selection[{i}].asset"), left.len()))];
                choice.object(
                    &draws,
                    &format!("selection[{i}].photo"),
                    self.photos,
                    self.collider,
                )
            })
            .collect()
    }

    fn vary(&self, object: &mut Object, draws: &Draws, path: &str) {
        let scale = self.scale.draw(draws, &format!("{path}.scale"));
        object.size = object.size.map(|length| length * scale);
        object
            .outline
            .iter_mut()
            .for_each(|corner| *corner = corner.map(|length| length * scale));
        object.thickness *= scale;
        object.mass *= scale * scale * scale;
        object.grade = Grade {
            hue_deg: self
                .grade
                .hue_deg
                .draw(draws, &format!("{path}.grade.hue_deg")) as f32,
            saturation: self
                .grade
                .saturation
                .draw(draws, &format!("{path}.grade.saturation")) as f32,
            value: self.grade.value.draw(draws, &format!("{path}.grade.value")) as f32,
        };
    }
}

impl Choice {
    fn object(
        &self,
        draws: &Draws,
        path: &str,
        photos: Limit,
        collider: Collider,
    ) -> Result<Object> {
        if self.photo_sizes.is_empty() {
            return Err(Error::value(
                format!("assets.{}", self.asset),
                "no photo, expected at least one",
            ));
        }
        let photo = draws.choose(path, photos.of(&self.photo_sizes).len());
        let outline = match collider {
            Collider::Box => Vec::new(),
            Collider::Hull => self.photo_outlines.get(photo).cloned().unwrap_or_default(),
        };
        Ok(Object {
            asset: self.asset.clone(),
            photo,
            back: None,
            size: self.photo_sizes[photo],
            thickness: self.thickness,
            outline,
            mass: self.mass,
            placement: Start::unplaced(),
            grade: Grade::default(),
        })
    }
}

impl LightRanges {
    fn draw(&self, draws: &Draws, path: &str) -> AreaLight {
        let of = |range: &Range, name: &str| range.draw(draws, &format!("{path}.{name}"));
        let (offset, azimuth) = (
            of(&self.offset, "offset"),
            of(&self.azimuth_deg, "azimuth_deg").to_radians(),
        );
        let color = [0, 1, 2].map(|c| of(&self.color[c], &format!("color[{c}]")) as f32);
        let glow = self.temperature_k.map_or(LinearRgb::WHITE, |range| {
            planckian(of(&range, "temperature_k"))
        });
        AreaLight {
            shape: self.shape,
            position: [
                offset * libm::cos(azimuth),
                offset * libm::sin(azimuth),
                of(&self.height, "height"),
            ],
            target: [0.0; 3],
            size: [of(&self.size, "size"); 2],
            power: of(&self.power, "power"),
            color: LinearRgb::from(color) * glow,
        }
    }

    fn check(&self, at: &str) -> Result<()> {
        self.height.check(&format!("{at}.height"), &LIGHT_HEIGHT)?;
        self.offset.check(&format!("{at}.offset"), &LIGHT_OFFSET)?;
        self.azimuth_deg
            .check(&format!("{at}.azimuth_deg"), &TURN)?;
        self.size.check(&format!("{at}.size"), &LIGHT_SIZE)?;
        self.power.check(&format!("{at}.power"), &RADIANCE)?;
        if let Some(range) = &self.temperature_k {
            range.check(&format!("{at}.temperature_k"), &KELVIN)?;
        }
        (0..3).try_for_each(|c| self.color[c].check(&format!("{at}.color[{c}]"), &RADIANCE))
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

/// Radiance of the constant environment that gives `share` of the lights' irradiance at the surface's centre; `share`
/// itself, white, when there is no light.
///
/// # Method
/// A small Lambertian light of power P faces the centre from distance d and height h: its irradiance there is
/// `P h / (pi d^3)`. A constant environment of radiance L gives `pi L`.
fn ambient(lights: &[AreaLight], share: f64) -> LinearRgb {
    if lights.is_empty() {
        return LinearRgb::WHITE.scale(share as f32);
    }
    lights.iter().fold(LinearRgb::BLACK, |sum, light| {
        let [x, y, h] = light.position;
        let d = (x * x + y * y + h * h).sqrt();
        sum + light
            .color
            .scale((share * light.power * h / (PI * PI * d * d * d)) as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Placement;
    use std::collections::BTreeSet;

    fn tray(name: &str) -> Background {
        Background {
            name: name.into(),
            size: [0.6, 0.4],
            camera: CameraSource::Rectangle {
                corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
                photo: [60, 40],
                focal_px: Some(55.0),
            },
        }
    }

    fn stock(n: usize) -> Vec<Choice> {
        let choice = |i| Choice {
            asset: format!("b{i}"),
            photo_sizes: vec![[0.2, 0.07], [0.19, 0.08]],
            photo_outlines: vec![vec![[-0.1, -0.03], [0.1, -0.03], [0.0, 0.035]], vec![]],
            thickness: 0.005,
            mass: 0.03,
        };
        (0..n).map(choice).collect()
    }

    fn scene(recipe: &Recipe, k: u64) -> Scene {
        recipe
            .scene(7, k, &[tray("a"), tray("b")], &stock(10))
            .unwrap()
    }

    fn names(scene: &Scene) -> Vec<(&str, usize)> {
        scene
            .objects
            .iter()
            .map(|o| (o.asset.as_str(), o.photo))
            .collect()
    }

    #[test]
    fn an_empty_file_is_the_default() {
        assert_eq!(toml::from_str::<Recipe>("").unwrap(), Recipe::default());
    }

    #[test]
    fn negatives_are_empty_and_leave_the_other_scenes_as_they_are() {
        let recipe = Recipe {
            negatives: 0.25,
            ..Recipe::default()
        };
        let empty: Vec<u64> = (0..200)
            .filter(|&k| scene(&recipe, k).objects.is_empty())
            .collect();
        // Binomial: 50 +- 6.1; four standard deviations.
        assert!((26..=74).contains(&empty.len()), "{}", empty.len());
        let k = (0..200).find(|k| !empty.contains(k)).unwrap();
        assert_eq!(scene(&recipe, k), scene(&Recipe::default(), k));
        assert!(
            Recipe {
                negatives: 1.5,
                ..Recipe::default()
            }
            .check()
            .unwrap_err()
            .to_string()
            .starts_with("negatives")
        );
    }

    #[test]
    fn a_recipe_comes_back_from_toml_as_it_was() {
        let recipe = Recipe {
            selections: Selections::Of(50),
            lights: vec![],
            ..Recipe::default()
        };
        for recipe in [recipe, Recipe::default()] {
            let text = toml::to_string(&recipe).unwrap();
            assert_eq!(toml::from_str::<Recipe>(&text).unwrap(), recipe, "{text}");
        }
    }

    #[test]
    fn a_file_says_only_what_it_wants_otherwise() {
        let text = "objects = 3\nselections = 5\n[start]\ntilt_deg = [0, 90]\n[[lights]]\nsize = 0.1\n[settle]\nmode = 'flat'";
        let recipe: Recipe = toml::from_str(text).unwrap();
        assert_eq!(
            (recipe.objects, recipe.selections),
            (Range::fixed(3.0), Selections::Of(5))
        );
        assert_eq!(
            (recipe.lights.len(), recipe.lights[0].size),
            (1, Range::fixed(0.1))
        );
        assert_eq!(recipe.start.gap, Start::default().gap);
    }

    #[test]
    fn what_a_file_cannot_say_is_told() {
        let told = |text| toml::from_str::<Recipe>(text).unwrap_err().to_string();
        assert!(told("object = 3").contains("unknown field `object`"));
        assert!(told("selections = 0").contains("expected \"unique\" or a number above 0"));
        assert!(told("selections = 'all'").contains("expected \"unique\" or a number above 0"));
        let wrong: Recipe = toml::from_str("lights = [{ size = [-1, 1] }]").unwrap();
        assert_eq!(
            wrong.check().unwrap_err().to_string(),
            "lights[0].size: [-1, 1], expected [min, max] within 0.0001 to 1000 m (from a point to a sky)"
        );
    }

    #[test]
    fn nothing_to_choose_from_is_told() {
        let told = |backgrounds: &[Background], stock: &[Choice]| {
            Recipe::default()
                .scene(0, 0, backgrounds, stock)
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            told(&[], &stock(1)),
            "backgrounds: none, expected at least one labelled photo"
        );
        assert!(
            told(&[tray("a")], &[]).ends_with("asked for, but there is no asset to choose from")
        );
        let bare = Choice {
            photo_sizes: vec![],
            ..stock(1).remove(0)
        };
        assert_eq!(
            told(&[tray("a")], &[bare]),
            "assets.b0: no photo, expected at least one"
        );
    }

    #[test]
    fn no_object_asked_for_is_an_empty_scene() {
        let recipe = Recipe {
            objects: Range::fixed(0.0),
            ..Recipe::default()
        };
        assert!(
            recipe
                .scene(0, 0, &[tray("a")], &[])
                .unwrap()
                .objects
                .is_empty()
        );
    }

    #[test]
    fn one_more_object_re_rolls_nothing_else() {
        let with = |n| {
            scene(
                &Recipe {
                    objects: Range::fixed(n),
                    ..Recipe::default()
                },
                4,
            )
        };
        let (few, more) = (with(5.0), with(6.0));
        assert_eq!(more.objects[..5], few.objects);
        assert_eq!(
            Scene {
                objects: few.objects.clone(),
                ..more
            },
            few
        );
    }

    #[test]
    fn another_range_re_rolls_nothing_else() {
        let usual = scene(&Recipe::default(), 4);
        let grade = GradeRanges {
            hue_deg: Range::new(0.0, 1.0),
            ..Default::default()
        };
        let mut other = scene(
            &Recipe {
                grade,
                lights: vec![],
                gain_ev: Range::fixed(1.0),
                ..Recipe::default()
            },
            4,
        );
        assert_ne!(other.objects, usual.objects);
        for (a, b) in other.objects.iter_mut().zip(&usual.objects) {
            a.grade.hue_deg = b.grade.hue_deg;
        }
        assert_eq!(other.objects, usual.objects);
    }

    #[test]
    fn assets_repeat_only_when_the_stock_is_used_up() {
        for k in 0..30 {
            let all = scene(
                &Recipe {
                    objects: Range::fixed(25.0),
                    ..Recipe::default()
                },
                k,
            );
            let distinct = |part: &[Object]| {
                part.iter()
                    .map(|o| o.asset.clone())
                    .collect::<BTreeSet<_>>()
                    .len()
            };
            let parts = [
                distinct(&all.objects[..10]),
                distinct(&all.objects[10..20]),
                distinct(&all.objects[20..]),
            ];
            assert_eq!(parts, [10, 10, 5]);
        }
    }

    #[test]
    fn every_asset_photo_and_background_is_used_as_often() {
        let recipe = Recipe {
            objects: Range::fixed(2.0),
            ..Recipe::default()
        };
        let scenes: Vec<Scene> = (0..2000).map(|k| scene(&recipe, k)).collect();
        let share = |claim: &dyn Fn(&Object) -> bool| {
            scenes.iter().filter(|s| claim(&s.objects[1])).count()
        };
        // Binomial, 2000 draws: standard deviation 13 at 1/10 and 22 at 1/2.
        (0..10)
            .for_each(|i| assert!(share(&|o| o.asset == format!("b{i}")).abs_diff(200) < 5 * 13));
        assert!(share(&|o| o.photo == 1).abs_diff(1000) < 5 * 22);
        assert!(
            scenes
                .iter()
                .filter(|s| s.plate == "a")
                .count()
                .abs_diff(1000)
                < 5 * 22
        );
    }

    #[test]
    fn so_many_selections_are_made_as_are_asked_for() {
        let distinct = |selections| {
            let recipe = Recipe {
                selections,
                objects: Range::new(4.0, 6.0),
                ..Recipe::default()
            };
            let scenes: Vec<Scene> = (0..60).map(|k| scene(&recipe, k)).collect();
            scenes.iter().map(names).collect::<BTreeSet<_>>().len()
        };
        assert_eq!(
            (distinct(Selections::Of(7)), distinct(Selections::Unique)),
            (7, 60)
        );
    }

    #[test]
    fn a_selection_used_again_starts_anew() {
        let recipe = Recipe {
            selections: Selections::Of(2),
            ..Recipe::default()
        };
        let (a, b) = (scene(&recipe, 1), scene(&recipe, 3));
        assert_eq!(names(&a), names(&b));
        assert!(
            a.objects
                .iter()
                .zip(&b.objects)
                .all(|(a, b)| a.placement != b.placement && a.grade != b.grade)
        );
    }

    #[test]
    fn drawn_values_stay_in_their_ranges() {
        let recipe = Recipe::default();
        for k in 0..200 {
            let scene = scene(&recipe, k);
            assert!((4..=12).contains(&scene.objects.len()));
            for object in &scene.objects {
                let scale = object.thickness / 0.005;
                assert!(
                    (0.9..=1.1).contains(&scale)
                        && (object.mass / 0.03 - scale.powi(3)).abs() < 1e-12
                );
                assert!(object.grade.hue_deg.abs() <= 20.0);
                assert!(matches!(object.placement, Placement::Drop { .. }));
            }
            let [x, y, z] = scene.lights[0].position;
            assert!((0.8..=1.6).contains(&z) && x.hypot(y) <= 0.8 + 1e-12);
        }
    }

    #[test]
    fn friction_and_bounce_are_drawn_for_a_scene() {
        let recipe = Recipe {
            friction: Range::new(0.2, 0.6),
            restitution: Range::new(0.0, 0.3),
            ..Recipe::default()
        };
        let drawn: Vec<Surface> = (0..50).map(|k| scene(&recipe, k).surface).collect();
        assert!(
            drawn
                .iter()
                .all(|s| (0.2..0.6).contains(&s.friction) && (0.0..0.3).contains(&s.restitution))
        );
        assert!(drawn.iter().any(|s| s.friction < 0.25) && drawn.iter().any(|s| s.friction > 0.55));
        let wrong = Recipe {
            restitution: Range::new(0.0, 1.2),
            ..Recipe::default()
        };
        assert_eq!(
            wrong.check().unwrap_err().to_string(),
            "restitution: [0, 1.2], expected [min, max] within 0 to 1 (a share)"
        );
    }

    #[test]
    fn hulls_fall_only_where_they_are_asked_for_and_known_and_grow_with_their_card() {
        let with = |collider| {
            scene(
                &Recipe {
                    collider,
                    objects: Range::fixed(9.0),
                    ..Recipe::default()
                },
                2,
            )
            .objects
        };
        let (boxes, hulls) = (with(Collider::Box), with(Collider::Hull));
        assert!(boxes.iter().all(|object| object.outline.is_empty()));
        assert!(
            hulls.iter().any(|object| object.photo == 0)
                && hulls.iter().any(|object| object.photo == 1)
        );
        for object in &hulls {
            let top = object.outline.last().map(|corner| corner[1]);
            assert_eq!(
                top,
                (object.photo == 0).then_some(0.035 * object.size[0] / 0.2),
                "{object:?}"
            );
        }
    }

    #[test]
    fn the_ambient_is_a_share_of_the_light_at_the_centre() {
        // 10 W straight above at 1 m: irradiance 10 / pi; half of it from a dome of radiance L: pi L.
        let light = LightRanges {
            height: Range::fixed(1.0),
            offset: Range::fixed(0.0),
            ..LightRanges::default()
        };
        let recipe = Recipe {
            lights: vec![light],
            ambient: Range::fixed(0.5),
            ..Recipe::default()
        };
        let expected = 0.5 * (10.0 / PI) / PI;
        assert!((f64::from(scene(&recipe, 0).ambient.r) - expected).abs() < 1e-6);
        let dark = Recipe {
            lights: vec![],
            ambient: Range::fixed(0.5),
            ..Recipe::default()
        };
        assert_eq!(scene(&dark, 0).ambient, LinearRgb::grey(0.5));
    }
}
