//! Keys close to grey and pixels that are barely colours, in every profile of the keyer.

use super::{HardCase, Outcome};
use petcomp::matte::key::Profile;
use petcomp::matte::{KeyOptions, Keyed, Keying, Screen, key};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba, Result};

const GREEN: LinearRgb = LinearRgb::new(0.1, 0.75, 0.2);

pub(super) fn cases() -> Vec<HardCase> {
    let mut cases: Vec<HardCase> = [0.0, 1e-30, 1e-10, 1e-3].map(weak_screen).into();
    cases.extend(known_pixels());
    cases.extend([
        HardCase::new(
            "keyer: object of the screen's colour",
            "64 x 64 pixels of the key, in all four profiles",
            "nothing is left: the sum of matte and cut-out is 0",
            key_screen_color,
        ),
        HardCase::new(
            "keyer: values of 1e-42 to 1e30, some negative",
            "17 x 13 pixels, alpha 0 to 1.5, all stages, all four profiles",
            "no NaN in matte or cut-out: 0",
            key_extreme_pixels,
        ),
        HardCase::new(
            "keyer: NaN and infinity, robust profile",
            "9 x 9 pixels, one NaN, one with infinite alpha, a column of NaN in the garbage matte",
            "2 pixels and 9 mattes counted; matte in 0..1, cut-out finite",
            key_non_finite_pixels,
        ),
        HardCase::new(
            "keyer: windows of hundreds of pixels",
            "blurs of 300, edges and dilation of 100, in pictures of 1 x 1 to 5 x 1, all four \
             profiles",
            "every matte value in 0..1: 0 wrong",
            key_with_wide_windows,
        ),
        HardCase::new(
            "keyer: no pixels",
            "0 x 0, 0 x 5 and 5 x 0 pixels, all stages",
            "a matte and a cut-out without pixels: 0",
            key_no_pixels,
        ),
        HardCase::new(
            "keyer: 12 megapixels",
            "4000 x 3000 pixels, a pattern that repeats every 64",
            "the matte also repeats away from the border: 0 differ",
            key_twelve_megapixels,
        )
        .for_the_report(),
    ]);
    cases
}

/// Pixels whose matte Blender printed.
fn known_pixels() -> [HardCase; 4] {
    [
        known_pixel("keyer: one-pixel image", [0.3, 0.55, 0.25], 0.609_068_6),
        known_pixel("keyer: a negative value", [-0.2, 0.3, 0.1], 0.279_411_8),
        known_pixel("keyer: the key itself", [0.1, 0.75, 0.2], 0.0),
        known_pixel("keyer: brighter than white", [1.2, 2.5, 1.1], 1.0),
    ]
}

fn profiles() -> [Profile; 4] {
    Profile::ALL.map(|(_, profile)| profile)
}

/// Every stage of the keyer at work.
fn all_stages(profile: Profile) -> KeyOptions {
    KeyOptions {
        blur_pre: 3,
        clip_black: 0.1,
        clip_white: 0.9,
        blur_post: 3,
        dilate_distance: -2,
        feather_distance: 4,
        ..KeyOptions::for_profile(profile)
    }
}

/// Matte values outside 0..1 in several results.
fn outside_unit_range(keyed: impl Iterator<Item = Keyed>) -> Outcome {
    let wrong = keyed.map(|keyed| count_outside_unit_range(&keyed.matte));
    Outcome::none(wrong.sum(), "wrong")
}

fn count_outside_unit_range(matte: &Image<Coverage>) -> usize {
    let values = matte.pixels().iter();
    values.filter(|m| !(0.0..=1.0).contains(&m.0)).count()
}

fn weak_screen(saturation: f32) -> HardCase {
    HardCase::new(
        format!("keyer: grey screen, saturation {saturation:e}"),
        "nearly grey pixels against it, in all four profiles",
        "every matte value in 0..1: 0 wrong",
        move || key_weak_screen(saturation),
    )
}

