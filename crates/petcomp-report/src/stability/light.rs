//! Light that is hard to sum, and plates that are hard to match.

use super::render::largest;
use super::staged::{above, lamp, scene};
use super::{HardCase, Outcome};
use petcomp::Image;
use petcomp::LinearRgb;
use petcomp::Result;
use petcomp::asset::Panorama;
use petcomp::geom::{Point3, Vector3};
use petcomp::light::{expose, irradiance, match_light_tint, plate_noise, radiance, sky_pieces};
use petcomp::scene::{AreaLight, EnvironmentMap, Exposure, LightShape, LightTint, Noise, Scene};
use std::f64::consts::PI;
use std::sync::Arc;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let groups = [lamps(), skies(), plates()];
    Ok(groups.into_iter().flatten().collect())
}

fn lamps() -> Vec<HardCase> {
    let mut cases = Vec::new();
    for shape in [LightShape::Rectangle, LightShape::Ellipse] {
        let name = format!("{shape:?}").to_lowercase();
        cases.push(small(
            &name,
            AreaLight {
                shape,
                ..lamp([0.3, 0.2, 0.9], 0.0, 10.0)
            },
            "of no size",
        ));
        cases.push(small(
            &name,
            AreaLight {
                shape,
                ..lamp([0.0, 0.0, 1e6], 0.1, 10.0)
            },
            "1000 km away",
        ));
        let graze = libm::sincos(1e-4);
        cases.push(small(
            &name,
            AreaLight {
                shape,
                ..lamp([10.0 * graze.1, 0.0, 10.0 * graze.0], 1e-4, 10.0)
            },
            "grazing at 1e-4 rad",
        ));
        cases.push(wide(
            &name,
            AreaLight {
                shape,
                ..lamp([0.0, 0.0, 1e-6], 1.0, 10.0)
            },
            "1 um away",
        ));
        cases.push(wide(
            &name,
            AreaLight {
                shape,
                ..lamp([0.0, 0.0, 1.0], 1e6, 10.0)
            },
            "1000 km across",
        ));
    }
    cases.push(inside());
    cases
}

fn received(light: &AreaLight) -> f64 {
    irradiance(light, Point3::origin(), Vector3::z()).g.into()
}

/// A light that is small from where it is seen: `P cos / (pi r^2)`.
fn small(shape: &str, light: AreaLight, what: &str) -> HardCase {
    let to = Vector3::from(light.position);
    let expected = light.power * to.normalize().z / (PI * to.norm_squared());
    let promise = format!("a point's irradiance P cos / (pi r^2) = {expected:.4e}, to 0.1 %");
    HardCase::new(
        format!("{shape} {what}"),
        "10 W turned to a level receiver",
        promise,
        move || {
            Ok(Outcome::near(
                received(&light) / expected,
                1.0,
                1e-3,
                "of it",
            ))
        },
    )
}

/// A light that fills the sky: `pi L`.
fn wide(shape: &str, light: AreaLight, what: &str) -> HardCase {
    let expected = PI * f64::from(radiance(&light).g);
    let promise = format!("that of a sky as bright, pi L = {expected:.4e}, to 1 %");
    HardCase::new(
        format!("{shape} {what}"),
        "10 W over a level receiver",
        promise,
        move || {
            Ok(Outcome::near(
                received(&light) / expected,
                1.0,
                0.01,
                "of it",
            ))
        },
    )
}

fn inside() -> HardCase {
    HardCase::new(
        "receiver in the middle of a light",
        "a light of 1 x 1 m, the point its centre",
        "finite: 0, since it shines away",
        || {
            Ok(Outcome::near(
                received(&lamp([0.0; 3], 1.0, 10.0)),
                0.0,
                0.0,
                "W/m2",
            ))
        },
    )
}

