//! A dataset next to the user's own photographs: distributions that should be alike.

use super::distributions::extremes;
use super::labelled_pictures::{LabelledPicture, LabelledSet};
use super::outlier::short;
use crate::color::encode_srgb8;
use crate::dataset::contact_sheet::shrunk;
use crate::geom::BBox;
use crate::image::Image;
use crate::io;
use crate::label::gallery::{Figure, gallery, marked_box};
use crate::pixel::LinearRgb;
use crate::plot::{Page, Table, escaped, heat::heat_map};
use crate::quantile::quantile;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Maximum number of pictures of each set whose pixels are compared, and the width at which they
/// are read.
const MAX_MEASURED_PICTURES: usize = 64;
const MEASURED_WIDTH_PX: usize = 256;

/// Bins of a histogram, and its frame and margins in SVG units.
const HISTOGRAM_BINS: usize = 20;
const FRAME: [f64; 2] = [250.0, 110.0];
const ROOM_LEFT: f64 = 12.0;
const ROOM_RIGHT: f64 = 12.0;
const ROOM_ABOVE: f64 = 24.0;
const ROOM_BELOW: f64 = 24.0;

/// Okabe and Ito's colours: ours as everywhere on the page, and the other set's.
const OURS: &str = "#0072b2";
const THEIRS: &str = "#d55e00";

/// Shows the two side by side, the largest differences first, with at most `max_figures` of the
/// other set's pictures.
pub(super) fn add_comparison(
    page: &mut Page,
    ours: &LabelledSet,
    theirs: &LabelledSet,
    max_figures: usize,
) {
    add_heading(page, ours, theirs);
    add_measures(page, ours, theirs);
    page.subheading("Classes")
        .table(&class_shares(ours, theirs));
    add_figures(page, theirs, max_figures);
}

fn add_measures(page: &mut Page, ours: &LabelledSet, theirs: &LabelledSet) {
    let measures = compare_measures(ours, theirs);
    page.table(&distances(&measures));
    let charts: String = measures.iter().map(ComparedMeasure::svg).collect();
    let maps = heat_map("centres of the dataset's labels", &ours.centres())
        + &heat_map("centres of your labels", &theirs.centres());
    page.html(&format!(
        "<div class=\"histograms\">\n{charts}{maps}</div>\n"
    ));
}

fn add_figures(page: &mut Page, theirs: &LabelledSet, max_figures: usize) {
    let figures: Vec<Figure> = theirs
        .spread(max_figures)
        .into_par_iter()
        .filter_map(|picture| figure(theirs, picture))
        .collect();
    let (shown, of) = (figures.len(), theirs.pictures.len());
    page.subheading(&format!("Your pictures ({shown} of {of})"));
    page.html(&gallery("yours", &figures));
}

fn add_heading(page: &mut Page, ours: &LabelledSet, theirs: &LabelledSet) {
    let without = describe_unlabelled(theirs);
    page.heading("Compared with your own pictures").text(&format!(
        "{} pictures of the dataset (blue) and {} of yours (orange){without}. The distance is the Kolmogorov-Smirnov \
         distance: 0 for identical distributions, 1 for disjoint ones; the largest differences come first.",
        ours.pictures.len(),
        theirs.pictures.len()
    ));
}

fn describe_unlabelled(set: &LabelledSet) -> String {
    let pictures = set.pictures.iter();
    match pictures.filter(|picture| picture.boxes.is_none()).count() {
        0 => String::new(),
        count => format!(", {count} of them without a label file"),
    }
}

/// The measures of a set that can be compared.
fn measure(set: &LabelledSet) -> Vec<Measure> {
    let mut measures = Vec::from(measure_boxes(set));
    measures.extend(measure_pixels(set));
    measures
}

pub(in crate::dataset) fn measure_boxes(set: &LabelledSet) -> [Measure; 6] {
    let counts = set
        .pictures
        .iter()
        .filter_map(|picture| Some(picture.boxes.as_ref()?.len() as f64));
    let root_area = set
        .boxes()
        .map(|(_, [_, _, w, h])| 100.0 * (w * h).max(0.0).sqrt());
    [
        ("labels in a picture", counts.collect()),
        ("width of a box, % of the picture", percentages(set, 2)),
        ("height of a box, % of the picture", percentages(set, 3)),
        (
            "square root of a box's area, % of the picture",
            root_area.collect(),
        ),
        ("centre of a box from the left, %", percentages(set, 0)),
        ("centre of a box from the top, %", percentages(set, 1)),
    ]
}

