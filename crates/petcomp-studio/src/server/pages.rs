//! The files of the pages, which are part of the program.

use crate::refusal::Refusal;
use crate::studio::Studio;
use axum::Router;
use axum::http::header::CONTENT_TYPE;
use axum::http::{Method, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use std::sync::Arc;

/// A file of `pages/`.
#[derive(Clone, Copy)]
pub(crate) struct Page {
    pub(crate) name: &'static str,
    pub(crate) text: &'static str,
}

/// A file of `pages/` by its name.
#[macro_export]
#[doc(hidden)]
macro_rules! page {
    ($name:literal) => {
        $crate::server::Page {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/pages/", $name)),
        }
    };
}

impl Page {
    /// `/` for `index.html`, `/corners` for `corners.html`, `/studio.css` for `studio.css`.
    fn route(&self) -> String {
        match self.name.strip_suffix(".html") {
            Some("index") => "/".into(),
            Some(name) => format!("/{name}"),
            None => format!("/{}", self.name),
        }
    }

    fn content_type(&self) -> &'static str {
        match self.name.rsplit('.').next() {
            Some("html") => "text/html; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("svg") => "image/svg+xml",
            _ => "application/octet-stream",
        }
    }

    /// The file embedded in the program; in debug builds, the file on disk, for work on a page.
    #[cfg(not(debug_assertions))]
    fn content(&self) -> String {
        self.text.into()
    }

    #[cfg(debug_assertions)]
    fn content(&self) -> String {
        let pages = concat!(env!("CARGO_MANIFEST_DIR"), "/pages");
        let file = std::path::Path::new(pages).join(self.name);
        std::fs::read_to_string(file).unwrap_or_else(|_| self.text.into())
    }
}

/// The routes of the pages, below a path without a trailing slash.
pub(super) fn routes(below: &str, pages: &[Page]) -> Router<Arc<Studio>> {
    pages.iter().fold(Router::new(), |router, &page| {
        let path = format!("{below}{}", page.route());
        router.route(&path, get(move || async move { answer(page) }))
    })
}

fn answer(page: Page) -> Response {
    ([(CONTENT_TYPE, page.content_type())], page.content()).into_response()
}

pub(super) async fn not_found() -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, "no such page")
}

pub(super) async fn wrong_method(method: Method) -> Refusal {
    let what = format!("{method}: not allowed for this address");
    Refusal::new(StatusCode::METHOD_NOT_ALLOWED, what)
}
