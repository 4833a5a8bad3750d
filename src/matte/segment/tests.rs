use super::*;
use crate::diagnostic::Code;
use crate::filter;
use crate::matte::arrays::largest_difference;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);
const WHITE: LinearRgb = LinearRgb::new(0.8, 0.82, 0.78);

/// A screen with vignetting and sensor noise (shot and read noise of a small camera) and what lies
/// on it.
fn photo(
    w: usize,
    h: usize,
    screen: LinearRgb,
    paint: impl Fn(f64, f64) -> Option<LinearRgb>,
) -> Image<LinearRgb> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let mut image = Image::new(w, h);
    for i in 0..w * h {
        let (x, y) = ((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let (u, v) = (x / w as f64 - 0.5, y / h as f64 - 0.5);
        let fall = 1.0 - 0.3 * (u * u + v * v) as f32;
        let clean = paint(x, y).unwrap_or(screen).scale(fall);
        image.pixels_mut()[i] = clean.map(|c| {
            let normal = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
            c + normal * (0.006 * 0.006 * c + 0.002 * 0.002).sqrt()
        });
    }
    image
}

fn disc(x: f64, y: f64, [cx, cy, r]: [f64; 3]) -> bool {
    (x - cx).powi(2) + (y - cy).powi(2) < r * r
}

fn find(photo: &Image<LinearRgb>) -> Result<Segmentation> {
    segment(photo, &SegmentOptions::default())
}

/// The hull's box is within 2 pixels of `truth`, the accuracy that is promised of photos.
fn assert_box(found: &Segmentation, truth: [f64; 4]) {
    let found = hull::sides(&found.hull);
    let worst = largest_difference(found, truth);
    assert!(worst <= 2.0, "{found:?}, expected {truth:?}");
}

fn said(photo: &Image<LinearRgb>) -> String {
    find(photo).unwrap_err().to_string()
}

#[test]
fn a_disc_is_found_where_it_is() {
    for screen in [GREEN, WHITE] {
        let red = LinearRgb::new(0.5, 0.04, 0.05);
        let found = find(&photo(300, 200, screen, |x, y| {
            disc(x, y, [150.0, 90.0, 50.0]).then_some(red)
        }))
        .unwrap();
        assert_box(&found, [100.0, 40.0, 200.0, 140.0]);
        let area: f32 = found.mask.pixels().iter().map(|c| c.0).sum();
        assert!((f64::from(area) / (std::f64::consts::PI * 2500.0) - 1.0).abs() < 0.05);
        assert_eq!(found.touches, [false; 4]);
    }
}

#[test]
fn a_clear_film_is_found_by_its_rim() {
    // 15 % darker along a rim of 4 pixels, the screen's colour within.
    let rim = |x, y| disc(x, y, [150.0, 100.0, 70.0]) && !disc(x, y, [150.0, 100.0, 66.0]);
    let found = find(&photo(300, 200, GREEN, |x, y| {
        rim(x, y).then_some(GREEN.scale(0.85))
    }))
    .unwrap();
    assert_box(&found, [80.0, 30.0, 220.0, 170.0]);
    assert!(found.tight[(150, 100)].0 > 0.99, "the inside belongs to it");
}

#[test]
fn a_soft_shadow_is_not_the_object() {
    let shadow =
        |x: f64, y: f64| (((x - 220.0).powi(2) + (y - 100.0).powi(2)) / 2000.0).min(10.0) as f32;
    let found = find(&photo(300, 200, WHITE, |x, y| {
        if disc(x, y, [110.0, 100.0, 50.0]) {
            Some(LinearRgb::new(0.1, 0.2, 0.5))
        } else {
            Some(WHITE.scale(1.0 - 0.3 * libm::expf(-shadow(x, y))))
        }
    }));
    assert_box(&found.unwrap(), [60.0, 50.0, 160.0, 150.0]);
}

fn is_slab(x: f64, y: f64) -> bool {
    (100.0..200.0).contains(&x) && (70.0..130.0).contains(&y)
}

/// A slab of 100 x 60 pixels and its shadow, which hangs together with it as it lies on the screen,
/// and what is left of the screen's light there.
fn slab_with_shadow(paint: LinearRgb, shade: f32) -> Image<LinearRgb> {
    let is_shadow = |x: f64, y: f64| (1..=12).any(|d| is_slab(x - f64::from(d), y - f64::from(d)));
    let sharp = photo(300, 200, GREEN, |x, y| {
        let shadow = is_shadow(x, y).then(|| GREEN.scale(shade));
        is_slab(x, y).then_some(paint).or(shadow)
    });
    filter::gaussian_blur(&sharp, 0.6)
}

#[test]
fn a_hard_shadow_on_a_coloured_screen_is_left_out_and_told() {
    let dark_green = LinearRgb::new(0.03, 0.1, 0.05);
    for paint in [
        LinearRgb::new(0.5, 0.04, 0.05),
        LinearRgb::grey(0.01),
        dark_green,
    ] {
        for shade in [0.4, 0.6] {
            let found = find(&slab_with_shadow(paint, shade)).unwrap();
            assert_box(&found, [100.0, 70.0, 200.0, 130.0]);
            assert!(found.tight[(206, 100)].0 < 0.1 && found.tight[(190, 120)].0 > 0.9);
            let told = found.diagnostics.iter().any(|d| d.code == Code::LeftOut);
            assert!(told, "{:?}", found.diagnostics);
        }
    }
}

#[test]
fn what_has_a_sheen_or_a_tint_or_is_shaded_unevenly_is_no_shadow() {
    // Plastic that passes half of the light adds 2 % of grey; dyed plastic has another hue; paint of
    // the screen's hue is shaded by its shape.
    let parts: [fn(f64) -> LinearRgb; 3] = [
        |_| GREEN.scale(0.5) + LinearRgb::grey(0.02),
        |_| LinearRgb::new(0.01, 0.22, 0.045),
        |y| GREEN.scale(0.35 + 0.35 * (y - 70.0) as f32 / 60.0),
    ];
    for part in parts {
        let found = find(&photo(300, 200, GREEN, |x, y| {
            is_slab(x, y).then(|| if x < 180.0 { WHITE } else { part(y) })
        }));
        assert_box(&found.unwrap(), [100.0, 70.0, 200.0, 130.0]);
    }
}

#[test]
fn dirt_far_away_does_not_blow_up_the_hull() {
    let found = find(&photo(400, 300, WHITE, |x, y| {
        let there = disc(x, y, [150.0, 150.0, 60.0]) || disc(x, y, [370.0, 20.0, 2.0]);
        there.then_some(LinearRgb::grey(0.1))
    }));
    assert_box(&found.unwrap(), [90.0, 90.0, 210.0, 210.0]);
}

#[test]
fn a_cap_of_the_same_grey_as_the_screen_is_seen() {
    // Equal means of the square roots, which is what the grey picture shows.
    let (screen, cap) = (
        LinearRgb::new(0.04, 0.09, 0.36),
        LinearRgb::new(0.36, 0.09, 0.04),
    );
    let picture = photo(300, 200, screen, |x, y| {
        disc(x, y, [150.0, 100.0, 40.0]).then_some(cap)
    });
    assert_box(&find(&picture).unwrap(), [110.0, 60.0, 190.0, 140.0]);
}

#[test]
fn hollows_are_in_the_hull_and_not_in_the_tight_mask() {
    let ell = |x: f64, y: f64| {
        (40.0..260.0).contains(&x) && (40.0..260.0).contains(&y) && (x < 120.0 || y > 180.0)
    };
    let found = find(&photo(300, 300, GREEN, |x, y| {
        ell(x, y).then_some(LinearRgb::grey(0.5))
    }))
    .unwrap();
    assert!(
        found.mask[(160, 140)].0 == 1.0
            && found.tight[(190, 110)].0 == 0.0
            && found.tight[(80, 80)].0 == 1.0
    );
}

#[test]
fn an_object_may_reach_a_border() {
    let found = find(&photo(300, 200, GREEN, |x, y| {
        (x < 90.0 && (50.0..150.0).contains(&y)).then_some(WHITE)
    }));
    let found = found.unwrap();
    assert_eq!(found.touches, [true, false, false, false]);
    assert_box(&found, [0.0, 50.0, 90.0, 150.0]);
}

#[test]
fn large_photos_are_searched_small_and_told_in_their_own_pixels() {
    let found = find(&photo(2000, 1500, GREEN, |x, y| {
        disc(x, y, [900.0, 700.0, 400.0]).then_some(WHITE)
    }))
    .unwrap();
    let worst = largest_difference(hull::sides(&found.hull), [500.0, 300.0, 1300.0, 1100.0]);
    assert!(worst <= 4.0, "2 pixels of the search are 4 of the photo");
    assert_eq!(
        (found.mask.size(), found.tight.size()),
        ((2000, 1500), (2000, 1500))
    );
    assert_eq!(found.steps[0].image.size(), (640, 480));
}

#[test]
fn an_empty_screen_is_refused() {
    assert!(said(&photo(300, 200, GREEN, |_, _| None)).contains("is there an object"));
    assert!(said(&Image::filled(100, 100, GREEN)).contains("is there an object"));
    assert!(said(&Image::filled(100, 100, LinearRgb::BLACK)).contains("is there an object"));
}

#[test]
fn a_lone_speck_is_refused() {
    let speck = photo(400, 300, GREEN, |x, y| {
        disc(x, y, [200.0, 150.0, 4.0]).then_some(WHITE)
    });
    assert!(said(&speck).contains("the largest thing found is"));
}

#[test]
fn two_objects_are_refused() {
    let two = photo(400, 200, GREEN, |x, y| {
        (disc(x, y, [90.0, 100.0, 50.0]) || disc(x, y, [310.0, 100.0, 45.0])).then_some(WHITE)
    });
    assert!(
        said(&two).contains("two objects, at 23 % of the width"),
        "{}",
        said(&two)
    );
}

#[test]
fn parts_that_are_refused_are_one_object_with_the_join_that_is_advised() {
    let parts = photo(400, 200, GREEN, |x, y| {
        (disc(x, y, [107.0, 100.0, 50.0]) || disc(x, y, [228.0, 100.0, 45.0])).then_some(WHITE)
    });
    let said = said(&parts);
    let advice = "set `join = 0.08` or more under `[cut_out.segment]` in a TOML list of photos";
    assert!(said.contains(advice), "{said}");
    let options = SegmentOptions {
        join: 0.08,
        ..SegmentOptions::default()
    };
    let found = segment(&parts, &options).unwrap();
    assert_box(&found, [57.0, 50.0, 273.0, 150.0]);
}

#[test]
fn a_picture_full_of_object_is_refused() {
    let stripes = photo(300, 200, GREEN, |x, y| {
        ((x + y) % 16.0 < 8.0).then_some(WHITE)
    });
    assert!(
        said(&stripes).contains("background all around it"),
        "{}",
        said(&stripes)
    );
    let cross = |x: f64, y: f64| (146.0..154.0).contains(&x) || (96.0..104.0).contains(&y);
    let cross = photo(300, 200, GREEN, |x, y| cross(x, y).then_some(WHITE));
    assert!(
        said(&cross).contains("all four borders"),
        "{}",
        said(&cross)
    );
}

#[test]
fn tiny_and_broken_photos_are_refused() {
    assert!(said(&Image::filled(15, 100, GREEN)).contains("15 x 100"));
    assert!(said(&Image::new(0, 0)).contains("0 x 0"));
    let mut broken = Image::filled(64, 64, GREEN);
    broken[(5, 9)] = LinearRgb::grey(f32::NAN);
    assert!(said(&broken).contains("pixel (5, 9)"));
}

#[test]
fn a_photo_of_64_pixels_is_searched_enlarged() {
    let red = LinearRgb::new(0.5, 0.04, 0.05);
    let found = find(&photo(64, 64, GREEN, |x, y| {
        disc(x, y, [30.0, 33.0, 18.0]).then_some(red)
    }))
    .unwrap();
    assert_box(&found, [12.0, 15.0, 48.0, 51.0]);
    assert_eq!((found.mask.size(), found.reduction), ((64, 64), 0.25));
}

#[test]
fn what_lies_near_a_border_may_go_on_beyond() {
    let near = |gap: f64| {
        photo(300, 200, GREEN, move |x, y| {
            disc(x, y, [50.0 + gap, 100.0, 50.0]).then_some(WHITE)
        })
    };
    assert!(find(&near(1.0)).unwrap().touches[0] && !find(&near(8.0)).unwrap().touches[0]);
}

#[test]
fn specks_all_over_are_told() {
    let specks = [
        [40.0, 20.0, 2.0],
        [260.0, 30.0, 2.0],
        [30.0, 180.0, 2.0],
        [270.0, 170.0, 2.0],
    ];
    let taken = |count: usize| {
        photo(300, 200, GREEN, move |x, y| {
            match disc(x, y, [150.0, 100.0, 40.0]) {
                true => Some(WHITE),
                false => specks[..count]
                    .iter()
                    .any(|speck| disc(x, y, *speck))
                    .then_some(LinearRgb::BLACK),
            }
        })
    };
    let told =
        |count: usize| {
            find(&taken(count)).unwrap().diagnostics.iter().any(|d| {
                d.code == Code::Specks && d.message.starts_with(&format!("{count} specks"))
            })
        };
    assert!(told(4) && !told(1));
}

#[test]
fn a_weak_bump_on_a_slanted_side_is_told_although_the_box_stays() {
    let (sin, cos) = 40_f64.to_radians().sin_cos();
    let bar = |bump_shade: Option<f32>| {
        photo(400, 300, GREEN, move |x, y| {
            let (x, y) = (x - 200.0, y - 150.0);
            let (along, across) = (cos * x + sin * y, cos * y - sin * x);
            let shade = bump_shade.filter(|_| disc(along, across, [0.0, -40.0, 15.0]));
            let is_bar = along.abs() < 120.0 && across.abs() < 40.0;
            is_bar
                .then_some(WHITE)
                .or(shade.map(|shade| GREEN.scale(shade)))
        })
    };
    // The rim of the bump has up to 18 times the noise.
    let options = SegmentOptions {
        finest_threshold: Threshold::Noise(19.0),
        ..SegmentOptions::default()
    };
    let found = |bump_shade| segment(&bar(bump_shade), &options).unwrap();
    let told = |found: &Segmentation| {
        let mut codes = found.diagnostics.iter().map(|d| d.code);
        codes.any(|code| code == Code::ThresholdSensitive)
    };
    let (plain, bumpy) = (found(None), found(Some(0.7)));
    assert!(largest_difference(hull::sides(&plain.hull), hull::sides(&bumpy.hull)) < 1.0);
    assert!(!told(&plain), "{:?}", plain.diagnostics);
    assert!(told(&bumpy), "{:?}", bumpy.confidence);
}

#[test]
fn impossible_options_are_named() {
    let said = |change: fn(&mut SegmentOptions)| {
        let mut options = SegmentOptions::default();
        change(&mut options);
        let refused = segment(&Image::filled(64, 64, GREEN), &options).unwrap_err();
        refused.to_string()
    };
    assert_eq!(said(|o| o.levels = Some(1)), "levels: 1, expected 2 to 8");
    assert!(said(|o| o.join = f64::NAN).starts_with("join: NaN"));
    assert!(said(|o| o.tone = LumaMode::Grey([0.0; 3])).starts_with("tone.grey"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn moving_the_object_moves_the_hull(dx in 0..60usize, dy in 0..60usize, size in 30.0..60.0f64) {
        let (cx, cy) = (90.0 + dx as f64, 90.0 + dy as f64);
        let found = find(&photo(260, 240, GREEN, |x, y| disc(x, y, [cx, cy, size]).then_some(WHITE))).unwrap();
        assert_box(&found, [cx - size, cy - size, cx + size, cy + size]);
    }
}

#[test]
fn thresholds_that_no_value_reaches_are_refused() {
    let refused = |options: SegmentOptions| options.check().unwrap_err().to_string();
    let last = SegmentOptions {
        coarsest_threshold: Threshold::Noise(f32::NAN),
        ..SegmentOptions::default()
    };
    assert_eq!(refused(last), "last_threshold: NaN, expected at least 0");
    let least = SegmentOptions {
        least_contrast: -1.0,
        ..SegmentOptions::default()
    };
    assert_eq!(refused(least), "least_contrast: -1, expected at least 0");
}
