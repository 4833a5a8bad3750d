//! The photos of a folder, and which of them have a label and a camera.

use crate::folder::Folder;
use crate::photos::{is_list, parent_of, photos};
use petcomp::io;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeSet;

/// A photo and its progress.
#[derive(Serialize)]
pub(super) struct PhotoProgress {
    /// Its path with slashes.
    photo: String,
    label: bool,
    camera: bool,
    /// Whether the label next to it is another photo's.
    taken: bool,
}

/// All photos below a folder, sorted by name; photos of objects, from folders with a list, come
/// last.
pub(super) fn list(folder: &Folder) -> Vec<PhotoProgress> {
    let json = folder.find(|path| path.extension().is_some_and(|ending| ending == "json"));
    let documents: BTreeSet<String> = json.into_iter().collect();
    let entry = |photo: String| {
        let label = beside(&photo, "label.json");
        let has_label = documents.contains(&label);
        // If photos differ only in their extensions, the label and its camera belong to one of
        // them.
        let is_anothers = has_label && names_another(folder, &label, &photo);
        PhotoProgress {
            label: has_label && !is_anothers,
            camera: !is_anothers && documents.contains(&beside(&photo, "camera.json")),
            taken: is_anothers,
            photo,
        }
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

/// Whether the label next to a photo is another photo's. One that cannot be read counts as the
/// photo's own: the photo's page then reports what is wrong with it.
fn names_another(folder: &Folder, label: &str, photo: &str) -> bool {
    let path = folder.file(label).ok();
    let label = path.and_then(|path| io::read_json::<Value>(path).ok());
    let named = label
        .as_ref()
        .and_then(|label| label["image"]["file"].as_str());
    named.is_some_and(|named| !named.is_empty() && named != file_name(photo))
}

/// `a.jpg` for `sub/a.jpg`: the photo's name in the label next to it.
pub(super) fn file_name(photo: &str) -> &str {
    photo.rsplit('/').next().unwrap_or(photo)
}

/// `sub/a.label.json` for `sub/a.jpg`.
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
