//! Focal length and pose from the picture of a rectangle, in closed form.
//!
//! # Method
//! The depth of a corner is the area of the triangle of the other three (both parallelogram
//! identities in homogeneous coordinates); with depths the sides' directions follow without
//! intersecting any lines, so parallel sides are nothing special. Two equations are linear in the
//! squared focal length: the sides are at right angles, and their ratio is known. They are the
//! imaginary and the real part of one complex equation, which gives them their weights.

use super::corners::triangle_areas;
use crate::geom::{Homography, Point2, Point3, Vector2};
use nalgebra::{Matrix3, Vector3};

/// The picture of a rectangle in homogeneous coordinates; units as in [`camera`](super).
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectedRectangle {
    /// Direction of +x: its picture, and its change of depth.
    along: (Vector2<f64>, f64),
    /// Direction of -y, likewise.
    down: (Vector2<f64>, f64),
    /// The rectangle's centre.
    center: Vector3<f64>,
}

/// A pose in the parameters that stay well conditioned from every side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScaledPose {
    /// Camera axes from world axes.
    pub(crate) rotation: Matrix3<f64>,
    /// Picture of the rectangle's centre, relative to the principal point.
    pub(crate) center: Vector2<f64>,
    /// Picture lengths per length, at the centre: focal length over depth.
    pub(crate) scale: f64,
}

impl ProjectedRectangle {
    /// From corners in the order top left, top right, bottom right, bottom left, relative to the
    /// principal point.
    pub(crate) fn new(corners: &[Vector2<f64>; 4]) -> Self {
        let [c0, c1, c2, c3] = homogeneous_corners(corners);
        let [along, down] = [c1 - c0, c3 - c0];
        Self {
            along: (along.xy(), along.z),
            down: (down.xy(), down.z),
            center: (c0 + c2) / 2.0,
        }
    }

    /// The squared focal length, for a rectangle whose width is `ratio` times its height.
    ///
    /// Zero, negative or not finite where the picture shows no perspective: from exactly above, or
    /// in the noise.
    pub(crate) fn focal_squared(&self, ratio: f64) -> f64 {
        let ((a, dw), (b, dh)) = (self.along, self.down);
        let r2 = ratio * ratio;
        let right_angle = dw * dh;
        let sides = dw * dw - r2 * dh * dh;
        let weight = dw * dw + r2 * dh * dh;
        -(sides * (a.norm_squared() - r2 * b.norm_squared()) + 4.0 * r2 * right_angle * a.dot(&b))
            / (weight * weight)
    }

    /// The squared focal length from the right angle alone, for a rectangle of unknown sides.
    pub(crate) fn focal_squared_any_ratio(&self) -> f64 {
        let ((a, dw), (b, dh)) = (self.along, self.down);
        -a.dot(&b) / (dw * dh)
    }

    /// Width over height of the rectangle, for a known focal length.
    pub(crate) fn ratio(&self, focal: f64) -> f64 {
        let f2 = focal * focal;
        (length_squared(self.along, f2) / length_squared(self.down, f2)).sqrt()
    }

    /// The pose for a known focal length and size; the sides are made orthogonal symmetrically.
    pub(crate) fn pose_at(&self, focal: f64, size: [f64; 2]) -> ScaledPose {
        let ((a, dw), (b, dh)) = (self.along, self.down);
        let along = a.push(focal * dw);
        let up = -b.push(focal * dh);
        ScaledPose {
            rotation: rotation_between(&along, &up),
            center: self.center_on_picture(),
            scale: (along.norm() / size[0] + up.norm() / size[1]) / (2.0 * self.center.z),
        }
    }
}

/// Of a projected side at a focal length, given squared.
fn length_squared((side, depth): (Vector2<f64>, f64), focal_squared: f64) -> f64 {
    side.norm_squared() + focal_squared * depth * depth
}

/// The corners of a rectangle's picture with their depths, relative to the mean depth, as last
/// coordinates.
fn homogeneous_corners(corners: &[Vector2<f64>; 4]) -> [Vector3<f64>; 4] {
    let areas = triangle_areas(corners);
    let mean = areas.iter().sum::<f64>() / 4.0;
    [0, 1, 2, 3].map(|i| corners[i].push(1.0) * (areas[i] / mean))
}

