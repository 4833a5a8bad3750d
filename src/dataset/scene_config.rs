//! The config that a scene file contains, and what is needed to include one.

use crate::dataset::DatasetConfig;
use crate::dataset::paths::folder_of;
use crate::error::{Error, Result};
use crate::io;
use crate::scene::{Scene, SceneFiles, SceneSettings, relative_to_file};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Keys of a recipe that decide how the picture and the labels of a given scene are made.
const SCENE_KEYS: [&str; 5] = [
    "render",
    "labels",
    "scene.settle",
    "surface_size",
    "force_cameras",
];

/// Values of a recipe's `scene` that have an effect on an existing scene if the recipe is given
/// with it.
const KEYS_BESIDE_A_SCENE: [&str; 2] = ["scene.settle", "scene.environment.files"];

impl DatasetConfig {
    /// Reads a recipe file, some of its values replaced, for an existing scene: its pictures have
    /// the scene's size, whatever the recipe says.
    ///
    /// # Errors
    /// As [`read`](Self::read); a replaced value that only decides how scenes are drawn.
    pub fn read_for_scene(
        recipe: impl AsRef<Path>,
        scene: &Scene,
        overrides: &[io::Override],
    ) -> Result<Self> {
        overrides.iter().try_for_each(check_override)?;
        let mut config = Self::read(recipe, overrides)?;
        config.scene.image = scene.image;
        Ok(config)
    }

    /// The config contained in a scene read from `path`, some of its values replaced: its
    /// [`files`](Scene::files) and [`settings`](Scene::settings); the rest are defaults.
    ///
    /// # Errors
    /// A scene that does not name the folders that it needs; settings that are not valid in a
    /// recipe.
    pub fn for_scene(
        scene: &Scene,
        path: impl AsRef<Path>,
        overrides: &[io::Override],
    ) -> Result<Self> {
        let path = path.as_ref();
        let mut config = Self::from_settings(&scene.settings, overrides)
            .and_then(|config| config.with_scene_folders(scene, path))
            .map_err(|e| e.in_file(path))?;
        config.scene.image = scene.image;
        Ok(config)
    }

    /// The defaults with the settings of a scene.
    ///
    /// # Errors
    /// Settings that are not valid in a recipe, or that only decide how scenes are drawn.
    pub fn from_settings(settings: &SceneSettings, overrides: &[io::Override]) -> Result<Self> {
        overrides.iter().try_for_each(check_override)?;
        overrides.iter().try_for_each(check_counts)?;
        Self::from_scene_table(settings.0.clone(), overrides).map_err(|e| e.within("settings"))
    }

    fn from_scene_table(mut table: Table, overrides: &[io::Override]) -> Result<Self> {
        leave_out_formats(&mut table);
        let table: Table = io::from_table_with(table, overrides)?;
        check_scene_table(&table)?;
        let idle = table.keys().find(|key| !counts_for_scene(key)).cloned();
        // This also reports keys unknown to recipes, with the closest known one.
        let config: Self = io::from_table(table)?;
        if let Some(key) = idle {
            return Err(of_no_scene(&key));
        }
        config.check()?;
        Ok(config)
    }

    fn with_scene_folders(mut self, scene: &Scene, path: &Path) -> Result<Self> {
        let files = scene.files.as_ref().ok_or_else(|| {
            let what = "missing, expected a table that names the folders of assets and backgrounds, or a recipe in addition to the scene";
            Error::value("files", what)
        })?;
        let folder = folder_of(path);
        self.assets = below(folder, required(&files.assets, "assets", "the assets")?);
        self.backgrounds = backgrounds_folder(files, &scene.plate, folder)?;
        self.folder = folder.into();
        if let Some(environments) = &files.environments {
            self.folder = below(folder, environments);
            let maps = scene.environment.iter();
            self.scene.environment.files = maps.map(|map| map.file.clone()).collect();
        }
        Ok(self)
    }

    /// A scene of this config with everything needed to render it from a file at `path` alone.
    ///
    /// # Errors
    /// Without a working folder.
    pub fn with_files(&self, scene: Scene, path: impl AsRef<Path>) -> Result<Scene> {
        Ok(Scene {
            files: Some(self.files_for(&scene, path.as_ref())?),
            settings: self.scene_settings()?,
            ..scene
        })
    }

