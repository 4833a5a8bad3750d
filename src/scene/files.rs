//! What a scene needs besides its own file: folders, and the settings of its picture.

use crate::error::Result;
use crate::io;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Folders of a scene's files, relative to the scene's own file, so that a scene can be rendered
/// without its recipe.
///
/// As in a recipe, the folders may be anywhere.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneFiles {
    /// Folder of the objects' assets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub assets: Option<PathBuf>,
    /// Folder of the plate's photo and its label.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backgrounds: Option<PathBuf>,
    /// Folder that the name of the environment map is relative to. Default: that of the scene's
    /// file, which must then contain the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environments: Option<PathBuf>,
}

impl SceneFiles {
    /// The same folders, relative to another scene file.
    ///
    /// # Errors
    /// If there is no working folder.
    pub fn moved(&self, from: &Path, to: &Path) -> Result<Self> {
        Ok(Self {
            assets: moved_path(self.assets.as_deref(), from, to)?,
            backgrounds: moved_path(self.backgrounds.as_deref(), from, to)?,
            environments: moved_path(self.environments.as_deref(), from, to)?,
        })
    }
}

/// A path relative to a file; an empty one is the working folder, as older scenes name it.
pub(crate) fn relative_to_file(path: &Path, file: &Path) -> Result<PathBuf> {
    let file = io::absolute(file)?;
    let folder = file.parent().unwrap_or(&file);
    io::relative_on_disk(io::or_working_folder(path), folder)
}

/// A path relative to one file, made relative to another.
fn moved_path(path: Option<&Path>, from: &Path, to: &Path) -> Result<Option<PathBuf>> {
    let folder = from.parent().unwrap_or(Path::new(""));
    path.map(|path| relative_to_file(&folder.join(path), to))
        .transpose()
}

/// Settings of a recipe for a scene's picture and labels, by the recipe's keys
/// (`render.subsamples`); missing ones have the recipe's defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SceneSettings(pub(crate) toml::Table);

impl SceneSettings {
    /// Whether everything has its default.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_from_another_folder_too() {
        let files = SceneFiles {
            assets: Some("../assets".into()),
            backgrounds: Some("photos".into()),
            environments: None,
        };
        let moved = files
            .moved(Path::new("job/scenes/a.toml"), Path::new("out/deep/b.json"))
            .unwrap();
        let expected = SceneFiles {
            assets: Some("../../job/assets".into()),
            backgrounds: Some("../../job/scenes/photos".into()),
            environments: None,
        };
        assert_eq!(moved, expected);
    }

    #[test]
    fn a_folder_may_be_that_of_the_file() {
        let own = relative_to_file(Path::new("job"), Path::new("job/scene.toml")).unwrap();
        assert_eq!(own.as_os_str(), ".");
        // As older scenes name it, beside a file without a folder.
        let older = moved_path(
            Some(Path::new("")),
            Path::new("scene.toml"),
            Path::new("out/b.toml"),
        );
        assert_eq!(older.unwrap(), Some("..".into()));
    }
}
