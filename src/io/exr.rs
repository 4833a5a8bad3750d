//! OpenEXR: scene-linear half or float in named channels, premultiplied alpha, text attributes.
//!
//! The header is read and checked first: the decoder allocates what a header asks for, and an allocation that fails
//! cannot be caught.

use super::atomic::write_bytes;
use super::exr_runs;
use super::header::{Header, Notes};
use super::limits::{Demand, Limits, at_most};
use super::raster::{Raster, Refusal, Samples, Wanted};
use super::{Compression, Format, ReadOptions, Source, Window};
use crate::color::{ColorMatrix, RgbSpace, rgb_from_rgb};
use crate::work::{self, Kind};
use crate::{Error, Result};
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, IntegerBounds, Layer, LayerAttributes, MetaData, ReadChannels,
    ReadLayers, Text, Vec2, WritableImage, f16,
};
use half::slice::HalfFloatSliceExt;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

type Part = Layer<AnyChannels<FlatSamples>>;

impl From<exr::error::Error> for Refusal {
    fn from(e: exr::error::Error) -> Self {
        match e {
            exr::error::Error::NotSupported(what) => Self::Unsupported(format!("unsupported EXR: {what}")),
            exr::error::Error::Io(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                Self::Broken("truncated EXR".into())
            }
            e => Self::Broken(format!("damaged EXR: {e}")),
        }
    }
}

/// A channel of an EXR file by its full name, cropped or padded to the display window.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// `R`, `diffuse.G`, `Z`, ...
    pub name: String,
    /// Samples row by row from the top, as many as the picture has pixels.
    pub samples: Vec<f32>,
}

/// Writes float channels under names of their own, zip-compressed, with text attributes.
///
/// `size` is width and height; every channel has `width * height` samples, row by row from the top. Names may hold a
/// layer: `diffuse.R`.
///
/// # Errors
/// [`Error::File`] for a channel of another size, a name twice, or a file that cannot be written.
pub fn write_channels(
    path: impl AsRef<Path>,
    size: (usize, usize),
    channels: &[(&str, &[f32])],
    metadata: &[(String, String)],
) -> Result<()> {
    let path = path.as_ref();
    let planes = channels.iter().map(|&(name, samples)| (name, FlatSamples::F32(samples.to_vec()))).collect();
    work::add(Kind::Encodes, 1);
    let bytes = encode(size, planes, Compression::Zip, metadata).map_err(|e| Error::file(path, e))?;
    write_bytes(path, &bytes)
}

/// As [`write_channels`], with half floats, and packed for photographs: in half the time.
///
/// # Errors
/// Those of [`write_channels`].
pub fn write_half_channels(
    path: impl AsRef<Path>,
    size: (usize, usize),
    channels: &[(&str, &[f32])],
    metadata: &[(String, String)],
) -> Result<()> {
    let path = path.as_ref();
    let planes = channels.iter().map(|&(name, samples)| (name, to_halves(samples))).collect();
    work::add(Kind::Encodes, 1);
    let bytes = exr_runs::encode(size, planes, metadata).map_err(|e| Error::file(path, e))?;
    write_bytes(path, &bytes)
}

/// Reads every channel of the first part of an EXR file, and the picture's size.
///
/// # Errors
/// [`Error::File`] for a file that cannot be opened, is not an EXR, is damaged or goes beyond the default [`Limits`].
pub fn read_channels(path: impl AsRef<Path>) -> Result<((usize, usize), Vec<Channel>)> {
    let (path, limits) = (path.as_ref(), ReadOptions::default().limits);
    let source = Source::open(path, &limits)?;
    if source.format != Format::Exr {
        return Err(Error::file(path, format!("is {}, expected an EXR", source.format.name())));
    }
    let read = || -> std::result::Result<_, Refusal> {
        let file = read_parts(&source.bytes, &limits)?;
        let part = file.parts.first().ok_or("no part with pixels")?;
        let channels = part
            .channel_data
            .list
            .iter()
            .map(|c| Channel { name: c.name.to_string(), samples: interleaved(part, &[&c.sample_data], file.window) });
        Ok((size_of(file.window), channels.collect()))
    };
    super::caught(read).map_err(|e| Error::file(path, e))
}

