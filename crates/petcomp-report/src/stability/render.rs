//! Shots that are hard to render: very many layers, very near, edge-on, very bright beside very dim, very small and large.

use super::staged::{
    camera_above, camera_looking_at, card, grey, lamp, level_card, projected_area, rendered,
    small_shot, tilted,
};
use super::{HardCase, Outcome, memory, render_light};
use crate::render::GOOD;
use petcomp::DeepImage;
use petcomp::Image;
use petcomp::Quality;
use petcomp::Result;
use petcomp::composite;
use petcomp::geom::UnitQuaternion;
use petcomp::render::{RenderOptions, interreflect, render, render_reference};
use petcomp::scene::{Card, Shot};
use petcomp::{Film, LinearRgb, PremulRgba};
use std::f64::consts::FRAC_PI_2;

/// Layers of film in a pixel.
const LAYERS: u32 = 200;
/// A product or sum of that many single precision numbers is known to this.
const ROUNDING: f64 = LAYERS as f64 * f32::EPSILON as f64;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = vec![
        layers_for_the_eye(),
        layers_for_the_light(),
        tinted_layers(),
        near(),
        near_and_grazing(),
        one_pixel(),
        white_on_white(),
        sixteen_k(),
    ];
    cases.extend([60.0, 85.0, 89.0, 89.9].map(steep));
    cases.extend(render_light::cases());
    cases.extend(nothing_to_see());
    cases.extend(awkward());
    Ok(cases)
}

/// Level layers between 0.1 and 0.5 m under the camera's metre, larger than what it sees.
fn stack(texture: &Film) -> Shot {
    let shot = small_shot().with_light(lamp([0.3, 0.2, 0.9], 0.4, 10.0));
    (1..=LAYERS).fold(shot, |shot, id| {
        let center = [0.0, 0.0, 0.1 + 0.002 * f64::from(id)];
        let sheet = Image::filled(8, 8, *texture);
        shot.with_card(card(
            id,
            center,
            UnitQuaternion::identity(),
            [4.0; 2],
            sheet,
        ))
    })
}

fn thin(opacity: LinearRgb) -> Film {
    Film {
        color: LinearRgb::BLACK,
        opacity,
    }
}

fn layers_for_the_eye() -> HardCase {
    let expected = libm::pow(0.99, f64::from(LAYERS));
    HardCase::new(
        "200 layers of film before the eye",
        "200 level cards of transmittance 0.99 over one pixel",
        format!("0.99^200 = {expected:.6} passes, to 200 roundings"),
        move || {
            let deep = render(
                &stack(&thin(LinearRgb::grey(0.01))),
                &RenderOptions::default(),
            );
            let passes = f64::from(deep.flat(2, 2).transmittance().g);
            Ok(Outcome::near(passes, expected, ROUNDING, ""))
        },
    )
}

fn layers_for_the_light() -> HardCase {
    let expected = libm::pow(0.99, f64::from(LAYERS));
    HardCase::new(
        "200 layers of film before the light",
        "the surface under 200 level cards of transmittance 0.99",
        format!("0.99^200 = {expected:.6} of the light arrives, to 200 roundings"),
        move || {
            let deep = render(
                &stack(&thin(LinearRgb::grey(0.01))),
                &RenderOptions::default(),
            );
            Ok(Outcome::near(
                f64::from(deep.shadow()[(2, 2)].g),
                expected,
                ROUNDING,
                "",
            ))
        },
    )
}

fn tinted_layers() -> HardCase {
    let passes = [0.999, 0.99, 0.9];
    let expected = passes.map(|t: f64| libm::pow(t, f64::from(LAYERS)));
    HardCase::new(
        "200 layers of tinted film",
        "200 level cards that pass 0.999, 0.99 and 0.9 of red, green and blue",
        format!(
            "{:.4}, {:.4} and {:.1e} pass, to 200 roundings",
            expected[0], expected[1], expected[2]
        ),
        move || {
            let film = thin(passes.map(|t| (1.0 - t) as f32).into());
            let deep = render(&stack(&film), &RenderOptions::default());
            let [eye, light]: [[f32; 3]; 2] =
                [deep.flat(2, 2).transmittance(), deep.shadow()[(2, 2)]].map(Into::into);
            let found = eye.iter().zip(&expected).chain(light.iter().zip(&expected));
            let worst = found
                .map(|(found, t)| (f64::from(*found) - t).abs())
                .fold(0.0, f64::max);
            Ok(Outcome::at_most(worst, ROUNDING, "off"))
        },
    )
}

