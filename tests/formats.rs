//! Labels in every format, from pictures that the renderer made, read back by the programs that
//! they are for.
//!
//! The programs are Python packages: `$PETCOMP_PYTHON` (or `python3`) is asked for them, and where
//! it has none, the test says so and passes. `make formats` fetches pycocotools and runs all of
//! this.

#![cfg(feature = "pipeline")]

mod python;

use petcomp::dataset::{
    LabelConfig, Obstructed, Pictures, Plan, Provenance, Sample, SampleRange, SampleRecord,
    Sidecar, Split, generate,
};
use petcomp::geom::{Point2, Pose, Quad, UnitQuaternion, Vector3};
use petcomp::io::exr::read_channels;
use petcomp::label::{LabelOptions, label};
use petcomp::scene::{CameraSource, Card, Surface};
use petcomp::{
    Camera, Image, LinearRgb, ObjectId, PremulRgba, Result, Scene, Shot, composite, io, render,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const IMAGE: [u32; 2] = [96, 72];

/// A ring, so that masks have a hole, a little see-through.
fn ring(size: usize, light: LinearRgb) -> Image<PremulRgba> {
    let middle = 0.5 * size as f32;
    Image::from_fn(size, size, |x, y| {
        let radius = (x as f32 + 0.5 - middle).hypot(y as f32 + 0.5 - middle) / middle;
        let a = if (0.3..0.9).contains(&radius) {
            0.8
        } else {
            0.0
        };
        PremulRgba::new(a * light.r, a * light.g, a * light.b, a)
    })
}

fn card(id: u32, center: [f64; 3], turn: f64, size: [f64; 2]) -> Card {
    let rotation = UnitQuaternion::from_euler_angles(0.1, -0.1, turn);
    let light = LinearRgb::new(0.2 + 0.1 * id as f32, 0.5, 0.9 - 0.1 * id as f32);
    let corners = (0..12).map(|i| f64::from(i) * std::f64::consts::TAU / 12.0);
    let quad = Quad {
        world_from_card: Pose::from_parts(Vector3::from(center).into(), rotation),
        size,
    };
    Card {
        class: Some(id % 2),
        outline_uv: corners
            .map(|a| Point2::new(0.5 + 0.45 * a.cos(), 0.5 + 0.45 * a.sin()))
            .collect(),
        ..Card::new(ObjectId(id), quad, ring(64, light))
    }
}

/// Picture k: none, one, two or three rings; the second lies over the first, the third is cut by
/// the picture's edge.
fn shot(k: u64) -> Shot {
    let shift = 0.01 * (k / 4) as f64;
    let cards = [
        card(1, [-0.1 + shift, 0.0, 0.01], 0.3, [0.3, 0.2]),
        card(2, [0.05 + shift, 0.03, 0.06], 1.0, [0.25, 0.25]),
        card(3, [0.4, -0.2 + shift, 0.03], -0.5, [0.3, 0.2]),
    ];
    let camera = Camera::looking_down(1.0, 100.0, IMAGE);
    let empty = Shot::new(camera).with_ambient(LinearRgb::grey(1.0));
    let plate = Arc::new(Image::filled(
        96,
        72,
        LinearRgb::new(0.3, 0.2, 0.1 + 0.01 * k as f32),
    ));
    cards
        .into_iter()
        .take((k % 4) as usize)
        .fold(empty.with_plate(plate), Shot::with_card)
}

fn sample(k: u64) -> Result<Sample> {
    sample_with(k, &LabelOptions::default())
}

fn sample_with(k: u64, options: &LabelOptions) -> Result<Sample> {
    sample_of(shot(k), options)
}

fn sample_of(shot: Shot, options: &LabelOptions) -> Result<Sample> {
    let deep = render::render(&shot, &Default::default());
    let frame = composite::frame(&deep, shot.plate.as_deref());
    let labels = label(&deep, &shot, options);
    let scene = Scene {
        plate: "grey".into(),
        ambient: LinearRgb::grey(1.0),
        ..Scene::new(
            IMAGE,
            CameraSource::Known(shot.camera),
            Surface::new([0.8, 0.6]),
        )
    };
    let provenance = Provenance {
        scene_seed: 3,
        ..Provenance::from_scene(scene)
    };
    Ok(Sample {
        deep,
        provenance: Some(provenance),
        ..Sample::new(frame, labels)
    })
}

fn classes() -> Vec<String> {
    ["cap & label", "none"].map(String::from).to_vec()
}

/// Makes 12 samples with the formats and settings of a table `[labels]`.
fn made(labels: &str) -> tempfile::TempDir {
    made_of(labels, shot)
}

/// The same of other pictures.
fn made_of(labels: &str, shot: fn(u64) -> Shot) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let setup: LabelConfig = toml::from_str(labels).unwrap();
    let pictures = Pictures::default();
    let mut plan = Plan {
        folder: dir.path().into(),
        count: 12,
        range: SampleRange::All,
        seed: 3,
        recipe: serde_json::json!({}),
        classes: setup.obstructed.classes(&classes()).unwrap(),
        split: Split::default(),
        obstructed: setup.obstructed,
        writers: vec![Arc::new(pictures.clone()), Arc::new(Sidecar)],
        archives: None,
        store: None,
        inputs: Default::default(),
    };
    plan.writers.extend(setup.writers(&pictures));
    let options = setup.options;
    let sample = |k| sample_of(shot(k), &options);
    generate(&plan, sample, &|_| {}, &AtomicBool::new(false)).unwrap();
    dir
}

