//! How an object is found.

use super::band::LumaMode;
use super::threshold::Threshold;
use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::matte::check::{check_length, check_share};
use crate::matte::prepared::MIN_SEARCH_SIZE_PX;
use serde::{Deserialize, Serialize};

/// How an object is found on a uniform background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentOptions {
    /// What the pyramid is made of. Default: each channel by itself.
    pub tone: LumaMode,
    /// Which band of the pyramid is the coarse one, 2 to 8; the fine one is the finest. Default:
    /// none = the depth that the others agree with best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<usize>,
    /// Threshold of the finest band (`first_threshold` in files). Default: Otsu.
    #[serde(rename = "first_threshold")]
    pub finest_threshold: Threshold,
    /// Threshold of the coarsest band (`last_threshold` in files). Default: Otsu.
    #[serde(rename = "last_threshold")]
    pub coarsest_threshold: Threshold,
    /// An edge exceeds at least this multiple of the noise, regardless of the finest band's
    /// threshold. Default: 6.
    pub least_contrast: f32,
    /// An edge pixel has at least this share of the strongest value within 2 pixels, 0 to 1: thins
    /// edges. Default: 0.6.
    pub ridge: f32,
    /// Groups of fewer edge pixels are dirt or noise. Default: 4.
    pub speck: usize,
    /// Edges nearer to each other than this share of the longer side belong together. Default:
    /// 0.04.
    pub join: f64,
    /// Longer side of the picture that is searched, pixels; larger photos are reduced to it.
    /// Default: 640.
    pub working_size: usize,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            tone: LumaMode::Channels,
            levels: None,
            finest_threshold: Threshold::Otsu,
            coarsest_threshold: Threshold::Otsu,
            least_contrast: 6.0,
            ridge: 0.6,
            speck: 4,
            join: 0.04,
            working_size: 640,
        }
    }
}

impl SegmentOptions {
    /// # Errors
    /// [`Error::Value`] for the first option that cannot be right.
    #[doc(hidden)]
    pub fn check(&self) -> Result<()> {
        if let Some(levels) = self.levels.filter(|levels| !(2..=8).contains(levels)) {
            return Err(Error::value("levels", format!("{levels}, expected 2 to 8")));
        }
        let thresholds = [
            ("first_threshold", self.finest_threshold),
            ("last_threshold", self.coarsest_threshold),
        ];
        for (at, threshold) in thresholds {
            if let Threshold::Noise(times) = threshold {
                check_length(at, times)?;
            }
        }
        check_length("least_contrast", self.least_contrast)?;
        check_share("ridge", f64::from(self.ridge))?;
        check_share("join", self.join)?;
        self.tone.check()?;
        let sizes = Bounds::new(MIN_SEARCH_SIZE_PX as f64, 32_768.0, "pixels");
        sizes.check("working_size", self.working_size as f64)
    }
}
