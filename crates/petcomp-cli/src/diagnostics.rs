//! Diagnostics on the terminal: `FILE: message [code]`, as compilers print them.

use petcomp::{Diagnostic, Severity};
use std::fmt::Display;

/// Logs what a stage noticed about a file: `FILE: message [code]`, each at the level of its
/// severity.
pub(crate) fn report_diagnostics(file: impl Display, diagnostics: &[Diagnostic]) {
    for diagnostic in diagnostics {
        log::log!(
            level_of(diagnostic.severity),
            "{}",
            located(&file, diagnostic)
        );
    }
}

/// One diagnostic as it is printed.
pub(crate) fn located(file: impl Display, diagnostic: &Diagnostic) -> String {
    format!("{file}: {diagnostic} [{}]", diagnostic.code)
}

/// Errors that a stage got over are warnings: what ends the program is another line.
fn level_of(severity: Severity) -> log::Level {
    match severity {
        Severity::Note => log::Level::Info,
        Severity::Warning | Severity::Error => log::Level::Warn,
    }
}
