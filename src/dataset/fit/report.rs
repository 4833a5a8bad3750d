//! The page of a fitted recipe: every distribution before and after, beside the real one.

use super::FittedKey;
use super::measured::{MeasuredSet, PixelMeasures};
use super::starts::overlaps;
use crate::dataset::page::beside::{ComparedMeasure, Measure, measure_boxes, quantiles};
use crate::plot::{Histogram, Page, Table, heat::heat_map};

/// Of 100 pairs of samples of one distribution, 5 are farther apart than this over the root of the
/// harmonic sum of their sizes (Kolmogorov and Smirnov).
const KOLMOGOROV_95: f64 = 1.358;
/// What stands beside charts that belong together.
const STYLE: &str = "<style>.pairs{display:grid;grid-template-columns:repeat(auto-fill,minmax(560px,1fr))}\
    .pairs div{white-space:nowrap}</style>\n";

/// What no picture with labels tells.
const UNKNOWN: &str = "Labels and pixels do not tell the walls' height and slope, how thick objects are, the lights, nor \
    how colours vary from object to object: those keys are as they were.";

/// Real pictures, and the recipe's before and after fitting.
pub(super) struct Compared<'a> {
    pub(super) real: &'a MeasuredSet,
    pub(super) before: &'a MeasuredSet,
    pub(super) after: &'a MeasuredSet,
}

pub(super) fn begin(title: &str, keys: &[FittedKey]) -> Page {
    let mut page = Page::new(title);
    page.html(STYLE)
        .heading("Keys")
        .table(&key_table(keys))
        .text(UNKNOWN);
    page
}

fn key_table(keys: &[FittedKey]) -> Table {
    let mut table = Table::new(["key", "recipe", "fitted", "why"]);
    for key in keys {
        let fitted = key.fitted.as_deref().unwrap_or("as it was");
        table.push([&key.key, &key.before, fitted, &key.why]);
    }
    table
}

/// The fitted weights of numbers of objects.
pub(super) fn add_counts(page: &mut Page, weights: &[f64]) {
    let histogram = Histogram {
        title: "objects in a picture, fitted, of 1000".into(),
        ends: ["0".into(), (weights.len() - 1).to_string()],
        counts: weights
            .iter()
            .map(|w| (1000.0 * w).round() as u64)
            .collect(),
        expected: None,
    };
    page.html(&histogram.svg());
}

pub(super) fn add_comparison(page: &mut Page, sets: &Compared<'_>) {
    let [real, before, after] = [sets.real, sets.before, sets.after].map(measures);
    let rows: Vec<_> = real
        .into_iter()
        .zip(before.into_iter().zip(after))
        .collect();
    let known = rows
        .iter()
        .filter(|(r, (b, a))| ![r, b, a].iter().any(|m| m.1.is_empty()));
    let pairs: Vec<MeasurePair> = known.map(|(r, (b, a))| MeasurePair::new(r, b, a)).collect();
    page.heading("Before and after")
        .text(&introduction(sets))
        .table(&distances(&pairs));
    let charts: String = pairs.iter().map(MeasurePair::svg).collect();
    page.html(&format!("<div class=\"pairs\">\n{charts}</div>\n"));
    add_maps(page, sets);
}

fn introduction(sets: &Compared<'_>) -> String {
    let [real, before, after] = [sets.real, sets.before, sets.after].map(|s| s.set.pictures.len());
    format!(
        "{real} real pictures (orange) beside {before} of the recipe as it was (blue, left) and {after} of the fitted one (blue, \
         right). The distance is that of Kolmogorov and Smirnov, 0 for the same distribution; chance leaves less than the last \
         column in 95 of 100 cases. Noise, blur, light and its colour are measured around the labels."
    )
}

fn add_maps(page: &mut Page, sets: &Compared<'_>) {
    let titled = [
        ("centres of real labels", sets.real),
        ("before", sets.before),
        ("after", sets.after),
    ];
    let maps: String = titled
        .map(|(title, set)| heat_map(title, &set.set.centres()))
        .concat();
    page.html(&format!("<div class=\"histograms\">\n{maps}</div>\n"));
}

/// What is compared, with its values in a set.
fn measures(set: &MeasuredSet) -> Vec<Measure> {
    let mut measures = Vec::from(measure_boxes(&set.set));
    let boxes = set.boxes();
    let overlaps = boxes.iter().flat_map(|boxes| overlaps(boxes)).collect();
    measures.push(("overlap of a box with the next one, IoU", overlaps));
    let of_pixels: [(&'static str, fn(&PixelMeasures) -> f64); 6] = [
        ("brightness of a picture, mean code", |p| p.brightness),
        ("contrast of a picture, standard deviation of codes", |p| {
            p.contrast
        }),
        ("median luminance, EV", |p| p.exposure_ev),
        ("white balance, red over blue", |p| p.red_over_blue.exp()),
        ("noise in mid grey, codes", PixelMeasures::grey_noise),
        ("blur, px", PixelMeasures::blur_px),
    ];
    measures.extend(of_pixels.map(|(title, value)| (title, set.values(value))));
    measures
}

/// One measure before and after fitting.
struct MeasurePair {
    title: &'static str,
    quantiles: [String; 3],
    /// Largest distance that chance leaves as a rule.
    chance: f64,
    compared: [ComparedMeasure; 2],
}

impl MeasurePair {
    fn new((title, real): &Measure, (_, before): &Measure, (_, after): &Measure) -> Self {
        let [n, m] = [real, after].map(|values| values.len() as f64);
        let sets = [before, after];
        Self {
            title,
            quantiles: [real, before, after].map(|values| quantiles(values)),
            chance: KOLMOGOROV_95 * ((n + m) / (n * m)).sqrt(),
            compared: sets.map(|own| ComparedMeasure::new(title, own.clone(), real.clone())),
        }
    }

    fn svg(&self) -> String {
        let [before, after] = self.compared.each_ref().map(ComparedMeasure::svg);
        format!("<div>{before}{after}</div>\n")
    }
}

fn distances(pairs: &[MeasurePair]) -> Table {
    let mut table = Table::new([
        "5 %, median, 95 %",
        "real",
        "before",
        "after",
        "distance before",
        "distance after",
        "chance",
    ]);
    for pair in pairs {
        let [before, after] = pair.compared.each_ref().map(|measure| measure.distance);
        let distances = [before, after, pair.chance].map(|d| format!("{d:.2}"));
        let quantiles = pair.quantiles.iter().cloned();
        table.push(
            [pair.title.to_owned()]
                .into_iter()
                .chain(quantiles)
                .chain(distances),
        );
    }
    table
}
