//! What an area light does where nothing is in its way.

use crate::geom::{Point3, Vector3};
use crate::light::area::{LightFrame, frame, radiance, side_lengths};
use crate::light::nodes::nodes;
use crate::light::polygon::polygon_irradiance;
use crate::pixel::LinearRgb;
use crate::scene::{AreaLight, LightShape, Scene};
use std::f64::consts::{PI, TAU};

/// Samples along each side of an ellipse where its irradiance is computed without shadows.
const ELLIPSE_SAMPLES: usize = 16;
/// Corners of the polygon that replaces an ellipse at short distance.
const ELLIPSE_CORNERS: usize = 256;

/// Irradiance at `point` on a surface of unit `normal`, where nothing is in the way.
///
/// # Method
/// Closed form for rectangles ([`polygon_irradiance`]), and for ellipses nearer than they are wide,
/// as polygons of 256 corners and of their area; a product rule of 16 x 32 points for ellipses
/// farther away.
pub fn irradiance(light: &AreaLight, point: Point3<f64>, normal: Vector3<f64>) -> LinearRgb {
    let frame = frame(light);
    if frame.normal.dot(&(point - frame.center)) <= 0.0 {
        return LinearRgb::BLACK;
    }
    let [a, b] = side_lengths(light);
    let is_near = (point - frame.center).norm() < a.max(b);
    let factor = match light.shape {
        LightShape::Rectangle => polygon_irradiance(&frame.corners([a, b]), point, normal),
        LightShape::Ellipse if is_near => {
            polygon_irradiance(&ellipse_rim(&frame, [a, b]), point, normal)
        }
        LightShape::Ellipse => sampled_irradiance(light, &frame, point, normal),
    };
    radiance(light).scale(factor as f32)
}

/// Luminance of a white card on a point of the surface, with nothing in the way of the light.
pub(super) fn white_card_at(scene: &Scene, point: Point3<f64>) -> f32 {
    let lit: f32 = scene
        .lights
        .iter()
        .map(|light| irradiance(light, point, Vector3::z()).luminance())
        .sum();
    lit / PI as f32 + scene.ambient.luminance()
}

/// That of unit radiance, by a product rule.
fn sampled_irradiance(
    light: &AreaLight,
    frame: &LightFrame,
    point: Point3<f64>,
    normal: Vector3<f64>,
) -> f64 {
    nodes(light, ELLIPSE_SAMPLES)
        .iter()
        .map(|node| node.irradiance(frame, point, normal))
        .sum()
}

/// Corners of a polygon along the ellipse of these diameters, in turn, of the same area.
fn ellipse_rim(frame: &LightFrame, size: [f64; 2]) -> Vec<Point3<f64>> {
    let step = TAU / ELLIPSE_CORNERS as f64;
    let grown = (step / libm::sin(step)).sqrt();
    let [a, b] = size.map(|s| 0.5 * s * grown);
    (0..ELLIPSE_CORNERS)
        .map(|i| {
            let (sin, cos) = libm::sincos(step * i as f64);
            frame.point(a * cos, b * sin)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::area::tests::square;
    use std::f64::consts::PI;

    #[test]
    fn nothing_is_lit_behind_a_light() {
        let e = irradiance(&square(), Point3::new(0.6, 0.4, 1.9), -Vector3::z());
        assert_eq!(e, LinearRgb::BLACK);
    }

    #[test]
    fn an_ellipse_is_the_same_to_a_receiver_just_nearer_and_just_farther_than_it_is_wide() {
        let light = AreaLight {
            shape: LightShape::Ellipse,
            position: [0.0, 0.0, 1.0],
            size: [1.0, 0.6],
            ..square()
        };
        let [near, far] =
            [1e-9, -1e-9].map(|z| irradiance(&light, Point3::new(0.0, 0.0, z), Vector3::z()).g);
        assert!((near / far - 1.0).abs() < 1e-5, "{near} {far}");
    }

    #[test]
    fn a_disk_far_away_is_its_power_over_distance_squared() {
        let light = AreaLight {
            shape: LightShape::Ellipse,
            position: [0.0, 0.0, 10.0],
            size: [0.1; 2],
            ..square()
        };
        let e = irradiance(&light, Point3::origin(), Vector3::z());
        assert!((e.g - 10.0 / PI as f32 / 100.0).abs() < 1e-5);
    }
}
