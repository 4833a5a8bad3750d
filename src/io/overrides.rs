//! Single values of a document, given on a command line: `camera.focal_px=2900`, `objects[0].grade.hue_deg=30`.

use crate::{Error, Result};
use std::str::FromStr;
use toml::Value;

/// One value and its place in a document.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    path: String,
    value: Value,
}

impl FromStr for Override {
    type Err = Error;

    /// From `path=value`; the value is TOML (`3`, `[4, 12]`, `"text"`, `true`), and text where it is none of that.
    fn from_str(text: &str) -> Result<Self> {
        let Some((path, value)) = text.split_once('=') else {
            return Err(Error::value(text, "no value, expected KEY=VALUE"));
        };
        let parsed = format!("value = {value}")
            .parse::<toml::Table>()
            .ok()
            .and_then(|mut t| t.remove("value"));
        let value = parsed.unwrap_or_else(|| Value::String(value.to_owned()));
        match is_finite(&value) {
            true => Ok(Self {
                path: path.trim().to_owned(),
                value,
            }),
            false => Err(Error::value(
                path.trim(),
                format!("{value}, expected a finite number"),
            )),
        }
    }
}

fn is_finite(value: &Value) -> bool {
    match value {
        Value::Float(number) => number.is_finite(),
        Value::Array(list) => list.iter().all(is_finite),
        Value::Table(table) => table.values().all(is_finite),
        _ => true,
    }
}

impl Override {
    /// Puts the value into a document; tables on the way are made where they are missing, list entries are not.
    pub(super) fn apply(&self, document: &mut toml::Table) -> Result<()> {
        let mut steps = self.path.split('.').flat_map(split_indices).peekable();
        let refuse = |what: &str| Error::value(&self.path, what);
        let Some(Step::Key(first)) = steps.next() else {
            return Err(refuse("no key, expected KEY=VALUE"));
        };
        let mut here = document
            .entry(first)
            .or_insert_with(|| Value::Table(toml::Table::new()));
        for step in steps {
            here = match (here, step) {
                (Value::Table(table), Step::Key(key)) => table
                    .entry(key)
                    .or_insert_with(|| Value::Table(toml::Table::new())),
                (Value::Array(list), Step::Index(i)) => list
                    .get_mut(i)
                    .ok_or_else(|| refuse("no such entry in the list"))?,
                (_, Step::Key(_)) => return Err(refuse("goes into a value that is not a table")),
                (_, Step::Index(_)) => return Err(refuse("goes into a value that is not a list")),
            };
        }
        *here = self.value.clone();
        Ok(())
    }
}

/// One level down.
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

/// `objects[3]` is the key `objects`, then the index 3.
fn split_indices(part: &str) -> impl Iterator<Item = Step<'_>> {
    let (key, rest) = part
        .split_once('[')
        .map_or((part, ""), |(key, _)| (key, &part[key.len()..]));
    let indices = rest
        .split(['[', ']'])
        .filter_map(|n| n.parse().ok().map(Step::Index));
    std::iter::once(Step::Key(key)).chain(indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(document: &str, text: &str) -> Result<String> {
        let mut table: toml::Table = document.parse().expect("valid TOML");
        text.parse::<Override>()?.apply(&mut table)?;
        Ok(toml::to_string(&table).expect("was TOML before"))
    }

    #[test]
    fn a_value_is_replaced_in_place() {
        assert_eq!(
            applied("[a]\nb = 1\nc = 2\n", "a.b=[3, 4]").unwrap(),
            "[a]\nb = [3, 4]\nc = 2\n"
        );
    }

    #[test]
    fn a_missing_table_is_made() {
        assert_eq!(
            applied("", "key.clip_black=0.1").unwrap(),
            "[key]\nclip_black = 0.1\n"
        );
    }

    #[test]
    fn a_list_entry_is_found_by_its_index() {
        assert_eq!(
            applied("[[o]]\nx = 1\n[[o]]\nx = 2\n", "o[1].x=5").unwrap(),
            "[[o]]\nx = 1\n\n[[o]]\nx = 5\n"
        );
        assert!(
            applied("o = [1]", "o[3]=5")
                .unwrap_err()
                .to_string()
                .contains("no such entry")
        );
    }

    #[test]
    fn a_bare_word_is_text() {
        assert_eq!(
            applied("", "profile=robust").unwrap(),
            "profile = \"robust\"\n"
        );
    }

    #[test]
    fn without_a_value_it_is_refused() {
        assert!("a.b".parse::<Override>().is_err());
    }
}
