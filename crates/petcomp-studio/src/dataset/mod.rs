//! The page `dataset`.

use crate::server::Page;
use crate::studio::Studio;
use axum::Router;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("dataset.html"), crate::page!("dataset.js")];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Dataset {}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
}
