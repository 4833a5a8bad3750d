//! Charts of curves on logarithmic or linear axes, side by side, as SVG.

use super::escaped;
use super::number::power;
use std::fmt::Write;

/// Size of the frame of a chart in a row, and of one alone, in SVG units.
const FRAME: [f64; 2] = [300.0, 260.0];
const ALONE: [f64; 2] = [620.0, 360.0];
/// The room around a frame for words.
const LEFT: f64 = 62.0;
const TOP: f64 = 40.0;
const BELOW: f64 = 48.0;
/// Width of the column of names at the right, beside its letters, and of one letter.
const NAMES: f64 = 56.0;
const LETTER: f64 = 7.0;
/// Size of the words beside points, and the room that a letter of them takes.
const LABEL: f64 = 10.0;
const LABEL_LETTER: f64 = 5.6;
/// How far a word stands from its point.
const BESIDE: f64 = 7.0;
/// Logarithmic axes on which values are up to so many times each other also have lines at 2 and 5.
const FEW_DECADES: f64 = 100.0;
/// Where logarithmic axes have lines in a decade.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];
/// What powers of ten may be off by.
const HAIR: f64 = 1e-9;
/// Colours that people with any colour vision tell apart (Okabe and Ito, "Color Universal Design").
/// Yellow, which is faint on white, comes last.
const COLORS: [&str; 8] = [
    "#000000", "#e69f00", "#56b4e9", "#009e73", "#d55e00", "#0072b2", "#cc79a7", "#f0e442",
];

/// Charts next to each other; curves of one place in the list share colour and name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// What is seen in it.
    pub title: String,
    /// What each curve is called, the same in every chart of a row.
    pub names: Vec<String>,
    /// Across.
    pub across: Axis,
    /// Upwards.
    pub up: Axis,
    /// One per name.
    pub curves: Vec<Curve>,
    /// Points with a ring around them: where the defaults are.
    pub defaults: Vec<[f64; 2]>,
}

/// What a large chart has beyond a small one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// Words beside points; those without room are left out.
    pub labels: Vec<([f64; 2], String)>,
    /// Points of one curve have nothing between them, and no line.
    pub apart: bool,
}

/// The points of a curve, from left to right; points that are not finite, or not positive on a logarithmic axis, are left out.
pub type Curve = Vec<[f64; 2]>;

/// One direction of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What it is, with its unit.
    pub title: String,
    /// Least and greatest value in the frame; both positive where it is logarithmic.
    pub range: [f64; 2],
    /// Every factor of ten is as long as another.
    pub logarithmic: bool,
}

impl Axis {
    /// A logarithmic axis over powers of ten that hold all positive values; 1 to 10 where there are none.
    pub fn over_decades(title: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let seen = values.into_iter().filter(|v| v.is_finite() && *v > 0.0);
        let [low, high] = seen.fold([f64::INFINITY, 0.0], |[low, high], v| {
            [v.min(low), v.max(high)]
        });
        let range = if low <= high {
            [libm::floor(libm::log10(low)), libm::ceil(libm::log10(high))]
        } else {
            [0.0, 1.0]
        };
        let range = [range[0], range[1].max(range[0] + 1.0)].map(libm::exp10);
        Self {
            title: title.into(),
            range,
            logarithmic: true,
        }
    }

    /// A logarithmic axis that begins and ends at 1, 2 or 5 times a power of ten, as near to all positive values as can be; 1
    /// to 10 where there are none.
    pub fn around(title: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let seen: Vec<f64> = values
            .into_iter()
            .filter(|v| v.is_finite() && *v > 0.0)
            .collect();
        let wide = Self::over_decades(title, seen.iter().copied());
        let [first, last] = wide.range.map(|v| libm::round(libm::log10(v)) as i32);
        let lines = || (first..=last).flat_map(|e| STEPS.map(|step| step * decade(e)));
        let least = seen.iter().copied().fold(f64::INFINITY, f64::min);
        let most = seen.iter().copied().fold(0.0, f64::max);
        let low = lines()
            .filter(|v| *v <= least * (1.0 + HAIR))
            .fold(wide.range[0], f64::max);
        let high = lines()
            .filter(|v| *v >= most * (1.0 - HAIR) && *v > low)
            .fold(wide.range[1], f64::min);
        if seen.is_empty() {
            wide
        } else {
            Self {
                range: [low, high],
                ..wide
            }
        }
    }

