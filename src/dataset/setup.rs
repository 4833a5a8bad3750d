//! The file that a dataset is made from.

use crate::dataset::{LabelSetup, Pictures, Split};
use crate::error::Result;
use crate::io;
use crate::render::RenderOptions;
use crate::scene::Recipe;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a dataset is made from and how: the recipe file. It only says what it wants otherwise than by default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Setup {
    /// Folder of assets, relative to the file. Default: `assets`.
    pub assets: PathBuf,
    /// Folder of photos of the place with their labels (`NAME.label.json`), relative to the file. Default: `backgrounds`.
    pub backgrounds: PathBuf,
    /// What scenes are drawn from.
    pub scene: Recipe,
    /// How finely pictures are sampled.
    pub render: RenderOptions,
    /// How labels are made and written.
    pub labels: LabelSetup,
    /// Which pictures are for validation.
    pub split: Split,
    /// Format of the pictures.
    pub pictures: Pictures,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            assets: "assets".into(),
            backgrounds: "backgrounds".into(),
            scene: Recipe::default(),
            render: RenderOptions::default(),
            labels: LabelSetup::default(),
            split: Split::default(),
            pictures: Pictures::default(),
        }
    }
}

impl Setup {
    /// Reads a recipe file, some of its values replaced, and checks it; its folders become relative to the working
    /// folder.
    ///
    /// # Errors
    /// A file that cannot be read; an unknown key; a range that cannot be right.
    pub fn read(path: impl AsRef<Path>, overrides: &[io::Override]) -> Result<Self> {
        let path = path.as_ref();
        let mut setup: Self = io::read_toml_with(path, overrides)?;
        setup.scene.check().map_err(|e| e.within("scene").in_file(path))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        setup.assets = folder.join(&setup.assets);
        setup.backgrounds = folder.join(&setup.backgrounds);
        Ok(setup)
    }
}
