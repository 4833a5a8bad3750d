//! How similar two pictures are.

use super::bands::{RowSource, bands, grown, rows_from};
use super::{flip, ssim};
use crate::color::linear_to_srgb;
use crate::image::Image;
use crate::pixel::LinearRgb;
use std::fmt;
use std::ops::Range;

/// Error in scene-linear light, and similarity of the pictures as displayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// Root of the mean squared difference over all channels, scene-linear.
    pub rmse: f64,
    /// Mean difference, scene-linear: positive where the picture is brighter than the reference.
    pub bias: f64,
    /// Structural similarity of the displayed pictures ([`ssim`](super::ssim())); 1 for equal ones.
    /// None for pictures smaller than its window of 11 x 11 pixels.
    pub ssim: Option<f64>,
    /// LDR-FLIP of the displayed pictures ([`flip`](super::flip())); 0 for equal ones.
    pub flip: f64,
}

impl Likeness {
    /// Compares a scene-linear picture with its reference.
    ///
    /// Displayed means clipped to 0 to 1 and sRGB-encoded. None for pictures of different size or
    /// without pixels.
    pub fn measure(
        picture: &impl RowSource<LinearRgb>,
        reference: &impl RowSource<LinearRgb>,
    ) -> Option<Self> {
        let (width, height) = picture.size();
        if (width, height) != reference.size() || width * height == 0 {
            return None;
        }
        let mut sums = LikenessSums::default();
        for band in bands((width, height)) {
            let outer = grown(&band, flip::REACH_ROWS.max(ssim::WINDOW_RADIUS_PX), height);
            let pictures = [
                picture.read_rows(outer.clone()),
                reference.read_rows(outer.clone()),
            ];
            sums.add_band(
                &pictures,
                outer.start,
                band.clone(),
                window_rows(&band, height),
            );
        }
        Some(sums.into_likeness(width, height))
    }
}

/// The rows of a band in which windows of [`ssim`] are centred.
fn window_rows(band: &Range<usize>, height: usize) -> Range<usize> {
    let centers = ssim::window_centers(height);
    band.start.max(centers.start)..band.end.min(centers.end)
}

/// Sums over the rows processed so far.
#[derive(Default)]
struct LikenessSums {
    errors: f64,
    squares: f64,
    ssim: Vec<[f64; 3]>,
    flip: f64,
}

impl LikenessSums {
    /// Adds a band; the two pictures begin at row `first`, at or above its start.
    fn add_band(
        &mut self,
        [picture, reference]: &[Image<LinearRgb>; 2],
        first: usize,
        band: Range<usize>,
        windows: Range<usize>,
    ) {
        let band = rows_from(first, &band);
        for y in band.clone() {
            self.add_row(picture.row(y), reference.row(y));
        }
        let [shown, wanted] = [displayed(picture), displayed(reference)];
        if !windows.is_empty() {
            let windows = rows_from(first, &windows);
            self.ssim.extend(ssim::row_sums(&wanted, &shown, windows));
        }
        self.flip += flip::row_sum(&wanted, &shown, band);
    }

    /// Adds the differences of one row.
    fn add_row(&mut self, picture: &[LinearRgb], reference: &[LinearRgb]) {
        let differences = picture
            .iter()
            .zip(reference)
            .flat_map(|(p, q)| [p.r - q.r, p.g - q.g, p.b - q.b])
            .map(f64::from);
        let (sum, squares) = differences.fold((0.0, 0.0), |(s, t), d| (s + d, t + d * d));
        self.errors += sum;
        self.squares += squares;
    }

    fn into_likeness(self, width: usize, height: usize) -> Likeness {
        let count = (width * height) as f64;
        Likeness {
            rmse: (self.squares / (3.0 * count)).sqrt(),
            bias: self.errors / (3.0 * count),
            ssim: ssim::mean(&self.ssim, (width, height)),
            flip: self.flip / count,
        }
    }
}

/// Values as sent to a screen.
fn displayed(image: &Image<LinearRgb>) -> Image<[f32; 3]> {
    image.map(|c| <[f32; 3]>::from(c).map(|v| linear_to_srgb(v.clamp(0.0, 1.0))))
}

impl fmt::Display for Likeness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rmse, bias, flip) = (self.rmse, self.bias, self.flip);
        let ssim = match self.ssim {
            Some(ssim) => format!("= {ssim:.6}"),
            None => "needs 11 x 11 pixels".into(),
        };
        write!(
            f,
            "RMSE = {rmse:.6}, bias = {bias:+.7}, SSIM {ssim}, FLIP = {flip:.6}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::pattern;
    use super::*;

    #[test]
    fn a_brighter_picture_has_a_positive_bias() {
        let grey = |v| Image::filled(20, 20, LinearRgb::grey(v));
        let likeness = Likeness::measure(&grey(0.5), &grey(0.25)).unwrap();
        assert_eq!((likeness.rmse, likeness.bias), (0.25, 0.25));
        assert!(likeness.ssim.unwrap() < 1.0 && likeness.flip > 0.1);
    }

    /// What a row contributes depends on the rows around it, and a band includes enough of them.
    #[test]
    fn bands_are_alike_as_the_whole_is() {
        let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 97) as f32 / 97.0;
        let (width, height) = (1 << 12, 140);
        let a = Image::from_fn(width, height, |x, y| LinearRgb::grey(noise(x / 9, y / 5)));
        let b = a.map(|c| LinearRgb::grey(c.r * 0.9));
        let likeness = Likeness::measure(&a, &b).unwrap();
        let [shown, wanted] = [displayed(&a), displayed(&b)];
        let count = (width * height) as f64;
        let flip = flip::row_sum(&wanted, &shown, 0..height) / count;
        assert!((likeness.flip - flip).abs() < 1e-12);
        let ssim = super::ssim::ssim(&wanted, &shown).unwrap();
        assert!((likeness.ssim.unwrap() - ssim).abs() < 1e-12);
        let differences = a.pixels().iter().map(|c| f64::from(c.r * 0.1));
        assert!((likeness.bias - differences.sum::<f64>() / count).abs() < 1e-6);
    }

    #[test]
    fn a_picture_is_like_itself() {
        let image = pattern().map(LinearRgb::from);
        let likeness = Likeness::measure(&image, &image).unwrap();
        assert_eq!(
            (likeness.rmse, likeness.bias, likeness.flip),
            (0.0, 0.0, 0.0)
        );
        assert!((likeness.ssim.unwrap() - 1.0).abs() < 1e-7);
        assert_eq!(Likeness::measure(&image, &Image::new(3, 3)), None);
    }

    #[test]
    fn pictures_too_small_for_ssim_say_what_it_needs() {
        let dot = Image::filled(1, 1, LinearRgb::WHITE);
        let likeness = Likeness::measure(&dot, &dot).unwrap();
        assert_eq!(
            likeness.to_string(),
            "RMSE = 0.000000, bias = +0.0000000, SSIM needs 11 x 11 pixels, FLIP = 0.000000"
        );
    }
}
