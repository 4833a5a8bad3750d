//! Pictures of a belt: those of one sequence show the same objects, and are worth only one.

use crate::dataset::listing::record_of;
use crate::dataset::page::labelled_pictures::{LabelledPicture, LabelledSet};
use crate::scene::BeltRanges;
use rayon::prelude::*;

/// The picture in the middle of each sequence, where objects are as they came to rest; if any have
/// a label file, the middle one of those.
pub(super) fn one_of_each(set: &LabelledSet, belt: &BeltRanges) -> LabelledSet {
    let pictures = set.pictures.par_iter().enumerate();
    let placed = pictures.map(|(k, picture)| (sequence_of(picture, k as u64, belt), picture));
    let placed: Vec<(Sequence, &LabelledPicture)> = placed.collect();
    let sequences = placed.chunk_by(|(a, _), (b, _)| a == b);
    LabelledSet {
        classes: set.classes.clone(),
        pictures: sequences.map(|s| middle_of(s).clone()).collect(),
    }
}

fn middle_of<'a>(sequence: &[(Sequence, &'a LabelledPicture)]) -> &'a LabelledPicture {
    let pictures = sequence.iter().map(|(_, picture)| *picture);
    let labelled: Vec<_> = pictures.filter(|p| p.boxes.is_some()).collect();
    let middle = labelled.get(labelled.len() / 2);
    middle.unwrap_or(&sequence[sequence.len() / 2].1)
}

/// What pictures of one sequence have in common.
#[derive(PartialEq)]
enum Sequence {
    /// From their sidecars.
    Known(u64),
    /// From their order alone.
    Run(u64),
}

/// The sequence of picture `k`: a real camera's pictures have no sidecar, and are assumed to come
/// in runs as long as the recipe's.
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
        let belt = toml::from_str("frames = 4\nframe_rate = 10\nspeed = 0.1").unwrap();
        let taken = |has_label: fn(u64) -> bool| -> Vec<String> {
            let pictures = (0..10).map(|k| LabelledPicture {
                path: format!("{k}.png").into(),
                boxes: has_label(k).then(Vec::new),
            });
            let set = LabelledSet {
                pictures: pictures.collect(),
                ..LabelledSet::default()
            };
            let taken = one_of_each(&set, &belt).pictures;
            taken.iter().map(|p| p.file_name().to_string()).collect()
        };
        assert_eq!(taken(|_| false), ["2.png", "6.png", "9.png"]);
        assert_eq!(taken(|k| k % 4 == 0), ["0.png", "4.png", "8.png"]);
    }
}
