//! How far one picture lies from another, to a fraction of a pixel.

use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, LinearRgb, Mix};
use nalgebra::{Matrix2, Vector2};

/// Where a picture lies on another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Registered {
    /// Pixels right and down by which the second picture must be moved to lie on the first; 0 where there is too little
    /// structure to tell.
    pub(super) shift_px: [f64; 2],
    /// Standard deviation of the shift; infinite where there is no structure at all.
    pub(super) sigma_px: f64,
    /// Correlation of the two where they lie on each other, -1 to 1.
    pub(super) agreement: f64,
}

/// Levels of the pyramid that the search climbs down: shifts of up to 2 pixels of the coarsest are found.
const LEVELS: usize = 4;
/// Shortest side of a picture that is still halved.
const SMALLEST: usize = 32;
/// Steps of Gauss and Newton a level.
const STEPS: usize = 12;
/// A step shorter than this is the last.
const SHORT_PX: f64 = 1e-3;
/// Wavelengths above some ten of these are taken out: light that differs, not edges.
const HIGH_PASS_PX: f32 = 4.0;
/// Pictures that correlate less show nothing in common that could have moved.
const LEAST_AGREEMENT: f64 = 0.3;
/// The longest step, pixels of its level: farther off the gradient says nothing.
const LONGEST_PX: f64 = 2.0;
/// A shift below so many standard deviations is none.
const SIGNIFICANT: f64 = 3.0;

/// The shift of `b` onto `a` where `mask` is set, by the light weighed by `weights`.
///
/// # Method
/// [Lucas and Kanade 1981] on high-passed pictures, from coarse to fine, with a factor between them solved for in each
/// step.
///
/// [Lucas and Kanade 1981]: https://www.ri.cmu.edu/pub_files/pub3/lucas_bruce_d_1981_2/lucas_bruce_d_1981_2.pdf
pub(super) fn shift(
    a: &Image<LinearRgb>,
    b: &Image<LinearRgb>,
    mask: &Mask,
    weights: [f32; 3],
) -> Registered {
    let tone = |image: &Image<LinearRgb>| {
        image.map(|p| weights[0] * p.r + weights[1] * p.g + weights[2] * p.b)
    };
    let mask = mask.to_coverage();
    let mut levels = vec![(tone(a), tone(b), mask)];
    while let Some((a, b, mask)) = levels
        .last()
        .filter(|(a, ..)| a.width().min(a.height()) >= 2 * SMALLEST)
    {
        if levels.len() == LEVELS {
            break;
        }
        let next = (filter::halve(a), filter::halve(b), filter::halve(mask));
        levels.push(next);
    }
    let mut found = Registered {
        shift_px: [0.0; 2],
        sigma_px: f64::INFINITY,
        agreement: 0.0,
    };
    for (level, (a, b, mask)) in levels.iter().enumerate().rev() {
        let at_full = f64::from(1 << level);
        let start = found.shift_px.map(|s| s / at_full);
        let Some((at, last)) = refined(&high_passed(a), &high_passed(b), mask, start.into()) else {
            continue;
        };
        found = Registered {
            shift_px: (at * at_full).into(),
            sigma_px: last.sigma * at_full,
            agreement: last.agreement,
        };
    }
    let unlike = found.agreement < LEAST_AGREEMENT;
    // A search over more than a quarter of the picture has lost its way: there was nothing to hold on to.
    let lost = Vector2::from(found.shift_px).norm() > 0.25 * a.width().min(a.height()) as f64;
    if lost || unlike || Vector2::from(found.shift_px).norm() < SIGNIFICANT * found.sigma_px {
        found.shift_px = [0.0; 2];
    }
    found
}

/// A picture moved right and down, its border going on outside.
pub(super) fn moved<P: Mix>(image: &Image<P>, [dx, dy]: [f64; 2]) -> Image<P> {
    if dx == 0.0 && dy == 0.0 {
        return image.clone();
    }
    let at = |x: usize, y: usize| (x as f64 + 0.5 - dx, y as f64 + 0.5 - dy);
    Image::from_fn(image.width(), image.height(), |x, y| {
        let (x, y) = at(x, y);
        filter::sample_bilinear_clamped(image, x, y)
    })
}

fn high_passed(image: &Image<f32>) -> Image<f32> {
    let smooth = filter::gaussian_blur(image, HIGH_PASS_PX);
    filter::gaussian_blur(&image.zip_map(&smooth, |v, mean| v - mean), 1.0)
}

