//! Cards as layers over the picture, walked front to back, block by block.
//!
//! The reciprocal of a plane's depth is linear in the picture, so if the same order of cards holds at the four corners of
//! a block it holds in all of it. A block where it does not (cards cross) is split until it does, or until it is one
//! pixel: order is decided by depth at the pixel's centre there. Inside a block each card is walked once, as a layer.

use crate::geom::Vector3;
use crate::pixel::{Depth, LinearRgb, ObjectId};
use crate::render::DeepSample;
use crate::render::four::Four;
use crate::render::half_plane::{sides, span};
use crate::render::irradiance::{Map, Place};
use crate::render::texture::Baked;
use crate::render::view::Seen;
use std::f32::consts::PI;
use std::ops::Range;

/// What is behind this little transmittance is not worth shading.
const OPAQUE: f32 = 1e-4;

/// A card in the picture.
#[derive(Debug)]
pub(super) struct Layer {
    /// Whose it is.
    pub(super) id: ObjectId,
    /// How it lies.
    pub(super) seen: Seen,
    /// Its colours.
    pub(super) texture: Baked,
    /// Light on it.
    pub(super) light: Map,
    /// Pixels it may touch.
    pub(super) columns: Range<usize>,
    /// Pixels it may touch.
    pub(super) rows: Range<usize>,
}

/// Where the samples of all pixels lie.
#[derive(Debug)]
pub(super) struct Samples {
    /// Positions along each side of a pixel, from its centre.
    pub(super) offsets: Vec<f64>,
    /// Places in the lattice, sub-sample by sub-sample.
    pub(super) columns: Vec<Place>,
    /// Places in the lattice, sub-sample by sub-sample.
    pub(super) rows: Vec<Place>,
}

/// The plane under the cards.
#[derive(Debug)]
pub(super) struct Ground {
    /// How it lies; none where the camera does not look down on it.
    pub(super) seen: Option<Seen>,
    /// What shadows leave of its light; none where there is no shadow.
    pub(super) share: Option<Map>,
}

/// A picture's parts, ready to be put together.
#[derive(Debug)]
pub(super) struct Stack {
    /// Cards, in the order of their ids.
    pub(super) layers: Vec<Layer>,
    /// The surface.
    pub(super) ground: Ground,
    /// Sub-samples.
    pub(super) samples: Samples,
    /// Factor on light.
    pub(super) exposure: f32,
}

/// A rectangle of pixels.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Columns.
    pub(super) x: Range<usize>,
    /// Rows.
    pub(super) y: Range<usize>,
}

/// A block's result.
#[derive(Debug)]
pub(super) struct Painted {
    /// Which pixels.
    pub(super) block: Block,
    /// Column, row and sample; front to back for each pixel.
    pub(super) samples: Vec<(u32, u32, DeepSample)>,
    /// The plate's factor, row by row; none where it is 1 everywhere.
    pub(super) shadow: Option<Vec<LinearRgb>>,
}

impl Block {
    fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    fn corners(&self) -> [Vector3<f64>; 4] {
        let x = [self.x.start as f64 + 0.5, self.x.end as f64 - 0.5];
        let y = [self.y.start as f64 + 0.5, self.y.end as f64 - 0.5];
        [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]], [x[1], y[1]]].map(|[x, y]| Vector3::new(x, y, 1.0))
    }

    /// Two halves across the longer side.
    fn halves(&self) -> [Self; 2] {
        let cut = |r: &Range<usize>| r.start + r.len() / 2;
        if self.x.len() >= self.y.len() {
            let c = cut(&self.x);
            [Self { x: self.x.start..c, ..self.clone() }, Self { x: c..self.x.end, ..self.clone() }]
        } else {
            let c = cut(&self.y);
            [Self { y: self.y.start..c, ..self.clone() }, Self { y: c..self.y.end, ..self.clone() }]
        }
    }
}

impl Layer {
    fn touches(&self, block: &Block) -> bool {
        let meet = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
        meet(&self.columns, &block.x) && meet(&self.rows, &block.y)
    }

    /// Reciprocal depth, rounded so that planes that coincide have the same.
    fn nearness(&self, p: &Vector3<f64>) -> f32 {
        (self.seen.w.dot(p) / self.seen.height) as f32
    }
}

