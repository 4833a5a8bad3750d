//! Work-precision diagrams: the error of a stage against its cost, with one point per setting.

use crate::columns::table_from;
use petcomp::Quality;
use petcomp::plot::{Axis, Beside, Chart, Curve, Table, three};

/// Costs whose ratio is below this factor count as equal: noise of timings.
const TIMING_NOISE_FACTOR: f64 = 1.1;
/// How far the axis extends below the least positive error if some errors are 0: so far that its
/// edge is not read as an error.
const ZERO_ERROR_ROOM_FACTOR: f64 = 10.0;
/// The largest invisible error of a picture: half of a code of 8 bits at middle grey.
const INVISIBLE_ERROR: f64 = 0.004;

/// Error against cost of the settings of a stage, and of other programs for the same task.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Diagram {
    /// Name of its files, without an extension.
    pub(crate) file: String,
    /// Title of the diagram.
    pub(crate) title: String,
    /// The input, with its size.
    pub(crate) input: String,
    /// Name of the error, with its unit.
    pub(crate) error: String,
    /// Name of the cost, with its unit.
    pub(crate) cost: String,
    /// Reference that results are compared with: another program with its version, a closed form,
    /// or a converged independent method.
    pub(crate) reference: String,
    /// The settings.
    pub(crate) points: Vec<Point>,
    /// The error that is small enough, and the reason.
    pub(crate) limit: Option<(f64, String)>,
    /// Reason for the default, beyond what the points show.
    pub(crate) why: String,
    /// Whether the points of a curve are unrelated, so that no line joins them.
    pub(crate) apart: bool,
    /// Whether curves have different inputs: a point is then compared only with those of its own
    /// curve.
    pub(crate) inputs: bool,
}

/// A setting.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Point {
    /// Its curve: a variant of the computation, or another program.
    pub(crate) curve: String,
    /// The setting.
    pub(crate) setting: String,
    /// What it costs.
    pub(crate) cost: f64,
    /// Its error; 0 is exact.
    pub(crate) error: f64,
    /// The qualities that use it.
    pub(crate) qualities: Vec<Quality>,
}

/// Whether a point of cost and error is on the efficient front: no other one has at most its cost
/// and at most its error, with at least one of them lower. A non-finite point never is.
fn is_unbeaten(point: [f64; 2], points: &[[f64; 2]]) -> bool {
    is_finite(point) && !points.iter().any(|other| beats(*other, point))
}

fn is_finite(point: [f64; 2]) -> bool {
    point.iter().all(|v| v.is_finite())
}

fn beats(a: [f64; 2], b: [f64; 2]) -> bool {
    is_finite(a) && a[0] <= b[0] && a[1] <= b[1] && a != b
}

/// The limit of diagrams whose error is in pixel values.
pub(crate) fn invisible_error() -> Option<(f64, String)> {
    Some((
        INVISIBLE_ERROR,
        "half of an 8-bit code at middle grey".into(),
    ))
}

impl Point {
    /// A setting that no quality uses.
    pub(crate) fn new(
        curve: impl Into<String>,
        setting: impl Into<String>,
        cost: f64,
        error: f64,
    ) -> Self {
        Self {
            curve: curve.into(),
            setting: setting.into(),
            cost,
            error,
            qualities: Vec::new(),
        }
    }

    /// The same, used by the qualities for which `is_used` is true.
    pub(crate) fn used_where(mut self, is_used: impl Fn(Quality) -> bool) -> Self {
        self.qualities = Quality::ALL.into_iter().filter(|q| is_used(*q)).collect();
        self
    }

    /// Whether the default uses it.
    pub(crate) fn is_default(&self) -> bool {
        self.qualities.contains(&Quality::default())
    }

    /// Whether it is at least as accurate, and cheaper by more than noise.
    fn clearly_beats(&self, other: &Self) -> bool {
        self.error <= other.error && self.cost * TIMING_NOISE_FACTOR < other.cost
    }

    fn cost_and_error(&self) -> [f64; 2] {
        [self.cost, self.error]
    }

