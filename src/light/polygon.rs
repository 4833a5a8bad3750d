//! Irradiance from a uniform polygon in closed form.

use crate::geom::{Point3, Vector3, sides};

/// Irradiance at `point` with unit `normal` from a polygon of unit radiance: pi times the form
/// factor.
///
/// `corners` in either order, of a flat convex polygon; the part below the receiver's horizon is
/// cut off. Which side the polygon shines to is the caller's question.
///
/// # Method
/// Lambert's formula: half the sum over edges of the angle that the edge subtends, times the cosine
/// between the receiver's normal and the normal of the edge's fan triangle.
pub fn polygon_irradiance(
    corners: &[Point3<f64>],
    point: Point3<f64>,
    normal: Vector3<f64>,
) -> f64 {
    let rays = above_horizon(corners.iter().map(|c| c - point).collect(), normal);
    let edges = sides(&rays).map(|[a, b]| edge_irradiance(&a, &b, normal));
    0.5 * edges.sum::<f64>().abs()
}

fn edge_irradiance(a: &Vector3<f64>, b: &Vector3<f64>, normal: Vector3<f64>) -> f64 {
    let cross = a.cross(b);
    let length = cross.norm();
    // An edge seen end on subtends nothing.
    if length > 0.0 {
        libm::atan2(length, a.dot(b)) * normal.dot(&cross) / length
    } else {
        0.0
    }
}

/// Sutherland-Hodgman against the plane through the origin.
fn above_horizon(rays: Vec<Vector3<f64>>, normal: Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut kept = Vec::with_capacity(rays.len() + 1);
    for (i, a) in rays.iter().enumerate() {
        let b = &rays[(i + 1) % rays.len()];
        let heights = [normal.dot(a), normal.dot(b)];
        if heights[0] >= 0.0 {
            kept.push(*a);
        }
        kept.extend(crossing_share(heights).map(|share| a.lerp(b, share)));
    }
    kept
}

/// How far along an edge between these heights the height is 0; none where both ends are on one
/// side.
fn crossing_share([from, to]: [f64; 2]) -> Option<f64> {
    let crosses = (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0);
    crosses.then(|| from / (from - to))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(half: f64, z: f64) -> [Point3<f64>; 4] {
        [[-half, -half], [half, -half], [half, half], [-half, half]]
            .map(|[x, y]| Point3::new(x, y, z))
    }

    #[test]
    fn an_endless_ceiling_gives_pi() {
        let e = polygon_irradiance(&square(1e6, 1.0), Point3::origin(), Vector3::z());
        assert!((e - std::f64::consts::PI).abs() < 1e-5);
    }

    #[test]
    fn half_of_the_ceiling_lights_a_wall() {
        let e = polygon_irradiance(&square(1e6, 1.0), Point3::origin(), Vector3::x());
        assert!((e - std::f64::consts::FRAC_PI_2).abs() < 1e-5);
    }

    #[test]
    fn nothing_comes_from_below_the_horizon() {
        assert_eq!(
            polygon_irradiance(&square(1.0, -1.0), Point3::origin(), Vector3::z()),
            0.0
        );
        assert_eq!(polygon_irradiance(&[], Point3::origin(), Vector3::z()), 0.0);
    }
}
