//! A dataset's folder: the same bytes whoever made it and however often they were stopped, and
//! trainers accept it.

#![cfg(feature = "pipeline")]

use petcomp::DeepImage;
use petcomp::camera::Camera;
use petcomp::dataset::index::DatasetIndex;
use petcomp::dataset::{
    ArchiveStore, Coco, DatasetConfig, DatasetCounts, Group, LabelConfig, NEAR_DUPLICATE_RMS,
    Obstructed, Part, Partition, PictureFormat, Pictures, Pipeline, Plan, Progress, Provenance,
    Sample, SampleRange, SampleRecord, Shard, Sidecar, Split, SplitOrder, Summary, WebDataset,
    Writer, Yolo, YoloSet, YoloTask, check, contact_sheet_of, generate, merge, repair,
    repair_archives,
};
use petcomp::eval::{label_of, read_yolo_truth_of};
use petcomp::geom::BBox;
use petcomp::geom::{Point2, Pose, UnitQuaternion, Vector2};
use petcomp::label::{Labels, ObjectLabel, RleMask};
use petcomp::scene::{CameraSource, EdgeTreatment, Exposure, Object, Placement, Surface};
use petcomp::{Coverage, Error, Image, LinearRgb, ObjectId, PremulRgba, Result, Scene, io};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

const IMAGE: [u32; 2] = [64, 48];

fn scene(k: u64) -> Scene {
    let camera = Camera {
        image: IMAGE,
        focal_px: Vector2::new(100.0 / 3.0, 0.1 + k as f64),
        principal_px: Point2::new(32.0, 24.0),
        camera_from_world: Pose::identity(),
    };
    Scene {
        plate: "tray".into(),
        ambient: LinearRgb::grey(0.1),
        ..Scene::new(IMAGE, CameraSource::Known(camera), Surface::new([0.4, 0.3]))
    }
}

/// An object of 12 x 9 pixels at a place, under `covered_by`.
fn object(id: u32, class: u32, [x, y]: [f64; 2], covered_by: &[u32]) -> ObjectLabel {
    let b = BBox {
        x0: x,
        y0: y,
        x1: x + 12.0,
        y1: y + 9.0,
    };
    let corners = [[b.x0, b.y0], [b.x1, b.y0], [b.x1, b.y1], [b.x0, b.y1]];
    ObjectLabel {
        id: ObjectId(id),
        class,
        outline_px: vec![corners.map(|[x, y]| Point2::new(x, y)).to_vec()],
        amodal_box: b,
        visible_box: b,
        amodal_mask: mask(&b),
        visible_mask: mask(&b),
        visible_fraction: 1.0,
        covered_by: covered_by.iter().map(|&id| ObjectId(id)).collect(),
        ..ObjectLabel::default()
    }
}

fn mask(b: &BBox) -> RleMask {
    let inside = |v: u32, from: f64, to: f64| (from..to).contains(&f64::from(v));
    RleMask::from_fn(IMAGE, |x, y| inside(x, b.x0, b.x1) && inside(y, b.y0, b.y1))
}

/// Sample k: noise that depends on k, with k mod 4 objects, of which the second lies under the
/// first.
fn sample(k: u64) -> Result<Sample> {
    let value =
        |x: usize, y: usize| ((x as u64 * 31 + y as u64 * 17 + k * 7919) % 97) as f32 / 97.0;
    let frame = Image::from_fn(IMAGE[0] as usize, IMAGE[1] as usize, |x, y| {
        LinearRgb::grey(value(x, y)).opaque()
    });
    let place = |i: u64| [(5 * i + k % 30) as f64, (10 * i) as f64];
    let under = |i: u64| if i == 1 { &[1][..] } else { &[] };
    let objects = (0..k % 4).map(|i| object(i as u32 + 1, (k + i) as u32 % 3, place(i), under(i)));
    let labels = Labels {
        image: IMAGE,
        objects: objects.collect(),
        ..Labels::default()
    };
    let drawn = Scene {
        exposure: Exposure::MatchPlate { gain_ev: 0.1 },
        ..scene(k)
    };
    let rejected = vec!["two bodies overlap".to_owned(); (k % 3) as usize];
    let nothing = Image::filled(IMAGE[0] as usize, IMAGE[1] as usize, LinearRgb::WHITE);
    let deep = DeepImage::from_pixels(nothing, vec![vec![]; frame.pixels().len()]);
    Ok(Sample {
        deep,
        provenance: Some(Provenance {
            drawn,
            scene: scene(k),
            scene_seed: k ^ 7,
            rejected,
            draws: vec![],
        }),
        ..Sample::new(frame, labels)
    })
}

fn plan(folder: &Path, count: u64) -> Plan {
    Plan {
        folder: folder.into(),
        count,
        range: SampleRange::All,
        seed: 7,
        recipe: serde_json::json!({ "objects": { "count": [5, 30] }, "hue_deg": 0.1 }),
        classes: ["cap_label", "cap", "label"].map(String::from).to_vec(),
        split: Split::default(),
        obstructed: Obstructed::Drop,
        writers: vec![
            Arc::new(Pictures::default()),
            Arc::new(Yolo::default()),
            Arc::new(Sidecar),
        ],
        archives: None,
        store: None,
        inputs: Default::default(),
    }
}

/// The same with every format.
fn full_plan(folder: &Path, count: u64) -> Plan {
    let formats = r#"formats = ["yolo", "coco", "voc", "webdataset", "layers"]
        webdataset = { samples = 3 }"#;
    let labels: LabelConfig = toml::from_str(formats).unwrap();
    let mut plan = plan(folder, count);
    plan.writers.truncate(1);
    plan.writers.push(Arc::new(Sidecar));
    plan.writers.extend(labels.writers(&Pictures::default()));
    plan
}

fn make(plan: &Plan) -> Result<DatasetCounts> {
    make_of(plan, sample)
}

/// The same of other samples.
fn make_of(plan: &Plan, sample: impl Fn(u64) -> Result<Sample> + Sync) -> Result<DatasetCounts> {
    generate(plan, sample, &|_| {}, &AtomicBool::new(false))
}

/// A folder with a dataset of so many samples.
fn made(count: u64) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    make(&plan(dir.path(), count)).unwrap();
    dir
}

fn threads<T: Send>(n: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(n)
        .build()
        .unwrap()
        .install(f)
}

/// Every file below a folder and its bytes, but for the lock and the notes of how long runs took.
fn bytes(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(dir) = folders.pop() {
        for entry in std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()) {
            let hidden = entry
                .file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with('.'));
            if entry.is_dir() {
                folders.push(entry);
            } else if !hidden {
                files.insert(
                    entry.strip_prefix(folder).unwrap().into(),
                    std::fs::read(&entry).unwrap(),
                );
            }
        }
    }
    files
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn faults(folder: &Path) -> Vec<String> {
    check(folder)
        .unwrap()
        .findings
        .iter()
        .map(ToString::to_string)
        .collect()
}

#[test]
fn a_dataset_has_the_files_that_trainers_read() {
    let dir = tempfile::tempdir().unwrap();
    let report = make(&plan(dir.path(), 12)).unwrap();
    assert_eq!(
        text(dir.path(), "labels/train/000001.txt"),
        "1 0.109375 0.093750 0.187500 0.187500\n"
    );
    assert_eq!(text(dir.path(), "labels/train/000004.txt"), "");
    assert!(text(dir.path(), "data.yaml").ends_with(
        "train: images/train\nval: images/val\nnc: 3\nnames:\n  0: \"cap_label\"\n  1: \"cap\"\n  2: \"label\"\n"
    ));
    assert!(
        dir.path().join("images/val/000005.png").is_file()
            && dir.path().join("labels/val/000005.txt").is_file()
    );
    assert_eq!(faults(dir.path()), [""; 0]);
    assert_eq!(
        (report.images, report.val, report.made, report.objects),
        (12, 3, 12, 18)
    );
    assert_eq!(
        (
            report.labelled,
            report.dropped(),
            report.obstructed,
            report.retries
        ),
        (12, 6, 6, 12)
    );
    assert_eq!(report.for_trainers, [Path::new("data.yaml")]);
    assert_eq!(check(dir.path()).unwrap().rows.iter().sum::<usize>(), 12);
    assert_eq!(report.classes.iter().map(|c| c.labelled).sum::<u64>(), 12);
}

#[test]
fn the_bytes_are_the_same_at_any_number_of_threads() {
    let (one, four) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    threads(1, || make(&full_plan(one.path(), 40))).unwrap();
    threads(4, || make(&full_plan(four.path(), 40))).unwrap();
    assert_eq!(bytes(one.path()), bytes(four.path()));
}

#[test]
fn a_stopped_run_goes_on_to_the_same_bytes() {
    let (whole, broken) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(&full_plan(whole.path(), 30)).unwrap();
    let stop = AtomicBool::new(false);
    let after_some = |p: Progress| stop.store(p.made >= 7, Ordering::Relaxed);
    let e = threads(3, || {
        generate(&full_plan(broken.path(), 30), sample, &after_some, &stop)
    })
    .unwrap_err();
    assert!(
        matches!(e, Error::Interrupted { .. }) && e.to_string().contains("of 30 samples are in"),
        "{e}"
    );

    // What a kill may leave: a torn line, half a file, a temporary file, a file whose line never
    // came.
    let journal = broken.path().join("index.jsonl");
    let lines = std::fs::read_to_string(&journal).unwrap();
    let finished = lines.lines().count();
    assert!((7..=9).contains(&finished), "{finished}");
    std::fs::write(&journal, &lines[..lines.len() - 20]).unwrap();
    std::fs::write(broken.path().join("images/train/000001.png"), b"half").unwrap();
    std::fs::write(broken.path().join("images/train/.petcomp-x1.tmp"), b"half").unwrap();
    std::fs::write(broken.path().join("labels/train/000029.txt"), b"9 9 9").unwrap();

    let made = AtomicU64::new(0);
    let counted = |k| {
        made.fetch_add(1, Ordering::Relaxed);
        sample(k)
    };
    let report = make_of(&full_plan(broken.path(), 30), counted).unwrap();
    assert_eq!(
        (report.made, made.into_inner()),
        (30 - finished as u64 + 2, 30 - finished as u64 + 2)
    );
    assert_eq!(
        report,
        DatasetCounts {
            made: report.made,
            ..make(&full_plan(whole.path(), 30)).unwrap()
        }
    );
    assert_eq!(bytes(whole.path()), bytes(broken.path()));
}

/// Other systems put each file on the disk by itself.
#[cfg(all(feature = "counters", target_os = "linux"))]
#[test]
fn samples_are_put_on_the_disk_together() {
    use petcomp::work::{Kind, counted};
    let alone = |count| {
        let dir = tempfile::tempdir().unwrap();
        let (made, work) = counted(|| make(&full_plan(dir.path(), count))).unwrap();
        assert_eq!(made.unwrap().made, count);
        work[Kind::SyncedFiles]
    };
    assert_eq!(alone(5), alone(3));
}

#[test]
fn a_finished_dataset_is_left_alone() {
    let dir = made(5);
    let before = bytes(dir.path());
    let never = |_| -> Result<Sample> { panic!("nothing is missing") };
    let report = make_of(&plan(dir.path(), 5), never).unwrap();
    assert_eq!((report.images, report.made), (5, 0));
    assert_eq!(before, bytes(dir.path()));
}

#[test]
fn a_dataset_may_grow() {
    let (grown, at_once) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(&full_plan(grown.path(), 5)).unwrap();
    assert_eq!(make(&full_plan(grown.path(), 12)).unwrap().made, 7);
    make(&full_plan(at_once.path(), 12)).unwrap();
    assert_eq!(bytes(grown.path()), bytes(at_once.path()));
}

