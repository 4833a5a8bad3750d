//! Laws of labels, against pictures cast by brute force: many rays a pixel, no code shared with the
//! library's renderer.

#![cfg(feature = "pipeline")]

use geo::Contains;
use petcomp::camera::Camera;
use petcomp::geom::{BBox, Point2, Pose, Quad, UnitQuaternion, Vector2, Vector3, doubled_area};
use petcomp::label::{
    AmodalBox, DepthRange, LabelOptions, Labels, ObjectLabel, ObstructionRule, OutlineKind,
    cyclic_overlaps, label,
};
use petcomp::scene::{Card, View};
use petcomp::{DeepImage, DeepSample};
use petcomp::{Depth, Image, LinearRgb, ObjectId, PremulRgba, Shot};
use proptest::prelude::*;

/// Rays along each side of a pixel; a pixel's coverage is then known to within 1 / RAYS.
const RAYS: usize = 8;

/// What a few rays may find where two outlines share less than a hundredth of a pixel: they only
/// touch, pixels.
const TOUCHED: f64 = 4.0 / (RAYS * RAYS) as f64;

const IMAGE: [u32; 2] = [96, 72];

/// A camera one metre above the surface that looks straight down.
fn camera() -> Camera {
    Camera::looking_down(1.0, 100.0, IMAGE)
}

fn card(id: u32, center: [f64; 3], angles: [f64; 3], size: [f64; 2], outline: &[[f64; 2]]) -> Card {
    let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
    let quad = Quad {
        world_from_card: Pose::from_parts(Vector3::from(center).into(), rotation),
        size,
    };
    let texture = Image::filled(2, 2, PremulRgba::new(0.5, 0.5, 0.5, 1.0));
    Card {
        class: Some(id % 4),
        outline_uv: outline.iter().map(|&[u, v]| Point2::new(u, v)).collect(),
        ..Card::new(ObjectId(id), quad, texture)
    }
}

const WHOLE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// Casts opaque cards, each as far as its outline reaches.
fn cast(shot: &Shot) -> DeepImage {
    let outlines: Vec<_> = shot.cards.iter().map(polygon).collect();
    let [w, h] = shot.camera.image.map(|n| n as usize);
    let pixels = (0..w * h).map(|i| pixel(shot, &outlines, (i % w) as f64, (i / w) as f64));
    DeepImage::from_pixels(Image::filled(w, h, LinearRgb::WHITE), pixels)
}

fn polygon(card: &Card) -> geo::Polygon<f64> {
    let ring: Vec<_> = card.outline_uv.iter().map(|p| (p.x, p.y)).collect();
    geo::Polygon::new(ring.into(), Vec::new())
}

fn pixel(shot: &Shot, outlines: &[geo::Polygon<f64>], x: f64, y: f64) -> Vec<DeepSample> {
    let share = 1.0 / (RAYS * RAYS) as f32;
    let mut samples: Vec<DeepSample> = Vec::new();
    for i in 0..RAYS * RAYS {
        let offset = |k: usize| (k as f64 + 0.5) / RAYS as f64;
        let ray = shot
            .camera
            .ray(Point2::new(x + offset(i % RAYS), y + offset(i / RAYS)));
        let hits = shot
            .cards
            .iter()
            .zip(outlines)
            .filter_map(|(card, outline)| {
                let (t, uv) = card.quad.intersect(&ray)?;
                outline
                    .contains(&geo::Point::new(uv.x, uv.y))
                    .then_some((t, card.id))
            });
        let mut hits: Vec<_> = hits.collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (order, &(t, object)) in hits.iter().enumerate() {
            let k = samples
                .iter()
                .position(|s| s.object == object)
                .unwrap_or(samples.len());
            if k == samples.len() {
                samples.push(DeepSample {
                    object,
                    depth: Depth(t as f32),
                    ..DeepSample::default()
                });
            }
            samples[k].alpha += share;
            samples[k].visible += if order == 0 { share } else { 0.0 };
        }
    }
    samples.sort_by(|a, b| a.depth.0.total_cmp(&b.depth.0));
    samples
}

fn shot(cards: impl IntoIterator<Item = Card>) -> Shot {
    cards.into_iter().fold(Shot::new(camera()), Shot::with_card)
}

fn labels(shot: &Shot, options: &LabelOptions) -> Labels {
    label(&cast(shot), shot, options)
}

