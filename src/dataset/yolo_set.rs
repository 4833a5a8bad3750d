//! A YOLO dataset on disk, petcomp's or the user's own: which images, which classes; and selections
//! of its images, as lists that trainers read, without copies.

use crate::dataset::Part;
use crate::dataset::listing::{images_in, is_list, place_of, whole_path};
use crate::dataset::yolo_yaml::DataYaml;
use crate::error::{Error, Result};
use crate::eval::{is_image, label_of};
use crate::io;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Images and classes of a YOLO dataset; all paths are absolute.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct YoloSet {
    /// Names of the classes, in order.
    pub classes: Vec<String>,
    /// Images for training, in natural order of path or as listed.
    pub train: Vec<PathBuf>,
    /// Images for validation, to choose the best model by.
    pub val: Vec<PathBuf>,
    /// Folders and lists of test images, as they are named; often none.
    pub test: Vec<PathBuf>,
}

impl YoloSet {
    /// Reads what `FOLDER/data.yaml` names: folders of images, or text files that list them, one
    /// per line, relative to the list; all relative to its `path:`, which is relative to the
    /// folder.
    ///
    /// In a set that is still to be split, a part may be empty, and both parts may be the same.
    ///
    /// # Errors
    /// [`Error::File`] for a `data.yaml` that is missing or that trainers would reject, or a folder
    /// or list that cannot be read.
    pub fn read(folder: &Path) -> Result<Self> {
        let folder = whole_path(folder)?;
        let yaml = read_yaml(&folder)?;
        let root = yaml.root(&folder);
        let [train, val] = Part::ALL.map(|part| images_of(&root, yaml.folders(part)));
        let test = yaml.test.iter().map(|place| place_of(&root, place));
        Ok(Self {
            classes: yaml.names,
            train: train?,
            val: val?,
            test: test.collect(),
        })
    }

    /// The files that select the images of a set: `data.yaml` and the lists that it names.
    ///
    /// # Errors
    /// [`Error::File`] for a `data.yaml` that is missing or that trainers would reject.
    pub fn choosing_files(folder: &Path) -> Result<Vec<PathBuf>> {
        let folder = whole_path(folder)?;
        let yaml = read_yaml(&folder)?;
        let root = yaml.root(&folder);
        let parts = Part::ALL.map(|part| yaml.folders(part));
        let places = parts.into_iter().flatten().chain(&yaml.test);
        let places = places.map(|place| place_of(&root, place));
        let lists = places.filter(|place| is_list(place));
        Ok(lists.chain([folder.join("data.yaml")]).collect())
    }

    /// As [`YoloSet::read`], for training: both parts must have images.
    ///
    /// # Errors
    /// Those of [`YoloSet::read`], and [`Error::File`] for a part without images.
    pub fn open(folder: &Path) -> Result<Self> {
        let set = Self::read(folder)?;
        if let Some(part) = Part::ALL.into_iter().find(|&p| set.part(p).is_empty()) {
            let what = format!("{}: no images, expected at least one", part.name());
            return Err(Error::file(folder.join("data.yaml"), what));
        }
        Ok(set)
    }

    /// Names of the classes of the set that a folder of labels (`labels/val`, `labels`) belongs to,
    /// from the `data.yaml` above it, whatever images exist; none without a `data.yaml`.
    ///
    /// # Errors
    /// [`Error::File`] for a `data.yaml` that cannot be read or does not name the classes.
    pub fn class_names_of(labels: &Path) -> Result<Vec<String>> {
        let Some(path) = yaml_above(labels)? else {
            return Ok(Vec::new());
        };
        let names = DataYaml::read_names(&io::read_text(&path)?);
        names.map_err(|(line, what)| yaml_problem(&path, line, &what))
    }

    /// How many numbers of keypoints follow the box in the labels of a folder (`labels/val`,
    /// `labels`), according to a `data.yaml` above it; 0 without its `kpt_shape`.
    ///
    /// # Errors
    /// [`Error::File`] for an invalid `kpt_shape`.
    pub fn keypoint_numbers_of(labels: &Path) -> Result<usize> {
        let Some(path) = yaml_above(labels)? else {
            return Ok(0);
        };
        let text = io::read_text(&path).unwrap_or_default();
        let numbers = DataYaml::read_keypoint_numbers(&text);
        numbers.map_err(|(line, what)| yaml_problem(&path, line, &what))
    }

    fn part(&self, part: Part) -> &[PathBuf] {
        match part {
            Part::Train => &self.train,
            Part::Val => &self.val,
        }
    }

