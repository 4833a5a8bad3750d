//! How alike two pictures are, in the numbers that pictures are judged by.

use super::bands::{Rows, bands, grown};
use super::{flip, ssim};
use crate::color::linear_to_srgb;
use crate::image::Image;
use crate::pixel::LinearRgb;
use std::fmt;
use std::ops::Range;

/// Error in scene-linear light, and likeness as it is displayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// Root of the mean squared difference over all channels, scene-linear.
    pub rmse: f64,
    /// Mean difference, scene-linear: positive where the picture is brighter than the reference.
    pub bias: f64,
    /// Structural similarity of the displayed pictures ([`ssim`]); 1 is equal. NaN where pictures are too small for it.
    pub ssim: f64,
    /// LDR-FLIP of the displayed pictures ([`flip`]); 0 is equal.
    pub flip: f64,
}

impl Likeness {
    /// Compares a scene-linear picture with what it should be.
    ///
    /// Displayed means clipped to 0 to 1 and sRGB-encoded. None for pictures of different size or without pixels.
    pub fn of(picture: &impl Rows<LinearRgb>, reference: &impl Rows<LinearRgb>) -> Option<Self> {
        let (width, height) = picture.size();
        if (width, height) != reference.size() || width * height == 0 {
            return None;
        }
        let mut sums = Sums::default();
        for band in bands((width, height)) {
            let outer = grown(&band, flip::reach().max(ssim::RADIUS), height);
            sums.add(
                [picture.rows(outer.clone()), reference.rows(outer.clone())],
                band,
                outer.start,
                height,
            );
        }
        let count = (width * height) as f64;
        Some(Self {
            rmse: (sums.squares / (3.0 * count)).sqrt(),
            bias: sums.errors / (3.0 * count),
            ssim: ssim::mean(&sums.ssim, (width, height)).unwrap_or(f64::NAN),
            flip: sums.flip / count,
        })
    }
}

/// Over the rows so far.
#[derive(Default)]
struct Sums {
    errors: f64,
    squares: f64,
    ssim: Vec<[f64; 3]>,
    flip: f64,
}

impl Sums {
    /// Adds a band of a picture of so many rows; the two pictures begin at row `first`, above it.
    fn add(
        &mut self,
        [picture, reference]: [Image<LinearRgb>; 2],
        band: Range<usize>,
        first: usize,
        height: usize,
    ) {
        let inner = |rows: Range<usize>| rows.start - first..rows.end - first;
        for y in inner(band.clone()) {
            let pairs = picture.row(y).iter().zip(reference.row(y));
            let differences = pairs
                .flat_map(|(p, q)| [p.r - q.r, p.g - q.g, p.b - q.b])
                .map(f64::from);
            let (sum, squares) = differences.fold((0.0, 0.0), |(s, t), d| (s + d, t + d * d));
            (self.errors, self.squares) = (self.errors + sum, self.squares + squares);
        }
        let [shown, wanted] = [displayed(&picture), displayed(&reference)];
        let windows = ssim::inside(height);
        let windows = band.start.max(windows.start)..band.end.min(windows.end);
        if !windows.is_empty() {
            self.ssim
                .extend(ssim::row_sums(&wanted, &shown, inner(windows)));
        }
        self.flip += flip::row_sums(&wanted, &shown, inner(band))
            .iter()
            .sum::<f64>();
    }
}

/// Values as a screen gets them.
fn displayed(image: &Image<LinearRgb>) -> Image<[f32; 3]> {
    image.map(|c| <[f32; 3]>::from(c).map(|v| linear_to_srgb(v.clamp(0.0, 1.0))))
}

impl fmt::Display for Likeness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            rmse,
            bias,
            ssim,
            flip,
        } = self;
        write!(
            f,
            "RMSE = {rmse:.6}, bias = {bias:+.7}, SSIM = {ssim:.6}, FLIP = {flip:.6}"
        )
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A pattern of waves, edges and points, display values; `golden/diff/reference.py` makes the same.
    pub(crate) fn pattern() -> Image<[f32; 3]> {
        Image::from_fn(96, 64, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let wave = 0.5 + 0.3 * libm::sin(x / 5.0) * libm::cos(y / 7.0);
            let edge = if x + 2.0 * y > 120.0 { 0.25 } else { 0.0 };
            [wave, 0.2 + 0.006 * x, (wave + edge) * 0.7].map(|v| v as f32)
        })
    }

    /// The same, shifted, tinted and with points.
    pub(crate) fn changed() -> Image<[f32; 3]> {
        let base = pattern();
        Image::from_fn(96, 64, |x, y| {
            let [r, g, b] = base[((x + 1).min(95), y)];
            let point = if x % 16 == 3 && y % 12 == 5 { 0.3 } else { 0.0 };
            [(r * 0.95 + point).min(1.0), g, b * 0.9]
        })
    }

    #[test]
    fn a_brighter_picture_has_a_positive_bias() {
        let grey = |v| Image::filled(20, 20, LinearRgb::grey(v));
        let likeness = Likeness::of(&grey(0.5), &grey(0.25)).unwrap();
        assert_eq!((likeness.rmse, likeness.bias), (0.25, 0.25));
        assert!(likeness.ssim < 1.0 && likeness.flip > 0.1);
    }

    /// What is seen of a row depends on the rows around it, of which a band has enough.
    #[test]
    fn bands_are_alike_as_the_whole_is() {
        let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 97) as f32 / 97.0;
        let (width, height) = (1 << 12, 140);
        let a = Image::from_fn(width, height, |x, y| LinearRgb::grey(noise(x / 9, y / 5)));
        let b = a.map(|c| LinearRgb::grey(c.r * 0.9));
        let likeness = Likeness::of(&a, &b).unwrap();
        let [shown, wanted] = [displayed(&a), displayed(&b)];
        assert!((likeness.flip - super::flip::flip(&wanted, &shown).unwrap()).abs() < 1e-12);
        assert!((likeness.ssim - super::ssim::ssim(&wanted, &shown).unwrap()).abs() < 1e-12);
        assert!(
            (likeness.bias
                - a.pixels().iter().map(|c| f64::from(c.r * 0.1)).sum::<f64>()
                    / (width * height) as f64)
                .abs()
                < 1e-6
        );
    }

    #[test]
    fn a_picture_is_like_itself() {
        let image = pattern().map(LinearRgb::from);
        let Likeness {
            rmse,
            bias,
            ssim,
            flip,
        } = Likeness::of(&image, &image).unwrap();
        assert_eq!((rmse, bias, flip), (0.0, 0.0, 0.0));
        assert!((ssim - 1.0).abs() < 1e-7);
        assert_eq!(Likeness::of(&image, &Image::new(3, 3)), None);
    }
}
