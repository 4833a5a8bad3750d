//! Light that is hard to sum, and plates that are hard to match.

use super::render::largest;
use super::staged::{camera_above, empty_scene, lamp};
use super::{HardCase, Outcome};
use petcomp::asset::Panorama;
use petcomp::geom::{Point3, Vector3};
use petcomp::light::{expose, irradiance, match_light_tint, plate_noise, radiance, sky_pieces};
use petcomp::scene::{AreaLight, EnvironmentMap, Exposure, LightShape, LightTint, Noise, Scene};
use petcomp::{Image, LinearRgb, Result};
use std::f64::consts::PI;
use std::sync::Arc;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let groups = [
        extreme_lamps(),
        extreme_skies(),
        invalid_maps(),
        plates_to_expose(),
        plates_to_match(),
        plates_with_noise(),
    ];
    Ok(groups.into_iter().flatten().collect())
}

fn extreme_lamps() -> Vec<HardCase> {
    let shapes = [LightShape::Rectangle, LightShape::Ellipse];
    let mut cases: Vec<_> = shapes.into_iter().flat_map(lamps_of_shape).collect();
    cases.push(HardCase::new(
        "receiver in the middle of a light",
        "a light of 1 x 1 m, the receiver at its centre",
        "finite: 0, since it emits away from its plane",
        || {
            let found = received(&lamp([0.0; 3], 1.0, 10.0));
            Ok(Outcome::near(found, 0.0, 0.0, "W/m2"))
        },
    ));
    cases
}

fn lamps_of_shape(shape: LightShape) -> [HardCase; 5] {
    let (sin, cos) = libm::sincos(1e-4);
    let grazing = [10.0 * cos, 0.0, 10.0 * sin];
    [
        small_lamp(shape, [0.3, 0.2, 0.9], 0.0, "of no size"),
        small_lamp(shape, [0.0, 0.0, 1e6], 0.1, "1000 km away"),
        small_lamp(shape, grazing, 1e-4, "grazing at 1e-4 rad"),
        wide_lamp(shape, [0.0, 0.0, 1e-6], 1.0, "1 um away"),
        wide_lamp(shape, [0.0, 0.0, 1.0], 1e6, "1000 km across"),
    ]
}

fn lamp_of_shape(shape: LightShape, position: [f64; 3], side: f64) -> AreaLight {
    AreaLight {
        shape,
        ..lamp(position, side, 10.0)
    }
}

fn lamp_case_name(shape: LightShape, what: &str) -> String {
    format!("{} {what}", format!("{shape:?}").to_lowercase())
}

fn received(light: &AreaLight) -> f64 {
    irradiance(light, Point3::origin(), Vector3::z()).g.into()
}

/// A light that is small as seen from the receiver: `P cos / (pi r^2)`.
fn small_lamp(shape: LightShape, position: [f64; 3], side: f64, what: &str) -> HardCase {
    let light = lamp_of_shape(shape, position, side);
    let to = Vector3::from(light.position);
    let expected = light.power * to.normalize().z / (PI * to.norm_squared());
    HardCase::new(
        lamp_case_name(shape, what),
        "10 W facing a level receiver",
        format!("irradiance of a point light P cos / (pi r^2) = {expected:.4e}, to 0.1 %"),
        move || Ok(Outcome::ratio(received(&light), expected, 1e-3)),
    )
}

/// A light that fills the sky: `pi L`.
fn wide_lamp(shape: LightShape, position: [f64; 3], side: f64, what: &str) -> HardCase {
    let light = lamp_of_shape(shape, position, side);
    let expected = PI * f64::from(radiance(&light).g);
    HardCase::new(
        lamp_case_name(shape, what),
        "10 W above a level receiver",
        format!("irradiance of an equally bright sky, pi L = {expected:.4e}, to 1 %"),
        move || Ok(Outcome::ratio(received(&light), expected, 0.01)),
    )
}

fn extreme_skies() -> Vec<HardCase> {
    vec![
        even_sky("entirely black map", (16, 8), 0.0),
        even_sky("map of one pixel of 1e5", (1, 1), 1e5),
        even_sky("map of the largest half float", (16, 8), 65504.0),
        even_sky("map of the smallest float", (16, 8), f32::MIN_POSITIVE),
        HardCase::new(
            "one texel of 1e5 among 1e-4",
            "a map of 64 x 32, cut into 32 pieces, for receivers with four orientations",
            "the sum over pieces is the irradiance of the whole map, to 1e-5",
            sum_pieces_of_sky,
        ),
    ]
}

