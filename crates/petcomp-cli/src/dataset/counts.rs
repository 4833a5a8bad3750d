//! The contents of a newly generated dataset.

use crate::print;
use petcomp::dataset::{ClassCount, DatasetCounts, Obstructed};
use std::path::{Path, PathBuf};

/// Prints what is in the folder: it is a result, so it is printed with `--quiet`, too.
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

/// Prints the files to give to trainers.
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
        "images       {} ({} for validation), {} generated now, {} scenes resampled",
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

/// Which images the objects are in, if not all of them.
fn counted_in(counts: &DatasetCounts) -> String {
    match counts.counted {
        all if all == counts.images => String::new(),
        some => format!(" in {some} of the images"),
    }
}

const WITHOUT_LABEL: &str = "without a label";
const TO_BE_IGNORED: &str = "ignored, unlabelled in YOLO";

/// What happened to the labels of obstructed objects.
fn obstructed_labels(policy: Obstructed) -> &'static str {
    match policy {
        Obstructed::Drop => WITHOUT_LABEL,
        Obstructed::Keep => "labelled like the others",
        Obstructed::Ignore => TO_BE_IGNORED,
        Obstructed::Class => "labelled as a separate class",
    }
}

/// Objects that were left out, if any, and what happened to their labels.
fn left_out(counts: &DatasetCounts) -> String {
    let labels = match counts.policy {
        Obstructed::Ignore => "ignored or without a label",
        Obstructed::Drop | Obstructed::Keep | Obstructed::Class => WITHOUT_LABEL,
    };
    match counts.left_out() {
        0 => String::new(),
        some => format!(", {some} too truncated or not visible ({labels})"),
    }
}

/// The files to give to trainers: those that name all others, or the folder if there are none.
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
        let to_be_ignored = "(ignored, unlabelled in YOLO)";
        for (policy, obstructed, left_out) in [
            (Obstructed::Drop, "(without a label)", "(without a label)"),
            (
                Obstructed::Ignore,
                to_be_ignored,
                "(ignored or without a label)",
            ),
        ] {
            let counts = DatasetCounts {
                objects: 10,
                labelled: 5,
                obstructed: 3,
                policy,
                ..DatasetCounts::default()
            };
            let expected = format!(
                "objects      10, 5 labelled, 3 obstructed {obstructed}, 2 too truncated or not visible {left_out}"
            );
            assert_eq!(objects_line(&counts), expected);
        }
    }
}
