//! Screen plate: the screen as it would be seen without the object, pixel by pixel.

mod cells;
mod polynomial;

use super::check::{check_length, check_photo, check_share, check_value, refused};
use super::prepared::check_finite_photo;
use super::register;
use super::screen::{mean_color, screen_pixels, strongest_channel};
use crate::bounds::{above, offset_above};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask, Roi};
use crate::pixel::{Coverage, LinearRgb};
use polynomial::Polynomial;
use serde::{Deserialize, Serialize};

/// How a screen plate is obtained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlateOptions {
    /// Highest degree of the polynomial, 0 to 6. Default: 4.
    pub max_degree: usize,
    /// A higher degree must lower the residual by this share to be used, 0 to 1, except on a screen
    /// with a hot spot. Default: 0.6: around the object only, a higher degree fits shadows and
    /// swings beneath it.
    pub least_gain: f64,
    /// Largest shift of an empty-screen photo, pixels. Default: 8.
    pub max_shift_px: f64,
    /// An empty-screen photo may differ from the photo by this share of the screen's brightness
    /// once it is aligned and its exposure matched, 0 to 1. Default: 0.05.
    pub max_mismatch: f32,
}

impl Default for PlateOptions {
    fn default() -> Self {
        Self {
            max_degree: 4,
            least_gain: 0.6,
            max_shift_px: 8.0,
            max_mismatch: 0.05,
        }
    }
}

/// The screen alone, of the photo's size.
#[derive(Clone, Debug)]
pub struct ScreenPlate {
    /// The empty screen as the camera sees it, its uneven light included; scene-linear.
    pub image: Image<LinearRgb>,
    /// How uneven the screen is: 1 minus darkest over brightest, of its strongest channel; where it
    /// has a hot spot or an `overshoot`, of that at least.
    pub unevenness: f32,
    /// By which share a hot spot, a twentieth of a coloured screen at least, is brighter than the
    /// light that fits most of it; 0 without one, and where the plate is not fitted.
    pub hot_spot: f32,
    /// By which share most of a coloured screen is darker than a fitted plate, where bands, folds or
    /// shadows drew it to what is bright between them; 0 elsewhere.
    pub overshoot: f32,
    /// Standard deviation of the photo around the plate where the screen is free: noise, and what
    /// the plate misses.
    pub residual: LinearRgb,
    /// Highest degree of the fitted polynomials; nothing where the plate is a photo.
    pub degree: Option<usize>,
    /// How far a photographed plate was moved to lie on the photo, pixels right and down; 0 for a
    /// fitted one.
    pub shift_px: [f64; 2],
}

impl ScreenPlate {
    /// Fits a smooth screen to the pixels of a photo that show it.
    ///
    /// `photo` is scene-linear; `background` marks the pixels that surely show the screen. They may
    /// lie around the object only: the polynomial continues under it.
    ///
    /// # Method
    /// The logarithm of each channel is a polynomial of the position, fitted to the means of small
    /// cells by iteratively reweighted least squares with [Tukey]'s biweight, narrower on the
    /// dark side, so that shadows and dirt do not count. Light falls off by factors and never
    /// goes below 0: hence the logarithm. The degree of each channel is the lowest that no higher
    /// one beats by `least_gain` in the residual of cells that were left out of the fit; where that
    /// leaves some of the screen much brighter than its fit (`hot_spot`), one that has any gain.
    ///
    /// # Errors
    /// [`Error::Photo`](crate::Error::Photo) where there is not enough background, or no light on
    /// it; [`Error::Value`](crate::Error::Value) for an option that cannot be right.
    /// # Panics
    /// When the sizes differ.
    ///
    /// [Tukey]: https://doi.org/10.1080/03610927708827533
    pub fn fit(
        photo: &Image<LinearRgb>,
        background: &Mask,
        options: &PlateOptions,
    ) -> Result<Self> {
        options.check()?;
        let cells = cells::means(photo, background);
        let fitted = Polynomial::fit(&cells, photo.size(), options)?;
        let (image, degree) = (fitted.image(photo.size()), Some(fitted.degree));
        let plate = Self::measured(image, photo, background, degree, [0.0; 2]);
        let of_spot = 1.0 - (1.0 + fitted.hot_spot).recip();
        Ok(Self {
            unevenness: plate.unevenness.max(of_spot).max(fitted.overshoot),
            hot_spot: fitted.hot_spot,
            overshoot: fitted.overshoot,
            ..plate
        })
    }

