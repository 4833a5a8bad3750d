//! Error of the renderer against run time: its presets beside Cycles at many sample counts, and the golden scenes.
//!
//! Times are CPU seconds of the rendering itself, textures read and their pyramids built.

mod diagram;

pub use diagram::diagrams;

use super::clock::timed;
use petcomp::Image;
use petcomp::Quality;
use petcomp::diff::{Likeness, triple};
use petcomp::plot::{Axis, Chart, Table};
use petcomp::render::{RenderOptions, render, render_reference};
use petcomp::scene::{Shot, cycles};
use petcomp::{Error, Result, composite, io};
use petcomp::{LinearRgb, PremulRgba};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Options of the report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderReportOptions {
    /// Scene file of the reference renderer that is timed.
    pub scene: PathBuf,
    /// Size that it is rendered at, pixels. Default: 320 x 240.
    pub size: [u32; 2],
    /// What `tests/benches/peers/render.py` wrote for that scene and size; a folder without `times.json` is left out.
    pub cycles: PathBuf,
    /// Folder of golden scenes; one without scenes is left out.
    pub golden: PathBuf,
    /// Renderings per setting, of which the median is told. Default: 5.
    pub repeats: usize,
}

/// The quadrature is held to a quarter of the picture's sides: it takes a thousand times as long.
const QUADRATURE_SHRINK: u32 = 4;
/// How finely the quadrature is sampled: sub-samples, light samples (a side each) and directions of the environment.
const QUADRATURE: RenderOptions = RenderOptions {
    subsamples: 6,
    light_samples: 6,
    ambient_samples: 196,
    cell_px: 1.0,
};

/// Between the default and a reference: 2 x 2 samples a pixel, 4 x 4 a light.
pub(super) const GOOD: RenderOptions = RenderOptions {
    subsamples: 2,
    light_samples: 4,
    ambient_samples: 64,
    cell_px: 1.0,
};

/// The same with 3 x 3 samples a pixel, 6 x 6 a light.
pub(super) const HIGH: RenderOptions = RenderOptions {
    subsamples: 3,
    light_samples: 6,
    ambient_samples: 100,
    cell_px: 0.66,
};

/// Points on the curve of error over run time, the quickest first: each [`Quality`], and two finer than the default.
pub fn settings() -> [(&'static str, RenderOptions); 5] {
    let [draft, normal, reference] = Quality::ALL.map(|quality| (quality.name(), quality.render()));
    [draft, normal, ("good", GOOD), ("high", HIGH), reference]
}

/// A picture and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderRow {
    /// `petcomp` or the other program with its version.
    pub program: String,
    /// Setting, or samples per pixel.
    pub setting: String,
    /// CPU seconds.
    pub cpu_seconds: f64,
    /// Against the other program's best picture; none without one, or for that picture itself.
    pub cycles: Option<Likeness>,
    /// Against the quadrature of the definition, at a quarter of the sides.
    pub quadrature: Option<Likeness>,
}

/// A golden scene at one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct GoldenRow {
    /// Name of the case.
    pub case: String,
    /// Name of the setting.
    pub quality: &'static str,
    /// Against the reference.
    pub likeness: Likeness,
}

/// Measures and writes `render.csv`, `render.md` and `render.svg` into a folder, and of the golden scenes
/// `render_golden.csv` and the sheet `render_golden.png`: each scene as reference, 16 times the difference, and ours.
///
/// # Errors
/// A scene or a picture that cannot be read; files that cannot be written.
pub fn write(
    folder: impl AsRef<Path>,
    options: &RenderReportOptions,
) -> Result<(Vec<RenderRow>, Vec<GoldenRow>)> {
    let folder = folder.as_ref();
    io::create_folder(folder)?;
    let rows = measure(options)?;
    let (golden, sheet) = golden(&options.golden, "good")?;
    io::write_text(folder.join("render.csv"), &table(&rows).csv())?;
    io::write_text(folder.join("render.md"), &markdown(&rows, &golden, options))?;
    io::write_text(folder.join("render.svg"), &Chart::row(&charts(&rows)))?;
    if let Some(sheet) = sheet {
        io::write_text(
            folder.join("render_golden.csv"),
            &golden_table(&golden).csv(),
        )?;
        io::write(folder.join("render_golden.png"), &sheet)?;
    }
    Ok((rows, golden))
}

