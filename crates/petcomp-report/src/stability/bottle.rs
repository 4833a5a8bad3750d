//! Synthetic photos of a bottle with a known outline: a waisted body of film with a rim, glints, a
//! striped label and a cap, in its own soft shadow.

use crate::flags::is_right;
use crate::matte::score::{box_error, overlap};
use crate::matte::truth::in_eight_bits;
use crate::matte::{normal, review_messages};
use petcomp::matte::{CutOut, CutOutOptions, cut_out};
use petcomp::{Image, LinearRgb, Mask, Result};

pub(super) const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);
pub(super) const BLUE: LinearRgb = LinearRgb::new(0.03, 0.06, 0.35);
const RED: LinearRgb = LinearRgb::new(0.5, 0.03, 0.04);
/// Rotation of a bottle in the picture, radians.
const BOTTLE_ROTATION_RAD: f64 = 0.1;
/// Subpixels that a pixel is averaged from, relative to its corner.
const SUBPIXELS: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];

/// Contents of a photo, and camera settings.
#[derive(Clone)]
pub(super) struct BottlePhoto {
    pub(super) size: (usize, usize),
    pub(super) screen: LinearRgb,
    pub(super) cap: LinearRgb,
    /// Standard deviation of the sensor's noise.
    pub(super) noise: f32,
    /// Share of its light that the screen loses from one corner to the other.
    pub(super) uneven: f32,
    /// Gain before the sensor saturates at 1.
    pub(super) exposure: f32,
    /// Centres of the bottles, as shares of the width and height.
    pub(super) at: Vec<[f64; 2]>,
    /// Length of a bottle as a share of the width.
    pub(super) length: f64,
}

impl Default for BottlePhoto {
    fn default() -> Self {
        Self {
            size: (600, 320),
            screen: GREEN,
            cap: RED,
            noise: 0.003,
            uneven: 0.1,
            exposure: 1.0,
            at: vec![[0.5, 0.5]],
            length: 0.8,
        }
    }
}

fn square(v: f64) -> f64 {
    v * v
}

/// Half the height of a bottle 2 long at a position along it.
fn half_height(x: f64) -> f64 {
    waist(x).min(bottom(x)).min(neck(x))
}

fn waist(x: f64) -> f64 {
    if x < 0.78 {
        0.36 - 0.1 * (1.0 - square(x / 0.5)).max(0.0)
    } else {
        0.12
    }
}

/// The round end; no bound elsewhere.
fn bottom(x: f64) -> f64 {
    if x < 0.0 {
        0.36 * (1.0 - square((-x - 0.8).max(0.0)) / 0.2).max(0.0).sqrt()
    } else {
        f64::INFINITY
    }
}

/// The taper; no bound elsewhere.
fn neck(x: f64) -> f64 {
    if (0.5..0.78).contains(&x) {
        0.36 - (x - 0.5) * 0.85
    } else {
        f64::INFINITY
    }
}

/// Light added and transmittance at a point of a bottle 2 long; none outside it.
fn bottle_at(x: f64, y: f64, cap: LinearRgb) -> Option<(LinearRgb, f32)> {
    let half = half_height(x);
    if !(-1.0..1.0).contains(&x) || y.abs() >= half {
        return None;
    }
    Some(if x > 0.86 {
        (cap, 0.0)
    } else if (-0.1..0.3).contains(&x) {
        (striped_label(x), 0.0)
    } else {
        film_at(x, y, half - y.abs() < 0.03 || x < -0.97)
    })
}

fn striped_label(x: f64) -> LinearRgb {
    if (x * 20.0).floor() as i64 % 2 == 0 {
        LinearRgb::grey(0.7)
    } else {
        LinearRgb::new(0.4, 0.1, 0.05)
    }
}

fn film_at(x: f64, y: f64, is_rim: bool) -> (LinearRgb, f32) {
    match (is_rim, is_glint(x, y)) {
        (_, true) => (LinearRgb::grey(0.8), 0.5),
        (true, false) => (LinearRgb::grey(0.05), 0.5),
        (false, false) => (LinearRgb::grey(0.02), 0.8),
    }
}

fn is_glint(x: f64, y: f64) -> bool {
    libm::sin(x * 37.0 + y * 61.0) * libm::cos(x * 11.0 - y * 29.0) > 0.8
}

/// Share of light that a bottle's soft shadow leaves on the screen.
fn soft_shadow((u, v): (f64, f64)) -> f32 {
    let [along, across] = [(u.abs() - 0.9).max(0.0), (v.abs() - 0.25).max(0.0)];
    1.0 - 0.2 * libm::exp(-(along * along + across * across) / 0.02) as f32
}

impl BottlePhoto {
    fn extent(&self) -> [f64; 2] {
        [self.size.0 as f64, self.size.1 as f64]
    }

    /// Position of a point of the picture in the frame of bottle `i`.
    fn on_bottle(&self, i: usize, x: f64, y: f64) -> (f64, f64) {
        let ([w, h], [u, v]) = (self.extent(), self.at[i]);
        let unit = self.length * w / 2.0;
        let (x, y) = ((x - u * w) / unit, (y - v * h) / unit);
        let (sin, cos) = libm::sincos(BOTTLE_ROTATION_RAD);
        (cos * x + sin * y, cos * y - sin * x)
    }

