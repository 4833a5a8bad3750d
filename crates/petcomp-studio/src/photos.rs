//! The photos of a folder, without files that petcomp generates from them or next to them.

use crate::folder::Folder;
use crate::picture::may_be_photo;
use petcomp::asset::MANIFEST;
use std::path::Path;

/// Name endings of pictures that petcomp writes next to photos.
const OWN_ENDINGS: [&str; 3] = [".overlay", ".front", ".matte"];

/// All photos below a folder, sorted by name, without pictures of datasets and cut-outs.
pub(crate) fn photos(folder: &Folder) -> Vec<String> {
    let (datasets, assets) = (
        folders_with(folder, "dataset.json"),
        folders_with(folder, MANIFEST),
    );
    let is_cut_out = |photo: &str| {
        let film = Path::new(photo).with_extension("exr");
        let below = parent_of(parent_of(photo));
        assets.iter().any(|made| made == below) && folder.file(&film.to_string_lossy()).is_ok()
    };
    let is_of_dataset = |photo: &str| {
        let mut datasets = datasets.iter();
        datasets.any(|made| Path::new(photo).starts_with(made))
    };
    let mut photos = folder.find(|path| may_be_photo(path) && !is_own(path));
    photos.retain(|photo| !is_cut_out(photo) && !is_of_dataset(photo));
    photos
}

/// The folders below one that contain a file; the opened folder itself does not count.
fn folders_with(folder: &Folder, file: &str) -> Vec<String> {
    let found = folder.find(|path| path.ends_with(file));
    let folders = found.iter().map(|name| parent_of(name).to_owned());
    folders.filter(|folder| !folder.is_empty()).collect()
}

/// Whether a file is a list of photos of objects.
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
        let mixed = ["b/assets.toml", "b/a.png", "b/cup/a.exr", "b/cup/a.png"];
        assert_eq!(photos_of(&mixed), ["b/a.png"]);
    }
}
