//! The real pictures with known labels.

use super::sequences::one_of_each;
use crate::dataset::page::labelled_pictures::LabelledSet;
use crate::error::Result;
use crate::scene::BeltRanges;
use std::path::Path;

/// The pictures of a folder, each with its boxes; on a belt one of each sequence.
///
/// In a dataset a picture without a label file shows no object, as in trainers. In a bare folder it
/// may not have been labelled yet, so it is skipped.
///
/// # Errors
/// A folder without images; a label that cannot be read.
pub(super) fn real_pictures(folder: &Path, belt: Option<&BeltRanges>) -> Result<LabelledSet> {
    let mut set = LabelledSet::read(folder)?;
    match folder.join("data.yaml").is_file() {
        true => take_as_empty(&mut set),
        false => warn_of_unlabelled(folder, &set),
    }
    let mut set = match belt {
        Some(belt) => one_of_each(&set, belt),
        None => set,
    };
    set.pictures.retain(|picture| picture.boxes.is_some());
    Ok(set)
}

fn take_as_empty(set: &mut LabelledSet) {
    for picture in &mut set.pictures {
        picture.boxes.get_or_insert_with(Vec::new);
    }
}

fn warn_of_unlabelled(folder: &Path, set: &LabelledSet) {
    let unlabelled = set.pictures.iter().filter(|p| p.boxes.is_none()).count();
    if unlabelled > 0 {
        let (folder, all) = (folder.display(), set.pictures.len());
        log::warn!(
            "{folder}: {unlabelled} of {all} images have no label file and are left out; add an empty one where there is no object"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_without_a_label_file_is_a_negative_of_a_dataset_alone() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        for part in ["images", "labels"] {
            std::fs::create_dir(folder.path().join(part)).unwrap();
        }
        write("images/a.png", "");
        write("images/b.png", "");
        write("labels/a.txt", "0 0.5 0.5 0.5 0.5\n");
        let counts = || -> Vec<Option<usize>> {
            let set = real_pictures(folder.path(), None).unwrap();
            let boxes = set.pictures.iter().map(|picture| picture.boxes.as_ref());
            boxes.map(|boxes| boxes.map(Vec::len)).collect()
        };
        assert_eq!(counts(), [Some(1)]);
        write("data.yaml", "train: images\nval: images\nnames: [cap]\n");
        assert_eq!(counts(), [Some(1), Some(0)]);
    }
}