/// The most that alpha, light and depth of an opaque grey card that fills the picture are off.
fn off_a_full_card(deep: &DeepImage, depth: f64) -> f64 {
    let pixels = (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y)));
    let off = |(x, y)| match deep.at(x, y) {
        [s] => [(s.alpha, 1.0), (s.light.g, 0.5), (s.depth.0, depth as f32)]
            .into_iter()
            .map(|(found, expected)| f64::from((found - expected).abs()))
            .fold(0.0, f64::max),
        _ => f64::INFINITY,
    };
    pixels.map(off).fold(0.0, f64::max)
}

fn near() -> HardCase {
    HardCase::new(
        "camera 1 cm above a card",
        "an opaque card of albedo 1/2, 20 cm wide, 1 cm under the eye, under even light of 1",
        "alpha 1, light 1/2 and depth 0.01 m in every pixel, to 1e-5",
        || {
            let shot = Shot::new(camera_above([64, 48], 60.0)).with_ambient(LinearRgb::WHITE);
            let deep = render(
                &shot.with_card(level_card(1, [0.0, 0.0, 0.99], 0.2, grey(1.0))),
                &RenderOptions::default(),
            );
            Ok(Outcome::at_most(off_a_full_card(&deep, 0.01), 1e-5, "off"))
        },
    )
}

fn near_and_grazing() -> HardCase {
    HardCase::new(
        "camera 1 cm above a card, looking along it",
        "an opaque card 20 m wide, the eye 1 cm over it, tilted by 80 degrees, under even light of 1",
        "below the horizon, 1 pixel away from it, alpha 1 and light 1/2, to 1e-4; above it nothing",
        || {
            let camera = camera_looking_at(
                [0.0, 0.0, 0.01],
                [0.0, 0.01 * libm::tan(80_f64.to_radians()), 0.0],
                [65, 48],
                60.0,
            );
            let shot = Shot::new(camera).with_ambient(LinearRgb::WHITE);
            let deep = render(
                &shot.with_card(level_card(1, [0.0; 3], 20.0, grey(1.0))),
                &RenderOptions::default(),
            );
            // Where the card ends 10 m away: a hair under the horizon, 60 tan(10 degrees) above the middle.
            let horizon = 24.0 - 60.0 * libm::tan(10_f64.to_radians());
            let off = |y: usize| -> f64 {
                let expected = if y as f64 > horizon {
                    [1.0, 0.5]
                } else {
                    [0.0, 0.0]
                };
                let flat = deep.flat(32, y);
                f64::from(
                    (flat.opacity.g - expected[0])
                        .abs()
                        .max((flat.color.g - expected[1]).abs()),
                )
            };
            // The window of a pixel is three wide.
            let rows = (0..48).filter(|&y| (y as f64 + 0.5 - horizon).abs() > 2.0);
            Ok(Outcome::at_most(
                rows.map(off).fold(0.0, f64::max),
                1e-4,
                "off",
            ))
        },
    )
}

/// Places within a pixel that a steep card is looked at in.
const PLACES: u32 = 64;

