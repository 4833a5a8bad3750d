//! Photos that are hard to cut out: each must be cut out correctly, or flagged for review.

use super::bottle::{BLUE, BottlePhoto, GREEN, OutlineAccuracy};
use super::{HardCase, Outcome, keyer};
use crate::matte::{GOOD_BOX_PX, GOOD_IOU, review_messages};
use petcomp::matte::{
    CutOut, CutOutOptions, FilmMatte, FilmOptions, PlateOptions, ScreenPlate, TriangulateOptions,
    Triangulated, cut_out, film, triangulate,
};
use petcomp::{Coverage, Image, LinearRgb, Result};

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = keyer::cases();
    cases.extend(ordinary_cut_outs());
    cases.extend(badly_lit_cut_outs());
    cases.extend(small_and_large_cut_outs());
    cases.extend(refused_photos());
    cases.extend(refused_pixels());
    cases.extend(film_mattes());
    cases.extend(two_screens());
    Ok(cases)
}

/// The expected cut-out of a photo.
#[derive(Clone, Copy)]
enum ExpectedCutOut {
    /// The outline is right and needs no review.
    Right,
    /// The outline is right, or flagged for review, or the photo is refused.
    RightOrFlagged,
    /// Flagged with a message that contains this.
    Flagged(&'static str),
}

impl ExpectedCutOut {
    fn description(self) -> String {
        let right = format!(
            "outline right (IoU {GOOD_IOU}, box to {GOOD_BOX_PX} px of the searched picture)"
        );
        match self {
            Self::Right => format!(
                "{right} and not flagged, residual matte of the bare screen below {MAX_RESIDUAL_MATTE}"
            ),
            Self::RightOrFlagged => {
                format!("{right}, or flagged, or rejected; never silently wrong")
            }
            Self::Flagged(what) => format!("flagged with \"{what}\""),
        }
    }

    fn is_met(self, cut: &CutOut, found: &OutlineAccuracy) -> bool {
        let reasons = &found.reasons;
        match self {
            Self::Right => found.is_right && reasons.is_empty() && is_clean(cut),
            Self::RightOrFlagged => found.is_right || !reasons.is_empty(),
            Self::Flagged(what) => reasons.iter().any(|reason| reason.contains(what)),
        }
    }

