//! OpenImageIO and the Rust decoders give the same pixels, whoever wrote the file.

use crate::make::{Folder, codes, light, opaque_codes, with_bits};
use petcomp::io::{self, Bits, FromFile, ToFile, WriteOptions};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba, Srgb8, StraightRgba, color};
use std::path::Path;

/// A file by each writer, read by each reader: four times the same pixels, to the last bit.
fn agree<P: FromFile + PartialEq>(name: &str, image: &Image<impl ToFile>, options: &WriteOptions) {
    let folder = Folder::new();
    let [ours, theirs] = ["ours", "theirs"].map(|who| folder.file(&format!("{who}-{name}")));
    io::write_with(&ours, image, options).unwrap();
    io::oiio::write_with(&theirs, image, options).unwrap();
    let reference = io::read::<P>(&ours).unwrap();
    for (who, other) in [
        ("ours, read by theirs", io::oiio::read::<P>(&ours)),
        ("theirs, read by ours", io::read(&theirs)),
        ("theirs, read by theirs", io::oiio::read(&theirs)),
    ] {
        assert!(
            other.unwrap().pixels() == reference.pixels(),
            "{name} {options:?}: {who}"
        );
    }
}

#[test]
fn integers_mean_the_same_with_and_without_alpha() {
    for (name, bits) in [
        ("a.png", Bits::Eight),
        ("a.png", Bits::Sixteen),
        ("a.tif", Bits::Eight),
        ("a.tif", Bits::Sixteen),
    ] {
        agree::<PremulRgba>(name, &codes(23, 11), &with_bits(bits));
        agree::<StraightRgba>(name, &codes(23, 11), &with_bits(bits));
        agree::<LinearRgb>(name, &opaque_codes(23, 11), &with_bits(bits));
    }
}

#[test]
fn floats_mean_the_same_with_and_without_alpha() {
    for (name, bits) in [
        ("a.tif", Bits::Float),
        ("a.exr", Bits::Half),
        ("a.exr", Bits::Float),
    ] {
        agree::<PremulRgba>(name, &light(23, 11), &with_bits(bits));
        let opaque = light(23, 11).map(PremulRgba::color);
        agree::<LinearRgb>(name, &opaque, &with_bits(bits));
    }
}

#[test]
fn mattes_mean_the_same() {
    let matte = Image::from_fn(9, 4, |x, y| Coverage((x * y) as f32 / 24.0));
    for (name, bits) in [
        ("m.png", Bits::Eight),
        ("m.png", Bits::Sixteen),
        ("m.tif", Bits::Sixteen),
        ("m.exr", Bits::Half),
    ] {
        agree::<Coverage>(name, &matte, &with_bits(bits));
    }
}

/// How far apart two decoders are on the same JPEG, in display codes, channel by channel.
fn codes_apart(image: &Image<impl ToFile>) -> Vec<u8> {
    let folder = Folder::new();
    let path = folder.file("a.jpg");
    io::write(&path, image).unwrap();
    let shown = |image: Image<LinearRgb>| image.map(color::encode_srgb8);
    let (ours, theirs) = (
        shown(io::read(&path).unwrap()),
        shown(io::oiio::read(&path).unwrap()),
    );
    let apart =
        |(p, q): (&Srgb8, &Srgb8)| [p.r.abs_diff(q.r), p.g.abs_diff(q.g), p.b.abs_diff(q.b)];
    ours.pixels()
        .iter()
        .zip(theirs.pixels())
        .flat_map(apart)
        .collect()
}

/// JPEG lets decoders differ by a code in each of Y, Cb and Cr (ISO/IEC 10918-2); blue is Y + 1.772
/// Cb, so two codes of colour can come of it.
#[test]
fn jpegs_differ_by_a_code_of_each_component_at_most() {
    let grey = Image::from_fn(64, 48, |x, y| Coverage(((x * y) % 97) as f32 / 96.0));
    assert!(codes_apart(&grey).iter().all(|&d| d <= 1));
    let apart = codes_apart(&opaque_codes(64, 48));
    assert!(apart.iter().all(|&d| d <= 2));
    assert!(
        apart.iter().filter(|&&d| d > 1).count() * 50 < apart.len(),
        "more than 2 % are off by two codes"
    );
}

/// Written by OpenImageIO: our own writer has `none`, `zip` and `piz` alone.
#[test]
fn exrs_of_every_compression_are_read() {
    // Two half floats next to each other below 1 are 1/2048 apart.
    const LOSSY: f32 = 1.0 / 1024.0;
    let folder = Folder::new();
    // Half floats hold these numbers exactly.
    let smooth = Image::from_fn(64, 64, |x, y| {
        LinearRgb::new(x as f32 / 64.0, y as f32 / 64.0, 0.5)
    });
    for (compression, most_apart) in [
        ("dwaa:45", LOSSY),
        ("dwab:45", LOSSY),
        ("b44", LOSSY),
        ("b44a", LOSSY),
        ("none", 0.0),
        ("piz", 0.0),
        ("pxr24", 0.0),
        ("rle", 0.0),
        ("zip", 0.0),
        ("zips", 0.0),
    ] {
        let path = folder.file("a.exr");
        let options = WriteOptions {
            metadata: vec![("compression".to_string(), compression.to_string())],
            ..Default::default()
        };
        io::oiio::write_with(&path, &smooth, &options).unwrap();
        let (ours, theirs) = (
            io::read::<LinearRgb>(&path).unwrap(),
            io::oiio::read::<LinearRgb>(&path).unwrap(),
        );
        let apart = |(p, q): (&LinearRgb, &LinearRgb)| {
            let apart = [p.r - q.r, p.g - q.g, p.b - q.b].map(f32::abs);
            apart.into_iter().fold(0.0, f32::max)
        };
        let worst = ours
            .pixels()
            .iter()
            .zip(theirs.pixels())
            .map(apart)
            .fold(0.0, f32::max);
        assert!(worst <= most_apart, "{compression}: {worst}");
        assert!(most_apart > 0.0 || ours == smooth, "{compression}");
    }
}

#[test]
fn bad_files_are_errors_on_this_path_too() {
    let folder = Folder::new();
    let refused = |path: &Path| io::oiio::read::<PremulRgba>(path).unwrap_err().to_string();
    assert!(refused(&folder.file("none.png")).ends_with("no such file"));
    io::write(folder.file("a.png"), &codes(40, 40)).unwrap();
    let bytes = std::fs::read(folder.file("a.png")).unwrap();
    let e = refused(&folder.with("cut.png", &bytes[..bytes.len() / 2]));
    assert!(e.contains("OpenImageIO: ") && !e.contains('\n'), "{e}");
}
