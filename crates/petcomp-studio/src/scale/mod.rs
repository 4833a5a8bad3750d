//! The page `scale`: the two ends of a ruler, or the corners of the screen, give a photo's pixels
//! per metre.

mod photo_list;

use crate::message::{Json, Query};
use crate::photos::photos;
use crate::picture::PhotoName;
use crate::refusal::Answer;
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::Router;
use axum::extract::State;
use axum::routing::{get, post};
use petcomp::matte;
use photo_list::{PhotoScale, ScaledPhoto, VersionedEntry};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("scale.html"), crate::page!("scale.js")];

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
        .route("/photos", get(list_photos))
        .route("/photo", get(read_photo))
        .route("/screen", post(find_screen))
        .route("/save", post(save))
}

/// A photo, and whether its list gives its scale.
#[derive(Serialize)]
struct ListEntry {
    photo: String,
    scaled: bool,
}

async fn list_photos(State(studio): State<Arc<Studio>>) -> Answer<Json<Vec<ListEntry>>> {
    blocking(move || {
        let photos = photos(&studio.folder);
        let scaled = photo_list::scaled_photos(&studio.folder, &photos);
        let entries = photos.into_iter().map(|photo| ListEntry {
            scaled: scaled.contains(&photo),
            photo,
        });
        Ok(Json(entries.collect()))
    })
    .await
}

async fn read_photo(
    State(studio): State<Arc<Studio>>,
    Query(asked): Query<PhotoName>,
) -> Answer<Json<VersionedEntry>> {
    blocking(move || {
        studio.folder.file(&asked.photo)?;
        Ok(Json(photo_list::read(&studio.folder, &asked.photo)?))
    })
    .await
}

/// Corners of the screen, pixels.
#[derive(Serialize)]
struct FoundScreen {
    corners_px: [[f64; 2]; 4],
}

async fn find_screen(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<PhotoName>,
) -> Answer<Json<FoundScreen>> {
    blocking(move || {
        let photo = studio.photo(&asked.photo)?;
        let corners_px = matte::screen_corners(&photo)?.corners_px.map(Into::into);
        Ok(Json(FoundScreen { corners_px }))
    })
    .await
}

#[derive(Deserialize)]
struct NewScale {
    photo: String,
    version: Option<String>,
    scale: PhotoScale,
    /// The object's name in the list, if the photo is new in it.
    #[serde(default)]
    asset: String,
    #[serde(default)]
    class: String,
}

async fn save(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<NewScale>,
) -> Answer<Json<VersionedEntry>> {
    blocking(move || {
        studio.folder.file(&asked.photo)?;
        let new = ScaledPhoto {
            photo: &asked.photo,
            scale: asked.scale,
            asset: &asked.asset,
            class: &asked.class,
        };
        photo_list::save(&studio.folder, &new, asked.version.as_deref())?;
        Ok(Json(photo_list::read(&studio.folder, &asked.photo)?))
    })
    .await
}
