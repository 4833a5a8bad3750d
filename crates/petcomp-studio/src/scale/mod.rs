//! The page `scale`.

use crate::server::Page;
use crate::studio::Studio;
use axum::Router;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("scale.html"), crate::page!("scale.js")];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Scale {}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
}
