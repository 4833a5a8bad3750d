//! Time of colour conversion, on pictures made in code.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use petcomp::{Image, LinearRgb, color};
use std::hint::black_box;

/// 4K.
const SIZE: (usize, usize) = (3840, 2160);

/// Colours of every brightness, a little below 0 and above 1 too, without a pattern that a branch
/// could learn.
fn picture() -> Image<LinearRgb> {
    let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 60_000.0 - 0.02;
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let i = 3 * (y * SIZE.0 + x);
        LinearRgb::new(value(i), value(i + 1), value(i + 2))
    })
}

fn benches(c: &mut Criterion) {
    let light = picture();
    let codes = color::to_srgb8(&light);
    let row = light.row(0);

    let mut whole = c.benchmark_group("color/3840x2160");
    whole
        .throughput(Throughput::Elements((SIZE.0 * SIZE.1) as u64))
        .sample_size(10);
    whole.bench_function("to_srgb8", |b| {
        b.iter(|| color::to_srgb8(black_box(&light)))
    });
    whole.bench_function("from_srgb8", |b| {
        b.iter(|| color::from_srgb8(black_box(&codes)))
    });
    whole.bench_function("shift_hsv", |b| {
        b.iter(|| black_box(&light).map(|c| color::shift_hsv(c, 20.0, 1.1, 0.9)));
    });
    whole.finish();

    let mut rows = c.benchmark_group("color/row-3840");
    rows.throughput(Throughput::Elements(row.len() as u64))
        .sample_size(20);
    let mut out = row.to_vec();
    rows.bench_function("decode_row", |b| {
        b.iter(|| color::decode_row(black_box(codes.row(0)), &mut out))
    });
    rows.bench_function("linear_to_srgb", |b| {
        b.iter(|| {
            black_box(row)
                .iter()
                .map(|c| color::linear_to_srgb(c.g))
                .sum::<f32>()
        });
    });
    rows.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
