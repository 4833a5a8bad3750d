//! Kinds of valid file that few programs write: they are read, and read right, or named for what
//! they are.

use crate::build::{Chunk, deflated, ihdr, png, stored};
use crate::make::{Folder, Tag, behind, file, tiff};
use half::f16;
use petcomp::io::exr::{ChannelSamples, Part, write_parts};
use petcomp::io::{self, exr::write_channels};
use petcomp::{Coverage, Depth, Image, LinearRgb, PremulRgba, Srgb8, color};
use std::path::Path;

/// Tags of strips, and of tiles: where they lie and how long they are.
const STRIPS: [u16; 2] = [273, 279];
const TILES: [u16; 2] = [324, 325];

/// A TIFF out of what it says of its size and samples, other tags, and several strips or tiles.
fn in_pieces(
    about: &[Tag],
    others: &[Tag],
    [offsets, counts]: [u16; 2],
    pieces: &[Vec<u8>],
) -> Vec<u8> {
    let mut all = [about, others].concat();
    let (n, start) = (pieces.len() as u32, behind(all.len() + 2));
    let lists = if n > 1 { 8 * n } else { 0 };
    let ends: Vec<u32> = pieces
        .iter()
        .scan(start + lists, |at, p| {
            Some(std::mem::replace(at, *at + p.len() as u32))
        })
        .collect();
    let lengths: Vec<u32> = pieces.iter().map(|p| p.len() as u32).collect();
    let inline = |list: &[u32], at: u32| if n > 1 { at } else { list[0] };
    all.extend([
        (offsets, 4, n, inline(&ends, start)),
        (counts, 4, n, inline(&lengths, start + 4 * n)),
    ]);
    all.sort_unstable();
    let lists = ends
        .iter()
        .chain(&lengths)
        .filter(|_| n > 1)
        .flat_map(|v| v.to_le_bytes());
    tiff(&all, &lists.chain(pieces.concat()).collect::<Vec<u8>>())
}

/// What every TIFF says of its size and samples.
fn about(width: u32, height: u32, bits: u32, channels: u32) -> Vec<Tag> {
    let kind = if channels < 3 { 1 } else { 2 };
    vec![
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, bits),
        (262, 3, 1, kind),
        (277, 3, 1, channels),
    ]
}

/// A code for a place and a channel.
fn code(x: usize, y: usize, c: usize) -> u8 {
    (40 * x + 7 * y + 80 * c) as u8
}

fn codes_of(path: &Path) -> Image<Srgb8> {
    io::read::<LinearRgb>(path)
        .unwrap()
        .map(color::encode_srgb8)
}

fn assert_codes(path: &Path, size: (usize, usize)) {
    let read = codes_of(path);
    assert_eq!(read.size(), size);
    let expected = Image::from_fn(size.0, size.1, |x, y| Srgb8 {
        r: code(x, y, 0),
        g: code(x, y, 1),
        b: code(x, y, 2),
    });
    assert_eq!(read.pixels(), expected.pixels(), "{}", path.display());
}

