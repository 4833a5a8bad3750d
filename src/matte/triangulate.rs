//! Triangulation: exact film from photos of the same object on two or more screens.

mod drift;
mod dye;
mod lines;
mod noise;

use super::arrays::channel_pairs;
use super::check::{
    check_coverage, check_length, check_photo, check_positive, check_share, check_value, refused,
};
use super::clipping::{CLIPPED, clipped_screen};
use super::film::{ColorUncertainty, covered, view};
use super::plate::ScreenPlate;
use super::prepared::check_finite_photo;
use super::register::{self, Registered};
use crate::bounds::{above, below, offset_above};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, Film, LinearRgb};
use crate::quantile::median;
use lines::{Inferred, PixelFilm, PixelLines, ScreenLine};
use serde::{Deserialize, Serialize};

/// How film is triangulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TriangulateOptions {
    /// Largest offset of the object from the first photo that is corrected, pixels. Default: 8.
    pub max_shift_px: f64,
    /// After alignment, what the screens do not change must agree between the photos: least
    /// correlation, 0 to 1; 0 for a dyed object, whose every channel the screens change. Default:
    /// 0.5.
    pub least_agreement: f64,
    /// A channel is determined where its transmittance has at most this standard deviation.
    /// Default: 0.05.
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

impl TriangulateOptions {
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) for the first option that cannot be right.
    #[doc(hidden)]
    pub fn check(&self) -> Result<()> {
        check_length("max_shift_px", self.max_shift_px)?;
        check_share("least_agreement", self.least_agreement)?;
        check_positive("max_sigma", self.max_sigma)
    }
}

/// The film that two or more photos show.
#[derive(Clone, Debug)]
pub struct Triangulated {
    /// Reflected light F and opacity `1 - V` by the view transmittance V, which is *estimated*
    /// from T. Of the photos' size, empty outside the object.
    pub film: Image<Film>,
    /// Transmittance T per channel as *measured*: the screen seen through the object and in its
    /// shadow. 1 outside.
    pub transmittance: Image<LinearRgb>,
    /// Expected error of T in each pixel, 0 to 1, of its least certain channel.
    pub uncertainty: Image<f32>,
    /// Which channels of T the screens determine; the others are inferred from these.
    pub determined: [bool; 3],
    /// T of the plastic where it lies flat: what relates V to T.
    pub flat: LinearRgb,
    /// Offset of the object in each photo from the first, pixels right and down; it was corrected.
    pub shift_px: Vec<[f64; 2]>,
    /// Root mean square of what the film leaves unexplained in the photos inside the object,
    /// scene-linear.
    pub residual: f32,
    /// Notes and warnings.
    pub diagnostics: Vec<Diagnostic>,
}

