//! Conversion of the samples of a file to pixels: the only place where samples get their meaning.
//!
//! The rule: integer samples are display-encoded sRGB with straight alpha, float samples are
//! scene-linear, unless the file states otherwise. A matte or a depth is never display-encoded.

use super::channels::Wanted;
use super::profile::DisplayProfile;
use super::raster::{Raster, Samples};
use crate::color::{decode_srgb8, decode_srgb16, srgb_to_linear};
use crate::image::Image;
use crate::pixel::{Coverage, Depth, Film, LinearRgb, PremulRgba, Srgb8, StraightRgba};
use bytemuck::{Zeroable, zeroed_vec};
use half::f16;
use rayon::prelude::*;
use std::ops::Range;

/// Conversion of the samples of a file to a pixel type. Sealed by being private to `io`.
pub trait FromFile: Copy + Send + Sync + Default + Zeroable + 'static {
    #[doc(hidden)]
    const WANTED: Wanted;
    /// Rejects rows that cannot be such pixels.
    #[doc(hidden)]
    fn check(_: &SampleRows<'_>) -> Result<(), String> {
        Ok(())
    }
    /// The channel to convert, where only the values of all rows show which of several it is.
    #[doc(hidden)]
    fn channel(_: &SampleRows<'_>) -> Result<Option<usize>, String> {
        Ok(None)
    }
    /// Converts the samples of the rows.
    #[doc(hidden)]
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String>;
}

impl FromFile for PremulRgba {
    const WANTED: Wanted = Wanted::Color;
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.fill_colors(pixels)
    }
}

impl FromFile for StraightRgba {
    const WANTED: Wanted = Wanted::Color;
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.fill_colors(pixels)
    }
}

impl FromFile for LinearRgb {
    const WANTED: Wanted = Wanted::Color;
    fn check(rows: &SampleRows<'_>) -> Result<(), String> {
        rows.refuse_transparency()
    }
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.fill_colors(pixels)
    }
}

impl FromFile for Film {
    const WANTED: Wanted = Wanted::Film;
    /// Transmittance if there are float channels of it, otherwise alpha for every channel.
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String> {
        let picked = Wanted::Film.pick(&rows.raster.names)?;
        match (&rows.raster.samples, <[usize; 6]>::try_from(picked)) {
            (Samples::F32(v), Ok(at)) => rows.map_pixels(v, pixels, |px| film_pixel(px, at)),
            (Samples::F16(v), Ok(at)) => rows.map_pixels(v, pixels, |px| film_pixel(px, at)),
            _ => return rows.fill_grey_films(pixels),
        }
        Ok(())
    }
}

impl FromFile for Coverage {
    const WANTED: Wanted = Wanted::Coverage;
    fn channel(rows: &SampleRows<'_>) -> Result<Option<usize>, String> {
        rows.matte_channel().map(Some)
    }
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.fill_from_channel(Self::WANTED, pixels, Coverage)
    }
}

impl FromFile for Depth {
    const WANTED: Wanted = Wanted::Depth;
    fn check(rows: &SampleRows<'_>) -> Result<(), String> {
        match rows.raster.samples.are_float() {
            true => Ok(()),
            false => Err("integer samples, expected a depth in float (metres)".into()),
        }
    }
    fn fill(rows: &SampleRows<'_>, pixels: &mut [Self]) -> Result<(), String> {
        rows.fill_from_channel(Self::WANTED, pixels, Depth)
    }
}

/// Colour and transmittance of a pixel, from the channels at these indices.
#[inline(always)]
fn film_pixel<T: FileSample>(px: &[T], [r, g, b, tr, tg, tb]: [usize; 6]) -> Film {
    Film::new(triple(px, [r, g, b]), triple(px, [tr, tg, tb]))
}

#[inline(always)]
fn triple<T: FileSample>(px: &[T], channels: [usize; 3]) -> LinearRgb {
    channels.map(|i| px[i].into()).into()
}

/// Colour with alpha, created from whichever form the file has.
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

/// Opaque colour; opacity was already checked.
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

/// A sample of a file, as a number and as a display code.
trait FileSample: Copy + Send + Sync + Into<f32> {
    /// The sample that represents 1.
    const FULL_SCALE: f32;

