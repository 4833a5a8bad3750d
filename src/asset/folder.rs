//! Putting photos into an asset folder.

use super::MANIFEST;
use super::capture_entry::CaptureEntry;
use super::captured::{CapturedObject, captured_object};
use super::concave::concave_warning;
use super::entry::PhotoEntry;
use super::files;
use super::flow_file;
use super::inputs::inputs_crc32;
use super::list::check_not_written_over;
use super::manifest::{Manifest, PhotoRecord};
use super::measure::MeasuredSize;
use super::open_photo::OpenPhoto;
use super::pixels::check_pixels;
use super::rectified::RectifiedPhoto;
use super::review::Review;
use super::screen_source::EmptyScreens;
use crate::diagnostic::Diagnostic;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{self, Checksum};
use crate::matte::{ColorUncertainty, CutOut, CutOutOptions};
use crate::pixel::{Film, LinearRgb};
use crate::stopwatch::Stopwatch;
use std::fs::File;
use std::path::Path;

/// Held by whoever changes the manifest. The file stays: a lock on one that is about to be deleted
/// would lock nothing.
const LOCK: &str = ".lock";

/// Cuts the object out of a photo and adds it to an asset folder, which is created if missing.
///
/// `classes` are the names of the folder's classes in order, where they are declared; without them,
/// a class that the folder does not have is added behind those that it has.
///
/// Adding the same photo to the same asset again replaces it; where it no longer gives a cut-out,
/// the earlier one is kept, and removed only where a person rejected it. The manifest is written last,
/// whole or not at all. Several processes may add to one folder at a time.
///
/// # Errors
/// [`Error::Value`] for a wrong name, class or size; [`Error::File`] for a photo that is where its
/// cut-out would be written; those of reading the photo and of
/// [`cut_out`](crate::matte::cut_out), naming the photo; those of writing.
pub fn add_photo(
    folder: impl AsRef<Path>,
    entry: &PhotoEntry,
    classes: &[String],
    options: &CutOutOptions,
) -> Result<PhotoRecord> {
    let folder = folder.as_ref();
    let mut manifest = read_or_new(folder)?;
    manifest.add_classes(classes, entry.label_class().into_iter())?;
    entry.check(&manifest)?;
    check_not_written_over(std::slice::from_ref(entry), folder)?;
    let entry = &entry.clone().with_body(manifest.known_body(&entry.asset));
    let writer = CutOutWriter {
        folder,
        options,
        empty_screens: EmptyScreens::default(),
    };
    let outcome = writer.write(entry);
    let _alone = lock(folder)?;
    let mut manifest = read_or_new(folder)?;
    if let Err(Error::Photo { .. }) = &outcome
        && let Some(file) = take_out(entry, folder, &mut manifest)
    {
        manifest.write(folder)?;
        files::remove(folder, &file)?;
    }
    let record = outcome.map_err(|e| refusal(e, entry, &manifest))?;
    manifest.add_classes(classes, entry.label_class().into_iter())?;
    manifest.insert(entry.asset_with(record.clone()))?;
    manifest.write(folder)?;
    Ok(record)
}

/// Waits until no other process changes the manifest of a folder, and makes the next ones wait; in
/// a folder that is not there nobody does.
pub(super) fn lock(folder: &Path) -> Result<Option<File>> {
    if !folder.is_dir() {
        return Ok(None);
    }
    let path = folder.join(LOCK);
    let file = io::open_own(&path)?;
    file.lock().map_err(|e| Error::file(&path, e))?;
    Ok(Some(file))
}

/// A person does not want the cut-out of a photo: a folder keeps none of it.
pub(super) fn is_rejected(entry: &PhotoEntry) -> bool {
    let review = Review::of_photo(&entry.file).ok().flatten();
    review.is_some_and(|review| review.is_rejected())
}

/// Takes the earlier cut-out of a photo that gives none out of the manifest, where a person rejected
/// it or the file is not the manifest's, as after a build that was broken off; the file that goes.
pub(super) fn take_out(
    entry: &PhotoEntry,
    folder: &Path,
    manifest: &mut Manifest,
) -> Option<String> {
    let file = entry.cut_out_file();
    let goes = is_rejected(entry) || !manifest.is_file_of(folder, &file);
    (goes && manifest.remove(&file)).then_some(file)
}

