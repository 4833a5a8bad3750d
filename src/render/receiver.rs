//! What reaches a card or the surface: all its light in the open, less what blockers take away.
//!
//! Keeping what is *lost* instead of what arrives makes work sparse, since most beams meet no blocker at most nodes, and
//! makes light exact where nothing is in its way.

use crate::geom::Vector3;
use crate::pixel::LinearRgb;
use crate::render::RenderOptions;
use crate::render::float4::Float4;
use crate::render::half_plane::{grown, sides, span, whole};
use crate::render::lattice::Lattice;
use crate::render::light_samples::{LightGroup, LightSamples};
use crate::render::shadow::{LatticeArea, Occluders, ShadowRay, TexelReads, rows_and_columns};
use crate::render::view::{HORIZON_M, ProjectedPlane, ScenePlane};
use crate::scene::Shot;
use crate::work::{self, Kind};
use std::ops::Range;

/// One receiver under some of its lamps, on a lattice.
#[derive(Debug)]
pub(super) struct Receiver {
    seen: ProjectedPlane,
    /// Nodes outside of these conditions are not asked for.
    outline: Vec<Vector3<f64>>,
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    lamps: Vec<(LinearRgb, Vec<ShadowRay>)>,
    /// Channels that blockers differ in: 1, or 3 where there is film.
    channels: usize,
    /// Irradiance that comes from other lamps than these, before anything is lost.
    pub(super) rest: LinearRgb,
}

/// A receiver under area lights, whose shadows are sharp, and under the sky, whose shadows are soft enough for half the
/// nodes.
#[derive(Debug)]
pub(super) struct ReceiverIrradiance {
    pub(super) fine: Receiver,
    pub(super) coarse: Receiver,
    /// The share of open irradiance is asked for, not irradiance itself.
    pub(super) relative: bool,
}

impl ReceiverIrradiance {
    /// No lamp shines on it.
    pub(super) fn is_dark(&self) -> bool {
        self.fine.lamps.is_empty() && self.coarse.lamps.is_empty()
    }
}

/// What receivers are made from.
pub(super) struct LightingContext<'a> {
    pub(super) fine: Lattice,
    pub(super) coarse: Lattice,
    pub(super) casters: Occluders<'a>,
    pub(super) shot: &'a Shot,
    pub(super) options: RenderOptions,
}

impl LightingContext<'_> {
    /// What lights a sheet on the side of the eye; none where it is seen edge-on. The normal is that of every lattice.
    fn lamps(&self, sheet: &ScenePlane) -> Option<LightSamples> {
        let seen = ProjectedPlane::of(sheet, &self.fine.view)?;
        Some(LightSamples::of(
            self.shot,
            &self.options,
            &sheet.center,
            &seen.normal,
        ))
    }

    /// Card number `own`, asked for where the card is seen and a node around. None where it is not seen at all.
    pub(super) fn card(&self, own: usize, reach: [f64; 2]) -> Option<ReceiverIrradiance> {
        let lamps = self.lamps(&self.casters.cards[own].sheet)?;
        let fine = self.card_on(&self.fine, own, reach, &lamps, &lamps.faces)?;
        let coarse = self.card_on(&self.coarse, own, reach, &lamps, &lamps.sky)?;
        Some(ReceiverIrradiance {
            fine,
            coarse,
            relative: false,
        })
    }

    fn card_on(
        &self,
        lattice: &Lattice,
        own: usize,
        reach: [f64; 2],
        all: &LightSamples,
        some: &[LightGroup],
    ) -> Option<Receiver> {
        let sheet = &self.casters.cards[own].sheet;
        let seen = ProjectedPlane::of(sheet, &lattice.view)?;
        let (rows, columns) = rows_and_columns(sheet, reach, &lattice.view);
        if rows.len() < 2 || columns.len() < 2 {
            return None;
        }
        // Two nodes, for the finer lattice's one that lies between them.
        let outline = sides(&seen.u, &seen.v, &seen.w, reach)
            .iter()
            .map(|s| grown(s, 2.0))
            .collect();
        let cell = seen.cell_metres(&lattice.view, &sheet.center);
        let area = (rows, columns);
        let receiver = self.receiver(lattice, (seen, &area), Some(own), cell, (all, some));
        Some(receiver.within(outline, area.0, area.1))
    }

    /// The surface; asked for where a shadow may fall on it. None where there is no shadow, or none to be seen.
    pub(super) fn surface(&self) -> Option<ReceiverIrradiance> {
        let lamps = self.lamps(&self.casters.surface)?;
        let fine = self.surface_on(&self.fine, &lamps, &lamps.faces)?;
        let coarse = self.surface_on(&self.coarse, &lamps, &lamps.sky)?;
        let doubled = |r: &Range<usize>| {
            if r.is_empty() {
                0..0
            } else {
                (2 * r.start).saturating_sub(2)..2 * r.end
            }
        };
        let view = &self.fine.view;
        let rows = cut(union(fine.rows.clone(), doubled(&coarse.rows)), view.height);
        let columns = cut(
            union(fine.columns.clone(), doubled(&coarse.columns)),
            view.width,
        );
        let seen = rows.len() > 1 && columns.len() > 1;
        seen.then_some(ReceiverIrradiance {
            fine: Receiver {
                rows,
                columns,
                ..fine
            },
            coarse,
            relative: true,
        })
    }

    fn surface_on(
        &self,
        lattice: &Lattice,
        all: &LightSamples,
        some: &[LightGroup],
    ) -> Option<Receiver> {
        let seen = ProjectedPlane::of(&self.casters.surface, &lattice.view)
            .filter(|s| s.normal.z > 0.0)?;
        let cell = seen.cell_metres(&lattice.view, &Vector3::zeros());
        let everywhere = (0..lattice.view.height, 0..lattice.view.width);
        let receiver = self.receiver(lattice, (seen, &everywhere), None, cell, (all, some));
        let blockers = receiver
            .lamps
            .iter()
            .flat_map(|(_, beams)| beams)
            .flat_map(|b| &b.blockers);
        let areas = blockers.map(|b| (b.rows.clone(), b.columns.clone()));
        let (rows, columns) = areas
            .reduce(|a, b| (union(a.0, b.0), union(a.1, b.1)))
            .unwrap_or((0..0, 0..0));
        Some(receiver.within(vec![seen.w], rows, columns))
    }

    fn receiver(
        &self,
        lattice: &Lattice,
        (seen, area): (ProjectedPlane, &LatticeArea),
        own: Option<usize>,
        cell: f64,
        (all, some): (&LightSamples, &[LightGroup]),
    ) -> Receiver {
        let beams = |lamp: &LightGroup| {
            (
                lamp.radiance,
                self.casters
                    .beams((&seen, area), &lattice.view, lamp, own, cell),
            )
        };
        Receiver {
            lamps: some.iter().map(beams).collect(),
            channels: if self.casters.tinted { 3 } else { 1 },
            rest: all.open_sky(),
            seen,
            outline: Vec::new(),
            columns: 0..0,
            rows: 0..0,
        }
    }
}

