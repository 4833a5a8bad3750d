//! Pictures of a recipe while it is edited: small, coarse and fast.
//!
//! Whatever is the same from one picture to the next is cached: assets, photos and their cameras,
//! and falls, which take most of the time and depend on few settings.

use super::draft::Edits;
use crate::folder::Folder;
use crate::picture::jpeg;
use crate::refusal::{Answer, Refusal};
use crate::turn::Turn;
use axum::http::StatusCode;
use axum::response::Response;
use petcomp::color::encode_srgb8;
use petcomp::dataset::{DatasetConfig, Pipeline, Sample};
use petcomp::label::overlay;
use petcomp::render::RenderOptions;
use petcomp::{Image, Quality, Srgb8};
use serde::Deserialize;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum work for a picture previewed while a slider moves; a heap of 100 cards takes about 2
/// million.
const MOST_WORK: u64 = 10_000_000;
/// Longer sides of small pictures, pixels.
const SIDES_PX: std::ops::RangeInclusive<u32> = 64..=1024;
/// Number of opened recipes kept: before and after, small and whole.
const KEPT: usize = 4;

/// The requested picture.
#[derive(Debug, Deserialize)]
pub(super) struct PictureAsked {
    file: String,
    edits: Edits,
    seed: u64,
    /// Number of the scene.
    k: u64,
    /// Longer side of a small picture, pixels; by default the picture has the size of a dataset's.
    side: Option<u32>,
    /// Whether to draw boxes and outlines.
    #[serde(default)]
    labels: bool,
    /// Where it is shown: a newer request for the same slot cancels this one.
    pub(super) slot: String,
}

/// Opened recipes, the most recently used at the end, and lanes in which pictures queue.
pub(super) struct Pipelines {
    kept: Mutex<Vec<Arc<Pipeline>>>,
    /// One per core.
    lanes: Vec<Mutex<()>>,
}

impl Default for Pipelines {
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            kept: Mutex::default(),
            lanes: (0..cores).map(|_| Mutex::default()).collect(),
        }
    }
}

impl Pipelines {
    /// Reopens everything on next use.
    pub(super) fn forget(&self) {
        self.kept().clear();
    }

    /// A picture of a recipe, unless it has been superseded by the time it is its turn.
    pub(super) fn picture(
        &self,
        folder: &Folder,
        asked: &PictureAsked,
        turn: &Turn,
    ) -> Answer<Response> {
        let lane = &self.lanes[(asked.k % self.lanes.len() as u64) as usize];
        let _lane = lane.lock().unwrap_or_else(PoisonError::into_inner);
        turn.check()?;
        let whole = asked.config(folder)?;
        let image = whole.scene.image;
        let config = asked.reduced(whole);
        let pipeline = self.opened(&config, image)?.with_config(config, image)?;
        turn.check()?;
        let sample = pipeline.sample(asked.seed, asked.k)?;
        jpeg(&asked.shown(&sample, &pipeline))
    }

    /// A pipeline with the assets and photos of a config; `whole` is the size of the recipe's own
    /// pictures.
    fn opened(&self, config: &DatasetConfig, whole: [u32; 2]) -> Answer<Arc<Pipeline>> {
        let mut kept = self.kept();
        if let Some(place) = kept.iter().position(|known| opens_same(known, config)) {
            kept[place..].rotate_left(1);
            return Ok(kept[kept.len() - 1].clone());
        }
        let opened = Arc::new(Pipeline::for_tuning(config.clone(), whole)?);
        kept.push(opened.clone());
        let surplus = kept.len().saturating_sub(KEPT);
        kept.drain(..surplus);
        Ok(opened)
    }

    fn kept(&self) -> MutexGuard<'_, Vec<Arc<Pipeline>>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn opens_same(known: &Pipeline, config: &DatasetConfig) -> bool {
    let known = known.config();
    (&known.assets, &known.backgrounds, known.scene.image)
        == (&config.assets, &config.backgrounds, config.scene.image)
}

impl PictureAsked {
    /// The recipe with its edits, as used for a dataset.
    fn config(&self, folder: &Folder) -> Answer<DatasetConfig> {
        let path = folder.file(&self.file)?;
        let text = self.edits.apply(&folder.read_text(&self.file)?.text)?;
        let config = DatasetConfig::parse(&text, &path, &[])?;
        check_stays_inside(&config, folder)?;
        Ok(config)
    }

    /// The same for the requested picture.
    fn reduced(&self, config: DatasetConfig) -> DatasetConfig {
        match self.side {
            Some(side) => small(config, side),
            None => config,
        }
    }

    fn shown(&self, sample: &Sample, pipeline: &Pipeline) -> Image<Srgb8> {
        if self.labels {
            overlay(&sample.frame, &sample.labels, &pipeline.library().classes)
        } else {
            sample.frame.map(|pixel| encode_srgb8(pixel.color()))
        }
    }
}

/// A recipe may name folders anywhere; a studio opens only those inside its own folder.
fn check_stays_inside(config: &DatasetConfig, folder: &Folder) -> Answer<()> {
    let maps = config.scene.environment.files.iter();
    let maps = maps.map(|file| ("scene.environment.files", config.folder.join(file)));
    let folders = [
        ("assets", config.assets.clone()),
        ("backgrounds", config.backgrounds.clone()),
    ];
    folders.into_iter().chain(maps).try_for_each(|(key, path)| {
        if folder.holds(&path) {
            return Ok(());
        }
        Err(outside(key, &path))
    })
}

fn outside(key: &str, path: &Path) -> Refusal {
    let path = petcomp::printable(&path.to_string_lossy());
    let what = format!(
        "{key}: {path} is outside this studio's folder; run `petcomp studio` on a folder that contains the recipe and everything it names"
    );
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, what)
}

/// The recipe with small and coarse pictures of the same scenes; values in pixels are scaled down
/// with them.
fn small(mut config: DatasetConfig, side: u32) -> DatasetConfig {
    let side = side.clamp(*SIDES_PX.start(), *SIDES_PX.end());
    let longer = config.scene.image[0].max(config.scene.image[1]);
    let factor = (f64::from(side) / f64::from(longer)).min(1.0);
    let image = config.scene.image;
    config = config.with_image(image.map(|side| (f64::from(side) * factor).round() as u32));
    config.render = RenderOptions::from(Quality::Draft);
    config.scene.settle.most_work = config.scene.settle.most_work.min(MOST_WORK);
    config
}
