//! A list of photos, as a person or a spreadsheet writes it.

use super::CONTACT_SHEET;
use super::body::KnownBody;
use super::contact_sheet::contact_sheet_page;
use super::entry::PhotoEntry;
use super::files;
use super::manifest::{Manifest, check_each};
use super::review::Review;
use super::spreadsheet::{self, SpreadsheetRow};
use crate::error::{Error, Result};
use crate::io;
use crate::matte::CutOutOptions;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A list of photos: `photos.toml`, or `photos.csv` with the fields of [`PhotoEntry`] for columns,
/// except `captured` and `screen_corners`, which no cell can hold, as spreadsheets write it:
/// separated by commas, semicolons or tabs, with decimal points or commas.
///
/// ```toml
/// [[photos]]
/// file = "IMG_0001.jpg"       # relative to the list
/// asset = "bottle_01"
/// class = "cap"
/// length = 0.265              # metres by a tape measure, and width where it is known
/// # or: px_per_metre = 1966.7, screen_size = [0.60, 0.40], marker_size = 0.05,
/// # captured = { photos = ["IMG_0003.jpg"], display = "display.toml" }
///
/// [[photos]]
/// file = "IMG_0002.jpg"
/// asset = "ring_01"
/// role = "distractor"         # falls and hides others, but has no class and no label
/// matte = "outline"           # opaque everywhere inside its outline
/// length = 0.031
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct List {
    /// Names of the classes in order: a label's number is the place in this list. Default: those
    /// of the photos, in the order in which they appear.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<String>,
    /// How the objects are cut out.
    #[serde(default)]
    pub cut_out: CutOutOptions,
    /// The photos.
    pub photos: Vec<PhotoEntry>,
}

/// Names of the lists that a folder may hold.
const LIST_NAMES: [&str; 2] = ["photos.toml", "photos.csv"];

impl List {
    /// Reads a list: CSV if the file's name says so, else TOML. Thickness and mass that one photo of an
    /// asset gives apply to all of its photos.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read or understood, with its line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let list: Self = match io::has_extension(path, "csv") {
            true => Self::from_csv(path)?,
            false => io::read_toml(path)?,
        };
        let bodies = list.bodies();
        Ok(list.with_bodies(|asset| bodies.get(asset).copied().unwrap_or_default()))
    }

    /// What its photos tell of each asset's body.
    fn bodies(&self) -> BTreeMap<String, KnownBody> {
        let mut bodies = BTreeMap::<_, KnownBody>::new();
        for photo in &self.photos {
            let known = bodies.entry(photo.asset.clone()).or_default();
            *known = known.or(photo.known_body());
        }
        bodies
    }

    /// The same with what is known elsewhere of the bodies of its assets.
    pub(super) fn with_bodies(mut self, known: impl Fn(&str) -> KnownBody) -> Self {
        let photos = self.photos.into_iter().map(|photo| {
            let known = known(&photo.asset);
            photo.with_body(known)
        });
        self.photos = photos.collect();
        self
    }

    fn from_csv(path: &Path) -> Result<Self> {
        let bytes = io::read_bytes(path)?;
        Ok(Self {
            photos: photos_of_csv(&bytes).map_err(|e| e.in_file(path))?,
            ..Self::default()
        })
    }

    /// Checks the list against the manifest of the folder that it is for, and adds its classes to
    /// it.
    ///
    /// # Errors
    /// [`Error::Value`] for the first value that cannot be right, naming the entry.
    #[doc(hidden)]
    pub fn check(&self, manifest: &mut Manifest) -> Result<()> {
        self.cut_out.check().map_err(|e| e.within("cut_out"))?;
        self.add_classes_to(manifest)?;
        if self.photos.is_empty() {
            return Err(Error::value("photos", "empty, expected at least one"));
        }
        check_each(&self.photos, "photos", |photo| photo.check(manifest))?;
        self.check_assets()?;
        check_cut_out_files(&self.photos)
    }

    /// Adds its classes to those of a manifest.
    pub(super) fn add_classes_to(&self, manifest: &mut Manifest) -> Result<()> {
        let classes = self.photos.iter().filter_map(PhotoEntry::label_class);
        manifest.add_classes(&self.classes, classes)
    }

    /// No two photos of an asset tell different things of it.
    fn check_assets(&self) -> Result<()> {
        let (firsts, bodies) = (self.firsts(), self.bodies());
        let class = |photo: &PhotoEntry| Some(format!("\"{}\"", photo.class));
        check_each(&self.photos, "photos", |photo| {
            let first = firsts[photo.asset.as_str()];
            check_same("role", Some(photo.role), Some(first.role))?;
            check_same("class", class(photo), class(first))?;
            let (told, body) = (photo.known_body(), bodies[&photo.asset]);
            check_same("thickness", told.thickness, body.thickness)?;
            check_same("mass", told.mass, body.mass)
        })
    }

    /// The first photo of each asset.
    fn firsts(&self) -> BTreeMap<&str, &PhotoEntry> {
        let photos = self.photos.iter().rev();
        photos.map(|photo| (photo.asset.as_str(), photo)).collect()
    }

    /// Fails for the first picture that does not exist.
    pub(super) fn check_pictures(&self) -> Result<()> {
        let mut pictures = self.photos.iter().flat_map(PhotoEntry::pictures);
        pictures.try_for_each(|path| match path.metadata() {
            Ok(_) => Ok(()),
            Err(e) => Err(Error::file(path, e)),
        })
    }

    /// The same with the paths of a list in `folder` relative to the working folder.
    #[doc(hidden)]
    pub fn located_in(mut self, folder: &Path) -> Self {
        let located = |path: &Path| with_actual_spelling(folder.join(path));
        for photo in &mut self.photos {
            photo.file = located(&photo.file);
            photo.screen.locate(located);
            let captured = photo.captured.take();
            photo.captured = captured.map(|captured| captured.located(|path| located(&path)));
        }
        self
    }
}