/// Solves `photo = F + T * plate` for F and T by least squares over several photos, each with its
/// own screen.
///
/// Photos are scene-linear, of one size, of the same object under the same light, with the same
/// exposure and white balance; the more the screens differ, the better. `inside` is the object's
/// coverage in the first photo.
///
/// # Method
/// [Smith and Blinn 1996], theorem 4, per channel: T is the slope and F the intercept of the
/// photos' values over the screens'. A channel in which the screens are alike (red, on green and
/// blue) leaves T open there. The determined ones give the dye of PET, and by how much a pixel is
/// such plastic and by how much bare; what little the screens differ in the open channel corrects
/// the dye over the whole object, and the pixel, by the variances. Where dyes of another colour
/// explain the determined channels as well, what they differ by is added to the uncertainty.
///
/// Photos are aligned first. Between two screens grey film changes only along the difference of
/// their colours; the light across it is the same in both photos, and shows how far they lie apart.
///
/// # Errors
/// [`Error::Value`](crate::Error::Value) (`photos`) for fewer than two or of different size,
/// (`mask`) a coverage outside 0 to 1, or an option that cannot be right;
/// [`Error::Photo`](crate::Error::Photo) where a pixel of a photo is not a finite number, no pixel is
/// covered by more than half, no channel of the screens differs, the object moved farther than
/// `max_shift_px`, turned, or moved otherwise (`least_agreement`).
/// # Panics
/// When a photo and its plate differ in size.
///
/// [Smith and Blinn 1996]: https://doi.org/10.1145/237170.237263
pub fn triangulate(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
    options: &TriangulateOptions,
) -> Result<Triangulated> {
    options.check()?;
    check_sizes(shots, inside)?;
    check_pixels(shots)?;
    check_coverage(inside)?;
    check_not_empty(inside)?;
    let aligned = align(shots, inside, options)?;
    let noise = strongest_noise(shots);
    let lines = fit_lines(&aligned, noise);
    // What a plate misses, the shadow beside the object above all, is no noise of the screens' colours.
    let share = noise_beside(shots, inside) / noise;
    let determined = determined_channels(&lines, inside, options.max_sigma / share)?;
    let dye = dye::fit(&lines, inside, determined);
    let inferred = Inferred::fit(&lines, inside, determined, dye);
    let solved = lines.map(|line| inferred.complete(&line));
    let shift_px: Vec<[f64; 2]> = aligned.iter().map(|photo| photo.shift_px).collect();
    // Drift shows as tint, too.
    let doubt = exposure_drift(&aligned, &solved, inside, determined)
        .or_else(|| uncertain_tint(inferred.largest_spread()));
    let told = moved_photos(&shift_px)
        .chain(open_channels(determined))
        .chain(doubt)
        .chain(screen_warnings(shots, inside));
    Ok(Triangulated {
        residual: residual(&aligned, &solved, inside),
        diagnostics: told.collect(),
        determined,
        shift_px,
        ..composed(&solved, inside)
    })
}

/// What was found out about the film, without what is known about the photos.
fn composed(solved: &Image<PixelFilm>, inside: &Image<Coverage>) -> Triangulated {
    let flat = lines::flat_transmittance(solved, inside);
    Triangulated {
        film: seen_film(solved, flat, inside),
        transmittance: solved.zip_map(inside, |p, c| p.transmittance.map(|t| t.max(1.0 - c.0))),
        uncertainty: solved.zip_map(inside, |p, c| p.sigma.min(c.0)),
        flat,
        determined: [false; 3],
        shift_px: Vec::new(),
        residual: 0.0,
        diagnostics: Vec::new(),
    }
}

/// Reflected light, and what is seen through plastic that where it lies flat measures `flat`.
fn seen_film(solved: &Image<PixelFilm>, flat: LinearRgb, inside: &Image<Coverage>) -> Image<Film> {
    let reflected = solved.zip_map(inside, |p, c| {
        p.reflected * p.transmittance.map(|t| kept_share(t, c))
    });
    reflected.zip_map(&view_transmittance(solved, flat, inside), Film::new)
}

/// The share of a channel's film that a mask keeps. The line of a rim's pixel has the screen beside
/// the object in it: the mask takes away only what is more than it covers.
fn kept_share(transmittance: f32, Coverage(c): Coverage) -> f32 {
    (c / (1.0 - transmittance).max(f32::MIN_POSITIVE)).min(1.0)
}

fn view_transmittance(
    solved: &Image<PixelFilm>,
    flat: LinearRgb,
    inside: &Image<Coverage>,
) -> Image<LinearRgb> {
    let measured = solved.map(|p| p.transmittance);
    view(&measured, flat, inside).zip_map(inside, covered)
}

/// The warning about photos that differ in exposure or white balance.
fn exposure_drift(
    photos: &[AlignedPhoto],
    solved: &Image<PixelFilm>,
    inside: &Image<Coverage>,
    determined: [bool; 3],
) -> Option<Diagnostic> {
    let shares = photos
        .iter()
        .map(|aligned| drift::unexplained_share([&aligned.photo, &aligned.screen], solved, inside));
    drift::warning(&shares.collect::<Vec<_>>(), determined)
}

fn uncertain_tint(spread: f32) -> Option<Diagnostic> {
    (spread > ColorUncertainty::NEEDS_REVIEW.tint).then(|| tint_uncertain(spread))
}