    fn outcome(self, result: Result<(CutOut, OutlineAccuracy)>) -> Result<Outcome> {
        match (result, self) {
            (Ok((cut, found)), _) => {
                let measured = measured_cut_out(&cut, &found);
                Ok(Outcome::new(measured, self.is_met(&cut, &found)))
            }
            (Err(error), Self::RightOrFlagged) => {
                Ok(Outcome::new(format!("rejected: {error}"), true))
            }
            (Err(error), _) => Err(error),
        }
    }
}

/// A residual matte below one code of 8 bits.
const MAX_RESIDUAL_MATTE: f32 = 0.003;

/// Whether nothing of the screen is left, and the cut-out is no larger than allowed.
fn is_clean(cut: &CutOut) -> bool {
    cut.residual_matte < MAX_RESIDUAL_MATTE
        && cut.film.width().max(cut.film.height()) <= CutOutOptions::default().longest_side
}

fn cut_out_case(name: &str, expected: ExpectedCutOut, photo: BottlePhoto) -> HardCase {
    let (w, h) = photo.size;
    let input = format!("a bottle on a screen, {w} x {h} pixels");
    HardCase::new(name, input, expected.description(), move || {
        expected.outcome(photo.cut())
    })
}

fn measured_cut_out(cut: &CutOut, found: &OutlineAccuracy) -> String {
    let reasons = joined(&found.reasons, "not flagged");
    format!(
        "IoU {:.4}, box off by {:.2} px, residual matte {:.4}, {reasons}",
        found.iou, found.box_px, cut.residual_matte
    )
}

/// Messages in one line; `none` where there are none.
fn joined(messages: &[String], none: &str) -> String {
    if messages.is_empty() {
        none.into()
    } else {
        messages.join("; ")
    }
}

/// Nearly grey: film cannot be distinguished from such a screen.
const GREY_SCREEN: LinearRgb = LinearRgb::new(0.5, 0.52, 0.5);
/// A cap of the green screen's hue.
const GREEN_CAP: LinearRgb = LinearRgb::new(0.02, 0.25, 0.05);

fn ordinary_cut_outs() -> Vec<HardCase> {
    use ExpectedCutOut::{Flagged, Right, RightOrFlagged};
    let same_hue = BottlePhoto {
        cap: GREEN_CAP,
        ..BottlePhoto::default()
    };
    let over_border = BottlePhoto {
        at: vec![[0.2, 0.5]],
        ..BottlePhoto::default()
    };
    vec![
        cut_out_case("plain photo, green screen", Right, on_screen(GREEN)),
        cut_out_case("plain photo, blue screen", Right, on_screen(BLUE)),
        cut_out_case("grey screen", Right, on_screen(GREY_SCREEN)),
        HardCase::new(
            "film on a grey screen",
            "the same photo",
            "flagged, since transmittance cannot be measured",
            cut_out_film_on_grey,
        ),
        cut_out_case("cap of the screen's hue", RightOrFlagged, same_hue),
        cut_out_case(
            "object over the border",
            Flagged("left border"),
            over_border,
        ),
    ]
}

fn badly_lit_cut_outs() -> Vec<HardCase> {
    use ExpectedCutOut::{Right, RightOrFlagged};
    let uneven = BottlePhoto {
        uneven: 0.6,
        ..BottlePhoto::default()
    };
    vec![
        cut_out_case("clipped highlights", Right, with_exposure(1.8)),
        cut_out_case("clipped all over", RightOrFlagged, with_exposure(3.0)),
        cut_out_case("black photo", RightOrFlagged, with_exposure(0.0)),
        cut_out_case("noise of 3 %, green screen", RightOrFlagged, noisy(GREEN)),
        cut_out_case("noise of 3 %, blue screen", RightOrFlagged, noisy(BLUE)),
        cut_out_case("screen uneven by 60 %", Right, uneven),
    ]
}

fn small_and_large_cut_outs() -> Vec<HardCase> {
    use ExpectedCutOut::{Right, RightOrFlagged};
    let [green, blue] = [GREEN, BLUE].map(|screen| of_size((64, 64), screen));
    vec![
        cut_out_case("64 x 64 pixels, green screen", RightOrFlagged, green),
        cut_out_case("64 x 64 pixels, blue screen", RightOrFlagged, blue),
        cut_out_case("12 megapixels", Right, of_size((4000, 3000), GREEN)).for_the_report(),
    ]
}

fn on_screen(screen: LinearRgb) -> BottlePhoto {
    BottlePhoto {
        screen,
        ..BottlePhoto::default()
    }
}

fn with_exposure(exposure: f32) -> BottlePhoto {
    BottlePhoto {
        exposure,
        ..BottlePhoto::default()
    }
}

fn noisy(screen: LinearRgb) -> BottlePhoto {
    BottlePhoto {
        noise: 0.03,
        ..on_screen(screen)
    }
}

fn of_size(size: (usize, usize), screen: LinearRgb) -> BottlePhoto {
    BottlePhoto {
        size,
        ..on_screen(screen)
    }
}

fn cut_out_film_on_grey() -> Result<Outcome> {
    let (cut, _) = on_screen(GREY_SCREEN).cut()?;
    let reasons = review_messages(&cut.diagnostics);
    let is_flagged = reasons.iter().any(|reason| reason.contains("too grey"));
    Ok(Outcome::new(reasons.join("; "), is_flagged))
}

fn refused_photos() -> Vec<HardCase> {
    let two = BottlePhoto {
        at: vec![[0.25, 0.5], [0.75, 0.5]],
        length: 0.4,
        ..BottlePhoto::default()
    };
    let no_object = "is there an object";
    vec![
        refused("two objects", "two objects", move || two.photo()),
        refused("empty screen", no_object, || empty_screen(0.0)),
        refused("empty screen, uneven by 60 %", no_object, || {
            empty_screen(0.6)
        }),
    ]
}

fn refused_pixels() -> Vec<HardCase> {
    let not_finite = "not a finite number";
    vec![
        refused("photo of one pixel", "1 x 1 pixels", || {
            Image::filled(1, 1, GREEN)
        }),
        refused("photo without pixels", "0 x 0 pixels", || Image::new(0, 0)),
        refused("photo with NaN", not_finite, || spoiled(f32::NAN)),
        refused("photo with infinity", not_finite, || spoiled(f32::INFINITY)),
    ]
}

fn empty_screen(uneven: f32) -> Image<LinearRgb> {
    let empty = BottlePhoto {
        at: vec![],
        uneven,
        ..BottlePhoto::default()
    };
    empty.photo()
}

fn refused(
    name: &str,
    cause: &'static str,
    photo: impl Fn() -> Image<LinearRgb> + Send + Sync + 'static,
) -> HardCase {
    HardCase::refused(name, "to be cut out", cause, move || {
        cut_out(&photo(), &CutOutOptions::default())
    })
}

/// A plain photo with one bad pixel.
fn spoiled(value: f32) -> Image<LinearRgb> {
    let mut photo = BottlePhoto::default().photo();
    photo[(300, 160)].r = value;
    photo
}

const SIZE: (usize, usize) = (160, 100);

/// An ellipse in the middle.
fn ellipse() -> Image<Coverage> {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (u, v) = ((x as f32 - 80.0) / 60.0, (y as f32 - 50.0) / 35.0);
        Coverage(f32::from(u8::from(u * u + v * v < 1.0)))
    })
}

