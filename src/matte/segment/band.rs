//! One band of a Laplacian pyramid, brought back to the size of the picture.

use crate::image::Image;
use crate::pixel::{Coverage, Mix};

/// The binomial kernel (1, 4, 6, 4, 1)/16 of Burt and Adelson, the one with `a = 3/8`.
const KERNEL: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];

/// A grey picture and the pictures reduced from it: level 0 is the picture itself.
pub(super) struct Gaussian(Vec<Image<Coverage>>);

impl Gaussian {
    /// `levels` reductions of a picture.
    pub(super) fn new(grey: Image<Coverage>, levels: usize) -> Self {
        let mut pyramid = vec![grey];
        for level in 0..levels {
            pyramid.push(reduce(&pyramid[level]));
        }
        Self(pyramid)
    }

    /// Band `n` (from 1) of the Laplacian pyramid at its own size: what reduction `n` takes away.
    pub(super) fn band(&self, n: usize) -> Image<Coverage> {
        let (fine, coarse) = (&self.0[n - 1], &self.0[n]);
        fine.zip_map(&expand(coarse, fine.width(), fine.height()), |a, b| Coverage(a.0 - b.0))
    }

    /// A picture of level `n`'s size, expanded to the full size.
    pub(super) fn to_full_size(&self, picture: Image<Coverage>, n: usize) -> Image<Coverage> {
        let finer = self.0[..n].iter().rev();
        finer.fold(picture, |p, target| expand(&p, target.width(), target.height()))
    }
}

/// Half the size, odd sizes rounded up: blurred, then every other sample, so that sample `i` lies on sample `2 i`.
fn reduce(image: &Image<Coverage>) -> Image<Coverage> {
    let rows = Image::from_fn(image.width().div_ceil(2), image.height(), |x, y| {
        weighted(|k| image.nearest(2 * x as isize + k, y as isize))
    });
    Image::from_fn(rows.width(), image.height().div_ceil(2), |x, y| {
        weighted(|k| rows.nearest(x as isize, 2 * y as isize + k))
    })
}

fn weighted(sample: impl Fn(isize) -> Coverage) -> Coverage {
    (-2..).zip(KERNEL).fold(Coverage(0.0), |sum, (k, w)| sum.add_scaled(w, sample(k)))
}

/// Twice the size, to `width` x `height`: the same kernel over samples with zeros between them, doubled.
fn expand(image: &Image<Coverage>, width: usize, height: usize) -> Image<Coverage> {
    let columns = Image::from_fn(width, image.height(), |x, y| between(x, |i| image.nearest(i, y as isize)));
    Image::from_fn(width, height, |x, y| between(y, |i| columns.nearest(x as isize, i)))
}

fn between(at: usize, sample: impl Fn(isize) -> Coverage) -> Coverage {
    let i = (at / 2) as isize;
    let sum = match at % 2 {
        0 => [(0.125, i - 1), (0.75, i), (0.125, i + 1)],
        _ => [(0.5, i), (0.5, i + 1), (0.0, i)],
    };
    sum.into_iter().fold(Coverage(0.0), |acc, (w, i)| acc.add_scaled(w, sample(i)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_has_no_bands() {
        let pyramid = Gaussian::new(Image::filled(13, 9, Coverage(0.7)), 3);
        for n in 1..=3 {
            assert!(pyramid.band(n).pixels().iter().all(|c| c.0.abs() < 1e-6));
        }
    }

    #[test]
    fn bands_and_the_rest_add_up_to_the_picture() {
        let grey = Image::from_fn(21, 17, |x, y| Coverage(((x * 7 + y * 13) % 11) as f32));
        let pyramid = Gaussian::new(grey.clone(), 3);
        let mut sum = pyramid.0[3].clone();
        for n in (1..=3).rev() {
            let band = pyramid.band(n);
            let rest = expand(&sum, band.width(), band.height());
            sum = band.zip_map(&rest, |a, b| Coverage(a.0 + b.0));
        }
        let worst = sum.pixels().iter().zip(grey.pixels()).map(|(a, b)| (a.0 - b.0).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{worst}");
    }

    #[test]
    fn expanding_does_not_shift() {
        let ramp = Image::from_fn(17, 17, |x, _| Coverage(x as f32));
        let pyramid = Gaussian::new(ramp, 2);
        let back = pyramid.to_full_size(pyramid.0[2].clone(), 2);
        assert!((back[(8, 8)].0 - 8.0).abs() < 1e-5);
    }
}
