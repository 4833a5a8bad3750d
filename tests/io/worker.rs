//! Files that only OpenImageIO reads come through its worker; programs that meet none do not load it.

use crate::make::{Folder, palette_tiff};
use petcomp::io::{self, WriteOptions};
use petcomp::{Image, LinearRgb, Srgb8, color};

#[test]
fn a_palette_tiff_is_read_by_the_worker() {
    let folder = Folder::new();
    let read = io::read::<LinearRgb>(folder.with("palette.tif", &palette_tiff())).unwrap();
    assert_eq!(read[(0, 0)], LinearRgb::new(1.0, 0.0, 0.0));
    assert_eq!(read[(1, 0)], color::decode_srgb8(Srgb8 { r: 0, g: 128, b: 255 }));
}

#[test]
fn film_scans_are_read_by_the_worker() {
    let folder = Folder::new();
    let path = folder.file("scan.dpx");
    let ramp = Image::from_fn(32, 4, |x, _| LinearRgb::grey(x as f32 / 31.0));
    io::oiio::write_with(&path, &ramp, &WriteOptions::default()).unwrap();
    let read = io::read::<LinearRgb>(&path).unwrap();
    let worst = read.pixels().iter().zip(ramp.pixels()).map(|(p, q)| (p.g - q.g).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-4, "{worst}");

    let bytes = std::fs::read(&path).unwrap();
    let e = io::read::<LinearRgb>(folder.with("cut.dpx", &bytes[..bytes.len() / 2])).unwrap_err().to_string();
    assert!(e.contains("cut.dpx: OpenImageIO") && !e.contains('\n'), "{e}");
}

/// Loading OpenImageIO costs 0.2 s and 260 libraries at every start.
#[cfg(target_os = "linux")]
#[test]
fn only_the_worker_links_openimageio() {
    let links = |program: &str| {
        let bytes = std::fs::read(program).unwrap();
        bytes.windows(14).any(|w| w == b"libOpenImageIO")
    };
    assert!(links(env!("CARGO_BIN_EXE_petcomp-oiio-worker")));
    #[cfg(feature = "cli")]
    assert!(!links(env!("CARGO_BIN_EXE_petcomp")));
}
