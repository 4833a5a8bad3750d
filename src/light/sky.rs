//! An environment map as few directions, each standing for a piece of the sky.

use crate::asset::Piece;
use crate::geom::Vector3;
use crate::pixel::LinearRgb;
use crate::scene::{EnvironmentMap, turned};
use crate::work::{self, Kind};

/// A direction that stands for a piece of the sky.
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
/// The map is cut into rectangles in the way that makes the errors of shadows smallest ([`Panorama::pieces`](crate::asset::Panorama::pieces)), so a sun is
/// a piece of its own. A piece that the receiver's horizon does not cut gives exactly `n . integral of L w dw`; what the
/// horizon cuts off others is made up for by scaling all to the irradiance that a sum over the whole map gives.
pub fn sky_pieces(map: &EnvironmentMap, count: usize, normal: &Vector3<f64>) -> Vec<SkyPiece> {
    scaled(map, &map.panorama.pieces(count), normal)
}

/// The same in even rectangles, about `count` of them: slower to come right, with nothing to go wrong.
pub(crate) fn sky_cells(
    map: &EnvironmentMap,
    count: usize,
    normal: &Vector3<f64>,
) -> Vec<SkyPiece> {
    let rows = (count as f64 / 2.0).sqrt().ceil() as usize;
    scaled(map, &map.panorama.even(rows), normal)
}

/// Side of a square as large as half the sky, radians: `sqrt(2 pi)`.
const HALF_OF_THE_SKY: f64 = 2.506_628_274_631;

fn scaled(map: &EnvironmentMap, pieces: &[Piece], normal: &Vector3<f64>) -> Vec<SkyPiece> {
    work::add(Kind::MapPieces, pieces.len() as u64);
    // In the frame of the picture, which the map is turned against.
    let local = turned(normal, map.rotation);
    let mut seen: Vec<_> = pieces
        .iter()
        .filter_map(|piece| over(piece, &local))
        .collect();
    let whole = map.panorama.irradiance(&local);
    if seen.is_empty() && whole.iter().any(|&e| e > 0.0) {
        // A sun has taken all the cuts, on the other side: what little there is here is one piece.
        seen.push((local, whole, HALF_OF_THE_SKY));
    }
    let sum = seen.iter().fold([0.0; 3], |sum, (_, e, _)| {
        std::array::from_fn(|c| sum[c] + e[c])
    });
    let strength = f64::from(map.strength);
    let scale: [f64; 3] = std::array::from_fn(|c| {
        if sum[c] > 0.0 {
            strength * whole[c] / sum[c]
        } else {
            0.0
        }
    });
    let piece = |(direction, e, width): (Vector3<f64>, [f64; 3], f64)| SkyPiece {
        direction: turned(&direction, -map.rotation),
        irradiance: std::array::from_fn(|c| (e[c] * scale[c]) as f32).into(),
        width,
    };
    seen.into_iter().map(piece).collect()
}

/// Direction, irradiance and width of a piece over a horizon; none for one below it.
fn over(piece: &Piece, normal: &Vector3<f64>) -> Option<(Vector3<f64>, [f64; 3], f64)> {
    let direction = piece.moments.direction()?;
    let e = piece.moments.irradiance(normal);
    (direction.dot(normal) > 0.0 && e.iter().any(|&v| v > 0.0)).then_some((
        direction,
        e,
        piece.moments.width(),
    ))
}
