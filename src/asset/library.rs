//! An asset folder as scenes use it: what the manifest says, and pixels that are read when they are
//! first shown.

use super::MANIFEST;
use super::flow_file;
use super::manifest::{Asset, Manifest, PhotoRecord, class_number};
use super::pixels::{BYTES_PER_PIXEL, CutOutFiles, PixelChecksums, Pixels, most_bytes};
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::io::{self, Checksum};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// Objects to put into scenes.
#[derive(Clone, Debug)]
pub struct Library {
    /// Names of the classes; a label's number is the place in this list.
    pub classes: Vec<String>,
    /// The assets, by name.
    pub assets: Vec<Asset<Photo>>,
}

/// One cut-out of an object. Clones share its pixels.
#[derive(Clone, Debug)]
pub struct Photo {
    /// The object's convex hull in texture coordinates (0 to 1, right and down), in order.
    pub outline_uv: Arc<[Point2<f64>]>,
    /// Its entry in the manifest.
    pub record: PhotoRecord,
    source: Source,
}

/// Where the pixels of a cut-out are.
#[derive(Clone, Debug)]
enum Source {
    Memory(Pixels),
    Files(Arc<CutOutFiles>, PixelChecksums),
}

impl Library {
    /// Opens an asset folder: checks its manifest and that its cut-outs are what the manifest says,
    /// several at a time. Their pixels are read when they are first needed; those used last stay in
    /// memory, up to a quarter of the machine's.
    ///
    /// # Errors
    /// Those of [`Manifest::read`]; [`Error::File`] for a cut-out that cannot be read, has another
    /// checksum than in the manifest, or, where that has none, holds values that no picture has;
    /// [`Error::Field`] (`size_m`) for one of another size than in the manifest. Of several the
    /// first in the manifest's order.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self> {
        Self::open_some(folder, |_| true)
    }

    /// The same with only the assets whose names are wanted; the entries of the others are also
    /// checked.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_some(folder: impl AsRef<Path>, wanted: impl Fn(&str) -> bool) -> Result<Self> {
        let mut manifest = Manifest::read(&folder)?;
        manifest.assets.retain(|asset| wanted(&asset.name));
        Self::from_manifest(folder.as_ref(), manifest)
    }

    /// The library of a manifest that was read or written just now.
    pub(super) fn from_manifest(folder: &Path, manifest: Manifest) -> Result<Self> {
        let mut photos = open_all(folder, &manifest)?.into_iter();
        let assets = manifest.assets.into_iter().map(|asset| {
            let own = photos.by_ref().take(asset.photos.len());
            let own = own.collect::<Result<_>>()?;
            Ok(asset.with_photos(own))
        });
        Ok(Self {
            assets: assets.collect::<Result<_>>()?,
            classes: manifest.classes,
        })
    }

    /// Warns where the cut-outs take more memory than there is for them, since pictures will then
    /// read them again and again.
    pub(crate) fn warn_of_size(&self) {
        let photos = self.assets.iter().flat_map(|asset| &asset.photos);
        let needed: f64 = photos.map(Photo::bytes_in_files).sum();
        let kept = most_bytes() as f64;
        if needed > kept {
            log::warn!(
                "cut-outs take up to {:.1} GB of memory; {:.1} GB of them are kept, the rest are reread each time: \
                 a smaller longest_side in [cut_out] of their list makes this faster",
                needed / 1e9,
                kept / 1e9
            );
        }
    }

    /// Reads the pixels of every cut-out, as a picture that shows it would.
    ///
    /// # Errors
    /// As [`Photo::pixels`], for the first in the manifest's order.
    #[doc(hidden)]
    pub fn check_pixels(&self) -> Result<()> {
        let photos: Vec<_> = self.assets.iter().flat_map(|a| &a.photos).collect();
        let read = |photo: &&Photo| photo.pixels_once().map(drop);
        let checked: Vec<_> = photos.par_iter().map(read).collect();
        checked.into_iter().collect()
    }

    /// The asset with a name.
    pub fn find(&self, name: &str) -> Option<&Asset<Photo>> {
        self.assets.iter().find(|asset| asset.name == name)
    }

    /// Place of an asset's class in the list; none for a distractor.
    ///
    /// # Panics
    /// When the asset is not in this library and has a class that the library does not have.
    pub fn class_number(&self, asset: &Asset<Photo>) -> Option<u32> {
        let class = asset.label_class()?;
        Some(class_number(&self.classes, class).expect("a class of the library"))
    }
}