/// Gauss and Newton from a start; the shift and the last step, nothing where there is no structure.
fn refined(
    a: &Image<f32>,
    b: &Image<f32>,
    mask: &Image<Coverage>,
    start: Vector2<f64>,
) -> Option<(Vector2<f64>, Step)> {
    let mut at = start;
    let mut last = step(a, &moved(b, at.into()), mask)?;
    for _ in 0..STEPS {
        at += last.by;
        if last.by.norm() < SHORT_PX {
            break;
        }
        last = step(a, &moved(b, at.into()), mask)?;
    }
    at.iter().all(|v| v.is_finite()).then_some((at, last))
}

struct Step {
    by: Vector2<f64>,
    sigma: f64,
    agreement: f64,
}

/// One step: the gain by regression of `a` on `b`, the shift by regression of what is left on the gradient.
fn step(a: &Image<f32>, b: &Image<f32>, mask: &Image<Coverage>) -> Option<Step> {
    let (w, h) = a.size();
    let inside = || {
        let rows =
            (1..h.saturating_sub(1)).flat_map(|y| (1..w.saturating_sub(1)).map(move |x| (x, y)));
        rows.filter(|&at| mask[at].0 > 0.5)
    };
    let (mut aa, mut ab, mut bb) = (0.0_f64, 0.0_f64, 0.0_f64);
    for at in inside() {
        aa += f64::from(a[at] * a[at]);
        ab += f64::from(a[at] * b[at]);
        bb += f64::from(b[at] * b[at]);
    }
    let gain = if bb > 0.0 { ab / bb } else { return None };
    let (mut normal, mut right, mut square, mut count) =
        (Matrix2::zeros(), Vector2::zeros(), 0.0, 0.0);
    for (x, y) in inside() {
        let slope = |p: (usize, usize), q: (usize, usize)| 0.5 * gain * f64::from(b[p] - b[q]);
        let g = Vector2::new(slope((x + 1, y), (x - 1, y)), slope((x, y + 1), (x, y - 1)));
        let left = f64::from(a[(x, y)]) - gain * f64::from(b[(x, y)]);
        normal += g * g.transpose();
        right -= g * left;
        square += left * left;
        count += 1.0;
    }
    let inverse: Matrix2<f64> = normal.try_inverse()?;
    let variance = square / count * CORRELATED;
    let agreement = ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE);
    let by: Vector2<f64> = inverse * right;
    Some(Step {
        by: by.cap_magnitude(LONGEST_PX),
        sigma: (variance * inverse.trace()).sqrt(),
        agreement,
    })
}

/// Neighbouring pixels that vary together after the blur: the area of its kernel, 4 pi sigma^2.
const CORRELATED: f64 = 12.6;

#[cfg(test)]
mod tests {
    use super::*;

    /// Blobs at places that do not repeat, so that only one shift fits.
    fn bumps(dx: f64, dy: f64) -> Image<LinearRgb> {
        let blobs: Vec<[f64; 4]> = (0..40)
            .map(|i| {
                let i = f64::from(i);
                [
                    (37.7 * i) % 120.0,
                    (53.3 * i) % 90.0,
                    2.5 + (i * 0.71) % 3.0,
                    0.3 * libm::cos(i),
                ]
            })
            .collect();
        Image::from_fn(120, 90, |x, y| {
            let (x, y) = (x as f64 + 0.5 - dx, y as f64 + 0.5 - dy);
            let blob = |[u, v, size, height]: &[f64; 4]| {
                height * libm::exp(-((x - u).powi(2) + (y - v).powi(2)) / (2.0 * size * size))
            };
            LinearRgb::grey((0.8 + blobs.iter().map(blob).sum::<f64>()) as f32)
        })
    }

    /// All but a rim that the shift moves out of the picture.
    fn interior() -> Mask {
        Image::from_fn(120, 90, |x, y| {
            (12..108).contains(&x) && (12..78).contains(&y)
        })
    }

    #[test]
    fn a_shift_is_found_to_a_tenth_of_a_pixel() {
        for (dx, dy) in [(0.0, 0.0), (0.37, -0.61), (2.4, 1.2), (-6.3, 5.5)] {
            let found = shift(
                &bumps(dx, dy),
                &bumps(0.0, 0.0).map(|p| p.scale(0.7)),
                &interior(),
                [0.3, 0.4, 0.3],
            );
            let [x, y] = found.shift_px;
            assert!(
                (x - dx).abs() < 0.1 && (y - dy).abs() < 0.1,
                "{found:?} for {dx}, {dy}"
            );
        }
    }

    #[test]
    fn pictures_without_structure_are_not_moved() {
        let flat = Image::filled(64, 64, LinearRgb::grey(0.5));
        let found = shift(&flat, &flat, &Image::filled(64, 64, true), [1.0; 3]);
        assert_eq!(found.shift_px, [0.0; 2]);
    }
}