/// The parts that hold flat pixels, and the window they are all shown in.
struct Parts {
    parts: Vec<Part>,
    window: IntegerBounds,
    /// To the library's primaries, where the file names others.
    to_rec709: Option<ColorMatrix>,
}

fn size_of(window: IntegerBounds) -> (usize, usize) {
    (window.size.x(), window.size.y())
}

/// The headers alone, checked against the limits: data and display window of every part, and their sum.
fn check(file: impl Read, file_bytes: u64, limits: &Limits) -> std::result::Result<MetaData, Refusal> {
    let meta = MetaData::read_from_buffered(BufReader::new(file.take(limits.metadata_bytes)), false);
    if meta.is_err() && file_bytes > limits.metadata_bytes {
        at_most(file_bytes, limits.metadata_bytes, "bytes without an end of the header", "metadata_bytes")?;
    }
    let meta = meta?;
    at_most(meta.headers.len() as u64, limits.parts, "parts", "parts")?;
    let mut total = 0_u64;
    for header in &meta.headers {
        let channels = header.channels.list.len() as u64;
        let bytes_per_pixel = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u64).sum();
        for size in [header.layer_size, header.shared_attributes.display_window.size] {
            let (width, height) = (size.x() as u64, size.y() as u64);
            limits.check(Demand { width, height, channels, bytes_per_pixel, file_bytes })?;
        }
        total += header.layer_size.area() as u64 * bytes_per_pixel;
    }
    at_most(total, limits.decoded_bytes, "decoded bytes", "decoded_bytes")?;
    if meta.headers.iter().any(|h| h.deep) {
        return Err(Refusal::Unsupported("deep EXR, expected flat pixels".into()));
    }
    Ok(meta)
}

fn read_parts(bytes: &[u8], limits: &Limits) -> std::result::Result<Parts, Refusal> {
    check(bytes, bytes.len() as u64, limits)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    let to_rec709 = image.attributes.chromaticities.map(to_rec709).transpose()?.flatten();
    Ok(Parts { parts: image.layer_data.into_vec(), window: image.attributes.display_window, to_rec709 })
}

/// Chromaticities that differ by less are the same, written with fewer digits.
const SAME_CHROMATICITY: f64 = 1e-3;
/// A triangle of primaries with less area (in x, y) holds no colours; Rec. 709 has 0.11.
const SMALLEST_GAMUT: f64 = 1e-3;

/// The way to the library's primaries from those that a file names; none where they are the same.
fn to_rec709(named: Chromaticities) -> std::result::Result<Option<ColorMatrix>, Refusal> {
    let xy = |v: Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
    let space = RgbSpace { primaries: [named.red, named.green, named.blue].map(xy), white: xy(named.white) };
    let [r, g, b] = space.primaries;
    let area = ((g[0] - r[0]) * (b[1] - r[1]) - (b[0] - r[0]) * (g[1] - r[1])).abs() / 2.0;
    let real = |[x, y]: &[f64; 2]| x.abs() <= 2.0 && (1e-6..=2.0).contains(&y.abs());
    let all_real = space.primaries.iter().chain([&space.white]).all(real);
    if !all_real || area < SMALLEST_GAMUT || space.white[1] < SMALLEST_GAMUT {
        let all = [space.primaries[0], space.primaries[1], space.primaries[2], space.white];
        return Err(format!("chromaticities {all:?}, expected those of a colour space").into());
    }
    let ours = RgbSpace::REC709;
    let pairs = |a: &RgbSpace| a.primaries.into_iter().chain([a.white]).flatten().collect::<Vec<_>>();
    let same = pairs(&space).iter().zip(pairs(&ours)).all(|(v, w)| (v - w).abs() < SAME_CHROMATICITY);
    Ok((!same).then(|| rgb_from_rgb(&ours, &space).into()))
}

