//! Documents: reads TOML and JSON and locates mistakes; writes text, completely or not at all.

mod duplicate_keys;
mod mistake;
mod no_name;
mod overrides;

pub(crate) use mistake::suggestion;
pub use overrides::Override;
#[cfg(feature = "pipeline")]
pub(crate) use overrides::check_depth;

use super::fs::{read_regular, write_bytes};
use super::options::ReadOptions;
use crate::error::{Error, Result, one_line};
use duplicate_keys::{check_json, find_invalid_toml};
use mistake::DocumentMistake;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::DeTable;

const BYTE_ORDER_MARK: char = '\u{feff}';

/// Reads a TOML document.
///
/// # Errors
/// [`Error::File`] for a file that cannot be read or is not TOML; [`Error::Field`] for an invalid
/// value or an unknown key, with the key that was probably meant.
pub fn read_toml<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    let path = path.as_ref();
    parse_toml(&read_text(path)?).map_err(|e| e.in_file(path))
}

/// Parses a TOML document in memory after replacing some of its values and applying `change`.
///
/// # Errors
/// Like [`parse_toml`]; an override of a value that cannot exist.
pub(crate) fn parse_toml_with<T: DeserializeOwned>(
    text: &str,
    overrides: &[Override],
    change: impl FnOnce(&mut toml::Table),
) -> Result<T> {
    let mut document: toml::Table = parse_toml(text)?;
    apply_all(overrides, &mut document)?;
    change(&mut document);
    // Only the text knows the line of a mistake.
    from_table(document).map_err(|e| parse_toml::<T>(text).err().unwrap_or(e))
}

fn apply_all(overrides: &[Override], document: &mut toml::Table) -> Result<()> {
    overrides.iter().try_for_each(|o| o.apply(document))
}

/// Settings from overrides alone, all of them in the table `table`.
///
/// # Errors
/// An override outside the table or of a value that cannot exist; an unknown key of `T`, with the
/// one that was probably meant; an invalid value.
pub fn from_overrides<T: DeserializeOwned>(table: &str, overrides: &[Override]) -> Result<T> {
    let mut document = toml::Table::new();
    document.insert(table.into(), toml::Table::new().into());
    apply_all(overrides, &mut document)?;
    let settings = document.remove(table);
    if let Some(key) = document.keys().next() {
        let what = format!("no such table, expected {table}.NAME=VALUE");
        return Err(Error::value(key, what));
    }
    let settings = settings.unwrap_or_else(|| toml::Table::new().into());
    from_value(settings, &format!("{table}."))
}

/// A document from a table in memory.
///
/// # Errors
/// Like [`parse_toml`].
pub(crate) fn from_table<T: DeserializeOwned>(table: toml::Table) -> Result<T> {
    from_value(table.into(), "")
}

/// A document from a table in memory with some of its values replaced.
///
/// # Errors
/// Like [`parse_toml`]; an override with an invalid path.
pub(crate) fn from_table_with<T: DeserializeOwned>(
    mut table: toml::Table,
    overrides: &[Override],
) -> Result<T> {
    apply_all(overrides, &mut table)?;
    from_table(table)
}

fn from_value<T: DeserializeOwned>(value: toml::Value, outer: &str) -> Result<T> {
    let document = value.clone();
    serde_path_to_error::deserialize(value).map_err(|e| {
        let at = format!("{outer}{}", e.path());
        DocumentMistake {
            at: at.trim_end_matches('.').into(),
            line: None,
            what: no_name::message::<T>(&e, || Some(document)),
        }
        .into_error()
    })
}

/// A document from JSON values in memory; `name` is the name of the whole in errors.
///
/// # Errors
/// [`Error::Value`] for an invalid value or an unknown key, by its path below `name`, with the key
/// that was probably meant.
pub fn from_json<T: DeserializeOwned>(name: &str, value: serde_json::Value) -> Result<T> {
    serde_path_to_error::deserialize(value).map_err(|e| {
        let at = format!("{name}.{}", e.path());
        json_mistake(e.inner(), at.trim_end_matches(['.', '?']).into())
    })
}

