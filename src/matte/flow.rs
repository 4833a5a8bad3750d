//! Flow: where lines of sight through an object end behind it, as measured on a luminous screen.

use crate::image::{Image, Mask};

/// Refraction of an object that lay on a display: for each place of its cut-out, how far from where
/// it would end without the object a line of sight through it ends.
///
/// Both rasters have one size and cover the whole cut-out; they may be coarser than it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flow {
    /// Displacement d on the display, metres, right and down in the cut-out's own orientation; 0
    /// where it is not known.
    pub displacement: Image<[f32; 2]>,
    /// Where it was measured.
    pub known: Mask,
    /// Width that the rasters stand for, metres: that of the cut-out as captured.
    pub width: f64,
    /// Height h0 of the object's middle over the display, metres. Over something at clearance c
    /// under the object the displacement is `d (h0 + c) / h0`.
    pub height: f64,
}

impl Flow {
    /// No pixel.
    pub fn is_empty(&self) -> bool {
        self.displacement.is_empty()
    }

    /// Displacement at texture coordinates (0 to 1, right and down): that of the known pixels
    /// around; none where most of what is around is not known, or outside.
    pub fn at(&self, [u, v]: [f64; 2]) -> Option<[f32; 2]> {
        let (w, h) = self.displacement.size();
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
    fn pixel(&self, x: isize, y: isize) -> Option<[f32; 2]> {
        self.known
            .nearest(x, y)
            .then(|| self.displacement.nearest(x, y))
    }
}

/// Weighted sum of what is known of four pixels.
#[derive(Default)]
struct KnownSum {
    displacement: [f32; 2],
    weight: f32,
}

impl KnownSum {
    fn add(&mut self, displacement: Option<[f32; 2]>, weight: f32) {
        if let Some(d) = displacement {
            self.displacement = [0, 1].map(|k: usize| self.displacement[k] + weight * d[k]);
            self.weight += weight;
        }
    }

    fn mean(self) -> Option<[f32; 2]> {
        (self.weight >= 0.5).then(|| self.displacement.map(|d| d / self.weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns, of which the left one is known.
    fn half_known() -> Flow {
        Flow {
            displacement: Image::from_vec(2, 1, vec![[0.01, -0.02], [0.0; 2]]),
            known: Image::from_vec(2, 1, vec![true, false]),
            width: 0.2,
            height: 0.03,
        }
    }

    #[test]
    fn what_is_not_known_does_not_weaken_what_is() {
        let flow = half_known();
        assert_eq!(flow.at([0.45, 0.5]), Some([0.01, -0.02]));
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
            displacement: Image::from_vec(2, 1, vec![[0.01, 0.0], [0.03, 0.0]]),
            known: Image::filled(2, 1, true),
            ..half_known()
        };
        let [x, _] = flow.at([0.5, 0.5]).unwrap();
        assert!((x - 0.02).abs() < 1e-7);
    }
}
