//! Scene: everything known about one picture, unknowns included.
//!
//! A [`Scene`] is plain data that reads and writes as TOML or JSON; any generator may write one and
//! enter the pipeline here. What is not known yet is an enum variant ([`CameraSource::Rectangle`],
//! [`Placement::Drop`], [`Exposure::MatchPlate`]); the stages `camera`, `settle` and `light` each
//! replace their own unknown and leave the rest unchanged. [`Scene::resolve`] gives a [`Shot`],
//! which has no unknowns. A [`Recipe`] draws scenes.
//!
//! # Examples
//! A scene drawn from a recipe is a pure function of the recipe, the seed and the scene's number:
//! ```
//! use petcomp::scene::{AssetVariant, Background, CameraSource, Recipe};
//!
//! let recipe: Recipe = toml::from_str("objects = 3\ngrade = { hue_deg = 0 }")?;
//! let camera = CameraSource::Rectangle {
//!     corners_px: [[20.0, 40.0], [620.0, 40.0], [620.0, 440.0], [20.0, 440.0]],
//!     photo: [640, 480],
//!     focal_px: None,
//! };
//! let tray = Background::new("tray", [0.6, 0.4], camera);
//! let bottle = AssetVariant {
//!     asset: "bottle".into(),
//!     role: Default::default(),
//!     photo_sizes: vec![[0.2, 0.07]],
//!     photo_outlines: vec![],
//!     thickness: 0.005,
//!     mass: 0.03,
//! };
//! let (backgrounds, catalog) = ([tray], [bottle]);
//! let scene = recipe.scene(7, 0, &backgrounds, &catalog)?;
//! assert_eq!(scene.objects.len(), 3);
//! assert_eq!(scene, recipe.scene(7, 0, &backgrounds, &catalog)?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod belt;
mod bend;
pub(crate) mod bounds;
mod catalog;
mod check;
mod count;
#[doc(hidden)]
pub mod cycles;
mod draw;
mod edges;
mod environment;
mod fall;
mod files;
mod holdout;
mod hull;
mod lens;
mod light;
mod light_direction;
mod light_map;
mod locate;
mod palette;
mod placement;
mod post_process;
mod range;
mod recipe;
mod refraction;
mod resolve;
mod shot;
mod stack;
mod start_places;
mod take;
mod variation;
mod view;
mod wall;

#[doc(hidden)]
pub use belt::{Belt, BeltRanges};
#[doc(hidden)]
pub use bend::Bend;
pub(crate) use bend::Cylinder;
pub use catalog::Background;
#[doc(hidden)]
pub use catalog::{AssetVariant, catalog};
#[doc(hidden)]
pub use count::Count;
pub use draw::Distribution;
#[doc(hidden)]
pub use draw::{DrawLog, Drawn, Draws};
#[doc(hidden)]
pub use edges::EdgeTreatment;
#[doc(hidden)]
pub use environment::EnvironmentRanges;
pub(crate) use environment::turned;
pub use environment::{Environment, EnvironmentMap};
#[doc(hidden)]
pub use fall::SettleMode;
pub use fall::SettleOptions;
#[cfg(feature = "settle")]
pub(crate) use fall::{half_extent, level};
pub(crate) use files::relative_to_file;
pub use files::{SceneFiles, SceneSettings};
#[doc(hidden)]
pub use lens::{Lens, LensRanges, ThinLens};
pub use light::{AreaLight, Exposure, LightShape, LightTint};
#[doc(hidden)]
pub use light_direction::{LightDirection, LightDirectionSource};
pub use light_map::{LightGrid, LightMap};
pub use locate::locate;
#[doc(hidden)]
pub use palette::{PaletteColor, PaletteEntry, PlasticColor, WeightedColor};
use placement::draw_paths;
pub use placement::{Grade, Object, Placement};
#[doc(hidden)]
pub use post_process::{Blur, CameraNoise, PostProcessRanges, white_balance};
pub use post_process::{Noise, PostProcess};
pub use range::Range;
pub use recipe::{Collider, Recipe};
#[doc(hidden)]
pub use recipe::{GradeRanges, LightRanges, Selections};
#[doc(hidden)]
pub use refraction::Refraction;
pub use resolve::Appearance;
pub use shot::{Card, Shot};
#[doc(hidden)]
pub use stack::DropRanges;
#[doc(hidden)]
pub use take::Take;
#[doc(hidden)]
pub use variation::{Ablation, Variation};
#[doc(hidden)]
pub use view::{View, ViewRanges};
#[doc(hidden)]
pub use wall::{Wall, WallRanges};

use crate::camera::Camera;
use crate::pixel::LinearRgb;
use serde::{Deserialize, Serialize};

