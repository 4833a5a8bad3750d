//! Charts of curves on logarithmic or linear axes, side by side, as SVG.

use super::markup::{label, tenths, text};
use super::number::{power, trimmed};
use maud::{Markup, html};

/// Frame size of a chart in a row, and of a single one, in SVG units.
const ROW_FRAME_SIZE: [f64; 2] = [300.0, 260.0];
const LONE_FRAME_SIZE: [f64; 2] = [620.0, 360.0];
/// Margins around a frame, for text.
const LEFT_MARGIN: f64 = 62.0;
const TOP_MARGIN: f64 = 40.0;
const BOTTOM_MARGIN: f64 = 48.0;
/// Width of the legend at the right, without its letters, and of one letter.
const LEGEND_WIDTH: f64 = 56.0;
const LEGEND_LETTER_WIDTH: f64 = 7.0;
/// Font size of the labels of points, and the width of a letter.
const POINT_LABEL_SIZE: f64 = 10.0;
const POINT_LABEL_LETTER_WIDTH: f64 = 5.6;
/// Distance of a label from its point.
const POINT_LABEL_DISTANCE: f64 = 7.0;
/// Half the side of the area around a point that labels must not cover.
const POINT_CLEARANCE: f64 = 3.0;
/// Logarithmic axes whose values span up to this factor also have lines at 2 and 5.
const FEW_DECADES: f64 = 100.0;
/// Where logarithmic axes may have lines in a decade.
const DECADE_STEPS: [f64; 3] = [1.0, 2.0, 5.0];
/// Relative rounding error of powers of ten.
const ROUNDING_SHARE: f64 = 1e-9;
/// Colours that are distinguishable with any colour vision (Okabe and Ito, "Color Universal
/// Design"). Yellow, which is faint on white, comes last.
const COLORS: [&str; 8] = [
    "#000000", "#e69f00", "#56b4e9", "#009e73", "#d55e00", "#0072b2", "#cc79a7", "#f0e442",
];

/// Charts next to each other; curves with the same index share colour and name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// The name of each curve, the same in every chart of a row.
    pub names: Vec<String>,
    /// The horizontal axis.
    pub across: Axis,
    /// The vertical axis.
    pub up: Axis,
    /// One per name.
    pub curves: Vec<Curve>,
    /// Points with a ring around them, which mark the defaults.
    pub defaults: Vec<[f64; 2]>,
}

/// Additional content of a large chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// Labels of points; those without room are omitted.
    pub labels: Vec<([f64; 2], String)>,
    /// Whether the points of a curve are unrelated and not joined by lines.
    pub apart: bool,
}

/// The points of a curve, from left to right; points that are not finite, or not positive on a
/// logarithmic axis, are omitted.
pub type Curve = Vec<[f64; 2]>;

/// An axis of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Its quantity, with the unit.
    pub title: String,
    /// Minimum and maximum value in the frame; both positive if it is logarithmic.
    pub range: [f64; 2],
    /// Whether the scale is logarithmic.
    pub logarithmic: bool,
}

impl Axis {
    /// A logarithmic axis over powers of ten that contains all positive values; 1 to 10 if there
    /// are none.
    pub fn over_decades(title: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let extent = positive_extent(values).unwrap_or([1.0, 10.0]);
        Self {
            title: title.into(),
            range: decades_around(extent).map(libm::exp10),
            logarithmic: true,
        }
    }

    /// A logarithmic axis from 1, 2 or 5 times a power of ten to another, as close to all positive
    /// values as possible; 1 to 10 if there are none.
    pub fn around(title: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let Some([least, most]) = positive_extent(values) else {
            return Self::over_decades(title, []);
        };
        let wide = Self::over_decades(title, [least, most]);
        let lines = wide.lines_at(&DECADE_STEPS);
        let low = lines
            .iter()
            .copied()
            .filter(|v| *v <= least * (1.0 + ROUNDING_SHARE))
            .fold(wide.range[0], f64::max);
        let high = lines
            .into_iter()
            .filter(|v| *v >= most * (1.0 - ROUNDING_SHARE) && *v > low)
            .fold(wide.range[1], f64::min);
        Self {
            range: [low, high],
            ..wide
        }
    }

    /// The position of a value along the axis, from 0 to 1; none if it cannot be shown.
    fn fraction_of(&self, value: f64) -> Option<f64> {
        let [low, high, value] = [self.range[0], self.range[1], value].map(|v| self.on_scale(v));
        let fraction = (value - low) / (high - low);
        fraction.is_finite().then(|| fraction.clamp(0.0, 1.0))
    }

