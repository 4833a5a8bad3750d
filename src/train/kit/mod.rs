//! Files to run the paper's experiments in YOLOv5 and Ultralytics.

use super::{Balance, Updates, batches_per_epoch};
use crate::dataset::{YoloSet, yaml_names};
use crate::error::{Error, Result};
use crate::io;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Equation 2 for PyTorch.
const BALANCED_PY: &str = include_str!("balanced.py");
/// The paper's settings where it gives them, YOLOv5's defaults elsewhere.
const HYP_YAML: &str = include_str!("hyp.yaml");

/// Options of the kit.
#[derive(Clone, Debug, PartialEq)]
pub struct KitOptions {
    /// Folder of the YOLO dataset of photographs.
    pub real: PathBuf,
    /// Folder of the YOLO dataset that petcomp generated.
    pub synthetic: PathBuf,
    /// Weights of the two in the combined training.
    pub balance: Balance,
    /// Trainings per variant. Default: 6, the paper's.
    pub seeds: u64,
    /// Epochs. Default: 300, the paper's.
    pub epochs: u64,
    /// Images per batch. Default: 32, the paper's.
    pub batch: u64,
}

impl KitOptions {
    /// Options for two datasets with the paper's numbers.
    pub fn new(real: impl Into<PathBuf>, synthetic: impl Into<PathBuf>) -> Self {
        let (real, synthetic) = (real.into(), synthetic.into());
        Self {
            real,
            synthetic,
            balance: Balance::default(),
            seeds: 6,
            epochs: 300,
            batch: 32,
        }
    }
}

/// A training that the paper compares: the images to train on and those that select the best epoch.
struct Variant {
    name: &'static str,
    train: &'static [&'static str],
    val: &'static [&'static str],
}

/// The paper has two forms of concatenation; `balanced.py` trains `combined` by equation 2.
const VARIANTS: [Variant; 5] = [
    Variant {
        name: "real",
        train: &["real_train"],
        val: &["real_val"],
    },
    Variant {
        name: "synthetic",
        train: &["synthetic_train"],
        val: &["synthetic_val"],
    },
    Variant {
        name: "concatenated",
        train: &["real_train", "synthetic_train"],
        val: &["real_val"],
    },
    Variant {
        name: "concatenated_val_both",
        train: &["real_train", "synthetic_train"],
        val: &["real_val", "synthetic_val"],
    },
    Variant {
        name: "combined",
        train: &["real_train", "synthetic_train"],
        val: &["real_val"],
    },
];

/// Writes the kit: lists of images, a `VARIANT.yaml` for each variant, `hyp.yaml`, `balance.json`,
/// `balanced.py`, `commands.sh`.
///
/// Lists and `path:` contain absolute paths, since YOLOv5 resolves relative ones from the folder of
/// its clone. So the kit may be written anywhere, but afterwards neither it nor the datasets may
/// move. Without synthetic images for validation, the variants that need some are left out, and
/// `commands.sh` lists them.
///
/// # Errors
/// Those of [`YoloSet::open`] and [`Balance::weights`]; [`Error::Value`] if the two datasets have
/// different classes or share a training image; [`Error::File`] for an image, or a folder for the
/// kit, whose name is not UTF-8.
pub fn write(folder: &Path, options: &KitOptions) -> Result<()> {
    let [real, synthetic] = open_sets(options)?;
    let counts = [real.train.len() as u64, synthetic.train.len() as u64];
    let balance = balance_document(&options.balance, counts)?;
    let (variants, left_out) = VARIANTS
        .iter()
        .partition::<Vec<_>, _>(|variant| variant.has_validation(&synthetic));
    write_data(folder, [&real, &synthetic], &variants)?;
    io::write_json(folder.join("balance.json"), &balance)?;
    let commands = commands_head(options, counts) + &without_validation(&left_out);
    write_scripts(folder, &(commands + &training_commands(options, &variants)))
}

/// Opens the real and the synthetic dataset and checks that they fit together.
fn open_sets(options: &KitOptions) -> Result<[YoloSet; 2]> {
    let real = YoloSet::open(&whole_folder(&options.real)?)?;
    let synthetic = open_for_training(&whole_folder(&options.synthetic)?)?;
    check_sets([&real, &synthetic], [&options.real, &options.synthetic])?;
    warn_of_known_validation([&real, &synthetic], &options.real);
    Ok([real, synthetic])
}

