//! Tests of the definition itself: the numbers that both renderers must reproduce.

use crate::asset::{Panorama, Texture};
use crate::camera::Camera;
use crate::composite;
use crate::deep::{DeepImage, DeepSample};
use crate::geom::{Point2, Point3, Pose, Quad, UnitQuaternion, Vector3};
use crate::image::Image;
use crate::light;
use crate::pixel::{Film, LinearRgb, ObjectId, PremulRgba};
use crate::quality::Quality;
use crate::render::{RenderOptions, check, render, render_coverage, render_reference};
use crate::scene::{AreaLight, Card, EnvironmentMap, Grade, LightGrid, Shot};
use std::f64::consts::PI;
use std::sync::Arc;

/// Between the default and a reference: 2 x 2 samples a pixel, 4 x 4 a light.
const GOOD: RenderOptions = RenderOptions {
    subsamples: 2,
    light_samples: 4,
    ambient_samples: 64,
    cell_px: 1.0,
    refraction: true,
};

/// The same with 3 x 3 samples a pixel, 6 x 6 a light.
pub(super) const HIGH: RenderOptions = RenderOptions {
    subsamples: 3,
    light_samples: 6,
    ambient_samples: 100,
    cell_px: 0.66,
    refraction: true,
};

/// A camera at height 1 over the surface, looking straight down; picture up is world `+y`.
pub(super) fn above(width: u32, height: u32, focal_px: f64) -> Camera {
    Camera::looking_down(1.0, focal_px, [width, height])
}

/// A light whose irradiance at five points was computed by hand and verified in Cycles.
fn square_light() -> AreaLight {
    AreaLight::new([0.3, 0.2, 0.9], [0.4; 2], 10.0)
}

pub(super) fn card(
    id: u32,
    center: [f64; 3],
    rotation: UnitQuaternion<f64>,
    size: [f64; 2],
    texture: Image<PremulRgba>,
) -> Card {
    let quad = Quad {
        world_from_card: Pose::from_parts(Vector3::from(center).into(), rotation),
        size,
    };
    Card {
        outline_uv: [].into(),
        ..Card::new(ObjectId(id), quad, texture)
    }
}

/// A level card of one colour, with enough texels that the fade at its edge is negligible.
fn level(id: u32, center: [f64; 3], size: f64, texel: PremulRgba) -> Card {
    card(
        id,
        center,
        UnitQuaternion::identity(),
        [size; 2],
        Image::filled(256, 256, texel),
    )
}

fn grey(alpha: f32) -> PremulRgba {
    PremulRgba::new(0.5 * alpha, 0.5 * alpha, 0.5 * alpha, alpha)
}

#[test]
fn a_card_ends_where_its_texture_does_whatever_its_number_of_texels() {
    for texels in [256, 257, 260, 293, 383] {
        let texture = Image::filled(texels, texels, grey(1.0));
        let flat = card(
            1,
            [0.0, 0.0, 0.0],
            UnitQuaternion::identity(),
            [0.2; 2],
            texture,
        );
        let deep = render(&Shot::new(above(40, 40, 100.0)).with_card(flat), &GOOD);
        let pixels = (0..1600).map(|i| (i % 40, i / 40));
        let alphas = pixels.map(|(x, y)| (x, f64::from(deep.flat(x, y).to_rgba().a)));
        let (area, moment) = alphas.fold((0.0, 0.0), |(area, moment), (x, alpha)| {
            (area + alpha, moment + alpha * (x as f64 + 0.5))
        });
        assert!((area / 400.0 - 1.0).abs() < 0.01, "{texels}: {area}");
        let middle = moment / area;
        assert!((middle - 20.0).abs() < 0.03, "{texels}: {middle}");
    }
}

/// One ray per pixel, many light samples.
fn sharp() -> RenderOptions {
    RenderOptions {
        subsamples: 1,
        light_samples: 64,
        ambient_samples: 16,
        cell_px: 0.5,
        refraction: true,
    }
}

/// The factor at a point of the surface, seen from straight above.
fn factor_at(
    shot: &Shot,
    options: &RenderOptions,
    way: fn(&Shot, &RenderOptions) -> DeepImage,
    x: f64,
    y: f64,
) -> f32 {
    let mut camera = above(3, 3, 1e6);
    camera.camera_from_world.translation.vector.x = -x;
    camera.camera_from_world.translation.vector.y = y;
    way(
        &Shot {
            camera,
            ..shot.clone()
        },
        options,
    )
    .shadow()[(1, 1)]
        .g
}

#[test]
fn shadows_of_a_square_hit_the_published_numbers() {
    let expected = [
        ([0.0, 0.0], 0.0, 0.40000),
        ([0.02, 0.03], 0.04667, 0.42800),
        ([-0.05, 0.0], 0.92849, 0.95709),
        ([0.05, 0.05], 0.42289, 0.65373),
    ];
    for ([x, y], opaque, translucent) in expected {
        for (alpha, s) in [(1.0, opaque), (0.6, translucent)] {
            let shot = Shot::new(above(3, 3, 100.0)).with_light(square_light());
            let caster = level(1, [0.06, 0.02, 0.1], 0.1, grey(alpha));
            // The card would hide the surface from above; seen at an angle it is out of the way.
            let shot = seen_from_the_side(shot.with_card(caster), x, y);
            for way in [render, render_reference] {
                let found = way(&shot, &sharp()).shadow()[(1, 1)].g;
                assert!(
                    (found - s).abs() < 0.01,
                    "({x}, {y}), alpha {alpha}: {found} against {s}"
                );
            }
        }
    }
}

