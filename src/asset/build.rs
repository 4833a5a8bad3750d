//! Builds an asset folder from a list of photos.

use super::contact_sheet::remove_contact_sheet;
use super::entry::PhotoEntry;
use super::files;
use super::folder::{CutOutWriter, is_rejected, lock, read_or_new, refusal, take_out};
use super::journal::Journal;
use super::library::Library;
use super::list::{List, check_not_written_over, check_reviews, find_list};
use super::manifest::{Manifest, PhotoRecord};
use super::screen_source::EmptyScreens;
use super::{CONTACT_SHEET, MANIFEST};
use crate::error::{Error, Result};
use crate::io;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// Memory that a photo takes for each of its pixels while it is cut out: 130 bytes, measured with
/// photos of 12 and 24 megapixels.
const BYTES_PER_PIXEL: u64 = 140;

/// No process needs longer for one file of a cut-out: an older half-written one is a killed run's.
const LONGEST_WRITE: Duration = Duration::from_secs(24 * 60 * 60);

/// What [`build`] did.
#[derive(Clone, Debug)]
pub struct Built {
    /// Everything that the folder holds now, as [`Library::open`] would read it.
    pub library: Library,
    /// Photos that are cut out.
    pub photos: usize,
    /// How many of these cut-outs existed before.
    pub kept: usize,
    /// Lengths of the objects that were cut out and lie wholly in their photos, with their standard
    /// errors, metres, in the order of the list.
    pub lengths: Vec<[f64; 2]>,
    /// Photos that gave no cut-out, and why.
    pub refused: Vec<String>,
    /// How many of these a person rejected.
    pub rejected: usize,
    /// Cut-outs in the folder whose photos are not in the list.
    pub unlisted: Vec<String>,
    /// Cut-outs that a person should review; their diagnostics say why.
    pub needs_review: Vec<PhotoRecord>,
}

/// Cuts all photos of a list out, several at a time, into an asset folder, which is created if
/// missing.
///
/// `list` is a TOML or CSV file, or a folder with `photos.toml` or `photos.csv` in it. A photo
/// without a usable object, or one that a person rejected, is left out and reported in
/// [`Built::refused`]; an earlier cut-out of it is kept, and removed only where a person rejected it.
///
/// `progress` is called with the photos done and their number, at the start and after each photo,
/// from several threads. Cut-outs of other photos are kept ([`Built::unlisted`]); a photo
/// that the folder already has is replaced, and a contact sheet of other cut-outs is removed. The
/// manifest does not depend on threads; it is updated every 10 s, so that [`resume`] need not start
/// over. Once `stop` is true, photos in progress are finished and no more are begun.
///
/// # Errors
/// A list that cannot be read or is wrong, or a photo that is missing or is where a file of the
/// folder would be written (before any work); the first photo that cannot be read (the cut-outs of
/// the others are in the folder), or [`Error::File`] where no photo gives a cut-out and a person did
/// not reject all of them; [`Error::Interrupted`] after a stop; those of [`Library::open`]
/// for cut-outs that were there before.
pub fn build(
    list: impl AsRef<Path>,
    folder: impl AsRef<Path>,
    progress: &(dyn Fn(usize, usize) + Sync),
    stop: &AtomicBool,
) -> Result<Built> {
    build_beside(
        &Manifest::default(),
        list.as_ref(),
        folder.as_ref(),
        progress,
        stop,
    )
}

/// The same, but cut-outs that the folder already has are kept: those of the same photo, entry,
/// options and version of the program.
///
/// # Errors
/// As [`build`].
pub fn resume(
    list: impl AsRef<Path>,
    folder: impl AsRef<Path>,
    progress: &(dyn Fn(usize, usize) + Sync),
    stop: &AtomicBool,
) -> Result<Built> {
    let folder = folder.as_ref();
    build_beside(&read_or_new(folder)?, list.as_ref(), folder, progress, stop)
}

/// Builds what is not in a manifest of the folder.
fn build_beside(
    known: &Manifest,
    list: &Path,
    folder: &Path,
    progress: &(dyn Fn(usize, usize) + Sync),
    stop: &AtomicBool,
) -> Result<Built> {
    // Where there was no cut-out, no sheet is ours.
    let before = read_or_new(folder)
        .ok()
        .filter(|manifest| !manifest.assets.is_empty());
    let built = build_in(known, list, folder, progress, stop);
    if before.is_some() && read_or_new(folder).ok() != before {
        remove_old_sheet(folder);
    }
    built
}

/// Deletes the contact sheet of other cut-outs than there are now; one that cannot be deleted must
/// not hide what was built, or why it was not.
fn remove_old_sheet(folder: &Path) {
    if let Err(error) = remove_contact_sheet(&folder.join(CONTACT_SHEET), 0) {
        log::warn!("{error}");
    }
}

/// The same, whatever the contact sheet shows then.
fn build_in(
    known: &Manifest,
    list: &Path,
    folder: &Path,
    progress: &(dyn Fn(usize, usize) + Sync),
    stop: &AtomicBool,
) -> Result<Built> {
    let path = find_list(list)?;
    let list = List::read(&path)?;
    let list = checked(list, &path, &mut read_or_new(folder)?)?;
    check_not_written_over(&list.photos, folder)?;
    let (outcomes, journal) = cut_out_all(known, &list, folder, progress, stop);
    if stop.load(Ordering::Relaxed) {
        journal.write()?;
        return Err(interrupted(&outcomes));
    }
    let there = outcomes.iter().flatten().count();
    let kept = there.saturating_sub(journal.count());
    let recorded = record(&list, outcomes, folder);
    let (manifest, mut taken) = recorded.map_err(|e| e.in_file(&path))?;
    if let Some(error) = taken.failed.take() {
        return Err(error.in_file(&path));
    }
    if taken.records.is_empty() && taken.refused.len() > taken.rejected {
        return Err(no_cut_out(&path, &taken.refused));
    }
    let library = Library::from_manifest(folder, manifest)?;
    Ok(Built::new(library, taken, kept, &list))
}