fn moved_photos(shift_px: &[[f64; 2]]) -> impl Iterator<Item = Diagnostic> {
    let photos = (1..).zip(shift_px);
    let moved = photos.filter(|(_, shift)| **shift != [0.0; 2]);
    moved.map(|(photo, shift)| moved_photo(photo, *shift))
}

fn open_channels(determined: [bool; 3]) -> impl Iterator<Item = Diagnostic> {
    let channels = CHANNELS.into_iter().zip(determined);
    let open = channels.filter(|(_, determined)| !determined);
    open.map(|(name, _)| similar_screens(name))
}

/// The warnings about screens that are clipped or have a hot spot; photos count from 1.
fn screen_warnings(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
) -> impl Iterator<Item = Diagnostic> {
    let photos = (1..).zip(shots);
    photos.flat_map(move |(number, (photo, plate))| {
        let clipped = clipped_screen(photo, inside, CLIPPED);
        let found = clipped.into_iter().chain(plate.unevenness_warning());
        found.map(move |found| Diagnostic {
            message: format!("photo {number}: {}", found.message),
            ..found
        })
    })
}

/// Noise of a photo at least: coded pictures are no finer.
const MIN_NOISE: f32 = 0.002;
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// A photo and its screen, moved to lie on the first.
struct AlignedPhoto {
    photo: Image<LinearRgb>,
    screen: Image<LinearRgb>,
    /// Where the object lay, not where it was moved.
    shift_px: [f64; 2],
}

fn check_sizes(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
) -> Result<()> {
    check_value(shots.len() >= 2, "photos", || {
        format!("{}, expected at least 2", shots.len())
    })?;
    let (width, height) = inside.size();
    for (i, (photo, plate)) in shots.iter().enumerate() {
        let (w, h) = photo.size();
        assert_eq!(
            (w, h),
            plate.image.size(),
            "photo {i} and its plate differ in size"
        );
        check_value((w, h) == (width, height), &format!("photos[{i}]"), || {
            format!("{w} x {h} pixels, expected {width} x {height}")
        })?;
    }
    Ok(())
}

/// An object is what a mask covers by more than half.
fn check_not_empty(inside: &Image<Coverage>) -> Result<()> {
    check_photo(inside.pixels().iter().any(|c| c.0 > 0.5), || {
        "the mask of the object is empty".into()
    })
}

/// All photos are finite; they count from 1.
fn check_pixels(shots: &[(&Image<LinearRgb>, &ScreenPlate)]) -> Result<()> {
    let mut photos = (1..).zip(shots);
    photos
        .try_for_each(|(number, (photo, _))| check_finite_photo(&format!("photo {number}"), photo))
}

fn align(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
    options: &TriangulateOptions,
) -> Result<Vec<AlignedPhoto>> {
    let ((first, first_plate), others) = (shots[0], &shots[1..]);
    let reach = options.max_shift_px.ceil().max(0.0);
    let aligner = Aligner {
        first,
        near: filter::dilate(&inside.map(|c| c.0 > 0.0), reach),
        options,
    };
    let mut aligned = vec![AlignedPhoto::new(first, first_plate, [0.0; 2])];
    for (number, (photo, plate)) in (2..).zip(others) {
        let weights = unchanged_light(first_plate.color(), plate.color());
        let shift_px = aligner.shift_px(number, photo, weights)?;
        aligned.push(AlignedPhoto::new(photo, plate, shift_px));
    }
    Ok(aligned)
}

impl AlignedPhoto {
    /// Sum of the squares of what a film does not explain of pixel `i`.
    #[inline]
    fn square_residual(&self, i: usize, film: &PixelFilm) -> f64 {
        square_distance(film.over(self.screen.pixels()[i]), self.photo.pixels()[i])
    }

    fn new(photo: &Image<LinearRgb>, plate: &ScreenPlate, by_px: [f64; 2]) -> Self {
        Self {
            photo: register::moved(photo, by_px),
            screen: register::moved(&plate.image, by_px),
            shift_px: by_px.map(|v| 0.0 - v),
        }
    }
}

/// What the other photos are aligned to.
struct Aligner<'a> {
    first: &'a Image<LinearRgb>,
    /// The object and as far around it as it may have moved.
    near: Mask,
    options: &'a TriangulateOptions,
}

