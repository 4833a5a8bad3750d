//! A synthetic pile of cards, for rendering without photographs.

use petcomp::Camera;
use petcomp::Image;
use petcomp::asset::Texture;
use petcomp::geom::{Pose, Quad, UnitQuaternion, Vector3};
use petcomp::scene::{AreaLight, Card, Shot};
use petcomp::{LinearRgb, ObjectId, PremulRgba};

/// Height of the camera over the surface, metres.
pub(super) const CAMERA_HEIGHT_M: f64 = 1.1;
/// Focal length in widths of the picture.
const FOCAL_WIDTHS: f64 = 1.16;
/// Texels of a card.
const TEXELS: (usize, usize) = (96, 288);
/// Textures that the cards share.
const TEXTURE_COUNT: u32 = 5;
/// Size of a card, metres.
const CARD_SIZE_M: [f64; 2] = [0.07, 0.21];

/// A camera that looks straight down from `height_m` over the origin.
pub(super) fn camera_above(image: [u32; 2], height_m: f64) -> Camera {
    Camera::looking_down(height_m, FOCAL_WIDTHS * f64::from(image[0]), image)
}

/// A square lamp above and to the right of the origin that shines at it.
pub(super) fn lamp(color: LinearRgb) -> AreaLight {
    AreaLight {
        color,
        ..AreaLight::new([0.5, 0.3, 1.2], [0.35; 2], 9.0)
    }
}

/// See-through bottles on top of each other and side by side, under one light and a dim sky.
pub(super) fn pile(cards: u32, image: [u32; 2]) -> Shot {
    let shot = Shot::new(camera_above(image, CAMERA_HEIGHT_M))
        .with_light(lamp(LinearRgb::new(1.0, 0.95, 0.85)))
        .with_ambient(LinearRgb::new(0.3, 0.35, 0.4));
    let textures: Vec<Texture> = (0..TEXTURE_COUNT).map(|k| bottle(k).into()).collect();
    (0..cards)
        .map(|k| bottle_card(k, &textures))
        .fold(shot, Shot::with_card)
}

fn bottle_card(k: u32, textures: &[Texture]) -> Card {
    let quad = Quad {
        world_from_card: scattered_pose(f64::from(k)),
        size: CARD_SIZE_M,
    };
    let texture = textures[k as usize % textures.len()].clone();
    Card::new(ObjectId(k + 1), quad, texture)
}

/// Spread by sines with incommensurable steps, each a little higher than the last.
fn scattered_pose(k: f64) -> Pose {
    let (x, y) = (0.17 * libm::sin(3.1 * k), 0.1 * libm::cos(4.7 * k));
    let center = Vector3::new(x, y, 0.02 + 0.004 * k);
    Pose::from_parts(center.into(), scattered_rotation(k))
}

fn scattered_rotation(k: f64) -> UnitQuaternion<f64> {
    let (roll, pitch) = (0.12 * libm::sin(1.7 * k), 0.12 * libm::cos(2.3 * k));
    UnitQuaternion::from_euler_angles(roll, pitch, 2.4 * k)
}

/// A bottle with a soft outline, a neck, a label and stripes.
fn bottle(k: u32) -> Image<PremulRgba> {
    let (w, h) = TEXELS;
    Image::from_fn(w, h, |x, y| {
        let (across, along) = (2.0 * x as f32 / w as f32 - 1.0, y as f32 / h as f32);
        striped(bottle_alpha(across, along), bottle_stripe(k, along))
    })
}

fn bottle_stripe(k: u32, along: f32) -> f32 {
    0.5 + 0.4 * libm::sinf(along * 60.0 + k as f32)
}

fn bottle_alpha(across: f32, along: f32) -> f32 {
    let half_width = if along < 0.2 { 0.35 } else { 0.9 };
    let is_label = (0.4..0.6).contains(&along);
    let opacity = if is_label { 0.95 } else { 0.5 };
    (40.0 * (half_width - across.abs())).clamp(0.0, 1.0) * opacity
}

/// Red in the stripes, blue between them.
pub(super) fn striped(alpha: f32, stripe: f32) -> PremulRgba {
    PremulRgba::new(alpha * stripe, alpha * 0.6, alpha * (1.0 - stripe), alpha)
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::Quality;
    use petcomp::render::{check, render};

    #[test]
    fn a_pile_can_be_rendered_and_every_card_is_seen() {
        let shot = pile(12, [160, 120]);
        assert!(check(&shot).is_ok());
        let deep = render(&shot, &Quality::Draft.render());
        let mut seen = vec![false; 12];
        for (x, y) in (0..120).flat_map(|y| (0..160).map(move |x| (x, y))) {
            deep.at(x, y)
                .iter()
                .for_each(|s| seen[s.object.0 as usize - 1] = true);
        }
        assert!(seen.iter().all(|s| *s), "{seen:?}");
    }
}
