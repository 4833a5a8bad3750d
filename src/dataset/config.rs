//! The file that a dataset is made from.

use crate::dataset::mot::no_sequence;
use crate::dataset::paths::{folder_of, seen_from};
use crate::dataset::yolo::MIN_SIDE_PX;
use crate::dataset::{Format, LabelConfig, Pictures, Preset, Split};
use crate::error::{Error, Result};
use crate::io;
use crate::render::RenderOptions;
use crate::scene::{Ablation, Recipe};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a dataset is made from and how: the recipe file. It holds only the values that differ from
/// the defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DatasetConfig {
    /// Folder of the recipe, which file names in it are relative to; not written to files. Default:
    /// the working folder.
    #[serde(skip)]
    pub folder: PathBuf,
    /// The preset that the recipe is based on; the other fields include its values. Default:
    /// `paper`.
    #[serde(skip_serializing)]
    pub preset: Preset,
    /// Folder of assets, relative to the file. Default: `assets`.
    pub assets: PathBuf,
    /// Folder of photos of the place with their labels (`NAME.label.json`), relative to the file.
    /// Default: `backgrounds`.
    pub backgrounds: PathBuf,
    /// Width and height of the labelled rectangle, metres, for labels that do not state them: those
    /// of other programs. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface_size: Option<[f64; 2]>,
    /// Use photos of the place whose cameras do not fit their labels. Default: false, an error.
    pub force_cameras: bool,
    /// What scenes are drawn from.
    pub scene: Recipe,
    /// How finely pictures are sampled.
    pub render: RenderOptions,
    /// How labels are made and written.
    pub labels: LabelConfig,
    /// Which pictures are for validation.
    pub split: Split,
    /// Format of the pictures.
    pub pictures: Pictures,
}

impl Default for DatasetConfig {
    fn default() -> Self {
        Self {
            folder: PathBuf::new(),
            preset: Preset::default(),
            assets: "assets".into(),
            backgrounds: "backgrounds".into(),
            surface_size: None,
            force_cameras: false,
            scene: Recipe::default(),
            render: RenderOptions::default(),
            labels: LabelConfig::default(),
            split: Split::default(),
            pictures: Pictures::default(),
        }
    }
}

impl DatasetConfig {
    /// Reads a recipe file, replaces some of its values, and checks it; its folders become relative
    /// to the working folder.
    ///
    /// A recipe is trusted: the folders and environment maps that it names may be anywhere.
    ///
    /// # Errors
    /// A file that cannot be read; an unknown key; an invalid range.
    pub fn read(path: impl AsRef<Path>, overrides: &[io::Override]) -> Result<Self> {
        let path = path.as_ref();
        Self::parse(&io::read_text(path)?, path, overrides)
    }

    /// Parses the text of a recipe as if it were the file at `path`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    #[doc(hidden)]
    pub fn parse(text: &str, path: &Path, overrides: &[io::Override]) -> Result<Self> {
        let read = io::parse_toml_with(text, overrides, Preset::lay_under);
        let mut config: Self = read.map_err(|e| e.in_file(path))?;
        config.check().map_err(|e| e.in_file(path))?;
        let folder = folder_of(path);
        config.assets = folder.join(&config.assets);
        config.backgrounds = folder.join(&config.backgrounds);
        config.folder = folder.into();
        Ok(config)
    }

    /// Parses a recipe, some of its values replaced, on top of the preset that it names; its
    /// folders are relative to the working folder.
    ///
    /// # Errors
    /// An unknown key; an invalid range; an override whose key does not exist.
    #[doc(hidden)]
    pub fn from_table(recipe: toml::Table, overrides: &[io::Override]) -> Result<Self> {
        let mut recipe: toml::Table = io::from_table_with(recipe, overrides)?;
        Preset::lay_under(&mut recipe);
        let config: Self = io::from_table(recipe)?;
        config.check()?;
        Ok(config)
    }

    /// The same config with absolute paths: files are read late, whatever the working folder is
    /// then.
    ///
    /// # Errors
    /// Without a working folder.
    pub(super) fn with_absolute_paths(mut self) -> Result<Self> {
        for path in [&mut self.folder, &mut self.assets, &mut self.backgrounds] {
            *path = io::absolute_folder(path)?;
        }
        Ok(self)
    }

