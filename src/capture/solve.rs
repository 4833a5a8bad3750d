//! Reflected light and transmittance from the black and the white frame, and the stripes' mean.
//!
//! # Method
//! [Smith and Blinn 1996] on a display that shines by itself: `I = F + V E` for both frames gives
//! `V = (I_W - I_K) / (E_W - E_K)` and `F = I_K - V E_K` in every pixel and channel. What the light
//! of the display does before it reaches the object plays no part, as it does on a painted screen.
//! The mean of all stripes is one more frame, of little noise, wherever lines of sight end: the line
//! through all of them is that of least squares, weighted by their noise.
//!
//! [Smith and Blinn 1996]: https://doi.org/10.1145/237170.237263

use super::view::clipped;
use crate::filter::{self, Pyramid, sample_bilinear_clamped};
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, Film, LinearRgb, Mix, PremulRgba};
use crate::quantile::median;

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
/// No display is darker in a photo.
const DARKEST: f32 = 1e-6;

impl BlackAndWhite<'_> {
    /// What the display shines more for white than for black.
    pub(super) fn light(&self) -> Image<LinearRgb> {
        self.empty_white
            .zip_map(self.empty_black, |w, k| w.add_scaled(-1.0, k))
    }

    /// Light of the display's brightest channel, where it is free.
    fn brightest(&self, free: &Mask) -> f32 {
        let light = self.light().map(LinearRgb::max_channel);
        let middle = median(light.pixels_in(free), f32::total_cmp);
        middle.unwrap_or(1.0).max(DARKEST)
    }

    /// Least light of the display that a channel is divided by.
    pub(super) fn least_light(&self, free: &Mask) -> f32 {
        MIN_LIGHT * self.brightest(free)
    }

    /// How a photo's noise grows with light, by the free pixels of both frames.
    pub(super) fn noise(&self, free: &Mask) -> NoiseModel {
        let black = FreeNoise::of(self.black, self.empty_black, free);
        let white = FreeNoise::of(self.white, self.empty_white, free);
        let light = (white.light - black.light).max(self.least_light(free));
        let slope = ((white.variance - black.variance) / light).max(0.0);
        NoiseModel {
            dark: (black.variance - slope * black.light).max(0.0),
            slope,
            least: MIN_VARIANCE * self.brightest(free).powi(2),
            empty: 0.0,
        }
    }
}

/// All that is known of what an object lets pass.
pub(super) struct FilmInput<'a> {
    pub(super) frames: BlackAndWhite<'a>,
    /// Mean of all stripes with the object; empty where there are none.
    pub(super) stripes: &'a Image<LinearRgb>,
    pub(super) noise: NoiseModel,
    /// Least light of the display that a channel is divided by.
    pub(super) least_light: f32,
    /// Pixels that surely show the empty display.
    pub(super) free: &'a Mask,
    /// Where each photo of the white frame is clipped. Their mean, of photos of several exposures,
    /// does not tell.
    pub(super) clipped_white: &'a [(String, Mask)],
}

/// Film of an object, and the standard deviation of its transmittance in the least certain channel;
/// both are empty outside.
pub(super) struct SolvedFilm {
    pub(super) film: Image<Film>,
    pub(super) sigma: Image<f32>,
}

/// Light of a frame with the object over that without, and how certain it is.
#[derive(Clone, Copy, Default)]
struct Level {
    empty: f32,
    seen: f32,
    /// Of its variance the inverse.
    weight: f32,
}

/// The line `seen = F + V empty` through all levels.
#[derive(Clone, Copy, Default)]
struct LevelLine {
    middle: [f32; 2],
    slope: f32,
    /// Variance of the slope; infinite where one level is all there is.
    variance: f32,
}

impl LevelLine {
    fn through(levels: [Level; 3]) -> Self {
        let sum = |f: &dyn Fn(&Level) -> f32| levels.iter().map(|l| l.weight * f(l)).sum::<f32>();
        let total = sum(&|_| 1.0).max(f32::MIN_POSITIVE);
        let [x, y] = [sum(&|l| l.empty) / total, sum(&|l| l.seen) / total];
        let spread = sum(&|l| (l.empty - x) * (l.empty - x));
        let both = sum(&|l| (l.empty - x) * (l.seen - y));
        Self {
            middle: [x, y],
            slope: (both / spread.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0),
            variance: spread.recip(),
        }
    }
}

/// Photos that the mean of the stripes is made of.
const STRIPE_PHOTOS: f32 = 16.0;
/// Pixels around a clipped one that it has a share in.
const CLIPPED_RIM_PX: f64 = 1.0;

