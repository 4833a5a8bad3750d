//! How many images, objects and labels a dataset holds.

use crate::dataset::journal_line::JournalLine;
use crate::dataset::{Obstructed, Part, Plan, Writer};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;
use std::path::PathBuf;

/// What a dataset holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DatasetCounts {
    /// Images requested.
    pub asked: u64,
    /// Images in the folder.
    pub images: u64,
    /// Images for validation among them.
    pub val: u64,
    /// Images made by this run; the others already existed.
    pub made: u64,
    /// Images whose objects are counted: all that are present or, for archives, those of this run.
    pub counted: u64,
    /// Objects in these images, labelled or not.
    pub objects: u64,
    /// Objects that have a label; those to be ignored do not count.
    pub labelled: u64,
    /// Objects that are obstructed, labelled or not.
    pub obstructed: u64,
    /// Objects in cyclic overlap: something covers each of them.
    pub knotted: u64,
    /// Scenes that were drawn and rejected.
    pub retries: u64,
    /// Counts by class, in order.
    pub classes: Vec<ClassCount>,
    /// What happened to the labels of obstructed objects.
    pub policy: Obstructed,
    /// Files to give to trainers, below the folder, as far as they exist.
    pub for_trainers: Vec<PathBuf>,
}

/// Objects of one class.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClassCount {
    /// Name of the class.
    pub name: String,
    /// Objects in the images, labelled or not.
    pub objects: u64,
    /// Objects that have a label.
    pub labelled: u64,
}

impl DatasetCounts {
    /// Objects that got no label, or one to be ignored.
    pub fn dropped(&self) -> u64 {
        self.objects.saturating_sub(self.labelled)
    }

    /// Objects that got no label, or under `ignore` one to be ignored, for a reason other than
    /// obstruction: too much of them is outside the picture, or nothing of them is visible. If
    /// obstructed ones are labelled (`keep`, `class`), they may be among them.
    pub fn left_out(&self) -> u64 {
        let accounted = match self.policy {
            Obstructed::Drop | Obstructed::Ignore => self.labelled + self.obstructed,
            Obstructed::Keep | Obstructed::Class => self.labelled,
        };
        self.objects.saturating_sub(accounted)
    }

    /// Counts the lines of a plan's journal; `made` of the `asked` images are this run's.
    pub(crate) fn new(lines: &[JournalLine], plan: &Plan, asked: u64, made: u64) -> Self {
        let classes = ClassCount::for_classes(&plan.classes, lines);
        Self {
            asked,
            images: lines.len() as u64,
            val: sum_of(lines, |line| u32::from(line.part == Part::Val)),
            made,
            counted: lines.len() as u64,
            objects: classes.iter().map(|c| c.objects).sum(),
            labelled: classes.iter().map(|c| c.labelled).sum(),
            obstructed: sum_of(lines, |line| line.obstructed),
            knotted: sum_of(lines, |line| line.knotted),
            retries: sum_of(lines, |line| line.retries),
            classes,
            policy: plan.obstructed,
            for_trainers: files_for_trainers(plan),
        }
    }
}

impl AddAssign for DatasetCounts {
    /// Adds images of the same dataset.
    fn add_assign(&mut self, more: Self) {
        self.images += more.images;
        self.val += more.val;
        self.made += more.made;
        self.counted += more.counted;
        self.objects += more.objects;
        self.labelled += more.labelled;
        self.obstructed += more.obstructed;
        self.knotted += more.knotted;
        self.retries += more.retries;
        for (class, more) in self.classes.iter_mut().zip(more.classes) {
            class.objects += more.objects;
            class.labelled += more.labelled;
        }
    }
}

impl ClassCount {
    fn for_classes(names: &[String], lines: &[JournalLine]) -> Vec<Self> {
        let names = names.iter().enumerate();
        names
            .map(|(class, name)| Self::new(name, class, lines))
            .collect()
    }

    /// Counts of the class with this name and number.
    fn new(name: &str, class: usize, lines: &[JournalLine]) -> Self {
        let counts = lines.iter().filter_map(|line| line.classes.get(class));
        let [objects, labelled] = sum_by_part(counts.map(|counts| counts.map(u64::from)));
        Self {
            name: name.to_owned(),
            objects,
            labelled,
        }
    }
}

/// The files to give to trainers, as far as they exist.
fn files_for_trainers(plan: &Plan) -> Vec<PathBuf> {
    let archives = plan.archives.iter().flat_map(Writer::for_trainers);
    let writers = plan.writers.iter().flat_map(|w| w.for_trainers());
    archives
        .chain(writers)
        .filter(|path| plan.folder.join(path).exists())
        .collect()
}

fn sum_of(lines: &[JournalLine], count: fn(&JournalLine) -> u32) -> u64 {
    lines.iter().map(|line| u64::from(count(line))).sum()
}

/// The sums of counts by part.
pub(super) fn sum_by_part(counts: impl Iterator<Item = [u64; 2]>) -> [u64; 2] {
    counts.fold([0; 2], |sums, counts| [0, 1].map(|i| sums[i] + counts[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_object_is_labelled_obstructed_or_left_out() {
        let left_out = |policy, labelled| {
            let counts = DatasetCounts {
                objects: 10,
                labelled,
                obstructed: 3,
                policy,
                ..DatasetCounts::default()
            };
            counts.left_out()
        };
        assert_eq!(left_out(Obstructed::Drop, 5), 2);
        assert_eq!(left_out(Obstructed::Ignore, 5), 2);
        assert_eq!(left_out(Obstructed::Keep, 8), 2);
        assert_eq!(left_out(Obstructed::Class, 8), 2);
    }
}
