//! OpenImageIO and libheif, in this process and in separate ones.

mod ffi;
pub(crate) mod openimageio;
mod pool;
mod protocol;
mod sandbox;
mod serve;
mod timeout;

pub use pool::worker_version;
pub use protocol::Linked;
pub use serve::serve;

pub(crate) use pool::ask;
pub(crate) use protocol::{Request, Response};
#[cfg(feature = "fuzzing")]
pub(crate) use protocol::{receive_samples, receive_shape};