/// What becomes of a photo after a stop.
fn not_begun() -> Error {
    let what = "stopped before this photo".into();
    Error::Interrupted { what }
}

fn interrupted(outcomes: &[Result<PhotoRecord>]) -> Error {
    let (done, count) = (outcomes.iter().flatten().count(), outcomes.len());
    let what = format!("{MANIFEST} has {done} of {count} photos; resume processes the others");
    Error::Interrupted { what }
}

fn no_cut_out(list: &Path, refused: &[String]) -> Error {
    let what = format!("no photo gave a cut-out: {}", refused.join("; "));
    Error::file(list, what)
}

impl Built {
    fn new(library: Library, taken: TakenIn, kept: usize, list: &List) -> Self {
        let records = taken.records;
        Self {
            unlisted: unlisted(&library, list),
            library,
            photos: records.len(),
            kept,
            lengths: records.iter().filter_map(length_and_error).collect(),
            refused: taken.refused,
            rejected: taken.rejected,
            needs_review: records
                .into_iter()
                .filter(PhotoRecord::needs_review)
                .collect(),
        }
    }
}

fn unlisted(library: &Library, list: &List) -> Vec<String> {
    let listed: BTreeSet<_> = list.photos.iter().map(PhotoEntry::cut_out_file).collect();
    let photos = library.assets.iter().flat_map(|asset| &asset.photos);
    let files = photos.map(|photo| &photo.record.file);
    files
        .filter(|file| !listed.contains(*file))
        .cloned()
        .collect()
}

/// A list from a file, whose classes are added to the manifest; what it does not tell of an
/// object's body is taken from there, and its paths are made relative to the working folder.
fn checked(list: List, path: &Path, manifest: &mut Manifest) -> Result<List> {
    list.check(manifest).map_err(|e| e.in_file(path))?;
    let list = list.with_bodies(|asset| manifest.known_body(asset));
    let list = list.located_in(path.parent().unwrap_or(Path::new("")));
    list.check_pictures()?;
    check_reviews(&list.photos).map_err(|e| e.in_file(path))?;
    Ok(list)
}

/// Cuts out and writes the photos of a list that a manifest does not have, until there is a stop;
/// what the manifest does not tell of yet is in the journal.
fn cut_out_all<'a>(
    known: &Manifest,
    list: &'a List,
    folder: &'a Path,
    progress: &(dyn Fn(usize, usize) + Sync),
    stop: &AtomicBool,
) -> (Vec<Result<PhotoRecord>>, Journal<'a>) {
    let (done, count) = (AtomicUsize::new(0), list.photos.len());
    progress(0, count);
    let writer = CutOutWriter {
        folder,
        options: &list.cut_out,
        empty_screens: EmptyScreens::shared_by(list.photos.iter().map(|photo| &photo.screen)),
    };
    let journal = Journal::new(list, folder);
    let write = |entry: &'a PhotoEntry| {
        if stop.load(Ordering::Relaxed) {
            return Err(not_begun());
        }
        let record = match writer.find(entry, known) {
            Some(record) => Ok(record),
            None => journal.add(entry, writer.write(entry)),
        };
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, count);
        record
    };
    let mut outcomes = Vec::with_capacity(count);
    let files = list.photos.iter().map(|photo| &photo.file);
    for photos in list
        .photos
        .chunks(io::pictures_at_once(files, BYTES_PER_PIXEL))
    {
        outcomes.par_extend(photos.par_iter().map(write));
    }
    (outcomes, journal)
}

/// Takes the cut-outs of a list into the manifest as it is by now: another process may have changed
/// it meanwhile.
fn record(
    list: &List,
    outcomes: Vec<Result<PhotoRecord>>,
    folder: &Path,
) -> Result<(Manifest, TakenIn)> {
    let alone = lock(folder)?;
    let mut manifest = read_or_new(folder)?;
    list.add_classes_to(&mut manifest)?;
    let taken = take_in(list, outcomes, folder, &mut manifest);
    if !taken.removed.is_empty() || !taken.records.is_empty() {
        manifest.write(folder)?;
    }
    let mut removed = taken.removed.iter();
    removed.try_for_each(|file| files::remove(folder, file))?;
    if alone.is_some() {
        io::sweep(folder, LONGEST_WRITE)?;
    }
    Ok((manifest, taken))
}

/// What became of the photos of a list.
#[derive(Default)]
struct TakenIn {
    records: Vec<PhotoRecord>,
    /// Why the others gave no cut-out.
    refused: Vec<String>,
    /// How many of these a person rejected.
    rejected: usize,
    /// Earlier cut-outs of them that went.
    removed: Vec<String>,
    /// The first that could not be read or written, or fits no asset.
    failed: Option<Error>,
}

/// Puts the cut-outs of a list into the manifest of a folder, and takes out those that go.
fn take_in(
    list: &List,
    outcomes: Vec<Result<PhotoRecord>>,
    folder: &Path,
    manifest: &mut Manifest,
) -> TakenIn {
    let mut taken = TakenIn::default();
    for (i, (outcome, entry)) in outcomes.into_iter().zip(&list.photos).enumerate() {
        match outcome.and_then(|record| inserted(record, entry, manifest)) {
            Ok(record) => taken.records.push(record),
            Err(error @ Error::Photo { .. }) => {
                let rejected = is_rejected(entry);
                taken.removed.extend(take_out(entry, folder, manifest));
                let error = refusal(error, entry, manifest);
                taken.refused.push(error.to_string());
                taken.rejected += usize::from(rejected);
            }
            Err(error) => {
                let error = error.within(&format!("photos[{i}]"));
                taken.failed.get_or_insert(error);
            }
        }
    }
    taken
}

