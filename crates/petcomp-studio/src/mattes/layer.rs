//! Layers: views of a cut-out, each as large as the photo.

use super::solve::{ShownCut, Solved};
use crate::message::Query;
use crate::picture::{at_most, jpeg};
use crate::refusal::{Answer, Refusal};
use crate::studio::Studio;
use crate::turn::blocking;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use petcomp::color::to_srgb8;
use petcomp::{Film, Image, LinearRgb, Mix, Roi, Srgb8, filter, io};
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;

/// Maximum longer side of a layer, pixels: the size of a screen.
const SHOWN_SIDE_PX: usize = 1600;
/// Side of a square of the checkerboard, pixels, and its two greys, scene-linear.
const CHECK_PX: usize = 12;
const CHECKS: [f32; 2] = [0.18, 0.36];
/// Expected error of the transmittance that has the brightest colour.
const LARGEST_UNCERTAINTY: f32 = 0.5;
/// Colours for no error, a medium and the largest one, display-encoded, 0 to 255.
const HEAT: [[f32; 3]; 3] = [
    [16.0, 18.0, 24.0],
    [196.0, 64.0, 40.0],
    [255.0, 236.0, 140.0],
];

#[derive(Deserialize)]
pub(super) struct LayerQuery {
    /// Number of the solved cut-out.
    number: u64,
    layer: Layer,
    /// The photo to composite it onto, for the layer `plate`.
    plate: Option<String>,
}

/// The kinds of layers.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Layer {
    /// The photo itself.
    Photo,
    /// The cut-out over a checkerboard.
    Checker,
    /// Over black.
    Black,
    /// Over white.
    White,
    /// Over a photo of a place, or over the uniform screen without one.
    Plate,
    /// Opacity: white is opaque.
    Matte,
    /// Transmittance along the line of sight, in colour.
    Transmittance,
    /// Expected error of the transmittance.
    Uncertainty,
}

pub(super) async fn layer(
    State(studio): State<Arc<Studio>>,
    Query(query): Query<LayerQuery>,
) -> Answer<Response> {
    let solved = studio.mattes.solved(query.number)?;
    let plate = query
        .plate
        .map(|name| studio.folder.file(&name))
        .transpose()?;
    blocking(move || shown(&solved, query.layer, plate.as_deref())).await
}

fn shown(solved: &Solved, layer: Layer, plate: Option<&Path>) -> Answer<Response> {
    let canvas = Canvas::of(solved.photo.picture().size());
    let cut = solved.cut.as_ref();
    match (layer, cut) {
        (Layer::Photo, _) => jpeg(&at_most(solved.photo.picture().clone(), SHOWN_SIDE_PX)),
        (_, None) => Err(Refusal::new(StatusCode::NOT_FOUND, "there is no cut-out")),
        (Layer::Matte, Some(cut)) => jpeg(&canvas.film(cut).map(opacity)),
        (Layer::Transmittance, Some(cut)) => jpeg(&canvas.film(cut).map(transmittance)),
        (Layer::Uncertainty, Some(cut)) => {
            jpeg(&canvas.placed(&cut.uncertainty, cut.roi).map(heat))
        }
        (_, Some(cut)) => jpeg(&over(&canvas, cut, layer, plate)?),
    }
}

/// The cut-out over a layer's background.
fn over(
    canvas: &Canvas,
    cut: &ShownCut,
    layer: Layer,
    plate: Option<&Path>,
) -> Answer<Image<Srgb8>> {
    let film = canvas.film(cut);
    let behind = |color: &(dyn Fn(usize, usize) -> LinearRgb + Sync)| {
        to_srgb8(&Image::from_fn(canvas.width, canvas.height, |x, y| {
            film[(x, y)].over_color(color(x, y))
        }))
    };
    Ok(match (layer, plate) {
        (Layer::Black, _) => behind(&|_, _| LinearRgb::BLACK),
        (Layer::White, _) => behind(&|_, _| LinearRgb::WHITE),
        (Layer::Plate, Some(path)) => {
            let plate = canvas.covered(&io::read(path)?);
            behind(&|x, y| plate[(x, y)])
        }
        (Layer::Plate, None) => behind(&|_, _| cut.screen),
        _ => behind(&checker),
    })
}

