//! Pictures that are hard to put together: very many layers, everything off, values at the ends of their range.

use super::staged::above;
use super::{HardCase, Outcome};
use petcomp::Image;
use petcomp::Result;
use petcomp::composite::{finish, frame};
use petcomp::label::{LabelOptions, label};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{PostProcess, Shot};
use petcomp::{DeepImage, DeepSample};
use petcomp::{Depth, Film, LinearRgb, ObjectId, PremulRgba};
use std::sync::Arc;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    Ok(vec![
        layers(),
        thousands_of_layers(),
        everything_off(),
        empty_without_plate(),
        rounded_up(),
        bright_beside_dim(),
        broken_plate(),
        exposed(200.0),
        exposed(-200.0),
        sharpened(),
        one_pixel(),
    ])
}

fn layers() -> HardCase {
    let expected = libm::pow(0.97, 200.0);
    HardCase::new(
        "200 films over each other",
        "transmittance 0.97 each, light 0.03, so that they tend to white",
        format!("0.97^200 = {expected:.6} passes and 1 minus that is the light: to 200 roundings"),
        move || {
            let film = Film::new(LinearRgb::grey(0.03), LinearRgb::grey(0.97));
            let all = (0..200).fold(Film::default(), |behind, _| film.over(behind));
            let off = [
                f64::from(all.transmittance().g) - expected,
                f64::from(all.color.g) - (1.0 - expected),
            ];
            Ok(Outcome::at_most(
                off[0].abs().max(off[1].abs()),
                200.0 * f64::from(f32::EPSILON),
                "off",
            ))
        },
    )
}

fn thousands_of_layers() -> HardCase {
    HardCase::new(
        "10 000 pixels of alpha 1/255 over each other",
        "white",
        "alpha 1 and light 1, to 1e-4, never above 1",
        || {
            let a = 1.0 / 255.0;
            let all = (0..10_000).fold(PremulRgba::TRANSPARENT, |behind, _| {
                PremulRgba::new(a, a, a, a).over(behind)
            });
            let passed = (0.9999..=1.0).contains(&all.a) && (0.9999..=1.0).contains(&all.g);
            Ok(Outcome::new(
                format!("alpha {:.7}, light {:.7}", all.a, all.g),
                passed,
            ))
        },
    )
}

/// Noise that looks like no constant.
fn plate(width: usize, height: usize) -> Image<LinearRgb> {
    Image::from_fn(width, height, |x, y| {
        LinearRgb::new(0.1 + 0.01 * x as f32, f32::MIN_POSITIVE, 1e5 + y as f32)
    })
}

fn everything_off() -> HardCase {
    HardCase::new(
        "scene with everything off",
        "a plate; no card, light, ambient, environment, finish",
        "the plate's bits in every pixel, no shadow, no label: 0 differ",
        || {
            let plate = Arc::new(plate(64, 48));
            let shot = Shot::new(above([64, 48], 60.0)).with_plate(plate.clone());
            let deep = render(&shot, &RenderOptions::default());
            let out = finish(
                frame(&deep, Some(&plate)),
                &deep,
                Some(&plate),
                &PostProcess::default(),
            );
            let pixels = out
                .pixels()
                .iter()
                .zip(plate.pixels())
                .filter(|(p, q)| **p != q.opaque())
                .count();
            let shadows = deep
                .shadow()
                .pixels()
                .iter()
                .filter(|s| **s != LinearRgb::WHITE)
                .count();
            let labels = label(&deep, &shot, &LabelOptions::default()).objects.len();
            Ok(Outcome::near(
                (pixels + shadows + labels) as f64,
                0.0,
                0.0,
                "differ",
            ))
        },
    )
}

fn empty_without_plate() -> HardCase {
    HardCase::new(
        "empty scene",
        "no card, no plate",
        "transparent black everywhere: 0 pixels differ",
        || {
            let deep = render(
                &Shot::new(above([64, 48], 60.0)).with_ambient(LinearRgb::WHITE),
                &RenderOptions::default(),
            );
            let out = frame(&deep, None);
            Ok(Outcome::near(
                out.pixels()
                    .iter()
                    .filter(|p| **p != PremulRgba::TRANSPARENT)
                    .count() as f64,
                0.0,
                0.0,
                "px",
            ))
        },
    )
}

/// A picture of one row from the samples of its pixels.
fn row(pixels: Vec<Vec<DeepSample>>) -> DeepImage {
    DeepImage::from_pixels(Image::filled(pixels.len(), 1, LinearRgb::WHITE), pixels)
}

fn sample(id: u32, light: f32, visible: f32) -> DeepSample {
    let depth = Depth(1.0);
    DeepSample {
        object: ObjectId(id),
        depth,
        light: LinearRgb::grey(light),
        alpha: visible,
        visible,
    }
}

