//! A dataset on one page: pictures with their labels, every drawn value against its distribution,
//! what can be seen, and the user's own pictures beside it.

mod all_pictures;
pub(super) mod beside;
mod distributions;
pub(super) mod labelled_pictures;
pub(super) mod outlier;
mod samples;

use crate::dataset::Summary;
use crate::dataset::counts::sum_by_part;
use crate::draw::class_color;
use crate::error::Result;
use crate::label::gallery;
use crate::plot::{Page, Table, escaped};
use labelled_pictures::LabelledSet;
use std::path::{Path, PathBuf};

/// What is asked of the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetReportOptions {
    /// Most pictures on the page itself: outliers, then others evenly spread. Default: 32.
    pub most: usize,
    /// Folder that the page is written into, for links to the pictures; by default the dataset's.
    pub page: Option<PathBuf>,
    /// The user's own pictures, to be shown beside: a YOLO dataset, or a folder of images with
    /// labels. Default: none.
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
    let mut page = begin_page(folder, &summary);
    samples::add_samples(&mut page, &summary, folder, options.most)?;
    let page_folder = options.page.as_deref().unwrap_or(folder);
    all_pictures::add_all(&mut page, folder, &summary, page_folder);
    if let Some(own) = &options.beside {
        let ours = LabelledSet::from_summary(folder, &summary);
        let theirs = LabelledSet::read(own)?;
        beside::add_comparison(&mut page, &ours, &theirs, options.most.div_ceil(2));
    }
    add_statistics(&mut page, &summary);
    Ok(page)
}

fn begin_page(folder: &Path, summary: &Summary) -> Page {
    let mut page = Page::new(title(folder));
    page.table(&facts(summary))
        .html(gallery::STYLE)
        .html(samples::SAMPLES_STYLE);
    page
}

/// Everything that is not about single pictures.
fn add_statistics(page: &mut Page, summary: &Summary) {
    distributions::add_drawn(page, summary);
    distributions::add_seen(page, summary);
    add_unlabelled(page, summary);
    page.heading("Classes").table(&balance(summary));
    add_background_notes(page, summary);
    add_rejected(page, summary);
    page.heading("Time").table(&times(summary));
    add_identity(page, summary);
}

/// "Dataset" and the folder's name, once where it is called so itself.
fn title(folder: &Path) -> String {
    let path = std::path::absolute(folder).unwrap_or_default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if name.to_lowercase().starts_with("dataset") || name.is_empty() {
        let rest = name.get("dataset".len()..).unwrap_or_default();
        return format!("Dataset{rest}");
    }
    format!("Dataset {name}")
}

/// Adds what the dataset was made from.
fn add_identity(page: &mut Page, summary: &Summary) {
    let text = serde_json::to_string_pretty(&summary.identity).unwrap_or_default();
    let recipe: String = text.lines().map(|line| escaped(line) + "\n").collect();
    page.heading("Made from").html(&format!(
        "<details><summary>dataset.json</summary><pre>{recipe}</pre></details>\n"
    ));
}

fn facts(summary: &Summary) -> Table {
    let [train, val] = summary.images;
    let images = train + val;
    let [objects, labels] = sum_by_part(summary.balance.iter().flatten().copied());
    let images = format!("{images} ({train} for training, {val} for validation)");
    let objects = format!("{objects}, {labels} of them with a label");
    let version = format!("petcomp {}", identity_text(summary, "petcomp"));
    let mut table = Table::new(["", ""]);
    table.push(["images", &images]);
    table.push(["objects", &objects]);
    table.push(["seed", &identity_text(summary, "seed")]);
    table.push(["obstructed objects", &identity_text(summary, "obstructed")]);
    table.push(["made by", &version]);
    table
}

/// A field of what the dataset was made from.
fn identity_text(summary: &Summary, name: &str) -> String {
    let value = summary.identity[name].to_string();
    value.trim_matches('"').to_owned()
}

fn balance(summary: &Summary) -> Table {
    let mut table = Table::new([
        "class",
        "objects, train",
        "labels, train",
        "objects, val",
        "labels, val",
    ]);
    for (name, counts) in summary.classes.iter().zip(&summary.balance) {
        let counts = counts.iter().flatten().map(u64::to_string);
        table.push([name.clone()].into_iter().chain(counts));
    }
    table
}

/// What was odd about the photos of the place and their cameras.
fn add_background_notes(page: &mut Page, summary: &Summary) {
    let notes = summary.identity["recipe"]["notes"].as_object();
    let Some(notes) = notes.filter(|notes| !notes.is_empty()) else {
        return;
    };
    let mut table = Table::new(["background", "what to look at"]);
    for (name, texts) in notes {
        let texts = texts.as_array().into_iter().flatten();
        for text in texts.filter_map(|text| text.as_str()) {
            table.push([name, text]);
        }
    }
    page.heading("Backgrounds").table(&table);
}

fn add_rejected(page: &mut Page, summary: &Summary) {
    page.heading("Rejected scenes");
    if summary.rejected.is_empty() {
        page.text("None.");
        return;
    }
    let mut table = Table::new(["image", "why"]);
    for (k, why) in &summary.rejected {
        table.push([format!("{k:06}"), why.clone()]);
    }
    page.text(&format!(
        "{} scenes did not come to rest and were resampled.",
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
        let [settle, render, label, write] = [run.settle_s, run.render_s, run.label_s, run.write_s]
            .map(|seconds| format!("{:.1} ms an image", 1000.0 * seconds / made));
        table.push([
            run.made.to_string(),
            run.threads.to_string(),
            format!("{:.1}", run.wall_s),
            format!("{:.2}", made / run.wall_s),
            settle,
            render,
            label,
            write,
        ]);
    }
    table
}

/// Colour of a class in SVG.
fn color_of(class: u32) -> String {
    let color = class_color(class);
    format!("#{:02x}{:02x}{:02x}", color.r, color.g, color.b)
}

/// Why objects have no label, and how much is seen of those.
fn add_unlabelled(page: &mut Page, summary: &Summary) {
    page.heading("Why objects have no label");
    if summary.unlabelled.values().sum::<u64>() == 0 {
        page.text("All have one.");
        return;
    }
    page.table(&unlabelled_reasons(summary))
        .text(&obstruction_note(&summary.identity));
    let title = "seen share of objects without a label";
    let histogram = distributions::visible_histogram(title, &summary.unlabelled_visible);
    distributions::add_histograms(page, &[histogram]);
}

/// What the recipe's policy decides about.
fn obstruction_note(identity: &serde_json::Value) -> String {
    let policy = identity["obstructed"].as_str().unwrap_or("drop");
    let obstructed = match &identity["recipe"]["label"]["min_visible"] {
        serde_json::Value::Number(share) => {
            format!(
                "objects over whose outlines others lie, but for less than min_visible = {share} of them"
            )
        }
        _ => "objects that others lie over, by the topmost rule, however little of them is hidden"
            .to_owned(),
    };
    format!(
        "The recipe's obstructed = \"{policy}\" decides about {obstructed}; \"keep\" labels them too."
    )
}

fn unlabelled_reasons(summary: &Summary) -> Table {
    let mut table = Table::new(["reason", "objects", "share of all objects"]);
    for (reason, count) in &summary.unlabelled {
        let share = 100.0 * *count as f64 / summary.visible.len().max(1) as f64;
        table.push([
            reason.description().to_owned(),
            count.to_string(),
            format!("{share:.1} %"),
        ]);
    }
    table
}
