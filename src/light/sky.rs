//! An environment map as few directions, each standing for a piece of the sky.

use crate::asset::{Moments, Panorama, Piece};
use crate::geom::Vector3;
use crate::pixel::LinearRgb;
use crate::scene::{EnvironmentMap, turned};
use crate::work::{self, Kind};

/// A direction that represents a piece of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPiece {
    /// Unit vector towards the middle of the piece's light.
    pub direction: Vector3<f64>,
    /// Irradiance that the piece gives a receiver where nothing is in its way.
    pub irradiance: LinearRgb,
    /// Side of the square of sky that holds its light, radians.
    pub width: f64,
}

/// The sky over a receiver with this unit normal, as at most `count` pieces.
///
/// Pieces add up to the irradiance of the whole map on the receiver, nothing in the way.
///
/// # Method
/// The map is cut into rectangles in the way that makes the errors of shadows smallest
/// ([`Panorama::pieces`](crate::asset::Panorama::pieces)), so a sun is a piece of its own. A piece
/// that the receiver's horizon does not cut gives exactly `n . integral of L w dw`; others give what
/// their parts over the horizon do, and all are scaled to the irradiance that a sum over the whole
/// map gives.
pub fn sky_pieces(map: &EnvironmentMap, count: usize, normal: &Vector3<f64>) -> Vec<SkyPiece> {
    scaled_pieces(map, &map.panorama.pieces(count), normal)
}

/// The same in even rectangles, about `count` of them: slower to converge, and simpler.
pub(crate) fn sky_cells(
    map: &EnvironmentMap,
    count: usize,
    normal: &Vector3<f64>,
) -> Vec<SkyPiece> {
    let rows = (count as f64 / 2.0).sqrt().ceil() as usize;
    scaled_pieces(map, &map.panorama.even(rows), normal)
}

/// Side of a square as large as half the sky, radians: `sqrt(2 pi)`.
const HALF_SKY_WIDTH: f64 = 2.506_628_274_631;

/// The pieces over a receiver's horizon, scaled to the irradiance of the whole map.
fn scaled_pieces(map: &EnvironmentMap, pieces: &[Piece], normal: &Vector3<f64>) -> Vec<SkyPiece> {
    work::add(Kind::MapPieces, pieces.len() as u64);
    // In the frame of the picture, which the map is turned against.
    let local = turned(normal, map.rotation);
    let whole = map.panorama.irradiance(&local);
    let seen = visible_pieces(&map.panorama, pieces, &local, whole);
    let scale = irradiance_scale(&seen, whole, f64::from(map.strength));
    seen.into_iter()
        .map(|piece| piece.in_world(map.rotation, scale))
        .collect()
}

/// The pieces over a horizon; one piece for all of its light where a map gives some and none of its
/// pieces does.
fn visible_pieces(
    panorama: &Panorama,
    pieces: &[Piece],
    normal: &Vector3<f64>,
    irradiance: [f64; 3],
) -> Vec<VisiblePiece> {
    let mut seen: Vec<_> = pieces
        .iter()
        .filter_map(|piece| VisiblePiece::of_light(&panorama.light_above(piece, normal), normal))
        .collect();
    if seen.is_empty() && irradiance.iter().any(|&e| e > 0.0) {
        // A sun has taken all the cuts, on the other side: what little there is here is one piece.
        seen.push(VisiblePiece {
            direction: *normal,
            irradiance,
            width: HALF_SKY_WIDTH,
        });
    }
    seen
}

/// Factors that make pieces add up to the irradiance of the whole map times its strength.
fn irradiance_scale(pieces: &[VisiblePiece], whole: [f64; 3], strength: f64) -> [f64; 3] {
    std::array::from_fn(|c| {
        let sum = pieces.iter().fold(0.0, |sum, p| sum + p.irradiance[c]);
        if sum > 0.0 {
            strength * whole[c] / sum
        } else {
            0.0
        }
    })
}

/// A piece in the frame of the picture.
struct VisiblePiece {
    direction: Vector3<f64>,
    irradiance: [f64; 3],
    width: f64,
}

impl VisiblePiece {
    /// The same in the world, its light scaled.
    fn in_world(&self, rotation: f64, scale: [f64; 3]) -> SkyPiece {
        let irradiance = std::array::from_fn(|c| (self.irradiance[c] * scale[c]) as f32);
        SkyPiece {
            direction: turned(&self.direction, -rotation),
            irradiance: LinearRgb::from(irradiance),
            width: self.width,
        }
    }

    /// None where no light is.
    fn of_light(light: &Moments, normal: &Vector3<f64>) -> Option<Self> {
        Some(Self {
            direction: light.direction()?,
            irradiance: light.irradiance(normal),
            width: light.width(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::uv_to_direction;
    use crate::image::Image;
    use std::sync::Arc;

    /// Dim, with two bright windows; dark where it is not lit.
    fn room(is_lit: impl Fn(&Vector3<f64>) -> bool + Sync) -> EnvironmentMap {
        let windows = [0.0_f64, 120.0].map(|azimuth| {
            let (sin, cos) = libm::sincos(azimuth.to_radians());
            Vector3::new(cos, sin, 0.6).normalize()
        });
        let image = Image::from_fn(256, 128, |x, y| {
            let direction = uv_to_direction([(x as f64 + 0.5) / 256.0, (y as f64 + 0.5) / 128.0]);
            let is_window = windows.iter().any(|window| window.dot(&direction) > 0.978);
            let radiance = if is_window { 300.0 } else { 0.25 };
            LinearRgb::grey(if is_lit(&direction) { radiance } else { 0.0 })
        });
        EnvironmentMap::new(Arc::new(Panorama::new(image).unwrap()))
    }

    /// The windows take nearly all cuts: the floor stays one piece, whose middle is below the
    /// horizon of what stands upright.
    #[test]
    fn what_turns_away_from_windows_gets_the_light_of_the_floor() {
        let (whole, floor) = (room(|_| true), room(|direction| direction.z < 0.0));
        for (tilt, azimuth) in [(60.0_f64, 240.0_f64), (90.0, 240.0), (90.0, 260.0)] {
            let (sin, cos) = libm::sincos(tilt.to_radians());
            let (y, x) = libm::sincos(azimuth.to_radians());
            let normal = Vector3::new(sin * x, sin * y, cos);
            let pieces = sky_pieces(&whole, 32, &normal);
            let below = pieces.iter().filter(|piece| piece.direction.z < 0.0);
            let found: f32 = below.map(|piece| piece.irradiance.g).sum();
            let expected = floor.panorama.irradiance(&normal)[1] as f32;
            assert!(
                (found / expected - 1.0).abs() < 0.1,
                "{tilt} {azimuth}: {found} of {expected}"
            );
        }
    }
}
