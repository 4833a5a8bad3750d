//! A dataset on one page: pictures with their labels, every drawn value against its distribution, what can be seen, and
//! the user's own pictures beside it.

mod beside;
mod outlier;

use crate::dataset::{SampleSummary, ShownSample, Summary, UnlabelledReason};
use crate::draw::class_color;
use crate::error::Result;
use crate::eval::class_name;
use crate::geom::BBox;
use crate::io;
use crate::label::gallery::{self, Figure, gallery};
use crate::label::{ObjectLabel, trace};
use crate::plot::heat::heat_map;
use crate::plot::{Histogram, Page, Table, escaped};
use beside::{LabelledPicture, Set};
use outlier::{Feature, outliers};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Bins of a histogram of numbers.
const BINS: usize = 20;
/// Bars in a histogram of whole numbers.
const MOST_BARS: f64 = 100.0;

/// Boxes and masks are shown and hidden without a script: a ticked box decides what its neighbours look like. Words over
/// the objects are for enlarged pictures; the list of all pictures loads what is seen of it.
const SAMPLES_STYLE: &str = "<style>.samples text{display:none}.samples figure:target text{display:block}\
    #boxes:not(:checked)~.samples .boxes,#masks:not(:checked)~.samples .masks,#others:not(:checked)~.samples .others\
    {display:none}.histograms{display:flex;flex-wrap:wrap;gap:10px}\
    .all{display:grid;grid-template-columns:repeat(auto-fill,minmax(130px,1fr));gap:6px;margin:6px 0}\
    .all a{position:relative;display:block;font-size:12px;min-width:0}.all img{display:block;width:100%;height:auto;background:#eee}\
    .all svg{position:absolute;left:0;top:0;width:100%;height:auto}.key{white-space:nowrap;margin-right:1.3em}\
    .key i{display:inline-block;width:1em;height:1em;margin-right:.4em;vertical-align:-.15em;border:1px solid #888}</style>\n";

/// The switches over the samples.
const SWITCHES: [(&str, &str, bool); 3] = [
    ("boxes", "boxes of labelled objects", true),
    ("masks", "what is seen of them", false),
    ("others", "outlines of objects without a label", true),
];

/// So many pictures of the list of all stand behind one heading, and so many are listed: a page stays below a few MB.
const LISTED_TOGETHER: usize = 100;
const LISTED: usize = 5_000;

/// What is asked of the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetReportOptions {
    /// Most pictures on the page itself: outliers, then others evenly spread. Default: 32.
    pub most: usize,
    /// Folder that the page is written into, for links to the pictures; by default the dataset's.
    pub page: Option<PathBuf>,
    /// The user's own pictures, to be shown beside: a YOLO dataset, or a folder of images with labels. Default: none.
    pub beside: Option<PathBuf>,
}

impl Default for DatasetReportOptions {
    fn default() -> Self {
        Self {
            most: 32,
            page: None,
            beside: None,
        }
    }
}

/// The page of a dataset's folder.
///
/// # Errors
/// As [`Summary::read`]; a picture that cannot be read; a folder beside it without images.
pub fn page(folder: &Path, options: &DatasetReportOptions) -> Result<Page> {
    let summary = Summary::read(folder)?;
    let name = std::path::absolute(folder)
        .ok()
        .and_then(|f| f.file_name().map(|n| n.to_string_lossy().into_owned()));
    let mut page = Page::new(format!("Dataset {}", name.unwrap_or_default()));
    page.table(&facts(&summary))
        .html(gallery::STYLE)
        .html(SAMPLES_STYLE);
    samples(&mut page, folder, &summary, options.most)?;
    all_pictures(
        &mut page,
        folder,
        &summary,
        options.page.as_deref().unwrap_or(folder),
    );
    if let Some(own) = &options.beside {
        beside::put_on(
            &mut page,
            &as_set(folder, &summary),
            &Set::read(own)?,
            options.most.div_ceil(2),
        );
    }
    drawn(&mut page, &summary);
    seen(&mut page, &summary);
    without_label(&mut page, &summary);
    page.heading("Classes").table(&balance(&summary));
    background_notes(&mut page, &summary);
    rejected(&mut page, &summary);
    page.heading("Time").table(&times(&summary));
    let recipe = serde_json::to_string_pretty(&summary.identity).unwrap_or_default();
    let recipe: String = recipe.lines().map(|line| escaped(line) + "\n").collect();
    page.heading("Made from").html(&format!(
        "<details><summary>dataset.json</summary><pre>{recipe}</pre></details>\n"
    ));
    Ok(page)
}

