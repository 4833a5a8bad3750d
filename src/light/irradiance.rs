//! What an area light does where nothing is in its way.

use crate::geom::{Point3, Vector3};
use crate::light::area::{LightFrame, face_area, frame, radiance, side_lengths};
use crate::light::nodes::geometry_term;
use crate::light::polygon::polygon_irradiance;
use crate::pixel::LinearRgb;
use crate::scene::{AreaLight, EnvironmentMap, LightShape, LightTint, Scene};
use std::f64::consts::{PI, TAU};

/// Corners of the polygon that replaces an ellipse.
const ELLIPSE_CORNERS: usize = 256;
/// A light whose sides are below this share of its distance is a point: a form factor so small
/// would be lost in the rounding of its polygon's edges.
const POINT_SHARE: f64 = 1e-4;

/// Irradiance at `point` on a surface of unit `normal`, where nothing is in the way.
///
/// # Method
/// Closed form ([`polygon_irradiance`]); ellipses are polygons of 256 corners and of their area.
pub fn irradiance(light: &AreaLight, point: Point3<f64>, normal: Vector3<f64>) -> LinearRgb {
    radiance(light).scale(unit_irradiance(light, point, normal) as f32)
}

/// The same by unit radiance.
pub(crate) fn unit_irradiance(light: &AreaLight, point: Point3<f64>, normal: Vector3<f64>) -> f64 {
    let frame = frame(light);
    let way = frame.center - point;
    if frame.normal.dot(&way) >= 0.0 {
        return 0.0;
    }
    let size = side_lengths(light);
    if size[0].max(size[1]) < POINT_SHARE * way.norm() {
        return geometry_term(&way, &frame.normal, &normal) * face_area(light);
    }
    let corners = match light.shape {
        LightShape::Rectangle => frame.corners(size).to_vec(),
        LightShape::Ellipse => ellipse_rim(&frame, size),
    };
    polygon_irradiance(&corners, point, normal)
}

/// Luminance of a white card on a point of the surface, with nothing in the way of the light; the
/// scene's environment map, where it has one, is beside it. A tint that is still unknown is white.
pub(super) fn white_card_at(
    scene: &Scene,
    environment: Option<&EnvironmentMap>,
    point: Point3<f64>,
) -> f32 {
    let tint = match scene.cast {
        LightTint::Known(color) => color,
        LightTint::MatchSurface { .. } => LinearRgb::WHITE,
    };
    let tinted = |light: LinearRgb| (light * tint).luminance();
    let lights = scene.lights.iter();
    let lit: f32 = lights
        .map(|light| tinted(irradiance(light, point, Vector3::z())))
        .sum();
    let around = environment.map_or(0.0, |map| map.irradiance(&Vector3::z()).luminance());
    (lit + around) / PI as f32 + tinted(scene.ambient)
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

    #[test]
    fn a_speck_far_away_is_its_power_over_distance_squared() {
        for shape in [LightShape::Rectangle, LightShape::Ellipse] {
            let light = AreaLight {
                shape,
                position: [60.0, 0.0, 80.0],
                size: [1e-5; 2],
                ..square()
            };
            let e = irradiance(&light, Point3::origin(), Vector3::z());
            let expected = 0.8 * 10.0 / PI / 1e4;
            assert!((f64::from(e.g) / expected - 1.0).abs() < 1e-5, "{shape:?}");
        }
    }
}
