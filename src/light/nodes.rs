//! Where an area light is sampled: few points, placed so that smooth integrals come out right.

use crate::geom::{Point3, Vector3};
use crate::light::area::{LightFrame, area, frame, sides};
use crate::scene::{AreaLight, LightShape};
use std::f64::consts::{PI, TAU};

/// A point of a light's face and the area it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Where.
    pub point: Point3<f64>,
    /// Square metres; a light's nodes add up to its area.
    pub area: f64,
}

impl Node {
    /// Irradiance at `point` by unit radiance from this node: `cos cos / r^2 dA`; 0 below either horizon.
    pub fn irradiance(&self, frame: &LightFrame, point: Point3<f64>, normal: Vector3<f64>) -> f64 {
        let to = self.point - point;
        let r2 = to.norm_squared();
        let cosines = normal.dot(&to).max(0.0) * (-frame.normal.dot(&to)).max(0.0);
        if r2 > 0.0 { cosines / (r2 * r2) * self.area } else { 0.0 }
    }
}

/// Sample points of a light, `per_side` (at least 1) along each side.
///
/// # Method
/// Rectangle: product of two Gauss-Legendre rules. Ellipse: Gauss-Legendre in the squared radius, twice as many equal
/// steps in angle, every ring turned by half a step against the one before.
pub fn nodes(light: &AreaLight, per_side: usize) -> Vec<Node> {
    let rule = gauss_legendre(per_side.max(1));
    match light.shape {
        LightShape::Rectangle => rectangle_nodes(light, &rule),
        LightShape::Ellipse => ellipse_nodes(light, &rule),
    }
}

fn rectangle_nodes(light: &AreaLight, rule: &[(f64, f64)]) -> Vec<Node> {
    let (frame, area) = (frame(light), area(light));
    let [half_x, half_y] = sides(light).map(|s| 0.5 * s);
    let row = |&(y, wy): &(f64, f64)| {
        rule.iter().map(move |&(x, wx)| Node { point: frame.point(x * half_x, y * half_y), area: area * wx * wy / 4.0 })
    };
    rule.iter().flat_map(row).collect()
}

fn ellipse_nodes(light: &AreaLight, rule: &[(f64, f64)]) -> Vec<Node> {
    let (frame, area) = (frame(light), area(light));
    let [half_x, half_y] = sides(light).map(|s| 0.5 * s);
    let steps = 2 * rule.len();
    let ring = |(k, &(x, w)): (usize, &(f64, f64))| {
        let radius = (0.5 + 0.5 * x).sqrt();
        (0..steps).map(move |i| {
            let (sin, cos) = libm::sincos(TAU * (i as f64 + 0.5 * (k % 2) as f64) / steps as f64);
            let point = frame.point(radius * half_x * cos, radius * half_y * sin);
            Node { point, area: area * 0.5 * w / steps as f64 }
        })
    };
    rule.iter().enumerate().flat_map(ring).collect()
}

/// Abscissae in -1..1 and weights (sum 2) of the Gauss-Legendre rule of `n` points.
///
/// # Method
/// Newton's iteration on the Legendre polynomial from Tricomi's estimate of its roots.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n).map(|i| gauss_point(n, libm::cos(PI * (n as f64 - i as f64 - 0.25) / (n as f64 + 0.5)))).collect()
}

fn gauss_point(n: usize, estimate: f64) -> (f64, f64) {
    // Quadratic convergence: 8 steps are plenty from an estimate good to three digits.
    let root = (0..8).fold(estimate, |x, _| {
        let (p, slope) = legendre(n, x);
        x - p / slope
    });
    let (_, slope) = legendre(n, root);
    (root, 2.0 / ((1.0 - root * root) * slope * slope))
}

/// Value and slope of the Legendre polynomial of degree `n`, by its recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut last, mut p) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (last, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * last) / k);
    }
    (p, n as f64 * (x * p - last) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::area::tests::{lit_points, square};
    use crate::light::radiance;

    #[test]
    fn three_points_are_the_textbook_rule() {
        let rule = gauss_legendre(3);
        let expected = [(-0.6f64.sqrt(), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0)];
        for ((x, w), (ex, ew)) in rule.into_iter().zip(expected) {
            assert!((x - ex).abs() < 1e-14 && (w - ew).abs() < 1e-14);
        }
    }

    #[test]
    fn n_points_integrate_degree_2n_minus_1() {
        for n in 1..9 {
            let sum: f64 = gauss_legendre(n).iter().map(|&(x, w)| w * x.powi(2 * n as i32 - 2)).sum();
            assert!((sum - 2.0 / (2 * n - 1) as f64).abs() < 1e-13, "{n} points");
        }
    }

    #[test]
    fn nine_nodes_match_the_closed_form() {
        for (at, normal, expected) in lit_points() {
            let f = frame(&square());
            let sum: f64 = nodes(&square(), 3).iter().map(|n| n.irradiance(&f, at.into(), normal)).sum();
            let e = sum * f64::from(radiance(&square()).r);
            assert!((e / expected - 1.0).abs() < 1e-4, "{at:?}: {e} against {expected}");
        }
    }

    #[test]
    fn nodes_add_up_to_the_area() {
        let disk = AreaLight { shape: LightShape::Ellipse, size: [0.4, 0.2], ..square() };
        for (light, expected) in [(square(), 0.16), (disk, PI * 0.02)] {
            let sum: f64 = nodes(&light, 4).iter().map(|n| n.area).sum();
            assert!((sum - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn asking_for_no_nodes_gives_the_centre() {
        let light = square();
        assert_eq!(nodes(&light, 0).len(), 1);
        assert!((nodes(&light, 0)[0].point - Point3::from(light.position)).norm() < 1e-12);
    }
}
