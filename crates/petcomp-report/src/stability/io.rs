//! Files that are hard to write or to read: values beyond a half float, the smallest ones,
//! unterminated documents, 16k pictures.

use super::staged::temporary_folder;
use super::{HardCase, Outcome, memory};
use petcomp::io::{self, Bits, ReadOptions, WriteOptions, exr};
use petcomp::{Coverage, Image, LinearRgb, Result};
use serde::de::DeserializeOwned;
use std::path::Path;

/// Largest half float.
const HALF_MAX: f32 = 65504.0;
/// Smallest half float above 0, a denormal.
const HALF_MIN: f32 = 1.0 / (1 << 24) as f32;
/// Formats that are written.
const FORMATS: [&str; 4] = ["exr", "png", "tif", "jpg"];

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases: Vec<HardCase> = half_floats().into();
    cases.extend(values_at_the_ends());
    cases.extend(large_and_endless());
    cases.extend(FORMATS.map(one_pixel));
    cases.extend(FORMATS.map(no_pixel));
    Ok(cases)
}

fn values_at_the_ends() -> [HardCase; 3] {
    [
        HardCase::new(
            "half-float channels above 65504",
            "1e5 and -1e5 in a separate channel, as in cut-outs",
            "65504 and -65504",
            write_half_channels,
        ),
        HardCase::new(
            "float samples at the ends of the range",
            "the smallest denormal, the smallest normal, 1e-4 next to 1e5, the largest, in EXR and TIFF",
            "bit-identical: 0 differ",
            || {
                let differ = count_changed_floats("a.exr")? + count_changed_floats("a.tif")?;
                Ok(Outcome::none(differ, "differ"))
            },
        ),
        HardCase::new(
            "NaN, infinities and negative light in a PNG",
            "NaN, -inf, -1, 1e38, inf in 8 bits",
            "0, 0, 0, 1, 1",
            write_clamped_codes,
        ),
    ]
}

fn large_and_endless() -> [HardCase; 3] {
    [
        HardCase::new(
            "16k image",
            "a matte of 16384 x 16384 pixels to an 8-bit PNG and back",
            format!(
                "rejected by Limits::pixels (128 Mi) until that is raised, then identical; at most {SIXTEEN_K_GIB} GiB"
            ),
            write_sixteen_k,
        )
        .for_the_report(),
        HardCase::new(
            "document of 100 000 brackets",
            "[[[[...",
            "rejected, without a stack overflow",
            || {
                let brackets = "[".repeat(100_000);
                read_document::<serde_json::Value>(&brackets, "nested deeper")
            },
        ),
        HardCase::new(
            "document with the number 1e999",
            "[1e999]",
            "rejected, not read as infinity",
            || read_document::<Vec<f64>>("[1e999]", "number out of range"),
        ),
    ]
}

fn half_floats() -> [HardCase; 3] {
    [
        half_float(
            "half float: 65504",
            &[HALF_MAX, -HALF_MAX],
            &[HALF_MAX, -HALF_MAX],
        ),
        half_float(
            "half float: above 65504",
            &[65520.0, 1e5, 1e38, -1e5],
            &[HALF_MAX, HALF_MAX, HALF_MAX, -HALF_MAX],
        ),
        half_float(
            "half float: denormals",
            &[HALF_MIN, 3.0 * HALF_MIN, HALF_MIN / 4.0],
            &[HALF_MIN, 3.0 * HALF_MIN, 0.0],
        ),
    ]
}

/// Values written to a file and read back, as the green of a row of pixels.
fn through_file(name: &str, values: &[f32], options: &WriteOptions) -> Result<Vec<f32>> {
    let folder = temporary_folder()?;
    let path = folder.path().join(name);
    let row = Image::from_fn(values.len(), 1, |x, _| LinearRgb::new(0.0, values[x], 0.0));
    io::write_with(&path, &row, options)?;
    let picture = io::read::<LinearRgb>(&path)?;
    Ok(picture.pixels().iter().map(|p| p.g).collect())
}

fn listed(values: &[f32]) -> String {
    let shown: Vec<_> = values.iter().map(|v| format!("{v:e}")).collect();
    shown.join(", ")
}

fn half_float(name: &str, values: &'static [f32], expected: &'static [f32]) -> HardCase {
    let input = format!("{} to a half-float EXR and back", listed(values));
    let expectation = format!("{}: clamped, never infinite", listed(expected));
    HardCase::new(name, input, expectation, move || {
        write_half_floats(values, expected)
    })
}

fn write_half_floats(values: &[f32], expected: &[f32]) -> Result<Outcome> {
    let found = through_file("a.exr", values, &WriteOptions::default())?;
    Ok(Outcome::new(listed(&found), found == expected))
}

fn write_half_channels() -> Result<Outcome> {
    let folder = temporary_folder()?;
    let path = folder.path().join("a.exr");
    exr::write_half_channels(&path, (2, 1), &[("TR", [1e5_f32, -1e5])])?;
    let (_, channels) = exr::read_channels(&path)?;
    let found: Vec<f32> = channels.into_iter().flat_map(|c| c.samples).collect();
    Ok(Outcome::new(listed(&found), found == [HALF_MAX, -HALF_MAX]))
}

