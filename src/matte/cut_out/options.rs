//! How a photo becomes a cut-out.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::matte::check::check_value;
use crate::matte::film::FilmOptions;
use crate::matte::key::KeyOptions;
use crate::matte::plate::PlateOptions;
use crate::matte::segment::SegmentOptions;
use crate::names::{by_name, name_of};
use crate::pixel::LinearRgb;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How a photo becomes a cut-out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CutOutOptions {
    /// How the object is found.
    pub segment: SegmentOptions,
    /// How the screen is fitted.
    pub plate: PlateOptions,
    /// How film is solved for.
    pub film: FilmOptions,
    /// How the object is keyed, where the method is `key`.
    pub key: KeyOptions,
    /// Colour of an evenly lit screen, scene-linear; none = fitted to the photo. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub screen: Option<LinearRgb>,
    /// Where the matte comes from; none = physical. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<MatteMethod>,
    /// What a matte is cut to. Default: `tight`.
    pub within: Boundary,
    /// Softness of the edge that the cut makes, standard deviation in pixels. Default: 0.6.
    pub soften_px: f32,
    /// Empty pixels kept around the hull. Default: 4.
    pub margin_px: usize,
    /// Longer side of the cut-out, pixels; larger ones are reduced to it. Default: 2048.
    pub longest_side: usize,
}

impl Default for CutOutOptions {
    fn default() -> Self {
        Self {
            segment: SegmentOptions::default(),
            plate: PlateOptions::default(),
            film: FilmOptions::default(),
            key: KeyOptions::default(),
            screen: None,
            method: None,
            within: Boundary::Tight,
            soften_px: 0.6,
            margin_px: 4,
            longest_side: 2048,
        }
    }
}

/// How a matte is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MatteMethod {
    /// From reflected light and transmittance, solved for in every pixel: see-through plastic keeps
    /// its own light only. Assumed to be that of plastic on a screen without a hue, with a
    /// warning.
    #[default]
    Physical,
    /// From the screen's colour, as Blender's Keying node does: see-through plastic is see-through.
    Key,
    /// From the object's outline alone: nothing is see-through, and what shines through is part of
    /// the object. Screen inside the outline at its rim is left out where its colour identifies
    /// it, and with it film so clear that it dims the screen by less than a tenth.
    Outline,
}

impl MatteMethod {
    /// All of them with their names.
    const ALL: [(&'static str, Self); 3] = [
        ("physical", Self::Physical),
        ("key", Self::Key),
        ("outline", Self::Outline),
    ];
}

impl fmt::Display for MatteMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, self))
    }
}

impl FromStr for MatteMethod {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        by_name("matte", &Self::ALL, name)
    }
}

/// What a matte is cut to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Boundary {
    /// The outline that follows hollows.
    #[default]
    Tight,
    /// The convex hull, as in the paper: the screen's shadows stay in the hollows.
    Hull,
}

/// How far the film of a pixel looks around, pixels: to fill in what is clipped.
const FILM_REACH_PX: usize = 16;
/// Standard deviations at which a soft edge ends.
const SOFT_EDGE_SIGMAS: f32 = 4.0;

impl CutOutOptions {
    /// How far around the object something may depend on, pixels.
    pub(super) fn reach_px(&self) -> usize {
        FILM_REACH_PX + (SOFT_EDGE_SIGMAS * self.soften_px).ceil() as usize
    }

    /// # Errors
    /// [`Error::Value`] for the first option that cannot be right, of whichever stage.
    #[doc(hidden)]
    pub fn check(&self) -> Result<()> {
        self.segment.check().map_err(|e| e.within("segment"))?;
        self.plate.check().map_err(|e| e.within("plate"))?;
        self.film.check().map_err(|e| e.within("film"))?;
        self.key.check()?;
        self.check_lengths()?;
        self.screen.map_or(Ok(()), check_screen)
    }

    fn check_lengths(&self) -> Result<()> {
        Bounds::new(0.0, 100.0, "pixels").check("soften_px", self.soften_px.into())?;
        Bounds::new(0.0, 10_000.0, "pixels").check("margin_px", self.margin_px as f64)?;
        Bounds::new(16.0, 32_768.0, "pixels").check("longest_side", self.longest_side as f64)
    }
}

fn check_screen(screen: LinearRgb) -> Result<()> {
    let channels = screen.channels();
    let is_right = screen.is_finite() && channels.iter().all(|v| *v >= 0.0);
    check_value(is_right, "screen", || {
        format!("{channels:?}, expected numbers of at least 0")
    })
}
