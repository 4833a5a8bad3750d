//! Errors of a cut-out compared with the truth.

use super::method::MethodCutOut;
use super::truth::Known;
use crate::statistics::mean_of;
use petcomp::geom::Point2;
use petcomp::{Coverage, Image, LinearRgb, filter};

/// Sums of errors over a picture are given in thousands.
const SUM_UNIT: f64 = 1000.0;
/// Width of the derivative of the gradient, pixels ([Rhemann et al. 2009]).
///
/// [Rhemann et al. 2009]: https://doi.org/10.1109/CVPR.2009.5206503
const GRADIENT_SIGMA_PX: f32 = 1.4;

/// Errors of one cut-out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Score {
    /// Sum of absolute differences of alpha, thousands of pixels.
    pub(super) sad: f64,
    /// Mean squared difference of alpha.
    pub(super) mse: f64,
    /// Sum of squared differences of the gradient magnitude of alpha, thousands.
    pub(super) gradient: f64,
    /// Mean absolute error over new backgrounds that are lit independently (F + V B), linear light.
    pub(super) mae_lit: f64,
    /// The same as a peak signal-to-noise ratio, decibels for a peak of 1.
    pub(super) psnr_lit: f64,
    /// Mean absolute error over new backgrounds in the object's own shadow (F + T B), linear
    /// light.
    pub(super) mae_shaded: f64,
    /// The same as a peak signal-to-noise ratio.
    pub(super) psnr_shaded: f64,
    /// Mean alpha where there is no object.
    pub(super) residue: f64,
    /// Intersection over union of the outline.
    pub(super) iou: f64,
    /// Largest error of a side of the hull's box, pixels.
    pub(super) box_px: f64,
}

impl Score {
    pub(super) fn new(
        found: &MethodCutOut,
        known: &Known,
        backgrounds: &[Image<LinearRgb>],
    ) -> Self {
        let alpha = found.film.map(|f| Coverage(f.to_rgba().a));
        let lit = lit_errors(found, known, backgrounds);
        let shaded = shaded_errors(found, known, backgrounds);
        Self {
            mae_lit: lit.mean_absolute(),
            psnr_lit: lit.psnr_db(),
            mae_shaded: shaded.mean_absolute(),
            psnr_shaded: shaded.psnr_db(),
            residue: mean_residue(&alpha, &known.mask),
            iou: overlap(&found.outline, &known.mask),
            box_px: box_error(&found.found.hull, known.box_px),
            ..Self::from_alpha(&alpha, &known.view.map(true_alpha))
        }
    }

    /// Errors of alpha alone.
    fn from_alpha(alpha: &Image<Coverage>, truth: &Image<Coverage>) -> Self {
        let off = differences(alpha, truth);
        let squared: f64 = off.iter().map(|d| d * d).sum();
        Self {
            sad: off.iter().map(|d| d.abs()).sum::<f64>() / SUM_UNIT,
            mse: squared / off.len().max(1) as f64,
            gradient: gradient_error(alpha, truth) / SUM_UNIT,
            ..Self::default()
        }
    }
}

/// Alpha of an object with this transmittance.
fn true_alpha(view: LinearRgb) -> Coverage {
    Coverage(1.0 - (view.r + view.g + view.b) / 3.0)
}

fn differences(a: &Image<Coverage>, b: &Image<Coverage>) -> Vec<f64> {
    pixel_pairs(a, b).map(|(a, b)| a - b).collect()
}

/// Coverages at the same pixel of two pictures.
fn pixel_pairs(a: &Image<Coverage>, b: &Image<Coverage>) -> impl Iterator<Item = (f64, f64)> {
    let pairs = a.pixels().iter().zip(b.pixels());
    pairs.map(|(a, b)| (f64::from(a.0), f64::from(b.0)))
}

