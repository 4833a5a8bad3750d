//! Pictures through a lens with distortion.
//!
//! Everything in a picture of planes is linear in `(x, y, 1)`, and an affine map preserves this. So
//! the stack of layers is built for the pinhole camera that sees everything in the distorted
//! picture; each small tile of the picture then samples the layers through the tangent of the
//! distortion there. Nothing is resampled: a sub-sample of the picture is a sub-sample of the
//! cards.

use crate::camera::{Camera, RadialDistortion};
use crate::geom::{Point2, Vector2};
use crate::render::block::PixelBlock;
use crate::render::lattice::Lattice;
use crate::render::layers::{BentLattice, LayerStack};
use crate::scene::Shot;

/// Maximum deviation of the tangent from the distortion at a corner of a tile, pixels: four codes
/// of 8 bits on an edge from black to white.
const TANGENT_ERROR_PX: f64 = 0.016;
/// Sides of tiles; the largest with a small enough error is used.
const TILE_SIDES_PX: [usize; 4] = [32, 16, 8, 4];
/// Margin of the pinhole camera around the visible part, pixels: sub-samples reach out of it.
const MARGIN_PX: f64 = 2.0;

/// A lens with distortion, and the pinhole camera behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LensView {
    /// Sees everything in the picture, without the lens.
    pub(super) pinhole: Camera,
    lens: RadialDistortion,
    /// Offset from a position in the picture of a camera with the picture's principal point to one
    /// in the pinhole camera's.
    offset: Vector2<f64>,
}

impl LensView {
    /// None if the shot's camera is a pinhole.
    pub(super) fn new(shot: &Shot) -> Option<Self> {
        let lens = shot.distortion();
        if lens.is_none() {
            return None;
        }
        let [low, high] = lens.undistorted_bounds();
        let corner = low.coords.map(|v| (v - MARGIN_PX).floor());
        let size = (high.coords - corner).map(|v| (v + MARGIN_PX).ceil());
        let pinhole = Camera {
            image: [size.x as u32, size.y as u32],
            principal_px: shot.camera.principal_px - corner,
            ..shot.camera
        };
        Some(Self {
            pinhole,
            lens,
            offset: -corner,
        })
    }

    /// Side of the tiles in which the distortion is replaced by its tangent.
    pub(super) fn tile_side(&self) -> usize {
        let curvature = self.lens.curvature();
        let is_fine = |side: &usize| tangent_error(*side, curvature) <= TANGENT_ERROR_PX;
        TILE_SIDES_PX.into_iter().find(is_fine).unwrap_or(4)
    }

    /// The layers as seen through the lens in a tile.
    pub(super) fn stack_in(
        &self,
        stack: &LayerStack,
        lattice: Lattice,
        tile: &PixelBlock,
    ) -> LayerStack {
        let tangent = self.lens.undistort_near(Point2::from(tile.middle()));
        let bent = BentLattice {
            lattice,
            ideal_from_picture: tangent.append_translation(&self.offset),
        };
        stack.bent(bent, tile)
    }
}

/// Error of the tangent at a tile's corner, half a diagonal from the point of tangency.
fn tangent_error(side: usize, curvature: f64) -> f64 {
    let half_diagonal_2 = 0.5 * (side * side) as f64;
    0.5 * curvature * half_diagonal_2
}