    /// How far along a value is, from 0 to 1; none where it cannot be shown.
    fn part(&self, value: f64) -> Option<f64> {
        let [low, high, value] = [self.range[0], self.range[1], value]
            .map(|v| if self.logarithmic { libm::log10(v) } else { v });
        let part = (value - low) / (high - low);
        part.is_finite().then(|| part.clamp(0.0, 1.0))
    }

    /// Values with a line through the chart.
    fn marks(&self) -> Vec<f64> {
        if self.logarithmic {
            let [low, high] = [
                libm::floor(libm::log10(self.range[0])),
                libm::ceil(libm::log10(self.range[1])),
            ];
            let steps = if self.range[1] > FEW_DECADES * self.range[0] {
                &STEPS[..1]
            } else {
                &STEPS
            };
            let all = (low as i32..=high as i32)
                .flat_map(|e| steps.iter().map(move |step| step * decade(e)));
            return all
                .filter(|v| {
                    *v >= self.range[0] * (1.0 - HAIR) && *v <= self.range[1] * (1.0 + HAIR)
                })
                .collect();
        }
        (0..=4)
            .map(|i| self.range[0] + (self.range[1] - self.range[0]) * f64::from(i) / 4.0)
            .collect()
    }
}

impl Chart {
    /// Charts side by side with one list of names, the first chart's, as an SVG document.
    pub fn row(charts: &[Self]) -> String {
        Self::drawing(charts, FRAME, &Beside::default())
    }

    /// A chart by itself, larger than in a row, as an SVG document.
    #[doc(hidden)]
    pub fn alone(&self, beside: &Beside) -> String {
        Self::drawing(std::slice::from_ref(self), ALONE, beside)
    }

    fn drawing(charts: &[Self], frame: [f64; 2], beside: &Beside) -> String {
        let names = charts.first().map_or(&[][..], |c| &c.names);
        let longest = names
            .iter()
            .map(|name| name.chars().count())
            .max()
            .unwrap_or(0);
        let column = NAMES + LETTER * longest as f64;
        let width = charts.len() as f64 * (LEFT + frame[0]) + column;
        let height = TOP + frame[1] + BELOW;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
        );
        for (i, chart) in charts.iter().enumerate() {
            let left = LEFT + i as f64 * (LEFT + frame[0]);
            chart.draw(&mut svg, left, frame, beside);
        }
        let left = width - column + 16.0;
        for (i, name) in names.iter().enumerate() {
            let y = TOP + 14.0 + 20.0 * i as f64;
            let color = COLORS[i % COLORS.len()];
            svg += &format!("<path d=\"M{left} {y}h24\" stroke=\"{color}\" stroke-width=\"2\"/>\n");
            svg += &words(left + 32.0, y + 4.0, "start", name);
        }
        svg + "</svg>\n"
    }

    fn draw(&self, svg: &mut String, left: f64, [w, h]: [f64; 2], beside: &Beside) {
        let x = |value| self.across.part(value).map(|part| left + w * part);
        let y = |value| self.up.part(value).map(|part| TOP + h * (1.0 - part));
        for mark in self.across.marks() {
            let Some(x) = x(mark) else { continue };
            *svg += &format!("<path d=\"M{x:.1} {TOP}v{h}\" stroke=\"#ddd\"/>\n");
            *svg += &words(x, TOP + h + 16.0, "middle", &short(mark));
        }
        for mark in self.up.marks() {
            let Some(y) = y(mark) else { continue };
            *svg += &format!("<path d=\"M{left} {y:.1}h{w}\" stroke=\"#ddd\"/>\n");
            *svg += &words(left - 6.0, y + 4.0, "end", &short(mark));
        }
        *svg += &format!(
            "<rect x=\"{left}\" y=\"{TOP}\" width=\"{w}\" height=\"{h}\" fill=\"none\" stroke=\"#888\"/>\n"
        );
        *svg += &words(left + w / 2.0, TOP - 10.0, "middle", &self.title);
        *svg += &words(left + w / 2.0, TOP + h + 36.0, "middle", &self.across.title);
        *svg += &words(left - LEFT + 8.0, TOP - 26.0, "start", &self.up.title);
        for (i, curve) in self.curves.iter().enumerate() {
            let seen: Vec<_> = curve
                .iter()
                .filter_map(|p| Some([x(p[0])?, y(p[1])?]))
                .collect();
            let color = COLORS[i % COLORS.len()];
            if !beside.apart {
                let path = seen
                    .iter()
                    .map(|[x, y]| format!("{x:.1},{y:.1} "))
                    .collect::<String>();
                let points = path.trim_end();
                *svg += &format!(
                    "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>\n"
                );
            }
            for [x, y] in seen {
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{color}\"/>"
                );
            }
        }
        for [x, y] in self
            .defaults
            .iter()
            .filter_map(|p| Some([x(p[0])?, y(p[1])?]))
        {
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"none\" stroke=\"#c00\"/>"
            );
        }
        let labels = beside
            .labels
            .iter()
            .filter_map(|(p, text)| Some(([x(p[0])?, y(p[1])?], text.as_str())));
        let points = self
            .curves
            .iter()
            .flatten()
            .filter_map(|p| Some([x(p[0])?, y(p[1])?]));
        *svg += &set_beside(
            labels.collect(),
            points.collect(),
            [left, left + w, TOP, TOP + h],
        );
    }
}

