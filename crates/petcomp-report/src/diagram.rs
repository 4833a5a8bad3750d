//! Work-precision diagrams: the error of a stage against what it costs, a point for each setting.

use petcomp::Quality;
use petcomp::plot::Beside;
use petcomp::plot::three;
use petcomp::plot::{Axis, Chart, Curve, Table};

/// Costs closer than this are equal: the noise of timings, as a factor.
const NOISE: f64 = 1.1;

/// Error against cost of the settings of a stage, and of other programs that do the same.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagram {
    /// Name of its files, without an extension.
    pub file: String,
    /// What is seen in it.
    pub title: String,
    /// What is processed, with its size.
    pub input: String,
    /// What the error is, with its unit.
    pub error: String,
    /// What the cost is, with its unit.
    pub cost: String,
    /// What results are held against: another program with its version, a closed form, or a converged independent method.
    pub reference: String,
    /// The settings.
    pub points: Vec<Point>,
    /// The error that is small enough, and why.
    pub limit: Option<(f64, String)>,
    /// Why the default is what it is, beyond what the points say.
    pub why: String,
    /// Points of one curve do not follow from each other, so that no line joins them.
    pub apart: bool,
    /// Curves are of different inputs: a point is held only against those of its own.
    pub inputs: bool,
}

/// A setting.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// The curve that it belongs to: a form of the computation, or another program.
    pub curve: String,
    /// What is set.
    pub setting: String,
    /// What it costs.
    pub cost: f64,
    /// Its error; 0 is exact.
    pub error: f64,
    /// The qualities that use it.
    pub qualities: Vec<Quality>,
}

/// Which points nobody beats, the cheapest first: no other is at most as costly and at most as wrong, and better in one of
/// the two. Points are cost and error; what is not finite is never among them.
pub fn front(points: &[[f64; 2]]) -> Vec<usize> {
    let finite = |p: &[f64; 2]| p.iter().all(|v| v.is_finite());
    let beats = |a: &[f64; 2], b: &[f64; 2]| finite(a) && a[0] <= b[0] && a[1] <= b[1] && a != b;
    let mut kept: Vec<usize> = (0..points.len())
        .filter(|&i| finite(&points[i]) && !points.iter().any(|p| beats(p, &points[i])))
        .collect();
    kept.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]));
    kept
}

impl Point {
    /// A setting that no quality uses.
    pub fn new(
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

    /// The same, used by those qualities of which `gives` is true.
    pub fn used_where(mut self, gives: impl Fn(Quality) -> bool) -> Self {
        self.qualities = Quality::ALL.into_iter().filter(|q| gives(*q)).collect();
        self
    }

    /// What the default uses.
    pub fn is_default(&self) -> bool {
        self.qualities.contains(&Quality::default())
    }

    /// Setting and curve; the curve alone where it is all that is set.
    fn name(&self) -> String {
        if self.setting.is_empty() {
            self.curve.clone()
        } else {
            format!("{} ({})", self.setting, self.curve)
        }
    }

    /// What stands beside it: what is set, and the qualities that use it.
    fn label(&self) -> String {
        let set = if self.setting.is_empty() {
            &self.curve
        } else {
            &self.setting
        };
        match self.qualities.as_slice() {
            [] => set.clone(),
            used if used.len() == Quality::ALL.len() => format!("{set} (every quality)"),
            used => format!(
                "{set} ({})",
                used.iter().map(|q| q.name()).collect::<Vec<_>>().join(", ")
            ),
        }
    }
}

impl Diagram {
    /// The setting of the default.
    pub fn default_point(&self) -> Option<&Point> {
        self.points.iter().find(|p| p.is_default())
    }

