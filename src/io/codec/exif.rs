//! What the camera recorded besides the pixels: the orientation, the focal length and the colour
//! space.

use super::orient::Orientation;
use super::profile::ColorDescription;
use exif::{Error, Exif, In, Tag, Value};
use std::io::{BufRead, Read, Seek, SeekFrom};

/// Diagonal of 36 mm x 24 mm film, to which equivalent focal lengths refer, millimetres.
const FILM_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Aspect ratios closer than this count as equal: sizes are rounded, sometimes to multiples of 16.
const SHAPE_TOLERANCE: f64 = 0.01;
/// The same for sizes: a difference within the uncertainty of the principal point.
const SIZE_TOLERANCE: f64 = 0.005;
/// In the names of programs that record the size of their output as that of the original; cameras
/// record their firmware in the same field.
const EDITORS: [&str; 20] = [
    "acdsee",
    "adobe",
    "affinity",
    "capture one",
    "darktable",
    "digikam",
    "dxo",
    "faststone",
    "gimp",
    "imagemagick",
    "irfanview",
    "lightroom",
    "luminar",
    "paint",
    "photo",
    "picasa",
    "pixelmator",
    "rawtherapee",
    "snapseed",
    "xnview",
];
/// Maximum number of directories that a file may point to; cameras have three, and pixel data may
/// resemble some.
const MOST_POINTERS: usize = 8;
/// Maximum number of successive picture directories that the reader follows.
const MOST_PICTURES: usize = 8;
/// Bytes of a directory entry.
const ENTRY_BYTES: u64 = 12;
/// The reader's messages for notes whose first bytes are damaged.
const DAMAGED_STARTS: [&str; 3] = [
    "Truncated TIFF header",
    "Invalid TIFF byte order",
    "Invalid forty two",
];

/// The EXIF data used here.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CameraNotes {
    pub(crate) orientation: Orientation,
    /// Focal length that would give the same view on 36 x 24 mm film, millimetres.
    pub(crate) focal_35mm: Option<f64>,
    /// Whether it was computed from the resolution of the sensor, which is wrong for a resized
    /// picture.
    pub(crate) focal_by_sensor: bool,
    /// Whether the centre of the picture was enlarged.
    pub(crate) digital_zoom: bool,
    /// Size of the picture as taken, before any rotation.
    pub(crate) size: Option<[f64; 2]>,
    /// Whether a program wrote it that may have cropped the picture and recorded its new size.
    pub(crate) edited: bool,
    /// For a file without a colour profile; none for sRGB.
    pub(crate) color: Option<ColorDescription>,
    /// Whether there are notes, but none of them can be read.
    pub(crate) unreadable: bool,
}

impl CameraNotes {
    /// The notes in a JPEG, TIFF, PNG or HEIF file. Missing notes are not an error, and a damaged
    /// note does not affect the others.
    pub(crate) fn read(mut file: impl BufRead + Seek) -> Self {
        // The reader follows every pointer, even in circles: thousands of them would exhaust any
        // memory.
        if count_pointers(&mut file).is_ok_and(|count| count > MOST_POINTERS) {
            return Self {
                unreadable: true,
                ..Self::default()
            };
        }
        let mut reader = exif::Reader::new();
        let exif = reader
            .continue_on_error(true)
            .read_from_container(&mut file);
        match exif {
            Ok(exif) => Self::from_exif(&exif),
            Err(Error::PartialResult(part)) => Self::from_part(&part.into_inner().0),
            Err(e) => Self {
                unreadable: is_damaged_start(&e),
                ..Self::default()
            },
        }
    }

    /// The intact part of damaged notes.
    fn from_part(exif: &Exif) -> Self {
        Self {
            unreadable: exif.fields().next().is_none(),
            ..Self::from_exif(exif)
        }
    }

    /// The same for a picture that is already upright.
    pub(crate) fn upright(self) -> Self {
        Self {
            orientation: Orientation::default(),
            ..self
        }
    }

