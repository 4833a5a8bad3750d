//! OpenEXR: scene-linear half or float in named channels, premultiplied alpha, text attributes.
//!
//! The header is read and checked first: the decoder allocates what a header asks for, and an allocation that fails
//! cannot be caught.

use super::atomic::write_bytes;
use super::exr_blocks::{Job, Order};
use super::exr_chroma::{LUMINANCE_CHROMA, Sampling, to_rgb};
use super::exr_runs;
use super::header::{Header, Notes};
use super::limits::{Demand, Limits, affordable, at_most};
use super::profile::to_rec709;
use super::raster::{Fit, Raster, Refusal, Samples, Wanted};
use super::{Compression, Format, ReadOptions, Source, Window};
use crate::color::{ColorMatrix, RgbSpace};
use crate::work::{self, Kind};
use crate::{Error, Result};
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, IntegerBounds, Layer, LayerAttributes,
    MetaData, Text, Vec2, WritableImage, f16,
};
use std::borrow::Cow;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

impl From<exr::error::Error> for Refusal {
    fn from(e: exr::error::Error) -> Self {
        match e {
            exr::error::Error::NotSupported(what) => {
                Self::Unsupported(format!("unsupported EXR: {what}"))
            }
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
    let planes = channels
        .iter()
        .map(|&(name, samples)| (name, FlatSamples::F32(samples.to_vec())))
        .collect();
    work::add(Kind::Encodes, 1);
    let bytes =
        encode(size, planes, Compression::Zip, metadata).map_err(|e| Error::file(path, e))?;
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
    let planes = channels
        .iter()
        .map(|&(name, samples)| (name, to_halves(samples)))
        .collect();
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
        return Err(Error::file(
            path,
            format!("is {}, expected an EXR", source.format.name()),
        ));
    }
    super::caught(|| channels(&source.bytes, &limits)).map_err(|e| Error::file(path, e))
}

fn channels(
    bytes: &[u8],
    limits: &Limits,
) -> std::result::Result<((usize, usize), Vec<Channel>), Refusal> {
    let file = File::new(bytes, limits)?;
    let part = file.flat_parts().next().ok_or("no part with pixels")?;
    let names = file.names(part);
    let (width, height) = size_of(file.window());
    limits.room(width, height, names.len())?;
    let picked: Vec<usize> = (0..names.len()).collect();
    let samples = file
        .job(part, &picked, file.window(), Order::Planar)?
        .read()?;
    let planes = samples.chunks_exact(width * height).map(<[f32]>::to_vec);
    Ok((
        (width, height),
        names
            .into_iter()
            .zip(planes)
            .map(|(name, samples)| Channel { name, samples })
            .collect(),
    ))
}

/// A file whose headers were checked.
struct File<'a> {
    bytes: Cow<'a, [u8]>,
    meta: MetaData,
    sampling: Option<Sampling>,
}

impl<'a> File<'a> {
    fn new(bytes: &'a [u8], limits: &Limits) -> std::result::Result<Self, Refusal> {
        let (sampling, bytes) = match Sampling::of(bytes) {
            Some((sampling, even)) => (Some(sampling), Cow::Owned(even)),
            None => (None, Cow::Borrowed(bytes)),
        };
        let meta = check(&*bytes, bytes.len() as u64, limits)?;
        if let (Some(sampling), [header]) = (&sampling, &meta.headers[..]) {
            sampling.check(header)?;
        } else if sampling.is_some() {
            return Err(Refusal::Unsupported(
                "unsupported EXR: subsampled channels in one of several parts".into(),
            ));
        }
        Ok(Self {
            bytes,
            meta,
            sampling,
        })
    }

    /// The parts whose pixels have one sample for each channel.
    fn flat_parts(&self) -> impl Iterator<Item = usize> {
        self.meta
            .headers
            .iter()
            .enumerate()
            .filter(|(_, header)| !header.deep)
            .map(|(part, _)| part)
    }

