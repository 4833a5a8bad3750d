//! Pictures of the surroundings that recipes and scenes name, decoded once.

use crate::asset::{Panorama, warn_of_bits};
use crate::dataset::DatasetConfig;
use crate::error::{Error, Result};
use crate::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bytes of pictures that are kept; those used last stay, and one of any size.
const KEPT_BYTES: usize = 1 << 30;

/// The environment maps of a recipe.
#[derive(Debug)]
pub(crate) struct EnvironmentMaps {
    /// Folder of the recipe.
    folder: PathBuf,
    /// What the recipe lists.
    listed: Vec<String>,
    /// In the order in which they were used last.
    kept: Mutex<Vec<(String, Arc<Panorama>)>>,
}

impl EnvironmentMaps {
    pub(crate) fn of(config: &DatasetConfig) -> Self {
        let listed = config.scene.environment.files.clone();
        Self {
            folder: config.folder.clone(),
            listed,
            kept: Mutex::default(),
        }
    }

    /// Whether a config names the same pictures.
    pub(crate) fn are_of(&self, config: &DatasetConfig) -> bool {
        self.folder == config.folder && self.listed == config.scene.environment.files
    }

    /// Name and path of each picture that the recipe lists.
    pub(crate) fn files(&self) -> impl Iterator<Item = (&str, PathBuf)> {
        self.listed
            .iter()
            .map(|name| (name.as_str(), self.folder.join(name)))
    }

    /// The picture that a scene names.
    ///
    /// # Errors
    /// A name that the recipe does not list and that leads out of its folder; a file that is no
    /// panorama.
    pub(crate) fn picture(&self, name: &str) -> Result<Arc<Panorama>> {
        if let Some(picture) = self.find(name) {
            return Ok(picture);
        }
        // Decoded before the list is locked: the work is parallel, and a thread that waits may come
        // back here.
        let path = self.path(name)?;
        let picture = Panorama::read(&path)?;
        self.keep(name, picture, &path)
    }

    /// What a recipe lists may lie anywhere; what a scene names beside that, in the recipe's
    /// folder.
    fn path(&self, name: &str) -> Result<PathBuf> {
        if self.listed.iter().any(|listed| listed == name) {
            return Ok(self.folder.join(name));
        }
        io::inside(&self.folder, name).map_err(|e| match e {
            Error::Value { .. } => not_listed(name),
            other => other,
        })
    }

    fn find(&self, name: &str) -> Option<Arc<Panorama>> {
        let mut kept = self.kept();
        let place = kept.iter().position(|(known, _)| known == name)?;
        kept[place..].rotate_left(1);
        kept.last().map(|(_, picture)| picture.clone())
    }

    fn keep(&self, name: &str, picture: Panorama, path: &Path) -> Result<Arc<Panorama>> {
        if let Some(known) = self.find(name) {
            return Ok(known);
        }
        warn_of_bits(path)?;
        let picture = Arc::new(picture);
        let mut kept = self.kept();
        kept.push((name.to_owned(), picture.clone()));
        drop_oldest(&mut kept);
        Ok(picture)
    }

    fn kept(&self) -> MutexGuard<'_, Vec<(String, Arc<Panorama>)>> {
        // Every change is whole, even where a thread panicked afterwards.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn not_listed(name: &str) -> Error {
    let what =
        "expected one that the recipe lists (scene.environment.files) or that lies in its folder";
    Error::value("environment.file", format!("\"{name}\", {what}"))
}

/// Drops the pictures that were used longest ago, until the others take little enough memory.
fn drop_oldest(kept: &mut Vec<(String, Arc<Panorama>)>) {
    while kept.len() > 1 && total_bytes(kept) > KEPT_BYTES {
        kept.remove(0);
    }
}

fn total_bytes(kept: &[(String, Arc<Panorama>)]) -> usize {
    let pictures = kept.iter().map(|(_, picture)| picture.image());
    pictures.map(|image| size_of_val(image.pixels())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::pixel::LinearRgb;

    fn folder() -> (tempfile::TempDir, DatasetConfig) {
        let dir = tempfile::tempdir().unwrap();
        io::create_folder(dir.path().join("own")).unwrap();
        for name in ["far.exr", "own/near.exr"] {
            io::write(
                dir.path().join(name),
                &Image::filled(4, 2, LinearRgb::WHITE),
            )
            .unwrap();
        }
        let mut config = DatasetConfig {
            folder: dir.path().join("own"),
            ..DatasetConfig::default()
        };
        config.scene.environment.files = vec!["../far.exr".into()];
        (dir, config)
    }

    #[test]
    fn a_picture_is_decoded_once() {
        let (_dir, config) = folder();
        let surroundings = EnvironmentMaps::of(&config);
        let [first, second] = [0, 1].map(|_| surroundings.picture("near.exr").unwrap());
        assert!(Arc::ptr_eq(&first, &second));
        assert!(!Arc::ptr_eq(
            &first,
            &surroundings.picture("../far.exr").unwrap()
        ));
        assert!(Arc::ptr_eq(
            &first,
            &surroundings.picture("near.exr").unwrap()
        ));
    }

    #[test]
    fn a_scene_names_pictures_of_the_recipe_or_of_its_folder() {
        let (dir, config) = folder();
        assert!(
            EnvironmentMaps::of(&config).picture("../far.exr").is_ok(),
            "listed"
        );
        let surroundings = EnvironmentMaps::of(&DatasetConfig {
            scene: Default::default(),
            ..config
        });
        let refused = |name: &str| surroundings.picture(name).unwrap_err().to_string();
        let absolute = dir.path().join("far.exr").to_string_lossy().into_owned();
        for name in ["../far.exr", &absolute] {
            assert!(
                refused(name)
                    .starts_with(&format!("environment.file: \"{name}\", expected one that"))
            );
        }
        assert!(refused("none.exr").ends_with("own/none.exr: no such file"));
    }
}
