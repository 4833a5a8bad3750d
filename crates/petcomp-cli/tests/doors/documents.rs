//! The doors through which documents come: each writes a changed one where the valid one lies and
//! does what a command does with it first.

use crate::change::{self, Chance};
use crate::world::{LIST, World};
use petcomp::asset::{self, Library, List};
use petcomp::camera::{self, CameraFile, ColmapModel, SolveOptions};
use petcomp::dataset::page::DatasetReportOptions;
use petcomp::dataset::{self, DatasetConfig, Partition, Pipeline, YoloSet};
use petcomp::eval;
use petcomp::eval::page::{EvalReportOptions, Metrics, Run};
use petcomp::filter::Pyramid;
use petcomp::io::{self, LimitOverride, Override};
use petcomp::label::{self, Labels};
use petcomp::matte::key::{KeyOptions, Keying, Screen};
use petcomp::matte::{CutOutOptions, FilmOptions, SegmentOptions, cut_out, segment};
use petcomp::render::RenderOptions;
use petcomp::scene::{Placement, SettleOptions, cycles};
use petcomp::{Image, LinearRgb, PremulRgba, Result, Scene, render};
use serde_json::Value;
use std::sync::atomic::AtomicBool;

/// How a valid document is changed.
pub(crate) enum Kind {
    Json,
    Toml,
    /// A line is one JSON document.
    JsonLines,
    Text,
}

pub(crate) struct Door {
    pub(crate) name: &'static str,
    /// The document's place in the world, whose valid content is there or given.
    file: &'static str,
    kind: Kind,
    /// Goes through the door. What comes of it is its own affair; it must come back.
    enter: fn(&World) -> Option<()>,
    /// How many times as long as the others it takes.
    pub(crate) weight: u64,
}

pub(crate) fn doors() -> Vec<Door> {
    use Kind::{Json, JsonLines, Text, Toml};
    let slow = |name, file, kind, enter, weight| Door {
        name,
        file,
        kind,
        enter,
        weight,
    };
    let door = |name, file, kind, enter| slow(name, file, kind, enter, 1);
    vec![
        slow("recipe", "recipe.toml", Toml, recipe, 4),
        slow(
            "scene",
            "scene.toml",
            Toml,
            |world| scene(world, "scene.toml"),
            4,
        ),
        slow(
            "scene at rest",
            "rest.json",
            Json,
            |world| scene(world, "rest.json"),
            2,
        ),
        door("label", "backgrounds/a.label.json", Json, label_file),
        door("camera file", "a.camera.json", Json, camera_file),
        door("labelme", "labelme.json", Json, labelme),
        slow("manifest", "assets/assets.toml", Toml, manifest, 2),
        slow(
            "asset list",
            "photos.toml",
            Toml,
            |world| asset_list(world, "photos.toml"),
            8,
        ),
        slow(
            "asset csv",
            "photos.csv",
            Text,
            |world| asset_list(world, "photos.csv"),
            8,
        ),
        door("settle options", "settle.toml", Toml, settle_options),
        slow("cut-out options", "cut_out.toml", Toml, cut_out_options, 8),
        slow("segment options", "segment.toml", Toml, segment_options, 4),
        slow(
            "journal",
            "dataset/index.jsonl",
            JsonLines,
            dataset_folder,
            4,
        ),
        slow("dataset", "dataset/dataset.json", Json, dataset_folder, 4),
        slow(
            "sidecar",
            "dataset/scenes/val/000000.json",
            Json,
            dataset_folder,
            4,
        ),
        slow("shard", "shard-1/dataset.json", Json, merge, 4),
        slow("shard journal", "shard-1/index.jsonl", JsonLines, merge, 4),
        door("data.yaml", "dataset/data.yaml", Text, yolo_set),
        door(
            "yolo truth",
            "dataset/labels/val/000000.txt",
            Text,
            yolo_eval,
        ),
        door("yolo found", "found/000000.txt", Text, yolo_eval),
        door("coco truth", "truth.json", Json, coco_eval),
        door("coco found", "found.json", Json, coco_eval),
        door("tags", "tags.csv", Text, tags),
        slow(
            "cycles scene",
            "cycles/scene.json",
            Json,
            reference_scene,
            4,
        ),
        door("overrides", "overrides.txt", Text, overrides),
    ]
}

