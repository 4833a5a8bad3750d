//! OpenImageIO and libheif in this process: shapes and samples of files in memory, and writing
//! pictures.

use super::ffi::{self, Layout};
use super::protocol::{Request, Response, Shape};
use crate::color::Curve;
use crate::io::codec::codes::Bits;
use crate::io::codec::raster::{Raster, SampleKind, Samples, overlap};
use crate::io::codec::refusal::Refusal;
use crate::io::codec::{Wanted, heif};
use crate::io::format::Format;
use crate::io::header::Window;
use crate::io::limits::{Demand, Limits, affordable};
use crate::io::source::SourceFile;
use cxx::UniquePtr;
use half::f16;
use std::ops::Range;
use std::sync::OnceLock;

/// All libraries that it was built with, for display.
pub(crate) fn libraries() -> String {
    format!("OpenImageIO {}, {}", ffi::version(), ffi::heif_version())
}

/// Answers a request about a file.
pub(crate) fn answer(
    source: &SourceFile,
    limits: &Limits,
    request: Request,
) -> Result<Response, Refusal> {
    match request {
        Request::Header => shape(source, limits).map(Response::Shape),
        Request::Pixels { wanted, window } => {
            decode(source, limits, wanted, window, |_, _| Ok(())).map(Response::Raster)
        }
    }
}

/// Runs once per process; a failed start is not repeated.
pub(crate) fn start() -> Result<(), Refusal> {
    static STARTED: OnceLock<Result<(), String>> = OnceLock::new();
    STARTED
        .get_or_init(|| ffi::start().map_err(|e| e.what().to_owned()))
        .clone()
        .map_err(Refusal::Broken)
}

/// The shape of a picture, without its samples.
pub(crate) fn shape(source: &SourceFile, limits: &Limits) -> Result<Shape, Refusal> {
    let (_, layout) = open(source, limits)?;
    Ok(layout.shape(&layout.channels))
}

/// Samples as stored in the file, in the requested window; `prepare` gets their shape and size in
/// bytes before they are read.
pub(crate) fn decode(
    source: &SourceFile,
    limits: &Limits,
    wanted: Wanted,
    window: Window,
    prepare: impl FnOnce(Shape, u64) -> Result<(), Refusal>,
) -> Result<Raster, Refusal> {
    let (reader, mut layout) = open(source, limits)?;
    if window == Window::Data {
        layout.show_data_window();
    }
    let mut picked = wanted.pick(&layout.channels)?;
    // Grey is used three times for colour, but transferred once.
    picked.dedup();
    let shown = ShownChannels::new(&layout, picked, wanted);
    let (width, height) = (layout.width as usize, layout.height as usize);
    limits.check_memory(width, height, shown.names.len())?;
    let bytes = layout.larger_window_bytes(shown.names.len()) * working_copies(source.format);
    prepare(layout.shape(&shown.names), bytes)?;
    // Not earlier: a worker only has the memory for a picture once it is prepared.
    affordable(bytes)?;
    let samples = read_samples(source.format, &reader, &layout, &shown)?;
    let (samples, display_encoded) = interpret(samples, source.format, &layout.color_space)?;
    Ok(Raster {
        width,
        height,
        names: shown.names,
        samples,
        display_encoded,
        premultiplied: false,
    })
}

/// How many times the memory of a picture its decoder needs: libheif keeps its source for the
/// conversion, and the curves of film scans turn bytes into floats.
fn working_copies(format: Format) -> u64 {
    match format {
        Format::Heif => 3,
        Format::Dpx => 2,
        _ => 1,
    }
}

fn open<'a>(
    source: &'a SourceFile,
    limits: &Limits,
) -> Result<(UniquePtr<ffi::Reader<'a>>, Layout), Refusal> {
    start()?;
    // Used in messages, and opened by the few readers that support only files.
    let name = source.path.to_string_lossy();
    let refused = |e| refused(source.format, &e);
    let reader = ffi::open(&name, source.format.name(), &source.bytes).map_err(refused)?;
    let mut layout = ffi::layout(&reader).map_err(refused)?;
    if source.format == Format::Heif {
        layout.turn_to(heif::upright_size(&source.bytes));
    }
    layout.check(source.bytes.len() as u64, limits)?;
    Ok((reader, layout))
}

fn refused(format: Format, e: &cxx::Exception) -> Refusal {
    Refusal::Broken(format!("{}: {}", format.library(), e.what()))
}

impl Layout {
    /// The shape of a picture with these channels, as far as known before decoding.
    fn shape(&self, names: &[String]) -> Shape {
        Shape {
            width: self.width as usize,
            height: self.height as usize,
            names: names.to_vec(),
            sample: self.sample(),
            display_encoded: false,
        }
    }

    fn names_of(&self, picked: &[usize]) -> Vec<String> {
        picked.iter().map(|&i| self.channels[i].clone()).collect()
    }

    /// Whether nothing has to be cropped, padded or left out.
    fn is_shown_as_stored(&self, picked: &[usize]) -> bool {
        let data = (self.x, self.y, self.data_width, self.data_height);
        let shows_all = data == (0, 0, self.width, self.height);
        shows_all && picked.iter().copied().eq(0..self.channels.len())
    }

