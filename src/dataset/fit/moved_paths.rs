//! File names in a recipe that moves to another folder.

use crate::dataset::DatasetConfig;
use crate::dataset::paths::{folder_of, seen_from};
use crate::dataset::recipe_text::KeyEdit;
use crate::error::Result;
use crate::io;
use std::path::Path;

/// The keys that name files as they must be in a recipe file `output`; none if that is in the
/// folder of the recipe that was read.
pub(super) fn moved_paths(
    config: &DatasetConfig,
    recipe: &Path,
    output: &Path,
) -> Result<Vec<KeyEdit>> {
    let (from, to) = (io::absolute(recipe)?, io::absolute(output)?);
    let to = folder_of(&to);
    if folder_of(&from) == to {
        return Ok(Vec::new());
    }
    let folders = [
        ("assets", &config.assets),
        ("backgrounds", &config.backgrounds),
    ];
    let folders = folders.map(|(key, folder)| moved_folder(key, folder, to));
    let files = environment_files(config, to).transpose();
    folders.into_iter().chain(files).collect()
}

fn moved_folder(key: &str, folder: &Path, to: &Path) -> Result<KeyEdit> {
    Ok(KeyEdit::set(key, moved(folder, to)?))
}

fn environment_files(config: &DatasetConfig, to: &Path) -> Result<Option<KeyEdit>> {
    let files = config.scene.environment.files.iter();
    let files = files.map(|file| moved(&config.folder.join(file), to));
    let files: Vec<String> = files.collect::<Result<_>>()?;
    let text = format!("[{}]", files.join(", "));
    Ok((!files.is_empty()).then(|| KeyEdit::set("scene.environment.files", text)))
}

/// A path relative to a folder, as TOML.
fn moved(path: &Path, to: &Path) -> Result<String> {
    Ok(toml::Value::String(seen_from(to, path)?).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_to_the_same_files_from_another_folder() {
        let mut config = DatasetConfig {
            folder: "a".into(),
            assets: "a/assets".into(),
            backgrounds: "b".into(),
            ..DatasetConfig::default()
        };
        let moved = |config: &DatasetConfig, output: &str| {
            moved_paths(config, Path::new("a/recipe.toml"), Path::new(output)).unwrap()
        };
        assert_eq!(moved(&config, "a/fitted.toml"), []);
        config.scene.environment.files = vec!["sky.hdr".into()];
        let expected = [
            ("assets", "\"../a/assets\""),
            ("backgrounds", "\"../b\""),
            ("scene.environment.files", "[\"../a/sky.hdr\"]"),
        ];
        let expected = expected.map(|(key, text)| KeyEdit::set(key, text));
        assert_eq!(moved(&config, "c/fitted.toml"), expected);
    }

    #[test]
    #[cfg(unix)]
    fn a_folder_that_no_recipe_can_name_is_refused() {
        use std::os::unix::ffi::OsStrExt;
        let odd = Path::new(std::ffi::OsStr::from_bytes(b"b\xff"));
        let config = DatasetConfig {
            backgrounds: odd.into(),
            ..DatasetConfig::default()
        };
        let told = moved_paths(
            &config,
            Path::new("a/recipe.toml"),
            Path::new("c/fitted.toml"),
        );
        assert!(told.unwrap_err().to_string().contains("not UTF-8"));
    }

    #[test]
    fn bare_names_lie_in_the_working_folder() {
        let paths = ["recipe.toml", "fitted.toml"].map(Path::new);
        let moved = moved_paths(&DatasetConfig::default(), paths[0], paths[1]);
        assert_eq!(moved.unwrap(), []);
    }
}
