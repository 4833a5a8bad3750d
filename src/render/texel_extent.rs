//! The non-empty part of a texture: an octagon around its texels.

use crate::geom::Vector3;
use crate::render::texel_grid::{BORDER_TEXELS, POSITION_ERROR_TEXELS, TexelGrid};

/// Distance at which a texel is still read: bilinearly, at positions in single precision.
const READ_TEXELS: f64 = 1.0 + POSITION_ERROR_TEXELS;

/// The bounded quantities, as factors of `x` and `y`.
const AXES: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]];

/// Lowest and highest `x`, `y`, `x + y` and `x - y` of the positions among bordered texels with
/// non-empty readings.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexelExtent {
    bounds: [[f64; 2]; 4],
}

impl TexelExtent {
    /// Around the texels that are not empty, in rows of `width`; contains nothing for an empty
    /// texture.
    pub(super) fn around<T: Default + PartialEq>(
        texels: &[T],
        width: usize,
        grid: &TexelGrid,
    ) -> Self {
        let mut extent = Self {
            bounds: [[f64::INFINITY, f64::NEG_INFINITY]; 4],
        };
        let empty = T::default();
        for (y, row) in texels.chunks_exact(width).enumerate() {
            let mut filled = row.iter().enumerate().filter(|(_, t)| **t != empty);
            let ends = [filled.next(), filled.next_back()];
            for (x, _) in ends.into_iter().flatten() {
                extent.add([x as f64, y as f64]);
            }
        }
        extent.cut_to_quad(grid);
        extent
    }

    fn add(&mut self, texel: [f64; 2]) {
        for (bounds, axis) in self.bounds.iter_mut().zip(&AXES) {
            let [along, reach] = [
                along(axis, texel),
                along(&axis.map(f64::abs), [READ_TEXELS; 2]),
            ];
            bounds[0] = bounds[0].min(along - reach);
            bounds[1] = bounds[1].max(along + reach);
        }
    }

    /// Nothing is read beyond the sides of the texture.
    fn cut_to_quad(&mut self, grid: &TexelGrid) {
        let first = BORDER_TEXELS as f64 - 0.5;
        for (axis, bounds) in self.bounds.iter_mut().take(2).enumerate() {
            let reach = grid.reach[axis] * grid.texels[axis];
            bounds[0] = bounds[0].max(first - reach);
            bounds[1] = bounds[1].min(first + grid.texels[axis] + reach);
        }
    }

    /// Linear conditions on the positions among bordered texels that `u`, `v` and `w` give.
    pub(super) fn sides(&self, [u, v]: [&Vector3<f64>; 2], w: &Vector3<f64>) -> [Vector3<f64>; 8] {
        std::array::from_fn(|k| {
            let (axis, [low, high]) = (AXES[k / 2], self.bounds[k / 2]);
            let position = u * axis[0] + v * axis[1];
            if k % 2 == 0 {
                position - w * low
            } else {
                w * high - position
            }
        })
    }
}

fn along(axis: &[f64; 2], [x, y]: [f64; 2]) -> f64 {
    axis[0] * x + axis[1] * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::float4::Float4;

    fn holds(extent: &TexelExtent, x: f64, y: f64) -> bool {
        let sides = extent.sides([&Vector3::x(), &Vector3::y()], &Vector3::z());
        sides
            .iter()
            .all(|side| side.dot(&Vector3::new(x, y, 1.0)) >= 0.0)
    }

    #[test]
    fn it_holds_all_that_is_read_and_cuts_empty_corners() {
        let grid = TexelGrid::new((16, 16), 0.0);
        let width = 16 + 2 * BORDER_TEXELS;
        let is_filled = |x: usize, y: usize| x.abs_diff(9) + y.abs_diff(9) <= 5;
        let texels: Vec<_> = (0..width * width)
            .map(|i| [Float4::ZERO, Float4::ONE][usize::from(is_filled(i % width, i / width))])
            .collect();
        let extent = TexelExtent::around(&texels, width, &grid);
        for (x, y) in (0..width * width).map(|i| (i % width, i / width)) {
            let read = (x.abs_diff(9) + y.abs_diff(9)) < 7;
            assert!(!read || holds(&extent, x as f64, y as f64), "{x}, {y}");
        }
        assert!(!holds(&extent, 5.0, 5.0) && !holds(&extent, 13.0, 5.5));
    }

    #[test]
    fn an_empty_texture_has_none() {
        let grid = TexelGrid::new((4, 4), 0.0);
        let extent = TexelExtent::around(&[Float4::ZERO; 64], 8, &grid);
        assert!(!holds(&extent, 4.0, 4.0));
    }
}
