//! A photo becomes an asset: read, cut out, written, shown on the contact sheet. One thread; a
//! picture made in code.
//!
//! `petcomp asset add -vv PHOTO ... -j 1` tells which stage takes how much of it.

use criterion::{Criterion, criterion_group, criterion_main};
use petcomp::asset::{Library, PhotoEntry, Scale, add_photo, contact_sheets};
use petcomp::matte::CutOutOptions;
use petcomp::{Image, LinearRgb, io};
use std::path::Path;

/// A megapixel.
const SIZE: (usize, usize) = (1250, 800);

/// A grainy, see-through ellipse with an opaque band, on a grainy green screen.
fn photo() -> Image<LinearRgb> {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (u, v) = (
            x as f32 / SIZE.0 as f32 - 0.5,
            y as f32 / SIZE.1 as f32 - 0.5,
        );
        let grain = ((x * 7919 + y * 104_729) % 1009) as f32 / 1009.0 - 0.5;
        let screen = LinearRgb::new(0.045, 0.42, 0.085).scale(1.0 - 0.2 * u);
        let wall = ((x / 9) % 5) as f32 * 0.02;
        let seen = match 5.0 * u * u + 9.0 * v * v {
            r if r > 1.0 => screen,
            r if r > 0.9 || u.abs() < 0.1 => LinearRgb::new(0.5, 0.1 + wall, 0.3),
            _ => screen.scale(0.5) + LinearRgb::grey(0.03 + wall),
        };
        seen + LinearRgb::grey(0.01 * grain)
    })
}

fn add(photo: &Path, folder: &Path) -> petcomp::Result<Vec<Image<petcomp::Srgb8>>> {
    let entry = PhotoEntry::new(photo, "bottle", "cap_label", Scale::Length(0.25));
    add_photo(folder, &entry, &[], &CutOutOptions::default())?;
    contact_sheets(&Library::open(folder)?).collect()
}

fn asset(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder for the bench");
    let file = folder.path().join("photo.png");
    io::write(&file, &photo()).expect("the photo is written");
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let out = folder.path().join("assets");
    c.bench_function("asset/add/1250x800", |b| {
        b.iter(|| one.install(|| add(&file, &out)).expect("a cut-out"))
    });
}

criterion_group!(benches, asset);
criterion_main!(benches);
