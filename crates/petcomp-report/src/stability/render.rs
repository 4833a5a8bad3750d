//! Shots that are hard to render: very many layers, very near, edge-on, very bright next to very
//! dim, very small and large.

use super::staged::{
    camera_above, camera_looking_at, card, count_drawn, grey, lamp, level_card, projected_area,
    rendered, small_shot, tilted,
};
use super::{HardCase, Outcome, memory, render_light};
use crate::render::GOOD;
use petcomp::composite;
use petcomp::geom::UnitQuaternion;
use petcomp::render::{RenderOptions, render, render_reference};
use petcomp::scene::{Card, Shot};
use petcomp::{DeepImage, DeepSample, Film, Image, LinearRgb, PremulRgba, Quality, Result};
use std::f64::consts::FRAC_PI_2;

/// Number of layers of film in a pixel.
const LAYER_COUNT: u32 = 200;
/// Error bound of a product or sum of this many single precision numbers.
const ROUNDING_ERROR: f64 = LAYER_COUNT as f64 * f32::EPSILON as f64;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = film_layers();
    cases.extend(extreme_pictures());
    cases.extend([60.0, 85.0, 89.0, 89.9].map(steep_card));
    cases.extend(render_light::cases());
    cases.extend(nothing_to_see());
    cases.extend(awkward_cards());
    cases.extend(awkward_textures());
    Ok(cases)
}

fn film_layers() -> Vec<HardCase> {
    vec![
        grey_layers(
            "eye",
            "200 level cards of transmittance 0.99 over one pixel",
            "passes",
            |deep| deep.flat(2, 2).transmittance().g,
        ),
        grey_layers(
            "light",
            "the surface under 200 level cards of transmittance 0.99",
            "of the light arrives",
            |deep| deep.shadow()[(2, 2)].g,
        ),
        tinted_layers(),
    ]
}

fn extreme_pictures() -> [HardCase; 5] {
    [
        HardCase::new(
            "camera 1 cm above a card",
            "an opaque card of albedo 1/2, 20 cm wide, 1 cm below the eye, under uniform light of 1",
            "alpha 1, light 1/2 and depth 0.01 m in every pixel, to 1e-5",
            render_near_card,
        ),
        HardCase::new(
            "camera 1 cm above a card, looking along it",
            "an opaque card 20 m wide, the eye 1 cm above it, tilted by 80 degrees, under uniform light of 1",
            "more than 2 pixels from the horizon: below it alpha 1 and light 1/2, above it nothing, to 1e-4",
            render_near_and_grazing,
        ),
        HardCase::new(
            "one-pixel image",
            "a tilted card in its own shadow, seen by 1 x 1 pixel",
            "the middle pixel of 65 x 65 from the same camera, to 1e-5",
            render_one_pixel,
        ),
        HardCase::new(
            "light between two white planes",
            "a surface of albedo 1 under a white opaque card, which reflects all light",
            "no more than 20 times as bright (reflected light is limited to 0.95); never infinite",
            reflect_between_planes,
        ),
        HardCase::new(
            "16k image",
            "16384 x 16384 pixels with a card of 2000 x 2000 in the last corner",
            format!(
                "{SHOWN_PX:.0} pixels covered, to 1e-4; the last pixel's plate unchanged; at most {SIXTEEN_K_GIB} GiB"
            ),
            || Ok(memory::shortage(SIXTEEN_K_GIB).unwrap_or_else(render_sixteen_k)),
        )
        .for_the_report(),
    ]
}

fn every_pixel(deep: &DeepImage) -> impl Iterator<Item = (usize, usize)> {
    let (w, h) = (deep.width(), deep.height());
    (0..h).flat_map(move |y| (0..w).map(move |x| (x, y)))
}

/// Level layers between 0.1 and 0.5 m under the camera's metre, larger than what it sees.
fn stacked_films(texture: Film) -> Shot {
    let shot = small_shot().with_light(lamp([0.3, 0.2, 0.9], 0.4, 10.0));
    (1..=LAYER_COUNT).fold(shot, |shot, id| {
        let center = [0.0, 0.0, 0.1 + 0.002 * f64::from(id)];
        let sheet = Image::filled(8, 8, texture);
        let level = UnitQuaternion::identity();
        shot.with_card(card(id, center, level, [4.0; 2], sheet))
    })
}

fn absorbing_film(opacity: LinearRgb) -> Film {
    Film {
        color: LinearRgb::BLACK,
        opacity,
    }
}