    /// Decodes sRGB display codes to linear light.
    fn decode_srgb(codes: [Self; 3]) -> [f32; 3];

    /// Scales full scale to 1.
    #[inline(always)]
    fn normalized(self) -> f32 {
        self.into() / Self::FULL_SCALE
    }
}

impl FileSample for u8 {
    const FULL_SCALE: f32 = 255.0;
    #[inline(always)]
    fn decode_srgb([r, g, b]: [Self; 3]) -> [f32; 3] {
        decode_srgb8(Srgb8 { r, g, b }).into()
    }
}

impl FileSample for u16 {
    const FULL_SCALE: f32 = 65_535.0;
    #[inline(always)]
    fn decode_srgb(codes: [Self; 3]) -> [f32; 3] {
        codes.map(decode_srgb16)
    }
}

impl FileSample for f16 {
    const FULL_SCALE: f32 = 1.0;
    #[inline(always)]
    fn decode_srgb(display: [Self; 3]) -> [f32; 3] {
        display.map(|v| srgb_to_linear(v.into()))
    }
}

impl FileSample for f32 {
    const FULL_SCALE: f32 = 1.0;
    #[inline(always)]
    fn decode_srgb(display: [Self; 3]) -> [f32; 3] {
        display.map(srgb_to_linear)
    }
}

/// Indices of a colour's channels in a pixel.
#[derive(Clone, Copy)]
struct ColorChannels {
    color: [usize; 3],
    alpha: Option<usize>,
}

impl ColorChannels {
    fn among(names: &[String]) -> Result<Self, String> {
        let picked = Wanted::Color.pick(names)?;
        Ok(Self {
            color: [picked[0], picked[1], picked[2]],
            alpha: picked.get(3).copied(),
        })
    }

    #[inline(always)]
    fn codes<T: FileSample>(&self, px: &[T]) -> [T; 3] {
        self.color.map(|i| px[i])
    }

    #[inline(always)]
    fn normalized<T: FileSample>(&self, px: &[T]) -> [f32; 3] {
        self.color.map(|i| px[i].normalized())
    }

    #[inline(always)]
    fn alpha<T: FileSample>(&self, px: &[T]) -> f32 {
        self.alpha.map_or(1.0, |i| px[i].normalized())
    }
}

/// Minimum alpha of an opaque pixel: half floats next to 1 are 0.0005 apart.
const OPAQUE_ALPHA: f32 = 0.999;

/// Maximum difference of the three channels of a grey: colour conversions round by up to an 8-bit
/// code.
const GREY_TOLERANCE: f32 = 1.01 / 255.0;

/// Rows of a [`Raster`], accessible only within `io`, and the colour profile of its file.
#[derive(Debug)]
pub struct SampleRows<'a> {
    raster: &'a Raster,
    profile: Option<&'a DisplayProfile>,
    rows: Range<usize>,
}

