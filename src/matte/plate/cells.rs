//! Means over small cells of the picture: little noise, few numbers, and medians where outliers
//! must not count.

use crate::image::{Image, Mask};
use crate::matte::arrays::{differences, largest_difference};
use crate::pixel::LinearRgb;
use crate::quantile::median;
use std::ops::Range;

/// Cells along the longer side of a picture: enough for any smooth screen, few enough to be fitted
/// in no time.
const CELLS_ALONG_SIDE: usize = 48;
/// A cell counts if at least this share of its pixels shows the screen.
const MIN_SCREEN_SHARE: f64 = 0.5;

/// The mean colour of the screen in one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    /// Centre of the pixels that count, pixels.
    pub(super) at_px: [f64; 2],
    /// Their mean colour, scene-linear.
    pub(super) color: [f64; 3],
    /// Column and row of the cell.
    pub(super) index: [usize; 2],
}

/// The cells of a picture where it shows the screen, row by row.
pub(super) fn means(photo: &Image<LinearRgb>, background: &Mask) -> Vec<Cell> {
    assert_eq!(
        photo.size(),
        background.size(),
        "photo and background differ in size"
    );
    let (w, h) = photo.size();
    let side = cell_side(w.max(h));
    let columns = w.div_ceil(side);
    (0..columns * h.div_ceil(side))
        .filter_map(|i| cell_mean(photo, background, [i % columns, i / columns], side))
        .collect()
}

fn cell_mean(
    photo: &Image<LinearRgb>,
    background: &Mask,
    index: [usize; 2],
    side: usize,
) -> Option<Cell> {
    let (w, h) = photo.size();
    let columns = cell_range(index[0], side, w);
    let rows = cell_range(index[1], side, h);
    let least = MIN_SCREEN_SHARE * (columns.len() * rows.len()) as f64;
    let mut sums = CellSums::default();
    for y in rows {
        let free = &background.row(y)[columns.clone()];
        sums.add_row([columns.start, y], &photo.row(y)[columns.clone()], free);
    }
    sums.mean(index).filter(|_| f64::from(sums.count) >= least)
}

/// Side of a cell in a picture of this longer side, pixels.
fn cell_side(longer: usize) -> usize {
    longer.div_ceil(CELLS_ALONG_SIDE).max(1)
}

/// The pixels of the cell `index` along a side of the picture.
fn cell_range(index: usize, side: usize, len: usize) -> Range<usize> {
    let start = index * side;
    start..(start + side).min(len)
}

/// Sums over the screen's pixels in a cell.
#[derive(Default)]
struct CellSums {
    count: u32,
    at_px: [f64; 2],
    color: [f64; 3],
}

impl CellSums {
    /// Adds the free and finite pixels of a row, the first of which lies at `[x0, y]`.
    fn add_row(&mut self, [x0, y]: [usize; 2], pixels: &[LinearRgb], free: &[bool]) {
        for (x, (p, free)) in (x0..).zip(pixels.iter().zip(free)) {
            if *free && p.is_finite() {
                self.add([x as f64 + 0.5, y as f64 + 0.5], *p);
            }
        }
    }

    #[inline]
    fn add(&mut self, at_px: [f64; 2], color: LinearRgb) {
        self.count += 1;
        add_to(&mut self.at_px, at_px);
        add_to(&mut self.color, color.channels().map(f64::from));
    }

    fn mean(&self, index: [usize; 2]) -> Option<Cell> {
        let n = f64::from(self.count);
        (self.count > 0).then(|| Cell {
            at_px: self.at_px.map(|v| v / n),
            color: self.color.map(|v| v / n),
            index,
        })
    }
}

#[inline]
fn add_to<const N: usize>(sums: &mut [f64; N], values: [f64; N]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}

/// The factor per channel from the second picture's cells to the first's: the median of their
/// quotients, or 1 in a channel without light; none where no channel has any, or without cells that
/// both have.
pub(super) fn gain(photo: &[Cell], plate: &[Cell]) -> Option<LinearRgb> {
    let gains = [0, 1, 2].map(|c| {
        let quotients = pairs(photo, plate)
            .filter(|(_, b)| b.color[c] != 0.0)
            .map(|(a, b)| a.color[c] / b.color[c]);
        median(quotients, f64::total_cmp)
    });
    let has_light = gains.iter().any(Option::is_some);
    has_light.then(|| gains.map(|gain| gain.unwrap_or(1.0) as f32).into())
}

/// Median over the cells of the largest difference between the channels, as a share of the
/// brightest channel.
pub(super) fn mismatch(photo: &[Cell], plate: &[Cell]) -> f32 {
    let differences = pairs(photo, plate).map(|(a, b)| a.relative_difference(b));
    median(differences, f64::total_cmp).unwrap_or(0.0) as f32
}

impl Cell {
    /// The largest difference between the channels, as a share of the other's brightest channel.
    fn relative_difference(&self, other: &Self) -> f64 {
        let brightest = other.color.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        largest_difference(self.color, other.color) / brightest
    }

    /// Row and column, in the order of the cells.
    fn order(&self) -> [usize; 2] {
        [self.index[1], self.index[0]]
    }
}

/// The cells that both have.
fn pairs<'a>(a: &'a [Cell], b: &'a [Cell]) -> impl Iterator<Item = (&'a Cell, &'a Cell)> {
    let mut rest = b.iter().peekable();
    a.iter().filter_map(move |a| {
        while rest.next_if(|b| b.order() < a.order()).is_some() {}
        rest.next_if(|b| b.index == a.index).map(|b| (a, b))
    })
}

/// Standard deviation of a photo around a plate where the screen is free, channel by channel, by
/// the median of the absolute differences: what is not screen after all does not count.
pub(super) fn deviation(
    photo: &Image<LinearRgb>,
    plate: &Image<LinearRgb>,
    background: &Mask,
) -> LinearRgb {
    let step = (photo.pixels().len() / DEVIATION_SAMPLES).max(1);
    let off: Vec<[f32; 3]> = (0..photo.pixels().len())
        .step_by(step)
        .filter(|&i| background.pixels()[i])
        .map(|i| differences(photo.pixels()[i], plate.pixels()[i]))
        .collect();
    [0, 1, 2]
        .map(|c| robust_sigma(off.iter().map(|off| f64::from(off[c]))) as f32)
        .into()
}

/// Standard deviation, by the median of absolute differences; 0 of none.
pub(super) fn robust_sigma(differences: impl Iterator<Item = f64>) -> f64 {
    SIGMA_OF_MEDIAN * median(differences, f64::total_cmp).unwrap_or(0.0)
}

/// Pixels that are sampled for a standard deviation: 1 % of error.
const DEVIATION_SAMPLES: usize = 20_000;
/// Standard deviation of a Gaussian over the median of its absolute values.
const SIGMA_OF_MEDIAN: f64 = 1.4826;
