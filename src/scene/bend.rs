//! Curved cards.

use crate::error::Result;
use crate::geom::{Point2, Point3, Vector2, Vector3, sides};
use crate::scene::Card;
use crate::scene::bounds::{BEND, TURN};
use crate::scene::check::field;
use serde::{Deserialize, Serialize};

/// Most that an outline turns between two of its points, radians.
const OUTLINE_STEP: f64 = 0.02;
/// Lowest eye, as a share of the card's reach, that sees a card as curved. From lower down the card
/// is almost edge-on, and a bend of 60 degrees reaches halfway up to the eye.
const LEAST_EYE_HEIGHT_RATIO: f64 = 0.5;

/// Curvature of a card: part of a cylinder whose axis is parallel to the card. A card that the
/// camera sees almost edge-on is treated as flat in the picture and in its outline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bend {
    /// Degrees between the tangents at the two ends; positive if the ends are on the side that the
    /// front faces. Default: 0.
    pub deg: f64,
    /// Direction of the axis in the card, degrees from its width towards its upper side. Default:
    /// 0.
    pub axis_deg: f64,
}

impl Bend {
    /// Whether there is no bend.
    pub fn is_flat(&self) -> bool {
        self.deg == 0.0
    }

    /// Fails on the first impossible value.
    pub(super) fn check(&self, at: &str) -> Result<()> {
        BEND.check(&field(at, "deg"), self.deg)?;
        TURN.check(&field(at, "axis_deg"), self.axis_deg)
    }

    /// The cylinder of a card of this size; none if it is flat.
    fn cylinder(&self, [w, h]: [f64; 2]) -> Option<Cylinder> {
        if self.is_flat() {
            return None;
        }
        let axis = self.axis_deg.to_radians();
        let along = Vector2::new(-libm::sin(axis), libm::cos(axis));
        let reach = 0.5 * (w * along.x.abs() + h * along.y.abs());
        let curvature = 0.5 * self.deg.to_radians() / reach;
        let end = curvature * reach;
        Some(Cylinder {
            along,
            reach,
            curvature,
            mean_height: (1.0 - libm::sin(end) / end) / curvature,
        })
    }
}

/// A curved card in the frame of the flat one: x right, y up, z towards a viewer of its front.
///
/// Its mean height over the flat card is 0, and its middle line keeps its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cylinder {
    /// Unit vector in the card, across the axis.
    along: Vector2<f64>,
    /// From the middle to either end, along the card, metres.
    pub(crate) reach: f64,
    /// Radians per metre.
    curvature: f64,
    /// Mean height of the arc over its middle line.
    mean_height: f64,
}

impl Cylinder {
    /// Position of a point of the flat card along the bend, metres from the middle.
    pub(crate) fn arc_of(&self, p: &Point2<f64>) -> f64 {
        self.along.dot(&p.coords)
    }

    /// Where the bend moves a point of the flat card to.
    pub(crate) fn point(&self, p: &Point2<f64>) -> Point3<f64> {
        let arc = self.arc_of(p);
        let across = p.coords - self.along * arc;
        let place = across + self.along * (libm::sin(self.curvature * arc) / self.curvature);
        Point3::from(place.push(self.height(arc)))
    }

    fn height(&self, arc: f64) -> f64 {
        (1.0 - libm::cos(self.curvature * arc)) / self.curvature - self.mean_height
    }

    /// Unit normal on the side of the front.
    pub(crate) fn normal(&self, arc: f64) -> Vector3<f64> {
        let turn = self.curvature * arc;
        (self.along * -libm::sin(turn)).push(libm::cos(turn))
    }

    /// Where the ray from an eye through a point meets the flat card's plane.
    pub(crate) fn on_plane(&self, eye: &Point3<f64>, place: &Point3<f64>) -> Point2<f64> {
        (eye + (place - eye) * (eye.z / (eye.z - place.z))).xy()
    }

    /// The point of the card, in flat coordinates, that an eye sees at `p` of the flat card's
    /// plane; not finite where the ray misses the cylinder.
    ///
    /// # Method
    /// The ray meets the circle of the bend at the roots of a quadratic equation. The visible point
    /// is the root that tends to `p` as the bend tends to zero: the far side of a trough, the near
    /// one of a ridge.
    pub(crate) fn seen_point(&self, eye: &Point3<f64>, p: &Point2<f64>) -> Point2<f64> {
        let start = self.arc_of(p);
        let step = self.arc_of(&eye.xy()) - start;
        let square = self.curvature * (step * step + eye.z * eye.z);
        let linear = eye.z - self.curvature * (start * step + self.mean_height * eye.z);
        let constant = self.curvature * (start * start + self.mean_height * self.mean_height)
            - 2.0 * self.mean_height;
        let root = (linear * linear - square * constant).sqrt();
        // From `p` to the eye.
        let share = constant / (linear + root.copysign(eye.z));
        let met = p + (eye.xy() - p) * share;
        met + self.along * (self.arc_at(&met, share * eye.z) - self.arc_of(&met))
    }

    /// Position along the bend of a point of the cylinder.
    fn arc_at(&self, place: &Point2<f64>, height: f64) -> f64 {
        let sine = self.curvature * self.arc_of(place);
        let cosine = 1.0 - self.curvature * (height + self.mean_height);
        libm::atan2(sine, cosine) / self.curvature
    }

