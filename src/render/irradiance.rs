//! Irradiance of each receiver at the nodes of the lattice, to be interpolated between them.

use crate::pixel::Mix;
use crate::render::float4::{Blend, Float4};
use crate::render::lattice::{LatticePosition, coarser_position};
use crate::render::ranges::{range_overlap, ranges_meet};
use crate::render::receiver::{BAND_ROWS, BandBuffers, Receiver, ReceiverIrradiance, RowSums};
use crate::render::refill;
use rayon::prelude::*;
use std::ops::Range;

/// Values at the nodes of a part of a lattice.
#[derive(Debug)]
pub(super) struct IrradianceMap {
    columns: Range<usize>,
    rows: Range<usize>,
    values: Vec<Float4>,
}

/// The maps of all receivers, computed in parallel in bands of rows; the same bits for any number
/// of threads.
///
/// Irradiance, or the share of it that shadows leave; each with 1 as the fourth number. None in the
/// dark.
pub(super) fn irradiance_maps(
    receivers: &[Option<ReceiverIrradiance>],
) -> Vec<Option<IrradianceMap>> {
    let soft = hidden_maps(receivers);
    let mut maps = maps_of(receivers, |lit| {
        IrradianceMap::filled(&lit.fine, lit.unlit_value())
    });
    fill_maps(receivers, &mut maps, |band, buffers| {
        if let Some(soft) = &soft[band.number] {
            fill_combined_rows(band, soft, buffers);
        }
    });
    maps
}

/// Light with soft shadows that occluders block, on the coarser lattice.
fn hidden_maps(receivers: &[Option<ReceiverIrradiance>]) -> Vec<Option<IrradianceMap>> {
    let mut maps = maps_of(receivers, |lit| {
        IrradianceMap::filled(&lit.coarse, Float4::ZERO)
    });
    fill_maps(receivers, &mut maps, fill_hidden_rows);
    maps
}

/// Rows of a receiver's map that one task fills.
struct MapBand<'a> {
    /// The receiver's index.
    number: usize,
    lit: &'a ReceiverIrradiance,
    /// Index of the first row.
    first: usize,
    /// Number of nodes in a row.
    width: usize,
    values: &'a mut [Float4],
}

/// A map for each receiver under some of its light.
fn maps_of(
    receivers: &[Option<ReceiverIrradiance>],
    map: impl Fn(&ReceiverIrradiance) -> IrradianceMap,
) -> Vec<Option<IrradianceMap>> {
    receivers
        .iter()
        .map(|lit| lit.as_ref().filter(|lit| !lit.is_dark()).map(&map))
        .collect()
}

impl MapBand<'_> {
    /// Indices of its rows.
    fn rows(&self) -> Range<usize> {
        self.first..self.first + self.values.len() / self.width
    }

    /// The values of nodes of its `n`-th row.
    fn values_of(&mut self, n: usize, nodes: &Range<usize>, first_column: usize) -> &mut [Float4] {
        let start = n * self.width + nodes.start - first_column;
        &mut self.values[start..][..nodes.len()]
    }
}

/// Fills maps band by band, in parallel.
fn fill_maps(
    receivers: &[Option<ReceiverIrradiance>],
    maps: &mut [Option<IrradianceMap>],
    fill: impl Fn(&mut MapBand<'_>, &mut BandBuffers) + Sync,
) {
    map_bands(receivers, maps).into_par_iter().for_each_init(
        BandBuffers::default,
        |buffers, mut band| {
            fill(&mut band, buffers);
        },
    );
}

/// The bands of all maps.
fn map_bands<'a>(
    receivers: &'a [Option<ReceiverIrradiance>],
    maps: &'a mut [Option<IrradianceMap>],
) -> Vec<MapBand<'a>> {
    let pairs = receivers.iter().zip(maps).enumerate();
    pairs
        .filter_map(|(number, (lit, map))| Some((number, lit.as_ref()?, map.as_mut()?)))
        .flat_map(|(number, lit, map)| map.row_bands(number, lit))
        .collect()
}

