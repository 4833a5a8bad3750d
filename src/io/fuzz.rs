//! Entry points of the fuzzers: no panic is caught.

use super::decode::read_file_header;
use super::format::Format;
use super::header::Header;
use super::limits::Limits;
#[cfg(feature = "oiio")]
use super::worker::{receive_samples, receive_shape};
use std::io::Cursor;

/// The header of a file in memory.
pub(crate) fn header_of(bytes: &[u8]) -> Result<Header, String> {
    let format = Format::from_bytes(bytes).ok_or("no picture")?;
    let length = bytes.len() as u64;
    read_file_header(&mut Cursor::new(bytes), length, format, &Limits::default())
        .map(|(header, _)| header)
        .map_err(|e| e.to_string())
}

/// Whether the bytes are a complete response of a worker.
#[cfg(feature = "oiio")]
pub(crate) fn is_worker_response(bytes: &[u8]) -> bool {
    let mut from = bytes;
    match receive_shape(&mut from, &Limits::default(), bytes.len() as u64) {
        Ok(Ok(shape)) => receive_samples(&mut from, shape).is_ok(),
        _ => false,
    }
}
