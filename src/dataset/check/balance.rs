//! How many labels each class has, and how large its boxes are.

use super::Checked;
use crate::dataset::Part;
use crate::diagnostic::{Code, Diagnostic};
use crate::plot::Table;

/// Boxes with a side below this share of the image's are reported as very small.
const TINY_SIDE_SHARE: f64 = 0.01;

/// A class with less than this share of the labels is reported as rare.
const RARE_LABEL_SHARE: f64 = 0.02;

impl Checked {
    /// For each class its labels in both parts and the sizes of its boxes.
    pub fn balance(&self) -> Table {
        let mut table = Table::new(["class", "train", "val", "share", "box width", "box height"]);
        for class in 0..self.rows.len() {
            table.push(self.balance_row(class));
        }
        table
    }

    fn balance_row(&self, class: usize) -> [String; 6] {
        let share = 100.0 * self.rows[class] as f64 / self.boxes.len().max(1) as f64;
        let [train, val] = Part::ALL.map(|part| self.count(class, part).to_string());
        let [width, height] = [0, 1].map(|side| self.side_range(class, side));
        let share = format!("{share:.1} %");
        [self.class_name(class), train, val, share, width, height]
    }

    fn class_name(&self, class: usize) -> String {
        let name = self.classes.get(class).cloned();
        name.unwrap_or_else(|| class.to_string())
    }

    /// Labels of a class in a part.
    fn count(&self, class: usize, part: Part) -> usize {
        self.boxes
            .iter()
            .filter(|b| b.class == class && b.part == part)
            .count()
    }

    /// Smallest, median and largest side of a class's boxes, percent of the image.
    fn side_range(&self, class: usize, side: usize) -> String {
        match min_median_max(&self.sides_of(class, side)) {
            Some([min, median, max]) => format!("{min:.1} / {median:.1} / {max:.1} %"),
            None => "-".into(),
        }
    }

    /// Widths or heights of the boxes of a class, percent of the image, ascending.
    fn sides_of(&self, class: usize, side: usize) -> Vec<f64> {
        let boxes = self.boxes.iter().filter(|b| b.class == class);
        let sides = boxes.map(|b| b.sides);
        let mut sides: Vec<f64> = sides.map(|sides| 100.0 * sides[side]).collect();
        sides.sort_by(f64::total_cmp);
        sides
    }

    /// Notes on what is not wrong but worth knowing: images without a label file, classes with few
    /// or no labels, very small boxes.
    pub fn notes(&self) -> Vec<Diagnostic> {
        let classes = (0..self.classes.len()).flat_map(|class| self.class_notes(class));
        let images = self.unlabelled_images().into_iter();
        images.chain(classes).chain(self.tiny_boxes()).collect()
    }

    fn unlabelled_images(&self) -> Option<Diagnostic> {
        (self.unlabelled > 0).then(|| {
            let (count, all) = (self.unlabelled, self.images);
            let message =
                format!("{count} of {all} images have no label file: trainers take them as empty");
            Diagnostic::note(Code::MissingLabel, message)
        })
    }

    fn class_notes(&self, class: usize) -> impl Iterator<Item = Diagnostic> {
        let parts = Part::ALL.into_iter();
        parts
            .filter(move |&part| self.empty_part != Some(part) && self.count(class, part) == 0)
            .map(move |part| self.no_label_in(part, class))
            .chain(self.rare_class(class))
    }

    fn no_label_in(&self, part: Part, class: usize) -> Diagnostic {
        let (name, part) = (&self.classes[class], part.name());
        let message = format!("class \"{name}\" has no label in {part}");
        Diagnostic::note(Code::ClassWithoutLabels, message)
    }

    fn rare_class(&self, class: usize) -> Option<Diagnostic> {
        let (rows, all) = (*self.rows.get(class)?, self.boxes.len());
        let is_rare = rows > 0 && (rows as f64) < RARE_LABEL_SHARE * all as f64;
        is_rare.then(|| {
            let name = &self.classes[class];
            let message = format!("class \"{name}\" has only {rows} of {all} labels");
            Diagnostic::note(Code::RareClass, message)
        })
    }

    fn tiny_boxes(&self) -> Option<Diagnostic> {
        let sides = self.boxes.iter().map(|b| b.sides);
        let tiny = sides.filter(|sides| sides.iter().any(|side| *side < TINY_SIDE_SHARE));
        let (count, percent) = (tiny.count(), 100.0 * TINY_SIDE_SHARE);
        let message = format!("{count} boxes have a side below {percent:.0} % of the image's");
        (count > 0).then(|| Diagnostic::note(Code::TinyBoxes, message))
    }
}

/// Of sorted numbers.
fn min_median_max(sorted: &[f64]) -> Option<[f64; 3]> {
    Some([*sorted.first()?, sorted[sorted.len() / 2], *sorted.last()?])
}
