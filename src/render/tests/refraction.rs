//! Refracting cards, tested by their displacement of a plate that is a linear gradient.

use super::definition::{above, card, pile, plate, same};
use crate::composite::{self, Exposed};
use crate::filter::gaussian_blur;
use crate::geom::UnitQuaternion;
use crate::image::Image;
use crate::label::{LabelOptions, label};
use crate::matte::{Flow, LightPath};
use crate::pixel::{LinearRgb, PremulRgba};
use crate::render::{RenderOptions, render, render_unhidden};
use crate::scene::{Bend, Blur, Card, PostProcess, Refraction, Shot, ThinLens};
use std::f64::consts::PI;
use std::sync::Arc;

/// Focal length over the height of the camera, a metre: pixels per metre of the surface.
const PX_PER_METRE: f64 = 100.0;
/// Gradient of the plate per pixel to the right, and per pixel down.
const GROWTH: [f64; 2] = [0.004, 0.002];
/// Height of bodies when they lay on the display, and of their cards above what they rest on.
const HEIGHT: f64 = 0.03;
/// Transmittance of a card.
const PASSES: f64 = 0.75;

fn even_plate() -> Arc<Image<LinearRgb>> {
    Arc::new(Image::from_fn(64, 48, |x, y| {
        let value = 0.2 + GROWTH[0] * x as f64 + GROWTH[1] * y as f64;
        LinearRgb::grey(value as f32)
    }))
}

fn flow(displacement: [f32; 2]) -> Option<Arc<Flow>> {
    Some(Arc::new(Flow {
        paths: Image::filled(
            4,
            4,
            LightPath {
                displacement,
                ..LightPath::default()
            },
        ),
        known: Image::filled(4, 4, true),
        width: 0.3,
        height: HEIGHT,
    }))
}

/// A dark refracting sheet, this high above the surface.
fn sheet(id: u32, height: f64, displacement: [f32; 2]) -> Card {
    let dark = Image::filled(64, 64, PremulRgba::new(0.0, 0.0, 0.0, 1.0 - PASSES as f32));
    Card {
        refraction: Refraction {
            flows: [flow(displacement), None],
            thickness: 2.0 * HEIGHT,
        },
        ..card(
            id,
            [0.0, 0.0, height],
            UnitQuaternion::identity(),
            [0.3; 2],
            dark,
        )
    }
}

fn shot(cards: impl IntoIterator<Item = Card>) -> Shot {
    let shot = Shot::new(above(64, 48, PX_PER_METRE)).with_plate(even_plate());
    cards.into_iter().fold(shot, Shot::with_card)
}

/// Displacement of the plate in the middle, pixels, from the brightness of a dark picture; along
/// both axes in one number.
fn shift(shot: &Shot, passes: f64) -> f64 {
    let seen = composite::picture(shot, &RenderOptions::default())[(32, 24)].g;
    let straight = even_plate()[(32, 24)].g;
    (f64::from(seen) / passes - f64::from(straight)) / GROWTH[0]
}

fn assert_shift(cards: impl IntoIterator<Item = Card>, expected: f64) {
    let shot = shot(cards);
    let passes = PASSES.powi(shot.cards.len() as i32);
    let found = shift(&shot, passes);
    assert!(
        (found - expected).abs() < 0.01,
        "{found}, expected {expected}"
    );
}

#[test]
fn what_lies_behind_is_seen_where_lines_of_sight_end() {
    assert_shift([sheet(1, HEIGHT, [0.02, 0.0])], 2.0);
    assert_shift([sheet(1, HEIGHT, [-0.03, 0.0])], -3.0);
    // A pixel down counts as half a pixel to the right; the surface's y points up the picture.
    assert_shift([sheet(1, HEIGHT, [0.0, 0.02])], 1.0);
}

