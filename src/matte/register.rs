//! How far one picture lies from another, to a fraction of a pixel.

use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, LinearRgb, Mix};
use nalgebra::{Matrix2, Vector2};

/// Where a picture lies on another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Registered {
    /// Pixels right and down by which the second picture must be moved to lie on the first; 0
    /// where there is too little structure.
    pub(super) shift_px: [f64; 2],
    /// Standard deviation of the shift; infinite where there is no structure at all.
    pub(super) sigma_px: f64,
    /// Correlation of the two where they lie on each other, -1 to 1.
    pub(super) agreement: f64,
}

/// Levels of the pyramid that the search climbs down: shifts of up to 2 pixels of the coarsest are
/// found.
const PYRAMID_LEVELS: usize = 4;
/// Shortest side of a picture that is still halved.
const MIN_HALVED_SIDE_PX: usize = 32;
/// Steps of Gauss and Newton a level.
const MAX_STEPS: usize = 12;
/// A step shorter than this is the last.
const CONVERGED_PX: f64 = 1e-3;
/// Wavelengths above some ten of these are taken out: light that differs, not edges.
const HIGH_PASS_PX: f32 = 4.0;
/// Pictures that correlate less show nothing in common that could have moved.
const MIN_AGREEMENT: f64 = 0.3;
/// The longest step, pixels of its level: farther off the gradient is no guide.
const MAX_STEP_PX: f64 = 2.0;
/// A shift below this many standard deviations counts as none.
const SIGNIFICANT_SIGMAS: f64 = 3.0;
/// A search that moved by more than this share of the shorter side has diverged: there was nothing
/// to hold on to.
const MAX_SHIFT_SHARE: f64 = 0.25;

/// The shift of `b` onto `a` where `mask` is set, by the light weighed by `weights`.
///
/// # Method
/// [Lucas and Kanade 1981] on high-passed pictures, from coarse to fine, with a factor between them
/// solved for in each step.
///
/// [Lucas and Kanade 1981]: https://www.ri.cmu.edu/pub_files/pub3/lucas_bruce_d_1981_2/lucas_bruce_d_1981_2.pdf
pub(super) fn shift(
    a: &Image<LinearRgb>,
    b: &Image<LinearRgb>,
    mask: &Mask,
    weights: [f32; 3],
) -> Registered {
    let whole = PyramidLevel {
        a: weighted(a, weights),
        b: weighted(b, weights),
        mask: mask.to_coverage(),
    };
    let found = whole.coarse_to_fine();
    if found.is_reliable(a.width().min(a.height())) {
        return found;
    }
    Registered {
        shift_px: [0.0; 2],
        ..found
    }
}

impl Registered {
    /// Without any structure.
    const NOTHING: Self = Self {
        shift_px: [0.0; 2],
        sigma_px: f64::INFINITY,
        agreement: 0.0,
    };

    /// The shift is a significant one between pictures of the same thing; `side` is the shorter one
    /// of the picture.
    fn is_reliable(&self, side: usize) -> bool {
        let length_px = Vector2::from(self.shift_px).norm();
        let is_unlike = self.agreement < MIN_AGREEMENT;
        let is_lost = length_px > MAX_SHIFT_SHARE * side as f64;
        let is_insignificant = length_px < SIGNIFICANT_SIGMAS * self.sigma_px;
        !(is_unlike || is_lost || is_insignificant)
    }
}

/// A picture moved right and down, its border going on outside.
pub(super) fn moved<P: Mix>(image: &Image<P>, [dx, dy]: [f64; 2]) -> Image<P> {
    if dx == 0.0 && dy == 0.0 {
        return image.clone();
    }
    Image::from_fn(image.width(), image.height(), |x, y| {
        filter::sample_bilinear_clamped(image, x as f64 + 0.5 - dx, y as f64 + 0.5 - dy)
    })
}

fn weighted(image: &Image<LinearRgb>, [r, g, b]: [f32; 3]) -> Image<f32> {
    image.map(|p| r * p.r + g * p.g + b * p.b)
}

fn high_passed(image: &Image<f32>) -> Image<f32> {
    let smooth = filter::gaussian_blur(image, HIGH_PASS_PX);
    filter::gaussian_blur(&image.zip_map(&smooth, |v, mean| v - mean), 1.0)
}

/// Two pictures at one level of a pyramid, and where they are compared.
struct PyramidLevel {
    a: Image<f32>,
    b: Image<f32>,
    mask: Image<Coverage>,
}

impl PyramidLevel {
    /// The next level; none where its pictures would be too small.
    fn halved(&self) -> Option<Self> {
        let shorter = self.a.width().min(self.a.height());
        (shorter >= 2 * MIN_HALVED_SIDE_PX).then(|| Self {
            a: filter::halve(&self.a),
            b: filter::halve(&self.b),
            mask: filter::halve(&self.mask),
        })
    }

    /// The pair itself and its halves, as long as they are large enough.
    fn into_pyramid(self) -> Vec<Self> {
        let mut levels = vec![self];
        for _ in 1..PYRAMID_LEVELS {
            levels.extend(levels.last().and_then(Self::halved));
        }
        levels
    }

