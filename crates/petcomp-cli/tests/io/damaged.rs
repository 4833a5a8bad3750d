//! A suite of small files that are damaged or hostile, each made here: bombs, cuts, edited headers,
//! loops, wrong names.

use crate::build::{
    Chunk, attribute, end_of_attributes, find, ihdr, inserted, png, segment, stored, tags, with,
    zeros,
};
use crate::make::{Folder, Tag, exif, tiff};
use crate::processes::{status, workers};
use crate::promptness::quickly;
use crate::valid::{self, File};
use petcomp::PremulRgba;
use petcomp::io;
use std::time::Duration;

#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    /// No picture.
    Refused,
    /// A picture or none: what is damaged is not part of it, or only one of its bits.
    Either,
    /// A whole picture in spite of the name.
    Read,
}
use Outcome::{Either, Read, Refused};

/// Files and what has to come of each.
type Cases = Vec<(File, Outcome)>;

fn cases(refused: Vec<File>, either: Vec<File>, read: Vec<File>) -> Cases {
    let all = |files: Vec<File>, outcome| files.into_iter().map(move |file| (file, outcome));
    let others = all(either, Either).chain(all(read, Read));
    all(refused, Refused).chain(others).collect()
}

fn pngs() -> Cases {
    let end = || (b"IEND", Vec::new());
    let data = |bytes: &[u8]| (b"IDAT", stored(bytes));
    // Two rows of two grey pixels, a filter byte in front of each.
    let rows = [0, 10, 20, 0, 30, 40];
    let of = |width, height, bits, color, interlace| {
        let header = ihdr(width, height, bits, color, interlace);
        png(&[header, data(&rows), end()])
    };
    let grey = |more: &[Chunk]| png(&[&[ihdr(2, 2, 8, 0, 0)][..], more].concat());
    let of_data = |chunk: Chunk| grey(&[chunk, end()]);
    let noted = |chunk: Chunk| grey(&[chunk, data(&rows), end()]);
    let packed = |kind, bytes| noted((kind, [b"a\0\0".to_vec(), bytes].concat()));
    let whole = of(2, 2, 8, 0, 0);
    let idat = find(&whole, b"IDAT");
    let of_length = |bytes: u32| with(&whole, idat - 4, &bytes.to_be_bytes());
    let refused = vec![
        ("signature.png", whole[..8].to_vec()),
        ("no_width.png", of(0, 2, 8, 0, 0)),
        ("no_height.png", of(2, 0, 8, 0, 0)),
        ("bomb_side.png", of(0x7fff_ffff, 1, 8, 0, 0)),
        ("bomb_area.png", of(30_000, 30_000, 8, 6, 0)),
        ("bomb_ratio.png", of(11_000, 11_000, 8, 0, 0)),
        ("negative.png", of(0xffff_ffff, 0xffff_ffff, 8, 0, 0)),
        ("three_bits.png", of(2, 2, 3, 0, 0)),
        ("colour_kind_5.png", of(2, 2, 8, 5, 0)),
        ("interlace_7.png", of(2, 2, 8, 0, 7)),
        ("no_data.png", grey(&[end()])),
        ("no_header.png", png(&[data(&rows), end()])),
        ("no_end.png", grey(&[data(&rows)])),
        ("too_few_rows.png", of_data(data(&rows[..3]))),
        ("filter_9.png", of_data(data(&[9, 1, 2, 9, 3, 4]))),
        ("bad_checksum.png", with(&whole, idat + 6, &[0xaa])),
        ("bad_zlib.png", of_data((b"IDAT", vec![1, 2, 3, 4]))),
        // A chunk that says it has 2 GiB: OpenImageIO's reader takes 1.15 GB for it.
        ("chunk_2_gib.png", of_length(0x7fff_ffff)),
        ("chunk_4_gib.png", of_length(0xffff_ffff)),
        ("no_palette.png", of(2, 2, 8, 3, 0)),
        ("two_headers.png", noted(ihdr(9999, 9999, 8, 0, 0))),
    ];
    let either = vec![
        ("too_many_rows.png", of_data(data(&rows.repeat(50)))),
        ("data_bomb.png", of_data((b"IDAT", zeros(64)))),
        ("text_bomb.png", packed(b"zTXt", zeros(200))),
        ("profile_bomb.png", packed(b"iCCP", zeros(200))),
        (
            "short_palette.png",
            png(&[
                ihdr(2, 2, 8, 3, 0),
                (b"PLTE", vec![1, 2, 3]),
                data(&rows),
                end(),
            ]),
        ),
    ];
    let texts = vec![(b"tEXt", b"a\0b".to_vec()); 5_000];
    let read = vec![
        ("profile_noise.png", packed(b"iCCP", stored(b"noise"))),
        (
            "many_chunks.png",
            grey(&[texts, vec![data(&rows), end()]].concat()),
        ),
        (
            "exif_noise.png",
            noted((b"eXIf", b"MM\0*\xff\xff\xff\xff".to_vec())),
        ),
    ];
    cases(refused, either, read)
}

