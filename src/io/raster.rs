//! Decoded samples as a file stores them, and the one place where they get their meaning.
//!
//! The rule: integer samples are display-encoded sRGB and their alpha is straight, float samples are scene-linear, unless
//! the file says otherwise. A matte or a depth is never display-encoded.

use super::orient::Orientation;
use super::profile::Profile;
use crate::color::{decode_srgb8, decode_srgb16, srgb_to_linear};
use crate::{Coverage, Depth, Film, Image, LinearRgb, PremulRgba, Srgb8, StraightRgba};
use bytemuck::{Zeroable, zeroed_vec};
use half::f16;
use rayon::prelude::*;
use std::ops::Range;

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

    /// Gives the memory of the last samples back.
    fn shorten(&mut self, count: usize) {
        fn shorten<T>(samples: &mut Vec<T>, count: usize) {
            samples.truncate(count);
            samples.shrink_to_fit();
        }
        match self {
            Self::U8(v) => shorten(v, count),
            Self::U16(v) => shorten(v, count),
            Self::F16(v) => shorten(v, count),
            Self::F32(v) => shorten(v, count),
        }
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

#[cfg(feature = "oiio")]
impl Refusal {
    /// With what another decoder could not read, where it said so: that is the file's own, and why it came here.
    pub(super) fn after(self, what: &str) -> Self {
        match self {
            Self::Broken(why) if what.starts_with("unsupported") => {
                Self::Broken(format!("{what} ({why})"))
            }
            other => other,
        }
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
    /// The only channel, or the three equal ones of a grey picture, or `A`.
    Coverage,
    /// The only channel, or `Z`.
    Depth,
}

/// How channels serve a purpose, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Fit {
    /// By the names that are usual.
    Named,
    /// They are those of a layer: `diffuse.R`.
    Layer,
    /// There is no other.
    Alone,
}

/// Layers that are taken before others: what programs call the finished picture.
const FINISHED: [&str; 5] = ["combined", "rgba", "rgb", "beauty", "color"];

impl Wanted {
    /// Where the wanted channels stand among `names`: red, green, blue and perhaps alpha, or one.
    pub(super) fn pick(self, names: &[String]) -> Result<Vec<usize>, String> {
        self.choose(names).map(|(_, picked)| picked)
    }

    /// As [`pick`](Self::pick), and how well they fit.
    pub(super) fn choose(self, names: &[String]) -> Result<(Fit, Vec<usize>), String> {
        let at = |name: &str| names.iter().position(|n| n == name);
        let named = |i: usize| (Fit::Named, vec![i]);
        let found = match self {
            Self::Film => film(names),
            Self::Color => color(names),
            _ if names.len() == 1 => Some(named(0)),
            Self::Coverage => color_of_layer(names, "")
                .map(|picked| (Fit::Named, picked))
                .or_else(|| at("A").map(named)),
            Self::Depth => at("Z")
                .map(named)
                .or_else(|| Some((Fit::Layer, vec![only(names, |n| last(n) == "Z")?]))),
        };
        found.ok_or_else(|| {
            format!(
                "has the channels {}, expected {}",
                names.join(" "),
                self.expected()
            )
        })
    }

    fn expected(self) -> &'static str {
        match self {
            Self::Color | Self::Film => "R G B or Y, with or without A",
            Self::Coverage => "one channel, three equal ones R G B, or one named A or Y",
            Self::Depth => "one channel, or one named Z",
        }
    }
}

/// Colour, with the transmittance in place of alpha where there is one.
fn film(names: &[String]) -> Option<(Fit, Vec<usize>)> {
    let at = |name: &str| names.iter().position(|n| n == name);
    let all = |three: [&str; 3]| three.into_iter().map(at).collect::<Option<Vec<_>>>();
    let through = all(VIEW_TRANSMITTANCE)
        .or_else(|| all(TRANSMITTANCE))
        .unwrap_or_default();
    let (fit, mut picked) = color(names)?;
    picked.truncate(if through.is_empty() { picked.len() } else { 3 });
    picked.extend(through);
    Some((fit, picked))
}

