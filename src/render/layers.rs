//! Cards as layers over the picture, composited front to back, block by block.
//!
//! The reciprocal of a plane's depth is linear in the picture, so if cards have the same order at
//! the four corners of a block, they have it in the whole block. A block with different orders
//! (cards cross) is split until they agree or it is a single pixel, where depth at the pixel's
//! centre decides. Inside a block each card is processed once, as a layer.

use crate::deep::{DeepSample, DeepTile};
use crate::geom::Vector3;
use crate::pixel::{Depth, LinearRgb, Mix, ObjectId};
use crate::render::block::PixelBlock;
use crate::render::float4::Float4;
use crate::render::grade::channel_mean;
use crate::render::half_plane::{ConvexShape, row_span};
use crate::render::irradiance::IrradianceMap;
use crate::render::lattice::{Lattice, LatticePosition};
use crate::render::ranges::{integer_range, range_overlap, ranges_meet};
use crate::render::refill;
use crate::render::texel_grid::{TexelLine, texel_line};
use crate::render::texture::{BakedTexture, TexelContent};
use crate::render::transmittance::{LayerRow, SubsampleRun, Transmittance};
use crate::render::view::{LatticeArea, ProjectedPlane, pixel_center};
use crate::work::{self, Kind};
use nalgebra::Matrix3;
use std::f32::consts::PI;
use std::ops::Range;
use std::sync::Arc;

/// Weight of a sub-sample of the surface that nothing is seen of: it counts where all are hidden.
const MIN_SHARE_WEIGHT: f32 = 1e-20;

/// A card in the picture.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// The card's id.
    pub(super) id: ObjectId,
    /// Its plane in the picture.
    pub(super) plane: ProjectedPlane,
    /// Its colours.
    pub(super) texture: Arc<BakedTexture>,
    /// Irradiance on it; none in the dark.
    pub(super) light: Option<Arc<IrradianceMap>>,
    /// The part where its texture is not empty.
    shape: ConvexShape,
    /// Rows that map `(x, y, 1)` to the position among the texels, times `w`.
    texel_rows: [Vector3<f64>; 2],
    /// Columns of pixels that it may touch.
    pub(super) columns: Range<usize>,
    /// Rows of pixels that it may touch.
    pub(super) rows: Range<usize>,
}

/// Positions of the samples of all pixels.
#[derive(Clone, Debug)]
pub(super) struct SampleGrid {
    /// Positions along each side of a pixel, from its centre.
    pub(super) offsets: Vec<f64>,
    /// Whether light is looked up per sub-sample and not per pixel, since the lattice is finer than
    /// the pixels.
    pub(super) per_subsample: bool,
    /// Positions in the lattice: sub-sample by sub-sample, or the middles of pixels.
    pub(super) columns: Vec<LatticePosition>,
    /// Positions in the lattice, likewise.
    pub(super) rows: Vec<LatticePosition>,
    /// The lattice under a part of a picture distorted by a lens; `columns` and `rows` are not used
    /// then.
    pub(super) bent: Option<BentLattice>,
}

/// A lattice over the pinhole camera's picture, under a part of the distorted one.
#[derive(Clone, Copy, Debug)]
pub(super) struct BentLattice {
    pub(super) lattice: Lattice,
    /// Maps a position in the picture to one in the pinhole camera's picture.
    pub(super) ideal_from_picture: Matrix3<f64>,
}

/// The surface under the cards, which receives their shadows.
#[derive(Clone, Debug)]
pub(super) struct ShadowCatcher {
    /// Its plane in the picture; none if the camera does not look down on it.
    pub(super) plane: Option<ProjectedPlane>,
    /// Share of its light that shadows leave; none if there is no shadow.
    pub(super) share: Option<Arc<IrradianceMap>>,
}

/// Everything that makes up a picture, ready for rendering.
#[derive(Debug)]
pub(super) struct LayerStack {
    /// Cards, in the order of their ids.
    pub(super) layers: Vec<Layer>,
    /// The surface.
    pub(super) catcher: ShadowCatcher,
    /// Sub-samples.
    pub(super) samples: SampleGrid,
    /// Factor on light.
    pub(super) exposure: f32,
    /// Content of its layers' texels.
    pub(super) content: TexelContent,
}

