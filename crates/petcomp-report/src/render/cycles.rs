//! The pictures of Blender's Cycles, as `tests/benches/peers/render.py` writes them.

use super::finished;
use petcomp::{Image, LinearRgb, Result, io};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The pictures of the other program.
#[derive(Default, Deserialize)]
pub(super) struct CyclesPictures {
    #[serde(skip)]
    folder: PathBuf,
    pub(super) program: String,
    pub(super) pictures: Vec<TimedPicture>,
}

#[derive(Deserialize)]
pub(super) struct TimedPicture {
    pub(super) samples: u32,
    file: String,
    pub(super) cpu_seconds: f64,
}

impl CyclesPictures {
    /// None if the folder has no `times.json`.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("times.json");
        if !path.exists() {
            return Ok(Self::default());
        }
        Ok(Self {
            folder: folder.into(),
            ..io::read_json(&path)?
        })
    }

    fn best_entry(&self) -> Option<&TimedPicture> {
        self.pictures.iter().max_by_key(|entry| entry.samples)
    }

    pub(super) fn is_best(&self, entry: &TimedPicture) -> bool {
        self.best_entry()
            .is_some_and(|best| best.samples == entry.samples)
    }

    pub(super) fn best(&self) -> Result<Option<Image<LinearRgb>>> {
        let best = self.best_entry();
        best.map(|entry| self.picture(entry)).transpose()
    }

    pub(super) fn picture(&self, entry: &TimedPicture) -> Result<Image<LinearRgb>> {
        Ok(finished(&io::read(io::inside(&self.folder, &entry.file)?)?))
    }
}
