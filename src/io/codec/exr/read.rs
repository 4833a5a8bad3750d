//! Headers and pixels of EXR files.

use super::attributes::string_of;
use super::blocks::{PartReader, SampleOrder, offset};
use super::chroma::{LUMINANCE_CHROMA, Sampling, to_rgb};
use crate::color::RgbSpace;
use crate::io::codec::channels::{ChannelMatch, Choice, Wanted, is_finished};
use crate::io::codec::profile::{convert_primaries, to_rec709};
use crate::io::codec::raster::{Raster, Samples, overlap};
use crate::io::codec::refusal::Refusal;
use crate::io::format::Format;
use crate::io::header::{Canvas, Header, Notes, Window};
use crate::io::limits::{Demand, Limits, affordable, at_most};
use exr::meta::attribute::{AttributeValue, ChannelList, Chromaticities};
use exr::prelude::{IntegerBounds, MetaData, Vec2};
use std::borrow::Cow;
use std::io::{BufReader, Read};
use std::ops::Range;

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

/// A channel of an EXR file under its full name, cropped or padded to the display window.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// `R`, `diffuse.G`, `Z`, ...
    pub name: String,
    /// Samples row by row from the top, one per pixel.
    pub samples: Vec<f32>,
}

/// Every channel of the first part, and the picture's size.
pub(crate) fn channels(
    bytes: &[u8],
    limits: &Limits,
) -> Result<((usize, usize), Vec<Channel>), Refusal> {
    let file = CheckedFile::new(bytes, limits)?;
    let part = flat_parts(&file.meta).next().ok_or("no part with pixels")?;
    let names = listed_names(&file.meta.headers[part].channels);
    let (width, height) = window_size(file.window());
    limits.check_memory(width, height, names.len())?;
    let picked: Vec<usize> = (0..names.len()).collect();
    let reader = file.reader(part, &picked, file.window(), SampleOrder::Planar)?;
    let samples = reader.read()?;
    let planes = samples.chunks_exact(width * height);
    let channels = names.into_iter().zip(planes).map(|(name, plane)| Channel {
        name,
        samples: plane.to_vec(),
    });
    Ok(((width, height), channels.collect()))
}

/// A file with checked headers.
struct CheckedFile<'a> {
    bytes: Cow<'a, [u8]>,
    meta: MetaData,
    sampling: Option<Sampling>,
}

impl<'a> CheckedFile<'a> {
    fn new(bytes: &'a [u8], limits: &Limits) -> Result<Self, Refusal> {
        let (sampling, bytes) = match Sampling::find(bytes) {
            Some((sampling, even)) => (Some(sampling), Cow::Owned(even)),
            None => (None, Cow::Borrowed(bytes)),
        };
        let meta = read_meta(&*bytes, bytes.len() as u64, limits)?;
        if let Some(sampling) = &sampling {
            check_sampling(sampling, &meta)?;
        }
        Ok(Self {
            bytes,
            meta,
            sampling,
        })
    }

    fn picked_names(&self, part: usize, picked: &[usize]) -> Vec<String> {
        let list = &self.meta.headers[part].channels.list;
        picked.iter().map(|&i| string_of(&list[i].name)).collect()
    }

    /// The display window of all parts.
    fn window(&self) -> IntegerBounds {
        self.meta.headers[0].shared_attributes.display_window
    }

    /// The requested window of a part.
    fn window_of(&self, part: usize, shown: Window) -> IntegerBounds {
        match shown {
            Window::Display => self.window(),
            Window::Data => data_window(&self.meta.headers[part]),
        }
    }

    /// Columns and rows of a window that a part stores.
    fn stored_in(&self, part: usize, window: IntegerBounds) -> [Range<usize>; 2] {
        let stored = data_window(&self.meta.headers[part]);
        let [left, top] = offset(stored.position, window.position);
        [
            overlap(left, stored.size.x(), window.size.x()),
            overlap(top, stored.size.y(), window.size.y()),
        ]
    }

    /// The primaries in the file, or Rec. 709.
    fn space(&self) -> RgbSpace {
        self.meta.headers[0]
            .shared_attributes
            .chromaticities
            .map_or(RgbSpace::REC709, named_space)
    }

