//! Presets: recipes that others are based on.

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// The values that a recipe uses for keys it does not set itself: those of a built-in recipe, and
/// the defaults for the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// The defaults, which are those of the paper.
    #[default]
    Paper,
    /// The values of the best detectors among those compared (`experiments/` in the repository).
    Real,
}

impl Preset {
    fn named(name: &str) -> Option<Self> {
        Self::deserialize(Value::from(name)).ok()
    }

    fn text(self) -> &'static str {
        match self {
            Self::Paper => "",
            Self::Real => include_str!("preset_real.toml"),
        }
    }

    pub(super) fn table(self) -> Table {
        self.text().parse().expect("a document of ours")
    }

    /// Completes a recipe with the preset that it names, if it names an existing one.
    pub(super) fn lay_under(recipe: &mut Table) {
        let name = recipe.get("preset").and_then(Value::as_str);
        if let Some(preset) = name.and_then(Self::named) {
            fill_in(recipe, preset.table());
        }
    }
}

/// Pairs of keys in one table that exclude each other: a recipe with one of them does not get the
/// other from the preset.
const ALTERNATIVES: [[&str; 2]; 2] = [["min_visible", "overlap_iou"], ["spread", "positions"]];

fn has_alternative(table: &Table, key: &str) -> bool {
    let mut pairs = ALTERNATIVES.into_iter().filter(|pair| pair.contains(&key));
    pairs.any(|pair| pair.into_iter().any(|other| table.contains_key(other)))
}

/// Adds the keys that a table lacks, in inner tables too.
fn fill_in(table: &mut Table, below: Table) {
    let given = table.clone();
    for (key, value) in below {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(below)) => fill_in(inner, below),
            (None, value) if !has_alternative(&given, &key) => _ = table.insert(key, value),
            _ => (),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::DatasetConfig;
    use crate::scene::Range;

    fn read(text: &str, overrides: &[&str]) -> crate::Result<DatasetConfig> {
        let overrides: Vec<_> = overrides.iter().map(|o| o.parse().unwrap()).collect();
        DatasetConfig::parse(text, "recipe.toml".as_ref(), &overrides)
    }

    #[test]
    fn a_recipe_goes_before_its_preset_and_the_preset_before_the_defaults() {
        let recipe = "preset = 'real'\n[scene]\nfriction = 0.3\n[scene.grade]\nsaturation = 1\n";
        let config = read(recipe, &[]).unwrap();
        let preset = read("preset = 'real'", &[]).unwrap();
        assert_eq!(config.scene.friction, Range::fixed(0.3));
        assert_eq!(config.scene.grade.saturation, Range::fixed(1.0));
        assert_eq!(config.scene.grade.hue_deg, preset.scene.grade.hue_deg);
        assert_eq!(config.labels, preset.labels);
        assert_ne!(preset.scene, DatasetConfig::default().scene);
    }

    #[test]
    fn a_key_goes_before_the_other_one_that_the_preset_has_in_its_place() {
        for labels in ["overlap_iou = 0.1", "min_visible = 0.5"] {
            let alone = read(&format!("[labels]\n{labels}"), &[]).unwrap();
            let over = read(&format!("preset = 'real'\n[labels]\n{labels}"), &[]).unwrap();
            assert_eq!(over.labels, alone.labels);
        }
    }

    #[test]
    fn a_preset_is_the_recipe_that_it_stands_for() {
        let named = read("preset = 'real'", &[]).unwrap();
        let written = read(Preset::Real.text(), &[]).unwrap();
        assert_eq!(written.scene, named.scene);
        assert_eq!(written.labels, named.labels);
        assert_eq!(read("", &["preset=real"]).unwrap(), named);
        let paper = read("preset = 'paper'", &[]).unwrap();
        assert_eq!(paper, read("", &[]).unwrap());
    }

    #[test]
    fn an_unknown_preset_and_a_mistake_over_a_preset_are_told_with_their_line() {
        let told = |text| read(text, &[]).unwrap_err().to_string();
        let unknown = told("\npreset = 'reel'");
        assert!(unknown.contains("preset: unknown"), "{unknown}");
        assert!(unknown.ends_with("(line 2)"), "{unknown}");
        let mistake = told("preset = 'real'\n[scene]\nobject = 3");
        assert!(mistake.contains("did you mean \"objects\""), "{mistake}");
        assert!(mistake.ends_with("(line 3)"), "{mistake}");
    }
}