/// Pixels of the masks of each sample's objects, by the number and the object's: what a reader must
/// find again.
fn tell_pixels(folder: &Path) {
    let pixels = |k: u64| {
        let objects = sample(k).unwrap().labels.objects;
        objects.into_iter().map(move |o| {
            (
                format!("{k}/{}", o.id.0),
                o.amodal_mask.pixels().collect::<Vec<_>>(),
            )
        })
    };
    let all: BTreeMap<_, _> = (0..12).flat_map(pixels).collect();
    io::write_json(folder.join("pixels.json"), &all).unwrap();
}

#[test]
fn pycocotools_reads_run_lengths_and_polygons() {
    for masks in ["rle", "polygon"] {
        let dir = made(&format!(
            "obstructed = \"ignore\"\nformats = [\"coco\"]\ncoco = {{ masks = \"{masks}\" }}"
        ));
        tell_pixels(dir.path());
        python::check("coco", "pycocotools", dir.path());
    }
}

#[test]
fn ultralytics_takes_boxes_and_segments() {
    for (task, obstructed) in [("detect", "drop"), ("segment", "class")] {
        let dir = made(&format!(
            "obstructed = \"{obstructed}\"\nyolo = {{ task = \"{task}\" }}"
        ));
        python::check(task, "ultralytics.data.utils", dir.path());
    }
}

#[test]
fn yolov5_takes_boxes() {
    let dir = made("obstructed = \"keep\"");
    python::check("yolov5", "yolov5.utils.dataloaders", dir.path());
}

#[test]
fn a_voc_document_tells_class_box_and_flags() {
    let dir = made("obstructed = \"ignore\"\nformats = [\"voc\"]");
    let text = std::fs::read_to_string(dir.path().join("voc/train/000003.xml")).unwrap();
    let objects = sample(3).unwrap().labels.objects;
    assert_eq!(text.matches("<object>").count(), objects.len());
    let below = &text[text.find("<object>").unwrap()..text.find("</object>").unwrap()];
    let b = objects[0].amodal_box;
    assert!(
        below.contains(&format!("<xmin>{}</xmin>", b.x0 + 1.0))
            && below.contains(&format!("<ymax>{}</ymax>", b.y1))
    );
    for expected in [
        "<name>none</name>",
        "<difficult>1</difficult>",
        "<occluded>1</occluded>",
        "<truncated>0</truncated>",
    ] {
        assert!(below.contains(expected), "no {expected} in {below}");
    }
    assert!(
        text.contains("<name>cap &#38; label</name>") && text.contains("<truncated>1</truncated>")
    );
    assert_eq!(
        std::fs::read_to_string(dir.path().join("voc/val.txt")).unwrap(),
        "000000\n000005\n000010\n"
    );
}

