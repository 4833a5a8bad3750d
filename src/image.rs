//! A rectangle of pixels of one kind.
//!
//! Row 0 is the top row, pixel `(x, y)` covers `[x, x+1) x [y, y+1)` and has its centre at `+0.5`.
//! Pixels are stored row by row in one allocation without padding; functions process whole rows so
//! that the compiler can vectorise them.

use crate::pixel::Coverage;
use rayon::prelude::*;

/// A rectangle of pixels `P`, row by row from the top.
#[derive(Clone, PartialEq, Default)]
pub struct Image<P> {
    width: usize,
    height: usize,
    pixels: Vec<P>,
}

/// Borrowed pixels, row by row from the top: a picture that can be read without a copy.
#[doc(hidden)]
#[derive(Debug)]
pub struct ImageView<'a, P> {
    width: usize,
    height: usize,
    pixels: &'a [P],
}

impl<P> Clone for ImageView<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P> Copy for ImageView<'_, P> {}

impl<'a, P> ImageView<'a, P> {
    /// # Panics
    /// When `pixels.len() != width * height`.
    pub fn new(width: usize, height: usize, pixels: &'a [P]) -> Self {
        assert_eq!(
            Some(pixels.len()),
            width.checked_mul(height),
            "pixel count does not match {width} x {height}"
        );
        Self {
            width,
            height,
            pixels,
        }
    }

    /// Number of columns.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.width
    }

    /// `(width, height)`.
    #[inline(always)]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// One row.
    ///
    /// # Panics
    /// When `y >= height`.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &'a [P] {
        &self.pixels[y * self.width..][..self.width]
    }
}

/// A boolean for every pixel; label files hold it as an [`RleMask`](crate::label::RleMask).
pub type Mask = Image<bool>;

/// A region of interest: a half-open rectangle of whole pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Roi {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Roi {
    /// The rectangle from the columns and rows it spans, both half open; empty where they are
    /// reversed.
    pub fn spanning(xs: std::ops::Range<usize>, ys: std::ops::Range<usize>) -> Self {
        Self {
            x: xs.start,
            y: ys.start,
            width: xs.len(),
            height: ys.len(),
        }
    }

    /// The largest middle part of a picture that has the shape of another; sizes are width and
    /// height.
    pub(crate) fn middle_of(picture: [u32; 2], shape: [u32; 2]) -> Self {
        let [w, h] = picture.map(u64::from);
        let [across, down] = shape.map(u64::from);
        let width = w.min((h * across).div_ceil(down)) as usize;
        let height = h.min((w * down).div_ceil(across)) as usize;
        Self {
            x: (w as usize - width) / 2,
            y: (h as usize - height) / 2,
            width,
            height,
        }
    }

    /// Grown by `by` pixels on every side, kept inside a picture of `width` x `height`.
    pub fn grown(self, by: usize, width: usize, height: usize) -> Self {
        let x0 = self.x.saturating_sub(by);
        let y0 = self.y.saturating_sub(by);
        let x1 = (self.x + self.width).saturating_add(by).min(width);
        let y1 = (self.y + self.height).saturating_add(by).min(height);
        Self::spanning(x0..x1, y0..y1)
    }

    /// Number of pixels.
    pub fn area(self) -> usize {
        self.width * self.height
    }
}

impl<P: Copy + Default> Image<P> {
    /// An image of default pixels (black, transparent, 0).
    ///
    /// # Panics
    /// When `width * height` overflows.
    pub fn new(width: usize, height: usize) -> Self {
        Self::filled(width, height, P::default())
    }
}

impl<P: Copy> Image<P> {
    /// An image filled with one value.
    pub fn filled(width: usize, height: usize, pixel: P) -> Self {
        let len = width.checked_mul(height).expect("image area overflows");
        Self {
            width,
            height,
            pixels: vec![pixel; len],
        }
    }

    /// An image from existing pixels, row by row.
    ///
    /// # Panics
    /// When `pixels.len() != width * height`.
    pub fn from_vec(width: usize, height: usize, pixels: Vec<P>) -> Self {
        assert_eq!(
            pixels.len(),
            width * height,
            "pixel count does not match {width} x {height}"
        );
        Self {
            width,
            height,
            pixels,
        }
    }

    /// An image computed pixel by pixel from `(x, y)`, rows in parallel.
    pub fn from_fn(width: usize, height: usize, f: impl Fn(usize, usize) -> P + Sync) -> Self
    where
        P: Send + Sync,
    {
        // One division per task, not one per pixel.
        let pixels = (0..width * height)
            .into_par_iter()
            .with_min_len(width.max(1))
            .map_init(
                || None,
                |next, i| {
                    let (x, y) = next.unwrap_or_else(|| (i % width, i / width));
                    *next = Some(pixel_after(x, y, width));
                    f(x, y)
                },
            );
        Self {
            width,
            height,
            pixels: pixels.collect(),
        }
    }

