//! Train: what training a detector needs besides images. Equation numbers are those of the paper.
//!
//! Plain functions for any trainer: the balance of two sources of images ([`Balance`], equation 2),
//! batches from one source each (`batches`), anchors that fit a dataset ([`anchors()`]), epochs for
//! an equal number of updates ([`Updates`]), and a [`kit`] of files for PyTorch.

mod anchors;
mod balance;
mod batches;
pub mod kit;
mod updates;

#[doc(hidden)]
pub use anchors::{Anchors, anchors};
#[doc(hidden)]
pub use balance::{Balance, Weights};
#[doc(hidden)]
pub use batches::{Batch, BatchOptions, Source, batches};
#[doc(hidden)]
pub use updates::{Updates, batches_per_epoch};
