//! Kinds of file that petcomp does not write, by another program (`files/make.py`): both ways of
//! reading agree on each.

use crate::make::file;
use petcomp::io::{self, ReadOptions};
use petcomp::{Image, Srgb8, StraightRgba, color};

/// Codes by which decoders of the same JPEG may differ (see `both_paths`), and by which CMYK may be
/// rounded.
const JPEG: u8 = 2;
const CMYK: u8 = 1;

const FILES: [(&str, u8); 15] = [
    ("cmyk.jpg", JPEG + CMYK),
    ("cmyk.tif", CMYK),
    ("deflate.tif", 0),
    ("grey.tif", 0),
    ("grey16.png", 0),
    ("grey_alpha.png", 0),
    ("jpeg.tif", JPEG),
    ("lzw.tif", 0),
    ("one_bit.png", 0),
    ("packbits.tif", 0),
    ("palette.png", 0),
    ("palette.tif", 0),
    ("progressive.jpg", JPEG),
    // Colour of half the size, which each decoder enlarges in its own way.
    ("subsampled.jpg", 2 * JPEG),
    ("rgba.png", 0),
];

/// Display codes, alpha with them.
fn codes(image: Image<StraightRgba>) -> Vec<[u8; 4]> {
    let code = |p: &StraightRgba| {
        let Srgb8 { r, g, b } = color::encode_srgb8([p.r, p.g, p.b].into());
        [r, g, b, (p.a * 255.0).round() as u8]
    };
    image.pixels().iter().map(code).collect()
}

fn codes_of(name: &str) -> Vec<[u8; 4]> {
    codes(io::read(file(name)).unwrap())
}

#[test]
fn both_ways_of_reading_agree_on_every_kind() {
    let mut wrong = Vec::new();
    for (name, tolerance) in FILES {
        let ours = codes_of(name);
        let theirs = codes(io::read_in_worker(file(name), &ReadOptions::default()).unwrap());
        let worst = ours
            .iter()
            .flatten()
            .zip(theirs.iter().flatten())
            .map(|(p, q)| p.abs_diff(*q))
            .max();
        println!("{name}: apart by {worst:?}");
        if worst.is_none_or(|worst| worst > tolerance) || ours.len() != 24 * 16 {
            wrong.push(format!("{name}: {worst:?}"));
        }
        let header = io::read_header(file(name)).unwrap();
        assert_eq!((header.width, header.height), (24, 16), "{name}");
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Pillow writes the codes of a palette times 256 into a TIFF.
#[test]
fn a_palette_has_the_same_colours_in_every_file() {
    assert_eq!(codes_of("palette.tif"), codes_of("palette.png"));
}

/// The picture that was written, in those kinds that lose nothing.
#[test]
fn what_was_written_is_what_is_read() {
    for name in ["rgba.png", "lzw.tif", "deflate.tif", "packbits.tif"] {
        for (i, code) in codes_of(name).into_iter().enumerate() {
            let (x, y) = (i % 24, i / 24);
            let (red, green) = (255 * x / 23, 255 * y / 15);
            let expected = [red, green, (x * 11 + y * 7) % 256, green].map(|v| v as u8);
            assert_eq!(code, expected, "{name} {x} {y}");
        }
    }
}

/// Pillow leaves the number of bits to the default, which OpenImageIO does not know.
#[test]
fn a_tiff_that_does_not_state_its_bits_has_one() {
    assert_eq!(codes_of("one_bit.tif"), codes_of("one_bit.png"));
}

/// Inks multiply: a colour is what cyan and black leave of red, and so on.
#[test]
fn cmyk_is_what_the_inks_leave() {
    for name in ["cmyk.tif", "cmyk.jpg"] {
        for (i, code) in codes_of(name).iter().enumerate() {
            let expected = [255 * (i % 24) / 23, 255 * (i / 24) / 15, 128].map(|v| v as u8);
            let apart = code.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
            assert!(
                apart <= Some(JPEG + 2 * CMYK),
                "{name} {i}: {code:?}, expected {expected:?}"
            );
        }
    }
}