    fn names(&self, part: usize) -> Vec<String> {
        self.meta.headers[part]
            .channels
            .list
            .iter()
            .map(|c| c.name.to_string())
            .collect()
    }

    /// What all parts are shown in.
    fn window(&self) -> IntegerBounds {
        self.meta.headers[0].shared_attributes.display_window
    }

    /// The primaries that are named, or ours.
    fn space(&self) -> RgbSpace {
        self.meta.headers[0]
            .shared_attributes
            .chromaticities
            .map_or(RgbSpace::REC709, space)
    }

    fn job<'j>(
        &'j self,
        part: usize,
        picked: &'j [usize],
        window: IntegerBounds,
        order: Order,
    ) -> std::result::Result<Job<'j>, String> {
        let (width, height) = size_of(window);
        affordable((width * height * picked.len()) as u64 * FLOAT)?;
        let (bytes, meta, sampling) = (&*self.bytes, &self.meta, self.sampling.as_ref());
        Ok(Job {
            bytes,
            meta,
            part,
            picked,
            window,
            order,
            sampling,
        })
    }
}

fn space(named: Chromaticities) -> RgbSpace {
    let xy = |v: Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
    RgbSpace {
        primaries: [named.red, named.green, named.blue].map(xy),
        white: xy(named.white),
    }
}

fn size_of(window: IntegerBounds) -> (usize, usize) {
    (window.size.x(), window.size.y())
}

/// The headers alone, checked against the limits: data and display window of every part, and their sum.
fn check(
    file: impl Read,
    file_bytes: u64,
    limits: &Limits,
) -> std::result::Result<MetaData, Refusal> {
    let meta =
        MetaData::read_from_buffered(BufReader::new(file.take(limits.metadata_bytes)), false);
    if meta.is_err() && file_bytes > limits.metadata_bytes {
        at_most(
            file_bytes,
            limits.metadata_bytes,
            "bytes without an end of the header",
            "metadata_bytes",
        )?;
    }
    let meta = meta?;
    at_most(meta.headers.len() as u64, limits.parts, "parts", "parts")?;
    let mut total = 0_u64;
    for header in &meta.headers {
        let channels = header.channels.list.len() as u64;
        let bytes_per_pixel = header
            .channels
            .list
            .iter()
            .map(|c| c.sample_type.bytes_per_sample() as u64)
            .sum();
        for size in [
            header.layer_size,
            header.shared_attributes.display_window.size,
        ] {
            let (width, height) = (size.x() as u64, size.y() as u64);
            limits.check(Demand {
                width,
                height,
                channels,
                bytes_per_pixel,
                file_bytes,
            })?;
        }
        total += header.layer_size.area() as u64 * bytes_per_pixel;
    }
    at_most(
        total,
        limits.decoded_bytes,
        "decoded bytes",
        "decoded_bytes",
    )?;
    if meta.headers.iter().all(|h| h.deep) {
        return Err(Refusal::Unsupported(
            "deep EXR, expected flat pixels".into(),
        ));
    }
    Ok(meta)
}

/// Bytes of a sample as it is kept.
const FLOAT: u64 = 4;

/// More than the attributes of a file take that says where its channels have fewer samples than pixels.
const FIRST_BYTES: u64 = 1 << 16;

pub(super) fn header(
    mut file: impl Read,
    file_bytes: u64,
    limits: &Limits,
) -> std::result::Result<Header, Refusal> {
    let mut start = Vec::new();
    file.by_ref()
        .take(FIRST_BYTES)
        .read_to_end(&mut start)
        .map_err(exr::error::Error::from)?;
    let start = Sampling::of(&start).map_or(start, |(_, even)| even);
    let meta = check(start.chain(file), file_bytes, limits)?;
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
        bits: list
            .iter()
            .map(|c| 8 * c.sample_type.bytes_per_sample() as u32)
            .max()
            .unwrap_or(0),
        data_at: [
            at(position.x(), shown.position.x()),
            at(position.y(), shown.position.y()),
        ],
        data_size: [first.layer_size.x(), first.layer_size.y()],
        metadata: texts(first),
        ..Header::default()
    })
}

