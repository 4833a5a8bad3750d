//! Renders two cards over a plate, without any input files.
//!
//! `cargo run --release --example render_shot [PICTURE]`

use petcomp::geom::{Pose, Quad, UnitQuaternion, Vector3};
use petcomp::render::RenderOptions;
use petcomp::scene::Card;
use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Result, Shot, color, composite, io};
use std::sync::Arc;

fn main() -> Result<()> {
    let picture = std::env::args().nth(1);
    let plate = Image::from_fn(640, 480, |x, y| LinearRgb::grey(0.2 + 0.1 * checker(x, y)));
    let red_film = Image::filled(16, 16, PremulRgba::new(0.30, 0.05, 0.05, 0.5));
    let blue = Image::filled(16, 16, PremulRgba::new(0.05, 0.10, 0.40, 1.0));
    let shot = Shot::new(Camera::looking_down(1.0, 800.0, [640, 480]))
        .with_plate(Arc::new(plate))
        .with_card(Card::new(ObjectId(1), lying(0.02, 0.3), blue))
        .with_card(Card::new(ObjectId(2), lying(0.05, 1.2), red_film))
        .with_ambient(LinearRgb::WHITE);
    let frame = composite::picture(&shot, &RenderOptions::default());
    let shown = color::to_srgb8(&frame.map(|pixel| pixel.color()));
    io::write(picture.as_deref().unwrap_or("shot.png"), &shown)
}

/// A checkerboard of 0 and 1 with 40 pixel squares.
fn checker(x: usize, y: usize) -> f32 {
    ((x / 40 + y / 40) % 2) as f32
}

/// A level card at this height, rotated about the vertical.
fn lying(height: f64, turn: f64) -> Quad {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    Quad {
        world_from_card: Pose::from_parts(Vector3::new(0.0, 0.0, height).into(), rotation),
        size: [0.30, 0.12],
    }
}
