//! CSV as spreadsheets write it in different countries: what separates cells, how numbers are
//! written, which bytes stand for letters.

use crate::error::{Error, Result};
use crate::io;
use std::borrow::Cow;

/// A line of a list of photos.
#[derive(Debug)]
pub(super) struct SpreadsheetRow {
    /// Its place in the file, from 1.
    pub(super) line: u64,
    /// What stands in it, by column; no empty cells.
    pub(super) cells: toml::Table,
}

/// Columns that hold words, and those that hold numbers.
const WORD_COLUMNS: [&str; 6] = ["file", "asset", "role", "class", "screen", "matte"];
const NUMBER_COLUMNS: [&str; 6] = [
    "px_per_metre",
    "length",
    "width",
    "thickness",
    "mass",
    "marker_size",
];
/// A column that holds two numbers with an x between them.
const SIZE_COLUMN: &str = "screen_size";
/// What else a column may be called.
const COLUMN_ALIASES: [(&str, &str); 2] = [("px_per_meter", "px_per_metre"), ("photo", "file")];
/// What may separate cells; of equally many the first.
const SEPARATORS: [u8; 3] = [b',', b';', b'\t'];

/// The rows of a spreadsheet.
///
/// # Errors
/// [`Error::Value`] with the line: a column that no photo has, a cell that is not a number, letters
/// in an unknown encoding.
pub(super) fn rows(bytes: &[u8]) -> Result<Vec<SpreadsheetRow>> {
    let text = text_of(bytes)?;
    let mut reader = csv_reader(&text);
    let headers = reader.headers().map_err(|e| csv_error(&e))?;
    let sheet = Columns::new(headers, separator(&text))?;
    reader
        .records()
        .map(|record| sheet.row(&record.map_err(|e| csv_error(&e))?))
        .filter(|row| !matches!(row, Ok(row) if row.cells.is_empty()))
        .collect()
}

/// The letters of a spreadsheet.
///
/// # Errors
/// [`Error::Value`] for an unknown encoding.
pub(crate) fn text_of(bytes: &[u8]) -> Result<String> {
    // Else the reader of CSV counts lines wrongly.
    let text = decoded(bytes)?.replace("\r\n", "\n");
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}

/// Reads the cells of a text, whatever separates them.
pub(crate) fn csv_reader(text: &str) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .delimiter(separator(text))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes())
}

/// What stands in the columns of a spreadsheet.
struct Columns {
    /// Of those without a name, which some programs put behind the others, empty.
    names: Vec<&'static str>,
    /// A comma in a number cannot separate cells: it may stand for the decimal point.
    has_decimal_commas: bool,
}

impl Columns {
    fn new(headers: &csv::StringRecord, separator: u8) -> Result<Self> {
        let names: Vec<_> = headers.iter().map(column_name).collect::<Result<_>>()?;
        check_once(&names)?;
        Ok(Self {
            names,
            has_decimal_commas: separator != b',',
        })
    }

    fn row(&self, record: &csv::StringRecord) -> Result<SpreadsheetRow> {
        let line = line_of(record);
        let mut cells = toml::Table::new();
        let filled = self.names.iter().zip(record);
        for (name, cell) in filled.filter(|(_, cell)| !cell.is_empty()) {
            let value = self.value(name, cell).map_err(|e| in_line(e, line))?;
            cells.insert((*name).into(), value);
        }
        Ok(SpreadsheetRow { line, cells })
    }

    fn value(&self, column: &str, cell: &str) -> Result<toml::Value> {
        if column.is_empty() {
            let what = format!("\"{cell}\" in a column without a name");
            return Err(Error::value("document", what));
        }
        if WORD_COLUMNS.contains(&column) {
            return Ok(cell.into());
        }
        let (value, expected) = if column == SIZE_COLUMN {
            (self.size(cell), "a size such as 0.60x0.40")
        } else {
            (self.number(cell), "a number such as 0.265")
        };
        value.ok_or_else(|| Error::value(column, format!("\"{cell}\", expected {expected}")))
    }

