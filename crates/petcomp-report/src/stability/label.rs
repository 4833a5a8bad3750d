//! Objects that are hard to label: one pixel large, hidden, cut by the border, hundreds in one
//! pixel, none.

use super::staged::{camera_above, card, grey, level_card, one_deep_pixel, rendered, tilted};
use super::{HardCase, Outcome};
use petcomp::geom::{BBox, Point2};
use petcomp::label::{AmodalBox, LabelOptions, ObjectLabel, RleMask, label};
use petcomp::scene::{Card, Shot};
use petcomp::{DeepSample, Depth, Image, LinearRgb, ObjectId, PremulRgba, Result};
use std::f64::consts::FRAC_PI_2;

/// Objects in one pixel, or in one stack.
const CROWD_SIZE: u32 = 300;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let groups = [small_objects(), covered_and_cut(), awkward_objects()];
    Ok(groups.into_iter().flatten().collect())
}

fn small_objects() -> Vec<HardCase> {
    vec![
        HardCase::new("no object", "a picture of 64 x 48", "no label: 0", || {
            Ok(Outcome::none(labels_of([64, 48], []).len(), "labels"))
        }),
        HardCase::new(
            "object of one pixel",
            "only pixel (3, 2)",
            "box [3, 2] to [4, 3], area 1, fully visible",
            label_one_pixel,
        ),
        HardCase::new(
            "object of a hundredth of a pixel",
            "a card of 1 x 1 mm at 10 mm per pixel",
            "below the threshold of 0.1 in every pixel: no label, 0",
            label_tiny_object,
        ),
        HardCase::new(
            "300 objects in one pixel",
            "opaque, each behind the one before it",
            "300 labels of that pixel; only the first is visible; the shares sum to 1",
            || Ok(label_many_in_a_pixel()),
        ),
    ]
}

fn covered_and_cut() -> Vec<HardCase> {
    vec![
        HardCase::new(
            "object that is completely hidden",
            "an opaque card under a larger one",
            "a label with its whole box, visible share 0, occluded by the other card",
            label_hidden_object,
        ),
        HardCase::new(
            "object cut by the corner of the picture",
            "an opaque card of 20 x 20 px, its middle on the corner [64, 48]",
            "box and outline inside the picture: a quarter, 100 px, to one row and column",
            label_cut_object,
        ),
        HardCase::new(
            "object larger than the picture",
            "an opaque card 1 km across",
            "the picture's own box and all its 3072 pixels",
            label_large_object,
        ),
        HardCase::new(
            "one-pixel image",
            "1 x 1 pixel, an opaque card over it",
            "box [0, 0] to [1, 1], 1 px",
            label_one_pixel_picture,
        ),
    ]
}

fn awkward_objects() -> Vec<HardCase> {
    vec![
        HardCase::new(
            "invisible objects",
            "a card edge-on, one behind the camera, one 3 m away",
            "no label: 0",
            label_out_of_sight,
        ),
        HardCase::new(
            "outline without an area",
            "no corner, one, two, three collinear ones, one with NaN",
            "still the box of the mask, no outline: 5 of 5",
            label_broken_outlines,
        ),
        HardCase::new(
            "stack of 300 cards",
            "equal opaque cards, each 1 mm above the one before",
            "299 covered, the last on top; visible pixels sum to those of one card",
            label_deep_stack,
        ),
        HardCase::new(
            "mask of 16384 x 16384 pixels",
            "every pixel of every other column",
            "2^27 pixels, the whole box except the last column, in 16385 runs",
            || Ok(count_mask_of_16k()),
        )
        .for_the_report(),
        HardCase::new(
            "coverage at the threshold",
            "a pixel covered by exactly 0.1, and one by the next number above it",
            "a pixel counts only above the threshold: 0 and 1 labels",
            label_at_the_threshold,
        ),
    ]
}

/// A picture in which a card at height 0 has 100 pixels per metre.
fn shot_of(image: [u32; 2], cards: impl IntoIterator<Item = Card>) -> Shot {
    let empty = Shot::new(camera_above(image, 100.0));
    cards.into_iter().fold(empty, Shot::with_card)
}

fn labels_of(image: [u32; 2], cards: impl IntoIterator<Item = Card>) -> Vec<ObjectLabel> {
    let shot = shot_of(image, cards);
    label(&rendered(&shot), &shot, &LabelOptions::default()).objects
}

/// The labels of a shot of cards in which pixel (3, 2) alone has samples, front to back, one for
/// each card.
fn labels_of_one_pixel(samples: &[DeepSample]) -> Vec<ObjectLabel> {
    let cards = samples
        .iter()
        .map(|s| opaque_card(s.object.0, [0.0; 3], 0.01));
    let shot = shot_of([8, 6], cards);
    let deep = one_deep_pixel([8, 6], samples);
    label(&deep, &shot, &LabelOptions::default()).objects
}