/// Reads a document as JSON if its extension is `.json`, otherwise as TOML.
///
/// # Errors
/// Like [`read_toml`].
pub fn read_document<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    if has_extension(path.as_ref(), "json") {
        read_json(path)
    } else {
        read_toml(path)
    }
}

/// Writes a document in the format of its extension: JSON (`.json`) or TOML (`.toml`).
///
/// # Errors
/// [`Error::File`] for another extension, if the format cannot express the value, or if the file
/// cannot be written.
pub fn write_document<T: Serialize + ?Sized>(path: impl AsRef<Path>, value: &T) -> Result<()> {
    let path = path.as_ref();
    if has_extension(path, "json") {
        write_json(path, value)
    } else if has_extension(path, "toml") {
        write_toml(path, value)
    } else {
        let what = "no format for this extension, expected .toml or .json";
        Err(Error::file(path, what))
    }
}

/// Whether a file name has an extension, ignoring case.
pub fn has_extension(path: &Path, expected: &str) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(expected))
}

/// Reads a JSON document.
///
/// # Errors
/// Like [`read_toml`].
pub fn read_json<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    let path = path.as_ref();
    parse_json(&read_text(path)?).map_err(|e| e.in_file(path))
}

/// Reads a JSON document with data, not settings (ground truth and detections in COCO format); it
/// may be as large as a picture ([`Limits::file_bytes`](super::Limits::file_bytes)).
///
/// # Errors
/// Like [`read_toml`].
pub(crate) fn read_json_data<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    let path = path.as_ref();
    let most = (ReadOptions::default().limits.file_bytes, "file_bytes");
    let text = utf8(path, read_regular(path, most, "text file")?)?;
    // Tracking the position costs as much as everything else, and only a mistake needs it.
    serde_json::from_str(&text)
        .or_else(|_| deserialize_json(&text))
        .map_err(|e| e.in_file(path))
}

/// Reads a text file, without the byte order mark that Windows editors write.
///
/// # Errors
/// [`Error::File`] for a file that is missing, not regular, larger than
/// [`Limits::document_bytes`](super::Limits::document_bytes) or not UTF-8.
pub fn read_text(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    utf8(path, read_bytes(path)?)
}

/// The same, and whether the file begins with the byte order mark.
pub(crate) fn read_marked_text(path: &Path) -> Result<(String, bool)> {
    let bytes = read_bytes(path)?;
    let is_marked = bytes.starts_with(BYTE_ORDER_MARK.to_string().as_bytes());
    Ok((utf8(path, bytes)?, is_marked))
}

/// The lines of a text, ended as Python's: by `\r\n`, `\n` or a lone `\r`.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().flat_map(|line| line.split('\r'))
}

/// The bytes of a text file.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let limit = ReadOptions::default().limits.document_bytes;
    read_regular(path, (limit, "document_bytes"), "text file")
}

/// The text of a file, without a byte order mark.
fn utf8(path: &Path, bytes: Vec<u8>) -> Result<String> {
    let mut text = String::from_utf8(bytes).map_err(|_| Error::file(path, "not text (UTF-8)"))?;
    if text.starts_with(BYTE_ORDER_MARK) {
        text.drain(..BYTE_ORDER_MARK.len_utf8());
    }
    Ok(text)
}

/// Writes a document as TOML.
///
/// # Errors
/// [`Error::File`] if TOML cannot express it or the file cannot be written.
pub fn write_toml<T: Serialize + ?Sized>(path: impl AsRef<Path>, value: &T) -> Result<()> {
    let path = path.as_ref();
    let text = toml::to_string_pretty(value);
    write_text(
        path,
        &text.map_err(|e| Error::file(path, one_line(&e.to_string())))?,
    )
}

/// Writes a document as indented JSON.
///
/// # Errors
/// [`Error::File`] if JSON cannot express it or the file cannot be written.
pub fn write_json<T: Serialize + ?Sized>(path: impl AsRef<Path>, value: &T) -> Result<()> {
    let path = path.as_ref();
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::file(path, e))?;
    write_text(path, &(text + "\n"))
}

