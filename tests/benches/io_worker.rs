//! A 4K half EXR through OpenImageIO: in this process, and through its worker once that runs. One
//! run gives the ratio.

use petcomp::io::{self, Bits, ReadOptions, WriteOptions};
use petcomp::{Image, PremulRgba};
use std::time::{Duration, Instant};

const WIDTH: usize = 3840;
const HEIGHT: usize = 2160;
const ROUNDS: usize = 15;

/// A smooth picture with some grain, as a rendered frame has.
fn frame() -> Image<PremulRgba> {
    let grain = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 97) as f32 * 1e-3;
    Image::from_fn(WIDTH, HEIGHT, |x, y| {
        PremulRgba::new(x as f32 / 3840.0 + grain(x, y), y as f32 / 2160.0, 0.5, 1.0)
    })
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("4k.exr");
    let options = WriteOptions {
        bits: Some(Bits::Half),
        ..Default::default()
    };
    io::write_with(&path, &frame(), &options).expect("written");
    let read = ReadOptions::default();
    let here = || io::oiio::read::<PremulRgba>(&path).expect("read here");
    let there = || io::read_in_worker::<PremulRgba>(&path, &read).expect("read by the worker");
    assert!(here() == there(), "the same picture");
    // One after the other, so that other work on the machine meets both.
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        inside.push(timed(here));
        outside.push(timed(there));
    }
    let middle = |times: &mut Vec<Duration>| {
        times.sort();
        times[ROUNDS / 2].as_secs_f64()
    };
    let (inside, outside) = (middle(&mut inside), middle(&mut outside));
    println!(
        "4K half EXR by OpenImageIO: {:.0} ms in process, {:.0} ms through the worker",
        inside * 1e3,
        outside * 1e3
    );
    println!(
        "the worker costs {:.1} % more (at most 25 % wanted)",
        (outside / inside - 1.0) * 100.0
    );
}

fn timed<T>(call: impl FnOnce() -> T) -> Duration {
    let start = Instant::now();
    let _kept = call();
    start.elapsed()
}
