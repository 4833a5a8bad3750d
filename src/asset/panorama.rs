//! A picture of everything around: an equirectangular environment map.

use super::equirectangular::{direction_to_uv, sample};
use super::moments::{LightSums, Moments, Piece};
use crate::error::{Error, Result};
use crate::geom::Vector3;
use crate::image::Image;
use crate::io::{self, Format};
use crate::pixel::LinearRgb;
use std::path::Path;
use std::sync::OnceLock;

/// Radiance from every direction, as an equirectangular picture, scene-linear.
///
/// Row 0 is straight up (`+z`); the middle column is `+x`, and `+y` lies at a quarter of the width.
#[derive(Debug)]
pub struct Panorama {
    image: Image<LinearRgb>,
    /// Made when light is first requested.
    sums: OnceLock<LightSums>,
}

impl Panorama {
    /// A panorama from its picture.
    ///
    /// # Errors
    /// [`Error::Value`] for a picture without pixels, or with a value that is negative, NaN or
    /// infinite.
    pub fn new(image: Image<LinearRgb>) -> Result<Self> {
        check_radiance(&image).map_err(|what| Error::value("environment", what))?;
        Ok(Self {
            image,
            sums: OnceLock::new(),
        })
    }

    /// Reads a panorama from a file, usually HDR or EXR.
    ///
    /// # Errors
    /// Those of [`io::read`]; those of [`new`](Self::new), and [`Error::Field`] for a picture that
    /// is not twice as wide as high, naming the file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::of_file(io::read(path)?, path)
    }

    /// A panorama from the picture of a file.
    ///
    /// # Errors
    /// Those of [`read`](Self::read) for a picture that was read.
    pub(crate) fn of_file(image: Image<LinearRgb>, path: &Path) -> Result<Self> {
        check_shape(image.size()).map_err(|e| e.in_file(path))?;
        Self::new(image).map_err(|e| e.in_file(path))
    }

    /// The picture.
    pub fn image(&self) -> &Image<LinearRgb> {
        &self.image
    }

    /// Radiance from a direction of any length.
    ///
    /// # Method
    /// Bilinear between texel centres, around in `u`, the outermost row continuing in `v`.
    pub fn radiance(&self, direction: &Vector3<f64>) -> LinearRgb {
        sample(&self.image, direction_to_uv(direction))
    }

    /// The panorama cut into at most `count` (at least 2) rectangles, small where light is strong
    /// and uneven.
    ///
    /// # Method
    /// The rectangle that would cause the largest error in shadows if all its light came from one
    /// direction is cut in two where that leaves the least; so a sun ends up alone. More
    /// pieces cut fewer pieces further. As median cut [Debevec 2005], with the error of shadow
    /// edges for the energy.
    ///
    /// [Debevec 2005]: https://doi.org/10.1145/1187297.1187387
    pub fn pieces(&self, count: usize) -> Vec<Piece> {
        self.sums().pieces(count)
    }

    /// The panorama in even rectangles, `rows` of twice as many.
    pub(crate) fn even(&self, rows: usize) -> Vec<Piece> {
        self.sums().even(rows)
    }

    /// The light of a piece as far as it comes from over a receiver's horizon.
    pub(crate) fn light_above(&self, piece: &Piece, normal: &Vector3<f64>) -> Moments {
        self.sums().light_above(piece, normal)
    }

    /// Irradiance on a receiver with this unit normal, nothing in the way; red, green, blue.
    pub fn irradiance(&self, normal: &Vector3<f64>) -> [f64; 3] {
        self.sums().irradiance(normal)
    }

    fn sums(&self) -> &LightSums {
        if let Some(sums) = self.sums.get() {
            return sums;
        }
        // Summed before the cell is locked: the work is parallel, and a thread that waits may come
        // back here.
        let sums = LightSums::new(&self.image);
        self.sums.get_or_init(|| sums)
    }
}

/// Fails for an ordinary photo; a map that was reduced may be off by a pixel or a percent.
fn check_shape((width, height): (usize, usize)) -> Result<()> {
    let twice = 2 * height;
    if width.abs_diff(twice) <= (twice / 100).max(1) {
        return Ok(());
    }
    let what = format!("{width} x {height} pixels, expected an equirectangular map, 2 to 1");
    Err(Error::value("environment", what))
}

