//! Keys that can hardly work and pixels that are hardly colours, in every profile of the keyer.

use super::{HardCase, Outcome};
use petcomp::Image;
use petcomp::matte::key::Profile;
use petcomp::matte::{KeyOptions, Keyed, Keying, Screen, key};
use petcomp::{Coverage, LinearRgb, PremulRgba};

const GREEN: LinearRgb = LinearRgb::new(0.1, 0.75, 0.2);

pub(super) fn cases() -> Vec<HardCase> {
    let mut cases: Vec<HardCase> = [0.0, 1e-30, 1e-10, 1e-3].map(weak).into();
    cases.extend([
        pixel("keyer: one-pixel image", [0.3, 0.55, 0.25], 0.609_068_6),
        pixel("keyer: a negative value", [-0.2, 0.3, 0.1], 0.279_411_8),
        pixel("keyer: the key itself", [0.1, 0.75, 0.2], 0.0),
        pixel("keyer: brighter than white", [1.2, 2.5, 1.1], 1.0),
        all_of_the_key(),
        extreme_pixels(),
        no_numbers(),
        wide_windows(),
        no_pixels(),
        twelve_megapixels(),
    ]);
    cases
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

/// Values of a matte that are no share, in all profiles.
fn no_shares(keyed: impl Iterator<Item = Keyed>) -> Outcome {
    let wrong = |keyed: Keyed| {
        keyed
            .matte
            .pixels()
            .iter()
            .filter(|m| !(0.0..=1.0).contains(&m.0))
            .count()
    };
    Outcome::near(keyed.map(wrong).sum::<usize>() as f64, 0.0, 0.0, "wrong")
}

fn weak(saturation: f32) -> HardCase {
    HardCase::new(
        format!("keyer: grey screen, {saturation:e} of colour"),
        "nearly grey pixels against it, in all four profiles",
        "every matte value in 0..1: 0 wrong",
        move || {
            let screen = LinearRgb::new(0.5, 0.5 + saturation, 0.5);
            let photo = Image::from_fn(7, 5, |x, y| {
                LinearRgb::new(0.5, 0.49 + 0.005 * x as f32, 0.48 + 0.01 * y as f32)
            });
            Ok(no_shares(Profile::ALL.iter().map(|(_, profile)| {
                key(&photo, screen, &KeyOptions::for_profile(*profile))
            })))
        },
    )
}

fn pixel(name: &str, value: [f32; 3], expected: f32) -> HardCase {
    let promise = format!("a matte of {expected}, as Blender 3.4.1 prints it, to 1e-7");
    HardCase::new(
        name,
        format!("{value:?} against {:?}", <[f32; 3]>::from(GREEN)),
        promise,
        move || {
            let keyed = key(
                &Image::filled(1, 1, value.into()),
                GREEN,
                &KeyOptions::default(),
            );
            Ok(Outcome::near(
                keyed.matte[(0, 0)].0.into(),
                expected.into(),
                1e-7,
                "",
            ))
        },
    )
}

fn all_of_the_key() -> HardCase {
    HardCase::new(
        "keyer: object of the screen's colour",
        "64 x 64 pixels of the key, in all four profiles",
        "nothing is left: matte and cut-out sum to 0",
        || {
            let photo = Image::filled(64, 64, GREEN);
            let left = |(_, profile): &(&str, Profile)| {
                let keyed = key(&photo, GREEN, &KeyOptions::for_profile(*profile));
                let light = keyed
                    .cutout
                    .pixels()
                    .iter()
                    .map(|p| f64::from(p.r.abs() + p.g.abs() + p.b.abs() + p.a));
                light.sum::<f64>()
                    + keyed
                        .matte
                        .pixels()
                        .iter()
                        .map(|m| f64::from(m.0))
                        .sum::<f64>()
            };
            Ok(Outcome::near(
                Profile::ALL.iter().map(left).sum(),
                0.0,
                0.0,
                "",
            ))
        },
    )
}

fn extreme_pixels() -> HardCase {
    HardCase::new(
        "keyer: values of 1e-42 to 1e30, some negative",
        "17 x 13 pixels, alphas of 0 to 1.5, all stages, all four profiles",
        "no NaN in matte or cut-out: 0",
        || {
            let sizes = [1e-42_f32, 1e-38, 1e-30, 1e-10, 1.0, 1e10, 1e20, 1e30];
            let photo = Image::from_fn(17, 13, |x, y| {
                let sign = |k: usize| {
                    if (x + y + k).is_multiple_of(5) {
                        -1.0
                    } else {
                        1.0
                    }
                };
                let at = |k: usize| sizes[(x * 7 + y * 3 + k * 5) % 8] * sign(k);
                PremulRgba::new(at(0), at(1), at(2), [0.0, 0.5, 1.0, 1.5][(x + y) % 4])
            });
            let mut wrong = 0;
            for (_, profile) in Profile::ALL {
                for opts in [KeyOptions::for_profile(profile), all_stages(profile)] {
                    let keyed = Keying::new(&photo, Screen::Color(GREEN)).run(&opts)?;
                    wrong += keyed.matte.pixels().iter().filter(|m| m.0.is_nan()).count();
                    wrong += keyed
                        .cutout
                        .pixels()
                        .iter()
                        .filter(|p| [p.r, p.g, p.b, p.a].iter().any(|v| v.is_nan()))
                        .count();
                }
            }
            Ok(Outcome::near(wrong as f64, 0.0, 0.0, "NaN"))
        },
    )
}

fn no_numbers() -> HardCase {
    HardCase::new(
        "keyer: NaN and infinity, robust profile",
        "9 x 9 pixels, one NaN, one of infinite alpha, a column of NaN in the garbage matte",
        "2 pixels and 9 mattes counted; matte in 0..1, cut-out finite",
        || {
            let mut photo = Image::filled(9, 9, GREEN.opaque());
            (photo[(4, 4)].b, photo[(5, 4)].a) = (f32::NAN, f32::INFINITY);
            let garbage =
                Image::from_fn(9, 9, |x, _| Coverage(if x == 0 { f32::NAN } else { 0.0 }));
            let job = Keying::new(&photo, Screen::Color(GREEN)).with_garbage(&garbage);
            let keyed = job.run(&all_stages(Profile::Robust))?;
            let counted = [
                keyed.deviations.unusable_pixels,
                keyed.deviations.unusable_mattes,
            ];
            let shares = keyed
                .matte
                .pixels()
                .iter()
                .all(|m| (0.0..=1.0).contains(&m.0));
            let finite = keyed
                .cutout
                .pixels()
                .iter()
                .all(|p| p.color().is_finite() && p.a.is_finite());
            let told = format!(
                "{} pixels, {} mattes, sound: {}",
                counted[0],
                counted[1],
                shares && finite
            );
            Ok(Outcome::new(told, counted == [2, 9] && shares && finite))
        },
    )
}

fn wide_windows() -> HardCase {
    HardCase::new(
        "keyer: windows of hundreds of pixels",
        "blurs of 300, edges and dilation of 100, in pictures of 1 x 1 to 5 x 1, all four profiles",
        "every matte value in 0..1: 0 wrong",
        || {
            let opts = |profile| KeyOptions {
                blur_pre: 300,
                edge_kernel_radius: 100,
                blur_post: 300,
                dilate_distance: 100,
                feather_distance: -100,
                ..all_stages(profile)
            };
            let sizes = [(1, 1), (5, 1), (1, 5), (3, 2)];
            let photos = sizes.map(|(w, h)| {
                Image::from_fn(w, h, |x, y| LinearRgb::new(0.3, 0.2 * (x + y) as f32, 0.25))
            });
            let runs = Profile::ALL
                .iter()
                .flat_map(|(_, profile)| photos.iter().map(move |photo| (*profile, photo)));
            Ok(no_shares(
                runs.map(|(profile, photo)| key(photo, GREEN, &opts(profile))),
            ))
        },
    )
}

fn no_pixels() -> HardCase {
    HardCase::new(
        "keyer: no pixel",
        "0 x 0, 0 x 5 and 5 x 0 pixels, all stages",
        "a matte and a cut-out of no pixel: 0",
        || {
            let keyed = |(w, h)| key(&Image::new(w, h), GREEN, &all_stages(Profile::Blender34));
            let count = |keyed: Keyed| keyed.matte.pixels().len() + keyed.cutout.pixels().len();
            Ok(Outcome::near(
                [(0, 0), (0, 5), (5, 0)]
                    .map(keyed)
                    .map(count)
                    .iter()
                    .sum::<usize>() as f64,
                0.0,
                0.0,
                "px",
            ))
        },
    )
}

fn twelve_megapixels() -> HardCase {
    const TILE: usize = 64;
    HardCase::new(
        "keyer: 12 megapixels",
        "4000 x 3000 pixels, a pattern that repeats every 64",
        "the matte repeats, too, away from the border: 0 differ",
        || {
            let at = |x: usize, y: usize| ((x % TILE) * 7 + (y % TILE) * 13) % 101;
            let photo = Image::from_fn(4000, 3000, |x, y| {
                LinearRgb::new(0.3, 0.2 + 0.005 * at(x, y) as f32, 0.25)
            });
            let matte = key(&photo, GREEN, &KeyOptions::default()).matte;
            let places =
                (TILE..3000 - 2 * TILE).flat_map(|y| (TILE..4000 - 2 * TILE).map(move |x| (x, y)));
            let differ = places
                .filter(|&(x, y)| matte[(x, y)] != matte[(x % TILE + TILE, y % TILE + TILE)])
                .count();
            Ok(Outcome::near(differ as f64, 0.0, 0.0, "differ"))
        },
    )
    .for_the_report()
}
