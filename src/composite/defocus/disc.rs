//! Circles of confusion as pixel weights.

use std::collections::BTreeMap;

/// Larger circles are treated as this one, pixels: beyond it, objects are no longer recognisable.
const MOST_RADIUS_PX: f64 = 64.0;
/// Radii up to this are distinguished in steps of 1/16 pixel, larger ones in steps of 1/64 of
/// themselves.
const FINE_RADIUS_PX: f64 = 4.0;
const FINE_STEPS: f64 = 16.0;
const COARSE_STEPS: f64 = 64.0;
/// Up to this radius the blur by the pixels themselves is compensated, pixels.
const EXACT_RADIUS_PX: f64 = 8.0;
/// Bisections that find a radius to a millionth of a pixel.
const HALVINGS: usize = 24;

/// A disc: offsets of pixels, and weights whose sum is 1.
#[derive(Debug)]
pub(super) struct Disc {
    taps: Vec<(isize, isize, f32)>,
    /// Distance from its centre to its last pixel, pixels.
    reach: isize,
}

impl Disc {
    /// # Method
    /// Weights fall from 1 to 0 over the pixel on the rim. The radius is chosen to give the
    /// variance of the circle, a quarter of its radius squared, along each axis.
    fn new(radius: f64) -> Self {
        let weights = soft_disc(matching_rim(radius));
        let sum: f64 = weights.iter().map(|(_, _, weight)| weight).sum();
        let taps = weights.into_iter();
        let taps: Vec<_> = taps.map(|(x, y, w)| (x, y, (w / sum) as f32)).collect();
        let reach = taps.iter().map(|tap| tap.0.abs()).max().unwrap_or(0);
        Self { taps, reach }
    }

    pub(super) fn taps(&self) -> &[(isize, isize, f32)] {
        &self.taps
    }
}

/// The pixels of a disc whose rim is a pixel wide, half of it inside the radius.
fn soft_disc(rim: f64) -> Vec<(isize, isize, f64)> {
    let reach = (rim + 0.5).floor() as isize;
    let side = -reach..=reach;
    side.clone()
        .flat_map(|y| side.clone().map(move |x| (x, y)))
        .map(|(x, y)| (x, y, rim + 0.5 - libm::hypot(x as f64, y as f64)))
        .filter(|(_, _, weight)| *weight > 0.0)
        .map(|(x, y, weight)| (x, y, weight.min(1.0)))
        .collect()
}

/// Variance along an axis of the disc with a rim.
fn variance(rim: f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (x, _, weight) in soft_disc(rim) {
        sum += weight * (x * x) as f64;
        total += weight;
    }
    sum / total
}

/// The rim of the disc with the variance of a circle.
fn matching_rim(radius: f64) -> f64 {
    if radius > EXACT_RADIUS_PX {
        return radius;
    }
    let wanted = 0.25 * radius * radius;
    let (mut low, mut high) = (0.5, radius + 0.5);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if variance(middle) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The discs of some radii.
#[derive(Debug)]
pub(super) struct Discs {
    by_step: BTreeMap<u32, Disc>,
    reach: usize,
}

impl Discs {
    pub(super) fn of_radii(radii: impl Iterator<Item = f64>) -> Self {
        let mut by_step = BTreeMap::new();
        for step in radii.map(step_of) {
            by_step
                .entry(step)
                .or_insert_with(|| Disc::new(radius_of(step)));
        }
        let reach = by_step
            .values()
            .map(|disc: &Disc| disc.reach.unsigned_abs());
        Self {
            reach: reach.max().unwrap_or(0),
            by_step,
        }
    }

    /// The disc of one of the radii given when they were created.
    pub(super) fn of_radius(&self, radius: f64) -> &Disc {
        &self.by_step[&step_of(radius)]
    }

    /// Distance from the centre of the largest disc to its last pixel, pixels.
    pub(super) fn reach(&self) -> usize {
        self.reach
    }
}

/// The step number of a radius.
fn step_of(radius: f64) -> u32 {
    let radius = radius.clamp(0.0, MOST_RADIUS_PX);
    let fine = radius.min(FINE_RADIUS_PX) * FINE_STEPS;
    let coarse = libm::log((radius / FINE_RADIUS_PX).max(1.0)) * COARSE_STEPS;
    (fine.round() + coarse.round()) as u32
}

fn radius_of(step: u32) -> f64 {
    let step = f64::from(step);
    let fine = step.min(FINE_RADIUS_PX * FINE_STEPS) / FINE_STEPS;
    let coarse = (step - FINE_RADIUS_PX * FINE_STEPS).max(0.0) / COARSE_STEPS;
    fine * libm::exp(coarse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_has_the_variance_of_its_circle() {
        for radius in [0.0, 0.1, 0.5, 0.8, 1.0, 1.7, 3.0, 5.5, 8.0, 20.0] {
            let disc = Disc::new(radius);
            let sum: f64 = disc.taps.iter().map(|t| f64::from(t.2)).sum();
            let spread = |of: fn(&(isize, isize, f32)) -> isize| -> f64 {
                let taps = disc.taps.iter();
                taps.map(|t| f64::from(t.2) * (of(t) * of(t)) as f64).sum()
            };
            assert!((sum - 1.0).abs() < 1e-5, "{radius}: {sum}");
            let wanted = 0.25 * radius * radius;
            for found in [spread(|t| t.0), spread(|t| t.1)] {
                let off = (found - wanted).abs();
                assert!(off < 1e-4 + 0.005 * wanted, "{radius}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn radii_are_told_apart_finely_and_have_an_end() {
        for i in 0..2000 {
            let radius = f64::from(i) * 0.05;
            let near = radius_of(step_of(radius));
            let held = radius.min(MOST_RADIUS_PX);
            assert!((near - held).abs() <= (0.5 / FINE_STEPS).max(0.009 * held) + 1e-9);
        }
        assert_eq!(step_of(f64::INFINITY), step_of(MOST_RADIUS_PX));
    }
}
