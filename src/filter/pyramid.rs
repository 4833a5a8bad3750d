//! Pictures at half the size, and half of that: plain averages, and the binomial kernel of
//! Laplacian pyramids.

use super::separable::{Taps, filter, filter_sides};
use crate::image::Image;
use crate::pixel::Mix;
use crate::work::{self, Kind};
use std::sync::OnceLock;

/// A picture at half the size, and half of that, down to one pixel; levels are computed on first
/// use.
///
/// Each level is the 2 x 2 average of the one before ([`halve`]).
#[derive(Debug)]
pub struct Pyramid<P> {
    base: Image<P>,
    halves: Vec<OnceLock<Image<P>>>,
    halve: fn(&Image<P>) -> Image<P>,
}

impl<P: Mix> Default for Pyramid<P> {
    fn default() -> Self {
        Self::new(Image::default())
    }
}

impl<P: Mix> Pyramid<P> {
    /// A pyramid over a picture; no level but the first exists yet.
    pub fn new(base: Image<P>) -> Self {
        Self::halved_by(base, halved)
    }

    /// The same of a picture with alpha: beyond its ends there is nothing, and where a pixel of a
    /// level reaches beyond them, it is as transparent as that makes it.
    pub fn over_nothing(base: Image<P>) -> Self {
        Self::halved_by(base, halved_over_nothing)
    }

    fn halved_by(base: Image<P>, halve: fn(&Image<P>) -> Image<P>) -> Self {
        let count = halving_count(base.size());
        Self {
            base,
            halves: (0..count).map(|_| OnceLock::new()).collect(),
            halve,
        }
    }

    /// The full picture.
    pub fn base(&self) -> &Image<P> {
        &self.base
    }

    /// Number of levels, the full picture included.
    pub fn levels(&self) -> usize {
        self.halves.len() + 1
    }

    /// The picture halved `level` times; the smallest level for a larger `level`.
    pub fn level(&self, level: usize) -> &Image<P> {
        let Some(n) = level.min(self.halves.len()).checked_sub(1) else {
            return &self.base;
        };
        if let Some(half) = self.halves[n].get() {
            return half;
        }
        // Halved before the cell is locked: the work is parallel, and a thread that waits for its
        // parts may be handed a task that asks for this very level.
        let half = (self.halve)(self.level(n));
        self.halves[n].get_or_init(|| {
            work::add(Kind::Levels, 1);
            half
        })
    }
}

/// A picture of half the size, each pixel the mean of the (up to) four it covers; odd sizes round
/// up.
pub fn halve<P: Mix>(image: &Image<P>) -> Image<P> {
    work::add(Kind::Filters, 1);
    halved(image)
}

fn halved<P: Mix>(image: &Image<P>) -> Image<P> {
    let [columns, rows] = [image.width(), image.height()].map(halving_taps);
    filter(image, &columns, &rows)
}

/// The same where pixels beyond the ends count as empty ones.
fn halved_over_nothing<P: Mix>(image: &Image<P>) -> Image<P> {
    let halves = |len: usize| line_taps(len.div_ceil(2), |i| Taps::equal(2 * i as usize, 2, len));
    let [columns, rows] = [image.width(), image.height()].map(halves);
    filter(image, &columns, &rows)
}

/// How often a picture is halved until one pixel is left.
fn halving_count((width, height): (usize, usize)) -> usize {
    let longest = width.max(height).max(1);
    longest.next_power_of_two().trailing_zeros() as usize
}

/// The mean of two neighbours each.
fn halving_taps(len: usize) -> Vec<Taps> {
    line_taps(len.div_ceil(2), |i| {
        Taps::new(2 * i..2 * i + 2, len, |_| 1.0)
    })
}

/// A picture of half the size, smoothed by the binomial kernel (1 4 6 4 1)/16; odd sizes round up.
///
/// Pixel `i` of the small picture lies on pixel `2 i` of the large one: sample positions, unlike
/// those of [`halve`], do not lie in the middle of what they cover.
///
/// # Method
/// REDUCE of [Burt and Adelson 1983] with a = 3/8. Departs from it at the border, where the window
/// is cut off.
///
/// [Burt and Adelson 1983]: https://doi.org/10.1109/TCOM.1983.1095851
pub fn reduce<P: Mix>(image: &Image<P>) -> Image<P> {
    filter_sides(image, reducing_taps)
}

/// From a line of `len` to one of half that.
fn reducing_taps(len: usize) -> Vec<Taps> {
    line_taps(len.div_ceil(2), |i| {
        Taps::new(2 * i - 2..2 * i + 3, len, |j| binomial(j - 2 * i))
    })
}

/// The inverse of [`reduce`]: a smooth picture of `width` x `height` through the pixels of one of
/// half that size.
///
/// A picture minus the expansion of its reduction is a level of its Laplacian pyramid.
///
/// # Method
/// EXPAND of [Burt and Adelson 1983] with a = 3/8: the small picture's pixels set apart by zeros
/// and smoothed.
///
/// # Panics
/// When `width` x `height` is not a size that [`reduce`] takes to that of `image`.
///
/// [Burt and Adelson 1983]: https://doi.org/10.1109/TCOM.1983.1095851
pub fn expand<P: Mix>(image: &Image<P>, width: usize, height: usize) -> Image<P> {
    let half = (width.div_ceil(2), height.div_ceil(2));
    assert_eq!(image.size(), half, "not half of {width} x {height}");
    work::add(Kind::Filters, 1);
    let (columns, rows) = (
        expanding_taps(half.0, width),
        expanding_taps(half.1, height),
    );
    filter(image, &columns, &rows)
}

