//! JPEG: 8 bits, display-encoded, no alpha. Arithmetic coding and other rare kinds are left to
//! OpenImageIO.

use super::raster::{Raster, Samples, default_names};
use super::refusal::Refusal;
use crate::image::Image;
use crate::io::format::Format;
use crate::io::header::{Header, Notes, lines_of_notes, notes_of_lines};
use crate::io::limits::{Demand, Limits, at_most};
use crate::pixel::Srgb8;
use image::codecs::jpeg::JpegDecoder;
use image::{ImageDecoder, ImageError};
use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, SamplingFactor};
use serde::{Deserialize, Serialize};
use std::io::{Cursor, Read};

// Markers of ISO/IEC 10918-1, table B.1: end of image, start of scan, comment, application segment
// 2.
const EOI: u8 = 0xd9;
const SOS: u8 = 0xda;
const COM: u8 = 0xfe;
const APP2: u8 = 0xe2;
/// First bytes of a segment with a part of a colour profile (ICC.1:2022, B.4), followed by its
/// number and the number of parts.
const ICC_SIGNATURE: &[u8] = b"ICC_PROFILE\0";

impl From<ImageError> for Refusal {
    fn from(e: ImageError) -> Self {
        match e {
            ImageError::Unsupported(_) => Self::Unsupported(e.to_string()),
            _ => Self::Broken(format!("damaged: {e}")),
        }
    }
}

/// The part of a file before its first scan: everything known before the pixels.
pub(crate) fn read_before_scan(file: &mut impl Read, limits: &Limits) -> Result<Vec<u8>, Refusal> {
    let mut bytes = Vec::new();
    append(&mut bytes, file, 2)?;
    loop {
        let at = bytes.len();
        let marker = append_segment(&mut bytes, file)?;
        at_most(
            bytes.len() as u64,
            limits.metadata_bytes,
            "bytes in front of the picture",
            "metadata_bytes",
        )?;
        check_kind(marker, bytes.get(at + 4..).unwrap_or_default())?;
        if marker == SOS {
            return Ok(bytes);
        }
    }
}

/// Appends a marker and its segment; returns the marker.
fn append_segment(bytes: &mut Vec<u8>, file: &mut impl Read) -> Result<u8, Refusal> {
    let marker = append_marker(bytes, file)?;
    let at = bytes.len();
    append(bytes, file, 2)?;
    // The length includes its own two bytes.
    let length = usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
    append(bytes, file, length.saturating_sub(2))?;
    Ok(marker)
}

/// Reads a marker that is followed by a segment.
fn append_marker(bytes: &mut Vec<u8>, file: &mut impl Read) -> Result<u8, Refusal> {
    let at = bytes.len();
    append(bytes, file, 2)?;
    // Skips padding bytes before a marker.
    while bytes[at + 1] == 0xff {
        bytes.truncate(at + 1);
        append(bytes, file, 1)?;
    }
    match bytes[at..] {
        [0xff, marker] if marker != EOI => Ok(marker),
        _ => Err("damaged JPEG: no picture".into()),
    }
}

/// Appends `count` more bytes.
fn append(bytes: &mut Vec<u8>, file: &mut impl Read, count: usize) -> Result<(), Refusal> {
    let at = bytes.len();
    bytes.resize(at + count, 0);
    file.read_exact(&mut bytes[at..])
        .map_err(|_| "truncated JPEG (no picture)".into())
}

/// Rejects kinds of JPEG that our decoder does not support, by the marker of the frame (ISO/IEC
/// 10918-1, table B.1) and the content of its segment (B.2.2).
fn check_kind(marker: u8, frame: &[u8]) -> Result<(), Refusal> {
    let kind: String = match (marker, frame.first()) {
        (0xc0..=0xc2, Some(8)) if has_sampling_factor_3(frame) => "sampling factors of 3".into(),
        (0xc0..=0xc2, Some(8)) => return Ok(()),
        (0xc0..=0xc2, Some(bits)) => format!("{bits} bits a sample, expected 8"),
        (0xc3, _) => "lossless".into(),
        (0xc5..=0xc7 | 0xcd..=0xcf, _) => "hierarchical".into(),
        (0xc9..=0xcb, _) => "arithmetic coding".into(),
        _ => return Ok(()),
    };
    Err(Refusal::Unsupported(format!("unsupported JPEG: {kind}")))
}

