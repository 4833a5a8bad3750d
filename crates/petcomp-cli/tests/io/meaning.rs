//! What the samples of a file mean, and that they come back.

use crate::build::{inserted, segment};
use crate::make::{Folder, codes, exif, light, opaque_codes, with_bits};
use petcomp::io::{self, Bits, Compression, WriteOptions};
use petcomp::{Coverage, Depth, Image, LinearRgb, PremulRgba, Srgb8, Srgba8, StraightRgba, color};
use std::path::PathBuf;

/// 128/255 of the light of white is displayed as 188. Multiplying display values gives 128,
/// decoding that again 55.
#[test]
fn half_alpha_white_over_black_is_displayed_as_188() {
    let folder = Folder::new();
    let path = folder.file("half.png");
    let [r, g, b] = [255; 3];
    let white = Image::filled(2, 2, Srgba8 { r, g, b, a: 128 });
    io::write(&path, &white).unwrap();
    let pixel = io::read::<PremulRgba>(&path).unwrap()[(0, 0)];
    let [r, g, b] = [188; 3];
    assert_eq!(color::encode_srgb8(pixel.color()), Srgb8 { r, g, b });
    assert_eq!(pixel.a, 128.0 / 255.0);
}

#[test]
fn eight_bit_colours_come_back_code_by_code() {
    let folder = Folder::new();
    for name in ["a.png", "a.tif"] {
        let path = folder.file(name);
        io::write_with(&path, &codes(16, 9), &with_bits(Bits::Eight)).unwrap();
        let read = io::read::<StraightRgba>(&path).unwrap();
        io::write_with(&path, &read, &with_bits(Bits::Eight)).unwrap();
        assert_eq!(
            io::read::<StraightRgba>(&path).unwrap().pixels(),
            read.pixels()
        );
        let first = color::decode_srgb8(opaque_codes(16, 9)[(7, 4)]);
        assert_eq!(
            (read[(7, 4)].r, read[(7, 4)].g, read[(7, 4)].b),
            (first.r, first.g, first.b),
            "{name}"
        );
    }
}

#[test]
fn sixteen_bits_are_display_encoded_too() {
    let folder = Folder::new();
    let grey = Image::filled(3, 2, LinearRgb::grey(0.18));
    for name in ["a.png", "a.tif"] {
        let path = folder.file(name);
        io::write_with(&path, &grey, &with_bits(Bits::Sixteen)).unwrap();
        let back = io::read::<LinearRgb>(&path).unwrap()[(0, 0)];
        assert!((back.g - 0.18).abs() < 2e-5, "{name}: {back:?}");
    }
    let code = image::open(folder.file("a.png")).unwrap().into_rgb16()[(0, 0)][0];
    assert!((f32::from(code) / 65_535.0 - color::linear_to_srgb(0.18)).abs() < 1e-5);
}

#[test]
fn floats_come_back_bit_by_bit_and_halves_rounded() {
    let folder = Folder::new();
    for name in ["a.exr", "a.tif"] {
        let path = folder.file(name);
        io::write_with(&path, &light(17, 5), &with_bits(Bits::Float)).unwrap();
        assert_eq!(
            io::read::<PremulRgba>(&path).unwrap().pixels(),
            light(17, 5).pixels(),
            "{name}"
        );
    }
    let path = folder.file("half.exr");
    for compression in [Compression::None, Compression::Zip, Compression::Piz] {
        let options = WriteOptions {
            compression,
            ..Default::default()
        };
        io::write_with(&path, &light(17, 5), &options).unwrap();
        let back = io::read::<PremulRgba>(&path).unwrap();
        // A half float has 11 significant bits.
        let near = |p: f32, q: f32| (p - q).abs() <= q.abs() / 2048.0;
        let all = back
            .pixels()
            .iter()
            .zip(light(17, 5).into_vec())
            .all(|(p, q)| near(p.r, q.r) && near(p.g, q.g) && near(p.b, q.b) && near(p.a, q.a));
        assert!(all, "{compression:?}");
        assert_eq!(io::read_header(&path).unwrap().bits, 16);
    }
}

#[test]
fn mattes_and_depths_are_plain_numbers() {
    let folder = Folder::new();
    let matte = Image::from_fn(8, 3, |x, _| Coverage(x as f32 / 5.0));
    for (name, bits) in [
        ("m.png", Bits::Eight),
        ("m.tif", Bits::Sixteen),
        ("m.exr", Bits::Float),
    ] {
        io::write_with(folder.file(name), &matte, &with_bits(bits)).unwrap();
        let back = io::read::<Coverage>(folder.file(name)).unwrap();
        assert_eq!(back[(1, 2)], Coverage(0.2), "{name}");
    }
    let depth = Image::filled(2, 2, Depth(1.25));
    for name in ["z.exr", "z.tif"] {
        io::write(folder.file(name), &depth).unwrap();
        assert_eq!(
            io::read::<Depth>(folder.file(name)).unwrap()[(1, 1)],
            Depth(1.25)
        );
    }
    let e = io::write(folder.file("z.png"), &depth)
        .unwrap_err()
        .to_string();
    assert!(
        e.ends_with("z.png: a depth needs .exr or .tif, and a film .exr"),
        "{e}"
    );
    assert!(!folder.file("z.png").exists());
}

