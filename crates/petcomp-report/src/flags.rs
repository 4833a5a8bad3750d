//! Flags: whether wrong cut-outs are flagged for review and right ones are not, on photos degraded
//! in many ways.
//!
//! A person reviews only the flagged photos, so two shares matter: *silently wrong* photos spoil a
//! dataset, *false alarms* cost a review each. The photos are rendered, with known outlines; each
//! variant degrades them in one way that keeps the outline known.

mod variant;

use super::columns::{Column, number_or_empty, table_of};
use super::files::write_texts;
use super::matte::score::{box_error, overlap};
use super::matte::truth::{Known, Truths};
use super::matte::{GOOD_BOX_PX, GOOD_IOU};
use petcomp::matte::{CutOut, CutOutOptions, cut_out};
use petcomp::plot::Table;
use petcomp::{Coverage, Image, LinearRgb, Result};
use rayon::prelude::*;
use std::path::Path;
use variant::{Expected, VARIANTS};

/// A photo with a known outline, and the expected result.
#[derive(Clone)]
struct Trial {
    photo: Image<LinearRgb>,
    mask: Image<Coverage>,
    /// Left, top, right and bottom of the outline, pixels.
    box_px: [f64; 4],
    expected: Expected,
}

/// The result for a photo.
struct FlagRow {
    photo: String,
    variant: &'static str,
    judged: Judgement,
}

/// Quality of the cut-out of a photo.
struct Judgement {
    /// Overlap (intersection over union) of the tight outline, and largest error of a side of the
    /// hull's box in pixels; none if the photo was refused.
    errors: Option<[f64; 2]>,
    end: End,
    /// Why the cut-out needs review, or why there is none.
    reasons: Vec<String>,
}

/// Outcome of a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// As expected, and not flagged.
    Right,
    /// Right, but flagged for review: a false alarm.
    RightAndFlagged,
    /// Wrong, or undecidable, and flagged.
    WrongAndFlagged,
    /// No cut-out, although there was one object.
    Refused,
    /// Wrong, and not flagged.
    SilentlyWrong,
}

impl End {
    /// All of them.
    const ALL: [Self; 5] = [
        Self::Right,
        Self::RightAndFlagged,
        Self::WrongAndFlagged,
        Self::Refused,
        Self::SilentlyWrong,
    ];

    /// Its name in tables.
    fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::RightAndFlagged => "right, flagged",
            Self::WrongAndFlagged => "wrong, flagged",
            Self::Refused => "refused",
            Self::SilentlyWrong => "silently wrong",
        }
    }
}

/// Cuts out every photo of a folder with truth in every variant; `progress` is given the number of
/// finished photos and of all photos.
fn measure(folder: &Path, progress: impl Fn(u64, u64)) -> Result<Vec<FlagRow>> {
    let truths = Truths::in_folder(folder)?;
    let mut rows = Vec::new();
    for i in 0..truths.len() {
        progress(i as u64, truths.len() as u64);
        rows.extend(measure_photo(&truths.read(i)?, i as u64));
    }
    Ok(rows)
}

/// A row for each variant that applies to a photo.
fn measure_photo(known: &Known, seed: u64) -> Vec<FlagRow> {
    VARIANTS
        .par_iter()
        .filter_map(|variant| {
            Some(FlagRow {
                photo: known.name.clone(),
                variant: variant.name,
                judged: variant.trial(known, seed)?.run(),
            })
        })
        .collect()
}

impl Trial {
    /// Cuts the photo out and judges the result.
    fn run(&self) -> Judgement {
        match cut_out(&self.photo, &CutOutOptions::default()) {
            Ok(cut) => self.judge(&cut),
            Err(error) => Judgement {
                errors: None,
                end: self.end_of_refused(),
                reasons: vec![error.to_string()],
            },
        }
    }

    fn end_of_refused(&self) -> End {
        if self.expected == Expected::Refused {
            End::Right
        } else {
            End::Refused
        }
    }

    fn judge(&self, cut: &CutOut) -> Judgement {
        let (errors, reasons) = (self.errors(cut), outline_reasons(cut));
        let is_right = is_right(errors, cut.segmentation.reduction);
        Judgement {
            errors: Some(errors),
            end: self.expected.end(is_right, !reasons.is_empty()),
            reasons,
        }
    }

    fn errors(&self, cut: &CutOut) -> [f64; 2] {
        let found = &cut.segmentation;
        [
            overlap(&found.tight, &self.mask),
            box_error(&found.hull, self.box_px),
        ]
    }
}

impl Expected {
    /// The outcome of a photo with a cut-out.
    fn end(self, is_right: bool, is_flagged: bool) -> End {
        match (self, is_right, is_flagged) {
            (Self::Right, true, false) | (Self::Flagged, _, true) => End::Right,
            (Self::Right, true, true) => End::RightAndFlagged,
            (_, _, true) => End::WrongAndFlagged,
            (_, _, false) => End::SilentlyWrong,
        }
    }
}

/// Tolerances scale with the pixels of a reduced search.
pub(crate) fn is_right([iou, box_px]: [f64; 2], reduction: f64) -> bool {
    iou >= GOOD_IOU && box_px <= GOOD_BOX_PX * reduction.max(1.0)
}

/// Why an outline needs review, without reasons about its colours.
fn outline_reasons(cut: &CutOut) -> Vec<String> {
    let of_outline = cut
        .diagnostics
        .iter()
        .filter(|d| d.needs_review() && !d.code.is_about_color());
    of_outline.map(ToString::to_string).collect()
}

/// Outcomes of the photos of each variant, a row per variant.
fn table(rows: &[FlagRow]) -> Table {
    let ends = End::ALL.map(End::name);
    let mut table = Table::new(["photos", "made of"].into_iter().chain(ends));
    for variant in &VARIANTS {
        let counts = counts_of(rows, variant.name).map(|count| count.to_string());
        table.push([variant.name.to_owned()].into_iter().chain(counts));
    }
    table
}

