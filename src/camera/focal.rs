//! What is known of the focal length before the picture is looked at, and where it came from afterwards.

use super::belief::Belief;
use super::label::{Framing, Label};
use super::options::Priors;
use serde::{Deserialize, Serialize};

/// Diagonal of the 36 mm x 24 mm frame that 35 mm equivalents refer to, millimetres.
const FULL_FRAME_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Nothing known: one longer picture side, 36 mm equivalent, the median of pocket cameras.
const USUAL_FOCAL: f64 = 1.0;
/// Relative noise of a focal length that a person states without saying how sure they are.
const STATED_SIGMA: f64 = 0.01;
/// The same of a 35 mm equivalent; the ways to convert it differ by 4 %.
const EQUIVALENT_SIGMA: f64 = 0.05;
/// What is added to that where the picture may have been cropped, since the equivalent is then of a longer diagonal: people
/// keep between half and all of a picture.
const CROP_SIGMA: f64 = 0.15;
/// Equivalents that imply a focal length outside this many longer sides are wrong.
const POSSIBLE_FOCAL: std::ops::RangeInclusive<f64> = 0.2..=20.0;

/// Where a solution's focal length comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FocalSource {
    /// The four corners, at least nine tenths of the information.
    Measured,
    /// The corners and what was known before, both.
    Mixed,
    /// What was known before (EXIF or a usual lens); the corners say next to nothing of it.
    Prior,
    /// The label gave it as exact.
    Fixed,
    /// Nobody: nothing was known, and the corners look like seen from infinitely far. It was put at the largest sensible.
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

/// Who says what is believed of the focal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Witness {
    /// The label, in pixels.
    Person,
    /// The 35 mm equivalent that the camera wrote.
    Exif,
    /// Nobody: lenses as they usually are.
    Usual,
}

/// The focal length in pixels that a 35 mm equivalent stands for, by the diagonal.
pub fn focal_from_equivalent(focal_35mm: f64, image: [u32; 2]) -> f64 {
    focal_35mm * libm::hypot(f64::from(image[0]), f64::from(image[1])) / FULL_FRAME_DIAGONAL_MM
}

/// The focal length in pixels of a usual lens.
pub(crate) fn usual_px(image: [u32; 2]) -> f64 {
    USUAL_FOCAL * longer_side(image)
}

/// What to believe of the logarithm of the focal length in pixels of a picture of some framing, and who says so.
pub(crate) fn belief(label: &Label, framing: Framing, priors: &Priors) -> (Belief, Witness) {
    let (camera, image) = (&label.camera, label.taken_size());
    let equivalent = camera.focal_35mm.map(|mm| focal_from_equivalent(mm, image));
    let believable = equivalent.filter(|f| {
        framing != Framing::Cropped && POSSIBLE_FOCAL.contains(&(f / longer_side(image)))
    });
    let (focal_px, usual_sigma, witness) = match (camera.focal_px, believable) {
        (Some(px), _) => (px, STATED_SIGMA, Witness::Person),
        (None, Some(px)) => (px, EQUIVALENT_SIGMA, Witness::Exif),
        (None, None) => return (usual(image, priors), Witness::Usual),
    };
    let sigma = if camera.focal_fixed {
        0.0
    } else {
        camera.focal_sigma.unwrap_or(usual_sigma)
    };
    let cropped_perhaps =
        framing == Framing::Unknown && witness == Witness::Exif && !camera.focal_fixed;
    let sigma = if cropped_perhaps {
        libm::hypot(sigma, CROP_SIGMA)
    } else {
        sigma
    };
    (
        Belief {
            mean: libm::log(focal_px),
            sigma,
        },
        witness,
    )
}

/// What to believe where nobody says anything.
fn usual(image: [u32; 2], priors: &Priors) -> Belief {
    Belief {
        mean: libm::log(usual_px(image)),
        sigma: priors.focal_sigma,
    }
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

    fn believed(label: &Label, framing: Framing) -> (Belief, Witness) {
        belief(label, framing, &Priors::default())
    }

    #[test]
    fn an_equivalent_counts_by_the_diagonal() {
        let (belief, witness) = believed(&label(26.0), Framing::Whole);
        assert_eq!((witness, belief.sigma), (Witness::Exif, 0.05));
        assert!((libm::exp(belief.mean) - 26.0 * 5000.0 / 43.2666).abs() < 0.01);
        assert!(believed(&label(26.0), Framing::Unknown).0.sigma > 0.15);
    }

    #[test]
    fn an_impossible_or_cropped_equivalent_is_dropped() {
        for (label, framing) in [
            (label(2.0), Framing::Whole),
            (label(1e4), Framing::Whole),
            (label(26.0), Framing::Cropped),
        ] {
            let (belief, witness) = believed(&label, framing);
            assert_eq!((witness, belief.sigma), (Witness::Usual, 0.35));
        }
    }

    #[test]
    fn a_person_s_pixels_come_first() {
        let mut both = label(26.0);
        both.camera.focal_px = Some(3000.0);
        let (belief, witness) = believed(&both, Framing::Whole);
        assert_eq!(
            (witness, belief.sigma, libm::exp(belief.mean).round()),
            (Witness::Person, 0.01, 3000.0)
        );
    }
}
