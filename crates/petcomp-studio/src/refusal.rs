//! Errors as pages receive them: a status and one line.

use crate::message::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;

/// A rejected request, and the reason.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) status: StatusCode,
    pub(crate) what: String,
}

/// The result of a route.
pub(crate) type Answer<T> = Result<T, Refusal>;

impl Refusal {
    pub(crate) fn new(status: StatusCode, what: impl Into<String>) -> Self {
        let what = what.into();
        Self { status, what }
    }

    /// The caller is not allowed to do this.
    pub(crate) fn forbidden(what: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, what)
    }

    /// The file has changed since the page read it.
    pub(crate) fn stale(name: &str) -> Self {
        let what =
            format!("{name}: has changed since this page loaded it; reload it, or overwrite it");
        Self::new(StatusCode::CONFLICT, what)
    }

    /// A newer request of the same tab replaces this one.
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
