//! What a picture looks like to the network: four put together, enlarged, shifted, mirrored, in other colours.

use super::dice::Dice;
use super::jitter::Jitter;
use super::sample::{Labelled, Sample};
use crate::label::BBox;
use crate::{Image, Srgb8};
use serde::{Deserialize, Serialize};

/// Grey where there is no picture, as in YOLOv5.
const GREY: f32 = 114.0 / 255.0;
/// Objects of which less is left, in pixels a side or as part of their area, are dropped: YOLOv5's limits.
const LEAST_SIDE: f64 = 2.0;
const LEAST_PART: f64 = 0.1;

/// How much training pictures are changed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Augment {
    /// Probability that four pictures are put together. Default: 1.
    pub mosaic: f64,
    /// Reach of the factor on the size. Default: 0.5.
    pub scale: f64,
    /// Reach of the shift, in sides. Default: 0.1.
    pub translate: f64,
    /// Probability of the mirror image. Default: 0.5.
    pub flip: f64,
    /// Reaches of the factors on hue, saturation and value. Default: 0.015, 0.7, 0.4.
    pub hsv: [f64; 3],
}

impl Default for Augment {
    fn default() -> Self {
        Self { mosaic: 1.0, scale: 0.5, translate: 0.1, flip: 0.5, hsv: [0.015, 0.7, 0.4] }
    }
}

impl Augment {
    /// Pictures as they are.
    pub const NONE: Self = Self { mosaic: 0.0, scale: 0.0, translate: 0.0, flip: 0.0, hsv: [0.0; 3] };
}

/// An image as the network sees it.
pub(super) struct Example {
    /// Red, then green, then blue, each row by row, 0 to 1.
    pub(super) planes: Vec<f32>,
    pub(super) objects: Vec<Labelled>,
}

/// A picture in the middle of a grey square of `side`, unchanged.
pub(super) fn plain(sample: &Sample, side: usize) -> Example {
    example(sample, &[], side, &Augment::NONE, &mut Dice::new(0, 0))
}

/// Where the picture of [`plain`] begins.
pub(super) fn margin(sample: &Sample, side: usize) -> [f64; 2] {
    [sample.picture.width(), sample.picture.height()].map(|v| ((side - v.min(side)) / 2) as f64)
}

/// A training example from a picture, and three of the `others` where it becomes a mosaic.
pub(super) fn example(sample: &Sample, others: &[&Sample], side: usize, augment: &Augment, dice: &mut Dice) -> Example {
    let full = side as f64;
    let mosaic = dice.chance(augment.mosaic) && !others.is_empty();
    let (tiles, middle) = if mosaic {
        let corner = [0, 1].map(|_| dice.between(0.5 * full, 1.5 * full).round());
        let mut next = || others[dice.below(others.len())];
        let four = [sample, next(), next(), next()];
        (four.into_iter().enumerate().map(|(i, s)| Tile::at_corner(s, i, corner)).collect(), [full; 2])
    } else {
        (vec![Tile { sample, at: margin(sample, side) }], [0.5 * full; 2])
    };
    let view = View {
        middle,
        half: 0.5 * full,
        zoom: 1.0 + dice.between(-augment.scale, augment.scale),
        shift: [0, 1].map(|_| full * dice.between(-augment.translate, augment.translate)),
        mirror: dice.chance(augment.flip),
    };
    let jitter = (augment.hsv != [0.0; 3]).then(|| Jitter::draw(augment.hsv, dice));
    let color = |c: [f32; 3]| jitter.map_or(c, |jitter| jitter.apply(c));
    let planes = planes(&tiles, &view, side, color);
    let objects = tiles.iter().flat_map(|tile| tile.objects(&view, full)).collect();
    Example { planes, objects }
}

/// A picture on the canvas, by its top left corner.
struct Tile<'a> {
    sample: &'a Sample,
    at: [f64; 2],
}

/// What is seen of the canvas.
struct View {
    /// Point of the canvas in the middle of the view, before the shift.
    middle: [f64; 2],
    half: f64,
    zoom: f64,
    shift: [f64; 2],
    mirror: bool,
}

impl View {
    fn canvas_from_view(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let x = if self.mirror { 2.0 * self.half - x } else { x };
        let back = |i: usize, v: f64| (v - self.half - self.shift[i]) / self.zoom + self.middle[i];
        [back(0, x), back(1, y)]
    }

    fn view_from_canvas(&self, p: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|i| (p[i] - self.middle[i]) * self.zoom + self.shift[i] + self.half);
        [if self.mirror { 2.0 * self.half - x } else { x }, y]
    }
}

impl<'a> Tile<'a> {
    /// Place 0 to 3: left above the corner, right above, left below, right below.
    fn at_corner(sample: &'a Sample, place: usize, corner: [f64; 2]) -> Self {
        let size = [sample.picture.width() as f64, sample.picture.height() as f64];
        let before = [place.is_multiple_of(2), place < 2];
        Self { sample, at: [0, 1].map(|i| if before[i] { corner[i] - size[i] } else { corner[i] }) }
    }

