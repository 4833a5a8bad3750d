//! Cards and the surface as seen by the camera: every map is a row of three numbers times
//! `(x, y, 1)`.

use crate::camera::Camera;
use crate::geom::Vector3;
use crate::render::half_plane::quad_sides;
use crate::render::ranges::{integer_range, ranges_meet};
use crate::scene::{Card, Shot};
use nalgebra::Matrix3;
use std::ops::Range;

/// Areas (square metres), distances (metres) and sines below this count as zero.
const GEOMETRY_EPSILON: f64 = 1e-12;

/// Depth beyond which a plane is its horizon, metres: keeps points finite where a plane is seen
/// beyond its own edge.
pub(super) const HORIZON_M: f64 = 1e6;

/// A card or the surface as a plane in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScenePlane {
    /// Centre.
    pub(super) center: Vector3<f64>,
    /// Unit vector along texture columns.
    pub(super) x: Vector3<f64>,
    /// Unit vector against texture rows.
    pub(super) y: Vector3<f64>,
    /// Unit normal.
    pub(super) normal: Vector3<f64>,
    /// Width and height, metres; may be infinite for the surface.
    pub(super) size: [f64; 2],
}

impl ScenePlane {
    /// A card's plane; none for a card without area or finite position.
    pub(super) fn from_card(card: &Card) -> Option<Self> {
        let pose = &card.quad.world_from_card;
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let [x, y, normal] = axes.map(|axis| pose.rotation * axis);
        let plane = Self {
            center: pose.translation.vector,
            x,
            y,
            normal,
            size: card.quad.size,
        };
        (plane.has_area() && plane.is_finite()).then_some(plane)
    }

    fn has_area(&self) -> bool {
        let [w, h] = self.size;
        w > 0.0 && h > 0.0 && w * h > GEOMETRY_EPSILON && (w * h).is_finite()
    }

    fn is_finite(&self) -> bool {
        [&self.x, &self.y, &self.normal, &self.center]
            .into_iter()
            .flatten()
            .all(|c| c.is_finite())
    }

    /// The normal on the side of a point, and the point's distance from the plane.
    fn side_of(&self, point: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let above = self.height_of(point);
        if above >= 0.0 {
            (self.normal, above)
        } else {
            (-self.normal, -above)
        }
    }

    /// Whether a point sees its back.
    #[inline]
    pub(super) fn is_seen_from_behind(&self, point: &Vector3<f64>) -> bool {
        self.height_of(point) < 0.0
    }

    /// Signed distance of a point in front of the plane.
    #[inline]
    fn height_of(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(&(point - self.center))
    }

    /// The plane `z = 0`, as far as it receives shadows.
    pub(super) fn shadow_catcher(size: [f64; 2]) -> Self {
        Self {
            center: Vector3::zeros(),
            x: Vector3::x(),
            y: Vector3::y(),
            normal: Vector3::z(),
            size,
        }
    }

    /// The same plane, extended on each side by shares of its size.
    pub(super) fn grown_by(&self, reach: [f64; 2]) -> Self {
        Self {
            size: [0, 1].map(|k| self.size[k] * (1.0 + 2.0 * reach[k])),
            ..*self
        }
    }

    /// Texture coordinates, right and down, of a point of the plane.
    pub(super) fn texture_coordinates(&self, point: &Vector3<f64>) -> [f64; 2] {
        let local = point - self.center;
        [
            local.dot(&self.x) / self.size[0] + 0.5,
            0.5 - local.dot(&self.y) / self.size[1],
        ]
    }

    /// Half of the longer side, metres.
    pub(super) fn half_length(&self) -> f64 {
        0.5 * self.size[0].max(self.size[1])
    }

    /// The four corners, in turn.
    pub(super) fn corners(&self) -> [Vector3<f64>; 4] {
        let (a, b) = (self.x * (0.5 * self.size[0]), self.y * (0.5 * self.size[1]));
        [
            self.center - a + b,
            self.center + a + b,
            self.center + a - b,
            self.center - a - b,
        ]
    }
}

