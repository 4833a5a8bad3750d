//! Geometry, and every axis and pixel convention of the project, stated once.
//!
//! * **Lengths** are metres, angles radians, everything `f64`.
//! * **World**: right-handed, `+z` up. The labelled rectangle is the plane `z = 0`, centred on the
//!   origin, `+x` along its width, `+y` towards the top of the picture that it was labelled in.
//! * **Camera**: x right, y down, z forward (OpenCV).
//! * **Pixels**: origin at the top-left *corner* of the top-left pixel, x right, y down; pixel `(i,
//!   j)` has its centre at `(i + 0.5, j + 0.5)`, the picture covers `[0, width] x [0, height]`.
//! * **Card**: the plane `z = 0` of its own frame, centred, `+x` along the texture's columns,
//!   texture row 0 at `+y`. Texture coordinates `u, v` run from 0 to 1, right and *down*.
//! * **Names**: a transform is called `target_from_source`, so that `camera_from_world *
//!   world_from_card` reads and cancels.

mod bbox;

pub use bbox::BBox;
pub use nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};
use std::ops::Index;

/// A rigid placement: rotation, then translation in metres. Names say which frames it joins
/// (`world_from_card`).
///
/// In files: `{ rotation = [i, j, k, w], translation = [x, y, z] }` with a unit quaternion.
pub type Pose = nalgebra::Isometry3<f64>;

/// A half line.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Point3<f64>,
    /// Where it goes; its length sets the unit of the ray parameter.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> Point3<f64> {
        self.origin + self.direction * t
    }
}

/// A plane: the points `p` with `normal . p = offset`.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Signed distance from the origin along the normal.
    pub offset: f64,
}

impl Plane {
    /// The labelled surface, `z = 0`.
    pub fn surface() -> Self {
        Self {
            normal: Vector3::z(),
            offset: 0.0,
        }
    }

    /// Ray parameter where `ray` meets the plane in front of its origin; none for a parallel ray or
    /// a plane behind.
    pub fn intersect(&self, ray: &Ray) -> Option<f64> {
        let slope = self.normal.dot(&ray.direction);
        let t = (self.offset - self.normal.dot(&ray.origin.coords)) / slope;
        (t.is_finite() && t > 0.0).then_some(t)
    }
}

/// A rectangle in space: the shape of a card.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Its pose; the rectangle is the plane `z = 0` of this frame, centred.
    pub world_from_card: Pose,
    /// Width and height, metres.
    pub size: [f64; 2],
}

impl Quad {
    /// The corners in the order of the texture's corners: top left, top right, bottom right, bottom
    /// left.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| self.point(u, v))
    }

    /// The point at texture coordinates `u` (right) and `v` (down), 0 to 1.
    pub fn point(&self, u: f64, v: f64) -> Point3<f64> {
        self.world_from_card * Point3::new((u - 0.5) * self.size[0], (0.5 - v) * self.size[1], 0.0)
    }

    /// The plane it lies in, normal along the card's `+z`.
    pub fn plane(&self) -> Plane {
        let normal = self.world_from_card.rotation * Vector3::z();
        Plane {
            normal,
            offset: normal.dot(&self.world_from_card.translation.vector),
        }
    }

    /// Ray parameter and texture coordinates of the hit; none where the ray misses.
    pub fn intersect(&self, ray: &Ray) -> Option<(f64, Point2<f64>)> {
        let t = self.plane().intersect(ray)?;
        let local = self.world_from_card.inverse_transform_point(&ray.at(t));
        let uv = Point2::new(local.x / self.size[0] + 0.5, 0.5 - local.y / self.size[1]);
        let is_inside = uv.iter().all(|v| (0.0..=1.0).contains(v));
        is_inside.then_some((t, uv))
    }
}

/// A projective map from one plane to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography(pub nalgebra::Matrix3<f64>);

impl Homography {
    /// Maps a point; the result is not finite if it is at infinity.
    pub fn map(&self, p: Point2<f64>) -> Point2<f64> {
        let q = self.0 * p.to_homogeneous();
        Point2::new(q.x / q.z, q.y / q.z)
    }

    /// The inverse; none for a map of the plane onto a line.
    pub fn inverse(&self) -> Option<Self> {
        self.0.try_inverse().map(Self)
    }
}

/// A straight line in a picture: the points `p` with `normal . p = offset`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) normal: Vector2<f64>,
    pub(crate) offset: f64,
}

/// Lines at a smaller angle than this, radians, count as parallel.
const MIN_ANGLE_RAD: f64 = 0.05;

impl Line {
    /// The least-squares line through points; none for fewer than two.
    pub(crate) fn through(points: &[Point2<f64>]) -> Option<Self> {
        if points.len() < 2 {
            return None;
        }
        let mean = mean_point(points);
        let angle = main_direction(points, mean);
        let normal = Vector2::new(-libm::sin(angle), libm::cos(angle));
        Some(Self {
            normal,
            offset: normal.dot(&mean),
        })
    }

