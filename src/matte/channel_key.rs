//! Channel Key: one channel of some colour space against the others.

use super::check::{check_share, check_value};
use super::key::{Photo, Profile, from_ycc, to_ycc};
use super::screen::other_channels;
use crate::error::Result;
use crate::image::Image;
use crate::pixel::{Coverage, PremulRgba};
use serde::{Deserialize, Serialize};

/// The colour space whose channels are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeySpace {
    /// Red, green, blue.
    #[serde(rename = "RGB")]
    Rgb,
    /// Hue, saturation, value.
    #[serde(rename = "HSV")]
    Hsv,
    /// Brightness and two differences.
    #[serde(rename = "YUV")]
    Yuv,
    /// Brightness and two differences with studio swing.
    #[serde(rename = "YCC")]
    Ycc,
}

/// What the channel is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum ChannelLimit {
    /// One other channel.
    Single,
    /// The larger of both others.
    Max,
}

/// Settings of [`channel_key`], under the names that Blender 3.4 gives them; channels are counted
/// from 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChannelKeyOptions {
    /// Which Blender release to follow; `robust` and 4.2 are 3.4 here. A value exactly at two equal limits gives
    /// the pixel's alpha in all profiles; Blender 4.2 and 4.5 give NaN. Default: `blender-3.4`.
    pub profile: Profile,
    /// The colour space. Default: `RGB`.
    pub color_space: KeySpace,
    /// The key channel, 0 to 2. Default: 1.
    pub matte_channel: u8,
    /// What it is compared with. Default: `MAX`.
    pub limit_method: ChannelLimit,
    /// The channel it is compared with, where it is one, 0 to 2. Default: 0.
    pub limit_channel: u8,
    /// Values of `1 - (key - limit)` above this are foreground, 0 to 1. Default: 1.
    pub limit_max: f32,
    /// Values below this are screen, 0 to 1. Default: 0.
    pub limit_min: f32,
}

impl Default for ChannelKeyOptions {
    fn default() -> Self {
        Self {
            profile: Profile::default(),
            color_space: KeySpace::Rgb,
            matte_channel: 1,
            limit_method: ChannelLimit::Max,
            limit_channel: 0,
            limit_max: 1.0,
            limit_min: 0.0,
        }
    }
}

/// Result of a channel key.
#[derive(Clone, Debug, Default)]
pub struct ChannelKeyed {
    /// How much of each pixel is foreground.
    pub matte: Image<Coverage>,
    /// The photo seen through its matte, premultiplied. Blender 3.4 multiplies the channels of the
    /// colour space, offsets and hue included: outside RGB its colours are odd.
    pub cutout: Image<PremulRgba>,
}

/// Keys a photo by how far one channel exceeds the others.
///
/// Takes a scene-linear photo, opaque or premultiplied; returns pictures of the same size.
///
/// # Method
/// `a = 1 - (key - limit)`: the pixel's alpha above `limit_max`, 0 below `limit_min`, linear
/// between, at most its alpha.
pub fn channel_key<P: Photo>(photo: &Image<P>, options: &ChannelKeyOptions) -> ChannelKeyed {
    let matte = photo.map(|p| {
        let p = p.premul();
        Coverage(options.alpha(to_space(p, options), p.a))
    });
    let cutout = photo.zip_map(&matte, |p, m| options.masked(p.premul(), m));
    ChannelKeyed { matte, cutout }
}

