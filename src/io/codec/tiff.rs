//! TIFF: integers display-encoded, half, float and double scene-linear; grey or RGB, with or
//! without alpha, in strips or tiles, interleaved or in separate planes. Other kinds are left to
//! OpenImageIO.

use super::codes::Codes;
use super::exif::{CameraNotes, TiffOrder, is_big_tiff, read_at};
use super::orient::Orientation;
use super::raster::{Raster, Samples, default_names};
use super::refusal::Refusal;
use crate::io::foreign::{DEVELOP, RAW};
use crate::io::format::Format;
use crate::io::header::{Header, lines_of_notes, notes_of_lines};
use crate::io::limits::{Demand, Limits};
use std::collections::BTreeMap;
use std::io::{BufRead, Cursor, ErrorKind, Read, Seek};
use std::ops::Range;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::encoder::colortype::{self, Gray8, Gray16, Gray32Float, RGB8, RGB16, RGB32Float};
use tiff::encoder::{TiffEncoder, TiffValue};
use tiff::tags::{ExtraSamples, Tag};
use tiff::{ColorType, TiffError};

/// TIFF 6.0, `ExtraSamples`: colours are premultiplied, or not.
const ASSOCIATED_ALPHA: u16 = 1;
const UNASSOCIATED_ALPHA: u16 = 2;
/// TIFF 6.0, `PlanarConfiguration`: each channel in its own plane.
const SEPARATE_PLANES: u16 = 2;
/// TIFF 6.0, `FillOrder`: the first pixel is in the lowest bit.
const LOWEST_BIT_FIRST: u16 = 2;
/// TIFF 6.0 and its supplements, `Compression`.
const NO_COMPRESSION: u16 = 1;
const LZW_COMPRESSION: u16 = 5;
const OLD_JPEG_COMPRESSION: u16 = 6;
const JPEG_COMPRESSION: u16 = 7;
/// The last two bytes of a JPEG.
const END_OF_JPEG: &[u8] = b"\xff\xd9";
/// TIFF 6.0, `PhotometricInterpretation`: codes are indices into a palette.
const PALETTE_COLOR: u16 = 3;
/// TIFF 6.0 and its supplements, the same: lightness and two colour differences.
const CIE_LAB: u16 = 8;
const ICC_LAB: u16 = 9;
const ITU_LAB: u16 = 10;
/// TIFF/EP and DNG 1.7, the same: raw sensor data, with or without a colour filter array.
const CFA: u16 = 32_803;
const LINEAR_RAW: u16 = 34_892;
/// TIFF 6.0, `NewSubfileType`: a smaller version of another picture. Nikon's and Sony's raw files
/// begin with one.
const REDUCED_RESOLUTION: u32 = 1;
/// DNG 1.7, the tag that identifies a TIFF as a DNG.
const DNG_VERSION: u16 = 50_706;

impl From<TiffError> for Refusal {
    fn from(e: TiffError) -> Self {
        match e {
            TiffError::UnsupportedError(e) => unsupported(&e),
            e if is_early_end(&e) => truncated(),
            e => Self::Broken(format!(
                "damaged TIFF: {}",
                e.to_string().trim_start_matches("format error: ")
            )),
        }
    }
}

/// Whether bytes are missing.
fn is_early_end(e: &TiffError) -> bool {
    matches!(e, TiffError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof)
}

fn truncated() -> Refusal {
    Refusal::Broken("truncated TIFF".into())
}

fn unsupported(what: &dyn std::fmt::Display) -> Refusal {
    Refusal::Unsupported(format!("unsupported TIFF: {what}"))
}

struct OpenedTiff<R: Read + Seek> {
    decoder: Decoder<R>,
    width: usize,
    height: usize,
    names: Vec<String>,
    bits: u8,
    /// Whether it is stored as cyan, magenta, yellow and black.
    inks: bool,
}

fn open<R: Read + Seek>(
    file: R,
    file_bytes: u64,
    limits: &Limits,
) -> Result<OpenedTiff<R>, Refusal> {
    let mut decoder = first_picture(file)?.with_limits(decoder_limits(limits));
    let (width, height) = decoder.dimensions()?;
    refuse_misread_colors(&mut decoder)?;
    let (channels, bits) = stored_channels(&mut decoder)?;
    let bytes = u64::from(bits).div_ceil(8);
    limits.check(Demand::new([width, height], channels, bytes, file_bytes))?;
    let inks = matches!(decoder.colortype()?, ColorType::CMYK(_));
    let names = default_names(if inks { 3 } else { channels as usize });
    Ok(OpenedTiff {
        decoder,
        width: width as usize,
        height: height as usize,
        names: names.ok_or("channels of an unknown kind")?,
        bits,
        inks,
    })
}

/// The decoder's default limits, with ours for metadata and pixels.
fn decoder_limits(limits: &Limits) -> tiff::decoder::Limits {
    let mut most = metadata_limits(limits);
    most.decoding_buffer_size = usize::try_from(limits.decoded_bytes).unwrap_or(usize::MAX);
    most.intermediate_buffer_size = most.decoding_buffer_size;
    most
}

/// The decoder's default limits, with ours for metadata.
fn metadata_limits(limits: &Limits) -> tiff::decoder::Limits {
    let mut most = tiff::decoder::Limits::default();
    most.ifd_value_size = usize::try_from(limits.metadata_bytes).unwrap_or(usize::MAX);
    most
}