#[test]
fn what_joins_samples_is_of_all_of_them_or_not_there() {
    let dir = tempfile::tempdir().unwrap();
    make(&full_plan(dir.path(), 5)).unwrap();
    let notes = dir.path().join("webdataset/notes.txt");
    std::fs::write(&notes, "mine").unwrap();
    let joined = [
        "annotations/instances_train.json",
        "voc/train.txt",
        "webdataset/train-000000.tar",
    ];
    let there = || joined.map(|file| dir.path().join(file).exists());
    let one = |k| Plan {
        range: SampleRange::One(k),
        ..full_plan(dir.path(), k + 1)
    };
    make(&one(4)).unwrap();
    assert_eq!(there(), [true; 3], "nothing was added");
    let report = make(&one(9)).unwrap();
    assert_eq!(report.for_trainers, [Path::new("data.yaml")]);
    assert_eq!(there(), [false; 3]);
    make(&full_plan(dir.path(), 10)).unwrap();
    assert_eq!(there(), [true; 3]);
    assert!(notes.exists());
}

#[test]
fn another_plan_in_the_same_folder_is_refused_by_name() {
    let dir = made(3);
    let before = bytes(dir.path());
    let refused = |change: &dyn Fn(&mut Plan)| {
        let mut plan = plan(dir.path(), 3);
        change(&mut plan);
        make(&plan).unwrap_err().to_string()
    };
    let seed = refused(&|p| p.seed = 8);
    assert!(
        seed.ends_with(
            "dataset.json: seed: the dataset was started with 7, this run has 8; expected the same, \
             or a new folder"
        ),
        "{seed}"
    );
    let recipe = refused(&|p| p.recipe["objects"]["count"][1] = 20.into());
    assert!(
        recipe
            .contains("recipe.objects.count[1]: the dataset was started with 30, this run has 20"),
        "{recipe}"
    );
    assert!(
        refused(&|p| p.recipe["light"] = true.into())
            .contains("recipe.light: the dataset was started without it, this run has true")
    );
    assert!(refused(&|p| p.obstructed = Obstructed::Keep).contains("obstructed"));
    assert!(refused(&|p| p.writers = vec![Arc::new(Yolo::default())]).contains("writers"));
    assert!(
        refused(&|p| p.split = Split {
            val_percent: 20,
            order: SplitOrder::Consecutive,
            ..Split::default()
        })
        .contains("split.order")
    );
    assert_eq!(before, bytes(dir.path()));
}

#[test]
fn folders_that_are_something_else_are_refused_and_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("photo.png");
    std::fs::write(&file, b"mine").unwrap();
    for (folder, what) in [
        (file.clone(), "is a file"),
        (file.join("out"), "is a file"),
        (dir.path().into(), "is not empty"),
    ] {
        let e = make(&plan(&folder, 3)).unwrap_err().to_string();
        assert!(e.contains(what), "{e}");
    }
    assert_eq!(
        bytes(dir.path()),
        BTreeMap::from([("photo.png".into(), b"mine".to_vec())])
    );
}

#[test]
fn one_run_at_a_time_writes_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let second = |_| {
        let e = make(&plan(dir.path(), 1)).unwrap_err().to_string();
        assert!(e.contains("another run is writing"), "{e}");
    };
    generate(
        &plan(dir.path(), 1),
        sample,
        &second,
        &AtomicBool::new(false),
    )
    .unwrap();
}

#[test]
fn a_failing_sample_ends_the_run_and_keeps_the_others() {
    let dir = tempfile::tempdir().unwrap();
    let fails = |k| {
        if k == 6 {
            Err(Error::value("objects", "would not settle"))
        } else {
            sample(k)
        }
    };
    let e = threads(1, || make_of(&plan(dir.path(), 20), fails)).unwrap_err();
    assert_eq!(e.to_string(), "objects: would not settle");
    assert_eq!(text(dir.path(), "index.jsonl").lines().count(), 6);
    assert_eq!(make(&plan(dir.path(), 20)).unwrap().made, 14);
}

#[test]
fn what_a_writer_cannot_hold_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let run = |change: &(dyn Fn(&mut Sample) + Sync)| {
        let made = |k| {
            let mut made = sample(k)?;
            change(&mut made);
            Ok(made)
        };
        let refused = make_of(&plan(dir.path(), 1), made);
        refused.unwrap_err().to_string()
    };
    let odd = run(&|s| s.labels.objects = vec![object(1, 3, [0.0; 2], &[])]);
    assert_eq!(odd, "labels.objects[0].class: 3, but there are 3 classes");
    assert!(run(&|s| s.labels.image = [63, 48]).starts_with("labels.image: 63 x 48"));
    let small = run(&|s| {
        s.frame = Image::new(9, 40);
        s.labels = Labels {
            image: [9, 40],
            ..Labels::default()
        };
    });
    assert_eq!(
        small,
        "image: 9 x 40 pixels, expected at least 10 a side for YOLO"
    );
}

#[test]
fn obstructed_objects_are_kept_on_request_and_twins_written_once() {
    let dir = tempfile::tempdir().unwrap();
    let mut plan = plan(dir.path(), 1);
    plan.obstructed = Obstructed::Keep;
    let twins = |_| {
        let mut s = sample(0)?;
        s.labels.objects = vec![
            object(1, 0, [0.0, 0.0], &[]),
            object(2, 0, [0.0, 0.0], &[1]),
            object(3, 0, [52.0, 39.0], &[]),
        ];
        Ok(s)
    };
    let report = make_of(&plan, twins).unwrap();
    assert_eq!(
        (report.objects, report.labelled, report.obstructed),
        (3, 3, 1)
    );
    let rows = "0 0.093750 0.093750 0.187500 0.187500\n0 0.906250 0.906250 0.187500 0.187500\n";
    assert_eq!(text(dir.path(), "labels/val/000000.txt"), rows);
}

#[test]
fn what_has_no_mask_is_labelled_where_a_box_is_written_alone() {
    let thin = |k| {
        let mut s = sample(k)?;
        let whole = object(1, 0, [0.0, 0.0], &[]);
        let faint = ObjectLabel {
            amodal_mask: RleMask::from_fn(IMAGE, |_, _| false),
            ..object(2, 1, [30.0, 20.0], &[])
        };
        s.labels.objects = vec![whole, faint];
        Ok(s)
    };
    let segments = Yolo {
        task: YoloTask::Segment,
        ..Yolo::default()
    };
    for (yolo, count) in [(segments, 1), (Yolo::default(), 2)] {
        let dir = tempfile::tempdir().unwrap();
        let mut plan = plan(dir.path(), 1);
        plan.writers = vec![Arc::new(yolo), Arc::new(Coco::default())];
        let report = make_of(&plan, thin).unwrap();
        assert_eq!((report.objects, report.labelled), (2, count));
        let rows = text(dir.path(), "labels/val/000000.txt");
        assert_eq!(rows.lines().count() as u64, count);
        let coco = text(dir.path(), "annotations/instances_val.json");
        assert_eq!(coco.matches("\"area\"").count(), 1);
    }
}

#[test]
fn objects_in_a_circle_are_counted_and_none_of_them_is_on_top() {
    let dir = tempfile::tempdir().unwrap();
    let circle = |k| {
        let mut s = sample(k)?;
        s.labels.objects = [(1, 3), (2, 1), (3, 2)]
            .map(|(id, over)| object(id, 0, [6.0 * id as f64; 2], &[over]))
            .into();
        s.labels.objects.push(object(4, 1, [40.0; 2], &[]));
        Ok(s)
    };
    let report = make_of(&plan(dir.path(), 2), circle).unwrap();
    assert_eq!((report.knotted, report.objects, report.labelled), (6, 8, 2));
    let record: SampleRecord = io::read_json(dir.path().join("scenes/train/000001.json")).unwrap();
    assert_eq!(
        (record.knotted, record.topmost),
        ([1, 2, 3].map(ObjectId).to_vec(), vec![ObjectId(4)])
    );
}

#[test]
fn segments_hold_borders_and_jpegs_are_accepted() {
    let dir = tempfile::tempdir().unwrap();
    let mut plan = plan(dir.path(), 8);
    plan.writers = vec![
        Arc::new(Pictures {
            format: PictureFormat::Jpg,
            exr: true,
            ..Pictures::default()
        }),
        Arc::new(Yolo {
            task: YoloTask::Segment,
            ..Yolo::default()
        }),
    ];
    make(&plan).unwrap();
    let row = "1 0.015625 0.000000 0.203125 0.000000 0.203125 0.187500 0.015625 0.187500\n";
    let sorted = |text: &str| {
        let mut points: Vec<_> = text.split_whitespace().skip(1).map(String::from).collect();
        points.sort();
        points
    };
    assert_eq!(
        sorted(&text(dir.path(), "labels/train/000001.txt")),
        sorted(row)
    );
    assert_eq!(faults(dir.path()), [""; 0]);
    // A rectangle has no corner to spare.
    let simplified = tempfile::tempdir().unwrap();
    let yolo = Yolo {
        task: YoloTask::Segment,
        simplify: 2.0,
        ..Yolo::default()
    };
    make(&Plan {
        folder: simplified.path().into(),
        writers: vec![Arc::new(yolo)],
        ..plan
    })
    .unwrap();
    assert_eq!(
        sorted(&text(simplified.path(), "labels/train/000001.txt")),
        sorted(row)
    );
    let exr: Image<PremulRgba> = io::read(dir.path().join("exr/train/000001.exr")).unwrap();
    assert_eq!(exr.size(), (64, 48));
}

#[test]
fn a_sidecar_reads_back_bit_by_bit() {
    let dir = made(4);
    let record: SampleRecord = io::read_json(dir.path().join("scenes/train/000003.json")).unwrap();
    let made = sample(3).unwrap();
    let provenance = made.provenance.unwrap();
    assert_eq!(
        (record.scene, record.labels, record.drawn),
        (provenance.scene, made.labels, provenance.drawn)
    );
    assert_eq!(
        (record.seed, record.index, record.labelled),
        (7, 3, vec![ObjectId(1), ObjectId(3)])
    );
}

#[test]
fn a_check_finds_every_fault_and_its_place() {
    let dir = made(12);
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let row = "0 0.5 0.5 0.1 0.1";
    write(
        "labels/train/000001.txt",
        &format!("{row}\n0 0.5 0.5 0.1\n3 0.5 0.5 0.1 0.1\n{row}\n"),
    );
    write(
        "labels/train/000002.txt",
        "0 0.5 1.1 0.1 0.1\n0 0.5 0.5 0 0.1\n0.5 0.5 0.5 0.1 0.1\n0 a 0.5 0.1 0.1\n-1 0 0 1 1\n",
    );
    write(
        "labels/train/000003.txt",
        &format!("{row}\n0 0.1 0.1 0.2 0.2 0.3 0.3\n0 0.1 0.1 0.1 0.2 0.1 0.3\n"),
    );
    // Trainers know an outline by the box around it.
    write(
        "labels/train/000008.txt",
        "0 0.1 0.1 0.3 0.1 0.3 0.3\n0 0.1 0.3 0.1 0.1 0.3 0.3\n",
    );
    write("labels/train/000099.txt", "");
    std::fs::remove_file(dir.path().join("labels/train/000004.txt")).unwrap();
    let whole = std::fs::read(dir.path().join("images/val/000005.png")).unwrap();
    std::fs::write(
        dir.path().join("images/val/000005.png"),
        &whole[..whole.len() / 2],
    )
    .unwrap();
    std::fs::copy(
        dir.path().join("images/train/000006.png"),
        dir.path().join("images/val/000010.png"),
    )
    .unwrap();
    io::write(
        dir.path().join("images/train/000007.png"),
        &Image::<LinearRgb>::new(9, 30),
    )
    .unwrap();

    let found = faults(dir.path()).join("\n");
    for expected in [
        "labels/train/000001.txt:2: 4 columns, expected 5",
        "labels/train/000001.txt:3: class 3, expected one of the 3 that data.yaml names, numbered from 0",
        "labels/train/000001.txt:4: duplicates an earlier row [dataset.duplicate_label_row]",
        "labels/train/000002.txt:1: 1.1, expected a fraction of the image, 0 to 1",
        "labels/train/000002.txt:2: a box of 0 x 0.1, expected sides above 0",
        "labels/train/000002.txt:3: class 0.5, expected an integer from 0 [dataset.bad_label_row]",
        "labels/train/000002.txt:4: \"a\", expected a number",
        "labels/train/000002.txt:5: class -1, expected an integer from 0",
        "labels/train/000003.txt:1: 5 columns, expected a class and at least 3 pairs",
        "labels/train/000003.txt:3: an outline of 0 x ",
        "labels/train/000008.txt:2: duplicates an earlier row",
        "labels/train/000004.txt: missing",
        "labels/train/000099.txt: no image with this name",
        "images/val/000005.png: ",
        "images/val/000010.png: leak: the same bytes as images/train/000006.png",
        "images/train/000007.png: 9 x 30 pixels, expected at least 10 a side",
        "index.jsonl:2: labels/train/000001.txt has ",
        "index.jsonl:5: labels/train/000004.txt is missing",
    ] {
        assert!(found.contains(expected), "no `{expected}` in\n{found}");
    }
}