/// Deep samples of a block, in any order of pixels, front to back within each.
#[derive(Debug, Default)]
pub(super) struct TileSamples {
    /// Index of the pixel in the block, and its sample.
    samples: Vec<(u32, DeepSample)>,
    /// What each sample hides, per channel; empty if no layer is film.
    tints: Vec<LinearRgb>,
}

impl TileSamples {
    fn clear(&mut self) {
        self.samples.clear();
        self.tints.clear();
    }

    fn in_order(&self, block: &PixelBlock) -> DeepTile {
        let size = [block.x.len(), block.y.len()];
        DeepTile::from_samples(size, &self.samples, &self.tints)
    }
}

/// A block's result.
#[derive(Debug)]
pub(super) struct RenderedTile {
    /// Which pixels.
    pub(super) block: PixelBlock,
    pub(super) samples: DeepTile,
    /// The plate's factor, row by row; none if it is 1 everywhere.
    pub(super) shadow: Option<Vec<LinearRgb>>,
}

impl RenderedTile {
    /// A tile without samples, its plate unchanged.
    pub(super) fn new(block: &PixelBlock, may_be_shadowed: bool) -> Self {
        Self {
            samples: DeepTile::default(),
            shadow: may_be_shadowed.then(|| vec![LinearRgb::WHITE; block.len()]),
            block: block.clone(),
        }
    }

    /// The plate's factors for a row of a part of the block.
    fn shadow_row(&mut self, part: &PixelBlock, y: usize) -> Option<&mut [LinearRgb]> {
        let start = self.block.number_of(part.x.start, y);
        let row = self.shadow.as_mut()?;
        Some(&mut row[start..][..part.x.len()])
    }
}

impl BentLattice {
    /// Not inlined: the compiler would also compute it where there is no such lattice, of memory that
    /// was never written, at which valgrind takes offence.
    #[inline(never)]
    fn position_of(&self, px: [f64; 2]) -> (LatticePosition, LatticePosition) {
        let ideal = self.ideal_from_picture * Vector3::new(px[0], px[1], 1.0);
        self.lattice.position_of(ideal.x, ideal.y)
    }

    /// Pixels of the pinhole camera's picture that a block of the picture shows, with a margin.
    fn ideal_area(&self, block: &PixelBlock) -> PixelBlock {
        let ends = block.ends().map(|[x, y]| {
            let ideal = self.ideal_from_picture * Vector3::new(x, y, 1.0);
            [ideal.x, ideal.y]
        });
        let [x, y] = [0, 1].map(|axis: usize| range_around(ends.map(|end| end[axis])));
        PixelBlock { x, y }
    }

    /// Columns and rows of the nodes around a block, with one more on either side.
    fn nodes_around(&self, block: &PixelBlock) -> (Range<usize>, Range<usize>) {
        let nodes = block.ends().map(|end| self.position_of(end));
        let columns = nodes.map(|(column, _)| column.0 as usize);
        (
            range_of_nodes(columns),
            range_of_nodes(nodes.map(|(_, row)| row.0 as usize)),
        )
    }
}

/// The integers between some numbers, with two more on each side.
fn range_around(numbers: [f64; 4]) -> Range<usize> {
    let low = numbers.into_iter().fold(f64::INFINITY, f64::min);
    let high = numbers.into_iter().fold(0.0, f64::max);
    (low.max(0.0) as usize).saturating_sub(2)..high as usize + 3
}

fn range_of_nodes(nodes: [usize; 4]) -> Range<usize> {
    let low = nodes.into_iter().fold(usize::MAX, usize::min);
    let high = nodes.into_iter().fold(0, usize::max);
    low.saturating_sub(1)..high + 3
}

impl SampleGrid {
    /// Lattice positions along a side of a pixel.
    fn positions_per_side(&self) -> usize {
        if self.per_subsample {
            self.offsets.len()
        } else {
            1
        }
    }

    /// Weight of each sub-sample in its pixel.
    #[inline(always)]
    fn sample_weight(&self) -> f32 {
        let r = self.offsets.len();
        1.0 / (r * r) as f32
    }

    /// Lattice position of a position of the grid: a pixel, if light is looked up once per pixel,
    /// or a sub-sample.
    #[inline(always)]
    fn position_of(&self, x: usize, y: usize) -> (LatticePosition, LatticePosition) {
        match &self.bent {
            None => (self.columns[x], self.rows[y]),
            Some(bent) => bent.position_of([self.coordinate_of(x), self.coordinate_of(y)]),
        }
    }

