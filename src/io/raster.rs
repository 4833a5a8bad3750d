//! Decoded samples as a file stores them, and the one place where they get their meaning.
//!
//! The rule: integer samples are display-encoded sRGB and their alpha is straight, float samples are scene-linear, unless
//! the file says otherwise. A matte or a depth is never display-encoded.

use super::profile::Profile;
use crate::color::{decode_srgb8, decode_srgb16, srgb_to_linear};
use crate::{Coverage, Depth, Film, Image, LinearRgb, PremulRgba, Srgb8, StraightRgba};
use half::f16;
use rayon::prelude::*;

/// Samples of a picture, channels interleaved, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F16(Vec<f16>),
    F32(Vec<f32>),
}

impl Samples {
    pub(super) fn are_float(&self) -> bool {
        matches!(self, Self::F16(_) | Self::F32(_))
    }
}

/// What a decoder hands over.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Names of the interleaved channels: `R G B A`, `Y`, `Z`, ...
    pub(super) names: Vec<String>,
    pub(super) samples: Samples,
    /// Colour samples are sRGB display values.
    pub(super) display_encoded: bool,
    /// Colour samples are already multiplied by alpha.
    pub(super) premultiplied: bool,
}

/// Why a decoder did not hand over a picture.
#[derive(Debug)]
pub(super) enum Refusal {
    /// The file may be fine, this decoder does not know its kind: another may.
    Unsupported(String),
    /// The file is damaged, too large or not what was asked for.
    Broken(String),
}

impl From<String> for Refusal {
    fn from(what: String) -> Self {
        Self::Broken(what)
    }
}

impl From<&str> for Refusal {
    fn from(what: &str) -> Self {
        Self::Broken(what.into())
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            // Decoders write messages of several lines; ours have one.
            Self::Unsupported(what) | Self::Broken(what) => f.write_str(&one_line(what)),
        }
    }
}

/// Letters of a decoder's message that are told; a damaged file may make it list thousands of numbers.
const TOLD: usize = 300;

/// The beginning of a text of any form on one line.
pub(super) fn one_line(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(TOLD) {
        Some((end, _)) => format!("{}..", &line[..end]),
        None => line,
    }
}

/// Which channels a kind of pixel is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wanted {
    /// `R G B`, or `Y` for grey; `A` where it is there.
    Color,
    /// As `Color`, with the transmittance `VR VG VB` or else `TR TG TB` where one is there.
    Film,
    /// The only channel, or `A`, or `Y`.
    Coverage,
    /// The only channel, or `Z`.
    Depth,
}

impl Wanted {
    /// Where the wanted channels stand among `names`: red, green, blue and perhaps alpha, or one.
    pub(super) fn pick(self, names: &[String]) -> Result<Vec<usize>, String> {
        let at = |name: &str| names.iter().position(|n| n == name);
        let all = |names: [&str; 3]| names.into_iter().map(at).collect::<Option<Vec<_>>>();
        let found = match self {
            Self::Film => {
                let through = all(VIEW_TRANSMITTANCE).or_else(|| all(TRANSMITTANCE)).unwrap_or_default();
                let color = Self::Color.pick(names)?;
                let alpha_free = if through.is_empty() { color.len() } else { 3 };
                Some(color.into_iter().take(alpha_free).chain(through).collect())
            }
            Self::Color => all(["R", "G", "B"])
                .or_else(|| at("Y").map(|y| vec![y; 3]))
                .map(|color| color.into_iter().chain(at("A")).collect()),
            _ if names.len() == 1 => Some(vec![0]),
            Self::Coverage if at("A").is_some() && at("Y").is_some() => None,
            Self::Coverage => at("A").or(at("Y")).map(|i| vec![i]),
            Self::Depth => at("Z").map(|i| vec![i]),
        };
        found.ok_or_else(|| format!("has the channels {}, expected {}", names.join(" "), self.expected()))
    }

    fn expected(self) -> &'static str {
        match self {
            Self::Color | Self::Film => "R G B or Y, with or without A",
            Self::Coverage => "one channel, or one named A or Y",
            Self::Depth => "one channel, or one named Z",
        }
    }
}

