//! What a library of assets offers to recipes and to shots.

use crate::asset::{Asset, Library, Photo};
use crate::scene::hull::prism;
use crate::scene::{Choice, Look, Object};

/// The assets of a library as a recipe sees them, in the library's order.
pub fn stock(library: &Library) -> Vec<Choice> {
    library.assets.iter().map(Choice::from).collect()
}

impl From<&Asset<Photo>> for Choice {
    fn from(asset: &Asset<Photo>) -> Self {
        Self {
            asset: asset.name.clone(),
            photo_sizes: asset.photos.iter().map(Photo::size).collect(),
            photo_outlines: asset
                .photos
                .iter()
                .map(|photo| prism(&photo.outline_uv, photo.size()))
                .collect(),
            thickness: asset.thickness,
            mass: asset.mass,
        }
    }
}

impl Look {
    /// What an object looks like by a library; none where it lacks the asset or the photo.
    pub fn of(library: &Library, object: &Object) -> Option<Self> {
        let asset = library.find(&object.asset)?;
        let photo = asset.photos.get(object.photo)?;
        let back = match object.back {
            Some(i) => Some(asset.photos.get(i)?.texture.clone()),
            None => None,
        };
        Some(Self {
            class: library.class_number(asset),
            texture: photo.texture.clone(),
            back,
            outline_uv: photo.outline_uv.clone(),
        })
    }
}
