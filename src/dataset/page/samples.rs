//! Pictures of a dataset with their labels over them.

use super::color_of;
use super::outlier::{Feature, outliers};
use crate::dataset::{SampleRecord, SampleSummary, ShownSample, Summary, UnlabelledReason};
use crate::error::Result;
use crate::eval::class_name;
use crate::geom::{BBox, Point2};
use crate::label::gallery::{self, Figure, gallery};
use crate::label::{Distractor, ObjectLabel, trace};
use crate::plot::{Page, escaped};
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;

/// Boxes and masks are shown and hidden without a script, by the state of check boxes. Words over
/// the objects are for enlarged pictures; the list of all pictures loads those that are scrolled
/// into view.
pub(super) const SAMPLES_STYLE: &str = "<style>.samples text{display:none}.samples figure:target text{display:block}\
    #boxes:not(:checked)~.samples .boxes,#masks:not(:checked)~.samples .masks,#others:not(:checked)~.samples .others\
    {display:none}.histograms{display:flex;flex-wrap:wrap;gap:10px}\
    .all{display:grid;grid-template-columns:repeat(auto-fill,minmax(130px,1fr));gap:6px;margin:6px 0}\
    .all a{position:relative;display:block;font-size:12px;min-width:0}.all img{display:block;width:100%;height:auto;background:#eee}\
    .all svg{position:absolute;left:0;top:0;width:100%;height:auto}.key{white-space:nowrap;margin-right:1.3em}\
    .key i{display:inline-block;width:1em;height:1em;margin-right:.4em;vertical-align:-.15em;border:1px solid #888}</style>\n";

/// The check boxes above the samples.
const SWITCHES: [(&str, &str, bool); 3] = [
    ("boxes", "boxes of labelled objects", true),
    ("masks", "their visible parts", false),
    ("others", "outlines of objects without a label", true),
];

/// Colour of outlines without a label: visible on light and dark.
const UNLABELLED: &str = "#c8c8c8";

/// Adds the pictures and the check boxes above them.
pub(super) fn add_samples(
    page: &mut Page,
    summary: &Summary,
    folder: &Path,
    count: usize,
) -> Result<()> {
    add_controls(page, summary);
    let selected = select_samples(&summary.glances, count);
    page.text(&describe_selection(&selected, summary.glances.len()));
    let figures: Vec<Figure> = selected
        .par_iter()
        .map(|sample| {
            let shown = summary.shown(folder, sample.row)?;
            figure(&shown, &summary.classes, sample.why.as_deref())
        })
        .collect::<Result<_>>()?;
    page.html("<div class=\"samples\">\n")
        .html(&gallery("picture", &figures))
        .html("</div>\n</div>\n");
    Ok(())
}

fn add_controls(page: &mut Page, summary: &Summary) {
    page.heading("Pictures")
        .html(&legend(summary))
        .html("<div>\n");
    for switch in SWITCHES {
        page.html(&switch_html(switch));
    }
}

fn switch_html((id, text, on): (&str, &str, bool)) -> String {
    let checked = if on { " checked" } else { "" };
    format!("<input type=\"checkbox\" id=\"{id}\"{checked}><label for=\"{id}\">{text}</label>\n")
}

fn describe_selection(selected: &[SelectedSample], all: usize) -> String {
    let outliers = selected.iter().filter(|sample| sample.why.is_some());
    let (count, outliers) = (selected.len(), outliers.count());
    format!(
        "{count} of {all} pictures: first {outliers} outliers, with what sets them apart, then others evenly spread. \
         Click one to enlarge it; Escape and the arrow keys work too."
    )
}

/// Colours of the classes and kinds of lines.
fn legend(summary: &Summary) -> String {
    let classes = (0..).zip(&summary.classes);
    let classes = classes.map(|(class, name)| legend_key(&color_of(class), name));
    let classes: String = classes.collect();
    let unlabelled = legend_key(UNLABELLED, "outline of an object without a label");
    format!("<p>{classes}{unlabelled}</p>\n")
}

fn legend_key(fill: &str, text: &str) -> String {
    format!(
        "<span class=\"key\"><i style=\"background:{fill}\"></i>{}</span>\n",
        escaped(text)
    )
}

/// A picture to show.
struct SelectedSample {
    /// Its index among all samples.
    row: usize,
    /// What sets it apart from the others, if anything does.
    why: Option<String>,
}

/// Pictures to show: outliers, at most half, then others evenly spread.
fn select_samples(samples: &[SampleSummary], count: usize) -> Vec<SelectedSample> {
    let outliers = outliers(&features(samples)).into_iter().take(count / 2);
    let selected = outliers.map(|outlier| SelectedSample {
        row: outlier.row,
        why: Some(outlier.why),
    });
    let mut selected: Vec<_> = selected.collect();
    let mut rest: Vec<usize> = (0..samples.len()).collect();
    rest.retain(|&row| selected.iter().all(|sample| sample.row != row));
    let count = (count - selected.len()).min(rest.len());
    selected.extend((0..count).map(|i| SelectedSample {
        row: rest[i * rest.len() / count],
        why: None,
    }));
    selected
}