    /// The same set with other images for training and validation.
    pub(super) fn with_parts(&self, [train, val]: [Vec<PathBuf>; 2]) -> Self {
        Self {
            classes: self.classes.clone(),
            train,
            val,
            test: self.test.clone(),
        }
    }

    /// All images in natural order of name (`frame2` before `frame10`), each once: the series in
    /// the order it was taken.
    pub fn series(&self) -> Vec<PathBuf> {
        let mut all = [&self.train[..], &self.val[..]].concat();
        all.sort_by(|a, b| compare_names(a, b));
        all.dedup();
        all
    }

    /// The first part of the images for training and the first part of those for validation, each
    /// rounded down, as the paper takes 25 % of its photos "from the beginning".
    ///
    /// # Errors
    /// A share that is not in `0..=1`.
    pub fn head(&self, share: f64) -> Result<Self> {
        if !(0.0..=1.0).contains(&share) {
            let what = format!("{share}, expected a share, 0 to 1");
            return Err(Error::value("head", what));
        }
        Ok(self.with_parts([&self.train, &self.val].map(|images| first_share(images, share))))
    }

    /// The files of a set, or of a folder of images with labels, that `output` may coincide with:
    /// those that select the images, and images and labels of the same name; none if `output` does
    /// not exist.
    ///
    /// # Errors
    /// Those of [`YoloSet::read`]; [`Error::File`] for a folder that cannot be listed.
    pub fn files_like(folder: &Path, output: &Path) -> Result<Vec<PathBuf>> {
        // A file that does not exist yet is none of theirs, of which there may be very many.
        let Ok(real) = output.canonicalize() else {
            return Ok(Vec::new());
        };
        let (mut files, images) = match folder.join("data.yaml").is_file() {
            true => (Self::choosing_files(folder)?, Self::read(folder)?.series()),
            false => (Vec::new(), io::files_below(folder, is_image, usize::MAX)?),
        };
        let theirs = images.into_iter().flat_map(with_labels);
        files.extend(theirs.filter(|file| file.file_name() == real.file_name()));
        Ok(files)
    }

    /// Writes `train.txt`, `val.txt` and `data.yaml`; paths below the folder are relative to it.
    ///
    /// # Errors
    /// If a file cannot be written; before any is written, for an image whose name is not UTF-8.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let whole = whole_path(folder)?;
        let [train, val] = Part::ALL.map(|part| list_of(self.part(part), &whole));
        let lists = [train?, val?];
        let test = self.test_places(&whole)?;
        io::create_folder(folder)?;
        for (part, list) in Part::ALL.into_iter().zip(&lists) {
            io::write_text(whole.join(part.name()).with_extension("txt"), list)?;
        }
        let yaml = DataYaml::write_with(&self.classes, &test, |part| format!("{part}.txt"));
        io::write_text(whole.join("data.yaml"), &yaml)
    }

    /// The test images as a `data.yaml` in the folder names them.
    fn test_places(&self, folder: &Path) -> Result<Vec<String>> {
        let places = self.test.iter();
        places
            .map(|place| place.strip_prefix(folder).unwrap_or(place))
            .map(|place| io::path_text(place).map(str::to_owned))
            .collect()
    }
}

/// An image and where its label may be: in the folder of labels, or next to it.
fn with_labels(image: PathBuf) -> [PathBuf; 3] {
    [label_of(&image), image.with_extension("txt"), image]
}

/// The `data.yaml` of the set that a folder of labels belongs to, if there is one.
fn yaml_above(labels: &Path) -> Result<Option<PathBuf>> {
    let labels = whole_path(labels)?;
    let above = labels.ancestors().skip(1).take(2);
    let mut paths = above.map(|folder| folder.join("data.yaml"));
    Ok(paths.find(|path| path.is_file()))
}

/// The `data.yaml` of a folder, as trainers would read it.
fn read_yaml(folder: &Path) -> Result<DataYaml> {
    let path = folder.join("data.yaml");
    let (yaml, problems) = DataYaml::read(&io::read_text(&path)?);
    match problems.into_iter().next() {
        Some((line, what)) => Err(yaml_problem(&path, line, &what)),
        None => Ok(yaml),
    }
}

/// The images of the folders or lists of a part.
fn images_of(root: &Path, parts: &[String]) -> Result<Vec<PathBuf>> {
    let images: Vec<_> = parts
        .iter()
        .map(|part| images_in(&place_of(root, part)))
        .collect::<Result<_>>()?;
    Ok(images.concat())
}