    /// Setting and curve; only the curve if there is no setting.
    fn name(&self) -> String {
        if self.setting.is_empty() {
            self.curve.clone()
        } else {
            format!("{} ({})", self.setting, self.curve)
        }
    }

    /// Its cost, as a share of another one's.
    fn share_of_cost(&self, other: &Self) -> String {
        three(self.cost / other.cost)
    }

    fn short_name(&self) -> &str {
        if self.setting.is_empty() {
            &self.curve
        } else {
            &self.setting
        }
    }

    fn quality_names(&self) -> String {
        let names: Vec<&str> = self.qualities.iter().map(|q| q.name()).collect();
        names.join(", ")
    }

    /// Its label: the setting, and the qualities that use it.
    fn label(&self) -> String {
        let name = self.short_name();
        match self.qualities.len() {
            0 => name.to_owned(),
            count if count == Quality::ALL.len() => format!("{name} (every quality)"),
            _ => format!("{name} ({})", self.quality_names()),
        }
    }
}

fn cheapest<'a>(points: impl Iterator<Item = &'a Point>) -> Option<&'a Point> {
    points.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

impl Diagram {
    /// The setting of the default.
    pub(crate) fn default_point(&self) -> Option<&Point> {
        self.points.iter().find(|p| p.is_default())
    }

    /// The cheapest setting that is at least as accurate as the default, if it is another one and
    /// cheaper by more than noise.
    pub(crate) fn cheaper_than_default(&self) -> Option<&Point> {
        let default = self.default_point()?;
        cheapest(self.rivals(default).filter(|p| p.clearly_beats(default)))
    }

    /// The points that a point is compared with: those of the same input.
    fn rivals(&self, point: &Point) -> impl Iterator<Item = &Point> {
        self.points
            .iter()
            .filter(|p| !self.inputs || p.curve == point.curve)
    }

    fn is_on_front(&self, point: &Point) -> bool {
        let rivals: Vec<_> = self.rivals(point).map(Point::cost_and_error).collect();
        is_unbeaten(point.cost_and_error(), &rivals)
    }

    /// The cheapest setting under the limit.
    pub(crate) fn cheapest_under_limit(&self) -> Option<&Point> {
        let (limit, _) = self.limit.as_ref()?;
        cheapest(self.points.iter().filter(|p| p.error <= *limit))
    }

    /// In words: the default, the reason for it, whether it is on the efficient front, and how far
    /// from it.
    pub(crate) fn verdict(&self) -> String {
        let Some(default) = self.default_point() else {
            return self.why.clone();
        };
        paragraph(&[
            &format!("Default: {}.", default.name()),
            &self.limit_verdict(default),
            &self.front_verdict(default),
            &self.why,
        ])
    }

    /// Whether the default is on the efficient front, and if not, how far from it.
    fn front_verdict(&self, default: &Point) -> String {
        let Some(better) = self.cheaper_than_default() else {
            return "It is on the efficient front.".to_owned();
        };
        format!(
            "It is not on the efficient front: {} is at least as accurate (error {} instead of {}) at {} of its cost.",
            better.name(),
            three(better.error),
            three(default.error),
            better.share_of_cost(default)
        )
    }

    /// How a setting compares with the cheapest one under the limit; empty without a limit that
    /// some setting meets.
    fn limit_verdict(&self, point: &Point) -> String {
        let (Some((limit, why)), Some(best)) = (&self.limit, self.cheapest_under_limit()) else {
            return String::new();
        };
        let bound = format!("{} ({why})", three(*limit));
        if point.error > *limit {
            format!("Above the limit of {bound}.")
        } else if point.cost <= TIMING_NOISE_FACTOR * best.cost {
            format!("The cheapest setting under {bound}.")
        } else {
            let (name, share) = (best.name(), best.share_of_cost(point));
            format!("The cheapest setting under {bound} is {name}, at {share} of its cost.")
        }
    }

    /// The content of the diagram, its reference, and its verdict.
    pub(crate) fn caption(&self) -> String {
        paragraph(&[
            &format!(
                "{}. Input: {}. Reference: {}.",
                self.title, self.input, self.reference
            ),
            self.legend(),
            &self.verdict(),
        ])
    }

