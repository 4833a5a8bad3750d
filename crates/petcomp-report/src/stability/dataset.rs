//! Datasets that are hard to write: of empty pictures, of crowds, cut off in the middle, with numbers at their ends.

use super::staged::{above, grey, level, scene};
use super::{Case, Outcome};
use petcomp::composite;
use petcomp::dataset::{
    Format, JOURNAL, LabelConfig, Obstructed, Part, Pictures, Plan, Provenance, Sample,
    SampleRange, Shard, Sidecar, Split, SplitOrder, Writer, check, generate, repair,
};
use petcomp::io;
use petcomp::label::{LabelOptions, label};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{Background, CameraSource, Range, Recipe, Shot};
use petcomp::{DeepImage, DeepSample};
use petcomp::{Error, Result};
use petcomp::{LinearRgb, ObjectId};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Objects in one pixel.
const CROWD: u32 = 300;
const IMAGE: [u32; 2] = [64, 48];

pub(super) fn cases() -> Result<Vec<Case>> {
    let mut cases = vec![
        empty_pictures(),
        crowd(),
        row_of_one_pixel(),
        too_small(),
        cut_journal(),
        lost_picture(),
        classes_missing(),
        splits(0),
        splits(100),
        splits(20),
        last_number(),
        shards(),
        no_shard(),
        negatives(),
        seeds(),
    ];
    cases.extend(recipes());
    Ok(cases)
}

/// A picture of a shot, its labels, and what it was made from.
fn taken(shot: &Shot) -> Sample {
    let deep = render(shot, &RenderOptions::default());
    sample(shot, deep)
}

fn sample(shot: &Shot, deep: DeepImage) -> Sample {
    let scene = scene(shot.camera);
    let labels = label(&deep, shot, &LabelOptions::default());
    let frame = composite::frame(&deep, None).map(|p| p.color().opaque());
    Sample {
        deep,
        provenance: Some(Provenance::from_scene(scene)),
        ..Sample::new(frame, labels)
    }
}

/// A card whose brightness tells picture `k` from the others.
fn with_a_card(k: u64, size: f64) -> Shot {
    let at = 0.01 * k as f64 - 0.05;
    Shot::new(above(IMAGE, 100.0))
        .with_ambient(LinearRgb::WHITE)
        .with_card(level(1, [at, 0.0, 0.0], size, grey(1.0)))
}

/// A dataset in every layout, made and counted.
struct Made {
    folder: tempfile::TempDir,
    count: u64,
}

