#![doc = include_str!("../README.md")]
#![warn(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

mod allowance;
pub mod asset;
mod bounds;
pub mod camera;
pub mod color;
pub mod composite;
pub mod dataset;
mod deep;
mod diagnostic;
pub mod diff;
mod draw;
mod error;
pub mod eval;
pub mod filter;
#[doc(hidden)]
pub mod fuzzing;
pub mod geom;
mod image;
pub mod io;
pub mod label;
pub mod light;
pub mod matte;
mod pixel;
pub mod plot;
mod quality;
pub mod render;
pub mod scene;
#[cfg(feature = "settle")]
pub mod settle;
mod stopwatch;
pub mod train;
pub mod work;

pub use allowance::Allowance;
pub use camera::Camera;
pub use deep::{DeepImage, DeepSample};
pub use diagnostic::{Code, Diagnostic, Severity};
pub use error::{Error, Result, printable};
pub use image::{Image, Roi};
pub use pixel::{
    Coverage, Depth, Film, LinearRgb, Mix, ObjectId, PremulRgba, Srgb8, Srgba8, StraightRgba,
};
pub use quality::Quality;
pub use scene::{Scene, Shot};
