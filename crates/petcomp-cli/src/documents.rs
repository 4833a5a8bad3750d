//! Recipes, scenes and options: the documents that several commands read.

use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::io::{self, Override};
use petcomp::{Quality, Result, Scene};
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Options from a TOML file, or the defaults where there is none.
pub(crate) fn read_options<T: Default + DeserializeOwned>(file: Option<&Path>) -> Result<T> {
    file.map_or_else(|| Ok(T::default()), io::read_toml)
}

/// A recipe file, and values in it that are to be different.
#[derive(clap::Args)]
pub(crate) struct RecipeArgs {
    /// Recipe file (TOML): names the folders of assets and backgrounds, and what to draw
    #[arg(value_name = "RECIPE")]
    pub(crate) path: PathBuf,
    /// Replace a value of the recipe: scene.objects=[4,12]
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
}

impl RecipeArgs {
    /// Reads the recipe.
    pub(crate) fn read_config(&self) -> anyhow::Result<DatasetConfig> {
        self.read_config_at(None)
    }

    /// Reads the recipe, everything computed as finely as is asked for.
    pub(crate) fn read_config_at(&self, quality: Option<Quality>) -> anyhow::Result<DatasetConfig> {
        let overrides = Quality::overrides_at(quality, self.overrides.iter().cloned());
        Ok(DatasetConfig::read(&self.path, &overrides)?)
    }

    /// Reads the recipe, one more of its values replaced.
    pub(crate) fn read_config_with(&self, switch: &Override) -> anyhow::Result<DatasetConfig> {
        let overrides: Vec<_> = self.overrides.iter().chain([switch]).cloned().collect();
        Ok(DatasetConfig::read(&self.path, &overrides)?)
    }

    /// Opens the folders that the recipe names.
    pub(crate) fn open_pipeline(&self) -> anyhow::Result<Pipeline> {
        Ok(Pipeline::open(self.read_config()?)?)
    }
}

/// A scene file, and where the files that it names are.
#[derive(clap::Args)]
pub(crate) struct SceneArgs {
    /// Scene, TOML or JSON; what is unknown in it is solved first
    #[arg(value_name = "SCENE")]
    pub(crate) path: PathBuf,
    /// Recipe file (TOML) that names the folders of assets and backgrounds; by default the scene's
    /// own `[files]` does
    #[arg(value_name = "RECIPE")]
    recipe: Option<PathBuf>,
    /// Replace a value of the recipe or of the scene's settings: render.subsamples=8
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
}

impl SceneArgs {
    /// The scene and the recipe.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.recipe.iter().chain([&self.path])
    }

    pub(crate) fn read_scene(&self) -> anyhow::Result<Scene> {
        Ok(io::read_document(&self.path)?)
    }

    /// Opens what the scene is made from, of which no target may be a part.
    pub(crate) fn open_pipeline<'a>(
        &self,
        scene: &Scene,
        quality: Option<Quality>,
        targets: impl Iterator<Item = &'a PathBuf>,
    ) -> anyhow::Result<Pipeline> {
        let pipeline = Pipeline::open_for(self.config_for(scene, quality)?, scene)?;
        // A file that is not there yet is none of the inputs, of which there may be very many.
        let there: Vec<_> = targets.filter(|target| target.exists()).collect();
        if !there.is_empty() {
            io::check_distinct(pipeline.input_files(scene)?, there)?;
        }
        Ok(pipeline)
    }

    /// The recipe's config or, without a recipe, that which the scene brings; everything computed as
    /// finely as is asked for.
    fn config_for(&self, scene: &Scene, quality: Option<Quality>) -> Result<DatasetConfig> {
        let overrides = Quality::overrides_at(quality, self.overrides.iter().cloned());
        match &self.recipe {
            Some(recipe) => DatasetConfig::read(recipe, &overrides),
            None => DatasetConfig::for_scene(scene, &self.path, &overrides),
        }
    }
}

/// The file's name without its extension.
pub(crate) fn stem_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
