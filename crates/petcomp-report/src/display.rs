//! Bottles over new backgrounds: the results of each way of photographing them, compared with
//! reality.
//!
//! Reality is a rendering of the same bottle in the same room on a display that shows the
//! background, so that it is independent of our own model. The captures are photos of the same
//! scene with a sensor's noise, as 8-bit JPEGs. Everything is compared as seen from straight above.

mod method;
mod place;
mod shots;
mod strip;
mod window;

use crate::columns::{Column, number_or_empty, table_of};
use crate::files::write_texts;
use method::{DisplayMethod, SeenFilm};
use petcomp::geom::Point2;
use petcomp::matte::LightPath;
use petcomp::plot::Table;
use petcomp::{Coverage, Error, Image, LinearRgb, Result, io};
use place::{BACKGROUNDS, Bottle, Place};
use rayon::prelude::*;
use shots::Stage;
use std::path::Path;
use window::{DisplayWindow, Surroundings};

/// A pixel is inside if the bottle covers more than this share of it.
const INSIDE: f32 = 0.5;
/// A displacement with a smaller error counts as right, pixels of the photo.
const GOOD_FLOW_PX: f64 = 2.0;
/// Contrast of the coarse stripes above which the true displacement is a single position.
const LEAST_CONTRAST: f64 = 0.3;

/// The result of a method for a bottle.
struct DisplayRow {
    bottle: String,
    method: DisplayMethod,
    /// Mean absolute errors over the backgrounds, linear light; none without a cut-out.
    errors: Option<[f64; BACKGROUNDS.len()]>,
    /// Errors of the displacement where the truth is known, pixels of the photo.
    flow_errors: Vec<f64>,
    /// Number of pixels inside; 0 if the true displacement is not known.
    inside: usize,
    /// Why there is no cut-out.
    refused: String,
}

/// Errors of a method over all bottles with photos for it.
struct DisplaySummary {
    method: DisplayMethod,
    bottles: usize,
    failed: usize,
    /// Mean absolute error over all backgrounds; NaN without a cut-out.
    error: f64,
    /// The same as a share of the paper's on the same bottles: over all backgrounds, the plain one,
    /// and the patterned ones.
    shares: [f64; 3],
    /// Share of the pixels inside with a displacement; NaN if there is no true displacement or the
    /// method does not measure any.
    known: f64,
    /// Share of those with the right displacement, and the median error; NaN without any.
    good_flow: f64,
    median_flow_px: f64,
}

/// Measures every method on every bottle of a folder of places.
fn measure(folder: &Path, progress: impl Fn(u64, u64)) -> Result<Vec<DisplayRow>> {
    let places = Place::all_in(folder)?;
    let total: usize = places.iter().map(|place| place.bottles.len()).sum();
    let mut rows = Vec::new();
    let mut done = 0;
    for place in &places {
        let stage = Stage::new(place)?;
        for bottle in &place.bottles {
            progress(done, total as u64);
            done += 1;
            rows.extend(rows_of(&stage, place, bottle)?);
        }
    }
    Ok(rows)
}

/// Every method on a bottle.
fn rows_of(stage: &Stage<'_>, place: &Place, bottle: &Bottle) -> Result<Vec<DisplayRow>> {
    let reality = Reality::new(place, bottle)?;
    let rows = DisplayMethod::ALL.into_par_iter();
    let rows = rows.filter(|method| method.is_possible(bottle));
    Ok(rows
        .map(|method| reality.row(method, method.run(stage, place, bottle)))
        .collect())
}

/// A bottle over its backgrounds, seen from straight above.
struct Reality {
    name: String,
    window: DisplayWindow,
    inside: Image<bool>,
    seen: Vec<Image<LinearRgb>>,
    /// The backgrounds without the bottle.
    empty: Vec<Surroundings>,
    /// True displacement; none where it is not a single position or unknown.
    flow: Option<Image<Option<[f64; 2]>>>,
}

