//! `petcomp diff`: compares two pictures with the flags and exit codes of OpenImageIO's `idiff`.

use crate::common::Common;
use crate::print;
use petcomp::color::linear_to_srgb;
use petcomp::diff::{Likeness, Thresholds, Verdict, absolute_difference, compare};
use petcomp::io::Format;
use petcomp::{Image, LinearRgb, PremulRgba, StraightRgba, io};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
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
    if args.iter().skip(1).find(|a| !a.as_encoded_bytes().starts_with(b"-")).is_some_and(|first| first == "diff") {
        for arg in &mut args {
            if let Some(known) = SINGLE_DASH.into_iter().find(|known| arg == known) {
                *arg = format!("-{known}").into();
            }
        }
    }
    args
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<ExitCode> {
    let pictures = stored_values(&args.a).and_then(|a| Ok((a, stored_values(&args.b)?)));
    let (a, b) = match pictures {
        Ok(pictures) => pictures,
        Err(error) => {
            print::aside(format_args!("error: {error}"));
            return Ok(ExitCode::from(Verdict::Unreadable.exit_code()));
        }
    };
    let report = match has_alpha(&args.a)? || has_alpha(&args.b)? {
        true => compare(&a, &b, &args.thresholds()),
        false => compare(&a.map(opaque), &b.map(opaque), &args.thresholds()),
    };
    let different = report.max_error > 0.0 && report.verdict != Verdict::Incomparable;
    if let Some(path) = args.output.as_ref().filter(|_| different || !args.only_different)
        && report.verdict != Verdict::Incomparable
    {
        let difference = absolute_difference(&a, &b, args.scale);
        io::write(path, &difference.map(opaque))?;
    }
    common.say(format_args!("Comparing \"{}\" and \"{}\"", args.a.display(), args.b.display()));
    print::text(&report);
    if let Some(likeness) = (!common.quiet()).then(|| likeness(&args.a, &args.b)).flatten() {
        common.say(format_args!("Scene-linear {likeness}"));
    }
    Ok(ExitCode::from(report.verdict.exit_code()))
}

/// What the two are to the eye, over black: the second is what the first should be.
fn likeness(a: &Path, b: &Path) -> Option<Likeness> {
    let [picture, reference] =
        [a, b].map(|path| io::read::<PremulRgba>(path).map(|image| image.map(PremulRgba::color)));
    Likeness::of(&picture.ok()?, &reference.ok()?)
}

/// Pictures without alpha have three channels, over which means are taken.
fn has_alpha(path: &Path) -> petcomp::Result<bool> {
    Ok(io::read_header(path)?.channels.iter().any(|name| name == "A"))
}

fn opaque([r, g, b, _]: [f32; 4]) -> LinearRgb {
    LinearRgb::new(r, g, b)
}

/// The values as the file stores them, which is what `idiff` compares: codes of integer formats as shares of full scale,
/// floats as they are.
fn stored_values(path: &Path) -> petcomp::Result<Image<[f32; 4]>> {
    if matches!(io::read_header(path)?.format, Format::Exr | Format::Hdr) {
        return Ok(io::read::<PremulRgba>(path)?.map(|p| [p.r, p.g, p.b, p.a]));
    }
    Ok(io::read::<StraightRgba>(path)?.map(|p| [linear_to_srgb(p.r), linear_to_srgb(p.g), linear_to_srgb(p.b), p.a]))
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
