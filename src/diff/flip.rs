//! FLIP: how different two pictures look to someone who flips between them.

use super::correlate::{Kernel, channel, correlate};
use crate::color::{ColorMatrix, srgb_to_linear};
use crate::image::Image;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Pixels per degree of sight: a screen of 3840 pixels on 0.7 m, seen from 0.7 m (the authors' default).
const PIXELS_PER_DEGREE: f64 = 3840.0 / 0.7 * 0.7 * PI / 180.0;

/// Contrast sensitivity of the eye as sums of Gaussians over degrees: pairs of weight and width (table 1).
const SENSITIVITY: [&[[f64; 2]]; 3] = [
    &[[1.0, 0.0047]],
    &[[1.0, 0.0053]],
    &[[34.1, 0.04], [13.5, 0.025]],
];
/// The widest of them decides the radius of all.
const WIDEST: f64 = 0.04;

/// Exponent that evens out large colour differences.
const COLOR_EXPONENT: f64 = 0.7;
/// The share of the largest difference that is spread over ...
const KNEE: f64 = 0.4;
/// ... this share of the scale.
const KNEE_HEIGHT: f64 = 0.95;
/// Width of the detectors of edges and points, degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent on the difference of features.
const FEATURE_EXPONENT: f64 = 0.5;

/// Mean LDR-FLIP of two display-encoded (sRGB, 0 to 1) pictures: 0 for equal ones, at most 1.
///
/// None for pictures of different size or without pixels.
///
/// # Method
/// [Andersson et al. 2020] at 67 pixels per degree: difference of colours after the eye's blur (HyAB in Hunt-adjusted
/// CIELAB), raised to the power of one minus the difference of edges and points. White is that of Rec. 709, D65.
///
/// [Andersson et al. 2020]: https://doi.org/10.1145/3406183
pub fn flip(reference: &Image<[f32; 3]>, test: &Image<[f32; 3]>) -> Option<f64> {
    if reference.size() != test.size() || reference.is_empty() {
        return None;
    }
    let sum: f64 = row_sums(reference, test, 0..test.height()).iter().sum();
    Some(sum / test.pixels().len() as f64)
}

/// How many rows beside a row have a say in it.
pub(super) fn reach() -> usize {
    blur_radius().max(feature_radius()) as usize
}

/// Sums of the differences in some rows.
pub(super) fn row_sums(
    reference: &Image<[f32; 3]>,
    test: &Image<[f32; 3]>,
    rows: Range<usize>,
) -> Vec<f64> {
    let eye = Eye::new();
    let [a, b] = [reference, test].map(|image| eye.see(image));
    let largest = eye.largest();
    let difference = |at: (usize, usize)| {
        let color = remapped(hyab(a.colors[at], b.colors[at]), largest);
        let (f, g) = (a.features[at], b.features[at]);
        let feature = (f[0] - g[0]).abs().max((f[1] - g[1]).abs());
        let feature = libm::pow(
            f64::from(feature) * std::f64::consts::FRAC_1_SQRT_2,
            FEATURE_EXPONENT,
        );
        libm::pow(color, 1.0 - feature)
    };
    rows.into_par_iter()
        .map(|y| (0..test.width()).map(|x| difference((x, y))).sum())
        .collect()
}

/// What is seen of a picture.
struct Seen {
    /// Blurred as by the eye, CIELAB with Hunt's adjustment.
    colors: Image<[f32; 3]>,
    /// Strength of edges and of points.
    features: Image<[f32; 2]>,
}

struct Eye {
    xyz_from_linear: ColorMatrix,
    linear_from_xyz: ColorMatrix,
    white: [f32; 3],
}

impl Eye {
    fn new() -> Self {
        let xyz_from_linear = ColorMatrix::xyz_from_linear();
        let white = xyz_from_linear.apply([1.0; 3]);
        Self {
            xyz_from_linear,
            linear_from_xyz: ColorMatrix::linear_from_xyz(),
            white,
        }
    }

    fn see(&self, image: &Image<[f32; 3]>) -> Seen {
        let opponent = image.map(|p| self.opponent(p));
        let [luminance, red_green, blue_yellow] = [0, 1, 2].map(|c| channel(&opponent, c));
        let features = features(&luminance.map(|y| (y + 16.0) / 116.0));
        let [y, cx, cz] = [(0, &luminance), (1, &red_green), (2, &blue_yellow)]
            .map(|(c, plane)| blurred(plane, SENSITIVITY[c]));
        let (width, height) = image.size();
        let colors = Image::from_fn(width, height, |i, j| {
            self.hunt_lab(self.linear([y[(i, j)], cx[(i, j)], cz[(i, j)]]))
        });
        Seen { colors, features }
    }

    /// YCxCz of a display-encoded colour: linear in XYZ, so that blurring it blurs light.
    fn opponent(&self, encoded: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.relative(encoded.map(|v| srgb_to_linear(v.clamp(0.0, 1.0))));
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// Linear colour of YCxCz, as far as a screen shows it.
    fn linear(&self, [y, cx, cz]: [f32; 3]) -> [f32; 3] {
        let y = (y + 16.0) / 116.0;
        let xyz = [y + cx / 500.0, y, y - cz / 200.0];
        let absolute = std::array::from_fn(|c| xyz[c] * self.white[c]);
        self.linear_from_xyz
            .apply(absolute)
            .map(|v| v.clamp(0.0, 1.0))
    }

    /// XYZ as shares of white.
    fn relative(&self, linear: [f32; 3]) -> [f32; 3] {
        let xyz = self.xyz_from_linear.apply(linear);
        std::array::from_fn(|c| xyz[c] / self.white[c])
    }

    /// CIELAB, its colourfulness scaled down in the dark (Hunt).
    fn hunt_lab(&self, linear: [f32; 3]) -> [f32; 3] {
        const BEND: f32 = 6.0 / 29.0;
        let f = |t: f32| {
            if t > BEND * BEND * BEND {
                libm::cbrtf(t)
            } else {
                t / (3.0 * BEND * BEND) + 4.0 / 29.0
            }
        };
        let [x, y, z] = self.relative(linear).map(f);
        let lightness = 116.0 * y - 16.0;
        [
            lightness,
            0.01 * lightness * 500.0 * (x - y),
            0.01 * lightness * 200.0 * (y - z),
        ]
    }

    /// The largest difference on a screen, that of green and blue, evened out.
    fn largest(&self) -> f64 {
        hyab(
            self.hunt_lab([0.0, 1.0, 0.0]),
            self.hunt_lab([0.0, 0.0, 1.0]),
        )
    }
}

/// Distance in CIELAB that adds lightness to colourfulness, evened out.
fn hyab(p: [f32; 3], q: [f32; 3]) -> f64 {
    let d: [f64; 3] = std::array::from_fn(|c| f64::from(p[c] - q[c]));
    libm::pow(d[0].abs() + libm::hypot(d[1], d[2]), COLOR_EXPONENT)
}

/// 0 to 1, small differences spread out.
fn remapped(difference: f64, largest: f64) -> f64 {
    let knee = KNEE * largest;
    if difference < knee {
        return KNEE_HEIGHT / knee * difference;
    }
    KNEE_HEIGHT + (difference - knee) / (largest - knee) * (1.0 - KNEE_HEIGHT)
}

fn blur_radius() -> i32 {
    (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32
}

/// Standard deviation of the detectors of edges and points, pixels.
const FEATURE_SIGMA: f64 = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;

fn feature_radius() -> i32 {
    (3.0 * FEATURE_SIGMA).ceil() as i32
}

/// A plane as the eye blurs it.
fn blurred(plane: &Image<f32>, sensitivity: &[[f64; 2]]) -> Image<f32> {
    let radius = blur_radius();
    let gaussian = |width: f64| {
        move |x: f64| {
            libm::exp(-PI * PI * (x / PIXELS_PER_DEGREE) * (x / PIXELS_PER_DEGREE) / width)
        }
    };
    // The weight of each Gaussian in the whole, which sums to 1.
    let sum = |width: f64| {
        (-radius..=radius)
            .map(|i| gaussian(width)(f64::from(i)))
            .sum::<f64>()
    };
    let share = |[a, b]: [f64; 2]| a * (PI / b).sqrt() * sum(b) * sum(b);
    let whole: f64 = sensitivity.iter().map(|&g| share(g)).sum();
    let part = |&[a, b]: &[f64; 2]| {
        let kernel = Kernel::new(radius, gaussian(b)).balanced();
        let weight = (share([a, b]) / whole) as f32;
        correlate(plane, &kernel, &kernel).map(|v| v * weight)
    };
    let mut parts = sensitivity.iter().map(part);
    let first = parts.next().unwrap_or_else(|| plane.clone());
    parts.fold(first, |sum, next| sum.zip_map(&next, |u, v| u + v))
}

/// Strength of edges and of points.
fn features(luminance: &Image<f32>) -> Image<[f32; 2]> {
    let (sigma, radius) = (FEATURE_SIGMA, feature_radius());
    let gaussian = |x: f64| libm::exp(-x * x / (2.0 * sigma * sigma));
    let blur = Kernel::gaussian(radius, sigma);
    let strength = |kernel: &Kernel| {
        let (x, y) = (
            correlate(luminance, kernel, &blur),
            correlate(luminance, &blur, kernel),
        );
        x.zip_map(&y, |u: f32, v: f32| libm::hypotf(u, v))
    };
    let edges = strength(&Kernel::new(radius, |x| -x * gaussian(x)).balanced());
    let points = strength(
        &Kernel::new(radius, |x| (x * x / (sigma * sigma) - 1.0) * gaussian(x)).balanced(),
    );
    edges.zip_map(&points, |e, p| [e, p])
}

#[cfg(test)]
mod tests {
    use super::super::likeness::tests::{changed, pattern};
    use super::*;

    #[test]
    fn equal_pictures_do_not_flip() {
        assert_eq!(flip(&pattern(), &pattern()), Some(0.0));
    }

    /// `evaluate(a, b, "LDR")` of flip-evaluator 1.7 for the same two pictures, by `golden/diff/reference.py`.
    #[test]
    fn the_measure_is_that_of_its_authors() {
        let measured = flip(&pattern(), &changed()).unwrap();
        assert!((measured - FLIP_EVALUATOR).abs() < 2e-5, "{measured}");
    }
    const FLIP_EVALUATOR: f64 = 0.194_597_66;

    #[test]
    fn black_and_white_are_as_different_as_can_be() {
        let of = |v| Image::filled(9, 4, [v; 3]);
        // HyAB of 100 is beyond the knee; no features.
        let far = flip(&of(0.0), &of(1.0)).unwrap();
        assert!(far > KNEE_HEIGHT && far <= 1.0, "{far}");
        assert_eq!(flip(&of(0.0), &Image::filled(9, 5, [0.0; 3])), None);
        assert_eq!(flip(&Image::new(0, 0), &Image::new(0, 0)), None);
    }
}