/// Puts a valid document where no other program has written one.
pub(crate) fn give(door: &Door, world: &World) {
    let text = match door.file {
        "recipe.toml" => full_recipe(),
        "a.camera.json" => {
            let label = camera::read_label(world.path("backgrounds/a.label.json")).unwrap();
            let solution = camera::solve(&label, &SolveOptions::default()).unwrap();
            serde_json::to_string(&CameraFile::new(&label, &solution)).unwrap()
        }
        "labelme.json" => r#"{"shapes": [{"label": "tray", "points": [[15, 17], [75, 16], [76, 55], [16, 56]]}],
            "imagePath": "a.png", "imageHeight": 72, "imageWidth": 96}"#
            .into(),
        "photos.toml" => LIST.into(),
        "photos.csv" => "file,asset,class,px_per_metre,length,width,screen,thickness,mass\n\
                         slab.png,a,cap,,0.2,0.1,auto,0.005,0.02\ntwo.png,b,none,300,,,\"0.04,0.4,0.08\",,\n"
            .into(),
        "settle.toml" => toml::to_string(&SettleOptions::default()).unwrap(),
        "cut_out.toml" => toml::to_string(&CutOutOptions::default()).unwrap(),
        "segment.toml" => toml::to_string(&SegmentOptions { levels: Some(4), ..Default::default() }).unwrap(),
        "found/000000.txt" => {
            io::create_folder(world.path("found")).unwrap();
            "0 0.5 0.5 0.2 0.2 0.9\n1 0.3 0.3 0.1 0.1 0.5\n".into()
        }
        "truth.json" => r#"{"images": [{"id": 7, "file_name": "a.png", "width": 64, "height": 48}],
            "annotations": [{"id": 1, "image_id": 7, "category_id": 2, "bbox": [1, 2, 3, 4], "area": 12, "iscrowd": 0}],
            "categories": [{"id": 2, "name": "cap"}]}"#
            .into(),
        "found.json" => r#"[{"image_id": 7, "category_id": 2, "bbox": [1, 2, 3, 4], "score": 0.9}]"#.into(),
        "tags.csv" => "image,light,camera\n000000,dim,1\n000001,bright,2\n".into(),
        "overrides.txt" => "key.clip_black=0.1\nkey.blur_pre=3\nkey.dilate_distance=-2\nkey.feather_distance=4\n\
                            key.edge_kernel_radius=5\nkey.blur=running_sum\nkey.screen_balance=0.4\n\
                            film.clipped=0.9\nfilm.thickness_spread=0.3\nlimit.side=65536\nlimit.seconds=4G\n"
            .into(),
        _ => return,
    };
    world.write(door.file, &text);
}

/// Every key of a recipe, so that each can be changed.
fn full_recipe() -> String {
    let mut setup: DatasetConfig = toml::from_str(DatasetConfig::template()).unwrap();
    setup.scene.image = [64, 48];
    setup.scene.objects = petcomp::scene::Range::new(1.0, 3.0).into();
    setup.scene.surface_albedo = Some(petcomp::color::Albedo::Luminance(0.5));
    setup.scene.lights[0].temperature_k = Some(petcomp::scene::Range::new(3000.0, 5000.0));
    toml::to_string(&setup).unwrap()
}

impl Door {
    /// What is valid here, to be changed draw by draw.
    pub(crate) fn valid(&self, world: &World) -> String {
        world.read(self.file)
    }

    /// One changed document, written in place of the valid one.
    pub(crate) fn changed(&self, valid: &str, chance: &mut Chance) -> String {
        match self.kind {
            Kind::Text => change::text(valid, chance),
            Kind::Json => {
                change::document(&serde_json::from_str(valid).unwrap(), chance, change::json)
            }
            Kind::Toml => {
                let table: toml::Table = toml::from_str(valid).unwrap();
                change::document(&serde_json::to_value(table).unwrap(), chance, change::toml)
            }
            Kind::JsonLines => {
                let mut lines: Vec<String> = valid.lines().map(str::to_owned).collect();
                let i = chance.below(lines.len());
                let line: Value = serde_json::from_str(&lines[i]).unwrap();
                lines[i] = change::document(&line, chance, change::json);
                lines.join("\n") + "\n"
            }
        }
    }

