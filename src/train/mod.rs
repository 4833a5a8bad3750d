//! Train: what a detector's training needs beside images: equation numbers are those of the paper.
//!
//! Plain functions for any trainer: the balance of two sources of images ([`Balance`], equation 2),
//! batches of one source each (`batches`), anchors that fit a dataset ([`anchors()`]), how many
//! epochs make equally many updates ([`Updates`]), and a [`kit`] of files for PyTorch.

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