/// Why a photo gave no cut-out, and that an earlier one stays: it may be a slip in an option.
pub(super) fn refusal(error: Error, entry: &PhotoEntry, manifest: &Manifest) -> Error {
    let file = entry.cut_out_file();
    match error {
        Error::Photo { what } if manifest.has(&file) => Error::Photo {
            what: format!("{what}; the earlier cut-out {file} is kept"),
        },
        other => other,
    }
}

/// The manifest of a folder; a new one where there is no manifest.
pub(super) fn read_or_new(folder: &Path) -> Result<Manifest> {
    match folder.join(MANIFEST).exists() {
        true => Manifest::read(folder),
        false => Ok(Manifest::default()),
    }
}

/// Cuts objects out of photos and writes the files of a folder, all but its manifest.
pub(super) struct CutOutWriter<'a> {
    pub(super) folder: &'a Path,
    pub(super) options: &'a CutOutOptions,
    pub(super) empty_screens: EmptyScreens,
}

impl CutOutWriter<'_> {
    /// The record of a cut-out that is in the folder and would be made just so again.
    pub(super) fn find(&self, entry: &PhotoEntry, manifest: &Manifest) -> Option<PhotoRecord> {
        let record = manifest.record(&entry.cut_out_file())?;
        let inputs = inputs_crc32(entry, self.options).ok()?;
        let is_same = record.inputs_crc32 == Some(inputs);
        let is_whole = |file| self.folder.join(file).exists();
        let is_there =
            record.files().all(is_whole) && manifest.is_file_of(self.folder, &record.file);
        (is_same && is_there).then(|| record.clone())
    }

    /// Writes the cut-out and the thumbnail of one photo.
    pub(super) fn write(&self, entry: &PhotoEntry) -> Result<PhotoRecord> {
        // Before they are read: what changes meanwhile is another input.
        let inputs_crc32 = inputs_crc32(entry, self.options).ok();
        let record = match &entry.captured {
            Some(captured) => self.write_captured(entry, captured),
            None => self.write_cut_out(entry),
        }?;
        Ok(PhotoRecord {
            source_crc32: Some(Checksum::from_file(&entry.file)?.crc32),
            inputs_crc32,
            ..record
        })
    }

    /// Measures an object that was captured on a display.
    fn write_captured(&self, entry: &PhotoEntry, captured: &CaptureEntry) -> Result<PhotoRecord> {
        let review = review_of(&entry.file)?;
        check_unpainted(&review, &entry.file)?;
        let CapturedObject { film, flow, record } = captured_object(entry, captured, self.options)?;
        let record = record.reviewed(review.verdict);
        // A display shines through the object once: nothing of what is seen is its shadow.
        let passed = film.map(Film::transmittance);
        let record = self.write_film(&film, &passed, record)?;
        if let Some(flow) = flow {
            let path = self.folder.join(files::flow_file(&record.file));
            flow_file::write(&path, &flow)?;
        }
        Ok(record)
    }

    fn write_cut_out(&self, entry: &PhotoEntry) -> Result<PhotoRecord> {
        let mut watch = Stopwatch::start();
        let review = review_of(&entry.file)?;
        let photo = OpenPhoto::beside(entry, &self.empty_screens, self.options)?;
        check_reviewed_size(&review, entry, &photo)?;
        watch.lap("read");
        let cut = photo.cut_out(&review.strokes)?;
        log_notes(&cut, &entry.file);
        watch.lap("cut out");
        let record = new_record(&cut, entry, &photo.rectified)?.reviewed(review.verdict);
        watch.lap("measure");
        let record = self.write_film(&cut.film, &cut.transmittance, record)?;
        watch.lap("write");
        watch.log(entry.file.display());
        Ok(record)
    }

    /// Writes film and thumbnail, and notes the checksum of the film.
    ///
    /// # Errors
    /// [`Error::Photo`] for a record that no manifest may hold: it would keep all others out, too.
    fn write_film(
        &self,
        film: &Image<Film>,
        transmittance: &Image<LinearRgb>,
        record: PhotoRecord,
    ) -> Result<PhotoRecord> {
        record.check().map_err(|e| Error::Photo {
            what: format!("{}: {e}", record.source),
        })?;
        let path = self.folder.join(&record.file);
        io::create_folder(path.parent().unwrap_or(self.folder))?;
        let film = files::write(&path, film, transmittance)?;
        check_pixels(&film).map_err(|what| Error::file(&path, what))?;
        let crc32 = Some(Checksum::from_file(&path)?.crc32);
        Ok(PhotoRecord { crc32, ..record })
    }
}

