//! The photos of a folder: not what petcomp writes beside them or makes of them.

use crate::folder::Folder;
use crate::picture::may_be_photo;
use petcomp::asset::MANIFEST;
use std::path::Path;

/// Endings of pictures that petcomp writes beside photos.
const OWN_ENDINGS: [&str; 3] = [".overlay", ".front", ".matte"];

/// All photos below a folder, in order of name; no pictures of datasets and no cut-outs.
pub(crate) fn photos(folder: &Folder) -> Vec<String> {
    let made = folder.find(|path| path.ends_with("dataset.json") || path.ends_with(MANIFEST));
    let lists = folder.find(is_list);
    let of_photos = |made: &&str| lists.iter().any(|list| parent_of(list) == *made);
    let made = made.iter().map(|name| parent_of(name));
    // What is opened itself is looked at, and so are photos that cut-outs were put beside.
    let made: Vec<&str> = made
        .filter(|made| !made.is_empty() && !of_photos(made))
        .collect();
    let mut photos = folder.find(|path| may_be_photo(path) && !is_own(path));
    photos.retain(|photo| !made.iter().any(|made| Path::new(photo).starts_with(made)));
    photos
}

/// A list of photos of objects.
pub(crate) fn is_list(path: &Path) -> bool {
    ["photos.toml", "photos.csv"]
        .iter()
        .any(|name| path.ends_with(name))
}

pub(crate) fn parent_of(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(folder, _)| folder)
}

fn is_own(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    // `contact_sheet_2` is a further page.
    let first_page = stem.trim_end_matches(|c: char| c == '_' || c.is_ascii_digit());
    let is_page = first_page.ends_with("contact_sheet");
    is_page || OWN_ENDINGS.iter().any(|ending| stem.ends_with(ending))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photos_of(files: &[&str]) -> Vec<String> {
        let dir = tempfile::tempdir().unwrap();
        for file in files {
            let path = dir.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        photos(&Folder::open(dir.path()).unwrap())
    }

    #[test]
    fn no_page_of_a_contact_sheet_is_a_photo() {
        let files = ["contact_sheet.png", "contact_sheet_12.png", "a_2.png"];
        assert_eq!(photos_of(&files), ["a_2.png"]);
    }

    #[test]
    fn pictures_of_a_dataset_are_no_photos() {
        let files = ["set/dataset.json", "set/images/0.png", "a.png", "set.png"];
        assert_eq!(photos_of(&files), ["a.png", "set.png"]);
    }

    #[test]
    fn cut_outs_are_no_photos_and_photos_beside_them_are() {
        let files = [
            "assets/assets.toml",
            "assets/cup/a.exr",
            "assets/cup/a.png",
            "backgrounds/tray.jpg",
        ];
        assert_eq!(photos_of(&files), ["backgrounds/tray.jpg"]);
        let beside = ["b/assets.toml", "b/photos.csv", "b/a.png"];
        assert_eq!(photos_of(&beside), ["b/a.png"]);
    }
}
