//! Recipe: the distributions that scenes are drawn from.

use crate::error::{Error, Result};
use crate::pixel::LinearRgb;
use crate::scene::stack::{Start, stack};
use crate::scene::{
    AreaLight, CameraSource, Draws, Exposure, Grade, LightShape, Object, Range, Scene, SettleOptions, Surface,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Most objects in one scene.
const MOST_OBJECTS: usize = 10_000;

/// What scenes are drawn from; every [`Range`] is a uniform distribution named by its path in this document.
///
/// A file only says what it wants otherwise: every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Recipe {
    /// Width and height of the pictures, pixels. Default: `[640, 480]`.
    pub image: [u32; 2],
    /// Objects in a scene. Default: `[4, 12]`.
    pub objects: Range,
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
    /// Brighter or darker than the plate, EV. Default: `[-0.3, 0.3]`.
    pub gain_ev: Range,
    /// How objects come to rest.
    pub settle: SettleOptions,
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
            SelectionsInFile::Word(word) => Err(format!("\"{word}\", expected \"unique\" or a number above 0")),
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
}

/// An asset as a recipe sees it: what may be chosen, without its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Name of the asset.
    pub asset: String,
    /// Width and height of the card of each of its photos, metres; at least one.
    pub photo_sizes: Vec<[f64; 2]>,
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
    /// Its corners: top left, top right, bottom right, bottom left; pixels of the photo.
    pub corners_px: [[f64; 2]; 4],
    /// Width and height of the photo, pixels.
    pub photo: [u32; 2],
    /// Focal length in pixels of the photo, where it is known from elsewhere.
    pub focal_px: Option<f64>,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            image: [640, 480],
            objects: Range::new(4.0, 12.0),
            selections: Selections::Unique,
            scale: Range::new(0.9, 1.1),
            start: Start::default(),
            grade: GradeRanges::default(),
            lights: vec![LightRanges::default()],
            ambient: Range::new(0.3, 0.8),
            gain_ev: Range::new(-0.3, 0.3),
            settle: SettleOptions::default(),
        }
    }
}