/// Colour by its usual names, or a layer of that, or the only channel that can be seen.
fn color(names: &[String]) -> Option<(Fit, Vec<usize>)> {
    if let Some(picked) = color_of_layer(names, "") {
        return Some((Fit::Named, picked));
    }
    let layers = names
        .iter()
        .filter_map(|name| Some(&name[..=name.rfind('.')?]));
    let layers: Vec<(&str, Vec<usize>)> = layers
        .filter_map(|l| Some((l, color_of_layer(names, l)?)))
        .collect();
    let is_finished =
        |layer: &str| FINISHED.contains(&last(layer.trim_end_matches('.')).to_lowercase().as_str());
    let chosen = layers
        .iter()
        .find(|(layer, _)| is_finished(layer))
        .or(layers.first());
    if let Some((_, picked)) = chosen {
        return Some((Fit::Layer, picked.clone()));
    }
    let seen = only(names, |_| true)
        .or_else(|| only(names, |name| !["A", "Z", "ZBack"].contains(&last(name))))?;
    let alpha = only(names, |name| last(name) == "A").filter(|&a| a != seen);
    Some((Fit::Alone, [seen; 3].into_iter().chain(alpha).collect()))
}

/// `R G B` or `Y` of a layer, with its `A`.
fn color_of_layer(names: &[String], layer: &str) -> Option<Vec<usize>> {
    let at = |name: &str| {
        names
            .iter()
            .position(|n| n.strip_prefix(layer) == Some(name))
    };
    let all = |three: [&str; 3]| three.into_iter().map(at).collect::<Option<Vec<_>>>();
    let grey = || at("Y").map(|y| vec![y; 3]);
    let color = all(["R", "G", "B"])
        .or_else(|| all(["r", "g", "b"]))
        .or_else(grey)?;
    Some(color.into_iter().chain(at("A").or(at("a"))).collect())
}

/// A channel's own name, without its layer's.
fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// Where the only one of a kind stands.
fn only(names: &[String], is: impl Fn(&str) -> bool) -> Option<usize> {
    let mut found = names.iter().enumerate().filter(|(_, name)| is(name));
    let (i, _) = found.next()?;
    found.next().is_none().then_some(i)
}

/// Channels of a film's measured transmittance: the screen seen through it and in its shadow.
pub const TRANSMITTANCE: [&str; 3] = ["TR", "TG", "TB"];
/// Channels of a film's view transmittance: the share of the line of sight that passes.
pub const VIEW_TRANSMITTANCE: [&str; 3] = ["VR", "VG", "VB"];

/// How a pixel type is made from the samples of a file. Sealed by being private to `io`.
pub trait FromFile: Copy + Send + Sync + Default + Zeroable + 'static {
    #[doc(hidden)]
    const WANTED: Wanted;
    /// Refuses rows that cannot be such pixels.
    #[doc(hidden)]
    fn check(_: &Opaque<'_>) -> Result<(), String> {
        Ok(())
    }
    /// The channel that they are made from, where only the values of all rows tell which of several it is.
    #[doc(hidden)]
    fn channel(_: &Opaque<'_>) -> Result<Option<usize>, String> {
        Ok(None)
    }
    /// Makes the pixels of the rows.
    #[doc(hidden)]
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String>;
}

/// Rows of a [`Raster`], which only `io` can look into, and what its file says of its colours.
#[derive(Debug)]
pub struct Opaque<'a> {
    pub(super) raster: &'a Raster,
    pub(super) profile: Option<&'a Profile>,
    pub(super) rows: Range<usize>,
}

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
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.colors(pixels)
    }
}