    fn check(&self, file_bytes: u64, limits: &Limits) -> Result<(), Refusal> {
        limits.check_bounds(self.demand([self.width, self.height], file_bytes))?;
        let data_size = [self.data_width, self.data_height];
        limits.check_bounds(self.demand(data_size, file_bytes))?;
        Ok(())
    }

    fn demand(&self, size: [i64; 2], file_bytes: u64) -> Demand {
        let size = size.map(|side| u64::try_from(side).unwrap_or(0));
        let channels = self.channels.len() as u64;
        Demand::new(size, channels, self.bytes.unsigned_abs(), file_bytes)
    }

    /// Swaps width and height if that gives the known size.
    fn turn_to(&mut self, known: Option<[i64; 2]>) {
        if known == Some([self.height, self.width]) {
            [self.width, self.height] = [self.height, self.width];
            [self.data_width, self.data_height] = [self.data_height, self.data_width];
        }
    }

    fn sample(&self) -> SampleKind {
        match (self.bytes, self.half) {
            (1, _) => SampleKind::U8,
            (2, false) => SampleKind::U16,
            (2, true) => SampleKind::F16,
            _ => SampleKind::F32,
        }
    }

    /// Makes the data window the visible one.
    fn show_data_window(&mut self) {
        (self.x, self.y) = (0, 0);
        (self.width, self.height) = (self.data_width, self.data_height);
    }

    /// Number of samples of all channels in the data window.
    fn data_samples(&self) -> usize {
        (self.data_width * self.data_height) as usize * self.channels.len()
    }

    /// Bytes of all channels, or of the visible ones if they are more, in the larger of the two
    /// windows, since one is cropped or padded to the other.
    fn larger_window_bytes(&self, shown_channels: usize) -> u64 {
        let pixels = (self.data_width * self.data_height).max(self.width * self.height);
        let channels = self.channels.len().max(shown_channels) as u64;
        pixels as u64 * channels * u64::from(self.bytes.unsigned_abs())
    }

    /// Index in the data window of a pixel of the display window that has data.
    #[inline]
    fn data_pixel(&self, x: usize, y: usize) -> usize {
        let row = (y as i64 - self.y) as usize;
        row * self.data_width as usize + (x as i64 - self.x) as usize
    }

    /// Rows and columns of the display window that have data.
    fn visible(&self) -> (Range<usize>, Range<usize>) {
        (
            overlap(self.y, self.data_height as usize, self.height as usize),
            overlap(self.x, self.data_width as usize, self.width as usize),
        )
    }
}

/// The channels of a picture that are used.
struct ShownChannels {
    /// Their indices in the file.
    picked: Vec<usize>,
    /// Their names; colours without alpha that are not stored everywhere have an alpha appended.
    names: Vec<String>,
    /// Which of them are 1 instead of 0 where nothing is stored.
    ones: Vec<bool>,
}

impl ShownChannels {
    fn new(layout: &Layout, picked: Vec<usize>, wanted: Wanted) -> Self {
        let all = (0..layout.height as usize, 0..layout.width as usize);
        let mut names = layout.names_of(&picked);
        if layout.visible() != all
            && let Some(extended) = wanted.with_alpha(&names)
        {
            names = extended;
        }
        let ones = names.iter().map(|name| wanted.is_one_where_empty(name));
        Self {
            ones: ones.collect(),
            picked,
            names,
        }
    }
}

fn read_samples(
    format: Format,
    reader: &ffi::Reader<'_>,
    layout: &Layout,
    shown: &ShownChannels,
) -> Result<Samples, Refusal> {
    let mut samples = Samples::zeroed(layout.sample(), layout.data_samples());
    ffi::read(reader, layout, samples.bytes_mut()).map_err(|e| refused(format, &e))?;
    Ok(match samples {
        Samples::U8(v) => Samples::U8(windowed(v, layout, shown, u8::MAX)),
        Samples::U16(v) => Samples::U16(windowed(v, layout, shown, u16::MAX)),
        Samples::F16(v) => Samples::F16(windowed(v, layout, shown, f16::ONE)),
        Samples::F32(v) => Samples::F32(windowed(v, layout, shown, 1.0)),
    })
}

/// The used channels, cropped or padded from the data window to the display window; `full`
/// represents 1.
fn windowed<T: Copy + Default>(
    samples: Vec<T>,
    layout: &Layout,
    shown: &ShownChannels,
    full: T,
) -> Vec<T> {
    let (width, height) = (layout.width as usize, layout.height as usize);
    let (stride, count) = (layout.channels.len(), shown.names.len());
    if layout.is_shown_as_stored(&shown.picked) {
        return samples;
    }
    let ones = shown.ones.iter();
    let empty: Vec<T> = ones
        .map(|&is_one| if is_one { full } else { T::default() })
        .collect();
    let mut out = empty.repeat(width * height);
    let (ys, xs) = layout.visible();
    for (x, y) in ys.flat_map(|y| xs.clone().map(move |x| (x, y))) {
        let pixel = &samples[layout.data_pixel(x, y) * stride..][..stride];
        let to = &mut out[(y * width + x) * count..][..count];
        // An alpha that the file lacks is 1 where something is stored.
        to.fill(full);
        copy_picked(to, pixel, &shown.picked);
    }
    out
}

