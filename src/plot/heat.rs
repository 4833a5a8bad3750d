//! Maps of positions in pictures.

use super::markup::text;
use maud::{Markup, html};

/// Columns and rows of cells, and a cell's side in SVG units.
const GRID_CELLS: [usize; 2] = [32, 24];
const CELL_SIDE: f64 = 9.0;
/// Room for the title, SVG units.
const TITLE_HEIGHT: f64 = 22.0;

/// How many positions, as shares of a picture's width and height, fall into each cell: darker means
/// more. Those outside the picture are ignored.
pub(crate) fn heat_map(title: &str, places: &[[f64; 2]]) -> String {
    let [width, height] = GRID_CELLS.map(|n| n as f64 * CELL_SIDE);
    let whole_height = height + TITLE_HEIGHT;
    html! {
        svg xmlns="http://www.w3.org/2000/svg" class="heat" width=(width) height=(whole_height)
            viewBox=(format_args!("0 0 {width} {whole_height}")) font-family="sans-serif" font-size="11" {
            text x="0" y="14" { (text(title)) }
            (filled_cells(&counts_by_cell(places)))
            rect x="0.5" y=(TITLE_HEIGHT) width=(width - 1.0) height=(height - 0.5) fill="none" stroke="#888" {}
        }
    }
    .into_string()
        + "\n"
}

/// Positions in each cell, row by row.
fn counts_by_cell(places: &[[f64; 2]]) -> Vec<u64> {
    let mut counts = vec![0_u64; GRID_CELLS[0] * GRID_CELLS[1]];
    for cell in places.iter().filter_map(cell_of) {
        counts[cell] += 1;
    }
    counts
}

/// The cell of a position, if it is inside the picture.
fn cell_of(place: &[f64; 2]) -> Option<usize> {
    if !place.iter().all(|share| (0.0..=1.0).contains(share)) {
        return None;
    }
    let [column, row] =
        [0, 1].map(|i| ((place[i] * GRID_CELLS[i] as f64) as usize).min(GRID_CELLS[i] - 1));
    Some(row * GRID_CELLS[0] + column)
}

/// The cells that are not empty.
fn filled_cells(counts: &[u64]) -> Markup {
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    html! {
        @for (i, count) in counts.iter().copied().enumerate().filter(|(_, count)| *count > 0) {
            rect x=((i % GRID_CELLS[0]) as f64 * CELL_SIDE)
                y=(TITLE_HEIGHT + (i / GRID_CELLS[0]) as f64 * CELL_SIDE)
                width=(CELL_SIDE) height=(CELL_SIDE) fill="#0072b2"
                opacity=(format_args!("{:.2}", opacity(count, most))) { title { (count) } }
        }
    }
}

/// By the square root, so that few can be distinguished from none.
fn opacity(count: u64, most: u64) -> f64 {
    0.06 + 0.94 * (count as f64 / most as f64).sqrt()
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
