//! Light that is hard to render: grazing, without size, in the middle of a card, very bright next
//! to very dim.

use super::staged::{camera_above, card, grey, lamp, level_card, small_shot, tilted};
use super::{HardCase, Outcome};
use crate::render::{GOOD, HIGH, settings};
use petcomp::asset::{Panorama, uv_to_direction};
use petcomp::camera::Camera;
use petcomp::geom::{Point3, UnitQuaternion, Vector3};
use petcomp::light::{frame, polygon_irradiance, radiance};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{AreaLight, Card, EnvironmentMap, Shot};
use petcomp::{Image, LinearRgb, PremulRgba, Result};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

pub(super) fn cases() -> Vec<HardCase> {
    let mut cases: Vec<HardCase> = [10.0, 1.0, 0.1].map(grazing_light).into();
    cases.extend([1e-2, 1e-4, 1e-6, 0.0].map(small_light));
    cases.extend(
        settings()
            .into_iter()
            .filter(|(name, _)| ["normal", "high", "reference"].contains(name))
            .map(cut_by_the_horizon),
    );
    cases.extend([
        light_in_a_card(),
        bright_beside_dim(),
        dim_in_the_shade(),
        HardCase::new(
            "sun of 1e5 in a sky of 1e-4",
            "a map of 512 x 256 with 4 texels of sun, over a white level card",
            "the midpoint rule over 1 M directions, to 0.5 %",
            reflect_sunny_sky,
        ),
        HardCase::new(
            "sky of 1e-4 in the shadow of a sun of 1e5",
            "the surface where a small opaque card hides the sun",
            "the share of the rest of the sky, by the midpoint rule: to 1e-4",
            shade_sunny_sky,
        ),
    ]);
    cases
}

/// Light that the middle of a white level card at the origin reflects upwards, in a picture of 5 x
/// 5.
fn light_reflected(shot: Shot, options: &RenderOptions) -> f64 {
    let white = PremulRgba::new(1.0, 1.0, 1.0, 1.0);
    let card = level_card(1, [0.0; 3], 1.0, white);
    let deep = render(&shot.with_card(card), options);
    f64::from(deep.flat(2, 2).color.g)
}

/// The same with the default options, for a small shot under a light.
fn lit_by(light: AreaLight) -> f64 {
    light_reflected(small_shot().with_light(light), &RenderOptions::default())
}

/// Irradiance from a small flat light turned to the origin, approximated as a point, on a level
/// white card: `P cos / (pi r)^2`.
fn from_a_point(light: &AreaLight) -> f64 {
    let to = Vector3::from(light.position);
    light.power * to.normalize().z / (PI * PI * to.norm_squared())
}

fn grazing_light(degrees: f64) -> HardCase {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let light = lamp([10.0 * cos, 0.0, 10.0 * sin], 0.001, 1000.0);
    let expected = from_a_point(&light);
    HardCase::new(
        format!("light grazing at {degrees} degrees"),
        "a small light of 1000 W, 10 m away, over a white level card",
        format!("cosine law: {expected:.6e}, to 0.1 %"),
        move || {
            let ratio = lit_by(light) / expected;
            Ok(Outcome::near(ratio, 1.0, 1e-3, "of the closed form"))
        },
    )
}

fn small_light(side: f64) -> HardCase {
    let light = lamp([0.3, 0.2, 0.9], side, 10.0);
    let expected = from_a_point(&light);
    let name = if side > 0.0 {
        format!("light of {side} m")
    } else {
        "light without size".into()
    };
    HardCase::new(
        name,
        "10 W, 0.97 m away, over a white level card",
        format!("the limit of small lights, P cos / (pi r)^2 = {expected:.6}: to 0.1 %"),
        move || Ok(Outcome::ratio(lit_by(light), expected, 1e-3)),
    )
}

