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
    let (w, h) = cutout.size();
    let longest = w.max(h).max(1);
    let side = |len: usize| (len * THUMBNAIL_SIDE_PX).div_ceil(longest);
    let small = if longest > THUMBNAIL_SIDE_PX {
        filter::resize(cutout, side(w), side(h))
    } else {
        cutout.clone()
    };
    Image::from_fn(small.width(), small.height(), |x, y| {
        let square = LinearRgb::grey(CHECKER_GREYS[(x / SQUARE_PX + y / SQUARE_PX) % 2]);
        small[(x, y)].over(square.opaque()).color()
    })
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
