//! Files that are hard to write or to read: values beyond a half float, the smallest ones, cut and
//! lying headers, 16k.

use super::staged::temporary_folder;
use super::{HardCase, Outcome, memory};
use petcomp::io::{self, Bits, ReadOptions, WriteOptions, exr};
use petcomp::{Coverage, Error, Image, LinearRgb, PremulRgba, Result};
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Largest half float.
const HALF_MAX: f32 = 65504.0;
/// Smallest half float above 0, a denormal.
const HALF_MIN: f32 = 1.0 / (1 << 24) as f32;
/// Formats that are written.
const FORMATS: [&str; 4] = ["exr", "png", "tif", "jpg"];

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases: Vec<HardCase> = half_floats().into();
    cases.extend([
        half_channels(),
        exact_floats(),
        clamped_codes(),
        sixteen_k_png(),
        nested_document(),
        overlong_number(),
    ]);
    cases.extend(FORMATS.map(one_pixel));
    cases.extend(FORMATS.map(no_pixel));
    cases.extend(FORMATS.map(truncated_file));
    cases.extend([
        lying_png(),
        lying_exr(),
        lying_hdr(),
        empty_file(),
        missing_file(),
    ]);
    Ok(cases)
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

/// A folder that is removed with its case.
struct CaseFolder(TempDir);

