//! PNG: 8 or 16 bits, display-encoded as the file describes or as sRGB, straight alpha.

use super::codes::Codes;
use super::profile::{ColorDescription, known_code_points};
use super::raster::{Raster, Samples, default_names};
use super::refusal::Refusal;
use crate::color::RgbSpace;
use crate::io::format::Format;
use crate::io::header::{Header, Notes, note};
use crate::io::limits::{Demand, Limits};
use crate::quality::Quality;
use png::{BitDepth, ColorType, Compression, Transformations};
use std::io::{BufRead, Cursor, ErrorKind, Seek};

impl From<png::DecodingError> for Refusal {
    fn from(e: png::DecodingError) -> Self {
        match e {
            png::DecodingError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => {
                Self::Broken("truncated PNG".into())
            }
            e => Self::Broken(format!("damaged PNG: {e}")),
        }
    }
}

/// Reads the file up to its pixels and checks it against the limits.
fn open<R: BufRead + Seek>(
    file: R,
    file_bytes: u64,
    limits: &Limits,
) -> Result<png::Reader<R>, Refusal> {
    let most = png::Limits {
        bytes: usize::try_from(limits.metadata_bytes).unwrap_or(usize::MAX),
    };
    let mut decoder = png::Decoder::new_with_limits(file, most);
    decoder.set_transformations(Transformations::EXPAND);
    decoder.read_header_info()?;
    let reader = decoder.read_info()?;
    limits.check(demand(&reader, file_bytes))?;
    Ok(reader)
}

fn demand<R: BufRead + Seek>(reader: &png::Reader<R>, file_bytes: u64) -> Demand {
    let (color, depth) = reader.output_color_type();
    let (info, channels) = (reader.info(), color.samples() as u64);
    let size = [info.width, info.height];
    Demand::new(size, channels, stored_bits(depth) / 8, file_bytes)
}

/// Bits of a sample after decoding: fewer than 8 are expanded.
fn stored_bits(depth: BitDepth) -> u32 {
    if depth == BitDepth::Sixteen { 16 } else { 8 }
}

pub(crate) fn header(
    file: impl BufRead + Seek,
    file_bytes: u64,
    limits: &Limits,
) -> Result<Header, Refusal> {
    let reader = open(file, file_bytes, limits)?;
    let (info, (color, depth)) = (reader.info(), reader.output_color_type());
    Ok(Header {
        format: Format::Png,
        width: info.width as usize,
        height: info.height as usize,
        channels: default_names(color.samples()).unwrap_or_default(),
        bits: stored_bits(depth),
        metadata: texts(info),
        ..Header::default()
    })
}

fn texts(info: &png::Info<'_>) -> Notes {
    let latin = info.uncompressed_latin1_text.iter();
    let latin = latin.map(|text| note(&text.keyword, &text.text));
    let utf8 = info.utf8_text.iter();
    let utf8 = utf8.filter_map(|text| Some(note(&text.keyword, &text.get_text().ok()?)));
    latin.chain(utf8).collect()
}

/// How the file describes its colours, by the chunk that takes precedence (PNG 3rd edition, 4.3):
/// code points, a profile, sRGB, or the exponent and the primaries. None for sRGB, and without a
/// description. If code points are not supported, a profile in the same file is used.
pub(crate) fn color_description(bytes: &[u8], limits: &Limits) -> Option<ColorDescription> {
    let reader = open(Cursor::new(bytes), bytes.len() as u64, limits).ok()?;
    let info = reader.info();
    if let Some(cicp) = info.coding_independent_code_points {
        let (primaries, transfer) = (cicp.color_primaries, cicp.transfer_function);
        let is_known = known_code_points(primaries, transfer).is_some();
        if is_known || info.icc_profile.is_none() {
            return Some(ColorDescription::CodePoints(primaries, transfer));
        }
    }
    if let Some(icc) = &info.icc_profile {
        return Some(ColorDescription::Icc(icc.to_vec()));
    }
    match info.srgb {
        Some(_) => None,
        None => described_curve(info),
    }
}

/// Whether codes are declared to be in the narrow range of video.
pub(crate) fn has_narrow_range(bytes: &[u8], limits: &Limits) -> bool {
    let reader = open(Cursor::new(bytes), bytes.len() as u64, limits).ok();
    let code_points = reader.and_then(|reader| reader.info().coding_independent_code_points);
    code_points.is_some_and(|cicp| !cicp.is_video_full_range_image)
}

