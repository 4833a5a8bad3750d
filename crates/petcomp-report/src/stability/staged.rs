//! Shots for cases: a camera straight above, level cards, small lights.

use petcomp::asset::Texture;
use petcomp::camera::Camera;
use petcomp::geom::{Point3, Pose, Quad, UnitQuaternion, Vector3, doubled_area};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{AreaLight, CameraSource, Card, Exposure, Scene, Shot, Surface};
use petcomp::{DeepImage, DeepSample, Error, Image, LinearRgb, ObjectId, PremulRgba, Result};
use tempfile::TempDir;

/// A camera at height 1 over the origin, looking straight down; picture up is world `+y`.
pub(super) fn camera_above(image: [u32; 2], focal_px: f64) -> Camera {
    Camera::looking_down(1.0, focal_px, image)
}

/// A camera at `eye` whose image centre sees `target`.
pub(super) fn camera_looking_at(
    eye: [f64; 3],
    target: [f64; 3],
    image: [u32; 2],
    focal_px: f64,
) -> Camera {
    Camera {
        camera_from_world: pose_facing(eye.into(), target.into()).inverse(),
        ..camera_above(image, focal_px)
    }
}

fn pose_facing(eye: Point3<f64>, target: Point3<f64>) -> Pose {
    Pose::face_towards(&eye, &target, &-Vector3::z())
}

/// A folder that is removed when it is dropped.
pub(super) fn temporary_folder() -> Result<TempDir> {
    tempfile::tempdir().map_err(|e| Error::file(std::env::temp_dir(), e))
}

/// A card with one texture on both sides.
pub(super) fn card(
    id: u32,
    center: [f64; 3],
    rotation: UnitQuaternion<f64>,
    size: [f64; 2],
    texture: impl Into<Texture>,
) -> Card {
    let quad = Quad {
        world_from_card: Pose::from_parts(Vector3::from(center).into(), rotation),
        size,
    };
    Card::new(ObjectId(id), quad, texture)
}

/// A level square card of one texel value, with enough texels that the fade of the outermost half
/// is small.
pub(super) fn level_card(id: u32, center: [f64; 3], size: f64, texel: PremulRgba) -> Card {
    let texture = Image::filled(64, 64, texel);
    card(id, center, UnitQuaternion::identity(), [size; 2], texture)
}

/// Rotation about the world's `+y`.
pub(super) fn tilted(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle)
}

/// A premultiplied grey of straight value 1/2.
pub(super) fn grey(alpha: f32) -> PremulRgba {
    PremulRgba::new(0.5 * alpha, 0.5 * alpha, 0.5 * alpha, alpha)
}

/// A square light of this side at `position`, turned to the origin.
pub(super) fn lamp(position: [f64; 3], side: f64, power: f64) -> AreaLight {
    AreaLight::new(position, [side; 2], power)
}

/// A picture of `size` in which pixel (3, 2) alone has samples, front to back.
pub(super) fn one_deep_pixel([w, h]: [u32; 2], samples: &[DeepSample]) -> DeepImage {
    let (w, h) = (w as usize, h as usize);
    let mut pixels = vec![Vec::new(); w * h];
    pixels[2 * w + 3] = samples.to_vec();
    DeepImage::from_pixels(Image::filled(w, h, LinearRgb::WHITE), pixels)
}

/// The picture of a shot with the default options.
pub(super) fn rendered(shot: &Shot) -> DeepImage {
    render(shot, &RenderOptions::default())
}

/// Pixels that are not transparent black.
pub(super) fn count_drawn(frame: &Image<PremulRgba>) -> usize {
    let pixels = frame.pixels().iter();
    pixels.filter(|p| **p != PremulRgba::TRANSPARENT).count()
}

/// A shot from above, 5 x 5 pixels of a centimetre.
pub(super) fn small_shot() -> Shot {
    Shot::new(camera_above([5, 5], 100.0))
}

/// A scene without objects on a surface that fills the picture.
pub(super) fn empty_scene(camera: Camera) -> Scene {
    Scene {
        plate: "plate".into(),
        exposure: Exposure::Ev(0.0),
        ..Scene::new(
            camera.image,
            CameraSource::Known(camera),
            Surface::new([2.0, 2.0]),
        )
    }
}

/// The area of a card's square as a camera sees it, pixels: that of its projected corners.
pub(super) fn projected_area(card: &Card, camera: &Camera) -> f64 {
    let corners = card.quad.corners();
    let seen: Vec<_> = corners
        .iter()
        .filter_map(|&corner| Some(camera.project(corner)?.0))
        .collect();
    0.5 * doubled_area(&seen).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::geom::Point2;

    #[test]
    fn a_level_card_covers_its_size_over_its_distance() {
        let area = projected_area(
            &level_card(1, [0.0, 0.0, 0.1], 0.2, grey(1.0)),
            &camera_above([96, 96], 400.0),
        );
        assert!(
            (area - (0.2 * 400.0 / 0.9) * (0.2 * 400.0 / 0.9)).abs() < 1e-9,
            "{area}"
        );
    }

    #[test]
    fn the_middle_of_a_picture_sees_the_target() {
        let camera = camera_looking_at([0.3, -0.2, 0.8], [0.1, 0.0, 0.0], [40, 30], 50.0);
        let seen = camera.project(Point3::new(0.1, 0.0, 0.0)).map(|(px, _)| px);
        assert!(
            seen.is_some_and(|px| (px - Point2::new(20.0, 15.0)).norm() < 1e-9),
            "{seen:?}"
        );
    }
}
