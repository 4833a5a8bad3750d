//! Composite: deep samples over a shadowed plate.

mod frame;
mod porter_duff;

pub use frame::{film, frame};