/// Number of stored channels of a pixel, and bits per channel.
fn stored_channels(decoder: &mut Decoder<impl Read + Seek>) -> Result<(u64, u8), Refusal> {
    let extra = extra_samples(decoder)?;
    match decoder.colortype()? {
        ColorType::Gray(bits) => Ok((1, bits)),
        ColorType::Multiband {
            bit_depth,
            num_samples: 2,
        } if is_alpha(&extra) => Ok((2, bit_depth)),
        ColorType::RGB(bits) => Ok((3, bits)),
        ColorType::RGBA(bits) | ColorType::CMYK(bits) => Ok((4, bits)),
        other => Err(unsupported_color(other)),
    }
}

fn unsupported_color(kind: ColorType) -> Refusal {
    let name = format!("{kind:?}").to_lowercase().replace(['(', ')'], " ");
    unsupported(&name.trim())
}

fn extra_samples(decoder: &mut Decoder<impl Read + Seek>) -> Result<Vec<u16>, TiffError> {
    integers(decoder, Tag::ExtraSamples)
}

fn is_alpha(extra: &[u16]) -> bool {
    matches!(extra, [ASSOCIATED_ALPHA | UNASSOCIATED_ALPHA])
}

/// The file up to its first picture. Tiles under the tags of strips, which old programs wrote and
/// libtiff reads, are not supported by our decoder: it reports a wrong number of them, or treats
/// them as strips if the number happens to match.
fn first_picture<R: Read + Seek>(mut file: R) -> Result<Decoder<R>, Refusal> {
    let tags = first_tags(&mut file).unwrap_or_default();
    file.rewind().map_err(TiffError::from)?;
    // The decoder does not support raw sensor data, and OpenImageIO treats it as grey.
    if is_undeveloped(&tags) {
        return Err(raw_file());
    }
    let mut of_both = [Tag::TileWidth, Tag::StripOffsets].iter();
    if of_both.all(|tag| tags.contains_key(&tag.to_u16())) {
        return Err(unsupported(&"tiles under strip tags"));
    }
    let mut decoder = Decoder::new(file)?;
    if is_reduced(&mut decoder) {
        return Err(raw_file());
    }
    if decoder.find_tag_unsigned(Tag::FillOrder)? == Some(LOWEST_BIT_FIRST) {
        return Err(unsupported(&"lowest bit first (FillOrder 2)"));
    }
    Ok(decoder)
}

fn raw_file() -> Refusal {
    format!("is {RAW}, whose first picture is not a photo: {DEVELOP}").into()
}

/// Whether the tags identify the file as a DNG, or its first picture as raw sensor data.
fn is_undeveloped(tags: &BTreeMap<u16, u16>) -> bool {
    let kind = tags.get(&Tag::PhotometricInterpretation.to_u16());
    tags.contains_key(&DNG_VERSION) || matches!(kind, Some(&(CFA | LINEAR_RAW)))
}

/// Whether the picture is a smaller version of another one in the same file; false if that tag
/// cannot be read.
fn is_reduced(decoder: &mut Decoder<impl Read + Seek>) -> bool {
    let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType);
    kind.is_ok_and(|kind| kind.is_some_and(|kind| kind & REDUCED_RESOLUTION != 0))
}

/// The tags of the first directory, in either byte order, classic or BigTIFF, with the values of
/// those that are a single 16-bit number; empty if the file ends inside the directory.
fn first_tags(file: &mut (impl Read + Seek)) -> std::io::Result<BTreeMap<u16, u16>> {
    let start = read_at(file, 0, 16)?;
    let order = match start.starts_with(b"II") {
        true => TiffOrder::LittleEndian,
        false => TiffOrder::BigEndian,
    };
    let directory = match is_big_tiff(&start) {
        true => BIG_DIRECTORY,
        false => CLASSIC_DIRECTORY,
    };
    let place = order.number(start.get(directory.place.clone()).unwrap_or_default());
    let bytes = directory.entries(file, place, order)?;
    let entries = bytes.chunks(directory.entry);
    Ok(entries.map(|entry| directory.tag(entry, order)).collect())
}

/// The layout of a directory, in bytes.
struct TiffDirectory {
    /// Position in the file of the offset of its first directory.
    place: Range<usize>,
    /// Size of the entry count.
    count: u64,
    /// Size of an entry.
    entry: usize,
    /// Offset of the value in an entry.
    value: usize,
}

const CLASSIC_DIRECTORY: TiffDirectory = TiffDirectory {
    place: 4..8,
    count: 2,
    entry: 12,
    value: 8,
};
const BIG_DIRECTORY: TiffDirectory = TiffDirectory {
    place: 8..16,
    count: 8,
    entry: 20,
    value: 12,
};

impl TiffDirectory {
    /// The entries of the directory at a position; empty if the file ends inside them.
    fn entries(
        &self,
        file: &mut (impl Read + Seek),
        place: u64,
        order: TiffOrder,
    ) -> std::io::Result<Vec<u8>> {
        let count = order.number(&read_at(file, place, self.count)?);
        let length = count.min(u16::MAX.into()) * self.entry as u64;
        let mut bytes = read_at(file, place.saturating_add(self.count), length)?;
        // The bytes after a 16-bit value in its field are not read.
        let unused = (self.entry - self.value - 2) as u64;
        if (bytes.len() as u64) < length.saturating_sub(unused) {
            bytes.clear();
        }
        Ok(bytes)
    }