impl FromFile for Film {
    const WANTED: Wanted = Wanted::Film;
    /// Transmittance where float channels have it, else alpha for every channel.
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String> {
        let picked = Wanted::Film.pick(&rows.raster.names)?;
        match (&rows.raster.samples, &picked[..]) {
            (Samples::F32(v), &[r, g, b, tr, tg, tb]) => {
                rows.each(v, pixels, |px| {
                    Film::new(
                        [px[r], px[g], px[b]].into(),
                        [px[tr], px[tg], px[tb]].into(),
                    )
                });
            }
            (Samples::F16(v), &[r, g, b, tr, tg, tb]) => rows.each(v, pixels, |px| {
                let three = |at: [usize; 3]| at.map(|i| f32::from(px[i])).into();
                Film::new(three([r, g, b]), three([tr, tg, tb]))
            }),
            _ => {
                let mut rgba = zeroed_vec::<PremulRgba>(pixels.len());
                rows.colors(&mut rgba)?;
                pixels
                    .iter_mut()
                    .zip(rgba)
                    .for_each(|(film, rgba)| *film = rgba.into());
            }
        }
        Ok(())
    }
}

impl FromFile for StraightRgba {
    const WANTED: Wanted = Wanted::Color;
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.colors(pixels)
    }
}

impl FromFile for LinearRgb {
    const WANTED: Wanted = Wanted::Color;
    fn check(rows: &Opaque<'_>) -> Result<(), String> {
        rows.refuse_transparency()
    }
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.colors(pixels)
    }
}

impl FromFile for Coverage {
    const WANTED: Wanted = Wanted::Coverage;
    fn channel(rows: &Opaque<'_>) -> Result<Option<usize>, String> {
        rows.matte().map(Some)
    }
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.single(Self::WANTED, pixels, Coverage)
    }
}

impl FromFile for Depth {
    const WANTED: Wanted = Wanted::Depth;
    fn check(rows: &Opaque<'_>) -> Result<(), String> {
        match rows.raster.samples.are_float() {
            true => Ok(()),
            false => Err("integer samples, expected a depth in float (metres)".into()),
        }
    }
    fn fill(rows: &Opaque<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.single(Self::WANTED, pixels, Depth)
    }
}

/// Where the channels of a colour stand in a pixel.
struct Channels {
    color: [usize; 3],
    alpha: Option<usize>,
}

/// What counts as opaque: half floats next to 1 are 0.0005 apart.
const OPAQUE: f32 = 0.999;

/// How far the three channels of a grey may lie apart: conversions of colour round by an 8-bit code.
const EQUAL: f32 = 1.01 / 255.0;

