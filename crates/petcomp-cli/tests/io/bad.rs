//! Bad files: one clear line each, quickly, and nothing half-written.

use crate::build::{attribute, find, ihdr, png, stored, tags, with};
use crate::make::{Folder, codes, opaque_codes, tiff, with_bits};
use crate::promptness::quickly;
use crate::valid;
use petcomp::io::{self, Bits, Limits, ReadOptions};
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
    let formats = [
        "rgba8.png",
        "rgb.jpg",
        "half.exr",
        "rgba8.tif",
        "float.tif",
        "rgb.hdr",
    ];
    let mut files = valid::of_size(20, 14);
    files.retain(|(name, _)| formats.contains(name));
    assert_eq!(files.len(), formats.len());
    for (name, bytes) in files {
        let step = bytes.len().div_ceil(40);
        for length in (1..bytes.len()).step_by(step) {
            refusal(&folder.with(name, &bytes[..length]));
        }
    }
}

#[test]
fn a_truncated_jpeg_says_so() {
    let folder = Folder::new();
    let jpeg = valid::named("rgb.jpg");
    let path = folder.with("cut.jpg", &jpeg[..jpeg.len() - 2]);
    assert_eq!(refusal(&path), "truncated JPEG (no end marker)");
    assert!(
        io::read::<PremulRgba>(folder.with("more.jpg", &[&jpeg[..], b"trailer"].concat())).is_ok()
    );
}

#[test]
fn headers_that_ask_for_too_much_are_refused_by_name() {
    let folder = Folder::new();
    let header = ihdr(0x7fff, 0x7fff, 8, 6, 0);
    let png = png(&[header, (b"IDAT", stored(&[0])), (b"IEND", Vec::new())]);
    assert!(refusal(&folder.with("bomb.png", &png)).contains("Limits::pixels"));

    let mut exr = valid::named("half.exr");
    for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
        exr = attribute(&exr, window, 8, &199_999_u32.to_le_bytes().repeat(2));
    }
    assert!(
        refusal(&folder.with("bomb.exr", &exr)).contains("Limits::side"),
        "200,000 x 200,000"
    );

    // Enough bytes for 4 x 4 pixels, so that the size alone is wrong in the others.
    let grey = |width: u32, height: u32| tiff(&tags(width, height, &[(279, 4, 1, 16)]), &[7; 16]);
    assert!(io::read::<Coverage>(folder.with("good.tif", &grey(4, 4))).is_ok());
    assert!(refusal(&folder.with("bomb.tif", &grey(30_000, 30_000))).contains("Limits::pixels"));
    refusal(&folder.with("none.tif", &grey(0, 4)));

    let jpeg = valid::named("rgb.jpg");
    let jpeg = with(&jpeg, find(&jpeg, &[0xff, 0xc0]) + 5, &[0xff; 4]);
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
    let half = with_bits(Bits::Half);
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
