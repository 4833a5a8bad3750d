//! A dataset on one page: pictures with their labels, every drawn value against its distribution, what can be seen.

use super::{Histogram, Page, Table, base64, escaped};
use crate::color::to_srgb8;
use crate::dataset::{Shown, Summary};
use crate::error::Result;
use crate::filter::resize;
use crate::io;
use crate::label::draw::class_color;
use crate::label::{BBox, ObjectLabel, trace};
use crate::pixel::LinearRgb;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Widest a sample picture is, pixels.
const PICTURE_WIDTH: usize = 480;

/// Bins of a histogram of numbers.
const BINS: usize = 20;

/// Boxes and masks are shown and hidden without a script: a ticked box decides what its neighbours look like.
const SAMPLES_STYLE: &str = "<style>.samples{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));\
    gap:10px;margin-top:1em}.samples figure{margin:0;position:relative}.samples img{width:100%;display:block}\
    .samples svg{position:absolute;left:0;top:0;width:100%;height:auto}\
    #boxes:not(:checked)~.samples .boxes,#masks:not(:checked)~.samples .masks,#others:not(:checked)~.samples .others\
    {display:none}.histograms{display:flex;flex-wrap:wrap}</style>\n";

/// The switches over the samples.
const SWITCHES: [(&str, &str, bool); 3] = [
    ("boxes", "boxes of labelled objects", true),
    ("masks", "what is seen of them", false),
    ("others", "outlines of objects without a label", true),
];

/// The page of a dataset's folder, with at most `most` sample pictures.
///
/// # Errors
/// As [`Summary::read`]; a picture that cannot be read.
pub fn page(folder: &Path, most: usize) -> Result<Page> {
    let summary = Summary::read(folder, most)?;
    let name = std::path::absolute(folder).ok().and_then(|f| f.file_name().map(|n| n.to_string_lossy().into_owned()));
    let mut page = Page::new(format!("Dataset {}", name.unwrap_or_default()));
    page.table(&facts(&summary));
    samples(&mut page, &summary)?;
    drawn(&mut page, &summary);
    seen(&mut page, &summary);
    page.heading("Classes").table(&balance(&summary));
    background_notes(&mut page, &summary);
    rejected(&mut page, &summary);
    page.heading("Time").table(&times(&summary));
    let recipe = serde_json::to_string_pretty(&summary.identity).unwrap_or_default();
    page.heading("Made from")
        .html(&format!("<details><summary>dataset.json</summary><pre>{}</pre></details>\n", escaped(&recipe)));
    Ok(page)
}

fn facts(summary: &Summary) -> Table {
    let mut table = Table::new(["", ""]);
    let text = |name: &str| summary.identity[name].to_string().trim_matches('"').to_owned();
    let [objects, labels] =
        summary.balance.iter().flatten().fold([0; 2], |[a, b], [objects, labels]| [a + objects, b + labels]);
    let [train, val] = summary.images;
    table.push(["images".to_owned(), format!("{} ({train} for training, {val} for validation)", train + val)]);
    table.push(["objects".to_owned(), format!("{objects}, {labels} of them with a label")]);
    table.push(["seed".to_owned(), text("seed")]);
    table.push(["obstructed objects".to_owned(), text("obstructed")]);
    table.push(["made by".to_owned(), format!("petcomp {}", text("petcomp"))]);
    table
}

fn samples(page: &mut Page, summary: &Summary) -> Result<()> {
    page.heading("Pictures").html(SAMPLES_STYLE).html("<div>\n");
    for (id, text, on) in SWITCHES {
        let checked = if on { " checked" } else { "" };
        page.html(&format!("<input type=\"checkbox\" id=\"{id}\"{checked}><label for=\"{id}\">{text}</label>\n"));
    }
    let figures: Result<Vec<String>> = summary.shown.par_iter().map(|shown| figure(shown, &summary.classes)).collect();
    page.html("<div class=\"samples\">\n").html(&figures?.concat()).html("</div>\n</div>\n");
    Ok(())
}

/// A picture and its labels over it.
fn figure(shown: &Shown, classes: &[String]) -> Result<String> {
    let picture = io::read::<LinearRgb>(&shown.picture)?;
    let (w, h) = picture.size();
    let width = w.min(PICTURE_WIDTH);
    let small = if width < w { resize(&picture, width, (h * width).div_ceil(w).max(1)) } else { picture };
    let data = base64(&io::jpeg_bytes(&to_srgb8(&small), 85)?);
    let record = &shown.record;
    let [lw, lh] = record.labels.image;
    let (labelled, others): (Vec<_>, Vec<_>) =
        record.labels.objects.iter().partition(|object| record.labelled.contains(&object.id));
    let boxes: String = labelled.iter().map(|object| box_of(object, classes)).collect();
    let masks: String = labelled.iter().map(|object| mask_of(object)).collect();
    let others: String = others.iter().map(|object| outline_of(object)).collect();
    let count = record.labels.objects.len();
    Ok(format!(
        "<figure><img alt=\"\" src=\"data:image/jpeg;base64,{data}\"><svg viewBox=\"0 0 {lw} {lh}\">\
         <g class=\"masks\">{masks}</g><g class=\"others\">{others}</g><g class=\"boxes\">{boxes}</g></svg>\
         <figcaption>{:06} {}: {} of {count} objects labelled</figcaption></figure>\n",
        record.index,
        record.part.name(),
        labelled.len()
    ))
}