impl SampleRows<'_> {
    /// A photo must be opaque: pixels with missing shares must not go unnoticed.
    fn refuse_transparency(&self) -> Result<(), String> {
        let picked = Wanted::Color.pick(&self.raster.names)?;
        match picked.get(3).map_or(0, |&a| self.count_transparent(a)) {
            0 => Ok(()),
            count => Err(format!(
                "{count} pixels with alpha below 1 or outside an EXR's data window, expected an opaque picture (put it over a background first)"
            )),
        }
    }

    /// Number of pixels that channel `a` does not mark as opaque.
    fn count_transparent(&self, a: usize) -> usize {
        self.count_values(|value| value(a) < OPAQUE_ALPHA)
    }

    /// The channel of the matte. Programs without greyscale support write it to `R`, `G` and `B`,
    /// with or without an alpha of 1; if both could be meant, alpha is used.
    fn matte_channel(&self) -> Result<usize, String> {
        let picked = Wanted::Coverage.pick(&self.raster.names)?;
        let &[r, g, b, ref alpha @ ..] = &picked[..] else {
            return Ok(picked[0]);
        };
        let colored = self.count_colored([r, g, b]);
        let alpha = alpha.iter().find(|&&a| self.count_transparent(a) > 0);
        match alpha {
            None if colored == 0 => Ok(r),
            None => {
                let expected = Wanted::Coverage.expected();
                Err(format!("{colored} coloured pixels, expected {expected}"))
            }
            Some(&a) if r != g => Ok(a),
            Some(_) => Err(Wanted::Coverage.missing_among(&self.raster.names)),
        }
    }

    /// Number of pixels that are not grey.
    fn count_colored(&self, rgb: [usize; 3]) -> usize {
        self.count_values(|value| channel_spread(rgb.map(value)) > GREY_TOLERANCE)
    }

    /// Number of pixels that satisfy a predicate, which gets their channels with full scale 1.
    fn count_values(&self, is: impl Fn(&dyn Fn(usize) -> f32) -> bool + Sync + Send) -> usize {
        match &self.raster.samples {
            Samples::U8(v) => self.count(v, |px| is(&|i| px[i].normalized())),
            Samples::U16(v) => self.count(v, |px| is(&|i| px[i].normalized())),
            Samples::F16(v) => self.count(v, |px| is(&|i| px[i].normalized())),
            Samples::F32(v) => self.count(v, |px| is(&|i| px[i].normalized())),
        }
    }

    fn fill_colors<P: Colored>(&self, pixels: &mut [P]) -> Result<(), String> {
        let at = ColorChannels::among(&self.raster.names)?;
        match &self.raster.samples {
            Samples::U8(v) => self.decode_colors(v, pixels, at),
            Samples::U16(v) => self.decode_colors(v, pixels, at),
            Samples::F16(v) => self.decode_colors(v, pixels, at),
            Samples::F32(v) => self.decode_colors(v, pixels, at),
        }
        Ok(())
    }

    /// Converts colours by the file's profile, or as sRGB.
    fn decode_colors<T: FileSample, P: Colored>(
        &self,
        samples: &[T],
        pixels: &mut [P],
        at: ColorChannels,
    ) {
        match self.profile {
            None => self.convert_colors(samples, pixels, at, T::decode_srgb, |display| {
                display.map(srgb_to_linear)
            }),
            Some(profile) => self.convert_colors(
                samples,
                pixels,
                at,
                |codes| profile.light(codes.map(T::normalized)),
                |display| profile.light(display),
            ),
        }
    }

    /// Converts colours from the form that the file has; `decode` takes its display codes, `light`
    /// display values.
    ///
    /// Long because each of the four possible forms is a loop without a branch per pixel.
    fn convert_colors<T: FileSample, P: Colored>(
        &self,
        samples: &[T],
        pixels: &mut [P],
        at: ColorChannels,
        decode: impl Fn([T; 3]) -> [f32; 3] + Sync + Send,
        light: impl Fn([f32; 3]) -> [f32; 3] + Sync + Send,
    ) {
        let premultiplied = self.raster.premultiplied && at.alpha.is_some();
        match (self.raster.display_encoded, premultiplied) {
            (true, false) => self.map_pixels(samples, pixels, |px| {
                P::straight(decode(at.codes(px)), at.alpha(px))
            }),
            (false, false) => self.map_pixels(samples, pixels, |px| {
                P::straight(at.normalized(px), at.alpha(px))
            }),
            (false, true) => self.map_pixels(samples, pixels, |px| {
                P::premultiplied(at.normalized(px), at.alpha(px))
            }),
            (true, true) => self.map_pixels(samples, pixels, |px| {
                let straight = unassociated(at.normalized(px), at.alpha(px));
                P::straight(light(straight), at.alpha(px))
            }),
        }
    }

    /// Films of pixels whose alpha applies to every channel.
    fn fill_grey_films(&self, films: &mut [Film]) -> Result<(), String> {
        let mut rgba = zeroed_vec::<PremulRgba>(films.len());
        self.fill_colors(&mut rgba)?;
        for (film, rgba) in films.iter_mut().zip(rgba) {
            *film = rgba.into();
        }
        Ok(())
    }

    /// One channel as plain numbers, full scale 1.
    fn fill_from_channel<P: Send>(
        &self,
        wanted: Wanted,
        pixels: &mut [P],
        make: impl Fn(f32) -> P + Sync + Send,
    ) -> Result<(), String> {
        let i = wanted.pick(&self.raster.names)?[0];
        match &self.raster.samples {
            Samples::U8(v) => self.map_pixels(v, pixels, |px| make(px[i].normalized())),
            Samples::U16(v) => self.map_pixels(v, pixels, |px| make(px[i].normalized())),
            Samples::F16(v) => self.map_pixels(v, pixels, |px| make(px[i].normalized())),
            Samples::F32(v) => self.map_pixels(v, pixels, |px| make(px[i].normalized())),
        }
        Ok(())
    }

    fn map_pixels<T: Sync, P: Send>(
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
        let row = self.raster.row_samples();
        samples[self.rows.start * row..self.rows.end * row]
            .par_chunks_exact(self.raster.names.len())
    }
}

