//! The photos that can be cut out: the entries of the folder's photo lists.

use super::review::review_of;
use crate::folder::Folder;
use crate::message::Json;
use crate::photos::is_list;
use crate::refusal::{Answer, Refusal};
use crate::studio::Studio;
use crate::turn::blocking;
use axum::extract::State;
use axum::http::StatusCode;
use petcomp::asset::{List, PhotoEntry, ScreenSource, Verdict};
use petcomp::matte::CutOutOptions;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// An entry of a list: the list's file and the photo's, with slashes, relative to the folder.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub(super) struct EntryName {
    list: String,
    pub(super) photo: String,
}

impl EntryName {
    /// The entry, with its paths inside the folder, and its list's options for cutting it out.
    pub(super) fn find(&self, folder: &Folder) -> Answer<(PhotoEntry, CutOutOptions)> {
        let list = read_list(folder, &self.list)?;
        let mut entries = list.photos.into_iter();
        let entry = entries.find(|entry| photo_name(folder, entry) == self.photo);
        let entry = entry.ok_or_else(|| missing(self))?;
        Ok((inside(folder, entry)?, list.cut_out))
    }
}

fn missing(EntryName { list, photo }: &EntryName) -> Refusal {
    let what = format!("{photo}: not (or no longer) in {list}, expected one of its photos");
    Refusal::new(StatusCode::NOT_FOUND, petcomp::printable(&what))
}

/// A list with paths relative to the working folder.
fn read_list(folder: &Folder, name: &str) -> Answer<List> {
    let path = folder.file(name)?;
    let list = List::read(&path)?;
    Ok(list.located_in(path.parent().unwrap_or(Path::new(""))))
}

/// The photo of an entry, as browsers name it.
fn photo_name(folder: &Folder, entry: &PhotoEntry) -> String {
    folder.name_of_listed(&entry.file)
}

/// An entry, if its pictures are in the folder.
fn inside(folder: &Folder, mut entry: PhotoEntry) -> Answer<PhotoEntry> {
    entry.file = folder.file(&photo_name(folder, &entry))?;
    if let ScreenSource::Photo(empty) = &entry.screen {
        let name = folder.name_of_listed(empty);
        entry.screen = ScreenSource::Photo(folder.file(&name)?);
    }
    Ok(entry)
}

/// The photos and plates to choose from.
#[derive(Serialize)]
pub(super) struct Photos {
    photos: Vec<ListedPhoto>,
    /// Lists that cannot be used, with the reason.
    problems: Vec<String>,
    /// Labelled photos of places to composite cut-outs onto.
    plates: Vec<String>,
}

/// A photo of a list, and the review of its cut-out.
#[derive(Serialize)]
struct ListedPhoto {
    list: String,
    photo: String,
    asset: String,
    class: String,
    verdict: Option<Verdict>,
    strokes: usize,
}

pub(super) async fn photos(State(studio): State<Arc<Studio>>) -> Answer<Json<Photos>> {
    blocking(move || Ok(Json(Photos::of(&studio.folder)))).await
}

impl Photos {
    fn of(folder: &Folder) -> Self {
        let (mut photos, mut problems) = (Vec::new(), Vec::new());
        for list in folder.find(is_list) {
            match read_list(folder, &list) {
                Ok(read) => photos.extend(listed(folder, &list, &read)),
                Err(refusal) => problems.push(refusal.what),
            }
        }
        // The review of a photo applies to all its entries.
        let mut seen = BTreeSet::new();
        photos.retain(|listed: &ListedPhoto| seen.insert(listed.photo.clone()));
        Self {
            photos,
            problems,
            plates: plates(folder),
        }
    }
}

fn listed(folder: &Folder, list: &str, read: &List) -> Vec<ListedPhoto> {
    let entries = read.photos.iter();
    let listed = entries.map(|entry| {
        let photo = photo_name(folder, entry);
        let review = review_of(folder, &photo).unwrap_or_default();
        ListedPhoto {
            list: list.into(),
            photo,
            asset: entry.asset.clone(),
            class: entry.class.clone(),
            verdict: review.verdict,
            strokes: review.strokes.len(),
        }
    });
    listed.collect()
}

/// The photos with a label next to them.
fn plates(folder: &Folder) -> Vec<String> {
    let photos = crate::photos::photos(folder).into_iter();
    let is_labelled = |photo: &String| {
        let label = Path::new(photo).with_extension("label.json");
        folder.file(&label.to_string_lossy()).is_ok()
    };
    photos.filter(is_labelled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_outside_of_the_folder_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("folder");
        std::fs::create_dir_all(root.join("lists")).unwrap();
        std::fs::write(dir.path().join("secret.png"), "").unwrap();
        std::fs::write(root.join("a.png"), "").unwrap();
        let entry = |file: &str, more: &str| {
            format!(
                "[[photos]]\nfile = \"{file}\"\nasset = \"{more}\"\nclass = \"c\"\nlength = 0.2\n"
            )
        };
        let text = [entry("../a.png", "a"), entry("../../secret.png", "b")].concat();
        std::fs::write(root.join("lists/photos.toml"), text).unwrap();
        let folder = Folder::open(&root).unwrap();
        let found = |photo: &str| {
            let (list, photo) = ("lists/photos.toml".into(), photo.into());
            EntryName { list, photo }.find(&folder)
        };
        assert_eq!(found("a.png").unwrap().0.file, root.join("a.png"));
        let all = Photos::of(&folder);
        assert_eq!(all.photos[0].photo, "a.png");
        assert!(found(&all.photos[1].photo).is_err());
    }

    #[test]
    fn a_photo_of_two_assets_stands_once() {
        let dir = tempfile::tempdir().unwrap();
        let line = |asset: &str| format!("a.png,{asset},c,0.2\n");
        let text = format!("file,asset,class,length\n{}{}", line("a"), line("b"));
        std::fs::write(dir.path().join("photos.csv"), text).unwrap();
        let all = Photos::of(&Folder::open(dir.path()).unwrap());
        assert_eq!((all.photos.len(), all.problems.len()), (1, 0));
    }
}