    fn reader<'r>(
        &'r self,
        part: usize,
        picked: &'r [usize],
        window: IntegerBounds,
        order: SampleOrder,
    ) -> Result<PartReader<'r>, String> {
        let (width, height) = window_size(window);
        affordable((width * height * picked.len()) as u64 * FLOAT_BYTES)?;
        Ok(PartReader {
            bytes: &self.bytes,
            meta: &self.meta,
            part,
            picked,
            window,
            order,
            sampling: self.sampling.as_ref(),
        })
    }
}

/// The parts with one sample per pixel and channel (not deep).
fn flat_parts(meta: &MetaData) -> impl Iterator<Item = usize> {
    let parts = meta.headers.iter().enumerate();
    parts
        .filter(|(_, header)| !header.deep)
        .map(|(part, _)| part)
}

/// The part whose wanted channels have the best names, for colours preferably the finished picture,
/// and their indices without duplicates.
fn best_part(meta: &MetaData, wanted: Wanted) -> Result<(usize, Vec<usize>), Refusal> {
    let choices = flat_parts(meta).map(|part| {
        let names = listed_names(&meta.headers[part].channels);
        (part, choose_channels(wanted, &names))
    });
    let best = choices.min_by_key(|(part, choice)| {
        let is_first = wanted.is_color() && is_finished_part(&meta.headers[*part]);
        (rank_of(choice), !is_first)
    });
    let (part, choice) = best.ok_or("no part with pixels")?;
    let (_, mut picked) = choice?;
    picked.dedup();
    Ok((part, picked))
}

/// Whether the part's name identifies it as the finished picture.
fn is_finished_part(header: &exr::meta::header::Header) -> bool {
    is_finished(&part_name(header))
}

/// A part's name; empty if it has none.
fn part_name(header: &exr::meta::header::Header) -> String {
    let name = header.own_attributes.layer_name.as_ref();
    name.map(string_of).unwrap_or_default()
}

/// Parts without the channels come last: their error is returned if no part has the channels.
fn rank_of(choice: &Result<Choice, String>) -> (bool, Option<ChannelMatch>) {
    match choice {
        Ok((quality, _)) => (false, Some(*quality)),
        Err(_) => (true, None),
    }
}

fn check_sampling(sampling: &Sampling, meta: &MetaData) -> Result<(), Refusal> {
    match &meta.headers[..] {
        [header] => sampling.check(header),
        _ => Err(Refusal::Unsupported(
            "unsupported EXR: subsampled channels in one of several parts".into(),
        )),
    }
}

fn named_space(named: Chromaticities) -> RgbSpace {
    RgbSpace {
        primaries: [named.red, named.green, named.blue].map(xy),
        white: xy(named.white),
    }
}

fn xy(v: Vec2<f32>) -> [f64; 2] {
    [f64::from(v.x()), f64::from(v.y())]
}

fn window_size(window: IntegerBounds) -> (usize, usize) {
    (window.size.x(), window.size.y())
}

/// The headers alone, checked against the limits: the data and display window of every part, and
/// their sum.
fn read_meta(file: impl Read, file_bytes: u64, limits: &Limits) -> Result<MetaData, Refusal> {
    let meta = read_limited_meta(file, file_bytes, limits)?;
    at_most(meta.headers.len() as u64, limits.parts, "parts", "parts")?;
    let mut total = 0_u64;
    for header in &meta.headers {
        total += checked_part_bytes(header, file_bytes, limits)?;
    }
    let most = limits.decoded_bytes;
    at_most(total, most, "decoded bytes", "decoded_bytes")?;
    if meta.headers.iter().all(|h| h.deep) {
        let what = "deep EXR, expected flat pixels";
        return Err(Refusal::Unsupported(what.into()));
    }
    Ok(meta)
}

/// The headers, read from at most as many bytes as the metadata limit allows.
fn read_limited_meta(
    file: impl Read,
    file_bytes: u64,
    limits: &Limits,
) -> Result<MetaData, Refusal> {
    let most = limits.metadata_bytes;
    let meta = MetaData::read_from_buffered(BufReader::new(file.take(most)), false);
    if meta.is_err() {
        limits.check_header_bytes(file_bytes)?;
    }
    Ok(meta?)
}