impl Aligner<'_> {
    /// Pixels by which photo `number` (the first is 1) must be moved to lie on the first, by the
    /// light that the screens do not change.
    ///
    /// # Errors
    /// [`Error::Photo`](crate::Error::Photo) where it was moved too far, turned, or differs
    /// otherwise.
    fn shift_px(
        &self,
        number: usize,
        photo: &Image<LinearRgb>,
        weights: [f32; 3],
    ) -> Result<[f64; 2]> {
        let found = register::shift(self.first, photo, &self.near, weights);
        let problem = self
            .too_far(&found)
            .or_else(|| self.too_unlike(&found))
            .or_else(|| self.turned(photo, weights));
        match problem {
            Some(what) => Err(refused(format!("photo {number}: {what}"))),
            None => Ok(found.shift_px),
        }
    }

    fn too_far(&self, found: &Registered) -> Option<String> {
        let (offset, most) = (found.shift_px.map(|v| -v), self.options.max_shift_px);
        offset.iter().any(|v| v.abs() > most).then(|| {
            format!(
                "the object is offset by {} px from the first, expected at most {most}; did it move?",
                offset_above(offset, most)
            )
        })
    }

    fn too_unlike(&self, found: &Registered) -> Option<String> {
        let (agreement, least) = (found.agreement, self.options.least_agreement);
        // Photos of a dyed object may even be opposite, and 0 lets all through.
        let is_unlike = agreement.max(0.0) < least;
        (found.sigma_px < MAX_JUDGED_SIGMA_PX && is_unlike).then(|| {
            format!(
                "correlation with the first is {}, expected at least {least:.2}; did the object turn, did the light change, or is it dyed? for a dyed one use --set film.least_agreement=0",
                below(agreement, least)
            )
        })
    }

    fn turned(&self, photo: &Image<LinearRgb>, weights: [f32; 3]) -> Option<String> {
        let apart = self.turned_px(photo, weights)?;
        Some(format!(
            "the offsets of the object's two ends from the first differ by {} px, expected at most \
             {MAX_END_SHIFT_PX}; did it turn?",
            above(apart, MAX_END_SHIFT_PX)
        ))
    }

    /// How far the ends of the object moved apart, in pixels, where that is more than they may and
    /// certainly so.
    fn turned_px(&self, photo: &Image<LinearRgb>, weights: [f32; 3]) -> Option<f64> {
        let [low, high] =
            halves(&self.near).map(|end| register::shift(self.first, photo, &end, weights));
        let [x, y] = [0, 1].map(|axis| low.shift_px[axis] - high.shift_px[axis]);
        let apart = libm::hypot(x, y);
        let sigma = libm::hypot(low.sigma_px, high.sigma_px);
        (apart > MAX_END_SHIFT_PX.max(SIGNIFICANT_SIGMAS * sigma)).then_some(apart)
    }
}

/// A shift less certain than this does not show how well the photos agree.
const MAX_JUDGED_SIGMA_PX: f64 = 0.2;
/// Ends that move farther apart than this leave double edges.
const MAX_END_SHIFT_PX: f64 = 1.0;
/// Standard deviations beyond which a difference is one.
const SIGNIFICANT_SIGMAS: f64 = 4.0;

/// The two halves of an object, cut across the longer side of its box.
fn halves(mask: &Mask) -> [Mask; 2] {
    let (w, h) = mask.size();
    let (axis, middle) = middle_of_longer_side(mask);
    [false, true].map(|above| {
        Image::from_fn(w, h, |x, y| {
            mask[(x, y)] && ([x, y][axis] > middle) == above
        })
    })
}

/// The axis along which a mask's box is longer, and its middle there.
fn middle_of_longer_side(mask: &Mask) -> (usize, usize) {
    let spans = [0, 1].map(|axis| span(mask, axis));
    let [width, height] = spans.map(|[first, last]| last - first);
    let axis = usize::from(height > width);
    (axis, usize::midpoint(spans[axis][0], spans[axis][1]))
}

