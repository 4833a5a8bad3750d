//! Datasets, by a pipeline or by a function of Python's.

use crate::document::{parse, text};
use crate::errors::{to_python, wrong_type, wrong_value};
use crate::lock::locked;
use crate::pipeline::Pipeline;
use crate::sample::Sample;
use crate::work::{self, Stop};
use petcomp::dataset::{self, DatasetConfig, Plan, Progress, SampleRange, Shard, Sidecar, Writer};
use petcomp::{Error, Result};
use pyo3::prelude::*;
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

/// What the threads of a run tell the one that waits for them.
#[derive(Clone, Default)]
struct Steps(Arc<Mutex<Vec<Progress>>>);

impl Steps {
    /// Hands all progress to a function of Python's.
    fn deliver(&self, py: Python<'_>, callable: Option<&Py<PyAny>>) -> PyResult<()> {
        let steps = std::mem::take(&mut *locked(&self.0));
        let Some(callable) = callable else {
            return Ok(());
        };
        for step in steps {
            callable.call1(py, (step.done, step.count, step.made))?;
        }
        Ok(())
    }

    fn generate_from(
        &self,
        pipeline: &dataset::Pipeline,
        target: Target,
        stop: &AtomicBool,
    ) -> Result<String> {
        let (folder, count, seed, only, shard) = target;
        let range = range_of(only, shard)?;
        let archives = pipeline.config().labels.archives();
        let plan = Plan {
            range,
            ..pipeline.plan(count, seed, range.folder(&folder, archives))?
        };
        self.generate(&plan, |k| pipeline.sample(seed, k), stop)
    }

    fn generate(
        &self,
        plan: &Plan,
        make: impl Fn(u64) -> Result<dataset::Sample> + Sync,
        stop: &AtomicBool,
    ) -> Result<String> {
        let report = |progress| locked(&self.0).push(progress);
        text(&dataset::generate(plan, make, &report, stop)?)
    }
}

/// Where a dataset is written, and which samples: folder, count, seed, the only one, the shard.
type Target = (PathBuf, u64, u64, Option<u64>, Option<[u64; 2]>);

/// Which samples of a dataset are made.
fn range_of(only: Option<u64>, shard: Option<[u64; 2]>) -> Result<SampleRange> {
    match (only, shard) {
        (None, None) => Ok(SampleRange::All),
        (Some(k), None) => Ok(SampleRange::One(k)),
        (None, Some([index, of])) => Shard::new(index, of).map(SampleRange::Shard),
        (Some(_), Some(_)) => {
            let what = "given together with shard, expected one of them";
            Err(Error::value("only", what))
        }
    }
}

/// Generates a dataset from a pipeline.
#[pyfunction]
pub(crate) fn generate_from(
    py: Python<'_>,
    pipeline: &Bound<'_, Pipeline>,
    target: Target,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let opened = pipeline.get().opened(py)?;
    let steps = Steps::default();
    let own = steps.clone();
    let mut beside = |py: Python<'_>| steps.deliver(py, progress.as_ref());
    work::run_beside(py, Stop::new(), &mut beside, move |stop| {
        let pipeline = dataset::Pipeline::clone(&opened.pipeline);
        own.generate_from(&pipeline.stopped_by(stop), target, stop)
    })
}

/// How a dataset of a function's pictures is written: tables of a recipe, checked as those are.
struct DatasetLayout {
    config: DatasetConfig,
    /// The table of labels as it was given, without defaults.
    given: Map<String, Value>,
}

impl DatasetLayout {
    fn new([labels, pictures, split]: &[String; 3]) -> Result<Self> {
        let config = DatasetConfig {
            labels: parse("labels", labels)?,
            pictures: parse("pictures", pictures)?,
            split: parse("split", split)?,
            ..Default::default()
        };
        config.check()?;
        let given = parse("labels", labels)?;
        Ok(Self { config, given })
    }

    fn plan(&self, classes: &[String], target: Target) -> Result<Plan> {
        let (folder, count, seed, only, shard) = target;
        let (range, obstructed) = (range_of(only, shard)?, self.config.labels.obstructed);
        Ok(Plan {
            range,
            seed,
            split: self.config.split,
            obstructed,
            writers: self.writers(),
            ..Plan::new(
                range.folder(&folder, None),
                count,
                obstructed.classes(classes)?,
            )
        })
    }