impl Stack {
    /// Everything that is to know about a block.
    pub(super) fn paint(&self, block: Block) -> Painted {
        let layers: Vec<_> = (0..self.layers.len()).filter(|&k| self.layers[k].touches(&block)).collect();
        let mut samples = Vec::new();
        let mut shadow = self.may_be_shadowed(&block).then(|| vec![LinearRgb::WHITE; block.len()]);
        if !layers.is_empty() || shadow.is_some() {
            self.split(&block, &block, &layers, &mut samples, &mut shadow);
        }
        Painted { block, samples, shadow }
    }

    fn split(
        &self,
        whole: &Block,
        part: &Block,
        layers: &[usize],
        samples: &mut Vec<(u32, u32, DeepSample)>,
        shadow: &mut Option<Vec<LinearRgb>>,
    ) {
        let mut layers: Vec<_> = layers.iter().copied().filter(|&k| self.layers[k].touches(part)).collect();
        let corners = part.corners();
        let middle = corners.iter().sum::<Vector3<f64>>() / 4.0;
        // A stable sort: cards that coincide stay in the order of their ids.
        layers.sort_by(|&a, &b| self.layers[b].nearness(&middle).total_cmp(&self.layers[a].nearness(&middle)));
        if part.len() > 1 && !self.sorted_everywhere(&layers, &corners) {
            return part.halves().iter().for_each(|half| self.split(whole, half, &layers, samples, shadow));
        }
        let through = self.walk(part, &layers, samples);
        if let Some(shadow) = shadow {
            self.shade_ground(whole, part, &through, shadow);
        }
    }

    fn sorted_everywhere(&self, layers: &[usize], corners: &[Vector3<f64>; 4]) -> bool {
        let nearer = |a: usize, b: usize, p| self.layers[a].nearness(p) >= self.layers[b].nearness(p);
        layers.windows(2).all(|pair| corners.iter().all(|p| nearer(pair[0], pair[1], p)))
    }

    /// Walks a block's layers front to back; returns what passes through all of them, for each sub-sample.
    fn walk(&self, block: &Block, layers: &[usize], out: &mut Vec<(u32, u32, DeepSample)>) -> Vec<f32> {
        let r = self.samples.offsets.len();
        let mut through = vec![1.0; block.len() * r * r];
        for &k in layers {
            let layer = &self.layers[k];
            for y in overlap(&block.y, &layer.rows) {
                let row = &mut through[(y - block.y.start) * block.x.len() * r * r..][..block.x.len() * r * r];
                self.walk_row(layer, &block.x, y, row, out);
            }
        }
        through
    }

    /// One row of one layer.
    fn walk_row(
        &self,
        layer: &Layer,
        columns: &Range<usize>,
        y: usize,
        through: &mut [f32],
        out: &mut Vec<(u32, u32, DeepSample)>,
    ) {
        let offsets = &self.samples.offsets;
        let r = offsets.len();
        let weight = 1.0 / (r * r) as f32;
        let rows: Vec<_> = offsets.iter().map(|o| Line::of(layer, columns.start, y as f64 + 0.5 + o)).collect();
        let low = rows.iter().map(|l| l.low).fold(f32::INFINITY, f32::min) - PIXEL_REACH;
        let high = rows.iter().map(|l| l.high).fold(f32::NEG_INFINITY, f32::max) + PIXEL_REACH;
        for (i, through) in through.chunks_exact_mut(r * r).enumerate() {
            let center = i as f32 + 0.5;
            if center < low || center > high {
                continue;
            }
            let mut light = Four::ZERO;
            let mut alpha = 0.0;
            for (sy, (line, through)) in rows.iter().zip(through.chunks_exact_mut(r)).enumerate() {
                for (sx, (offset, through)) in offsets.iter().zip(through).enumerate() {
                    let x = center + *offset as f32;
                    if x < line.low || x > line.high {
                        continue;
                    }
                    let texel = line.texel(layer, x);
                    let a = texel.alpha().clamp(0.0, 1.0);
                    alpha += a;
                    if *through > OPAQUE && a > 0.0 {
                        let place = self.samples.columns[(columns.start + i) * r + sx];
                        let e = layer.light.at(place, self.samples.rows[y * r + sy]);
                        light = light.add_scaled(*through, texel.times(e));
                    }
                    *through *= 1.0 - a;
                }
            }
            if alpha > 0.0 {
                let x = columns.start + i;
                out.push((x as u32, y as u32, self.sample(layer, x, y, light, (alpha * weight).min(1.0), weight)));
            }
        }
    }

