//! Error of the renderer against run time: its presets compared with Cycles at many sample counts,
//! and the golden scenes.
//!
//! Times are CPU seconds of the rendering itself, after textures have been read and their mip
//! levels built.

mod cycles;
mod diagram;
mod golden;
mod search;
mod show;

use super::clock::timed;
use super::files::write_texts;
use clap::builder::RangedU64ValueParser;
use cycles::{CyclesPictures, TimedPicture};
pub(crate) use diagram::diagrams;
use golden::{GoldenRow, golden};
use petcomp::diff::Likeness;
use petcomp::plot::{Chart, Table};
use petcomp::render::{RenderOptions, render_reference};
use petcomp::scene::Shot;
use petcomp::{Image, LinearRgb, PremulRgba, Quality, Result, composite, io};
use show::{charts, golden_table, table};
use std::path::PathBuf;

#[expect(
    missing_docs,
    reason = "its documentation would be the program's: clap prints it"
)]
#[derive(clap::Args)]
pub struct RenderReportOptions {
    /// Scene file of the reference renderer: a golden one, or one written by `scene export`
    #[arg(default_value = "golden/render/pile_of_20/scene.json")]
    scene: PathBuf,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    pub output: PathBuf,
    /// Width and height of the images, 1 to 4096
    #[arg(
        long,
        num_args = 2,
        value_names = ["W", "H"],
        default_values_t = [320, 240],
        value_parser = clap::value_parser!(u32).range(1..=4096)
    )]
    size: Vec<u32>,
    /// Folder of Cycles' images of the same scene and size, rendered by
    /// tests/benches/peers/render.py
    #[arg(long, value_name = "FOLDER", default_value = "report/cycles")]
    cycles: PathBuf,
    /// Folder of golden scenes, also compared
    #[arg(long, value_name = "FOLDER", default_value = "golden/render")]
    golden: PathBuf,
    /// Renderings per preset, 1 to 1000; their median is reported
    #[arg(
        long,
        value_name = "N",
        default_value_t = 5,
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000)
    )]
    repeats: usize,
    /// Errors against Cycles at which to search for the fastest settings
    #[arg(long, value_name = "RMSE", value_delimiter = ',')]
    quickest_at: Vec<f64>,
}

impl RenderReportOptions {
    fn size(&self) -> [u32; 2] {
        [self.size[0], self.size[1]]
    }

    fn import(&self, size: [u32; 2]) -> Result<Shot> {
        petcomp::scene::cycles::import(&self.scene, Some(size))
    }
}

/// The quadrature renders a quarter of the picture's sides, since it takes a thousand times as
/// long.
const QUADRATURE_SHRINK: u32 = 4;
/// Sampling density of the quadrature: sub-samples, light samples (per side each) and directions of
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
/// The setting used for the sheet of golden scenes.
const SHEET_SETTING: &str = "good";

/// Points on the curve of error over run time, the fastest first: each [`Quality`], and two
/// settings finer than the default.
pub(crate) fn settings() -> [(&'static str, RenderOptions); 5] {
    let [draft, normal, reference] = Quality::ALL.map(|quality| (quality.name(), quality.render()));
    [draft, normal, ("good", GOOD), ("high", HIGH), reference]
}

/// A picture and its error.
struct RenderRow {
    /// `petcomp` or the other program with its version.
    program: String,
    /// Setting, or samples per pixel.
    setting: String,
    cpu_seconds: f64,
    /// Compared with the other program's best picture; none without one, or for that picture
    /// itself.
    cycles: Option<Likeness>,
    /// Compared with the quadrature of the definition, at a quarter of the sides.
    quadrature: Option<Likeness>,
}

impl RenderRow {
    fn is_petcomp(&self) -> bool {
        self.program == PETCOMP
    }
}

/// Measures and writes `render.csv`, `render.md` and `render.svg` into a folder, and for the golden
/// scenes `render_golden.csv` and the sheet `render_golden.png`: each scene as reference, 16 times
/// the difference, and our picture. Returns the table, and the number of golden pictures.
///
/// # Errors
/// A scene or a picture that cannot be read; files that cannot be written.
pub fn write(options: &RenderReportOptions) -> Result<(Table, usize)> {
    let folder = &options.output;
    io::create_folder(folder)?;
    let rows = measure(options)?;
    let (golden, sheet) = golden(&options.golden, SHEET_SETTING)?;
    let table = table(&rows);
    let files = [
        ("render.csv", &*table.csv()),
        ("render.md", &show::markdown(&rows, &golden, options)),
        ("render.svg", &Chart::row(&charts(&rows))),
    ];
    write_texts(folder, files)?;
    if let Some(sheet) = sheet {
        let data = golden_table(&golden).csv();
        write_texts(folder, [("render_golden.csv", &data)])?;
        io::write(folder.join("render_golden.png"), &sheet)?;
    }
    Ok((table, golden.len()))
}

/// Measures every setting, and every available picture of the other program.
fn measure(options: &RenderReportOptions) -> Result<Vec<RenderRow>> {
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

/// The timed scene, and its reference pictures.
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
        let size = options.size();
        let small = options.import(size.map(|side| (side / QUADRATURE_SHRINK).max(1)))?;
        let deep = render_reference(&small, &QUADRATURE);
        Ok(Self {
            shot: options.import(size)?,
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
    use super::show::speed_up;
    use super::*;
    use std::path::Path;

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
            output: folder.path().into(),
            size: vec![32, 24],
            cycles: folder.path().join("nowhere"),
            golden: folder.path().join("nowhere"),
            repeats: 1,
            quickest_at: vec![0.01],
        };
        let (table, golden_pictures) = write(&options).unwrap();
        assert_eq!((table.rows.len(), golden_pictures), (settings().len(), 0));
        // Such a small picture may be finished before the system's clock of CPU time advances.
        let number = |row: &[String], i: usize| row[i].parse::<f64>().unwrap();
        assert!(
            table
                .rows
                .iter()
                .all(|row| number(row, 2) >= 0.0 && number(row, 7) < 0.1)
        );
        let text = io::read_text(folder.path().join("render.md")).unwrap();
        assert!(
            text.contains("Cycles' curve is missing") && folder.path().join("render.svg").exists()
        );
    }
}