impl Reality {
    fn new(place: &Place, bottle: &Bottle) -> Result<Self> {
        let window = DisplayWindow::of(place, bottle);
        let seen = BACKGROUNDS.map(|name| Ok(window.seen(place.reality(bottle, name)?)));
        let mask: Image<Coverage> = window.seen(place.mask(bottle)?);
        Ok(Self {
            name: place.name_of(bottle),
            inside: mask.map(|c| c.0 > INSIDE),
            seen: seen.into_iter().collect::<Result<_>>()?,
            empty: BACKGROUNDS
                .map(|name| Ok(window.with_margin(place.empty(name)?)))
                .into_iter()
                .collect::<Result<_>>()?,
            flow: if bottle.with_stripes {
                Some(true_flow(place, bottle, &window)?)
            } else {
                None
            },
            window,
        })
    }

    fn row(&self, method: DisplayMethod, found: Result<SeenFilm>) -> DisplayRow {
        let row = DisplayRow {
            bottle: self.name.clone(),
            method,
            errors: None,
            flow_errors: Vec::new(),
            inside: self.flow.as_ref().map_or(0, |_| self.inside.count()),
            refused: String::new(),
        };
        match found {
            Ok(found) => DisplayRow {
                errors: Some(std::array::from_fn(|k| self.error(&found, k))),
                flow_errors: self.flow_errors(&found),
                ..row
            },
            Err(error) => DisplayRow {
                refused: error.to_string(),
                ..row
            },
        }
    }

    /// The cut-out over background `k`.
    fn composite(&self, found: &SeenFilm, k: usize) -> Image<LinearRgb> {
        let (w, h) = self.window.size();
        Image::from_fn(w, h, |x, y| {
            let path = found.flow[(x, y)].unwrap_or_default();
            let behind = self.empty[k].seen(path, x, y);
            let seen = found.film[(x, y)].over_color(behind);
            seen.map(|v| v.clamp(0.0, 1.0))
        })
    }

    /// Mean absolute error inside, over background `k`.
    fn error(&self, found: &SeenFilm, k: usize) -> f64 {
        let made = self.composite(found, k);
        let pairs = made.pixels().iter().zip(self.seen[k].pixels());
        let inside = pairs
            .zip(self.inside.pixels())
            .filter(|(_, inside)| **inside);
        let sum: f64 = inside.map(|((a, b), _)| absolute_difference(*a, *b)).sum();
        sum / self.inside.count().max(1) as f64
    }

    fn flow_errors(&self, found: &SeenFilm) -> Vec<f64> {
        let Some(truth) = &self.flow else {
            return Vec::new();
        };
        let pairs = found.flow.pixels().iter().zip(truth.pixels());
        pairs
            .filter_map(|(found, truth)| Some((found.filter(is_mostly_sharp)?, (*truth)?)))
            .map(|(found, truth)| {
                let off = [0, 1].map(|axis| f64::from(found.displacement[axis]) - truth[axis]);
                off[0].hypot(off[1])
            })
            .collect()
    }
}

/// Whether most of the light comes from one position.
fn is_mostly_sharp(path: &LightPath) -> bool {
    path.haze < 0.5
}

