//! How much memory large pictures take. A process of its own: the high-water mark is the process's.

mod memory;

use petcomp::diff::{Likeness, RowsFromFn, Thresholds, Verdict, compare};
use petcomp::io::{self, Picture};
use petcomp::{LinearRgb, PremulRgba};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

/// Pixels along a side.
const SIDE: usize = 4096;
const PIXELS: usize = SIDE * SIDE;
/// What a picture may take for each channel that is used.
const BYTES: usize = 12;
/// One at a time: the mark is everybody's.
static ALONE: Mutex<()> = Mutex::new(());

/// What a call needs at its worst beyond what was there before it, bytes for each pixel of a
/// picture; none where the system does not tell.
fn bytes_a_pixel<T>(call: impl FnOnce() -> T) -> Option<f64> {
    Some(memory::peak_growth(call)? as f64 / PIXELS as f64)
}

fn assert_at_most(most: f64, what: &str, taken: Option<f64>) {
    match taken {
        Some(taken) => {
            println!("{what}: {taken:.2} bytes a pixel");
            assert!(
                taken <= most,
                "{what}: {taken:.2} bytes a pixel, expected {most} at most"
            );
        }
        None => eprintln!("skipped: /proc/self does not tell the peak of memory here"),
    }
}

/// Stripes of one bit: a few kilobytes.
fn one_bit_png(path: &Path) {
    let file = fs::File::create(path).unwrap();
    let mut encoder = png::Encoder::new(file, SIDE as u32, SIDE as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    let mut writer = encoder.write_header().unwrap();
    let mut stream = writer.stream_writer().unwrap();
    (0..SIDE).for_each(|_| stream.write_all(&[0xf0; SIDE / 8]).unwrap());
    stream.finish().unwrap();
}

#[test]
fn a_picture_of_one_bit_takes_little_more_than_its_pixels() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    one_bit_png(&path);
    let taken = bytes_a_pixel(|| io::read::<LinearRgb>(&path).unwrap());
    // Its pixels are 12, and the samples that they are made of another one.
    assert_at_most(13.5, "read as colours", taken);
    let taken = bytes_a_pixel(|| Picture::read(&path).unwrap());
    assert_at_most(2.0, "read as samples", taken);
}

/// A file whose header asks for more than is allowed is refused before memory is taken.
#[test]
fn a_header_that_asks_for_too_much_takes_little_memory() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let [png, hdr] = ["a.png", "a.hdr"].map(|name| folder.path().join(name));
    one_bit_png(&png);
    let mut bytes = fs::read(&png).unwrap();
    bytes[16..24].copy_from_slice(&[0, 0, 0x7f, 0xff, 0, 0, 0x7f, 0xff]);
    let sum = crc32fast::hash(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    fs::write(&png, bytes).unwrap();
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n";
    fs::write(&hdr, header).unwrap();
    for path in [png, hdr] {
        let taken = bytes_a_pixel(|| assert!(io::read::<PremulRgba>(&path).is_err()));
        // 64 MiB: the header, a message and the decoders' buffers.
        assert_at_most(4.0, "refused by its header", taken);
    }
}

/// As `petcomp diff` does it: both pictures and all that is found out about them take less than the
/// pixels of one.
#[test]
fn two_pictures_are_compared_in_the_memory_of_one_channel() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    one_bit_png(&path);
    let taken = bytes_a_pixel(|| {
        let [a, b] = [(); 2].map(|()| Picture::read(&path).unwrap());
        let light = |p: &Picture, rows| p.rows::<PremulRgba>(rows).map(PremulRgba::color);
        let [a, b] = [&a, &b].map(|p| RowsFromFn {
            size: p.size(),
            make: move |rows| light(p, rows),
        });
        assert_eq!(
            compare::<LinearRgb>(&a, &b, &Thresholds::default()).verdict,
            Verdict::Match
        );
    });
    assert_at_most(BYTES as f64, "compared", taken);
}

/// What is seen of a difference looks at rows around each row: bands of it take as much however
/// large the picture is.
#[test]
fn likeness_takes_memory_for_bands_alone() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let wide = |height: usize| {
        let make = |rows: std::ops::Range<usize>| {
            petcomp::Image::filled(1 << 11, rows.len(), LinearRgb::grey(0.5))
        };
        let picture = RowsFromFn {
            size: (1 << 11, height),
            make,
        };
        bytes_a_pixel(move || Likeness::measure(&picture, &picture).unwrap())
    };
    // Once before: threads and tables are there then.
    wide(128);
    let (Some(one), Some(four)) = (wide(256), wide(1024)) else {
        return;
    };
    println!("a band and more: {one:.2}, four times as much: {four:.2}");
    assert!(
        four < 1.5 * one.max(1.0),
        "{four} bytes for each of {PIXELS}, {one} for a quarter of the rows"
    );
}

/// As the layers of a dataset: each channel is there once, where copies took 4 bytes a pixel.
#[test]
fn channels_that_nobody_needs_any_more_are_written_without_a_copy() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    // Blocks of few columns: those at work at the same time take little.
    let size = (SIDE / 8, SIDE * 4);
    let channel = |name: &str| (name.to_owned(), vec![0.5_f32; PIXELS / 2]);
    let channels = vec![channel("G"), channel("R")];
    let canvas = io::Canvas::default();
    let taken =
        bytes_a_pixel(|| io::exr::write_channels(&path, size, canvas, channels, &[]).unwrap());
    assert_at_most(2.0, "channels given away", taken);
}

/// Thirteen channels that nobody asked for are not kept.
#[test]
fn of_an_exr_only_the_channels_that_are_used_take_memory() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let plane = vec![0.5_f32; PIXELS / 4];
    let others = (0..13).map(|i| format!("other.{i}")).collect::<Vec<_>>();
    let names = ["R", "G", "B"]
        .into_iter()
        .chain(others.iter().map(String::as_str));
    let channels: Vec<(&str, &[f32])> = names.map(|name| (name, plane.as_slice())).collect();
    io::exr::write_half_channels(&path, (SIDE / 2, SIDE / 2), &channels).unwrap();
    let taken = bytes_a_pixel(|| io::read::<LinearRgb>(&path).unwrap()).map(|bytes| bytes * 4.0);
    assert_at_most(3.0 * BYTES as f64, "three of sixteen channels", taken);
}
