//! The server: only on this machine, and only for clients that know its token.
//!
//! * It listens on 127.0.0.1, and the path of every URL begins with a token of 128 random bits
//!   (`http://127.0.0.1:PORT/TOKEN/corners`), so pages use relative URLs, and there is no cookie
//!   that another site's page could send.
//! * `guard` rejects requests without the token, for another host (DNS rebinding) and from another
//!   site's pages, and forbids browsers to load anything from elsewhere.
//! * `connections` limits the number of connections and their idle time.

mod connections;
mod guard;
mod pages;
mod token;

pub(crate) use pages::Page;

use crate::folder::Folder;
use crate::studio::Studio;
use crate::{capture, corners, dataset, mattes, overview, picture, recipe, scale};
use axum::Router;
use axum::extract::DefaultBodyLimit;
use guard::Guard;
use petcomp::{Error, Result};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use token::Token;
use tokio::runtime::Runtime;
use tokio::sync::Notify;

/// Maximum size of a request's body: many times that of strokes on a photo.
const MAX_BODY_BYTES: usize = 16 << 20;
/// Time that pending requests may still take after the server was stopped.
const GRACE_PERIOD: Duration = Duration::from_secs(2);

/// Serves pages about a folder, at a URL of this machine.
pub struct Server {
    runtime: Runtime,
    listener: tokio::net::TcpListener,
    address: SocketAddr,
    token: Token,
    studio: Arc<Studio>,
    stop: Arc<Notify>,
}

/// Stops a running [`Server`], from any thread.
#[derive(Clone)]
pub struct Stop(Arc<Notify>);

impl Stop {
    /// Makes [`Server::run`] return soon.
    pub fn stop(&self) {
        self.0.notify_one();
    }
}

impl Server {
    /// Listens on a port of 127.0.0.1; 0 means any free one.
    ///
    /// # Errors
    /// [`Error::File`] if there is no such folder; [`Error::Value`] for a port that is in use.
    pub fn open(folder: &Path, port: u16) -> Result<Self> {
        let folder = Folder::open(folder)?;
        let runtime = Runtime::new().map_err(|e| Error::value("studio", e))?;
        let listener = runtime
            .block_on(tokio::net::TcpListener::bind((Ipv4Addr::LOCALHOST, port)))
            .map_err(|e| Error::value("port", format!("{port}: {e}, expected a free one")))?;
        let address = listener.local_addr().map_err(|e| Error::value("port", e))?;
        Ok(Self {
            runtime,
            listener,
            address,
            token: Token::random()?,
            studio: Arc::new(Studio::new(folder)),
            stop: Arc::default(),
        })
    }

    /// The URL of the pages, including the token.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// A handle that stops the server.
    pub fn stop(&self) -> Stop {
        Stop(self.stop.clone())
    }

    /// Answers requests until it is stopped.
    pub fn run(self) {
        let app = app(self.studio, self.token, self.address.port());
        let serving = connections::serve(self.listener, app);
        self.runtime.block_on(async {
            tokio::select! {
                () = serving => {}
                () = self.stop.notified() => {}
            }
        });
        self.runtime.shutdown_timeout(GRACE_PERIOD);
    }
}

/// Every page and route, below the token and behind the guard.
fn app(studio: Arc<Studio>, token: Token, port: u16) -> Router {
    let below = format!("/{token}");
    let guard = Arc::new(Guard::new(token, port));
    pages::routes(&below, &all_pages())
        .nest(&format!("{below}/api"), rooms())
        .fallback(pages::not_found)
        .method_not_allowed_fallback(pages::wrong_method)
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES))
        .layer(axum::middleware::from_fn_with_state(guard, guard::check))
        .with_state(studio)
}

fn all_pages() -> Vec<Page> {
    [
        overview::PAGES,
        corners::PAGES,
        scale::PAGES,
        capture::PAGES,
        mattes::PAGES,
        recipe::PAGES,
        dataset::PAGES,
    ]
    .concat()
}

fn rooms() -> Router<Arc<Studio>> {
    Router::new()
        .merge(overview::routes())
        .merge(picture::routes())
        .nest("/corners", corners::routes())
        .nest("/scale", scale::routes())
        .nest("/capture", capture::routes())
        .nest("/mattes", mattes::routes())
        .nest("/recipe", recipe::routes())
        .nest("/dataset", dataset::routes())
}
