//! Single pixels and rows with the digits that Blender prints. Whole pictures are held against
//! Blender in `tests/golden`, numbers at their extremes are rows of `petcomp-report stability`.

#![expect(
    clippy::excessive_precision,
    reason = "numbers with the nine digits that Blender prints"
)]

use super::*;

const GREEN: LinearRgb = LinearRgb::new(0.1, 0.75, 0.2);
const LATE: Profile = Profile::Blender45;

fn with_balances(b: f32, f: f32, e: f32) -> KeyOptions {
    KeyOptions {
        screen_balance: b,
        despill_factor: f,
        despill_balance: e,
        ..KeyOptions::default()
    }
}

fn keyed_pixel(pixel: [f32; 3], key_color: [f32; 3], options: &KeyOptions) -> (f32, [f32; 4]) {
    let keyed = key(
        &Image::filled(1, 1, pixel.into()),
        key_color.into(),
        options,
    );
    let c = keyed.cutout[(0, 0)];
    (keyed.matte[(0, 0)].0, [c.r, c.g, c.b, c.a])
}

/// A matte from garbage alone: what a row operation makes of given values.
fn row_operation(values: &[f32], options: &KeyOptions) -> Vec<f32> {
    let photo = Image::filled(values.len(), 1, LinearRgb::grey(0.3));
    let garbage = Image::from_vec(
        values.len(),
        1,
        values.iter().map(|v| Coverage(1.0 - v)).collect(),
    );
    let job = Keying::new(&photo, Screen::Color(GREEN)).with_garbage(&garbage);
    job.matte(options)
        .unwrap()
        .pixels()
        .iter()
        .map(|m| m.0)
        .collect()
}

const ROW: [f32; 12] = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.25];

/// Pixel, key, the three balances, matte and cut-out.
type Vector = ([f32; 3], [f32; 3], [f32; 3], f32, [f32; 4]);

#[test]
fn pixels_come_out_as_in_blender() {
    let (blue, cyan) = ([0.1, 0.2, 0.8], [0.1, 0.7, 0.7]);
    let (green, grey) = ([0.1, 0.75, 0.2], [0.5; 3]);
    let cases: [Vector; 11] = [
        ([0.1, 0.75, 0.2], green, [0.5, 1.0, 0.5], 0.0, [0.0; 4]),
        (
            [0.3, 0.55, 0.25],
            green,
            [0.5, 1.0, 0.5],
            0.609068632,
            [0.182720602, 0.16749388, 0.152267158, 0.609068632],
        ),
        (
            [0.3, 0.55, 0.25],
            green,
            [0.0, 1.0, 0.0],
            0.488636374,
            [0.146590918, 0.122159094, 0.122159094, 0.488636374],
        ),
        (
            [0.3, 0.55, 0.25],
            green,
            [1.0, 1.0, 1.0],
            0.700854659,
            [0.210256413, 0.210256413, 0.175213665, 0.700854659],
        ),
        (
            [0.6, 0.5, 0.4],
            green,
            [0.5, 1.0, 0.5],
            1.0,
            [0.6, 0.5, 0.4, 1.0],
        ),
        (
            [0.2, 0.4, 0.9],
            blue,
            [0.3, 0.5, 0.3],
            0.293172777,
            [0.0586345568, 0.117269114, 0.181767121, 0.293172777],
        ),
        (
            [0.5, 0.6, 0.5],
            grey,
            [0.5, 1.0, 0.5],
            1.0,
            [0.5, 0.6, 0.5, 1.0],
        ),
        ([0.5, 0.4, 0.5], [1.0; 3], [0.5, 1.0, 0.5], 0.0, [0.0; 4]),
        (
            [1.2, 2.5, 1.1],
            green,
            [0.5, 1.0, 0.5],
            1.0,
            [1.2, 1.1500001, 1.1, 1.0],
        ),
        (
            [-0.2, 0.3, 0.1],
            green,
            [0.5, 1.0, 0.5],
            0.279411793,
            [-0.0558823608, -0.0139705911, 0.0279411804, 0.279411793],
        ),
        (
            [0.4, 0.7, 0.65],
            cyan,
            [0.5, 1.0, 0.5],
            0.750000119,
            [0.300000042, 0.525000095, 0.412500083, 0.750000119],
        ),
    ];
    for (pixel, key_color, [b, f, e], matte, image) in cases {
        let got = keyed_pixel(pixel, key_color, &with_balances(b, f, e));
        assert_eq!(got, (matte, image), "{pixel:?} against {key_color:?}");
    }
}

#[test]
fn overexposure_looks_at_alpha_in_blender_4_5_alone() {
    let options = KeyOptions {
        profile: LATE,
        ..with_balances(0.5, 1.0, 0.5)
    };
    assert_eq!(
        keyed_pixel([1.2, 2.5, 1.1], GREEN.into(), &options).0,
        0.602940977
    );
    assert_eq!(
        keyed_pixel([1.2, 2.5, 1.1], GREEN.into(), &KeyOptions::default()).0,
        1.0
    );
}