impl Default for GradeRanges {
    fn default() -> Self {
        Self { hue_deg: Range::new(-20.0, 20.0), saturation: Range::new(0.8, 1.2), value: Range::new(0.8, 1.2) }
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
    pub fn scene(&self, seed: u64, k: u64, backgrounds: &[Background], stock: &[Choice]) -> Result<Scene> {
        self.check()?;
        let draws = Draws::new(seed, k);
        let background = pick_background(&draws, backgrounds)?;
        let mut objects = self.choose(seed, k, stock)?;
        for (i, object) in objects.iter_mut().enumerate() {
            self.vary(object, &draws, &format!("objects[{i}]"));
        }
        let surface = Surface { size: background.size };
        stack(&mut objects, surface, &self.start, &self.settle, &draws)?;
        let lights: Vec<AreaLight> =
            self.lights.iter().enumerate().map(|(i, light)| light.draw(&draws, &format!("lights[{i}]"))).collect();
        let scene = Scene {
            image: self.image,
            plate: background.name.clone(),
            camera: CameraSource::Rectangle {
                corners_px: background.corners_px,
                photo: background.photo,
                focal_px: background.focal_px,
            },
            surface,
            objects,
            ambient: ambient(&lights, self.ambient.draw(&draws, "ambient")),
            lights,
            exposure: Exposure::MatchPlate { gain_ev: self.gain_ev.draw(&draws, "gain_ev") },
        };
        scene.check()?;
        Ok(scene)
    }

    /// Fails on the first value that cannot be right.
    pub fn check(&self) -> Result<()> {
        let any = f64::INFINITY;
        if self.image.contains(&0) {
            return Err(Error::value("image", format!("{:?}, expected two numbers above 0", self.image)));
        }
        self.objects.check_count("objects", MOST_OBJECTS)?;
        self.scale.check_positive("scale")?;
        self.start.check()?;
        self.grade.hue_deg.check("grade.hue_deg", -any, any)?;
        self.grade.saturation.check("grade.saturation", 0.0, any)?;
        self.grade.value.check("grade.value", 0.0, any)?;
        self.lights.iter().enumerate().try_for_each(|(i, light)| light.check(&format!("lights[{i}]")))?;
        self.ambient.check("ambient", 0.0, any)?;
        self.gain_ev.check("gain_ev", -32.0, 32.0)?;
        self.settle.check()
    }

    /// Assets and photos of one selection, at their own size and colour.
    fn choose(&self, seed: u64, k: u64, stock: &[Choice]) -> Result<Vec<Object>> {
        let selection = match self.selections {
            Selections::Unique => k,
            Selections::Of(0) => return Err(Error::value("selections", "0, expected at least 1")),
            Selections::Of(n) => k % n,
        };
        let draws = Draws::new(seed, selection);
        let count = self.objects.draw_count(&draws, "selection.objects");
        if count > 0 && stock.is_empty() {
            return Err(Error::value("objects", format!("{count} asked for, but there is no asset to choose from")));
        }
        let mut left = Vec::new();
        (0..count)
            .map(|i| {
                if left.is_empty() {
                    left = (0..stock.len()).collect();
                }
                let choice = &stock[left.swap_remove(draws.below(&format!("selection[{i}].asset"), left.len()))];
                choice.object(&draws, &format!("selection[{i}].photo"))
            })
            .collect()
    }

    fn vary(&self, object: &mut Object, draws: &Draws, path: &str) {
        let scale = self.scale.draw(draws, &format!("{path}.scale"));
        object.size = object.size.map(|length| length * scale);
        object.thickness *= scale;
        object.mass *= scale * scale * scale;
        object.grade = Grade {
            hue_deg: self.grade.hue_deg.draw(draws, &format!("{path}.grade.hue_deg")) as f32,
            saturation: self.grade.saturation.draw(draws, &format!("{path}.grade.saturation")) as f32,
            value: self.grade.value.draw(draws, &format!("{path}.grade.value")) as f32,
        };
    }
}

impl Choice {
    fn object(&self, draws: &Draws, path: &str) -> Result<Object> {
        if self.photo_sizes.is_empty() {
            return Err(Error::value(format!("assets.{}", self.asset), "no photo, expected at least one"));
        }
        let photo = draws.below(path, self.photo_sizes.len());
        Ok(Object {
            asset: self.asset.clone(),
            photo,
            size: self.photo_sizes[photo],
            thickness: self.thickness,
            mass: self.mass,
            placement: Start::unplaced(),
            grade: Grade::default(),
        })
    }
}

impl LightRanges {
    fn draw(&self, draws: &Draws, path: &str) -> AreaLight {
        let of = |range: &Range, name: &str| range.draw(draws, &format!("{path}.{name}"));
        let (offset, azimuth) = (of(&self.offset, "offset"), of(&self.azimuth_deg, "azimuth_deg").to_radians());
        let color = [0, 1, 2].map(|c| of(&self.color[c], &format!("color[{c}]")) as f32);
        AreaLight {
            shape: self.shape,
            position: [offset * libm::cos(azimuth), offset * libm::sin(azimuth), of(&self.height, "height")],
            target: [0.0; 3],
            size: [of(&self.size, "size"); 2],
            power: of(&self.power, "power"),
            color: LinearRgb::new(color[0], color[1], color[2]),
        }
    }

    fn check(&self, at: &str) -> Result<()> {
        self.height.check_positive(&format!("{at}.height"))?;
        self.offset.check(&format!("{at}.offset"), 0.0, f64::INFINITY)?;
        self.azimuth_deg.check(&format!("{at}.azimuth_deg"), -f64::INFINITY, f64::INFINITY)?;
        self.size.check_positive(&format!("{at}.size"))?;
        self.power.check(&format!("{at}.power"), 0.0, f64::INFINITY)?;
        (0..3).try_for_each(|c| self.color[c].check(&format!("{at}.color[{c}]"), 0.0, f64::INFINITY))
    }
}

fn pick_background<'a>(draws: &Draws, backgrounds: &'a [Background]) -> Result<&'a Background> {
    match backgrounds.len() {
        0 => Err(Error::value("backgrounds", "none, expected at least one labelled photo")),
        n => Ok(&backgrounds[draws.below("background", n)]),
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
        sum + light.color.scale((share * light.power * h / (PI * PI * d * d * d)) as f32)
    })
}
