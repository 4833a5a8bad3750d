//! The first page: what is in the folder, and what each page can do with it.

use crate::picture::may_be_photo;
use crate::refusal::Answer;
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::extract::State;
use axum::routing::get;
use axum::{Json, Router};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[
    crate::page!("index.html"),
    crate::page!("index.js"),
    crate::page!("studio.css"),
    crate::page!("studio.js"),
    crate::page!("favicon.svg"),
];

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new().route("/overview", get(overview))
}

/// What was found in the folder, names with slashes.
#[derive(Serialize)]
struct Overview {
    folder: String,
    photos: Vec<String>,
    labels: Vec<String>,
    cameras: Vec<String>,
    /// `manifest.json` of folders of assets.
    assets: Vec<String>,
    recipes: Vec<String>,
    /// `data.yaml` of datasets.
    datasets: Vec<String>,
}

async fn overview(State(studio): State<Arc<Studio>>) -> Answer<Json<Overview>> {
    blocking(move || Ok(Json(Overview::of(&studio)))).await
}

impl Overview {
    fn of(studio: &Studio) -> Self {
        let named = |ending: &str| {
            let ends = |path: &Path| path.to_string_lossy().ends_with(ending);
            studio.folder.find(ends)
        };
        Self {
            folder: studio.folder.name(),
            photos: studio.folder.find(may_be_photo),
            labels: named(".label.json"),
            cameras: named(".camera.json"),
            assets: named("/manifest.json"),
            recipes: named(".toml"),
            datasets: named("/data.yaml"),
        }
    }
}
