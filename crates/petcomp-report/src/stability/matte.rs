//! Photos that are hard to cut out: each must come out right, or say that it may not have.

use super::bottle::{BLUE, BottlePhoto, GREEN, OutlineAccuracy};
use super::{HardCase, Outcome, keyer};
use crate::matte::{GOOD_BOX_PX, GOOD_IOU};
use petcomp::Image;
use petcomp::Result;
use petcomp::matte::{
    CutOut, CutOutOptions, FilmMatte, FilmOptions, PlateOptions, ScreenPlate, TriangulateOptions,
    Triangulated, film, triangulate,
};
use petcomp::{Coverage, LinearRgb};

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = keyer::cases();
    cases.extend(cut_outs());
    cases.extend(refusals());
    cases.extend(films());
    cases.extend(two_screens());
    Ok(cases)
}

/// What is promised of a photo.
#[derive(Clone, Copy)]
enum ExpectedCutOut {
    /// The outline is right and nothing is said against it.
    Right,
    /// The outline is right, or doubted, or the photo is refused.
    RightOrTold,
    /// This is among the doubts.
    Doubted(&'static str),
}

impl ExpectedCutOut {
    fn told(self) -> String {
        let right = format!(
            "outline right (IoU {GOOD_IOU}, box to {GOOD_BOX_PX} px of the picture that is searched)"
        );
        match self {
            Self::Right => {
                format!("{right} without a doubt, matte of the bare screen below {MOST_RESIDUE}")
            }
            Self::RightOrTold => format!("{right}, or doubted, or refused; never silently wrong"),
            Self::Doubted(what) => format!("doubted, by \"{what}\""),
        }
    }

