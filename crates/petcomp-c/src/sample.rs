//! Labelled images.
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

/// An image and its labels. 0 is no sample.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct SampleHandle {
    /// Never reused.
    pub id: u64,
}

/// A sample, its labels as JSON, and how a dataset would write its file.
struct Made {
    sample: Sample,
    labels: String,
    pictures: Pictures,
    seed: u64,
    k: u64,
}

impl Made {
    /// The image as decoded from its file.
    fn shown(&self) -> Result<Image<Srgb8>, Error> {
        self.pictures.shown(&self.sample.frame, self.seed, self.k)
    }
}

static SAMPLES: Handles<Made> = Handles::new("sample");

/// The document of `petcomp_sample_labels`.
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

/// Makes sample `k` of a pipeline: the image that `petcomp dataset generate --seed SEED` writes
/// under that number, regardless of other samples made before.
///
/// `sample` receives the handle; free it with petcomp_sample_free(). Several threads may make
/// samples at once; each call uses all cores (RAYON_NUM_THREADS sets how many).
///
/// # Safety
/// Each pointer is null or points to memory as described.
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
/// `width` and `height` are null or writable.
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

/// Copies the image for display, with JPEG's losses if the recipe writes JPEG: rows without gaps,
/// three bytes per pixel, sRGB. `capacity` is in bytes, at least 3 * width * height.
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

/// Copies the image in scene-linear light (Rec. 709 primaries): rows without gaps, four floats per
/// pixel, alpha premultiplied. `capacity` is in floats, at least 4 * width * height.
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

/// Copies the labels as JSON, made according to the recipe's table `labels`: {"width", "height",
/// "classes": names, "objects": [{"id", "class": index into the names, "ignored", "box": [left,
/// top, right, bottom] in pixels, "visible_fraction": visible share, "mask": COCO's compressed
/// RLE}]}.
///
/// `length`, if not null, receives the size of the text in bytes, including its NUL. If the buffer
/// is too small, nothing else is written.
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

/// Frees a sample.
#[unsafe(no_mangle)]
pub extern "C" fn petcomp_sample_free(sample: SampleHandle) -> Status {
    call(|| SAMPLES.close(sample.id))
}
