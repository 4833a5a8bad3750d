//! Directions and places in an equirectangular picture.

use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::{LinearRgb, Mix};
use std::f64::consts::{PI, TAU};

/// Where a direction (of any length but 0) lies in an equirectangular picture, 0 to 1, right and down.
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

/// The colour at a place of a picture (in one piece: light sums call it several times a texel): bilinear between texel centres, around in `u`, the outermost row going on in `v`.
pub(super) fn sample(image: &Image<LinearRgb>, [u, v]: [f64; 2]) -> LinearRgb {
    let (width, height) = image.size();
    let x = u * width as f64 - 0.5;
    let y = (v * height as f64 - 0.5).clamp(0.0, height as f64 - 1.0);
    let (floor_x, floor_y) = (x.floor(), y.floor());
    let left = wrapped_column(floor_x, width);
    let right = wrapped_column(floor_x + 1.0, width);
    let (top, bottom) = (floor_y as usize, (floor_y as usize + 1).min(height - 1));
    let (s, t) = ((x - floor_x) as f32, (y - floor_y) as f32);
    LinearRgb::BLACK
        .add_scaled((1.0 - s) * (1.0 - t), image[(left, top)])
        .add_scaled(s * (1.0 - t), image[(right, top)])
        .add_scaled((1.0 - s) * t, image[(left, bottom)])
        .add_scaled(s * t, image[(right, bottom)])
}

/// A column of a picture that goes on at its other side.
#[inline]
fn wrapped_column(i: f64, width: usize) -> usize {
    i.rem_euclid(width as f64) as usize % width
}
