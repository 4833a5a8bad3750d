//! What a capture measured, as pictures: transmittance, refraction as colour, and a checkerboard
//! seen through the object.

use crate::color::{Hsv, hsv_to_rgb, to_srgb8};
use crate::filter::Pyramid;
use crate::geom::Point2;
use crate::image::Image;
use crate::matte::Flow;
use crate::pixel::{Film, LinearRgb, Srgb8};
use crate::quantile::quantile;
use std::f64::consts::TAU;

/// Side of a square of the checkerboard, pixels: larger than what film is shown over, so that its
/// edges are seen to bend.
const SQUARE_PX: usize = 16;
const CHECKER_GREYS: [f32; 2] = [0.08, 0.6];
/// Light of what the object covers where refraction is not known.
const UNKNOWN: LinearRgb = LinearRgb::grey(0.05);
/// Share of the known displacements that are shown with less than full saturation.
const SATURATED_SHARE: f64 = 0.95;

/// Transmittance; with a flow, that as colour and a checkerboard seen through it, too.
pub(super) fn tiles(flow: Option<&Flow>, film: &Image<Film>) -> Vec<Image<Srgb8>> {
    let transmittance = to_srgb8(&film.map(Film::transmittance));
    let flow = flow.into_iter().flat_map(|flow| {
        [
            to_srgb8(&flow_colors(flow, film)),
            to_srgb8(&bent_checkerboard(flow, film)),
        ]
    });
    [transmittance].into_iter().chain(flow).collect()
}

/// Direction as hue, from red to the right clockwise, and length as saturation.
fn flow_colors(flow: &Flow, film: &Image<Film>) -> Image<LinearRgb> {
    let full = full_saturation(flow);
    over_texture(film, |uv, film| match flow.at(uv) {
        Some(path) => wheel_color(path.displacement, full),
        None if film.opacity.is_black() => LinearRgb::WHITE,
        None => UNKNOWN,
    })
}

/// The length, metres, that most displacements do not reach.
fn full_saturation(flow: &Flow) -> f32 {
    let pixels = flow.paths.pixels().iter().zip(flow.known.pixels());
    let lengths = pixels.filter(|(_, known)| **known).map(|(path, _)| {
        let [x, y] = path.displacement;
        libm::hypotf(x, y)
    });
    quantile(lengths.collect(), SATURATED_SHARE, f32::total_cmp).unwrap_or(1.0)
}

fn wheel_color([x, y]: [f32; 2], full: f32) -> LinearRgb {
    let angle = libm::atan2(y.into(), x.into()) / TAU;
    hsv_to_rgb(Hsv {
        h: angle.rem_euclid(1.0) as f32,
        s: (libm::hypotf(x, y) / full.max(f32::MIN_POSITIVE)).min(1.0),
        v: 1.0,
    })
}

/// A checkerboard on which the object lies, as it lay on the display.
fn bent_checkerboard(flow: &Flow, film: &Image<Film>) -> Image<LinearRgb> {
    let px_per_metre = film.width() as f64 / flow.width;
    let (w, h) = film.size();
    let board = Pyramid::new(Image::from_fn(w, h, checkerboard));
    over_texture(film, |[u, v], film| {
        let path = flow.at([u, v]).unwrap_or_default();
        let at = Point2::new(u * w as f64, v * h as f64);
        film.over_color(path.scaled(px_per_metre as f32).seen(&board, at))
    })
}

fn checkerboard(x: usize, y: usize) -> LinearRgb {
    let squares = x / SQUARE_PX + y / SQUARE_PX;
    LinearRgb::grey(CHECKER_GREYS[squares % 2])
}

/// A picture by texture coordinates and film.
fn over_texture(
    film: &Image<Film>,
    color: impl Fn([f64; 2], Film) -> LinearRgb + Sync,
) -> Image<LinearRgb> {
    let (w, h) = film.size();
    Image::from_fn(w, h, |x, y| {
        let uv = [(x as f64 + 0.5) / w as f64, (y as f64 + 0.5) / h as f64];
        color(uv, film[(x, y)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matte::LightPath;

    #[test]
    fn a_displacement_moves_what_is_seen_and_has_a_colour() {
        let film = Image::filled(64, 32, Film::new(LinearRgb::BLACK, LinearRgb::WHITE));
        // One square of the checkerboard to the right.
        let bent = |displacement: [f32; 2]| LightPath {
            displacement,
            ..LightPath::default()
        };
        let flow = Flow {
            paths: Image::filled(64, 32, bent([0.1, 0.0])),
            known: Image::filled(64, 32, true),
            width: 0.4,
            height: 0.01,
        };
        let still = bent_checkerboard(
            &Flow {
                paths: Image::filled(64, 32, bent([0.0; 2])),
                ..flow.clone()
            },
            &film,
        );
        let bent = bent_checkerboard(&flow, &film);
        // The board ends with the cut-out.
        let (across, down) = (64 - SQUARE_PX, 32);
        let places = (0..down).flat_map(|y| (0..across).map(move |x| (x, y)));
        assert!(places.into_iter().all(|at| bent[at] != still[at]));
        let colors = flow_colors(&flow, &film);
        assert!(colors[(5, 5)].r > 0.9 && colors[(5, 5)].g < 0.1);
        assert_eq!(tiles(None, &film).len(), 1);
        assert_eq!(tiles(Some(&flow), &film).len(), 3);
    }
}
