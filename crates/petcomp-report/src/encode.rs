//! Files of pictures: what a format loses against the time and the bytes it takes.
//!
//! The reference is the picture before it is written. Files are read back by petcomp's own readers, which the tests hold
//! against OpenImageIO's.

use super::clock::timed;
use super::pile::pile;
use super::{Diagram, Point};
use petcomp::Image;
use petcomp::Quality;
use petcomp::io::{self, Bits, Compression, WriteOptions};
use petcomp::plot::three;
use petcomp::render::render;
use petcomp::{Error, Result};
use petcomp::{LinearRgb, PremulRgba};
use petcomp::{Shot, composite};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::path::Path;
use std::sync::Arc;

const SIZE: [u32; 2] = [640, 480];
const CARDS: u32 = 12;
const RUNS: usize = 5;
/// Width of the plate's noise, scene-linear: that of a good camera in the middle of its range.
const GRAIN: f32 = 0.01;
const JPEG: [u8; 6] = [50, 75, 85, 90, 95, 100];

/// Curves with more than one setting.
const PNG: &str = "PNG, 8 bits";
const HALF: &str = "EXR, half";

/// A way to store a picture.
struct Way {
    curve: &'static str,
    setting: String,
    extension: &'static str,
    options: WriteOptions,
}

/// What it gives.
struct Stored {
    seconds: f64,
    bytes: u64,
    error: f64,
}

/// Error against time, and error against bytes.
///
/// # Errors
/// A folder for scratch files that cannot be had or written.
pub fn diagrams() -> Result<Vec<Diagram>> {
    let picture = picture();
    let folder = tempfile::tempdir().map_err(|e| Error::value("scratch folder", e))?;
    let ways = ways();
    let stored: Vec<Stored> = ways
        .iter()
        .map(|way| way.store(&picture, folder.path()))
        .collect::<Result<_>>()?;
    let pixels = picture.pixels().len() as f64;
    let diagram =
        |file: &str, title: &str, cost: &str, of: &dyn Fn(&Stored) -> f64, why: &str| Diagram {
            file: file.into(),
            title: title.into(),
            input: format!(
                "{CARDS} cards over a noisy plate, {} x {}, values up to {:.2}",
                SIZE[0],
                SIZE[1],
                most(&picture)
            ),
            error: "RMS error, scene-linear".into(),
            cost: cost.into(),
            reference: "the picture before it is written".into(),
            points: ways
                .iter()
                .zip(&stored)
                .map(|(way, s)| way.point(of(s), s.error))
                .collect(),
            why: why.into(),
            ..Diagram::default()
        };
    Ok(vec![
        diagram(
            "encode_time",
            "encode: error against time",
            "CPU seconds per megapixel, writing",
            &|s| s.seconds / pixels * 1e6,
            &beside_jpeg(&ways, &stored),
        ),
        diagram(
            "encode_bytes",
            "encode: error against size",
            "bytes per pixel",
            &|s| s.bytes as f64 / pixels,
            "A dataset is written once and read often: `pictures.format = \"jpg\"` is for who pays for room.",
        ),
    ])
}

/// Why datasets have PNG.
fn beside_jpeg(ways: &[Way], stored: &[Stored]) -> String {
    let of = |curve: &str, setting: &str| {
        ways.iter()
            .position(|way| way.curve == curve && way.setting == setting)
            .map(|i| &stored[i])
    };
    let (Some(png), Some(jpeg)) = (of(PNG, "normal"), of("JPEG", "95")) else {
        return String::new();
    };
    format!(
        "Trainers read files of 8 bits: PNG loses what 8 bits lose, and takes {} of the time of JPEG at 95, which has {} times \
         its error in {} of its bytes. `reference` keeps half floats beside it.",
        three(png.seconds / jpeg.seconds),
        three(jpeg.error / png.error),
        three(jpeg.bytes as f64 / png.bytes as f64)
    )
}