fn jpegs() -> Cases {
    let whole = valid::named("rgb.jpg");
    let (frame, scan) = (find(&whole, &[0xff, 0xc0]), find(&whole, &[0xff, 0xda]));
    let at_start = |bytes: &[u8]| inserted(&whole, 2, bytes);
    // The second directory follows on itself.
    let mut circle = exif(1, 28);
    let link = circle.len() - 4;
    circle.splice(link.., 8_u32.to_be_bytes());
    let refused = vec![
        ("start.jpg", b"\xff\xd8\xff".to_vec()),
        ("start_end.jpg", b"\xff\xd8\xff\xd9".to_vec()),
        ("bomb.jpg", with(&whole, frame + 5, &[0xff; 4])),
        (
            "bomb_ratio.jpg",
            with(&whole, frame + 5, &[0x2a, 0xf8, 0x2a, 0xf8]),
        ),
        ("no_width.jpg", with(&whole, frame + 7, &[0, 0])),
        ("no_height.jpg", with(&whole, frame + 5, &[0, 0])),
        ("no_components.jpg", with(&whole, frame + 9, &[0])),
        ("nine_components.jpg", with(&whole, frame + 9, &[9])),
        ("sampling_0.jpg", with(&whole, frame + 11, &[0])),
        ("sampling_15.jpg", with(&whole, frame + 11, &[0xff])),
        ("twelve_bits.jpg", with(&whole, frame + 4, &[12])),
        ("lossless.jpg", with(&whole, frame + 1, &[0xc3])),
        ("hierarchical.jpg", with(&whole, frame + 1, &[0xc5])),
        ("no_frame.jpg", [&whole[..frame], &whole[scan..]].concat()),
        ("no_scan.jpg", [&whole[..scan], b"\xff\xd9"].concat()),
        (
            "half_scan.jpg",
            whole[..scan + (whole.len() - scan) / 2].to_vec(),
        ),
        ("scan_of_nothing.jpg", with(&whole, scan + 4, &[0])),
        ("segment_0.jpg", with(&whole, frame + 2, &[0, 0])),
        ("segment_64k.jpg", with(&whole, frame + 2, &[0xff; 2])),
    ];
    let either = vec![
        ("larger.jpg", with(&whole, frame + 5, &[1, 0])),
        ("arithmetic.jpg", with(&whole, frame + 1, &[0xc9])),
        ("no_jfif.jpg", [&whole[..2], &whole[frame..]].concat()),
        (
            "restarts.jpg",
            inserted(&whole, frame, &segment(0xdd, &[0, 1])),
        ),
    ];
    let read = vec![
        (
            "profile_parts.jpg",
            at_start(&segment(0xe2, b"ICC_PROFILE\0\x09\x02noise")),
        ),
        (
            "profile_noise.jpg",
            at_start(&segment(0xe2, b"ICC_PROFILE\0\x01\x01noise")),
        ),
        (
            "exif_circle.jpg",
            at_start(&segment(0xe1, &[b"Exif\0\0", circle.as_slice()].concat())),
        ),
        (
            "exif_noise.jpg",
            at_start(&segment(0xe1, b"Exif\0\0II*\0\xff\xff\xff\xff")),
        ),
        (
            "many_comments.jpg",
            at_start(&segment(0xfe, &[b'x'; 60_000]).repeat(20)),
        ),
    ];
    cases(refused, either, read)
}