fn union(a: Range<usize>, b: Range<usize>) -> Range<usize> {
    match (a.is_empty(), b.is_empty()) {
        (true, _) => b,
        (_, true) => a,
        _ => a.start.min(b.start)..a.end.max(b.end),
    }
}

fn cut(range: Range<usize>, end: usize) -> Range<usize> {
    range.start.min(end)..range.end.min(end)
}

/// Scratch of one task, a value per node of a row.
#[derive(Default)]
pub(super) struct RowBuffers {
    /// World position.
    position: [Vec<f32>; 3],
    /// Irradiance by unit radiance of one beam, and of all beams of a lamp.
    strength: Vec<f32>,
    lamp: Vec<f32>,
    /// Share of a beam that passes the blockers, and what a lamp loses to them, per channel.
    through: [Vec<f32>; 3],
    lost: [Vec<f32>; 3],
    /// Nodes that each blocker of a beam touches.
    touched: Vec<(usize, Range<usize>)>,
    /// Irradiance in the open.
    pub(super) open: Vec<Float4>,
    /// Irradiance that blockers take away.
    pub(super) hidden: Vec<Float4>,
    /// A row of hidden irradiance of the coarser lattice.
    pub(super) coarse: Vec<Float4>,
    rays: RayCounts,
}

/// What one row took.
#[derive(Default)]
struct RayCounts {
    light: usize,
    shadow: usize,
    through: TexelReads,
}

impl RayCounts {
    fn counts(self) -> [(Kind, u64); 4] {
        [
            (Kind::LightSamples, self.light as u64),
            (Kind::ShadowRays, self.shadow as u64),
            (Kind::Transmittances, self.through.see_through as u64),
            (Kind::OpaqueEdges, self.through.edges as u64),
        ]
    }
}

impl Receiver {
    fn within(self, outline: Vec<Vector3<f64>>, rows: Range<usize>, columns: Range<usize>) -> Self {
        Self {
            outline,
            rows,
            columns,
            ..self
        }
    }

    /// The nodes of a row that are asked for.
    pub(super) fn asked(&self, j: usize) -> Range<usize> {
        let (low, high) = span(&self.outline, j as f64);
        whole(low, high, &self.columns)
    }

