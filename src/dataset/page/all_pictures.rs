//! A list of all pictures, which load from the dataset's folder when a heading is opened.

use super::color_of;
use crate::dataset::{SampleSummary, Summary};
use crate::geom::BBox;
use crate::io;
use crate::plot::Page;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Pictures per heading, and maximum in all: a page stays below a few MB.
const PICTURES_PER_HEADING: usize = 100;
const MAX_LISTED_PICTURES: usize = 5_000;

/// Adds every picture, a hundred under each heading, for a page in `page_folder`.
pub(super) fn add_all(page: &mut Page, folder: &Path, summary: &Summary, page_folder: &Path) {
    let root = io::relative(&absolute_path(folder), &absolute_path(page_folder));
    page.subheading("All pictures").text(
        "The pictures below are not stored in this page: opening a heading loads them from the dataset's folder. Each links to its file.",
    );
    let count = summary.glances.len().min(MAX_LISTED_PICTURES);
    for samples in summary.glances[..count].chunks(PICTURES_PER_HEADING) {
        page.html(&listed_together(samples, &root));
    }
    let more = summary.glances.len() - count;
    if more > 0 {
        let address = address(&root.join("images"));
        page.html(&format!(
            "<p>{more} more are in <a href=\"{address}\">images</a>.</p>\n"
        ));
    }
}

fn absolute_path(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

fn listed_together(samples: &[SampleSummary], root: &Path) -> String {
    let ends = [samples.first(), samples.last()];
    let [first, last] = ends.map(|sample| sample.map_or(0, |sample| sample.index));
    let items: String = samples.iter().map(|sample| listed(sample, root)).collect();
    format!(
        "<details><summary>{first:06} to {last:06}</summary><div class=\"all\">\n{items}</div></details>\n"
    )
}

fn listed(sample: &SampleSummary, root: &Path) -> String {
    let address = address(&root.join(&sample.files[0]));
    let boxes = boxes_by_class(sample);
    let [w, h] = sample.image;
    let (index, part, count) = (sample.index, sample.part.name(), sample.labels.len());
    format!(
        "<a href=\"{address}\"><img loading=\"lazy\" width=\"{w}\" height=\"{h}\" alt=\"\" src=\"{address}\">\
         <svg viewBox=\"0 0 {w} {h}\">{boxes}</svg>{index:06} {part}: {count} of {}</a>\n",
        sample.objects
    )
}

/// A box as a part of an SVG path, in whole pixels.
fn rectangle(b: &BBox) -> String {
    let [x, y, w, h] = [b.x0, b.y0, b.width(), b.height()].map(|v| v.round());
    format!("M{x} {y}h{w}v{h}h-{w}z")
}

/// The boxes of each class as one path.
fn boxes_by_class(sample: &SampleSummary) -> String {
    let mut paths: BTreeMap<u32, String> = BTreeMap::new();
    for (class, b) in &sample.labels {
        *paths.entry(*class).or_default() += &rectangle(b);
    }
    let paths = paths.iter();
    paths
        .map(|(class, path)| colored_path(*class, path))
        .collect()
}

fn colored_path(class: u32, path: &str) -> String {
    let color = color_of(class);
    format!(
        "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" vector-effect=\"non-scaling-stroke\"/>"
    )
}

/// A relative path as a URL, with every byte that is special in URLs percent-encoded.
fn address(path: &Path) -> String {
    let text: String = path
        .to_string_lossy()
        .bytes()
        .map(percent_encoded)
        .collect();
    // Otherwise what precedes a colon would be read as a scheme.
    if text.starts_with('/') || text.starts_with("./") {
        text
    } else {
        format!("./{text}")
    }
}

fn percent_encoded(byte: u8) -> String {
    if byte.is_ascii_alphanumeric() || b"/.-_".contains(&byte) {
        char::from(byte).to_string()
    } else {
        format!("%{byte:02X}")
    }
}
