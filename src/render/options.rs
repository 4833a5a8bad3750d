//! Sampling density of a picture.

use crate::bounds::Bounds;
use crate::error::Result;
use crate::quality::Quality;
use serde::{Deserialize, Serialize};

/// Sampling density of a picture; the same numbers give the same bits.
///
/// There is one for each [`Quality`], on the measured curve of error (against Cycles) over run
/// time.
///
/// ```
/// use petcomp::Quality;
/// use petcomp::render::RenderOptions;
///
/// assert_eq!(RenderOptions::from(Quality::Normal), RenderOptions::default());
/// let finer = RenderOptions { subsamples: 4, ..RenderOptions::default() };
/// assert!(finer.check().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderOptions {
    /// Samples along each side of a pixel, 1 to 16. Default: 2.
    pub subsamples: usize,
    /// Maximum samples along each side of a square light, 1 to 32: a small light with narrow
    /// penumbrae in the picture gets fewer, an oblong one the same total, with more along its
    /// longer side. Default: 3.
    pub light_samples: usize,
    /// Directions sampled for the environment, 1 to 4096. Default: 32.
    pub ambient_samples: usize,
    /// Spacing of the irradiance samples, 0.25 to 16 pixels. Default: 1.5. In pictures longer than
    /// 960 pixels it grows with them: their shadows are no sharper, they only span more pixels. In
    /// those shorter than 320 pixels it shrinks, down to 0.75 pixels.
    pub cell_px: f64,
    /// Whether objects whose refraction was measured displace what is seen through them. Default:
    /// true.
    #[serde(skip_serializing_if = "Clone::clone")]
    pub refraction: bool,
}

impl From<Quality> for RenderOptions {
    fn from(quality: Quality) -> Self {
        match quality {
            Quality::Draft => Self {
                subsamples: 1,
                light_samples: 2,
                ambient_samples: 12,
                cell_px: 2.0,
                refraction: true,
            },
            Quality::Normal => Self {
                subsamples: 2,
                light_samples: 3,
                ambient_samples: 32,
                cell_px: 1.5,
                refraction: true,
            },
            Quality::Reference => Self {
                subsamples: 6,
                light_samples: 8,
                ambient_samples: 400,
                cell_px: 0.33,
                refraction: true,
            },
        }
    }
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self::from(Quality::Normal)
    }
}

/// `Quality::Reference` has 6; beyond 16 the error is below a code of 8 bits, and the time
/// unbounded.
const SUBSAMPLES: Bounds = Bounds::new(1.0, 16.0, "quality reference has 6");
const LIGHT_SAMPLES: Bounds = Bounds::new(1.0, 32.0, "quality reference has 8");
const AMBIENT_SAMPLES: Bounds = Bounds::new(1.0, 4096.0, "quality reference has 400");
const CELL_PX: Bounds = Bounds::new(0.25, 16.0, "pixels; smaller cells resolve no more");

/// Longest pictures whose cells are used as given. Two of 1920 x 1080 with 30 bottles have the same
/// error at cells of 1.5 and 3 pixels (0.00167, 0.00166), and 8 % more at 4.5.
const MAX_CELL_IMAGE_PX: f64 = 960.0;

/// Shortest pictures whose cells are used as given: in smaller ones a cell is as large as what it
/// shows, and shadows under cards darken what is beside them.
const MIN_CELL_IMAGE_PX: f64 = 320.0;
/// Cells of small pictures shrink to this at most. Of 20 objects at 160 x 120, those of 0.75 pixels
/// have 0.73 of the error of 1.5 pixels, in 1.7 of the time; finer ones cost more than they give.
const MIN_SHRUNK_CELL_PX: f64 = 0.75;

impl RenderOptions {
    /// Fails on the first useless number: zero, or so large that a picture takes hours.
    ///
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) with the option's name.
    pub fn check(&self) -> Result<()> {
        SUBSAMPLES.check("subsamples", self.subsamples as f64)?;
        LIGHT_SAMPLES.check("light_samples", self.light_samples as f64)?;
        AMBIENT_SAMPLES.check("ambient_samples", self.ambient_samples as f64)?;
        CELL_PX.check("cell_px", self.cell_px)
    }

    /// The options for a picture of some width and height.
    pub(super) fn for_image(self, image: [u32; 2]) -> Self {
        let longer = f64::from(image[0].max(image[1]));
        let finest = self.cell_px.min(MIN_SHRUNK_CELL_PX);
        let shrunk = self.cell_px * (longer / MIN_CELL_IMAGE_PX).min(1.0);
        Self {
            cell_px: shrunk.max(finest) * (longer / MAX_CELL_IMAGE_PX).max(1.0),
            ..self
        }
    }

    /// The options with every number clamped to the range that the arithmetic supports: at least
    /// one sample, cells of 0.25 to 16 pixels.
    pub(super) fn clamped(self) -> Self {
        Self {
            subsamples: self.subsamples.clamp(1, 64),
            light_samples: self.light_samples.clamp(1, 64),
            ambient_samples: self.ambient_samples.clamp(1, 4096),
            cell_px: clamped_cell(self.cell_px),
            refraction: self.refraction,
        }
    }
}

fn clamped_cell(cell_px: f64) -> f64 {
    if cell_px.is_finite() {
        cell_px.clamp(0.25, 16.0)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_each_quality_stay() {
        let numbers = Quality::ALL.map(|quality| {
            let o = RenderOptions::from(quality);
            (o.subsamples, o.light_samples, o.ambient_samples, o.cell_px)
        });
        assert_eq!(
            numbers,
            [(1, 2, 12, 2.0), (2, 3, 32, 1.5), (6, 8, 400, 0.33)]
        );
    }

    #[test]
    fn cells_follow_the_size_of_very_large_and_small_pictures() {
        let cell = |image| RenderOptions::default().for_image(image).cell_px;
        let cells = [
            [120, 160],
            [320, 240],
            [960, 960],
            [1080, 1920],
            [3840, 2160],
        ]
        .map(cell);
        assert_eq!(cells, [0.75, 1.5, 1.5, 3.0, 6.0]);
        let reference = RenderOptions::from(Quality::Reference);
        assert_eq!(reference.for_image([16, 12]), reference);
    }

    #[test]
    fn numbers_without_an_end_or_a_beginning_are_refused() {
        assert!(
            Quality::ALL
                .into_iter()
                .all(|quality| RenderOptions::from(quality).check().is_ok())
        );
        let message = |spoil: &dyn Fn(&mut RenderOptions)| {
            let mut options = RenderOptions::default();
            spoil(&mut options);
            options.check().unwrap_err().to_string()
        };
        assert_eq!(
            message(&|o| o.subsamples = 1_000_000),
            "subsamples: 1000000, expected 1 to 16 (quality reference has 6)"
        );
        assert!(message(&|o| o.subsamples = 0).starts_with("subsamples: 0, expected 1 to 16"));
        assert!(message(&|o| o.light_samples = usize::MAX).starts_with("light_samples: 1.8"));
        assert!(message(&|o| o.ambient_samples = 0).starts_with("ambient_samples: 0"));
        for cell_px in [0.0, -1.0, f64::NAN] {
            let told = message(&|o| o.cell_px = cell_px);
            assert!(told.starts_with("cell_px: "), "{cell_px}");
        }
    }
}