fn checker(x: usize, y: usize) -> LinearRgb {
    LinearRgb::grey(CHECKS[(x / CHECK_PX + y / CHECK_PX) % 2])
}

fn opacity(film: Film) -> Srgb8 {
    shade([255.0 * film.to_rgba().a; 3])
}

fn transmittance(film: Film) -> Srgb8 {
    shade(<[f32; 3]>::from(film.transmittance()).map(|v| 255.0 * v))
}

fn heat(uncertainty: f32) -> Srgb8 {
    let along = 2.0 * (uncertainty / LARGEST_UNCERTAINTY).clamp(0.0, 1.0);
    let [low, high] = if along < 1.0 { [0, 1] } else { [1, 2] };
    let share = along - low as f32;
    shade([0, 1, 2].map(|c| HEAT[low][c] + share * (HEAT[high][c] - HEAT[low][c])))
}

/// A colour of display-encoded channels, 0 to 255.
fn shade(channels: [f32; 3]) -> Srgb8 {
    let [r, g, b] = channels.map(|v| v.clamp(0.0, 255.0).round() as u8);
    Srgb8 { r, g, b }
}

/// The photo's rectangle at the size of the layer.
struct Canvas {
    width: usize,
    height: usize,
    /// Pixels of the canvas per pixel of the photo.
    scale: f64,
}

impl Canvas {
    fn of((width, height): (usize, usize)) -> Self {
        let scale = (SHOWN_SIDE_PX as f64 / width.max(height) as f64).min(1.0);
        let scaled = |side: usize| ((side as f64 * scale).round() as usize).max(1);
        Self {
            width: scaled(width),
            height: scaled(height),
            scale,
        }
    }

    fn film(&self, cut: &ShownCut) -> Image<Film> {
        self.placed(&cut.film, cut.roi)
    }

    /// A picture of a part of the photo, at its position.
    fn placed<P: Mix>(&self, part: &Image<P>, roi: Roi) -> Image<P> {
        let roi = self.scaled(roi);
        let part = filter::resize(part, roi.width.max(1), roi.height.max(1));
        let mut whole = Image::new(self.width, self.height);
        for y in 0..roi.height {
            let row = &mut whole.row_mut(roi.y + y)[roi.x..roi.x + roi.width];
            row.copy_from_slice(&part.row(y)[..roi.width]);
        }
        whole
    }

    fn scaled(&self, roi: Roi) -> Roi {
        let along = |from: usize, len: usize, end: usize| {
            let [low, high] = [from, from + len].map(|v| (v as f64 * self.scale).round() as usize);
            low.min(end)..high.min(end)
        };
        Roi::spanning(
            along(roi.x, roi.width, self.width),
            along(roi.y, roi.height, self.height),
        )
    }

    /// The middle of a picture, cropped to cover the canvas.
    fn covered(&self, picture: &Image<LinearRgb>) -> Image<LinearRgb> {
        let (w, h) = picture.size();
        let times = (self.width as f64 / w as f64).max(self.height as f64 / h as f64);
        let [width, height] = [(self.width, w), (self.height, h)]
            .map(|(side, of)| ((side as f64 / times).round() as usize).clamp(1, of));
        let middle = Roi {
            x: (w - width) / 2,
            y: (h - height) / 2,
            width,
            height,
        };
        filter::resize(&picture.crop(middle), self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_comes_to_its_place_at_the_size_that_is_shown() {
        let canvas = Canvas::of((4000, 3000));
        assert_eq!((canvas.width, canvas.height), (1600, 1200));
        let roi = Roi {
            x: 1000,
            y: 2000,
            width: 3000,
            height: 1000,
        };
        let placed = canvas.placed(&Image::filled(300, 100, 1.0f32), roi);
        let at = |x: usize, y: usize| placed[(x, y)];
        assert_eq!((at(399, 900), at(400, 799), at(401, 801)), (0.0, 0.0, 1.0));
        assert_eq!(at(1599, 1199), 1.0);
    }

    #[test]
    fn a_plate_of_any_shape_covers_the_canvas() {
        let canvas = Canvas::of((60, 40));
        for size in [(7, 90), (300, 20), (1, 1)] {
            let plate = Image::filled(size.0, size.1, LinearRgb::WHITE);
            assert_eq!(canvas.covered(&plate).size(), (60, 40));
        }
    }
}