#[test]
fn haze_blurs_what_lies_behind() {
    let edge = Image::from_fn(64, 48, |x, _| {
        LinearRgb::grey(if x < 30 { 0.1 } else { 0.7 })
    });
    let mut hazy = sheet(1, HEIGHT, [0.0, 0.0]);
    let path = LightPath {
        haze: 0.5,
        scatter_width: 0.03,
        ..LightPath::default()
    };
    let flow = Flow {
        paths: Image::filled(4, 4, path),
        ..(*flow([0.0; 2]).unwrap()).clone()
    };
    hazy.refraction.flows[0] = Some(Arc::new(flow));
    let shot = shot([hazy]).with_plate(Arc::new(edge.clone()));
    let seen = composite::picture(&shot, &RenderOptions::default());
    let blurred = gaussian_blur(&edge, 3.0);
    for x in 20..40 {
        let half = 0.5 * (edge[(x, 24)].g + blurred[(x, 24)].g) * PASSES as f32;
        let found = seen[(x, 24)].g;
        assert!((found - half).abs() < 0.02, "{x}: {found}, expected {half}");
    }
}

#[test]
fn displacement_grows_with_the_clearance() {
    assert_shift([sheet(1, 2.0 * HEIGHT, [0.02, 0.0])], 4.0);
    assert_shift([sheet(1, 0.0, [0.02, 0.0])], 2.0);
}

#[test]
fn a_larger_object_bends_as_much_more() {
    let mut large = sheet(1, 2.0 * HEIGHT, [0.02, 0.0]);
    large.quad.size = [0.6; 2];
    large.refraction.thickness *= 2.0;
    assert_shift([large], 4.0);
}

#[test]
fn displacements_of_a_stack_add_up() {
    let low = sheet(1, HEIGHT, [0.02, 0.0]);
    // It is 0.04 m higher; 3/4 of what is behind it is the surface, and the rest the lower sheet.
    let growth = 1.0 + (PASSES * 0.04 + (1.0 - PASSES) * 0.01) / HEIGHT;
    let depth = 1.0 - (1.0 - PASSES) * HEIGHT;
    let high = sheet(2, HEIGHT + 0.04, [0.01, 0.0]);
    assert_shift([low, high], 2.0 + growth / depth);
}

#[test]
fn a_bright_thing_behind_a_stack_is_seen_once() {
    let (low, high) = (
        sheet(1, HEIGHT, [0.08, 0.0]),
        sheet(2, HEIGHT + 0.04, [0.04, 0.0]),
    );
    let shot = shot([low, high]).with_plate(striped(40));
    let seen = composite::picture(&shot, &RenderOptions::default());
    // Displaced by 8 pixels by the lower sheet and by 8.4 by the upper one, as above.
    for x in 20..47 {
        let value = match x {
            25 | 26 => 0.9,
            22..30 => continue,
            _ => 0.1,
        };
        let expected = (value * PASSES * PASSES) as f32;
        let found = seen[(x, 24)].g;
        assert!((found - expected).abs() < 0.03, "{x}: {found} {expected}");
    }
}

#[test]
fn a_back_without_a_flow_of_its_own_bends_like_the_front() {
    let turn = UnitQuaternion::from_euler_angles(PI, 0.0, 0.0);
    let turned = |mut card: Card| {
        card.quad.world_from_card.rotation = turn;
        card
    };
    assert_shift([turned(sheet(1, HEIGHT, [0.02, 0.0]))], 2.0);
    // Down on the front is up as seen from behind, about the axis of rotation.
    assert_shift([turned(sheet(1, HEIGHT, [0.0, 0.02]))], -1.0);
    let mut backed = turned(sheet(1, HEIGHT, [0.0, 0.02]));
    backed.back = Some(backed.texture.clone());
    assert_shift([backed.clone()], 0.0);
    // Its own texels show the back the right way round: right is towards the card's left.
    backed.refraction.flows[1] = flow([0.02, 0.0]);
    assert_shift([backed], -2.0);
}

#[test]
fn a_curved_card_bends_where_it_is_seen() {
    let mut curved = sheet(1, HEIGHT, [0.02, 0.0]);
    curved.bend = Bend {
        deg: 20.0,
        axis_deg: 0.0,
    };
    let found = shift(&shot([curved]), PASSES);
    assert!((found - 2.0).abs() < 0.2, "{found}");
}

/// A plate of 0.1 with a bright stripe of four columns from this one on.
fn striped(from: usize) -> Arc<Image<LinearRgb>> {
    let value = |x: usize| {
        if (from..from + 4).contains(&x) {
            0.9
        } else {
            0.1
        }
    };
    Arc::new(Image::from_fn(64, 48, |x, _| LinearRgb::grey(value(x))))
}

