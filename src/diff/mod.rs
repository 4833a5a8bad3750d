//! Comparing two pictures the way OpenImageIO's `idiff` does.
//!
//! ```
//! use petcomp::{Coverage, Image, diff};
//! let (a, b) = (Image::filled(4, 3, Coverage(0.5)), Image::filled(4, 3, Coverage(0.6)));
//! let tight = diff::compare(&a, &b, &diff::Thresholds::default());
//! let loose = diff::Thresholds { fail: 0.2, ..Default::default() };
//! assert_eq!(tight.verdict.exit_code(), 2);
//! assert_eq!(diff::compare(&a, &b, &loose).verdict, diff::Verdict::Match);
//! ```

mod bands;
mod flip;
mod likeness;
mod report;
mod ssim;
#[cfg(test)]
mod test_pictures;
mod view;

#[doc(hidden)]
pub use bands::{RowSource, RowsFromFn};
pub use flip::flip;
#[doc(hidden)]
pub use likeness::Likeness;
pub use report::Comparison;
#[doc(hidden)]
pub use report::{Largest, Verdict};
pub use ssim::ssim;
#[doc(hidden)]
pub use view::{absolute_difference, triple};

use crate::pixel::{Coverage, Depth, LinearRgb, PremulRgba, StraightRgba};
use bands::bands;
use rayon::prelude::*;
use report::DifferenceTally;

/// How much two pictures may differ: the options of `idiff`, by the same names.
///
/// A pixel fails if any of its channels does, and counts once.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Thresholds {
    /// A channel fails when it differs by more than this. Default: 1e-6.
    pub fail: f32,
    /// And by more than this fraction of the mean of both magnitudes. Default: 0.
    pub fail_relative: f32,
    /// Percentage of pixels that may fail. Default: 0.
    pub fail_percent: f32,
    /// No channel may differ by more than this, however few fail. Default: infinite.
    pub hard_fail: f32,
    /// Number of pixels that may fail by any amount. Default: 0.
    pub allow_failures: usize,
    /// As `fail`, for a warning. Default: 1e-6.
    pub warn: f32,
    /// As `fail_relative`, for a warning. Default: 0.
    pub warn_relative: f32,
    /// As `fail_percent`, for a warning. Default: 0.
    pub warn_percent: f32,
    /// As `hard_fail`, for a warning. Default: infinite.
    pub hard_warn: f32,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            fail: 1e-6,
            fail_relative: 0.0,
            fail_percent: 0.0,
            hard_fail: f32::INFINITY,
            allow_failures: 0,
            warn: 1e-6,
            warn_relative: 0.0,
            warn_percent: 0.0,
            hard_warn: f32::INFINITY,
        }
    }
}

/// Pixels that consist of a few floats, each with a name.
#[doc(hidden)]
pub trait NamedChannels: bytemuck::Pod + Send + Sync {
    /// The names, in memory order.
    const NAMES: &'static [&'static str];
}

impl NamedChannels for LinearRgb {
    const NAMES: &'static [&'static str] = &["R", "G", "B"];
}
impl NamedChannels for PremulRgba {
    const NAMES: &'static [&'static str] = &["R", "G", "B", "A"];
}
impl NamedChannels for StraightRgba {
    const NAMES: &'static [&'static str] = &["R", "G", "B", "A"];
}
impl NamedChannels for Coverage {
    const NAMES: &'static [&'static str] = &["A"];
}
impl NamedChannels for f32 {
    const NAMES: &'static [&'static str] = &["Y"];
}
impl NamedChannels for Depth {
    const NAMES: &'static [&'static str] = &["Z"];
}
/// Values without a defined meaning, such as encoded ones.
impl NamedChannels for [f32; 4] {
    const NAMES: &'static [&'static str] = &["R", "G", "B", "A"];
}

