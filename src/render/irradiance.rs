//! Irradiance of each receiver, on a coarse lattice over the picture.
//!
//! Light varies slowly where textures do not, so it is computed once per lattice node and receiver, and looked up
//! between nodes. The lattice lies in the *picture*, not on the receiver: nodes are as dense as pixels ask for, at any
//! distance and slant, and nothing is spent on what the eye does not see.

use crate::geom::Vector3;
use crate::pixel::LinearRgb;
use crate::render::RenderOptions;
use crate::render::four::Four;
use crate::render::half_plane::{grown, sides, span, whole};
use crate::render::shadow::{Beam, Casters, rows_and_columns};
use crate::render::source::lamps;
use crate::render::view::{HORIZON, Seen, View};
use crate::scene::Shot;
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::ops::Range;

/// Rows of nodes that one task computes.
const BAND: usize = 16;

/// Nodes over the picture: node `(i, j)` lies at pixel position `((i - 1) cell, (j - 1) cell)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Distance of nodes, pixels.
    cell: f64,
    /// The camera, in nodes instead of pixels.
    pub(super) view: View,
}

/// Where a pixel position lies between nodes: the node before it, and the way to the next.
pub(super) type Place = (u32, f32);

impl Lattice {
    pub(super) fn new(view: &View, cell: f64) -> Self {
        let pixel_from_node = Matrix3::new(cell, 0.0, -cell, 0.0, cell, -cell, 0.0, 0.0, 1.0);
        // One pixel beyond the picture's end: sub-samples reach over it.
        let count = |pixels: usize| ((pixels as f64 + 1.0) / cell) as usize + 3;
        let view =
            View { ray: view.ray * pixel_from_node, width: count(view.width), height: count(view.height), ..*view };
        Self { cell, view }
    }

    /// The places of pixel positions `i + 0.5 + offset`, for all `i` below `pixels` and all offsets in turn.
    pub(super) fn places(&self, pixels: usize, offsets: &[f64]) -> Vec<Place> {
        let place = |at: f64| {
            let node = (at / self.cell + 1.0).max(0.0);
            (node as u32, (node - node.floor()) as f32)
        };
        (0..pixels).flat_map(|i| offsets.iter().map(move |o| place(i as f64 + 0.5 + o))).collect()
    }
}

/// What a receiver asks for.
#[derive(Debug)]
pub(super) struct Receiver {
    seen: Seen,
    /// Nodes outside of these conditions are not asked for.
    outline: Vec<Vector3<f64>>,
    columns: Range<usize>,
    rows: Range<usize>,
    lamps: Vec<(LinearRgb, Vec<Beam>)>,
    /// The share of unshadowed irradiance is asked for, not irradiance itself.
    relative: bool,
}

/// Values at the nodes of a part of the lattice.
#[derive(Debug)]
pub(super) struct Map {
    columns: Range<usize>,
    rows: Range<usize>,
    values: Vec<Four>,
}

impl Receiver {
    /// Card number `own`; asked for where the card is seen, and a node around. None where it is not seen at all.
    pub(super) fn card(
        own: usize,
        reach: [f64; 2],
        lattice: &Lattice,
        casters: &Casters<'_>,
        shot: &Shot,
        options: &RenderOptions,
    ) -> Option<Self> {
        let view = &lattice.view;
        let sheet = &casters.cards[own].sheet;
        let seen = Seen::of(sheet, view)?;
        let (rows, columns) = rows_and_columns(sheet, reach, view);
        if rows.len() < 2 || columns.len() < 2 {
            return None;
        }
        let outline = sides(&seen.u, &seen.v, &seen.w, reach).iter().map(|s| grown(s, 1.0)).collect();
        let cell = seen.cell_metres(view, &sheet.center);
        let lamps = lamps(shot, options, &seen.normal).into_iter();
        let lamps = lamps.map(|l| (l.radiance, casters.beams(&seen, view, &l, Some(own), cell))).collect();
        Some(Self { seen, outline, columns, rows, lamps, relative: false })
    }

