//! Curves and the confusion matrix as SVG.

use super::{Confusion, Curves};
use crate::plot::{Axis, Chart, clipped, escaped};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Smallest and largest side of a cell of the matrix, limit for the whole matrix, and room for
/// names, in SVG units.
const CELL_SIDES: [f64; 2] = [26.0, 56.0];
const MAX_MATRIX_SIDE: f64 = 900.0;
const NAME_ROOM: f64 = 150.0;

/// How many letters of a name fit next to the matrix, and next to a chart.
const MAX_NAME_LETTERS: usize = 20;

/// How many classes have a separate curve in addition to the mean: more colours cannot be told apart.
pub(crate) const MAX_CURVES: usize = 7;

/// Precision over recall: the mean of all classes, and the first of the classes in `shown`.
pub(crate) fn precision_recall_picture(curves: &Curves, names: &[String], shown: &[u32]) -> String {
    let lines = (&curves.mean_precision, &curves.precision_recall[..]);
    picture(
        "precision and recall at IoU 0.5",
        ["recall", "precision"],
        lines,
        curves,
        names,
        shown,
    )
}

/// F1 over confidence, for the same classes.
pub(crate) fn f1_picture(curves: &Curves, names: &[String], shown: &[u32]) -> String {
    let title = format!(
        "F1 at IoU 0.5, best mean at confidence {:.3}",
        curves.best_confidence
    );
    picture(
        &title,
        ["confidence", "F1"],
        (&curves.mean_f1, &curves.f1[..]),
        curves,
        names,
        shown,
    )
}

type CurvePoints = Vec<[f64; 2]>;

fn picture(
    title: &str,
    axes: [&str; 2],
    (mean, lines): (&CurvePoints, &[CurvePoints]),
    curves: &Curves,
    names: &[String],
    shown: &[u32],
) -> String {
    let mut chart = empty_chart(title, axes);
    if curves.classes.len() > 1 {
        let name = format!("mean of {} classes", curves.classes.len());
        add_curve(&mut chart, name, mean);
    }
    for place in shown_places(curves, shown).take(MAX_CURVES) {
        let name = class_name(curves.classes[place], names);
        add_curve(&mut chart, clipped(&name, MAX_NAME_LETTERS), &lines[place]);
    }
    Chart::row(&[chart])
}

fn add_curve(chart: &mut Chart, name: String, points: &CurvePoints) {
    chart.names.push(name);
    chart.curves.push(points.clone());
}

/// Indices of the classes in `shown` among the curves.
fn shown_places(curves: &Curves, shown: &[u32]) -> impl Iterator<Item = usize> {
    let shown = shown.iter();
    shown.filter_map(|class| curves.classes.binary_search(class).ok())
}

/// A chart of shares, with both axes from 0 to 1.
fn empty_chart(title: &str, axes: [&str; 2]) -> Chart {
    let [across, up] = axes.map(unit_axis);
    Chart {
        title: title.into(),
        across,
        up,
        ..Default::default()
    }
}

/// An axis from 0 to 1.
fn unit_axis(title: &str) -> Axis {
    Axis {
        title: title.into(),
        range: [0.0, 1.0],
        logarithmic: false,
    }
}

/// Found by true class, for the classes in `shown`: each column's shares as shades, with the counts
/// as text. The other classes share a row and a column; the background has one, too.
pub(crate) fn confusion_picture(confusion: &Confusion, names: &[String], shown: &[u32]) -> String {
    let matrix = ConfusionTable::new(confusion, names, shown);
    let n = matrix.titles.len() as f64;
    let cell = cell_side(n);
    let side = NAME_ROOM + cell * n;
    // The rotated name of the last column extends beyond it.
    let width = side + NAME_ROOM / 2.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {side}\" width=\"{width}\" height=\"{side}\" \
         font-family=\"sans-serif\" font-size=\"{:.1}\">\n<rect width=\"{width}\" height=\"{side}\" fill=\"white\"/>\n",
        (0.42 * cell).min(12.0)
    );
    svg += &word([8.0, 20.0], "start", "rows: found; columns: true", "");
    svg += &matrix.names(cell);
    svg += &matrix.lines(cell);
    for (&at, &count) in &matrix.counts {
        svg += &matrix.cell(at, count, cell);
    }
    svg + "</svg>\n"
}

/// The cell size of a matrix with this many rows.
fn cell_side(rows: f64) -> f64 {
    (MAX_MATRIX_SIDE / rows).clamp(CELL_SIDES[0], CELL_SIDES[1])
}

/// A name next to its row, and rotated above its column; both have the same centre.
fn row_and_column_name(title: &str, middle: f64) -> String {
    let edge = NAME_ROOM - 8.0;
    let short = clipped(title, MAX_NAME_LETTERS);
    let turned = format!(" transform=\"rotate(-40 {middle:.1} {edge})\"");
    word([edge, middle + 4.0], "end", &short, "") + &word([middle, edge], "start", &short, &turned)
}

/// The classes in `shown`, the others as one, and the background.
fn titles(confusion: &Confusion, names: &[String], shown: &[u32]) -> Vec<String> {
    let mut titles: Vec<String> = shown
        .iter()
        .map(|&class| class_name(class, names))
        .collect();
    let others = count_others(confusion, shown);
    if others > 0 {
        titles.push(format!("{others} others"));
    }
    titles.push("background".into());
    titles
}

/// The number of classes that are not shown.
fn count_others(confusion: &Confusion, shown: &[u32]) -> usize {
    let classes = confusion.classes();
    let others = classes.iter().filter(|class| !shown.contains(class));
    others.count()
}

