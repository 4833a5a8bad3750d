//! Documents that cross the border as JSON.

use petcomp::{Error, Result, io};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A document of Python's `json`, which writes numbers that are none as words: those are refused here.
pub(crate) fn parse<T: DeserializeOwned>(name: &str, text: &str) -> Result<T> {
    let values = serde_json::from_str(text);
    let values = values.map_err(|e| Error::value(name, without_place(&e)))?;
    io::from_json(name, values)
}

/// Where in the JSON it is means nothing to who wrote a dict.
fn without_place(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rfind(" at line ") {
        Some(end) => text[..end].to_owned(),
        None => text,
    }
}

/// The JSON of plain data.
pub(crate) fn text<T: Serialize>(value: &T) -> Result<String> {
    serde_json::to_string(value).map_err(|e| Error::value("document", e))
}