/// Creates the folder and writes the lists of images and the file of each variant.
fn write_data(
    folder: &Path,
    [real, synthetic]: [&YoloSet; 2],
    variants: &[&Variant],
) -> Result<()> {
    let whole = io::absolute(folder)?;
    let (place, lists) = (io::path_text(&whole)?, lists_of(real, synthetic)?);
    io::create_folder(folder)?;
    for (name, list) in lists {
        io::write_text(folder.join(format!("{name}.txt")), &list)?;
    }
    for variant in variants {
        let path = folder.join(format!("{}.yaml", variant.name));
        io::write_text(path, &variant.to_yaml(place, &real.classes))?;
    }
    Ok(())
}

fn write_scripts(folder: &Path, commands: &str) -> Result<()> {
    io::write_text(folder.join("hyp.yaml"), HYP_YAML)?;
    io::write_text(folder.join("balanced.py"), BALANCED_PY)?;
    io::write_text(folder.join("commands.sh"), commands)
}

fn balance_document(balance: &Balance, [real, synthetic]: [u64; 2]) -> Result<serde_json::Value> {
    Ok(serde_json::json!({
        "alpha": balance.alpha, "normalize": balance.normalize,
        "images": { "real": real, "synthetic": synthetic },
        "weights": balance.weights(real, synthetic)?,
    }))
}

/// The lists of images of each part of both datasets, with their names.
fn lists_of(real: &YoloSet, synthetic: &YoloSet) -> Result<Vec<(&'static str, String)>> {
    let parts = [
        ("real_train", &real.train),
        ("real_val", &real.val),
        ("synthetic_train", &synthetic.train),
        ("synthetic_val", &synthetic.val),
    ];
    let lists = parts.into_iter();
    lists
        .map(|(name, images)| Ok((name, list_of(images)?)))
        .collect()
}

/// Fails if the datasets in two folders cannot be used together: they have different classes or share
/// a training image.
///
/// # Errors
/// [`Error::Value`] with both lists of classes, or with the image.
#[doc(hidden)]
pub fn check_sets(sets: [&YoloSet; 2], folders: [&Path; 2]) -> Result<()> {
    check_classes(sets, folders)?;
    let [real, synthetic] = sets.map(|set| &set.train);
    let Some(image) = shared_images(real, synthetic).next() else {
        return Ok(());
    };
    let (image, real_folder) = (image.display(), folders[0].display());
    let what =
        format!("{image} is also a real image, expected images that are not in {real_folder}");
    Err(Error::value("synthetic", what))
}

fn check_classes([real, synthetic]: [&YoloSet; 2], folders: [&Path; 2]) -> Result<()> {
    if real.classes == synthetic.classes {
        return Ok(());
    }
    let [real_folder, folder] = folders.map(Path::display);
    let (found, expected) = (&synthetic.classes, &real.classes);
    let what = format!("{found:?} in {folder}, expected {expected:?} as in {real_folder}");
    Err(Error::value("classes", what))
}

/// Warns of real images that select the best epoch although some variant is trained on them.
fn warn_of_known_validation([real, synthetic]: [&YoloSet; 2], folder: &Path) {
    let trained = [&real.train[..], &synthetic.train[..]].concat();
    let known = shared_images(&trained, &real.val).count();
    if known > 0 {
        log::warn!(
            "{}: {known} of {} images for validation are also used for training; see `dataset split`",
            folder.display(),
            real.val.len()
        );
    }
}

/// The images of a list that are also in another one, even under different names.
fn shared_images<'a>(
    others: &[PathBuf],
    images: &'a [PathBuf],
) -> impl Iterator<Item = &'a PathBuf> + use<'a> {
    let known: BTreeSet<PathBuf> = others.iter().map(|image| io::real_path(image)).collect();
    images
        .iter()
        .filter(move |image| known.contains(&io::real_path(image)))
}

fn list_of(images: &[PathBuf]) -> Result<String> {
    let lines = images.iter();
    lines
        .map(|path| Ok(format!("{}\n", io::path_text(path)?)))
        .collect()
}

fn whole_folder(folder: &Path) -> Result<PathBuf> {
    std::fs::canonicalize(folder).map_err(|e| Error::file(folder, e))
}

/// Opens a training set, which may have no images for validation.
///
/// # Errors
/// Those of [`YoloSet::read`], and [`Error::File`] if there are no training images.
#[doc(hidden)]
pub fn open_for_training(folder: &Path) -> Result<YoloSet> {
    let set = YoloSet::read(folder)?;
    if set.train.is_empty() {
        let what = "train: no images, expected at least one";
        return Err(Error::file(folder.join("data.yaml"), what));
    }
    Ok(set)
}

impl Variant {
    /// Whether there are images to select the best epoch; a synthetic dataset may have none.
    fn has_validation(&self, synthetic: &YoloSet) -> bool {
        !synthetic.val.is_empty() || !self.val.contains(&"synthetic_val")
    }

