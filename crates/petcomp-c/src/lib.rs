//! petcomp for C: key a picture, solve a camera, make labelled samples of a recipe.
//!
//! `include/petcomp.h` is made from this crate; `docs/c.md` has an example. Every function returns a
//! [`Status`]; what went wrong is said by [`petcomp_error_message`]. No panic and no exception leaves
//! a function. All of them may be called from any thread at any time; a pipeline may be closed while
//! another thread still makes a sample of it, which then ends as usual.
//!
//! Pointers must be null or point to as many values as the function says. Null, misaligned pointers,
//! sizes that cannot be, text that is not UTF-8 and what was closed are refused, not followed.

mod camera;
mod handles;
mod key;
mod memory;
mod pipeline;
mod sample;
mod status;

pub use camera::{CameraModel, petcomp_camera_solve};
pub use key::petcomp_key;
pub use pipeline::{PipelineHandle, petcomp_pipeline_close, petcomp_pipeline_open};
pub use sample::{
    SampleHandle, petcomp_sample_free, petcomp_sample_labels, petcomp_sample_linear,
    petcomp_sample_make, petcomp_sample_size, petcomp_sample_srgb8,
};
pub use status::{Status, petcomp_error_message, petcomp_version};