#[test]
fn images_in_folders_of_a_part_have_labels_in_folders() {
    let dir = made(12);
    let path = |name: &str| dir.path().join(name);
    std::fs::remove_file(path("index.jsonl")).unwrap();
    for (kind, file) in [("images", "000001.png"), ("labels", "000001.txt")] {
        let folder = path(kind).join("train");
        std::fs::create_dir(folder.join("cam0")).unwrap();
        std::fs::rename(folder.join(file), folder.join("cam0").join(file)).unwrap();
    }
    std::fs::write(path("labels/train/classes.txt"), "cap\n").unwrap();
    std::fs::write(path("labels/train/cam0/000099.txt"), "").unwrap();
    assert_eq!(
        faults(dir.path()),
        ["labels/train/cam0/000099.txt: no image with this name [dataset.orphan_label]"]
    );
}

#[test]
fn an_image_of_both_parts_is_a_leak() {
    let dir = made(12);
    let yaml = "train: images/train\nval: images/train\nnames: [a, b, c]\n";
    std::fs::write(dir.path().join("data.yaml"), yaml).unwrap();
    let found = faults(dir.path());
    assert_eq!(
        found[0],
        "images/train/000001.png: leak: validation image is also used for training [dataset.leak]"
    );
    assert!(!found.join("\n").contains("the same bytes"), "{found:?}");
}

#[test]
fn files_joined_from_the_labels_of_images_are_compared_with_them() {
    let dir = tempfile::tempdir().unwrap();
    make(&full_plan(dir.path(), 12)).unwrap();
    assert_eq!(faults(dir.path()), [""; 0]);
    for name in [
        "annotations/instances_train.json",
        "voc/val.txt",
        "webdataset/train-000000.tar",
    ] {
        let path = dir.path().join(name);
        let whole = std::fs::read(&path).unwrap();
        let fault = format!(
            "{name}: missing, or differs from the images' own labels; `petcomp dataset generate` writes it \
             [dataset.changed_file]"
        );
        std::fs::remove_file(&path).unwrap();
        assert_eq!(faults(dir.path()), std::slice::from_ref(&fault));
        std::fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        assert_eq!(faults(dir.path()), [fault]);
        std::fs::write(&path, &whole).unwrap();
    }
    let document = "annotations/instances_train.json";
    let whole = text(dir.path(), document);
    let edited = whole.replacen("\"topmost\":true", "\"topmost\":null", 1);
    assert_ne!(edited, whole);
    std::fs::write(dir.path().join(document), edited).unwrap();
    assert_eq!(faults(dir.path()).len(), 1);
    // Another petcomp wrote it.
    let older = whole.replacen("petcomp ", "petcomp 0.0.", 1);
    std::fs::write(dir.path().join(document), older).unwrap();
    assert_eq!(faults(dir.path()), [""; 0]);
}

#[test]
fn a_dataset_without_labels_for_yolo_is_compared_with_its_journal() {
    let dir = tempfile::tempdir().unwrap();
    let mut plan = plan(dir.path(), 4);
    plan.writers[1] = Arc::new(Coco::default());
    make(&plan).unwrap();
    let checked = check(dir.path()).unwrap();
    assert!(!checked.has_yolo && checked.findings.is_empty());
    std::fs::write(dir.path().join("images/val/000000.png"), "").unwrap();
    let found = faults(dir.path());
    assert!(
        found.len() == 1 && found[0].contains("images/val/000000.png has 0 bytes"),
        "{found:?}"
    );
    std::fs::remove_file(dir.path().join("index.jsonl")).unwrap();
    let refused = check(dir.path()).unwrap_err().to_string();
    assert!(refused.contains("only archives"), "{refused}");
}

/// A card that fell, one that fell on it, and one that its sidecar file has so far up.
fn with_a_card_up_at(k: u64, height: f64) -> Sample {
    let card = |placement| Object::new("bottle", [0.2, 0.08], 0.005, 0.03, placement);
    let mut sample = sample(k).unwrap();
    let falls = |i: usize| {
        card(Placement::Drop {
            above: [0.0; 2],
            height: i as f64,
            rotation: UnitQuaternion::identity(),
        })
    };
    let provenance = sample.provenance.as_mut().unwrap();
    provenance.drawn.objects = (1..4).map(falls).collect();
    let lies = |z: f64| card(Placement::At(Pose::translation(0.0, 0.0, z)));
    provenance.scene.objects = [0.0027, 0.0081, height].map(lies).into();
    sample
}

#[test]
fn a_sample_without_a_scene_is_written_and_its_layers_are_refused() {
    let bare = |k| sample(k).map(|made| Sample::new(made.frame, made.labels));
    let write = |writers: Vec<Arc<dyn Writer>>| {
        let dir = tempfile::tempdir().unwrap();
        let classes = ["cap_label", "cap", "label"].map(String::from).to_vec();
        let plan = Plan {
            writers,
            ..Plan::new(dir.path(), 4, classes)
        };
        let made = make_of(&plan, bare);
        made.map(|counts| (counts.images, check(dir.path()).unwrap().findings))
    };
    let most = write(vec![
        Arc::new(Pictures::default()),
        Arc::new(Sidecar),
        Arc::new(Yolo::default()),
    ]);
    assert_eq!(most.unwrap(), (4, vec![]));
    let e = write(vec![Arc::new(petcomp::dataset::Layers::default())]).unwrap_err();
    let said = "labels.formats: \"layers\", but the sample was not rendered";
    assert!(e.to_string().contains(said), "{e}");
}

#[test]
fn an_object_that_nothing_holds_up_is_a_fault_of_its_picture() {
    let found = |recipe: &str| {
        let dir = tempfile::tempdir().unwrap();
        let plan = Plan {
            recipe: serde_json::from_str(recipe).unwrap(),
            ..plan(dir.path(), 2)
        };
        let height = |k: u64| if k == 0 { 0.0135 } else { 0.27 };
        make_of(&plan, |k| Ok(with_a_card_up_at(k, height(k)))).unwrap();
        let found = faults(dir.path())
            .into_iter()
            .filter(|fault| fault.contains("nothing supports"));
        found.collect::<Vec<_>>()
    };
    let expected = "scenes/train/000001.json: nothing supports object 3 (\"bottle\"), 0.27 m up: generate this picture again \
                    [dataset.unsupported_object]";
    assert_eq!(found("{}"), [expected]);
    // Nothing falls in a recipe that lays its objects.
    assert!(found(r#"{ "scene": { "settle": { "mode": "flat" } } }"#).is_empty());
}

fn sorted(classes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut classes: Vec<u32> = classes.collect();
    classes.sort_unstable();
    classes
}

#[test]
fn readers_of_records_see_the_labels_that_were_written() {
    for policy in [
        Obstructed::Drop,
        Obstructed::Keep,
        Obstructed::Ignore,
        Obstructed::Class,
    ] {
        let dir = tempfile::tempdir().unwrap();
        let plain = plan(dir.path(), 8);
        let counts = make(&Plan {
            obstructed: policy,
            classes: policy.classes(&plain.classes).unwrap(),
            ..plain
        })
        .unwrap();
        let summary = Summary::read(dir.path()).unwrap();
        let labels = summary.glances.iter().map(|sample| sample.labels.len());
        assert_eq!(counts.labelled, labels.sum::<usize>() as u64, "{policy:?}");
        let index = DatasetIndex::open(dir.path()).unwrap();
        for (row, sample) in summary.glances.iter().enumerate() {
            let label = label_of(&dir.path().join(&sample.files[0]));
            let text = std::fs::read_to_string(label).unwrap();
            let class = |line: &str| line.split(' ').next().unwrap().parse().unwrap();
            let written = sorted(text.lines().map(class));
            let summarised = sorted(sample.labels.iter().map(|(class, _)| *class));
            let facts = index.facts(row).unwrap();
            let labelled = facts.objects.iter().filter(|object| object.labelled);
            let in_brief = sorted(labelled.map(|object| object.class));
            let record = index.record(row).unwrap().unwrap();
            let objects = record.labels.objects.iter();
            let labelled = objects.filter(|object| record.labelled.contains(&object.id));
            let in_full = sorted(labelled.map(|object| object.class));
            assert_eq!(
                [summarised, in_brief, in_full],
                [(); 3].map(|()| written.clone()),
                "{policy:?}"
            );
        }
    }
}

/// Rows of the label files of images.
fn rows_of(images: &[PathBuf]) -> usize {
    let labels = images.iter().map(|image| label_of(image));
    labels
        .map(|label| std::fs::read_to_string(label).unwrap().lines().count())
        .sum()
}

#[test]
fn whoever_reads_a_data_yaml_finds_the_same_images() {
    let dir = tempfile::tempdir().unwrap();
    let [made, lists, folders] = ["made", "lists", "folders"].map(|name| dir.path().join(name));
    make(&plan(&made, 12)).unwrap();
    let all = YoloSet::read(&made).unwrap();
    let halves = all.partitioned(Partition::Consecutive { guard: 0 }, 0.5, 0);
    halves.unwrap().write(&lists).unwrap();
    std::fs::create_dir(&folders).unwrap();
    let yaml =
        "path: ../made\ntrain: [images/train, images/val]\nval: images/val\nnames: [a, b, c]";
    std::fs::write(folders.join("data.yaml"), yaml).unwrap();
    for (folder, counts) in [(lists, [6, 6]), (folders, [12, all.val.len()])] {
        let set = YoloSet::open(&folder).unwrap();
        assert_eq!([set.train.len(), set.val.len()], counts);
        let checked = check(&folder).unwrap();
        assert_eq!(checked.images, counts[0] + counts[1]);
        assert_eq!(checked.rows.len(), 3);
        let rows: usize = checked.rows.iter().sum();
        assert_eq!(rows, rows_of(&set.train) + rows_of(&set.val));
        let truth = read_yolo_truth_of(&set.train).unwrap();
        let boxes: usize = truth.sheets.iter().map(|sheet| sheet.truth.len()).sum();
        assert_eq!(boxes, rows_of(&set.train));
    }
}

#[test]
fn scenes_without_objects_are_groups_of_their_own() {
    let dir = made(50);
    let all = YoloSet::read(dir.path()).unwrap();
    let split = all.partitioned(Partition::Grouped(Group::Selection), 0.8, 0);
    let split = split.unwrap();
    assert_eq!((split.train.len(), split.val.len()), (40, 10));
    let leakage = split.leakage(NEAR_DUPLICATE_RMS).unwrap();
    let groups = [("background", [1, 1]), ("selection", [0, 0])];
    assert_eq!(leakage.groups, groups);
}

#[test]
fn a_split_and_the_check_take_empty_pictures_for_no_look_alikes() {
    let dir = tempfile::tempdir().unwrap();
    let [made, lists] = ["made", "lists"].map(|name| dir.path().join(name));
    make(&plan(&made, 50)).unwrap();
    let all = YoloSet::read(&made).unwrap();
    let split = all.partitioned(Partition::Consecutive { guard: 0 }, 0.8, 0);
    let split = split.unwrap();
    // Pictures 0 and 40 are empty, 1 and 41 have a label.
    for i in [0, 1] {
        let [from, to] = [&split.train[i], &split.val[i]];
        std::fs::copy(from, to).unwrap();
        std::fs::copy(label_of(from), label_of(to)).unwrap();
    }
    let leakage = split.leakage(NEAR_DUPLICATE_RMS).unwrap();
    let alike: Vec<_> = leakage.near_duplicates.iter().map(|n| &n.val).collect();
    assert_eq!(alike, [&split.val[1]]);
    split.write(&lists).unwrap();
    let found = faults(&lists).join("\n");
    assert_eq!(found.matches("the same bytes as").count(), 1, "{found}");
    assert!(found.contains("000041"), "{found}");
}

#[test]
fn a_byte_order_mark_is_a_fault_of_a_label_and_of_a_list() {
    let dir = made(12);
    let label = dir.path().join("labels/train/000001.txt");
    let rows = std::fs::read_to_string(&label).unwrap();
    std::fs::write(&label, format!("\u{feff}{rows}")).unwrap();
    let list = "\u{feff}./images/val/000000.png\n./images/val/000005.png\n";
    std::fs::write(dir.path().join("val.txt"), list).unwrap();
    let yaml = "train: images/train\nval: val.txt\nnames: [a, b, c]\n";
    std::fs::write(dir.path().join("data.yaml"), yaml).unwrap();
    let marked = |found: Vec<String>| -> Vec<String> {
        let marked = found.into_iter().filter(|f| f.contains("byte order mark"));
        marked.collect()
    };
    let expected = [
        "labels/train/000001.txt:1: a byte order mark, which is part of the class to trainers [dataset.bad_label_row]",
        "val.txt:1: a byte order mark, which is part of the first path to trainers [dataset.unreadable_file]",
    ];
    assert_eq!(marked(faults(dir.path())), expected);
}

#[test]
fn trainers_take_an_image_without_a_label_file_as_empty() {
    let dir = made(12);
    let label = dir.path().join("labels/train/000003.txt");
    std::fs::remove_file(label).unwrap();
    let [lost, unlisted] = faults(dir.path()).try_into().unwrap();
    assert!(lost.starts_with("index.jsonl:") && unlisted.contains("000003.txt: missing, but"));
    std::fs::remove_file(dir.path().join("index.jsonl")).unwrap();
    let checked = check(dir.path()).unwrap();
    assert_eq!((checked.findings.len(), checked.unlabelled), (0, 1));
    let note = checked.notes()[0].to_string();
    assert_eq!(
        note,
        "1 of 12 images have no label file: trainers take them as empty"
    );
    std::fs::remove_dir_all(dir.path().join("labels/train")).unwrap();
    let checked = check(dir.path()).unwrap();
    assert_eq!((checked.findings.len(), checked.unlabelled), (9, 0));
}

/// Trainers replace the last `images` of the whole path.
#[test]
fn labels_are_looked_for_by_the_whole_path() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("images/set");
    make(&plan(&set, 12)).unwrap();
    std::fs::remove_file(set.join("index.jsonl")).unwrap();
    assert_eq!(faults(&set), [""; 0]);
    for part in ["train", "val"] {
        let place = set.join(part);
        std::fs::rename(set.join("images").join(part), &place).unwrap();
        for label in std::fs::read_dir(set.join("labels").join(part)).unwrap() {
            let label = label.unwrap();
            std::fs::rename(label.path(), place.join(label.file_name())).unwrap();
        }
    }
    let yaml = "train: train\nval: val\nnames: [bottle]\n";
    std::fs::write(set.join("data.yaml"), yaml).unwrap();
    let found = faults(&set);
    assert!(
        found[0].starts_with("../../labels/set/train/000001.txt: missing, but train/000001.png"),
        "{found:?}"
    );
}

#[test]
fn rows_may_end_as_on_any_system() {
    let dir = made(12);
    let label = dir.path().join("labels/train/000003.txt");
    let rows = check(dir.path()).unwrap().rows;
    let text = std::fs::read_to_string(&label).unwrap();
    assert_eq!(text.lines().count(), 2);
    std::fs::remove_file(dir.path().join("index.jsonl")).unwrap();
    for end in ["\r\n", "\r"] {
        std::fs::write(&label, text.replace('\n', end)).unwrap();
        let checked = check(dir.path()).unwrap();
        assert_eq!((checked.findings, checked.rows), (vec![], rows.clone()));
    }
}

/// Trainers resolve the path of a folder of images before they replace its `images` by `labels`.
#[test]
#[cfg(unix)]
fn labels_are_where_the_link_of_their_images_leads() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    make(&plan(&set, 12)).unwrap();
    std::fs::remove_file(set.join("index.jsonl")).unwrap();
    let lead_to = |place: &str| {
        let (own, place) = (set.join("images/train"), dir.path().join(place));
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        std::fs::rename(own.canonicalize().unwrap(), &place).unwrap();
        let _ = std::fs::remove_file(&own);
        std::os::unix::fs::symlink(&place, own).unwrap();
        faults(&set)
    };
    let found = lead_to("photos");
    assert_eq!(found.len(), 9, "{found:?}");
    let said = "../photos/000001.txt: missing, but images/train/000001.png exists: trainers replace the last `images` of \
                its absolute path, without links, by `labels` [dataset.missing_label]";
    assert!(found.contains(&said.to_owned()), "{found:?}");
    std::fs::create_dir_all(dir.path().join("far/labels")).unwrap();
    std::fs::rename(
        set.join("labels/train"),
        dir.path().join("far/labels/train"),
    )
    .unwrap();
    assert_eq!(lead_to("far/images/train"), [""; 0]);
    // A link to all of the set changes nothing.
    let whole = dir.path().join("whole");
    std::os::unix::fs::symlink(&set, &whole).unwrap();
    assert_eq!(faults(&whole), [""; 0]);
}