/// Whether a component has a horizontal or vertical sampling factor of 3. The components follow the
/// bits, lines, columns and number of components, and take three bytes each.
fn has_sampling_factor_3(frame: &[u8]) -> bool {
    let components = frame.get(6..).unwrap_or_default().chunks_exact(3);
    components
        .map(|component| component[1])
        .any(|factors| factors >> 4 == 3 || factors & 0xf == 3)
}

fn open<'a>(
    bytes: &'a [u8],
    file_bytes: u64,
    limits: &Limits,
) -> Result<JpegDecoder<Cursor<&'a [u8]>>, Refusal> {
    let decoder = JpegDecoder::new(Cursor::new(bytes))?;
    let (width, height) = decoder.dimensions();
    let channels = decoder.color_type().channel_count();
    limits.check(Demand::new([width, height], channels, 1_u8, file_bytes))?;
    Ok(decoder)
}

/// `start` must include at least the part [before the first scan](read_before_scan).
pub(crate) fn header(start: &[u8], file_bytes: u64, limits: &Limits) -> Result<Header, Refusal> {
    let decoder = open(start, file_bytes, limits)?;
    let (width, height) = decoder.dimensions();
    Ok(Header {
        format: Format::Jpeg,
        width: width as usize,
        height: height as usize,
        channels: channel_names(&decoder).unwrap_or_default(),
        bits: 8,
        metadata: notes_of_comments(start),
        ..Header::default()
    })
}

fn notes_of_comments(bytes: &[u8]) -> Notes {
    segments(bytes)
        .filter(|s| s.marker == COM)
        .flat_map(|s| notes_of_lines(&String::from_utf8_lossy(s.data)))
        .collect()
}

/// The embedded colour profile, split over segments of 64 KiB.
pub(crate) fn profile(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut parts: Vec<(u8, &[u8])> = segments(bytes)
        .take_while(|s| s.marker != SOS)
        .filter(|s| s.marker == APP2)
        .filter_map(profile_part)
        .collect();
    parts.sort_by_key(|&(number, _)| number);
    let parts: Vec<&[u8]> = parts.into_iter().map(|(_, part)| part).collect();
    (!parts.is_empty()).then(|| parts.concat())
}

/// A part of a colour profile and its number.
fn profile_part(segment: JpegSegment<'_>) -> Option<(u8, &[u8])> {
    let numbered = segment.data.strip_prefix(ICC_SIGNATURE)?;
    let (&[number, _], part) = numbered.split_first_chunk()?;
    Some((number, part))
}

fn check_complete(bytes: &[u8]) -> Result<(), Refusal> {
    if segments(bytes).any(|s| s.marker == EOI) {
        Ok(())
    } else {
        Err("truncated JPEG (no end marker)".into())
    }
}

/// Decodes a complete file; decoders, including those of other libraries, return a half-grey
/// picture for a truncated one, so this is checked first.
pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let start = read_before_scan(&mut &bytes[..], limits);
    if !matches!(start, Err(Refusal::Broken(_))) {
        check_complete(bytes)?;
    }
    start?;
    let decoder = open(bytes, bytes.len() as u64, limits)?;
    let (width, height) = decoder.dimensions();
    let size = (width as usize, height as usize);
    let names = channel_names(&decoder).ok_or("channels of an unknown kind")?;
    limits.check_memory(size.0, size.1, names.len())?;
    let mut data = vec![0; usize::try_from(decoder.total_bytes()).map_err(|_| "size overflows")?];
    decoder.read_image(&mut data)?;
    Ok(Raster::display_codes(size, names, Samples::U8(data)))
}

fn channel_names(decoder: &impl ImageDecoder) -> Option<Vec<String>> {
    default_names(decoder.color_type().channel_count().into())
}

/// A marker segment of a JPEG file.
struct JpegSegment<'a> {
    marker: u8,
    data: &'a [u8],
}

/// The segments in order, without scans; stops early if the file ends. An EXIF thumbnail, itself a
/// JPEG, is inside a segment and so does not end the file.
fn segments(bytes: &[u8]) -> impl Iterator<Item = JpegSegment<'_>> {
    let mut rest = bytes.get(2..).unwrap_or_default();
    let mut after_scan = false;
    std::iter::from_fn(move || {
        if after_scan {
            rest = &rest[end_of_scan(rest)..];
        }
        let segment;
        (segment, rest) = split_segment(rest)?;
        after_scan = segment.marker == SOS;
        Some(segment)
    })
}