/// First and last column (axis 0) or row (axis 1) with a set pixel; two equal ones without any.
fn span(mask: &Mask, axis: usize) -> [usize; 2] {
    let (w, h) = mask.size();
    let set = (0..w * h).filter(|&i| mask.pixels()[i]);
    let [low, high] = set.fold([usize::MAX, 0], |[low, high], i| {
        let at = [i % w, i / w][axis];
        [low.min(at), high.max(at)]
    });
    [low.min(high), high]
}

/// The light that does not change between two screens: the mean of the channels without its part
/// along the difference.
fn unchanged_light(a: LinearRgb, b: LinearRgb) -> [f32; 3] {
    let even = [1.0_f32 / 3.0; 3];
    let along = [a.r - b.r, a.g - b.g, a.b - b.b];
    let square: f32 = along.iter().map(|v| v * v).sum();
    if square <= 0.0 {
        return even;
    }
    let share: f32 = along.iter().zip(even).map(|(v, e)| v * e).sum::<f32>() / square;
    along.map(|v| 1.0 / 3.0 - share * v)
}

fn fit_lines(photos: &[AlignedPhoto], noise: f32) -> Image<PixelLines> {
    let (w, h) = photos[0].photo.size();
    Image::from_fn(w, h, |x, y| {
        let mut lines = [ScreenLine::default(); 3];
        for aligned in photos {
            add_point(&mut lines, aligned.screen[(x, y)], aligned.photo[(x, y)]);
        }
        PixelLines { lines, noise }
    })
}

#[inline]
fn add_point(lines: &mut [ScreenLine; 3], screen: LinearRgb, pixel: LinearRgb) {
    for (line, (screen, pixel)) in lines.iter_mut().zip(channel_pairs(screen, pixel)) {
        line.add(screen, pixel);
    }
}

/// Channels whose slope is measured well enough, by the median over the object.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where there is none.
fn determined_channels(
    lines: &Image<PixelLines>,
    inside: &Image<Coverage>,
    max_sigma: f32,
) -> Result<[bool; 3]> {
    let determined = [0, 1, 2].map(|c| {
        let sigmas = lines::covered_pixels(lines, inside).map(|p| p.sigma(c));
        median(sigmas, f32::total_cmp).is_some_and(|sigma| sigma <= max_sigma)
    });
    check_photo(determined != [false; 3], || {
        "the screens are too similar in every channel to separate film from background".into()
    })?;
    Ok(determined)
}

/// Root mean square of what the film does not explain of the photos inside the object.
fn residual(photos: &[AlignedPhoto], solved: &Image<PixelFilm>, inside: &Image<Coverage>) -> f32 {
    let (mut square, mut count) = (0.0_f64, 0.0_f64);
    for i in (0..solved.pixels().len()).filter(|&i| inside.pixels()[i].0 > 0.5) {
        for aligned in photos {
            square += aligned.square_residual(i, &solved.pixels()[i]);
            count += 3.0;
        }
    }
    if count > 0.0 {
        (square / count).sqrt() as f32
    } else {
        0.0
    }
}

fn square_distance(a: LinearRgb, b: LinearRgb) -> f64 {
    let pairs = channel_pairs(a, b).into_iter();
    pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

fn strongest_noise(shots: &[(&Image<LinearRgb>, &ScreenPlate)]) -> f32 {
    shots
        .iter()
        .map(|(_, plate)| plate.residual.max_channel())
        .fold(MIN_NOISE, f32::max)
}

/// The same without what the plates miss.
fn noise_beside(shots: &[(&Image<LinearRgb>, &ScreenPlate)], inside: &Image<Coverage>) -> f32 {
    shots
        .iter()
        .map(|(photo, plate)| noise::beside(photo, inside).min(plate.residual.max_channel()))
        .fold(MIN_NOISE, f32::max)
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

/// Dyes that explain the photos as well let through `off` more or less.
fn tint_uncertain(off: f32) -> Diagnostic {
    Diagnostic::warning(
        Code::TintUncertain,
        format_args!(
            "plastic of another dye and thickness explains the photos equally well: the tint is uncertain by +- {off:.2}; photograph it on a third screen colour"
        ),
    )
}

#[cfg(test)]
mod tests;
