//! Framing: the object's share of the picture, and its position.

use super::super::Trial;
use super::sensor::noisy;
use crate::matte::truth::Known;
use petcomp::filter;
use petcomp::{Coverage, Image, LinearRgb, Roi};
use std::ops::Range;

/// A photo whose left border cuts off a share of the object's width.
pub(super) fn cut_off(whole: Trial, share: f64) -> Trial {
    let [left, _, right, _] = whole.box_px;
    let from = (left + share * (right - left)) as usize;
    let (w, h) = whole.photo.size();
    let mut cut = cropped(whole, Roi::spanning(from..w, 0..h));
    // What is beyond the border is not in the box.
    cut.box_px[0] = 0.0;
    cut
}

fn cropped(whole: Trial, roi: Roi) -> Trial {
    Trial {
        photo: whole.photo.crop(roi),
        mask: whole.mask.crop(roi),
        box_px: cropped_box(whole.box_px, roi),
        ..whole
    }
}

fn cropped_box([left, top, right, bottom]: [f64; 4], roi: Roi) -> [f64; 4] {
    let (x, y) = (roi.x as f64, roi.y as f64);
    [left - x, top - y, right - x, bottom - y]
}

/// The photo and its mirror image side by side.
pub(super) fn two(one: &Trial) -> Trial {
    Trial {
        photo: beside_its_mirror(&one.photo),
        mask: beside_its_mirror(&one.mask),
        ..one.clone()
    }
}

fn beside_its_mirror<P: Copy + Send + Sync>(image: &Image<P>) -> Image<P> {
    let w = image.width();
    Image::from_fn(2 * w, image.height(), |x, y| {
        image[(if x < w { x } else { 2 * w - 1 - x }, y)]
    })
}

/// The longer side of a tiny photo, pixels.
const TINY_PX: usize = 64;

/// The photo downsized to this.
pub(super) fn tiny(whole: &Trial) -> Trial {
    let (w, h) = whole.photo.size();
    resized(whole, TINY_PX as f64 / w.max(h) as f64)
}

/// Pixels of a huge photo.
const HUGE_PX: f64 = 12e6;

/// The photo enlarged to this: a small photo with a good lens is never as sharp per pixel.
pub(super) fn huge(whole: &Trial) -> Trial {
    let (w, h) = whole.photo.size();
    resized(whole, (HUGE_PX / (w * h) as f64).sqrt())
}

fn resized(whole: &Trial, scale: f64) -> Trial {
    let (w, h) = whole.photo.size();
    let [to_w, to_h] = [w, h].map(|side| (side as f64 * scale).round() as usize);
    let scales = [to_w as f64 / w as f64, to_h as f64 / h as f64];
    Trial {
        photo: filter::resize(&whole.photo, to_w, to_h),
        mask: filter::resize::<Coverage>(&whole.mask, to_w, to_h),
        box_px: scaled_box(whole.box_px, scales),
        expected: whole.expected,
    }
}

fn scaled_box([left, top, right, bottom]: [f64; 4], [sx, sy]: [f64; 2]) -> [f64; 4] {
    [left * sx, top * sy, right * sx, bottom * sy]
}

/// The photo transposed: rows become columns.
pub(super) fn upright(flat: &Trial) -> Trial {
    let [left, top, right, bottom] = flat.box_px;
    Trial {
        photo: transposed(&flat.photo),
        mask: transposed(&flat.mask),
        box_px: [top, left, bottom, right],
        expected: flat.expected,
    }
}

fn transposed<P: Copy + Send + Sync>(image: &Image<P>) -> Image<P> {
    Image::from_fn(image.height(), image.width(), |x, y| image[(y, x)])
}

/// Share of a full-frame picture that the object's box takes.
const FULL_FRAME_SHARE: f64 = 0.8;

/// The photo cropped to the object's box and equal margins around it, as far as the photo reaches.
pub(super) fn full_frame(whole: Trial) -> Trial {
    let [left, top, right, bottom] = whole.box_px;
    let (w, h) = whole.photo.size();
    let margin = full_frame_margin(right - left, bottom - top);
    let columns = with_margin(left, right, margin, w);
    let rows = with_margin(top, bottom, margin, h);
    cropped(whole, Roi::spanning(columns, rows))
}

