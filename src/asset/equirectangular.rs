//! Directions and places in an equirectangular picture.

use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::{LinearRgb, Mix};
use std::f64::consts::{PI, TAU};

/// Where a direction (of any length but 0) lies in an equirectangular picture, 0 to 1, right and
/// down.
pub(crate) fn direction_to_uv(direction: &Vector3<f64>) -> [f64; 2] {
    let u = 0.5 - libm::atan2(direction.y, direction.x) / TAU;
    let v = libm::atan2(direction.xy().norm(), direction.z) / PI;
    [u, v]
}

/// The unit direction that a place in an equirectangular picture shows.
pub fn uv_to_direction([u, v]: [f64; 2]) -> Vector3<f64> {
    let (sin, cos) = libm::sincos((0.5 - u) * TAU);
    let (radius, z) = libm::sincos(v * PI);
    Vector3::new(radius * cos, radius * sin, z)
}

/// The colour at a place of a picture: bilinear between texel centres, around in `u`, the outermost
/// row going on in `v`.
///
/// Its parts are inlined: light sums call it several times a texel.
pub(super) fn sample(image: &Image<LinearRgb>, [u, v]: [f64; 2]) -> LinearRgb {
    let (width, height) = image.size();
    let (left, right, s) = columns_around(u, width);
    let (top, bottom, t) = rows_around(v, height);
    LinearRgb::BLACK
        .add_scaled((1.0 - s) * (1.0 - t), image[(left, top)])
        .add_scaled(s * (1.0 - t), image[(right, top)])
        .add_scaled((1.0 - s) * t, image[(left, bottom)])
        .add_scaled(s * t, image[(right, bottom)])
}

/// The columns on both sides of a place, and how far it is from the left one to the right one.
#[inline]
fn columns_around(u: f64, width: usize) -> (usize, usize, f32) {
    let x = u * width as f64 - 0.5;
    let floor = x.floor();
    let [left, right] = [floor, floor + 1.0].map(|i| wrapped_column(i, width));
    (left, right, (x - floor) as f32)
}

/// The rows on both sides of a place, and how far it is from the upper one to the lower one.
#[inline]
fn rows_around(v: f64, height: usize) -> (usize, usize, f32) {
    let y = (v * height as f64 - 0.5).clamp(0.0, height as f64 - 1.0);
    let floor = y.floor();
    let top = floor as usize;
    (top, (top + 1).min(height - 1), (y - floor) as f32)
}

/// A column of a picture that wraps around.
#[inline]
fn wrapped_column(i: f64, width: usize) -> usize {
    i.rem_euclid(width as f64) as usize % width
}