    /// The surface; asked for where a shadow may fall on it. None where there is no shadow, or none to be seen.
    pub(super) fn surface(
        lattice: &Lattice,
        casters: &Casters<'_>,
        shot: &Shot,
        options: &RenderOptions,
    ) -> Option<Self> {
        let view = &lattice.view;
        let seen = Seen::of(&casters.surface, view).filter(|s| s.normal.z > 0.0)?;
        let cell = seen.cell_metres(view, &Vector3::zeros());
        let lamps = lamps(shot, options, &seen.normal).into_iter();
        let lamps: Vec<_> = lamps.map(|l| (l.radiance, casters.beams(&seen, view, &l, None, cell))).collect();
        let blockers = lamps.iter().flat_map(|(_, beams)| beams).flat_map(|b| &b.blockers);
        let areas = blockers.map(|b| (b.rows.clone(), b.columns.clone()));
        let (rows, columns) = areas.reduce(|a, b| (union(a.0, b.0), union(a.1, b.1)))?;
        Some(Self { outline: vec![seen.w], seen, columns, rows, lamps, relative: true })
    }

    fn empty_value(&self) -> Four {
        if self.relative { Four::ONE } else { Four::ZERO }
    }

    /// One row of nodes.
    fn row(&self, j: usize, out: &mut [Four], buffers: &mut Buffers) {
        let (low, high) = span(&self.outline, j as f64);
        let mut asked = whole(low, high, &self.columns);
        if self.relative {
            asked = self.shadowed(j, &asked);
        }
        if asked.is_empty() {
            return;
        }
        buffers.start(&self.seen, j, &asked);
        let out = &mut out[asked.start - self.columns.start..][..asked.len()];
        out.fill(Four([0.0, 0.0, 0.0, 1.0]));
        for (radiance, beams) in &self.lamps {
            buffers.lamp(beams, j, &asked, self.relative);
            let light = Four([radiance.r, radiance.g, radiance.b, 0.0]);
            out.iter_mut().zip(&buffers.lit).for_each(|(o, &e)| *o = o.add_scaled(e, light));
            if self.relative {
                let open = buffers.open_sum.iter_mut().zip(&buffers.open);
                open.for_each(|(o, &e)| *o = o.add_scaled(e, light));
            }
        }
        if self.relative {
            out.iter_mut().zip(&buffers.open_sum).for_each(|(o, open)| *o = share(o, open));
        }
    }

    /// The nodes of a row that some blocker may darken.
    fn shadowed(&self, j: usize, asked: &Range<usize>) -> Range<usize> {
        let blockers = self.lamps.iter().flat_map(|(_, beams)| beams).flat_map(|b| &b.blockers);
        let spans = blockers.filter(|b| b.rows.contains(&j)).map(|b| b.nodes(j, asked)).filter(|s| !s.is_empty());
        spans.reduce(union).unwrap_or(asked.start..asked.start)
    }
}

fn union(a: Range<usize>, b: Range<usize>) -> Range<usize> {
    a.start.min(b.start)..a.end.max(b.end)
}

/// Shadowed over unshadowed irradiance; exactly 1 where they are the same, and where there is no light.
fn share(shadowed: &Four, open: &Four) -> Four {
    let channel = |i: usize| if open.0[i] > 0.0 { (shadowed.0[i] / open.0[i]).min(1.0) } else { 1.0 };
    Four([channel(0), channel(1), channel(2), 1.0])
}

/// Scratch of one task, a value per node of a row.
#[derive(Default)]
struct Buffers {
    /// World position.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Share of a beam that passes the blockers.
    through: Vec<f32>,
    /// Irradiance of a lamp by unit radiance, with and without blockers.
    lit: Vec<f32>,
    open: Vec<f32>,
    /// Irradiance of all lamps without blockers.
    open_sum: Vec<Four>,
}

impl Buffers {
    /// World positions of a row's nodes.
    fn start(&mut self, seen: &Seen, j: usize, asked: &Range<usize>) {
        let n = asked.len();
        for axis in [&mut self.x, &mut self.y, &mut self.z] {
            axis.resize(n, 0.0);
        }
        self.open_sum.clear();
        self.open_sum.resize(n, Four::ZERO);
        let first = Vector3::new(asked.start as f64, j as f64, 1.0);
        let (p, w) = (seen.point * first, seen.w.dot(&first));
        let (dp, dw) = (seen.point.column(0), seen.w.x);
        let nearest = seen.height / HORIZON;
        for i in 0..n {
            let k = i as f64;
            let scale = 1.0 / (w + k * dw).max(nearest);
            self.x[i] = ((p.x + k * dp[0]) * scale) as f32;
            self.y[i] = ((p.y + k * dp[1]) * scale) as f32;
            self.z[i] = ((p.z + k * dp[2]) * scale) as f32;
        }
    }

