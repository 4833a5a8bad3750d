//! Objects that are hard to label: one pixel large, hidden, cut by the border, hundreds in one pixel, none.

use super::staged::{above, card, grey, level, tilted};
use super::{HardCase, Outcome};
use petcomp::Image;
use petcomp::Result;
use petcomp::geom::BBox;
use petcomp::geom::Point2;
use petcomp::label::{AmodalBox, LabelOptions, Labels, ObjectLabel, RleMask, label};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{Card, Shot};
use petcomp::{DeepImage, DeepSample};
use petcomp::{Depth, LinearRgb, ObjectId, PremulRgba};
use std::f64::consts::FRAC_PI_2;

/// Objects in one pixel, or in one stack.
const MANY: u32 = 300;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    Ok(vec![
        empty(),
        of_one_pixel(),
        smaller_than_a_pixel(),
        many_in_a_pixel(),
        hidden(),
        cut_by_the_border(),
        larger_than_the_picture(),
        one_pixel_picture(),
        edge_on(),
        broken_outline(),
        deep_stack(),
        mask_of_16k(),
        threshold(),
    ])
}

/// A picture in which a card at height 0 shows 100 pixels a metre.
fn shot(image: [u32; 2], cards: impl IntoIterator<Item = Card>) -> Shot {
    cards
        .into_iter()
        .fold(Shot::new(above(image, 100.0)), Shot::with_card)
}

fn labelled(shot: &Shot) -> Labels {
    label(
        &render(shot, &RenderOptions::default()),
        shot,
        &LabelOptions::default(),
    )
}

/// A picture of `size` in which pixel (3, 2) alone has samples, front to back.
fn one_place(size: [u32; 2], samples: Vec<DeepSample>) -> DeepImage {
    let [w, h] = size.map(|side| side as usize);
    let pixels = (0..w * h).map(|i| {
        if i == 2 * w + 3 {
            samples.clone()
        } else {
            Vec::new()
        }
    });
    DeepImage::from_pixels(Image::filled(w, h, LinearRgb::WHITE), pixels)
}

fn sample(id: u32, alpha: f32, visible: f32) -> DeepSample {
    DeepSample {
        object: ObjectId(id),
        depth: Depth(1.0),
        light: LinearRgb::BLACK,
        alpha,
        visible,
    }
}

fn opaque(id: u32, center: [f64; 3], size: f64) -> Card {
    level(id, center, size, grey(1.0))
}

fn empty() -> HardCase {
    HardCase::new("no object", "a picture of 64 x 48", "no label: 0", || {
        Ok(Outcome::near(
            labelled(&shot([64, 48], [])).objects.len() as f64,
            0.0,
            0.0,
            "labels",
        ))
    })
}

/// The box that pixel (3, 2) is.
const PLACE: BBox = BBox {
    x0: 3.0,
    y0: 2.0,
    x1: 4.0,
    y1: 3.0,
};

fn of_one_pixel() -> HardCase {
    HardCase::new(
        "object of one pixel",
        "pixel (3, 2) alone",
        "box [3, 2] to [4, 3], area 1, wholly seen",
        || {
            let shot = shot([8, 6], [opaque(1, [0.0; 3], 0.01)]);
            let found = label(
                &one_place([8, 6], vec![sample(1, 1.0, 1.0)]),
                &shot,
                &LabelOptions::default(),
            );
            Ok(told(&found.objects, |o| {
                o.amodal_box == PLACE
                    && o.visible_box == PLACE
                    && o.amodal_mask.area() == 1
                    && o.visible_fraction == 1.0
            }))
        },
    )
}

/// The only object there is, and whether it is as it must be.
fn told(objects: &[ObjectLabel], is_right: impl Fn(&ObjectLabel) -> bool) -> Outcome {
    match objects {
        [one] => {
            let BBox { x0, y0, x1, y1 } = one.amodal_box;
            let (area, seen) = (one.amodal_mask.area(), one.visible_fraction);
            Outcome::new(
                format!("[{x0}, {y0}] to [{x1}, {y1}], {area} px, seen {seen:.4}"),
                is_right(one),
            )
        }
        other => Outcome::new(format!("{} labels", other.len()), false),
    }
}

fn smaller_than_a_pixel() -> HardCase {
    HardCase::new(
        "object of a hundredth of a pixel",
        "a card of 1 x 1 mm where a pixel is 10 mm",
        "below the threshold of 0.1 in every pixel: no label, 0",
        || {
            Ok(Outcome::near(
                labelled(&shot([64, 48], [opaque(1, [0.0; 3], 0.001)]))
                    .objects
                    .len() as f64,
                0.0,
                0.0,
                "labels",
            ))
        },
    )
}

