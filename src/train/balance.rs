//! How much each source of images counts in the loss.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The balance of real and synthetic images in a combined training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Balance {
    /// Share of the real images in the loss of an epoch, 0 to 1. Default: 0.5.
    pub alpha: f64,
    /// Doubles the weights, so that an `alpha` equal to the real images' share of all images gives
    /// weights of 1: plain concatenation. Otherwise such an `alpha` halves the loss, and with it
    /// the learning rate. Default: false, the paper's form.
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
        let (real, synthetic) = (real as f64, synthetic as f64);
        let scale = (synthetic + real) * if self.normalize { 1.0 } else { 0.5 };
        Ok(Weights {
            real: scale / real * self.alpha,
            synthetic: scale / synthetic * (1.0 - self.alpha),
        })
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

    fn weights(alpha: f64, normalize: bool, images: [u64; 2]) -> Result<Weights> {
        Balance { alpha, normalize }.weights(images[0], images[1])
    }

    #[test]
    fn the_numbers_of_the_paper() {
        let plain = Balance::default().weights(1624, 4000).unwrap();
        assert!(
            (plain.real - 0.8658).abs() < 5e-5 && (plain.synthetic - 0.3515).abs() < 5e-5,
            "{plain:?}"
        );
        let twice = weights(0.5, true, [1624, 4000]).unwrap();
        assert_eq!(
            (twice.real, twice.synthetic),
            (2.0 * plain.real, 2.0 * plain.synthetic)
        );
    }

    #[test]
    fn the_natural_share_is_concatenation_when_normalised_and_half_of_it_otherwise() {
        for (normalize, expected) in [(true, 1.0), (false, 0.5)] {
            let found = weights(1624.0 / 5624.0, normalize, [1624, 4000]).unwrap();
            assert!((found.real - expected).abs() < 1e-12);
            assert!((found.synthetic - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn the_ends_leave_one_source_out() {
        let only = |alpha| weights(alpha, false, [10, 30]).unwrap();
        assert_eq!((only(0.0).real, only(1.0).synthetic), (0.0, 0.0));
    }

    #[test]
    fn impossible_balances_are_refused() {
        assert!(weights(1.5, false, [1, 1]).is_err());
        assert!(weights(f64::NAN, false, [1, 1]).is_err());
        let said = Balance::default().weights(0, 5).unwrap_err().to_string();
        assert_eq!(
            said,
            "real: no images, expected at least one of each source"
        );
    }
}