    /// Meaning of the marks in the diagram.
    fn legend(&self) -> &'static str {
        match (self.default_point().is_some(), self.has_exact_points()) {
            (true, true) => "Ring: the default. Points on the lower edge have no error.",
            (true, false) => "Ring: the default.",
            (false, true) => "Points on the lower edge have no error.",
            (false, false) => "",
        }
    }

    fn has_exact_points(&self) -> bool {
        self.points.iter().any(|p| p.error == 0.0)
    }

    /// The diagram as an SVG document.
    pub(crate) fn svg(&self) -> String {
        self.chart().alone(&Beside {
            labels: self.labels(),
            apart: self.apart,
        })
    }

    fn chart(&self) -> Chart {
        let names = self.curve_names();
        Chart {
            title: self.title.clone(),
            across: Axis::around(&self.cost, self.points.iter().map(|p| p.cost)),
            up: self.error_axis(),
            curves: names
                .iter()
                .map(|name| self.curve_of(|p| p.curve == *name))
                .collect(),
            defaults: self.curve_of(Point::is_default),
            names,
        }
    }

    /// Each curve once, in the order of their first points.
    fn curve_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self.points.iter().map(|point| &point.curve) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    fn curve_of(&self, is_shown: impl Fn(&Point) -> bool) -> Curve {
        let shown = self.points.iter().filter(|p| is_shown(p));
        shown.map(|p| self.position(p)).collect()
    }

    /// Position of a point in the chart: exact ones are on its lower edge.
    fn position(&self, point: &Point) -> [f64; 2] {
        [point.cost, point.error.max(self.error_axis().range[0])]
    }

    /// Labels of points. Those of points that a quality uses come first: labels without room are
    /// left out.
    fn labels(&self) -> Vec<([f64; 2], String)> {
        let (used, unused): (Vec<_>, Vec<_>) =
            self.points.iter().partition(|p| !p.qualities.is_empty());
        used.into_iter()
            .chain(unused)
            .map(|p| (self.position(p), p.label()))
            .collect()
    }

    /// The axis of errors, extended below if some are 0.
    fn error_axis(&self) -> Axis {
        let mut axis = Axis::around(&self.error, self.points.iter().map(|p| p.error));
        if self.has_exact_points() {
            axis.range[0] /= ZERO_ERROR_ROOM_FACTOR;
        }
        axis
    }

    /// The points as a table, with the front marked.
    pub(crate) fn table(&self) -> Table {
        let titles = [
            "form",
            "setting",
            &self.cost,
            &self.error,
            "quality",
            "on the front",
        ];
        table_from(titles, self.points.iter().map(|p| self.table_line(p)))
    }

    fn table_line(&self, point: &Point) -> [String; 6] {
        let on_front = if self.is_on_front(point) { "yes" } else { "" };
        [
            point.curve.clone(),
            point.setting.clone(),
            three(point.cost),
            three(point.error),
            point.quality_names(),
            on_front.into(),
        ]
    }

    /// A row per diagram: the default, its error and cost, and what beats it.
    pub(crate) fn summary(diagrams: &[Self]) -> Table {
        let defaults = diagrams.iter().filter_map(Self::summary_line);
        table_from(SUMMARY_TITLES, defaults)
    }

    fn summary_line(&self) -> Option<[String; 8]> {
        let default = self.default_point()?;
        let beaten_by = self.cheaper_than_default().map(|better| {
            let share = better.share_of_cost(default);
            format!("{}, {share} of the cost", better.name())
        });
        Some([
            self.title.clone(),
            self.reference.clone(),
            default.name(),
            self.error.clone(),
            three(default.error),
            self.cost.clone(),
            three(default.cost),
            beaten_by.unwrap_or("none: on the front".into()),
        ])
    }
}

/// Joins sentences with spaces; empty ones are left out.
fn paragraph(sentences: &[&str]) -> String {
    let mut kept = sentences.to_vec();
    kept.retain(|sentence| !sentence.is_empty());
    kept.join(" ")
}

const SUMMARY_TITLES: [&str; 8] = [
    "stage and question",
    "reference",
    "default",
    "error measure",
    "error",
    "cost measure",
    "cost",
    "cheaper and at least as accurate",
];

