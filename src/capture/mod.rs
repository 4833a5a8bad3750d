//! Capture: an object on a luminous display, which shows black, white and stripes, so that what it
//! lets through and how it bends light are measured.
//!
//! ```text
//! display -draw-> frames, shown one after the other -camera-> photos
//! photos -recognise-> frames -stack-> seen from above -solve-> film, -bend-> displacement
//! ```

mod bend;
mod check;
mod display;
mod draw;
mod frame;
mod measure;
mod object;
mod page;
mod recognise;
mod solve;
mod stack;
mod stripes;
mod tag;
#[cfg(test)]
mod tests;
mod view;
mod write;

#[doc(hidden)]
pub use bend::Refraction;
#[doc(hidden)]
pub use display::Display;
#[doc(hidden)]
pub use draw::draw_frame;
#[doc(hidden)]
pub use frame::{Frame, Stripes};
#[doc(hidden)]
pub use measure::{Measured, measure};
#[doc(hidden)]
pub use page::page;
#[doc(hidden)]
pub use recognise::FramePhoto;
#[doc(hidden)]
pub use stack::{Photos, Sources};
#[cfg(all(test, feature = "markers"))]
pub(crate) use tag::is_white as is_white_in_tag;
#[doc(hidden)]
pub use view::View;
#[doc(hidden)]
pub use write::write_frames;
