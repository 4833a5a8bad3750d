//! Datasets that are hard to write: with empty pictures, with crowds, interrupted, with numbers at
//! the ends of their ranges.

use super::staged::{
    camera_above, empty_scene, grey, level_card, one_deep_pixel, rendered, temporary_folder,
};
use super::{HardCase, Outcome};
use petcomp::composite;
use petcomp::dataset::{
    Format, JOURNAL, LabelConfig, Obstructed, Part, Pictures, Plan, Provenance, Sample,
    SampleRange, Shard, Sidecar, Split, SplitOrder, Writer, check, generate, repair,
};
use petcomp::io;
use petcomp::label::{LabelOptions, label};
use petcomp::scene::{Background, CameraSource, Range, Recipe, Scene, Shot};
use petcomp::{DeepImage, DeepSample, Error, LinearRgb, ObjectId, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Objects in one pixel.
const CROWD_SIZE: u32 = 300;
const IMAGE: [u32; 2] = [64, 48];

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let groups = [
        written_pictures(),
        runs(),
        splits(),
        draws(),
        invalid_recipes(),
    ];
    Ok(groups.into_iter().flatten().collect())
}

fn written_pictures() -> Vec<HardCase> {
    vec![
        HardCase::new(
            "dataset of empty scenes",
            "5 pictures without an object, as YOLO, COCO and VOC",
            "no labels, no faults: 0",
            generate_empty_pictures,
        ),
        HardCase::new(
            "300 objects in one pixel",
            "equal boxes of the same class, all labelled",
            "one row for YOLO's equal rows; no faults",
            generate_crowded_pictures,
        ),
        HardCase::new(
            "YOLO row of one pixel",
            "pixel (3, 2) of 64 x 48",
            format!("3.5/64 2.5/48 1/64 1/48: {}", ONE_PIXEL_ROW.trim_end()),
            write_row_of_one_pixel,
        ),
        HardCase::refused(
            "one-pixel pictures",
            "1 x 1 pixel, for YOLO",
            "expected at least 10 a side",
            || {
                let shot = Shot::new(camera_above([1, 1], 100.0));
                TestDataset::new(1, |_| rendered_sample(&shot))
            },
        ),
    ]
}

fn runs() -> Vec<HardCase> {
    vec![
        HardCase::new(
            "journal truncated in the middle of a line",
            "10 pictures; the run continues",
            "only the picture of that line is regenerated: 1; then no faults",
            resume_with_cut_journal,
        ),
        HardCase::new(
            "one picture missing, another truncated",
            "10 pictures; the folder is repaired, and the run continues",
            "8 are intact, 2 are regenerated; then no faults",
            resume_after_repair,
        ),
        HardCase::refused(
            "object of a class that does not exist",
            "class 7 of 1",
            "but there are 1 classes",
            || TestDataset::new(1, |_| sample_of_class_7()),
        ),
    ]
}

fn splits() -> Vec<HardCase> {
    vec![
        split_counts(0),
        split_counts(100),
        split_counts(20),
        HardCase::new(
            "the largest index",
            "picture 2^64 - 1 of 2^64 - 1",
            "assigned to a split, without overflow",
            split_last_index,
        ),
        HardCase::new(
            "more shards than pictures",
            "10 pictures on 1000 machines",
            "each picture in exactly one shard: 10",
            contain_in_shards,
        ),
        HardCase::new(
            "shard 0, shard 5 of 4, shard 1 of 0",
            "as --shard",
            "rejected: 3",
            make_invalid_shards,
        ),
    ]
}

fn draws() -> Vec<HardCase> {
    vec![
        HardCase::new(
            "recipe with only empty scenes",
            "negatives = 1, and objects = 0, 20 scenes of each, without a catalog",
            "no object in any scene: 0",
            draw_empty_scenes,
        ),
        HardCase::new(
            "seeds and numbers at the ends of their ranges",
            "seeds 0, 1 and 2^64 - 1, scenes 0, 1 and 2^64 - 1",
            "nine different scenes, each the same when drawn again",
            compare_draws,
        ),
    ]
}

/// A picture of a shot, its labels, and its scene.
fn rendered_sample(shot: &Shot) -> Sample {
    sample(shot, rendered(shot))
}