/// Transmittance of 200 layers of transmittance 0.99.
fn grey_layers(before: &str, input: &str, result: &str, at: fn(&DeepImage) -> f32) -> HardCase {
    let expected = libm::pow(0.99, f64::from(LAYER_COUNT));
    HardCase::new(
        format!("200 layers of film before the {before}"),
        input,
        format!("0.99^200 = {expected:.6} {result}, to 200 roundings"),
        move || {
            let deep = rendered(&stacked_films(absorbing_film(LinearRgb::grey(0.01))));
            let found = at(&deep).into();
            Ok(Outcome::near(found, expected, ROUNDING_ERROR, ""))
        },
    )
}

/// Transmittance of a tinted layer for red, green and blue.
const TINT: [f64; 3] = [0.999, 0.99, 0.9];

fn tinted_layers() -> HardCase {
    let expected = TINT.map(|t| libm::pow(t, f64::from(LAYER_COUNT)));
    let [r, g, b] = expected;
    HardCase::new(
        "200 layers of tinted film",
        "200 level cards of transmittance 0.999, 0.99 and 0.9 for red, green and blue",
        format!("{r:.4}, {g:.4} and {b:.1e} are transmitted, to 200 roundings"),
        move || Ok(render_tinted_layers(&expected)),
    )
}

fn render_tinted_layers(expected: &[f64; 3]) -> Outcome {
    let film = absorbing_film(TINT.map(|t| (1.0 - t) as f32).into());
    let deep = rendered(&stacked_films(film));
    let [eye, light] = [deep.flat(2, 2).transmittance(), deep.shadow()[(2, 2)]]
        .map(|passes| largest_error(passes, expected));
    Outcome::at_most(eye.max(light), ROUNDING_ERROR, "off")
}

fn largest_error(found: LinearRgb, expected: &[f64; 3]) -> f64 {
    let pairs = <[f32; 3]>::from(found).into_iter().zip(expected);
    pairs
        .map(|(found, t)| (f64::from(found) - t).abs())
        .fold(0.0, largest)
}

/// The largest error of alpha, light and depth of an opaque grey card that fills the picture.
fn error_of_full_card(deep: &DeepImage, depth: f64) -> f64 {
    let errors = every_pixel(deep).map(|(x, y)| match deep.at(x, y) {
        [sample] => error_of_grey_sample(sample, depth),
        _ => f64::INFINITY,
    });
    errors.fold(0.0, largest)
}

fn error_of_grey_sample(s: &DeepSample, depth: f64) -> f64 {
    [(s.alpha, 1.0), (s.light.g, 0.5), (s.depth.0, depth as f32)]
        .into_iter()
        .map(|(found, expected)| f64::from((found - expected).abs()))
        .fold(0.0, largest)
}

fn render_near_card() -> Result<Outcome> {
    let shot = Shot::new(camera_above([64, 48], 60.0))
        .with_ambient(LinearRgb::WHITE)
        .with_card(level_card(1, [0.0, 0.0, 0.99], 0.2, grey(1.0)));
    let off = error_of_full_card(&rendered(&shot), 0.01);
    Ok(Outcome::at_most(off, 1e-5, "off"))
}

fn render_near_and_grazing() -> Result<Outcome> {
    let deep = rendered(&grazing_shot());
    // Where the card ends, 10 m away: slightly below the horizon, which is 60 tan(10 degrees) above
    // the middle.
    let horizon = 24.0 - 60.0 * libm::tan(10_f64.to_radians());
    // The window of a pixel is three wide.
    let rows = (0..48).filter(|&y| (y as f64 + 0.5 - horizon).abs() > 2.0);
    let off = rows.map(|y| error_of_row(&deep, y, y as f64 > horizon));
    Ok(Outcome::at_most(off.fold(0.0, largest), 1e-4, "off"))
}

fn grazing_shot() -> Shot {
    let target = [0.0, 0.01 * libm::tan(80_f64.to_radians()), 0.0];
    let camera = camera_looking_at([0.0, 0.0, 0.01], target, [65, 48], 60.0);
    Shot::new(camera)
        .with_ambient(LinearRgb::WHITE)
        .with_card(level_card(1, [0.0; 3], 20.0, grey(1.0)))
}

fn error_of_row(deep: &DeepImage, y: usize, is_card: bool) -> f64 {
    let [opacity, color] = if is_card { [1.0, 0.5] } else { [0.0, 0.0] };
    let flat = deep.flat(32, y);
    let errors = [flat.opacity.g - opacity, flat.color.g - color];
    errors
        .map(|off| f64::from(off.abs()))
        .into_iter()
        .fold(0.0, largest)
}