/// The labels of the dataset as those of any other.
fn as_set(folder: &Path, summary: &Summary) -> Set {
    let labelled = |glance: &SampleSummary| {
        let [w, h] = glance.image.map(f64::from);
        let share = |(class, b): &(u32, BBox)| {
            (
                *class,
                [
                    b.center().x / w,
                    b.center().y / h,
                    b.width() / w,
                    b.height() / h,
                ],
            )
        };
        LabelledPicture {
            path: folder.join(&glance.files[0]),
            boxes: Some(glance.labels.iter().map(share).collect()),
        }
    };
    Set {
        classes: summary.classes.clone(),
        pictures: summary.glances.iter().map(labelled).collect(),
    }
}

fn facts(summary: &Summary) -> Table {
    let mut table = Table::new(["", ""]);
    let text = |name: &str| {
        summary.identity[name]
            .to_string()
            .trim_matches('"')
            .to_owned()
    };
    let [objects, labels] = summary
        .balance
        .iter()
        .flatten()
        .fold([0; 2], |[a, b], [objects, labels]| {
            [a + objects, b + labels]
        });
    let [train, val] = summary.images;
    table.push([
        "images".to_owned(),
        format!(
            "{} ({train} for training, {val} for validation)",
            train + val
        ),
    ]);
    table.push([
        "objects".to_owned(),
        format!("{objects}, {labels} of them with a label"),
    ]);
    table.push(["seed".to_owned(), text("seed")]);
    table.push(["obstructed objects".to_owned(), text("obstructed")]);
    table.push(["made by".to_owned(), format!("petcomp {}", text("petcomp"))]);
    table
}

fn samples(page: &mut Page, folder: &Path, summary: &Summary, most: usize) -> Result<()> {
    page.heading("Pictures")
        .html(&legend(summary))
        .html("<div>\n");
    for (id, text, on) in SWITCHES {
        let checked = if on { " checked" } else { "" };
        page.html(&format!(
            "<input type=\"checkbox\" id=\"{id}\"{checked}><label for=\"{id}\">{text}</label>\n"
        ));
    }
    let chosen = chosen(&summary.glances, most);
    let strange = chosen.iter().filter(|(_, why)| why.is_some()).count();
    page.text(&format!(
        "{} of {} pictures: first {strange} that are unlike the others, with what sets them apart, then others evenly \
         spread. Click one to enlarge it; Escape and the arrow keys work too.",
        chosen.len(),
        summary.glances.len()
    ));
    let show = |(place, why): &(usize, Option<String>)| {
        figure(
            &summary.shown(folder, *place)?,
            &summary.classes,
            why.as_deref(),
        )
    };
    let figures: Result<Vec<Figure>> = chosen.par_iter().map(show).collect();
    page.html("<div class=\"samples\">\n")
        .html(&gallery("picture", &figures?))
        .html("</div>\n</div>\n");
    Ok(())
}

/// Colours of the classes and kinds of lines.
fn legend(summary: &Summary) -> String {
    let key = |fill: &str, text: &str| {
        format!(
            "<span class=\"key\"><i style=\"background:{fill}\"></i>{}</span>\n",
            escaped(text)
        )
    };
    let classes: String = (0..)
        .zip(&summary.classes)
        .map(|(class, name)| key(&color_of(class), name))
        .collect();
    format!(
        "<p>{classes}{}</p>\n",
        key(UNLABELLED, "outline of an object without a label")
    )
}

/// Colour of outlines without a label: seen on light and dark.
const UNLABELLED: &str = "#c8c8c8";

