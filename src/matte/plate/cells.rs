//! Means over small cells of the picture: little noise, few numbers, and medians where outliers must not count.

use crate::image::{Image, Mask};
use crate::pixel::LinearRgb;

/// Cells along the longer side of a picture: enough for any smooth screen, few enough to be fitted in no time.
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
    let side = w.max(h).div_ceil(CELLS_ALONG_SIDE).max(1);
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
    let [x0, y0] = index.map(|i| i * side);
    let (x1, y1) = ((x0 + side).min(w), (y0 + side).min(h));
    let mut sums = CellSums::default();
    for y in y0..y1 {
        let (pixels, free) = (&photo.row(y)[x0..x1], &background.row(y)[x0..x1]);
        sums.add_row([x0, y], pixels, free);
    }
    let area = ((x1 - x0) * (y1 - y0)) as f64;
    (f64::from(sums.count) >= MIN_SCREEN_SHARE * area)
        .then(|| sums.mean(index))
        .flatten()
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
        let channels: [f32; 3] = color.into();
        self.count += 1;
        for (sum, v) in self.at_px.iter_mut().zip(at_px) {
            *sum += v;
        }
        for (sum, c) in self.color.iter_mut().zip(channels) {
            *sum += f64::from(c);
        }
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

/// The factor per channel from the second picture's cells to the first's: the median of their quotients.
pub(super) fn gain(photo: &[Cell], plate: &[Cell]) -> Option<LinearRgb> {
    let [r, g, b] = [0, 1, 2].map(|c| {
        let quotients = pairs(photo, plate)
            .filter(|(_, b)| b.color[c] > 0.0)
            .map(|(a, b)| a.color[c] / b.color[c]);
        median(quotients)
    });
    Some([r? as f32, g? as f32, b? as f32].into())
}

/// Median over the cells of the largest difference between the channels, as a share of the brightest channel.
pub(super) fn mismatch(photo: &[Cell], plate: &[Cell]) -> f32 {
    let differences = pairs(photo, plate).map(|(a, b)| a.relative_difference(b));
    median(differences).unwrap_or(0.0) as f32
}

impl Cell {
    /// The largest difference between the channels, as a share of the other's brightest channel.
    fn relative_difference(&self, other: &Self) -> f64 {
        let brightest = other.color.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let largest = self
            .color
            .iter()
            .zip(other.color)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        largest / brightest
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

/// The value in the middle; of an even number the higher of the two.
pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Standard deviation of a photo around a plate where the screen is free, channel by channel, by the median of the
/// absolute differences: what is not screen after all does not count.
pub(super) fn deviation(
    photo: &Image<LinearRgb>,
    plate: &Image<LinearRgb>,
    background: &Mask,
) -> LinearRgb {
    let step = (photo.pixels().len() / DEVIATION_SAMPLES).max(1);
    let sampled: Vec<usize> = (0..photo.pixels().len())
        .step_by(step)
        .filter(|&i| background.pixels()[i])
        .collect();
    let [r, g, b] = [0, 1, 2].map(|c| {
        let differences = sampled.iter().map(|&i| {
            let [a, b] = [photo, plate].map(|image| channel(image.pixels()[i], c));
            f64::from((a - b).abs())
        });
        (SIGMA_OF_MEDIAN * median(differences).unwrap_or(0.0)) as f32
    });
    LinearRgb::new(r, g, b)
}

fn channel(color: LinearRgb, c: usize) -> f32 {
    <[f32; 3]>::from(color)[c]
}

/// Pixels that are sampled for a standard deviation: 1 % of error.
const DEVIATION_SAMPLES: usize = 20_000;
/// Standard deviation of a Gaussian over the median of its absolute values.
pub(super) const SIGMA_OF_MEDIAN: f64 = 1.4826;
