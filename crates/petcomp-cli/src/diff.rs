//! `petcomp diff`: compares two pictures with the flags and exit codes of OpenImageIO's `idiff`.

use crate::common::Common;
use crate::print;
use petcomp::color::linear_to_srgb;
use petcomp::diff::{
    Likeness, RowSource, RowsFromFn, Thresholds, Verdict, absolute_difference, compare,
};
use petcomp::io::{Format, Picture};
use petcomp::{Image, LinearRgb, PremulRgba, StraightRgba, io};
use std::ffi::OsString;
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;

/// Exit status: 0 match, 1 warning, 2 failure, 3 not comparable, 4 a picture cannot be read.
#[derive(clap::Args)]
pub(crate) struct Args {
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
pub(crate) fn accept_idiff_spelling(args: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut args: Vec<OsString> = args.collect();
    if args
        .iter()
        .skip(1)
        .find(|a| !a.as_encoded_bytes().starts_with(b"-"))
        .is_some_and(|first| first == "diff")
    {
        for arg in &mut args {
            if let Some(known) = SINGLE_DASH.into_iter().find(|known| arg == known) {
                *arg = format!("-{known}").into();
            }
        }
    }
    args
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<ExitCode> {
    let pictures = Picture::read(&args.a).and_then(|a| Ok((a, Picture::read(&args.b)?)));
    let (a, b) = match pictures {
        Ok(pictures) => pictures,
        Err(error) => {
            print::aside(format_args!("error: {error}"));
            return Ok(ExitCode::from(Verdict::Unreadable.exit_code()));
        }
    };
    let thresholds = args.thresholds();
    // Pictures without alpha have three channels, over which means are taken.
    let report = match a.has_alpha() || b.has_alpha() {
        true => compare(&rows(&a, |v| v), &rows(&b, |v| v), &thresholds),
        false => compare(&rows(&a, opaque), &rows(&b, opaque), &thresholds),
    };
    let different = report.max_error > 0.0 && report.verdict != Verdict::Incomparable;
    if let Some(path) = args
        .output
        .as_ref()
        .filter(|_| different || !args.only_different)
        && report.verdict != Verdict::Incomparable
    {
        io::write(
            path,
            &absolute_difference(&rows(&a, opaque), &rows(&b, opaque), args.scale),
        )?;
    }
    common.say(format_args!(
        "Comparing \"{}\" and \"{}\"",
        args.a.display(),
        args.b.display()
    ));
    print::text(&report);
    if let Some(likeness) = (!common.quiet()).then(|| likeness(&a, &b)).flatten() {
        common.say(format_args!("Scene-linear {likeness}"));
    }
    Ok(ExitCode::from(report.verdict.exit_code()))
}

/// What the two are to the eye, over black: the second is what the first should be.
fn likeness(a: &Picture, b: &Picture) -> Option<Likeness> {
    let light = |picture: &Picture, rows| picture.rows::<PremulRgba>(rows).map(PremulRgba::color);
    let [a, b] = [a, b].map(|picture| RowsFromFn {
        size: picture.size(),
        make: move |rows| light(picture, rows),
    });
    Likeness::measure(&a, &b)
}

fn opaque([r, g, b, _]: [f32; 4]) -> LinearRgb {
    LinearRgb::new(r, g, b)
}

/// The values of a picture's rows, made into pixels.
fn rows<P: Copy + Send>(
    picture: &Picture,
    pixel: impl Fn([f32; 4]) -> P + Sync,
) -> impl RowSource<P> {
    RowsFromFn {
        size: picture.size(),
        make: move |rows| stored_values(picture, rows).map(&pixel),
    }
}

/// The values as the file stores them, which is what `idiff` compares: codes of integer formats as shares of full scale,
/// floats as they are.
fn stored_values(picture: &Picture, rows: Range<usize>) -> Image<[f32; 4]> {
    if matches!(picture.format(), Format::Exr | Format::Hdr) {
        return picture
            .rows::<PremulRgba>(rows)
            .map(|p| [p.r, p.g, p.b, p.a]);
    }
    let shown = |p: StraightRgba| {
        [
            linear_to_srgb(p.r),
            linear_to_srgb(p.g),
            linear_to_srgb(p.b),
            p.a,
        ]
    };
    picture.rows::<StraightRgba>(rows).map(shown)
}

impl Args {
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