/// Of 8 bits the brightest are cut off, and with them most of the light of lamps and of the sun.
pub(crate) fn warn_of_bits(path: &Path) -> Result<()> {
    let header = io::read_header(path)?;
    if header.bits == 8 && header.format != Format::Hdr {
        let path = path.display();
        log::warn!(
            "{path}: 8 bits, clipped at 1: lamps and the sun are too weak; expected HDR or EXR"
        );
    }
    Ok(())
}

/// What is wrong with a picture that cannot be radiance.
fn check_radiance(image: &Image<LinearRgb>) -> std::result::Result<(), String> {
    if image.is_empty() {
        return Err("0 pixels, expected at least one".into());
    }
    let impossible = image.pixels().iter().position(|c| !is_radiance(c));
    impossible.map_or(Ok(()), |i| {
        let (x, y) = (i % image.width(), i / image.width());
        let value = <[f32; 3]>::from(image[(x, y)]);
        Err(format!(
            "{value:?} at ({x}, {y}), expected numbers of at least 0"
        ))
    })
}

fn is_radiance(c: &LinearRgb) -> bool {
    c.is_finite() && c.r >= 0.0 && c.g >= 0.0 && c.b >= 0.0
}

#[cfg(test)]
mod tests {
    use super::super::uv_to_direction;
    use super::*;

    #[test]
    fn the_axes_lie_where_the_definition_says() {
        let table = [
            (Vector3::x(), [0.5, 0.5]),
            (Vector3::y(), [0.25, 0.5]),
            (-Vector3::y(), [0.75, 0.5]),
        ];
        for (direction, [u, v]) in table {
            let found = direction_to_uv(&direction);
            assert!(
                (found[0] - u).abs() < 1e-12 && (found[1] - v).abs() < 1e-12,
                "{direction:?}: {found:?}"
            );
        }
        assert_eq!(direction_to_uv(&Vector3::z())[1], 0.0);
        assert!((direction_to_uv(&-Vector3::z())[1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn places_and_directions_go_back_and_forth() {
        for (i, j) in (0..16).flat_map(|i| (0..8).map(move |j| (i, j))) {
            let uv = [(f64::from(i) + 0.5) / 16.0, (f64::from(j) + 0.5) / 8.0];
            let back = direction_to_uv(&uv_to_direction(uv));
            assert!((back[0] - uv[0]).abs() < 1e-12 && (back[1] - uv[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn texel_centres_give_texels_and_the_seam_is_closed() {
        let image = Image::from_fn(8, 4, |x, y| LinearRgb::grey((x + 10 * y) as f32));
        let panorama = Panorama::new(image).unwrap();
        let at = |u: f64, v: f64| panorama.radiance(&uv_to_direction([u, v])).g;
        assert!((at(2.5 / 8.0, 1.5 / 4.0) - 12.0).abs() < 1e-4);
        assert!(
            (at(0.0, 1.5 / 4.0) - 13.5).abs() < 1e-4,
            "half of texel 7, half of texel 0"
        );
        assert!(
            (panorama.radiance(&Vector3::z()).g - at(0.5, 1e-9)).abs() < 1e-3,
            "the pole belongs to row 0"
        );
    }

    #[test]
    fn what_is_not_light_is_refused() {
        assert!(Panorama::new(Image::new(0, 0)).is_err());
        for bad in [f32::NAN, f32::INFINITY, -1.0] {
            let mut image = Image::filled(4, 2, LinearRgb::WHITE);
            image.pixels_mut()[5].g = bad;
            assert!(
                Panorama::new(image)
                    .unwrap_err()
                    .to_string()
                    .contains("(1, 1)")
            );
        }
    }

    #[test]
    fn a_map_is_twice_as_wide_as_high() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.png");
        let read = |w, h| {
            io::write(&path, &Image::filled(w, h, LinearRgb::WHITE)).unwrap();
            Panorama::read(&path)
        };
        let told = read(30, 40).unwrap_err().to_string();
        let expected =
            "map.png: environment: 30 x 40 pixels, expected an equirectangular map, 2 to 1";
        assert!(told.ends_with(expected), "{told}");
        assert!(read(40, 40).is_err());
        for (w, h) in [(40, 20), (41, 20), (404, 200)] {
            assert!(read(w, h).is_ok(), "{w} x {h}");
        }
    }

    #[test]
    fn one_pixel_is_everywhere() {
        let panorama = Panorama::new(Image::filled(1, 1, LinearRgb::grey(2.0))).unwrap();
        assert_eq!(panorama.radiance(&Vector3::new(0.3, -0.2, -0.9)).r, 2.0);
    }
}
