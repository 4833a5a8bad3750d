//! A recipe that is being edited: its settings, and those left to the preset.

use crate::refusal::Answer;
use petcomp::dataset::DatasetConfig;
use petcomp::dataset::recipe_text::{KeyEdit, with_edits};
use petcomp::dataset::settings::{preset_values, values_by_path};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Paths of keys with their new values as TOML; null resets a key to its default.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Edits(Vec<(String, Option<String>)>);

impl Edits {
    /// The text with the edits, its comments unchanged.
    pub(super) fn apply(&self, text: &str) -> Answer<String> {
        let edits = self.0.iter().cloned();
        let edits: Vec<_> = edits.map(|(path, value)| KeyEdit { path, value }).collect();
        Ok(with_edits(text, &edits)?)
    }
}

/// The settings of a recipe.
#[derive(Debug, Serialize)]
pub(super) struct Draft {
    /// Values set by the recipe itself, by path.
    own: BTreeMap<String, Value>,
    /// Values of its preset for what it does not set.
    preset: BTreeMap<String, Value>,
    /// Number of lights.
    lights: usize,
    /// Width and height of the pictures.
    image: [u32; 2],
    text: String,
}

impl Draft {
    /// # Errors
    /// Those of `petcomp dataset generate` for the file.
    pub(super) fn of(text: &str, path: &Path) -> Answer<Self> {
        let config = DatasetConfig::parse(text, path, &[])?;
        let table: toml::Table = text.parse().unwrap_or_default();
        Ok(Self {
            own: as_json(values_by_path(&table, "")),
            preset: as_json(preset_values(config.preset)),
            lights: config.scene.lights.len(),
            image: config.scene.image,
            text: text.into(),
        })
    }
}

fn as_json(values: Vec<(String, toml::Value)>) -> BTreeMap<String, Value> {
    let json = |value| serde_json::to_value(value).unwrap_or_default();
    let values = values.into_iter();
    values.map(|(path, value)| (path, json(value))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edits(json: &str) -> Edits {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn a_draft_says_what_is_said_and_what_the_preset_says() {
        let edits = edits(r#"[["scene.scale", "[1, 2]"], ["scene.lights[0]", "{}"]]"#);
        let text = edits.apply(DatasetConfig::template()).unwrap();
        let draft = Draft::of(&text, Path::new("recipe.toml")).unwrap();
        assert_eq!(draft.own["scene.scale"], serde_json::json!([1, 2]));
        assert_eq!(draft.preset["scene.friction"], 0.01);
        assert_eq!((draft.lights, draft.image), (1, [640, 480]));
    }

    #[test]
    fn what_no_recipe_may_say_is_refused_in_the_words_of_the_command_line() {
        let edits = edits(r#"[["scene.friction", "-1"]]"#);
        let text = edits.apply(DatasetConfig::template()).unwrap();
        let refusal = Draft::of(&text, Path::new("recipe.toml")).unwrap_err();
        let expected = "recipe.toml: scene.friction: -1, expected 0 to 100";
        assert!(refusal.what.starts_with(expected), "{}", refusal.what);
    }
}
