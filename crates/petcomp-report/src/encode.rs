//! Picture files: loss of each format against time and size.
//!
//! The reference is the picture before it is written. Files are read back by petcomp's own readers,
//! which the tests compare with OpenImageIO's.

use super::clock::timed;
use super::matte::uniform;
use super::pile::pile;
use super::{Diagram, Point};
use petcomp::io::{self, Bits, Compression, WriteOptions};
use petcomp::plot::three;
use petcomp::render::render;
use petcomp::{Error, Image, LinearRgb, PremulRgba, Quality, Result};
use petcomp::{Shot, composite};
use std::path::Path;
use std::sync::Arc;

const SIZE: [u32; 2] = [640, 480];
const CARD_COUNT: u32 = 12;
const TIMED_RUNS: usize = 5;
/// Amplitude of the plate's noise, scene-linear: that of a good camera in the middle of its range.
const GRAIN_WIDTH: f32 = 0.01;
const JPEG_QUALITIES: [u8; 6] = [50, 75, 85, 90, 95, 100];

/// Curves with more than one setting.
const PNG: &str = "PNG, 8 bits";
const HALF: &str = "EXR, half";

/// A way to store a picture.
struct Encoding {
    curve: &'static str,
    setting: String,
    extension: &'static str,
    options: WriteOptions,
}

/// A stored picture: the time it took, its size and its error.
struct Stored {
    seconds: f64,
    bytes: u64,
    error: f64,
}

/// Error against time, and error against bytes.
pub(crate) fn diagrams() -> Result<Vec<Diagram>> {
    let comparison = EncodingComparison::measure()?;
    Ok(vec![comparison.time_diagram(), comparison.size_diagram()])
}

/// A picture in every encoding.
struct EncodingComparison {
    picture: Image<LinearRgb>,
    stored: Vec<(Encoding, Stored)>,
}

impl EncodingComparison {
    fn measure() -> Result<Self> {
        let picture = noisy_picture();
        let folder = tempfile::tempdir().map_err(|e| Error::value("scratch folder", e))?;
        let mut stored = Vec::new();
        for encoding in encodings() {
            let found = encoding.store(&picture, folder.path())?;
            stored.push((encoding, found));
        }
        Ok(Self { picture, stored })
    }

    fn pixels(&self) -> f64 {
        self.picture.pixels().len() as f64
    }

    fn time_diagram(&self) -> Diagram {
        Diagram {
            file: "encode_time".into(),
            title: "encode: error against time".into(),
            cost: "CPU seconds per megapixel, writing".into(),
            why: self.why_png().unwrap_or_default(),
            ..self.diagram(|s| s.seconds / self.pixels() * 1e6)
        }
    }

    fn size_diagram(&self) -> Diagram {
        Diagram {
            file: "encode_bytes".into(),
            title: "encode: error against size".into(),
            cost: "bytes per pixel".into(),
            why: "A dataset is written once and read often: use `pictures.format = \"jpg\"` if storage is expensive.".into(),
            ..self.diagram(|s| s.bytes as f64 / self.pixels())
        }
    }

    fn diagram(&self, cost: impl Fn(&Stored) -> f64) -> Diagram {
        let measured = self.stored.iter();
        let points = measured.map(|(encoding, s)| encoding.point(cost(s), s.error));
        let [w, h] = SIZE;
        let brightest = brightest(&self.picture);
        Diagram {
            input: format!(
                "{CARD_COUNT} cards over a noisy plate, {w} x {h}, values up to {brightest:.2}"
            ),
            error: "RMS error, scene-linear".into(),
            reference: "the picture before it is written".into(),
            points: points.collect(),
            ..Diagram::default()
        }
    }

    /// Why datasets use PNG, compared with JPEG.
    fn why_png(&self) -> Option<String> {
        let png = self.stored_as(PNG, "normal")?;
        let jpeg = self.stored_as("JPEG", "95")?;
        Some(format!(
            "Trainers read 8-bit files: PNG loses only what 8 bits lose, and takes {} of the time of JPEG at quality \
             95, which has {} times its error and {} of its size. `reference` also keeps half floats.",
            three(png.seconds / jpeg.seconds),
            three(jpeg.error / png.error),
            three(jpeg.bytes as f64 / png.bytes as f64)
        ))
    }

    fn stored_as(&self, curve: &str, setting: &str) -> Option<&Stored> {
        let mut stored = self.stored.iter();
        let (_, found) = stored.find(|(encoding, _)| encoding.is(curve, setting))?;
        Some(found)
    }
}

fn encodings() -> Vec<Encoding> {
    let mut all = vec![
        png(PNG, Bits::Eight, Quality::Draft),
        png(PNG, Bits::Eight, Quality::Normal),
        png(PNG, Bits::Eight, Quality::Reference),
        png("PNG, 16 bits", Bits::Sixteen, Quality::Normal),
        exr(HALF, "uncompressed", Bits::Half, Compression::None),
        exr(HALF, "PIZ", Bits::Half, Compression::Piz),
        exr(HALF, "ZIP", Bits::Half, Compression::Zip),
        exr("EXR, float", "ZIP", Bits::Float, Compression::Zip),
    ];
    all.extend(JPEG_QUALITIES.map(jpeg));
    all
}

fn exr(curve: &'static str, name: &str, bits: Bits, compression: Compression) -> Encoding {
    let options = WriteOptions {
        bits: Some(bits),
        compression,
        ..WriteOptions::default()
    };
    Encoding::new(curve, name, "exr", options)
}

