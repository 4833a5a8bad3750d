//! Diagnostics on the terminal: `FILE: message [code]`, in the format of compilers.

use petcomp::{Diagnostic, Severity};
use std::fmt::Display;

/// Logs what a stage noticed about a file: `FILE: message [code]`, each at the level of its
/// severity.
pub(crate) fn report_diagnostics<'a>(
    file: impl Display,
    diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
) {
    for diagnostic in diagnostics {
        log::log!(
            level_of(diagnostic.severity),
            "{}",
            located(&file, diagnostic)
        );
    }
}

/// A diagnostic in printed form.
pub(crate) fn located(file: impl Display, diagnostic: &Diagnostic) -> String {
    format!("{file}: {diagnostic} [{}]", diagnostic.code)
}

/// Errors that a stage survived become warnings: what ends the program is a separate line.
fn level_of(severity: Severity) -> log::Level {
    match severity {
        Severity::Note => log::Level::Info,
        Severity::Warning | Severity::Error => log::Level::Warn,
    }
}
