//! The page `corners`.

use crate::server::Page;
use crate::studio::Studio;
use axum::Router;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("corners.html"), crate::page!("corners.js")];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Corners {}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
}
