//! Cards as layers over the picture, walked front to back, block by block.
//!
//! The reciprocal of a plane's depth is linear in the picture, so if the same order of cards holds at the four corners of
//! a block it holds in all of it. A block where it does not (cards cross) is split until it does, or until it is one
//! pixel: order is decided by depth at the pixel's centre there. Inside a block each card is walked once, as a layer.

use crate::deep::DeepSample;
use crate::geom::Vector3;
use crate::pixel::{Depth, LinearRgb, ObjectId};
use crate::render::float4::Float4;
use crate::render::half_plane::{meet, sides, span, whole};
use crate::render::irradiance::IrradianceMap;
use crate::render::lattice::LatticePosition;
use crate::render::texture::{BakedTexture, TexelLine, mean};
use crate::render::transmittance::{LayerRow, Transmittance};
use crate::render::view::ProjectedPlane;
use crate::work::{self, Kind};
use std::f32::consts::PI;
use std::ops::Range;

/// A card in the picture.
#[derive(Debug)]
pub(super) struct Layer {
    /// Whose it is.
    pub(super) id: ObjectId,
    /// How it lies.
    pub(super) seen: ProjectedPlane,
    /// Its colours.
    pub(super) texture: BakedTexture,
    /// Light on it; none in the dark.
    pub(super) light: Option<IrradianceMap>,
    /// Where it ends, its texture's soft border included.
    pub(super) sides: [Vector3<f64>; 5],
    /// Pixels it may touch.
    pub(super) columns: Range<usize>,
    /// Pixels it may touch.
    pub(super) rows: Range<usize>,
}

/// Where the samples of all pixels lie.
#[derive(Debug)]
pub(super) struct SampleGrid {
    /// Positions along each side of a pixel, from its centre.
    pub(super) offsets: Vec<f64>,
    /// Light is looked up for each sub-sample, not for each pixel: where the lattice is finer than pixels are.
    pub(super) each: bool,
    /// Places in the lattice: sub-sample by sub-sample, or the middles of pixels.
    pub(super) columns: Vec<LatticePosition>,
    /// Places in the lattice, the same way.
    pub(super) rows: Vec<LatticePosition>,
}

impl SampleGrid {
    /// Places along a side of a pixel.
    fn per_side(&self) -> usize {
        if self.each { self.offsets.len() } else { 1 }
    }
}

/// The plane under the cards.
#[derive(Debug)]
pub(super) struct ShadowCatcher {
    /// How it lies; none where the camera does not look down on it.
    pub(super) seen: Option<ProjectedPlane>,
    /// What shadows leave of its light; none where there is no shadow.
    pub(super) share: Option<IrradianceMap>,
}

/// A picture's parts, ready to be put together.
#[derive(Debug)]
pub(super) struct LayerStack {
    /// Cards, in the order of their ids.
    pub(super) layers: Vec<Layer>,
    /// The surface.
    pub(super) ground: ShadowCatcher,
    /// Sub-samples.
    pub(super) samples: SampleGrid,
    /// Factor on light.
    pub(super) exposure: f32,
    /// Some layer is film.
    pub(super) tinted: bool,
}

/// A rectangle of pixels.
#[derive(Clone, Debug)]
pub(super) struct PixelBlock {
    /// Columns.
    pub(super) x: Range<usize>,
    /// Rows.
    pub(super) y: Range<usize>,
}

/// Deep samples in any order of pixels, front to back for each.
#[derive(Debug, Default)]
pub(super) struct TileSamples {
    /// Column, row and sample.
    pub(super) samples: Vec<(u32, u32, DeepSample)>,
    /// What each sample hides, per channel; empty where no layer is film.
    pub(super) tints: Vec<LinearRgb>,
}

/// A block's result.
#[derive(Debug)]
pub(super) struct RenderedTile {
    /// Which pixels.
    pub(super) block: PixelBlock,
    /// Samples and their tints.
    pub(super) painting: TileSamples,
    /// The plate's factor, row by row; none where it is 1 everywhere.
    pub(super) shadow: Option<Vec<LinearRgb>>,
}