fn invalid_maps() -> Vec<HardCase> {
    vec![
        refused_map("map with NaN", || spotted(f32::NAN), "at (5, 2)"),
        refused_map("map with infinity", || spotted(f32::INFINITY), "at (5, 2)"),
        refused_map("map with a negative value", || spotted(-1e-6), "at (5, 2)"),
        refused_map("map without pixels", || Image::new(0, 0), "0 pixels"),
    ]
}

fn refused_map(name: &str, image: fn() -> Image<LinearRgb>, cause: &'static str) -> HardCase {
    HardCase::refused(name, "an environment map", cause, move || {
        Panorama::new(image())
    })
}

/// Dim, except for one texel.
fn spotted(value: f32) -> Image<LinearRgb> {
    Image::from_fn(8, 4, |x, y| {
        LinearRgb::grey(if (x, y) == (5, 2) { value } else { 0.1 })
    })
}

/// A uniform sky of radiance L gives every receiver `pi L`.
fn even_sky(name: &str, (width, height): (usize, usize), radiance: f32) -> HardCase {
    let expected = PI * f64::from(radiance);
    HardCase::new(
        name,
        format!("{width} x {height} pixels"),
        format!("pi L = {expected:.4e} on receivers with any orientation, to 0.2 %"),
        move || {
            sum_even_sky(
                Image::filled(width, height, LinearRgb::grey(radiance)),
                expected,
            )
        },
    )
}

fn sum_even_sky(image: Image<LinearRgb>, expected: f64) -> Result<Outcome> {
    let map = EnvironmentMap::new(Arc::new(Panorama::new(image)?));
    let off = normals().map(|normal| (sum_of_pieces(&map, &normal) - expected).abs());
    let off = off.into_iter().fold(0.0, largest);
    let share = if expected > 0.0 { off / expected } else { off };
    Ok(Outcome::at_most(share, 2e-3, "off"))
}

/// Upwards, to a side, downwards, and between.
fn normals() -> [Vector3<f64>; 4] {
    [
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        [0.3, -0.8, 0.2],
    ]
    .map(|normal| Vector3::from(normal).normalize())
}

fn sum_of_pieces(map: &EnvironmentMap, normal: &Vector3<f64>) -> f64 {
    let pieces = sky_pieces(map, 32, normal);
    pieces.iter().map(|p| f64::from(p.irradiance.g)).sum()
}

fn sum_pieces_of_sky() -> Result<Outcome> {
    let sky = Image::from_fn(64, 32, |x, y| {
        LinearRgb::grey(if (x, y) == (20, 9) { 1e5 } else { 1e-4 })
    });
    let panorama = Arc::new(Panorama::new(sky)?);
    let map = EnvironmentMap::new(panorama.clone());
    let off = normals()
        .map(|normal| (sum_of_pieces(&map, &normal) / panorama.irradiance(&normal)[1] - 1.0).abs());
    let worst = off.into_iter().fold(0.0, largest);
    Ok(Outcome::at_most(worst, 1e-5, "off"))
}

/// A scene under uniform light, with unknown exposure and colour.
fn unexposed_scene(exposure: Exposure, cast: LightTint, ambient: LinearRgb) -> Scene {
    Scene {
        exposure,
        cast,
        ambient,
        ..empty_scene(camera_above([40, 30], 40.0))
    }
}

fn flat_plate(value: f32) -> Image<LinearRgb> {
    Image::filled(40, 30, LinearRgb::grey(value))
}

fn plate_with_glint() -> Image<LinearRgb> {
    let mut plate = flat_plate(0.5);
    plate[(7, 9)] = LinearRgb::grey(1e5);
    plate
}

fn large_plate(value: f32) -> Image<LinearRgb> {
    Image::filled(200, 200, LinearRgb::grey(value))
}

fn plates_to_expose() -> Vec<HardCase> {
    let one_pixel = Image::filled(1, 1, LinearRgb::grey(0.25));
    let darkest = flat_plate(f32::MIN_POSITIVE);
    vec![
        exposed("black plate", flat_plate(0.0), 0.0),
        exposed("plate of NaN", flat_plate(f32::NAN), 0.0),
        exposed_under(
            LinearRgb::BLACK,
            "plate without light in the scene",
            flat_plate(0.5),
            0.0,
        ),
        exposed(
            "plate of 0.5 with one pixel of 1e5",
            plate_with_glint(),
            -1.0,
        ),
        exposed("plate of the smallest float", darkest, -126.0),
        exposed("plate of one pixel", one_pixel, -2.0),
    ]
}

