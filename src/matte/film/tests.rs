use super::tint::CLEAR_TRANSMITTANCE;
use super::*;
use crate::matte::plate::PlateOptions;
use crate::matte::{KeyOptions, Keying, Screen, screen_color};
use crate::pixel::PremulRgba;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: (usize, usize) = (180, 120);
const GREEN: LinearRgb = LinearRgb::new(0.045, 0.42, 0.085);
const BLUE: LinearRgb = LinearRgb::new(0.03, 0.095, 0.52);
const CLEAR: LinearRgb = LinearRgb::grey(0.55);

fn inside() -> Image<Coverage> {
    Image::from_fn(SIZE.0, SIZE.1, is_inside).to_coverage()
}

fn is_inside(x: usize, y: usize) -> bool {
    let (u, v) = ((x as f32 - 90.0) / 65.0, (y as f32 - 60.0) / 38.0);
    u * u + v * v < 1.0
}

/// The plate that is fitted around the object.
fn fitted(photo: &Image<LinearRgb>) -> ScreenPlate {
    let free = inside().map(|c| c.0 == 0.0);
    ScreenPlate::fit(photo, &free, &PlateOptions::default()).unwrap()
}

fn solved(photo: &Image<LinearRgb>, plate: &ScreenPlate) -> FilmMatte {
    film(photo, plate, &inside(), &FilmOptions::default()).unwrap()
}

fn solved_on(screen: LinearRgb, photo: &Image<LinearRgb>) -> FilmMatte {
    solved(photo, &ScreenPlate::even(screen, SIZE))
}

/// The film as it lay on the screen, its shadow included.
fn shaded(film: &Image<Film>, transmittance: &Image<LinearRgb>) -> Image<Film> {
    film.zip_map(transmittance, |film, t| Film::new(film.color, t))
}

fn is_told(found: &FilmMatte, code: Code) -> bool {
    found.diagnostics.iter().any(|d| d.code == code)
}

/// A person should look at that.
fn is_warned(found: &FilmMatte, code: Code) -> bool {
    let mut diagnostics = found.diagnostics.iter();
    diagnostics.any(|d| d.code == code && d.needs_review())
}

/// A label across the middle.
fn is_label(x: usize) -> bool {
    (80..110).contains(&x)
}

struct World {
    flat: LinearRgb,
    label: LinearRgb,
    glint: f32,
    screen: LinearRgb,
    /// Darkest over brightest is 1 minus this.
    uneven: f32,
    noise: f32,
}

impl Default for World {
    fn default() -> Self {
        Self {
            flat: CLEAR,
            label: LinearRgb::grey(0.5),
            glint: 0.15,
            screen: GREEN,
            uneven: 0.15,
            noise: 0.003,
        }
    }
}

impl World {
    fn plate(&self, x: usize, y: usize) -> LinearRgb {
        let across = (x as f32 / SIZE.0 as f32 + 0.5 * y as f32 / SIZE.1 as f32) / 1.5;
        self.screen.scale(1.0 - self.uneven * across)
    }

    /// F and T.
    fn truth(&self, x: usize, y: usize) -> (LinearRgb, LinearRgb) {
        if !is_inside(x, y) {
            return (LinearRgb::BLACK, LinearRgb::WHITE);
        }
        if is_label(x) {
            return (self.label, LinearRgb::BLACK);
        }
        let (u, v) = (x as f32, y as f32);
        let fold = 0.85 + 0.2 * libm::sinf(0.21 * u + 0.013 * v * v);
        let glint = self.glint * libm::powf(libm::sinf(0.17 * u - 0.29 * v), 8.0);
        (LinearRgb::grey(0.015 + glint), self.flat.scale(fold))
    }

