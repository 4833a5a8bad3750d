//! Datasets, by a pipeline or by a function of Python's.

use crate::document::{parse, text};
use crate::errors::{to_python, wrong_value};
use crate::pipeline::Pipeline;
use crate::sample::Sample;
use crate::work::{self, locked};
use petcomp::Result;
use petcomp::dataset::{
    self, DatasetCounts, LabelConfig, Pictures, Plan, Progress, SampleRange, Shard, Sidecar, Split,
    Writer,
};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// What the threads of a run tell the one that waits for them.
#[derive(Clone, Default)]
struct Run {
    stop: Arc<AtomicBool>,
    progress: Arc<Mutex<Vec<Progress>>>,
}

impl Run {
    fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Hands all progress to a function of Python's.
    fn deliver(&self, py: Python<'_>, callable: Option<&Py<PyAny>>) -> PyResult<()> {
        let steps = std::mem::take(&mut *locked(&self.progress));
        let Some(callable) = callable else {
            return Ok(());
        };
        for step in steps {
            callable.call1(py, (step.done, step.count, step.made))?;
        }
        Ok(())
    }

    fn generate(
        &self,
        plan: &Plan,
        make: impl Fn(u64) -> Result<dataset::Sample> + Sync,
    ) -> Result<String> {
        let report = |progress| locked(&self.progress).push(progress);
        let counts = dataset::generate(plan, make, &report, &self.stop)?;
        counts_json(&counts)
    }
}

fn counts_json(counts: &DatasetCounts) -> Result<String> {
    text(counts)
}

/// Which samples of a dataset are made.
fn range_of(only: Option<u64>, shard: Option<[u64; 2]>) -> PyResult<SampleRange> {
    match (only, shard) {
        (Some(_), Some(_)) => Err(wrong_value(
            "only",
            "given together with shard, expected one of them",
        )),
        (Some(k), None) => Ok(SampleRange::One(k)),
        (None, Some([index, of])) => {
            let shard = Shard::new(index, of).map_err(to_python)?;
            Ok(SampleRange::Shard(shard))
        }
        (None, None) => Ok(SampleRange::All),
    }
}

/// Where a shard is written, as by the program.
fn folder_of(folder: PathBuf, range: SampleRange) -> PathBuf {
    match range {
        SampleRange::Shard(shard) => folder.join(shard.folder()),
        _ => folder,
    }
}

/// Makes a dataset of a pipeline's pictures.
#[pyfunction]
#[pyo3(signature = (pipeline, folder, count, seed, only, shard, progress))]
pub(crate) fn generate_from(
    py: Python<'_>,
    pipeline: &Bound<'_, Pipeline>,
    folder: PathBuf,
    count: u64,
    seed: u64,
    only: Option<u64>,
    shard: Option<[u64; 2]>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let opened = pipeline.get().opened()?;
    let range = range_of(only, shard)?;
    let folder = folder_of(folder, range);
    let (run, falls) = (Run::default(), opened.stop);
    let worker = run.clone();
    let stop = |stopped| {
        falls.store(stopped, Ordering::Relaxed);
        run.stop();
    };
    work::run_beside(
        py,
        &stop,
        &mut |py| run.deliver(py, progress.as_ref()),
        move || {
            let pipeline = opened.pipeline;
            let plan = Plan {
                range,
                ..pipeline.plan(count, seed, folder)?
            };
            worker.generate(&plan, |k| pipeline.sample(seed, k))
        },
    )
}

/// How a dataset of a function's pictures is written.
struct Layout {
    labels: LabelConfig,
    pictures: Pictures,
    split: Split,
}

impl Layout {
    fn new(labels: &str, pictures: &str, split: &str) -> Result<Self> {
        let layout = Self {
            labels: parse("labels", labels)?,
            pictures: parse("pictures", pictures)?,
            split: parse("split", split)?,
        };
        // The checks of a recipe, whose tables these are.
        let config = dataset::DatasetConfig {
            labels: layout.labels.clone(),
            pictures: layout.pictures,
            split: layout.split,
            ..Default::default()
        };
        config.check()?;
        Ok(layout)
    }

    fn writers(&self) -> Vec<Box<dyn Writer>> {
        let mut writers: Vec<Box<dyn Writer>> = vec![Box::new(self.pictures), Box::new(Sidecar)];
        writers.extend(self.labels.writers(&self.pictures));
        writers
    }
}

/// Makes a dataset of the samples that a function of Python's returns for their numbers.
#[pyfunction]
#[pyo3(signature = (make, classes, layout, folder, count, seed, only, shard, progress))]
pub(crate) fn generate_with(
    py: Python<'_>,
    make: Py<PyAny>,
    classes: Vec<String>,
    layout: [String; 3],
    folder: PathBuf,
    count: u64,
    seed: u64,
    only: Option<u64>,
    shard: Option<[u64; 2]>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let range = range_of(only, shard)?;
    let folder = folder_of(folder, range);
    let [labels, pictures, split] = &layout;
    let layout = Layout::new(labels, pictures, split).map_err(to_python)?;
    let run = Run::default();
    let raised = Raised::default();
    let (worker, keep) = (run.clone(), raised.clone());
    let stop = |_| run.stop();
    let made = work::run_beside(
        py,
        &stop,
        &mut |py| run.deliver(py, progress.as_ref()),
        move || {
            let plan = Plan {
                range,
                seed,
                split: layout.split,
                obstructed: layout.labels.obstructed,
                writers: layout.writers(),
                ..Plan::new(folder, count, layout.labels.obstructed.classes(&classes)?)
            };
            worker.generate(&plan, |k| keep.sample(&make, k))
        },
    );
    // What the function raised says more than that it did.
    match locked(&raised.0).take() {
        Some((_, error)) if made.is_err() => Err(error),
        _ => made,
    }
}

/// The exception of the sample with the lowest number.
#[derive(Clone, Default)]
struct Raised(Arc<Mutex<Option<(u64, PyErr)>>>);

impl Raised {
    fn sample(&self, make: &Py<PyAny>, k: u64) -> Result<dataset::Sample> {
        let made = Python::attach(|py| {
            let sample = make.bind(py).call1((k,))?;
            let sample = sample.cast::<Sample>().map_err(|_| {
                let found = sample.get_type();
                crate::errors::wrong_type("make", &format!("returned {found}, expected a Sample"))
            })?;
            sample.get().to_dataset_sample(py)
        });
        made.map_err(|error| self.keep(k, error))
    }

    fn keep(&self, k: u64, error: PyErr) -> petcomp::Error {
        let what = format!("sample {k}: {error}");
        let mut first = locked(&self.0);
        if first.as_ref().is_none_or(|(other, _)| k < *other) {
            *first = Some((k, error));
        }
        petcomp::Error::value("make", what)
    }
}
