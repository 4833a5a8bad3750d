//! The renderer's samples and filters: error against Cycles, over run time.

use crate::clock::timed;
use crate::{Diagram, Point};
use petcomp::DeepImage;
use petcomp::Image;
use petcomp::Quality;
use petcomp::composite;
use petcomp::io;
use petcomp::render::{RenderOptions, render, render_reference};
use petcomp::scene::{Shot, cycles};
use petcomp::{Error, Result};
use petcomp::{LinearRgb, PremulRgba};
use std::path::{Path, PathBuf};

/// The curve that the qualities lie on.
const PRESETS: &str = "presets";
const MEGA: f64 = 1e6;
const PIXELS: [usize; 4] = [1, 3, 4, 6];
const LIGHTS: [usize; 4] = [1, 2, 4, 6];
const SKIES: [usize; 4] = [8, 16, 64, 128];
const CELLS: [f64; 4] = [4.0, 2.0, 1.0, 0.66];
/// The scene on which filtered samples stand beside plain ones, which take a thousand times as long.
const PLAIN: &str = "tilted_translucent";
/// Samples along each side of a pixel there.
const SIDES: [usize; 5] = [1, 2, 3, 4, 6];
/// An error that eight bits do not show: half a code at middle grey.
const UNSEEN: f64 = 0.004;

/// A golden scene.
struct GoldenScene {
    name: String,
    shot: Shot,
    wanted: Image<LinearRgb>,
}

/// What a scene costs, and how wrong it is.
struct Cost {
    mean_square: f64,
    seconds: f64,
    pixels: f64,
}

/// The golden scenes at many settings, `runs` times each, and filtered samples beside plain ones; none without scenes.
///
/// # Errors
/// A scene or a picture that cannot be read.
pub fn diagrams(golden: &Path, runs: usize) -> Result<Vec<Diagram>> {
    let scenes = scenes(golden)?;
    if scenes.is_empty() {
        return Ok(Vec::new());
    }
    let mut found = samples(&scenes, runs)?;
    let plain: Vec<GoldenScene> = scenes
        .into_iter()
        .filter(|scene| scene.name == PLAIN)
        .collect();
    if !plain.is_empty() {
        found.push(filter(&plain, runs)?);
    }
    Ok(found)
}

/// Every setting, on the piles and on all scenes.
fn samples(scenes: &[GoldenScene], runs: usize) -> Result<Vec<Diagram>> {
    let (mut all, mut piles) = (Vec::new(), Vec::new());
    for (curve, setting, options) in settings() {
        let costs = measured(scenes, runs, |shot| render(shot, &options))?;
        let of = |is_in: fn(&GoldenScene) -> bool| {
            let some = scenes
                .iter()
                .zip(&costs)
                .filter(|(scene, _)| is_in(scene))
                .map(|(_, cost)| cost);
            point(curve, &setting, some).used_where(|q| curve == PRESETS && q.render() == options)
        };
        piles.push(of(GoldenScene::is_pile));
        all.push(of(|_| true));
    }
    let count = scenes.iter().filter(|scene| scene.is_pile()).count();
    let bottles = format!("{count} golden piles of 5 to 30 bottles");
    let everything = format!("{} golden scenes", scenes.len());
    Ok(vec![
        diagram(
            "render_piles",
            "render: samples, piles of bottles",
            bottles,
            piles,
        ),
        Diagram {
            why: EDGES.into(),
            ..diagram("render_all", "render: samples, all scenes", everything, all)
        },
    ])
}

/// Filtered samples and plain ones.
fn filter(scenes: &[GoldenScene], runs: usize) -> Result<Diagram> {
    let mut points = Vec::new();
    for subsamples in SIDES {
        let options = RenderOptions {
            subsamples,
            ..RenderOptions::default()
        };
        let is_default = options == RenderOptions::default();
        let setting = format!("{subsamples} x {subsamples}");
        let filtered = point(
            "filtered",
            &setting,
            &measured(scenes, runs, |shot| render(shot, &options))?,
        );
        points.push(filtered.used_where(|q| is_default && q == Quality::default()));
        points.push(point(
            "plain samples",
            &setting,
            &measured(scenes, 1, |shot| render_reference(shot, &options))?,
        ));
    }
    Ok(diagram(
        "render_filter",
        "render: filtered and plain samples",
        format!("golden scene {PLAIN}"),
        points,
    ))
}

/// What is to be known of the scenes.
const EDGES: &str = "Cards of the scenes that are no piles are bare rectangles, whose edges want more samples of a pixel than \
    cut-outs do, which end in their own soft alpha.";

fn diagram(file: &str, title: &str, input: String, points: Vec<Point>) -> Diagram {
    Diagram {
        file: file.into(),
        title: title.into(),
        input,
        error: "RMS error, scene-linear".into(),
        cost: "CPU seconds per megapixel".into(),
        reference: "Blender 3.4.1 Cycles, 2048 samples or more a pixel (golden/render)".into(),
        points,
        limit: Some((UNSEEN, "half of an 8-bit code at middle grey".into())),
        ..Diagram::default()
    }
}