#[test]
fn row_operations_come_out_as_in_blender() {
    let of = |profile, change: fn(&mut KeyOptions)| {
        let mut options = KeyOptions::for_profile(profile);
        change(&mut options);
        row_operation(&ROW, &options)
    };
    let early = Profile::Blender34;
    let third = [
        0.0,
        0.0,
        0.0,
        0.333333343,
        0.666666687,
        1.0,
        0.833333313,
        0.5,
        0.166666672,
        0.0,
        0.0833333358,
        0.125,
    ];
    assert_eq!(of(early, |o| o.blur_post = 2), third);
    let third = [
        0.0,
        0.0,
        0.0,
        0.333333373,
        0.666666746,
        1.0,
        0.833333373,
        0.5,
        0.166666687,
        0.0,
        0.0833333433,
        0.166666687,
    ];
    let blurred = of(LATE, |o| o.blur_post = 3);
    assert_eq!(blurred[..5], third[..5]);
    assert_eq!(blurred[6..], third[6..]);
    let dilated = [0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5];
    assert_eq!(of(early, |o| o.dilate_distance = 4), dilated);
    let mut full = dilated;
    full[0] = 1.0;
    assert_eq!(of(LATE, |o| o.dilate_distance = 4), full);
    let feathered = [
        0.0,
        0.0,
        0.110695973,
        0.626597643,
        1.0,
        1.0,
        1.0,
        0.678326368,
        0.321161509,
        0.0670427307,
        0.154445693,
        0.25,
    ];
    assert_eq!(of(early, |o| o.feather_distance = 3), feathered);
    let inward = [
        0.0,
        0.0,
        0.0,
        0.0,
        0.372827768,
        0.866210938,
        0.677976489,
        0.321673632,
        0.0,
        0.0,
        0.0,
        0.25,
    ];
    assert_eq!(of(LATE, |o| o.feather_distance = -3), inward);
}

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

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let photo = Image::from_fn(20_000, 3, |x, y| {
        LinearRgb::new(0.3, 0.2 + ((x * 31 + y * 17) % 97) as f32 * 0.005, 0.25)
    });
    let tall = Image::from_fn(37, 211, |x, y| photo[((x * 211 + y) % 20_000, x % 3)]);
    let on = |threads: usize, photo: &Image<LinearRgb>, options: &KeyOptions| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| key(photo, GREEN, options).matte)
    };
    let runs = |profile| {
        [Blur::Exact, Blur::RunningSum].map(|blur| KeyOptions {
            blur,
            ..all_stages(profile)
        })
    };
    for options in Profile::ALL
        .into_iter()
        .flat_map(|(_, profile)| runs(profile))
    {
        assert!(on(1, &photo, &options) == on(3, &photo, &options));
        assert!(on(1, &tall, &options) == on(7, &tall, &options));
    }
}

#[test]
fn the_matte_alone_is_the_same_matte() {
    let photo = Image::from_fn(70, 40, |x, y| {
        LinearRgb::new(0.2, 0.01 * (x + y) as f32, 0.3)
    });
    let job = Keying::new(&photo, Screen::Color(GREEN));
    let options = all_stages(Profile::Blender42);
    assert!(job.matte(&options).unwrap() == job.run(&options).unwrap().matte);
}

#[test]
fn running_sums_are_blenders_up_to_its_own_rounding() {
    let photo = Image::from_fn(170, 130, |x, y| {
        let shade = ((x * 31 + y * 17) % 97) as f32 * 0.001;
        if (x / 30 + y / 20) % 3 == 0 {
            LinearRgb::new(0.6, 0.3 + shade, 0.2)
        } else {
            GREEN.map(|c| c + shade)
        }
    });
    let job = Keying::new(&photo, Screen::Color(GREEN));
    for (_, profile) in Profile::ALL {
        for size in [1, 2, 5, 6, 20, 60] {
            let matte = |blur_pre, blur| {
                let options = KeyOptions {
                    blur_pre,
                    blur_post: size,
                    blur,
                    ..KeyOptions::for_profile(profile)
                };
                job.matte(&options).unwrap()
            };
            let differ = |pre| {
                let (exact, running) = (matte(pre, Blur::Exact), matte(pre, Blur::RunningSum));
                let both = exact.pixels().iter().zip(running.pixels());
                both.map(|(a, b)| f64::from((a.0 - b.0).abs()))
                    .fold(0.0, f64::max)
            };
            // A pass adds up to 2 size samples within 0 to 1 in single precision, each addition
            // wrong by half a step at most; the running sum rounds each sample by as
            // little, once.
            let bound = f64::from(2 * (2 * size + 2)) * 2f64.powi(-24);
            assert!(
                differ(0) <= bound,
                "{profile:?} {size}: {} > {bound}",
                differ(0)
            );
            // An error e of both colour differences moves green by at most 0.75 e and the mean of
            // the others by 1.95 e, hence the matte by less than 4 e / S, with S = 0.51
            // for this screen.
            let bound = bound * (1.0 + 4.0 / 0.51);
            assert!(
                differ(size) <= bound,
                "{profile:?} {size}, chroma too: {} > {bound}",
                differ(size)
            );
        }
    }
}