    fn from_exif(exif: &Exif) -> Self {
        let orientation = integer(exif, Tag::Orientation).and_then(|v| u8::try_from(v).ok());
        let (size, edited) = (noted_size(exif), is_edited(exif));
        let by_camera = positive(exif, Tag::FocalLengthIn35mmFilm);
        let taken = size.filter(|_| !edited && by_camera.is_none());
        let by_sensor = taken.and_then(|size| focal_35mm_by_sensor(exif, size));
        Self {
            orientation: orientation.map(Orientation).unwrap_or_default(),
            focal_35mm: by_camera.or(by_sensor),
            focal_by_sensor: by_sensor.is_some(),
            digital_zoom: has_digital_zoom(exif),
            size,
            edited,
            color: noted_color(exif),
            unreadable: false,
        }
    }

    /// Whether the camera recorded the size of the file, or an integer multiple of it, in either
    /// orientation: the picture was then not cropped.
    pub(crate) fn has_same_size(&self, stored: [usize; 2]) -> bool {
        let stored = longer_first(stored.map(|s| s as f64));
        let taken = self.size.filter(|_| !self.edited).map(longer_first);
        taken.is_some_and(|taken| is_multiple(taken, stored))
    }

    /// Whether the camera recorded a size with another aspect ratio than the file, in either
    /// orientation.
    pub(crate) fn has_other_shape(&self, stored: [usize; 2]) -> bool {
        let shape = aspect_ratio(stored.map(|s| s as f64));
        self.size
            .is_some_and(|taken| (aspect_ratio(taken) / shape - 1.0).abs() > SHAPE_TOLERANCE)
    }
}

/// Whether one size is an integer multiple of another, within [`SIZE_TOLERANCE`].
fn is_multiple([width, height]: [f64; 2], [long, short]: [f64; 2]) -> bool {
    let factor = (width / long).round();
    factor >= 1.0 && is_close(width, factor * long) && is_close(height, factor * short)
}

fn is_close(side: f64, expected: f64) -> bool {
    (side / expected - 1.0).abs() <= SIZE_TOLERANCE
}

/// Counts pointers to directories in a TIFF, or places in another file that look like one; rewinds
/// the file.
fn count_pointers(file: &mut (impl BufRead + Seek)) -> std::io::Result<usize> {
    let header = read_at(file, 0, 8)?;
    file.rewind()?;
    let count = match TiffOrder::of(&header) {
        // Uncompressed pixels may contain any number of apparent pointers.
        Some(order) => order.count_pointers(file, order.number(&header[4..]))?,
        // The reader does not support BigTIFF.
        None if is_big_tiff(&header) => 0,
        None => count_likely_pointers(file)?,
    };
    file.rewind()?;
    Ok(count)
}

pub(super) fn is_big_tiff(header: &[u8]) -> bool {
    header.starts_with(b"II+\0") || header.starts_with(b"MM\0+")
}

/// This many bytes at a position in a file, or those up to its end.
pub(super) fn read_at(
    file: &mut (impl Read + Seek),
    place: u64,
    count: u64,
) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(place))?;
    file.by_ref().take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The byte order of a TIFF.
#[derive(Clone, Copy)]
pub(super) enum TiffOrder {
    LittleEndian,
    BigEndian,
}

/// What a TIFF directory points to.
struct TiffDirectory {
    /// EXIF, GPS and interoperability directories, up to one more than the maximum.
    children: Vec<u64>,
    /// The directory of the next picture; 0 for none.
    next: u64,
}

impl TiffOrder {
    /// None if a file with this header is not a TIFF.
    fn of(header: &[u8]) -> Option<Self> {
        match header {
            [b'I', b'I', 42, 0, _, _, _, _] => Some(Self::LittleEndian),
            [b'M', b'M', 0, 42, _, _, _, _] => Some(Self::BigEndian),
            _ => None,
        }
    }

    pub(super) fn number(self, bytes: &[u8]) -> u64 {
        let append = |number: u64, byte: &u8| (number << 8) | u64::from(*byte);
        match self {
            Self::LittleEndian => bytes.iter().rev().fold(0, append),
            Self::BigEndian => bytes.iter().fold(0, append),
        }
    }

    /// Pointers that the reader follows, from pictures and from the directories that they point to;
    /// stops counting when there are too many.
    fn count_pointers(self, file: &mut (impl Read + Seek), first: u64) -> std::io::Result<usize> {
        let (mut next, mut count) = (first, 0);
        for _ in 0..MOST_PICTURES {
            let picture = self.read_directory(file, next)?;
            count += picture.children.len();
            if count > MOST_POINTERS {
                return Ok(count);
            }
            for child in picture.children {
                count += self.read_directory(file, child)?.children.len();
                if count > MOST_POINTERS {
                    return Ok(count);
                }
            }
            next = picture.next;
            if next == 0 {
                break;
            }
        }
        Ok(count)
    }

