//! Light that reaches a card or the surface: all its light in the open, less what occluders block.
//!
//! Tracking the light that is *lost* instead of the light that arrives makes work sparse, since
//! most rays meet no occluder at most nodes, and makes unobstructed light exact.

use crate::geom::Vector3;
use crate::pixel::{LinearRgb, Mix};
use crate::render::float4::Float4;
use crate::render::half_plane::{ConvexShape, grown_side};
use crate::render::lattice::{COARSER, Lattice};
use crate::render::light_samples::{LightGroup, LightSamples, LitPatch};
use crate::render::occluders::Occluders;
use crate::render::ranges::{integer_range, range_overlap, range_union, range_until};
use crate::render::shadow::{ProjectedShadow, ShadowedReceiver, TexelReads};
use crate::render::shadow_ray::{FaceIrradiance, ShadowRay, UnitIrradiance, shadow_rays};
use crate::render::texture::BakedTexture;
use crate::render::view::{
    CameraView, HORIZON_M, LatticeArea, ProjectedPlane, ScenePlane, rows_and_columns,
};
use crate::render::{RenderOptions, refill};
use crate::scene::{Card, LightGrid, Shot};
use crate::work::{self, Kind};
use std::ops::Range;

/// Rows of nodes that one task computes.
pub(super) const BAND_ROWS: usize = 16;

/// One receiver under some of its lights, on a lattice.
#[derive(Debug)]
pub(super) struct Receiver {
    plane: ProjectedPlane,
    /// Nodes outside these sides are not requested.
    outline: ConvexShape,
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    groups: Vec<RayGroup>,
    /// Irradiance from lights other than these, before anything is lost.
    open_sky: LinearRgb,
}

/// Rays to light samples of one colour.
#[derive(Debug)]
struct RayGroup {
    radiance: LinearRgb,
    rays: Vec<ShadowRay>,
}

impl RayGroup {
    fn has_faces(&self) -> bool {
        self.rays.iter().any(ShadowRay::is_face)
    }
}

/// A receiver under lights with sharp shadows, and under the rest of the sky, whose shadows are
/// soft enough for a coarser lattice.
#[derive(Debug)]
pub(super) struct ReceiverIrradiance {
    pub(super) fine: Receiver,
    pub(super) coarse: Receiver,
    /// Whether the share of open irradiance is requested, instead of irradiance itself.
    pub(super) relative: bool,
    /// Distribution of the light; the plate of a surface shows its own.
    light_grid: Option<LightGrid>,
}

impl ReceiverIrradiance {
    /// Whether no light shines on it.
    pub(super) fn is_dark(&self) -> bool {
        self.fine.groups.is_empty() && self.coarse.groups.is_empty()
    }

    /// Applies the shot's distribution of light to the requested nodes of a row.
    pub(super) fn spread_light(&self, row: &mut RowSums, out: &mut [Float4]) {
        let Some(grid) = &self.light_grid else {
            return;
        };
        self.fine
            .fill_positions(row.j, &row.requested, &mut row.position);
        let [x, y, _] = &row.position;
        for (out, (x, y)) in out.iter_mut().zip(x.iter().zip(y)) {
            *out = out.light_scaled(grid.factor_at(f64::from(*x), f64::from(*y)));
        }
    }

    /// The value of nodes that are not requested.
    pub(super) fn unlit_value(&self) -> Float4 {
        if self.relative {
            Float4::ONE
        } else {
            Float4::ZERO
        }
    }
}

/// Inputs shared by all receivers.
pub(super) struct LightingContext<'a> {
    pub(super) fine: Lattice,
    coarse: Lattice,
    pub(super) occluders: Occluders<'a>,
    shot: &'a Shot,
    options: RenderOptions,
}

/// The lights for whose shadows a receiver is computed, and the irradiance of the whole sky.
#[derive(Clone, Copy)]
struct SelectedLights<'a> {
    groups: &'a [LightGroup],
    open_sky: LinearRgb,
}

