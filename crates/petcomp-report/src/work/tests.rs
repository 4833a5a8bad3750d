//! Laws of work: zero if a feature is absent, more than zero if it is present, and switches that
//! turn it off.

use super::world::dropped;
use super::*;
use petcomp::LinearRgb;
use petcomp::dataset::{DatasetConfig, Progress};
use petcomp::scene::{AreaLight, Noise, PostProcess, Scene};
use petcomp::work::Kind::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

#[test]
fn scenes_pay_for_what_they_use_and_for_nothing_else() {
    let world = FixtureFolder::new().unwrap();
    for case in cases(&world) {
        let work = work_of(&world, &case).unwrap();
        let paid: Vec<_> = case
            .absent()
            .into_iter()
            .filter(|kind| work[*kind] != 0)
            .collect();
        assert!(paid.is_empty(), "{}: {paid:?} in {work:?}", case.name);
        let idle: Vec<_> = case.used.iter().filter(|kind| work[**kind] == 0).collect();
        assert!(
            idle.is_empty(),
            "{}: no {idle:?}, so that a zero elsewhere means nothing",
            case.name
        );
    }
}

#[test]
fn work_is_the_same_at_any_thread_count_and_beside_other_scenes() {
    let world = FixtureFolder::new().unwrap();
    let all = || {
        cases(&world)
            .iter()
            .map(|case| work_of(&world, case).unwrap())
            .collect::<Vec<_>>()
    };
    let [one, four] = [1, 4].map(|n| petcomp::work::pool(n).unwrap().install(all));
    assert_eq!(one, four);
    let beside = rayon::join(all, all);
    assert_eq!((&beside.0, &beside.1), (&one, &one));
}

#[test]
fn a_scene_reads_the_files_that_it_names_and_no_others() {
    let world = FixtureFolder::new().unwrap();
    let cases = cases(&world);
    let read = |name: &str| {
        let case = cases.iter().find(|case| case.name == name).unwrap();
        work_of(&world, case).unwrap()[FilesRead]
    };
    // Manifest, label, cut-out, photo; without a photo no label either.
    assert_eq!(read("usual"), 4);
    assert_eq!((read("plate alone"), read("nothing")), (3, 1));
    assert_eq!((read("labels"), read("map"), read("dim map")), (3, 5, 4));
}

/// The program's output for a scene: the displayed picture and its scene-linear values.
fn made(world: &FixtureFolder, config: &DatasetConfig, scene: &Scene) -> (Vec<u8>, Work) {
    let folder = tempfile::tempdir().unwrap();
    let (_, work) = counted(|| {
        let pipeline = Pipeline::open_for(config.clone(), scene).unwrap();
        let (scene, shot) = pipeline.resolve(scene.clone()).unwrap();
        let (_, frame) = pipeline.shoot(&scene, &shot);
        io::write(folder.path().join("a.png"), &frame.map(PremulRgba::color)).unwrap();
        io::write(folder.path().join("a.exr"), &frame).unwrap();
    })
    .unwrap();
    let bytes = ["a.png", "a.exr"].map(|file| std::fs::read(folder.path().join(file)).unwrap());
    assert!(world.config().assets.exists());
    (bytes.concat(), work)
}

#[test]
fn idle_switches_leave_every_byte_and_cost_nothing() {
    let world = FixtureFolder::new().unwrap();
    let (config, scene) = (world.config(), world.scene());
    let usual = made(&world, &config, &scene);
    let out = AreaLight {
        power: 0.0,
        ..scene.lights[0]
    };
    let black = AreaLight {
        color: LinearRgb::BLACK,
        ..scene.lights[0]
    };
    let finish = |finish| Scene {
        finish,
        ..scene.clone()
    };
    let quiet = Noise::Known {
        shot: 0.0,
        read: 0.0,
    };
    let idle = [
        (
            "a lamp without power",
            Scene {
                lights: vec![scene.lights[0], out],
                ..scene.clone()
            },
        ),
        (
            "a black lamp",
            Scene {
                lights: vec![black, scene.lights[0]],
                ..scene.clone()
            },
        ),
        (
            "a map of strength 0",
            Scene {
                environment: Some(world.environment(0.0)),
                ..scene.clone()
            },
        ),
        (
            "noise of variance 0",
            finish(PostProcess {
                noise: quiet,
                noise_seed: 7,
                ..PostProcess::default()
            }),
        ),
        (
            "sharpening by 0",
            finish(PostProcess {
                sharpening: 0.0,
                ..PostProcess::default()
            }),
        ),
        (
            "0 stops and even white",
            finish(PostProcess {
                exposure_ev: 0.0,
                white_balance: LinearRgb::WHITE,
                ..PostProcess::default()
            }),
        ),
    ];
    for (what, scene) in &idle {
        assert!(
            made(&world, &config, scene) == usual,
            "{what} changes bytes or costs work"
        );
    }
}