/// Light of a glint and transmittance of folded film at a pixel of the ellipse.
fn folded_film(x: usize, y: usize) -> (f32, f32) {
    let (x, y) = (x as f64, y as f64);
    let glint = libm::pow(libm::sin(0.17 * x - 0.29 * y), 8.0);
    let transmittance = 0.6 + 0.2 * libm::sin(0.23 * x + 0.011 * y * y);
    ((0.02 + 0.1 * glint) as f32, transmittance as f32)
}

/// Neutral film on a screen of one colour, times an exposure, clipped at 1.
fn film_on(screen: LinearRgb, exposure: f32) -> Image<LinearRgb> {
    let mask = ellipse();
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (light, passes) = film_or_nothing(&mask, x, y);
        screen.map(|k| ((light + passes * k) * exposure).min(1.0))
    })
}

/// Light and transmittance of the film in the mask, none outside it.
fn film_or_nothing(mask: &Image<Coverage>, x: usize, y: usize) -> (f32, f32) {
    if mask[(x, y)].0 > 0.0 {
        folded_film(x, y)
    } else {
        (0.0, 1.0)
    }
}

fn filled(color: LinearRgb) -> Image<LinearRgb> {
    Image::filled(SIZE.0, SIZE.1, color)
}

fn film_mattes() -> Vec<HardCase> {
    let mut cases = vec![
        // The well-conditioned neighbour of the others.
        HardCase::new(
            "film, nothing extreme",
            "neutral film on an even green screen",
            "transmittance to 0.02 on average",
            judge_ordinary_film,
        ),
        // So dark that no code of a picture would show it: the stage assumes the noise of quantised
        // pictures.
        HardCase::new(
            "film 1000 times underexposed",
            "neutral film on an even green screen",
            "transmittance to 0.02 on average, or a mean uncertainty of at least half of its error",
            judge_underexposed_film,
        ),
    ];
    cases.extend(flagged_films());
    cases.extend([
        even_film("film in a black photo", LinearRgb::BLACK, 0.0),
        even_film("film of the screen's own colour", GREEN, 1.0),
        HardCase::refused(
            "film without an object",
            "a mask of zeros",
            "mask of the object is empty",
            film_without_object,
        ),
        HardCase::new(
            "screen without background",
            "no background pixel to fit to",
            "rejected: not enough background",
            fit_without_background,
        ),
    ]);
    cases
}