    /// Looks up a map at the pixels of a row, which are not split into sub-samples.
    fn look_up_row(
        &self,
        map: &IrradianceMap,
        pixels: Range<usize>,
        y: usize,
        out: &mut Vec<Float4>,
    ) {
        match &self.bent {
            None => map.values_along(self.rows[y], &self.columns[pixels], out),
            Some(_) => {
                out.clear();
                out.extend(pixels.map(|x| {
                    let (column, row) = self.position_of(x, y);
                    map.value_at(column, row)
                }));
            }
        }
    }

    /// The pixels of a row, among these, that a map holds; all of them if that varies along the row
    /// or within pixels.
    fn pixels_on(&self, map: &IrradianceMap, pixels: &Range<usize>, y: usize) -> Range<usize> {
        if self.per_subsample || self.bent.is_some() {
            return pixels.clone();
        }
        let held = map.held_positions(self.rows[y], &self.columns[pixels.clone()]);
        pixels.start + held.start..pixels.start + held.end
    }

    /// The pixels, among these, whose sub-samples are all on the surface; none if light is looked up
    /// for each sub-sample.
    fn whole_pixels(&self, spans: &CatcherSpans, pixels: &Range<usize>) -> Range<usize> {
        if self.per_subsample {
            return pixels.start..pixels.start;
        }
        integer_range(spans.inner.0 - 0.5, spans.inner.1 - 0.5, pixels)
    }

    /// Picture coordinate of a position of the grid, along one axis.
    fn coordinate_of(&self, index: usize) -> f64 {
        let n = self.positions_per_side();
        let offset = if self.per_subsample {
            self.offsets[index % n]
        } else {
            0.0
        };
        (index / n) as f64 + 0.5 + offset
    }

    /// Columns and rows of the lattice nodes around a block.
    fn nodes_around(&self, block: &PixelBlock) -> (Range<usize>, Range<usize>) {
        if let Some(bent) = &self.bent {
            return bent.nodes_around(block);
        }
        let columns = self.node_range(&block.x, &self.columns);
        (columns, self.node_range(&block.y, &self.rows))
    }

    /// Lattice nodes around some pixels, of the positions along one axis.
    fn node_range(&self, pixels: &Range<usize>, positions: &[LatticePosition]) -> Range<usize> {
        let n = self.positions_per_side();
        let [first, last] = [pixels.start * n, pixels.end * n - 1].map(|i| positions[i].0 as usize);
        // One more node on either side: sub-samples reach beyond the middle of their pixel.
        first.saturating_sub(1)..last + 3
    }
}

impl Layer {
    fn touches(&self, block: &PixelBlock) -> bool {
        ranges_meet(&self.columns, &block.x) && ranges_meet(&self.rows, &block.y)
    }

    /// Reciprocal depth, rounded so that coincident planes have the same.
    fn reciprocal_depth(&self, p: &Vector3<f64>) -> f32 {
        (self.plane.w.dot(p) / self.plane.height) as f32
    }

    /// Whether it is nowhere farther away than another layer.
    fn is_before(&self, other: &Self, points: &[Vector3<f64>]) -> bool {
        let mut points = points.iter();
        points.all(|p| self.reciprocal_depth(p) >= other.reciprocal_depth(p))
    }

    /// Depth at a pixel's centre; the maximum if the plane is behind the camera.
    fn depth_at(&self, x: usize, y: usize) -> Depth {
        Depth(self.plane.depth_at(&pixel_center(x, y)) as f32)
    }

    /// A texture on a plane that may touch these rows and columns of pixels.
    pub(super) fn new(
        id: ObjectId,
        (plane, texture): (ProjectedPlane, Arc<BakedTexture>),
        light: Option<Arc<IrradianceMap>>,
        (rows, columns): LatticeArea,
    ) -> Self {
        Self {
            id,
            shape: ConvexShape::new(&texture.sides_on(&plane)),
            texel_rows: texture.grid.texel_rows(&plane.u, &plane.v, &plane.w),
            plane,
            texture,
            light,
            columns,
            rows,
        }
    }

    /// The layer in a block of a picture that an affine map takes to this one.
    fn seen_through(&self, map: &Matrix3<f64>, block: &PixelBlock) -> Self {
        let (plane, texture) = (self.plane.seen_through(map), Arc::clone(&self.texture));
        let area = (block.y.clone(), block.x.clone());
        Self::new(self.id, (plane, texture), self.light.clone(), area)
    }

