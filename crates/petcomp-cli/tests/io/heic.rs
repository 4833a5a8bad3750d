//! Pictures of phones (`files/make_heic.py`): HEIC comes through libheif, in the worker.

use crate::make::{Folder, file};
use crate::promptness::quickly;
use petcomp::diff::Likeness;
use petcomp::io::{self, Format, WriteOptions};
use petcomp::{Image, LinearRgb, StraightRgba, color};

/// Turned once, though both the file and its camera notes ask for it, and in colours of Display P3:
/// as the JPEG of the same picture.
#[test]
fn a_phone_s_photo_comes_upright_and_in_its_colors() {
    let [heic, jpeg]: [Image<LinearRgb>; 2] =
        ["phone.heic", "phone.jpg"].map(|name| io::read(file(name)).unwrap());
    assert_eq!(heic.size(), (32, 48));
    // What the JPEG loses.
    let error = Likeness::measure(&heic, &jpeg).unwrap().rmse;
    assert!(error < 0.003, "{error}");
    // Its reds are beyond those of sRGB.
    let reddest = heic.pixels().iter().map(|p| p.r).fold(0.0, f32::max);
    assert!(reddest > 1.05, "{reddest}");
}

#[test]
fn a_header_says_what_the_camera_noted() {
    let header = io::read_header(file("phone.heic")).unwrap();
    assert_eq!((header.width, header.height, header.bits), (32, 48, 8));
    assert_eq!(
        (header.format, header.focal_35mm),
        (Format::Heif, Some(26.0))
    );
    assert_eq!(io::read_header(file("deep.heic")).unwrap().bits, 16);
}

#[test]
fn ten_bits_and_more_keep_their_steps() {
    let deep = io::read::<LinearRgb>(file("deep.heic")).unwrap();
    let last = (48 * 32 - 1) as f32;
    for (x, y) in (0..48).flat_map(|x| (0..32).map(move |y| (x, y))) {
        let code = (x * 32 + y) as f32 / last;
        let read = color::linear_to_srgb(deep[(x, y)].g);
        assert!(
            (read - code).abs() < 1.5 / 1023.0,
            "{x} {y}: {read}, {code}"
        );
    }
}

#[test]
fn alpha_is_straight() {
    let read = io::read::<StraightRgba>(file("alpha.heic")).unwrap();
    for (x, y) in (0..48).flat_map(|x| (0..32).map(move |y| (x, y))) {
        let (p, red, green) = (read[(x, y)], 255 * x / 47, 255 * y / 31);
        let alpha = (255 - red) as f32 / 255.0;
        assert!((p.a - alpha).abs() < 1e-6, "{x} {y}: {p:?}, {alpha}");
        // Brightness and differences of colour are rounded, to a code.
        for (read, code) in [(p.r, red), (p.g, green), (p.b, 128)] {
            let off = 255.0 * color::linear_to_srgb(read) - code as f32;
            assert!(off.abs() < 1.1, "{x} {y}: {p:?}, {code}");
        }
    }
}

#[test]
fn a_cut_one_is_refused_or_loses_nothing_and_a_changed_one_crashes_nothing() {
    let (folder, bytes) = (Folder::new(), std::fs::read(file("phone.heic")).unwrap());
    let whole = io::read::<LinearRgb>(file("phone.heic")).unwrap();
    let mut refused = 0;
    for length in (12..bytes.len()).step_by(97) {
        let cut = folder.with("cut.heic", &bytes[..length]);
        match quickly("a cut", || io::read::<LinearRgb>(&cut)).0 {
            Ok(read) => assert!(read == whole, "{length} bytes"),
            Err(e) => refused += usize::from(!e.to_string().contains('\n')),
        }
    }
    assert!(refused > 30, "{refused}");
    for at in (12..bytes.len()).step_by(41) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x55;
        let changed = folder.with("changed.heic", &changed);
        if let (Err(e), _) = quickly("a change", || io::read::<LinearRgb>(&changed)) {
            assert!(!e.to_string().contains('\n'), "{e}");
        }
    }
}

#[test]
fn none_is_written() {
    let picture = Image::filled(8, 8, LinearRgb::WHITE);
    let path = Folder::new().file("out.heic");
    let e = io::write_with(&path, &picture, &WriteOptions::default()).unwrap_err();
    assert!(
        e.to_string().contains("expected the extension .exr, .png"),
        "{e}"
    );
}