/// Number of photos of a variant, and of those with each outcome.
fn counts_of(rows: &[FlagRow], variant: &str) -> impl Iterator<Item = usize> {
    let of_variant = rows.iter().filter(|row| row.variant == variant);
    let ends: Vec<End> = of_variant.map(|row| row.judged.end).collect();
    let each = End::ALL.map(|end| ends.iter().filter(|found| **found == end).count());
    [ends.len()].into_iter().chain(each)
}

/// Every photo in every variant.
const DETAIL_COLUMNS: [Column<FlagRow>; 6] = [
    ("photo", |r| r.photo.clone()),
    ("variant", |r| r.variant.into()),
    ("iou", |r| number_or_empty(r.judged.errors.map(|e| e[0]), 4)),
    ("box_px", |r| {
        number_or_empty(r.judged.errors.map(|e| e[1]), 4)
    }),
    ("end", |r| r.judged.end.name().into()),
    ("warnings", |r| r.judged.reasons.join("; ")),
];

/// Measures and writes `flags.csv` and `flags.md` into a folder.
///
/// # Errors
/// A folder without truth; files that cannot be read or written.
pub fn write(truth: &Path, folder: &Path, progress: impl Fn(u64, u64)) -> Result<Table> {
    let rows = measure(truth, progress)?;
    let table = table(&rows);
    let markdown = format!("# Right, or flagged\n\n{}", table.markdown());
    let data = table_of(&DETAIL_COLUMNS, &rows).csv();
    write_texts(folder, [("flags.csv", &data), ("flags.md", &markdown)])?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::super::matte::truth::{Known, PhotoNoise};
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    /// A red slab of 120 x 60 pixels with its corner at (90, 60), seen with a little noise.
    fn known() -> Known {
        let (w, h) = (300, 180);
        let on = |x: usize, y: usize| (90..210).contains(&x) && (60..120).contains(&y);
        let solid = |inside: LinearRgb, outside: LinearRgb| {
            Image::from_fn(w, h, |x, y| if on(x, y) { inside } else { outside })
        };
        let mut draw = super::super::matte::normal(5);
        let foreground = solid(LinearRgb::new(0.5, 0.05, 0.05), LinearRgb::BLACK);
        let transmittance = solid(LinearRgb::BLACK, LinearRgb::WHITE);
        let mut photo = foreground.zip_map(&transmittance, |f, t| f + t * GREEN);
        photo
            .pixels_mut()
            .iter_mut()
            .for_each(|p| *p = p.map(|v| v + 0.003 * draw() as f32));
        Known {
            name: "slab".into(),
            photo,
            foreground,
            view: transmittance.clone(),
            transmittance,
            screen: Image::filled(w, h, GREEN),
            mask: Image::from_fn(w, h, |x, y| Coverage(f32::from(u8::from(on(x, y))))),
            box_px: [90.0, 60.0, 210.0, 120.0],
            noise: PhotoNoise {
                shot: 0.0,
                read: 0.003,
            },
            paint: GREEN,
        }
    }

    fn trial(variant: &str) -> Trial {
        let variant = VARIANTS.iter().find(|v| v.name == variant).unwrap();
        variant.trial(&known(), 1).unwrap()
    }

    fn end(variant: &str) -> End {
        trial(variant).run().end
    }

    #[test]
    fn a_plain_slab_ends_right_on_any_screen() {
        for variant in [
            "as taken",
            "screen 15 % uneven",
            "screen 60 % uneven",
            "other screen colour",
            "grey screen",
        ] {
            assert_eq!(end(variant), End::Right, "{variant}");
        }
    }

    #[test]
    fn what_must_be_flagged_is_flagged() {
        for variant in [
            "over the border",
            "two objects",
            "empty screen",
            "empty, 60 % uneven",
        ] {
            assert_eq!(end(variant), End::Right, "{variant}");
        }
        assert!(matches!(
            end("out of focus"),
            End::RightAndFlagged | End::WrongAndFlagged
        ));
    }

    #[test]
    fn nothing_ends_silently_wrong() {
        // Known exception: the ringing of strong compression around a drawn slab is treated as its
        // edge, and not flagged.
        let others = VARIANTS.iter().filter(|v| v.name != "JPEG quality 60");
        for name in others.map(|variant| variant.name) {
            assert_ne!(end(name), End::SilentlyWrong, "{name}");
        }
    }

    #[test]
    fn a_wrong_outline_without_a_doubt_is_silently_wrong() {
        let mut trial = trial("as taken");
        trial.box_px[2] += 5.0;
        assert_eq!(trial.run().end, End::SilentlyWrong);
        let unexpected = Trial {
            expected: Expected::Refused,
            ..trial
        };
        assert_eq!(unexpected.run().end, End::SilentlyWrong);
    }

    #[test]
    fn rows_become_counts() {
        let row = |variant, end| FlagRow {
            photo: "a".into(),
            variant,
            judged: Judgement {
                errors: None,
                end,
                reasons: vec!["x; y".into()],
            },
        };
        let rows = [
            row("as taken", End::Right),
            row("as taken", End::SilentlyWrong),
        ];
        let table = table(&rows);
        assert_eq!(
            (table.rows.len(), &table.rows[0][1..]),
            (
                VARIANTS.len(),
                &["2", "1", "0", "0", "0", "1"].map(String::from)[..]
            )
        );
        let details = table_of(&DETAIL_COLUMNS, &rows);
        assert_eq!(details.rows.len(), 2);
        assert_eq!(details.columns[5], "warnings", "as in matte.csv");
    }
}
