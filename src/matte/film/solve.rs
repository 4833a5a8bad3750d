//! One pixel of film: by which factor it is the plastic of its photo.

use super::FilmOptions;
use super::tint::{CLEAR_TRANSMITTANCE, MAX_THICKNESS_FACTOR, bare_shade, scattered_tint};
use crate::matte::arrays::largest;
use crate::pixel::LinearRgb;
use std::ops::RangeInclusive;

/// How see-through a pixel is beside flat plastic; by default it surely lets nothing through.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Factor {
    /// Transmittance over that of flat plastic, the same in all channels.
    pub(super) value: f32,
    /// Standard deviation of it.
    pub(super) sigma: f32,
    /// The value before anything bounds it.
    pub(super) unbounded: f32,
    /// Reflected light, of the channels that the screen has little of.
    pub(super) reflected: f32,
    /// Whether that light has a colour that this plastic cannot have.
    pub(super) coloured: bool,
    /// Nothing lies on the screen there, as in a hole: its shade, 1 as its plate.
    pub(super) bare_shade: Option<f32>,
}

impl Factor {
    pub(super) fn is_bare(&self) -> bool {
        self.bare_shade.is_some()
    }

    /// No more see-through than plastic can be.
    pub(super) fn is_plastic(&self) -> bool {
        !self.is_bare() && self.value <= MAX_THICKNESS_FACTOR
    }

    /// By what flat plastic passes; of bare screen its shade, whatever the dye is.
    pub(super) fn transmittance(self, flat: LinearRgb) -> LinearRgb {
        match self.bare_shade {
            Some(shade) => LinearRgb::grey(shade),
            None => flat.map(|t| (self.value * t).clamp(0.0, 1.0)),
        }
    }

    /// The same where bare screen lies in no shadow.
    pub(super) fn lit_transmittance(self, flat: LinearRgb) -> LinearRgb {
        let bare_shade = self.bare_shade.map(|_| 1.0);
        Self { bare_shade, ..self }.transmittance(flat)
    }

    /// As something that is plastic, whatever it looks like.
    fn of_plastic(self) -> Self {
        Self {
            unbounded: self.value,
            coloured: false,
            ..self
        }
    }

    /// As something that may or may not be plastic, whose factors have the deviation `spread`.
    fn guessed(self, spread: f32) -> Self {
        Self {
            unbounded: self.value,
            sigma: self.sigma / spread,
            ..self
        }
    }

    /// Makes the deviation at least that.
    #[inline]
    pub(super) fn raise_sigma(&mut self, least: f32) {
        self.sigma = self.sigma.max(least);
    }
}

/// The factor of flat plastic.
const FLAT_FACTOR: f32 = 1.0;

/// What is the same for all pixels of a photo.
pub(super) struct Solver {
    key: usize,
    others: [usize; 2],
    flat: [f32; 3],
    /// Shares of the others' reflection that make up the key channel's.
    shares: [f32; 2],
    /// The second of the others over the first in the light that the plastic scatters.
    cast: f32,
    noise: f32,
    reflection_error: f32,
    spread: f32,
}

/// Tints must differ by this share of the largest to separate glint from scattered light.
const MIN_TINT_CONTRAST: f32 = 0.25;
/// Least light of the key channel over the others': with less no pixel measures anything. Its
/// square is still a normal number.
const MIN_GAIN: f32 = 1e-12;
/// Noise of a pixel at least: coded pictures are no finer.
const MIN_NOISE: f32 = 0.004;
/// Clear plastic reflects neutrally: this much of the error of the key channel's reflection is due
/// to the tint.
const TINT_ERROR_SHARE: f32 = 0.8;
/// Scene-linear value from which on to which reflected light passes from that of plastic to that of
/// paint. An exposure that has the screen at 0.3 to 0.45 has white paper at 0.5.
const PAINT_LIGHT: RangeInclusive<f32> = 0.15..=0.3;
/// Difference of two channels from what plastic can reflect, as a share of the larger, beyond which
/// it is paint; lights a fifth warmer or colder than the photo's white make a third of it.
const MAX_CAST_DIFFERENCE: f32 = 0.4;
/// The same, scene-linear light, that noise and rounding leave in dark places; single pixels of
/// noise are no paint yet.
const MAX_DARK_CAST_DIFFERENCE: f32 = 0.02;

