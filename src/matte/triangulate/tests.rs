use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: (usize, usize) = (160, 100);
const GREEN: LinearRgb = LinearRgb::new(0.045, 0.42, 0.085);
const BLUE: LinearRgb = LinearRgb::new(0.03, 0.095, 0.52);
const RED: LinearRgb = LinearRgb::new(0.5, 0.04, 0.05);

fn inside() -> Image<Coverage> {
    let inside = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (u, v) = ((x as f32 - 80.0) / 60.0, (y as f32 - 50.0) / 35.0);
        u * u + v * v < 1.0
    });
    inside.to_coverage()
}

fn even_plates(screens: &[LinearRgb]) -> Vec<ScreenPlate> {
    let plates = screens.iter().map(|&k| ScreenPlate::even(k, SIZE));
    plates.collect()
}

fn of_photos(photos: &[Image<LinearRgb>], plates: &[ScreenPlate]) -> Result<Triangulated> {
    let shots: Vec<_> = photos.iter().zip(plates).collect();
    triangulate(&shots, &inside(), &TriangulateOptions::default())
}

/// Blue film with folds and glints.
fn truth(x: f64, y: f64) -> (LinearRgb, LinearRgb) {
    let (u, v) = ((x - 80.0) / 60.0, (y - 50.0) / 35.0);
    if u * u + v * v >= 1.0 {
        return (LinearRgb::BLACK, LinearRgb::WHITE);
    }
    let fold = (0.75 + 0.2 * libm::sin(0.23 * x + 0.011 * y * y)) as f32;
    let glint = (0.12 * libm::pow(libm::sin(0.17 * x - 0.29 * y), 8.0)) as f32;
    (
        LinearRgb::new(0.03, 0.05, 0.07).map(|f| f + glint),
        LinearRgb::new(0.25, 0.45, 0.6).scale(fold),
    )
}

fn photo(screen: LinearRgb, [dx, dy]: [f64; 2], noise: f32, seed: u64) -> Image<LinearRgb> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut grain = || noise * ((0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0);
    let mut image = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (f, t) = truth(x as f64 - dx, y as f64 - dy);
        f + t * screen
    });
    image
        .pixels_mut()
        .iter_mut()
        .for_each(|p| *p = p.map(|v| v + grain()));
    image
}

fn solved(screens: &[LinearRgb], shift: [f64; 2], noise: f32) -> Result<Triangulated> {
    let photos: Vec<_> = screens
        .iter()
        .enumerate()
        .map(|(i, &k)| photo(k, if i == 0 { [0.0; 2] } else { shift }, noise, i as u64))
        .collect();
    of_photos(&photos, &even_plates(screens))
}

/// Mean absolute errors of T in the three channels and of F, inside.
fn errors(found: &Triangulated) -> ([f32; 3], f32) {
    let (mut t_error, mut f_error, mut count) = ([0.0; 3], 0.0, 0.0);
    for y in 0..SIZE.1 {
        for x in (0..SIZE.0).filter(|&x| inside()[(x, y)].0 > 0.5) {
            let (f, t) = truth(x as f64, y as f64);
            let (ft, tt): ([f32; 3], [f32; 3]) = (found.transmittance[(x, y)].into(), t.into());
            (0..3).for_each(|c| t_error[c] += (ft[c] - tt[c]).abs());
            f_error += (found.film[(x, y)].color.g - f.g).abs();
            count += 1.0;
        }
    }
    (t_error.map(|e| e / count), f_error / count)
}

#[test]
fn two_screens_without_noise_are_exact_where_they_differ() {
    let found = solved(&[GREEN, BLUE], [0.0; 2], 0.0).unwrap();
    assert_eq!(found.determined, [false, true, true]);
    let ([r, g, b], f) = errors(&found);
    assert!(g < 1e-4 && b < 1e-4 && f < 1e-4, "{g} {b} {f}");
    assert!(r < 0.03, "red is told from the others: {r}");
    assert!(
        matches!(&found.diagnostics[..], [one] if one.code == Code::SimilarScreens && one.message.contains("in red:")),
        "{:?}",
        found.diagnostics
    );
}

