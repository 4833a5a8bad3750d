//! The page `recipe`.

use crate::server::Page;
use crate::studio::Studio;
use axum::Router;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("recipe.html"), crate::page!("recipe.js")];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Recipe {}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
}