/// A card 20 cm above the surface: its penumbrae are 12 to 16 times as wide as a node of the lattice.
#[test]
fn wide_penumbrae_have_no_steps() {
    let shot = Shot::new(above(96, 72, 90.0))
        .with_light(AreaLight::new([0.4, 0.3, 0.9], [0.4; 2], 10.0))
        .with_card(level(1, [0.1, 0.1, 0.2], 0.25, grey(1.0)));
    let plain = render_reference(&shot, &sharp());
    let fast = render(&shot, &RenderOptions::default());
    let pixels = (0..72).flat_map(|y| (0..96).map(move |x| (x, y)));
    let bare = pixels.filter(|&(x, y)| fast.at(x, y).is_empty() && plain.at(x, y).is_empty());
    let errors = bare.map(|at| (fast.shadow()[at].g - plain.shadow()[at].g).abs());
    let worst = errors.fold(0.0, f32::max);
    assert!(worst < 0.1, "{worst}");
}

/// The same shot seen along a low ray from `-x`, `-y`, with the surface point in the middle pixel.
fn seen_from_the_side(mut shot: Shot, x: f64, y: f64) -> Shot {
    let target = Point3::new(x, y, 0.0);
    let eye = target + Vector3::new(-1.0, -0.8, 0.35);
    let world_from_camera = Pose::face_towards(&eye, &target, &Vector3::new(0.0, 0.0, -1.0));
    shot.camera = Camera {
        camera_from_world: world_from_camera.inverse(),
        ..above(3, 3, 1e5)
    };
    shot.camera.principal_px = Point2::new(1.5, 1.5);
    shot
}

#[test]
fn far_from_any_card_the_factor_is_exactly_one() {
    let shot = Shot::new(above(3, 3, 100.0))
        .with_light(square_light())
        .with_ambient(LinearRgb::new(0.1, 0.2, 0.3))
        .with_card(level(1, [0.06, 0.02, 0.1], 0.1, grey(1.0)));
    let lit_only = Shot {
        ambient: LinearRgb::BLACK,
        ..shot
    };
    assert_eq!(factor_at(&lit_only, &sharp(), render, -0.6, -0.6), 1.0);
    assert_eq!(
        factor_at(&lit_only, &sharp(), render_reference, -0.6, -0.6),
        1.0
    );
}

#[test]
fn each_layer_takes_its_share() {
    for n in [1, 4, 10] {
        let mut shot = Shot::new(above(5, 5, 50.0)).with_light(square_light());
        for k in 0..n {
            let z = 0.1 + 0.01 * f64::from(k);
            shot = shot.with_card(level(k + 1, [0.0, 0.0, z], 4.0, grey(0.2)));
        }
        for way in [render, render_reference] {
            let deep = way(&shot, &RenderOptions::default());
            let left = 0.8f32.powi(n as i32);
            // All cards cover the whole light: the surface keeps the same share, and the eye sees
            // it through the same.
            assert!(
                (deep.shadow()[(2, 2)].r - left).abs() < 1e-5,
                "{n} layers, light"
            );
            let samples = deep.at(2, 2);
            assert!(
                (1.0 - samples.iter().map(|s| s.visible).sum::<f32>() - left).abs() < 1e-5,
                "{n} layers, eye"
            );
            let ids: Vec<_> = samples.iter().map(|s| s.object.0).collect();
            assert_eq!(ids, (1..=n).rev().collect::<Vec<_>>());
            for (above, s) in samples.iter().enumerate() {
                assert!(
                    (s.visible - 0.2 * 0.8f32.powi(above as i32)).abs() < 1e-5
                        && (s.alpha - 0.2).abs() < 1e-5
                );
            }
        }
    }
}

#[test]
fn a_lit_card_is_as_bright_as_the_closed_form_says() {
    let shot = Shot::new(above(5, 5, 400.0))
        .with_light(square_light())
        .with_card(level(
            1,
            [0.0, 0.0, 0.0],
            1.0,
            PremulRgba::new(0.4, 0.3, 0.2, 1.0),
        ));
    for way in [render, render_reference] {
        let c = way(&shot, &RenderOptions::default()).at(2, 2)[0].light;
        let e = 2.975061 / std::f32::consts::PI;
        assert!(
            (c.r - 0.4 * e).abs() < 2e-4 && (c.b - 0.2 * e).abs() < 2e-4,
            "{c:?}"
        );
    }
}

#[test]
fn ambient_alone_lights_a_card_by_its_albedo() {
    let shot = Shot::new(above(5, 5, 400.0))
        .with_ambient(LinearRgb::new(0.5, 1.0, 2.0))
        .with_card(level(1, [0.0, 0.0, 0.1], 1.0, grey(1.0)));
    for way in [render, render_reference] {
        let c = way(&shot, &RenderOptions::default()).at(2, 2)[0].light;
        assert!(
            (c.r - 0.25).abs() < 1e-5 && (c.b - 1.0).abs() < 1e-5,
            "{c:?}"
        );
    }
}