/// One picture to generate: its objects and their places, its camera and its light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// Name of the background photo; empty for a transparent background.
    #[serde(default)]
    pub plate: String,
    /// The camera, or what it can be solved from.
    pub camera: CameraSource,
    /// The visible part of what that camera sees.
    #[serde(default, skip_serializing_if = "View::is_whole")]
    pub view: View,
    /// Distortion and depth of field of the camera's lens.
    #[serde(default, skip_serializing_if = "Lens::is_pinhole")]
    pub lens: Lens,
    /// The surface `z = 0` that objects lie on.
    pub surface: Surface,
    /// Objects; the first has id 1.
    #[serde(default)]
    pub objects: Vec<Object>,
    /// Area lights; without any, there are no shadows.
    #[serde(default)]
    pub lights: Vec<AreaLight>,
    /// Radiance of a constant environment, scene-linear.
    #[serde(default)]
    pub ambient: LinearRgb,
    /// Light from an environment map, in addition to `ambient`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<Environment>,
    /// Brightness of rendered light on the plate.
    #[serde(default)]
    pub exposure: Exposure,
    /// Colour of the light, on top of that of `lights` and `ambient`; environment maps have their
    /// own.
    #[serde(default, skip_serializing_if = "LightTint::is_white")]
    pub cast: LightTint,
    /// Position of the first light. Default: that in `lights`.
    #[serde(default, skip_serializing_if = "LightDirection::is_known")]
    pub light_direction: LightDirection,
    /// Distribution of the light over the surface, on top of `lights` and environment.
    #[serde(default, skip_serializing_if = "LightMap::is_even")]
    pub light_map: LightMap,
    /// Albedo of the surface for interreflection between it and the objects above it, which
    /// brightens the surface. Default: black, no interreflection.
    #[serde(default, skip_serializing_if = "LinearRgb::is_black")]
    pub interreflection: LinearRgb,
    /// Displacement of the objects by a belt since they came to rest. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub belt: Option<Belt>,
    /// Treatment of the edges of cut-outs.
    #[serde(default, skip_serializing_if = "EdgeTreatment::are_as_is")]
    pub edges: EdgeTreatment,
    /// Post-processing of the finished frame.
    #[serde(default, skip_serializing_if = "PostProcess::is_identity")]
    pub finish: PostProcess,
    /// Folders of the files that it names; without it, the recipe names them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files: Option<SceneFiles>,
    /// Settings of its picture and labels, if no recipe is given.
    #[serde(default, skip_serializing_if = "SceneSettings::is_empty")]
    pub settings: SceneSettings,
}

impl Scene {
    /// An empty surface in the dark, seen by a camera in pictures of this size, without a plate;
    /// everything else has the defaults of scene files.
    pub fn new(image: [u32; 2], camera: CameraSource, surface: Surface) -> Self {
        Self {
            image,
            plate: String::new(),
            camera,
            view: View::default(),
            lens: Lens::default(),
            surface,
            objects: Vec::new(),
            lights: Vec::new(),
            ambient: LinearRgb::BLACK,
            environment: None,
            exposure: Exposure::default(),
            cast: LightTint::default(),
            light_direction: LightDirection::default(),
            light_map: LightMap::default(),
            interreflection: LinearRgb::BLACK,
            belt: None,
            edges: EdgeTreatment::default(),
            finish: PostProcess::default(),
            files: None,
            settings: SceneSettings::default(),
        }
    }

    /// The same objects in front of the same camera in the dark, without a plate: enough if only
    /// labels are needed.
    pub fn unlit(self) -> Self {
        Self {
            plate: String::new(),
            lights: Vec::new(),
            ambient: LinearRgb::BLACK,
            environment: None,
            exposure: Exposure::Ev(0.0),
            cast: LightTint::default(),
            light_direction: LightDirection::Known,
            light_map: LightMap::default(),
            interreflection: LinearRgb::BLACK,
            edges: EdgeTreatment::AsIs,
            finish: PostProcess::default(),
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
    /// Coefficient of friction of all contacts, including those between cards; invisible walls are
    /// frictionless. Default: 0.5.
    #[serde(default = "Surface::default_friction")]
    pub friction: f64,
    /// Coefficient of restitution: share of the speed that is left after a bounce, 0 to 1. Default:
    /// 0.
    #[serde(default)]
    pub restitution: f64,
    /// The walls on its edges. Default: invisible ones, upright, frictionless and infinitely high.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<Wall>,
}

impl Surface {
    /// A surface of this width and height (metres), with the default friction and no bounce.
    pub const fn new(size: [f64; 2]) -> Self {
        Self {
            size,
            friction: Self::default_friction(),
            restitution: 0.0,
            wall: None,
        }
    }

    /// Between plastics, and between plastic and wood: 0.2 to 0.6 in tables.
    const fn default_friction() -> f64 {
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
        /// Focal length in pixels of the photo, if known from another source.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        focal_px: Option<f64>,
    },
}