pub(super) fn header(file: impl Read, file_bytes: u64, limits: &Limits) -> std::result::Result<Header, Refusal> {
    let meta = check(file, file_bytes, limits)?;
    let first = meta.headers.first().ok_or("no part with pixels")?;
    let shown = first.shared_attributes.display_window;
    let (width, height) = size_of(shown);
    let at = |v: i32, origin: i32| i64::from(v) - i64::from(origin);
    let position = first.own_attributes.layer_position;
    let list = &first.channels.list;
    Ok(Header {
        format: Format::Exr,
        width,
        height,
        channels: in_usual_order(list.iter().map(|c| c.name.to_string()).collect()),
        bits: list.iter().map(|c| 8 * c.sample_type.bytes_per_sample() as u32).max().unwrap_or(0),
        data_at: [at(position.x(), shown.position.x()), at(position.y(), shown.position.y())],
        data_size: [first.layer_size.x(), first.layer_size.y()],
        metadata: texts(first),
        ..Header::default()
    })
}

/// `R G B A` first, the rest by name.
fn in_usual_order(mut names: Vec<String>) -> Vec<String> {
    names.sort_by_key(|n| ("RGBA".find(n.as_str()).filter(|_| n.len() == 1).unwrap_or(4), n.clone()));
    names
}

fn texts(header: &exr::meta::header::Header) -> Notes {
    use exr::meta::attribute::AttributeValue;
    let all = header.own_attributes.other.iter().chain(&header.shared_attributes.other);
    let mut notes: Notes = all
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            _ => None,
        })
        .collect();
    notes.sort();
    notes
}

/// The wanted channels of the first part that has them.
pub(super) fn decode(
    bytes: &[u8],
    limits: &Limits,
    wanted: Wanted,
    shown: Window,
) -> std::result::Result<Raster, Refusal> {
    let Parts { parts, window, to_rec709 } = read_parts(bytes, limits)?;
    let mut refused = "no part with pixels".to_string();
    for part in &parts {
        let names: Vec<String> = part.channel_data.list.iter().map(|c| c.name.to_string()).collect();
        let picked = match wanted.pick(&names) {
            Ok(mut picked) => {
                picked.dedup();
                picked
            }
            Err(e) => {
                refused = e;
                continue;
            }
        };
        let planes: Vec<_> = picked.iter().map(|&i| &part.channel_data.list[i].sample_data).collect();
        let window = match shown {
            Window::Display => window,
            Window::Data => IntegerBounds::new(part.attributes.layer_position, part.size),
        };
        let (width, height) = size_of(window);
        let mut samples = interleaved(part, &planes, window);
        if let (Wanted::Color | Wanted::Film, 3.., Some(matrix)) = (wanted, planes.len(), &to_rec709) {
            convert(&mut samples, planes.len(), matrix);
        }
        return Ok(Raster {
            width,
            height,
            names: picked.iter().map(|&i| names[i].clone()).collect(),
            samples: Samples::F32(samples),
            display_encoded: false,
            premultiplied: true,
        });
    }
    Err(Refusal::Broken(refused))
}

/// The first three of `n` interleaved channels in other primaries; alpha does not mind.
fn convert(samples: &mut [f32], n: usize, matrix: &ColorMatrix) {
    for px in samples.chunks_exact_mut(n) {
        let color = matrix.apply([px[0], px[1], px[2]]);
        px[..3].copy_from_slice(&color);
    }
}

/// Planes of a part side by side, cut or padded with zeros from its data window to the display window.
fn interleaved(part: &Part, planes: &[&FlatSamples], window: IntegerBounds) -> Vec<f32> {
    let ((width, height), n) = (size_of(window), planes.len());
    let mut out = vec![0.0; width * height * n];
    let shift = |at: i32, origin: i32| i64::from(at) - i64::from(origin);
    let (left, top) = (
        shift(part.attributes.layer_position.x(), window.position.x()),
        shift(part.attributes.layer_position.y(), window.position.y()),
    );
    let columns = overlap(left, part.size.x(), width);
    for (c, plane) in planes.iter().enumerate() {
        let samples = to_f32(plane);
        for y in overlap(top, part.size.y(), height) {
            let row = &samples[(y as i64 - top) as usize * part.size.x()..][..part.size.x()];
            for x in columns.clone() {
                out[(y * width + x) * n + c] = row[(x as i64 - left) as usize];
            }
        }
    }
    out
}

