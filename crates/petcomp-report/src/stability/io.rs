//! Files that are hard to write or to read: values beyond a half float, the smallest ones, cut and lying headers, 16k.

use super::{HardCase, Outcome, memory};
use petcomp::Image;
use petcomp::io::{self, Bits, Limits, ReadOptions, WriteOptions, exr};
use petcomp::{Coverage, LinearRgb, PremulRgba};
use petcomp::{Error, Result};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Largest half float.
const HALF_MAX: f32 = 65504.0;
/// Smallest half float above 0, a denormal.
const HALF_MIN: f32 = 1.0 / (1 << 24) as f32;
/// Formats that are written.
const FORMATS: [&str; 4] = ["exr", "png", "tif", "jpg"];

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = vec![
        half(
            "half float: 65504",
            &[HALF_MAX, -HALF_MAX],
            &[HALF_MAX, -HALF_MAX],
        ),
        half(
            "half float: above 65504",
            &[65520.0, 1e5, 1e38, -1e5],
            &[HALF_MAX, HALF_MAX, HALF_MAX, -HALF_MAX],
        ),
        half(
            "half float: denormals",
            &[HALF_MIN, 3.0 * HALF_MIN, HALF_MIN / 4.0],
            &[HALF_MIN, 3.0 * HALF_MIN, 0.0],
        ),
        half_channels(),
        floats(),
        codes(),
        sixteen_k(),
        nested(),
        overlong_number(),
    ];
    cases.extend(FORMATS.map(one_pixel));
    cases.extend(FORMATS.map(empty));
    cases.extend(FORMATS.map(truncated));
    cases.extend([lying_png(), lying_exr(), lying_hdr(), nothing(), no_file()]);
    Ok(cases)
}

/// A folder that goes away with its case.
fn folder() -> Result<(TempDir, PathBuf)> {
    let folder = tempfile::tempdir().map_err(|e| Error::file(std::env::temp_dir(), e))?;
    let path = folder.path().into();
    Ok((folder, path))
}

/// Values on their way through a file, as the green of a row of pixels.
fn through(name: &str, values: &[f32], options: &WriteOptions) -> Result<Vec<f32>> {
    let (_folder, path) = folder()?;
    let path = path.join(name);
    io::write_with(&path, &row(values), options)?;
    Ok(io::read::<LinearRgb>(&path)?
        .pixels()
        .iter()
        .map(|p| p.g)
        .collect())
}

fn row(values: &[f32]) -> Image<LinearRgb> {
    Image::from_vec(
        values.len(),
        1,
        values
            .iter()
            .map(|&v| LinearRgb::new(0.0, v, 0.0))
            .collect(),
    )
}

