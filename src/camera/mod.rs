//! Camera: a pinhole model, and the camera that sees a rectangle of known size at four labelled corners.

mod label;
mod pinhole;
mod rectangle;

pub use pinhole::Camera;
pub use rectangle::SolveError;