/// Decoded bytes of a part, checked against the limits.
fn checked_part_bytes(
    header: &exr::meta::header::Header,
    file_bytes: u64,
    limits: &Limits,
) -> Result<u64, String> {
    let list = &header.channels.list;
    let bytes_per_pixel = list
        .iter()
        .map(|c| c.sample_type.bytes_per_sample() as u64)
        .sum();
    let display_window = header.shared_attributes.display_window;
    for size in [header.layer_size, display_window.size] {
        limits.check(Demand {
            width: size.x() as u64,
            height: size.y() as u64,
            channels: list.len() as u64,
            bytes_per_pixel,
            file_bytes,
        })?;
    }
    Ok(header.layer_size.area() as u64 * bytes_per_pixel)
}

/// Bytes of a sample in memory.
const FLOAT_BYTES: u64 = 4;

/// More than the attributes take in a file whose channels have fewer samples than pixels.
const FIRST_BYTES: u64 = 1 << 16;

pub(crate) fn header(
    mut file: impl Read,
    file_bytes: u64,
    limits: &Limits,
) -> Result<Header, Refusal> {
    let start = read_start(&mut file)?;
    let meta = read_meta(start.as_slice().chain(file), file_bytes, limits)?;
    let first = meta.headers.first().ok_or("no part with pixels")?;
    let (width, height) = window_size(first.shared_attributes.display_window);
    let read = best_part(&meta, Wanted::Color).map_or(0, |(part, _)| part);
    let colored = &meta.headers[read];
    Ok(Header {
        format: Format::Exr,
        width,
        height,
        canvas: canvas(first),
        channels: in_default_order(listed_names(&colored.channels)),
        parts: names_of_several(&meta, read),
        bits: 8 * widest_sample(&colored.channels) as u32,
        data_at: data_offset(colored),
        data_size: [colored.layer_size.x(), colored.layer_size.y()],
        metadata: text_attributes(first),
        ..Header::default()
    })
}

/// The names of the parts of a multi-part file, starting with that of part `before`.
fn names_of_several(meta: &MetaData, before: usize) -> Vec<String> {
    let mut names: Vec<String> = match &meta.headers[..] {
        [_] => Vec::new(),
        several => several.iter().map(part_name).collect(),
    };
    if let Some(until) = names.get_mut(..=before) {
        until.rotate_right(1);
    }
    names
}

/// The first bytes, modified to declare one sample per pixel for every channel.
fn read_start(file: &mut impl Read) -> Result<Vec<u8>, Refusal> {
    let mut start = Vec::new();
    let read = file.take(FIRST_BYTES).read_to_end(&mut start);
    read.map_err(exr::error::Error::from)?;
    Ok(Sampling::find(&start).map_or(start, |(_, even)| even))
}

fn listed_names(channels: &ChannelList) -> Vec<String> {
    let list = channels.list.iter();
    list.map(|channel| string_of(&channel.name)).collect()
}

/// Bytes of the largest sample type.
fn widest_sample(channels: &ChannelList) -> usize {
    let list = channels.list.iter();
    let bytes = list.map(|channel| channel.sample_type.bytes_per_sample());
    bytes.max().unwrap_or(0)
}

fn data_window(header: &exr::meta::header::Header) -> IntegerBounds {
    IntegerBounds::new(header.own_attributes.layer_position, header.layer_size)
}

fn canvas(header: &exr::meta::header::Header) -> Canvas {
    let shared = &header.shared_attributes;
    let shown = shared.display_window.position;
    Canvas {
        at: [shown.x(), shown.y()],
        pixel_aspect: writable_aspect(shared.pixel_aspect),
        ..Canvas::default()
    }
}

/// A file whose pixel aspect cannot be written is treated as having square pixels.
fn writable_aspect(aspect: f32) -> f32 {
    if (1e-6..=1e6).contains(&aspect) {
        aspect
    } else {
        1.0
    }
}