    fn sample(&self, layer: &Layer, x: usize, y: usize, light: Four, alpha: f32, weight: f32) -> DeepSample {
        let w = layer.seen.w.dot(&Vector3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0));
        let depth = if w > 0.0 { (layer.seen.height / w) as f32 } else { f32::MAX };
        DeepSample {
            object: layer.id,
            depth: Depth(depth),
            light: light.rgb().scale(weight * self.exposure / PI),
            alpha,
            visible: (light.alpha() * weight).min(alpha),
        }
    }

    fn may_be_shadowed(&self, block: &Block) -> bool {
        let Some(map) = &self.ground.share else { return false };
        let r = self.samples.offsets.len();
        let places =
            |range: &Range<usize>, all: &[Place]| [all[range.start * r], all[range.end * r - 1]].map(|p| p.0 as usize);
        let [x, y] = [places(&block.x, &self.samples.columns), places(&block.y, &self.samples.rows)];
        map.meets(x[0]..x[1] + 2, y[0]..y[1] + 2)
    }

    /// What shadows leave of the surface's light: the average over what is seen of it.
    ///
    /// The definition divides average irradiances; the unshadowed one is the same all over a pixel (to about 1e-4 of
    /// it), so that averaging the share itself is the same.
    fn shade_ground(&self, whole: &Block, block: &Block, through: &[f32], shadow: &mut [LinearRgb]) {
        let (Some(map), Some(seen)) = (&self.ground.share, &self.ground.seen) else { return };
        let offsets = &self.samples.offsets;
        let r = offsets.len();
        let edges = sides(&seen.u, &seen.v, &seen.w, [0.0; 2]);
        let mut subs = through.chunks_exact(r);
        let mut sums = vec![Four::ZERO; block.x.len()];
        for y in block.y.clone() {
            sums.fill(Four::ZERO);
            let mut rows = subs.by_ref().take(block.x.len() * r);
            let spans: Vec<_> = offsets.iter().map(|o| span(&edges, y as f64 + 0.5 + o)).collect();
            for (i, sum) in sums.iter_mut().enumerate() {
                let x = block.x.start + i;
                for (sy, through) in rows.by_ref().take(r).enumerate() {
                    let row = self.samples.rows[y * r + sy];
                    for (sx, &t) in through.iter().enumerate() {
                        let at = x as f64 + 0.5 + offsets[sx];
                        let column = self.samples.columns[x * r + sx];
                        let on_ground = at >= spans[sy].0 && at <= spans[sy].1 && map.holds(column, row);
                        *sum = sum.add_scaled(t, if on_ground { map.at(column, row) } else { Four::ONE });
                    }
                }
            }
            let line = &mut shadow[(y - whole.y.start) * whole.x.len() + block.x.start - whole.x.start..];
            line.iter_mut().zip(&sums).for_each(|(s, sum)| *s = mean(sum));
        }
    }
}

/// The weighted mean of a share; 1 for no weight, and exactly 1 where the share is 1 all over.
fn mean(sum: &Four) -> LinearRgb {
    let weight = sum.alpha();
    if weight > 0.0 { sum.rgb().map(|v| (v / weight).min(1.0)) } else { LinearRgb::WHITE }
}

/// Half of the pixel's window, and a rounding more.
const PIXEL_REACH: f32 = 1.6;

/// A layer along one row of sub-samples; `x` counts pixels from the block's left edge.
struct Line {
    low: f32,
    high: f32,
    u: (f32, f32),
    v: (f32, f32),
    w: (f32, f32),
}

impl Line {
    fn of(layer: &Layer, left: usize, y: f64) -> Self {
        let seen = &layer.seen;
        let (low, high) = span(&sides(&seen.u, &seen.v, &seen.w, layer.texture.grid.reach), y);
        let [u, v] = layer.texture.grid.rows(&seen.u, &seen.v, &seen.w);
        let first = Vector3::new(left as f64, y, 1.0);
        let linear = |row: &Vector3<f64>| (row.dot(&first) as f32, row.x as f32);
        let relative = |x: f64| (x - left as f64) as f32;
        Self { low: relative(low), high: relative(high), u: linear(&u), v: linear(&v), w: linear(&seen.w) }
    }

    #[inline(always)]
    fn texel(&self, layer: &Layer, x: f32) -> Four {
        let scale = 1.0 / (self.w.0 + self.w.1 * x);
        layer.texture.at((self.u.0 + self.u.1 * x) * scale, (self.v.0 + self.v.1 * x) * scale)
    }
}

fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}