/// Pictures to show: those unlike the others with what sets them apart, at most half, then others evenly spread.
fn chosen(glances: &[SampleSummary], most: usize) -> Vec<(usize, Option<String>)> {
    let feature = |name, value: fn(&SampleSummary) -> f64| Feature {
        name,
        values: glances.iter().map(value).collect(),
    };
    let strange = outliers(&[
        feature("objects", |g| g.objects as f64),
        feature("labels", |g| g.labels.len() as f64),
        feature("objects without a label", |g| {
            (g.objects - g.labels.len()) as f64
        }),
        feature("least seen label, %", |g| 100.0 * g.least_visible),
        feature("largest box, px", |g| sides(g).fold(f64::NAN, f64::max)),
        feature("smallest box, px", |g| sides(g).fold(f64::NAN, f64::min)),
        feature("scenes thrown away", |g| g.rejected as f64),
    ]);
    let mut chosen: Vec<_> = strange
        .into_iter()
        .take(most / 2)
        .map(|o| (o.row, Some(o.why)))
        .collect();
    let known: Vec<usize> = chosen.iter().map(|(row, _)| *row).collect();
    let rest: Vec<usize> = (0..glances.len())
        .filter(|row| !known.contains(row))
        .collect();
    let count = (most - chosen.len()).min(rest.len());
    chosen.extend((0..count).map(|i| (rest[i * rest.len() / count], None)));
    chosen
}

/// The longer side of each labelled box.
fn sides(glance: &SampleSummary) -> impl Iterator<Item = f64> {
    glance.labels.iter().map(|(_, b)| b.width().max(b.height()))
}

/// A picture and its labels over it.
fn figure(shown: &ShownSample, classes: &[String], why: Option<&str>) -> Result<Figure> {
    let record = &shown.record;
    let mut figure = Figure::whole(&shown.picture, record.labels.image.map(f64::from))?;
    let (letter, objects) = (figure.letter(), &record.labels.objects);
    let reason = |object: &ObjectLabel| UnlabelledReason::of(object, record);
    let (mut boxes, mut masks, mut others, mut labelled) =
        (String::new(), String::new(), String::new(), 0);
    for object in objects {
        match reason(object) {
            None => {
                labelled += 1;
                boxes += &box_of(object, classes, letter);
                masks += &mask_of(object);
            }
            Some(reason) => others += &outline_of(object, classes, reason, letter),
        }
    }
    figure.drawing = format!(
        "<g class=\"masks\">{masks}</g><g class=\"others\">{others}</g><g class=\"boxes\">{boxes}</g>"
    );
    let why = why.map_or(String::new(), |why| format!("; {why}"));
    let (index, part) = (record.index, record.part.name());
    figure.caption = format!(
        "{index:06} {part}: {labelled} of {} objects labelled{why}",
        objects.len()
    );
    Ok(figure)
}

pub(crate) fn color_of(class: u32) -> String {
    let color = class_color(class);
    format!("#{:02x}{:02x}{:02x}", color.r, color.g, color.b)
}

fn box_of(object: &ObjectLabel, classes: &[String], letter: f64) -> String {
    let BBox { x0, y0, .. } = object.amodal_box;
    let (width, height, color) = (
        object.amodal_box.width(),
        object.amodal_box.height(),
        color_of(object.class),
    );
    let name = escaped(&class_name(object.class, classes));
    let id = object.id.0;
    format!(
        "<rect x=\"{x0}\" y=\"{y0}\" width=\"{width}\" height=\"{height}\" fill=\"none\" pointer-events=\"all\" \
         stroke=\"{color}\" stroke-width=\"2\"><title>{id} {name}: {:.0} % seen</title></rect>",
        100.0 * object.visible_fraction
    ) + &gallery::words(
        [x0, y0 + letter],
        &format!("{id} {}", class_name(object.class, classes)),
        letter,
        "#222",
    )
}

fn mask_of(object: &ObjectLabel) -> String {
    let mut path = String::new();
    for polygon in trace::polygons(&object.visible_mask, 0.0) {
        for (i, p) in polygon.iter().enumerate() {
            let _ = write!(path, "{}{} {}", if i == 0 { "M" } else { "L" }, p.x, p.y);
        }
        path.push('z');
    }
    format!(
        "<path d=\"{path}\" fill=\"{}\" fill-opacity=\"0.45\"/>",
        color_of(object.class)
    )
}

