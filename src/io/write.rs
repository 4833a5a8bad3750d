//! Writes typed pictures: the extension determines the format, the pixel type the encoding.

use super::codec::codes::{Bits, Codes, ToFile, interleaved};
use super::codec::exr::{self, Compression, FlatSamples};
use super::codec::jpeg::Chroma;
use super::codec::{jpeg, png, tiff};
use super::format::Format;
use super::fs::write_bytes;
use super::header::{Canvas, note};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::quality::Quality;
use crate::work::{self, Kind};
use rayon::prelude::*;
use std::path::Path;

/// Options for writing a picture.
#[derive(Clone, Debug)]
pub struct WriteOptions {
    /// Storage of a sample. Default: the format's own (PNG and JPEG 8 bits, TIFF 16 bits, EXR half;
    /// depths always float).
    pub bits: Option<Bits>,
    /// Compression of an EXR. Default: [`Compression::Zip`].
    pub compression: Compression,
    /// How much work goes into compressing a PNG, which is lossless at any effort. Default:
    /// [`Quality::Normal`].
    pub png_effort: Quality,
    /// Quality of a JPEG, 1 to 100. Default: 95.
    pub jpeg_quality: u8,
    /// Chroma subsampling of a JPEG. Default: none.
    pub jpeg_chroma: Chroma,
    /// Text attributes to store with the picture, by name. Default: none.
    pub metadata: Vec<(String, String)>,
    /// Position of an EXR's picture and its pixel aspect. Default: [`Canvas::default`].
    pub canvas: Canvas,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            bits: None,
            compression: Compression::default(),
            png_effort: Quality::default(),
            jpeg_quality: 95,
            jpeg_chroma: Chroma::default(),
            metadata: Vec::new(),
            canvas: Canvas::default(),
        }
    }
}

/// Attribute with the colour space of float files that petcomp writes; other programs drop or
/// rename their own one.
const COLORSPACE: (&str, &str) = ("petcomp:colorspace", "scene-linear Rec. 709");

/// Writes a picture with the defaults of [`WriteOptions`]; see [`write_with`].
///
/// # Errors
/// As in [`write_with`].
pub fn write<P: ToFile>(path: impl AsRef<Path>, image: &Image<P>) -> Result<()> {
    write_with(path, image, &WriteOptions::default())
}

/// Writes a picture in the format of the extension: `exr`, `png`, `jpg`, `tif`.
///
/// Integer samples get display-encoded colours (sRGB, straight alpha, clipped to 0 to 1), float
/// samples scene-linear ones (premultiplied, unclipped); mattes are stored unchanged. The file
/// appears complete or not at all, and the same picture gives the same bytes.
///
/// # Errors
/// [`Error::File`] for an unsupported extension, samples that the format or the pixel type does not
/// support, transparent pixels in a JPEG, an empty picture, and system errors.
pub fn write_with<P: ToFile>(
    path: impl AsRef<Path>,
    image: &Image<P>,
    options: &WriteOptions,
) -> Result<()> {
    let path = path.as_ref();
    let bytes = encode(path, image, options).map_err(|e| Error::file(path, e))?;
    write_bytes(path, &bytes)
}

/// The bytes of a JPEG file with a quality of 1 to 100.
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
    check_not_empty(image.size())?;
    work::add(Kind::Encodes, 1);
    let format = Format::from_extension(path);
    let bits = sample_storage::<P>(format, options.bits)?;
    match format {
        Some(Format::Exr) => encode_exr(image, bits, options),
        Some(Format::Tiff) => encode_tiff(image, bits, &options.metadata),
        Some(Format::Jpeg) => encode_jpeg(image, options),
        _ => encode_png(image, bits, options),
    }
}

fn encode_png<P: ToFile>(
    image: &Image<P>,
    bits: Bits,
    options: &WriteOptions,
) -> std::result::Result<Vec<u8>, String> {
    let (channels, codes) = (P::NAMES.len(), Codes::new(image, bits));
    let (effort, metadata) = (options.png_effort, &options.metadata);
    png::encode(image.size(), channels, &codes, effort, metadata).map_err(|e| e.to_string())
}

fn encode_tiff<P: ToFile>(
    image: &Image<P>,
    bits: Bits,
    metadata: &[(String, String)],
) -> std::result::Result<Vec<u8>, String> {
    let (size, channels) = (image.size(), P::NAMES.len());
    if bits != Bits::Float {
        return tiff::encode_codes(size, channels, &Codes::new(image, bits), metadata);
    }
    let samples = interleaved(image, P::linear);
    tiff::encode_floats(size, channels, &samples, &with_colorspace(metadata))
}

fn check_not_empty((width, height): (usize, usize)) -> std::result::Result<(), String> {
    if width > 0 && height > 0 {
        return Ok(());
    }
    Err(format!(
        "{width} x {height} pixels, expected at least 1 x 1"
    ))
}