/// Sum of squared differences of the gradient magnitude.
fn gradient_error(a: &Image<Coverage>, b: &Image<Coverage>) -> f64 {
    let pairs = gradient_lengths(a).into_iter().zip(gradient_lengths(b));
    pairs.map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Gradient magnitude of the blurred picture, by central differences.
fn gradient_lengths(alpha: &Image<Coverage>) -> Vec<f64> {
    let smooth = filter::gaussian_blur(alpha, GRADIENT_SIGMA_PX);
    let (w, h) = alpha.size();
    (0..w * h)
        .map(|i| gradient_length(&smooth, (i % w) as isize, (i / w) as isize))
        .collect()
}

fn gradient_length(image: &Image<Coverage>, x: isize, y: isize) -> f64 {
    libm::hypot(
        half_difference(image, [x + 1, y], [x - 1, y]),
        half_difference(image, [x, y + 1], [x, y - 1]),
    )
}

fn half_difference(image: &Image<Coverage>, a: [isize; 2], b: [isize; 2]) -> f64 {
    let [a, b] = [a, b].map(|[x, y]| f64::from(image.nearest(x, y).0));
    0.5 * (a - b)
}

/// Over new backgrounds that are lit independently.
fn lit_errors(found: &MethodCutOut, known: &Known, backgrounds: &[Image<LinearRgb>]) -> ErrorSums {
    let film = found.film.pixels();
    recomposite(known, &known.view, backgrounds, |i, behind| {
        film[i].over_color(behind)
    })
}

/// Over new backgrounds in the object's own shadow.
fn shaded_errors(
    found: &MethodCutOut,
    known: &Known,
    backgrounds: &[Image<LinearRgb>],
) -> ErrorSums {
    let (film, passes) = (found.film.pixels(), found.transmittance.pixels());
    recomposite(known, &known.transmittance, backgrounds, |i, behind| {
        film[i].color + passes[i] * behind
    })
}

/// Errors over all backgrounds; `ours` composites a pixel over its background.
fn recomposite(
    known: &Known,
    passes: &Image<LinearRgb>,
    backgrounds: &[Image<LinearRgb>],
    ours: impl Fn(usize, LinearRgb) -> LinearRgb,
) -> ErrorSums {
    let (foreground, passes) = (known.foreground.pixels(), passes.pixels());
    let mut sums = ErrorSums::default();
    for background in backgrounds {
        for (i, behind) in background.pixels().iter().enumerate() {
            sums.add(ours(i, *behind), foreground[i] + passes[i] * *behind);
        }
    }
    sums
}

/// Sums over channels.
#[derive(Default)]
struct ErrorSums {
    absolute: f64,
    squared: f64,
    count: u64,
}

impl ErrorSums {
    fn add(&mut self, ours: LinearRgb, truth: LinearRgb) {
        let (ours, truth): ([f32; 3], [f32; 3]) = (ours.into(), truth.into());
        for (a, b) in ours.into_iter().zip(truth) {
            let difference = f64::from(a) - f64::from(b);
            self.absolute += difference.abs();
            self.squared += difference * difference;
            self.count += 1;
        }
    }

    fn mean_absolute(&self) -> f64 {
        self.absolute / self.count.max(1) as f64
    }

    /// Peak signal-to-noise ratio, decibels.
    fn psnr_db(&self) -> f64 {
        let mean = self.squared / self.count.max(1) as f64;
        -10.0 * libm::log10(mean.max(f64::MIN_POSITIVE))
    }
}

/// Mean alpha where the object covers nothing.
fn mean_residue(alpha: &Image<Coverage>, mask: &Image<Coverage>) -> f64 {
    let pairs = pixel_pairs(alpha, mask);
    let outside: Vec<f64> = pairs.filter(|(_, m)| *m == 0.0).map(|(a, _)| a).collect();
    mean_of(&outside, |alpha| *alpha)
}

/// Intersection over union of the areas with at least half coverage.
pub(crate) fn overlap(a: &Image<Coverage>, b: &Image<Coverage>) -> f64 {
    let (mut both, mut any) = (0_u64, 0_u64);
    for (a, b) in pixel_pairs(a, b) {
        both += u64::from(a.min(b) >= 0.5);
        any += u64::from(a.max(b) >= 0.5);
    }
    both as f64 / any.max(1) as f64
}

/// The error of the worst side of a hull's box.
pub(crate) fn box_error(hull: &[Point2<f64>], truth: [f64; 4]) -> f64 {
    let [left, right] = extent(hull.iter().map(|p| p.x));
    let [top, bottom] = extent(hull.iter().map(|p| p.y));
    let sides = [left, top, right, bottom].into_iter().zip(truth);
    sides.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    })
}

