//! The result of a comparison.

use super::{Thresholds, is_same};
use std::fmt;

/// The outcome of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No significant difference.
    Match,
    /// Differences above the warning thresholds.
    Warning,
    /// Differences above the failure thresholds.
    Failure,
    /// Not pictures of the same size.
    Incomparable,
    /// A file could not be read; never the outcome of a comparison, listed here to keep all exit
    /// codes in one place.
    Unreadable,
}

impl Verdict {
    /// The exit status of `idiff`: 0, 1, 2, 3, 4 in the order of the variants.
    pub fn exit_code(self) -> u8 {
        self as u8
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Match => "PASS",
            Self::Warning => "WARNING",
            Self::Failure => "FAILURE",
            Self::Incomparable => "FAILURE: the pictures differ in size",
            Self::Unreadable => "FAILURE: a picture cannot be read",
        })
    }
}

/// The statistics of two pictures' differences and a verdict; [`Display`](fmt::Display) gives the
/// lines that `idiff` prints.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The overall verdict.
    pub verdict: Verdict,
    /// Mean absolute difference of all channels of all pixels, without non-finite differences.
    pub mean_error: f64,
    /// Root of the mean squared difference, also without non-finite ones.
    pub rms_error: f64,
    /// Peak signal to noise ratio in decibels; the peak is the largest value of both pictures, at
    /// least 1.
    pub psnr: f64,
    /// The largest difference; infinite where a value is non-finite in only one picture.
    pub max_error: f64,
    /// Where it is; `None` where nothing differs.
    pub largest: Option<Largest>,
    /// Number of pixels over the warning threshold.
    pub warned: usize,
    /// Number of pixels over the failure threshold.
    pub failed: usize,
    /// Number of pixels.
    pub pixels: usize,
    /// The thresholds used.
    pub thresholds: Thresholds,
}

/// The largest difference, the first one in reading order.
#[derive(Clone, Debug, PartialEq)]
pub struct Largest {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Name of the channel.
    pub channel: &'static str,
    /// All channels of the pixel in the first picture and in the second.
    pub values: [Vec<f32>; 2],
}

impl Comparison {
    /// For pictures that differ in size.
    pub(super) fn incomparable() -> Self {
        let nothing = Self::new(DifferenceTally::default(), &[], 0, &Thresholds::default());
        Self {
            verdict: Verdict::Incomparable,
            ..nothing
        }
    }

    pub(super) fn new(
        tally: DifferenceTally,
        names: &[&'static str],
        pixels: usize,
        thresholds: &Thresholds,
    ) -> Self {
        let values = (pixels * names.len()).max(1) as f64;
        let rms_error = (tally.squares / values).sqrt();
        Self {
            verdict: tally.verdict(pixels, thresholds),
            mean_error: tally.errors / values,
            rms_error,
            psnr: tally.psnr_db(rms_error),
            max_error: tally.max_error,
            warned: tally.warned,
            failed: tally.failed,
            pixels,
            thresholds: *thresholds,
            largest: tally.into_largest(names),
        }
    }
}

/// Sums over a part of the pictures.
#[derive(Debug)]
pub(super) struct DifferenceTally {
    errors: f64,
    squares: f64,
    peak: f32,
    max_error: f64,
    /// Column, row, channel.
    largest: Option<[usize; 3]>,
    values: [Vec<f32>; 2],
    warned: usize,
    failed: usize,
}

impl Default for DifferenceTally {
    fn default() -> Self {
        Self {
            errors: 0.0,
            squares: 0.0,
            peak: 1.0,
            max_error: 0.0,
            largest: None,
            values: Default::default(),
            warned: 0,
            failed: 0,
        }
    }
}

impl DifferenceTally {
    /// Adds one pixel of both pictures.
    #[inline]
    pub(super) fn add_pixel(
        &mut self,
        a: &[f32],
        b: &[f32],
        [x, y]: [usize; 2],
        thresholds: &Thresholds,
    ) {
        let (mut warned, mut failed) = (false, false);
        for (channel, (&u, &v)) in a.iter().zip(b).enumerate() {
            let error = self.add_error(u, v);
            if error > self.max_error {
                self.max_error = error;
                self.largest = Some([x, y, channel]);
                self.values = [a.to_vec(), b.to_vec()];
            }
            let relative = relative_error(error, u, v);
            warned |= thresholds.is_warned(error, relative);
            failed |= thresholds.is_failed(error, relative);
        }
        self.warned += usize::from(warned);
        self.failed += usize::from(failed);
    }

    /// Adds one value of both pictures and returns their distance.
    #[inline(always)]
    fn add_error(&mut self, u: f32, v: f32) -> f64 {
        if is_same(u, v) {
            if u.is_finite() {
                self.peak = self.peak.max(u);
            }
            return 0.0;
        }
        if !(u.is_finite() && v.is_finite()) {
            return f64::INFINITY;
        }
        self.add_finite_error(u, v)
    }

    #[inline]
    fn add_finite_error(&mut self, u: f32, v: f32) -> f64 {
        self.peak = self.peak.max(u).max(v);
        let error = f64::from((u - v).abs());
        self.errors += error;
        self.squares += error * error;
        error
    }

    fn psnr_db(&self, rms_error: f64) -> f64 {
        20.0 * libm::log10(f64::from(self.peak) / rms_error)
    }

