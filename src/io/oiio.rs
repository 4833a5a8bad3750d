//! Pictures through OpenImageIO in this process: for the worker program, and for those who trust their files.
//!
//! A damaged file can crash OpenImageIO, and a program that calls this module links about 260 shared libraries.
//! [`io::read`](super::read) calls it in a process of its own, for the kinds of file that the Rust decoders do not know.

use super::exif::CameraNotes;
use super::ffi::{self, Layout};
use super::format::{Format, Source};
use super::limits::{Demand, Limits};
use super::protocol::{Ask, Sample, Shape, Told};
use super::raster::{FromFile, Raster, Refusal, Samples, Wanted};
use super::write::{Bits, ToFile, WriteOptions};
use super::{Fallback, ReadOptions, Window};
use crate::color::Curve;
use crate::{Error, Image, Result};
use cxx::UniquePtr;
use std::path::Path;
use std::sync::OnceLock;

/// The OpenImageIO that this library was built with.
pub fn version() -> String {
    ffi::version()
}

/// OpenImageIO linked into this program; [`in_process`] makes it.
#[derive(Clone, Copy)]
pub struct Linked(pub(super) fn(&Source, &Limits, Ask) -> std::result::Result<Told, Refusal>);

impl std::fmt::Debug for Linked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Linked")
    }
}

/// For [`Fallback::InProcess`]: a program that calls this links OpenImageIO.
pub fn in_process() -> Linked {
    Linked(|source, limits, ask| match ask {
        Ask::Header => shape(source, limits).map(Told::Shape),
        Ask::Pixels { wanted, window } => {
            decode(source, limits, wanted, window, |_| ()).map(Told::Raster)
        }
    })
}

/// Reads a picture through OpenImageIO, in this process; pixels mean the same as in [`io::read`](super::read).
///
/// # Errors
/// [`Error::File`] as [`io::read`](super::read). A damaged file may end the process instead.
pub fn read<P: FromFile>(path: impl AsRef<Path>) -> Result<Image<P>> {
    super::read_by(
        Fallback::InProcess(in_process()),
        path.as_ref(),
        &ReadOptions::default(),
    )
}

/// What TIFF alpha means is read from the file's own tag: OpenImageIO takes an unspecified one for associated.
pub(super) fn associated(raster: Raster, source: &Source) -> Raster {
    match source.format {
        Format::Tiff => Raster {
            premultiplied: CameraNotes::has_associated_alpha(&source.bytes),
            ..raster
        },
        Format::Exr => Raster {
            premultiplied: true,
            ..raster
        },
        _ => raster,
    }
}

/// The shape of a picture, without its samples.
pub(super) fn shape(source: &Source, limits: &Limits) -> std::result::Result<Shape, Refusal> {
    let (_, layout) = open(source, limits)?;
    Ok(Shape {
        width: layout.width as usize,
        height: layout.height as usize,
        sample: match (layout.bytes, layout.half) {
            (1, _) => Sample::U8,
            (2, false) => Sample::U16,
            (2, true) => Sample::F16,
            _ => Sample::F32,
        },
        names: layout.channels,
        display_encoded: false,
    })
}

/// Samples as the file has them, in the window asked for; `room` is told how many bytes they take before they are read.
pub(super) fn decode(
    source: &Source,
    limits: &Limits,
    wanted: Wanted,
    window: Window,
    room: impl FnOnce(u64),
) -> std::result::Result<Raster, Refusal> {
    let (reader, mut layout) = open(source, limits)?;
    if window == Window::Data {
        (layout.x, layout.y) = (0, 0);
        (layout.width, layout.height) = (layout.data_width, layout.data_height);
    }
    let picked = distinct(wanted.pick(&layout.channels)?);
    limits.room(layout.width as usize, layout.height as usize, picked.len())?;
    let count = (layout.data_width * layout.data_height) as usize * layout.channels.len();
    room(count as u64 * u64::from(layout.bytes.unsigned_abs()));
    let samples = match (layout.bytes, layout.half) {
        (1, _) => Samples::U8(windowed(filled(count, &reader)?, &layout, &picked)),
        (2, false) => Samples::U16(windowed(filled(count, &reader)?, &layout, &picked)),
        (2, true) => Samples::F16(windowed(filled(count, &reader)?, &layout, &picked)),
        _ => Samples::F32(windowed(filled(count, &reader)?, &layout, &picked)),
    };
    let (samples, display_encoded) = meaning(samples, source.format, &layout.color_space)?;
    Ok(Raster {
        width: layout.width as usize,
        height: layout.height as usize,
        names: picked.iter().map(|&i| layout.channels[i].clone()).collect(),
        samples,
        display_encoded,
        premultiplied: false,
    })
}

