//! Whole small files of every kind that is read.

use crate::build::{ihdr, png, stored, tags};
use crate::make::{Folder, codes, light, opaque_codes, tiff};
use petcomp::io::{self, Bits, Compression, ToFile, WriteOptions};
use petcomp::{Coverage, Depth, Image};

/// Twenty files, none of them large.
pub(crate) fn all() -> Vec<(&'static str, Vec<u8>)> {
    let folder = Folder::new();
    let (w, h) = (40, 30);
    let mut files = Vec::new();
    let mut add = |name: &'static str,
                   bits: Option<Bits>,
                   compression,
                   write: &dyn Fn(&std::path::Path, &WriteOptions)| {
        let path = folder.file(name);
        write(
            &path,
            &WriteOptions {
                bits,
                compression,
                ..Default::default()
            },
        );
        files.push((name, std::fs::read(path).unwrap()));
    };
    fn to<P: ToFile>(image: &Image<P>) -> impl Fn(&std::path::Path, &WriteOptions) {
        move |path, options| io::write_with(path, image, options).unwrap()
    }
    let matte = Image::from_fn(w, h, |x, y| Coverage((x * y) as f32 / 1200.0));
    let depth = Image::from_fn(w, h, |x, y| Depth(1.0 + (x + y) as f32));
    let (rgba, rgb, lights) = (codes(w, h), opaque_codes(w, h), light(w, h));
    let zip = Compression::Zip;
    add("rgba8.png", Some(Bits::Eight), zip, &to(&rgba));
    add("rgba16.png", Some(Bits::Sixteen), zip, &to(&rgba));
    add("rgb8.png", Some(Bits::Eight), zip, &to(&rgb));
    add("grey8.png", Some(Bits::Eight), zip, &to(&matte));
    add("rgb.jpg", None, zip, &to(&rgb));
    add("grey.jpg", None, zip, &to(&matte));
    add("half.exr", Some(Bits::Half), zip, &to(&lights));
    add(
        "float.exr",
        Some(Bits::Float),
        Compression::None,
        &to(&lights),
    );
    add("piz.exr", Some(Bits::Half), Compression::Piz, &to(&lights));
    add("grey.exr", Some(Bits::Half), zip, &to(&matte));
    add("depth.exr", Some(Bits::Float), zip, &to(&depth));
    add("rgba8.tif", Some(Bits::Eight), zip, &to(&rgba));
    add("rgba16.tif", Some(Bits::Sixteen), zip, &to(&rgba));
    add("rgb16.tif", Some(Bits::Sixteen), zip, &to(&rgb));
    add("float.tif", Some(Bits::Float), zip, &to(&lights));
    add("grey16.tif", Some(Bits::Sixteen), zip, &to(&matte));
    files.push(("rgb.hdr", hdr(w, h)));
    files.push(("palette.png", palette_png()));
    files.push((
        "interlaced.png",
        png(&[
            ihdr(2, 2, 8, 0, 1),
            (b"IDAT", stored(&[0, 1, 0, 2, 0, 3, 4])),
            (b"IEND", vec![]),
        ]),
    ));
    files.push((
        "tags.tif",
        tiff(&tags(8, 8, &[]), &(0..64).collect::<Vec<u8>>()),
    ));
    files
}

/// One of them.
pub(crate) fn named(name: &str) -> (&'static str, Vec<u8>) {
    all().into_iter().find(|(n, _)| *n == name).unwrap()
}

fn hdr(w: usize, h: usize) -> Vec<u8> {
    let pixels: Vec<_> = (0..w * h)
        .map(|i| image::Rgb([i as f32, 0.5, 2.0]))
        .collect();
    let mut out = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut out)
        .encode(&pixels, w, h)
        .unwrap();
    out
}

fn palette_png() -> Vec<u8> {
    let rows = [0, 0, 1, 0, 1, 0];
    png(&[
        ihdr(2, 2, 8, 3, 0),
        (b"PLTE", vec![255, 0, 0, 0, 0, 255]),
        (b"IDAT", stored(&rows)),
        (b"IEND", vec![]),
    ])
}
