//! `petcomp diff`: compares two pictures with the flags of OpenImageIO's `idiff`.

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
    /// First image
    a: PathBuf,
    /// Second image
    b: PathBuf,
    /// Difference above which a channel fails
    #[arg(long, default_value_t = 1e-6, value_parser = parse_threshold)]
    fail: f32,
    /// ... if it also exceeds this fraction of the mean of both
    #[arg(long = "failrelative", default_value_t = 0.0, value_parser = parse_threshold)]
    fail_relative: f32,
    /// Percentage of pixels that may fail
    #[arg(long = "failpercent", default_value_t = 0.0, value_parser = parse_threshold)]
    fail_percent: f32,
    /// Difference that no channel may exceed
    #[arg(long = "hardfail", default_value_t = f32::INFINITY, value_parser = parse_threshold)]
    hard_fail: f32,
    /// Number of pixels that may fail by any amount
    #[arg(long = "allowfailures", default_value_t = 0)]
    allow_failures: usize,
    /// Like --fail, for a warning
    #[arg(long, default_value_t = 1e-6, value_parser = parse_threshold)]
    warn: f32,
    /// Like --failrelative, for a warning
    #[arg(long = "warnrelative", default_value_t = 0.0, value_parser = parse_threshold)]
    warn_relative: f32,
    /// Like --failpercent, for a warning
    #[arg(long = "warnpercent", default_value_t = 0.0, value_parser = parse_threshold)]
    warn_percent: f32,
    /// Like --hardfail, for a warning
    #[arg(long = "hardwarn", default_value_t = f32::INFINITY, value_parser = parse_threshold)]
    hard_warn: f32,
    /// Difference image to write: absolute difference of each colour or of alpha, whichever is
    /// larger
    #[arg(short, long, value_name = "PICTURE")]
    output: Option<PathBuf>,
    /// Factor on the written difference
    #[arg(long, default_value_t = 1.0, value_parser = parse_scale)]
    scale: f32,
    /// Write the difference only if there is one
    #[arg(long = "od")]
    only_different: bool,
}

/// Infinity is allowed: nothing is above it.
fn parse_threshold(text: &str) -> Result<f32, String> {
    let threshold = text.parse::<f32>().ok().filter(|v| *v >= 0.0);
    threshold.ok_or_else(|| "expected a number from 0".into())
}

fn parse_scale(text: &str) -> Result<f32, String> {
    let scale = text.parse::<f32>().ok();
    let scale = scale.filter(|v| v.is_finite() && *v > 0.0);
    scale.ok_or_else(|| "expected a finite number above 0".into())
}

/// `idiff` has long flags with a single dash, which are translated to ours.
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

/// The command line with `idiff`'s spelling translated to ours, for the `diff` subcommand only.
pub(crate) fn accept_idiff_spelling(words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let words: Vec<OsString> = words.collect();
    if is_diff(&words) {
        words.into_iter().map(with_two_dashes).collect()
    } else {
        words
    }
}

/// The verb comes before the first of these flags; options with values may precede the verb.
fn is_diff(words: &[OsString]) -> bool {
    let mut before = words.iter().skip(1).take_while(|word| !is_of_idiff(word));
    before.any(|word| word == "diff")
}

fn is_of_idiff(word: &OsString) -> bool {
    SINGLE_DASH.iter().any(|flag| word == flag)
}

fn with_two_dashes(word: OsString) -> OsString {
    match SINGLE_DASH.into_iter().find(|flag| word == *flag) {
        Some(flag) => format!("-{flag}").into(),
        None => word,
    }
}