/// No two photos become the same file.
///
/// # Errors
/// [`Error::Value`] for the first that would, naming the entry.
pub fn check_cut_out_files(photos: &[PhotoEntry]) -> Result<()> {
    let mut seen = BTreeMap::new();
    for (i, photo) in photos.iter().enumerate() {
        if let Some(first) = seen.insert(photo.cut_out_file(), i) {
            let what = format!(
                "\"{}\", would give the same cut-out file as photos[{first}]",
                photo.file.display()
            );
            return Err(Error::value(format!("photos[{i}].file"), what));
        }
    }
    Ok(())
}

/// No file of an asset folder goes where a picture of these photos lies, under whatever name; their
/// paths are relative to the working folder.
///
/// # Errors
/// [`Error::File`] for the first picture that would be written over.
pub fn check_not_written_over(photos: &[PhotoEntry], folder: &Path) -> Result<()> {
    let cut_outs = photos.iter().map(PhotoEntry::cut_out_file);
    let cut_outs = cut_outs.flat_map(|file| files::all_of(&file));
    let cut_outs = cut_outs.map(|file| folder.join(file));
    // A page shows at least one cut-out; one behind the last is deleted as an earlier build's.
    let sheet = folder.join(CONTACT_SHEET);
    let pages = (0..=photos.len()).map(|page| contact_sheet_page(&sheet, page));
    let pictures = photos.iter().flat_map(PhotoEntry::pictures);
    io::check_distinct(pictures, cut_outs.chain(pages))
}

/// No review that is there is that of two photos; their paths are relative to the working folder.
///
/// # Errors
/// [`Error::Value`] for the second of them, naming the entry.
pub(super) fn check_reviews(photos: &[PhotoEntry]) -> Result<()> {
    let mut seen = BTreeMap::new();
    for (i, photo) in photos.iter().enumerate() {
        let review = Review::path_of(&photo.file);
        let first = *seen.entry(review.clone()).or_insert(&photo.file);
        if *first != photo.file && review.exists() {
            let what = format!(
                "\"{}\", has the same review {} as \"{}\"; rename one of these photos and its review",
                photo.file.display(),
                review.display(),
                first.display()
            );
            return Err(Error::value(format!("photos[{i}].file"), what));
        }
    }
    Ok(())
}

/// Fails where a photo gives another value than the first of its asset.
fn check_same<T: PartialEq + Display>(name: &str, told: Option<T>, first: Option<T>) -> Result<()> {
    match (told, first) {
        (Some(told), Some(first)) if told != first => {
            let what = format!("{told}, but another photo of the asset has {first}");
            Err(Error::value(name, what))
        }
        _ => Ok(()),
    }
}

