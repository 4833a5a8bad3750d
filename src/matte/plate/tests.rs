use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: (usize, usize) = (240, 160);
const GREEN: LinearRgb = LinearRgb::new(0.045, 0.42, 0.085);

/// A screen in the light of a lamp above its corner, `uneven` between darkest and brightest.
fn screen(uneven: f32) -> Image<LinearRgb> {
    let fall = |x: usize, y: usize| {
        let (u, v) = (
            x as f32 / SIZE.0 as f32 - 0.2,
            y as f32 / SIZE.1 as f32 - 0.1,
        );
        libm::powf(1.0 + 1.5 * (u * u + v * v), -1.5)
    };
    let darkest = fall(SIZE.0 - 1, SIZE.1 - 1);
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        GREEN.scale(1.0 - uneven * (1.0 - fall(x, y)) / (1.0 - darkest))
    })
}

fn free() -> Mask {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        !((30..210).contains(&x) && (30..130).contains(&y))
    })
}

/// The screen with an object on it, its shadow below and noise.
fn photo(plate: &Image<LinearRgb>, noise: f32) -> Image<LinearRgb> {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut grain = || noise * ((0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0);
    let free = free();
    let mut photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let shadow = (130..140).contains(&y) && (60..200).contains(&x);
        if free[(x, y)] {
            plate[(x, y)].scale(if shadow { 0.8 } else { 1.0 })
        } else {
            LinearRgb::grey(0.6)
        }
    });
    photo
        .pixels_mut()
        .iter_mut()
        .for_each(|p| *p = p.map(|v| v + grain()));
    photo
}

fn fitted(photo: &Image<LinearRgb>) -> ScreenPlate {
    ScreenPlate::fit(photo, &free(), &PlateOptions::default()).unwrap()
}

fn by_empty(empty: &Image<LinearRgb>, photo: &Image<LinearRgb>) -> Result<ScreenPlate> {
    ScreenPlate::from_photo(empty, photo, &free(), &PlateOptions::default())
}

/// Largest error of the strongest channel, as a share of the screen's brightest.
fn worst(found: &ScreenPlate, truth: &Image<LinearRgb>) -> f32 {
    let pairs = found.image.pixels().iter().zip(truth.pixels());
    pairs.map(|(a, b)| (a.g - b.g).abs()).fold(0.0, f32::max) / GREEN.g
}

#[test]
fn an_uneven_screen_is_found_under_the_object_and_beside_its_shadow() {
    for (uneven, tolerance) in [(0.0, 0.005), (0.15, 0.05), (0.6, 0.07)] {
        let truth = screen(uneven);
        let found = fitted(&photo(&truth, 0.004));
        assert!(
            worst(&found, &truth) < tolerance,
            "{} at {uneven}",
            worst(&found, &truth)
        );
        assert!(
            (found.unevenness - uneven).abs() < 0.06,
            "{}",
            found.unevenness
        );
    }
}

#[test]
fn the_degree_is_no_higher_than_needed() {
    let degree = |uneven| fitted(&photo(&screen(uneven), 0.004)).degree;
    assert_eq!(degree(0.0), Some(0));
    assert!(degree(0.6) >= Some(2), "{:?}", degree(0.6));
}

#[test]
fn lamps_of_two_colours_are_found_in_each_channel_under_the_object() {
    // Red from the left and blue from the right; green is even.
    let truth = Image::from_fn(SIZE.0, SIZE.1, |x, _| {
        let slope = x as f32 / SIZE.0 as f32 - 0.5;
        let [red, blue] = [-slope, slope].map(libm::expf);
        LinearRgb::new(GREEN.r * red, GREEN.g, GREEN.b * blue)
    });
    let found = fitted(&photo(&truth, 0.002)).image;
    for at in [(40, 80), (120, 80), (200, 80)] {
        let [seen, expected] = [found[at], truth[at]].map(LinearRgb::channels);
        for c in 0..3 {
            let error = (seen[c] / expected[c] - 1.0).abs();
            assert!(error < 0.05, "channel {c} at {at:?}: off by {error}");
        }
    }
}

/// Beside an object in the middle.
fn free_around_small() -> Mask {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        !((90..150).contains(&x) && (50..110).contains(&y))
    })
}