/// The camera as linear maps.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraView {
    /// Centre of projection.
    pub(super) eye: Vector3<f64>,
    /// Ray direction from `(x, y, 1)`; its parameter is the depth.
    pub(super) ray: Matrix3<f64>,
    /// Columns.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
}

impl CameraView {
    pub(super) fn from_camera(camera: &Camera) -> Self {
        let rotation = camera
            .camera_from_world
            .rotation
            .inverse()
            .to_rotation_matrix();
        Self {
            eye: camera.center().coords,
            ray: rotation.matrix() * ray_from_pixel(camera),
            width: camera.image[0] as usize,
            height: camera.image[1] as usize,
        }
    }

    /// The world point at a depth on the ray through a picture position.
    pub(super) fn point_at(&self, x: f64, y: f64, depth: f64) -> Vector3<f64> {
        self.eye + self.ray * Vector3::new(x, y, 1.0) * depth
    }

    /// Picture positions `(x, y, 1)` of world points; none if one of them is at or behind the eye.
    pub(super) fn project_points<const N: usize>(
        &self,
        world: &[Vector3<f64>; N],
    ) -> Option<[Vector3<f64>; N]> {
        let picture_from_world = self.ray.try_inverse()?;
        let seen = world.map(|point| picture_from_world * (point - self.eye));
        let in_front = seen.iter().all(is_in_front);
        in_front.then(|| seen.map(|p| p / p.z))
    }

    /// Whether at least one of these world points is in front of the eye.
    pub(super) fn has_in_front(&self, world: &[Vector3<f64>]) -> bool {
        let mut points = world.iter();
        points.any(|point| self.project_points(&[*point]).is_some())
    }

    /// Picture position `(x, y, 1)` of a world point; the picture's middle if it is at or behind
    /// the eye.
    fn position_of(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let middle = Vector3::new(0.5 * self.width as f64, 0.5 * self.height as f64, 1.0);
        self.project_points(&[*point]).map_or(middle, |[p]| p)
    }

    /// All rows and columns.
    pub(super) fn whole_area(&self) -> LatticeArea {
        (0..self.height, 0..self.width)
    }

    /// Rows and columns of projected points, with one more on each side; all if one of the points
    /// is not in front.
    pub(super) fn area_around(&self, points: &[Vector3<f64>; 4]) -> LatticeArea {
        let Some(px) = self.project_points(points) else {
            return self.whole_area();
        };
        let columns = range_around(px.map(|p| p.x), self.width);
        (range_around(px.map(|p| p.y), self.height), columns)
    }
}

fn is_in_front(p: &Vector3<f64>) -> bool {
    p.z > GEOMETRY_EPSILON && p.iter().all(|c| c.is_finite())
}

/// The integers below `count` between some numbers, with one more on each side.
fn range_around(numbers: [f64; 4], count: usize) -> Range<usize> {
    let low = numbers.into_iter().fold(f64::INFINITY, f64::min);
    let high = numbers.into_iter().fold(f64::NEG_INFINITY, f64::max);
    integer_range(low - 2.0, high + 2.0, &(0..count))
}

/// Centre of a pixel, as `(x, y, 1)`.
#[inline]
pub(super) fn pixel_center(x: usize, y: usize) -> Vector3<f64> {
    Vector3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0)
}

/// Rows and columns of the lattice, or pixels of a picture.
pub(super) type LatticeArea = (Range<usize>, Range<usize>);

/// Whether areas have something in common.
pub(super) fn areas_meet(a: &LatticeArea, b: &LatticeArea) -> bool {
    ranges_meet(&a.0, &b.0) && ranges_meet(&a.1, &b.1)
}

/// Rows and columns in which a plane, extended by shares of its size, is seen; one more on each
/// side.
pub(super) fn rows_and_columns(
    plane: &ScenePlane,
    reach: [f64; 2],
    view: &CameraView,
) -> LatticeArea {
    view.area_around(&plane.grown_by(reach).corners())
}

