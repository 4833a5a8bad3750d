//! Difference Key: what differs from a picture of the place without the subject.

use super::key::{Photo, Profile};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::pixel::Coverage;
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
    opts: &DifferenceKeyOptions,
) -> Result<Image<Coverage>> {
    if photo.size() != clean.size() {
        let ((w, h), (width, height)) = (clean.size(), photo.size());
        return Err(Error::value(
            "clean plate",
            format!("{w} x {h} pixels, expected the photo's {width} x {height}"),
        ));
    }
    let (tolerance, falloff) = (opts.tolerance, opts.falloff);
    let late = opts.profile == Profile::Blender45;
    Ok(photo.zip_map(clean, |a, b| {
        let (a, b) = (a.premul(), b.premul());
        let difference = ((a.r - b.r).abs() + (a.g - b.g).abs() + (a.b - b.b).abs()) / 3.0;
        let m = if late {
            late_matte(difference, tolerance, falloff)
        } else {
            matte(difference, tolerance, falloff)
        };
        Coverage(m.map_or(a.a, |m| if m < a.a { m } else { a.a }))
    }))
}

/// The rise of the matte as Blender 3.4 reckons; none beyond it.
fn matte(difference: f32, tolerance: f32, falloff: f32) -> Option<f32> {
    if difference <= tolerance {
        return Some(0.0);
    }
    (difference <= falloff + tolerance).then(|| (difference - tolerance) / falloff)
}

/// The rise of the matte as Blender 4.5 reckons; none beyond it.
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