    /// The tag of an entry, and the first 16 bits of its value.
    fn tag(&self, entry: &[u8], order: TiffOrder) -> (u16, u16) {
        let [name, value] = [&entry[..2], &entry[self.value..][..2]];
        (order.number(name) as u16, order.number(value) as u16)
    }
}

/// Rejects what OpenImageIO reads in wrong colours: CIELab with another white point, and pictures
/// whose palette is missing, which would be black.
fn refuse_misread_colors(decoder: &mut Decoder<impl Read + Seek>) -> Result<(), Refusal> {
    match color_kind(decoder)? {
        Some(PALETTE_COLOR) => refuse_missing_palette(decoder),
        Some(CIE_LAB | ICC_LAB | ITU_LAB) => {
            Err("is a TIFF of CIELab, expected grey or RGB: convert it to RGB first".into())
        }
        _ => Ok(()),
    }
}

fn color_kind(decoder: &mut Decoder<impl Read + Seek>) -> Result<Option<u16>, TiffError> {
    decoder.find_tag_unsigned(Tag::PhotometricInterpretation)
}

fn refuse_missing_palette(decoder: &mut Decoder<impl Read + Seek>) -> Result<(), Refusal> {
    let bits = integers(decoder, Tag::BitsPerSample)?.first().copied();
    let colors = bits.and_then(|bits| 1_usize.checked_shl(bits.into()));
    let expected = 3 * colors.unwrap_or(0);
    let entries = integers(decoder, Tag::ColorMap)?.len();
    if entries == expected {
        return Ok(());
    }
    Err(format!("damaged TIFF: a palette of {entries} entries, expected {expected}").into())
}

/// The numbers of a tag; empty if the tag is missing.
fn integers(decoder: &mut Decoder<impl Read + Seek>, tag: Tag) -> Result<Vec<u16>, TiffError> {
    let integers = decoder.find_tag_unsigned_vec::<u16>(tag)?;
    Ok(integers.unwrap_or_default())
}

/// What the camera recorded; the EXIF reader does not support BigTIFF.
pub(crate) fn camera_notes(mut file: impl BufRead + Seek) -> CameraNotes {
    let notes = CameraNotes::read(&mut file);
    let stated = file
        .rewind()
        .ok()
        .and_then(|()| first_integer(file, Tag::Orientation));
    match stated.map(u8::try_from) {
        Some(Ok(orientation)) => CameraNotes {
            orientation: Orientation(orientation),
            ..notes
        },
        _ => notes,
    }
}

/// Whether pixels have samples in addition to colour, the first of which is not declared as alpha.
pub(crate) fn has_unspecified_sample(bytes: &[u8]) -> bool {
    let decoder = Decoder::new(Cursor::new(bytes)).ok();
    let extra = decoder.and_then(|mut decoder| extra_samples(&mut decoder).ok());
    let extra = extra.unwrap_or_default();
    extra.first().is_some_and(|&kind| !is_alpha(&[kind]))
}

/// Whether the fourth sample is alpha by its position only, since no tag states its meaning.
pub(crate) fn has_unstated_alpha(bytes: &[u8]) -> bool {
    let Ok(mut decoder) = Decoder::new(Cursor::new(bytes)) else {
        return false;
    };
    let is_four = matches!(decoder.colortype(), Ok(ColorType::RGBA(_)));
    is_four && extra_samples(&mut decoder).is_ok_and(|extra| extra.is_empty())
}

/// Whether colours are premultiplied, also for kinds of TIFF that the decoder cannot read.
#[cfg(feature = "oiio")]
pub(crate) fn has_associated_alpha(bytes: &[u8]) -> bool {
    first_integer(Cursor::new(bytes), Tag::ExtraSamples) == Some(ASSOCIATED_ALPHA)
}

/// Whether the palette entries are codes times 256, as written by Pillow, instead of 257.
#[cfg(feature = "oiio")]
pub(crate) fn has_shifted_palette(bytes: &[u8]) -> bool {
    let palette = palette(bytes).unwrap_or_default();
    !palette.is_empty() && palette.iter().all(|entry| entry.is_multiple_of(256))
}

/// The palette of a picture whose codes are indices.
#[cfg(feature = "oiio")]
fn palette(bytes: &[u8]) -> Option<Vec<u16>> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).ok()?;
    let kind = color_kind(&mut decoder).ok()?;
    kind.filter(|&kind| kind == PALETTE_COLOR)?;
    integers(&mut decoder, Tag::ColorMap).ok()
}

/// The first number of a tag of the first picture.
fn first_integer(file: impl Read + Seek, tag: Tag) -> Option<u16> {
    let mut decoder = Decoder::new(file).ok()?;
    integers(&mut decoder, tag).ok()?.first().copied()
}

/// The embedded colour profile.
pub(crate) fn profile(bytes: &[u8], limits: &Limits) -> Option<Vec<u8>> {
    // Also for kinds of TIFF that the decoder cannot read: OpenImageIO returns their codes.
    let mut decoder = Decoder::new(Cursor::new(bytes))
        .ok()?
        .with_limits(metadata_limits(limits));
    decoder.get_tag_u8_vec(Tag::IccProfile).ok()
}

