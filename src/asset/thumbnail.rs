//! A small picture of a cut-out, for people.

use crate::filter;
use crate::image::Image;
use crate::pixel::{LinearRgb, PremulRgba};

/// Longer side of a thumbnail, pixels.
const THUMBNAIL_SIDE_PX: usize = 192;
/// Side of a square of the checkerboard, pixels.
const SQUARE_PX: usize = 8;
/// The two greys of the checkerboard, scene-linear.
const CHECKER_GREYS: [f32; 2] = [0.2, 0.45];

/// The cut-out over a checkerboard, at most 192 pixels a side.
pub(super) fn thumbnail(cutout: &Image<PremulRgba>) -> Image<LinearRgb> {
    let (width, height) = fitted_size(cutout.size(), THUMBNAIL_SIDE_PX);
    let small = if cutout.width().max(cutout.height()) > THUMBNAIL_SIDE_PX {
        filter::resize(cutout, width, height)
    } else {
        cutout.clone()
    };
    Image::from_fn(small.width(), small.height(), |x, y| {
        small[(x, y)].over(checkerboard(x, y).opaque()).color()
    })
}

/// A size of the same proportions, at most `longest` pixels a side; at least one.
pub(super) fn fitted_size((w, h): (usize, usize), longest: usize) -> (usize, usize) {
    let side = w.max(h).max(longest);
    let [w, h] = [w, h].map(|len| (len * longest).div_ceil(side).max(1));
    (w, h)
}

/// The grey of a checkerboard at a pixel.
pub(super) fn checkerboard(x: usize, y: usize) -> LinearRgb {
    LinearRgb::grey(CHECKER_GREYS[(x / SQUARE_PX + y / SQUARE_PX) % 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thumbnail_is_small_and_shows_the_board_where_nothing_is() {
        let thumb = thumbnail(&Image::filled(1000, 300, PremulRgba::TRANSPARENT));
        assert_eq!(thumb.size(), (192, 58));
        assert_eq!(thumb[(0, 0)], LinearRgb::grey(CHECKER_GREYS[0]));
        assert_eq!(thumb[(8, 0)], LinearRgb::grey(CHECKER_GREYS[1]));
    }
}