    /// The folders of what a scene names, relative to its file.
    fn files_for(&self, scene: &Scene, path: &Path) -> Result<SceneFiles> {
        let mut files = SceneFiles {
            assets: Some(relative_to_file(&self.assets, path)?),
            ..SceneFiles::default()
        };
        if !scene.plate.is_empty() {
            files.backgrounds = Some(relative_to_file(&self.backgrounds, path)?);
        }
        if scene.environment.is_some() {
            files.environments = Some(relative_to_file(&self.folder, path)?);
        }
        Ok(files)
    }

    /// The values of [`SCENE_KEYS`] that differ from the defaults.
    fn scene_settings(&self) -> Result<SceneSettings> {
        let (own, defaults) = (as_table(self)?, as_table(&Self::default())?);
        let mut settings = Table::new();
        for key in SCENE_KEYS {
            if let Some(value) = difference(find(&own, key), find(&defaults, key)) {
                insert(&mut settings, key, value);
            }
        }
        leave_out_formats(&mut settings);
        Ok(SceneSettings(settings))
    }
}

/// Label formats have no meaning for a single picture, and some need a recipe's belt.
fn leave_out_formats(settings: &mut Table) {
    if let Some(Value::Table(labels)) = settings.get_mut("labels") {
        labels.remove("formats");
        if labels.is_empty() {
            settings.remove("labels");
        }
    }
}

/// Fails on a replaced value that only decides how scenes are drawn.
fn check_override(given: &io::Override) -> Result<()> {
    let path = given.path();
    let counts = |key: &&str| path.starts_with(*key);
    if (path == "scene" || path.starts_with("scene.")) && !KEYS_BESIDE_A_SCENE.iter().any(counts) {
        return Err(only_drawn(path));
    }
    Ok(())
}

/// The same for the settings of a scene, whose own values name its environment map.
fn check_scene_table(settings: &Table) -> Result<()> {
    let scene = settings.get("scene").and_then(Value::as_table);
    let mut keys = scene.into_iter().flat_map(Table::keys);
    match keys.find(|key| *key != "settle") {
        Some(key) => Err(only_drawn(&format!("scene.{key}"))),
        None => Ok(()),
    }
}

/// Fails for a key of a recipe that has no effect on a scene.
fn check_counts(given: &io::Override) -> Result<()> {
    let path = given.path();
    match path.split('.').next() {
        Some("split" | "preset" | "assets" | "backgrounds") => Err(of_no_scene(path)),
        _ => Ok(()),
    }
}

/// Whether a recipe's key has an effect on an existing scene.
fn counts_for_scene(key: &str) -> bool {
    let mut known = SCENE_KEYS.into_iter().chain(["pictures"]);
    known.any(|path| path.split('.').next() == Some(key))
}

fn of_no_scene(key: &str) -> Error {
    let known = SCENE_KEYS.join(", ");
    let what =
        format!("has no effect on a scene, expected {known} or pictures; folders are in files");
    Error::value(key, what)
}

fn only_drawn(key: &str) -> Error {
    let what = "decides how scenes are drawn, expected a change of the scene itself";
    Error::value(key, what)
}

/// A path named in a file of a folder; in older scenes an empty path is the folder itself.
fn below(folder: &Path, path: &Path) -> PathBuf {
    let joined = folder.join(path);
    if joined.as_os_str().is_empty() {
        return ".".into();
    }
    joined
}

fn required<'a>(folder: &'a Option<PathBuf>, key: &str, content: &str) -> Result<&'a Path> {
    folder.as_deref().ok_or_else(|| {
        let what = format!("missing, expected the folder of {content}");
        Error::value(format!("files.{key}"), what)
    })
}

fn as_table(config: &DatasetConfig) -> Result<Table> {
    Table::try_from(config).map_err(|e| Error::value("settings", e.to_string()))
}

/// The value at a path of keys.
fn find<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    match table.get(first) {
        Some(Value::Table(inner)) if !rest.is_empty() => find(inner, rest),
        value => value,
    }
}