/// Number of positions within a pixel at which a steep card is rendered.
const SUBPIXEL_POSITIONS: u32 = 64;
/// Focal length of the camera over a steep card, pixels.
const STEEP_FOCAL_PX: f64 = 400.0;
/// Side of a steep card, metres.
const STEEP_SIDE_M: f64 = 0.2;
/// The height of a steep card, whose centre is 0.9 m from the camera, in the picture: pixels.
const STEEP_SIDE_PX: f64 = STEEP_SIDE_M * STEEP_FOCAL_PX / 0.9;

/// A card that is nearly edge-on: its coverage, in pixels, must be the area of its projected
/// corners.
///
/// Each row of the picture has two samples per pixel: a strip thinner than their distance is hit or
/// missed, depending on its position.
fn steep_card(degrees: f64) -> HardCase {
    let area = area_of_card(&steep_shot(degrees, 0));
    // Half the height of the card: a row of samples.
    let strip = 0.5 * STEEP_SIDE_PX;
    // Positions one step apart hit a strip of this width to within one of them.
    let width = area / STEEP_SIDE_PX;
    let mean_bound = 0.01 + 1.0 / (f64::from(SUBPIXEL_POSITIONS) * width);
    HardCase::new(
        format!("card tilted by {degrees} degrees"),
        format!(
            "an opaque card with a visible area of {area:.1} pixels, at {SUBPIXEL_POSITIONS} positions within a pixel"
        ),
        format!(
            "the sum of coverage is the area of the projected corners: to {:.0} % on average, to a row of samples \
             ({strip:.0} px) each",
            100.0 * mean_bound
        ),
        move || {
            let (mean, worst) = steep_card_errors(degrees);
            let measured = format!("{:+.2} % on average, {worst:.2} px at worst", 100.0 * mean);
            Ok(Outcome::new(
                measured,
                mean.abs() < mean_bound && worst < strip,
            ))
        },
    )
}

fn steep_shot(degrees: f64, position: u32) -> Shot {
    let pixel = 0.9 / STEEP_FOCAL_PX;
    let x = pixel * f64::from(position) / f64::from(SUBPIXEL_POSITIONS);
    let texture = Image::filled(512, 512, grey(1.0));
    let rotation = tilted(degrees.to_radians());
    let sheet = card(1, [x, 0.0, 0.1], rotation, [STEEP_SIDE_M; 2], texture);
    Shot::new(camera_above([96, 128], STEEP_FOCAL_PX)).with_card(sheet)
}

fn area_of_card(shot: &Shot) -> f64 {
    projected_area(&shot.cards[0], &shot.camera)
}

/// The relative error of the mean coverage, and the largest error in pixels.
fn steep_card_errors(degrees: f64) -> (f64, f64) {
    let shots = (0..SUBPIXEL_POSITIONS).map(|position| steep_shot(degrees, position));
    // When moved sideways, a card shows slightly more or less of itself.
    let (found, areas): (Vec<f64>, Vec<f64>) = shots
        .map(|shot| (total_coverage(&rendered(&shot)), area_of_card(&shot)))
        .unzip();
    let mean = found.iter().sum::<f64>() / areas.iter().sum::<f64>() - 1.0;
    let errors = found.iter().zip(&areas).map(|(f, a)| (f - a).abs());
    (mean, errors.fold(0.0, largest))
}

/// Sum of coverage, pixels.
fn total_coverage(deep: &DeepImage) -> f64 {
    every_pixel(deep)
        .flat_map(|(x, y)| deep.at(x, y))
        .map(|s| f64::from(s.alpha))
        .sum()
}

fn render_one_pixel() -> Result<Outcome> {
    let pairs = middle_pixel(1).into_iter().zip(middle_pixel(65));
    let errors = pairs.map(|(a, b)| f64::from((a - b).abs()));
    Ok(Outcome::at_most(errors.fold(0.0, largest), 1e-5, "off"))
}

/// Light, opacity and shadow of the middle pixel of a picture of a tilted card.
fn middle_pixel(side: u32) -> [f32; 3] {
    let deep = render(&tilted_card_shot(side), &GOOD);
    let middle = (side / 2) as usize;
    let flat = deep.flat(middle, middle);
    let shadow = deep.shadow()[(middle, middle)];
    [flat.color.g, flat.opacity.g, shadow.g]
}

fn tilted_card_shot(side: u32) -> Shot {
    let sheet = Image::filled(64, 64, grey(0.6));
    Shot::new(camera_above([side; 2], 50.0))
        .with_light(lamp([0.3, 0.2, 0.9], 0.4, 10.0))
        .with_card(card(1, [0.02, 0.0, 0.2], tilted(0.5), [0.3; 2], sheet))
}