/// Channels of a film's measured transmittance: the screen seen through it and in its shadow.
pub const TRANSMITTANCE: [&str; 3] = ["TR", "TG", "TB"];
/// Channels of a film's view transmittance: the share of the line of sight that passes.
pub const VIEW_TRANSMITTANCE: [&str; 3] = ["VR", "VG", "VB"];

/// How a pixel type is made from the samples of a file. Sealed by being private to `io`.
pub trait FromFile: Copy + Send + Sync + Default + 'static {
    #[doc(hidden)]
    const WANTED: Wanted;
    #[doc(hidden)]
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String>;
}

/// A [`Raster`] that only `io` can look into, and what its file says of its colours.
#[derive(Debug)]
pub struct Opaque<'a>(pub(super) &'a Raster, pub(super) Option<&'a Profile>);

/// Colour with alpha in whichever form the file has it.
trait Colored: Copy + Send {
    fn straight(color: [f32; 3], alpha: f32) -> Self;
    fn premultiplied(color: [f32; 3], alpha: f32) -> Self;
}

impl Colored for PremulRgba {
    #[inline(always)]
    fn straight([r, g, b]: [f32; 3], a: f32) -> Self {
        StraightRgba { r, g, b, a }.to_premul()
    }
    #[inline(always)]
    fn premultiplied([r, g, b]: [f32; 3], a: f32) -> Self {
        Self { r, g, b, a }
    }
}

impl Colored for StraightRgba {
    #[inline(always)]
    fn straight([r, g, b]: [f32; 3], a: f32) -> Self {
        Self { r, g, b, a }
    }
    #[inline(always)]
    fn premultiplied([r, g, b]: [f32; 3], a: f32) -> Self {
        PremulRgba { r, g, b, a }.to_straight()
    }
}

/// Opaque colour; that it is opaque was checked before.
impl Colored for LinearRgb {
    #[inline(always)]
    fn straight(color: [f32; 3], _: f32) -> Self {
        color.into()
    }
    #[inline(always)]
    fn premultiplied(color: [f32; 3], _: f32) -> Self {
        color.into()
    }
}

impl FromFile for PremulRgba {
    const WANTED: Wanted = Wanted::Color;
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String> {
        raster.0.colors(raster.1)
    }
}

impl FromFile for Film {
    const WANTED: Wanted = Wanted::Film;
    /// Transmittance where float channels have it, else alpha for every channel.
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String> {
        let picked = Wanted::Film.pick(&raster.0.names)?;
        match (&raster.0.samples, &picked[..]) {
            (Samples::F32(v), &[r, g, b, tr, tg, tb]) => {
                Ok(raster.0.each(v, |px| Film::new([px[r], px[g], px[b]].into(), [px[tr], px[tg], px[tb]].into())))
            }
            (Samples::F16(v), &[r, g, b, tr, tg, tb]) => Ok(raster.0.each(v, |px| {
                let three = |at: [usize; 3]| at.map(|i| f32::from(px[i])).into();
                Film::new(three([r, g, b]), three([tr, tg, tb]))
            })),
            _ => {
                let rgba: Image<PremulRgba> = raster.0.colors(raster.1)?;
                Ok(Image::from_vec(rgba.width(), rgba.height(), rgba.pixels().iter().map(|&p| p.into()).collect()))
            }
        }
    }
}

impl FromFile for StraightRgba {
    const WANTED: Wanted = Wanted::Color;
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String> {
        raster.0.colors(raster.1)
    }
}

impl FromFile for LinearRgb {
    const WANTED: Wanted = Wanted::Color;
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String> {
        raster.0.refuse_transparency()?;
        raster.0.colors(raster.1)
    }
}

impl FromFile for Coverage {
    const WANTED: Wanted = Wanted::Coverage;
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String> {
        raster.0.single(Self::WANTED, Coverage)
    }
}

impl FromFile for Depth {
    const WANTED: Wanted = Wanted::Depth;
    fn from_raster(raster: &Opaque<'_>) -> Result<Image<Self>, String> {
        if !raster.0.samples.are_float() {
            return Err("integer samples, expected a depth in float (metres)".into());
        }
        raster.0.single(Self::WANTED, Depth)
    }
}

