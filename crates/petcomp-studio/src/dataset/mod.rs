//! The page `dataset`: its pictures and what is known about them, in any number.
//!
//! A folder is listed when it is opened; a picture's record is read when somebody looks at the
//! picture or asks for something that needs the records of all pictures.

mod catalog;
mod filter;
mod sample;

use crate::folder::Folder;
use crate::message::{Json, Query};
use crate::photos::parent_of;
use crate::picture::{may_be_photo, shown};
use crate::refusal::{Answer, Refusal};
use crate::server::Page;
use crate::studio::Studio;
use crate::turn::blocking;
use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::CACHE_CONTROL;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
pub(crate) use catalog::Catalogs;
use catalog::{Catalog, Row};
use filter::{Filter, Order};
use sample::SampleShown;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(crate) const PAGES: &[Page] = &[crate::page!("dataset.html"), crate::page!("dataset.js")];

/// Maximum number of rows in an answer: more than fit on any screen.
const MAX_ROWS: usize = 500;

pub(crate) fn routes() -> Router<Arc<Studio>> {
    Router::new()
        .route("/folders", get(folders))
        .route("/open", get(open))
        .route("/find", post(find))
        .route("/rows", post(rows))
        .route("/sample", get(sample))
        .route("/picture", get(picture))
}

/// Folders to open: datasets, and folders with images outside of them.
async fn folders(State(studio): State<Arc<Studio>>) -> Answer<Json<Vec<String>>> {
    blocking(move || Ok(Json(folders_of(&studio.folder)))).await
}

fn folders_of(folder: &Folder) -> Vec<String> {
    let is_list = |path: &Path| path.ends_with("data.yaml");
    let datasets = parents(&folder.find(is_list));
    let mut folders: Vec<String> = datasets.iter().cloned().collect();
    let images = parents(&folder.find(may_be_photo)).into_iter();
    folders.extend(images.filter(|name| !datasets.iter().any(|dataset| is_within(name, dataset))));
    folders
}

/// The folders that contain files.
fn parents(files: &[String]) -> BTreeSet<String> {
    let folders = files.iter().map(|file| parent_of(file));
    folders.map(str::to_owned).collect()
}

/// Whether a folder is the same as another one or below it.
fn is_within(name: &str, outer: &str) -> bool {
    let rest = name.strip_prefix(outer);
    outer.is_empty() || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

#[derive(Deserialize)]
struct FolderName {
    folder: String,
}

/// A folder when it was listed.
#[derive(Serialize)]
struct ListedFolder {
    /// Distinguishes its rows from those of other listings.
    listing: u64,
    count: usize,
    classes: Vec<String>,
    /// Whether petcomp generated it, with a record of everything.
    has_records: bool,
}

async fn open(
    State(studio): State<Arc<Studio>>,
    Query(FolderName { folder }): Query<FolderName>,
) -> Answer<Json<ListedFolder>> {
    blocking(move || {
        let catalog = studio.dataset.open(&studio.folder, &folder)?;
        let index = &catalog.index;
        Ok(Json(ListedFolder {
            listing: catalog.listing,
            count: index.pictures.len(),
            classes: index.classes.clone(),
            has_records: index
                .pictures
                .iter()
                .any(|picture| picture.written.is_some()),
        }))
    })
    .await
}

impl Studio {
    /// One of a folder's listings.
    fn catalog(&self, folder: &str, listing: Option<u64>) -> Answer<Arc<Catalog>> {
        self.dataset.get(&self.folder, folder, listing)
    }
}

#[derive(Deserialize)]
struct RowSearch {
    folder: String,
    /// Number of one of its listings; by default the most recently used one.
    listing: Option<u64>,
    filter: Filter,
    order: Order,
}

/// The selected pictures, as far as known.
#[derive(Serialize)]
struct FoundRows {
    rows: Vec<usize>,
    /// Why a picture is unlike the others, in the order of the rows.
    why: Vec<String>,
    /// Photos of the place seen so far.
    backgrounds: BTreeSet<String>,
    /// Number of pictures read and number to read; once they are equal, the rows are final.
    read: usize,
    of: usize,
}

async fn find(
    State(studio): State<Arc<Studio>>,
    Json(wanted): Json<RowSearch>,
) -> Answer<Json<FoundRows>> {
    blocking(move || {
        let catalog = studio.catalog(&wanted.folder, wanted.listing)?;
        let index = &catalog.index;
        let must_read = wanted.filter.needs_facts(index) || wanted.order.needs_facts(index);
        if must_read {
            catalog.read_in_background();
        }
        let (rows, why) = filter::found(&catalog, &wanted.filter, wanted.order);
        let of = if must_read { index.pictures.len() } else { 0 };
        Ok(Json(FoundRows {
            rows,
            why,
            backgrounds: catalog.backgrounds(),
            read: catalog.read_count().min(of),
            of,
        }))
    })
    .await
}

#[derive(Deserialize)]
struct SomeRows {
    folder: String,
    listing: Option<u64>,
    rows: Vec<usize>,
}

async fn rows(
    State(studio): State<Arc<Studio>>,
    Json(asked): Json<SomeRows>,
) -> Answer<Json<Vec<Row>>> {
    blocking(move || {
        let catalog = studio.catalog(&asked.folder, asked.listing)?;
        let rows = asked.rows.into_iter().take(MAX_ROWS);
        let rows: Answer<_> = rows.map(|row| catalog.row(row)).collect();
        rows.map(Json)
    })
    .await
}

#[derive(Deserialize)]
struct OneRow {
    folder: String,
    listing: Option<u64>,
    row: usize,
    /// Longer side of a small picture, pixels; by default the full size.
    side: Option<usize>,
}

async fn sample(
    State(studio): State<Arc<Studio>>,
    Query(asked): Query<OneRow>,
) -> Answer<Json<SampleShown>> {
    blocking(move || {
        let catalog = studio.catalog(&asked.folder, asked.listing)?;
        picture_file(&studio.folder, &catalog, asked.row)?;
        SampleShown::of(&catalog.index, asked.row).map(Json)
    })
    .await
}

async fn picture(
    State(studio): State<Arc<Studio>>,
    Query(asked): Query<OneRow>,
) -> Answer<Response> {
    let here = studio.clone();
    let decoded = studio.decode(move || {
        let catalog = here.catalog(&asked.folder, asked.listing)?;
        shown(
            &picture_file(&here.folder, &catalog, asked.row)?,
            asked.side,
        )
    });
    let response = decoded.await?;
    Ok(([(CACHE_CONTROL, "private, max-age=300")], response).into_response())
}

/// The file of a picture; a list may name one anywhere.
fn picture_file(folder: &Folder, catalog: &Catalog, row: usize) -> Answer<PathBuf> {
    let file = catalog.index.file(catalog.checked(row)?)?;
    if folder.holds(&file) {
        return Ok(file);
    }
    Err(outside(catalog))
}

fn outside(catalog: &Catalog) -> Refusal {
    let folder = petcomp::printable(&catalog.index.folder.to_string_lossy());
    let what = format!("{folder}: lists a picture outside this studio's folder");
    Refusal::new(StatusCode::NOT_FOUND, what)
}
