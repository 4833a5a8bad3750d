//! Triangulation: exact film from photos of the same object on two or more screens.

mod dye;
mod lines;

use super::film::{covered, view};
use super::plate::ScreenPlate;
use super::register;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, Film, LinearRgb};
use lines::{Borrowed, Line, Pixel};
use serde::{Deserialize, Serialize};

/// How film is triangulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TriangulateOptions {
    /// The object may lie so many pixels off the first photo in another one, and is then moved back. Default: 8.
    pub max_shift_px: f64,
    /// Moved back, what the screens do not change must agree between the photos: least correlation, 0 to 1. Default: 0.5.
    pub least_agreement: f64,
    /// A channel is determined where its transmittance has at most this standard deviation. Default: 0.05.
    pub max_sigma: f32,
}

impl Default for TriangulateOptions {
    fn default() -> Self {
        Self {
            max_shift_px: 8.0,
            least_agreement: 0.5,
            max_sigma: 0.05,
        }
    }
}

/// What two or more photos tell of a film.
#[derive(Clone, Debug)]
pub struct Triangulated {
    /// Reflected light F and opacity `1 - V` by the view transmittance V, which is *estimated* from T. Of the photos' size,
    /// empty outside the object.
    pub film: Image<Film>,
    /// Transmittance T per channel as *measured*: the screen seen through the object and in its shadow. 1 outside.
    pub transmittance: Image<LinearRgb>,
    /// Expected error of T in each pixel, 0 to 1, of the channel that is told worst.
    pub uncertainty: Image<f32>,
    /// Which channels of T the screens determine; another one is told from these.
    pub determined: [bool; 3],
    /// T of the plastic where it lies flat: what relates V to T.
    pub flat: LinearRgb,
    /// How far the object lay off the first photo in each, pixels right and down; it was moved back.
    pub shift_px: Vec<[f64; 2]>,
    /// Root mean square of what the film does not explain of the photos inside the object, scene-linear.
    pub residual: f32,
    /// What a person should know.
    pub diagnostics: Vec<Diagnostic>,
}

/// Solves `photo = F + T * plate` for F and T by least squares over several photos, each with its own screen.
///
/// Photos are scene-linear, of one size, of the same object under the same light; the more the screens differ, the better.
/// `inside` is the object's coverage in the first photo.
///
/// # Method
/// [Smith and Blinn 1996], theorem 4, per channel: T is the slope and F the intercept of the photos' values over the
/// screens'. A channel in which the screens are alike (red, on green and blue) leaves T open there. The determined ones
/// tell the dye of PET, and by how much a pixel is such plastic and by how much bare; what little the screens differ in
/// the open channel corrects the dye over the whole object, and the pixel, by the variances.
///
/// Photos are aligned first. Between two screens grey film changes only along the difference of their colours; the light
/// across it is the same in both photos, and tells how far they lie apart.
///
/// # Errors
/// [`Error::Value`] (`photos`) for fewer than two or of different size; [`Error::Photo`] where no channel of the screens
/// differs, the object moved farther than `max_shift_px`, turned, or moved otherwise (`least_agreement`).
/// # Panics
/// When a photo and its plate differ in size.
///
/// [Smith and Blinn 1996]: https://doi.org/10.1145/237170.237263
pub fn triangulate(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
    opts: &TriangulateOptions,
) -> Result<Triangulated> {
    check(shots, inside)?;
    let aligned = aligned(shots, inside, opts)?;
    let noise = shots
        .iter()
        .map(|(_, plate)| loudest(plate.residual))
        .fold(FINEST, f32::max);
    let lines = fitted(&aligned, noise);
    let determined = determined(&lines, inside, opts.max_sigma);
    if determined == [false; 3] {
        return Err(refused(
            "the screens are too alike in every channel to tell film from background",
        ));
    }
    let borrowed = Borrowed::fit(
        &lines,
        inside,
        determined,
        dye::told(&lines, inside, determined),
    );
    let solved = lines.map(|line| borrowed.complete(&line));
    let shift_px: Vec<[f64; 2]> = aligned.iter().map(|shot| shot.shift_px).collect();
    let moves = (1..).zip(&shift_px).filter(|(_, s)| **s != [0.0; 2]);
    let moved = moves.map(|(photo, shift_px)| moved_photo(photo, *shift_px));
    let names = CHANNELS
        .into_iter()
        .zip(determined)
        .filter(|(_, told)| !told);
    let diagnostics = moved
        .chain(names.map(|(name, _)| similar_screens(name)))
        .collect();
    let flat = lines::flat(&solved, inside);
    let transmittance = solved.zip_map(inside, |p, c| covered(p.transmittance, c));
    let seen = view(&solved.map(|p| p.transmittance), flat, inside).zip_map(inside, covered);
    let reflected = solved.zip_map(inside, |p, c| p.reflected.scale(c.0));
    Ok(Triangulated {
        residual: residual(&aligned, &solved, inside),
        film: reflected.zip_map(&seen, Film::new),
        transmittance,
        uncertainty: solved.zip_map(inside, |p, c| (p.sigma * c.0).min(1.0)),
        determined,
        flat,
        shift_px,
        diagnostics,
    })
}