fn tiffs() -> Cases {
    let strip = [7; 64];
    let of = |others: &[Tag]| tiff(&tags(8, 8, others), &strip);
    let square = |side| of(&[256, 257, 278].map(|tag| (tag, 4, 1, side)));
    let tiled = |side| {
        of(&[
            (322, 4, 1, side),
            (323, 4, 1, side),
            (324, 4, 1, 8),
            (325, 4, 1, 64),
        ])
    };
    let mut circle = of(&[]);
    let next = 8 + 2 + 12 * 9;
    circle[next..next + 4].copy_from_slice(&8_u32.to_le_bytes());
    let big = [
        b"II+\0\x08\0\0\0".as_slice(),
        &u64::MAX.to_le_bytes(),
        &[0; 32],
    ]
    .concat();
    let refused = vec![
        ("start.tif", b"II*\0".to_vec()),
        ("nowhere.tif", b"II*\0\xff\xff\xff\x7f".to_vec()),
        ("zero.tif", b"II*\0\0\0\0\0\0\0\0\0".to_vec()),
        ("itself.tif", b"II*\0\x04\0\0\0\x01\0".to_vec()),
        ("circle.tif", circle),
        ("big.tif", big),
        ("entries_65535.tif", with(&of(&[]), 8, &[0xff, 0xff])),
        ("no_tags.tif", tiff(&[], &strip)),
        ("no_width.tif", of(&[(256, 4, 1, 0)])),
        ("bomb.tif", square(30_000)),
        ("bomb_ratio.tif", square(11_000)),
        (
            "negative.tif",
            of(&[(256, 4, 1, u32::MAX), (257, 4, 1, u32::MAX)]),
        ),
        ("strip_nowhere.tif", of(&[(273, 4, 1, 0x7fff_ffff)])),
        ("rows_1.tif", of(&[(278, 4, 1, 1)])),
        ("bits_0.tif", of(&[(258, 3, 1, 0)])),
        ("bits_64.tif", of(&[(258, 3, 1, 64)])),
        ("samples_0.tif", of(&[(277, 3, 1, 0)])),
        ("samples_65535.tif", of(&[(277, 3, 1, 65_535)])),
        ("compression_9999.tif", of(&[(259, 3, 1, 9999)])),
        ("lzw_noise.tif", of(&[(259, 3, 1, 5)])),
        ("deflate_noise.tif", of(&[(259, 3, 1, 8)])),
        ("packbits_noise.tif", of(&[(259, 3, 1, 32_773)])),
        ("jpeg_noise.tif", of(&[(259, 3, 1, 7)])),
        ("old_jpeg_noise.tif", of(&[(259, 3, 1, 6)])),
        ("no_palette.tif", of(&[(262, 3, 1, 3)])),
        (
            "palette_nowhere.tif",
            of(&[(262, 3, 1, 3), (320, 3, 768, 0x7fff_ffff)]),
        ),
        (
            "planes.tif",
            of(&[(277, 3, 1, 3), (262, 3, 1, 2), (284, 3, 1, 2)]),
        ),
        ("tile_0.tif", tiled(0)),
        ("tile_2g.tif", tiled(1 << 31)),
        ("predictor_3.tif", of(&[(317, 3, 1, 3), (259, 3, 1, 8)])),
    ];
    let either = vec![
        ("strip_of_nothing.tif", of(&[(279, 4, 1, 0)])),
        ("strip_4_gib.tif", of(&[(279, 4, 1, u32::MAX)])),
        ("rows_0.tif", of(&[(278, 4, 1, 0)])),
        ("rows_4g.tif", of(&[(278, 4, 1, u32::MAX)])),
        ("bits_7.tif", of(&[(258, 3, 1, 7)])),
        ("fax.tif", of(&[(259, 3, 1, 4), (258, 3, 1, 1)])),
        ("cmyk.tif", of(&[(262, 3, 1, 5)])),
        ("tag_of_4g.tif", of(&[(270, 2, u32::MAX, 0)])),
        ("profile_of_4g.tif", of(&[(34_675, 7, u32::MAX, 0)])),
        ("kind_99.tif", of(&[(270, 99, 1, 0)])),
    ];
    cases(refused, either, Vec::new())
}

/// Attributes of an EXR, name and kind.
const DATA: &str = "dataWindow\0box2i\0";
const SHOWN: &str = "displayWindow\0box2i\0";
const CHANNELS: &str = "channels\0chlist\0";