    fn photo(&self) -> Image<LinearRgb> {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut grain = || self.noise * ((0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0);
        let mut photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
            let (f, t) = self.truth(x, y);
            f + t * self.plate(x, y)
        });
        photo
            .pixels_mut()
            .iter_mut()
            .for_each(|p| *p = p.map(|v| (v + grain()).clamp(0.0, 1.0)));
        photo
    }

    fn solved(&self) -> FilmMatte {
        let photo = self.photo();
        solved(&photo, &fitted(&photo))
    }

    /// Mean absolute error inside, over a grey background in the object's shadow, of what a
    /// function chooses.
    fn error(&self, found: &FilmMatte, of: impl Fn(usize) -> bool) -> f32 {
        let on_screen = shaded(&found.film, &found.transmittance);
        let behind = LinearRgb::new(0.5, 0.35, 0.3);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in 0..SIZE.1 {
            for x in (0..SIZE.0).filter(|&x| is_inside(x, y) && of(x)) {
                let (f, t) = self.truth(x, y);
                let (told, real): ([f32; 3], [f32; 3]) = (
                    on_screen[(x, y)].over_color(behind).into(),
                    (f + t * behind).into(),
                );
                sum += told
                    .iter()
                    .zip(real)
                    .map(|(a, b)| (a - b).abs())
                    .sum::<f32>();
                count += 3.0;
            }
        }
        sum / count
    }
}

#[test]
fn clear_plastic_and_a_white_label_are_recomposited() {
    for screen in [GREEN, BLUE] {
        let world = World {
            screen,
            ..World::default()
        };
        let found = world.solved();
        let (film, label) = (
            world.error(&found, |x| !is_label(x)),
            world.error(&found, is_label),
        );
        assert!(film < 0.012 && label < 0.012, "{film} {label}");
        assert!(
            (found.flat.r - CLEAR.r).abs() < 0.02 && found.diagnostics.is_empty(),
            "{:?}",
            found.diagnostics
        );
    }
}

#[test]
fn tinted_plastic_keeps_its_tint() {
    for (flat, screen) in [
        ([0.17, 0.38, 0.54], GREEN),
        ([0.05, 0.3, 0.09], BLUE),
        ([0.17, 0.05, 0.015], GREEN),
    ] {
        let world = World {
            flat: flat.into(),
            screen,
            ..World::default()
        };
        let found = world.solved();
        let error = world.error(&found, |x| !is_label(x));
        assert!(error < 0.03, "{error} for {flat:?}");
    }
}

#[test]
fn the_tint_of_plastic_depends_on_no_exposure() {
    let flat = [0.23, 0.45, 0.28];
    let haze = LinearRgb::from(tint::scattered_tint(flat)).scale(0.01);
    let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let thickness = 0.9 + 0.2 * x as f32 / SIZE.0 as f32;
        let plastic = haze + LinearRgb::from(flat).scale(thickness) * GREEN;
        if is_inside(x, y) { plastic } else { GREEN }
    });
    let exposed = |exposure: f32| {
        let photo = photo.map(|p| p.scale(exposure));
        solved_on(GREEN.scale(exposure), &photo)
    };
    let bright = exposed(1.0);
    for exposure in [0.5, 0.25, 4.0] {
        let found = exposed(exposure);
        let off = (0..3).map(|c| found.flat.channels()[c] - bright.flat.channels()[c]);
        let most = off.fold(0.0, |most: f32, off| most.max(off.abs()));
        assert!(most < 0.02, "{:?} at {exposure}", found.flat);
        let [sure, usual] = [&found, &bright].map(|f| f.color_uncertainty.confidence());
        assert!(sure < usual + 0.1, "{sure} at {exposure}, {usual} at 1");
        let on_screen = shaded(&found.film, &found.transmittance);
        let shown = on_screen[(90, 60)].over_color(GREEN.scale(exposure));
        let off = shown.g / exposure - photo[(90, 60)].g;
        assert!(off.abs() < 1e-4, "{off} at {exposure}");
    }
}

#[test]
fn nothing_of_the_screen_is_left_in_the_reflected_light() {
    let found = World {
        noise: 0.0,
        ..World::default()
    }
    .solved();
    let casts = (0..SIZE.0)
        .filter(|&x| inside()[(x, 60)].0 > 0.5 && !is_label(x))
        .map(|x| {
            let f = found.film[(x, 60)].color;
            f.g - 0.5 * (f.r + f.b)
        });
    let worst = casts.fold(0.0, f32::max);
    assert!(worst < 0.005, "green cast of {worst}");
}

#[test]
fn outside_there_is_nothing_even_where_the_screen_is_uneven() {
    for uneven in [0.15, 0.6] {
        let found = World {
            uneven,
            ..World::default()
        }
        .solved();
        let outside = found
            .film
            .pixels()
            .iter()
            .zip(inside().pixels())
            .filter(|(_, c)| c.0 == 0.0)
            .map(|(f, _)| *f)
            .collect::<Vec<_>>();
        assert!(outside.iter().all(|f| *f == Film::default()));
    }
}

