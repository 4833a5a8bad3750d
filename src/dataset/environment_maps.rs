//! Pictures of the surroundings that recipes and scenes name, decoded once.

use crate::asset::{Panorama, warn_of_bits};
use crate::dataset::DatasetConfig;
use crate::dataset::known_files::KnownFiles;
use crate::error::{Error, Result};
use crate::io;
use crate::lru::{InMemory, LruCache};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Maximum size of the pictures kept in memory, bytes.
const KEPT_BYTES: usize = 1 << 30;

/// The environment maps of a recipe.
#[derive(Debug)]
pub(crate) struct EnvironmentMaps {
    /// Folder of the recipe.
    folder: PathBuf,
    /// What the recipe lists.
    listed: Vec<String>,
    kept: LruCache<Arc<Panorama>>,
    /// What they are read from.
    known: KnownFiles,
}

impl EnvironmentMaps {
    pub(crate) fn of(config: &DatasetConfig) -> Self {
        let listed = config.scene.environment.files.clone();
        Self {
            folder: config.folder.clone(),
            listed,
            kept: LruCache::of_bytes(KEPT_BYTES),
            known: KnownFiles::default(),
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

    /// Fails if light was taken from a picture with another checksum; from now on none can be.
    pub(crate) fn check_file(&self, path: &Path, crc32: u32) -> Result<()> {
        self.known.check(path, crc32)
    }

    /// The picture that a scene names.
    ///
    /// # Errors
    /// A name that the recipe does not list and that is outside its folder; a file that is not a
    /// panorama, or whose checksum is not the known one.
    pub(crate) fn picture(&self, name: &str) -> Result<Arc<Panorama>> {
        if let Some(picture) = self.kept.get(name) {
            return Ok(picture);
        }
        let path = self.path(name)?;
        let of_image = |image| Panorama::of_file(image, &path);
        let picture = self.known.read(&path, of_image)?;
        self.keep(name, picture, &path)
    }

    /// What a recipe lists may be anywhere; anything else that a scene names must be in the
    /// recipe's folder.
    fn path(&self, name: &str) -> Result<PathBuf> {
        if self.listed.iter().any(|listed| listed == name) {
            return Ok(self.folder.join(name));
        }
        io::inside(&self.folder, name).map_err(|e| match e {
            Error::Value { .. } => not_listed(name),
            other => other,
        })
    }

    fn keep(&self, name: &str, picture: Panorama, path: &Path) -> Result<Arc<Panorama>> {
        if let Some(known) = self.kept.get(name) {
            return Ok(known);
        }
        warn_of_bits(path)?;
        Ok(self.kept.insert(name, Arc::new(picture)))
    }
}

impl InMemory for Panorama {
    fn bytes(&self) -> usize {
        size_of_val(self.image().pixels())
    }
}

fn not_listed(name: &str) -> Error {
    let what = "expected one that the recipe lists (scene.environment.files) or one in its folder";
    Error::value("environment.file", format!("\"{name}\", {what}"))
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
    fn a_picture_is_of_the_bytes_that_its_file_is_known_by() {
        let (_dir, config) = folder();
        let surroundings = EnvironmentMaps::of(&config);
        let path = config.folder.join("../far.exr");
        surroundings.check_file(&path, 1).unwrap();
        let refused = surroundings.picture("../far.exr").unwrap_err().to_string();
        let expected = "far.exr: has changed since its folder was opened";
        assert!(refused.ends_with(expected), "{refused}");
    }

    #[test]
    fn a_picture_that_was_refused_may_be_repaired() {
        let (_dir, config) = folder();
        let surroundings = EnvironmentMaps::of(&config);
        let path = config.folder.join("../far.exr");
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, "no picture").unwrap();
        assert!(surroundings.picture("../far.exr").is_err());
        let square = Image::filled(2, 2, LinearRgb::WHITE);
        io::write(&path, &square).unwrap();
        assert!(surroundings.picture("../far.exr").is_err());
        std::fs::write(&path, &whole).unwrap();
        surroundings.picture("../far.exr").unwrap();
        assert!(surroundings.check_file(&path, 1).is_err());
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