/// A card with a convex outline, wherever it may be, at any angle.
fn any_card(id: u32) -> impl Strategy<Value = Card> {
    let place = prop::array::uniform3(-0.4..0.4_f64);
    let angles = prop::array::uniform3(-1.2..1.2_f64);
    let size = prop::array::uniform2(0.05..0.4_f64);
    (place, angles, size, 3_usize..9).prop_map(move |([x, y, z], angles, size, corners)| {
        card(id, [x, y, z + 0.2], angles, size, &round(corners))
    })
}

/// A tilted card that is too small to reach into the heights of the others.
fn apart(id: u32) -> impl Strategy<Value = Card> {
    let place = (-0.2..0.2_f64, -0.2..0.2_f64);
    (
        place,
        prop::array::uniform3(-1.2..1.2_f64),
        prop::array::uniform2(0.05..0.15_f64),
        3_usize..9,
    )
        .prop_map(move |((x, y), angles, size, n)| {
            card(
                id,
                [x, y, 0.22 * f64::from(id - 1)],
                angles,
                size,
                &round(n),
            )
        })
}

/// A regular polygon that fills the card's texture.
fn round(corners: usize) -> Vec<[f64; 2]> {
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / corners as f64;
    (0..corners)
        .map(|i| [0.5 + 0.5 * angle(i).cos(), 0.5 + 0.5 * angle(i).sin()])
        .collect()
}

/// A card that lies flat at height `z`.
fn flat_card(id: u32) -> impl Strategy<Value = Card> {
    let place = prop::array::uniform2(-0.4..0.4_f64);
    (
        place,
        -3.2..3.2_f64,
        prop::array::uniform2(0.05..0.3_f64),
        3_usize..9,
    )
        .prop_map(move |([x, y], turn, size, n)| {
            card(
                id,
                [x, y, 0.01 * f64::from(id)],
                [0.0, 0.0, turn],
                size,
                &round(n),
            )
        })
}

fn area(rings: &[Vec<Point2<f64>>]) -> f64 {
    let areas = rings.iter().map(|ring| 0.5 * doubled_area(ring).abs());
    areas.sum()
}

/// How far a convex outline may reach beyond the outermost pixels that rays hit, pixels.
///
/// Rays hit every disc of radius `r = 1 / (sqrt(2) RAYS)`. The outline holds a disc of radius area
/// / perimeter, so shrunk towards any of its points it holds one of radius `r`, as much nearer to
/// that point as it is smaller.
fn missed(object: &ObjectLabel) -> f64 {
    let b = &object.amodal_box;
    let radius = 1.0 / (std::f64::consts::SQRT_2 * RAYS as f64);
    let perimeter = 2.0 * (b.width() + b.height());
    radius * perimeter * b.width().hypot(b.height()) / area(&object.outline_px)
}

fn off(a: &BBox, b: &BBox) -> f64 {
    [a.x0 - b.x0, a.y0 - b.y0, a.x1 - b.x1, a.y1 - b.y1]
        .into_iter()
        .map(f64::abs)
        .fold(0.0, f64::max)
}