#[test]
fn bare_screen_within_a_mask_that_is_too_wide_is_nearly_nothing() {
    let world = World::default();
    let photo = world.photo();
    let all = Image::filled(SIZE.0, SIZE.1, Coverage(1.0));
    let found = film(&photo, &fitted(&photo), &all, &FilmOptions::default()).unwrap();
    let outside = inside()
        .pixels()
        .iter()
        .zip(found.film.pixels())
        .filter(|(c, _)| c.0 == 0.0)
        .map(|(_, f)| f.to_rgba().a)
        .collect::<Vec<_>>();
    let mean = outside.iter().sum::<f32>() / outside.len() as f32;
    // The plate goes on from a thin rim of the picture, and what it misses there is taken for haze.
    assert!(mean < 0.1, "{mean}");
}

#[test]
fn a_screen_uneven_by_60_percent_costs_little() {
    let error = |uneven| {
        let world = World {
            uneven,
            ..World::default()
        };
        world.error(&world.solved(), |_| true)
    };
    let (even, uneven) = (error(0.0), error(0.6));
    assert!(uneven < 2.0 * even + 0.005, "{even} {uneven}");
}

#[test]
fn a_screen_with_a_hot_spot_is_warned_of() {
    let photo = World::default().photo();
    let warned = [0.0, 0.2].map(|hot_spot| {
        let plate = ScreenPlate {
            hot_spot,
            ..fitted(&photo)
        };
        is_warned(&solved(&photo, &plate), Code::UnevenScreen)
    });
    assert_eq!(warned, [false, true]);
}

#[test]
fn noise_of_3_percent_is_survived_and_told() {
    let world = World {
        noise: 0.03,
        ..World::default()
    };
    let found = world.solved();
    let error = world.error(&found, |_| true);
    assert!(error < 0.045, "{error}");
    let mean = |found: &FilmMatte| found.uncertainty.pixels().iter().sum::<f32>();
    assert!(mean(&found) > 2.0 * mean(&World::default().solved()));
}

#[test]
fn clipped_glints_do_not_turn_plastic_opaque() {
    let world = World {
        glint: 3.0,
        ..World::default()
    };
    let photo = world.photo();
    let found = world.solved();
    let clipped =
        (0..photo.pixels().len()).filter(|&i| photo.pixels()[i].g >= 1.0 && !is_label(i % SIZE.0));
    let opaque = clipped
        .clone()
        .filter(|&i| found.transmittance.pixels()[i].g < 0.2)
        .count();
    assert!(opaque * 5 < clipped.count(), "{opaque}");
}

#[test]
fn a_label_of_the_screens_hue_is_opaque_and_said() {
    let world = World {
        label: LinearRgb::new(0.15, 0.6, 0.2),
        ..World::default()
    };
    let found = world.solved();
    assert!(world.error(&found, is_label) < 0.08);
    assert!(
        is_told(&found, Code::ScreenHue) && found.color_uncertainty.screen_hue > 0.1,
        "{:?}",
        found.diagnostics
    );
}

#[test]
fn cardboard_and_wood_have_not_the_screens_hue() {
    for brown in [[0.4, 0.25, 0.12], [0.3, 0.17, 0.08]].map(LinearRgb::from) {
        let photo = inside().map(|c| if c.0 > 0.0 { brown } else { GREEN });
        let found = solved_on(GREEN, &photo);
        assert_eq!(found.color_uncertainty.screen_hue, 0.0, "{brown:?}");
        let middle = found.film[(90, 60)];
        assert!(middle.opacity.g > 0.98, "{middle:?}");
    }
}

#[test]
fn a_screen_outside_the_gamut_shows_what_is_let_through() {
    let screen = LinearRgb::new(-0.09, 0.417, 0.056);
    let plastic = LinearRgb::grey(0.074) + screen.scale(0.7);
    let photo = inside().map(|c| if c.0 > 0.0 { plastic } else { screen });
    let found = solved(&photo, &fitted(&photo));
    let (film, t) = (found.film[(90, 60)], found.transmittance[(90, 60)]);
    assert!((t.r - 0.7).abs() < 0.03, "{t:?}");
    assert!((film.color.r - 0.074).abs() < 0.01, "{film:?}");
}