#[test]
fn quality_where_it_does_not_apply_changes_nothing() {
    let world = FixtureFolder::new().unwrap();
    let scene = world.scene();
    let with = |change: fn(&mut DatasetConfig), scene: &Scene| {
        let mut config = world.config();
        change(&mut config);
        made(&world, &config, scene)
    };
    let no_lamp = Scene {
        lights: vec![],
        ..scene.clone()
    };
    assert!(with(|config| config.render.light_samples = 9, &no_lamp) == with(|_| {}, &no_lamp));
    let no_sky = Scene {
        ambient: LinearRgb::BLACK,
        ..scene.clone()
    };
    assert!(with(|config| config.render.ambient_samples = 99, &no_sky) == with(|_| {}, &no_sky));
    let no_cards = Scene {
        objects: vec![],
        ..scene.clone()
    };
    let finest = |config: &mut DatasetConfig| config.render = petcomp::Quality::Reference.render();
    assert!(with(finest, &no_cards) == with(|_| {}, &no_cards));
    // Options of the fall do not affect cards at rest.
    let longer = |config: &mut DatasetConfig| config.scene.settle.time_limit *= 2.0;
    assert!(with(longer, &scene) == with(|_| {}, &scene));
    assert!(
        with(finest, &scene).0 != with(|_| {}, &scene).0,
        "quality matters where it applies"
    );
}

/// A dataset of three scenes: every file and its bytes, except records of its run time.
fn dataset(
    world: &FixtureFolder,
    threads: usize,
    progress: &(dyn Fn(Progress) + Sync),
) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = Pipeline::open(world.config()).unwrap();
    let plan = pipeline.plan(3, 0, folder.path()).unwrap();
    let make = |_| pipeline.take(dropped(world.scene()));
    let pool = petcomp::work::pool(threads).unwrap();
    pool.install(|| generate(&plan, make, progress, &AtomicBool::new(false)))
        .unwrap();
    files(folder.path())
        .into_iter()
        .map(|(path, bytes)| (path.strip_prefix(folder.path()).unwrap().into(), bytes))
        .collect()
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let shown =
        entries.filter(|path| !path.file_name().unwrap().to_string_lossy().starts_with('.'));
    let below = |path: PathBuf| {
        if path.is_dir() {
            files(&path)
        } else {
            BTreeMap::from([(path.clone(), std::fs::read(&path).unwrap())])
        }
    };
    shown.flat_map(below).collect()
}

#[test]
fn jobs_and_progress_leave_every_byte() {
    let world = FixtureFolder::new().unwrap();
    let alone = dataset(&world, 1, &|_| {});
    let reported = AtomicU64::new(0);
    let watched = dataset(&world, 3, &|progress| {
        reported.store(progress.done, Ordering::Relaxed)
    });
    assert_eq!(
        (reported.into_inner(), alone.len()),
        (3, 3 * 3 + 3),
        "pictures, labels, scenes; and three lists"
    );
    assert!(alone == watched);
}

#[test]
fn labels_without_a_picture_are_those_with_one() {
    let world = FixtureFolder::new().unwrap();
    for case in cases(&world) {
        let pipeline = Pipeline::open(world.config()).unwrap();
        let labels = pipeline.label(case.scene.clone()).unwrap();
        assert_eq!(
            labels,
            pipeline.take(case.scene).unwrap().labels,
            "{}",
            case.name
        );
    }
}

#[test]
fn parts_of_a_picture_that_are_asked_for_leave_the_picture_alone() {
    let world = FixtureFolder::new().unwrap();
    let pipeline = Pipeline::open(world.config()).unwrap();
    let (scene, shot) = pipeline.resolve(world.scene()).unwrap();
    let (deep, frame) = pipeline.shoot(&scene, &shot);
    let before = frame.clone();
    let all = petcomp::composite::Aov::ALL.map(|(_, aov)| aov);
    let (parts, work) = counted(|| petcomp::composite::parts(&all, &deep, &shot, &frame)).unwrap();
    assert!(
        parts.len() >= all.len() && frame == before && pipeline.shoot(&scene, &shot).1 == before
    );
    assert_eq!(
        (work[ShadowRays], work[TextureSamples], work[LabelSamples]),
        (0, 0, 0),
        "folds over what is there"
    );
}

#[test]
fn a_broken_promise_is_marked() {
    let row = |count| WorkRow {
        scene: "a",
        about: "b",
        counts: vec![(Masks, count), (Encodes, 3)],
        absent: vec![Masks],
    };
    let cells = table(&[row(0), row(2)]).rows;
    assert_eq!(cells[0][2..], ["0 ✓", "3"]);
    assert_eq!(cells[1][2..], ["2 ✗", "3"]);
    assert!(row(0).is_as_expected() && !row(2).is_as_expected());
    assert!(table(&[]).rows.is_empty());
}
