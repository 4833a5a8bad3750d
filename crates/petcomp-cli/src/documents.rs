//! Recipes, scenes and options: the documents that several commands read, and checks of output
//! paths before the work begins.

use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::io::{self, Override};
use petcomp::{Error, Quality, Result, Scene};
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Options from a TOML file, checked, or the defaults without one.
pub(crate) fn read_options<T: Default + DeserializeOwned>(
    file: Option<&Path>,
    check: impl FnOnce(&T) -> Result<()>,
) -> Result<T> {
    let Some(file) = file else {
        return Ok(T::default());
    };
    let options = io::read_toml(file)?;
    check(&options).map_err(|e| e.in_file(file))?;
    Ok(options)
}

/// Reads a scene and checks it: photos are opened at the size of its pictures.
pub(crate) fn read_scene(path: &Path) -> Result<Scene> {
    let scene: Scene = io::read_document(path)?;
    scene.check().map_err(|e| e.in_file(path))?;
    Ok(scene)
}

/// A recipe file, and overrides of its values.
#[derive(clap::Args)]
pub(crate) struct RecipeArgs {
    /// Recipe file (TOML), which names the folders of assets and backgrounds and what to draw
    #[arg(value_name = "RECIPE")]
    pub(crate) path: PathBuf,
    /// Override a value of the recipe: render.subsamples=8
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
}

impl RecipeArgs {
    /// Reads the recipe.
    pub(crate) fn read_config(&self) -> anyhow::Result<DatasetConfig> {
        self.read_config_at(None)
    }

    /// Reads the recipe for a quality, if one is given.
    pub(crate) fn read_config_at(&self, quality: Option<Quality>) -> anyhow::Result<DatasetConfig> {
        let overrides = Quality::overrides_at(quality, self.overrides.iter().cloned());
        Ok(DatasetConfig::read(&self.path, &overrides)?)
    }

    /// Reads the recipe with one more of its values replaced.
    pub(crate) fn read_config_with(&self, switch: &Override) -> anyhow::Result<DatasetConfig> {
        let overrides: Vec<_> = self.overrides.iter().chain([switch]).cloned().collect();
        Ok(DatasetConfig::read(&self.path, &overrides)?)
    }

    /// Reads the recipe for an existing scene.
    pub(crate) fn read_config_for(&self, scene: &Scene) -> Result<DatasetConfig> {
        DatasetConfig::read_for_scene(&self.path, scene, &self.overrides)
    }

    /// Opens the folders that the recipe names.
    pub(crate) fn open_pipeline(&self) -> anyhow::Result<Pipeline> {
        Ok(Pipeline::open(self.read_config()?)?)
    }
}

/// A scene file, and the source of the files that it names.
#[derive(clap::Args)]
pub(crate) struct SceneArgs {
    /// Scene file (TOML or JSON); its unknowns are solved first
    #[arg(value_name = "SCENE")]
    pub(crate) path: PathBuf,
    /// Recipe file (TOML) that names the folders of assets and backgrounds; by default the scene's
    /// own `[files]`
    #[arg(value_name = "RECIPE")]
    recipe: Option<PathBuf>,
    /// Override a value of the recipe or of the scene's settings: render.subsamples=8
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
}

impl SceneArgs {
    /// The scene and the recipe.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.recipe.iter().chain([&self.path])
    }

    pub(crate) fn read_scene(&self) -> Result<Scene> {
        read_scene(&self.path)
    }

    /// Opens what the scene is made from, and checks that no target is part of it.
    pub(crate) fn open_pipeline<'a>(
        &self,
        scene: &Scene,
        quality: Option<Quality>,
        targets: impl Iterator<Item = &'a PathBuf>,
    ) -> anyhow::Result<Pipeline> {
        let pipeline = Pipeline::open_for(self.config_for(scene, quality)?, scene)?;
        // A file that does not exist yet is none of the inputs, of which there may be very many.
        let there: Vec<_> = targets.filter(|target| target.exists()).collect();
        if !there.is_empty() {
            io::check_distinct(pipeline.input_files(scene)?, there)?;
        }
        Ok(pipeline)
    }

    /// The recipe's config or, without a recipe, the one contained in the scene; at the given
    /// quality, if any.
    fn config_for(&self, scene: &Scene, quality: Option<Quality>) -> Result<DatasetConfig> {
        let overrides = Quality::overrides_at(quality, self.overrides.iter().cloned());
        match &self.recipe {
            Some(recipe) => DatasetConfig::read_for_scene(recipe, scene, &overrides),
            None => DatasetConfig::for_scene(scene, &self.path, &overrides),
        }
    }
}

/// Fails for a picture to write without a known format, or without an existing folder.
pub(crate) fn check_picture_target(path: &Path) -> Result<()> {
    let known = ["png", "jpg", "jpeg", "exr", "tif", "tiff"];
    let expected = ".png, .jpg, .exr or .tif";
    check_target(path, &known, expected)
}

/// The same for a scene.
pub(crate) fn check_scene_target(path: &Path) -> Result<()> {
    check_target(path, &["toml", "json"], ".toml or .json")
}

fn check_target(path: &Path, known: &[&str], expected: &str) -> Result<()> {
    if known.iter().any(|end| io::has_extension(path, end)) {
        return io::check_folder_of(path);
    }
    let what = format!("no format for this extension, expected {expected}");
    Err(Error::file(path, what))
}

/// The file's name without its extension.
pub(crate) fn stem_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// A path quoted as one word for the shell.
pub(crate) fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._-/".contains(c);
    if text.chars().all(is_plain) {
        return text;
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_one_word_for_the_shell() {
        let words = [
            ("bg/a-1_b.label.json", "bg/a-1_b.label.json"),
            ("my photos/a.json", "'my photos/a.json'"),
            ("colleague's/$a.json", r"'colleague'\''s/$a.json'"),
        ];
        for (path, word) in words {
            assert_eq!(shell_word(Path::new(path)), word);
        }
    }
}