fn dark_sample(id: u32, alpha: f32, visible: f32) -> DeepSample {
    DeepSample {
        object: ObjectId(id),
        depth: Depth(1.0),
        light: LinearRgb::BLACK,
        alpha,
        visible,
    }
}

fn opaque_card(id: u32, center: [f64; 3], size: f64) -> Card {
    level_card(id, center, size, grey(1.0))
}

/// The box of a whole picture.
fn whole_box([w, h]: [f64; 2]) -> BBox {
    BBox {
        x0: 0.0,
        y0: 0.0,
        x1: w,
        y1: h,
    }
}

/// Whether a width is about as expected: the window of a pixel is three wide, and counts if it
/// covers more than a tenth.
fn is_about(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 2.0
}

/// The box of pixel (3, 2).
const PIXEL_BOX: BBox = BBox {
    x0: 3.0,
    y0: 2.0,
    x1: 4.0,
    y1: 3.0,
};

fn label_one_pixel() -> Result<Outcome> {
    let found = labels_of_one_pixel(&[dark_sample(1, 1.0, 1.0)]);
    Ok(only_object(&found, |o| {
        o.amodal_box == PIXEL_BOX
            && o.visible_box == PIXEL_BOX
            && o.amodal_mask.area() == 1
            && o.visible_fraction == 1.0
    }))
}

/// The outcome for the only object, if it is the only one and correct.
fn only_object(objects: &[ObjectLabel], is_right: impl Fn(&ObjectLabel) -> bool) -> Outcome {
    let [one] = objects else {
        return Outcome::failed(format!("{} labels", objects.len()));
    };
    let BBox { x0, y0, x1, y1 } = one.amodal_box;
    let (area, seen) = (one.amodal_mask.area(), one.visible_fraction);
    Outcome::new(
        format!("[{x0}, {y0}] to [{x1}, {y1}], {area} px, visible {seen:.4}"),
        is_right(one),
    )
}

fn label_tiny_object() -> Result<Outcome> {
    let found = labels_of([64, 48], [opaque_card(1, [0.0; 3], 0.001)]);
    Ok(Outcome::none(found.len(), "labels"))
}

fn label_many_in_a_pixel() -> Outcome {
    // Opaque, one behind another.
    let crowd = (1..=CROWD_SIZE).map(|id| dark_sample(id, 1.0, if id == 1 { 1.0 } else { 0.0 }));
    let found = labels_of_one_pixel(&crowd.collect::<Vec<_>>());
    let seen: f64 = found.iter().map(|o| o.visible_fraction).sum();
    let boxed = found.iter().filter(|o| is_boxed_rightly(o)).count();
    let labels = found.len();
    Outcome::new(
        format!("{labels} labels, {boxed} correct boxes, {seen} visible"),
        labels == CROWD_SIZE as usize && boxed == labels && seen == 1.0,
    )
}

/// Whether its box is the pixel, of which only the first object is visible.
fn is_boxed_rightly(object: &ObjectLabel) -> bool {
    object.amodal_box == PIXEL_BOX && object.visible_box.is_empty() == (object.id.0 > 1)
}

fn label_hidden_object() -> Result<Outcome> {
    let below = opaque_card(1, [0.0; 3], 0.1);
    let above = opaque_card(2, [0.0, 0.0, 0.05], 0.3);
    let mut found = labels_of([64, 48], [below, above]);
    found.retain(|o| o.id == ObjectId(1));
    Ok(only_object(&found, is_hidden_by_2))
}

/// Whether it is 10 px wide and entirely hidden.
fn is_hidden_by_2(object: &ObjectLabel) -> bool {
    object.visible_fraction == 0.0
        && object.visible_box.is_empty()
        && object.covered_by == [ObjectId(2)]
        && is_about(object.amodal_box.width(), 10.0)
}

fn label_cut_object() -> Result<Outcome> {
    let found = labels_of([64, 48], [opaque_card(1, [0.32, -0.24, 0.0], 0.2)]);
    Ok(only_object(&found, |o| {
        is_in_the_corner(&o.amodal_box) && o.outline_px.iter().flatten().all(is_in_the_picture)
    }))
}

fn is_in_the_corner(found: &BBox) -> bool {
    [found.x1, found.y1] == [64.0, 48.0]
        && (found.x0 - 54.0).abs() <= 1.0
        && (found.y0 - 38.0).abs() <= 1.0
}