#[test]
fn an_empty_folder_fails_the_check() {
    let dir = tempfile::tempdir().unwrap();
    assert!(
        faults(dir.path())[0].starts_with("data.yaml: "),
        "{:?}",
        faults(dir.path())
    );
    assert!(check(&dir.path().join("none")).is_err());
}

#[test]
fn a_contact_sheet_shows_the_pictures_asked_for() {
    let dir = made(12);
    let six = contact_sheet_of(dir.path(), 6).unwrap();
    let all = contact_sheet_of(dir.path(), 100).unwrap();
    // Two columns of three, and three of four: of pictures 48 px high with a line below.
    assert_eq!(all.height() - six.height(), 48 + 4 + 16 + 16);
    let column = all.width() - six.width();
    assert_eq!(six.width(), 2 * column - 16 + 2 * 28);
    let orange = petcomp::Srgb8 {
        r: 0xE6,
        g: 0x9F,
        b: 0x00,
    };
    assert!(all.pixels().contains(&orange));
    assert!(contact_sheet_of(&dir.path().join("images"), 6).is_err());
}

#[test]
fn a_writer_of_one_s_own_takes_part() {
    struct Count;
    impl Writer for Count {
        fn settings(&self) -> serde_json::Value {
            "count".into()
        }
        fn begin(&self, _: &Path, _: &[String]) -> Result<()> {
            Ok(())
        }
        fn write(
            &self,
            folder: &Path,
            entry: &petcomp::dataset::Entry<'_>,
        ) -> Result<Vec<PathBuf>> {
            let path = PathBuf::from(format!("{}.txt", entry.k));
            io::write_text(folder.join(&path), &entry.labelled.len().to_string())?;
            Ok(vec![path])
        }
    }
    let dir = tempfile::tempdir().unwrap();
    make(&Plan {
        writers: vec![Arc::new(Count)],
        ..plan(dir.path(), 4)
    })
    .unwrap();
    assert_eq!(text(dir.path(), "3.txt"), "2");
}

#[test]
fn trainers_are_shown_files_that_are_there() {
    let shown = |formats: &str| {
        let dir = tempfile::tempdir().unwrap();
        let labels: LabelConfig = toml::from_str(formats).unwrap();
        let report = make(&Plan {
            writers: labels.writers(&Pictures::default()),
            ..plan(dir.path(), 6)
        })
        .unwrap();
        assert!(
            report
                .for_trainers
                .iter()
                .all(|file| dir.path().join(file).exists())
        );
        report
            .for_trainers
            .iter()
            .map(|file| file.display().to_string())
            .collect::<Vec<_>>()
    };
    let coco = [
        "annotations/instances_train.json",
        "annotations/instances_val.json",
    ];
    assert_eq!(shown("formats = ['coco']"), coco);
    assert_eq!(
        shown("formats = ['voc', 'yolo']"),
        ["data.yaml", "voc/train.txt", "voc/val.txt"]
    );
    assert_eq!(
        shown("formats = ['webdataset']"),
        ["webdataset/train-000000.tar", "webdataset/val-000000.tar"]
    );
    assert_eq!(shown("formats = ['layers']"), [""; 0]);
    // What joins many samples comes when the shards are merged.
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        make(&shard(dir.path(), 6, 1, 2)).unwrap().for_trainers,
        [Path::new("data.yaml")]
    );
}

fn shard(folder: &Path, count: u64, index: u64, of: u64) -> Plan {
    Plan {
        range: SampleRange::Shard(Shard::new(index, of).unwrap()),
        ..full_plan(folder, count)
    }
}

/// Samples that go into archives of four numbers as they are made.
fn archive_plan(folder: &Path, count: u64) -> Plan {
    Plan {
        archives: Some(WebDataset { samples: 4 }),
        ..plan(folder, count)
    }
}

/// Everything in a folder, hidden or not.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let names = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn archives_alone_leave_no_other_file_and_are_those_packed_from_files() {
    let (loose, streamed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut packed = plan(loose.path(), 30);
    packed.writers.push(Arc::new(WebDataset { samples: 4 }));
    make(&packed).unwrap();
    let report = make(&archive_plan(streamed.path(), 30)).unwrap();
    assert_eq!((report.images, report.val, report.made), (30, 6, 30));
    assert_eq!(report.objects, make(&packed).unwrap().objects);
    assert_eq!(names(streamed.path()), ["dataset.json", "webdataset"]);
    let archives = |folder: &Path| bytes(&folder.join("webdataset"));
    assert_eq!(archives(loose.path()), archives(streamed.path()));
    assert_eq!(archives(loose.path()).len(), 8 + 6);
    let sheet = contact_sheet_of(streamed.path(), 4);
    let summary = petcomp::dataset::Summary::read(streamed.path());
    for refused in [sheet.map(drop), summary.map(drop)] {
        let refused = refused.unwrap_err().to_string();
        assert!(
            refused.contains("only archives, expected files"),
            "{refused}"
        );
    }
}

#[test]
fn archives_that_are_there_are_not_made_again() {
    let dir = tempfile::tempdir().unwrap();
    make(&archive_plan(dir.path(), 30)).unwrap();
    let before = bytes(dir.path());
    std::fs::remove_file(dir.path().join("webdataset/val-000002.tar")).unwrap();
    let report = make(&archive_plan(dir.path(), 30)).unwrap();
    assert_eq!((report.images, report.made), (30, 4));
    assert_eq!(before, bytes(dir.path()));
    let e = make(&archive_plan(dir.path(), 31)).unwrap_err().to_string();
    assert!(
        e.ends_with(
            "count: the dataset was started with 30, this run has 31; expected the same, or a new \
             folder"
        ),
        "{e}"
    );
}