/// The exponent and the primaries, if either is present.
fn described_curve(info: &png::Info<'_>) -> Option<ColorDescription> {
    let gamma = info.gama_chunk.map(|gamma| gamma.into_scaled());
    let exponent = gamma.map(|gamma| SCALED_ONE / f64::from(gamma));
    let primaries = info.chrm_chunk.map(named_space);
    (exponent.is_some() || primaries.is_some()).then_some(ColorDescription::Curve {
        exponent,
        primaries,
    })
}

/// The number stored for 1 in `gAMA` and `cHRM`, which scale by 100,000.
const SCALED_ONE: f64 = 100_000.0;

fn named_space(named: png::SourceChromaticities) -> RgbSpace {
    RgbSpace {
        primaries: [named.red, named.green, named.blue].map(xy),
        white: xy(named.white),
    }
}

fn xy((x, y): (png::ScaledFloat, png::ScaledFloat)) -> [f64; 2] {
    [x, y].map(|v| f64::from(v.into_scaled()) / SCALED_ONE)
}

pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let mut reader = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let (color, depth) = reader.output_color_type();
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let names = default_names(color.samples()).ok_or("channels of an unknown kind")?;
    limits.check_memory(width, height, names.len())?;
    let data = read_data(&mut reader)?;
    let samples = match depth {
        BitDepth::Sixteen => Samples::U16(big_endian_codes(&data)),
        _ => Samples::U8(data),
    };
    Ok(Raster::display_codes((width, height), names, samples))
}

fn read_data<R: BufRead + Seek>(reader: &mut png::Reader<R>) -> Result<Vec<u8>, Refusal> {
    let mut data = vec![0; reader.output_buffer_size().ok_or("size overflows")?];
    reader.next_frame(&mut data)?;
    reader.finish()?;
    Ok(data)
}

fn big_endian_codes(bytes: &[u8]) -> Vec<u16> {
    bytes
        .chunks_exact(2)
        .map(|pair| u16::from_be_bytes([pair[0], pair[1]]))
        .collect()
}

/// Effort of deflate and of the filters before it; the default takes a few milliseconds for 640 x
/// 480.
fn compression(effort: Quality) -> Compression {
    match effort {
        Quality::Draft => Compression::Fastest,
        Quality::Normal => Compression::Fast,
        Quality::Reference => Compression::High,
    }
}