/// From a line of `from`, half as long, to one of `to`.
fn expanding_taps(from: usize, to: usize) -> Vec<Taps> {
    line_taps(to, |i| {
        Taps::new(i / 2 - 1..i / 2 + 2, from, |j| binomial(2 * j - i))
    })
}

/// The taps of every sample of a line.
fn line_taps(len: usize, taps: impl Fn(isize) -> Taps) -> Vec<Taps> {
    (0..len as isize).map(taps).collect()
}

/// (1 4 6 4 1), 0 outside.
fn binomial(offset: isize) -> f64 {
    match offset.unsigned_abs() {
        0 => 6.0,
        1 => 4.0,
        2 => 1.0,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: usize, height: usize) -> Image<f32> {
        Image::from_fn(width, height, |x, y| {
            ((x * 7919 + y * 104_729) % 101) as f32 / 100.0
        })
    }

    #[test]
    fn halving_keeps_a_constant() {
        let half = halve(&Image::filled(7, 5, 0.25));
        assert_eq!(half, Image::filled(4, 3, 0.25));
    }

    #[test]
    fn halving_averages_what_is_there() {
        let img = Image::from_vec(3, 1, vec![1.0, 3.0, 8.0]);
        assert_eq!(halve(&img).pixels(), [2.0, 8.0]);
    }

    #[test]
    fn nothing_is_averaged_in_beyond_the_ends_of_a_picture_with_alpha() {
        let pyramid = Pyramid::over_nothing(Image::filled(9, 6, 1.0_f32));
        let eighths = |level| {
            let image: &Image<f32> = pyramid.level(level);
            let last = image.width() - 1;
            [
                image[(0, 0)],
                image[(last, 0)],
                image[(last, image.height() - 1)],
            ]
            .map(|v| 8.0 * v)
        };
        assert_eq!(eighths(1), [8.0, 4.0, 4.0]);
        assert_eq!(eighths(2), [8.0, 2.0, 1.0]);
        assert_eq!(eighths(3), [6.0, 0.75, 0.75]);
    }

    #[test]
    fn a_pyramid_ends_in_one_pixel() {
        let pyramid = Pyramid::new(Image::filled(9, 4, 1.0));
        assert_eq!(pyramid.level(pyramid.levels() - 1).size(), (1, 1));
        assert_eq!(pyramid.level(99).size(), (1, 1));
    }

    #[test]
    fn an_empty_pyramid_has_one_empty_level() {
        let pyramid = Pyramid::new(Image::<f32>::new(0, 0));
        assert!(pyramid.levels() == 1 && pyramid.level(5).is_empty());
    }

    #[test]
    fn reducing_weighs_by_the_binomial_kernel() {
        let dot = Image::from_fn(9, 1, |x, _| if x == 4 { 16.0 } else { 0.0 });
        let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
        let out = reduce(&dot);
        assert!(near(out[(1, 0)], 1.0) && near(out[(2, 0)], 6.0) && near(out[(3, 0)], 1.0));
    }

    #[test]
    fn reducing_and_expanding_keep_a_constant() {
        for (w, h) in [(1, 1), (2, 3), (9, 6), (16, 16)] {
            let img = Image::filled(w, h, 0.7);
            let back = expand(&reduce(&img), w, h);
            assert!(
                back.pixels().iter().all(|v| (v - 0.7).abs() < 1e-6),
                "{w} x {h}"
            );
        }
    }

    #[test]
    fn expanding_keeps_a_ramp_away_from_the_border() {
        let ramp = Image::from_fn(20, 1, |x, _| x as f32);
        let out = expand(&ramp, 40, 1);
        assert!((2..38).all(|x| (out[(x, 0)] - 0.5 * x as f32).abs() < 1e-5));
    }

    #[test]
    fn a_laplacian_level_holds_the_detail_and_only_that() {
        let detail = |img: &Image<f32>| {
            let smooth = expand(&reduce(img), img.width(), img.height());
            img.zip_map(&smooth, |a, b| a - b)
        };
        let mean =
            |values: &[f32]| values.iter().map(|v| v.abs()).sum::<f32>() / values.len() as f32;
        let wave = Image::from_fn(64, 48, |x, y| {
            libm::sinf(0.05 * x as f32) * libm::cosf(0.07 * y as f32)
        });
        assert!(
            mean(detail(&wave).pixels()) < 0.01,
            "a smooth picture has hardly any"
        );
        assert!(
            mean(detail(&noise(64, 48)).pixels()) > 0.1,
            "noise is little else"
        );
    }

    #[test]
    fn empty_pictures_survive() {
        let empty = Image::<f32>::new(0, 5);
        assert_eq!(
            (halve(&empty).size(), reduce(&empty).size()),
            ((0, 3), (0, 3))
        );
        assert!(expand(&reduce(&empty), 0, 5).is_empty());
    }
}