/// What is fitted to a screen of 0.8 of its light with a spot of 0.3 more, `spread` as a share of
/// the picture's width squared.
fn fitted_to_spot(at: [f32; 2], spread: f32) -> ScreenPlate {
    let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let [u, v] = [x as f32 / 240.0 - at[0], (y as f32 / 160.0 - at[1]) / 1.5];
        GREEN.scale(0.8 + 0.3 * libm::expf(-(u * u + v * v) / spread))
    });
    ScreenPlate::fit(&photo, &free_around_small(), &PlateOptions::default()).unwrap()
}

fn warned_of(plate: &ScreenPlate) -> Option<Code> {
    plate.unevenness_warning().map(|warning| warning.code)
}

#[test]
fn a_hot_spot_takes_a_higher_degree_and_is_warned_of() {
    let plate = fitted_to_spot([0.3, 0.3], 0.05);
    // 1 - 0.8 / 1.1.
    assert!(
        (plate.unevenness - 0.273).abs() < 0.06,
        "{}",
        plate.unevenness
    );
    assert!(plate.degree > Some(0));
    assert_eq!(warned_of(&plate), Some(Code::UnevenScreen));
}

#[test]
fn bands_across_the_screen_are_warned_of() {
    let of_bands = |depth: f32| {
        let photo = Image::from_fn(SIZE.0, SIZE.1, |_, y| {
            GREEN.scale(1.0 + depth * libm::sinf(0.2 * y as f32))
        });
        ScreenPlate::fit(&photo, &free_around_small(), &PlateOptions::default()).unwrap()
    };
    assert_eq!(warned_of(&of_bands(0.02)), None);
    let plate = of_bands(0.2);
    assert_eq!(warned_of(&plate), Some(Code::UnevenScreen));
    assert!(plate.overshoot > 0.09 && plate.unevenness >= plate.overshoot);
}

#[test]
fn a_hot_spot_that_no_polynomial_follows_is_warned_of() {
    let plate = fitted_to_spot([0.2, 0.2], 0.01);
    assert_eq!(warned_of(&plate), Some(Code::UnevenScreen));
}

/// What is fitted to a picture with something in a corner of it, a tenth of the area.
fn fitted_to_corner(screen: LinearRgb, corner: LinearRgb) -> ScreenPlate {
    let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| match x < 80 && y < 48 {
        true => corner,
        false => screen,
    });
    ScreenPlate::fit(&photo, &free_around_small(), &PlateOptions::default()).unwrap()
}

#[test]
fn sheen_is_a_hot_spot() {
    let plate = fitted_to_corner(GREEN, GREEN + LinearRgb::grey(0.12));
    assert_eq!(warned_of(&plate), Some(Code::UnevenScreen));
}

#[test]
fn paper_on_a_grey_board_is_no_hot_spot() {
    let plate = fitted_to_corner(LinearRgb::grey(0.3), LinearRgb::grey(0.7));
    assert_eq!((warned_of(&plate), plate.degree), (None, Some(0)));
}

#[test]
fn white_paper_on_the_screen_is_no_hot_spot() {
    let plate = fitted_to_corner(GREEN, LinearRgb::grey(0.7));
    assert_eq!((warned_of(&plate), plate.degree), (None, Some(0)));
    assert!(plate.hot_spot < 0.01, "{}", plate.hot_spot);
}

#[test]
fn noise_of_3_percent_is_survived() {
    let truth = screen(0.15);
    let found = fitted(&photo(&truth, 0.03));
    assert!(worst(&found, &truth) < 0.12, "{}", worst(&found, &truth));
}

/// Blobs of dirt at places that do not repeat: what tells where a screen lies.
fn dirty(clean: &Image<LinearRgb>, [dx, dy]: [f64; 2]) -> Image<LinearRgb> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (w, h) = (SIZE.0 as f64, SIZE.1 as f64);
    let blobs: Vec<[f64; 3]> = (0..150)
        .map(|_| {
            [
                w * rng.random::<f64>(),
                h * rng.random::<f64>(),
                1.5 + 2.0 * rng.random::<f64>(),
            ]
        })
        .collect();
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (x, y) = (x as f64 + 0.5 - dx, y as f64 + 0.5 - dy);
        let blob = |[u, v, r]: &[f64; 3]| {
            0.3 * libm::exp(-((x - u).powi(2) + (y - v).powi(2)) / (2.0 * r * r))
        };
        let light = 1.0 - blobs.iter().map(blob).sum::<f64>().min(0.6);
        clean[(x as usize % SIZE.0, y as usize % SIZE.1)].scale(light as f32)
    })
}