/// Coverage of an object and the box around every pixel of which it covers more than `least`.
fn raster(deep: &DeepImage, id: u32, least: f32) -> (f64, BBox) {
    let mut sum = 0.0;
    let mut dots = Vec::new();
    for (x, y) in (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y))) {
        for s in deep.at(x, y).iter().filter(|s| s.object == ObjectId(id)) {
            sum += f64::from(s.alpha);
            if s.alpha <= least {
                continue;
            }
            dots.extend([
                Point2::new(x as f64, y as f64),
                Point2::new(x as f64 + 1.0, y as f64 + 1.0),
            ]);
        }
    }
    (sum, BBox::around(dots))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_visible_box_lies_in_the_amodal_box_and_fractions_in_0_to_1(cards in [any_card(1), any_card(2), any_card(3)]) {
        for object in labels(&shot(cards), &LabelOptions::default()).objects {
            prop_assert!(object.amodal_box.contains(&object.visible_box));
            prop_assert!((0.0..=1.0).contains(&object.visible_fraction));
            let [w, h] = IMAGE.map(f64::from);
            let picture = BBox { x0: 0.0, y0: 0.0, x1: w, y1: h };
            prop_assert!(picture.contains(&object.amodal_box) && !object.amodal_box.is_empty());
            prop_assert!(object.outline_px.iter().flatten().all(|p| (0.0..=w).contains(&p.x) && (0.0..=h).contains(&p.y)));
        }
    }

    #[test]
    fn an_amodal_box_is_that_of_the_mask_rendered_alone(cards in [any_card(1), any_card(2)]) {
        let options = LabelOptions::default();
        let found = labels(&shot(cards.clone()), &options);
        for one in cards {
            let (_, alone) = raster(&cast(&shot([one.clone()])), one.id.0, options.alpha_threshold);
            let object = found.objects.iter().find(|o| o.id == one.id);
            prop_assert_eq!(object.map_or_else(BBox::default, |o| o.amodal_box), alone);
        }
    }

    #[test]
    fn an_outline_encloses_what_a_raster_counts(one in any_card(1)) {
        let scene = shot([one]);
        let deep = cast(&scene);
        let options = LabelOptions { amodal: AmodalBox::Outline, ..LabelOptions::default() };
        let (counted, around) = raster(&deep, 1, 0.0);
        for object in label(&deep, &scene, &options).objects {
            // Each ray stands for 1/64 of a pixel; the outline's border of length L crosses about 2 L RAYS of them, and
            // rounds up and down alike: half a ray's width along the border bounds the error.
            let border = 2.0 * (object.amodal_box.width() + object.amodal_box.height());
            prop_assert!((area(&object.outline_px) - counted).abs() <= 0.5 * border / RAYS as f64 + 0.1);
            prop_assert!(around.is_empty() || off(&object.amodal_box, &around) <= 1.0 + missed(&object));
        }
    }

    #[test]
    fn the_higher_of_two_flat_cards_that_share_pixels_lies_over_the_other(cards in [flat_card(1), flat_card(2)]) {
        let scene = shot(cards);
        let deep = cast(&scene);
        let pixels = (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y)));
        let hidden: f32 = pixels.flat_map(|(x, y)| deep.at(x, y)).map(|s| s.alpha - s.visible).sum();
        let shared = f64::from(hidden) > TOUCHED;
        let found = label(&deep, &scene, &LabelOptions::default());
        let covered = |id: u32| found.objects.iter().find(|o| o.id == ObjectId(id)).map(|o| o.covered_by.clone());
        if let (Some(low), Some(high)) = (covered(1), covered(2)) {
            prop_assert!(high.is_empty());
            // Rays miss an overlap thinner than their distance, never the other way round.
            prop_assert!(!shared || low == [ObjectId(2)]);
        }
    }

    #[test]
    fn a_topmost_opaque_card_is_seen_whole(cards in [apart(1), apart(2), apart(3), apart(4)]) {
        let deep = cast(&shot(cards.clone()));
        let whole = |id: u32| raster(&deep, id, 0.0).0;
        for object in labels(&shot(cards), &LabelOptions::default()).objects.iter().filter(|o| o.is_topmost()) {
            let hidden = (1.0 - object.visible_fraction) * whole(object.id.0);
            // Each of the others may touch it.
            prop_assert!(hidden <= 3.0 * TOUCHED, "{object:?}");
        }
    }

    #[test]
    fn the_threshold_on_the_overlap_is_the_iou_of_the_rasters(cards in [flat_card(1), flat_card(2)]) {
        let scene = shot(cards);
        let deep = cast(&scene);
        let (mut shared, mut all) = (0.0, 0.0);
        for (x, y) in (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y))) {
            let samples = deep.at(x, y);
            shared += samples.iter().map(|s| f64::from(s.alpha - s.visible)).sum::<f64>();
            all += samples.iter().map(|s| f64::from(s.visible)).sum::<f64>();
        }
        let iou: f64 = if all > 0.0 { shared / all } else { 0.0 };
        let covered_at = |iou| {
            let obstruction = ObstructionRule::Overlap { overlap_iou: iou };
            let options = LabelOptions { obstruction, ..LabelOptions::default() };
            label(&deep, &scene, &options).objects.iter().any(|o| !o.is_topmost())
        };
        // A raster of 8 x 8 rays a pixel knows the area of shapes of this size to a few percent.
        prop_assert!(iou < 0.02 || covered_at(0.9 * iou - 0.01));
        prop_assert!(!covered_at(1.1 * iou + 0.01));
    }
}

