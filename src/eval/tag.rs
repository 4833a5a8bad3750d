//! Tags of images (light, camera position, ..), for scores per factor.

use super::EvalImage;
use super::yolo::{is_picture, no_image};
use crate::asset::spreadsheet::{csv_error, csv_reader, in_line, line_of, text_of};
use crate::error::{Error, Result};
use crate::io;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What is known of each image beside its boxes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tags {
    /// The factors: `light`, `camera`, ..
    pub factors: Vec<String>,
    levels: BTreeMap<String, Vec<String>>,
}

/// Reads a CSV, as spreadsheets write it, whose first column is the image and whose others are
/// factors; its first line names them.
///
/// An image is called as its sheet is, or by its file, in a folder or without one. An empty cell
/// says nothing.
///
/// # Errors
/// [`Error::File`] for a file that cannot be read; [`Error::Field`] for one without a line of
/// names, a line of another length, an image that is listed twice, or one without any image
/// that a sheet is of.
pub fn read_tags(path: &Path, sheets: &[EvalImage]) -> Result<Tags> {
    let bytes = io::read_bytes(path)?;
    parse(&bytes, sheets).map_err(|e| e.in_file(path))
}

fn parse(bytes: &[u8], sheets: &[EvalImage]) -> Result<Tags> {
    let text = without_blank_lines(&text_of(bytes)?);
    let mut reader = csv_reader(&text);
    let mut tags = Tags::with_titles(reader.headers().map_err(|e| csv_error(&e))?)?;
    let mut unknown = Vec::new();
    let images = sheets.iter().map(|sheet| sheet.image.as_str()).collect();
    for row in reader.records() {
        let row = row.map_err(|e| csv_error(&e))?;
        if row.iter().all(str::is_empty) {
            continue;
        }
        match image_called(&row[0], &images) {
            Ok(image) => tags
                .add(image, &row)
                .map_err(|e| in_line(e, line_of(&row)))?,
            Err(e) => unknown.push(in_line(e, line_of(&row))),
        }
    }
    pass_over(unknown, tags.levels.is_empty())?;
    Ok(tags)
}

/// The reader of CSV passes over empty lines, not over those of spaces; numbers of lines stay.
fn without_blank_lines(text: &str) -> String {
    let lines = text.lines();
    lines
        .map(|line| if line.trim().is_empty() { "" } else { line })
        .flat_map(|line| [line, "\n"])
        .collect()
}

/// Lines of images that are not in the truth: a table may be of a whole dataset. Where there are no
/// others it is of another one.
fn pass_over(unknown: Vec<Error>, are_all: bool) -> Result<()> {
    let count = unknown.len();
    let Some(first) = unknown.into_iter().next() else {
        return Ok(());
    };
    if are_all {
        return Err(first);
    }
    log::warn!("tags: {count} lines are passed over, the first: {first}");
    Ok(())
}

/// The image that a name in a table means.
fn image_called<'a>(name: &str, images: &BTreeSet<&'a str>) -> Result<&'a str> {
    let file = name.rsplit('/').next().unwrap_or_default();
    let names = [name, file, without_extension(file)];
    let image = names.into_iter().find_map(|name| images.get(name));
    image
        .copied()
        .ok_or_else(|| Error::value("document", no_image(name, images.len())))
}

/// Of an image's file; any other name stays, whatever dots are in it.
fn without_extension(file: &str) -> &str {
    match file.rsplit_once('.') {
        Some((stem, _)) if is_picture(Path::new(file)) => stem,
        _ => file,
    }
}

/// What a row of cells says of a factor.
fn level(row: &[String], factor: usize) -> Option<&str> {
    let cell = row.get(factor).map(String::as_str);
    cell.filter(|cell| !cell.is_empty())
}

impl Tags {
    /// Adds an image's line: its level of each factor.
    fn add(&mut self, image: &str, row: &csv::StringRecord) -> Result<()> {
        let levels = row.iter().skip(1).map(String::from).collect();
        match self.levels.insert(image.to_owned(), levels) {
            None => Ok(()),
            Some(_) => {
                let what = format!("image \"{}\" is listed twice", &row[0]);
                Err(Error::value("document", what))
            }
        }
    }

    /// No tags yet, for the factors that the first line names behind the image.
    fn with_titles(titles: &csv::StringRecord) -> Result<Self> {
        if titles.len() < 2 {
            let what = "no factors, expected a first line such as image,light,camera";
            return Err(Error::value("line 1", what));
        }
        Ok(Self {
            factors: titles.iter().skip(1).map(String::from).collect(),
            levels: BTreeMap::new(),
        })
    }

    /// What a factor is for an image; none for an image without tags.
    pub fn of(&self, image: &str, factor: usize) -> Option<&str> {
        level(self.levels.get(image)?, factor)
    }

    /// Everything that a factor is for some image, in order.
    pub fn levels(&self, factor: usize) -> BTreeSet<&str> {
        let rows = self.levels.values();
        rows.filter_map(|row| level(row, factor)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tags_of(text: &str, images: &[&str]) -> std::result::Result<Tags, String> {
        let sheets = images.iter().map(|image| EvalImage::new(*image, vec![]));
        let sheets: Vec<EvalImage> = sheets.collect();
        parse(text.as_bytes(), &sheets).map_err(|e| e.to_string())
    }

    #[test]
    fn factors_are_told_by_image() {
        let text = "image,light,camera\nval/a.png, dim, v0\nb,bright,v1\n,,\nc,,v1\n";
        let tags = tags_of(text, &["a", "b", "c", "d"]).unwrap();
        assert_eq!(
            (tags.of("a", 0), tags.of("b", 1), tags.of("d", 0)),
            (Some("dim"), Some("v1"), None)
        );
        assert_eq!(Vec::from_iter(tags.levels(0)), ["bright", "dim"]);
    }

    #[test]
    fn tables_of_a_spreadsheet_are_read() {
        let text = "\u{feff}image;light\r\na;\"dim; from the left\"\r\n";
        let tags = tags_of(text, &["a"]).unwrap();
        assert_eq!(tags.of("a", 0), Some("dim; from the left"));
    }

    #[test]
    fn a_name_with_dots_is_no_name_with_an_extension() {
        let images = ["cam1.2024-01-01", "cam1.2024-01-02"];
        let text = "image,light\ncam1.2024-01-01,dim\ncam1.2024-01-02.JPG,bright\n";
        let tags = tags_of(text, &images).unwrap();
        assert_eq!(
            images.map(|image| tags.of(image, 0)),
            [Some("dim"), Some("bright")]
        );
    }

    #[test]
    fn bad_tables_are_named() {
        let told = |text| tags_of(text, &["a"]).unwrap_err();
        assert_eq!(
            told(""),
            "line 1: no factors, expected a first line such as image,light,camera"
        );
        assert_eq!(
            told("image,light\na,dim,v0\n"),
            "line 2: 3 cells, expected 2"
        );
        assert_eq!(
            told("image,light\na,dim\na.png,dim\n"),
            "line 3: image \"a.png\" is listed twice"
        );
        assert_eq!(
            told("image,light\nb,dim\nc,dim\n"),
            "line 2: no image \"b\" in the truth of 1 images"
        );
    }

    #[test]
    fn a_table_of_the_whole_dataset_is_that_of_a_part_too() {
        let tags = tags_of("image,light\nz,dim\n  \na,bright\n", &["a"]).unwrap();
        assert_eq!(Vec::from_iter(tags.levels(0)), ["bright"]);
    }
}
