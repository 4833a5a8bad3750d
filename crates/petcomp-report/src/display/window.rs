//! The part of a display that a bottle's pictures show, seen straight from above.

use super::place::{Bottle, Place};
use nalgebra::Matrix3;
use petcomp::camera::warp;
use petcomp::filter::Pyramid;
use petcomp::geom::{Homography, Point2};
use petcomp::image::Roi;
use petcomp::pixel::Mix;
use petcomp::{Image, LinearRgb};

/// Pixels of the display, a whole number from its upper left corner.
pub(super) struct Window {
    roi: Roi,
    /// From pixels of the window to those of a bottle's pictures.
    photo_from_window: Homography,
    /// From pixels of the window to those of the view.
    view_from_window: Homography,
}

fn moved_by(x: f64, y: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, x, 0.0, 1.0, y, 0.0, 0.0, 1.0)
}

impl Window {
    pub(super) fn of(place: &Place, bottle: &Bottle) -> Self {
        let [x0, y0, x1, y1] = bottle.crop_px;
        let corner = place
            .display_from_photo
            .map(Point2::new(x0 as f64, y0 as f64));
        let [x, y] = [corner.x.ceil(), corner.y.ceil()];
        let to_view = place.display_from_photo.0.try_inverse();
        let to_view = to_view.unwrap_or_else(Matrix3::identity) * moved_by(x, y);
        Self {
            roi: Roi {
                x: x as usize,
                y: y as usize,
                width: x1 - x0 - 2,
                height: y1 - y0 - 2,
            },
            photo_from_window: Homography(moved_by(-(x0 as f64), -(y0 as f64)) * to_view),
            view_from_window: Homography(to_view),
        }
    }

    pub(super) fn roi(&self) -> Roi {
        self.roi
    }

    pub(super) fn size(&self) -> (usize, usize) {
        (self.roi.width, self.roi.height)
    }

    /// A picture of a bottle.
    pub(super) fn seen<P: Mix>(&self, picture: Image<P>) -> Image<P> {
        let (w, h) = self.size();
        warp(&Pyramid::new(picture), &self.photo_from_window, w, h)
    }

    /// Where a place of the window is in a bottle's pictures.
    pub(super) fn in_photo(&self, at: Point2<f64>) -> Point2<f64> {
        self.photo_from_window.map(at)
    }

    /// A picture of the whole view at a place of the window, between pixels.
    pub(super) fn of_view(&self, view: &Image<LinearRgb>, at: Point2<f64>) -> LinearRgb {
        bilinear(view, self.view_from_window.map(at))
    }
}

fn bilinear(image: &Image<LinearRgb>, at: Point2<f64>) -> LinearRgb {
    let [x, y] = [at.x - 0.5, at.y - 0.5];
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
    corners.into_iter().fold(LinearRgb::BLACK, |sum, (dx, dy)| {
        let (i, j) = (x.floor() + dx, y.floor() + dy);
        let weight = (1.0 - (x - i).abs()) * (1.0 - (y - j).abs());
        sum.add_scaled(weight as f32, image.nearest(i as isize, j as isize))
    })
}