    /// Whether it is farther away than another layer, in the middle of their common area or, if
    /// there is none, in its own middle.
    fn is_behind(&self, other: &Self) -> bool {
        let common = PixelBlock {
            x: range_overlap(&self.columns, &other.columns),
            y: range_overlap(&self.rows, &other.rows),
        };
        let block = if common.len() > 0 {
            common
        } else {
            PixelBlock {
                x: self.columns.clone(),
                y: self.rows.clone(),
            }
        };
        let [x, y] = block.middle();
        let p = Vector3::new(x, y, 1.0);
        let [own, others] = [self, other].map(|layer| layer.reciprocal_depth(&p));
        own < others || (own == others && self.id > other.id)
    }
}

impl LayerStack {
    /// The layers behind one of them, each complete, as a stack of their own.
    pub(super) fn behind(&self, id: ObjectId) -> Self {
        let front = self.layers.iter().find(|layer| layer.id == id);
        let farther = |layer: &&Layer| front.is_some_and(|front| layer.is_behind(front));
        Self {
            layers: self.layers.iter().filter(farther).cloned().collect(),
            catcher: self.catcher.clone(),
            samples: self.samples.clone(),
            ..*self
        }
    }

    /// The same for a block of a picture distorted by a lens: the layers that it may show.
    pub(super) fn bent(&self, bent: BentLattice, block: &PixelBlock) -> Self {
        let map = &bent.ideal_from_picture;
        let area = bent.ideal_area(block);
        let touching = self.layers.iter().filter(|layer| layer.touches(&area));
        Self {
            layers: touching
                .map(|layer| layer.seen_through(map, block))
                .collect(),
            catcher: ShadowCatcher {
                plane: self.catcher.plane.map(|plane| plane.seen_through(map)),
                share: self.catcher.share.clone(),
            },
            samples: SampleGrid {
                columns: Vec::new(),
                rows: Vec::new(),
                offsets: self.samples.offsets.clone(),
                bent: Some(bent),
                ..self.samples
            },
            ..*self
        }
    }

    /// Renders a whole block; `scratch` holds its samples.
    pub(super) fn render_tile(&self, block: PixelBlock, scratch: &mut TileSamples) -> RenderedTile {
        let layers: Vec<_> = (0..self.layers.len())
            .filter(|&k| self.layers[k].touches(&block))
            .collect();
        let may_be_shadowed = self.may_be_shadowed(&block);
        let mut tile = RenderedTile::new(&block, may_be_shadowed);
        if !layers.is_empty() || may_be_shadowed {
            scratch.clear();
            self.render_part(&block, &layers, &mut tile, scratch);
            tile.samples = scratch.in_order(&block);
        }
        tile
    }

    /// Renders a part of a tile, in halves if its layers cross.
    fn render_part(
        &self,
        part: &PixelBlock,
        layers: &[usize],
        tile: &mut RenderedTile,
        samples: &mut TileSamples,
    ) {
        let corners = part.corners();
        let layers = self.sorted_layers(part, &corners, layers);
        if part.len() > 1 && !self.is_sorted_at(&layers, &corners) {
            for half in &part.halves() {
                self.render_part(half, &layers, tile, samples);
            }
        } else {
            self.render_sorted(part, &layers, tile, samples);
        }
    }

    /// Renders a part of a tile whose layers do not cross.
    fn render_sorted(
        &self,
        part: &PixelBlock,
        layers: &[usize],
        tile: &mut RenderedTile,
        samples: &mut TileSamples,
    ) {
        let through = self.render_layers((&tile.block, part), layers, samples);
        if tile.shadow.is_some() {
            work::add(Kind::ShadowedPixels, part.len() as u64);
            self.shade_catcher(part, &through, tile);
        }
    }