    #[inline]
    fn on_scale(&self, value: f64) -> f64 {
        if self.logarithmic {
            libm::log10(value)
        } else {
            value
        }
    }

    /// Values with a grid line.
    fn marked_values(&self) -> Vec<f64> {
        let [low, high] = self.range;
        if !self.logarithmic {
            return quarters([low, high]);
        }
        let steps = if high > FEW_DECADES * low {
            &DECADE_STEPS[..1]
        } else {
            &DECADE_STEPS
        };
        let mut lines = self.lines_at(steps);
        lines.retain(|v| *v >= low * (1.0 - ROUNDING_SHARE) && *v <= high * (1.0 + ROUNDING_SHARE));
        lines
    }

    /// Multiples of the powers of ten of a logarithmic axis, in order.
    fn lines_at(&self, steps: &[f64]) -> Vec<f64> {
        let [low, high] = self.range.map(libm::log10);
        (libm::floor(low) as i32..=libm::ceil(high) as i32)
            .flat_map(|e| {
                steps
                    .iter()
                    .map(move |step| step * libm::exp10(f64::from(e)))
            })
            .collect()
    }
}

/// Minimum and maximum of the finite, positive values.
fn positive_extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values
        .into_iter()
        .filter(|v| v.is_finite() && *v > 0.0)
        .map(|v| [v, v])
        .reduce(|[low, high], [v, _]| [v.min(low), v.max(high)])
}

/// The exponents of the decades that contain a range, at least one decade.
fn decades_around([low, high]: [f64; 2]) -> [f64; 2] {
    let first = libm::floor(libm::log10(low));
    [first, libm::ceil(libm::log10(high)).max(first + 1.0)]
}

/// The ends of a range and the values that divide it into four.
fn quarters([low, high]: [f64; 2]) -> Vec<f64> {
    (0..=4)
        .map(|i| low + (high - low) * f64::from(i) / 4.0)
        .collect()
}

fn polyline_points(places: &[[f64; 2]]) -> String {
    let points = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}"));
    points.collect::<Vec<_>>().join(" ")
}

impl Chart {
    /// Charts side by side with one legend, the first chart's, as an SVG document.
    pub fn row(charts: &[Self]) -> String {
        draw_charts(charts, ROW_FRAME_SIZE, &Beside::default())
    }

    /// A single chart, larger than in a row, as an SVG document.
    #[doc(hidden)]
    pub fn alone(&self, beside: &Beside) -> String {
        draw_charts(std::slice::from_ref(self), LONE_FRAME_SIZE, beside)
    }
}

fn draw_charts(charts: &[Chart], frame: [f64; 2], beside: &Beside) -> String {
    let names = charts.first().map_or(&[][..], |c| &c.names);
    let legend_left = charts.len() as f64 * (LEFT_MARGIN + frame[0]);
    let width = legend_left + legend_width(names);
    let height = TOP_MARGIN + frame[1] + BOTTOM_MARGIN;
    html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format_args!("0 0 {width} {height}")) width=(width)
            height=(height) font-family="sans-serif" font-size="12" {
            rect width=(width) height=(height) fill="white" {}
            @for chart in framed(charts, frame) { (chart.svg(beside)) }
            (draw_legend(names, legend_left + 16.0))
        }
    }
    .into_string()
        + "\n"
}

/// Charts next to each other.
fn framed(charts: &[Chart], size: [f64; 2]) -> impl Iterator<Item = Framed<'_>> {
    (0..).zip(charts).map(move |(i, chart)| Framed {
        chart,
        left: LEFT_MARGIN + f64::from(i) * (LEFT_MARGIN + size[0]),
        size,
    })
}

fn legend_width(names: &[String]) -> f64 {
    let longest = names.iter().map(|name| name.chars().count()).max();
    LEGEND_WIDTH + LEGEND_LETTER_WIDTH * longest.unwrap_or(0) as f64
}

/// A line and a name for each curve.
fn draw_legend(names: &[String], left: f64) -> Markup {
    html! {
        @for (i, name) in names.iter().enumerate() {
            @let y = TOP_MARGIN + 14.0 + 20.0 * i as f64;
            path d=(format_args!("M{left} {y}h24")) stroke=(curve_color(i)) stroke-width="2" {}
            (label(left + 32.0, y + 4.0, "start", name))
        }
    }
}

/// The colour of a curve.
fn curve_color(i: usize) -> &'static str {
    COLORS[i % COLORS.len()]
}