/// The photos of a manifest in its order.
fn open_all(folder: &Path, manifest: &Manifest) -> Result<Vec<Result<Photo>>> {
    let files = Arc::new(CutOutFiles::in_folder(folder)?);
    let records: Vec<(String, &PhotoRecord)> = places_and_records(manifest).collect();
    let photos = records
        .par_iter()
        .map(|(at, record)| open(folder, record, at, &files));
    Ok(photos.collect())
}

/// All photos of a manifest, with their places in it.
fn places_and_records(manifest: &Manifest) -> impl Iterator<Item = (String, &PhotoRecord)> {
    manifest.assets.iter().enumerate().flat_map(|(i, asset)| {
        let photos = asset.photos.iter().enumerate();
        photos.map(move |(j, photo)| (format!("assets[{i}].photos[{j}]"), photo))
    })
}

/// By how many pixels a picture may differ from the size that its manifest gives in metres:
/// rounding.
const ROUNDING_PX: f64 = 0.5;

/// The photo of a record that stands at a place of the manifest; what its checksum does not cover
/// is read now.
fn open(folder: &Path, record: &PhotoRecord, at: &str, files: &Arc<CutOutFiles>) -> Result<Photo> {
    let path = io::inside(folder, &record.file).map_err(|e| in_manifest(e, folder, at))?;
    let texture = Checksum::from_file(&path)?.crc32;
    check_crc32(texture, record).map_err(|what| Error::file(&path, what))?;
    let header = io::read_header(&path)?;
    let size = (header.width, header.height);
    check_size(size, record).map_err(|e| in_manifest(e, folder, at))?;
    let flow = flow_file::path(folder, record).map_err(|e| in_manifest(e, folder, at))?;
    let flow = flow.map(Checksum::from_file).transpose()?;
    let checksums = PixelChecksums {
        texture,
        flow: flow.map(|found| found.crc32),
    };
    if record.crc32.is_none() || flow.is_some() {
        files.pixels(record, checksums)?;
    }
    let source = Source::Files(Arc::clone(files), checksums);
    Ok(Photo::from_source(source, size, record.clone()))
}

fn in_manifest(error: Error, folder: &Path, at: &str) -> Error {
    error.within(at).in_file(folder.join(MANIFEST))
}

/// Fails where a file is another than the manifest tells of, as a build leaves it that was
/// interrupted: its size and outline would be those of another cut-out.
fn check_crc32(found: u32, record: &PhotoRecord) -> std::result::Result<(), String> {
    if record.crc32.is_none_or(|crc32| crc32 == found) {
        return Ok(());
    }
    let advice = "build or add its photo again";
    Err(format!("not the file recorded in {MANIFEST}: {advice}"))
}

fn check_size((w, h): (usize, usize), record: &PhotoRecord) -> Result<()> {
    let [expected_w, expected_h] = record.size_px();
    let is_near = |expected: f64, found: usize| (expected - found as f64).abs() <= ROUNDING_PX;
    if is_near(expected_w, w) && is_near(expected_h, h) {
        return Ok(());
    }
    let what = format!(
        "{expected_w:.1} x {expected_h:.1} pixels, but {} has {w} x {h}",
        record.file
    );
    Err(Error::value("size_m", what))
}

impl Photo {
    /// A cut-out in memory and its entry in the manifest.
    pub fn new(cut_out: impl Into<Pixels>, record: PhotoRecord) -> Self {
        let pixels = cut_out.into();
        let size = pixels.texture.size();
        Self::from_source(Source::Memory(pixels), size, record)
    }

    fn from_source(source: Source, size: (usize, usize), record: PhotoRecord) -> Self {
        Self {
            outline_uv: texture_coordinates(&record.outline_px, size),
            record,
            source,
        }
    }

    /// Memory that its pixels take once they are read from files and shown.
    fn bytes_in_files(&self) -> f64 {
        let [w, h] = self.record.size_px();
        match self.source {
            Source::Memory(_) => 0.0,
            Source::Files(..) => BYTES_PER_PIXEL * w * h,
        }
    }

    /// What a card shows of it, read from its file where it is not in memory.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read, or has changed since its folder was opened.
    pub fn pixels(&self) -> Result<Pixels> {
        match &self.source {
            Source::Memory(pixels) => Ok(pixels.clone()),
            Source::Files(files, checksums) => files.pixels(&self.record, *checksums),
        }
    }