fn flagged_films() -> [HardCase; 3] {
    let clipped = "100.0 % of the object is clipped";
    let (white, dark) = (LinearRgb::WHITE, GREEN.scale(1e-30));
    let black = LinearRgb::BLACK;
    [
        flagged_film(
            "film on a black screen",
            film_on(black, 1.0),
            black,
            "too grey",
        ),
        flagged_film(
            "film in a photo clipped all over",
            filled(white),
            GREEN,
            clipped,
        ),
        flagged_film("film in a photo of 1e-30", film_on(dark, 1.0), dark, ""),
    ]
}

fn film_matte(photo: &Image<LinearRgb>, screen: LinearRgb) -> Result<FilmMatte> {
    let plate = ScreenPlate::even(screen, SIZE);
    film(photo, &plate, &ellipse(), &FilmOptions::default())
}

/// A photo without information on the film: pixels must still be valid, with a diagnostic.
fn flagged_film(
    name: &str,
    photo: Image<LinearRgb>,
    screen: LinearRgb,
    cause: &'static str,
) -> HardCase {
    let reported = if cause.is_empty() {
        String::new()
    } else {
        format!("; reported: \"{cause}\"")
    };
    let expectation = format!("opacity in 0..1 and finite light in every pixel{reported}");
    HardCase::new(
        name,
        "neutral film on an even screen",
        expectation,
        move || Ok(judge_soundness(&film_matte(&photo, screen)?, cause)),
    )
}

fn judge_soundness(found: &FilmMatte, cause: &str) -> Outcome {
    let unsound = found.film.pixels().iter().filter(|p| !p.is_sound()).count();
    let messages: Vec<_> = found.diagnostics.iter().map(ToString::to_string).collect();
    let reported = joined(&messages, "nothing reported");
    let passed = unsound == 0 && reported.contains(cause);
    Outcome::new(format!("{unsound} px invalid, {reported}"), passed)
}

/// A photo of one colour: transmittance is 0 where it is black, and 1 where it has the screen's
/// colour.
fn even_film(name: &str, color: LinearRgb, expected: f32) -> HardCase {
    let expectation = format!("transmittance {expected} in every pixel, to 0.05 on average");
    HardCase::new(name, "on an even green screen", expectation, move || {
        judge_even_film(color, expected)
    })
}

fn judge_even_film(color: LinearRgb, expected: f32) -> Result<Outcome> {
    let found = film_matte(&filled(color), GREEN)?.transmittance;
    let off = mean_error_inside(&found, |_, _| expected);
    Ok(Outcome::at_most(off, 0.05, "off"))
}

fn ellipse_area() -> f64 {
    ellipse().pixels().iter().map(|c| f64::from(c.0)).sum()
}

/// The mean of an uncertainty over the ellipse, outside of which it is 0.
fn mean_uncertainty(uncertainty: &Image<f32>) -> f64 {
    let values = uncertainty.pixels().iter().map(|u| f64::from(*u));
    values.sum::<f64>() / ellipse_area()
}

fn judge_ordinary_film() -> Result<Outcome> {
    let found = film_matte(&film_on(GREEN, 1.0), GREEN)?;
    let off = transmittance_error(&found.transmittance);
    Ok(Outcome::at_most(off, 0.02, "off"))
}

/// Exposure of the underexposed film.
const DARK_EXPOSURE: f32 = 1e-3;

fn judge_underexposed_film() -> Result<Outcome> {
    let found = film_matte(&film_on(GREEN, DARK_EXPOSURE), GREEN.scale(DARK_EXPOSURE))?;
    let error = transmittance_error(&found.transmittance);
    let unsure = mean_uncertainty(&found.uncertainty);
    Ok(Outcome::new(
        format!("off by {error:.3}, uncertainty {unsure:.3}"),
        error < 0.02 || unsure > 0.5 * error,
    ))
}

/// Mean error of the green transmittance inside.
fn transmittance_error(found: &Image<LinearRgb>) -> f64 {
    mean_error_inside(found, |x, y| folded_film(x, y).1)
}