    /// The same for all bottles.
    fn on_bottles(&self, x: f64, y: f64) -> impl Iterator<Item = (f64, f64)> {
        (0..self.at.len()).map(move |i| self.on_bottle(i, x, y))
    }

    /// Light added and transmittance of the first bottle at a point; none outside all of them.
    fn bottle_seen(&self, x: f64, y: f64) -> Option<(LinearRgb, f32)> {
        self.on_bottles(x, y)
            .find_map(|(u, v)| bottle_at(u, v, self.cap))
    }

    /// Share of light that the uneven lamp leaves at a point.
    fn lamp_falloff(&self, x: f64, y: f64) -> f32 {
        let [w, h] = self.extent();
        1.0 - self.uneven * ((0.7 * x / w + 0.3 * y / h) as f32)
    }

    fn light_at(&self, x: f64, y: f64) -> LinearRgb {
        let behind = self.shaded_screen(x, y);
        self.bottle_seen(x, y)
            .map_or(behind, |(f, t)| f + behind.scale(t))
            .scale(self.lamp_falloff(x, y) * self.exposure)
    }

    fn shaded_screen(&self, x: f64, y: f64) -> LinearRgb {
        let shadows = self.on_bottles(x, y).map(soft_shadow);
        self.screen.scale(shadows.product())
    }

    fn pixel_at(&self, x: usize, y: usize) -> LinearRgb {
        let lights = SUBPIXELS.map(|[u, v]| self.light_at(x as f64 + u, y as f64 + v));
        let sum = lights.into_iter().fold(LinearRgb::BLACK, |a, b| a + b);
        sum.scale(0.25)
    }

    /// The photo in 8 bits.
    pub(super) fn photo(&self) -> Image<LinearRgb> {
        let (w, h) = self.size;
        let mut photo = Image::from_fn(w, h, |x, y| self.pixel_at(x, y));
        let mut noise = normal(3);
        for p in photo.pixels_mut() {
            *p = p.map(|v| in_eight_bits(v + self.noise * noise() as f32));
        }
        photo
    }

    /// Which pixels show a bottle.
    fn mask(&self) -> Mask {
        Image::from_fn(self.size.0, self.size.1, |x, y| {
            self.bottle_seen(x as f64 + 0.5, y as f64 + 0.5).is_some()
        })
    }

    /// The cut-out, and how accurate it is.
    pub(super) fn cut(&self) -> Result<(CutOut, OutlineAccuracy)> {
        let cut = cut_out(&self.photo(), &CutOutOptions::default())?;
        let accuracy = OutlineAccuracy::new(&cut, &self.mask());
        Ok((cut, accuracy))
    }
}

/// Accuracy of an outline.
pub(super) struct OutlineAccuracy {
    /// Intersection over union of the outline.
    pub(super) iou: f64,
    /// The largest error of a side of the box, pixels.
    pub(super) box_px: f64,
    /// Whether it is within the bounds of a good outline.
    pub(super) is_right: bool,
    /// Why the outline needs review, without reasons that only concern film on a screen of its own
    /// hue.
    pub(super) reasons: Vec<String>,
}

impl OutlineAccuracy {
    fn new(cut: &CutOut, mask: &Mask) -> Self {
        let found = &cut.segmentation;
        let iou = overlap(&found.tight, &mask.to_coverage());
        let box_px = box_error(&found.hull, sides_of(mask));
        Self {
            iou,
            box_px,
            is_right: is_right([iou, box_px], found.reduction),
            reasons: review_messages(&found.diagnostics),
        }
    }
}

/// Left, top, right and bottom of a mask.
fn sides_of(mask: &Mask) -> [f64; 4] {
    let (w, h) = mask.size();
    let [left, right] = ends_of((0..w).filter(|&x| (0..h).any(|y| mask[(x, y)])));
    let [top, bottom] = ends_of((0..h).filter(|&y| (0..w).any(|x| mask[(x, y)])));
    [left, top, right, bottom]
}

/// The first of some indices and the end of the last; 0 if there are none.
fn ends_of(indices: impl DoubleEndedIterator<Item = usize> + Clone) -> [f64; 2] {
    let first = indices.clone().next();
    let end = indices.last().map(|last| last + 1);
    [first, end].map(|end| end.unwrap_or(0) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bottle_has_the_given_length() {
        let [left, _, right, _] = sides_of(&BottlePhoto::default().mask());
        // Turned by 0.1, its ends 0.08 and 0.24 of its length high.
        let length = 0.8 * 600.0 * libm::cos(BOTTLE_ROTATION_RAD);
        assert!(
            (right - left - length).abs()
                < 0.1 * length * libm::sin(BOTTLE_ROTATION_RAD) * 2.0 + 2.0,
            "{left} to {right}"
        );
    }

    #[test]
    fn a_photo_without_noise_of_an_empty_even_screen_is_its_colour() {
        let take = BottlePhoto {
            at: vec![],
            noise: 0.0,
            uneven: 0.0,
            size: (8, 8),
            ..BottlePhoto::default()
        };
        let (photo, mask) = (take.photo(), take.mask());
        // Half a code of 8 bits at that brightness.
        assert!(photo.pixels().iter().all(|p| (p.g - GREEN.g).abs() < 0.003));
        assert!(mask.pixels().iter().all(|inside| !inside));
    }
}
