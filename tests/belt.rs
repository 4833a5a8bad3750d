//! Sequences on a belt: the same objects, carried on, fall once and keep their numbers.

#![cfg(all(feature = "pipeline", feature = "settle"))]

mod python;

use petcomp::dataset::{DatasetConfig, Part, Pipeline, SampleRecord, Summary, check, generate};
use petcomp::scene::{Object, Placement};
use petcomp::{Code, asset, io};
use serde_json::Value;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const RECIPE: &str = "scene = { image = [160, 120], objects = 3, \
    belt = { frames = 3, frame_rate = 10, speed = 0.2, exposure_s = 0.02 } }\n\
    labels = { formats = ['coco', 'mot'], obstructed = 'keep' }\n\
    split = { val_percent = 50 }\n";

fn pipeline(folder: &Path, recipe: &str) -> Pipeline {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples");
    let assets = folder.join("assets");
    if !assets.exists() {
        let (list, running) = (samples.join("bottles/photos.toml"), AtomicBool::new(false));
        asset::build(list, &assets, &|_, _| (), &running).unwrap();
    }
    let config = DatasetConfig::parse(recipe, &folder.join("recipe.toml"), &[]).unwrap();
    let config = DatasetConfig {
        assets,
        backgrounds: samples.join("backgrounds"),
        ..config
    };
    Pipeline::open(config).unwrap()
}

/// What an object is, wherever it lies.
fn looks(objects: &[Object]) -> Vec<(String, usize, [f64; 2])> {
    let told = objects.iter();
    told.map(|o| (o.asset.clone(), o.photo, o.size)).collect()
}

fn rests(objects: &[Object]) -> Vec<Placement> {
    objects.iter().map(|object| object.placement).collect()
}

#[test]
fn a_sequence_is_written_as_tracks_and_videos() {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = pipeline(folder.path(), RECIPE);
    let scenes: Vec<_> = (0..6)
        .map(|k| pipeline.sample(4, k).unwrap().provenance.unwrap().scene)
        .collect();
    for frames in scenes.chunks(3) {
        for scene in frames {
            assert_eq!(looks(&scene.objects), looks(&frames[0].objects));
            assert_eq!(rests(&scene.objects), rests(&frames[0].objects));
            assert_eq!(scene.plate, frames[0].plate);
        }
        let offsets = frames.iter().map(|scene| scene.belt.unwrap().offset_m[0]);
        let expected = [-0.02, 0.0, 0.02];
        assert!(offsets.zip(expected).all(|(a, b)| (a - b).abs() < 1e-12));
    }
    assert_ne!(rests(&scenes[0].objects), rests(&scenes[3].objects));

    let plan = pipeline.plan(6, 4, folder.path().join("out")).unwrap();
    let make = |k| pipeline.sample(4, k);
    generate(&plan, make, &|_| (), &AtomicBool::new(false)).unwrap();
    check_videos(&plan.folder);
    check_tracks(&plan.folder);
    check_summary(&plan.folder);
    python::check("mot", "trackeval", &plan.folder);
}

fn check_videos(folder: &Path) {
    for (part, video) in [(Part::Train, 1), (Part::Val, 0)] {
        let file = format!("annotations/instances_{}.json", part.name());
        let document: Value = io::read_json(folder.join(file)).unwrap();
        assert_eq!(document["videos"].as_array().unwrap().len(), 1);
        assert_eq!(document["videos"][0]["id"], video);
        let images = document["images"].as_array().unwrap();
        let frames: Vec<_> = images.iter().map(|i| i["frame_id"].as_u64()).collect();
        assert_eq!(frames, [Some(0), Some(1), Some(2)]);
        let annotations = document["annotations"].as_array().unwrap();
        let mut instances: Vec<_> = annotations
            .iter()
            .map(|a| a["instance_id"].as_u64().unwrap() % (1 << 16))
            .collect();
        instances.sort_unstable();
        instances.dedup();
        assert!(!instances.is_empty() && instances.iter().all(|id| (1..=3).contains(id)));
    }
}

