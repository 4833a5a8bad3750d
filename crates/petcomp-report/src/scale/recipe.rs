//! A dataset of a recipe, made by the program itself and watched from outside.
//!
//! # Method
//! `petcomp dataset generate --progress json` says every second how many pictures are done; with
//! each line the processor time and the resident memory of its process are read (Linux's `/proc`).
//! What a picture takes is the slope of processor time over pictures, with the standard error that
//! the differences between blocks of equal length give, so that slow drifts count. Memory is a line
//! through the means of the same blocks but for the first ones, while caches fill.

use super::{FORECAST_PICTURES, MB_PER_BYTE, MS_PER_SECOND, SECONDS_PER_HOUR};
use crate::columns::table_from;
use crate::files::write_texts;
use crate::machine::bytes_in;
use petcomp::plot::{Axis, Chart, Curve, Table};
use petcomp::{Error, Result, io};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Blocks that a run is cut into for standard errors.
const BLOCKS: usize = 20;
/// Blocks at the beginning in which memory may still grow.
const WARM_UP_BLOCKS: usize = 4;
/// Normal quantile of intervals that hold in 95 of 100 cases.
const Z95: f64 = 1.96;
/// Pictures that memory is extrapolated to.
const MANY_PICTURES: f64 = 1e5;
const GB_PER_BYTE: f64 = 1e-9;

/// A dataset to be made and watched.
pub struct RecipeRun {
    /// The program `petcomp`.
    pub program: PathBuf,
    /// The recipe.
    pub recipe: PathBuf,
    /// Pictures to be made.
    pub pictures: u64,
    /// Pictures of the beginning that the rest is forecast from.
    pub first: u64,
    /// Worker threads; 0 is one per core.
    pub threads: usize,
}

/// A process after so many pictures.
#[derive(Clone, Copy)]
struct RunSample {
    /// Pictures done.
    done: u64,
    /// Seconds of processors that it has taken, all threads together.
    cpu_seconds: f64,
    /// Memory that is resident, bytes.
    resident_bytes: f64,
}

/// A value and the half width of its 95 % interval.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    value: f64,
    half_width: f64,
}

/// What a run took.
struct RecipeRecord {
    /// By pictures done.
    samples: Vec<RunSample>,
    /// Bytes of all files.
    bytes: f64,
    /// Number of files.
    files: u64,
    /// See [`RecipeRun::first`].
    first: u64,
}

/// Makes the dataset in a temporary folder and watches; `progress` gets pictures done and to be
/// done.
fn run_recipe(run: &RecipeRun, progress: impl Fn(u64, u64)) -> Result<RecipeRecord> {
    let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
    let output = folder.path().join("dataset");
    let mut child = start(run, &output)?;
    let samples = watch(&mut child, run.pictures, progress)?;
    let status = child.wait().map_err(|e| Error::file(&run.program, e))?;
    if !status.success() {
        return Err(Error::file(
            &run.recipe,
            format!("the run ended with {status}"),
        ));
    }
    let sizes = file_sizes(&output)?;
    Ok(RecipeRecord {
        samples,
        bytes: sizes.iter().sum(),
        files: sizes.len() as u64,
        first: run.first,
    })
}

fn start(run: &RecipeRun, output: &Path) -> Result<Child> {
    let threads = run.threads.to_string();
    let pictures = run.pictures.to_string();
    Command::new(&run.program)
        .args(["--progress", "json", "-j", &threads, "dataset", "generate"])
        .arg(&run.recipe)
        .args(["-n", &pictures, "--yes", "-o"])
        .arg(output)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| Error::file(&run.program, format!("cannot be run: {e}")))
}

/// A sample for each line that tells how far a child is.
fn watch(child: &mut Child, total: u64, progress: impl Fn(u64, u64)) -> Result<Vec<RunSample>> {
    let id = child.id();
    let lines = child.stderr.take().map(BufReader::new).into_iter();
    let mut samples: Vec<RunSample> = Vec::new();
    for line in lines
        .flat_map(BufRead::lines)
        .map_while(std::io::Result::ok)
    {
        let Some(done) = pictures_done(&line) else {
            continue;
        };
        progress(done, total);
        if samples.last().is_none_or(|last| last.done < done) {
            samples.extend(sample_of(id, done));
        }
    }
    Ok(samples)
}

fn pictures_done(line: &str) -> Option<u64> {
    let told: serde_json::Value = serde_json::from_str(line).ok()?;
    (told.get("job")? == "pictures").then_some(told.get("done")?.as_u64()?)
}

/// None once the process has ended.
fn sample_of(id: u32, done: u64) -> Option<RunSample> {
    let read = |name: &str| std::fs::read_to_string(format!("/proc/{id}/{name}")).ok();
    Some(RunSample {
        done,
        cpu_seconds: cpu_seconds_in(&read("stat")?)?,
        resident_bytes: bytes_in(&read("status")?, "VmRSS")?,
    })
}