#[test]
fn torn_archives_are_found_and_made_again() {
    let dir = tempfile::tempdir().unwrap();
    let refused = repair_archives(dir.path(), SampleRange::All).unwrap_err();
    assert!(refused.to_string().contains("started before"), "{refused}");
    make(&archive_plan(dir.path(), 30)).unwrap();
    let before = bytes(dir.path());
    let all = before.len() - 1;
    let archive = |name: &str| dir.path().join("webdataset").join(name);
    assert_eq!(
        repair_archives(dir.path(), SampleRange::All).unwrap(),
        (all, 0)
    );
    // Cut off in a file, between two files, before the end, filled up with zeros; empty.
    let cut = |name: &str, end: usize, zeros: usize| {
        let mut text = std::fs::read(archive(name)).unwrap();
        text.truncate(end);
        text.resize(end + zeros, 0);
        std::fs::write(archive(name), text).unwrap();
    };
    let length = |name: &str| std::fs::metadata(archive(name)).unwrap().len() as usize;
    cut("train-000000.tar", 700, 0);
    cut("train-000001.tar", length("train-000001.tar") - 1024, 0);
    cut("train-000002.tar", length("train-000002.tar") - 512, 0);
    cut("train-000003.tar", 512, length("train-000003.tar") - 512);
    cut("val-000000.tar", 0, 0);
    assert_eq!(
        repair_archives(dir.path(), SampleRange::All).unwrap(),
        (all - 5, 5)
    );
    make(&archive_plan(dir.path(), 30)).unwrap();
    assert_eq!(before, bytes(dir.path()));
}

#[test]
fn archives_of_sequences_are_whole() {
    let dir = tempfile::tempdir().unwrap();
    let plan = Plan {
        recipe: serde_json::json!({ "scene": { "belt": { "frames": 10 } } }),
        split: Split {
            sequence: 10,
            ..Split::default()
        },
        archives: Some(WebDataset { samples: 40 }),
        ..plan(dir.path(), 100)
    };
    make(&plan).unwrap();
    let before = bytes(dir.path());
    let found = repair_archives(dir.path(), SampleRange::All).unwrap();
    assert_eq!(found, (5, 0));
    assert_eq!(before, bytes(dir.path()));
}

#[test]
fn what_a_killed_run_left_of_a_packed_archive_goes() {
    let dir = tempfile::tempdir().unwrap();
    make(&archive_plan(dir.path(), 30)).unwrap();
    let before = bytes(dir.path());
    for left in [".archive-000000/images", ".archive-000001/images"] {
        std::fs::create_dir_all(dir.path().join(left)).unwrap();
    }
    std::fs::write(dir.path().join("webdataset/train-000001.tar"), "").unwrap();
    repair_archives(dir.path(), SampleRange::All).unwrap();
    make(&archive_plan(dir.path(), 30)).unwrap();
    assert_eq!(before, bytes(dir.path()));
    assert_eq!(names(dir.path()), ["dataset.json", "webdataset"]);
}

#[test]
fn a_run_broken_off_within_an_archive_goes_on_there() {
    let (whole, broken) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(&archive_plan(whole.path(), 30)).unwrap();
    let stop = AtomicBool::new(false);
    let after_some = |p: Progress| stop.store(p.made >= 10, Ordering::Relaxed);
    let run = || generate(&archive_plan(broken.path(), 30), sample, &after_some, &stop);
    let e = threads(1, run).unwrap_err();
    assert!(
        matches!(&e, Error::Interrupted { what } if what.starts_with("10 of 30 samples are in ")),
        "{e}"
    );
    assert_eq!(names(&broken.path().join("webdataset")).len(), 4);
    let told = Mutex::new(Vec::new());
    let note = |p: Progress| told.lock().unwrap().push(p.done);
    let go_on = AtomicBool::new(false);
    let report = generate(&archive_plan(broken.path(), 30), sample, &note, &go_on).unwrap();
    assert_eq!(report.made, 20);
    let told = told.into_inner().unwrap();
    assert!(told[0] == 10 && told.is_sorted(), "{told:?}");
    assert_eq!(told[told.len() - 1], 30);
    assert_eq!(bytes(whole.path()), bytes(broken.path()));
    assert_eq!(names(broken.path()), ["dataset.json", "webdataset"]);
}

#[test]
fn what_was_damaged_before_it_was_packed_is_found_and_made_again() {
    let (whole, broken) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let one_archive = |folder: &Path| Plan {
        archives: Some(WebDataset { samples: 400 }),
        ..plan(folder, 400)
    };
    make(&one_archive(whole.path())).unwrap();
    // More than the last lines, whose files every run compares.
    let stop = AtomicBool::new(false);
    let after_some = |p: Progress| stop.store(p.made >= 300, Ordering::Relaxed);
    generate(&one_archive(broken.path()), sample, &after_some, &stop).unwrap_err();
    let image = broken
        .path()
        .join(".archive-000000/images/train/000002.png");
    let size = std::fs::metadata(&image).unwrap().len();
    std::fs::write(&image, vec![0; size as usize]).unwrap();
    repair_archives(broken.path(), SampleRange::All).unwrap();
    make(&one_archive(broken.path())).unwrap();
    assert_eq!(bytes(whole.path()), bytes(broken.path()));
}

#[test]
fn shards_share_the_folder_of_archives() {
    let (whole, shared) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(&archive_plan(whole.path(), 30)).unwrap();
    std::thread::scope(|scope| {
        for index in [3, 1, 2] {
            let range = SampleRange::Shard(Shard::new(index, 3).unwrap());
            let plan = Plan {
                range,
                ..archive_plan(shared.path(), 30)
            };
            scope.spawn(move || make(&plan).unwrap());
        }
    });
    assert_eq!(bytes(whole.path()), bytes(shared.path()));
}

#[test]
fn one_sample_of_an_archive_cannot_be_made() {
    let dir = tempfile::tempdir().unwrap();
    let one = Plan {
        range: SampleRange::One(3),
        ..archive_plan(dir.path(), 30)
    };
    let e = make(&one).unwrap_err().to_string();
    assert_eq!(
        e,
        "only: a dataset of archives, expected all of its samples or a shard"
    );
}

/// An object store in memory that takes some puts and is full then.
#[derive(Default)]
struct MemoryStore {
    objects: Mutex<BTreeMap<String, Vec<u8>>>,
    puts: AtomicUsize,
    /// Puts before it is full; 0 for no end.
    room: usize,
}

impl ArchiveStore for MemoryStore {
    fn url(&self) -> &str {
        "s3://bucket/prefix"
    }

    fn put(&self, name: &str, content: Vec<u8>) -> Result<bool> {
        let before = self.puts.fetch_add(1, Ordering::Relaxed);
        if self.room > 0 && before >= self.room {
            return Err(Error::file(format!("s3://bucket/prefix/{name}"), "full"));
        }
        let mut objects = self.objects.lock().unwrap();
        let is_new = !objects.contains_key(name);
        objects.entry(name.into()).or_insert(content);
        Ok(is_new)
    }

    fn get(&self, name: &str) -> Result<Vec<u8>> {
        Ok(self.objects.lock().unwrap()[name].clone())
    }

    fn names(&self, folder: &str) -> Result<Vec<String>> {
        let objects = self.objects.lock().unwrap();
        let below = objects.keys().filter_map(|name| name.strip_prefix(folder));
        Ok(below
            .map(|name| name.trim_matches('/').to_owned())
            .collect())
    }
}

impl MemoryStore {
    /// Its archives, as they are in a folder.
    fn archives(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let objects = self.objects.lock().unwrap();
        let archives = objects
            .iter()
            .filter(|(name, _)| name.starts_with("webdataset/"));
        archives
            .map(|(name, bytes)| (name["webdataset/".len()..].into(), bytes.clone()))
            .collect()
    }
}

fn store_plan(folder: &Path, count: u64, store: &Arc<MemoryStore>) -> Plan {
    Plan {
        store: Some(store.clone()),
        ..archive_plan(folder, count)
    }
}

/// The archives of 30 samples, made into a folder.
fn archives_of_30() -> BTreeMap<PathBuf, Vec<u8>> {
    let dir = tempfile::tempdir().unwrap();
    make(&archive_plan(dir.path(), 30)).unwrap();
    bytes(&dir.path().join("webdataset"))
}

#[test]
fn a_store_gets_the_archives_of_a_folder_and_a_receipt_for_each() {
    let (scratch, store) = (
        tempfile::tempdir().unwrap(),
        Arc::new(MemoryStore::default()),
    );
    let report = make(&store_plan(scratch.path(), 30, &store)).unwrap();
    assert_eq!((report.images, report.val, report.made), (30, 6, 30));
    assert_eq!(store.archives(), archives_of_30());
    assert_eq!(names(scratch.path()), ["dataset.json"]);
    assert_eq!(store.names("receipts").unwrap().len(), 8);
    let archive = &store.archives()[Path::new("train-000002.tar")];
    let receipt: serde_json::Value =
        serde_json::from_slice(&store.get("receipts/000002.json").unwrap()).unwrap();
    let of_train = serde_json::json!({
        "name": "webdataset/train-000002.tar",
        "bytes": archive.len(),
        "crc32": crc32fast::hash(archive),
    });
    assert_eq!(receipt["files"][0], of_train);
}

#[test]
fn a_store_that_was_full_is_filled_up_later() {
    let expected = archives_of_30();
    for room in [1, 2, 5, 9] {
        let dir = tempfile::tempdir().unwrap();
        let full = Arc::new(MemoryStore {
            room,
            ..MemoryStore::default()
        });
        let e = make(&store_plan(dir.path(), 30, &full)).unwrap_err();
        assert!(e.to_string().ends_with("full"), "{e}");
        let larger = Arc::new(MemoryStore {
            objects: Mutex::new(full.objects.lock().unwrap().clone()),
            ..MemoryStore::default()
        });
        // By another machine, which has nothing of the first one's scratch folder.
        let other = tempfile::tempdir().unwrap();
        let report = make(&store_plan(other.path(), 30, &larger)).unwrap();
        assert_eq!(report.images, 30);
        assert_eq!(larger.archives(), expected);
        // And once more, when all is there.
        assert_eq!(make(&store_plan(dir.path(), 30, &larger)).unwrap().made, 0);
    }
}

#[test]
fn shards_share_a_store() {
    let store = Arc::new(MemoryStore::default());
    std::thread::scope(|scope| {
        // The second shard runs twice, as it does where a cluster took the first machine for dead.
        for index in [3, 1, 2, 2] {
            let store = &store;
            scope.spawn(move || {
                let scratch = tempfile::tempdir().unwrap();
                let range = SampleRange::Shard(Shard::new(index, 3).unwrap());
                let plan = Plan {
                    range,
                    ..store_plan(scratch.path(), 30, store)
                };
                make(&plan).unwrap()
            });
        }
    });
    assert_eq!(store.archives(), archives_of_30());
    assert_eq!(store.names("receipts").unwrap().len(), 8);
}

#[test]
fn a_store_of_something_else_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let store = Arc::new(MemoryStore::default());
    make(&store_plan(dir.path(), 30, &store)).unwrap();
    let other = tempfile::tempdir().unwrap();
    let refused = |plan: Plan| make(&plan).unwrap_err().to_string();
    assert_eq!(
        refused(store_plan(other.path(), 31, &store)),
        "s3://bucket/prefix/dataset.json: count: the dataset was started with 30, this run has 31; \
         expected the same, or a new folder"
    );
    // An archive that no receipt vouches for, and that has other bytes.
    store.objects.lock().unwrap().remove("receipts/000001.json");
    let name = "webdataset/train-000001.tar".to_owned();
    store.objects.lock().unwrap().insert(name, vec![7; 3]);
    let e = refused(store_plan(other.path(), 30, &store));
    assert!(
        e.starts_with(
            "s3://bucket/prefix/webdataset/train-000001.tar: holds 3 bytes that differ from the"
        ),
        "{e}"
    );
    let loose = Plan {
        archives: None,
        ..store_plan(other.path(), 30, &store)
    };
    assert!(refused(loose).starts_with("labels.formats: files of single samples"));
    let e = refused(plan(Path::new("s3://bucket/prefix"), 1));
    assert_eq!(e, "s3://bucket/prefix: is a URL, expected a folder");
}

/// Shards of 20 samples in every format, made in an order of their own.
fn shards(dir: &Path) -> Vec<PathBuf> {
    let folders: Vec<PathBuf> = (1..=3).map(|i| dir.join(format!("shard-{i}"))).collect();
    for i in [2, 0, 1] {
        make(&shard(&folders[i], 20, i as u64 + 1, 3)).unwrap();
    }
    folders
}

fn joined(shards: &[PathBuf], folder: &Path) -> Result<DatasetCounts> {
    merge(shards, folder, &|_| {}, &AtomicBool::new(false))
}

