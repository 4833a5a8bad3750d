//! The page `capture`: the frames that a luminous display shows below an object, on this machine's
//! own display or in a folder for another one.

use crate::message::{Json, Query};
use crate::refusal::Answer;
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::Router;
use axum::extract::State;
use axum::http::header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use petcomp::capture::{Display, write_frames};
use petcomp::{Error, io};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("capture.html"), crate::page!("capture.js")];

/// Folder for the frames of another display.
const FOLDER: &str = "capture";

/// Content security policy of the page that shows frames, which contains its style, script and
/// pictures. The sandbox isolates it from everything else: to the studio it is another site's page.
const ALONE: &str = "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; \
     style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
        .route("/show", get(show))
        .route("/write", post(write))
}

/// A display, and what it should show.
#[derive(Deserialize)]
struct FrameRequest {
    width_px: u32,
    height_px: u32,
    /// Metres.
    width: Option<f64>,
    #[serde(default)]
    stripes: bool,
}

impl FrameRequest {
    fn display(&self) -> Display {
        Display {
            size_px: [self.width_px, self.height_px],
            width: self.width,
        }
    }
}

/// Returns the page that shows the frames full screen.
async fn show(Query(asked): Query<FrameRequest>) -> Answer<Response> {
    let page = blocking(move || {
        let folder = tempfile::tempdir().map_err(|e| Error::value("capture", e))?;
        let page = write_frames(folder.path(), &asked.display(), asked.stripes)?;
        Ok(io::read_text(page)?)
    })
    .await?;
    let headers = [
        (CONTENT_TYPE, "text/html; charset=utf-8"),
        (CONTENT_SECURITY_POLICY, ALONE),
    ];
    Ok((headers, page).into_response())
}

/// The written files.
#[derive(Serialize)]
struct WrittenFrames {
    page: String,
}

async fn write(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<FrameRequest>,
) -> Answer<Json<WrittenFrames>> {
    blocking(move || {
        let folder = studio.folder.place(FOLDER)?;
        if folder.exists() {
            // Fails if a link leads outside the studio's folder.
            studio.folder.folder(FOLDER)?;
        }
        let page = write_frames(&folder, &asked.display(), asked.stripes)?;
        let page = studio.folder.name_of(&page);
        Ok(Json(WrittenFrames { page }))
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_of_the_page_names_the_display_that_is_written() {
        let display = format!("--display {FOLDER}/display.toml");
        assert!(include_str!("../pages/capture.html").contains(&display));
    }
}