impl Opaque<'_> {
    /// A photo must not hide the share of a pixel that is missing.
    fn refuse_transparency(&self) -> Result<(), String> {
        let clear = match Wanted::Color.pick(&self.raster.names)?.get(3) {
            Some(&a) => self.clear(a),
            None => 0,
        };
        if clear == 0 {
            return Ok(());
        }
        Err(format!(
            "{clear} pixels with alpha below 1, expected an opaque picture (put it over a background first)"
        ))
    }

    /// Pixels whose channel `a` says that they are not opaque.
    fn clear(&self, a: usize) -> usize {
        self.count_values(|value| value(a) < OPAQUE)
    }

    /// Where the matte stands. Programs that know no grey write it into `R`, `G` and `B`, with an alpha of 1 or without;
    /// where both could be meant, alpha is.
    fn matte(&self) -> Result<usize, String> {
        let names = &self.raster.names;
        let picked = Wanted::Coverage.pick(names)?;
        let &[r, g, b, ref alpha @ ..] = &picked[..] else {
            return Ok(picked[0]);
        };
        let differ = |value: &dyn Fn(usize) -> f32| {
            let [r, g, b] = [r, g, b].map(value);
            r.max(g).max(b) - r.min(g).min(b) > EQUAL
        };
        let coloured = self.count_values(differ);
        match alpha.first() {
            None if coloured == 0 => Ok(r),
            None => Err(format!(
                "{coloured} coloured pixels, expected {}",
                Wanted::Coverage.expected()
            )),
            Some(&a) if coloured == 0 && self.clear(a) == 0 => Ok(r),
            Some(&a) if r != g => Ok(a),
            Some(_) => Err(format!(
                "has the channels {}, expected {}",
                names.join(" "),
                Wanted::Coverage.expected()
            )),
        }
    }

    /// Pixels of whose channels, full scale 1, something is true.
    fn count_values(&self, is: impl Fn(&dyn Fn(usize) -> f32) -> bool + Sync + Send) -> usize {
        match &self.raster.samples {
            Samples::U8(v) => self.count(v, |px| is(&|i| f32::from(px[i]) / 255.0)),
            Samples::U16(v) => self.count(v, |px| is(&|i| f32::from(px[i]) / 65_535.0)),
            Samples::F16(v) => self.count(v, |px| is(&|i| px[i].into())),
            Samples::F32(v) => self.count(v, |px| is(&|i| px[i])),
        }
    }

    fn colors<P: Colored>(&self, pixels: &mut [P]) -> Result<(), String> {
        let picked = Wanted::Color.pick(&self.raster.names)?;
        let at = Channels {
            color: [picked[0], picked[1], picked[2]],
            alpha: picked.get(3).copied(),
        };
        let light = |display: [f32; 3]| {
            self.profile
                .map_or_else(|| display.map(srgb_to_linear), |p| p.light(display))
        };
        match (&self.raster.samples, self.profile) {
            (Samples::U8(v), None) => {
                self.decoded(
                    v,
                    pixels,
                    &at,
                    255.0,
                    |[r, g, b]| decode_srgb8(Srgb8 { r, g, b }).into(),
                    light,
                );
            }
            (Samples::U16(v), None) => {
                self.decoded(
                    v,
                    pixels,
                    &at,
                    65_535.0,
                    |codes| codes.map(decode_srgb16),
                    light,
                );
            }
            (Samples::U8(v), Some(p)) => {
                self.decoded(
                    v,
                    pixels,
                    &at,
                    255.0,
                    |c| p.light(c.map(|c| f32::from(c) / 255.0)),
                    light,
                );
            }
            (Samples::U16(v), Some(p)) => {
                self.decoded(
                    v,
                    pixels,
                    &at,
                    65_535.0,
                    |c| p.light(c.map(|c| f32::from(c) / 65_535.0)),
                    light,
                );
            }
            (Samples::F16(v), _) => {
                self.decoded(v, pixels, &at, 1.0, |c| light(c.map(f32::from)), light)
            }
            (Samples::F32(v), _) => self.decoded(v, pixels, &at, 1.0, light, light),
        }
        Ok(())
    }

    /// Colours out of samples whose alpha is 1 at `full`; `decode` knows their display codes, `light` display values.
    fn decoded<T: Copy + Sync + Into<f32>, P: Colored>(
        &self,
        samples: &[T],
        pixels: &mut [P],
        at: &Channels,
        full: f32,
        decode: impl Fn([T; 3]) -> [f32; 3] + Sync + Send,
        light: impl Fn([f32; 3]) -> [f32; 3] + Sync + Send,
    ) {
        let a = |px: &[T]| at.alpha.map_or(1.0, |i| px[i].into() / full);
        let plain = |px: &[T]| at.color.map(|i| px[i].into() / full);
        match (
            self.raster.display_encoded,
            self.raster.premultiplied && at.alpha.is_some(),
        ) {
            (true, false) => self.each(samples, pixels, |px| {
                P::straight(decode(at.color.map(|i| px[i])), a(px))
            }),
            (false, false) => self.each(samples, pixels, |px| P::straight(plain(px), a(px))),
            (false, true) => self.each(samples, pixels, |px| P::premultiplied(plain(px), a(px))),
            (true, true) => {
                self.each(samples, pixels, |px| {
                    P::straight(light(unassociated(plain(px), a(px))), a(px))
                });
            }
        }
    }

    /// One channel as plain numbers, full scale 1.
    fn single<P: Send>(
        &self,
        wanted: Wanted,
        pixels: &mut [P],
        make: impl Fn(f32) -> P + Sync + Send,
    ) -> Result<(), String> {
        let i = wanted.pick(&self.raster.names)?[0];
        match &self.raster.samples {
            Samples::U8(v) => self.each(v, pixels, |px| make(f32::from(px[i]) / 255.0)),
            Samples::U16(v) => self.each(v, pixels, |px| make(f32::from(px[i]) / 65_535.0)),
            Samples::F16(v) => self.each(v, pixels, |px| make(px[i].into())),
            Samples::F32(v) => self.each(v, pixels, |px| make(px[i])),
        }
        Ok(())
    }

    fn each<T: Sync, P: Send>(
        &self,
        samples: &[T],
        pixels: &mut [P],
        f: impl Fn(&[T]) -> P + Sync + Send,
    ) {
        let pixels = pixels.par_iter_mut().with_min_len(self.raster.width.max(1));
        pixels
            .zip(self.stored(samples))
            .for_each(|(pixel, px)| *pixel = f(px));
    }

    fn count<T: Sync>(&self, samples: &[T], is: impl Fn(&[T]) -> bool + Sync + Send) -> usize {
        self.stored(samples).filter(|px| is(px)).count()
    }

    /// The samples of each pixel of the rows.
    fn stored<'s, T: Sync>(
        &self,
        samples: &'s [T],
    ) -> impl IndexedParallelIterator<Item = &'s [T]> {
        let row = self.raster.row();
        samples[self.rows.start * row..self.rows.end * row]
            .par_chunks_exact(self.raster.names.len())
    }
}

