//! Camera: a pinhole model, and the camera that sees a rectangle of known size at four labelled
//! corners.
//!
//! [`solve`] turns a [`Label`] into a [`Solution`]; [`scene::locate`](crate::scene::locate) is the
//! pipeline stage that does so inside a scene.
//!
//! The solver works in units of its own, in which everything is of order one: pixels relative to
//! the principal point over half the picture's diagonal, lengths over the geometric mean of the
//! rectangle's sides.

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
mod lens;
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
mod sketch;
mod snap;
mod solution;
mod solve;
mod stored;
mod uncertainty;

pub(crate) use chi::CHI2_99;
pub(crate) use dlt::homography;
#[doc(hidden)]
pub use doctor::doctor;
pub use error::{ContradictedValue, SolveError};
#[doc(hidden)]
pub use exchange::{BlenderCamera, ColmapModel, OpencvCamera, SensorFit};
pub use file::{CameraFile, FocalPrior};
#[doc(hidden)]
pub use file::{
    CameraFormat, FitRecord, FittedSurface, FoundCamera, Model, SigmaRecord, SolvedFrom,
};
pub use focal::FocalSource;
#[doc(hidden)]
pub use focal::focal_from_equivalent;
#[doc(hidden)]
pub use init::{commented, init_label, with_folded_lists};
#[doc(hidden)]
pub use joint::{Joint, OutlierPhoto, group_by_camera, have_same_shape, solve_joint};
#[doc(hidden)]
pub use label::{Artwork, Crop, Framing, LabelFormat, LabelWall, PixelOrigin};
pub use label::{Label, LabelCamera, LabelImage, LabelPoint, LabelSurface, MarkerMap};
#[cfg(test)]
pub(crate) use lens::tests::camera as tilted_camera;
#[doc(hidden)]
pub use lens::{RadialDistortion, check_lens};
pub(crate) use lens::{check_fold, least_bending_k1, least_k1};
#[cfg(test)]
pub(crate) use marker::printed;
pub use marker::{Marker, find_markers};
#[doc(hidden)]
pub use marker::{any_markers, with_markers};
pub use options::{CornerOrder, Priors, SolveOptions};
#[doc(hidden)]
pub use overlay::overlay;
pub use pinhole::Camera;
#[doc(hidden)]
pub use pinhole::distorted;
pub use read::read_label;
#[doc(hidden)]
pub use read::{
    LabelledPhoto, check_distance, check_size, is_called_camera, read_labels, with_photo,
};
pub(crate) use read::{apply_exif, check_camera_distance, labels_beside, labels_in};
pub(crate) use rectangle::square_from_corners;
pub use rectify::warp;
#[doc(hidden)]
pub use rectify::{project_picture, rectify};
#[doc(hidden)]
pub use sketch::Sketch;
#[doc(hidden)]
pub use snap::{SnappedCorners, snap_corners};
pub use solution::{Fit, Solution};
#[doc(hidden)]
pub use solution::{FocalFinding, Sigma};
pub use solve::solve;
pub use stored::PhotoCamera;
pub(crate) use stored::{photo_camera, photo_cameras};
#[doc(hidden)]
pub use uncertainty::UNKNOWN_NAMES as UNKNOWNS;
