//! Masks: which pixels of a picture belong to an object, as runs down its columns.

use crate::geom::BBox;
use crate::label::rle;
use serde::{Deserialize, Serialize};

/// A yes or no for each pixel of a picture, in COCO's run lengths.
///
/// The runs go down the columns, from left to right, and alternate: the first is of pixels outside,
/// the second of pixels inside, and so on. In files: `{ size = [height, width], counts = "..." }`,
/// COCO's compressed text. The default is the mask of a picture without pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "rle::MaskText", into = "rle::MaskText")]
pub struct RleMask {
    size: [u32; 2],
    runs: Vec<u32>,
}

impl RleMask {
    /// From a function of column and row; `size` is width and height.
    pub fn from_fn(size: [u32; 2], mut inside: impl FnMut(u32, u32) -> bool) -> Self {
        let pixels = pixels_by_column(size);
        Self::from_pixels(size, pixels.map(|(x, y)| inside(x, y)))
    }

    /// From the pixels column by column.
    fn from_pixels(size: [u32; 2], pixels: impl Iterator<Item = bool>) -> Self {
        let mut runs = vec![0];
        let mut last = false;
        for pixel in pixels {
            if pixel != last {
                runs.push(0);
                last = pixel;
            }
            *runs.last_mut().expect("starts with one run") += 1;
        }
        Self { size, runs }
    }

    /// From runs; none unless they add up to the picture and no run except the first is empty.
    pub(crate) fn from_runs(size: [u32; 2], runs: Vec<u32>) -> Option<Self> {
        are_runs_of(size, &runs).then_some(Self { size, runs })
    }

    /// Width and height of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Run lengths, the first of pixels outside.
    pub fn runs(&self) -> &[u32] {
        &self.runs
    }

    /// Number of pixels inside.
    pub fn area(&self) -> u64 {
        self.inside().map(|(_, length)| length).sum()
    }

    /// Whether no pixel is inside.
    pub fn is_empty(&self) -> bool {
        self.runs.len() < 2
    }

    /// The box around the pixels inside, whole pixels; empty for an empty mask.
    pub fn bounds(&self) -> BBox {
        let height = u64::from(self.size[1]);
        self.inside()
            .map(|(start, length)| bounds_of_run(start, start + length - 1, height))
            .reduce(BBox::hull)
            .unwrap_or_default()
    }

    /// The pixels inside, column and row, column by column.
    pub fn pixels(&self) -> impl Iterator<Item = (u32, u32)> {
        let h = u64::from(self.size[1]);
        self.inside()
            .flat_map(|(start, n)| start..start + n)
            .map(move |i| ((i / h) as u32, (i % h) as u32))
    }

    /// Whether any pixel is inside this mask and another of the same picture.
    pub fn overlaps(&self, other: &Self) -> bool {
        let mut others = other.inside().peekable();
        self.inside().any(|(start, n)| {
            while others.next_if(|(at, m)| at + m <= start).is_some() {}
            others.peek().is_some_and(|(at, _)| *at < start + n)
        })
    }

    /// Start and length of each run of pixels inside.
    fn inside(&self) -> impl Iterator<Item = (u64, u64)> {
        let mut at = 0;
        let runs = self.runs.iter().map(move |&n| {
            let start = at;
            at += u64::from(n);
            (start, u64::from(n))
        });
        runs.skip(1).step_by(2)
    }
}

/// The box around the pixels from one to another, counted down the columns.
fn bounds_of_run(first: u64, last: u64, height: u64) -> BBox {
    let [left, right] = [first, last].map(|i| i / height);
    let [top, bottom] = if left == right {
        [first % height, last % height + 1]
    } else {
        // A run that continues in the next column touches the picture's lower and upper edge.
        [0, height]
    };
    BBox {
        x0: left as f64,
        y0: top as f64,
        x1: (right + 1) as f64,
        y1: bottom as f64,
    }
}

/// Whether the runs fill a picture, and none but the first is empty.
fn are_runs_of(size: [u32; 2], runs: &[u32]) -> bool {
    let sum: u64 = runs.iter().map(|&n| u64::from(n)).sum();
    let has_no_gap = runs.iter().skip(1).all(|&n| n > 0);
    has_no_gap && sum == pixel_count(size)
}

