//! What recipes and shots can choose from: the assets of a library, and labelled backgrounds.

use crate::asset::{Asset, Library, Photo, Role};
use crate::color::Albedo;
use crate::scene::hull::prism_outline;
use crate::scene::{Appearance, CameraSource, Object, Wall};

/// An asset as a recipe sees it: what may be chosen, without its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetVariant {
    /// Name of the asset.
    pub asset: String,
    /// Which part of the catalog it belongs to: objects or distractors.
    pub role: Role,
    /// Width and height of the card of each of its photos, metres; at least one.
    pub photo_sizes: Vec<[f64; 2]>,
    /// Corners of the object's hull in each photo, as in [`Object::outline`]; empty where they are
    /// not known.
    pub photo_outlines: Vec<Vec<[f64; 2]>>,
    /// Thickness, metres.
    pub thickness: f64,
    /// Mass, kilograms.
    pub mass: f64,
}

/// A labelled photo of the place, as a recipe sees it: without its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Background {
    /// Name, kept as [`Scene::plate`](crate::scene::Scene::plate).
    pub name: String,
    /// Width and height of the labelled rectangle, metres.
    pub size: [f64; 2],
    /// The camera that took it, or what that can be found from.
    pub camera: CameraSource,
    /// OpenCV's first coefficient of that camera's radial distortion; 0 where it has none.
    pub k1: f64,
    /// Longer side of the part of the photo that pictures show, over that of the photo.
    pub shown_share: f64,
    /// Share of the light that its surface reflects, where that is known.
    pub albedo: Option<Albedo>,
    /// The walls on the edges of that rectangle, where there are any.
    pub wall: Option<Wall>,
}

/// The assets of a library as a recipe sees them, in the library's order.
pub fn catalog(library: &Library) -> Vec<AssetVariant> {
    library.assets.iter().map(AssetVariant::from).collect()
}

impl From<&Asset<Photo>> for AssetVariant {
    fn from(asset: &Asset<Photo>) -> Self {
        Self {
            asset: asset.name.clone(),
            role: asset.role,
            photo_sizes: asset.photos.iter().map(Photo::size).collect(),
            photo_outlines: asset.photos.iter().map(collider_outline).collect(),
            thickness: asset.thickness,
            mass: asset.mass,
        }
    }
}

fn collider_outline(photo: &Photo) -> Vec<[f64; 2]> {
    prism_outline(&photo.outline_uv, photo.size())
}

impl Appearance {
    /// What an object looks like by a library; none where it lacks the asset or the photo.
    pub fn from_library(library: &Library, object: &Object) -> Option<Self> {
        let asset = library.find(&object.asset)?;
        let photo = asset.photos.get(object.photo)?;
        let back = match object.back {
            Some(i) => Some(asset.photos.get(i)?),
            None => None,
        };
        let surfaces = [Some(photo), back].map(|photo| photo.map(|photo| photo.surface.clone()));
        Some(Self {
            class: match object.role {
                Role::Object => library.class_number(asset),
                Role::Distractor => None,
            },
            texture: photo.texture.clone(),
            back: back.map(|photo| photo.texture.clone()),
            outline_uv: photo.outline_uv.clone(),
            flows: [
                photo.flow.clone(),
                back.and_then(|photo| photo.flow.clone()),
            ],
            surfaces: surfaces.map(Option::unwrap_or_default),
        })
    }
}
