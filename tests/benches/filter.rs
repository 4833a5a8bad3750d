//! Time of filters, on pictures made in code.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use petcomp::{Image, LinearRgb, PremulRgba, filter};
use std::hint::black_box;

/// 4K.
const SIZE: (usize, usize) = (3840, 2160);

fn benches(c: &mut Criterion) {
    let color = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        LinearRgb::new(x as f32, y as f32, (x * y % 255) as f32)
    });
    let cutout: Image<PremulRgba> = color.map(LinearRgb::opaque);
    let mask = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        (x / 16 * 7919 + y / 16 * 104_729) % 37 == 0
    });
    let small = filter::reduce(&cutout);

    let mut group = c.benchmark_group("filter/3840x2160");
    group
        .throughput(Throughput::Elements((SIZE.0 * SIZE.1) as u64))
        .sample_size(10);
    group.bench_function("resize-to-640x360-rgb", |b| {
        b.iter(|| filter::resize(black_box(&color), 640, 360))
    });
    group.bench_function("resize-to-640x360-rgba", |b| {
        b.iter(|| filter::resize(black_box(&cutout), 640, 360))
    });
    group.bench_function("halve-rgba", |b| {
        b.iter(|| filter::halve(black_box(&cutout)))
    });
    group.bench_function("reduce-rgba", |b| {
        b.iter(|| filter::reduce(black_box(&cutout)))
    });
    group.bench_function("expand-rgba", |b| {
        b.iter(|| filter::expand(black_box(&small), SIZE.0, SIZE.1))
    });
    group.bench_function("gaussian-sigma-3-rgb", |b| {
        b.iter(|| filter::gaussian_blur(black_box(&color), 3.0))
    });
    group.bench_function("gaussian-sigma-3-rgba", |b| {
        b.iter(|| filter::gaussian_blur(black_box(&cutout), 3.0))
    });
    group.bench_function("box-radius-8-rgba", |b| {
        b.iter(|| filter::box_blur(black_box(&cutout), 8))
    });
    group.bench_function("dilate-radius-5", |b| {
        b.iter(|| filter::dilate(black_box(&mask), 5.0))
    });
    group.bench_function("dilate-radius-200", |b| {
        b.iter(|| filter::dilate(black_box(&mask), 200.0))
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