#[test]
fn a_clipped_screen_is_told() {
    let clipped = |green: f32| {
        let screen = LinearRgb { g: green, ..GREEN };
        let found = solved_on(screen, &inside().map(|c| screen.scale(1.0 - 0.4 * c.0)));
        is_told(&found, Code::ClippedScreen)
    };
    assert!(clipped(1.0) && !clipped(GREEN.g));
}

#[test]
fn an_opaque_red_card_has_no_uncertain_tint() {
    let card = LinearRgb::new(0.46, 0.02, 0.02);
    let photo = inside().map(|c| if c.0 > 0.0 { card } else { GREEN });
    let found = solved_on(GREEN, &photo);
    assert!(
        !is_told(&found, Code::TintUncertain),
        "{:?}",
        found.diagnostics
    );
    let confidence = found.color_uncertainty.confidence();
    assert!(confidence > 0.8, "{confidence}");
}

/// What covers the ellipse as columns say, on a screen.
fn solved_columns(screen: LinearRgb, column: impl Fn(usize) -> LinearRgb + Sync) -> FilmMatte {
    let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| match is_inside(x, y) {
        true => column(x),
        false => screen,
    });
    solved_on(screen, &photo)
}

/// Paper and paint of no clear hue were see-through by 0.2 to 0.6 with a high confidence.
#[test]
fn paint_that_is_left_see_through_is_told() {
    let (green, blue) = ([0.05, 0.42, 0.1], [0.04, 0.11, 0.45]);
    let [cool_white, ivory, grey_green] =
        [[0.72, 0.76, 0.87], [0.95, 0.91, 0.72], [0.29, 0.36, 0.27]];
    for (card, screen) in [(cool_white, blue), (ivory, green), (grey_green, green)] {
        let found = solved_columns(screen.into(), |_| card.into());
        let sure = found.color_uncertainty.confidence();
        assert!(
            is_warned(&found, Code::TintUncertain) && sure < 0.3,
            "{card:?}: {sure} {:?}",
            found.diagnostics
        );
    }
    let plastic = LinearRgb::from(green).scale(CLEAR_TRANSMITTANCE) + LinearRgb::grey(0.015);
    let half = solved_columns(
        green.into(),
        |x| if x < 90 { plastic } else { ivory.into() },
    );
    let paint = half.color_uncertainty.paint;
    assert!((0.3..0.6).contains(&paint), "{paint}");
    assert!(is_warned(&half, Code::TintUncertain));
}

/// What is the screen in some shade, or a little beside it, looks as plastic does, but for its
/// glints.
#[test]
fn matt_paint_of_the_screens_hue_is_told() {
    let shades = [0.2, 0.35, 0.5, 0.65];
    let of_screen = |screen: LinearRgb| shades.map(|shade| (screen.scale(shade), screen));
    let beside = [[0.03, 0.22, 0.055], [0.025, 0.2, 0.08], [0.02, 0.17, 0.1]];
    let beside = beside.map(|paint| (paint.into(), GREEN));
    let all = [of_screen(GREEN), of_screen(BLUE)].concat();
    for (paint, screen) in all.into_iter().chain(beside) {
        // Mottled.
        let found = solved_columns(screen, |x| paint.scale(0.9 + 0.02 * (x % 11) as f32));
        let sure = found.color_uncertainty.confidence();
        assert!(
            is_warned(&found, Code::TintUncertain) && sure < 0.2,
            "{paint:?} on {screen:?}: {sure} {:?}",
            found.diagnostics
        );
    }
}

#[test]
fn glints_on_clear_plastic_are_no_paint() {
    let plastic = GREEN.scale(CLEAR_TRANSMITTANCE) + LinearRgb::grey(0.015);
    let found = solved_columns(GREEN, |x| match x % 20 {
        0..2 => plastic + LinearRgb::grey(0.6),
        _ => plastic,
    });
    assert_eq!(found.color_uncertainty.paint, 0.0);
    assert!(found.diagnostics.is_empty(), "{:?}", found.diagnostics);
}

#[test]
fn a_label_of_a_hue_beside_the_screens_is_opaque() {
    // Lime on green, sky on blue: as bright in the screen's channel as the screen through plastic.
    for (label, screen) in [([0.3, 0.4, 0.04], GREEN), ([0.04, 0.25, 0.45], BLUE)] {
        let world = World {
            label: label.into(),
            screen,
            ..World::default()
        };
        let found = world.solved();
        // Seen through it would be 0.2; what is left are its edges, 3 of 30 columns.
        let error = world.error(&found, is_label);
        assert!(error < 0.03, "{error}");
        assert!(
            found.film[(95, 60)].opacity.g > 0.98 && found.diagnostics.is_empty(),
            "{:?}",
            found.diagnostics
        );
    }
}