    /// Signed distance of a point, along the normal.
    pub(crate) fn distance(&self, p: Point2<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset
    }

    /// Where two lines meet; none for lines that are nearly parallel.
    pub(crate) fn meeting(&self, other: &Self) -> Option<Point2<f64>> {
        let det = self.normal.perp(&other.normal);
        let x = self.offset * other.normal.y - other.offset * self.normal.y;
        let y = self.normal.x * other.offset - other.normal.x * self.offset;
        let p = Point2::new(x / det, y / det);
        (det.abs() > MIN_ANGLE_RAD && p.coords.iter().all(|v| v.is_finite())).then_some(p)
    }
}

/// The sides of a closed ring, the last one back to its first corner.
#[doc(hidden)]
pub fn sides<T: Copy>(ring: &[T]) -> impl Iterator<Item = [T; 2]> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// Twice the area of a ring, by the shoelace formula; above 0 where it turns from x to y.
#[doc(hidden)]
pub fn doubled_area<P: Copy + Index<usize, Output = f64>>(ring: &[P]) -> f64 {
    sides(ring).map(|[a, b]| a[0] * b[1] - b[0] * a[1]).sum()
}

/// The corners of a quadrangle whose sides are on these lines, starting between the last line and
/// the first; none where neighbours are nearly parallel.
pub(crate) fn corners_between(sides: &[Line; 4]) -> Option<[Point2<f64>; 4]> {
    let mut corners = [Point2::origin(); 4];
    for (i, corner) in corners.iter_mut().enumerate() {
        *corner = sides[(i + 3) % 4].meeting(&sides[i])?;
    }
    Some(corners)
}

/// The mean of points, as an offset from the origin.
pub(crate) fn mean_point(points: &[Point2<f64>]) -> Vector2<f64> {
    let sum = points
        .iter()
        .fold(Vector2::zeros(), |sum, p| sum + p.coords);
    sum / points.len() as f64
}

/// The direction in which points spread most around their mean, radians from x.
fn main_direction(points: &[Point2<f64>], mean: Vector2<f64>) -> f64 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        let d = p.coords - mean;
        (xx, xy, yy) = (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y);
    }
    libm::atan2(2.0 * xy, xx - yy) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted() -> Quad {
        let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.1);
        Quad {
            world_from_card: Pose::from_parts(Vector3::new(0.1, 0.2, 0.3).into(), rotation),
            size: [0.25, 0.1],
        }
    }

    #[test]
    fn texture_row_zero_is_at_plus_y() {
        let quad = Quad {
            world_from_card: Pose::identity(),
            size: [2.0, 4.0],
        };
        assert_eq!(quad.corners()[0], Point3::new(-1.0, 2.0, 0.0));
        assert_eq!(quad.corners()[2], Point3::new(1.0, -2.0, 0.0));
    }

    #[test]
    fn a_ray_aimed_at_a_texture_coordinate_hits_it() {
        let quad = tilted();
        let eye = Point3::new(-0.4, 0.1, 2.0);
        let ray = Ray {
            origin: eye,
            direction: quad.point(0.3, 0.8) - eye,
        };
        let (t, uv) = quad.intersect(&ray).expect("aimed at the inside");
        assert!((t - 1.0).abs() < 1e-12 && (uv - Point2::new(0.3, 0.8)).norm() < 1e-12);
    }

    #[test]
    fn a_parallel_ray_misses() {
        let ray = Ray {
            origin: Point3::new(0.0, 0.0, 1.0),
            direction: Vector3::x(),
        };
        assert_eq!(Plane::surface().intersect(&ray), None);
    }

    #[test]
    fn a_ring_s_last_side_closes_it_and_its_turn_has_a_sign() {
        let ring = [[1.0, 1.0], [4.0, 1.0], [1.0, 3.0]];
        let last = sides(&ring).last();
        assert_eq!((sides(&ring).count(), last), (3, Some([ring[2], ring[0]])));
        assert_eq!(doubled_area(&ring), 6.0);
        assert_eq!(doubled_area(&ring.map(|[x, y]| Point2::new(y, x))), -6.0);
        assert_eq!((sides(&[0; 0]).count(), doubled_area(&ring[..1])), (0, 0.0));
    }

    #[test]
    fn a_homography_and_its_inverse_cancel() {
        let h = Homography(nalgebra::Matrix3::new(
            1.0, 0.2, 3.0, -0.1, 0.9, 5.0, 1e-3, 2e-3, 1.0,
        ));
        let p = Point2::new(7.0, -2.0);
        let back = h.inverse().expect("regular").map(h.map(p));
        assert!((back - p).norm() < 1e-12);
    }
}