#[test]
fn three_cards_that_lie_over_each_other_in_a_circle_are_a_knot() {
    // Like the flaps of a carton: each card is tilted about its long side, over the next, under the
    // one before.
    let flap = |id: u32| {
        let turn = std::f64::consts::TAU / 3.0 * f64::from(id);
        let spin = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let along = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.3);
        let mut flap = card(id, [0.0; 3], [0.0; 3], [0.5, 0.06], &WHOLE);
        flap.quad.world_from_card =
            Pose::from_parts((spin * Vector3::new(0.0, 0.1, 0.1)).into(), spin * along);
        flap
    };
    let found = labels(&shot([1, 2, 3].map(flap)), &LabelOptions::default());
    assert_eq!(found.objects.len(), 3);
    assert!(
        found.objects.iter().all(|o| o.covered_by.len() == 1),
        "{:?}",
        found.objects
    );
    assert_eq!(cyclic_overlaps(&found.objects), [1, 2, 3].map(ObjectId));
}

#[test]
fn a_stack_is_no_knot() {
    let stack = [1, 2, 3].map(|id| {
        card(
            id,
            [0.0, 0.0, 0.1 * f64::from(id)],
            [0.0; 3],
            [0.2; 2],
            &WHOLE,
        )
    });
    let found = labels(&shot(stack), &LabelOptions::default());
    assert_eq!(found.objects[0].covered_by, [ObjectId(2), ObjectId(3)]);
    assert!(found.objects[2].is_topmost() && cyclic_overlaps(&found.objects).is_empty());
}

#[test]
fn a_tilted_card_is_compared_where_the_two_overlap() {
    // Card 1 is lower at its centre than card 2, but its raised end is above card 2, and there they
    // overlap.
    let tilted = card(1, [0.0, 0.0, 0.1], [0.0, -0.5, 0.0], [0.6, 0.1], &WHOLE);
    let small = card(2, [0.2, 0.0, 0.15], [0.0; 3], [0.1; 2], &WHOLE);
    let found = labels(&shot([tilted, small]), &LabelOptions::default());
    assert!(found.objects[0].is_topmost());
    assert_eq!(found.objects[1].covered_by, [ObjectId(1)]);
}

#[test]
fn masks_and_depth_are_those_of_the_card() {
    // Card 2 hides the right half of card 1: its left edge is at x = 0, the picture's middle.
    let cards = [(1, 0.0, [0.2, 0.2]), (2, 0.1, [0.2, 0.4])]
        .map(|(id, x, size)| card(id, [x, 0.0, 0.1 * f64::from(id)], [0.0; 3], size, &WHOLE));
    let found = labels(&shot(cards), &LabelOptions::default());
    let [below, above] = [&found.objects[0], &found.objects[1]];
    // 0.2 m seen from 0.9 m with 100 pixels a metre at one metre; edges cut pixels in part.
    let (side, edge) = (20.0 / 0.9, 48.0);
    assert!((below.amodal_mask.area() as f64 - side * side).abs() < 4.0 * side);
    assert_eq!(above.amodal_mask, above.visible_mask);
    assert!(
        below
            .visible_mask
            .pixels()
            .all(|(x, _)| f64::from(x) <= edge)
    );
    assert!((below.visible_fraction - 0.5).abs() < 0.02);
    let DepthRange { near, mean, far } = below.depth;
    assert!(
        [near, mean, far]
            .iter()
            .all(|depth| (depth - 0.9).abs() < 1e-6),
        "{:?}",
        below.depth
    );
}

/// Card 1, of 50 x 40 pixels, under card 2, which hides so many of its columns at the right.
fn partly_hidden(columns: f64) -> Shot {
    let (depth, px) = (0.8, 0.008);
    let below = card(1, [0.0, 0.0, 1.0 - depth], [0.0; 3], [0.4, 0.32], &WHOLE);
    let left = (25.0 - columns) * px;
    // At three quarters of the depth the same pixels are three quarters as wide.
    let above = card(
        2,
        [0.75 * (left + 0.1), 0.0, 1.0 - 0.75 * depth],
        [0.0; 3],
        [0.15, 0.3],
        &WHOLE,
    );
    shot([below, above])
}

/// Labels by the rule of visibility.
fn seen_at_least(scene: &Shot, min_visible: f64) -> Labels {
    let obstruction = ObstructionRule::Visibility { min_visible };
    let options = LabelOptions {
        obstruction,
        ..LabelOptions::default()
    };
    labels(scene, &options)
}

