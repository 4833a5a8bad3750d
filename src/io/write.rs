//! Typed pictures to files: the format by the extension, the encoding by the pixel type.

use super::atomic::write_bytes;
use super::{Format, exr, jpeg, png, tiff};
use crate::color::{decode_srgb8, encode_srgb8, encode_srgb16};
use crate::work::{self, Kind};
use crate::{
    Coverage, Depth, Error, Film, Image, LinearRgb, PremulRgba, Result, Srgb8, Srgba8, StraightRgba,
};
use rayon::prelude::*;
use std::path::Path;

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    /// 8-bit codes: PNG, JPEG, TIFF.
    Eight,
    /// 16-bit codes: PNG, TIFF.
    Sixteen,
    /// Half float: EXR.
    Half,
    /// Float: EXR, TIFF.
    Float,
}

impl Bits {
    fn name(self) -> &'static str {
        match self {
            Self::Eight => "8-bit",
            Self::Sixteen => "16-bit",
            Self::Half => "half float",
            Self::Float => "float",
        }
    }
}

/// How an EXR is compressed; all of them lossless.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// Deflate over 16 rows: small for rendered pictures.
    #[default]
    Zip,
    /// Wavelets: faster and smaller for grainy photos.
    Piz,
}

impl Compression {
    pub(super) fn of_exr(self) -> ::exr::prelude::Compression {
        match self {
            Self::None => ::exr::prelude::Compression::Uncompressed,
            Self::Zip => ::exr::prelude::Compression::ZIP16,
            Self::Piz => ::exr::prelude::Compression::PIZ,
        }
    }
}

/// How hard a PNG is compressed; all of them lossless.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PngEffort {
    /// Hardly: the quickest.
    Least,
    /// Well for its time.
    #[default]
    Fast,
    /// As most programs do.
    Usual,
    /// As small as it gets.
    Most,
}

impl PngEffort {
    pub(super) fn of_png(self) -> ::png::Compression {
        match self {
            Self::Least => ::png::Compression::Fastest,
            Self::Fast => ::png::Compression::Fast,
            Self::Usual => ::png::Compression::Balanced,
            Self::Most => ::png::Compression::High,
        }
    }
}

/// How a picture is written.
#[derive(Clone, Debug)]
pub struct WriteOptions {
    /// Storage of a sample. Default: the format's own (PNG and JPEG 8 bits, TIFF 16 bits, EXR half; depths always float).
    pub bits: Option<Bits>,
    /// Compression of an EXR. Default: [`Compression::Zip`].
    pub compression: Compression,
    /// Compression of a PNG. Default: [`PngEffort::Fast`].
    pub png: PngEffort,
    /// Quality of a JPEG, 1 to 100. Default: 95.
    pub jpeg_quality: u8,
    /// Texts to store with the picture, by name. Default: none.
    pub metadata: Vec<(String, String)>,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            bits: None,
            compression: Compression::default(),
            png: PngEffort::default(),
            jpeg_quality: 95,
            metadata: Vec::new(),
        }
    }
}

/// Names the colour space of float files that petcomp writes; other programs drop or rename their own attribute for it.
const COLORSPACE: (&str, &str) = ("petcomp:colorspace", "scene-linear Rec. 709");

/// How a pixel type is stored in a file. Sealed by being private to `io`.
pub trait ToFile: Copy + Send + Sync {
    /// Names of its channels.
    #[doc(hidden)]
    const NAMES: &'static [&'static str];
    /// It means something in integers of 0 to 1.
    #[doc(hidden)]
    const CODED: bool = true;
    /// Display-encoded straight codes (a matte: as it is); as many as there are names count.
    #[doc(hidden)]
    fn codes<C: Code>(self) -> [C; 4];
    /// Scene-linear channels, colours multiplied by alpha.
    #[doc(hidden)]
    fn linear(self) -> [f32; CHANNELS];
}

/// Channels of the pixel that has most.
const CHANNELS: usize = 7;

/// The first channels as they are, zeros for the rest.
fn first<const N: usize>(channels: [f32; N]) -> [f32; CHANNELS] {
    std::array::from_fn(|i| if i < N { channels[i] } else { 0.0 })
}

const COLOR: &[&str] = &["R", "G", "B"];
const COLOR_ALPHA: &[&str] = &["R", "G", "B", "A"];

