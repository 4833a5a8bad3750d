//! Report: how good a stage is, measured on simulated data, as tables and plots.
//!
//! Errors are the same at every run; times are this machine's.

#[cfg(feature = "settle")]
pub mod all;
mod beside;
pub mod camera;
mod chart;
mod clock;
pub mod color;
pub mod dataset;
mod diagram;
pub mod encode;
pub mod eval;
pub mod experiments;
pub mod flags;
mod gallery;
mod heat;
mod histogram;
pub mod keying;
pub mod label;
pub mod light;
#[cfg(feature = "settle")]
mod machine;
pub mod matte;
mod mistakes;
mod number;
mod outlier;
mod page;
pub mod peers;
mod pile;
pub mod render;
#[cfg(feature = "settle")]
pub mod scale;
mod section;
#[cfg(feature = "settle")]
pub mod settle;
pub mod stability;
mod table;
#[cfg(feature = "settle")]
pub mod work;

pub use chart::{Axis, Chart, Curve};
pub use diagram::{Diagram, Point, front};
pub(crate) use gallery::clipped;
pub use histogram::Histogram;
pub use page::{Page, base64, escaped};
pub use section::{Document, Section};
pub use table::Table;
