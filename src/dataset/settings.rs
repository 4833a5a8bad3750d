//! The settings of a recipe, read from the template so that nothing is documented twice.

use crate::dataset::folder::field_path;
use crate::dataset::{DatasetConfig, Preset};
use crate::io::Override;
use serde::Serialize;
use toml::{Table, Value};

/// A table of the template.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SettingGroup {
    /// Its path: `scene.start`; empty for the file's own keys.
    pub table: String,
    /// What it is for.
    pub docs: String,
    /// Its keys, in order.
    pub settings: Vec<Setting>,
}

/// A key of the template.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Its path: `scene.start.x`; for the entries of a list, that of the first.
    pub path: String,
    /// What it does, with its unit.
    pub docs: String,
    /// The default; an example if there is none.
    pub value: Value,
    /// Whether it has no default, and `value` is an example.
    pub is_example: bool,
    /// Limits of the accepted values.
    pub ends: Option<[f64; 2]>,
    /// The kinds of values it accepts.
    pub takes: Kinds,
}

/// The kinds of values that a setting accepts, found by reading recipes with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Kinds {
    /// True and false.
    pub switch: bool,
    /// One number.
    pub number: bool,
    /// Two numbers, every value between them equally likely.
    pub range: bool,
    /// Numbers must be whole.
    pub whole: bool,
    /// One of these words.
    pub words: Vec<String>,
    /// Some of these words, as a list.
    pub lists: Vec<String>,
}

/// The groups of the template, in order.
pub fn settings() -> Vec<SettingGroup> {
    let mut groups = told_groups();
    let settings = groups.iter_mut().flat_map(|group| &mut group.settings);
    for setting in settings {
        setting.takes = Kinds::of(setting);
    }
    groups
}

/// The values of a preset, by their paths.
pub fn preset_values(preset: Preset) -> Vec<(String, Value)> {
    values_by_path(&preset.table(), "")
}

/// The values of a document by their paths; lists of tables entry by entry.
pub fn values_by_path(table: &Table, at: &str) -> Vec<(String, Value)> {
    let of = |(key, value): (&String, &Value)| values_at(value, &format!("{at}{key}"));
    table.iter().flat_map(of).collect()
}

fn values_at(value: &Value, at: &str) -> Vec<(String, Value)> {
    let own = || std::iter::once((at.to_owned(), value.clone()));
    match value {
        Value::Table(inner) => own()
            .chain(values_by_path(inner, &format!("{at}.")))
            .collect(),
        Value::Array(list) => {
            let entries = list
                .iter()
                .enumerate()
                .filter(|(_, entry)| entry.is_table());
            let entries = entries.flat_map(|(i, entry)| values_at(entry, &format!("{at}[{i}]")));
            own().chain(entries).collect()
        }
        _ => own().collect(),
    }
}

/// What the template shows for a path.
pub(crate) fn told_value(path: &str) -> Option<&'static str> {
    let generic = of_first_entry(path);
    let mut table = String::new();
    DatasetConfig::template().lines().find_map(|line| {
        if let Some(next) = table_of(line) {
            table = next;
        }
        let (key, value) = key_and_value(line)?;
        (field_path(&table, key) == generic).then_some(value)
    })
}

/// The path with every index 0, as in the template.
fn of_first_entry(path: &str) -> String {
    let is_digit = |c: char| c.is_ascii_digit();
    let mut parts = path.split('[');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |path, part| {
        path + "[0" + part.trim_start_matches(is_digit)
    })
}

/// Every key of the template, without the kinds of values that it accepts.
#[cfg(test)]
pub(super) fn told_keys() -> impl Iterator<Item = Setting> {
    let groups = told_groups().into_iter();
    groups.flat_map(|group| group.settings)
}

/// The groups of the template, line by line.
fn told_groups() -> Vec<SettingGroup> {
    let (mut groups, mut comment) = (vec![SettingGroup::default()], String::new());
    for line in DatasetConfig::template().lines() {
        let here = groups.last_mut().expect("begins with one");
        if let Some(table) = table_of(line) {
            groups.push(SettingGroup {
                table,
                docs: std::mem::take(&mut comment),
                settings: Vec::new(),
            });
        } else if let Some((key, value)) = key_and_value(line) {
            let path = field_path(&here.table, key);
            let docs = std::mem::take(&mut comment);
            here.settings.push(Setting::told(path, value, docs));
        } else {
            comment = continued(&comment, line);
        }
    }
    groups
}

/// A comment joined with its next line; an empty line ends it.
fn continued(comment: &str, line: &str) -> String {
    let line = line.trim_start_matches(['#', ' ']);
    match (comment, line) {
        (_, "") => String::new(),
        ("", line) => line.to_owned(),
        (comment, line) => format!("{comment} {line}"),
    }
}

/// The table whose header a line is, be it commented out; for a list its first entry.
fn table_of(line: &str) -> Option<String> {
    let header = line.trim_start_matches('#').strip_prefix('[')?;
    let table = header.trim_matches(['[', ']']);
    let index = if header.starts_with('[') { "[0]" } else { "" };
    Some(format!("{table}{index}"))
}

/// The key that a line sets, be it commented out.
fn key_and_value(line: &'static str) -> Option<(&'static str, &'static str)> {
    let (key, value) = line.strip_prefix('#').unwrap_or(line).split_once(" = ")?;
    let is_key = key
        .chars()
        .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    is_key.then_some((key, value))
}

fn value_of(text: &str) -> Value {
    let table = format!("value = {text}").parse::<Table>();
    let value = table.ok().and_then(|mut table| table.remove("value"));
    value.expect("the template is TOML")
}