/// The camera's own ray direction from `(x, y, 1)`, its depth 1.
fn ray_from_pixel(camera: &Camera) -> Matrix3<f64> {
    let (f, c) = (camera.focal_px, camera.principal_px);
    Matrix3::new(
        1.0 / f.x,
        0.0,
        -c.x / f.x,
        0.0,
        1.0 / f.y,
        -c.y / f.y,
        0.0,
        0.0,
        1.0,
    )
}

/// A plane in the picture: with `p = (x, y, 1)`, texture coordinates are `u.p / w.p` and
/// `v.p / w.p`.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProjectedPlane {
    /// Numerator of the texture coordinate to the right, 0 to 1.
    pub(super) u: Vector3<f64>,
    /// Numerator of the texture coordinate downwards, 0 to 1.
    pub(super) v: Vector3<f64>,
    /// Denominator; positive where the plane is in front of the eye.
    pub(super) w: Vector3<f64>,
    /// Depth times `w.p`: the distance of the eye from the infinite plane.
    pub(super) height: f64,
    /// The world point is `point * p / w.p`.
    pub(super) point: Matrix3<f64>,
    /// Unit normal on the side of the eye.
    pub(super) normal: Vector3<f64>,
}

impl ProjectedPlane {
    /// None for a plane seen edge-on.
    pub(super) fn new(plane: &ScenePlane, view: &CameraView) -> Option<Self> {
        let (normal, height) = plane.side_of(&view.eye);
        let w = -(view.ray.transpose() * normal);
        let point = view.eye * w.transpose() + view.ray * height;
        let [u, v] = texture_rows(plane, &point, &w);
        (height > GEOMETRY_EPSILON).then_some(Self {
            u,
            v,
            w,
            height,
            point,
            normal,
        })
    }

    /// None also for a plane that is not seen from above.
    pub(super) fn from_above(plane: &ScenePlane, view: &CameraView) -> Option<Self> {
        Self::new(plane, view).filter(|plane| plane.normal.z > 0.0)
    }

    /// Side of the square that a pixel (or lattice cell) covers on the infinite plane, metres,
    /// where it shows `target`; in the middle of the picture if that is behind the eye.
    pub(super) fn cell_metres(&self, view: &CameraView, target: &Vector3<f64>) -> f64 {
        let p = view.position_of(target);
        let w = self.w.dot(&p).max(self.height / HORIZON_M);
        let point = self.point * p / w;
        let [along_x, along_y] =
            [0, 1].map(|k: usize| (self.point.column(k) - point * self.w[k]) / w);
        along_x.cross(&along_y).norm().sqrt()
    }

    /// Linear conditions on `(x, y, 1)` inside the texture with a border of `reach`, and in front
    /// of the eye.
    pub(super) fn sides(&self, reach: [f64; 2]) -> [Vector3<f64>; 5] {
        quad_sides(&self.u, &self.v, &self.w, reach)
    }

    /// The same plane in a picture that an affine map takes to this one.
    pub(super) fn seen_through(&self, map: &Matrix3<f64>) -> Self {
        let transposed = map.transpose();
        Self {
            u: transposed * self.u,
            v: transposed * self.v,
            w: transposed * self.w,
            point: self.point * map,
            ..*self
        }
    }

    /// The same plane, with a mirrored texture if `mirrored`.
    pub(super) fn mirrored_if(self, mirrored: bool) -> Self {
        let u = if mirrored { self.w - self.u } else { self.u };
        Self { u, ..self }
    }

    /// The world point at a pixel position `(x, y, 1)`; none behind the eye.
    pub(super) fn point_at(&self, p: &Vector3<f64>) -> Option<Vector3<f64>> {
        let w = self.w.dot(p);
        (w > 0.0).then(|| self.point * p / w)
    }

    /// Depth at a pixel position `(x, y, 1)`; the maximum behind the eye.
    #[inline]
    pub(super) fn depth_at(&self, p: &Vector3<f64>) -> f64 {
        let w = self.w.dot(p);
        if w > 0.0 {
            self.height / w
        } else {
            f64::from(f32::MAX)
        }
    }

