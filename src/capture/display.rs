//! The display that shows the frames: its size, and where its markers are.

use super::frame::{CORNERS, Frame};
use super::tag::TAG_CELLS;
use crate::bounds::{Bounds, SURFACE};
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// A display, as `display.toml` beside its frames describes it.
///
/// ```toml
/// size_px = [2560, 1600]
/// width = 0.345             # metres, of the whole picture as it is shown
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Display {
    /// Width and height of the frames, pixels.
    pub size_px: [u32; 2],
    /// Width of the whole picture as it is shown, metres. Default: not known yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
}

/// Sides of displays, pixels: fewer have no room for markers, more has no display.
const SIDE_PX: Bounds = Bounds::new(400.0, 16_384.0, "pixels");
/// Cells of the markers along the shorter side of the display.
const CELLS_OF_DISPLAY: u32 = 100;
/// Cells of grey paper around a marker's black square; a reader needs one.
const PAPER_CELLS: usize = 2;
/// Cells between the border of the display and a marker's paper.
const BORDER_CELLS: usize = 1;
/// Periods of the fine stripes along the shorter side of the display.
const FINE_PERIODS: f64 = 50.0;
/// Fine periods in a coarse one.
pub(super) const FINE_IN_COARSE: f64 = 10.0;

impl Display {
    /// Checks all values.
    ///
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) for the first that cannot be right.
    pub fn check(&self) -> Result<()> {
        for side in self.size_px {
            SIDE_PX.check("size_px", side.into())?;
        }
        self.width
            .map_or(Ok(()), |width| SURFACE.check("width", width))
    }

    /// Width of a picture of this diagonal, metres.
    pub fn width_of_diagonal([w, h]: [u32; 2], diagonal: f64) -> f64 {
        diagonal * f64::from(w) / libm::hypot(w.into(), h.into())
    }

    /// Side of a cell of its markers, pixels.
    pub(super) fn cell_px(&self) -> usize {
        (self.shorter_side() / CELLS_OF_DISPLAY) as usize
    }

    fn shorter_side(&self) -> u32 {
        self.size_px[0].min(self.size_px[1])
    }

    /// The markers, from the top left clockwise.
    pub(super) fn markers(&self) -> [DisplayMarker; CORNERS] {
        let [w, h] = self.size_px.map(|side| side as usize);
        let cell_px = self.cell_px();
        let near = BORDER_CELLS * cell_px;
        let far = |side: usize| side - near - PAPER_SIDE_CELLS * cell_px;
        let corners = [
            [near, near],
            [far(w), near],
            [far(w), far(h)],
            [near, far(h)],
        ];
        corners.map(|paper_px| DisplayMarker { paper_px, cell_px })
    }

    /// Period of stripes, pixels.
    pub(super) fn period_px(&self, is_fine: bool) -> f64 {
        let fine = f64::from(self.shorter_side()) / FINE_PERIODS;
        if is_fine { fine } else { FINE_IN_COARSE * fine }
    }
}

/// Cells along a side of a marker with its paper.
pub(super) const PAPER_SIDE_CELLS: usize = TAG_CELLS + 2 * PAPER_CELLS;

/// A marker on a display, with the paper around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct DisplayMarker {
    /// Top left of its paper, pixels.
    paper_px: [usize; 2],
    cell_px: usize,
}

/// What a marker shows somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MarkerPart {
    /// Its paper.
    Paper,
    /// A cell of the black square: row and column.
    Cell(usize, usize),
}

impl DisplayMarker {
    /// The part at a pixel; none outside its paper.
    pub(super) fn part_at(&self, pixel: [usize; 2]) -> Option<MarkerPart> {
        let [column, row] = self.cell_at(pixel)?;
        let inner = |cell: usize| cell.checked_sub(PAPER_CELLS).filter(|&c| c < TAG_CELLS);
        Some(match (inner(row), inner(column)) {
            (Some(row), Some(column)) => MarkerPart::Cell(row, column),
            _ => MarkerPart::Paper,
        })
    }

    /// Column and row of the cell of the paper at a pixel.
    fn cell_at(&self, [x, y]: [usize; 2]) -> Option<[usize; 2]> {
        let [left, top] = self.paper_px;
        let at = [x.checked_sub(left)?, y.checked_sub(top)?].map(|px| px / self.cell_px);
        at.iter().all(|&cell| cell < PAPER_SIDE_CELLS).then_some(at)
    }

    /// Corners of the black square, from the top left clockwise, pixels of the display.
    pub(super) fn square_px(&self) -> [[f64; 2]; 4] {
        let near = PAPER_CELLS as f64;
        let far = near + TAG_CELLS as f64;
        [[near, near], [far, near], [far, far], [near, far]].map(|cells| self.at_cells(cells))
    }

    /// Corners of the paper, from the top left clockwise, pixels of the display.
    pub(super) fn paper_corners_px(&self) -> [[f64; 2]; 4] {
        let far = PAPER_SIDE_CELLS as f64;
        [[0.0, 0.0], [far, 0.0], [far, far], [0.0, far]].map(|cells| self.at_cells(cells))
    }

    /// Places in the middle of the paper around the black square, pixels of the display.
    pub(super) fn paper_points_px(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let (near, far) = (
            PAPER_CELLS as f64 / 2.0,
            PAPER_SIDE_CELLS as f64 - PAPER_CELLS as f64 / 2.0,
        );
        let along = (1..PAPER_SIDE_CELLS).map(|cell| cell as f64);
        let around = along.flat_map(move |s| [[s, near], [s, far], [near, s], [far, s]]);
        around.map(|cells| self.at_cells(cells))
    }

    fn at_cells(&self, cells: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| self.paper_px[i] as f64 + cells[i] * self.cell_px as f64)
    }
}

/// Number of the marker in a corner of a frame; those of a frame follow each other.
pub(super) fn marker_id(frame: Frame, corner: usize) -> u32 {
    (CORNERS * frame.number() + corner) as u32
}