fn cut_by_the_horizon((quality, options): (&str, RenderOptions)) -> HardCase {
    let light = lamp([1.0, 0.0, 0.0], 1.0, 10.0);
    let expected = reflected_from_upper_half(&light);
    HardCase::new(
        format!("light half below the horizon, quality {quality}"),
        "an upright light of 1 x 1 m, 1 m away, half of it below the plane of a white level card",
        format!("Lambert's formula for the upper half, {expected:.6}: to 5 %, 0.07 stops"),
        move || {
            let found = light_reflected(small_shot().with_light(light), &options);
            Ok(Outcome::ratio(found, expected, 0.05))
        },
    )
}

fn reflected_from_upper_half(light: &AreaLight) -> f64 {
    let white = f64::from(radiance(light).g) / PI;
    let corners = frame(light).corners(light.size);
    polygon_irradiance(&corners, Point3::origin(), Vector3::z()) * white
}

/// A camera that sees 3 x 3 pixels of the surface around `x`, 0 from straight above and very close.
fn closeup_at(x: f64) -> Camera {
    let mut camera = camera_above([3, 3], 1e6);
    camera.camera_from_world.translation.vector.x = -x;
    camera
}

/// Share of the light that is left in the middle of a close-up.
fn shade_in_the_middle(shot: &Shot, options: &RenderOptions) -> f64 {
    render(shot, options).shadow()[(1, 1)].g.into()
}

fn light_in_a_card() -> HardCase {
    let expected = irradiance_from_the_left(0.0) / irradiance_from_the_left(-0.1);
    HardCase::new(
        "light inside a card",
        "an upright opaque card through the middle of a light of 0.2 x 0.2 m; the surface on one \
         side of it",
        format!("that half of the light: {expected:.4} of the irradiance, to 0.02 at quality high"),
        move || {
            let found = shade_in_the_middle(&light_in_a_card_shot(), &HIGH);
            Ok(Outcome::near(found, expected, 0.02, ""))
        },
    )
}

fn light_in_a_card_shot() -> Shot {
    let texture = Image::filled(64, 64, grey(1.0));
    let upright = card(1, [0.0, 0.0, 0.5], tilted(FRAC_PI_2), [0.3; 2], texture);
    Shot::new(closeup_at(0.3))
        .with_light(lamp([0.0, 0.0, 0.5], 0.2, 10.0))
        .with_card(upright)
}

/// From the part of the light on the right of `left`.
fn irradiance_from_the_left(left: f64) -> f64 {
    let corners = [[left, -0.1], [0.1, -0.1], [0.1, 0.1], [left, 0.1]];
    let corners = corners.map(|[x, y]| Point3::new(x, y, 0.5));
    polygon_irradiance(&corners, Point3::new(0.3, 0.0, 0.0), Vector3::z())
}

fn bright_beside_dim() -> HardCase {
    let [bright, dim] = [1e5, 1e-4].map(|power| lamp([0.3, 0.2, 0.9], 0.001, power));
    let expected = from_a_point(&bright) + from_a_point(&dim);
    HardCase::new(
        "light of 1e5 W next to one of 1e-4 W",
        "both small, at the same position, above a white level card",
        format!("their sum: {expected:.1}, to 0.1 %"),
        move || {
            let shot = small_shot().with_light(bright).with_light(dim);
            let found = light_reflected(shot, &RenderOptions::default());
            Ok(Outcome::ratio(found, expected, 1e-3))
        },
    )
}

/// The shadow of a card on the surface where it hides only one of two lights.
fn dim_in_the_shade() -> HardCase {
    let bright = lamp([0.0, 0.0, 0.9], 0.01, 1e5);
    let dim = lamp([0.9, 0.0, 0.9], 0.01, 1e-4);
    let expected = from_a_point(&dim) / (from_a_point(&bright) + from_a_point(&dim));
    HardCase::new(
        "light of 1e-4 W in the shadow of one of 1e5 W",
        "an opaque card hides the bright light from the surface, not the dim one",
        format!(
            "{expected:.2e} of the light is left, to the rounding of single precision (1.2e-7)"
        ),
        move || shade_bright_light(bright, dim, expected),
    )
}