/// What a person said of the cut-out of a photo, or a review that says nothing.
///
/// # Errors
/// Those of [`Review::of_photo`]; [`Error::Photo`] where it was rejected.
fn review_of(photo: &Path) -> Result<Review> {
    let review = Review::of_photo(photo)?.unwrap_or_default();
    if !review.is_rejected() {
        return Ok(review);
    }
    let path = Review::path_of(photo);
    let what = format!("{}: rejected in {}", photo.display(), path.display());
    Err(Error::Photo { what })
}

/// Fails where strokes were painted on a picture of another size.
fn check_reviewed_size(review: &Review, entry: &PhotoEntry, photo: &OpenPhoto) -> Result<()> {
    if review.strokes.is_empty() {
        return Ok(());
    }
    let checked = review.check_size(photo.picture().size());
    checked.map_err(|e| e.in_file(Review::path_of(&entry.file)))
}

/// Fails where strokes were painted on a photo of a capture, whose film is measured.
fn check_unpainted(review: &Review, photo: &Path) -> Result<()> {
    if review.strokes.is_empty() {
        return Ok(());
    }
    let what = "painted on a capture, whose film is measured, expected only a verdict";
    Err(Error::value("strokes", what).in_file(Review::path_of(photo)))
}

/// What is not kept in the record.
fn log_notes(cut: &CutOut, photo: &Path) {
    for note in cut.diagnostics.iter().filter(|d| !d.needs_review()) {
        log::info!("{}: {note}", photo.display());
    }
}

/// The diagnostics of a cut-out that a person should review.
fn to_review(cut: &CutOut) -> impl Iterator<Item = Diagnostic> {
    cut.diagnostics.iter().filter(|d| d.needs_review()).cloned()
}

/// The entry of a cut-out in the manifest.
///
/// # Errors
/// [`Error::Photo`] for an object that the scale makes too short or too long.
fn new_record(cut: &CutOut, entry: &PhotoEntry, photo: &RectifiedPhoto) -> Result<PhotoRecord> {
    let scale = entry.scale()?;
    let measured = MeasuredSize::new(cut, scale, photo);
    scale.check_length(measured.object_m[0], &entry.source())?;
    let warnings = [
        measured.size_mismatch,
        photo.diagnostic(),
        concave_warning(&cut.outline),
    ];
    Ok(PhotoRecord {
        source: entry.source(),
        object_m: measured.object_m,
        error_m: measured.error_m,
        diagnostics: to_review(cut)
            .chain(warnings.into_iter().flatten())
            .collect(),
        ..matte_record(cut, entry.cut_out_file(), measured.px_per_metre)
    })
}

/// The fields of an entry that follow from the matte, for a cut-out in a file and of a scale.
fn matte_record(cut: &CutOut, file: String, px_per_metre: f64) -> PhotoRecord {
    let (w, h) = cut.film.size();
    let size_m = [w as f64, h as f64].map(|px| px / px_per_metre);
    let outline_px = cut.hull.iter().map(files::rounded).collect();
    PhotoRecord {
        screen: cut.screen,
        matte: cut.method,
        residue: f64::from(cut.residual_matte),
        unevenness: f64::from(cut.unevenness),
        outline_confidence: cut.segmentation.confidence.value(),
        color_confidence: cut.color_uncertainty.map(ColorUncertainty::confidence),
        truncated: cut.segmentation.is_truncated(),
        ..PhotoRecord::new(file, px_per_metre, size_m, outline_px)
    }
}
