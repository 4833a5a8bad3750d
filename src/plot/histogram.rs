//! Histograms as SVG: what was drawn against what it was drawn from.

use super::escaped;
use std::fmt::Write;

/// Size of the bars' frame and the room around it, SVG units.
const FRAME: [f64; 2] = [250.0, 110.0];
const LEFT: f64 = 40.0;
const TOP: f64 = 24.0;
const BELOW: f64 = 24.0;
/// Width of a letter of 11 units on average, a little more than most sans-serif fonts need.
const LETTER: f64 = 6.0;

/// Counts in bins of the same width.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// What was counted, with its unit.
    pub title: String,
    /// What stands below the first and the last bin.
    pub ends: [String; 2],
    /// The counts.
    pub counts: Vec<u64>,
    /// Count that each bin should have, of values equally likely everywhere.
    pub expected: Option<f64>,
}

impl Histogram {
    /// Counts numbers in `bins` bins over a range; values outside count in the first or last bin.
    pub fn of(
        title: impl Into<String>,
        values: &[f64],
        [low, high]: [f64; 2],
        bins: usize,
    ) -> Self {
        let mut counts = vec![0; bins.max(1)];
        for value in values {
            let place = (value - low) / (high - low) * bins as f64;
            let last = counts.len() - 1;
            counts[if place > 0.0 {
                (place as usize).min(last)
            } else {
                0
            }] += 1;
        }
        let expected = None;
        Self {
            title: title.into(),
            ends: [short(low), short(high)],
            counts,
            expected,
        }
    }

    /// The same with a line at the count of values that are equally likely everywhere.
    pub fn uniform(mut self) -> Self {
        self.expected =
            Some(self.counts.iter().sum::<u64>() as f64 / self.counts.len().max(1) as f64);
        self
    }

    /// Largest distance of a bin from what it should have, in standard deviations (of a binomial count); none where
    /// nothing is expected.
    pub fn worst_deviation(&self) -> Option<f64> {
        let expected = self
            .expected
            .filter(|e| *e > 0.0 && self.counts.len() > 1)?;
        let share = 1.0 / self.counts.len() as f64;
        let deviation = (expected * (1.0 - share)).sqrt();
        self.counts
            .iter()
            .map(|&n| (n as f64 - expected).abs() / deviation)
            .reduce(f64::max)
    }

    /// An SVG document: bars, and a dashed line at what is expected with a band of two standard deviations around it.
    pub fn svg(&self) -> String {
        let [w, h] = FRAME;
        let (width, height) = (LEFT + w + 12.0, TOP + h + BELOW);
        let most = self
            .counts
            .iter()
            .map(|&n| n as f64)
            .chain(self.expected)
            .fold(1.0, f64::max)
            * 1.1;
        let y = |count: f64| TOP + h * (1.0 - (count / most).clamp(0.0, 1.0));
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"histogram\" width=\"{width}\" height=\"{height}\" \
             font-family=\"sans-serif\" font-size=\"11\">\n"
        );
        if let Some(expected) = self.expected {
            let spread = 2.0 * (expected * (1.0 - 1.0 / self.counts.len().max(1) as f64)).sqrt();
            let (top, bottom) = (y(expected + spread), y(expected - spread));
            let _ = writeln!(
                svg,
                "<rect x=\"{LEFT}\" y=\"{top:.1}\" width=\"{w}\" height=\"{:.1}\" fill=\"#d55e00\" opacity=\"0.15\"/>",
                bottom - top
            );
        }
        let wide = w / self.counts.len().max(1) as f64;
        for (i, &count) in self.counts.iter().enumerate() {
            let (x, top) = (LEFT + wide * i as f64, y(count as f64));
            let _ = writeln!(
                svg,
                "<rect x=\"{:.2}\" y=\"{top:.1}\" width=\"{:.2}\" height=\"{:.1}\" fill=\"#0072b2\"><title>{count}</title></rect>",
                x + wide * 0.05,
                wide * 0.9,
                TOP + h - top
            );
        }
        if let Some(expected) = self.expected {
            let y = y(expected);
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {y:.1}h{w}\" stroke=\"#d55e00\" stroke-dasharray=\"5 3\"/>"
            );
        }
        let line = TOP + h;
        let _ = writeln!(svg, "<path d=\"M{LEFT} {line}h{w}\" stroke=\"#888\"/>");
        let mut words = |[x, y, room]: [f64; 3], anchor: &str, text: &str| {
            let (shown, whole) = (escaped(&fitted(text, room)), escaped(text));
            let _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{shown}<title>{whole}</title></text>"
            );
        };
        words([LEFT, TOP - 10.0, width - LEFT], "start", &self.title);
        words([LEFT - 4.0, TOP + 8.0, LEFT - 4.0], "end", &short(most));
        words([LEFT, line + 14.0, w / 2.0], "start", &self.ends[0]);
        words([LEFT + w, line + 14.0, w / 2.0], "end", &self.ends[1]);
        svg + "</svg>\n"
    }
}

/// A text, cut where there is no more room for it.
fn fitted(text: &str, room: f64) -> String {
    let most = (room / LETTER) as usize;
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars()
        .take(most.saturating_sub(1))
        .chain(['\u{2026}'])
        .collect()
}

/// A number with as many digits as help.
fn short(value: f64) -> String {
    let text = if value.abs() >= 100.0 {
        format!("{value:.0}")
    } else {
        format!("{value:.3}")
    };
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_counted_once() {
        let h = Histogram::of(
            "x",
            &[0.0, 0.1, 0.5, 0.99, 1.0, -3.0, 9.0, f64::NAN],
            [0.0, 1.0],
            4,
        );
        assert_eq!(h.counts, [4, 0, 1, 3]);
        assert_eq!(h.uniform().expected, Some(2.0));
    }

    #[test]
    fn a_wrong_distribution_is_far_from_its_line() {
        let even: Vec<f64> = (0..1000).map(|i| f64::from(i) / 1000.0).collect();
        let slanted: Vec<f64> = even.iter().map(|x| x * x).collect();
        let worst = |values: &[f64]| {
            Histogram::of("x", values, [0.0, 1.0], 10)
                .uniform()
                .worst_deviation()
                .unwrap()
        };
        assert!(worst(&even) < 0.1 && worst(&slanted) > 5.0);
    }

    #[test]
    fn words_stay_in_their_cell() {
        let name = "a_photo_with_a_very_long_name_that_somebody_gave_it";
        let h = Histogram {
            title: name.into(),
            ends: [name.into(), name.into()],
            counts: vec![1; 3],
            expected: None,
        };
        let svg = h.svg();
        let shown: Vec<&str> = svg
            .split("<text")
            .skip(1)
            .map(|t| t.split(['>', '<']).nth(1).unwrap_or(""))
            .collect();
        let lengths: Vec<usize> = shown.iter().map(|text| text.chars().count()).collect();
        assert_eq!(lengths, [43, 3, 20, 20], "{shown:?}");
        assert_eq!(
            svg.matches(&format!("<title>{name}</title>")).count(),
            3,
            "the whole is there to be pointed at"
        );
    }

    #[test]
    fn a_drawing_has_a_bar_for_each_bin_and_no_nonsense() {
        let svg = Histogram::of("a < b", &[], [0.0, 0.0], 5).uniform().svg();
        assert_eq!(svg.matches("<rect").count(), 1 + 5);
        assert!(
            !svg.contains("NaN") && !svg.contains("inf") && svg.contains("a &lt; b"),
            "{svg}"
        );
    }
}