    /// Writes the kit's folder as a JSON string, which is also a YAML string.
    fn to_yaml(&self, folder: &str, classes: &[String]) -> String {
        let path = serde_json::json!(folder);
        let (count, train, val) = (classes.len(), yaml_list(self.train), yaml_list(self.val));
        let names = yaml_names(classes);
        format!(
            "# `path` is this folder.\npath: {path}\ntrain:\n{train}val:\n{val}nc: {count}\nnames:\n{names}"
        )
    }
}

/// The commands of all trainings.
fn training_commands(options: &KitOptions, variants: &[&Variant]) -> String {
    let KitOptions {
        seeds,
        epochs,
        batch,
        ..
    } = options;
    let trainings = variants.iter().map(|Variant { name, .. }| {
        format!(
            "\n# {name}\nfor seed in $(seq 1 {seeds}); do\n  python balanced.py --data {name}.yaml --epochs {epochs} \
             --batch {batch} --seed \"$seed\" --name \"{name}/$seed\"\ndone\n"
        )
    });
    trainings.collect()
}

/// What the trainings need, and how many epochs of each source alone make as many updates.
fn commands_head(options: &KitOptions, [real, synthetic]: [u64; 2]) -> String {
    let combined = Updates::new(real + synthetic, options.batch, options.epochs);
    let [real, synthetic] = [real, synthetic]
        .map(|images| combined.epochs_of(batches_per_epoch(images, options.batch)));
    let Updates { batches, total, .. } = combined;
    format!(
        "#!/bin/sh\n# Run in this folder, with Ultralytics installed for Python. All variants train the same detector, so that they\n\
         # can be compared; combined weights its loss by equation 2.\n\
         # YOLOv5's own train.py accepts the same files and hyp.yaml, but its results are not comparable with these.\n\
         # One epoch over both sources: {batches} batches; {total} updates in all. The same number of updates takes {synthetic:.1} epochs\n\
         # of the synthetic images alone and {real:.1} of the real ones.\nset -eu\n"
    )
}

/// The variants that lack images.
fn without_validation(left_out: &[&Variant]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    let names: Vec<_> = left_out.iter().map(|variant| variant.name).collect();
    let names = names.join(", ");
    format!("# Omitted, as no synthetic image is for validation: {names}.\n")
}

