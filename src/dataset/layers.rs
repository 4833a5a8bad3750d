//! One EXR file for each image with everything a compositor asks for.

use crate::asset::Role;
use crate::dataset::paths::create_part_folders;
use crate::dataset::{Entry, Sample, Writer};
use crate::deep::{DeepImage, DeepSample};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{Canvas, exr::write_channels};
use crate::label::LabelOptions;
use crate::pixel::{LinearRgb, ObjectId, PremulRgba};
use crate::render::Cryptomatte;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Writes `layers/{train,val}/NNNNNN.exr`: the scene-linear picture and what it was composed from,
/// as 32-bit floats.
///
/// | channels | meaning |
/// | --- | --- |
/// | `R G B A` | the picture |
/// | `Z` | depth of the nearest object that is seen, metres along the optical axis; infinite where there is none; of a curved card that of the flat one |
/// | `shadow.R G B` | factor on the background |
/// | `CryptoObject00.R` ... | Cryptomatte: which objects, and how much of each is seen |
/// | `object003.R G B A` | light of one object that reaches the eye, and its seen share (`cards`) |
/// | `object003.Z`, `amodal003.A` | its depth, and its coverage as if alone (`cards`) |
///
/// Objects are called `object003_CLASS` in the Cryptomatte's list, distractors
/// `object003_distractor`; what is too faint for a label is among them. Without film,
/// `RGB = sum of object RGB + background * shadow * (1 - sum of object A)`: all but the picture is
/// of the sharp objects at rest, before Poisson blending, blur, depth of field, a belt's exposure
/// and finish; with those the sum does not give the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Layers {
    /// Also write the layers of each object. Default: no.
    pub cards: bool,
    /// An object is visible in a pixel of which it covers more than this share; in a recipe, that
    /// of `labels`. Default: 0.1.
    #[serde(skip_deserializing, skip_serializing_if = "is_default")]
    pub alpha_threshold: f32,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            cards: false,
            alpha_threshold: LabelOptions::default().alpha_threshold,
        }
    }
}

/// A setting that need not be recorded.
fn is_default(alpha_threshold: &f32) -> bool {
    *alpha_threshold == LabelOptions::default().alpha_threshold
}

/// Its folder.
const KIND: &str = "layers";

/// A channel's name and samples.
type NamedChannel = (String, Vec<f32>);

impl Writer for Layers {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "layers": self })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        create_part_folders(folder, KIND)
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let (path, sample) = (entry.path(KIND, "exr"), entry.sample);
        check_deep(sample)?;
        let ids = cryptomatte(entry);
        let mut channels = picture_channels(&sample.frame, &sample.deep, self.alpha_threshold);
        channels.extend(ids.channels);
        if self.cards {
            let ids = object_names(entry).into_iter().map(|(id, _)| id);
            channels.extend(ids.flat_map(|id| object_channels(&sample.deep, id)));
        }
        let mut notes = ids.metadata;
        notes.extend(provenance(entry));
        let (size, canvas) = (sample.frame.size(), Canvas::default());
        write_channels(folder.join(&path), size, canvas, channels, &notes)?;
        Ok(vec![path])
    }
}

/// The name of an object, or of a distractor, which has no class.
fn name(id: ObjectId, class: Option<u32>, entry: &Entry<'_>) -> String {
    let what = class.map_or_else(
        || Role::Distractor.to_string(),
        |class| entry.class_name(class),
    );
    format!("object{:03}_{what}", id.0)
}

/// Provenance recorded in the file.
fn provenance(entry: &Entry<'_>) -> [(String, String); 3] {
    [
        ("petcomp:recipe".into(), entry.recipe_hash.into()),
        ("petcomp:seed".into(), entry.seed.to_string()),
        ("petcomp:sample".into(), entry.k.to_string()),
    ]
}

/// Fails for a sample without deep samples: its layers cannot be separated.
fn check_deep(sample: &Sample) -> Result<()> {
    let (w, h) = sample.frame.size();
    let (deep_w, deep_h) = (sample.deep.width(), sample.deep.height());
    if (deep_w, deep_h) == (w, h) {
        return Ok(());
    }
    if deep_w == 0 {
        let what =
            "\"layers\", but the sample was not rendered, so there is no light of single objects";
        return Err(Error::value("labels.formats", what));
    }
    let what = format!("{deep_w} x {deep_h} pixels, expected the picture's {w} x {h}");
    Err(Error::value("deep", what))
}