    /// Open and hidden irradiance at the asked nodes of a row: `rest` and this receiver's own lamps.
    pub(super) fn gather(&self, j: usize, asked: &Range<usize>, buffers: &mut RowBuffers) {
        let n = asked.len();
        let LinearRgb { r, g, b } = self.rest;
        refill(&mut buffers.open, n, Float4([r, g, b, 0.0]));
        refill(&mut buffers.hidden, n, Float4::ZERO);
        if self
            .lamps
            .iter()
            .flat_map(|(_, beams)| beams)
            .any(ShadowRay::is_face)
        {
            self.positions(j, asked, &mut buffers.position);
        }
        for (radiance, beams) in &self.lamps {
            let is_face = beams.iter().any(ShadowRay::is_face);
            refill(&mut buffers.lamp, if is_face { n } else { 0 }, 0.0);
            buffers
                .lost
                .iter_mut()
                .take(self.channels)
                .for_each(|lost| refill(lost, n, 0.0));
            let touched = beams
                .iter()
                .map(|beam| self.beam(beam, j, asked, buffers))
                .reduce(union);
            add_lamp(&mut buffers.open, &buffers.lamp, (*radiance).into());
            if let Some(touched) = touched.filter(|t| !t.is_empty()) {
                let lost = |c: usize| &buffers.lost[c.min(self.channels - 1)][touched.clone()];
                add_lost(
                    &mut buffers.hidden[touched.clone()],
                    [lost(0), lost(1), lost(2)],
                    *radiance,
                );
            }
        }
        work::add_all(std::mem::take(&mut buffers.rays).counts());
    }

    /// Adds up a beam; tells the nodes (counted from the first that is asked for) where something is in its way.
    fn beam(
        &self,
        beam: &ShadowRay,
        j: usize,
        asked: &Range<usize>,
        buffers: &mut RowBuffers,
    ) -> Range<usize> {
        let RowBuffers {
            position,
            strength,
            lamp,
            through,
            lost,
            touched,
            rays,
            ..
        } = buffers;
        strength.resize(asked.len(), 0.0);
        // What the sky gives in the open is in `rest`.
        if beam.is_face() {
            beam.strength()
                .fill([&position[0], &position[1], &position[2]], strength);
            lamp.iter_mut()
                .zip(&*strength)
                .for_each(|(sum, e)| *sum += e);
            rays.light += asked.len();
        }
        touched.clear();
        let nodes = beam.blockers.iter().map(|b| b.nodes(j, asked)).enumerate();
        touched.extend(nodes.filter(|(_, nodes)| !nodes.is_empty()));
        let Some(all) = touched.iter().map(|(_, nodes)| nodes.clone()).reduce(union) else {
            return 0..0;
        };
        let here = all.start - asked.start..all.end - asked.start;
        if !beam.is_face() {
            beam.strength().fill([&[]; 3], &mut strength[here.clone()]);
        }
        rays.shadow += all.len();
        for channel in 0..self.channels {
            let through = &mut through[channel];
            refill(through, all.len(), 1.0);
            for (k, nodes) in touched.iter() {
                let through = &mut through[nodes.start - all.start..nodes.end - all.start];
                rays.through += beam.blockers[*k].darken(channel, j, nodes, through);
            }
            lose(
                &mut lost[channel][here.clone()],
                &strength[here.clone()],
                through,
            );
        }
        here
    }

    /// World positions of a row's nodes.
    fn positions(&self, j: usize, asked: &Range<usize>, out: &mut [Vec<f32>; 3]) {
        let seen = &self.seen;
        let first = Vector3::new(asked.start as f64, j as f64, 1.0);
        let (p, w) = (seen.point * first, seen.w.dot(&first));
        let (step, w_step) = (seen.point.column(0), seen.w.x);
        let nearest = seen.height / HORIZON_M;
        for (axis, out) in out.iter_mut().enumerate() {
            out.resize(asked.len(), 0.0);
            for (i, out) in out.iter_mut().enumerate() {
                let k = i as f64;
                *out = ((p[axis] + k * step[axis]) / (w + k * w_step).max(nearest)) as f32;
            }
        }
    }
}

fn refill<T: Copy>(buffer: &mut Vec<T>, n: usize, value: T) {
    buffer.clear();
    buffer.resize(n, value);
}

fn lose(lost: &mut [f32], strength: &[f32], through: &[f32]) {
    for ((lost, e), t) in lost.iter_mut().zip(strength).zip(through) {
        *lost += e * (1.0 - t);
    }
}

fn add_lamp(open: &mut [Float4], lamp: &[f32], radiance: Float4) {
    open.iter_mut()
        .zip(lamp)
        .for_each(|(o, &e)| *o = o.add_scaled(e, radiance));
}

fn add_lost(hidden: &mut [Float4], [r, g, b]: [&[f32]; 3], radiance: LinearRgb) {
    for (((h, &r), &g), &b) in hidden.iter_mut().zip(r).zip(g).zip(b) {
        let [x, y, z, _] = h.0;
        *h = Float4([
            x + r * radiance.r,
            y + g * radiance.g,
            z + b * radiance.b,
            0.0,
        ]);
    }
}