/// The `i`-th number of each box, which is a share of its picture.
fn percentages(set: &LabelledSet, i: usize) -> Vec<f64> {
    set.boxes().map(|(_, b)| 100.0 * b[i]).collect()
}

/// The title of a measure and how it is computed from a picture's statistics.
type PixelMeasure = (&'static str, fn(&PixelStatistics) -> f64);

fn measure_pixels(set: &LabelledSet) -> [Measure; 4] {
    let pictures = set.spread(MAX_MEASURED_PICTURES).into_par_iter();
    let statistics: Vec<PixelStatistics> = pictures
        .filter_map(|picture| PixelStatistics::read(&picture.path))
        .collect();
    let measures: [PixelMeasure; 4] = [
        ("brightness of a picture, mean code", |s| s.brightness),
        ("contrast of a picture, standard deviation of codes", |s| {
            s.contrast
        }),
        ("saturation of a picture, mean code", |s| s.saturation),
        ("fine detail of a picture, mean step between pixels", |s| {
            s.detail
        }),
    ];
    measures.map(|(title, value)| (title, statistics.iter().map(value).collect()))
}

/// Statistics of a whole picture's pixels, in 8-bit codes.
pub(in crate::dataset) struct PixelStatistics {
    pub(in crate::dataset) brightness: f64,
    pub(in crate::dataset) contrast: f64,
    saturation: f64,
    detail: f64,
}

impl PixelStatistics {
    /// None for a picture that cannot be read, with a warning.
    fn read(path: &Path) -> Option<Self> {
        let picture = io::read::<LinearRgb>(path)
            .inspect_err(|error| log::warn!("{error}"))
            .ok()?;
        Some(Self::of_whole(&picture))
    }

    pub(in crate::dataset) fn of_whole(picture: &Image<LinearRgb>) -> Self {
        let codes = shrunk(Cow::Borrowed(picture), MEASURED_WIDTH_PX).map(codes_of);
        let luma = codes.map(|[r, g, b]| 0.299 * r + 0.587 * g + 0.114 * b);
        let spread = codes.map(channel_spread);
        let brightness = mean(luma.pixels().iter().copied());
        let deviations = luma.pixels().iter().map(|v| v - brightness as f32);
        Self {
            brightness,
            contrast: mean(deviations.map(|v| v.powi(2))).sqrt(),
            saturation: mean(spread.pixels().iter().copied()),
            detail: detail(&luma),
        }
    }
}

/// Mean absolute difference between a pixel and the one to its right.
fn detail(luma: &Image<f32>) -> f64 {
    mean(
        luma.rows()
            .flat_map(|row| row.windows(2).map(|pair| (pair[1] - pair[0]).abs())),
    )
}

fn mean(values: impl Iterator<Item = f32>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u64), |(sum, count), v| {
        (sum + f64::from(v), count + 1)
    });
    sum / count.max(1) as f64
}

fn figure(set: &LabelledSet, picture: &LabelledPicture) -> Option<Figure> {
    let header = io::read_header(&picture.path).ok()?;
    let size = [header.width as f64, header.height as f64];
    let figure = Figure::whole(&picture.path, size);
    let mut figure = figure.inspect_err(|error| log::warn!("{error}")).ok()?;
    let boxes = picture.boxes.iter().flatten();
    let marks = boxes.map(|(class, shares)| mark(&figure, set, *class, &in_pixels(*shares, size)));
    figure.drawing = marks.collect();
    figure.caption = caption(picture);
    Some(figure)
}

fn mark(figure: &Figure, set: &LabelledSet, class: u32, b: &BBox) -> String {
    let (letter, top) = (figure.letter_height(), figure.top());
    let (name, color) = (set.name(class), super::color_of(class));
    marked_box(b, &name, letter, top, &color, "stroke-width=\"2\"")
}

/// A box by its centre and sides, shares of a picture.
pub(in crate::dataset) fn in_pixels([x, y, w, h]: [f64; 4], size: [f64; 2]) -> BBox {
    let [x0, x1] = [x - w / 2.0, x + w / 2.0].map(|x| x * size[0]);
    let [y0, y1] = [y - h / 2.0, y + h / 2.0].map(|y| y * size[1]);
    BBox { x0, y0, x1, y1 }
}

