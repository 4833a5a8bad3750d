//! The page of a fitted recipe: every distribution before and after, next to the real one.

use super::FittedKey;
use super::measured::{MeasuredSet, PixelMeasures};
use super::plates::{self, MeasuredPlate};
use super::starts::overlaps;
use crate::dataset::page::beside::{ComparedMeasure, Measure, measure_boxes, quantiles};
use crate::plot::{Histogram, Page, Table, heat::heat_map};

/// In 5 of 100 cases, samples of sizes n and m from one distribution are farther apart than this
/// times `sqrt((n + m) / (n m))` (Kolmogorov and Smirnov).
const KOLMOGOROV_95: f64 = 1.358;
/// Puts charts that belong together side by side.
const STYLE: &str = "<style>.pairs{display:grid;grid-template-columns:repeat(auto-fill,minmax(560px,1fr))}\
    .pairs div{white-space:nowrap}</style>\n";

/// What labelled pictures do not show.
const UNKNOWN: &str = "Labels and pixels do not show the walls' height and slope, the objects' thickness, the \
    lights, or how colours vary between objects: those keys are unchanged.";

/// Real pictures, and the recipe's before and after fitting.
pub(super) struct Compared {
    pub(super) real: MeasuredSet,
    pub(super) before: MeasuredSet,
    pub(super) after: MeasuredSet,
}

/// What is missing without pictures.
const PLATES_ALONE: &str = "Without labelled pictures of the place, the number, positions and apparent size of the \
    objects are unknown, as are the noise, blur and exposure of the camera that will see them: give 5 to 50 \
    pictures.";

pub(super) fn of_plates(keys: &[FittedKey], plates: &[MeasuredPlate]) -> Page {
    let mut page = begin("Recipe fitted to its plates", keys);
    page.text(PLATES_ALONE);
    add_plates(&mut page, plates);
    page
}

/// `weights` are those of numbers of objects.
pub(super) fn of_pictures(
    keys: &[FittedKey],
    weights: &[f64],
    sets: &Compared,
    plates: &[MeasuredPlate],
) -> Page {
    let mut page = begin("Recipe fitted to real pictures", keys);
    add_counts(&mut page, weights);
    add_comparison(&mut page, sets);
    add_plates(&mut page, plates);
    page
}

fn add_plates(page: &mut Page, plates: &[MeasuredPlate]) {
    page.heading("Plates").table(&plates::table(plates));
}

fn begin(title: &str, keys: &[FittedKey]) -> Page {
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
        let fitted = key.fitted.as_deref().unwrap_or("unchanged");
        table.push([&key.key, &key.before, fitted, &key.why]);
    }
    table
}

/// The fitted weights of numbers of objects.
fn add_counts(page: &mut Page, weights: &[f64]) {
    let histogram = Histogram {
        title: "objects per picture, fitted, of 1000".into(),
        ends: ["0".into(), (weights.len() - 1).to_string()],
        counts: weights
            .iter()
            .map(|w| (1000.0 * w).round() as u64)
            .collect(),
        expected: None,
    };
    page.html(&histogram.svg());
}

fn add_comparison(page: &mut Page, sets: &Compared) {
    let pairs = compared_measures(sets);
    page.heading("Before and after")
        .text(&introduction(sets))
        .table(&distances(&pairs));
    let charts: String = pairs.iter().map(MeasurePair::svg).collect();
    page.html(&format!("<div class=\"pairs\">\n{charts}</div>\n"));
    add_maps(page, sets);
}

/// The measures for which all sets have values.
fn compared_measures(sets: &Compared) -> Vec<MeasurePair> {
    let [real, before, after] = sets.each().map(measures);
    let rows = real.into_iter().zip(before.into_iter().zip(after));
    rows.map(|(real, (before, after))| [real, before, after])
        .filter(|row| row.iter().all(|(_, values)| !values.is_empty()))
        .map(|[real, before, after]| MeasurePair::new(&real, &before, &after))
        .collect()
}

impl Compared {
    /// The real set, then before and after.
    fn each(&self) -> [&MeasuredSet; 3] {
        [&self.real, &self.before, &self.after]
    }
}

fn introduction(sets: &Compared) -> String {
    let [real, before, after] = sets.each().map(|set| set.set.pictures.len());
    format!(
        "{real} real pictures (orange) beside {before} of the original recipe (blue, left) and {after} of the fitted \
         one (blue, right). The distance is the Kolmogorov-Smirnov distance, 0 for identical distributions; by \
         chance it stays below the last column in 95 of 100 cases. Noise, blur, light and its colour are measured \
         around the labels."
    )
}

fn add_maps(page: &mut Page, sets: &Compared) {
    let titles = ["centres of real labels", "before", "after"];
    let maps = titles.iter().zip(sets.each());
    let maps: String = maps
        .map(|(title, set)| heat_map(title, &set.set.centres()))
        .collect();
    page.html(&format!("<div class=\"histograms\">\n{maps}</div>\n"));
}

/// The title of a measure and how it is computed from a picture's pixels.
type PixelMeasure = (&'static str, fn(&PixelMeasures) -> f64);

const PIXEL_MEASURES: [PixelMeasure; 6] = [
    ("brightness of a picture, mean code", |p| p.brightness),
    ("contrast of a picture, standard deviation of codes", |p| {
        p.contrast
    }),
    ("median luminance, EV", |p| p.exposure_ev),
    ("white balance, red over blue", |p| p.red_over_blue.exp()),
    ("noise in mid grey, codes", PixelMeasures::grey_noise),
    ("blur, px", PixelMeasures::blur_px),
];

/// What is compared, with its values in a set.
fn measures(set: &MeasuredSet) -> Vec<Measure> {
    let mut measures = Vec::from(measure_boxes(&set.set));
    let boxes = set.boxes();
    let overlaps = boxes.iter().flat_map(|boxes| overlaps(boxes)).collect();
    measures.push(("overlap of a box with the next one, IoU", overlaps));
    measures.extend(PIXEL_MEASURES.map(|(title, value)| (title, set.values(value))));
    measures
}

/// One measure before and after fitting.
struct MeasurePair {
    title: &'static str,
    quantiles: [String; 3],
    /// The distance that chance exceeds in 5 of 100 cases.
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