/// The list itself, or the one in a folder.
pub(super) fn find_list(path: &Path) -> Result<PathBuf> {
    if !path.is_dir() {
        return Ok(path.into());
    }
    let lists = LIST_NAMES.iter().map(|name| path.join(name));
    let what = match &lists.filter(|list| list.exists()).collect::<Vec<_>>()[..] {
        [list] => return Ok(list.clone()),
        [] => "no list of photos, expected photos.toml or photos.csv in it",
        _ => "photos.toml and photos.csv, expected only one of them, or the path of the list",
    };
    Err(Error::file(path, what))
}

fn photos_of_csv(bytes: &[u8]) -> Result<Vec<PhotoEntry>> {
    let rows = spreadsheet::rows(bytes)?;
    rows.into_iter().map(entry_of_row).collect()
}

fn entry_of_row(row: SpreadsheetRow) -> Result<PhotoEntry> {
    io::from_table(row.cells).map_err(|e| spreadsheet::in_line(e, row.line))
}

/// The file of that name, or where there is none the only one in its folder whose name differs just
/// in case and the spelling of `.jpg`.
#[doc(hidden)]
pub fn with_actual_spelling(path: PathBuf) -> PathBuf {
    if path.exists() {
        return path;
    }
    let mut alike =
        files_beside(&path).filter(|other| normalized_name(other) == normalized_name(&path));
    match (alike.next(), alike.next()) {
        (Some(only), None) => only,
        _ => path,
    }
}

/// What is in a file's folder; nothing where that cannot be read.
fn files_beside(path: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    // The empty path is the working folder.
    let entries = Path::new(".").join(&folder).read_dir().ok();
    let entries = entries.into_iter().flatten().flatten();
    entries.map(move |entry| folder.join(entry.file_name()))
}

