//! Labels in Pascal VOC format: one XML file for each image, and lists of images.

use crate::dataset::paths::{create_part_folders, remove_files};
use crate::dataset::{Entry, Extent, LabelledObject, Part, PictureFormat, Writer, Written};
use crate::error::Result;
use crate::geom::BBox;
use crate::io;
use crate::label::ObjectLabel;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Writes `voc/{train,val}/NNNNNN.xml` and the lists `voc/{train,val}.txt`.
///
/// Pixels are counted from 1 and the last is inclusive, as in the Pascal VOC challenges.
/// `truncated` is an object that touches the picture's edge, or with `labels.max_truncation` one
/// whose outline extends beyond it; `occluded` is one that something covers, `difficult` one that
/// is to be ignored. Boxes end at the picture's edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Voc {
    /// Whether boxes are those of the whole object or of its visible part. Default: `amodal`.
    pub boxes: Extent,
    /// Format of the pictures that it refers to; in a recipe, that of `pictures`.
    #[serde(skip)]
    pub pictures: PictureFormat,
}

/// Its folder.
const KIND: &str = "voc";

/// The list of a part's images.
fn list(part: Part) -> PathBuf {
    Path::new(KIND).join(format!("{}.txt", part.name()))
}

impl Writer for Voc {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "voc": self })
    }

    fn extent(&self) -> Option<Extent> {
        Some(self.boxes)
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        create_part_folders(folder, KIND)
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let path = entry.path(KIND, "xml");
        io::write_text(folder.join(&path), &self.document(entry))?;
        Ok(vec![path])
    }

    fn for_trainers(&self) -> Vec<PathBuf> {
        Part::ALL.map(list).into()
    }

    fn reopen(&self, folder: &Path) -> Result<()> {
        remove_files(folder, Part::ALL.map(list))
    }

    fn finish(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Result<()> {
        Part::ALL.into_iter().try_for_each(|part| {
            io::write_text(folder.join(list(part)), &numbers_of(part, samples))
        })
    }

    fn changed(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Vec<PathBuf> {
        let is_changed = |part: &Part| {
            let found = io::read_text(folder.join(list(*part)));
            found.ok() != Some(numbers_of(*part, samples))
        };
        let changed = Part::ALL.into_iter().filter(is_changed);
        changed.map(list).collect()
    }
}

impl Voc {
    fn document(&self, entry: &Entry<'_>) -> String {
        let [w, h] = entry.sample.labels.image;
        let (part, k, extension) = (entry.part.name(), entry.k, self.pictures.extension());
        let objects = entry.labelled.iter().map(|label| self.object(entry, label));
        let objects: String = objects.collect();
        format!(
            "<annotation>\n  <folder>images/{part}</folder>\n  <filename>{k:06}.{extension}</filename>\n  \
             <source>\n    <database>petcomp</database>\n  </source>\n  <size>\n    <width>{w}</width>\n    \
             <height>{h}</height>\n    <depth>3</depth>\n  </size>\n  <segmented>0</segmented>\n{objects}</annotation>\n"
        )
    }

    /// Empty for an object without a box.
    fn object(&self, entry: &Entry<'_>, label: &LabelledObject<'_>) -> String {
        let (b, _) = self.boxes.of(label.object);
        if b.is_empty() {
            return String::new();
        }
        let name = escaped(&entry.class_name(label.class));
        let claims = [
            ("truncated", is_truncated(label.object, &b, entry)),
            ("difficult", label.ignored),
            ("occluded", !label.object.is_topmost()),
        ];
        let claims = claims.map(claim_element).concat();
        let sides = pixels(&b).map(side_element).concat();
        format!(
            "  <object>\n    <name>{name}</name>\n    <pose>Unspecified</pose>\n{claims}    <bndbox>\n{sides}    </bndbox>\n  \
             </object>\n"
        )
    }
}

/// The first and last pixels that a box touches, counted from 1.
fn pixels(b: &BBox) -> [(&'static str, u64); 4] {
    [
        ("xmin", libm::floor(b.x0) as u64 + 1),
        ("ymin", libm::floor(b.y0) as u64 + 1),
        ("xmax", libm::ceil(b.x1) as u64),
        ("ymax", libm::ceil(b.y1) as u64),
    ]
}

fn claim_element((claim, is_so): (&str, bool)) -> String {
    format!("    <{claim}>{}</{claim}>\n", u8::from(is_so))
}

fn side_element((side, at): (&str, u64)) -> String {
    format!("      <{side}>{at}</{side}>\n")
}

/// By its outline, if that was measured.
fn is_truncated(object: &ObjectLabel, b: &BBox, entry: &Entry<'_>) -> bool {
    match object.truncation {
        Some(truncation) => truncation.fraction > 0.0,
        None => is_cut(b, entry.sample.labels.image),
    }
}

/// Whether the object touches a border of the image.
fn is_cut(b: &BBox, image: [u32; 2]) -> bool {
    let [w, h] = image.map(f64::from);
    b.x0 <= 0.0 || b.y0 <= 0.0 || b.x1 >= w || b.y1 >= h
}

/// Text with XML's special characters escaped; characters that XML cannot hold become spaces.
fn escaped(text: &str) -> String {
    let mut xml = String::new();
    for letter in text.chars() {
        match letter {
            '&' | '<' | '>' => {
                write!(xml, "&#{};", u32::from(letter)).expect("a string takes all that is written")
            }
            c if c.is_control() => xml.push(' '),
            c => xml.push(c),
        }
    }
    xml
}

/// The samples of a part, one per line.
fn numbers_of(part: Part, samples: &[Written]) -> String {
    let samples = samples.iter().filter(|sample| sample.part == part);
    samples.map(|sample| format!("{:06}\n", sample.k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_of_whole_pixels_holds_its_first_and_last() {
        let b = BBox {
            x0: 0.0,
            y0: 2.0,
            x1: 3.0,
            y1: 4.0,
        };
        assert_eq!(pixels(&b).map(|(_, at)| at), [1, 3, 3, 4]);
    }

    #[test]
    fn names_cannot_break_the_document() {
        assert_eq!(escaped("a<b> & \u{1}"), "a&#60;b&#62; &#38;  ");
    }
}