    pub(crate) fn enter(&self, world: &World, changed: &str) {
        world.write(self.file, changed);
        (self.enter)(world);
    }

    /// Leaves the world as it was for the next draw: some commands mend what they find.
    pub(crate) fn leave(&self, world: &World, valid: &str) {
        world.write(self.file, valid);
    }
}

/// Nothing is promised of what a document says but that it ends.
fn ends<T>(result: Result<T>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(error) => {
            let told = error.to_string();
            assert!(
                !told.contains('\n') && !told.is_empty(),
                "not one line: {told:?}"
            );
            None
        }
    }
}

/// Most pixels, samples and steps of what is computed here: what takes longer is asked of other
/// tests.
const FEW_PIXELS: u64 = 128 * 96;
const FEW_STEPS: f64 = 20_000.0;
const FEW_SAMPLES: usize = 500;

fn is_small(image: [u32; 2], options: &RenderOptions) -> bool {
    let samples =
        options.subsamples.pow(2) + options.light_samples.pow(2) + options.ambient_samples;
    image.iter().map(|&side| u64::from(side)).product::<u64>() <= FEW_PIXELS
        && samples <= FEW_SAMPLES
}

fn falls_soon(scene: &Scene, settle: &SettleOptions) -> bool {
    let falling = scene
        .objects
        .iter()
        .filter(|o| matches!(o.placement, Placement::Drop { .. }))
        .count();
    let steps =
        settle.time_limit / settle.step * f64::from(settle.attempts) * f64::from(settle.iterations)
            / 4.0;
    falling == 0 || (falling <= 4 && steps <= 6.0 * FEW_STEPS)
}

fn recipe(world: &World) -> Option<()> {
    let setup = ends(DatasetConfig::read(world.path("recipe.toml"), &[]))?;
    let pipeline = ends(Pipeline::open(setup))?;
    for k in [0, 1, u64::MAX] {
        let scene = ends(pipeline.draw(k, k))?;
        let small = is_small(pipeline.config().scene.image, &pipeline.config().render);
        if k == 1
            && small
            && scene.lights.len() < 4
            && falls_soon(&scene, &pipeline.config().scene.settle)
        {
            ends(pipeline.take(scene));
        }
    }
    Some(())
}

fn scene(world: &World, file: &str) -> Option<()> {
    let path = world.path(file);
    let scene = ends(io::read_document::<Scene>(&path))?;
    ends(scene.check())?;
    if !falls_soon(&scene, &SettleOptions::default()) || scene.lights.len() > 3 {
        return None;
    }
    let setup: DatasetConfig = toml::from_str("").unwrap();
    let folders = |folder: &str| world.path(folder);
    let mut setup = DatasetConfig {
        assets: folders("assets"),
        backgrounds: folders("backgrounds"),
        ..setup
    };
    setup.scene.image = scene.image;
    let pipeline = ends(Pipeline::open_for(setup, &scene))?;
    if is_small(scene.image, &RenderOptions::default()) && scene.objects.len() <= 4 {
        let sample = ends(pipeline.take(scene))?;
        label::overlay(&sample.frame, &sample.labels, &pipeline.library().classes);
    }
    Some(())
}

fn label_file(world: &World) -> Option<()> {
    let label = ends(camera::read_label(world.path("backgrounds/a.label.json")))?;
    let options = SolveOptions::default();
    let solution = ends(camera::solve(&label, &options).map_err(Into::into))?;
    camera::doctor(&label, &solution, &options);
    ends(camera::check_distance(&solution));
    let _ = camera::solve_joint(&[label.clone(), label.clone()], &options);
    serde_json::to_string(&CameraFile::new(&label, &solution)).unwrap();
    let photo: Image<LinearRgb> = io::read(world.path("backgrounds/a.png")).unwrap();
    if label.image_size() == [96, 72] {
        camera::overlay(&photo, &solution);
    }
    let map =
        solution.fit.px_per_metre * solution.fit.px_per_metre * solution.size[0] * solution.size[1];
    if !(1e5..=1e8).contains(&map) {
        ends(camera::rectify(
            &Pyramid::new(photo),
            &solution.camera,
            solution.k1(),
            solution.size,
            solution.fit.px_per_metre,
        ));
    }
    ends(Pipeline::open(world_setup(world))).map(drop)
}