    /// Fails on the first invalid value, by its path: `render.subsamples`.
    ///
    /// # Errors
    /// [`Error::Value`](crate::error::Error::Value) with the value and what was expected.
    pub fn check(&self) -> Result<()> {
        self.scene.check().map_err(|e| e.within("scene"))?;
        self.render.check().map_err(|e| e.within("render"))?;
        self.labels.check().map_err(|e| e.within("labels"))?;
        self.split.check().map_err(|e| e.within("split"))?;
        self.check_sequences()?;
        self.pictures.check().map_err(|e| e.within("pictures"))
    }

    /// Fails if tracks are requested and nothing moves.
    fn check_sequences(&self) -> Result<()> {
        match self.scene.belt {
            None if self.labels.formats.contains(&Format::Mot) => Err(no_sequence()),
            _ => Ok(()),
        }
    }

    /// A recipe file that lists every default with its unit, to be edited by hand.
    pub fn template() -> &'static str {
        include_str!("template.toml")
    }

    /// Writes a recipe file that gives this config when read.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        io::write_text(path, &self.text(path)?)
    }

    /// Whether a file is what [`write`](Self::write) would write there.
    ///
    /// # Errors
    /// If it cannot be read.
    #[doc(hidden)]
    pub fn is_written(&self, path: impl AsRef<Path>) -> Result<bool> {
        let path = path.as_ref();
        Ok(io::read_text(path)? == self.text(path)?)
    }

    /// The recipe as written in a file at this place.
    fn text(&self, path: &Path) -> Result<String> {
        let place = io::absolute(path)?;
        let folder = folder_of(&place);
        let mut config = self.clone();
        config.assets = io::relative_on_disk(&config.assets, folder)?;
        config.backgrounds = io::relative_on_disk(&config.backgrounds, folder)?;
        for file in &mut config.scene.environment.files {
            *file = seen_from(folder, &self.folder.join(&*file))?;
        }
        toml::to_string_pretty(&config).map_err(|e| Error::file(path, e))
    }

    /// The same config for pictures of another size: its values in pixels scale with the longer
    /// side.
    #[doc(hidden)]
    pub fn with_image(mut self, image: [u32; 2]) -> Self {
        let longer = |[w, h]: [u32; 2]| f64::from(w.max(h));
        let factor = longer(image) / longer(self.scene.image);
        self.scene.image = image;
        self.scene.finish = self.scene.finish.scaled(factor);
        self.labels.simplify *= factor;
        self
    }

    /// The same config with pictures of half the width and height, for a first look: the same
    /// scenes.
    pub fn preview(mut self) -> Self {
        let halved = self.scene.image.map(|side| (side / 2).max(MIN_SIDE_PX));
        self = self.with_image(halved);
        if self.labels.archives().is_some() {
            self.labels.formats.clear();
        }
        self
    }

    /// The setups of the paper's ablations: this one with each source of variation switched off in
    /// turn, the scenes in pairs.
    pub fn ablations(&self) -> impl Iterator<Item = (Ablation, Self)> {
        let ablations = Ablation::PAPER.into_iter();
        ablations.map(|ablation| (ablation, self.without(&ablation)))
    }

    /// The recipe without what an ablation switches off.
    fn without(&self, ablation: &Ablation) -> Self {
        let mut config = self.clone();
        config.scene.off.extend(ablation.off);
        config.scene.off.sort();
        config.scene.off.dedup();
        config
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::folder::field_path;
    use crate::dataset::settings::told_keys;
    use crate::scene::{Blur, Range};
    use toml::{Table, Value};

    fn parsed(text: &str, overrides: &[io::Override]) -> Result<DatasetConfig> {
        DatasetConfig::parse(text, "recipe.toml".as_ref(), overrides)
    }

    /// Whole and fractional numbers that are equal are the same.
    fn same(a: &Value, b: &Value) -> bool {
        match (a, b) {
            (Value::Integer(a), Value::Float(b)) | (Value::Float(b), Value::Integer(a)) => {
                *a as f64 == *b
            }
            // Single precision prints with digits that nobody writes.
            (Value::Float(a), Value::Float(b)) => *a as f32 == *b as f32,
            (Value::Array(a), Value::Array(b)) => {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
            }
            _ => a == b,
        }
    }

    /// What one table has and the other does not, or has with another value.
    fn missing(from: &Table, all: &Table, at: &str) -> Vec<String> {
        let key = |key: &String| field_path(at, key);
        let of = |(name, value): (&String, &Value)| match (value, from.get(name)) {
            (Value::Table(all), Some(Value::Table(from))) => missing(from, all, &key(name)),
            (Value::Array(all), Some(Value::Array(from)))
                if all.first().is_some_and(Value::is_table) =>
            {
                let pairs = from
                    .iter()
                    .zip(all)
                    .filter_map(|(from, all)| Some((from.as_table()?, all.as_table()?)));
                pairs
                    .flat_map(|(from, all)| missing(from, all, &key(name)))
                    .collect()
            }
            (all, Some(from)) if same(all, from) => vec![],
            (all, _) => vec![format!("{} = {all}", key(name))],
        };
        all.iter().flat_map(of).collect()
    }

    /// A new key in a recipe needs a line in src/dataset/template.toml.
    #[test]
    fn the_template_tells_every_default() {
        let bare = |line: &str| {
            let key = line
                .strip_prefix('#')
                .filter(|rest| rest.starts_with(|c: char| c.is_ascii_lowercase() || c == '['));
            key.unwrap_or(line).to_owned()
        };
        let template: Vec<String> = DatasetConfig::template().lines().map(bare).collect();
        let mut told: Table = template.join("\n").parse().unwrap();
        assert_eq!(told.remove("preset"), Some("real".into()));
        let all = Table::try_from(DatasetConfig::default()).unwrap();
        assert_eq!(
            missing(&told, &all, ""),
            [""; 0],
            "not in template.toml, or otherwise"
        );
        let mut only_told = missing(&all, &told, "");
        // A key that files may omit is present by its default.
        only_told.retain(|line| {
            toml::from_str::<DatasetConfig>(line).ok() != Some(DatasetConfig::default())
        });
        let examples = examples().into_iter();
        let examples: Vec<_> = examples.map(|line| line.replace("[0]", "")).collect();
        assert_eq!(only_told, examples, "only in template.toml");
        let proposed = DatasetConfig {
            preset: Preset::Real,
            ..DatasetConfig::default()
        };
        assert_eq!(toml::from_str(DatasetConfig::template()), Ok(proposed));
    }

    #[test]
    fn the_template_tells_every_value_of_the_preset() {
        let told: Vec<_> = told_keys().collect();
        let told_value = |path: &str| {
            let key = told.iter().find(|told| told.path == path);
            let comment = key.map_or("", |key| &key.docs);
            let value = comment
                .split_once("Preset \"real\": ")
                .unwrap_or_default()
                .1;
            format!("value = {}", value.trim_end_matches('.'))
        };
        let preset = Preset::Real.table();
        for (path, value) in leaves(&preset, "") {
            if path != "scene.lights" {
                let told: Table = told_value(&path).parse().unwrap_or_default();
                assert_eq!(told.get("value"), Some(value), "{path}");
            }
        }
    }

    /// The values of a document, by their paths.
    fn leaves<'t>(table: &'t Table, at: &str) -> Vec<(String, &'t Value)> {
        let of = |(key, value): (&'t String, &'t Value)| match value {
            Value::Table(inner) => leaves(inner, &format!("{at}{key}.")),
            value => vec![(format!("{at}{key}"), value)],
        };
        table.iter().flat_map(of).collect()
    }

    /// Keys without a default that the template shows by an example: `path = value`.
    fn examples() -> Vec<String> {
        let mut examples: Vec<_> = told_keys()
            .filter(|told| told.is_example)
            .map(|told| format!("{} = {}", told.path, told.value))
            .collect();
        examples.sort();
        examples
    }

    #[test]
    fn an_example_in_the_template_is_taken_as_it_stands() {
        assert_eq!(examples().len(), 11);
        for example in examples() {
            // A key of a table that may be repeated.
            let example = example.replace("scene.lights[0].", "[[scene.lights]]\n");
            let config = parsed(&example, &[]).unwrap();
            let (taken, told) = (Table::try_from(config).unwrap(), example.parse().unwrap());
            assert_eq!(missing(&taken, &told, ""), [""; 0]);
        }
    }

    /// What the template says about a key's values: its path, and the ends of "A to B" in its
    /// comment.
    fn told_bounds() -> Vec<(String, [f64; 2])> {
        told_keys()
            .filter_map(|told| Some((told.path, told.ends?)))
            .collect()
    }

    #[test]
    fn the_template_tells_the_bounds_that_are_checked() {
        let template = DatasetConfig::template().replace("#[[scene.lights]]", "[[scene.lights]]");
        let with =
            |key: &str, value: f64| parsed(&template, &[format!("{key}={value}").parse().unwrap()]);
        let told = told_bounds();
        assert!(told.len() > 35, "{told:?}");
        for (key, [low, high]) in told {
            for end in [low, high] {
                let taken = with(&key, end);
                assert!(taken.is_ok(), "{key} = {end}: {taken:?}");
            }
            let beyond = [
                low - low.abs().clamp(1e-9, 1.0),
                high + (0.01 * high).max(1.0),
            ];
            for value in beyond.map(|v| if low.fract() == 0.0 { v.floor() } else { v }) {
                let e = with(&key, value).map(|_| ()).unwrap_err().to_string();
                assert!(e.contains(&format!("{key}: ")), "{key} = {value}: {e}");
            }
        }
    }

    #[test]
    fn a_written_recipe_gives_the_same_setup_from_another_folder() {
        let dir = tempfile::tempdir().unwrap();
        let recipe = "assets = 'a/b'\n[scene]\nobjects = 3\noff = ['light']\nenvironment = { files = ['sky.hdr'] }\n";
        io::write_text(dir.path().join("recipe.toml"), recipe).unwrap();
        let config = DatasetConfig::read(dir.path().join("recipe.toml"), &[]).unwrap();
        io::create_folder(dir.path().join("x/y")).unwrap();
        config.write(dir.path().join("x/y/recipe.toml")).unwrap();
        let text = io::read_text(dir.path().join("x/y/recipe.toml")).unwrap();
        assert!(text.contains("assets = \"../../a/b\""), "{text}");
        let again = DatasetConfig::read(dir.path().join("x/y/recipe.toml"), &[]).unwrap();
        assert_eq!(
            (&again.scene.objects, &again.labels),
            (&config.scene.objects, &config.labels)
        );
        assert_eq!(again.scene.environment.files, ["../../sky.hdr"]);
        let same = |config: &DatasetConfig| {
            config
                .folder
                .join(&config.scene.environment.files[0])
                .to_string_lossy()
                .into_owned()
        };
        assert_eq!(
            same(&again).replace("x/y/../../", ""),
            format!("{}/sky.hdr", dir.path().display())
        );
    }

    #[test]
    fn a_preview_halves_what_is_said_in_pixels() {
        let recipe = "[scene]\nimage = [640, 480]\n[scene.finish]\nblur_px = [0, 0.5]\n\
                      chromatic_px = -3\ncamera_blur_px = 2\n[labels]\nsimplify = 1\n";
        let config: DatasetConfig = toml::from_str(recipe).unwrap();
        let preview = config.preview();
        let finish = preview.scene.finish;
        assert_eq!(preview.scene.image, [320, 240]);
        assert_eq!(finish.camera_blur_px, Range::fixed(1.0));
        assert_eq!(finish.blur_px, Blur::Known(Range::new(0.0, 0.25)));
        assert_eq!(finish.chromatic_px, Range::fixed(-1.5));
        assert_eq!(preview.labels.simplify, 0.5);
        let smallest = DatasetConfig::default().with_image([10, 10]).preview();
        assert_eq!(smallest, DatasetConfig::default().with_image([10, 10]));
    }

    #[test]
    fn the_ablations_are_the_paper_s() {
        let base = DatasetConfig::default();
        let names: Vec<_> = base
            .ablations()
            .map(|(ablation, config)| (ablation.name, config.scene.off.len()))
            .collect();
        assert_eq!(names.len(), 7);
        assert_eq!((names[0], names[6]), (("all", 0), ("all_off", 5)));
    }

    #[test]
    fn a_wrong_key_is_answered_with_the_right_one() {
        let told = parsed("[scene]\nobject = 3\n", &[])
            .unwrap_err()
            .to_string();
        let expected = "scene: unknown key \"object\", did you mean \"objects\"? (line 2)";
        assert!(told.ends_with(expected), "{told}");
    }
}
