//! Ranges of pixels and nodes.

use std::ops::Range;

/// Whether ranges have something in common.
pub(super) fn ranges_meet(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.start < b.end && b.start < a.end
}

/// The shortest range that contains both; an empty one adds nothing.
pub(super) fn range_union(a: Range<usize>, b: Range<usize>) -> Range<usize> {
    match (a.is_empty(), b.is_empty()) {
        (true, _) => b,
        (_, true) => a,
        _ => a.start.min(b.start)..a.end.max(b.end),
    }
}

/// The intersection of two ranges.
pub(super) fn range_overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}

/// The part of a range below `end`.
pub(super) fn range_until(range: Range<usize>, end: usize) -> Range<usize> {
    range.start.min(end)..range.end.min(end)
}

/// Integers in `low..=high`, clipped to `within`.
pub(super) fn integer_range(low: f64, high: f64, within: &Range<usize>) -> Range<usize> {
    let [first, last] = [within.start, within.end].map(|i| i as i64);
    let start = integer_from(low).clamp(first, last);
    let end = if high >= 0.0 {
        (high as i64).saturating_add(1).min(last)
    } else {
        0
    };
    start as usize..end.max(start) as usize
}

/// The lowest integer not below `x`. `as` saturates, so infinite ends are clipped like all others;
/// it is quickest for signed integers, which processors convert in one instruction.
#[inline(always)]
fn integer_from(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero.saturating_add(i64::from(x > toward_zero as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_integer_is_between_reversed_or_infinite_ends() {
        assert!(integer_range(f64::INFINITY, f64::NEG_INFINITY, &(0..9)).is_empty());
        assert_eq!(
            integer_range(f64::NEG_INFINITY, f64::INFINITY, &(2..9)),
            2..9
        );
        assert!(integer_range(-5.0, -1.0, &(0..9)).is_empty());
        assert!(integer_range(-5.0, -0.5, &(0..9)).is_empty());
        assert!(integer_range(f64::NAN, -1.0, &(0..9)).is_empty());
    }

    #[test]
    fn ends_belong_to_a_range() {
        assert_eq!(integer_range(2.0, 4.0, &(0..9)), 2..5);
        assert_eq!(integer_range(2.1, 3.9, &(0..9)), 3..4);
        assert_eq!(integer_range(-0.5, 0.0, &(0..9)), 0..1);
    }
}
