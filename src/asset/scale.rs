//! What gives the scale of a photo.

use crate::bounds::{OBJECT, PX_PER_METRE, SURFACE, WIDTH, number};
use crate::error::{Error, Result};

/// How large the things in a photo are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Pixels of the photo per metre.
    PxPerMetre(f64),
    /// Length of the object, the longer side of the smallest rectangle around it, metres.
    Length(f64),
    /// Length and width of the object, longest first, metres.
    Size([f64; 2]),
    /// Width and height of the whole screen, metres, with its corners where they are known (from
    /// the top left, clockwise, pixels); else they are found. The object's scale is that at
    /// half its thickness above the screen.
    Screen([f64; 2], Option<[[f64; 2]; 4]>),
    /// Side of the black square of a printed marker that lies on the screen (AprilTag tag36h11 or
    /// ArUco DICT_4X4_50), metres.
    Marker(f64),
    /// The markers of a luminous display that shows frames below the object.
    Display,
}

impl Scale {
    /// # Errors
    /// [`Error::Value`] for a size that nothing has which can be photographed on a screen.
    pub(super) fn check(self) -> Result<()> {
        match self {
            Self::PxPerMetre(scale) => PX_PER_METRE.check("px_per_metre", scale),
            Self::Length(length) => OBJECT.check("length", length),
            Self::Size(size) => check_object_size(size),
            Self::Screen(size, _) => size
                .into_iter()
                .try_for_each(|side| SURFACE.check("screen_size", side)),
            Self::Marker(side) => OBJECT.check("marker_size", side),
            Self::Display => Ok(()),
        }
    }

    /// Checks that the scale makes the object in the photo `source` as long as one that can be
    /// photographed on a screen.
    ///
    /// # Errors
    /// [`Error::Photo`], which asks about the unit where another one would make sense: other photos
    /// of the same scale may be right.
    pub(super) fn check_length(self, length: f64, source: &str) -> Result<()> {
        if OBJECT.contains(length) {
            return Ok(());
        }
        let Some((at, value)) = self.measured_field() else {
            return Ok(());
        };
        let question = match self {
            Self::PxPerMetre(_) => question_of_scale(length),
            _ => OBJECT.question(length),
        };
        let length = number((1e4 * length).round() / 1e4);
        let what = format!(
            "{at}: {value}, makes the object in {source} {length} m long, expected {OBJECT}{question}"
        );
        Err(Error::Photo { what })
    }

    /// A size of the object itself gives it: wrong where a part of that is missing.
    pub(super) fn is_of_object(self) -> bool {
        matches!(self, Self::Length(_) | Self::Size(_))
    }

    /// The field of an entry that gives it and its value, where that is something else than the
    /// object.
    fn measured_field(self) -> Option<(&'static str, String)> {
        match self {
            Self::Length(_) | Self::Size(_) | Self::Display => None,
            Self::PxPerMetre(scale) => Some(("px_per_metre", number(scale))),
            Self::Screen([w, h], _) => {
                Some(("screen_size", format!("{} x {}", number(w), number(h))))
            }
            Self::Marker(side) => Some(("marker_size", number(side))),
        }
    }
}

fn check_object_size([length, width]: [f64; 2]) -> Result<()> {
    OBJECT.check("length", length)?;
    WIDTH.check("width", width)?;
    if width <= length {
        return Ok(());
    }
    let what = format!("{width}, expected at most the length of {length}");
    Err(Error::value("width", what))
}

fn question_of_scale(length: f64) -> String {
    OBJECT
        .unit_meant(length)
        .map(|unit| format!("; is it pixels for a {unit}?"))
        .unwrap_or_default()
}