fn count_changed_floats(name: &str) -> Result<usize> {
    let options = WriteOptions {
        bits: Some(Bits::Float),
        ..WriteOptions::default()
    };
    let found = through_file(name, &EXTREME_FLOATS, &options)?;
    let pairs = found.iter().zip(&EXTREME_FLOATS);
    Ok(pairs.filter(|(a, b)| a.to_bits() != b.to_bits()).count())
}

const EXTREME_FLOATS: [f32; 7] = [
    f32::from_bits(1),
    f32::MIN_POSITIVE,
    1e-4,
    1e5,
    f32::MAX,
    -f32::MAX,
    -0.0,
];

fn write_clamped_codes() -> Result<Outcome> {
    let values = [f32::NAN, f32::NEG_INFINITY, -1.0, 1e38, f32::INFINITY];
    let found = through_file("a.png", &values, &WriteOptions::default())?;
    let passed = found == [0.0, 0.0, 0.0, 1.0, 1.0];
    Ok(Outcome::new(listed(&found), passed))
}

fn one_pixel(format: &'static str) -> HardCase {
    HardCase::new(
        format!("{format}: one-pixel image"),
        "1 x 1 pixel of green 1/2",
        "1 x 1 pixel read back, to 1 code of 255",
        move || write_one_pixel(format),
    )
}

fn write_one_pixel(format: &str) -> Result<Outcome> {
    let found = through_file(&format!("a.{format}"), &[0.5], &WriteOptions::default())?;
    let errors = found.iter().map(|v| f64::from(v - 0.5).abs());
    let off = errors.fold(0.0, f64::max);
    // A code is at most 1/255 of the curve, whose slope in linear light at 1/2 is below 1.7; JPEG's
    // YCbCr adds one.
    let passed = found.len() == 1 && off < 2.0 * 1.7 / 255.0;
    Ok(Outcome::new(
        format!("{} px, {off:.4} off", found.len()),
        passed,
    ))
}

fn no_pixel(format: &'static str) -> HardCase {
    HardCase::new(
        format!("{format}: no pixels"),
        "0 x 0 and 5 x 0 pixels",
        "rejected, and nothing is written",
        move || write_no_pixel(format),
    )
}

fn write_no_pixel(format: &str) -> Result<Outcome> {
    let folder = temporary_folder()?;
    let path = folder.path().join(format!("a.{format}"));
    let refused =
        [(0, 0), (5, 0)].map(|(w, h)| io::write(&path, &Image::<LinearRgb>::new(w, h)).is_err());
    let is_written = path.exists();
    Ok(Outcome::new(
        format!("{refused:?}, file written: {is_written}"),
        refused == [true; 2] && !is_written,
    ))
}

/// The outcome's message lacks the path, which differs in every run.
fn read_document<T: DeserializeOwned>(text: &str, cause: &str) -> Result<Outcome> {
    let folder = temporary_folder()?;
    let path = folder.path().join("a.json");
    io::write_text(&path, text)?;
    let outcome = Outcome::refused(io::read_json::<T>(&path), cause);
    let prefix = format!("{}: ", path.display());
    Ok(Outcome {
        measured: outcome.measured.replace(&prefix, ""),
        ..outcome
    })
}

/// Pixels along a side of the largest picture.
const SIXTEEN_K_PX: usize = 16_384;
/// Memory for writing and reading the picture once as floats, its codes and the file, with some
/// margin.
const SIXTEEN_K_GIB: f64 = 4.0;

fn write_sixteen_k() -> Result<Outcome> {
    if let Some(shortage) = memory::shortage(SIXTEEN_K_GIB) {
        return Ok(shortage);
    }
    let folder = temporary_folder()?;
    let path = folder.path().join("a.png");
    let (sound, peak) = memory::peak_gib(|| sixteen_k_through_file(&path));
    let ([refused, same], peak_gib) = (sound?, peak.unwrap_or(0.0));
    Ok(Outcome::new(
        format!("rejected at first: {refused}, then identical: {same}; {peak_gib:.1} GiB"),
        refused && same && peak_gib < SIXTEEN_K_GIB,
    ))
}

/// Whether the default limit rejects the picture, and whether it can be read with a larger limit.
fn sixteen_k_through_file(path: &Path) -> Result<[bool; 2]> {
    io::write(
        path,
        &Image::from_fn(SIXTEEN_K_PX, SIXTEEN_K_PX, xor_pattern),
    )?;
    let error = io::read::<Coverage>(path).err();
    let refused = error.is_some_and(|e| e.to_string().contains("Limits::pixels"));
    let mut options = ReadOptions::default();
    options.limits.pixels = 512 << 20;
    let back = io::read_with::<Coverage>(path, &options)?;
    Ok([refused, is_xor_pattern(&back)])
}

fn xor_pattern(x: usize, y: usize) -> Coverage {
    Coverage(((x ^ y) & 0xff) as f32 / 255.0)
}

/// Every 61st row is compared.
fn is_xor_pattern(matte: &Image<Coverage>) -> bool {
    let mut rows = (0..SIXTEEN_K_PX).step_by(61);
    rows.all(|y| (0..SIXTEEN_K_PX).all(|x| matte[(x, y)] == xor_pattern(x, y)))
}