impl PixelBlock {
    pub(super) fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    fn corners(&self) -> [Vector3<f64>; 4] {
        let x = [self.x.start as f64 + 0.5, self.x.end as f64 - 0.5];
        let y = [self.y.start as f64 + 0.5, self.y.end as f64 - 0.5];
        [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]], [x[1], y[1]]]
            .map(|[x, y]| Vector3::new(x, y, 1.0))
    }

    /// Two halves across the longer side.
    fn halves(&self) -> [Self; 2] {
        let cut = |r: &Range<usize>| r.start + r.len() / 2;
        if self.x.len() >= self.y.len() {
            let c = cut(&self.x);
            [
                Self {
                    x: self.x.start..c,
                    ..self.clone()
                },
                Self {
                    x: c..self.x.end,
                    ..self.clone()
                },
            ]
        } else {
            let c = cut(&self.y);
            [
                Self {
                    y: self.y.start..c,
                    ..self.clone()
                },
                Self {
                    y: c..self.y.end,
                    ..self.clone()
                },
            ]
        }
    }
}

impl Layer {
    fn touches(&self, block: &PixelBlock) -> bool {
        meet(&self.columns, &block.x) && meet(&self.rows, &block.y)
    }

    /// Reciprocal depth, rounded so that planes that coincide have the same.
    fn nearness(&self, p: &Vector3<f64>) -> f32 {
        (self.seen.w.dot(p) / self.seen.height) as f32
    }
}

impl LayerStack {
    /// Everything that is to know about a block.
    pub(super) fn paint(&self, block: PixelBlock) -> RenderedTile {
        let layers: Vec<_> = (0..self.layers.len())
            .filter(|&k| self.layers[k].touches(&block))
            .collect();
        let mut painting = TileSamples::default();
        let mut shadow = self
            .may_be_shadowed(&block)
            .then(|| vec![LinearRgb::WHITE; block.len()]);
        if !layers.is_empty() || shadow.is_some() {
            self.split(&block, &block, &layers, &mut painting, &mut shadow);
        }
        RenderedTile {
            block,
            painting,
            shadow,
        }
    }

    fn split(
        &self,
        whole: &PixelBlock,
        part: &PixelBlock,
        layers: &[usize],
        painting: &mut TileSamples,
        shadow: &mut Option<Vec<LinearRgb>>,
    ) {
        let mut layers: Vec<_> = layers
            .iter()
            .copied()
            .filter(|&k| self.layers[k].touches(part))
            .collect();
        let corners = part.corners();
        let middle = corners.iter().sum::<Vector3<f64>>() / 4.0;
        // A stable sort: cards that coincide stay in the order of their ids.
        layers.sort_by(|&a, &b| {
            self.layers[b]
                .nearness(&middle)
                .total_cmp(&self.layers[a].nearness(&middle))
        });
        if part.len() > 1 && !self.sorted_everywhere(&layers, &corners) {
            return part
                .halves()
                .iter()
                .for_each(|half| self.split(whole, half, &layers, painting, shadow));
        }
        let through = self.walk(part, &layers, painting);
        if let Some(shadow) = shadow {
            work::add(Kind::ShadowedPixels, part.len() as u64);
            self.shade_ground(whole, part, &through, shadow);
        }
    }

    fn sorted_everywhere(&self, layers: &[usize], corners: &[Vector3<f64>; 4]) -> bool {
        let nearer =
            |a: usize, b: usize, p| self.layers[a].nearness(p) >= self.layers[b].nearness(p);
        layers
            .windows(2)
            .all(|pair| corners.iter().all(|p| nearer(pair[0], pair[1], p)))
    }

    /// Walks a block's layers front to back; returns what passes through all of them.
    fn walk(&self, block: &PixelBlock, layers: &[usize], out: &mut TileSamples) -> Transmittance {
        let r = self.samples.offsets.len();
        let mut through = Transmittance::all(block, r, self.tinted);
        let mut row = LayerRow::default();
        for &k in layers {
            let layer = &self.layers[k];
            for y in overlap(&block.y, &layer.rows) {
                self.walk_row(layer, block, y, &mut through, &mut row);
                self.keep(layer, block, y, &mut row, out);
            }
        }
        work::add_all(row.counts(self.tinted));
        through
    }