/// A chart and the position of its frame in the drawing.
struct Framed<'a> {
    chart: &'a Chart,
    left: f64,
    size: [f64; 2],
}

impl Framed<'_> {
    fn x(&self, value: f64) -> Option<f64> {
        let fraction = self.chart.across.fraction_of(value)?;
        Some(self.left + self.size[0] * fraction)
    }

    fn y(&self, value: f64) -> Option<f64> {
        let fraction = self.chart.up.fraction_of(value)?;
        Some(TOP_MARGIN + self.size[1] * (1.0 - fraction))
    }

    /// The position of a point of a curve in the drawing; none if it cannot be shown.
    fn place(&self, point: &[f64; 2]) -> Option<[f64; 2]> {
        Some([self.x(point[0])?, self.y(point[1])?])
    }

    fn bottom(&self) -> f64 {
        TOP_MARGIN + self.size[1]
    }

    fn svg(&self, beside: &Beside) -> Markup {
        html! {
            (self.grid_lines())
            rect x=(self.left) y=(TOP_MARGIN) width=(self.size[0]) height=(self.size[1]) fill="none" stroke="#888" {}
            (self.axis_titles())
            @for (i, curve) in self.chart.curves.iter().enumerate() {
                (self.curve_svg(curve, curve_color(i), !beside.apart))
            }
            @for [x, y] in self.chart.defaults.iter().filter_map(|p| self.place(p)) {
                circle cx=(tenths(x)) cy=(tenths(y)) r="6" fill="none" stroke="#c00" {}
            }
            (self.point_labels(beside))
        }
    }

    /// Lines at round values, with the values.
    fn grid_lines(&self) -> Markup {
        html! {
            @for mark in self.chart.across.marked_values() {
                @if let Some(x) = self.x(mark) { (self.upright_line(x, mark)) }
            }
            @for mark in self.chart.up.marked_values() {
                @if let Some(y) = self.y(mark) { (self.level_line(y, mark)) }
            }
        }
    }

    fn upright_line(&self, x: f64, mark: f64) -> Markup {
        let h = self.size[1];
        html! {
            path d=(format_args!("M{x:.1} {TOP_MARGIN}v{h}")) stroke="#ddd" {}
            (label(x, self.bottom() + 16.0, "middle", &short_number(mark)))
        }
    }

    fn level_line(&self, y: f64, mark: f64) -> Markup {
        let (left, w) = (self.left, self.size[0]);
        html! {
            path d=(format_args!("M{left} {y:.1}h{w}")) stroke="#ddd" {}
            (label(left - 6.0, y + 4.0, "end", &short_number(mark)))
        }
    }

    fn axis_titles(&self) -> Markup {
        let middle = self.left + self.size[0] / 2.0;
        html! {
            (label(middle, TOP_MARGIN - 10.0, "middle", &self.chart.title))
            (label(middle, self.bottom() + 36.0, "middle", &self.chart.across.title))
            (label(self.left - LEFT_MARGIN + 8.0, TOP_MARGIN - 26.0, "start", &self.chart.up.title))
        }
    }

    /// The points of a curve, joined by a line if requested.
    fn curve_svg(&self, curve: &Curve, color: &str, joined: bool) -> Markup {
        let places: Vec<_> = curve.iter().filter_map(|p| self.place(p)).collect();
        html! {
            @if joined {
                polyline points=(polyline_points(&places)) fill="none" stroke=(color) stroke-width="1.5" {}
            }
            @for [x, y] in places {
                circle cx=(tenths(x)) cy=(tenths(y)) r="2.5" fill=(color) {}
            }
        }
    }

    fn point_labels(&self, beside: &Beside) -> Markup {
        let labels = beside.labels.iter();
        let labels = labels.filter_map(|(point, text)| Some((self.place(point)?, text.as_str())));
        let points = self.chart.curves.iter().flatten();
        let points = points.filter_map(|p| self.place(p));
        labels_beside(labels.collect(), points.collect(), self.area())
    }

    fn area(&self) -> Area {
        Area {
            left: self.left,
            top: TOP_MARGIN,
            right: self.left + self.size[0],
            bottom: self.bottom(),
        }
    }
}