/// Writes a text file.
///
/// # Errors
/// [`Error::File`] if it cannot be written.
pub fn write_text(path: impl AsRef<Path>, text: &str) -> Result<()> {
    write_bytes(path.as_ref(), text.as_bytes())
}

/// Parses a TOML document in memory.
///
/// # Errors
/// [`Error::Value`] for anything that is not TOML, a duplicate key, a number that is not finite,
/// and invalid values.
pub(crate) fn parse_toml<T: DeserializeOwned>(text: &str) -> Result<T> {
    let document = checked_toml(text)?;
    serde_path_to_error::deserialize(toml::Deserializer::from(document)).map_err(|e| {
        let what = no_name::message::<T>(&e, || text.parse().ok().map(toml::Value::Table));
        toml_mistake(text, e.inner().span(), e.path().to_string(), what)
    })
}

/// Parses TOML; rejects numbers that are not finite and excessive nesting.
fn checked_toml(text: &str) -> Result<Spanned<DeTable<'_>>> {
    let document = DeTable::parse(text)
        .map_err(|e| toml_mistake(text, e.span(), String::new(), e.message().into()))?;
    match find_invalid_toml(&document, max_depth()) {
        Some((what, span)) => Err(toml_mistake(text, Some(span), String::new(), what)),
        None => Ok(document),
    }
}

fn toml_mistake(text: &str, span: Option<Range<usize>>, at: String, what: String) -> Error {
    let line = span.map(|span| line_of(text, span.start));
    DocumentMistake { at, line, what }.into_error()
}

/// Parses a JSON document in memory.
///
/// # Errors
/// Like [`parse_toml`].
pub(crate) fn parse_json<T: DeserializeOwned>(text: &str) -> Result<T> {
    check_json(text, max_depth()).map_err(|e| json_mistake(&e, String::new()))?;
    deserialize_json(text)
}

fn deserialize_json<T: DeserializeOwned>(text: &str) -> Result<T> {
    let mut document = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut document)
        .map_err(|e| json_mistake(e.inner(), e.path().to_string()))?;
    document
        .end()
        .map_err(|e| json_mistake(&e, String::new()))?;
    Ok(value)
}

fn json_mistake(e: &serde_json::Error, at: String) -> Error {
    let message = e.to_string();
    let what = message.split(" at line ").next().unwrap_or_default().into();
    // Types that deserialize from an intermediate tree of values have no line numbers.
    let line = Some(e.line()).filter(|&line| line > 0);
    DocumentMistake { at, line, what }.into_error()
}

/// Maximum nesting depth of a document.
fn max_depth() -> u64 {
    ReadOptions::default().limits.document_depth
}