#[test]
fn on_a_belt_too_nothing_is_seen_where_it_is_and_displaced() {
    let still = shot([sheet(1, HEIGHT, [0.08, 0.0])]).with_plate(striped(30));
    // A shutter so short that nothing moves.
    let moving = Shot {
        motion_m: [1e-9, 0.0],
        ..still.clone()
    };
    let [still, moving] =
        [&still, &moving].map(|shot| composite::picture(shot, &RenderOptions::default()));
    let pairs = still.pixels().iter().zip(moving.pixels());
    for (i, (a, b)) in pairs.enumerate() {
        assert!((a.g - b.g).abs() < 1e-5, "{i}: {} {}", a.g, b.g);
    }
}

#[test]
fn what_is_seen_through_a_soft_object_is_as_sharp_as_the_photo() {
    let still = shot([sheet(1, HEIGHT, [0.08, 0.0])]).with_plate(striped(30));
    let lens = ThinLens {
        aperture_m: 0.05,
        focus_m: 0.5,
    };
    let cases = [
        (None, [0.0; 2], 0.8),
        (Some(lens), [0.0; 2], 0.0),
        (None, [0.03, 0.0], 0.0),
        (Some(lens), [0.03, 0.0], 0.8),
    ];
    for (thin_lens, motion_m, blur_px) in cases {
        let shot = Shot {
            thin_lens,
            motion_m,
            ..still.clone()
        };
        let finish = PostProcess {
            blur_px: Blur::Known(blur_px),
            ..PostProcess::default()
        };
        let free = render_unhidden(&shot, &RenderOptions::default());
        let seen = Exposed::new(free, &shot, &RenderOptions::default()).finished(&shot, &finish);
        let at = |x: usize| f64::from(seen[(x, 24)].g) / PASSES;
        // The stripe itself, and where it is seen, eight pixels to the left.
        assert!((30..34).all(|x| (at(x) - 0.1).abs() < 0.01), "{finish:?}");
        assert!((23..25).all(|x| (at(x) - 0.9).abs() < 0.1), "{finish:?}");
        assert!(seen.pixels().iter().all(|p| p.g >= 0.0), "{finish:?}");
    }
}

/// A sheet that is opaque left of its middle, and displaces to the left.
fn half_painted() -> Card {
    let mut card = sheet(1, HEIGHT, [-0.05, 0.0]);
    let paint = |x: usize| {
        let alpha = if x < 32 { 1.0 } else { 1.0 - PASSES as f32 };
        PremulRgba::new(0.0, 0.0, 0.0, alpha)
    };
    card.texture = Image::from_fn(64, 64, |x, _| paint(x)).into();
    card
}

#[test]
fn what_an_object_itself_hides_is_seen_through_its_clear_part() {
    let seen = composite::picture(&shot([half_painted()]), &RenderOptions::default());
    // Five pixels to the left of column 35 is paint, and behind it the plate.
    let plate = even_plate();
    let left = f64::from(plate[(30, 24)].g) * PASSES;
    assert!((f64::from(seen[(35, 24)].g) - left).abs() < 0.01 * left);
}

#[test]
fn labels_and_the_rest_of_the_picture_stay() {
    let bending = |displacement: [f32; 2]| {
        let mut shot = pile().with_plate(Arc::new(plate(64, 48)));
        for card in &mut shot.cards {
            card.refraction.flows[0] = flow(displacement);
        }
        shot
    };
    let options = RenderOptions::default();
    let straight = pile().with_plate(Arc::new(plate(64, 48)));
    let bent = bending([0.02, 0.01]);
    let [a, b] = [&straight, &bent].map(|shot| render(shot, &options));
    let labels = LabelOptions::default();
    assert_eq!(label(&a, &straight, &labels), label(&b, &bent, &labels));
    let [seen_a, seen_b] = [(&a, &straight), (&b, &bent)]
        .map(|(deep, shot)| composite::frame(deep, shot.plate.as_deref()));
    assert!(seen_a != seen_b, "nothing is bent");
    for y in 0..48 {
        for x in 0..64 {
            if a.at(x, y).is_empty() {
                assert_eq!(seen_a[(x, y)], seen_b[(x, y)]);
            }
            assert!(seen_b[(x, y)].g >= 0.0);
        }
    }
    let off = RenderOptions {
        refraction: false,
        ..options
    };
    assert!(same(&a, &render(&bent, &off)), "the switch");
}