/// An outline with the reason why it has no label.
fn outline_of(
    object: &ObjectLabel,
    classes: &[String],
    reason: UnlabelledReason,
    letter: f64,
) -> String {
    let over: Vec<String> = object
        .covered_by
        .iter()
        .map(|id| id.0.to_string())
        .collect();
    let why = match reason {
        UnlabelledReason::Covered => format!("under {}", over.join(", ")),
        reason => in_words(reason).to_owned(),
    };
    let (id, name, seen) = (
        object.id.0,
        class_name(object.class, classes),
        100.0 * object.visible_fraction,
    );
    let told = escaped(&format!("{id} {name}: no label, {why}; {seen:.0} % seen"));
    let ring = |ring: &Vec<crate::geom::Point2<f64>>| {
        let points: String = ring
            .iter()
            .map(|p| format!("{:.1},{:.1} ", p.x, p.y))
            .collect();
        format!(
            "<polygon points=\"{}\" fill=\"none\" pointer-events=\"all\" stroke=\"{UNLABELLED}\" stroke-width=\"1.5\">\
             <title>{told}</title></polygon>",
            points.trim_end()
        )
    };
    let rings: String = object.outline_px.iter().map(ring).collect();
    let center = object.amodal_box.center();
    let label = gallery::words(
        [center.x - 2.0 * letter, center.y],
        &format!("{id} {why}"),
        0.7 * letter,
        "#555",
    );
    if rings.is_empty() {
        rings
    } else {
        rings + &label
    }
}

/// Every picture, a hundred behind each heading; they are read from the dataset when a heading is opened.
fn all_pictures(page: &mut Page, folder: &Path, summary: &Summary, from: &Path) {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let root = io::relative(&absolute(folder), &absolute(from));
    page.subheading("All pictures").text(
        "What stands behind these headings is not on this page: pictures are read from the dataset's folder when a heading \
         is opened, and each leads to its file.",
    );
    let glances = &summary.glances[..summary.glances.len().min(LISTED)];
    for part in glances.chunks(LISTED_TOGETHER) {
        let [first, last] = [part.first(), part.last()].map(|glance| glance.map_or(0, |g| g.index));
        let items: String = part.iter().map(|glance| listed(glance, &root)).collect();
        page.html(&format!(
            "<details><summary>{first:06} to {last:06}</summary><div class=\"all\">\n{items}</div></details>\n"
        ));
    }
    let more = summary.glances.len() - glances.len();
    if more > 0 {
        let address = address(&root.join("images"));
        page.html(&format!(
            "<p>{more} more are in <a href=\"{address}\">images</a>.</p>\n"
        ));
    }
}

fn listed(glance: &SampleSummary, root: &Path) -> String {
    let (address, [w, h]) = (address(&root.join(&glance.files[0])), glance.image);
    let mut paths: BTreeMap<u32, String> = BTreeMap::new();
    for (class, b) in &glance.labels {
        let [x, y, w, h] = [b.x0, b.y0, b.width(), b.height()].map(|v| v.round());
        let _ = write!(paths.entry(*class).or_default(), "M{x} {y}h{w}v{h}h-{w}z");
    }
    let boxes: String = paths
        .iter()
        .map(|(class, path)| {
            let color = color_of(*class);
            format!("<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" vector-effect=\"non-scaling-stroke\"/>")
        })
        .collect();
    let (index, part, count) = (glance.index, glance.part.name(), glance.labels.len());
    format!(
        "<a href=\"{address}\"><img loading=\"lazy\" width=\"{w}\" height=\"{h}\" alt=\"\" src=\"{address}\">\
         <svg viewBox=\"0 0 {w} {h}\">{boxes}</svg>{index:06} {part}: {count} of {}</a>\n",
        glance.objects
    )
}

/// A relative path as an address, every byte that means something in one written out.
fn address(path: &Path) -> String {
    let byte = |b: u8| match b {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' => {
            char::from(b).to_string()
        }
        b => format!("%{b:02X}"),
    };
    let text: String = path.to_string_lossy().bytes().map(byte).collect();
    // Before a colon would stand a scheme.
    if text.starts_with('/') {
        text
    } else {
        format!("./{text}")
    }
}

fn in_words(reason: UnlabelledReason) -> &'static str {
    match reason {
        UnlabelledReason::Covered => "another object lies over it",
        UnlabelledReason::Outside => "nothing of it lies in the picture",
        UnlabelledReason::LeftOut => "left out by the recipe",
    }
}