#[cfg(test)]
mod tests {
    use super::*;

    fn front(points: &[[f64; 2]]) -> Vec<usize> {
        let all = 0..points.len();
        all.filter(|&i| is_unbeaten(points[i], points)).collect()
    }

    #[test]
    fn the_front_is_what_no_point_beats() {
        let points = [
            [1.0, 9.0],
            [2.0, 4.0],
            [3.0, 5.0],
            [4.0, 1.0],
            [4.0, 2.0],
            [f64::NAN, 0.0],
            [0.0, f64::INFINITY],
        ];
        assert_eq!(front(&points), [0, 1, 3]);
        assert_eq!(front(&[]), [0; 0]);
    }

    #[test]
    fn equal_points_are_on_the_front_together() {
        assert_eq!(front(&[[1.0, 1.0], [1.0, 1.0], [2.0, 1.0]]), [0, 1]);
    }

    fn diagram(points: Vec<Point>) -> Diagram {
        Diagram {
            points,
            limit: Some((0.5, "half a pixel".into())),
            ..Diagram::default()
        }
    }

    fn normal(point: Point) -> Point {
        point.used_where(|q| q == Quality::Normal)
    }

    #[test]
    fn a_default_on_the_front_says_so() {
        let found = diagram(vec![
            normal(Point::new("a", "2", 2.0, 0.4)),
            Point::new("a", "1", 1.0, 0.9),
        ]);
        assert!(found.cheaper_than_default().is_none());
        assert_eq!(
            found.verdict(),
            "Default: 2 (a). The cheapest setting under 0.500 (half a pixel). It is on the efficient front."
        );
    }

    #[test]
    fn a_default_that_is_beaten_says_by_what_and_how_far() {
        let found = diagram(vec![
            normal(Point::new("a", "2", 4.0, 0.4)),
            Point::new("b", "1", 1.0, 0.3),
        ]);
        let verdict = found.verdict();
        assert!(
            verdict.contains("is 1 (b), at 0.250 of its cost")
                && verdict.contains("(error 0.300 instead of 0.400)"),
            "{verdict}"
        );
    }

    #[test]
    fn a_smaller_input_beats_nothing() {
        let points = vec![
            normal(Point::new("large", "2", 2.0, 0.4)),
            Point::new("small", "1", 1.0, 0.1),
        ];
        let found = Diagram {
            inputs: true,
            ..diagram(points.clone())
        };
        assert!(
            found.cheaper_than_default().is_none()
                && found.table().rows.iter().all(|row| row[5] == "yes")
        );
        assert!(diagram(points).cheaper_than_default().is_some());
    }

    #[test]
    fn costs_within_the_noise_do_not_beat() {
        let found = diagram(vec![
            normal(Point::new("a", "2", 1.05, 0.4)),
            Point::new("b", "1", 1.0, 0.4),
        ]);
        assert!(found.cheaper_than_default().is_none());
    }

    #[test]
    fn a_default_above_the_limit_is_not_praised() {
        let found = diagram(vec![
            normal(Point::new("a", "2", 1.0, 0.9)),
            Point::new("b", "1", 2.0, 0.4),
        ]);
        assert!(
            found.verdict().contains("Above the limit of 0.500"),
            "{}",
            found.verdict()
        );
    }

    #[test]
    fn exact_points_lie_on_the_lower_edge_and_the_caption_says_so() {
        let found = diagram(vec![
            normal(Point::new("a", "exact", 2.0, 0.0)),
            Point::new("a", "1", 1.0, 0.1),
        ]);
        assert!(
            found.svg().matches("r=\"2.5\"").count() == 2 && found.caption().contains("no error")
        );
        assert!((found.error_axis().range[0] - 0.01).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_no_diagram_but_no_crash_either() {
        let none = Diagram {
            why: "there is none".into(),
            ..Diagram::default()
        };
        assert_eq!(
            (none.verdict().as_str(), none.table().rows.len()),
            ("there is none", 0)
        );
        assert!(none.svg().starts_with("<svg"));
    }
}