    fn is_kept(self, cut: &CutOut, found: &OutlineAccuracy) -> bool {
        match self {
            Self::Right => {
                found.is_right
                    && found.doubts.is_empty()
                    && cut.residual_matte < MOST_RESIDUE
                    && is_reduced(cut)
            }
            Self::RightOrTold => found.is_right || !found.doubts.is_empty(),
            Self::Doubted(what) => found.doubts.iter().any(|doubt| doubt.contains(what)),
        }
    }
}

/// A matte below a code of 8 bits.
const MOST_RESIDUE: f32 = 0.003;

/// A cut-out is no larger than it may be.
fn is_reduced(cut: &CutOut) -> bool {
    cut.film.width().max(cut.film.height()) <= CutOutOptions::default().longest_side
}

fn cut_out_of(name: &str, promise: ExpectedCutOut, take: BottlePhoto) -> HardCase {
    let input = format!(
        "a bottle on a screen, {} x {} pixels",
        take.size.0, take.size.1
    );
    HardCase::new(name, input, promise.told(), move || {
        match (take.cut(), promise) {
            (Ok((cut, found)), _) => {
                let doubts = if found.doubts.is_empty() {
                    "no doubt".into()
                } else {
                    found.doubts.join("; ")
                };
                let told = format!(
                    "IoU {:.4}, box off by {:.2} px, residue {:.4}, {doubts}",
                    found.iou, found.box_px, cut.residual_matte
                );
                Ok(Outcome::new(told, promise.is_kept(&cut, &found)))
            }
            (Err(error), ExpectedCutOut::RightOrTold) => {
                Ok(Outcome::new(format!("refused: {error}"), true))
            }
            (Err(error), _) => Err(error),
        }
    })
}

fn cut_outs() -> Vec<HardCase> {
    use ExpectedCutOut::{Doubted, Right, RightOrTold};
    let usual = BottlePhoto::default;
    let grey = LinearRgb::new(0.5, 0.52, 0.5);
    vec![
        cut_out_of("plain photo, green screen", Right, usual()),
        cut_out_of(
            "plain photo, blue screen",
            Right,
            BottlePhoto {
                screen: BLUE,
                ..usual()
            },
        ),
        cut_out_of(
            "grey screen",
            Right,
            BottlePhoto {
                screen: grey,
                ..usual()
            },
        ),
        opaque_on_grey(BottlePhoto {
            screen: grey,
            ..usual()
        }),
        cut_out_of(
            "cap of the screen's hue",
            RightOrTold,
            BottlePhoto {
                cap: LinearRgb::new(0.02, 0.25, 0.05),
                ..usual()
            },
        ),
        cut_out_of(
            "clipped highlights",
            Right,
            BottlePhoto {
                exposure: 1.8,
                ..usual()
            },
        ),
        cut_out_of(
            "clipped all over",
            RightOrTold,
            BottlePhoto {
                exposure: 3.0,
                ..usual()
            },
        ),
        cut_out_of(
            "black photo",
            RightOrTold,
            BottlePhoto {
                exposure: 0.0,
                ..usual()
            },
        ),
        cut_out_of(
            "noise of 3 %, green screen",
            RightOrTold,
            BottlePhoto {
                noise: 0.03,
                ..usual()
            },
        ),
        cut_out_of(
            "noise of 3 %, blue screen",
            RightOrTold,
            BottlePhoto {
                noise: 0.03,
                screen: BLUE,
                ..usual()
            },
        ),
        cut_out_of(
            "screen uneven by 60 %",
            Right,
            BottlePhoto {
                uneven: 0.6,
                ..usual()
            },
        ),
        cut_out_of(
            "object over the border",
            Doubted("left border"),
            BottlePhoto {
                at: vec![[0.2, 0.5]],
                ..usual()
            },
        ),
        cut_out_of(
            "64 x 64 pixels, green screen",
            RightOrTold,
            BottlePhoto {
                size: (64, 64),
                ..usual()
            },
        ),
        cut_out_of(
            "64 x 64 pixels, blue screen",
            RightOrTold,
            BottlePhoto {
                size: (64, 64),
                screen: BLUE,
                ..usual()
            },
        ),
        cut_out_of(
            "12 megapixels",
            Right,
            BottlePhoto {
                size: (4000, 3000),
                ..usual()
            },
        )
        .for_the_report(),
    ]
}

fn opaque_on_grey(take: BottlePhoto) -> HardCase {
    HardCase::new(
        "grey screen tells nothing of film",
        "the same photo",
        "a guess, and that is a doubt",
        move || {
            let doubts: Vec<String> = take
                .cut()?
                .0
                .diagnostics
                .iter()
                .filter(|d| d.needs_review())
                .map(ToString::to_string)
                .collect();
            Ok(Outcome::new(
                doubts.join("; "),
                doubts.iter().any(|doubt| doubt.contains("too grey")),
            ))
        },
    )
}

fn refusals() -> Vec<HardCase> {
    let two = BottlePhoto {
        at: vec![[0.25, 0.5], [0.75, 0.5]],
        length: 0.4,
        ..BottlePhoto::default()
    };
    let empty = |uneven: f32| BottlePhoto {
        at: vec![],
        uneven,
        ..BottlePhoto::default()
    };
    vec![
        refused("two objects", "two objects", move || two.taken().0),
        refused("empty screen", "is there an object", move || {
            empty(0.0).taken().0
        }),
        refused(
            "empty screen, uneven by 60 %",
            "is there an object",
            move || empty(0.6).taken().0,
        ),
        refused("photo of one pixel", "1 x 1 pixels", || {
            Image::filled(1, 1, GREEN)
        }),
        refused("photo without pixels", "0 x 0 pixels", || Image::new(0, 0)),
        refused("photo with NaN", "not a finite number", || {
            spoiled(f32::NAN)
        }),
        refused("photo with infinity", "not a finite number", || {
            spoiled(f32::INFINITY)
        }),
    ]
}

fn refused(
    name: &str,
    cause: &'static str,
    photo: impl Fn() -> Image<LinearRgb> + Send + Sync + 'static,
) -> HardCase {
    HardCase::new(
        name,
        "to be cut out",
        format!("refused, by \"{cause}\""),
        move || {
            Ok(Outcome::refused(
                petcomp::matte::cut_out(&photo(), &Default::default()),
                cause,
            ))
        },
    )
}

/// A plain photo with one bad pixel.
fn spoiled(value: f32) -> Image<LinearRgb> {
    let mut photo = BottlePhoto::default().taken().0;
    photo[(300, 160)].r = value;
    photo
}

const SIZE: (usize, usize) = (160, 100);

/// An ellipse in the middle.
fn inside() -> Image<Coverage> {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (u, v) = ((x as f32 - 80.0) / 60.0, (y as f32 - 50.0) / 35.0);
        Coverage(f32::from(u8::from(u * u + v * v < 1.0)))
    })
}

/// Light of a glint and transmittance of folded film at a pixel, inside.
fn folded(x: usize, y: usize) -> (f32, f32) {
    let (x, y) = (x as f64, y as f64);
    let glint = libm::pow(libm::sin(0.17 * x - 0.29 * y), 8.0);
    (
        (0.02 + 0.1 * glint) as f32,
        (0.6 + 0.2 * libm::sin(0.23 * x + 0.011 * y * y)) as f32,
    )
}

/// Neutral film on a screen of one colour, times an exposure, clipped at 1.
fn on(screen: LinearRgb, exposure: f32) -> Image<LinearRgb> {
    let mask = inside();
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (light, passes) = if mask[(x, y)].0 > 0.0 {
            folded(x, y)
        } else {
            (0.0, 1.0)
        };
        screen.map(|k| ((light + passes * k) * exposure).min(1.0))
    })
}