/// Why objects have no label, and how much is seen of those.
fn without_label(page: &mut Page, summary: &Summary) {
    page.heading("Why objects have no label");
    let without: u64 = summary.unlabelled.values().sum();
    if without == 0 {
        page.text("All have one.");
        return;
    }
    let mut table = Table::new(["reason", "objects", "share of all objects"]);
    for (reason, count) in &summary.unlabelled {
        let share = 100.0 * *count as f64 / summary.visible.len().max(1) as f64;
        table.push([
            in_words(*reason).to_owned(),
            count.to_string(),
            format!("{share:.1} %"),
        ]);
    }
    let policy = summary.identity["obstructed"].as_str().unwrap_or("drop");
    page.table(&table).text(&format!(
        "The recipe's obstructed = \"{policy}\" decides about objects that others lie over, by the topmost rule, however \
         little of them is hidden; \"keep\" labels them too."
    ));
    histograms(
        page,
        &[Histogram::of(
            "seen share of objects without a label",
            &summary.unlabelled_visible,
            [0.0, 1.0],
            BINS,
        )],
    );
}

/// Every drawn value against its distribution.
fn drawn(page: &mut Page, summary: &Summary) {
    page.heading("What was drawn").text(
        "Bars: values in the dataset. Dashed line: the recipe's distribution; about one bar in twenty lies outside the \
         band around it by chance. What does not vary is in the table below.",
    );
    let mut fixed = Table::new(["not varying", "value"]);
    let mut charts = Vec::new();
    for (key, values) in &summary.drawn {
        match summary.range(key) {
            Some(([low, high], _)) if low == high => fixed.push([key.clone(), low.to_string()]),
            Some(([low, high], true)) => {
                let mut h = Histogram::of(
                    key,
                    values,
                    [low - 0.5, high + 0.5],
                    whole_bars([low, high]),
                )
                .uniform();
                h.ends = [low.to_string(), high.to_string()];
                charts.push(h);
            }
            Some((range, false)) => charts.push(Histogram::of(key, values, range, BINS).uniform()),
            None => charts.push(Histogram::of(key, values, extremes(values), BINS)),
        }
    }
    charts.extend(
        summary
            .chosen
            .iter()
            .map(|(what, counts)| choices(what, counts)),
    );
    histograms(page, &charts);
    if !fixed.rows.is_empty() {
        page.table(&fixed);
    }
}

/// A bar for each whole number, as long as they can be told apart.
fn whole_bars([low, high]: [f64; 2]) -> usize {
    let numbers = high - low + 1.0;
    if numbers <= MOST_BARS {
        numbers as usize
    } else {
        BINS
    }
}

fn choices(what: &str, counts: &BTreeMap<String, u64>) -> Histogram {
    let name =
        |entry: Option<(&String, &u64)>| entry.map_or(String::new(), |(name, _)| name.clone());
    let h = Histogram {
        title: format!("{what} ({} of them)", counts.len()),
        ends: [
            name(counts.first_key_value()),
            name(counts.last_key_value()),
        ],
        counts: counts.values().copied().collect(),
        expected: None,
    };
    if what == "photo of the asset" {
        h
    } else {
        h.uniform()
    }
}

fn extremes(values: &[f64]) -> [f64; 2] {
    let [low, high] = values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
            [v.min(a), v.max(b)]
        });
    if low < high {
        [low, high]
    } else {
        [low - 0.5, low + 0.5]
    }
}

/// What can be seen, and how large it is.
fn seen(page: &mut Page, summary: &Summary) {
    let side = |i: usize| {
        summary
            .boxes
            .iter()
            .map(|sides| sides[i])
            .collect::<Vec<f64>>()
    };
    let largest = summary
        .boxes
        .iter()
        .flatten()
        .fold(1.0, |a: f64, b| a.max(*b));
    let count = |title, of: fn(&SampleSummary) -> usize| {
        let counts: Vec<f64> = summary
            .glances
            .iter()
            .map(|glance| of(glance) as f64)
            .collect();
        let most = counts.iter().copied().fold(1.0, f64::max);
        let mut h = Histogram::of(
            title,
            &counts,
            [-0.5, most + 0.5],
            (most as usize + 1).min(MOST_BINS),
        );
        h.ends = ["0".into(), most.to_string()];
        h
    };
    page.heading("What is seen");
    histograms(
        page,
        &[
            count("objects in a picture", |glance| glance.objects),
            count("labels in a picture", |glance| glance.labels.len()),
            Histogram::of(
                "seen share of an object",
                &summary.visible,
                [0.0, 1.0],
                BINS,
            ),
            Histogram::of(
                "width of labelled boxes, pixels",
                &side(0),
                [0.0, largest],
                BINS,
            ),
            Histogram::of(
                "height of labelled boxes, pixels",
                &side(1),
                [0.0, largest],
                BINS,
            ),
        ],
    );
    heat(page, summary);
}