    /// The layers that touch a block, sorted by depth in its middle, the nearest first.
    fn sorted_layers(
        &self,
        part: &PixelBlock,
        corners: &[Vector3<f64>; 4],
        layers: &[usize],
    ) -> Vec<usize> {
        let touching = layers.iter().filter(|&&k| self.layers[k].touches(part));
        let mut sorted: Vec<_> = touching.copied().collect();
        let middle = corners.iter().sum::<Vector3<f64>>() / 4.0;
        // A stable sort: coincident cards stay in the order of their ids.
        sorted.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|k| self.layers[k].reciprocal_depth(&middle));
            b.total_cmp(&a)
        });
        sorted
    }

    fn is_sorted_at(&self, layers: &[usize], corners: &[Vector3<f64>; 4]) -> bool {
        layers
            .windows(2)
            .all(|pair| self.layers[pair[0]].is_before(&self.layers[pair[1]], corners))
    }

    /// Composites the layers of a part of a tile front to back; returns the transmittance of all of
    /// them.
    fn render_layers(
        &self,
        (tile, block): (&PixelBlock, &PixelBlock),
        layers: &[usize],
        out: &mut TileSamples,
    ) -> Transmittance {
        let r = self.samples.offsets.len();
        let mut through = Transmittance::unobstructed(block, r, self.content);
        let mut row = LayerRow::default();
        for &k in layers {
            let layer = &self.layers[k];
            for y in range_overlap(&block.y, &layer.rows) {
                self.sample_row(layer, block, y, &mut through, &mut row);
                self.keep_row(layer, (tile, block), y, &mut row, out);
            }
        }
        work::add_all(row.work_counts(self.content));
        through
    }

    /// One row of one layer: every sub-sample's colour and opacity, summed by pixel.
    fn sample_row(
        &self,
        layer: &Layer,
        block: &PixelBlock,
        y: usize,
        through: &mut Transmittance,
        row: &mut LayerRow,
    ) {
        row.start(block.x.len(), self.content);
        for (sy, offset_y) in self.samples.offsets.iter().enumerate() {
            let line = LayerLine::new(layer, block.x.start, y as f64 + 0.5 + offset_y);
            for sx in 0..self.samples.offsets.len() {
                self.sample_line(layer, block, (&line, y), [sx, sy], through, row);
            }
        }
    }

    /// One sub-sample of every pixel of a row that the layer touches.
    fn sample_line(
        &self,
        layer: &Layer,
        block: &PixelBlock,
        (line, y): (&LayerLine, usize),
        [sx, sy]: [usize; 2],
        through: &mut Transmittance,
        row: &mut LayerRow,
    ) {
        let (offset, r) = (self.samples.offsets[sx] as f32, self.samples.offsets.len());
        let pixels = line.pixels(0.5 + offset, block.x.len());
        if pixels.is_empty() {
            return;
        }
        row.touch(&pixels);
        if self.samples.per_subsample {
            self.light_subsamples(layer, block, [sx, y * r + sy], &pixels, row);
        }
        let run = SubsampleRun {
            line: &line.starting_at(0.5 + offset + pixels.start as f32),
            plane: sy * r + sx,
            y: y - block.y.start,
            pixels,
        };
        through.pass_layer(&layer.texture, run, row);
    }

    /// Looks up the light at one sub-sample of some pixels: the column inside its pixel, the row
    /// inside the picture.
    fn light_subsamples(
        &self,
        layer: &Layer,
        block: &PixelBlock,
        [sx, row_of_samples]: [usize; 2],
        pixels: &Range<usize>,
        row: &mut LayerRow,
    ) {
        let Some(light) = &layer.light else { return };
        let (samples, r) = (&self.samples, self.samples.offsets.len());
        row.look_up_light(light, pixels.clone(), |i| {
            samples.position_of((block.x.start + i) * r + sx, row_of_samples)
        });
    }

    /// Stores what a row's pixels received from a layer.
    fn keep_row(
        &self,
        layer: &Layer,
        (tile, block): (&PixelBlock, &PixelBlock),
        y: usize,
        row: &mut LayerRow,
        out: &mut TileSamples,
    ) {
        let is_lit_here = self.light_pixels(layer, block, y, row);
        for (n, i) in row.touched.clone().enumerate() {
            let alpha = row.alpha_at(i, self.content);
            if alpha <= 0.0 {
                continue;
            }
            let x = block.x.start + i;
            let (sum, hidden) = row.seen_at(i, self.content);
            let hidden = hidden.scale(self.samples.sample_weight());
            row.lit += usize::from(is_lit_here && sum.alpha() > 0.0);
            let light = sum.times(row.pixel_light[n]);
            let sample = self.deep_sample(layer, [x, y], light, alpha, hidden);
            out.samples.push((tile.number_of(x, y) as u32, sample));
            if self.content.is_tinted() {
                out.tints.push(hidden.map(|h| h.min(1.0)));
            }
        }
    }

    /// Finds the factors for what a row's pixels received from a layer, and whether these factors
    /// are the light on it: lit sub-samples already include theirs, and in the dark nothing is
    /// visible.
    fn light_pixels(
        &self,
        layer: &Layer,
        block: &PixelBlock,
        y: usize,
        row: &mut LayerRow,
    ) -> bool {
        let touched = row.touched.clone();
        match &layer.light {
            Some(_) if self.samples.per_subsample => {
                refill(&mut row.pixel_light, touched.len(), Float4::ONE);
                false
            }
            Some(light) => {
                let pixels = block.x.start + touched.start..block.x.start + touched.end;
                self.samples
                    .look_up_row(light, pixels, y, &mut row.pixel_light);
                true
            }
            None => {
                refill(&mut row.pixel_light, touched.len(), Float4::ZERO);
                false
            }
        }
    }

    /// A pixel's sample of a layer: sums over its sub-samples of light and alpha, and of what it
    /// hides.
    #[inline(always)]
    fn deep_sample(
        &self,
        layer: &Layer,
        [x, y]: [usize; 2],
        light: Float4,
        alpha: f32,
        hidden: LinearRgb,
    ) -> DeepSample {
        let weight = self.samples.sample_weight();
        let alpha = (alpha * weight).min(1.0);
        DeepSample {
            object: layer.id,
            depth: layer.depth_at(x, y),
            light: light.rgb().scale(weight * self.exposure / PI),
            alpha,
            visible: channel_mean(hidden).min(alpha),
        }
    }

    fn may_be_shadowed(&self, block: &PixelBlock) -> bool {
        let (columns, rows) = self.samples.nodes_around(block);
        let share = &self.catcher.share;
        share.as_ref().is_some_and(|map| map.meets(columns, rows))
    }

    /// Share of the surface's light that shadows leave: the average over its visible part.
    ///
    /// The definition divides average irradiances; the unshadowed one is constant within a pixel
    /// (to about 1e-4), so averaging the share itself gives the same result.
    fn shade_catcher(&self, part: &PixelBlock, through: &Transmittance, tile: &mut RenderedTile) {
        let (Some(map), Some(plane)) = (&self.catcher.share, &self.catcher.plane) else {
            return;
        };
        let edges = plane.sides([0.0; 2]);
        let mut shares = Vec::new();
        for y in part.y.clone() {
            if let Some(row) = tile.shadow_row(part, y) {
                let spans = CatcherSpans::new(&self.samples, &edges, y);
                self.shade_row((map, &spans), (part, y), through, (row, &mut shares));
            }
        }
    }

    /// The shadow of a row of factors that are still 1; `shares` is scratch.
    fn shade_row(
        &self,
        (map, spans): (&IrradianceMap, &CatcherSpans),
        (part, y): (&PixelBlock, usize),
        through: &Transmittance,
        (row, shares): (&mut [LinearRgb], &mut Vec<Float4>),
    ) {
        let shadowed = self.samples.pixels_on(map, &part.x, y);
        let whole = self.samples.whole_pixels(spans, &shadowed);
        self.fill_shares(map, &whole, y, shares);
        let copied = &mut row[whole.start - part.x.start..][..whole.len()];
        for (shadow, share) in copied.iter_mut().zip(shares) {
            *shadow = share.rgb();
        }
        for x in (shadowed.start..whole.start).chain(whole.end..shadowed.end) {
            let i = x - part.x.start;
            let through = through.of_pixel(i, y - part.y.start);
            row[i] = self.mean_share(map, [x, y], spans, through);
        }
    }

    /// Looks up the share at some pixels of a row.
    fn fill_shares(
        &self,
        map: &IrradianceMap,
        pixels: &Range<usize>,
        y: usize,
        shares: &mut Vec<Float4>,
    ) {
        match self.samples.bent {
            None => self.samples.look_up_row(map, pixels.clone(), y, shares),
            Some(_) => {
                shares.clear();
                shares.extend(pixels.clone().map(|x| self.share_at(map, x, y)));
            }
        }
    }

    /// The share at one position of the sample grid.
    #[inline(always)]
    fn share_at(&self, map: &IrradianceMap, x: usize, y: usize) -> Float4 {
        let (column, row) = self.samples.position_of(x, y);
        if map.holds(column, row) {
            map.value_at(column, row)
        } else {
            Float4::ONE
        }
    }

    /// The mean share of a pixel, weighted by the transmittance to each sub-sample, or by nothing if
    /// nothing is seen of the surface; 1 beyond its end.
    fn mean_share(
        &self,
        map: &IrradianceMap,
        at: [usize; 2],
        spans: &CatcherSpans,
        through: impl Iterator<Item = Float4>,
    ) -> LinearRgb {
        let (mut sum, mut weight) = (Float4::ZERO, Float4::ZERO);
        for (sub, t) in through.enumerate() {
            let share = self.subsample_share(map, at, spans, sub);
            let t = t.at_least(MIN_SHARE_WEIGHT);
            sum = sum.add_scaled(1.0, t.times(share));
            weight = weight.add_scaled(1.0, t);
        }
        weighted_mean(&sum, &weight)
    }

    /// The share at a sub-sample of a pixel; 1 beyond the end of the surface.
    #[inline(always)]
    fn subsample_share(
        &self,
        map: &IrradianceMap,
        [x, y]: [usize; 2],
        spans: &CatcherSpans,
        sub: usize,
    ) -> Float4 {
        let r = self.samples.offsets.len();
        let (sx, sy) = (sub % r, sub / r);
        if !spans.hold_sample(sy, x as f64 + 0.5 + self.samples.offsets[sx]) {
            Float4::ONE
        } else if self.samples.per_subsample {
            self.share_at(map, x * r + sx, y * r + sy)
        } else {
            self.share_at(map, x, y)
        }
    }
}