fn yaml_list(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("  - {name}.txt\n"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, LinearRgb};

    fn dataset(root: &Path, name: &str, [train, val]: [usize; 2], names: &str) -> PathBuf {
        let folder = root.join(name);
        for (part, count) in [("train", train), ("val", val)] {
            io::create_folder(folder.join("images").join(part)).unwrap();
            for i in 0..count {
                let path = folder.join("images").join(part).join(format!("{i}.png"));
                io::write(path, &Image::filled(16, 16, LinearRgb::WHITE)).unwrap();
            }
        }
        io::write_text(
            folder.join("data.yaml"),
            &format!("train: images/train\nval: images/val\nnames: {names}\n"),
        )
        .unwrap();
        folder
    }

    /// A kit with two real images and six synthetic ones.
    fn written(root: &Path, name: &str) -> PathBuf {
        let [real, synthetic] =
            [("real", 2), ("made", 6)].map(|(name, n)| dataset(root, name, [n, 1], "[cap]"));
        let kit = root.join(name);
        write(&kit, &KitOptions::new(real, synthetic)).unwrap();
        kit
    }

    #[test]
    fn a_kit_has_every_variant_list_and_seed() {
        let root = tempfile::tempdir().unwrap();
        let kit = written(root.path(), "kit");
        for variant in &VARIANTS {
            let text = io::read_text(kit.join(format!("{}.yaml", variant.name))).unwrap();
            for list in variant.train {
                assert!(text.contains(&format!("  - {list}.txt")), "{text}");
            }
        }
        let list = io::read_text(kit.join("synthetic_train.txt")).unwrap();
        assert_eq!(list.lines().count(), 6);
        let balance: serde_json::Value = io::read_json(kit.join("balance.json")).unwrap();
        assert_eq!(
            balance["weights"],
            serde_json::json!({ "real": 1.0, "synthetic": 8.0 / 12.0 * 0.5 })
        );
        let commands = io::read_text(kit.join("commands.sh")).unwrap();
        assert_eq!(commands.matches("seq 1 6").count(), VARIANTS.len());
        // One program, and so one detector, trains all variants, which are compared with each other.
        let trained = |name| commands.contains(&format!("python balanced.py --data {name}.yaml "));
        assert!(
            VARIANTS.iter().all(|variant| trained(variant.name)),
            "{commands}"
        );
    }

    #[test]
    fn a_synthetic_dataset_may_be_for_training_alone() {
        let root = tempfile::tempdir().unwrap();
        let real = dataset(root.path(), "real", [2, 1], "[cap]");
        let made = dataset(root.path(), "made", [6, 0], "[cap]");
        let kit = root.path().join("kit");
        write(&kit, &KitOptions::new(&real, &made)).unwrap();
        let commands = io::read_text(kit.join("commands.sh")).unwrap();
        let left_out = "for validation: synthetic, concatenated_val_both.\n";
        assert!(commands.contains(left_out), "{commands}");
        let names = VARIANTS.map(|variant| variant.name);
        let there = names.map(|name| kit.join(format!("{name}.yaml")).exists());
        assert_eq!(there, [true, false, true, false, true]);
        assert!(!commands.contains("--data synthetic.yaml"), "{commands}");
        let said = write(&kit, &KitOptions::new(made, real)).unwrap_err();
        let said = said.to_string();
        assert!(said.ends_with("val: no images, expected at least one"));
    }

    #[test]
    fn trainings_find_their_lists_from_any_folder() {
        let root = tempfile::tempdir().unwrap();
        let kit = written(root.path(), "my \"kit\": 1");
        for variant in &VARIANTS {
            let yaml = io::read_text(kit.join(format!("{}.yaml", variant.name))).unwrap();
            let elsewhere = root.path().join("clone");
            io::create_folder(&elsewhere).unwrap();
            io::write_text(elsewhere.join("data.yaml"), &yaml).unwrap();
            let set = YoloSet::open(&elsewhere).unwrap();
            assert!(set.train.iter().chain(&set.val).all(|image| image.exists()));
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn names_that_no_list_can_hold_are_refused_before_anything_is_written() {
        use std::os::unix::ffi::OsStrExt;
        let root = tempfile::tempdir().unwrap();
        let [real, made] = ["real", "made"].map(|name| dataset(root.path(), name, [2, 1], "[cap]"));
        let odd = std::ffi::OsStr::from_bytes(b"kit\xff");
        let refused = |kit: &Path| {
            let told = write(kit, &KitOptions::new(&real, &made)).unwrap_err();
            assert!(told.to_string().contains("not UTF-8"), "{told}");
            assert!(!kit.exists());
        };
        refused(&root.path().join(odd));
        let images = real.join("images/train");
        std::fs::rename(images.join("0.png"), images.join(odd).with_extension("png")).unwrap();
        refused(&root.path().join("kit"));
    }

    #[test]
    fn the_papers_settings_are_in_the_hyperparameters() {
        for line in [
            "lr0: 0.01",
            "lrf: 0.2",
            "momentum: 0.937",
            "warmup_epochs: 3.0",
            "mosaic: 1.0",
            "fliplr: 0.5",
        ] {
            let mut lines = HYP_YAML.lines().filter_map(|line| line.split('#').next());
            assert!(lines.any(|told| told.trim() == line), "{line}");
        }
    }

    #[test]
    fn other_classes_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let real = dataset(root.path(), "real", [2, 1], "[cap]");
        let made = dataset(root.path(), "made", [2, 1], "[cap, label]");
        let said = write(&root.path().join("kit"), &KitOptions::new(real, made))
            .unwrap_err()
            .to_string();
        assert!(
            said.starts_with("classes: [\"cap\", \"label\"] in "),
            "{said}"
        );
    }

    #[test]
    #[cfg(unix)]
    fn an_image_that_both_sets_train_on_is_refused() {
        let root = tempfile::tempdir().unwrap();
        let [real, made] = ["real", "made"].map(|name| dataset(root.path(), name, [2, 1], "[cap]"));
        let (kit, list) = (root.path().join("kit"), "images/train/0.png\nagain/1.png\n");
        io::write_text(made.join("some.txt"), list).unwrap();
        let yaml = "train: some.txt\nval: images/val\nnames: [cap]\n";
        io::write_text(made.join("data.yaml"), yaml).unwrap();
        // The same image under another name.
        std::os::unix::fs::symlink(real.join("images/train"), made.join("again")).unwrap();
        let said = |real: &Path, made: &Path| {
            let refused = write(&kit, &KitOptions::new(real, made));
            refused.unwrap_err().to_string()
        };
        let [told, twice] = [said(&real, &made), said(&real, &real)];
        assert!(told.starts_with("synthetic: "), "{told}");
        assert!(told.contains("made/again/1.png is also"), "{told}");
        assert!(twice.contains("real/images/train/0.png is also"), "{twice}");
        assert!(!kit.exists());
    }
}