fn exrs() -> Cases {
    let whole = valid::named("half.exr");
    let int = |v: i32| v.to_le_bytes();
    let end = |x: i32, y: i32| [int(x), int(y)].concat();
    let window = |name: &str, x, y| attribute(&whole, name, 8, &end(x, y));
    let both = |side| attribute(&window(DATA, side, side), SHOWN, 8, &end(side, side));
    let channel = |at: usize, v: i32| attribute(&whole, CHANNELS, at, &int(v));
    let compressed = |kind: u8| attribute(&whole, "compression\0compression\0", 0, &[kind]);
    let size = find(&whole, CHANNELS.as_bytes()) + CHANNELS.len();
    let blocks = end_of_attributes(&whole);
    let first = u64::from_le_bytes(*whole[blocks..].first_chunk().unwrap()) as usize;
    let refused = vec![
        ("magic.exr", whole[..4].to_vec()),
        ("version_99.exr", with(&whole, 4, &[99])),
        ("flags.exr", with(&whole, 5, &[0xff])),
        ("parts_flag.exr", with(&whole, 5, &[0x10])),
        ("header_only.exr", whole[..blocks].to_vec()),
        ("no_blocks.exr", whole[..first].to_vec()),
        ("window_inside_out.exr", window(DATA, -5, -5)),
        ("window_huge.exr", window(DATA, 0x3fff_ffff, 0x3fff_ffff)),
        ("window_tall.exr", window(DATA, 399, 738_197_803)),
        ("window_overflows.exr", window(DATA, i32::MAX, i32::MAX)),
        ("shown_huge.exr", window(SHOWN, 0x3fff_ffff, 0x3fff_ffff)),
        ("bomb.exr", both(46_339)),
        ("bomb_square.exr", both(199_999)),
        ("bomb_ratio.exr", both(9_999)),
        ("larger.exr", both(63)),
        ("attribute_negative.exr", with(&whole, size, &int(-1))),
        ("attribute_2_gib.exr", with(&whole, size, &int(i32::MAX))),
        ("attribute_0.exr", with(&whole, size, &int(0))),
        ("sample_kind_9.exr", channel(2, 9)),
        ("sampling_0.exr", channel(10, 0)),
        ("sampling_1000.exr", channel(10, 1000)),
        ("sampling_negative.exr", channel(10, -2)),
        ("compression_99.exr", compressed(99)),
        ("compression_other.exr", compressed(4)),
        (
            "line_order_9.exr",
            attribute(&whole, "lineOrder\0lineOrder\0", 0, &[9]),
        ),
        ("block_row_9999.exr", with(&whole, first, &int(9999))),
        (
            "block_row_negative.exr",
            with(&whole, first, &int(i32::MIN)),
        ),
        ("block_size_negative.exr", with(&whole, first + 4, &int(-1))),
        (
            "block_size_2_gib.exr",
            with(&whole, first + 4, &int(i32::MAX)),
        ),
        (
            "no_channels.exr",
            with(&whole, find(&whole, b"channels\0"), b"chonnels\0"),
        ),
        ("long_name.exr", inserted(&whole, 8, &[b'a'; 5_000])),
    ];
    let aspect = "pixelAspectRatio\0float\0";
    let either = vec![
        ("deep_flag.exr", with(&whole, 5, &[0x08])),
        ("tiled_flag.exr", with(&whole, 5, &[0x02])),
        ("shown_inside_out.exr", window(SHOWN, -5, -5)),
        (
            "aspect_nan.exr",
            attribute(&whole, aspect, 0, &f32::NAN.to_le_bytes()),
        ),
        ("block_at_0.exr", with(&whole, blocks, &[0; 8])),
        (
            "block_in_itself.exr",
            with(&whole, blocks, &(blocks as u64).to_le_bytes()),
        ),
        ("block_nowhere.exr", with(&whole, blocks, &[0xff; 8])),
        ("block_noise.exr", with(&whole, first + 8, &[0xa5; 40])),
    ];
    cases(refused, either, Vec::new())
}

fn others() -> Cases {
    let hdr = |text: &str, data: &[u8]| {
        let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{text}");
        [head.as_bytes(), data].concat()
    };
    let picture = valid::named("rgb8.png");
    let mut cut_short = vec![0; 2048];
    cut_short[..4].copy_from_slice(b"SDPX");
    let refused = vec![
        ("no_size.hdr", hdr("\n", b"")),
        ("bomb.hdr", hdr("\n-Y 99999 +X 99999\n", b"")),
        ("bomb_ratio.hdr", hdr("\n-Y 11000 +X 11000\n", b"")),
        ("negative.hdr", hdr("\n-Y -4 +X 4\n", &[0; 64])),
        ("zero.hdr", hdr("\n-Y 0 +X 4\n", &[0; 64])),
        ("words.hdr", hdr("\n-Y four +X 4\n", &[0; 64])),
        ("cut.hdr", hdr("\n-Y 40 +X 40\n", &[2, 2, 0, 40, 200])),
        (
            "overrun.hdr",
            hdr("\n-Y 8 +X 8\n", &[2, 2, 0, 8, 255, 1, 255, 1, 255, 1]),
        ),
        (
            "old_runs.hdr",
            hdr("\n-Y 1 +X 4\n", &[1, 1, 1, 255].repeat(4)),
        ),
        (
            "endless_header.hdr",
            hdr(&"EXPOSURE=1\n".repeat(50_000), b""),
        ),
        ("long_line.hdr", hdr(&"x".repeat(500_000), b"")),
        ("nothing.png", Vec::new()),
        ("one_byte.exr", vec![0x76]),
        ("text.jpg", b"this is a note".to_vec()),
        ("zip.exr", b"PK\x03\x04................".to_vec()),
        ("gif.png", b"GIF89a\x01\0\x01\0\0\0\0;".to_vec()),
        ("bmp.tif", b"BM................................".to_vec()),
        (
            "svg.png",
            b"<svg xmlns='http://www.w3.org/2000/svg'/>".to_vec(),
        ),
        ("script.jpg", b"#!/bin/sh\nreboot\n".to_vec()),
        ("zeros.exr", vec![0; 4096]),
        ("dpx.png", cut_short.clone()),
        ("head.dpx", cut_short[..16].to_vec()),
        ("zeros.dpx", cut_short.clone()),
        ("offsets.dpx", with(&cut_short, 4, &[0xff; 64])),
        (
            "huge.dpx",
            with(
                &cut_short,
                768,
                &[0, 0, 0, 1, 0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff],
            ),
        ),
        ("head.cin", b"\x80\x2a\x5f\xd7\0\0\0\0".to_vec()),
    ];
    let read = vec![
        ("png_as.jpg", picture.clone()),
        ("png_as.exr", picture.clone()),
        ("png_with_tail.png", [&picture[..], &[0; 1000]].concat()),
        ("png_twice.png", picture.repeat(2)),
    ];
    cases(refused, Vec::new(), read)
}