/// The light map's cells are as large as pixels; the plate's shadows are unchanged.
#[test]
fn a_light_map_is_a_factor_on_the_light_of_cards_alone() {
    let factors = [vec![0.5, 1.0], vec![2.0, 4.0]];
    let shot = Shot {
        light_grid: LightGrid::new(&factors, [0.02; 2]),
        ..Shot::new(above(2, 2, 100.0))
            .with_ambient(LinearRgb::new(0.5, 1.0, 2.0))
            .with_light(square_light())
            .with_card(level(1, [0.0; 3], 1.0, grey(0.5)))
    };
    let even = Shot {
        light_grid: None,
        ..shot.clone()
    };
    let close = RenderOptions {
        cell_px: 0.25,
        ..sharp()
    };
    for way in [render, render_reference] {
        let (mapped, plain) = (way(&shot, &close), way(&even, &close));
        assert_eq!(mapped.shadow(), plain.shadow());
        for (i, factor) in factors.concat().into_iter().enumerate() {
            let [mapped, plain] = [&mapped, &plain].map(|deep| deep.at(i % 2, i / 2)[0].light);
            assert!(
                (mapped.r / plain.r - factor).abs() < 0.02,
                "{factor}: {mapped:?} {plain:?}"
            );
            assert!(
                (mapped.b / plain.b - factor).abs() < 0.02,
                "{factor}: {mapped:?} {plain:?}"
            );
        }
    }
}

/// A 4 x 4 texture of all different texels, 10 pixels per texel, under constant light that shows
/// colours unchanged.
fn magnified() -> (Shot, Image<PremulRgba>) {
    let texture = Image::from_fn(4, 4, |x, y| {
        let v = 0.05 * (4 * y + x) as f32;
        PremulRgba::new(v, 0.8 - v, 0.3, 1.0)
    });
    let quad = card(
        1,
        [0.0; 3],
        UnitQuaternion::identity(),
        [0.4; 2],
        texture.clone(),
    );
    (
        Shot::new(above(41, 41, 100.0))
            .with_ambient(LinearRgb::WHITE)
            .with_card(quad),
        texture,
    )
}

#[test]
fn textures_follow_the_convention() {
    let (shot, texture) = magnified();
    let one = RenderOptions {
        subsamples: 1,
        ..HIGH
    };
    for way in [render, render_reference] {
        // The card spans 0.5 to 40.5: texel centres lie on pixel centres 5, 15, 25, 35.
        let deep = way(&shot, &one);
        let at = |x: usize, y: usize| deep.at(x, y)[0];
        for (i, j) in [(0, 0), (3, 0), (1, 2), (3, 3)] {
            let (s, t) = (at(5 + 10 * i, 5 + 10 * j), texture[(i, j)]);
            assert!(
                (s.light.r - t.r).abs() < 1e-5 && (s.light.g - t.g).abs() < 1e-5,
                "texel {i}, {j}: {s:?}"
            );
        }
        let corner = at(0, 0);
        assert!(
            (corner.alpha - 0.25).abs() < 1e-4 && (corner.light.g - 0.25 * 0.8).abs() < 1e-4,
            "{corner:?}"
        );
        let between = at(10, 5).light.r;
        assert!((between - 0.5 * (texture[(0, 0)].r + texture[(1, 0)].r)).abs() < 1e-5);
    }
}

#[test]
fn an_edge_is_as_soft_as_the_window() {
    let table = [
        (-1.0, 0.00621),
        (-0.75, 0.03510),
        (-0.5, 0.11859),
        (-0.25, 0.27949),
        (0.0, 0.5),
        (0.25, 0.72051),
        (0.5, 0.88141),
        (0.75, 0.96490),
        (1.0, 0.99380),
    ];
    for (t, coverage) in table {
        // The card's right edge lies t pixels right of the centre of pixel 4.
        let size = 2.0;
        // Texels of a hundredth of a pixel: the fade of the outermost half is negligible.
        let texture = Image::filled(20_000, 4, grey(1.0));
        let edge = card(
            1,
            [0.01 * t - 0.5 * size, 0.0, 0.0],
            UnitQuaternion::identity(),
            [size; 2],
            texture,
        );
        let shot = Shot::new(above(9, 9, 100.0)).with_card(edge);
        let alpha = |deep: DeepImage| deep.at(4, 4).first().map_or(0.0, |s| s.alpha);
        let fine = alpha(render_reference(
            &shot,
            &RenderOptions {
                subsamples: 64,
                ..sharp()
            },
        ));
        assert!(
            (fine - coverage).abs() < 0.01,
            "{t}: {fine} against {coverage}"
        );
        let coarse = alpha(render(&shot, &HIGH));
        assert!(
            (coarse - coverage).abs() < 0.17,
            "{t}: {coarse} against {coverage}"
        );
    }
}

pub(super) fn plate(width: usize, height: usize) -> Image<LinearRgb> {
    Image::from_fn(width, height, |x, y| {
        LinearRgb::new(0.1 + 0.01 * x as f32, 0.3, 0.013 * y as f32)
    })
}

#[test]
fn without_cards_the_plate_is_the_picture_bit_for_bit() {
    let plate = plate(33, 21);
    let shot = Shot::new(above(33, 21, 30.0))
        .with_light(square_light())
        .with_ambient(LinearRgb::grey(0.2));
    for way in [render, render_reference] {
        let out = composite::frame(&way(&shot, &Quality::Draft.into()), Some(&plate));
        assert!(
            out.pixels()
                .iter()
                .zip(plate.pixels())
                .all(|(a, &b)| *a == b.opaque())
        );
    }
}