impl Made {
    fn of(count: u64, make: impl Fn(u64) -> Sample + Sync) -> Result<Self> {
        let folder = tempfile::tempdir().map_err(|e| Error::file(std::env::temp_dir(), e))?;
        let made = Self { folder, count };
        made.go_on(make)?;
        Ok(made)
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Makes what is missing; how many that were.
    fn go_on(&self, make: impl Fn(u64) -> Sample + Sync) -> Result<u64> {
        let report = generate(
            &self.plan(),
            |k| Ok(make(k)),
            &|_| (),
            &AtomicBool::new(false),
        )?;
        Ok(report.made)
    }

    fn plan(&self) -> Plan {
        let formats = vec![Format::Yolo, Format::Coco, Format::Voc];
        let mut writers: Vec<Box<dyn Writer>> =
            vec![Box::new(Pictures::default()), Box::new(Sidecar)];
        writers.extend(
            LabelConfig {
                formats,
                ..LabelConfig::default()
            }
            .writers(&Pictures::default()),
        );
        Plan {
            folder: self.path().into(),
            count: self.count,
            range: SampleRange::All,
            seed: 0,
            recipe: serde_json::json!({}),
            classes: vec!["bottle".into()],
            split: Split::default(),
            obstructed: Obstructed::Keep,
            writers,
            inputs: Default::default(),
        }
    }

    /// Everything wrong with it, without the faults that small sets of like pictures have.
    fn faults(&self) -> Result<Vec<String>> {
        let faults = check(self.path())?.findings;
        let told = faults.iter().map(|fault| fault.diagnostic.message.clone());
        Ok(told
            .filter(|what| !what.contains("looks like") && !what.contains("same bytes"))
            .collect())
    }

    fn label(&self, name: &str) -> Result<String> {
        io::read_text(self.path().join("labels").join(name))
    }
}

fn empty_pictures() -> Case {
    Case::new(
        "dataset of empty scenes",
        "5 pictures without an object, as YOLO, COCO and VOC",
        "no label, no fault: 0",
        || {
            let made = Made::of(5, |_| taken(&Shot::new(above(IMAGE, 100.0))))?;
            let (faults, checked) = (made.faults()?, check(made.path())?);
            let rows: usize = checked.rows.iter().sum();
            let told = format!(
                "{} images, {rows} rows, {} faults {}",
                checked.images,
                faults.len(),
                faults.join("; ")
            );
            Ok(Outcome::new(
                told.trim_end(),
                rows == 0 && faults.is_empty() && checked.images == 5,
            ))
        },
    )
}

fn crowd() -> Case {
    Case::new(
        "300 objects in one pixel",
        "equal boxes of equal class, all labelled",
        "YOLO's equal rows are one; no fault",
        || {
            let made = Made::of(2, |_| crowded())?;
            let (rows, faults) = (
                made.label("train/000001.txt")?.lines().count(),
                made.faults()?,
            );
            Ok(Outcome::new(
                format!("{rows} row, {} faults {}", faults.len(), faults.join("; ")),
                rows == 1 && faults.is_empty(),
            ))
        },
    )
}

/// Pixel (3, 2) holds 300 objects, the first of them seen.
fn crowded() -> Sample {
    let cards = (1..=CROWD).map(|id| level(id, [0.0; 3], 0.01, grey(1.0)));
    let shot = cards.fold(Shot::new(above(IMAGE, 100.0)), Shot::with_card);
    let samples = (1..=CROWD).map(|id| DeepSample {
        object: ObjectId(id),
        alpha: 1.0,
        visible: f32::from(u8::from(id == 1)),
        ..DeepSample::default()
    });
    let samples: Vec<_> = samples.collect();
    let [w, h] = IMAGE.map(|side| side as usize);
    let pixels = (0..w * h).map(|i| {
        if i == 2 * w + 3 {
            samples.clone()
        } else {
            Vec::new()
        }
    });
    let deep = DeepImage::from_pixels(petcomp::Image::filled(w, h, LinearRgb::WHITE), pixels);
    sample(&shot, deep)
}

fn row_of_one_pixel() -> Case {
    const ROW: &str = "0 0.054688 0.052083 0.015625 0.020833\n";
    Case::new(
        "YOLO row of one pixel",
        "pixel (3, 2) of 64 x 48",
        format!("3.5/64 2.5/48 1/64 1/48: {}", ROW.trim_end()),
        || {
            let row = Made::of(2, |_| crowded())?.label("train/000001.txt")?;
            Ok(Outcome::new(row.trim_end(), row == ROW))
        },
    )
}

fn too_small() -> Case {
    Case::new(
        "one-pixel pictures",
        "1 x 1 pixel, for YOLO",
        "refused: \"expected at least 10 a side\"",
        || {
            let made = Made::of(1, |_| taken(&Shot::new(above([1, 1], 100.0))));
            Ok(Outcome::refused(
                made.map(|_| ()),
                "expected at least 10 a side",
            ))
        },
    )
}

/// Ten pictures of a card.
fn of_cards() -> Result<Made> {
    Made::of(10, |k| taken(&with_a_card(k, 0.1)))
}

fn cut_journal() -> Case {
    Case::new(
        "journal cut off in the middle of a line",
        "10 pictures; the run goes on",
        "only the picture of that line is made again: 1; then no fault",
        || {
            let made = of_cards()?;
            let path = made.path().join(JOURNAL);
            let text = io::read_text(&path)?;
            io::write_text(&path, &text[..text.len() - 20])?;
            let again = made.go_on(|k| taken(&with_a_card(k, 0.1)))?;
            let faults = made.faults()?;
            Ok(Outcome::new(
                format!("{again} made, {} faults", faults.len()),
                again == 1 && faults.is_empty(),
            ))
        },
    )
}

fn lost_picture() -> Case {
    Case::new(
        "a picture lost, another cut off",
        "10 pictures; the folder is mended, and the run goes on",
        "8 are good, 2 are made again; then no fault",
        || {
            let made = of_cards()?;
            let picture = |k: u64| made.path().join(format!("images/train/{k:06}.png"));
            std::fs::remove_file(picture(1)).map_err(|e| Error::file(picture(1), e))?;
            let half = std::fs::read(picture(2)).map_err(|e| Error::file(picture(2), e))?;
            std::fs::write(picture(2), &half[..half.len() / 2])
                .map_err(|e| Error::file(picture(2), e))?;
            let (good, lost) = repair(made.path())?;
            let again = made.go_on(|k| taken(&with_a_card(k, 0.1)))?;
            let faults = made.faults()?;
            let told = format!(
                "{good} good, {lost} lost, {again} made, {} faults",
                faults.len()
            );
            Ok(Outcome::new(
                told,
                (good, lost, again) == (8, 2, 2) && faults.is_empty(),
            ))
        },
    )
}

fn classes_missing() -> Case {
    Case::new(
        "object of a class that there is not",
        "class 7 of 1",
        "refused, by \"but there are 1 classes\"",
        || {
            let made = Made::of(1, |_| {
                let mut sample = taken(&with_a_card(0, 0.1));
                sample.labels.objects.iter_mut().for_each(|o| o.class = 7);
                sample
            });
            Ok(Outcome::refused(
                made.map(|_| ()),
                "but there are 1 classes",
            ))
        },
    )
}

fn splits(percent: u8) -> Case {
    let expected = 10 * u64::from(percent);
    Case::new(
        format!("{percent} % for validation"),
        "1000 pictures, interleaved and consecutive",
        format!("{expected} for validation, either way"),
        move || {
            let count = |order| {
                let split = Split {
                    val_percent: percent,
                    order,
                };
                (0..1000)
                    .filter(|&k| split.part(k, 1000) == Part::Val)
                    .count() as u64
            };
            let found = [
                count(SplitOrder::Interleaved),
                count(SplitOrder::Consecutive),
            ];
            Ok(Outcome::new(
                format!("{} and {}", found[0], found[1]),
                found == [expected; 2],
            ))
        },
    )
}

fn last_number() -> Case {
    Case::new(
        "the last number there is",
        "picture 2^64 - 1 of 2^64 - 1",
        "a part, without overflow",
        || {
            let parts = [SplitOrder::Interleaved, SplitOrder::Consecutive].map(|order| {
                Split {
                    order,
                    ..Split::default()
                }
                .part(u64::MAX, u64::MAX)
            });
            Ok(Outcome::new(format!("{parts:?}"), parts[1] == Part::Val))
        },
    )
}

fn shards() -> Case {
    Case::new(
        "more shards than pictures",
        "10 pictures on 1000 machines",
        "each picture on exactly one: 10",
        || {
            let all = (1..=1000)
                .map(|index| Shard::new(index, 1000))
                .collect::<Result<Vec<_>>>()?;
            let once = (0..10)
                .filter(|&k| all.iter().filter(|shard| shard.contains(k)).count() == 1)
                .count();
            Ok(Outcome::near(once as f64, 10.0, 0.0, ""))
        },
    )
}

fn no_shard() -> Case {
    Case::new(
        "shard 0, shard 5 of 4, shard 1 of 0",
        "as --shard",
        "refused: 3",
        || {
            let refused = [(0, 4), (5, 4), (1, 0)]
                .iter()
                .filter(|(index, of)| Shard::new(*index, *of).is_err())
                .count();
            Ok(Outcome::near(refused as f64, 3.0, 0.0, "refused"))
        },
    )
}

fn tray() -> Background {
    let corners_px = [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]];
    let camera = CameraSource::Rectangle {
        corners_px,
        photo: [60, 40],
        focal_px: None,
    };
    Background {
        name: "tray".into(),
        size: [0.6, 0.4],
        camera,
    }
}