fn skies() -> Vec<HardCase> {
    let refused = |name: &str, image: fn() -> Image<LinearRgb>, cause: &'static str| {
        HardCase::new(
            name,
            "an environment map",
            format!("refused, by \"{cause}\""),
            move || Ok(Outcome::refused(Panorama::new(image()), cause)),
        )
    };
    vec![
        sky("map all black", Image::filled(16, 8, LinearRgb::BLACK), 0.0),
        sky(
            "map of one pixel of 1e5",
            Image::filled(1, 1, LinearRgb::grey(1e5)),
            1e5,
        ),
        sky(
            "map of the largest half float",
            Image::filled(16, 8, LinearRgb::grey(65504.0)),
            65504.0,
        ),
        sky(
            "map of the smallest float",
            Image::filled(16, 8, LinearRgb::grey(f32::MIN_POSITIVE)),
            f32::MIN_POSITIVE,
        ),
        pieces_add_up(),
        refused("map with NaN", || spotted(f32::NAN), "at (5, 2)"),
        refused("map with infinity", || spotted(f32::INFINITY), "at (5, 2)"),
        refused("map with a negative value", || spotted(-1e-6), "at (5, 2)"),
        refused("map without pixels", || Image::new(0, 0), "0 pixels"),
    ]
}

/// Dim, but for one texel.
fn spotted(value: f32) -> Image<LinearRgb> {
    Image::from_fn(8, 4, |x, y| {
        LinearRgb::grey(if (x, y) == (5, 2) { value } else { 0.1 })
    })
}

/// An even sky of radiance L gives every receiver `pi L`.
fn sky(name: &str, image: Image<LinearRgb>, radiance: f32) -> HardCase {
    let expected = PI * f64::from(radiance);
    let promise = format!("pi L = {expected:.4e} on receivers turned any way, to 0.2 %");
    HardCase::new(
        name,
        format!("{} x {} pixels", image.width(), image.height()),
        promise,
        move || {
            let map = EnvironmentMap::new(Arc::new(Panorama::new(image.clone())?));
            let sums =
                NORMALS.map(|normal| sum_of_pieces(&map, &Vector3::from(normal).normalize()));
            let off = sums
                .map(|sum| (sum - expected).abs())
                .into_iter()
                .fold(0.0, largest);
            let share = if expected > 0.0 { off / expected } else { off };
            Ok(Outcome::at_most(share, 2e-3, "off"))
        },
    )
}

/// Upwards, to a side, downwards, and between.
const NORMALS: [[f64; 3]; 4] = [
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 0.0],
    [0.0, 0.0, -1.0],
    [0.3, -0.8, 0.2],
];

fn sum_of_pieces(map: &EnvironmentMap, normal: &Vector3<f64>) -> f64 {
    sky_pieces(map, 32, normal)
        .iter()
        .map(|piece| f64::from(piece.irradiance.g))
        .sum()
}

fn pieces_add_up() -> HardCase {
    HardCase::new(
        "one texel of 1e5 among 1e-4",
        "a map of 64 x 32, cut into 32 pieces, for receivers turned four ways",
        "pieces sum to the irradiance of the whole map, to 1e-5",
        || {
            let value = |x: usize, y: usize| if (x, y) == (20, 9) { 1e5 } else { 1e-4 };
            let panorama = Arc::new(Panorama::new(Image::from_fn(64, 32, |x, y| {
                LinearRgb::grey(value(x, y))
            }))?);
            let map = EnvironmentMap::new(panorama.clone());
            let off = NORMALS.map(|normal| {
                let normal = Vector3::from(normal).normalize();
                (sum_of_pieces(&map, &normal) / panorama.irradiance(&normal)[1] - 1.0).abs()
            });
            Ok(Outcome::at_most(
                off.into_iter().fold(0.0, largest),
                1e-5,
                "off",
            ))
        },
    )
}

/// A scene under even light, of which exposure and colour are open.
fn open(exposure: Exposure, cast: LightTint, ambient: LinearRgb) -> Scene {
    Scene {
        exposure,
        cast,
        ambient,
        ..scene(above([40, 30], 40.0))
    }
}

fn flat(value: f32) -> Image<LinearRgb> {
    Image::filled(40, 30, LinearRgb::grey(value))
}

