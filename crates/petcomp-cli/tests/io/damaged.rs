//! A suite of small files that are damaged or hostile, each made here: bombs, cuts, edited headers,
//! loops, wrong names.

use crate::build::{
    attribute, end_of_attributes, find, ihdr, inserted, png, segment, stored, tags, with, zeros,
};
use crate::make::{Folder, exif, tiff};
use crate::processes::{status, workers};
use crate::promptness::quickly;
use crate::valid;
use petcomp::PremulRgba;
use petcomp::io;
use std::time::Duration;

/// A name whose ending is the format's, the bytes, and what has to come of it.
type Case = (&'static str, Vec<u8>, Outcome);

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

fn pngs() -> Vec<Case> {
    let end = || (b"IEND", Vec::new());
    let data = |bytes: &[u8]| (b"IDAT", stored(bytes));
    // Two rows of two grey pixels, a filter byte in front of each.
    let rows = [0, 10, 20, 0, 30, 40];
    let grey = |more: Vec<(&'static [u8; 4], Vec<u8>)>| {
        let mut chunks = vec![ihdr(2, 2, 8, 0, 0)];
        chunks.extend(more);
        png(&chunks)
    };
    let whole = grey(vec![data(&rows), end()]);
    let idat = find(&whole, b"IDAT");
    vec![
        ("signature.png", whole[..8].to_vec(), Refused),
        (
            "no_width.png",
            png(&[ihdr(0, 2, 8, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "no_height.png",
            png(&[ihdr(2, 0, 8, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "bomb_side.png",
            png(&[ihdr(0x7fff_ffff, 1, 8, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "bomb_area.png",
            png(&[ihdr(30_000, 30_000, 8, 6, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "bomb_ratio.png",
            png(&[ihdr(11_000, 11_000, 8, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "negative.png",
            png(&[ihdr(0xffff_ffff, 0xffff_ffff, 8, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "three_bits.png",
            png(&[ihdr(2, 2, 3, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "colour_kind_5.png",
            png(&[ihdr(2, 2, 8, 5, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "interlace_7.png",
            png(&[ihdr(2, 2, 8, 0, 7), data(&rows), end()]),
            Refused,
        ),
        ("no_data.png", grey(vec![end()]), Refused),
        ("no_header.png", png(&[data(&rows), end()]), Refused),
        ("no_end.png", grey(vec![data(&rows)]), Refused),
        (
            "too_few_rows.png",
            grey(vec![data(&rows[..3]), end()]),
            Refused,
        ),
        (
            "too_many_rows.png",
            grey(vec![data(&rows.repeat(50)), end()]),
            Either,
        ),
        (
            "filter_9.png",
            grey(vec![data(&[9, 1, 2, 9, 3, 4]), end()]),
            Refused,
        ),
        ("bad_checksum.png", with(&whole, idat + 6, &[0xaa]), Refused),
        (
            "bad_zlib.png",
            grey(vec![(b"IDAT", vec![1, 2, 3, 4]), end()]),
            Refused,
        ),
        (
            "data_bomb.png",
            grey(vec![(b"IDAT", zeros(64)), end()]),
            Either,
        ),
        // A chunk that says it has 2 GiB: OpenImageIO's reader takes 1.15 GB for it.
        (
            "chunk_2_gib.png",
            with(&whole, idat - 4, &[0x7f, 0xff, 0xff, 0xff]),
            Refused,
        ),
        (
            "chunk_4_gib.png",
            with(&whole, idat - 4, &[0xff; 4]),
            Refused,
        ),
        (
            "text_bomb.png",
            grey(vec![
                (b"zTXt", [b"a\0\0".to_vec(), zeros(200)].concat()),
                data(&rows),
                end(),
            ]),
            Either,
        ),
        (
            "profile_bomb.png",
            grey(vec![
                (b"iCCP", [b"a\0\0".to_vec(), zeros(200)].concat()),
                data(&rows),
                end(),
            ]),
            Either,
        ),
        (
            "profile_noise.png",
            grey(vec![
                (b"iCCP", [b"a\0\0".to_vec(), stored(b"noise")].concat()),
                data(&rows),
                end(),
            ]),
            Read,
        ),
        (
            "no_palette.png",
            png(&[ihdr(2, 2, 8, 3, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "short_palette.png",
            png(&[
                ihdr(2, 2, 8, 3, 0),
                (b"PLTE", vec![1, 2, 3]),
                data(&rows),
                end(),
            ]),
            Either,
        ),
        (
            "two_headers.png",
            grey(vec![ihdr(9999, 9999, 8, 0, 0), data(&rows), end()]),
            Refused,
        ),
        (
            "many_chunks.png",
            grey(
                (0..5_000)
                    .map(|_| (b"tEXt", b"a\0b".to_vec()))
                    .chain([data(&rows), end()])
                    .collect(),
            ),
            Read,
        ),
        (
            "exif_noise.png",
            grey(vec![
                (b"eXIf", b"MM\0*\xff\xff\xff\xff".to_vec()),
                data(&rows),
                end(),
            ]),
            Read,
        ),
    ]
}

fn jpegs() -> Vec<Case> {
    let (_, whole) = valid::named("rgb.jpg");
    let (frame, scan) = (find(&whole, &[0xff, 0xc0]), find(&whole, &[0xff, 0xda]));
    let at_start = |bytes: &[u8]| inserted(&whole, 2, bytes);
    // The second directory follows on itself.
    let mut circle = exif(1, 28);
    let link = circle.len() - 4;
    circle.splice(link.., 8_u32.to_be_bytes());
    vec![
        ("start.jpg", b"\xff\xd8\xff".to_vec(), Refused),
        ("start_end.jpg", b"\xff\xd8\xff\xd9".to_vec(), Refused),
        ("bomb.jpg", with(&whole, frame + 5, &[0xff; 4]), Refused),
        (
            "bomb_ratio.jpg",
            with(&whole, frame + 5, &[0x2a, 0xf8, 0x2a, 0xf8]),
            Refused,
        ),
        ("no_width.jpg", with(&whole, frame + 7, &[0, 0]), Refused),
        ("no_height.jpg", with(&whole, frame + 5, &[0, 0]), Refused),
        ("larger.jpg", with(&whole, frame + 5, &[0x01, 0x00]), Either),
        ("no_components.jpg", with(&whole, frame + 9, &[0]), Refused),
        (
            "nine_components.jpg",
            with(&whole, frame + 9, &[9]),
            Refused,
        ),
        ("sampling_0.jpg", with(&whole, frame + 11, &[0]), Refused),
        (
            "sampling_15.jpg",
            with(&whole, frame + 11, &[0xff]),
            Refused,
        ),
        ("twelve_bits.jpg", with(&whole, frame + 4, &[12]), Refused),
        ("lossless.jpg", with(&whole, frame + 1, &[0xc3]), Refused),
        ("arithmetic.jpg", with(&whole, frame + 1, &[0xc9]), Either),
        (
            "hierarchical.jpg",
            with(&whole, frame + 1, &[0xc5]),
            Refused,
        ),
        (
            "no_frame.jpg",
            [&whole[..frame], &whole[scan..]].concat(),
            Refused,
        ),
        (
            "no_scan.jpg",
            [&whole[..scan], b"\xff\xd9"].concat(),
            Refused,
        ),
        (
            "half_scan.jpg",
            whole[..scan + (whole.len() - scan) / 2].to_vec(),
            Refused,
        ),
        (
            "no_jfif.jpg",
            [b"\xff\xd8".as_slice(), &whole[frame..]].concat(),
            Either,
        ),
        ("scan_of_nothing.jpg", with(&whole, scan + 4, &[0]), Refused),
        ("segment_0.jpg", with(&whole, frame + 2, &[0, 0]), Refused),
        (
            "segment_64k.jpg",
            with(&whole, frame + 2, &[0xff, 0xff]),
            Refused,
        ),
        (
            "profile_parts.jpg",
            at_start(&segment(0xe2, b"ICC_PROFILE\0\x09\x02noise")),
            Read,
        ),
        (
            "profile_noise.jpg",
            at_start(&segment(0xe2, b"ICC_PROFILE\0\x01\x01noise")),
            Read,
        ),
        (
            "exif_circle.jpg",
            at_start(&segment(0xe1, &[b"Exif\0\0", circle.as_slice()].concat())),
            Read,
        ),
        (
            "exif_noise.jpg",
            at_start(&segment(0xe1, b"Exif\0\0II*\0\xff\xff\xff\xff")),
            Read,
        ),
        (
            "many_comments.jpg",
            at_start(&segment(0xfe, &[b'x'; 60_000]).repeat(20)),
            Read,
        ),
        (
            "restarts.jpg",
            inserted(&whole, frame, &segment(0xdd, &[0, 1])),
            Either,
        ),
    ]
}

fn tiffs() -> Vec<Case> {
    let strip = [7; 64];
    let of = |others: &[(u16, u16, u32, u32)]| tiff(&tags(8, 8, others), &strip);
    let mut circle = of(&[]);
    let next = 8 + 2 + 12 * 9;
    circle[next..next + 4].copy_from_slice(&8_u32.to_le_bytes());
    let big = [
        b"II+\0\x08\0\0\0".as_slice(),
        &u64::MAX.to_le_bytes(),
        &[0; 32],
    ]
    .concat();
    vec![
        ("start.tif", b"II*\0".to_vec(), Refused),
        ("nowhere.tif", b"II*\0\xff\xff\xff\x7f".to_vec(), Refused),
        ("zero.tif", b"II*\0\0\0\0\0\0\0\0\0".to_vec(), Refused),
        ("itself.tif", b"II*\0\x04\0\0\0\x01\0".to_vec(), Refused),
        ("circle.tif", circle, Refused),
        ("big.tif", big, Refused),
        (
            "entries_65535.tif",
            with(&of(&[]), 8, &[0xff, 0xff]),
            Refused,
        ),
        ("no_tags.tif", tiff(&[], &strip), Refused),
        ("no_width.tif", of(&[(256, 4, 1, 0)]), Refused),
        (
            "bomb.tif",
            of(&[
                (256, 4, 1, 30_000),
                (257, 4, 1, 30_000),
                (278, 4, 1, 30_000),
            ]),
            Refused,
        ),
        (
            "bomb_ratio.tif",
            of(&[
                (256, 4, 1, 11_000),
                (257, 4, 1, 11_000),
                (278, 4, 1, 11_000),
            ]),
            Refused,
        ),
        (
            "negative.tif",
            of(&[(256, 4, 1, u32::MAX), (257, 4, 1, u32::MAX)]),
            Refused,
        ),
        (
            "strip_nowhere.tif",
            of(&[(273, 4, 1, 0x7fff_ffff)]),
            Refused,
        ),
        ("strip_of_nothing.tif", of(&[(279, 4, 1, 0)]), Either),
        ("strip_4_gib.tif", of(&[(279, 4, 1, u32::MAX)]), Either),
        ("rows_0.tif", of(&[(278, 4, 1, 0)]), Either),
        ("rows_4g.tif", of(&[(278, 4, 1, u32::MAX)]), Either),
        ("rows_1.tif", of(&[(278, 4, 1, 1)]), Refused),
        ("bits_0.tif", of(&[(258, 3, 1, 0)]), Refused),
        ("bits_7.tif", of(&[(258, 3, 1, 7)]), Either),
        ("bits_64.tif", of(&[(258, 3, 1, 64)]), Refused),
        ("samples_0.tif", of(&[(277, 3, 1, 0)]), Refused),
        ("samples_65535.tif", of(&[(277, 3, 1, 65_535)]), Refused),
        ("compression_9999.tif", of(&[(259, 3, 1, 9999)]), Refused),
        ("fax.tif", of(&[(259, 3, 1, 4), (258, 3, 1, 1)]), Either),
        ("lzw_noise.tif", of(&[(259, 3, 1, 5)]), Refused),
        ("deflate_noise.tif", of(&[(259, 3, 1, 8)]), Refused),
        ("packbits_noise.tif", of(&[(259, 3, 1, 32_773)]), Refused),
        ("jpeg_noise.tif", of(&[(259, 3, 1, 7)]), Refused),
        ("old_jpeg_noise.tif", of(&[(259, 3, 1, 6)]), Refused),
        ("no_palette.tif", of(&[(262, 3, 1, 3)]), Refused),
        (
            "palette_nowhere.tif",
            of(&[(262, 3, 1, 3), (320, 3, 768, 0x7fff_ffff)]),
            Refused,
        ),
        ("cmyk.tif", of(&[(262, 3, 1, 5)]), Either),
        (
            "planes.tif",
            of(&[(277, 3, 1, 3), (262, 3, 1, 2), (284, 3, 1, 2)]),
            Refused,
        ),
        (
            "tile_0.tif",
            of(&[
                (322, 4, 1, 0),
                (323, 4, 1, 0),
                (324, 4, 1, 8),
                (325, 4, 1, 64),
            ]),
            Refused,
        ),
        (
            "tile_2g.tif",
            of(&[
                (322, 4, 1, 1 << 31),
                (323, 4, 1, 1 << 31),
                (324, 4, 1, 8),
                (325, 4, 1, 64),
            ]),
            Refused,
        ),
        (
            "predictor_3.tif",
            of(&[(317, 3, 1, 3), (259, 3, 1, 8)]),
            Refused,
        ),
        ("tag_of_4g.tif", of(&[(270, 2, u32::MAX, 0)]), Either),
        ("profile_of_4g.tif", of(&[(34_675, 7, u32::MAX, 0)]), Either),
        ("kind_99.tif", of(&[(270, 99, 1, 0)]), Either),
    ]
}

fn exrs() -> Vec<Case> {
    let (_, whole) = valid::named("half.exr");
    let int = |v: i32| v.to_le_bytes();
    let window =
        |name: &str, x: i32, y: i32| attribute(&whole, name, 8, &[int(x), int(y)].concat());
    let both = |x, y| {
        attribute(
            &window("dataWindow\0box2i\0", x, y),
            "displayWindow\0box2i\0",
            8,
            &[int(x), int(y)].concat(),
        )
    };
    let size_of = |name: &str| find(&whole, name.as_bytes()) + name.len();
    let channels = "channels\0chlist\0";
    let blocks = end_of_attributes(&whole);
    let first = u64::from_le_bytes(*whole[blocks..].first_chunk().unwrap()) as usize;
    vec![
        ("magic.exr", whole[..4].to_vec(), Refused),
        ("version_99.exr", with(&whole, 4, &[99]), Refused),
        ("flags.exr", with(&whole, 5, &[0xff]), Refused),
        ("deep_flag.exr", with(&whole, 5, &[0x08]), Either),
        ("parts_flag.exr", with(&whole, 5, &[0x10]), Refused),
        ("tiled_flag.exr", with(&whole, 5, &[0x02]), Either),
        ("header_only.exr", whole[..blocks].to_vec(), Refused),
        ("no_blocks.exr", whole[..first].to_vec(), Refused),
        (
            "window_inside_out.exr",
            window("dataWindow\0box2i\0", -5, -5),
            Refused,
        ),
        (
            "window_huge.exr",
            window("dataWindow\0box2i\0", 0x3fff_ffff, 0x3fff_ffff),
            Refused,
        ),
        (
            "window_tall.exr",
            window("dataWindow\0box2i\0", 399, 738_197_803),
            Refused,
        ),
        (
            "window_overflows.exr",
            window("dataWindow\0box2i\0", i32::MAX, i32::MAX),
            Refused,
        ),
        (
            "shown_huge.exr",
            window("displayWindow\0box2i\0", 0x3fff_ffff, 0x3fff_ffff),
            Refused,
        ),
        (
            "shown_inside_out.exr",
            window("displayWindow\0box2i\0", -5, -5),
            Either,
        ),
        ("bomb.exr", both(46_339, 46_339), Refused),
        ("bomb_square.exr", both(199_999, 199_999), Refused),
        ("bomb_ratio.exr", both(9_999, 9_999), Refused),
        ("larger.exr", both(63, 63), Refused),
        (
            "attribute_negative.exr",
            with(&whole, size_of(channels), &int(-1)),
            Refused,
        ),
        (
            "attribute_2_gib.exr",
            with(&whole, size_of(channels), &int(i32::MAX)),
            Refused,
        ),
        (
            "attribute_0.exr",
            with(&whole, size_of(channels), &int(0)),
            Refused,
        ),
        (
            "sample_kind_9.exr",
            attribute(&whole, channels, 2, &int(9)),
            Refused,
        ),
        (
            "sampling_0.exr",
            attribute(&whole, channels, 10, &int(0)),
            Refused,
        ),
        (
            "sampling_1000.exr",
            attribute(&whole, channels, 10, &int(1000)),
            Refused,
        ),
        (
            "sampling_negative.exr",
            attribute(&whole, channels, 10, &int(-2)),
            Refused,
        ),
        (
            "compression_99.exr",
            attribute(&whole, "compression\0compression\0", 0, &[99]),
            Refused,
        ),
        (
            "compression_other.exr",
            attribute(&whole, "compression\0compression\0", 0, &[4]),
            Refused,
        ),
        (
            "line_order_9.exr",
            attribute(&whole, "lineOrder\0lineOrder\0", 0, &[9]),
            Refused,
        ),
        (
            "aspect_nan.exr",
            attribute(
                &whole,
                "pixelAspectRatio\0float\0",
                0,
                &f32::NAN.to_le_bytes(),
            ),
            Either,
        ),
        ("block_at_0.exr", with(&whole, blocks, &[0; 8]), Either),
        (
            "block_in_itself.exr",
            with(&whole, blocks, &(blocks as u64).to_le_bytes()),
            Either,
        ),
        (
            "block_nowhere.exr",
            with(&whole, blocks, &[0xff; 8]),
            Either,
        ),
        (
            "block_row_9999.exr",
            with(&whole, first, &int(9999)),
            Refused,
        ),
        (
            "block_row_negative.exr",
            with(&whole, first, &int(i32::MIN)),
            Refused,
        ),
        (
            "block_size_negative.exr",
            with(&whole, first + 4, &int(-1)),
            Refused,
        ),
        (
            "block_size_2_gib.exr",
            with(&whole, first + 4, &int(i32::MAX)),
            Refused,
        ),
        (
            "block_noise.exr",
            with(&whole, first + 8, &[0xa5; 40]),
            Either,
        ),
        (
            "no_channels.exr",
            with(&whole, find(&whole, b"channels\0"), b"chonnels\0"),
            Refused,
        ),
        (
            "long_name.exr",
            inserted(&whole, 8, &[b'a'; 5_000]),
            Refused,
        ),
    ]
}

fn others() -> Vec<Case> {
    let hdr = |text: &str, data: &[u8]| {
        [
            format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{text}").into_bytes(),
            data.to_vec(),
        ]
        .concat()
    };
    let picture = valid::named("rgb8.png").1;
    let mut cut_short = vec![0; 2048];
    cut_short[..4].copy_from_slice(b"SDPX");
    vec![
        ("no_size.hdr", hdr("\n", b""), Refused),
        ("bomb.hdr", hdr("\n-Y 99999 +X 99999\n", b""), Refused),
        ("bomb_ratio.hdr", hdr("\n-Y 11000 +X 11000\n", b""), Refused),
        ("negative.hdr", hdr("\n-Y -4 +X 4\n", &[0; 64]), Refused),
        ("zero.hdr", hdr("\n-Y 0 +X 4\n", &[0; 64]), Refused),
        ("words.hdr", hdr("\n-Y four +X 4\n", &[0; 64]), Refused),
        (
            "cut.hdr",
            hdr("\n-Y 40 +X 40\n", &[2, 2, 0, 40, 200]),
            Refused,
        ),
        (
            "overrun.hdr",
            hdr("\n-Y 8 +X 8\n", &[2, 2, 0, 8, 255, 1, 255, 1, 255, 1]),
            Refused,
        ),
        (
            "old_runs.hdr",
            hdr(
                "\n-Y 1 +X 4\n",
                &[1, 1, 1, 255, 1, 1, 1, 255, 1, 1, 1, 255, 1, 1, 1, 255],
            ),
            Refused,
        ),
        (
            "endless_header.hdr",
            hdr(&"EXPOSURE=1\n".repeat(50_000), b""),
            Refused,
        ),
        ("long_line.hdr", hdr(&"x".repeat(500_000), b""), Refused),
        ("nothing.png", Vec::new(), Refused),
        ("one_byte.exr", vec![0x76], Refused),
        ("text.jpg", b"this is a note".to_vec(), Refused),
        ("zip.exr", b"PK\x03\x04................".to_vec(), Refused),
        ("gif.png", b"GIF89a\x01\0\x01\0\0\0\0;".to_vec(), Refused),
        (
            "bmp.tif",
            b"BM................................".to_vec(),
            Refused,
        ),
        (
            "svg.png",
            b"<svg xmlns='http://www.w3.org/2000/svg'/>".to_vec(),
            Refused,
        ),
        ("script.jpg", b"#!/bin/sh\nreboot\n".to_vec(), Refused),
        ("zeros.exr", vec![0; 4096], Refused),
        ("dpx.png", cut_short.clone(), Refused),
        ("head.dpx", cut_short[..16].to_vec(), Refused),
        ("zeros.dpx", cut_short.clone(), Refused),
        ("offsets.dpx", with(&cut_short, 4, &[0xff; 64]), Refused),
        (
            "huge.dpx",
            with(
                &cut_short,
                768,
                &[0, 0, 0, 1, 0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff],
            ),
            Refused,
        ),
        ("head.cin", b"\x80\x2a\x5f\xd7\0\0\0\0".to_vec(), Refused),
        ("png_as.jpg", picture.clone(), Read),
        ("png_as.exr", picture.clone(), Read),
        (
            "png_with_tail.png",
            [picture.as_slice(), &[0; 1000]].concat(),
            Read,
        ),
        ("png_twice.png", picture.repeat(2), Read),
    ]
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
    let cases: Vec<Case> = [pngs(), jpegs(), tiffs(), exrs(), others()].concat();
    assert!(cases.len() >= 60, "only {} files", cases.len());
    let (mut slowest, mut counts, mut wrong) = ((Duration::ZERO, ""), [0; 2], Vec::new());
    for (name, bytes, outcome) in &cases {
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