/// Sets the value at a path of keys.
fn insert(table: &mut Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => {
            table.insert(path.into(), value);
        }
        Some((first, rest)) => {
            let inner = table
                .entry(first)
                .or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(inner) = inner {
                insert(inner, rest, value);
            }
        }
    }
}

/// How a value differs from its default; for a table, only the keys that do.
fn difference(value: Option<&Value>, default: Option<&Value>) -> Option<Value> {
    match (value?, default) {
        (Value::Table(own), Some(Value::Table(defaults))) => {
            let own = own.iter().filter_map(|(key, value)| {
                let value = difference(Some(value), defaults.get(key))?;
                Some((key.clone(), value))
            });
            let table: Table = own.collect();
            (!table.is_empty()).then_some(Value::Table(table))
        }
        (value, default) if Some(value) == default => None,
        (value, _) => Some(value.clone()),
    }
}

/// The folder with a scene's plate; empty for a scene without one.
fn backgrounds_folder(files: &SceneFiles, plate: &str, folder: &Path) -> Result<PathBuf> {
    if plate.is_empty() {
        return Ok(PathBuf::new());
    }
    let content = format!("the photo \"{plate}\" and its label");
    let backgrounds = required(&files.backgrounds, "backgrounds", &content)?;
    Ok(below(folder, backgrounds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Format;
    use crate::label::ObstructionRule;
    use crate::scene::{CameraSource, Environment, Surface};

    fn scene() -> Scene {
        Scene {
            plate: "tray".into(),
            ..Scene::new(
                [64, 48],
                CameraSource::Rectangle {
                    corners_px: [[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]],
                    photo: [10, 10],
                    focal_px: None,
                },
                Surface::new([0.4, 0.3]),
            )
        }
    }

    /// Lit by a picture of the surroundings.
    fn scene_under(file: &str) -> Scene {
        Scene {
            environment: Some(Environment {
                file: file.into(),
                rotation_deg: 0.0,
                strength: 1.0,
            }),
            ..scene()
        }
    }

    #[test]
    fn a_scene_brings_the_setup_that_it_was_written_with() {
        let mut config = DatasetConfig {
            assets: "job/assets".into(),
            backgrounds: "photos".into(),
            folder: "job".into(),
            ..DatasetConfig::default()
        };
        config.render.subsamples += 1;
        config.scene.settle.attempts = 3;
        config.labels.options.obstruction = ObstructionRule::Visibility { min_visible: 0.97 };
        config.scene.image = [64, 48];
        config.scene.environment.files = vec!["../sky.exr".into()];
        let scene = scene_under("../sky.exr");
        let written = config.with_files(scene, "out/scene.toml").unwrap();
        let text = toml::to_string(&written).unwrap();
        let read: Scene = toml::from_str(&text).unwrap();
        assert_eq!(read, written, "{text}");
        let brought = DatasetConfig::for_scene(&read, "out/scene.toml", &[]).unwrap();
        let expected = DatasetConfig {
            assets: "out/../job/assets".into(),
            backgrounds: "out/../photos".into(),
            folder: "out/../job".into(),
            ..config
        };
        assert_eq!(brought, expected);
    }

    #[test]
    fn a_scene_and_its_files_may_lie_in_one_folder() {
        let config = DatasetConfig {
            assets: ".".into(),
            backgrounds: ".".into(),
            ..DatasetConfig::default()
        };
        let written = config.with_files(scene_under("sky.exr"), "scene.toml");
        let written = written.unwrap();
        let older = Scene {
            files: Some(SceneFiles {
                assets: Some("".into()),
                backgrounds: Some("".into()),
                environments: Some("".into()),
            }),
            ..written.clone()
        };
        for scene in [written, older] {
            let brought = DatasetConfig::for_scene(&scene, "scene.toml", &[]).unwrap();
            let folders = [&brought.assets, &brought.backgrounds, &brought.folder];
            assert_eq!(folders.map(|folder| folder.as_os_str()), ["."; 3]);
        }
    }

    #[test]
    fn what_only_decides_how_scenes_are_drawn_is_refused() {
        let given = |text: &str| {
            let set: io::Override = text.parse().unwrap();
            let told = DatasetConfig::from_settings(&SceneSettings::default(), &[set]);
            told.map_err(|e| e.to_string())
        };
        let told = given("scene.gain_ev=5").unwrap_err();
        let expected =
            "scene.gain_ev: decides how scenes are drawn, expected a change of the scene itself";
        assert_eq!(told, expected);
        let whole = given("scene={gain_ev=5}").unwrap_err();
        assert!(whole.starts_with("scene: decides"), "{whole}");
        let idle = given("split.val_percent=5").unwrap_err();
        assert!(
            idle.starts_with("split.val_percent: has no effect on a scene"),
            "{idle}"
        );
        for counts in ["scene.settle.attempts=3", "pictures.jpeg_quality=5"] {
            assert!(given(counts).is_ok(), "{counts}");
        }
        let settings = SceneSettings("[scene]\ngain_ev = 5\n".parse().unwrap());
        let told = DatasetConfig::from_settings(&settings, &[]).unwrap_err();
        assert_eq!(told.to_string(), format!("settings.{expected}"));
    }

    #[test]
    fn what_does_nothing_in_a_scene_is_refused() {
        let told = |settings: &str| {
            let settings = SceneSettings(settings.parse().unwrap());
            DatasetConfig::from_settings(&settings, &[])
                .map_or_else(|e| e.to_string(), |_| "".into())
        };
        for (key, settings) in [
            ("split", "[split]\nval_percent = 50\n"),
            ("preset", "preset = \"real\"\n"),
            ("assets", "assets = \"elsewhere\"\n"),
            ("backgrounds", "backgrounds = \"elsewhere\"\n"),
        ] {
            let expected = format!("settings.{key}: has no effect on a scene, expected render, ");
            assert!(told(settings).starts_with(&expected), "{}", told(settings));
        }
        let misspelt = told("[rendr]\nsubsamples = 2\n");
        assert!(misspelt.starts_with("settings: "), "{misspelt}");
        assert!(misspelt.contains("did you mean \"render\"?"), "{misspelt}");
        assert_eq!(told("[pictures]\njpeg_quality = 5\n"), "");
    }

    #[test]
    fn formats_are_of_datasets_alone() {
        let mut config = DatasetConfig::default();
        config.labels.formats.push(Format::Mot);
        assert!(config.scene_settings().unwrap().is_empty());
        let older = toml::from_str("[labels]\nformats = [\"mot\"]\nsimplify = 5.0\n").unwrap();
        let read = DatasetConfig::from_settings(&SceneSettings(older), &[]).unwrap();
        assert_eq!(read.labels.formats, DatasetConfig::default().labels.formats);
        assert_ne!(read.labels, DatasetConfig::default().labels);
    }

    #[test]
    fn defaults_are_not_written() {
        assert!(
            DatasetConfig::default()
                .scene_settings()
                .unwrap()
                .is_empty()
        );
        let text = toml::to_string(&scene()).unwrap();
        assert!(
            !text.contains("settings") && !text.contains("files"),
            "{text}"
        );
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = |scene: &Scene| {
            DatasetConfig::for_scene(scene, "scene.toml", &[])
                .unwrap_err()
                .to_string()
        };
        let bare = error(&scene());
        assert!(
            bare.starts_with("scene.toml: files: missing, expected a table"),
            "{bare}"
        );
        let assets = SceneFiles {
            assets: Some("assets".into()),
            ..SceneFiles::default()
        };
        let no_photo = error(&Scene {
            files: Some(assets),
            ..scene()
        });
        assert_eq!(
            no_photo,
            "scene.toml: files.backgrounds: missing, expected the folder of the photo \"tray\" and its label"
        );
        let wrong: Scene = toml::from_str(
            &(toml::to_string(&scene()).unwrap() + "[settings.render]\nsubsamples = 0\n"),
        )
        .unwrap();
        assert!(
            error(&wrong).starts_with("scene.toml: settings.render.subsamples: 0"),
            "{}",
            error(&wrong)
        );
    }
}
