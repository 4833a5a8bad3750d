//! Everything that can be read from a dataset on disk, gathered for a report.

use crate::asset::Role;
use crate::dataset::folder;
use crate::dataset::journal::lines_of;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::times::{RunTimes, runs_of};
use crate::dataset::{Labelling, Part, SampleRecord};
use crate::error::Result;
use crate::geom::BBox;
use crate::io;
use crate::label::ObjectLabel;
use crate::scene::{Distribution, Recipe, Scene};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Summary of a dataset's files.
#[derive(Clone, Debug)]
pub struct Summary {
    /// What it was made from: `dataset.json`.
    pub identity: Value,
    /// Names of the classes, in order.
    pub classes: Vec<String>,
    /// Images of both parts.
    pub images: [usize; 2],
    /// Drawn numbers by the key of their distribution in the recipe: `scale`, `start.x`,
    /// `lights[0].height`; on a belt, once for each sequence.
    pub drawn: BTreeMap<String, Vec<f64>>,
    /// How often each was chosen, on a belt for a sequence: photos of the place, assets, photos of
    /// an asset.
    pub chosen: BTreeMap<&'static str, BTreeMap<String, u64>>,
    /// Visible share of each object, 0 to 1.
    pub visible: Vec<f64>,
    /// Width and height of the box of each labelled object, pixels.
    pub boxes: Vec<[f64; 2]>,
    /// Objects and labels of each class, of both parts.
    pub balance: Vec<[[u64; 2]; 2]>,
    /// Rejected scenes: number of the sample, and why.
    pub rejected: Vec<(u64, String)>,
    /// The runs that wrote it.
    pub(crate) runs: Vec<RunTimes>,
    /// How many objects have no label, by the reason.
    pub unlabelled: BTreeMap<UnlabelledReason, u64>,
    /// Visible share of each object without a label, 0 to 1.
    pub unlabelled_visible: Vec<f64>,
    /// All samples, in order of number.
    pub glances: Vec<SampleSummary>,
}

/// A sample in a few numbers.
#[derive(Clone, Debug)]
pub struct SampleSummary {
    /// Its number.
    pub index: u64,
    /// The part that it belongs to.
    pub part: Part,
    /// Its picture and its record below the dataset's folder.
    pub files: [String; 2],
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// How many objects it contains.
    pub objects: usize,
    /// Class and box of each object with a label, pixels.
    pub labels: Vec<(u32, BBox)>,
    /// Visible share of the labelled object that is least visible; 1 if there is none.
    pub least_visible: f64,
    /// How many scenes were rejected before this one.
    pub rejected: usize,
}

/// Why an object has no label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum UnlabelledReason {
    /// It is obstructed: another object covers it.
    Covered,
    /// Nothing of it is in the picture.
    Outside,
    /// Too much of it is outside the picture.
    Truncated,
    /// No pixel shows enough of it to be in its mask.
    NoMask,
    /// The recipe or the format excludes it.
    LeftOut,
}

impl UnlabelledReason {
    /// In words.
    pub fn description(self) -> &'static str {
        match self {
            Self::Covered => "another object lies over it",
            Self::Outside => "it lies outside the picture",
            Self::Truncated => "too much of it lies outside the picture",
            Self::NoMask => "it covers too little of each pixel for a mask",
            Self::LeftOut => "left out by the recipe",
        }
    }

    /// None for an object with a label.
    pub fn of(object: &ObjectLabel, record: &SampleRecord) -> Option<Self> {
        let labelled = record.labelled.contains(&object.id);
        match (labelled, object.amodal_box.is_empty(), object.is_topmost()) {
            (_, true, _) => Some(Self::Outside),
            (true, ..) => None,
            (false, ..) if object.is_too_truncated() => Some(Self::Truncated),
            (false, ..) if object.amodal_mask.is_empty() => Some(Self::NoMask),
            (false, _, false) => Some(Self::Covered),
            (false, ..) => Some(Self::LeftOut),
        }
    }
}

/// A sample to look at.
#[derive(Clone, Debug)]
pub struct ShownSample {
    /// Its picture.
    pub picture: PathBuf,
    /// What is known of it.
    pub record: SampleRecord,
}

/// One sample of the dataset.
struct ReadSample {
    k: u64,
    part: Part,
    record: SampleRecord,
    /// Its picture and its record below the dataset's folder.
    files: [String; 2],
}