    fn into_largest(self, names: &[&'static str]) -> Option<Largest> {
        self.largest.map(|[x, y, channel]| Largest {
            x,
            y,
            channel: names[channel],
            values: self.values,
        })
    }

    /// This part followed by the next one in reading order.
    pub(super) fn then(self, next: Self) -> Self {
        let (largest, values, max_error) = if next.max_error > self.max_error {
            (next.largest, next.values, next.max_error)
        } else {
            (self.largest, self.values, self.max_error)
        };
        Self {
            errors: self.errors + next.errors,
            squares: self.squares + next.squares,
            peak: self.peak.max(next.peak),
            warned: self.warned + next.warned,
            failed: self.failed + next.failed,
            max_error,
            largest,
            values,
        }
    }

    fn verdict(&self, pixels: usize, t: &Thresholds) -> Verdict {
        if self.failed <= t.allow_failures {
            Verdict::Match
        } else if self.is_failure(pixels, t) {
            Verdict::Failure
        } else if self.is_warning(pixels, t) {
            Verdict::Warning
        } else {
            Verdict::Match
        }
    }

    fn is_failure(&self, pixels: usize, t: &Thresholds) -> bool {
        exceeds(self.failed, t.fail_percent, pixels) || self.max_error > t.hard_fail.into()
    }

    fn is_warning(&self, pixels: usize, t: &Thresholds) -> bool {
        exceeds(self.warned, t.warn_percent, pixels) || self.max_error > t.hard_warn.into()
    }
}

/// Whether a count is more than this percentage of the pixels.
fn exceeds(count: usize, percent: f32, pixels: usize) -> bool {
    count as f64 > f64::from(percent) / 100.0 * pixels as f64
}

/// An error as a fraction of the mean magnitude of two values; an infinite error is kept as it is.
#[inline(always)]
fn relative_error(error: f64, u: f32, v: f32) -> f64 {
    if error < f64::INFINITY {
        error / (0.5 * (f64::from(u.abs()) + f64::from(v.abs())))
    } else {
        error
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.verdict == Verdict::Incomparable {
            return write!(f, "{}", self.verdict);
        }
        self.write_errors(f)?;
        self.write_share(f, self.warned, self.thresholds.warn)?;
        self.write_share(f, self.failed, self.thresholds.fail)?;
        write!(f, "{}", self.verdict)
    }
}

impl Comparison {
    /// The line about the pixels over a threshold.
    fn write_share(&self, f: &mut fmt::Formatter<'_>, count: usize, threshold: f32) -> fmt::Result {
        let percent = general_format(self.percent(count), 3);
        let threshold = short(threshold.into());
        writeln!(f, "  {count} pixels ({percent}%) over {threshold}")
    }

    fn write_errors(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  Mean error = {}", short(self.mean_error))?;
        writeln!(f, "  RMS error = {}", short(self.rms_error))?;
        writeln!(f, "  Peak SNR = {}", short(self.psnr))?;
        write!(f, "  Max error  = {}", short(self.max_error))?;
        if let Some(largest) = &self.largest {
            write!(f, " @ {largest}")?;
        }
        writeln!(f)
    }

    /// A count as a percentage of the pixels.
    fn percent(&self, count: usize) -> f64 {
        100.0 * count as f64 / self.pixels.max(1) as f64
    }
}

impl fmt::Display for Largest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x, y, channel, .. } = self;
        let [a, b] = self.values.each_ref().map(|values| listed_values(values));
        write!(f, "({x}, {y}, {channel})  values are {a} vs {b}")
    }
}

fn listed_values(values: &[f32]) -> String {
    let values: Vec<String> = values.iter().map(f32::to_string).collect();
    values.join(", ")
}

/// A number with as many digits as `idiff` prints.
fn short(x: f64) -> String {
    general_format(x, 6)
}

/// A number with some significant digits, formatted like C's `%g`: no trailing zeros, an exponent
/// where it is shorter.
fn general_format(x: f64, digits: usize) -> String {
    let scientific = format!("{x:.*e}", digits - 1);
    let Some((mantissa, exponent)) = scientific.split_once('e') else {
        return scientific.to_lowercase();
    };
    let exponent: i32 = exponent.parse().unwrap_or_default();
    if (-4..digits as i32).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent) as usize;
        return without_trailing_zeros(&format!("{x:.decimals$}")).into();
    }
    scientific_format(mantissa, exponent)
}

/// With a sign and two digits in the exponent, as in C.
fn scientific_format(mantissa: &str, exponent: i32) -> String {
    let sign = if exponent < 0 { '-' } else { '+' };
    let mantissa = without_trailing_zeros(mantissa);
    format!("{mantissa}e{sign}{:02}", exponent.abs())
}

fn without_trailing_zeros(number: &str) -> &str {
    if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        number
    }
}

impl Thresholds {
    #[inline]
    fn is_warned(&self, error: f64, relative: f64) -> bool {
        error > self.warn.into() && relative > self.warn_relative.into()
    }

    #[inline]
    fn is_failed(&self, error: f64, relative: f64) -> bool {
        error > self.fail.into() && relative > self.fail_relative.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_c_writes_them() {
        for (x, text) in [
            (0.0, "0"),
            (1e-6, "1e-06"),
            (0.008_333_333, "0.00833333"),
            (28.573_32, "28.5733"),
            (120.0, "120"),
            (1_234_567.0, "1.23457e+06"),
            (-0.2, "-0.2"),
            (999_999.7, "1e+06"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "nan"),
        ] {
            assert_eq!(general_format(x, 6), text);
        }
        assert_eq!(
            (general_format(16.6667, 3), general_format(100.0, 3)),
            ("16.7".into(), "100".into())
        );
    }

    #[test]
    fn exit_codes_are_those_of_idiff() {
        let all = [
            Verdict::Match,
            Verdict::Warning,
            Verdict::Failure,
            Verdict::Incomparable,
            Verdict::Unreadable,
        ];
        assert_eq!(all.map(Verdict::exit_code), [0, 1, 2, 3, 4]);
    }
}