/// Every setting, and every picture of the other program that is there.
///
/// # Errors
/// As [`write()`].
pub fn measure(options: &RenderReportOptions) -> Result<Vec<RenderRow>> {
    let shot = cycles::import(&options.scene, Some(options.size))?;
    let small = cycles::import(
        &options.scene,
        Some(options.size.map(|side| (side / QUADRATURE_SHRINK).max(1))),
    )?;
    let truth = finished(&composite::frame(
        &render_reference(&small, &QUADRATURE),
        small.plate.as_deref(),
    ));
    let others = Others::read(&options.cycles)?;
    let best = others.best()?;
    let mut rows = Vec::new();
    for (name, sampling) in settings() {
        let (picture, cpu_seconds) = timed(options.repeats, || Ok(picture_of(&shot, &sampling)))?;
        rows.push(RenderRow {
            program: "petcomp".into(),
            setting: name.into(),
            cpu_seconds,
            cycles: best
                .as_ref()
                .and_then(|best| Likeness::measure(&picture, best)),
            quadrature: Likeness::measure(&picture_of(&small, &sampling), &truth),
        });
    }
    for entry in &others.pictures {
        let picture = others.picture(entry)?;
        let is_best = Some(entry.samples) == others.most();
        rows.push(RenderRow {
            program: format!("Cycles {}", others.program),
            setting: format!("{} spp", entry.samples),
            cpu_seconds: entry.cpu_seconds,
            cycles: best
                .as_ref()
                .filter(|_| !is_best)
                .and_then(|best| Likeness::measure(&picture, best)),
            quadrature: None,
        });
    }
    Ok(rows)
}

fn picture_of(shot: &Shot, options: &RenderOptions) -> Image<LinearRgb> {
    finished(&composite::frame(
        &render(shot, options),
        shot.plate.as_deref(),
    ))
}

fn finished(frame: &Image<PremulRgba>) -> Image<LinearRgb> {
    frame.map(PremulRgba::color)
}

/// The pictures of the other program.
#[derive(Default, Deserialize)]
struct Others {
    #[serde(skip)]
    folder: PathBuf,
    program: String,
    pictures: Vec<OtherPicture>,
}

#[derive(Deserialize)]
struct OtherPicture {
    samples: u32,
    file: String,
    cpu_seconds: f64,
}

impl Others {
    fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("times.json");
        if !path.exists() {
            return Ok(Self::default());
        }
        Ok(Self {
            folder: folder.into(),
            ..io::read_json(&path)?
        })
    }

    fn most(&self) -> Option<u32> {
        self.pictures.iter().map(|entry| entry.samples).max()
    }

    fn best(&self) -> Result<Option<Image<LinearRgb>>> {
        let best = self.pictures.iter().max_by_key(|entry| entry.samples);
        best.map(|entry| self.picture(entry)).transpose()
    }

    fn picture(&self, entry: &OtherPicture) -> Result<Image<LinearRgb>> {
        Ok(finished(&io::read(io::inside(&self.folder, &entry.file)?)?))
    }
}

/// Every golden scene at every setting, and a sheet of all of them at one of them; no sheet where there are no scenes.
///
/// # Errors
/// A scene or a reference that cannot be read.
pub fn golden(folder: &Path, shown: &str) -> Result<(Vec<GoldenRow>, Option<Image<LinearRgb>>)> {
    let entries = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path());
    let mut cases: Vec<PathBuf> = entries
        .filter(|case| case.join("reference.exr").exists())
        .collect();
    cases.sort();
    let (mut rows, mut strips) = (Vec::new(), Vec::new());
    for case in cases {
        let wanted: Image<LinearRgb> = io::read(case.join("reference.exr"))?;
        let shot = cycles::import(case.join("scene.json"), None)?;
        let name = case
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        for (setting, options) in settings() {
            let picture = picture_of(&shot, &options);
            let likeness = Likeness::measure(&picture, &wanted).ok_or_else(|| {
                Error::file(
                    &case,
                    format!(
                        "{:?} pixels, reference has {:?}",
                        picture.size(),
                        wanted.size()
                    ),
                )
            })?;
            rows.push(GoldenRow {
                case: name.clone(),
                quality: setting,
                likeness,
            });
            if setting == shown {
                strips.push(triple(&wanted, &picture));
            }
        }
    }
    Ok((rows, stacked(&strips)))
}