    /// Number of columns.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    #[inline(always)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// `(width, height)`.
    #[inline(always)]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }

    /// All pixels, row by row.
    #[inline(always)]
    pub fn pixels(&self) -> &[P] {
        &self.pixels
    }

    /// All pixels, row by row, mutable.
    #[inline(always)]
    pub fn pixels_mut(&mut self) -> &mut [P] {
        &mut self.pixels
    }

    /// A borrowed view of the pixels.
    #[doc(hidden)]
    pub fn view(&self) -> ImageView<'_, P> {
        ImageView {
            width: self.width,
            height: self.height,
            pixels: &self.pixels,
        }
    }

    /// The pixels alone.
    pub fn into_vec(self) -> Vec<P> {
        self.pixels
    }

    /// One row.
    ///
    /// # Panics
    /// When `y >= height`.
    #[inline(always)]
    pub fn row(&self, y: usize) -> &[P] {
        &self.pixels[y * self.width..][..self.width]
    }

    /// One row, mutable.
    ///
    /// # Panics
    /// When `y >= height`.
    #[inline(always)]
    pub fn row_mut(&mut self, y: usize) -> &mut [P] {
        &mut self.pixels[y * self.width..][..self.width]
    }

    /// The rows from the top.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = &[P]> + ExactSizeIterator {
        self.pixels.chunks_exact(self.width.max(1))
    }

    /// The rows from the top, mutable, in parallel.
    pub fn par_rows_mut(&mut self) -> impl IndexedParallelIterator<Item = &mut [P]>
    where
        P: Send,
    {
        self.pixels.par_chunks_exact_mut(self.width.max(1))
    }

    /// A picture of the same size, computed pixel by pixel, rows in parallel.
    pub fn map<Q: Copy + Send>(&self, f: impl Fn(P) -> Q + Sync) -> Image<Q>
    where
        P: Sync,
    {
        let pixels = self
            .pixels
            .par_iter()
            .with_min_len(self.width.max(1))
            .map(|&p| f(p))
            .collect();
        Image {
            width: self.width,
            height: self.height,
            pixels,
        }
    }

    /// A picture of the same size computed from two, pixel by pixel, rows in parallel.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn zip_map<Q: Copy + Sync, R: Copy + Send>(
        &self,
        other: &Image<Q>,
        f: impl Fn(P, Q) -> R + Sync,
    ) -> Image<R>
    where
        P: Sync,
    {
        assert_eq!(self.size(), other.size(), "images of different size");
        let pairs = self
            .pixels
            .par_iter()
            .with_min_len(self.width.max(1))
            .zip(other.pixels.par_iter());
        Image {
            width: self.width,
            height: self.height,
            pixels: pairs.map(|(&p, &q)| f(p, q)).collect(),
        }
    }

    /// A picture of the same size computed from three, pixel by pixel, rows in parallel.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn zip3_map<Q: Copy + Sync, R: Copy + Sync, S: Copy + Send>(
        &self,
        second: &Image<Q>,
        third: &Image<R>,
        f: impl Fn(P, Q, R) -> S + Sync,
    ) -> Image<S>
    where
        P: Sync,
    {
        assert!(
            self.size() == second.size() && self.size() == third.size(),
            "images of different size"
        );
        let firsts = self.pixels.par_iter().with_min_len(self.width.max(1));
        let all = firsts
            .zip(second.pixels.par_iter())
            .zip(third.pixels.par_iter());
        Image {
            width: self.width,
            height: self.height,
            pixels: all.map(|((&p, &q), &r)| f(p, q, r)).collect(),
        }
    }

    /// The pixels where a mask is set, row by row.
    pub(crate) fn pixels_in(&self, mask: &Mask) -> impl Iterator<Item = P> {
        let pixels = self.pixels.iter().zip(&mask.pixels);
        pixels.filter_map(|(p, set)| set.then_some(*p))
    }

    /// A copy of a region.
    ///
    /// # Panics
    /// When `roi` reaches outside the picture.
    pub fn crop(&self, roi: Roi) -> Self {
        let mut pixels = Vec::with_capacity(roi.area());
        for y in roi.y..roi.y + roi.height {
            pixels.extend_from_slice(&self.row(y)[roi.x..roi.x + roi.width]);
        }
        Self {
            width: roi.width,
            height: roi.height,
            pixels,
        }
    }

    /// A region, reusing the memory of the whole.
    ///
    /// # Panics
    /// When `roi` reaches outside the picture.
    pub fn into_crop(mut self, roi: Roi) -> Self {
        for (to, y) in (roi.y..roi.y + roi.height).enumerate() {
            assert!(roi.x + roi.width <= self.width && y < self.height);
            let start = y * self.width + roi.x;
            let row = start..start + roi.width;
            self.pixels.copy_within(row, to * roi.width);
        }
        self.pixels.truncate(roi.area());
        Self {
            width: roi.width,
            height: roi.height,
            pixels: self.pixels,
        }
    }

    /// The pixel at the nearest position inside the picture.
    ///
    /// # Panics
    /// When the picture is empty.
    #[inline(always)]
    pub fn nearest(&self, x: isize, y: isize) -> P {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self[(x, y)]
    }
}

