//! Error of the renderer against run time: its presets beside Cycles at many sample counts, and the
//! golden scenes.
//!
//! Times are CPU seconds of the rendering itself, textures read and their pyramids built.

mod cycles;
mod diagram;
mod golden;
mod search;
mod show;

pub use diagram::diagrams;
pub use golden::{GoldenRow, golden};
pub use show::{charts, golden_table, speed_up, table};

use super::clock::timed;
use super::files::write_texts;
use cycles::{CyclesPictures, TimedPicture};
use petcomp::Image;
use petcomp::Quality;
use petcomp::diff::Likeness;
use petcomp::plot::Chart;
use petcomp::render::{RenderOptions, render_reference};
use petcomp::scene::Shot;
use petcomp::{LinearRgb, PremulRgba};
use petcomp::{Result, composite, io};
use std::path::{Path, PathBuf};

/// Options of the report.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderReportOptions {
    /// Scene file of the reference renderer that is timed.
    pub scene: PathBuf,
    /// Size that it is rendered at, pixels. Default: 320 x 240.
    pub size: [u32; 2],
    /// What `tests/benches/peers/render.py` wrote for that scene and size; a folder without
    /// `times.json` is left out.
    pub cycles: PathBuf,
    /// Folder of golden scenes; one without scenes is left out.
    pub golden: PathBuf,
    /// Renderings per setting, of which the median is reported. Default: 5.
    pub repeats: usize,
    /// Errors against Cycles (RMSE) at which the quickest settings are searched for. Default: none.
    pub quickest_at: Vec<f64>,
}

impl RenderReportOptions {
    fn import(&self, size: [u32; 2]) -> Result<Shot> {
        petcomp::scene::cycles::import(&self.scene, Some(size))
    }
}

/// The quadrature renders a quarter of the picture's sides: it takes a thousand times as long.
const QUADRATURE_SHRINK: u32 = 4;
/// How finely the quadrature is sampled: sub-samples, light samples (a side each) and directions of
/// the environment.
const QUADRATURE: RenderOptions = RenderOptions {
    subsamples: 6,
    light_samples: 6,
    ambient_samples: 196,
    cell_px: 1.0,
    refraction: true,
};

/// Between the default and a reference: 2 x 2 samples a pixel, 4 x 4 a light.
pub(super) const GOOD: RenderOptions = RenderOptions {
    subsamples: 2,
    light_samples: 4,
    ambient_samples: 64,
    cell_px: 1.0,
    refraction: true,
};

/// The same with 3 x 3 samples a pixel, 6 x 6 a light.
pub(super) const HIGH: RenderOptions = RenderOptions {
    subsamples: 3,
    light_samples: 6,
    ambient_samples: 100,
    cell_px: 0.66,
    refraction: true,
};

/// The name of this program in tables.
const PETCOMP: &str = "petcomp";
/// The setting of which the sheet of golden scenes is made.
const SHEET_SETTING: &str = "good";

/// Points on the curve of error over run time, the quickest first: each [`Quality`], and two finer
/// than the default.
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

impl RenderRow {
    fn is_petcomp(&self) -> bool {
        self.program == PETCOMP
    }
}

/// Measures and writes `render.csv`, `render.md` and `render.svg` into a folder, and of the golden
/// scenes `render_golden.csv` and the sheet `render_golden.png`: each scene as reference, 16 times
/// the difference, and ours.
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
    let (golden, sheet) = golden(&options.golden, SHEET_SETTING)?;
    let files = [
        ("render.csv", &*table(&rows).csv()),
        ("render.md", &show::markdown(&rows, &golden, options)),
        ("render.svg", &Chart::row(&charts(&rows))),
    ];
    write_texts(folder, files)?;
    if let Some(sheet) = sheet {
        let data = golden_table(&golden).csv();
        write_texts(folder, [("render_golden.csv", &data)])?;
        io::write(folder.join("render_golden.png"), &sheet)?;
    }
    Ok((rows, golden))
}

/// Every setting, and every picture of the other program that is there.
///
/// # Errors
/// As [`write()`].
pub fn measure(options: &RenderReportOptions) -> Result<Vec<RenderRow>> {
    let others = CyclesPictures::read(&options.cycles)?;
    let timed_scene = TimedScene::new(options, others.best()?)?;
    let mut rows = Vec::new();
    for (name, sampling) in settings() {
        rows.push(timed_scene.row(name, &sampling, options.repeats)?);
    }
    rows.extend(search::quickest(
        &timed_scene,
        &options.quickest_at,
        options.repeats,
    )?);
    for entry in &others.pictures {
        rows.push(timed_scene.cycles_row(&others, entry)?);
    }
    Ok(rows)
}

/// The scene that is timed, and what its picture should be.
struct TimedScene {
    shot: Shot,
    small: Shot,
    /// The quadrature of the small picture.
    quadrature: Image<LinearRgb>,
    /// The other program's best picture.
    best: Option<Image<LinearRgb>>,
}

impl TimedScene {
    fn new(options: &RenderReportOptions, best: Option<Image<LinearRgb>>) -> Result<Self> {
        let small = options.import(options.size.map(|side| (side / QUADRATURE_SHRINK).max(1)))?;
        let deep = render_reference(&small, &QUADRATURE);
        Ok(Self {
            shot: options.import(options.size)?,
            quadrature: finished(&composite::frame(&deep, small.plate.as_deref())),
            small,
            best,
        })
    }

    fn row(&self, setting: &str, sampling: &RenderOptions, repeats: usize) -> Result<RenderRow> {
        let (picture, cpu_seconds) = timed(repeats, || Ok(picture_of(&self.shot, sampling)))?;
        let small = picture_of(&self.small, sampling);
        Ok(RenderRow {
            program: PETCOMP.into(),
            setting: setting.into(),
            cpu_seconds,
            cycles: self.likeness_to_best(&picture),
            quadrature: Likeness::measure(&small, &self.quadrature),
        })
    }

    fn cycles_row(&self, others: &CyclesPictures, entry: &TimedPicture) -> Result<RenderRow> {
        let cycles = if others.is_best(entry) {
            None
        } else {
            self.likeness_to_best(&others.picture(entry)?)
        };
        Ok(RenderRow {
            program: format!("Cycles {}", others.program),
            setting: format!("{} spp", entry.samples),
            cpu_seconds: entry.cpu_seconds,
            cycles,
            quadrature: None,
        })
    }

    fn likeness_to_best(&self, picture: &Image<LinearRgb>) -> Option<Likeness> {
        Likeness::measure(picture, self.best.as_ref()?)
    }
}

fn picture_of(shot: &Shot, options: &RenderOptions) -> Image<LinearRgb> {
    finished(&composite::picture(shot, options))
}

fn finished(frame: &Image<PremulRgba>) -> Image<LinearRgb> {
    frame.map(PremulRgba::color)
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
            quickest_at: vec![0.01],
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
}
