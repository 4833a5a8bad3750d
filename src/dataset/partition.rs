//! Partitioning images for training and validation, and what leaks from one to the other.

use crate::dataset::listing::{record_of, sidecar_of};
use crate::dataset::near_duplicates::{NearDuplicate, near_pairs};
use crate::dataset::yolo_set::{YoloSet, whole_share};
use crate::error::{Error, Result};
use crate::scene::{Draws, Scene};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::str::FromStr;

/// How images are partitioned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partition {
    /// The first ones for training, the last for validation, as the paper does with series of
    /// photos; a gap between them for neither.
    Consecutive {
        /// Number of images in the gap.
        guard: usize,
    },
    /// Groups stay together.
    Grouped(Group),
    /// Each image for itself.
    Random,
}

/// What images may have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The photo of the place.
    Background,
    /// The selection of objects and their photos; a scene without objects is a group of its own.
    Selection,
}

impl Group {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Background, Self::Selection];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Background => "background",
            Self::Selection => "selection",
        }
    }

    /// What a scene has in common with the others of its group; none if nothing was selected.
    fn key_of(self, scene: &Scene) -> Option<String> {
        match self {
            Self::Background => Some(scene.plate.clone()),
            Self::Selection => selection_of(scene),
        }
    }
}

impl FromStr for Group {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let known = Self::ALL.into_iter().find(|group| group.name() == text);
        known.ok_or_else(|| {
            let what = format!("\"{text}\", expected background or selection");
            Error::value("group", what)
        })
    }
}

/// What training and validation have in common.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Leakage {
    /// For each [`Group`] that is known for the images: number of groups of the validation images,
    /// and how many of them also occur in training.
    pub groups: Vec<(&'static str, [usize; 2])>,
    /// Validation images that look like a training image.
    pub near_duplicates: Vec<NearDuplicate>,
}

impl YoloSet {
    /// Splits the images anew, in natural order of name: the share `ratio`, rounded down, for
    /// training.
    ///
    /// # Errors
    /// A ratio outside 0..1; groups of images without sidecars.
    pub fn partitioned(&self, how: Partition, ratio: f64, seed: u64) -> Result<Self> {
        check_ratio(ratio)?;
        let all = self.series();
        let count = whole_share(all.len(), ratio);
        Ok(self.with_parts(match how {
            Partition::Consecutive { guard } => consecutive(&all, count, guard),
            Partition::Random => grouped(&all, &numbers_to(all.len()), count, seed),
            Partition::Grouped(group) => grouped(&all, &groups(&all, group)?, count, seed),
        }))
    }

    /// What leaks from training to validation; images are near-duplicates if they differ by less
    /// than `max_codes` (root mean square of 8-bit grey values of a small copy) and their label
    /// files, if both have one, agree, or if they differ by no more than a picture that was saved
    /// again. Two images whose label files have no rows are never near-duplicates.
    ///
    /// # Errors
    /// An image or a sidecar that cannot be read.
    pub fn leakage(&self, max_codes: f64) -> Result<Leakage> {
        Ok(Leakage {
            groups: self.leaked_groups()?,
            near_duplicates: near_pairs(&self.train, &self.val, max_codes)?,
        })
    }

    /// Empty if an image has no sidecar.
    fn leaked_groups(&self) -> Result<Vec<(&'static str, [usize; 2])>> {
        let mut images = self.train.iter().chain(&self.val);
        if !images.all(|image| sidecar_of(image).exists()) {
            return Ok(Vec::new());
        }
        let groups = Group::ALL.into_iter();
        groups
            .map(|group| Ok((group.name(), self.shared_groups(group)?)))
            .collect()
    }

    /// Number of groups of the validation images, and how many of them occur in training.
    fn shared_groups(&self, group: Group) -> Result<[usize; 2]> {
        let train = distinct_groups(&self.train, group)?;
        let val = distinct_groups(&self.val, group)?;
        Ok([val.len(), val.intersection(&train).count()])
    }
}