/// The part of `0..shown` that a run of `length` samples starting at `start` covers.
pub(super) fn overlap(start: i64, length: usize, shown: usize) -> std::ops::Range<usize> {
    let clip = |v: i64| v.clamp(0, shown as i64) as usize;
    clip(start)..clip(start + length as i64)
}

/// Halves are converted here: asking the decoder for floats takes five times as long.
fn to_f32(plane: &FlatSamples) -> Vec<f32> {
    match plane {
        FlatSamples::F16(v) => v.to_f32_vec(),
        FlatSamples::F32(v) => v.clone(),
        FlatSamples::U32(v) => v.iter().map(|&x| x as f32).collect(),
    }
}

/// Floats as halves, rounded to nearest; what is finite stays so, 65504 at most: programs blur and scale what they read,
/// and one infinite pixel would take its neighbours along.
pub(super) fn to_halves(samples: &[f32]) -> Vec<f16> {
    let mut out = vec![f16::ZERO; samples.len()];
    half::slice::HalfFloatSliceExt::convert_from_f32_slice(out.as_mut_slice(), samples);
    for (half, v) in out.iter_mut().zip(samples) {
        if half.is_infinite() && v.is_finite() {
            *half = f16::MAX.copysign(*half);
        }
    }
    out
}

pub(super) fn halves(samples: &[f32]) -> FlatSamples {
    FlatSamples::F16(to_halves(samples))
}

pub(super) fn floats(samples: Vec<f32>) -> FlatSamples {
    FlatSamples::F32(samples)
}

/// A whole file; the same input gives the same bytes.
pub(super) fn encode(
    (width, height): (usize, usize),
    planes: Vec<(&str, FlatSamples)>,
    compression: Compression,
    metadata: &[(String, String)],
) -> std::result::Result<Vec<u8>, String> {
    let text = |s: &str| Text::new_or_none(s).ok_or_else(|| format!("{s:?} cannot stand in an EXR (not Latin-1)"));
    let mut list = exr::prelude::SmallVec::new();
    for (name, samples) in planes {
        if samples.len() != width * height {
            return Err(format!("channel {name}: {} samples, expected {width} x {height}", samples.len()));
        }
        list.push(AnyChannel::new(text(name)?, samples));
    }
    let mut attributes = LayerAttributes::default();
    for (key, value) in metadata {
        attributes.other.insert(text(key)?, exr::meta::attribute::AttributeValue::Text(text(value)?));
    }
    let encoding = Encoding { compression: compression.of_exr(), ..Encoding::SMALL_LOSSLESS };
    let layer = Layer::new(Vec2(width, height), attributes, encoding, AnyChannels::sort(list));
    let mut out = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer).write().to_buffered(&mut out).map_err(|e| e.to_string())?;
    let mut bytes = out.into_inner();
    sort_attributes(&mut bytes, HEADER).ok_or("header of an unknown kind")?;
    Ok(bytes)
}

/// Start of the first attribute: behind the magic number and the version.
const HEADER: usize = 8;