/// User and system time: fields 14 and 15, counted from after the name, which may hold blanks.
fn cpu_seconds_in(stat: &str) -> Option<f64> {
    let after_name = stat.rsplit_once(')')?.1;
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    let ticks = |field: usize| fields.get(field)?.parse::<f64>().ok();
    let ticks_per_second = rustix::param::clock_ticks_per_second() as f64;
    Some((ticks(11)? + ticks(12)?) / ticks_per_second)
}

/// Of all files below a folder.
fn file_sizes(folder: &Path) -> Result<Vec<f64>> {
    let mut sizes = Vec::new();
    for entry in io::entries(folder)? {
        let about = entry.metadata().map_err(|e| Error::file(entry.path(), e))?;
        if about.is_dir() {
            sizes.extend(file_sizes(&entry.path())?);
        } else {
            sizes.push(about.len() as f64);
        }
    }
    Ok(sizes)
}

impl RecipeRecord {
    /// Processor seconds that a picture takes, of those between two numbers of pictures.
    fn picture_seconds(&self, from: u64, to: u64) -> Result<Estimate> {
        let within = self
            .samples
            .iter()
            .filter(|s| (from..=to).contains(&s.done));
        let ends = block_ends(&within.copied().collect::<Vec<_>>());
        let rates: Vec<[f64; 2]> = ends
            .windows(2)
            .map(|pair| block_rate(&pair[0], &pair[1]))
            .collect();
        if rates.is_empty() {
            return Err(Error::value(
                "scale",
                "too few samples, expected a longer run",
            ));
        }
        Ok(weighted_mean(&rates))
    }

    /// Bytes by which memory grows with a picture, and what is expected after many pictures.
    fn memory(&self) -> [Estimate; 2] {
        let blocks = block_ends(&self.samples);
        let later = blocks.get(WARM_UP_BLOCKS..).unwrap_or_default();
        let places: Vec<[f64; 2]> = later
            .iter()
            .map(|s| [s.done as f64, s.resident_bytes])
            .collect();
        line_through(&places, MANY_PICTURES)
    }

    fn last(&self) -> u64 {
        self.samples.last().map_or(0, |sample| sample.done)
    }

    fn peak_bytes(&self) -> f64 {
        self.samples
            .iter()
            .map(|s| s.resident_bytes)
            .fold(0.0, f64::max)
    }

    /// What was measured, and what is expected of a million pictures.
    fn table(&self) -> Result<Table> {
        let (first, last) = (self.first.min(self.last()), self.last());
        let beginning = self.picture_seconds(0, first)?;
        let all = self.picture_seconds(0, last)?;
        let [slope, many] = self.memory();
        let pictures = last as f64;
        let hours = FORECAST_PICTURES / SECONDS_PER_HOUR;
        let lines = [
            [
                format!("CPU ms a picture, of the first {first}"),
                beginning.words(MS_PER_SECOND),
            ],
            [
                format!("CPU ms a picture, of all {last}"),
                all.words(MS_PER_SECOND),
            ],
            [
                format!("CPU hours of all, forecast from the first {first}"),
                beginning.words(pictures / SECONDS_PER_HOUR),
            ],
            [
                "CPU hours of all, measured".into(),
                format!("{:.4}", all.value * pictures / SECONDS_PER_HOUR),
            ],
            ["CPU hours of a million".into(), all.words(hours)],
            [
                "KB a picture, all files".into(),
                format!("{:.1}", self.bytes / pictures / 1e3),
            ],
            ["files".into(), self.files.to_string()],
            [
                "GB of a million".into(),
                format!(
                    "{:.1}",
                    self.bytes / pictures * FORECAST_PICTURES * GB_PER_BYTE
                ),
            ],
            [
                "most memory, MB".into(),
                format!("{:.0}", self.peak_bytes() * MB_PER_BYTE),
            ],
            [
                "memory, KB more each 1,000 pictures".into(),
                slope.words(1.0),
            ],
            [
                "memory after 100,000 pictures, MB".into(),
                many.words(MB_PER_BYTE),
            ],
        ];
        Ok(table_from(["of the recipe", "with 95 % interval"], lines))
    }

    /// Memory and processor time by pictures done.
    fn chart(&self) -> String {
        let chart = |title: &str, up: &str, y: fn(&RunSample) -> f64| {
            let curve: Curve = self.samples.iter().map(|s| [s.done as f64, y(s)]).collect();
            Chart {
                title: title.into(),
                names: vec!["measured".into()],
                across: Axis::around("pictures", curve.iter().map(|p| p[0])),
                up: Axis::around(up, curve.iter().map(|p| p[1])),
                curves: vec![curve],
                defaults: Vec::new(),
            }
        };
        Chart::row(&[
            chart("memory", "resident MB", |s| s.resident_bytes * MB_PER_BYTE),
            chart("processor time", "CPU seconds", |s| s.cpu_seconds),
        ])
    }
}

impl Estimate {
    fn words(self, factor: f64) -> String {
        format!(
            "{:.4} +- {:.4}",
            self.value * factor,
            self.half_width * factor
        )
    }
}

/// The ends of blocks of about as many samples each.
fn block_ends(samples: &[RunSample]) -> Vec<RunSample> {
    let step = samples.len().div_ceil(BLOCKS).max(1);
    samples.iter().copied().step_by(step).collect()
}

