//! The photos of a folder, and which of them have a label and a camera.

use crate::folder::Folder;
use crate::picture::may_be_photo;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// Endings of pictures that petcomp writes beside photos.
const OWN_ENDINGS: [&str; 4] = [".overlay", ".front", ".matte", "contact_sheet"];

/// A photo, and how far it is.
#[derive(Serialize)]
pub(super) struct PhotoProgress {
    /// Its path with slashes.
    photo: String,
    label: bool,
    camera: bool,
}

/// All photos below a folder, in order of name; those of objects, which a list names, come last.
pub(super) fn list(folder: &Folder) -> Vec<PhotoProgress> {
    let json = folder.find(|path| path.extension().is_some_and(|ending| ending == "json"));
    let documents: BTreeSet<String> = json.into_iter().collect();
    let entry = |photo: String| PhotoProgress {
        label: documents.contains(&beside(&photo, "label.json")),
        camera: documents.contains(&beside(&photo, "camera.json")),
        photo,
    };
    let photos = photos(folder, &documents);
    photos.into_iter().map(entry).collect()
}

/// Photos, not what petcomp writes beside them or generates.
fn photos(folder: &Folder, documents: &BTreeSet<String>) -> Vec<String> {
    let mut photos = folder.find(|path| may_be_photo(path) && !is_own(path));
    let is_dataset = |name: &&String| Path::new(name).ends_with("dataset.json");
    let datasets: Vec<&str> = documents
        .iter()
        .filter(is_dataset)
        .map(|name| parent_of(name))
        .collect();
    photos.retain(|photo| {
        !datasets
            .iter()
            .any(|dataset| Path::new(photo).starts_with(dataset))
    });
    let lists = folder.find(is_list);
    let of_objects: BTreeSet<&str> = lists.iter().map(|list| parent_of(list)).collect();
    photos.sort_by_key(|photo| of_objects.contains(parent_of(photo)));
    photos
}

/// A list of photos of objects.
fn is_list(path: &Path) -> bool {
    ["photos.toml", "photos.csv"]
        .iter()
        .any(|name| path.ends_with(name))
}

fn parent_of(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(folder, _)| folder)
}

fn is_own(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    OWN_ENDINGS.iter().any(|ending| stem.ends_with(ending))
}

/// `sub/a.label.json` of `sub/a.jpg`.
pub(super) fn beside(photo: &str, ending: &str) -> String {
    let file = photo.rfind('/').map_or(0, |slash| slash + 1);
    let end = photo[file..].rfind('.').filter(|&dot| dot > 0);
    let end = end.map_or(photo.len(), |dot| file + dot);
    format!("{}.{ending}", &photo[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_a_dataset_are_no_photos() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(dir.path().join("set/images")).unwrap();
        for name in ["set/dataset.json", "set/images/0.png", "a.png", "set.png"] {
            std::fs::write(dir.path().join(name), "").unwrap();
        }
        let entries = list(&Folder::open(dir.path()).unwrap());
        let names: Vec<_> = entries.into_iter().map(|entry| entry.photo).collect();
        assert_eq!(names, ["a.png", "set.png"]);
    }

    #[test]
    fn a_label_is_called_as_its_photo() {
        let label = |photo: &str| beside(photo, "label.json");
        assert_eq!(label("a.jpg"), "a.label.json");
        assert_eq!(label("b.c/a.b.JPG"), "b.c/a.b.label.json");
        assert_eq!(label("b.c/a"), "b.c/a.label.json");
    }
}