#[test]
fn pixels_that_no_card_can_shadow_keep_the_plate_s_bits() {
    let plate = plate(64, 48);
    let shot = Shot::new(above(64, 48, 60.0))
        .with_light(square_light())
        .with_card(level(1, [-0.1, -0.1, 0.05], 0.1, grey(0.7)));
    let deep = render(&shot, &RenderOptions::default());
    let out = composite::frame(&deep, Some(&plate));
    for (x, y) in [(0, 0), (63, 0), (63, 47), (40, 10)] {
        assert_eq!(out[(x, y)], plate[(x, y)].opaque());
    }
    assert!(
        deep.shadow().pixels().iter().any(|s| s.r < 0.99),
        "there is a shadow to tell from"
    );
}

#[test]
fn ways_agree_on_a_pile() {
    let shot = pile();
    let exact = composite::frame(&render_reference(&shot, &HIGH), Some(&plate(64, 48)));
    for (options, limit) in [
        (RenderOptions::from(Quality::Draft), 0.012),
        (RenderOptions::default(), 0.008),
        (HIGH, 0.005),
    ] {
        let fast = composite::frame(&render(&shot, &options), Some(&plate(64, 48)));
        let rmse = difference(&fast, &exact);
        assert!(rmse < limit, "{options:?}: {rmse}");
    }
}

/// Five tilted cards of soft blobs that partly run through each other, partly over the picture's
/// edge.
pub(super) fn pile() -> Shot {
    let blob = |hue: f32| {
        Image::from_fn(48, 32, move |x, y| {
            let r = ((x as f32 - 23.5) / 24.0).hypot((y as f32 - 15.5) / 16.0);
            let alpha = (3.0 * (1.0 - r)).clamp(0.0, 0.9);
            PremulRgba::new(hue * alpha, 0.5 * alpha, (1.0 - hue) * alpha, alpha)
        })
    };
    let mut shot = Shot::new(above(64, 48, 60.0))
        .with_light(square_light())
        .with_ambient(LinearRgb::grey(0.3));
    for k in 0..5 {
        let f = f64::from(k);
        let rotation = UnitQuaternion::from_euler_angles(0.3 * (f - 2.0), 0.2 * f - 0.4, 1.3 * f);
        let center = [0.2 * f - 0.45, 0.15 * (f - 2.0), 0.08 + 0.02 * f];
        shot = shot.with_card(card(
            k + 1,
            center,
            rotation,
            [0.35, 0.25],
            blob(0.2 * k as f32),
        ));
    }
    shot
}

pub(super) fn same(a: &DeepImage, b: &DeepImage) -> bool {
    let pixels = || (0..a.height()).flat_map(|y| (0..a.width()).map(move |x| (x, y)));
    a.shadow() == b.shadow() && pixels().all(|(x, y)| a.at(x, y) == b.at(x, y))
}

#[test]
fn the_order_of_cards_changes_nothing() {
    let shot = pile();
    let mut turned = shot.clone();
    turned.cards.reverse();
    assert!(same(
        &render(&shot, &RenderOptions::default()),
        &render(&turned, &RenderOptions::default())
    ));
}

#[test]
fn crossing_cards_swap_places_where_they_cross() {
    let tilt = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    let whole = Image::filled(64, 64, grey(0.5));
    let shot = Shot::new(above(40, 9, 40.0))
        .with_card(card(1, [0.0, 0.0, 0.2], tilt(0.4), [0.6; 2], whole.clone()))
        .with_card(card(2, [0.0, 0.0, 0.2], tilt(-0.4), [0.6; 2], whole));
    for way in [render, render_reference] {
        let deep = way(&shot, &RenderOptions::default());
        // Turned about +y by a positive angle, a card sinks towards +x.
        for (x, front) in [(12, 1), (18, 1), (21, 2), (27, 2)] {
            assert_eq!(deep.at(x, 4)[0].object, ObjectId(front), "column {x}");
            assert!(deep.at(x, 4)[0].depth < deep.at(x, 4)[1].depth);
        }
    }
}

/// An upper bound for any card of a shot: whitest texel, nearest to the light, facing it.
fn brightest(shot: &Shot, light: &AreaLight) -> f32 {
    let corners = shot.cards.iter().flat_map(|c| c.quad.corners());
    let nearest = corners
        .map(|c| (c - Point3::from(light.position)).norm())
        .fold(f64::INFINITY, f64::min);
    let radius = 0.5 * light.size[0].hypot(light.size[1]);
    let from_light = light.power / (PI * (nearest - radius).powi(2));
    (from_light / PI) as f32 + shot.ambient.r
}

#[test]
fn everything_stays_within_its_bounds() {
    let shot = pile();
    let most = brightest(&shot, &square_light());
    for options in [Quality::Draft.into(), RenderOptions::default(), HIGH] {
        let deep = render(&shot, &options);
        assert!(
            deep.shadow()
                .pixels()
                .iter()
                .all(|s| (0.0..=1.0).contains(&s.r) && (0.0..=1.0).contains(&s.b))
        );
        for p in composite::frame(&deep, None).pixels() {
            assert!(
                (0.0..=1.0).contains(&p.a)
                    && (0.0..=most).contains(&p.r)
                    && (0.0..=most).contains(&p.b)
            );
        }
        let pixels = (0..48).flat_map(|y| (0..64).map(move |x| (x, y)));
        for s in pixels.flat_map(|(x, y)| deep.at(x, y)) {
            assert!(s.alpha > 0.0 && s.alpha <= 1.0 && s.visible >= 0.0 && s.visible <= s.alpha);
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let shot = pile();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| render(&shot, &RenderOptions::default()))
    };
    assert!(same(&with(1), &with(4)));
}

