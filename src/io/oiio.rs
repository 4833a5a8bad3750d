//! Pictures through OpenImageIO in this process: for the worker program, and for those who trust their files.
//!
//! A damaged file can crash OpenImageIO, and a program that calls this module links about 260 shared libraries.
//! [`io::read`](super::read) calls it in a process of its own, for the kinds of file that the Rust decoders do not know.

use super::exif::CameraNotes;
use super::ffi::{self, Layout};
use super::format::{Format, Source};
use super::limits::{Demand, Limits};
use super::raster::{FromFile, Raster, Refusal, Samples, Wanted};
use super::write::{Bits, ToFile, WriteOptions};
use crate::color::Curve;
use crate::{Error, Image, Result};
use std::path::Path;
use std::sync::Once;

/// The OpenImageIO that this library was built with.
pub fn version() -> String {
    ffi::version()
}

/// Reads a picture through OpenImageIO, in this process; pixels mean the same as in [`io::read`](super::read).
///
/// # Errors
/// [`Error::File`] as [`io::read`](super::read). A damaged file may end the process instead.
pub fn read<P: FromFile>(path: impl AsRef<Path>) -> Result<Image<P>> {
    let (path, limits) = (path.as_ref(), Limits::default());
    let source = Source::open(path, &limits)?;
    let raster = decode(path, source.format, source.bytes.len() as u64, &limits, P::WANTED);
    raster
        .map(|raster| associated(raster, &source))
        .and_then(|raster| Ok(super::upright(&raster, &source)?))
        .map_err(|e| Error::file(path, e))
}

/// What TIFF alpha means is read from the file's own tag: OpenImageIO takes an unspecified one for associated.
pub(super) fn associated(raster: Raster, source: &Source) -> Raster {
    match source.format {
        Format::Tiff => Raster { premultiplied: CameraNotes::has_associated_alpha(&source.bytes), ..raster },
        Format::Exr => Raster { premultiplied: true, ..raster },
        _ => raster,
    }
}

/// Samples as the file has them, cut or padded to the display window.
pub(super) fn decode(
    path: &Path,
    format: Format,
    file_bytes: u64,
    limits: &Limits,
    wanted: Wanted,
) -> std::result::Result<Raster, Refusal> {
    start()?;
    let name = path.to_str().ok_or("a file name that is not UTF-8, which OpenImageIO cannot open")?;
    let reader = ffi::open(name, format.name()).map_err(said)?;
    let layout = ffi::layout(&reader).map_err(said)?;
    check(&layout, file_bytes, limits)?;
    let picked = distinct(wanted.pick(&layout.channels)?);
    let count = (layout.data_width * layout.data_height) as usize * layout.channels.len();
    let samples = match layout.bytes {
        1 => Samples::U8(filled(count, |bytes| ffi::read(&reader, bytes))?),
        2 => Samples::U16(filled(count, |bytes| ffi::read(&reader, bytes))?),
        _ => Samples::F32(filled(count, |bytes| ffi::read(&reader, bytes))?),
    };
    let narrow = match samples {
        Samples::U8(v) => Samples::U8(windowed(&v, &layout, &picked)),
        Samples::U16(v) => Samples::U16(windowed(&v, &layout, &picked)),
        Samples::F32(v) => Samples::F32(windowed(&v, &layout, &picked)),
    };
    let (samples, display_encoded) = meaning(narrow, format, &layout.color_space)?;
    Ok(Raster {
        width: layout.width as usize,
        height: layout.height as usize,
        names: picked.iter().map(|&i| layout.channels[i].clone()).collect(),
        samples,
        display_encoded,
        premultiplied: false,
    })
}

fn start() -> std::result::Result<(), Refusal> {
    static STARTED: Once = Once::new();
    let mut outcome = Ok(());
    STARTED.call_once(|| outcome = ffi::start());
    outcome.map_err(said)
}

fn said(e: cxx::Exception) -> Refusal {
    Refusal::Broken(format!("OpenImageIO: {}", e.what()))
}