/// A rectangle in the drawing.
#[derive(Clone, Copy)]
struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Area {
    /// The area of a point.
    fn of_point([x, y]: [f64; 2]) -> Self {
        Self {
            left: x - POINT_CLEARANCE,
            top: y - POINT_CLEARANCE,
            right: x + POINT_CLEARANCE,
            bottom: y + POINT_CLEARANCE,
        }
    }

    /// The area of a label that begins at a position.
    fn of_word([x, y]: [f64; 2], width: f64) -> Self {
        Self {
            left: x,
            top: y - 0.8 * POINT_LABEL_SIZE,
            right: x + width,
            bottom: y,
        }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.right >= other.left
            && other.right >= self.left
            && self.bottom >= other.top
            && other.bottom >= self.top
    }

    fn holds(&self, inner: &Self) -> bool {
        inner.left >= self.left
            && inner.right <= self.right
            && inner.top >= self.top
            && inner.bottom <= self.bottom
    }
}

/// Labels next to points, where they cover neither each other nor another point, and stay inside
/// the frame; a white outline separates them from lines behind.
fn labels_beside(labels: Vec<([f64; 2], &str)>, points: Vec<[f64; 2]>, frame: Area) -> Markup {
    let taken = points.into_iter().map(Area::of_point).collect();
    html! {
        @for ([x, y], word) in free_places(labels, taken, frame) {
            text x=(tenths(x)) y=(tenths(y)) font-size=(POINT_LABEL_SIZE) fill="#444" stroke="white" stroke-width="3"
                stroke-linejoin="round" paint-order="stroke" { (text(word)) }
        }
    }
}

/// Where the labels that have room begin, first come, first served.
fn free_places(
    labels: Vec<([f64; 2], &str)>,
    mut taken: Vec<Area>,
    frame: Area,
) -> Vec<([f64; 2], &str)> {
    let mut placed = Vec::new();
    for (point, word) in labels {
        let width = POINT_LABEL_LETTER_WIDTH * word.chars().count() as f64;
        if let Some(place) = free_place(point, width, &taken, &frame) {
            taken.push(Area::of_word(place, width));
            placed.push((place, word));
        }
    }
    placed
}

fn free_place(point: [f64; 2], width: f64, taken: &[Area], frame: &Area) -> Option<[f64; 2]> {
    let mut places = places_beside(point, width).into_iter();
    places.find(|place| {
        let area = Area::of_word(*place, width);
        frame.holds(&area) && !taken.iter().any(|other| other.overlaps(&area))
    })
}

/// Where the label of a point may begin, best first: to its right or left, above or below.
fn places_beside([x, y]: [f64; 2], width: f64) -> [[f64; 2]; 4] {
    let (right, left) = (x + POINT_LABEL_DISTANCE, x - POINT_LABEL_DISTANCE - width);
    let (above, below) = (y - 3.0, y + POINT_LABEL_SIZE);
    [[right, above], [right, below], [left, above], [left, below]]
}

/// A number as short as possible; with a power of ten outside about a thousandth to a hundred thousand.
fn short_number(value: f64) -> String {
    if value != 0.0 && !(9e-4..9e4).contains(&value.abs()) {
        return power(value);
    }
    trimmed(&format!("{value:.3}")).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set_beside(labels: Vec<([f64; 2], &str)>) -> String {
        let frame = Area {
            left: 0.0,
            top: 0.0,
            right: 200.0,
            bottom: 200.0,
        };
        labels_beside(labels, vec![], frame).into_string()
    }

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
        assert_eq!(Axis::around("", [0.003, 0.04]).marked_values().len(), 5);
        assert_eq!(Axis::around("", [0.003, 4.0]).marked_values().len(), 3);
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
            [0.0, 1e-6, 2e-4, 0.001, 0.5, 20.0, 1e4, 1e6].map(short_number),
            ["0", "1e-6", "2e-4", "0.001", "0.5", "20", "10000", "1e6"]
        );
    }

    #[test]
    fn words_beside_points_do_not_cover_each_other() {
        let text = set_beside(vec![([50.0, 50.0], "one"), ([51.0, 50.0], "two")]);
        assert_eq!(text.matches("<text").count(), 2);
        let crowd = vec![([50.0, 50.0], "a long word"); 9];
        assert!(set_beside(crowd).matches("<text").count() < 9);
        let low = set_beside(vec![([50.0, 198.0], "low")]);
        assert!(low.contains("y=\"195.0\""), "not below the frame: {low}");
        assert!(!set_beside(vec![([199.0, 50.0], "wide")]).contains("x=\"206"));
        let wide = vec![([10.0, 50.0], "a word as wide as the chart itself is")];
        assert_eq!(set_beside(wide), "");
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
            LEFT_MARGIN + ROW_FRAME_SIZE[0] / 2.0,
            TOP_MARGIN + ROW_FRAME_SIZE[1] / 2.0
        );
        assert!(Chart::row(&[chart]).contains(&middle));
    }
}
