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
    let start = integer_from(low).clamp(within.start, within.end);
    let end = if high >= 0.0 {
        (high as usize).saturating_add(1).min(within.end)
    } else {
        0
    };
    start..end.max(start)
}

/// The lowest integer that is neither below `x` nor below 0. `as` saturates, so infinite ends are
/// clipped like all others.
#[inline(always)]
fn integer_from(x: f64) -> usize {
    let below = x as usize;
    below.saturating_add(usize::from(x > below as f64))
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
    }
}
