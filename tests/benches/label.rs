//! Labels of a picture with thirty cards.

use criterion::{Criterion, criterion_group, criterion_main};
use petcomp::camera::Camera;
use petcomp::geom::{Point2, Pose, Quad, UnitQuaternion, Vector3};
use petcomp::label::{LabelOptions, label};
use petcomp::scene::Card;
use petcomp::{DeepImage, DeepSample};
use petcomp::{Depth, Image, LinearRgb, ObjectId, PremulRgba, Shot};
use std::hint::black_box;

const CARDS: u32 = 30;

fn shot() -> Shot {
    let camera = Camera::looking_down(1.0, 700.0, [640, 480]);
    (1..=CARDS)
        .map(card)
        .fold(Shot::new(camera), Shot::with_card)
}

/// Cards of 20 x 7 cm in a spiral, their outlines hulls of 40 corners.
fn card(id: u32) -> Card {
    let turn = 2.4 * f64::from(id);
    let radius = 0.035 * f64::from(id).sqrt();
    let place = Vector3::new(
        radius * turn.cos(),
        radius * turn.sin(),
        0.004 * f64::from(id),
    );
    let rotation = UnitQuaternion::from_euler_angles(0.05, -0.03, turn);
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / 40.0;
    let quad = Quad {
        world_from_card: Pose::from_parts(place.into(), rotation),
        size: [0.2, 0.07],
    };
    Card {
        class: Some(id % 4),
        outline_uv: (0..40)
            .map(|i| Point2::new(0.5 + 0.5 * angle(i).cos(), 0.5 + 0.5 * angle(i).sin()))
            .collect(),
        ..Card::new(ObjectId(id), quad, Image::<PremulRgba>::new(2, 2))
    }
}

/// One ray a pixel, film of alpha 0.6.
fn cast(shot: &Shot) -> DeepImage {
    let [w, h] = shot.camera.image.map(|n| n as usize);
    let pixel = |i: usize| {
        let ray = shot
            .camera
            .ray(Point2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5));
        let hits = shot
            .cards
            .iter()
            .filter_map(|c| Some((c.quad.intersect(&ray)?.0, c.id)));
        let mut hits: Vec<_> = hits.collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let behind = |n: usize| 0.6 * 0.4_f32.powi(n as i32);
        let sample = |(n, (t, object)): (usize, (f64, ObjectId))| DeepSample {
            object,
            depth: Depth(t as f32),
            light: LinearRgb::BLACK,
            alpha: 0.6,
            visible: behind(n),
        };
        hits.into_iter().enumerate().map(sample).collect::<Vec<_>>()
    };
    DeepImage::from_pixels(Image::filled(w, h, LinearRgb::WHITE), (0..w * h).map(pixel))
}

fn labels(c: &mut Criterion) {
    let shot = shot();
    let deep = cast(&shot);
    let options = LabelOptions::default();
    c.bench_function("label/640x480/30 cards", |b| {
        b.iter(|| label(black_box(&deep), &shot, &options))
    });
    let found = label(&deep, &shot, &options);
    let frame = Image::<PremulRgba>::filled(640, 480, PremulRgba::new(0.2, 0.2, 0.2, 1.0));
    let classes = ["cap_label", "cap", "label", "none"].map(String::from);
    c.bench_function("label/overlay/640x480", |b| {
        b.iter(|| petcomp::label::overlay(black_box(&frame), &found, &classes));
    });
}

criterion_group!(benches, labels);
criterion_main!(benches);