#[test]
fn a_photo_is_opaque_and_a_cut_out_always_has_alpha() {
    let folder = Folder::new();
    io::write(folder.file("clear.png"), &codes(4, 4)).unwrap();
    let e = io::read::<LinearRgb>(folder.file("clear.png"))
        .unwrap_err()
        .to_string();
    assert!(e.contains("pixels with alpha below 1"), "{e}");
    io::write(folder.file("photo.jpg"), &opaque_codes(4, 4)).unwrap();
    assert!(
        io::read::<PremulRgba>(folder.file("photo.jpg"))
            .unwrap()
            .pixels()
            .iter()
            .all(|p| p.a == 1.0)
    );
    let e = io::write(folder.file("clear.jpg"), &codes(4, 4))
        .unwrap_err()
        .to_string();
    assert!(e.contains("JPEG has no alpha"), "{e}");
}

#[test]
fn not_a_number_never_reaches_an_integer_file() {
    let folder = Folder::new();
    let wild = Image::from_vec(
        2,
        1,
        vec![
            LinearRgb::new(f32::NAN, f32::INFINITY, -1.0),
            LinearRgb::WHITE,
        ],
    );
    io::write(folder.file("a.png"), &wild).unwrap();
    assert_eq!(
        io::read::<LinearRgb>(folder.file("a.png")).unwrap()[(0, 0)],
        LinearRgb::new(0.0, 1.0, 0.0)
    );
}

#[test]
fn named_channels_and_texts_come_back() {
    let folder = Folder::new();
    let path = folder.file("layers.exr");
    let red = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let channels = vec![
        ("diffuse.R", red.clone()),
        ("diffuse.U", red.clone()),
        ("Z", vec![9.0; 6]),
    ];
    let notes = [
        ("petcomp:seed".to_string(), "17".to_string()),
        ("petcomp:stage".to_string(), "render".to_string()),
    ];
    let canvas = io::Canvas::default();
    io::exr::write_channels(&path, (3, 2), canvas, channels, &notes).unwrap();
    let (size, channels) = io::exr::read_channels(&path).unwrap();
    assert_eq!(size, (3, 2));
    assert_eq!(
        channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(),
        ["Z", "diffuse.R", "diffuse.U"]
    );
    assert_eq!(channels[1].samples, red);
    assert_eq!(io::read::<Depth>(&path).unwrap()[(0, 0)], Depth(9.0));
    assert_eq!(io::read_header(&path).unwrap().metadata, notes);
    let e = io::read::<LinearRgb>(&path).unwrap_err().to_string();
    assert!(
        e.contains("has the channels Z diffuse.R diffuse.U, expected R G B or Y"),
        "{e}"
    );
    let short = vec![("Z", vec![1.0])];
    assert!(io::exr::write_channels(&path, (3, 2), canvas, short, &[]).is_err());
}

#[test]
fn texts_are_kept_by_every_format() {
    let folder = Folder::new();
    let metadata = vec![("petcomp:seed".to_string(), "17".to_string())];
    let options = WriteOptions {
        metadata: metadata.clone(),
        ..Default::default()
    };
    for name in ["a.png", "a.jpg", "a.tif", "a.exr"] {
        io::write_with(folder.file(name), &opaque_codes(8, 8), &options).unwrap();
        let header = io::read_header(folder.file(name)).unwrap();
        assert!(header.metadata.contains(&metadata[0]), "{name}: {header:?}");
        assert_eq!(
            (header.width, header.height, header.channels.len()),
            (8, 8, 3)
        );
    }
    let exr = io::read_header(folder.file("a.exr")).unwrap();
    assert!(
        exr.metadata
            .iter()
            .any(|(key, value)| key == "petcomp:colorspace" && value.contains("Rec. 709"))
    );
}

#[test]
fn the_same_picture_gives_the_same_bytes() {
    let folder = Folder::new();
    let notes = (0..9)
        .map(|i| (format!("petcomp:{i}"), "x".to_string()))
        .collect();
    let options = WriteOptions {
        metadata: notes,
        ..Default::default()
    };
    for name in ["a.png", "a.jpg", "a.tif", "a.exr"] {
        let write = || {
            io::write_with(folder.file(name), &opaque_codes(200, 150), &options).unwrap();
            std::fs::read(folder.file(name)).unwrap()
        };
        assert_eq!(write(), write(), "{name}");
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        4,
        "something temporary is left"
    );
}

