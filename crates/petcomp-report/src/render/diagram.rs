//! Samples and filters of the renderer: error against Cycles, over run time.

use super::golden::GoldenScene;
use crate::clock::timed;
use crate::diagram::invisible_error;
use crate::{Diagram, Point};
use petcomp::composite::{frame, picture};
use petcomp::render::{RenderOptions, render_reference};
use petcomp::scene::Shot;
use petcomp::{Image, LinearRgb, PremulRgba, Quality, Result};
use std::path::Path;

/// The curve that the qualities lie on.
const PRESETS: &str = "presets";
const PIXELS_PER_MEGAPIXEL: f64 = 1e6;
const PIXEL_SAMPLES: [usize; 4] = [1, 3, 4, 6];
const LIGHT_SAMPLES: [usize; 4] = [1, 2, 4, 6];
const SKY_SAMPLES: [usize; 4] = [8, 16, 64, 128];
const CELLS_PX: [f64; 4] = [4.0, 2.0, 1.0, 0.66];
/// The scene on which filtered and plain samples are compared; plain ones take a thousand times as
/// long.
const PLAIN_SCENE: &str = "tilted_translucent";
/// Samples along each side of a pixel there.
const PLAIN_SIDES: [usize; 5] = [1, 2, 3, 4, 6];

/// Cost and error of a scene.
struct SceneCost {
    mean_square: f64,
    seconds: f64,
    pixels: f64,
}

/// The golden scenes at many settings, `runs` times each, and filtered samples compared with plain
/// ones; none without scenes.
pub(crate) fn diagrams(golden: &Path, runs: usize) -> Result<Vec<Diagram>> {
    let scenes = GoldenScene::all_in(golden)?;
    if scenes.is_empty() {
        return Ok(Vec::new());
    }
    let mut found = sample_diagrams(&scenes, runs)?;
    if let Some(scene) = scenes.iter().find(|scene| scene.name == PLAIN_SCENE) {
        found.push(filter_diagram(scene, runs)?);
    }
    Ok(found)
}

/// Every setting, on the piles and on all scenes.
fn sample_diagrams(scenes: &[GoldenScene], runs: usize) -> Result<Vec<Diagram>> {
    let (mut all, mut piles) = (Vec::new(), Vec::new());
    for setting in render_settings() {
        let costs = measure_scenes(scenes, runs, |shot| picture(shot, &setting.options))?;
        let of_piles = scenes.iter().zip(&costs).filter(|(s, _)| s.is_pile());
        piles.push(setting.point(of_piles.map(|(_, cost)| cost)));
        all.push(setting.point(&costs));
    }
    let pile_count = scenes.iter().filter(|scene| scene.is_pile()).count();
    Ok(vec![
        pile_diagram(piles, pile_count),
        all_scenes_diagram(all, scenes.len()),
    ])
}

fn pile_diagram(points: Vec<Point>, count: usize) -> Diagram {
    Diagram {
        file: "render_piles".into(),
        title: "render: samples, piles of bottles".into(),
        input: format!("{count} golden piles of 5 to 30 bottles"),
        ..golden_diagram(points)
    }
}

fn all_scenes_diagram(points: Vec<Point>, count: usize) -> Diagram {
    Diagram {
        file: "render_all".into(),
        title: "render: samples, all scenes".into(),
        input: format!("{count} golden scenes"),
        why: EDGE_NOTE.into(),
        ..golden_diagram(points)
    }
}

/// Filtered samples and plain ones.
fn filter_diagram(scene: &GoldenScene, runs: usize) -> Result<Diagram> {
    let mut points = Vec::new();
    for side in PLAIN_SIDES {
        points.extend(filter_points(scene, side, runs)?);
    }
    Ok(Diagram {
        file: "render_filter".into(),
        title: "render: filtered and plain samples".into(),
        input: format!("golden scene {PLAIN_SCENE}"),
        ..golden_diagram(points)
    })
}

fn filter_points(scene: &GoldenScene, subsamples: usize, runs: usize) -> Result<[Point; 2]> {
    let default = RenderOptions::default();
    let options = RenderOptions {
        subsamples,
        ..default
    };
    let setting = square_name(subsamples);
    let filtered = scene.measure(runs, |shot| picture(shot, &options))?;
    let plain = scene.measure(1, |shot| {
        frame(&render_reference(shot, &options), shot.plate.as_deref())
    })?;
    let filtered = mean_point("filtered", &setting, [&filtered]);
    Ok([
        filtered.used_where(|quality| options == default && quality == Quality::default()),
        mean_point("plain samples", &setting, [&plain]),
    ])
}

/// Scenes that need more samples.
const EDGE_NOTE: &str = "Cards in scenes other than piles are bare rectangles, whose edges need more samples per pixel \
    than those of cut-outs, which have a soft alpha of their own.";

/// Properties shared by all diagrams.
fn golden_diagram(points: Vec<Point>) -> Diagram {
    Diagram {
        error: "RMS error, scene-linear".into(),
        cost: "CPU seconds per megapixel".into(),
        reference: "Blender 3.4.1 Cycles, 2048 or more samples per pixel (golden/render)".into(),
        points,
        limit: invisible_error(),
        ..Diagram::default()
    }
}

/// A point of a curve.
struct RenderSetting {
    curve: &'static str,
    name: String,
    options: RenderOptions,
}