fn line_of(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|&b| b == b'\n').count() + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use std::collections::BTreeMap;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only read by serde")]
    struct Recipe {
        seed: u64,
        objects: Objects,
        #[serde(default)]
        lights: Vec<Objects>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only read by serde")]
    struct Objects {
        count: u32,
        size_m: Option<f64>,
    }

    fn toml(text: &str) -> String {
        parse_toml::<Recipe>(text)
            .unwrap_err()
            .in_file("recipe.toml")
            .to_string()
    }

    fn json(text: &str) -> String {
        parse_json::<Recipe>(text)
            .unwrap_err()
            .in_file("recipe.json")
            .to_string()
    }

    #[test]
    fn an_unknown_key_is_met_with_the_one_that_was_meant() {
        let expected = "objects: unknown key \"cuont\", did you mean \"count\"?";
        assert_eq!(
            toml("seed = 1\n[objects]\ncuont = 3\n"),
            format!("recipe.toml: {expected} (line 3)")
        );
        assert_eq!(
            json(r#"{"seed": 1, "objects": {"cuont": 3}}"#),
            format!("recipe.json: {expected} (line 1)")
        );
        assert_eq!(
            toml("seed = 1\n[objects]\ncount = 3\n[[lights]]\ncount = 1\ncolour = 2"),
            "recipe.toml: lights[0]: unknown key \"colour\", expected one of count, size_m (line 6)"
        );
    }

    #[test]
    fn an_unknown_key_at_the_top_names_its_line() {
        assert_eq!(
            toml("\nseeed = 1\n"),
            "recipe.toml: line 2: unknown key \"seeed\", did you mean \"seed\"?"
        );
    }

    #[test]
    fn a_value_of_the_wrong_kind_is_named_with_its_field() {
        let expected = "objects.count: invalid type: string \"three\", expected an integer from 0";
        assert_eq!(
            toml("seed = 1\n[objects]\ncount = \"three\""),
            format!("recipe.toml: {expected} (line 3)")
        );
        let json = json("{\"seed\": 1, \"objects\": {\"count\": \"three\"}}");
        assert_eq!(json, format!("recipe.json: {expected} (line 1)"));
    }

    #[test]
    fn the_end_of_a_type_is_told_to_what_is_beyond_it() {
        let told = |count: &str| toml(&format!("seed = 1\n[objects]\ncount = {count}"));
        for smaller in ["-5", "20.5"] {
            let told = told(smaller);
            assert!(told.contains("expected an integer from 0 (line"), "{told}");
        }
        let told = told("4294967296");
        assert!(told.contains("from 0 to 4294967295 (line"), "{told}");
    }

    #[test]
    fn no_name_of_a_type_of_rust_is_in_a_message() {
        assert!(
            toml("seed = 1\nlights = 3")
                .contains("lights: invalid type: integer `3`, expected a list")
        );
        assert!(
            toml("seed = 1\nobjects = 3")
                .contains("objects: invalid type: integer `3`, expected a table")
        );
        assert!(json("[1, 2]").contains("expected"), "{}", json("[1, 2]"));
        assert!(
            json("3").ends_with("invalid type: integer `3`, expected a table"),
            "{}",
            json("3")
        );
        assert!(
            json("{\"seed\": 1, \"objects\": {\"count\": 1, \"size_m\": \"x\"}}")
                .contains("expected a number")
        );
    }

    #[test]
    fn a_document_is_written_in_the_format_of_its_name_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let written = |name: &str| {
            let path = folder.path().join(name);
            write_document(&path, &BTreeMap::from([("seed", 1)]))?;
            read_text(path)
        };
        assert_eq!(written("a.toml").unwrap(), "seed = 1\n");
        assert_eq!(written("a.JSON").unwrap(), "{\n  \"seed\": 1\n}\n");
        let told = written("a.yaml").unwrap_err().to_string();
        let expected = "a.yaml: no format for this extension, expected .toml or .json";
        assert!(told.ends_with(expected), "{told}");
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_document() {
        let folder = tempfile::tempdir().unwrap();
        let marked = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, format!("\u{feff}{text}")).unwrap();
            path
        };
        let expected = BTreeMap::from([("seed".to_owned(), 1)]);
        let toml: BTreeMap<String, u32> = read_document(marked("a.toml", "seed = 1\n")).unwrap();
        assert_eq!(toml, expected);
        let json: BTreeMap<String, u32> = read_document(marked("a.json", "{\"seed\": 1}")).unwrap();
        assert_eq!(json, expected);
        let data: BTreeMap<String, u32> =
            read_json_data(marked("b.json", "{\"seed\": 1}")).unwrap();
        assert_eq!(data, expected);
        let rows = read_text(marked("a.txt", "0 0.5 0.5 0.2 0.2\n")).unwrap();
        assert!(rows.starts_with("0 0.5"), "{rows:?}");
    }

    #[test]
    fn settings_are_made_of_overrides_alone() {
        let made = |texts: &[&str]| {
            let overrides: Result<Vec<Override>> = texts.iter().map(|t| t.parse()).collect();
            overrides
                .and_then(|o| from_overrides::<Objects>("key", &o))
                .map_err(|e| e.to_string())
        };
        let objects = made(&["key.count=3", "key.size_m = 0.5"]).unwrap();
        assert_eq!((objects.count, objects.size_m), (3, Some(0.5)));
        assert_eq!(
            made(&["key.cuont=3"]).unwrap_err(),
            "key: unknown key \"cuont\", did you mean \"count\"?"
        );
        assert_eq!(
            made(&["key.count=x"]).unwrap_err(),
            "key.count: invalid type: string \"x\", expected an integer from 0"
        );
        assert_eq!(
            made(&["kye.count=3"]).unwrap_err(),
            "kye: no such table, expected key.NAME=VALUE"
        );
    }

    #[test]
    fn a_missing_key_is_named() {
        assert_eq!(
            toml("seed = 1\n[objects]\n"),
            "recipe.toml: objects: missing key \"count\" (line 2)"
        );
    }

    #[test]
    fn broken_syntax_is_one_line_with_a_line_number() {
        let e = toml("seed = 1\nobjects = [");
        assert!(
            e.starts_with("recipe.toml: line 2: ") && !e.contains('\n'),
            "{e}"
        );
        let e = json("{\"seed\": 1,\n x}");
        assert!(
            e.starts_with("recipe.json: line 2: ") && !e.contains('\n'),
            "{e}"
        );
        assert!(json("{} {}").contains("missing key") || json("{} {}").contains("line"));
    }

    #[test]
    fn what_no_document_may_hold_is_named_with_its_line() {
        let e = json("{\"seed\": 1,\n\"objects\": {\"count\": 3},\n\"seed\": 2}");
        assert_eq!(e, "recipe.json: line 3: duplicate key \"seed\"");
        assert!(toml("seed = 1\nseed = 2").starts_with("recipe.toml: line 2: duplicate key"));
        let e = toml("seed = 1\n[objects]\ncount = 1\nsize_m = -inf");
        assert_eq!(e, "recipe.toml: line 4: -inf, expected a finite number");
        assert!(
            json("{\"seed\": 1, \"objects\": {\"count\": 1, \"size_m\": 1e999}}")
                .contains("out of range")
        );
        assert!(json("{\"seed\": NaN}").contains("line 1"));
        let infinite = [
            "objects.size_m=inf".parse::<Override>(),
            "a=[1, { b = nan }]".parse(),
        ];
        assert!(infinite.into_iter().all(|o| {
            o.unwrap_err()
                .to_string()
                .contains("expected a finite number")
        }));
    }

    #[test]
    fn nesting_without_end_is_an_error_and_not_a_crash() {
        for depth in [200, 1_000_000] {
            let e = json(&"[".repeat(depth));
            assert!(e.contains("nested deeper than 64 levels"), "{e}");
            let objects = "{\"a\":".repeat(depth);
            assert!(json(&objects).contains("nested deeper than 64 levels"));
        }
        for text in ["[", "{a=", "[["] {
            let e = toml(&format!("a = {}", text.repeat(100_000)));
            assert!(e.len() < 300 && !e.contains('\n'), "{e}");
        }
        assert!(toml(&format!("[{}a]", "a.".repeat(100_000))).len() < 300);
    }

    #[test]
    fn a_document_beyond_the_limit_is_refused_and_data_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        write_text(&path, &format!("[{}1]", "1,".repeat(8 << 20))).unwrap();
        let message = read_json::<Vec<u8>>(&path).unwrap_err().to_string();
        let expected = "16777219 bytes, over the limit of 16777216 (Limits::document_bytes; --limit document_bytes=N)";
        assert!(message.ends_with(expected), "{message}");
        assert_eq!(
            read_json_data::<Vec<u8>>(&path).unwrap().len(),
            (8 << 20) + 1
        );
    }

    #[test]
    fn values_in_memory_are_named_below_their_document() {
        let told = |value| {
            from_json::<Recipe>("recipe", value)
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            told(serde_json::json!({"seed": 1, "objects": {"cuont": 3}})),
            "recipe.objects: unknown key \"cuont\", did you mean \"count\"?"
        );
        assert_eq!(
            told(serde_json::json!({"seed": 1})),
            "recipe: missing key \"objects\""
        );
    }

    #[test]
    fn a_missing_document_says_so() {
        assert_eq!(
            read_toml::<Recipe>("no/x.toml").unwrap_err().to_string(),
            "no/x.toml: no such file"
        );
    }
}
