//! petcomp for C: key an image, solve a camera, make labelled samples of a recipe.
//!
//! `include/petcomp.h` is generated from this crate; `docs/c.md` has an example. Every function
//! returns a [`Status`]; [`petcomp_error_message`] describes the error. No panic and no exception
//! leaves a function. You may call any function from any thread at any time. A pipeline closed
//! while another thread makes a sample of it stays open until that sample is finished.
//!
//! Pointers must be null or point to as many values as the function requires. Null and misaligned
//! pointers, impossible sizes, text that is not UTF-8 and closed handles are rejected.

mod camera;
mod handles;
mod key;
mod memory;
mod messages;
mod pipeline;
mod sample;
mod status;

pub use camera::{CameraModel, petcomp_camera_solve};
pub use key::petcomp_key;
pub use messages::{LogFunction, LogLevel, petcomp_log_to};
pub use pipeline::{PipelineHandle, petcomp_pipeline_close, petcomp_pipeline_open};
pub use sample::{
    SampleHandle, petcomp_sample_free, petcomp_sample_labels, petcomp_sample_linear,
    petcomp_sample_make, petcomp_sample_size, petcomp_sample_srgb8,
};
pub use status::{Status, petcomp_error_message, petcomp_version};