impl Summary {
    /// Reads a dataset's folder.
    ///
    /// # Errors
    /// A folder that is no dataset or one of archives only, or was written without its sidecars.
    pub fn read(folder: &Path) -> Result<Self> {
        let mut summary = Self::empty(folder)?;
        let lines = lines_of(folder)?;
        summary.images =
            Part::ALL.map(|part| lines.iter().filter(|line| line.part == part).count());
        let labelling = Labelling::of_identity(&summary.identity);
        // In batches, so that no more records are in memory than threads can read at a time.
        for batch in lines.chunks(RECORDS_PER_BATCH) {
            for (sample, line) in read_samples(folder, batch, labelling)?
                .into_iter()
                .zip(batch)
            {
                summary.add(&sample, line);
                summary.glances.push(SampleSummary::new(sample));
            }
        }
        Ok(summary)
    }

    /// A dataset from which no sample was read yet.
    fn empty(folder: &Path) -> Result<Self> {
        let identity = folder::identity_of_files(folder)?;
        let classes = folder::known_classes(&identity);
        Ok(Self {
            images: [0; 2],
            balance: vec![[[0; 2]; 2]; classes.len()],
            identity,
            classes,
            drawn: BTreeMap::new(),
            chosen: BTreeMap::new(),
            visible: Vec::new(),
            boxes: Vec::new(),
            rejected: Vec::new(),
            runs: runs_of(folder),
            unlabelled: BTreeMap::new(),
            unlabelled_visible: Vec::new(),
            glances: Vec::new(),
        })
    }

    /// A sample to look at, by its index among the glances.
    ///
    /// # Errors
    /// A record that cannot be read.
    pub fn shown(&self, folder: &Path, place: usize) -> Result<ShownSample> {
        let [picture, record] = &self.glances[place].files;
        let record: SampleRecord = io::read_json(folder.join(record))?;
        Ok(ShownSample {
            picture: folder.join(picture),
            record: record.into_labelled(Labelling::of_identity(&self.identity)),
        })
    }

    /// The distribution of a drawn number.
    pub fn distribution(&self, key: &str) -> Option<Distribution> {
        let range = match self.narrowed_recipe()?.pointer(&json_pointer(key))? {
            Value::Array(ends) => ends_of(ends)?,
            Value::Object(histogram) => {
                let values = histogram.get("values")?.as_array()?;
                return Some(Distribution::Weighted(ends_of(values)?));
            }
            fixed => [fixed.as_f64()?; 2],
        };
        Some(if ["objects", "distractors"].contains(&key) {
            Distribution::Whole(range)
        } else {
            Distribution::Uniform(range)
        })
    }

    /// The probability of an event in the recipe, 0 to 1; none for a key that is drawn otherwise.
    ///
    /// The drawn number is uniform from 0 to 1; the event happens if it is below the probability.
    pub fn chance(&self, key: &str) -> Option<f64> {
        let [_, share] = CHANCES.iter().find(|[drawn, _]| *drawn == key)?;
        let recipe = self.narrowed_recipe()?;
        recipe.pointer(&json_pointer(share))?.as_f64()
    }

    /// As JSON, without what is switched off.
    fn narrowed_recipe(&self) -> Option<Value> {
        let recipe = self.identity["recipe"]["scene"].clone();
        let recipe: Recipe = serde_json::from_value(recipe).ok()?;
        serde_json::to_value(recipe.narrowed()).ok()
    }

    fn add(&mut self, sample: &ReadSample, line: &JournalLine) {
        let record = &sample.record;
        if self.is_drawn_anew(sample) {
            self.add_draws(record);
            self.add_choices(&record.drawn);
        }
        for object in &record.labels.objects {
            self.add_object(object, record);
        }
        self.add_balance(sample.part, line);
        let rejected = record.rejected.iter().map(|why| (sample.k, why.clone()));
        self.rejected.extend(rejected);
    }

    /// Whether a sample has draws of its own: pictures of a sequence share those of the first one.
    fn is_drawn_anew(&self, sample: &ReadSample) -> bool {
        let belt = sample.record.drawn.belt;
        let frames = belt.map_or(1, |belt| belt.frames.max(1));
        let last = self.glances.last();
        last.is_none_or(|last| last.index / frames != sample.k / frames)
    }

    /// Whether its pictures come in sequences.
    pub(super) fn is_on_belt(&self) -> bool {
        self.identity["recipe"]["scene"]["belt"].is_object()
    }

    fn add_balance(&mut self, part: Part, line: &JournalLine) {
        let part = usize::from(part == Part::Val);
        for (class, counts) in self.balance.iter_mut().zip(&line.classes) {
            for (sum, count) in class[part].iter_mut().zip(counts) {
                *sum += u64::from(*count);
            }
        }
    }

    /// Counts what was chosen from lists.
    fn add_choices(&mut self, drawn: &Scene) {
        self.count("background", drawn.plate.clone());
        for object in &drawn.objects {
            match object.role {
                Role::Object => self.count("asset", object.asset.clone()),
                Role::Distractor => self.count("distractor", object.asset.clone()),
            }
            self.count("photo of the asset", object.photo.to_string());
        }
    }

