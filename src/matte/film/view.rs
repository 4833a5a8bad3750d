//! From what a screen under the object shows to what the line of sight lets through.
//!
//! A screen is seen through the object *and* lit through it: `T = V * S`, V the share of the line of sight, S the share of
//! the light that still reaches the screen there. Where the plastic lies flat the light comes the way the sight goes, so
//! `S = V` and `T = V^2`. In folds and rims the sight is blocked by a few pixels' width while the light, which comes from
//! all around, is not: there S stays what it was and T falls with V.

use crate::pixel::LinearRgb;

/// V over its value where the plastic lies flat, by T over its own value there: knots of a broken line.
///
/// Medians over rendered bottles of another library than the sample photos'; between the knots they scatter by 0.1.
const CURVE: [[f32; 2]; 10] = [
    [0.0, 0.0],
    [0.1, 0.15],
    [0.2, 0.26],
    [0.3, 0.38],
    [0.4, 0.5],
    [0.6, 0.65],
    [0.8, 0.83],
    [0.9, 0.96],
    [1.0, 1.03],
    [1.45, 1.05],
];
/// From the first transmittance on to the second a pixel passes for bare screen.
const BARE: [f32; 2] = [0.9, 0.97];

/// View transmittance from the measured one, channel by channel, for plastic that where it lies flat measures `flat`.
pub(in crate::matte) fn view(transmittance: LinearRgb, flat: LinearRgb) -> LinearRgb {
    let channel = |t: f32, flat: f32| {
        let plastic = (flat.sqrt() * curve(t / flat.max(f32::MIN_POSITIVE))).clamp(0.0, 1.0);
        let bare = ((t - BARE[0]) / (BARE[1] - BARE[0])).clamp(0.0, 1.0);
        plastic + bare * (1.0 - plastic)
    };
    LinearRgb::new(channel(transmittance.r, flat.r), channel(transmittance.g, flat.g), channel(transmittance.b, flat.b))
}

fn curve(u: f32) -> f32 {
    let Some(k) = CURVE.windows(2).position(|pair| u < pair[1][0]) else { return CURVE[CURVE.len() - 1][1] };
    let [[x0, y0], [x1, y1]] = [CURVE[k], CURVE[k + 1]];
    y0 + (u - x0) / (x1 - x0) * (y1 - y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_plastic_is_seen_through_by_the_root_of_what_is_measured() {
        let flat = LinearRgb::new(0.55, 0.3, 0.1);
        let seen = view(flat, flat);
        assert!((seen.r - 0.55_f32.sqrt()).abs() < 0.03 && (seen.b - 0.1_f32.sqrt()).abs() < 0.03);
    }

    #[test]
    fn opaque_stays_opaque_and_bare_screen_bare() {
        let flat = LinearRgb::grey(0.55);
        assert_eq!(view(LinearRgb::BLACK, flat), LinearRgb::BLACK);
        assert_eq!(view(LinearRgb::WHITE, flat), LinearRgb::WHITE);
    }

    #[test]
    fn more_is_never_seen_through_less() {
        let at = |i: usize| view(LinearRgb::grey(i as f32 / 200.0), LinearRgb::grey(0.5)).r;
        assert!((1..=200).all(|i| at(i) >= at(i - 1)));
    }
}
