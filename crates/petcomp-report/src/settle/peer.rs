//! Heaps for another program to settle.

use petcomp::Result;
use petcomp::scene::{Scene, SettleOptions};
use petcomp::settle::{Settled, heap, settle};
use serde::Serialize;
use std::time::Instant;

const HEAP_SIZES: [usize; 3] = [5, 20, 60];
const HEAPS_PER_SIZE: u64 = 3;
const TIMED_RUNS: usize = 5;

/// A heap for another program to settle, and our result.
#[derive(Clone, Debug, Serialize)]
pub struct PeerCase {
    /// Its name.
    pub name: String,
    /// The scene before the fall.
    pub scene: Scene,
    /// Width, height and thickness of each object's falling box, metres.
    pub boxes: Vec<[f64; 3]>,
    /// The scene after the fall.
    pub settled: Scene,
    /// Wall-clock times of five runs on one thread, milliseconds.
    pub wall_ms: Vec<f64>,
}

/// Heaps of 5, 20 and 60 cards for the comparison in `tests/benches/peers/settle.py`.
///
/// # Errors
/// A heap that does not settle.
pub fn peer_cases() -> Result<Vec<PeerCase>> {
    HEAP_SIZES
        .into_iter()
        .flat_map(|cards| (0..HEAPS_PER_SIZE).map(move |k| PeerCase::new(cards, k)))
        .collect()
}

impl PeerCase {
    /// Heap `k` with a number of cards.
    fn new(cards: usize, k: u64) -> Result<Self> {
        let options = SettleOptions::default();
        let scene = heap(k, cards)?;
        let (mut settled, mut wall_ms) = (scene.clone(), Vec::new());
        for _ in 0..TIMED_RUNS {
            let start = Instant::now();
            settled = settle(scene.clone(), &options).and_then(Settled::into_scene)?;
            wall_ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
        Ok(Self {
            name: format!("{cards} cards, heap {k}"),
            boxes: box_sizes(&scene, &options),
            settled,
            scene,
            wall_ms,
        })
    }
}

fn box_sizes(scene: &Scene, options: &SettleOptions) -> Vec<[f64; 3]> {
    scene
        .objects
        .iter()
        .map(|object| (options.half_body(object) * 2.0).into())
        .collect()
}