    fn read_directory(
        self,
        file: &mut (impl Read + Seek),
        place: u64,
    ) -> std::io::Result<TiffDirectory> {
        let length = ENTRY_BYTES * self.number(&read_at(file, place, 2)?);
        let entries = read_at(file, place + 2, length)?;
        let next = self.number(&read_at(file, place + 2 + length, 4)?);
        let starts = (place + 2..).step_by(ENTRY_BYTES as usize);
        let starts = starts.zip(entries.chunks_exact(ENTRY_BYTES as usize));
        let pointers = starts.filter_map(|(start, entry)| self.pointer_in(entry, start));
        let mut children = Vec::new();
        // Each is read separately; one more than the maximum is enough to detect too many.
        for (place, size) in pointers.take(MOST_POINTERS + 1) {
            children.push(self.number(&read_at(file, place, size)?));
        }
        Ok(TiffDirectory { children, next })
    }

    /// The position of the pointer in an entry that starts at `start`, and its size in bytes: in
    /// the entry itself, or elsewhere for several values, of which the reader uses the first.
    fn pointer_in(self, entry: &[u8], start: u64) -> Option<(u64, u64)> {
        if !is_pointer([entry[0], entry[1], entry[2], entry[3]]) {
            return None;
        }
        let size = match self.number(&entry[2..4]) {
            3 => 2,
            4 => 4,
            _ => 1,
        };
        let is_inside = size * self.number(&entry[4..8]) <= 4;
        let place = if is_inside {
            start + 8
        } else {
            self.number(&entry[8..12])
        };
        Some((place, size))
    }
}

/// Counts places in a file that look like a pointer to a directory.
fn count_likely_pointers(file: &mut impl BufRead) -> std::io::Result<usize> {
    let (mut last, mut count) = ([0; 4], 0);
    loop {
        let bytes = file.fill_buf()?;
        for &byte in bytes {
            last = [last[1], last[2], last[3], byte];
            count += usize::from(is_pointer(last));
        }
        match bytes.len() {
            0 => return Ok(count),
            length => file.consume(length),
        }
    }
}

/// Whether an entry begins like a pointer to an EXIF, GPS or interoperability directory, of any
/// integer type, in either byte order.
fn is_pointer([a, b, c, d]: [u8; 4]) -> bool {
    [[a, b, c, d], [b, a, d, c]].into_iter().any(|entry| {
        matches!(
            entry,
            [0x87, 0x69, 0, 1..=4] | [0x88, 0x25, 0, 1..=4] | [0xa0, 0x05, 0, 1..=4]
        )
    })
}

fn is_damaged_start(e: &Error) -> bool {
    matches!(e, Error::InvalidFormat(what) if DAMAGED_STARTS.contains(what))
}

/// Whether the last program that wrote the file is one that edits pictures.
fn is_edited(exif: &Exif) -> bool {
    let program = text(exif, Tag::Software).unwrap_or_default().to_lowercase();
    EDITORS.iter().any(|editor| program.contains(editor))
}

/// What a camera records instead of a colour profile: Adobe RGB by the index of its files (DCF 2.0,
/// 4.2), or a colour space other than sRGB.
fn noted_color(exif: &Exif) -> Option<ColorDescription> {
    const SRGB: u32 = 1;
    const UNCALIBRATED: u32 = 65_535;
    let index = text(exif, Tag::InteroperabilityIndex);
    match integer(exif, Tag::ColorSpace) {
        Some(SRGB) => None,
        _ if index.as_deref() == Some("R03") => Some(ColorDescription::AdobeRgb),
        Some(UNCALIBRATED) => Some(ColorDescription::Uncalibrated),
        _ => None,
    }
}

fn noted_size(exif: &Exif) -> Option<[f64; 2]> {
    let width = positive(exif, Tag::PixelXDimension)?;
    Some([width, positive(exif, Tag::PixelYDimension)?])
}

/// A ratio of 0 means no digital zoom.
fn has_digital_zoom(exif: &Exif) -> bool {
    rational(exif, Tag::DigitalZoomRatio).is_some_and(|zoom| zoom > 0.0 && zoom != 1.0)
}