/// Coded pictures are no finer than this.
const FINEST: f32 = 0.002;
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// A photo and its screen, moved to lie on the first.
struct Shot {
    photo: Image<LinearRgb>,
    screen: Image<LinearRgb>,
    shift_px: [f64; 2],
}

fn check(shots: &[(&Image<LinearRgb>, &ScreenPlate)], inside: &Image<Coverage>) -> Result<()> {
    if shots.len() < 2 {
        return Err(Error::value(
            "photos",
            format!("{}, expected at least 2", shots.len()),
        ));
    }
    for (i, (photo, plate)) in shots.iter().enumerate() {
        assert_eq!(
            photo.size(),
            plate.image.size(),
            "photo {i} and its plate differ in size"
        );
        if photo.size() != inside.size() {
            let ((w, h), (iw, ih)) = (photo.size(), inside.size());
            return Err(Error::value(
                format!("photos[{i}]"),
                format!("{w} x {h} pixels, expected {iw} x {ih}"),
            ));
        }
    }
    Ok(())
}

fn aligned(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
    opts: &TriangulateOptions,
) -> Result<Vec<Shot>> {
    let reach = opts.max_shift_px.ceil().max(0.0);
    let near = filter::dilate(&inside.map(|c| c.0 > 0.0), reach);
    let (first, first_plate) = shots[0];
    let shot = |(i, &(photo, plate)): (usize, &(&Image<LinearRgb>, &ScreenPlate))| {
        if i == 0 {
            return Ok(Shot {
                photo: photo.clone(),
                screen: plate.image.clone(),
                shift_px: [0.0; 2],
            });
        }
        let across = across(first_plate.color(), plate.color());
        let found = register::shift(first, photo, &near, across);
        let [x, y] = found.shift_px;
        let place = format!("photo {}", i + 1);
        if x.abs().max(y.abs()) > opts.max_shift_px {
            return Err(refused(format!(
                "the object in {place} lies ({:.1}, {:.1}) pixels off the first, expected at most {}; did it move?",
                -x, -y, opts.max_shift_px
            )));
        }
        if found.sigma_px < TELLING_PX && found.agreement < opts.least_agreement {
            return Err(refused(format!(
                "{place} agrees with the first by {:.2} only, expected {:.2}; did the object turn or the light change?",
                found.agreement, opts.least_agreement
            )));
        }
        if let Some(apart) = turned_px(first, photo, &near, across) {
            return Err(refused(format!(
                "the two ends of the object in {place} moved {apart:.1} pixels apart from the first, expected at most \
                 {MOST_APART_PX}; did it turn?"
            )));
        }
        let (photo, screen) = (
            register::moved(photo, [x, y]),
            register::moved(&plate.image, [x, y]),
        );
        // Told as where the object lay, not as where it was moved.
        Ok(Shot {
            photo,
            screen,
            shift_px: [0.0 - x, 0.0 - y],
        })
    };
    shots.iter().enumerate().map(shot).collect()
}

/// How far the ends of an object moved apart, in pixels, where that is more than they may and surely so.
fn turned_px(
    first: &Image<LinearRgb>,
    photo: &Image<LinearRgb>,
    near: &Mask,
    across: [f32; 3],
) -> Option<f64> {
    let [low, high] = ends(near).map(|end| register::shift(first, photo, &end, across));
    let apart = libm::hypot(
        low.shift_px[0] - high.shift_px[0],
        low.shift_px[1] - high.shift_px[1],
    );
    let sigma = libm::hypot(low.sigma_px, high.sigma_px);
    (apart > MOST_APART_PX.max(SURE * sigma)).then_some(apart)
}

/// Ends that move farther apart than this leave double edges.
const MOST_APART_PX: f64 = 1.0;
/// Standard deviations beyond which a difference is one.
const SURE: f64 = 4.0;

