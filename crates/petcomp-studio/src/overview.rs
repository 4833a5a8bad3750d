//! The first page: the contents of the folder, and what each page can do with them.

use crate::message::Json;
use crate::photos::photos;
use crate::recipe::is_recipe;
use crate::refusal::Answer;
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::Router;
use axum::extract::State;
use axum::routing::get;
use petcomp::asset;
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

/// The contents of the folder, names with slashes.
#[derive(Serialize)]
struct Overview {
    folder: String,
    photos: Vec<String>,
    labels: Vec<String>,
    cameras: Vec<String>,
    /// Manifests of folders of assets.
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

impl Overview {
    fn of(studio: &Studio) -> Self {
        let files = studio.folder.find(|_| true);
        let those = |are: &dyn Fn(&str) -> bool| {
            let found = files.iter().filter(|file| are(file));
            found.cloned().collect::<Vec<_>>()
        };
        let ending = |end: &str| those(&|file| file.ends_with(end));
        let called = |name: &str| those(&|file| Path::new(file).ends_with(name));
        Self {
            folder: studio.folder.name(),
            photos: photos(&studio.folder),
            labels: ending(".label.json"),
            cameras: ending(".camera.json"),
            assets: called(asset::MANIFEST),
            recipes: studio.folder.find(is_recipe),
            photo_lists: [called("photos.toml"), called("photos.csv")].concat(),
            datasets: called("data.yaml"),
        }
    }
}
