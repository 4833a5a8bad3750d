//! Where an area light is, how bright it is, and what it does where nothing is in its way.

use crate::geom::{Point3, Vector3};
use crate::light::{nodes, polygon_irradiance};
use crate::pixel::LinearRgb;
use crate::scene::{AreaLight, LightShape};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Samples along each side of an ellipse where its irradiance is asked for without shadows.
const ELLIPSE_SAMPLES: usize = 16;
/// Corners that an ellipse is given where it is near.
const ELLIPSE_CORNERS: usize = 256;

/// An area light in the world: its sides run along `x` and `y`, it emits to the side of `normal` only.
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
/// The second side leans as far towards `+y` of the world as it can; a light that shines along the y axis takes `+x`
/// instead. A light whose target is its own position shines straight down.
pub fn frame(light: &AreaLight) -> LightFrame {
    let center = Point3::from(light.position);
    let back = (center - Point3::from(light.target))
        .try_normalize(1e-9)
        .unwrap_or_else(Vector3::z);
    // Within 2.6 degrees of the y axis "towards +y" says nothing any more; the limit is that of the reference script.
    let up = if back.y.abs() < 0.999 {
        Vector3::y()
    } else {
        Vector3::x()
    };
    let x = up.cross(&back).normalize();
    LightFrame {
        center,
        x,
        y: back.cross(&x),
        normal: -back,
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

    /// Corners of a polygon along the ellipse of these diameters, in turn, of the same area.
    fn rim(&self, size: [f64; 2]) -> Vec<Point3<f64>> {
        let step = TAU / ELLIPSE_CORNERS as f64;
        let grown = (step / libm::sin(step)).sqrt();
        let [a, b] = size.map(|s| 0.5 * s * grown);
        let corner = |i: usize| {
            let (sin, cos) = libm::sincos(step * i as f64);
            self.point(a * cos, b * sin)
        };
        (0..ELLIPSE_CORNERS).map(corner).collect()
    }
}

/// Shorter sides count as this, metres: a light without size is the limit of small ones, a point, which no picture tells
/// from a light of a micrometre.
const SMALLEST_SIDE: f64 = 1e-6;

/// Side lengths (diameters of an ellipse) as they count, metres.
pub(super) fn sides(light: &AreaLight) -> [f64; 2] {
    light.size.map(|side| side.max(SMALLEST_SIDE))
}

/// Area of a light's face, square metres.
pub(crate) fn area(light: &AreaLight) -> f64 {
    let [a, b] = sides(light);
    match light.shape {
        LightShape::Rectangle => a * b,
        LightShape::Ellipse => FRAC_PI_4 * a * b,
    }
}

/// Emitted radiance, the same from every point into every direction of the lit side: `power * color / (pi * area)`.
pub fn radiance(light: &AreaLight) -> LinearRgb {
    light.color.scale((light.power / (PI * area(light))) as f32)
}

/// Irradiance at `point` on a surface of unit `normal`, where nothing is in the way.
///
/// # Method
/// Closed form for rectangles ([`polygon_irradiance`]), and for ellipses nearer than they are wide, as polygons of 256
/// corners and of their area; a product rule of 16 x 32 points for ellipses farther away.
pub fn irradiance(light: &AreaLight, point: Point3<f64>, normal: Vector3<f64>) -> LinearRgb {
    let frame = frame(light);
    if frame.normal.dot(&(point - frame.center)) <= 0.0 {
        return LinearRgb::BLACK;
    }
    let [a, b] = sides(light);
    let factor = match light.shape {
        LightShape::Rectangle => polygon_irradiance(&frame.corners([a, b]), point, normal),
        LightShape::Ellipse if (point - frame.center).norm() < a.max(b) => {
            polygon_irradiance(&frame.rim([a, b]), point, normal)
        }
        LightShape::Ellipse => nodes(light, ELLIPSE_SAMPLES)
            .iter()
            .map(|n| n.irradiance(&frame, point, normal))
            .sum(),
    };
    radiance(light).scale(factor as f32)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A light whose irradiance at five points was worked out by another program.
    pub(crate) fn square() -> AreaLight {
        AreaLight {
            shape: LightShape::Rectangle,
            position: [0.3, 0.2, 0.9],
            target: [0.0; 3],
            size: [0.4; 2],
            power: 10.0,
            color: LinearRgb::WHITE,
        }
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