    /// The same for a single look: what is read is not kept.
    pub(super) fn pixels_once(&self) -> Result<Pixels> {
        match &self.source {
            Source::Memory(pixels) => Ok(pixels.clone()),
            Source::Files(files, checksums) => files.read(&self.record, *checksums),
        }
    }

    /// Checksums of its pixels: of its files, where it has some.
    pub(crate) fn checksums(&self) -> PixelChecksums {
        match &self.source {
            Source::Memory(pixels) => pixels.checksums(),
            Source::Files(_, checksums) => *checksums,
        }
    }

    /// Width and height of the card that carries the whole cut-out, metres.
    pub fn size(&self) -> [f64; 2] {
        self.record.size_m
    }
}

fn texture_coordinates(outline_px: &[[f64; 2]], (w, h): (usize, usize)) -> Arc<[Point2<f64>]> {
    let corners = outline_px.iter();
    corners
        .map(|&[x, y]| Point2::new(x / w as f64, y / h as f64))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::manifest::tests::photo;
    use super::super::role::Role;
    use super::*;
    use crate::image::Image;
    use crate::pixel::PremulRgba;

    fn folder_with(picture: Option<(usize, usize)>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let photos = vec![photo("a.exr")];
        let record = Asset {
            name: "a".into(),
            role: Role::Object,
            class: "label".into(),
            thickness: 0.01,
            mass: 0.02,
            photos,
        };
        let classes = ["cap_label", "cap", "label"].map(String::from).into();
        Manifest {
            classes,
            assets: vec![record],
        }
        .write(folder.path())
        .unwrap();
        if let Some((w, h)) = picture {
            let image = Image::filled(w, h, PremulRgba::new(0.25, 0.5, 0.125, 0.75));
            io::write(folder.path().join("a.exr"), &image).unwrap();
        }
        folder
    }

    #[test]
    fn a_library_opens_with_textures_and_outlines() {
        let folder = folder_with(Some((40, 20)));
        let library = Library::open(folder.path()).unwrap();
        let asset = library.find("a").unwrap();
        assert_eq!(
            (library.class_number(asset), asset.photos.len()),
            (Some(2), 1)
        );
        assert_eq!(
            asset.photos[0].pixels().unwrap().texture.texel(3, 3),
            PremulRgba::new(0.25, 0.5, 0.125, 0.75).into()
        );
        assert_eq!(
            asset.photos[0].outline_uv[0],
            Point2::new(1.0 / 40.0, 1.0 / 20.0)
        );
    }

    /// Without a checksum it is read when the folder is opened.
    fn note_checksum(folder: &tempfile::TempDir) {
        let mut manifest = Manifest::read(folder.path()).unwrap();
        let checksum = Checksum::from_file(folder.path().join("a.exr")).unwrap();
        manifest.assets[0].photos[0].crc32 = Some(checksum.crc32);
        manifest.write(folder.path()).unwrap();
    }

    #[test]
    fn a_cut_out_that_changes_is_refused_unless_it_was_read() {
        let [read, unread] = [(); 2].map(|()| folder_with(Some((40, 20))));
        [&read, &unread].into_iter().for_each(note_checksum);
        let [kept, changed] = [&read, &unread].map(|folder| Library::open(folder).unwrap());
        let before = kept.assets[0].photos[0].pixels().unwrap();
        for folder in [&read, &unread] {
            let other = Image::filled(40, 20, PremulRgba::TRANSPARENT);
            io::write(folder.path().join("a.exr"), &other).unwrap();
        }
        let after = kept.assets[0].photos[0].pixels().unwrap();
        assert_eq!(after.texture.checksum(), before.texture.checksum());
        let refused = changed.assets[0].photos[0].pixels().unwrap_err();
        let expected = "a.exr: has changed since its folder was opened";
        assert!(refused.to_string().ends_with(expected), "{refused}");
        assert!(changed.check_pixels().is_err() && kept.check_pixels().is_err());
    }

    #[test]
    fn a_missing_or_wrong_cut_out_is_named() {
        let printed = Library::open(folder_with(None).path())
            .unwrap_err()
            .to_string();
        assert!(printed.contains("a.exr"), "{printed}");
        let printed = Library::open(folder_with(Some((40, 22))).path())
            .unwrap_err()
            .to_string();
        assert!(
            printed.contains("assets[0].photos[0].size_m") && printed.contains("40 x 22"),
            "{printed}"
        );
    }

    #[test]
    fn a_folder_without_a_manifest_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        assert!(
            Library::open(folder.path())
                .unwrap_err()
                .to_string()
                .contains(MANIFEST)
        );
    }
}