impl<'a> LightingContext<'a> {
    /// The lattices and occluders of a shot with these cards.
    pub(super) fn new(
        shot: &'a Shot,
        cards: &[(&'a Card, ScenePlane)],
        view: &CameraView,
        options: RenderOptions,
    ) -> Self {
        Self {
            fine: Lattice::new(view, options.cell_px),
            coarse: Lattice::coarser(view, options.cell_px),
            occluders: Occluders::new(cards, ScenePlane::shadow_catcher(shot.catcher)),
            shot,
            options,
        }
    }

    /// The relevant light on a plane, on the side of the camera; none if it is seen edge-on. The
    /// normal is that of every lattice.
    fn light_samples(
        &self,
        plane: &ScenePlane,
        center: Vector3<f64>,
        [reach, spread]: [f64; 2],
    ) -> Option<LightSamples> {
        let projected = ProjectedPlane::new(plane, &self.fine.view)?;
        let patch = LitPatch {
            center,
            normal: projected.normal,
            reach,
            spread,
            occluded: self.occluders.height_above(&projected.normal, &center),
            cell: projected.cell_metres(&self.fine.view, &center),
        };
        Some(LightSamples::above(self.shot, &self.options, &patch))
    }

    /// Card number `own`, at the nodes where its texture is not empty and one around. None if the
    /// card is not visible at all.
    pub(super) fn card(&self, own: usize, seen: &VisibleSide<'_>) -> Option<ReceiverIrradiance> {
        let plane = &self.occluders.cards[own].plane;
        let lights = self.light_samples(plane, plane.center, [plane.half_length(); 2])?;
        let [sharp, soft] = SelectedLights::split(&lights);
        Some(ReceiverIrradiance {
            fine: self.card_on(&self.fine, own, seen, sharp)?,
            coarse: self.card_on(&self.coarse, own, seen, soft)?,
            relative: false,
            light_grid: self.shot.light_grid.clone(),
        })
    }

    fn card_on(
        &self,
        lattice: &Lattice,
        own: usize,
        seen: &VisibleSide<'_>,
        lights: SelectedLights<'_>,
    ) -> Option<Receiver> {
        let (view, plane) = (&lattice.view, &self.occluders.cards[own].plane);
        let projected = ProjectedPlane::new(plane, view)?;
        let area = rows_and_columns(plane, seen.texture.grid.reach, view);
        if area.0.len() < 2 || area.1.len() < 2 {
            return None;
        }
        let shadowed = ShadowedReceiver::new(&projected, &area, lattice, Some(own), &plane.center);
        let groups = self.ray_groups(&shadowed, lights);
        let outline = seen.outline(&projected);
        Some(self.receiver(projected, groups, lights, (outline, area)))
    }

    /// The surface, at the nodes where a shadow may fall on it. None if there is no shadow, or no
    /// visible one.
    pub(super) fn surface(&self) -> Option<ReceiverIrradiance> {
        // The surface may be infinite; its shadows are as large as cards.
        let center = self.occluders.middle_on_surface();
        let planes = || self.occluders.cards.iter().map(|card| &card.plane);
        let reach = planes().map(ScenePlane::half_length).fold(0.0, f64::max);
        let ends = planes().map(|plane| (plane.center - center).xy().norm() + plane.half_length());
        let spread = ends.fold(0.0, f64::max);
        let lights = self.light_samples(&self.occluders.surface, center, [reach, spread])?;
        let [sharp, soft] = SelectedLights::split(&lights);
        let fine = self.surface_on(&self.fine, sharp)?;
        let coarse = self.surface_on(&self.coarse, soft)?;
        let fine = fine.grown_around(&coarse, &self.fine.view);
        fine.has_cells().then_some(ReceiverIrradiance {
            fine,
            coarse,
            relative: true,
            light_grid: None,
        })
    }

    fn surface_on(&self, lattice: &Lattice, lights: SelectedLights<'_>) -> Option<Receiver> {
        let view = &lattice.view;
        let projected = ProjectedPlane::from_above(&self.occluders.surface, view)?;
        let everywhere = view.whole_area();
        let target = self.occluders.middle_on_surface();
        let shadowed = ShadowedReceiver::new(&projected, &everywhere, lattice, None, &target);
        let groups = self.ray_groups(&shadowed, lights);
        let area = shadowed_area(&groups);
        Some(self.receiver(
            projected,
            groups,
            lights,
            (ConvexShape::new(&[projected.w]), area),
        ))
    }

    fn ray_groups(
        &self,
        receiver: &ShadowedReceiver<'_>,
        lights: SelectedLights<'_>,
    ) -> Vec<RayGroup> {
        lights
            .groups
            .iter()
            .map(|group| RayGroup {
                radiance: group.radiance,
                rays: shadow_rays(&self.occluders, receiver, group),
            })
            .collect()
    }

    fn receiver(
        &self,
        plane: ProjectedPlane,
        groups: Vec<RayGroup>,
        lights: SelectedLights<'_>,
        (outline, (rows, columns)): (ConvexShape, LatticeArea),
    ) -> Receiver {
        Receiver {
            groups,
            open_sky: lights.open_sky,
            plane,
            outline,
            columns,
            rows,
        }
    }
}

impl<'a> SelectedLights<'a> {
    /// Lights with sharp shadows, and those with soft ones.
    fn split(all: &'a LightSamples) -> [Self; 2] {
        let open_sky = all.open_sky();
        [&all.sharp, &all.soft].map(|groups| Self { groups, open_sky })
    }
}

/// The side of a card that faces the camera.
pub(super) struct VisibleSide<'a> {
    pub(super) texture: &'a BakedTexture,
    /// Whether its texture is mirrored.
    pub(super) mirrored: bool,
}

impl VisibleSide<'_> {
    /// The requested nodes of a card: two beyond its visible part, so that those of the finer
    /// lattice in between are included.
    fn outline(&self, plane: &ProjectedPlane) -> ConvexShape {
        let sides = self.texture.sides_on(&plane.mirrored_if(self.mirrored));
        ConvexShape::new(&sides.map(|side| grown_side(&side, 2.0)))
    }
}