/// Strips below each other in two columns.
fn stacked(strips: &[Image<LinearRgb>]) -> Option<Image<LinearRgb>> {
    const COLUMNS: usize = 2;
    const GAP: usize = 4;
    let width = strips.iter().map(Image::width).max()?;
    let height = strips.iter().map(Image::height).max()?;
    let (w, h) = (width + GAP, height + GAP);
    let sheet = Image::from_fn(COLUMNS * w, strips.len().div_ceil(COLUMNS) * h, |x, y| {
        let (column, row) = (x / w, y / h);
        let strip = strips.get(row * COLUMNS + column);
        let inside = strip.filter(|s| x % w < s.width() && y % h < s.height());
        inside.map_or(LinearRgb::WHITE, |s| s[(x % w, y % h)])
    });
    Some(sheet)
}

/// The measurements as a table.
pub fn table(rows: &[RenderRow]) -> Table {
    let mut table = Table::new([
        "program",
        "setting",
        "CPU s",
        "RMSE to Cycles",
        "bias",
        "SSIM",
        "FLIP",
        "RMSE to quadrature",
        "times less CPU than Cycles at that RMSE",
    ]);
    let number =
        |v: Option<f64>, digits: usize| v.map_or(String::new(), |v| format!("{v:.digits$}"));
    for row in rows {
        let RenderRow {
            program,
            setting,
            cpu_seconds,
            cycles,
            quadrature,
        } = row;
        table.push([
            program.clone(),
            setting.clone(),
            format!("{cpu_seconds:.4}"),
            number(cycles.map(|l| l.rmse), 5),
            number(cycles.map(|l| l.bias), 6),
            number(cycles.and_then(|l| l.ssim), 5),
            number(cycles.map(|l| l.flip), 4),
            number(quadrature.map(|l| l.rmse), 5),
            number(speed_up(row, rows), 0),
        ]);
    }
    table
}

/// How many times as long the other program takes for the same error, on a straight line between its pictures in a plot
/// of logarithms; none beyond its last one.
pub fn speed_up(row: &RenderRow, rows: &[RenderRow]) -> Option<f64> {
    let error = row.cycles?.rmse;
    if row.program != "petcomp" {
        return None;
    }
    let mut curve: Vec<_> = rows
        .iter()
        .filter(|r| r.program != "petcomp")
        .filter_map(|r| Some([libm::log(r.cycles?.rmse), libm::log(r.cpu_seconds)]))
        .collect();
    curve.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let wanted = libm::log(error);
    let [before, after] = curve.windows(2).find_map(|pair| {
        let [a, b] = [pair[0], pair[1]];
        (a[0] >= wanted && wanted >= b[0]).then_some([a, b])
    })?;
    let part = (before[0] - wanted) / (before[0] - after[0]);
    Some(libm::exp(before[1] + part * (after[1] - before[1])) / row.cpu_seconds)
}

/// RMSE, FLIP and 1 - SSIM against CPU seconds, both programs' curves in each.
pub fn charts(rows: &[RenderRow]) -> Vec<Chart> {
    type Measure = fn(&Likeness) -> f64;
    let measures: [(&str, Measure); 3] = [
        ("RMSE, scene-linear", |l| l.rmse),
        ("FLIP", |l| l.flip),
        ("1 - SSIM", |l| l.ssim.map_or(f64::NAN, |s| 1.0 - s)),
    ];
    let mut names: Vec<String> = rows.iter().map(|row| row.program.clone()).collect();
    names.dedup();
    let times = || rows.iter().map(|row| row.cpu_seconds);
    let chart = |&(title, measure): &(&str, Measure)| {
        let curve = |name: &String| {
            let own = rows.iter().filter(|row| row.program == *name);
            own.filter_map(|row| Some([row.cpu_seconds, measure(row.cycles.as_ref()?)]))
                .collect::<Vec<_>>()
        };
        let curves: Vec<_> = names.iter().map(curve).collect();
        Chart {
            title: title.into(),
            names: names.clone(),
            across: Axis::over_decades("CPU seconds", times()),
            up: Axis::over_decades("error", curves.iter().flatten().map(|p| p[1])),
            defaults: rows
                .iter()
                .filter(|row| row.setting == "fast")
                .filter_map(|row| Some([row.cpu_seconds, measure(row.cycles.as_ref()?)]))
                .collect(),
            curves,
        }
    };
    measures.iter().map(chart).collect()
}

