//! Access control, and the security headers of answers.

use super::token::Token;
use crate::refusal::{Answer, Refusal};
use axum::extract::{Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, HOST, HeaderName, HeaderValue, ORIGIN, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, Method, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Pages load only their own files, and connect only to their own server; no text becomes markup.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
     img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; \
     frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types 'none'";

/// Headers of every answer.
const HEADERS: [(HeaderName, &str); 5] = [
    (CONTENT_SECURITY_POLICY, POLICY),
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (REFERRER_POLICY, "no-referrer"),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
];

/// What a request must match.
pub(super) struct Guard {
    token: Token,
    /// `127.0.0.1:PORT` and `localhost:PORT`.
    hosts: [String; 2],
}

impl Guard {
    pub(super) fn new(token: Token, port: u16) -> Self {
        let hosts = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{port}"));
        Self { token, hosts }
    }

    fn admit(&self, request: &Request) -> Answer<()> {
        let headers = request.headers();
        self.check_host(headers)?;
        self.check_origin(headers)?;
        check_site(request.method(), headers)?;
        self.check_token(request.uri())
    }

    /// Any other name for this machine may be another site's: DNS rebinding.
    fn check_host(&self, headers: &HeaderMap) -> Answer<()> {
        match text(headers, HOST) {
            Some(host) if self.hosts.iter().any(|known| known == host) => Ok(()),
            _ => Err(Refusal::forbidden(format!(
                "host: not this studio, expected {}",
                self.hosts[0]
            ))),
        }
    }

    fn check_origin(&self, headers: &HeaderMap) -> Answer<()> {
        if !headers.contains_key(ORIGIN) {
            return Ok(());
        }
        let host = text(headers, ORIGIN).and_then(|origin| origin.strip_prefix("http://"));
        match host {
            Some(host) if self.hosts.iter().any(|known| known == host) => Ok(()),
            _ => Err(Refusal::forbidden("origin: a page of another site")),
        }
    }

    fn check_token(&self, uri: &Uri) -> Answer<()> {
        let first = uri.path().split('/').nth(1).unwrap_or_default();
        if self.token.is(first) {
            Ok(())
        } else {
            let what = "no token: open the full address that `petcomp studio` printed";
            Err(Refusal::forbidden(what))
        }
    }
}

/// Other sites may only navigate here, as a link does.
fn check_site(method: &Method, headers: &HeaderMap) -> Answer<()> {
    let site = text(headers, HeaderName::from_static("sec-fetch-site"));
    let mode = text(headers, HeaderName::from_static("sec-fetch-mode"));
    match site {
        None | Some("same-origin" | "none") => Ok(()),
        _ if method == Method::GET && mode == Some("navigate") => Ok(()),
        _ => Err(Refusal::forbidden("request from another site's page")),
    }
}

fn text(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

/// Rejects requests that are not allowed, and adds [`HEADERS`] to every answer.
pub(super) async fn check(
    State(guard): State<Arc<Guard>>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match guard.admit(&request) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        // A sandboxed page sends a policy of its own.
        headers
            .entry(name)
            .or_insert(HeaderValue::from_static(value));
    }
    headers
        .entry(CACHE_CONTROL)
        .or_insert(HeaderValue::from_static("no-store"));
    response
}
