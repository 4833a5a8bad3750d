//! Where an area light is, and how bright it is.

use crate::geom::{Point3, Vector3};
use crate::pixel::LinearRgb;
use crate::scene::{AreaLight, LightShape};
use std::f64::consts::{FRAC_PI_4, PI};

/// An area light in the world: its sides run along `x` and `y`, it emits to the side of `normal`
/// only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightFrame {
    /// Centre.
    pub center: Point3<f64>,
    /// Unit vector along the first side.
    pub x: Vector3<f64>,
    /// Unit vector along the second side.
    pub y: Vector3<f64>,
    /// Unit vector that the light shines along, `-(x cross y)`.
    pub normal: Vector3<f64>,
}

/// The frame of a light at `position` whose face is turned to `target`.
///
/// # Method
/// The second side leans as far towards `+y` of the world as it can; a light that shines along the
/// y axis takes `+x` instead. A light whose target is its own position shines straight down.
pub fn frame(light: &AreaLight) -> LightFrame {
    let center = Point3::from(light.position);
    let way = center - Point3::from(light.target);
    let back = way.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let x = upwards(&back).cross(&back).normalize();
    LightFrame {
        center,
        x,
        y: back.cross(&x),
        normal: -back,
    }
}

/// Within 2.6 degrees of the y axis "towards +y" is undefined; the limit is that of the reference
/// script.
fn upwards(back: &Vector3<f64>) -> Vector3<f64> {
    if back.y.abs() < 0.999 {
        Vector3::y()
    } else {
        Vector3::x()
    }
}

impl LightFrame {
    /// The point at `a`, `b` metres along the two sides.
    pub fn point(&self, a: f64, b: f64) -> Point3<f64> {
        self.center + self.x * a + self.y * b
    }

    /// Corners of the rectangle of this `size`, in turn.
    pub fn corners(&self, size: [f64; 2]) -> [Point3<f64>; 4] {
        let [a, b] = size.map(|s| 0.5 * s);
        [
            self.point(-a, -b),
            self.point(a, -b),
            self.point(a, b),
            self.point(-a, b),
        ]
    }
}

/// Shorter sides are raised to this: a light without size is the limit of small ones, a point,
/// which no picture can distinguish from a light of a micrometre.
const MIN_SIDE_M: f64 = 1e-6;

/// Side lengths (diameters of an ellipse), metres.
pub(crate) fn side_lengths(light: &AreaLight) -> [f64; 2] {
    light.size.map(|side| side.max(MIN_SIDE_M))
}

/// The height of its lowest point, of the rectangle around an ellipse, metres.
pub(crate) fn lowest_z(light: &AreaLight) -> f64 {
    let corners = frame(light).corners(side_lengths(light));
    corners
        .iter()
        .map(|corner| corner.z)
        .fold(f64::INFINITY, f64::min)
}

/// Area of a light's face, square metres.
pub(crate) fn face_area(light: &AreaLight) -> f64 {
    let [a, b] = side_lengths(light);
    match light.shape {
        LightShape::Rectangle => a * b,
        LightShape::Ellipse => FRAC_PI_4 * a * b,
    }
}

/// Emitted radiance, the same from every point into every direction of the lit side: `power * color
/// / (pi * area)`.
pub fn radiance(light: &AreaLight) -> LinearRgb {
    light
        .color
        .scale((light.power / (PI * face_area(light))) as f32)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::light::polygon_irradiance;

    /// A light whose irradiance at five points was worked out by another program.
    pub(crate) fn square() -> AreaLight {
        AreaLight::new([0.3, 0.2, 0.9], [0.4; 2], 10.0)
    }

    /// Receiver, its normal and the irradiance there, from the same test.
    pub(crate) fn lit_points() -> [([f64; 3], Vector3<f64>, f64); 5] {
        let tilted = Vector3::new(0.0, 0.3f64.sin(), 0.3f64.cos());
        [
            ([0.0, 0.0, 0.0], Vector3::z(), 2.975061),
            ([0.2, -0.1, 0.0], Vector3::z(), 3.052697),
            ([-0.3, 0.3, 0.05], Vector3::z(), 2.114133),
            ([0.3, 0.2, 0.1], Vector3::z(), 4.348681),
            ([0.0, 0.0, 0.1], tilted, 3.628492),
        ]
    }

    #[test]
    fn radiance_is_power_over_pi_area() {
        assert!((radiance(&square()).r - 19.894368).abs() < 2e-5);
        let disk = AreaLight {
            shape: LightShape::Ellipse,
            ..square()
        };
        assert!((radiance(&disk).r - 19.894368 / FRAC_PI_4 as f32).abs() < 3e-5);
    }

    #[test]
    fn closed_form_matches_the_published_numbers() {
        for (at, normal, expected) in lit_points() {
            let e = f64::from(radiance(&square()).r)
                * polygon_irradiance(&frame(&square()).corners([0.4; 2]), at.into(), normal);
            assert!(
                (e / expected - 1.0).abs() < 1e-6,
                "{at:?}: {e} against {expected}"
            );
        }
    }

    #[test]
    fn the_frame_is_right_handed_and_aims_at_the_target() {
        for position in [[0.3, 0.2, 0.9], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let f = frame(&AreaLight {
                position,
                ..square()
            });
            assert!((f.x.cross(&f.y) + f.normal).norm() < 1e-12);
            assert!((f.center + f.normal * f.center.coords.norm()).coords.norm() < 1e-12);
        }
    }

    #[test]
    fn a_light_aimed_at_itself_shines_down() {
        let light = AreaLight {
            target: square().position,
            ..square()
        };
        assert_eq!(frame(&light).normal, -Vector3::z());
    }
}
