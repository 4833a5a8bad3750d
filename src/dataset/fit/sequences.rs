//! Pictures of a belt: those of one sequence show the same objects, and tell as much as one.

use crate::dataset::listing::record_of;
use crate::dataset::page::labelled_pictures::{LabelledPicture, LabelledSet};
use crate::scene::BeltRanges;
use rayon::prelude::*;

/// The picture in the middle of each sequence, where objects lie as they came to rest.
pub(super) fn one_of_each(set: &LabelledSet, belt: &BeltRanges) -> LabelledSet {
    let pictures = set.pictures.par_iter().enumerate();
    let placed = pictures.map(|(k, picture)| (sequence_of(picture, k as u64, belt), picture));
    let placed: Vec<(Sequence, &LabelledPicture)> = placed.collect();
    let sequences = placed.chunk_by(|(a, _), (b, _)| a == b);
    let middle = sequences.map(|sequence| sequence[sequence.len() / 2].1.clone());
    LabelledSet {
        classes: set.classes.clone(),
        pictures: middle.collect(),
    }
}

/// What pictures of one sequence have in common.
#[derive(PartialEq)]
enum Sequence {
    /// By their sidecars.
    Known(u64),
    /// By their order alone.
    Run(u64),
}

/// That of picture `k`: a real camera's pictures have no sidecar, and come in runs as long as the
/// recipe's.
fn sequence_of(picture: &LabelledPicture, k: u64, belt: &BeltRanges) -> Sequence {
    let record = record_of(&picture.path).ok();
    match record.and_then(|record| record.scene.belt) {
        Some(known) => Sequence::Known(known.sequence),
        None => Sequence::Run(belt.place_of(k).sequence),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_without_sidecars_come_in_runs_of_the_recipe() {
        let picture = |k: u64| LabelledPicture {
            path: format!("{k}.png").into(),
            boxes: None,
        };
        let set = LabelledSet {
            pictures: (0..10).map(picture).collect(),
            ..LabelledSet::default()
        };
        let belt = toml::from_str("frames = 4\nframe_rate = 10\nspeed = 0.1").unwrap();
        let taken = one_of_each(&set, &belt).pictures;
        let names: Vec<_> = taken.iter().map(LabelledPicture::file_name).collect();
        assert_eq!(names, ["2.png", "6.png", "9.png"]);
    }
}
