//! Files byte by byte: what no writer would write.

use crate::make::{Tag, behind};
use flate2::{Compression, write::ZlibEncoder};
use std::io::Write;

/// A chunk of a PNG: kind and data.
pub(crate) type Chunk = (&'static [u8; 4], Vec<u8>);

/// A PNG of these chunks.
pub(crate) fn png(chunks: &[Chunk]) -> Vec<u8> {
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    for (kind, data) in chunks {
        out.extend((data.len() as u32).to_be_bytes());
        let start = out.len();
        out.extend(*kind);
        out.extend(data);
        let crc = crc32fast::hash(&out[start..]);
        out.extend(crc.to_be_bytes());
    }
    out
}

#[test]
fn checksums_of_chunks_are_those_of_png() {
    // The check value of CRC-32 (ISO 3309).
    assert_eq!(crc32fast::hash(b"123456789"), 0xcbf4_3926);
}

/// `IHDR`: size, bits, colour kind, interlacing.
pub(crate) fn ihdr(width: u32, height: u32, bits: u8, color: u8, interlace: u8) -> Chunk {
    let mut data = [width.to_be_bytes(), height.to_be_bytes()].concat();
    data.extend([bits, color, 0, 0, interlace]);
    (b"IHDR", data)
}

/// So many times these bytes as zlib data.
fn zlib(bytes: &[u8], times: usize, level: Compression) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), level);
    (0..times).for_each(|_| encoder.write_all(bytes).unwrap());
    encoder.finish().unwrap()
}

/// Zlib data out of stored (uncompressed) blocks.
pub(crate) fn stored(data: &[u8]) -> Vec<u8> {
    zlib(data, 1, Compression::none())
}

pub(crate) fn deflated(data: &[u8]) -> Vec<u8> {
    zlib(data, 1, Compression::best())
}

/// Megabytes of zeros, compressed.
pub(crate) fn zeros(megabytes: usize) -> Vec<u8> {
    zlib(&[0; 1 << 20], megabytes, Compression::best())
}

/// A file with the bytes at a place replaced.
pub(crate) fn with(file: &[u8], at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut out = file.to_vec();
    out[at..at + bytes.len()].copy_from_slice(bytes);
    out
}

/// Where a text begins.
pub(crate) fn find(file: &[u8], text: &[u8]) -> usize {
    file.windows(text.len())
        .position(|w| w == text)
        .unwrap_or_else(|| panic!("{:?}", String::from_utf8_lossy(text)))
}

/// Where the places of an EXR's blocks are: behind the zero that ends its attributes.
pub(crate) fn end_of_attributes(file: &[u8]) -> usize {
    let text = |at: usize| at + file[at..].iter().position(|&b| b == 0).unwrap() + 1;
    let mut at = 8;
    while file[at] != 0 {
        let size = text(text(at));
        at = size + 4 + u32::from_le_bytes(*file[size..].first_chunk().unwrap()) as usize;
    }
    at + 1
}

/// An EXR file with bytes of an attribute's value replaced, from `at` on.
pub(crate) fn attribute(file: &[u8], name_and_kind: &str, at: usize, bytes: &[u8]) -> Vec<u8> {
    let value = find(file, name_and_kind.as_bytes()) + name_and_kind.len() + 4;
    with(file, value + at, bytes)
}

/// A JPEG segment.
pub(crate) fn segment(marker: u8, data: &[u8]) -> Vec<u8> {
    let mut out = vec![0xff, marker];
    out.extend((data.len() as u16 + 2).to_be_bytes());
    out.extend(data);
    out
}

/// A file with bytes put in.
pub(crate) fn inserted(file: &[u8], at: usize, bytes: &[u8]) -> Vec<u8> {
    [&file[..at], bytes, &file[at..]].concat()
}

/// Tags of a grey 8-bit picture of one strip, some of them replaced or added.
pub(crate) fn tags(width: u32, height: u32, others: &[Tag]) -> Vec<Tag> {
    let mut all: Vec<Tag> = vec![
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, 0),
        (277, 3, 1, 1),
        (278, 4, 1, height),
        (279, 4, 1, width.saturating_mul(height).min(1 << 20)),
    ];
    for other in others {
        all.retain(|tag| tag.0 != other.0);
        all.push(*other);
    }
    all.sort_unstable();
    let strip = behind(all.len());
    all.iter_mut()
        .filter(|tag| tag.0 == 273 && tag.3 == 0)
        .for_each(|tag| tag.3 = strip);
    all
}