fn ways() -> Vec<Way> {
    let usual = WriteOptions::default();
    let exr = |curve, name: &str, bits, compression| Way {
        curve,
        setting: name.into(),
        extension: "exr",
        options: WriteOptions {
            bits: Some(bits),
            compression,
            ..WriteOptions::default()
        },
    };
    let png = |curve, name: &str, bits, effort| Way {
        curve,
        setting: name.into(),
        extension: "png",
        options: WriteOptions {
            bits: Some(bits),
            png_effort: effort,
            ..WriteOptions::default()
        },
    };
    let jpeg = JPEG.map(|quality| Way {
        curve: "JPEG",
        setting: quality.to_string(),
        extension: "jpg",
        options: WriteOptions {
            jpeg_quality: quality,
            ..usual.clone()
        },
    });
    let mut all = vec![
        png(PNG, "draft", Bits::Eight, Quality::Draft),
        png(PNG, "normal", Bits::Eight, Quality::Normal),
        png(PNG, "reference", Bits::Eight, Quality::Reference),
        png("PNG, 16 bits", "normal", Bits::Sixteen, Quality::Normal),
        exr(HALF, "uncompressed", Bits::Half, Compression::None),
        exr(HALF, "PIZ", Bits::Half, Compression::Piz),
        exr(HALF, "ZIP", Bits::Half, Compression::Zip),
        exr("EXR, float", "ZIP", Bits::Float, Compression::Zip),
    ];
    all.extend(jpeg);
    all
}

impl Way {
    fn store(&self, picture: &Image<LinearRgb>, folder: &Path) -> Result<Stored> {
        let path = folder.join("picture").with_extension(self.extension);
        let ((), seconds) = timed(RUNS, || io::write_with(&path, picture, &self.options))?;
        let bytes = std::fs::metadata(&path)
            .map_err(|e| Error::file(&path, e))?
            .len();
        let back: Image<LinearRgb> = io::read(&path)?;
        Ok(Stored {
            seconds,
            bytes,
            error: rms(&back, picture),
        })
    }

    /// A PNG as datasets have it, or the EXR that a reference has beside it.
    fn point(&self, cost: f64, error: f64) -> Point {
        let is = |curve, setting| self.curve == curve && self.setting == setting;
        Point::new(self.curve, self.setting.clone(), cost, error).used_where(|quality| {
            let with_exr = quality.pictures(Default::default()).exr;
            is(PNG, "normal") || with_exr && is(HALF, "ZIP")
        })
    }
}

fn rms(a: &Image<LinearRgb>, b: &Image<LinearRgb>) -> f64 {
    let pairs = a.pixels().iter().zip(b.pixels());
    let squares = pairs
        .flat_map(|(a, b)| [a.r - b.r, a.g - b.g, a.b - b.b])
        .map(|d| f64::from(d).powi(2));
    (squares.sum::<f64>() / (3 * b.pixels().len()) as f64).sqrt()
}

fn most(picture: &Image<LinearRgb>) -> f32 {
    picture
        .pixels()
        .iter()
        .map(|c| c.r.max(c.g).max(c.b))
        .fold(0.0, f32::max)
}

/// A rendered pile over a plate with the noise of a camera.
fn picture() -> Image<LinearRgb> {
    let (w, h) = (SIZE[0] as usize, SIZE[1] as usize);
    let mut plate = Image::from_fn(w, h, |x, y| {
        let tile = if (x / 64 + y / 64).is_multiple_of(2) {
            0.28
        } else {
            0.35
        };
        LinearRgb::new(1.0, 0.9, 0.8).scale(tile * (0.8 + 0.2 * x as f32 / w as f32))
    });
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut grain = || GRAIN * (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5) as f32;
    plate
        .pixels_mut()
        .iter_mut()
        .for_each(|p| *p = *p + LinearRgb::new(grain(), grain(), grain()));
    let shot: Shot = pile(CARDS, SIZE).with_plate(Arc::new(plate));
    let deep = render(&shot, &Quality::default().render());
    composite::frame(&deep, shot.plate.as_deref()).map(PremulRgba::color)
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
            let way = ways()
                .into_iter()
                .find(|w| w.curve == curve && w.setting == setting)
                .unwrap();
            way.store(&ramp, folder.path()).unwrap().error
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
        let all: Vec<_> = ways().into_iter().filter(|w| w.curve == PNG).collect();
        let stored: Vec<_> = all
            .iter()
            .map(|w| w.store(&picture, folder.path()).unwrap())
            .collect();
        assert!(stored.iter().all(|s| s.error == stored[0].error));
        assert!(stored[3].bytes <= stored[0].bytes);
    }
}