fn is_in_the_picture(p: &Point2<f64>) -> bool {
    (0.0..=64.0).contains(&p.x) && (0.0..=48.0).contains(&p.y)
}

fn label_large_object() -> Result<Outcome> {
    let found = labels_of([64, 48], [opaque_card(1, [0.0; 3], 1000.0)]);
    Ok(only_object(&found, |o| {
        o.amodal_box == whole_box([64.0, 48.0])
            && o.amodal_mask.area() == 64 * 48
            && o.visible_fraction == 1.0
    }))
}

fn label_one_pixel_picture() -> Result<Outcome> {
    let found = labels_of([1, 1], [opaque_card(1, [0.0; 3], 0.5)]);
    Ok(only_object(&found, |o| {
        o.amodal_box == whole_box([1.0, 1.0]) && o.amodal_mask.area() == 1
    }))
}

fn label_out_of_sight() -> Result<Outcome> {
    let shot = shot_out_of_sight();
    let deep = rendered(&shot);
    let labels = [AmodalBox::Mask, AmodalBox::Outline].map(|amodal| {
        let options = LabelOptions {
            amodal,
            ..LabelOptions::default()
        };
        label(&deep, &shot, &options).objects.len()
    });
    Ok(Outcome::none(labels.iter().sum(), "labels"))
}

fn shot_out_of_sight() -> Shot {
    let texture = Image::<PremulRgba>::filled(8, 8, grey(1.0));
    let edge_on = card(1, [0.0, 0.0, 0.5], tilted(FRAC_PI_2), [0.2; 2], texture);
    let behind = opaque_card(2, [0.0, 0.0, 2.0], 0.2);
    let far_away = opaque_card(3, [3.0, 0.0, 0.0], 0.2);
    shot_of([64, 48], [edge_on, behind, far_away])
}

/// Outlines without area.
const BROKEN_OUTLINES: [&[[f64; 2]]; 5] = [
    &[],
    &[[0.5, 0.5]],
    &[[0.0, 0.0], [1.0, 1.0]],
    &[[0.2, 0.2], [0.4, 0.4], [0.8, 0.8]],
    &[[f64::NAN, 0.0], [1.0, 0.0], [1.0, 1.0]],
];

fn label_broken_outlines() -> Result<Outcome> {
    let right = BROKEN_OUTLINES.iter().filter(|o| is_boxed_by_mask(o));
    Ok(Outcome::count(right.count(), 5, "right"))
}

fn is_boxed_by_mask(outline: &[[f64; 2]]) -> bool {
    let card = Card {
        outline_uv: outline.iter().map(|&uv| uv.into()).collect(),
        ..opaque_card(1, [0.0; 3], 0.2)
    };
    let found = labels_of([64, 48], [card]);
    matches!(&found[..], [o] if o.outline_px.is_empty() && is_about(o.amodal_box.width(), 20.0))
}

fn label_deep_stack() -> Result<Outcome> {
    let cards = (1..=CROWD_SIZE).map(|id| opaque_card(id, [0.0, 0.0, 0.001 * f64::from(id)], 0.1));
    let found = labels_of([64, 48], cards);
    let topmost = found.iter().filter(|o| o.is_topmost());
    let tops: Vec<u32> = topmost.map(|o| o.id.0).collect();
    let right = found.iter().filter(|o| is_under_all_above(o)).count();
    Ok(Outcome::new(
        format!("on top {tops:?}, {right} covered by all above them"),
        tops == [CROWD_SIZE] && right == CROWD_SIZE as usize,
    ))
}

fn is_under_all_above(object: &ObjectLabel) -> bool {
    object.covered_by.len() == (CROWD_SIZE - object.id.0) as usize
}

/// Pixels along a side of the largest mask.
const LARGEST_SIDE_PX: u32 = 16_384;

fn count_mask_of_16k() -> Outcome {
    let mask = RleMask::from_fn([LARGEST_SIDE_PX; 2], |x, _| x.is_multiple_of(2));
    let side = f64::from(LARGEST_SIDE_PX);
    let (area, runs) = (mask.area(), mask.runs().len());
    let passed = area == 1 << 27
        && mask.bounds() == whole_box([side - 1.0, side])
        && runs == LARGEST_SIDE_PX as usize + 1;
    Outcome::new(format!("{area} px in {runs} runs"), passed)
}

fn label_at_the_threshold() -> Result<Outcome> {
    let threshold = LabelOptions::default().alpha_threshold;
    let [at, above] = [threshold, threshold.next_up()]
        .map(|alpha| labels_of_one_pixel(&[dark_sample(1, alpha, alpha)]).len());
    let measured = format!("{at} and {above} labels");
    Ok(Outcome::new(measured, (at, above) == (0, 1)))
}