fn negatives() -> Case {
    Case::new(
        "recipe of empty scenes alone",
        "negatives = 1, and objects = 0, 20 scenes of each, without a catalog",
        "no object in any: 0",
        || {
            let none = Recipe {
                objects: Range::fixed(0.0),
                ..Recipe::default()
            };
            let negative = Recipe {
                negatives: 1.0,
                ..Recipe::default()
            };
            let count = |recipe: &Recipe, k| {
                recipe
                    .scene(1, k, &[tray()], &[])
                    .map(|scene| scene.objects.len())
            };
            let all = (0..20)
                .flat_map(|k| [count(&none, k), count(&negative, k)])
                .collect::<Result<Vec<_>>>()?;
            Ok(Outcome::near(
                all.iter().sum::<usize>() as f64,
                0.0,
                0.0,
                "objects",
            ))
        },
    )
}

fn seeds() -> Case {
    Case::new(
        "seeds and numbers at their ends",
        "seeds 0, 1 and 2^64 - 1, scenes 0, 1 and 2^64 - 1",
        "nine different scenes, each the same when it is drawn again",
        || {
            let recipe = Recipe {
                objects: Range::fixed(0.0),
                ..Recipe::default()
            };
            let ends = [0, 1, u64::MAX];
            let pairs = || ends.into_iter().flat_map(|seed| ends.map(|k| (seed, k)));
            let drawn = || {
                pairs()
                    .map(|(seed, k)| recipe.scene(seed, k, &[tray()], &[]))
                    .collect::<Result<Vec<_>>>()
            };
            let (once, again) = (drawn()?, drawn()?);
            let different = (0..once.len())
                .filter(|&i| !once[..i].contains(&once[i]))
                .count();
            let same = if once == again {
                "the same again"
            } else {
                "not the same again"
            };
            Ok(Outcome::new(
                format!("{different} different, {same}"),
                different == 9 && once == again,
            ))
        },
    )
}