fn key_weak_screen(saturation: f32) -> Result<Outcome> {
    let screen = LinearRgb::new(0.5, 0.5 + saturation, 0.5);
    let keyed = key_by_profiles(&nearly_grey_photo(), screen);
    Ok(outside_unit_range(keyed.into_iter()))
}

fn key_by_profiles(photo: &Image<LinearRgb>, screen: LinearRgb) -> [Keyed; 4] {
    profiles().map(|p| key(photo, screen, &KeyOptions::for_profile(p)))
}

fn nearly_grey_photo() -> Image<LinearRgb> {
    Image::from_fn(7, 5, |x, y| {
        LinearRgb::new(0.5, 0.49 + 0.005 * x as f32, 0.48 + 0.01 * y as f32)
    })
}

fn known_pixel(name: &str, value: [f32; 3], expected: f32) -> HardCase {
    let input = format!("{value:?} against {:?}", <[f32; 3]>::from(GREEN));
    let expectation = format!("a matte of {expected}, as in Blender 3.4.1, to 1e-7");
    HardCase::new(name, input, expectation, move || {
        key_known_pixel(value, expected)
    })
}

fn key_known_pixel(value: [f32; 3], expected: f32) -> Result<Outcome> {
    let photo = Image::filled(1, 1, value.into());
    let matte = key(&photo, GREEN, &KeyOptions::default()).matte[(0, 0)].0;
    Ok(Outcome::near(matte.into(), expected.into(), 1e-7, ""))
}

fn key_screen_color() -> Result<Outcome> {
    let keyed = key_by_profiles(&Image::filled(64, 64, GREEN), GREEN);
    let left = keyed.iter().map(light_and_coverage).sum();
    Ok(Outcome::near(left, 0.0, 0.0, ""))
}

/// Total light and coverage of a matte and a cut-out.
fn light_and_coverage(keyed: &Keyed) -> f64 {
    let cutout = keyed.cutout.pixels().iter().map(absolute_sum);
    let matte = keyed.matte.pixels().iter().map(|m| f64::from(m.0));
    cutout.sum::<f64>() + matte.sum::<f64>()
}

fn absolute_sum(p: &PremulRgba) -> f64 {
    f64::from(p.r.abs() + p.g.abs() + p.b.abs() + p.a)
}

fn key_extreme_pixels() -> Result<Outcome> {
    let photo = Image::from_fn(17, 13, extreme_pixel);
    let mut wrong = 0;
    for profile in profiles() {
        for options in [KeyOptions::for_profile(profile), all_stages(profile)] {
            let keyed = Keying::new(&photo, Screen::Color(GREEN)).run(&options)?;
            wrong += count_nan(&keyed);
        }
    }
    Ok(Outcome::none(wrong, "NaN"))
}

fn count_nan(keyed: &Keyed) -> usize {
    let mattes = keyed.matte.pixels().iter().filter(|m| m.0.is_nan());
    let pixels = keyed.cutout.pixels().iter().map(|p| [p.r, p.g, p.b, p.a]);
    let pixels = pixels.filter(|p| p.iter().any(|v| v.is_nan()));
    mattes.count() + pixels.count()
}

fn extreme_pixel(x: usize, y: usize) -> PremulRgba {
    let [r, g, b] = [0, 1, 2].map(|channel| extreme_value(x, y, channel));
    PremulRgba::new(r, g, b, [0.0, 0.5, 1.0, 1.5][(x + y) % 4])
}

fn extreme_value(x: usize, y: usize, channel: usize) -> f32 {
    const SIZES: [f32; 8] = [1e-42, 1e-38, 1e-30, 1e-10, 1.0, 1e10, 1e20, 1e30];
    let is_negative = (x + y + channel).is_multiple_of(5);
    SIZES[(x * 7 + y * 3 + channel * 5) % 8] * if is_negative { -1.0 } else { 1.0 }
}