fn plates_to_match() -> Vec<HardCase> {
    [
        ("entirely black surface", 0.0),
        ("surface of NaN", f32::NAN),
        ("surface of grey 1e-30", 1e-30),
        ("surface of grey 1e30", 1e30),
    ]
    .map(|(name, value)| matched_tint(name, flat_plate(value)))
    .into()
}

fn plates_with_noise() -> Vec<HardCase> {
    let small = Image::filled(2, 2, LinearRgb::grey(0.5));
    let [nan, white, grey, black] = [f32::NAN, 1.0, 0.3, 0.0].map(large_plate);
    vec![
        measured_noise("plate too small to measure its noise", small, None),
        measured_noise("plate of NaN, 200 x 200", nan, None),
        measured_noise("plate clipped all over, 200 x 200", white, None),
        measured_noise("plate of one grey, 200 x 200", grey, Some(0.0)),
        measured_noise("plate of black, 200 x 200", black, Some(0.0)),
    ]
}

fn exposed(name: &str, plate: Image<LinearRgb>, expected_ev: f64) -> HardCase {
    exposed_under(LinearRgb::WHITE, name, plate, expected_ev)
}

/// Uniform light of 1 shows white as 1: the exposure must be the plate's white in stops, and 0 if
/// there is none.
fn exposed_under(
    ambient: LinearRgb,
    name: &str,
    plate: Image<LinearRgb>,
    expected_ev: f64,
) -> HardCase {
    HardCase::new(
        format!("exposure: {name}"),
        "matched to the plate's white",
        format!("an exposure of {expected_ev} EV, to 1e-4"),
        move || expose_plate(ambient, &plate, expected_ev),
    )
}

fn expose_plate(ambient: LinearRgb, plate: &Image<LinearRgb>, expected_ev: f64) -> Result<Outcome> {
    let matched = Exposure::MatchPlate { gain_ev: 0.0 };
    let scene = unexposed_scene(matched, LightTint::default(), ambient);
    Ok(match expose(scene, plate, None).exposure {
        Exposure::Ev(ev) => Outcome::near(ev, expected_ev, 1e-4, "EV"),
        _ => Outcome::failed("still unknown"),
    })
}

fn matched_tint(name: &str, plate: Image<LinearRgb>) -> HardCase {
    HardCase::new(
        format!("colour of light: {name}"),
        "taken from the surface",
        "white, to 1e-5",
        move || Ok(distance_from_white(&plate)),
    )
}

fn distance_from_white(plate: &Image<LinearRgb>) -> Outcome {
    let matched = LightTint::MatchSurface {
        share: 1.0,
        albedo: LinearRgb::WHITE,
    };
    let scene = unexposed_scene(Exposure::Ev(0.0), matched, LinearRgb::WHITE);
    let LightTint::Known(LinearRgb { r, g, b }) = match_light_tint(scene, plate).cast else {
        return Outcome::failed("still unknown");
    };
    let off = [r, g, b].map(|v| f64::from(v - 1.0).abs());
    Outcome::at_most(off.into_iter().fold(0.0, largest), 1e-5, "off")
}

/// The noise of a plate as the standard deviation at mid grey; none if it cannot be measured.
fn measured_noise(name: &str, plate: Image<LinearRgb>, expected: Option<f64>) -> HardCase {
    let expectation = expected.map_or("none is reported".into(), |sigma| {
        format!("a deviation of {sigma}, to 1e-4")
    });
    HardCase::new(
        format!("noise: {name}"),
        "measured",
        expectation,
        move || Ok(compare_noise(plate_noise(&plate), expected)),
    )
}

fn compare_noise(found: Noise, expected: Option<f64>) -> Outcome {
    match (found, expected) {
        (Noise::Known { shot, read }, Some(sigma)) => {
            Outcome::near((shot * 0.18 + read * read).sqrt(), sigma, 1e-4, "")
        }
        (noise, expected) => Outcome::new(
            format!("{noise:?}"),
            noise == Noise::None && expected.is_none(),
        ),
    }
}