#[test]
fn a_card_of_which_enough_is_seen_is_topmost_by_visibility_alone() {
    for (columns, share, topmost) in [(1.0, 0.98, true), (5.0, 0.9, false)] {
        let scene = partly_hidden(columns);
        let found = seen_at_least(&scene, 0.97);
        let below = &found.objects[0];
        let uncovered = below.uncovered_fraction.unwrap();
        assert!((uncovered - share).abs() < 1e-6, "{uncovered}");
        assert_eq!(
            (below.is_topmost(), below.obstructed),
            (topmost, Some(!topmost))
        );
        assert_eq!(below.covered_by, [ObjectId(2)]);
        assert!(found.objects[1].is_topmost());
        let by_overlap = labels(&scene, &LabelOptions::default());
        assert!(!by_overlap.objects[0].is_topmost());
    }
}

#[test]
fn what_lies_under_glass_is_obstructed_though_it_is_seen() {
    let mut scene = partly_hidden(5.0);
    let glass = Image::filled(4, 4, PremulRgba::new(0.01, 0.01, 0.01, 0.2));
    scene.cards[1].texture = glass.into();
    let obstruction = ObstructionRule::Visibility { min_visible: 0.97 };
    let options = LabelOptions {
        obstruction,
        ..LabelOptions::default()
    };
    let found = label(
        &petcomp::render::render(&scene, &Default::default()),
        &scene,
        &options,
    );
    let below = &found.objects[0];
    assert_eq!(below.visible_mask, below.amodal_mask);
    assert!(!below.is_topmost());
}

#[test]
fn what_two_lie_over_counts_once() {
    let over = |id, x| card(id, [x, 0.0, 0.2], [0.0; 3], [0.1, 0.1], &WHOLE);
    let under = card(1, [0.0; 3], [0.0; 3], [0.4; 2], &WHOLE);
    let share = |above: [Card; 2]| {
        let scene = shot([vec![under.clone()], above.into()].concat());
        let found = seen_at_least(&scene, 0.5);
        found.objects[0].uncovered_fraction.unwrap()
    };
    let (twice, apart) = (
        share([over(2, 0.0), over(3, 0.0)]),
        share([over(2, -0.07), over(3, 0.07)]),
    );
    assert!(
        (1.0 - apart - 2.0 * (1.0 - twice)).abs() < 1e-6,
        "{twice} {apart}"
    );
}

#[test]
fn the_least_visible_share_itself_is_enough() {
    let scene = partly_hidden(1.0);
    let is_topmost = |share: f64| seen_at_least(&scene, share).objects[0].is_topmost();
    assert!(is_topmost(0.0) && is_topmost(0.98 - 1e-6));
    assert!(!is_topmost(0.98 + 1e-6) && !is_topmost(1.0));
    assert!(seen_at_least(&scene, 1.0).objects[1].is_topmost());
}

#[test]
fn the_rules_of_obstruction_differ_in_what_they_decide_alone() {
    let scene = partly_hidden(5.0);
    let mut by_visibility = seen_at_least(&scene, 0.97);
    for object in &mut by_visibility.objects {
        object.obstructed = None;
        object.uncovered_fraction = None;
    }
    assert_eq!(by_visibility, labels(&scene, &LabelOptions::default()));
    let told = serde_json::to_string(&by_visibility).unwrap();
    assert!(!told.contains("obstructed"), "{told}");
}

#[test]
fn cards_at_the_same_depth_are_ordered_by_id() {
    let twins = [2, 1].map(|id| card(id, [0.0, 0.0, 0.1], [0.0; 3], [0.2; 2], &WHOLE));
    let found = labels(&shot(twins), &LabelOptions::default());
    assert!(found.objects[0].is_topmost());
    assert_eq!(found.objects[1].covered_by, [ObjectId(1)]);
}

#[test]
fn cards_that_only_touch_do_not_overlap() {
    let beside =
        [(1, -0.05), (2, 0.05)].map(|(id, x)| card(id, [x, 0.0, 0.1], [0.0; 3], [0.1; 2], &WHOLE));
    let found = labels(&shot(beside), &LabelOptions::default());
    assert!(found.objects.iter().all(|o| o.is_topmost()));
}

