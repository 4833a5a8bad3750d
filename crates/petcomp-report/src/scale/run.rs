//! One point: a dataset generated in this process.

use super::pictures::PictureInputs;
use super::process::peak_bytes;
use super::{ScaleCase, ScalePoint};
use crate::clock::cpu_seconds;
use crate::statistics::quantile;
use petcomp::settle::{SettleOptions, heap, settle};
use petcomp::{Error, Result, work};
use std::time::Instant;

/// Other load on the machine only ever adds to the time of a picture: the fastest of these rounds
/// counts.
const MAX_ROUNDS: u64 = 3;
const MAX_PICTURES_PER_ROUND: f64 = 1000.0;
/// Assumed minimum time of a picture, for the number of pictures in a round.
const LEAST_PICTURE_SECONDS: f64 = 1e-3;
/// Number of heaps whose falls are timed.
const TIMED_HEAPS: u64 = 5;

/// Generates pictures of a kind for about this many seconds of work, at least one on each thread,
/// and returns what they took.
///
/// For a process that does nothing else: memory is that of the whole process.
///
/// # Errors
/// A temporary folder that cannot be written; no threads; a system that does not report memory.
pub fn run(case: &ScaleCase, seconds: f64) -> Result<ScalePoint> {
    let inputs = PictureInputs::new(case);
    let pool = work::pool(case.threads).map_err(|e| Error::value("threads", e))?;
    pool.install(|| measure_point(case, &inputs, seconds))
}

fn measure_point(case: &ScaleCase, inputs: &PictureInputs, seconds: f64) -> Result<ScalePoint> {
    let first = Round::measure(inputs, 1)?;
    let (rounds, pictures) = first.plan_more(case.threads, seconds);
    let later = (0..rounds)
        .map(|_| Round::measure(inputs, pictures))
        .collect::<Result<Vec<_>>>()?;
    Ok(ScalePoint {
        case: *case,
        layers: first.layers,
        pictures: pictures * rounds,
        cpu_seconds: least(later.iter().map(|round| round.cpu)).min(first.cpu),
        rate: 1.0 / least(later.iter().map(|round| round.wall)),
        peak_bytes: peak_bytes()?,
    })
}

fn least(seconds: impl Iterator<Item = f64>) -> f64 {
    seconds.fold(f64::INFINITY, f64::min)
}

/// Seconds per picture in one round, of CPU time and of wall-clock time, and its layers.
struct Round {
    cpu: f64,
    wall: f64,
    layers: f64,
}

impl Round {
    fn measure(inputs: &PictureInputs, pictures: u64) -> Result<Self> {
        let (began, before) = (Instant::now(), cpu_seconds());
        let layers = inputs.make(pictures)?;
        Ok(Self {
            cpu: (cpu_seconds() - before) / pictures as f64,
            wall: began.elapsed().as_secs_f64() / pictures as f64,
            layers,
        })
    }

    /// Number of rounds, and of pictures in each, that fill this many seconds if every picture
    /// takes as long as this one.
    fn plan_more(&self, threads: usize, seconds: f64) -> (u64, u64) {
        // A picture that takes all of the time is generated once more, others in several rounds.
        let rounds = if self.cpu < seconds { MAX_ROUNDS } else { 1 };
        let each = self.cpu.max(self.wall).max(LEAST_PICTURE_SECONDS);
        let share = seconds * threads as f64 / (rounds as f64 * each);
        let pictures = share.ceil().clamp(threads as f64, MAX_PICTURES_PER_ROUND);
        (rounds, pictures as u64)
    }
}

/// Median CPU seconds until a heap of cards is at rest.
pub(super) fn fall_seconds(cards: usize) -> Result<f64> {
    let seconds = (0..TIMED_HEAPS)
        .map(|k| heap_seconds(k, cards))
        .collect::<Result<Vec<_>>>()?;
    Ok(quantile(seconds, 0.5))
}

/// Seconds until heap `k` is at rest.
fn heap_seconds(k: u64, cards: usize) -> Result<f64> {
    let scene = heap(k, cards)?;
    let before = cpu_seconds();
    settle(scene, &SettleOptions::default())?;
    Ok(cpu_seconds() - before)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: ScaleCase = ScaleCase {
        threads: 2,
        image: [320, 240],
        cards: 5,
        scale: 1.0,
    };

    #[test]
    fn a_point_has_time_memory_and_layers() {
        let point = run(&SMALL, 0.0).unwrap();
        assert_eq!((point.case, point.pictures), (SMALL, 2));
        assert!(point.rate > 0.0 && point.peak_bytes > 1e6 && point.cpu_seconds >= 0.0);
        // Five cards of 7 x 21 cm over 94 x 71 cm, of which bottles fill 0.79; soft borders touch a
        // few pixels more.
        assert!((0.08..0.13).contains(&point.layers), "{}", point.layers);
    }
}
