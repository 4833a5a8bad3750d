//! Composite: deep samples over a shadowed plate.

mod aov;
mod cryptomatte;
mod finish;
mod frame;
mod part;
mod porter_duff;

pub use aov::{Aov, FRONT_ALPHA, front, parts};
pub use cryptomatte::cryptomatte;
pub use finish::finish;
pub use frame::{film, frame, picture};