fn films() -> Vec<HardCase> {
    let white = || Image::filled(SIZE.0, SIZE.1, LinearRgb::WHITE);
    vec![
        nothing_extreme(),
        underexposed(),
        film_told(
            "film on a black screen",
            || on(LinearRgb::BLACK, 1.0),
            LinearRgb::BLACK,
            "too grey",
        ),
        film_told(
            "film in a photo clipped all over",
            white,
            GREEN,
            "100.0 % of the object is clipped",
        ),
        film_passing("film in a black photo", || Image::new(SIZE.0, SIZE.1), 0.0),
        film_passing(
            "film of the screen's own colour",
            || Image::filled(SIZE.0, SIZE.1, GREEN),
            1.0,
        ),
        film_told(
            "film in a photo of 1e-30",
            || on(GREEN.scale(1e-30), 1.0),
            GREEN.scale(1e-30),
            "",
        ),
        empty_mask(),
        no_background(),
    ]
}

fn of_film(photo: &Image<LinearRgb>, screen: LinearRgb) -> Result<FilmMatte> {
    film(
        photo,
        &ScreenPlate::even(screen, SIZE),
        &inside(),
        &FilmOptions::default(),
    )
}

/// A photo that tells nothing: sound pixels all the same, and a remark.
fn film_told(
    name: &str,
    photo: fn() -> Image<LinearRgb>,
    screen: LinearRgb,
    cause: &'static str,
) -> HardCase {
    let said = if cause.is_empty() {
        String::new()
    } else {
        format!("; said: \"{cause}\"")
    };
    let promise = format!("opacity in 0..1 and light finite in every pixel{said}");
    HardCase::new(name, "neutral film on an even screen", promise, move || {
        let found = of_film(&photo(), screen)?;
        let unsound = found.film.pixels().iter().filter(|p| !p.is_sound()).count();
        let remarks = found
            .diagnostics
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("; ");
        let remarks = if remarks.is_empty() {
            "nothing said".into()
        } else {
            remarks
        };
        Ok(Outcome::new(
            format!("{unsound} px unsound, {remarks}"),
            unsound == 0 && remarks.contains(cause),
        ))
    })
}

/// A photo of one colour: nothing passes where it is black, all where it is the screen's.
fn film_passing(name: &str, photo: fn() -> Image<LinearRgb>, expected: f32) -> HardCase {
    let promise = format!("transmittance {expected} in every pixel, to 0.05 on average");
    HardCase::new(name, "on an even green screen", promise, move || {
        let found = of_film(&photo(), GREEN)?;
        let mask = inside();
        let off = found
            .transmittance
            .pixels()
            .iter()
            .zip(mask.pixels())
            .map(|(t, c)| f64::from((t.g - expected).abs() * c.0));
        Ok(Outcome::at_most(
            off.sum::<f64>() / inside_area(),
            0.05,
            "off",
        ))
    })
}

fn inside_area() -> f64 {
    inside().pixels().iter().map(|c| f64::from(c.0)).sum()
}

/// The well-conditioned neighbour of the others.
fn nothing_extreme() -> HardCase {
    let promise = "transmittance to 0.02 on average";
    HardCase::new(
        "film, nothing extreme",
        "neutral film on an even green screen",
        promise,
        || {
            Ok(Outcome::at_most(
                transmittance_error(&of_film(&on(GREEN, 1.0), GREEN)?.transmittance),
                0.02,
                "off",
            ))
        },
    )
}

/// So dark that no code of a picture would tell: the stage counts on the noise of coded pictures.
fn underexposed() -> HardCase {
    const DARK: f32 = 1e-3;
    let promise =
        "transmittance to 0.02 on average, or a mean uncertainty of at least half of its error";
    HardCase::new(
        "film 1000 times underexposed",
        "neutral film on an even green screen",
        promise,
        || {
            let found = of_film(&on(GREEN, DARK), GREEN.scale(DARK))?;
            let error = transmittance_error(&found.transmittance);
            let unsure = found
                .uncertainty
                .pixels()
                .iter()
                .map(|u| f64::from(*u))
                .sum::<f64>()
                / inside_area();
            Ok(Outcome::new(
                format!("off by {error:.3}, uncertainty {unsure:.3}"),
                error < 0.02 || unsure > 0.5 * error,
            ))
        },
    )
}

/// Mean error of the green transmittance inside.
fn transmittance_error(found: &Image<LinearRgb>) -> f64 {
    let mask = inside();
    let pixels = (0..SIZE.1)
        .flat_map(|y| (0..SIZE.0).map(move |x| (x, y)))
        .filter(|&at| mask[at].0 > 0.0);
    pixels
        .map(|(x, y)| f64::from((found[(x, y)].g - folded(x, y).1).abs()))
        .sum::<f64>()
        / inside_area()
}