/// An integer that stands for 0 to 1: what is outside is clipped, NaN is 0.
pub trait Code: Copy + Default + Send {
    #[doc(hidden)]
    const FULL: Self;
    /// The value as it is.
    #[doc(hidden)]
    fn plain(v: f32) -> Self;
    /// Light as sRGB displays it.
    #[doc(hidden)]
    fn shown(light: LinearRgb) -> [Self; 3];
    /// The same value as an 8-bit code.
    #[doc(hidden)]
    fn of8(code: u8) -> Self;
}

impl Code for u8 {
    const FULL: Self = Self::MAX;
    fn plain(v: f32) -> Self {
        (v.clamp(0.0, 1.0) * 255.0 + 0.5) as Self
    }
    fn shown(light: LinearRgb) -> [Self; 3] {
        let Srgb8 { r, g, b } = encode_srgb8(light);
        [r, g, b]
    }
    fn of8(code: u8) -> Self {
        code
    }
}

impl Code for u16 {
    const FULL: Self = Self::MAX;
    fn plain(v: f32) -> Self {
        (v.clamp(0.0, 1.0) * 65_535.0 + 0.5) as Self
    }
    fn shown(light: LinearRgb) -> [Self; 3] {
        [light.r, light.g, light.b].map(encode_srgb16)
    }
    fn of8(code: u8) -> Self {
        Self::from(code) * 257
    }
}

impl ToFile for LinearRgb {
    const NAMES: &'static [&'static str] = COLOR;
    fn codes<C: Code>(self) -> [C; 4] {
        let [r, g, b] = C::shown(self);
        [r, g, b, C::FULL]
    }
    fn linear(self) -> [f32; CHANNELS] {
        first([self.r, self.g, self.b])
    }
}

impl ToFile for StraightRgba {
    const NAMES: &'static [&'static str] = COLOR_ALPHA;
    fn codes<C: Code>(self) -> [C; 4] {
        let [r, g, b] = C::shown(LinearRgb::new(self.r, self.g, self.b));
        [r, g, b, C::plain(self.a)]
    }
    fn linear(self) -> [f32; CHANNELS] {
        self.to_premul().linear()
    }
}

impl ToFile for PremulRgba {
    const NAMES: &'static [&'static str] = COLOR_ALPHA;
    fn codes<C: Code>(self) -> [C; 4] {
        self.to_straight().codes()
    }
    fn linear(self) -> [f32; CHANNELS] {
        first([self.r, self.g, self.b, self.a])
    }
}

impl ToFile for Film {
    /// Programs that know no film see the grey one: `A`.
    const NAMES: &'static [&'static str] = &["R", "G", "B", "A", "TR", "TG", "TB"];
    const CODED: bool = false;
    fn codes<C: Code>(self) -> [C; 4] {
        self.to_rgba().codes()
    }
    fn linear(self) -> [f32; CHANNELS] {
        let (PremulRgba { r, g, b, a }, t) = (self.to_rgba(), self.transmittance());
        [r, g, b, a, t.r, t.g, t.b]
    }
}

impl ToFile for Coverage {
    const NAMES: &'static [&'static str] = &["Y"];
    fn codes<C: Code>(self) -> [C; 4] {
        [C::plain(self.0); 4]
    }
    fn linear(self) -> [f32; CHANNELS] {
        first([self.0])
    }
}

impl ToFile for f32 {
    const NAMES: &'static [&'static str] = Coverage::NAMES;
    fn codes<C: Code>(self) -> [C; 4] {
        Coverage(self).codes()
    }
    fn linear(self) -> [f32; CHANNELS] {
        Coverage(self).linear()
    }
}

impl ToFile for Depth {
    const NAMES: &'static [&'static str] = &["Z"];
    const CODED: bool = false;
    fn codes<C: Code>(self) -> [C; 4] {
        [C::plain(self.0); 4]
    }
    fn linear(self) -> [f32; CHANNELS] {
        first([self.0])
    }
}

impl ToFile for Srgb8 {
    const NAMES: &'static [&'static str] = COLOR;
    fn codes<C: Code>(self) -> [C; 4] {
        [self.r, self.g, self.b, u8::MAX].map(C::of8)
    }
    fn linear(self) -> [f32; CHANNELS] {
        decode_srgb8(self).linear()
    }
}

