//! Messages between pages and routes: JSON, and URL queries.
//!
//! They replace axum's extractors, which add half a megabyte of code to report where in a message
//! an error is: the pages are our own, and serde reports line and column.

use crate::refusal::Refusal;
use axum::body::Bytes;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::header::CONTENT_TYPE;
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::time::Duration;

const JSON: &str = "application/json";

/// Maximum idle time of a connection without a request, or with an incomplete one.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// The body of a request or an answer.
pub(crate) struct Json<T>(pub(crate) T);

/// The query of a URL.
pub(crate) struct Query<T>(pub(crate) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for Json<T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, state: &S) -> Result<Self, Refusal> {
        if !is_json(request.headers()) {
            let what = format!("expected a body of {JSON}");
            return Err(Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, what));
        }
        let body = tokio::time::timeout(PATIENCE, Bytes::from_request(request, state)).await;
        let body = body.map_err(|_| stalled())?;
        let body = body.map_err(|e| Refusal::new(e.status(), e.body_text()))?;
        let value = serde_json::from_slice(&body).map_err(|e| unreadable(&e))?;
        Ok(Self(value))
    }
}

impl<T: Serialize> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        match serde_json::to_vec(&self.0) {
            Ok(body) => ([(CONTENT_TYPE, JSON)], body).into_response(),
            Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
        }
    }
}

impl<T: DeserializeOwned, S: Sync> FromRequestParts<S> for Query<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        let query = parts.uri.query().unwrap_or_default();
        let value = serde_urlencoded::from_str(query);
        value.map(Self).map_err(|e| unreadable(&e))
    }
}

/// A page of another site cannot send this type without a preflight request.
fn is_json(headers: &HeaderMap) -> bool {
    let told = headers
        .get(CONTENT_TYPE)
        .and_then(|told| told.to_str().ok());
    let essence = told.and_then(|told| told.split(';').next());
    essence.is_some_and(|essence| essence.trim().eq_ignore_ascii_case(JSON))
}

fn stalled() -> Refusal {
    let what = format!(
        "the request body did not arrive within {} s",
        PATIENCE.as_secs()
    );
    Refusal::new(StatusCode::REQUEST_TIMEOUT, what)
}

fn unreadable(error: &dyn std::error::Error) -> Refusal {
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
}
