//! Curves and the confusion matrix as SVG.

use super::{Confusion, Curves};
use crate::report::{Axis, Chart, escaped};

/// Side of a cell of the matrix, and room for names, in SVG units.
const CELL: f64 = 56.0;
const NAMES: f64 = 150.0;

/// Precision over recall, a curve per class.
pub fn precision_recall_picture(curves: &Curves, names: &[String]) -> String {
    picture("precision and recall at IoU 0.5", ["recall", "precision"], &curves.precision_recall, curves, names)
}

/// F1 over confidence, a curve per class.
pub fn f1_picture(curves: &Curves, names: &[String]) -> String {
    let title = format!("F1 at IoU 0.5, best mean at confidence {:.3}", curves.best_confidence);
    picture(&title, ["confidence", "F1"], &curves.f1, curves, names)
}

fn picture(title: &str, axes: [&str; 2], lines: &[Vec<[f64; 2]>], curves: &Curves, names: &[String]) -> String {
    let [across, up] = axes.map(|title| Axis { title: title.into(), range: [0.0, 1.0], logarithmic: false });
    let names = curves.classes.iter().map(|&class| class_name(class as usize, names)).collect();
    let chart = Chart { title: title.into(), names, across, up, curves: lines.to_vec(), defaults: Vec::new() };
    Chart::row(&[chart])
}

/// Found against true classes: each column's shares as shades, counts in words.
pub fn confusion_picture(confusion: &Confusion, names: &[String]) -> String {
    let n = confusion.counts.len();
    let side = NAMES + CELL * n as f64;
    // The turned name of the last column reaches beyond it.
    let width = side + NAMES / 2.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{side}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"{width}\" height=\"{side}\" fill=\"white\"/>\n"
    );
    svg += &word([NAMES / 2.0, 20.0], "middle", "found, down; true, across", "");
    for i in 0..n {
        let name = if i + 1 == n { "background".into() } else { class_name(i, names) };
        let middle = NAMES + CELL * (i as f64 + 0.5);
        svg += &word([NAMES / 2.0, middle + 4.0], "middle", &name, "");
        let turned = format!(" transform=\"rotate(-40 {middle} {})\"", NAMES - 8.0);
        svg += &word([middle, NAMES - 8.0], "start", &name, &turned);
        for j in 0..n {
            svg += &cell(confusion, i, j);
        }
    }
    svg + "</svg>\n"
}

fn cell(confusion: &Confusion, found: usize, truth: usize) -> String {
    let count = confusion.counts[found][truth];
    let all: u64 = confusion.counts.iter().map(|row| row[truth]).sum();
    let share = if all > 0 { count as f64 / all as f64 } else { 0.0 };
    let [x, y] = [truth, found].map(|i| NAMES + CELL * i as f64);
    let light = 255.0 - 200.0 * share;
    let ink = if share > 0.6 { " fill=\"white\"" } else { "" };
    format!(
        "<rect x=\"{x}\" y=\"{y}\" width=\"{CELL}\" height=\"{CELL}\" fill=\"rgb({light:.0},{light:.0},255)\" stroke=\"#ccc\"/>\n"
    ) + &word([x + CELL / 2.0, y + CELL / 2.0 + 4.0], "middle", &count.to_string(), ink)
}

fn word([x, y]: [f64; 2], anchor: &str, text: &str, more: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{}</text>\n", escaped(text))
}

fn class_name(class: usize, names: &[String]) -> String {
    names.get(class).cloned().unwrap_or_else(|| format!("class {class}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_has_a_cell_for_every_pair_and_keeps_names_as_text() {
        let confusion = Confusion { counts: vec![vec![3, 0], vec![1, 0]] };
        let svg = confusion_picture(&confusion, &["<cap>".into()]);
        assert_eq!(svg.matches("stroke=\"#ccc\"").count(), 4);
        assert!(svg.contains("&lt;cap&gt;") && svg.contains(">3</text>") && !svg.contains("NaN"));
    }
}