/// A file's name in small letters, with the short endings of pictures.
fn normalized_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    let name = name.to_string_lossy().to_lowercase();
    let short = [(".jpeg", ".jpg"), (".tiff", ".tif")]
        .into_iter()
        .find_map(|(long, short)| Some(name.strip_suffix(long)?.to_owned() + short));
    short.unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::super::screen_source::ScreenSource;
    use super::*;

    #[test]
    fn a_photo_is_found_by_its_name_in_capitals_and_by_either_spelling_of_jpeg() {
        let folder = tempfile::tempdir().unwrap();
        for (there, asked) in [("a.jpeg", "a.jpg"), ("B.JPG", "b.jpeg"), ("c.jpg", "c.jpg")] {
            std::fs::write(folder.path().join(there), "").unwrap();
            assert_eq!(
                with_actual_spelling(folder.path().join(asked)),
                folder.path().join(there)
            );
        }
        // Two that might be meant are none.
        std::fs::write(folder.path().join("A.jpeg"), "").unwrap();
        assert_eq!(
            with_actual_spelling(folder.path().join("a.jpg")),
            folder.path().join("a.jpg")
        );
    }

    #[test]
    fn a_distractor_of_a_list_has_no_class_in_either_form() {
        let folder = tempfile::tempdir().unwrap();
        let csv = "file,asset,role,class,length\na.png,a,,cap,0.2\nb.png,b,distractor,,0.03\n";
        let toml = "[[photos]]\nfile = \"a.png\"\nasset = \"a\"\nclass = \"cap\"\nlength = 0.2\n\
                    [[photos]]\nfile = \"b.png\"\nasset = \"b\"\nrole = \"distractor\"\nlength = 0.03\n";
        for (name, text) in [("photos.csv", csv), ("photos.toml", toml)] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let mut list = List::read(&path).unwrap();
            let mut manifest = Manifest::default();
            list.check(&mut manifest).unwrap();
            assert_eq!(manifest.classes, ["cap"], "{name}");
            list.photos[0].class.clear();
            let told = list.check(&mut manifest).unwrap_err().to_string();
            let expected = "photos[0].class: missing, expected its name, or role = \"distractor\"";
            assert_eq!(told, expected);
        }
    }

    #[test]
    fn photos_of_one_asset_share_what_one_of_them_tells_of_its_body() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photos.csv");
        let listed = |rows: &str| {
            let header = "file,asset,class,length,thickness,mass\n";
            std::fs::write(&path, format!("{header}{rows}")).unwrap();
            List::read(&path).unwrap()
        };
        let list = listed("1.png,a,c,0.2,,\n2.png,b,c,0.2,,\n3.png,a,c,0.2,0.06,0.04\n");
        let told = list
            .photos
            .iter()
            .map(|photo| (photo.thickness, photo.mass));
        let a = (Some(0.06), Some(0.04));
        assert_eq!(told.collect::<Vec<_>>(), [a, (None, None), a]);
        let list = listed("1.png,a,c,0.2,0.06,0.04\n2.png,a,c,0.2,,0.03\n");
        let refusal = list.check(&mut Manifest::default()).unwrap_err();
        let expected = "photos[1].mass: 0.03, but another photo of the asset has 0.04";
        assert_eq!(refusal.to_string(), expected);
    }

    #[test]
    fn photos_of_one_name_do_not_share_a_review() {
        let folder = tempfile::tempdir().unwrap();
        let text = "[[photos]]\nfile = \"one.png\"\nasset = \"a\"\nclass = \"c\"\nlength = 0.2\n\
                    [[photos]]\nfile = \"one.jpg\"\nasset = \"b\"\nclass = \"c\"\nlength = 0.2\n";
        let list: List = toml::from_str(text).unwrap();
        let photos = list.located_in(folder.path()).photos;
        check_reviews(&photos).unwrap();
        std::fs::write(folder.path().join("one.review.json"), "").unwrap();
        let told = check_reviews(&photos).unwrap_err().to_string();
        let names = ["photos[1].file", "one.png", "one.jpg", "one.review.json"];
        assert!(names.iter().all(|name| told.contains(name)), "{told}");
    }

    #[test]
    fn pictures_are_never_where_a_cut_out_or_the_contact_sheet_goes() {
        let folder = tempfile::tempdir().unwrap();
        let place = |file: &str| folder.path().join(file);
        std::fs::create_dir(place("cup")).unwrap();
        let told = |photo: &str, screen: &str| {
            std::fs::write(place(photo), "").unwrap();
            let scale = super::super::Scale::Length(0.2);
            let entry = PhotoEntry {
                screen: ScreenSource::Photo(place(screen)),
                ..PhotoEntry::new(place(photo), "cup", "cup", scale)
            };
            // The same folder by another name.
            check_not_written_over(&[entry], &place("cup/.."))
        };
        for (photo, screen) in [
            ("cup/1.png", "none.png"),
            ("cup/1.exr", "none.png"),
            ("contact_sheet.png", "none.png"),
            ("contact_sheet_2.png", "none.png"),
            ("1.jpg", "cup/1.png"),
        ] {
            let told = told(photo, screen).unwrap_err().to_string();
            assert!(
                told.contains("is an input and would be overwritten"),
                "{told}"
            );
        }
        told("cup/2.jpg", "cup/1.png").unwrap();
    }

    #[test]
    fn a_screen_is_found_in_another_spelling_as_a_photo_is() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("Empty.JPEG"), "").unwrap();
        let text = "[[photos]]\nfile = \"a.png\"\nasset = \"a\"\nclass = \"c\"\nlength = 0.2\n\
                    screen = \"empty.jpg\"\n";
        let list: List = toml::from_str(text).unwrap();
        let screen = &list.located_in(folder.path()).photos[0].screen;
        let found = folder.path().join("Empty.JPEG");
        assert_eq!(screen, &ScreenSource::Photo(found));
    }

    #[test]
    fn paths_begin_at_the_list() {
        let text = "[[photos]]\nfile = \"a.png\"\nasset = \"a\"\nclass = \"c\"\nlength = 0.2\n\
                    screen = \"empty.png\"\n";
        let list: List = toml::from_str(text).unwrap();
        let [photo] = &list.located_in(Path::new("there")).photos[..] else {
            panic!("one photo")
        };
        let expected = ScreenSource::Photo(Path::new("there").join("empty.png"));
        assert_eq!(
            (photo.file.as_path(), &photo.screen),
            (Path::new("there").join("a.png").as_path(), &expected)
        );
    }
}