    /// Uses a photo of the empty screen as the plate.
    ///
    /// It is moved onto the photo (by the screen's texture and dirt, if it has any), its exposure
    /// and white balance are matched channel by channel, and its noise is blurred.
    ///
    /// # Errors
    /// [`Error::Photo`](crate::Error::Photo) where the sizes differ, a pixel of the empty screen is
    /// not a finite number, it lies farther off than `max_shift_px`, or differs from what the photo
    /// shows of the screen by more than `max_mismatch`; [`Error::Value`](crate::Error::Value) for
    /// an option that cannot be right.
    /// # Panics
    /// When the sizes of photo and background differ.
    pub fn from_photo(
        empty: &Image<LinearRgb>,
        photo: &Image<LinearRgb>,
        background: &Mask,
        options: &PlateOptions,
    ) -> Result<Self> {
        options.check()?;
        check_same_size(empty.size(), photo.size())?;
        check_finite_photo("the empty screen", empty)?;
        let shift_px = shift_onto(photo, empty, background)?;
        options.check_shift(shift_px)?;
        let image = matched(empty, photo, background, shift_px)?;
        let plate = Self::measured(image, photo, background, None, shift_px);
        options.check_mismatch(plate.mismatch(photo, background))?;
        Ok(plate)
    }

    /// [`ScreenPlate::fit`] to what an object's mask and a margin around it leave free.
    ///
    /// # Errors
    /// Those of [`ScreenPlate::fit`].
    /// # Panics
    /// When the sizes differ.
    pub fn fit_outside(
        photo: &Image<LinearRgb>,
        mask: &Image<Coverage>,
        options: &PlateOptions,
    ) -> Result<Self> {
        Self::fit(photo, &screen_pixels(mask), options)
    }

    /// [`ScreenPlate::from_photo`], checked on what an object's mask and a margin around it leave
    /// free.
    ///
    /// # Errors
    /// Those of [`ScreenPlate::from_photo`].
    /// # Panics
    /// When the sizes of photo and mask differ.
    pub fn from_photo_outside(
        empty: &Image<LinearRgb>,
        photo: &Image<LinearRgb>,
        mask: &Image<Coverage>,
        options: &PlateOptions,
    ) -> Result<Self> {
        Self::from_photo(empty, photo, &screen_pixels(mask), options)
    }

    /// One colour everywhere: the paper's model of the screen.
    pub fn even(color: LinearRgb, (width, height): (usize, usize)) -> Self {
        Self {
            image: Image::filled(width, height, color),
            unevenness: 0.0,
            hot_spot: 0.0,
            overshoot: 0.0,
            residual: LinearRgb::BLACK,
            degree: Some(0),
            shift_px: [0.0; 2],
        }
    }

    /// Mean colour of the plate, scene-linear.
    pub fn color(&self) -> LinearRgb {
        whole_mean(&self.image)
    }

    /// The part of the plate behind a part of the photo; what describes all of it stays.
    ///
    /// # Panics
    /// When `roi` reaches outside the plate.
    pub(super) fn crop(&self, roi: Roi) -> Self {
        Self {
            image: self.image.crop(roi),
            ..*self
        }
    }

    /// The plate in a photo that is exposed by a factor more.
    pub(super) fn exposed(&self, gain: f32) -> Self {
        Self {
            image: self.image.map(|k| k.scale(gain)),
            residual: self.residual.scale(gain),
            ..*self
        }
    }

    /// A plate with its unevenness and its deviation from a photo.
    fn measured(
        image: Image<LinearRgb>,
        photo: &Image<LinearRgb>,
        background: &Mask,
        degree: Option<usize>,
        shift_px: [f64; 2],
    ) -> Self {
        let residual = cells::deviation(photo, &image, background);
        Self {
            unevenness: unevenness(&image),
            hot_spot: 0.0,
            overshoot: 0.0,
            image,
            residual,
            degree,
            shift_px,
        }
    }

    /// The warning about light that no smooth plate follows, and that goes on under the object
    /// nobody knows how.
    pub(super) fn unevenness_warning(&self) -> Option<Diagnostic> {
        let seen = match (self.hot_spot > 0.0, self.overshoot > 0.0) {
            (true, _) => format!(
                "part of the screen is {:.0} % brighter than the light fitted to most of it",
                100.0 * self.hot_spot
            ),
            (false, true) => format!(
                "bands, folds or shadows make most of the screen {:.0} % darker than the light fitted to the rest",
                100.0 * self.overshoot
            ),
            (false, false) => return None,
        };
        let remedy = "light the screen evenly, or give a photo of the empty screen (--plate, or screen in a list)";
        let message = format!("{seen}: transparency may be wrong; {remedy}");
        Some(Diagnostic::warning(Code::UnevenScreen, message))
    }