#[cfg(test)]
mod tests {
    use super::super::{patched_background, truth::PhotoNoise};
    use super::*;
    use petcomp::Film;
    use petcomp::matte::{SegmentOptions, segment};

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    /// A slab of clear film with an opaque bar on a uniform screen.
    fn known() -> Known {
        let (w, h) = (160, 100);
        let on = |x: usize, y: usize| (40..120).contains(&x) && (30..70).contains(&y);
        let bar = |x: usize, y: usize| on(x, y) && (70..90).contains(&x);
        let foreground = Image::from_fn(w, h, |x, y| match (bar(x, y), on(x, y)) {
            (true, _) => LinearRgb::new(0.5, 0.1, 0.1),
            (false, true) => LinearRgb::grey(0.1),
            _ => LinearRgb::BLACK,
        });
        let passes = |film: f32| {
            Image::from_fn(w, h, move |x, y| {
                LinearRgb::grey(if bar(x, y) {
                    0.0
                } else if on(x, y) {
                    film
                } else {
                    1.0
                })
            })
        };
        let (transmittance, view) = (passes(0.5), passes(0.75));
        let screen = Image::filled(w, h, GREEN);
        let photo = Image::from_fn(w, h, |x, y| {
            foreground[(x, y)] + transmittance[(x, y)] * GREEN
        });
        let mask = Image::from_fn(w, h, |x, y| Coverage(f32::from(u8::from(on(x, y)))));
        let (box_px, noise) = (
            [40.0, 30.0, 120.0, 70.0],
            PhotoNoise {
                shot: 0.0,
                read: 0.0,
            },
        );
        Known {
            name: "slab".into(),
            photo,
            foreground,
            transmittance,
            view,
            screen,
            mask,
            box_px,
            noise,
            paint: GREEN,
        }
    }

    fn truth(known: &Known) -> MethodCutOut {
        MethodCutOut {
            film: known.foreground.zip_map(&known.view, Film::new),
            transmittance: known.transmittance.clone(),
            outline: known.mask.clone(),
            found: segment(&known.photo, &SegmentOptions::default()).unwrap(),
        }
    }

    #[test]
    fn the_truth_has_no_error() {
        let known = known();
        let score = Score::new(
            &truth(&known),
            &known,
            &[patched_background(known.photo.size(), 1)],
        );
        let all = [
            score.sad,
            score.mse,
            score.gradient,
            score.mae_lit,
            score.mae_shaded,
            score.residue,
            1.0 - score.iou,
        ];
        assert!(all.iter().all(|e| e.abs() < 1e-6), "{score:?}");
        assert!(score.psnr_lit > 100.0 && score.box_px <= 2.0, "{score:?}");
    }

    #[test]
    fn errors_are_those_of_the_definition() {
        let known = known();
        let mut cut = truth(&known);
        // A tenth too opaque everywhere: on a background of 1, a tenth too dark.
        cut.film = cut.film.map(|f| Film {
            color: f.color,
            opacity: f.opacity.map(|o| o + 0.1),
        });
        let score = Score::new(&cut, &known, &[Image::filled(160, 100, LinearRgb::WHITE)]);
        assert!(
            (score.mse - 0.01).abs() < 1e-5 && (score.sad - 1.6).abs() < 1e-3,
            "{score:?}"
        );
        assert!(
            (score.mae_lit - 0.1).abs() < 1e-5 && (score.psnr_lit - 20.0).abs() < 1e-2,
            "{score:?}"
        );
        assert!(
            (score.residue - 0.1).abs() < 1e-5 && score.mae_shaded < 1e-6,
            "{score:?}"
        );
    }
}