    /// Two numbers with an x between them.
    fn size(&self, cell: &str) -> Option<toml::Value> {
        let (width, height) = cell.split_once(['x', 'X'])?;
        let sides = [width, height].map(|side| self.number(side.trim()));
        let [Some(width), Some(height)] = sides else {
            return None;
        };
        Some(vec![width, height].into())
    }

    fn number(&self, cell: &str) -> Option<toml::Value> {
        let number: f64 = self.with_decimal_point(cell).parse().ok()?;
        number.is_finite().then(|| number.into())
    }

    fn with_decimal_point<'c>(&self, cell: &'c str) -> Cow<'c, str> {
        if self.has_decimal_comma(cell) {
            cell.replace(',', ".").into()
        } else {
            cell.into()
        }
    }

    /// Between commas a comma in a number may as well separate thousands.
    fn has_decimal_comma(&self, cell: &str) -> bool {
        self.has_decimal_commas && !cell.contains('.') && cell.matches(',').count() == 1
    }
}

/// UTF-8, or the code of Western European Windows, in which spreadsheets write `ü` by default.
fn decoded(bytes: &[u8]) -> Result<String> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Ok(text.to_owned());
    }
    if bytes.iter().any(|&byte| is_control_code(byte)) {
        return Err(Error::value(
            "document",
            "neither UTF-8 nor Windows-1252, expected a CSV file in UTF-8",
        ));
    }
    // Above the control codes that code is Latin-1, whose bytes are the first characters of
    // Unicode.
    Ok(bytes.iter().copied().map(char::from).collect())
}

/// A byte that no text has whose letters are single bytes.
fn is_control_code(byte: u8) -> bool {
    (0x80..0xa0).contains(&byte) || byte == 0
}

/// What separates the cells, by the first line.
fn separator(text: &str) -> u8 {
    let header = text.lines().next().unwrap_or_default();
    SEPARATORS
        .into_iter()
        .rev()
        .max_by_key(|separator| header.bytes().filter(|byte| byte == separator).count())
        .unwrap_or(b',')
}

/// Fails on a name that two columns have.
fn check_once(names: &[&str]) -> Result<()> {
    let mut named = names
        .iter()
        .enumerate()
        .filter(|(_, name)| !name.is_empty());
    match named.find(|(i, name)| names[..*i].contains(name)) {
        Some((_, name)) => {
            let what = format!("column \"{name}\" appears twice");
            Err(Error::value("line 1", what))
        }
        None => Ok(()),
    }
}

/// The name of a column, however it is written.
fn column_name(header: &str) -> Result<&'static str> {
    let plain = header.to_lowercase().replace([' ', '-'], "_");
    let alias = COLUMN_ALIASES.iter().find(|(alias, _)| *alias == plain);
    let name = alias.map_or(plain.as_str(), |(_, name)| name);
    let known = [&WORD_COLUMNS[..], &NUMBER_COLUMNS, &[SIZE_COLUMN]].concat();
    match known.iter().chain(&[""]).find(|known| **known == name) {
        Some(known) => Ok(known),
        None => {
            let suggestion = io::suggestion(name, &known);
            let what = format!("unknown column \"{header}\", {suggestion}");
            Err(Error::value("line 1", what))
        }
    }
}

/// Where a line of cells stands in its file, from 1.
pub(crate) fn line_of(record: &csv::StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}

/// The same error, of a line of the file.
pub(crate) fn in_line(error: Error, line: u64) -> Error {
    match error {
        Error::Value { at, what } if at == "document" => Error::value(format!("line {line}"), what),
        Error::Value { at, what } => Error::value(format!("line {line}: {at}"), what),
        other => other,
    }
}

/// What is wrong with the cells, in our words, and in which line.
pub(crate) fn csv_error(error: &csv::Error) -> Error {
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} cells, expected {expected_len}"),
        _ => error.to_string(),
    };
    Error::value(place_of(error), what)
}

