//! What was drawn and what is visible, as histograms.

use super::labelled_pictures::LabelledSet;
use crate::dataset::{SampleSummary, Summary};
use crate::label::gallery;
use crate::plot::heat::heat_map;
use crate::plot::{Histogram, Page, Table};
use crate::scene::Distribution;
use std::collections::BTreeMap;
use std::path::Path;

/// Bins of a histogram of numbers.
const HISTOGRAM_BINS: usize = 20;
/// Maximum number of bars of a histogram of integers.
const MAX_BARS: f64 = 100.0;
/// Maximum number of bins of a histogram of counts.
const MAX_COUNT_BINS: usize = 60;
/// Maximum number of classes that have a map of their own.
const MAX_CLASS_MAPS: usize = 12;

/// Adds every drawn value against its distribution.
pub(super) fn add_drawn(page: &mut Page, summary: &Summary) {
    let values = match summary.is_on_belt() {
        true => "values in the dataset, one for each of its sequences",
        false => "values in the dataset",
    };
    page.heading("What was drawn").text(&format!(
        "Bars: {values}. Dashed line: the recipe's distribution; about one bar in twenty lies outside the \
         band around it by chance. Values that do not vary, and events that happen by chance, are in the tables below.",
    ));
    let DrawnValues {
        mut charts,
        fixed,
        chances,
    } = drawn_values(summary);
    let chosen = summary.chosen.iter();
    charts.extend(chosen.map(|(what, counts)| choice_histogram(what, counts)));
    add_histograms(page, &charts);
    for table in [fixed, chances] {
        if !table.rows.is_empty() {
            page.table(&table);
        }
    }
}

/// The draws, by how they are shown.
struct DrawnValues {
    /// Values that vary.
    charts: Vec<Histogram>,
    /// Values that do not.
    fixed: Table,
    /// Events that happen by chance.
    chances: Table,
}

fn drawn_values(summary: &Summary) -> DrawnValues {
    let mut drawn = DrawnValues {
        charts: Vec::new(),
        fixed: Table::new(["fixed", "value"]),
        chances: Table::new(["by chance", "share in the recipe", "share in the dataset"]),
    };
    for (key, values) in &summary.drawn {
        if let Some(share) = summary.chance(key) {
            let shares = [share.to_string(), share_below(values, share)];
            drawn.chances.push([key.clone()].into_iter().chain(shares));
            continue;
        }
        // Recipes omit keys that have their default.
        let from = summary.distribution(key).filter(|from| !from.is_fixed());
        match from {
            None if are_equal(values) => drawn.fixed.push([key.clone(), values[0].to_string()]),
            from => drawn.charts.push(drawn_histogram(key, values, from)),
        }
    }
    drawn
}

/// How many of the values are below a limit, in words: `0.25 (3 of 12)`.
fn share_below(values: &[f64], limit: f64) -> String {
    let below = values.iter().filter(|value| **value < limit).count();
    let all = values.len();
    format!("{:.2} ({below} of {all})", below as f64 / all as f64)
}

fn are_equal(values: &[f64]) -> bool {
    values.iter().all(|value| *value == values[0])
}

/// Values of one draw, against its distribution in the recipe.
fn drawn_histogram(key: &str, values: &[f64], from: Option<Distribution>) -> Histogram {
    match from {
        Some(Distribution::Whole(range)) => integer_histogram(key, values, range).uniform(),
        Some(Distribution::Weighted(range)) => integer_histogram(key, values, range),
        Some(Distribution::Uniform(range)) => {
            Histogram::new(key, values, range, HISTOGRAM_BINS).uniform()
        }
        _ => Histogram::new(key, values, extremes(values), HISTOGRAM_BINS),
    }
}

/// A bar for each integer.
fn integer_histogram(key: &str, values: &[f64], [low, high]: [f64; 2]) -> Histogram {
    let bars = integer_bars([low, high]);
    let histogram = Histogram::new(key, values, [low - 0.5, high + 0.5], bars);
    Histogram {
        ends: [low.to_string(), high.to_string()],
        ..histogram
    }
}

/// A bar for each integer, as long as the bars can be distinguished.
fn integer_bars([low, high]: [f64; 2]) -> usize {
    let numbers = high - low + 1.0;
    if numbers <= MAX_BARS {
        numbers as usize
    } else {
        HISTOGRAM_BINS
    }
}

