//! Masks grown and shrunk by a disc, and the largest values around pixels.

use crate::image::{Image, Mask};
use crate::work::{self, Kind};
use rayon::prelude::*;

/// The mask grown by `radius_px`: every pixel whose centre is at most that far from the centre of a
/// set pixel.
///
/// Unchanged where `radius_px` is below 1 or NaN.
///
/// # Method
/// Exact and in time independent of the radius: each column knows how far its nearest set pixel is,
/// and along a row a pixel at vertical distance `d` covers `sqrt(radius^2 - d^2)` to either side
/// (the parabolas of [Felzenszwalb and Huttenlocher 2012], cut at one height).
///
/// [Felzenszwalb and Huttenlocher 2012]: https://doi.org/10.4086/toc.2012.v008a019
pub fn dilate(mask: &Mask, radius_px: f64) -> Mask {
    if radius_px.is_nan() || radius_px < 1.0 {
        return mask.clone();
    }
    work::add(Kind::Filters, 1);
    let reach = reach_by_distance(mask, radius_px);
    let distances = vertical_distances(mask);
    let mut out = Image::new(mask.width(), mask.height());
    out.par_rows_mut()
        .zip(distances.par_chunks_exact(mask.width().max(1)))
        .for_each(|(row, distances)| mark_reached(row, distances, &reach));
    out
}

/// The mask shrunk by `radius_px`: every pixel of it that is farther than that from every pixel
/// outside it.
///
/// Beyond the picture's border the mask continues. Unchanged where `radius_px` is below 1 or NaN.
pub(crate) fn erode(mask: &Mask, radius_px: f64) -> Mask {
    dilate(&mask.complement(), radius_px).complement()
}

/// How far a set pixel reaches sideways at each vertical distance; farther than the list goes it
/// does not reach.
fn reach_by_distance(mask: &Mask, radius: f64) -> Vec<usize> {
    let last = radius.min(mask.height() as f64) as usize;
    (0..=last)
        .map(|d| chord_half(radius, d as f64).min(mask.width() as f64) as usize)
        .collect()
}

/// Half the chord of a circle at a distance from its centre.
fn chord_half(radius: f64, distance: f64) -> f64 {
    ((radius - distance) * (radius + distance)).sqrt()
}

/// For every pixel the distance to the nearest set pixel of its column; very large where there is
/// none.
pub(super) fn vertical_distances(mask: &Mask) -> Vec<u32> {
    let (width, height) = mask.size();
    let pixels = mask.pixels().iter();
    let mut distances: Vec<u32> = pixels.map(|&set| if set { 0 } else { u32::MAX }).collect();
    for y in 1..height {
        let (above, below) = distances.split_at_mut(y * width);
        one_farther(&above[(y - 1) * width..], &mut below[..width]);
    }
    for y in (1..height).rev() {
        let (above, below) = distances.split_at_mut(y * width);
        one_farther(&below[..width], &mut above[(y - 1) * width..]);
    }
    distances
}

/// No pixel is more than one farther than its neighbour in the next row.
fn one_farther(neighbors: &[u32], distances: &mut [u32]) {
    for (distance, &neighbor) in distances.iter_mut().zip(neighbors) {
        *distance = (*distance).min(neighbor.saturating_add(1));
    }
}

/// Sets what the columns' nearest pixels reach along one row: from the left what lies right of
/// them, then the rest.
fn mark_reached(row: &mut [bool], distances: &[u32], reach: &[usize]) {
    let mut end = 0;
    for (x, (pixel, &distance)) in row.iter_mut().zip(distances).enumerate() {
        if let Some(sideways) = reach.get(distance as usize) {
            end = end.max(x + sideways + 1);
        }
        *pixel = x < end;
    }
    let mut start = row.len();
    for (x, (pixel, &distance)) in row.iter_mut().zip(distances).enumerate().rev() {
        if let Some(sideways) = reach.get(distance as usize) {
            start = start.min(x.saturating_sub(*sideways));
        }
        *pixel |= x >= start;
    }
}

/// The largest value at most `reach` columns and rows away, for every pixel.
pub(crate) fn largest_around(picture: &Image<f32>, reach: usize) -> Image<f32> {
    let along = largest_along(picture, reach);
    let height = picture.height();
    let mut around = along.clone();
    around.par_rows_mut().enumerate().for_each(|(y, row)| {
        for near in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            raise(row, along.row(near));
        }
    });
    around
}