/// What the files of a picture say of its objects, when those are labelled that are seen enough.
fn check_seen(folder: &Path, k: u64, min_visible: f64) -> SampleRecord {
    let part = if k.is_multiple_of(5) { "val" } else { "train" };
    let path = |kind: &str, end: &str| folder.join(format!("{kind}/{part}/{k:06}.{end}"));
    let record: SampleRecord = io::read_json(path("scenes", "json")).unwrap();
    let objects = record.labels.objects.iter();
    let seen = objects.filter(|object| object.uncovered_fraction.unwrap() >= min_visible);
    let seen: Vec<_> = seen.map(|object| object.id).collect();
    assert_eq!((&record.topmost, &record.labelled), (&seen, &seen));
    let text = |kind, end| std::fs::read_to_string(path(kind, end)).unwrap();
    assert_eq!(text("labels", "txt").lines().count(), seen.len());
    let voc = text("voc", "xml");
    assert_eq!(voc.matches("<occluded>0</occluded>").count(), seen.len());
    assert!(!voc.contains("<occluded>1</occluded>"));
    let document = folder.join(format!("annotations/instances_{part}.json"));
    let coco: serde_json::Value = io::read_json(document).unwrap();
    let annotations = coco["annotations"].as_array().unwrap().iter();
    let own: Vec<_> = annotations.filter(|a| a["image_id"] == k).collect();
    assert_eq!(own.len(), seen.len());
    assert!(own.iter().all(|a| a["topmost"] == true));
    record
}

#[test]
fn every_format_labels_the_objects_that_are_seen_enough() {
    for (min_visible, is_enough) in [(0.25, true), (0.9, false)] {
        // Of an object under a ring nothing is seen by this threshold.
        let dir = made(&format!(
            "alpha_threshold = 0.5\nmin_visible = {min_visible}\nformats = [\"yolo\", \"coco\", \"voc\"]"
        ));
        let records: Vec<_> = (0..12)
            .map(|k| check_seen(dir.path(), k, min_visible))
            .collect();
        let below = &records[3].labels.objects[0];
        assert_eq!(below.covered_by, [ObjectId(2)]);
        assert_eq!(
            below.is_topmost(),
            is_enough,
            "{}",
            below.uncovered_fraction.unwrap()
        );
    }
}

/// The annotations of picture 3.
fn annotations_of_third(folder: &Path) -> Vec<serde_json::Value> {
    let document = folder.join("annotations/instances_train.json");
    let coco: serde_json::Value = io::read_json(document).unwrap();
    let annotations = coco["annotations"].as_array().unwrap().iter();
    let own = annotations.filter(|a| a["image_id"] == 3);
    own.cloned().collect()
}

