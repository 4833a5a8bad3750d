//! Chroma Key: a wedge in the plane of the colour differences.

use super::key::{Photo, Profile, differences};
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
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
    options: &ChromaKeyOptions,
) -> Image<Coverage> {
    let exact = options.profile == Profile::Blender45;
    let (cos, sin) = direction(centred(screen.opaque(), exact), exact);
    let wedge = Wedge::new(options);
    photo.map(|p| {
        let p = p.premul();
        let [c, r] = centred(p, exact);
        let (x, z) = (c * cos + r * sin, r * cos - c * sin);
        Coverage(wedge.alpha(x, z).filter(|&a| a < p.a).unwrap_or(p.a))
    })
}

/// Colour differences around 0.
fn centred(p: PremulRgba, exact: bool) -> [f32; 2] {
    differences(p, exact).map(|v| v * 2.0 - 1.0)
}

/// What is keyed around the screen's direction.
struct Wedge {
    /// Tangent of half its opening.
    slope: f32,
    /// Half the angle that is keyed wholly, radians.
    core: f32,
    gain: f32,
}

impl Wedge {
    fn new(options: &ChromaKeyOptions) -> Self {
        Self {
            slope: libm::tan(f64::from(options.tolerance / 2.0)) as f32,
            core: options.threshold / 2.0,
            gain: options.gain,
        }
    }

    /// The matte at `x` along the screen's direction and `z` across it; none outside the wedge.
    #[inline(always)]
    fn alpha(&self, x: f32, z: f32) -> Option<f32> {
        let inside = x - z.abs() / self.slope;
        let angle = libm::atan2(f64::from(z), f64::from(x)) as f32;
        let alpha = if angle.abs() < self.core {
            0.0
        } else {
            1.0 - inside / self.gain
        };
        (inside > 0.0).then_some(alpha)
    }
}

/// Cosine and sine of the key's direction.
fn direction([c, r]: [f32; 2], exact: bool) -> (f32, f32) {
    if exact {
        return normalized(c, r);
    }
    let angle = f64::from(libm::atan2(f64::from(r), f64::from(c)) as f32);
    (libm::cos(angle) as f32, libm::sin(angle) as f32)
}

/// A vector of length 1, or 0 where it has no length.
fn normalized(c: f32, r: f32) -> (f32, f32) {
    let length = (c * c + r * r).sqrt();
    if length == 0.0 {
        (0.0, 0.0)
    } else {
        (c / length, r / length)
    }
}