impl ToFile for Srgba8 {
    const NAMES: &'static [&'static str] = COLOR_ALPHA;
    fn codes<C: Code>(self) -> [C; 4] {
        [self.r, self.g, self.b, self.a].map(C::of8)
    }
    fn linear(self) -> [f32; CHANNELS] {
        let LinearRgb { r, g, b } = decode_srgb8(Srgb8 {
            r: self.r,
            g: self.g,
            b: self.b,
        });
        StraightRgba {
            r,
            g,
            b,
            a: f32::from(self.a) / 255.0,
        }
        .linear()
    }
}

/// Integer codes of a picture, channels interleaved.
pub(super) struct Coded<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) names: &'a [&'a str],
    pub(super) codes: Codes,
}

/// Codes of 8 or 16 bits.
pub(super) enum Codes {
    U8(Vec<u8>),
    U16(Vec<u16>),
}

/// Channels side by side, pixel after pixel, rows in parallel.
pub(super) fn flat<P: ToFile, T: Copy + Default + Send, const N: usize>(
    image: &Image<P>,
    f: impl Fn(P) -> [T; N] + Sync,
) -> Vec<T> {
    let n = P::NAMES.len();
    let mut out = vec![T::default(); image.pixels().len() * n];
    let rows = image.width().max(1);
    out.par_chunks_exact_mut(n)
        .with_min_len(rows)
        .zip(image.pixels())
        .for_each(|(slot, &p)| {
            slot.copy_from_slice(&f(p)[..n]);
        });
    out
}

fn coded<P: ToFile>(image: &Image<P>, bits: Bits) -> Coded<'static> {
    let (width, height) = image.size();
    let codes = match bits {
        Bits::Sixteen => Codes::U16(flat(image, P::codes::<u16>)),
        _ => Codes::U8(flat(image, P::codes::<u8>)),
    };
    Coded {
        width,
        height,
        names: P::NAMES,
        codes,
    }
}

/// Writes a picture with the defaults of [`WriteOptions`]; see [`write_with`].
///
/// # Errors
/// As [`write_with`].
pub fn write<P: ToFile>(path: impl AsRef<Path>, image: &Image<P>) -> Result<()> {
    write_with(path, image, &WriteOptions::default())
}

/// Writes a picture in the format that the extension names: `exr`, `png`, `jpg`, `tif`.
///
/// Colours go display-encoded (sRGB, straight alpha, clipped to 0 to 1) into integer samples and scene-linear
/// (premultiplied, unclipped) into float ones; mattes are stored as they are. The file appears whole or not at all, and
/// the same picture gives the same bytes.
///
/// # Errors
/// [`Error::File`] for an extension that is not written, samples that the format or the pixel cannot have, transparent
/// pixels in a JPEG, an empty picture, and whatever the system says.
pub fn write_with<P: ToFile>(
    path: impl AsRef<Path>,
    image: &Image<P>,
    options: &WriteOptions,
) -> Result<()> {
    let path = path.as_ref();
    let bytes = encode(path, image, options).map_err(|e| Error::file(path, e))?;
    write_bytes(path, &bytes)
}

/// The bytes of a JPEG file of a quality from 1 to 100.
///
/// # Errors
/// An image without pixels, or with transparent ones.
pub fn jpeg_bytes<P: ToFile>(image: &Image<P>, quality: u8) -> Result<Vec<u8>> {
    let options = WriteOptions {
        jpeg_quality: quality,
        ..WriteOptions::default()
    };
    encode(Path::new("picture.jpg"), image, &options).map_err(|what| Error::value("picture", what))
}

fn encode<P: ToFile>(
    path: &Path,
    image: &Image<P>,
    options: &WriteOptions,
) -> std::result::Result<Vec<u8>, String> {
    if image.is_empty() {
        return Err(format!(
            "{} x {} pixels, expected at least 1 x 1",
            image.width(),
            image.height()
        ));
    }
    work::add(Kind::Encodes, 1);
    let format = Format::of_extension(path);
    match (format, stored_as::<P>(format, options.bits)?) {
        (Some(Format::Exr), bits) => encode_exr(image, bits, options),
        (Some(Format::Tiff), Bits::Float) => tiff::encode_floats(
            image.size(),
            P::NAMES.len(),
            &flat(image, P::linear),
            &marked(&options.metadata),
        ),
        (Some(Format::Tiff), bits) => tiff::encode_codes(&coded(image, bits), &options.metadata),
        (Some(Format::Jpeg), _) => encode_jpeg(image, options),
        (_, bits) => png::encode(&coded(image, bits), options.png, &options.metadata),
    }
}

