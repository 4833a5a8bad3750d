//! TIFF: 8 and 16 bits display-encoded, half, float and double scene-linear; grey or RGB, with or without alpha.

use super::header::{Header, lines_of_notes, notes_of_lines};
use super::limits::{Demand, Limits};
use super::raster::{Raster, Refusal, Samples, usual_names};
use super::write::{Coded, Codes};
use crate::io::Format;
use std::io::{Cursor, Read, Seek};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::encoder::{TiffEncoder, TiffValue, colortype};
use tiff::tags::{ExtraSamples, Tag};
use tiff::{ColorType, TiffError};

/// TIFF 6.0, `ExtraSamples` = 1: colours are already multiplied by alpha.
const ASSOCIATED_ALPHA: u16 = 1;

impl From<TiffError> for Refusal {
    fn from(e: TiffError) -> Self {
        match e {
            TiffError::UnsupportedError(e) => Self::Unsupported(format!("unsupported TIFF: {e}")),
            TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                Self::Broken("truncated TIFF".into())
            }
            e => Self::Broken(format!("damaged TIFF: {}", e.to_string().trim_start_matches("format error: "))),
        }
    }
}

struct Opened<R: Read + Seek> {
    decoder: Decoder<R>,
    width: usize,
    height: usize,
    names: Vec<String>,
    bits: u8,
    /// Stored as cyan, magenta, yellow and black.
    inks: bool,
}

fn open<R: Read + Seek>(file: R, file_bytes: u64, limits: &Limits) -> Result<Opened<R>, Refusal> {
    let mut most = tiff::decoder::Limits::default();
    most.decoding_buffer_size = usize::try_from(limits.decoded_bytes).unwrap_or(usize::MAX);
    most.intermediate_buffer_size = most.decoding_buffer_size;
    most.ifd_value_size = usize::try_from(limits.metadata_bytes).unwrap_or(usize::MAX);
    let mut decoder = Decoder::new(file)?.with_limits(most);
    let (width, height) = decoder.dimensions()?;
    refuse_missing_palette(&mut decoder)?;
    let (channels, bits) = match decoder.colortype()? {
        ColorType::Gray(bits) => (1, bits),
        ColorType::GrayA(bits) => (2, bits),
        ColorType::RGB(bits) => (3, bits),
        ColorType::RGBA(bits) | ColorType::CMYK(bits) => (4, bits),
        other => {
            let kind = format!("{other:?}").to_lowercase().replace(['(', ')'], " ");
            return Err(Refusal::Unsupported(format!("unsupported TIFF: {}", kind.trim())));
        }
    };
    let (w, h) = (width.into(), height.into());
    let bytes_per_pixel = channels * u64::from(bits).div_ceil(8);
    limits.check(Demand { width: w, height: h, channels, bytes_per_pixel, file_bytes })?;
    let inks = matches!(decoder.colortype()?, ColorType::CMYK(_));
    let names = usual_names(if inks { 3 } else { channels as usize }).ok_or("channels of an unknown kind")?;
    Ok(Opened { decoder, width: width as usize, height: height as usize, names, bits, inks })
}

/// TIFF 6.0, `PhotometricInterpretation` = 3: codes are places in a palette.
const PALETTE: u16 = 3;

/// OpenImageIO, which reads palettes, makes a black picture where there is none.
fn refuse_missing_palette(decoder: &mut Decoder<impl Read + Seek>) -> Result<(), Refusal> {
    if decoder.find_tag_unsigned(Tag::PhotometricInterpretation)? != Some(PALETTE) {
        return Ok(());
    }
    let bits = decoder.find_tag_unsigned_vec::<u16>(Tag::BitsPerSample)?.unwrap_or_default();
    let colors = bits.first().and_then(|&bits| 1_usize.checked_shl(bits.into())).unwrap_or(0);
    let entries = decoder.find_tag_unsigned_vec::<u16>(Tag::ColorMap)?.unwrap_or_default().len();
    match entries == 3 * colors {
        true => Ok(()),
        false => Err(format!("damaged TIFF: a palette of {entries} entries, expected {}", 3 * colors).into()),
    }
}

/// The embedded colour profile.
pub(super) fn profile(bytes: &[u8], limits: &Limits) -> Option<Vec<u8>> {
    let mut most = tiff::decoder::Limits::default();
    most.ifd_value_size = usize::try_from(limits.metadata_bytes).unwrap_or(usize::MAX);
    // Of kinds of TIFF too that the decoder cannot read: OpenImageIO hands over their codes.
    let mut decoder = Decoder::new(Cursor::new(bytes)).ok()?.with_limits(most);
    decoder.get_tag_u8_vec(Tag::IccProfile).ok()
}

