//! Putting photos into an asset folder.

use super::files;
use super::library::Photo;
use super::manifest::{AssetRecord, Manifest, PhotoRecord, check_name, check_positive};
use super::measure::Measured;
use super::screen_source::ScreenSource;
use super::{DEFAULT_MASS, DEFAULT_THICKNESS, MANIFEST};
use crate::error::{Error, Result};
use crate::io;
use crate::matte::{CutOut, CutOutOptions, Remark, cut_out_on};
use crate::stopwatch::Stopwatch;
use std::path::Path;

/// What is known of a photo that is not in the photo.
#[derive(Clone, Debug, PartialEq)]
pub struct AddPhoto {
    /// Name of the object: letters, digits, `_`, `-` and `.`.
    pub asset: String,
    /// Name of its class.
    pub class: String,
    /// Scale of the photo.
    pub scale: Scale,
    /// Thickness of the body that falls, metres.
    pub thickness: f64,
    /// Mass, kilograms.
    pub mass: f64,
    /// What it was photographed on.
    pub screen: ScreenSource,
    /// How it is cut out.
    pub options: CutOutOptions,
}

/// How large the things in a photo are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Pixels of the photo for a metre.
    PxPerMetre(f64),
    /// Length of the object along its longest side, metres.
    Length(f64),
    /// Length and width of the object, longest first, metres.
    Size([f64; 2]),
}

impl AddPhoto {
    /// A photo with default thickness, mass and options.
    pub fn new(asset: impl Into<String>, class: impl Into<String>, scale: Scale) -> Self {
        Self {
            asset: asset.into(),
            class: class.into(),
            scale,
            thickness: DEFAULT_THICKNESS,
            mass: DEFAULT_MASS,
            screen: ScreenSource::Auto,
            options: CutOutOptions::default(),
        }
    }

    /// # Errors
    /// [`Error::Value`] for the first value that cannot be right.
    pub(super) fn check(&self, manifest: &Manifest) -> Result<()> {
        check_name(&self.asset).map_err(|e| match e {
            Error::Value { what, .. } => Error::value("asset", what),
            other => other,
        })?;
        manifest.class(&self.class)?;
        match self.scale {
            Scale::PxPerMetre(scale) => check_positive("px_per_metre", scale)?,
            Scale::Length(length) => check_positive("length", length)?,
            Scale::Size([length, width]) => {
                check_positive("length", length)?;
                check_positive("width", width)?;
                if width > length {
                    return Err(Error::value("width", format!("{width}, expected at most the length of {length}")));
                }
            }
        }
        check_positive("thickness", self.thickness)?;
        check_positive("mass", self.mass)
    }
}

/// Cuts the object out of a photo and adds it to an asset folder, which is made if it is not there.
///
/// Adding the same photo to the same asset again replaces it. The manifest is written last, whole or not at all. Not for
/// two processes at once: the later manifest wins.
///
/// # Errors
/// [`Error::Value`] for a wrong name, class or size; those of reading the photo and of [`cut_out`](crate::matte::cut_out), naming the photo;
/// those of writing.
pub fn add_photo(folder: impl AsRef<Path>, photo: impl AsRef<Path>, add: &AddPhoto) -> Result<Photo> {
    let folder = folder.as_ref();
    let mut manifest = read_or_new(folder)?;
    add.check(&manifest)?;
    let photo = write_photo(folder, photo.as_ref(), add)?;
    manifest.insert(asset_of(add, photo.record.clone()))?;
    manifest.write(folder)?;
    Ok(photo)
}

/// The manifest of a folder; a new one where there is no manifest.
pub(super) fn read_or_new(folder: &Path) -> Result<Manifest> {
    match folder.join(MANIFEST).exists() {
        true => Manifest::read(folder),
        false => Ok(Manifest::default()),
    }
}

pub(super) fn asset_of(add: &AddPhoto, photo: PhotoRecord) -> AssetRecord {
    AssetRecord {
        name: add.asset.clone(),
        class: add.class.clone(),
        thickness: add.thickness,
        mass: add.mass,
        photos: vec![photo],
    }
}

/// Cuts the object out of a photo and writes cut-out, outline and thumbnail.
pub(super) fn write_photo(folder: &Path, photo: &Path, add: &AddPhoto) -> Result<Photo> {
    let mut watch = Stopwatch::start();
    let picture = io::read(photo)?;
    watch.lap("read");
    let empty = add.screen.empty()?;
    let options = CutOutOptions { screen: add.screen.color().or(add.options.screen), ..add.options.clone() };
    let cut = cut_out_on(&picture, empty.as_ref(), &options).map_err(|e| match e {
        Error::Photo { what } => Error::Photo { what: format!("{}: {what}", photo.display()) },
        other => other,
    })?;
    watch.lap("cut out");
    for remark in &cut.remarks {
        let level = if matches!(remark, Remark::ScreenHue(_)) { log::Level::Warn } else { log::Level::Info };
        log::log!(level, "{}: {remark}", photo.display());
    }
    let file = cut_out_file(photo, add);
    io::create_folder(folder.join(&add.asset))?;
    files::write(&folder.join(&file), &cut)?;
    watch.lap("write");
    let record = record(&cut, add, file, photo);
    watch.lap("measure");
    watch.log(photo.display());
    Ok(Photo::new(cut.film, record))
}

/// Where the cut-out of a photo goes.
pub(super) fn cut_out_file(photo: &Path, add: &AddPhoto) -> String {
    format!("{}/{}.exr", add.asset, stem(photo))
}

/// The photo's name without ending, safe as a name anywhere.
fn stem(photo: &Path) -> String {
    let stem = photo.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    stem.chars().map(plain).collect()
}

fn record(cut: &CutOut, add: &AddPhoto, file: String, photo: &Path) -> PhotoRecord {
    let measured = Measured::of(cut, add.scale);
    let (w, h) = cut.film.size();
    let doubts = cut.remarks.iter().filter(|r| r.is_doubt()).map(Remark::to_string).chain(measured.doubt);
    PhotoRecord {
        file,
        source: photo.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        px_per_metre: measured.px_per_metre,
        size_m: [w as f64, h as f64].map(|px| px / measured.px_per_metre),
        object_m: measured.object_m,
        error_m: measured.error_m,
        hull_m: measured.hull_m,
        screen: cut.screen,
        matte: cut.method,
        residue: f64::from(cut.residue),
        unevenness: f64::from(cut.unevenness),
        confidence: cut.segmentation.confidence.value(),
        doubts: doubts.collect(),
        truncated: cut.segmentation.touches.contains(&true),
        outline_px: cut.hull.iter().map(files::rounded).collect(),
    }
}