#[test]
fn a_channel_in_which_the_plates_hardly_differ_follows_from_the_others() {
    let mask = inside();
    let plates = [(GREEN, 1.0_f32), (BLUE, 1.00001)].map(|(screen, gain)| {
        let image = Image::from_fn(SIZE.0, SIZE.1, |x, _| {
            LinearRgb::new(gain * (0.3 + 0.001 * x as f32), screen.g, screen.b)
        });
        ScreenPlate {
            image,
            ..ScreenPlate::even(screen, SIZE)
        }
    });
    let photos = plates.each_ref().map(|plate| {
        Image::from_fn(SIZE.0, SIZE.1, |x, y| {
            let (f, _) = truth(x as f64, y as f64);
            f + plate.image[(x, y)].scale(1.0 - 0.3 * mask[(x, y)].0)
        })
    });
    let found = of_photos(&photos, &plates).unwrap();
    for t in lines::covered_pixels(&found.transmittance, &mask) {
        assert!((t.r - 0.7).abs() < 0.02, "{t:?}");
    }
}

#[test]
fn an_object_that_lets_nothing_through_is_opaque() {
    let (mask, paint) = (inside(), LinearRgb::grey(0.3));
    let screens = [GREEN, BLUE];
    let photos = screens.map(|k| mask.map(|c| if c.0 > 0.5 { paint } else { k }));
    let found = of_photos(&photos, &even_plates(&screens)).unwrap();
    assert_eq!(found.determined, [false, true, true]);
    for film in lines::covered_pixels(&found.film, &mask) {
        assert_eq!((film.color, film.opacity), (paint, LinearRgb::WHITE));
    }
}

#[test]
fn a_clipped_screen_is_told_with_its_photo() {
    let clipped = |second| {
        let found = solved(&[GREEN, second], [0.0; 2], 0.0).unwrap();
        let mut diagnostics = found.diagnostics.into_iter();
        diagnostics.find(|d| d.code == Code::ClippedScreen)
    };
    let told = clipped(LinearRgb { b: 1.0, ..BLUE }).unwrap().message;
    assert!(told.starts_with("photo 2: 100 % of the screen"), "{told}");
    assert!(clipped(BLUE).is_none());
}

#[test]
fn exposure_that_differs_between_the_photos_is_told_instead_of_tint() {
    let told = |screens: &[LinearRgb], gain: f32| {
        let exposed = |i: usize| if i == 1 { gain } else { 1.0 };
        let (mut photos, mut plates) = (Vec::new(), Vec::new());
        for (i, &screen) in screens.iter().enumerate() {
            let clean = photo(screen, [0.0; 2], 0.002, i as u64);
            photos.push(clean.map(|p| p.scale(exposed(i))));
            plates.push(ScreenPlate::even(screen.scale(exposed(i)), SIZE));
        }
        let found = of_photos(&photos, &plates).unwrap();
        let codes = found.diagnostics.into_iter().map(|d| d.code);
        let doubts = [Code::MatteExposureDrift, Code::TintUncertain];
        codes
            .filter(|code| doubts.contains(code))
            .collect::<Vec<_>>()
    };
    for screens in [&[GREEN, BLUE][..], &[GREEN, BLUE, RED]] {
        assert_eq!(told(screens, 0.81), [Code::MatteExposureDrift]);
        assert!(told(screens, 1.0).is_empty());
    }
}

#[test]
fn an_exposure_that_differs_by_7_percent_is_told_and_by_2_is_not() {
    let label = LinearRgb::new(0.5, 0.4, 0.4);
    let is_told = |gain: f32| {
        let photos = [(GREEN, 1.0), (BLUE, gain)].map(|(screen, gain)| {
            let mut photo = photo(screen, [0.0; 2], 0.002, 3);
            let at_label = (70..90).flat_map(|x| (35..65).map(move |y| (x, y)));
            at_label.for_each(|at| photo[at] = label);
            photo.map(|p| p.scale(gain))
        });
        let plates = even_plates(&[GREEN, BLUE.scale(gain)]);
        let found = of_photos(&photos, &plates).unwrap();
        let mut diagnostics = found.diagnostics.into_iter();
        diagnostics.any(|d| d.code == Code::MatteExposureDrift && d.needs_review())
    };
    assert!(is_told(1.07) && is_told(0.93));
    assert!(!is_told(1.0) && !is_told(1.02) && !is_told(0.98));
}

#[test]
fn three_screens_determine_every_channel() {
    let found = solved(&[GREEN, BLUE, RED], [0.0; 2], 0.003).unwrap();
    assert_eq!(found.determined, [true; 3]);
    let (t, f) = errors(&found);
    assert!(t.iter().all(|e| *e < 0.015) && f < 0.01, "{t:?} {f}");
    assert!(found.residual < 0.005, "{}", found.residual);
}

