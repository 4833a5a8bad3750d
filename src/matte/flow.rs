//! Flow: where light that is seen through an object comes from, as measured on a luminous screen.

use crate::filter::{Pyramid, sample_blurred, sample_cubic_clamped};
use crate::geom::Point2;
use crate::image::{Image, Mask};
use crate::pixel::{LinearRgb, Mix};

/// Refraction of an object that lay on a display: for each place of its cut-out, how far the object
/// moves the end of the line of sight through it, and what is scattered.
///
/// Both rasters have one size and cover the whole cut-out; they may be coarser than it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flow {
    /// Where the light comes from; nothing bent where that is not known.
    pub paths: Image<LightPath>,
    /// Where it was measured.
    pub known: Mask,
    /// Width that the rasters stand for, metres: that of the cut-out as captured.
    pub width: f64,
    /// Height h0 of the object's middle over the display, metres. Over something at clearance c
    /// under the object the displacement is `d (h0 + c) / h0`.
    pub height: f64,
}

/// Where the light that an object lets pass at a place comes from: a part from one place, which
/// stays sharp, and the rest from all around another one.
///
/// Displacements are how far from where the line of sight would end without the object, on the
/// display, right and down in the cut-out's own orientation; metres in a [`Flow`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightPath {
    /// Displacement of what stays sharp.
    pub displacement: [f32; 2],
    /// Share of the light that is scattered, 0 to 1.
    pub haze: f32,
    /// Displacement of the middle of what is scattered.
    pub scatter_displacement: [f32; 2],
    /// Standard deviation of the places around that middle along each axis.
    pub scatter_width: f32,
}

impl LightPath {
    /// With all lengths multiplied by a factor.
    pub fn scaled(self, factor: f32) -> Self {
        Self {
            displacement: self.displacement.map(|d| factor * d),
            scatter_displacement: self.scatter_displacement.map(|d| factor * d),
            scatter_width: factor * self.scatter_width,
            ..self
        }
    }

    /// What is seen of a picture at a place, by lengths in its pixels.
    #[doc(hidden)]
    pub fn seen(&self, picture: &Pyramid<LinearRgb>, at: Point2<f64>) -> LinearRgb {
        let end = |[dx, dy]: [f32; 2]| [at.x + f64::from(dx), at.y + f64::from(dy)];
        let [x, y] = end(self.displacement);
        let sharp = sample_cubic_clamped(picture.base(), x, y).map(|v| v.max(0.0));
        if self.haze <= 0.0 {
            return sharp;
        }
        let [x, y] = end(self.scatter_displacement);
        let scattered = sample_blurred(picture, x, y, self.scatter_width.into());
        self.mixed(sharp, scattered)
    }

    /// Light of what stays sharp and of what is scattered, by their shares.
    pub(crate) fn mixed(&self, sharp: LinearRgb, scattered: LinearRgb) -> LinearRgb {
        sharp.mixed(scattered, self.haze)
    }

    /// The farthest that light comes from, the tails of what is scattered aside.
    pub(crate) fn reach(&self) -> f32 {
        let [sharp, scattered] = [self.displacement, self.scatter_displacement].map(length);
        if self.haze > 0.0 {
            sharp.max(scattered + SCATTER_REACH * self.scatter_width)
        } else {
            sharp
        }
    }
}

/// Standard deviations of what is scattered that are looked at.
const SCATTER_REACH: f32 = 2.0;

fn length([x, y]: [f32; 2]) -> f32 {
    libm::hypotf(x, y)
}

impl Mix for LightPath {
    #[inline]
    fn add_scaled(self, weight: f32, other: Self) -> Self {
        let sum = |a: [f32; 2], b: [f32; 2]| [a[0] + weight * b[0], a[1] + weight * b[1]];
        Self {
            displacement: sum(self.displacement, other.displacement),
            haze: self.haze + weight * other.haze,
            scatter_displacement: sum(self.scatter_displacement, other.scatter_displacement),
            scatter_width: self.scatter_width + weight * other.scatter_width,
        }
    }
}

impl Flow {
    /// Whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    /// At texture coordinates (0 to 1, right and down): that of the known pixels around; none where
    /// most of what is around is not known, or outside.
    pub fn at(&self, [u, v]: [f64; 2]) -> Option<LightPath> {
        let (w, h) = self.paths.size();
        let inside = [u, v].iter().all(|c| (0.0..=1.0).contains(c));
        if !inside || self.is_empty() {
            return None;
        }
        let [x, y] = [u * w as f64 - 0.5, v * h as f64 - 0.5];
        let mut sum = KnownSum::default();
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (i, j) = (x.floor() + dx, y.floor() + dy);
            let weight = (1.0 - (x - i).abs()) * (1.0 - (y - j).abs());
            sum.add(self.pixel(i as isize, j as isize), weight as f32);
        }
        sum.mean()
    }

    /// The nearest pixel; none where it is not known.
    fn pixel(&self, x: isize, y: isize) -> Option<LightPath> {
        self.known.nearest(x, y).then(|| self.paths.nearest(x, y))
    }
}

/// Weighted sum of what is known of four pixels.
#[derive(Default)]
struct KnownSum {
    path: LightPath,
    weight: f32,
}

impl KnownSum {
    fn add(&mut self, path: Option<LightPath>, weight: f32) {
        if let Some(path) = path {
            self.path = self.path.add_scaled(weight, path);
            self.weight += weight;
        }
    }

    fn mean(self) -> Option<LightPath> {
        let share = self.weight.recip();
        (self.weight >= 0.5).then(|| LightPath::default().add_scaled(share, self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent(displacement: [f32; 2]) -> LightPath {
        LightPath {
            displacement,
            ..LightPath::default()
        }
    }

    /// Two columns, of which the left one is known.
    fn half_known() -> Flow {
        Flow {
            paths: Image::from_vec(2, 1, vec![bent([0.01, -0.02]), bent([0.0; 2])]),
            known: Image::from_vec(2, 1, vec![true, false]),
            width: 0.2,
            height: 0.03,
        }
    }

    #[test]
    fn what_is_not_known_does_not_weaken_what_is() {
        let flow = half_known();
        assert_eq!(flow.at([0.45, 0.5]), Some(bent([0.01, -0.02])));
        assert_eq!(flow.at([0.55, 0.5]), None);
    }

    #[test]
    fn there_is_nothing_outside_and_nothing_in_no_flow() {
        assert_eq!(half_known().at([-0.1, 0.5]), None);
        assert_eq!(Flow::default().at([0.5, 0.5]), None);
        assert!(Flow::default().is_empty() && !half_known().is_empty());
    }

    #[test]
    fn it_is_linear_between_known_pixels() {
        let flow = Flow {
            paths: Image::from_vec(2, 1, vec![bent([0.01, 0.0]), bent([0.03, 0.0])]),
            known: Image::filled(2, 1, true),
            ..half_known()
        };
        let [x, _] = flow.at([0.5, 0.5]).unwrap().displacement;
        assert!((x - 0.02).abs() < 1e-7);
    }

    #[test]
    fn only_what_is_scattered_reaches_beyond_the_displacement() {
        let path = LightPath {
            scatter_width: 0.1,
            ..bent([0.03, 0.04])
        };
        assert!((path.reach() - 0.05).abs() < 1e-6);
        let hazy = LightPath { haze: 0.2, ..path };
        assert!((hazy.scaled(2.0).reach() - 0.4).abs() < 1e-6);
    }
}
