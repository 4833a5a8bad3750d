//! Irradiance of each receiver at the nodes of the lattice, to be looked up between them.

use crate::render::float4::Float4;
use crate::render::half_plane::meet;
use crate::render::lattice::{LatticePosition, coarser};
use crate::render::receiver::{Receiver, ReceiverIrradiance, RowBuffers};
use rayon::prelude::*;
use std::ops::Range;

/// Rows of nodes that one task computes.
const BAND_ROWS: usize = 16;

/// Values at the nodes of a part of a lattice.
#[derive(Debug)]
pub(super) struct IrradianceMap {
    columns: Range<usize>,
    rows: Range<usize>,
    values: Vec<Float4>,
}

/// The maps of all receivers, computed in parallel in bands of rows; the same bits for any number of threads.
///
/// Irradiance, or what shadows leave of it as a share; each with 1 as the fourth number. None in the dark.
pub(super) fn maps(receivers: &[Option<ReceiverIrradiance>]) -> Vec<Option<IrradianceMap>> {
    let lit = || {
        receivers
            .iter()
            .map(|r| r.as_ref().filter(|r| !r.is_dark()))
    };
    let mut soft: Vec<_> = lit()
        .map(|r| r.map(|r| IrradianceMap::of(&r.coarse, Float4::ZERO)))
        .collect();
    fill(
        receivers,
        &mut soft,
        |lit, _| &lit.coarse,
        |lit, _, j, out, buffers| hidden(&lit.coarse, j, out, buffers),
    );
    let empty = |lit: &ReceiverIrradiance| {
        if lit.relative {
            Float4::ONE
        } else {
            Float4::ZERO
        }
    };
    let mut maps: Vec<_> = lit()
        .map(|r| r.map(|r| IrradianceMap::of(&r.fine, empty(r))))
        .collect();
    let with_soft = |lit: &ReceiverIrradiance,
                     k: usize,
                     j: usize,
                     out: &mut [Float4],
                     buffers: &mut RowBuffers| {
        if let Some(soft) = &soft[k] {
            whole_row(lit, soft, j, out, buffers);
        }
    };
    fill(receivers, &mut maps, |lit, _| &lit.fine, with_soft);
    maps
}

/// Fills maps row by row, in parallel bands.
fn fill(
    receivers: &[Option<ReceiverIrradiance>],
    maps: &mut [Option<IrradianceMap>],
    part: impl Fn(&ReceiverIrradiance, usize) -> &Receiver + Sync,
    row: impl Fn(&ReceiverIrradiance, usize, usize, &mut [Float4], &mut RowBuffers) + Sync,
) {
    let pairs = receivers
        .iter()
        .zip(maps)
        .enumerate()
        .filter_map(|(k, (r, m))| Some((k, r.as_ref()?, m.as_mut()?)));
    let bands: Vec<_> = pairs
        .flat_map(|(k, r, m)| m.bands().map(move |(j, band)| (k, r, j, band)))
        .collect();
    bands
        .into_par_iter()
        .for_each_init(RowBuffers::default, |buffers, (k, lit, first, band)| {
            for (n, out) in band
                .chunks_exact_mut(part(lit, k).columns.len())
                .enumerate()
            {
                row(lit, k, first + n, out, buffers);
            }
        });
}

/// One row of what blockers hide of a receiver's lamps.
fn hidden(receiver: &Receiver, j: usize, out: &mut [Float4], buffers: &mut RowBuffers) {
    let asked = receiver.asked(j);
    if !asked.is_empty() {
        receiver.gather(j, &asked, buffers);
        out[asked.start - receiver.columns.start..][..asked.len()].copy_from_slice(&buffers.hidden);
    }
}

