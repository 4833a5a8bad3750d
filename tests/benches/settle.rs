//! Time to let a heap of cards come to rest, by the number of cards.

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use petcomp::Scene;
use petcomp::scene::{AssetVariant, Background, CameraSource, Range, Recipe, SettleOptions};
use petcomp::settle;

fn scene(cards: u32, k: u64) -> Scene {
    let camera = CameraSource::Rectangle {
        corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
        photo: [60, 40],
        focal_px: None,
    };
    let tray = Background::new("tray", [0.6, 0.4], camera);
    let bottle = AssetVariant {
        role: Default::default(),
        asset: "b".into(),
        photo_sizes: vec![[0.2, 0.08]],
        photo_outlines: vec![],
        thickness: 0.006,
        mass: 0.03,
    };
    let recipe = Recipe {
        objects: Range::fixed(cards.into()).into(),
        ..Recipe::default()
    };
    recipe
        .scene(0, k, &[tray], &[bottle])
        .expect("the bottle fits the tray")
}

fn fall(c: &mut Criterion) {
    let mut group = c.benchmark_group("settle");
    group.sample_size(10);
    for cards in [5, 20, 60] {
        group.bench_function(BenchmarkId::from_parameter(cards), |b| {
            let mut k = 0;
            let next = || {
                k += 1;
                scene(cards, k)
            };
            let options = SettleOptions::default();
            b.iter_batched(
                next,
                |scene| settle::settle(scene, &options),
                BatchSize::SmallInput,
            );
        });
    }
}

criterion_group!(benches, fall);
criterion_main!(benches);