/// A card that is nearly edge-on: what the picture shows of it, in pixels, is the area of its projected corners.
///
/// Each row of the picture has two samples a pixel: a strip thinner than their distance is met or missed, as it lies.
fn steep(degrees: f64) -> HardCase {
    const FOCAL: f64 = 400.0;
    const LENGTH: f64 = 0.2;
    let shown = move |place: u32| {
        let pixel = 0.9 / FOCAL;
        let center = [pixel * f64::from(place) / f64::from(PLACES), 0.0, 0.1];
        let texture = Image::filled(512, 512, grey(1.0));
        let sheet = card(
            1,
            center,
            tilted(degrees.to_radians()),
            [LENGTH; 2],
            texture,
        );
        Shot::new(camera_above([96, 128], FOCAL)).with_card(sheet)
    };
    let area = projected_area(&shown(0).cards[0], &shown(0).camera);
    let strip = 0.5 * LENGTH * FOCAL / 0.9;
    // Places a step apart meet a strip of so many pixels to one of them.
    let width = area / (LENGTH * FOCAL / 0.9);
    let mean_bound = 0.01 + 1.0 / (f64::from(PLACES) * width);
    HardCase::new(
        format!("card turned by {degrees} degrees"),
        format!(
            "an opaque card of which {area:.1} pixels are seen, at {PLACES} places across a pixel"
        ),
        format!(
            "coverage sums to the area of the projected corners: to {:.0} % on average, to a row of samples ({strip:.0} px) each",
            100.0 * mean_bound
        ),
        move || {
            let found: Vec<f64> = (0..PLACES)
                .map(|place| covered(&render(&shown(place), &RenderOptions::default())))
                .collect();
            // Moved sideways, a card shows a little more or less of itself.
            let areas: Vec<f64> = (0..PLACES)
                .map(|k| projected_area(&shown(k).cards[0], &shown(k).camera))
                .collect();
            let mean = found.iter().sum::<f64>() / areas.iter().sum::<f64>() - 1.0;
            let worst = found
                .iter()
                .zip(&areas)
                .map(|(f, a)| (f - a).abs())
                .fold(0.0, largest);
            let told = format!("{:+.2} % on average, {worst:.2} px at worst", 100.0 * mean);
            Ok(Outcome::new(told, mean.abs() < mean_bound && worst < strip))
        },
    )
}

/// Sum of coverage, pixels.
fn covered(deep: &DeepImage) -> f64 {
    let pixels = (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y)));
    pixels
        .flat_map(|(x, y)| deep.at(x, y))
        .map(|s| f64::from(s.alpha))
        .sum()
}

fn one_pixel() -> HardCase {
    HardCase::new(
        "one-pixel image",
        "a tilted card in a shadow of its own, seen by 1 x 1 pixel",
        "the middle pixel of 65 x 65 that the same camera sees, to 1e-5",
        || {
            let seen = |side: u32| {
                let shot = Shot::new(camera_above([side; 2], 50.0)).with_light(lamp(
                    [0.3, 0.2, 0.9],
                    0.4,
                    10.0,
                ));
                let sheet = Image::filled(64, 64, grey(0.6));
                let shot = shot.with_card(card(1, [0.02, 0.0, 0.2], tilted(0.5), [0.3; 2], sheet));
                let deep = render(&shot, &GOOD);
                let middle = (side / 2) as usize;
                (deep.flat(middle, middle), deep.shadow()[(middle, middle)])
            };
            let ((one, shade), (many, wide)) = (seen(1), seen(65));
            let off = [
                one.color.g - many.color.g,
                one.opacity.g - many.opacity.g,
                shade.g - wide.g,
            ];
            Ok(Outcome::at_most(
                off.iter().fold(0.0, |most, v| v.abs().max(most)).into(),
                1e-5,
                "off",
            ))
        },
    )
}

fn white_on_white() -> HardCase {
    HardCase::new(
        "light between two white planes",
        "a surface of albedo 1 under a white opaque card, which throws back all that it gets",
        "no more than 20 times as bright (light thrown back is held at 0.95); never infinite",
        || {
            let shot = small_shot().with_ambient(LinearRgb::WHITE);
            let shot = shot.with_card(level_card(
                1,
                [0.0, 0.0, 0.05],
                0.5,
                PremulRgba::new(1.0, 1.0, 1.0, 1.0),
            ));
            let deep = interreflect(
                render(&shot, &RenderOptions::default()),
                &shot,
                LinearRgb::WHITE,
            );
            let brightest = deep
                .shadow()
                .pixels()
                .iter()
                .map(|s| f64::from(s.r.max(s.g).max(s.b)));
            Ok(Outcome::at_most(
                brightest.fold(0.0, largest),
                1.0 / (1.0 - 0.95) * (1.0 + 1e-5),
                "times",
            ))
        },
    )
}

/// The larger number; NaN where one is.
pub(super) fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}