impl Solver {
    pub(super) fn new(key: usize, flat: [f32; 3], noise: LinearRgb, options: &FilmOptions) -> Self {
        let others = [(key + 1) % 3, (key + 2) % 3];
        let clearness = (flat[key] / CLEAR_TRANSMITTANCE).clamp(0.0, 1.0);
        let scattered = scattered_tint(flat);
        Self {
            key,
            others,
            flat,
            shares: shares(key, others, scattered),
            cast: scattered[others[1]] / scattered[others[0]],
            noise: noise.max_channel().max(MIN_NOISE),
            reflection_error: options.reflection_error * (1.0 - clearness * TINT_ERROR_SHARE),
            spread: options.thickness_spread,
        }
    }

    /// The factor on a screen with a hue.
    pub(super) fn solve(&self, pixel: [f32; 3], screen: [f32; 3]) -> Factor {
        let measured = self.measure(pixel, screen);
        let [a, b] = self.others.map(|c| pixel[c]);
        let brightest = a.max(b).max(measured.reflected);
        Factor {
            bare_shade: bare_shade(pixel, screen, self.flat, self.key),
            ..self.combine(pixel, &measured, plastic_factor(brightest))
        }
    }

    /// The factor on a screen that has too little hue to measure much: that of flat plastic unless
    /// more light is left than plastic throws back. The deviation is that of something that may
    /// or may not be plastic.
    pub(super) fn guess(&self, pixel: [f32; 3], screen: [f32; 3]) -> Factor {
        let measured = self.measure(pixel, screen);
        let left = (0..3).map(|c| pixel[c] - measured.through[c]);
        let left = left.fold(0.0, f32::max);
        self.combine(pixel, &measured, plastic_factor(left))
            .guessed(self.spread)
    }

    /// The factor of what is known to be plastic, however bright or coloured.
    pub(super) fn see_through(&self, pixel: [f32; 3], screen: [f32; 3]) -> Factor {
        let measured = self.measure(pixel, screen);
        self.combine(pixel, &measured, FLAT_FACTOR).of_plastic()
    }

    /// What the photo alone gives.
    #[inline(always)]
    fn measure(&self, pixel: [f32; 3], screen: [f32; 3]) -> PixelMeasurement {
        let through: [f32; 3] = std::array::from_fn(|c| self.flat[c] * screen[c]);
        let reflected = self.mixed(pixel).max(0.0);
        let gain = (through[self.key] - self.mixed(through)).max(MIN_GAIN);
        let reflection = self.reflection_error * reflected;
        PixelMeasurement {
            through,
            reflected,
            factor: (pixel[self.key] - self.mixed(pixel)) / gain,
            variance: (reflection * reflection + self.noise * self.noise) / (gain * gain),
        }
    }

    /// The part of the other channels that makes up the key channel's reflection.
    #[inline(always)]
    fn mixed(&self, of: [f32; 3]) -> f32 {
        self.shares[0] * of[self.others[0]] + self.shares[1] * of[self.others[1]]
    }

    /// What the photo gives, combined with what is expected, weighted by the variances.
    #[inline(always)]
    fn combine(&self, pixel: [f32; 3], measured: &PixelMeasurement, expected: f32) -> Factor {
        let &PixelMeasurement {
            through,
            factor,
            variance,
            ..
        } = measured;
        let prior = self.spread * self.spread;
        let unbounded = (factor * prior + expected * variance) / (prior + variance);
        let value = unbounded
            .min(largest_factor(pixel, through))
            .clamp(0.0, self.most());
        let [a, b] = self.others.map(|c| pixel[c] - value * through[c]);
        Factor {
            value,
            sigma: (prior * variance / (prior + variance)).sqrt(),
            unbounded,
            reflected: (0.5 * (a + b)).max(0.0),
            coloured: self.is_coloured(a, b),
            bare_shade: None,
        }
    }

    /// The factor at which the clearest channel lets everything through.
    #[inline(always)]
    fn most(&self) -> f32 {
        1.0 / self.flat.iter().copied().fold(f32::MIN_POSITIVE, f32::max)
    }

