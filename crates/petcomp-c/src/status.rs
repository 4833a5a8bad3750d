//! Status codes and error messages.
#![expect(unsafe_code, reason = "names that C links")]

use petcomp::Error;
use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Result of a call. petcomp_error_message() describes an error.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Success.
    Ok = 0,
    /// An invalid pointer, size or text.
    BadArgument = 1,
    /// A buffer is too small; nothing was written to it.
    BufferTooSmall = 2,
    /// A pipeline or sample that was closed or never existed.
    Closed = 3,
    /// A file that cannot be read or parsed.
    File = 4,
    /// An invalid value in a document.
    Field = 5,
    /// An invalid value of an option.
    Value = 6,
    /// A photo without a usable object.
    Photo = 7,
    /// Corners that no camera can have seen.
    Camera = 8,
    /// Objects that did not come to rest.
    Unsettled = 9,
    /// A bug in petcomp: please report it.
    Internal = 10,
}

/// Why a call failed.
pub(crate) struct Failure {
    status: Status,
    message: String,
}

impl Failure {
    pub(crate) fn new(status: Status, message: String) -> Self {
        Self { status, message }
    }

    /// An invalid argument: its name, its value and what was expected.
    pub(crate) fn argument(name: &str, what: impl std::fmt::Display) -> Self {
        Self::new(Status::BadArgument, format!("{name}: {what}"))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::new(status_of(&error), error.to_string())
    }
}

fn status_of(error: &Error) -> Status {
    match error {
        Error::File { .. } => Status::File,
        Error::Field { .. } => Status::Field,
        Error::Value { .. } => Status::Value,
        Error::Photo { .. } => Status::Photo,
        Error::Camera { .. } => Status::Camera,
        Error::Unsettled { .. } => Status::Unsettled,
        _ => Status::Internal,
    }
}

thread_local! {
    static MESSAGE: RefCell<CString> = RefCell::default();
}

/// Does the work of a call; no panic leaves it.
pub(crate) fn call(work: impl FnOnce() -> Result<(), Failure>) -> Status {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => ended(Status::Ok, ""),
        Ok(Err(failure)) => ended(failure.status, &failure.message),
        Err(panic) => ended(Status::Internal, &panic_message(&*panic)),
    }
}

fn ended(status: Status, message: &str) -> Status {
    // A NUL would truncate the message; an ending thread has no messages any more.
    let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
    let _ = MESSAGE.try_with(|last| last.replace(message));
    status
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!(
        "petcomp panicked, which is a bug: {}",
        text.unwrap_or("no message")
    )
}

/// The error of this thread's last call, one line of UTF-8: the place, the value, what was
/// expected. Empty after success. The text is valid until the thread's next call.
#[unsafe(no_mangle)]
pub extern "C" fn petcomp_error_message() -> *const c_char {
    let message = MESSAGE.try_with(|last| last.borrow().as_ptr());
    message.unwrap_or(c"".as_ptr())
}

/// The version of the library, e.g. "0.1.0". The text is valid as long as the process.
#[unsafe(no_mangle)]
pub extern "C" fn petcomp_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    let version = CStr::from_bytes_with_nul(VERSION.as_bytes());
    version.unwrap_or_default().as_ptr()
}