/// Why shards are not joined.
fn refusal(shards: &[PathBuf], folder: &Path) -> String {
    joined(shards, folder).unwrap_err().to_string()
}

#[test]
fn merged_shards_are_the_bytes_of_one_run() {
    let (whole, dir) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make(&full_plan(whole.path(), 20)).unwrap();
    let mut folders = shards(dir.path());
    folders.reverse();
    let merged = dir.path().join("merged");
    let report = joined(&folders, &merged).unwrap();
    assert_eq!((report.images, report.made), (20, 20));
    assert_eq!(bytes(whole.path()), bytes(&merged));
    assert_eq!(joined(&folders, &merged).unwrap().made, 0);
}

#[test]
fn shards_with_settings_of_all_layouts_are_merged() {
    let labels = "formats = ['yolo', 'coco', 'layers']\nsimplify = 1.5\nalpha_threshold = 0.6\n\
        yolo = { task = 'segment' }\ncoco = { masks = 'polygon' }";
    let labels: LabelConfig = toml::from_str(labels).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let made = |name: &str, range| {
        let folder = dir.path().join(name);
        let writers = labels.writers(&Pictures::default());
        make(&Plan {
            range,
            writers,
            ..plan(&folder, 6)
        })
        .unwrap();
        folder
    };
    let whole = made("whole", SampleRange::All);
    let shards = [1, 2].map(|i| {
        let share = Shard::new(i, 2).unwrap();
        made(&format!("shard-{i}"), SampleRange::Shard(share))
    });
    let merged = dir.path().join("merged");
    joined(&shards, &merged).unwrap();
    assert_eq!(bytes(&whole), bytes(&merged));
}

#[test]
fn shards_that_do_not_make_a_whole_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folders = shards(dir.path());
    let refused = |folders: &[PathBuf]| refusal(folders, &dir.path().join("merged"));
    assert_eq!(refused(&folders[..2]), "shards: shard 3/3 is missing");
    assert_eq!(refused(&[]), "shards: none, expected their folders");
    let twice = [folders.clone(), vec![folders[0].clone()]].concat();
    assert!(refused(&twice).contains("is shard 1/3, as "));

    let whole = dir.path().join("whole");
    make(&plan(&whole, 3)).unwrap();
    assert!(refused(&[whole]).ends_with("is a whole dataset, expected a shard"));

    let other = dir.path().join("other");
    make(&Plan {
        seed: 8,
        ..shard(&other, 20, 3, 3)
    })
    .unwrap();
    let mixed = refused(&[folders[0].clone(), folders[1].clone(), other]);
    assert!(
        mixed.ends_with("dataset.json: seed: the dataset was started with 7, this run has 8"),
        "{mixed}"
    );

    let journal = folders[1].join("index.jsonl");
    let lines = std::fs::read_to_string(&journal).unwrap();
    std::fs::write(&journal, lines.split_once('\n').unwrap().1).unwrap();
    assert!(refused(&folders).contains("shard-2: sample 1 is missing: finish this shard first"));
    std::fs::write(&journal, lines).unwrap();

    let damaged = folders[0].join("labels/train/000003.txt");
    let size = std::fs::metadata(&damaged).unwrap().len();
    std::fs::write(&damaged, vec![b'7'; size as usize]).unwrap();
    assert!(refused(&folders).contains("000003.txt: has changed since it was written"));
}

/// Changes the first line of a folder's journal, and gives it the checksum of its new bytes if it
/// is to pass for whole.
fn edit_journal(folder: &Path, from: &str, to: &str, pass: bool) {
    let (first, rest) = text(folder, "index.jsonl")
        .split_once('\n')
        .map(|(a, b)| (a.to_owned(), b.to_owned()))
        .unwrap();
    assert!(first.contains(from), "no {from} in {first}");
    let mut edited = first.replacen(from, to, 1);
    if pass {
        let (body, _) = edited.rsplit_once(",\"crc32\":").unwrap();
        edited = format!("{body},\"crc32\":{}}}", crc32fast::hash(body.as_bytes()));
    }
    std::fs::write(folder.join("index.jsonl"), format!("{edited}\n{rest}")).unwrap();
}

#[test]
fn a_merge_reads_and_writes_nothing_outside_its_folders() {
    let dir = tempfile::tempdir().unwrap();
    let folders = shards(dir.path());
    let out = dir.path().join("deep/out");
    std::fs::write(dir.path().join("evil.sh"), "evil!").unwrap();
    let crc32 = crc32fast::hash(b"evil!");
    for path in ["../evil.sh", "index.jsonl", ".lock", "labels/../../evil.sh"] {
        let line = text(&folders[0], "index.jsonl");
        let more = format!(r#""files":[{{"path":"{path}","bytes":5,"crc32":{crc32}}},"#);
        edit_journal(&folders[0], "\"files\":[", &more, true);
        let refused = refusal(&folders, &out);
        assert!(
            refused.contains("shard-1/index.jsonl: line 1: file: "),
            "{path}: {refused}"
        );
        std::fs::write(folders[0].join("index.jsonl"), line).unwrap();
    }
    assert!(!dir.path().join("deep").exists());
}

#[cfg(unix)]
#[test]
fn a_merge_reads_regular_files_of_the_shard_alone() {
    let dir = tempfile::tempdir().unwrap();
    let folders = shards(dir.path());
    let file = folders[0].join("labels/train/000003.txt");
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(dir.path().join("secret"), &whole).unwrap();
    let pipe = |path: &Path| {
        let made = std::process::Command::new("mkfifo").arg(path).status();
        assert!(made.unwrap().success());
    };
    let secret = dir.path().join("secret");
    for (target, why) in [
        (
            Some(secret.as_path()),
            "000003.txt: is a link that leads out of",
        ),
        (
            Some(Path::new("/dev/zero")),
            "000003.txt: is a link that leads out of",
        ),
        (None, "000003.txt: not a regular file"),
    ] {
        std::fs::remove_file(&file).unwrap();
        match target {
            Some(target) => std::os::unix::fs::symlink(target, &file).unwrap(),
            None => pipe(&file),
        }
        let refused = refusal(&folders, &dir.path().join("out"));
        assert!(refused.contains(why), "{refused}");
    }
    let journal = folders[1].join("index.jsonl");
    std::fs::remove_file(&journal).unwrap();
    pipe(&journal);
    let refused = refusal(&folders, &dir.path().join("out"));
    for told in [refused, faults(&folders[1]).join("\n")] {
        assert!(told.contains("index.jsonl: not a regular file"), "{told}");
    }
}

#[test]
fn edited_lines_are_refused_by_a_merge_and_made_again_by_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let folders = shards(dir.path());
    let before = bytes(&folders[1]);
    let edits = [
        ("\"part\":\"train\"", "\"part\":\"val\""),
        ("\"classes\":[[0", "\"classes\":[[9"),
        ("\"files\":[{", "\"files\":[],\"x\":[{"),
        (",\"crc32\":", ",\"crc\":"),
    ];
    for (from, to) in edits {
        edit_journal(&folders[1], from, to, false);
        let refused = refusal(&folders, &dir.path().join("out"));
        assert!(
            refused.contains("shard-2/index.jsonl: line 1: ") && refused.ends_with("--resume"),
            "{refused}"
        );
        assert_eq!(repair(&folders[1]).unwrap(), (6, 1), "{from}");
        assert_eq!(make(&shard(&folders[1], 20, 2, 3)).unwrap().made, 1);
        assert_eq!(before, bytes(&folders[1]));
        edit_journal(&folders[1], from, to, false);
        assert_eq!(
            make(&shard(&folders[1], 20, 2, 3)).unwrap().made,
            1,
            "without being looked through"
        );
        assert_eq!(before, bytes(&folders[1]));
    }
}

#[test]
fn numbers_that_no_dataset_has_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folders = shards(dir.path());
    let out = dir.path().join("out");
    let says = |from: &str, to: &str| {
        let path = folders[0].join("dataset.json");
        let before = std::fs::read_to_string(&path).unwrap();
        assert!(before.contains(from), "{before}");
        std::fs::write(&path, before.replace(from, to)).unwrap();
        let refused = refusal(&folders[..1], &out);
        std::fs::write(&path, before).unwrap();
        refused
    };
    assert!(
        says("\"of\": 3", "\"of\": 0")
            .ends_with("dataset.json: shard: 1/0, expected at least one shard")
    );
    assert!(says("\"index\": 1", "\"index\": 0").contains("shard: 0/3, expected"));
    assert!(
        says("\"count\": 20", "\"count\": 18446744073709551615")
            .contains("count: 18446744073709551615 samples")
    );
    edit_journal(&folders[0], "\"k\":0", "\"k\":1", true);
    assert!(refusal(&folders, &out).contains("line 1: sample 1 is not in shard 1/3 of 20"));
    let e = make(&plan(&out, 1_000_000_000_000))
        .unwrap_err()
        .to_string();
    assert_eq!(
        e,
        "count: 1000000000000 samples, expected at most 1000000000"
    );
    assert!(!out.exists());
}

#[test]
fn one_sample_of_a_great_many_is_made_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let last = 999_999_999;
    let one = Plan {
        range: SampleRange::One(last),
        ..plan(dir.path(), last + 1)
    };
    assert_eq!(make(&one).unwrap().made, 1);
    let shard = dir.path().join("shard");
    assert_eq!(
        make(&self::shard(&shard, last + 1, 5, 500_000_000))
            .unwrap()
            .made,
        2
    );
}

#[test]
fn fewer_than_there_are_is_refused_and_nothing_is_lost() {
    let dir = tempfile::tempdir().unwrap();
    make(&full_plan(dir.path(), 12)).unwrap();
    let before = bytes(dir.path());
    let refused = make(&full_plan(dir.path(), 5)).unwrap_err().to_string();
    assert!(
        refused.contains("has image 11, but only 5 are requested: request at least 12"),
        "{refused}"
    );
    assert_eq!(before, bytes(dir.path()));
    // One of them is made again, and the lists of all of them stay.
    let one = Plan {
        range: SampleRange::One(3),
        ..full_plan(dir.path(), 4)
    };
    assert_eq!(make(&one).unwrap().images, 12);
    assert_eq!(before, bytes(dir.path()));
}

#[test]
fn a_dataset_of_an_older_program_is_read_and_not_continued() {
    let dir = made(12);
    let older = text(dir.path(), "dataset.json").replace("  \"format\": 2,\n", "");
    std::fs::write(dir.path().join("dataset.json"), older).unwrap();
    let unsealed = |line: &str| format!("{}}}\n", line.rsplit_once(",\"crc32\":").unwrap().0);
    let lines: String = text(dir.path(), "index.jsonl")
        .lines()
        .map(unsealed)
        .collect();
    std::fs::write(
        dir.path().join("index.jsonl"),
        lines.replace("\"obstructed\":0,", ""),
    )
    .unwrap();
    let before = bytes(dir.path());
    assert_eq!(faults(dir.path()), [""; 0]);
    assert!(contact_sheet_of(dir.path(), 3).is_ok());
    for refused in [
        make(&plan(dir.path(), 12)).map(|_| ()),
        repair(dir.path()).map(|_| ()),
    ] {
        let said = refused.unwrap_err().to_string();
        assert!(
            said.contains("dataset.json: was started by an older petcomp")
                && said.ends_with("use a new folder"),
            "{said}"
        );
    }
    assert_eq!(before, bytes(dir.path()));
}