    /// Plastic reflects neutrally, scatters in its own tint, or both: what lies beyond is paint.
    #[inline]
    fn is_coloured(&self, a: f32, b: f32) -> bool {
        let [least, most] = self.plastic_range(a);
        let beyond = (least - b).max(b - most);
        beyond > MAX_DARK_CAST_DIFFERENCE + MAX_CAST_DIFFERENCE * a.abs().max(b.abs())
    }

    /// What plastic reflects in the second of the other channels, least and most, where it reflects
    /// `a` in the first.
    #[inline]
    fn plastic_range(&self, a: f32) -> [f32; 2] {
        if self.cast < 1.0 {
            [self.cast * a, a]
        } else {
            [a, self.cast * a]
        }
    }
}

/// What a pixel alone gives.
struct PixelMeasurement {
    /// The screen through flat plastic.
    through: [f32; 3],
    /// Reflected light of the key channel.
    reflected: f32,
    factor: f32,
    /// Of the factor.
    variance: f32,
}

/// The factor at which a channel is all screen: nothing reflects less than no light. Channels in
/// which the screen has none bound nothing.
#[inline(always)]
fn largest_factor(pixel: [f32; 3], through: [f32; 3]) -> f32 {
    (0..3)
        .map(|c| match through[c] > 0.0 {
            true => pixel[c] / through[c],
            false => f32::MAX,
        })
        .fold(f32::MAX, f32::min)
}

/// The factor of something that reflects this much light: plastic, or paint.
fn plastic_factor(brightest: f32) -> f32 {
    let (low, high) = (PAINT_LIGHT.start(), PAINT_LIGHT.end());
    ((high - brightest) / (high - low)).clamp(0.0, 1.0)
}

/// The shares of two channels' light that make up the third's, for light of which a part is neutral
/// and the rest has the colour `scattered`; half and half where the two do not differ.
fn shares(key: usize, [a, b]: [usize; 2], scattered: [f32; 3]) -> [f32; 2] {
    let soft = MIN_TINT_CONTRAST * largest(scattered);
    let differ = scattered[a] - scattered[b];
    let share = (differ * (scattered[key] - scattered[b]) + 0.5 * soft * soft)
        / (differ * differ + soft * soft);
    let share = share.clamp(0.0, 1.0);
    [share, 1.0 - share]
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: [f32; 3] = [0.045, 0.42, 0.085];

    fn clear() -> Solver {
        Solver::new(
            1,
            [CLEAR_TRANSMITTANCE; 3],
            LinearRgb::grey(0.001),
            &FilmOptions::default(),
        )
    }

    #[test]
    fn neutral_glint_on_clear_plastic_is_told_from_the_screen() {
        for (u, glint) in [(1.0, 0.0), (0.8, 0.1), (0.3, 0.05), (1.2, 0.12)] {
            let pixel = GREEN.map(|k| u * CLEAR_TRANSMITTANCE * k + glint);
            let found = clear().solve(pixel, GREEN);
            assert!(
                (found.value - u).abs() < 0.02,
                "{found:?} for {u} and {glint}"
            );
        }
    }

    #[test]
    fn paint_of_another_colour_than_the_plastic_is_told_from_its_glints() {
        let seen = |reflected: [f32; 3]| {
            let pixel =
                std::array::from_fn(|c| 0.5 * CLEAR_TRANSMITTANCE * GREEN[c] + reflected[c]);
            clear().solve(pixel, GREEN).coloured
        };
        assert!(seen([0.3, 0.35, 0.02]) && seen([0.02, 0.1, 0.3]));
        assert!(!seen([0.2; 3]) && !seen([0.22, 0.2, 0.17]) && !seen([0.0; 3]));
    }

    #[test]
    fn no_channel_shows_more_screen_than_light() {
        let found = clear().solve([0.0, 0.2, 0.04], GREEN);
        assert_eq!(found.value, 0.0);
    }

    #[test]
    fn what_the_photo_does_not_tell_is_uncertain() {
        let dark = Solver::new(
            2,
            [0.01, 0.2, 0.02],
            LinearRgb::grey(0.002),
            &FilmOptions::default(),
        );
        let screen = [0.03, 0.09, 0.5];
        let (sure, unsure) = (
            clear().solve([0.05, 0.25, 0.07], GREEN),
            dark.solve([0.1, 0.12, 0.11], screen),
        );
        assert!(
            sure.sigma < 0.05 && unsure.sigma > 0.2,
            "{sure:?} {unsure:?}"
        );
    }
}
