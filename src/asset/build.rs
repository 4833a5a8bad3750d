//! Many photos into an asset folder, from a list.

use super::folder::{AddPhoto, Scale, asset_of, cut_out_file, read_or_new, write_photo};
use super::screen_source::ScreenSource;
use super::{DEFAULT_MASS, DEFAULT_THICKNESS, Manifest};
use crate::error::{Error, Result};
use crate::io;
use crate::matte::CutOutOptions;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A list of photos: `photos.toml`, or `photos.csv` with the fields of [`ListedPhoto`] for columns.
///
/// ```toml
/// [[photos]]
/// file = "IMG_0001.jpg"       # relative to the list
/// asset = "bottle_01"
/// class = "cap"
/// px_per_metre = 1966.7       # or: length = 0.265, and width where it is known
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct List {
    /// Names of the classes, where they are not the [default](super::default_classes) ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<String>,
    /// How the objects are cut out.
    #[serde(default)]
    pub cut_out: CutOutOptions,
    /// The photos.
    pub photos: Vec<ListedPhoto>,
}

/// A photo of a [`List`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedPhoto {
    /// The photo, relative to the list.
    pub file: String,
    /// Name of the object.
    pub asset: String,
    /// Name of its class.
    pub class: String,
    /// Pixels of the photo for a metre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub px_per_metre: Option<f64>,
    /// Or: length of the object along its longest side, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// And its width, metres: then both fix the scale, and contradict an outline of other proportions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
    /// What it was photographed on: `auto`, a colour `R,G,B` or a photo of the empty screen. Default: `auto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen: Option<String>,
    /// Thickness, metres. Default: 0.005.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// Mass, kilograms. Default: 0.025.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
}

/// What [`build`] did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Built {
    /// Photos that were cut out.
    pub photos: usize,
    /// Assets in the folder.
    pub assets: usize,
    /// Photos that gave no cut-out, and why.
    pub refused: Vec<String>,
    /// Cut-outs that a person should look at, and why.
    pub doubtful: Vec<String>,
}

/// Names of the lists that a folder may hold.
const LISTS: [&str; 2] = ["photos.toml", "photos.csv"];

/// Cuts all photos of a list out, several at a time, into an asset folder, which is made if it is not there.
///
/// `list` is a TOML or CSV file, or a folder with `photos.toml` or `photos.csv` in it. A photo without a usable object is
/// left out and told in [`Built::refused`].
///
/// `progress` is called with the photos done and their number, at the start and after each photo, from several threads.
/// What the folder already had stays; a photo that is there already is replaced. The manifest is written last and does not
/// depend on threads.
///
/// # Errors
/// A list that cannot be read or be right (before any work, naming the entry); the first
/// photo that cannot be read, or [`Error::Photo`] where no photo gives a cut-out.
pub fn build(
    list: impl AsRef<Path>,
    folder: impl AsRef<Path>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Built> {
    let (path, folder) = (list_in(list.as_ref())?, folder.as_ref());
    let path = path.as_path();
    let list = List::read(path)?;
    let mut manifest = read_or_new(folder)?;
    let at = path.parent().unwrap_or(Path::new(""));
    let adds = list.adds(&mut manifest, at).map_err(|e| e.in_file(path))?;
    let count = adds.len();
    let done = AtomicUsize::new(0);
    progress(0, count);
    let work = list.photos.par_iter().zip(&adds).map(|(photo, add)| {
        let record = write_photo(folder, &at.join(&photo.file), add).map(|photo| photo.record);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, count);
        record
    });
    let records: Vec<Result<_>> = work.collect();
    let mut built = Built::default();
    for (i, (record, add)) in records.into_iter().zip(&adds).enumerate() {
        let record = match record {
            Err(refusal @ Error::Photo { .. }) => {
                built.refused.push(refusal.to_string());
                continue;
            }
            other => other?,
        };
        if !record.doubts.is_empty() {
            built.doubtful.push(format!("{}: {}", record.file, record.doubts.join("; ")));
        }
        let inserted = manifest.insert(asset_of(add, record));
        inserted.map_err(|e| e.within(&format!("photos[{i}]")).in_file(path))?;
        built.photos += 1;
    }
    if built.photos == 0 {
        return Err(Error::file(path, format!("no photo gave a cut-out: {}", built.refused.join("; "))));
    }
    manifest.write(folder)?;
    built.assets = manifest.assets.len();
    Ok(built)
}