#[test]
fn a_card_that_reaches_behind_the_camera_is_clipped_to_the_picture() {
    // A strip through the camera's height, tilted: its near end is above and behind the lens.
    let strip = card(1, [0.6, 0.0, 0.7], [0.0, -0.9, 0.0], [2.0, 0.1], &WHOLE);
    let scene = shot([strip]);
    let deep = cast(&scene);
    let found = label(
        &deep,
        &scene,
        &LabelOptions {
            amodal: AmodalBox::Outline,
            ..LabelOptions::default()
        },
    );
    let (counted, around) = raster(&deep, 1, 0.0);
    assert!(counted > 100.0, "the strip crosses the picture");
    assert!(off(&found.objects[0].amodal_box, &around) <= 1.0);
    assert!((area(&found.objects[0].outline_px) - counted).abs() < 0.02 * counted);
}

/// A square with a square hole of half its side, by a slit.
const RING: [[f64; 2]; 10] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [1.0, 1.0],
    [0.0, 1.0],
    [0.0, 0.25],
    [0.25, 0.25],
    [0.25, 0.75],
    [0.75, 0.75],
    [0.75, 0.25],
    [0.0, 0.25],
];

#[test]
fn by_masks_nothing_in_the_hole_of_a_ring_is_under_it() {
    // 40 pixels on the surface; the small card lies in the hole, the bar across the ring.
    let cards = |ring: &[[f64; 2]]| {
        shot([
            card(1, [0.0; 3], [0.0; 3], [0.4; 2], ring),
            card(2, [0.0, 0.0, -0.1], [0.0; 3], [0.1; 2], &WHOLE),
            card(3, [0.0, 0.17, 0.1], [0.0; 3], [0.45, 0.02], &WHOLE),
        ])
    };
    let (deep, hulls) = (cast(&cards(&RING)), cards(&WHOLE));
    let labelled = |outline| {
        let options = LabelOptions {
            outline,
            obstruction: ObstructionRule::Visibility { min_visible: 0.97 },
            ..LabelOptions::default()
        };
        label(&deep, &hulls, &options).objects
    };
    let by_hulls = labelled(OutlineKind::Hull);
    assert_eq!(by_hulls[1].covered_by, [ObjectId(1)]);
    assert_eq!(by_hulls[1].uncovered_fraction, Some(0.0));
    assert!((area(&by_hulls[0].outline_px) - 1600.0).abs() < 1e-6);
    let by_masks = labelled(OutlineKind::Mask);
    assert!(by_masks[1].covered_by.is_empty() && by_masks[1].is_topmost());
    assert_eq!(by_masks[1].uncovered_fraction, Some(1.0));
    assert_eq!(by_masks[0].covered_by, [ObjectId(3)]);
    assert_eq!(area(&by_masks[0].outline_px), 1200.0);
    // The bar is 2.2 pixels high there, in three rows of pixels.
    let free = by_masks[0].uncovered_fraction.unwrap();
    assert!((free - (1.0 - 3.0 * 40.0 / 1200.0)).abs() < 1e-9, "{free}");
}

#[test]
fn by_masks_an_outline_cut_by_the_picture_s_edge_is_truncated_by_its_hull() {
    let scene = shot([card(1, [0.48, 0.0, 0.0], [0.0; 3], [0.4; 2], &WHOLE)]);
    let options = LabelOptions {
        outline: OutlineKind::Mask,
        max_truncation: Some(0.4),
        ..LabelOptions::default()
    };
    let object = labels(&scene, &options).objects.remove(0);
    assert_eq!(area(&object.outline_px), 800.0);
    assert!(object.is_too_truncated(), "{:?}", object.truncation);
}

#[test]
fn an_outline_that_crosses_itself_keeps_both_loops() {
    let bow_tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
    let found = labels(
        &shot([card(1, [0.0; 3], [0.0; 3], [0.4; 2], &bow_tie)]),
        &LabelOptions::default(),
    );
    // Two triangles of a quarter of the 40 x 40 pixel card each.
    assert_eq!(found.objects[0].outline_px.len(), 2);
    assert!((area(&found.objects[0].outline_px) - 800.0).abs() < 0.1);
}

