use super::*;
use crate::composite::frame;
use crate::geom::{Point3, Pose, Quad, Vector3};
use crate::pixel::PremulRgba;
use crate::scene::AreaLight;
use std::sync::Arc;

/// Thirty millimetres at f/2, focused at half a metre.
const LENS: ThinLens = ThinLens {
    aperture_m: 0.015,
    focus_m: 0.5,
};

fn shot(thin_lens: Option<ThinLens>) -> Shot {
    Shot {
        thin_lens,
        ..Shot::new(Camera::looking_down(0.5, 400.0, [64, 48]))
    }
}

fn sample(object: u32, depth: f32, alpha: f32, through: f32) -> DeepSample {
    DeepSample {
        object: ObjectId(object),
        depth: Depth(depth),
        light: LinearRgb::grey(0.5 * alpha * through),
        alpha,
        visible: alpha * through,
    }
}

fn picture(pixel: impl Fn(usize, usize) -> Vec<DeepSample>) -> DeepImage {
    let pixels = (0..64 * 48).map(|i| pixel(i % 64, i / 64));
    DeepImage::from_pixels(Image::filled(64, 48, LinearRgb::WHITE), pixels)
}

/// The picture through a lens, with nothing beyond its border.
fn softened(deep: &DeepImage, lens: ThinLens) -> DeepImage {
    defocus(deep, &shot(Some(lens)), &RenderOptions::default()).unwrap()
}

fn hidden(deep: &DeepImage, x: usize, y: usize) -> f32 {
    deep.flat(x, y).opacity.g
}

/// The circle on the sensor by the lens equation: a point at `depth` is in focus at v, the sensor
/// is where `focus` is, and this is the width of the cone from the aperture to v there.
fn circle_px(focal_m: f64, depth: f64, focal_px: f64) -> f64 {
    let image_of = |depth: f64| 1.0 / (1.0 / focal_m - 1.0 / depth);
    let (sensor, focused) = (image_of(LENS.focus_m), image_of(depth));
    let diameter_m = LENS.aperture_m * (sensor - focused).abs() / focused;
    0.5 * diameter_m * focal_px / sensor
}

#[test]
fn a_sharp_lens_leaves_the_picture_alone() {
    let deep = picture(|x, y| vec![sample(1, 0.4, 1.0, 1.0); usize::from(x > y)]);
    assert!(defocus(&deep, &shot(None), &RenderOptions::default()).is_none());
}