/// The storage of a sample: as requested, or the format's default.
pub(super) fn sample_storage<P: ToFile>(
    format: Option<Format>,
    requested: Option<Bits>,
) -> std::result::Result<Bits, String> {
    let possible = possible_storage::<P>(format)?;
    let bits = requested.unwrap_or(possible[0]);
    if possible.contains(&bits) {
        return Ok(bits);
    }
    let possible: Vec<&str> = possible.iter().map(|bits| bits.name()).collect();
    let expected = possible.join(" or ");
    Err(format!("{} samples, expected {expected}", bits.name()))
}

/// What a format can store for a pixel type that is meaningful as integer codes, or for one that is
/// not; its default first.
fn possible_storage<P: ToFile>(
    format: Option<Format>,
) -> std::result::Result<&'static [Bits], String> {
    if P::CODED {
        return possible_codes(format);
    }
    match format {
        Some(Format::Exr) => Ok(&[Bits::Float, Bits::Half]),
        Some(Format::Tiff) if P::NAMES.len() == 1 => Ok(&[Bits::Float]),
        Some(Format::Tiff | Format::Png | Format::Jpeg) => {
            Err("a depth needs .exr or .tif, and a film .exr".into())
        }
        _ => Err(NOT_WRITTEN.into()),
    }
}

/// The same for a pixel type that is meaningful as integer codes.
fn possible_codes(format: Option<Format>) -> std::result::Result<&'static [Bits], String> {
    match format {
        Some(Format::Exr) => Ok(&[Bits::Half, Bits::Float]),
        Some(Format::Tiff) => Ok(&[Bits::Sixteen, Bits::Eight, Bits::Float]),
        Some(Format::Png) => Ok(&[Bits::Eight, Bits::Sixteen]),
        Some(Format::Jpeg) => Ok(&[Bits::Eight]),
        _ => Err(NOT_WRITTEN.into()),
    }
}

const NOT_WRITTEN: &str = "cannot be written, expected the extension .exr, .png, .jpg or .tif";

fn encode_exr<P: ToFile>(
    image: &Image<P>,
    bits: Bits,
    options: &WriteOptions,
) -> std::result::Result<Vec<u8>, String> {
    let names = P::NAMES.iter().enumerate();
    let planes = names.map(|(c, &name)| (name, channel_samples(image, c, bits)));
    let planes = planes.collect();
    let metadata = with_colorspace(&options.metadata);
    let (size, compression) = (image.size(), options.compression);
    exr::encode(size, options.canvas, planes, compression, &metadata)
}

/// One channel of a picture, scene-linear.
fn channel_samples<P: ToFile>(image: &Image<P>, channel: usize, bits: Bits) -> FlatSamples {
    let pixels = image.pixels().par_iter();
    let plane: Vec<f32> = pixels.map(|p| p.linear()[channel]).collect();
    match bits {
        Bits::Half => exr::half_samples(&plane),
        _ => FlatSamples::F32(plane),
    }
}

fn encode_jpeg<P: ToFile>(
    image: &Image<P>,
    options: &WriteOptions,
) -> std::result::Result<Vec<u8>, String> {
    let quality = options.jpeg_quality;
    if !(1..=100).contains(&quality) {
        return Err(format!("jpeg quality {quality}, expected 1 to 100"));
    }
    let mut codes = interleaved(image, P::codes::<u8>);
    if P::NAMES.len() == 4 {
        codes = without_alpha(&codes)?;
    }
    let (chroma, metadata) = (options.jpeg_chroma, &options.metadata);
    jpeg::encode(image.size(), &codes, quality, chroma, metadata)
}

/// Red, green and blue of opaque codes.
fn without_alpha(codes: &[u8]) -> std::result::Result<Vec<u8>, String> {
    if codes.iter().skip(3).step_by(4).any(|&a| a != 255) {
        return Err("transparent pixels, and JPEG has no alpha: expected .png or .exr".into());
    }
    Ok(codes
        .chunks_exact(4)
        .flat_map(|px| [px[0], px[1], px[2]])
        .collect())
}

/// The texts, preceded by the colour space unless the caller specified one.
fn with_colorspace(metadata: &[(String, String)]) -> Vec<(String, String)> {
    let (name, space) = COLORSPACE;
    let is_named = metadata.iter().any(|(key, _)| key == name);
    let ours = (!is_named).then(|| note(name, space));
    ours.into_iter().chain(metadata.iter().cloned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::{Film, LinearRgb, PremulRgba};

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
    }

    #[test]
    fn a_film_is_written_to_no_format_that_loses_channels() {
        let folder = tempfile::tempdir().unwrap();
        let film = Image::filled(3, 2, Film::new(LinearRgb::WHITE, LinearRgb::BLACK));
        for name in ["film.png", "film.jpg", "film.tif"] {
            let e = write(folder.path().join(name), &film).unwrap_err();
            assert!(e.to_string().ends_with("and a film .exr"), "{e}");
        }
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
