//! Bad files: one clear line each, quickly, and nothing half-written.

use crate::build::crc32;
use crate::make::{Folder, behind, codes, light, opaque_codes, tiff};
use crate::promptness::quickly;
use petcomp::io::{self, Bits, Limits, ReadOptions, WriteOptions};
use petcomp::{Coverage, LinearRgb, PremulRgba};
use std::path::Path;

/// The message for a file, which is one line that starts with the file, and comes quickly.
fn refusal(path: &Path) -> String {
    let (read, _) = quickly(&path.to_string_lossy(), || io::read::<PremulRgba>(path));
    let message = read.expect_err("a picture out of a bad file").to_string();
    assert!(
        !message.contains('\n') && message.len() < 400,
        "{message:?}"
    );
    let front = format!("{}: ", path.display());
    message
        .strip_prefix(&front)
        .unwrap_or_else(|| panic!("{message} does not start with {front}"))
        .to_string()
}

/// A whole small file of each format.
fn valid(folder: &Folder) -> Vec<(&'static str, Vec<u8>)> {
    let float = WriteOptions {
        bits: Some(Bits::Float),
        ..Default::default()
    };
    io::write(folder.file("a.png"), &codes(20, 14)).unwrap();
    io::write(folder.file("a.jpg"), &opaque_codes(20, 14)).unwrap();
    io::write(folder.file("a.exr"), &light(20, 14)).unwrap();
    io::write(folder.file("a.tif"), &codes(20, 14)).unwrap();
    io::write_with(folder.file("b.tif"), &light(20, 14), &float).unwrap();
    let mut files: Vec<_> = ["a.png", "a.jpg", "a.exr", "a.tif", "b.tif"]
        .into_iter()
        .map(|name| (name, std::fs::read(folder.file(name)).unwrap()))
        .collect();
    let pixels: Vec<_> = (0..280).map(|i| image::Rgb([i as f32, 0.5, 2.0])).collect();
    let mut hdr = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut hdr)
        .encode(&pixels, 20, 14)
        .unwrap();
    files.push(("a.hdr", hdr));
    files
}

#[test]
fn what_is_no_picture_is_named() {
    let folder = Folder::new();
    assert_eq!(refusal(&folder.file("none.png")), "no such file");
    assert_eq!(refusal(folder.path()), "is a folder, expected a picture");
    assert_eq!(
        refusal(&folder.with("empty.png", b"")),
        "empty file (0 bytes), expected a picture"
    );
    assert_eq!(
        refusal(&folder.with("plate.png", b"hello, world")),
        "not a picture petcomp reads (starts with \"hello, world\"), expected EXR, PNG, JPEG, HEIC, TIFF or HDR"
    );
    assert!(refusal(&folder.with("a.exr", &[0, 1, 2, 255])).contains("starts with 00 01 02 ff"));
    assert!(
        refusal(&folder.with("file", b"x").join("a.png")).contains("part of the path is a file")
    );
}

#[cfg(unix)]
#[test]
fn a_pipe_is_refused_without_waiting() {
    let folder = Folder::new();
    let path = folder.file("pipe.png");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&path)
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(refusal(&path), "not a regular file, expected a picture");
}

/// Whatever is missing from the end, no half-grey picture comes out.
#[test]
fn truncated_files_are_errors() {
    let folder = Folder::new();
    for (name, bytes) in valid(&folder) {
        let step = bytes.len().div_ceil(40);
        for length in (1..bytes.len()).step_by(step) {
            refusal(&folder.with(name, &bytes[..length]));
        }
    }
}

#[test]
fn a_truncated_jpeg_says_so() {
    let folder = Folder::new();
    let jpeg = valid(&folder)
        .into_iter()
        .find(|(name, _)| *name == "a.jpg")
        .unwrap()
        .1;
    let path = folder.with("cut.jpg", &jpeg[..jpeg.len() - 2]);
    assert_eq!(refusal(&path), "truncated JPEG (no end marker)");
    assert!(
        io::read::<PremulRgba>(folder.with("more.jpg", &[&jpeg[..], b"trailer"].concat())).is_ok()
    );
}

