//! Matte: a photo on a screen becomes a cut-out.

pub mod key;

pub use key::{KeyOptions, Keyed, Keying, Screen, key};
