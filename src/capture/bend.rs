//! Where the light that passes an object comes from, and where that is known.
//!
//! # Method
//! Stripes of a period give one value of the optical transfer function of each pixel: what is left
//! of their contrast, and by how much they are shifted. Light that goes through the object as
//! through a clear sheet leaves the contrast of fine stripes; what folds and wrinkles scatter leaves
//! none, but some of that of coarse ones. So what fine stripes keep is the share that stays sharp,
//! their shift its displacement, and the rest of the coarse transfer gives middle and width of what
//! is scattered, modelled as a Gaussian.

use super::display::Display;
use super::stripes::{SeenStripes, Wave};
use super::view::View;
use crate::image::{Image, Mask};
use crate::matte::LightPath;
use crate::pixel::Coverage;
use crate::quantile::median;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::{PI, TAU};

/// How lines of sight through an object are bent.
pub struct Refraction {
    /// Where the light comes from that the object lets pass, lengths in pixels of the display;
    /// nothing bent where it is not known.
    pub paths: Image<LightPath>,
    /// Where it was measured: on the object alone, and where it lets light pass.
    pub known: Mask,
}

/// What lets pass less than this tells nothing of where the light comes from.
const MIN_TRANSMITTANCE: f32 = 0.05;
/// Less haze than this is noise.
const MIN_HAZE: f64 = 0.03;
/// What noise may add to the transfer at coarse stripes.
const TRANSFER_NOISE: f64 = 0.05;
/// The least and the most that coarse stripes are taken to leave of scattered light.
const SCATTERED_TRANSFER: [f64; 2] = [0.01, 0.999];
/// Fine periods to either side that a displacement is looked for in.
const MAX_PERIODS: i32 = 4;
/// Degree of the polynomial that corrects a lens.
const DEGREE: usize = 3;
/// Pixels between samples of that fit.
const SAMPLE_STEP: usize = 6;
/// Share of the fit's residuals that are dropped as outliers.
const DROPPED_SHARE: f64 = 0.1;

/// The optical transfer function of a pixel at two frequencies along each axis.
#[derive(Clone, Copy)]
struct Transfer {
    coarse: [Complex<f64>; 2],
    fine: [Complex<f64>; 2],
    /// Periods of both, pixels of the display.
    periods_px: [f64; 2],
}

impl Transfer {
    fn path(&self) -> LightPath {
        let sharp = mean_transfer(self.fine).min(1.0);
        let haze = 1.0 - sharp;
        let displacement = [0, 1].map(|axis| self.displacement(axis, sharp));
        if haze < MIN_HAZE {
            return LightPath {
                displacement: displacement.map(|d| d as f32),
                ..LightPath::default()
            };
        }
        let [long, _] = self.periods_px;
        let scattered = [0, 1]
            .map(|axis| self.coarse[axis] - from_polar(sharp, displacement[axis] / long))
            .map(|rest| rest / haze);
        LightPath {
            displacement: displacement.map(|d| d as f32),
            haze: haze as f32,
            scatter_displacement: scattered.map(|s| (long * s.arg() / TAU) as f32),
            scatter_width: (long * width_of(mean_transfer(scattered))) as f32,
        }
    }

    /// Displacement of the light that stays sharp: the least of those that fine stripes allow which
    /// leaves coarse ones no more of scattered light than there is.
    fn displacement(&self, axis: usize, sharp: f64) -> f64 {
        let [long, short] = self.periods_px;
        let phase = self.fine[axis].arg() / TAU;
        let too_much = |d: f64| {
            let rest = self.coarse[axis] - from_polar(sharp, d / long);
            (rest.norm() - (1.0 - sharp) - TRANSFER_NOISE).max(0.0)
        };
        let cost = |d: f64| too_much(d) + 0.01 * d.abs() / short;
        let places = (-MAX_PERIODS..=MAX_PERIODS).map(|k| short * (phase + f64::from(k)));
        let least = places.min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
        least.unwrap_or_default()
    }
}

/// What is left of contrast, by both axes.
fn mean_transfer([x, y]: [Complex<f64>; 2]) -> f64 {
    (x.norm() * y.norm()).sqrt()
}

fn from_polar(norm: f64, periods: f64) -> Complex<f64> {
    let (sine, cosine) = libm::sincos(TAU * periods);
    Complex::new(norm * cosine, norm * sine)
}

