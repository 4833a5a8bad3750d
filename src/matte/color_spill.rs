//! Color Spill: removes the screen's light from the subject.

use super::check::{check_length, check_value};
use super::key::{Photo, Profile};
use super::screen::other_channels;
use crate::error::Result;
use crate::image::Image;
use crate::pixel::PremulRgba;
use serde::{Deserialize, Serialize};

/// A colour channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpillChannel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
}

/// What limits the spill channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum SpillLimit {
    /// One other channel.
    Simple,
    /// The mean of both others.
    Average,
}

/// Settings of [`color_spill`], under the names that Blender 3.4 gives them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ColorSpillOptions {
    /// Which Blender release to follow; `robust` and 4.2 are 3.4 here. Default: `blender-3.4`.
    pub profile: Profile,
    /// The screen's channel. Default: `G`.
    pub channel: SpillChannel,
    /// What it is limited by. Default: `SIMPLE`.
    pub limit_method: SpillLimit,
    /// The channel that limits, where it is one. Default: `R`.
    pub limit_channel: SpillChannel,
    /// Multiple of the limit that is allowed, 0.5 to 1.5. Default: 1.
    pub ratio: f32,
    /// Share of the excess that is removed, at least 0; 4.5 scales only the spill channel by it.
    /// Default: 1.
    pub fac: f32,
    /// The excess is distributed by the three strengths below. Default: false.
    pub use_unspill: bool,
    /// Share of the excess for (or, in the spill channel, from) red, at least 0. Default: 0.
    pub unspill_red: f32,
    /// The same for green. Default: 0.
    pub unspill_green: f32,
    /// The same for blue. Default: 0.
    pub unspill_blue: f32,
}

impl Default for ColorSpillOptions {
    fn default() -> Self {
        Self {
            profile: Profile::default(),
            channel: SpillChannel::G,
            limit_method: SpillLimit::Simple,
            limit_channel: SpillChannel::R,
            ratio: 1.0,
            fac: 1.0,
            use_unspill: false,
            unspill_red: 0.0,
            unspill_green: 0.0,
            unspill_blue: 0.0,
        }
    }
}

/// Removes the excess of the screen's channel from a photo.
///
/// Takes a scene-linear photo, opaque or premultiplied; returns it premultiplied, same size, alpha
/// as it was.
///
/// # Method
/// The excess of the spill channel over `ratio` times its limit is subtracted from it where
/// positive, and added to the other channels by the strengths.
pub fn color_spill<P: Photo>(photo: &Image<P>, options: &ColorSpillOptions) -> Image<PremulRgba> {
    let strengths = strengths(options);
    photo.map(|p| without_spill(p.premul(), strengths, options))
}

#[inline(always)]
fn without_spill(p: PremulRgba, strengths: [f32; 3], options: &ColorSpillOptions) -> PremulRgba {
    let c = [p.r, p.g, p.b];
    let excess = excess(c, options);
    let [r, g, b] = [0, 1, 2].map(|k| c[k] + strengths[k] * excess);
    if excess > 0.0 {
        PremulRgba::new(r, g, b, p.a)
    } else {
        p
    }
}

/// By how much the spill channel exceeds its limit.
#[inline(always)]
fn excess(c: [f32; 3], options: &ColorSpillOptions) -> f32 {
    let spill = c[options.channel as usize];
    let limit = limit(c, options);
    if options.profile == Profile::Blender45 {
        options.fac * spill - options.ratio * limit
    } else {
        options.fac.min(1.0) * (spill - options.ratio * limit)
    }
}

/// What the spill channel is limited by.
#[inline(always)]
fn limit(c: [f32; 3], options: &ColorSpillOptions) -> f32 {
    match options.limit_method {
        SpillLimit::Simple => c[options.limit_channel as usize],
        SpillLimit::Average => {
            let (first, second) = other_channels(c, options.channel as usize);
            (first + second) * 0.5
        }
    }
}

/// What every channel gets of the excess.
fn strengths(options: &ColorSpillOptions) -> [f32; 3] {
    let spill = options.channel as usize;
    let mut strengths = match options.use_unspill {
        true => [
            options.unspill_red,
            options.unspill_green,
            options.unspill_blue,
        ],
        false => [0, 1, 2].map(|k| if k == spill { 1.0 } else { 0.0 }),
    };
    strengths[spill] = -strengths[spill];
    strengths
}

impl ColorSpillOptions {
    /// Whether every setting lies in its range.
    ///
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) with the setting's name, its value and what was
    /// expected.
    pub fn check(&self) -> Result<()> {
        check_value((0.5..=1.5).contains(&self.ratio), "key.ratio", || {
            format!("{}, expected 0.5 to 1.5", self.ratio)
        })?;
        check_length("key.fac", self.fac)?;
        check_length("key.unspill_red", self.unspill_red)?;
        check_length("key.unspill_green", self.unspill_green)?;
        check_length("key.unspill_blue", self.unspill_blue)
    }
}
