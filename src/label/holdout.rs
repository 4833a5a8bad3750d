//! How much of an object the holdout hides.

use crate::deep::HoldoutSample;
use crate::geom::Point2;
use crate::image::Image;
use crate::label::outline::bounds;
use crate::scene::{Card, Shot};
use geo::{LinesIter, MultiPolygon};

/// Area of a part of a card's outline that the holdout hides, square pixels; 0 for a shot in which
/// it hides nothing.
pub(crate) fn hidden_area(region: &MultiPolygon<f64>, card: &Card, shot: &Shot) -> f64 {
    let Some(holdout) = &shot.holdout else {
        return 0.0;
    };
    pixels_inside(region, holdout)
        .filter(|(_, sample)| sample.coverage.0 > 0.0)
        .filter(|(px, sample)| is_behind(card, shot, *px, sample))
        .map(|(_, sample)| f64::from(sample.coverage.0))
        .sum()
}

/// Whether a card is behind the holdout at a pixel.
fn is_behind(card: &Card, shot: &Shot, px: Point2<f64>, sample: &HoldoutSample) -> bool {
    let seen = shot.distortion().undistort(px);
    sample.hides(1.0 / card.inverse_depth(&shot.camera, seen))
}

/// The pixels whose centres lie in a region, row by row: between the first and the second crossing
/// of its borders, the third and the fourth, and so on.
fn pixels_inside<'a>(
    region: &MultiPolygon<f64>,
    holdout: &'a Image<HoldoutSample>,
) -> impl Iterator<Item = (Point2<f64>, &'a HoldoutSample)> + use<'a> {
    let first_row = bounds(region).y0.max(0.0).floor() as usize;
    let rows = crossings_by_row(region, first_row, holdout.height());
    let spans = (first_row..).zip(rows).flat_map(|(y, crossings)| {
        (0..crossings.len() / 2).map(move |i| (y, [crossings[2 * i], crossings[2 * i + 1]]))
    });
    spans.flat_map(move |(y, ends)| {
        let [left, right] = ends.map(|x| first_center(x).min(holdout.width()));
        let center = move |x| Point2::new(x as f64 + 0.5, y as f64 + 0.5);
        (left..right).map(move |x| (center(x), &holdout[(x, y)]))
    })
}

/// Where the borders of a region cross the middle of each row of pixels, from left to right.
fn crossings_by_row(region: &MultiPolygon<f64>, first_row: usize, height: usize) -> Vec<Vec<f64>> {
    let last_row = first_center(bounds(region).y1).min(height);
    let mut rows = vec![Vec::new(); last_row.saturating_sub(first_row)];
    for side in region.lines_iter() {
        let [top, bottom] = [side.start.y.min(side.end.y), side.start.y.max(side.end.y)];
        for y in first_center(top)..first_center(bottom).min(last_row) {
            let share = (y as f64 + 0.5 - side.start.y) / side.dy();
            rows[y - first_row].push(side.start.x + share * side.dx());
        }
    }
    rows.iter_mut().for_each(|row| row.sort_by(f64::total_cmp));
    rows
}

/// The first pixel whose centre is at or after a position.
fn first_center(position: f64) -> usize {
    (position - 0.5).ceil().max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use geo::{Contains, Point, polygon};

    #[test]
    fn pixels_inside_are_those_whose_centres_a_region_contains() {
        let ring = polygon!(
            exterior: [(x: 2.2, y: 1.1), (x: 13.3, y: 0.2), (x: 15.0, y: 9.7), (x: 4.1, y: 12.0)],
            interiors: [[(x: 5.3, y: 4.4), (x: 9.9, y: 3.1), (x: 8.2, y: 8.8)]],
        );
        // Beyond the picture on two sides.
        let other = polygon![(x: 10.2, y: 11.4), (x: 30.3, y: 11.0), (x: 12.7, y: 20.2)];
        for region in [vec![ring.clone()], vec![ring, other], vec![]].map(MultiPolygon) {
            let picture = Image::filled(16, 14, HoldoutSample::default());
            let found = pixels_inside(&region, &picture).map(|(px, _)| (px.x, px.y));
            let all = (0..14 * 16).map(|i| (f64::from(i % 16) + 0.5, f64::from(i / 16) + 0.5));
            let inside =
                all.filter(|&(x, y)| region.iter().any(|part| part.contains(&Point::new(x, y))));
            assert!(found.eq(inside));
        }
    }
}