/// Words beside points, where they cover neither each other nor another point, and stay between two sides, a top and a bottom;
/// lines that run behind them are kept off by a rim.
fn set_beside(
    labels: Vec<([f64; 2], &str)>,
    points: Vec<[f64; 2]>,
    [left, right, top, bottom]: [f64; 4],
) -> String {
    let mut taken: Vec<[f64; 4]> = points
        .iter()
        .map(|[x, y]| [x - 3.0, y - 3.0, x + 3.0, y + 3.0])
        .collect();
    let mut svg = String::new();
    for ([x, y], text) in labels {
        let width = LABEL_LETTER * text.chars().count() as f64;
        let places = [
            [BESIDE, -3.0],
            [BESIDE, LABEL],
            [-BESIDE - width, -3.0],
            [-BESIDE - width, LABEL],
        ];
        let free = places
            .into_iter()
            .map(|[dx, dy]| [x + dx, y + dy])
            .find(|[x, y]| {
                let own = [*x, y - 0.8 * LABEL, x + width, *y];
                let apart =
                    |b: &[f64; 4]| own[2] < b[0] || b[2] < own[0] || own[3] < b[1] || b[3] < own[1];
                own[0] >= left
                    && own[2] <= right
                    && own[1] >= top
                    && own[3] <= bottom
                    && taken.iter().all(apart)
            });
        let Some([x, y]) = free else { continue };
        taken.push([x, y - 0.8 * LABEL, x + width, y]);
        let text = escaped(text);
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{LABEL}\" fill=\"#444\" stroke=\"white\" stroke-width=\"3\" \
             stroke-linejoin=\"round\" paint-order=\"stroke\">{text}</text>"
        );
    }
    svg
}

fn decade(exponent: i32) -> f64 {
    libm::exp10(f64::from(exponent))
}

fn words(x: f64, y: f64, anchor: &str, text: &str) -> String {
    let text = escaped(text);
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>\n")
}