fn recipes() -> Vec<Case> {
    vec![
        refused("recipe without a background", "background", &[], |_| ()),
        refused("recipe without a catalog", "no asset", &[tray()], |_| ()),
        refused("pictures of 0 x 48", "image", &[tray()], |recipe| {
            recipe.image = [0, 48]
        }),
        refused("10^9 objects", "objects", &[tray()], |recipe| {
            recipe.objects = Range::fixed(1e9)
        }),
        refused("range turned round", "objects", &[tray()], |recipe| {
            recipe.objects = Range::new(5.0, 2.0)
        }),
        refused("range of NaN", "scale", &[tray()], |recipe| {
            recipe.scale = Range::fixed(f64::NAN)
        }),
        refused(
            "share of negatives of 1.5",
            "negatives",
            &[tray()],
            |recipe| recipe.negatives = 1.5,
        ),
    ]
}

/// A recipe with one thing wrong.
fn refused(name: &str, cause: &'static str, places: &[Background], spoil: fn(&mut Recipe)) -> Case {
    let places = places.to_vec();
    Case::new(
        name,
        "an else good recipe",
        format!("refused, by \"{cause}\""),
        move || {
            let mut recipe = Recipe::default();
            spoil(&mut recipe);
            Ok(Outcome::refused(recipe.scene(0, 0, &places, &[]), cause))
        },
    )
}
