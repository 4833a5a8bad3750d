//! Painting over what is not to be seen in a photo.

use crate::image::{Image, Roi};
use crate::pixel::{LinearRgb, Mix};

/// A Coons patch between the sides of a part of a picture: no edge is left.
struct CoonsPatch<'a> {
    source: &'a Image<LinearRgb>,
    /// First and last column and row around the part, inside the picture.
    columns: [usize; 2],
    rows: [usize; 2],
}

/// Puts what its four sides show in place of a part of a picture.
pub(super) fn inpaint(picture: &mut Image<LinearRgb>, part: Roi) {
    let source = picture.clone();
    let patch = CoonsPatch::new(&source, part);
    for y in part.y..part.y + part.height {
        for x in part.x..part.x + part.width {
            picture[(x, y)] = patch.at(x, y);
        }
    }
}

impl<'a> CoonsPatch<'a> {
    fn new(source: &'a Image<LinearRgb>, part: Roi) -> Self {
        let (w, h) = source.size();
        Self {
            source,
            columns: around(part.x, part.width, w),
            rows: around(part.y, part.height, h),
        }
    }

    fn at(&self, x: usize, y: usize) -> LinearRgb {
        let (source, [top, bottom]) = (self.source, self.rows);
        let s = share(x, self.columns);
        let t = share(y, self.rows);
        let across = self.mixed_row(y, s);
        let down = mix(source[(x, top)], source[(x, bottom)], t);
        let corners = mix(self.mixed_row(top, s), self.mixed_row(bottom, s), t);
        across.add_scaled(1.0, down).add_scaled(-1.0, corners)
    }

    /// Between the left and the right side in one row.
    fn mixed_row(&self, y: usize, s: f32) -> LinearRgb {
        let [left, right] = self.columns;
        mix(self.source[(left, y)], self.source[(right, y)], s)
    }
}

/// The places before and behind a range, where there are such.
fn around(start: usize, length: usize, end: usize) -> [usize; 2] {
    [
        start.saturating_sub(1),
        (start + length).min(end.saturating_sub(1)),
    ]
}

/// How far a place is from one to another, 0 to 1.
fn share(at: usize, [first, last]: [usize; 2]) -> f32 {
    (at - first) as f32 / (last - first).max(1) as f32
}

fn mix(a: LinearRgb, b: LinearRgb, share: f32) -> LinearRgb {
    a.scale(1.0 - share).add_scaled(share, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marker_is_painted_over_without_an_edge() {
        let slope = |x: usize, y: usize| {
            LinearRgb::new(0.05, 0.3 + 0.001 * x as f32 + 0.0005 * y as f32, 0.1)
        };
        let mut picture = Image::from_fn(80, 60, slope);
        let part = Roi {
            x: 20,
            y: 10,
            width: 30,
            height: 30,
        };
        (0..900).for_each(|i| picture[(20 + i % 30, 10 + i / 30)] = LinearRgb::WHITE);
        inpaint(&mut picture, part);
        let off = picture.zip_map(&Image::from_fn(80, 60, slope), |a, b| (a.g - b.g).abs());
        assert!(off.pixels().iter().all(|off| *off < 1e-5));
        inpaint(
            &mut picture,
            Roi {
                x: 0,
                y: 0,
                width: 80,
                height: 60,
            },
        );
    }
}