fn choice_histogram(what: &str, counts: &BTreeMap<String, u64>) -> Histogram {
    let ends = [counts.keys().next(), counts.keys().next_back()];
    let histogram = Histogram {
        title: format!("{what} ({} of them)", counts.len()),
        ends: ends.map(|name| name.cloned().unwrap_or_default()),
        counts: counts.values().copied().collect(),
        expected: None,
    };
    match what {
        "photo of the asset" => histogram,
        _ => histogram.uniform(),
    }
}

pub(super) fn extremes<'a>(values: impl IntoIterator<Item = &'a f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let ends = values
        .into_iter()
        .fold(none, |[low, high], value| [value.min(low), value.max(high)]);
    // A range of a single value is widened so that it has bins.
    match ends {
        [low, high] if low < high => [low, high],
        [low, _] => [low - 0.5, low + 0.5],
    }
}

/// Adds what is visible, and how large it is.
pub(super) fn add_seen(page: &mut Page, summary: &Summary) {
    page.heading("What is seen");
    add_histograms(
        page,
        &[
            count_histogram("objects in a picture", &summary.glances, |s| s.objects),
            count_histogram("labels in a picture", &summary.glances, |s| s.labels.len()),
            visible_histogram("seen share of an object", &summary.visible),
            side_histogram("width of labelled boxes, pixels", &summary.boxes, 0),
            side_histogram("height of labelled boxes, pixels", &summary.boxes, 1),
        ],
    );
    add_heat_maps(page, summary);
}

fn count_histogram(
    title: &str,
    samples: &[SampleSummary],
    count: fn(&SampleSummary) -> usize,
) -> Histogram {
    let counts: Vec<f64> = samples.iter().map(|sample| count(sample) as f64).collect();
    let most = counts.iter().copied().fold(1.0, f64::max);
    let bins = (most as usize + 1).min(MAX_COUNT_BINS);
    let mut histogram = Histogram::new(title, &counts, [-0.5, most + 0.5], bins);
    histogram.ends = ["0".into(), most.to_string()];
    histogram
}

/// Visible shares of objects.
pub(super) fn visible_histogram(title: &str, shares: &[f64]) -> Histogram {
    Histogram::new(title, shares, [0.0, 1.0], HISTOGRAM_BINS)
}

fn side_histogram(title: &str, boxes: &[[f64; 2]], side: usize) -> Histogram {
    let sides: Vec<f64> = boxes.iter().map(|sides| sides[side]).collect();
    let largest = boxes.iter().flatten().copied().fold(1.0, f64::max);
    Histogram::new(title, &sides, [0.0, largest], HISTOGRAM_BINS)
}

/// Adds where the labels are: all of them, and those of each class unless there are too many
/// classes.
fn add_heat_maps(page: &mut Page, summary: &Summary) {
    let set = LabelledSet::from_summary(Path::new(""), summary);
    let mut maps = heat_map("centres of all labels", &set.centres());
    if summary.classes.len() > 1 {
        maps += &class_maps(&summary.classes, &set);
    }
    page.html(&format!("<div class=\"histograms\">\n{maps}</div>\n"));
}

fn class_maps(classes: &[String], set: &LabelledSet) -> String {
    let classes = (0..).zip(classes).take(MAX_CLASS_MAPS);
    let maps = classes.map(|(class, name)| {
        let title = format!("centres of {}", gallery::clipped(name, 30));
        heat_map(&title, &set.centres_of(class))
    });
    maps.collect()
}

/// Adds charts side by side.
pub(super) fn add_histograms(page: &mut Page, charts: &[Histogram]) {
    let all: String = charts.iter().map(Histogram::svg).collect();
    page.html(&format!("<div class=\"histograms\">\n{all}</div>\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chance_came_true_where_the_draw_is_below_it() {
        assert_eq!(share_below(&[0.1, 0.3, 0.9, 0.29], 0.3), "0.50 (2 of 4)");
    }

    #[test]
    fn whole_numbers_have_bars_of_their_own_until_there_are_too_many() {
        assert_eq!(integer_bars([4.0, 12.0]), 9);
        assert_eq!(integer_bars([0.0, 99.0]), 100);
        assert_eq!(integer_bars([0.0, 100.0]), HISTOGRAM_BINS);
        assert_eq!(integer_bars([0.0, 9007199254740991.0]), HISTOGRAM_BINS);
        assert_eq!(integer_bars([0.0, f64::INFINITY]), HISTOGRAM_BINS);
    }
}
