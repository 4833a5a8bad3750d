//! Whole small files of every kind that is read.

use crate::build::{ihdr, png, stored, tags};
use crate::make::{Folder, codes, light, opaque_codes, tiff, with_bits};
use petcomp::io::{self, Bits, Compression, ToFile, WriteOptions};
use petcomp::{Coverage, Depth, Image};

/// A name whose ending is the format's, and the bytes.
pub(crate) type File = (&'static str, Vec<u8>);

/// Twenty files, none of them large.
pub(crate) fn all() -> Vec<File> {
    of_size(40, 30)
}

/// The same files; those that are written have this size.
pub(crate) fn of_size(w: usize, h: usize) -> Vec<File> {
    let matte = Image::from_fn(w, h, |x, y| Coverage((x * y) as f32 / (w * h) as f32));
    let depth = Image::from_fn(w, h, |x, y| Depth(1.0 + (x + y) as f32));
    let (rgba, rgb, lights) = (codes(w, h), opaque_codes(w, h), light(w, h));
    let [eight, sixteen] = [Bits::Eight, Bits::Sixteen].map(with_bits);
    let [half, float] = [Bits::Half, Bits::Float].map(with_bits);
    let compressed = |compression, options: &WriteOptions| WriteOptions {
        compression,
        ..options.clone()
    };
    vec![
        written("rgba8.png", &rgba, &eight),
        written("rgba16.png", &rgba, &sixteen),
        written("rgb8.png", &rgb, &eight),
        written("grey8.png", &matte, &eight),
        written("rgb.jpg", &rgb, &WriteOptions::default()),
        written("grey.jpg", &matte, &WriteOptions::default()),
        written("half.exr", &lights, &half),
        written("float.exr", &lights, &compressed(Compression::None, &float)),
        written("piz.exr", &lights, &compressed(Compression::Piz, &half)),
        written("grey.exr", &matte, &half),
        written("depth.exr", &depth, &float),
        written("rgba8.tif", &rgba, &eight),
        written("rgba16.tif", &rgba, &sixteen),
        written("rgb16.tif", &rgb, &sixteen),
        written("float.tif", &lights, &float),
        written("grey16.tif", &matte, &sixteen),
        ("rgb.hdr", hdr(w, h)),
        ("palette.png", palette_png()),
        ("interlaced.png", interlaced_png()),
        ("tags.tif", tiff(&tags(8, 8, &[]), &Vec::from_iter(0..64))),
    ]
}

fn written<P: ToFile>(name: &'static str, image: &Image<P>, options: &WriteOptions) -> File {
    let folder = Folder::new();
    io::write_with(folder.file(name), image, options).unwrap();
    (name, std::fs::read(folder.file(name)).unwrap())
}

/// One of them.
pub(crate) fn named(name: &str) -> Vec<u8> {
    let mut files = all().into_iter();
    files.find(|(n, _)| *n == name).unwrap().1
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

fn interlaced_png() -> Vec<u8> {
    png(&[
        ihdr(2, 2, 8, 0, 1),
        (b"IDAT", stored(&[0, 1, 0, 2, 0, 3, 4])),
        (b"IEND", vec![]),
    ])
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