/// Light of a receiver that occluders block.
fn fill_hidden_rows(band: &mut MapBand<'_>, buffers: &mut BandBuffers) {
    let lit = band.lit;
    let receiver = &lit.coarse;
    receiver.gather_band(band.rows(), buffers);
    for (n, row) in wanted_rows(&mut buffers.rows) {
        let out = band.values_of(n, &row.requested, receiver.columns.start);
        out.copy_from_slice(&row.hidden);
    }
}

/// Irradiance or its share, from the parts with sharp and with soft shadows.
fn fill_combined_rows(band: &mut MapBand<'_>, soft: &IrradianceMap, buffers: &mut BandBuffers) {
    let lit = band.lit;
    lit.fine.gather_band(band.rows(), buffers);
    for (n, row) in wanted_rows(&mut buffers.rows) {
        let requested = row.requested.clone();
        soft.enlarge_row(band.first + n, &requested, &mut buffers.coarse);
        let out = band.values_of(n, &requested, lit.fine.columns.start);
        let sums = row.open.iter().zip(&row.hidden);
        for (i, (out, (open, hidden))) in out.iter_mut().zip(sums).enumerate() {
            let soft = between_coarse(&buffers.coarse, requested.start, i);
            *out = remaining(lit.relative, open, &hidden.add_scaled(1.0, soft));
        }
        lit.spread_light(row, out);
    }
}

/// The rows with any requested node, with their indices in the band.
fn wanted_rows(rows: &mut [RowSums]) -> impl Iterator<Item = (usize, &mut RowSums)> {
    let rows = rows.iter_mut().enumerate();
    rows.filter(|(_, row)| !row.requested.is_empty())
}

/// Open irradiance less the hidden part, or that as a share of it.
#[inline(always)]
fn remaining(relative: bool, open: &Float4, hidden: &Float4) -> Float4 {
    if relative {
        remaining_share(open, hidden)
    } else {
        remaining_light(open, hidden)
    }
}

/// Interpolates a row of the coarser lattice at the `i`-th node from `start`; the row begins at the
/// node before `start`.
#[inline(always)]
fn between_coarse(coarse: &[Float4], start: usize, i: usize) -> Float4 {
    let first = coarser_position(start).0;
    let (node, way) = coarser_position(start + i);
    coarse[node - first].lerp(coarse[node + 1 - first], way)
}

/// Open irradiance less the hidden part.
#[inline(always)]
fn remaining_light(open: &Float4, hidden: &Float4) -> Float4 {
    Float4::light_from_fn(|i| (open.0[i] - hidden.0[i]).max(0.0))
}

/// The same as a share; exactly 1 if nothing is hidden or there is no light.
#[inline(always)]
fn remaining_share(open: &Float4, hidden: &Float4) -> Float4 {
    Float4::light_from_fn(|i| channel_share(open.0[i], hidden.0[i]))
}

#[inline(always)]
fn channel_share(open: f32, hidden: f32) -> f32 {
    if open > 0.0 {
        (1.0 - hidden / open).clamp(0.0, 1.0)
    } else {
        1.0
    }
}

impl IrradianceMap {
    fn filled(receiver: &Receiver, value: Float4) -> Self {
        let (columns, rows) = (receiver.columns.clone(), receiver.rows.clone());
        let values = vec![value; columns.len() * rows.len()];
        Self {
            columns,
            rows,
            values,
        }
    }