fn many_in_a_pixel() -> HardCase {
    HardCase::new(
        "300 objects in one pixel",
        "each opaque, each behind the one before it",
        "300 labels of that pixel; the first is seen, the others are not; shares sum to 1",
        || {
            let samples = (1..=MANY)
                .map(|id| sample(id, 1.0, if id == 1 { 1.0 } else { 0.0 }))
                .collect();
            let shot = shot([8, 6], (1..=MANY).map(|id| opaque(id, [0.0; 3], 0.01)));
            let found = label(&one_place([8, 6], samples), &shot, &LabelOptions::default()).objects;
            let seen: f64 = found.iter().map(|o| o.visible_fraction).sum();
            let boxed = found
                .iter()
                .filter(|o| o.amodal_box == PLACE && o.visible_box.is_empty() == (o.id.0 > 1))
                .count();
            let passed = found.len() == MANY as usize && boxed == found.len() && seen == 1.0;
            Ok(Outcome::new(
                format!("{} labels, {boxed} boxed rightly, {seen} seen", found.len()),
                passed,
            ))
        },
    )
}

fn hidden() -> HardCase {
    HardCase::new(
        "object that is wholly hidden",
        "an opaque card under a larger one",
        "a label with its whole box, nothing of it seen, covered by the other",
        || {
            let found = labelled(&shot(
                [64, 48],
                [opaque(1, [0.0; 3], 0.1), opaque(2, [0.0, 0.0, 0.05], 0.3)],
            ))
            .objects;
            let below: Vec<_> = found.into_iter().filter(|o| o.id == ObjectId(1)).collect();
            // 10 px across; the window of a pixel is three wide, and counts where it covers more than a tenth.
            Ok(told(&below, |o| {
                o.visible_fraction == 0.0
                    && o.visible_box.is_empty()
                    && o.covered_by == [ObjectId(2)]
                    && (o.amodal_box.width() - 10.0).abs() <= 2.0
            }))
        },
    )
}

fn cut_by_the_border() -> HardCase {
    HardCase::new(
        "object cut by the corner of the picture",
        "an opaque card of 20 x 20 px, its middle on the corner [64, 48]",
        "box and outline within the picture: a quarter, 100 px to one row and column",
        || {
            let found = labelled(&shot([64, 48], [opaque(1, [0.32, -0.24, 0.0], 0.2)])).objects;
            let within =
                |p: &Point2<f64>| (0.0..=64.0).contains(&p.x) && (0.0..=48.0).contains(&p.y);
            Ok(told(&found, |o| {
                let BBox { x0, y0, x1, y1 } = o.amodal_box;
                [x1, y1] == [64.0, 48.0]
                    && (x0 - 54.0).abs() <= 1.0
                    && (y0 - 38.0).abs() <= 1.0
                    && o.outline_px.iter().flatten().all(within)
            }))
        },
    )
}

fn larger_than_the_picture() -> HardCase {
    HardCase::new(
        "object larger than the picture",
        "an opaque card 1 km across",
        "the picture's own box and all its 3072 pixels",
        || {
            let found = labelled(&shot([64, 48], [opaque(1, [0.0; 3], 1000.0)])).objects;
            let whole = BBox {
                x0: 0.0,
                y0: 0.0,
                x1: 64.0,
                y1: 48.0,
            };
            Ok(told(&found, |o| {
                o.amodal_box == whole
                    && o.amodal_mask.area() == 64 * 48
                    && o.visible_fraction == 1.0
            }))
        },
    )
}

fn one_pixel_picture() -> HardCase {
    HardCase::new(
        "one-pixel image",
        "1 x 1 pixel, an opaque card over it",
        "box [0, 0] to [1, 1], 1 px",
        || {
            let found = labelled(&shot([1, 1], [opaque(1, [0.0; 3], 0.5)])).objects;
            let whole = BBox {
                x0: 0.0,
                y0: 0.0,
                x1: 1.0,
                y1: 1.0,
            };
            Ok(told(&found, |o| {
                o.amodal_box == whole && o.amodal_mask.area() == 1
            }))
        },
    )
}

