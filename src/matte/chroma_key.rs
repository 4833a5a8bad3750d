//! Chroma Key: a wedge in the plane of colour differences.

use super::key::{Photo, Profile, differences};
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use serde::{Deserialize, Serialize};

/// Settings of [`chroma_key`], under the names that Blender 3.4 gives them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChromaKeyOptions {
    /// Which Blender to be; `robust` and 4.2 are 3.4 here. Default: `blender-3.4`.
    pub profile: Profile,
    /// Opening angle of the wedge that is keyed, radians (3.4 "acceptance", 4.5 "maximum"). Default: 30 degrees.
    pub tolerance: f32,
    /// Opening angle of the wedge that is keyed wholly, radians (3.4 "cutoff", 4.5 "minimum"). Default: 10 degrees.
    pub threshold: f32,
    /// Distance inside the wedge over which the matte falls to 0 (4.5 "falloff"). Default: 1.
    pub gain: f32,
}

impl Default for ChromaKeyOptions {
    fn default() -> Self {
        let [tolerance, threshold] = [30.0f32, 10.0].map(f32::to_radians);
        Self {
            profile: Profile::default(),
            tolerance,
            threshold,
            gain: 1.0,
        }
    }
}

/// Keys a photo by the angle between its colour differences and the screen's.
///
/// Takes a scene-linear photo, opaque or premultiplied; returns a matte of the same size, at most the photo's alpha, and
/// negative where a pixel lies deeper in the wedge than `gain`.
///
/// # Method
/// With the colour differences of BT.709 turned so that the screen lies along `x`, and `z` across: a pixel is inside the
/// wedge by `g = x - |z| / tan(tolerance / 2)`. Where `g > 0` the matte is `1 - g / gain`, and 0 within `threshold`.
pub fn chroma_key<P: Photo>(
    photo: &Image<P>,
    screen: LinearRgb,
    opts: &ChromaKeyOptions,
) -> Image<Coverage> {
    let exact = opts.profile == Profile::Blender45;
    let centred = |p| differences(p, exact).map(|v| v * 2.0 - 1.0);
    let (cos, sin) = direction(centred(screen.opaque()), exact);
    let [widest, narrowest] = [opts.tolerance / 2.0, opts.threshold / 2.0];
    let slope = libm::tan(f64::from(widest)) as f32;
    photo.map(|p| {
        let p = p.premul();
        let [c, r] = centred(p);
        let (x, z) = (c * cos + r * sin, r * cos - c * sin);
        let inside = x - z.abs() / slope;
        let angle = libm::atan2(f64::from(z), f64::from(x)) as f32;
        let alpha = if angle.abs() < narrowest {
            0.0
        } else {
            1.0 - inside / opts.gain
        };
        Coverage(if inside > 0.0 && alpha < p.a {
            alpha
        } else {
            p.a
        })
    })
}

/// Cosine and sine of the key's direction.
fn direction([c, r]: [f32; 2], exact: bool) -> (f32, f32) {
    if exact {
        let length = (c * c + r * r).sqrt();
        return if length == 0.0 {
            (0.0, 0.0)
        } else {
            (c / length, r / length)
        };
    }
    let angle = libm::atan2(f64::from(r), f64::from(c)) as f32;
    (
        libm::cos(f64::from(angle)) as f32,
        libm::sin(f64::from(angle)) as f32,
    )
}
