//! PNG: 8 or 16 bits, display-encoded unless the file says that its gamma is 1, straight alpha.

use super::header::{Header, Notes, note};
use super::limits::{Demand, Limits};
use super::raster::{Raster, Refusal, Samples, usual_names};
use super::write::{Coded, Codes, PngEffort};
use crate::io::Format;
use png::{BitDepth, ColorType, Transformations};
use std::io::{BufRead, Cursor, Seek};

impl From<png::DecodingError> for Refusal {
    fn from(e: png::DecodingError) -> Self {
        let cut = matches!(&e, png::DecodingError::IoError(io) if io.kind() == std::io::ErrorKind::UnexpectedEof);
        Self::Broken(if cut { "truncated PNG".into() } else { format!("damaged PNG: {e}") })
    }
}

/// The file up to its pixels, checked against the limits.
fn open<R: BufRead + Seek>(file: R, file_bytes: u64, limits: &Limits) -> Result<png::Reader<R>, Refusal> {
    let most = png::Limits { bytes: usize::try_from(limits.metadata_bytes).unwrap_or(usize::MAX) };
    let mut decoder = png::Decoder::new_with_limits(file, most);
    decoder.set_transformations(Transformations::EXPAND);
    decoder.read_header_info()?;
    let reader = decoder.read_info()?;
    let (color, depth) = reader.output_color_type();
    let channels = color.samples() as u64;
    let (width, height) = (u64::from(reader.info().width), u64::from(reader.info().height));
    let bytes_per_pixel = channels * if depth == BitDepth::Sixteen { 2 } else { 1 };
    limits.check(Demand { width, height, channels, bytes_per_pixel, file_bytes })?;
    Ok(reader)
}

pub(super) fn header(file: impl BufRead + Seek, file_bytes: u64, limits: &Limits) -> Result<Header, Refusal> {
    let reader = open(file, file_bytes, limits)?;
    let (info, (color, depth)) = (reader.info(), reader.output_color_type());
    let mut metadata: Notes = Vec::new();
    metadata.extend(info.uncompressed_latin1_text.iter().map(|t| note(&t.keyword, &t.text)));
    metadata.extend(info.utf8_text.iter().filter_map(|t| Some(note(&t.keyword, &t.get_text().ok()?))));
    Ok(Header {
        format: Format::Png,
        width: info.width as usize,
        height: info.height as usize,
        channels: usual_names(color.samples()).unwrap_or_default(),
        bits: if depth == BitDepth::Sixteen { 16 } else { 8 },
        metadata,
        ..Header::default()
    })
}

/// The embedded colour profile; a chunk that names sRGB goes before it (PNG 3rd edition, 4.3).
pub(super) fn profile(bytes: &[u8], limits: &Limits) -> Option<Vec<u8>> {
    let reader = open(Cursor::new(bytes), bytes.len() as u64, limits).ok()?;
    let info = reader.info();
    if info.srgb.is_some() { None } else { Some(info.icc_profile.as_ref()?.to_vec()) }
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let mut reader = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let (color, depth) = reader.output_color_type();
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let names = usual_names(color.samples()).ok_or("channels of an unknown kind")?;
    let mut data = vec![0; reader.output_buffer_size().ok_or("size overflows")?];
    reader.next_frame(&mut data)?;
    let display_encoded = !is_linear(reader.info());
    reader.finish()?;
    let samples = match depth {
        BitDepth::Sixteen => {
            Samples::U16(data.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect())
        }
        _ => Samples::U8(data),
    };
    Ok(Raster { width, height, names, samples, display_encoded, premultiplied: false })
}

/// The file says itself that its samples are light: gamma 1 and no word of sRGB.
fn is_linear(info: &png::Info<'_>) -> bool {
    info.srgb.is_none() && info.gama_chunk.is_some_and(|gamma| gamma.into_scaled() == 100_000)
}

/// A whole file; the fast compression takes a few milliseconds for 640 x 480.
pub(super) fn encode(picture: &Coded<'_>, effort: PngEffort, metadata: &[(String, String)]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    write(&mut bytes, picture, effort, metadata).map_err(|e| e.to_string())?;
    Ok(bytes)
}

fn write(
    out: &mut Vec<u8>,
    picture: &Coded<'_>,
    effort: PngEffort,
    metadata: &[(String, String)],
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, picture.width as u32, picture.height as u32);
    encoder.set_color(match picture.names.len() {
        1 => ColorType::Grayscale,
        3 => ColorType::Rgb,
        _ => ColorType::Rgba,
    });
    encoder.set_compression(effort.of_png());
    if picture.names.len() > 1 {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    for (key, value) in metadata {
        match value.chars().all(|c| (c as u32) < 256) {
            true => encoder.add_text_chunk(key.clone(), value.clone())?,
            false => encoder.add_itxt_chunk(key.clone(), value.clone())?,
        }
    }
    match &picture.codes {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gamma_of_one_means_linear_samples() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_source_gamma(png::ScaledFloat::from_scaled(100_000));
        encoder.write_header().unwrap().write_image_data(&[128]).unwrap();
        assert!(!decode(&bytes, &Limits::default()).unwrap().display_encoded);
    }
}
