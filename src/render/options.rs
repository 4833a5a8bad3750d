//! How much work goes into a picture.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A named point on the curve of error against time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// For a look.
    Draft,
    /// For training pictures.
    #[default]
    Fast,
    /// For pictures that people look at.
    Good,
    /// For comparisons.
    High,
    /// As near to the definition as it gets, at seconds a picture.
    Reference,
}

/// How finely a picture is sampled; the same numbers give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderOptions {
    /// Samples along each side of a pixel, 1 to 16. Default: 2.
    pub subsamples: usize,
    /// Samples along each side of a light, 1 to 32. Default: 3.
    pub light_samples: usize,
    /// Directions that the environment is seen from, 1 to 4096. Default: 32.
    pub ambient_samples: usize,
    /// Distance of two samples of the irradiance, 0.25 to 16 pixels. Default: 1.5.
    pub cell_px: f64,
}

impl Preset {
    /// All of them with their names, the quickest first.
    pub const ALL: [(&'static str, Self); 5] = [
        ("draft", Self::Draft),
        ("fast", Self::Fast),
        ("good", Self::Good),
        ("high", Self::High),
        ("reference", Self::Reference),
    ];

    /// The numbers behind the name: points on the measured curve of error (against Cycles) over run time.
    pub fn options(self) -> RenderOptions {
        let [subsamples, light_samples, ambient_samples] = match self {
            Self::Draft => [1, 2, 12],
            Self::Fast => [2, 3, 32],
            Self::Good => [2, 4, 64],
            Self::High => [3, 6, 100],
            Self::Reference => [6, 8, 400],
        };
        let cell_px = match self {
            Self::Draft => 2.0,
            Self::Fast => 1.5,
            Self::Good => 1.0,
            Self::High => 0.66,
            Self::Reference => 0.33,
        };
        RenderOptions {
            subsamples,
            light_samples,
            ambient_samples,
            cell_px,
        }
    }
}

impl Default for RenderOptions {
    fn default() -> Self {
        Preset::Fast.options()
    }
}

/// The reference preset has 6; beyond 16 the error is below a code of 8 bits, and the time without bounds.
const SUBSAMPLES: Bounds = Bounds::new(1.0, 16.0, "the reference preset has 6");
const LIGHT_SAMPLES: Bounds = Bounds::new(1.0, 32.0, "the reference preset has 8");
const AMBIENT_SAMPLES: Bounds = Bounds::new(1.0, 4096.0, "the reference preset has 400");
const CELL_PX: Bounds = Bounds::new(0.25, 16.0, "pixels; smaller cells see no more");

impl RenderOptions {
    /// Fails on the first number that has no use: none at all, or so many that a picture takes hours.
    ///
    /// # Errors
    /// [`Error::Value`] with the option's name.
    pub fn check(&self) -> Result<()> {
        SUBSAMPLES.check("subsamples", self.subsamples as f64)?;
        LIGHT_SAMPLES.check("light_samples", self.light_samples as f64)?;
        AMBIENT_SAMPLES.check("ambient_samples", self.ambient_samples as f64)?;
        CELL_PX.check("cell_px", self.cell_px)
    }

    /// The same with every number inside the range that the arithmetic bears: at least one sample, cells of 0.25 to 16 pixels.
    pub(super) fn clamped(self) -> Self {
        let cell_px = if self.cell_px.is_finite() {
            self.cell_px.clamp(0.25, 16.0)
        } else {
            1.0
        };
        Self {
            subsamples: self.subsamples.clamp(1, 64),
            light_samples: self.light_samples.clamp(1, 64),
            ambient_samples: self.ambient_samples.clamp(1, 4096),
            cell_px,
        }
    }
}

impl std::str::FromStr for Preset {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let known = Self::ALL.iter().find(|(n, _)| *n == name);
        known.map(|&(_, quality)| quality).ok_or_else(|| {
            let names = Self::ALL.map(|(n, _)| n).join(", ");
            Error::value("quality", format!("\"{name}\", expected one of {names}"))
        })
    }
}

impl From<Preset> for RenderOptions {
    fn from(quality: Preset) -> Self {
        quality.options()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_without_an_end_or_a_beginning_are_refused() {
        assert!(
            Preset::ALL
                .iter()
                .all(|(_, preset)| preset.options().check().is_ok())
        );
        let usual = RenderOptions::default();
        let told = |options: RenderOptions| options.check().unwrap_err().to_string();
        let said = told(RenderOptions {
            subsamples: 1_000_000,
            ..usual
        });
        assert_eq!(
            said,
            "subsamples: 1000000, expected 1 to 16 (the reference preset has 6)"
        );
        assert!(
            told(RenderOptions {
                subsamples: 0,
                ..usual
            })
            .starts_with("subsamples: 0, expected 1 to 16")
        );
        assert!(
            told(RenderOptions {
                light_samples: usize::MAX,
                ..usual
            })
            .starts_with("light_samples: 1.8")
        );
        assert!(
            told(RenderOptions {
                ambient_samples: 0,
                ..usual
            })
            .starts_with("ambient_samples: 0")
        );
        for cell_px in [0.0, -1.0, f64::NAN] {
            assert!(
                told(RenderOptions { cell_px, ..usual }).starts_with("cell_px: "),
                "{cell_px}"
            );
        }
    }
}