/// Compares two pictures channel by channel.
///
/// Pictures of different size are [`Verdict::Incomparable`]. Takes [`Image`](crate::Image)s, or
/// anything else that implements [`RowSource`].
///
/// # Method
/// The counts and the verdict of `idiff` 2.4.7: with up to `allow_failures` failing pixels the
/// pictures match, whatever the other thresholds; beyond that they fail by `fail_percent` or
/// `hard_fail`, or else warn by `warn_percent` or `hard_warn`. Departs from it where it would let a
/// broken picture pass: a NaN or an infinity that the other picture does not have in the same place
/// and with the same sign counts as an infinite difference (`idiff` skips the first one), and
/// pictures of different size are not compared (`idiff` pads the smaller one with zeros).
pub fn compare<P: NamedChannels>(
    a: &impl RowSource<P>,
    b: &impl RowSource<P>,
    thresholds: &Thresholds,
) -> Comparison {
    let (width, height) = a.size();
    if (width, height) != b.size() {
        return Comparison::incomparable();
    }
    let tallies = bands((width, height)).flat_map(|band| {
        let (a, b) = (a.read_rows(band.clone()), b.read_rows(band.clone()));
        let rows = band.clone().into_par_iter().map(|y| (y, y - band.start));
        rows.map(|(y, i)| compare_rows(a.row(i), b.row(i), y, thresholds))
            .collect::<Vec<DifferenceTally>>()
    });
    let tally = tallies.fold(DifferenceTally::default(), DifferenceTally::then);
    Comparison::new(tally, P::NAMES, width * height, thresholds)
}

fn compare_rows<P: NamedChannels>(
    a: &[P],
    b: &[P],
    y: usize,
    thresholds: &Thresholds,
) -> DifferenceTally {
    let count = P::NAMES.len();
    let [a, b] = [a, b].map(bytemuck::cast_slice::<P, f32>);
    let mut tally = DifferenceTally::default();
    for (x, (a, b)) in a.chunks_exact(count).zip(b.chunks_exact(count)).enumerate() {
        tally.add_pixel(a, b, [x, y], thresholds);
    }
    tally
}

