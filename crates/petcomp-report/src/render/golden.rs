//! The golden scenes: pictures by Cycles that ours should match.

use super::{picture_of, settings};
use petcomp::diff::{Likeness, triple};
use petcomp::scene::{Shot, cycles};
use petcomp::{Error, Image, LinearRgb, Result, io};
use std::path::{Path, PathBuf};

/// Columns of the sheet, and pixels between its strips.
const SHEET_COLUMNS: usize = 2;
const STRIP_GAP_PX: usize = 4;

/// A golden scene at one setting.
pub(super) struct GoldenRow {
    pub(super) case: String,
    pub(super) quality: &'static str,
    /// Compared with the reference.
    pub(super) likeness: Likeness,
}

/// A golden scene and its reference.
pub(super) struct GoldenScene {
    pub(super) name: String,
    pub(super) shot: Shot,
    pub(super) wanted: Image<LinearRgb>,
}

impl GoldenScene {
    /// All scenes of a folder, by name; none if there is no folder.
    pub(super) fn all_in(folder: &Path) -> Result<Vec<Self>> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut cases: Vec<PathBuf> = entries
            .map(|entry| entry.path())
            .filter(|case| case.join("reference.exr").exists())
            .collect();
        cases.sort();
        cases.iter().map(|case| Self::read(case)).collect()
    }

    fn read(case: &Path) -> Result<Self> {
        let name = case.file_name().unwrap_or_default();
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            shot: cycles::import(case.join("scene.json"), None)?,
            wanted: io::read(case.join("reference.exr"))?,
        })
    }

    /// # Errors
    /// A picture of another size than the reference.
    pub(super) fn size_error(&self, size: (usize, usize)) -> Error {
        let wanted = self.wanted.size();
        Error::value(
            &self.name,
            format!("{size:?} pixels, reference has {wanted:?}"),
        )
    }

    fn row(&self, quality: &'static str, picture: &Image<LinearRgb>) -> Result<GoldenRow> {
        let likeness = Likeness::measure(picture, &self.wanted)
            .ok_or_else(|| self.size_error(picture.size()))?;
        Ok(GoldenRow {
            case: self.name.clone(),
            quality,
            likeness,
        })
    }
}

/// Every golden scene at every setting, and a sheet of all of them at one of them; no sheet without
/// scenes.
pub(super) fn golden(
    folder: &Path,
    shown: &str,
) -> Result<(Vec<GoldenRow>, Option<Image<LinearRgb>>)> {
    let (mut rows, mut strips) = (Vec::new(), Vec::new());
    for scene in GoldenScene::all_in(folder)? {
        for (setting, options) in settings() {
            let picture = picture_of(&scene.shot, &options);
            rows.push(scene.row(setting, &picture)?);
            if setting == shown {
                strips.push(triple(&scene.wanted, &picture));
            }
        }
    }
    Ok((rows, stacked_strips(&strips)))
}

/// Strips below each other in two columns.
fn stacked_strips(strips: &[Image<LinearRgb>]) -> Option<Image<LinearRgb>> {
    let width = strips.iter().map(Image::width).max()? + STRIP_GAP_PX;
    let height = strips.iter().map(Image::height).max()? + STRIP_GAP_PX;
    let lines = strips.len().div_ceil(SHEET_COLUMNS);
    Some(Image::from_fn(
        SHEET_COLUMNS * width,
        lines * height,
        |x, y| {
            let strip = strips.get(y / height * SHEET_COLUMNS + x / width);
            strip_pixel(strip, x % width, y % height)
        },
    ))
}

/// White outside a strip.
fn strip_pixel(strip: Option<&Image<LinearRgb>>, x: usize, y: usize) -> LinearRgb {
    match strip {
        Some(strip) if x < strip.width() && y < strip.height() => strip[(x, y)],
        _ => LinearRgb::WHITE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::render::RenderOptions;

    #[test]
    fn what_is_out_of_focus_is_so_in_our_picture_too() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../golden/render");
        let scenes = GoldenScene::all_in(&folder).unwrap();
        let scene = scenes.iter().find(|s| s.name == "depth_of_field").unwrap();
        let picture = picture_of(&scene.shot, &RenderOptions::default());
        let rmse = scene.row("normal", &picture).unwrap().likeness.rmse;
        assert!(rmse < 0.006, "{rmse}");
    }

    #[test]
    fn strips_stand_in_two_columns() {
        let strip = |v| Image::filled(3, 2, LinearRgb::grey(v));
        let sheet = stacked_strips(&[strip(0.1), strip(0.2), strip(0.3)]).unwrap();
        assert_eq!(
            (sheet[(0, 0)].r, sheet[(7, 0)].r, sheet[(0, 6)].r),
            (0.1, 0.2, 0.3)
        );
        assert_eq!(
            (sheet[(7, 6)], stacked_strips(&[])),
            (LinearRgb::WHITE, None)
        );
    }
}
