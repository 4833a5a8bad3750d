//! How much memory keying a 4K frame takes. A process of its own: the high-water mark is the
//! process's.

mod memory;

use memory::peak_growth;
use petcomp::matte::key::{KeyOptions, Keying, Screen};
use petcomp::{Image, LinearRgb, PremulRgba};

const WIDTH: usize = 3840;
const HEIGHT: usize = 2160;
/// One channel of 32-bit floats.
const CHANNEL: usize = WIDTH * HEIGHT * 4;

#[test]
fn a_frame_takes_its_output_and_two_channels_at_most() {
    let pixel = |x: usize, y: usize| {
        PremulRgba::new(
            0.3,
            0.2 + ((x * 31 + y * 17) % 97) as f32 * 0.005,
            0.25,
            1.0,
        )
    };
    let photo = Image::from_fn(WIDTH, HEIGHT, pixel);
    let job = Keying::new(&photo, Screen::Color(LinearRgb::new(0.1, 0.75, 0.2)));
    let options = KeyOptions::default();
    let grown = (
        peak_growth(|| job.run(&options).unwrap()),
        peak_growth(|| job.matte(&options).unwrap()),
    );
    let (Some(both), Some(alone)) = grown else {
        eprintln!("skipped: /proc/self does not tell the peak of memory here");
        return;
    };
    println!(
        "beyond its input: {:.2} channels; the matte alone: {:.2}",
        channels(both),
        channels(alone)
    );
    // The meter sees what is there in any case: five channels of output, or one, less the few pages
    // that the heap had.
    let seen = |outputs: usize| outputs * CHANNEL * 99 / 100;
    assert!(
        (seen(5)..=(5 + 2) * CHANNEL).contains(&both),
        "{} channels",
        channels(both)
    );
    assert!(
        (seen(1)..=(1 + 2) * CHANNEL).contains(&alone),
        "{} channels",
        channels(alone)
    );
}

fn channels(bytes: usize) -> f64 {
    bytes as f64 / CHANNEL as f64
}
