//! What is in a dataset that was just made.

use crate::print;
use petcomp::dataset::{ClassCount, DatasetCounts, Obstructed};
use std::path::{Path, PathBuf};

/// Prints what is in the folder: a result, so also where quiet is asked for.
pub(crate) fn print_counts(counts: &DatasetCounts) {
    print::line(images_line(counts));
    if counts.counted == 0 && counts.images > 0 {
        return;
    }
    print::line(objects_line(counts));
    for class in &counts.classes {
        print::line(class_line(class));
    }
}

/// Prints what a dataset's trainers are given.
pub(super) fn print_trainer_inputs(counts: &DatasetCounts, folder: &Path) {
    for path in trainer_inputs(counts, folder) {
        print::line(path.display());
    }
}

fn class_line(class: &ClassCount) -> String {
    let (name, labelled, objects) = (&class.name, class.labelled, class.objects);
    format!("  {name:10} {labelled} labelled of {objects}")
}

fn images_line(counts: &DatasetCounts) -> String {
    format!(
        "images       {} ({} for validation), {} made now, {} scenes resampled",
        counts.images, counts.val, counts.made, counts.retries
    )
}

fn objects_line(counts: &DatasetCounts) -> String {
    format!(
        "objects      {}{}, {} labelled, {} obstructed ({}){}",
        counts.objects,
        counted_in(counts),
        counts.labelled,
        counts.obstructed,
        obstructed_labels(counts.policy),
        left_out(counts)
    )
}

/// Which images the objects are in, where it is not all of them.
fn counted_in(counts: &DatasetCounts) -> String {
    match counts.counted {
        all if all == counts.images => String::new(),
        some => format!(" in {some} of the images"),
    }
}

/// What became of the labels of obstructed objects.
fn obstructed_labels(policy: Obstructed) -> &'static str {
    match policy {
        Obstructed::Drop => "without a label",
        Obstructed::Keep => "labelled like the others",
        Obstructed::Ignore => "to be ignored, in YOLO without a label",
        Obstructed::Class => "labelled as a class of their own",
    }
}

/// Objects without a label that are not obstructed, where there are any.
fn left_out(counts: &DatasetCounts) -> String {
    match counts.left_out() {
        0 => String::new(),
        some => format!(", {some} cut off too much or not seen (without a label)"),
    }
}

/// What a dataset's trainers are given: the files that name all others, or the folder where there
/// are none.
pub(crate) fn trainer_inputs(counts: &DatasetCounts, folder: &Path) -> Vec<PathBuf> {
    match counts.for_trainers.as_slice() {
        [] => vec![folder.into()],
        files => files.iter().map(|file| folder.join(file)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_objects_adds_up() {
        let counts = DatasetCounts {
            objects: 10,
            labelled: 5,
            obstructed: 3,
            ..DatasetCounts::default()
        };
        let expected = "objects      10, 5 labelled, 3 obstructed (without a label), \
            2 cut off too much or not seen (without a label)";
        assert_eq!(objects_line(&counts), expected);
    }
}