/// `R G B A` first, the rest by name.
fn in_usual_order(mut names: Vec<String>) -> Vec<String> {
    names.sort_by_key(|n| {
        (
            "RGBA"
                .find(n.as_str())
                .filter(|_| n.len() == 1)
                .unwrap_or(4),
            n.clone(),
        )
    });
    names
}

fn texts(header: &exr::meta::header::Header) -> Notes {
    use exr::meta::attribute::AttributeValue;
    let all = header
        .own_attributes
        .other
        .iter()
        .chain(&header.shared_attributes.other);
    let mut notes: Notes = all
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            _ => None,
        })
        .collect();
    notes.sort();
    notes
}

/// The wanted channels of the part that has them under the best names.
pub(super) fn decode(
    bytes: &[u8],
    limits: &Limits,
    wanted: Wanted,
    shown: Window,
) -> std::result::Result<Raster, Refusal> {
    let file = File::new(bytes, limits)?;
    let choices = file
        .flat_parts()
        .map(|part| (part, choose(wanted, &file.names(part))));
    let best = choices.min_by_key(|(_, choice)| {
        choice
            .as_ref()
            .ok()
            .map_or((true, None), |(fit, _)| (false, Some(*fit)))
    });
    let (part, choice) = best.ok_or("no part with pixels")?;
    let (_, mut picked) = choice?;
    picked.dedup();
    let header = &file.meta.headers[part];
    let window = match shown {
        Window::Display => file.window(),
        Window::Data => IntegerBounds::new(header.own_attributes.layer_position, header.layer_size),
    };
    let ((width, height), n) = (size_of(window), picked.len());
    limits.room(width, height, n)?;
    let all = file.names(part);
    let mut names: Vec<String> = picked.iter().map(|&i| all[i].clone()).collect();
    let mut samples = file
        .job(part, &picked, window, Order::Interleaved)?
        .read()?;
    if matches!(wanted, Wanted::Color | Wanted::Film) && n >= 3 {
        let space = file.space();
        if names.starts_with(&LUMINANCE_CHROMA.map(String::from)) {
            to_rgb(&mut samples, n, &space);
            names.splice(..3, ["R", "G", "B"].map(String::from));
        }
        if let Some(matrix) = to_rec709(&space)? {
            convert(&mut samples, n, &matrix);
        }
    }
    Ok(Raster {
        width,
        height,
        names,
        samples: Samples::F32(samples),
        display_encoded: false,
        premultiplied: true,
    })
}

/// Luminance with its differences where there are those, and what is chosen of other channels elsewhere.
fn choose(wanted: Wanted, names: &[String]) -> std::result::Result<(Fit, Vec<usize>), String> {
    let at = |name: &str| names.iter().position(|n| n == name);
    let chroma = LUMINANCE_CHROMA
        .into_iter()
        .map(at)
        .collect::<Option<Vec<_>>>();
    match (wanted, chroma) {
        (Wanted::Color | Wanted::Film, Some(picked)) => {
            Ok((Fit::Named, picked.into_iter().chain(at("A")).collect()))
        }
        _ => wanted.choose(names),
    }
}

/// The first three of `n` interleaved channels in other primaries; alpha does not mind.
fn convert(samples: &mut [f32], n: usize, matrix: &ColorMatrix) {
    for px in samples.chunks_exact_mut(n) {
        let color = matrix.apply([px[0], px[1], px[2]]);
        px[..3].copy_from_slice(&color);
    }
}