/// Margins of one width m: `(width + 2 m)(height + 2 m) = width height / FULL_FRAME_SHARE`.
fn full_frame_margin(width: f64, height: f64) -> f64 {
    let sum = width + height;
    let added = 1.0 / FULL_FRAME_SHARE - 1.0;
    0.25 * ((sum * sum + 4.0 * width * height * added).sqrt() - sum)
}

fn with_margin(low: f64, high: f64, margin: f64, len: usize) -> Range<usize> {
    (low - margin).max(0.0) as usize..((high + margin).ceil() as usize).min(len)
}

/// Share of the picture that a small object covers.
const SMALL_OBJECT_SHARE: f64 = 0.02;

/// The object scaled down to that share, on the same screen.
pub(super) fn small_object(known: &Known, whole: Trial) -> Trial {
    let (w, h) = known.photo.size();
    let wanted = SMALL_OBJECT_SHARE * (w * h) as f64;
    let scale = (wanted / total_coverage(&known.mask)).sqrt();
    shrunk(known, whole, [scale, scale])
}

fn total_coverage(mask: &Image<Coverage>) -> f64 {
    mask.pixels().iter().map(|c| f64::from(c.0)).sum()
}

/// Width of a thin object as a share of the original.
const THIN_SCALE: f64 = 0.125;

/// The object squeezed across its length.
pub(super) fn thin_object(known: &Known, whole: Trial) -> Trial {
    let [left, top, right, bottom] = known.box_px;
    let scale = if right - left > bottom - top {
        [1.0, THIN_SCALE]
    } else {
        [THIN_SCALE, 1.0]
    };
    shrunk(known, whole, scale)
}

/// The object downsized by factors across and down, in the middle of its screen: `F + T K`, with
/// the sensor's noise.
fn shrunk(known: &Known, whole: Trial, scale: [f64; 2]) -> Trial {
    let inset = Inset::new(known.photo.size(), scale);
    Trial {
        photo: noisy(&inset.photo(known), known.noise.read as f32, 1),
        mask: inset.mask(known),
        box_px: inset.map_box(known.box_px),
        ..whole
    }
}

/// Position of a downsized picture in the middle of its old frame.
struct Inset {
    from: [usize; 2],
    to: [usize; 2],
    corner: [usize; 2],
}

impl Inset {
    fn new((w, h): (usize, usize), [sx, sy]: [f64; 2]) -> Self {
        let to = [scaled_side(w, sx), scaled_side(h, sy)];
        Self {
            from: [w, h],
            to,
            corner: [(w - to[0]) / 2, (h - to[1]) / 2],
        }
    }

    fn photo(&self, known: &Known) -> Image<LinearRgb> {
        let [light, through] = [&known.foreground, &known.transmittance]
            .map(|picture| filter::resize(picture, self.to[0], self.to[1]));
        self.image(|x, y, inside| {
            let screen = known.screen[(x, y)];
            inside.map_or(screen, |at| light[at] + through[at] * screen)
        })
    }

    fn mask(&self, known: &Known) -> Image<Coverage> {
        let small = filter::resize(&known.mask, self.to[0], self.to[1]);
        self.image(|_, _, inside| inside.map_or(Coverage(0.0), |at| small[at]))
    }

    /// A picture of the old frame from its pixels and, where there is one, that of the smaller
    /// picture.
    fn image<P: Copy + Send + Sync>(
        &self,
        pixel: impl Fn(usize, usize, Option<(usize, usize)>) -> P + Sync,
    ) -> Image<P> {
        let [w, h] = self.from;
        Image::from_fn(w, h, |x, y| pixel(x, y, self.at(x, y)))
    }

    /// The pixel of the smaller picture at a pixel of the frame; none outside it.
    fn at(&self, x: usize, y: usize) -> Option<(usize, usize)> {
        let [dx, dy] = [
            x.checked_sub(self.corner[0])?,
            y.checked_sub(self.corner[1])?,
        ];
        (dx < self.to[0] && dy < self.to[1]).then_some((dx, dy))
    }

    fn map_box(&self, [left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
        [
            self.map_coordinate(0, left),
            self.map_coordinate(1, top),
            self.map_coordinate(0, right),
            self.map_coordinate(1, bottom),
        ]
    }

    fn map_coordinate(&self, axis: usize, v: f64) -> f64 {
        self.corner[axis] as f64 + v * self.to[axis] as f64 / self.from[axis] as f64
    }
}

fn scaled_side(len: usize, scale: f64) -> usize {
    ((len as f64 * scale).round() as usize).clamp(1, len)
}