fn longer_first([a, b]: [f64; 2]) -> [f64; 2] {
    [a.max(b), a.min(b)]
}

/// The longer side divided by the shorter one.
fn aspect_ratio([w, h]: [f64; 2]) -> f64 {
    w.max(h) / w.min(h)
}

/// The 35 mm equivalent by the picture's diagonal, from the focal length and the sensor's pixels
/// per unit of length.
fn focal_35mm_by_sensor(exif: &Exif, size: [f64; 2]) -> Option<f64> {
    let unit_mm = resolution_unit_mm(exif)?;
    let focal_mm = rational(exif, Tag::FocalLength).filter(|&mm| mm > 0.0)?;
    let px_per_unit = rational(exif, Tag::FocalPlaneXResolution).filter(|&r| r > 0.0)?;
    Some(focal_mm * px_per_unit / unit_mm * FILM_DIAGONAL_MM / libm::hypot(size[0], size[1]))
}

/// The unit of the sensor's resolution; inches if unspecified.
fn resolution_unit_mm(exif: &Exif) -> Option<f64> {
    const INCH: u32 = 2;
    const CENTIMETRE: u32 = 3;
    match integer(exif, Tag::FocalPlaneResolutionUnit) {
        None | Some(INCH) => Some(25.4),
        Some(CENTIMETRE) => Some(10.0),
        Some(_) => None,
    }
}

fn integer(exif: &Exif, tag: Tag) -> Option<u32> {
    exif.get_field(tag, In::PRIMARY)?.value.get_uint(0)
}

fn text(exif: &Exif, tag: Tag) -> Option<String> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(parts) => Some(String::from_utf8_lossy(&parts.concat()).into_owned()),
        _ => None,
    }
}

/// An integer above 0.
fn positive(exif: &Exif, tag: Tag) -> Option<f64> {
    integer(exif, tag).filter(|&v| v > 0).map(f64::from)
}

