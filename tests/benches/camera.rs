//! Time of the camera solver, on simulated views of a realistic camera.

use criterion::{Criterion, criterion_group, criterion_main};
use petcomp::camera::simulate::Scenario;
use petcomp::camera::{self, SolveOptions};
use std::hint::black_box;

fn solve(c: &mut Criterion) {
    let options = SolveOptions::default();
    for tilt in [0.0, 10.0, 30.0, 60.0] {
        let labels: Vec<_> = (0..64)
            .map(|k| Scenario::realistic().tilted(tilt).view(1, k).label)
            .collect();
        let mut k = 0;
        c.bench_function(&format!("camera/solve/tilt {tilt}"), |b| {
            b.iter(|| {
                k = (k + 1) % labels.len();
                camera::solve(black_box(&labels[k]), &options)
            })
        });
    }
}

fn joint(c: &mut Criterion) {
    let views = Scenario::realistic().views(1, 0, 16, [0.0, 30.0]);
    let labels: Vec<_> = views.into_iter().map(|v| v.label).collect();
    let options = SolveOptions::default();
    c.bench_function("camera/joint/16 photos", |b| {
        b.iter(|| camera::solve_joint(black_box(&labels), &options))
    });
}

criterion_group!(benches, solve, joint);
criterion_main!(benches);