/// Pictures of a block, and processor seconds of each.
fn block_rate(from: &RunSample, to: &RunSample) -> [f64; 2] {
    let pictures = (to.done - from.done) as f64;
    [pictures, (to.cpu_seconds - from.cpu_seconds) / pictures]
}

/// The mean of values by their weights, with the error that their spread gives.
fn weighted_mean(weighted: &[[f64; 2]]) -> Estimate {
    let weight: f64 = weighted.iter().map(|[w, _]| w).sum();
    let mean = weighted.iter().map(|[w, v]| w * v).sum::<f64>() / weight;
    let count = weighted.len() as f64;
    let spread = weighted
        .iter()
        .map(|[w, v]| w * (v - mean).powi(2))
        .sum::<f64>()
        / weight;
    Estimate {
        value: mean,
        half_width: Z95 * (spread / (count - 1.0).max(1.0)).sqrt(),
    }
}

/// The slope of the least-squares line through some places, and its height at another one.
fn line_through(places: &[[f64; 2]], at: f64) -> [Estimate; 2] {
    let count = places.len() as f64;
    let [x, y] = [0, 1].map(|k| places.iter().map(|p| p[k]).sum::<f64>() / count);
    let xx: f64 = places.iter().map(|p| (p[0] - x).powi(2)).sum();
    let xy: f64 = places.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    let slope = xy / xx;
    let residual = |p: &[f64; 2]| (p[1] - y - slope * (p[0] - x)).powi(2);
    let variance = places.iter().map(residual).sum::<f64>() / (count - 2.0).max(1.0);
    let error_at = |variance_factor: f64| Z95 * (variance * variance_factor).sqrt();
    [
        Estimate {
            value: slope,
            half_width: error_at(1.0 / xx),
        },
        Estimate {
            value: y + slope * (at - x),
            half_width: error_at(1.0 / count + (at - x).powi(2) / xx),
        },
    ]
}

/// Runs and writes `scale_recipe.csv`, `scale_recipe.md` and `scale_recipe.svg` into a folder.
///
/// # Errors
/// A program that cannot be run, or fails; a system without Linux's `/proc`; files that cannot be
/// written.
pub fn write_recipe(folder: &Path, run: &RecipeRun, progress: impl Fn(u64, u64)) -> Result<Table> {
    io::create_folder(folder)?;
    let record = run_recipe(run, progress)?;
    let table = record.table()?;
    let lines = record.samples.iter().map(|s| {
        [
            s.done.to_string(),
            format!("{:.2}", s.cpu_seconds),
            format!("{:.0}", s.resident_bytes),
        ]
    });
    let samples = table_from(["pictures", "cpu_s", "resident_bytes"], lines);
    let files = [
        ("scale_recipe.csv", &*samples.csv()),
        ("scale_recipe.md", &table.markdown()),
        ("scale_recipe.svg", &record.chart()),
    ];
    write_texts(folder, files)?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A process that takes a tenth of a second a picture and keeps 10 bytes of each.
    fn steady() -> RecipeRecord {
        let sample = |k: u64| RunSample {
            done: 50 * k,
            cpu_seconds: 5.0 * k as f64,
            resident_bytes: 1e8 + 500.0 * k as f64,
        };
        RecipeRecord {
            samples: (1..=100).map(sample).collect(),
            bytes: 5000.0 * 2e5,
            files: 10_000,
            first: 500,
        }
    }

    #[test]
    fn a_steady_run_is_forecast_exactly() {
        let record = steady();
        let [beginning, all] = [500, 5000].map(|to| record.picture_seconds(0, to).unwrap());
        for estimate in [beginning, all] {
            assert!((estimate.value - 0.1).abs() < 1e-12 && estimate.half_width < 1e-9);
        }
        let [slope, many] = record.memory();
        assert!((slope.value - 10.0).abs() < 1e-6);
        assert!((many.value - 1.01e8).abs() < 1.0, "{many:?}");
        let table = record.table().unwrap().markdown();
        assert!(
            table.contains("| 27.7778 +- 0.0000 |") && table.contains("| 200.0 |"),
            "{table}"
        );
    }

    #[test]
    fn a_run_without_samples_is_refused() {
        let empty = RecipeRecord {
            samples: Vec::new(),
            ..steady()
        };
        assert!(
            empty
                .table()
                .unwrap_err()
                .to_string()
                .contains("longer run")
        );
    }

    #[test]
    fn what_the_system_tells_of_a_process_is_read() {
        let stat = "12 (a (b) c) S 1 1 1 0 -1 4 5 0 0 0 250 50 0 0 20 0 3 0 100 1000 20";
        let ticks = rustix::param::clock_ticks_per_second() as f64;
        assert_eq!(cpu_seconds_in(stat), Some(300.0 / ticks));
        assert_eq!(
            pictures_done(r#"{"job":"pictures","done":7,"of":9}"#),
            Some(7)
        );
        assert_eq!(pictures_done("warning: nothing"), None);
        assert!(sample_of(std::process::id(), 1).is_some());
    }
}
