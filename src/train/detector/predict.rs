//! Finds boxes in pictures.

use super::augment::{margin, plain};
use super::loss::numbers;
use super::network::{ANCHORS_PER_LEVEL, BOX_NUMBERS, Description, Network};
use super::sample::Sample;
use super::suppress::suppress;
use crate::error::Result;
use crate::eval::{FoundBox, Sheet, TrueBox};
use crate::io;
use crate::label::BBox;
use crate::train::decode;
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;

/// Least confidence, greatest overlap and number of boxes an image, as YOLOv5 takes for its scores.
const CONFIDENCE: f64 = 0.001;
const OVERLAP: f64 = 0.6;
const MOST: usize = 300;
/// Boxes an image, by confidence, that are held against each other.
const CANDIDATES: usize = 3000;

/// What a trained network (on a backend without gradients) finds in pictures, beside what there is: a sheet each, in
/// pixels of the original images. `batch` images are seen at once.
pub fn predict<B: Backend>(
    network: &Network<B>,
    description: &Description,
    samples: &[Sample],
    batch: usize,
    device: &B::Device,
) -> Vec<Sheet> {
    let side = description.side;
    let mut sheets = Vec::with_capacity(samples.len());
    for part in samples.chunks(batch.max(1)) {
        let planes: Vec<Vec<f32>> = part.par_iter().map(|sample| plain(sample, side).planes).collect();
        let data = TensorData::new(planes.concat(), [part.len(), 3, side, side]);
        let output = network.forward(Tensor::from_data(data, device)).map(numbers);
        sheets.par_extend(part.par_iter().enumerate().map(|(i, sample)| sheet(sample, i, &output, description)));
    }
    sheets
}

fn sheet(sample: &Sample, image: usize, output: &[Vec<f32>], description: &Description) -> Sheet {
    let mut all: Vec<FoundBox> = Vec::new();
    for (level, values) in output.iter().enumerate() {
        let size = ANCHORS_PER_LEVEL * description.cells(level).pow(2) * description.numbers();
        all.extend(told(&values[image * size..][..size], level, description));
    }
    all.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    all.truncate(CANDIDATES);
    let back = Back::new(sample, description.side);
    let found = suppress(all, OVERLAP, MOST).into_iter().map(|f| FoundBox { bbox: back.bbox(f.bbox), ..f });
    let truth = sample.objects.iter().map(|object| {
        let bbox = back.scaled(object.bbox);
        TrueBox { class: object.class, bbox, area: bbox.width() * bbox.height(), crowd: false }
    });
    Sheet { image: sample.name.clone(), truth: truth.collect(), found: found.collect() }
}

/// Boxes that a head tells of an image, in pixels of the network's square: one per class that is likely enough.
fn told<'a>(values: &'a [f32], level: usize, description: &'a Description) -> impl Iterator<Item = FoundBox> + 'a {
    let cells = description.cells(level);
    let stride = (description.side / cells) as f64;
    let anchors = description.anchors_in_cells(level);
    values.chunks_exact(description.numbers()).enumerate().flat_map(move |(i, row)| {
        let object = share(row[BOX_NUMBERS - 1]);
        let (numbers, classes) = row.split_at(BOX_NUMBERS);
        let likely = if object > CONFIDENCE { classes } else { &[] };
        let cell = [i % cells, i / cells % cells].map(|v| v as f64);
        let anchor = anchors[i / (cells * cells)];
        let sure = move |&t: &f32| if classes.len() > 1 { object * share(t) } else { object };
        let confidences = likely.iter().map(sure).enumerate().filter(|(_, confidence)| *confidence > CONFIDENCE);
        confidences.map(move |(class, confidence)| {
            let t = std::array::from_fn(|k| f64::from(numbers[k]));
            let [x, y, w, h] = decode(t, cell, anchor).map(|v| v * stride);
            let bbox = BBox { x0: x - 0.5 * w, y0: y - 0.5 * h, x1: x + 0.5 * w, y1: y + 0.5 * h };
            FoundBox { class: class as u32, bbox, confidence }
        })
    })
}

fn share(t: f32) -> f64 {
    1.0 / (1.0 + libm::exp(-f64::from(t)))
}

/// From the network's square back to the original image.
struct Back {
    margin: [f64; 2],
    scale: [f64; 2],
    size: [f64; 2],
}

impl Back {
    fn new(sample: &Sample, side: usize) -> Self {
        let size = sample.size.map(f64::from);
        let seen = [sample.picture.width(), sample.picture.height()].map(|v| v.max(1) as f64);
        Self { margin: margin(sample, side), scale: [size[0] / seen[0], size[1] / seen[1]], size }
    }

    /// From pixels of the square, cut at the image's edges.
    fn bbox(&self, b: BBox) -> BBox {
        let shifted = [[b.x0, b.y0], [b.x1, b.y1]].map(|p| [0, 1].map(|i| p[i] - self.margin[i]));
        let [p, q] = shifted.map(|p| [0, 1].map(|i| (p[i] * self.scale[i]).clamp(0.0, self.size[i])));
        BBox { x0: p[0], y0: p[1], x1: q[0], y1: q[1] }
    }

    /// From pixels of the sample's picture.
    fn scaled(&self, b: BBox) -> BBox {
        let [w, h] = self.scale;
        BBox { x0: b.x0 * w, y0: b.y0 * h, x1: b.x1 * w, y1: b.y1 * h }
    }
}

/// Writes `NAME.txt` per image: `class cx cy w h confidence`, shares of the image, surest first; `petcomp eval` reads it.
///
/// # Errors
/// [`Error::File`](crate::Error::File) for what cannot be written.
pub fn found_folder(folder: &Path, sheets: &[Sheet], samples: &[Sample]) -> Result<()> {
    io::create_folder(folder)?;
    for (sheet, sample) in sheets.iter().zip(samples) {
        let [w, h] = sample.size.map(f64::from);
        let mut text = String::new();
        for f in &sheet.found {
            let c = f.bbox.center();
            let shares = [c.x / w, c.y / h, f.bbox.width() / w, f.bbox.height() / h];
            let [cx, cy, wide, high] = shares;
            let _ = writeln!(text, "{} {cx:.6} {cy:.6} {wide:.6} {high:.6} {:.6}", f.class, f.confidence);
        }
        io::write_text(folder.join(format!("{}.txt", sheet.image)), &text)?;
    }
    Ok(())
}
