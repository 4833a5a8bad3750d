//! Difference Key: what differs from a picture of the place without the subject.

use super::check::{check_share, check_size};
use super::key::{Photo, Profile};
use crate::error::Result;
use crate::image::Image;
use crate::pixel::{Coverage, PremulRgba};
use serde::{Deserialize, Serialize};

/// Settings of [`difference_key`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DifferenceKeyOptions {
    /// Which Blender to be; `robust` and 4.2 are 3.4 here. Default: `blender-3.4`.
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
/// alpha.
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
    /// The matte of a pixel, at most its alpha.
    #[inline]
    fn coverage(&self, p: PremulRgba, clean: PremulRgba) -> Coverage {
        let m = self.matte(mean_difference(p, clean));
        Coverage(m.map_or(p.a, |m| if m < p.a { m } else { p.a }))
    }
    /// The matte of an opaque pixel; none beyond the falloff.
    #[inline]
    fn matte(&self, difference: f32) -> Option<f32> {
        if self.profile == Profile::Blender45 {
            late_matte(difference, self.tolerance, self.falloff)
        } else {
            early_matte(difference, self.tolerance, self.falloff)
        }
    }
}

/// Mean of the absolute differences of the channels.
#[inline]
fn mean_difference(a: PremulRgba, b: PremulRgba) -> f32 {
    ((a.r - b.r).abs() + (a.g - b.g).abs() + (a.b - b.b).abs()) / 3.0
}

/// The rise of the matte as Blender 3.4 computes it; none beyond it.
fn early_matte(difference: f32, tolerance: f32, falloff: f32) -> Option<f32> {
    if difference <= tolerance {
        return Some(0.0);
    }
    (difference <= falloff + tolerance).then(|| (difference - tolerance) / falloff)
}

/// The rise of the matte as Blender 4.5 computes it; none beyond it.
fn late_matte(difference: f32, tolerance: f32, falloff: f32) -> Option<f32> {
    let beyond = difference - tolerance;
    let beyond = if beyond > 0.0 { beyond } else { 0.0 };
    (difference <= tolerance + falloff).then(|| quotient_or_zero(beyond, falloff))
}

#[inline]
fn quotient_or_zero(dividend: f32, divisor: f32) -> f32 {
    if divisor == 0.0 {
        0.0
    } else {
        dividend / divisor
    }
}
