//! TIFF: integers display-encoded, half, float and double scene-linear; grey or RGB, with or without alpha, in strips or
//! tiles, planes side by side or apart. Other kinds are left to OpenImageIO.

use super::header::{Header, lines_of_notes, notes_of_lines};
use super::limits::{Demand, Limits};
use super::raster::{Raster, Refusal, Samples, usual_names};
use super::write::{Coded, Codes};
use crate::io::Format;
use bytemuck::zeroed_vec;
use std::io::{Cursor, Read, Seek, SeekFrom};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::encoder::{TiffEncoder, TiffValue, colortype};
use tiff::tags::{ExtraSamples, Tag};
use tiff::{ColorType, TiffError};

/// TIFF 6.0, `ExtraSamples`: colours are already multiplied by alpha, or not.
const ASSOCIATED_ALPHA: u16 = 1;
const UNASSOCIATED_ALPHA: u16 = 2;
/// TIFF 6.0, `PlanarConfiguration`: each channel by itself.
const PLANES: u16 = 2;
/// TIFF 6.0, `FillOrder`: the first pixel is in the lowest bit.
const LOWEST_FIRST: u16 = 2;
/// TIFF 6.0, `Compression`.
const LZW: u16 = 5;

impl From<TiffError> for Refusal {
    fn from(e: TiffError) -> Self {
        match e {
            TiffError::UnsupportedError(e) => Self::Unsupported(format!("unsupported TIFF: {e}")),
            TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                Self::Broken("truncated TIFF".into())
            }
            e => Self::Broken(format!(
                "damaged TIFF: {}",
                e.to_string().trim_start_matches("format error: ")
            )),
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
    let mut decoder = first_picture(file)?.with_limits(most);
    let (width, height) = decoder.dimensions()?;
    refuse_missing_palette(&mut decoder)?;
    let extra = decoder
        .find_tag_unsigned_vec::<u16>(Tag::ExtraSamples)?
        .unwrap_or_default();
    let (channels, bits) = match decoder.colortype()? {
        ColorType::Gray(bits) => (1, bits),
        ColorType::Multiband {
            bit_depth,
            num_samples: 2,
        } if is_alpha(&extra) => (2, bit_depth),
        ColorType::RGB(bits) => (3, bits),
        ColorType::RGBA(bits) | ColorType::CMYK(bits) => (4, bits),
        other => {
            let kind = format!("{other:?}").to_lowercase().replace(['(', ')'], " ");
            return Err(Refusal::Unsupported(format!(
                "unsupported TIFF: {}",
                kind.trim()
            )));
        }
    };
    let (w, h) = (width.into(), height.into());
    let bytes_per_pixel = channels * u64::from(bits).div_ceil(8);
    limits.check(Demand {
        width: w,
        height: h,
        channels,
        bytes_per_pixel,
        file_bytes,
    })?;
    let inks = matches!(decoder.colortype()?, ColorType::CMYK(_));
    let names = usual_names(if inks { 3 } else { channels as usize })
        .ok_or("channels of an unknown kind")?;
    Ok(Opened {
        decoder,
        width: width as usize,
        height: height as usize,
        names,
        bits,
        inks,
    })
}

fn is_alpha(extra: &[u16]) -> bool {
    matches!(extra, [ASSOCIATED_ALPHA | UNASSOCIATED_ALPHA])
}

/// The file up to its first picture. Tiles under the tags of strips, which old writers left and libtiff reads, are not
/// known to our decoder: it calls their number wrong, or takes them for strips where that happens to be right.
fn first_picture<R: Read + Seek>(mut file: R) -> Result<Decoder<R>, Refusal> {
    let unsupported = |what: &str| Refusal::Unsupported(format!("unsupported TIFF: {what}"));
    let tags = first_tags(&mut file).unwrap_or_default();
    file.rewind().map_err(TiffError::from)?;
    if [Tag::TileWidth, Tag::StripOffsets]
        .iter()
        .all(|tag| tags.contains(&tag.to_u16()))
    {
        return Err(unsupported("tiles under the tags of strips"));
    }
    let mut decoder = Decoder::new(file)?;
    if decoder.find_tag_unsigned(Tag::FillOrder)? == Some(LOWEST_FIRST) {
        return Err(unsupported("pixels from the lowest bit up"));
    }
    Ok(decoder)
}

/// The numbers of the first directory's tags, of a file of either byte order, classic or BigTIFF.
fn first_tags(file: &mut (impl Read + Seek)) -> std::io::Result<Vec<u16>> {
    let mut start = [0; 4];
    file.read_exact(&mut start)?;
    let (little, big) = (start.starts_with(b"II"), start.contains(&43));
    let number = |file: &mut dyn Read, bytes: usize| {
        let mut number = [0; 8];
        file.read_exact(&mut number[..bytes])?;
        if !little {
            number[..bytes].reverse();
        }
        std::io::Result::Ok(u64::from_le_bytes(number))
    };
    // BigTIFF says how long its offsets are, which is 8.
    let (offset, count, entry) = if big { (8, 8, 20) } else { (4, 2, 12) };
    if big {
        number(file, 4)?;
    }
    let directory = number(file, offset)?;
    file.seek(SeekFrom::Start(directory))?;
    let entries = number(file, count)?.min(u64::from(u16::MAX));
    (0..entries)
        .map(|_| {
            let tag = number(file, 2)?;
            file.seek_relative(entry - 2)?;
            Ok(tag as u16)
        })
        .collect()
}

/// TIFF 6.0, `PhotometricInterpretation` = 3: codes are places in a palette.
const PALETTE: u16 = 3;

/// OpenImageIO, which reads palettes, makes a black picture where there is none.
fn refuse_missing_palette(decoder: &mut Decoder<impl Read + Seek>) -> Result<(), Refusal> {
    if decoder.find_tag_unsigned(Tag::PhotometricInterpretation)? != Some(PALETTE) {
        return Ok(());
    }
    let bits = decoder
        .find_tag_unsigned_vec::<u16>(Tag::BitsPerSample)?
        .unwrap_or_default();
    let colors = bits
        .first()
        .and_then(|&bits| 1_usize.checked_shl(bits.into()))
        .unwrap_or(0);
    let entries = decoder
        .find_tag_unsigned_vec::<u16>(Tag::ColorMap)?
        .unwrap_or_default()
        .len();
    match entries == 3 * colors {
        true => Ok(()),
        false => Err(format!(
            "damaged TIFF: a palette of {entries} entries, expected {}",
            3 * colors
        )
        .into()),
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

pub(super) fn header(
    file: impl Read + Seek,
    file_bytes: u64,
    limits: &Limits,
) -> Result<Header, Refusal> {
    let Opened {
        mut decoder,
        width,
        height,
        names,
        bits,
        ..
    } = open(file, file_bytes, limits)?;
    let text = decoder
        .get_tag_ascii_string(Tag::ImageDescription)
        .unwrap_or_default();
    let (bits, metadata) = (u32::from(bits), notes_of_lines(&text));
    Ok(Header {
        format: Format::Tiff,
        width,
        height,
        channels: names,
        bits,
        metadata,
        ..Header::default()
    })
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let mut file = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let (width, height, inks) = (file.width, file.height, file.inks);
    limits.room(width, height, file.names.len())?;
    let extra = file
        .decoder
        .find_tag_unsigned_vec::<u16>(Tag::ExtraSamples)?
        .unwrap_or_default();
    refuse_old_lzw(&mut file.decoder, bytes)?;
    let samples = match all_chunks(&mut file)? {
        Samples::U8(v) if inks => Samples::U8(left_by_inks(&v, u8::MAX.into())),
        Samples::U16(v) if inks => Samples::U16(left_by_inks(&v, u16::MAX.into())),
        _ if inks => {
            return Err(Refusal::Unsupported(
                "unsupported TIFF: inks in float".into(),
            ));
        }
        samples => samples,
    };
    let display_encoded = !samples.are_float();
    let premultiplied = extra.first() == Some(&ASSOCIATED_ALPHA);
    Ok(Raster {
        width,
        height,
        names: file.names,
        samples,
        display_encoded,
        premultiplied,
    })
}

/// Codes from the lowest bit up, as before 1990: they begin with the code that says so (TIFF 6.0, section 13).
fn refuse_old_lzw(decoder: &mut Decoder<impl Read + Seek>, bytes: &[u8]) -> Result<(), Refusal> {
    if decoder.find_tag_unsigned(Tag::Compression)? != Some(LZW) {
        return Ok(());
    }
    let strips = decoder
        .find_tag_unsigned_vec::<u64>(Tag::StripOffsets)?
        .unwrap_or_default();
    let first = strips
        .first()
        .and_then(|&at| bytes.get(usize::try_from(at).ok()?..)?.first_chunk());
    match first {
        Some(&[0, second]) if second & 1 == 1 => {
            Err(Refusal::Unsupported("unsupported TIFF: old LZW".into()))
        }
        _ => Ok(()),
    }
}

/// Where the strips or tiles of a picture lie, and what each of them holds.
#[derive(Clone, Copy)]
struct Grid {
    /// Of the picture.
    width: usize,
    height: usize,
    /// Channels of the picture as it is stored.
    channels: usize,
    /// Each channel has strips or tiles of its own.
    planes: bool,
    /// Of a strip or tile.
    size: (usize, usize),
}

impl Grid {
    fn of(file: &mut Opened<impl Read + Seek>) -> Result<Self, Refusal> {
        let (across, down) = file.decoder.chunk_dimensions();
        Ok(Self {
            width: file.width,
            height: file.height,
            channels: if file.inks { 4 } else { file.names.len() },
            planes: file.decoder.find_tag_unsigned(Tag::PlanarConfiguration)? == Some(PLANES),
            size: (across as usize, (down as usize).min(file.height)),
        })
    }

    fn across(&self) -> usize {
        self.width.div_ceil(self.size.0)
    }

    /// Strips or tiles of the picture, or of a plane.
    fn count(&self) -> usize {
        self.across() * self.height.div_ceil(self.size.1)
    }

    /// Puts the samples of a strip or tile, of which `columns` and `rows` are there, into the picture.
    fn put<T: Copy>(&self, to: &mut [T], from: &[T], index: usize, [columns, rows]: [usize; 2]) {
        let (plane, place) = (index / self.count(), index % self.count());
        let (left, top) = (
            place % self.across() * self.size.0,
            place / self.across() * self.size.1,
        );
        let stored = if self.planes { 1 } else { self.channels };
        let kept = columns.min(self.width - left);
        for (y, row) in from
            .chunks_exact(columns * stored)
            .take(rows.min(self.height - top))
            .enumerate()
        {
            let at = ((top + y) * self.width + left) * self.channels + plane;
            if self.planes {
                let to = to[at..].iter_mut().step_by(self.channels);
                to.zip(&row[..kept]).for_each(|(to, &from)| *to = from);
            } else {
                to[at..][..kept * stored].copy_from_slice(&row[..kept * stored]);
            }
        }
    }
}

/// The samples of the picture, strip by strip or tile by tile: the decoder's own way to read all at once leaves columns
/// black where tiles reach over the border, and knows no planes.
fn all_chunks(file: &mut Opened<impl Read + Seek>) -> Result<Samples, Refusal> {
    if !file.bits.is_multiple_of(8) {
        return Err(Refusal::Unsupported(format!(
            "unsupported TIFF: {} bits a sample",
            file.bits
        )));
    }
    let grid = Grid::of(file)?;
    let mut whole: Option<Samples> = None;
    let planes = if grid.planes { grid.channels } else { 1 };
    for index in 0..grid.count() * planes {
        let number = u32::try_from(index).map_err(|_| "damaged TIFF: strips without number")?;
        let part = samples_of(file.decoder.read_chunk(number)?);
        let (columns, rows) = file.decoder.chunk_data_dimensions(number);
        let there = [columns as usize, rows as usize];
        let count = grid.width * grid.height * grid.channels;
        match (whole.get_or_insert_with(|| zeros_like(&part, count)), &part) {
            (Samples::U8(to), Samples::U8(from)) => grid.put(to, from, index, there),
            (Samples::U16(to), Samples::U16(from)) => grid.put(to, from, index, there),
            (Samples::F16(to), Samples::F16(from)) => grid.put(to, from, index, there),
            (Samples::F32(to), Samples::F32(from)) => grid.put(to, from, index, there),
            _ => return Err("damaged TIFF: samples of two kinds".into()),
        }
    }
    whole.ok_or_else(|| "damaged TIFF: no strips".into())
}

fn zeros_like(samples: &Samples, count: usize) -> Samples {
    match samples {
        Samples::U8(_) => Samples::U8(zeroed_vec(count)),
        Samples::U16(_) => Samples::U16(zeroed_vec(count)),
        Samples::F16(_) => Samples::F16(zeroed_vec(count)),
        Samples::F32(_) => Samples::F32(zeroed_vec(count)),
    }
}

/// Integers of other kinds become 16 bits: full scale stays full scale, and what is below zero becomes zero.
fn samples_of(decoded: DecodingResult) -> Samples {
    fn codes<T>(v: Vec<T>, code: impl Fn(T) -> u16) -> Samples {
        Samples::U16(v.into_iter().map(code).collect())
    }
    match decoded {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::F16(v) => Samples::F16(v),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::F64(v) => Samples::F32(v.into_iter().map(|x| x as f32).collect()),
        DecodingResult::U32(v) => codes(v, |x| (x >> 16) as u16),
        DecodingResult::U64(v) => codes(v, |x| (x >> 48) as u16),
        DecodingResult::I8(v) => codes(v, |x| {
            let seven_bits = x.max(0) as u16;
            doubled(seven_bits << 8 | seven_bits << 1 | seven_bits >> 6)
        }),
        DecodingResult::I16(v) => codes(v, |x| doubled(x.max(0) as u16)),
        DecodingResult::I32(v) => codes(v, |x| doubled((x.max(0) >> 16) as u16)),
        DecodingResult::I64(v) => codes(v, |x| doubled((x.max(0) >> 48) as u16)),
    }
}

/// 15 bits as 16, the first of them repeated behind the last: 0 stays 0, full scale full scale.
fn doubled(x: u16) -> u16 {
    x << 1 | x >> 14
}

/// Red, green and blue that cyan, magenta, yellow and black leave of white, display-encoded as the inks were; a colour
/// profile would say it better, and is not applied to inks.
fn left_by_inks<T: Copy + Into<u64> + TryFrom<u64> + Default>(inks: &[T], full: u64) -> Vec<T> {
    let left = |ink: T, black: T| {
        let product = (full - ink.into()) * (full - black.into());
        T::try_from((product + full / 2) / full).unwrap_or_default()
    };
    inks.chunks_exact(4)
        .flat_map(|px| [left(px[0], px[3]), left(px[1], px[3]), left(px[2], px[3])])
        .collect()
}

/// A whole file of integer codes; alpha is straight.
pub(super) fn encode_codes(
    picture: &Coded<'_>,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
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
        _ => encode::<colortype::RGB32Float>(
            size,
            samples,
            Some(ExtraSamples::AssociatedAlpha),
            metadata,
        ),
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
        let text: String = lines_of_notes(&metadata.to_vec())
            .chars()
            .filter(char::is_ascii)
            .collect();
        image
            .encoder()
            .write_tag(Tag::ImageDescription, text.as_str())?;
    }
    image.write_data(samples)?;
    Ok(out.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_of_every_kind_have_the_same_full_scale() {
        let full = Samples::U16(vec![0, 65_535]);
        for samples in [
            DecodingResult::U16(vec![0, u16::MAX]),
            DecodingResult::U32(vec![0, u32::MAX]),
            DecodingResult::U64(vec![0, u64::MAX]),
            DecodingResult::I8(vec![-5, i8::MAX]),
            DecodingResult::I16(vec![-5, i16::MAX]),
            DecodingResult::I32(vec![-5, i32::MAX]),
            DecodingResult::I64(vec![-5, i64::MAX]),
        ] {
            let name = format!("{samples:?}");
            assert_eq!(samples_of(samples), full, "{name}");
        }
        // Half of the scale.
        let half = |samples: DecodingResult| match samples_of(samples) {
            Samples::U16(v) => f64::from(v[0]) / 65_535.0,
            other => panic!("{other:?}"),
        };
        assert!((half(DecodingResult::I8(vec![64])) - 64.0 / 127.0).abs() < 1e-4);
        assert!((half(DecodingResult::I16(vec![12_345])) - 12_345.0 / 32_767.0).abs() < 2e-5);
    }

    /// A picture of 5 x 3 whose tiles of 4 x 2 reach over its border, by planes or not.
    #[test]
    fn tiles_that_reach_over_the_border_are_cut() {
        for planes in [false, true] {
            let grid = Grid {
                width: 5,
                height: 3,
                channels: 2,
                planes,
                size: (4, 2),
            };
            assert_eq!(grid.count(), 4);
            let mut whole = vec![0; 30];
            for index in 0..if planes { 8 } else { 4 } {
                let (plane, place) = (index / 4, index % 4);
                let value = |x: usize, y: usize, c: usize| {
                    100 * c + 10 * (place / 2 * 2 + y) + place % 2 * 4 + x
                };
                let channels = if planes { plane..plane + 1 } else { 0..2 };
                let tile: Vec<usize> = (0..2)
                    .flat_map(|y| (0..4).flat_map(move |x| (0..2).map(move |c| (x, y, c))))
                    .filter(|(_, _, c)| channels.contains(c))
                    .map(|(x, y, c)| value(x, y, c))
                    .collect();
                grid.put(&mut whole, &tile, index, [4, 2]);
            }
            let expected: Vec<usize> = (0..3)
                .flat_map(|y| (0..5).flat_map(move |x| (0..2).map(move |c| 100 * c + 10 * y + x)))
                .collect();
            assert_eq!(whole, expected, "planes {planes}");
        }
    }
}