impl Mask {
    /// Number of pixels that are set.
    pub fn count(&self) -> usize {
        self.pixels.iter().filter(|set| **set).count()
    }

    /// Set where this mask is not.
    pub fn complement(&self) -> Self {
        self.map(|set| !set)
    }

    /// A matte without soft edges: 1 where set, 0 elsewhere.
    pub fn to_coverage(&self) -> Image<Coverage> {
        self.map(|set| Coverage(f32::from(u8::from(set))))
    }
}

/// The pixel that follows one, row by row.
#[inline(always)]
fn pixel_after(x: usize, y: usize, width: usize) -> (usize, usize) {
    if x + 1 < width {
        (x + 1, y)
    } else {
        (0, y + 1)
    }
}

impl<P> std::ops::Index<(usize, usize)> for Image<P> {
    type Output = P;
    #[inline(always)]
    fn index(&self, (x, y): (usize, usize)) -> &P {
        debug_assert!(x < self.width);
        &self.pixels[y * self.width + x]
    }
}

impl<P> std::ops::IndexMut<(usize, usize)> for Image<P> {
    #[inline(always)]
    fn index_mut(&mut self, (x, y): (usize, usize)) -> &mut P {
        debug_assert!(x < self.width);
        &mut self.pixels[y * self.width + x]
    }
}

impl<P> std::fmt::Debug for Image<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Image<{}>({} x {})",
            std::any::type_name::<P>(),
            self.width,
            self.height
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_picture_has_the_other_one_s_shape() {
        for (picture, kept) in [
            ([1280, 960], [0, 0, 1280, 960]),
            ([1920, 960], [320, 0, 1280, 960]),
            ([600, 1000], [0, 275, 600, 450]),
        ] {
            let part = Roi::middle_of(picture, [640, 480]);
            assert_eq!([part.x, part.y, part.width, part.height], kept);
        }
    }

    #[test]
    fn rows_lie_from_the_top() {
        let img = Image::from_fn(3, 2, |x, y| 10 * y + x);
        assert_eq!(
            img.rows().collect::<Vec<_>>(),
            [&[0, 1, 2][..], &[10, 11, 12]]
        );
    }

    #[test]
    fn crop_takes_the_named_pixels() {
        let img = Image::from_fn(4, 4, |x, y| 10 * y + x);
        let roi = Roi {
            x: 1,
            y: 2,
            width: 2,
            height: 2,
        };
        let part = img.crop(roi);
        assert_eq!(part.pixels(), [21, 22, 31, 32]);
        assert_eq!(img.clone().into_crop(roi), part);
        let whole = Roi::spanning(0..4, 0..4);
        assert_eq!(img.clone().into_crop(whole), img);
    }

    #[test]
    fn a_mask_and_its_complement_are_all_pixels() {
        let mask: Mask = Image::from_fn(4, 3, |x, y| x > y);
        assert_eq!((mask.count(), mask.complement().count()), (6, 6));
        let sum: f32 = mask.to_coverage().pixels().iter().map(|c| c.0).sum();
        assert_eq!(sum, 6.0);
    }

    #[test]
    fn an_empty_image_has_no_rows() {
        assert_eq!(Image::<u8>::new(0, 5).rows().count(), 0);
        assert_eq!(Image::<u8>::new(5, 0).rows().count(), 0);
    }

    #[test]
    fn a_region_grows_only_inside() {
        let roi = Roi {
            x: 1,
            y: 5,
            width: 3,
            height: 3,
        };
        assert_eq!(
            roi.grown(2, 10, 9),
            Roi {
                x: 0,
                y: 3,
                width: 6,
                height: 6
            }
        );
    }
}