impl ProjectedRectangle {
    /// The two poses from which the rectangle looks like this from so far that perspective is lost
    /// in the noise.
    ///
    /// Its picture is then a parallelogram, and [`pose_at`](Self::pose_at) sees no tilt in it: a
    /// saddle of the cost. The foreshortening gives the tilt, up to its sign.
    pub(crate) fn distant_poses(&self, size: [f64; 2]) -> [ScaledPose; 2] {
        let along = self.along.0 / (size[0] * self.center.z);
        let up = -self.down.0 / (size[1] * self.center.z);
        let squared = frontal_squared(&along, &up);
        let leans = leanings(&along, &up, squared);
        let scale = squared.sqrt();
        [1.0, -1.0].map(|sign| {
            let x = (along / scale).push(sign * leans[0]);
            let y = (up / scale).push(sign * leans[1]);
            ScaledPose {
                rotation: rotation_along_x(&x, &y),
                center: self.center_on_picture(),
                scale,
            }
        })
    }

    /// Where the rectangle's centre is seen.
    fn center_on_picture(&self) -> Vector2<f64> {
        self.center.xy() / self.center.z
    }
}

/// The depth components of two unit axes at right angles to each other, up to a sign of both, from
/// their pictures and the squared length of an axis seen from the front.
fn leanings(along: &Vector2<f64>, up: &Vector2<f64>, squared: f64) -> [f64; 2] {
    let [lean, other] =
        [along, up].map(|axis| (1.0 - axis.norm_squared() / squared).max(0.0).sqrt());
    [lean, if along.dot(up) > 0.0 { -other } else { other }]
}

/// The squared length of a unit seen from the front, from the pictures of two units at right angles
/// to each other.
fn frontal_squared(along: &Vector2<f64>, up: &Vector2<f64>) -> f64 {
    let (n1, n2) = (along.norm_squared(), up.norm_squared());
    (n1 + n2 + libm::hypot(n1 - n2, 2.0 * along.dot(up))) / 2.0
}

/// The rotation whose x axis is along a vector, and whose y axis is nearest to another.
fn rotation_along_x(x: &Vector3<f64>, y: &Vector3<f64>) -> Matrix3<f64> {
    let x = x.normalize();
    let y = (y - x * x.dot(y)).normalize();
    Matrix3::from_columns(&[x, y, x.cross(&y)])
}

/// The rotation whose x and y axes are both equally near to two vectors.
fn rotation_between(x: &Vector3<f64>, y: &Vector3<f64>) -> Matrix3<f64> {
    let (x, y) = (x.normalize(), y.normalize());
    let (sum, difference) = ((x + y).normalize(), (x - y).normalize());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (x, y) = ((sum + difference) * half, (sum - difference) * half);
    Matrix3::from_columns(&[x, y, x.cross(&y)])
}

/// The corners of a centred rectangle of this size, in label order.
pub(crate) fn corner_points(size: [f64; 2]) -> [Point3<f64>; 4] {
    let [x, y] = size.map(|s| s / 2.0);
    [[-x, y], [x, y], [x, -y], [-x, -y]].map(|[x, y]| Point3::new(x, y, 0.0))
}

impl ScaledPose {
    /// The other pose from which a small or distant rectangle looks almost the same: mirrored at
    /// the line of sight.
    pub(crate) fn mirrored(&self, focal: f64) -> Self {
        let sight = self.center.push(focal).normalize();
        let upright = shortest_rotation_to_z(&sight);
        let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
        let rotation = upright.transpose() * mirror * upright * self.rotation * mirror;
        Self { rotation, ..*self }
    }
}

/// The map from the unit square (u right, v down) to four corners from its (0, 0), clockwise;
/// exact.
pub(crate) fn square_from_corners(corners: &[Point2<f64>; 4]) -> Homography {
    let areas = triangle_areas(&corners.map(|c| c.coords));
    let [c0, c1, _, c3] = [0, 1, 2, 3].map(|i| corners[i].to_homogeneous() * areas[i]);
    Homography(Matrix3::from_columns(&[c1 - c0, c3 - c0, c0]))
}