#[test]
fn a_plate_of_one_colour_keys_like_that_colour() {
    let photo = Image::from_fn(70, 40, |x, y| {
        LinearRgb::new(0.2, 0.01 * (x + y) as f32, 0.3)
    });
    let plate = Image::filled(70, 40, GREEN);
    for (_, profile) in Profile::ALL {
        let options = all_stages(profile);
        let by_plate = Keying::new(&photo, Screen::Plate(&plate))
            .run(&options)
            .unwrap();
        let by_color = Keying::new(&photo, Screen::Color(GREEN))
            .run(&options)
            .unwrap();
        assert!(by_plate.matte == by_color.matte && by_plate.cutout == by_color.cutout);
    }
}

#[test]
fn what_cannot_be_keyed_is_refused_by_name() {
    let photo = Image::filled(4, 3, GREEN);
    let small = Image::new(2, 2);
    let message =
        |job: Keying<'_, LinearRgb>| job.run(&KeyOptions::default()).unwrap_err().to_string();
    let job = Keying::new(&photo, Screen::Color(GREEN));
    assert_eq!(
        message(job.with_garbage(&small)),
        "garbage: 2 x 2 pixels, expected the photo's 4 x 3"
    );
    let nan = Screen::Color(LinearRgb::new(f32::NAN, 0.0, 0.0));
    assert_eq!(
        message(Keying::new(&photo, nan)),
        "screen: [NaN, 0.0, 0.0], expected finite numbers"
    );
    let codes = Screen::Color(LinearRgb::new(20.0, 200.0, 40.0));
    assert_eq!(
        message(Keying::new(&photo, codes)),
        "screen: [20.0, 200.0, 40.0], expected scene-linear values, white is 1; \
         are these 8-bit codes?"
    );
}

#[test]
fn subtracting_the_screen_leaves_the_foreground() {
    let options = KeyOptions {
        subtract_screen: true,
        ignore_brightness: true,
        ..KeyOptions::default()
    };
    let front = LinearRgb::grey(0.4);
    let half = front.scale(0.5) + GREEN.scale(0.5);
    let keyed = key(&Image::filled(1, 1, half), GREEN, &options);
    assert!((keyed.matte[(0, 0)].0 - 0.5).abs() < 1e-6);
    let c = keyed.cutout[(0, 0)];
    assert!([c.r, c.g, c.b].iter().all(|v| (v - 0.2).abs() < 1e-6));
}

#[test]
fn pixels_that_are_no_numbers_are_background_to_the_robust_profile() {
    let mut photo = Image::filled(5, 1, LinearRgb::grey(0.3));
    photo[(2, 0)].b = f32::NAN;
    let plate = Image::filled(5, 1, GREEN);
    for blur_pre in [0, 2] {
        let options = KeyOptions {
            blur_pre,
            ..KeyOptions::for_profile(Profile::Robust)
        };
        for screen in [Screen::Color(GREEN), Screen::Plate(&plate)] {
            let keyed = Keying::new(&photo, screen).run(&options).unwrap();
            let mattes: Vec<f32> = keyed.matte.pixels().iter().map(|m| m.0).collect();
            assert_eq!(mattes[2], 0.0, "{blur_pre} {screen:?}");
            assert!(mattes[1] > 0.9 && mattes[3] > 0.9, "{mattes:?}");
            assert_eq!(keyed.cutout[(2, 0)], PremulRgba::TRANSPARENT);
        }
    }
}

#[test]
fn what_the_robust_profile_clamps_is_counted() {
    let photo = Image::filled(4, 3, GREEN);
    let core = Image::filled(4, 3, Coverage(1.7));
    let job = Keying::new(&photo, Screen::Color(GREEN)).with_core(&core);
    let keyed = job.run(&KeyOptions::for_profile(Profile::Robust)).unwrap();
    assert_eq!(keyed.deviations.clamped, 12);
    assert!(keyed.matte.pixels().iter().all(|m| m.0 == 1.0));
}

#[test]
fn a_blur_of_nothing_is_no_negative_zero_in_blender_4_5() {
    // Columns are summed in groups, and what is left of them one by one.
    let photo = Image::filled(70, 3, LinearRgb::new(0.6, 0.5, 0.4));
    let options = KeyOptions {
        clip_black: 1.0,
        clip_white: 0.3,
        blur_post: 4,
        ..KeyOptions::for_profile(LATE)
    };
    let matte = key(&photo, GREEN, &options).matte;
    assert!(matte.pixels().iter().all(|m| m.0.to_bits() == 0));
}