#[test]
fn dyed_plastic_is_seen_through_under_a_glint_as_beside_it() {
    let flat = LinearRgb::new(0.17, 0.38, 0.54);
    let world = World {
        flat,
        glint: 0.0,
        noise: 0.0,
        ..World::default()
    };
    let (glint, plain) = ((50, 60), world.solved());
    let mut photo = world.photo();
    for y in 58..=62 {
        (48..=52).for_each(|x| photo[(x, y)] = photo[(x, y)] + LinearRgb::grey(0.7));
    }
    let found = solved(&photo, &fitted(&photo));
    let off = found.film[glint].opacity.g - plain.film[glint].opacity.g;
    assert!(off.abs() < 0.1 && found.film[glint].color.g > 0.6, "{off}");
}

#[test]
fn on_a_board_without_a_hue_film_is_guessed_and_said_and_better_than_a_slab_or_the_keyer() {
    for board in [0.15, 0.3, 0.7]
        .map(LinearRgb::grey)
        .into_iter()
        .chain([LinearRgb::new(0.7, 0.62, 0.55)])
    {
        let world = World {
            screen: board,
            ..World::default()
        };
        let (photo, found) = (world.photo(), world.solved());
        assert!(
            matches!(&found.diagnostics[..], [one] if one.code == Code::GreyScreen),
            "{:?}",
            found.diagnostics
        );
        assert!(
            found.uncertainty[(50, 60)] > 0.1 && found.color_uncertainty.confidence() < 0.7,
            "{:?}",
            found.color_uncertainty
        );
        let cut = |cutout: Image<PremulRgba>| {
            let film: Image<Film> = cutout.zip_map(&inside(), |p, m| p.masked(m).into());
            FilmMatte {
                transmittance: film.map(|f| f.opacity.map(|o| 1.0 - o)),
                film,
                ..found.clone()
            }
        };
        let key = Screen::Color(screen_color(&photo, &inside()).unwrap());
        let paper = cut(Keying::new(&photo, key)
            .run(&KeyOptions::default())
            .unwrap()
            .cutout);
        let slab = cut(photo.map(LinearRgb::opaque));
        let [guess, paper, slab] = [&found, &paper, &slab].map(|of| world.error(of, |_| true));
        assert!(
            guess < 0.75 * paper && guess < 0.75 * slab,
            "{board:?}: {guess}, keyer {paper}, slab {slab}"
        );
        // Paint no brighter than the board through plastic is taken for plastic.
        assert!(
            board.r > 0.5 || world.error(&found, is_label) < 0.1,
            "{board:?}"
        );
    }
}

#[test]
fn awkward_input_is_named_not_a_panic() {
    let (photo, plate) = (
        Image::filled(20, 20, GREEN),
        ScreenPlate::even(GREEN, (20, 20)),
    );
    let said = |photo: &Image<LinearRgb>, c: f32, options: &FilmOptions| {
        let inside = Image::filled(20, 20, Coverage(c));
        let refused = film(photo, &plate, &inside, options).unwrap_err();
        refused.to_string()
    };
    let usual = FilmOptions::default();
    assert!(said(&photo, 0.0, &usual).contains("the mask of the object is empty"));
    let strange = Image::filled(20, 20, LinearRgb::new(f32::NAN, 0.5, 0.5));
    assert!(said(&strange, 1.0, &usual).contains("pixel (0, 0) is not a finite number"));
    let wrong = FilmOptions {
        thickness_spread: 0.0,
        ..usual
    };
    let expected = "thickness_spread: 0, expected more than 0";
    assert_eq!(said(&photo, 1.0, &wrong), expected);
}

#[test]
fn a_label_of_the_screens_colour_is_keyed_away_and_that_is_said() {
    for screen in [GREEN, BLUE] {
        let plain = World {
            screen,
            uneven: 0.0,
            ..World::default()
        };
        let painted = World {
            label: screen,
            ..plain
        };
        let [plain, painted] = [plain.solved(), painted.solved()];
        assert!(
            is_warned(&painted, Code::KeyedAway) && !is_warned(&plain, Code::KeyedAway),
            "{:?} {:?}",
            painted.diagnostics,
            plain.diagnostics
        );
        assert!(
            !is_told(&painted, Code::ScreenHue),
            "{:?}",
            painted.diagnostics
        );
        let sure = [
            plain.color_uncertainty.confidence(),
            painted.color_uncertainty.confidence(),
        ];
        assert!(sure[0] > 0.7 && sure[1] < 0.2, "{sure:?}");
    }
}

