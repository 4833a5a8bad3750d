//! Photos of a bottle made in code, with the outline known: a waisted body of film with a rim, glints, a striped label and
//! a cap, in its own soft shadow.

use crate::matte::{GOOD_BOX_PX, GOOD_IOU, normal};
use petcomp::LinearRgb;
use petcomp::Result;
use petcomp::color::{linear_to_srgb, srgb_to_linear};
use petcomp::matte::{CutOut, CutOutOptions, cut_out};
use petcomp::{Image, Mask};

pub(super) const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);
pub(super) const BLUE: LinearRgb = LinearRgb::new(0.03, 0.06, 0.35);
const RED: LinearRgb = LinearRgb::new(0.5, 0.03, 0.04);
/// Turn of a bottle in the picture, radians.
const TURN: f64 = 0.1;

/// What a photo is taken of, and how.
#[derive(Clone)]
pub(super) struct BottlePhoto {
    pub(super) size: (usize, usize),
    pub(super) screen: LinearRgb,
    pub(super) cap: LinearRgb,
    /// Standard deviation of the sensor's noise.
    pub(super) noise: f32,
    /// The screen loses this share of its light from one corner to the other.
    pub(super) uneven: f32,
    /// Everything is so much brighter before the sensor saturates at 1.
    pub(super) exposure: f32,
    /// Middles of the bottles, as shares of the width and height.
    pub(super) at: Vec<[f64; 2]>,
    /// Length of a bottle as a share of the width.
    pub(super) length: f64,
}

impl Default for BottlePhoto {
    fn default() -> Self {
        let at = vec![[0.5, 0.5]];
        Self {
            size: (600, 320),
            screen: GREEN,
            cap: RED,
            noise: 0.003,
            uneven: 0.1,
            exposure: 1.0,
            at,
            length: 0.8,
        }
    }
}

/// Half the height of a bottle 2 long at a place along it.
fn half_height(x: f64) -> f64 {
    let square = |v: f64| v * v;
    let half = if x < 0.78 {
        0.36 - 0.1 * (1.0 - square(x / 0.5)).max(0.0)
    } else {
        0.12
    };
    let bottom = if x < 0.0 {
        0.36 * (1.0 - square((-x - 0.8).max(0.0)) / 0.2).max(0.0).sqrt()
    } else {
        half
    };
    let neck = if (0.5..0.78).contains(&x) {
        0.36 - (x - 0.5) * 0.85
    } else {
        half
    };
    half.min(bottom).min(neck)
}

/// Light added and transmittance at a point of a bottle 2 long; nothing beside it.
fn bottle(x: f64, y: f64, cap: LinearRgb) -> Option<(LinearRgb, f32)> {
    let half = half_height(x);
    if !(-1.0..1.0).contains(&x) || y.abs() >= half {
        return None;
    }
    if x > 0.86 {
        return Some((cap, 0.0));
    }
    if (-0.1..0.3).contains(&x) {
        let stripe = (x * 20.0).floor() as i64 % 2 == 0;
        return Some((
            if stripe {
                LinearRgb::grey(0.7)
            } else {
                LinearRgb::new(0.4, 0.1, 0.05)
            },
            0.0,
        ));
    }
    let rim = half - y.abs() < 0.03 || x < -0.97;
    let glint = libm::sin(x * 37.0 + y * 61.0) * libm::cos(x * 11.0 - y * 29.0) > 0.8;
    Some(match (rim, glint) {
        (_, true) => (LinearRgb::grey(0.8), 0.5),
        (true, false) => (LinearRgb::grey(0.05), 0.5),
        (false, false) => (LinearRgb::grey(0.02), 0.8),
    })
}

impl BottlePhoto {
    /// Where a pixel's point lies on bottle `i`.
    fn on(&self, i: usize, x: f64, y: f64) -> (f64, f64) {
        let (w, h) = (self.size.0 as f64, self.size.1 as f64);
        let unit = self.length * w / 2.0;
        let (x, y) = (
            (x - self.at[i][0] * w) / unit,
            (y - self.at[i][1] * h) / unit,
        );
        let (sin, cos) = libm::sincos(TURN);
        (cos * x + sin * y, cos * y - sin * x)
    }

    fn seen(&self, x: f64, y: f64) -> LinearRgb {
        let (w, h) = (self.size.0 as f64, self.size.1 as f64);
        let light = 1.0 - self.uneven * ((0.7 * x / w + 0.3 * y / h) as f32);
        let shadow = |(u, v): (f64, f64)| {
            let [along, across] = [(u.abs() - 0.9).max(0.0), (v.abs() - 0.25).max(0.0)];
            1.0 - 0.2 * libm::exp(-(along * along + across * across) / 0.02) as f32
        };
        let places = || (0..self.at.len()).map(|i| self.on(i, x, y));
        let behind = self.screen.scale(places().map(shadow).product());
        let there = places().find_map(|(u, v)| bottle(u, v, self.cap));
        there
            .map_or(behind, |(f, t)| f + behind.scale(t))
            .scale(light * self.exposure)
    }

