//! Time to read and write a 640 x 480 picture in each format.

use criterion::{Criterion, criterion_group, criterion_main};
use petcomp::{Image, PremulRgba, Srgb8, io};
use std::hint::black_box;

/// A smooth picture with some grain, as a rendered frame has.
fn frame() -> Image<Srgb8> {
    Image::from_fn(640, 480, |x, y| {
        let grain = (x * 7919 + y * 104_729) % 8;
        Srgb8 {
            r: (x * 240 / 640 + grain) as u8,
            g: (y * 240 / 480 + grain) as u8,
            b: (128 + grain) as u8,
        }
    })
}

fn read_and_write(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let frame = frame();
    for name in ["a.png", "a.jpg", "a.tif", "a.exr"] {
        let path = folder.path().join(name);
        c.bench_function(&format!("write {name}"), |b| {
            b.iter(|| io::write(&path, black_box(&frame)).expect("written"))
        });
        c.bench_function(&format!("read {name}"), |b| {
            b.iter(|| io::read::<PremulRgba>(black_box(&path)).expect("read back"))
        });
    }
}

criterion_group!(benches, read_and_write);
criterion_main!(benches);
