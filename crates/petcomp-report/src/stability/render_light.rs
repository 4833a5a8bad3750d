//! Light that is hard to render: grazing, without size, in the middle of a card, very bright beside very dim.

use super::staged::{camera_above, card, grey, lamp, level_card, rendered, small_shot, tilted};
use super::{HardCase, Outcome};
use crate::render::{GOOD, HIGH, settings};
use petcomp::Image;
use petcomp::asset::{Panorama, uv_to_direction};
use petcomp::camera::Camera;
use petcomp::geom::{Point3, UnitQuaternion, Vector3};
use petcomp::light::{frame, polygon_irradiance, radiance};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{AreaLight, EnvironmentMap, Shot};
use petcomp::{LinearRgb, PremulRgba};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

pub(super) fn cases() -> Vec<HardCase> {
    let mut cases: Vec<HardCase> = [10.0, 1.0, 0.1].map(grazing).into();
    cases.extend([1e-2, 1e-4, 1e-6, 0.0].map(small_light));
    cases.extend(
        settings()
            .into_iter()
            .filter(|(name, _)| ["normal", "high", "reference"].contains(name))
            .map(cut_by_the_horizon),
    );
    cases.extend([
        through_a_card(),
        bright_beside_dim(),
        dim_in_the_shade(),
        sun(),
        sun_in_the_shade(),
    ]);
    cases
}

/// Light that the middle of a white level card at the origin sends up, in a picture of 5 x 5.
fn seen(shot: Shot, options: &RenderOptions) -> f64 {
    let white = PremulRgba::new(1.0, 1.0, 1.0, 1.0);
    let deep = render(
        &shot.with_card(level_card(1, [0.0; 3], 1.0, white)),
        options,
    );
    f64::from(deep.flat(2, 2).color.g)
}

/// A point that shines like a small flat light turned to the origin, seen by a level white card: `P cos / (pi r)^2`.
fn from_a_point(light: &AreaLight) -> f64 {
    let to = Vector3::from(light.position);
    light.power * to.normalize().z / (PI * PI * to.norm_squared())
}

fn grazing(degrees: f64) -> HardCase {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let light = lamp([10.0 * cos, 0.0, 10.0 * sin], 0.001, 1000.0);
    let expected = from_a_point(&light);
    HardCase::new(
        format!("light grazing at {degrees} degrees"),
        "a small light of 1000 W, 10 m away, over a white level card",
        format!("cosine law: {expected:.6e}, to 0.1 %"),
        move || {
            let found = seen(small_shot().with_light(light), &RenderOptions::default());
            Ok(Outcome::near(
                found / expected,
                1.0,
                1e-3,
                "of the closed form",
            ))
        },
    )
}

fn small_light(side: f64) -> HardCase {
    let light = lamp([0.3, 0.2, 0.9], side, 10.0);
    let expected = from_a_point(&light);
    let name = if side > 0.0 {
        format!("light of {side} m")
    } else {
        "light of no size".into()
    };
    HardCase::new(
        name,
        "10 W, 0.97 m away, over a white level card",
        format!("the limit of small lights, P cos / (pi r)^2 = {expected:.6}: to 0.1 %"),
        move || {
            Ok(Outcome::near(
                seen(small_shot().with_light(light), &RenderOptions::default()) / expected,
                1.0,
                1e-3,
                "of it",
            ))
        },
    )
}

fn cut_by_the_horizon((quality, options): (&str, RenderOptions)) -> HardCase {
    let light = lamp([1.0, 0.0, 0.0], 1.0, 10.0);
    let white = f64::from(radiance(&light).g) / PI;
    let expected = polygon_irradiance(
        &frame(&light).corners(light.size),
        Point3::origin(),
        Vector3::z(),
    ) * white;
    HardCase::new(
        format!("light half below the horizon, quality {quality}"),
        "an upright light of 1 x 1 m, 1 m away, half of it under the plane of a white level card",
        format!("Lambert's formula for the upper half, {expected:.6}: to 5 %, 0.07 stops"),
        move || {
            Ok(Outcome::near(
                seen(small_shot().with_light(light), &options) / expected,
                1.0,
                0.05,
                "of it",
            ))
        },
    )
}

/// A camera that sees the surface around `x`, `y` from straight above and very near to it.
fn at(x: f64, y: f64, image: [u32; 2]) -> Camera {
    let mut camera = camera_above(image, 1e6);
    camera.camera_from_world.translation.vector.x = -x;
    camera.camera_from_world.translation.vector.y = y;
    camera
}

fn through_a_card() -> HardCase {
    let light = lamp([0.0, 0.0, 0.5], 0.2, 10.0);
    let corners = |left: f64| {
        [[left, -0.1], [0.1, -0.1], [0.1, 0.1], [left, 0.1]].map(|[x, y]| Point3::new(x, y, 0.5))
    };
    let from =
        |left: f64| polygon_irradiance(&corners(left), Point3::new(0.3, 0.0, 0.0), Vector3::z());
    let expected = from(0.0) / from(-0.1);
    HardCase::new(
        "light inside a card",
        "an upright opaque card through the middle of a light of 0.2 x 0.2 m; the surface on one side of it",
        format!("that half of the light: {expected:.4} of the irradiance, to 0.02 at quality high"),
        move || {
            let upright = card(
                1,
                [0.0, 0.0, 0.5],
                tilted(FRAC_PI_2),
                [0.3; 2],
                Image::filled(64, 64, grey(1.0)),
            );
            let shot = Shot::new(at(0.3, 0.0, [3, 3]))
                .with_light(light)
                .with_card(upright);
            Ok(Outcome::near(
                render(&shot, &HIGH).shadow()[(1, 1)].g.into(),
                expected,
                0.02,
                "",
            ))
        },
    )
}

