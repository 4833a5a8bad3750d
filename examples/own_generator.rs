//! Writes the images of your own generator as a dataset that trainers read; here, each shows one
//! leaning card.
//!
//! `cargo run --release --example own_generator [FOLDER]`

use petcomp::dataset::{Pictures, Plan, Sample, Yolo, generate};
use petcomp::geom::{Point3, Pose, Quad, UnitQuaternion, Vector3};
use petcomp::label::{LabelOptions, label};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::Card;
use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Result, Shot, composite};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() -> Result<()> {
    let folder = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "own_dataset".into());
    let plan = Plan {
        writers: vec![Arc::new(Pictures::default()), Arc::new(Yolo::default())],
        ..Plan::new(&folder, 10, vec!["film".into()])
    };
    let counts = generate(&plan, sample, &|_| (), &AtomicBool::new(false))?;
    println!(
        "{folder}: {} images, {} labels",
        counts.images, counts.labelled
    );
    Ok(())
}

/// Image `k` and its labels, which depend only on `k`.
fn sample(k: u64) -> Result<Sample> {
    let shot = shot(k);
    let deep = render(&shot, &RenderOptions::default());
    let frame = composite::frame(&deep, shot.plate.as_deref());
    let labels = label(&deep, &shot, &LabelOptions::default());
    Ok(Sample::new(frame, labels))
}

fn shot(k: u64) -> Shot {
    let camera = Camera::look_at(
        Point3::new(0.0, -0.8, 0.8),
        Point3::origin(),
        500.0,
        [320, 240],
    );
    let green = Image::filled(8, 8, PremulRgba::new(0.05, 0.3, 0.1, 0.6));
    let plate = Image::filled(320, 240, LinearRgb::grey(0.4));
    Shot::new(camera)
        .with_plate(Arc::new(plate))
        .with_card(Card::new(ObjectId(1), leaning(k as f64), green))
        .with_ambient(LinearRgb::WHITE)
}

/// A card that leans more with every image.
fn leaning(step: f64) -> Quad {
    let rotation = UnitQuaternion::from_euler_angles(0.1 * step, 0.0, 0.3 * step);
    Quad {
        world_from_card: Pose::from_parts(Vector3::new(0.0, 0.0, 0.1).into(), rotation),
        size: [0.25, 0.10],
    }
}