fn key_non_finite_pixels() -> Result<Outcome> {
    let photo = non_finite_photo();
    let garbage = Image::from_fn(9, 9, |x, _| Coverage(if x == 0 { f32::NAN } else { 0.0 }));
    let job = Keying::new(&photo, Screen::Color(GREEN)).with_garbage(&garbage);
    let keyed = job.run(&all_stages(Profile::Robust))?;
    let pixels = keyed.deviations.unusable_pixels;
    let mattes = keyed.deviations.unusable_mattes;
    let is_sound = is_sound(&keyed);
    Ok(Outcome::new(
        format!("{pixels} pixels, {mattes} mattes, valid: {is_sound}"),
        (pixels, mattes, is_sound) == (2, 9, true),
    ))
}

fn non_finite_photo() -> Image<PremulRgba> {
    let mut photo = Image::filled(9, 9, GREEN.opaque());
    photo[(4, 4)].b = f32::NAN;
    photo[(5, 4)].a = f32::INFINITY;
    photo
}

/// Whether the matte is in 0..1 and the cut-out finite.
fn is_sound(keyed: &Keyed) -> bool {
    let mut cutout = keyed.cutout.pixels().iter();
    count_outside_unit_range(&keyed.matte) == 0
        && cutout.all(|p| p.color().is_finite() && p.a.is_finite())
}

fn key_with_wide_windows() -> Result<Outcome> {
    let photos = [(1, 1), (5, 1), (1, 5), (3, 2)].map(tiny_photo);
    let runs = profiles()
        .into_iter()
        .flat_map(|profile| photos.iter().map(move |photo| (profile, photo)));
    let keyed = runs.map(|(profile, photo)| key(photo, GREEN, &with_wide_windows(profile)));
    Ok(outside_unit_range(keyed))
}

fn tiny_photo((w, h): (usize, usize)) -> Image<LinearRgb> {
    Image::from_fn(w, h, |x, y| LinearRgb::new(0.3, 0.2 * (x + y) as f32, 0.25))
}

fn with_wide_windows(profile: Profile) -> KeyOptions {
    KeyOptions {
        blur_pre: 300,
        edge_kernel_radius: 100,
        blur_post: 300,
        dilate_distance: 100,
        feather_distance: -100,
        ..all_stages(profile)
    }
}

fn key_no_pixels() -> Result<Outcome> {
    let options = all_stages(Profile::Blender34);
    let keyed = [(0, 0), (0, 5), (5, 0)].map(|(w, h)| key(&Image::new(w, h), GREEN, &options));
    let pixels = keyed.map(|k| k.matte.pixels().len() + k.cutout.pixels().len());
    Ok(Outcome::none(pixels.iter().sum(), "px"))
}

/// Period of the pattern in the largest photo, and how far from the border its matte repeats,
/// pixels.
const TILE_PX: usize = 64;

fn key_twelve_megapixels() -> Result<Outcome> {
    let matte = key(&tiled_photo(), GREEN, &KeyOptions::default()).matte;
    Ok(Outcome::none(count_unrepeated(&matte), "differ"))
}

fn tiled_photo() -> Image<LinearRgb> {
    Image::from_fn(4000, 3000, |x, y| {
        let step = ((x % TILE_PX) * 7 + (y % TILE_PX) * 13) % 101;
        LinearRgb::new(0.3, 0.2 + 0.005 * step as f32, 0.25)
    })
}

/// Pixels away from the border that differ from those of the first inner tile.
fn count_unrepeated(matte: &Image<Coverage>) -> usize {
    let [columns, rows] = [4000, 3000].map(|side| TILE_PX..side - 2 * TILE_PX);
    let places = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    places
        .filter(|&(x, y)| matte[(x, y)] != matte[(x % TILE_PX + TILE_PX, y % TILE_PX + TILE_PX)])
        .count()
}
