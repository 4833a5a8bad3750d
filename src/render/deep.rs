//! Deep samples: per pixel, front to back, what each object does to the pixel.

use crate::image::Image;
use crate::pixel::{Depth, LinearRgb, ObjectId};

/// What one object contributes to one pixel, averaged over the pixel.
///
/// `light` and `visible` are already attenuated by what lies in front, so a picture is their plain sum and a label can
/// never disagree with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeepSample {
    /// Whose it is.
    pub object: ObjectId,
    /// Distance of the object at the pixel, metres along the optical axis.
    pub depth: Depth,
    /// Light that reaches the eye from it: held out by what is in front, exposure applied.
    pub light: LinearRgb,
    /// Its own coverage of the pixel, as if alone (amodal).
    pub alpha: f32,
    /// The part of `alpha` that is seen through what lies in front.
    pub visible: f32,
}

/// A picture of deep samples, and what the shadows leave of the surface's light.
#[derive(Clone, Debug, Default)]
pub struct DeepImage {
    width: usize,
    height: usize,
    starts: Vec<u32>,
    samples: Vec<DeepSample>,
    shadow: Image<LinearRgb>,
}

impl DeepImage {
    /// Assembles a picture from its pixels' samples, row by row, each front to back.
    ///
    /// `shadow` has the picture's size: the factor on the plate, 1 where nothing is in the way.
    ///
    /// # Panics
    /// When there is not one list per pixel of `shadow`.
    pub fn from_pixels(shadow: Image<LinearRgb>, pixels: impl IntoIterator<Item = Vec<DeepSample>>) -> Self {
        let (width, height) = shadow.size();
        let mut starts = Vec::with_capacity(width * height + 1);
        let mut samples = Vec::new();
        starts.push(0);
        for list in pixels {
            samples.extend(list);
            starts.push(samples.len() as u32);
        }
        assert_eq!(starts.len(), width * height + 1, "one list of samples per pixel");
        Self { width, height, starts, samples, shadow }
    }

    /// Assembles a picture from samples in any order of pixels, each with its column and row; those of one pixel come
    /// front to back.
    ///
    /// `shadow` has the picture's size.
    ///
    /// # Panics
    /// When a sample lies outside the picture, or when there are more than `u32` can count.
    pub(crate) fn from_samples(
        shadow: Image<LinearRgb>,
        samples: impl Iterator<Item = (u32, u32, DeepSample)> + Clone,
    ) -> Self {
        let (width, height) = shadow.size();
        let pixel = |x: u32, y: u32| y as usize * width + x as usize;
        // Counts become starts, then move to ends as each pixel's samples take their places.
        let mut ends = vec![0u32; width * height + 1];
        samples.clone().for_each(|(x, y, _)| ends[pixel(x, y) + 1] += 1);
        (0..width * height).for_each(|i| ends[i + 1] += ends[i]);
        let mut placed = vec![DeepSample::default(); ends.last().map_or(0, |&n| n as usize)];
        for (x, y, sample) in samples {
            let next = &mut ends[pixel(x, y)];
            placed[*next as usize] = sample;
            *next += 1;
        }
        ends.rotate_right(1);
        ends[0] = 0;
        Self { width, height, starts: ends, samples: placed, shadow }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The samples of one pixel, front to back.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> &[DeepSample] {
        let i = y * self.width + x;
        &self.samples[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The factor on the plate, per channel.
    pub fn shadow(&self) -> &Image<LinearRgb> {
        &self.shadow
    }
}