/// The presets, and each number of the default changed by itself.
fn settings() -> Vec<(&'static str, String, RenderOptions)> {
    let usual = RenderOptions::default();
    let presets = super::settings()
        .into_iter()
        .map(|(name, options)| (PRESETS, name.to_owned(), options));
    let square = |n: usize| format!("{n} x {n}");
    let pixels = PIXELS.map(|n| {
        (
            "samples of a pixel",
            square(n),
            RenderOptions {
                subsamples: n,
                ..usual
            },
        )
    });
    let lights = LIGHTS.map(|n| {
        (
            "samples of a light",
            square(n),
            RenderOptions {
                light_samples: n,
                ..usual
            },
        )
    });
    let skies = SKIES.map(|n| {
        (
            "directions of the sky",
            n.to_string(),
            RenderOptions {
                ambient_samples: n,
                ..usual
            },
        )
    });
    let cells = CELLS.map(|px| {
        (
            "irradiance cells",
            format!("{px} px"),
            RenderOptions {
                cell_px: px,
                ..usual
            },
        )
    });
    presets
        .chain(pixels)
        .chain(lights)
        .chain(skies)
        .chain(cells)
        .collect()
}

fn scenes(golden: &Path) -> Result<Vec<GoldenScene>> {
    let entries = std::fs::read_dir(golden)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path());
    let mut folders: Vec<PathBuf> = entries
        .filter(|folder| folder.join("reference.exr").exists())
        .collect();
    folders.sort();
    let scene = |folder: &PathBuf| {
        let name = folder
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        let (shot, wanted) = (
            cycles::import(folder.join("scene.json"), None)?,
            io::read(folder.join("reference.exr"))?,
        );
        Ok(GoldenScene { name, shot, wanted })
    };
    folders.iter().map(scene).collect()
}

fn measured(
    scenes: &[GoldenScene],
    runs: usize,
    render: impl Fn(&Shot) -> DeepImage + Sync,
) -> Result<Vec<Cost>> {
    let cost = |scene: &GoldenScene| {
        let frame = || {
            Ok(composite::frame(
                &render(&scene.shot),
                scene.shot.plate.as_deref(),
            ))
        };
        let (frame, seconds) = timed(runs, frame)?;
        Ok(Cost {
            mean_square: mean_square(&frame, scene)?,
            seconds,
            pixels: frame.pixels().len() as f64,
        })
    };
    scenes.iter().map(cost).collect()
}

/// Root mean squared error over scenes, each counting alike, and the CPU seconds of all of them per megapixel.
fn point<'a>(curve: &str, setting: &str, costs: impl IntoIterator<Item = &'a Cost>) -> Point {
    let costs: Vec<&Cost> = costs.into_iter().collect();
    let sum = |of: fn(&Cost) -> f64| costs.iter().map(|cost| of(cost)).sum::<f64>();
    let error = (sum(|c| c.mean_square) / costs.len() as f64).sqrt();
    Point::new(
        curve,
        setting,
        sum(|c| c.seconds) / sum(|c| c.pixels) * MEGA,
        error,
    )
}

impl GoldenScene {
    /// Cut-outs of bottles in a heap: what datasets are made of.
    fn is_pile(&self) -> bool {
        self.name.starts_with("pile_of_")
    }
}

fn mean_square(frame: &Image<PremulRgba>, scene: &GoldenScene) -> Result<f64> {
    if frame.size() != scene.wanted.size() {
        let what = format!(
            "{:?} pixels, reference has {:?}",
            frame.size(),
            scene.wanted.size()
        );
        return Err(Error::value(&scene.name, what));
    }
    let pairs = frame.pixels().iter().zip(scene.wanted.pixels());
    let differences = pairs.flat_map(|(p, q)| [p.r - q.r, p.g - q.g, p.b - q.b]);
    Ok(differences.map(|d| f64::from(d).powi(2)).sum::<f64>() / (3 * frame.pixels().len()) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_of_the_default_is_changed_by_itself() {
        let usual = RenderOptions::default();
        let changed = |o: &RenderOptions| {
            [
                o.subsamples != usual.subsamples,
                o.light_samples != usual.light_samples,
                o.ambient_samples != usual.ambient_samples,
                o.cell_px != usual.cell_px,
            ]
            .into_iter()
            .filter(|c| *c)
            .count()
        };
        let all = settings();
        assert!(
            all.iter()
                .filter(|(curve, ..)| *curve != PRESETS)
                .all(|(.., o)| changed(o) == 1)
        );
        assert_eq!(
            all.iter()
                .filter(|(curve, _, o)| *curve == PRESETS && *o == usual)
                .count(),
            1
        );
    }

    #[test]
    fn a_preset_that_does_more_is_nearer_to_cycles() {
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../golden/render");
        let scenes: Vec<_> = scenes(&golden)
            .unwrap()
            .into_iter()
            .filter(|s| s.name == "pile_of_5")
            .collect();
        let measured =
            |options: RenderOptions| measured(&scenes, 1, |shot| render(shot, &options)).unwrap();
        let error = |options| point("", "", &measured(options)).error;
        let [draft, normal, high] = [
            Quality::Draft.render(),
            RenderOptions::default(),
            super::super::HIGH,
        ]
        .map(error);
        assert!(
            draft > normal && normal > high && high > 0.0,
            "{draft} {normal} {high}"
        );
    }

    #[test]
    fn no_scenes_give_no_diagram() {
        assert_eq!(diagrams(Path::new("nowhere at all"), 1).unwrap(), []);
    }
}
