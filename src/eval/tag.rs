//! Tags of images (light, camera position, ..), for scores per factor.

use super::{filled_lines, in_line};
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

/// Reads a CSV whose first column is the image's name and whose others are factors; its first line
/// names them.
///
/// # Errors
/// [`Error::File`] for a file without a line of names, a line of another length, or an image listed
/// twice.
pub fn read_tags(path: &Path) -> Result<Tags> {
    let text = io::read_text(path)?;
    parse(&text).map_err(|what| Error::file(path, what))
}

fn parse(text: &str) -> std::result::Result<Tags, String> {
    let mut lines = filled_lines(text);
    let titles = lines.next().map(|(_, line)| cells(line));
    let mut tags = Tags::with_titles(&titles.unwrap_or_default())?;
    for (i, line) in lines {
        tags.add(cells(line)).map_err(|what| in_line(i, &what))?;
    }
    Ok(tags)
}

fn cells(line: &str) -> Vec<String> {
    line.split(',').map(|cell| cell.trim().to_owned()).collect()
}

/// The name of an image without folder and extension.
fn stem_of(name: &str) -> String {
    let stem = Path::new(name).file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

impl Tags {
    /// Adds a line: the image and its level of each factor.
    fn add(&mut self, row: Vec<String>) -> std::result::Result<(), String> {
        self.check_cells(&row)?;
        match self.levels.insert(stem_of(&row[0]), row[1..].to_vec()) {
            None => Ok(()),
            Some(_) => Err(format!("image \"{}\" is listed twice", row[0])),
        }
    }

    fn check_cells(&self, row: &[String]) -> std::result::Result<(), String> {
        let expected = 1 + self.factors.len();
        if row.len() == expected {
            return Ok(());
        }
        Err(format!("{} cells, expected {expected}", row.len()))
    }

    /// No tags yet, for the factors that the first line names behind the image.
    fn with_titles(titles: &[String]) -> std::result::Result<Self, String> {
        if titles.len() < 2 {
            return Err("no factors, expected a first line such as image,light,camera".into());
        }
        Ok(Self {
            factors: titles[1..].to_vec(),
            levels: BTreeMap::new(),
        })
    }

    /// What a factor is for an image; none for an image without tags.
    pub fn of(&self, image: &str, factor: usize) -> Option<&str> {
        self.levels.get(image)?.get(factor).map(String::as_str)
    }

    /// Everything that a factor is for some image, in order.
    pub fn levels(&self, factor: usize) -> BTreeSet<&str> {
        self.levels
            .values()
            .filter_map(|row| row.get(factor).map(String::as_str))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_told_by_image() {
        let tags = parse("image,light,camera\na.png, dim, v0\nb,bright,v1\n").unwrap();
        assert_eq!(
            (tags.of("a", 0), tags.of("b", 1), tags.of("c", 0)),
            (Some("dim"), Some("v1"), None)
        );
        assert_eq!(
            tags.levels(0).into_iter().collect::<Vec<_>>(),
            ["bright", "dim"]
        );
    }

    #[test]
    fn bad_tables_are_named() {
        assert!(parse("").unwrap_err().contains("no factors"));
        assert!(
            parse("image,light\na,dim,v0\n")
                .unwrap_err()
                .contains("line 2: 3 cells, expected 2")
        );
        assert!(
            parse("image,light\na,dim\na.png,dim\n")
                .unwrap_err()
                .contains("listed twice")
        );
    }
}