#[test]
fn exposure_scales_the_cards_alone() {
    let shot = pile();
    let bright = Shot {
        exposure: 2.0,
        ..shot.clone()
    };
    let (a, b) = (
        render(&shot, &RenderOptions::default()),
        render(&bright, &RenderOptions::default()),
    );
    assert_eq!(a.shadow(), b.shadow());
    assert_eq!(b.at(32, 24)[0].light, a.at(32, 24)[0].light.scale(2.0));
}

#[test]
fn a_finite_catcher_ends_the_shadow() {
    let mut shot = Shot::new(above(21, 21, 20.0)).with_light(AreaLight {
        position: [0.0, 0.0, 1.0],
        ..square_light()
    });
    shot = shot.with_card(level(1, [0.0, 0.0, 0.3], 0.3, grey(0.5)));
    shot.catcher = [0.1, 0.1];
    for way in [render, render_reference] {
        let deep = way(&shot, &RenderOptions::default());
        assert!(deep.shadow()[(10, 10)].r < 0.6);
        assert_eq!(deep.shadow()[(13, 10)], LinearRgb::WHITE);
    }
}

/// Shots with something missing or of one colour; `petcomp-report stability` has the visually
/// difficult ones.
fn awkward() -> Vec<(&'static str, Shot)> {
    let base = || {
        Shot::new(above(16, 12, 20.0))
            .with_light(square_light())
            .with_ambient(LinearRgb::grey(0.1))
    };
    vec![
        (
            "a black map",
            base().with_environment(surroundings(Image::filled(4, 2, LinearRgb::BLACK), 0.0)),
        ),
        (
            "a map of one pixel",
            base().with_environment(surroundings(
                Image::filled(1, 1, LinearRgb::WHITE),
                f64::MAX,
            )),
        ),
        ("film", tinted(Texture::from)),
        (
            "dark",
            Shot::new(above(16, 12, 20.0)).with_card(level(1, [0.0, 0.0, 0.1], 0.2, grey(0.8))),
        ),
        (
            "no picture",
            Shot {
                camera: above(0, 0, 20.0),
                ..base().with_card(level(1, [0.0, 0.0, 0.1], 0.2, grey(0.8)))
            },
        ),
    ]
}

/// A card upright beside a camera that is 1 m above the surface, its middle at `height`.
fn upright_beside_the_camera(height: f64) -> Shot {
    let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI / 2.0);
    let texture = Image::filled(512, 256, grey(1.0));
    Shot::new(above(64, 48, 60.0)).with_card(card(
        1,
        [0.0, 0.02, height],
        upright,
        [0.205, 0.106],
        texture,
    ))
}

/// How many pixels show something, as they do in the default way of sampling.
fn covered_pixels(shot: &Shot, way: fn(&Shot, &RenderOptions) -> DeepImage) -> usize {
    let deep = way(shot, &RenderOptions::default());
    let pixels = (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y)));
    pixels.filter(|&(x, y)| !deep.at(x, y).is_empty()).count()
}

#[test]
fn a_card_behind_the_camera_is_not_seen() {
    let shot = upright_beside_the_camera(1.06);
    assert_eq!(covered_pixels(&shot, render_coverage), 0);
}

#[test]
fn awkward_shots_give_defined_pictures() {
    for (name, shot) in awkward() {
        for way in [render, render_reference] {
            let deep = way(&shot, &RenderOptions::default());
            let out = composite::frame(&deep, None);
            assert!(
                out.pixels()
                    .iter()
                    .all(|p| p.color().is_finite() && (0.0..=1.0).contains(&p.a)),
                "{name}"
            );
            assert!(
                deep.shadow()
                    .pixels()
                    .iter()
                    .all(|s| (0.0..=1.0).contains(&s.g)),
                "{name}"
            );
        }
    }
}

/// A card whose film absorbs most of the green, over a card with alpha, with a back of its own.
fn tinted(make: impl Fn(Image<Film>) -> Texture) -> Shot {
    let film = Image::from_fn(32, 24, |x, y| {
        let cover = if (4..28).contains(&x) && (3..21).contains(&y) {
            1.0
        } else {
            0.0
        };
        Film {
            color: LinearRgb::new(0.1, 0.05, 0.02).scale(cover),
            opacity: LinearRgb::new(0.2, 0.8, 0.5).scale(cover),
        }
    });
    let mut shot = pile();
    shot.cards.truncate(2);
    shot.cards[0].texture = make(film);
    shot
}

#[test]
fn grey_film_gives_the_bits_of_alpha() {
    let grey = |film: Image<Film>| {
        film.map(|f| Film {
            opacity: LinearRgb::grey(f.opacity.g),
            ..f
        })
    };
    let as_alpha = tinted(|film| grey(film).into());
    let as_film =
        tinted(|film| Texture::Film(Arc::new(crate::filter::Pyramid::over_nothing(grey(film)))));
    for way in [render, render_reference] {
        let [a, b] = [&as_alpha, &as_film].map(|shot| way(shot, &RenderOptions::default()));
        assert_eq!(a.shadow(), b.shadow());
        assert_eq!(
            composite::frame(&a, Some(&plate(64, 48))),
            composite::frame(&b, Some(&plate(64, 48)))
        );
        let tinted =
            |deep: &DeepImage| (0..48).any(|y| (0..64).any(|x| !deep.tints(x, y).is_empty()));
        assert!(!tinted(&a) && tinted(&b));
    }
}