    /// By how much the plate differs from what the photo shows of the screen, as a share of the
    /// screen's brightness.
    pub(super) fn mismatch(&self, photo: &Image<LinearRgb>, background: &Mask) -> f32 {
        let [seen, expected] = cell_means([photo, &self.image], background);
        cells::mismatch(&seen, &expected)
    }
}

/// Blur of a photographed plate against its noise, standard deviation in pixels: a tenth of the
/// noise is left, and screens have no finer structure that matters.
const PHOTO_BLUR_PX: f32 = 3.0;
/// The highest degree: 28 coefficients a channel.
const MAX_DEGREE: usize = 6;

impl PlateOptions {
    pub(super) fn check(&self) -> Result<()> {
        let degree = self.max_degree;
        check_value(degree <= MAX_DEGREE, "max_degree", || {
            format!("{degree}, expected 0 to {MAX_DEGREE}")
        })?;
        check_share("least_gain", self.least_gain)?;
        check_length("max_shift_px", self.max_shift_px)?;
        check_share("max_mismatch", self.max_mismatch)
    }

    fn check_shift(&self, shift_px: [f64; 2]) -> Result<()> {
        // Where it lies, not how it was moved.
        let (offset, most) = (shift_px.map(|v| -v), self.max_shift_px);
        check_photo(offset.iter().all(|v| v.abs() <= most), || {
            format!(
                "the empty screen is offset by {} px from the photo, expected at most {most}; did the camera move?",
                offset_above(offset, most)
            )
        })
    }

    fn check_mismatch(&self, mismatch: f32) -> Result<()> {
        check_photo(mismatch <= self.max_mismatch, || {
            format!(
                "the empty screen differs from the photo's by {} %, expected at most {:.1} %; did the light change?",
                above(100.0 * mismatch, 100.0 * self.max_mismatch),
                100.0 * self.max_mismatch
            )
        })
    }
}

/// A photo of the empty screen, moved onto the photo, without its noise and of the photo's
/// exposure.
fn matched(
    empty: &Image<LinearRgb>,
    photo: &Image<LinearRgb>,
    background: &Mask,
    shift_px: [f64; 2],
) -> Result<Image<LinearRgb>> {
    let smooth = filter::gaussian_blur(&register::moved(empty, shift_px), PHOTO_BLUR_PX);
    let gain = gain_on_background(photo, &smooth, background)?;
    Ok(smooth.map(|p| p * gain))
}

fn check_same_size((w, h): (usize, usize), (width, height): (usize, usize)) -> Result<()> {
    check_photo((w, h) == (width, height), || {
        format!("the empty screen is {w} x {h} pixels, expected {width} x {height} like the photo")
    })
}

/// How far a photo of the empty screen must be moved to lie on the photo, pixels right and down.
fn shift_onto(
    photo: &Image<LinearRgb>,
    empty: &Image<LinearRgb>,
    background: &Mask,
) -> Result<[f64; 2]> {
    let gain = gain_on_background(photo, empty, background)?;
    // The object's edges must not be seen: the filters of the search reach over them into the free
    // screen.
    let without_object = photo.zip3_map(
        empty,
        background,
        |p, e, free| if free { p } else { e * gain },
    );
    Ok(register::shift(&without_object, empty, background, [1.0; 3]).shift_px)
}

/// The factor per channel from a photo of the empty screen to the photo.
fn gain_on_background(
    photo: &Image<LinearRgb>,
    empty: &Image<LinearRgb>,
    background: &Mask,
) -> Result<LinearRgb> {
    let [photo, empty] = cell_means([photo, empty], background);
    cells::gain(&photo, &empty)
        .ok_or_else(|| refused("the object leaves no background to compare the empty screen with"))
}

/// The cells of two pictures where a photo shows the screen.
fn cell_means(pictures: [&Image<LinearRgb>; 2], background: &Mask) -> [Vec<cells::Cell>; 2] {
    pictures.map(|picture| cells::means(picture, background))
}

fn whole_mean(plate: &Image<LinearRgb>) -> LinearRgb {
    mean_color(plate.pixels().iter().copied()).unwrap_or(LinearRgb::BLACK)
}

/// The least and the greatest of some values.
fn extremes(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values.fold((f32::MAX, 0.0_f32), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

/// 1 minus darkest over brightest of the strongest channel.
fn unevenness(plate: &Image<LinearRgb>) -> f32 {
    let channel = strongest_channel(whole_mean(plate));
    let (low, high) = extremes(plate.pixels().iter().map(|p| p.channels()[channel]));
    if high > 0.0 {
        1.0 - (low / high).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests;