impl ChannelKeyOptions {
    /// Whether every setting lies in its range.
    ///
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) with the setting's name, its value and what was
    /// expected.
    pub fn check(&self) -> Result<()> {
        check_channel("key.matte_channel", self.matte_channel)?;
        check_channel("key.limit_channel", self.limit_channel)?;
        check_share("key.limit_max", self.limit_max)?;
        check_share("key.limit_min", self.limit_min)
    }

    /// A pixel seen through its matte.
    #[inline]
    fn masked(&self, p: PremulRgba, m: Coverage) -> PremulRgba {
        if self.profile == Profile::Blender45 || self.color_space == KeySpace::Rgb {
            return p.masked(m);
        }
        let [x, y, z] = to_space(p, self).map(|v| v * m.0);
        let [r, g, b] = from_space([x, y, z], self.color_space);
        PremulRgba::new(r, g, b, p.a * m.0)
    }

    /// The matte of a pixel with these channels, at most its alpha.
    #[inline]
    fn alpha(&self, channels: [f32; 3], alpha: f32) -> f32 {
        let m = self.between_limits(1.0 - self.key_excess(channels), alpha);
        if m < alpha { m } else { alpha }
    }

    /// How far a value is from the lower limit to the upper one; 0 below, `above` above.
    #[inline]
    fn between_limits(&self, a: f32, above: f32) -> f32 {
        if a > self.limit_max {
            above
        } else if a < self.limit_min {
            0.0
        } else {
            (a - self.limit_min) / (self.limit_max - self.limit_min)
        }
    }

    /// By how much the key channel exceeds its limit.
    #[inline]
    fn key_excess(&self, c: [f32; 3]) -> f32 {
        let key = usize::from(self.matte_channel.min(2));
        c[key] - self.limit(c, key)
    }

    /// What the key channel is compared with.
    #[inline]
    fn limit(&self, c: [f32; 3], key: usize) -> f32 {
        match self.limit_method {
            ChannelLimit::Single => c[usize::from(self.limit_channel.min(2))],
            ChannelLimit::Max => larger_other(c, key),
        }
    }
}

fn check_channel(at: &str, channel: u8) -> Result<()> {
    check_value(channel <= 2, at, || format!("{channel}, expected 0 to 2"))
}

/// The larger of the two channels beside one.
#[inline]
fn larger_other(c: [f32; 3], channel: usize) -> f32 {
    let (first, second) = other_channels(c, channel);
    if first < second { second } else { first }
}

fn to_space(p: PremulRgba, options: &ChannelKeyOptions) -> [f32; 3] {
    match options.color_space {
        KeySpace::Rgb => [p.r, p.g, p.b],
        KeySpace::Hsv => to_hsv(p),
        KeySpace::Yuv => to_yuv(p),
        KeySpace::Ycc => to_ycc(p, options.profile == Profile::Blender45),
    }
}

#[inline]
fn to_yuv(p: PremulRgba) -> [f32; 3] {
    [
        0.2126 * p.r + 0.7152 * p.g + 0.0722 * p.b,
        -0.09991 * p.r - 0.33609 * p.g + 0.436 * p.b,
        0.615 * p.r - 0.55861 * p.g - 0.05639 * p.b,
    ]
}

#[inline]
fn from_yuv([y, u, v]: [f32; 3]) -> [f32; 3] {
    [
        y + 1.28033 * v,
        y - 0.21482 * u - 0.38059 * v,
        y + 2.12798 * u,
    ]
}

fn from_space([x, y, z]: [f32; 3], space: KeySpace) -> [f32; 3] {
    match space {
        KeySpace::Rgb => [x, y, z],
        KeySpace::Hsv => from_hsv([x, y, z]).map(|v| if v > 0.0 { v } else { 0.0 }),
        KeySpace::Yuv => from_yuv([x, y, z]),
        KeySpace::Ycc => from_ycc([x, y, z]),
    }
}

/// Keeps divisions by zero away, as Blender does; too small to change any other result.
const MIN_DIVISOR: f32 = 1e-20;

/// Hue 0 to 1, saturation and value, unclamped, in the rounding of Blender's own conversion.
fn to_hsv(p: PremulRgba) -> [f32; 3] {
    let (mut r, mut g, mut b, mut k) = (p.r, p.g, p.b, 0.0);
    if g < b {
        (g, b, k) = (b, g, -1.0);
    }
    let mut least = b;
    if r < g {
        (r, g, k) = (g, r, -2.0 / 6.0 - k);
        least = if g < b { g } else { b };
    }
    let chroma = r - least;
    [
        (k + (g - b) / (6.0 * chroma + MIN_DIVISOR)).abs(),
        chroma / (r + MIN_DIVISOR),
        r,
    ]
}

fn from_hsv([h, s, v]: [f32; 3]) -> [f32; 3] {
    full_color(h * 6.0).map(|n| ((n.clamp(0.0, 1.0) - 1.0) * s + 1.0) * v)
}

/// The colour of full saturation and value of a hue in sixths of the circle, unclamped.
#[inline]
fn full_color(sixths: f32) -> [f32; 3] {
    [
        (sixths - 3.0).abs() - 1.0,
        2.0 - (sixths - 2.0).abs(),
        2.0 - (sixths - 4.0).abs(),
    ]
}
