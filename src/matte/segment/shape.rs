//! Outline and hull of an object in the photo, from what a search in a smaller picture found.

use super::choose::ChosenSearch;
use super::confidence::Confidence;
use super::holes::ObjectArea;
use super::{blur, hull, snap};
use crate::filter;
use crate::geom::Point2;
use crate::image::Image;
use crate::matte::Outline;
use crate::matte::prepared::Prepared;
use crate::matte::stroke::{StrokesOnPhoto, corrected_coverage};
use crate::pixel::Coverage;

/// Blur that turns the cracks between pixels into a line, pixels of the search.
const CRACK_BLUR_PX: f32 = 0.7;
/// By how much the hull of the edges is drawn in before it widens that of the outline, pixels of
/// the search: edges are accurate to a pixel; tips that are too thin to enclose anything reach
/// farther than that.
const TIP_INSET_PX: f64 = 1.0;

/// Pixels of the photo for a pixel of the picture that was searched, in x and y.
#[derive(Clone, Copy)]
pub(super) struct PixelScale([f64; 2]);

impl PixelScale {
    fn new(photo: (usize, usize), searched: (usize, usize)) -> Self {
        Self([
            photo.0 as f64 / searched.0 as f64,
            photo.1 as f64 / searched.1 as f64,
        ])
    }

    fn to_photo(self, p: Point2<f64>) -> Point2<f64> {
        Point2::new(p.x * self.0[0], p.y * self.0[1])
    }

    /// The larger of the two.
    pub(super) fn reduction(self) -> f64 {
        self.0[0].max(self.0[1])
    }
}

/// An object's lines, in pixels of the photo.
pub(super) struct ObjectShape {
    pub(super) outline: Outline,
    pub(super) hull: Vec<Point2<f64>>,
    pub(super) scale: PixelScale,
}

impl ObjectShape {
    /// The outline around the object's area, moved to where the photo changes or a person says, and
    /// the hull of it and of its thin tips.
    pub(super) fn new(
        prepared: &Prepared<'_>,
        chosen: &ChosenSearch<'_>,
        area: &ObjectArea,
        strokes: StrokesOnPhoto<'_>,
    ) -> Self {
        let scale = PixelScale::new(prepared.photo.size(), area.solid.size());
        let soft = filter::gaussian_blur(&area.solid.to_coverage(), CRACK_BLUR_PX);
        let rough = Outline::around(&soft).map(|p| scale.to_photo(p));
        let snapped = snap::snapped(&rough, &prepared.sqrt, scale.reduction());
        let outline = painted(snapped, strokes);
        let tips = chosen.hull_of(area);
        let tips = inset(&tips, TIP_INSET_PX).map(|p| scale.to_photo(p));
        let mut rings = outline.rings.clone();
        rings.push(tips.collect());
        Self {
            hull: Outline { rings }.hull(),
            outline,
            scale,
        }
    }

    /// Coverage of the hull and of what the outline encloses.
    pub(super) fn coverages(&self, (w, h): (usize, usize)) -> [Image<Coverage>; 2] {
        let hull = Outline::from_ring(self.hull.clone());
        [&hull, &self.outline].map(|outline| outline.coverage(w, h))
    }

    /// The confidence of a search, with what the outline itself adds to it.
    pub(super) fn confidence(&self, prepared: &Prepared<'_>, search: Confidence) -> Confidence {
        let reduction = self.scale.reduction();
        // A photo that was enlarged for the search has no finer pixels than its own.
        let pixel = reduction.max(1.0);
        Confidence {
            blur_px: blur::edge_blur_px(&self.outline, &prepared.sqrt, pixel),
            width_px: self.outline.width() / pixel,
            stray_px: hull::growth(&self.outline.hull(), &self.hull) / reduction,
            ..search
        }
    }
}

/// An outline in the photo that keeps to what strokes say of it, to a pixel.
fn painted(outline: Outline, strokes: StrokesOnPhoto<'_>) -> Outline {
    let (w, h) = strokes.photo;
    let Some(claims) = strokes.about_outline((w, h)) else {
        return outline;
    };
    let covered = corrected_coverage(outline.coverage(w, h), Some(&claims));
    Outline::around(&covered)
}

/// A convex polygon's corners moved towards its middle.
fn inset(hull: &[Point2<f64>], by: f64) -> impl Iterator<Item = Point2<f64>> {
    let middle = mean_point(hull);
    hull.iter().map(move |p| moved_towards(*p, middle, by))
}

fn mean_point(points: &[Point2<f64>]) -> Point2<f64> {
    points.iter().fold(Point2::origin(), |sum, p| {
        sum + p.coords / points.len() as f64
    })
}

fn moved_towards(p: Point2<f64>, goal: Point2<f64>, by: f64) -> Point2<f64> {
    let way = goal - p;
    if way.norm() > by {
        p + way * (by / way.norm())
    } else {
        goal
    }
}