/// The difference between the largest and the smallest of three channels.
fn channel_spread([r, g, b]: [f32; 3]) -> f32 {
    r.max(g).max(b) - r.min(g).min(b)
}

/// Straight display values from values that were multiplied by alpha without decoding.
fn unassociated(encoded: [f32; 3], alpha: f32) -> [f32; 3] {
    let k = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
    encoded.map(|v| (v * k).min(1.0))
}

/// Pixels converted at a time.
const BAND_PIXELS: usize = 1 << 20;

/// All rows of a picture in bands of about [`BAND_PIXELS`], from bottom to top.
fn bands_from_bottom(width: usize, height: usize) -> impl Iterator<Item = Range<usize>> {
    let band_rows = (BAND_PIXELS / width.max(1)).max(1);
    let ends = std::iter::successors(Some(height), move |end| end.checked_sub(band_rows));
    ends.take_while(|&end| end > 0)
        .map(move |end| end.saturating_sub(band_rows)..end)
}

impl Raster {
    /// Some rows with the meaning of their colours.
    pub(crate) fn rows<'a>(
        &'a self,
        profile: Option<&'a DisplayProfile>,
        rows: Range<usize>,
    ) -> SampleRows<'a> {
        SampleRows {
            raster: self,
            profile,
            rows,
        }
    }

    /// The pixels of some rows.
    pub(crate) fn pixels<P: FromFile>(
        &self,
        profile: Option<&DisplayProfile>,
        rows: Range<usize>,
    ) -> Result<Image<P>, String> {
        let (width, height) = (self.width, rows.len());
        let mut pixels = zeroed_vec(width * height);
        P::fill(&self.rows(profile, rows), &mut pixels)?;
        Ok(Image::from_vec(width, height, pixels))
    }

    /// All pixels, converted from the last row up; the samples' memory is released on the way, so
    /// that the total never exceeds the larger of the two by much.
    pub(crate) fn into_image<P: FromFile>(
        mut self,
        profile: Option<&DisplayProfile>,
    ) -> Result<Image<P>, String> {
        let (width, height) = (self.width, self.height);
        let whole = self.rows(profile, 0..height);
        P::check(&whole)?;
        if let Some(channel) = P::channel(&whole)? {
            self = self.narrowed(channel);
        }
        let mut pixels: Vec<P> = zeroed_vec(width * height);
        for rows in bands_from_bottom(width, height) {
            let band = &mut pixels[rows.start * width..rows.end * width];
            P::fill(&self.rows(profile, rows.clone()), band)?;
            self.samples.shorten(rows.start * self.row_samples());
        }
        Ok(Image::from_vec(width, height, pixels))
    }
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
        // An alpha that is below 1 somewhere is the matte.
        assert_eq!(
            matte(&[51, 51, 51, 255, 0, 0, 0, 0], "R G B A").unwrap(),
            [full, none]
        );
        let expected = "expected one channel, three equal ones R G B, or one named A or Y";
        let coloured = matte(&[51, 51, 51, 51, 0, 51], "R G B").unwrap_err();
        assert_eq!(coloured, format!("1 coloured pixels, {expected}"));
        // An alpha that is 1 everywhere is ignored.
        let opaque = matte(&[51, 0, 0, 255], "R G B A").unwrap_err();
        assert_eq!(opaque, coloured);
        assert_eq!(
            matte(&[51, 128], "Y A").unwrap_err(),
            format!("has the channels Y A, {expected}")
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