/// Brown film on even screens, without noise, and its mean error of red inside.
fn brown_film(screens: &[LinearRgb]) -> (Triangulated, f32) {
    let mask = inside();
    let film_at = |x: usize, y: usize| {
        let (f, t) = truth(x as f64, y as f64);
        let fold = t.r / 0.25;
        match mask[(x, y)].0 > 0.5 {
            true => (f, LinearRgb::new(0.75, 0.55, 0.3).scale(fold)),
            false => (f, t),
        }
    };
    let on = |screen: &LinearRgb| {
        Image::from_fn(SIZE.0, SIZE.1, |x, y| {
            let (f, t) = film_at(x, y);
            f + t * *screen
        })
    };
    let photos: Vec<_> = screens.iter().map(on).collect();
    let found = of_photos(&photos, &even_plates(screens)).unwrap();
    let red = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        (found.transmittance[(x, y)].r - film_at(x, y).1.r).abs()
    });
    let error = mean_inside(&red);
    (found, error)
}

fn mean_inside(values: &Image<f32>) -> f32 {
    let mask = inside();
    let inside: Vec<f32> = lines::covered_pixels(values, &mask).copied().collect();
    inside.iter().sum::<f32>() / inside.len() as f32
}

#[test]
fn a_dye_that_two_screens_cannot_tell_from_another_is_uncertain() {
    let is_tint = |d: &Diagnostic| d.code == Code::TintUncertain;
    let (two, error) = brown_film(&[GREEN, BLUE]);
    let unsure = mean_inside(&two.uncertainty);
    assert!(unsure > error, "off by {error}, uncertainty {unsure}");
    assert!(two.diagnostics.iter().any(is_tint), "{:?}", two.diagnostics);
    let (three, error) = brown_film(&[GREEN, BLUE, RED]);
    assert!(error < 0.02, "{error}");
    assert!(!three.diagnostics.iter().any(is_tint));
}

#[test]
fn a_soft_rim_is_covered_once() {
    let mask = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let r = libm::hypotf((x as f32 - 80.0) / 60.0, (y as f32 - 50.0) / 35.0);
        Coverage((0.5 + 8.0 * (1.0 - r)).clamp(0.0, 1.0))
    });
    let paint = LinearRgb::new(0.5, 0.3, 0.3);
    let screens = [GREEN, BLUE, RED];
    let photos = screens.map(|k| mask.map(|c| paint.scale(c.0) + k.scale(1.0 - c.0)));
    let plates = even_plates(&screens);
    let shots: Vec<_> = photos.iter().zip(&plates).collect();
    let found = triangulate(&shots, &mask, &TriangulateOptions::default()).unwrap();
    for (i, c) in mask.pixels().iter().map(|c| c.0).enumerate() {
        let (film, t) = (found.film.pixels()[i], found.transmittance.pixels()[i]);
        assert!((film.color.r - 0.5 * c).abs() < 0.01, "{c}: {film:?}");
        assert!((t.g - (1.0 - c)).abs() < 0.01, "{c}: {t:?}");
    }
}

#[test]
fn a_coverage_that_is_none_and_an_option_out_of_range_are_refused() {
    let (photo, plate) = (
        photo(GREEN, [0.0; 2], 0.0, 1),
        ScreenPlate::even(GREEN, SIZE),
    );
    let shots = [(&photo, &plate); 2];
    let refused = |inside: &Image<Coverage>, options: TriangulateOptions| {
        triangulate(&shots, inside, &options)
            .unwrap_err()
            .to_string()
    };
    for wrong in [2.0, -0.5, f32::NAN] {
        let mut mask = inside();
        mask[(80, 50)].0 = wrong;
        let expected = format!("mask: {wrong}, expected 0 to 1");
        assert_eq!(refused(&mask, TriangulateOptions::default()), expected);
        let film = crate::matte::film(&photo, &plate, &mask, &Default::default());
        assert_eq!(film.unwrap_err().to_string(), expected);
    }
    let options = TriangulateOptions {
        least_agreement: 7.0,
        ..TriangulateOptions::default()
    };
    assert_eq!(
        refused(&inside(), options),
        "least_agreement: 7, expected 0 to 1"
    );
}

#[test]
fn a_mask_that_is_empty_is_told_as_that() {
    let photos = [GREEN, BLUE].map(|k| photo(k, [0.0; 2], 0.0, 1));
    let plates = even_plates(&[GREEN, BLUE]);
    let shots: Vec<_> = photos.iter().zip(&plates).collect();
    for most in [0.0, 0.5] {
        let mask = inside().map(|c| Coverage(most * c.0));
        let refusal = triangulate(&shots, &mask, &TriangulateOptions::default()).unwrap_err();
        let said = refusal.to_string();
        assert!(said.contains("the mask of the object is empty"), "{said}");
    }
}

