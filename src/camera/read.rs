//! Labels from files, with what their photos know.

use super::label::Label;
use crate::error::{Error, Result};
use crate::io;
use std::path::{Path, PathBuf};

/// Reads a label (`NAME.label.json`), with what its photo knows of the focal length where it says nothing itself.
///
/// # Errors
/// A file that cannot be read or understood; a photo of another size than the label says.
pub fn read_label(path: impl AsRef<Path>) -> Result<Label> {
    let path = path.as_ref();
    with_photo(io::read_json(path)?, path)
}

/// A label that was read from `path`, with the focal length of its photo's EXIF data where it says nothing itself; as it
/// is where the photo is not there.
///
/// # Errors
/// A photo that cannot be read, or has another size than the label says.
pub fn with_photo(mut label: Label, path: impl AsRef<Path>) -> Result<Label> {
    let path = path.as_ref();
    let Some(photo) = photo_of(&label, path) else { return Ok(label) };
    let header = io::read_header(&photo)?;
    let (seen, told) = ([header.width, header.height], label.image_size().map(|side| side as usize));
    if seen != told {
        let what = format!("{told:?} pixels, but {} has {seen:?}", photo.display());
        return Err(Error::value("image", what).in_file(path));
    }
    if label.camera.focal_px.is_none() && label.camera.focal_35mm.is_none() {
        label.camera.focal_35mm = header.focal_35mm.filter(|mm| *mm > 0.0);
    }
    Ok(label)
}

/// The picture of a label that was read from `path`, where it is there.
pub fn photo_of(label: &Label, path: impl AsRef<Path>) -> Option<PathBuf> {
    let photo = path.as_ref().with_file_name(&label.image.file);
    (!label.image.file.is_empty() && photo.is_file()).then_some(photo)
}