#[test]
fn a_photographed_screen_is_aligned_and_its_exposure_matched() {
    let truth = dirty(&screen(0.0), [0.0; 2]);
    for shift in [[0.0, 0.0], [3.0, 2.0], [-1.6, 0.7]] {
        // The empty screen was photographed darker, and lies so far off.
        let empty = dirty(&screen(0.0), shift.map(|s: f64| -s)).map(|p| p.scale(0.9));
        let found = by_empty(&empty, &photo(&truth, 0.002)).unwrap();
        let [dx, dy] = found.shift_px;
        assert!(
            (dx - shift[0]).abs() < 0.2 && (dy - shift[1]).abs() < 0.2,
            "{:?}, expected {shift:?}",
            found.shift_px
        );
        assert_eq!(found.degree, None);
        let mean = |image: &Image<LinearRgb>| {
            image.pixels().iter().map(|p| p.g).sum::<f32>() / (SIZE.0 * SIZE.1) as f32
        };
        assert!(
            (mean(&found.image) / mean(&truth) - 1.0).abs() < 0.02,
            "the exposure is matched"
        );
    }
}

#[test]
fn a_photographed_screen_without_dirt_is_taken_as_it_lies() {
    let truth = screen(0.3);
    let empty = truth.map(|p| p.scale(0.9));
    let found = by_empty(&empty, &photo(&truth, 0.002)).unwrap();
    assert_eq!((found.degree, found.shift_px), (None, [0.0; 2]));
    // The border of the blur is flat where the screen slopes.
    assert!(worst(&found, &truth) < 0.03, "{}", worst(&found, &truth));
}

#[test]
fn an_empty_screen_without_light_in_a_channel_is_a_plate() {
    let without_red = |image: Image<LinearRgb>| image.map(|p| LinearRgb { r: 0.0, ..p });
    let truth = without_red(screen(0.3));
    let empty = truth.map(|p| p.scale(0.9));
    let found = by_empty(&empty, &without_red(photo(&truth, 0.002))).unwrap();
    assert!(worst(&found, &truth) < 0.03, "{}", worst(&found, &truth));
    assert!(found.image.pixels().iter().all(|p| p.r == 0.0));
}

#[test]
fn an_empty_screen_that_lies_too_far_off_is_refused() {
    let empty = dirty(&screen(0.0), [-6.0, 0.0]);
    let near = PlateOptions {
        max_shift_px: 4.0,
        ..PlateOptions::default()
    };
    let photo = photo(&dirty(&screen(0.0), [0.0; 2]), 0.002);
    let said = ScreenPlate::from_photo(&empty, &photo, &free(), &near)
        .unwrap_err()
        .to_string();
    assert!(said.contains("did the camera move?"), "{said}");
    // It lies to the left.
    assert!(said.contains("offset by (-"), "{said}");
}

#[test]
fn another_screen_is_not_taken_for_the_empty_one() {
    let photo = photo(&screen(0.0), 0.002);
    let other = Image::from_fn(SIZE.0, SIZE.1, |x, _| {
        GREEN.scale(if x < 120 { 0.5 } else { 1.5 })
    });
    let said = by_empty(&other, &photo).unwrap_err().to_string();
    assert!(said.contains("did the light change?"), "{said}");
    let small = by_empty(&Image::new(8, 8), &photo).unwrap_err().to_string();
    assert!(small.contains("8 x 8 pixels, expected 240 x 160"));
}

#[test]
fn an_empty_screen_with_a_pixel_that_is_not_finite_is_refused() {
    let mut empty = screen(0.0);
    empty[(120, 80)].b = f32::INFINITY;
    let photo = photo(&screen(0.0), 0.002);
    let said = by_empty(&empty, &photo).unwrap_err().to_string();
    let expected = "the empty screen: pixel (120, 80) is not a finite number";
    assert!(said.contains(expected), "{said}");
}

#[test]
fn no_background_or_no_light_is_refused() {
    let said = |color: LinearRgb, is_free: bool, options: &PlateOptions| {
        let (photo, free) = (Image::filled(64, 64, color), Image::filled(64, 64, is_free));
        ScreenPlate::fit(&photo, &free, options)
            .unwrap_err()
            .to_string()
    };
    let usual = PlateOptions::default();
    assert!(said(GREEN, false, &usual).contains("leaves no background"));
    assert!(said(LinearRgb::BLACK, true, &usual).contains("black"));
    let wrong = PlateOptions {
        max_degree: 9,
        ..usual
    };
    assert_eq!(said(GREEN, true, &wrong), "max_degree: 9, expected 0 to 6");
}