fn reflect_between_planes() -> Result<Outcome> {
    let white = PremulRgba::new(1.0, 1.0, 1.0, 1.0);
    let shot = small_shot()
        .with_ambient(LinearRgb::WHITE)
        .with_card(level_card(1, [0.0, 0.0, 0.05], 0.5, white));
    let deep = rendered(&Shot {
        interreflection: LinearRgb::WHITE,
        ..shot
    });
    let shadow = deep.shadow().pixels().iter();
    let brightest = shadow.map(|s| f64::from(s.r.max(s.g).max(s.b)));
    let limit = 1.0 / (1.0 - 0.95) * (1.0 + 1e-5);
    Ok(Outcome::at_most(
        brightest.fold(0.0, largest),
        limit,
        "times",
    ))
}

/// The larger number; NaN if either is.
pub(super) fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}

/// Pixels along a side of the largest picture.
const LARGEST_SIDE_PX: u32 = 16_384;
/// Maximum memory for that picture: factors on the plate and offsets of samples are 4 GiB, samples
/// a quarter.
const SIXTEEN_K_GIB: f64 = 6.0;
/// Visible area of a card of 2000 x 2000 pixels and 64 x 64 texels: alpha falls to one half over
/// the outermost half texel, which takes an eighth of a texel off each side.
const SHOWN_PX: f64 = (2000.0 * (1.0 - 0.25 / 64.0)) * (2000.0 * (1.0 - 0.25 / 64.0));

fn render_sixteen_k() -> Outcome {
    let shot = sixteen_k_shot();
    let (deep, peak) = memory::peak_gib(|| render(&shot, &Quality::Draft.render()));
    let found = total_coverage(&deep);
    let fits = peak.is_none_or(|peak| peak < SIXTEEN_K_GIB);
    let peak = peak.map_or(String::new(), |peak| format!(", {peak:.1} GiB"));
    Outcome::new(
        format!("{found:.0} pixels{peak}"),
        fits && is_last_pixel_lit(&deep) && (found / SHOWN_PX - 1.0).abs() < 1e-4,
    )
}

fn is_last_pixel_lit(deep: &DeepImage) -> bool {
    let last = LARGEST_SIDE_PX as usize - 1;
    deep.shadow()[(last, last)] == LinearRgb::WHITE
}

/// A card whose middle is 1100 pixels from the last corner.
fn sixteen_k_shot() -> Shot {
    let from_corner = (f64::from(LARGEST_SIDE_PX) / 2.0 - 1100.0) / 10_000.0;
    let sheet = level_card(1, [from_corner, -from_corner, 0.0], 0.2, grey(1.0));
    Shot::new(camera_above([LARGEST_SIDE_PX; 2], 10_000.0))
        .with_ambient(LinearRgb::WHITE)
        .with_card(sheet)
}

/// Shots in which the card is not visible: no sample in any pixel, and an unchanged plate.
fn nothing_to_see() -> Vec<HardCase> {
    let behind = level_card(1, [0.0, 0.0, 2.0], 0.3, grey(0.8));
    let transparent = level_card(1, [0.0, 0.0, 0.1], 0.2, PremulRgba::TRANSPARENT);
    vec![
        invisible("card edge-on", edge_on_card()),
        invisible("card behind the eye", behind),
        invisible("card without area", card_of_size([0.0, 0.2])),
        invisible("card of negative size", card_of_size([-0.1, 0.2])),
        invisible("infinite card", card_of_size([f64::INFINITY, 0.2])),
        invisible("card at NaN", card_at_nan()),
        invisible("card without a texel", card_without_texel()),
        invisible("transparent card", transparent),
    ]
}

fn card_of_size(size: [f64; 2]) -> Card {
    let level = UnitQuaternion::identity();
    card(1, [0.0, 0.0, 0.1], level, size, texture())
}

fn edge_on_card() -> Card {
    card(1, [0.0, 0.0, 0.1], tilted(FRAC_PI_2), [0.2; 2], texture())
}

fn card_at_nan() -> Card {
    let level = UnitQuaternion::identity();
    card(1, [f64::NAN, 0.0, 0.1], level, [0.1, 0.2], texture())
}

fn card_without_texel() -> Card {
    Card {
        texture: Image::<PremulRgba>::new(0, 0).into(),
        ..card_of_size([0.2; 2])
    }
}

fn texture() -> Image<PremulRgba> {
    Image::filled(8, 8, grey(0.8))
}

fn invisible(name: &str, card: Card) -> HardCase {
    let expectation = "no light, no coverage, in both renderers: exactly 0 px";
    HardCase::new(name, "a single card over a plate", expectation, move || {
        render_invisible(&card)
    })
}

