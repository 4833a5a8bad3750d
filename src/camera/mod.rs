//! Camera: a pinhole model, and the camera that sees a rectangle of known size at four labelled corners.
//!
//! [`solve`] turns a [`Label`] into a [`Solution`]; [`locate`] is the pipeline stage that does so inside a scene.
//!
//! The solver works in units of its own, in which everything is of order one: pixels relative to the principal point
//! over half the picture's diagonal, lengths over the geometric mean of the rectangle's sides.

mod corners;
mod focal;
mod label;
mod locate;
mod pinhole;
mod rectangle;
mod solve;
mod warning;

pub use focal::FocalSource;
pub use label::{Label, LabelCamera, LabelImage, LabelPoint, LabelSurface, MarkerMap, PixelOrigin};
pub use locate::locate;
pub use pinhole::Camera;
pub use solve::{CornerOrder, Solution, SolveError, SolveOptions, solve};
pub use warning::Warning;
