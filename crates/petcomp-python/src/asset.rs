//! Cut-outs with real size and class, kept in a folder.

use crate::document::text;
use crate::lock::locked;
use crate::work::{self, Stop};
use petcomp::Result;
use petcomp::asset::{self, Built, Manifest};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// Cuts out all photos of a list, or only the missing ones; returns the results as JSON.
#[pyfunction]
#[pyo3(signature = (list, folder, progress, resume))]
pub(crate) fn build_assets(
    py: Python<'_>,
    list: PathBuf,
    folder: PathBuf,
    progress: Option<Py<PyAny>>,
    resume: bool,
) -> PyResult<String> {
    let steps: Arc<Mutex<Vec<(usize, usize)>>> = Arc::default();
    let own = steps.clone();
    let mut deliver = |py: Python<'_>| {
        let steps = std::mem::take(&mut *locked(&steps));
        let Some(callable) = &progress else {
            return Ok(());
        };
        steps
            .into_iter()
            .try_for_each(|step| callable.call1(py, step).map(drop))
    };
    work::run_beside(py, Stop::new(), &mut deliver, move |stop| {
        let report = |done, total| locked(&own).push((done, total));
        built_json(&match resume {
            true => asset::resume(list, folder, &report, stop)?,
            false => asset::build(list, folder, &report, stop)?,
        })
    })
}

fn built_json(built: &Built) -> Result<String> {
    text(&serde_json::json!({
        "photos": built.photos,
        "kept": built.kept,
        "lengths": built.lengths,
        "refused": built.refused,
        "rejected": built.rejected,
        "unlisted": built.unlisted,
        "needs_review": built.needs_review,
        "classes": built.library.classes,
        "assets": built.library.assets.iter().map(|asset| &asset.name).collect::<Vec<_>>(),
    }))
}

/// Whether every format of labels can hold a class's name, as in photo lists.
#[pyfunction]
pub(crate) fn is_class_name(name: &str) -> bool {
    asset::is_class_name(name)
}

/// The manifest of an asset folder.
#[pyfunction]
pub(crate) fn list_assets(py: Python<'_>, folder: PathBuf) -> PyResult<String> {
    work::run(py, move || text(&Manifest::read(folder)?))
}