pub(crate) fn header(
    file: impl Read + Seek,
    file_bytes: u64,
    limits: &Limits,
) -> Result<Header, Refusal> {
    let mut file = open(file, file_bytes, limits)?;
    let text = file
        .decoder
        .get_tag_ascii_string(Tag::ImageDescription)
        .unwrap_or_default();
    Ok(Header {
        format: Format::Tiff,
        width: file.width,
        height: file.height,
        channels: file.names,
        bits: u32::from(file.bits),
        metadata: notes_of_lines(&text),
        ..Header::default()
    })
}

pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    match decode_known(bytes, limits) {
        // OpenImageIO would read its bits as bytes.
        Err(Refusal::Unsupported(what)) if !states_bits(bytes) => Err(Refusal::Broken(what)),
        // OpenImageIO would silently fill in what some truncated kinds lack.
        Err(Refusal::Unsupported(_)) if is_cut_file(bytes, limits) => Err(truncated()),
        decoded => decoded,
    }
}

/// Whether the file ends before a strip or tile of its first picture does. Declared lengths that
/// are too long do not matter for a JPEG whose end is present, nor without compression, where
/// OpenImageIO itself rejects missing data.
fn is_cut(decoder: &mut Decoder<impl Read + Seek>, bytes: &[u8]) -> bool {
    let is_jpeg = match compression(decoder) {
        Ok(NO_COMPRESSION) | Err(_) => return false,
        Ok(method) => [OLD_JPEG_COMPRESSION, JPEG_COMPRESSION].contains(&method),
    };
    let mut too_long = beyond_the_end(decoder, bytes).into_iter();
    too_long.any(|chunk| !is_jpeg || !chunk.windows(2).any(|pair| pair == END_OF_JPEG))
}

/// The same for a file whose pixels the decoder cannot read.
fn is_cut_file(bytes: &[u8], limits: &Limits) -> bool {
    let decoder = Decoder::new(Cursor::new(bytes)).ok();
    let decoder = decoder.map(|decoder| decoder.with_limits(metadata_limits(limits)));
    decoder.is_some_and(|mut decoder| is_cut(&mut decoder, bytes))
}

/// The available bytes of strips and tiles that are declared to extend beyond the end of the file.
fn beyond_the_end<'a>(decoder: &mut Decoder<impl Read + Seek>, bytes: &'a [u8]) -> Vec<&'a [u8]> {
    let lists = [
        [Tag::StripOffsets, Tag::StripByteCounts],
        [Tag::TileOffsets, Tag::TileByteCounts],
    ];
    let chunks = lists.into_iter().flat_map(|tags| {
        let [places, lengths] = tags.map(|tag| long_integers(decoder, tag));
        places.into_iter().zip(lengths)
    });
    chunks
        .filter(|&(place, length)| place.saturating_add(length) > bytes.len() as u64)
        .map(|(place, _)| bytes.get(place as usize..).unwrap_or_default())
        .collect()
}

/// The numbers of a tag; empty if it is missing or cannot be read.
fn long_integers(decoder: &mut Decoder<impl Read + Seek>, tag: Tag) -> Vec<u64> {
    let integers = decoder.find_tag_unsigned_vec(tag);
    integers.ok().flatten().unwrap_or_default()
}

/// Whether the file states the number of bits per sample; the default is one.
fn states_bits(bytes: &[u8]) -> bool {
    let tags = first_tags(&mut Cursor::new(bytes)).unwrap_or_default();
    tags.contains_key(&Tag::BitsPerSample.to_u16())
}

fn decode_known(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let mut file = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    limits.check_memory(file.width, file.height, file.names.len())?;
    let extra = extra_samples(&mut file.decoder)?;
    refuse_old_lzw(&mut file.decoder, bytes)?;
    refuse_cut_jpeg(&mut file.decoder, bytes)?;
    let mut samples = read_chunks(&mut file)?;
    if file.inks {
        samples = light_left_by_inks(samples)?;
    }
    let display_encoded = !samples.are_float();
    Ok(Raster {
        width: file.width,
        height: file.height,
        names: file.names,
        samples,
        display_encoded,
        premultiplied: extra.first() == Some(&ASSOCIATED_ALPHA),
    })
}

/// Rejects codes stored from the lowest bit up, as before 1990: LZW data must begin with the clear
/// code (TIFF 6.0, section 13).
fn refuse_old_lzw(decoder: &mut Decoder<impl Read + Seek>, bytes: &[u8]) -> Result<(), Refusal> {
    if !is_lzw(decoder)? {
        return Ok(());
    }
    let strips = decoder.find_tag_unsigned_vec::<u64>(Tag::StripOffsets)?;
    let first = strips.unwrap_or_default().first().copied();
    let codes = first.and_then(|at| bytes.get(usize::try_from(at).ok()?..)?.first_chunk());
    match codes {
        Some(&[0, second]) if second & 1 == 1 => Err(unsupported(&"old LZW")),
        _ => Ok(()),
    }
}

fn is_lzw(decoder: &mut Decoder<impl Read + Seek>) -> Result<bool, TiffError> {
    Ok(compression(decoder)? == LZW_COMPRESSION)
}