/// Pixels that are made at a time.
const BAND: usize = 1 << 20;

impl Raster {
    /// Samples of a row.
    fn row(&self) -> usize {
        self.width * self.names.len()
    }

    /// The pixels of some rows.
    pub(super) fn pixels<P: FromFile>(
        &self,
        profile: Option<&Profile>,
        rows: Range<usize>,
    ) -> Result<Image<P>, String> {
        let (width, height) = (self.width, rows.len());
        let mut pixels = zeroed_vec(width * height);
        P::fill(
            &Opaque {
                raster: self,
                profile,
                rows,
            },
            &mut pixels,
        )?;
        Ok(Image::from_vec(width, height, pixels))
    }

    /// All pixels, from the last row up; the samples' memory is given back on the way, so that never much more than one
    /// of the two is there.
    pub(super) fn into_image<P: FromFile>(
        mut self,
        profile: Option<&Profile>,
    ) -> Result<Image<P>, String> {
        let (width, height) = (self.width, self.height);
        let whole = Opaque {
            raster: &self,
            profile,
            rows: 0..height,
        };
        P::check(&whole)?;
        if let Some(channel) = P::channel(&whole)? {
            self = self.narrowed(channel);
        }
        let row = self.row();
        let mut pixels: Vec<P> = zeroed_vec(width * height);
        let mut rows = height..height;
        while rows.start > 0 {
            rows = rows.start.saturating_sub((BAND / width.max(1)).max(1))..rows.start;
            let part = &mut pixels[rows.start * width..rows.end * width];
            P::fill(
                &Opaque {
                    raster: &self,
                    profile,
                    rows: rows.clone(),
                },
                part,
            )?;
            self.samples.shorten(rows.start * row);
        }
        Ok(Image::from_vec(width, height, pixels))
    }

    /// The picture of one of its channels.
    fn narrowed(self, channel: usize) -> Self {
        let count = self.names.len();
        if count == 1 {
            return self;
        }
        fn every<T: Copy>(samples: &[T], count: usize, channel: usize) -> Vec<T> {
            samples.chunks_exact(count).map(|px| px[channel]).collect()
        }
        let samples = match &self.samples {
            Samples::U8(v) => Samples::U8(every(v, count, channel)),
            Samples::U16(v) => Samples::U16(every(v, count, channel)),
            Samples::F16(v) => Samples::F16(every(v, count, channel)),
            Samples::F32(v) => Samples::F32(every(v, count, channel)),
        };
        Self {
            names: vec![self.names[channel].clone()],
            samples,
            ..self
        }
    }