/// Where the channels of a colour stand in a pixel.
struct Channels {
    color: [usize; 3],
    alpha: Option<usize>,
}

/// What counts as opaque: half floats next to 1 are 0.0005 apart.
const OPAQUE: f32 = 0.999;

impl Raster {
    /// A photo must not hide the share of a pixel that is missing.
    fn refuse_transparency(&self) -> Result<(), String> {
        let Some(a) = self.names.iter().position(|n| n == "A") else { return Ok(()) };
        let alpha = self.plane(a, Coverage);
        let clear = alpha.pixels().iter().filter(|c| c.0 < OPAQUE).count();
        if clear == 0 {
            return Ok(());
        }
        Err(format!("{clear} pixels with alpha below 1, expected an opaque picture (put it over a background first)"))
    }

    fn colors<P: Colored>(&self, profile: Option<&Profile>) -> Result<Image<P>, String> {
        let picked = Wanted::Color.pick(&self.names)?;
        let at = Channels { color: [picked[0], picked[1], picked[2]], alpha: picked.get(3).copied() };
        let light = |display: [f32; 3]| profile.map_or_else(|| display.map(srgb_to_linear), |p| p.light(display));
        Ok(match (&self.samples, profile) {
            (Samples::U8(v), None) => {
                self.decoded(v, &at, 255.0, |[r, g, b]| decode_srgb8(Srgb8 { r, g, b }).into(), light)
            }
            (Samples::U16(v), None) => self.decoded(v, &at, 65_535.0, |codes| codes.map(decode_srgb16), light),
            (Samples::U8(v), Some(p)) => {
                self.decoded(v, &at, 255.0, |c| p.light(c.map(|c| f32::from(c) / 255.0)), light)
            }
            (Samples::U16(v), Some(p)) => {
                self.decoded(v, &at, 65_535.0, |c| p.light(c.map(|c| f32::from(c) / 65_535.0)), light)
            }
            (Samples::F16(v), _) => self.decoded(v, &at, 1.0, |c| light(c.map(f32::from)), light),
            (Samples::F32(v), _) => self.decoded(v, &at, 1.0, light, light),
        })
    }

    /// Colours out of samples whose alpha is 1 at `full`; `decode` knows their display codes, `light` display values.
    fn decoded<T: Copy + Sync + Into<f32>, P: Colored>(
        &self,
        samples: &[T],
        at: &Channels,
        full: f32,
        decode: impl Fn([T; 3]) -> [f32; 3] + Sync + Send,
        light: impl Fn([f32; 3]) -> [f32; 3] + Sync + Send,
    ) -> Image<P> {
        let a = |px: &[T]| at.alpha.map_or(1.0, |i| px[i].into() / full);
        let plain = |px: &[T]| at.color.map(|i| px[i].into() / full);
        match (self.display_encoded, self.premultiplied && at.alpha.is_some()) {
            (true, false) => self.each(samples, |px| P::straight(decode(at.color.map(|i| px[i])), a(px))),
            (false, false) => self.each(samples, |px| P::straight(plain(px), a(px))),
            (false, true) => self.each(samples, |px| P::premultiplied(plain(px), a(px))),
            (true, true) => self.each(samples, |px| P::straight(light(unassociated(plain(px), a(px))), a(px))),
        }
    }

    /// Samples that are no number, or endless.
    pub(super) fn not_finite(&self) -> usize {
        match &self.samples {
            Samples::F16(v) => v.par_iter().filter(|x| !x.is_finite()).count(),
            Samples::F32(v) => v.par_iter().filter(|x| !x.is_finite()).count(),
            Samples::U8(_) | Samples::U16(_) => 0,
        }
    }

    fn single<P: Copy + Send>(
        &self,
        wanted: Wanted,
        make: impl Fn(f32) -> P + Sync + Send,
    ) -> Result<Image<P>, String> {
        Ok(self.plane(wanted.pick(&self.names)?[0], make))
    }

    /// One channel as plain numbers, full scale 1.
    fn plane<P: Copy + Send>(&self, i: usize, make: impl Fn(f32) -> P + Sync + Send) -> Image<P> {
        match &self.samples {
            Samples::U8(v) => self.each(v, |px| make(f32::from(px[i]) / 255.0)),
            Samples::U16(v) => self.each(v, |px| make(f32::from(px[i]) / 65_535.0)),
            Samples::F16(v) => self.each(v, |px| make(px[i].into())),
            Samples::F32(v) => self.each(v, |px| make(px[i])),
        }
    }

