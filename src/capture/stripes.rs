//! Where on the display every pixel looks, by stripes that are shifted four times.
//!
//! # Method
//! Phase `atan2(I_4 - I_2, I_1 - I_3)` and amplitude of a sinusoid at quarter shifts (Wyant 1975);
//! the coarse stripes give the period of the fine ones. Even harmonics, which a display's curve
//! makes, cancel.

use super::display::Display;
use super::frame::SHIFTS;
use super::stack::StripeLight;
use super::view::View;
use crate::image::{Image, Mask};
use std::f64::consts::TAU;

/// What is seen of the stripes.
pub(super) struct SeenStripes {
    /// Place on the display where the line of sight ends, pixels of the display.
    pub(super) at_px: Image<[f64; 2]>,
    /// Coarse and fine stripes agree about it, and it is on the display.
    pub(super) consistent: Mask,
    /// By period (coarse first) and axis.
    pub(super) waves: [[Image<Wave>; 2]; 2],
}

/// Coarse and fine may differ by this share of a fine period.
const MAX_DISAGREEMENT: f64 = 0.35;

/// A sinusoid at a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wave {
    /// Periods, 0 to 1.
    pub(super) phase: f64,
    pub(super) amplitude: f32,
}

impl Wave {
    #[inline]
    fn of([a, b, c, d]: [f32; SHIFTS]) -> Self {
        let (sine, cosine) = (d - b, a - c);
        let phase = libm::atan2(sine.into(), cosine.into()) / TAU;
        Self {
            phase: phase.rem_euclid(1.0),
            amplitude: 0.5 * libm::hypotf(sine, cosine),
        }
    }

    /// The place of this phase that is nearest to another one.
    #[inline]
    fn place_near(self, near: f64, period: f64) -> f64 {
        period * (self.phase + (near / period - self.phase).round())
    }
}

impl SeenStripes {
    /// Everywhere in a view.
    pub(super) fn read(light: &StripeLight, display: &Display, view: &View) -> Self {
        let waves = light.each_ref().map(|axes| axes.each_ref().map(waves));
        let [x, y] = [0, 1].map(|axis| {
            let [coarse, fine] = [&waves[0][axis], &waves[1][axis]];
            places(axis, coarse, fine, display, view)
        });
        let [w, h] = display.size_px.map(f64::from);
        let at_px = x.zip_map(&y, |(x, _), (y, _)| [x, y]);
        let on_display = at_px.map(|[x, y]| (0.0..w).contains(&x) && (0.0..h).contains(&y));
        Self {
            consistent: x.zip3_map(&y, &on_display, |(_, x), (_, y), on| x && y && on),
            at_px,
            waves,
        }
    }
}

/// Where lines of sight end along one axis, and whether coarse and fine stripes agree about it.
fn places(
    axis: usize,
    coarse: &Image<Wave>,
    fine: &Image<Wave>,
    display: &Display,
    view: &View,
) -> Image<(f64, bool)> {
    let [long, short] = [false, true].map(|is_fine| display.period_px(is_fine));
    let (w, h) = fine.size();
    Image::from_fn(w, h, |x, y| {
        let rough = coarse[(x, y)].place_near(view.display_at(x, y)[axis], long);
        let place = fine[(x, y)].place_near(rough, short);
        (place, (place - rough).abs() <= MAX_DISAGREEMENT * short)
    })
}

fn waves([a, b, c, d]: &[Image<f32>; SHIFTS]) -> Image<Wave> {
    let (w, h) = a.size();
    Image::from_fn(w, h, |x, y| {
        let at = (x, y);
        Wave::of([a[at], b[at], c[at], d[at]])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_and_its_amplitude_are_found_whatever_is_added() {
        for phase in [0.0, 0.2, 0.49, 0.77, 0.999] {
            let light = [0.0, 0.25, 0.5, 0.75].map(|shift| {
                let angle = TAU * (phase + shift);
                // A second harmonic, as a wrong curve makes it.
                (0.4 + 0.3 * libm::cos(angle) + 0.05 * libm::cos(2.0 * angle)) as f32
            });
            let wave = Wave::of(light);
            let off = (wave.phase - phase + 0.5).rem_euclid(1.0) - 0.5;
            assert!(
                off.abs() < 1e-6 && (wave.amplitude - 0.3).abs() < 1e-6,
                "{wave:?}"
            );
        }
    }

    #[test]
    fn the_nearest_period_is_taken() {
        let wave = Wave {
            phase: 0.25,
            amplitude: 1.0,
        };
        assert!((wave.place_near(101.0, 32.0) - 104.0).abs() < 1e-12);
        assert!((wave.place_near(87.0, 32.0) - 72.0).abs() < 1e-12);
    }
}
