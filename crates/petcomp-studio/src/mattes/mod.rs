//! The page `mattes`.

use crate::server::Page;
use crate::studio::Studio;
use axum::Router;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("mattes.html"), crate::page!("mattes.js")];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Mattes {}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
}
