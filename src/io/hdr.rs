//! Radiance RGBE: scene-linear, read only.

use super::header::Header;
use super::limits::{Demand, Limits, at_most};
use super::raster::{Raster, Refusal, Samples, usual_names};
use crate::io::Format;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use std::io::{Cursor, Read};

/// The header ends in time: its lines are kept, however many and long they are.
fn check_length(start: &[u8], limits: &Limits) -> Result<(), Refusal> {
    match start.windows(2).any(|pair| pair == b"\n\n") {
        true => Ok(()),
        false => Ok(at_most(
            start.len() as u64,
            limits.metadata_bytes,
            "bytes without an end of the header",
            "metadata_bytes",
        )?),
    }
}

fn open<R: Read>(file: R, file_bytes: u64, limits: &Limits) -> Result<HdrDecoder<R>, Refusal> {
    let decoder = HdrDecoder::new(file)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width.into(), height.into());
    limits.check(Demand { width, height, channels: 3, bytes_per_pixel: 12, file_bytes })?;
    Ok(decoder)
}

pub(super) fn header(file: impl Read, file_bytes: u64, limits: &Limits) -> Result<Header, Refusal> {
    let decoder = open(file.take(limits.metadata_bytes), file_bytes, limits)?;
    let (width, height) = decoder.dimensions();
    Ok(Header {
        format: Format::Hdr,
        width: width as usize,
        height: height as usize,
        channels: usual_names(3).unwrap_or_default(),
        bits: 32,
        metadata: decoder.metadata().custom_attributes,
        ..Header::default()
    })
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    check_length(&bytes[..bytes.len().min(limits.metadata_bytes as usize + 1)], limits)?;
    let decoder = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let (width, height) = decoder.dimensions();
    let mut data = vec![0_f32; width as usize * height as usize * 3];
    decoder.read_image(bytemuck::cast_slice_mut(&mut data))?;
    Ok(Raster {
        width: width as usize,
        height: height as usize,
        names: usual_names(3).unwrap_or_default(),
        samples: Samples::F32(data),
        display_encoded: false,
        premultiplied: false,
    })
}