fn edge_on() -> HardCase {
    HardCase::new(
        "objects out of sight",
        "a card edge-on, one behind the camera, one 3 m away",
        "no label: 0",
        || {
            let texture = || Image::<PremulRgba>::filled(8, 8, grey(1.0));
            let edge_on = card(1, [0.0, 0.0, 0.5], tilted(FRAC_PI_2), [0.2; 2], texture());
            let shot = shot(
                [64, 48],
                [
                    edge_on,
                    opaque(2, [0.0, 0.0, 2.0], 0.2),
                    opaque(3, [3.0, 0.0, 0.0], 0.2),
                ],
            );
            let deep = render(&shot, &RenderOptions::default());
            let around = |amodal| {
                label(
                    &deep,
                    &shot,
                    &LabelOptions {
                        amodal,
                        ..LabelOptions::default()
                    },
                )
                .objects
                .len()
            };
            let found = around(AmodalBox::Mask) + around(AmodalBox::Outline);
            Ok(Outcome::near(found as f64, 0.0, 0.0, "labels"))
        },
    )
}

fn broken_outline() -> HardCase {
    HardCase::new(
        "outline that is none",
        "no corner, one, two, three on a line, one of NaN",
        "the box of the mask all the same, no outline: 5 of 5",
        || {
            let outlines: [&[[f64; 2]]; 5] = [
                &[],
                &[[0.5, 0.5]],
                &[[0.0, 0.0], [1.0, 1.0]],
                &[[0.2, 0.2], [0.4, 0.4], [0.8, 0.8]],
                &[[f64::NAN, 0.0], [1.0, 0.0], [1.0, 1.0]],
            ];
            let right = |outline: &&[[f64; 2]]| {
                let outline_uv = outline.iter().map(|&uv| uv.into()).collect();
                let found = labelled(&shot(
                    [64, 48],
                    [Card {
                        outline_uv,
                        ..opaque(1, [0.0; 3], 0.2)
                    }],
                ))
                .objects;
                matches!(&found[..], [o] if o.outline_px.is_empty() && (o.amodal_box.width() - 20.0).abs() <= 2.0)
            };
            Ok(Outcome::near(
                outlines.iter().filter(|o| right(o)).count() as f64,
                5.0,
                0.0,
                "right",
            ))
        },
    )
}

fn deep_stack() -> HardCase {
    HardCase::new(
        "300 cards in a stack",
        "equal opaque cards, each 1 mm above the one before",
        "299 covered, the last on top; visible pixels sum to those of one card",
        || {
            let cards = (1..=MANY).map(|id| opaque(id, [0.0, 0.0, 0.001 * f64::from(id)], 0.1));
            let found = labelled(&shot([64, 48], cards)).objects;
            let tops: Vec<u32> = found
                .iter()
                .filter(|o| o.is_topmost())
                .map(|o| o.id.0)
                .collect();
            let right = found
                .iter()
                .filter(|o| o.covered_by.len() == (MANY - o.id.0) as usize)
                .count();
            let passed = tops == [MANY] && right == MANY as usize;
            Ok(Outcome::new(
                format!("on top {tops:?}, {right} covered by all above them"),
                passed,
            ))
        },
    )
}

fn mask_of_16k() -> HardCase {
    const SIDE: u32 = 16_384;
    HardCase::new(
        "mask of 16384 x 16384 pixels",
        "every pixel of every other column",
        "2^27 pixels, the whole box but the last column, in 16385 runs",
        || {
            let mask = RleMask::from_fn([SIDE; 2], |x, _| x.is_multiple_of(2));
            let bounds = mask.bounds();
            let passed = mask.area() == 1 << 27
                && [bounds.x0, bounds.y0, bounds.x1, bounds.y1]
                    == [0.0, 0.0, f64::from(SIDE) - 1.0, f64::from(SIDE)]
                && mask.runs().len() == SIDE as usize + 1;
            Ok(Outcome::new(
                format!("{} px in {} runs", mask.area(), mask.runs().len()),
                passed,
            ))
        },
    )
    .for_the_report()
}

fn threshold() -> HardCase {
    HardCase::new(
        "coverage at the threshold",
        "a pixel covered by exactly 0.1, and one by the next number above it",
        "a pixel belongs when it is covered by more: 0 and 1 labels",
        || {
            let count = |alpha: f32| {
                let shot = shot([8, 6], [opaque(1, [0.0; 3], 0.01)]);
                label(
                    &one_place([8, 6], vec![sample(1, alpha, alpha)]),
                    &shot,
                    &LabelOptions::default(),
                )
                .objects
                .len()
            };
            let least = LabelOptions::default().alpha_threshold;
            let found = [count(least), count(least.next_up())];
            Ok(Outcome::new(
                format!("{} and {} labels", found[0], found[1]),
                found == [0, 1],
            ))
        },
    )
}