impl CaseFolder {
    fn new() -> Result<Self> {
        Ok(Self(temporary_folder()?))
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    /// Where a picture of a format is written.
    fn picture(&self, extension: &str) -> PathBuf {
        self.path(format!("a.{extension}"))
    }
}

/// Values written to a file and read back, as the green of a row of pixels.
fn through_file(name: &str, values: &[f32], options: &WriteOptions) -> Result<Vec<f32>> {
    let folder = CaseFolder::new()?;
    let path = folder.path(name);
    io::write_with(&path, &green_row(values), options)?;
    read_green(&path)
}

fn read_green(path: &Path) -> Result<Vec<f32>> {
    let picture = io::read::<LinearRgb>(path)?;
    Ok(picture.pixels().iter().map(|p| p.g).collect())
}

fn green_row(values: &[f32]) -> Image<LinearRgb> {
    let pixels = values.iter().map(|&v| LinearRgb::new(0.0, v, 0.0));
    Image::from_vec(values.len(), 1, pixels.collect())
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

fn half_channels() -> HardCase {
    HardCase::new(
        "half-float channels above 65504",
        "1e5 and -1e5 in a channel of its own, as cut-outs have",
        "65504 and -65504",
        write_half_channels,
    )
}

fn write_half_channels() -> Result<Outcome> {
    let folder = CaseFolder::new()?;
    let path = folder.picture("exr");
    exr::write_half_channels(&path, (2, 1), &[("TR", &[1e5, -1e5])], &[])?;
    let (_, channels) = exr::read_channels(&path)?;
    let found: Vec<f32> = channels.into_iter().flat_map(|c| c.samples).collect();
    Ok(Outcome::new(listed(&found), found == [HALF_MAX, -HALF_MAX]))
}

fn exact_floats() -> HardCase {
    HardCase::new(
        "float samples at the ends of their range",
        "the smallest denormal, the smallest normal, 1e-4 beside 1e5, the largest, in EXR and TIFF",
        "every bit comes back: 0 differ",
        || {
            let differ = count_changed_floats("a.exr")? + count_changed_floats("a.tif")?;
            Ok(Outcome::none(differ, "differ"))
        },
    )
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

fn clamped_codes() -> HardCase {
    HardCase::new(
        "NaN, infinities and negative light in a PNG",
        "NaN, -inf, -1, 1e38, inf in 8 bits",
        "0, 0, 0, 1, 1",
        write_clamped_codes,
    )
}

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
        "1 x 1 pixel back, to 1 code of 255",
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
        format!("{format}: no pixel"),
        "0 x 0 and 5 x 0 pixels",
        "refused, and nothing is written",
        move || write_no_pixel(format),
    )
}

fn write_no_pixel(format: &str) -> Result<Outcome> {
    let folder = CaseFolder::new()?;
    let path = folder.picture(format);
    let refused =
        [(0, 0), (5, 0)].map(|(w, h)| io::write(&path, &Image::<LinearRgb>::new(w, h)).is_err());
    let is_written = path.exists();
    Ok(Outcome::new(
        format!("{refused:?}, a file: {is_written}"),
        refused == [true; 2] && !is_written,
    ))
}

/// The bytes of a picture of 17 x 13 pixels.
fn picture_bytes(path: &Path) -> Result<Vec<u8>> {
    io::write(path, &Image::from_fn(17, 13, test_color))?;
    std::fs::read(path).map_err(|e| Error::file(path, e))
}

fn test_color(x: usize, y: usize) -> LinearRgb {
    let blue = ((x * 7 + y * 5) % 11) as f32 / 11.0;
    LinearRgb::new(x as f32 / 17.0, y as f32 / 13.0, blue)
}

/// The picture that bytes under a name decode to.
fn read_as(path: &Path, bytes: &[u8]) -> Result<Image<PremulRgba>> {
    save(path, bytes)?;
    io::read(path)
}

fn truncated_file(format: &'static str) -> HardCase {
    HardCase::new(
        format!("{format}: truncated"),
        "17 x 13 pixels, cut at each of 20 places, the first at 0 bytes",
        "refused at every one: 0 read",
        move || read_truncated_files(format),
    )
}

fn read_truncated_files(format: &str) -> Result<Outcome> {
    let folder = CaseFolder::new()?;
    let path = folder.picture(format);
    let whole = picture_bytes(&path)?;
    let cuts = (0..20).map(|i| &whole[..i * whole.len() / 20]);
    let read = cuts.filter(|cut| read_as(&path, cut).is_ok()).count();
    Ok(Outcome::none(read, "read"))
}

/// What a header, a message and the decoders' buffers may take, GiB.
const SMALL_GROWTH_GIB: f64 = 0.064;

/// A file whose header asks for more than is allowed: refused by the name of the limit, before
/// memory is taken.
fn lying(
    name: &str,
    input: &str,
    limit: &'static str,
    make: fn(&Path) -> Result<PathBuf>,
) -> HardCase {
    let expectation = format!("refused by Limits::{limit}, within 64 MiB");
    HardCase::new(name, input, expectation, move || {
        let folder = CaseFolder::new()?;
        Ok(read_lying_file(&make(folder.0.path())?, limit))
    })
}

fn read_lying_file(path: &Path, limit: &str) -> Outcome {
    let (_, before) = memory::peak_gib(|| ());
    let (read, peak) = memory::peak_gib(|| io::read::<PremulRgba>(path));
    let grown = peak.zip(before).map_or(0.0, |(peak, before)| peak - before);
    let outcome = without_path(Outcome::refused(read, &format!("Limits::{limit}")), path);
    Outcome::new(
        format!("{}; {:.0} MiB", outcome.measured, grown * 1024.0),
        outcome.passed && grown < SMALL_GROWTH_GIB,
    )
}

/// An outcome whose message lacks the path, which differs in every run.
fn without_path(outcome: Outcome, path: &Path) -> Outcome {
    let prefix = format!("{}: ", path.display());
    Outcome::new(outcome.measured.replace(&prefix, ""), outcome.passed)
}

fn lying_png() -> HardCase {
    lying(
        "png: header of 32767 x 32767 pixels",
        "a PNG of 17 x 13 that says so",
        "pixels",
        |folder| {
            let path = folder.join("a.png");
            let mut png = picture_bytes(&path)?;
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
            let mut exr = picture_bytes(&path)?;
            enlarge_window(&mut exr, b"dataWindow\0box2i\0");
            enlarge_window(&mut exr, b"displayWindow\0box2i\0");
            save(path, &exr)
        },
    )
}

fn enlarge_window(exr: &mut [u8], attribute: &[u8]) {
    let Some(at) = exr.windows(attribute.len()).position(|w| w == attribute) else {
        return;
    };
    // Behind the name and the attribute's size stand x0, y0, x1, y1.
    let corner = at + attribute.len() + 4 + 8;
    exr[corner..corner + 8].copy_from_slice(&[0x3f, 0x0d, 3, 0, 0x3f, 0x0d, 3, 0]);
}

fn lying_hdr() -> HardCase {
    lying(
        "hdr: 99999 pixels a side",
        "a header and nothing behind it",
        "side",
        |folder| {
            let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n";
            save(folder.join("a.hdr"), header)
        },
    )
}

fn save<P: AsRef<Path>>(path: P, bytes: &[u8]) -> Result<P> {
    std::fs::write(&path, bytes).map_err(|e| Error::file(path.as_ref(), e))?;
    Ok(path)
}

fn empty_file() -> HardCase {
    HardCase::new(
        "file of 0 bytes",
        "called .png, .exr, .tif, .jpg",
        "refused: 0 read",
        read_empty_files,
    )
}

fn read_empty_files() -> Result<Outcome> {
    let folder = CaseFolder::new()?;
    let attempts = FORMATS.map(|format| read_as(&folder.picture(format), &[]));
    let read = attempts.iter().filter(|attempt| attempt.is_ok());
    Ok(Outcome::none(read.count(), "read"))
}

fn missing_file() -> HardCase {
    HardCase::new(
        "no file",
        "a name that does not exist",
        "an error that names the file",
        read_missing_file,
    )
}

fn read_missing_file() -> Result<Outcome> {
    let folder = CaseFolder::new()?;
    let read = io::read::<PremulRgba>(folder.path("none.png"));
    let outcome = Outcome::refused(read, "none.png");
    let prefix = format!("{}/", folder.0.path().display());
    let measured = outcome.measured.replace(&prefix, "");
    Ok(Outcome::new(measured, outcome.passed))
}

fn nested_document() -> HardCase {
    HardCase::new(
        "document of 100 000 brackets",
        "[[[[...",
        "refused, not a stack overflow",
        || {
            let brackets = "[".repeat(100_000);
            read_document::<serde_json::Value>(&brackets, "nested deeper")
        },
    )
}

fn read_document<T: DeserializeOwned>(text: &str, cause: &str) -> Result<Outcome> {
    let folder = CaseFolder::new()?;
    let path = save(folder.path("a.json"), text.as_bytes())?;
    let outcome = Outcome::refused(io::read_json::<T>(&path), cause);
    Ok(without_path(outcome, &path))
}

fn overlong_number() -> HardCase {
    HardCase::new(
        "document with the number 1e999",
        "[1e999]",
        "refused, not infinity",
        || read_document::<Vec<f64>>("[1e999]", "number out of range"),
    )
}

/// Pixels along a side of the largest picture.
const SIXTEEN_K_PX: usize = 16_384;
/// The picture in floats once written and once read, its codes and the file, and something on top.
const SIXTEEN_K_GIB: f64 = 4.0;

fn sixteen_k_png() -> HardCase {
    HardCase::new(
        "16k image",
        "a matte of 16384 x 16384 pixels to an 8-bit PNG and back",
        format!(
            "refused by Limits::pixels (128 Mi) until that is raised, then the same; at most {SIXTEEN_K_GIB} GiB"
        ),
        write_sixteen_k,
    )
    .for_the_report()
}

fn write_sixteen_k() -> Result<Outcome> {
    if let Some(shortage) = memory::shortage(SIXTEEN_K_GIB) {
        return Ok(shortage);
    }
    let folder = CaseFolder::new()?;
    let path = folder.picture("png");
    let (sound, peak) = memory::peak_gib(|| sixteen_k_through_file(&path));
    let ([refused, same], peak_gib) = (sound?, peak.unwrap_or(0.0));
    Ok(Outcome::new(
        format!("refused at first: {refused}, then the same: {same}; {peak_gib:.1} GiB"),
        refused && same && peak_gib < SIXTEEN_K_GIB,
    ))
}

/// Whether the default limit refuses the picture, and whether it comes back by a larger one.
fn sixteen_k_through_file(path: &Path) -> Result<[bool; 2]> {
    io::write(
        path,
        &Image::from_fn(SIXTEEN_K_PX, SIXTEEN_K_PX, xor_pattern),
    )?;
    let error = io::read::<Coverage>(path).err();
    let refused = error.is_some_and(|e| e.to_string().contains("Limits::pixels"));
    let back = io::read_with::<Coverage>(path, &with_raised_limit())?;
    Ok([refused, is_xor_pattern(&back)])
}

fn with_raised_limit() -> ReadOptions {
    let mut options = ReadOptions::default();
    options.limits.pixels = 512 << 20;
    options
}

fn xor_pattern(x: usize, y: usize) -> Coverage {
    Coverage(((x ^ y) & 0xff) as f32 / 255.0)
}

/// Every 61st row is compared.
fn is_xor_pattern(matte: &Image<Coverage>) -> bool {
    let mut rows = (0..SIXTEEN_K_PX).step_by(61);
    rows.all(|y| (0..SIXTEEN_K_PX).all(|x| matte[(x, y)] == xor_pattern(x, y)))
}
