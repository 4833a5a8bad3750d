//! The lattice of picture positions at which light is computed.
//!
//! Irradiance varies slowly where textures do not, so it is computed once per node and receiver,
//! and interpolated between nodes. The lattice is in the *picture*, not on the receiver: nodes are
//! as dense as the pixels require, at any distance and slant, and nothing is spent on what the
//! camera does not see.

use crate::render::view::CameraView;
use nalgebra::Matrix3;

/// Nodes over the picture: node `(i, j)` is at pixel position `((i - 1) cell, (j - 1) cell)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Spacing of nodes, pixels.
    cell: f64,
    /// Spacing that textures are read for, as a share of it.
    pub(super) detail: f64,
    /// The camera, in nodes instead of pixels.
    pub(super) view: CameraView,
}

/// A pixel position between nodes: the node before it, and the fraction towards the next.
pub(super) type LatticePosition = (u32, f32);

impl Lattice {
    pub(super) fn new(view: &CameraView, cell: f64) -> Self {
        let pixel_from_node = Matrix3::new(cell, 0.0, -cell, 0.0, cell, -cell, 0.0, 0.0, 1.0);
        let view = CameraView {
            ray: view.ray * pixel_from_node,
            width: node_count(view.width, cell),
            height: node_count(view.height, cell),
            ..*view
        };
        Self {
            cell,
            detail: 1.0,
            view,
        }
    }

    /// The lattice with [`COARSER`] times the spacing. Occluders are read as if nodes were half as
    /// far apart: blurred more, many layers on top of each other would take away too much light.
    pub(super) fn coarser(view: &CameraView, cell: f64) -> Self {
        Self {
            detail: 0.5,
            ..Self::new(view, COARSER as f64 * cell)
        }
    }

    /// Lattice positions of the picture positions `i + 0.5 + offset`, for each `i` below `pixels`
    /// and, within that, each offset.
    pub(super) fn positions_of(&self, pixels: usize, offsets: &[f64]) -> Vec<LatticePosition> {
        (0..pixels)
            .flat_map(|i| {
                offsets
                    .iter()
                    .map(move |o| self.position_at(i as f64 + 0.5 + o))
            })
            .collect()
    }

    /// Lattice position of a position in the picture.
    pub(super) fn position_of(&self, x: f64, y: f64) -> (LatticePosition, LatticePosition) {
        (self.position_at(x), self.position_at(y))
    }

    fn position_at(&self, pixel: f64) -> LatticePosition {
        let node = (pixel / self.cell + 1.0).max(0.0);
        (node as u32, (node - node.floor()) as f32)
    }
}

/// Nodes up to one pixel beyond the picture's end, since sub-samples reach past it.
fn node_count(pixels: usize, cell: f64) -> usize {
    ((pixels as f64 + 1.0) / cell) as usize + 3
}

/// Spacing of the coarser lattice, for light with soft shadows, in nodes of the finer one.
pub(super) const COARSER: usize = 4;

/// The node of the coarser lattice before a node of the finer one, and the fraction towards the
/// next.
#[inline(always)]
pub(super) fn coarser_position(node: usize) -> (usize, f32) {
    let at = node + COARSER - 1;
    (at / COARSER, (at % COARSER) as f32 / COARSER as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_lies_on_the_way_between_its_coarser_ones() {
        for node in 0..9 {
            let at = |node: f64, cell: f64| (node - 1.0) * cell;
            let (coarser, way) = coarser_position(node);
            let position = at(coarser as f64 + f64::from(way), COARSER as f64);
            assert_eq!(position, at(node as f64, 1.0));
        }
    }
}
