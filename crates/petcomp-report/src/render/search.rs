//! The fastest settings for an error.

use super::{RenderRow, TimedScene};
use petcomp::Result;
use petcomp::render::RenderOptions;

/// Renderings per setting; their median counts.
const TRIAL_REPEATS: usize = 3;

/// Samples along each side of a pixel, along each side of a light, of the environment, and spacings
/// of the irradiance's nodes; all combinations are tried, from the coarsest allowed to the default.
const SUBSAMPLES: [usize; 2] = [1, 2];
const LIGHT_SAMPLES: [usize; 3] = [1, 2, 3];
const AMBIENT_SAMPLES: [usize; 5] = [2, 4, 8, 16, 32];
const CELLS_PX: [f64; 8] = [1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];

/// The fastest settings with an error of at most each of `errors`; errors that none reaches are
/// left out.
pub(super) fn quickest(
    scene: &TimedScene,
    errors: &[f64],
    repeats: usize,
) -> Result<Vec<RenderRow>> {
    if errors.is_empty() {
        return Ok(Vec::new());
    }
    let mut trials = Vec::new();
    for sampling in candidates() {
        trials.push((
            sampling,
            scene.row(&described(&sampling), &sampling, TRIAL_REPEATS)?,
        ));
    }
    trials.sort_by(|(_, a), (_, b)| a.cpu_seconds.total_cmp(&b.cpu_seconds));
    let found = errors.iter().filter_map(|&error| {
        let (sampling, row) = trials.iter().find(|(_, row)| row.has_error_within(error))?;
        let setting = format!("quickest at {error}: {}", row.setting);
        Some(scene.row(&setting, sampling, repeats))
    });
    found.collect()
}

impl RenderRow {
    fn has_error_within(&self, error: f64) -> bool {
        self.cycles.is_some_and(|likeness| likeness.rmse <= error)
    }
}

fn candidates() -> impl Iterator<Item = RenderOptions> {
    SUBSAMPLES.into_iter().flat_map(|subsamples| {
        LIGHT_SAMPLES.into_iter().flat_map(move |light_samples| {
            AMBIENT_SAMPLES
                .into_iter()
                .flat_map(move |ambient_samples| {
                    CELLS_PX.into_iter().map(move |cell_px| RenderOptions {
                        subsamples,
                        light_samples,
                        ambient_samples,
                        cell_px,
                        ..RenderOptions::default()
                    })
                })
        })
    })
}

fn described(options: &RenderOptions) -> String {
    let RenderOptions {
        subsamples,
        light_samples,
        ambient_samples,
        cell_px,
        ..
    } = options;
    format!(
        "{subsamples} x {subsamples} per pixel, {light_samples} x {light_samples} per light, {ambient_samples} for the \
         sky, cells of {cell_px} px"
    )
}
