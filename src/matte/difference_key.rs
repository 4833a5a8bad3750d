//! Difference Key: what differs from a picture without the subject.

use super::check::{check_share, check_size};
use super::key::{Photo, Profile, lesser};
use crate::error::Result;
use crate::image::Image;
use crate::pixel::{Coverage, PremulRgba};
use serde::{Deserialize, Serialize};

/// Settings of [`difference_key`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DifferenceKeyOptions {
    /// Which Blender release to follow; `robust` and 4.2 are 3.4 here. Default: `blender-3.4`.
    pub profile: Profile,
    /// Mean difference of the channels up to which a pixel is background, 0 to 1. Default: 0.1.
    pub tolerance: f32,
    /// Further difference over which the matte rises to 1, 0 to 1. Default: 0.1.
    pub falloff: f32,
}

impl Default for DifferenceKeyOptions {
    fn default() -> Self {
        Self {
            profile: Profile::default(),
            tolerance: 0.1,
            falloff: 0.1,
        }
    }
}

/// Keys a photo by its difference from a clean plate.
///
/// Takes two scene-linear pictures of one size; returns a matte of that size, at most the photo's
/// alpha. Background whose alpha is below 0 is also 0, except in Blender 4.5.
///
/// # Method
/// With `D` the mean of the absolute differences of R, G and B: 0 up to `tolerance`, then `(D -
/// tolerance) / falloff`.
///
/// # Errors
/// [`Error::Value`](crate::Error::Value) where the sizes differ, or for a setting out of its range.
pub fn difference_key<P: Photo>(
    photo: &Image<P>,
    clean: &Image<P>,
    options: &DifferenceKeyOptions,
) -> Result<Image<Coverage>> {
    check_size("clean plate", clean.size(), photo.size())?;
    check_share("key.tolerance", options.tolerance)?;
    check_share("key.falloff", options.falloff)?;
    Ok(photo.zip_map(clean, |a, b| options.coverage(a.premul(), b.premul())))
}

impl DifferenceKeyOptions {
    /// The matte of a pixel.
    #[inline]
    fn coverage(&self, p: PremulRgba, clean: PremulRgba) -> Coverage {
        let difference = mean_difference(p, clean);
        Coverage(if self.profile == Profile::Blender45 {
            self.late_matte(difference, p.a)
        } else {
            self.early_matte(difference, p.a)
        })
    }

    /// As Blender 3.4 computes it: background is 0 whatever its alpha.
    #[inline]
    fn early_matte(&self, difference: f32, alpha: f32) -> f32 {
        if difference <= self.tolerance {
            0.0
        } else if difference <= self.falloff + self.tolerance {
            lesser((difference - self.tolerance) / self.falloff, alpha)
        } else {
            alpha
        }
    }

    /// As Blender 4.5 computes it: what is not a number is background.
    #[inline]
    fn late_matte(&self, difference: f32, alpha: f32) -> f32 {
        if difference > self.tolerance + self.falloff {
            alpha
        } else {
            let beyond = difference - self.tolerance;
            let beyond = if beyond > 0.0 { beyond } else { 0.0 };
            lesser(alpha, quotient_or_zero(beyond, self.falloff))
        }
    }
}

/// Mean of the absolute differences of the channels.
#[inline]
fn mean_difference(a: PremulRgba, b: PremulRgba) -> f32 {
    ((a.r - b.r).abs() + (a.g - b.g).abs() + (a.b - b.b).abs()) / 3.0
}

#[inline]
fn quotient_or_zero(dividend: f32, divisor: f32) -> f32 {
    if divisor == 0.0 {
        0.0
    } else {
        dividend / divisor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_background_from_blender_4_5_on() {
        let plate = Image::filled(1, 1, PremulRgba::new(0.1, 0.7, 0.2, 1.0));
        let photo = Image::filled(1, 1, PremulRgba::new(f32::NAN, 0.4, 0.3, 1.0));
        for (_, profile) in Profile::ALL {
            let options = DifferenceKeyOptions {
                profile,
                ..DifferenceKeyOptions::default()
            };
            let matte = difference_key(&photo, &plate, &options).unwrap();
            let expected = if profile == Profile::Blender45 {
                0.0
            } else {
                1.0
            };
            assert_eq!(matte[(0, 0)].0, expected, "{profile:?}");
        }
    }

    #[test]
    fn background_of_negative_alpha_is_0_before_blender_4_5() {
        let photo = Image::filled(1, 1, PremulRgba::new(0.2, 0.3, 0.4, -0.5));
        for (_, profile) in Profile::ALL {
            let options = DifferenceKeyOptions {
                profile,
                ..DifferenceKeyOptions::default()
            };
            let matte = difference_key(&photo, &photo, &options).unwrap();
            let is_late = profile == Profile::Blender45;
            let expected = if is_late { -0.5 } else { 0.0 };
            assert_eq!(matte[(0, 0)].0, expected, "{profile:?}");
        }
    }
}
