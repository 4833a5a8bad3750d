//! Connected groups of pixels.

use crate::image::Image;

/// The connected groups (8 neighbours) of a set, numbered from 1 in the order of their first pixel, row by row.
pub(super) struct Groups {
    /// The group of every pixel, 0 outside the set.
    pub(super) labels: Image<u32>,
    /// Number of groups.
    count: usize,
}

impl Groups {
    /// Finds the groups.
    pub(super) fn of(set: &Image<bool>) -> Self {
        let mut labels = Image::new(set.width(), set.height());
        let mut count = 0;
        for at in 0..set.pixels().len() {
            if set.pixels()[at] && labels.pixels()[at] == 0 {
                count += 1;
                flood(set, &mut labels, at, count);
            }
        }
        Self { labels, count: count as usize }
    }

    /// How many pixels of `members` are in each group; index 0 is group 1.
    pub(super) fn sizes(&self, members: &Image<bool>) -> Vec<usize> {
        let mut sizes = vec![0; self.count];
        let counted = self.labels.pixels().iter().zip(members.pixels());
        for (&label, _) in counted.filter(|(label, member)| **label != 0 && **member) {
            sizes[label as usize - 1] += 1;
        }
        sizes
    }

    /// The pixels of the groups for which a claim, by index from 0, holds.
    pub(super) fn only(&self, holds: impl Fn(usize) -> bool + Sync) -> Image<bool> {
        self.labels.map(|label| label != 0 && holds(label as usize - 1))
    }
}

/// Labels everything that is connected with the pixel `start`.
fn flood(set: &Image<bool>, labels: &mut Image<u32>, start: usize, label: u32) {
    labels.pixels_mut()[start] = label;
    let mut open = vec![start];
    while let Some(at) = open.pop() {
        for next in neighbours(at, set.size()) {
            if set.pixels()[next] && labels.pixels()[next] == 0 {
                labels.pixels_mut()[next] = label;
                open.push(next);
            }
        }
    }
}

/// The (up to) 8 pixels around a pixel.
fn neighbours(at: usize, (w, h): (usize, usize)) -> impl Iterator<Item = usize> {
    let (x, y) = (at % w, at / w);
    let rows = y.saturating_sub(1)..(y + 2).min(h);
    let columns = x.saturating_sub(1)..(x + 2).min(w);
    rows.flat_map(move |v| columns.clone().map(move |u| v * w + u)).filter(move |&next| next != at)
}

/// The set without its groups of fewer than `least` pixels.
pub(super) fn without_specks(set: &Image<bool>, least: usize) -> Image<bool> {
    let groups = Groups::of(set);
    let sizes = groups.sizes(set);
    groups.only(|group| sizes[group] >= least)
}

/// The set with its holes filled: all that cannot be reached from the border of the picture. Outlines must be two
/// pixels thick, since the way around goes over corners too.
pub(super) fn filled(set: &Image<bool>) -> Image<bool> {
    let (w, h) = set.size();
    let outside = set.map(|inside| !inside);
    let border = Image::from_fn(w, h, |x, y| x == 0 || y == 0 || x + 1 == w || y + 1 == h);
    let groups = Groups::of(&outside);
    let reaching = groups.sizes(&border);
    groups.only(|group| reaching[group] > 0).map(|open| !open)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(set: &Image<bool>) -> usize {
        set.pixels().iter().filter(|p| **p).count()
    }

    #[test]
    fn groups_are_joined_over_corners_and_counted() {
        let set = Image::from_fn(6, 3, |x, y| matches!((x, y), (0, 0) | (1, 1) | (4, 1) | (5, 1) | (4, 2)));
        assert_eq!(Groups::of(&set).sizes(&set), [2, 3]);
        assert_eq!(count(&without_specks(&set, 3)), 3);
    }

    #[test]
    fn a_ring_is_filled_and_a_horseshoe_is_not() {
        let ring = Image::from_fn(9, 9, |x, y| x.abs_diff(4).max(y.abs_diff(4)) == 2);
        assert_eq!(count(&filled(&ring)), 25);
        let horseshoe = Image::from_fn(9, 9, |x, y| ring[(x, y)] && y != 6);
        assert_eq!(filled(&horseshoe), horseshoe);
    }

    #[test]
    fn empty_pictures_have_no_groups() {
        assert!(Groups::of(&Image::new(0, 3)).sizes(&Image::new(0, 3)).is_empty());
        assert!(filled(&Image::new(3, 0)).is_empty());
    }
}
