//! The ground that an object covers where it starts to fall, to tell crowded places from empty ones.

use crate::geom::{Point2, UnitQuaternion, Vector2, Vector3};
use crate::scene::fall::level;

/// Points along the longer and the shorter side of an object at which the ground is asked about.
const POINTS: [usize; 2] = [9, 5];

/// The rectangle under an object, were it level.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    center: Point2<f64>,
    /// Directions of its width and of its height.
    axes: [Vector2<f64>; 2],
    /// Half its width and height, metres.
    half: [f64; 2],
}

impl Footprint {
    pub(super) fn new(
        above: [f64; 2],
        rotation: &UnitQuaternion<f64>,
        half: &Vector3<f64>,
    ) -> Self {
        let turn = level(rotation);
        Self {
            center: above.into(),
            axes: [Vector3::x(), Vector3::y()].map(|axis| (turn * axis).xy()),
            half: [half.x, half.y],
        }
    }

    /// How many others lie below a point of it, on average.
    pub(super) fn crowding(&self, others: &[Self]) -> f64 {
        let covered = self
            .points()
            .map(|point| others.iter().filter(|other| other.contains(point)).count())
            .sum::<usize>();
        covered as f64 / POINTS.iter().product::<usize>() as f64
    }

    fn points(&self) -> impl Iterator<Item = Point2<f64>> {
        let [along, across] = if self.half[0] >= self.half[1] {
            POINTS
        } else {
            [POINTS[1], POINTS[0]]
        };
        (0..across)
            .flat_map(move |j| (0..along).map(move |i| self.at(share(i, along), share(j, across))))
    }

    /// The point at shares of its half width and height.
    fn at(&self, x: f64, y: f64) -> Point2<f64> {
        self.center + self.axes[0] * (x * self.half[0]) + self.axes[1] * (y * self.half[1])
    }

    fn contains(&self, point: Point2<f64>) -> bool {
        let offset = point - self.center;
        (0..2).all(|axis| offset.dot(&self.axes[axis]).abs() <= self.half[axis])
    }
}

/// The middle of the `i`-th of equal parts of -1 to 1.
fn share(i: usize, count: usize) -> f64 {
    (2 * i + 1) as f64 / count as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(x: f64, y: f64, yaw_deg: f64) -> Footprint {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_deg.to_radians());
        Footprint::new([x, y], &turn, &Vector3::new(0.1, 0.05, 0.001))
    }

    #[test]
    fn crowding_is_the_mean_number_of_others_below() {
        let here = footprint(0.0, 0.0, 30.0);
        assert_eq!(here.crowding(&[]), 0.0);
        assert_eq!(here.crowding(&[footprint(0.3, 0.0, 0.0)]), 0.0);
        let twice = [footprint(0.0, 0.0, 30.0), footprint(0.0, 0.0, 210.0)];
        assert_eq!(here.crowding(&twice), 2.0);
        let across = footprint(0.0, 0.0, 120.0);
        assert!((0.4..0.7).contains(&here.crowding(&[across])));
    }

    #[test]
    fn a_turned_object_covers_what_it_lies_over() {
        let upright = footprint(0.0, 0.0, 90.0);
        assert!(upright.contains([0.0, 0.09].into()));
        assert!(!upright.contains([0.09, 0.0].into()));
    }
}