fn rounded_up() -> HardCase {
    HardCase::new(
        "shares that add up to a little over 1",
        "300 objects that hide 1/300 of a pixel each, each rounded up, over a plate of 1e5",
        "nothing of the plate passes: 0, not below",
        || {
            let share = (1.0 / 300.0_f32).next_up();
            let deep = row(vec![(1..=300).map(|id| sample(id, 0.0, share)).collect()]);
            let out = frame(&deep, Some(&Image::filled(1, 1, LinearRgb::grey(1e5))));
            // The sum of 300 rounded numbers is known to 300 roundings, of which the plate is a 1e5-fold.
            let value = f64::from(out[(0, 0)].g);
            Ok(Outcome::new(
                format!("{value:e}"),
                (0.0..=300.0 * 1e5 * f64::from(f32::EPSILON)).contains(&value),
            ))
        },
    )
}

fn bright_beside_dim() -> HardCase {
    HardCase::new(
        "1e5 beside 1e-4",
        "two opaque cards in neighbouring pixels, over a plate of 1e5",
        "1e-4 keeps its bits",
        || {
            let deep = row(vec![vec![sample(1, 1e5, 1.0)], vec![sample(2, 1e-4, 1.0)]]);
            let out = frame(&deep, Some(&Image::filled(2, 1, LinearRgb::grey(1e5))));
            Ok(Outcome::near(
                out[(1, 0)].g.into(),
                1e-4_f32.into(),
                0.0,
                "",
            ))
        },
    )
}

fn broken_plate() -> HardCase {
    HardCase::new(
        "plate with one pixel of NaN",
        "64 x 48 pixels, no card",
        "no more than that pixel is NaN: 1",
        || {
            let mut plate = plate(64, 48);
            plate[(20, 30)].g = f32::NAN;
            let out = frame(
                &render(&Shot::new(above([64, 48], 60.0)), &RenderOptions::default()),
                Some(&plate),
            );
            let broken = out
                .pixels()
                .iter()
                .filter(|p| !p.color().is_finite())
                .count();
            Ok(Outcome::near(broken as f64, 1.0, 0.0, "px"))
        },
    )
}

fn exposed(ev: f64) -> HardCase {
    HardCase::new(
        format!("finish: exposure of {ev} EV"),
        "pixels of 0, 1e-4 and 1",
        "black stays 0, order stays, nothing is NaN",
        move || {
            let values = [0.0, 1e-4, 1.0];
            let picture =
                Image::from_vec(3, 1, values.map(|v| LinearRgb::grey(v).opaque()).to_vec());
            let change = PostProcess {
                exposure_ev: ev,
                ..PostProcess::default()
            };
            let out = finish(picture, &row(vec![vec![]; 3]), None, &change);
            let found = [0, 1, 2].map(|x| out[(x, 0)].g);
            let passed = found[0] == 0.0 && found[0] <= found[1] && found[1] <= found[2];
            Ok(Outcome::new(
                format!("{:e}, {:e}, {:e}", found[0], found[1], found[2]),
                passed,
            ))
        },
    )
}

fn sharpened() -> HardCase {
    HardCase::new(
        "finish: sharpening a pixel of 1e5 among 1e-4",
        "an amount of 2",
        "every value in 0..3e5, and 1e-4 kept (to 1e-6) where the window of 4 pixels does not reach",
        || {
            let picture = Image::from_fn(33, 33, |x, y| {
                LinearRgb::grey(if (x, y) == (16, 16) { 1e5 } else { 1e-4 }).opaque()
            });
            let change = PostProcess {
                sharpening: 2.0,
                ..PostProcess::default()
            };
            let out = finish(picture, &row(vec![]), None, &change);
            let [least, most] = [f32::min, f32::max]
                .map(|of| out.pixels().iter().map(|p| p.g).fold(out[(0, 0)].g, of));
            let far = f64::from(out[(2, 2)].g);
            let passed = least >= 0.0 && most <= 3e5 && (far / 1e-4 - 1.0).abs() < 1e-6;
            Ok(Outcome::new(
                format!("{least:e} to {most:e}; far away {far:e}"),
                passed,
            ))
        },
    )
}

fn one_pixel() -> HardCase {
    HardCase::new(
        "one-pixel image",
        "a film of transmittance 1/2 and light 0.25 over a plate of 1",
        "0.75 exactly",
        || {
            let out = frame(
                &row(vec![vec![sample(1, 0.25, 0.5)]]),
                Some(&Image::filled(1, 1, LinearRgb::WHITE)),
            );
            Ok(Outcome::near(out[(0, 0)].g.into(), 0.75, 0.0, ""))
        },
    )
}
