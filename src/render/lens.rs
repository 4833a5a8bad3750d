//! A picture taken through a lens that bends it.
//!
//! Everything in a picture of planes is linear in `(x, y, 1)`, and stays so behind an affine map. So
//! the stack of layers is made for the pinhole camera that sees what the lens lets into the
//! picture; then each small tile of the picture walks the layers through the tangent of the lens
//! there. Nothing is resampled: a sub-sample of the picture is a sub-sample of the cards.

use crate::camera::{Camera, RadialDistortion};
use crate::geom::{Point2, Vector2};
use crate::render::block::PixelBlock;
use crate::render::lattice::Lattice;
use crate::render::layers::{BentLattice, LayerStack};
use crate::scene::Shot;

/// How far the tangent may be from the lens at a corner of a tile, pixels: what a code of 8 bits of
/// an edge from black to white is worth four times over.
const TANGENT_ERROR_PX: f64 = 0.016;
/// Sides of tiles, of which the largest is taken that errs by no more.
const TILE_SIDES_PX: [usize; 4] = [32, 16, 8, 4];
/// Pixels of the pinhole camera around what the picture shows: sub-samples reach out of it.
const MARGIN_PX: f64 = 2.0;

/// A lens over a picture, and the pinhole camera behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LensView {
    /// Sees all that the picture shows, without the lens.
    pub(super) pinhole: Camera,
    lens: RadialDistortion,
    /// Position of the pinhole camera's picture, from that of a camera with the picture's
    /// principal point.
    offset: Vector2<f64>,
}

impl LensView {
    /// None for a shot whose camera is a pinhole.
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

    /// Side of the tiles in which the lens is its own tangent.
    pub(super) fn tile_side(&self) -> usize {
        let curvature = self.lens.curvature();
        let is_fine = |side: &usize| tangent_error(*side, curvature) <= TANGENT_ERROR_PX;
        TILE_SIDES_PX.into_iter().find(is_fine).unwrap_or(4)
    }

    /// The layers as the lens shows them in a tile.
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

/// By how much a tangent misses at a tile's corner, half a diagonal from where it touches.
fn tangent_error(side: usize, curvature: f64) -> f64 {
    let half_diagonal_2 = 0.5 * (side * side) as f64;
    0.5 * curvature * half_diagonal_2
}
