//! Tables of measurements, from a list of columns.

use petcomp::plot::Table;

/// The title of a column, and the function for its cells.
pub(crate) type Column<R> = (&'static str, fn(&R) -> String);

/// A table with a line per row.
pub(crate) fn table_of<'a, R: 'a>(
    columns: &[Column<R>],
    rows: impl IntoIterator<Item = &'a R>,
) -> Table {
    let mut table = Table::new(columns.iter().map(|(title, _)| *title));
    for row in rows {
        table.push(columns.iter().map(|(_, cell)| cell(row)));
    }
    table
}

/// A number with four decimals.
pub(crate) fn four(number: f64) -> String {
    format!("{number:.4}")
}

/// A number with this many decimals; empty if there is none.
pub(crate) fn number_or_empty(number: Option<f64>, decimals: usize) -> String {
    number.map_or_else(String::new, |v| format!("{v:.decimals$}"))
}

/// A table of existing rows.
pub(crate) fn table_from<const N: usize>(
    titles: [&str; N],
    lines: impl IntoIterator<Item = [String; N]>,
) -> Table {
    let mut table = Table::new(titles);
    lines.into_iter().for_each(|line| table.push(line));
    table
}
