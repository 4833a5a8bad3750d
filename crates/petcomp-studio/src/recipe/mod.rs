//! The page `recipe`: every setting of a recipe, with an immediate preview of its pictures.

mod draft;
mod preview;

use crate::folder::Folder;
use crate::message::{Json, Query};
use crate::refusal::{Answer, Refusal};
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::{Tab, Turns, blocking};
use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use axum::routing::{get, post};
use draft::{Draft, Edits};
use petcomp::dataset::DatasetConfig;
use petcomp::dataset::settings::{SettingGroup, settings};
use petcomp::io::has_extension;
use preview::{PictureAsked, Pipelines};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[
    crate::page!("recipe.html"),
    crate::page!("recipe.js"),
    crate::page!("recipe_edits.js"),
];

/// What the page keeps between requests.
#[derive(Default)]
pub(crate) struct Recipe {
    turns: Turns,
    pipelines: Arc<Pipelines>,
}

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
        .route("/files", get(files))
        .route("/settings", get(told_settings))
        .route("/open", get(open))
        .route("/new", post(begin))
        .route("/draft", post(draft))
        .route("/save", post(save))
        .route("/picture", post(picture))
}

/// The recipes of the folder.
async fn files(State(studio): State<Arc<Studio>>) -> Answer<Json<Vec<String>>> {
    blocking(move || Ok(Json(studio.folder.find(is_recipe)))).await
}

/// Whether a document is accepted by `petcomp dataset generate`.
pub(crate) fn is_recipe(path: &Path) -> bool {
    has_extension(path, "toml") && DatasetConfig::read(path, &[]).is_ok()
}

/// Fails on a name that no page would list.
fn check_listed(file: &str) -> Answer<()> {
    let is_hidden = file.split('/').any(|part| part.starts_with('.'));
    if has_extension(Path::new(file), "toml") && !is_hidden {
        return Ok(());
    }
    let file = petcomp::printable(file);
    let what = format!("{file}: expected a name that ends in .toml and is not hidden");
    Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what))
}

/// Fails on the name of an existing file.
fn check_free(folder: &Folder, file: &str) -> Answer<()> {
    if folder.file(file).is_err() {
        return Ok(());
    }
    let file = petcomp::printable(file);
    let what = format!("{file}: already exists, expected a new name");
    Err(Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what))
}

async fn told_settings() -> Answer<Json<Vec<SettingGroup>>> {
    blocking(|| Ok(Json(settings()))).await
}

#[derive(Deserialize)]
struct FileName {
    file: String,
}

/// A recipe as stored in its file.
#[derive(Serialize)]
struct StoredRecipe {
    version: String,
    #[serde(flatten)]
    draft: Draft,
}

async fn open(
    State(studio): State<Arc<Studio>>,
    Query(FileName { file }): Query<FileName>,
) -> Answer<Json<StoredRecipe>> {
    blocking(move || {
        let read = studio.folder.read_text(&file)?;
        // Assets and photos may have changed by now.
        studio.recipe.pipelines.forget();
        let draft = Draft::of(&read.text, &studio.folder.file(&file)?)?;
        let version = read.version;
        Ok(Json(StoredRecipe { version, draft }))
    })
    .await
}

/// Creates a recipe from the template, which contains every setting.
async fn begin(
    State(studio): State<Arc<Studio>>,
    Json(FileName { file }): Json<FileName>,
) -> Answer<Json<String>> {
    blocking(move || {
        check_listed(&file)?;
        check_free(&studio.folder, &file)?;
        let saved = studio.folder.save(&file, DatasetConfig::template(), None);
        saved.map(Json)
    })
    .await
}

/// A recipe with unsaved edits.
#[derive(Deserialize)]
struct Edited {
    file: String,
    edits: Edits,
}

async fn draft(
    State(studio): State<Arc<Studio>>,
    Json(Edited { file, edits }): Json<Edited>,
) -> Answer<Json<Draft>> {
    blocking(move || {
        let text = edits.apply(&studio.folder.read_text(&file)?.text)?;
        Ok(Json(Draft::of(&text, &studio.folder.file(&file)?)?))
    })
    .await
}

#[derive(Deserialize)]
struct SaveRequest {
    #[serde(flatten)]
    edited: Edited,
    version: String,
}

async fn save(
    State(studio): State<Arc<Studio>>,
    Json(SaveRequest { edited, version }): Json<SaveRequest>,
) -> Answer<Json<String>> {
    blocking(move || {
        let Edited { file, edits } = edited;
        let text = edits.apply(&studio.folder.read_text(&file)?.text)?;
        Draft::of(&text, &studio.folder.file(&file)?)?;
        studio.folder.save(&file, &text, Some(&version)).map(Json)
    })
    .await
}

/// A picture of an edited recipe. For each slot of the page only the newest request counts.
async fn picture(
    State(studio): State<Arc<Studio>>,
    tab: Tab,
    Json(asked): Json<PictureAsked>,
) -> Answer<Response> {
    let turns = studio.recipe.turns.clone();
    let slot = tab.part(&asked.slot);
    turns
        .run(slot, move |turn| {
            let pipelines = studio.recipe.pipelines.clone();
            pipelines.picture(&studio.folder, &asked, turn)
        })
        .await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipe_begins_under_a_name_that_pages_list() {
        assert!(check_listed("a/b.toml").is_ok());
        for unseen in [".b.toml", "a/.b/c.toml", "a/cup9.png"] {
            assert!(check_listed(unseen).is_err(), "{unseen}");
        }
    }
}