#[test]
fn the_circle_is_that_of_the_lens_equation() {
    for depth in [0.3, 0.45, 0.5, 0.7, 5.0] {
        let found = LENS.blur_radius_px(depth, 400.0);
        for focal_m in [0.01, 0.03, 0.1] {
            let expected = circle_px(focal_m, depth, 400.0);
            assert!(
                (found - expected).abs() < 1e-9,
                "{depth}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_point_spreads_over_its_circle() {
    for depth in [0.3_f32, 0.4, 0.7] {
        let dot = picture(|x, y| vec![sample(1, depth, 1.0, 1.0); usize::from((x, y) == (32, 24))]);
        let soft = softened(&dot, LENS);
        let (mut sum, mut spread) = (0.0, 0.0);
        for (x, y) in pixels_of(&soft) {
            let light = f64::from(soft.flat(x, y).color.g);
            sum += light;
            spread += light * (x as f64 - 32.0).powi(2);
        }
        let radius = circle_px(0.03, depth.into(), 400.0);
        let wanted = 0.25 * radius * radius;
        assert!((sum - 0.5).abs() < 1e-3, "{sum}");
        assert!(
            (spread / sum / wanted - 1.0).abs() < 0.05,
            "{depth}: {} {wanted}",
            spread / sum
        );
    }
}

#[test]
fn what_is_in_focus_keeps_its_bits() {
    let deep = picture(|x, y| {
        let above = sample(1, 0.5, 0.25, 1.0);
        let below = sample(2, 0.5, 0.5, 0.75);
        [above, below][..(x + y) % 3].to_vec()
    });
    let soft = softened(&deep, LENS);
    for (x, y) in pixels_of(&deep) {
        assert_eq!(soft.at(x, y), deep.at(x, y), "{x} {y}");
    }
}

#[test]
fn nothing_shines_through_where_a_soft_card_ends_over_a_sharp_one() {
    // The near card covers the left half and hides the far one there, which is everywhere.
    let deep = picture(|x, _| {
        let near = sample(1, 0.4, 1.0, 1.0);
        if x < 32 {
            vec![near, sample(2, 0.5, 1.0, 0.0)]
        } else {
            vec![sample(2, 0.5, 1.0, 1.0)]
        }
    });
    let soft = softened(&deep, LENS);
    let radius = LENS.blur_radius_px(0.4, 400.0);
    assert!(radius > 1.4, "{radius}");
    for x in 8..56 {
        assert!(
            (hidden(&soft, x, 24) - 1.0).abs() < 0.02,
            "{x}: {}",
            hidden(&soft, x, 24)
        );
        assert!((soft.flat(x, 24).color.g - 0.5).abs() < 0.02, "{x}");
    }
    // Its edge is soft as far as its circle reaches.
    let near = |x: usize| {
        soft.at(x, 24)
            .iter()
            .find(|s| s.object == ObjectId(1))
            .map(|s| s.alpha)
    };
    assert!(near(32).is_some_and(|alpha| alpha > 0.05 && alpha < 0.5));
    assert_eq!(near(36), None);
}

/// A card with its size in millimetres, ten centimetres above the surface, and turned.
fn card(id: u32, [x, y]: [f64; 2], [width, height]: [f64; 2], turn_deg: f64) -> Card {
    let place = Pose::translation(x / 1e3, y / 1e3, 0.1);
    let quad = Quad {
        world_from_card: place * Pose::rotation(Vector3::z() * turn_deg.to_radians()),
        size: [width / 1e3, height / 1e3],
    };
    let film = Image::filled(8, 8, PremulRgba::new(0.1, 0.2, 0.3, 0.6));
    Card::new(ObjectId(id), quad, film)
}

/// A plate of a camera's size.
fn white_plate(camera: &Camera) -> Arc<Image<LinearRgb>> {
    let [width, height] = camera.image.map(|side| side as usize);
    Arc::new(Image::filled(width, height, LinearRgb::WHITE))
}

/// The picture of a shot, which must equal that of one that shows 40 pixels more on every side.
fn middle_of_a_larger_picture(small: Shot, options: &RenderOptions) -> Image<PremulRgba> {
    let camera = small.camera.widened(40);
    let large = Shot {
        plate: small.plate.as_ref().map(|_| white_plate(&camera)),
        camera,
        ..small.clone()
    };
    let [found, whole] = [small, large].map(|shot| crate::composite::picture(&shot, options));
    for (x, y) in (0..48).flat_map(|y| (0..64).map(move |x| (x, y))) {
        let (found, whole) = (found[(x, y)], whole[(x + 40, y + 40)]);
        let off = (found.a - whole.a).abs().max((found.r - whole.r).abs());
        assert!(off < 1e-3, "{x} {y}: {found:?} {whole:?}");
    }
    found
}

#[test]
fn what_is_beyond_the_border_spreads_into_the_picture() {
    // The picture shows 64 mm x 48 mm at that height. Circles of 6 pixels.
    let lens = ThinLens {
        aperture_m: 0.06,
        ..LENS
    };
    let cards = [
        card(1, [-30.0, 0.0], [30.0, 20.0], 10.0), // over the left border
        card(2, [0.0, 32.0], [20.0, 14.0], 45.0),  // a corner just over the upper one
        card(3, [38.0, -10.0], [10.0, 10.0], 0.0), // beyond the right one, by a pixel
        card(4, [0.0, -24.0], [100.0, 10.0], 3.0), // along the lower one
    ];
    let plain = shot(Some(lens)).with_ambient(LinearRgb::WHITE);
    let small = cards.into_iter().fold(plain, Shot::with_card);
    let found = middle_of_a_larger_picture(small, &RenderOptions::default());
    let beyond = found[(63, 28)].a;
    assert!(beyond > 0.05, "{beyond}");
}

#[test]
fn shadows_beyond_the_border_spread_into_the_picture() {
    // The picture shows 80 mm x 60 mm of the surface, with circles of 6 pixels. Cards are in focus.
    let lens = ThinLens {
        aperture_m: 0.06,
        focus_m: 0.4,
    };
    let lamp = AreaLight::new([0.0, 0.0, 1.0], [0.01; 2], 10.0);
    let plain = shot(Some(lens)).with_light(lamp);
    let small = plain
        // Its shadow ends at the left border, between two nodes.
        .with_card(card(1, [-50.6, 0.0], [30.0, 30.0], 0.0))
        // Its shadow lies on the lower one.
        .with_card(card(2, [0.0, -24.0], [100.0, 10.0], 3.0));
    let plate = white_plate(&small.camera);
    // The irradiance of both pictures is sampled at the same places.
    let options = RenderOptions {
        cell_px: 0.5,
        ..RenderOptions::default()
    };
    let found = middle_of_a_larger_picture(small.with_plate(plate), &options);
    let beyond = found[(0, 24)].r;
    assert!(beyond < 0.9, "{beyond}");
}

#[test]
fn a_card_that_ends_before_the_border_is_as_soft_there_as_elsewhere() {
    let deep = picture(|x, _| match x {
        20..62 => vec![sample(1, 0.4, 1.0, 1.0)],
        _ => vec![],
    });
    let soft = softened(&deep, LENS);
    for (left, right) in [(19, 62), (18, 63)] {
        let [left, right] = [left, right].map(|x| hidden(&soft, x, 24));
        assert!((left - right).abs() < 1e-5, "{left} {right}");
    }
}

#[test]
fn equal_blur_is_that_of_the_whole_picture() {
    let deep = picture(|x, y| match (x / 8 + y / 8) % 3 {
        0 => vec![],
        1 => vec![sample(1, 0.4, 0.5, 1.0), sample(2, 0.4, 1.0, 0.5)],
        _ => vec![sample(2, 0.4, 1.0, 1.0)],
    });
    let soft = softened(&deep, LENS);
    let disc = Discs::of_radii([LENS.blur_radius_px(f64::from(0.4_f32), 400.0)].into_iter());
    let sharp = frame(&deep, None);
    let blurred = frame(&soft, None);
    for (x, y) in [(20, 20), (31, 24), (40, 33)] {
        let taps = disc
            .of_radius(LENS.blur_radius_px(f64::from(0.4_f32), 400.0))
            .taps();
        let expected: f32 = taps
            .iter()
            .map(|(dx, dy, w)| {
                let at = ((x + dx) as usize, (y + dy) as usize);
                w * sharp[at].g
            })
            .sum();
        let found = blurred[(x as usize, y as usize)].g;
        assert!(
            (found - expected).abs() < 1e-5,
            "{x} {y}: {found} {expected}"
        );
    }
}

#[test]
fn shadows_are_as_soft_as_the_surface_is() {
    let step = |x: usize| LinearRgb::grey(if x < 32 { 0.5 } else { 1.0 });
    let shadow = Image::from_fn(64, 48, |x, _| step(x));
    let deep = DeepImage::from_pixels(shadow, (0..64 * 48).map(|_| vec![]));
    // The surface is half a metre away: in focus.
    let sharp = softened(&deep, LENS);
    assert_eq!(sharp.shadow()[(31, 20)].g, 0.5);
    let near = ThinLens {
        focus_m: 0.4,
        ..LENS
    };
    let soft = softened(&deep, near);
    let (inner, outer) = (soft.shadow()[(31, 20)].g, soft.shadow()[(32, 20)].g);
    assert!(
        inner > 0.55 && outer < 0.95 && (inner + outer - 1.5).abs() < 1e-3,
        "{inner} {outer}"
    );
}

#[test]
fn film_keeps_its_tint() {
    let red = LinearRgb::new(0.2, 0.8, 0.8);
    let deep = picture(|x, _| vec![sample(1, 0.4, 0.6, 1.0); usize::from(x < 32)]);
    let count = 32 * 48;
    let deep = deep.with_tints(vec![red; count]);
    let soft = softened(&deep, LENS);
    let inside = soft.flat(20, 20).opacity;
    assert!(
        (inside.r - 0.2).abs() < 1e-4 && (inside.g - 0.8).abs() < 1e-4,
        "{inside:?}"
    );
    let edge = soft.flat(32, 20).opacity;
    assert!((edge.g / edge.r - 4.0).abs() < 1e-2, "{edge:?}");
}

#[test]
fn what_dyed_film_covers_has_its_tint_once() {
    let (dye, passed) = (LinearRgb::new(0.2, 0.8, 0.8), LinearRgb::new(0.8, 0.2, 0.2));
    let behind = DeepSample {
        light: passed.scale(0.5),
        visible: 0.4,
        ..sample(2, 0.4, 1.0, 1.0)
    };
    let deep = picture(|_, _| vec![sample(1, 0.3, 0.6, 1.0), behind]);
    let deep = deep.with_tints([dye, passed].repeat(64 * 48));
    let light = |deep: &DeepImage| deep.flat(32, 24).color;
    let (soft, sharp) = (light(&softened(&deep, LENS)), light(&deep));
    let error = soft.add_scaled(-1.0, sharp).map(f32::abs);
    assert!(
        error.r.max(error.g).max(error.b) < 1e-3,
        "{soft:?} {sharp:?}"
    );
}

#[test]
fn the_surface_is_seen_where_the_axis_meets_it() {
    let shot = shot(Some(LENS));
    let focus = Focus::new(&shot, LENS);
    assert_eq!(focus.surface_radius_px(32, 24), 0.0);
    let higher = Shot {
        camera: Camera::look_at(
            Point3::new(0.0, 0.0, 0.8),
            Point3::origin(),
            400.0,
            [64, 48],
        ),
        ..shot.clone()
    };
    let off = Focus::new(&higher, LENS).surface_radius_px(5, 40);
    assert!(
        (off - LENS.blur_radius_px(0.8, 400.0)).abs() < 1e-6,
        "{off}"
    );
}