fn distinct_groups(images: &[PathBuf], group: Group) -> Result<BTreeSet<String>> {
    Ok(keys(images, group)?.into_iter().flatten().collect())
}

/// The group of each image; one without a key is alone in a group named by its index.
fn groups(images: &[PathBuf], group: Group) -> Result<Vec<String>> {
    let keys = keys(images, group)?.into_iter().enumerate();
    Ok(keys
        .map(|(place, key)| key.unwrap_or_else(|| place.to_string()))
        .collect())
}

/// What each image has in common with the others of its group.
fn keys(images: &[PathBuf], group: Group) -> Result<Vec<Option<String>>> {
    images
        .par_iter()
        .map(|image| Ok(group.key_of(&record_of(image)?.drawn)))
        .collect()
}

/// Groups in a random order go to validation until it has its share; the rest go to training.
fn grouped(images: &[PathBuf], groups: &[String], train: usize, seed: u64) -> [Vec<PathBuf>; 2] {
    let val = groups_for_validation(groups, images.len() - train, seed);
    let mut parts = [Vec::new(), Vec::new()];
    for (image, group) in images.iter().zip(groups) {
        parts[usize::from(val.contains(group.as_str()))].push(image.clone());
    }
    parts
}

/// Groups in a random order, until they have about this many images.
fn groups_for_validation(groups: &[String], wanted: usize, seed: u64) -> BTreeSet<&str> {
    let (mut val, mut taken) = (BTreeSet::new(), 0);
    for (group, size) in shuffled_groups(groups, seed) {
        // A group is taken if that brings the count closer to the share.
        if taken < wanted && (taken + size).abs_diff(wanted) <= wanted - taken {
            taken += size;
            val.insert(group);
        }
    }
    val
}

/// Groups and their sizes, in a random order.
fn shuffled_groups(groups: &[String], seed: u64) -> Vec<(&str, usize)> {
    let mut sizes: BTreeMap<&str, usize> = BTreeMap::new();
    for group in groups {
        *sizes.entry(group).or_default() += 1;
    }
    let mut order: Vec<_> = sizes.into_iter().collect();
    order.sort_by_key(|(group, _)| Draws::new(seed, 0).bits(&format!("split.{group}")));
    order
}

fn check_ratio(ratio: f64) -> Result<()> {
    if ratio > 0.0 && ratio < 1.0 {
        return Ok(());
    }
    let what = format!("{ratio}, expected a share between 0 and 1");
    Err(Error::value("ratio", what))
}

/// The photos of a scene's objects, sorted; none without objects.
fn selection_of(scene: &Scene) -> Option<String> {
    let photos = scene.objects.iter();
    let photos = photos.map(|object| format!("{}/{}", object.asset, object.photo));
    let mut photos: Vec<String> = photos.collect();
    photos.sort();
    (!photos.is_empty()).then(|| photos.join(" "))
}

/// The first images, and those after the gap.
fn consecutive(images: &[PathBuf], train: usize, guard: usize) -> [Vec<PathBuf>; 2] {
    let first_val = train.saturating_add(guard).min(images.len());
    [images[..train].to_vec(), images[first_val..].to_vec()]
}