    /// Colour at a point of the canvas; none outside the picture.
    fn color(&self, [x, y]: [f64; 2]) -> Option<[f32; 3]> {
        let picture = &self.sample.picture;
        let (x, y) = (x - self.at[0], y - self.at[1]);
        let inside = x >= 0.0 && y >= 0.0 && x < picture.width() as f64 && y < picture.height() as f64;
        inside.then(|| bilinear(picture, x - 0.5, y - 0.5))
    }

    fn objects<'b>(&'b self, view: &'b View, side: f64) -> impl Iterator<Item = Labelled> + 'b {
        self.sample.objects.iter().filter_map(move |object| {
            let b = object.bbox;
            let [p, q] =
                [[b.x0, b.y0], [b.x1, b.y1]].map(|[x, y]| view.view_from_canvas([x + self.at[0], y + self.at[1]]));
            let whole = BBox { x0: p[0].min(q[0]), y0: p[1], x1: p[0].max(q[0]), y1: q[1] };
            let [x0, y0, x1, y1] = [whole.x0, whole.y0, whole.x1, whole.y1].map(|v| v.clamp(0.0, side));
            let seen = BBox { x0, y0, x1, y1 };
            let enough = seen.width() > LEAST_SIDE
                && seen.height() > LEAST_SIDE
                && seen.width() * seen.height() > LEAST_PART * whole.width() * whole.height();
            enough.then_some(Labelled { class: object.class, bbox: seen })
        })
    }
}

fn planes(tiles: &[Tile<'_>], view: &View, side: usize, color: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<f32> {
    let area = side * side;
    let mut planes = vec![GREY; 3 * area];
    for i in 0..area {
        let point = view.canvas_from_view([(i % side) as f64 + 0.5, (i / side) as f64 + 0.5]);
        let Some(seen) = tiles.iter().find_map(|tile| tile.color(point)) else { continue };
        for (channel, value) in color(seen).into_iter().enumerate() {
            planes[channel * area + i] = value;
        }
    }
    planes
}

/// Between the four nearest pixels; `x` and `y` are 0 at the first pixel's centre.
fn bilinear(picture: &Image<Srgb8>, x: f64, y: f64) -> [f32; 3] {
    let (left, top) = (x.floor(), y.floor());
    let (across, down) = ((x - left) as f32, (y - top) as f32);
    let at = |dx: isize, dy: isize| {
        let c = picture.nearest(left as isize + dx, top as isize + dy);
        [c.r, c.g, c.b].map(|v| f32::from(v) / 255.0)
    };
    let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
    std::array::from_fn(|i| {
        let above = a[i] + (b[i] - a[i]) * across;
        let below = c[i] + (d[i] - c[i]) * across;
        above + (below - above) * down
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A red square on blue, with its box.
    fn sample(width: usize, height: usize, x: usize, y: usize, size: usize) -> Sample {
        let red = |px: usize, py: usize| (x..x + size).contains(&px) && (y..y + size).contains(&py);
        let picture = Image::from_fn(width, height, |px, py| {
            if red(px, py) { Srgb8 { r: 255, g: 0, b: 0 } } else { Srgb8 { r: 0, g: 0, b: 255 } }
        });
        let [x, y, size] = [x, y, size].map(|v| v as f64);
        let objects = vec![Labelled { class: 0, bbox: BBox { x0: x, y0: y, x1: x + size, y1: y + size } }];
        Sample { name: "a".into(), picture, objects, size: [width as u32, height as u32] }
    }

    /// Share of red within a box.
    fn redness(example: &Example, side: usize, b: &BBox) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0);
        for y in b.y0.ceil() as usize..b.y1.floor() as usize {
            for x in b.x0.ceil() as usize..b.x1.floor() as usize {
                let at = y * side + x;
                sum += f32::from(example.planes[at] > 2.0 * example.planes[2 * side * side + at]);
                count += 1.0;
            }
        }
        sum / count
    }

    #[test]
    fn a_plain_picture_is_itself_between_grey() {
        let sample = sample(64, 32, 10, 4, 12);
        let example = plain(&sample, 64);
        assert_eq!(example.objects[0].bbox, BBox { x0: 10.0, y0: 20.0, x1: 22.0, y1: 32.0 });
        assert_eq!((example.planes[0], example.planes[16 * 64]), (GREY, 0.0));
        assert_eq!(redness(&example, 64, &example.objects[0].bbox), 1.0);
    }

    #[test]
    fn boxes_stay_on_their_objects_whatever_is_done() {
        let (a, b) = (sample(64, 48, 10, 4, 24), sample(40, 64, 8, 30, 30));
        let mut seen = 0;
        for seed in 0..40 {
            let augment = Augment { hsv: [0.0, 0.2, 0.2], ..Augment::default() };
            let example = example(&a, &[&a, &b], 64, &augment, &mut Dice::new(seed, 0));
            for object in &example.objects {
                assert!(redness(&example, 64, &object.bbox) > 0.9, "{seed} {object:?}");
                seen += 1;
            }
            let red = redness(&example, 64, &BBox { x0: 0.0, y0: 0.0, x1: 64.0, y1: 64.0 });
            assert!(red < 0.05 || !example.objects.is_empty(), "{seed}: {red} red and no box");
        }
        assert!(seen > 40, "{seen}");
    }
}