    /// The picture the way the camera was held.
    pub(super) fn upright(self, orientation: Orientation) -> Self {
        if !orientation.turns() {
            return self;
        }
        let (stored, n) = ((self.width, self.height), self.names.len());
        let samples = match &self.samples {
            Samples::U8(v) => Samples::U8(orientation.apply(v, n, stored)),
            Samples::U16(v) => Samples::U16(orientation.apply(v, n, stored)),
            Samples::F16(v) => Samples::F16(orientation.apply(v, n, stored)),
            Samples::F32(v) => Samples::F32(orientation.apply(v, n, stored)),
        };
        let (width, height) = orientation.size(stored);
        Self {
            width,
            height,
            samples,
            ..self
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
        Raster {
            width: 1,
            height: 1,
            names,
            samples,
            display_encoded,
            premultiplied,
        }
    }

    fn pixel<P: FromFile>(raster: Raster) -> Result<P, String> {
        raster.into_image(None).map(|image: Image<P>| image[(0, 0)])
    }

    #[test]
    fn long_messages_are_cut() {
        assert_eq!(one_line(" a\n b "), "a b");
        assert_eq!(one_line(&"ö ".repeat(9999)).chars().count(), TOLD + 2);
    }

    #[test]
    fn alpha_multiplies_linear_light() {
        let half_white = raster(
            Samples::U8(vec![255, 255, 255, 128]),
            "R G B A",
            true,
            false,
        );
        let p = pixel::<PremulRgba>(half_white).unwrap();
        assert_eq!(
            p,
            PremulRgba::new(128.0 / 255.0, 128.0 / 255.0, 128.0 / 255.0, 128.0 / 255.0)
        );
    }

    #[test]
    fn premultiplied_display_codes_are_divided_before_they_are_decoded() {
        let grey = raster(Samples::U8(vec![64, 64, 64, 128]), "R G B A", true, true);
        let p = pixel::<PremulRgba>(grey).unwrap();
        let expected = srgb_to_linear(0.5) * 128.0 / 255.0;
        assert!((p.r - expected).abs() < 1e-6, "{p:?}");
    }

    #[test]
    fn an_opaque_alpha_is_dropped_and_a_transparent_one_refused() {
        let opaque = raster(Samples::U8(vec![255, 0, 0, 255]), "R G B A", true, false);
        assert_eq!(
            pixel::<LinearRgb>(opaque).unwrap(),
            LinearRgb::new(1.0, 0.0, 0.0)
        );
        let clear = raster(Samples::U8(vec![255, 0, 0, 254]), "R G B A", true, false);
        assert!(pixel::<LinearRgb>(clear).unwrap_err().contains("alpha"));
    }

    #[test]
    fn masks_are_never_display_decoded() {
        let mask = raster(Samples::U8(vec![51]), "Y", true, false);
        assert_eq!(pixel::<Coverage>(mask).unwrap(), Coverage(0.2));
    }

    #[test]
    fn a_grey_picture_of_three_channels_is_a_matte_with_an_alpha_of_one_and_without() {
        let matte = |codes: &[u8], names: &str| {
            let pixels = codes.len() / names.split(' ').count();
            let matte = Raster {
                width: pixels,
                ..raster(Samples::U8(codes.to_vec()), names, true, false)
            };
            matte.into_image(None).map(|image: Image<Coverage>| {
                image.pixels().iter().map(|c| c.0).collect::<Vec<_>>()
            })
        };
        let (full, none) = (1.0, 0.0);
        assert_eq!(matte(&[51, 51, 51, 0, 0, 0], "R G B").unwrap(), [0.2, none]);
        assert_eq!(
            matte(&[51, 51, 51, 255, 0, 0, 0, 255], "R G B A").unwrap(),
            [0.2, none]
        );
        assert_eq!(matte(&[51, 255, 0, 255], "Y A").unwrap(), [0.2, none]);
        // An alpha that says something is the matte.
        assert_eq!(
            matte(&[51, 51, 51, 255, 0, 0, 0, 0], "R G B A").unwrap(),
            [full, none]
        );
        assert_eq!(matte(&[51, 0, 0, 255], "R G B A").unwrap(), [full]);
        let expected = "expected one channel, three equal ones R G B, or one named A or Y";
        let coloured = matte(&[51, 51, 51, 51, 0, 51], "R G B").unwrap_err();
        assert_eq!(coloured, format!("1 coloured pixels, {expected}"));
        assert_eq!(
            matte(&[51, 128], "Y A").unwrap_err(),
            format!("has the channels Y A, {expected}")
        );
    }

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(String::from).collect()
    }

