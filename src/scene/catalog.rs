//! What recipes and shots can choose from: the assets of a library, and labelled backgrounds.

use crate::asset::{Asset, Library, Photo, Pixels, Role};
use crate::color::Albedo;
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::scene::hull::prism_outline;
use crate::scene::{Appearance, CameraSource, Object, Wall};
use std::sync::Arc;

/// An asset as a recipe sees it, without its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetVariant {
    /// Name of the asset.
    pub asset: String,
    /// Whether it is drawn as an object or as a distractor.
    pub role: Role,
    /// Width and height of the card of each of its photos, metres; at least one.
    pub photo_sizes: Vec<[f64; 2]>,
    /// Corners of the object's hull in each photo, as in [`Object::outline`]; empty if unknown.
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
    /// The camera that took it, or what it can be solved from.
    pub camera: CameraSource,
    /// OpenCV's first coefficient of that camera's radial distortion; 0 for none.
    pub k1: f64,
    /// Longer side of the part of the photo that pictures show, as a share of the photo's.
    pub shown_share: f64,
    /// Share of the light that its surface reflects, if known.
    pub albedo: Option<Albedo>,
    /// The walls on the edges of that rectangle, if any.
    pub wall: Option<Wall>,
}

impl Background {
    /// The whole of a photo that a lens without distortion took, of a surface of unknown albedo
    /// without walls.
    pub fn new(name: impl Into<String>, size: [f64; 2], camera: CameraSource) -> Self {
        Self {
            name: name.into(),
            size,
            camera,
            k1: 0.0,
            shown_share: 1.0,
            albedo: None,
            wall: None,
        }
    }
}

/// The assets of a library as a recipe sees them, in the library's order.
pub fn catalog(library: &Library) -> Vec<AssetVariant> {
    library.assets.iter().map(variant_of).collect()
}

fn variant_of(asset: &Asset<Photo>) -> AssetVariant {
    AssetVariant {
        asset: asset.name.clone(),
        role: asset.role,
        photo_sizes: asset.photos.iter().map(Photo::size).collect(),
        photo_outlines: asset.photos.iter().map(collider_outline).collect(),
        thickness: asset.thickness,
        mass: asset.mass,
    }
}

fn collider_outline(photo: &Photo) -> Vec<[f64; 2]> {
    prism_outline(&photo.outline_uv, photo.size())
}

/// The photo of an asset that an object names as its back.
fn back_of(asset: &Asset<Photo>, i: usize) -> Result<&Photo> {
    asset.photos.get(i).ok_or_else(|| {
        let what = format!("{i}, expected a photo of \"{}\" in the library", asset.name);
        Error::value("back", what)
    })
}

impl Appearance {
    /// Appearance of an object, from a library; none if the library lacks the asset or the photo.
    ///
    /// # Errors
    /// Those of [`Photo::pixels`]; [`Error::Value`] for a back that the asset lacks.
    pub fn from_library(library: &Library, object: &Object) -> Result<Option<Self>> {
        let Some(asset) = library.find(&object.asset) else {
            return Ok(None);
        };
        let Some(front) = asset.photos.get(object.photo) else {
            return Ok(None);
        };
        let back = object.back.map(|i| back_of(asset, i)).transpose()?;
        let outline_uv = front.outline_uv.clone();
        let front = front.pixels()?;
        let back = back.map(Photo::pixels).transpose()?;
        let class = match object.role {
            Role::Object => library.class_number(asset),
            Role::Distractor => None,
        };
        Ok(Some(Self::from_pixels(class, outline_uv, front, back)))
    }

    fn from_pixels(
        class: Option<u32>,
        outline_uv: Arc<[Point2<f64>]>,
        front: Pixels,
        back: Option<Pixels>,
    ) -> Self {
        let flow = back.as_ref().and_then(|back| back.flow.clone());
        let surface = back.as_ref().map(|back| back.surface.clone());
        Self {
            class,
            outline_uv,
            texture: front.texture,
            back: back.map(|back| back.texture),
            flows: [front.flow, flow],
            surfaces: [front.surface, surface.unwrap_or_default()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_back_that_the_asset_lacks_is_told() {
        let asset = Asset {
            name: "b1".into(),
            role: Role::Object,
            class: String::new(),
            thickness: 0.005,
            mass: 0.03,
            photos: vec![],
        };
        assert_eq!(
            back_of(&asset, 9).unwrap_err().to_string(),
            "back: 9, expected a photo of \"b1\" in the library"
        );
    }
}
