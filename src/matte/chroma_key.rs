//! Chroma Key: a wedge in the plane of the colour differences.

use super::check::check_value;
use super::key::{Photo, Profile, differences};
use crate::error::Result;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
use serde::{Deserialize, Serialize};

/// Blender goes down to 0, where the matte is infinite inside the wedge.
const MIN_GAIN: f32 = 1e-6;

/// Settings of [`chroma_key`], under the names that Blender 3.4 gives them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChromaKeyOptions {
    /// Which Blender release to follow; `robust` and 4.2 are 3.4 here. Default: `blender-3.4`.
    pub profile: Profile,
    /// Opening angle of the wedge that is keyed, radians, 1 to 80 degrees (3.4 "acceptance", 4.5
    /// "maximum"). Default: 30 degrees.
    pub tolerance: f32,
    /// Opening angle of the wedge that is keyed wholly, radians, 0 to 30 degrees (3.4 "cutoff", 4.5
    /// "minimum"). Default: 10 degrees.
    pub threshold: f32,
    /// Distance inside the wedge over which the matte falls to 0, at least 0.000001 (4.5
    /// "falloff"). Default: 1.
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

impl ChromaKeyOptions {
    /// Whether every setting lies in its range.
    ///
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) with the setting's name, its value and what was
    /// expected.
    pub fn check(&self) -> Result<()> {
        check_angle("key.tolerance", self.tolerance, [1.0, 80.0])?;
        check_angle("key.threshold", self.threshold, [0.0, 30.0])?;
        check_value(self.gain >= MIN_GAIN, "key.gain", || {
            format!("{}, expected at least {MIN_GAIN}", self.gain)
        })
    }
}

/// Refuses an angle, radians, that is not between two others, degrees.
fn check_angle(at: &str, radians: f32, [low, high]: [f32; 2]) -> Result<()> {
    let range = low.to_radians()..=high.to_radians();
    check_value(range.contains(&radians), at, || {
        format!("{radians}, expected {low} to {high} degrees, in radians")
    })
}

/// Keys a photo by the angle between its colour differences and the screen's.
///
/// Takes a scene-linear photo, opaque or premultiplied; returns a matte of the same size, at most
/// the photo's alpha, and negative where a pixel lies deeper in the wedge than `gain`.
///
/// # Method
/// With the colour differences of BT.709 turned so that the screen lies along `x`, and `z` across:
/// a pixel is inside the wedge by `g = x - |z| / tan(tolerance / 2)`. Where `g > 0` the matte is
/// `1 - g / gain`, and 0 within `threshold`.
pub fn chroma_key<P: Photo>(
    photo: &Image<P>,
    screen: LinearRgb,
    options: &ChromaKeyOptions,
) -> Image<Coverage> {
    let wedge = Wedge::new(screen, options);
    photo.map(|p| wedge.matte(p.premul()))
}

/// Colour differences around 0.
fn centred(p: PremulRgba, exact: bool) -> [f32; 2] {
    differences(p, exact).map(|v| v * 2.0 - 1.0)
}

/// What is keyed around the screen's direction.
struct Wedge {
    /// Cosine and sine of that direction.
    direction: (f32, f32),
    /// The colour differences are those of Blender 4.5.
    exact: bool,
    /// Tangent of half its opening.
    slope: f32,
    /// Half the angle that is keyed wholly, radians.
    core: f32,
    gain: f32,
}

impl Wedge {
    fn new(screen: LinearRgb, options: &ChromaKeyOptions) -> Self {
        let exact = options.profile == Profile::Blender45;
        Self {
            direction: direction(centred(screen.opaque(), exact), exact),
            exact,
            slope: libm::tan(f64::from(options.tolerance / 2.0)) as f32,
            core: options.threshold / 2.0,
            gain: options.gain,
        }
    }

    #[inline(always)]
    fn matte(&self, p: PremulRgba) -> Coverage {
        let (x, z) = self.turned(centred(p, self.exact));
        Coverage(self.alpha(x, z).filter(|&a| a < p.a).unwrap_or(p.a))
    }

    /// Colour differences along the screen's direction and across it.
    #[inline(always)]
    fn turned(&self, [c, r]: [f32; 2]) -> (f32, f32) {
        let (cos, sin) = self.direction;
        (c * cos + r * sin, r * cos - c * sin)
    }

    /// The matte at `x` along the screen's direction and `z` across it; none outside the wedge.
    #[inline(always)]
    fn alpha(&self, x: f32, z: f32) -> Option<f32> {
        let inside = x - z.abs() / self.slope;
        let alpha = if angle(x, z).abs() < self.core {
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
        normalized(c, r)
    } else {
        cos_and_sin(angle(c, r))
    }
}

#[inline(always)]
fn angle(x: f32, y: f32) -> f32 {
    libm::atan2(f64::from(y), f64::from(x)) as f32
}

fn cos_and_sin(angle: f32) -> (f32, f32) {
    let angle = f64::from(angle);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_gain_makes_a_finite_matte_and_0_is_refused() {
        let of_gain = |gain: f32| ChromaKeyOptions {
            threshold: 0.0,
            gain,
            ..ChromaKeyOptions::default()
        };
        let told = of_gain(0.0).check().unwrap_err().to_string();
        assert_eq!(told, "key.gain: 0, expected at least 0.000001");
        let least = of_gain(MIN_GAIN);
        least.check().unwrap();
        let green = LinearRgb::new(0.04, 0.4, 0.08);
        let matte = chroma_key(&Image::filled(1, 1, green), green, &least)[(0, 0)];
        assert!(matte.0.is_finite() && matte.0 < -1.0, "{matte:?}");
    }
}
