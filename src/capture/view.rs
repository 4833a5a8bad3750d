//! The display as it is seen from straight above: what all photos are brought to.

use super::display::Display;
use super::recognise::FramePhoto;
use crate::camera::warp;
use crate::filter::Pyramid;
use crate::geom::{Homography, Point2};
use crate::image::{Image, Mask};
use crate::matte::ends_at_one;
use crate::pixel::{LinearRgb, Mix};
use nalgebra::{Matrix3, Vector3};

/// Longer side of a view at most, pixels: cut-outs keep no more.
const MAX_SIDE_PX: f64 = 3072.0;

/// A raster over the whole display, its top left first.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Width and height, pixels.
    pub size: (usize, usize),
    /// Pixels of the display for one of the view.
    pub display_px: f64,
}

impl View {
    /// As fine as a photo, so that nothing of it is lost.
    pub fn of_photo(display: &Display, photo: &FramePhoto) -> Self {
        let [w, h] = display.size_px.map(f64::from);
        let middle = Point2::new(w / 2.0, h / 2.0);
        let longer = |step: [f64; 2]| {
            let moved = photo
                .photo_from_display
                .map(middle + nalgebra::Vector2::from(step));
            (moved - photo.photo_from_display.map(middle)).norm()
        };
        let photo_px = longer([1.0, 0.0]).max(longer([0.0, 1.0]));
        let display_px = (1.0 / photo_px).max(w.max(h) / MAX_SIDE_PX);
        let size = ((w / display_px) as usize, (h / display_px) as usize);
        Self { size, display_px }
    }

    /// Place on the display of a pixel's middle, pixels of the display.
    #[inline]
    pub(super) fn display_at(&self, x: usize, y: usize) -> [f64; 2] {
        [x, y].map(|i| (i as f64 + 0.5) * self.display_px)
    }

    /// A photo as it is seen from above.
    pub(super) fn seen<P: Mix>(
        &self,
        photo: Image<P>,
        photo_from_display: &Homography,
    ) -> Image<P> {
        let display_from_view =
            Matrix3::from_diagonal(&Vector3::new(self.display_px, self.display_px, 1.0));
        let photo_from_view = Homography(photo_from_display.0 * display_from_view);
        warp(
            &Pyramid::new(photo),
            &photo_from_view,
            self.size.0,
            self.size.1,
        )
    }

    /// The pixels that show nothing but what a frame draws outside of its markers.
    pub(super) fn free_area(&self, display: &Display) -> Mask {
        let [w, h] = display.size_px.map(f64::from);
        let margin = display.cell_px() as f64;
        let papers = display.markers().map(|marker| marker.paper_corners_px());
        Image::from_fn(self.size.0, self.size.1, |x, y| {
            let [u, v] = self.display_at(x, y);
            let inside = u > margin && v > margin && u < w - margin && v < h - margin;
            let near = |[low, _, high, _]: &[[f64; 2]; 4]| {
                (low[0] - margin..high[0] + margin).contains(&u)
                    && (low[1] - margin..high[1] + margin).contains(&v)
            };
            inside && !papers.iter().any(near)
        })
    }
}

/// A channel from here on is clipped, in photos that end at 1.
const CLIPPED: f32 = 0.985;

/// Where a photo is clipped; nowhere in one that does not end at 1.
pub(super) fn clipped(photo: &Image<LinearRgb>) -> Mask {
    let is_limited = ends_at_one(photo);
    photo.map(|p| is_limited && p.max_channel() >= CLIPPED)
}
