//! How much of an object the place hides.

use crate::deep::HoldoutSample;
use crate::geom::Point2;
use crate::image::Image;
use crate::label::outline::bounds;
use crate::scene::{Card, Shot};
use geo::{Contains, MultiPolygon, Point};
use std::ops::Range;

/// Area of a part of a card's outline that the place hides, square pixels; 0 for a shot in which it
/// hides nothing.
pub(crate) fn hidden_area(region: &MultiPolygon<f64>, card: &Card, shot: &Shot) -> f64 {
    let Some(holdout) = &shot.holdout else {
        return 0.0;
    };
    let covered = covered_pixels(region, holdout);
    covered
        .filter(|(px, sample)| is_behind(card, shot, *px, sample))
        .filter(|(px, _)| region.contains(&Point::new(px.x, px.y)))
        .map(|(_, sample)| f64::from(sample.coverage.0))
        .sum()
}

/// Whether a card lies behind the place at a pixel.
fn is_behind(card: &Card, shot: &Shot, px: Point2<f64>, sample: &HoldoutSample) -> bool {
    let seen = shot.distortion().undistort(px);
    sample.hides(1.0 / card.inverse_depth(&shot.camera, seen))
}

/// Centres of the pixels around a region that the place covers, and how far.
fn covered_pixels<'a>(
    region: &MultiPolygon<f64>,
    holdout: &'a Image<HoldoutSample>,
) -> impl Iterator<Item = (Point2<f64>, &'a HoldoutSample)> + use<'a> {
    let around = bounds(region);
    let columns = pixels_between(around.x0, around.x1, holdout.width());
    let rows = pixels_between(around.y0, around.y1, holdout.height());
    let pixels = rows.flat_map(move |y| columns.clone().map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            (
                Point2::new(x as f64 + 0.5, y as f64 + 0.5),
                &holdout[(x, y)],
            )
        })
        .filter(|(_, sample)| sample.coverage.0 > 0.0)
}

fn pixels_between(low: f64, high: f64, side: usize) -> Range<usize> {
    low.max(0.0).floor() as usize..(high.ceil().max(0.0) as usize).min(side)
}