#[test]
fn an_outline_cut_apart_by_the_picture_s_edge_keeps_its_parts() {
    let comb = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.8, 1.0],
        [0.8, 0.2],
        [0.2, 0.2],
        [0.2, 1.0],
        [0.0, 1.0],
    ];
    let scene = shot([card(1, [0.0, 0.4, 0.0], [0.0; 3], [0.4; 2], &comb)]);
    let deep = cast(&scene);
    let found = label(&deep, &scene, &LabelOptions::default());
    assert_eq!(found.objects[0].outline_px.len(), 2);
    assert!((area(&found.objects[0].outline_px) - raster(&deep, 1, 0.0).0).abs() < 1.0);
}

#[test]
fn film_seen_through_film_counts_as_seen() {
    let image = Image::filled(IMAGE[0] as usize, IMAGE[1] as usize, LinearRgb::WHITE);
    let front = DeepSample {
        object: ObjectId(1),
        alpha: 0.4,
        visible: 0.4,
        ..DeepSample::default()
    };
    let back = DeepSample {
        object: ObjectId(2),
        alpha: 0.5,
        visible: 0.3,
        ..DeepSample::default()
    };
    let deep = DeepImage::from_pixels(
        image,
        (0..96 * 72).map(|i| {
            if i == 96 + 2 {
                vec![front, back]
            } else {
                vec![]
            }
        }),
    );
    let scene = shot([2, 1].map(|id| card(id, [0.0; 3], [0.0; 3], [0.1; 2], &WHOLE)));
    let found = label(&deep, &scene, &LabelOptions::default());
    assert!((found.objects[1].visible_fraction - 0.6).abs() < 1e-6);
    assert_eq!(
        found.objects[1].visible_box,
        BBox {
            x0: 2.0,
            y0: 1.0,
            x1: 3.0,
            y1: 2.0
        }
    );
    assert_eq!(found.objects[1].visible_mask, found.objects[1].amodal_mask);
}

/// Corners of a card in the part of a photo that a view shows: projected into the photo, then turned
/// and enlarged about the middle of that part, pixels.
fn in_view(view: &View, card: &Card) -> Vec<Point2<f64>> {
    let half = Vector2::new(48.0, 36.0);
    let (sin, cos) = view.turn_deg.to_radians().sin_cos();
    let reach = Vector2::new(
        cos.abs() * half.x + sin.abs() * half.y,
        sin.abs() * half.x + cos.abs() * half.y,
    );
    let zoom = view.zoom.max((reach.x / half.x).max(reach.y / half.y));
    let room = half - reach / zoom;
    let middle = half + Vector2::new(room.x * view.shift[0], room.y * view.shift[1]);
    let corners = card.outline_uv.iter();
    corners
        .map(|uv| {
            let (px, _) = camera().project(card.quad.point(uv.x, uv.y)).unwrap();
            let p = px.coords - middle;
            let turned = Vector2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x);
            Point2::from(half + zoom * turned)
        })
        .collect()
}