    /// Adds up the beams of one lamp.
    fn lamp(&mut self, beams: &[Beam], j: usize, asked: &Range<usize>, open: bool) {
        let n = asked.len();
        for sum in [&mut self.lit, &mut self.open] {
            sum.clear();
            sum.resize(n, 0.0);
        }
        for beam in beams {
            self.through.clear();
            self.through.resize(n, 1.0);
            for blocker in beam.blockers.iter().filter(|b| b.rows.contains(&j)) {
                blocker.darken(j, asked, &mut self.through);
            }
            let points = self.x.iter().zip(&self.y).zip(&self.z);
            let sums = self.lit.iter_mut().zip(&mut self.open).zip(&self.through);
            let strength = beam.strength();
            if open {
                for (((&x, &y), &z), ((lit, open), &through)) in points.zip(sums) {
                    let e = strength.at(x, y, z);
                    *open += e;
                    *lit += e * through;
                }
            } else {
                for (((&x, &y), &z), ((lit, _), &through)) in points.zip(sums) {
                    *lit += strength.at(x, y, z) * through;
                }
            }
        }
    }
}

/// The maps of all receivers, computed in parallel in bands of rows; the same bits for any number of threads.
pub(super) fn maps(receivers: &[Option<Receiver>]) -> Vec<Option<Map>> {
    let mut maps: Vec<_> = receivers.iter().map(|r| r.as_ref().map(Map::empty)).collect();
    let pairs = receivers.iter().zip(&mut maps).filter_map(|(r, m)| Some((r.as_ref()?, m.as_mut()?)));
    let bands: Vec<_> = pairs.flat_map(|(r, m)| m.bands().map(move |(row, band)| (r, row, band))).collect();
    bands.into_par_iter().for_each_init(Buffers::default, |buffers, (receiver, first, band)| {
        for (k, row) in band.chunks_exact_mut(receiver.columns.len()).enumerate() {
            receiver.row(first + k, row, buffers);
        }
    });
    maps
}

impl Map {
    fn empty(receiver: &Receiver) -> Self {
        let (columns, rows) = (receiver.columns.clone(), receiver.rows.clone());
        let values = vec![receiver.empty_value(); columns.len() * rows.len()];
        Self { columns, rows, values }
    }

    /// Bands of rows, each with its first row's number.
    fn bands(&mut self) -> impl Iterator<Item = (usize, &mut [Four])> {
        let (first, width) = (self.rows.start, self.columns.len().max(1));
        self.values.chunks_mut(BAND * width).enumerate().map(move |(k, band)| (first + k * BAND, band))
    }

    /// Does it share nodes with a part of the lattice?
    pub(super) fn meets(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        let meet = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
        meet(&self.columns, &columns) && meet(&self.rows, &rows)
    }

    /// Is a place inside, with all four nodes around it?
    #[inline(always)]
    pub(super) fn holds(&self, column: Place, row: Place) -> bool {
        let (i, j) = (column.0 as usize, row.0 as usize);
        i >= self.columns.start && i + 1 < self.columns.end && j >= self.rows.start && j + 1 < self.rows.end
    }

    /// The value at a place; at the nearest cell for a place outside.
    ///
    /// Maps hold at least two nodes a side.
    #[inline(always)]
    pub(super) fn at(&self, column: Place, row: Place) -> Four {
        let width = self.columns.len();
        let i = (column.0 as usize).saturating_sub(self.columns.start).min(width - 2);
        let j = (row.0 as usize).saturating_sub(self.rows.start).min(self.rows.len() - 2);
        let top = &self.values[j * width + i..][..2];
        let bottom = &self.values[(j + 1) * width + i..][..2];
        Four::bilinear([top[0], top[1]], [bottom[0], bottom[1]], column.1, row.1)
    }
}
