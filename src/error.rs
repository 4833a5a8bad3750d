//! One error type for the library: the place first, then the offending value and what was expected.

use std::path::{Path, PathBuf};

/// What a stage returns.
pub type Result<T> = std::result::Result<T, Error>;

/// Why something could not be done, by who must act.
///
/// Messages are one line, lower case, without a full stop: `tray.label.json: surface.corners_px: 3
/// corners, expected 4`.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that cannot be read, understood or written.
    #[error("{}: {what}", named(.path))]
    File {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it, and what was expected.
        what: String,
    },
    /// A value in a document that is well-formed but cannot be right.
    #[error("{}: {at}: {what}", named(.path))]
    Field {
        /// Which document.
        path: PathBuf,
        /// Which field, as a path: `objects[3].size`.
        at: String,
        /// The offending value and what was expected.
        what: String,
    },
    /// A scene or an option, given in memory, that cannot be right.
    #[error("{at}: {what}")]
    Value {
        /// Which value, as a path: `objects[3].placement`.
        at: String,
        /// The offending value and what was expected.
        what: String,
    },
    /// A photo in which no usable object was found.
    #[error("no cut-out: {what}")]
    Photo {
        /// What was found instead, and what to do.
        what: String,
    },
    /// A rectangle that no camera can have seen; in a file it is an [`Error::Field`].
    #[error("{at}: {what}")]
    Camera {
        /// Where it is wrong, usually `surface.corners_px`.
        at: String,
        /// What is wrong, and what was expected.
        what: String,
    },
    /// Dropped objects that would not come to rest.
    #[error("settle: {what}")]
    Unsettled {
        /// What was still wrong, and after how many tries.
        what: String,
    },
    /// The caller asked to stop.
    #[error("interrupted: {what}")]
    Interrupted {
        /// What is done, and how to continue.
        what: String,
    },
}

impl Error {
    /// A [`Error::File`] from any message; without the operating system's error number.
    pub fn file(path: impl AsRef<Path>, what: impl std::fmt::Display) -> Self {
        Self::File {
            path: path.as_ref().into(),
            what: without_number(&what.to_string()),
        }
    }

    /// A [`Error::Value`] at a field path.
    pub fn value(at: impl Into<String>, what: impl std::fmt::Display) -> Self {
        Self::Value {
            at: at.into(),
            what: what.to_string(),
        }
    }

    /// The same error, its field path from one level further out: `count` within `scene` is
    /// `scene.count`, and the whole `document` is `scene`.
    pub fn within(self, outer: &str) -> Self {
        match self {
            Self::Value { at, what } if at == "document" => Self::value(outer, what),
            Self::Value { at, what } => Self::Value {
                at: format!("{outer}.{at}"),
                what,
            },
            other => other,
        }
    }

    /// The same error, with the document that contains the value.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        let path = path.as_ref().to_path_buf();
        match self {
            Self::Value { at, what } | Self::Camera { at, what } => Self::Field { path, at, what },
            Self::Photo { .. } => Self::File {
                path,
                what: self.to_string(),
            },
            other => other,
        }
    }
}

/// The system's message without its number, in our spelling: `no such file or directory`.
fn without_number(message: &str) -> String {
    let Some((front, rest)) = message.split_once(" (os error ") else {
        return message.into();
    };
    let behind = rest.split_once(')').map_or("", |(_, behind)| behind);
    // The system's own text comes last in the message, and is the only part that begins with a
    // capital.
    let start = front.rfind(": ").map_or(0, |colon| colon + 2);
    let (before, words) = front.split_at(start);
    let mut letters = words.chars();
    let first = letters
        .next()
        .map(|c| c.to_lowercase().to_string())
        .unwrap_or_default();
    format!("{before}{first}{}{behind}", letters.as_str())
}

/// A file as messages name it: on one line, whatever characters its name contains.
fn named(path: &Path) -> String {
    printable(&path.to_string_lossy())
}

/// Text that is safe to show on a line of a terminal or in a document: what would move the cursor,
/// change colours, begin a line or reverse the order of letters is written out, a line feed as
/// `\\n` and an escape as `\\x1b`.
pub fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' => shown += "\\n",
            '\t' => shown += "\\t",
            '\r' => shown += "\\r",
            c if is_control(c) => shown += &format!("\\x{:02x}", u32::from(c)),
            c => shown.push(c),
        }
    }
    shown
}

/// How many characters of a foreign message are shown; a damaged file may make a decoder list
/// thousands of numbers.
const SHOWN_LETTERS: usize = 300;

/// The beginning of any text on one line.
pub(crate) fn one_line(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(SHOWN_LETTERS) {
        Some((end, _)) => format!("{}..", &line[..end]),
        None => line,
    }
}

/// Control characters, separators of lines and paragraphs, and marks of direction (Unicode
/// Bidirectional Algorithm, "explicit directional embeddings, overrides and isolates").
fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_whatever_a_file_is_called() {
        assert_eq!(
            Error::file("a\nb.png", "no such file").to_string(),
            "a\\nb.png: no such file"
        );
        assert_eq!(
            Error::value("n", "0").in_file("a\x1b.toml").to_string(),
            "a\\x1b.toml: n: 0"
        );
    }

    #[test]
    fn what_a_terminal_would_obey_is_written_out() {
        assert_eq!(
            printable("a\u{1b}[31m\nb\r\t\u{9b}\u{7f}"),
            "a\\x1b[31m\\nb\\r\\t\\x9b\\x7f"
        );
        assert_eq!(printable("exe\u{202e}gpj"), "exe\\x202egpj");
        assert_eq!(printable("größe 3 \\ µm"), "größe 3 \\ µm");
    }

    #[test]
    fn long_messages_are_cut() {
        assert_eq!(one_line(" a\n b "), "a b");
        assert_eq!(
            one_line(&"ö ".repeat(9999)).chars().count(),
            SHOWN_LETTERS + 2
        );
    }

    #[test]
    fn the_systems_numbers_are_left_out() {
        let of = |e: std::io::Error| Error::file("x", e).to_string();
        assert_eq!(
            of(std::io::Error::from_raw_os_error(2)),
            "x: no such file or directory"
        );
        let nested = format!(
            "cannot start: {}; try again",
            std::io::Error::from_raw_os_error(13)
        );
        assert_eq!(
            Error::file("x", nested).to_string(),
            "x: cannot start: permission denied; try again"
        );
        assert_eq!(
            Error::file("x", "Exif: Bad (3)").to_string(),
            "x: Exif: Bad (3)"
        );
    }

    #[test]
    fn a_field_is_named_from_the_outermost_document() {
        let within = |at: &str| Error::value(at, "0").within("scene").to_string();
        assert_eq!(within("count"), "scene.count: 0");
        assert_eq!(within("document"), "scene: 0");
    }

    #[test]
    fn a_message_names_file_field_and_value() {
        let e = Error::value("count", "0 objects, expected at least 1").in_file("recipe.toml");
        assert_eq!(
            e.to_string(),
            "recipe.toml: count: 0 objects, expected at least 1"
        );
    }
}