fn box_around(points: &[Point2<f64>]) -> BBox {
    let ends = |of: fn(&Point2<f64>) -> f64| {
        let values = points.iter().map(of);
        values.fold([f64::MAX, f64::MIN], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    };
    let ([x0, x1], [y0, y1]) = (ends(|p| p.x), ends(|p| p.y));
    BBox { x0, y0, x1, y1 }
}

/// Share of a polygon's area outside of the picture, by points on a fine grid.
fn share_outside(corners: &[Point2<f64>]) -> f64 {
    const STEPS: usize = 600;
    let ring: Vec<_> = corners.iter().map(|p| (p.x, p.y)).collect();
    let polygon = geo::Polygon::new(ring.into(), vec![]);
    let b = box_around(corners);
    let along =
        |low: f64, high: f64, i: usize| low + (high - low) * (i as f64 + 0.5) / STEPS as f64;
    let points = (0..STEPS * STEPS)
        .map(|i| geo::Point::new(along(b.x0, b.x1, i % STEPS), along(b.y0, b.y1, i / STEPS)));
    let inside: Vec<_> = points.filter(|p| polygon.contains(p)).collect();
    let is_outside =
        |p: &&geo::Point| !(0.0..96.0).contains(&p.x()) || !(0.0..72.0).contains(&p.y());
    inside.iter().filter(is_outside).count() as f64 / inside.len() as f64
}

fn measured(max_truncation: f64) -> LabelOptions {
    LabelOptions {
        max_truncation: Some(max_truncation),
        ..LabelOptions::default()
    }
}

#[test]
fn what_a_view_cuts_off_is_told_by_the_whole_outline_and_by_what_is_seen() {
    let view = View {
        zoom: 2.0,
        shift: [0.6, -0.4],
        turn_deg: 10.0,
    };
    let cards = [
        card(1, [0.33, 0.05, 0.02], [0.1, -0.05, 0.4], [0.3, 0.2], &WHOLE),
        card(2, [0.1, 0.1, 0.0], [0.0, 0.0, 1.0], [0.12, 0.08], &WHOLE),
    ];
    let scene = Shot {
        camera: view.camera(&camera()),
        ..shot(cards.clone())
    };
    let found = labels(&scene, &measured(1.0));
    let mut is_cut = Vec::new();
    for (object, card) in found.objects.iter().zip(&cards) {
        let (truncation, corners) = (object.truncation.unwrap(), in_view(&view, card));
        assert!(off(&truncation.whole_box, &box_around(&corners)) < 1e-6);
        assert!((truncation.fraction - share_outside(&corners)).abs() < 0.005);
        for b in [object.visible_box, object.amodal_box] {
            assert!(
                b.x0 >= 0.0 && b.y0 >= 0.0 && b.x1 <= 96.0 && b.y1 <= 72.0,
                "{b:?}"
            );
        }
        is_cut.push(truncation.fraction > 0.1);
    }
    assert_eq!(is_cut, [true, false], "{:?}", found.objects);
    // Not cut at all: nothing is lost to rounding.
    assert_eq!(found.objects[1].truncation.unwrap().fraction, 0.0);
}

#[test]
fn truncation_is_measured_and_decides_where_it_is_asked_for_alone() {
    // A sixth of it is to the right of the picture.
    let scene = shot([card(1, [0.38, 0.0, 0.0], [0.0; 3], [0.3, 0.1], &WHOLE)]);
    let by_default = labels(&scene, &LabelOptions::default());
    assert!(
        by_default.objects[0].truncation.is_none() && !by_default.objects[0].is_too_truncated()
    );
    for (max, is_too_much) in [(0.16, true), (0.17, false)] {
        let found = labels(&scene, &measured(max)).objects.remove(0);
        let fraction = found.truncation.unwrap().fraction;
        assert!((fraction - 0.05 / 0.3).abs() < 1e-6, "{fraction}");
        assert_eq!(found.is_too_truncated(), is_too_much);
        let without = ObjectLabel {
            truncation: None,
            ..found
        };
        assert_eq!(without, by_default.objects[0]);
    }
}

#[test]
fn what_crosses_the_picture_is_cut_on_both_sides_and_what_reaches_behind_the_lens_almost_all() {
    let across = shot([card(1, [0.0; 3], [0.0; 3], [1.92, 0.1], &WHOLE)]);
    let truncation = labels(&across, &measured(1.0)).objects[0]
        .truncation
        .unwrap();
    assert!((truncation.fraction - 0.5).abs() < 1e-6);
    assert!((truncation.whole_box.x0 + 48.0).abs() < 1e-6);
    assert!((truncation.whole_box.x1 - 144.0).abs() < 1e-6);
    let strip = card(1, [0.6, 0.0, 0.7], [0.0, -0.9, 0.0], [2.0, 0.1], &WHOLE);
    let behind = labels(&shot([strip]), &measured(1.0)).objects[0].truncation;
    let fraction = behind.unwrap().fraction;
    assert!((0.9..1.0).contains(&fraction), "{fraction}");
}

#[test]
fn a_distractor_obstructs_and_is_no_object() {
    let mut scene = partly_hidden(5.0);
    let as_object = labels(&scene, &LabelOptions::default());
    scene.cards[1].class = None;
    for found in [
        labels(&scene, &LabelOptions::default()),
        seen_at_least(&scene, 0.97),
    ] {
        let [below] = &found.objects[..] else {
            panic!("one object: {found:?}")
        };
        assert!(!below.is_topmost() && below.covered_by == [ObjectId(2)]);
        let [above] = &found.distractors[..] else {
            panic!("one distractor: {found:?}")
        };
        let same = &as_object.objects[1];
        assert_eq!(
            (above.id, &above.visible_mask),
            (same.id, &same.visible_mask)
        );
        assert_eq!(above.visible_box, same.visible_box);
    }
    let told = serde_json::to_string(&as_object).unwrap();
    assert!(!told.contains("distractors") && !told.contains("truncation"));
}