fn world_setup(world: &World) -> DatasetConfig {
    DatasetConfig {
        assets: world.path("assets"),
        backgrounds: world.path("backgrounds"),
        ..DatasetConfig::default()
    }
}

fn camera_file(world: &World) -> Option<()> {
    let file = ends(io::read_json::<CameraFile>(world.path("a.camera.json")))?;
    let camera = file.camera();
    camera.to_blender_script();
    serde_json::to_string(&camera.to_opencv()).unwrap();
    ColmapModel::new([("a.png", &camera, file.k1())]);
    Some(())
}

fn labelme(world: &World) -> Option<()> {
    let path = world.path("labelme.json");
    let labels = ends(camera::read_labels(path, Some([0.56, 0.37])))?;
    for labelled in labels {
        let _ = camera::solve(&labelled.label, &SolveOptions::default());
    }
    Some(())
}

fn manifest(world: &World) -> Option<()> {
    let library = ends(Library::open(world.path("assets")))?;
    let photos: usize = library.assets.iter().map(|asset| asset.photos.len()).sum();
    if photos < 10 {
        asset::contact_sheets(&library).for_each(|page| drop(ends(page)));
    }
    let pipeline = ends(Pipeline::open(world_setup(world)))?;
    ends(pipeline.draw(0, 0)).map(drop)
}

fn asset_list(world: &World, file: &str) -> Option<()> {
    let list = ends(List::read(world.path(file)))?;
    if list.photos.len() < 5 {
        ends(asset::build(
            world.path(file),
            world.path("built"),
            &|_, _| (),
            &AtomicBool::new(false),
        ));
        let _ = std::fs::remove_dir_all(world.path("built"));
    }
    Some(())
}

fn settle_options(world: &World) -> Option<()> {
    let options = ends(io::read_toml::<SettleOptions>(world.path("settle.toml")))?;
    let scene: Scene = io::read_toml(world.path("scene.toml")).unwrap();
    ends(options.check())?;
    if falls_soon(&scene, &options) {
        ends(petcomp::settle::settle(scene, &options));
    }
    Some(())
}

fn slab(world: &World) -> Image<LinearRgb> {
    io::read(world.path("slab.png")).unwrap()
}

fn cut_out_options(world: &World) -> Option<()> {
    let options = ends(io::read_toml::<CutOutOptions>(world.path("cut_out.toml")))?;
    ends(cut_out(&slab(world), &options)).map(drop)
}

fn segment_options(world: &World) -> Option<()> {
    let options = ends(io::read_toml::<SegmentOptions>(world.path("segment.toml")))?;
    let found = ends(segment(&slab(world), &options))?;
    found.steps.iter().for_each(|step| drop(step.shown()));
    Some(())
}

fn dataset_folder(world: &World) -> Option<()> {
    let folder = world.path("dataset");
    ends(dataset::contact_sheet_of(&folder, 24));
    let options = DatasetReportOptions {
        most: 4,
        ..Default::default()
    };
    ends(dataset::page::page(&folder, &options).map(|page| page.document()));
    ends(dataset::check(&folder).map(|checked| (checked.balance(), checked.notes())));
    ends(
        YoloSet::read(&folder)
            .and_then(|all| all.partitioned(Partition::Grouped(dataset::Group::Selection), 0.5, 1)),
    );
    if let Some(record) = ends(io::read_json::<dataset::SampleRecord>(
        folder.join("scenes/val/000000.json"),
    )) {
        sound_labels(&record.labels);
    }
    let journal = world.read("dataset/index.jsonl");
    ends(dataset::repair(&folder));
    world.write("dataset/index.jsonl", &journal);
    Some(())
}