#[test]
fn headers_that_ask_for_too_much_are_refused_by_name() {
    let folder = Folder::new();
    let files = valid(&folder);
    let bytes = |name: &str| files.iter().find(|(n, _)| *n == name).unwrap().1.clone();

    let mut png = bytes("a.png");
    png[16..24].copy_from_slice(&[0, 0, 0x7f, 0xff, 0, 0, 0x7f, 0xff]);
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(refusal(&folder.with("bomb.png", &png)).contains("Limits::pixels"));

    let mut exr = bytes("a.exr");
    for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
        let at = exr
            .windows(window.len())
            .position(|w| w == window.as_bytes())
            .unwrap()
            + window.len()
            + 4;
        exr[at + 8..at + 16].copy_from_slice(&[0x3f, 0x0d, 3, 0, 0x3f, 0x0d, 3, 0]);
    }
    assert!(
        refusal(&folder.with("bomb.exr", &exr)).contains("Limits::side"),
        "200,000 x 200,000"
    );

    let grey = |width: u32, height: u32| {
        let tags = [
            (256, 4, 1, width),
            (257, 4, 1, height),
            (258, 3, 1, 8),
            (259, 3, 1, 1),
            (262, 3, 1, 1),
            (273, 4, 1, behind(8)),
            (278, 4, 1, height),
            (279, 4, 1, 16),
        ];
        tiff(&tags, &[7; 16])
    };
    assert!(io::read::<Coverage>(folder.with("good.tif", &grey(4, 4))).is_ok());
    assert!(refusal(&folder.with("bomb.tif", &grey(30_000, 30_000))).contains("Limits::pixels"));
    refusal(&folder.with("none.tif", &grey(0, 4)));

    let mut jpeg = bytes("a.jpg");
    let frame = jpeg.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0xff, 0xff, 0xff, 0xff]);
    assert!(refusal(&folder.with("bomb.jpg", &jpeg)).contains("Limits::side"));

    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n";
    assert!(refusal(&folder.with("bomb.hdr", hdr)).contains("Limits::side"));
}

#[test]
fn limits_are_the_callers() {
    let folder = Folder::new();
    io::write(folder.file("a.png"), &codes(20, 14)).unwrap();
    let under = |limits: Limits| {
        let options = ReadOptions {
            limits,
            ..Default::default()
        };
        io::read_with::<PremulRgba>(folder.file("a.png"), &options)
            .unwrap_err()
            .to_string()
    };
    let e = under(Limits {
        side: 19,
        ..Default::default()
    });
    assert!(
        e.ends_with("20 pixels along a side, over the limit of 19 (Limits::side; --limit side=N)"),
        "{e}"
    );
    assert!(
        under(Limits {
            file_bytes: 9,
            ..Default::default()
        })
        .contains("Limits::file_bytes")
    );
    #[cfg(target_os = "linux")]
    {
        let e = under(Limits {
            memory_percent: 0,
            ..Default::default()
        });
        assert!(
            e.contains("20 x 14 pixels x 4 channels x 12 bytes = ")
                && e.contains("Limits::memory_percent"),
            "{e}"
        );
    }
}

#[test]
fn nothing_half_written_is_left() {
    let folder = Folder::new();
    let e = io::write(folder.file("a.gif"), &codes(2, 2))
        .unwrap_err()
        .to_string();
    assert!(
        e.contains("expected the extension .exr, .png, .jpg or .tif"),
        "{e}"
    );
    let e = io::write(folder.file("no/a.png"), &codes(2, 2))
        .unwrap_err()
        .to_string();
    assert!(e.contains("no folder"), "{e}");
    let e = io::write(folder.file("a.png"), &codes(0, 2))
        .unwrap_err()
        .to_string();
    assert!(
        e.ends_with("a.png: 0 x 2 pixels, expected at least 1 x 1"),
        "{e}"
    );
    let half = WriteOptions {
        bits: Some(Bits::Half),
        ..Default::default()
    };
    assert!(io::write_with(folder.file("a.png"), &codes(2, 2), &half).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_wrong_extension_is_read_by_content() {
    let folder = Folder::new();
    io::write(folder.file("a.png"), &opaque_codes(4, 4)).unwrap();
    std::fs::rename(folder.file("a.png"), folder.file("a.jpg")).unwrap();
    assert_eq!(
        io::read_header(folder.file("a.jpg")).unwrap().format,
        io::Format::Png
    );
    assert!(io::read::<LinearRgb>(folder.file("a.jpg")).is_ok());
}