fn open<'a>(
    source: &'a Source,
    limits: &Limits,
) -> std::result::Result<(UniquePtr<ffi::Reader<'a>>, Layout), Refusal> {
    start()?;
    // Named in messages, and opened by the few readers that know only files.
    let name = source.path.to_string_lossy();
    let reader = ffi::open(&name, source.format.name(), &source.bytes).map_err(said)?;
    let layout = ffi::layout(&reader).map_err(said)?;
    check(&layout, source.bytes.len() as u64, limits)?;
    Ok((reader, layout))
}

/// Once for the process; what went wrong the first time is not tried again.
pub(super) fn start() -> std::result::Result<(), Refusal> {
    static STARTED: OnceLock<std::result::Result<(), String>> = OnceLock::new();
    STARTED
        .get_or_init(|| ffi::start().map_err(|e| e.what().to_owned()))
        .clone()
        .map_err(Refusal::Broken)
}

fn said(e: cxx::Exception) -> Refusal {
    Refusal::Broken(format!("OpenImageIO: {}", e.what()))
}

fn check(layout: &Layout, file_bytes: u64, limits: &Limits) -> std::result::Result<(), Refusal> {
    let size = |v: i64| u64::try_from(v).unwrap_or(0);
    for (width, height) in [
        (layout.width, layout.height),
        (layout.data_width, layout.data_height),
    ] {
        let channels = layout.channels.len() as u64;
        let bytes_per_pixel = channels * u64::from(layout.bytes.unsigned_abs());
        limits.check(Demand {
            width: size(width),
            height: size(height),
            channels,
            bytes_per_pixel,
            file_bytes,
        })?;
    }
    Ok(())
}

/// Grey is picked three times over for colour, but carried once.
fn distinct(mut picked: Vec<usize>) -> Vec<usize> {
    picked.dedup();
    picked
}

fn filled<T: bytemuck::Pod>(
    count: usize,
    reader: &ffi::Reader<'_>,
) -> std::result::Result<Vec<T>, Refusal> {
    let mut samples: Vec<T> = bytemuck::zeroed_vec(count);
    ffi::read(reader, bytemuck::cast_slice_mut(&mut samples)).map_err(said)?;
    Ok(samples)
}

/// The picked channels, cut or padded with zeros from the data window to the display window.
fn windowed<T: Copy + Default>(samples: Vec<T>, layout: &Layout, picked: &[usize]) -> Vec<T> {
    let (width, height) = (layout.width as usize, layout.height as usize);
    let (columns, stride) = (layout.data_width as usize, layout.channels.len());
    let same_window = (layout.x, layout.y, layout.data_width, layout.data_height)
        == (0, 0, layout.width, layout.height);
    if same_window && picked.iter().copied().eq(0..stride) {
        return samples;
    }
    let mut out = vec![T::default(); width * height * picked.len()];
    let ys = super::exr::overlap(layout.y, layout.data_height as usize, height);
    let xs = super::exr::overlap(layout.x, columns, width);
    for y in ys {
        for x in xs.clone() {
            let from = ((y as i64 - layout.y) as usize * columns + (x as i64 - layout.x) as usize)
                * stride;
            let to = (y * width + x) * picked.len();
            for (slot, &channel) in out[to..].iter_mut().zip(picked) {
                *slot = samples[from + channel];
            }
        }
    }
    out
}