/// A record that is now in the manifest.
fn inserted(
    record: PhotoRecord,
    entry: &PhotoEntry,
    manifest: &mut Manifest,
) -> Result<PhotoRecord> {
    manifest.insert(entry.asset_with(record.clone()))?;
    Ok(record)
}

/// Nothing of an object of which a part is missing.
fn length_and_error(record: &PhotoRecord) -> Option<[f64; 2]> {
    (!record.truncated).then_some([record.object_m[0], record.error_m])
}

#[cfg(test)]
mod tests {
    use super::super::pixels::PixelChecksums;
    use super::super::{MANIFEST, PhotoRecord, Review, Scale, Texture, Verdict};
    use super::super::{add_photo, contact_sheets};
    use super::*;
    use crate::diagnostic::{Code, Diagnostic};
    use crate::geom::Point2;
    use crate::image::Image;
    use crate::matte::{Claim, CutOutOptions, MatteMethod, Stroke};
    use crate::pixel::{Film, LinearRgb};

    /// A red slab of 60 x 30 pixels on a green screen.
    fn slab() -> Image<LinearRgb> {
        Image::from_fn(120, 80, |x, y| {
            let inside = (30..90).contains(&x) && (25..55).contains(&y);
            if inside {
                LinearRgb::new(0.6, 0.05, 0.05)
            } else {
                LinearRgb::new(0.04, 0.4, 0.08)
            }
        })
    }

    /// A build that nobody stops.
    fn build(list: impl AsRef<Path>, folder: impl AsRef<Path>) -> Result<Built> {
        super::build(list, folder, &|_, _| (), &AtomicBool::new(false))
    }

    /// The list in a folder, and the folder of its assets.
    fn paths(folder: &tempfile::TempDir) -> [std::path::PathBuf; 2] {
        ["photos.toml", "out"].map(|name| folder.path().join(name))
    }

    fn folder_with(list: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in ["one.png", "two.png"] {
            io::write(folder.path().join(name), &slab()).unwrap();
        }
        std::fs::write(folder.path().join("photos.toml"), list).unwrap();
        folder
    }

    fn built(list: &str) -> Result<Library> {
        let folder = folder_with(list);
        let [list, out] = paths(&folder);
        let built = build(list, &out)?.library;
        let read = Library::open(out)?;
        assert_eq!(in_brief(&built), in_brief(&read));
        Ok(read)
    }

    /// All that distinguishes two libraries.
    fn in_brief(library: &Library) -> Vec<(String, PhotoRecord, PixelChecksums, Vec<Point2<f64>>)> {
        let photos = library
            .assets
            .iter()
            .flat_map(|asset| asset.photos.iter().map(move |photo| (asset, photo)));
        photos
            .map(|(asset, photo)| {
                (
                    format!("{} {} {}", asset.name, asset.class, asset.mass),
                    photo.record.clone(),
                    photo.checksums(),
                    photo.outline_uv.to_vec(),
                )
            })
            .collect()
    }

    const TWO: &str = "[[photos]]\nfile = \"one.png\"\nasset = \"a\"\nclass = \"cap\"\nlength = 0.3\n\
                       [[photos]]\nfile = \"two.png\"\nasset = \"a\"\nclass = \"cap\"\npx_per_metre = 100.0\n";

    #[test]
    fn a_folder_without_a_list_is_told_what_is_expected_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let error = build(folder.path(), folder.path().join("out"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("expected photos.toml or photos.csv in it"),
            "{error}"
        );
    }