fn check(layout: &Layout, file_bytes: u64, limits: &Limits) -> std::result::Result<(), Refusal> {
    let size = |v: i64| u64::try_from(v).unwrap_or(0);
    for (width, height) in [(layout.width, layout.height), (layout.data_width, layout.data_height)] {
        let channels = layout.channels.len() as u64;
        let bytes_per_pixel = channels * u64::from(layout.bytes.unsigned_abs());
        limits.check(Demand { width: size(width), height: size(height), channels, bytes_per_pixel, file_bytes })?;
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
    read: impl FnOnce(&mut [u8]) -> std::result::Result<(), cxx::Exception>,
) -> std::result::Result<Vec<T>, Refusal> {
    let mut samples = vec![T::zeroed(); count];
    read(bytemuck::cast_slice_mut(&mut samples)).map_err(said)?;
    Ok(samples)
}

/// The picked channels, cut or padded with zeros from the data window to the display window.
fn windowed<T: Copy + Default>(samples: &[T], layout: &Layout, picked: &[usize]) -> Vec<T> {
    let (width, height) = (layout.width as usize, layout.height as usize);
    let (columns, stride) = (layout.data_width as usize, layout.channels.len());
    let mut out = vec![T::default(); width * height * picked.len()];
    let ys = super::exr::overlap(layout.y, layout.data_height as usize, height);
    let xs = super::exr::overlap(layout.x, columns, width);
    for y in ys {
        for x in xs.clone() {
            let from = ((y as i64 - layout.y) as usize * columns + (x as i64 - layout.x) as usize) * stride;
            let to = (y * width + x) * picked.len();
            for (slot, &channel) in out[to..].iter_mut().zip(picked) {
                *slot = samples[from + channel];
            }
        }
    }
    out
}

/// The rule of [`io`](super) for integers and floats; film scans say themselves what their codes are.
fn meaning(samples: Samples, format: Format, space: &str) -> std::result::Result<(Samples, bool), Refusal> {
    let is_integer = !matches!(samples, Samples::F32(_));
    match (format, space) {
        (Format::Dpx | Format::Cineon, "Linear" | "linear") => Ok((samples, false)),
        (Format::Dpx | Format::Cineon, "Rec709") => Ok((Samples::F32(in_light(samples, Curve::Rec709)), false)),
        (Format::Dpx | Format::Cineon, "" | "sRGB") => Ok((samples, is_integer)),
        (Format::Dpx | Format::Cineon, other) => {
            Err(Refusal::Broken(format!("colour space {other}, expected linear, sRGB or Rec709 (convert it first)")))
        }
        _ => Ok((samples, is_integer)),
    }
}

fn in_light(samples: Samples, curve: Curve) -> Vec<f32> {
    match samples {
        Samples::U8(v) => v.into_iter().map(|code| curve.decode(f32::from(code) / 255.0)).collect(),
        Samples::U16(v) => v.into_iter().map(|code| curve.decode(f32::from(code) / 65_535.0)).collect(),
        Samples::F32(v) => v.into_iter().map(|value| curve.decode(value)).collect(),
    }
}

/// Writes a picture through OpenImageIO, encoded as [`io::write_with`](super::write_with) does.
///
/// # Errors
/// [`Error::File`] as [`io::write_with`](super::write_with); the file is written in place, not beside it.
pub fn write_with<P: ToFile>(path: impl AsRef<Path>, image: &Image<P>, options: &WriteOptions) -> Result<()> {
    let path = path.as_ref();
    encode(path, image, options).map_err(|e| Error::file(path, e))
}

fn encode<P: ToFile>(path: &Path, image: &Image<P>, options: &WriteOptions) -> std::result::Result<(), Refusal> {
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
    let notes: Vec<_> =
        options.metadata.iter().map(|(key, value)| ffi::Note { key: key.clone(), value: value.clone() }).collect();
    let samples = match bits {
        Bits::Eight => super::write::flat(image, P::codes8),
        Bits::Sixteen => bytemuck::cast_slice(&super::write::flat(image, P::codes16)).to_vec(),
        Bits::Half | Bits::Float => bytemuck::cast_slice(&super::write::flat(image, P::linear)).to_vec(),
    };
    let name = path.to_str().ok_or("a file name that is not UTF-8, which OpenImageIO cannot open")?;
    ffi::write(name, format.name(), &layout, &samples, &notes).map_err(said)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_thrown_becomes_an_error() {
        assert_eq!(ffi::throw_an_int().unwrap_err().what(), "unknown C++ exception");
        assert!(ffi::open("no such file.png", "png").is_err());
        assert!(ffi::open("no such file.png", "no such reader").is_err());
    }
}
