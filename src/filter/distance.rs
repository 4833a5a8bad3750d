//! How far every pixel of a mask is from its outside.

use super::morphology::vertical_distances;
use crate::image::{Image, Mask};
use rayon::prelude::*;

/// Distance of every set pixel's centre to the centre of the nearest one that is not set, pixels; 0 where not set.
///
/// Beyond the picture's border the mask is taken to go on; where nothing is unset the distance is infinite.
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
        .for_each(|(row, columns)| {
            nearest(row, columns);
        });
    out
}

/// A parabola `floor + (x - foot)^2` and the place from which on it is the lowest.
struct Parabola {
    foot: f64,
    floor: f64,
    from: f64,
}

/// The distances along one row whose columns are so far from their nearest unset pixel.
fn nearest(row: &mut [f32], columns: &[u32]) {
    let mut envelope: Vec<Parabola> = Vec::new();
    for (x, &column) in columns
        .iter()
        .enumerate()
        .filter(|(_, column)| **column < u32::MAX)
    {
        let (foot, floor) = (x as f64, f64::from(column) * f64::from(column));
        let meets = |p: &Parabola| {
            0.5 * ((floor + foot * foot) - (p.floor + p.foot * p.foot)) / (foot - p.foot)
        };
        while envelope.last().is_some_and(|last| meets(last) <= last.from) {
            envelope.pop();
        }
        let from = envelope.last().map_or(f64::NEG_INFINITY, meets);
        envelope.push(Parabola { foot, floor, from });
    }
    let mut lowest = 0;
    for (x, pixel) in row.iter_mut().enumerate() {
        while envelope
            .get(lowest + 1)
            .is_some_and(|next| next.from <= x as f64)
        {
            lowest += 1;
        }
        let square = envelope
            .get(lowest)
            .map_or(f64::INFINITY, |p| p.floor + (x as f64 - p.foot).powi(2));
        *pixel = square.sqrt() as f32;
    }
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
