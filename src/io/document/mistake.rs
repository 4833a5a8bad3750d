//! Mistakes in documents, in words for the people who write them.

use crate::error::{Error, one_line};

/// What a parser did not accept, and where.
pub(super) struct DocumentMistake {
    /// Path of the field; empty, `.` or `?` for the document itself.
    pub(super) at: String,
    pub(super) line: Option<usize>,
    pub(super) what: String,
}

impl DocumentMistake {
    pub(super) fn into_error(self) -> Error {
        let (at, what) = self.place_and_message();
        match (at, self.line) {
            ("" | "." | "?", None) => Error::value("document", what),
            ("" | "." | "?", Some(line)) => Error::value(format!("line {line}"), what),
            (at, None) => Error::value(at, what),
            (at, Some(line)) => Error::value(at, format!("{what} (line {line})")),
        }
    }

    fn place_and_message(&self) -> (&str, String) {
        let at = self.at.as_str();
        if let Some((key, what)) = unknown_key(&self.what) {
            // The path of an unknown key ends with the key itself, which the message names anyway.
            let outer = at.strip_suffix(key).map(|at| at.trim_end_matches('.'));
            return (outer.unwrap_or(at), what);
        }
        match missing_key(&self.what) {
            Some(key) => (at, format!("missing key \"{key}\"")),
            None => (at, without_rust_types(&one_line(&self.what))),
        }
    }
}

/// The same without the names that Rust has for what was expected.
fn without_rust_types(message: &str) -> String {
    let Some((front, wanted)) = message.rsplit_once("expected ") else {
        return message.into();
    };
    let kind = wanted.split(' ').next().unwrap_or_default();
    let words = match kind {
        "u8" => "an integer from 0 to 255",
        "u16" => "an integer from 0 to 65535",
        "u32" => "an integer from 0 to 4294967295",
        "u64" | "usize" => "an integer from 0",
        "i8" | "i16" | "i32" | "i64" | "isize" => "an integer",
        "f32" | "f64" => "a number",
        "struct" | "internally" | "adjacently" => "a table",
        "enum" | "variant" => "a name",
        "tuple" => "a list",
        _ => wanted,
    };
    format!("{front}expected {words}")
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

/// Share of letters that agree from which a key is treated as a misspelling.
const SIMILAR_SHARE: f64 = 0.5;

/// What was probably meant by a name that is none of those known.
pub(crate) fn suggestion(key: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .min_by_key(|name| strsim::damerau_levenshtein(key, name));
    match nearest {
        None => "expected none".into(),
        Some(near) if strsim::normalized_damerau_levenshtein(key, near) >= SIMILAR_SHARE => {
            format!("did you mean \"{near}\"?")
        }
        Some(_) => format!("expected one of {}", known.join(", ")),
    }
}
