//! Edges of cut-outs, softened or moved inwards.

use super::painted_plane::{PaintedPlane, padded};
use crate::asset::SurfaceTexel;
use crate::filter::gaussian_blur;
use crate::image::Image;
use crate::pixel::{Film, Mix};
use crate::scene::EdgeTreatment;

/// Standard deviation of the blur for softening and eroding edges, pixels of the picture.
const SIGMA_PX: f32 = 0.5;
/// Width of the softened band around an edge, as the standard deviation of a Gaussian, pixels.
const BAND_SIGMA_PX: f32 = 1.0;
/// Blurred coverage at which nothing of an eroded edge is left, and at which all of it is: a
/// quarter and three quarters of a pixel inwards, `Phi(0.5)` and `Phi(1.5)`.
const ERODED: [f32; 2] = [0.691_5, 0.933_2];

/// Treats the edges of a painted plane; `pixel` is the side of the picture's pixels in texels.
///
/// # Method
/// The edge is where the object's coverage, blurred by a Gaussian, is a half; along a straight one
/// the blurred coverage gives the distance. An eroded matte thresholds the blurred coverage at a
/// higher value.
pub(super) fn treat(
    plane: &mut PaintedPlane,
    surface: &Image<SurfaceTexel>,
    treatment: EdgeTreatment,
    pixel: f32,
) {
    let margin = (3.0 * BAND_SIGMA_PX * pixel).ceil() as usize;
    *plane = plane.padded(margin);
    let body = padded(&surface.map(|texel| texel.body), margin);
    plane.film = match treatment {
        EdgeTreatment::Soft => soft(&plane.film, &body, pixel),
        _ => eroded(&plane.film, &body, pixel),
    };
}

fn soft(film: &Image<Film>, body: &Image<f32>, pixel: f32) -> Image<Film> {
    let blurred = gaussian_blur(film, SIGMA_PX * pixel);
    let near = gaussian_blur(body, BAND_SIGMA_PX * pixel);
    film.zip3_map(&blurred, &near, |sharp, soft, near| {
        let weight = 1.0 - (2.0 * near - 1.0).powi(2);
        scaled(sharp, 1.0 - weight).add_scaled(weight, soft)
    })
}

fn eroded(film: &Image<Film>, body: &Image<f32>, pixel: f32) -> Image<Film> {
    let near = gaussian_blur(body, SIGMA_PX * pixel);
    let [none, all] = ERODED;
    film.zip_map(&near, |film, near| {
        scaled(film, ((near - none) / (all - none)).clamp(0.0, 1.0))
    })
}

fn scaled(film: Film, by: f32) -> Film {
    Film::default().add_scaled(by, film)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Point2;
    use crate::pixel::LinearRgb;

    /// An opaque white square of 60 texels.
    fn treated(treatment: EdgeTreatment, pixel: f32) -> Image<Film> {
        let is_inside = |x: usize, y: usize| (20..80).contains(&x) && (20..80).contains(&y);
        let film = Image::from_fn(100, 100, |x, y| {
            let level = if is_inside(x, y) {
                LinearRgb::WHITE
            } else {
                LinearRgb::BLACK
            };
            Film {
                color: level,
                opacity: level,
            }
        });
        let surface = film.map(|film| SurfaceTexel {
            body: film.opacity.r,
            glint: 0.0,
        });
        let mut plane = PaintedPlane {
            film,
            corner: Point2::new(-0.5, 0.5),
            texel: [0.01; 2],
        };
        treat(&mut plane, &surface, treatment, pixel);
        let margin = f64::from((3.0 * pixel).ceil());
        let moved = plane.position(&Point2::new(-0.5, 0.5));
        assert!(moved.iter().all(|m| (m - margin).abs() < 1e-9));
        plane.film
    }

    fn area(film: &Image<Film>) -> f32 {
        film.pixels().iter().map(|film| film.opacity.g).sum()
    }

    #[test]
    fn an_eroded_square_is_half_a_pixel_smaller_on_each_side() {
        for pixel in [2.0_f32, 3.3, 7.0] {
            let side = area(&treated(EdgeTreatment::Eroded, pixel)).sqrt();
            let lost = (60.0 - side) / 2.0 / pixel;
            assert!((lost - 0.5).abs() < 0.1, "{pixel}: {lost} pixels");
        }
    }

    #[test]
    fn a_soft_square_keeps_its_area_its_middle_and_its_colour() {
        let film = treated(EdgeTreatment::Soft, 3.0);
        assert!((area(&film) / 3600.0 - 1.0).abs() < 2e-3);
        let margin = 9;
        assert_eq!(film[(50 + margin, 50 + margin)].opacity.g, 1.0);
        // Next to the edge, on either side: a Gaussian of 1.5 texels, a third of a sigma away.
        let [inside, outside] = [20, 19].map(|x| film[(x + margin, 50 + margin)].opacity.g);
        assert!((inside - 0.63).abs() < 0.03 && (outside - 0.37).abs() < 0.03);
        let straight = film.pixels().iter().filter(|film| film.opacity.g > 0.0);
        assert!({ straight }.all(|film| (film.color.g / film.opacity.g - 1.0).abs() < 1e-4));
    }
}