/// The first segment and the bytes after it; none follow the end of the picture.
fn split_segment(mut bytes: &[u8]) -> Option<(JpegSegment<'_>, &[u8])> {
    while bytes.starts_with(&[0xff, 0xff]) {
        bytes = &bytes[1..];
    }
    let (&[0xff, marker], tail) = bytes.split_first_chunk()? else {
        return None;
    };
    if marker == EOI {
        return Some((JpegSegment { marker, data: &[] }, &[]));
    }
    let length = usize::from(u16::from_be_bytes(*tail.first_chunk()?));
    let data = tail.get(2..length)?;
    Some((JpegSegment { marker, data }, &tail[length..]))
}

/// The end of the entropy-coded data: a marker that is not a stuffed byte, a restart or padding.
fn end_of_scan(bytes: &[u8]) -> usize {
    bytes.windows(2).position(is_marker).unwrap_or(bytes.len())
}

/// Whether two bytes are a marker, not an escaped data byte, padding or a restart.
fn is_marker(pair: &[u8]) -> bool {
    pair[0] == 0xff && !matches!(pair[1], 0 | 0xff | 0xd0..=0xd7)
}

/// A complete file with a quality of 1 to 100, from 8-bit codes of one or three channels.
pub(crate) fn encode(
    (width, height): (usize, usize),
    codes: &[u8],
    quality: u8,
    chroma: Chroma,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, String> {
    let [Ok(columns), Ok(rows)] = [width, height].map(u16::try_from) else {
        return Err(format!(
            "{width} x {height} pixels, expected sides of at most 65535 in a JPEG"
        ));
    };
    let color = match codes.len().checked_div(width * height) {
        Some(1) => ColorType::Luma,
        _ => ColorType::Rgb,
    };
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(chroma.sampling_factor());
    // As cameras do; using the colour of one pixel of each block would cause aliasing.
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    let encoded = encoder.encode(codes, columns, rows, color);
    encoded.map_err(|e| e.to_string())?;
    insert_comment(&mut bytes, metadata)?;
    Ok(bytes)
}

/// Chroma subsampling of a JPEG file (ITU-T T.871).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Chroma {
    /// One sample per pixel.
    #[default]
    #[serde(rename = "4:4:4")]
    Full,
    /// One sample per two horizontally adjacent pixels.
    #[serde(rename = "4:2:2")]
    HalfWidth,
    /// One sample per two by two pixels, as most cameras write.
    #[serde(rename = "4:2:0")]
    Quarter,
}

impl Chroma {
    fn sampling_factor(self) -> SamplingFactor {
        match self {
            Self::Full => SamplingFactor::F_1_1,
            Self::HalfWidth => SamplingFactor::F_2_1,
            Self::Quarter => SamplingFactor::F_2_2,
        }
    }
}

/// A picture after encoding and decoding as JPEG with a quality of 1 to 100; none for one that
/// cannot be stored, such as one without pixels.
pub fn through_jpeg(image: &Image<Srgb8>, quality: u8, chroma: Chroma) -> Option<Image<Srgb8>> {
    let codes = bytemuck::cast_slice(image.pixels());
    let file = encode(image.size(), codes, quality, chroma, &[]).ok()?;
    let raster = decode(&file, &Limits::default()).ok()?;
    let Samples::U8(codes) = raster.samples else {
        return None;
    };
    let pixels = bytemuck::pod_collect_to_vec(&codes);
    Some(Image::from_vec(raster.width, raster.height, pixels))
}

