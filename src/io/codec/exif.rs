//! What the camera wrote beside the pixels: which way up, and how wide the lens was.

use super::orient::Orientation;
use exif::{Exif, In, Tag, Value};
use std::io::{BufRead, Seek};

/// Diagonal of 36 mm x 24 mm film, which equivalents of focal lengths refer to, millimetres.
const FILM_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Ratios of sides closer than this belong to one shape: sizes are rounded, and to multiples of 16
/// at times.
const SHAPE_TOLERANCE: f64 = 0.01;
/// The same for sizes: no more than the middle of a lens is uncertain anyway.
const SIZE_TOLERANCE: f64 = 0.005;

/// The part of the EXIF data that means something here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraNotes {
    pub(crate) orientation: Orientation,
    /// Focal length that would give the same view on 36 x 24 mm film, millimetres.
    pub(crate) focal_35mm: Option<f64>,
    /// The middle of the picture was enlarged.
    pub(crate) digital_zoom: bool,
    /// Size of the picture as it was taken, before anybody turned it.
    pub(crate) size: Option<[f64; 2]>,
}

impl Default for CameraNotes {
    fn default() -> Self {
        Self {
            orientation: Orientation(1),
            focal_35mm: None,
            digital_zoom: false,
            size: None,
        }
    }
}

impl CameraNotes {
    /// The notes in a JPEG, TIFF, PNG or HEIF file. A photo without notes, or with damaged ones, is as
    /// good as another.
    pub(crate) fn read(mut file: impl BufRead + Seek) -> Self {
        let exif = read_exif(&mut file);
        exif.map_or_else(Self::default, |exif| Self::from_exif(&exif))
    }

    /// The same of a picture that stands upright already.
    pub(crate) fn upright(self) -> Self {
        Self {
            orientation: Orientation(1),
            ..self
        }
    }

    fn from_exif(exif: &Exif) -> Self {
        let orientation = integer(exif, Tag::Orientation).and_then(|v| u8::try_from(v).ok());
        let size = noted_size(exif);
        Self {
            orientation: Orientation(orientation.unwrap_or(1)),
            focal_35mm: positive(exif, Tag::FocalLengthIn35mmFilm)
                .or_else(|| focal_35mm_by_sensor(exif, size?)),
            digital_zoom: has_digital_zoom(exif),
            size,
        }
    }

    /// The camera noted the size that the file has, or an integer multiple of it, whichever way up:
    /// nothing was cut away.
    pub(crate) fn has_same_size(&self, stored: [usize; 2]) -> bool {
        let stored = longer_first(stored.map(|s| s as f64));
        let taken = self.size.map(longer_first);
        taken.is_some_and(|taken| is_multiple(taken, stored))
    }

    /// The camera noted a size of another shape than the file has, whichever way up.
    pub(crate) fn has_other_shape(&self, stored: [usize; 2]) -> bool {
        let shape = aspect_ratio(stored.map(|s| s as f64));
        self.size
            .is_some_and(|taken| (aspect_ratio(taken) / shape - 1.0).abs() > SHAPE_TOLERANCE)
    }
}

/// One size is another times an integer, but for [`SIZE_TOLERANCE`].
fn is_multiple([width, height]: [f64; 2], [long, short]: [f64; 2]) -> bool {
    let factor = (width / long).round();
    factor >= 1.0 && is_close(width, factor * long) && is_close(height, factor * short)
}

fn is_close(side: f64, expected: f64) -> bool {
    (side / expected - 1.0).abs() <= SIZE_TOLERANCE
}

fn read_exif(file: &mut (impl BufRead + Seek)) -> Option<Exif> {
    exif::Reader::new().read_from_container(file).ok()
}

fn noted_size(exif: &Exif) -> Option<[f64; 2]> {
    let width = positive(exif, Tag::PixelXDimension)?;
    Some([width, positive(exif, Tag::PixelYDimension)?])
}

/// A ratio of 0 means that there was none.
fn has_digital_zoom(exif: &Exif) -> bool {
    rational(exif, Tag::DigitalZoomRatio).is_some_and(|zoom| zoom > 0.0 && zoom != 1.0)
}

fn longer_first([a, b]: [f64; 2]) -> [f64; 2] {
    [a.max(b), a.min(b)]
}

/// The longer side over the shorter one.
fn aspect_ratio([w, h]: [f64; 2]) -> f64 {
    w.max(h) / w.min(h)
}

/// The 35 mm equivalent by the picture's diagonal, from the focal length and the sensor's pixels
/// per length.
fn focal_35mm_by_sensor(exif: &Exif, size: [f64; 2]) -> Option<f64> {
    let unit_mm = resolution_unit_mm(exif)?;
    let focal_mm = rational(exif, Tag::FocalLength).filter(|&mm| mm > 0.0)?;
    let px_per_unit = rational(exif, Tag::FocalPlaneXResolution).filter(|&r| r > 0.0)?;
    Some(focal_mm * px_per_unit / unit_mm * FILM_DIAGONAL_MM / libm::hypot(size[0], size[1]))
}

/// The length that pixels of the sensor are counted by; inches where none is named.
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

/// An integer above 0.
fn positive(exif: &Exif, tag: Tag) -> Option<f64> {
    integer(exif, tag).filter(|&v| v > 0).map(f64::from)
}

/// A finite number.
fn rational(exif: &Exif, tag: Tag) -> Option<f64> {
    let number = first_rational(&exif.get_field(tag, In::PRIMARY)?.value)?;
    number.is_finite().then_some(number)
}

fn first_rational(value: &Value) -> Option<f64> {
    match value {
        Value::Rational(values) => values.first().map(|v| v.to_f64()),
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
    fn damaged_notes_are_no_notes() {
        assert_eq!(
            CameraNotes::read(Cursor::new(b"\xff\xd8\xff\xe1\x00\x08Exif\0\0II")),
            CameraNotes::default()
        );
        assert_eq!(CameraNotes::read(Cursor::new(b"")), CameraNotes::default());
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

    /// A 22.3 mm sensor of 3888 x 2592 pixels (Canon EOS 400D), with a lens of 50 mm.
    fn reflex(per_unit: Value, unit: Option<u16>) -> CameraNotes {
        let mut fields = vec![
            (Tag::FocalLength, rational(50, 1)),
            (Tag::FocalPlaneXResolution, per_unit),
            (Tag::PixelXDimension, Value::Long(vec![3888])),
            (Tag::PixelYDimension, Value::Long(vec![2592])),
        ];
        fields.extend(unit.map(|u| (Tag::FocalPlaneResolutionUnit, Value::Short(vec![u]))));
        notes(&fields)
    }

    #[test]
    fn the_sensor_s_resolution_gives_the_equivalent_by_the_diagonal() {
        // 3888 px on 22.2 mm; the sensor's diagonal is 26.7 mm, so 50 mm are 81 mm equivalent.
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