/// Column and row of the first stored pixel in the display window.
fn data_offset(header: &exr::meta::header::Header) -> [i64; 2] {
    let shown = header.shared_attributes.display_window.position;
    offset(header.own_attributes.layer_position, shown)
}

/// `R G B A` first, the rest by name.
fn in_default_order(mut names: Vec<String>) -> Vec<String> {
    names.sort_by_key(|name| (rank_in_rgba(name), name.clone()));
    names
}

fn rank_in_rgba(name: &str) -> usize {
    let rank = "RGBA".find(name).filter(|_| name.len() == 1);
    rank.unwrap_or(4)
}

fn text_attributes(header: &exr::meta::header::Header) -> Notes {
    let own = header.own_attributes.other.iter();
    let all = own.chain(&header.shared_attributes.other);
    let mut notes: Notes = all
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((string_of(name), string_of(text))),
            _ => None,
        })
        .collect();
    notes.sort();
    notes
}

/// The wanted channels of the part in which they have the best names.
pub(crate) fn decode(
    bytes: &[u8],
    limits: &Limits,
    wanted: Wanted,
    shown: Window,
) -> Result<Raster, Refusal> {
    let file = CheckedFile::new(bytes, limits)?;
    let (part, picked) = best_part(&file.meta, wanted)?;
    let window = file.window_of(part, shown);
    let (width, height) = window_size(window);
    limits.check_memory(width, height, picked.len())?;
    let mut names = file.picked_names(part, &picked);
    let reader = file.reader(part, &picked, window, SampleOrder::Interleaved)?;
    let mut samples = reader.read()?;
    if wanted.is_color() && picked.len() >= 3 {
        convert_colors(&mut samples, &mut names, &file.space())?;
    }
    let stored = file.stored_in(part, window);
    if stored != [0..width, 0..height] {
        let ones: Vec<bool> = names
            .iter()
            .map(|name| wanted.is_one_where_empty(name))
            .collect();
        if ones.contains(&true) {
            fill_empty(&mut samples, &ones, width, &stored);
        }
        if let Some(extended) = wanted.with_alpha(&names) {
            limits.check_memory(width, height, extended.len())?;
            affordable((width * height * extended.len()) as u64 * FLOAT_BYTES)?;
            samples = add_alpha(&samples, names.len(), width, &stored);
            names = extended;
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

/// Sets the channels marked in `ones` to 1 outside the stored columns and rows.
fn fill_empty(
    samples: &mut [f32],
    ones: &[bool],
    width: usize,
    [columns, rows]: &[Range<usize>; 2],
) {
    let pixels = samples.chunks_exact_mut(ones.len()).enumerate();
    let is_empty = |i: usize| !(columns.contains(&(i % width)) && rows.contains(&(i / width)));
    for (_, pixel) in pixels.filter(|(i, _)| is_empty(*i)) {
        let filled = pixel.iter_mut().zip(ones).filter(|(_, is_one)| **is_one);
        filled.for_each(|(sample, _)| *sample = 1.0);
    }
}

/// Appends an alpha to the samples of each pixel: 1 in the stored columns and rows, 0 elsewhere.
fn add_alpha(
    samples: &[f32],
    channels: usize,
    width: usize,
    [columns, rows]: &[Range<usize>; 2],
) -> Vec<f32> {
    let mut out = Vec::with_capacity(samples.len() / channels * (channels + 1));
    for (i, pixel) in samples.chunks_exact(channels).enumerate() {
        let is_stored = columns.contains(&(i % width)) && rows.contains(&(i / width));
        out.extend_from_slice(pixel);
        out.push(f32::from(u8::from(is_stored)));
    }
    out
}

/// Luminance and chroma if present, otherwise the channels that `wanted` chooses.
fn choose_channels(wanted: Wanted, names: &[String]) -> Result<Choice, String> {
    match (wanted, luminance_chroma(names)) {
        (Wanted::Color | Wanted::Film, Some(picked)) => Ok((ChannelMatch::Named, picked)),
        _ => wanted.choose(names),
    }
}

/// Luminance, chroma, and alpha if present.
fn luminance_chroma(names: &[String]) -> Option<Vec<usize>> {
    let [y, ry, by] = LUMINANCE_CHROMA.map(|name| index_of(names, name));
    let alpha = index_of(names, "A");
    Some([y?, ry?, by?].into_iter().chain(alpha).collect())
}

fn index_of(names: &[String], name: &str) -> Option<usize> {
    names.iter().position(|other| other == name)
}

/// Converts the first three channels to red, green and blue of Rec. 709.
fn convert_colors(
    samples: &mut [f32],
    names: &mut Vec<String>,
    space: &RgbSpace,
) -> Result<(), String> {
    let n = names.len();
    if names.starts_with(&LUMINANCE_CHROMA.map(String::from)) {
        to_rgb(samples, n, space);
        names.splice(..3, ["R", "G", "B"].map(String::from));
    }
    if let Some(matrix) = to_rec709(space)? {
        convert_primaries(samples, n, &matrix);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::codec::exr::{Compression, encode};
    use crate::pixel::{Film, LinearRgb};
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, WritableImage,
    };
    use std::io::Cursor;

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
                Canvas::default(),
                vec![("Z", FlatSamples::F32(vec![1.0, 2.0]))],
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
    fn texts_are_utf_8() {
        let (channel, key, value) = ("grün.Z", "petcomp:größe", "grün, 瓶子");
        let notes = vec![(key.to_owned(), value.to_owned())];
        let planes = vec![(channel, FlatSamples::F32(vec![1.0]))];
        let file = encode((1, 1), Canvas::default(), planes, Compression::None, &notes).unwrap();
        for text in [channel, key, value] {
            let mut places = file.windows(text.len());
            assert!(places.any(|bytes| bytes == text.as_bytes()), "{text}");
        }
        let read = header(file.as_slice(), 10_000, &Limits::default()).unwrap();
        assert_eq!(
            (read.channels, read.metadata),
            (vec![channel.to_owned()], notes)
        );
    }

    #[test]
    fn a_picture_is_read_where_it_was_placed() {
        let canvas = Canvas {
            at: [-3, 7],
            pixel_aspect: 2.0,
            ..Canvas::default()
        };
        let planes = vec![("Z", FlatSamples::F32(vec![1.0, 2.0]))];
        let file = encode((2, 1), canvas, planes, Compression::Zip, &[]).unwrap();
        let read = header(file.as_slice(), 10_000, &Limits::default()).unwrap();
        assert_eq!((read.canvas, read.data_at), (canvas, [0, 0]));
        let (size, planes) = channels(&file, &Limits::default()).unwrap();
        assert_eq!((size, &planes[0].samples[..]), ((2, 1), &[1.0, 2.0][..]));
    }

    #[test]
    fn names_come_in_the_default_order() {
        let names = ["A", "B", "G", "N.X", "R", "Z"].map(String::from).to_vec();
        assert_eq!(in_default_order(names), ["R", "G", "B", "A", "N.X", "Z"]);
    }

    /// ACEScg (0.322761, 0.482919, 0.841329) is Rec. 709 (0.18, 0.5, 0.9), by colour-science.
    #[test]
    fn other_primaries_become_ours() {
        let plane = |name, v: f32| AnyChannel::new(name, FlatSamples::F32(vec![v]));
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
                [AnyChannel::new(
                    "Y",
                    FlatSamples::F32(vec![1.0, 2.0, 3.0, 4.0]),
                )]
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
        let reported = header(out.get_ref().as_slice(), 1_000, &Limits::default()).unwrap();
        assert_eq!(
            (
                reported.width,
                reported.height,
                reported.data_at,
                reported.data_size
            ),
            (2, 3, [-1, 1], [2, 2])
        );
    }

    type FilePart = Layer<AnyChannels<FlatSamples>>;

    /// A part with a single value, stored in this many pixels from the first of the display window on.
    fn part(name: &str, channels: &[&str], (width, height): (usize, usize)) -> FilePart {
        let plane = || FlatSamples::F32(vec![0.5; width * height]);
        let planes = channels.iter().map(|&name| AnyChannel::new(name, plane()));
        Layer::new(
            Vec2(width, height),
            LayerAttributes::named(name),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(planes.collect()),
        )
    }

    /// A file with a display window of 2 x 1 pixels.
    fn file_of(parts: Vec<FilePart>) -> Vec<u8> {
        let shown = IntegerBounds::from_dimensions(Vec2(2, 1));
        let attributes = exr::prelude::ImageAttributes::new(shown);
        let image = exr::prelude::Image::from_layers(attributes, parts);
        let mut out = Cursor::new(Vec::new());
        image.write().to_buffered(&mut out).unwrap();
        out.into_inner()
    }

    #[test]
    fn colours_without_alpha_are_transparent_where_nothing_is_stored() {
        let read = |channels: &[&str], size, shown| {
            let file = file_of(vec![part("a", channels, size)]);
            let raster = decode(&file, &Limits::default(), Wanted::Color, shown).unwrap();
            let Samples::F32(samples) = raster.samples else {
                panic!("not floats")
            };
            (raster.names.join(" "), samples)
        };
        let [display, data] = [Window::Display, Window::Data];
        let half = 0.5_f32;
        let (names, samples) = read(&["R", "G", "B"], (1, 1), display);
        assert_eq!(names.split(' ').count(), 4);
        assert_eq!(samples, [half, half, half, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let grey = read(&["Y"], (1, 1), display);
        assert_eq!(grey, ("Y A".into(), vec![half, 1.0, 0.0, 0.0]));
        let layer = read(&["d.R", "d.G", "d.B"], (1, 1), display);
        assert!(layer.0.ends_with("d.A"), "{}", layer.0);
        // Either nothing is missing, or there is already an alpha, or no other channel.
        assert_eq!(read(&["R", "G", "B"], (2, 1), display).1, [half; 6]);
        assert_eq!(read(&["R", "G", "B"], (1, 1), data).1, [half; 3]);
        assert_eq!(read(&["Y", "A"], (1, 1), display).1, [half, half, 0.0, 0.0]);
        assert_eq!(read(&["A"], (1, 1), display), ("A".into(), vec![half, 0.0]));
    }

    #[test]
    fn a_film_passes_all_light_where_nothing_is_stored() {
        for names in ["VR VG VB", "TR TG TB"] {
            let channels: Vec<&str> = "R G B A".split(' ').chain(names.split(' ')).collect();
            let file = file_of(vec![part("a", &channels, (1, 1))]);
            let read = decode(&file, &Limits::default(), Wanted::Film, Window::Display);
            let film = read.unwrap().into_image::<Film>(None).unwrap();
            let half = LinearRgb::grey(0.5);
            assert_eq!(film.pixels(), [Film::new(half, half), Film::default()]);
        }
    }

    #[test]
    fn a_header_tells_what_is_stored_of_the_part_that_is_read() {
        let file = file_of(vec![
            part("depth", &["Z"], (2, 1)),
            part("rgba", &["R", "G", "B"], (5, 3)),
        ]);
        let read = header(file.as_slice(), 10_000, &Limits::default()).unwrap();
        assert_eq!((read.width, read.height), (2, 1));
        assert_eq!((read.data_at, read.data_size), ([0, 0], [5, 3]));
        assert_eq!(read.channels, ["R", "G", "B"]);
        assert_eq!(read.parts, ["rgba", "depth"]);
    }

    #[test]
    fn a_part_of_a_picture_lies_in_the_display_window_of_the_whole() {
        let canvas = Canvas {
            at: [-2, 8],
            display: Some(([-3, 7], [4, 3])),
            ..Canvas::default()
        };
        let planes = vec![("Z", FlatSamples::F32(vec![1.0, 2.0]))];
        let file = encode((2, 1), canvas, planes, Compression::Zip, &[]).unwrap();
        let read = header(file.as_slice(), 10_000, &Limits::default()).unwrap();
        assert_eq!((read.canvas.at, read.width, read.height), ([-3, 7], 4, 3));
        assert_eq!((read.data_at, read.data_size), ([1, 1], [2, 1]));
    }
}
