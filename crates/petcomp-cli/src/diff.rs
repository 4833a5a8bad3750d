//! `petcomp diff`: compares two pictures with the flags and exit codes of OpenImageIO's `idiff`.

use crate::global::GlobalArgs;
use crate::print;
use petcomp::color::linear_to_srgb;
use petcomp::diff::{
    Comparison, Likeness, RowSource, RowsFromFn, Thresholds, Verdict, absolute_difference, compare,
};
use petcomp::io::{Format, Picture};
use petcomp::{Image, LinearRgb, PremulRgba, StraightRgba, io};
use std::ffi::OsString;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Exit status: 0 match, 1 warning, 2 failure, 3 not comparable, 4 a picture cannot be read.
#[derive(clap::Args)]
pub(crate) struct DiffArgs {
    /// First picture
    a: PathBuf,
    /// Second picture
    b: PathBuf,
    /// A channel fails when it differs by more than this
    #[arg(long, default_value_t = 1e-6)]
    fail: f32,
    /// ... and by more than this part of the mean of both
    #[arg(long = "failrelative", default_value_t = 0.0)]
    fail_relative: f32,
    /// Percentage of pixels that may fail
    #[arg(long = "failpercent", default_value_t = 0.0)]
    fail_percent: f32,
    /// No channel may differ by more than this
    #[arg(long = "hardfail", default_value_t = f32::INFINITY)]
    hard_fail: f32,
    /// Number of pixels that may fail by any amount
    #[arg(long = "allowfailures", default_value_t = 0)]
    allow_failures: usize,
    /// As --fail, for a warning
    #[arg(long, default_value_t = 1e-6)]
    warn: f32,
    /// As --failrelative, for a warning
    #[arg(long = "warnrelative", default_value_t = 0.0)]
    warn_relative: f32,
    /// As --failpercent, for a warning
    #[arg(long = "warnpercent", default_value_t = 0.0)]
    warn_percent: f32,
    /// As --hardfail, for a warning
    #[arg(long = "hardwarn", default_value_t = f32::INFINITY)]
    hard_warn: f32,
    /// Write a picture of the absolute difference
    #[arg(short, long, value_name = "PICTURE")]
    output: Option<PathBuf>,
    /// Factor on the written difference
    #[arg(long, default_value_t = 1.0)]
    scale: f32,
    /// Write the difference only when there is one
    #[arg(long = "od")]
    only_different: bool,
}

/// `idiff` has long flags with a single dash; they become ours.
const SINGLE_DASH: [&str; 11] = [
    "-fail",
    "-failrelative",
    "-failpercent",
    "-hardfail",
    "-allowfailures",
    "-warn",
    "-warnrelative",
    "-warnpercent",
    "-hardwarn",
    "-scale",
    "-od",
];

/// The command line with `idiff`'s spelling turned into ours, for the `diff` subcommand only.
pub(crate) fn accept_idiff_spelling(words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let words: Vec<OsString> = words.collect();
    if is_diff(&words) {
        words.into_iter().map(with_two_dashes).collect()
    } else {
        words
    }
}

fn is_diff(words: &[OsString]) -> bool {
    let verb = words.iter().skip(1).find(|word| !is_flag(word));
    verb.is_some_and(|verb| verb == "diff")
}

fn is_flag(word: &OsString) -> bool {
    word.as_encoded_bytes().starts_with(b"-")
}

fn with_two_dashes(word: OsString) -> OsString {
    match SINGLE_DASH.into_iter().find(|flag| word == *flag) {
        Some(flag) => format!("-{flag}").into(),
        None => word,
    }
}

pub(crate) fn run(args: &DiffArgs, global: &GlobalArgs) -> anyhow::Result<u8> {
    let pair = match PicturePair::read(args) {
        Ok(pair) => pair,
        Err(error) => return Ok(exit_unreadable(&error)),
    };
    let report = pair.compare(&args.thresholds());
    if let Some(path) = args.difference_path(&report) {
        pair.write_difference(path, args.scale)?;
    }
    print_comparison(args, &report, global);
    pair.print_likeness(global);
    Ok(report.verdict.exit_code())
}