    #[test]
    fn colour_is_found_by_name_by_layer_and_alone() {
        for (channels, fit, picked) in [
            ("A B G R", Fit::Named, "R G B A"),
            ("b g r", Fit::Named, "r g b"),
            ("A Y diffuse.B diffuse.G diffuse.R", Fit::Named, "Y Y Y A"),
            ("d.B d.G d.R s.B s.G s.R", Fit::Layer, "d.R d.G d.B"),
            (
                "V.Alb.B V.Alb.G V.Alb.R V.Combined.A V.Combined.B V.Combined.G V.Combined.R V.Depth.Z",
                Fit::Layer,
                "V.Combined.R V.Combined.G V.Combined.B V.Combined.A",
            ),
            ("left.Y left.A", Fit::Layer, "left.Y left.Y left.Y left.A"),
            ("mask", Fit::Alone, "mask mask mask"),
            ("A", Fit::Alone, "A A A"),
            ("R Z", Fit::Alone, "R R R"),
            ("A R", Fit::Alone, "R R R A"),
        ] {
            let names = names(channels);
            let (found, indices) = Wanted::Color.choose(&names).unwrap();
            let found = (
                found,
                indices
                    .into_iter()
                    .map(|i| names[i].as_str())
                    .collect::<Vec<_>>()
                    .join(" "),
            );
            assert_eq!(found, (fit, picked.to_string()), "{channels}");
        }
        for none in ["u v", "A Z", "d.R d.G s.B", "N.x N.y N.z"] {
            assert!(Wanted::Color.pick(&names(none)).is_err(), "{none}");
        }
    }

    #[test]
    fn depth_is_found_in_a_layer() {
        assert_eq!(Wanted::Depth.pick(&names("V.C.R V.Depth.Z")).unwrap(), [1]);
        assert!(
            Wanted::Depth
                .pick(&names("V.C.R V.Depth.Z V.Mist.Z"))
                .is_err()
        );
    }

    #[test]
    fn a_picture_made_in_bands_is_the_same() {
        let (width, height) = (1 << 10, (2 << 10) + 1);
        let codes: Vec<u8> = (0..width * height)
            .map(|i| (i * 7 + i / width) as u8)
            .collect();
        let grey = || Raster {
            width,
            height,
            ..raster(Samples::U8(codes.clone()), "Y", true, false)
        };
        let whole: Image<Coverage> = grey().pixels(None, 0..height).unwrap();
        assert!(grey().into_image::<Coverage>(None).unwrap() == whole);
        let rows: Image<Coverage> = grey().pixels(None, 5..9).unwrap();
        assert_eq!(rows.pixels(), &whole.pixels()[5 * width..9 * width]);
    }

    #[test]
    fn straight_colour_under_zero_alpha_is_kept() {
        let clear = raster(
            Samples::F32(vec![0.5, 0.25, 0.125, 0.0]),
            "R G B A",
            false,
            false,
        );
        let p = pixel::<StraightRgba>(clear).unwrap();
        assert_eq!((p.r, p.g, p.b, p.a), (0.5, 0.25, 0.125, 0.0));
    }
}