    #[test]
    fn a_contact_sheet_of_other_cut_outs_goes() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        let pages = [CONTACT_SHEET, "contact_sheet_2.png"].map(|name| out.join(name));
        let left = || {
            build(&list, &out).unwrap();
            pages.each_ref().map(|page| page.exists())
        };
        // Where no cut-out was, they are somebody's own.
        io::create_folder(&out).unwrap();
        for page in &pages {
            std::fs::write(page, "").unwrap();
        }
        assert_eq!(left(), [true; 2]);
        assert_eq!(left(), [true; 2]);
        let length_is = |length: &str| {
            std::fs::write(&list, TWO.replace("0.3", length)).unwrap();
        };
        length_is("0.2");
        assert_eq!(left(), [false; 2]);
        // One that cannot be deleted leaves the build as it is.
        io::create_folder(&pages[0]).unwrap();
        length_is("0.4");
        assert_eq!(left(), [true, false]);
    }

    #[test]
    fn a_list_becomes_a_library_of_the_right_size() {
        let library = built(TWO).unwrap();
        let [asset] = &library.assets[..] else {
            panic!("one asset")
        };
        assert_eq!((asset.class.as_str(), asset.photos.len()), ("cap", 2));
        // An edge is known to a pixel, so a length to two: 60 px are 0.3 m to within 1 in 30.
        assert!((asset.photos[0].record.px_per_metre / 200.0 - 1.0).abs() < 1.0 / 30.0);
        assert!((asset.photos[1].record.object_m[0] - 0.6).abs() <= 0.02);
        assert!((asset.photos[1].record.object_m[1] - 0.3).abs() <= 0.02);
        assert_eq!(asset.photos[1].record.source, "two.png");
    }

    #[test]
    fn a_stated_length_of_a_truncated_object_is_not_said_to_be_exact() {
        let folder = folder_with(TWO);
        let slab = slab();
        // Both cut through the slab; the scale of the second is not the object's.
        let cut = Image::from_fn(75, 80, |x, y| slab[(x, y)]);
        for name in ["one.png", "two.png"] {
            io::write(folder.path().join(name), &cut).unwrap();
        }
        let [list, out] = paths(&folder);
        let built = build(&list, &out).unwrap();
        let [one, two] = &built.library.assets[0].photos[..] else {
            panic!("two photos")
        };
        assert!(one.record.truncated && two.record.truncated);
        assert_eq!(one.record.error_m, one.record.object_m[0]);
        assert!(two.record.error_m < 0.1 * two.record.object_m[0]);
        assert!(built.lengths.is_empty());
    }

    #[test]
    fn an_opaque_cut_out_may_be_reduced_to_any_size() {
        for longest_side in [32, 48, 64] {
            let list = format!("[cut_out]\nlongest_side = {longest_side}\n{TWO}");
            let library = built(&list).unwrap();
            assert_eq!(library.assets[0].photos.len(), 2, "{longest_side}");
        }
    }

    #[test]
    fn what_an_asset_weighs_stays_where_a_later_photo_does_not_tell() {
        let body = |library: &Library| [library.assets[0].thickness, library.assets[0].mass];
        let first = TWO.replacen("0.3\n", "0.3\nthickness = 0.06\nmass = 0.04\n", 1);
        assert_eq!(body(&built(&first).unwrap()), [0.06, 0.04]);
        let folder = folder_with(&first);
        let [list, out] = paths(&folder);
        build(&list, &out).unwrap();
        let later = TWO.replacen("0.3\n", "0.3\nmass = 0.05\n", 1);
        std::fs::write(&list, later).unwrap();
        let built = build(&list, &out).unwrap();
        assert_eq!(body(&built.library), [0.06, 0.05]);
        let file = folder.path().join("two.png");
        let entry = PhotoEntry::new(file, "a", "cap", Scale::Length(0.3));
        add_photo(&out, &entry, &[], &CutOutOptions::default()).unwrap();
        assert_eq!(body(&Library::open(&out).unwrap()), [0.06, 0.05]);
    }

    #[test]
    fn building_twice_changes_nothing() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        let manifest = || {
            build(&list, &out).unwrap();
            std::fs::read(out.join(MANIFEST)).unwrap()
        };
        assert_eq!(manifest(), manifest());
    }

    #[test]
    fn what_a_person_said_of_a_photo_holds_whenever_it_is_built() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        let built = || build(&list, &out);
        let review = |review: Review| {
            std::fs::write(folder.path().join("one.review.json"), review.to_json()).unwrap();
        };
        let length_px = |built: &Built| {
            let photo = &built.library.assets[0].photos[0];
            photo.record.object_m[0] * photo.record.px_per_metre
        };
        // The right third of the slab is none of the object.
        let right = Stroke {
            says: Claim::NotObject,
            radius_px: 10.0,
            points_px: vec![[80.0, 20.0], [80.0, 60.0], [88.0, 60.0], [88.0, 20.0]],
        };
        review(Review::new((120, 80), vec![right.clone()]));
        for _ in 0..2 {
            let length = length_px(&built().unwrap());
            assert!((length - 40.0).abs() <= 2.0, "{length}");
        }
        review(Review::new((600, 400), vec![right]));
        let said = built().unwrap_err().to_string();
        assert!(
            said.contains("one.review.json: size_px: 600 x 400, expected the photo's 120 x 80"),
            "{said}"
        );
        reject(&folder, "one");
        let built = built().unwrap();
        assert_eq!(built.rejected, 1);
        let [refused] = &built.refused[..] else {
            panic!("one photo is refused")
        };
        assert!(refused.contains("one.png: rejected in"), "{refused}");
        assert_eq!(cut_outs(&built.library), ["a/two.exr"]);
        assert_eq!(cut_outs(&Library::open(out).unwrap()), ["a/two.exr"]);
    }

    /// A person rejects the photo of a name.
    fn reject(folder: &tempfile::TempDir, name: &str) {
        let review = Review {
            verdict: Some(Verdict::Rejected),
            ..Review::new((120, 80), Vec::new())
        };
        let path = folder.path().join(format!("{name}.review.json"));
        std::fs::write(path, review.to_json()).unwrap();
    }

    fn cut_outs(library: &Library) -> Vec<&str> {
        let photos = library.assets.iter().flat_map(|asset| &asset.photos);
        photos.map(|photo| photo.record.file.as_str()).collect()
    }

    #[test]
    fn a_list_whose_last_photos_are_rejected_leaves_nothing_in_the_folder() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        build(&list, &out).unwrap();
        for name in ["one", "two"] {
            reject(&folder, name);
        }
        let built = build(&list, &out).unwrap();
        assert_eq!((built.photos, built.rejected), (0, 2));
        assert!(Library::open(&out).unwrap().assets.is_empty());
        assert_eq!(std::fs::read_dir(out.join("a")).unwrap().count(), 0);
        let empty = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        io::write(folder.path().join("two.png"), &empty).unwrap();
        std::fs::remove_file(folder.path().join("two.review.json")).unwrap();
        let told = build(&list, &out).unwrap_err().to_string();
        assert!(told.contains("no photo gave a cut-out"), "{told}");
    }

    #[test]
    fn a_rejected_photo_that_is_added_again_leaves_the_folder() {
        let folder = folder_with(TWO);
        let (photo, out) = (folder.path().join("one.png"), folder.path().join("out"));
        let entry = PhotoEntry::new(photo, "a", "cap", Scale::Length(0.3));
        let add = || add_photo(&out, &entry, &[], &CutOutOptions::default());
        add().unwrap();
        reject(&folder, "one");
        let told = add().unwrap_err().to_string();
        assert!(told.contains("one.png: rejected in"), "{told}");
        assert!(Library::open(&out).unwrap().assets.is_empty());
        assert_eq!(std::fs::read_dir(out.join("a")).unwrap().count(), 0);
    }

    #[test]
    fn a_photo_that_gives_no_cut_out_any_more_keeps_its_earlier_one() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        build(&list, &out).unwrap();
        let kept = |name: &str| {
            let both = ["a/one.exr", "a/two.exr"];
            assert_eq!(cut_outs(&Library::open(&out).unwrap()), both, "{name}");
        };
        let stays = "; the earlier cut-out a/two.exr is kept";
        std::fs::write(&list, TWO.replace("= 100.0", "= 2.0")).unwrap();
        let refused = build(&list, &out).unwrap().refused;
        assert!(refused[0].ends_with(stays), "{refused:?}");
        kept("a scale that is wrong");
        // Twice as long as wide, so that both together make it longer than an object may be.
        let square = TWO.replace("px_per_metre = 100.0", "length = 5.0\nwidth = 5.0");
        std::fs::write(&list, square).unwrap();
        let refused = build(&list, &out).unwrap().refused;
        let starts = refused[0].starts_with("no cut-out: two.png: object_m[0]: ");
        assert!(starts && refused[0].ends_with(stays), "{refused:?}");
        kept("a size that no object has");
        let two = folder.path().join("two.png");
        let options = CutOutOptions::default();
        // There is no marker in the photo.
        let entry = PhotoEntry::new(&two, "a", "cap", Scale::Marker(0.05));
        let told = add_photo(&out, &entry, &[], &options).unwrap_err();
        assert!(told.to_string().ends_with(stays), "{told}");
        kept("a marker that is not there");
        let empty = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        io::write(&two, &empty).unwrap();
        std::fs::write(&list, TWO).unwrap();
        let refused = build(&list, &out).unwrap().refused;
        assert!(refused[0].ends_with(stays), "{refused:?}");
        kept("a photo of nothing");
    }

    #[test]
    fn photos_that_are_added_at_a_time_are_all_there() {
        let folder = folder_with(TWO);
        let out = &folder.path().join("out");
        std::thread::scope(|scope| {
            for name in ["a", "b", "c"] {
                let photo = folder.path().join("one.png");
                let entry = PhotoEntry::new(photo, name, name, Scale::Length(0.3));
                scope.spawn(move || {
                    add_photo(out, &entry, &[], &CutOutOptions::default()).unwrap();
                });
            }
        });
        let library = Library::open(out).unwrap();
        assert_eq!((library.assets.len(), library.classes.len()), (3, 3));
    }

    #[test]
    fn a_photo_whose_pixels_are_not_square_is_refused() {
        let folder = folder_with(&TWO.replace("one.png", "one.exr"));
        let options = io::WriteOptions {
            canvas: io::Canvas {
                pixel_aspect: 2.0,
                ..io::Canvas::default()
            },
            ..io::WriteOptions::default()
        };
        io::write_with(folder.path().join("one.exr"), &slab(), &options).unwrap();
        let refused = build(folder.path(), folder.path().join("out")).unwrap_err();
        let told = refused.to_string();
        assert!(
            told.contains("one.exr: pixels are 2 times as wide as high, expected square ones"),
            "{told}"
        );
    }

    #[test]
    fn mistakes_in_a_list_are_named_before_any_work() {
        let printed = |list: &str| {
            let folder = folder_with(list);
            let [list, out] = paths(&folder);
            let error = build(list, &out).unwrap_err();
            assert!(!out.exists());
            error.to_string()
        };
        let declared = |classes: &str| format!("classes = {classes}\n{TWO}");
        assert!(
            printed(&declared("[\"cup\"]"))
                .contains("photos[0].class: \"cap\", expected one of cup")
        );
        assert!(
            printed(&declared("[\"cap\", \"cap\"]"))
                .contains("classes[1]: \"cap\" is listed twice")
        );
        assert!(printed(&TWO.replace("length = 0.3", "")).contains(
            "photos[0].length: missing, expected length, px_per_metre, screen_size, marker_size or captured"
        ));
        assert!(
            printed(&TWO.replace("length = 0.3", "length = -1.0")).contains("photos[0].length: -1")
        );
        assert!(printed(&TWO.replace("two.png", "one.png")).contains("photos[1].file"));
        assert!(printed(&TWO.replace("\"a\"", "\"../a\"")).contains("photos[0].asset"));
        assert!(
            printed(&TWO.replace("\"a\"", "\"assets.toml\"")).contains("the name of the manifest")
        );
        assert!(printed("photos = []\n").contains("photos: empty"));
    }

    #[test]
    fn a_csv_list_of_a_folder_says_the_same() {
        let folder = folder_with(TWO);
        let csv = "file,asset,class,px_per_metre,length,width\none.png,a,cap,,0.3,\ntwo.png,a,cap,100,,\n";
        std::fs::write(folder.path().join("photos.csv"), csv).unwrap();
        let [toml, csv] =
            ["photos.toml", "photos.csv"].map(|name| List::read(folder.path().join(name)).unwrap());
        assert_eq!(toml, csv);
        let both = build(folder.path(), folder.path().join("out")).unwrap_err();
        let both = both.to_string();
        assert!(
            both.contains("photos.toml and photos.csv, expected only one"),
            "{both}"
        );
        std::fs::remove_file(folder.path().join("photos.toml")).unwrap();
        let built = build(folder.path(), folder.path().join("out")).unwrap();
        assert_eq!(built.photos, 2);
        std::fs::write(
            folder.path().join("photos.csv"),
            "file,class\none.png,cap\n",
        )
        .unwrap();
        let reported = List::read(folder.path().join("photos.csv"))
            .unwrap_err()
            .to_string();
        assert!(
            reported.ends_with("photos.csv: line 2: missing key \"asset\""),
            "{reported}"
        );
    }

    #[test]
    fn classes_are_declared_or_come_in_the_order_of_the_list() {
        let three = TWO
            .replacen("\"a\"", "\"b\"", 1)
            .replacen("\"cap\"", "\"see-through bag\"", 1);
        let folder = folder_with(&three);
        let list = folder.path().join("photos.toml");
        let classes =
            |out: &str| build(&list, folder.path().join(out)).map(|built| built.library.classes);
        assert_eq!(classes("met").unwrap(), ["see-through bag", "cap"]);
        let declared = format!("classes = [\"cap\", \"jar\", \"see-through bag\"]\n{three}");
        std::fs::write(&list, declared).unwrap();
        assert_eq!(
            classes("declared").unwrap(),
            ["cap", "jar", "see-through bag"]
        );
        assert!(
            classes("met")
                .unwrap_err()
                .to_string()
                .contains("expected those of the folder first")
        );
    }

    #[test]
    fn what_a_corrected_list_leaves_in_the_folder_is_reported() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        let built = |text: &str| {
            std::fs::write(&list, text).unwrap();
            build(&list, &out)
        };
        assert!(built(TWO).unwrap().unlisted.is_empty());
        let one = &TWO[..TWO.rfind("[[photos]]").unwrap()];
        assert_eq!(built(one).unwrap().unlisted, ["a/two.exr"]);
        let told = built(&one.replace("cap", "cup")).unwrap_err().to_string();
        let expected = "photos[0].class: \"cup\", but asset \"a\" is \"cap\" in assets.toml; \
                        delete the folder to rebuild it";
        assert!(told.ends_with(expected), "{told}");
    }

    #[test]
    fn sizes_in_another_unit_are_asked_about_where_they_are_given() {
        let reported =
            |from: &str, to: &str| built(&TWO.replace(from, to)).unwrap_err().to_string();
        let length = reported("length = 0.3", "length = 229");
        let expected =
            "expected 0.005 to 5 m (objects are 5 mm to 5 m long); is it in millimetres?";
        assert!(
            length.ends_with(&format!("photos.toml: photos[0].length: 229, {expected}")),
            "{length}"
        );
        assert!(reported("length = 0.3", "length = 22.9").ends_with("is it in centimetres?"));
        let scale = reported("px_per_metre = 100.0", "px_per_metre = 1e308");
        assert!(
            scale
                .ends_with("photos[1].px_per_metre: 1e308, expected 1 to 1e7 (pixels for a metre)"),
            "{scale}"
        );
        assert!(
            reported("length = 0.3", "length = 0.3\nthickness = 5")
                .contains("photos[0].thickness: 5, expected")
        );
        assert!(
            reported("length = 0.3", "length = 0.3\nmass = 1e300")
                .contains("photos[0].mass: 1e300, expected")
        );
    }

    #[test]
    fn a_scale_that_is_wrong_for_one_photo_does_not_stop_the_others() {
        let folder = folder_with(&TWO.replace("px_per_metre = 100.0", "px_per_metre = 2.0"));
        let [list, out] = paths(&folder);
        let built = build(&list, &out).unwrap();
        assert_eq!(cut_outs(&built.library), ["a/one.exr"]);
        let [told] = &built.refused[..] else {
            panic!("one photo is refused")
        };
        let expected = "no cut-out: px_per_metre: 2, makes the object in two.png 30";
        assert!(told.starts_with(expected), "{told}");
        assert!(told.ends_with("; is it pixels for a centimetre?"), "{told}");
    }

    #[test]
    fn a_photo_where_its_cut_out_would_go_is_refused_before_any_work() {
        let folder = folder_with(&TWO.replace("one.png", "a/one.png"));
        let photo = folder.path().join("a/one.png");
        io::create_folder(folder.path().join("a")).unwrap();
        io::write(&photo, &slab()).unwrap();
        let before = std::fs::read(&photo).unwrap();
        let list = folder.path().join("photos.toml");
        let entry = PhotoEntry::new(&photo, "a", "cap", Scale::Length(0.3));
        let added = add_photo(folder.path(), &entry, &[], &CutOutOptions::default());
        for told in [build(&list, folder.path()).unwrap_err(), added.unwrap_err()] {
            let told = told.to_string();
            assert!(
                told.contains("is an input and would be overwritten"),
                "{told}"
            );
        }
        assert_eq!(std::fs::read(&photo).unwrap(), before);
        assert!(!folder.path().join("a/two.exr").exists());
    }

    #[test]
    fn a_photo_is_found_by_its_name_in_capitals_and_by_either_spelling_of_jpeg() {
        let folder = folder_with(&TWO.replace("one.png", "ONE.PNG"));
        let [list, out] = paths(&folder);
        assert_eq!(build(list, out).unwrap().photos, 2);
    }

    #[test]
    fn names_of_any_language_name_assets_and_files() {
        let folder = folder_with(
            &TWO.replace("\"a\"", "\"Flasche_gr\u{fc}n\"")
                .replace("one.png", "\u{fc}.png"),
        );
        std::fs::rename(
            folder.path().join("one.png"),
            folder.path().join("\u{fc}.png"),
        )
        .unwrap();
        let [list, out] = paths(&folder);
        build(list, &out).unwrap();
        assert!(out.join("Flasche_gr\u{fc}n/\u{fc}.exr").exists());
        assert_eq!(
            Library::open(out).unwrap().assets[0].name,
            "Flasche_gr\u{fc}n"
        );
    }

    #[test]
    fn a_photo_of_nothing_is_told_and_the_others_are_cut_out() {
        let folder = folder_with(TWO);
        let empty = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        io::write(folder.path().join("two.png"), &empty).unwrap();
        let [list, out] = paths(&folder);
        let built = build(list, out).unwrap();
        assert_eq!(
            (built.photos, built.refused.len(), built.rejected),
            (1, 1, 0)
        );
        assert!(built.refused[0].contains("two.png"), "{:?}", built.refused);
    }

    /// The slab on a grey board.
    fn on_grey_board() -> Image<LinearRgb> {
        slab().map(|p| {
            if p.g > p.r {
                LinearRgb::grey(0.3)
            } else {
                LinearRgb::new(0.25, 0.2, 0.2)
            }
        })
    }

    #[test]
    fn an_opaque_object_on_a_grey_board_is_all_within_its_outline() {
        let list = TWO.replace("px_per_metre", "matte = \"outline\"\npx_per_metre");
        let folder = folder_with(&list);
        io::write(folder.path().join("two.png"), &on_grey_board()).unwrap();
        let [list, out] = paths(&folder);
        build(list, &out).unwrap();
        let [one, two] = &Library::open(&out).unwrap().assets[0].photos[..] else {
            panic!("two photos")
        };
        let methods = [one, two].map(|photo| photo.record.matte);
        assert_eq!(methods, [MatteMethod::Physical, MatteMethod::Outline]);
        let is_guess = |d: &Diagnostic| d.code == Code::GreyScreen;
        assert!(!two.record.diagnostics.iter().any(is_guess));
        let Texture::Rgba(pyramid) = two.pixels().unwrap().texture else {
            panic!("one alpha for all channels")
        };
        let (w, h) = pyramid.base().size();
        let middle = pyramid.level(0)[(w / 2, h / 2)];
        assert_eq!(middle.a, 1.0);
        assert!((middle.r - 0.25).abs() < 0.01, "{middle:?}");
    }

    #[test]
    fn a_matte_of_another_name_or_of_a_capture_is_refused() {
        let refused = |line: &str| {
            let list = TWO.replacen("length = 0.3", line, 1);
            built(&list).unwrap_err().to_string()
        };
        let unknown = refused("length = 0.3\nmatte = \"opaque\"");
        assert!(unknown.contains("outline"), "{unknown}");
        let captured = refused("captured = { photos = [] }\nmatte = \"outline\"");
        let expected = "photos[0].matte: \"outline\" with captured, whose matte is measured";
        assert!(captured.contains(expected), "{captured}");
        let screen = refused("captured = { photos = [] }\nscreen = \"two.png\"");
        let expected = "two.png\" with captured, whose empty display belongs in captured.empty";
        assert!(
            screen.contains("photos[0].screen: ") && screen.contains(expected),
            "{screen}"
        );
    }

    #[test]
    fn a_guess_on_a_grey_board_is_told_kept_and_shown() {
        let folder = folder_with(TWO);
        io::write(folder.path().join("two.png"), &on_grey_board()).unwrap();
        let [list, out] = paths(&folder);
        let built = build(list, &out).unwrap();
        assert!(
            built
                .needs_review
                .iter()
                .any(|record| record.file.contains("two.exr")
                    && record
                        .diagnostics
                        .iter()
                        .any(|d| d.message.contains("too grey"))),
            "{:?}",
            built.needs_review
        );
        let library = Library::open(&out).unwrap();
        let [one, two] = [0, 1].map(|i| &library.assets[0].photos[i].record);
        assert!(
            two.diagnostics.iter().any(|d| d.code == Code::GreyScreen),
            "{:?}",
            two.diagnostics
        );
        assert!(
            one.color_confidence > Some(0.6) && two.color_confidence < Some(0.55),
            "{one:?} {two:?}"
        );
        let plain = built_sheet_height(&library, |record| record.diagnostics.clear());
        assert!(plain < built_sheet_height(&library, |_| ()));
    }

    /// Height of the contact sheet when something is done to all records: a line of text makes it
    /// higher.
    fn built_sheet_height(library: &Library, change: fn(&mut PhotoRecord)) -> usize {
        let mut library = library.clone();
        library
            .assets
            .iter_mut()
            .flat_map(|asset| &mut asset.photos)
            .for_each(|photo| change(&mut photo.record));
        let page = contact_sheets(&library).next().unwrap();
        page.unwrap().height()
    }

    #[test]
    fn a_given_size_that_contradicts_the_outline_needs_review() {
        let needs_review = |width: &str| {
            let list = TWO.replace("length = 0.3", &format!("length = 0.3\nwidth = {width}"));
            let library = built(&list).unwrap();
            let diagnostics = &library.assets[0].photos[0].record.diagnostics;
            diagnostics.iter().any(|d| {
                d.code == Code::SizeMismatch && d.message.contains("times as long as wide")
            })
        };
        assert!(!needs_review("0.15") && needs_review("0.25"));
    }

    #[test]
    fn a_size_that_no_scale_gives_is_stated_with_how_far_it_is_off() {
        let list = TWO.replace("length = 0.3", "length = 0.3\nwidth = 0.25");
        let library = built(&list).unwrap();
        let record = &library.assets[0].photos[0].record;
        let [length, width] = record.object_m;
        let off = (length - 0.3).abs().max((width - 0.25).abs());
        assert!(off > 0.03 && record.error_m >= off, "{record:?}");
        let taken = format!("; taken as {:.1} x {:.1} mm", 1e3 * length, 1e3 * width);
        assert!(
            record
                .diagnostics
                .iter()
                .any(|d| d.message.ends_with(&taken)),
            "{record:?}"
        );
    }

    #[test]
    fn a_picture_that_is_missing_is_named_before_any_work() {
        let missing = [
            ("file = \"two.png\"", "file = \"three.png\""),
            (
                "px_per_metre = 100.0",
                "px_per_metre = 100.0\nscreen = \"three.png\"",
            ),
            (
                "px_per_metre = 100.0",
                "captured = { photos = [\"three.png\"] }",
            ),
        ];
        for (from, to) in missing {
            let folder = folder_with(&TWO.replace(from, to));
            let [list, out] = paths(&folder);
            let error = build(list, &out).unwrap_err();
            assert!(
                error.to_string().contains("three.png: no such file"),
                "{error}"
            );
            assert!(!out.exists());
        }
    }

    #[test]
    fn what_killed_runs_left_is_deleted_after_a_day() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        std::fs::create_dir_all(out.join("a")).unwrap();
        let left = |name: &str, hours: u64| {
            let file = std::fs::File::create(out.join(name)).unwrap();
            let age = Duration::from_secs(hours * 3600);
            file.set_modified(std::time::SystemTime::now() - age)
                .unwrap();
        };
        let names = [
            (".petcomp-a.tmp", 25),
            ("a/.petcomp-b.tmp", 25),
            (".petcomp-c.tmp", 23),
            (".mine.tmp", 25),
        ];
        for (name, hours) in names {
            left(name, hours);
        }
        build(list, &out).unwrap();
        let stays = names.map(|(name, _)| out.join(name).exists());
        assert_eq!(stays, [false, false, true, true]);
    }

    #[test]
    fn a_cut_out_that_the_manifest_does_not_tell_of_is_noticed() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        let built = build(&list, &out).unwrap().library;
        let photo = &built.assets[0].photos[0];
        let file = out.join(&photo.record.file);
        let crc32 = crc32fast::hash(&std::fs::read(&file).unwrap());
        assert_eq!(photo.record.crc32, Some(crc32));
        // As a build leaves it that was interrupted before it wrote the manifest.
        let (w, h) = photo.pixels().unwrap().texture.size();
        io::write(&file, &Image::filled(w, h, Film::default())).unwrap();
        let told = Library::open(&out).unwrap_err().to_string();
        let expected =
            "one.exr: not the file recorded in assets.toml: build or add its photo again";
        assert!(told.ends_with(expected), "{told}");
        // An older manifest has no checksums.
        let text = io::read_text(out.join(MANIFEST)).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with("crc32"));
        let older: Vec<_> = lines.collect();
        std::fs::write(out.join(MANIFEST), older.join("\n")).unwrap();
        Library::open(&out).unwrap();
        build(&list, &out).unwrap();
        Library::open(&out).unwrap();
    }

    #[test]
    fn a_build_that_was_stopped_is_resumed() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        let stop = AtomicBool::new(false);
        let after_one = |done: usize, _: usize| stop.store(done == 1, Ordering::Relaxed);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let stopped = alone
            .unwrap()
            .install(|| super::build(&list, &out, &after_one, &stop));
        let told = stopped.unwrap_err().to_string();
        let expected = "assets.toml has 1 of 2 photos; resume processes the others";
        assert!(told.contains(expected), "{told}");
        let is_there = |file: &str| out.join(file).exists();
        assert!(is_there("a/one.exr") && !is_there("a/two.exr"));
        let resumed = || super::resume(&list, &out, &|_, _| (), &AtomicBool::new(false)).unwrap();
        let built = resumed();
        assert_eq!([built.photos, built.kept], [2, 1]);
        let manifest = io::read_text(out.join(MANIFEST)).unwrap();
        let anew = folder.path().join("anew");
        build(&list, &anew).unwrap();
        assert_eq!(io::read_text(anew.join(MANIFEST)).unwrap(), manifest);
        // A lost file, another length: these are cut out again.
        std::fs::remove_file(out.join("a/two.exr")).unwrap();
        assert_eq!(resumed().kept, 1);
        std::fs::write(&list, TWO.replace("0.3", "0.4")).unwrap();
        assert_eq!(resumed().kept, 1);
        assert_eq!(resumed().kept, 2);
    }

    #[test]
    fn what_was_cut_out_beside_an_unreadable_photo_is_in_the_manifest() {
        let folder = folder_with(TWO);
        let [list, out] = paths(&folder);
        build(&list, &out).unwrap();
        // The slab without its right third.
        let slab = slab();
        let shorter = Image::from_fn(120, 80, |x, y| slab[(if x < 70 { x } else { 0 }, y)]);
        io::write(folder.path().join("one.png"), &shorter).unwrap();
        std::fs::write(folder.path().join("two.png"), "no picture").unwrap();
        let told = build(&list, &out).unwrap_err().to_string();
        assert!(told.contains("two.png: not a picture"), "{told}");
        let library = Library::open(&out).unwrap();
        assert_eq!(cut_outs(&library), ["a/one.exr", "a/two.exr"]);
        let record = &library.assets[0].photos[0].record;
        let length = record.object_m[0] * record.px_per_metre;
        assert!((length - 40.0).abs() <= 2.0, "{length}");
    }
}