fn text_of(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

/// The pictures with the ring that lies over another a distractor.
fn shot_with_distractor(k: u64) -> Shot {
    let mut shot = shot(k);
    for card in shot.cards.iter_mut().filter(|card| card.id == ObjectId(2)) {
        card.class = None;
    }
    shot
}

#[test]
fn a_distractor_is_in_the_picture_and_the_sidecar_and_in_no_label() {
    let labels = "formats = [\"yolo\", \"coco\", \"voc\", \"layers\"]\nlayers = { cards = true }";
    let (plain, mixed) = (made(labels), made_of(labels, shot_with_distractor));
    let same = ["images/train/000003.png", "data.yaml"];
    for name in same {
        let bytes = |dir: &tempfile::TempDir| std::fs::read(dir.path().join(name)).unwrap();
        assert_eq!(bytes(&plain), bytes(&mixed), "{name}");
    }
    let record: SampleRecord =
        io::read_json(mixed.path().join("scenes/train/000003.json")).unwrap();
    let ids: Vec<_> = record.labels.objects.iter().map(|o| o.id.0).collect();
    assert_eq!((ids, record.labels.distractors[0].id.0), (vec![1, 3], 2));
    assert_eq!(record.labels.objects[0].covered_by, [ObjectId(2)]);
    assert_eq!(record.labelled, [ObjectId(3)]);
    let [only] = &annotations_of_third(mixed.path())[..] else {
        panic!("one annotation")
    };
    assert_eq!(only["category_id"], 2);
    assert_eq!(
        text_of(mixed.path(), "labels/train/000003.txt")
            .lines()
            .count(),
        1
    );
    let voc = text_of(mixed.path(), "voc/train/000003.xml");
    assert_eq!(voc.matches("<object>").count(), 1);
    let journal = text_of(mixed.path(), "index.jsonl");
    let line = journal
        .lines()
        .find(|line| line.contains("\"k\":3,"))
        .unwrap();
    assert!(
        line.contains("\"classes\":[[0,0],[2,1]],\"obstructed\":1"),
        "{line}"
    );
    // Its light is in the picture, so it has layers; its name says what it is.
    let exr = std::fs::read(mixed.path().join("layers/train/000003.exr")).unwrap();
    let names = String::from_utf8_lossy(&exr);
    assert!(names.contains("object002_distractor") && names.contains("object002.R"));
}

/// The pictures with two small rings under the second one, the latter of which looks out.
fn shot_with_hidden(k: u64) -> Shot {
    shot(k)
        .with_card(card(4, [0.118, 0.03, 0.01], 0.0, [0.03, 0.03]))
        .with_card(card(5, [0.16, 0.03, 0.01], 0.0, [0.06, 0.06]))
}

#[test]
fn labels_of_what_is_seen_have_its_box_and_leave_out_what_is_hidden() {
    let dir = made_of(
        "obstructed = \"keep\"\nalpha_threshold = 0.5\nformats = [\"yolo\", \"coco\", \"voc\"]\n\
         yolo = { boxes = \"visible\" }\ncoco = { boxes = \"visible\" }\nvoc = { boxes = \"visible\" }",
        shot_with_hidden,
    );
    let record: SampleRecord = io::read_json(dir.path().join("scenes/train/000003.json")).unwrap();
    let objects = record.labels.objects.iter();
    let seen: Vec<_> = objects.filter(|o| !o.visible_box.is_empty()).collect();
    assert!(seen.iter().any(|o| o.visible_box != o.amodal_box));
    assert_eq!(record.labelled, [1, 2, 3, 5].map(ObjectId));
    let boxes: Vec<_> = seen.iter().map(|o| o.visible_box).collect();
    let rows: String = seen
        .iter()
        .map(|o| {
            let (b, center) = (o.visible_box, o.visible_box.center());
            let shares = [
                center.x / 96.0,
                center.y / 72.0,
                b.width() / 96.0,
                b.height() / 72.0,
            ];
            let shares = shares.map(|share| format!(" {share:.6}")).concat();
            format!("{}{shares}\n", o.class)
        })
        .collect();
    assert_eq!(text_of(dir.path(), "labels/train/000003.txt"), rows);
    let annotations = annotations_of_third(dir.path());
    let told: Vec<Vec<f64>> = annotations
        .iter()
        .map(|a| serde_json::from_value(a["bbox"].clone()).unwrap())
        .collect();
    let expected = boxes
        .iter()
        .map(|b| vec![b.x0, b.y0, b.width(), b.height()]);
    assert_eq!(told, expected.collect::<Vec<_>>());
    let voc = text_of(dir.path(), "voc/train/000003.xml");
    let sides = |name: &str| -> Vec<f64> {
        let start = format!("<{name}>");
        let elements = voc.split(&start).skip(1);
        elements
            .map(|rest| rest.split('<').next().unwrap().parse().unwrap())
            .collect()
    };
    assert_eq!(
        sides("xmin"),
        boxes.iter().map(|b| b.x0 + 1.0).collect::<Vec<_>>()
    );
    assert_eq!(
        sides("ymax"),
        boxes.iter().map(|b| b.y1).collect::<Vec<_>>()
    );
    let journal = text_of(dir.path(), "index.jsonl");
    let line = journal.lines().find(|line| line.contains("\"k\":3,"));
    assert!(
        line.unwrap().contains("\"classes\":[[2,1],[3,3]]"),
        "{line:?}"
    );
}

#[test]
fn formats_tell_truncation_and_both_boxes_where_they_are_asked_for() {
    let formats = "formats = [\"yolo\", \"coco\", \"voc\"]";
    let keys = ["truncation", "amodal_bbox", "visible_bbox"];
    let plain = made(formats);
    let cut = |folder: &Path| {
        let annotations = annotations_of_third(folder).into_iter();
        annotations
            .filter(|a| a["id"] == 3 * 65536 + 3)
            .collect::<Vec<_>>()
    };
    assert!(
        keys.iter()
            .all(|key| cut(plain.path())[0].get(key).is_none())
    );
    let dir = made(&format!("max_truncation = 0.9\n{formats}"));
    let told = &cut(dir.path())[0];
    let numbers = |key: &str| -> Vec<f64> { serde_json::from_value(told[key].clone()).unwrap() };
    let right = |b: &[f64]| b[0] + b[2];
    assert!(
        (0.05..0.6).contains(&told["truncation"].as_f64().unwrap()),
        "{told}"
    );
    assert!(right(&numbers("amodal_bbox")) > 97.0, "{told}");
    assert_eq!(right(&numbers("bbox")), 96.0);
    assert_eq!(right(&numbers("visible_bbox")), 96.0);
    let voc = |folder: &Path| text_of(folder, "voc/train/000003.xml");
    assert_eq!(
        voc(dir.path()).matches("<truncated>1</truncated>").count(),
        1
    );
    // The other files are as they were, but for the hash of the settings in the sidecar.
    for name in ["labels/train/000003.txt", "voc/train/000003.xml"] {
        assert_eq!(text_of(plain.path(), name), text_of(dir.path(), name));
    }
    let strict = made(&format!("max_truncation = 0.05\n{formats}"));
    assert!(cut(strict.path()).is_empty() && !voc(strict.path()).contains("<truncated>1"));
    let rows = |dir: &tempfile::TempDir| text_of(dir.path(), "labels/train/000003.txt");
    assert_eq!(
        rows(&strict).lines().count() + 1,
        rows(&plain).lines().count()
    );
    let ignoring = format!("obstructed = \"ignore\"\nmax_truncation = 0.05\n{formats}");
    assert_eq!(cut(made(&ignoring).path())[0]["iscrowd"], 1);
}

#[test]
fn an_archive_holds_the_files_of_its_samples_in_order() {
    let dir = made("formats = [\"webdataset\", \"coco\", \"yolo\"]\nwebdataset = { samples = 4 }");
    let names = |archive: &str| {
        let file = std::fs::File::open(dir.path().join("webdataset").join(archive)).unwrap();
        let mut tar = tar::Archive::new(file);
        let paths = tar
            .entries()
            .unwrap()
            .map(|entry| entry.unwrap().path().unwrap().into_owned());
        paths.collect::<Vec<PathBuf>>()
    };
    let expected = [5, 10]
        .map(|k| ["png", "json", "txt", "coco.json"].map(|e| PathBuf::from(format!("{k:09}.{e}"))));
    let val = [1, 2].map(|i| names(&format!("val-{i:06}.tar")));
    assert_eq!(val, expected);
    assert_eq!(
        [0, 1, 2].map(|i| names(&format!("train-{i:06}.tar")).len()),
        [12, 12, 12]
    );
    assert!(!dir.path().join("webdataset/train-000003.tar").exists());
}

#[test]
fn webdataset_reads_archives() {
    let dir = made("formats = [\"webdataset\", \"coco\", \"yolo\"]\nwebdataset = { samples = 4 }");
    python::check("webdataset", "webdataset", dir.path());
}

#[test]
fn kubernetes_takes_the_job_of_the_examples() {
    let cluster = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cluster");
    python::check("kubernetes", "kubernetes_validate", &cluster);
}

#[test]
fn layers_add_up_to_the_picture_and_ids_to_what_is_seen() {
    let dir = made("formats = [\"layers\"]\nlayers = { cards = true }");
    let ((w, h), channels) = read_channels(dir.path().join("layers/train/000003.exr")).unwrap();
    let plane = |name: &str| {
        &channels
            .iter()
            .find(|c| c.name == name)
            .unwrap_or_else(|| panic!("no {name}"))
            .samples
    };
    assert_eq!([w as u32, h as u32], IMAGE);
    let plate = 0.3;
    for i in 0..w * h {
        let sum = |channel: &str| {
            (1..4)
                .map(|id| plane(&format!("object{id:03}.{channel}"))[i])
                .sum::<f32>()
        };
        let behind = plate * plane("shadow.R")[i] * (1.0 - sum("A"));
        assert!((plane("R")[i] - sum("R") - behind).abs() < 1e-5);
        let coverage: f32 = ["00.G", "00.A", "01.G"]
            .map(|c| plane(&format!("CryptoObject{c}"))[i])
            .iter()
            .sum();
        assert!((coverage - sum("A")).abs() < 1e-6);
        let is_seen = plane("Z")[i].is_finite();
        assert!(is_seen == (1..4).any(|id| plane(&format!("object{id:03}.A"))[i] > 0.1));
        assert!(!is_seen || (0.85..1.05).contains(&plane("Z")[i]));
    }
}

#[test]
fn the_depth_of_layers_is_where_a_mask_is() {
    let dir = made("alpha_threshold = 0.6\nformats = [\"layers\"]");
    let (_, channels) = read_channels(dir.path().join("layers/train/000003.exr")).unwrap();
    let depths = &channels.iter().find(|c| c.name == "Z").unwrap().samples;
    let record: SampleRecord = io::read_json(dir.path().join("scenes/train/000003.json")).unwrap();
    let mut is_in_mask = vec![false; depths.len()];
    for (x, y) in record
        .labels
        .objects
        .iter()
        .flat_map(|o| o.visible_mask.pixels())
    {
        is_in_mask[(y * IMAGE[0] + x) as usize] = true;
    }
    let has_depth: Vec<_> = depths.iter().map(|depth| depth.is_finite()).collect();
    assert_eq!(has_depth, is_in_mask);
}

#[test]
fn what_is_too_faint_for_a_label_has_its_layer() {
    let layers = |threshold: f32| {
        let dir = made(&format!(
            "alpha_threshold = {threshold}\nformats = [\"layers\"]\nlayers = {{ cards = true }}"
        ));
        let record: SampleRecord =
            io::read_json(dir.path().join("scenes/train/000003.json")).unwrap();
        let path = dir.path().join("layers/train/000003.exr");
        let mut texts = io::read_header(&path).unwrap().metadata;
        texts.retain(|(key, _)| key.starts_with("cryptomatte/"));
        let (_, mut channels) = read_channels(path).unwrap();
        channels.retain(|channel| channel.name != "Z");
        (record.labels.objects.len(), (texts, channels))
    };
    let ((labels, plain), (strict_labels, strict)) = (layers(0.1), layers(0.999));
    assert_eq!((labels, strict_labels), (3, 0));
    assert!(plain == strict);
}

#[test]
fn a_mask_is_what_the_layer_of_its_object_shows() {
    let dir = made("formats = [\"layers\"]\nlayers = { cards = true }");
    let (_, channels) = read_channels(dir.path().join("layers/train/000007.exr")).unwrap();
    for object in sample(7).unwrap().labels.objects {
        let plane = |layer: &str| {
            channels
                .iter()
                .find(|p| p.name == format!("{layer}{:03}.A", object.id.0))
                .unwrap()
        };
        for (layer, mask) in [
            ("amodal", &object.amodal_mask),
            ("object", &object.visible_mask),
        ] {
            let alpha = |x: u32, y: u32| plane(layer).samples[(y * IMAGE[0] + x) as usize];
            assert_eq!(
                *mask,
                petcomp::label::RleMask::from_fn(IMAGE, |x, y| alpha(x, y) > 0.1)
            );
        }
        assert!(object.visible_mask.pixels().count() <= object.amodal_mask.pixels().count());
        assert!(object.depth.near <= object.depth.mean && object.depth.mean <= object.depth.far);
    }
}

#[test]
fn a_box_is_that_of_the_object_rendered_alone() {
    for k in [3, 7, 11] {
        let shot = shot(k);
        let together = sample(k).unwrap().labels;
        for card in &shot.cards {
            let alone = Shot {
                cards: vec![card.clone()],
                ..shot.clone()
            };
            let alone = label(
                &render::render(&alone, &Default::default()),
                &alone,
                &LabelOptions::default(),
            );
            let object = together.objects.iter().find(|o| o.id == card.id).unwrap();
            let (a, b) = (object.amodal_box, alone.objects[0].visible_box);
            let off = [a.x0 - b.x0, a.y0 - b.y0, a.x1 - b.x1, a.y1 - b.y1].map(f64::abs);
            // What hides it may change the rounding of a pixel at the threshold.
            assert!(off.iter().all(|&side| side <= 1.0), "{a:?} {b:?}");
        }
    }
}

#[test]
fn an_obstructed_class_is_the_last_and_has_the_obstructed() {
    let dir = made("obstructed = \"class\"");
    let yaml = std::fs::read_to_string(dir.path().join("data.yaml")).unwrap();
    assert!(
        yaml.contains("nc: 3") && yaml.ends_with("  2: \"obstructed\"\n"),
        "{yaml}"
    );
    let rows = std::fs::read_to_string(dir.path().join("labels/train/000003.txt")).unwrap();
    let first: Vec<_> = rows.lines().map(|row| &row[..1]).collect();
    assert_eq!(first, ["2", "0", "1"]);
    assert_eq!(Obstructed::default(), Obstructed::Drop);
}