fn mean_error_inside(found: &Image<LinearRgb>, expected: impl Fn(usize, usize) -> f32) -> f64 {
    let mask = ellipse();
    let pixels = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y)));
    let inside = pixels.filter(|&at| mask[at].0 > 0.0);
    let off = inside.map(|(x, y)| f64::from((found[(x, y)].g - expected(x, y)).abs()));
    off.sum::<f64>() / ellipse_area()
}

fn film_without_object() -> Result<FilmMatte> {
    let (photo, nothing) = (film_on(GREEN, 1.0), Image::new(SIZE.0, SIZE.1));
    let plate = ScreenPlate::even(GREEN, SIZE);
    film(&photo, &plate, &nothing, &FilmOptions::default())
}

fn fit_without_background() -> Result<Outcome> {
    let nowhere = Image::filled(SIZE.0, SIZE.1, false);
    let plate = ScreenPlate::fit(&film_on(GREEN, 1.0), &nowhere, &PlateOptions::default());
    Ok(Outcome::refused(plate, "background"))
}

fn triangulated(screens: [LinearRgb; 2], exposure: f32) -> Result<Triangulated> {
    let photos = screens.map(|screen| film_on(screen, exposure));
    // What an exposure makes of a screen before the sensor saturates.
    let exposed = screens.map(|screen| screen.map(|v| (v * exposure).min(1.0)));
    let plates = exposed.map(|screen| ScreenPlate::even(screen, SIZE));
    let shots = [(&photos[0], &plates[0]), (&photos[1], &plates[1])];
    triangulate(&shots, &ellipse(), &TriangulateOptions::default())
}

fn two_screens() -> Vec<HardCase> {
    let black = LinearRgb::BLACK;
    vec![
        exact_screens("two screens, green and blue", [GREEN, BLUE]),
        exact_screens("two screens, one of them black", [GREEN, black]),
        similar_screens("two identical screens", [GREEN, GREEN]),
        similar_screens("two screens, both black", [black; 2]),
        HardCase::refused(
            "two photos clipped all over",
            "film on green and blue, 100 times too bright: screens and photos are clipped to white",
            "too similar",
            || triangulated([GREEN, BLUE], 100.0),
        ),
        HardCase::new(
            "two photos with a clipped screen",
            "film on green and blue, 3 times too bright: the green of one screen is clipped from 1.26 to 1",
            "T to 0.05 on average, or flagged, or a residual or mean uncertainty above 0.05",
            || Ok(judge_clipped_screen(&triangulated([GREEN, BLUE], 3.0)?)),
        ),
        HardCase::refused(
            "triangulation from one photo",
            "film on green",
            "expected at least 2",
            triangulate_one_photo,
        ),
    ]
}

fn exact_screens(name: &str, screens: [LinearRgb; 2]) -> HardCase {
    HardCase::new(
        name,
        "neutral film on two even screens, no noise",
        "photo = F + T screen has a unique solution in green: T to 1e-4 on average",
        move || judge_exact_screens(screens),
    )
}

fn judge_exact_screens(screens: [LinearRgb; 2]) -> Result<Outcome> {
    let found = triangulated(screens, 1.0)?.transmittance;
    Ok(Outcome::at_most(transmittance_error(&found), 1e-4, ""))
}

fn similar_screens(name: &str, screens: [LinearRgb; 2]) -> HardCase {
    HardCase::refused(name, "neutral film on both", "too similar", move || {
        triangulated(screens, 1.0)
    })
}

fn judge_clipped_screen(found: &Triangulated) -> Outcome {
    let error = transmittance_error(&found.transmittance);
    let unsure = mean_uncertainty(&found.uncertainty);
    let flags = review_messages(&found.diagnostics).len();
    let residual = found.residual;
    Outcome::new(
        format!(
            "T off by {error:.3}, residual {residual:.3}, uncertainty {unsure:.3}, {flags} flags"
        ),
        error < 0.05 || flags > 0 || residual > 0.05 || unsure > 0.05,
    )
}

fn triangulate_one_photo() -> Result<Triangulated> {
    let (photo, plate) = (film_on(GREEN, 1.0), ScreenPlate::even(GREEN, SIZE));
    let options = TriangulateOptions::default();
    triangulate(&[(&photo, &plate)], &ellipse(), &options)
}