fn yaml_problem(path: &Path, line: Option<usize>, what: &str) -> Error {
    let line = line.map(|n| format!("line {n}: ")).unwrap_or_default();
    Error::file(path, format!("{line}{what}"))
}

/// By the file's name in natural order, then by its letters, then by its whole path.
fn compare_names(a: &Path, b: &Path) -> Ordering {
    let [key_a, key_b] = [a, b].map(|path| io::natural_key(path.file_name().unwrap_or_default()));
    let natural = key_a.cmp(key_b);
    natural.then_with(|| (a.file_name(), a).cmp(&(b.file_name(), b)))
}

fn first_share(images: &[PathBuf], share: f64) -> Vec<PathBuf> {
    images[..whole_share(images.len(), share)].to_vec()
}

/// This share of a count, rounded down; a product that is whole except for rounding errors of the
/// ratio stays whole.
pub(super) fn whole_share(count: usize, ratio: f64) -> usize {
    (count as f64 * ratio + 1e-9) as usize
}

/// Images as lines of a list.
fn list_of(images: &[PathBuf], folder: &Path) -> Result<String> {
    let lines = images.iter().map(|path| list_line(path, folder));
    lines.collect()
}

/// Trainers replace `./` by the list's folder, older ones every `./` in a line, even that of `../`:
/// so images elsewhere have an absolute path.
fn list_line(image: &Path, folder: &Path) -> Result<String> {
    Ok(match image.strip_prefix(folder) {
        Ok(below) => format!("./{}\n", io::path_text(below)?),
        Err(_) => format!("{}\n", io::path_text(image)?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(yaml: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for part in ["images/train/cam0", "images/val"] {
            std::fs::create_dir_all(folder.path().join(part)).unwrap();
        }
        for image in [
            "images/train/b.png",
            "images/train/a.jpg",
            "images/train/note.md",
            "images/train/cam0/b.webp",
            "images/val/c.png",
        ] {
            std::fs::write(folder.path().join(image), "").unwrap();
        }
        std::fs::write(folder.path().join("some.txt"), "./images/val/c.png\n\n").unwrap();
        std::fs::write(folder.path().join("data.yaml"), yaml).unwrap();
        folder
    }

    #[test]
    fn folders_and_lists_of_images_are_read() {
        let set = folder("train: images/train\nval: some.txt\nnames: [cap]\n");
        let read = YoloSet::open(set.path()).unwrap();
        assert_eq!(
            read.train,
            ["a.jpg", "b.png", "cam0/b.webp"].map(|p| set.path().join("images/train").join(p))
        );
        assert_eq!(
            (read.val, read.classes),
            (
                vec![set.path().join("images/val/c.png")],
                vec!["cap".into()]
            )
        );
    }

    #[test]
    fn a_part_without_images_is_named() {
        let set = folder("path: images\ntrain: train\nval: nowhere\nnames: [cap]\n");
        let said = YoloSet::open(set.path()).unwrap_err().to_string();
        assert!(said.contains("nowhere"), "{said}");
    }

    #[test]
    fn what_trainers_would_not_take_is_refused() {
        for (yaml, expected) in [
            (
                "train: images/train\nvalid: images/val\nnames: [cap]\n",
                "no val:",
            ),
            (
                "train: images/train\nval: images/val\nnc: 2\nnames: [cap]\n",
                "nc: 2, but",
            ),
            (
                "train: images/train\nval: images/val\nnames: [cap]\nkpt_shape: [4, 3]\n",
                "line 4: kpt_shape: labels with keypoints, expected boxes",
            ),
            ("path: [", "not YAML"),
        ] {
            let told = YoloSet::read(folder(yaml).path()).unwrap_err().to_string();
            assert!(told.contains(expected), "{told}");
        }
    }

    #[test]
    fn labels_have_the_names_of_their_set_whatever_images_there_are() {
        let set = folder("train: nowhere\nval: images/val\nnames: [cap]\n");
        let names = |labels| YoloSet::class_names_of(&set.path().join(labels));
        assert_eq!(names("labels/val").unwrap(), ["cap"]);
        assert_eq!(names("labels").unwrap(), ["cap"]);
        assert!(names("a/labels/val").unwrap().is_empty());
        let keypoints = || YoloSet::keypoint_numbers_of(&set.path().join("labels/val"));
        assert_eq!(keypoints().unwrap(), 0);
        std::fs::write(set.path().join("data.yaml"), "kpt_shape: [4, 3]\n").unwrap();
        assert_eq!(keypoints().unwrap(), 12);
        std::fs::write(set.path().join("data.yaml"), "nc: 2\nnames: [cap]\n").unwrap();
        let told = names("labels").unwrap_err().to_string();
        assert!(
            told.ends_with("data.yaml: nc: 2, but there are 1 names"),
            "{told}"
        );
    }

    #[test]
    fn a_folder_that_is_not_beside_the_set_is_one_of_it() {
        let set = folder("train: ../images/train\nval: ../images/val\nnames: [cap]\n");
        let read = YoloSet::open(set.path()).unwrap();
        assert_eq!((read.train.len(), read.val.len()), (3, 1));
    }

    #[test]
    fn images_of_both_parts_are_in_the_series_once() {
        let set = folder("train: images/train\nval: images/train\nnames: [cap]\n");
        let read = YoloSet::read(set.path()).unwrap();
        assert_eq!((read.train.len(), &read.val), (3, &read.train));
        assert_eq!(read.series().len(), 3);
    }

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let names = [
            "frame_2.png",
            "frame1.png",
            "frame01.png",
            "frame2.png",
            "frame2a.png",
            "frame10.png",
            "frame10_2.png",
            "frame10_10.png",
            "frame99999999999999999999999.png",
            "9.png",
            "10.png",
            "a.png",
        ];
        let mut sorted = names.map(PathBuf::from);
        sorted.sort_by(|a, b| compare_names(a, b));
        let expected = [
            "9.png",
            "10.png",
            "a.png",
            "frame01.png",
            "frame1.png",
            "frame2.png",
            "frame2a.png",
            "frame10.png",
            "frame10_2.png",
            "frame10_10.png",
            "frame99999999999999999999999.png",
            "frame_2.png",
        ];
        assert_eq!(sorted, expected.map(PathBuf::from));
    }

    #[test]
    fn what_to_test_with_goes_along() {
        let yaml = "path: images\ntrain: train\nval: val\ntest: [val, ../some.txt]\nnames: [cap]\n";
        let set = folder(yaml);
        let half = YoloSet::read(set.path()).unwrap().head(0.5).unwrap();
        let places = ["images/val", "some.txt"].map(|place| set.path().join(place));
        for folder in ["half", "."] {
            half.write(&set.path().join(folder)).unwrap();
            let read = YoloSet::read(&set.path().join(folder)).unwrap();
            assert_eq!(read.test, places);
        }
        let own = std::fs::read_to_string(set.path().join("data.yaml")).unwrap();
        let line = r#"test: ["images/val","some.txt"]"#;
        assert!(own.lines().any(|own| own == line), "{own}");
    }

    #[test]
    #[cfg(unix)]
    fn an_image_that_no_list_can_name_is_refused_before_anything_is_written() {
        use std::os::unix::ffi::OsStrExt;
        let out = tempfile::tempdir().unwrap();
        let odd = PathBuf::from(std::ffi::OsStr::from_bytes(b"/photos/\xff.png"));
        let places = [
            ("train", [1, 0, 0]),
            ("val", [0, 1, 0]),
            ("test", [0, 0, 1]),
        ];
        for (name, [train, val, test]) in places {
            let set = YoloSet {
                classes: vec!["cap".into()],
                train: vec![odd.clone(); train],
                val: vec![odd.clone(); val],
                test: vec![odd.clone(); test],
            };
            let told = set.write(&out.path().join(name)).unwrap_err().to_string();
            assert!(
                told.ends_with("a name that is not UTF-8, expected one that is"),
                "{told}"
            );
            assert!(!out.path().join(name).exists());
        }
    }

    #[test]
    fn a_file_that_is_there_may_be_one_of_the_sets() {
        let set = folder("train: images/train\nval: some.txt\nnames: [cap]\n");
        let like = |of: &str, file: &str| {
            let file = set.path().join(file);
            let files = YoloSet::files_like(&set.path().join(of), &file).unwrap();
            files.contains(&file)
        };
        for file in ["data.yaml", "some.txt", "images/train/b.png"] {
            assert!(like(".", file), "{file}");
        }
        for file in ["images/val/c.txt", "page.html"] {
            std::fs::write(set.path().join(file), "").unwrap();
        }
        // No data.yaml is there: all images below the folder, with labels beside them.
        for file in ["images/val/c.png", "images/val/c.txt"] {
            assert!(like("images", file), "{file}");
        }
        assert!(!like(".", "page.html") && !like(".", "nowhere.txt"));
    }

    #[test]
    fn the_last_images_of_a_path_becomes_labels() {
        let label = label_of(Path::new("/images/set/images/train/a.b.png"));
        assert_eq!(label, Path::new("/images/set/labels/train/a.b.txt"));
    }
}
