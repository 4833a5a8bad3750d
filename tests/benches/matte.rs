//! The keyer against a plain copy of the same buffers, and the two ways to blur against each other.
//!
//! `cargo bench --bench matte`: every line is one 4K frame on all cores, into pictures that are
//! already allocated.

#[path = "peers/all_stages.rs"]
mod all_stages;

use all_stages::all_stages;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use petcomp::matte::key::{Blur, KeyOptions, Keyed, Keying, Profile, Screen};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Duration;

const WIDTH: usize = 3840;
const HEIGHT: usize = 2160;
const SCREEN: LinearRgb = LinearRgb::new(0.1, 0.75, 0.2);
/// Rows a copying task takes at once.
const COPY_ROWS: usize = 32;

/// A striped, soft-edged disc before a noisy, unevenly lit screen.
fn studio() -> Image<PremulRgba> {
    let radius = HEIGHT as f32 * 0.35;
    Image::from_fn(WIDTH, HEIGHT, |x, y| {
        let (dx, dy) = (
            x as f32 - WIDTH as f32 * 0.5,
            y as f32 - HEIGHT as f32 * 0.5,
        );
        let cover = ((radius - dx.hypot(dy)) / 8.0 + 0.5).clamp(0.0, 1.0);
        let front = if (x / 40 + y / 40) % 2 == 0 {
            [0.6, 0.3, 0.2]
        } else {
            [0.75, 0.72, 0.7]
        };
        let light = 0.95 + 0.1 * x as f32 / WIDTH as f32;
        let channel = |k: usize, screen: f32| {
            light * (cover * front[k] + (1.0 - cover) * screen) + noise(x, y, k)
        };
        PremulRgba::new(
            channel(0, SCREEN.r),
            channel(1, SCREEN.g),
            channel(2, SCREEN.b),
            1.0,
        )
    })
}

/// Grain of about half a percent, a fixed function of the place.
fn noise(x: usize, y: usize, k: usize) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b9)
        ^ (y as u32).wrapping_mul(0x85eb_ca6b)
        ^ (k as u32).wrapping_mul(0xc2b2_ae35);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h >> 8) as f32 / (1 << 24) as f32 - 0.5) * 0.02
}

/// What no keyer can beat: colours read, colours and a matte written.
fn copy(photo: &Image<PremulRgba>, keyed: &mut Keyed) {
    let rows = WIDTH * COPY_ROWS;
    let cutout = keyed.cutout.pixels_mut().par_chunks_mut(rows);
    let matte = keyed.matte.pixels_mut().par_chunks_mut(rows);
    photo
        .pixels()
        .par_chunks(rows)
        .zip(cutout)
        .zip(matte)
        .for_each(|((from, to), matte)| {
            to.copy_from_slice(from);
            matte.fill(Coverage(1.0));
        });
}

/// What no matte can beat: colours read, a matte written.
fn read(photo: &Image<PremulRgba>, matte: &mut Image<Coverage>) {
    let rows = WIDTH * COPY_ROWS;
    let matte = matte.pixels_mut().par_chunks_mut(rows);
    photo
        .pixels()
        .par_chunks(rows)
        .zip(matte)
        .for_each(|(from, to)| {
            from.iter()
                .zip(to)
                .for_each(|(p, m)| m.0 = p.r + p.g + p.b + p.a);
        });
}

fn bench(c: &mut Criterion) {
    let photo = studio();
    let job = Keying::new(&photo, Screen::Color(SCREEN));
    let mut keyed = job.run(&KeyOptions::default()).unwrap();
    let mut group = c.benchmark_group("matte/3840x2160");
    group.throughput(Throughput::Elements((WIDTH * HEIGHT) as u64));
    group
        .sample_size(20)
        .measurement_time(Duration::from_secs(4));
    group.bench_function("copy", |b| b.iter(|| copy(black_box(&photo), &mut keyed)));
    group.bench_function("key/defaults", |b| {
        b.iter(|| job.run_into(&KeyOptions::default(), &mut keyed).unwrap())
    });
    group.bench_function("key/defaults, new pictures", |b| {
        b.iter(|| job.run(&KeyOptions::default()).unwrap())
    });
    let mut matte = keyed.matte.clone();
    group.bench_function("read", |b| b.iter(|| read(black_box(&photo), &mut matte)));
    group.bench_function("key/matte only", |b| {
        b.iter(|| job.matte_into(&KeyOptions::default(), &mut matte).unwrap());
    });
    for (name, profile) in Profile::ALL {
        let options = all_stages(profile);
        group.bench_function(format!("key/all stages, {name}"), |b| {
            b.iter(|| job.run_into(&options, &mut keyed).unwrap())
        });
    }
    for (size, blur, name) in BLURS {
        let options = blurred(size, blur);
        group.bench_function(format!("blur {size}, {name}"), |b| {
            b.iter(|| job.matte_into(&options, &mut matte).unwrap())
        });
    }
    group.finish();
    compare_blurs(&job);
}

/// Sizes at which the two ways to blur are compared.
const BLURS: [(u32, Blur, &str); 6] = [
    (6, Blur::Exact, "exact"),
    (6, Blur::RunningSum, "running sum"),
    (20, Blur::Exact, "exact"),
    (20, Blur::RunningSum, "running sum"),
    (60, Blur::Exact, "exact"),
    (60, Blur::RunningSum, "running sum"),
];

/// Both blurs of one size, all else at its default.
fn blurred(size: u32, blur: Blur) -> KeyOptions {
    KeyOptions {
        blur_pre: size,
        blur_post: size,
        blur,
        ..KeyOptions::default()
    }
}

/// Prints by how much the matte differs between the two ways to blur.
fn compare_blurs(job: &Keying<'_, PremulRgba>) {
    for size in [6, 20, 60] {
        let [exact, running] =
            [Blur::Exact, Blur::RunningSum].map(|blur| job.matte(&blurred(size, blur)).unwrap());
        let both = exact.pixels().iter().zip(running.pixels());
        let (max, sum) = both.fold((0.0f64, 0.0), |(max, sum), (a, b)| {
            let d = f64::from((a.0 - b.0).abs());
            (max.max(d), sum + d)
        });
        println!(
            "blur {size}, exact - running sum: max {max:.2e}, mean {:.2e}",
            sum / exact.pixels().len() as f64
        );
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
