//! Why no camera could be found.

use crate::diagnostic::Diagnostic;
use crate::error::Error;

/// Why no camera could be found.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A number is NaN or infinite.
    #[error("{0}: not finite, expected a number")]
    NonFinite(&'static str),
    /// A number is too large, or too near to zero, to be meaningful.
    #[error("{at}: {value:e}, expected at most {most:e} and, if positive, at least 1/{most:e}")]
    OutOfRange {
        /// Which value.
        at: &'static str,
        /// What it was.
        value: f64,
        /// The largest one.
        most: f64,
    },
    /// The picture has no pixels.
    #[error("image: {} x {} pixels, expected at least 1 x 1", .0[0], .0[1])]
    BadImage([u32; 2]),
    /// A picture reaches beyond the one that it was cut out of.
    #[error(
        "image.crop: {} x {} pixels at {}, {}, expected a part of the whole picture of {} x {}",
        .size[0], .size[1], .offset_px[0], .offset_px[1], .whole[0], .whole[1]
    )]
    CropOutside {
        /// Its width and height, pixels.
        size: [u32; 2],
        /// Where its top left corner would be.
        offset_px: [f64; 2],
        /// Width and height of the whole one.
        whole: [u32; 2],
    },
    /// The rectangle's sides cannot be right.
    #[error("surface: sides of {} m and {} m, expected positive lengths with a ratio of at most 1000", .0[0], .0[1])]
    BadDimensions([f64; 2]),
    /// Neither side of the rectangle is known.
    #[error("surface: width_m and height_m are both missing, expected at least one")]
    NoScale,
    /// Neither the sides nor the corners of the rectangle are given.
    #[error("surface: missing corners_px (or four points on the surface), and width_m or height_m")]
    Empty,
    /// There are no corners.
    #[error(
        "surface: corners_px is missing or not filled in, expected it or four points on the surface"
    )]
    NoCorners,
    /// A value that must be positive is not.
    #[error("{at}: {value}, expected a positive number")]
    NotPositive {
        /// Which value.
        at: &'static str,
        /// What it was.
        value: f64,
    },
    /// The albedo or the walls of a surface, the camera's height over it or its focal length are
    /// outside the plausible range.
    #[error("{at}: {what}")]
    OutOfBounds {
        /// Which value.
        at: &'static str,
        /// What it was, and what was expected.
        what: String,
    },
    /// There are points instead of corners, but not both sides; the text says which are missing.
    #[error("surface: points alone need width_m and height_m: {0}")]
    PointsNeedSides(&'static str),
    /// There are markers instead of corners, and none was looked for.
    #[error(
        "surface: corners_px is missing, and the corners of the markers are not among the points: \
         `petcomp camera markers PHOTO --map LABEL -o LABEL` adds them"
    )]
    NoMarkerCorners,
    /// Two corners coincide.
    #[error(
        "surface.corners_px: the {} and the {} corner are {distance_px:.1} px apart, expected at least {limit_px:.1}{}",
        corner_name(*.first), corner_name(*.second), reason_for_limit(*.sigmas)
    )]
    Coincident {
        /// One of them, from 0.
        first: usize,
        /// The other.
        second: usize,
        /// How far apart they are.
        distance_px: f64,
        /// The least distance.
        limit_px: f64,
        /// How many `corner_sigma_px` that is; 0 if it does not depend on them.
        sigmas: f64,
    },
    /// One corner lies inside the triangle of the others.
    #[error("surface.corners_px: not convex (one corner lies inside the triangle of the others)")]
    NotConvex,
    /// Three corners are on one line, within noise.
    #[error(
        "surface.corners_px: the {} corner is {distance_px:.1} px from the line of two others, expected at least {limit_px:.1}{}",
        corner_name(*.corner), reason_for_limit(*.sigmas)
    )]
    Collinear {
        /// The corner as labelled, from 0.
        corner: usize,
        /// Its distance from the line.
        distance_px: f64,
        /// The least distance.
        limit_px: f64,
        /// How many `corner_sigma_px` that is; 0 if it does not depend on them.
        sigmas: f64,
    },
    /// The corners are in another order than required
    /// ([`CornerOrder::Strict`](super::CornerOrder::Strict)).
    #[error("surface.corners_px: {0}, but the order must be right")]
    Order(Diagnostic),
    /// Photos that should be of one camera differ in the shape of the picture, or in the principal
    /// point or k1 that their labels state, or one was cropped at an unknown place.
    #[error(
        "photos[{photo}]: not the same camera: differs from another photo in shape, principal point or k1, or one of them \
         was cropped and states no principal point"
    )]
    DifferentPictures {
        /// Which photo, from 0.
        photo: usize,
    },
    /// The best camera does not fit its label within the noise.
    #[error(
        "surface: no camera fits ({labelled} {rms_px:.1} px off, p = {p_value:.1e}): {}",
        remedy(*.exchanged, *.contradicted)
    )]
    NoFit {
        /// `corners` or, where none were labelled, `points`.
        labelled: &'static str,
        /// Root mean square distance of these from where the camera sees them, pixels.
        rms_px: f64,
        /// Probability of a worse fit by chance.
        p_value: f64,
        /// Chi squared as labelled and with width and height exchanged, where that repairs it.
        exchanged: Option<[f64; 2]>,
        /// The value without which a camera fits, where there is one.
        contradicted: Option<ContradictedValue>,
    },
    /// No pose has the camera above the surface with the whole rectangle in front of it.
    #[error("surface.corners_px: no camera above the surface sees these corners")]
    NoPose,
    /// Two points that stand for corners have the same place.
    #[error("points[{second}].{place}: that of points[{first}], expected another")]
    PointsCoincident {
        /// One of them, from 0.
        first: usize,
        /// The other.
        second: usize,
        /// `px` or `xyz_m`.
        place: &'static str,
    },
    /// No camera can have seen a label that has points instead of corners.
    #[error(
        "{at}: no camera above the surface sees these points, expected x along the width and y up: are they mirrored?"
    )]
    PointsUnseen {
        /// Where they are from: `points` or `markers.map`.
        at: &'static str,
    },
}