/// A picture of 3 x 2 in a corner colour pattern, turned by each of the eight orientations.
#[test]
fn cameras_held_any_way_give_upright_pictures() {
    let folder = Folder::new();
    let corner = |x: usize, y: usize| Srgb8 {
        r: 255 * x as u8,
        g: 255 * y as u8,
        b: 0,
    };
    let stored = Image::from_fn(48, 32, |x, y| corner(x / 24, y / 16));
    for orientation in 1..=8u8 {
        for path in oriented(&folder, &stored, orientation) {
            let upright = io::read::<LinearRgb>(&path).unwrap();
            let header = io::read_header(&path).unwrap();
            assert_eq!(upright.size(), (header.width, header.height));
            assert_eq!(
                upright.width() > upright.height(),
                orientation < 5,
                "{orientation}"
            );
            let first = upright[(2, 2)];
            // EXIF 2.3, tag 274: which stored corner is at the visual top left.
            let expected = match orientation {
                1 | 5 => (0.0, 0.0),
                2 | 8 => (1.0, 0.0),
                3 | 7 => (1.0, 1.0),
                _ => (0.0, 1.0),
            };
            let off = (first.r - expected.0)
                .abs()
                .max((first.g - expected.1).abs());
            assert!(
                off < 0.05,
                "{}: {first:?}, orientation {orientation}",
                path.display()
            );
            if path.extension().is_some_and(|e| e != "tif") {
                assert_eq!(header.focal_35mm, Some(28.0));
            }
        }
    }
}

#[test]
fn pictures_behind_the_first_of_a_jpeg_leave_its_orientation() {
    let folder = Folder::new();
    let stored = Image::filled(48, 32, Srgb8 { r: 9, g: 9, b: 9 });
    let [jpeg, ..] = oriented(&folder, &stored, 6);
    let burst = std::fs::read(&jpeg).unwrap().repeat(10);
    std::fs::write(&jpeg, burst).unwrap();
    let header = io::read_header(&jpeg).unwrap();
    let upright = io::read::<LinearRgb>(&jpeg).unwrap();
    assert_eq!((header.width, header.height), (32, 48));
    assert_eq!(upright.size(), (32, 48));
}

/// The same stored picture as JPEG, PNG and TIFF, with an orientation noted in each format's own
/// way.
fn oriented(folder: &Folder, stored: &Image<Srgb8>, orientation: u8) -> [PathBuf; 3] {
    let notes = exif(orientation, 28);
    io::write(folder.file("a.jpg"), stored).unwrap();
    let jpeg = std::fs::read(folder.file("a.jpg")).unwrap();
    let exif = segment(0xe1, &[&b"Exif\0\0"[..], &notes].concat());
    let jpeg = inserted(&jpeg, 2, &exif);

    let mut png = Vec::new();
    let mut info = png::Info::with_size(stored.width() as u32, stored.height() as u32);
    info.color_type = png::ColorType::Rgb;
    info.bit_depth = png::BitDepth::Eight;
    info.exif_metadata = Some(notes.into());
    let encoder = png::Encoder::with_info(&mut png, info).unwrap();
    encoder
        .write_header()
        .unwrap()
        .write_image_data(bytemuck::cast_slice(stored.pixels()))
        .unwrap();

    let mut tiff = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut tiff).unwrap();
    let mut image = encoder
        .new_image::<tiff::encoder::colortype::RGB8>(48, 32)
        .unwrap();
    image
        .encoder()
        .write_tag(tiff::tags::Tag::Orientation, u16::from(orientation))
        .unwrap();
    image
        .write_data(bytemuck::cast_slice(stored.pixels()))
        .unwrap();
    [
        folder.with("b.jpg", &jpeg),
        folder.with("b.png", &png),
        folder.with("b.tif", tiff.get_ref()),
    ]
}

#[test]
fn grey_and_palette_pngs_are_colour_too() {
    let folder = Folder::new();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(vec![255, 0, 0, 0, 0, 255]);
    encoder.set_trns(vec![255, 128]);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&[0, 1])
        .unwrap();
    let path = folder.with("palette.png", &bytes);
    let read = io::read::<StraightRgba>(&path).unwrap();
    let rgba = |x: usize| {
        let StraightRgba { r, g, b, a } = read[(x, 0)];
        [r, g, b, a]
    };
    assert_eq!(rgba(0), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(rgba(1), [0.0, 0.0, 1.0, 128.0 / 255.0]);
    io::write(folder.file("grey.png"), &Image::filled(1, 1, Coverage(1.0))).unwrap();
    assert_eq!(
        io::read::<LinearRgb>(folder.file("grey.png")).unwrap()[(0, 0)],
        LinearRgb::WHITE
    );
}