fn color_of(class: u32) -> String {
    let color = class_color(class);
    format!("#{:02x}{:02x}{:02x}", color.r, color.g, color.b)
}

fn box_of(object: &ObjectLabel, classes: &[String]) -> String {
    let BBox { x0, y0, .. } = object.amodal_box;
    let (width, height, color) = (object.amodal_box.width(), object.amodal_box.height(), color_of(object.class));
    let name = classes.get(object.class as usize).map_or("", String::as_str);
    format!(
        "<rect x=\"{x0}\" y=\"{y0}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"{color}\" \
         stroke-width=\"2\"><title>{} {}: {:.0} % seen</title></rect>",
        object.id.0,
        escaped(name),
        100.0 * object.visible_fraction
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
    format!("<path d=\"{path}\" fill=\"{}\" fill-opacity=\"0.45\"/>", color_of(object.class))
}

fn outline_of(object: &ObjectLabel) -> String {
    let ring = |ring: &Vec<crate::geom::Point2<f64>>| {
        let points: String = ring.iter().map(|p| format!("{:.1},{:.1} ", p.x, p.y)).collect();
        format!("<polygon points=\"{}\" fill=\"none\" stroke=\"#c8c8c8\"/>", points.trim_end())
    };
    object.outline_px.iter().map(ring).collect()
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
                let bins = (high - low) as usize + 1;
                let mut h = Histogram::of(key, values, [low - 0.5, high + 0.5], bins).uniform();
                h.ends = [low.to_string(), high.to_string()];
                charts.push(h);
            }
            Some((range, false)) => charts.push(Histogram::of(key, values, range, BINS).uniform()),
            None => charts.push(Histogram::of(key, values, extremes(values), BINS)),
        }
    }
    charts.extend(summary.chosen.iter().map(|(what, counts)| choices(what, counts)));
    histograms(page, &charts);
    if !fixed.rows.is_empty() {
        page.table(&fixed);
    }
}

fn choices(what: &str, counts: &BTreeMap<String, u64>) -> Histogram {
    let name = |entry: Option<(&String, &u64)>| entry.map_or(String::new(), |(name, _)| name.clone());
    let h = Histogram {
        title: format!("{what} ({} of them)", counts.len()),
        ends: [name(counts.first_key_value()), name(counts.last_key_value())],
        counts: counts.values().copied().collect(),
        expected: None,
    };
    if what == "photo of the asset" { h } else { h.uniform() }
}

fn extremes(values: &[f64]) -> [f64; 2] {
    let [low, high] = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [v.min(a), v.max(b)]);
    if low < high { [low, high] } else { [low - 0.5, low + 0.5] }
}

/// What can be seen, and how large it is.
fn seen(page: &mut Page, summary: &Summary) {
    let side = |i: usize| summary.boxes.iter().map(|sides| sides[i]).collect::<Vec<f64>>();
    let largest = summary.boxes.iter().flatten().fold(1.0, |a: f64, b| a.max(*b));
    page.heading("What is seen");
    histograms(
        page,
        &[
            Histogram::of("seen share of an object", &summary.visible, [0.0, 1.0], BINS),
            Histogram::of("width of labelled boxes, pixels", &side(0), [0.0, largest], BINS),
            Histogram::of("height of labelled boxes, pixels", &side(1), [0.0, largest], BINS),
        ],
    );
}

fn histograms(page: &mut Page, charts: &[Histogram]) {
    let all: String = charts.iter().map(Histogram::svg).collect();
    page.html(&format!("<div class=\"histograms\">\n{all}</div>\n"));
}

fn balance(summary: &Summary) -> Table {
    let mut table = Table::new(["class", "objects, train", "labels, train", "objects, val", "labels, val"]);
    for (name, [[a, b], [c, d]]) in summary.classes.iter().zip(&summary.balance) {
        table.push([name.clone(), a.to_string(), b.to_string(), c.to_string(), d.to_string()]);
    }
    table
}

/// What was odd about the photos of the place and their cameras.
fn background_notes(page: &mut Page, summary: &Summary) {
    let notes = summary.identity["recipe"]["background_notes"].as_object();
    let Some(notes) = notes.filter(|notes| !notes.is_empty()) else { return };
    let mut table = Table::new(["background", "what to look at"]);
    for (name, texts) in notes {
        let texts = texts.as_array().map_or(&[][..], Vec::as_slice);
        texts.iter().filter_map(|text| text.as_str()).for_each(|text| table.push([name.clone(), text.to_owned()]));
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
    summary.rejected.iter().for_each(|(k, why)| table.push([format!("{k:06}"), why.clone()]));
    page.text(&format!("{} scenes would not come to rest and were drawn again.", summary.rejected.len())).table(&table);
}

fn times(summary: &Summary) -> Table {
    let columns = ["images", "threads", "seconds", "images a second", "settle", "render", "label", "write"];
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