/// Rejects a truncated JPEG: the decoder would silently fill in what is missing.
fn refuse_cut_jpeg(decoder: &mut Decoder<impl Read + Seek>, bytes: &[u8]) -> Result<(), Refusal> {
    match compression(decoder)? == JPEG_COMPRESSION && is_cut(decoder, bytes) {
        true => Err(truncated()),
        false => Ok(()),
    }
}

fn compression(decoder: &mut Decoder<impl Read + Seek>) -> Result<u16, TiffError> {
    let stated = decoder.find_tag_unsigned(Tag::Compression)?;
    Ok(stated.unwrap_or(NO_COMPRESSION))
}

/// The position of the strips or tiles in a picture, and what each of them contains.
#[derive(Clone, Copy)]
struct ChunkGrid {
    /// Of the picture.
    width: usize,
    height: usize,
    /// Number of stored channels.
    channels: usize,
    /// Whether each channel has its own strips or tiles.
    planes: bool,
    /// Of a strip or tile.
    size: (usize, usize),
}

impl ChunkGrid {
    fn new(file: &mut OpenedTiff<impl Read + Seek>) -> Result<Self, Refusal> {
        let (across, down) = file.decoder.chunk_dimensions();
        let planes = file.decoder.find_tag_unsigned(Tag::PlanarConfiguration)?;
        Ok(Self {
            width: file.width,
            height: file.height,
            channels: if file.inks { 4 } else { file.names.len() },
            planes: planes == Some(SEPARATE_PLANES),
            size: (across as usize, (down as usize).min(file.height)),
        })
    }

    fn across(&self) -> usize {
        self.width.div_ceil(self.size.0)
    }

    /// Number of strips or tiles of the picture, or of a plane.
    fn count(&self) -> usize {
        self.across() * self.height.div_ceil(self.size.1)
    }

    /// Number of strips or tiles of all planes.
    fn count_all(&self) -> usize {
        self.count() * if self.planes { self.channels } else { 1 }
    }

    fn samples(&self) -> usize {
        self.width * self.height * self.channels
    }

    /// Number of channels in a strip or tile.
    fn stored_channels(&self) -> usize {
        if self.planes { 1 } else { self.channels }
    }

    /// The first pixel of a strip or tile of a plane.
    fn corner(&self, index: usize) -> (usize, usize) {
        (
            index % self.across() * self.size.0,
            index / self.across() * self.size.1,
        )
    }

    /// Copies the samples of a strip or tile, of which `columns` and `rows` are inside, into the
    /// picture.
    fn put<T: Copy>(&self, to: &mut [T], from: &[T], index: usize, [columns, rows]: [usize; 2]) {
        let plane = index / self.count();
        let (left, top) = self.corner(index % self.count());
        let stored = self.stored_channels();
        let kept = columns.min(self.width - left);
        let rows = rows.min(self.height - top);
        for (y, row) in from.chunks_exact(columns * stored).take(rows).enumerate() {
            let at = ((top + y) * self.width + left) * self.channels + plane;
            self.put_row(&mut to[at..], &row[..kept * stored]);
        }
    }

    /// Copies a row of all channels, or of one, to its position in the picture.
    fn put_row<T: Copy>(&self, to: &mut [T], row: &[T]) {
        if self.planes {
            let to = to.iter_mut().step_by(self.channels);
            to.zip(row).for_each(|(to, &from)| *to = from);
        } else {
            to[..row.len()].copy_from_slice(row);
        }
    }

    /// The same for any sample type.
    fn put_samples(
        &self,
        to: &mut Samples,
        from: &Samples,
        index: usize,
        size: [usize; 2],
    ) -> Result<(), Refusal> {
        match (to, from) {
            (Samples::U8(to), Samples::U8(from)) => self.put(to, from, index, size),
            (Samples::U16(to), Samples::U16(from)) => self.put(to, from, index, size),
            (Samples::F16(to), Samples::F16(from)) => self.put(to, from, index, size),
            (Samples::F32(to), Samples::F32(from)) => self.put(to, from, index, size),
            _ => return Err("damaged TIFF: mixed sample types".into()),
        }
        Ok(())
    }
}

/// Reads the samples of the picture strip by strip or tile by tile: the decoder's function for the
/// whole picture leaves columns black where tiles extend beyond the border, and does not support
/// planes.
fn read_chunks(file: &mut OpenedTiff<impl Read + Seek>) -> Result<Samples, Refusal> {
    let packed = is_packed(file)?;
    if !packed && !file.bits.is_multiple_of(8) {
        return Err(unsupported(&format!("{} bits a sample", file.bits)));
    }
    let grid = ChunkGrid::new(file)?;
    let mut picture: Option<Samples> = None;
    for index in 0..grid.count_all() {
        let (mut chunk, size) = read_chunk(&mut file.decoder, index)?;
        if packed {
            chunk = unpacked(&chunk, size[0] * grid.stored_channels())?;
        }
        let picture = picture.get_or_insert_with(|| Samples::zeroed(chunk.kind(), grid.samples()));
        grid.put_samples(picture, &chunk, index, size)?;
    }
    picture.ok_or_else(|| "damaged TIFF: no strips".into())
}

