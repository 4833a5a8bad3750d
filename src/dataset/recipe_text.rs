//! Edits some keys of a recipe's text and leaves the rest as its author wrote it.

use crate::dataset::settings::told_value;
use crate::error::{Error, Result};
use crate::io;
use std::ops::Range;
use toml_edit::{ArrayOfTables, Document, DocumentMut, InlineTable, Item, Table, Value};

/// A key of a recipe, and its new value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyEdit {
    /// Its path: `scene.lights[0].height`.
    pub path: String,
    /// Its value as TOML; none resets the key to its default.
    pub value: Option<String>,
}

impl KeyEdit {
    /// Sets a key to a value.
    pub fn set(path: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            value: Some(value.into()),
        }
    }
}

/// The text with these edits, applied in order.
///
/// A value is replaced where it is. A new key takes the place of the line that shows its default,
/// as in [the template](crate::dataset::DatasetConfig::template), or the end of its table; a key
/// that is reset becomes such a line again. `scene.lights[0]` set to `{}` is a new light with the
/// default values.
///
/// # Errors
/// A text or value that is not TOML; a key that cannot exist.
pub fn with_edits(text: &str, edits: &[KeyEdit]) -> Result<String> {
    // Its message includes the line of a mistake.
    io::parse_toml::<toml::Table>(text)?;
    edits.iter().try_fold(text.to_owned(), |text, edit| {
        io::check_depth(&edit.path)?;
        with_edit(&text, edit).map_err(|what| Error::value(&edit.path, what))
    })
}

/// What is wrong with an edit, or the text with it.
type Edited = std::result::Result<String, String>;

fn with_edit(text: &str, KeyEdit { path, value }: &KeyEdit) -> Edited {
    let steps: Vec<Step> = steps_of(path).collect();
    match value {
        Some(value) => with_value(text, path, &steps, value),
        None => without_key(text, path, &steps),
    }
}

fn with_value(text: &str, path: &str, steps: &[Step], value: &str) -> Edited {
    let wanted: Value = parsed(value)?;
    let text = &with_list_begun(text, steps)?;
    match find(&document(text)?, steps) {
        Some(Found::Value(span)) => Ok(replaced(text, span, value.trim())),
        Some(Found::Table(_)) if is_empty_table(&wanted) => Ok(text.clone()),
        Some(Found::Table(_)) => Err("is a table, expected a single value".into()),
        Some(Found::List) => with_value(&without_entries(text, path), path, steps, value),
        None => added(text, path, steps, wanted),
    }
}

fn parsed(value: &str) -> std::result::Result<Value, String> {
    value
        .trim()
        .parse()
        .map_err(|_| format!("{value}, expected a TOML value"))
}

fn is_empty_table(value: &Value) -> bool {
    value.as_inline_table().is_some_and(InlineTable::is_empty)
}

fn without_key(text: &str, path: &str, steps: &[Step]) -> Edited {
    match find(&document(text)?, steps) {
        None => Ok(text.to_owned()),
        Some(Found::Value(span)) if begins_line(text, &span) => {
            Ok(taken_back(text, span, told_value(path)))
        }
        Some(Found::Value(_)) => removed(text, steps),
        Some(Found::Table(index)) => Ok(commented_out(text, path, index)),
        Some(Found::List) => Ok(without_entries(text, path)),
    }
}

/// One level down in a document.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

/// `lights[0].height` is a key, an index and a key.
fn steps_of(path: &str) -> impl Iterator<Item = Step<'_>> {
    let parts = path.split(['.', '[']).filter(|part| !part.is_empty());
    parts.map(|part| {
        let index = part.strip_suffix(']').and_then(|n| n.parse().ok());
        index.map_or(Step::Key(part), Step::Index)
    })
}

/// What is at a path.
enum Found {
    /// A value, and its position in the text.
    Value(Range<usize>),
    /// A table with a header of its own, by its index in a list.
    Table(usize),
    /// Tables of one name.
    List,
}

fn find(document: &Document<&str>, steps: &[Step]) -> Option<Found> {
    let item = steps.iter().try_fold(document.as_item(), down)?;
    match (item, steps.last()) {
        (Item::Table(_), Some(Step::Index(i))) => Some(Found::Table(*i)),
        (Item::Table(_), _) => Some(Found::Table(0)),
        (Item::ArrayOfTables(_), _) => Some(Found::List),
        (item, _) => item.span().map(Found::Value),
    }
}

fn down<'d>(item: &'d Item, step: &Step) -> Option<&'d Item> {
    match step {
        Step::Key(key) => item.get(key),
        Step::Index(i) => item.get(i),
    }
}

