//! Segmentation and cutting out, on a picture made in code.

use criterion::{Criterion, criterion_group, criterion_main};
use petcomp::matte::{CutOutOptions, SegmentOptions, cut_out, segment};
use petcomp::{Image, LinearRgb};
use std::hint::black_box;

/// A striped ellipse on a slightly grainy green screen.
fn photo(width: usize, height: usize) -> Image<LinearRgb> {
    Image::from_fn(width, height, |x, y| {
        let (u, v) = (
            x as f32 / width as f32 - 0.5,
            y as f32 / height as f32 - 0.5,
        );
        let grain = ((x * 7919 + y * 104_729) % 101) as f32 * 1e-4;
        let object = LinearRgb::new(0.5, if (x / 9) % 2 == 0 { 0.1 } else { 0.4 }, 0.3);
        if 6.0 * u * u + 14.0 * v * v < 1.0 {
            object
        } else {
            LinearRgb::new(0.04, 0.4 + grain, 0.08)
        }
    })
}

fn segmentation(c: &mut Criterion) {
    for (width, height) in [(640, 480), (1920, 1080)] {
        let photo = photo(width, height);
        c.bench_function(&format!("segment/{width}x{height}"), |b| {
            b.iter(|| segment(black_box(&photo), &SegmentOptions::default()));
        });
        c.bench_function(&format!("cut_out/{width}x{height}"), |b| {
            b.iter(|| cut_out(black_box(&photo), &CutOutOptions::default()));
        });
    }
}

criterion_group!(benches, segmentation);
criterion_main!(benches);