fn shown(values: &[f32]) -> String {
    values
        .iter()
        .map(|v| format!("{v:e}"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn half(name: &str, values: &'static [f32], expected: &'static [f32]) -> HardCase {
    let input = format!("{} to a half-float EXR and back", shown(values));
    HardCase::new(
        name,
        input,
        format!("{}: clamped, never infinite", shown(expected)),
        move || {
            let found = through("a.exr", values, &WriteOptions::default())?;
            Ok(Outcome::new(shown(&found), found == expected))
        },
    )
}

fn half_channels() -> HardCase {
    HardCase::new(
        "half-float channels above 65504",
        "1e5 and -1e5 in a channel of its own, as cut-outs have",
        "65504 and -65504",
        || {
            let (_folder, path) = folder()?;
            let path = path.join("a.exr");
            exr::write_half_channels(&path, (2, 1), &[("TR", &[1e5, -1e5])], &[])?;
            let found: Vec<f32> = exr::read_channels(&path)?
                .1
                .into_iter()
                .flat_map(|c| c.samples)
                .collect();
            Ok(Outcome::new(shown(&found), found == [HALF_MAX, -HALF_MAX]))
        },
    )
}

fn floats() -> HardCase {
    HardCase::new(
        "float samples at the ends of their range",
        "the smallest denormal, the smallest normal, 1e-4 beside 1e5, the largest, in EXR and TIFF",
        "every bit comes back: 0 differ",
        || {
            let values = [
                f32::from_bits(1),
                f32::MIN_POSITIVE,
                1e-4,
                1e5,
                f32::MAX,
                -f32::MAX,
                -0.0,
            ];
            let options = WriteOptions {
                bits: Some(Bits::Float),
                ..WriteOptions::default()
            };
            let mut differ = 0;
            for name in ["a.exr", "a.tif"] {
                let found = through(name, &values, &options)?;
                differ += found
                    .iter()
                    .zip(&values)
                    .filter(|(a, b)| a.to_bits() != b.to_bits())
                    .count();
            }
            Ok(Outcome::near(differ as f64, 0.0, 0.0, "differ"))
        },
    )
}

fn codes() -> HardCase {
    HardCase::new(
        "NaN, infinities and negative light in a PNG",
        "NaN, -inf, -1, 1e38, inf in 8 bits",
        "0, 0, 0, 1, 1",
        || {
            let values = [f32::NAN, f32::NEG_INFINITY, -1.0, 1e38, f32::INFINITY];
            let found = through("a.png", &values, &WriteOptions::default())?;
            Ok(Outcome::new(
                shown(&found),
                found == [0.0, 0.0, 0.0, 1.0, 1.0],
            ))
        },
    )
}

fn one_pixel(format: &'static str) -> HardCase {
    HardCase::new(
        format!("{format}: one-pixel image"),
        "1 x 1 pixel of green 1/2",
        "1 x 1 pixel back, to 1 code of 255",
        move || {
            let found = through(&format!("a.{format}"), &[0.5], &WriteOptions::default())?;
            let off = found
                .iter()
                .map(|v| f64::from(v - 0.5).abs())
                .fold(0.0, f64::max);
            // A code is at most 1/255 of the curve, whose slope in linear light at 1/2 is below 1.7; JPEG's YCbCr adds one.
            Ok(Outcome::new(
                format!("{} px, {off:.4} off", found.len()),
                found.len() == 1 && off < 2.0 * 1.7 / 255.0,
            ))
        },
    )
}

fn empty(format: &'static str) -> HardCase {
    HardCase::new(
        format!("{format}: no pixel"),
        "0 x 0 and 5 x 0 pixels",
        "refused, and nothing is written",
        move || {
            let (_folder, path) = folder()?;
            let path = path.join(format!("a.{format}"));
            let refused = [(0, 0), (5, 0)]
                .map(|(w, h)| io::write(&path, &Image::<LinearRgb>::new(w, h)).is_err());
            Ok(Outcome::new(
                format!("{refused:?}, a file: {}", path.exists()),
                refused == [true; 2] && !path.exists(),
            ))
        },
    )
}

/// The bytes of a picture of 17 x 13 pixels.
fn bytes(path: &Path) -> Result<Vec<u8>> {
    let value = |x: usize, y: usize| {
        LinearRgb::new(
            x as f32 / 17.0,
            y as f32 / 13.0,
            ((x * 7 + y * 5) % 11) as f32 / 11.0,
        )
    };
    io::write(path, &Image::from_fn(17, 13, value))?;
    std::fs::read(path).map_err(|e| Error::file(path, e))
}

/// What reading bytes under a name says.
fn read_as(path: &Path, bytes: &[u8]) -> Result<Image<PremulRgba>> {
    std::fs::write(path, bytes).map_err(|e| Error::file(path, e))?;
    io::read(path)
}

fn truncated(format: &'static str) -> HardCase {
    HardCase::new(
        format!("{format}: truncated"),
        "17 x 13 pixels, cut at each of 20 places, the first at 0 bytes",
        "refused at every one: 0 read",
        move || {
            let (_folder, path) = folder()?;
            let path = path.join(format!("a.{format}"));
            let whole = bytes(&path)?;
            let read = (0..20)
                .filter(|i| read_as(&path, &whole[..i * whole.len() / 20]).is_ok())
                .count();
            Ok(Outcome::near(read as f64, 0.0, 0.0, "read"))
        },
    )
}

/// A file whose header asks for more than there may be: refused by the name of the limit, before memory is taken.
fn lying(
    name: &str,
    input: &str,
    limit: &'static str,
    make: impl Fn(&Path) -> Result<PathBuf> + Send + Sync + 'static,
) -> HardCase {
    /// A header, a message and what the decoders keep.
    const FEW_GIB: f64 = 0.064;
    let promise = format!("refused by Limits::{limit}, within 64 MiB");
    HardCase::new(name, input, promise, move || {
        let (_folder, path) = folder()?;
        let path = make(&path)?;
        let (_, before) = memory::peak_gib(|| ());
        let (read, peak) = memory::peak_gib(|| io::read::<PremulRgba>(&path));
        let grown = peak.zip(before).map_or(0.0, |(peak, before)| peak - before);
        let outcome = Outcome::refused(read, &format!("Limits::{limit}"));
        let measured = strip(&outcome.measured, &path);
        Ok(Outcome::new(
            format!("{measured}; {:.0} MiB", grown * 1024.0),
            outcome.passed && grown < FEW_GIB,
        ))
    })
}

/// A message without the folder that is another one in every run.
fn strip(message: &str, path: &Path) -> String {
    message.replace(&format!("{}: ", path.display()), "")
}

fn lying_png() -> HardCase {
    lying(
        "png: header of 32767 x 32767 pixels",
        "a PNG of 17 x 13 that says so",
        "pixels",
        |folder| {
            let path = folder.join("a.png");
            let mut png = bytes(&path)?;
            png[16..24].copy_from_slice(&[0, 0, 0x7f, 0xff, 0, 0, 0x7f, 0xff]);
            let sum = crc32fast::hash(&png[12..29]);
            png[29..33].copy_from_slice(&sum.to_be_bytes());
            save(path, &png)
        },
    )
}

fn lying_exr() -> HardCase {
    lying(
        "exr: window of 200 000 pixels a side",
        "an EXR of 17 x 13 that says so",
        "side",
        |folder| {
            let path = folder.join("a.exr");
            let mut exr = bytes(&path)?;
            for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
                let Some(at) = exr
                    .windows(window.len())
                    .position(|w| w == window.as_bytes())
                else {
                    continue;
                };
                // Behind the name and the attribute's size stand x0, y0, x1, y1.
                let corner = at + window.len() + 4 + 8;
                exr[corner..corner + 8].copy_from_slice(&[0x3f, 0x0d, 3, 0, 0x3f, 0x0d, 3, 0]);
            }
            save(path, &exr)
        },
    )
}

fn lying_hdr() -> HardCase {
    lying(
        "hdr: 99999 pixels a side",
        "a header and nothing behind it",
        "side",
        |folder| {
            save(
                folder.join("a.hdr"),
                b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n",
            )
        },
    )
}

fn save(path: PathBuf, bytes: &[u8]) -> Result<PathBuf> {
    std::fs::write(&path, bytes).map_err(|e| Error::file(&path, e))?;
    Ok(path)
}

fn nothing() -> HardCase {
    HardCase::new(
        "file of 0 bytes",
        "called .png, .exr, .tif, .jpg",
        "refused: 0 read",
        || {
            let (_folder, path) = folder()?;
            let read = FORMATS
                .iter()
                .filter(|f| read_as(&path.join(format!("a.{f}")), &[]).is_ok())
                .count();
            Ok(Outcome::near(read as f64, 0.0, 0.0, "read"))
        },
    )
}

fn no_file() -> HardCase {
    HardCase::new(
        "no file",
        "a name that is none",
        "an error that names the file",
        || {
            let (_folder, path) = folder()?;
            let outcome =
                Outcome::refused(io::read::<PremulRgba>(path.join("none.png")), "none.png");
            let measured = outcome
                .measured
                .replace(&format!("{}/", path.display()), "");
            Ok(Outcome {
                measured,
                ..outcome
            })
        },
    )
}

fn nested() -> HardCase {
    HardCase::new(
        "document of 100 000 brackets",
        "[[[[...",
        "refused, not a stack overflow",
        || {
            let (_folder, path) = folder()?;
            let path = save(path.join("a.json"), "[".repeat(100_000).as_bytes())?;
            let outcome =
                Outcome::refused(io::read_json::<serde_json::Value>(&path), "nested deeper");
            Ok(Outcome {
                measured: strip(&outcome.measured, &path),
                ..outcome
            })
        },
    )
}

fn overlong_number() -> HardCase {
    HardCase::new(
        "document with the number 1e999",
        "[1e999]",
        "refused, not infinity",
        || {
            let (_folder, path) = folder()?;
            let path = save(path.join("a.json"), b"[1e999]")?;
            let outcome = Outcome::refused(io::read_json::<Vec<f64>>(&path), "number out of range");
            Ok(Outcome {
                measured: strip(&outcome.measured, &path),
                ..outcome
            })
        },
    )
}

/// Pixels along a side of the largest picture.
const SIXTEEN_K: usize = 16_384;
/// The picture in floats once written and once read, its codes and the file, and something on top.
const SIXTEEN_K_GIB: f64 = 4.0;

fn sixteen_k() -> HardCase {
    HardCase::new(
        "16k image",
        "a matte of 16384 x 16384 pixels to an 8-bit PNG and back",
        format!("refused by Limits::pixels (128 Mi) until that is raised, then the same; at most {SIXTEEN_K_GIB} GiB"),
        || {
            if let Some(free) = memory::available_gib().filter(|free| *free < SIXTEEN_K_GIB) {
                return Ok(Outcome::new(format!("not tried: {free:.1} GiB are free"), false));
            }
            let (_folder, path) = folder()?;
            let path = path.join("a.png");
            let (sound, peak) = memory::peak_gib(|| -> Result<[bool; 2]> {
                let value = |x: usize, y: usize| Coverage(((x ^ y) & 0xff) as f32 / 255.0);
                io::write(&path, &Image::from_fn(SIXTEEN_K, SIXTEEN_K, value))?;
                let refused = io::read::<Coverage>(&path).is_err_and(|e| e.to_string().contains("Limits::pixels"));
                let limits = Limits { pixels: 512 << 20, ..Limits::default() };
                let back = io::read_with::<Coverage>(&path, &ReadOptions { limits, ..ReadOptions::default() })?;
                let same = (0..SIXTEEN_K).step_by(61).all(|y| (0..SIXTEEN_K).all(|x| back[(x, y)] == value(x, y)));
                Ok([refused, same])
            });
            let ([refused, same], peak_gib) = (sound?, peak.unwrap_or(0.0));
            let passed = refused && same && peak_gib < SIXTEEN_K_GIB;
            Ok(Outcome::new(format!("refused at first: {refused}, then the same: {same}; {peak_gib:.1} GiB"), passed))
        },
    )
    .for_the_report()
}