fn empty_mask() -> HardCase {
    HardCase::new(
        "film without an object",
        "a mask of zeros",
        "refused, by \"mask of the object is empty\"",
        || {
            let (plate, nothing) = (ScreenPlate::even(GREEN, SIZE), Image::new(SIZE.0, SIZE.1));
            let found = film(&on(GREEN, 1.0), &plate, &nothing, &FilmOptions::default());
            Ok(Outcome::refused(found, "mask of the object is empty"))
        },
    )
}

fn no_background() -> HardCase {
    HardCase::new(
        "screen without background",
        "no pixel of it to fit to",
        "refused: there is not enough",
        || {
            let nowhere = Image::filled(SIZE.0, SIZE.1, false);
            Ok(Outcome::refused(
                ScreenPlate::fit(&on(GREEN, 1.0), &nowhere, &PlateOptions::default()),
                "background",
            ))
        },
    )
}

/// What an exposure leaves of a screen before the sensor saturates.
fn exposed(screen: LinearRgb, exposure: f32) -> LinearRgb {
    screen.map(|v| (v * exposure).min(1.0))
}

fn triangulated(screens: [LinearRgb; 2], exposure: f32) -> Result<Triangulated> {
    let photos = screens.map(|screen| on(screen, exposure));
    let plates = screens.map(|screen| ScreenPlate::even(exposed(screen, exposure), SIZE));
    let shots = [(&photos[0], &plates[0]), (&photos[1], &plates[1])];
    triangulate(&shots, &inside(), &TriangulateOptions::default())
}

fn two_screens() -> Vec<HardCase> {
    let exact = |name: &str, screens: [LinearRgb; 2]| {
        let promise = "photo = F + T screen has one solution in green: T to 1e-4 on average";
        HardCase::new(
            name,
            "neutral film on two even screens, no noise",
            promise,
            move || {
                Ok(Outcome::at_most(
                    transmittance_error(&triangulated(screens, 1.0)?.transmittance),
                    1e-4,
                    "",
                ))
            },
        )
    };
    let alike = |name: &str, screens: [LinearRgb; 2]| {
        HardCase::new(
            name,
            "neutral film on both",
            "refused, by \"too similar\"",
            move || Ok(Outcome::refused(triangulated(screens, 1.0), "too similar")),
        )
    };
    vec![
        exact("two screens, green and blue", [GREEN, BLUE]),
        exact("two screens, one of them black", [GREEN, LinearRgb::BLACK]),
        alike("two screens that are the same", [GREEN, GREEN]),
        alike("two screens, both black", [LinearRgb::BLACK; 2]),
        saturated(),
        clipped_screen(),
        one_screen(),
    ]
}

fn saturated() -> HardCase {
    HardCase::new(
        "two photos clipped all over",
        "film on green and blue, 100 times too bright: screens and photos are white",
        "refused, by \"too similar\"",
        || {
            Ok(Outcome::refused(
                triangulated([GREEN, BLUE], 100.0),
                "too similar",
            ))
        },
    )
}

fn clipped_screen() -> HardCase {
    HardCase::new(
        "two photos with a clipped screen",
        "film on green and blue, 3 times too bright: the green of one screen is cut from 1.26 to 1",
        "T to 0.05 on average, or told: a doubt, or a residual or mean uncertainty above 0.05",
        || {
            let found = triangulated([GREEN, BLUE], 3.0)?;
            let error = transmittance_error(&found.transmittance);
            let unsure = found
                .uncertainty
                .pixels()
                .iter()
                .map(|u| f64::from(*u))
                .sum::<f64>()
                / inside_area();
            let doubts = found
                .diagnostics
                .iter()
                .filter(|d| d.needs_review())
                .count();
            let told = doubts > 0 || found.residual > 0.05 || unsure > 0.05;
            let numbers = format!(
                "residual {:.3}, uncertainty {unsure:.3}, {doubts} doubts",
                found.residual
            );
            Ok(Outcome::new(
                format!("T off by {error:.3}, {numbers}"),
                error < 0.05 || told,
            ))
        },
    )
}

fn one_screen() -> HardCase {
    HardCase::new(
        "triangulation from one photo",
        "film on green",
        "refused, by \"expected at least 2\"",
        || {
            let (photo, plate) = (on(GREEN, 1.0), ScreenPlate::even(GREEN, SIZE));
            let found = triangulate(
                &[(&photo, &plate)],
                &inside(),
                &TriangulateOptions::default(),
            );
            Ok(Outcome::refused(found, "expected at least 2"))
        },
    )
}
