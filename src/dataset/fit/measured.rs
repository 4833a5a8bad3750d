//! Labelled pictures and measurements of their pixels around the labels.

use super::statistics::Weighted;
use crate::dataset::contact_sheet::shrunk;
use crate::dataset::page::beside::PixelStatistics;
use crate::dataset::page::labelled_pictures::{LabelledPicture, LabelledSet, ShareBox};
use crate::error::Result;
use crate::image::Image;
use crate::io;
use crate::light::{plate_blur, plate_noise};
use crate::pixel::LinearRgb;
use crate::quantile::median;
use crate::scene::{Blur, Noise};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// Maximum number of pictures whose pixels are read.
const MAX_MEASURED: usize = 64;
/// Pictures of which less than this share is around the labels say nothing about the place.
const LEAST_SHARE: f64 = 0.1;

/// Pictures, and their measurements.
pub(super) struct MeasuredSet {
    pub(super) set: LabelledSet,
    /// Of the pictures whose pixels were read, with their file names.
    pub(super) pixels: Vec<(String, PixelMeasures)>,
}

/// Measurements of a picture's pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelMeasures {
    /// Width of the picture, pixels.
    pub(super) width: usize,
    /// Mean and standard deviation of its 8-bit codes.
    pub(super) brightness: f64,
    pub(super) contrast: f64,
    /// From here on measured around the labels. Binary logarithm of the median luminance.
    pub(super) exposure_ev: f64,
    /// Natural logarithm of red over blue.
    pub(super) red_over_blue: f64,
    /// Variance of noise per unit of light, and in the dark.
    pub(super) shot: f64,
    pub(super) dark: f64,
    /// Variance of the blur, px^2.
    pub(super) blur: f64,
}

impl MeasuredSet {
    /// Reads pictures; pixels are measured at the width of the recipe's pictures, unless theirs is
    /// smaller.
    ///
    /// # Errors
    /// A folder without images; a label that cannot be read.
    pub(super) fn read(folder: &Path, width: u32) -> Result<Self> {
        Ok(Self::new(LabelledSet::read(folder)?, width))
    }

    /// The same for pictures whose labels are already read.
    pub(super) fn new(set: LabelledSet, width: u32) -> Self {
        let pictures = set.spread(MAX_MEASURED).into_par_iter();
        let pixels = pictures.filter_map(|picture| {
            let pixels = PixelMeasures::read(picture, width as usize)?;
            Some((picture.path.to_string_lossy().into_owned(), pixels))
        });
        Self {
            pixels: pixels.collect(),
            set,
        }
    }

    /// Boxes of the pictures that have a label file.
    pub(super) fn boxes(&self) -> Vec<Vec<[f64; 4]>> {
        let pictures = self.set.pictures.iter();
        let labelled = pictures.filter_map(|picture| picture.boxes.as_ref());
        labelled
            .map(|boxes| boxes.iter().map(|(_, shares)| *shares).collect())
            .collect()
    }

    /// Whether some picture is narrower than this.
    pub(super) fn is_narrower_than(&self, width: u32) -> bool {
        let mut pictures = self.pixels.iter();
        pictures.any(|(_, pixels)| pixels.width < width as usize)
    }

    /// One value for each measured picture.
    pub(super) fn values(&self, value: fn(&PixelMeasures) -> f64) -> Vec<f64> {
        self.pixels
            .iter()
            .map(|(_, pixels)| value(pixels))
            .collect()
    }

    /// The same for each picture, grouped by a function of its name.
    pub(super) fn grouped(
        &self,
        value: fn(&PixelMeasures) -> f64,
        group: impl Fn(&str) -> String,
    ) -> Vec<Vec<Vec<Weighted>>> {
        let mut groups: BTreeMap<String, Vec<Vec<Weighted>>> = BTreeMap::new();
        for (name, pixels) in &self.pixels {
            groups
                .entry(group(name))
                .or_default()
                .push(vec![(value(pixels), 1.0)]);
        }
        groups.into_values().collect()
    }
}

impl PixelMeasures {
    /// None for a picture that cannot be read, with a warning, or of which too little is visible
    /// around its labels.
    fn read(picture: &LabelledPicture, width: usize) -> Option<Self> {
        let read = io::read::<LinearRgb>(&picture.path);
        let read = read.inspect_err(|error| log::warn!("{error}")).ok()?;
        let boxes = picture.boxes.as_deref().unwrap_or_default();
        Self::around(&shrunk(Cow::Owned(read), width), boxes)
    }

