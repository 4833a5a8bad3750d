//! The server: on this machine alone, for whoever knows its token alone.
//!
//! * It listens on 127.0.0.1, and every address has a token of 128 random bits in front
//!   (`http://127.0.0.1:PORT/TOKEN/corners`), so pages reach everything by relative addresses, and
//!   no cookie can be sent by somebody else's page.
//! * `guard` refuses requests without the token, for another host (DNS rebinding) and from another
//!   site's pages, and tells browsers to load nothing from elsewhere.
//! * `connections` bounds how many connections there are and how long one may say nothing.

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

/// The largest body of a request: strokes on a photo fit in it many times over.
const MAX_BODY_BYTES: usize = 16 << 20;
/// How long requests in hand may still take after the server was stopped.
const GRACE_PERIOD: Duration = Duration::from_secs(2);

/// Pages about a folder, at an address of this machine.
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
    /// Ends [`Server::run`] soon.
    pub fn stop(&self) {
        self.0.notify_one();
    }
}

impl Server {
    /// Listens on a port of 127.0.0.1; 0 is any free one.
    ///
    /// # Errors
    /// [`Error::File`] where there is no such folder; [`Error::Value`] for a port that is taken.
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

    /// Where the pages are, token included.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// What stops the server.
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