fn shade_bright_light(bright: AreaLight, dim: AreaLight, expected: f64) -> Result<Outcome> {
    let shot = Shot::new(closeup_at(0.0))
        .with_light(bright)
        .with_light(dim)
        .with_card(level_card(1, [0.0, 0.0, 0.5], 0.2, grey(1.0)));
    let left = shade_in_the_middle(&shot, &RenderOptions::default());
    Ok(Outcome::near(left, expected, f64::from(f32::EPSILON), ""))
}

/// A sky of 1e-4 with a sun of 2 x 2 texels of 1e5, 45 degrees above `+x`.
fn sunny_sky() -> Image<LinearRgb> {
    Image::from_fn(512, 256, |x, y| {
        let is_sun = (255..257).contains(&x) && (63..65).contains(&y);
        LinearRgb::grey(if is_sun { 1e5 } else { 1e-4 })
    })
}

fn sunny_map() -> Result<EnvironmentMap> {
    Ok(EnvironmentMap::new(Arc::new(Panorama::new(sunny_sky())?)))
}

/// Cells of the midpoint rule, four times as dense as texels, over the upper half of the map:
/// columns and rows.
const SKY_CELLS: [usize; 2] = [512 * 4, 128 * 4];

/// Irradiance of a level receiver by the midpoint rule over the upper half of the map, from the
/// part of the sky that `counts`.
fn irradiance_by_brute_force(map: &EnvironmentMap, counts: impl Fn(&Vector3<f64>) -> bool) -> f64 {
    let [columns, rows] = SKY_CELLS;
    (0..rows)
        .map(|j| {
            let cells = (0..columns).map(|i| sky_cell(i, j));
            let counted = cells.map(|(d, solid_angle)| {
                if counts(&d) {
                    f64::from(map.radiance(&d).g) * d.z * solid_angle
                } else {
                    0.0
                }
            });
            counted.sum::<f64>()
        })
        .sum()
}

/// The direction and the solid angle of a cell of the midpoint rule.
fn sky_cell(i: usize, j: usize) -> (Vector3<f64>, f64) {
    let [columns, rows] = SKY_CELLS;
    let u = (i as f64 + 0.5) / columns as f64;
    let v = (j as f64 + 0.5) / (2 * rows) as f64;
    let d = uv_to_direction([u, v]);
    (
        d,
        TAU / columns as f64 * (FRAC_PI_2 / rows as f64) * d.xy().norm(),
    )
}

fn reflect_sunny_sky() -> Result<Outcome> {
    let map = sunny_map()?;
    let expected = irradiance_by_brute_force(&map, |_| true) / PI;
    let shot = small_shot().with_environment(map);
    let found = light_reflected(shot, &RenderOptions::default());
    Ok(Outcome::ratio(found, expected, 5e-3))
}

fn shade_sunny_sky() -> Result<Outcome> {
    let map = sunny_map()?;
    let expected = share_without_the_sun(&map);
    let shot = Shot::new(closeup_at(0.0))
        .with_environment(map)
        .with_card(card_before_the_sun());
    let left = shade_in_the_middle(&shot, &GOOD);
    Ok(Outcome::near(left, expected, 1e-4, ""))
}

fn direction_to_sun() -> Vector3<f64> {
    uv_to_direction([0.5, 0.25])
}

/// A card of 2 cm across, 10 cm away towards the sun.
fn card_before_the_sun() -> Card {
    let to_sun = direction_to_sun();
    let facing = UnitQuaternion::rotation_between(&Vector3::z(), &to_sun).unwrap_or_default();
    let texture = Image::filled(64, 64, grey(1.0));
    card(1, (to_sun * 0.1).into(), facing, [0.02; 2], texture)
}

/// The share of the light from directions that the card before the sun does not hide: 5.7 degrees
/// around the sun.
fn share_without_the_sun(map: &EnvironmentMap) -> f64 {
    let to_sun = direction_to_sun();
    let hidden = irradiance_by_brute_force(map, |d| d.dot(&to_sun) > libm::cos(0.09));
    1.0 - hidden / irradiance_by_brute_force(map, |_| true)
}