pub(crate) fn run(args: &DiffArgs, global: &GlobalArgs) -> anyhow::Result<u8> {
    io::check_distinct([&args.a, &args.b], &args.output)?;
    let pair = match PicturePair::read(args) {
        Ok(pair) => pair,
        Err(error) => return Ok(exit_unreadable(&error)),
    };
    if !pair.has_same_channels() {
        print::line("FAILURE: the pictures differ in their channels");
        return Ok(Verdict::Incomparable.exit_code());
    }
    let report = pair.compare(&args.thresholds());
    if let Some(path) = args.difference_path(&report) {
        pair.write_difference(path, args.scale)?;
    }
    print_comparison(args, &report, global);
    pair.print_passed_over(args, global);
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

/// The two pictures: the second is the expected one.
struct PicturePair {
    a: Picture,
    b: Picture,
    /// What of each is not compared.
    passed_over: [PassedOver; 2],
}

impl PicturePair {
    fn read(args: &DiffArgs) -> petcomp::Result<Self> {
        let (a, b) = (Picture::read(&args.a)?, Picture::read(&args.b)?);
        let passed_over = [PassedOver::of(&a, &args.a)?, PassedOver::of(&b, &args.b)?];
        Ok(Self { a, b, passed_over })
    }

    /// Pictures with different channels besides their colours are not the same, whatever the
    /// colours.
    fn has_same_channels(&self) -> bool {
        let [a, b] = &self.passed_over;
        a.channels == b.channels
    }

    fn print_passed_over(&self, args: &DiffArgs, global: &GlobalArgs) {
        let [a, b] = &self.passed_over;
        if !a.channels.is_empty() {
            let (count, names) = (a.channels.len(), a.channels.join(", "));
            global.print_status(format_args!(
                "Only colours and alpha were compared, none of {count} other channels ({names})"
            ));
        }
        a.print_parts(&args.a, global);
        b.print_parts(&args.b, global);
    }

    /// Pictures without alpha have three channels, over which means are computed.
    fn compare(&self, thresholds: &Thresholds) -> Comparison {
        if self.a.has_alpha() || self.b.has_alpha() {
            let [a, b] = self.rows(|value| value);
            compare(&a, &b, thresholds)
        } else {
            let [a, b] = self.rows(opaque);
            compare(&a, &b, thresholds)
        }
    }

    /// Their stored values as pixels.
    fn rows<P: Copy + Send>(
        &self,
        pixel: impl Fn([f32; 4]) -> P + Copy + Sync,
    ) -> [impl RowSource<P>; 2] {
        [&self.a, &self.b].map(|picture| RowsFromFn {
            size: picture.size(),
            make: move |rows| stored_values(picture, rows).map(pixel),
        })
    }

    fn write_difference(&self, path: &Path, scale: f32) -> petcomp::Result<()> {
        let [a, b] = self.rows(|value| value);
        io::write(path, &absolute_difference(&a, &b, scale).map(with_alpha))
    }

    /// It takes long, so it is computed only if it is shown.
    fn print_likeness(&self, global: &GlobalArgs) {
        if !global.is_quiet()
            && let Some(likeness) = self.likeness()
        {
            global.print_status(format_args!("Scene-linear {likeness}"));
        }
    }

    /// How similar the two look, over black.
    fn likeness(&self) -> Option<Likeness> {
        let [a, b] = [&self.a, &self.b].map(|picture| RowsFromFn {
            size: picture.size(),
            make: move |rows| picture.rows::<PremulRgba>(rows).map(PremulRgba::color),
        });
        Likeness::measure(&a, &b)
    }
}

/// Channels that are compared, or that colours are computed from.
const COLOR_CHANNELS: [&str; 7] = ["R", "G", "B", "A", "Y", "RY", "BY"];

/// What a file has besides the colours that are compared.
#[derive(Default)]
struct PassedOver {
    /// The other channels of the compared part.
    channels: Vec<String>,
    /// The names of the parts if there are several, that of the compared part first.
    parts: Vec<String>,
}

impl PassedOver {
    /// Empty for a file that is not an EXR.
    fn of(picture: &Picture, path: &Path) -> petcomp::Result<Self> {
        if picture.format() != Format::Exr {
            return Ok(Self::default());
        }
        let io::Header {
            mut channels,
            parts,
            ..
        } = io::read_header(path)?;
        channels.retain(|name| {
            !COLOR_CHANNELS.contains(&name.as_str()) && !picture.channels().contains(name)
        });
        Ok(Self { channels, parts })
    }

    fn print_parts(&self, path: &Path, global: &GlobalArgs) {
        if let [compared, others @ ..] = self.parts.as_slice() {
            let (path, count) = (path.display(), self.parts.len());
            let others = others.join(", ");
            global.print_status(format_args!(
                "{path}: of {count} parts only \"{compared}\" was compared, not {others}"
            ));
        }
    }
}

fn opaque([r, g, b, _]: [f32; 4]) -> LinearRgb {
    LinearRgb::new(r, g, b)
}

/// A difference in alpha alone must be visible, too.
fn with_alpha([r, g, b, a]: [f32; 4]) -> LinearRgb {
    LinearRgb::new(r.max(a), g.max(a), b.max(a))
}

/// The values as stored in the file, which is what `idiff` compares: codes of integer formats as
/// shares of full scale, floats as they are.
fn stored_values(picture: &Picture, rows: Range<usize>) -> Image<[f32; 4]> {
    if picture.is_display_encoded() {
        return picture.rows_as_srgb::<StraightRgba>(rows).map(encoded);
    }
    picture
        .rows::<PremulRgba>(rows)
        .map(|p| [p.r, p.g, p.b, p.a])
}

fn encoded(pixel: StraightRgba) -> [f32; 4] {
    let [r, g, b] = [pixel.r, pixel.g, pixel.b].map(linear_to_srgb);
    [r, g, b, pixel.a]
}

impl DiffArgs {
    /// Path for a picture of the difference, if it is wanted and there is one.
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