#[test]
fn the_screen_in_a_hole_is_see_through_whatever_the_dye_seems_to_be() {
    let (green, blue) = ([0.10, 0.45, 0.12], [0.05, 0.12, 0.50]);
    for (screen, ring) in [
        (green, [0.5, 0.06, 0.07]),
        (green, [0.10, 0.04, 0.02]),
        (blue, [0.012; 3]),
    ] {
        let distance = |x: usize, y: usize| (x as f64 - 60.0).hypot(y as f64 - 60.0);
        let inside = Image::from_fn(120, 120, |x, y| Coverage(f32::from(distance(x, y) < 50.0)));
        let photo = Image::from_fn(120, 120, |x, y| {
            let is_ring = (25.0..50.0).contains(&distance(x, y));
            LinearRgb::from(if is_ring { ring } else { screen })
        });
        let plate = ScreenPlate::even(screen.into(), (120, 120));
        let found = film(&photo, &plate, &inside, &FilmOptions::default()).unwrap();
        let hole = found.film[(60, 60)];
        assert!(hole.opacity.max_channel() < 0.05, "{ring:?}: {hole:?}");
        assert!(is_told(&found, Code::KeyedAway));
    }
}

#[test]
fn clear_plastic_beside_a_large_label_is_no_print() {
    let screen = LinearRgb::new(0.10, 0.45, 0.12);
    let inside = Image::from_fn(120, 120, |x, _| Coverage(f32::from((10..110).contains(&x))));
    let photo = Image::from_fn(120, 120, |x, _| match x {
        10..80 => LinearRgb::grey(0.8),
        80..110 => screen.scale(0.56) + LinearRgb::grey(0.01),
        _ => screen,
    });
    let plate = ScreenPlate::even(screen, (120, 120));
    let found = film(&photo, &plate, &inside, &FilmOptions::default()).unwrap();
    assert!(!is_told(&found, Code::KeyedAway));
}

#[test]
fn a_print_of_the_screens_hue_on_something_opaque_is_told() {
    let screen = [0.10, 0.45, 0.12];
    let printed = |print: [f32; 3]| {
        let inside = Image::from_fn(120, 120, |x, _| Coverage(f32::from((10..110).contains(&x))));
        let photo = Image::from_fn(120, 120, |x, y| {
            let color = match (x, y) {
                (40..80, 40..80) => print,
                (10..110, _) => [0.8; 3],
                _ => screen,
            };
            LinearRgb::from(color)
        });
        let plate = ScreenPlate::even(screen.into(), (120, 120));
        film(&photo, &plate, &inside, &FilmOptions::default()).unwrap()
    };
    let is_noticed = |print| is_warned(&printed(print), Code::KeyedAway);
    for shade in [0.3, 0.5, 0.8, 1.0] {
        assert!(is_noticed(screen.map(|c| shade * c)), "{shade}");
    }
    assert!(!is_noticed([0.5, 0.05, 0.05]) && !is_noticed([0.02; 3]) && !is_noticed([0.8; 3]));
}

/// A lattice of opaque bars whose holes are too small for the outline, with the screen in its
/// shadow.
struct Lattice {
    bars: LinearRgb,
    screen: LinearRgb,
    /// What the shadow leaves of the screen's light in the holes.
    shade: f32,
}

impl Lattice {
    fn is_hole(x: usize, y: usize) -> bool {
        is_inside(x, y) && x % 15 < 7 && y % 15 < 7
    }

    fn solved(&self) -> FilmMatte {
        let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
            let shading = 1.0 + 0.15 * libm::sinf(0.11 * x as f32 - 0.07 * y as f32);
            match (Self::is_hole(x, y), is_inside(x, y)) {
                (true, _) => self.screen.scale(self.shade),
                (_, true) => self.bars.scale(shading) + self.screen.scale(0.01),
                _ => self.screen,
            }
        });
        solved_on(self.screen, &photo)
    }

    /// Mean opacity of the bars, and of the holes.
    fn opacities(found: &FilmMatte) -> [f32; 2] {
        [false, true].map(|hole| {
            let covered = (0..SIZE.0 * SIZE.1).map(|i| (i % SIZE.0, i / SIZE.0));
            let part = covered.filter(|&(x, y)| is_inside(x, y) && Self::is_hole(x, y) == hole);
            let opacities: Vec<f32> = part
                .map(|at| found.film[at].opacity.channels().iter().sum::<f32>() / 3.0)
                .collect();
            opacities.iter().sum::<f32>() / opacities.len() as f32
        })
    }
}