/// Rodrigues' formula for the shortest turn of a unit vector in front of the camera (`z > 0`) to
/// +z.
fn shortest_rotation_to_z(v: &Vector3<f64>) -> Matrix3<f64> {
    let cross = v.cross(&Vector3::z()).cross_matrix();
    Matrix3::identity() + cross + cross * cross / (1.0 + v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::UnitQuaternion;

    impl ScaledPose {
        /// Position of the rectangle's centre in the camera's frame.
        fn translation(&self, focal: f64) -> Vector3<f64> {
            self.center.push(focal) / self.scale
        }
    }

    const SIZE: [f64; 2] = [1.2, 1.0 / 1.2];
    const FOCAL: f64 = 1.4;

    fn seen(tilt: f64) -> (ScaledPose, ProjectedRectangle) {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt)
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.4);
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let rotation = turn.to_rotation_matrix().into_inner() * flip;
        let pose = ScaledPose {
            rotation,
            center: Vector2::new(0.1, -0.2),
            scale: 0.5,
        };
        (pose, ProjectedRectangle::new(&project(&pose)))
    }

    fn project(pose: &ScaledPose) -> [Vector2<f64>; 4] {
        corner_points(SIZE).map(|corner| {
            let c = pose.rotation * corner.coords + pose.translation(FOCAL);
            c.xy() * FOCAL / c.z
        })
    }

    #[test]
    fn focal_length_and_pose_come_back() {
        for tilt in [0.05, 0.3, 0.9] {
            let (truth, view) = seen(tilt);
            let focal = view.focal_squared(SIZE[0] / SIZE[1]).sqrt();
            assert!((focal - FOCAL).abs() < 1e-10, "{tilt}: {focal}");
            let found = view.pose_at(focal, SIZE);
            assert!((found.rotation - truth.rotation).norm() < 1e-10);
            assert!((found.translation(focal) - truth.translation(FOCAL)).norm() < 1e-9);
        }
    }

    #[test]
    fn the_ratio_comes_back_from_the_right_angle() {
        let (_, view) = seen(0.3);
        let focal = view.focal_squared_any_ratio().sqrt();
        assert!(
            (focal - FOCAL).abs() < 1e-10 && (view.ratio(focal) - SIZE[0] / SIZE[1]).abs() < 1e-10
        );
    }

    #[test]
    fn from_straight_above_there_is_no_focal_length_but_a_pose() {
        let [x, y] = SIZE.map(|s| s / 4.0);
        let view =
            ProjectedRectangle::new(&[[-x, -y], [x, -y], [x, y], [-x, y]].map(Vector2::from));
        assert!(!view.focal_squared(SIZE[0] / SIZE[1]).is_finite());
        let pose = view.pose_at(2.0, SIZE);
        assert!((pose.translation(2.0) - Vector3::new(0.0, 0.0, 4.0)).norm() < 1e-12);
        assert!(
            (pose.rotation - Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))).norm() < 1e-12
        );
    }

    #[test]
    fn mirroring_twice_is_the_same_pose() {
        let (truth, _) = seen(0.3);
        let other = truth.mirrored(FOCAL);
        assert!((other.rotation.determinant() - 1.0).abs() < 1e-12);
        assert!((other.rotation - truth.rotation).norm() > 0.1);
        assert!((other.mirrored(FOCAL).rotation - truth.rotation).norm() < 1e-12);
    }

    #[test]
    fn the_mirrored_pose_looks_alike_from_far_away() {
        let (mut truth, _) = seen(0.3);
        truth.scale = 1e-3;
        let difference = |a: &ScaledPose, b: &ScaledPose| {
            project(a)
                .iter()
                .zip(&project(b))
                .map(|(p, q)| (p - q).norm())
                .fold(0.0, f64::max)
        };
        assert!(difference(&truth, &truth.mirrored(FOCAL)) < 1e-3 * truth.scale);
    }
}
