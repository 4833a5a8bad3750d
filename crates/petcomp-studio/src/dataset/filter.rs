//! Selection and order of pictures.

use super::catalog::{Catalog, Flag};
use petcomp::dataset::Part;
use petcomp::dataset::index::{DatasetIndex, ObjectFacts};
use serde::Deserialize;
use std::cmp::Reverse;

/// Conditions on a picture; by default there are none.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Filter {
    part: Option<Part>,
    /// An object of this class.
    class: Option<u32>,
    /// That object has a label, or has none.
    labelled: Option<bool>,
    /// That object's visible share is in this range, 0 to 1.
    visible: Option<[f32; 2]>,
    /// A number of objects in this range, both ends included.
    objects: Option<[usize; 2]>,
    /// This photo of the place.
    background: Option<String>,
    flag: Option<Flag>,
}

/// Order of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Order {
    /// As listed.
    Listed,
    /// The most unusual first, and only unusual ones.
    Unlike,
    /// Those with most objects first.
    MostObjects,
    /// Those with fewest objects first.
    FewestObjects,
    /// Those with the least visible object first.
    LeastVisible,
}

impl Order {
    /// Whether it needs facts that only the records contain, not the list.
    pub(super) fn needs_facts(self, index: &DatasetIndex) -> bool {
        match self {
            Self::Listed => false,
            Self::MostObjects | Self::FewestObjects => !lists_objects(index),
            Self::Unlike | Self::LeastVisible => true,
        }
    }
}

impl Filter {
    /// Whether it needs facts that only the records contain, not the list.
    pub(super) fn needs_facts(&self, index: &DatasetIndex) -> bool {
        let by_count = self.objects.is_some() || self.flag.is_some() || self.class.is_some();
        self.visible.is_some()
            || self.background.is_some()
            || self.labelled.is_some()
            || matches!(self.flag, Some(Flag::Distractors | Flag::Unreadable))
            || (by_count && !lists_objects(index))
    }

    /// Whether a picture passes the filter; none if that is not known yet.
    fn admits(&self, catalog: &Catalog, row: usize) -> Option<bool> {
        let picture = &catalog.index.pictures[row];
        let asked = [
            self.part.map(|part| Some(picture.part == Some(part))),
            self.objects.map(|range| has_count(catalog, row, range)),
            self.flag.map(|flag| catalog.has_flag(row, flag)),
            self.background
                .as_ref()
                .map(|name| catalog.of_facts(row, |facts| facts.background == *name)),
            self.asks_objects().then(|| self.has_object(catalog, row)),
        ];
        let mut answers = asked.into_iter().flatten();
        answers.try_fold(true, |all, answer| Some(all && answer?))
    }

    fn asks_objects(&self) -> bool {
        self.class.is_some() || self.labelled.is_some() || self.visible.is_some()
    }

    fn has_object(&self, catalog: &Catalog, row: usize) -> Option<bool> {
        let written = catalog.index.pictures[row].written.as_ref();
        match (self.class, written) {
            (Some(class), Some(written)) if self.labelled.is_none() && self.visible.is_none() => {
                let counts = written.classes.get(class as usize);
                Some(counts.is_some_and(|[objects, _]| *objects > 0))
            }
            _ => catalog.of_facts(row, |facts| {
                facts.objects.iter().any(|object| self.is_met(object))
            }),
        }
    }

    fn is_met(&self, object: &ObjectFacts) -> bool {
        let is_seen =
            |[least, most]: [f32; 2]| object.visible.is_some_and(|v| v >= least && v <= most);
        self.class.is_none_or(|class| class == object.class)
            && self
                .labelled
                .is_none_or(|labelled| labelled == object.labelled)
            && self.visible.is_none_or(is_seen)
    }
}

/// Whether the list contains the number of objects of each picture.
fn lists_objects(index: &DatasetIndex) -> bool {
    let mut pictures = index.pictures.iter();
    pictures.all(|picture| picture.written.is_some())
}

/// Whether a picture's number of objects is in a range, both ends included; none if not known yet.
fn has_count(catalog: &Catalog, row: usize, [least, most]: [usize; 2]) -> Option<bool> {
    let [objects, _] = catalog.counts(row)?;
    Some((least..=most).contains(&objects))
}

/// The rows known to pass the filter; for [`Order::Unlike`], also why each is unlike the others.
pub(super) fn found(catalog: &Catalog, filter: &Filter, order: Order) -> (Vec<usize>, Vec<String>) {
    let admitted = |row: &usize| filter.admits(catalog, *row) == Some(true);
    if order == Order::Unlike {
        let unlike = catalog.index.unlike(|row| catalog.known(row)?.as_ref());
        let unlike = unlike.into_iter().filter(|unlike| admitted(&unlike.row));
        return unlike.map(|unlike| (unlike.row, unlike.why)).unzip();
    }
    let mut rows: Vec<usize> = (0..catalog.index.pictures.len()).filter(admitted).collect();
    sort(&mut rows, catalog, order);
    (rows, Vec::new())
}

fn sort(rows: &mut [usize], catalog: &Catalog, order: Order) {
    let objects = |row: usize| catalog.counts(row).map_or(0, |[objects, _]| objects);
    match order {
        Order::MostObjects => rows.sort_by_key(|&row| Reverse(objects(row))),
        Order::FewestObjects => rows.sort_by_key(|&row| objects(row)),
        Order::LeastVisible => rows.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|row| least_visible(catalog, row));
            a.total_cmp(&b)
        }),
        Order::Listed | Order::Unlike => {}
    }
}

/// Visible share of the object that is hidden most.
fn least_visible(catalog: &Catalog, row: usize) -> f32 {
    let facts = catalog.known(row).and_then(Option::as_ref);
    let objects = facts.iter().flat_map(|facts| &facts.objects);
    objects
        .filter_map(|object| object.visible)
        .fold(1.0, f32::min)
}

#[cfg(test)]
mod tests {
    use super::super::catalog::Catalogs;
    use super::*;
    use crate::folder::Folder;

    #[test]
    fn pictures_of_another_program_are_read_to_be_sorted_by_their_objects() {
        let dir = tempfile::tempdir().unwrap();
        let one = "0 0.5 0.5 0.2 0.1\n";
        for (name, label) in [
            ("a", one.into()),
            ("b", format!("{one}0 0.2 0.5 0.2 0.1\n")),
        ] {
            std::fs::write(dir.path().join(name).with_extension("png"), "").unwrap();
            std::fs::write(dir.path().join(name).with_extension("txt"), label).unwrap();
        }
        let folder = Folder::open(dir.path()).unwrap();
        let catalog = Catalogs::default().open(&folder, "").unwrap();
        let orders = [
            (Order::MostObjects, [1_usize, 0]),
            (Order::FewestObjects, [0, 1]),
        ];
        for (order, sorted) in orders {
            assert!(order.needs_facts(&catalog.index));
            assert!((0..2).all(|row| catalog.facts(row).is_some()));
            assert_eq!(found(&catalog, &Filter::default(), order).0, sorted);
        }
        assert!(!Order::Listed.needs_facts(&catalog.index));
    }
}