/// A confusion matrix as a table of limited size.
struct ConfusionTable {
    /// Titles of the rows and columns.
    titles: Vec<String>,
    /// By column and row; combinations that never occur are omitted.
    counts: BTreeMap<[usize; 2], u64>,
    /// Sum of each column.
    sums: Vec<u64>,
}

impl ConfusionTable {
    fn new(confusion: &Confusion, names: &[String], shown: &[u32]) -> Self {
        let titles = titles(confusion, names, shown);
        let (mut counts, mut sums) = (BTreeMap::new(), vec![0; titles.len()]);
        let background = titles.len() - 1;
        for (classes, &count) in &confusion.counts {
            let [found, truth] = classes.map(|class| column_of(class, shown, background));
            *counts.entry([truth, found]).or_default() += count;
            sums[truth] += count;
        }
        Self {
            titles,
            counts,
            sums,
        }
    }

    /// The names of the rows and columns.
    fn names(&self, cell: f64) -> String {
        let titles = (0..).zip(&self.titles);
        titles
            .map(|(i, title)| row_and_column_name(title, NAME_ROOM + cell * (f64::from(i) + 0.5)))
            .collect()
    }

    fn lines(&self, cell: f64) -> String {
        let n = self.titles.len();
        let all = cell * n as f64;
        let mut path = String::new();
        for i in 0..=n {
            let at = NAME_ROOM + cell * i as f64;
            let _ = write!(
                path,
                "M{at:.1} {NAME_ROOM}v{all:.1}M{NAME_ROOM} {at:.1}h{all:.1}"
            );
        }
        format!("<path d=\"{path}\" stroke=\"#ddd\" fill=\"none\"/>\n")
    }

    fn cell(&self, [column, row]: [usize; 2], count: u64, cell: f64) -> String {
        let share = count as f64 / self.sums[column] as f64;
        let [x, y] = [column, row].map(|i| NAME_ROOM + cell * i as f64);
        let light = 255.0 - 200.0 * share;
        let title = self.cell_title([column, row], count);
        let rectangle = format!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{cell:.1}\" height=\"{cell:.1}\" \
             fill=\"rgb({light:.0},{light:.0},255)\" stroke=\"#ccc\"><title>{title}</title></rect>\n"
        );
        let at = [x + cell / 2.0, y + cell / 2.0 + 4.0];
        let ink = if share > 0.6 { " fill=\"white\"" } else { "" };
        rectangle + &word(at, "middle", &short(count), ink)
    }

    fn cell_title(&self, [column, row]: [usize; 2], count: u64) -> String {
        let (found, truth) = (&self.titles[row], &self.titles[column]);
        escaped(&format!("found {found}, true {truth}: {count}"))
    }
}

/// A count in at most four characters, up to 1,000,000,000.
fn short(count: u64) -> String {
    match count {
        0..10_000 => count.to_string(),
        10_000..1_000_000 => format!("{}k", count / 1_000),
        _ => format!("{}M", count / 1_000_000),
    }
}

fn word([x, y]: [f64; 2], anchor: &str, text: &str, more: &str) -> String {
    format!(
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{}</text>\n",
        escaped(text)
    )
}

/// The name of a class: its number if it has none.
pub(crate) fn class_name(class: u32, names: &[String]) -> String {
    names
        .get(class as usize)
        .cloned()
        .unwrap_or_else(|| format!("class {class}"))
}

/// The column of a class; classes that are not shown share the one before the background's.
fn column_of(class: Option<u32>, shown: &[u32], background: usize) -> usize {
    let Some(class) = class else {
        return background;
    };
    let column = shown.iter().position(|&own| own == class);
    column.unwrap_or(background - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn confusion(counts: &[([Option<u32>; 2], u64)]) -> Confusion {
        Confusion {
            counts: counts.iter().copied().collect(),
        }
    }

    #[test]
    fn the_matrix_has_a_cell_for_what_happened_and_keeps_names_as_text() {
        let some = confusion(&[([Some(0), Some(0)], 3), ([None, Some(0)], 1)]);
        let svg = confusion_picture(&some, &["<cap>".into()], &[0]);
        assert_eq!(svg.matches("stroke=\"#ccc\"").count(), 2);
        assert!(svg.contains("&lt;cap&gt;") && svg.contains(">3</text>") && !svg.contains("NaN"));
    }

    #[test]
    fn what_is_not_shown_is_counted_as_others() {
        let many: Vec<_> = (0..2000)
            .map(|class| ([Some(class), Some(class)], 1))
            .collect();
        let matrix = ConfusionTable::new(&confusion(&many), &[], &[7, 1999]);
        assert_eq!(
            matrix.titles,
            ["class 7", "class 1999", "1998 others", "background"]
        );
        assert_eq!(
            matrix.counts,
            BTreeMap::from([([0, 0], 1), ([1, 1], 1), ([2, 2], 1998)])
        );
        assert!(
            confusion_picture(
                &confusion(&many),
                &["x".repeat(10_000)],
                &(0..50).collect::<Vec<_>>()
            )
            .len()
                < 100_000
        );
    }

    #[test]
    fn counts_stay_in_their_cells() {
        assert_eq!(
            [7, 9_999, 12_345, 7_654_321].map(short),
            ["7", "9999", "12k", "7M"]
        );
    }

    #[test]
    fn of_many_classes_the_mean_and_a_few_have_a_curve() {
        let line = vec![[0.0, 1.0], [1.0, 0.5]];
        let curves = Curves {
            classes: (0..1000).collect(),
            precision_recall: vec![line.clone(); 1000],
            mean_precision: line,
            ..Default::default()
        };
        let svg = precision_recall_picture(&curves, &[], &(0..50).collect::<Vec<_>>());
        assert_eq!(svg.matches("<polyline").count(), 1 + MAX_CURVES);
        assert!(svg.contains("mean of 1000 classes"));
    }
}