    /// Texture coordinates and depth at a pixel position; none outside the plane or behind the eye.
    pub(super) fn intersect_px(&self, x: f64, y: f64) -> Option<([f64; 2], f64)> {
        let p = Vector3::new(x, y, 1.0);
        let w = self.w.dot(&p);
        let uv = [self.u.dot(&p) / w, self.v.dot(&p) / w];
        (w > 0.0 && is_on_texture(uv)).then_some((uv, self.height / w))
    }
}

/// Whether texture coordinates are on the texture.
#[inline]
pub(super) fn is_on_texture(uv: [f64; 2]) -> bool {
    uv.iter().all(|c| (0.0..=1.0).contains(c))
}

/// Rows of the texture coordinates' numerators, for points `point * p / w.p` of the infinite plane.
pub(super) fn texture_rows(
    plane: &ScenePlane,
    point: &Matrix3<f64>,
    w: &Vector3<f64>,
) -> [Vector3<f64>; 2] {
    let [a, b] = plane.size;
    if a.is_finite() && b.is_finite() {
        let [x, y] =
            [plane.x, plane.y].map(|axis| point.transpose() * axis - w * axis.dot(&plane.center));
        [x / a + w * 0.5, w * 0.5 - y / b]
    } else {
        // An infinite plane has no edges: every point is its middle.
        [w * 0.5, w * 0.5]
    }
}

/// The cards of a shot that have an area, a finite position and texels, with their planes, in the
/// order of their ids.
pub(super) fn visible_planes(shot: &Shot) -> Vec<(&Card, ScenePlane)> {
    let mut planes: Vec<_> = shot.cards.iter().filter_map(visible_plane).collect();
    planes.sort_by_key(|plane| plane.0.id);
    planes
}

fn visible_plane(card: &Card) -> Option<(&Card, ScenePlane)> {
    if card.texture.is_empty() {
        return None;
    }
    Some((card, ScenePlane::from_card(card)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Point2, Pose, Quad, UnitQuaternion, Vector2};

    fn camera() -> Camera {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let tilt = UnitQuaternion::from_euler_angles(0.2, -0.1, 0.7);
        Camera {
            image: [640, 480],
            focal_px: Vector2::new(700.0, 710.0),
            principal_px: Point2::new(320.0, 236.0),
            camera_from_world: Pose::from_parts(Vector3::new(0.02, -0.03, 1.1).into(), tilt * down),
        }
    }

    #[test]
    fn the_rows_agree_with_ray_and_plane() {
        let camera = camera();
        for flip in [0.0, std::f64::consts::PI] {
            let rotation = UnitQuaternion::from_euler_angles(0.3 + flip, -0.2, 1.1);
            let quad = Quad {
                world_from_card: Pose::from_parts(Vector3::new(0.1, 0.0, 0.1).into(), rotation),
                size: [0.3, 0.2],
            };
            let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|a| rotation * a);
            let sheet = ScenePlane {
                center: Vector3::new(0.1, 0.0, 0.1),
                x: axes[0],
                y: axes[1],
                normal: axes[2],
                size: quad.size,
            };
            let seen = ProjectedPlane::new(&sheet, &CameraView::from_camera(&camera)).unwrap();
            let (px, depth) = camera.project(quad.point(0.3, 0.8)).unwrap();
            let ([u, v], t) = seen.intersect_px(px.x, px.y).unwrap();
            assert!(
                (u - 0.3).abs() < 1e-12 && (v - 0.8).abs() < 1e-12 && (t - depth).abs() < 1e-12
            );
            let p = seen.point * Vector3::new(px.x, px.y, 1.0)
                / seen.w.dot(&Vector3::new(px.x, px.y, 1.0));
            assert!((p - quad.point(0.3, 0.8).coords).norm() < 1e-12);
            assert!(seen.normal.dot(&(camera.center().coords - sheet.center)) > 0.0);
        }
    }
}