pub(super) fn header(file: impl Read + Seek, file_bytes: u64, limits: &Limits) -> Result<Header, Refusal> {
    let Opened { mut decoder, width, height, names, bits, .. } = open(file, file_bytes, limits)?;
    let text = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap_or_default();
    let (bits, metadata) = (u32::from(bits), notes_of_lines(&text));
    Ok(Header { format: Format::Tiff, width, height, channels: names, bits, metadata, ..Header::default() })
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let Opened { mut decoder, width, height, names, inks, .. } = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples)?.unwrap_or_default();
    if decoder.image_buffer_layout()?.planes != 1 {
        return Err(Refusal::Unsupported("unsupported TIFF: separate planes".into()));
    }
    let samples = match decoder.read_image()? {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::F16(v) => Samples::F16(v),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::F64(v) => Samples::F32(v.into_iter().map(|x| x as f32).collect()),
        _ => return Err(Refusal::Unsupported("unsupported TIFF: signed or long integer samples".into())),
    };
    let samples = match samples {
        Samples::U8(v) if inks => Samples::U8(left_by_inks(&v, u8::MAX.into())),
        Samples::U16(v) if inks => Samples::U16(left_by_inks(&v, u16::MAX.into())),
        _ if inks => return Err(Refusal::Unsupported("unsupported TIFF: inks in float".into())),
        samples => samples,
    };
    let (display_encoded, count) = match &samples {
        Samples::U8(v) => (true, v.len()),
        Samples::U16(v) => (true, v.len()),
        Samples::F16(v) => (false, v.len()),
        Samples::F32(v) => (false, v.len()),
    };
    if count != width * height * names.len() {
        return Err(Refusal::Unsupported("unsupported TIFF: packed samples".into()));
    }
    let premultiplied = extra.first() == Some(&ASSOCIATED_ALPHA);
    Ok(Raster { width, height, names, samples, display_encoded, premultiplied })
}

/// Red, green and blue that cyan, magenta, yellow and black leave of white, display-encoded as the inks were; a colour
/// profile would say it better, and is not applied to inks.
fn left_by_inks<T: Copy + Into<u64> + TryFrom<u64> + Default>(inks: &[T], full: u64) -> Vec<T> {
    let left = |ink: T, black: T| {
        let product = (full - ink.into()) * (full - black.into());
        T::try_from((product + full / 2) / full).unwrap_or_default()
    };
    inks.chunks_exact(4).flat_map(|px| [left(px[0], px[3]), left(px[1], px[3]), left(px[2], px[3])]).collect()
}

/// A whole file of integer codes; alpha is straight.
pub(super) fn encode_codes(picture: &Coded<'_>, metadata: &[(String, String)]) -> Result<Vec<u8>, String> {
    let (size, n) = ((picture.width, picture.height), picture.names.len());
    let alpha = ExtraSamples::UnassociatedAlpha;
    match (&picture.codes, n) {
        (Codes::U8(v), 1) => encode::<colortype::Gray8>(size, v, None, metadata),
        (Codes::U8(v), 3) => encode::<colortype::RGB8>(size, v, None, metadata),
        (Codes::U8(v), _) => encode::<colortype::RGB8>(size, v, Some(alpha), metadata),
        (Codes::U16(v), 1) => encode::<colortype::Gray16>(size, v, None, metadata),
        (Codes::U16(v), 3) => encode::<colortype::RGB16>(size, v, None, metadata),
        (Codes::U16(v), _) => encode::<colortype::RGB16>(size, v, Some(alpha), metadata),
    }
    .map_err(|e| e.to_string())
}

/// A whole file of scene-linear floats of one, three or four channels; colours are multiplied by alpha.
pub(super) fn encode_floats(
    size: (usize, usize),
    channels: usize,
    samples: &[f32],
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
    match channels {
        1 => encode::<colortype::Gray32Float>(size, samples, None, metadata),
        3 => encode::<colortype::RGB32Float>(size, samples, None, metadata),
        _ => encode::<colortype::RGB32Float>(size, samples, Some(ExtraSamples::AssociatedAlpha), metadata),
    }
    .map_err(|e| e.to_string())
}

fn encode<C: colortype::ColorType>(
    (width, height): (usize, usize),
    samples: &[C::Inner],
    alpha: Option<ExtraSamples>,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, TiffError>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out)?;
    let mut image = encoder.new_image::<C>(u32::try_from(width)?, u32::try_from(height)?)?;
    if let Some(alpha) = alpha {
        image.extra_samples(&[alpha])?;
    }
    if !metadata.is_empty() {
        let text: String = lines_of_notes(&metadata.to_vec()).chars().filter(char::is_ascii).collect();
        image.encoder().write_tag(Tag::ImageDescription, text.as_str())?;
    }
    image.write_data(samples)?;
    Ok(out.into_inner())
}