/// The storage of a sample: as asked, or the format's own.
pub(super) fn stored_as<P: ToFile>(
    format: Option<Format>,
    asked: Option<Bits>,
) -> std::result::Result<Bits, String> {
    let possible: &[Bits] = match format {
        Some(Format::Exr) if P::CODED => &[Bits::Half, Bits::Float],
        Some(Format::Exr) => &[Bits::Float, Bits::Half],
        Some(Format::Tiff) if P::CODED => &[Bits::Sixteen, Bits::Eight, Bits::Float],
        Some(Format::Tiff) => &[Bits::Float],
        Some(Format::Png | Format::Jpeg) if !P::CODED => {
            return Err("a depth or a film needs float samples: .exr or .tif".into());
        }
        Some(Format::Png) => &[Bits::Eight, Bits::Sixteen],
        Some(Format::Jpeg) => &[Bits::Eight],
        _ => {
            return Err(
                "cannot be written, expected the extension .exr, .png, .jpg or .tif".into(),
            );
        }
    };
    let bits = asked.unwrap_or(possible[0]);
    if possible.contains(&bits) {
        return Ok(bits);
    }
    let possible: Vec<&str> = possible.iter().map(|bits| bits.name()).collect();
    Err(format!(
        "{} samples, expected {}",
        bits.name(),
        possible.join(" or ")
    ))
}

fn encode_exr<P: ToFile>(
    image: &Image<P>,
    bits: Bits,
    options: &WriteOptions,
) -> std::result::Result<Vec<u8>, String> {
    let plane =
        |c: usize| -> Vec<f32> { image.pixels().par_iter().map(|p| p.linear()[c]).collect() };
    let stored = |c: usize| {
        if bits == Bits::Half {
            exr::halves(&plane(c))
        } else {
            exr::floats(plane(c))
        }
    };
    let planes = P::NAMES
        .iter()
        .enumerate()
        .map(|(c, &name)| (name, stored(c)))
        .collect();
    exr::encode(
        image.size(),
        planes,
        options.compression,
        &marked(&options.metadata),
    )
}

fn encode_jpeg<P: ToFile>(
    image: &Image<P>,
    options: &WriteOptions,
) -> std::result::Result<Vec<u8>, String> {
    if !(1..=100).contains(&options.jpeg_quality) {
        return Err(format!(
            "jpeg quality {}, expected 1 to 100",
            options.jpeg_quality
        ));
    }
    let mut codes = flat(image, P::codes::<u8>);
    if P::NAMES.len() == 4 {
        if codes.iter().skip(3).step_by(4).any(|&a| a != 255) {
            return Err("transparent pixels, and JPEG has no alpha: expected .png or .exr".into());
        }
        codes = codes
            .chunks_exact(4)
            .flat_map(|px| [px[0], px[1], px[2]])
            .collect();
    }
    jpeg::encode(
        image.size(),
        &codes,
        options.jpeg_quality,
        &options.metadata,
    )
}

/// The texts with the colour space in front, unless the caller named one.
fn marked(metadata: &[(String, String)]) -> Vec<(String, String)> {
    let named = metadata.iter().any(|(key, _)| key == COLORSPACE.0);
    let ours = (!named).then(|| (COLORSPACE.0.to_string(), COLORSPACE.1.to_string()));
    ours.into_iter().chain(metadata.iter().cloned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_reads_back_and_other_readers_see_its_grey_alpha() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.exr");
        let film = Film::new(
            LinearRgb::new(0.5, 0.25, 0.125),
            LinearRgb::new(0.25, 0.5, 0.75),
        );
        write(&path, &Image::filled(3, 2, film)).unwrap();
        assert_eq!(
            crate::io::read::<Film>(&path).unwrap(),
            Image::filled(3, 2, film)
        );
        assert_eq!(
            crate::io::read::<PremulRgba>(&path).unwrap()[(0, 0)],
            PremulRgba::new(0.5, 0.25, 0.125, 0.5)
        );
        assert!(write(folder.path().join("film.png"), &Image::filled(3, 2, film)).is_err());
    }

    #[test]
    fn a_picture_without_transmittance_is_a_grey_film() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rgba.exr");
        let p = PremulRgba::new(0.5, 0.25, 0.125, 0.75);
        write(&path, &Image::filled(3, 2, p)).unwrap();
        assert_eq!(crate::io::read::<Film>(&path).unwrap()[(2, 1)], p.into());
    }
}
