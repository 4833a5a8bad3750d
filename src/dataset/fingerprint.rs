//! What a dataset is made from, by content: everything that decides a picture or a label.

use crate::asset::{Asset, Library, Photo};
use crate::dataset::background_photo::BackgroundPhoto;
use crate::dataset::environment_maps::EnvironmentMaps;
use crate::dataset::{DatasetConfig, Inputs};
use crate::error::Result;
use crate::scene::Background;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Everything that decides what a picture or its labels are: values as they are, pictures by
/// checksum; not where folders are. Two datasets of equal fingerprint, seed and program have the
/// same samples.
///
/// Lists are in the order that draws choose by, so a new, missing or moved entry shows.
///
/// # Errors
/// A photo or an environment map that cannot be read, or that has changed since pictures were made
/// from it.
pub(super) fn fingerprint(
    config: &DatasetConfig,
    library: &Library,
    places: &[BackgroundPhoto],
    surroundings: &EnvironmentMaps,
    inputs: &mut Inputs,
) -> Result<Value> {
    let DatasetConfig {
        scene,
        render,
        labels,
        ..
    } = config;
    let assets: Vec<Value> = library.assets.iter().map(of_asset).collect();
    Ok(json!({
        "scene": scene,
        "render": render,
        "label": labels.options,
        "assets": assets,
        "backgrounds": of_places(places, inputs)?,
        "notes": notes(places),
        "environments": of_surroundings(surroundings, inputs)?,
    }))
}

fn of_asset(asset: &Asset<Photo>) -> Value {
    let mut told = json!({
        "name": asset.name,
        "class": asset.class,
        "thickness": asset.thickness,
        "mass": asset.mass,
        "photos": asset.photos.iter().map(of_photo).collect::<Vec<_>>(),
    });
    if !asset.role.is_object() {
        told["role"] = json!(asset.role);
    }
    told
}

fn of_photo(photo: &Photo) -> Value {
    let checksums = photo.checksums();
    let mut told = json!({
        "file": photo.record.file,
        "px_per_metre": photo.record.px_per_metre,
        "size_m": photo.size(),
        "outline_px": digest(&photo.record.outline_px),
        "pixels": shown(checksums.texture),
    });
    if let Some(flow) = checksums.flow {
        told["flow"] = json!(shown(flow));
    }
    if let Some(captured) = &photo.record.captured {
        told["height"] = json!(captured.height);
    }
    told
}

fn of_places(places: &[BackgroundPhoto], inputs: &mut Inputs) -> Result<Vec<Value>> {
    let photos = inputs.checksums(&photo_files(places))?;
    let mut fronts = inputs.checksums(&front_files(places))?.into_iter();
    let pairs = places.iter().zip(photos);
    pairs
        .map(|(place, photo)| {
            let front = place.front.as_ref().and_then(|_| fronts.next());
            place.check_files(photo, front)?;
            Ok(of_place(place, photo, front))
        })
        .collect()
}

/// The masks next to backgrounds of what hides objects, by the names of their inputs.
fn front_files(places: &[BackgroundPhoto]) -> Vec<(String, &Path)> {
    let masks = places.iter().filter_map(|place| {
        let name = format!("front of {}", place.background.name);
        Some((name, place.front.as_deref()?))
    });
    masks.collect()
}

/// The photos of backgrounds, by the names of their inputs.
fn photo_files(places: &[BackgroundPhoto]) -> Vec<(String, &Path)> {
    let photos = places.iter().map(|place| {
        let name = format!("background {}", place.background.name);
        (name, &*place.photo)
    });
    photos.collect()
}

fn of_place(place: &BackgroundPhoto, photo: u32, front: Option<u32>) -> Value {
    let (background, kept) = (&place.background, &place.kept);
    let kept = [kept.x, kept.y, kept.width, kept.height];
    let mut place_values = json!({
        "name": background.name,
        "size": background.size,
        "camera": camera_digest(background, kept),
        "photo": shown(photo),
    });
    if let Some(albedo) = background.albedo {
        place_values["albedo"] = json!(albedo);
    }
    if let Some(wall) = background.wall {
        place_values["wall"] = json!(wall);
    }
    if let Some(front) = front {
        place_values["front"] = json!(shown(front));
    }
    place_values
}

/// Checksum of a camera, the part of its photo that is shown, and its lens where that is not ideal.
fn camera_digest(background: &Background, kept: [usize; 4]) -> String {
    let camera = background.camera;
    match background.k1 {
        0.0 => digest(&(camera, kept)),
        k1 => digest(&(camera, kept, k1)),
    }
}

/// What the user should know about the backgrounds, by their names: the report shows it.
fn notes(places: &[BackgroundPhoto]) -> BTreeMap<&str, &[String]> {
    let noted = places.iter().filter(|place| !place.notes.is_empty());
    noted
        .map(|place| (place.background.name.as_str(), place.notes.as_slice()))
        .collect()
}

fn of_surroundings(surroundings: &EnvironmentMaps, inputs: &mut Inputs) -> Result<Vec<Value>> {
    let files: Vec<_> = surroundings.files().collect();
    let named: Vec<(String, &Path)> = files
        .iter()
        .map(|(name, path)| (format!("environment {name}"), path.as_path()))
        .collect();
    let checksums = inputs.checksums(&named)?;
    let pairs = files.iter().zip(checksums);
    pairs
        .map(|((name, path), checksum)| {
            surroundings.check_file(path, checksum)?;
            Ok(json!({ "file": name, "content": shown(checksum) }))
        })
        .collect()
}

/// Checksum of a value's text, which has numbers to the last bit.
fn digest(value: &impl Serialize) -> String {
    shown(crc32fast::hash(json!(value).to_string().as_bytes()))
}

fn shown(crc32: u32) -> String {
    format!("crc32 {crc32:08x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::{PhotoRecord, Pixels};
    use crate::image::Image;
    use crate::matte::{Flow, LightPath};
    use crate::pixel::PremulRgba;
    use std::sync::Arc;

    #[test]
    fn another_flow_shows() {
        let outline = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 2.0]];
        let record = PhotoRecord::new("a.exr", 10.0, [0.4, 0.2], outline);
        let clear = Pixels::from(Image::filled(4, 2, PremulRgba::TRANSPARENT));
        let bent = |haze: f32, height: f64, known: bool| {
            let paths = LightPath {
                haze,
                ..LightPath::default()
            };
            let flow = Flow {
                paths: Image::filled(4, 2, paths),
                known: Image::filled(4, 2, known),
                width: 0.4,
                height,
            };
            let pixels = Pixels {
                flow: Some(Arc::new(flow)),
                ..clear.clone()
            };
            of_photo(&Photo::new(pixels, record.clone()))["flow"].clone()
        };
        let usual = bent(0.1, 0.03, true);
        assert!(usual.is_string());
        for other in [(0.2, 0.03, true), (0.1, 0.04, true), (0.1, 0.03, false)] {
            assert_ne!(bent(other.0, other.1, other.2), usual);
        }
        let plain = Photo::new(clear.clone(), record.clone());
        assert!(of_photo(&plain).get("flow").is_none(), "identities stay");
    }
}
