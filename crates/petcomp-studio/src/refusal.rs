//! What a page is told when something cannot be done: a status, and one line.

use crate::message::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;

/// A request that is refused, and why.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) status: StatusCode,
    pub(crate) what: String,
}

/// What a route answers.
pub(crate) type Answer<T> = Result<T, Refusal>;

impl Refusal {
    pub(crate) fn new(status: StatusCode, what: impl Into<String>) -> Self {
        let what = what.into();
        Self { status, what }
    }

    /// Not for this caller.
    pub(crate) fn forbidden(what: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, what)
    }

    /// The file is another one by now than the page has read.
    pub(crate) fn stale(name: &str) -> Self {
        let what =
            format!("{name}: has changed since this page loaded it; reload it, or overwrite it");
        Self::new(StatusCode::CONFLICT, what)
    }

    /// A newer request of the same tab takes its place.
    pub(crate) fn superseded() -> Self {
        Self::new(StatusCode::GONE, "superseded by a newer request")
    }
}

impl From<petcomp::Error> for Refusal {
    fn from(error: petcomp::Error) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, Json(json!({ "error": self.what }))).into_response()
    }
}