fn empty_shot() -> Shot {
    Shot::new(camera_above(IMAGE, 100.0))
}

fn sample(shot: &Shot, deep: DeepImage) -> Sample {
    let scene = empty_scene(shot.camera);
    let labels = label(&deep, shot, &LabelOptions::default());
    let frame = composite::frame(&deep, None).map(|p| p.color().opaque());
    Sample {
        deep,
        provenance: Some(Provenance::from_scene(scene)),
        ..Sample::new(frame, labels)
    }
}

/// A card whose position distinguishes picture `k` from the others.
fn with_a_card(k: u64) -> Sample {
    let center = [0.01 * k as f64 - 0.05, 0.0, 0.0];
    let card = level_card(1, center, 0.1, grey(1.0));
    rendered_sample(&empty_shot().with_ambient(LinearRgb::WHITE).with_card(card))
}

/// A dataset in every layout, for generating and counting.
struct TestDataset {
    folder: tempfile::TempDir,
    count: u64,
}

impl TestDataset {
    fn new(count: u64, make: impl Fn(u64) -> Sample + Sync) -> Result<Self> {
        let folder = temporary_folder()?;
        let dataset = Self { folder, count };
        dataset.generate_missing(make)?;
        Ok(dataset)
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Generates what is missing; returns the number of pictures generated.
    fn generate_missing(&self, make: impl Fn(u64) -> Sample + Sync) -> Result<u64> {
        let running = AtomicBool::new(false);
        Ok(generate(&self.plan(), |k| Ok(make(k)), &|_| (), &running)?.made)
    }

    fn plan(&self) -> Plan {
        Plan {
            folder: self.path().into(),
            count: self.count,
            range: SampleRange::All,
            seed: 0,
            recipe: serde_json::json!({}),
            classes: vec!["bottle".into()],
            split: Split::default(),
            obstructed: Obstructed::Keep,
            writers: all_writers(),
            archives: None,
            store: None,
            inputs: Default::default(),
        }
    }

    /// The findings of the checker, without those that any small set of similar pictures has.
    fn faults(&self) -> Result<Vec<String>> {
        let findings = check(self.path())?.findings;
        let messages = findings
            .into_iter()
            .map(|finding| finding.diagnostic.message);
        Ok(messages.filter(|what| !is_about_similarity(what)).collect())
    }

    /// Images and rows of labels.
    fn counts(&self) -> Result<(usize, usize)> {
        let checked = check(self.path())?;
        Ok((checked.images, checked.rows.iter().sum()))
    }

    fn picture(&self, k: u64) -> PathBuf {
        self.path().join(format!("images/train/{k:06}.png"))
    }

    fn label(&self, name: &str) -> Result<String> {
        io::read_text(self.path().join("labels").join(name))
    }
}

/// Truncates a file to a length computed from its own.
fn cut_off_file(path: &Path, length: impl Fn(usize) -> usize) -> Result<()> {
    let mut bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    bytes.truncate(length(bytes.len()));
    std::fs::write(path, bytes).map_err(|e| Error::file(path, e))
}

fn all_writers() -> Vec<Arc<dyn Writer>> {
    let config = LabelConfig {
        formats: vec![Format::Yolo, Format::Coco, Format::Voc],
        ..LabelConfig::default()
    };
    let mut writers: Vec<Arc<dyn Writer>> = vec![Arc::new(Pictures::default()), Arc::new(Sidecar)];
    writers.extend(config.writers(&Pictures::default()));
    writers
}

/// The number of faults, and a list of them.
fn listed(faults: &[String]) -> String {
    let text = format!("{} faults {}", faults.len(), faults.join("; "));
    text.trim_end().into()
}

fn is_about_similarity(message: &str) -> bool {
    message.contains("looks like") || message.contains("same bytes")
}

fn generate_empty_pictures() -> Result<Outcome> {
    let dataset = TestDataset::new(5, |_| rendered_sample(&empty_shot()))?;
    let (images, rows) = dataset.counts()?;
    let faults = dataset.faults()?;
    Ok(Outcome::new(
        format!("{images} images, {rows} rows, {}", listed(&faults)),
        (images, rows) == (5, 0) && faults.is_empty(),
    ))
}

fn generate_crowded_pictures() -> Result<Outcome> {
    let dataset = TestDataset::new(2, |_| crowded_sample())?;
    let rows = dataset.label("train/000001.txt")?.lines().count();
    let faults = dataset.faults()?;
    Ok(Outcome::new(
        format!("{rows} row, {}", listed(&faults)),
        rows == 1 && faults.is_empty(),
    ))
}

/// Pixel (3, 2) holds 300 objects, of which the first is visible.
fn crowded_sample() -> Sample {
    let cards = (1..=CROWD_SIZE).map(|id| level_card(id, [0.0; 3], 0.01, grey(1.0)));
    let shot = cards.fold(empty_shot(), Shot::with_card);
    let samples: Vec<_> = (1..=CROWD_SIZE).map(opaque_sample).collect();
    sample(&shot, one_deep_pixel(IMAGE, &samples))
}

fn opaque_sample(id: u32) -> DeepSample {
    DeepSample {
        object: ObjectId(id),
        alpha: 1.0,
        visible: f32::from(u8::from(id == 1)),
        ..DeepSample::default()
    }
}

/// A row of class 0 whose box is pixel (3, 2) of 64 x 48.
const ONE_PIXEL_ROW: &str = "0 0.054688 0.052083 0.015625 0.020833\n";

fn write_row_of_one_pixel() -> Result<Outcome> {
    let row = TestDataset::new(2, |_| crowded_sample())?.label("train/000001.txt")?;
    Ok(Outcome::new(row.trim_end(), row == ONE_PIXEL_ROW))
}

/// Ten pictures of a card.
fn dataset_of_cards() -> Result<TestDataset> {
    TestDataset::new(10, with_a_card)
}

fn resume_with_cut_journal() -> Result<Outcome> {
    let dataset = dataset_of_cards()?;
    cut_off_file(&dataset.path().join(JOURNAL), |whole| whole - 20)?;
    let again = dataset.generate_missing(with_a_card)?;
    let faults = dataset.faults()?.len();
    Ok(Outcome::new(
        format!("{again} generated, {faults} faults"),
        again == 1 && faults == 0,
    ))
}

fn resume_after_repair() -> Result<Outcome> {
    let dataset = dataset_of_cards()?;
    let lost = dataset.picture(1);
    std::fs::remove_file(&lost).map_err(|e| Error::file(lost, e))?;
    cut_off_file(&dataset.picture(2), |whole| whole / 2)?;
    let (good, lost) = repair(dataset.path())?;
    let again = dataset.generate_missing(with_a_card)?;
    let faults = dataset.faults()?.len();
    Ok(Outcome::new(
        format!("{good} intact, {lost} lost, {again} generated, {faults} faults"),
        (good, lost, again, faults) == (8, 2, 2, 0),
    ))
}

fn sample_of_class_7() -> Sample {
    let mut sample = with_a_card(0);
    for object in &mut sample.labels.objects {
        object.class = 7;
    }
    sample
}

fn split_counts(percent: u8) -> HardCase {
    let expected = 10 * usize::from(percent);
    HardCase::new(
        format!("{percent} % for validation"),
        "1000 pictures, interleaved and consecutive",
        format!("{expected} for validation in both orders"),
        move || count_splits(percent, expected),
    )
}

const ORDERS: [SplitOrder; 2] = [SplitOrder::Interleaved, SplitOrder::Consecutive];

fn count_splits(percent: u8, expected: usize) -> Result<Outcome> {
    let found = ORDERS.map(|order| count_validation(percent, order));
    Ok(Outcome::new(
        format!("{} and {}", found[0], found[1]),
        found == [expected; 2],
    ))
}

/// Number of pictures out of 1000 that are for validation.
fn count_validation(val_percent: u8, order: SplitOrder) -> usize {
    let split = Split {
        val_percent,
        order,
        ..Split::default()
    };
    let parts = (0..1000).map(|k| split.part(k, 1000));
    parts.filter(|part| *part == Part::Val).count()
}

fn split_last_index() -> Result<Outcome> {
    let parts = ORDERS.map(|order| {
        let split = Split {
            order,
            ..Split::default()
        };
        split.part(u64::MAX, u64::MAX)
    });
    Ok(Outcome::new(format!("{parts:?}"), parts[1] == Part::Val))
}

fn contain_in_shards() -> Result<Outcome> {
    let shards: Result<Vec<_>> = (1..=1000).map(|index| Shard::new(index, 1000)).collect();
    let shards = shards?;
    let on_one = (0..10).filter(|&k| count_containing(&shards, k) == 1);
    Ok(Outcome::count(on_one.count(), 10, ""))
}

fn count_containing(shards: &[Shard], k: u64) -> usize {
    shards.iter().filter(|shard| shard.contains(k)).count()
}

fn make_invalid_shards() -> Result<Outcome> {
    let attempts = [(0, 4), (5, 4), (1, 0)].map(|(index, of)| Shard::new(index, of));
    let refused = attempts.iter().filter(|attempt| attempt.is_err());
    Ok(Outcome::count(refused.count(), 3, "refused"))
}

fn tray() -> Background {
    let camera = CameraSource::Rectangle {
        corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
        photo: [60, 40],
        focal_px: None,
    };
    Background::new("tray", [0.6, 0.4], camera)
}

fn draw_empty_scenes() -> Result<Outcome> {
    let negative = Recipe {
        negatives: 1.0,
        ..Recipe::default()
    };
    let objects = count_objects(&without_objects())? + count_objects(&negative)?;
    Ok(Outcome::none(objects, "objects"))
}

fn without_objects() -> Recipe {
    Recipe {
        objects: Range::fixed(0.0).into(),
        ..Recipe::default()
    }
}

/// Objects of 20 scenes.
fn count_objects(recipe: &Recipe) -> Result<usize> {
    let scenes = (0..20).map(|k| recipe.scene(1, k, &[tray()], &[]));
    scenes.map(|scene| Ok(scene?.objects.len())).sum()
}

fn draw_extreme_seeds() -> Result<Vec<Scene>> {
    let recipe = without_objects();
    let ends = [0, 1, u64::MAX];
    let pairs = ends.into_iter().flat_map(|seed| ends.map(|k| (seed, k)));
    pairs
        .map(|(seed, k)| recipe.scene(seed, k, &[tray()], &[]))
        .collect()
}

fn compare_draws() -> Result<Outcome> {
    let once = draw_extreme_seeds()?;
    let different = count_distinct(&once);
    let is_same = once == draw_extreme_seeds()?;
    let same = if is_same { "the same" } else { "not the same" };
    Ok(Outcome::new(
        format!("{different} different, {same} again"),
        different == 9 && is_same,
    ))
}

fn count_distinct(scenes: &[Scene]) -> usize {
    (0..scenes.len())
        .filter(|&i| !scenes[..i].contains(&scenes[i]))
        .count()
}

fn invalid_recipes() -> Vec<HardCase> {
    vec![
        refused("recipe without a background", "background", &[], |_| ()),
        on_tray("recipe without a catalog", "no asset", |_| ()),
        on_tray("pictures of 0 x 48", "image", |r| r.image = [0, 48]),
        on_tray("10^9 objects", "objects", |r| {
            r.objects = Range::fixed(1e9).into()
        }),
        on_tray("reversed range", "objects", |r| {
            r.objects = Range::new(5.0, 2.0).into()
        }),
        on_tray("range of NaN", "scale", |r| {
            r.scale = Range::fixed(f64::NAN)
        }),
        on_tray("share of negatives of 1.5", "negatives", |r| {
            r.negatives = 1.5
        }),
    ]
}

fn on_tray(name: &str, cause: &'static str, spoil: fn(&mut Recipe)) -> HardCase {
    refused(name, cause, &[tray()], spoil)
}

/// An otherwise valid recipe with one mistake.
fn refused(
    name: &str,
    cause: &'static str,
    backgrounds: &[Background],
    spoil: fn(&mut Recipe),
) -> HardCase {
    let backgrounds = backgrounds.to_vec();
    HardCase::refused(name, "an otherwise valid recipe", cause, move || {
        let mut recipe = Recipe::default();
        spoil(&mut recipe);
        recipe.scene(0, 0, &backgrounds, &[])
    })
}