/// One row of irradiance or of its share, from the sharp part and the soft one.
fn whole_row(
    lit: &ReceiverIrradiance,
    soft: &IrradianceMap,
    j: usize,
    out: &mut [Float4],
    buffers: &mut RowBuffers,
) {
    let asked = lit.fine.asked(j);
    if asked.is_empty() {
        return;
    }
    lit.fine.gather(j, &asked, buffers);
    soft.enlarged(j, &asked, &mut buffers.coarse);
    let out = &mut out[asked.start - lit.fine.columns.start..][..asked.len()];
    let first = coarser(asked.start)[0];
    for (i, (out, (open, hidden))) in out
        .iter_mut()
        .zip(buffers.open.iter().zip(&buffers.hidden))
        .enumerate()
    {
        let [a, b] = coarser(asked.start + i).map(|n| buffers.coarse[n - first]);
        let hidden = hidden.add_scaled(1.0, a.lerp(b, 0.5));
        *out = if lit.relative {
            share(open, &hidden)
        } else {
            left(open, &hidden)
        };
    }
}

/// What is left of open irradiance.
fn left(open: &Float4, hidden: &Float4) -> Float4 {
    let channel = |i: usize| (open.0[i] - hidden.0[i]).max(0.0);
    Float4([channel(0), channel(1), channel(2), 1.0])
}

/// The same as a share; exactly 1 where nothing is hidden, and where there is no light.
fn share(open: &Float4, hidden: &Float4) -> Float4 {
    let channel = |i: usize| {
        if open.0[i] > 0.0 {
            (1.0 - hidden.0[i] / open.0[i]).clamp(0.0, 1.0)
        } else {
            1.0
        }
    };
    Float4([channel(0), channel(1), channel(2), 1.0])
}

impl IrradianceMap {
    fn of(receiver: &Receiver, value: Float4) -> Self {
        let (columns, rows) = (receiver.columns.clone(), receiver.rows.clone());
        let values = vec![value; columns.len() * rows.len()];
        Self {
            columns,
            rows,
            values,
        }
    }

    /// Bands of rows, each with its first row's number.
    fn bands(&mut self) -> impl Iterator<Item = (usize, &mut [Float4])> {
        let (first, width) = (self.rows.start, self.columns.len().max(1));
        self.values
            .chunks_mut(BAND_ROWS * width)
            .enumerate()
            .map(move |(k, band)| (first + k * BAND_ROWS, band))
    }

    /// The row of this coarser map that belongs to row `j` of a finer one, at all nodes around `asked`; 0 outside.
    fn enlarged(&self, j: usize, asked: &Range<usize>, out: &mut Vec<Float4>) {
        let (first, end) = (coarser(asked.start)[0], coarser(asked.end)[1] + 1);
        out.clear();
        out.resize(end - first, Float4::ZERO);
        for row in coarser(j) {
            let (start, end) = (first.max(self.columns.start), end.min(self.columns.end));
            if !self.rows.contains(&row) || start >= end {
                continue;
            }
            let line =
                &self.values[(row - self.rows.start) * self.columns.len()..][..self.columns.len()];
            let line = &line[start - self.columns.start..end - self.columns.start];
            out[start - first..]
                .iter_mut()
                .zip(line)
                .for_each(|(o, v)| *o = o.add_scaled(0.5, *v));
        }
    }

    /// Does it share nodes with a part of the lattice?
    pub(super) fn meets(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        meet(&self.columns, &columns) && meet(&self.rows, &rows)
    }

    /// Is a place inside, with all four nodes around it?
    #[inline(always)]
    pub(super) fn holds(&self, column: LatticePosition, row: LatticePosition) -> bool {
        let (i, j) = (column.0 as usize, row.0 as usize);
        i >= self.columns.start
            && i + 1 < self.columns.end
            && j >= self.rows.start
            && j + 1 < self.rows.end
    }

    /// The value at a place; at the nearest cell for a place outside.
    ///
    /// Maps hold at least two nodes a side.
    #[inline(always)]
    pub(super) fn at(&self, column: LatticePosition, row: LatticePosition) -> Float4 {
        let width = self.columns.len();
        let i = (column.0 as usize)
            .saturating_sub(self.columns.start)
            .min(width - 2);
        let j = (row.0 as usize)
            .saturating_sub(self.rows.start)
            .min(self.rows.len() - 2);
        let top = &self.values[j * width + i..][..2];
        let bottom = &self.values[(j + 1) * width + i..][..2];
        Float4::bilinear([top[0], top[1]], [bottom[0], bottom[1]], column.1, row.1)
    }
}
