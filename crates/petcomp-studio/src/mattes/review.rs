//! What a person said of a cut-out: read when a photo is shown, saved whenever it changes.

use crate::folder::Folder;
use crate::refusal::Answer;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::Json;
use axum::extract::{Query, State};
use petcomp::asset::{Review, Verdict};
use petcomp::matte::Stroke;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

#[derive(Deserialize)]
pub(super) struct PhotoQuery {
    photo: String,
}

/// A review as the page has it.
#[derive(Serialize)]
pub(super) struct ReadReview {
    strokes: Vec<Stroke>,
    verdict: Option<Verdict>,
    /// None where there is no file yet.
    version: Option<String>,
}

pub(super) async fn read(
    State(studio): State<Arc<Studio>>,
    Query(query): Query<PhotoQuery>,
) -> Answer<Json<ReadReview>> {
    blocking(move || read_review(&studio.folder, &query.photo).map(Json)).await
}

fn read_review(folder: &Folder, photo: &str) -> Answer<ReadReview> {
    let review = Review::of_photo(&folder.file(photo)?)?.unwrap_or_default();
    let file = folder.read_text(&review_name(photo));
    Ok(ReadReview {
        strokes: review.strokes,
        verdict: review.verdict,
        version: file.ok().map(|file| file.version),
    })
}

fn review_name(photo: &str) -> String {
    let path = Review::path_of(Path::new(photo));
    path.to_string_lossy().into_owned()
}

/// What the page has of a review.
#[derive(Deserialize)]
pub(super) struct ChangedReview {
    photo: String,
    size: [usize; 2],
    strokes: Vec<Stroke>,
    verdict: Option<Verdict>,
    /// That of the file when the page read it.
    version: Option<String>,
}

/// Where a review was saved.
#[derive(Serialize)]
pub(super) struct Saved {
    file: String,
    version: String,
}

pub(super) async fn save(
    State(studio): State<Arc<Studio>>,
    Json(changed): Json<ChangedReview>,
) -> Answer<Json<Saved>> {
    blocking(move || save_review(&studio.folder, changed).map(Json)).await
}

fn save_review(folder: &Folder, changed: ChangedReview) -> Answer<Saved> {
    folder.file(&changed.photo)?;
    let review = Review {
        verdict: changed.verdict,
        ..Review::new(changed.size.into(), changed.strokes)
    };
    review.check()?;
    let file = review_name(&changed.photo);
    let version = folder.save(&file, &review.to_json(), changed.version.as_deref())?;
    Ok(Saved { file, version })
}
