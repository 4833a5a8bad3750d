//! Pictures that are hard to composite: very many layers, everything off, values at the ends of
//! their range.

use super::staged::{camera_above, count_drawn, rendered};
use super::{HardCase, Outcome};
use petcomp::composite::{finish, frame};
use petcomp::label::{LabelOptions, label};
use petcomp::scene::{PostProcess, Shot};
use petcomp::{DeepImage, DeepSample, Depth, Film, Image, LinearRgb, ObjectId, PremulRgba, Result};
use std::sync::Arc;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let cases = layers_and_shares().into_iter().chain(finishes());
    Ok(cases.collect())
}

fn layers_and_shares() -> Vec<HardCase> {
    vec![
        stacked_films(),
        HardCase::new(
            "10 000 layers of alpha 1/255",
            "white",
            "alpha 1 and light 1, to 1e-4, never above 1",
            || Ok(stack_pixels()),
        ),
        HardCase::new(
            "scene with everything switched off",
            "a plate; no card, light, ambient, environment, finish",
            "the plate's bits in every pixel, no shadow, no label: 0 differ",
            composite_with_everything_off,
        ),
        HardCase::new(
            "empty scene",
            "no card, no plate",
            "transparent black everywhere: 0 pixels differ",
            composite_empty_shot,
        ),
        HardCase::new(
            "shares with a sum slightly above 1",
            "300 objects that each hide 1/300 of a pixel, rounded up, over a plate of 1e5",
            "nothing of the plate is visible: 0, not negative",
            composite_shares_rounded_up,
        ),
        HardCase::new(
            "1e5 next to 1e-4",
            "two opaque cards in neighbouring pixels, over a plate of 1e5",
            "1e-4 is bit-identical",
            composite_bright_beside_dim,
        ),
        HardCase::new(
            "plate with one pixel of NaN",
            "64 x 48 pixels, no card",
            "only that pixel is NaN: 1",
            composite_broken_plate,
        ),
    ]
}

fn finishes() -> [HardCase; 4] {
    [
        exposed(200.0),
        exposed(-200.0),
        HardCase::new(
            "finish: sharpening a pixel of 1e5 among 1e-4",
            "an amount of 2",
            "every value in 0..3e5, and 1e-4 unchanged (to 1e-6) beyond the window of 4 pixels",
            || Ok(sharpen_spot()),
        ),
        HardCase::new(
            "one-pixel image",
            "a film of transmittance 1/2 and light 0.25 over a plate of 1",
            "0.75 exactly",
            composite_one_pixel,
        ),
    ]
}

fn default_shot() -> Shot {
    Shot::new(camera_above([64, 48], 60.0))
}

fn stacked_films() -> HardCase {
    let expected = libm::pow(0.97, 200.0);
    HardCase::new(
        "200 layers of film",
        "transmittance 0.97 and light 0.03 each, so that they converge to white",
        format!(
            "0.97^200 = {expected:.6} is transmitted, and 1 minus that is the light: to 200 roundings"
        ),
        move || Ok(stack_films(expected)),
    )
}

fn stack_films(expected: f64) -> Outcome {
    let film = Film::new(LinearRgb::grey(0.03), LinearRgb::grey(0.97));
    let all = (0..200).fold(Film::default(), |behind, _| film.over(behind));
    let transmittance_error = f64::from(all.transmittance().g) - expected;
    let light_error = f64::from(all.color.g) - (1.0 - expected);
    let off = transmittance_error.abs().max(light_error.abs());
    Outcome::at_most(off, 200.0 * f64::from(f32::EPSILON), "off")
}

fn stack_pixels() -> Outcome {
    let a = 1.0 / 255.0;
    let all = (0..10_000).fold(PremulRgba::TRANSPARENT, |behind, _| {
        PremulRgba::new(a, a, a, a).over(behind)
    });
    let passed = [all.a, all.g].iter().all(|v| (0.9999..=1.0).contains(v));
    Outcome::new(format!("alpha {:.7}, light {:.7}", all.a, all.g), passed)
}

/// A gradient in which no two pixels are alike.
fn gradient_plate() -> Image<LinearRgb> {
    Image::from_fn(64, 48, |x, y| {
        LinearRgb::new(0.1 + 0.01 * x as f32, f32::MIN_POSITIVE, 1e5 + y as f32)
    })
}

fn composite_with_everything_off() -> Result<Outcome> {
    let plate = Arc::new(gradient_plate());
    let shot = default_shot().with_plate(plate.clone());
    let deep = rendered(&shot);
    let framed = frame(&deep, Some(&plate));
    let out = finish(framed, &deep, Some(&plate), &PostProcess::default());
    let labels = label(&deep, &shot, &LabelOptions::default()).objects.len();
    let differences = count_differing(&out, &plate) + count_shadowed(&deep) + labels;
    Ok(Outcome::none(differences, "differ"))
}