    /// Points from one point of the flat card towards another, without the last one.
    fn edge(self, a: Point2<f64>, b: Point2<f64>) -> impl Iterator<Item = Point3<f64>> {
        let turn = self.curvature * (self.arc_of(&b) - self.arc_of(&a));
        let count = (turn.abs() / OUTLINE_STEP).ceil().max(1.0) as usize;
        (0..count).map(move |k| self.point(&(a + (b - a) * (k as f64 / count as f64))))
    }
}

impl Card {
    /// The point of the card at texture coordinates `u` (right) and `v` (down), 0 to 1.
    pub fn point(&self, u: f64, v: f64) -> Point3<f64> {
        match self.bend.cylinder(self.quad.size) {
            None => self.quad.point(u, v),
            Some(cylinder) => self.quad.world_from_card * cylinder.point(&self.flat_point(u, v)),
        }
    }

    /// Its cylinder as an eye sees it; none for a flat card and for one seen at such a low angle
    /// that it is treated as flat.
    pub(crate) fn cylinder_seen_from(&self, eye: &Point3<f64>) -> Option<Cylinder> {
        let height = self.quad.world_from_card.inverse_transform_point(eye).z;
        let cylinder = self.bend.cylinder(self.quad.size)?;
        (height.abs() >= LEAST_EYE_HEIGHT_RATIO * cylinder.reach).then_some(cylinder)
    }

    fn flat_point(&self, u: f64, v: f64) -> Point2<f64> {
        let [w, h] = self.quad.size;
        Point2::new((u - 0.5) * w, (0.5 - v) * h)
    }

    /// Its outline in space as an eye sees it, in order; a curved card has points between the
    /// corners.
    pub(crate) fn outline(&self, eye: &Point3<f64>) -> Vec<Point3<f64>> {
        let corners = self.outline_uv.iter();
        let Some(cylinder) = self.cylinder_seen_from(eye) else {
            return corners.map(|uv| self.quad.point(uv.x, uv.y)).collect();
        };
        let flat: Vec<_> = corners.map(|uv| self.flat_point(uv.x, uv.y)).collect();
        sides(&flat)
            .flat_map(|[a, b]| cylinder.edge(a, b))
            .map(|p| self.quad.world_from_card * p)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [f64; 2] = [0.3, 0.1];

    fn cylinder(deg: f64, axis_deg: f64) -> Cylinder {
        Bend { deg, axis_deg }.cylinder(SIZE).unwrap()
    }

    fn points() -> impl Iterator<Item = Point2<f64>> {
        (0..13).flat_map(|i| {
            (0..5)
                .map(move |j| Point2::new(f64::from(i) * 0.025 - 0.15, f64::from(j) * 0.025 - 0.05))
        })
    }

    #[test]
    fn lengths_along_the_card_and_across_it_are_kept() {
        let bent = cylinder(30.0, 25.0);
        for p in points() {
            let step = 1e-6;
            for way in [Vector2::x(), Vector2::y(), Vector2::new(0.6, 0.8)] {
                let moved = bent.point(&(p + way * step)) - bent.point(&p);
                assert!((moved.norm() / step - 1.0).abs() < 1e-5);
                let normal = bent.normal(bent.arc_of(&p));
                assert!(normal.dot(&moved).abs() < 1e-6 * step.sqrt());
            }
        }
    }

    #[test]
    fn it_turns_by_its_angle_and_lies_in_the_mean_on_the_flat_card() {
        let bent = cylinder(40.0, 90.0);
        let ends = [bent.normal(-bent.reach), bent.normal(bent.reach)];
        assert!((ends[0].angle(&ends[1]).to_degrees() - 40.0).abs() < 1e-9);
        assert!((bent.reach - 0.15).abs() < 1e-12);
        let count = 10_000;
        let heights = (0..count).map(|k| bent.height((f64::from(k) + 0.5) / 5e4 - 0.1));
        let part = heights.sum::<f64>() / f64::from(count);
        let radius = 0.3 / 40_f64.to_radians();
        // The mean height of the arc's middle two thirds, by the circle's own equation.
        let expected = (0..count).map(|k| {
            let turn = ((f64::from(k) + 0.5) / 5e4 - 0.1) / radius;
            radius - radius * turn.cos()
        });
        let expected = expected.sum::<f64>() / f64::from(count) - bent.mean_height;
        assert!((part - expected).abs() < 1e-9);
        assert!(bent.point(&Point2::new(0.15, 0.0)).z > 0.0);
    }

    #[test]
    fn an_eye_sees_the_point_that_lies_on_its_ray() {
        for (deg, axis) in [(20.0, 90.0), (-35.0, 10.0), (60.0, 60.0), (1e-6, 0.0)] {
            let bent = cylinder(deg, axis);
            for eye in [Point3::new(0.1, -0.5, 0.9), Point3::new(0.4, 0.2, -0.8)] {
                for p in points() {
                    let place = bent.point(&p);
                    // Where the ray from the eye through the point meets the plane of the flat card.
                    let on_plane = eye + (place - eye) * (eye.z / (eye.z - place.z));
                    let seen = bent.seen_point(&eye, &on_plane.xy());
                    assert!((seen - p).norm() < 1e-8, "{deg} {axis}: {seen} {p}");
                }
            }
        }
    }
}