/// Bounds of all shadows on a receiver.
fn shadowed_area(groups: &[RayGroup]) -> LatticeArea {
    let rays = groups.iter().flat_map(|group| &group.rays);
    rays.flat_map(|ray| &ray.shadows)
        .map(ProjectedShadow::area)
        .reduce(area_union)
        .unwrap_or((0..0, 0..0))
}

fn area_union(a: LatticeArea, b: LatticeArea) -> LatticeArea {
    (range_union(a.0, b.0), range_union(a.1, b.1))
}

/// Nodes of a lattice, and those around the nodes of the coarser one.
fn finer_union(fine: &Range<usize>, coarse: &Range<usize>) -> Range<usize> {
    range_union(fine.clone(), finer_nodes(coarse))
}

fn finer_nodes(coarse: &Range<usize>) -> Range<usize> {
    if coarse.is_empty() {
        0..0
    } else {
        (COARSER * coarse.start).saturating_sub(2 * COARSER - 2)..COARSER * (coarse.end - 1) + 1
    }
}

/// Scratch memory of one task.
#[derive(Default)]
pub(super) struct BandBuffers {
    /// The rows of the band.
    pub(super) rows: Vec<RowSums>,
    /// A row of hidden irradiance of the coarser lattice.
    pub(super) coarse: Vec<Float4>,
    ray: RayBuffers,
}

/// Sums of a row: a value per requested node.
#[derive(Default)]
pub(super) struct RowSums {
    /// Its index.
    j: usize,
    pub(super) requested: Range<usize>,
    /// World position.
    position: [Vec<f32>; 3],
    /// Irradiance for unit radiance from all rays of a group of faces, in the open.
    group: Vec<f32>,
    /// Irradiance in the open.
    pub(super) open: Vec<Float4>,
    /// Irradiance that occluders block.
    pub(super) hidden: Vec<Float4>,
}

/// A row for one ray.
#[derive(Default)]
struct RayBuffers {
    /// Irradiance for unit radiance.
    strength: Vec<f32>,
    /// Transmittance of the occluders, per channel.
    through: Vec<Float4>,
    /// Nodes of each row of the band that each shadow touches.
    touched: Vec<Vec<(usize, Range<usize>)>>,
    counts: RayCounts,
}

/// Work done for some rows.
#[derive(Default)]
struct RayCounts {
    light: usize,
    shadow: usize,
    through: TexelReads,
}

impl RayCounts {
    fn into_work(self) -> [(Kind, u64); 4] {
        [
            (Kind::LightSamples, self.light as u64),
            (Kind::ShadowRays, self.shadow as u64),
            (Kind::Transmittances, self.through.see_through as u64),
            (Kind::OpaqueEdges, self.through.edges as u64),
        ]
    }
}

impl Receiver {
    /// The requested nodes of a row.
    pub(super) fn requested_nodes(&self, j: usize) -> Range<usize> {
        self.outline.nodes(j, &self.columns)
    }