/// A group for each image.
fn numbers_to(count: usize) -> Vec<String> {
    (0..count).map(|i| i.to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn listing(n: usize) -> YoloSet {
        YoloSet {
            train: (0..n)
                .map(|i| format!("/d/images/{i:04}.png").into())
                .collect(),
            ..YoloSet::default()
        }
    }

    /// This many images, four fifths of them for training.
    fn cut(n: usize, guard: usize) -> YoloSet {
        let how = Partition::Consecutive { guard };
        listing(n).partitioned(how, 0.8, 0).unwrap()
    }

    #[test]
    fn the_paper_s_series_is_cut_once() {
        let series = cut(2031, 0);
        // 80 % of 2031 is 1624.8.
        assert_eq!((series.train.len(), series.val.len()), (1624, 407));
        assert_eq!(whole_share(100, 0.29), 29);
        assert!(series.train.last() < series.val.first());
        let guarded = cut(100, 5);
        assert_eq!((guarded.train.len(), guarded.val.len()), (80, 15));
    }

    #[test]
    fn the_last_frames_are_for_validation_without_zeros_in_their_numbers() {
        let frames = |range: std::ops::RangeInclusive<u32>| -> Vec<PathBuf> {
            range
                .map(|i| format!("/d/images/frame{i}.png").into())
                .collect()
        };
        let series = YoloSet {
            train: frames(1..=60),
            ..YoloSet::default()
        };
        let cut = series.partitioned(Partition::Consecutive { guard: 0 }, 0.8, 0);
        assert_eq!(cut.unwrap().val, frames(49..=60));
    }

    #[test]
    fn a_random_split_depends_on_the_seed_alone() {
        let split = |seed| {
            listing(200)
                .partitioned(Partition::Random, 0.75, seed)
                .unwrap()
        };
        assert_eq!((split(1).train.len(), split(1).val.len()), (150, 50));
        assert_eq!(split(1), split(1));
        assert_ne!(split(1).val, split(2).val);
    }

    #[test]
    fn groups_stay_together() {
        let images = listing(90).train;
        let names: Vec<String> = (0..90).map(|i| format!("g{}", i % 9)).collect();
        let [train, val] = grouped(&images, &names, 72, 3);
        assert_eq!((train.len(), val.len()), (70, 20));
        let of = |image: &PathBuf| names[images.iter().position(|i| i == image).unwrap()].clone();
        let (a, b): (BTreeSet<String>, BTreeSet<String>) =
            (train.iter().map(of).collect(), val.iter().map(of).collect());
        assert!(a.is_disjoint(&b));
    }

    #[test]
    fn the_head_is_taken_of_both_parts() {
        let split = cut(100, 0).head(0.25).unwrap();
        assert_eq!((split.train.len(), split.val.len()), (20, 5));
        // 20 % of 1624 is 324.8, and of 407 81.4.
        let fifth = cut(2031, 0).head(0.2).unwrap();
        assert_eq!((fifth.train.len(), fifth.val.len()), (324, 81));
        assert!(
            listing(3).head(1.5).is_err()
                && listing(3).partitioned(Partition::Random, 1.0, 0).is_err()
        );
    }

    #[test]
    fn a_sidecar_is_beside_the_last_folder_of_images() {
        let sidecar = sidecar_of("/my/images/set/images/val/000000.png".as_ref());
        assert_eq!(sidecar, Path::new("/my/images/set/scenes/val/000000.json"));
    }

    #[test]
    fn groups_are_unknown_without_a_sidecar_and_a_damaged_one_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(dir.path().join("images")).unwrap();
        std::fs::create_dir_all(dir.path().join("scenes")).unwrap();
        let image = dir.path().join("images/0.png");
        let listing = YoloSet {
            train: vec![image],
            ..YoloSet::default()
        };
        assert!(listing.leaked_groups().unwrap().is_empty());
        std::fs::write(dir.path().join("scenes/0.json"), "{").unwrap();
        let said = listing.leaked_groups().unwrap_err().to_string();
        assert!(said.contains("scenes/0.json"), "{said}");
    }

    #[test]
    fn a_listing_reads_back_from_any_folder() {
        let dir = tempfile::tempdir().unwrap();
        let root = std::path::absolute(dir.path()).unwrap();
        let image = |part: &str| root.join(format!("images/{part}/0.png"));
        let listing = YoloSet {
            train: vec![image("train")],
            val: vec![image("val")],
            classes: vec!["a: b".into()],
            test: vec![root.join("images/test")],
        };
        listing.write(&root.join("splits/one")).unwrap();
        assert_eq!(YoloSet::read(&root.join("splits/one")).unwrap(), listing);
    }
}
