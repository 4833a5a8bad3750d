//! A review: what a person said about a photo's cut-out, stored next to the photo.

use crate::error::{Error, Result};
use crate::io;
use crate::matte::{Stroke, check_strokes};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a person said about the cut-out of a photo: strokes that correct it, and whether it is
/// good.
///
/// `cup.review.json` is next to `cup.jpg`. It corrects that photo whenever it is cut out again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Review {
    /// `cut-out-review`.
    pub format: ReviewFormat,
    /// Version of the format: 1.
    pub version: u32,
    /// Width and height of what was painted on, pixels: of the upright photo, or, where a screen or
    /// a marker gives the scale, of the view from straight above.
    pub size_px: [usize; 2],
    /// Whether the corrected cut-out is good. Default: not decided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What corrects it, in the order in which it was painted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub strokes: Vec<Stroke>,
}

/// The one word of [`Review::format`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReviewFormat {
    /// `cut-out-review`.
    #[default]
    #[serde(rename = "cut-out-review")]
    CutOutReview,
}

/// Whether a cut-out is good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It is: what was in question is answered.
    Accepted,
    /// It is not: the photo gives no cut-out.
    Rejected,
}

/// The version of the format that is written, and the only one that is read.
const VERSION: u32 = 1;

impl Review {
    /// A review of a picture of this width and height.
    pub fn new((width, height): (usize, usize), strokes: Vec<Stroke>) -> Self {
        Self {
            version: VERSION,
            size_px: [width, height],
            strokes,
            ..Self::default()
        }
    }

    /// Where the review of a photo is kept.
    pub fn path_of(photo: &Path) -> PathBuf {
        photo.with_extension("review.json")
    }

    /// Reads and checks the review of a photo, where there is one.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be understood; [`Error::Field`] for a value that cannot be
    /// right.
    pub fn of_photo(photo: &Path) -> Result<Option<Self>> {
        let path = Self::path_of(photo);
        if !path.exists() {
            return Ok(None);
        }
        let review: Self = io::read_json(&path)?;
        review.check().map_err(|e| e.in_file(&path))?;
        Ok(Some(review))
    }

    /// Checks all values.
    ///
    /// # Errors
    /// [`Error::Value`] for the first value that cannot be right.
    pub fn check(&self) -> Result<()> {
        if self.version != VERSION {
            let what = format!("{}, expected {VERSION}", self.version);
            return Err(Error::value("version", what));
        }
        check_strokes(&self.strokes)
    }

    /// A person does not want the cut-out.
    pub(super) fn is_rejected(&self) -> bool {
        self.verdict == Some(Verdict::Rejected)
    }

    /// Fails where it was painted on a picture of another size.
    ///
    /// # Errors
    /// [`Error::Value`] (`size_px`).
    #[doc(hidden)]
    pub fn check_size(&self, (width, height): (usize, usize)) -> Result<()> {
        let [w, h] = self.size_px;
        if (w, h) == (width, height) {
            return Ok(());
        }
        let what = format!(
            "{w} x {h}, expected the photo's {width} x {height}; review it again, or delete this file"
        );
        Err(Error::value("size_px", what))
    }

    /// As it is stored: JSON, one stroke per line.
    pub fn to_json(&self) -> String {
        let json = |value: &dyn Fn() -> serde_json::Result<String>| {
            value().expect("numbers and words are JSON")
        };
        let head = Self {
            strokes: Vec::new(),
            ..self.clone()
        };
        let head = json(&|| serde_json::to_string_pretty(&head));
        let strokes = self.strokes.iter();
        let strokes: Vec<_> = strokes
            .map(|stroke| json(&|| serde_json::to_string(stroke)))
            .collect();
        if strokes.is_empty() {
            return head + "\n";
        }
        let head = head.trim_end_matches(['}', '\n']);
        format!(
            "{head},\n  \"strokes\": [\n    {}\n  ]\n}}\n",
            strokes.join(",\n    ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matte::Claim;

    fn review() -> Review {
        let stroke = Stroke {
            says: Claim::NotObject,
            radius_px: 4.0,
            points_px: vec![[10.5, 20.0], [11.25, 20.5]],
        };
        Review::new((120, 80), vec![stroke.clone(), stroke])
    }

    #[test]
    fn a_review_is_read_as_it_was_written_a_stroke_on_each_line() {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("a.b.png");
        assert_eq!(Review::of_photo(&photo).unwrap(), None);
        let accepted = Review {
            verdict: Some(Verdict::Accepted),
            ..Review::new((120, 80), Vec::new())
        };
        for review in [review(), accepted] {
            std::fs::write(folder.path().join("a.b.review.json"), review.to_json()).unwrap();
            assert_eq!(Review::of_photo(&photo).unwrap(), Some(review));
        }
        let line =
            r#"    {"says":"not_object","radius_px":4.0,"points_px":[[10.5,20.0],[11.25,20.5]]}"#;
        assert_eq!(review().to_json().matches(line).count(), 2);
    }

    #[test]
    fn a_wrong_review_is_named_with_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let said = |text: String| {
            std::fs::write(folder.path().join("a.review.json"), text).unwrap();
            let error = Review::of_photo(&folder.path().join("a.png")).unwrap_err();
            error.to_string()
        };
        let radius = said(review().to_json().replacen("4.0", "-4.0", 1));
        assert!(
            radius.contains("a.review.json: strokes[0].radius_px: -4"),
            "{radius}"
        );
        let word = said(review().to_json().replacen("not_object", "dirt", 1));
        assert!(
            word.contains("a.review.json") && word.contains("dirt"),
            "{word}"
        );
        let version = said(
            review()
                .to_json()
                .replacen("\"version\": 1", "\"version\": 2", 1),
        );
        assert!(version.ends_with("version: 2, expected 1"), "{version}");
    }
}
