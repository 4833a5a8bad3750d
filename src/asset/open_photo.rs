//! A photo of a list, read and ready to be cut out, once or as often as a person corrects it.

use super::entry::PhotoEntry;
use super::rectified::RectifiedPhoto;
use super::scale::Scale;
use super::screen_source::EmptyScreens;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io;
use crate::matte::{CutOut, CutOutOptions, Stroke, cut_out_corrected};
use crate::pixel::LinearRgb;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A photo as it is cut out: seen from straight above where something in it shows the screen's
/// plane, beside the empty screen where there is a photo of that.
pub struct OpenPhoto {
    file: PathBuf,
    pub(super) rectified: RectifiedPhoto,
    empty: Option<Arc<Image<LinearRgb>>>,
    options: CutOutOptions,
}

impl OpenPhoto {
    /// Reads the photo of an entry whose paths are relative to the working folder.
    ///
    /// # Errors
    /// [`Error::Value`] where the entry has no scale; those of reading pictures; [`Error::Photo`]
    /// where the screen or marker that gives the scale is not found.
    pub fn read(entry: &PhotoEntry, options: &CutOutOptions) -> Result<Self> {
        Self::beside(entry, &EmptyScreens::default(), options)
    }

    /// The same beside empty screens that several photos share.
    pub(super) fn beside(
        entry: &PhotoEntry,
        screens: &EmptyScreens,
        options: &CutOutOptions,
    ) -> Result<Self> {
        let rectified = read_rectified(entry).map_err(|e| with_name(e, &entry.file))?;
        let empty = screens.get(&entry.screen)?;
        let empty = empty.map(|empty| rectified.same_view(empty)).transpose();
        Ok(Self {
            file: entry.file.clone(),
            empty: empty.map_err(|e| with_name(e, &entry.file))?,
            rectified,
            options: CutOutOptions {
                screen: entry.screen.color().or(options.screen),
                method: entry.matte.or(options.method),
                ..options.clone()
            },
        })
    }

    /// What strokes are painted on, scene-linear.
    pub fn picture(&self) -> &Image<LinearRgb> {
        &self.rectified.photo
    }

    /// Cuts the object out, corrected by strokes on the picture.
    ///
    /// # Errors
    /// Those of [`cut_out`](crate::matte::cut_out), naming the photo; [`Error::Value`] for a stroke
    /// that cannot be right.
    pub fn cut_out(&self, strokes: &[Stroke]) -> Result<CutOut> {
        let cut = cut_out_corrected(
            self.picture(),
            self.empty.as_deref(),
            strokes,
            &self.options,
        );
        cut.map_err(|e| with_name(e, &self.file))
    }
}

/// The photo, seen from straight above where something in it shows the screen's plane.
fn read_rectified(entry: &PhotoEntry) -> Result<RectifiedPhoto> {
    let (scale, file) = (entry.scale()?, &entry.file);
    io::check_square_pixels(file)?;
    let (photo, height) = (io::read(file)?, entry.thickness() / 2.0);
    match scale {
        Scale::PxPerMetre(_) | Scale::Length(_) | Scale::Size(_) => {
            Ok(RectifiedPhoto::unchanged(photo))
        }
        Scale::Screen(size, corners) => {
            RectifiedPhoto::by_corners(photo, size, corners, height, &io::read_header(file)?)
        }
        Scale::Marker(side) => {
            RectifiedPhoto::by_marker(photo, side, height, &io::read_header(file)?)
        }
        Scale::Display => Err(Error::Photo {
            what: "one of the photos of a capture, which is measured, not cut out".into(),
        }),
    }
}

pub(super) fn with_name(error: Error, photo: &Path) -> Error {
    match error {
        Error::Photo { what } => Error::Photo {
            what: format!("{}: {what}", photo.display()),
        },
        other => other,
    }
}
