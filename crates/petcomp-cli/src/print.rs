//! Everything that is printed: what no terminal obeys, and no panic where nobody can take it.

use petcomp::{Error, printable};
use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// As of a program that SIGPIPE ended.
const READER_GONE: i32 = 141;

/// A line on the standard output, whatever is in it.
pub(crate) fn line(line: impl Display) {
    out(&(printable(&line.to_string()) + "\n"));
}

/// Lines on the standard output: a table, a script.
pub(crate) fn text(text: impl Display) {
    out(&(lines(&text.to_string()) + "\n"));
}

/// A line on the standard error. Where it cannot be written there is nobody to tell that to.
pub(crate) fn aside(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", printable(&line.to_string()));
}

/// What clap has to say, help or a wrong command line, and the exit status that goes with it.
pub(crate) fn usage(said: &clap::Error) -> ExitCode {
    let plain = said.render().to_string();
    let shown = lines(&plain);
    // With its colours, unless an argument brings some of its own.
    let done = if shown == plain {
        said.print()
    } else {
        std::io::stderr().write_all(shown.as_bytes())
    };
    match done {
        Err(error) if !said.use_stderr() => gone(&error),
        _ => ExitCode::from(u8::try_from(said.exit_code()).unwrap_or(u8::MAX)),
    }
}

/// Printable lines.
fn lines(text: &str) -> String {
    text.split('\n')
        .map(printable)
        .collect::<Vec<_>>()
        .join("\n")
}

fn out(text: &str) {
    let mut out = std::io::stdout();
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        gone(&error);
    }
}

/// `petcomp ... | head` ends when head does, which is no failure of ours; a full disk is one.
fn gone(error: &std::io::Error) -> ! {
    if error.kind() == ErrorKind::BrokenPipe {
        std::process::exit(READER_GONE);
    }
    aside(format_args!(
        "error: {}",
        Error::file("standard output", error)
    ));
    std::process::exit(crate::common::FILE.into());
}