/// Whether samples are single bits by default, because the file does not state their size.
fn is_packed(file: &mut OpenedTiff<impl Read + Seek>) -> Result<bool, TiffError> {
    Ok(file.bits == 1 && integers(&mut file.decoder, Tag::BitsPerSample)?.is_empty())
}

/// Codes of black and white, from rows of this many bits.
fn unpacked(chunk: &Samples, row_bits: usize) -> Result<Samples, Refusal> {
    let Samples::U8(packed) = chunk else {
        return Err(unsupported(&"signed bits"));
    };
    let rows = packed.chunks_exact(row_bits.div_ceil(8));
    let codes =
        rows.flat_map(|row| (0..row_bits).map(move |i| u8::MAX * (row[i / 8] >> (7 - i % 8) & 1)));
    Ok(Samples::U8(codes.collect()))
}

/// A strip or tile, and its number of columns and rows.
fn read_chunk(
    decoder: &mut Decoder<impl Read + Seek>,
    index: usize,
) -> Result<(Samples, [usize; 2]), Refusal> {
    let number = u32::try_from(index).map_err(|_| "damaged TIFF: too many strips")?;
    let decoded = decoder.read_chunk(number);
    // For tiles that extend beyond the right border, which it decodes row by row, the decoder
    // treats the last codes as missing (weezl 0.1.12).
    if decoded.as_ref().is_err_and(is_early_end)
        && is_lzw(decoder)?
        && decoder.chunk_data_dimensions(number).0 < decoder.chunk_dimensions().0
    {
        return Err(unsupported(&"LZW whose end is not found"));
    }
    let chunk = known_samples(decoded?);
    let (columns, rows) = decoder.chunk_data_dimensions(number);
    Ok((chunk, [columns as usize, rows as usize]))
}

/// Converts doubles to floats and other integers to 16 bits: full scale stays full scale, and
/// negative values become zero.
///
/// Long because every sample type has its own line.
fn known_samples(decoded: DecodingResult) -> Samples {
    match decoded {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::F16(v) => Samples::F16(v),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::F64(v) => Samples::F32(v.into_iter().map(|x| x as f32).collect()),
        DecodingResult::U32(v) => codes_of(v, |x| (x >> 16) as u16),
        DecodingResult::U64(v) => codes_of(v, |x| (x >> 48) as u16),
        DecodingResult::I8(v) => codes_of(v, widened_7_bits),
        DecodingResult::I16(v) => codes_of(v, |x| widened_15_bits(x.into(), 0)),
        DecodingResult::I32(v) => codes_of(v, |x| widened_15_bits(x.into(), 16)),
        DecodingResult::I64(v) => codes_of(v, |x| widened_15_bits(x, 48)),
    }
}

fn codes_of<T>(samples: Vec<T>, code: impl Fn(T) -> u16) -> Samples {
    Samples::U16(samples.into_iter().map(code).collect())
}

/// Widens 7 bits to 16.
fn widened_7_bits(x: i8) -> u16 {
    let x = x.max(0) as u16;
    doubled(x << 8 | x << 1 | x >> 6)
}

/// The highest 15 value bits of a signed integer, widened to 16.
fn widened_15_bits(x: i64, further_bits: u32) -> u16 {
    doubled((x.max(0) >> further_bits) as u16)
}

/// Widens 15 bits to 16 by repeating the highest one at the end: 0 stays 0, and full scale stays
/// full scale.
fn doubled(x: u16) -> u16 {
    x << 1 | x >> 14
}

/// Red, green and blue that cyan, magenta, yellow and black leave of white, display-encoded like
/// the inks; a colour profile would be more exact, but is not applied to inks.
fn light_left_by_inks(inks: Samples) -> Result<Samples, Refusal> {
    match inks {
        Samples::U8(v) => Ok(Samples::U8(left_by_inks(&v, u8::MAX.into()))),
        Samples::U16(v) => Ok(Samples::U16(left_by_inks(&v, u16::MAX.into()))),
        _ => Err(unsupported(&"inks in float")),
    }
}

fn left_by_inks<T: Copy + Into<u64> + TryFrom<u64> + Default>(inks: &[T], full: u64) -> Vec<T> {
    let pixels = inks.as_chunks().0.iter();
    pixels
        .flat_map(|&[cyan, magenta, yellow, black]| {
            [cyan, magenta, yellow].map(|ink| {
                let product = (full - ink.into()) * (full - black.into());
                T::try_from((product + full / 2) / full).unwrap_or_default()
            })
        })
        .collect()
}

/// A complete file of integer codes; alpha is straight.
pub(crate) fn encode_codes(
    size: (usize, usize),
    n: usize,
    codes: &Codes,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
    let alpha = ExtraSamples::UnassociatedAlpha;
    match codes {
        Codes::U8(v) => encode_grey_or_rgb::<Gray8, RGB8>(size, n, v, alpha, metadata),
        Codes::U16(v) => encode_grey_or_rgb::<Gray16, RGB16>(size, n, v, alpha, metadata),
    }
}

/// A complete file of scene-linear floats with one, three or four channels; colours are
/// premultiplied.
pub(crate) fn encode_floats(
    size: (usize, usize),
    channels: usize,
    samples: &[f32],
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
    let alpha = ExtraSamples::AssociatedAlpha;
    encode_grey_or_rgb::<Gray32Float, RGB32Float>(size, channels, samples, alpha, metadata)
}

