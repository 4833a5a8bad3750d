//! A program that hears interrupts.

use std::process::Command;

/// The same command, which hears interrupts also where the tests run in the background of a script,
/// which has them ignored.
pub(crate) fn hearing(command: &Command) -> Command {
    let mut hearing = Command::new("env");
    hearing
        .arg("--default-signal=INT")
        .arg(command.get_program())
        .args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        hearing.current_dir(folder);
    }
    hearing
}