impl FilmInput<'_> {
    pub(super) fn solve(&self, inside: &Image<Coverage>) -> SolvedFilm {
        let frames = &self.frames;
        let clipped = filter::dilate(&self.clipped(), CLIPPED_RIM_PX);
        let level = self.level_of_stripes();
        let (w, h) = frames.black.size();
        let lines = Image::from_fn(w, h, |x, y| self.lines((x, y), level, clipped[(x, y)]));
        let transmittance = lines.map(|lines| LinearRgb::from(lines.map(|line| line.slope)));
        let transmittance = filled(&transmittance, &clipped, inside);
        let film = lines.zip3_map(&transmittance, inside, |lines, v, inside| {
            let reflected = lines.map(|LevelLine { middle: [x, y], .. }| (x, y));
            let v = v.channels();
            let reflected =
                [0, 1, 2].map(|c: usize| (reflected[c].1 - v[c] * reflected[c].0).max(0.0));
            covered(Film::new(reflected.into(), v.into()), inside)
        });
        let light = frames.light();
        let sigma = lines.zip3_map(&film, &light, |lines, film, light| {
            self.sigma(&lines, film, light)
        });
        SolvedFilm { film, sigma }
    }

    /// Of each channel.
    fn clipped(&self) -> Mask {
        let photos = self.clipped_white.iter().map(|(_, mask)| mask);
        photos.fold(clipped(self.frames.white), |all, mask| {
            all.zip_map(mask, |all, here| all || here)
        })
    }

    fn lines(&self, at: (usize, usize), level: LinearRgb, clipped: bool) -> [LevelLine; 3] {
        let frames = &self.frames;
        let [black, white] =
            [frames.empty_black[at], frames.empty_white[at]].map(LinearRgb::channels);
        let seen = [frames.black[at], frames.white[at]].map(LinearRgb::channels);
        let stripes = (!self.stripes.is_empty()).then(|| self.stripes[at].channels());
        let level = level.channels();
        [0, 1, 2].map(|c: usize| {
            let light = (white[c] - black[c]).max(self.least_light);
            let weight = |seen: f32| {
                if clipped {
                    0.0
                } else {
                    self.noise.of(seen).recip()
                }
            };
            let stripes = stripes.map_or(Level::default(), |stripes| Level {
                empty: black[c] + level[c] * light,
                seen: stripes[c],
                weight: STRIPE_PHOTOS * weight(stripes[c]),
            });
            LevelLine::through([
                Level {
                    empty: black[c],
                    seen: seen[0][c],
                    weight: self.noise.of(seen[0][c]).recip(),
                },
                Level {
                    empty: black[c] + light,
                    seen: seen[1][c],
                    weight: weight(seen[1][c]),
                },
                stripes,
            ])
        })
    }

    /// The mean of the stripes on the empty display: 0 is black and 1 white.
    fn level_of_stripes(&self) -> LinearRgb {
        if self.stripes.is_empty() {
            return LinearRgb::BLACK;
        }
        let (frames, light) = (&self.frames, self.frames.light());
        let above = self
            .stripes
            .zip3_map(frames.empty_black, &light, |mean, black, light| {
                let [mean, black, light] = [mean, black, light].map(LinearRgb::channels);
                [0, 1, 2].map(|c: usize| (mean[c] - black[c]) / light[c].max(self.least_light))
            });
        let of = |channel: usize| {
            let values = above.pixels_in(self.free).map(|above| above[channel]);
            median(values, f32::total_cmp).unwrap_or(0.5)
        };
        LinearRgb::from([0, 1, 2].map(of))
    }

    fn sigma(&self, lines: &[LevelLine; 3], film: Film, light: LinearRgb) -> f32 {
        if film == Film::default() {
            return 0.0;
        }
        let (v, light) = (film.transmittance().channels(), light.channels());
        let of = |c: usize| {
            let plate = v[c] * v[c] * self.noise.empty / light[c].max(self.least_light).powi(2);
            libm::sqrtf(lines[c].variance + plate)
        };
        [0, 1, 2].map(of).into_iter().fold(0.0, f32::max).min(1.0)
    }
}

/// Glints that clip tell nothing of what passes under them: what is around them does.
fn filled(
    transmittance: &Image<LinearRgb>,
    clipped: &Mask,
    inside: &Image<Coverage>,
) -> Image<LinearRgb> {
    if clipped.count() == 0 {
        return transmittance.clone();
    }
    let known = transmittance.zip3_map(clipped, inside, |v, clipped, inside| {
        if clipped || inside.0 < 1.0 {
            PremulRgba::default()
        } else {
            PremulRgba::new(v.r, v.g, v.b, 1.0)
        }
    });
    let known = Pyramid::new(known);
    let (w, h) = transmittance.size();
    Image::from_fn(w, h, |x, y| {
        if clipped[(x, y)] {
            around(&known, [x, y])
        } else {
            transmittance[(x, y)]
        }
    })
}

/// Share of the pixels around that are to be known.
const MIN_AROUND: f32 = 0.15;

