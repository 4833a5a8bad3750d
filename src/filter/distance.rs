//! How far every pixel of a mask is from its outside.

use super::morphology::vertical_distances;
use crate::image::{Image, Mask};
use rayon::prelude::*;

/// Distance of every set pixel's centre to the centre of the nearest one that is not set, pixels; 0
/// where not set.
///
/// Beyond the picture's border the mask continues; where nothing is unset the distance is infinite.
///
/// # Method
/// [Felzenszwalb and Huttenlocher 2012]: distances along each column first, then the lower envelope of the parabolas
/// that these are the feet of along each row. Exact, and linear in the number of pixels.
///
/// [Felzenszwalb and Huttenlocher 2012]: https://doi.org/10.4086/toc.2012.v008a019
pub fn depth(mask: &Mask) -> Image<f32> {
    let (width, height) = mask.size();
    let columns = vertical_distances(&mask.complement());
    let mut out = Image::new(width, height);
    out.par_rows_mut()
        .zip(columns.par_chunks_exact(width.max(1)))
        .for_each(|(row, columns)| fill_row(row, columns));
    out
}

/// A parabola `floor + (x - foot)^2` and the place from which on it is the lowest.
struct Parabola {
    foot: f64,
    floor: f64,
    from: f64,
}

impl Parabola {
    /// Where another one crosses it, whose foot is farther right.
    #[inline]
    fn crossing(&self, foot: f64, floor: f64) -> f64 {
        0.5 * ((floor + foot * foot) - (self.floor + self.foot * self.foot)) / (foot - self.foot)
    }

    #[inline]
    fn height_at(&self, x: f64) -> f64 {
        self.floor + (x - self.foot).powi(2)
    }
}

/// The distances along one row whose columns are so far from their nearest unset pixel.
fn fill_row(row: &mut [f32], columns: &[u32]) {
    let envelope = lower_envelope(columns);
    let mut lowest = 0;
    for (x, pixel) in row.iter_mut().enumerate() {
        let x = x as f64;
        while envelope.get(lowest + 1).is_some_and(|p| p.from <= x) {
            lowest += 1;
        }
        let square = envelope.get(lowest).map(|p| p.height_at(x));
        *pixel = square.unwrap_or(f64::INFINITY).sqrt() as f32;
    }
}

/// The parabolas over the columns' distances that are the lowest somewhere, from left to right.
fn lower_envelope(columns: &[u32]) -> Vec<Parabola> {
    let mut envelope: Vec<Parabola> = Vec::new();
    for (x, &column) in columns.iter().enumerate().filter(|(_, c)| **c < u32::MAX) {
        push_lowest(
            &mut envelope,
            x as f64,
            f64::from(column) * f64::from(column),
        );
    }
    envelope
}

/// Adds a parabola farther right, in place of those that are the lowest nowhere any more.
fn push_lowest(envelope: &mut Vec<Parabola>, foot: f64, floor: f64) {
    let mut from = f64::NEG_INFINITY;
    while let Some(last) = envelope.last() {
        let crossing = last.crossing(foot, floor);
        if crossing > last.from {
            from = crossing;
            break;
        }
        envelope.pop();
    }
    envelope.push(Parabola { foot, floor, from });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_distance_to_the_nearest_pixel_outside() {
        let mask = Image::from_fn(23, 17, |x, y| (x * 7919 + y * 104_729) % 41 != 0);
        let found = depth(&mask);
        for y in 0..17 {
            for x in 0..23 {
                let outside = (0..17 * 23)
                    .map(|i| (i % 23, i / 23))
                    .filter(|&at| !mask[at]);
                let far =
                    outside.map(|(ox, oy)| libm::hypot(ox as f64 - x as f64, oy as f64 - y as f64));
                let expected = far.fold(f64::INFINITY, f64::min);
                assert!(
                    (f64::from(found[(x, y)]) - expected).abs() < 1e-5,
                    "({x}, {y}): {} {expected}",
                    found[(x, y)]
                );
            }
        }
    }

    #[test]
    fn without_an_outside_it_is_infinite_and_without_pixels_nothing() {
        assert!(
            depth(&Image::filled(4, 3, true))
                .pixels()
                .iter()
                .all(|d| *d == f32::INFINITY)
        );
        assert!(
            depth(&Image::filled(4, 3, false))
                .pixels()
                .iter()
                .all(|d| *d == 0.0)
        );
        assert_eq!(depth(&Image::new(0, 0)).size(), (0, 0));
    }
}
