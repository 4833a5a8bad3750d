//! The boxes of every class, image by image: each box is visited once, however many classes there
//! are.

use super::{Detection, EvalImage, GroundTruth};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::iter::Peekable;

/// The position of a box.
#[derive(Clone, Copy)]
struct BoxPlace {
    class: u32,
    sheet: usize,
    index: usize,
}

/// All boxes sorted by class, image and, for detections, confidence.
pub(super) struct ByClass<'a> {
    sheets: &'a [EvalImage],
    truth: Vec<BoxPlace>,
    found: Vec<BoxPlace>,
}

/// The boxes of a class.
pub(super) struct ClassBoxes<'a> {
    pub(super) class: u32,
    sheets: &'a [EvalImage],
    truth: &'a [BoxPlace],
    found: &'a [BoxPlace],
}

/// The boxes of a class in one image.
pub(super) struct ImageBoxes<'a> {
    /// The index of the sheet.
    pub(super) sheet: usize,
    /// In the sheet's order.
    pub(super) truth: Vec<&'a GroundTruth>,
    /// By decreasing confidence; equal ones in the sheet's order.
    pub(super) found: Vec<&'a Detection>,
}

impl<'a> ImageBoxes<'a> {
    fn new(sheet: usize, boxes: &'a EvalImage, truth: &[BoxPlace], found: &[BoxPlace]) -> Self {
        Self {
            sheet,
            truth: truth.iter().map(|p| &boxes.truth[p.index]).collect(),
            found: found.iter().map(|p| &boxes.found[p.index]).collect(),
        }
    }
}

/// The positions of all boxes, whose classes are given image by image.
fn places(sheets: impl Iterator<Item: Iterator<Item = u32>>) -> Vec<BoxPlace> {
    let mut places = Vec::new();
    for (sheet, classes) in sheets.enumerate() {
        places.extend(classes.enumerate().map(|(index, class)| BoxPlace {
            class,
            sheet,
            index,
        }));
    }
    places
}

impl<'a> ByClass<'a> {
    pub(super) fn new(sheets: &'a [EvalImage]) -> Self {
        let truth = sheets.iter().map(|s| s.truth.iter().map(|t| t.class));
        let found = sheets.iter().map(|s| s.found.iter().map(|f| f.class));
        let (mut truth, mut found) = (places(truth), places(found));
        // Both sorts are stable.
        truth.par_sort_by_key(|p| p.class);
        found.par_sort_by(|a, b| a.cmp_detections(b, sheets));
        Self {
            sheets,
            truth,
            found,
        }
    }

    /// The classes that occur in the truth, in ascending order.
    pub(super) fn classes<'s>(&'s self) -> Vec<ClassBoxes<'s>> {
        self.truth
            .chunk_by(|a, b| a.class == b.class)
            .map(|truth| self.boxes_with(truth))
            .collect()
    }

    /// The boxes of the class that all boxes in `truth` have.
    fn boxes_with<'s>(&'s self, truth: &'s [BoxPlace]) -> ClassBoxes<'s> {
        ClassBoxes {
            class: truth[0].class,
            sheets: self.sheets,
            truth,
            found: self.found_of(truth[0].class),
        }
    }

    /// The detections of a class.
    fn found_of(&self, class: u32) -> &[BoxPlace] {
        let first = self.found.partition_point(|p| p.class < class);
        let last = self.found.partition_point(|p| p.class <= class);
        &self.found[first..last]
    }
}

impl<'a> ClassBoxes<'a> {
    /// The images with boxes of the class, in order.
    pub(super) fn images(&self) -> Vec<ImageBoxes<'a>> {
        let mut truth = self.truth.chunk_by(BoxPlace::is_on_same_sheet).peekable();
        let mut found = self.found.chunk_by(BoxPlace::is_on_same_sheet).peekable();
        let mut images = Vec::new();
        while let Some(sheet) = first_sheet([truth.peek(), found.peek()]) {
            images.push(ImageBoxes::new(
                sheet,
                &self.sheets[sheet],
                next_on(sheet, &mut truth),
                next_on(sheet, &mut found),
            ));
        }
        images
    }
}

impl BoxPlace {
    fn is_on_same_sheet(&self, other: &Self) -> bool {
        self.sheet == other.sheet
    }

    /// For detections: by class and image, then by decreasing confidence.
    fn cmp_detections(&self, other: &Self, sheets: &[EvalImage]) -> Ordering {
        (self.class, self.sheet)
            .cmp(&(other.class, other.sheet))
            .then_with(|| other.confidence(sheets).total_cmp(&self.confidence(sheets)))
    }

    /// The confidence of a detection.
    fn confidence(&self, sheets: &[EvalImage]) -> f64 {
        sheets[self.sheet].found[self.index].confidence
    }
}

/// The next boxes if they are on this sheet.
fn next_on<'a>(
    sheet: usize,
    places: &mut Peekable<impl Iterator<Item = &'a [BoxPlace]>>,
) -> &'a [BoxPlace] {
    let next = places.next_if(|places| places[0].sheet == sheet);
    next.unwrap_or_default()
}

/// The first sheet that has any of the next boxes.
fn first_sheet(next: [Option<&&[BoxPlace]>; 2]) -> Option<usize> {
    let sheets = next.into_iter().flatten().map(|places| places[0].sheet);
    sheets.min()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn each_class_has_its_boxes_and_no_other() {
        let b = bbox(0.0, 0.0, 1.0, 1.0);
        let sheets = [
            sheet(
                vec![there(u32::MAX, b), there(2, b)],
                vec![found(2, b, 0.1), found(2, b, 0.9), found(5, b, 0.5)],
            ),
            sheet(vec![], vec![found(u32::MAX, b, 0.3)]),
            sheet(vec![there(2, b)], vec![]),
        ];
        let all = ByClass::new(&sheets);
        let classes = all.classes();
        let told = |class: &ClassBoxes<'_>| {
            let image = |i: ImageBoxes<'_>| {
                (
                    i.sheet,
                    i.truth.len(),
                    i.found.iter().map(|f| f.confidence).collect(),
                )
            };
            (
                class.class,
                class
                    .images()
                    .into_iter()
                    .map(image)
                    .collect::<Vec<(usize, usize, Vec<f64>)>>(),
            )
        };
        assert_eq!(
            told(&classes[0]),
            (2, vec![(0, 1, vec![0.9, 0.1]), (2, 1, vec![])])
        );
        assert_eq!(
            told(&classes[1]),
            (u32::MAX, vec![(0, 1, vec![]), (1, 0, vec![0.3])])
        );
        assert_eq!(classes.len(), 2);
    }
}
