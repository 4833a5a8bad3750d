//! The rows of a YOLO label file, checked as strictly as any trainer does.

use crate::dataset::finding::Finding;
use crate::diagnostic::Code;
use crate::eval::{KnownRows, parse_class};
use crate::io;
use std::path::Path;

/// Class of a row, and the sides of its box or of that around its outline.
pub(super) type LabelRow = (usize, [f64; 2]);

/// As in trainers, a row with more columns means that the rows of its file are outlines.
const MAX_BOX_COLUMNS: usize = 6;

/// The good rows of a label file, and the findings about the others. Without a number of classes
/// there are no good rows.
pub(super) fn read_rows(
    path: &Path,
    text: &str,
    class_count: Option<usize>,
) -> (Vec<LabelRow>, Vec<Finding>) {
    let rows = split_rows(text);
    let format = RowFormat::new(&rows, class_count);
    let (mut good, mut findings) = (Vec::new(), Vec::new());
    let mut known = KnownRows::default();
    for (line, row) in rows {
        match format.parse_new(&row, &mut known) {
            Ok(values) => good.push(values),
            Err((code, message)) => findings.push(Finding::in_line(path, line, code, message)),
        }
    }
    let good = good.iter().filter(|_| class_count.is_some());
    let good = good.map(|values| format.label(values)).collect();
    (good, findings)
}

/// The columns of each row that is not empty, with its line number.
fn split_rows(text: &str) -> Vec<(usize, Vec<&str>)> {
    let rows = io::lines(text);
    let rows = rows.map(|row| row.split_whitespace().collect::<Vec<_>>());
    let numbered = (1..).zip(rows);
    numbered
        .filter(|(_, columns)| !columns.is_empty())
        .collect()
}

/// The required format of the rows of a file.
struct RowFormat {
    /// Whether rows are outlines, not boxes.
    outlines: bool,
    class_count: Option<usize>,
}

impl RowFormat {
    fn new(rows: &[(usize, Vec<&str>)], class_count: Option<usize>) -> Self {
        let mut lengths = rows.iter().map(|(_, row)| row.len());
        Self {
            outlines: lengths.any(|columns| columns > MAX_BOX_COLUMNS),
            class_count,
        }
    }

    /// The numbers of a row, or what is wrong with it.
    fn parse(&self, row: &[&str]) -> Result<Vec<f64>, String> {
        self.check_columns(row.len())?;
        let values = row.iter().map(|text| parse_number(text));
        let values: Vec<f64> = values.collect::<Result<_, _>>()?;
        self.check_class(row[0])?;
        check_shares(row, &values)?;
        let [w, h] = self.sides(&values);
        if w <= 0.0 || h <= 0.0 {
            let what = if self.outlines { "an outline" } else { "a box" };
            return Err(format!("{what} of {w} x {h}, expected sides above 0"));
        }
        Ok(values)
    }

    /// The numbers of a row that does not repeat an earlier one.
    fn parse_new(&self, row: &[&str], known: &mut KnownRows) -> Result<Vec<f64>, (Code, String)> {
        let values = self.parse(row).map_err(|what| (Code::BadLabelRow, what))?;
        match known.insert(self.identity(&values)) {
            true => Ok(values),
            false => Err((Code::DuplicateLabelRow, "duplicates an earlier row".into())),
        }
    }

    fn check_columns(&self, count: usize) -> Result<(), String> {
        if self.allows_columns(count) {
            return Ok(());
        }
        let expected = match self.outlines {
            false => "5",
            true => "a class and at least 3 pairs like the file's other rows",
        };
        Err(format!("{count} columns, expected {expected}"))
    }

    fn allows_columns(&self, count: usize) -> bool {
        match self.outlines {
            false => count == 5,
            true => count >= 7 && count % 2 == 1,
        }
    }

    fn check_class(&self, text: &str) -> Result<(), String> {
        let class = parse_class(text)? as usize;
        match self.class_count {
            Some(count) if class >= count => Err(format!(
                "class {class}, expected one of the {count} that data.yaml names, numbered from 0"
            )),
            _ => Ok(()),
        }
    }

    fn label(&self, values: &[f64]) -> LabelRow {
        (values[0] as usize, self.sides(values))
    }

    /// Width and height of a row's box: trainers take that around an outline.
    fn sides(&self, values: &[f64]) -> [f64; 2] {
        match self.outlines {
            false => [values[3], values[4]],
            true => ends(values).map(|[low, high]| high - low),
        }
    }

    /// What trainers tell a row from others by: the class and the box, also of an outline.
    fn identity(&self, values: &[f64]) -> Vec<f64> {
        match self.outlines {
            false => values.to_vec(),
            true => [&values[..1], ends(values).as_flattened()].concat(),
        }
    }
}

/// Where an outline begins and ends, along x and y.
fn ends(values: &[f64]) -> [[f64; 2]; 2] {
    [1, 2].map(|first| {
        let places = values.iter().skip(first).step_by(2);
        places.fold([1.0, 0.0], |[low, high], &place| {
            [place.min(low), place.max(high)]
        })
    })
}

fn parse_number(text: &str) -> Result<f64, String> {
    text.parse()
        .map_err(|_| format!("\"{text}\", expected a number"))
}

fn check_shares(row: &[&str], values: &[f64]) -> Result<(), String> {
    let mut shares = row.iter().zip(values).skip(1);
    match shares.find(|(_, share)| !(0.0..=1.0).contains(*share)) {
        Some((text, _)) => Err(format!("{text}, expected a fraction of the image, 0 to 1")),
        None => Ok(()),
    }
}