    fn add_draws(&mut self, record: &SampleRecord) {
        for (path, &value) in &record.draws {
            if let Some(key) = key(path) {
                self.drawn.entry(key).or_default().push(value);
            }
        }
    }

    fn count(&mut self, what: &'static str, name: String) {
        let counts = self.chosen.entry(what).or_default();
        *counts.entry(name).or_default() += 1;
    }

    fn add_object(&mut self, object: &ObjectLabel, record: &SampleRecord) {
        self.visible.push(object.visible_fraction);
        if let Some(reason) = UnlabelledReason::of(object, record) {
            *self.unlabelled.entry(reason).or_default() += 1;
            self.unlabelled_visible.push(object.visible_fraction);
        } else {
            let bbox = object.amodal_box;
            self.boxes.push([bbox.width(), bbox.height()]);
        }
    }
}

impl SampleSummary {
    fn new(sample: ReadSample) -> Self {
        let ReadSample {
            k,
            part,
            record,
            files,
        } = sample;
        let labelled = labelled_objects(&record);
        let visible = labelled.iter().map(|object| object.visible_fraction);
        let labels = labelled
            .iter()
            .map(|object| (object.class, object.amodal_box));
        Self {
            index: k,
            part,
            files,
            image: record.labels.image,
            objects: record.labels.objects.len(),
            labels: labels.collect(),
            least_visible: visible.fold(1.0, f64::min),
            rejected: record.rejected.len(),
        }
    }
}

/// The keys of draws that decide whether something happens, each with the key of its probability in
/// the recipe.
const CHANCES: [[&str; 2]; 2] = [
    ["start.face_down", "start.face_down"],
    ["negative", "negatives"],
];

/// Number of records that are read at a time.
const RECORDS_PER_BATCH: usize = 256;

impl ReadSample {
    fn read(folder: &Path, line: &JournalLine, labelling: Labelling) -> Result<Self> {
        let record: SampleRecord = io::read_json(line.file(folder, "scenes/")?)?;
        Ok(Self {
            k: line.k,
            part: line.part,
            record: record.into_labelled(labelling),
            files: [
                line.file_name(folder, "images/")?.to_owned(),
                line.file_name(folder, "scenes/")?.to_owned(),
            ],
        })
    }
}

/// The key in the recipe of a draw's distribution; none for a choice from a list or a rotation that
/// was resampled.
fn key(path: &str) -> Option<String> {
    if is_choice(path) || path.contains('#') {
        return None;
    }
    let own = object_key(path).or(path.strip_prefix("selection."));
    Some(own.unwrap_or(path).to_owned())
}

fn is_choice(path: &str) -> bool {
    let names = [".asset", ".photo", ".file", ".order"];
    path == "background" || names.iter().any(|name| path.ends_with(name))
}

/// `hue` of `objects[2].hue` and of `distractors[0].hue`.
fn object_key(path: &str) -> Option<&str> {
    let roles = ["objects[", "distractors["];
    let numbered = roles.iter().find_map(|role| path.strip_prefix(role))?;
    let (_, own) = numbered.split_once("].")?;
    Some(own)
}

/// Objects that have a label and are in the picture.
fn labelled_objects(record: &SampleRecord) -> Vec<&ObjectLabel> {
    let objects = record.labels.objects.iter();
    objects
        .filter(|object| UnlabelledReason::of(object, record).is_none())
        .collect()
}

/// The first and the last of ascending numbers.
fn ends_of(numbers: &[Value]) -> Option<[f64; 2]> {
    Some([numbers.first()?.as_f64()?, numbers.last()?.as_f64()?])
}

/// `/objects/2/hue` of `objects[2].hue`.
fn json_pointer(key: &str) -> String {
    format!("/{}", key.replace(['.', '['], "/").replace(']', ""))
}

fn read_samples(
    folder: &Path,
    lines: &[JournalLine],
    labelling: Labelling,
) -> Result<Vec<ReadSample>> {
    lines
        .par_iter()
        .map(|line| ReadSample::read(folder, line, labelling))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_of_a_draw_is_that_of_its_distribution() {
        let keys = [
            "objects[12].start.x",
            "lights[0].color[1]",
            "selection.objects",
            "selection[3].asset",
            "distractors[0].start.order",
            "distractors[0].start.gap",
        ]
        .map(key);
        assert_eq!(
            keys,
            [
                Some("start.x".into()),
                Some("lights[0].color[1]".into()),
                Some("objects".into()),
                None,
                None,
                Some("start.gap".into()),
            ]
        );
        assert_eq!(key("objects[1].start.yaw_deg#3"), None);
    }
}
