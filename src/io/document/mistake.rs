//! Mistakes in documents, explained to the people who write them.

use crate::error::{Error, one_line};

/// What a parser rejected, and where.
pub(super) struct DocumentMistake {
    /// Path of the field; empty, `.` or `?` for the document itself.
    pub(super) at: String,
    pub(super) line: Option<usize>,
    pub(super) what: String,
}

impl DocumentMistake {
    pub(super) fn into_error(self) -> Error {
        let (at, what) = self.place_and_message();
        let is_document = matches!(at, "" | "." | "?");
        match self.line {
            None if is_document => Error::value("document", what),
            Some(line) if is_document => Error::value(format!("line {line}"), what),
            None => Error::value(at, what),
            Some(line) => Error::value(at, format!("{what} (line {line})")),
        }
    }

    fn place_and_message(&self) -> (&str, String) {
        let at = self.at.as_str();
        if let Some((key, what)) = unknown_key(&self.what) {
            return (outer_path(at, key), what);
        }
        match missing_key(&self.what) {
            Some(key) => (at, format!("missing key \"{key}\"")),
            None => (at, without_rust_types(&one_line(&self.what))),
        }
    }
}

/// The path without its last step for an unknown key, which the message names anyway.
fn outer_path<'a>(at: &'a str, key: &str) -> &'a str {
    let outer = at.strip_suffix(key).map(|at| at.trim_end_matches('.'));
    outer.unwrap_or(at)
}

/// The message without Rust type names.
fn without_rust_types(message: &str) -> String {
    let Some((front, wanted)) = message.rsplit_once("expected ") else {
        return message.into();
    };
    let kind = wanted.split(' ').next().unwrap_or_default();
    let words = match (wanted, kind) {
        ("a sequence", _) => "a list",
        ("a map", _) => "a table",
        (_, "u8" | "u16" | "u32") if !is_large_integer(front) => "an integer from 0",
        _ => plain_name(kind).unwrap_or(wanted),
    };
    format!("{front}expected {words}")
}

/// Whether the value is too large for its Rust type, whose upper bound is usually not that of the
/// field.
fn is_large_integer(found: &str) -> bool {
    found.starts_with("invalid value: integer `") && !found.contains("`-")
}

/// The plain name of a kind of value that has this name in Rust or serde.
fn plain_name(kind: &str) -> Option<&'static str> {
    match kind {
        "u8" => Some("an integer from 0 to 255"),
        "u16" => Some("an integer from 0 to 65535"),
        "u32" => Some("an integer from 0 to 4294967295"),
        "u64" | "usize" => Some("an integer from 0"),
        "i8" | "i16" | "i32" | "i64" | "isize" => Some("an integer"),
        "f32" | "f64" => Some("a number"),
        "struct" | "internally" | "adjacently" => Some("a table"),
        "enum" | "variant" => Some("a name"),
        "tuple" => Some("a list"),
        _ => None,
    }
}

/// The key and our message, from serde's "unknown field `cuont`, expected one of `count`, `size`".
fn unknown_key(message: &str) -> Option<(&str, String)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut quoted = rest.split('`').skip(1).step_by(2);
    let key = quoted.next()?;
    let known: Vec<&str> = quoted.collect();
    let meant = suggestion(key, &known);
    Some((key, format!("unknown key \"{key}\", {meant}")))
}

fn missing_key(message: &str) -> Option<&str> {
    message.strip_prefix("missing field `")?.strip_suffix('`')
}

/// Minimum share of matching letters for a key to be treated as a misspelling.
const SIMILAR_SHARE: f64 = 0.5;

/// The name that was probably meant by an unknown one.
pub(crate) fn suggestion(key: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .min_by_key(|name| strsim::damerau_levenshtein(key, name));
    match nearest {
        None => "expected none".into(),
        Some(near) if are_similar(key, near) => format!("did you mean \"{near}\"?"),
        Some(_) => format!("expected one of {}", known.join(", ")),
    }
}

fn are_similar(a: &str, b: &str) -> bool {
    strsim::normalized_damerau_levenshtein(a, b) >= SIMILAR_SHARE
}
