//! Filters on pictures whose pixels may be averaged ([`Mix`]).

use crate::image::Image;
use crate::pixel::Mix;
use std::sync::OnceLock;

/// A picture at half the size, and half of that, down to one pixel; levels are made when they are first asked for.
///
/// Each level is the 2 x 2 average of the one before; odd sizes round up and the last column or row repeats nothing: it
/// averages what is there.
#[derive(Debug, Default)]
pub struct Pyramid<P> {
    base: Image<P>,
    halves: Vec<OnceLock<Image<P>>>,
}

impl<P: Mix> Pyramid<P> {
    /// A pyramid over a picture; no level but the first exists yet.
    pub fn new(base: Image<P>) -> Self {
        let longest = base.width().max(base.height()).max(1);
        let count = longest.next_power_of_two().trailing_zeros() as usize;
        Self { base, halves: (0..count).map(|_| OnceLock::new()).collect() }
    }

    /// The full picture.
    pub fn base(&self) -> &Image<P> {
        &self.base
    }

    /// Number of levels, the full picture included.
    pub fn levels(&self) -> usize {
        self.halves.len() + 1
    }

    /// The picture halved `level` times; the smallest there is for a larger `level`.
    pub fn level(&self, level: usize) -> &Image<P> {
        match level.min(self.halves.len()) {
            0 => &self.base,
            n => self.halves[n - 1].get_or_init(|| halve(self.level(n - 1))),
        }
    }
}

/// A picture of half the size, each pixel the mean of the (up to) four it covers; odd sizes round up.
pub fn halve<P: Mix>(image: &Image<P>) -> Image<P> {
    let (w, h) = image.size();
    Image::from_fn(w.div_ceil(2), h.div_ceil(2), |x, y| {
        let xs = 2 * x..(2 * x + 2).min(w);
        let ys = 2 * y..(2 * y + 2).min(h);
        let weight = 1.0 / (xs.len() * ys.len()) as f32;
        let mut sum = P::default();
        for v in ys {
            for &p in &image.row(v)[xs.clone()] {
                sum = sum.add_scaled(weight, p);
            }
        }
        sum
    })
}

/// A picture of another size: area average where it shrinks, bilinear where it grows.
pub fn resize<P: Mix>(image: &Image<P>, width: usize, height: usize) -> Image<P> {
    let columns = taps(image.width(), width);
    let rows = taps(image.height(), height);
    let wide = Image::from_fn(width, image.height(), |x, y| columns[x].apply(|i| image[(i, y)]));
    Image::from_fn(width, height, |x, y| rows[y].apply(|j| wide[(x, j)]))
}

/// The samples that one output sample is the weighted mean of: the first one's index, and the weights from there.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

impl Taps {
    fn apply<P: Mix>(&self, at: impl Fn(usize) -> P) -> P {
        let weighted = self.weights.iter().enumerate();
        weighted.fold(P::default(), |sum, (k, &w)| sum.add_scaled(w, at(self.first + k)))
    }
}

/// A triangle filter of the scale's width; for a whole reduction factor n it is the tent over 2n samples.
fn taps(from: usize, to: usize) -> Vec<Taps> {
    let scale = from as f64 / to as f64;
    let radius = scale.max(1.0);
    let tap = |i: usize| {
        let center = (i as f64 + 0.5) * scale;
        let first = (center - radius).floor().max(0.0) as usize;
        let last = ((center + radius).ceil() as usize).min(from);
        let weight = |j: usize| (1.0 - ((j as f64 + 0.5 - center) / radius).abs()).max(0.0);
        let sum: f64 = (first..last).map(weight).sum();
        Taps { first, weights: (first..last).map(|j| (weight(j) / sum) as f32).collect() }
    };
    (0..to).map(tap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::Coverage;

    #[test]
    fn halving_keeps_a_constant() {
        let img = Image::filled(7, 5, Coverage(0.25));
        let half = halve(&img);
        assert_eq!(half.size(), (4, 3));
        assert!(half.pixels().iter().all(|c| (c.0 - 0.25).abs() < 1e-7));
    }

    #[test]
    fn a_pyramid_ends_in_one_pixel() {
        let pyramid = Pyramid::new(Image::filled(9, 4, Coverage(1.0)));
        assert_eq!(pyramid.level(pyramid.levels() - 1).size(), (1, 1));
        assert_eq!(pyramid.level(99).size(), (1, 1));
    }

    #[test]
    fn resizing_to_the_same_size_changes_nothing() {
        let img = Image::from_fn(5, 4, |x, y| Coverage((x * y) as f32));
        assert_eq!(resize(&img, 5, 4), img);
    }
}