#[cfg(unix)]
#[test]
fn links_in_place_of_its_own_files_are_refused_by_name() {
    for name in [".lock", "index.jsonl"] {
        let dir = tempfile::tempdir().unwrap();
        let (out, victim) = (dir.path().join("out"), dir.path().join("victim"));
        std::fs::create_dir(&out).unwrap();
        std::fs::write(&victim, "mine").unwrap();
        std::os::unix::fs::symlink(&victim, out.join(name)).unwrap();
        // A dataset that was begun, so that the folder is not somebody else's.
        let other = dir.path().join("other");
        make(&plan(&other, 2)).unwrap();
        std::fs::copy(other.join("dataset.json"), out.join("dataset.json")).unwrap();
        let refused = make(&plan(&out, 2)).unwrap_err().to_string();
        assert!(
            refused.contains(&format!("{name}: is a link or not a regular file")),
            "{refused}"
        );
        assert_eq!(std::fs::read_to_string(&victim).unwrap(), "mine");
    }
    // The notes of how long runs took are no part of the dataset: without them the run goes on.
    let dir = tempfile::tempdir().unwrap();
    let (out, victim) = (dir.path().join("out"), dir.path().join("victim"));
    std::fs::create_dir(&out).unwrap();
    std::fs::write(&victim, "mine").unwrap();
    std::os::unix::fs::symlink(&victim, out.join(".runs.jsonl")).unwrap();
    let refused = make(&plan(&out, 2)).unwrap_err().to_string();
    assert!(refused.contains(".runs.jsonl: is a link"), "{refused}");
    assert_eq!(std::fs::read_to_string(&victim).unwrap(), "mine");
}

#[test]
fn one_sample_is_made_again_alone_and_the_others_are_left() {
    let dir = made(12);
    let before = bytes(dir.path());
    std::fs::write(dir.path().join("labels/train/000007.txt"), b"").unwrap();
    let made = std::sync::Mutex::new(Vec::new());
    let counted = |k| {
        made.lock().unwrap().push(k);
        sample(k)
    };
    let one = Plan {
        range: SampleRange::One(7),
        ..plan(dir.path(), 12)
    };
    make_of(&one, counted).unwrap();
    assert_eq!(made.into_inner().unwrap(), [7]);
    assert_eq!(before, bytes(dir.path()));
}

#[test]
fn what_was_damaged_at_its_size_is_found_and_made_again() {
    let dir = tempfile::tempdir().unwrap();
    // More than the last lines, whose files every run compares.
    make(&plan(dir.path(), 600)).unwrap();
    let before = bytes(dir.path());
    let image = dir.path().join("images/train/000002.png");
    let size = std::fs::metadata(&image).unwrap().len();
    std::fs::write(&image, vec![0; size as usize]).unwrap();
    assert_eq!(repair(dir.path()).unwrap(), (599, 1));
    assert_eq!(make(&plan(dir.path(), 600)).unwrap().made, 1);
    assert_eq!(before, bytes(dir.path()));
    assert!(
        repair(&dir.path().join("images"))
            .unwrap_err()
            .to_string()
            .contains("started before")
    );
}

#[test]
fn an_image_that_looks_like_a_trained_one_is_a_leak() {
    let dir = made(12);
    let train: Image<LinearRgb> = io::read(dir.path().join("images/train/000006.png")).unwrap();
    let brighter = train.map(|p| p.scale(1.01));
    io::write(dir.path().join("images/val/000005.png"), &brighter).unwrap();
    let [from, to] = ["train/000006", "val/000005"].map(|name| format!("labels/{name}.txt"));
    std::fs::copy(dir.path().join(from), dir.path().join(to)).unwrap();
    let found = faults(dir.path()).join("\n");
    assert!(
        found.contains("images/val/000005.png: leak: differs from images/train/000006.png"),
        "{found}"
    );
}

#[test]
fn a_copy_is_a_leak_whatever_its_labels_say() {
    let dir = made(12);
    let path = |name: &str| dir.path().join(name);
    let [train, val] = ["train/000006", "val/000005"];
    let mut retouched: Image<LinearRgb> = io::read(path(&format!("images/{train}.png"))).unwrap();
    retouched[(0, 0)] = retouched[(0, 0)].scale(0.95);
    io::write(path("retouched.png"), &retouched).unwrap();
    let original = format!("images/{train}.png");
    for (picture, told) in [
        (original.as_str(), "leak: the same bytes as"),
        ("retouched.png", "leak: differs from"),
    ] {
        std::fs::copy(path(picture), path(&format!("images/{val}.png"))).unwrap();
        for labels in ["", "0 0.5 0.5 0.9 0.9\n"] {
            std::fs::write(path(&format!("labels/{val}.txt")), labels).unwrap();
            let set = YoloSet::read(dir.path()).unwrap();
            let leakage = set.leakage(NEAR_DUPLICATE_RMS).unwrap();
            assert_eq!(leakage.near_duplicates.len(), 1, "{picture} {labels:?}");
            let found = faults(dir.path()).join("\n");
            let expected = format!("images/{val}.png: {told} images/{train}.png");
            assert!(found.contains(&expected), "{labels:?}: {found}");
            assert!(!found.contains("[dataset.duplicate_image]"), "{found}");
        }
    }
}

#[test]
fn a_dataset_may_be_made_for_one_part_alone() {
    for (val_percent, empty) in [(0, Part::Val), (100, Part::Train)] {
        let dir = tempfile::tempdir().unwrap();
        let split = Split {
            val_percent,
            ..Split::default()
        };
        let plan = plan(dir.path(), 12);
        make(&Plan { split, ..plan }).unwrap();
        assert_eq!(faults(dir.path()), [""; 0]);
        let checked = check(dir.path()).unwrap();
        assert_eq!(checked.empty_part, Some(empty));
        assert!(checked.notes().is_empty(), "{:?}", checked.notes());
    }
}

/// A faint object of 12 x 9 pixels on a grainy plate, and its label file.
fn put_faint_object(dataset: &Path, name: &str, left: usize, grain: f32) {
    let picture = Image::from_fn(64, 48, |x, y| {
        let is_object = (left..left + 12).contains(&x) && (20..29).contains(&y);
        let light = if is_object { 0.215 } else { 0.2 };
        LinearRgb::grey(light + grain * ((x + y) % 2) as f32)
    });
    io::write(dataset.join(format!("images/{name}.png")), &picture).unwrap();
    let center = (left as f64 + 6.0) / 64.0;
    let row = format!("0 {center} 0.51 0.1875 0.1875\n");
    std::fs::write(dataset.join(format!("labels/{name}.txt")), row).unwrap();
}

#[test]
fn a_faint_object_is_a_leak_only_at_its_place() {
    let dir = made(12);
    put_faint_object(dir.path(), "train/000006", 4, 0.0);
    for (left, leaks) in [(48, false), (4, true)] {
        put_faint_object(dir.path(), "val/000005", left, 0.005);
        let set = YoloSet::read(dir.path()).unwrap();
        let leakage = set.leakage(NEAR_DUPLICATE_RMS).unwrap();
        assert_eq!(!leakage.near_duplicates.is_empty(), leaks, "{leakage:?}");
        let found = faults(dir.path()).join("\n");
        assert_eq!(found.contains("[dataset.leak]"), leaks, "{found}");
    }
}

#[test]
fn the_classes_balance_and_box_sizes_are_counted() {
    let dir = made(12);
    let checked = check(dir.path()).unwrap();
    let table = checked.balance();
    assert_eq!(table.rows.len(), 3);
    assert_eq!(table.rows[0][4], "18.8 / 18.8 / 18.8 %");
    assert!(
        checked
            .notes()
            .iter()
            .all(|note| note.message.starts_with("class ")),
        "{:?}",
        checked.notes()
    );
}

/// The page as a browser sees it after a script has clicked: the text of the document's title.
fn browse(page: &str, script: &str) -> Option<String> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("page.html");
    let page = page.replace("</body>", &format!("<script>{script}</script></body>"));
    std::fs::write(&file, page).unwrap();
    let mut command = std::process::Command::new("chromium");
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]);
    command
        .arg(format!(
            "--user-data-dir={}",
            dir.path().join("profile").display()
        ))
        .arg(&file);
    let output = command.output().ok()?;
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let title = dom.split("<title>").nth(1)?.split("</title>").next()?;
    Some(title.to_owned())
}

#[test]
fn a_browser_shows_the_report_and_its_switches_work() {
    let dir = made(12);
    let page = petcomp::dataset::page::page(
        dir.path(),
        &petcomp::dataset::page::DatasetReportOptions {
            most: 6,
            ..Default::default()
        },
    )
    .unwrap()
    .document();
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("http://www.w3.org").count()
    );
    let script = "const shown = id => getComputedStyle(document.querySelector('.' + id)).display != 'none';\
        const before = [shown('boxes'), shown('masks')];\
        document.getElementById('boxes').click(); document.getElementById('masks').click();\
        const pictures = [...document.images].filter(i => i.complete && i.naturalWidth == 64).length;\
        document.title = [before, shown('boxes'), shown('masks'), pictures, document.querySelectorAll('.boxes rect').length].join();";
    match browse(&page, script) {
        Some(title) => assert_eq!(title, "true,false,false,true,6,3"),
        None => writeln!(
            std::io::stderr(),
            "skipped: no chromium here (Debian: chromium)"
        )
        .unwrap(),
    }
}

/// The files of a recipe, made in code: two assets, a labelled photo, a picture of the
/// surroundings.
fn write_world(folder: &Path) {
    let write = |name: &str, text: String| {
        std::fs::create_dir_all(folder.join(name).parent().unwrap()).unwrap();
        std::fs::write(folder.join(name), text).unwrap();
    };
    let photo = |name: &str| {
        format!(
            r#"photos = [{{ file = "{name}.exr", source = "{name}.jpg", px_per_metre = 100.0, size_m = [0.4, 0.2],
            object_m = [0.35, 0.15], screen = [0.1, 0.5, 0.1], matte = "physical", residue = 0.0,
            outline_px = [[1.0, 1.0], [39.0, 1.0], [39.0, 19.0]] }}]"#
        )
        .replace('\n', " ")
    };
    let asset = |name: &str| {
        format!(
            "[[assets]]\nname = \"{name}\"\nclass = \"cap\"\nthickness = 0.01\nmass = 0.02\n{}\n",
            photo(name)
        )
    };
    write(
        "assets/assets.toml",
        format!(
            "classes = [\"cap\", \"label\", \"none\"]\n{}{}",
            asset("a"),
            asset("b")
        ),
    );
    for name in ["a", "b"] {
        let cut_out = Image::filled(40, 20, PremulRgba::new(0.25, 0.5, 0.125, 0.75));
        io::write(folder.join(format!("assets/{name}.exr")), &cut_out).unwrap();
    }
    let label = r#"{"format": "plane-label", "version": 1, "image": {"file": "tray.tif", "width": 64, "height": 48},
        "camera": {"focal_px": 80}, "surface": {"id": "tray", "width_m": 0.6, "height_m": 0.4,
        "corners_px": [[10, 10], [50, 11], [51, 40], [9, 39]]}}"#;
    write("photos/tray.label.json", label.into());
    io::write(
        folder.join("photos/tray.tif"),
        &Image::filled(64, 48, LinearRgb::grey(0.25)),
    )
    .unwrap();
    io::write(
        folder.join("sky.exr"),
        &Image::filled(4, 2, LinearRgb::WHITE),
    )
    .unwrap();
    let recipe = "backgrounds = 'photos'\n[scene]\nimage = [64, 48]\nenvironment = { files = ['sky.exr'] }\n";
    write("recipe.toml", recipe.into());
}

/// A folder with a recipe and its files.
fn world() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_world(dir.path());
    dir
}

fn opened(world: &Path) -> Pipeline {
    let config = DatasetConfig::read(world.join("recipe.toml"), &[]).unwrap();
    Pipeline::open(config).unwrap()
}

#[test]
fn treated_edges_change_the_picture_and_no_label() {
    let dir = world();
    let sample = |edges: &[EdgeTreatment], k: u64| {
        let mut setup = DatasetConfig::read(dir.path().join("recipe.toml"), &[]).unwrap();
        setup.scene.edges = edges.to_vec();
        Pipeline::open(setup).unwrap().sample(1, k).unwrap()
    };
    for k in 0..3 {
        let plain = sample(&[], k);
        assert_eq!(sample(&[EdgeTreatment::AsIs], k).frame, plain.frame);
        for edges in [
            EdgeTreatment::Soft,
            EdgeTreatment::Eroded,
            EdgeTreatment::Poisson,
        ] {
            let treated = sample(&[edges], k);
            assert_eq!(treated.labels, plain.labels, "{edges:?}");
            assert_ne!(treated.frame, plain.frame, "{edges:?}");
            assert_eq!(treated.provenance.unwrap().scene.edges, edges);
        }
    }
}