#[test]
fn what_is_covered_and_hidden_is_the_same_in_the_dark() {
    let mut film = tinted(Texture::from);
    film.cards[0].grade = Grade {
        hue_deg: 30.0,
        saturation: 0.9,
        ..Grade::default()
    };
    for shot in [film, tinted(|film| film.map(|f| f.color.opaque()).into())] {
        let options = RenderOptions::default();
        let [lit, dark] = [render, render_coverage].map(|way| way(&shot, &options));
        let dark_sample = |sample: &DeepSample| DeepSample {
            light: LinearRgb::BLACK,
            ..*sample
        };
        for (x, y) in (0..lit.height()).flat_map(|y| (0..lit.width()).map(move |x| (x, y))) {
            let without_light: Vec<_> = lit.at(x, y).iter().map(dark_sample).collect();
            assert_eq!(without_light, dark.at(x, y), "{x}, {y}");
            assert_eq!(lit.tints(x, y), dark.tints(x, y), "{x}, {y}");
        }
    }
}

#[test]
fn film_tints_what_is_behind_and_its_shadow() {
    let film = Film {
        color: LinearRgb::BLACK,
        opacity: LinearRgb::new(0.2, 0.8, 0.5),
    };
    let mut card = level(1, [0.0, 0.0, 0.1], 4.0, grey(1.0));
    card.texture = Image::filled(256, 256, film).into();
    let shot = Shot::new(above(5, 5, 50.0))
        .with_light(square_light())
        .with_card(card);
    for way in [render, render_reference] {
        let deep = way(&shot, &RenderOptions::default());
        let (s, flat) = (deep.shadow()[(2, 2)], deep.flat(2, 2));
        assert!(
            (s.r - 0.8).abs() < 1e-5 && (s.g - 0.2).abs() < 1e-5 && (s.b - 0.5).abs() < 1e-5,
            "{s:?}"
        );
        assert!(
            (flat.opacity.g - 0.8).abs() < 1e-5 && (deep.at(2, 2)[0].visible - 0.5).abs() < 1e-5
        );
        let out = composite::frame(&deep, Some(&Image::filled(5, 5, LinearRgb::WHITE)));
        assert!((out[(2, 2)].r - 0.64).abs() < 1e-4 && (out[(2, 2)].g - 0.04).abs() < 1e-4);
    }
}

#[test]
fn both_ways_agree_on_film() {
    let shot = tinted(Texture::from);
    let [a, b] = [render, render_reference]
        .map(|way| composite::frame(&way(&shot, &HIGH), Some(&plate(64, 48))));
    assert!(difference(&a, &b) < 0.006, "{}", difference(&a, &b));
}

pub(super) fn difference(a: &Image<PremulRgba>, b: &Image<PremulRgba>) -> f64 {
    let squares = a
        .pixels()
        .iter()
        .zip(b.pixels())
        .map(|(a, b)| f64::from((a.g - b.g).powi(2)));
    (squares.sum::<f64>() / a.pixels().len() as f64).sqrt()
}

#[test]
fn interreflection_brightens_the_surface_under_a_card_alone() {
    // A wide white card of alpha 1/2 reflects half of the light: 1 / (1 - 0.8 * 0.5).
    let shot = Shot::new(above(21, 21, 100.0))
        .with_ambient(LinearRgb::WHITE)
        .with_card(level(
            1,
            [0.0, 0.0, 0.05],
            0.1,
            PremulRgba::new(0.5, 0.25, 0.0, 0.5),
        ));
    let plain = render(&shot, &RenderOptions::default());
    let lit = Shot {
        interreflection: LinearRgb::grey(0.8),
        ..shot
    };
    let bounced = render(&lit, &RenderOptions::default());
    let gain = |x: usize| {
        let (a, b) = (bounced.shadow()[(x, 10)], plain.shadow()[(x, 10)]);
        [a.r / b.r, a.g / b.g, a.b / b.b]
    };
    let middle = gain(10);
    assert!(
        (middle[0] - 1.0 / 0.6).abs() < 2e-3 && (middle[1] - 1.25).abs() < 2e-3,
        "{middle:?}"
    );
    assert!((middle[2] - 1.0).abs() < 1e-6 && (gain(0)[0] - 1.0).abs() < 1e-3);
    let small = Shot {
        catcher: [0.06; 2],
        ..lit
    };
    let beyond = render(&small, &RenderOptions::default()).shadow()[(14, 10)];
    assert_eq!(beyond, LinearRgb::WHITE);
}

#[test]
fn interreflection_of_a_larger_world_is_the_same() {
    let shadow = |scale: f64| {
        let texel = PremulRgba::new(0.5, 0.25, 0.0, 0.5);
        let mut camera = above(21, 21, 100.0);
        camera.camera_from_world.translation.vector *= scale;
        let shot = Shot {
            interreflection: LinearRgb::grey(0.8),
            ..Shot::new(camera)
        };
        let card = level(1, [0.0, 0.0, 0.05 * scale], 0.1 * scale, texel);
        let shot = shot.with_ambient(LinearRgb::WHITE).with_card(card);
        render(&shot, &RenderOptions::default()).shadow().clone()
    };
    let differences = shadow(1.0).zip_map(&shadow(10.0), |a, b| (a.r - b.r).abs());
    let most = differences.pixels().iter().fold(0.0_f32, |m, &d| m.max(d));
    assert!(most < 0.005, "{most}");
}