    /// Bands of rows of the map of the receiver with this index.
    fn row_bands<'a>(
        &'a mut self,
        number: usize,
        lit: &'a ReceiverIrradiance,
    ) -> impl Iterator<Item = MapBand<'a>> {
        let (start, width) = (self.rows.start, self.columns.len());
        let bands = self.values.chunks_mut(BAND_ROWS * width.max(1));
        bands.enumerate().map(move |(k, values)| MapBand {
            number,
            lit,
            first: start + k * BAND_ROWS,
            width,
            values,
        })
    }

    /// The row of this coarser map that corresponds to row `j` of a finer one, at all nodes around
    /// `requested`; 0 outside.
    fn enlarge_row(&self, j: usize, requested: &Range<usize>, out: &mut Vec<Float4>) {
        let first = coarser_position(requested.start).0;
        let last = coarser_position(requested.end).0 + 1;
        refill(out, last + 1 - first, Float4::ZERO);
        let known = range_overlap(&self.columns, &(first..last + 1));
        let (row, way) = coarser_position(j);
        for (row, weight) in [(row, 1.0 - way), (row + 1, way)] {
            if !self.rows.contains(&row) || known.is_empty() {
                continue;
            }
            let nodes = self.nodes_of(row, &known);
            for (o, v) in out[known.start - first..].iter_mut().zip(nodes) {
                *o = o.add_scaled(weight, *v);
            }
        }
    }

    /// Some nodes of a row.
    fn nodes_of(&self, row: usize, columns: &Range<usize>) -> &[Float4] {
        let start = (row - self.rows.start) * self.columns.len() + columns.start;
        &self.values[start - self.columns.start..][..columns.len()]
    }

    /// Whether it shares nodes with a part of the lattice.
    pub(super) fn meets(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        ranges_meet(&self.columns, &columns) && ranges_meet(&self.rows, &rows)
    }

    /// Whether a position is inside, with all four nodes around it.
    #[inline(always)]
    pub(super) fn holds(&self, column: LatticePosition, row: LatticePosition) -> bool {
        holds_cell(&self.columns, column.0 as usize) && holds_cell(&self.rows, row.0 as usize)
    }

    /// Which of some positions along a row, from left to right, are inside, with all four nodes
    /// around each.
    pub(super) fn held_positions(
        &self,
        row: LatticePosition,
        columns: &[LatticePosition],
    ) -> Range<usize> {
        if !holds_cell(&self.rows, row.0 as usize) {
            return 0..0;
        }
        let start = columns.partition_point(|column| (column.0 as usize) < self.columns.start);
        let end = columns.partition_point(|column| (column.0 as usize) + 1 < self.columns.end);
        start..end.max(start)
    }

    /// The value at a position; that of the nearest cell for one outside.
    ///
    /// Maps hold at least two nodes a side.
    #[inline(always)]
    pub(super) fn value_at(&self, column: LatticePosition, row: LatticePosition) -> Float4 {
        let width = self.columns.len();
        let start = cell_before(row, &self.rows) * width + cell_before(column, &self.columns);
        let top = &self.values[start..][..2];
        let bottom = &self.values[start + width..][..2];
        Float4::bilinear([top[0], top[1]], [bottom[0], bottom[1]], column.1, row.1)
    }

    /// The values at positions along a row, from left to right, each as
    /// [`value_at`](Self::value_at).
    ///
    /// Interpolates between rows first, once for each node.
    pub(super) fn values_along(
        &self,
        row: LatticePosition,
        columns: &[LatticePosition],
        out: &mut Vec<Float4>,
    ) {
        out.clear();
        let (Some(&first), Some(&last)) = (columns.first(), columns.last()) else {
            return;
        };
        let [first, last] = [first, last].map(|column| cell_before(column, &self.columns));
        let start = cell_before(row, &self.rows) * self.columns.len() + first;
        let count = last + 2 - first;
        let top = &self.values[start..][..count];
        let bottom = &self.values[start + self.columns.len()..][..count];
        let mut pairs = top
            .iter()
            .zip(bottom)
            .map(|(top, bottom)| top.lerp(*bottom, row.1));
        let mut cell = [pairs.next(), pairs.next()].map(Option::unwrap_or_default);
        let mut before = first;
        out.extend(columns.iter().map(|&column| {
            let node = cell_before(column, &self.columns);
            while before < node {
                cell = [cell[1], pairs.next().unwrap_or_default()];
                before += 1;
            }
            cell[0].lerp(cell[1], column.1)
        }));
    }
}

/// Whether a node and the next one are both inside.
#[inline(always)]
fn holds_cell(nodes: &Range<usize>, first: usize) -> bool {
    first >= nodes.start && first + 1 < nodes.end
}

/// Index in a range of the node before a position; another one follows it.
#[inline(always)]
fn cell_before(position: LatticePosition, range: &Range<usize>) -> usize {
    (position.0 as usize)
        .saturating_sub(range.start)
        .min(range.len() - 2)
}
