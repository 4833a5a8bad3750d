//! Run lengths in COCO's format: one text per mask.
//!
//! # Method
//! COCO's "compressed RLE", as its annotations define it: from the fourth run on, the difference
//! from the run two before is stored (runs of neighbouring columns are alike). Each number is
//! split, lowest bits first, into groups of five bits; the sixth bit of a group means that another
//! follows, the highest bit of the last group is the sign. A group is stored as the character that
//! many places after `0`.

use crate::bounds::{LONGEST_SIDE_PX, MOST_PIXELS};
use crate::label::RleMask;
use serde::{Deserialize, Serialize};

/// Code of the character for the group 0.
const GROUP_ZERO: u8 = b'0';

/// Bits in a group.
const GROUP_BITS: u32 = 5;

/// Set in a group if another follows.
const MORE_FLAG: u8 = 1 << GROUP_BITS;

/// Set in the last group of a negative number.
const SIGN_FLAG: u8 = 1 << (GROUP_BITS - 1);

/// A mask in a file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MaskText {
    /// Height and width: COCO's order.
    size: [u32; 2],
    counts: String,
}

impl From<RleMask> for MaskText {
    fn from(mask: RleMask) -> Self {
        let [w, h] = mask.size();
        Self {
            size: [h, w],
            counts: encode(mask.runs()),
        }
    }
}

impl TryFrom<MaskText> for RleMask {
    type Error = String;

    fn try_from(text: MaskText) -> Result<Self, String> {
        let [h, w] = text.size;
        check_size(w, h)?;
        let runs = decode(&text.counts).ok_or("counts: not COCO's compressed run lengths")?;
        let sum: u64 = runs.iter().map(|&n| u64::from(n)).sum();
        RleMask::from_runs([w, h], runs)
            .ok_or_else(|| format!("counts: runs of {sum} pixels in all, expected {w} x {h}"))
    }
}

/// The text of runs.
pub(crate) fn encode(runs: &[u32]) -> String {
    let mut text = String::new();
    for (i, &run) in runs.iter().enumerate() {
        push_number(&mut text, i64::from(run) - run_before(&runs[..i]));
    }
    text
}

/// The run that the next one is stored relative to.
fn run_before(runs: &[u32]) -> i64 {
    match runs {
        [_, .., before, _] => i64::from(*before),
        _ => 0,
    }
}

fn check_size(w: u32, h: u32) -> Result<(), String> {
    if w.max(h) <= LONGEST_SIDE_PX && u64::from(w) * u64::from(h) <= MOST_PIXELS {
        return Ok(());
    }
    Err(format!(
        "size: {w} x {h} pixels, expected at most {LONGEST_SIDE_PX} a side, {MOST_PIXELS} in all"
    ))
}

fn push_number(text: &mut String, mut number: i64) {
    loop {
        let group = (number as u8) & (MORE_FLAG - 1);
        number >>= GROUP_BITS;
        let is_last = number == sign_of(group);
        text.push(char::from(
            GROUP_ZERO + if is_last { group } else { group | MORE_FLAG },
        ));
        if is_last {
            return;
        }
    }
}

/// All higher bits after the last group.
#[inline]
fn sign_of(group: u8) -> i64 {
    if group & SIGN_FLAG == 0 { 0 } else { -1 }
}

/// The runs of a text; none if it is not a text of runs.
pub(crate) fn decode(text: &str) -> Option<Vec<u32>> {
    let mut runs: Vec<u32> = Vec::new();
    let mut bytes = text.bytes();
    while let Some(first) = bytes.next() {
        let number = pull_number(first, &mut bytes)?;
        let run = number.checked_add(run_before(&runs))?;
        runs.push(u32::try_from(run).ok()?);
    }
    Some(runs)
}

fn pull_number(first: u8, rest: &mut impl Iterator<Item = u8>) -> Option<i64> {
    let (mut number, mut shift, mut byte) = (0, 0, first);
    loop {
        let group = group_of(byte)?;
        number |= i64::from(group & (MORE_FLAG - 1)) << shift;
        shift += GROUP_BITS;
        if group & MORE_FLAG == 0 {
            return Some(number | sign_of(group) << shift);
        }
        // A difference of two runs has 33 bits: seven groups.
        byte = rest.next().filter(|_| shift < 7 * GROUP_BITS)?;
    }
}

#[inline]
fn group_of(letter: u8) -> Option<u8> {
    let group = letter.checked_sub(GROUP_ZERO);
    group.filter(|&group| group < 2 * MORE_FLAG)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_text_reads_back(runs in prop::collection::vec(any::<u32>(), 0..40)) {
            prop_assert_eq!(decode(&encode(&runs)), Some(runs));
        }

        #[test]
        fn what_is_no_text_of_runs_is_refused_without_panic(text in ".{0,40}") {
            let _ = decode(&text);
        }
    }

    /// Texts made by `encode` of pycocotools 2.0.11.
    #[test]
    fn texts_are_those_of_pycocotools() {
        let square = RleMask::from_fn([4, 5], |x, y| (1..3).contains(&x) && (1..4).contains(&y));
        let bars = RleMask::from_fn([640, 480], |x, y| match x {
            200..203 => (100..300).contains(&y),
            203 => (50..60).contains(&y),
            300..302 => (5..470).contains(&y),
            _ => false,
        });
        let none = RleMask::from_fn([640, 480], |_, _| false);
        let texts = [square, bars, none].map(|mask| encode(mask.runs()));
        assert_eq!(texts, ["63204", "Tkm2X6h8000^NRJSV]1W>VcbN0k]n4", "PP\\9"]);
    }

    #[test]
    fn a_mask_of_another_size_is_refused() {
        let read = |json: &str| serde_json::from_str::<RleMask>(json).map_err(|e| e.to_string());
        assert!(read(r#"{"size":[2,3],"counts":"06"}"#).is_ok());
        assert!(
            read(r#"{"size":[2,2],"counts":"06"}"#)
                .unwrap_err()
                .contains("6 pixels in all, expected 2 x 2")
        );
        assert!(read(r#"{"size":[2,3],"counts":"\u0007"}"#).is_err());
        let huge = |h: u32, w: u32| {
            let counts = encode(&[u32::try_from(u64::from(h) * u64::from(w)).unwrap_or(u32::MAX)]);
            read(&serde_json::json!({ "size": [h, w], "counts": counts }).to_string()).unwrap_err()
        };
        assert!(
            huge(1, u32::MAX)
                .starts_with("size: 4294967295 x 1 pixels, expected at most 16384 a side")
        );
        assert!(huge(16_384, 16_384).starts_with("size: 16384 x 16384 pixels"));
    }
}
