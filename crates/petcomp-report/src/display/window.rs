//! The part of a display that a bottle's pictures show, seen from straight above.

use super::place::{Bottle, Place};
use nalgebra::Matrix3;
use petcomp::camera::warp;
use petcomp::filter::Pyramid;
use petcomp::geom::{Homography, Point2};
use petcomp::matte::LightPath;
use petcomp::{Image, LinearRgb, Mix, Roi};

/// Pixels of the display, a whole number from its upper left corner.
pub(super) struct DisplayWindow {
    roi: Roi,
    /// From pixels of the window to those of a bottle's pictures.
    photo_from_window: Homography,
    /// From pixels of the window to those of the view.
    view_from_window: Homography,
    /// Pixels of the view around the window, on its nearest side.
    margin_px: usize,
}

fn moved_by(x: f64, y: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, x, 0.0, 1.0, y, 0.0, 0.0, 1.0)
}

impl DisplayWindow {
    pub(super) fn of(place: &Place, bottle: &Bottle) -> Self {
        let [x0, y0, x1, y1] = bottle.crop_px;
        let [w, h] = place.view_px;
        let corner = place
            .display_from_photo()
            .map(Point2::new(x0 as f64, y0 as f64));
        let [x, y] = [corner.x.ceil(), corner.y.ceil()];
        let to_view = place.display_from_photo().0.try_inverse();
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
            margin_px: x0.min(y0).min(w - x1).min(h - y1).saturating_sub(2),
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

    /// Position in a bottle's pictures of a position in the window.
    pub(super) fn in_photo(&self, at: Point2<f64>) -> Point2<f64> {
        self.photo_from_window.map(at)
    }

    /// A picture of the whole view, including a margin around the window.
    pub(super) fn with_margin(&self, view: Image<LinearRgb>) -> Surroundings {
        let (w, h) = self.size();
        let margin = self.margin_px;
        let from_margin = moved_by(-(margin as f64), -(margin as f64));
        let view_from_margin = Homography(self.view_from_window.0 * from_margin);
        let picture = warp(
            &Pyramid::new(view),
            &view_from_margin,
            w + 2 * margin,
            h + 2 * margin,
        );
        Surroundings {
            picture: Pyramid::new(picture),
            margin_px: margin,
        }
    }
}

/// What is in a window and around it.
pub(super) struct Surroundings {
    picture: Pyramid<LinearRgb>,
    margin_px: usize,
}

impl Surroundings {
    /// What is seen along a path from a pixel of the window.
    pub(super) fn seen(&self, path: LightPath, x: usize, y: usize) -> LinearRgb {
        let [x, y] = [x, y].map(|i| (i + self.margin_px) as f64 + 0.5);
        path.seen(&self.picture, Point2::new(x, y))
    }
}
