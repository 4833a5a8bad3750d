//! What can be wrong with a capture, by what the display looks like around the object.

use super::recognise::refused;
use super::solve::BlackAndWhite;
use super::stack::DIFFERENCE_BLUR_PX;
use crate::bounds::above;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, LinearRgb};
use crate::quantile::{median, quantile};

/// How much of an area may be clipped in photos of the white frame.
struct ClippingLimits {
    /// Share of it that glints may clip.
    max: f64,
    /// Share from which on it is refused.
    refused: f64,
    /// What is clipped.
    what: &'static str,
    advice: &'static str,
}

/// Of the display: from the refused share on nothing can be measured.
const DISPLAY_CLIPPING: ClippingLimits = ClippingLimits {
    max: 0.001,
    refused: 0.05,
    what: "of the white frame is clipped",
    advice: "; use a shorter exposure or a darker display",
};

/// Of an object, under whose glints passes what passes around them: from the refused share on most
/// of it would be a guess.
const OBJECT_CLIPPING: ClippingLimits = ClippingLimits {
    max: 0.03,
    refused: 0.5,
    what: "of the object is clipped in the white frame",
    advice: ": its transmittance there is taken from its surroundings; use a shorter exposure, or darken the room",
};

/// The warnings about photos of the white frame, each with where it is clipped.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where much of one is clipped.
pub(super) fn clipping(photos: &[(String, Mask)], free: &Mask) -> Result<Vec<Diagnostic>> {
    DISPLAY_CLIPPING.warnings(photos, free)
}

/// The warnings about an object that clips where the display does not: in photos of the white
/// frame, each with where it is clipped.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where most of the object is clipped in one.
pub(super) fn clipped_object(
    photos: &[(String, Mask)],
    coverage: &Image<Coverage>,
) -> Result<Vec<Diagnostic>> {
    OBJECT_CLIPPING.warnings(photos, &coverage.map(|c| c.0 > 0.5))
}

impl ClippingLimits {
    fn warnings(&self, photos: &[(String, Mask)], area: &Mask) -> Result<Vec<Diagnostic>> {
        let warnings = photos
            .iter()
            .map(|(name, clipped)| self.warning(name, share_within(clipped, area)));
        warnings.filter_map(Result::transpose).collect()
    }

    fn warning(&self, photo: &str, share: f64) -> Result<Option<Diagnostic>> {
        let Self {
            max,
            refused: too_much,
            what,
            advice,
        } = self;
        if share <= *max {
            return Ok(None);
        }
        let what = format!(
            "{photo}: {} % {what}, expected at most {} %{advice}",
            above(100.0 * share, 100.0 * max),
            100.0 * max
        );
        if share > *too_much {
            return Err(refused(&what));
        }
        Ok(Some(Diagnostic::warning(Code::ClippedWhite, what)))
    }
}

/// Share of an area that a mask is set in.
fn share_within(mask: &Mask, area: &Mask) -> f64 {
    let within = mask.zip_map(area, |set, inside| set && inside);
    within.count() as f64 / area.count().max(1) as f64
}

/// Side of the blocks whose means show bands, pixels.
const BLOCK_PX: usize = 12;
/// Bands up to this share of white are noise and dirt.
const MAX_BANDS: f64 = 0.015;
/// From here on transmittance would be off by as much.
const REFUSED_BANDS: f64 = 0.05;

/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where the white frame is far from smooth.
pub(super) fn bands(frames: &BlackAndWhite<'_>, free: &Mask) -> Result<Option<Diagnostic>> {
    let ratio = frames.white.zip_map(frames.empty_white, |p, e| {
        p.mean() / e.mean().max(1e-6) - 1.0
    });
    let deviation = deviation_of_blocks(&ratio, free);
    if deviation <= MAX_BANDS {
        return Ok(None);
    }
    let what = format!(
        "around the object the white frame is uneven by {} %, expected at most {:.1} %: bands of a flickering display, \
         reflections, shadows, or moire (focus on the object, not on the display, or change the distance); \
         expose for 1/30 s or longer with the display at full brightness, and darken the room",
        above(100.0 * deviation, 100.0 * MAX_BANDS),
        100.0 * MAX_BANDS
    );
    if deviation > REFUSED_BANDS {
        return Err(refused(&what));
    }
    Ok(Some(Diagnostic::warning(Code::Banding, what)))
}