/// Pixels along a side of the largest picture.
const SIXTEEN_K: u32 = 16_384;
/// What that picture may take at most: factors on the plate and starts of samples are 4 GiB, samples a quarter.
const SIXTEEN_K_GIB: f64 = 6.0;
/// What it shows of a card of 2000 x 2000 pixels and 64 x 64 texels: alpha falls to one half over the outermost half texel,
/// which takes an eighth of a texel off each side.
const SHOWN: f64 = (2000.0 * (1.0 - 0.25 / 64.0)) * (2000.0 * (1.0 - 0.25 / 64.0));

fn sixteen_k() -> HardCase {
    HardCase::new(
        "16k image",
        "16384 x 16384 pixels with a card of 2000 x 2000 in the last corner",
        format!("{SHOWN:.0} pixels covered, to 1e-4; the last pixel's plate untouched; at most {SIXTEEN_K_GIB} GiB"),
        || {
            if let Some(free) = memory::available_gib().filter(|free| *free < SIXTEEN_K_GIB) {
                return Ok(Outcome::new(format!("not tried: {free:.1} GiB are free"), false));
            }
            let from_corner = |px: f64| (f64::from(SIXTEEN_K) / 2.0 - px) / 10_000.0;
            let center = [from_corner(1100.0), -from_corner(1100.0), 0.0];
            let sheet = level_card(1, center, 0.2, grey(1.0));
            let shot = Shot::new(camera_above([SIXTEEN_K; 2], 10_000.0)).with_ambient(LinearRgb::WHITE).with_card(sheet);
            let (deep, peak) = memory::peak_gib(|| render(&shot, &Quality::Draft.render()));
            let (found, last) = (covered(&deep), SIXTEEN_K as usize - 1);
            let fits = peak.is_none_or(|peak| peak < SIXTEEN_K_GIB);
            let right = (found / SHOWN - 1.0).abs() < 1e-4 && deep.shadow()[(last, last)] == LinearRgb::WHITE;
            let peak = peak.map_or(String::new(), |peak| format!(", {peak:.1} GiB"));
            Ok(Outcome::new(format!("{found:.0} pixels{peak}"), fits && right))
        },
    )
    .for_the_report()
}

/// Shots in which nothing can be seen of the card: no sample in any pixel, and a plate that keeps its bits.
fn nothing_to_see() -> Vec<HardCase> {
    let gray = || Image::filled(8, 8, grey(0.8));
    let flat = UnitQuaternion::identity;
    let shots: Vec<(&str, Card)> = vec![
        (
            "card edge-on",
            card(1, [0.0, 0.0, 0.1], tilted(FRAC_PI_2), [0.2; 2], gray()),
        ),
        (
            "card behind the eye",
            level_card(1, [0.0, 0.0, 2.0], 0.3, grey(0.8)),
        ),
        (
            "card without area",
            card(1, [0.0, 0.0, 0.1], flat(), [0.0, 0.2], gray()),
        ),
        (
            "card of negative size",
            card(1, [0.0, 0.0, 0.1], flat(), [-0.1, 0.2], gray()),
        ),
        (
            "card without end",
            card(1, [0.0, 0.0, 0.1], flat(), [f64::INFINITY, 0.2], gray()),
        ),
        (
            "card at no number",
            card(1, [f64::NAN, 0.0, 0.1], flat(), [0.1, 0.2], gray()),
        ),
        (
            "card without a texel",
            card(
                1,
                [0.0, 0.0, 0.1],
                flat(),
                [0.2; 2],
                Image::<PremulRgba>::new(0, 0),
            ),
        ),
        (
            "card that is transparent",
            level_card(1, [0.0, 0.0, 0.1], 0.2, PremulRgba::TRANSPARENT),
        ),
    ];
    let case = |(name, card): (&str, Card)| {
        let expectation = "no light, no coverage, in either renderer: exactly 0 px";
        HardCase::new(name, "alone over a plate", expectation, move || {
            let shot = Shot::new(camera_above([16, 12], 20.0))
                .with_card(card.clone())
                .with_ambient(LinearRgb::WHITE);
            let seen = |deep: DeepImage| {
                let pixels = composite::frame(&deep, None).into_vec();
                pixels
                    .iter()
                    .filter(|p| **p != PremulRgba::TRANSPARENT)
                    .count() as f64
            };
            let options = RenderOptions::default();
            Ok(Outcome::near(
                seen(render(&shot, &options)) + seen(render_reference(&shot, &options)),
                0.0,
                0.0,
                "px",
            ))
        })
    };
    shots.into_iter().map(case).collect()
}

