//! Single values of a document, set on the command line: `camera.focal_px=2900`,
//! `objects[0].grade.hue_deg=30`.

use crate::error::{Error, Result};
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;
use toml::Value;

/// Most levels of a path.
const MAX_DEPTH: usize = 60;

/// A value and its path in a document.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    path: String,
    value: Value,
}

impl FromStr for Override {
    type Err = Error;

    /// From `path=value`; the value is TOML (`3`, `[4, 12]`, `"text"`, `true`), or otherwise text
    /// that does not begin like a list or table.
    fn from_str(text: &str) -> Result<Self> {
        let Some((path, value)) = text.split_once('=') else {
            return Err(Error::value(text, "no value, expected KEY=VALUE"));
        };
        let path = path.trim().to_owned();
        check_depth(&path)?;
        let value = parse_value(value).map_err(|what| Error::value(&path, what))?;
        if is_finite(&value) {
            return Ok(Self { path, value });
        }
        let what = format!("{value}, expected a finite number");
        Err(Error::value(path, what))
    }
}

/// Fails for a path of more names than a document has levels: some take the stack for each level.
pub(crate) fn check_depth(path: &str) -> Result<()> {
    let depth = path.split(['.', '[']).count();
    if depth <= MAX_DEPTH {
        return Ok(());
    }
    let start: String = path.chars().take(MAX_DEPTH).collect();
    let what = format!("{depth} names deep, expected at most {MAX_DEPTH}");
    Err(Error::value(format!("{start}.."), what))
}

impl Display for Override {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "{}={}", self.path, self.value)
    }
}

/// Parses TOML or text. An unterminated list or one with bare words is not treated as text: its
/// reader would blame the document.
fn parse_value(text: &str) -> std::result::Result<Value, String> {
    let table = format!("value = {text}").parse::<toml::Table>();
    match table.ok().and_then(|mut table| table.remove("value")) {
        Some(value) => Ok(value),
        None if text.trim_start().starts_with(['[', '{']) => Err(format!(
            "{text} is not TOML, expected a value such as [4, 12] or [\"yolo\"], quoted for the shell"
        )),
        None => Ok(Value::String(text.to_owned())),
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
    /// The path of the value: `scene.objects`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Sets the value in a document; missing tables on the way are created, missing list entries
    /// are not.
    pub(super) fn apply(&self, document: &mut toml::Table) -> Result<()> {
        let place = self.place_in(document);
        *place.map_err(|what| Error::value(&self.path, what))? = self.value.clone();
        Ok(())
    }

    fn place_in<'t>(
        &self,
        document: &'t mut toml::Table,
    ) -> std::result::Result<&'t mut Value, &'static str> {
        let mut steps = self.path.split('.').flat_map(split_indices);
        let first = match steps.next() {
            Some(PathStep::Key(key)) => Ok(entry(document, key)),
            _ => Err("no key, expected KEY=VALUE"),
        };
        steps.fold(first, |here, step| step.down_from(here?))
    }
}

/// One step of a path.
enum PathStep<'a> {
    Key(&'a str),
    Index(usize),
}

impl PathStep<'_> {
    fn down_from(self, value: &mut Value) -> std::result::Result<&mut Value, &'static str> {
        match (value, self) {
            (Value::Table(table), Self::Key(key)) => Ok(entry(table, key)),
            (Value::Array(list), Self::Index(i)) => {
                list.get_mut(i).ok_or("no such entry in the list")
            }
            (_, Self::Key(_)) => Err("leads through a value that is not a table"),
            (_, Self::Index(_)) => Err("leads through a value that is not a list"),
        }
    }
}

/// The value of a key, a new table if it is missing.
fn entry<'t>(table: &'t mut toml::Table, key: &str) -> &'t mut Value {
    table
        .entry(key)
        .or_insert_with(|| Value::Table(toml::Table::new()))
}

/// `objects[3]` is the key `objects`, then the index 3; anything in another form is a single key.
fn split_indices(part: &str) -> Vec<PathStep<'_>> {
    let (key, rest) = part.split_at(part.find('[').unwrap_or(part.len()));
    let indices = rest.split_terminator(']').map(|index| {
        let index = index.strip_prefix('[')?.parse().ok()?;
        Some(PathStep::Index(index))
    });
    let steps = std::iter::once(Some(PathStep::Key(key))).chain(indices);
    let steps: Option<Vec<_>> = steps.collect();
    steps.unwrap_or_else(|| vec![PathStep::Key(part)])
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
    fn a_path_of_any_depth_is_refused() {
        let text = format!("{}=1", vec!["a"; 100_000].join("."));
        let refused = text.parse::<Override>().unwrap_err().to_string();
        assert!(
            refused.ends_with("100000 names deep, expected at most 60"),
            "{refused}"
        );
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
    fn brackets_without_an_index_are_of_the_key() {
        assert_eq!(
            applied("a = 1", "a[foo]=x").unwrap(),
            "a = 1\n\"a[foo]\" = \"x\"\n"
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
    fn a_list_that_is_not_toml_is_refused() {
        for list in ["[1,2", "[yolo]", "{a=1"] {
            let told = applied("", &format!("a.b={list}")).unwrap_err().to_string();
            let expected = format!("a.b: {list} is not TOML, expected a value such as ");
            assert!(told.starts_with(&expected), "{told}");
        }
    }

    #[test]
    fn without_a_value_it_is_refused() {
        assert!("a.b".parse::<Override>().is_err());
    }
}
