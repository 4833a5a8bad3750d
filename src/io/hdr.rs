//! Radiance RGBE: scene-linear, read only.

use super::header::Header;
use super::limits::{Demand, Limits};
use super::raster::{Raster, Refusal, Samples, usual_names};
use crate::io::Format;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use std::io::Cursor;

fn open<'a>(bytes: &'a [u8], limits: &Limits) -> Result<HdrDecoder<Cursor<&'a [u8]>>, Refusal> {
    let decoder = HdrDecoder::new(Cursor::new(bytes))?;
    let (width, height) = decoder.dimensions();
    let (width, height, file_bytes) = (width.into(), height.into(), bytes.len() as u64);
    limits.check(Demand { width, height, channels: 3, bytes_per_pixel: 12, file_bytes })?;
    Ok(decoder)
}

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<Header, Refusal> {
    let decoder = open(bytes, limits)?;
    let (width, height) = decoder.dimensions();
    Ok(Header {
        format: Format::Hdr,
        width: width as usize,
        height: height as usize,
        channels: usual_names(3).unwrap_or_default(),
        bits: 32,
        focal_35mm: None,
        digital_zoom: false,
        cropped: false,
        metadata: decoder.metadata().custom_attributes,
    })
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Raster, Refusal> {
    let decoder = open(bytes, limits)?;
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