/// Inserts the notes as a comment segment right after the start marker.
fn insert_comment(jpeg: &mut Vec<u8>, notes: &[(String, String)]) -> Result<(), String> {
    if notes.is_empty() {
        return Ok(());
    }
    let text = lines_of_notes(notes);
    let length = u16::try_from(text.len() + 2)
        .map_err(|_| "metadata of more than 65,533 bytes does not fit a JPEG")?;
    let segment = [0xff, COM]
        .into_iter()
        .chain(length.to_be_bytes())
        .chain(text.into_bytes());
    jpeg.splice(2..2, segment);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thumbnail_does_not_end_the_file() {
        let thumbnail =
            b"\xff\xd8\xff\xe1\x00\x06\xff\xd8\xff\xd9\xff\xda\x00\x02\x12\xff\x00\x34\xff\xd0\x56";
        assert!(!segments(thumbnail).any(|s| s.marker == EOI));
        let whole = [thumbnail.as_slice(), b"\xff\xd9"].concat();
        assert!(segments(&whole).any(|s| s.marker == EOI));
    }

    /// The beginning of a one-pixel picture with any kind of frame.
    fn frame(marker: u8, bits: u8) -> Result<Vec<u8>, Refusal> {
        sampled_frame(marker, bits, 0x11)
    }

    fn sampled_frame(marker: u8, bits: u8, factors: u8) -> Result<Vec<u8>, Refusal> {
        let file = sampled_file(marker, bits, factors);
        read_before_scan(&mut file.as_slice(), &Limits::default())
    }

    fn sampled_file(marker: u8, bits: u8, factors: u8) -> Vec<u8> {
        let frame = [marker, 0, 11, bits, 0, 1, 0, 1, 1, 1, factors, 0];
        [b"\xff\xd8\xff".as_slice(), &frame, b"\xff\xda\0\x02"].concat()
    }

    #[test]
    fn a_cut_file_is_not_left_to_another_decoder() {
        for (marker, factors) in [(0xc9, 0x11), (0xc0, 0x31)] {
            let cut = [sampled_file(marker, 8, factors), vec![0x12, 0x34]].concat();
            let whole = [cut.as_slice(), b"\xff\xd9"].concat();
            let refusal = |file: &[u8]| decode(file, &Limits::default()).err().unwrap();
            assert!(matches!(refusal(&whole), Refusal::Unsupported(_)));
            match refusal(&cut) {
                Refusal::Broken(told) => assert_eq!(told, "truncated JPEG (no end marker)"),
                other => panic!("{other}"),
            }
        }
    }

    #[test]
    fn kinds_that_are_not_ours_are_named_and_not_called_damaged() {
        assert!(frame(0xc0, 8).is_ok() && frame(0xc1, 8).is_ok() && frame(0xc2, 8).is_ok());
        for (marker, bits, kind) in [
            (0xc1, 12, "12 bits a sample, expected 8"),
            (0xc3, 8, "lossless"),
            (0xc5, 8, "hierarchical"),
            (0xc9, 8, "arithmetic coding"),
            (0xca, 8, "arithmetic coding"),
        ] {
            match frame(marker, bits) {
                Err(Refusal::Unsupported(e)) => assert_eq!(e, format!("unsupported JPEG: {kind}")),
                other => panic!("{marker:x}: {other:?}"),
            }
        }
    }

    #[test]
    fn sampling_factors_of_3_are_left_to_another_decoder() {
        for factors in [0x31, 0x13, 0x33] {
            match sampled_frame(0xc0, 8, factors) {
                Err(Refusal::Unsupported(e)) => {
                    assert_eq!(e, "unsupported JPEG: sampling factors of 3");
                }
                other => panic!("{factors:x}: {other:?}"),
            }
        }
        for factors in [0x11, 0x12, 0x21, 0x22, 0x41] {
            assert!(sampled_frame(0xc2, 8, factors).is_ok(), "{factors:x}");
        }
    }

    #[test]
    fn fewer_samples_of_color_are_means_of_their_pixels() {
        let columns: Vec<u8> = [[255, 0, 0], [0, 0, 255]].concat().repeat(16 * 8);
        let file = encode((16, 16), &columns, 100, Chroma::Quarter, &[]).unwrap();
        let Samples::U8(codes) = decode(&file, &Limits::default()).unwrap().samples else {
            panic!("8 bits come back as 8 bits");
        };
        let [red, blue] = [0, 2].map(|channel| {
            let values = codes.iter().skip(channel).step_by(3);
            values.map(|&v| f64::from(v)).sum::<f64>() / 256.0
        });
        assert!((red - blue).abs() < 4.0, "red {red}, blue {blue}");
    }

    #[test]
    fn comments_come_back() {
        let notes = vec![("petcomp:seed".to_string(), "17".to_string())];
        let bytes = encode((8, 8), &[90; 8 * 8 * 3], 90, Chroma::Quarter, &notes).unwrap();
        let start = read_before_scan(&mut &bytes[..], &Limits::default()).unwrap();
        assert!(start.len() < bytes.len());
        let read = header(&start, bytes.len() as u64, &Limits::default()).unwrap();
        assert_eq!(read.metadata, notes);
        assert!(decode(&bytes, &Limits::default()).is_ok());
    }
}