fn sound_labels(labels: &Labels) {
    if labels.objects.len() < 10 {
        label::borders(labels, 1.0);
        label::cyclic_overlaps(&labels.objects);
    }
}

fn merge(world: &World) -> Option<()> {
    let shards = [1, 2].map(|index| world.path(&format!("shard-{index}")));
    let out = world.path("merged");
    for shards in [&shards[..], &shards[..1]] {
        let merged = dataset::merge(shards, &out, &|_| {}, &AtomicBool::new(false));
        ends(merged);
    }
    let _ = std::fs::remove_dir_all(out);
    Some(())
}

fn yolo_set(world: &World) -> Option<()> {
    let folder = world.path("dataset");
    ends(YoloSet::open(&folder));
    ends(
        YoloSet::read(&folder)
            .and_then(|all| all.partitioned(Partition::Consecutive { guard: 1 }, 0.5, 1)),
    );
    ends(dataset::check(&folder).map(|checked| (checked.balance(), checked.notes()))).map(drop)
}

fn evaluated(world: &World, sheets: Vec<eval::EvalImage>) {
    let options = EvalReportOptions {
        rounds: 3,
        ..Default::default()
    };
    let run = Run {
        name: "run".into(),
        sheets,
    };
    Metrics::of(&run, &options);
    ends(eval::page::write(&world.path("eval"), &[run], &options));
}

fn yolo_eval(world: &World) -> Option<()> {
    let truth = eval::read_yolo_truth(&world.path("dataset/labels/val"), None, None);
    let mut truth = ends(truth)?;
    let found = eval::read_yolo_detections(&world.path("found"), &mut truth);
    ends(found)?;
    evaluated(world, truth.sheets);
    Some(())
}

fn coco_eval(world: &World) -> Option<()> {
    let mut truth = ends(eval::read_coco_truth(&world.path("truth.json")))?;
    let found = eval::read_coco_results(&world.path("found.json"), &mut truth);
    ends(found)?;
    evaluated(world, truth.sheets);
    Some(())
}

fn tags(world: &World) -> Option<()> {
    let sheets: Vec<_> = ["000000", "000001"]
        .map(|image| eval::EvalImage::new(image, Vec::new()))
        .into();
    let tags = ends(eval::read_tags(&world.path("tags.csv"), &sheets))?;
    let run = Run {
        name: "run".into(),
        sheets,
    };
    eval::page::factors_table(
        &[run],
        &EvalReportOptions {
            tags,
            rounds: 2,
            ..Default::default()
        },
    );
    Some(())
}

fn reference_scene(world: &World) -> Option<()> {
    let path = world.path("cycles/scene.json");
    let shot = ends(cycles::import(path, Some([32, 24])))?;
    ends(render::check(&shot))?;
    if shot.cards.len() < 5 && shot.lights.len() < 5 {
        render::render(&shot, &RenderOptions::default());
    }
    Some(())
}

fn overrides(world: &World) -> Option<()> {
    let text = world.read("overrides.txt");
    let (limits, rest): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| line.starts_with("limit."));
    for limit in limits {
        let _ = ends(limit.trim_start_matches("limit.").parse::<LimitOverride>());
    }
    let given: Vec<Override> = rest.iter().filter_map(|line| ends(line.parse())).collect();
    let of = |table: &str| {
        given
            .iter()
            .filter(|o| format!("{o:?}").contains(table))
            .cloned()
            .collect::<Vec<_>>()
    };
    if let Some(options) = ends(io::from_overrides::<KeyOptions>("key", &of("key."))) {
        let photo = slab(world).map(LinearRgb::opaque);
        let _: Option<Image<PremulRgba>> =
            ends(Keying::new(&photo, Screen::Color(LinearRgb::new(0.04, 0.4, 0.08))).run(&options))
                .map(|k| k.cutout);
    }
    ends(io::from_overrides::<FilmOptions>("film", &of("film.")));
    ends(DatasetConfig::read(world.path("recipe.toml"), &given)).map(drop)
}