/// The part of `0..shown` that a run of `length` samples starting at `start` covers.
pub(super) fn overlap(start: i64, length: usize, shown: usize) -> std::ops::Range<usize> {
    let clip = |v: i64| v.clamp(0, shown as i64) as usize;
    clip(start)..clip(start + length as i64)
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
    let text = |s: &str| {
        Text::new_or_none(s).ok_or_else(|| format!("{s:?} cannot stand in an EXR (not Latin-1)"))
    };
    let mut list = exr::prelude::SmallVec::new();
    for (name, samples) in planes {
        if samples.len() != width * height {
            return Err(format!(
                "channel {name}: {} samples, expected {width} x {height}",
                samples.len()
            ));
        }
        list.push(AnyChannel::new(text(name)?, samples));
    }
    let mut attributes = LayerAttributes::default();
    for (key, value) in metadata {
        attributes.other.insert(
            text(key)?,
            exr::meta::attribute::AttributeValue::Text(text(value)?),
        );
    }
    let encoding = Encoding {
        compression: compression.of_exr(),
        ..Encoding::SMALL_LOSSLESS
    };
    let layer = Layer::new(
        Vec2(width, height),
        attributes,
        encoding,
        AnyChannels::sort(list),
    );
    let mut out = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer)
        .write()
        .to_buffered(&mut out)
        .map_err(|e| e.to_string())?;
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
        (0..n)
            .map(|i| (format!("petcomp:{i}"), format!("value {i}")))
            .collect()
    }

    #[test]
    fn attributes_are_in_the_order_of_their_names() {
        let file = || {
            encode(
                (2, 1),
                vec![("Z", floats(vec![1.0, 2.0]))],
                Compression::Zip,
                &notes(12),
            )
            .unwrap()
        };
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
        let list = [
            plane("R", 0.322_761),
            plane("G", 0.482_919),
            plane("B", 0.841_329),
        ]
        .into_iter()
        .collect();
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
            decode(
                out.get_ref(),
                &Limits::default(),
                Wanted::Color,
                Window::Display,
            )
        };
        let Samples::F32(rgb) = read(&image).unwrap().samples else {
            panic!("not floats")
        };
        for (v, expected) in rgb.iter().zip([0.18, 0.5, 0.9]) {
            assert!((v - expected).abs() < 1e-4, "{rgb:?}");
        }
        let third = 1.0 / 3.0;
        image.attributes.chromaticities = Some(Chromaticities {
            red: xy(1.0, 0.0),
            green: xy(0.0, 1.0),
            blue: xy(0.0, 0.0),
            white: xy(third, third),
        });
        assert!(read(&image).is_ok(), "CIE XYZ");
        image.attributes.chromaticities = Some(Chromaticities {
            red: xy(0.0, 0.0),
            ..image.attributes.chromaticities.unwrap()
        });
        image.attributes.chromaticities.as_mut().unwrap().white = xy(0.3, 0.0);
        assert!(
            read(&image)
                .unwrap_err()
                .to_string()
                .contains("expected those of a colour space")
        );
    }

    #[test]
    fn a_data_window_is_cut_and_padded_to_the_display_window() {
        let mut layer = Layer::new(
            Vec2(2, 2),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(
                [AnyChannel::new("Y", floats(vec![1.0, 2.0, 3.0, 4.0]))]
                    .into_iter()
                    .collect(),
            ),
        );
        layer.attributes.layer_position = Vec2(-1, 1);
        let mut image = exr::prelude::Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::from_dimensions(Vec2(2, 3));
        let mut out = Cursor::new(Vec::new());
        image.write().to_buffered(&mut out).unwrap();
        let raster = decode(
            out.get_ref(),
            &Limits::default(),
            Wanted::Coverage,
            Window::Display,
        )
        .unwrap();
        assert_eq!((raster.width, raster.height), (2, 3));
        assert_eq!(
            raster.samples,
            Samples::F32(vec![0.0, 0.0, 2.0, 0.0, 4.0, 0.0])
        );
        let kept = decode(
            out.get_ref(),
            &Limits::default(),
            Wanted::Coverage,
            Window::Data,
        )
        .unwrap();
        assert_eq!(
            (kept.width, kept.height, kept.samples),
            (2, 2, Samples::F32(vec![1.0, 2.0, 3.0, 4.0]))
        );
        let told = header(out.get_ref().as_slice(), 1_000, &Limits::default()).unwrap();
        assert_eq!(
            (told.width, told.height, told.data_at, told.data_size),
            (2, 3, [-1, 1], [2, 2])
        );
    }
}
