//! Means over small cells of the picture: little noise, few numbers, and medians where outliers must not count.

use crate::image::{Image, Mask};
use crate::pixel::LinearRgb;

/// Cells along the longer side of a picture: enough for any smooth screen, few enough to be fitted in no time.
const ALONG: usize = 48;
/// A cell counts if at least this share of its pixels shows the screen.
const LEAST_SHARE: f64 = 0.5;

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
    let side = w.max(h).div_ceil(ALONG).max(1);
    let columns = w.div_ceil(side);
    (0..columns * h.div_ceil(side))
        .filter_map(|i| mean(photo, background, [i % columns, i / columns], side))
        .collect()
}

fn mean(
    photo: &Image<LinearRgb>,
    background: &Mask,
    index: [usize; 2],
    side: usize,
) -> Option<Cell> {
    let (w, h) = photo.size();
    let [x0, y0] = index.map(|i| i * side);
    let (x1, y1) = ((x0 + side).min(w), (y0 + side).min(h));
    let (mut count, mut at_px, mut color) = (0_u32, [0.0; 2], [0.0; 3]);
    for y in y0..y1 {
        let row = photo.row(y)[x0..x1].iter().zip(&background.row(y)[x0..x1]);
        for (x, (p, _)) in (x0..x1)
            .zip(row)
            .filter(|(_, (p, free))| **free && p.is_finite())
        {
            count += 1;
            at_px[0] += x as f64 + 0.5;
            at_px[1] += y as f64 + 0.5;
            let channels: [f32; 3] = (*p).into();
            color
                .iter_mut()
                .zip(channels)
                .for_each(|(sum, c): (&mut f64, f32)| *sum += f64::from(c));
        }
    }
    let n = f64::from(count);
    let enough = count > 0 && n >= LEAST_SHARE * ((x1 - x0) * (y1 - y0)) as f64;
    enough.then(|| Cell {
        at_px: at_px.map(|v: f64| v / n),
        color: color.map(|v| v / n),
        index,
    })
}

/// The factor per channel from the second picture's cells to the first's: the median of their quotients.
pub(super) fn gain(photo: &[Cell], plate: &[Cell]) -> Option<LinearRgb> {
    let of = |c: usize| {
        median(
            pairs(photo, plate)
                .filter(|(_, b)| b.color[c] > 0.0)
                .map(|(a, b)| a.color[c] / b.color[c]),
        )
    };
    Some([of(0)? as f32, of(1)? as f32, of(2)? as f32].into())
}

/// Median over the cells of the largest difference between the channels, as a share of the brightest channel.
pub(super) fn mismatch(photo: &[Cell], plate: &[Cell]) -> f32 {
    let differs = pairs(photo, plate).map(|(a, b)| {
        let brightest = b.color.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        a.color
            .iter()
            .zip(b.color)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
            / brightest
    });
    median(differs).unwrap_or(0.0) as f32
}

/// The cells that both have.
fn pairs<'a>(a: &'a [Cell], b: &'a [Cell]) -> impl Iterator<Item = (&'a Cell, &'a Cell)> {
    let mut rest = b.iter().peekable();
    a.iter().filter_map(move |a| {
        let order = |cell: &Cell| [cell.index[1], cell.index[0]];
        while rest.next_if(|b| order(b) < order(a)).is_some() {}
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
    let step = (photo.pixels().len() / SAMPLES).max(1);
    let free = || {
        (0..photo.pixels().len())
            .step_by(step)
            .filter(|&i| background.pixels()[i])
    };
    let channel = |c: usize| {
        let differs = free().map(|i| {
            let [a, b] = [photo, plate].map(|image| <[f32; 3]>::from(image.pixels()[i])[c]);
            f64::from((a - b).abs())
        });
        (SIGMA_OF_MEDIAN * median(differs).unwrap_or(0.0)) as f32
    };
    LinearRgb::new(channel(0), channel(1), channel(2))
}

/// Pixels that are looked at for a standard deviation: 1 % of error.
const SAMPLES: usize = 20_000;
/// Standard deviation of a Gaussian over the median of its absolute values.
pub(super) const SIGMA_OF_MEDIAN: f64 = 1.4826;