    /// Measures a picture and its surroundings of boxes.
    pub(super) fn around(picture: &Image<LinearRgb>, boxes: &[ShareBox]) -> Option<Self> {
        let around = surroundings(picture, boxes);
        let seen: Vec<LinearRgb> = around
            .pixels()
            .iter()
            .copied()
            .filter(|p| p.is_finite())
            .collect();
        if (seen.len() as f64) < LEAST_SHARE * picture.pixels().len() as f64 {
            return None;
        }
        let whole = PixelStatistics::of_whole(picture);
        let (shot, dark) = noise_of(&around);
        Some(Self {
            width: picture.width(),
            brightness: whole.brightness,
            contrast: whole.contrast,
            exposure_ev: median_luminance(&seen).max(f64::MIN_POSITIVE).log2(),
            red_over_blue: red_over_blue(&seen),
            shot,
            dark,
            blur: blur_of(&around).powi(2),
        })
    }

    /// Standard deviation of the noise in mid grey, 8-bit codes.
    pub(super) fn grey_noise(&self) -> f64 {
        let sigma = (self.shot * MID_GREY + self.dark).max(0.0).sqrt();
        sigma * CODES_PER_LIGHT
    }

    pub(super) fn blur_px(&self) -> f64 {
        self.blur.max(0.0).sqrt()
    }
}

/// Luminance of mid grey, and the slope of the sRGB curve there, 8-bit codes per unit of light.
const MID_GREY: f64 = 0.18;
const CODES_PER_LIGHT: f64 = 255.0 * 1.055 / 2.4 * 2.719;

/// The picture without its labels: pixels in a box are NaN.
fn surroundings(picture: &Image<LinearRgb>, boxes: &[ShareBox]) -> Image<LinearRgb> {
    let (w, h) = picture.size();
    let mut around = picture.clone();
    for (_, [x, y, width, height]) in boxes {
        let across = pixels_within(*x, *width, w);
        for row in pixels_within(*y, *height, h) {
            for column in across.clone() {
                around[(column, row)] = LinearRgb::grey(f32::NAN);
            }
        }
    }
    around
}

/// The pixels of a side that an interval touches, whose middle and length are shares of the side.
fn pixels_within(middle: f64, length: f64, side: usize) -> std::ops::Range<usize> {
    let [low, high] = [-0.5, 0.5].map(|half| (middle + half * length) * side as f64);
    (low.floor().max(0.0) as usize).min(side)..(high.ceil().max(0.0) as usize).min(side)
}

fn median_luminance(pixels: &[LinearRgb]) -> f64 {
    let luminances = pixels.iter().map(|p| p.luminance());
    f64::from(median(luminances, f32::total_cmp).unwrap_or_default())
}

fn red_over_blue(pixels: &[LinearRgb]) -> f64 {
    let sums = pixels.iter().fold([0.0; 2], |[red, blue], p| {
        [red + f64::from(p.r), blue + f64::from(p.b)]
    });
    let [red, blue] = sums.map(|sum| sum.max(f64::MIN_POSITIVE));
    (red / blue).ln()
}

fn noise_of(around: &Image<LinearRgb>) -> (f64, f64) {
    match plate_noise(around) {
        Noise::Known { shot, read } => (shot, read * read),
        Noise::None | Noise::MatchPlate => (0.0, 0.0),
    }
}

fn blur_of(around: &Image<LinearRgb>) -> f64 {
    match plate_blur(around) {
        Blur::Known(sigma_px) => sigma_px,
        Blur::MatchPlate => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_boxes_does_not_count() {
        let grey = LinearRgb::new(0.2, 0.1, 0.05);
        let picture = Image::from_fn(80, 60, |x, y| match (20..60).contains(&x) && y >= 30 {
            true => LinearRgb::WHITE,
            false => grey,
        });
        let labelled = [(0, [0.5, 0.75, 0.5, 0.5])];
        let found = PixelMeasures::around(&picture, &labelled).unwrap();
        assert!((found.red_over_blue - 4_f64.ln()).abs() < 1e-6);
        assert!((found.exposure_ev - f64::from(grey.luminance()).log2()).abs() < 1e-6);
        assert!(PixelMeasures::around(&picture, &[(0, [0.5, 0.5, 1.0, 1.0])]).is_none());
    }

    #[test]
    fn mid_grey_is_where_the_curve_has_that_slope() {
        use crate::color::encode_srgb8;
        let code = |value: f64| f64::from(encode_srgb8(LinearRgb::grey(value as f32)).g);
        let slope = (code(MID_GREY + 0.04) - code(MID_GREY - 0.04)) / 0.08;
        assert!((slope / CODES_PER_LIGHT - 1.0).abs() < 0.03, "{slope}");
    }
}
