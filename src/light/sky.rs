//! An environment map as few directions, each standing for a piece of the sky.

use crate::asset::Piece;
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
/// that the receiver's horizon does not cut gives exactly `n . integral of L w dw`; what the
/// horizon cuts off others is made up for by scaling all to the irradiance that a sum over the
/// whole map gives.
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
    let seen = visible_pieces(pieces, &local, whole);
    let scale = irradiance_scale(&seen, whole, f64::from(map.strength));
    seen.into_iter()
        .map(|piece| piece.in_world(map.rotation, scale))
        .collect()
}

/// The pieces over a horizon; one piece for all of its light where a map gives some and none of its
/// pieces does.
fn visible_pieces(
    pieces: &[Piece],
    normal: &Vector3<f64>,
    irradiance: [f64; 3],
) -> Vec<VisiblePiece> {
    let mut seen: Vec<_> = pieces
        .iter()
        .filter_map(|piece| VisiblePiece::over_horizon(piece, normal))
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

    /// None for a piece below a receiver's horizon.
    fn over_horizon(piece: &Piece, normal: &Vector3<f64>) -> Option<Self> {
        let direction = piece.moments.direction()?;
        let irradiance = piece.moments.irradiance(normal);
        let lights = direction.dot(normal) > 0.0 && irradiance.iter().any(|&v| v > 0.0);
        lights.then_some(Self {
            direction,
            irradiance,
            width: piece.moments.width(),
        })
    }
}