fn count_differing(out: &Image<PremulRgba>, plate: &Image<LinearRgb>) -> usize {
    let pairs = out.pixels().iter().zip(plate.pixels());
    pairs.filter(|(p, q)| **p != q.opaque()).count()
}

fn count_shadowed(deep: &DeepImage) -> usize {
    let shadow = deep.shadow().pixels().iter();
    shadow.filter(|s| **s != LinearRgb::WHITE).count()
}

fn composite_empty_shot() -> Result<Outcome> {
    let deep = rendered(&default_shot().with_ambient(LinearRgb::WHITE));
    let out = frame(&deep, None);
    Ok(Outcome::none(count_drawn(&out), "px"))
}

/// A picture of one row from the samples of its pixels.
fn deep_row(pixels: Vec<Vec<DeepSample>>) -> DeepImage {
    DeepImage::from_pixels(Image::filled(pixels.len(), 1, LinearRgb::WHITE), pixels)
}

fn deep_sample(id: u32, light: f32, visible: f32) -> DeepSample {
    DeepSample {
        object: ObjectId(id),
        depth: Depth(1.0),
        light: LinearRgb::grey(light),
        alpha: visible,
        visible,
    }
}

fn even_plate(pixels: usize, value: f32) -> Image<LinearRgb> {
    Image::filled(pixels, 1, LinearRgb::grey(value))
}

fn composite_shares_rounded_up() -> Result<Outcome> {
    let share = (1.0 / 300.0_f32).next_up();
    let samples = (1..=300).map(|id| deep_sample(id, 0.0, share)).collect();
    let out = frame(&deep_row(vec![samples]), Some(&even_plate(1, 1e5)));
    // The sum of 300 rounded numbers has an error of up to 300 roundings, and the plate is 1e5
    // times brighter.
    let limit = 300.0 * 1e5 * f64::from(f32::EPSILON);
    let value = f64::from(out[(0, 0)].g);
    let passed = (0.0..=limit).contains(&value);
    Ok(Outcome::new(format!("{value:e}"), passed))
}

fn composite_bright_beside_dim() -> Result<Outcome> {
    let [bright, dim] = [deep_sample(1, 1e5, 1.0), deep_sample(2, 1e-4, 1.0)];
    let deep = deep_row(vec![vec![bright], vec![dim]]);
    let dimmed = frame(&deep, Some(&even_plate(2, 1e5)))[(1, 0)].g;
    Ok(Outcome::near(dimmed.into(), 1e-4_f32.into(), 0.0, ""))
}

fn composite_broken_plate() -> Result<Outcome> {
    let mut plate = gradient_plate();
    plate[(20, 30)].g = f32::NAN;
    let out = frame(&rendered(&default_shot()), Some(&plate));
    let broken = out.pixels().iter().filter(|p| !p.color().is_finite());
    Ok(Outcome::count(broken.count(), 1, "px"))
}

fn exposed(ev: f64) -> HardCase {
    HardCase::new(
        format!("finish: exposure of {ev} EV"),
        "pixels of 0, 1e-4 and 1",
        "black stays 0, the order is preserved, nothing is NaN",
        move || Ok(expose(ev)),
    )
}

fn expose(exposure_ev: f64) -> Outcome {
    let change = PostProcess {
        exposure_ev,
        ..PostProcess::default()
    };
    let pixels = [0.0, 1e-4, 1.0].map(|v| LinearRgb::grey(v).opaque());
    let picture = Image::from_vec(3, 1, pixels.to_vec());
    let out = finish(picture, &deep_row(vec![vec![]; 3]), None, &change);
    let [black, dim, bright] = [0, 1, 2].map(|x| out[(x, 0)].g);
    let passed = black == 0.0 && black <= dim && dim <= bright;
    Outcome::new(format!("{black:e}, {dim:e}, {bright:e}"), passed)
}

fn sharpen_spot() -> Outcome {
    let change = PostProcess {
        sharpening: 2.0,
        ..PostProcess::default()
    };
    let out = finish(bright_spot(), &deep_row(vec![]), None, &change);
    let greens = out.pixels().iter().map(|p| p.g);
    let [least, most] = [f32::min, f32::max].map(|pick| greens.clone().fold(out[(0, 0)].g, pick));
    let far = f64::from(out[(2, 2)].g);
    let passed = least >= 0.0 && most <= 3e5 && (far / 1e-4 - 1.0).abs() < 1e-6;
    Outcome::new(format!("{least:e} to {most:e}; far away {far:e}"), passed)
}

fn bright_spot() -> Image<PremulRgba> {
    let mut picture = Image::filled(33, 33, LinearRgb::grey(1e-4).opaque());
    picture[(16, 16)] = LinearRgb::grey(1e5).opaque();
    picture
}

fn composite_one_pixel() -> Result<Outcome> {
    let deep = deep_row(vec![vec![deep_sample(1, 0.25, 0.5)]]);
    let out = frame(&deep, Some(&even_plate(1, 1.0)));
    Ok(Outcome::near(out[(0, 0)].g.into(), 0.75, 0.0, ""))
}