/// Replaces the first `from` in a file, which keeps its size if both are as long.
fn replace(path: &Path, from: &[u8], to: &[u8]) {
    let mut bytes = std::fs::read(path).unwrap();
    let place = bytes.windows(from.len()).position(|part| part == from);
    let place = place.unwrap_or_else(|| panic!("no such bytes in {}", path.display()));
    bytes.splice(place..place + from.len(), to.iter().copied());
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn whatever_decides_a_picture_or_a_label_is_compared_before_a_dataset_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let (world, out) = (dir.path().join("world"), dir.path().join("out"));
    write_world(&world);
    let run = |count: u64| {
        let setup = DatasetConfig::read(world.join("recipe.toml"), &[])?;
        make(&Pipeline::open(setup)?.plan(count, 1, &out)?)
    };
    run(2).unwrap();
    assert_eq!(run(3).unwrap().made, 1, "nothing has changed");
    let manifest = world.join("assets/assets.toml");
    let tray = world.join("photos/tray.tif");
    // A pixel of a cut-out, at the size of before.
    let repaint = |name: &str, by: f32| {
        let mut cut_out = Image::filled(40, 20, PremulRgba::new(0.25, 0.5, 0.125, 0.75));
        cut_out.pixels_mut()[0].r = by;
        io::write(world.join("assets").join(name), &cut_out).unwrap();
    };
    let repaint_tray = || {
        let (mut photo, length) = (
            Image::filled(64, 48, LinearRgb::grey(0.25)),
            std::fs::metadata(&tray).unwrap().len(),
        );
        photo.pixels_mut()[0].g = 0.5;
        io::write(&tray, &photo).unwrap();
        assert_eq!(std::fs::metadata(&tray).unwrap().len(), length);
    };
    let change = |file: &'static str, from: &'static str, to: &'static str| {
        let file = world.join(file);
        move || replace(&file, from.as_bytes(), to.as_bytes())
    };
    let in_manifest = |from, to| change("assets/assets.toml", from, to);
    let changes: [(&dyn Fn(), &str); 11] = [
        (
            &in_manifest("class = \"cap\"", "class = \"label\""),
            r#"assets[a].class: the dataset was started with "cap", this run has "label""#,
        ),
        (
            &in_manifest("mass = 0.02", "mass = 0.03"),
            "assets[a].mass: the dataset was started with 0.02, this run has 0.03",
        ),
        (
            &in_manifest("thickness = 0.01", "thickness = 0.02"),
            "assets[a].thickness: ",
        ),
        (
            &in_manifest("px_per_metre = 100.0", "px_per_metre = 100.5"),
            "assets[a].photos[a.exr].px_per_metre: ",
        ),
        (
            &in_manifest("[[1.0, 1.0]", "[[2.0, 1.0]"),
            "assets[a].photos[a.exr].outline_px: ",
        ),
        (
            &in_manifest("name = \"b\"", "name = \"c\""),
            r#"assets[1]: the dataset was started with "b", this run has "c""#,
        ),
        (
            &in_manifest("classes = [\"cap\"", "classes = [\"top\", \"cap\""),
            "classes[0]: ",
        ),
        (
            &|| repaint("b.exr", 0.5),
            "assets[b].photos[b.exr].pixels: the dataset was started with \"crc32 ",
        ),
        (
            &repaint_tray,
            "backgrounds[tray].photo: the dataset was started with \"crc32 ",
        ),
        (
            &change("photos/tray.label.json", "[9, 39]", "[9, 38]"),
            "backgrounds[tray].camera: ",
        ),
        (
            &change("photos/tray.label.json", "0.6", "0.7"),
            "backgrounds[tray].camera: ",
        ),
    ];
    let before = bytes(&out);
    let inputs = [
        &manifest,
        &tray,
        &world.join("assets/b.exr"),
        &world.join("photos/tray.label.json"),
    ];
    for (change, said) in changes {
        let kept = inputs.map(|path| std::fs::read(path).unwrap());
        change();
        let refused = run(4).unwrap_err().to_string();
        assert!(refused.contains(said), "expected {said}: {refused}");
        inputs
            .iter()
            .zip(kept)
            .for_each(|(path, bytes)| std::fs::write(path, bytes).unwrap());
    }
    io::write(
        world.join("sky.exr"),
        &Image::filled(4, 2, LinearRgb::grey(0.5)),
    )
    .unwrap();
    let refused = run(4).unwrap_err().to_string();
    assert!(
        refused.contains("environments[sky.exr].content: "),
        "{refused}"
    );
    io::write(
        world.join("sky.exr"),
        &Image::filled(4, 2, LinearRgb::WHITE),
    )
    .unwrap();
    let front = world.join("photos/tray.front.png");
    io::write(&front, &Image::filled(64, 48, Coverage(1.0))).unwrap();
    let refused = run(4).unwrap_err().to_string();
    assert!(refused.contains("backgrounds[tray]"), "{refused}");
    std::fs::remove_file(front).unwrap();
    assert_eq!(before, bytes(&out));
    assert_eq!(run(4).unwrap().made, 1, "everything is as it was");
}

#[test]
fn another_config_of_an_open_pipeline_has_absolute_paths_too() {
    let dir = world();
    let here = std::env::current_dir().unwrap();
    let recipe = io::relative(&dir.path().join("recipe.toml"), &here);
    let config = || DatasetConfig::read(&recipe, &[]).unwrap();
    assert!(config().assets.is_relative());
    let opened = Pipeline::open(config()).unwrap();
    let image = opened.config().scene.image;
    let again = opened.with_config(config(), image).unwrap();
    assert_eq!(again.config(), opened.config());
    assert!(again.config().assets.is_absolute());
}

#[test]
fn a_mask_beside_one_photo_of_several_is_known() {
    let dir = world();
    let photos = dir.path().join("photos");
    let label = text(&photos, "tray.label.json").replace("tray.tif", "wall.tif");
    std::fs::write(photos.join("wall.label.json"), label).unwrap();
    std::fs::copy(photos.join("tray.tif"), photos.join("wall.tif")).unwrap();
    let mask = Image::filled(64, 48, Coverage(1.0));
    io::write(photos.join("wall.front.png"), &mask).unwrap();
    let pipeline = opened(dir.path());
    let recipe = pipeline.plan(1, 1, dir.path().join("out")).unwrap().recipe;
    let [tray, wall] = [0, 1].map(|i| &recipe["backgrounds"][i]);
    assert!(tray["name"] == "tray" && tray["front"].is_null());
    assert!(wall["name"] == "wall" && wall["front"].is_string());
}

#[test]
fn what_changes_after_a_dataset_was_planned_is_told() {
    let write_other = |path: &Path| {
        let grey = |w, h| Image::filled(w, h, LinearRgb::grey(0.5));
        match path.extension().and_then(OsStr::to_str) {
            Some("tif") => io::write(path, &grey(64, 48)),
            Some("exr") => io::write(path, &grey(4, 2)),
            _ => io::write(path, &Image::filled(64, 48, Coverage(1.0))),
        }
    };
    for name in ["photos/tray.tif", "photos/tray.front.png", "sky.exr"] {
        let dir = world();
        let mask = Image::filled(64, 48, Coverage(0.0));
        io::write(dir.path().join("photos/tray.front.png"), &mask).unwrap();
        let pipeline = opened(dir.path());
        pipeline.plan(1, 1, dir.path().join("out")).unwrap();
        write_other(&dir.path().join(name)).unwrap();
        let told = pipeline.sample(1, 0).unwrap_err().to_string();
        let what = format!("{name}: has changed since its folder was opened");
        assert!(told.ends_with(&what), "{told}");
    }
}

#[cfg(unix)]
#[test]
fn a_photo_that_a_label_or_a_manifest_names_is_one_of_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let world = dir.path().join("world");
    write_world(&world);
    let refused = |file: &str| {
        let (place, away) = (world.join(file), dir.path().join("away"));
        std::fs::rename(&place, &away).unwrap();
        std::os::unix::fs::symlink(&away, &place).unwrap();
        let said = Pipeline::open(DatasetConfig::read(world.join("recipe.toml"), &[]).unwrap())
            .unwrap_err()
            .to_string();
        std::fs::rename(&away, &place).unwrap();
        said
    };
    for file in ["photos/tray.tif", "assets/b.exr"] {
        let said = refused(file);
        assert!(
            said.contains(file) && said.contains("is a link that leads out of"),
            "{said}"
        );
    }
}

#[test]
fn what_a_mask_beside_the_photo_hides_is_the_place_in_picture_and_labels() {
    let dir = world();
    let open = || {
        let rule = ["labels.min_visible=0.9".parse().unwrap()];
        Pipeline::open(DatasetConfig::read(dir.path().join("recipe.toml"), &rule).unwrap()).unwrap()
    };
    let free = open().sample(1, 0).unwrap();
    let mask = Image::from_fn(64, 48, |x, _| Coverage(f32::from(x < 32)));
    io::write(dir.path().join("photos/tray.front.png"), &mask).unwrap();
    let held = open().sample(1, 0).unwrap();
    let plate = io::read::<LinearRgb>(dir.path().join("photos/tray.tif")).unwrap();
    for (x, y) in (0..64 * 48).map(|i| (i % 64, i / 64)) {
        let expected = if x < 32 {
            plate[(x, y)].opaque()
        } else {
            free.frame[(x, y)]
        };
        assert_eq!(held.frame[(x, y)], expected, "{x} {y}");
    }
    let mut cut = 0;
    for (held, free) in held.labels.objects.iter().zip(&free.labels.objects) {
        assert_eq!((held.id, &held.amodal_mask), (free.id, &free.amodal_mask));
        let seen = free.visible_mask.pixels().filter(|(x, _)| *x >= 32);
        assert!(held.visible_mask.pixels().eq(seen));
        let [held, free] = [held, free].map(|o| o.uncovered_fraction.unwrap());
        assert!(held <= free);
        cut += usize::from(held < free);
    }
    assert!(cut > 2);
    let drawn = held.provenance.unwrap().drawn;
    assert_eq!(open().label(drawn).unwrap(), held.labels);
}

#[test]
fn a_scene_of_another_size_than_its_plate_is_told() {
    let dir = world();
    let pipeline = opened(dir.path());
    let [w, h] = pipeline.config().scene.image;
    let scene = Scene {
        image: [w / 2, h / 2],
        ..pipeline.draw(1, 0).unwrap()
    };
    let resolved = pipeline.resolve(scene.clone()).map(|_| ());
    for told in [resolved, pipeline.label(scene).map(|_| ())] {
        let (told, expected) = (told.unwrap_err().to_string(), format!("expected {w} x {h}"));
        assert!(
            told.starts_with("image: ") && told.contains(&expected),
            "{told}"
        );
    }
}

#[test]
fn a_mask_of_another_size_is_told() {
    let dir = world();
    let path = dir.path().join("photos/tray.front.png");
    io::write(&path, &Image::filled(32, 24, Coverage(1.0))).unwrap();
    let told = opened(dir.path()).sample(1, 0).unwrap_err();
    let what = "tray.front.png: 32 x 24 pixels, but its label says 64 x 48";
    assert!(told.to_string().ends_with(what), "{told}");
}

#[test]
fn what_the_place_hides_is_not_on_top_by_overlaps_either() {
    let dir = world();
    let mask = Image::filled(64, 48, Coverage(1.0));
    io::write(dir.path().join("photos/tray.front.png"), &mask).unwrap();
    let hidden = opened(dir.path()).sample(1, 0).unwrap();
    assert!(hidden.labels.objects.len() > 2);
    for object in &hidden.labels.objects {
        assert!(!object.is_topmost() && object.visible_mask.is_empty());
        assert!(!object.amodal_mask.is_empty() && object.visible_fraction == 0.0);
    }
}
