//! The shadow of one card in closed form.

use crate::pile::camera_above;
use petcomp::Image;
use petcomp::geom::{Plane, Point2, Point3, Pose, Quad, UnitQuaternion, Vector3, sides};
use petcomp::light::{frame, polygon_irradiance};
use petcomp::scene::{AreaLight, Card, Shot};
use petcomp::{LinearRgb, ObjectId, PremulRgba};
use std::f64::consts::PI;

pub(super) const IMAGE_SIZE_PX: [u32; 2] = [160, 120];
/// Size, height and rotation of the card, metres and radians.
const CARD_SIZE_M: [f64; 2] = [0.2, 0.08];
pub(super) const CARD_HEIGHT_M: f64 = 0.05;
const CARD_TURN_RAD: f64 = 0.4;
const CAMERA_HEIGHT_M: f64 = 0.6;
/// Pixels up to this factor of the card's sides are left out: they see its border.
const BORDER_FACTOR: f64 = 1.2;

/// The kinds of light.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum LightKind {
    Area,
    Sky,
}

pub(super) fn shadow_shot(kind: LightKind) -> Shot {
    let shot = Shot::new(camera_above(IMAGE_SIZE_PX, CAMERA_HEIGHT_M)).with_card(opaque_card());
    match kind {
        LightKind::Sky => shot.with_ambient(LinearRgb::WHITE),
        LightKind::Area => shot.with_light(square_light()),
    }
}

fn opaque_card() -> Card {
    let quad = Quad {
        world_from_card: card_pose(),
        size: CARD_SIZE_M,
    };
    // So fine that its border, half a texel soft, is sharp.
    let texture = Image::filled(512, 256, PremulRgba::new(0.0, 0.0, 0.0, 1.0));
    Card {
        outline_uv: [].into(),
        ..Card::new(ObjectId(1), quad, texture)
    }
}

fn card_pose() -> Pose {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), CARD_TURN_RAD);
    Pose::from_parts(Vector3::new(0.0, 0.0, CARD_HEIGHT_M).into(), rotation)
}

fn square_light() -> AreaLight {
    AreaLight::new([0.3, 0.2, 0.8], [0.3; 2], 5.0)
}

/// Share of the light that the card leaves at each pixel's centre; none where the card itself or
/// its border is seen.
pub(super) fn exact_shares(shot: &Shot, kind: LightKind) -> Vec<Option<f64>> {
    let card = shot.cards[0].quad.corners();
    let [w, h] = shot.camera.image;
    (0..w * h)
        .map(|i| {
            let point = surface_point(shot, [i % w, i / w])?;
            Some(light_share(shot, kind, &card, point))
        })
        .collect()
}

/// The point of the surface that a pixel sees; none where it sees the card.
fn surface_point(shot: &Shot, pixel: [u32; 2]) -> Option<Point3<f64>> {
    let [x, y] = pixel.map(|v| f64::from(v) + 0.5);
    let ray = shot.camera.ray(Point2::new(x, y));
    let point = ray.at(Plane::surface().intersect(&ray)?);
    let around = with_border(&shot.cards[0].quad);
    around.intersect(&ray).is_none().then_some(point)
}

/// The card, extended by the pixels that see its border.
fn with_border(card: &Quad) -> Quad {
    Quad {
        size: card.size.map(|side| BORDER_FACTOR * side),
        ..*card
    }
}

/// Share of the light that a card leaves at a point.
fn light_share(shot: &Shot, kind: LightKind, card: &[Point3<f64>; 4], point: Point3<f64>) -> f64 {
    match kind {
        LightKind::Sky => 1.0 - level_irradiance(card, point) / PI,
        LightKind::Area => {
            let light = &shot.lights[0];
            let face = frame(light).corners(light.size);
            let hidden = shadowed_part(&face, card, point);
            1.0 - level_irradiance(&hidden, point) / level_irradiance(&face, point)
        }
    }
}

fn level_irradiance(polygon: &[Point3<f64>], point: Point3<f64>) -> f64 {
    polygon_irradiance(polygon, point, Vector3::z())
}

/// The part of a light's face that a card hides from a point: clipped by the planes through the
/// point and each side.
fn shadowed_part(
    face: &[Point3<f64>; 4],
    card: &[Point3<f64>; 4],
    point: Point3<f64>,
) -> Vec<Point3<f64>> {
    let middle = middle_of(card);
    sides(card).fold(face.to_vec(), |kept, [a, b]| {
        let normal = (a - point).cross(&(b - point));
        let inwards = normal * normal.dot(&(middle - point)).signum();
        positive_part(&kept, |p| inwards.dot(&(p - point)))
    })
}

fn middle_of(corners: &[Point3<f64>; 4]) -> Point3<f64> {
    let sum: Vector3<f64> = corners.iter().map(|corner| corner.coords).sum();
    Point3::from(sum / corners.len() as f64)
}

/// The part of a polygon on the positive side (Sutherland and Hodgman 1974).
fn positive_part(
    polygon: &[Point3<f64>],
    distance: impl Fn(&Point3<f64>) -> f64,
) -> Vec<Point3<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for [a, b] in sides(polygon) {
        let (s, t) = (distance(&a), distance(&b));
        if s >= 0.0 {
            kept.push(a);
        }
        if (s >= 0.0) != (t >= 0.0) {
            kept.push(a + (b - a) * (s / (s - t)));
        }
    }
    kept
}
#[cfg(test)]
mod tests {
    use super::*;

    /// Brute force: the share of the light's points that a point sees past the card, weighted by
    /// their light.
    fn brute_force(shot: &Shot, point: Point3<f64>) -> f64 {
        const N: usize = 120;
        let light = &shot.lights[0];
        let face = frame(light);
        let place = |i: usize, side: f64| ((i as f64 + 0.5) / N as f64 - 0.5) * side;
        let (mut open, mut all) = (0.0, 0.0);
        for i in 0..N * N {
            let from = face.point(place(i % N, light.size[0]), place(i / N, light.size[1]));
            let way = from - point;
            let weight = way.z * -face.normal.dot(&way) / way.norm_squared().powi(2);
            let ray = petcomp::geom::Ray {
                origin: point,
                direction: way,
            };
            let is_hidden = shot.cards[0]
                .quad
                .intersect(&ray)
                .is_some_and(|(t, _)| t > 0.0);
            all += weight;
            open += if is_hidden { 0.0 } else { weight };
        }
        open / all
    }

    #[test]
    fn the_closed_form_is_what_many_rays_find() {
        let shot = shadow_shot(LightKind::Area);
        let card = shot.cards[0].quad.corners();
        for [x, y] in [
            [0.0, 0.0],
            [-0.06, -0.03],
            [-0.1, 0.02],
            [0.05, -0.08],
            [0.3, 0.3],
        ] {
            let point = Point3::new(x, y, 0.0);
            let (exact, found) = (
                light_share(&shot, LightKind::Area, &card, point),
                brute_force(&shot, point),
            );
            assert!((exact - found).abs() < 0.01, "{x} {y}: {exact} {found}");
        }
    }

    #[test]
    fn a_card_far_from_the_light_hides_nothing() {
        let shot = shadow_shot(LightKind::Area);
        let card = shot.cards[0].quad.corners();
        assert_eq!(
            light_share(&shot, LightKind::Area, &card, Point3::new(2.0, 2.0, 0.0)),
            1.0
        );
        assert!(light_share(&shot, LightKind::Sky, &card, Point3::new(50.0, 0.0, 0.0)) > 0.999_99);
    }
}