/// The most memory that this process or one of its workers ever had, bytes; none where the system
/// does not tell.
fn peak() -> Option<u64> {
    let of = |pid: &str| -> Option<u64> {
        status(pid).lines().find_map(|l| {
            l.strip_prefix("VmHWM:")?
                .trim()
                .strip_suffix(" kB")?
                .parse::<u64>()
                .ok()
        })
    };
    let workers = workers();
    let workers = workers.iter().filter_map(|pid| of(&pid.to_string()));
    Some(workers.fold(of("self")?, u64::max) << 10)
}

#[test]
fn every_damaged_file_is_met_with_one_line_quickly() {
    let folder = Folder::new();
    let cases: Cases = [pngs(), jpegs(), tiffs(), exrs(), others()].concat();
    assert!(cases.len() >= 166, "only {} files", cases.len());
    let (mut slowest, mut counts, mut wrong) = ((Duration::ZERO, ""), [0; 2], Vec::new());
    for ((name, bytes), outcome) in &cases {
        let path = folder.with(name, bytes);
        let (read, time) = quickly(name, || {
            io::read::<PremulRgba>(&path)
                .map(|_| ())
                .map_err(|e| e.to_string())
        });
        slowest = slowest.max((time, name));
        let header = io::read_header(&path)
            .map(|_| ())
            .map_err(|e| e.to_string());
        counts[usize::from(read.is_ok())] += 1;
        for e in [&read, &header]
            .into_iter()
            .filter_map(|r| r.as_ref().err())
        {
            let one_line = !e.contains('\n') && e.len() < 500 && e.contains(name);
            if !one_line || e.contains("gave up") {
                wrong.push(format!("{name}: {e}"));
            }
        }
        match (outcome, &read) {
            (Refused, Ok(())) | (Read, Err(_)) => wrong.push(format!("{name}: {read:?}")),
            _ => {}
        }
        std::fs::remove_file(path).unwrap();
    }
    println!(
        "{} damaged files: {} refused, {} read; slowest {} {:?}",
        cases.len(),
        counts[0],
        counts[1],
        slowest.1,
        slowest.0
    );
    println!(
        "peak of this process or a worker: {:?} MiB",
        peak().map(|bytes| bytes >> 20)
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(peak().is_none_or(|bytes| bytes < 512 << 20));
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused_without_waiting() {
    use std::os::unix::fs::symlink;
    let folder = Folder::new();
    symlink(folder.file("b.png"), folder.file("a.png")).unwrap();
    symlink(folder.file("a.png"), folder.file("b.png")).unwrap();
    symlink("/dev/zero", folder.file("zero.png")).unwrap();
    symlink("/dev/tty", folder.file("tty.png")).unwrap();
    symlink(folder.path(), folder.file("folder.png")).unwrap();
    for name in ["a.png", "zero.png", "tty.png", "folder.png"] {
        let path = folder.file(name);
        assert!(
            quickly(name, || io::read::<PremulRgba>(&path)).0.is_err(),
            "{name}"
        );
        assert!(
            quickly(name, || io::read_header(&path)).0.is_err(),
            "{name}"
        );
        assert!(quickly(name, || io::read_text(&path)).0.is_err(), "{name}");
    }
}
