//! Values on the command line that are more than one number or name, and options that depend on
//! each other.

use clap::builder::RangedU64ValueParser;
use petcomp::asset::ScreenSource;
use petcomp::matte::key::expected_of_screen;
use petcomp::{Error, LinearRgb};
use std::any::TypeId;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A number within a range: more would take days, or all of the memory.
pub(crate) fn count(range: RangeInclusive<u64>) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(range)
}

/// Fails if an option is given without the one that it belongs to.
pub(crate) fn check_companion(
    name: &str,
    is_given: bool,
    to: &str,
    is_there: bool,
) -> petcomp::Result<()> {
    match is_given && !is_there {
        true => Err(Error::value(name, format!("given without {to}"))),
        false => Ok(()),
    }
}

/// The same program, whose options accept numbers below 0 as values and report what they expect;
/// clap would treat such numbers as options.
pub(crate) fn with_negative_numbers(program: clap::Command) -> clap::Command {
    program
        .mut_args(with_negative_number)
        .mut_subcommands(with_negative_numbers)
}

fn with_negative_number(arg: clap::Arg) -> clap::Arg {
    let is_option = !arg.is_positional() && arg.get_action().takes_values();
    let is_list = is_option && takes_list(&arg);
    arg.allow_negative_numbers(is_option)
        .allow_hyphen_values(is_list)
}

/// Whether the value is a list of numbers, or may be one. Clap accepts anything that follows as its
/// value, even another option; the value's parser reports what was expected.
fn takes_list(arg: &clap::Arg) -> bool {
    let lists = [
        TypeId::of::<LinearRgb>(),
        TypeId::of::<ScreenSource>(),
        TypeId::of::<[usize; 2]>(),
        TypeId::of::<[u32; 2]>(),
        TypeId::of::<[f64; 2]>(),
        TypeId::of::<[[f64; 2]; 4]>(),
    ];
    let value = arg.get_value_parser().type_id();
    lists.into_iter().any(|list| value == list)
}

/// Four points from `X,Y X,Y X,Y X,Y`.
pub(crate) fn parse_corners(text: &str) -> Result<[[f64; 2]; 4], String> {
    let points: Option<Vec<_>> = split_points(text).map(parse_point).collect();
    let corners = points.and_then(|points| points.try_into().ok());
    corners.ok_or_else(|| bad_corners(text))
}

fn bad_corners(text: &str) -> String {
    format!("\"{text}\", expected four corners as in \"120,80 900,85 905,600 110,590\"")
}

fn split_points(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ';' || c.is_whitespace())
        .filter(|part| !part.is_empty())
}

fn parse_point(text: &str) -> Option<[f64; 2]> {
    let (x, y) = text.split_once(',')?;
    Some([parse_finite(x)?, parse_finite(y)?])
}

fn parse_finite(text: &str) -> Option<f64> {
    text.trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
}

/// Width and height in metres from `0.6x0.4` or `0.6,0.4`.
pub(crate) fn parse_metres(text: &str) -> Result<[f64; 2], String> {
    let (w, h) = split_size(text);
    match (parse_finite(w), parse_finite(h)) {
        (Some(w), Some(h)) if w > 0.0 && h > 0.0 => Ok([w, h]),
        _ => Err(format!(
            "\"{text}\", expected WIDTHxHEIGHT in metres as in 0.6x0.4"
        )),
    }
}

/// Width and height in pixels from `640x480` or `640,480`.
pub(crate) fn parse_pixel_size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = split_size(text);
    match (w.trim().parse(), h.trim().parse()) {
        (Ok(w), Ok(h)) if w > 0 && h > 0 => Ok([w, h]),
        _ => Err(format!("\"{text}\", expected WIDTHxHEIGHT as in 640x480")),
    }
}

fn split_size(text: &str) -> (&str, &str) {
    text.split_once(['x', 'X', ',']).unwrap_or_default()
}

/// The scene-linear colour of a screen from `R,G,B`.
pub(crate) fn parse_color(text: &str) -> Result<LinearRgb, String> {
    let channels = parse_numbers::<f32, 3>(text, "R,G,B as in 0.02,0.6,0.05")?;
    let color = LinearRgb::from(channels);
    expected_of_screen(color).map_or(Ok(color), |expected| Err(expected.into()))
}

/// A pixel from `X,Y`.
pub(crate) fn parse_pixel(text: &str) -> Result<[usize; 2], String> {
    parse_numbers(text, "X,Y, whole numbers of at least 0, as in 40,30")
}

/// Numbers separated by commas.
fn parse_numbers<T: FromStr, const N: usize>(text: &str, form: &str) -> Result<[T; N], String> {
    let numbers: Option<Vec<T>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| format!("\"{text}\", expected {form}"))
}
