//! Tags of images (light, camera position, ..), for scores per factor.

use super::EvalImage;
use super::yolo::{is_picture, no_image};
use crate::asset::spreadsheet::{csv_error, csv_reader, in_line, line_of, text_of};
use crate::error::{Error, Result};
use crate::io;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What is known about each image besides its boxes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tags {
    /// The factors: `light`, `camera`, ..
    pub factors: Vec<String>,
    levels: BTreeMap<String, Vec<String>>,
}

/// Reads a CSV, as written by spreadsheets, whose first column is the image and whose other columns
/// are factors, named in the header line.
///
/// An image is identified by the name of its sheet, or by its file name; the folder may be omitted
/// if only one image has that file name. Empty cells are ignored.
///
/// # Errors
/// [`Error::File`] for a file that cannot be read; [`Error::Field`] for one without a header line,
/// a line of different length, an image that is listed twice, an ambiguous name, or a file in which
/// no image belongs to a sheet.
pub fn read_tags(path: &Path, sheets: &[EvalImage]) -> Result<Tags> {
    let bytes = io::read_bytes(path)?;
    let (tags, ignored) = parse(&bytes, sheets).map_err(|e| e.in_file(path))?;
    if let Some(first) = ignored.first() {
        let (path, count) = (path.display(), ignored.len());
        log::warn!("{path}: {count} lines are ignored, the first: {first}");
    }
    Ok(tags)
}

/// The tags, and why lines of images that are not in the truth are ignored: a table may cover a
/// whole dataset. If no image is in the truth, it belongs to another one.
fn parse(bytes: &[u8], sheets: &[EvalImage]) -> Result<(Tags, Vec<Error>)> {
    let text = without_blank_lines(&text_of(bytes)?);
    let mut reader = csv_reader(&text);
    let mut tags = Tags::with_titles(reader.headers().map_err(|e| csv_error(&e))?)?;
    let mut unknown = Vec::new();
    let images = Images::new(sheets);
    for row in reader.records() {
        let row = row.map_err(|e| csv_error(&e))?;
        if row.iter().all(str::is_empty) {
            continue;
        }
        let here = |e| in_line(e, line_of(&row));
        match images.called(&row[0]).map_err(here)? {
            Some(image) => tags.add(image, &row).map_err(here)?,
            None => unknown.push(here(images.missing(&row[0]))),
        }
    }
    match tags.levels.is_empty() && !unknown.is_empty() {
        true => Err(unknown.swap_remove(0)),
        false => Ok((tags, unknown)),
    }
}

/// Empties lines of spaces, which the CSV reader would not skip; line numbers are preserved.
fn without_blank_lines(text: &str) -> String {
    let lines = text.lines();
    lines
        .map(|line| if line.trim().is_empty() { "" } else { line })
        .flat_map(|line| [line, "\n"])
        .collect()
}

/// The images of the truth.
struct Images<'a> {
    names: BTreeSet<&'a str>,
    /// Those in folders, by file name alone.
    in_folders: BTreeMap<&'a str, Vec<&'a str>>,
}

impl<'a> Images<'a> {
    fn new(sheets: &'a [EvalImage]) -> Self {
        let names: BTreeSet<&str> = sheets.iter().map(|sheet| sheet.image.as_str()).collect();
        let mut in_folders: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for &name in &names {
            if let Some((_, file)) = name.rsplit_once('/') {
                in_folders.entry(file).or_default().push(name);
            }
        }
        Self { names, in_folders }
    }

    /// The image that a name in a table refers to.
    fn called(&self, name: &str) -> Result<Option<&'a str>> {
        // With as many of its folders as in the truth.
        let image = paths_below(name).find_map(|path| self.named(path));
        match image {
            Some(image) => Ok(Some(image)),
            None => self.of_file(name),
        }
    }

    fn named(&self, path: &str) -> Option<&'a str> {
        let name = self.names.get(path);
        name.or_else(|| self.names.get(without_extension(path)))
            .copied()
    }

    /// The only image with this file name.
    fn of_file(&self, name: &str) -> Result<Option<&'a str>> {
        let images = self.in_folders.get(name);
        let images = images.or_else(|| self.in_folders.get(without_extension(name)));
        match images.map(Vec::as_slice) {
            None | Some(&[]) => Ok(None),
            Some(&[image]) => Ok(Some(image)),
            Some(&[first, second, ..]) => {
                let what = format!(
                    "image \"{name}\" could be {first} or {second}, expected its folder too"
                );
                Err(Error::value("document", what))
            }
        }
    }

    fn missing(&self, name: &str) -> Error {
        Error::value("document", no_image(name, self.names.len()))
    }
}

/// The path, then without its first folder, without its first two and so on.
fn paths_below(path: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(path), |path| Some(path.split_once('/')?.1))
}

/// Strips the extension of an image file; other names keep their dots.
fn without_extension(file: &str) -> &str {
    match file.rsplit_once('.') {
        Some((stem, _)) if is_picture(Path::new(file)) => stem,
        _ => file,
    }
}

/// The level of a factor in a row of cells.
fn level(row: &[String], factor: usize) -> Option<&str> {
    let cell = row.get(factor).map(String::as_str);
    cell.filter(|cell| !cell.is_empty())
}

impl Tags {
    /// Adds an image's line: its level for each factor.
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

    /// Empty tags for the factors in the header line, after the image column.
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

    /// The level of a factor for an image; none for an image without tags.
    pub fn of(&self, image: &str, factor: usize) -> Option<&str> {
        level(self.levels.get(image)?, factor)
    }

    /// All levels that a factor has for some image, in order.
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
        let parsed = parse(text.as_bytes(), &sheets).map_err(|e| e.to_string());
        parsed.map(|(tags, _)| tags)
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
    fn folders_tell_images_of_one_name_apart() {
        let images = ["cam0/1", "cam1/1", "cam1/2"];
        let text = "image,light\nset/cam0/1.png,dim\ncam1/1.png,bright\n2.png,dark\n";
        let tags = tags_of(text, &images).unwrap();
        assert_eq!(
            images.map(|image| tags.of(image, 0)),
            [Some("dim"), Some("bright"), Some("dark")]
        );
        assert_eq!(
            tags_of("image,light\n1.png,dim\n", &images).unwrap_err(),
            "line 2: image \"1.png\" could be cam0/1 or cam1/1, expected its folder too"
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
