//! A convex prism, bounded by upright sides and two faces, as a shape of the engine; its edges may be
//! rounded.

use crate::geom::sides;
use rapier3d::parry::bounding_volume::{Aabb, BoundingSphere, BoundingVolume};
use rapier3d::parry::mass_properties::MassProperties;
use rapier3d::parry::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use rapier3d::parry::shape::{
    ConvexPolyhedron, FeatureId, PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Shape,
    ShapeType, SupportMap, TypedShape,
};
use rapier3d::prelude::{Real, Vector};

/// Maximum number of corners of a face that the engine uses.
const FACE_CORNERS: usize = 4;

/// A convex prism around the `z` axis.
///
/// # Method
/// The engine makes contacts with at most four corners of a face, so a plate with more corners
/// would rest on a part of itself. Where its upper or lower face is touched, the engine gets the
/// largest part with four corners around that point.
#[derive(Clone)]
pub(super) struct Prism {
    /// Corners of the upper face, counter-clockwise.
    ring: Vec<Vector>,
    /// Unit normal of the side from each corner to the next.
    outward: Vec<Vector>,
    /// For each side the largest part of a face next to it: up to four corners, as indices.
    parts: Vec<Vec<usize>>,
    /// Index of the side whose part is largest.
    largest: usize,
    hull: ConvexPolyhedron,
    /// How far the body reaches beyond this core, which rounds its edges.
    edge_radius: Real,
}

/// A face of a prism.
#[derive(Clone, Copy)]
enum Face {
    Upper,
    Lower,
    Side(usize),
}

impl Prism {
    /// The prism over a convex ring, counter-clockwise, and all that is within a radius of it; none if
    /// the engine considers the shape too thin.
    pub(super) fn new(ring: &[[f64; 2]], half_height: f64, edge_radius: f64) -> Option<Self> {
        let ring = ring_at(ring, half_height);
        let lower = ring.iter().map(|corner| mirrored(*corner));
        let hull = ConvexPolyhedron::from_convex_hull(
            &ring.iter().copied().chain(lower).collect::<Vec<_>>(),
        )?;
        let parts: Vec<_> = (0..ring.len())
            .map(|side| largest_at(&ring, side))
            .collect();
        let area = |side: &usize| doubled_area_of(&ring, &parts[*side]);
        let largest = (0..ring.len()).max_by(|a, b| area(a).total_cmp(&area(b)))?;
        Some(Self {
            outward: (0..ring.len()).map(|side| outward(&ring, side)).collect(),
            ring,
            parts,
            largest,
            hull,
            edge_radius: edge_radius as f32,
        })
    }

    fn next(&self, corner: usize) -> usize {
        (corner + 1) % self.ring.len()
    }

    /// The face whose normal is closest to a direction.
    fn support_face(&self, dir: Vector) -> Face {
        let side = self.side_towards(|k| self.outward[k].dot(dir));
        match (self.outward[side].dot(dir) > dir.z.abs(), dir.z > 0.0) {
            (true, _) => Face::Side(side),
            (false, true) => Face::Upper,
            (false, false) => Face::Lower,
        }
    }

    /// The side with the greatest value.
    fn side_towards(&self, value: impl Fn(usize) -> Real) -> usize {
        let mut best = (0, value(0));
        for k in 1..self.ring.len() {
            let next = (k, value(k));
            if next.1 > best.1 {
                best = next;
            }
        }
        best.0
    }

    /// The corners that represent the upper or lower face around a point.
    fn part_around(&self, point: Vector) -> &[usize] {
        let beyond = |k: usize| self.outward[k].dot(point - self.ring[k]);
        let largest = &self.parts[self.largest];
        if is_inside(&self.ring, largest, point) {
            largest
        } else {
            &self.parts[self.side_towards(beyond)]
        }
    }

    fn write_face(&self, face: Face, point: Vector, out: &mut PolygonalFeature) {
        let n = self.ring.len();
        match face {
            Face::Upper => self.write_part(point, 0, out),
            Face::Lower => self.write_part(point, n, out),
            Face::Side(k) => self.write_side(k, out),
        }
    }

    /// Writes a part of the upper face, whose vertices are numbered from 0, or of the lower one,
    /// whose vertices are numbered from `first`.
    fn write_part(&self, point: Vector, first: usize, out: &mut PolygonalFeature) {
        let part = self.part_around(point);
        out.num_vertices = part.len();
        for (k, &corner) in part.iter().enumerate() {
            self.write_vertex(k, first + corner, out);
            out.eids[k] = PackedFeatureId::edge((first + corner) as u32);
        }
        out.fid = PackedFeatureId::face(first as u32);
    }