impl RenderSetting {
    fn new(curve: &'static str, name: String, options: RenderOptions) -> Self {
        Self {
            curve,
            name,
            options,
        }
    }

    /// The default with one number changed.
    fn changed(curve: &'static str, name: String, change: impl FnOnce(&mut RenderOptions)) -> Self {
        let mut options = RenderOptions::default();
        change(&mut options);
        Self::new(curve, name, options)
    }

    fn is_preset(&self) -> bool {
        self.curve == PRESETS
    }

    fn point<'a>(&self, costs: impl IntoIterator<Item = &'a SceneCost>) -> Point {
        mean_point(self.curve, &self.name, costs)
            .used_where(|q| self.is_preset() && q.render() == self.options)
    }
}

/// The presets, and the default with each number changed separately.
fn render_settings() -> Vec<RenderSetting> {
    let presets = super::settings()
        .map(|(name, options)| RenderSetting::new(PRESETS, name.to_owned(), options));
    presets
        .into_iter()
        .chain(PIXEL_SAMPLES.map(|n| {
            RenderSetting::changed("samples per pixel", square_name(n), |o| o.subsamples = n)
        }))
        .chain(LIGHT_SAMPLES.map(|n| {
            RenderSetting::changed("samples per light", square_name(n), |o| o.light_samples = n)
        }))
        .chain(SKY_SAMPLES.map(|n| {
            RenderSetting::changed("directions of the sky", n.to_string(), |o| {
                o.ambient_samples = n
            })
        }))
        .chain(CELLS_PX.map(|px| {
            RenderSetting::changed("irradiance cells", format!("{px} px"), |o| o.cell_px = px)
        }))
        .collect()
}

fn square_name(side: usize) -> String {
    format!("{side} x {side}")
}

fn measure_scenes(
    scenes: &[GoldenScene],
    runs: usize,
    picture: impl Fn(&Shot) -> Image<PremulRgba> + Sync,
) -> Result<Vec<SceneCost>> {
    scenes
        .iter()
        .map(|scene| scene.measure(runs, &picture))
        .collect()
}

impl GoldenScene {
    /// Whether it is a heap of bottles, like the scenes of datasets.
    fn is_pile(&self) -> bool {
        self.name.starts_with("pile_of_")
    }

    fn measure(
        &self,
        runs: usize,
        picture: impl Fn(&Shot) -> Image<PremulRgba> + Sync,
    ) -> Result<SceneCost> {
        let (frame, seconds) = timed(runs, || Ok(picture(&self.shot)))?;
        Ok(SceneCost {
            mean_square: self.mean_square_error(&frame)?,
            seconds,
            pixels: frame.pixels().len() as f64,
        })
    }

    fn mean_square_error(&self, frame: &Image<PremulRgba>) -> Result<f64> {
        if frame.size() != self.wanted.size() {
            return Err(self.size_error(frame.size()));
        }
        let pairs = frame.pixels().iter().zip(self.wanted.pixels());
        let sum: f64 = pairs.flat_map(|(p, q)| squared_differences(p, q)).sum();
        Ok(sum / (3 * frame.pixels().len()) as f64)
    }
}

fn squared_differences(a: &PremulRgba, b: &LinearRgb) -> [f64; 3] {
    [a.r - b.r, a.g - b.g, a.b - b.b].map(|d| f64::from(d).powi(2))
}

/// Root mean squared error over scenes of equal weight, and their total CPU seconds per megapixel.
fn mean_point<'a>(
    curve: &str,
    setting: &str,
    costs: impl IntoIterator<Item = &'a SceneCost>,
) -> Point {
    let costs: Vec<&SceneCost> = costs.into_iter().collect();
    let mean_square = total(&costs, |cost| cost.mean_square) / costs.len() as f64;
    Point::new(
        curve,
        setting,
        seconds_per_megapixel(&costs),
        mean_square.sqrt(),
    )
}

fn seconds_per_megapixel(costs: &[&SceneCost]) -> f64 {
    let pixels = total(costs, |cost| cost.pixels);
    total(costs, |cost| cost.seconds) / pixels * PIXELS_PER_MEGAPIXEL
}

fn total(costs: &[&SceneCost], of: fn(&SceneCost) -> f64) -> f64 {
    costs.iter().map(|cost| of(cost)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_of_the_default_is_changed_by_itself() {
        let default = RenderOptions::default();
        let changed = |o: &RenderOptions| {
            [
                o.subsamples != default.subsamples,
                o.light_samples != default.light_samples,
                o.ambient_samples != default.ambient_samples,
                o.cell_px != default.cell_px,
            ]
            .into_iter()
            .filter(|c| *c)
            .count()
        };
        let all = render_settings();
        assert!(
            all.iter()
                .filter(|s| !s.is_preset())
                .all(|s| changed(&s.options) == 1)
        );
        let is_default = |s: &&RenderSetting| s.is_preset() && s.options == default;
        assert_eq!(all.iter().filter(is_default).count(), 1);
    }

    #[test]
    fn a_preset_that_does_more_is_nearer_to_cycles() {
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../golden/render");
        let scenes = GoldenScene::all_in(&golden).unwrap();
        let pile = scenes.iter().find(|s| s.name == "pile_of_5").unwrap();
        let error = |options: RenderOptions| {
            let cost = pile.measure(1, |shot| picture(shot, &options)).unwrap();
            mean_point("", "", [&cost]).error
        };
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