#[test]
fn an_object_that_moved_is_moved_back() {
    let shift = [1.6, -0.7];
    let found = solved(&[GREEN, BLUE], shift, 0.002).unwrap();
    let [x, y] = found.shift_px[1];
    assert!(
        (x - shift[0]).abs() < 0.15 && (y - shift[1]).abs() < 0.15,
        "{x} {y}"
    );
    assert!(
        found.diagnostics[0].code == Code::Moved
            && found.diagnostics[0].message.starts_with("photo 2 ")
    );
    let still = errors(&solved(&[GREEN, BLUE], [0.0; 2], 0.002).unwrap());
    assert!(errors(&found).0[1] < still.0[1] + 0.05);
}

#[test]
fn an_object_that_moved_far_is_refused() {
    let (a, b) = (
        photo(GREEN, [0.0; 2], 0.002, 1),
        photo(BLUE, [1.6, -0.7], 0.002, 2),
    );
    let plates = even_plates(&[GREEN, BLUE]);
    let strict = TriangulateOptions {
        max_shift_px: 1.0,
        ..TriangulateOptions::default()
    };
    let shots = [(&a, &plates[0]), (&b, &plates[1])];
    let far = triangulate(&shots, &inside(), &strict).unwrap_err();
    let far = far.to_string();
    assert!(far.contains("did it move?"), "{far}");
}

#[test]
fn photos_that_are_unlike_may_be_of_a_dyed_object_which_is_let_through_on_request() {
    let first = photo(GREEN, [0.0; 2], 0.0, 1);
    let told = |agreement: f64, least_agreement: f64| {
        let options = TriangulateOptions {
            least_agreement,
            ..TriangulateOptions::default()
        };
        let aligner = Aligner {
            first: &first,
            near: inside().map(|c| c.0 > 0.0),
            options: &options,
        };
        aligner.too_unlike(&Registered {
            shift_px: [0.0; 2],
            sigma_px: 0.1,
            agreement,
        })
    };
    let refusal = told(0.2, 0.5).unwrap();
    assert!(
        refusal.ends_with("is it dyed? for a dyed one use --set film.least_agreement=0"),
        "{refusal}"
    );
    assert_eq!([told(0.6, 0.5), told(-0.4, 0.0)], [None, None]);
}

/// The object on a screen, turned around its middle.
fn turned(screen: LinearRgb, degrees: f64) -> Image<LinearRgb> {
    let (sin, cos) = (
        libm::sin(degrees.to_radians()),
        libm::cos(degrees.to_radians()),
    );
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (dx, dy) = (x as f64 - 80.0, y as f64 - 50.0);
        let (f, t) = truth(80.0 + cos * dx + sin * dy, 50.0 - sin * dx + cos * dy);
        f + t * screen
    })
}

#[test]
fn an_object_that_turned_is_refused_and_one_that_hardly_did_is_not() {
    let plates = even_plates(&[GREEN, BLUE]);
    let on_blue = |degrees| of_photos(&[turned(GREEN, 0.0), turned(BLUE, degrees)], &plates);
    for degrees in [-3.0, 2.0, 4.0] {
        let refusal = on_blue(degrees).unwrap_err().to_string();
        assert!(refusal.contains("turn"), "{degrees}: {refusal}");
    }
    assert!(on_blue(0.1).is_ok());
}

#[test]
fn screens_that_are_alike_and_single_photos_are_refused() {
    let alike = solved(&[GREEN, GREEN], [0.0; 2], 0.002)
        .unwrap_err()
        .to_string();
    assert!(alike.contains("too similar"), "{alike}");
    let single = solved(&[GREEN], [0.0; 2], 0.0).unwrap_err().to_string();
    assert_eq!(single, "photos: 1, expected at least 2");
}

#[test]
fn a_pixel_that_is_not_finite_is_named_with_its_photo() {
    let plates = even_plates(&[GREEN, BLUE]);
    for at in [(80, 50), (5, 5)] {
        let mut second = photo(BLUE, [0.0; 2], 0.0, 2);
        second[at].r = f32::NAN;
        let photos = [photo(GREEN, [0.0; 2], 0.0, 1), second];
        let refusal = of_photos(&photos, &plates).unwrap_err();
        let expected = format!("photo 2: pixel {at:?} is not a finite number");
        assert!(refusal.to_string().contains(&expected), "{refusal}");
    }
}

#[test]
fn outside_the_object_there_is_nothing() {
    let found = solved(&[GREEN, BLUE], [0.0; 2], 0.01).unwrap();
    assert_eq!(
        (found.film[(2, 3)], found.transmittance[(2, 3)]),
        (Film::default(), LinearRgb::WHITE)
    );
}
