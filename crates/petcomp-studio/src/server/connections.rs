//! Connections: limited in number and in idle time.

use crate::message::PATIENCE;
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

/// Maximum number of simultaneous connections: a browser opens six.
const MAX_CONNECTIONS: usize = 256;
/// A pause after the system refused a connection (too many open files).
const PAUSE: Duration = Duration::from_millis(50);

/// Serves every connection, and never ends.
pub(super) async fn serve(listener: TcpListener, app: Router) {
    let permits = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok(permit) = permits.clone().acquire_owned().await else {
            return;
        };
        match listener.accept().await {
            Ok((stream, _)) => {
                let app = app.clone();
                tokio::spawn(async move {
                    answer(stream, app).await;
                    drop(permit);
                });
            }
            Err(error) => {
                log::debug!("a connection was not accepted: {error}");
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

/// Answers the requests of a connection, one after another.
async fn answer(stream: TcpStream, app: Router) {
    let mut server = http1::Builder::new();
    server
        .timer(TokioTimer::new())
        .header_read_timeout(PATIENCE);
    let service = TowerToHyperService::new(app);
    if let Err(error) = server.serve_connection(TokioIo::new(stream), service).await {
        log::debug!("a connection ended: {error}");
    }
}
