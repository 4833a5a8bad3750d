//! The page `corners`: four clicks on a photo become a label, and its camera is shown immediately.

mod joint;
mod label_file;
mod photos;
mod view;

use crate::message::{Json, Query};
use crate::refusal::Answer;
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::{Tab, Turns, blocking};
use axum::Router;
use axum::extract::State;
use axum::routing::{get, post};
use joint::JointPhoto;
use label_file::{LabelFile, SavedLabel};
use petcomp::camera::{self, Label, Marker, SnappedCorners};
use petcomp::{Image, LinearRgb, io};
use photos::PhotoProgress;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;
use view::CameraSummary;

pub(crate) const PAGES: &[Page] = &[
    crate::page!("corners.html"),
    crate::page!("corners.js"),
    crate::page!("photo_list.js"),
    crate::page!("photo_view.js"),
];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Corners {
    solving: Turns,
    photo: PhotoCache,
}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
        .route("/photos", get(list_photos))
        .route("/label", get(read_label))
        .route("/solve", post(solve))
        .route("/snap", post(snap))
        .route("/markers", post(find_markers))
        .route("/save", post(save))
        .route("/joint", post(solve_together))
}

async fn list_photos(State(studio): State<Arc<Studio>>) -> Answer<Json<Vec<PhotoProgress>>> {
    blocking(move || Ok(Json(photos::list(&studio.folder)))).await
}

#[derive(Deserialize)]
struct LabelQuery {
    photo: String,
    /// Another photo of the same rectangle, from whose label size, markers and camera are copied.
    like: Option<String>,
}

async fn read_label(
    State(studio): State<Arc<Studio>>,
    Query(query): Query<LabelQuery>,
) -> Answer<Json<LabelFile>> {
    blocking(move || {
        let file = label_file::read(&studio.folder, &query.photo, query.like.as_deref())?;
        Ok(Json(file))
    })
    .await
}

#[derive(Deserialize)]
struct PhotoLabel {
    photo: String,
    label: Label,
}

async fn solve(
    State(studio): State<Arc<Studio>>,
    tab: Tab,
    Json(asked): Json<PhotoLabel>,
) -> Answer<Json<CameraSummary>> {
    let turns = studio.corners.solving.clone();
    turns
        .run(tab, move |_| {
            let path = label_file::path(&studio.folder, &asked.photo)?;
            let label = camera::with_photo(asked.label, path)?;
            Ok(Json(CameraSummary::of(&label)?))
        })
        .await
}

#[derive(Deserialize)]
struct RoughCorners {
    photo: String,
    corners_px: [[f64; 2]; 4],
}

async fn snap(
    State(studio): State<Arc<Studio>>,
    Json(rough): Json<RoughCorners>,
) -> Answer<Json<SnappedCorners>> {
    blocking(move || {
        let photo = studio.photo(&rough.photo)?;
        Ok(Json(camera::snap_corners(&photo, rough.corners_px)))
    })
    .await
}

/// Markers in a photo, and the label with their corners if it contains their positions.
#[derive(Serialize)]
struct FoundMarkers {
    markers: Vec<FoundMarker>,
    label: Option<Label>,
}

#[derive(Serialize)]
struct FoundMarker {
    id: u32,
    corners_px: [[f64; 2]; 4],
}

impl From<&Marker> for FoundMarker {
    fn from(marker: &Marker) -> Self {
        Self {
            id: marker.id,
            corners_px: marker.corners_px.map(Into::into),
        }
    }
}

async fn find_markers(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<PhotoLabel>,
) -> Answer<Json<FoundMarkers>> {
    blocking(move || {
        let photo = studio.photo(&asked.photo)?;
        let markers = camera::any_markers(&photo);
        let label = asked.label.markers.is_some() && !markers.is_empty();
        let label = label.then(|| camera::with_markers(asked.label, &photo));
        Ok(Json(FoundMarkers {
            markers: markers.iter().map(Into::into).collect(),
            label: label.transpose()?,
        }))
    })
    .await
}

#[derive(Deserialize)]
struct NewLabel {
    photo: String,
    label: Label,
    /// Version of the file that the page read; none if there was no file.
    version: Option<String>,
}

async fn save(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<NewLabel>,
) -> Answer<Json<SavedLabel>> {
    blocking(move || {
        let (photo, version) = (&asked.photo, asked.version.as_deref());
        let saved = label_file::save(&studio.folder, photo, asked.label, version)?;
        Ok(Json(saved))
    })
    .await
}

#[derive(Deserialize)]
struct Together {
    photos: Vec<String>,
}

async fn solve_together(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<Together>,
) -> Answer<Json<Vec<JointPhoto>>> {
    blocking(move || Ok(Json(joint::solve(&studio.folder, &asked.photos)?))).await
}

impl Studio {
    /// A photo of the folder; the most recent one is read again only if its file has changed.
    pub(crate) fn photo(&self, name: &str) -> Answer<Arc<Image<LinearRgb>>> {
        let path = self.folder.file(name)?;
        Ok(self.corners.photo.read(&path)?)
    }
}

/// The most recently read photo: users work on one for a while.
#[derive(Default)]
struct PhotoCache(Mutex<Option<CachedPhoto>>);

struct CachedPhoto {
    path: PathBuf,
    modified: Option<SystemTime>,
    photo: Arc<Image<LinearRgb>>,
}

impl PhotoCache {
    fn read(&self, path: &Path) -> petcomp::Result<Arc<Image<LinearRgb>>> {
        let modified = std::fs::metadata(path)
            .and_then(|meta| meta.modified())
            .ok();
        let mut cached = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(last) = cached.as_ref()
            && last.path == path
            && last.modified == modified
        {
            return Ok(last.photo.clone());
        }
        let photo = Arc::new(io::read(path)?);
        *cached = Some(CachedPhoto {
            path: path.into(),
            modified,
            photo: Arc::clone(&photo),
        });
        Ok(photo)
    }
}
