//! Small pictures and files for the tests.

use petcomp::io::{Bits, WriteOptions};
use petcomp::{Image, PremulRgba, Srgb8, Srgba8};
use std::path::{Path, PathBuf};

/// A picture that another program wrote (`files/`).
pub(crate) fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/io/files")
        .join(name)
}

/// A folder of one test, gone when it ends.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// A file of these bytes.
    pub(crate) fn with(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.file(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

pub(crate) fn with_bits(bits: Bits) -> WriteOptions {
    WriteOptions {
        bits: Some(bits),
        ..Default::default()
    }
}

/// Every combination of a smooth colour and a few alphas.
pub(crate) fn codes(width: usize, height: usize) -> Image<Srgba8> {
    Image::from_fn(width, height, |x, y| Srgba8 {
        r: (x * 255 / width) as u8,
        g: (y * 255 / height) as u8,
        b: ((x + y) * 255 / (width + height)) as u8,
        a: [255, 128, 1, 0, 254][(x + 3 * y) % 5],
    })
}

/// The same colours, opaque.
pub(crate) fn opaque_codes(width: usize, height: usize) -> Image<Srgb8> {
    codes(width, height).map(|Srgba8 { r, g, b, .. }| Srgb8 { r, g, b })
}

/// Scene-linear, with values above 1 and below 0, premultiplied.
pub(crate) fn light(width: usize, height: usize) -> Image<PremulRgba> {
    Image::from_fn(width, height, |x, y| {
        let a = [1.0, 0.5, 0.25, 0.0][(x + 3 * y) % 4];
        PremulRgba::new(a * (x as f32 / 3.0 - 0.5), a * y as f32 * 0.7, a * 0.18, a)
    })
}

/// EXIF data with an orientation and a focal length for 35 mm film (tags 0x0112 and 0xA405).
pub(crate) fn exif(orientation: u8, focal: u8) -> Vec<u8> {
    let mut tiff = b"MM\0*\0\0\0\x08".to_vec();
    tiff.extend([0, 2]);
    tiff.extend([0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0]);
    tiff.extend([0x87, 0x69, 0, 4, 0, 0, 0, 1, 0, 0, 0, 38]);
    tiff.extend([0, 0, 0, 0]);
    tiff.extend([0, 1]);
    tiff.extend([0xa4, 0x05, 0, 3, 0, 0, 0, 1, 0, focal, 0, 0]);
    tiff.extend([0, 0, 0, 0]);
    tiff
}

/// A TIFF tag: number, kind, count, value.
pub(crate) type Tag = (u16, u16, u32, u32);

/// A TIFF of one 8-bit grey row out of raw tags; the strip lies behind them.
pub(crate) fn tiff(tags: &[Tag], strip: &[u8]) -> Vec<u8> {
    let mut out = b"II*\0\x08\0\0\0".to_vec();
    out.extend((tags.len() as u16).to_le_bytes());
    for &(tag, kind, count, value) in tags {
        out.extend(tag.to_le_bytes());
        out.extend(kind.to_le_bytes());
        out.extend(count.to_le_bytes());
        out.extend(value.to_le_bytes());
    }
    out.extend([0; 4]);
    out.extend(strip);
    out
}

/// Where the strip of a [`tiff`] of so many tags begins.
pub(crate) fn behind(tags: usize) -> u32 {
    8 + 2 + 12 * tags as u32 + 4
}

/// A TIFF of two palette colours.
pub(crate) fn palette_tiff() -> Vec<u8> {
    let tags = [
        (256, 3, 1, 2),
        (257, 3, 1, 1),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 3),
        (273, 4, 1, behind(9) + 1536),
        (278, 3, 1, 1),
        (279, 4, 1, 2),
        (320, 3, 768, behind(9)),
    ];
    let mut palette = [0_u16; 768];
    (palette[0], palette[256 + 1], palette[512 + 1]) = (0xffff, 0x8080, 0xffff);
    let strip: Vec<u8> = palette
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .chain([0, 1])
        .collect();
    tiff(&tags, &strip)
}