/// What is known around a pixel, as near as there is something.
fn around(known: &Pyramid<PremulRgba>, [x, y]: [usize; 2]) -> LinearRgb {
    let levels = (1..known.levels()).map(|level| {
        let side = (1_u64 << level) as f64;
        let [x, y] = [x, y].map(|i| (i as f64 + 0.5) / side);
        sample_bilinear_clamped(known.level(level), x, y)
    });
    let mut levels = levels.filter(|p| p.a >= MIN_AROUND);
    // Far from all that is known there is but the mean of that.
    let p = levels
        .next()
        .unwrap_or_else(|| known.level(known.levels())[(0, 0)]);
    if p.a > 0.0 {
        LinearRgb::new(p.r, p.g, p.b).scale(p.a.recip())
    } else {
        LinearRgb::BLACK
    }
}

/// A film where an object is.
fn covered(film: Film, Coverage(c): Coverage) -> Film {
    Film {
        color: film.color.scale(c),
        opacity: film.opacity.scale(c),
    }
}

/// Variance that no photo is better than, where the display's brightest light is 1: that of 12 bits.
const MIN_VARIANCE: f32 = 5e-9;

/// Variance of a pixel by its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoiseModel {
    pub(super) dark: f32,
    pub(super) slope: f32,
    /// What no photo is better than.
    pub(super) least: f32,
    /// Of the empty display, where that was photographed and not fitted.
    pub(super) empty: f32,
}

impl NoiseModel {
    fn of(&self, light: f32) -> f32 {
        (self.dark + self.slope * light.max(0.0)).max(self.least)
    }

    /// Variance of white, as it is seen empty.
    pub(super) fn of_white(&self, white: f32) -> f32 {
        self.dark + self.slope * white
    }
}

/// Mean light and variance of free pixels.
struct FreeNoise {
    light: f32,
    variance: f32,
}

impl FreeNoise {
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

    fn solved(
        frames: BlackAndWhite<'_>,
        stripes: &Image<LinearRgb>,
        free: &Mask,
        inside: &Image<Coverage>,
    ) -> SolvedFilm {
        let input = FilmInput {
            frames,
            stripes,
            noise: frames.noise(free),
            least_light: frames.least_light(free),
            free,
            clipped_white: &[],
        };
        input.solve(inside)
    }

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
        let free = inside.map(|c| c.0 == 0.0);
        let film = solved(frames, &Image::new(0, 0), &free, &inside).film;
        for (got, expected) in [(film[(2, 2)].color, f), (film[(2, 2)].transmittance(), v)] {
            let off = got.add_scaled(-1.0, expected).map(f32::abs).max_channel();
            assert!(off < 1e-5, "{got:?} for {expected:?}");
        }
        assert_eq!(film[(6, 2)], Film::default());
    }

    #[test]
    fn dark_photos_have_the_same_transmittance() {
        let (f, v) = (LinearRgb::grey(0.05), LinearRgb::new(0.9, 0.5, 0.1));
        let free = Image::from_fn(8, 6, |x, _| x >= 4);
        let inside = free.map(|free| Coverage(if free { 0.0 } else { 1.0 }));
        let transmittance = |exposure: f32| {
            let [empty_black, empty_white] = [0.03, 0.8].map(|level| flat(exposure * level));
            let seen = |empty: &Image<LinearRgb>| empty.map(|e| f.scale(exposure) + v * e);
            let frames = BlackAndWhite {
                black: &seen(&empty_black),
                white: &seen(&empty_white),
                empty_black: &empty_black,
                empty_white: &empty_white,
            };
            let film = solved(frames, &Image::new(0, 0), &free, &inside).film;
            film[(2, 2)].transmittance()
        };
        for exposure in [1.0, 1e-3] {
            let got = transmittance(exposure);
            let off = got.add_scaled(-1.0, v).map(f32::abs).max_channel();
            assert!(off < 1e-4, "{got:?} at {exposure}");
        }
    }

    #[test]
    fn what_clips_far_from_all_that_is_known_is_not_opaque() {
        let is_inside = |x: usize, y: usize| (20..40).contains(&x) && (20..40).contains(&y);
        let inside = Image::from_fn(64, 64, |x, y| {
            Coverage(if is_inside(x, y) { 1.0 } else { 0.0 })
        });
        let clipped = Image::from_fn(64, 64, |x, y| is_inside(x, y) && x >= 22);
        let transmittance = clipped.map(|clipped| LinearRgb::grey(if clipped { 0.0 } else { 0.9 }));
        let v = filled(&transmittance, &clipped, &inside)[(38, 30)];
        assert!((v.g - 0.9).abs() < 1e-5, "{v:?}");
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
        let inside = Image::filled(w, h, Coverage(1.0));
        let SolvedFilm { film, sigma } = solved(frames, &Image::new(0, 0), &free, &inside);
        let off = film
            .pixels()
            .iter()
            .map(|f| f64::from(f.transmittance().g - v).powi(2));
        let measured = (off.sum::<f64>() / (w * h) as f64).sqrt();
        let stated = f64::from(sigma[(50, 50)]);
        assert!(
            (stated / measured - 1.0).abs() < 0.15,
            "{stated} for {measured}"
        );
    }
}