fn document(text: &str) -> std::result::Result<Document<&str>, String> {
    Document::parse(text).map_err(|e| e.message().to_owned())
}

fn replaced(text: &str, span: Range<usize>, by: &str) -> String {
    [&text[..span.start], by, &text[span.end..]].concat()
}

/// Whether a value's key is the first on its line, so that the line can become a comment.
fn begins_line(text: &str, span: &Range<usize>) -> bool {
    let line = &text[line_start(text, span.start)..span.start];
    let key = line.trim_end().strip_suffix('=');
    key.is_some_and(|key| !key.contains(['=', '{', '[']))
}

fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |end| end + 1)
}

/// Unsets a value: its line shows the default, or else what it was.
fn taken_back(text: &str, span: Range<usize>, default: Option<&str>) -> String {
    let start = line_start(text, span.start);
    let shown = default.unwrap_or(&text[span.clone()]).replace('\n', " ");
    let key = &text[start..span.start];
    replaced(text, start..span.end, &format!("#{key}{shown}"))
}

/// The text with the lines of a list's entry commented out.
fn commented_out(text: &str, path: &str, index: usize) -> String {
    let mut lines = lines_of(text);
    let name = format!("[{}]", path.trim_end_matches(&format!("[{index}]")));
    if let Some((from, to)) = section(&lines, &name, index) {
        comment_out(&mut lines[from - 1..to]);
    }
    joined(&lines)
}

/// The text with the lines of all entries of a list commented out.
fn without_entries(text: &str, path: &str) -> String {
    let (mut lines, name) = (lines_of(text), format!("[{path}]"));
    while let Some((from, to)) = section(&lines, &name, 0) {
        comment_out(&mut lines[from - 1..to]);
    }
    joined(&lines)
}

fn comment_out(lines: &mut [String]) {
    let set = lines.iter_mut();
    set.filter(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
        .for_each(|line| line.insert(0, '#'));
}

/// The text with the list header that the template shows as a comment uncommented, if a path leads
/// into the list's first entry.
fn with_list_begun(text: &str, steps: &[Step]) -> Edited {
    let Some(index) = steps.iter().position(|step| *step == Step::Index(0)) else {
        return Ok(text.to_owned());
    };
    if find(&document(text)?, &steps[..index]).is_some() {
        return Ok(text.to_owned());
    }
    let header = format!("[[{}]]", table_of(&steps[..index]));
    let mut lines = lines_of(text);
    let shown = lines
        .iter_mut()
        .find(|line| line[..] == *format!("#{header}"));
    if let Some(line) = shown {
        *line = header;
    }
    Ok(joined(&lines))
}

fn table_of(steps: &[Step]) -> String {
    let keys = steps.iter().filter_map(|step| match step {
        Step::Key(key) => Some(*key),
        Step::Index(_) => None,
    });
    keys.collect::<Vec<_>>().join(".")
}

/// Adds a missing key.
fn added(text: &str, path: &str, steps: &[Step], value: Value) -> Edited {
    let mut lines = lines_of(text);
    if let Some(at) = default_line(&lines, path) {
        let key = path.rsplit_once('.').map_or(path, |(_, key)| key);
        lines[at] = format!("{key} = {value}");
        return Ok(joined(&lines));
    }
    let mut document = mutable(text)?;
    insert(document.as_item_mut(), steps, value)?;
    Ok(document.to_string())
}

fn removed(text: &str, steps: &[Step]) -> Edited {
    let mut document = mutable(text)?;
    let (last, outer) = steps.split_last().ok_or("no key")?;
    let outer = outer.iter().try_fold(document.as_item_mut(), down_mut);
    match (outer, last) {
        (Some(item), Step::Key(key)) => _ = item.as_table_like_mut().and_then(|t| t.remove(key)),
        (Some(item), Step::Index(i)) => _ = item.as_array_mut().map(|list| list.remove(*i)),
        (None, _) => (),
    }
    Ok(document.to_string())
}

fn mutable(text: &str) -> std::result::Result<DocumentMut, String> {
    document(text).map(Document::into_mut)
}

fn down_mut<'d>(item: &'d mut Item, step: &Step) -> Option<&'d mut Item> {
    match step {
        Step::Key(key) => item.get_mut(key),
        Step::Index(i) => item.get_mut(i),
    }
}