/// As caspian.tif of libtiff's sample pictures: OpenImageIO cannot go back from the last row of a
/// plane to the next of the first.
#[test]
fn compressed_planes_of_a_tiff_are_read() {
    let folder = Folder::new();
    let strip = |c: usize, rows: std::ops::Range<usize>| {
        rows.flat_map(move |y| (0..5).map(move |x| code(x, y, c)))
    };
    let strips = (0..3)
        .flat_map(|c| [0..4, 4..6].map(|rows| deflated(&strip(c, rows).collect::<Vec<_>>())))
        .collect::<Vec<_>>();
    let planes = [(259, 3, 1, 8), (278, 3, 1, 4), (284, 3, 1, 2)];
    let made = in_pieces(&about(5, 6, 8, 3), &planes, STRIPS, &strips);
    assert_codes(&folder.with("planes.tif", &made), (5, 6));

    let doubles = |c: usize| {
        (0..30)
            .flat_map(move |i| (f64::from(i) + 0.25 * c as f64).to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let more = [
        (259, 3, 1, 8),
        (278, 3, 1, 6),
        (284, 3, 1, 2),
        (339, 3, 1, 3),
    ];
    let strips = [0, 1, 2].map(|c| deflated(&doubles(c)));
    let made = in_pieces(&about(5, 6, 64, 3), &more, STRIPS, &strips);
    let read = io::read::<LinearRgb>(folder.with("doubles.tif", &made)).unwrap();
    assert_eq!(read[(3, 2)], LinearRgb::new(13.0, 13.25, 13.5));
}

/// No compression, tiles of 16 x 16.
const TILED: [Tag; 3] = [(259, 3, 1, 1), (322, 3, 1, 16), (323, 3, 1, 16)];

/// The codes of a tile.
fn tile(left: usize, channels: usize) -> Vec<u8> {
    let places = (0..16 * 16).map(|i| (left + i % 16, i / 16));
    places
        .flat_map(|(x, y)| (0..channels).map(move |c| code(x, y, c)))
        .collect()
}

/// Tiles of 16 x 16 for a picture of 5 x 6: what reaches over is cut, and no column stays black.
#[test]
fn tiles_larger_than_the_picture_are_cut() {
    let folder = Folder::new();
    for (width, tiles) in [(5, vec![tile(0, 3)]), (19, vec![tile(0, 3), tile(16, 3)])] {
        let made = in_pieces(&about(width, 6, 8, 3), &TILED, TILES, &tiles);
        let path = folder.with(&format!("{width}.tif"), &made);
        assert_codes(&path, (width as usize, 6));
    }
}

/// Codes of nine bits; the table begins anew before they become longer.
fn lzw(bytes: &[u8]) -> Vec<u8> {
    let parts = bytes.chunks(200);
    let codes = parts.flat_map(|part| [256].into_iter().chain(part.iter().copied().map(u16::from)));
    let codes = codes.chain([257]);
    let bits: Vec<u8> = codes
        .flat_map(|code| (0..9).rev().map(move |i| (code >> i & 1) as u8))
        .collect();
    let packed =
        |bits: &[u8]| bits.iter().fold(0_u8, |sum, bit| sum << 1 | bit) << (8 - bits.len());
    bits.chunks(8).map(packed).collect()
}

/// Our decoder takes the last codes of such a tile for missing.
#[test]
fn tiles_of_lzw_that_reach_over_the_border_are_read() {
    let folder = Folder::new();
    let tags = [(259, 3, 1, 5), (322, 3, 1, 16), (323, 3, 1, 16)];
    let made = in_pieces(&about(13, 16, 8, 1), &tags, TILES, &[lzw(&tile(0, 1))]);
    let read = codes_of(&folder.with("lzw.tif", &made));
    assert_eq!(read.size(), (13, 16));
    for (i, code) in read.pixels().iter().enumerate() {
        assert_eq!(code.g, self::code(i % 13, i / 13, 0), "{i}");
    }
    let cut = folder.with("cut.tif", &made[..made.len() - 1]);
    let e = io::read::<LinearRgb>(cut).unwrap_err().to_string();
    assert!(e.ends_with("truncated TIFF"), "{e}");
}

/// Nothing is missing of a picture without compression whose strip is stated too long.
#[test]
fn a_strip_that_is_stated_too_long_is_read() {
    let folder = Folder::new();
    let strip: Vec<u8> = (0..=255).collect();
    let tags = [(259, 3, 1, 1), (278, 3, 1, 16)];
    let made = in_pieces(&about(16, 16, 4, 1), &tags, STRIPS, &[strip]);
    let whole = codes_of(&folder.with("whole.tif", &made));
    let ends_early = codes_of(&folder.with("early.tif", &made[..made.len() - 128]));
    assert_eq!(ends_early.pixels(), whole.pixels());
}

/// As quad-tile.tif and cramps-tile.tif of libtiff's sample pictures: what is in tiles stands under
/// the tags of strips.
#[test]
fn tiles_under_the_tags_of_strips_are_read() {
    let folder = Folder::new();
    // The number of tiles is that of strips, too, in the second one.
    for (width, tiles) in [(19, vec![tile(0, 1), tile(16, 1)]), (5, vec![tile(0, 1)])] {
        let made = in_pieces(&about(width, 6, 8, 1), &TILED, STRIPS, &tiles);
        let read = codes_of(&folder.with("tiles.tif", &made));
        for (i, code) in read.pixels().iter().enumerate() {
            assert_eq!(
                code.g,
                self::code(i % width as usize, i / width as usize, 0),
                "{width}: {i}"
            );
        }
    }
}

/// Integers are display-encoded, whether they have a sign or not.
#[test]
fn signed_and_long_integers_of_a_tiff_are_display_codes() {
    let folder = Folder::new();
    let expected = color::srgb_to_linear(0.5);
    let values: [(&str, u32, u32, Vec<u8>); 4] = [
        ("int8.tif", 8, 2, 64_i8.to_le_bytes().to_vec()),
        ("int16.tif", 16, 2, 16_384_i16.to_le_bytes().to_vec()),
        ("int32.tif", 32, 2, (1_i32 << 30).to_le_bytes().to_vec()),
        ("uint32.tif", 32, 1, (1_u32 << 31).to_le_bytes().to_vec()),
    ];
    for (name, bits, format, value) in values {
        let more = [(259, 3, 1, 1), (278, 3, 1, 1), (339, 3, 1, format)];
        let made = in_pieces(&about(1, 1, bits, 1), &more, STRIPS, &[value]);
        let read = io::read::<LinearRgb>(folder.with(name, &made)).unwrap();
        assert!(
            (read[(0, 0)].g - expected).abs() < 0.005,
            "{name}: {read:?}, expected {expected}"
        );
    }
}

#[test]
fn old_lzw_and_bits_from_the_lowest_up_are_left_to_openimageio() {
    let folder = Folder::new();
    let read = |name: &str, more: &[Tag], strip: &[u8]| {
        let made = in_pieces(&about(1, 1, 8, 1), more, STRIPS, &[strip.to_vec()]);
        codes_of(&folder.with(name, &made))[(0, 0)].g
    };
    // The codes 256 (begin), 200 and 257 (end), nine bits each, from the lowest bit up.
    let codes = 256_u32 | 200 << 9 | 257 << 18;
    let old = [(259, 3, 1, 5), (278, 3, 1, 1)];
    assert_eq!(read("old.tif", &old, &codes.to_le_bytes()), 200);
    let turned = [(259, 3, 1, 1), (266, 3, 1, 2), (278, 3, 1, 1)];
    assert_eq!(read("turned.tif", &turned, &[0b0000_0011]), 0b1100_0000);
}

#[test]
fn a_fax_that_does_not_state_its_bits_is_no_noise() {
    let folder = Folder::new();
    let mut tags = about(8, 1, 1, 1);
    tags.retain(|tag| tag.0 != 258);
    let fax = [(259, 3, 1, 3), (278, 3, 1, 1)];
    let fax = folder.with("fax.tif", &in_pieces(&tags, &fax, STRIPS, &[vec![0; 8]]));
    let e = io::read::<LinearRgb>(fax).unwrap_err().to_string();
    assert!(
        e.contains("fax.tif: unsupported TIFF") && !e.contains("OpenImageIO"),
        "{e}"
    );
}

#[test]
fn grey_tiffs_have_alpha() {
    let folder = Folder::new();
    let alpha = [(259, 3, 1, 1), (278, 3, 1, 1), (338, 3, 1, 2)];
    let strip = vec![255, 51, 255, 255];
    let made = in_pieces(&about(2, 1, 8, 2), &alpha, STRIPS, &[strip]);
    let read = io::read::<PremulRgba>(folder.with("a.tif", &made)).unwrap();
    assert_eq!(read[(0, 0)], PremulRgba::new(0.2, 0.2, 0.2, 0.2));
    assert_eq!(read[(1, 0)], PremulRgba::new(1.0, 1.0, 1.0, 1.0));
}

/// Arithmetic coding is read by OpenImageIO; 12 bits by neither, which is not the file's fault.
#[test]
fn other_kinds_of_jpeg_are_read_or_named() {
    let [arithmetic, other] =
        ["arithmetic.jpg", "progressive.jpg"].map(|name| codes_of(&file(name)));
    let apart = |(p, q): (&Srgb8, &Srgb8)| {
        p.r.abs_diff(q.r)
            .max(p.g.abs_diff(q.g))
            .max(p.b.abs_diff(q.b))
    };
    let worst = arithmetic
        .pixels()
        .iter()
        .zip(other.pixels())
        .map(apart)
        .max();
    assert!(
        arithmetic.size() == (24, 16) && worst <= Some(2),
        "{worst:?}"
    );
    assert_eq!(
        io::read_header(file("arithmetic.jpg")).unwrap().channels,
        ["R", "G", "B"]
    );
    let e = io::read::<LinearRgb>(file("twelve_bits.jpg"))
        .unwrap_err()
        .to_string();
    assert!(
        e.contains(
            "twelve_bits.jpg: unsupported JPEG: 12 bits a sample, expected 8 (OpenImageIO: "
        ),
        "{e}"
    );
}

/// A grey pixel of code 128, with chunks before it.
fn grey_png(chunks: &[Chunk]) -> Vec<u8> {
    let data = [(b"IDAT", stored(&[0, 128])), (b"IEND", vec![])];
    png(&[&[ihdr(1, 1, 8, 0, 0)], chunks, &data].concat())
}

#[test]
fn what_a_png_says_of_its_gamma_is_done() {
    let folder = Folder::new();
    let light = |gama: u32| {
        let path = folder.with(
            "a.png",
            &grey_png(&[(b"gAMA", gama.to_be_bytes().to_vec())]),
        );
        (
            io::read::<LinearRgb>(&path).unwrap()[(0, 0)].g,
            io::read::<Coverage>(&path).unwrap()[(0, 0)].0,
        )
    };
    let code = 128.0_f32 / 255.0;
    let (srgb, matte) = light(45_455);
    assert!(
        (srgb - color::srgb_to_linear(code)).abs() < 1e-6 && matte == code,
        "{srgb} {matte}"
    );
    let ((linear, matte), (mac, _)) = (light(100_000), light(55_556));
    assert_eq!(matte, code, "a matte is never decoded");
    assert!(
        (linear - code).abs() < 1e-6 && (mac - code.powf(1.8)).abs() < 1e-4,
        "{linear} {mac}"
    );
}

#[test]
fn layers_of_an_exr_are_found_by_name_and_single_channels_are_grey() {
    let folder = Folder::new();
    let path = folder.file("a.exr");
    let values: Vec<f32> = (0..7).map(|v| v as f32).collect();
    let read = |names: &[&str]| {
        let channels = names.iter().zip(&values);
        let channels: Vec<_> = channels.map(|(n, v)| (*n, vec![*v])).collect();
        write_channels(&path, (1, 1), io::Canvas::default(), channels, &[]).unwrap();
        io::read::<PremulRgba>(&path)
            .map(|image| image[(0, 0)])
            .map_err(|e| e.to_string())
    };
    assert_eq!(
        read(&["diffuse.R", "diffuse.G", "diffuse.B"]),
        Ok(PremulRgba::new(0.0, 1.0, 2.0, 1.0))
    );
    let blender = [
        "V.Alb.R",
        "V.Alb.G",
        "V.Alb.B",
        "V.Combined.R",
        "V.Combined.G",
        "V.Combined.B",
        "V.Combined.A",
    ];
    assert_eq!(read(&blender), Ok(PremulRgba::new(3.0, 4.0, 5.0, 6.0)));
    assert_eq!(
        read(&["Z", "mask"]),
        Ok(PremulRgba::new(1.0, 1.0, 1.0, 1.0))
    );
    assert_eq!(read(&["Z"]), Ok(PremulRgba::new(0.0, 0.0, 0.0, 1.0)));
    assert!(
        read(&["u", "v"])
            .unwrap_err()
            .contains("has the channels u v, expected R G B or Y")
    );
    assert!(io::read::<Depth>(&path).is_err());
}

#[test]
fn the_part_with_colours_is_taken_wherever_it_stands() {
    let folder = Folder::new();
    let path = folder.file("a.exr");
    let part = |name: &str, channels: &[(&str, f32)]| Part {
        name: name.into(),
        channels: channels
            .iter()
            .map(|(name, v)| (name.to_string(), ChannelSamples::Float(vec![*v])))
            .collect(),
        metadata: Vec::new(),
    };
    let rgb = |layer: &str, v: f32| {
        let names = ["R", "G", "B"].map(|c| format!("{layer}{c}"));
        part(
            &format!("part {layer}{v}"),
            &names.each_ref().map(|n| (n.as_str(), v)),
        )
    };
    let parts = [
        part("depth", &[("Z", 9.0)]),
        rgb("diffuse.", 1.0),
        rgb("", 2.0),
        rgb("", 3.0),
    ];
    let taken = |parts: &[Part]| {
        write_parts(&path, (1, 1), parts).unwrap();
        io::read::<LinearRgb>(&path).unwrap()[(0, 0)].g
    };
    assert_eq!(
        [taken(&parts), taken(&parts[..2]), taken(&parts[..1])],
        [2.0, 1.0, 9.0]
    );
    let finished = Part {
        name: "ViewLayer.Combined".into(),
        ..rgb("", 4.0)
    };
    assert_eq!(taken(&[rgb("", 3.0), finished]), 4.0);
    write_parts(&path, (1, 1), &[part("depth", &[("Z", 0.0)]), rgb("", 1.0)]).unwrap();
    assert_eq!(io::read::<Coverage>(&path).unwrap()[(0, 0)], Coverage(1.0));
    write_parts(
        &path,
        (1, 1),
        &[part("mask", &[("Y", 1.0)]), parts[0].clone()],
    )
    .unwrap();
    assert_eq!(io::read::<Depth>(&path).unwrap()[(0, 0)], Depth(9.0));
}

/// An EXR of 4 x 4 halves with luminance for each pixel and a pair of colour differences for four
/// of them, in blocks that were compressed by a method.
fn chroma_exr(method: u8, blocks: &[Vec<u8>]) -> Vec<u8> {
    let text = |name: &str, kind: &str, value: &[u8]| {
        [
            name.as_bytes(),
            b"\0",
            kind.as_bytes(),
            b"\0",
            &(value.len() as u32).to_le_bytes(),
            value,
        ]
        .concat()
    };
    let channel = |name: &str, every: u32| {
        [
            name.as_bytes(),
            b"\0",
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &every.to_le_bytes(),
            &every.to_le_bytes(),
        ]
        .concat()
    };
    let window: Vec<u8> = [0_u32, 0, 3, 3]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let one = 1.0_f32.to_le_bytes();
    let mut file = [
        b"\x76\x2f\x31\x01\x02\0\0\0".to_vec(),
        text(
            "channels",
            "chlist",
            &[channel("BY", 2), channel("RY", 2), channel("Y", 1), vec![0]].concat(),
        ),
        text("compression", "compression", &[method]),
        text("dataWindow", "box2i", &window),
        text("displayWindow", "box2i", &window),
        text("lineOrder", "lineOrder", &[0]),
        text("pixelAspectRatio", "float", &one),
        text("screenWindowCenter", "v2f", &[0; 8]),
        text("screenWindowWidth", "float", &one),
        vec![0],
    ]
    .concat();
    let mut at = file.len() + 8 * blocks.len();
    for block in blocks {
        file.extend((at as u64).to_le_bytes());
        at += 8 + block.len();
    }
    for (y, block) in blocks.iter().enumerate() {
        file.extend([(y as u32).to_le_bytes(), (block.len() as u32).to_le_bytes()].concat());
        file.extend(block);
    }
    file
}

/// The lines of such a file without compression, of a luminance of 0.5.
fn chroma_lines(by: [f32; 4], ry: [f32; 4]) -> [Vec<u8>; 4] {
    let halves = |v: &[f32]| {
        v.iter()
            .flat_map(|&v| half::f16::from_f32(v).to_le_bytes())
            .collect::<Vec<u8>>()
    };
    [0_usize, 1, 2, 3].map(|y| {
        let chroma = if y % 2 == 0 {
            [halves(&by[y..y + 2]), halves(&ry[y..y + 2])].concat()
        } else {
            Vec::new()
        };
        [chroma, halves(&[0.5; 4])].concat()
    })
}

/// `RY = (R - Y) / Y` and `BY = (B - Y) / Y`; OpenImageIO before 2.5 does not read such files.
#[test]
fn luminance_with_colour_of_half_the_size_is_read() {
    let folder = Folder::new();
    let lines = chroma_lines([0.0, 1.0, 1.0, 1.0], [-1.0; 4]);
    let path = folder.with("a.exr", &chroma_exr(0, &lines));
    let read = io::read::<LinearRgb>(&path).unwrap();
    assert_eq!(io::read_header(&path).unwrap().channels, ["BY", "RY", "Y"]);
    let weights = color::xyz_from_rgb(&color::RgbSpace::REC709);
    for ((x, y), blue) in [
        ((0, 0), 0.5),
        ((1, 0), 0.75),
        ((2, 0), 1.0),
        ((0, 1), 0.75),
        ((0, 2), 1.0),
        ((3, 3), 1.0),
    ] {
        let p = read[(x, y)];
        let luminance = f64::from(p.r) * weights[(1, 0)]
            + f64::from(p.g) * weights[(1, 1)]
            + f64::from(p.b) * weights[(1, 2)];
        assert!(
            p.r == 0.0 && (p.b - blue).abs() < 1e-6 && (luminance - 0.5).abs() < 1e-6,
            "{x} {y}: {p:?}"
        );
    }
}

/// A block of B44 whose 16 halves are alike.
fn flat_b44(value: f32) -> [u8; 3] {
    let bits = f16::from_f32(value).to_bits();
    // Ordered as the values are: negative ones come first.
    let ordered = if bits & 0x8000 == 0 {
        bits | 0x8000
    } else {
        !bits
    };
    let [high, low] = ordered.to_be_bytes();
    [high, low, 13 << 2]
}

/// The block of 4 x 4 pixels: one of B44 for each channel, or as it is. OpenImageIO reads them from
/// 2.5 on.
#[test]
fn colour_of_half_the_size_in_b44_is_read_or_named() {
    let folder = Folder::new();
    for (method, name) in [(6, "B44"), (7, "B44A")] {
        let channels = [0.25, -0.5, 0.5].map(flat_b44).concat();
        let path = folder.with("a.exr", &chroma_exr(method, &[channels]));
        let expected = format!(
            "a.exr: unsupported EXR: subsampled channels compressed by {name}; save it as RGB or with ZIP compression"
        );
        match io::read::<LinearRgb>(&path) {
            Ok(read) => {
                let p = read[(3, 3)];
                assert!(
                    (p.r - 0.25).abs() < 1e-3 && (p.b - 0.625).abs() < 1e-3,
                    "{p:?}"
                );
                assert!((p.g - 0.5617).abs() < 1e-3, "{p:?}");
            }
            Err(refusal) => assert!(refusal.to_string().contains(&expected), "{refusal}"),
        }
        let lines = chroma_lines([1.0; 4], [-1.0; 4]);
        let path = folder.with("raw.exr", &chroma_exr(method, &[lines.concat()]));
        assert_eq!(io::read::<LinearRgb>(&path).unwrap()[(3, 3)].r, 0.0);
    }
}

#[test]
fn an_hdr_may_call_itself_rgbe_and_go_upwards() {
    let folder = Folder::new();
    let pixels = [[128, 0, 0, 129], [0, 128, 0, 129]].concat();
    let file = [
        b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n+Y 2 +X 1\n".to_vec(),
        pixels,
    ]
    .concat();
    let path = folder.with("a.hdr", &file);
    let read = io::read::<LinearRgb>(&path).unwrap();
    assert_eq!(
        (read[(0, 0)], read[(0, 1)]),
        (LinearRgb::new(0.0, 1.0, 0.0), LinearRgb::new(1.0, 0.0, 0.0))
    );
    assert_eq!(io::read_header(&path).unwrap().height, 2);
}
