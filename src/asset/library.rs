//! An asset folder in memory, ready to be put into scenes.

use super::MANIFEST;
use super::manifest::{AssetRecord, Manifest, PhotoRecord};
use super::texture::Texture;
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::image::Image;
use crate::io;
use crate::pixel::Film;
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// Objects to put into scenes.
#[derive(Clone, Debug)]
pub struct Library {
    /// Names of the classes; [`Asset::class`] is a place in this list.
    pub classes: Vec<String>,
    /// The assets, by name.
    pub assets: Vec<Asset>,
}

/// One object.
#[derive(Clone, Debug)]
pub struct Asset {
    /// Its name.
    pub name: String,
    /// Index into the class list.
    pub class: u32,
    /// Thickness of the body that falls, metres.
    pub thickness: f64,
    /// Mass, kilograms.
    pub mass: f64,
    /// Its photos; at least one.
    pub photos: Vec<Photo>,
}

/// One cut-out of an object.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Width and height of the card that carries the whole cut-out, metres.
    pub size: [f64; 2],
    /// The cut-out, premultiplied, scene-linear.
    pub texture: Texture,
    /// The object's convex hull in texture coordinates (0 to 1, right and down), in order.
    pub outline_uv: Arc<[Point2<f64>]>,
    /// What the manifest says of it.
    pub record: PhotoRecord,
}

impl Library {
    /// Opens an asset folder: checks its manifest and loads its cut-outs, several at a time.
    ///
    /// # Errors
    /// Those of [`Manifest::read`]; [`Error::File`] for a cut-out that cannot be read or holds values that no
    /// picture has; [`Error::Field`] (`size_m`) for
    /// one of another size than the manifest says. Of several the first in the manifest's order.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self> {
        Self::open_some(folder, |_| true)
    }

    /// The same with no other assets than those whose names are wanted; what the manifest says of others is checked still.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_some(folder: impl AsRef<Path>, wanted: impl Fn(&str) -> bool) -> Result<Self> {
        Self::load(folder.as_ref(), wanted, &[])
    }

    /// The same with photos that were just [added](super::add_photo), which need not be read.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(folder: impl AsRef<Path>, added: &[Photo]) -> Result<Self> {
        Self::load(folder.as_ref(), |_| true, added)
    }

    fn load(folder: &Path, wanted: impl Fn(&str) -> bool, added: &[Photo]) -> Result<Self> {
        let mut manifest = Manifest::read(folder)?;
        manifest.assets.retain(|asset| wanted(&asset.name));
        let photos: Vec<(usize, usize)> = manifest
            .assets
            .iter()
            .enumerate()
            .flat_map(places)
            .collect();
        let load = |&(i, j): &(usize, usize)| {
            let record = &manifest.assets[i].photos[j];
            let known = added.iter().find(|photo| photo.record == *record).cloned();
            known.map_or_else(
                || load(folder, record, &format!("assets[{i}].photos[{j}]")),
                Ok,
            )
        };
        let loaded: Vec<Result<Photo>> = photos.par_iter().map(load).collect();
        let mut loaded = loaded.into_iter();
        let mut assets = Vec::with_capacity(manifest.assets.len());
        for record in &manifest.assets {
            let photos = loaded
                .by_ref()
                .take(record.photos.len())
                .collect::<Result<_>>()?;
            assets.push(Asset {
                name: record.name.clone(),
                class: manifest.class(&record.class)?,
                thickness: record.thickness,
                mass: record.mass,
                photos,
            });
        }
        Ok(Self {
            classes: manifest.classes,
            assets,
        })
    }

    /// The asset of a name.
    pub fn find(&self, name: &str) -> Option<&Asset> {
        self.assets.iter().find(|asset| asset.name == name)
    }
}

fn places((i, asset): (usize, &AssetRecord)) -> impl Iterator<Item = (usize, usize)> + use<> {
    (0..asset.photos.len()).map(move |j| (i, j))
}

/// By how many pixels a picture may differ from the size that its manifest gives in metres: rounding.
const SLACK_PX: f64 = 0.5;

fn load(folder: &Path, record: &PhotoRecord, at: &str) -> Result<Photo> {
    let path = io::inside(folder, &record.file)
        .map_err(|e| e.within(at).in_file(folder.join(MANIFEST)))?;
    let image: Image<Film> = io::read(&path)?;
    let (w, h) = (image.width() as f64, image.height() as f64);
    let told = record.size_m.map(|side| side * record.px_per_metre);
    if (told[0] - w).abs() > SLACK_PX || (told[1] - h).abs() > SLACK_PX {
        let what = format!(
            "{:.1} x {:.1} pixels, but {} has {w} x {h}",
            told[0], told[1], record.file
        );
        return Err(Error::value("size_m", what)
            .within(at)
            .in_file(folder.join(MANIFEST)));
    }
    if let Some(i) = image.pixels().iter().position(|p| !p.is_sound()) {
        let (x, y) = (i % image.width(), i / image.width());
        let Film { color, opacity } = image.pixels()[i];
        let [color, opacity] = [color, opacity].map(<[f32; 3]>::from);
        let told = format!("colour {color:?} and opacity {opacity:?} at ({x}, {y})");
        let what = format!("{told}, expected finite colour and opacity from 0 to 1");
        return Err(Error::file(path, what));
    }
    Ok(Photo::new(image, record.clone()))
}

impl Photo {
    /// A cut-out and what the manifest says of it.
    pub(super) fn new(image: Image<Film>, record: PhotoRecord) -> Self {
        let (w, h) = (image.width() as f64, image.height() as f64);
        Self {
            size: record.size_m,
            texture: image.into(),
            outline_uv: record
                .outline_px
                .iter()
                .map(|&[x, y]| Point2::new(x / w, y / h))
                .collect(),
            record,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::manifest::tests::photo;
    use super::*;
    use crate::pixel::PremulRgba;

    fn folder_with(picture: Option<(usize, usize)>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let photos = vec![photo("a.exr")];
        let record = AssetRecord {
            name: "a".into(),
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
        assert_eq!((asset.class, asset.photos.len()), (2, 1));
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
            Library::open_with(folder.path(), &[Photo::new(film, record.clone())]).unwrap();
        assert_eq!(library.assets[0].photos[0].texture.size(), (40, 20));
        let other = PhotoRecord {
            file: "b.exr".into(),
            ..record
        };
        let stranger = Photo::new(Image::filled(40, 20, Film::default()), other);
        assert!(Library::open_with(folder.path(), &[stranger]).is_err());
    }

    #[test]
    fn a_missing_or_wrong_cut_out_is_named() {
        let said = Library::open(folder_with(None).path())
            .unwrap_err()
            .to_string();
        assert!(said.contains("a.exr"), "{said}");
        let said = Library::open(folder_with(Some((40, 22))).path())
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("assets[0].photos[0].size_m") && said.contains("40 x 22"),
            "{said}"
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