    /// One row of one layer: every sub-sample's colour and opacity, added up by pixel.
    fn walk_row(
        &self,
        layer: &Layer,
        block: &PixelBlock,
        y: usize,
        through: &mut Transmittance,
        row: &mut LayerRow,
    ) {
        let offsets = &self.samples.offsets;
        let r = offsets.len();
        row.start(block.x.len(), self.tinted);
        for (sy, offset_y) in offsets.iter().enumerate() {
            let line = LayerLine::of(layer, block.x.start, y as f64 + 0.5 + offset_y);
            for (sx, offset_x) in offsets.iter().enumerate() {
                let pixels = line.pixels(0.5 + *offset_x as f32, block.x.len());
                if pixels.is_empty() {
                    continue;
                }
                row.touched = join(&row.touched, &pixels);
                if let (true, Some(light)) = (self.samples.each, &layer.light) {
                    let place = |i: usize| self.samples.columns[(block.x.start + i) * r + sx];
                    row.light_between(light, pixels.clone(), place, self.samples.rows[y * r + sy]);
                }
                let at = line.at(0.5 + *offset_x as f32 + pixels.start as f32);
                let plane = sy * r + sx;
                row.read += pixels.len();
                through.pass(layer, &at, plane, y - block.y.start, pixels, row);
            }
        }
    }

    /// Keeps what a row's pixels got from a layer.
    fn keep(
        &self,
        layer: &Layer,
        block: &PixelBlock,
        y: usize,
        row: &mut LayerRow,
        out: &mut TileSamples,
    ) {
        let r = self.samples.offsets.len();
        let weight = 1.0 / (r * r) as f32;
        for i in row.touched.clone().filter(|&i| row.alpha[i] > 0.0) {
            let x = block.x.start + i;
            let light = match &layer.light {
                Some(map) if !self.samples.each && row.light[i].alpha() > 0.0 => {
                    row.lit += 1;
                    row.light[i].times(self.light_at(map, x, y))
                }
                Some(_) => row.light[i],
                None => Float4([0.0, 0.0, 0.0, row.light[i].alpha()]),
            };
            let hidden = if self.tinted {
                row.hidden[i].rgb()
            } else {
                LinearRgb::grey(row.light[i].alpha())
            };
            let (sample, tint) = self.sample(
                layer,
                [x, y],
                light,
                row.alpha[i] * weight,
                hidden.scale(weight),
            );
            out.samples.push((x as u32, y as u32, sample));
            if self.tinted {
                out.tints.push(tint);
            }
        }
    }

    /// Irradiance in the middle of a pixel.
    #[inline(always)]
    fn light_at(&self, light: &IrradianceMap, x: usize, y: usize) -> Float4 {
        light.at(self.samples.columns[x], self.samples.rows[y])
    }