/// The nearest true displacement at every pixel of a window.
fn true_flow(
    place: &Place,
    bottle: &Bottle,
    window: &DisplayWindow,
) -> Result<Image<Option<[f64; 2]>>> {
    let truth = place.true_flow(bottle)?;
    let (w, h) = window.size();
    Ok(Image::from_fn(w, h, |x, y| {
        let at = window.in_photo(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
        let (moved, contrast) = truth.nearest(at.x.floor() as isize, at.y.floor() as isize);
        (contrast > LEAST_CONTRAST).then_some(moved)
    }))
}

fn absolute_difference(a: LinearRgb, b: LinearRgb) -> f64 {
    let (a, b) = (a.channels(), b.channels());
    (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum::<f64>() / 3.0
}

impl DisplaySummary {
    fn new(rows: &[DisplayRow], method: DisplayMethod) -> Self {
        let own: Vec<&DisplayRow> = rows.iter().filter(|row| row.method == method).collect();
        let errors: Vec<f64> = own.iter().filter_map(|row| row.errors).flatten().collect();
        let flow = sorted_flow_errors(&own);
        let good = flow.iter().filter(|error| **error <= GOOD_FLOW_PX).count();
        Self {
            method,
            bottles: own.len(),
            failed: own.iter().filter(|row| row.errors.is_none()).count(),
            error: errors.iter().sum::<f64>() / errors.len() as f64,
            shares: shares_of_paper(&own, rows),
            known: flow.len() as f64 / measured_pixels(&own, method) as f64,
            good_flow: good as f64 / flow.len() as f64,
            median_flow_px: flow.get(flow.len() / 2).copied().unwrap_or(f64::NAN),
        }
    }
}

fn sorted_flow_errors(own: &[&DisplayRow]) -> Vec<f64> {
    let mut errors: Vec<f64> = own.iter().flat_map(|row| row.flow_errors.clone()).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Number of pixels inside whose displacement the method could have measured.
fn measured_pixels(own: &[&DisplayRow], method: DisplayMethod) -> usize {
    match method.measures_displacement() {
        true => own.iter().map(|row| row.inside).sum(),
        false => 0,
    }
}

/// Errors over all backgrounds, the plain one, and the patterned ones, as shares of the paper's on
/// the same bottles.
fn shares_of_paper(own: &[&DisplayRow], rows: &[DisplayRow]) -> [f64; 3] {
    let both = |row: &&DisplayRow| Some((row.errors?, paper_errors(rows, &row.bottle)?));
    let pairs: Vec<_> = own.iter().filter_map(both).collect();
    [0..5, 4..5, 0..4].map(|part| {
        let sum = |errors: &[f64]| errors[part.clone()].iter().sum::<f64>();
        let own: f64 = pairs.iter().map(|(own, _)| sum(own)).sum();
        own / pairs.iter().map(|(_, paper)| sum(paper)).sum::<f64>()
    })
}

fn paper_errors(rows: &[DisplayRow], bottle: &str) -> Option<[f64; BACKGROUNDS.len()]> {
    let of_paper = |row: &&DisplayRow| row.method == DisplayMethod::Paper && row.bottle == bottle;
    rows.iter().find(of_paper)?.errors
}

/// A share or a length; empty for NaN.
fn shown(value: f64, unit: &str) -> String {
    if value.is_nan() {
        return String::new();
    }
    format!("{value:.2}{unit}")
}

/// A mean error; empty for NaN.
fn shown_error(value: f64) -> String {
    number_or_empty((!value.is_nan()).then_some(value), 5)
}

/// The table method x error.
const SUMMARY_COLUMNS: [Column<DisplaySummary>; 10] = [
    ("method", |s| s.method.name().into()),
    ("bottles", |s| s.bottles.to_string()),
    ("no cut-out", |s| s.failed.to_string()),
    ("MAE", |s| shown_error(s.error)),
    ("of the paper's", |s| shown(s.shares[0], "")),
    ("over plain", |s| shown(s.shares[1], "")),
    ("over patterns", |s| shown(s.shares[2], "")),
    ("displacement known", |s| shown(s.known, "")),
    ("within 2 px", |s| shown(s.good_flow, "")),
    ("median", |s| shown(s.median_flow_px, " px")),
];

const DETAIL_COLUMNS: [Column<DisplayRow>; 8] = [
    ("bottle", |r| r.bottle.clone()),
    ("method", |r| r.method.name().into()),
    ("checker", |r| number_or_empty(r.errors.map(|e| e[0]), 6)),
    ("text", |r| number_or_empty(r.errors.map(|e| e[1]), 6)),
    ("noise", |r| number_or_empty(r.errors.map(|e| e[2]), 6)),
    ("bottle_photo", |r| {
        number_or_empty(r.errors.map(|e| e[3]), 6)
    }),
    ("plain", |r| number_or_empty(r.errors.map(|e| e[4]), 6)),
    ("refused", |r| r.refused.clone()),
];

/// Measures and writes `display.csv` and `display.md` into a folder.
///
/// # Errors
/// Files that cannot be read or written.
pub fn write(set: &Path, folder: &Path, progress: impl Fn(u64, u64)) -> Result<Table> {
    let rows = measure(set, progress)?;
    let summaries = DisplayMethod::ALL.map(|method| DisplaySummary::new(&rows, method));
    let table = table_of(&SUMMARY_COLUMNS, &summaries);
    let details = table_of(&DETAIL_COLUMNS, &rows).csv();
    let text = format!("# {TITLE}\n\n{}", table.markdown());
    write_texts(folder, [("display.csv", &details), ("display.md", &text)])?;
    Ok(table)
}

const TITLE: &str = "Error of captures over new backgrounds";

/// Writes a strip for each of some bottles: reality and every method over a background, with the
/// differences below.
///
/// # Errors
/// Bottles that are not in the set; files that cannot be read or written.
pub fn write_strips(set: &Path, folder: &Path, bottles: &[(&str, &str)]) -> Result<()> {
    io::create_folder(folder)?;
    for place in &Place::all_in(set)? {
        let stage = Stage::new(place)?;
        for bottle in &place.bottles {
            let name = place.name_of(bottle);
            let chosen = bottles.iter().find(|(wanted, _)| *wanted == name);
            if let Some((_, background)) = chosen {
                let k = BACKGROUNDS.iter().position(|b| b == background);
                let k = k.ok_or_else(|| unknown_background(background))?;
                let strip = strip::strip(&Reality::new(place, bottle)?, k, |method| {
                    method.run(&stage, place, bottle)
                });
                let file = format!("capture_{}.png", name.replace('/', "_"));
                io::write(folder.join(file), &strip)?;
            }
        }
    }
    Ok(())
}

fn unknown_background(name: &str) -> Error {
    Error::value(
        "background",
        format!("\"{name}\", expected one of {BACKGROUNDS:?}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(method: DisplayMethod, errors: Option<[f64; BACKGROUNDS.len()]>) -> DisplayRow {
        DisplayRow {
            bottle: "a".into(),
            method,
            errors,
            flow_errors: Vec::new(),
            inside: 0,
            refused: String::new(),
        }
    }

    #[test]
    fn a_method_does_not_fail_where_the_paper_s_does() {
        let (paper, stripes) = (DisplayMethod::Paper, DisplayMethod::Stripes);
        let rows = [
            row(paper, None),
            row(stripes, Some([0.1; BACKGROUNDS.len()])),
        ];
        let failed = [paper, stripes].map(|method| DisplaySummary::new(&rows, method).failed);
        assert_eq!(failed, [1, 0]);
    }

    #[test]
    fn errors_are_of_every_cut_out_and_shares_of_those_that_the_paper_has_too() {
        let (paper, stripes) = (DisplayMethod::Paper, DisplayMethod::Stripes);
        let of = |bottle: &str, method, error: Option<f64>| DisplayRow {
            bottle: bottle.into(),
            ..row(method, error.map(|e| [e; BACKGROUNDS.len()]))
        };
        let rows = [
            of("a", paper, Some(0.4)),
            of("a", stripes, Some(0.1)),
            of("b", paper, None),
            of("b", stripes, Some(0.3)),
        ];
        let cells = |rows: &[DisplayRow], method| {
            let summary = DisplaySummary::new(rows, method);
            table_of(&SUMMARY_COLUMNS, [&summary]).rows[0][3..5].to_vec()
        };
        assert_eq!(cells(&rows, stripes), ["0.20000", "0.25"]);
        assert_eq!(cells(&rows[2..], stripes), ["0.30000", ""]);
        assert_eq!(cells(&rows[2..], paper), ["", ""]);
    }

    #[test]
    fn a_share_of_0_is_told_and_what_was_not_measured_is_not() {
        let stripes = DisplayMethod::Stripes;
        let cells = |row: DisplayRow| {
            let method = row.method;
            let summary = DisplaySummary::new(&[row], method);
            table_of(&SUMMARY_COLUMNS, [&summary]).rows[0][7..].to_vec()
        };
        let wrong = DisplayRow {
            flow_errors: vec![GOOD_FLOW_PX + 1.0],
            inside: 4,
            ..row(stripes, None)
        };
        assert_eq!(cells(wrong), ["0.25", "0.00", "3.00 px"]);
        assert_eq!(cells(row(stripes, None)), ["", "", ""]);
        // The true displacement is known, and the paper's keyer measures none.
        let of_paper = DisplayRow {
            inside: 4,
            ..row(DisplayMethod::Paper, None)
        };
        assert_eq!(cells(of_paper), ["", "", ""]);
    }
}