    /// Open and hidden irradiance at the requested nodes of some rows: the open sky and this
    /// receiver's own lights.
    ///
    /// Ray by ray, so that the part of a texture that shadows the rows is read at once.
    pub(super) fn gather_band(&self, rows: Range<usize>, buffers: &mut BandBuffers) {
        buffers.rows.resize_with(rows.len(), RowSums::default);
        let has_faces = self.groups.iter().any(RayGroup::has_faces);
        for (row, j) in buffers.rows.iter_mut().zip(rows) {
            row.start(j, self.requested_nodes(j), self.open_sky.into());
            if has_faces {
                self.fill_positions(j, &row.requested, &mut row.position);
            }
        }
        for group in &self.groups {
            gather_group(group, &mut buffers.rows, &mut buffers.ray);
        }
        work::add_all(std::mem::take(&mut buffers.ray.counts).into_work());
    }

    /// Whether there are at least two nodes along each side.
    fn has_cells(&self) -> bool {
        self.rows.len() > 1 && self.columns.len() > 1
    }

    /// Adds the nodes that a receiver on the coarser lattice needs around its own, clipped to the
    /// picture.
    fn grown_around(self, coarse: &Self, view: &CameraView) -> Self {
        let rows = finer_union(&self.rows, &coarse.rows);
        let columns = finer_union(&self.columns, &coarse.columns);
        Self {
            rows: range_until(rows, view.height),
            columns: range_until(columns, view.width),
            ..self
        }
    }

    /// World positions of a row's nodes.
    fn fill_positions(&self, j: usize, requested: &Range<usize>, out: &mut [Vec<f32>; 3]) {
        let plane = &self.plane;
        let first = Vector3::new(requested.start as f64, j as f64, 1.0);
        let (p, w) = (plane.point * first, plane.w.dot(&first));
        let (step, w_step) = (plane.point.column(0), plane.w.x);
        let nearest = plane.height / HORIZON_M;
        for (axis, out) in out.iter_mut().enumerate() {
            out.resize(requested.len(), 0.0);
            fill_quotients((p[axis], step[axis]), (w, w_step), nearest, out);
        }
    }
}

/// Sums a group of rays.
fn gather_group(group: &RayGroup, rows: &mut [RowSums], buffers: &mut RayBuffers) {
    let has_faces = group.has_faces();
    let radiance = group.radiance.into();
    if has_faces {
        rows.iter_mut().for_each(RowSums::start_faces);
    }
    for ray in &group.rays {
        buffers.touch_shadows(ray, rows);
        for (n, row) in rows.iter_mut().enumerate() {
            if !row.requested.is_empty() {
                row.add_ray((ray, n), radiance, buffers);
            }
        }
    }
    if has_faces {
        rows.iter_mut().for_each(|row| row.add_faces(radiance));
    }
}

impl RowSums {
    /// Resets the sums: only the open sky, and nothing hidden.
    fn start(&mut self, j: usize, requested: Range<usize>, open_sky: Float4) {
        refill(&mut self.open, requested.len(), open_sky);
        refill(&mut self.hidden, requested.len(), Float4::ZERO);
        (self.j, self.requested) = (j, requested);
    }

    /// Resets the sums of one group of faces.
    fn start_faces(&mut self) {
        refill(&mut self.group, self.requested.len(), 0.0);
    }

    /// Adds a group of faces with this radiance to the irradiance in the open.
    fn add_faces(&mut self, radiance: Float4) {
        for (open, &e) in self.open.iter_mut().zip(&self.group) {
            *open = open.add_scaled(e, radiance);
        }
    }

    /// Adds a ray with this radiance to the row with this index in its band.
    fn add_ray(
        &mut self,
        (ray, n): (&ShadowRay, usize),
        radiance: Float4,
        buffers: &mut RayBuffers,
    ) {
        match ray.unit_irradiance() {
            UnitIrradiance::Even(share) => self.hide_sky((ray, n), radiance.scaled(share), buffers),
            UnitIrradiance::Face(face) => {
                self.add_face(&face, buffers);
                self.hide_face((ray, n), radiance, buffers);
            }
        }
    }

    /// Adds the open irradiance of a piece of an area light to its group.
    fn add_face(&mut self, face: &FaceIrradiance, buffers: &mut RayBuffers) {
        let [x, y, z] = &self.position;
        buffers.strength.resize(self.requested.len(), 0.0);
        face.fill([x, y, z], &mut buffers.strength);
        for (sum, e) in self.group.iter_mut().zip(&buffers.strength) {
            *sum += e;
        }
        buffers.counts.light += buffers.strength.len();
    }

