//! How much a score would vary with other images.

use super::{Definition, EvalImage, Matches};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A value and its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The value of the actual sample.
    pub value: f64,
    /// Its lower end; by bootstrap the 2.5 % quantile of the resampled values.
    pub low: f64,
    /// Its upper end; the 97.5 % quantile.
    pub high: f64,
}

/// mAP@0.5:0.95 with its percentile bootstrap interval over images: each of `rounds` resamples
/// draws as many images with replacement as there are. Images of one [group](EvalImage::group) are
/// similar, so whole groups are drawn, as many as there are. The same seed gives the same interval.
/// A resample without any objects has no score and does not count.
///
/// # Method
/// [Efron 1979], percentile interval.
///
/// [Efron 1979]: https://doi.org/10.1214/aos/1176344552
pub fn bootstrap(
    sheets: &[EvalImage],
    definition: Definition,
    rounds: usize,
    seed: u64,
) -> Interval {
    Matches::new(sheets, definition).bootstrap(rounds, seed)
}

impl Matches {
    /// Like [`bootstrap()`].
    pub fn bootstrap(&self, rounds: usize, seed: u64) -> Interval {
        let rounds = (0..rounds as u64).into_par_iter();
        let values = rounds.filter_map(|round| {
            let times = drawn(self.group_count(), seed, round);
            let weights: Vec<u32> = self.groups().iter().map(|&group| times[group]).collect();
            self.map_if_any(&weights)
        });
        interval(self.map(&[]), values.collect())
    }
}

/// The percentile interval of resampled values; the value itself if there are none.
pub(crate) fn interval(value: f64, mut values: Vec<f64>) -> Interval {
    if values.is_empty() {
        return Interval {
            value,
            low: value,
            high: value,
        };
    }
    values.sort_by(f64::total_cmp);
    Interval {
        value,
        low: quantile(&values, 0.025),
        high: quantile(&values, 0.975),
    }
}

/// A quantile of sorted values, interpolated between two of them if necessary.
fn quantile(values: &[f64], q: f64) -> f64 {
    let place = q * values.len().saturating_sub(1) as f64;
    let (low, high) = (place as usize, (place as usize + 1).min(values.len() - 1));
    values[low] + (values[high] - values[low]) * (place - low as f64)
}

/// How often each of `count` items is drawn in `count` draws.
pub(crate) fn drawn(count: usize, seed: u64, round: u64) -> Vec<u32> {
    let mut rng = round_generator(seed, round);
    let mut times = vec![0; count];
    for _ in 0..count {
        times[index_below(count, &mut rng)] += 1;
    }
    times
}

fn round_generator(seed: u64, round: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(round);
    rng
}

fn index_below(count: usize, rng: &mut impl Rng) -> usize {
    // Multiply-shift: a bias below 2^-32 for any number of images that fits into memory.
    let draw = (u128::from(rng.next_u64()) * count as u128) >> 64;
    draw as usize
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn draws_add_up_and_depend_on_the_round_alone() {
        let times = drawn(50, 1, 2);
        assert_eq!((times.iter().sum::<u32>(), &times), (50, &drawn(50, 1, 2)));
        assert_ne!(times, drawn(50, 1, 3));
        assert!(drawn(0, 1, 2).is_empty());
    }

    #[test]
    fn an_interval_holds_its_value_and_shrinks_with_more_images() {
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let some = |n: usize| -> Vec<EvalImage> {
            let seen = |i: usize| {
                if i.is_multiple_of(3) {
                    vec![]
                } else {
                    vec![found(0, b, 0.5)]
                }
            };
            (0..n).map(|i| sheet(vec![there(0, b)], seen(i))).collect()
        };
        let [few, many] = [12, 300].map(|n| bootstrap(&some(n), Definition::Coco, 200, 7));
        assert!(few.low < few.value && few.value < few.high);
        assert!(many.high - many.low < 0.5 * (few.high - few.low));
    }

    #[test]
    fn images_of_a_sequence_are_drawn_together() {
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let image = |group: usize| {
            let found = vec![found(0, b, 0.5); group % 2];
            sheet(vec![there(0, b)], found)
        };
        let alone: Vec<EvalImage> = (0..12).map(image).collect();
        let frames = alone.iter().enumerate().flat_map(|(group, image)| {
            let frame = EvalImage {
                group: group.to_string(),
                ..image.clone()
            };
            vec![frame; 50]
        });
        let frames: Vec<EvalImage> = frames.collect();
        let [alone, frames] =
            [&alone, &frames].map(|sheets| bootstrap(sheets, Definition::Coco, 100, 7));
        for (alone, frames) in [(alone.low, frames.low), (alone.high, frames.high)] {
            assert!((alone - frames).abs() < 1e-9, "{alone} {frames}");
        }
    }

    #[test]
    fn a_draw_without_anything_to_find_is_no_score_of_zero() {
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let bare = || sheet(vec![], vec![]);
        let seen = || sheet(vec![there(0, b)], vec![found(0, b, 0.5)]);
        let sheets: Vec<EvalImage> = (0..20)
            .map(|i| if i < 2 { seen() } else { bare() })
            .collect();
        for definition in [Definition::Yolov5, Definition::Coco] {
            assert!(bootstrap(&sheets, definition, 1000, 0).low > 0.99);
            assert_eq!(
                bootstrap(&sheets[2..], definition, 100, 0),
                Interval::default()
            );
        }
    }

    #[test]
    fn no_rounds_give_a_point() {
        assert_eq!(
            interval(0.5, vec![]),
            Interval {
                value: 0.5,
                low: 0.5,
                high: 0.5
            }
        );
    }
}