/// A value of a label that contradicts all the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContradictedValue {
    /// Its field.
    pub at: &'static str,
    /// As labelled: metres, pixels or a number.
    pub stated: f64,
    /// As the others have it.
    pub found: f64,
}

impl std::fmt::Display for ContradictedValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { at, stated, found } = self;
        let (decimals, unit) = match *at {
            "camera.height_m" => (3, " m"),
            "camera.k1" => (3, ""),
            _ => (0, " px"),
        };
        write!(
            f,
            "{at}: {stated}{unit}, expected the {found:.decimals$}{unit} that the corners give, unless another value is wrong"
        )
    }
}

impl SolveError {
    /// Whether it names a rectangle's corners.
    pub(super) fn is_of_corners(&self) -> bool {
        matches!(
            self,
            Self::Coincident { .. }
                | Self::NotConvex
                | Self::Collinear { .. }
                | Self::Order(_)
                | Self::NoPose
        )
    }

    /// Whether a single value is one that nothing can have, rather than the values together.
    fn is_impossible_value(&self) -> bool {
        matches!(
            self,
            Self::NonFinite(_)
                | Self::OutOfRange { .. }
                | Self::NotPositive { .. }
                | Self::OutOfBounds { .. }
                | Self::BadImage(_)
                | Self::CropOutside { .. }
                | Self::BadDimensions(_)
        )
    }
}

/// What a person calls a corner of a label, which counts from 0.
pub(crate) fn corner_name(corner: usize) -> &'static str {
    ["first", "second", "third", "fourth"][corner % 4]
}

/// Why no camera may fit.
pub(crate) const MISFIT_CAUSES: &str = "wrong dimensions, corners of different rectangles, strong distortion, a cropped \
    picture, too small a corner_sigma_px, or an uncommon lens without EXIF data or camera.focal_px";

fn reason_for_limit(sigmas: f64) -> String {
    match sigmas > 0.0 {
        true => format!(" ({sigmas} times corner_sigma_px)"),
        false => String::new(),
    }
}

/// What to do about a label that no camera fits.
fn remedy(exchanged: Option<[f64; 2]>, contradicted: Option<ContradictedValue>) -> String {
    match (exchanged, contradicted) {
        (Some([before, after]), _) => {
            format!(
                "swap width_m and height_m (chi squared {before:.1} as labelled, {after:.1} swapped)"
            )
        }
        (None, Some(value)) => value.to_string(),
        (None, None) => MISFIT_CAUSES.into(),
    }
}

impl From<SolveError> for Error {
    /// Every message begins with the field.
    fn from(error: SolveError) -> Self {
        let message = error.to_string();
        let (at, what) = message.split_once(": ").unwrap_or(("surface", &message));
        let (at, what) = (at.into(), what.into());
        match error.is_impossible_value() {
            true => Self::Value { at, what },
            false => Self::Camera { at, what },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impossible_value_is_one_of_its_field() {
        let impossible = [
            SolveError::NonFinite("camera.k1"),
            SolveError::OutOfRange {
                at: "camera.k1",
                value: 1e10,
                most: 1e9,
            },
            SolveError::BadImage([0, 3]),
            SolveError::CropOutside {
                size: [4, 3],
                offset_px: [1.0, 0.0],
                whole: [4, 3],
            },
            SolveError::BadDimensions([-1.0, 1.0]),
            SolveError::NotPositive {
                at: "camera.focal_px",
                value: -1.0,
            },
            SolveError::OutOfBounds {
                at: "camera.focal_px",
                what: "26, expected 200 to 400000".into(),
            },
        ];
        for refusal in impossible {
            let message = refusal.to_string();
            let Error::Value { at, what } = Error::from(refusal) else {
                panic!("{message}")
            };
            assert_eq!(format!("{at}: {what}"), message);
        }
        let folded = Error::from(SolveError::NotConvex);
        assert!(matches!(folded, Error::Camera { .. }), "{folded}");
    }

    #[test]
    fn corners_that_are_no_rectangle_s_are_a_wrong_field_of_their_file() {
        let unfit = [
            (SolveError::NotConvex, "surface.corners_px"),
            (SolveError::NoPose, "surface.corners_px"),
            (SolveError::PointsUnseen { at: "points" }, "points"),
            (
                SolveError::PointsCoincident {
                    first: 0,
                    second: 2,
                    place: "px",
                },
                "points[2].px",
            ),
            (SolveError::NoScale, "surface"),
            (SolveError::PointsNeedSides("both are missing"), "surface"),
            (SolveError::DifferentPictures { photo: 1 }, "photos[1]"),
        ];
        for (refusal, field) in unfit {
            let message = refusal.to_string();
            let Error::Field { at, what, .. } = Error::from(refusal).in_file("a.label.json") else {
                panic!("{message}")
            };
            assert_eq!((at.as_str(), format!("{at}: {what}")), (field, message));
        }
    }
}