    /// Refuses a sample whose labels no file would hold: an archive takes them from what other
    /// writers write, and a [`Sidecar`] is only of samples with a scene.
    fn checked(&self, sample: dataset::Sample, k: u64) -> Result<dataset::Sample> {
        if sample.provenance.is_some() || self.config.labels.archives().is_none() {
            return Ok(sample);
        }
        let what = format!(
            "only webdataset, which holds no labels of sample {k} because it has no scene, expected \"yolo\", \"coco\" or \"voc\" as well"
        );
        Err(Error::value("labels.formats", what))
    }

    /// Refuses a sample whose labels were made by another policy than the default, unless the
    /// caller chose one.
    fn check_policy(&self, sample: &Sample, k: u64) -> PyResult<()> {
        if !sample.has_policy() {
            return Ok(());
        }
        let (own, labels) = (sample.policy(), &self.config.labels);
        if !self.is_given("obstructed") {
            check_same("labels.obstructed", own.obstructed, labels.obstructed, k)?;
        }
        if !(self.is_given("yolo") || self.is_given("coco")) {
            check_same("labels.yolo.boxes", own.extent, labels.extent(), k)?;
        }
        Ok(())
    }

    fn is_given(&self, key: &str) -> bool {
        self.given.contains_key(key)
    }

    fn writers(&self) -> Vec<Arc<dyn Writer>> {
        let mut writers: Vec<Arc<dyn Writer>> =
            vec![Arc::new(self.config.pictures.clone()), Arc::new(Sidecar)];
        writers.extend(self.config.labels.writers(&self.config.pictures));
        writers
    }
}

/// Generates a dataset from a Python function that returns the sample of a number.
#[pyfunction]
pub(crate) fn generate_with(
    py: Python<'_>,
    make: Py<PyAny>,
    classes: Vec<String>,
    layout: [String; 3],
    target: Target,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let layout = DatasetLayout::new(&layout).map_err(to_python)?;
    let (steps, raised) = (Steps::default(), Raised::default());
    let (own, keep) = (steps.clone(), raised.clone());
    let mut beside = |py: Python<'_>| steps.deliver(py, progress.as_ref());
    let made = work::run_beside(py, Stop::of_caller(), &mut beside, move |stop| {
        let plan = layout.plan(&classes, target)?;
        let check = |sample: &Sample, k: u64| {
            check_class_names(sample, &classes, k)?;
            layout.check_policy(sample, k)
        };
        let sample = |k| layout.checked(keep.sample(&make, &check, k)?, k);
        own.generate(&plan, sample, stop)
    });
    raised.or_else(made)
}

fn check_same<T: PartialEq + Serialize>(at: &str, own: T, default: T, k: u64) -> PyResult<()> {
    if own == default {
        return Ok(());
    }
    let [own, default] = [text(&own), text(&default)].map(|text| text.map_err(to_python));
    let what = format!(
        "not given, so {}, but sample {k} was made with {}: give the one that you want",
        default?, own?
    );
    Err(wrong_value(at, what))
}

/// Refuses a sample whose numbers of classes mean others than those of the dataset.
fn check_class_names(sample: &Sample, classes: &[String], k: u64) -> PyResult<()> {
    if sample.is_of(classes) {
        return Ok(());
    }
    let theirs = &sample.policy().classes;
    let what = format!(
        "{classes:?}, but sample {k} has {theirs:?}, expected the former to begin with the latter"
    );
    Err(wrong_value("classes", what))
}

/// Refuses a sample that does not suit the dataset.
type CheckSample<'a> = &'a dyn Fn(&Sample, u64) -> PyResult<()>;

/// The exception of the sample with the lowest number.
#[derive(Clone, Default)]
struct Raised(Arc<Mutex<Option<(u64, PyErr)>>>);

impl Raised {
    /// A run's outcome; what the function raised says more than that the run failed.
    fn or_else(&self, made: PyResult<String>) -> PyResult<String> {
        match locked(&self.0).take() {
            Some((_, error)) if made.is_err() => Err(error),
            _ => made,
        }
    }

    fn sample(&self, make: &Py<PyAny>, check: CheckSample<'_>, k: u64) -> Result<dataset::Sample> {
        let made = Python::attach(|py| {
            let sample = make.bind(py).call1((k,))?;
            let sample = sample.cast::<Sample>().map_err(|_| {
                let found = sample.get_type();
                wrong_type("make", &format!("returned {found}, expected a Sample"))
            })?;
            let sample = sample.get();
            check(sample, k)?;
            sample.to_dataset_sample(py)
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
