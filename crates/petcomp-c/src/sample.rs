//! A labelled picture.
#![expect(unsafe_code, reason = "called from C")]

use crate::handles::Handles;
use crate::memory::{put, store, store_text};
use crate::pipeline::{OpenedPipeline, PipelineHandle, opened};
use crate::status::{Failure, Status, call};
use bytemuck::{Pod, Zeroable};
use petcomp::dataset::{Extent, LabelledObject, Pictures, Sample};
use petcomp::label::RleMask;
use petcomp::{Error, Image, Srgb8};
use serde::Serialize;
use std::ffi::c_char;

/// A picture and its labels. 0 is none.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct SampleHandle {
    /// Never used twice.
    pub id: u64,
}

/// A sample, its labels as JSON, and the file that a dataset has of it.
struct Made {
    sample: Sample,
    labels: String,
    pictures: Pictures,
    seed: u64,
    k: u64,
}

impl Made {
    /// What whoever reads its file sees.
    fn shown(&self) -> Result<Image<Srgb8>, Error> {
        self.pictures.shown(&self.sample.frame, self.seed, self.k)
    }
}

static SAMPLES: Handles<Made> = Handles::new("sample");

/// What `petcomp_sample_labels` says.
#[derive(Serialize)]
struct LabelDocument<'a> {
    width: usize,
    height: usize,
    classes: &'a [String],
    objects: Vec<LabelEntry<'a>>,
}

#[derive(Serialize)]
struct LabelEntry<'a> {
    id: u32,
    class: u32,
    ignored: bool,
    #[serde(rename = "box")]
    corners: [f64; 4],
    visible_fraction: f64,
    mask: &'a RleMask,
}

/// Makes sample `k` of a pipeline: the picture that `petcomp dataset generate --seed SEED` writes
/// under that number, whatever was made before.
///
/// `sample` gets the handle, to be given back by petcomp_sample_free(). Several threads may make
/// samples at once; each call also works on all cores by itself (RAYON_NUM_THREADS).
///
/// # Safety
/// Each pointer is null or points to what is said here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_sample_make(
    pipeline: PipelineHandle,
    seed: u64,
    k: u64,
    sample: *mut SampleHandle,
) -> Status {
    call(|| {
        // SAFETY: promised by the caller.
        unsafe { put("sample", SampleHandle::zeroed(), sample) }?;
        let id = SAMPLES.open(made(&*opened(pipeline)?, seed, k)?);
        // SAFETY: promised by the caller.
        unsafe { put("sample", SampleHandle { id }, sample) }
    })
}

fn made(opened: &OpenedPipeline, seed: u64, k: u64) -> Result<Made, Failure> {
    let sample = opened.pipeline.sample(seed, k)?;
    let labels = labels_json(&sample, opened)?;
    Ok(Made {
        sample,
        labels,
        pictures: opened.pipeline.config().pictures.clone(),
        seed,
        k,
    })
}

fn labels_json(sample: &Sample, opened: &OpenedPipeline) -> Result<String, Error> {
    let config = &opened.pipeline.config().labels;
    let (width, height) = sample.frame.size();
    let (count, extent) = (opened.classes.len(), config.extent());
    let labelled = config.obstructed.labelled(&sample.labels, count, &[extent]);
    let document = LabelDocument {
        width,
        height,
        classes: &opened.classes,
        objects: labelled.iter().map(|label| entry(label, extent)).collect(),
    };
    serde_json::to_string(&document).map_err(|e| Error::value("labels", e))
}

fn entry<'a>(label: &LabelledObject<'a>, extent: Extent) -> LabelEntry<'a> {
    let (bounds, mask) = extent.of(label.object);
    LabelEntry {
        id: label.object.id.0,
        class: label.class,
        ignored: label.ignored,
        corners: [bounds.x0, bounds.y0, bounds.x1, bounds.y1],
        visible_fraction: label.object.visible_fraction,
        mask,
    }
}

/// Width and height of a sample, pixels.
///
/// # Safety
/// `width` and `height` are null or can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_sample_size(
    sample: SampleHandle,
    width: *mut usize,
    height: *mut usize,
) -> Status {
    call(|| {
        let (w, h) = SAMPLES.get(sample.id)?.sample.frame.size();
        // SAFETY: promised by the caller.
        unsafe {
            put("width", w, width)?;
            put("height", h, height)
        }
    })
}

/// The picture as a display shows it, with what a JPEG loses where the recipe writes those: rows
/// without gaps, three bytes a pixel, sRGB. `capacity` is in bytes, at least 3 * width * height.
///
/// # Safety
/// `rgb` is null or has room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_sample_srgb8(
    sample: SampleHandle,
    rgb: *mut u8,
    capacity: usize,
) -> Status {
    call(|| {
        let shown = SAMPLES.get(sample.id)?.shown()?;
        // SAFETY: promised by the caller.
        unsafe { store("rgb", bytemuck::cast_slice(shown.pixels()), rgb, capacity) }
    })
}

/// The picture in scene-linear light (Rec. 709 primaries): rows without gaps, four floats a pixel,
/// alpha premultiplied. `capacity` is in floats, at least 4 * width * height.
///
/// # Safety
/// `rgba` is null or has room for `capacity` floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_sample_linear(
    sample: SampleHandle,
    rgba: *mut f32,
    capacity: usize,
) -> Status {
    call(|| {
        let made = SAMPLES.get(sample.id)?;
        let floats = bytemuck::cast_slice(made.sample.frame.pixels());
        // SAFETY: promised by the caller.
        unsafe { store("rgba", floats, rgba, capacity) }
    })
}

/// The labels as JSON: {"width", "height", "classes": names, "objects": [{"id", "class": place in
/// the names, "ignored", "box": [left, top, right, bottom] in pixels, "visible_fraction": share that is
/// seen, "mask": COCO's compressed run lengths}]}, as the recipe's [labels] want them.
///
/// `length`, where it is not null, gets the bytes that the text takes with its NUL; with too small a
/// buffer nothing else is written.
///
/// # Safety
/// `json` is null or has room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_sample_labels(
    sample: SampleHandle,
    json: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> Status {
    call(|| {
        let made = SAMPLES.get(sample.id)?;
        // SAFETY: promised by the caller.
        unsafe { store_text("json", &made.labels, json, capacity, length) }
    })
}

/// Gives a sample's memory back.
#[unsafe(no_mangle)]
pub extern "C" fn petcomp_sample_free(sample: SampleHandle) -> Status {
    call(|| SAMPLES.close(sample.id))
}
