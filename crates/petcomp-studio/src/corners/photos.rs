//! The photos of a folder, and which of them have a label and a camera.

use crate::folder::Folder;
use crate::photos::{is_list, parent_of, photos};
use serde::Serialize;
use std::collections::BTreeSet;

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
    photos_of_places_first(folder)
        .into_iter()
        .map(entry)
        .collect()
}

fn photos_of_places_first(folder: &Folder) -> Vec<String> {
    let mut photos = photos(folder);
    let lists = folder.find(is_list);
    let of_objects: BTreeSet<&str> = lists.iter().map(|list| parent_of(list)).collect();
    photos.sort_by_key(|photo| of_objects.contains(parent_of(photo)));
    photos
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
    fn a_label_is_called_as_its_photo() {
        let label = |photo: &str| beside(photo, "label.json");
        assert_eq!(label("a.jpg"), "a.label.json");
        assert_eq!(label("b.c/a.b.JPG"), "b.c/a.b.label.json");
        assert_eq!(label("b.c/a"), "b.c/a.label.json");
    }
}