/// The extent of the surface in one row of pixels.
struct CatcherSpans {
    /// Left and right end at each row of sub-samples.
    rows: Vec<(f64, f64)>,
    /// Left-most and right-most pixel centre all of whose sub-samples are on it.
    inner: (f64, f64),
}

impl CatcherSpans {
    fn new(samples: &SampleGrid, edges: &[Vector3<f64>; 5], y: usize) -> Self {
        let offsets = samples.offsets.iter();
        let rows: Vec<_> = offsets
            .map(|o| row_span(edges, y as f64 + 0.5 + o))
            .collect();
        let (low, high) = common_span(&rows);
        let reach = samples.offsets.iter().fold(0.0, |m: f64, o| m.max(o.abs()));
        Self {
            rows,
            inner: (low + reach, high - reach),
        }
    }

    #[inline(always)]
    fn hold_sample(&self, row: usize, x: f64) -> bool {
        x >= self.rows[row].0 && x <= self.rows[row].1
    }
}

/// The intersection of some spans; reversed if it is empty.
fn common_span(spans: &[(f64, f64)]) -> (f64, f64) {
    let low = spans.iter().map(|s| s.0).fold(f64::NEG_INFINITY, f64::max);
    let high = spans.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    (low, high)
}

/// The weighted mean of a share, per channel; exactly 1 if the share is 1 everywhere.
fn weighted_mean(sum: &Float4, weight: &Float4) -> LinearRgb {
    let [r, g, b] = [0, 1, 2].map(|c| (sum.0[c] / weight.0[c]).min(1.0));
    LinearRgb::new(r, g, b)
}

/// A layer along one row of sub-samples; `x` counts pixels from the block's left edge.
struct LayerLine {
    low: f32,
    high: f32,
    position: TexelLine,
}

impl LayerLine {
    fn new(layer: &Layer, left: usize, y: f64) -> Self {
        let plane = &layer.plane;
        let (low, high) = layer.shape.row_span(y);
        let [u, v] = layer.texel_rows;
        let left = left as f64;
        Self {
            low: (low - left) as f32,
            high: (high - left) as f32,
            position: texel_line([u, v, plane.w], &Vector3::new(left, y, 1.0)),
        }
    }

    /// The pixels whose sub-sample at this offset is on the layer.
    fn pixels(&self, offset: f32, count: usize) -> Range<usize> {
        integer_range(
            f64::from(self.low - offset),
            f64::from(self.high - offset),
            &(0..count),
        )
    }

    /// The same line, starting at `x`.
    fn starting_at(&self, x: f32) -> TexelLine {
        self.position.map(|(start, step)| (start + step * x, step))
    }
}