/// The limits in the last "A to B" of a comment.
fn ends(comment: &str) -> Option<[f64; 2]> {
    let words: Vec<&str> = comment
        .split_whitespace()
        .map(|word| word.trim_end_matches([',', '.', ';', ':']))
        .collect();
    words.windows(3).rev().find_map(|w| {
        let low = w[0].parse().ok().filter(|_| w[1] == "to")?;
        Some([low, w[2].parse().ok()?])
    })
}

/// The words in quotation marks in a comment, each once.
fn quoted_words(comment: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in comment.split('"').skip(1).step_by(2) {
        if !words.iter().any(|known| known == word) {
            words.push(word.to_owned());
        }
    }
    words
}

impl Kinds {
    /// Found by trial: a value is accepted if a recipe can be read with it.
    fn of(setting: &Setting) -> Self {
        let takes = |value: String| is_taken(&setting.path, &value);
        let [low, middle, high] = setting.some_numbers();
        let words = quoted_words(&setting.docs);
        let quoted = |word: &String| Value::from(word.as_str()).to_string();
        let number = takes(format!("{low}"));
        Self {
            switch: takes("true".into()),
            number,
            // A pair that is accepted in either order is a width and a height.
            range: takes(format!("[{low}, {high}]")) && !takes(format!("[{high}, {low}]")),
            whole: number && !takes(format!("{middle}")),
            lists: kept(&words, |word| takes(format!("[{}]", quoted(word)))),
            words: kept(&words, |word| takes(quoted(word))),
        }
    }
}

fn kept(words: &[String], is_kept: impl Fn(&String) -> bool) -> Vec<String> {
    words.iter().filter(|word| is_kept(word)).cloned().collect()
}

impl Setting {
    /// A key with its value and its comment.
    fn told(path: String, shown: &str, docs: String) -> Self {
        Self {
            is_example: docs.contains("no default"),
            ends: ends(&docs),
            path,
            docs,
            value: value_of(shown),
            takes: Kinds::default(),
        }
    }

    /// Two numbers within its limits, whole if there is room, and one between them that is not.
    fn some_numbers(&self) -> [f64; 3] {
        let [low, high] = self.ends.unwrap_or([1.0, 2.0]);
        if high - low < 2.0 {
            return [low, (low + high) / 2.0, high];
        }
        [0.0, 0.5, 1.0].map(|step| low.ceil() + step)
    }
}

/// Whether a recipe may have a value at a path.
fn is_taken(path: &str, value: &str) -> bool {
    let mut recipe = Table::new();
    if path.starts_with("scene.lights[0]") {
        recipe = "scene.lights = [{}]".parse().expect("is TOML");
    }
    let read = format!("{path}={value}").parse::<Override>();
    read.and_then(|value| DatasetConfig::from_table(recipe, &[value]))
        .is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(path: &str) -> Setting {
        let groups = settings().into_iter();
        let mut all = groups.flat_map(|group| group.settings);
        all.find(|setting| setting.path == path).unwrap()
    }

    #[test]
    fn a_setting_has_its_words_its_default_and_its_ends() {
        let scale = setting("scene.scale");
        assert_eq!(scale.value.to_string(), "[0.9, 1.1]");
        assert_eq!(scale.ends, Some([0.01, 100.0]));
        assert!(scale.docs.starts_with("Size: factor on an object's width"));
        assert!(
            setting("scene.finish.camera_noise.read")
                .docs
                .starts_with("Standard")
        );
        assert!(setting("scene.walls").is_example);
        assert_eq!(told_value("scene.lights[3].power"), Some("10"));
    }

    #[test]
    fn kinds_are_those_that_a_recipe_is_read_with() {
        let kinds = |path: &str| setting(path).takes;
        let ranges = [
            "scene.scale",
            "scene.objects",
            "scene.grade.hue_deg",
            "scene.lights[0].height",
            "scene.view.zoom",
        ];
        for path in ranges {
            assert!(kinds(path).range && kinds(path).number, "{path}");
        }
        assert!(kinds("scene.objects").whole && !kinds("scene.scale").whole);
        let pairs = ["scene.image", "surface_size"];
        for path in pairs {
            assert_eq!(kinds(path), Kinds::default(), "{path}");
        }
        let samples = kinds("render.subsamples");
        assert!(samples.number && samples.whole && !samples.range);
        assert!(kinds("scene.at_most_once").switch);
        assert_eq!(kinds("preset").words, ["real", "paper"]);
        assert_eq!(
            kinds("scene.lights[0].shape").words,
            ["ellipse", "rectangle"]
        );
        assert_eq!(kinds("scene.off").lists.len(), 5);
        assert_eq!(kinds("labels.formats").lists.len(), 5);
        let blur = kinds("scene.finish.blur_px");
        assert!(blur.range && blur.words == ["match_plate"]);
    }

    #[test]
    fn a_preset_has_values_of_its_own() {
        let friction = preset_values(Preset::Real)
            .into_iter()
            .find(|(path, _)| path == "scene.friction");
        assert_eq!(friction.unwrap().1, Value::Float(0.01));
        assert!(preset_values(Preset::Paper).is_empty());
    }

    #[test]
    fn values_have_paths_through_tables_and_lists() {
        let table = "a = 1\n[b]\nc = [1, 2]\n[[d]]\ne = 3\n".parse().unwrap();
        let paths = values_by_path(&table, "").into_iter().map(|(path, _)| path);
        let expected = ["a", "b", "b.c", "d", "d[0]", "d[0].e"];
        assert_eq!(paths.collect::<Vec<_>>(), expected);
    }
}