    /// The cheapest setting that is at least as exact as the default, where it is another and cheaper by more than noise.
    pub fn cheaper_than_default(&self) -> Option<&Point> {
        let default = self.default_point()?;
        let as_exact = self
            .rivals(default)
            .filter(|p| p.error <= default.error && p.cost * NOISE < default.cost);
        as_exact.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// What a point is held against: the points of the same input.
    fn rivals(&self, point: &Point) -> impl Iterator<Item = &Point> {
        self.points
            .iter()
            .filter(|p| !self.inputs || p.curve == point.curve)
    }

    /// Whether nothing beats a point.
    fn is_on_front(&self, point: &Point) -> bool {
        let at = |p: &Point| [p.cost, p.error];
        let rivals: Vec<[f64; 2]> = self.rivals(point).map(at).collect();
        front(&rivals).into_iter().any(|i| rivals[i] == at(point))
    }

    /// The cheapest setting under the limit.
    pub fn cheapest_under_limit(&self) -> Option<&Point> {
        let (limit, _) = self.limit.as_ref()?;
        self.points
            .iter()
            .filter(|p| p.error <= *limit)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// In words: where the default is, why, whether it is on the efficient front, and how far from it.
    pub fn verdict(&self) -> String {
        let Some(default) = self.default_point() else {
            return self.why.clone();
        };
        let mut said = format!("Default: {}.", default.name());
        said += &self.beside_limit(default);
        said += &match self.cheaper_than_default() {
            None => " It is on the efficient front.".to_owned(),
            Some(p) => format!(
                " It is not on the efficient front: {} is at least as exact (error {} beside {}) at {} of its cost.",
                p.name(),
                three(p.error),
                three(default.error),
                three(p.cost / default.cost)
            ),
        };
        let gap = if self.why.is_empty() { "" } else { " " };
        said + gap + &self.why
    }

    /// How a setting compares with the cheapest one under the limit; nothing without a limit that some setting keeps.
    fn beside_limit(&self, point: &Point) -> String {
        let (Some((limit, why)), Some(best)) = (&self.limit, self.cheapest_under_limit()) else {
            return String::new();
        };
        let (limit, told) = (*limit, three(*limit));
        if point.error > limit {
            return format!(" Above the limit of {told} ({why}).");
        }
        if point.cost <= NOISE * best.cost {
            return format!(" The cheapest setting under {told} ({why}).");
        }
        let share = three(best.cost / point.cost);
        format!(
            " The cheapest setting under {told} ({why}) is {}, at {share} of its cost.",
            best.name()
        )
    }

    /// What the diagram shows, against what, and its verdict.
    pub fn caption(&self) -> String {
        let ring = if self.default_point().is_some() {
            " Ring: the default."
        } else {
            ""
        };
        let exact = self.points.iter().any(|p| p.error == 0.0);
        let floor = if exact {
            " Points on the lower edge have no error."
        } else {
            ""
        };
        let verdict = self.verdict();
        format!(
            "{}. Input: {}. Reference: {}.{ring}{floor} {verdict}",
            self.title, self.input, self.reference
        )
    }

    /// The diagram as an SVG document.
    pub fn svg(&self) -> String {
        let mut names: Vec<String> = Vec::new();
        for point in &self.points {
            if !names.contains(&point.curve) {
                names.push(point.curve.clone());
            }
        }
        let up = self.errors();
        let lowest = up.range[0];
        let at = |p: &Point| [p.cost, p.error.max(lowest)];
        let curve = |name: &String| -> Curve {
            self.points
                .iter()
                .filter(|p| p.curve == *name)
                .map(at)
                .collect()
        };
        let chart = Chart {
            title: self.title.clone(),
            across: Axis::around(&self.cost, self.points.iter().map(|p| p.cost)),
            curves: names.iter().map(curve).collect(),
            names,
            defaults: self
                .points
                .iter()
                .filter(|p| p.is_default())
                .map(at)
                .collect(),
            up,
        };
        let labelled = |used: bool| {
            self.points
                .iter()
                .filter(move |p| p.qualities.is_empty() != used)
        };
        let labels: Vec<_> = labelled(true)
            .chain(labelled(false))
            .map(|p| (at(p), p.label()))
            .collect();
        chart.alone(&Beside {
            labels,
            apart: self.apart,
        })
    }

    /// The axis of errors; longer below where some are 0.
    fn errors(&self) -> Axis {
        /// So far below the least error, as a factor, that no one takes it for one.
        const BELOW: f64 = 10.0;
        let mut up = Axis::around(&self.error, self.points.iter().map(|p| p.error));
        if self.points.iter().any(|p| p.error == 0.0) {
            up.range[0] /= BELOW;
        }
        up
    }

    /// The points as a table, with the front marked.
    pub fn table(&self) -> Table {
        let mut table = Table::new([
            "form",
            "setting",
            &self.cost,
            &self.error,
            "quality",
            "on the front",
        ]);
        for p in &self.points {
            let used = p
                .qualities
                .iter()
                .map(|q| q.name())
                .collect::<Vec<_>>()
                .join(", ");
            let on_front = if self.is_on_front(p) { "yes" } else { "" };
            table.push([
                p.curve.as_str(),
                &p.setting,
                &three(p.cost),
                &three(p.error),
                &used,
                on_front,
            ]);
        }
        table
    }

    /// A line for each of some diagrams: the default, its error and cost, and what beats it.
    pub fn summary(diagrams: &[Self]) -> Table {
        let mut table = Table::new([
            "stage and what is asked",
            "held against",
            "default",
            "error is",
            "error",
            "cost is",
            "cost",
            "cheaper and as exact",
        ]);
        for diagram in diagrams {
            let Some(default) = diagram.default_point() else {
                continue;
            };
            let beaten = diagram
                .cheaper_than_default()
                .map_or("none: on the front".to_owned(), |p| {
                    format!("{}, {} of the cost", p.name(), three(p.cost / default.cost))
                });
            table.push([
                diagram.title.clone(),
                diagram.reference.clone(),
                default.name(),
                diagram.error.clone(),
                three(default.error),
                diagram.cost.clone(),
                three(default.cost),
                beaten,
            ]);
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nobody_beats() {
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
        let said = found.verdict();
        assert!(
            said.contains("is 1 (b), at 0.250 of its cost")
                && said.contains("(error 0.300 beside 0.400)"),
            "{said}"
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
    fn exact_points_lie_on_the_lower_edge_and_are_told() {
        let found = diagram(vec![
            normal(Point::new("a", "exact", 2.0, 0.0)),
            Point::new("a", "1", 1.0, 0.1),
        ]);
        assert!(
            found.svg().matches("r=\"2.5\"").count() == 2 && found.caption().contains("no error")
        );
        assert!((found.errors().range[0] - 0.01).abs() < 1e-9);
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
