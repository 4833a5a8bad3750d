//! Report: how good a stage is, measured on simulated data, as tables and plots.
//!
//! Errors are the same at every run; times are this machine's.

pub mod camera;
mod chart;
pub mod dataset;
pub mod eval;
pub mod experiments;
pub mod flags;
mod histogram;
pub mod matte;
mod page;
pub mod render;
#[cfg(feature = "settle")]
pub mod settle;
mod table;

pub use chart::{Axis, Chart, Curve};
pub use histogram::Histogram;
pub use page::{Page, base64, escaped};
pub use table::Table;