/// The list itself, or the one in a folder.
fn list_in(path: &Path) -> Result<PathBuf> {
    if !path.is_dir() {
        return Ok(path.into());
    }
    let inside = LISTS.iter().map(|name| path.join(name)).find(|list| list.exists());
    inside.ok_or_else(|| Error::file(path, format!("expected {} in it, a list of the photos", LISTS.join(" or "))))
}

impl List {
    /// Reads a list: CSV where the file is called so, else TOML.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read or understood, with its line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            return io::read_toml(path);
        }
        let text = io::read_text(path)?;
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let photos: std::result::Result<Vec<ListedPhoto>, _> = reader.deserialize().collect();
        Ok(Self { photos: photos.map_err(|e| Error::file(path, e))?, ..Self::default() })
    }

    /// The photos with all that is known of them, checked against the folder's manifest.
    fn adds(&self, manifest: &mut Manifest, at: &Path) -> Result<Vec<AddPhoto>> {
        if !self.classes.is_empty() {
            if !manifest.assets.is_empty() && manifest.classes != self.classes {
                let what = format!("{:?}, but the folder has {:?}", self.classes, manifest.classes);
                return Err(Error::value("classes", what));
            }
            manifest.classes.clone_from(&self.classes);
        }
        if self.photos.is_empty() {
            return Err(Error::value("photos", "empty, expected at least one"));
        }
        let adds = self.photos.iter().enumerate().map(|(i, photo)| {
            let add = photo.add(&self.cut_out, at).and_then(|add| add.check(manifest).map(|()| add));
            add.map_err(|e| e.within(&format!("photos[{i}]")))
        });
        let adds: Vec<AddPhoto> = adds.collect::<Result<_>>()?;
        self.check_files(&adds)?;
        Ok(adds)
    }

    /// No two photos become the same file.
    fn check_files(&self, adds: &[AddPhoto]) -> Result<()> {
        let mut seen = std::collections::BTreeMap::new();
        for (i, (photo, add)) in self.photos.iter().zip(adds).enumerate() {
            if let Some(first) = seen.insert(cut_out_file(Path::new(&photo.file), add), i) {
                let what = format!("\"{}\", would become the same cut-out as photos[{first}]", photo.file);
                return Err(Error::value(format!("photos[{i}].file"), what));
            }
        }
        Ok(())
    }
}

