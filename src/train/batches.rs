//! Which images form a batch: one source each.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

/// Where images come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Photographs.
    Real,
    /// Images made by petcomp.
    Synthetic,
}

/// A batch of images of one source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Batch {
    /// Where they are from.
    pub source: Source,
    /// Their indices in the source's list.
    pub images: Vec<usize>,
}

/// How images are grouped into batches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchOptions {
    /// Images in a batch. Default: 32, the paper's.
    pub size: usize,
    /// Seed of the order. Default: 0.
    pub seed: u64,
}

impl Default for BatchOptions {
    fn default() -> Self {
        Self { size: 32, seed: 0 }
    }
}

/// The batches of an epoch: every image of both sources once, in an order that depends on seed and
/// epoch alone.
///
/// A source's last batch may be smaller. `size` 0 counts as 1.
pub fn batches(real: usize, synthetic: usize, epoch: u64, options: &BatchOptions) -> Vec<Batch> {
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(epoch);
    let mut all = Vec::new();
    for (source, count) in [(Source::Real, real), (Source::Synthetic, synthetic)] {
        let mut images: Vec<usize> = (0..count).collect();
        shuffle(&mut images, &mut rng);
        all.extend(images.chunks(options.size.max(1)).map(|images| Batch {
            source,
            images: images.to_vec(),
        }));
    }
    shuffle(&mut all, &mut rng);
    all
}

/// The shuffle of Fisher and Yates.
fn shuffle<T>(things: &mut [T], rng: &mut ChaCha8Rng) {
    for last in (1..things.len()).rev() {
        let count = last as u128 + 1;
        things.swap(last, ((u128::from(rng.next_u64()) * count) >> 64) as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_image_comes_once_an_epoch_and_batches_have_one_source() {
        let all = batches(1624, 4000, 3, &BatchOptions::default());
        assert_eq!(all.len(), 176);
        for (source, count) in [(Source::Real, 1624), (Source::Synthetic, 4000)] {
            let mut images: Vec<_> = all
                .iter()
                .filter(|b| b.source == source)
                .flat_map(|b| b.images.clone())
                .collect();
            images.sort_unstable();
            assert_eq!(images, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn sources_are_mixed_over_the_epoch() {
        let all = batches(320, 320, 0, &BatchOptions::default());
        let changes = all
            .windows(2)
            .filter(|pair| pair[0].source != pair[1].source)
            .count();
        assert!(changes > 3, "{changes}");
    }

    #[test]
    fn the_order_depends_on_seed_and_epoch_alone() {
        let plan = |seed, epoch| batches(50, 70, epoch, &BatchOptions { size: 8, seed });
        assert_eq!(plan(1, 2), plan(1, 2));
        assert_ne!(plan(1, 2), plan(1, 3));
        assert_ne!(plan(1, 2), plan(2, 2));
    }

    #[test]
    fn nothing_gives_no_batches() {
        assert!(batches(0, 0, 0, &BatchOptions { size: 0, seed: 0 }).is_empty());
    }
}