/// The name of a channel and how its value is computed from a pixel.
type Channel<P> = (&'static str, fn(&P) -> f32);

/// The picture, its depth and its shadows.
fn picture_channels(
    frame: &Image<PremulRgba>,
    deep: &DeepImage,
    threshold: f32,
) -> Vec<NamedChannel> {
    let mut channels = channels_of(frame, &COLOR_CHANNELS);
    let depths = value_per_pixel(deep, |samples| nearest(samples, threshold));
    channels.push(("Z".into(), depths));
    channels.extend(channels_of(deep.shadow(), &SHADOW_CHANNELS));
    channels
}

const COLOR_CHANNELS: [Channel<PremulRgba>; 4] = [
    ("R", |p| p.r),
    ("G", |p| p.g),
    ("B", |p| p.b),
    ("A", |p| p.a),
];

const SHADOW_CHANNELS: [Channel<LinearRgb>; 3] = [
    ("shadow.R", |s| s.r),
    ("shadow.G", |s| s.g),
    ("shadow.B", |s| s.b),
];

fn channels_of<P: Copy>(image: &Image<P>, channels: &[Channel<P>]) -> Vec<NamedChannel> {
    let channels = channels.iter();
    channels
        .map(|(name, value)| ((*name).into(), image.pixels().iter().map(value).collect()))
        .collect()
}

fn cryptomatte(entry: &Entry<'_>) -> Cryptomatte {
    Cryptomatte::new(&entry.sample.deep, "CryptoObject", &object_names(entry))
}

/// Names of everything that the picture shows, whether or not it has a label.
fn object_names(entry: &Entry<'_>) -> Vec<(ObjectId, String)> {
    let labels = &entry.sample.labels;
    let objects = labels.objects.iter().map(|o| (o.id, Some(o.class)));
    let distractors = labels.distractors.iter().map(|d| (d.id, None));
    let faint = labels.faint.iter().copied();
    let all = objects.chain(distractors).chain(faint);
    all.map(|(id, class)| (id, name(id, class, entry)))
        .collect()
}

/// Depth of a pixel's first sample that is visible enough to belong to a mask.
fn nearest(samples: &[DeepSample], threshold: f32) -> f32 {
    samples
        .iter()
        .find(|sample| sample.visible > threshold)
        .map_or(f32::INFINITY, |sample| sample.depth.0)
}

/// One channel of an object.
struct ObjectChannel {
    layer: &'static str,
    name: &'static str,
    value: fn(&DeepSample) -> f32,
    /// Value where the object is absent.
    none: f32,
}

const OBJECT_CHANNELS: [ObjectChannel; 6] = [
    ObjectChannel {
        layer: "object",
        name: "R",
        value: |s| s.light.r,
        none: 0.0,
    },
    ObjectChannel {
        layer: "object",
        name: "G",
        value: |s| s.light.g,
        none: 0.0,
    },
    ObjectChannel {
        layer: "object",
        name: "B",
        value: |s| s.light.b,
        none: 0.0,
    },
    ObjectChannel {
        layer: "object",
        name: "A",
        value: |s| s.visible,
        none: 0.0,
    },
    ObjectChannel {
        layer: "object",
        name: "Z",
        value: |s| s.depth.0,
        none: f32::INFINITY,
    },
    ObjectChannel {
        layer: "amodal",
        name: "A",
        value: |s| s.alpha,
        none: 0.0,
    },
];

fn object_channels(deep: &DeepImage, id: ObjectId) -> [NamedChannel; 6] {
    OBJECT_CHANNELS.map(|channel| {
        let name = format!("{}{:03}.{}", channel.layer, id.0, channel.name);
        (name, channel.plane(deep, id))
    })
}

impl ObjectChannel {
    fn plane(&self, deep: &DeepImage, id: ObjectId) -> Vec<f32> {
        value_per_pixel(deep, |samples| {
            let own = samples.iter().find(|s| s.object == id);
            own.map_or(self.none, self.value)
        })
    }
}

/// One value for each pixel.
fn value_per_pixel(deep: &DeepImage, value: impl Fn(&[DeepSample]) -> f32) -> Vec<f32> {
    let pixels = (0..deep.height()).flat_map(|y| (0..deep.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| value(deep.at(x, y))).collect()
}
