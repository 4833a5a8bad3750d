//! The first page: what is in the folder, and what each page can do with it.

use crate::message::Json;
use crate::picture::may_be_photo;
use crate::refusal::Answer;
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::Router;
use axum::extract::State;
use axum::routing::get;
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
    /// Lists of photos of objects.
    photo_lists: Vec<String>,
    /// `data.yaml` of datasets.
    datasets: Vec<String>,
}

async fn overview(State(studio): State<Arc<Studio>>) -> Answer<Json<Overview>> {
    blocking(move || Ok(Json(Overview::of(&studio)))).await
}

/// The TOML documents that name backgrounds, as every recipe does.
fn recipes(studio: &Studio) -> Vec<String> {
    let documents = studio
        .folder
        .find(|path| path.extension().is_some_and(|e| e == "toml"));
    let is_recipe = |name: &String| {
        let text = studio.folder.read_text(name).ok();
        let table = text.and_then(|file| file.text.parse::<toml::Table>().ok());
        table.is_some_and(|table| table.contains_key("backgrounds"))
    };
    documents.into_iter().filter(is_recipe).collect()
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
            recipes: recipes(studio),
            photo_lists: [named("/photos.toml"), named("/photos.csv")].concat(),
            datasets: named("/data.yaml"),
        }
    }
}