/// Sets the value at a path, and creates the tables on the way.
fn insert(item: &mut Item, steps: &[Step], value: Value) -> std::result::Result<(), String> {
    match steps {
        [] => *item = Item::Value(value),
        [Step::Key(key)] => insert_key(item, key, value)?,
        [Step::Key(key), rest @ ..] => insert(entry(item, key, rest)?, rest, value)?,
        [Step::Index(i)] if is_empty_table(&value) => grow(item, *i)?,
        [Step::Index(i), rest @ ..] => {
            grow(item, *i)?;
            insert(item.get_mut(i).ok_or("no such entry")?, rest, value)?;
        }
    }
    Ok(())
}

fn insert_key(item: &mut Item, key: &str, value: Value) -> std::result::Result<(), String> {
    let table = item
        .as_table_like_mut()
        .ok_or("leads through a value that is not a table")?;
    table.insert(key, Item::Value(value));
    if let Some(inline) = item.as_inline_table_mut() {
        inline.fmt();
    }
    Ok(())
}

/// What is below a key, created if missing.
fn entry<'i>(
    item: &'i mut Item,
    key: &str,
    rest: &[Step],
) -> std::result::Result<&'i mut Item, &'static str> {
    let table = item
        .as_table_like_mut()
        .ok_or("leads through a value that is not a table")?;
    if !table.contains_key(key) {
        table.insert(key, empty_for(rest));
    }
    table.get_mut(key).ok_or("no such key")
}

/// The initial value of a key before anything below it exists.
fn empty_for(rest: &[Step]) -> Item {
    match rest {
        [Step::Index(_), ..] => Item::ArrayOfTables(ArrayOfTables::new()),
        _ => {
            let mut table = Table::new();
            table.set_implicit(rest.len() > 1);
            Item::Table(table)
        }
    }
}

/// Makes room for an entry at the end of a list.
fn grow(item: &mut Item, index: usize) -> std::result::Result<(), String> {
    match item {
        Item::ArrayOfTables(list) if list.len() == index => list.push(Table::new()),
        Item::Value(Value::Array(list)) if list.len() == index => list.push(InlineTable::new()),
        item if item.get(index).is_some() => (),
        _ => return Err("no such entry in the list".into()),
    }
    Ok(())
}

fn lines_of(text: &str) -> Vec<String> {
    text.lines().map(str::to_owned).collect()
}

fn joined(lines: &[String]) -> String {
    lines.join("\n") + "\n"
}

/// The key that a line sets.
fn key_of(line: &str) -> Option<&str> {
    let (key, _) = line.split_once('=')?;
    Some(key.trim()).filter(|key| !key.is_empty() && !key.starts_with('#'))
}

/// The line of a template that shows a key's default: `#scale = [0.9, 1.1]`.
fn default_line(lines: &[String], path: &str) -> Option<usize> {
    let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
    let (from, to) = match table.strip_suffix(']').and_then(|t| t.rsplit_once('[')) {
        Some((list, index)) => section(lines, &format!("[{list}]"), index.parse().ok()?)?,
        None => section(lines, table, 0)?,
    };
    let shows = |line: &String| line.strip_prefix('#').and_then(key_of) == Some(key);
    Some(from + lines[from..to].iter().position(shows)?)
}

/// The range of lines of a table below its header, of the `index`-th if several have the name; for
/// the document's own keys, the lines before the first header.
fn section(lines: &[String], table: &str, index: usize) -> Option<(usize, usize)> {
    let from = match table {
        "" => 0,
        _ => 1 + nth_header(lines, table, index)?,
    };
    let length = lines[from..].iter().position(|line| is_header(line));
    Some((from, length.map_or(lines.len(), |length| from + length)))
}

fn nth_header(lines: &[String], table: &str, index: usize) -> Option<usize> {
    let lines = lines.iter().enumerate();
    let mut headers = lines.filter(|(_, line)| header_of(line) == Some(table));
    headers.nth(index).map(|(at, _)| at)
}

/// Whether a line begins a table, be it commented out in the template.
fn is_header(line: &str) -> bool {
    header_of(line.strip_prefix('#').unwrap_or(line)).is_some()
}

