//! Reflected light and transmittance from the black and the white frame.
//!
//! # Method
//! [Smith and Blinn 1996] on a display that shines by itself: `I = F + V E` for both frames gives
//! `V = (I_W - I_K) / (E_W - E_K)` and `F = I_K - V E_K` in every pixel and channel. What the light
//! of the display does before it reaches the object plays no part, as it does on a painted screen.
//!
//! [Smith and Blinn 1996]: https://doi.org/10.1145/237170.237263

use crate::image::{Image, Mask};
use crate::pixel::{Coverage, Film, LinearRgb, Mix};

/// The two frames with the object and without.
#[derive(Clone, Copy)]
pub(super) struct BlackAndWhite<'a> {
    pub(super) black: &'a Image<LinearRgb>,
    pub(super) white: &'a Image<LinearRgb>,
    pub(super) empty_black: &'a Image<LinearRgb>,
    pub(super) empty_white: &'a Image<LinearRgb>,
}

/// Least light of the display, as a share of its brightest, that a channel is divided by.
const MIN_LIGHT: f32 = 1e-3;

impl BlackAndWhite<'_> {
    /// Film of the object; empty outside.
    pub(super) fn film(&self, inside: &Image<Coverage>) -> Image<Film> {
        let transmittance = self.transmittance();
        let reflected = self
            .black
            .zip3_map(&transmittance, self.empty_black, |p, v, e| {
                by_channel(p, v, e, |p, v, e| (p - v * e).max(0.0))
            });
        let film = reflected.zip_map(&transmittance, Film::new);
        film.zip_map(inside, covered)
    }

    /// V, held between 0 and 1.
    fn transmittance(&self) -> Image<LinearRgb> {
        let passed = self.white.zip_map(self.black, |w, k| w.add_scaled(-1.0, k));
        passed.zip_map(&self.light(), |passed, light| {
            by_channel(passed, light, light, |passed, light, _| {
                (passed / light.max(MIN_LIGHT)).clamp(0.0, 1.0)
            })
        })
    }

    /// What the display shines more for white than for black.
    pub(super) fn light(&self) -> Image<LinearRgb> {
        self.empty_white
            .zip_map(self.empty_black, |w, k| w.add_scaled(-1.0, k))
    }

    /// Standard deviation of V in its least certain channel, where film is.
    pub(super) fn sigma(&self, film: &Image<Film>, noise: &Noise) -> Image<f32> {
        let light = self.light();
        let noises = self
            .white
            .zip_map(self.black, |w, k| noise.of(w) + noise.of(k));
        let sigma = film.zip3_map(&light, &noises, |film, light, variance| {
            let v = film.transmittance();
            by_channel(v, light, variance, |v, light, variance| {
                let plate = v * v * noise.empty;
                libm::sqrtf(variance + plate) / light.max(MIN_LIGHT)
            })
        });
        sigma.zip_map(film, |sigma, film| {
            if film == Film::default() {
                0.0
            } else {
                sigma.max_channel().min(1.0)
            }
        })
    }

    /// How a photo's noise grows with light, by the free pixels of both frames.
    pub(super) fn noise(&self, free: &Mask) -> Noise {
        let black = Spread::of(self.black, self.empty_black, free);
        let white = Spread::of(self.white, self.empty_white, free);
        let slope = (white.variance - black.variance) / (white.light - black.light).max(MIN_LIGHT);
        let slope = slope.max(0.0);
        Noise {
            dark: (black.variance - slope * black.light).max(0.0),
            slope,
            empty: 0.0,
        }
    }
}

/// A film where an object is.
fn covered(film: Film, Coverage(c): Coverage) -> Film {
    Film {
        color: film.color.scale(c),
        opacity: film.opacity.scale(c),
    }
}

fn by_channel(
    a: LinearRgb,
    b: LinearRgb,
    c: LinearRgb,
    f: impl Fn(f32, f32, f32) -> f32,
) -> LinearRgb {
    LinearRgb::new(f(a.r, b.r, c.r), f(a.g, b.g, c.g), f(a.b, b.b, c.b))
}

/// Variance of a pixel by its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Noise {
    pub(super) dark: f32,
    pub(super) slope: f32,
    /// Of the empty display, where that was photographed and not fitted.
    pub(super) empty: f32,
}