    /// The photo in 8 bits, and which pixels show a bottle.
    pub(super) fn taken(&self) -> (Image<LinearRgb>, Mask) {
        const OFFSETS: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
        let (w, h) = self.size;
        let mut photo = Image::from_fn(w, h, |x, y| {
            let sum = OFFSETS
                .iter()
                .map(|[u, v]| self.seen(x as f64 + u, y as f64 + v));
            sum.fold(LinearRgb::BLACK, |a, b| a + b).scale(0.25)
        });
        let mut noise = normal(3);
        for p in photo.pixels_mut() {
            *p = p.map(|v| {
                let code =
                    255.0 * linear_to_srgb((v + self.noise * noise() as f32).clamp(0.0, 1.0));
                srgb_to_linear(code.round() / 255.0)
            });
        }
        let mask = Image::from_fn(w, h, |x, y| {
            let mut places = (0..self.at.len()).map(|i| self.on(i, x as f64 + 0.5, y as f64 + 0.5));
            places.any(|(u, v)| bottle(u, v, self.cap).is_some())
        });
        (photo, mask)
    }

    /// What is cut out, and how right that is.
    pub(super) fn cut(&self) -> Result<(CutOut, OutlineAccuracy)> {
        let (photo, mask) = self.taken();
        let cut = cut_out(&photo, &CutOutOptions::default())?;
        let likeness = OutlineAccuracy::of(&cut, &mask);
        Ok((cut, likeness))
    }
}

/// How like the truth an outline is.
pub(super) struct OutlineAccuracy {
    /// Intersection over union of the outline.
    pub(super) iou: f64,
    /// The side of the box that is off most, pixels.
    pub(super) box_px: f64,
    /// It is within the bounds that are promised.
    pub(super) is_right: bool,
    /// What is said against the outline; what film cannot know on a screen of its own hue is another matter.
    pub(super) doubts: Vec<String>,
}

impl OutlineAccuracy {
    fn of(cut: &CutOut, mask: &Mask) -> Self {
        let found = cut.segmentation.tight.map(|c| c.0 >= 0.5);
        let count = |holds: fn(bool, bool) -> bool| {
            found
                .pixels()
                .iter()
                .zip(mask.pixels())
                .filter(|(a, b)| holds(**a, **b))
                .count() as f64
        };
        let hull = &cut.segmentation.hull;
        let least = |of: fn(&petcomp::geom::Point2<f64>) -> f64| {
            hull.iter().map(of).fold(f64::MAX, f64::min)
        };
        let sides = [
            least(|p| p.x),
            least(|p| p.y),
            -least(|p| -p.x),
            -least(|p| -p.y),
        ];
        let box_px = sides
            .iter()
            .zip(sides_of(mask))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        let iou = count(|a, b| a && b) / count(|a, b| a || b);
        // Pixels of a reduced search are that much larger.
        let is_right =
            iou >= GOOD_IOU && box_px <= GOOD_BOX_PX * cut.segmentation.reduction.max(1.0);
        let doubts = cut
            .segmentation
            .diagnostics
            .iter()
            .filter(|d| d.needs_review())
            .map(ToString::to_string)
            .collect();
        Self {
            iou,
            box_px,
            is_right,
            doubts,
        }
    }
}

/// Left, top, right and bottom of what is true.
fn sides_of(mask: &Mask) -> [f64; 4] {
    let (w, h) = mask.size();
    let columns = || (0..w).filter(|&x| (0..h).any(|y| mask[(x, y)]));
    let rows = || (0..h).filter(|&y| (0..w).any(|x| mask[(x, y)]));
    let ends = [
        columns().next(),
        rows().next(),
        columns().next_back().map(|x| x + 1),
        rows().next_back().map(|y| y + 1),
    ];
    ends.map(|end| end.unwrap_or(0) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bottle_is_as_long_as_it_is_said_to_be() {
        let [left, _, right, _] = sides_of(&BottlePhoto::default().taken().1);
        // Turned by 0.1, its ends 0.08 and 0.24 of its length high.
        let length = 0.8 * 600.0 * libm::cos(TURN);
        assert!(
            (right - left - length).abs() < 0.1 * length * libm::sin(TURN) * 2.0 + 2.0,
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
        let (photo, mask) = take.taken();
        // Half a code of 8 bits at that brightness.
        assert!(photo.pixels().iter().all(|p| (p.g - GREEN.g).abs() < 0.003));
        assert!(mask.pixels().iter().all(|inside| !inside));
    }
}
