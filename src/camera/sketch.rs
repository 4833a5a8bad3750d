//! What a camera sees of its rectangle, as lines for others to draw: rectangle, metric grid, a box
//! over it and the horizon.

use super::overlay::{grid, grid_step};
use super::pinhole::{Camera, distorted_line};
use super::rectangle::corner_points;
use super::solution::Solution;
use crate::geom::{Point2, Point3};
use serde::Serialize;

/// The horizon is drawn from so many widths of the picture left of it to as many right of it.
const HORIZON_WIDTHS: f64 = 1.0;

/// Positions in a picture along a line, pixels.
type Polyline = Vec<[f64; 2]>;

/// Lines over a photo for judging its camera, bent as its lens bends them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sketch {
    /// The sides of the rectangle.
    pub rectangle: Vec<Polyline>,
    /// Lines on the surface, [`grid_step`](Self::grid_step) apart.
    pub grid: Vec<Polyline>,
    /// Metres between them: 1, 2 or 5 times a power of ten.
    pub grid_step: f64,
    /// Upright edges and rim of a box over the rectangle.
    pub walls: Vec<Polyline>,
    /// Height of that box, metres.
    pub wall_height: f64,
    /// Where the surface would end if it were endless; none for a view from straight above.
    pub horizon: Option<[[f64; 2]; 2]>,
}

impl Sketch {
    /// The lines of a solution, with a box of some height, metres.
    pub fn new(solution: &Solution, wall_height: f64) -> Self {
        let base = corner_points(solution.size);
        let sides = [0, 1, 2, 3].map(|i| [base[i], base[(i + 1) % 4]]);
        let lines = |ends: &mut dyn Iterator<Item = [Point3<f64>; 2]>| {
            ends.filter_map(|ends| polyline(solution, ends)).collect()
        };
        let raised = |foot: Point3<f64>| Point3::new(foot.x, foot.y, wall_height);
        let rims = sides.iter().map(|ends| ends.map(raised));
        let edges = base.iter().map(|&foot| [foot, raised(foot)]);
        Self {
            rectangle: lines(&mut sides.into_iter()),
            grid: lines(&mut grid(solution.size)),
            grid_step: grid_step(solution.size),
            walls: lines(&mut rims.chain(edges)),
            wall_height,
            horizon: horizon(&solution.camera),
        }
    }
}

fn polyline(solution: &Solution, ends: [Point3<f64>; 2]) -> Option<Polyline> {
    let seen = distorted_line(&solution.camera, solution.kappa, ends)?;
    Some(seen.into_iter().map(Into::into).collect())
}

/// Two points of the line where directions along the surface are seen.
///
/// # Method
/// A direction `d` of the camera is level where it is at right angles to the surface's normal; of
/// `(x, y, 1)` that is a line.
fn horizon(camera: &Camera) -> Option<[[f64; 2]; 2]> {
    let normal = camera.camera_from_world.rotation * nalgebra::Vector3::z();
    let width = f64::from(camera.image[0]);
    let at = |x_px: f64| {
        let x = (x_px - camera.principal_px.x) / camera.focal_px.x;
        let y = -(normal.x * x + normal.z) / normal.y;
        Point2::new(x_px, camera.principal_px.y + y * camera.focal_px.y)
    };
    let ends = [-HORIZON_WIDTHS * width, (1.0 + HORIZON_WIDTHS) * width].map(at);
    let reach = MAX_HORIZON_SIDES * f64::from(camera.image[0].max(camera.image[1]));
    ends.iter()
        .all(|end| end.y.abs() < reach)
        .then(|| ends.map(Into::into))
}

/// A horizon farther from the picture, in its longer sides, is of no use to anybody.
const MAX_HORIZON_SIDES: f64 = 20.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Label, SolveOptions, solve};

    fn tilted() -> Solution {
        let corners = [
            [120.0, 124.5],
            [520.0, 124.5],
            [577.1, 388.5],
            [62.9, 388.5],
        ];
        let label = Label::new([640, 480], corners, [0.6, 0.4]);
        solve(&label, &SolveOptions::default()).unwrap()
    }

    #[test]
    fn the_rectangle_is_drawn_through_its_corners() {
        let solution = tilted();
        let sketch = Sketch::new(&solution, 0.1);
        assert_eq!((sketch.rectangle.len(), sketch.walls.len()), (4, 8));
        for (side, corner) in sketch.rectangle.iter().zip(&solution.corners_px) {
            assert!((Point2::from(side[0]) - corner).norm() < 0.5);
        }
    }

    #[test]
    fn the_horizon_is_where_parallel_lines_of_the_surface_meet() {
        let solution = tilted();
        let [left, right] = Sketch::new(&solution, 0.1).horizon.unwrap();
        let far = Point3::new(0.0, 1e7, 0.0);
        let (seen, _) = solution.camera.project(far).unwrap();
        let along = (seen.x - left[0]) / (right[0] - left[0]);
        let expected = left[1] + along * (right[1] - left[1]);
        assert!((seen.y - expected).abs() < 1e-2, "{seen} {expected}");
    }
}
