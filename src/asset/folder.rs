//! Putting photos into an asset folder.

use super::files;
use super::ground::OnScreen;
use super::library::Photo;
use super::manifest::{AssetRecord, Manifest, PhotoRecord, check_class, check_name};
use super::measure::Measured;
use super::screen_source::ScreenSource;
use super::{DEFAULT_MASS, DEFAULT_THICKNESS, MANIFEST};
use crate::bounds::{MASS, OBJECT, PX_PER_METRE, SURFACE, THICKNESS, WIDTH, number};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::io;
use crate::matte::{ColorDoubts, CutOut, CutOutOptions, cut_out_on};
use crate::stopwatch::Stopwatch;
use std::path::Path;

/// What is known of a photo that is not in the photo.
#[derive(Clone, Debug, PartialEq)]
pub struct AddPhoto {
    /// Name of the object: letters and digits of any language, `_`, `-` and `.`.
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
    /// Names of the folder's classes in order, where they are declared. Default: a class that the folder does not have
    /// comes behind those that it has.
    pub classes: Vec<String>,
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
    /// Width and height of the whole screen, metres, with its corners where they are known (from the top left, clockwise,
    /// pixels); else they are found. The object's scale is that at half its thickness above the screen.
    Screen([f64; 2], Option<[[f64; 2]; 4]>),
    /// Side of the black square of a printed marker that lies on the screen (AprilTag tag36h11 or ArUco DICT_4X4_50),
    /// metres.
    Marker(f64),
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
            classes: Vec::new(),
        }
    }

    /// # Errors
    /// [`Error::Value`] for the first value that cannot be right.
    pub(super) fn check(&self, manifest: &Manifest) -> Result<()> {
        check_name(&self.asset).map_err(|e| match e {
            Error::Value { what, .. } => Error::value("asset", what),
            other => other,
        })?;
        check_class(&self.class)?;
        manifest.class(&self.class)?;
        match self.scale {
            Scale::PxPerMetre(scale) => PX_PER_METRE.check("px_per_metre", scale)?,
            Scale::Length(length) => OBJECT.check("length", length)?,
            Scale::Size([length, width]) => {
                OBJECT.check("length", length)?;
                WIDTH.check("width", width)?;
                if width > length {
                    return Err(Error::value(
                        "width",
                        format!("{width}, expected at most the length of {length}"),
                    ));
                }
            }
            Scale::Screen(size, _) => size
                .into_iter()
                .try_for_each(|side| SURFACE.check("screen_size", side))?,
            Scale::Marker(side) => OBJECT.check("marker_size", side)?,
        }
        THICKNESS.check("thickness", self.thickness)?;
        MASS.check("mass", self.mass)
    }

    /// The scale makes a thing of the object that can be photographed on a screen.
    fn check_length(&self, record: &PhotoRecord) -> Result<()> {
        let length = record.object_m[0];
        if OBJECT.contains(length) {
            return Ok(());
        }
        let pixels_for = || {
            OBJECT
                .unit_meant(length)
                .map(|unit| format!("; is it pixels for a {unit}?"))
        };
        let (at, told, question) = match self.scale {
            Scale::Length(_) | Scale::Size(_) => return Ok(()),
            Scale::PxPerMetre(scale) => (
                "px_per_metre",
                number(scale),
                pixels_for().unwrap_or_default(),
            ),
            Scale::Screen([w, h], _) => (
                "screen_size",
                format!("{} x {}", number(w), number(h)),
                OBJECT.question(length),
            ),
            Scale::Marker(side) => ("marker_size", number(side), OBJECT.question(length)),
        };
        let (source, length) = (&record.source, number((1e4 * length).round() / 1e4));
        let what = format!(
            "{told}, makes what is in {source} {length} m long, expected {OBJECT}{question}"
        );
        Err(Error::value(at, what))
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
pub fn add_photo(
    folder: impl AsRef<Path>,
    photo: impl AsRef<Path>,
    add: &AddPhoto,
) -> Result<Photo> {
    let folder = folder.as_ref();
    let mut manifest = read_or_new(folder)?;
    manifest.learn(&add.classes, std::iter::once(add.class.as_str()))?;
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
    let on_screen = on_screen(photo, add).map_err(|e| named(e, photo))?;
    let empty = add
        .screen
        .empty()?
        .map(|empty| on_screen.same_view(empty))
        .transpose()?;
    watch.lap("read");
    let options = CutOutOptions {
        screen: add.screen.color().or(add.options.screen),
        ..add.options.clone()
    };
    let cut =
        cut_out_on(&on_screen.photo, empty.as_ref(), &options).map_err(|e| named(e, photo))?;
    watch.lap("cut out");
    for diagnostic in &cut.diagnostics {
        let level = if diagnostic.code == Code::ScreenHue {
            log::Level::Warn
        } else {
            log::Level::Info
        };
        log::log!(level, "{}: {diagnostic}", photo.display());
    }
    let record = record(&cut, add, &on_screen, photo);
    add.check_length(&record)?;
    watch.lap("measure");
    io::create_folder(folder.join(&add.asset))?;
    files::write(&folder.join(&record.file), &cut)?;
    watch.lap("write");
    watch.log(photo.display());
    Ok(Photo::new(cut.film, record))
}

/// The photo, seen from straight above where something in it tells of the screen's plane.
fn on_screen(photo: &Path, add: &AddPhoto) -> Result<OnScreen> {
    let (picture, height) = (io::read(photo)?, add.thickness / 2.0);
    match add.scale {
        Scale::PxPerMetre(_) | Scale::Length(_) | Scale::Size(_) => Ok(OnScreen::whole(picture)),
        Scale::Screen(size, corners) => {
            OnScreen::by_corners(picture, size, corners, height, &io::read_header(photo)?)
        }
        Scale::Marker(side) => OnScreen::by_marker(picture, side, height, &io::read_header(photo)?),
    }
}

fn named(error: Error, photo: &Path) -> Error {
    match error {
        Error::Photo { what } => Error::Photo {
            what: format!("{}: {what}", photo.display()),
        },
        other => other,
    }
}

/// Where the cut-out of a photo goes.
pub(super) fn cut_out_file(photo: &Path, add: &AddPhoto) -> String {
    format!("{}/{}.exr", add.asset, stem(photo))
}

/// The photo's name without ending, safe as a name anywhere.
fn stem(photo: &Path) -> String {
    let stem = photo.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| {
        if c.is_alphanumeric() || c == '-' {
            c
        } else {
            '_'
        }
    };
    stem.chars().map(plain).collect()
}

fn record(cut: &CutOut, add: &AddPhoto, on_screen: &OnScreen, photo: &Path) -> PhotoRecord {
    let measured = Measured::of(cut, add, on_screen);
    let file = cut_out_file(photo, add);
    let (w, h) = cut.film.size();
    let diagnostics = cut
        .diagnostics
        .iter()
        .filter(|d| Diagnostic::needs_review(d))
        .cloned()
        .chain(measured.size_mismatch)
        .chain(on_screen.diagnostic());
    PhotoRecord {
        file,
        source: photo
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        px_per_metre: measured.px_per_metre,
        size_m: [w as f64, h as f64].map(|px| px / measured.px_per_metre),
        object_m: measured.object_m,
        error_m: measured.error_m,
        hull_m: measured.hull_m,
        screen: cut.screen,
        matte: cut.method,
        residue: f64::from(cut.residue),
        unevenness: f64::from(cut.unevenness),
        outline_confidence: cut.segmentation.confidence.value(),
        color_confidence: cut.doubts.map(ColorDoubts::confidence),
        truncated: cut.segmentation.touches.contains(&true),
        outline_px: cut.hull.iter().map(files::rounded).collect(),
        diagnostics: diagnostics.collect(),
    }
}
