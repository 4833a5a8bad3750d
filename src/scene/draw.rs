//! Random draws, each keyed by its name.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::fmt;

/// Random numbers of one scene: a draw is a pure function of `(seed, k, path)`.
///
/// No draw depends on how many were made before it, so a new object or a changed range changes no
/// other draw.
///
/// # Method
/// ChaCha with 8 rounds, whose 32-byte key is the seed, the index `k` (both little-endian `u64`)
/// and the 128-bit FNV-1a hash of the path's UTF-8 bytes (little-endian); the draw is the stream's
/// first `u64`. [FNV] is not cryptographic, which does not matter: paths are few and the hash only
/// has to tell them apart.
///
/// [FNV]: http://www.isthe.com/chongo/tech/comp/fnv/
#[derive(Clone, Copy, Debug)]
pub struct Draws<'a> {
    seed: u64,
    k: u64,
    log: Option<&'a DrawLog>,
}

/// Log of every draw, in order: where a scene's numbers came from.
#[derive(Clone, Debug, Default)]
pub struct DrawLog(RefCell<Vec<Drawn>>);

/// A draw and its value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawn {
    /// Its name: `objects[2].grade.hue_deg`.
    pub path: String,
    /// What it was drawn from.
    pub from: Distribution,
    /// The value; for a choice, its index in the list, from 0.
    pub value: f64,
}

/// Distribution that a value is drawn from; uniform, except for a histogram's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Numbers from the first to the second.
    Uniform([f64; 2]),
    /// Integers from the first to the second, both included.
    Whole([f64; 2]),
    /// Integers from the first to the second, weighted by a histogram.
    Weighted([f64; 2]),
    /// An index into a list of this length.
    Choice(usize),
}

impl Distribution {
    /// Whether it is a range of one value.
    pub(crate) fn is_fixed(&self) -> bool {
        matches!(self, Self::Uniform([min, max]) | Self::Whole([min, max]) if min == max)
    }
}

impl fmt::Display for Distribution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            from if from.is_fixed() => write!(f, "fixed"),
            Self::Uniform([min, max]) => write!(f, "uniform [{min}, {max}]"),
            Self::Whole([min, max]) => write!(f, "integer [{min}, {max}]"),
            Self::Weighted([min, max]) => write!(f, "histogram [{min}, {max}]"),
            Self::Choice(of) => write!(f, "one of {of}"),
        }
    }
}

impl DrawLog {
    /// The draws so far.
    pub fn into_draws(self) -> Vec<Drawn> {
        self.0.into_inner()
    }
}

impl<'a> Draws<'a> {
    /// The draws of scene `k` under `seed`; 0 is a seed like any other.
    pub fn new(seed: u64, k: u64) -> Self {
        Self { seed, k, log: None }
    }

    /// The same draws, each recorded in a log.
    pub fn logged(self, log: &'a DrawLog) -> Self {
        Self {
            log: Some(log),
            ..self
        }
    }

    /// Records a draw in the log, if there is one.
    pub(super) fn note(&self, path: &str, from: Distribution, value: f64) {
        if let Some(DrawLog(log)) = self.log {
            log.borrow_mut().push(Drawn {
                path: path.to_owned(),
                from,
                value,
            });
        }
    }

    /// 64 uniform bits.
    pub fn bits(&self, path: &str) -> u64 {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        key[8..16].copy_from_slice(&self.k.to_le_bytes());
        key[16..].copy_from_slice(&fnv1a_128(path.as_bytes()).to_le_bytes());
        ChaCha8Rng::from_seed(key).next_u64()
    }