/// The title of a measure and how it is computed from a sample's summary.
type SampleMeasure = (&'static str, fn(&SampleSummary) -> f64);

/// The features by which outliers are found.
fn features(samples: &[SampleSummary]) -> [Feature<'static>; 7] {
    SAMPLE_MEASURES.map(|(name, value)| Feature {
        name,
        values: samples.iter().map(value).collect(),
    })
}

const SAMPLE_MEASURES: [SampleMeasure; 7] = [
    ("objects", |s| s.objects as f64),
    ("labels", |s| s.labels.len() as f64),
    ("objects without a label", |s| {
        (s.objects - s.labels.len()) as f64
    }),
    ("least visible label, %", |s| 100.0 * s.least_visible),
    ("largest box, px", |s| {
        longer_sides(s).fold(f64::NAN, f64::max)
    }),
    ("smallest box, px", |s| {
        longer_sides(s).fold(f64::NAN, f64::min)
    }),
    ("rejected scenes", |s| s.rejected as f64),
];

/// The longer side of each labelled box.
fn longer_sides(sample: &SampleSummary) -> impl Iterator<Item = f64> {
    sample.labels.iter().map(|(_, b)| b.width().max(b.height()))
}

/// A picture and its labels over it.
fn figure(shown: &ShownSample, classes: &[String], why: Option<&str>) -> Result<Figure> {
    let record = &shown.record;
    let mut figure = Figure::whole(&shown.picture, record.labels.image.map(f64::from))?;
    figure.drawing = drawing_of(record, classes, figure.letter_height());
    figure.caption = figure_caption(record, why);
    Ok(figure)
}

/// Masks, outlines without a label, and boxes, as SVG.
fn drawing_of(record: &SampleRecord, classes: &[String], letter: f64) -> String {
    let (mut boxes, mut masks, mut others) = (String::new(), String::new(), String::new());
    for object in &record.labels.objects {
        match UnlabelledReason::of(object, record) {
            None => {
                boxes += &box_of(object, classes, letter);
                masks += &mask_of(object);
            }
            Some(reason) => others += &outline_of(object, classes, reason, letter),
        }
    }
    others.extend(record.labels.distractors.iter().map(outline_of_distractor));
    format!(
        "<g class=\"masks\">{masks}</g><g class=\"others\">{others}</g><g class=\"boxes\">{boxes}</g>"
    )
}

fn figure_caption(record: &SampleRecord, why: Option<&str>) -> String {
    let (index, part, objects) = (record.index, record.part.name(), &record.labels.objects);
    let labelled = objects
        .iter()
        .filter(|object| UnlabelledReason::of(object, record).is_none());
    let (labelled, all) = (labelled.count(), objects.len());
    let why = why.map_or(String::new(), |why| format!("; {why}"));
    format!("{index:06} {part}: {labelled} of {all} objects labelled{why}")
}

fn box_of(object: &ObjectLabel, classes: &[String], letter: f64) -> String {
    let bbox = object.amodal_box;
    let BBox { x0, y0, .. } = bbox;
    let (width, height, color) = (bbox.width(), bbox.height(), color_of(object.class));
    let (id, name) = (object.id.0, class_name(object.class, classes));
    let rectangle = format!(
        "<rect x=\"{x0}\" y=\"{y0}\" width=\"{width}\" height=\"{height}\" fill=\"none\" pointer-events=\"all\" \
         stroke=\"{color}\" stroke-width=\"2\"><title>{id} {}: {:.0} % seen</title></rect>",
        escaped(&name),
        percent_seen(object)
    );
    rectangle + &gallery::words([x0, y0 + letter], &format!("{id} {name}"), letter, "#222")
}

fn mask_of(object: &ObjectLabel) -> String {
    let polygons = trace::polygons(&object.visible_mask, 0.0);
    let path: String = polygons.iter().map(|polygon| svg_path(polygon)).collect();
    format!(
        "<path d=\"{path}\" fill=\"{}\" fill-opacity=\"0.45\"/>",
        color_of(object.class)
    )
}

fn svg_path(polygon: &[Point2<f64>]) -> String {
    let mut path = String::new();
    for (i, p) in polygon.iter().enumerate() {
        let _ = write!(path, "{}{} {}", if i == 0 { "M" } else { "L" }, p.x, p.y);
    }
    path + "z"
}

fn percent_seen(object: &ObjectLabel) -> f64 {
    100.0 * object.visible_fraction
}

/// An outline with the reason why it has no label.
fn outline_of(
    object: &ObjectLabel,
    classes: &[String],
    reason: UnlabelledReason,
    letter: f64,
) -> String {
    if object.outline_px.is_empty() {
        return String::new();
    }
    let why = why_unlabelled(object, reason);
    let id = object.id.0;
    let (name, seen) = (class_name(object.class, classes), percent_seen(object));
    let title = format!("{id} {name}: no label, {why}; {seen:.0} % seen");
    let rings = titled_rings(&object.outline_px, &escaped(&title));
    let center = object.amodal_box.center();
    let at = [center.x - 2.0 * letter, center.y];
    rings + &gallery::words(at, &format!("{id} {why}"), 0.7 * letter, "#555")
}

fn outline_of_distractor(distractor: &Distractor) -> String {
    let title = format!("{} distractor: no label", distractor.id.0);
    titled_rings(&distractor.outline_px, &title)
}

fn why_unlabelled(object: &ObjectLabel, reason: UnlabelledReason) -> String {
    let above = object.covered_by.iter().map(|id| id.0.to_string());
    let above: Vec<String> = above.collect();
    // Objects can hide pixels of each other where their outlines only touch.
    if reason != UnlabelledReason::Covered || above.is_empty() {
        return reason.description().to_owned();
    }
    format!("under {}", above.join(", "))
}

fn titled_rings(rings: &[Vec<Point2<f64>>], title: &str) -> String {
    let rings = rings.iter();
    rings.map(|ring| titled_polygon(ring, title)).collect()
}

fn titled_polygon(ring: &[Point2<f64>], title: &str) -> String {
    let points = ring.iter().map(|p| format!("{:.1},{:.1}", p.x, p.y));
    let points = points.collect::<Vec<_>>().join(" ");
    format!(
        "<polygon points=\"{points}\" fill=\"none\" pointer-events=\"all\" stroke=\"{UNLABELLED}\" stroke-width=\"1.5\">\
         <title>{title}</title></polygon>"
    )
}
