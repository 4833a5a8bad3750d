//! The pipeline: recipe and number in, labelled picture out.

use crate::document::{parse, text};
use crate::errors::{closed, to_python};
use crate::lock::locked;
use crate::sample::{PictureFile, Policy, Sample};
use crate::scene::scene_of;
use crate::work::{self, Stop};
use petcomp::dataset::{self, DatasetConfig};
use petcomp::io::Override;
use petcomp::{Quality, Result, Scene};
use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// An opened recipe, from which samples are generated.
#[pyclass(frozen, module = "petcomp._petcomp")]
pub(crate) struct Pipeline {
    /// None once it is closed.
    opened: Mutex<Option<Opened>>,
}

/// What jobs share.
#[derive(Clone)]
pub(crate) struct Opened {
    pub(crate) pipeline: Arc<dataset::Pipeline>,
    policy: Policy,
    /// The process that it is used in.
    process: u32,
}

/// The recipe of a file, or of a document, whose environment maps are named from the folder `path`.
/// Values to be changed are those of the quality, then its own.
fn config_of(
    path: PathBuf,
    json: Option<&str>,
    overrides: &[String],
    quality: Option<&str>,
) -> Result<DatasetConfig> {
    let named: Result<Vec<Override>> = overrides.iter().map(|o| o.parse()).collect();
    let quality = quality.map(str::parse::<Quality>).transpose()?;
    let overrides = Quality::overrides_at(quality, named?);
    match json {
        None => DatasetConfig::read(&path, &overrides),
        Some(json) => Ok(DatasetConfig {
            folder: path,
            ..DatasetConfig::from_table(parse("recipe", json)?, &overrides)?
        }),
    }
}

impl Opened {
    fn new(config: DatasetConfig) -> Result<Self> {
        let pipeline = dataset::Pipeline::open(config)?;
        let labels = &pipeline.config().labels;
        let policy = Policy {
            classes: labels.obstructed.classes(&pipeline.library().classes)?,
            obstructed: labels.obstructed,
            extent: labels.extent(),
        };
        Ok(Self {
            pipeline: Arc::new(pipeline),
            policy,
            process: std::process::id(),
        })
    }

    /// Whether this process was forked while jobs used it: what they had locked or begun would be
    /// waited for forever, since a fork has none of their threads.
    fn was_forked_in_use(&self) -> bool {
        self.process != std::process::id() && Arc::strong_count(&self.pipeline) > 1
    }

    /// Runs a job of this pipeline, whose falls Ctrl-C ends.
    fn run<T: Send + 'static>(
        &self,
        py: Python<'_>,
        job: impl FnOnce(&dataset::Pipeline) -> Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let pipeline = self.pipeline.clone();
        work::run_beside(py, Stop::new(), &mut |_| Ok(()), move |stop| {
            job(&dataset::Pipeline::clone(&pipeline).stopped_by(stop))
        })
    }
}

impl Pipeline {
    /// What was opened; in a process that cannot use that, the same opened again.
    pub(crate) fn opened(&self, py: Python<'_>) -> PyResult<Opened> {
        let config = {
            let mut opened = locked(&self.opened);
            let opened = opened.as_mut().ok_or_else(|| closed("the pipeline"))?;
            if !opened.was_forked_in_use() {
                opened.process = std::process::id();
                return Ok(opened.clone());
            }
            opened.pipeline.config().clone()
        };
        let opened = work::run(py, move || Opened::new(config))?;
        Ok(locked(&self.opened).insert(opened).clone())
    }
}

#[pymethods]
impl Pipeline {
    #[new]
    #[pyo3(signature = (path, json, overrides, quality))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        json: Option<String>,
        overrides: Vec<String>,
        quality: Option<String>,
    ) -> PyResult<Self> {
        let opened = work::run(py, move || {
            let (json, quality) = (json.as_deref(), quality.as_deref());
            Opened::new(config_of(path, json, &overrides, quality)?)
        })?;
        Ok(Self {
            opened: Mutex::new(Some(opened)),
        })
    }

    fn close(&self) {
        let opened = locked(&self.opened).take();
        drop(opened);
    }

    fn is_closed(&self) -> bool {
        locked(&self.opened).is_none()
    }

    fn class_names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(self.opened(py)?.policy.classes)
    }

    fn config_json(&self, py: Python<'_>) -> PyResult<String> {
        text(self.opened(py)?.pipeline.config()).map_err(to_python)
    }

    /// The folder that paths of environment maps are relative to.
    fn folder(&self, py: Python<'_>) -> PyResult<OsString> {
        let folder = self.opened(py)?.pipeline.config().folder.clone();
        Ok(folder.into_os_string())
    }

    fn sample(&self, py: Python<'_>, seed: u64, k: u64) -> PyResult<Sample> {
        let opened = self.opened(py)?;
        let sample = opened.run(py, move |pipeline| pipeline.sample(seed, k))?;
        let pictures = opened.pipeline.config().pictures.clone();
        let file = PictureFile { pictures, seed, k };
        Ok(Sample::of_file(sample, opened.policy, file))
    }

    /// Resolves the unknowns of a scene, renders it and labels it.
    fn take(&self, py: Python<'_>, scene: &str) -> PyResult<Sample> {
        let (opened, scene) = (self.opened(py)?, scene_of(scene).map_err(to_python)?);
        let sample = opened.run(py, move |pipeline| pipeline.take(scene))?;
        Ok(Sample::new(sample, opened.policy))
    }

    fn draw(&self, py: Python<'_>, seed: u64, k: u64) -> PyResult<String> {
        let opened = self.opened(py)?;
        opened.run(py, move |pipeline| text(&pipeline.draw(seed, k)?))
    }

    fn resolve(&self, py: Python<'_>, scene: &str) -> PyResult<String> {
        let (opened, scene): (_, Scene) = (self.opened(py)?, scene_of(scene).map_err(to_python)?);
        opened.run(py, move |pipeline| text(&pipeline.resolve(scene)?.0))
    }
}