fn place_of(error: &csv::Error) -> String {
    let line = error.position().map(csv::Position::line);
    line.map_or_else(|| "document".to_owned(), |line| format!("line {line}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(bytes: &[u8]) -> std::result::Result<Vec<String>, String> {
        let rows = rows(bytes).map_err(|e| e.to_string())?;
        Ok(rows
            .into_iter()
            .map(|row| format!("{}: {}", row.line, row.cells).replace('\n', ", "))
            .collect())
    }

    const ROW: &str = "2: asset = \"b\", file = \"a.jpg\", length = 0.265, ";

    #[test]
    fn separators_and_numbers_of_any_country_say_the_same() {
        for text in [
            "file,asset,length\na.jpg,b,0.265\n",
            "File;Asset;LENGTH\r\na.jpg;b;0,265\r\n;;\r\n",
            "\u{feff}file\tasset\tlength\na.jpg\tb\t0,265\n",
            "\"file\";\"asset\";\"length\"\n\"a.jpg\";\"b\";0.265",
            "file,asset,length,,\na.jpg,b,0.265,,\n",
        ] {
            assert_eq!(table(text.as_bytes()).unwrap(), [ROW], "{text}");
        }
    }

    #[test]
    fn a_scale_may_be_spelled_in_american_and_in_capitals() {
        for header in [
            "px_per_meter",
            "PX_PER_METRE",
            "px per metre",
            "Px-Per-Meter",
        ] {
            assert_eq!(
                table(format!("{header}\n2000\n").as_bytes()).unwrap(),
                ["2: px_per_metre = 2000.0, "]
            );
        }
    }

    #[test]
    fn a_size_is_two_numbers() {
        let rows = table("file;screen_size\na;0,60x0,40\n".as_bytes()).unwrap();
        assert_eq!(rows, ["2: file = \"a\", screen_size = [0.6, 0.4], "]);
        let reported = table("screen size\n0.6\n".as_bytes()).unwrap_err();
        assert_eq!(
            reported,
            "line 2: screen_size: \"0.6\", expected a size such as 0.60x0.40"
        );
    }

    #[test]
    fn letters_of_a_western_spreadsheet_are_read() {
        let umlaut = ["2: file = \"gr\u{fc}n.jpg\", "];
        assert_eq!(table(b"file\ngr\xfcn.jpg\n").unwrap(), umlaut);
        assert_eq!(table("file\ngr\u{fc}n.jpg\n".as_bytes()).unwrap(), umlaut);
        assert!(
            table(b"file\ngr\x81n.jpg\n")
                .unwrap_err()
                .contains("expected a CSV file in UTF-8")
        );
        assert!(
            table(b"\xff\xfef\0i\0l\0e\0")
                .unwrap_err()
                .contains("expected a CSV file in UTF-8")
        );
    }

    #[test]
    fn mistakes_name_line_and_column() {
        let reported = |text: &str| table(text.as_bytes()).unwrap_err();
        assert_eq!(
            reported("file,lenght\n"),
            "line 1: unknown column \"lenght\", did you mean \"length\"?"
        );
        assert_eq!(
            reported("photo,length,file\n"),
            "line 1: column \"file\" appears twice"
        );
        assert_eq!(
            reported("file,\na,\nb,c\n"),
            "line 3: \"c\" in a column without a name"
        );
        assert_eq!(
            reported("file,mass\na,b\n"),
            "line 2: mass: \"b\", expected a number such as 0.265"
        );
        // An English thousand, or a decimal comma?
        assert!(
            reported("file,px_per_metre\na,\"1,966\"\n")
                .starts_with("line 2: px_per_metre: \"1,966\"")
        );
        assert!(
            reported("file;px_per_metre\na;1.966,7\n")
                .starts_with("line 2: px_per_metre: \"1.966,7\"")
        );
        assert!(reported("length\nnan\n").starts_with("line 2: length: \"nan\""));
        assert_eq!(
            reported("file,asset\na,b\nc\n"),
            "line 3: 1 cells, expected 2"
        );
    }
}
