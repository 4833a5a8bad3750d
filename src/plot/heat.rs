//! Maps of where things are in pictures.

use super::escaped;
use std::fmt::Write;

/// Cells across and down, and a cell's side in SVG units.
const CELLS: [usize; 2] = [32, 24];
const CELL: f64 = 9.0;
/// Room for the title.
const TOP: f64 = 22.0;

/// How many places, as shares of a picture's width and height, lie in each part of it: the darker the more. Those
/// outside the picture are left out.
pub(crate) fn heat_map(title: &str, places: &[[f64; 2]]) -> String {
    let mut counts = vec![0_u64; CELLS[0] * CELLS[1]];
    for place in places
        .iter()
        .filter(|place| place.iter().all(|share| (0.0..=1.0).contains(share)))
    {
        let [column, row] =
            [0, 1].map(|i| ((place[i] * CELLS[i] as f64) as usize).min(CELLS[i] - 1));
        counts[row * CELLS[0] + column] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    let [width, height] = CELLS.map(|n| n as f64 * CELL);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"heat\" width=\"{:.0}\" height=\"{:.0}\" \
         viewBox=\"0 0 {width} {:.0}\" font-family=\"sans-serif\" font-size=\"11\">\n",
        width,
        height + TOP,
        height + TOP
    );
    let _ = writeln!(svg, "<text x=\"0\" y=\"14\">{}</text>", escaped(title));
    for (i, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let [x, y] = [
            (i % CELLS[0]) as f64 * CELL,
            TOP + (i / CELLS[0]) as f64 * CELL,
        ];
        // By the square root, so that few are told from none.
        let ink = 0.06 + 0.94 * (count as f64 / most as f64).sqrt();
        let _ = writeln!(
            svg,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{CELL}\" height=\"{CELL}\" fill=\"#0072b2\" opacity=\"{ink:.2}\">\
             <title>{count}</title></rect>"
        );
    }
    let _ = writeln!(
        svg,
        "<rect x=\"0.5\" y=\"{TOP}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888\"/>",
        width - 1.0,
        height - 0.5
    );
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_in_the_picture_is_counted_once() {
        let svg = heat_map(
            "a & b",
            &[
                [0.0, 0.0],
                [0.01, 0.01],
                [1.0, 1.0],
                [1.2, 0.5],
                [f64::NAN, 0.5],
            ],
        );
        assert!(
            svg.contains("<title>2</title>")
                && svg.contains("<title>1</title>")
                && svg.contains("a &amp; b")
        );
        assert_eq!(svg.matches("<title>").count(), 2);
    }
}
