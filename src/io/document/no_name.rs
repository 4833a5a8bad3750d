//! A value of the wrong type where one of several names is expected.

use serde::de::DeserializeOwned;
use serde_path_to_error::{Error, Segment};
use toml::Value;

/// toml's messages for it, for a text and for a table: they contain neither the value nor the names.
const SAID: [&str; 2] = [
    "wanted string or table",
    "invalid type: unit variant, expected string only",
];

/// The message for a document that was read as a `T`.
pub(super) fn message<T: DeserializeOwned>(
    error: &Error<toml::de::Error>,
    document: impl FnOnce() -> Option<Value>,
) -> String {
    let said = error.inner().message();
    let is_no_name = SAID.contains(&said);
    let document = is_no_name.then(document).flatten();
    let named = document.and_then(|document| name_expected::<T>(error, document));
    named.unwrap_or_else(|| said.to_owned())
}

/// The names are only listed for an unknown name: so the value is read again as if it were a name.
fn name_expected<T: DeserializeOwned>(
    error: &Error<toml::de::Error>,
    mut document: Value,
) -> Option<String> {
    let value = error.path().iter().try_fold(&mut document, down)?;
    let shown = value.to_string();
    *value = Value::String(shown.clone());
    let other = serde_path_to_error::deserialize::<_, T>(document).err()?;
    let is_there = other.path().to_string() == error.path().to_string();
    let (_, names) = other.inner().message().split_once("`, expected ")?;
    is_there.then(|| format!("{shown}, expected {}", names.replace('`', "\"")))
}

fn down<'v>(value: &'v mut Value, step: &Segment) -> Option<&'v mut Value> {
    match step {
        Segment::Seq { index } => value.get_mut(*index),
        Segment::Map { key } | Segment::Enum { variant: key } => value.get_mut(key.as_str()),
        Segment::Unknown => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{from_table, parse_toml};
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[allow(dead_code, reason = "only read by serde")]
    struct Labels {
        rules: Vec<Rule>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "snake_case")]
    #[allow(dead_code, reason = "only read by serde")]
    enum Rule {
        Drop,
        Keep,
        Known { share: f64 },
    }

    #[test]
    fn a_value_that_is_no_name_is_met_with_the_names() {
        for value in ["3", "0.5", "true", "[1, 2]"] {
            let text = format!("rules = [\"drop\", {value}]");
            let expected =
                format!("rules[1]: {value}, expected one of \"drop\", \"keep\", \"known\"");
            let read = parse_toml::<Labels>(&text).unwrap_err().to_string();
            assert_eq!(read, format!("{expected} (line 1)"));
            let table = from_table::<Labels>(text.parse().unwrap());
            assert_eq!(table.unwrap_err().to_string(), expected);
        }
    }
}