    fn write_side(&self, side: usize, out: &mut PolygonalFeature) {
        let (n, next) = (self.ring.len(), self.next(side));
        out.num_vertices = FACE_CORNERS;
        for (k, vertex) in [side, next, n + next, n + side].into_iter().enumerate() {
            self.write_vertex(k, vertex, out);
        }
        let edges = [side, 2 * n + next, n + side, 2 * n + side];
        out.eids = edges.map(|edge| PackedFeatureId::edge(edge as u32));
        out.fid = PackedFeatureId::face((2 * n + side) as u32);
    }

    fn write_vertex(&self, k: usize, vertex: usize, out: &mut PolygonalFeature) {
        let n = self.ring.len();
        out.vertices[k] = if vertex < n {
            self.ring[vertex]
        } else {
            mirrored(self.ring[vertex - n])
        };
        out.vids[k] = PackedFeatureId::vertex(vertex as u32);
    }
}

fn ring_at(ring: &[[f64; 2]], z: f64) -> Vec<Vector> {
    ring.iter()
        .map(|&[x, y]| Vector::new(x as f32, y as f32, z as f32))
        .collect()
}

/// The corner at the other end of the prism.
fn mirrored(corner: Vector) -> Vector {
    Vector::new(corner.x, corner.y, -corner.z)
}

fn outward(ring: &[Vector], side: usize) -> Vector {
    let along = ring[(side + 1) % ring.len()] - ring[side];
    Vector::new(along.y, -along.x, 0.0).normalize_or_zero()
}

/// The largest ring of up to four corners of a convex ring that contains one of its sides.
///
/// As the third corner moves on, so does the best fourth one; for each third corner, the area has a
/// single maximum over the fourth.
fn largest_at(ring: &[Vector], side: usize) -> Vec<usize> {
    let n = ring.len();
    let corners = |c: usize, d: usize| [0, 1, c, d].map(|k| (side + k) % n).to_vec();
    let area = |c: usize, d: usize| doubled_area_of(ring, &corners(c, d));
    if n < FACE_CORNERS {
        return (0..n).map(|k| (side + k) % n).collect();
    }
    let mut best = (2, 3);
    let mut d = 3;
    for c in 2..n - 1 {
        d = d.max(c + 1);
        while d + 1 < n && area(c, d + 1) > area(c, d) {
            d += 1;
        }
        if area(c, d) > area(best.0, best.1) {
            best = (c, d);
        }
    }
    with_widest_first(ring, corners(best.0, best.1))
}

/// The same corners, starting where the first three form the largest triangle: the engine computes
/// the normal of a face from these.
fn with_widest_first(ring: &[Vector], mut corners: Vec<usize>) -> Vec<usize> {
    let area = |first: usize| {
        let triangle = [0, 1, 2].map(|k| corners[(first + k) % FACE_CORNERS]);
        doubled_area_of(ring, &triangle)
    };
    let widest = (0..FACE_CORNERS).max_by(|a, b| area(*a).total_cmp(&area(*b)));
    corners.rotate_left(widest.unwrap_or(0));
    corners
}

fn doubled_area_of(ring: &[Vector], corners: &[usize]) -> Real {
    let first = ring[corners[0]];
    let pairs = corners[1..].windows(2);
    pairs
        .map(|pair| (ring[pair[0]] - first).cross(ring[pair[1]] - first).z)
        .sum()
}

/// Whether a point is in a part of a convex ring, seen along `z`.
fn is_inside(ring: &[Vector], corners: &[usize], point: Vector) -> bool {
    sides(corners).all(|[from, to]| {
        let side = ring[to] - ring[from];
        side.cross(point - ring[from]).z >= 0.0
    })
}

impl SupportMap for Prism {
    fn local_support_point(&self, dir: Vector) -> Vector {
        let corner = self.ring[self.side_towards(|k| {
            let corner = self.ring[k];
            corner.x * dir.x + corner.y * dir.y
        })];
        if dir.z < 0.0 {
            mirrored(corner)
        } else {
            corner
        }
    }
}

impl PolygonalFeatureMap for Prism {
    fn local_support_feature(&self, dir: Vector, out: &mut PolygonalFeature) {
        self.local_support_feature_toward(dir, self.local_support_point(dir), out);
    }

    fn local_support_feature_toward(&self, dir: Vector, hint: Vector, out: &mut PolygonalFeature) {
        self.write_face(self.support_face(dir), hint, out);
    }
}

impl RayCast for Prism {
    fn cast_local_ray_and_get_normal(
        &self,
        ray: &Ray,
        max_time_of_impact: Real,
        solid: bool,
    ) -> Option<RayIntersection> {
        self.hull
            .cast_local_ray_and_get_normal(ray, max_time_of_impact, solid)
    }
}