    /// Adds the hidden part of a piece of the sky; its open irradiance is part of the open sky.
    fn hide_sky(&mut self, ray: (&ShadowRay, usize), irradiance: Float4, buffers: &mut RayBuffers) {
        let Some(nodes) = buffers.see_through(ray, self.j, &self.requested) else {
            return;
        };
        add_hidden(&mut self.hidden[nodes], &buffers.through, irradiance);
    }

    /// Adds the hidden part of a piece of an area light, by its strength at each node.
    fn hide_face(&mut self, ray: (&ShadowRay, usize), radiance: Float4, buffers: &mut RayBuffers) {
        let Some(nodes) = buffers.see_through(ray, self.j, &self.requested) else {
            return;
        };
        let strength = &buffers.strength[nodes.clone()];
        let hidden = &mut self.hidden[nodes];
        add_hidden_by_strength(hidden, &buffers.through, strength, radiance);
    }
}

/// Adds the blocked part of a constant irradiance.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn add_hidden(hidden: &mut [Float4], through: &[Float4], irradiance: Float4) {
    for (hidden, through) in hidden.iter_mut().zip(through) {
        *hidden = hidden.add_product(through.complement(), irradiance);
    }
}

/// Adds the blocked part of a radiance with a strength at each node.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn add_hidden_by_strength(
    hidden: &mut [Float4],
    through: &[Float4],
    strength: &[f32],
    radiance: Float4,
) {
    for ((hidden, through), &e) in hidden.iter_mut().zip(through).zip(strength) {
        *hidden = hidden.add_product(through.complement(), radiance.scaled(e));
    }
}

impl RayBuffers {
    /// Records which nodes of each row of a band a ray's shadows touch.
    fn touch_shadows(&mut self, ray: &ShadowRay, rows: &[RowSums]) {
        self.touched.resize_with(rows.len(), Vec::new);
        self.touched.iter_mut().for_each(Vec::clear);
        let first = rows.first().map_or(0, |row| row.j);
        let band = first..first + rows.len();
        for (k, shadow) in ray.shadows.iter().enumerate() {
            let touched = range_overlap(&shadow.rows, &band);
            if !touched.is_empty() {
                self.touch_shadow((k, shadow), touched, rows);
            }
        }
    }

    /// Records which nodes of some rows of a band a shadow touches.
    fn touch_shadow(
        &mut self,
        (k, shadow): (usize, &ProjectedShadow),
        touched: Range<usize>,
        rows: &[RowSums],
    ) {
        let first = rows[0].j;
        let (lows, highs) = shadow.row_spans::<BAND_ROWS>(first);
        for n in touched.start - first..touched.end - first {
            let nodes = integer_range(lows[n], highs[n], &rows[n].requested);
            if !nodes.is_empty() {
                self.touched[n].push((k, nodes));
            }
        }
    }

    /// Computes the transmittance of all shadows of a ray in a row, the `n`-th of its band; returns
    /// at which of the requested nodes, counted from the first. None if there is no shadow.
    fn see_through(
        &mut self,
        (ray, n): (&ShadowRay, usize),
        j: usize,
        requested: &Range<usize>,
    ) -> Option<Range<usize>> {
        let touched = self.touched[n].iter().map(|(_, nodes)| nodes.clone());
        let all = touched.reduce(range_union)?;
        self.fill_through((ray, n), j, &all);
        Some(all.start - requested.start..all.end - requested.start)
    }

    /// Computes the transmittance of all shadows of a ray at these nodes.
    fn fill_through(&mut self, (ray, n): (&ShadowRay, usize), j: usize, all: &Range<usize>) {
        self.counts.shadow += all.len();
        refill(&mut self.through, all.len(), Float4::ONE);
        for (k, nodes) in &self.touched[n] {
            let through = &mut self.through[nodes.start - all.start..nodes.end - all.start];
            self.counts.through += ray.shadows[*k].attenuate(j, nodes, through);
        }
    }
}

/// Quotients along a row, from two numbers and their steps; the divisor is never below a bound.
#[inline]
fn fill_quotients(p: (f64, f64), w: (f64, f64), lowest: f64, out: &mut [f32]) {
    for (i, out) in out.iter_mut().enumerate() {
        let k = i as f64;
        *out = ((p.0 + k * p.1) / (w.0 + k * w.1).max(lowest)) as f32;
    }
}