/// Shots whose middle pixel has a known coverage.
fn awkward() -> Vec<HardCase> {
    let base =
        || Shot::new(camera_above([15, 11], 20.0)).with_light(lamp([0.3, 0.2, 0.9], 0.4, 10.0));
    let flat = UnitQuaternion::identity;
    let one = |center: [f64; 3], texture: Image<PremulRgba>| {
        base().with_card(card(1, center, flat(), [0.4; 2], texture))
    };
    let full = || Image::filled(8, 8, grey(0.8));
    let twice =
        one([0.0, 0.0, 0.1], full()).with_card(level_card(2, [0.0, 0.0, 0.1], 0.4, grey(0.5)));
    let through = card(
        1,
        [0.01, 0.0, 1.0],
        UnitQuaternion::from_euler_angles(0.0, 1.2, 0.0),
        [0.5; 2],
        full(),
    );
    let from_below = one([0.0, 0.0, 0.1], full()).with_light(lamp([0.0, 0.0, -1.0], 0.4, 10.0));
    // A lone texel is 0.8 in its middle and half of that at the card's edge, 4.4 pixels away; a pixel's window reaches 1.5.
    let faded = [0.8 * libm::pow(1.0 - 1.5 * 0.5 / 4.4, 2.0), 0.8];
    vec![
        covering(
            "card under the surface",
            one([0.0, 0.0, -0.1], full()),
            [0.8; 2],
        ),
        covering("card on the surface", one([0.0; 3], full()), [0.8; 2]),
        covering("two cards in one place", twice, [1.0 - 0.2 * 0.5; 2]),
        covering(
            "card in the plane of the light",
            one([0.0, 0.0, 0.9], full()),
            [0.8; 2],
        ),
        covering("light below the surface", from_below, [0.8; 2]),
        covering(
            "texture of one texel",
            one([0.0, 0.0, 0.1], Image::filled(1, 1, grey(0.8))),
            faded,
        ),
        covering(
            "texture of one column",
            one([0.0, 0.0, 0.1], Image::filled(1, 7, grey(0.8))),
            faded,
        ),
        covering(
            "card through the eye",
            base().with_card(through),
            [0.0, 1.0],
        ),
    ]
}

fn covering(name: &str, shot: Shot, [least, most]: [f64; 2]) -> HardCase {
    let coverage = if least == most {
        format!("{least}")
    } else {
        format!("{least:.2} to {most}")
    };
    let promise = format!(
        "coverage {coverage} in the middle (to 1e-5), light finite, shadows in 0..1, in either renderer"
    );
    HardCase::new(name, "under a light of 10 W", promise, move || {
        let options = RenderOptions::default();
        let ends = [render(&shot, &options), render_reference(&shot, &options)];
        let state = if ends.iter().all(is_sound) {
            "sound"
        } else {
            "not sound"
        };
        // A sum over nothing is -0.
        let found = ends.map(|deep| f64::from(deep.flat(7, 5).opacity.g) + 0.0);
        let right = found
            .iter()
            .all(|found| (least - 1e-5..=most + 1e-5).contains(found));
        Ok(Outcome::new(
            format!("{:.6} and {:.6}, {state}", found[0], found[1]),
            state == "sound" && right,
        ))
    })
}

/// Every pixel's light is finite, its coverage and its shadows lie in 0..1.
fn is_sound(deep: &DeepImage) -> bool {
    let share = |v: f32| (0.0..=1.0).contains(&v);
    let of_light = |s: &LinearRgb| share(s.r) && share(s.g) && share(s.b);
    let pixels = composite::frame(deep, None).into_vec();
    pixels.iter().all(|p| p.color().is_finite() && share(p.a))
        && deep.shadow().pixels().iter().all(of_light)
}