impl ListedPhoto {
    fn add(&self, options: &CutOutOptions, at: &Path) -> Result<AddPhoto> {
        let scale = match (self.px_per_metre, self.length, self.width) {
            (Some(scale), None, None) => Scale::PxPerMetre(scale),
            (None, Some(length), None) => Scale::Length(length),
            (None, Some(length), Some(width)) => Scale::Size([length, width]),
            (None, None, _) => return Err(Error::value("px_per_metre", "missing; expected it, or length")),
            (Some(_), _, _) => return Err(Error::value("length", "expected either it or px_per_metre, not both")),
        };
        let screen = match self.screen.as_deref().unwrap_or("auto").parse()? {
            ScreenSource::Photo(path) => ScreenSource::Photo(at.join(path)),
            told => told,
        };
        Ok(AddPhoto {
            asset: self.asset.clone(),
            class: self.class.clone(),
            scale,
            thickness: self.thickness.unwrap_or(DEFAULT_THICKNESS),
            mass: self.mass.unwrap_or(DEFAULT_MASS),
            screen,
            options: options.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Library, MANIFEST};
    use super::*;
    use crate::image::Image;
    use crate::pixel::LinearRgb;

    /// A red slab of 60 x 30 pixels on a green screen.
    fn slab() -> Image<LinearRgb> {
        Image::from_fn(120, 80, |x, y| {
            let inside = (30..90).contains(&x) && (25..55).contains(&y);
            if inside { LinearRgb::new(0.6, 0.05, 0.05) } else { LinearRgb::new(0.04, 0.4, 0.08) }
        })
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
        build(folder.path().join("photos.toml"), folder.path().join("out"), &|_, _| ())?;
        Library::open(folder.path().join("out"))
    }

    const TWO: &str = "[[photos]]\nfile = \"one.png\"\nasset = \"a\"\nclass = \"cap\"\nlength = 0.3\n\
                       [[photos]]\nfile = \"two.png\"\nasset = \"a\"\nclass = \"cap\"\npx_per_metre = 100.0\n";

    #[test]
    fn a_folder_without_a_list_is_told_what_is_expected_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let error = build(folder.path(), folder.path().join("out"), &|_, _| ()).unwrap_err().to_string();
        assert!(error.contains("expected photos.toml or photos.csv in it"), "{error}");
    }

    #[test]
    fn a_list_becomes_a_library_of_the_right_size() {
        let library = built(TWO).unwrap();
        let [asset] = &library.assets[..] else { panic!("one asset") };
        assert_eq!((asset.class, asset.photos.len()), (1, 2));
        // An edge is told to a pixel, so a length to two: 60 px are 0.3 m to within 1 in 30.
        assert!((asset.photos[0].record.px_per_metre / 200.0 - 1.0).abs() < 1.0 / 30.0);
        assert!((asset.photos[1].record.object_m[0] - 0.6).abs() <= 0.02);
        assert!((asset.photos[1].record.object_m[1] - 0.3).abs() <= 0.02);
        assert_eq!(asset.photos[1].record.source, "two.png");
    }

    #[test]
    fn building_twice_changes_nothing() {
        let folder = folder_with(TWO);
        let manifest = || {
            build(folder.path().join("photos.toml"), folder.path().join("out"), &|_, _| ()).unwrap();
            std::fs::read(folder.path().join("out").join(MANIFEST)).unwrap()
        };
        assert_eq!(manifest(), manifest());
    }

    #[test]
    fn mistakes_in_a_list_are_named_before_any_work() {
        let said = |list: &str| {
            let folder = folder_with(list);
            let error = build(folder.path().join("photos.toml"), folder.path().join("out"), &|_, _| ()).unwrap_err();
            assert!(!folder.path().join("out").exists());
            error.to_string()
        };
        assert!(said(&TWO.replace("\"cap\"", "\"cup\"")).contains("photos[0].class: \"cup\", expected one of"));
        assert!(said(&TWO.replace("length = 0.3", "")).contains("photos[0].px_per_metre: missing"));
        assert!(said(&TWO.replace("length = 0.3", "length = -1.0")).contains("photos[0].length: -1"));
        assert!(said(&TWO.replace("two.png", "one.png")).contains("photos[1].file"));
        assert!(said(&TWO.replace("\"a\"", "\"../a\"")).contains("photos[0].asset"));
        assert!(said("photos = []\n").contains("photos: empty"));
    }

    #[test]
    fn a_csv_list_of_a_folder_says_the_same() {
        let folder = folder_with(TWO);
        let csv = "file,asset,class,px_per_metre,length,width\none.png,a,cap,,0.3,\ntwo.png,a,cap,100,,\n";
        std::fs::write(folder.path().join("photos.csv"), csv).unwrap();
        let [toml, csv] = ["photos.toml", "photos.csv"].map(|name| List::read(folder.path().join(name)).unwrap());
        assert_eq!(toml, csv);
        std::fs::remove_file(folder.path().join("photos.toml")).unwrap();
        assert_eq!(build(folder.path(), folder.path().join("out"), &|_, _| ()).unwrap().photos, 2);
        std::fs::write(folder.path().join("photos.csv"), "file,asset\none.png,a\n").unwrap();
        assert!(List::read(folder.path().join("photos.csv")).unwrap_err().to_string().contains("photos.csv"));
    }

    #[test]
    fn a_photo_of_nothing_is_told_and_the_others_are_cut_out() {
        let folder = folder_with(TWO);
        let empty = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        io::write(folder.path().join("two.png"), &empty).unwrap();
        let built = build(folder.path().join("photos.toml"), folder.path().join("out"), &|_, _| ()).unwrap();
        assert_eq!((built.photos, built.refused.len()), (1, 1));
        assert!(built.refused[0].contains("two.png"), "{:?}", built.refused);
    }

    #[test]
    fn a_told_size_that_contradicts_the_outline_is_doubted() {
        let is_doubted = |width: &str| {
            let list = TWO.replace("length = 0.3", &format!("length = 0.3\nwidth = {width}"));
            let doubts = built(&list).unwrap().assets[0].photos[0].record.doubts.clone();
            doubts.iter().any(|doubt| doubt.contains("times as long as wide"))
        };
        assert!(!is_doubted("0.15") && is_doubted("0.25"));
    }

    #[test]
    fn a_photo_that_is_missing_leaves_no_manifest() {
        let folder = folder_with(&TWO.replace("two.png", "three.png"));
        let out = folder.path().join("out");
        let error = build(folder.path().join("photos.toml"), &out, &|_, _| ()).unwrap_err();
        assert!(error.to_string().contains("three.png") && !out.join(MANIFEST).exists());
    }
}
