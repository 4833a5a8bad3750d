//! What is odd about a label or a solution without making it useless.

use serde::{Deserialize, Serialize};

/// Something a person should look at; the solution stands nevertheless.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Warning {
    /// The corners ran criss-cross and were sorted, clockwise from the first.
    #[error("the corners cross each other; sorted clockwise, starting at the first")]
    Reordered,
    /// The corners ran anticlockwise; the second and the fourth were exchanged.
    #[error("the corners run anticlockwise; the second and fourth were exchanged")]
    Reversed,
    /// The rectangle is small in the picture.
    #[error("the longest side is only {longest_px:.1} px; expected at least 50")]
    SmallQuad {
        /// Length of the longest side, pixels.
        longest_px: f64,
    },
    /// A corner lies far outside the picture.
    #[error("corner {corner} lies more than a diagonal outside the picture")]
    Outside {
        /// Which corner, from 0, in clockwise order from the first.
        corner: usize,
    },
    /// The points that stand for the corners are close together.
    #[error(
        "markers within {span:.3} m alone carry a surface of {side:.3} m: put four of them just inside its corners"
    )]
    LoneMarker {
        /// Longer side of what the points span, metres.
        span: f64,
        /// Longer side of the surface, metres.
        side: f64,
    },
    /// The optical axis is almost parallel to the surface.
    #[error("grazing view: the camera looks along the surface ({tilt_deg:.1} degrees from above)")]
    Grazing {
        /// Angle between optical axis and surface normal, degrees.
        tilt_deg: f64,
    },
    /// Nothing was known of the focal length and the corners look like seen from infinitely far.
    #[error(
        "the corners show no perspective and nothing is known of the focal length: {focal_px:.0} px is a bound, not a value"
    )]
    FocalUnbounded {
        /// The focal length used, pixels.
        focal_px: f64,
    },
    /// Nothing says that the picture is whole, and it would be sharper knowledge if it were.
    #[error(
        "nothing says that the picture is whole, so a point {height:.3} m above the surface is known to {sigma_px:.1} px only; \
         write \"cropped\": false under \"image\" if it is whole: to {whole_px:.1} px then"
    )]
    FramingUnknown {
        /// Height of the objects, metres.
        height: f64,
        /// Standard deviation of where they are seen, pixels.
        sigma_px: f64,
        /// The same, if the picture is whole.
        whole_px: f64,
    },
    /// The corners are those of a cropped picture or of a shifted lens, and nobody said so.
    #[error(
        "the picture is no whole one: its principal point lies {off_px:.0} px (+- {sigma_px:.0}) off its middle; it was \
         cropped, the lens was shifted, or the EXIF focal length is wrong"
    )]
    OffCenter {
        /// Distance of the principal point from the picture's middle, pixels.
        off_px: f64,
        /// Standard deviation of a coordinate of the principal point, pixels.
        sigma_px: f64,
    },
    /// The picture contradicts what was known of the focal length.
    #[error(
        "focal length: {believed_px:.0} px was expected and the corners say {measured_px:.0} px ({sigmas:.1} sigmas apart): \
         wrong EXIF, a cropped or a zoomed picture"
    )]
    FocalPriorConflict {
        /// What was believed, pixels.
        believed_px: f64,
        /// What the corners alone say, pixels.
        measured_px: f64,
        /// How far apart they are, in standard deviations of the difference.
        sigmas: f64,
    },
    /// Objects on the surface may be seen at the wrong place.
    #[error(
        "a point {height:.3} m above the surface is known only to {sigma_px:.1} px: give the focal length or the camera height, \
         add photos taken at an angle, or label points above the surface"
    )]
    HeightUncertain {
        /// Height of the objects, metres.
        height: f64,
        /// Standard deviation of where they are seen, pixels.
        sigma_px: f64,
    },
    /// No camera fits the label within its noise.
    #[error(
        "no camera fits ({rms_px:.1} px off, p = {p_value:.1e}): wrong dimensions, corners of different rectangles, strong \
         distortion, a cropped picture, or corner_sigma_px is too small"
    )]
    Inconsistent {
        /// Probability of a worse fit by chance.
        p_value: f64,
        /// Root mean square distance of the corners from where the camera sees them, pixels.
        rms_px: f64,
        /// So improbable that a pipeline may refuse it.
        severe: bool,
    },
    /// Width and height exchanged fit better.
    #[error(
        "width and height look exchanged (chi squared {labelled:.1} as labelled, {exchanged:.1} exchanged)"
    )]
    SidesSwapped {
        /// Chi squared as labelled.
        labelled: f64,
        /// Chi squared with the sides exchanged.
        exchanged: f64,
    },
    /// Another pose explains the picture almost as well.
    #[error(
        "the pose is ambiguous: another one, turned by {apart_deg:.1} degrees, fits almost as well"
    )]
    PoseAmbiguous {
        /// Angle between the two surface normals, degrees.
        apart_deg: f64,
    },
    /// A photo was left out because it contradicts the others.
    #[error("photo {photo} contradicts the others (chi squared {chi2:.1}) and was left out")]
    OutlierPhoto {
        /// Which photo, from 0.
        photo: usize,
        /// Its chi squared with the shared camera.
        chi2: f64,
    },
}