    fn each<T: Sync, P: Copy + Send>(&self, samples: &[T], f: impl Fn(&[T]) -> P + Sync + Send) -> Image<P> {
        let pixels = samples.par_chunks_exact(self.names.len()).with_min_len(self.width.max(1)).map(f).collect();
        Image::from_vec(self.width, self.height, pixels)
    }
}

/// Straight display values from those that somebody multiplied by alpha as they were.
fn unassociated(encoded: [f32; 3], alpha: f32) -> [f32; 3] {
    let k = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
    encoded.map(|v| (v * k).min(1.0))
}

/// Names of the channels of a picture of `count` channels without names of its own.
pub(super) fn usual_names(count: usize) -> Option<Vec<String>> {
    let names: &[&str] = match count {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        4 => &["R", "G", "B", "A"],
        _ => return None,
    };
    Some(names.iter().map(|&n| n.into()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raster(samples: Samples, names: &str, display_encoded: bool, premultiplied: bool) -> Raster {
        let names = names.split(' ').map(String::from).collect();
        Raster { width: 1, height: 1, names, samples, display_encoded, premultiplied }
    }

    #[test]
    fn long_messages_are_cut() {
        assert_eq!(one_line(" a\n b "), "a b");
        assert_eq!(one_line(&"ö ".repeat(9999)).chars().count(), TOLD + 2);
    }

    #[test]
    fn alpha_multiplies_linear_light() {
        let half_white = raster(Samples::U8(vec![255, 255, 255, 128]), "R G B A", true, false);
        let p = PremulRgba::from_raster(&Opaque(&half_white, None)).unwrap()[(0, 0)];
        assert_eq!(p, PremulRgba::new(128.0 / 255.0, 128.0 / 255.0, 128.0 / 255.0, 128.0 / 255.0));
    }

    #[test]
    fn premultiplied_display_codes_are_divided_before_they_are_decoded() {
        let grey = raster(Samples::U8(vec![64, 64, 64, 128]), "R G B A", true, true);
        let p = PremulRgba::from_raster(&Opaque(&grey, None)).unwrap()[(0, 0)];
        let expected = srgb_to_linear(0.5) * 128.0 / 255.0;
        assert!((p.r - expected).abs() < 1e-6, "{p:?}");
    }

    #[test]
    fn an_opaque_alpha_is_dropped_and_a_transparent_one_refused() {
        let opaque = raster(Samples::U8(vec![255, 0, 0, 255]), "R G B A", true, false);
        assert_eq!(LinearRgb::from_raster(&Opaque(&opaque, None)).unwrap()[(0, 0)], LinearRgb::new(1.0, 0.0, 0.0));
        let clear = raster(Samples::U8(vec![255, 0, 0, 254]), "R G B A", true, false);
        assert!(LinearRgb::from_raster(&Opaque(&clear, None)).unwrap_err().contains("alpha"));
    }

    #[test]
    fn masks_are_never_display_decoded() {
        let mask = raster(Samples::U8(vec![51]), "Y", true, false);
        assert_eq!(Coverage::from_raster(&Opaque(&mask, None)).unwrap()[(0, 0)], Coverage(0.2));
    }

    #[test]
    fn a_mask_of_three_channels_is_refused_with_what_was_expected() {
        let mask = raster(Samples::U8(vec![51; 3]), "R G B", true, false);
        let e = Coverage::from_raster(&Opaque(&mask, None)).unwrap_err();
        assert_eq!(e, "has the channels R G B, expected one channel, or one named A or Y");
    }

    #[test]
    fn straight_colour_under_zero_alpha_is_kept() {
        let clear = raster(Samples::F32(vec![0.5, 0.25, 0.125, 0.0]), "R G B A", false, false);
        let p = StraightRgba::from_raster(&Opaque(&clear, None)).unwrap()[(0, 0)];
        assert_eq!((p.r, p.g, p.b, p.a), (0.5, 0.25, 0.125, 0.0));
    }
}