/// The rule of [`io`](super) for integers and floats; film scans say themselves what their codes are.
fn meaning(
    samples: Samples,
    format: Format,
    space: &str,
) -> std::result::Result<(Samples, bool), Refusal> {
    let is_integer = !samples.are_float();
    match (format, space) {
        (Format::Dpx | Format::Cineon, "Linear" | "linear") => Ok((samples, false)),
        (Format::Dpx | Format::Cineon, "Rec709") => {
            Ok((Samples::F32(in_light(samples, Curve::Rec709)), false))
        }
        (Format::Dpx | Format::Cineon, "" | "sRGB") => Ok((samples, is_integer)),
        (Format::Dpx | Format::Cineon, other) => Err(Refusal::Broken(format!(
            "colour space {other}, expected linear, sRGB or Rec709 (convert it first)"
        ))),
        _ => Ok((samples, is_integer)),
    }
}

fn in_light(samples: Samples, curve: Curve) -> Vec<f32> {
    match samples {
        Samples::U8(v) => v
            .into_iter()
            .map(|code| curve.decode(f32::from(code) / 255.0))
            .collect(),
        Samples::U16(v) => v
            .into_iter()
            .map(|code| curve.decode(f32::from(code) / 65_535.0))
            .collect(),
        Samples::F16(v) => v
            .into_iter()
            .map(|value| curve.decode(value.into()))
            .collect(),
        Samples::F32(v) => v.into_iter().map(|value| curve.decode(value)).collect(),
    }
}

/// Writes a picture through OpenImageIO, encoded as [`io::write_with`](super::write_with) does.
///
/// # Errors
/// [`Error::File`] as [`io::write_with`](super::write_with); the file is written in place, not beside it.
pub fn write_with<P: ToFile>(
    path: impl AsRef<Path>,
    image: &Image<P>,
    options: &WriteOptions,
) -> Result<()> {
    let path = path.as_ref();
    encode(path, image, options).map_err(|e| Error::file(path, e))
}

fn encode<P: ToFile>(
    path: &Path,
    image: &Image<P>,
    options: &WriteOptions,
) -> std::result::Result<(), Refusal> {
    start()?;
    let format = Format::of_extension(path).ok_or("an extension that is not written")?;
    let bits = match format {
        Format::Dpx | Format::Cineon => options.bits.unwrap_or(Bits::Sixteen),
        _ => super::write::stored_as::<P>(Some(format), options.bits)?,
    };
    let (width, height) = (image.width() as i64, image.height() as i64);
    let layout = Layout {
        width,
        height,
        x: 0,
        y: 0,
        data_width: width,
        data_height: height,
        channels: P::NAMES.iter().map(|&n| n.into()).collect(),
        bytes: match bits {
            Bits::Eight => 1,
            Bits::Sixteen => 2,
            Bits::Half | Bits::Float => 4,
        },
        half: bits == Bits::Half,
        premultiplied: matches!(bits, Bits::Half | Bits::Float),
        color_space: String::new(),
    };
    let notes: Vec<_> = options
        .metadata
        .iter()
        .map(|(key, value)| ffi::Note {
            key: key.clone(),
            value: value.clone(),
        })
        .collect();
    let samples = match bits {
        Bits::Eight => super::write::flat(image, P::codes::<u8>),
        Bits::Sixteen => bytemuck::cast_slice(&super::write::flat(image, P::codes::<u16>)).to_vec(),
        Bits::Half | Bits::Float => {
            bytemuck::cast_slice(&super::write::flat(image, P::linear)).to_vec()
        }
    };
    let name = path
        .to_str()
        .ok_or("a file name that is not UTF-8, which OpenImageIO cannot open")?;
    ffi::write(name, format.name(), &layout, &samples, &notes).map_err(said)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_thrown_becomes_an_error() {
        assert_eq!(
            ffi::throw_an_int().unwrap_err().what(),
            "unknown C++ exception"
        );
        assert!(ffi::open("no such file.png", "png", b"").is_err());
        assert!(ffi::open("no such file.png", "no such reader", b"").is_err());
    }
}
