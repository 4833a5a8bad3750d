//! Report: how good a stage is, measured on simulated data, as tables and plots.
//!
//! Errors are the same at every run; times are this machine's.

pub mod all;
pub mod camera;
mod clock;
pub mod color;
mod columns;
mod diagram;
pub mod display;
pub mod encode;
mod files;
pub mod flags;
pub mod keying;
pub mod label;
pub mod light;
mod machine;
pub mod matte;
pub mod peers;
mod pile;
pub mod render;
pub mod scale;
mod section;
pub mod settle;
pub mod stability;
mod statistics;
pub mod work;

pub use diagram::{Diagram, Point, front};
pub use section::{Document, Section};
