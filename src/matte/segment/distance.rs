//! Exact distances to a set of pixels, and what follows from them: growing, shrinking, closing.

use crate::image::Image;

/// Square of the distance, in pixels, from every pixel's centre to the nearest pixel of a set; infinite where the set
/// is empty.
///
/// # Method
/// [Felzenszwalb and Huttenlocher 2012]: lower envelope of parabolas, along the columns and then along the rows.
///
/// [Felzenszwalb and Huttenlocher 2012]: https://doi.org/10.4086/toc.2012.v008a019
pub(super) fn squared_distance(set: &Image<bool>) -> Image<f32> {
    let start = set.map(|inside| if inside { 0.0 } else { f32::INFINITY });
    let columns = envelope_rows(transposed(&start));
    envelope_rows(transposed(&columns))
}

/// The set and every pixel within `radius` of it.
pub(super) fn grown(set: &Image<bool>, radius: f32) -> Image<bool> {
    squared_distance(set).map(|d| d <= radius * radius)
}

/// The pixels of the set that are further than `radius` from everything outside it; the border of the picture counts
/// as the set.
pub(super) fn shrunk(set: &Image<bool>, radius: f32) -> Image<bool> {
    squared_distance(&set.map(|inside| !inside)).map(|d| d > radius * radius)
}

fn transposed(image: &Image<f32>) -> Image<f32> {
    Image::from_fn(image.height(), image.width(), |x, y| image[(y, x)])
}

fn envelope_rows(mut image: Image<f32>) -> Image<f32> {
    use rayon::prelude::*;
    image.par_rows_mut().for_each(|row| {
        let lower = lower_envelope(row);
        row.copy_from_slice(&lower);
    });
    image
}

/// `min over q of (p - q)^2 + f(q)` for every `p`.
fn lower_envelope(f: &[f32]) -> Vec<f32> {
    // Parabolas of the envelope, from the left: apex, and where each takes over.
    let mut parabolas: Vec<(usize, f64)> = Vec::with_capacity(f.len());
    for q in (0..f.len()).filter(|&q| f[q].is_finite()) {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(r, start)) = parabolas.last() {
            from = crossing(f, r, q);
            if from > start {
                break;
            }
            parabolas.pop();
            from = f64::NEG_INFINITY;
        }
        parabolas.push((q, from));
    }
    let mut k = 0;
    let lowest = |p: usize| {
        while k + 1 < parabolas.len() && parabolas[k + 1].1 < p as f64 {
            k += 1;
        }
        parabolas.get(k).map_or(f32::INFINITY, |&(q, _)| {
            let d = p as f32 - q as f32;
            d * d + f[q]
        })
    };
    (0..f.len()).map(lowest).collect()
}

/// Where the parabola at `q` begins to be lower than the one at `r < q`.
fn crossing(f: &[f32], r: usize, q: usize) -> f64 {
    let height = |i: usize| f64::from(f[i]) + (i * i) as f64;
    (height(q) - height(r)) / (2.0 * (q - r) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_agree_with_brute_force() {
        let set = Image::from_fn(23, 17, |x, y| (x * 31 + y * 17) % 37 == 3);
        let fast = squared_distance(&set);
        let members: Vec<_> = (0..23).flat_map(|x| (0..17).map(move |y| (x, y))).filter(|&p| set[p]).collect();
        for y in 0..17 {
            for x in 0..23 {
                let d = members.iter().map(|&(u, v)| u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2)).min();
                assert_eq!(fast[(x, y)], d.unwrap() as f32, "at {x}, {y}");
            }
        }
    }

    #[test]
    fn an_empty_set_is_infinitely_far() {
        assert!(squared_distance(&Image::filled(3, 2, false)).pixels().iter().all(|d| d.is_infinite()));
    }

    #[test]
    fn shrinking_undoes_growing_of_a_disc() {
        let disc = Image::from_fn(60, 60, |x, y| x.abs_diff(30).pow(2) + y.abs_diff(30).pow(2) <= 144);
        let back = shrunk(&grown(&disc, 6.0), 6.0);
        let lost = disc.pixels().iter().zip(back.pixels()).filter(|(a, b)| **a && !**b).count();
        assert_eq!(lost, 0);
    }
}
