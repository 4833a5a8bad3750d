//! How much each source of images counts in the loss.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The balance of real and synthetic images in a combined training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Balance {
    /// Share of the real images in the loss of an epoch, 0 to 1. Default: 0.5.
    pub alpha: f64,
    /// Twice the weights, so that `alpha` equal to the real images' share of all gives weights of
    /// 1: plain concatenation. Without it such an `alpha` halves the loss, and with it the
    /// learning rate. Default: false, the paper's form.
    pub normalize: bool,
}

/// Factors on the loss of a batch of one source.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// For a batch of real images.
    pub real: f64,
    /// For a batch of synthetic images.
    pub synthetic: f64,
}

impl Default for Balance {
    fn default() -> Self {
        Self {
            alpha: 0.5,
            normalize: false,
        }
    }
}

impl Balance {
    /// Factors for `real` and `synthetic` images in the two training sets.
    ///
    /// # Method
    /// Equation 2 of the paper: `(S + R) / (2 R) alpha` and `(S + R) / (2 S) (1 - alpha)`.
    ///
    /// # Errors
    /// [`Error::Value`] for an `alpha` outside 0 to 1 and for an empty set.
    ///
    /// # Examples
    /// ```
    /// let paper = petcomp::train::Balance::default().weights(1624, 4000).unwrap();
    /// assert_eq!((format!("{:.4}", paper.real), format!("{:.4}", paper.synthetic)), ("0.8658".into(), "0.3515".into()));
    /// ```
    pub fn weights(&self, real: u64, synthetic: u64) -> Result<Weights> {
        self.check_alpha()?;
        check_images("real", real)?;
        check_images("synthetic", synthetic)?;
        Ok(self.weights_for(real as f64, synthetic as f64))
    }

    fn weights_for(&self, real: f64, synthetic: f64) -> Weights {
        let scale = (synthetic + real) * if self.normalize { 1.0 } else { 0.5 };
        Weights {
            real: scale / real * self.alpha,
            synthetic: scale / synthetic * (1.0 - self.alpha),
        }
    }

    fn check_alpha(&self) -> Result<()> {
        if (0.0..=1.0).contains(&self.alpha) {
            return Ok(());
        }
        let what = format!("{}, expected 0 to 1", self.alpha);
        Err(Error::value("alpha", what))
    }
}

fn check_images(source: &str, count: u64) -> Result<()> {
    if count > 0 {
        return Ok(());
    }
    let what = "no images, expected at least one of each source";
    Err(Error::value(source, what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_the_paper() {
        let plain = Balance::default().weights(1624, 4000).unwrap();
        assert!(
            (plain.real - 0.8658).abs() < 5e-5 && (plain.synthetic - 0.3515).abs() < 5e-5,
            "{plain:?}"
        );
        let twice = Balance {
            normalize: true,
            ..Balance::default()
        }
        .weights(1624, 4000)
        .unwrap();
        assert_eq!(
            (twice.real, twice.synthetic),
            (2.0 * plain.real, 2.0 * plain.synthetic)
        );
    }

    #[test]
    fn the_natural_share_is_concatenation_when_normalised_and_half_of_it_otherwise() {
        let alpha = 1624.0 / 5624.0;
        let one = Balance {
            alpha,
            normalize: true,
        }
        .weights(1624, 4000)
        .unwrap();
        assert!((one.real - 1.0).abs() < 1e-12 && (one.synthetic - 1.0).abs() < 1e-12);
        let half = Balance {
            alpha,
            normalize: false,
        }
        .weights(1624, 4000)
        .unwrap();
        assert!((half.real - 0.5).abs() < 1e-12 && (half.synthetic - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_ends_leave_one_source_out() {
        let only = |alpha| {
            Balance {
                alpha,
                normalize: false,
            }
            .weights(10, 30)
            .unwrap()
        };
        assert_eq!((only(0.0).real, only(1.0).synthetic), (0.0, 0.0));
    }

    #[test]
    fn impossible_balances_are_refused() {
        assert!(
            Balance {
                alpha: 1.5,
                normalize: false
            }
            .weights(1, 1)
            .is_err()
        );
        assert!(
            Balance {
                alpha: f64::NAN,
                normalize: false
            }
            .weights(1, 1)
            .is_err()
        );
        let said = Balance::default().weights(0, 5).unwrap_err().to_string();
        assert_eq!(
            said,
            "real: no images, expected at least one of each source"
        );
    }
}
