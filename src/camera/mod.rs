//! Camera: a pinhole model, and the camera that sees a rectangle of known size at four labelled corners.
//!
//! [`solve`] turns a [`Label`] into a [`Solution`]; [`scene::locate`](crate::scene::locate) is the pipeline stage that does so inside a scene.
//!
//! The solver works in units of its own, in which everything is of order one: pixels relative to the principal point
//! over half the picture's diagonal, lengths over the geometric mean of the rectangle's sides.

mod bundle;
mod chi;
mod corners;
mod dlt;
mod doctor;
mod error;
mod exchange;
mod file;
mod focal;
mod hedge;
mod import;
mod init;
mod joint;
mod label;
mod label_check;
mod marker;
mod model;
mod options;
mod overlay;
mod pinhole;
mod prior;
mod problem;
mod read;
mod rectangle;
mod rectify;
mod refine;
mod search;
mod sides;
#[doc(hidden)]
pub mod simulate;
mod solution;
mod solve;
mod stored;
mod uncertainty;

pub(crate) use chi::CHI2_99;
pub use doctor::doctor;
pub use error::SolveError;
pub use exchange::{BlenderCamera, ColmapModel, OpencvCamera, SensorFit};
pub use file::{
    CameraFile, CameraFormat, FitRecord, FittedSurface, FocalPrior, FoundCamera, Model,
    SigmaRecord, SolvedFrom,
};
pub use focal::{FocalSource, focal_from_equivalent};
pub use import::from_labelme;
pub use init::{commented, init_label};
pub use joint::{Joint, OutlierPhoto, group_by_camera, solve_joint};
pub use label::{
    Artwork, Crop, Framing, Label, LabelCamera, LabelFormat, LabelImage, LabelPoint, LabelSurface,
    MarkerMap, PixelOrigin,
};
pub(crate) use marker::any_markers;
#[cfg(test)]
pub(crate) use marker::printed;
pub use marker::{FAMILY as MARKER_FAMILY, Marker, find_markers, with_markers};
pub use options::{CornerOrder, Priors, SolveOptions};
pub use overlay::overlay;
pub use pinhole::Camera;
#[doc(hidden)]
pub use pinhole::distorted;
pub use read::{
    LabelledPhoto, check_distance, check_size, photo_of, read_label, read_labels, with_photo,
};
pub(crate) use read::{apply_exif, labels_in};
pub use rectify::{project_picture, rectify, warp};
pub use solution::{Fit, FocalFinding, Sigma, Solution};
pub use solve::solve;
pub use stored::{PhotoCamera, label_checksums, photo_cameras};
pub use uncertainty::UNKNOWN_NAMES as UNKNOWNS;