/// Whether two channels are equal; NaN equals NaN.
#[inline]
fn is_same(u: f32, v: f32) -> bool {
    u == v || (u.is_nan() && v.is_nan())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    /// Black, 4 x 3, with the given red values.
    fn picture(reds: &[(usize, usize, f32)]) -> Image<LinearRgb> {
        let mut img = Image::new(4, 3);
        for &(x, y, r) in reds {
            img[(x, y)] = LinearRgb::new(r, 0.0, 0.0);
        }
        img
    }

    fn verdict(reds: &[(usize, usize, f32)], thresholds: Thresholds) -> Verdict {
        compare(&picture(&[]), &picture(reds), &thresholds).verdict
    }

    const TWO: [(usize, usize, f32); 2] = [(2, 1, 0.2), (1, 2, -0.1)];

    #[test]
    fn a_picture_matches_itself_even_with_nan_and_infinity() {
        let strange = picture(&[
            (0, 0, f32::NAN),
            (1, 0, f32::INFINITY),
            (2, 0, f32::NEG_INFINITY),
        ]);
        let report = compare(&strange, &strange, &Thresholds::default());
        assert_eq!(report.verdict, Verdict::Match);
        assert_eq!((report.max_error, report.psnr), (0.0, f64::INFINITY));
    }

    /// The numbers are those that `idiff` 2.4.7.1 printed for the same two pictures.
    #[test]
    fn statistics_are_those_of_idiff() {
        let report = compare(&picture(&[]), &picture(&TWO), &Thresholds::default());
        assert!((report.mean_error - 0.008_333_33).abs() < 1e-8);
        assert!((report.rms_error - 0.037_267_8).abs() < 1e-7);
        assert!((report.psnr - 28.573_3).abs() < 1e-4);
        let largest = report.largest.unwrap();
        assert_eq!((largest.x, largest.y, largest.channel), (2, 1, "R"));
        assert_eq!((report.warned, report.failed, report.pixels), (2, 2, 12));
    }

    #[test]
    fn verdicts_are_those_of_idiff() {
        let d = Thresholds::default();
        for (thresholds, expected) in [
            (d, Verdict::Failure),
            (Thresholds { fail: 0.15, ..d }, Verdict::Failure),
            (
                Thresholds {
                    fail_percent: 20.0,
                    ..d
                },
                Verdict::Warning,
            ),
            (
                Thresholds {
                    fail_percent: 16.666,
                    ..d
                },
                Verdict::Failure,
            ),
            (
                Thresholds {
                    fail_percent: 20.0,
                    hard_fail: 0.15,
                    ..d
                },
                Verdict::Failure,
            ),
            (
                Thresholds {
                    fail_percent: 20.0,
                    warn_percent: 20.0,
                    ..d
                },
                Verdict::Match,
            ),
            (
                Thresholds {
                    fail_percent: 20.0,
                    warn: 1.0,
                    hard_warn: 0.1,
                    ..d
                },
                Verdict::Warning,
            ),
            (
                Thresholds {
                    allow_failures: 2,
                    hard_fail: 0.1,
                    ..d
                },
                Verdict::Match,
            ),
            (
                Thresholds {
                    allow_failures: 1,
                    ..d
                },
                Verdict::Failure,
            ),
            (
                Thresholds {
                    allow_failures: 1,
                    fail_percent: 10.0,
                    ..d
                },
                Verdict::Failure,
            ),
            (
                Thresholds {
                    fail: 1.0,
                    warn: 0.05,
                    ..d
                },
                Verdict::Match,
            ),
            (
                Thresholds {
                    fail: 1.0,
                    hard_warn: 0.1,
                    ..d
                },
                Verdict::Match,
            ),
        ] {
            assert_eq!(verdict(&TWO, thresholds), expected, "{thresholds:?}");
        }
    }

    #[test]
    fn relative_thresholds_are_parts_of_the_mean_magnitude() {
        let one = |v| Image::filled(1, 1, Coverage(v));
        let fails = |a, b, fail_relative| {
            let thresholds = Thresholds {
                fail_relative,
                ..Default::default()
            };
            compare(&one(a), &one(b), &thresholds).verdict == Verdict::Failure
        };
        for (a, b, part) in [
            (1.0, 1.2, 0.2 / 1.1),
            (1.2, 1.0, 0.2 / 1.1),
            (10.0, 12.0, 2.0 / 11.0),
            (-1.0, 1.0, 2.0),
        ] {
            assert!(
                fails(a, b, part - 1e-3) && !fails(a, b, part + 1e-3),
                "{a} {b}"
            );
        }
    }

    #[test]
    fn a_difference_equal_to_the_threshold_passes() {
        assert_eq!(
            verdict(&[(0, 0, 1e-6)], Thresholds::default()),
            Verdict::Match
        );
        assert_eq!(
            verdict(&[(0, 0, 1e-6_f32.next_up())], Thresholds::default()),
            Verdict::Failure
        );
    }

    #[test]
    fn nan_against_a_number_fails_at_any_threshold() {
        for strange in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let loose = Thresholds {
                fail: f32::MAX,
                warn: f32::MAX,
                ..Default::default()
            };
            assert_eq!(verdict(&[(0, 0, strange)], loose), Verdict::Failure);
        }
        let [up, down] = [f32::INFINITY, f32::NEG_INFINITY].map(|v| picture(&[(0, 0, v)]));
        let report = compare(&up, &down, &Thresholds::default());
        assert_eq!(
            (report.verdict, report.max_error, report.mean_error),
            (Verdict::Failure, f64::INFINITY, 0.0)
        );
    }

    #[test]
    fn different_sizes_are_not_compared() {
        let report = compare(&picture(&[]), &Image::new(4, 2), &Thresholds::default());
        assert_eq!(report.verdict.exit_code(), 3);
    }

    /// Three bands and a row, with the largest difference in the last.
    #[test]
    fn large_pictures_are_compared_in_bands() {
        let (width, height) = (1 << 14, 3 * 64 + 1);
        let rows = |last: f32| RowsFromFn {
            size: (width, height),
            make: move |rows: std::ops::Range<usize>| {
                let value = |y: usize| Coverage(if y == height - 1 { last } else { y as f32 });
                Image::from_fn(width, rows.len(), |_, y| value(rows.start + y))
            },
        };
        let report = compare(&rows(0.5), &rows(0.75), &Thresholds::default());
        let largest = report.largest.unwrap();
        assert_eq!(
            (largest.x, largest.y, report.failed, report.max_error),
            (0, height - 1, width, 0.25)
        );
        assert!((report.mean_error - 0.25 / height as f64).abs() < 1e-12);
    }

    #[test]
    fn empty_pictures_match() {
        let empty = Image::<PremulRgba>::new(0, 0);
        let report = compare(&empty, &empty, &Thresholds::default());
        assert_eq!((report.verdict, report.mean_error), (Verdict::Match, 0.0));
    }
}
