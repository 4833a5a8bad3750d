//! Report: measures how well each stage works on simulated data, as tables and plots.
//!
//! Errors are the same in every run; times depend on the machine.

pub mod all;
pub mod camera;
mod clock;
mod color;
mod columns;
mod diagram;
pub mod display;
mod encode;
mod files;
pub mod flags;
mod keying;
mod label;
mod light;
mod machine;
pub mod matte;
mod peers;
mod pile;
pub mod render;
pub mod scale;
mod section;
pub mod settle;
pub mod stability;
mod statistics;
pub mod work;

use diagram::{Diagram, Point};