/// The two halves of an object, cut across the longer side of its box.
fn ends(mask: &Mask) -> [Mask; 2] {
    let (w, h) = mask.size();
    let set = || {
        (0..w * h)
            .filter(|&i| mask.pixels()[i])
            .map(|i| [i % w, i / w])
    };
    let span = |side: usize| {
        let [low, high] = set().fold([usize::MAX, 0], |[low, high], at| {
            [low.min(at[side]), high.max(at[side])]
        });
        [low.min(high), high]
    };
    let spans = [span(0), span(1)];
    let side = usize::from(spans[1][1] - spans[1][0] > spans[0][1] - spans[0][0]);
    let middle = usize::midpoint(spans[side][0], spans[side][1]);
    let half = |above: bool| {
        Image::from_fn(w, h, |x, y| {
            mask[(x, y)] && ([x, y][side] > middle) == above
        })
    };
    [half(false), half(true)]
}

/// A shift known worse than this says nothing of how well the photos agree.
const TELLING_PX: f64 = 0.2;

/// The light that does not change between two screens: luminance without its part along the difference.
fn across(a: LinearRgb, b: LinearRgb) -> [f32; 3] {
    let even = [1.0_f32 / 3.0; 3];
    let (a, b): ([f32; 3], [f32; 3]) = (a.into(), b.into());
    let along: [f32; 3] = std::array::from_fn(|c| a[c] - b[c]);
    let square: f32 = along.iter().map(|v| v * v).sum();
    if square <= 0.0 {
        return even;
    }
    let share: f32 = along.iter().zip(even).map(|(v, e)| v * e).sum::<f32>() / square;
    std::array::from_fn(|c| even[c] - share * along[c])
}

fn fitted(shots: &[Shot], noise: f32) -> Image<Pixel> {
    let (w, h) = shots[0].photo.size();
    Image::from_fn(w, h, |x, y| {
        let mut lines = [Line::default(); 3];
        for shot in shots {
            let (p, k): ([f32; 3], [f32; 3]) =
                (shot.photo[(x, y)].into(), shot.screen[(x, y)].into());
            (0..3).for_each(|c| lines[c].add(k[c], p[c]));
        }
        Pixel { lines, noise }
    })
}

/// Channels whose slope is told well enough, by the median over the object.
fn determined(lines: &Image<Pixel>, inside: &Image<Coverage>, max_sigma: f32) -> [bool; 3] {
    [0, 1, 2].map(|c| {
        let sigmas = lines
            .pixels()
            .iter()
            .zip(inside.pixels())
            .filter(|(_, inside)| inside.0 > 0.5);
        lines::median(sigmas.map(|(p, _)| p.sigma(c))).is_some_and(|sigma| sigma <= max_sigma)
    })
}

fn residual(shots: &[Shot], solved: &Image<lines::Solved>, inside: &Image<Coverage>) -> f32 {
    let (mut square, mut count) = (0.0_f64, 0.0_f64);
    for i in (0..solved.pixels().len()).filter(|&i| inside.pixels()[i].0 > 0.5) {
        let lines::Solved {
            transmittance,
            reflected,
            ..
        } = solved.pixels()[i];
        for shot in shots {
            let told: [f32; 3] = (reflected + transmittance * shot.screen.pixels()[i]).into();
            let seen: [f32; 3] = shot.photo.pixels()[i].into();
            square += told
                .iter()
                .zip(seen)
                .map(|(a, b)| f64::from(a - b).powi(2))
                .sum::<f64>();
            count += 3.0;
        }
    }
    if count > 0.0 {
        (square / count).sqrt() as f32
    } else {
        0.0
    }
}

fn loudest(noise: LinearRgb) -> f32 {
    noise.r.max(noise.g).max(noise.b)
}

fn refused(what: impl Into<String>) -> Error {
    Error::Photo { what: what.into() }
}

/// `photo` counts from 1.
fn moved_photo(photo: usize, [x, y]: [f64; 2]) -> Diagnostic {
    Diagnostic::note(
        Code::Moved,
        format_args!(
            "photo {photo} is offset by ({x:.2}, {y:.2}) px from the first; it was aligned"
        ),
    )
}

fn similar_screens(channel: &str) -> Diagnostic {
    Diagnostic::note(
        Code::SimilarScreens,
        format_args!(
            "the screens are too similar in {channel}: its transmittance is inferred from the other channels"
        ),
    )
}

#[cfg(test)]
mod tests;