fn exit_unreadable(error: &impl Display) -> u8 {
    print::aside(format_args!("error: {error}"));
    Verdict::Unreadable.exit_code()
}

fn print_comparison(args: &DiffArgs, report: &Comparison, global: &GlobalArgs) {
    let (a, b) = (args.a.display(), args.b.display());
    global.print_status(format_args!("Comparing \"{a}\" and \"{b}\""));
    print::text(report);
}

/// The two pictures: the second is what the first should be.
struct PicturePair {
    a: Picture,
    b: Picture,
}

impl PicturePair {
    fn read(args: &DiffArgs) -> petcomp::Result<Self> {
        Ok(Self {
            a: Picture::read(&args.a)?,
            b: Picture::read(&args.b)?,
        })
    }

    /// Pictures without alpha have three channels, over which means are taken.
    fn compare(&self, thresholds: &Thresholds) -> Comparison {
        if self.a.has_alpha() || self.b.has_alpha() {
            let [a, b] = [&self.a, &self.b].map(|picture| pixel_rows(picture, |value| value));
            compare(&a, &b, thresholds)
        } else {
            let [a, b] = self.opaque_rows();
            compare(&a, &b, thresholds)
        }
    }

    fn opaque_rows(&self) -> [impl RowSource<LinearRgb>; 2] {
        [&self.a, &self.b].map(|picture| pixel_rows(picture, opaque))
    }

    fn write_difference(&self, path: &Path, scale: f32) -> petcomp::Result<()> {
        let [a, b] = self.opaque_rows();
        io::write(path, &absolute_difference(&a, &b, scale))
    }

    /// It takes long, so nothing is computed that is not shown.
    fn print_likeness(&self, global: &GlobalArgs) {
        if !global.is_quiet()
            && let Some(likeness) = self.likeness()
        {
            global.print_status(format_args!("Scene-linear {likeness}"));
        }
    }

    /// How alike the two are to the eye, over black.
    fn likeness(&self) -> Option<Likeness> {
        let [a, b] = [&self.a, &self.b].map(|picture| RowsFromFn {
            size: picture.size(),
            make: move |rows| picture.rows::<PremulRgba>(rows).map(PremulRgba::color),
        });
        Likeness::measure(&a, &b)
    }
}

fn opaque([r, g, b, _]: [f32; 4]) -> LinearRgb {
    LinearRgb::new(r, g, b)
}

/// The values of a picture's rows, made into pixels.
fn pixel_rows<P: Copy + Send>(
    picture: &Picture,
    pixel: impl Fn([f32; 4]) -> P + Sync,
) -> impl RowSource<P> {
    RowsFromFn {
        size: picture.size(),
        make: move |rows| stored_values(picture, rows).map(&pixel),
    }
}

/// The values as the file stores them, which is what `idiff` compares: codes of integer formats as
/// shares of full scale, floats as they are.
fn stored_values(picture: &Picture, rows: Range<usize>) -> Image<[f32; 4]> {
    if matches!(picture.format(), Format::Exr | Format::Hdr) {
        return picture
            .rows::<PremulRgba>(rows)
            .map(|p| [p.r, p.g, p.b, p.a]);
    }
    picture.rows::<StraightRgba>(rows).map(encoded)
}

fn encoded(pixel: StraightRgba) -> [f32; 4] {
    let [r, g, b] = [pixel.r, pixel.g, pixel.b].map(linear_to_srgb);
    [r, g, b, pixel.a]
}

impl DiffArgs {
    /// Where a picture of the difference goes, if it is wanted and there is one.
    fn difference_path(&self, report: &Comparison) -> Option<&Path> {
        let is_comparable = report.verdict != Verdict::Incomparable;
        let is_wanted = report.max_error > 0.0 || !self.only_different;
        self.output
            .as_deref()
            .filter(|_| is_comparable && is_wanted)
    }

    fn thresholds(&self) -> Thresholds {
        Thresholds {
            fail: self.fail,
            fail_relative: self.fail_relative,
            fail_percent: self.fail_percent,
            hard_fail: self.hard_fail,
            allow_failures: self.allow_failures,
            warn: self.warn,
            warn_relative: self.warn_relative,
            warn_percent: self.warn_percent,
            hard_warn: self.hard_warn,
        }
    }
}