impl PointQuery for Prism {
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        self.hull.project_local_point(point, solid)
    }

    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        self.hull.project_local_point_and_get_feature(point)
    }
}

impl Shape for Prism {
    fn compute_local_aabb(&self) -> Aabb {
        self.hull.compute_local_aabb().loosened(self.edge_radius)
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        self.hull
            .compute_local_bounding_sphere()
            .loosened(self.edge_radius)
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }

    /// None: the world's shapes are created at their final size.
    fn scale_dyn(&self, _: Vector, _: u32) -> Option<Box<dyn Shape>> {
        None
    }

    fn mass_properties(&self, density: Real) -> MassProperties {
        self.hull.mass_properties(density)
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    fn ccd_thickness(&self) -> Real {
        self.hull.ccd_thickness() + self.edge_radius
    }

    fn ccd_angular_thickness(&self) -> Real {
        self.hull.ccd_angular_thickness()
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn as_support_map(&self) -> Option<&dyn SupportMap> {
        Some(self)
    }

    fn as_polygonal_feature_map(&self) -> Option<(&dyn PolygonalFeatureMap, Real)> {
        Some((self, self.edge_radius))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners on a circle, at growing steps.
    fn circle(n: usize) -> Vec<[f64; 2]> {
        let angle = |i: usize| std::f64::consts::TAU * (i as f64 / n as f64).powf(1.3);
        (0..n)
            .map(|i| [0.1 * libm::cos(angle(i)), 0.1 * libm::sin(angle(i))])
            .collect()
    }

    fn prism(n: usize) -> Prism {
        Prism::new(&circle(n), 0.005, 0.0).expect("a prism")
    }

    /// The largest area of four corners with this side, by brute force.
    fn largest_by_trying(ring: &[Vector], side: usize) -> Real {
        let n = ring.len();
        let thirds = (2..n).flat_map(|c| (c + 1..n).map(move |d| (c, d)));
        let areas =
            thirds.map(|(c, d)| doubled_area_of(ring, &[0, 1, c, d].map(|k| (side + k) % n)));
        areas.fold(0.0, Real::max)
    }

    #[test]
    fn parts_are_the_largest_at_their_sides() {
        for n in 4..20 {
            let prism = prism(n);
            for (side, part) in prism.parts.iter().enumerate() {
                let area = doubled_area_of(&prism.ring, part);
                let largest = largest_by_trying(&prism.ring, side);
                assert!(
                    (area - largest).abs() < 1e-6 * largest,
                    "{n}, {side}: {part:?}"
                );
            }
        }
        assert_eq!(prism(3).parts[1], [1, 2, 0]);
    }

    #[test]
    fn its_support_is_that_of_its_hull() {
        let prism = prism(7);
        for k in 0..200 {
            let angle = 0.37 * k as f32;
            let dir = Vector::new(angle.cos(), angle.sin(), (0.7 * angle).sin());
            let [own, hull] = [
                prism.local_support_point(dir),
                prism.hull.local_support_point(dir),
            ];
            assert!((own.dot(dir) - hull.dot(dir)).abs() < 1e-7, "{dir}");
        }
    }

    #[test]
    fn a_face_is_there_where_it_is_touched() {
        let prism = prism(9);
        let mut face = PolygonalFeature::default();
        for (corner, at) in prism.ring.iter().enumerate() {
            for dir in [Vector::Z, -Vector::Z] {
                prism.local_support_feature_toward(dir, *at, &mut face);
                let touched = face.vertices.iter().any(|v| (v.x, v.y) == (at.x, at.y));
                assert!(
                    touched && face.vertices[0].z * dir.z > 0.0,
                    "{corner} {dir}"
                );
            }
        }
    }

    #[test]
    fn a_tilted_prism_shows_the_corner_that_is_lowest() {
        let prism = prism(9);
        let mut face = PolygonalFeature::default();
        for k in 0..50 {
            let angle = 0.37 * k as f32;
            let dir = Vector::new(0.3 * angle.cos(), 0.3 * angle.sin(), -1.0).normalize();
            prism.local_support_feature(dir, &mut face);
            let lowest = prism.local_support_point(dir);
            assert!(face.vertices.contains(&lowest), "{dir}");
        }
    }

    #[test]
    fn sides_are_faces_of_four_corners() {
        let prism = prism(5);
        let mut face = PolygonalFeature::default();
        for outward in &prism.outward {
            prism.local_support_feature(*outward, &mut face);
            assert_eq!(face.num_vertices, FACE_CORNERS);
            let far = prism.local_support_point(*outward).dot(*outward);
            assert!(
                face.vertices
                    .iter()
                    .all(|v| (v.dot(*outward) - far).abs() < 1e-6)
            );
        }
    }
}