impl Noise {
    fn of(&self, light: LinearRgb) -> LinearRgb {
        light.map(|v| self.dark + self.slope * v.max(0.0))
    }

    /// Variance of white, as it is seen empty.
    pub(super) fn of_white(&self, white: f32) -> f32 {
        self.dark + self.slope * white
    }
}

/// Mean light and variance of free pixels.
struct Spread {
    light: f32,
    variance: f32,
}

impl Spread {
    /// By the differences of neighbours, which a plate that is off does not change.
    fn of(seen: &Image<LinearRgb>, empty: &Image<LinearRgb>, free: &Mask) -> Self {
        let (w, h) = seen.size();
        let (mut light, mut square, mut count) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (x, y) in (0..h).flat_map(|y| (1..w).map(move |x| (x, y))) {
            if free[(x, y)] && free[(x - 1, y)] {
                // Two columns apart noise that was resampled is less alike.
                let far = x.saturating_sub(3);
                let step = seen[(x, y)].g - seen[(far, y)].g;
                square += f64::from(step * step) / 2.0;
                light += f64::from(empty[(x, y)].g);
                count += 1.0;
            }
        }
        let n = count.max(1.0);
        Self {
            light: (light / n) as f32,
            variance: (square / n) as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(v: f32) -> Image<LinearRgb> {
        Image::filled(8, 6, LinearRgb::new(v, 0.9 * v, 0.8 * v))
    }

    #[test]
    fn film_is_what_was_put_in() {
        let (f, v) = (
            LinearRgb::new(0.1, 0.02, 0.0),
            LinearRgb::new(0.9, 0.5, 0.0),
        );
        let (empty_black, empty_white) = (flat(0.03), flat(0.8));
        let seen = |empty: &Image<LinearRgb>| empty.map(|e| f + v * e);
        let (black, white) = (seen(&empty_black), seen(&empty_white));
        let frames = BlackAndWhite {
            black: &black,
            white: &white,
            empty_black: &empty_black,
            empty_white: &empty_white,
        };
        let inside = Image::from_fn(8, 6, |x, _| Coverage(if x < 4 { 1.0 } else { 0.0 }));
        let film = frames.film(&inside);
        for (got, expected) in [(film[(2, 2)].color, f), (film[(2, 2)].transmittance(), v)] {
            let off = got.add_scaled(-1.0, expected).map(f32::abs).max_channel();
            assert!(off < 1e-5, "{got:?} for {expected:?}");
        }
        assert_eq!(film[(6, 2)], Film::default());
    }

    #[test]
    fn the_stated_error_is_that_of_noisy_frames() {
        let noise = |i: u64| {
            let mixed = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            ((mixed >> 40) as f32 / (1_u64 << 24) as f32 - 0.5) * libm::sqrtf(12.0)
        };
        let (w, h, sigma) = (200, 100, 0.01);
        let shot = |level: f32, seed: u64| {
            Image::from_fn(w, h, |x, y| {
                let at = (seed * 1_000_003 + (y * w + x) as u64) * 3;
                LinearRgb::new(
                    level + sigma * noise(at),
                    level + sigma * noise(at + 1),
                    level + sigma * noise(at + 2),
                )
            })
        };
        let [empty_black, empty_white] =
            [0.02, 0.8].map(|v| Image::filled(w, h, LinearRgb::grey(v)));
        let v = 0.6_f32;
        let frames = BlackAndWhite {
            black: &shot(0.02 * v, 1),
            white: &shot(0.8 * v, 2),
            empty_black: &empty_black,
            empty_white: &empty_white,
        };
        let free = Image::filled(w, h, true);
        let film = frames.film(&Image::filled(w, h, Coverage(1.0)));
        let off = film
            .pixels()
            .iter()
            .map(|f| f64::from(f.transmittance().g - v).powi(2));
        let measured = (off.sum::<f64>() / (w * h) as f64).sqrt();
        let stated = f64::from(frames.sigma(&film, &frames.noise(&free))[(50, 50)]);
        assert!(
            (stated / measured - 1.0).abs() < 0.15,
            "{stated} for {measured}"
        );
    }
}