/// The golden scenes as a table: a row per scene and setting.
pub fn golden_table(rows: &[GoldenRow]) -> Table {
    let mut table = Table::new(["scene", "quality", "RMSE", "bias", "SSIM", "FLIP"]);
    for GoldenRow {
        case,
        quality,
        likeness:
            Likeness {
                rmse,
                bias,
                ssim,
                flip,
            },
    } in rows
    {
        table.push([
            case.clone(),
            quality.to_string(),
            format!("{rmse:.5}"),
            format!("{bias:+.6}"),
            ssim.map_or_else(String::new, |ssim| format!("{ssim:.5}")),
            format!("{flip:.4}"),
        ]);
    }
    table
}

fn markdown(rows: &[RenderRow], golden: &[GoldenRow], options: &RenderReportOptions) -> String {
    let [w, h] = options.size;
    let mut text = format!(
        "# Error of the renderer against run time\n\n{}, {w} x {h}\n\n",
        options.scene.display()
    );
    if rows.iter().all(|row| row.program == "petcomp") {
        text += "Cycles' own curve is not there: `tests/benches/peers/render.py` makes it.\n\n";
    }
    text += &table(rows).markdown();
    if !golden.is_empty() {
        text += "\n## Golden scenes\n\n";
        text += &golden_table(golden).markdown();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(program: &str, cpu_seconds: f64, rmse: f64) -> RenderRow {
        let cycles = Some(Likeness {
            rmse,
            bias: 0.0,
            ssim: Some(0.9),
            flip: 0.01,
        });
        RenderRow {
            program: program.into(),
            setting: "normal".into(),
            cpu_seconds,
            cycles,
            quadrature: None,
        }
    }

    #[test]
    fn speed_is_compared_at_equal_error() {
        let mut rows = vec![
            row("petcomp", 0.01, 0.02),
            row("Cycles", 1.0, 0.04),
            row("Cycles", 16.0, 0.01),
        ];
        assert!((speed_up(&rows[0], &rows).unwrap() - 400.0).abs() < 1e-6);
        rows[0] = row("petcomp", 0.01, 0.001);
        assert_eq!(speed_up(&rows[0], &rows), None);
        assert_eq!(speed_up(&rows[1], &rows), None);
    }

    #[test]
    fn a_report_without_the_other_program_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../golden/render");
        let options = RenderReportOptions {
            scene: golden.join("one_card_and_its_shadow/scene.json"),
            size: [32, 24],
            cycles: folder.path().join("nowhere"),
            golden: folder.path().join("nowhere"),
            repeats: 1,
        };
        let (rows, golden) = write(folder.path(), &options).unwrap();
        assert_eq!((rows.len(), golden.len()), (settings().len(), 0));
        // So small a picture may be done before the system's clock of CPU time moves.
        assert!(
            rows.iter()
                .all(|row| row.cpu_seconds >= 0.0 && row.quadrature.unwrap().rmse < 0.1)
        );
        let text = io::read_text(folder.path().join("render.md")).unwrap();
        assert!(
            text.contains("Cycles' own curve is not there")
                && folder.path().join("render.svg").exists()
        );
    }

    #[test]
    fn strips_stand_in_two_columns() {
        let strip = |v| Image::filled(3, 2, LinearRgb::grey(v));
        let sheet = stacked(&[strip(0.1), strip(0.2), strip(0.3)]).unwrap();
        assert_eq!(
            (sheet[(0, 0)].r, sheet[(7, 0)].r, sheet[(0, 6)].r),
            (0.1, 0.2, 0.3)
        );
        assert_eq!((sheet[(7, 6)], stacked(&[])), (LinearRgb::WHITE, None));
    }
}