#[test]
fn a_card_turned_over_shows_its_back_the_right_way_round() {
    let half = |left: f32, right: f32| {
        Image::from_fn(64, 64, move |x, _| {
            let v = if x < 32 { left } else { right };
            PremulRgba::new(v, v, v, 1.0)
        })
    };
    let over = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI);
    let mut turned = card(1, [0.0; 3], over, [0.4; 2], half(0.1, 0.2));
    let lit = |card: &Card| {
        Shot::new(above(41, 41, 100.0))
            .with_ambient(LinearRgb::WHITE)
            .with_card(card.clone())
    };
    for way in [render, render_reference] {
        let at = |card: &Card, x: usize| {
            way(&lit(card), &RenderOptions::default()).at(x, 20)[0]
                .light
                .g
        };
        // Seen through, the front is mirrored.
        turned.back = None;
        assert!((at(&turned, 10) - 0.2).abs() < 1e-4 && (at(&turned, 30) - 0.1).abs() < 1e-4);
        turned.back = Some(half(0.6, 0.8).into());
        assert!((at(&turned, 10) - 0.6).abs() < 1e-4 && (at(&turned, 30) - 0.8).abs() < 1e-4);
    }
}

fn surroundings(image: Image<LinearRgb>, rotation: f64) -> EnvironmentMap {
    EnvironmentMap {
        panorama: Arc::new(Panorama::new(image).unwrap()),
        rotation,
        strength: 1.0,
    }
}

#[test]
fn an_even_map_lights_as_the_constant_environment_does() {
    let radiance = LinearRgb::new(0.5, 1.0, 2.0);
    let shot = Shot::new(above(5, 5, 400.0)).with_card(level(1, [0.0, 0.0, 0.1], 1.0, grey(1.0)));
    let shot = shot.with_environment(surroundings(Image::filled(16, 8, radiance), 0.3));
    for way in [render, render_reference] {
        let c = way(&shot, &RenderOptions::default()).at(2, 2)[0].light;
        assert!(
            (c.r - 0.25).abs() < 1e-3 && (c.b - 1.0).abs() < 4e-3,
            "{c:?}"
        );
    }
}

/// A sun of a few texels at 45 degrees over `+x` in a dim sky.
fn sun(rotation: f64) -> EnvironmentMap {
    let value = |x: usize, y: usize| {
        if (255..257).contains(&x) && (63..65).contains(&y) {
            4000.0
        } else {
            0.2
        }
    };
    surroundings(
        Image::from_fn(512, 256, |x, y| LinearRgb::grey(value(x, y))),
        rotation,
    )
}

#[test]
fn the_shadow_of_a_sun_lies_across_from_it_at_any_rotation() {
    for rotation in [0.0, 0.5 * PI, 2.0] {
        let shot =
            Shot::new(above(81, 81, 100.0)).with_card(level(1, [0.0, 0.0, 0.1], 0.1, grey(1.0)));
        let shot = shot.with_environment(sun(rotation));
        // A direction of the world is rotated before it is looked up: the sun is at minus that
        // rotation.
        let (sin, cos) = libm::sincos(-rotation);
        let (x, y) = (-0.1 * cos, -0.1 * sin);
        let pixel = ((40.5 + 100.0 * x) as usize, (40.5 - 100.0 * y) as usize);
        let across = ((40.5 - 100.0 * x) as usize, (40.5 + 100.0 * y) as usize);
        for way in [render, render_reference] {
            let options = RenderOptions {
                ambient_samples: 128,
                subsamples: 1,
                ..GOOD
            };
            let deep = way(&shot, &options);
            let (dark, bright) = (deep.shadow()[pixel].g, deep.shadow()[across].g);
            assert!(
                dark < 0.6 && bright > 0.9,
                "{rotation}: {dark} and {bright}"
            );
        }
    }
}

#[test]
fn both_ways_agree_under_a_map() {
    let mut shot = pile().with_environment(sun(1.0));
    shot.ambient = LinearRgb::BLACK;
    let options = RenderOptions {
        ambient_samples: 400,
        ..HIGH
    };
    let exact = RenderOptions {
        ambient_samples: 3200,
        subsamples: 2,
        light_samples: 3,
        cell_px: 1.0,
        refraction: true,
    };
    let a = composite::frame(&render(&shot, &options), Some(&plate(64, 48)));
    let b = composite::frame(&render_reference(&shot, &exact), Some(&plate(64, 48)));
    assert!(difference(&a, &b) < 0.012, "{}", difference(&a, &b));
}

#[test]
fn options_out_of_range_are_brought_into_it() {
    let none = RenderOptions {
        subsamples: 0,
        light_samples: 0,
        ambient_samples: 0,
        cell_px: f64::NAN,
        refraction: true,
    };
    let deep = render(&pile(), &none);
    assert!(
        composite::frame(&deep, None)
            .pixels()
            .iter()
            .all(|p| p.color().is_finite())
    );
}