/// The table whose header a line is; a list's entry keeps its second bracket.
fn header_of(line: &str) -> Option<&str> {
    let (table, rest) = line.trim().strip_prefix('[')?.rsplit_once(']')?;
    let rest = rest.trim_start();
    (rest.is_empty() || rest.starts_with('#')).then_some(table.trim())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::DatasetConfig;

    fn edited(text: &str, edits: &[(&str, &str)]) -> String {
        let edits: Vec<KeyEdit> = edits
            .iter()
            .map(|(path, value)| KeyEdit::set(*path, *value))
            .collect();
        with_edits(text, &edits).unwrap()
    }

    fn reset(path: &str) -> KeyEdit {
        KeyEdit {
            path: path.into(),
            value: None,
        }
    }

    #[test]
    fn comments_stay_where_they_are() {
        let text = "# mine\nassets = 'a' # here\n\n[scene] # drawn\n# many\nobjects = 3 # by hand\nstart.x = 0\n";
        let edits = [
            ("scene.objects", "[4, 5]"),
            ("scene.start.x", "[0, 1]"),
            ("scene.scale", "2"),
            ("scene.finish.camera_noise.shot", "0.1"),
            ("backgrounds", "\"b\""),
        ];
        let expected = "# mine\nassets = 'a' # here\nbackgrounds = \"b\"\n\n[scene] # drawn\n# many\n\
            objects = [4, 5] # by hand\nstart.x = [0, 1]\nscale = 2\n\n[scene.finish.camera_noise]\nshot = 0.1\n";
        assert_eq!(edited(text, &edits), expected);
    }

    #[test]
    fn a_key_takes_the_place_of_its_default_in_the_template_and_gives_it_back() {
        let edits = [
            ("scene.start.spread", "[0.5, 0.75]"),
            ("scene.objects", "{ values = [3, 4], weights = [1, 2] }"),
            ("scene.finish.camera_noise.read", "0.01"),
            ("scene.lights[0].height", "[1, 2]"),
        ];
        let text = edited(DatasetConfig::template(), &edits);
        let lines = |text: &str| text.lines().count();
        assert_eq!(lines(&text), lines(DatasetConfig::template()));
        let config: DatasetConfig = toml::from_str(&text).unwrap();
        assert_eq!(config.scene.finish.camera_noise.read.min, 0.01);
        assert_eq!(config.scene.start.spread.unwrap().max, 0.75);
        assert_eq!(config.scene.lights[0].height.max, 2.0);
        let back = edits.map(|(path, _)| reset(path));
        let back = [&back[..], &[reset("scene.lights[0]")]].concat();
        let again = with_edits(&text, &back).unwrap();
        assert_eq!(again, DatasetConfig::template());
    }

    #[test]
    fn a_value_in_a_table_within_a_line_changes_alone() {
        let text =
            "# kept\n[scene] # too\nfinish = { sharpening = 1, white_k = 5000 } # and this\n";
        let text = edited(
            text,
            &[
                ("scene.finish.exposure_ev", "0.5"),
                ("scene.finish.sharpening", "2"),
            ],
        );
        let expected = "# kept\n[scene] # too\nfinish = { sharpening = 2, white_k = 5000, exposure_ev = 0.5 } # and this\n";
        assert_eq!(text, expected);
        let text = with_edits(&text, &[reset("scene.finish.white_k")]).unwrap();
        assert_eq!(
            text,
            "# kept\n[scene] # too\nfinish = { sharpening = 2, exposure_ev = 0.5 } # and this\n"
        );
    }

    #[test]
    fn lights_are_added_and_taken_away() {
        let template = DatasetConfig::template();
        let two = edited(
            template,
            &[("scene.lights[0]", "{}"), ("scene.lights[1].power", "3")],
        );
        let config: DatasetConfig = toml::from_str(&two).unwrap();
        assert_eq!(config.scene.lights.len(), 2);
        assert_eq!(config.scene.lights[1].power.min, 3.0);
        let one = with_edits(&two, &[reset("scene.lights[1]")]).unwrap();
        let config: DatasetConfig = toml::from_str(&one).unwrap();
        assert_eq!(config.scene.lights.len(), 1);
        let dark = edited(&one, &[("scene.lights", "[]")]);
        let config: DatasetConfig = toml::from_str(&dark).unwrap();
        assert!(config.scene.lights.is_empty());
        let again = edited(&dark, &[("scene.lights[0].power", "4")]);
        let config: DatasetConfig = toml::from_str(&again).unwrap();
        assert_eq!(config.scene.lights[0].power.min, 4.0);
    }

    #[test]
    fn what_is_no_recipe_is_refused() {
        let error = |text: &str, path: &str, value: &str| {
            let edit = KeyEdit::set(path, value);
            with_edits(text, &[edit]).unwrap_err().to_string()
        };
        assert!(error("scene = 3\n", "scene.scale", "1").contains("scene.scale: "));
        assert!(error("[scene\n", "scene.scale", "1").contains("line 1"));
        assert!(error("", "scene.scale", "[1,").contains("expected a TOML value"));
    }
}
