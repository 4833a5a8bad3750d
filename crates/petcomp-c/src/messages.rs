//! What the library notes on its way, for a function of the caller's.
#![expect(unsafe_code, reason = "called from C")]

use crate::status::{Status, call};
use log::{Level, LevelFilter, Log, Metadata, Record};
use std::ffi::{CString, c_char};
use std::sync::{Mutex, PoisonError};

/// How serious a message is.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Something failed.
    Error = 1,
    /// Something to look at, such as a photo that is not used.
    Warning = 2,
    /// Something to know.
    Info = 3,
}

/// Receives a message, one line of UTF-8 that is valid until the function returns.
pub type LogFunction = Option<unsafe extern "C" fn(level: LogLevel, message: *const c_char)>;

static FUNCTION: Mutex<LogFunction> = Mutex::new(None);

/// Sets the function that receives the library's messages, or ends them if null, as at first.
///
/// # Safety
/// `function` is null or may be called from any thread, several at once, until it is replaced and
/// the calls of petcomp that run meanwhile have returned. It must not throw.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_log_to(function: LogFunction) -> Status {
    call(|| {
        *FUNCTION.lock().unwrap_or_else(PoisonError::into_inner) = function;
        // Fails from the second time on.
        if log::set_logger(&ToCaller).is_ok() {
            log::set_max_level(LevelFilter::Info);
        }
        Ok(())
    })
}

struct ToCaller;

impl Log for ToCaller {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target().starts_with("petcomp")
    }

    fn log(&self, record: &Record<'_>) {
        let function = *FUNCTION.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(function) = function.filter(|_| self.enabled(record.metadata())) else {
            return;
        };
        let text = petcomp::printable(&record.args().to_string());
        let text = CString::new(text).unwrap_or_default();
        // SAFETY: promised by the caller of petcomp_log_to.
        unsafe { function(level_of(record.level()), text.as_ptr()) }
    }

    fn flush(&self) {}
}

fn level_of(level: Level) -> LogLevel {
    match level {
        Level::Error => LogLevel::Error,
        Level::Warn => LogLevel::Warning,
        Level::Info | Level::Debug | Level::Trace => LogLevel::Info,
    }
}