/// A file with one channel as `Grey`, or three or four as `Rgb`; `alpha` is the meaning of a fourth
/// one.
fn encode_grey_or_rgb<Grey, Rgb>(
    size: (usize, usize),
    channels: usize,
    samples: &[Grey::Inner],
    alpha: ExtraSamples,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String>
where
    Grey: colortype::ColorType,
    Rgb: colortype::ColorType<Inner = Grey::Inner>,
    [Grey::Inner]: TiffValue,
{
    let alpha = (channels > 3).then_some(alpha);
    match channels {
        1 => encode::<Grey>(size, samples, alpha, metadata),
        3 | 4 => encode::<Rgb>(size, samples, alpha, metadata),
        _ => return Err(format!("{channels} channels, expected 1, 3 or 4")),
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
        let text = ascii_notes(metadata);
        let tags = image.encoder();
        tags.write_tag(Tag::ImageDescription, text.as_str())?;
    }
    image.write_data(samples)?;
    Ok(out.into_inner())
}

/// Texts restricted to the ASCII characters that the format supports.
fn ascii_notes(metadata: &[(String, String)]) -> String {
    let mut text = lines_of_notes(metadata);
    text.retain(|c| c.is_ascii());
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use tiff::encoder::colortype::RGBA8;

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
            assert_eq!(known_samples(samples), full, "{name}");
        }
        // Half of the scale.
        let half = |samples: DecodingResult| match known_samples(samples) {
            Samples::U16(v) => f64::from(v[0]) / 65_535.0,
            other => panic!("{other:?}"),
        };
        assert!((half(DecodingResult::I8(vec![64])) - 64.0 / 127.0).abs() < 1e-4);
        assert!((half(DecodingResult::I16(vec![12_345])) - 12_345.0 / 32_767.0).abs() < 2e-5);
    }

    /// A TIFF of 2 x 2 pixels with a tag.
    fn with_tag(tag: Tag, value: impl TiffValue) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let mut image = encoder.new_image::<Gray8>(2, 2).unwrap();
        image.encoder().write_tag(tag, value).unwrap();
        image.write_data(&[7; 4]).unwrap();
        file.into_inner()
    }

    /// A grey picture of 2 x 2 pixels, with the directory before its only strip.
    fn with_strip(compression: u16, strip: &[u8]) -> Vec<u8> {
        let entries = [
            (Tag::ImageWidth, 2),
            (Tag::ImageLength, 2),
            (Tag::BitsPerSample, 8),
            (Tag::Compression, u32::from(compression)),
            (Tag::PhotometricInterpretation, 1),
            (Tag::StripOffsets, 98),
            (Tag::StripByteCounts, strip.len() as u32),
        ];
        let mut file = b"II*\0\x08\0\0\0\x07\0".to_vec();
        for (tag, value) in entries {
            file.extend(tag.to_u16().to_le_bytes());
            file.extend(b"\x04\0\x01\0\0\0");
            file.extend(u32::to_le_bytes(value));
        }
        file.extend([0; 4]);
        file.extend(strip);
        file
    }

    #[test]
    fn a_cut_file_is_not_left_to_another_decoder() {
        const LZMA_COMPRESSION: u16 = 34_925;
        let whole = with_strip(LZMA_COMPRESSION, &[1, 2, 3]);
        let left = decode(&whole, &Limits::default()).err().unwrap();
        assert!(matches!(left, Refusal::Unsupported(_)), "{left}");
        assert_truncated(&whole[..whole.len() - 1]);
        // Strips are not decoded row by row. The codes 256 (begin) and 7, nine bits each: the
        // others are missing.
        assert_truncated(&with_strip(LZW_COMPRESSION, &[0x80, 0x01, 0xc0]));
    }

    fn assert_truncated(file: &[u8]) {
        match decode(file, &Limits::default()) {
            Err(Refusal::Broken(told)) => assert_eq!(told, "truncated TIFF"),
            other => panic!("{:?}", other.map(|_| "read")),
        }
    }

    #[test]
    fn a_jpeg_is_cut_where_its_end_is_not_there() {
        let mut jpeg = Vec::new();
        let encoder = jpeg_encoder::Encoder::new(&mut jpeg, 90);
        let grey = jpeg_encoder::ColorType::Luma;
        encoder.encode(&[7; 4], 2, 2, grey).unwrap();
        jpeg.push(0);
        let file = with_strip(JPEG_COMPRESSION, &jpeg);
        // Without its last byte the strip's stated length is one too long, and without two it has
        // no end.
        for missing in [0, 1] {
            let read = decode(&file[..file.len() - missing], &Limits::default()).unwrap();
            assert_eq!((read.width, read.height), (2, 2));
        }
        assert_truncated(&file[..file.len() - 2]);
    }

    #[test]
    fn raw_files_are_not_read_by_the_small_picture_in_front() {
        let decoded = |file: Vec<u8>| decode(&file, &Limits::default());
        let whole = decoded(with_tag(Tag::NewSubfileType, 0_u32)).unwrap();
        assert_eq!((whole.width, whole.height), (2, 2));
        let dng = Tag::from_u16_exhaustive(DNG_VERSION);
        for raw in [
            with_tag(Tag::NewSubfileType, REDUCED_RESOLUTION),
            with_tag(dng, &[1_u8, 4, 0, 0][..]),
        ] {
            let told = decoded(raw).err().unwrap().to_string();
            assert!(told.starts_with("is a camera's raw file"), "{told}");
        }
    }

    #[test]
    fn raw_data_of_a_sensor_are_no_photo() {
        let kind = Tag::PhotometricInterpretation;
        // A mosaic of 2 x 2 pixels that is also a DNG, in the other byte order.
        let mut mosaic = b"MM\0*\0\0\0\x08\0\x04".to_vec();
        mosaic.extend(b"\x01\0\0\x03\0\0\0\x01\0\x02\0\0");
        mosaic.extend(b"\x01\x01\0\x03\0\0\0\x01\0\x02\0\0");
        mosaic.extend(b"\x01\x06\0\x03\0\0\0\x01\x80\x23\0\0");
        mosaic.extend(b"\xc6\x12\0\x01\0\0\0\x04\x01\x04\0\0");
        mosaic.extend([0; 4]);
        let without_version = {
            let mut file = mosaic.clone();
            file[46] = 0;
            file
        };
        // The file ends after the two significant bytes of its last value.
        let cut = mosaic[..mosaic.len() - 6].to_vec();
        // A BigTIFF in which the last 6 bytes of an entry are insignificant.
        let mut cut_big = b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0\x01\0\0\0\0\0\0\0".to_vec();
        cut_big.extend(b"\x06\x01\x03\0\x01\0\0\0\0\0\0\0\x23\x80");
        for raw in [
            mosaic,
            without_version,
            cut,
            cut_big,
            with_tag(kind, CFA),
            with_tag(kind, LINEAR_RAW),
        ] {
            match decode(&raw, &Limits::default()) {
                Err(Refusal::Broken(told)) => assert!(told.contains(DEVELOP), "{told}"),
                other => panic!("{:?}", other.map(|_| "read")),
            }
        }
    }

    #[test]
    fn a_fourth_sample_is_alpha_only_where_it_is_called_so() {
        let [unspecified, alpha] = [ExtraSamples::Unspecified, ExtraSamples::UnassociatedAlpha];
        for (kinds, is_unspecified, names) in [
            (&[unspecified][..], true, "R G B"),
            (&[unspecified, alpha], true, "R G B"),
            (&[alpha], false, "R G B A"),
        ] {
            let mut file = Cursor::new(Vec::new());
            let mut encoder = TiffEncoder::new(&mut file).unwrap();
            let mut image = encoder.new_image::<RGB8>(2, 1).unwrap();
            image.extra_samples(kinds).unwrap();
            let extra = vec![0_u8; kinds.len()];
            let samples = [&[1, 2, 3][..], &extra, &[4, 5, 6], &extra].concat();
            image.write_data(&samples).unwrap();
            let file = file.into_inner();
            assert_eq!(has_unspecified_sample(&file), is_unspecified);
            assert!(!has_unstated_alpha(&file));
            let read = decode(&file, &Limits::default()).unwrap();
            assert_eq!(read.names.join(" "), names);
            assert!(read.names.len() == 4 || read.samples == Samples::U8(vec![1, 2, 3, 4, 5, 6]));
        }
    }

    /// As OpenImageIO and OpenCV read it.
    #[test]
    fn a_fourth_sample_without_a_word_is_straight_alpha() {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let image = encoder.new_image::<RGBA8>(1, 1).unwrap();
        image.write_data(&[1, 2, 3, 4]).unwrap();
        let file = file.into_inner();
        assert!(has_unstated_alpha(&file));
        let read = decode(&file, &Limits::default()).unwrap();
        assert_eq!(
            (read.names.join(" "), read.premultiplied),
            ("R G B A".into(), false)
        );
        assert_eq!(read.samples, Samples::U8(vec![1, 2, 3, 4]));
    }

    #[test]
    fn lightness_and_differences_of_colour_are_refused() {
        for kind in [CIE_LAB, ICC_LAB, ITU_LAB] {
            let file = with_tag(Tag::PhotometricInterpretation, kind);
            let refusal = decode(&file, &Limits::default()).err().unwrap();
            assert!(matches!(refusal, Refusal::Broken(_)), "{refusal}");
            let told = refusal.to_string();
            assert!(told.ends_with("convert it to RGB first"), "{told}");
        }
    }

    #[test]
    fn a_bigtiff_is_turned_and_multiplied_as_it_says() {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new_big(&mut file).unwrap();
        let mut image = encoder.new_image::<RGB8>(2, 1).unwrap();
        let alpha = [ExtraSamples::AssociatedAlpha];
        image.extra_samples(&alpha).unwrap();
        image.encoder().write_tag(Tag::Orientation, 6_u16).unwrap();
        image.write_data(&[7; 8]).unwrap();
        let notes = camera_notes(Cursor::new(file.get_ref()));
        assert_eq!(notes.orientation, Orientation(6));
        #[cfg(feature = "oiio")]
        assert!(has_associated_alpha(file.get_ref()));
    }

    /// A picture of 5 x 3 whose tiles of 4 x 2 extend beyond its border, with or without planes.
    #[test]
    fn tiles_that_reach_over_the_border_are_cut() {
        for planes in [false, true] {
            let grid = ChunkGrid {
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
