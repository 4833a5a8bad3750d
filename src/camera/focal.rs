//! The prior of the focal length, and where a solution's focal length comes from.

use super::label::{Framing, Label, LabelCamera};
use super::options::Priors;
use super::pinhole::diagonal_px;
use super::prior::Prior;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Diagonal of the 36 mm x 24 mm frame that 35 mm equivalents refer to, millimetres.
const FULL_FRAME_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Focal length where nothing is known, in longer picture sides: 36 mm equivalent, the median of
/// pocket cameras.
const NOMINAL_FOCAL_SIDES: f64 = 1.0;
/// Relative noise of a focal length that is stated without a standard deviation.
const STATED_SIGMA: f64 = 0.01;
/// The same of a 35 mm equivalent; the ways to convert it differ by 4 %.
const EQUIVALENT_SIGMA: f64 = 0.05;
/// Added to that where the picture may have been cropped, since the equivalent then refers to a
/// longer diagonal: people keep between half and all of a picture.
const CROP_SIGMA: f64 = 0.15;
/// Equivalents that imply a focal length outside this range, in longer sides, are wrong.
const EQUIVALENT_SIDES: [f64; 2] = [0.2, 20.0];
/// So are focal lengths in pixels outside this one; those of pictures of which little was kept are
/// long.
const PIXEL_SIDES: [f64; 2] = [0.05, 100.0];

/// Where a solution's focal length comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FocalSource {
    /// The four corners, at least nine tenths of the information.
    Measured,
    /// The corners and the prior, both.
    Mixed,
    /// The prior (EXIF or a common lens); the corners hardly constrain it.
    Prior,
    /// The label gave it as exact.
    Fixed,
    /// Nothing: the prior was flat, and the corners look as if seen from infinitely far. It is the
    /// largest sensible value.
    Unbounded,
}

impl std::fmt::Display for FocalSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Measured => "measured",
            Self::Mixed => "mixed",
            Self::Prior => "prior",
            Self::Fixed => "fixed",
            Self::Unbounded => "unbounded",
        })
    }
}

/// Where the prior of the focal length comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PriorSource {
    /// The label, in pixels.
    Label,
    /// The 35 mm equivalent that the camera wrote.
    Exif,
    /// Nowhere: the distribution of common lenses.
    Nominal,
}

/// The focal length in pixels that a 35 mm equivalent stands for, by the diagonal.
pub fn focal_from_equivalent(focal_35mm: f64, image: [u32; 2]) -> f64 {
    focal_35mm * diagonal_px(image) / FULL_FRAME_DIAGONAL_MM
}

/// The 35 mm equivalents that a picture of some size can have.
pub(crate) fn plausible_equivalents(image: [u32; 2]) -> RangeInclusive<f64> {
    let mm_per_side = longer_side(image) * FULL_FRAME_DIAGONAL_MM / diagonal_px(image);
    rounded_range(EQUIVALENT_SIDES, mm_per_side)
}

/// The focal lengths in pixels that a picture of some size can have.
pub(crate) fn plausible_pixels(image: [u32; 2]) -> RangeInclusive<f64> {
    rounded_range(PIXEL_SIDES, longer_side(image))
}

/// To tenths, so that messages tell the very bounds.
fn rounded_range(sides: [f64; 2], per_side: f64) -> RangeInclusive<f64> {
    let [least, most] = sides.map(|sides| (10.0 * sides * per_side).round() / 10.0);
    least..=most
}

/// The focal length in pixels of a common lens.
pub(crate) fn nominal_px(image: [u32; 2]) -> f64 {
    NOMINAL_FOCAL_SIDES * longer_side(image)
}

/// The prior of the logarithm of the focal length in pixels, for a picture of some framing, and
/// where it comes from.
pub(crate) fn length_prior(
    label: &Label,
    framing: Framing,
    priors: &Priors,
) -> (Prior, PriorSource) {
    let camera = &label.camera;
    match (camera.focal_px, equivalent_px(label, framing)) {
        (Some(px), _) => (stated_prior(camera, px, STATED_SIGMA), PriorSource::Label),
        (None, Some(px)) => (equivalent_prior(camera, framing, px), PriorSource::Exif),
        (None, None) => {
            let nominal = Prior {
                mean: libm::log(nominal_px(label.taken_size())),
                sigma: priors.focal_sigma,
            };
            (nominal, PriorSource::Nominal)
        }
    }
}

/// The focal length in pixels by the 35 mm equivalent, which is not that of a cropped picture.
fn equivalent_px(label: &Label, framing: Framing) -> Option<f64> {
    let stated = label.camera.focal_35mm;
    let focal_35mm = stated.filter(|_| framing != Framing::Cropped)?;
    Some(focal_from_equivalent(focal_35mm, label.taken_size()))
}

/// A focal length that a label or a file states, with its own standard deviation or else this one.
fn stated_prior(camera: &LabelCamera, focal_px: f64, default_sigma: f64) -> Prior {
    let sigma = match camera.focal_fixed {
        true => 0.0,
        false => camera.focal_sigma.unwrap_or(default_sigma),
    };
    Prior {
        mean: libm::log(focal_px),
        sigma,
    }
}

/// By a 35 mm equivalent, which a cropped picture would not have.
fn equivalent_prior(camera: &LabelCamera, framing: Framing, focal_px: f64) -> Prior {
    let mut prior = stated_prior(camera, focal_px, EQUIVALENT_SIGMA);
    if framing == Framing::Unknown && !camera.focal_fixed {
        prior.sigma = libm::hypot(prior.sigma, CROP_SIGMA);
    }
    prior
}

fn longer_side(image: [u32; 2]) -> f64 {
    f64::from(image[0].max(image[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(focal_35mm: f64) -> Label {
        let mut label = Label::new([4000, 3000], [[0.0; 2]; 4], [1.0, 1.0]);
        label.camera.focal_35mm = Some(focal_35mm);
        label
    }

    fn default_prior(label: &Label, framing: Framing) -> (Prior, PriorSource) {
        length_prior(label, framing, &Priors::default())
    }

    #[test]
    fn an_equivalent_counts_by_the_diagonal() {
        let (prior, source) = default_prior(&label(26.0), Framing::Whole);
        assert_eq!((source, prior.sigma), (PriorSource::Exif, 0.05));
        assert!((libm::exp(prior.mean) - 26.0 * 5000.0 / 43.2666).abs() < 0.01);
        assert!(default_prior(&label(26.0), Framing::Unknown).0.sigma > 0.15);
    }

    #[test]
    fn the_equivalent_of_a_cropped_picture_is_dropped() {
        let (prior, source) = default_prior(&label(26.0), Framing::Cropped);
        assert_eq!((source, prior.sigma), (PriorSource::Nominal, 0.35));
    }

    #[test]
    fn a_person_s_pixels_come_first() {
        let mut both = label(26.0);
        both.camera.focal_px = Some(3000.0);
        let (prior, source) = default_prior(&both, Framing::Whole);
        assert_eq!(
            (source, prior.sigma, libm::exp(prior.mean).round()),
            (PriorSource::Label, 0.01, 3000.0)
        );
    }
}