/// The largest value at most `reach` columns away, for every pixel.
fn largest_along(picture: &Image<f32>, reach: usize) -> Image<f32> {
    let mut along = picture.clone();
    along.par_rows_mut().enumerate().for_each(|(y, row)| {
        for by in 1..=reach.min(picture.width()) {
            raise(row, &picture.row(y)[by..]);
            raise(&mut row[by..], picture.row(y));
        }
    });
    along
}

/// Raises values to others, where those are larger.
fn raise(row: &mut [f32], other: &[f32]) {
    for (value, &other) in row.iter_mut().zip(other) {
        *value = if other > *value { other } else { *value };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speckles(width: usize, height: usize) -> Mask {
        Image::from_fn(width, height, |x, y| (x * 7919 + y * 104_729) % 37 == 0)
    }

    /// The definition.
    fn dilated_slowly(mask: &Mask, radius: f64) -> Mask {
        let (w, h) = mask.size();
        let near = |(x, y): (usize, usize), (i, j): (usize, usize)| {
            let (dx, dy) = (x.abs_diff(i) as f64, y.abs_diff(j) as f64);
            dx * dx + dy * dy <= radius * radius
        };
        let set: Vec<_> = (0..w * h)
            .map(|k| (k % w, k / w))
            .filter(|&at| mask[at])
            .collect();
        Image::from_fn(w, h, |x, y| set.iter().any(|&at| near((x, y), at)))
    }

    #[test]
    fn dilation_is_what_its_definition_says() {
        for (w, h) in [(31, 17), (1, 40), (40, 1), (3, 3)] {
            let mask = speckles(w, h);
            for radius in [1.0, 1.5, 2.0, 2.9, 5.0, 13.0, 100.0] {
                assert_eq!(
                    dilate(&mask, radius),
                    dilated_slowly(&mask, radius),
                    "{w} x {h}, radius {radius}"
                );
            }
        }
    }

    #[test]
    fn erosion_is_dilation_of_the_rest() {
        let mask = speckles(31, 17).map(|set| !set);
        assert_eq!(
            erode(&mask, 2.0),
            dilated_slowly(&mask.map(|set| !set), 2.0).map(|set| !set)
        );
    }

    #[test]
    fn a_full_mask_stays_full_and_an_empty_one_empty() {
        for set in [true, false] {
            let mask = Image::filled(9, 5, set);
            assert_eq!(erode(&mask, 3.0), mask);
            assert_eq!(dilate(&mask, 3.0), mask);
        }
    }

    #[test]
    fn an_endless_radius_fills_and_a_small_or_strange_one_changes_nothing() {
        let mask = speckles(20, 9);
        assert_eq!(dilate(&mask, f64::INFINITY), Image::filled(20, 9, true));
        assert!(
            [0.0, 0.9, -3.0, f64::NAN]
                .iter()
                .all(|&radius| dilate(&mask, radius) == mask)
        );
    }

    #[test]
    fn closing_a_small_hole_leaves_the_outline() {
        let disc = Image::from_fn(41, 41, |x, y| {
            (x as i32 - 20).pow(2) + (y as i32 - 20).pow(2) <= 150
        });
        let mut holed = disc.clone();
        holed[(20, 20)] = false;
        let closed = erode(&dilate(&holed, 2.0), 2.0);
        assert!(closed[(20, 20)]);
        assert!(
            closed
                .pixels()
                .iter()
                .zip(disc.pixels())
                .all(|(&c, &d)| c >= d)
        );
    }

    #[test]
    fn the_largest_around_a_pixel_is_found_up_to_the_border() {
        let band = Image::from_fn(7, 5, |x, y| ((x * 7919 + y * 104_729) % 31) as f32);
        for reach in [1, 2, 9] {
            let found = largest_around(&band, reach);
            for (x, y) in (0..35_usize).map(|i| (i % 7, i / 7)) {
                let near = (0..35_usize)
                    .filter(|i| x.abs_diff(i % 7) <= reach && y.abs_diff(i / 7) <= reach);
                assert_eq!(
                    found[(x, y)],
                    near.map(|i| band.pixels()[i]).fold(0.0, f32::max)
                );
            }
        }
    }

    #[test]
    fn empty_masks_survive() {
        assert!(
            dilate(&Image::new(0, 4), 2.0).is_empty() && erode(&Image::new(4, 0), 2.0).is_empty()
        );
    }
}
