//! What the library notes on its way, for Python's `logging`: the logger `petcomp`.
//!
//! Threads at work never wait for the interpreter: they leave their messages here, and who waits for
//! them delivers.

use crate::lock::locked;
use log::{Level, LevelFilter, Log, Metadata, Record};
use pyo3::prelude::*;
use std::sync::{Mutex, Once};

/// Messages that nobody has taken yet; a flood is cut.
static WAITING: Mutex<Vec<(u8, String)>> = Mutex::new(Vec::new());
const MOST_WAITING: usize = 1000;

struct Queue;

/// From the first call on, messages are kept.
pub(crate) fn start() {
    static ONCE: Once = Once::new();
    // Fails only where the program runs in this process: it prints them itself.
    ONCE.call_once(|| {
        if log::set_logger(&Queue).is_ok() {
            log::set_max_level(LevelFilter::Info);
        }
    });
}

/// Hands all messages to Python.
pub(crate) fn deliver(py: Python<'_>) -> PyResult<()> {
    let waiting = std::mem::take(&mut *locked(&WAITING));
    if waiting.is_empty() {
        return Ok(());
    }
    let logger = py
        .import("logging")?
        .call_method1("getLogger", ("petcomp",))?;
    for (level, text) in waiting {
        logger.call_method1("log", (level, "%s", text))?;
    }
    Ok(())
}

impl Log for Queue {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target().starts_with("petcomp")
    }

    fn log(&self, record: &Record<'_>) {
        let mut waiting = locked(&WAITING);
        if self.enabled(record.metadata()) && waiting.len() < MOST_WAITING {
            let text = petcomp::printable(&record.args().to_string());
            waiting.push((python_level(record.level()), text));
        }
    }

    fn flush(&self) {}
}

/// The numbers of Python's `logging`.
fn python_level(level: Level) -> u8 {
    match level {
        Level::Error => 40,
        Level::Warn => 30,
        Level::Info => 20,
        Level::Debug | Level::Trace => 10,
    }
}
