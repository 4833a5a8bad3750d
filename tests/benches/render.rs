//! Milliseconds per frame: 20 cards over a tray at 640 x 480, each setting, on one thread and on
//! all.

use criterion::{Criterion, criterion_group, criterion_main};
use petcomp::Quality;
use petcomp::asset::Texture;
use petcomp::geom::{Point2, Pose, Quad, UnitQuaternion, Vector2, Vector3};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{AreaLight, Card, Grade, LightShape};
use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Shot, composite};
use std::hint::black_box;

/// Between the default and a reference: 2 x 2 samples a pixel, 4 x 4 a light.
const GOOD: RenderOptions = RenderOptions {
    subsamples: 2,
    light_samples: 4,
    ambient_samples: 64,
    cell_px: 1.0,
    refraction: true,
};

/// The same with 3 x 3 samples a pixel, 6 x 6 a light.
const HIGH: RenderOptions = RenderOptions {
    subsamples: 3,
    light_samples: 6,
    ambient_samples: 100,
    cell_px: 0.66,
    refraction: true,
};

/// A bottle of 384 x 1152 texels: a soft outline, half see-through, striped.
fn texture(k: usize) -> Image<PremulRgba> {
    Image::from_fn(384, 1152, |x, y| {
        let (x, y) = (x as f32 / 192.0 - 1.0, y as f32 / 1152.0);
        let half_width = if y < 0.2 { 0.35 } else { 0.9 };
        let alpha = (40.0 * (half_width - x.abs())).clamp(0.0, 1.0)
            * if y > 0.4 && y < 0.6 { 0.95 } else { 0.5 };
        let stripe = 0.5 + 0.4 * (y * 60.0 + k as f32).sin();
        PremulRgba::new(alpha * stripe, alpha * 0.6, alpha * (1.0 - stripe), alpha)
    })
}

/// Cards on their way to rest: spread over the tray, slightly tilted, in layers.
fn shot() -> Shot {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let tilt = UnitQuaternion::from_euler_angles(0.2, 0.0, 0.0);
    let camera = Camera {
        image: [640, 480],
        focal_px: Vector2::new(746.0, 746.0),
        principal_px: Point2::new(320.0, 240.0),
        camera_from_world: Pose::from_parts(Vector3::new(0.0, 0.0, 1.1).into(), tilt * down),
    };
    let light = AreaLight {
        shape: LightShape::Rectangle,
        position: [0.5, 0.3, 1.2],
        target: [0.0; 3],
        size: [0.35; 2],
        power: 9.0,
        color: LinearRgb::new(1.0, 0.95, 0.85),
    };
    let textures: Vec<_> = (0..5).map(|k| Texture::from(texture(k))).collect();
    let shot = Shot::new(camera)
        .with_light(light)
        .with_ambient(LinearRgb::new(0.3, 0.35, 0.4));
    (0..20).fold(shot, |shot, k| {
        let f = f64::from(k);
        let rotation = UnitQuaternion::from_euler_angles(
            0.12 * (1.7 * f).sin(),
            0.12 * (2.3 * f).cos(),
            2.4 * f,
        );
        let center = Vector3::new(
            0.17 * (3.1 * f).sin(),
            0.1 * (4.7 * f).cos(),
            0.012 + 0.009 * f,
        );
        let quad = Quad {
            world_from_card: Pose::from_parts(center.into(), rotation),
            size: [0.07, 0.21],
        };
        let texture = textures[k as usize % textures.len()].clone();
        shot.with_card(Card {
            outline_uv: [].into(),
            grade: Grade {
                hue_deg: 7.0 * k as f32,
                saturation: 0.9,
                value: 1.1,
                ..Grade::default()
            },
            ..Card::new(ObjectId(k + 1), quad, texture)
        })
    })
}

fn settings(c: &mut Criterion) {
    let shot = shot();
    let plate = Image::filled(640, 480, LinearRgb::grey(0.2));
    let single = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread can be had");
    let all = rayon::ThreadPoolBuilder::new()
        .build()
        .expect("threads can be had");
    let mut group = c.benchmark_group("render/640x480/20_cards");
    group.sample_size(10);
    let [draft, normal] = [Quality::Draft, Quality::Normal].map(RenderOptions::from);
    let settings = [
        ("draft", draft),
        ("normal", normal),
        ("good", GOOD),
        ("high", HIGH),
    ];
    for (name, options) in settings {
        let picture = || composite::frame(&render(black_box(&shot), &options), Some(&plate));
        group.bench_function(format!("{name}/one_thread"), |b| {
            b.iter(|| single.install(picture))
        });
        group.bench_function(format!("{name}/all_threads"), |b| {
            b.iter(|| all.install(picture))
        });
    }
    group.finish();
}

criterion_group!(benches, settings);
criterion_main!(benches);
