//! Connected groups of pixels.

use crate::image::Image;

/// The connected groups (8 neighbours) of a set: every pixel's group from 1, 0 outside; groups are numbered in the
/// order of their first pixel, row by row.
pub(super) struct Groups {
    /// The group of every pixel.
    pub(super) labels: Image<u32>,
    /// Number of groups.
    pub(super) count: usize,
}

impl Groups {
    /// Finds the groups.
    pub(super) fn of(set: &Image<bool>) -> Self {
        let (w, h) = set.size();
        let mut labels = Image::filled(w, h, 0u32);
        let mut count = 0;
        let mut open = Vec::new();
        for i in 0..w * h {
            if !set.pixels()[i] || labels.pixels()[i] != 0 {
                continue;
            }
            count += 1;
            labels.pixels_mut()[i] = count;
            open.push(i);
            while let Some(at) = open.pop() {
                for j in neighbours(at, w, h) {
                    if set.pixels()[j] && labels.pixels()[j] == 0 {
                        labels.pixels_mut()[j] = count;
                        open.push(j);
                    }
                }
            }
        }
        Self { labels, count: count as usize }
    }

    /// The sum over each group of a weight per pixel; index 0 is group 1.
    pub(super) fn sums(&self, weights: &Image<bool>) -> Vec<u64> {
        let mut sums = vec![0; self.count];
        for (&label, _) in self.labels.pixels().iter().zip(weights.pixels()).filter(|(l, w)| **l != 0 && **w) {
            sums[label as usize - 1] += 1;
        }
        sums
    }
}

/// The (up to) 8 pixels around a pixel.
fn neighbours(at: usize, w: usize, h: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (at % w, at / w);
    let rows = y.saturating_sub(1)..(y + 2).min(h);
    let columns = x.saturating_sub(1)..(x + 2).min(w);
    rows.flat_map(move |v| columns.clone().map(move |u| v * w + u)).filter(move |&j| j != at)
}

/// The pixels of `weak` whose group holds a pixel of `strong`.
pub(super) fn reached(weak: &Image<bool>, strong: &Image<bool>) -> Image<bool> {
    let groups = Groups::of(weak);
    let seeds = groups.sums(strong);
    groups.labels.map(|label| label != 0 && seeds[label as usize - 1] > 0)
}

/// The set with its holes filled: everything that cannot be reached from the border of the picture.
pub(super) fn filled(set: &Image<bool>) -> Image<bool> {
    let (w, h) = set.size();
    let outside = set.map(|inside| !inside);
    let border = Image::from_fn(w, h, |x, y| (x == 0 || y == 0 || x + 1 == w || y + 1 == h) && outside[(x, y)]);
    reached(&outside, &border).map(|open| !open)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_joined_over_corners_and_counted() {
        let set = Image::from_fn(6, 3, |x, y| matches!((x, y), (0, 0) | (1, 1) | (4, 1) | (5, 1)));
        let groups = Groups::of(&set);
        assert_eq!(groups.count, 2);
        assert_eq!(groups.sums(&set), [2, 2]);
    }

    #[test]
    fn weak_pixels_need_a_strong_one() {
        let weak = Image::from_fn(7, 1, |x, _| x != 3);
        let strong = Image::from_fn(7, 1, |x, _| x == 0);
        assert_eq!(reached(&weak, &strong).pixels(), [true, true, true, false, false, false, false]);
    }

    #[test]
    fn a_ring_is_filled() {
        let ring = Image::from_fn(9, 9, |x, y| x.abs_diff(4).max(y.abs_diff(4)) == 2);
        assert_eq!(filled(&ring).pixels().iter().filter(|p| **p).count(), 25);
    }
}
