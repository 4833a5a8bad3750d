//! A range of numbers, which recipes have in place of a single number.

use crate::bounds::{Bounds, number};
use crate::error::{Error, Result};
use crate::scene::{Distribution, Draws};
use serde::{Deserialize, Serialize};

/// A quantity drawn anew for every use, uniformly between two numbers.
///
/// In files `[min, max]`, or one number for a fixed quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "RangeInFile", into = "RangeInFile")]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number or [min, max]")]
enum RangeInFile {
    Fixed(f64),
    Between([f64; 2]),
}

impl From<RangeInFile> for Range {
    fn from(written: RangeInFile) -> Self {
        match written {
            RangeInFile::Fixed(x) => Self::fixed(x),
            RangeInFile::Between([min, max]) => Self::new(min, max),
        }
    }
}

impl From<Range> for RangeInFile {
    fn from(range: Range) -> Self {
        if range.min == range.max {
            Self::Fixed(range.min)
        } else {
            Self::Between([range.min, range.max])
        }
    }
}

impl Default for Range {
    /// Always 0.
    fn default() -> Self {
        Self::fixed(0.0)
    }
}

impl Range {
    /// Uniform from `min` to `max`.
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    /// Always `x`.
    pub const fn fixed(x: f64) -> Self {
        Self { min: x, max: x }
    }

    /// Its middle: the value of a quantity that is not to vary.
    pub fn middle(&self) -> Self {
        Self::fixed((self.min + self.max) / 2.0)
    }

    /// The range multiplied by a factor.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self::new(self.min * factor, self.max * factor)
    }

    /// The value at a path.
    pub fn draw(&self, draws: &Draws, path: &str) -> f64 {
        let value = self.min + (self.max - self.min) * draws.unit(path);
        draws.note(path, Distribution::Uniform([self.min, self.max]), value);
        value
    }

    /// Whether an event of this probability happens; nothing is drawn if it never does.
    pub(super) fn chance(share: f64, draws: &Draws, path: &str) -> bool {
        share > 0.0 && Self::new(0.0, 1.0).draw(draws, path) < share
    }

    /// Whether it contains only 0.
    pub(super) fn is_zero(&self) -> bool {
        *self == Self::fixed(0.0)
    }

    /// The value at a path; nothing is drawn if there is no range.
    pub(super) fn draw_optional(range: Option<Self>, draws: &Draws, path: &str) -> Option<f64> {
        range.map(|range| range.draw(draws, path))
    }

    /// As [`check`](Self::check), if there is a range.
    pub(super) fn check_optional(range: Option<Self>, at: &str, bounds: &Bounds) -> Result<()> {
        range.map_or(Ok(()), |range| range.check(at, bounds))
    }

    /// The value of a field at a path.
    pub(super) fn draw_field(&self, draws: &Draws, path: &str, field: &str) -> f64 {
        self.draw(draws, &format!("{path}.{field}"))
    }

    /// The integer at a path, every one of `min..=max` equally likely.
    pub fn draw_count(&self, draws: &Draws, path: &str) -> usize {
        let count = self.min as usize + draws.below(path, (self.max - self.min) as usize + 1);
        draws.note(
            path,
            Distribution::Whole([self.min, self.max]),
            count as f64,
        );
        count
    }

    /// Fails unless `min <= max`, both within bounds.
    pub(crate) fn check(&self, at: &str, bounds: &Bounds) -> Result<()> {
        let Self { min, max } = *self;
        if min == max {
            return bounds.check(at, min);
        }
        if min < max && bounds.contains(min) && bounds.contains(max) {
            return Ok(());
        }
        let question = bounds.question(max);
        let (min, max) = (number(min), number(max));
        let what = format!("[{min}, {max}], expected [min, max] within {bounds}{question}");
        Err(Error::value(at, what))
    }

    /// Fails unless both ends are integers within bounds.
    pub(crate) fn check_count(&self, at: &str, bounds: &Bounds) -> Result<()> {
        self.check(at, bounds)?;
        let Self { min, max } = *self;
        if min.fract() == 0.0 && max.fract() == 0.0 {
            return Ok(());
        }
        let what = format!("[{min}, {max}], expected integers");
        Err(Error::value(at, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        x: Range,
    }

    #[test]
    fn a_file_says_a_number_or_two() {
        let read = |text| toml::from_str::<File>(text).map(|f| f.x);
        assert_eq!(read("x = 3").unwrap(), Range::fixed(3.0));
        assert_eq!(read("x = [1, 2.5]").unwrap(), Range::new(1.0, 2.5));
        let message = read("x = 'wide'").unwrap_err().to_string();
        assert!(
            message.contains("expected a number or [min, max]"),
            "{message}"
        );
    }

    #[test]
    fn writing_and_reading_gives_the_same_range() {
        for x in [Range::fixed(0.1), Range::new(-1.0, 2.0)] {
            let text = toml::to_string(&File { x }).unwrap();
            assert_eq!(toml::from_str::<File>(&text).unwrap().x, x);
        }
    }

    #[test]
    fn draws_stay_inside_and_reach_both_ends() {
        let range = Range::new(-2.0, 3.0);
        let all: Vec<f64> = (0..5000)
            .map(|k| range.draw(&Draws::new(0, k), "x"))
            .collect();
        assert!(all.iter().all(|x| (-2.0..3.0).contains(x)));
        assert!(all.iter().any(|x| *x < -1.98) && all.iter().any(|x| *x > 2.98));
    }

    #[test]
    fn counts_include_both_ends() {
        let counts: Vec<usize> = (0..200)
            .map(|k| Range::new(2.0, 4.0).draw_count(&Draws::new(0, k), "n"))
            .collect();
        assert_eq!(
            (counts.iter().min(), counts.iter().max()),
            (Some(&2), Some(&4))
        );
    }

    #[test]
    fn a_range_that_cannot_be_right_is_told() {
        let scale = Bounds::new(0.0, 9.0, "");
        let reported = |e: Result<()>| e.unwrap_err().to_string();
        let expected = "scale: [2, 1], expected [min, max] within 0 to 9";
        assert_eq!(
            reported(Range::new(2.0, 1.0).check("scale", &scale)),
            expected
        );
        assert_eq!(
            reported(Range::fixed(-1.0).check("scale", &scale)),
            "scale: -1, expected 0 to 9"
        );
        assert!(Range::fixed(f64::NAN).check("scale", &scale).is_err());
        let printed = reported(Range::new(1.0, 2.5).check_count("objects", &scale));
        assert_eq!(printed, "objects: [1, 2.5], expected integers");
        let gap = Range::new(5.0, 20.0).check("gap", &Bounds::metres(0.0, 1.0, ""));
        assert_eq!(
            reported(gap),
            "gap: [5, 20], expected [min, max] within 0 to 1 m; is it in centimetres?"
        );
    }
}