    fn sample(
        &self,
        layer: &Layer,
        [x, y]: [usize; 2],
        light: Float4,
        alpha: f32,
        hidden: LinearRgb,
    ) -> (DeepSample, LinearRgb) {
        let r = self.samples.offsets.len();
        let weight = 1.0 / (r * r) as f32;
        let w = layer
            .seen
            .w
            .dot(&Vector3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0));
        let depth = if w > 0.0 {
            (layer.seen.height / w) as f32
        } else {
            f32::MAX
        };
        let alpha = alpha.min(1.0);
        let sample = DeepSample {
            object: layer.id,
            depth: Depth(depth),
            light: light.rgb().scale(weight * self.exposure / PI),
            alpha,
            visible: mean(hidden).min(alpha),
        };
        (sample, hidden.map(|h| h.min(1.0)))
    }

    fn may_be_shadowed(&self, block: &PixelBlock) -> bool {
        let Some(map) = &self.ground.share else {
            return false;
        };
        let n = self.samples.per_side();
        let places = |range: &Range<usize>, all: &[LatticePosition]| {
            [all[range.start * n], all[range.end * n - 1]].map(|p| p.0 as usize)
        };
        let [x, y] = [
            places(&block.x, &self.samples.columns),
            places(&block.y, &self.samples.rows),
        ];
        // A node more on either side: sub-samples reach beyond the middle of their pixel.
        map.meets(
            x[0].saturating_sub(1)..x[1] + 3,
            y[0].saturating_sub(1)..y[1] + 3,
        )
    }

    /// What shadows leave of the surface's light: the average over what is seen of it.
    ///
    /// The definition divides average irradiances; the unshadowed one is the same all over a pixel (to about 1e-4 of
    /// it), so that averaging the share itself is the same.
    fn shade_ground(
        &self,
        whole: &PixelBlock,
        block: &PixelBlock,
        through: &Transmittance,
        shadow: &mut [LinearRgb],
    ) {
        let (Some(map), Some(seen)) = (&self.ground.share, &self.ground.seen) else {
            return;
        };
        let offsets = &self.samples.offsets;
        let edges = sides(&seen.u, &seen.v, &seen.w, [0.0; 2]);
        let reach = offsets.iter().fold(0.0, |m: f64, o| m.max(o.abs()));
        for y in block.y.clone() {
            let spans: Vec<_> = offsets
                .iter()
                .map(|o| span(&edges, y as f64 + 0.5 + o))
                .collect();
            let low = spans.iter().map(|s| s.0).fold(f64::NEG_INFINITY, f64::max) + reach;
            let high = spans.iter().map(|s| s.1).fold(f64::INFINITY, f64::min) - reach;
            let line =
                &mut shadow[(y - whole.y.start) * whole.x.len() + block.x.start - whole.x.start..];
            for (i, shadow) in line.iter_mut().take(block.x.len()).enumerate() {
                let x = block.x.start + i;
                let inside = x as f64 + 0.5 >= low && x as f64 + 0.5 <= high;
                *shadow = if inside && !self.samples.each {
                    self.share_at(map, x, y).rgb()
                } else {
                    self.mean_share(map, [x, y], &spans, through.of(i, y - block.y.start))
                };
            }
        }
    }

    /// The share in the middle of a pixel.
    fn share_at(&self, map: &IrradianceMap, x: usize, y: usize) -> Float4 {
        let (column, row) = (self.samples.columns[x], self.samples.rows[y]);
        if map.holds(column, row) {
            map.at(column, row)
        } else {
            Float4::ONE
        }
    }

    /// The mean share of a pixel by what passes to each sub-sample; 1 beyond the end of the surface.
    fn mean_share(
        &self,
        map: &IrradianceMap,
        [x, y]: [usize; 2],
        spans: &[(f64, f64)],
        through: impl Iterator<Item = Float4>,
    ) -> LinearRgb {
        let (r, n) = (self.samples.offsets.len(), self.samples.per_side());
        let (mut sum, mut weight) = (Float4::ZERO, Float4::ZERO);
        for (sub, t) in through.enumerate() {
            let (sx, sy) = (sub % r, sub / r);
            let at = x as f64 + 0.5 + self.samples.offsets[sx];
            let on_ground = at >= spans[sy].0 && at <= spans[sy].1;
            let place = if self.samples.each {
                [x * n + sx, y * n + sy]
            } else {
                [x, y]
            };
            let share = if on_ground {
                self.share_at(map, place[0], place[1])
            } else {
                Float4::ONE
            };
            (sum, weight) = (
                sum.add_scaled(1.0, t.times(share)),
                weight.add_scaled(1.0, t),
            );
        }
        ratio(&sum, &weight)
    }
}

/// The weighted mean of a share, per channel; 1 for no weight, and exactly 1 where the share is 1 all over.
fn ratio(sum: &Float4, weight: &Float4) -> LinearRgb {
    let channel = |c: usize| {
        if weight.0[c] > 0.0 {
            (sum.0[c] / weight.0[c]).min(1.0)
        } else {
            1.0
        }
    };
    LinearRgb::new(channel(0), channel(1), channel(2))
}

/// A layer along one row of sub-samples; `x` counts pixels from the block's left edge.
struct LayerLine {
    low: f32,
    high: f32,
    position: TexelLine,
}

impl LayerLine {
    fn of(layer: &Layer, left: usize, y: f64) -> Self {
        let seen = &layer.seen;
        let (low, high) = span(&layer.sides, y);
        let [u, v] = layer.texture.grid.rows(&seen.u, &seen.v, &seen.w);
        let first = Vector3::new(left as f64, y, 1.0);
        let linear = |row: &Vector3<f64>| (row.dot(&first) as f32, row.x as f32);
        let relative = |x: f64| (x - left as f64) as f32;
        Self {
            low: relative(low),
            high: relative(high),
            position: [linear(&u), linear(&v), linear(&seen.w)],
        }
    }

    /// The pixels whose sub-sample at this offset is on the layer.
    fn pixels(&self, offset: f32, count: usize) -> Range<usize> {
        whole(
            f64::from(self.low - offset),
            f64::from(self.high - offset),
            &(0..count),
        )
    }

    /// The same line, counted from `x`.
    fn at(&self, x: f32) -> TexelLine {
        self.position.map(|(start, step)| (start + step * x, step))
    }
}

fn join(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    if a.is_empty() {
        b.clone()
    } else {
        a.start.min(b.start)..a.end.max(b.end)
    }
}

fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}