    /// The shift from the coarsest level down to the finest, each starting from the one before.
    fn coarse_to_fine(self) -> Registered {
        let mut found = Registered::NOTHING;
        for (level, pair) in self.into_pyramid().iter().enumerate().rev() {
            let at_full = f64::from(1 << level);
            found = pair.registered(found.shift_px, at_full).unwrap_or(found);
        }
        found
    }

    /// The shift by this level, of which a pixel is `at_full` of the first, from a start; both in
    /// pixels of the first.
    fn registered(&self, start_px: [f64; 2], at_full: f64) -> Option<Registered> {
        let start = Vector2::from(start_px) / at_full;
        let (at, last) = self.high_passed().refined(start)?;
        Some(Registered {
            shift_px: (at * at_full).into(),
            sigma_px: last.sigma * at_full,
            agreement: last.agreement,
        })
    }

    fn high_passed(&self) -> Self {
        Self {
            a: high_passed(&self.a),
            b: high_passed(&self.b),
            mask: self.mask.clone(),
        }
    }

    /// Gauss and Newton from a start; the shift and the last step, nothing where there is no
    /// structure.
    fn refined(&self, start: Vector2<f64>) -> Option<(Vector2<f64>, ShiftStep)> {
        let mut at = start;
        let mut last = self.step(at)?;
        for _ in 0..MAX_STEPS {
            at += last.by;
            if last.by.norm() < CONVERGED_PX {
                break;
            }
            last = self.step(at)?;
        }
        at.iter().all(|v| v.is_finite()).then_some((at, last))
    }

    /// One step from a shift of `b`: the gain by regression of `a` on it, the shift by regression
    /// of what is left on the gradient.
    fn step(&self, at: Vector2<f64>) -> Option<ShiftStep> {
        let b = moved(&self.b, at.into());
        let (gain, agreement) = self.gain_and_agreement(&b)?;
        let equations = self.normal_equations(&b, gain);
        let inverse: Matrix2<f64> = equations.normal.try_inverse()?;
        let by: Vector2<f64> = inverse * equations.right;
        Some(ShiftStep {
            by: by.cap_magnitude(MAX_STEP_PX),
            sigma: (equations.variance() * inverse.trace()).sqrt(),
            agreement,
        })
    }

    /// The pixels that are compared: those of the mask that have neighbours all around.
    fn compared(&self) -> impl Iterator<Item = (usize, usize)> {
        let (w, h) = self.a.size();
        (1..h.saturating_sub(1))
            .flat_map(move |y| (1..w.saturating_sub(1)).map(move |x| (x, y)))
            .filter(|&at| self.mask[at].0 > 0.5)
    }

    /// The factor from `b` to `a`, and their correlation.
    fn gain_and_agreement(&self, b: &Image<f32>) -> Option<(f64, f64)> {
        let a = &self.a;
        let (mut aa, mut ab, mut bb) = (0.0_f64, 0.0_f64, 0.0_f64);
        for at in self.compared() {
            aa += f64::from(a[at] * a[at]);
            ab += f64::from(a[at] * b[at]);
            bb += f64::from(b[at] * b[at]);
        }
        (bb > 0.0).then(|| (ab / bb, ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)))
    }

    fn normal_equations(&self, b: &Image<f32>, gain: f64) -> ShiftEquations {
        let mut sums = ShiftEquations::default();
        for at in self.compared() {
            let residual = f64::from(self.a[at]) - gain * f64::from(b[at]);
            sums.add(scaled_gradient(b, at, gain), residual);
        }
        sums
    }
}

/// Central differences of a picture, times a factor.
fn scaled_gradient(b: &Image<f32>, (x, y): (usize, usize), gain: f64) -> Vector2<f64> {
    Vector2::new(
        0.5 * gain * f64::from(b[(x + 1, y)] - b[(x - 1, y)]),
        0.5 * gain * f64::from(b[(x, y + 1)] - b[(x, y - 1)]),
    )
}

/// Sums of the least squares problem for a shift.
#[derive(Default)]
struct ShiftEquations {
    normal: Matrix2<f64>,
    right: Vector2<f64>,
    /// Of the residuals.
    square: f64,
    count: f64,
}

impl ShiftEquations {
    #[inline]
    fn add(&mut self, gradient: Vector2<f64>, residual: f64) {
        self.normal += gradient * gradient.transpose();
        self.right -= gradient * residual;
        self.square += residual * residual;
        self.count += 1.0;
    }

    /// Variance of a residual, in independent pixels.
    fn variance(&self) -> f64 {
        self.square / self.count * CORRELATED_PIXELS
    }
}

/// One step of Gauss and Newton.
struct ShiftStep {
    by: Vector2<f64>,
    sigma: f64,
    agreement: f64,
}

/// Neighbouring pixels that vary together after the blur: the area of its kernel, 4 pi sigma^2.
const CORRELATED_PIXELS: f64 = 12.6;

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