fn caption(picture: &LabelledPicture) -> String {
    let name = picture.file_name();
    match &picture.boxes {
        None => format!("{name}: no label file"),
        Some(boxes) => format!("{name}: {} labels", boxes.len()),
    }
}

/// Shares of the classes, those of the same name side by side.
fn class_shares(ours: &LabelledSet, theirs: &LabelledSet) -> Table {
    let both = [ours, theirs].map(shares_by_class);
    let names: BTreeSet<&String> = both.iter().flat_map(BTreeMap::keys).collect();
    let mut table = Table::new(["class", "dataset", "yours"]);
    for name in names {
        let [ours, theirs] = both.each_ref().map(|shares| percent(shares.get(name)));
        table.push([name.clone(), ours, theirs]);
    }
    table
}

fn percent(share: Option<&f64>) -> String {
    match share {
        Some(share) => format!("{share:.1} %"),
        None => "-".into(),
    }
}

/// Share of each class among the labels, percent.
fn shares_by_class(set: &LabelledSet) -> BTreeMap<String, f64> {
    let mut counts: BTreeMap<String, f64> = BTreeMap::new();
    for (class, _) in set.boxes() {
        *counts.entry(set.name(*class)).or_default() += 1.0;
    }
    let all = counts.values().sum::<f64>().max(1.0);
    counts
        .into_iter()
        .map(|(name, count)| (name, 100.0 * count / all))
        .collect()
}

fn distances(measures: &[ComparedMeasure]) -> Table {
    let mut table = Table::new([
        "",
        "dataset: 5 %, median, 95 %",
        "yours: 5 %, median, 95 %",
        "distance",
    ]);
    for measure in measures {
        table.push(measure.row());
    }
    table
}

pub(in crate::dataset) fn quantiles(values: &[f64]) -> String {
    [0.05, 0.5, 0.95]
        .map(|share| {
            quantile(values.to_vec(), share, f64::total_cmp)
                .map(short)
                .unwrap_or_default()
        })
        .join(" / ")
}

/// A measure's name, and its values.
pub(in crate::dataset) type Measure = (&'static str, Vec<f64>);

/// One measure of both sets.
pub(in crate::dataset) struct ComparedMeasure {
    title: &'static str,
    ours: Vec<f64>,
    theirs: Vec<f64>,
    pub(in crate::dataset) distance: f64,
}

/// The measures for which both sets have values, the largest difference first.
fn compare_measures(ours: &LabelledSet, theirs: &LabelledSet) -> Vec<ComparedMeasure> {
    let pairs = measure(ours).into_iter().zip(measure(theirs));
    let mut measures: Vec<_> = pairs
        .filter(|((_, ours), (_, theirs))| !ours.is_empty() && !theirs.is_empty())
        .map(|((title, ours), (_, theirs))| ComparedMeasure::new(title, ours, theirs))
        .collect();
    measures.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    measures
}

impl ComparedMeasure {
    pub(in crate::dataset) fn new(title: &'static str, ours: Vec<f64>, theirs: Vec<f64>) -> Self {
        Self {
            title,
            distance: distance(ours.clone(), theirs.clone()),
            ours,
            theirs,
        }
    }

    fn row(&self) -> [String; 4] {
        [
            self.title.to_owned(),
            quantiles(&self.ours),
            quantiles(&self.theirs),
            format!("{:.2}", self.distance),
        ]
    }

    /// Shares of both sets in bins of the same width: ours as bars, theirs as steps.
    pub(in crate::dataset) fn svg(&self) -> String {
        let [w, h] = FRAME;
        let (width, height) = (ROOM_LEFT + w + ROOM_RIGHT, ROOM_ABOVE + h + ROOM_BELOW);
        let (line, title) = (ROOM_ABOVE + h, escaped(self.title));
        let range = extremes(self.ours.iter().chain(&self.theirs));
        let (histograms, words) = (self.histograms(range), self.words(range));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" \
             font-size=\"11\">\n<title>{title}</title>\n{histograms}<path d=\"M{ROOM_LEFT} {line}h{w}\" \
             stroke=\"#888\"/>\n{words}</svg>\n"
        )
    }

    /// Ours as bars, theirs as steps.
    fn histograms(&self, [low, high]: [f64; 2]) -> String {
        let [ours, theirs] = [&self.ours, &self.theirs].map(|values| shares(values, low, high));
        let most = ours.iter().chain(&theirs).copied().fold(0.0, f64::max);
        let most = most.max(1e-9);
        bars(&ours, most) + &steps(&theirs, most)
    }

    /// The title above the frame and the ends of the range below it.
    fn words(&self, [low, high]: [f64; 2]) -> String {
        let [w, h] = FRAME;
        let below = ROOM_ABOVE + h + 14.0;
        text_at([ROOM_LEFT, ROOM_ABOVE - 10.0], "start", self.title)
            + &text_at([ROOM_LEFT, below], "start", &short(low))
            + &text_at([ROOM_LEFT + w, below], "end", &short(high))
    }
}

