//! Scene: everything an author says of one picture, unknowns included.
//!
//! A [`Scene`] is plain data that reads and writes as TOML or JSON; any generator may write one and enter the pipeline
//! here. What is not known yet is an enum variant ([`CameraSource::Rectangle`], [`Placement::Drop`],
//! [`Exposure::MatchPlate`]); the stages `camera`, `settle` and `light` each turn their own unknown into the known one
//! and leave the rest alone. [`Scene::resolve`] gives a [`Shot`], which has no unknowns. A [`Recipe`] draws scenes.

pub(crate) mod bounds;
mod check;
pub mod cycles;
mod draw;
mod environment;
mod fall;
mod finish;
mod hull;
mod light;
mod limit;
mod locate;
mod placement;
mod range;
mod recipe;
mod resolve;
mod shot;
mod stack;
mod stock;
mod variation;

pub use draw::{Distribution, DrawLog, Drawn, Draws};
pub(crate) use environment::turned;
pub use environment::{Environment, EnvironmentMap, EnvironmentRanges};
pub use fall::{SettleMode, SettleOptions};
#[cfg(feature = "settle")]
pub(crate) use fall::{half_extent, level};
pub use finish::{Finish, FinishRanges, Noise, white_balance};
pub use light::{AreaLight, Exposure, LightShape, LightTint};
pub use limit::Limit;
pub use locate::locate;
pub use placement::{Grade, Object, Placement};
pub use range::Range;
pub use recipe::{Background, Choice, Collider, GradeRanges, LightRanges, Recipe, Selections};
pub use resolve::{CATCHER, Look};
pub use shot::{Card, Shot};
pub use stack::Start;
pub use stock::stock;
pub use variation::{Ablation, Source};

use crate::camera::Camera;
use crate::pixel::LinearRgb;
use serde::{Deserialize, Serialize};

/// One picture to make: what is in it, where, seen by which camera, under which light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// Name of the background photo; empty for a transparent background.
    #[serde(default)]
    pub plate: String,
    /// The camera, or what it can be found from.
    pub camera: CameraSource,
    /// The surface `z = 0` that objects lie on.
    pub surface: Surface,
    /// Objects; the first has id 1.
    #[serde(default)]
    pub objects: Vec<Object>,
    /// Area lights; none is a scene without shadows.
    #[serde(default)]
    pub lights: Vec<AreaLight>,
    /// Radiance of a constant environment, scene-linear.
    #[serde(default)]
    pub ambient: LinearRgb,
    /// Light from a picture of the surroundings, on top of `ambient`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<Environment>,
    /// How bright rendered light is on the plate.
    #[serde(default)]
    pub exposure: Exposure,
    /// Colour of the light, on top of that of lights and `ambient`; pictures of the surroundings bring their own.
    #[serde(default, skip_serializing_if = "LightTint::is_white")]
    pub cast: LightTint,
    /// What happens to the finished frame.
    #[serde(default, skip_serializing_if = "Finish::is_nothing")]
    pub finish: Finish,
}

impl Scene {
    /// The same objects before the same camera in the dark, without a plate: what is left where only labels are asked.
    pub fn unlit(self) -> Self {
        Self {
            plate: String::new(),
            lights: Vec::new(),
            ambient: LinearRgb::BLACK,
            environment: None,
            exposure: Exposure::Ev(0.0),
            cast: LightTint::default(),
            finish: Finish::default(),
            ..self
        }
    }
}

/// A labelled rectangle of known size: the plane `z = 0`, centred on the world's origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Width (along x) and height (along y), metres.
    pub size: [f64; 2],
    /// Coefficient of friction of everything that touches here, the cards among themselves too; the walls over the edges,
    /// which nobody sees, are smooth. Default: 0.5.
    #[serde(default = "Surface::usual_friction")]
    pub friction: f64,
    /// Share of the speed that a bounce gives back, 0 to 1. Default: 0.
    #[serde(default)]
    pub restitution: f64,
}

impl Surface {
    /// A surface of this width and height (metres), with the usual friction and no bounce.
    pub const fn new(size: [f64; 2]) -> Self {
        Self {
            size,
            friction: Self::usual_friction(),
            restitution: 0.0,
        }
    }

    /// Between plastics, and between plastic and wood: 0.2 to 0.6 in tables.
    const fn usual_friction() -> f64 {
        0.5
    }
}

/// The camera, or the labelled rectangle it can be solved from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CameraSource {
    /// A camera that is known.
    Known(Camera),
    /// Corners of the scene's surface in a photo.
    Rectangle {
        /// Top left, top right, bottom right, bottom left; pixels of the photo.
        corners_px: [[f64; 2]; 4],
        /// Width and height of the photo, pixels.
        photo: [u32; 2],
        /// Focal length in pixels of the photo, where it is known from elsewhere.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        focal_px: Option<f64>,
    },
}