/// A complete file.
pub(crate) fn encode(
    (width, height): (usize, usize),
    channels: usize,
    codes: &Codes,
    effort: Quality,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(color_type(channels));
    encoder.set_compression(compression(effort));
    if channels > 1 {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    add_texts(&mut encoder, metadata)?;
    write_codes(encoder, codes)?;
    Ok(bytes)
}

fn write_codes(
    mut encoder: png::Encoder<'_, &mut Vec<u8>>,
    codes: &Codes,
) -> Result<(), png::EncodingError> {
    match codes {
        Codes::U8(codes) => {
            encoder.set_depth(BitDepth::Eight);
            encoder.write_header()?.write_image_data(codes)
        }
        Codes::U16(codes) => {
            encoder.set_depth(BitDepth::Sixteen);
            let bytes: Vec<u8> = codes.iter().flat_map(|code| code.to_be_bytes()).collect();
            encoder.write_header()?.write_image_data(&bytes)
        }
    }
}

fn color_type(channels: usize) -> ColorType {
    match channels {
        1 => ColorType::Grayscale,
        3 => ColorType::Rgb,
        _ => ColorType::Rgba,
    }
}

/// Adds texts, in Latin-1 if possible.
fn add_texts(
    encoder: &mut png::Encoder<'_, &mut Vec<u8>>,
    metadata: &[(String, String)],
) -> Result<(), png::EncodingError> {
    for (key, value) in metadata.iter().cloned() {
        match value.chars().all(|c| (c as u32) < 256) {
            true => encoder.add_text_chunk(key, value)?,
            false => encoder.add_itxt_chunk(key, value)?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::codec::profile::DisplayProfile;

    /// Light of a middle grey code, in a file to which `colors` adds descriptions.
    fn light(colors: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>)) -> [f32; 3] {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        colors(&mut encoder);
        encoder
            .write_header()
            .unwrap()
            .write_image_data(&[128])
            .unwrap();
        let profile = super::color_description(&bytes, &Limits::default())
            .map_or(Ok(None), DisplayProfile::from_description)
            .unwrap();
        let code = 128.0 / 255.0;
        profile.map_or([crate::color::srgb_to_linear(code); 3], |p| {
            p.light([code; 3])
        })
    }

    #[test]
    fn gamma_is_applied_and_that_of_screens_is_srgb() {
        let code = 128.0_f64 / 255.0;
        for (gama, exponent) in [
            (100_000, 1.0),
            (55_556, 1.8),
            (50_000, 2.0),
            (220_000, 1.0 / 2.2),
            (35_000, 1.0 / 0.35),
        ] {
            let [r, g, b] = light(|e| e.set_source_gamma(png::ScaledFloat::from_scaled(gama)));
            let expected = libm::pow(code, exponent) as f32;
            assert!(
                (r - expected).abs() < 2e-5 && r == g && g == b,
                "{gama}: {r}, expected {expected}"
            );
        }
        for gama in [45_455, 45_454, 45_000] {
            assert_eq!(
                light(|e| e.set_source_gamma(png::ScaledFloat::from_scaled(gama))),
                light(|_| ())
            );
        }
    }

    #[test]
    fn the_word_of_srgb_goes_before_gamma() {
        let both = light(|e| {
            e.set_source_gamma(png::ScaledFloat::from_scaled(100_000));
            e.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        });
        assert_eq!(both, light(|_| ()));
    }

    /// How a picture with or without a profile describes its colours if it also has another chunk.
    fn described(
        icc: &'static [u8],
        name: png::chunk::ChunkType,
        data: &[u8],
    ) -> Option<ColorDescription> {
        color_description(&with_chunk(icc, name, data), &Limits::default())
    }

    fn with_chunk(icc: &'static [u8], name: png::chunk::ChunkType, data: &[u8]) -> Vec<u8> {
        let mut info = png::Info::with_size(1, 1);
        info.icc_profile = (!icc.is_empty()).then_some(icc.into());
        let mut bytes = Vec::new();
        let encoder = png::Encoder::with_info(&mut bytes, info).unwrap();
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(name, data).unwrap();
        writer.write_image_data(&[0]).unwrap();
        drop(writer);
        bytes
    }

    #[test]
    fn code_points_that_are_not_applied_leave_the_word_to_a_profile() {
        let profile = ColorDescription::Icc(b"a profile".to_vec());
        for (code_points, icc, expected) in [
            ([9, 16], &b"a profile"[..], profile),
            ([9, 16], b"", ColorDescription::CodePoints(9, 16)),
            ([12, 13], b"a profile", ColorDescription::CodePoints(12, 13)),
        ] {
            let [primaries, transfer] = code_points;
            let chunk = [primaries, transfer, 0, 1];
            assert_eq!(described(icc, png::chunk::cICP, &chunk), Some(expected));
        }
    }

    #[test]
    fn code_points_of_narrow_range_are_applied_and_told() {
        for (range, is_narrow) in [(0, true), (1, false)] {
            let chunk = [12, 13, 0, range];
            let name = png::chunk::cICP;
            let expected = ColorDescription::CodePoints(12, 13);
            assert_eq!(described(b"", name, &chunk), Some(expected));
            for icc in [&b""[..], b"a profile"] {
                let file = with_chunk(icc, name, &chunk);
                assert_eq!(has_narrow_range(&file, &Limits::default()), is_narrow);
            }
        }
        assert!(!has_narrow_range(
            &with_chunk(b"", png::chunk::sRGB, &[0]),
            &Limits::default()
        ));
    }

    #[test]
    fn a_profile_goes_before_the_word_of_srgb() {
        let profile = ColorDescription::Icc(b"a profile".to_vec());
        assert_eq!(
            described(b"a profile", png::chunk::sRGB, &[0]),
            Some(profile)
        );
        assert_eq!(described(b"", png::chunk::sRGB, &[0]), None);
    }

    #[test]
    fn primaries_are_converted() {
        let chunk = |at: [f32; 8]| {
            png::SourceChromaticities::new(
                (at[0], at[1]),
                (at[2], at[3]),
                (at[4], at[5]),
                (at[6], at[7]),
            )
        };
        let p3 = chunk([0.3127, 0.329, 0.68, 0.32, 0.265, 0.69, 0.15, 0.06]);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_source_chromaticities(p3);
        encoder
            .write_header()
            .unwrap()
            .write_image_data(&[0])
            .unwrap();
        let profile = color_description(&bytes, &Limits::default())
            .map(DisplayProfile::from_description)
            .unwrap()
            .unwrap()
            .unwrap();
        // Display P3 red in Rec. 709.
        let red = profile.light([1.0, 0.0, 0.0]);
        for (v, expected) in red.iter().zip([1.224_94, -0.042_06, -0.019_64]) {
            assert!((v - expected).abs() < 1e-3, "{red:?}");
        }
        let same = chunk([0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06]);
        assert_eq!(light(|e| e.set_source_chromaticities(same)), light(|_| ()));
    }
}