fn plates() -> Vec<HardCase> {
    let lit = LinearRgb::WHITE;
    let one_glint = || {
        Image::from_fn(40, 30, |x, y| {
            LinearRgb::grey(if (x, y) == (7, 9) { 1e5 } else { 0.5 })
        })
    };
    vec![
        exposed("black plate", flat(0.0), lit, 0.0),
        exposed("plate of NaN", flat(f32::NAN), lit, 0.0),
        exposed(
            "plate without light in the scene",
            flat(0.5),
            LinearRgb::BLACK,
            0.0,
        ),
        exposed("plate of 0.5 with one pixel of 1e5", one_glint(), lit, -1.0),
        exposed(
            "plate of the smallest float",
            flat(f32::MIN_POSITIVE),
            lit,
            -126.0,
        ),
        exposed(
            "plate of one pixel",
            Image::filled(1, 1, LinearRgb::grey(0.25)),
            lit,
            -2.0,
        ),
        cast_of("surface all black", flat(0.0)),
        cast_of("surface of NaN", flat(f32::NAN)),
        cast_of("surface of grey 1e-30", flat(1e-30)),
        cast_of("surface of grey 1e30", flat(1e30)),
        noise_of(
            "plate too small to tell its noise",
            Image::filled(2, 2, LinearRgb::grey(0.5)),
            None,
        ),
        noise_of(
            "plate of NaN, 200 x 200",
            Image::filled(200, 200, LinearRgb::grey(f32::NAN)),
            None,
        ),
        noise_of(
            "plate clipped all over, 200 x 200",
            Image::filled(200, 200, LinearRgb::WHITE),
            None,
        ),
        noise_of(
            "plate of one grey, 200 x 200",
            Image::filled(200, 200, LinearRgb::grey(0.3)),
            Some(0.0),
        ),
        noise_of(
            "plate of black, 200 x 200",
            Image::filled(200, 200, LinearRgb::BLACK),
            Some(0.0),
        ),
    ]
}

/// Even light of 1 shows white as 1: what the exposure has to be is the plate's white in stops, and 0 where there is none.
fn exposed(name: &str, plate: Image<LinearRgb>, ambient: LinearRgb, expected_ev: f64) -> HardCase {
    let promise = format!("an exposure of {expected_ev} EV, to 1e-4");
    HardCase::new(
        format!("exposure: {name}"),
        "matched to the plate's white",
        promise,
        move || {
            let exposed = expose(
                open(
                    Exposure::MatchPlate { gain_ev: 0.0 },
                    LightTint::default(),
                    ambient,
                ),
                &plate,
            );
            let Exposure::Ev(ev) = exposed.exposure else {
                return Ok(Outcome::new("still unknown", false));
            };
            Ok(Outcome::near(ev, expected_ev, 1e-4, "EV"))
        },
    )
}

fn cast_of(name: &str, plate: Image<LinearRgb>) -> HardCase {
    HardCase::new(
        format!("colour of light: {name}"),
        "taken from the surface",
        "white, to 1e-5",
        move || {
            let known = match_light_tint(
                open(
                    Exposure::Ev(0.0),
                    LightTint::MatchSurface { share: 1.0 },
                    LinearRgb::WHITE,
                ),
                &plate,
            );
            let LightTint::Known(LinearRgb { r, g, b }) = known.cast else {
                return Ok(Outcome::new("still unknown", false));
            };
            let off = [r, g, b]
                .map(|v| f64::from(v - 1.0).abs())
                .into_iter()
                .fold(0.0, largest);
            Ok(Outcome::at_most(off, 1e-5, "off"))
        },
    )
}

/// The noise of a plate as the standard deviation at mid grey; none where nothing can be told.
fn noise_of(name: &str, plate: Image<LinearRgb>, expected: Option<f64>) -> HardCase {
    let promise = expected.map_or("none is told".into(), |sigma| {
        format!("a deviation of {sigma}, to 1e-4")
    });
    HardCase::new(format!("noise: {name}"), "measured", promise, move || {
        Ok(match (plate_noise(&plate), expected) {
            (Noise::Known { shot, read }, Some(sigma)) => {
                Outcome::near((shot * 0.18 + read * read).sqrt(), sigma, 1e-4, "")
            }
            (noise, expected) => Outcome::new(
                format!("{noise:?}"),
                noise == Noise::None && expected.is_none(),
            ),
        })
    })
}