fn bright_beside_dim() -> HardCase {
    let [bright, dim] = [1e5, 1e-4].map(|power| lamp([0.3, 0.2, 0.9], 0.001, power));
    let expected = from_a_point(&bright) + from_a_point(&dim);
    HardCase::new(
        "light of 1e5 W beside one of 1e-4 W",
        "both small, in one place, over a white level card",
        format!("their sum: {expected:.1}, to 0.1 %"),
        move || {
            let found = seen(
                small_shot().with_light(bright).with_light(dim),
                &RenderOptions::default(),
            );
            Ok(Outcome::near(found / expected, 1.0, 1e-3, "of it"))
        },
    )
}

/// What a card throws on the surface where it hides one light and not the other.
fn dim_in_the_shade() -> HardCase {
    let (bright, dim) = (
        lamp([0.0, 0.0, 0.9], 0.01, 1e5),
        lamp([0.9, 0.0, 0.9], 0.01, 1e-4),
    );
    let expected = from_a_point(&dim) / (from_a_point(&bright) + from_a_point(&dim));
    HardCase::new(
        "light of 1e-4 W in the shadow of one of 1e5 W",
        "an opaque card hides the bright light from the surface, not the dim one",
        format!(
            "{expected:.2e} of the light is left, to the rounding of single precision (1.2e-7)"
        ),
        move || {
            let shot = Shot::new(at(0.0, 0.0, [3, 3]))
                .with_light(bright)
                .with_light(dim);
            let shot = shot.with_card(level_card(1, [0.0, 0.0, 0.5], 0.2, grey(1.0)));
            let left = f64::from(render(&shot, &RenderOptions::default()).shadow()[(1, 1)].g);
            Ok(Outcome::near(left, expected, f64::from(f32::EPSILON), ""))
        },
    )
}

/// A sky of 1e-4 with a sun of 2 x 2 texels of 1e5, 45 degrees above `+x`.
fn sunny() -> Image<LinearRgb> {
    let value = |x: usize, y: usize| {
        if (255..257).contains(&x) && (63..65).contains(&y) {
            1e5
        } else {
            1e-4
        }
    };
    Image::from_fn(512, 256, |x, y| LinearRgb::grey(value(x, y)))
}

fn surroundings() -> petcomp::Result<EnvironmentMap> {
    Ok(EnvironmentMap::new(Arc::new(Panorama::new(sunny())?)))
}

/// Irradiance of a level receiver by the midpoint rule over the upper half of the map, `fine` times as dense as texels, from
/// the part of the sky that `counts`.
fn by_brute_force(map: &EnvironmentMap, counts: impl Fn(&Vector3<f64>) -> bool) -> f64 {
    let fine = 4_usize;
    let (columns, rows) = (512 * fine, 128 * fine);
    let cell = |i: usize, j: usize| {
        let d = uv_to_direction([
            (i as f64 + 0.5) / columns as f64,
            (j as f64 + 0.5) / (2 * rows) as f64,
        ]);
        let solid_angle = TAU / columns as f64 * (FRAC_PI_2 / rows as f64) * d.xy().norm();
        if counts(&d) {
            f64::from(map.radiance(&d).g) * d.z * solid_angle
        } else {
            0.0
        }
    };
    (0..rows)
        .map(|j| (0..columns).map(|i| cell(i, j)).sum::<f64>())
        .sum()
}

fn sun() -> HardCase {
    HardCase::new(
        "sun of 1e5 in a sky of 1e-4",
        "a map of 512 x 256 with 4 texels of sun, over a white level card",
        "the midpoint rule over 1 M directions, to 0.5 %",
        || {
            let map = surroundings()?;
            let expected = by_brute_force(&map, |_| true) / PI;
            let found = seen(
                small_shot().with_environment(map),
                &RenderOptions::default(),
            );
            Ok(Outcome::near(found / expected, 1.0, 5e-3, "of it"))
        },
    )
}

fn sun_in_the_shade() -> HardCase {
    HardCase::new(
        "sky of 1e-4 in the shadow of a sun of 1e5",
        "the surface where a small opaque card hides the sun",
        "what the rest of the sky gives, as a share of all, by the midpoint rule: to 1e-4",
        || {
            let map = surroundings()?;
            let to_sun = uv_to_direction([0.5, 0.25]);
            // A card of 2 cm across, 10 cm away towards the sun, hides everything within 5.7 degrees of it.
            let near_sun = |d: &Vector3<f64>| d.dot(&to_sun) > libm::cos(0.09);
            let expected = 1.0 - by_brute_force(&map, near_sun) / by_brute_force(&map, |_| true);
            let facing =
                UnitQuaternion::rotation_between(&Vector3::z(), &to_sun).unwrap_or_default();
            let shade = card(
                1,
                (to_sun * 0.1).into(),
                facing,
                [0.02; 2],
                Image::filled(64, 64, grey(1.0)),
            );
            let shot = Shot::new(at(0.0, 0.0, [3, 3]))
                .with_environment(map)
                .with_card(shade);
            let left = f64::from(render(&shot, &GOOD).shadow()[(1, 1)].g);
            Ok(Outcome::near(left, expected, 1e-4, ""))
        },
    )
}
