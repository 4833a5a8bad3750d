//! All printing: free of terminal control sequences, and without a panic if the output is closed.

use petcomp::{Error, printable};
use std::fmt::Display;
use std::io::{ErrorKind, Write};

/// Exit status of a program terminated by SIGPIPE.
const BROKEN_PIPE_STATUS: i32 = 141;

/// Prints a line on standard output, whatever it contains.
pub(crate) fn line(line: impl Display) {
    write_out(&(printable(&line.to_string()) + "\n"));
}

/// Prints lines on standard output: a table, a script.
pub(crate) fn text(text: impl Display) {
    write_out(&(printable_lines(&text.to_string()) + "\n"));
}

/// Prints a line on standard error. If that fails, nobody can be told.
pub(crate) fn aside(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", printable(&line.to_string()));
}

/// `1 photo` or `2 photos`.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {thing}{plural}")
}

/// Prints clap's message (help or an error in the command line), and returns its exit status.
pub(crate) fn usage(message: &clap::Error) -> u8 {
    match print_usage(message) {
        Err(error) if !message.use_stderr() => exit_unwritable(&error),
        _ => u8::try_from(message.exit_code()).unwrap_or(u8::MAX),
    }
}

/// In colour, unless an argument contains control characters.
fn print_usage(message: &clap::Error) -> std::io::Result<()> {
    let plain = message.render().to_string();
    let tame = printable_lines(&plain);
    if tame == plain {
        message.print()
    } else {
        std::io::stderr().write_all(tame.as_bytes())
    }
}

fn printable_lines(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(printable).collect();
    lines.join("\n")
}

fn write_out(text: &str) {
    let mut out = std::io::stdout();
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        exit_unwritable(&error);
    }
}

/// `petcomp ... | head` ends when head does, which is not a failure of ours; a full disk is one.
fn exit_unwritable(error: &std::io::Error) -> ! {
    if error.kind() == ErrorKind::BrokenPipe {
        std::process::exit(BROKEN_PIPE_STATUS);
    }
    let error = Error::file("standard output", error);
    aside(format_args!("error: {error}"));
    std::process::exit(crate::exit::FILE_STATUS.into());
}