#[test]
fn what_cannot_be_rendered_is_refused_at_the_door() {
    let message = |shot: &Shot| check(shot).unwrap_err().to_string();
    let with =
        |texel: PremulRgba| Shot::new(above(4, 4, 9.0)).with_card(level(1, [0.0; 3], 0.2, texel));
    assert!(check(&with(grey(1.0))).is_ok());
    assert!(
        message(&with(PremulRgba::new(f32::NAN, 0.0, 0.0, 1.0)))
            .starts_with("cards[0]: texture has a value")
    );
    assert!(message(&with(PremulRgba::new(0.0, 0.0, 0.0, 1.5))).contains("alpha 1.5"));
    let film = Film {
        color: LinearRgb::BLACK,
        opacity: LinearRgb::new(0.0, f32::NAN, 0.0),
    };
    let mut backed = with(grey(1.0));
    backed.cards[0].back = Some(Image::filled(2, 2, film).into());
    assert!(
        message(&backed).starts_with("cards[0]: back: texture has a value"),
        "{}",
        message(&backed)
    );
    let turned = with(grey(1.0)).with_environment(surroundings(
        Image::filled(2, 1, LinearRgb::WHITE),
        f64::NAN,
    ));
    assert!(message(&turned).starts_with("environment"));
    let twice = with(grey(1.0)).with_card(level(1, [0.0; 3], 0.2, grey(1.0)));
    assert!(message(&twice).contains("id 1 is used twice"));
    let mut small = with(grey(1.0));
    small.plate = Some(Arc::new(Image::new(3, 4)));
    assert_eq!(message(&small), "plate: 3 x 4 pixels, expected 4 x 4");
    let broken = with(grey(1.0)).with_light(AreaLight {
        power: f64::NAN,
        ..square_light()
    });
    assert!(message(&broken).starts_with("lights[0]"));
}

#[test]
fn the_closed_form_is_what_a_bare_surface_gets() {
    // A card of albedo 1 on the surface shows the unshadowed irradiance over pi.
    let shot = Shot::new(above(5, 5, 400.0))
        .with_light(square_light())
        .with_card(level(1, [0.0; 3], 1.0, PremulRgba::new(1.0, 1.0, 1.0, 1.0)));
    let e = light::irradiance(&square_light(), Point3::origin(), Vector3::z());
    let c = render(&shot, &HIGH).at(2, 2)[0].light;
    assert!((c.g - e.g / std::f32::consts::PI).abs() < 1e-5);
}

/// A small upright card that leans towards `+x`, in the middle of its picture.
fn leaning() -> Shot {
    let lean = UnitQuaternion::from_euler_angles(0.0, 1.0, 0.0);
    let white = Image::filled(64, 64, grey(1.0));
    Shot::new(above(5, 5, 400.0)).with_card(card(1, [0.0, 0.0, 0.3], lean, [0.1; 2], white))
}

/// Light from a lamp of this height, its middle this high, 1 m to the side of that card.
fn light_from_beside(middle: f64, height: f64, catcher: [f64; 2], way: Rendering) -> f32 {
    let lamp = AreaLight {
        target: [0.0, 0.0, middle],
        ..AreaLight::new([1.0, 0.0, middle], [height, 0.4], 10.0 * height)
    };
    let shot = leaning().with_light(lamp);
    way(&Shot { catcher, ..shot }, &HIGH).at(2, 2)[0].light.g
}

type Rendering = fn(&Shot, &RenderOptions) -> DeepImage;

#[test]
fn the_surface_stops_what_a_lamp_sends_from_below() {
    let endless = Shot::new(above(5, 5, 400.0)).catcher;
    for way in [render, render_reference] {
        assert!(light_from_beside(-0.3, 0.4, endless, way).abs() < 1e-6);
        assert!(light_from_beside(-0.3, 0.4, [0.1; 2], way) > 0.03);
        let sunk = light_from_beside(0.0, 0.4, endless, way);
        let upper = light_from_beside(0.1, 0.2, endless, way);
        assert!((sunk / upper - 1.0).abs() < 0.02, "{sunk} against {upper}");
    }
}

/// The same picture of a place elsewhere on the surface.
fn moved(shot: &Shot, by: Vector3<f64>) -> Shot {
    let mut shot = shot.clone();
    let there = Pose::translation(by.x, by.y, by.z);
    shot.camera.camera_from_world *= there.inverse();
    for card in &mut shot.cards {
        card.quad.world_from_card = there * card.quad.world_from_card;
    }
    for light in &mut shot.lights {
        for point in [&mut light.position, &mut light.target] {
            *point = (Vector3::from(*point) + by).into();
        }
    }
    shot
}

#[test]
fn a_place_far_from_the_origin_has_the_same_shadows() {
    let mut shot = pile();
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.9);
    let steep = Pose::from_parts(Vector3::zeros().into(), tilt);
    shot.camera.camera_from_world = steep * shot.camera.camera_from_world;
    shot.camera.camera_from_world.translation.vector = Vector3::new(0.0, 0.0, 1.0);
    let here = render(&shot, &RenderOptions::default());
    for y in [5.0, -5.0] {
        let there = render(
            &moved(&shot, Vector3::new(0.0, y, 0.0)),
            &RenderOptions::default(),
        );
        let pairs = here.shadow().pixels().iter().zip(there.shadow().pixels());
        let worst = pairs.map(|(a, b)| (a.g - b.g).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{y}: {worst}");
        assert!(here.shadow().pixels().iter().any(|share| share.g < 0.8));
    }
}
