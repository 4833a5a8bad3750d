//! The lattice of picture positions at which light is computed.
//!
//! Light varies slowly where textures do not, so it is computed once per node and receiver, and
//! looked up between nodes. The lattice lies in the *picture*, not on the receiver: nodes are as
//! dense as pixels ask for, at any distance and slant, and nothing is spent on what the camera does
//! not see.

use crate::render::view::CameraView;
use nalgebra::Matrix3;

/// Nodes over the picture: node `(i, j)` lies at pixel position `((i - 1) cell, (j - 1) cell)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Distance of nodes, pixels.
    cell: f64,
    /// The same that textures are read for, as a share of it.
    pub(super) detail: f64,
    /// The camera, in nodes instead of pixels.
    pub(super) view: CameraView,
}

/// Where a pixel position lies between nodes: the node before it, and the way to the next.
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

    /// The lattice of [`COARSER`] times the distance. What throws shadows on it is read as if nodes
    /// were half as far apart: blurred more, many layers on each other would take away too much.
    pub(super) fn coarser(view: &CameraView, cell: f64) -> Self {
        Self {
            detail: 0.5,
            ..Self::new(view, COARSER as f64 * cell)
        }
    }

    /// Lattice positions of the picture positions `i + 0.5 + offset`, for all `i` below `pixels`
    /// and all offsets in turn.
    pub(super) fn positions_of(&self, pixels: usize, offsets: &[f64]) -> Vec<LatticePosition> {
        (0..pixels)
            .flat_map(|i| {
                offsets
                    .iter()
                    .map(move |o| self.position_at(i as f64 + 0.5 + o))
            })
            .collect()
    }

    /// Where a position of the picture is on the lattice.
    pub(super) fn position_of(&self, x: f64, y: f64) -> (LatticePosition, LatticePosition) {
        (self.position_at(x), self.position_at(y))
    }

    fn position_at(&self, pixel: f64) -> LatticePosition {
        let node = (pixel / self.cell + 1.0).max(0.0);
        (node as u32, (node - node.floor()) as f32)
    }
}

/// Nodes up to one pixel beyond the picture's end: sub-samples reach over it.
fn node_count(pixels: usize, cell: f64) -> usize {
    ((pixels as f64 + 1.0) / cell) as usize + 3
}

/// Nodes of a lattice between two of the coarser one, for light with soft shadows.
pub(super) const COARSER: usize = 4;

/// The node of the coarser lattice before a node of the finer one, and the way to the next.
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
