//! What a library of assets offers to recipes and to shots.

use crate::asset::{Asset, Library};
use crate::scene::hull::prism;
use crate::scene::{Appearance, AssetVariant, Object};

/// The assets of a library as a recipe sees them, in the library's order.
pub fn catalog(library: &Library) -> Vec<AssetVariant> {
    library.assets.iter().map(AssetVariant::from).collect()
}

impl From<&Asset> for AssetVariant {
    fn from(asset: &Asset) -> Self {
        Self {
            asset: asset.name.clone(),
            photo_sizes: asset.photos.iter().map(|photo| photo.size).collect(),
            photo_outlines: asset
                .photos
                .iter()
                .map(|photo| prism(&photo.outline_uv, photo.size))
                .collect(),
            thickness: asset.thickness,
            mass: asset.mass,
        }
    }
}

impl Appearance {
    /// What an object looks like by a library; none where it lacks the asset or the photo.
    pub fn from_library(library: &Library, object: &Object) -> Option<Self> {
        let asset = library.find(&object.asset)?;
        let photo = asset.photos.get(object.photo)?;
        let back = match object.back {
            Some(i) => Some(asset.photos.get(i)?.texture.clone()),
            None => None,
        };
        Some(Self {
            class: asset.class,
            texture: photo.texture.clone(),
            back,
            outline_uv: photo.outline_uv.clone(),
        })
    }
}
