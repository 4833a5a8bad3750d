//! Errors of a cut-out against what is known.

use super::method::Cut;
use super::truth::Known;
use petcomp::Image;
use petcomp::filter;
use petcomp::geom::Point2;
use petcomp::{Coverage, Film, LinearRgb};

/// Errors of one cut-out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Sum of absolute differences of alpha, thousands of pixels.
    pub sad: f64,
    /// Mean squared difference of alpha.
    pub mse: f64,
    /// Sum of squared differences of the gradient's length of alpha, thousands.
    pub gradient: f64,
    /// Mean absolute error over new backgrounds that are lit by themselves (F + V B), linear light.
    pub mae_lit: f64,
    /// The same as a peak signal-to-noise ratio, decibels for a peak of 1.
    pub psnr_lit: f64,
    /// Mean absolute error over new backgrounds in the object's own shadow (F + T B), linear light.
    pub mae_shaded: f64,
    /// The same as a peak signal-to-noise ratio.
    pub psnr_shaded: f64,
    /// Mean alpha where there is no object.
    pub residue: f64,
    /// Intersection over union of the outline.
    pub iou: f64,
    /// Largest error of a side of the hull's box, pixels.
    pub box_px: f64,
}

impl Score {
    pub(super) fn new(found: &Cut, known: &Known, backgrounds: &[Image<LinearRgb>]) -> Self {
        let alpha = found.film.map(|f| Coverage(f.to_rgba().a));
        let truth = known.view.map(|v| Coverage(1.0 - (v.r + v.g + v.b) / 3.0));
        let off = |a: Coverage, b: Coverage| f64::from(a.0) - f64::from(b.0);
        let n = alpha.pixels().len().max(1) as f64;
        let differences = || {
            alpha
                .pixels()
                .iter()
                .zip(truth.pixels())
                .map(|(a, b)| off(*a, *b))
        };
        let slopes = gradient(&alpha)
            .into_iter()
            .zip(gradient(&truth))
            .map(|(a, b)| (a - b) * (a - b));
        let lit = |f: Film, _, b| f.over_color(b);
        let shaded = |f: Film, t: LinearRgb, b: LinearRgb| f.color + t * b;
        let [mae_lit, psnr_lit] = recomposite(found, known, &known.view, backgrounds, lit);
        let [mae_shaded, psnr_shaded] =
            recomposite(found, known, &known.transmittance, backgrounds, shaded);
        Self {
            sad: differences().map(f64::abs).sum::<f64>() / THOUSAND,
            mse: differences().map(|d| d * d).sum::<f64>() / n,
            gradient: slopes.sum::<f64>() / THOUSAND,
            mae_lit,
            psnr_lit,
            mae_shaded,
            psnr_shaded,
            residue: residue(&alpha, &known.mask),
            iou: overlap(&found.outline, &known.mask),
            box_px: box_error(&found.found.hull, known.box_px),
        }
    }
}

const THOUSAND: f64 = 1000.0;
/// Width of the derivative whose length is the gradient, pixels ([Rhemann et al. 2009]).
///
/// [Rhemann et al. 2009]: https://doi.org/10.1109/CVPR.2009.5206503
const GRADIENT_SIGMA_PX: f32 = 1.4;

/// Length of the gradient of the blurred picture, by central differences.
fn gradient(alpha: &Image<Coverage>) -> Vec<f64> {
    let smooth = filter::gaussian_blur(alpha, GRADIENT_SIGMA_PX);
    let at = |x: usize, y: usize, dx: isize, dy: isize| {
        f64::from(smooth.nearest(x as isize + dx, y as isize + dy).0)
    };
    let half = |a: f64, b: f64| 0.5 * (a - b);
    let (w, h) = alpha.size();
    let along = |i: usize| {
        let (x, y) = (i % w, i / w);
        libm::hypot(
            half(at(x, y, 1, 0), at(x, y, -1, 0)),
            half(at(x, y, 0, 1), at(x, y, 0, -1)),
        )
    };
    (0..w * h).map(along).collect()
}

/// Mean absolute error and peak signal-to-noise ratio over all backgrounds.
fn recomposite(
    found: &Cut,
    known: &Known,
    passes: &Image<LinearRgb>,
    backgrounds: &[Image<LinearRgb>],
    over: impl Fn(Film, LinearRgb, LinearRgb) -> LinearRgb,
) -> [f64; 2] {
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0u64);
    for background in backgrounds {
        for i in 0..background.pixels().len() {
            let b = background.pixels()[i];
            let ours: [f32; 3] =
                over(found.film.pixels()[i], found.transmittance.pixels()[i], b).into();
            let truth: [f32; 3] = (known.foreground.pixels()[i] + passes.pixels()[i] * b).into();
            for (a, b) in ours.into_iter().zip(truth) {
                let d = f64::from(a) - f64::from(b);
                (sum, squares, count) = (sum + d.abs(), squares + d * d, count + 1);
            }
        }
    }
    let n = count.max(1) as f64;
    [
        sum / n,
        -10.0 * libm::log10((squares / n).max(f64::MIN_POSITIVE)),
    ]
}

/// Mean alpha where the object covers nothing.
fn residue(alpha: &Image<Coverage>, mask: &Image<Coverage>) -> f64 {
    let outside = alpha
        .pixels()
        .iter()
        .zip(mask.pixels())
        .filter(|(_, m)| m.0 == 0.0);
    let (sum, count) = outside.fold((0.0, 0u64), |(sum, n), (a, _)| {
        (sum + f64::from(a.0), n + 1)
    });
    sum / count.max(1) as f64
}

/// Intersection over union of what is covered by at least a half.
pub(crate) fn overlap(a: &Image<Coverage>, b: &Image<Coverage>) -> f64 {
    let pairs = a
        .pixels()
        .iter()
        .zip(b.pixels())
        .map(|(a, b)| (a.0 >= 0.5, b.0 >= 0.5));
    let (both, any) = pairs.fold((0u64, 0u64), |(both, any), (a, b)| {
        (both + u64::from(a && b), any + u64::from(a || b))
    });
    both as f64 / any.max(1) as f64
}

/// The side of a hull's box that is farthest from left, top, right or bottom.
pub(super) fn box_error(hull: &[Point2<f64>], truth: [f64; 4]) -> f64 {
    let low = |along: fn(&Point2<f64>) -> f64| hull.iter().map(along).fold(f64::INFINITY, f64::min);
    let high =
        |along: fn(&Point2<f64>) -> f64| hull.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
    let sides = [low(|p| p.x), low(|p| p.y), high(|p| p.x), high(|p| p.y)];
    sides
        .iter()
        .zip(truth)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::{background, truth::SensorNoise};
    use super::*;
    use petcomp::matte::{SegmentOptions, segment};

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    /// A slab of clear film with an opaque bar on an even screen.
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
            SensorNoise {
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

    fn truth(known: &Known) -> Cut {
        Cut {
            film: known.foreground.zip_map(&known.view, Film::new),
            transmittance: known.transmittance.clone(),
            outline: known.mask.clone(),
            found: segment(&known.photo, &SegmentOptions::default()).unwrap(),
        }
    }

    #[test]
    fn the_truth_has_no_error() {
        let known = known();
        let score = Score::new(&truth(&known), &known, &[background(known.photo.size(), 1)]);
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