#[inline]
fn copy_picked<T: Copy>(to: &mut [T], pixel: &[T], picked: &[usize]) {
    for (slot, &channel) in to.iter_mut().zip(picked) {
        *slot = pixel[channel];
    }
}

/// Samples with their meaning, and whether they are display-encoded: the rule of [`io`](crate::io)
/// for integers and floats, whereas film scans declare the meaning of their codes themselves, in
/// OpenImageIO's terms.
fn interpret(samples: Samples, format: Format, space: &str) -> Result<(Samples, bool), Refusal> {
    let is_scan = matches!(format, Format::Dpx | Format::Cineon);
    let is_integer = !samples.are_float();
    match space {
        "" | "sRGB" | "Undefined" | "User defined" => Ok((samples, is_integer)),
        _ if !is_scan => Ok((samples, is_integer)),
        "Linear" | "linear" => Ok((samples, false)),
        // All four have the curve of Rec. 709.
        "Rec709" | "SMPTE 274M" | "ITU-R 601-5 system B or G" | "ITU-R 601-5 system M" => {
            let light = decode_curve(samples, Curve::Rec709);
            Ok((Samples::F32(light), false))
        }
        other => Err(Refusal::Broken(format!(
            "colour space {other}, expected linear, sRGB or Rec709 (convert it first)"
        ))),
    }
}

/// Linear light of display values.
fn decode_curve(samples: Samples, curve: Curve) -> Vec<f32> {
    match samples {
        Samples::U8(v) => decoded(v, |code| curve.decode(f32::from(code) / 255.0)),
        Samples::U16(v) => decoded(v, |code| curve.decode(f32::from(code) / 65_535.0)),
        Samples::F16(v) => decoded(v, |value| curve.decode(value.into())),
        Samples::F32(v) => decoded(v, |value| curve.decode(value)),
    }
}

fn decoded<T>(samples: Vec<T>, light: impl Fn(T) -> f32) -> Vec<f32> {
    samples.into_iter().map(light).collect()
}

/// The layout of a picture to write.
pub(crate) fn written_layout(
    (width, height): (usize, usize),
    channels: &[&str],
    bits: Bits,
) -> Layout {
    let (width, height) = (width as i64, height as i64);
    Layout {
        width,
        height,
        x: 0,
        y: 0,
        data_width: width,
        data_height: height,
        channels: channels.iter().map(|&name| name.into()).collect(),
        bytes: match bits {
            Bits::Eight => 1,
            Bits::Sixteen => 2,
            Bits::Half | Bits::Float => 4,
        },
        half: bits == Bits::Half,
        premultiplied: matches!(bits, Bits::Half | Bits::Float),
        color_space: String::new(),
    }
}

/// Writes samples given in native byte order.
pub(crate) fn write_file(
    path: &str,
    format: Format,
    layout: &Layout,
    samples: &[u8],
    metadata: &[(String, String)],
) -> Result<(), Refusal> {
    let notes = metadata.iter().cloned();
    let notes: Vec<_> = notes.map(|(key, value)| ffi::Note { key, value }).collect();
    ffi::write(path, format.name(), layout, samples, &notes).map_err(|e| refused(format, &e))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Channels, their names joined, and samples of a picture of 2 x 1 pixels of which only the
    /// first is stored, each sample 7.
    fn padded(channels: &[&str], wanted: Wanted) -> (String, Vec<u8>) {
        let mut layout = written_layout((2, 1), channels, Bits::Eight);
        layout.data_width = 1;
        let picked = wanted.pick(&layout.channels).unwrap();
        let shown = ShownChannels::new(&layout, picked, wanted);
        let samples = windowed(vec![7; channels.len()], &layout, &shown, u8::MAX);
        (shown.names.join(" "), samples)
    }

    #[test]
    fn what_is_not_stored_is_transparent() {
        let rgb = padded(&["R", "G", "B"], Wanted::Color);
        assert_eq!(rgb, ("R G B A".into(), vec![7, 7, 7, 255, 0, 0, 0, 0]));
        let rgba = padded(&["R", "G", "B", "A"], Wanted::Color);
        assert_eq!(rgba, ("R G B A".into(), vec![7, 7, 7, 7, 0, 0, 0, 0]));
        let (names, film) = padded(&["R", "G", "B", "VR", "VG", "VB"], Wanted::Film);
        assert_eq!(names, "R G B VR VG VB");
        assert_eq!(film, [7, 7, 7, 7, 7, 7, 0, 0, 0, 255, 255, 255]);
        let matte = padded(&["Y"], Wanted::Coverage);
        assert_eq!(matte, ("Y".into(), vec![7, 0]));
    }

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