/// Standard deviation, in periods, of a Gaussian that leaves this much of contrast.
fn width_of(transfer: f64) -> f64 {
    let [least, most] = SCATTERED_TRANSFER;
    (-0.5 * libm::log(transfer.clamp(least, most))).sqrt() / PI
}

/// What is known of the object and the display, beside the stripes.
pub(super) struct BendInput<'a> {
    pub(super) display: &'a Display,
    pub(super) view: &'a View,
    pub(super) seen: &'a SeenStripes,
    /// The stripes without the object, where they were photographed.
    pub(super) empty: Option<&'a SeenStripes>,
    /// Pixels that surely show the empty display.
    pub(super) free: &'a Mask,
    /// What the object covers.
    pub(super) coverage: &'a Image<Coverage>,
    /// Its grey transmittance.
    pub(super) transmittance: &'a Image<f32>,
    /// Grey light of white over black.
    pub(super) light: &'a Image<f32>,
    /// What of that the object lets pass, grey.
    pub(super) passed: &'a Image<f32>,
}

impl BendInput<'_> {
    pub(super) fn solve(&self) -> Refraction {
        let expected = self.expected();
        let known = self
            .transmittance
            .zip_map(self.coverage, |transmittance, coverage| {
                transmittance >= MIN_TRANSMITTANCE && coverage.0 >= 0.5
            });
        let contrasts = [0, 1].map(|period| [0, 1].map(|axis| self.contrast(period, axis)));
        let (w, h) = known.size();
        let paths = Image::from_fn(w, h, |x, y| {
            if known[(x, y)] {
                self.transfer((x, y), expected[(x, y)], &contrasts).path()
            } else {
                LightPath::default()
            }
        });
        Refraction { paths, known }
    }

    /// What the object leaves of stripes that have such contrasts without it, and that end where
    /// expected.
    fn transfer(
        &self,
        at: (usize, usize),
        expected: [f64; 2],
        contrasts: &[[f32; 2]; 2],
    ) -> Transfer {
        let periods_px = [false, true].map(|is_fine| self.display.period_px(is_fine));
        let of = |period: usize, axis: usize| {
            let Wave { phase, amplitude } = self.seen.waves[period][axis][at];
            let whole = (contrasts[period][axis] * self.passed[at]).max(1e-4);
            let norm = f64::from(amplitude / whole);
            from_polar(norm, phase - expected[axis] / periods_px[period])
        };
        Transfer {
            coarse: [of(0, 0), of(0, 1)],
            fine: [of(1, 0), of(1, 1)],
            periods_px,
        }
    }

    /// Where lines of sight end without the object, pixels of the display.
    fn expected(&self) -> Image<[f64; 2]> {
        let fitted = self.fitted();
        let Some(empty) = self.empty else {
            return fitted;
        };
        fitted.zip3_map(
            &empty.at_px,
            &empty.consistent,
            |fitted, seen, consistent| {
                if consistent { seen } else { fitted }
            },
        )
    }

    /// The places of the view, corrected by a polynomial that the free pixels give.
    fn fitted(&self) -> Image<[f64; 2]> {
        let seen = self.empty.unwrap_or(self.seen);
        let corrections = [0, 1].map(|axis| self.correction(seen, axis));
        let (w, h) = self.view.size;
        Image::from_fn(w, h, |x, y| {
            let (at, basis) = (self.view.display_at(x, y), self.basis(x, y));
            [0, 1].map(|axis| at[axis] + dot(&basis, &corrections[axis]))
        })
    }

    /// Coefficients of the correction along an axis.
    fn correction(&self, seen: &SeenStripes, axis: usize) -> Vec<f64> {
        let mut samples = self.samples(seen, axis);
        let first = least_squares(&samples);
        let off = |(basis, value): &(Vec<f64>, f64)| (value - dot(basis, &first)).abs();
        samples.sort_by(|a, b| off(a).total_cmp(&off(b)));
        samples.truncate(((1.0 - DROPPED_SHARE) * samples.len() as f64) as usize);
        least_squares(&samples)
    }

    /// The basis at free pixels, and how far the place that is seen there is off.
    fn samples(&self, seen: &SeenStripes, axis: usize) -> Vec<(Vec<f64>, f64)> {
        let (w, h) = self.view.size;
        let grid = (0..h)
            .step_by(SAMPLE_STEP)
            .flat_map(|y| (0..w).step_by(SAMPLE_STEP).map(move |x| (x, y)));
        let free = grid.filter(|&at| self.free[at] && seen.consistent[at]);
        let off = free.map(|(x, y)| {
            (
                self.basis(x, y),
                seen.at_px[(x, y)][axis] - self.view.display_at(x, y)[axis],
            )
        });
        off.collect()
    }

    /// Monomials of a pixel's place, -1 to 1.
    fn basis(&self, x: usize, y: usize) -> Vec<f64> {
        let (w, h) = self.view.size;
        let [u, v] = [(x, w), (y, h)].map(|(i, n)| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
        let powers = (0..=DEGREE).flat_map(|i| (0..=DEGREE - i).map(move |j| (i, j)));
        powers
            .map(|(i, j)| u.powi(i as i32) * v.powi(j as i32))
            .collect()
    }

    /// Amplitude of stripes on the empty display, as a share of its light.
    fn contrast(&self, period: usize, axis: usize) -> f32 {
        let waves = self.seen.waves[period][axis].pixels();
        let shares = self
            .free_pixels()
            .map(|i| waves[i].amplitude / self.light.pixels()[i].max(1e-6));
        median(shares, f32::total_cmp).unwrap_or(0.5)
    }

    fn free_pixels(&self) -> impl Iterator<Item = usize> {
        let [free, consistent] = [self.free, &self.seen.consistent].map(Image::pixels);
        (0..free.len()).filter(move |&i| free[i] && consistent[i])
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Coefficients of the basis that fit best; zeros where there are too few samples.
fn least_squares(samples: &[(Vec<f64>, f64)]) -> Vec<f64> {
    let count = samples.first().map_or(0, |(basis, _)| basis.len());
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for (basis, value) in samples {
        let basis = DVector::from_column_slice(basis);
        normal += &basis * basis.transpose();
        right += &basis * *value;
    }
    let solution = normal.cholesky().map(|c| c.solve(&right));
    solution.map_or_else(|| vec![0.0; count], |s| s.iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIODS_PX: [f64; 2] = [160.0, 16.0];

    /// What stripes show of light that comes along a path.
    fn transfer_of(path: &LightPath) -> Transfer {
        let (haze, width) = (f64::from(path.haze), f64::from(path.scatter_width));
        let at = |period: f64, axis: usize| {
            let gaussian = libm::exp(-2.0 * (PI * width / period).powi(2));
            let [sharp, scattered] =
                [path.displacement, path.scatter_displacement].map(|d| f64::from(d[axis]) / period);
            from_polar(1.0 - haze, sharp) + from_polar(haze * gaussian, scattered)
        };
        let [coarse, fine] = PERIODS_PX.map(|period| [at(period, 0), at(period, 1)]);
        Transfer {
            coarse,
            fine,
            periods_px: PERIODS_PX,
        }
    }

    fn assert_found(path: LightPath) {
        let found = transfer_of(&path).path();
        let lengths = |p: LightPath| {
            let [x, y] = p.displacement;
            let [sx, sy] = p.scatter_displacement;
            [x, y, sx, sy, p.scatter_width]
        };
        let pairs = lengths(found).into_iter().zip(lengths(path));
        assert!(
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 0.3),
            "{found:?} of {path:?}"
        );
        assert!((found.haze - path.haze).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn stripes_tell_what_stays_sharp_and_what_is_scattered() {
        let sharp = LightPath {
            displacement: [3.0, -5.0],
            ..LightPath::default()
        };
        assert_found(sharp);
        // Farther than half a fine period.
        let far = LightPath {
            displacement: [21.0, -9.5],
            ..sharp
        };
        assert_found(far);
        for haze in [0.1, 0.5, 0.9] {
            assert_found(LightPath {
                haze,
                scatter_displacement: [-12.0, 20.0],
                scatter_width: 18.0,
                ..sharp
            });
        }
    }

    #[test]
    fn hardly_any_haze_is_none() {
        let path = LightPath {
            haze: 0.02,
            scatter_width: 30.0,
            ..LightPath::default()
        };
        let found = transfer_of(&path).path();
        assert_eq!((found.haze, found.scatter_width), (0.0, 0.0));
    }
}