#[test]
fn coloured_bars_are_no_dyed_plastic_and_their_holes_no_paint() {
    for screen in [GREEN, BLUE] {
        for bars in [
            [0.18, 0.09, 0.045],
            [0.45, 0.3, 0.22],
            [0.08, 0.012, 0.012],
            [0.75, 0.75, 0.73],
        ] {
            let lattice = Lattice {
                bars: bars.into(),
                screen,
                shade: 0.8,
            };
            let found = lattice.solved();
            let [bar, hole] = Lattice::opacities(&found);
            assert!(bar > 0.9 && hole < 0.35, "{bars:?}: {bar} {hole}");
            assert_eq!(found.flat, LinearRgb::grey(CLEAR_TRANSMITTANCE));
        }
    }
}

#[test]
fn dark_paint_that_may_be_dark_plastic_is_told() {
    for screen in [GREEN, BLUE] {
        for bars in [[0.032, 0.02, 0.012], [0.06, 0.036, 0.022]] {
            let found = Lattice {
                bars: bars.into(),
                screen,
                shade: 0.8,
            }
            .solved();
            let [bar, hole] = Lattice::opacities(&found);
            let is_uncertain = is_warned(&found, Code::TintUncertain);
            assert!(bar > 0.9 || is_uncertain, "{bars:?}: {bar}");
            assert!(hole < 0.35, "{bars:?}: {hole}");
        }
    }
}

#[test]
fn the_screen_in_the_shadow_of_dark_plastic_is_see_through() {
    let (flat, shade) = ([0.17, 0.05, 0.015], 0.6);
    let haze = LinearRgb::from(tint::scattered_tint(flat)).scale(0.01);
    let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let thickness = 0.9 + 0.2 * x as f32 / SIZE.0 as f32;
        match (40..50).contains(&x) && (55..65).contains(&y) {
            true => GREEN.scale(shade),
            false if is_inside(x, y) => haze + LinearRgb::from(flat).scale(thickness) * GREEN,
            false => GREEN,
        }
    });
    let found = solved_on(GREEN, &photo);
    let (film, t) = (found.film[(45, 60)], found.transmittance[(45, 60)]);
    assert!(film.opacity.max_channel() < 0.05, "{film:?}");
    assert!(
        (t.g - shade).abs() < 0.02 && (t.r - shade).abs() < 0.02,
        "{t:?}"
    );
    assert!(film.color.max_channel() < 0.01, "{film:?}");
}

/// Plastic of a dye that scatters some light, on a screen.
fn dyed(flat: [f32; 3], scattered: f32, screen: LinearRgb) -> FilmMatte {
    let haze = LinearRgb::from(tint::scattered_tint(flat)).scale(scattered);
    let photo = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let thickness = 0.8 + 0.4 * x as f32 / SIZE.0 as f32;
        match is_inside(x, y) {
            true => haze + LinearRgb::from(flat).scale(thickness) * screen,
            false => screen,
        }
    });
    solved_on(screen, &photo)
}

/// On a dark screen plastic reflects as much of it as paint.
#[test]
fn dyed_plastic_is_not_taken_for_paint_without_a_word() {
    let is_clear = |found: &FilmMatte| found.flat == LinearRgb::grey(CLEAR_TRANSMITTANCE);
    let [blue, brown] = [[0.2, 0.41, 0.54], [0.38, 0.21, 0.15]];
    for (flat, screen) in [(blue, GREEN), (brown, GREEN), (brown, BLUE)] {
        let ordinary = dyed(flat, 0.02, screen);
        assert!(!is_clear(&ordinary), "{flat:?} on {screen:?}");
        let dark = dyed(flat, 0.04, screen.scale(0.35));
        assert!(
            !is_clear(&dark) && is_warned(&dark, Code::TintUncertain),
            "{flat:?} on dark {screen:?}"
        );
    }
}

mod world;