/// Left edge of a bin.
fn bin_x(i: usize) -> f64 {
    ROOM_LEFT + FRAME[0] / HISTOGRAM_BINS as f64 * i as f64
}

/// Height in the chart of a share of values.
fn share_y(share: f64, most: f64) -> f64 {
    ROOM_ABOVE + FRAME[1] * (1.0 - share / most)
}

fn bars(shares: &[f64], most: f64) -> String {
    let shares = shares.iter().enumerate();
    shares.map(|(i, share)| bar(i, *share, most)).collect()
}

fn bar(bin: usize, share: f64, most: f64) -> String {
    let width = FRAME[0] / HISTOGRAM_BINS as f64 - 1.0;
    let (x, top) = (bin_x(bin) + 0.5, share_y(share, most));
    let height = ROOM_ABOVE + FRAME[1] - top;
    format!(
        "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{OURS}\" opacity=\"0.75\"/>\n"
    )
}

fn step(bin: usize, share: f64, most: f64) -> String {
    format!("V{:.1}H{:.1}", share_y(share, most), bin_x(bin + 1))
}

fn steps(shares: &[f64], most: f64) -> String {
    let line = ROOM_ABOVE + FRAME[1];
    let shares = shares.iter().enumerate();
    let steps: String = shares.map(|(i, share)| step(i, *share, most)).collect();
    format!(
        "<path d=\"M{ROOM_LEFT} {line}{steps}V{line}\" fill=\"none\" stroke=\"{THEIRS}\" stroke-width=\"2\"/>\n"
    )
}

fn shares(values: &[f64], low: f64, high: f64) -> [f64; HISTOGRAM_BINS] {
    let mut shares = [0.0; HISTOGRAM_BINS];
    for value in values {
        shares[bin_of(*value, low, high)] += 1.0 / values.len() as f64;
    }
    shares
}

fn bin_of(value: f64, low: f64, high: f64) -> usize {
    let place = (value - low) / (high - low) * HISTOGRAM_BINS as f64;
    (place.max(0.0) as usize).min(HISTOGRAM_BINS - 1)
}

/// Greatest distance between two empirical distribution functions.
///
/// # Method
/// Kolmogorov and Smirnov's statistic of two samples.
fn distance(mut a: Vec<f64>, mut b: Vec<f64>) -> f64 {
    a.sort_by(f64::total_cmp);
    b.sort_by(f64::total_cmp);
    let values = a.iter().chain(&b);
    let gaps = values.map(|&x| share_below(&a, x) - share_below(&b, x));
    gaps.map(f64::abs).fold(0.0, f64::max)
}

/// Share of sorted values that are at most `x`.
fn share_below(values: &[f64], x: f64) -> f64 {
    values.partition_point(|v| *v <= x) as f64 / values.len() as f64
}

fn text_at([x, y]: [f64; 2], anchor: &str, text: &str) -> String {
    let text = escaped(text);
    format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>\n")
}

/// The largest channel minus the smallest.
fn channel_spread(codes: [f32; 3]) -> f32 {
    codes.into_iter().fold(0.0, f32::max) - codes.into_iter().fold(255.0, f32::min)
}

fn codes_of(pixel: LinearRgb) -> [f32; 3] {
    let code = encode_srgb8(pixel);
    [code.r, code.g, code.b].map(f32::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_is_none_for_the_same_and_one_for_others() {
        let [low, high] =
            [0.0, 100.0].map(|from| (0..50).map(|i| from + f64::from(i)).collect::<Vec<f64>>());
        assert_eq!(distance(low.clone(), low.clone()), 0.0);
        assert_eq!(distance(low.clone(), high), 1.0);
        // Half of the values are above all of the others.
        let up: Vec<f64> = low.iter().map(|v| v + 25.0).collect();
        assert!((distance(low, up) - 0.5).abs() < 1e-12);
    }
}