fn png(curve: &'static str, bits: Bits, effort: Quality) -> Encoding {
    let options = WriteOptions {
        bits: Some(bits),
        png_effort: effort,
        ..WriteOptions::default()
    };
    Encoding::new(curve, effort.name(), "png", options)
}

fn jpeg(quality: u8) -> Encoding {
    let options = WriteOptions {
        jpeg_quality: quality,
        ..WriteOptions::default()
    };
    Encoding::new("JPEG", &quality.to_string(), "jpg", options)
}

impl Encoding {
    fn new(
        curve: &'static str,
        setting: &str,
        extension: &'static str,
        options: WriteOptions,
    ) -> Self {
        Self {
            curve,
            setting: setting.into(),
            extension,
            options,
        }
    }

    fn store(&self, picture: &Image<LinearRgb>, folder: &Path) -> Result<Stored> {
        let path = folder.join("picture").with_extension(self.extension);
        let ((), seconds) = timed(TIMED_RUNS, || io::write_with(&path, picture, &self.options))?;
        let file = std::fs::metadata(&path).map_err(|e| Error::file(&path, e))?;
        Ok(Stored {
            seconds,
            bytes: file.len(),
            error: rms_difference(&io::read(&path)?, picture),
        })
    }

    fn is(&self, curve: &str, setting: &str) -> bool {
        self.curve == curve && self.setting == setting
    }

    /// A PNG as in datasets, or the EXR of a reference.
    fn point(&self, cost: f64, error: f64) -> Point {
        Point::new(self.curve, self.setting.clone(), cost, error).used_where(|quality| {
            let with_exr = quality.pictures(Default::default()).exr;
            self.is(PNG, "normal") || with_exr && self.is(HALF, "ZIP")
        })
    }
}

fn rms_difference(a: &Image<LinearRgb>, b: &Image<LinearRgb>) -> f64 {
    let pairs = a.pixels().iter().zip(b.pixels());
    let differences = pairs.flat_map(|(a, b)| [a.r - b.r, a.g - b.g, a.b - b.b]);
    let squares = differences.map(|d| f64::from(d).powi(2));
    (squares.sum::<f64>() / (3 * b.pixels().len()) as f64).sqrt()
}

fn brightest(picture: &Image<LinearRgb>) -> f32 {
    let pixels = picture.pixels().iter();
    pixels.map(|c| c.r.max(c.g).max(c.b)).fold(0.0, f32::max)
}

/// A rendered pile over a plate with the noise of a camera.
fn noisy_picture() -> Image<LinearRgb> {
    let mut plate = tiled_plate();
    add_grain(&mut plate);
    let shot: Shot = pile(CARD_COUNT, SIZE).with_plate(Arc::new(plate));
    let deep = render(&shot, &Quality::default().render());
    composite::frame(&deep, shot.plate.as_deref()).map(PremulRgba::color)
}

fn tiled_plate() -> Image<LinearRgb> {
    let [w, h] = SIZE.map(|side| side as usize);
    Image::from_fn(w, h, |x, y| {
        let is_dark = (x / 64 + y / 64).is_multiple_of(2);
        let tile = if is_dark { 0.28 } else { 0.35 };
        LinearRgb::new(1.0, 0.9, 0.8).scale(tile * (0.8 + 0.2 * x as f32 / w as f32))
    })
}

fn add_grain(plate: &mut Image<LinearRgb>) {
    let mut draw = uniform(1);
    for p in plate.pixels_mut() {
        let [r, g, b] = std::array::from_fn(|_| GRAIN_WIDTH * (draw() - 0.5) as f32);
        *p = *p + LinearRgb::new(r, g, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn float_files_lose_nothing_and_eight_bits_lose_what_their_codes_are_apart() {
        let folder = tempfile::tempdir().unwrap();
        let ramp = Image::from_fn(64, 4, |x, y| {
            LinearRgb::grey((x as f32 + y as f32 / 4.0) / 64.0)
        });
        let error = |curve: &str, setting: &str| {
            let encoding = encodings()
                .into_iter()
                .find(|e| e.is(curve, setting))
                .unwrap();
            encoding.store(&ramp, folder.path()).unwrap().error
        };
        assert_eq!(error("EXR, float", "ZIP"), 0.0);
        assert!(error(HALF, "ZIP") < 1e-3 && error("PNG, 16 bits", "normal") < 1e-4);
        // A code of sRGB spans at most 0.0098 of light.
        assert!(
            (1e-4..0.0098 / 2.0).contains(&error(PNG, "normal")),
            "{}",
            error(PNG, "normal")
        );
        assert!(error("JPEG", "50") > error("JPEG", "95"));
    }

    #[test]
    fn efforts_only_change_the_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let picture = Image::from_fn(90, 70, |x, y| {
            LinearRgb::new(x as f32 / 90.0, y as f32 / 70.0, 0.2)
        });
        let all: Vec<_> = encodings().into_iter().filter(|e| e.curve == PNG).collect();
        let stored: Vec<_> = all
            .iter()
            .map(|e| e.store(&picture, folder.path()).unwrap())
            .collect();
        assert!(stored.iter().all(|s| s.error == stored[0].error));
        let [draft, _, reference] = &stored[..] else {
            panic!("{} qualities", stored.len())
        };
        assert!(reference.bytes <= draft.bytes);
    }
}
