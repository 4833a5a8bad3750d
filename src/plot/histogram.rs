//! Histograms as SVG: drawn values compared with their distribution.

use super::markup::{clipped, tenths, text};
use super::number::trimmed;
use maud::{Markup, html};

/// Size of the frame of the bars, SVG units.
const FRAME_SIZE: [f64; 2] = [250.0, 110.0];
/// Margins around it for text, SVG units.
const LEFT_MARGIN: f64 = 40.0;
const RIGHT_MARGIN: f64 = 12.0;
const TOP_MARGIN: f64 = 24.0;
const BOTTOM_MARGIN: f64 = 24.0;
/// The lower end of the bars.
const BASELINE: f64 = TOP_MARGIN + FRAME_SIZE[1];
/// Width of a letter of 11 units on average, a little more than most sans-serif fonts need.
const LETTER_WIDTH: f64 = 6.0;

/// Counts in bins of equal width.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// What was counted, with its unit.
    pub title: String,
    /// Labels below the first and the last bin.
    pub ends: [String; 2],
    /// The counts.
    pub counts: Vec<u64>,
    /// Expected count per bin if all values are equally likely.
    pub expected: Option<f64>,
}

impl Histogram {
    /// Counts numbers in `bins` bins over a range; values outside count in the first or last bin.
    pub fn new(
        title: impl Into<String>,
        values: &[f64],
        [low, high]: [f64; 2],
        bins: usize,
    ) -> Self {
        let mut counts = vec![0; bins.max(1)];
        let last = counts.len() - 1;
        for value in values {
            let place = (value - low) / (high - low) * bins as f64;
            // Values below 0 and NaN become 0.
            counts[(place as usize).min(last)] += 1;
        }
        Self {
            title: title.into(),
            ends: [short_number(low), short_number(high)],
            counts,
            expected: None,
        }
    }

    /// The same with a line at the expected count for equally likely values.
    pub fn uniform(mut self) -> Self {
        self.expected =
            Some(self.counts.iter().sum::<u64>() as f64 / self.counts.len().max(1) as f64);
        self
    }

    /// An SVG document: bars, and a dashed line at the expected count with a band of two standard
    /// deviations around it.
    pub fn svg(&self) -> String {
        let width = LEFT_MARGIN + FRAME_SIZE[0] + RIGHT_MARGIN;
        html! {
            svg xmlns="http://www.w3.org/2000/svg" class="histogram" width=(width)
                height=(BASELINE + BOTTOM_MARGIN) font-family="sans-serif" font-size="11" {
                @if let Some(expected) = self.expected { (self.expected_band(expected)) }
                (self.draw_bars())
                @if let Some(expected) = self.expected {
                    path d=(line_across(&tenths(self.y(expected)))) stroke="#d55e00" stroke-dasharray="5 3" {}
                }
                path d=(line_across(&BASELINE.to_string())) stroke="#888" {}
                (self.word_labels(width))
            }
        }
        .into_string()
            + "\n"
    }

    /// The count at the top of the frame.
    fn top_count(&self) -> f64 {
        let counts = self.counts.iter().map(|&n| n as f64);
        counts.chain(self.expected).fold(1.0, f64::max) * 1.1
    }

    /// Height of a count in the drawing.
    fn y(&self, count: f64) -> f64 {
        TOP_MARGIN + FRAME_SIZE[1] * (1.0 - (count / self.top_count()).clamp(0.0, 1.0))
    }

    /// Two standard deviations on either side of the expected count.
    fn expected_band(&self, expected: f64) -> Markup {
        let spread = 2.0 * self.deviation(expected);
        let (top, bottom) = (self.y(expected + spread), self.y(expected - spread));
        html! {
            rect x=(LEFT_MARGIN) y=(tenths(top)) width=(FRAME_SIZE[0]) height=(tenths(bottom - top))
                fill="#d55e00" opacity="0.15" {}
        }
    }

    /// Standard deviation of a count if all bins are equally likely.
    fn deviation(&self, expected: f64) -> f64 {
        (expected * (1.0 - 1.0 / self.counts.len().max(1) as f64)).sqrt()
    }

    fn draw_bars(&self) -> Markup {
        let bin_width = FRAME_SIZE[0] / self.counts.len().max(1) as f64;
        html! {
            @for (i, &count) in self.counts.iter().enumerate() {
                @let x = LEFT_MARGIN + bin_width * (i as f64 + 0.05);
                @let y = self.y(count as f64);
                rect x=(format_args!("{x:.2}")) y=(tenths(y)) width=(format_args!("{:.2}", bin_width * 0.9))
                    height=(tenths(BASELINE - y)) fill="#0072b2" { title { (count) } }
            }
        }
    }

    fn word_labels(&self, width: f64) -> Markup {
        let [w, below] = [FRAME_SIZE[0], BASELINE + 14.0];
        let [low, high] = &self.ends;
        html! {
            (clipped_label([LEFT_MARGIN, TOP_MARGIN - 10.0], width - LEFT_MARGIN, "start", &self.title))
            (clipped_label([LEFT_MARGIN - 4.0, TOP_MARGIN + 8.0], LEFT_MARGIN - 4.0, "end", &short_number(self.top_count())))
            (clipped_label([LEFT_MARGIN, below], w / 2.0, "start", low))
            (clipped_label([LEFT_MARGIN + w, below], w / 2.0, "end", high))
        }
    }
}

/// A line through the frame at a height.
fn line_across(y: &str) -> String {
    format!("M{LEFT_MARGIN} {y}h{}", FRAME_SIZE[0])
}

/// A text, truncated if it does not fit; the whole appears as a tooltip.
fn clipped_label([x, y]: [f64; 2], room: f64, anchor: &str, whole: &str) -> Markup {
    html! {
        text x=(tenths(x)) y=(tenths(y)) text-anchor=(anchor) {
            (text(&clipped(whole, (room / LETTER_WIDTH) as usize))) title { (text(whole)) }
        }
    }
}

/// A number with as many digits as are useful.
fn short_number(value: f64) -> String {
    if value.abs() >= 100.0 {
        format!("{value:.0}")
    } else {
        trimmed(&format!("{value:.3}")).to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_counted_once() {
        let h = Histogram::new(
            "x",
            &[0.0, 0.1, 0.5, 0.99, 1.0, -3.0, 9.0, f64::NAN],
            [0.0, 1.0],
            4,
        );
        assert_eq!(h.counts, [4, 0, 1, 3]);
        assert_eq!(h.uniform().expected, Some(2.0));
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
        let svg = Histogram::new("a < b", &[], [0.0, 0.0], 5).uniform().svg();
        assert_eq!(svg.matches("<rect").count(), 1 + 5);
        assert!(
            !svg.contains("NaN") && !svg.contains("inf") && svg.contains("a &lt; b"),
            "{svg}"
        );
    }
}
