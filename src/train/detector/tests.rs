//! A network learns sixteen drawn pictures by heart.

use super::*;
use crate::label::BBox;
use crate::{Image, Srgb8};

pub(super) fn description(side: usize) -> Description {
    let anchors = [[[9.0, 12.0], [14.0, 22.0], [20.0, 14.0]], [[26.0, 30.0]; 3], [[40.0, 44.0]; 3]];
    Description { classes: vec!["disc".into(), "slab".into()], width: 0.125, depth: 0.33, side, anchors }
}

/// A picture of a red disc and a green slab on a mottled ground.
fn drawn(k: usize, side: usize) -> Sample {
    let mut dice = dice::Dice::new(7, k as u64);
    let full = side as f64;
    let mut place = |w: f64, h: f64, left: bool| {
        let x = dice.between(0.0, 0.5 * full - w) + if left { 0.0 } else { 0.5 * full };
        let y = dice.between(0.0, full - h);
        BBox { x0: x, y0: y, x1: x + w, y1: y + h }
    };
    let disc = 0.18 * full + 0.012 * full * (k % 8) as f64;
    let (disc, slab) = (place(disc, disc, k % 2 == 0), place(0.4 * full, 0.2 * full, k % 2 == 1));
    let picture = Image::from_fn(side, side, |x, y| {
        let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
        let c = disc.center();
        let grey = 90 + ((x * 7 + y * 13 + k * 5) % 32) as u8;
        if (px - c.x).powi(2) + (py - c.y).powi(2) < (0.5 * disc.width()).powi(2) {
            Srgb8 { r: 200, g: 40, b: 30 }
        } else if px > slab.x0 && px < slab.x1 && py > slab.y0 && py < slab.y1 {
            Srgb8 { r: 40, g: 170, b: 60 }
        } else {
            Srgb8 { r: grey, g: grey, b: grey }
        }
    });
    let objects = vec![Labelled { class: 0, bbox: disc }, Labelled { class: 1, bbox: slab }];
    Sample { name: format!("{k:02}"), picture, objects, size: [side as u32; 2] }
}

fn set(count: usize, side: usize) -> TrainingSet {
    let all: Vec<Sample> = (0..count).map(|k| drawn(k, side)).collect();
    let classes = vec!["disc".into(), "slab".into()];
    TrainingSet { classes, synthetic: all.clone(), validation: all, ..TrainingSet::default() }
}

/// The smallest network, on pictures as they are.
fn small(epochs: usize, side: usize) -> FitOptions {
    let schedule = Schedule { warmup_epochs: 3.0, ..Schedule::default() };
    FitOptions { epochs, batch: 4, side, width: 0.125, augment: Augment::NONE, schedule, ..FitOptions::default() }
}

fn run(set: &TrainingSet, options: &FitOptions, folder: &std::path::Path, resume: bool) -> Fitted {
    fit::<Cpu>(set, options, folder, resume, &Default::default(), |_, _| true).unwrap()
}

#[test]
fn sixteen_images_are_learnt_by_heart() {
    let folder = tempfile::tempdir().unwrap();
    let fitted = run(&set(16, 96), &small(60, 96), folder.path(), false);
    let best = fitted.history.epochs[fitted.history.best().unwrap()];
    assert!(best.map50 > 0.9, "mAP@0.5 {} mAP@0.5:0.95 {}\n{:#?}", best.map50, best.map, fitted.history);
    let again = crate::eval::yolov5(&fitted.sheets, &[]);
    assert_eq!((again.map_at(0), again.map()), (best.map50, best.map));
}

#[test]
fn a_training_that_was_interrupted_ends_as_one_that_was_not() {
    let (set, whole, broken) = (set(5, 64), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mode = Mode::Combined(crate::train::Balance::default());
    let set = TrainingSet { real: set.synthetic[..2].to_vec(), ..set };
    let options = FitOptions { batch: 2, augment: Augment::default(), mode, ..small(3, 64) };
    let expected = run(&set, &options, whole.path(), false);
    let mut calls = 0;
    let stopped = fit::<Cpu>(&set, &options, broken.path(), true, &Default::default(), |_, _| {
        calls += 1;
        calls < 6
    });
    assert!(matches!(stopped, Err(crate::Error::Interrupted { .. })));
    let resumed = run(&set, &options, broken.path(), true);
    assert_eq!(resumed.history, expected.history);
    assert_eq!(resumed.sheets, expected.sheets);
    let other = FitOptions { seed: 1, ..options };
    assert!(fit::<Cpu>(&set, &other, broken.path(), true, &Default::default(), |_, _| true).is_err());
}

#[test]
fn impossible_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |options: &FitOptions| {
        let set = set(1, 64);
        fit::<Cpu>(&set, options, folder.path(), false, &Default::default(), |_, _| true).unwrap_err().to_string()
    };
    assert_eq!(refused(&FitOptions { side: 100, ..small(1, 64) }), "img: 100, expected a multiple of 32, at least 64");
    assert!(refused(&FitOptions { width: f64::NAN, ..small(1, 64) }).starts_with("width: NaN"));
    let combined = Mode::Combined(crate::train::Balance::default());
    assert_eq!(
        refused(&FitOptions { mode: combined, ..small(1, 64) }),
        "real: no images, expected at least one of each source"
    );
}
