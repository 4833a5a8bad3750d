//! Report: how good a stage is, measured on simulated data, as tables and plots.
//!
//! Errors are the same at every run; times are this machine's.

pub mod camera;
mod chart;
mod page;
pub mod render;
mod table;

pub use chart::{Axis, Chart, Curve};
pub use page::{Page, base64, escaped};
pub use table::Table;
