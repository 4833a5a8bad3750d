//! Deep samples of a square of pixels.

use super::{DeepSample, less};
use crate::pixel::{LinearRgb, Mix};
use std::ops::Range;

/// Samples of a rectangle of pixels, pixel by pixel, row by row; the default has none.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeepTile {
    /// Number of columns.
    width: usize,
    /// Where each pixel's samples start, and where the last ones end; empty where there are none.
    starts: Vec<u32>,
    pub(super) samples: Vec<DeepSample>,
    /// One per sample where there is film; otherwise empty.
    pub(super) tints: Vec<LinearRgb>,
    /// The plate's displaced part of each sample's light, minus the plate's light seen there
    /// undisplaced; empty where no object bends light.
    pub(super) displaced: Vec<LinearRgb>,
}

impl DeepTile {
    /// From the pixels' samples, row by row.
    pub(super) fn from_pixels(
        width: usize,
        pixels: impl IntoIterator<Item = Vec<DeepSample>>,
    ) -> Self {
        let (mut starts, mut samples) = (vec![0], Vec::new());
        for list in pixels {
            samples.extend(list);
            starts.push(samples.len() as u32);
        }
        Self {
            width,
            starts,
            samples,
            tints: Vec::new(),
            displaced: Vec::new(),
        }
    }

    /// From samples in any order of pixels, each with the number of its pixel; those of one pixel
    /// are given front to back. `tints` has one per sample, or is empty.
    pub(crate) fn from_samples(
        [width, height]: [usize; 2],
        unordered: &[(u32, DeepSample)],
        tints: &[LinearRgb],
    ) -> Self {
        if unordered.is_empty() {
            return Self::default();
        }
        // Starts become ends as each pixel's samples are placed.
        let mut ends = pixel_starts(width * height, unordered);
        let mut samples = vec![DeepSample::default(); unordered.len()];
        let mut ordered_tints = vec![LinearRgb::BLACK; tints.len()];
        for (i, &(pixel, sample)) in unordered.iter().enumerate() {
            let place = take_place(&mut ends[pixel as usize]);
            samples[place] = sample;
            if let Some(&tint) = tints.get(i) {
                ordered_tints[place] = tint;
            }
        }
        Self {
            width,
            starts: starts_from_ends(ends),
            samples,
            tints: ordered_tints,
            displaced: Vec::new(),
        }
    }

    /// Number of pixels that have a list of samples.
    pub(super) fn pixel_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// The samples of the pixel at a column and row of the tile.
    #[inline(always)]
    pub(super) fn range_at(&self, x: usize, y: usize) -> Range<usize> {
        if self.samples.is_empty() {
            return 0..0;
        }
        let i = y * self.width + x;
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// The range of samples of each pixel of a row of the tile; empty where the tile has none.
    pub(super) fn row(&self, y: usize) -> impl Iterator<Item = Range<usize>> {
        let starts = self.starts.get(y * self.width..).unwrap_or_default();
        let ends = starts.windows(2).take(self.width);
        ends.map(|ends| ends[0] as usize..ends[1] as usize)
    }

    /// Subtracts the displaced light of the plate from the samples' light.
    pub(super) fn take_displaced(&mut self) {
        let displaced = std::mem::take(&mut self.displaced);
        for (sample, displaced) in self.samples.iter_mut().zip(displaced) {
            sample.light = sample.light.add_scaled(-1.0, displaced);
        }
    }

    /// For each sample of a pixel whose light is `all`: the light from behind it, and the share of
    /// that which it and all in front of it let pass.
    pub(super) fn backdrops(
        &self,
        samples: Range<usize>,
        all: LinearRgb,
    ) -> Vec<(LinearRgb, LinearRgb)> {
        let (mut behind, mut passes) = (all, LinearRgb::WHITE);
        let backdrops = self.hiding(samples).map(|(sample, hidden)| {
            passes = less(passes, hidden);
            behind = less(behind, sample.light);
            (behind, passes)
        });
        backdrops.collect()
    }

    /// Samples, and what each hides of the light from behind, per channel.
    pub(super) fn hiding(
        &self,
        samples: Range<usize>,
    ) -> impl Iterator<Item = (&DeepSample, LinearRgb)> {
        samples.map(|i| {
            let sample = &self.samples[i];
            let tint = self.tints.get(i).copied();
            (sample, tint.unwrap_or(LinearRgb::grey(sample.visible)))
        })
    }
}

/// Where each pixel's samples start, and finally where the last ones end.
fn pixel_starts(pixels: usize, samples: &[(u32, DeepSample)]) -> Vec<u32> {
    let mut starts = vec![0_u32; pixels + 1];
    for (pixel, _) in samples {
        starts[*pixel as usize + 1] += 1;
    }
    for i in 0..pixels {
        starts[i + 1] += starts[i];
    }
    starts
}

#[inline]
fn take_place(next: &mut u32) -> usize {
    let place = *next as usize;
    *next += 1;
    place
}

/// The start of each pixel is the end of the one before it.
fn starts_from_ends(mut ends: Vec<u32>) -> Vec<u32> {
    ends.rotate_right(1);
    ends[0] = 0;
    ends
}
