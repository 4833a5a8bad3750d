//! The page `mattes`: each photo of a list with its cut-out, and strokes to correct it.

mod entry;
mod layer;
mod review;
mod solve;

use crate::server::Page;
use crate::studio::Studio;
use axum::Router;
use axum::routing::{get, post};
use std::sync::Arc;

pub(crate) use solve::Mattes;

pub(crate) const PAGES: &[Page] = &[
    crate::page!("mattes.html"),
    crate::page!("mattes.js"),
    crate::page!("mattes_stage.js"),
];

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
        .route("/photos", get(entry::photos))
        .route("/review", get(review::read).post(review::save))
        .route("/solve", post(solve::solve))
        .route("/layer", get(layer::layer))
}
