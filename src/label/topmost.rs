//! Which object covers which.
//!
//! # Method
//! The topmost rule of "Synthetic Data Generation for Visual Detection of Flattened PET Bottles":
//! outlines that overlap are a pair, the one nearer the camera covers the other, and an object that
//! nothing covers is unobstructed. The paper compares one altitude per object; here a pair is
//! compared *over its overlap*, which is right for tilted cards too. The inverse depth of a plane
//! is an affine function of the pixel position, so its mean over the overlap is its value at the
//! overlap's centroid: one comparison, exact, whatever the shape.

use crate::camera::Camera;
use crate::geom::Point2;
use crate::label::boolean::difference;
use crate::label::holdout::hidden_area;
use crate::label::outline::{bounds, overlap};
use crate::label::{ObjectLabel, Silhouette};
use crate::pixel::ObjectId;
use crate::scene::{Card, Shot};
use geo::{Area, Centroid, MultiPolygon};
use std::collections::BTreeSet;

/// For each object, the ids of those that cover it, in order of id.
///
/// Two objects are a pair if the intersection over union of their outlines is above `iou`. Of two
/// cards at exactly the same depth, the one given first covers the other.
pub(crate) fn occluders(objects: &[Silhouette<'_>], shot: &Shot, iou: f64) -> Vec<Vec<ObjectId>> {
    let boxes: Vec<_> = objects.iter().map(|o| bounds(&o.region)).collect();
    let mut occluders = vec![Vec::new(); objects.len()];
    for j in 0..objects.len() {
        for i in (0..j).filter(|i| boxes[*i].overlaps(&boxes[j])) {
            let Some(first_is_above) = is_first_above(&objects[i], &objects[j], shot, iou) else {
                continue;
            };
            let (above, below) = if first_is_above { (i, j) } else { (j, i) };
            occluders[below].push(objects[above].card.id);
        }
    }
    occluders
}

/// Share of an object's outline that neither those `over` it nor the holdout covers, in the
/// picture; 0 if it has no area.
///
/// Outlines cover whatever is under them, even those of see-through objects: what is under one
/// cannot be picked.
pub(crate) fn uncovered_fraction(
    object: &Silhouette<'_>,
    over: &[ObjectId],
    objects: &[Silhouette<'_>],
    shot: &Shot,
) -> f64 {
    let whole = object.region.unsigned_area();
    if whole == 0.0 {
        return 0.0;
    }
    let covering = objects.iter().filter(|other| over.contains(&other.card.id));
    let free = covering.fold(object.region.clone(), |free, other| {
        difference(&free, &other.region)
    });
    let seen = free.unsigned_area() - hidden_area(&free, object.card, shot);
    seen.max(0.0) / whole
}

/// Whether the holdout hides more than this share of an object's outline.
pub(crate) fn is_held_out(object: &Silhouette<'_>, share: f64, shot: &Shot) -> bool {
    let hidden = hidden_area(&object.region, object.card, shot);
    hidden > share * object.region.unsigned_area()
}

/// None if the two do not overlap enough.
fn is_first_above(
    first: &Silhouette<'_>,
    second: &Silhouette<'_>,
    shot: &Shot,
    iou: f64,
) -> Option<bool> {
    let center = overlap_center(&first.region, &second.region, iou)?;
    let ideal = shot.distortion().undistort(center);
    Some(is_above(first.card, second.card, &shot.camera, ideal))
}

/// Whether, of two cards that meet at a pixel position, the first is at least as near.
fn is_above(first: &Card, second: &Card, camera: &Camera, px: Point2<f64>) -> bool {
    first.inverse_depth(camera, px) >= second.inverse_depth(camera, px)
}

/// The objects of cyclic overlaps: each covers itself through others (A over B over C over A).
pub fn cyclic_overlaps(objects: &[ObjectLabel]) -> Vec<ObjectId> {
    objects
        .iter()
        .map(|o| o.id)
        .filter(|&id| all_above(objects, id).contains(&id))
        .collect()
}

/// Everything that covers an object, directly or through others.
fn all_above(objects: &[ObjectLabel], id: ObjectId) -> BTreeSet<ObjectId> {
    let mut found = BTreeSet::new();
    let mut next = vec![id];
    while let Some(below) = next.pop() {
        let over = directly_above(objects, below);
        next.extend(over.filter(|&id| found.insert(id)).collect::<Vec<_>>());
    }
    found
}

fn directly_above(objects: &[ObjectLabel], id: ObjectId) -> impl Iterator<Item = ObjectId> {
    let below = objects.iter().filter(move |o| o.id == id);
    below.flat_map(|o| &o.covered_by).copied()
}

/// Centroid of the overlap of a pair; none if they are not a pair.
fn overlap_center(a: &MultiPolygon<f64>, b: &MultiPolygon<f64>, iou: f64) -> Option<Point2<f64>> {
    let shared = overlap(a, b);
    let area = shared.unsigned_area();
    let union = a.unsigned_area() + b.unsigned_area() - area;
    let center = shared.centroid()?;
    (area > iou * union).then(|| Point2::new(center.x(), center.y()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objects(covered_by: &[&[u32]]) -> Vec<ObjectLabel> {
        let object = |(i, over): (usize, &&[u32])| ObjectLabel {
            id: ObjectId(i as u32 + 1),
            covered_by: over.iter().map(|&id| ObjectId(id)).collect(),
            ..ObjectLabel::default()
        };
        covered_by.iter().enumerate().map(object).collect()
    }

    #[test]
    fn what_lies_between_two_circles_is_in_none() {
        // 1 over 2 over 3 over 1; 4 under that circle; 5 over 6 over 5 under 4.
        let all = objects(&[&[3], &[1], &[2], &[1], &[4, 6], &[5]]);
        assert_eq!(cyclic_overlaps(&all), [1, 2, 3, 5, 6].map(ObjectId));
    }

    #[test]
    fn a_stack_has_no_knot_even_if_an_object_above_is_not_in_the_picture() {
        assert!(cyclic_overlaps(&objects(&[&[2, 3], &[3, 99], &[]])).is_empty());
    }
}