/// A finite number.
fn rational(exif: &Exif, tag: Tag) -> Option<f64> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => Some(values.first()?.to_f64()).filter(|v| v.is_finite()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exif::experimental::Writer;
    use exif::{Field, Rational};
    use std::io::Cursor;

    #[test]
    fn what_is_left_of_damaged_notes_is_told_from_none() {
        let none = CameraNotes::default();
        let unreadable = CameraNotes {
            unreadable: true,
            ..none.clone()
        };
        for (file, expected) in [
            (&b"\xff\xd8\xff\xe1\x00\x0aExif\0\0II"[..], &unreadable),
            (
                b"\xff\xd8\xff\xe1\x00\x10Exif\0\0II*\0\xff\xff\xff\xff",
                &unreadable,
            ),
            (b"\xff\xd8\xff\xd9", &none),
            (b"\xff\xd8\xff\xe1\x00\x08", &none),
            (b"", &none),
        ] {
            assert_eq!(CameraNotes::read(Cursor::new(file)), *expected, "{file:?}");
        }
    }

    /// As written by piexif: orientation 6, and a GPS directory followed directly by its data
    /// instead of the offset of a next directory.
    fn unended() -> Vec<u8> {
        let mut file = b"MM\0*\0\0\0\x08\0\x02".to_vec();
        file.extend(b"\x01\x12\0\x03\0\0\0\x01\0\x06\0\0");
        file.extend(b"\x88\x25\0\x04\0\0\0\x01\0\0\0\x26\0\0\0\0\0\x02");
        file.extend(b"\0\x01\0\x02\0\0\0\x02N\0\0\0\0\x02\0\x05\0\0\0\x03\0\0\0\x40");
        file.extend([0, 0, 0, 1].repeat(6));
        file
    }

    #[test]
    fn a_damaged_note_leaves_the_others() {
        // Positions of the offsets of the latitude's value and of the next directory.
        const LATITUDE: usize = 60;
        const NEXT: usize = 34;
        let with = |at: usize, offset: u32| {
            let mut file = unended();
            file[at..at + 4].copy_from_slice(&offset.to_be_bytes());
            file
        };
        for file in [unended(), with(LATITUDE, 60_000), with(NEXT, 60_000)] {
            let notes = CameraNotes::read(Cursor::new(file));
            assert_eq!(
                (notes.orientation, notes.unreadable),
                (Orientation(6), false)
            );
        }
    }

    /// A directory whose entries point to itself would be read a million times.
    #[test]
    fn pointers_in_circles_are_not_followed() {
        let mut file = b"MM\0*\0\0\0\x08".to_vec();
        file.extend(2001_u16.to_be_bytes());
        file.extend(b"\x01\x12\0\x03\0\0\0\x01\0\x06\0\0");
        file.extend(b"\x87\x69\0\x04\0\0\0\x01\0\0\0\x08".repeat(1000));
        file.extend(b"\xa0\x05\0\x04\0\0\0\x01\0\0\0\x08".repeat(1000));
        file.extend([0; 4]);
        assert!(CameraNotes::read(Cursor::new(file)).unreadable);
    }

    #[test]
    fn pixels_that_look_like_pointers_are_none() {
        let mut file = unended();
        file.extend([0; 8]);
        file.extend(b"\x87\x69\0\x04".repeat(1000));
        let notes = CameraNotes::read(Cursor::new(file));
        assert_eq!(
            (notes.orientation, notes.unreadable),
            (Orientation(6), false)
        );
    }

    #[test]
    fn pixels_of_a_bigtiff_are_no_unreadable_notes() {
        for header in [b"II+\0\x08\0\0\0", b"MM\0+\0\x08\0\0"] {
            let mut file = header.to_vec();
            file.extend(b"\x87\x69\0\x04".repeat(1000));
            assert_eq!(CameraNotes::read(Cursor::new(file)), CameraNotes::default());
        }
    }

    /// A directory after the first one, with a thousand pointers to others.
    #[test]
    fn pointers_of_a_directory_that_is_pointed_to_count() {
        let mut file = b"MM\0*\0\0\0\x08\0\x01".to_vec();
        file.extend(b"\x87\x69\0\x04\0\0\0\x01\0\0\0\x1a\0\0\0\0");
        file.extend(1000_u16.to_be_bytes());
        file.extend(b"\xa0\x05\0\x04\0\0\0\x01\0\0\0\x1a".repeat(1000));
        file.extend([0; 4]);
        assert!(CameraNotes::read(Cursor::new(file)).unreadable);
    }

    /// Each would be read eight times.
    #[test]
    fn pointers_are_counted_up_to_where_they_are_too_many() {
        let mut file = b"MM\0*\0\0\0\x08\0\x08".to_vec();
        file.extend(b"\x87\x69\0\x04\0\0\0\x01\0\0\0\x6e".repeat(8));
        file.extend([0; 4]);
        file.extend(u16::MAX.to_be_bytes());
        file.extend(b"\xa0\x05\0\x04\0\0\0\x01\0\0\0\x6e".repeat(usize::from(u16::MAX)));
        file.extend([0; 4]);
        let counted = count_pointers(&mut Cursor::new(&file)).unwrap();
        assert_eq!(counted, 8 + MOST_POINTERS + 1);
        assert!(CameraNotes::read(Cursor::new(&file)).unreadable);
    }

    fn notes(fields: &[(Tag, Value)]) -> CameraNotes {
        let fields: Vec<_> = fields
            .iter()
            .map(|(tag, value)| Field {
                tag: *tag,
                ifd_num: In::PRIMARY,
                value: value.clone(),
            })
            .collect();
        let mut writer = Writer::new();
        fields.iter().for_each(|f| writer.push_field(f));
        let mut tiff = std::io::Cursor::new(Vec::new());
        writer.write(&mut tiff, false).unwrap();
        CameraNotes::read(Cursor::new(tiff.get_ref()))
    }

    fn rational(num: u32, denom: u32) -> Value {
        Value::Rational(vec![Rational { num, denom }])
    }

    /// A 22.3 mm sensor of 3888 x 2592 pixels (Canon EOS 400D), with a 50 mm lens.
    fn reflex_fields(per_unit: Value) -> Vec<(Tag, Value)> {
        vec![
            (Tag::FocalLength, rational(50, 1)),
            (Tag::FocalPlaneXResolution, per_unit),
            (Tag::PixelXDimension, Value::Long(vec![3888])),
            (Tag::PixelYDimension, Value::Long(vec![2592])),
        ]
    }

    fn reflex(per_unit: Value, unit: Option<u16>) -> CameraNotes {
        let mut fields = reflex_fields(per_unit);
        fields.extend(unit.map(|u| (Tag::FocalPlaneResolutionUnit, Value::Short(vec![u]))));
        notes(&fields)
    }

    #[test]
    fn the_sensor_s_resolution_gives_the_equivalent_by_the_diagonal() {
        // 3888 px on 22.2 mm; the sensor's diagonal is 26.7 mm, so 50 mm are equivalent to 81 mm.
        let by_inch = reflex(rational(3_888_000, 875), None).focal_35mm.unwrap();
        assert!((by_inch - 81.0).abs() < 0.2, "{by_inch}");
        assert_eq!(
            reflex(rational(3888, 875), Some(4)).focal_35mm,
            None,
            "a unit that EXIF does not have"
        );
        let by_centimetre = reflex(rational(1_749_300, 1000), Some(3))
            .focal_35mm
            .unwrap();
        assert!((by_centimetre - 81.0).abs() < 0.2, "{by_centimetre}");
        assert_eq!(reflex(rational(1, 0), None).focal_35mm, None);
        assert_eq!(reflex(rational(0, 1), None).focal_35mm, None);
    }

    #[test]
    fn a_size_that_an_editor_states_says_nothing() {
        let written_by = |program: &str| {
            let mut fields = reflex_fields(rational(3_888_000, 875));
            let program = Value::Ascii(vec![program.into()]);
            fields.push((Tag::Software, program));
            notes(&fields)
        };
        let firmware = written_by("Ver.1.00");
        assert!(firmware.focal_35mm.is_some() && firmware.focal_by_sensor);
        assert!(firmware.has_same_size([3888, 2592]));
        let edited = written_by("Adobe Photoshop Lightroom 6.0 (Windows)");
        assert!(edited.focal_35mm.is_none() && !edited.focal_by_sensor);
        assert!(!edited.has_same_size([3888, 2592]) && edited.has_other_shape([1000, 750]));
    }

    #[test]
    fn a_camera_s_word_for_adobe_rgb_is_its_index() {
        let color = |space: u16, index: &str| {
            let index = Value::Ascii(vec![index.into()]);
            let space = Value::Short(vec![space]);
            notes(&[
                (Tag::ColorSpace, space),
                (Tag::InteroperabilityIndex, index),
            ])
            .color
        };
        assert_eq!(color(65_535, "R03"), Some(ColorDescription::AdobeRgb));
        assert_eq!(color(65_535, "R98"), Some(ColorDescription::Uncalibrated));
        assert_eq!((color(1, "R03"), color(1, "R98")), (None, None));
    }

    #[test]
    fn the_camera_s_own_equivalent_comes_first_and_zero_is_none() {
        let own = |mm| notes(&[(Tag::FocalLengthIn35mmFilm, Value::Short(vec![mm]))]).focal_35mm;
        assert_eq!((own(28), own(0)), (Some(28.0), None));
    }

    #[test]
    fn zoom_is_neither_nothing_nor_one() {
        let zoomed = |ratio| notes(&[(Tag::DigitalZoomRatio, ratio)]).digital_zoom;
        assert_eq!(
            [
                rational(0, 1),
                rational(0, 0),
                rational(1, 1),
                rational(3, 2)
            ]
            .map(zoomed),
            [false, false, false, true]
        );
    }

    #[test]
    fn the_size_that_the_file_has_or_a_multiple_of_it_is_whole() {
        let of = reflex(rational(1, 1), None);
        assert!(
            [
                [3888, 2592],
                [2592, 3888],
                [3888, 2584],
                [1944, 1296],
                [972, 648]
            ]
            .into_iter()
            .all(|s| of.has_same_size(s))
        );
        assert!(
            [[3000, 2000], [3888, 2400], [1024, 683], [7776, 5184]]
                .into_iter()
                .all(|s| !of.has_same_size(s))
        );
        assert!(!CameraNotes::default().has_same_size([1, 1]));
    }

    #[test]
    fn another_shape_is_noticed_whichever_way_up() {
        let of = reflex(rational(1, 1), None);
        assert!(!of.has_other_shape([1296, 864]) && !of.has_other_shape([864, 1296]));
        assert!(!of.has_other_shape([1000, 667]) && of.has_other_shape([1000, 750]));
        assert!(!CameraNotes::default().has_other_shape([1, 1]));
    }
}