#[inline]
fn pixels_by_column([width, height]: [u32; 2]) -> impl Iterator<Item = (u32, u32)> {
    (0..width).flat_map(move |x| (0..height).map(move |y| (x, y)))
}

/// A mask under construction: one bit per pixel, column by column.
#[derive(Clone, Debug)]
pub(crate) struct MaskBits {
    words: Vec<u64>,
    size: [u32; 2],
}

impl MaskBits {
    /// No pixel is inside.
    pub(crate) fn new(size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Self {
            words: vec![0; pixels.div_ceil(u64::BITS as usize)],
            size,
        }
    }

    /// Marks a pixel as inside.
    #[inline]
    pub(crate) fn insert(&mut self, x: usize, y: usize) {
        let i = x * self.size[1] as usize + y;
        self.words[i / 64] |= 1 << (i % 64);
    }

    /// The runs: looks for the next pixel that differs, a word at a time.
    pub(crate) fn mask(&self) -> RleMask {
        let end = self.size[0] as usize * self.size[1] as usize;
        let mut runs = Vec::new();
        let (mut at, mut value) = (0, false);
        while at < end || runs.is_empty() {
            let next = self.next(at, !value).min(end);
            runs.push((next - at) as u32);
            (at, value) = (next, !value);
        }
        RleMask {
            size: self.size,
            runs,
        }
    }

    /// The first index from `at` on with this value, or any index beyond the end.
    fn next(&self, at: usize, value: bool) -> usize {
        let mut word = at / 64;
        let mut mask = u64::MAX << (at % 64);
        while let Some(&bits) = self.words.get(word) {
            let found = if value { bits } else { !bits } & mask;
            if found != 0 {
                return word * 64 + found.trailing_zeros() as usize;
            }
            (word, mask) = (word + 1, u64::MAX);
        }
        usize::MAX
    }
}

fn pixel_count([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Point2;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bits_and_pixels_give_the_same_runs(
            (w, h, dots) in (1..20_u32, 1..20_u32).prop_flat_map(|(w, h)| {
                (Just(w), Just(h), prop::collection::vec((0..w, 0..h), 0..60))
            })
        ) {
            let mut bits = MaskBits::new([w, h]);
            dots.iter().for_each(|&(x, y)| bits.insert(x as usize, y as usize));
            let mask = RleMask::from_fn([w, h], |x, y| dots.contains(&(x, y)));
            prop_assert_eq!(bits.mask(), mask.clone());
            let mut sorted = dots.clone();
            sorted.sort();
            sorted.dedup();
            prop_assert_eq!(mask.pixels().collect::<Vec<_>>(), sorted.clone());
            prop_assert_eq!(mask.area(), sorted.len() as u64);
            let corners = dots.iter().flat_map(|&(x, y)| [(x, y), (x + 1, y + 1)]);
            let around = BBox::around(corners.map(|(x, y)| Point2::new(x.into(), y.into())));
            prop_assert_eq!(mask.bounds(), around);
        }
    }

    proptest! {
        #[test]
        fn masks_overlap_where_they_share_a_pixel(
            bits in prop::collection::vec((0..4_u8, 0..4_u8), 30),
        ) {
            let mask = |of: fn(&(u8, u8)) -> u8| {
                RleMask::from_fn([5, 6], |x, y| of(&bits[(6 * x + y) as usize]) == 0)
            };
            let (a, b) = (mask(|bits| bits.0), mask(|bits| bits.1));
            prop_assert_eq!(a.overlaps(&b), bits.contains(&(0, 0)));
        }
    }

    #[test]
    fn a_full_mask_starts_with_an_empty_run() {
        let full = RleMask::from_fn([3, 2], |_, _| true);
        assert_eq!((full.runs(), full.area()), (&[0, 6][..], 6));
        assert_eq!(
            full.bounds(),
            BBox {
                x0: 0.0,
                y0: 0.0,
                x1: 3.0,
                y1: 2.0
            }
        );
    }

    #[test]
    fn an_empty_mask_has_no_bounds() {
        let none = MaskBits::new([4, 5]).mask();
        assert!(none.is_empty() && none.bounds().is_empty() && none.runs() == [20]);
    }
}