/// A number as short as it can be told; beyond a thousandth and a hundred thousand with a power of ten.
fn short(value: f64) -> String {
    if value != 0.0 && !(9e-4..9e4).contains(&value.abs()) {
        return power(value);
    }
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_all_values_and_something_where_there_are_none() {
        assert_eq!(
            Axis::over_decades("", [0.02, 30.0, 0.0, f64::NAN]).range,
            [0.01, 100.0]
        );
        assert_eq!(Axis::over_decades("", [1.0]).range, [1.0, 10.0]);
        assert_eq!(Axis::over_decades("", []).range, [1.0, 10.0]);
    }

    #[test]
    fn a_close_axis_ends_at_the_nearest_lines_around_all_values() {
        let range = |values: &[f64]| {
            Axis::around("", values.iter().copied())
                .range
                .map(|v| (v * 1e6).round() / 1e6)
        };
        assert_eq!(range(&[0.003, 0.04]), [0.002, 0.05]);
        assert_eq!(
            (range(&[0.2, 5.0]), range(&[1.0]), range(&[])),
            ([0.2, 5.0], [1.0, 2.0], [1.0, 10.0])
        );
        assert_eq!(Axis::around("", [0.003, 0.04]).marks().len(), 5);
        assert_eq!(Axis::around("", [0.003, 4.0]).marks().len(), 3);
    }

    #[test]
    fn what_cannot_be_shown_is_left_out() {
        let axis = Axis::over_decades("<x> & y", [1.0, 100.0]);
        let curve = vec![
            [1.0, 10.0],
            [f64::NAN, 1.0],
            [10.0, 0.0],
            [10.0, f64::INFINITY],
            [100.0, 100.0],
        ];
        let chart = Chart {
            across: axis.clone(),
            up: axis,
            curves: vec![curve],
            names: vec!["a".into()],
            ..Default::default()
        };
        let svg = Chart::row(&[chart]);
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(
            !svg.contains("NaN") && !svg.contains("inf") && svg.contains("&lt;x&gt; &amp; y"),
            "{svg}"
        );
    }

    #[test]
    fn small_numbers_are_not_called_nothing() {
        assert_eq!(
            [0.0, 1e-6, 2e-4, 0.001, 0.5, 20.0, 1e4, 1e6].map(short),
            ["0", "1e-6", "2e-4", "0.001", "0.5", "20", "10000", "1e6"]
        );
    }

    #[test]
    fn words_beside_points_do_not_cover_each_other() {
        let text = set_beside(
            vec![([50.0, 50.0], "one"), ([51.0, 50.0], "two")],
            vec![],
            [0.0, 200.0, 0.0, 200.0],
        );
        assert_eq!(text.matches("<text").count(), 2);
        let crowd = vec![([50.0, 50.0], "a long word"); 9];
        assert!(
            set_beside(crowd, vec![], [0.0, 200.0, 0.0, 200.0])
                .matches("<text")
                .count()
                < 9
        );
        let low = set_beside(
            vec![([50.0, 198.0], "low")],
            vec![],
            [0.0, 200.0, 0.0, 200.0],
        );
        assert!(low.contains("y=\"195.0\""), "not below the frame: {low}");
        assert!(
            !set_beside(
                vec![([199.0, 50.0], "wide")],
                vec![],
                [0.0, 200.0, 0.0, 200.0]
            )
            .contains("x=\"206")
        );
        assert_eq!(
            set_beside(
                vec![([10.0, 50.0], "a word as wide as the chart itself is")],
                vec![],
                [0.0, 200.0, 0.0, 200.0]
            ),
            ""
        );
    }

    #[test]
    fn points_lie_where_their_values_say() {
        let axis = |logarithmic, range| Axis {
            title: String::new(),
            range,
            logarithmic,
        };
        let chart = Chart {
            across: axis(false, [0.0, 10.0]),
            up: axis(true, [1.0, 100.0]),
            curves: vec![vec![[5.0, 10.0]]],
            ..Default::default()
        };
        let middle = format!(
            "cx=\"{:.1}\" cy=\"{:.1}\"",
            LEFT + FRAME[0] / 2.0,
            TOP + FRAME[1] / 2.0
        );
        assert!(Chart::row(&[chart]).contains(&middle));
    }
}
