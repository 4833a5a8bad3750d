//! Connected groups of pixels.

use crate::image::{Image, Mask};
use std::ops::Range;

/// The connected groups (8 neighbours) of a set, in the order of their first pixel, row by row.
pub(crate) struct PixelGroups {
    size: (usize, usize),
    /// The set as runs of pixels, row by row.
    runs: Vec<PixelRun>,
    /// Number of groups.
    count: usize,
}

/// Set pixels side by side.
struct PixelRun {
    row: usize,
    columns: Range<usize>,
    /// Until all groups are found: an earlier run of the same group, or itself.
    group: usize,
}

impl PixelRun {
    /// How many of its pixels a mask has.
    fn count(&self, members: &Mask) -> usize {
        let pixels = members.row(self.row)[self.columns.clone()].iter();
        pixels.filter(|p| **p).count()
    }

    fn reaches_border(&self, (w, h): (usize, usize)) -> bool {
        let Range { start, end } = self.columns;
        self.row == 0 || self.row + 1 == h || start == 0 || end == w
    }
}

impl PixelGroups {
    /// Finds the groups: runs that touch the same run, corners included, are of one.
    pub(crate) fn new(set: &Mask) -> Self {
        let mut runs: Vec<PixelRun> = Vec::new();
        let mut above = 0..0;
        for (row, pixels) in set.rows().enumerate() {
            let start = runs.len();
            for columns in runs_of(pixels) {
                push_joined(&mut runs, row, columns, &mut above);
            }
            above = start..runs.len();
        }
        let count = number_groups(&mut runs);
        Self {
            size: set.size(),
            runs,
            count,
        }
    }

    /// How many pixels of `members` are in each group.
    pub(crate) fn sizes(&self, members: &Mask) -> Vec<usize> {
        let mut sizes = vec![0; self.count];
        for run in &self.runs {
            sizes[run.group] += run.count(members);
        }
        sizes
    }

    /// The pixels of the groups for which a claim, by index from 0, holds.
    pub(crate) fn only(&self, holds: impl Fn(usize) -> bool) -> Mask {
        let mut only = Image::new(self.size.0, self.size.1);
        for run in self.runs.iter().filter(|run| holds(run.group)) {
            only.row_mut(run.row)[run.columns.clone()].fill(true);
        }
        only
    }

    /// Whether each group reaches the border of the picture.
    fn reaching_border(&self) -> Vec<bool> {
        let mut reaching = vec![false; self.count];
        for run in &self.runs {
            reaching[run.group] |= run.reaches_border(self.size);
        }
        reaching
    }
}

/// What two sets have in common.
pub(super) fn both(a: &Mask, b: &Mask) -> Mask {
    a.zip_map(b, |a, b| a && b)
}

/// What of a set is not in another one.
pub(super) fn without(set: &Mask, taken: &Mask) -> Mask {
    set.zip_map(taken, |kept, taken| kept && !taken)
}

/// The runs of set pixels in a row.
fn runs_of(row: &[bool]) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + row[at..].iter().position(|p| *p)?;
        at = row[start..]
            .iter()
            .position(|p| !p)
            .map_or(row.len(), |length| start + length);
        Some(start..at)
    })
}

/// Adds a run, joined with those of the row above that it touches. What of `above` ends before it
/// is dropped: it touches no later run of the row either.
fn push_joined(
    runs: &mut Vec<PixelRun>,
    row: usize,
    columns: Range<usize>,
    above: &mut Range<usize>,
) {
    let group = runs.len();
    while above.start < above.end && runs[above.start].columns.end < columns.start {
        above.start += 1;
    }
    let end = columns.end;
    runs.push(PixelRun {
        row,
        columns,
        group,
    });
    for other in above.clone() {
        if runs[other].columns.start > end {
            break;
        }
        join(runs, group, other);
    }
}

/// The first run of a run's group; runs on the way are pointed closer to it.
fn first_of(runs: &mut [PixelRun], mut run: usize) -> usize {
    while runs[run].group != run {
        runs[run].group = runs[runs[run].group].group;
        run = runs[run].group;
    }
    run
}

fn join(runs: &mut [PixelRun], a: usize, b: usize) {
    let (a, b) = (first_of(runs, a), first_of(runs, b));
    runs[a.max(b)].group = a.min(b);
}

/// Numbers the groups in the order of their first runs; how many there are.
fn number_groups(runs: &mut [PixelRun]) -> usize {
    let mut count = 0;
    for i in 0..runs.len() {
        // Earlier runs have their number by now.
        if runs[i].group == i {
            runs[i].group = count;
            count += 1;
        } else {
            runs[i].group = runs[runs[i].group].group;
        }
    }
    count
}

/// The set without its groups of fewer than `least` pixels.
pub(super) fn without_specks(set: &Mask, least: usize) -> Mask {
    let groups = PixelGroups::new(set);
    let sizes = groups.sizes(set);
    groups.only(|group| sizes[group] >= least)
}

/// The set with its holes filled: all that cannot be reached from the border of the picture.
/// Outlines must be two pixels thick, since the way around goes over corners too.
pub(crate) fn filled(set: &Mask) -> Mask {
    let groups = PixelGroups::new(&set.complement());
    let reaching = groups.reaching_border();
    groups.only(|group| reaching[group]).complement()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_joined_over_corners_and_counted() {
        let set = Image::from_fn(6, 3, |x, y| {
            matches!((x, y), (0, 0) | (1, 1) | (4, 1) | (5, 1) | (4, 2))
        });
        assert_eq!(PixelGroups::new(&set).sizes(&set), [2, 3]);
        assert_eq!(without_specks(&set, 3).count(), 3);
    }

    #[test]
    fn a_ring_is_filled_and_a_horseshoe_is_not() {
        let ring = Image::from_fn(9, 9, |x, y| x.abs_diff(4).max(y.abs_diff(4)) == 2);
        assert_eq!(filled(&ring).count(), 25);
        let horseshoe = Image::from_fn(9, 9, |x, y| ring[(x, y)] && y != 6);
        assert_eq!(filled(&horseshoe), horseshoe);
    }

    #[test]
    fn empty_pictures_have_no_groups() {
        assert!(
            PixelGroups::new(&Image::new(0, 3))
                .sizes(&Image::new(0, 3))
                .is_empty()
        );
        assert!(filled(&Image::new(3, 0)).is_empty());
    }
}