/// Puts the attributes of the header that starts at `start` in the order of their names, as OpenEXR's own library does:
/// the `exr` crate keeps them in a hash map, whose order differs from run to run. Returns where they end.
pub(super) fn sort_attributes(file: &mut [u8], start: usize) -> Option<usize> {
    let mut attributes = Vec::new();
    let mut at = start;
    while *file.get(at)? != 0 {
        let kind = at + file[at..].iter().position(|&b| b == 0)? + 1;
        let size = kind + file.get(kind..)?.iter().position(|&b| b == 0)? + 1;
        let length = u32::from_le_bytes(*file.get(size..)?.first_chunk()?);
        let end = size + 4 + usize::try_from(length).ok()?;
        attributes.push(file.get(at..end)?.to_vec());
        at = end;
    }
    attributes.sort();
    file[start..at].copy_from_slice(&attributes.concat());
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes(n: usize) -> Notes {
        (0..n).map(|i| (format!("petcomp:{i}"), format!("value {i}"))).collect()
    }

    #[test]
    fn attributes_are_in_the_order_of_their_names() {
        let file = || encode((2, 1), vec![("Z", floats(vec![1.0, 2.0]))], Compression::Zip, &notes(12)).unwrap();
        assert_eq!(file(), file());
        let meta = header(file().as_slice(), 10_000, &Limits::default()).unwrap();
        assert_eq!(meta.metadata.len(), 12);
        let text = String::from_utf8_lossy(&file()).into_owned();
        assert!(text.find("channels").unwrap() < text.find("compression").unwrap());
        assert!(text.find("petcomp:3").unwrap() < text.find("petcomp:4").unwrap());
    }

    #[test]
    fn names_come_in_the_usual_order() {
        let names = ["A", "B", "G", "N.X", "R", "Z"].map(String::from).to_vec();
        assert_eq!(in_usual_order(names), ["R", "G", "B", "A", "N.X", "Z"]);
    }

    /// ACEScg (0.322761, 0.482919, 0.841329) is Rec. 709 (0.18, 0.5, 0.9), by colour-science.
    #[test]
    fn other_primaries_become_ours() {
        let plane = |name, v: f32| AnyChannel::new(name, floats(vec![v]));
        let list = [plane("R", 0.322_761), plane("G", 0.482_919), plane("B", 0.841_329)].into_iter().collect();
        let mut image = exr::prelude::Image::from_channels(Vec2(1, 1), AnyChannels::sort(list));
        let xy = |x, y| Vec2(x, y);
        image.attributes.chromaticities = Some(Chromaticities {
            red: xy(0.713, 0.293),
            green: xy(0.165, 0.830),
            blue: xy(0.128, 0.044),
            white: xy(0.32168, 0.33767),
        });
        let read = |image: &exr::prelude::Image<_>| {
            let mut out = Cursor::new(Vec::new());
            WritableImage::write(image).to_buffered(&mut out).unwrap();
            decode(out.get_ref(), &Limits::default(), Wanted::Color, Window::Display)
        };
        let Samples::F32(rgb) = read(&image).unwrap().samples else { panic!("not floats") };
        for (v, expected) in rgb.iter().zip([0.18, 0.5, 0.9]) {
            assert!((v - expected).abs() < 1e-4, "{rgb:?}");
        }
        image.attributes.chromaticities =
            Some(Chromaticities { red: xy(0.0, 0.0), ..image.attributes.chromaticities.unwrap() });
        image.attributes.chromaticities.as_mut().unwrap().white = xy(0.3, 0.0);
        assert!(read(&image).unwrap_err().to_string().contains("expected those of a colour space"));
    }

    #[test]
    fn a_data_window_is_cut_and_padded_to_the_display_window() {
        let mut layer = Layer::new(
            Vec2(2, 2),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort([AnyChannel::new("Y", floats(vec![1.0, 2.0, 3.0, 4.0]))].into_iter().collect()),
        );
        layer.attributes.layer_position = Vec2(-1, 1);
        let mut image = exr::prelude::Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::from_dimensions(Vec2(2, 3));
        let mut out = Cursor::new(Vec::new());
        image.write().to_buffered(&mut out).unwrap();
        let raster = decode(out.get_ref(), &Limits::default(), Wanted::Coverage, Window::Display).unwrap();
        assert_eq!((raster.width, raster.height), (2, 3));
        assert_eq!(raster.samples, Samples::F32(vec![0.0, 0.0, 2.0, 0.0, 4.0, 0.0]));
        let kept = decode(out.get_ref(), &Limits::default(), Wanted::Coverage, Window::Data).unwrap();
        assert_eq!((kept.width, kept.height, kept.samples), (2, 2, Samples::F32(vec![1.0, 2.0, 3.0, 4.0])));
        let told = header(out.get_ref().as_slice(), 1_000, &Limits::default()).unwrap();
        assert_eq!((told.width, told.height, told.data_at, told.data_size), (2, 3, [-1, 1], [2, 2]));
    }
}