/// Where the labels are, all of them and those of each class that is not too many.
fn heat(page: &mut Page, summary: &Summary) {
    let set = as_set(Path::new(""), summary);
    let centres = |class: Option<u32>| -> Vec<[f64; 2]> {
        let of = |(own, _): &&(u32, [f64; 4])| class.is_none_or(|class| class == *own);
        let boxes = set
            .pictures
            .iter()
            .filter_map(|picture| picture.boxes.as_ref())
            .flatten();
        boxes.filter(of).map(|(_, [x, y, ..])| [*x, *y]).collect()
    };
    let mut maps = heat_map("centres of all labels", &centres(None));
    if summary.classes.len() > 1 {
        for (class, name) in (0..).zip(&summary.classes).take(MOST_MAPS) {
            maps += &heat_map(
                &format!("centres of {}", gallery::clipped(name, 30)),
                &centres(Some(class)),
            );
        }
    }
    page.html(&format!("<div class=\"histograms\">\n{maps}</div>\n"));
}

/// Classes that have a map of their own, and bins of a histogram of counts.
const MOST_MAPS: usize = 12;
const MOST_BINS: usize = 60;

fn histograms(page: &mut Page, charts: &[Histogram]) {
    let all: String = charts.iter().map(Histogram::svg).collect();
    page.html(&format!("<div class=\"histograms\">\n{all}</div>\n"));
}

fn balance(summary: &Summary) -> Table {
    let mut table = Table::new([
        "class",
        "objects, train",
        "labels, train",
        "objects, val",
        "labels, val",
    ]);
    for (name, [[a, b], [c, d]]) in summary.classes.iter().zip(&summary.balance) {
        table.push([
            name.clone(),
            a.to_string(),
            b.to_string(),
            c.to_string(),
            d.to_string(),
        ]);
    }
    table
}

/// What was odd about the photos of the place and their cameras.
fn background_notes(page: &mut Page, summary: &Summary) {
    let notes = summary.identity["recipe"]["notes"].as_object();
    let Some(notes) = notes.filter(|notes| !notes.is_empty()) else {
        return;
    };
    let mut table = Table::new(["background", "what to look at"]);
    for (name, texts) in notes {
        let texts = texts.as_array().map_or(&[][..], Vec::as_slice);
        texts
            .iter()
            .filter_map(|text| text.as_str())
            .for_each(|text| table.push([name.clone(), text.to_owned()]));
    }
    page.heading("Backgrounds").table(&table);
}

fn rejected(page: &mut Page, summary: &Summary) {
    page.heading("Scenes that were thrown away");
    if summary.rejected.is_empty() {
        page.text("None.");
        return;
    }
    let mut table = Table::new(["image", "why"]);
    summary
        .rejected
        .iter()
        .for_each(|(k, why)| table.push([format!("{k:06}"), why.clone()]));
    page.text(&format!(
        "{} scenes would not come to rest and were drawn again.",
        summary.rejected.len()
    ))
    .table(&table);
}

fn times(summary: &Summary) -> Table {
    let columns = [
        "images",
        "threads",
        "seconds",
        "images a second",
        "settle",
        "render",
        "label",
        "write",
    ];
    let mut table = Table::new(columns);
    for run in &summary.runs {
        let made = run.made as f64;
        let each = |seconds: f64| format!("{:.1} ms an image", 1000.0 * seconds / made);
        table.push([
            run.made.to_string(),
            run.threads.to_string(),
            format!("{:.1}", run.wall_s),
            format!("{:.2}", made / run.wall_s),
            each(run.settle_s),
            each(run.render_s),
            each(run.label_s),
            each(run.write_s),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_have_bars_of_their_own_until_there_are_too_many() {
        assert_eq!(whole_bars([4.0, 12.0]), 9);
        assert_eq!(whole_bars([0.0, 99.0]), 100);
        assert_eq!(whole_bars([0.0, 100.0]), BINS);
        assert_eq!(whole_bars([0.0, 9007199254740991.0]), BINS);
        assert_eq!(whole_bars([0.0, f64::INFINITY]), BINS);
    }
}
