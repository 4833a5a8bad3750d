//! Tables of text: CSV for programs, Markdown for the README, HTML for the page.

use super::markup::text;
use crate::error::printable;
use maud::html;

/// A table: columns with titles, which include units, and rows of text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Titles of the columns.
    pub columns: Vec<String>,
    /// Cells; each row has as many as there are columns.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<'a>(columns: impl IntoIterator<Item = &'a str>) -> Self {
        Self {
            columns: columns.into_iter().map(String::from).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// When the number of cells is not the number of columns.
    pub fn push(&mut self, row: impl IntoIterator<Item = impl Into<String>>) {
        let row: Vec<String> = row.into_iter().map(Into::into).collect();
        assert_eq!(row.len(), self.columns.len(), "one cell per column");
        self.rows.push(row);
    }

    /// Rows and columns swapped: for tables that are wider than long.
    pub fn transposed(&self) -> Self {
        let mut columns =
            (0..self.columns.len()).map(|i| self.lines().map(|row| row[i].clone()).collect());
        Self {
            columns: columns.next().unwrap_or_default(),
            rows: columns.collect(),
        }
    }

    /// The first rows of the table.
    pub(super) fn first_rows(&self, count: usize) -> Self {
        Self {
            columns: self.columns.clone(),
            rows: self.rows.iter().take(count).cloned().collect(),
        }
    }

    /// As comma-separated values (RFC 4180), the titles first.
    pub fn csv(&self) -> String {
        self.lines()
            .map(|row| joined(row, ",", csv_cell) + "\n")
            .collect()
    }

    /// As a Markdown table.
    pub fn markdown(&self) -> String {
        let rule = format!("|{}", " --- |".repeat(self.columns.len()));
        let mut lines = self
            .lines()
            .map(|row| format!("| {} |", joined(row, " | ", markdown_cell)));
        let titles = lines.next().unwrap_or_default();
        [titles, rule]
            .into_iter()
            .chain(lines)
            .map(|line| line + "\n")
            .collect()
    }

    /// As an HTML table.
    pub fn html(&self) -> String {
        html! {
            table {
                thead { tr { @for title in &self.columns { th { (text(title)) } } } }
                tbody {
                    @for row in &self.rows { tr { @for cell in row { td { (text(cell)) } } } }
                }
            }
        }
        .into_string()
    }

    fn lines(&self) -> impl Iterator<Item = &Vec<String>> {
        std::iter::once(&self.columns).chain(&self.rows)
    }
}

fn joined(row: &[String], separator: &str, cell: fn(&str) -> String) -> String {
    let cells: Vec<String> = row.iter().map(|text| cell(text)).collect();
    cells.join(separator)
}

fn csv_cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn markdown_cell(text: &str) -> String {
    printable(text).replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_twice_it_is_the_same() {
        let mut table = awkward();
        table.push(["c", "d"]);
        assert_eq!(table.transposed().columns, ["case", "a|b <c>", "c"]);
        assert_eq!(table.transposed().transposed(), table);
        assert_eq!(Table::default().transposed(), Table::default());
    }

    fn awkward() -> Table {
        let mut table = Table::new(["case", "error, px"]);
        table.push(["a|b <c>", "1\"2"]);
        table
    }

    #[test]
    fn awkward_cells_stay_one_cell() {
        assert_eq!(awkward().csv(), "case,\"error, px\"\na|b <c>,\"1\"\"2\"\n");
        assert_eq!(
            awkward().markdown(),
            "| case | error, px |\n| --- | --- |\n| a\\|b <c> | 1\"2 |\n"
        );
        assert!(awkward().html().contains("<td>a|b &lt;c&gt;</td>"));
    }

    #[test]
    #[should_panic(expected = "one cell per column")]
    fn a_short_row_is_refused() {
        Table::new(["a", "b"]).push(["1"]);
    }
}
