//! Capture: an object on a luminous display, which shows black, white and stripes, so that what it
//! lets through and how it bends light are measured.
//!
//! ```text
//! display -draw-> frames, shown one after the other -camera-> photos
//! ```

mod display;
mod draw;
mod frame;
mod page;
mod tag;
mod write;

#[doc(hidden)]
pub use display::Display;
#[doc(hidden)]
pub use draw::draw_frame;
#[doc(hidden)]
pub use frame::{Frame, Stripes};
#[doc(hidden)]
pub use page::page;
#[doc(hidden)]
pub use write::write_frames;