fn render_invisible(card: &Card) -> Result<Outcome> {
    let shot = Shot::new(camera_above([16, 12], 20.0))
        .with_card(card.clone())
        .with_ambient(LinearRgb::WHITE);
    let seen = by_both_renderers(&shot).map(|deep| count_drawn(&composite::frame(&deep, None)));
    Ok(Outcome::none(seen.iter().sum(), "px"))
}

fn by_both_renderers(shot: &Shot) -> [DeepImage; 2] {
    let options = RenderOptions::default();
    [render(shot, &options), render_reference(shot, &options)]
}

/// Shots whose middle pixel has a known coverage.
fn awkward_cards() -> Vec<HardCase> {
    let from_below = card_at_height(0.1).with_light(lamp([0.0, 0.0, -1.0], 0.4, 10.0));
    let twice = card_at_height(0.1).with_card(level_card(2, [0.0, 0.0, 0.1], 0.4, grey(0.5)));
    let even = [0.8; 2];
    vec![
        covering("card below the surface", card_at_height(-0.1), even),
        covering("card on the surface", card_at_height(0.0), even),
        covering("two coincident cards", twice, [1.0 - 0.2 * 0.5; 2]),
        covering("card in the plane of the light", card_at_height(0.9), even),
        covering("light below the surface", from_below, even),
        covering("card through the eye", card_through_the_eye(), [0.0, 1.0]),
    ]
}

fn card_through_the_eye() -> Shot {
    let tilt = UnitQuaternion::from_euler_angles(0.0, 1.2, 0.0);
    lit_shot().with_card(card(1, [0.01, 0.0, 1.0], tilt, [0.5; 2], texture()))
}

/// The same for textures without a neighbouring texel.
fn awkward_textures() -> [HardCase; 2] {
    // A lone texel is 0.8 in its middle and half of that at the card's edge, 4.4 pixels away; a
    // pixel's window reaches 1.5.
    let faded = [0.8 * libm::pow(1.0 - 1.5 * 0.5 / 4.4, 2.0), 0.8];
    let [texel, column] = [1, 7].map(|height| {
        let texture = Image::filled(1, height, grey(0.8));
        lit_shot().with_card(textured_card(0.1, texture))
    });
    [
        covering("texture of one texel", texel, faded),
        covering("texture of one column", column, faded),
    ]
}

fn lit_shot() -> Shot {
    Shot::new(camera_above([15, 11], 20.0)).with_light(lamp([0.3, 0.2, 0.9], 0.4, 10.0))
}

fn card_at_height(height: f64) -> Shot {
    lit_shot().with_card(textured_card(height, texture()))
}

fn textured_card(height: f64, texture: Image<PremulRgba>) -> Card {
    let level = UnitQuaternion::identity();
    card(1, [0.0, 0.0, height], level, [0.4; 2], texture)
}

fn covering(name: &str, shot: Shot, [least, most]: [f64; 2]) -> HardCase {
    let coverage = if least == most {
        format!("{least}")
    } else {
        format!("{least:.2} to {most}")
    };
    let expectation = format!(
        "coverage {coverage} in the middle (to 1e-5), finite light, shadows in 0..1, in both renderers"
    );
    HardCase::new(name, "under a light of 10 W", expectation, move || {
        Ok(judge_coverage(&by_both_renderers(&shot), [least, most]))
    })
}

fn judge_coverage(pictures: &[DeepImage; 2], [least, most]: [f64; 2]) -> Outcome {
    let is_sound = pictures.iter().all(is_sound);
    let state = if is_sound { "valid" } else { "invalid" };
    let found = pictures.each_ref().map(middle_coverage);
    let expected = least - 1e-5..=most + 1e-5;
    Outcome::new(
        format!("{:.6} and {:.6}, {state}", found[0], found[1]),
        is_sound && found.iter().all(|found| expected.contains(found)),
    )
}

fn middle_coverage(deep: &DeepImage) -> f64 {
    // A sum over nothing is -0.
    f64::from(deep.flat(7, 5).opacity.g) + 0.0
}

/// Whether every pixel's light is finite, and its coverage and shadows are in 0..1.
fn is_sound(deep: &DeepImage) -> bool {
    let mut shadows = deep.shadow().pixels().iter().flat_map(|s| [s.r, s.g, s.b]);
    let frame = composite::frame(deep, None);
    let mut pixels = frame.pixels().iter();
    pixels.all(|p| p.color().is_finite() && is_share(p.a)) && shadows.all(is_share)
}

fn is_share(v: f32) -> bool {
    (0.0..=1.0).contains(&v)
}