    /// Uniform in `0.0..1.0`, a multiple of 2^-53.
    pub fn unit(&self, path: &str) -> f64 {
        (self.bits(path) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in `0..n`, from the high bits of the product; its bias is below `n / 2^64`.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn below(&self, path: &str, n: usize) -> usize {
        assert!(n > 0, "{path}: a choice from nothing");
        ((u128::from(self.bits(path)) * n as u128) >> 64) as usize
    }

    /// An index into a list of `n`, as [`below`](Self::below), recorded in the log.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn choose(&self, path: &str, n: usize) -> usize {
        let place = self.below(path, n);
        self.note(path, Distribution::Choice(n), place as f64);
        place
    }
}

/// The index at which the cumulative sum of weights exceeds a number; the last one with a positive
/// weight if rounding makes the number equal to the whole sum.
pub(super) fn weighted_place(weights: &[f64], number: f64) -> usize {
    let mut sums = weights.iter().scan(0.0, |sum, weight| {
        *sum += weight;
        Some(*sum)
    });
    let found = sums.position(|sum| sum > number);
    let last = weights.iter().rposition(|weight| *weight > 0.0);
    found.or(last).unwrap_or_default()
}

/// FNV-1a, 128 bits; constants of Fowler, Noll and Vo.
fn fnv1a_128(bytes: &[u8]) -> u128 {
    const FNV_OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const FNV_PRIME: u128 = (1 << 88) + 0x13b;
    bytes.iter().fold(FNV_OFFSET, |hash, &byte| {
        (hash ^ u128::from(byte)).wrapping_mul(FNV_PRIME)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noll's published test vectors.
    #[test]
    fn the_hash_is_fnv1a() {
        assert_eq!(fnv1a_128(b""), 0x6c62272e07bb014262b821756295c58d);
        assert_eq!(fnv1a_128(b"a"), 0xd228cb696f1a8caf78912b704e4a8964);
        assert_eq!(fnv1a_128(b"foobar"), 0x343e1662793c64bf6f0d3597ba446f18);
    }

    #[test]
    fn a_draw_depends_on_seed_index_and_path_alone() {
        let d = Draws::new(7, 3);
        let first = d.unit("objects[2].grade.hue_deg");
        d.unit("something else");
        assert_eq!(d.unit("objects[2].grade.hue_deg"), first);
        assert_ne!(Draws::new(7, 4).unit("objects[2].grade.hue_deg"), first);
        assert_ne!(Draws::new(8, 3).unit("objects[2].grade.hue_deg"), first);
        assert_ne!(d.unit("objects[3].grade.hue_deg"), first);
    }

    #[test]
    fn a_log_changes_nothing_and_forgets_nothing() {
        let log = DrawLog::default();
        let (plain, logged) = (Draws::new(7, 3), Draws::new(7, 3).logged(&log));
        assert_eq!(
            plain.choose("background", 4),
            logged.choose("background", 4)
        );
        let hue = crate::scene::Range::new(-20.0, 20.0);
        assert_eq!(hue.draw(&plain, "hue_deg"), hue.draw(&logged, "hue_deg"));
        let drawn = log.into_draws();
        let reported: Vec<String> = drawn
            .iter()
            .map(|d| format!("{} {}", d.path, d.from))
            .collect();
        assert_eq!(
            reported,
            ["background one of 4", "hue_deg uniform [-20, 20]"]
        );
        assert_eq!(drawn[1].value, hue.draw(&plain, "hue_deg"));
    }

    #[test]
    fn seed_and_index_do_not_trade_places() {
        assert_ne!(Draws::new(0, 1).bits("x"), Draws::new(1, 0).bits("x"));
    }

    /// Kolmogorov-Smirnov: below 1.95 / sqrt(n) in 999 of 1000 uniform samples.
    fn assert_uniform(mut u: Vec<f64>) {
        let n = u.len() as f64;
        u.sort_by(f64::total_cmp);
        let worst = u
            .iter()
            .enumerate()
            .map(|(i, u)| (u - i as f64 / n).abs().max((u - (i + 1) as f64 / n).abs()));
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 1.95 / n.sqrt(), "{worst} from uniform");
    }

    #[test]
    fn draws_are_uniform_over_indices_paths_and_seeds() {
        assert_uniform((0..10_000).map(|k| Draws::new(0, k).unit("a")).collect());
        assert_uniform(
            (0..10_000)
                .map(|i| Draws::new(0, 0).unit(&format!("objects[{i}].x")))
                .collect(),
        );
        assert_uniform((0..10_000).map(|s| Draws::new(s, 0).unit("a")).collect());
    }

    #[test]
    fn neighbouring_draws_are_uncorrelated() {
        let n = 10_000;
        let product = |k| {
            let d = Draws::new(0, k);
            (d.unit("objects[0].x") - 0.5) * (d.unit("objects[0].y") - 0.5) * 12.0
        };
        let correlation: f64 = (0..n).map(product).sum::<f64>() / n as f64;
        assert!(correlation.abs() < 4.0 / (n as f64).sqrt(), "{correlation}");
    }

    #[test]
    fn every_choice_is_equally_likely() {
        let mut counts = [0; 7];
        (0..70_000).for_each(|k| counts[Draws::new(1, k).below("pick", 7)] += 1);
        // Binomial: standard deviation 93.
        assert!(
            counts.iter().all(|c| (c - 10_000_i32).abs() < 5 * 93),
            "{counts:?}"
        );
    }
}
