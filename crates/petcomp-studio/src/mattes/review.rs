//! Reviews of cut-outs: read when a photo is shown, saved whenever they change.

use crate::folder::Folder;
use crate::message::{Json, Query};
use crate::picture::PhotoName;
use crate::refusal::Answer;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::extract::State;
use petcomp::asset::{Review, Verdict};
use petcomp::matte::Stroke;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// A review as sent to the page.
#[derive(Serialize)]
pub(super) struct ReadReview {
    /// Width and height of the picture painted on, pixels; none if there is no file yet.
    size: Option<[usize; 2]>,
    strokes: Vec<Stroke>,
    verdict: Option<Verdict>,
    /// None if there is no file yet.
    version: Option<String>,
}

pub(super) async fn read(
    State(studio): State<Arc<Studio>>,
    Query(query): Query<PhotoName>,
) -> Answer<Json<ReadReview>> {
    blocking(move || read_review(&studio.folder, &query.photo).map(Json)).await
}

fn read_review(folder: &Folder, photo: &str) -> Answer<ReadReview> {
    let file = folder.text_if_any(&review_name(photo))?;
    let review = review_of(folder, photo)?;
    Ok(ReadReview {
        size: file.as_ref().map(|_| review.size_px),
        strokes: review.strokes,
        verdict: review.verdict,
        version: file.map(|file| file.version),
    })
}

/// The review of a photo, or an empty one; a link to a review outside the folder counts as none.
pub(super) fn review_of(folder: &Folder, photo: &str) -> Answer<Review> {
    let photo_path = folder.file(photo)?;
    match folder.file(&review_name(photo)) {
        Ok(_) => Ok(Review::of_photo(&photo_path)?.unwrap_or_default()),
        Err(_) => Ok(Review::default()),
    }
}

fn review_name(photo: &str) -> String {
    let path = Review::path_of(Path::new(photo));
    path.to_string_lossy().into_owned()
}

/// A review as received from the page.
#[derive(Deserialize)]
pub(super) struct ChangedReview {
    photo: String,
    size: [usize; 2],
    strokes: Vec<Stroke>,
    verdict: Option<Verdict>,
    /// Version of the file when the page read it.
    version: Option<String>,
}

/// The saved review.
#[derive(Serialize)]
pub(super) struct SavedReview {
    file: String,
    version: String,
}

pub(super) async fn save(
    State(studio): State<Arc<Studio>>,
    Json(changed): Json<ChangedReview>,
) -> Answer<Json<SavedReview>> {
    blocking(move || save_review(&studio.folder, changed).map(Json)).await
}

fn save_review(folder: &Folder, changed: ChangedReview) -> Answer<SavedReview> {
    folder.file(&changed.photo)?;
    let review = Review {
        verdict: changed.verdict,
        ..Review::new(changed.size.into(), changed.strokes)
    };
    review.check()?;
    let file = review_name(&changed.photo);
    let version = folder.save(&file, &review.to_json(), changed.version.as_deref())?;
    Ok(SavedReview { file, version })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rejected() -> String {
        let review = Review {
            verdict: Some(Verdict::Rejected),
            ..Review::new((16, 16), Vec::new())
        };
        review.to_json()
    }

    #[test]
    fn what_is_saved_is_read_and_a_stale_save_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.png"), "").unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        let changed = || ChangedReview {
            photo: "a.png".into(),
            size: [16, 16],
            strokes: Vec::new(),
            verdict: Some(Verdict::Accepted),
            version: None,
        };
        assert_eq!(read_review(&folder, "a.png").unwrap().version, None);
        let saved = save_review(&folder, changed()).unwrap();
        let read = read_review(&folder, "a.png").unwrap();
        assert_eq!(
            (saved.file.as_str(), read.version),
            ("a.review.json", Some(saved.version))
        );
        assert_eq!(read.verdict, Some(Verdict::Accepted));
        assert!(save_review(&folder, changed()).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_review_that_lies_elsewhere_is_none() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("folder");
        std::fs::create_dir(&root).unwrap();
        std::fs::write(dir.path().join("far.json"), rejected()).unwrap();
        std::fs::write(root.join("a.png"), "").unwrap();
        std::os::unix::fs::symlink("../far.json", root.join("a.review.json")).unwrap();
        let folder = Folder::open(&root).unwrap();
        assert_eq!(review_of(&folder, "a.png").unwrap().verdict, None);
    }
}
