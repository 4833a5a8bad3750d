//! What went wrong in a store, without secrets.

use object_store::Error;
use std::error::Error as _;

/// How many characters of a message are shown: a store may respond with a whole page.
const SHOWN_LETTERS: usize = 300;

/// The message of an error and of its causes on one line, without the queries of URLs, where Azure
/// has its signatures.
pub(crate) fn explained(error: &Error) -> String {
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let words = inner.to_string();
        if !message.contains(&words) {
            message += &format!(": {words}");
        }
        cause = inner.source();
    }
    let words = message.split_whitespace().map(without_query);
    let line = words.collect::<Vec<_>>().join(" ");
    line.chars().take(SHOWN_LETTERS).collect()
}

fn without_query(word: &str) -> String {
    match word.split_once('?') {
        Some((address, _)) if address.contains("://") => format!("{address}?.."),
        _ => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signature_is_not_shown() {
        let source = "PUT https://a.blob.core.windows.net/c/x?sig=hush failed\n<html>".into();
        let error = Error::Generic {
            store: "Azure",
            source,
        };
        let message = explained(&error);
        assert!(
            message.contains("https://a.blob.core.windows.net/c/x?.. failed <html>"),
            "{message}"
        );
        assert!(!message.contains("hush"), "{message}");
    }
}