/// Lines of the first sequence for training, from its sidecars: MOTChallenge counts everything from 1.
fn expected_rows(folder: &Path) -> Vec<Vec<f64>> {
    let rows = (1..=3).flat_map(|frame| {
        let sidecar = folder.join(format!("scenes/train/{:06}.json", 2 + frame));
        let SampleRecord {
            labels, labelled, ..
        } = io::read_json(sidecar).unwrap();
        let objects = labels.objects.into_iter();
        objects
            .filter(move |object| labelled.contains(&object.id))
            .map(move |object| {
                let b = object.amodal_box;
                let [left, top] = [b.x0 + 1.0, b.y0 + 1.0];
                let visible = (object.visible_fraction * 1e4).round() / 1e4;
                let [frame, id, class] = [frame, object.id.0, object.class + 1].map(f64::from);
                vec![
                    frame,
                    id,
                    left,
                    top,
                    b.width(),
                    b.height(),
                    1.0,
                    class,
                    visible,
                ]
            })
    });
    rows.collect()
}

fn check_tracks(folder: &Path) {
    let sequences: Vec<_> = std::fs::read_dir(folder.join("mot/train"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(sequences, ["000001"]);
    let sequence = folder.join("mot/train/000001");
    let info = io::read_text(sequence.join("seqinfo.ini")).unwrap();
    assert!(
        info.contains("seqLength=3")
            && info.contains("frameRate=10")
            && info.contains("imWidth=160")
    );
    let truth = io::read_text(sequence.join("gt/gt.txt")).unwrap();
    let rows: Vec<Vec<f64>> = truth
        .lines()
        .map(|line| line.split(',').map(|n| n.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows, expected_rows(folder));
    // 20 mm to the right in each frame, for what is seen in all.
    let left = |frame: f64, id: f64| {
        let row = rows.iter().find(|row| row[0] == frame && row[1] == id);
        row.map(|row| row[2])
    };
    let moved = [1.0, 2.0, 3.0].map(|id| Some(left(3.0, id)? - left(1.0, id)?));
    assert!(moved.iter().flatten().count() >= 2, "{truth}");
    assert!(moved.iter().flatten().all(|px| *px > 1.0), "{moved:?}");
    for frame in 1..=3 {
        let shown = sequence.join(format!("img1/{frame:06}.png"));
        let image = folder.join(format!("images/train/{:06}.png", 2 + frame));
        assert_eq!(std::fs::read(shown).unwrap(), std::fs::read(image).unwrap());
    }
    let changed = |text: &str| {
        std::fs::write(sequence.join("gt/gt.txt"), text).unwrap();
        let findings = check(folder).unwrap().findings.into_iter();
        let changed = findings.filter(|finding| finding.diagnostic.code == Code::ChangedFile);
        changed.map(|finding| finding.path).collect::<Vec<_>>()
    };
    let tracks = Path::new("mot/train/000001/gt/gt.txt");
    assert_eq!(changed(&truth.replacen(",1,", ",0,", 1)), [tracks]);
    assert_eq!(changed(&truth), [] as [&Path; 0]);
}

/// Two sequences of three pictures are two draws.
fn check_summary(folder: &Path) {
    let summary = Summary::read(folder).unwrap();
    assert_eq!(summary.glances.len(), 6);
    assert_eq!(summary.drawn["objects"], [3.0, 3.0]);
    assert_eq!(summary.chosen["background"].values().sum::<u64>(), 2);
}

#[test]
fn tracks_without_a_belt_are_refused() {
    let recipe = "labels = { formats = ['mot'] }";
    let told = DatasetConfig::parse(recipe, Path::new("recipe.toml"), &[]);
    let told = told.unwrap_err().to_string();
    assert!(
        told.contains("labels.formats: \"mot\", but the recipe has no belt"),
        "{told}"
    );
}
