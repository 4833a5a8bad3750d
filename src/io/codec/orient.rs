//! Rotating a picture upright (EXIF `Orientation`).

use bytemuck::{Pod, zeroed_vec};
use rayon::prelude::*;

/// One of the eight values of the EXIF tag `Orientation`; anything else is treated as 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Orientation(pub(crate) u8);

impl Default for Orientation {
    /// Stored upright.
    fn default() -> Self {
        Self(1)
    }
}

impl Orientation {
    /// Whether rows of the file are columns of the picture.
    fn is_sideways(self) -> bool {
        (5..=8).contains(&self.0)
    }

    /// Size of the upright picture.
    pub(crate) fn size(self, (width, height): (usize, usize)) -> (usize, usize) {
        if self.is_sideways() {
            (height, width)
        } else {
            (width, height)
        }
    }

    /// Position of the upright pixel `(x, y)` in the file, whose last column and row are `right`
    /// and `bottom`.
    fn stored(self, x: usize, y: usize, right: usize, bottom: usize) -> (usize, usize) {
        match self.0 {
            2 => (right - x, y),
            3 => (right - x, bottom - y),
            4 => (x, bottom - y),
            5 => (y, x),
            6 => (y, bottom - x),
            7 => (right - y, bottom - x),
            8 => (right - y, x),
            _ => (x, y),
        }
    }

    /// Whether anything is rotated or mirrored.
    pub(crate) fn turns(self) -> bool {
        (2..=8).contains(&self.0)
    }

    /// The samples of the upright picture from those of the stored one, `n` per pixel.
    pub(crate) fn apply<T: Pod + Send + Sync>(
        self,
        stored: &[T],
        n: usize,
        size: (usize, usize),
    ) -> Vec<T> {
        let (width, _) = self.size(size);
        let mut out = zeroed_vec(stored.len());
        let rows = out.par_chunks_exact_mut(width * n).enumerate();
        rows.for_each(|(y, row)| self.fill_row(stored, size, y, row.chunks_exact_mut(n)));
        out
    }

    /// Fills the pixels of an upright row.
    fn fill_row<'a, T: Pod>(
        self,
        stored: &[T],
        (width, height): (usize, usize),
        y: usize,
        row: impl Iterator<Item = &'a mut [T]>,
    ) {
        for (x, pixel) in row.enumerate() {
            let (i, j) = self.stored(x, y, width - 1, height - 1);
            let n = pixel.len();
            pixel.copy_from_slice(&stored[(j * width + i) * n..][..n]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The letters of a 2 x 3 picture as rows, after rotation.
    fn turned(orientation: u8) -> Vec<String> {
        let turn = Orientation(orientation);
        let letters = turn.apply(b"abcdef", 1, (2, 3));
        let (width, _) = turn.size((2, 3));
        letters
            .chunks(width)
            .map(|row| String::from_utf8_lossy(row).into_owned())
            .collect()
    }

    /// EXIF 2.3, tag 274: "the 0th row is at the visual (top, bottom, left, right), the 0th column
    /// at the visual ...".
    #[test]
    fn all_eight_orientations_are_those_of_the_standard() {
        assert_eq!(turned(1), ["ab", "cd", "ef"]);
        assert_eq!(turned(2), ["ba", "dc", "fe"], "row 0 top, column 0 right");
        assert_eq!(
            turned(3),
            ["fe", "dc", "ba"],
            "row 0 bottom, column 0 right"
        );
        assert_eq!(turned(4), ["ef", "cd", "ab"], "row 0 bottom, column 0 left");
        assert_eq!(turned(5), ["ace", "bdf"], "row 0 left, column 0 top");
        assert_eq!(turned(6), ["eca", "fdb"], "row 0 right, column 0 top");
        assert_eq!(turned(7), ["fdb", "eca"], "row 0 right, column 0 bottom");
        assert_eq!(turned(8), ["bdf", "ace"], "row 0 left, column 0 bottom");
    }

    #[test]
    fn unknown_orientations_leave_the_picture_alone() {
        assert_eq!(turned(0), turned(1));
        assert_eq!(turned(99), turned(1));
    }
}
