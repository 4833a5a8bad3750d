//! Which samples are for training and which for validation.

use crate::bounds::Bounds;
use crate::error::Result;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

const PERCENT: Bounds = Bounds::new(0.0, 100.0, "percent");

/// A part of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// For training.
    Train,
    /// For validation.
    Val,
}

impl Part {
    /// Both parts.
    pub const ALL: [Self; 2] = [Self::Train, Self::Val];

    /// The name of its folders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
        }
    }
}

/// How samples are split: by number alone, so the split is the same on every machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Split {
    /// Samples for validation, percent. Default: 20.
    #[serde(deserialize_with = "percent")]
    pub val_percent: u8,
    /// Which samples those are. Default: `interleaved`.
    pub order: SplitOrder,
    /// Length of a sequence, whose samples stay together: on a belt, that of its recipe. Default:
    /// 1; 0 is the same.
    #[serde(skip)]
    pub sequence: u64,
}

/// An invalid percentage is reported with the limits of a percentage, not those of its type.
fn percent<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<u8, D::Error> {
    let value = i64::deserialize(deserializer)?;
    let share = u8::try_from(value).ok();
    share
        .filter(|&share| PERCENT.contains(share.into()))
        .ok_or_else(|| D::Error::custom(PERCENT.refusal(value as f64)))
}

impl Default for Split {
    fn default() -> Self {
        Self {
            val_percent: 20,
            order: SplitOrder::Interleaved,
            sequence: 1,
        }
    }
}

/// Which samples are for validation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitOrder {
    /// Evenly spread: at 20 percent every fifth, 0, 5, 10, ...; does not depend on how many samples
    /// there are.
    #[default]
    Interleaved,
    /// The last ones, as the paper splits its series of real photos.
    Consecutive,
}

impl Split {
    pub(crate) fn check(&self) -> Result<()> {
        PERCENT.check("val_percent", self.val_percent.into())
    }

    /// The part of sample `k` of `count`.
    pub fn part(&self, k: u64, count: u64) -> Part {
        if self.is_val(k, count) {
            Part::Val
        } else {
            Part::Train
        }
    }

    fn is_val(&self, k: u64, count: u64) -> bool {
        let length = self.sequence.max(1);
        let (k, count) = (k / length, count.div_ceil(length));
        let next = k.saturating_add(1);
        match self.order {
            SplitOrder::Interleaved => self.train_before(next) == self.train_before(k),
            SplitOrder::Consecutive => u128::from(k) >= self.train_before(count),
        }
    }

    /// Samples (or sequences) for training among the first `n`.
    fn train_before(&self, n: u64) -> u128 {
        let percent = 100 - u128::from(self.val_percent.min(100));
        u128::from(n) * percent / 100
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_share_is_told_what_one_is() {
        for (value, is_share) in [
            (-5, false),
            (0, true),
            (100, true),
            (101, false),
            (300, false),
        ] {
            let split: Result<Split> = crate::io::parse_toml(&format!("val_percent = {value}"));
            let told = split.map_or_else(|e| e.to_string(), |_| String::new());
            assert_eq!(told.is_empty(), is_share, "{value}: {told}");
            let expected = format!("val_percent: {value}, expected 0 to 100 (percent)");
            assert!(is_share || told.starts_with(&expected), "{told}");
        }
    }

    fn val_of(split: Split, n: u64) -> Vec<u64> {
        let val = (0..n).filter(|&k| split.part(k, n) == Part::Val);
        val.collect()
    }

    /// A percentage for validation, of a number of samples.
    fn count(val_percent: u8, order: SplitOrder, n: u64) -> usize {
        let split = Split {
            val_percent,
            order,
            ..Split::default()
        };
        val_of(split, n).len()
    }

    #[test]
    fn five_thousand_samples_give_four_thousand_to_train_on() {
        for order in [SplitOrder::Interleaved, SplitOrder::Consecutive] {
            assert_eq!(count(20, order, 5000), 1000);
        }
    }

    #[test]
    fn every_fifth_sample_is_for_validation() {
        assert_eq!(val_of(Split::default(), 20), [0, 5, 10, 15]);
    }

    #[test]
    fn sequences_stay_together() {
        let split = Split {
            sequence: 4,
            ..Split::default()
        };
        assert_eq!(val_of(split, 40), [0, 1, 2, 3, 20, 21, 22, 23]);
    }

    #[test]
    fn a_consecutive_split_cuts_once_and_like_the_paper() {
        let split = Split {
            order: SplitOrder::Consecutive,
            ..Split::default()
        };
        assert!(val_of(split, 2031).into_iter().eq(2031 - 407..2031));
    }

    #[test]
    fn none_or_all_may_be_for_validation() {
        for order in [SplitOrder::Interleaved, SplitOrder::Consecutive] {
            assert_eq!([0, 100].map(|percent| count(percent, order, 7)), [0, 7]);
        }
    }
}
