//! Difference Key: what differs from a picture of the place without the subject.

use super::key::{Photo, Profile};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::pixel::{Coverage, PremulRgba};
use serde::{Deserialize, Serialize};

/// Settings of [`difference_key`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DifferenceKeyOptions {
    /// Which Blender to be; `robust` and 4.2 are 3.4 here. Default: `blender-3.4`.
    pub profile: Profile,
    /// Mean difference of the channels up to which a pixel is background. Default: 0.1.
    pub tolerance: f32,
    /// Further difference over which the matte rises to 1. Default: 0.1.
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
/// Takes two scene-linear pictures of one size; returns a matte of that size, at most the photo's alpha.
///
/// # Method
/// With `D` the mean of the absolute differences of R, G and B: 0 up to `tolerance`, then `(D - tolerance) / falloff`.
/// # Errors
/// [`Error::Value`] where the sizes differ.
pub fn difference_key<P: Photo>(
    photo: &Image<P>,
    clean: &Image<P>,
    options: &DifferenceKeyOptions,
) -> Result<Image<Coverage>> {
    check_sizes(clean.size(), photo.size())?;
    Ok(photo.zip_map(clean, |a, b| {
        let a = a.premul();
        let m = options.matte(mean_difference(a, b.premul()));
        Coverage(m.map_or(a.a, |m| if m < a.a { m } else { a.a }))
    }))
}

impl DifferenceKeyOptions {
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

fn check_sizes((w, h): (usize, usize), (width, height): (usize, usize)) -> Result<()> {
    if (w, h) == (width, height) {
        return Ok(());
    }
    let what = format!("{w} x {h} pixels, expected the photo's {width} x {height}");
    Err(Error::value("clean plate", what))
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
    let share = if falloff == 0.0 {
        0.0
    } else {
        beyond / falloff
    };
    (difference <= tolerance + falloff).then_some(share)
}