/// Root mean square of the means over blocks that are free.
fn deviation_of_blocks(image: &Image<f32>, free: &Mask) -> f64 {
    let (w, h) = image.size();
    let corners = (0..h / BLOCK_PX)
        .flat_map(|j| (0..w / BLOCK_PX).map(move |i| (i * BLOCK_PX, j * BLOCK_PX)));
    let means = corners.filter_map(|corner| block_mean(image, free, corner));
    let (sum, count) = means.fold((0.0, 0.0), |(sum, n), mean| (sum + mean * mean, n + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

fn block_mean(image: &Image<f32>, free: &Mask, (x, y): (usize, usize)) -> Option<f64> {
    let pixels = (0..BLOCK_PX * BLOCK_PX).map(|i| (x + i % BLOCK_PX, y + i / BLOCK_PX));
    let mut sum = 0.0;
    for at in pixels {
        if !free[at] {
            return None;
        }
        sum += f64::from(image[at]);
    }
    Some(sum / (BLOCK_PX * BLOCK_PX) as f64)
}

/// Ratios of channels may change across the display by this share.
const MAX_COLOR_CHANGE: f32 = 0.2;

/// The warning about a display whose white changes its colour from one side to the other.
pub(super) fn color_change(empty_white: &Image<LinearRgb>, free: &Mask) -> Option<Diagnostic> {
    // Finite: a blur spreads what is not.
    let changes = [|p: LinearRgb| p.r, |p: LinearRgb| p.b].map(|light| {
        let ratio = empty_white.map(|p| light(p) / p.g.max(1e-6));
        change_where(&ratio, free)
    });
    let change = changes[0].max(changes[1]);
    (change > MAX_COLOR_CHANGE).then(|| {
        let what = format!(
            "white changes its colour across the display by {} %, expected at most {:.0} %; \
             photograph from straight above and from farther away",
            above(100.0 * change, 100.0 * MAX_COLOR_CHANGE),
            100.0 * MAX_COLOR_CHANGE
        );
        Diagnostic::warning(Code::ColorByAngle, what)
    })
}

/// Share of the display, at either end of the values, that may be specks and noise.
const SPECKS: f64 = 0.01;

/// A large over a small value where a mask is set, less 1.
fn change_where(image: &Image<f32>, mask: &Mask) -> f32 {
    let smooth = filter::gaussian_blur(image, DIFFERENCE_BLUR_PX);
    let values: Vec<f32> = smooth.pixels_in(mask).collect();
    let end = |share| quantile(values.clone(), share, f32::total_cmp).unwrap_or(1.0);
    end(1.0 - SPECKS) / end(SPECKS).max(f32::MIN_POSITIVE) - 1.0
}

/// Light through an object, over that of the display without it, that noise explains.
const MAX_PASSED: f32 = 1.03;

/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where most of an object would let more light pass than the
/// display has without it: glints and refraction do that to few of its pixels.
pub(super) fn exchange(frames: &BlackAndWhite<'_>, coverage: &Image<Coverage>) -> Result<()> {
    let object = coverage.map(|c| c.0 > 0.5);
    let brighter = passed(frames).zip3_map(&frames.light(), &object, |passed, light, inside| {
        inside && passed > MAX_PASSED * light.mean()
    });
    if 2 * brighter.count() <= object.count() {
        return Ok(());
    }
    Err(refused(
        "through most of the object the display is brighter than without it; \
         are its photos and those of the empty display (--empty) swapped?",
    ))
}

/// A black photo that differs from the empty display by less than this share of white shows noise.
const MIN_DIFFERENCE: f32 = 0.001;
/// A photo whose difference inside an object is less than this many times that around it shows
/// nothing of it: lamps and shadows change how bright an object is, not whether it is seen.
const UNSEEN: f32 = 2.0;
/// From here on it shows it, unless the room's light changed.
const SEEN: f32 = 6.0;

/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where some photos of the black frame, each with its grey
/// light, show the object, and others nothing of it.
pub(super) fn black_without_object(
    photos: &[(String, Image<f32>)],
    frames: &BlackAndWhite<'_>,
    coverage: &Image<Coverage>,
    free: &Mask,
) -> Result<()> {
    if photos.len() < 2 {
        return Ok(());
    }
    let object = coverage.map(|c| c.0 > 0.5);
    let least = MIN_DIFFERENCE * median_where(&frames.light().map(LinearRgb::mean), free);
    // How much each differs from the empty display inside the object, in units of what it does
    // around it.
    let all = photos.iter().map(|(name, black)| {
        let off = difference(black, frames);
        let around = median_where(&off, free).max(least);
        let seen = mean_where(&off, &object) / around.max(f32::MIN_POSITIVE);
        (name.as_str(), seen)
    });
    let all: Vec<(&str, f32)> = all.collect();
    let unseen = all.iter().filter(|(_, seen)| *seen < UNSEEN);
    let unseen: Vec<&str> = unseen.map(|(name, _)| *name).collect();
    if unseen.is_empty() || all.iter().all(|(_, seen)| *seen < SEEN) {
        return Ok(());
    }
    Err(refused(&format!(
        "{}: black frame without the object, though other black photos show it; photos without the \
         object belong in empty (--empty); or did the room's light change?",
        unseen.join(" and ")
    )))
}

/// How much a black photo differs from the empty display, without noise.
fn difference(black: &Image<f32>, frames: &BlackAndWhite<'_>) -> Image<f32> {
    let off = black.zip_map(frames.empty_black, |p, e| p - e.mean());
    filter::gaussian_blur(&off, DIFFERENCE_BLUR_PX).map(f32::abs)
}

fn median_where(image: &Image<f32>, mask: &Mask) -> f32 {
    median(image.pixels_in(mask), f32::total_cmp).unwrap_or_default()
}

fn mean_where(image: &Image<f32>, mask: &Mask) -> f32 {
    let sum: f64 = image.pixels_in(mask).map(f64::from).sum();
    (sum / mask.count().max(1) as f64) as f32
}

/// What is seen more of white than of black.
fn passed(frames: &BlackAndWhite<'_>) -> Image<f32> {
    frames
        .white
        .zip_map(frames.black, |w, k| w.mean() - k.mean())
}

/// Motion of the camera that leaves double edges, pixels of the photo.
const MAX_MOTION_PX: f64 = 2.0;

/// The warning about a camera that moved.
pub(super) fn camera_motion(motion_px: f64) -> Option<Diagnostic> {
    (motion_px > MAX_MOTION_PX).then(|| {
        let what = format!(
            "the camera moved by up to {} px between photos, expected at most {MAX_MOTION_PX}: \
             the display is aligned, but not what rises above it; put the camera on a stand",
            above(motion_px, MAX_MOTION_PX)
        );
        Diagnostic::warning(Code::CameraMoved, what)
    })
}

/// What the stripes on average differ from the mean of black and white, as a share of white.
const MAX_CHANGE: f64 = 0.05;

/// The warning about an object that moved between black, white and stripes, or a room whose light
/// changed: the mean of the stripes is half of white over black, wherever lines of sight end.
pub(super) fn object_motion(
    frames: &BlackAndWhite<'_>,
    stripes: &Image<f32>,
    coverage: &Image<Coverage>,
    free: &Mask,
) -> Option<Diagnostic> {
    let change = change_of_stripes(frames, stripes, coverage, free);
    (change > MAX_CHANGE).then(|| {
        let what = format!(
            "inside the object the stripes differ on average by {} % of white from the mean of black and white, expected at most {:.1} %: \
             did it move, or did the room's light change?",
            above(100.0 * change, 100.0 * MAX_CHANGE),
            100.0 * MAX_CHANGE
        );
        Diagnostic::warning(Code::ObjectMoved, what)
    })
}

/// How far the mean of the stripes is off that of black and white inside the object, root mean
/// square, as a share of white.
fn change_of_stripes(
    frames: &BlackAndWhite<'_>,
    stripes: &Image<f32>,
    coverage: &Image<Coverage>,
    free: &Mask,
) -> f64 {
    let passed = passed(frames);
    let above = stripes.zip_map(frames.black, |mean, k| mean - k.mean());
    let share = ratio_where(&above, &passed, free);
    let light = frames
        .light()
        .map(|light| light.mean().max(f32::MIN_POSITIVE));
    let off = above.zip3_map(&passed, &light, |above, passed, light| {
        (above - share * passed) / light
    });
    root_mean_square(&off, coverage)
}

fn root_mean_square(image: &Image<f32>, coverage: &Image<Coverage>) -> f64 {
    let inside = coverage.map(|c| c.0 > 0.5);
    let values = image.pixels_in(&inside);
    let (sum, count) = values.fold((0.0, 0.0), |(sum, n), v| (sum + f64::from(v * v), n + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Sum of one picture over that of another, where a mask is set.
fn ratio_where(a: &Image<f32>, b: &Image<f32>, mask: &Mask) -> f32 {
    let [sum_a, sum_b] = [a, b].map(|v| v.pixels_in(mask).map(f64::from).sum::<f64>());
    (sum_a / sum_b.max(1e-9)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uneven_display_may_be_moire() {
        let (w, h) = (4 * BLOCK_PX, 4 * BLOCK_PX);
        let empty = Image::filled(w, h, LinearRgb::grey(0.8));
        let white = Image::from_fn(w, h, |x, _| {
            let is_bright = (x / BLOCK_PX).is_multiple_of(2);
            LinearRgb::grey(if is_bright { 0.824 } else { 0.776 })
        });
        let frames = BlackAndWhite {
            black: &empty,
            white: &white,
            empty_black: &empty,
            empty_white: &empty,
        };
        let free = Image::filled(w, h, true);
        let told = bands(&frames, &free).unwrap().unwrap().message;
        assert!(
            told.contains("uneven by 3.0 %")
                && told.contains("moire (focus on the object, not on the display"),
            "{told}"
        );
    }
}
