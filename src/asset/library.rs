//! An asset folder in memory, ready to be put into scenes.

use super::MANIFEST;
use super::flow_file;
use super::manifest::{Asset, Manifest, PhotoRecord, class_number};
use super::surface::SurfaceCache;
use super::texture::Texture;
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::image::Image;
use crate::io;
use crate::matte::Flow;
use crate::pixel::Film;
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

/// One cut-out of an object.
#[derive(Clone, Debug)]
pub struct Photo {
    /// The cut-out, premultiplied, scene-linear.
    pub texture: Texture,
    /// The object's convex hull in texture coordinates (0 to 1, right and down), in order.
    pub outline_uv: Arc<[Point2<f64>]>,
    /// How it bends what is seen through it; none where that was not measured.
    #[doc(hidden)]
    pub flow: Option<Arc<Flow>>,
    /// What its texels are of.
    #[doc(hidden)]
    pub surface: SurfaceCache,
    /// Its entry in the manifest.
    pub record: PhotoRecord,
}

impl Library {
    /// Opens an asset folder: checks its manifest and loads its cut-outs, several at a time.
    ///
    /// # Errors
    /// Those of [`Manifest::read`]; [`Error::File`] for a cut-out that cannot be read, has another
    /// checksum than in the manifest, or holds values that no picture has; [`Error::Field`]
    /// (`size_m`) for one of another size than in the manifest. Of several the first in the
    /// manifest's order.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self> {
        Self::open_some(folder, |_| true)
    }

    /// The same with only the assets whose names are wanted; the entries of the others are checked,
    /// too.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_some(folder: impl AsRef<Path>, wanted: impl Fn(&str) -> bool) -> Result<Self> {
        let mut manifest = Manifest::read(&folder)?;
        manifest.assets.retain(|asset| wanted(&asset.name));
        Self::from_manifest(folder.as_ref(), manifest, &[])
    }

    /// The same with photos that were just [added](super::add_photo), which need not be read.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(folder: impl AsRef<Path>, added: Vec<Photo>) -> Result<Self> {
        let manifest = Manifest::read(&folder)?;
        Self::from_manifest(folder.as_ref(), manifest, &added)
    }

    /// The library of a manifest that was read or written just now, with photos that need not be
    /// read.
    pub(super) fn from_manifest(
        folder: &Path,
        manifest: Manifest,
        added: &[Photo],
    ) -> Result<Self> {
        let mut photos = load_all(folder, &manifest, added).into_iter();
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

    /// The asset of a name.
    pub fn find(&self, name: &str) -> Option<&Asset<Photo>> {
        self.assets.iter().find(|asset| asset.name == name)
    }

    /// Place of an asset's class in the list; none of a distractor.
    ///
    /// # Panics
    /// When the asset is none of this library and has a class of its own.
    pub fn class_number(&self, asset: &Asset<Photo>) -> Option<u32> {
        let class = asset.label_class()?;
        Some(class_number(&self.classes, class).expect("a class of the library"))
    }
}

/// The photos of a manifest in its order: those just added, and the others from their files.
fn load_all(folder: &Path, manifest: &Manifest, added: &[Photo]) -> Vec<Result<Photo>> {
    let records: Vec<(String, &PhotoRecord)> = places_and_records(manifest).collect();
    records
        .par_iter()
        .map(|(at, record)| {
            let added = added.iter().find(|photo| photo.record == **record);
            added.map_or_else(|| load(folder, record, at), |photo| Ok(photo.clone()))
        })
        .collect()
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

/// Reads the cut-out of a record that stands at a place of the manifest.
fn load(folder: &Path, record: &PhotoRecord, at: &str) -> Result<Photo> {
    let path = io::inside(folder, &record.file).map_err(|e| in_manifest(e, folder, at))?;
    let image: Image<Film> = io::read_checked(&path, |bytes| check_bytes(bytes, record))?;
    check_size(&image, record).map_err(|e| in_manifest(e, folder, at))?;
    check_pixels(&image).map_err(|what| Error::file(path, what))?;
    let flow =
        flow_file::read(folder, record, image.size()).map_err(|e| in_manifest(e, folder, at))?;
    Ok(Photo {
        flow: flow.map(Arc::new),
        ..Photo::new(image, record.clone())
    })
}

fn in_manifest(error: Error, folder: &Path, at: &str) -> Error {
    error.within(at).in_file(folder.join(MANIFEST))
}

/// Fails where a file is another than the manifest tells of, as a build leaves it that was
/// interrupted: its size and outline would be those of another cut-out.
fn check_bytes(bytes: &[u8], record: &PhotoRecord) -> std::result::Result<(), String> {
    let is_same = |crc32: u32| crc32 == crc32fast::hash(bytes);
    if record.crc32.is_none_or(is_same) {
        return Ok(());
    }
    let advice = "build or add its photo again";
    Err(format!("not the file that {MANIFEST} tells of: {advice}"))
}

fn check_size(image: &Image<Film>, record: &PhotoRecord) -> Result<()> {
    let [w, h] = [image.width() as f64, image.height() as f64];
    let [expected_w, expected_h] = record.size_px();
    if (expected_w - w).abs() <= ROUNDING_PX && (expected_h - h).abs() <= ROUNDING_PX {
        return Ok(());
    }
    let what = format!(
        "{expected_w:.1} x {expected_h:.1} pixels, but {} has {w} x {h}",
        record.file
    );
    Err(Error::value("size_m", what))
}

/// What is wrong with the first pixel that no picture has.
pub(super) fn check_pixels(image: &Image<Film>) -> std::result::Result<(), String> {
    let unsound = image.pixels().iter().position(|p| !p.is_sound());
    unsound.map_or(Ok(()), |i| {
        let at = (i % image.width(), i / image.width());
        Err(unsound_pixel(&image[at], at))
    })
}

fn unsound_pixel(film: &Film, (x, y): (usize, usize)) -> String {
    let [color, opacity] = [film.color, film.opacity].map(<[f32; 3]>::from);
    format!(
        "colour {color:?} and opacity {opacity:?} at ({x}, {y}), expected finite colour and opacity from 0 to 1"
    )
}

impl Photo {
    /// A cut-out and its entry in the manifest.
    pub fn new(cut_out: impl Into<Texture>, record: PhotoRecord) -> Self {
        let texture = cut_out.into();
        Self {
            outline_uv: texture_coordinates(&record.outline_px, texture.size()),
            texture,
            flow: None,
            surface: SurfaceCache::default(),
            record,
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
            asset.photos[0].texture.texel(3, 3),
            PremulRgba::new(0.25, 0.5, 0.125, 0.75).into()
        );
        assert_eq!(
            asset.photos[0].outline_uv[0],
            Point2::new(1.0 / 40.0, 1.0 / 20.0)
        );
    }

    #[test]
    fn photos_in_memory_are_not_read() {
        let folder = folder_with(None);
        let record = Manifest::read(folder.path())
            .unwrap()
            .assets
            .remove(0)
            .photos
            .remove(0);
        let film = Image::filled(40, 20, Film::from(PremulRgba::new(0.25, 0.5, 0.125, 0.75)));
        let library =
            Library::open_with(folder.path(), vec![Photo::new(film, record.clone())]).unwrap();
        assert_eq!(library.assets[0].photos[0].texture.size(), (40, 20));
        let other = PhotoRecord {
            file: "b.exr".into(),
            ..record
        };
        let stranger = Photo::new(Image::filled(40, 20, Film::default()), other);
        assert!(Library::open_with(folder.path(), vec![stranger]).is_err());
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
