//! Photographs become labelled training images.
//!
//! A photo on a coloured screen becomes a cut-out ([`matte`]), kept with its size and class
//! ([`asset`]). Four corners of a rectangle become a [`camera`]. A recipe and a number become a
//! [`Scene`], whose unknowns the stages replace one by one; what is left is a [`Shot`], rendered to
//! deep samples, from which picture and labels are both read.
//!
//! | unknown in a scene | replaced by | what it takes |
//! | --- | --- | --- |
//! | [`CameraSource::Rectangle`](scene::CameraSource) | [`scene::locate`] | four corners and the size of their rectangle |
//! | [`Placement::Drop`](scene::Placement) | `settle::settle` (feature `settle`) | a known camera; outlines, thickness, mass |
//! | [`Exposure::MatchPlate`](scene::Exposure) and its like | [`light`] | the photo of the place |
//! | names of textures and of the plate | [`Scene::resolve`] | a [`Library`](asset::Library) and the photo |
//!
//! A generator may start anywhere: with a scene, or with a shot built in code and one call to
//! [`composite::picture`]. `examples/` has five programs. Conventions of axes and pixels are in
//! [`geom`], the kinds of pixels and what may be done with them in [`Image`]. Public items not
//! listed here serve petcomp's own programs and may change in any version.
//!
//! ```
//! use petcomp::geom::{Pose, Quad};
//! use petcomp::scene::Card;
//! use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Shot, composite};
//! use std::sync::Arc;
//!
//! let quad = Quad { world_from_card: Pose::translation(0.0, 0.0, 0.05), size: [0.2, 0.1] };
//! let red_film = Image::filled(8, 8, PremulRgba::new(0.3, 0.1, 0.1, 0.5));
//! let shot = Shot::new(Camera::looking_down(1.0, 80.0, [64, 48]))
//!     .with_plate(Arc::new(Image::filled(64, 48, LinearRgb::grey(0.5))))
//!     .with_card(Card::new(ObjectId(1), quad, red_film))
//!     .with_ambient(LinearRgb::WHITE);
//! let frame = composite::picture(&shot, &Default::default());
//! assert!(frame[(32, 24)].r > frame[(32, 24)].g);
//! ```
#![cfg_attr(
    not(feature = "pipeline"),
    allow(dead_code, unused_imports, reason = "the pipeline uses it")
)]
#![warn(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "pipeline")]
mod allowance;
#[cfg(feature = "pipeline")]
pub mod asset;
mod bounds;
#[cfg(feature = "pipeline")]
pub mod camera;
#[cfg(feature = "pipeline")]
pub mod capture;
pub mod color;
#[cfg(feature = "pipeline")]
pub mod composite;
#[cfg(feature = "pipeline")]
pub mod dataset;
#[cfg(feature = "pipeline")]
mod deep;
mod diagnostic;
pub mod diff;
#[cfg(feature = "pipeline")]
mod draw;
mod error;
#[cfg(feature = "pipeline")]
pub mod eval;
pub mod filter;
#[cfg(feature = "fuzzing")]
#[doc(hidden)]
pub mod fuzzing;
pub mod geom;
mod image;
pub mod io;
#[cfg(feature = "pipeline")]
pub mod label;
#[cfg(feature = "pipeline")]
pub mod light;
#[cfg(feature = "pipeline")]
mod lru;
pub mod matte;
mod names;
mod pixel;
#[cfg(feature = "pipeline")]
#[doc(hidden)]
pub mod plot;
mod quality;
mod quantile;
#[cfg(feature = "pipeline")]
pub mod render;
#[cfg(feature = "pipeline")]
pub mod scene;
#[cfg(feature = "settle")]
pub mod settle;
mod stopwatch;
#[cfg(feature = "pipeline")]
#[doc(hidden)]
pub mod train;
#[cfg(feature = "counters")]
pub mod work;
#[cfg(not(feature = "counters"))]
mod work;

#[cfg(feature = "pipeline")]
#[doc(hidden)]
pub use allowance::Allowance;
#[cfg(feature = "pipeline")]
pub use camera::Camera;
#[cfg(feature = "pipeline")]
#[doc(hidden)]
pub use deep::HoldoutSample;
#[cfg(feature = "pipeline")]
pub use deep::{DeepImage, DeepSample};
pub use diagnostic::{Code, Diagnostic, Severity};
#[doc(hidden)]
pub use error::printable;
pub use error::{Error, Result};
#[doc(hidden)]
pub use image::ImageView;
pub use image::{Image, Mask, Roi};
#[cfg(feature = "pipeline")]
#[doc(hidden)]
pub use lru::share_memory;
#[doc(hidden)]
pub use pixel::Mix;
pub use pixel::{
    Coverage, Depth, Film, LinearRgb, ObjectId, PremulRgba, Srgb8, Srgba8, StraightRgba,
};
pub use quality::Quality;
#[cfg(feature = "pipeline")]
pub use scene::{Scene, Shot};
