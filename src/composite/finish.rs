//! The frame as a camera would deliver it: blur and noise for what has none, white balance,
//! exposure, sharpening.

use crate::composite::effect::Effect;
use crate::composite::poisson::blend;
use crate::deep::DeepImage;
use crate::filter::{gaussian_blur, sample_cubic_clamped};
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, Mix, PremulRgba};
use crate::scene::{Blur, CameraNoise, EdgeTreatment, Noise, PostProcess};
use crate::work::{self, Kind};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Standard deviation of the blur that sharpening removes.
const SHARPENING_SIGMA_PX: f32 = 1.0;

/// Finishes a frame of deep samples over `plate`; scene-linear, premultiplied.
/// [`PostProcess::default`] returns the same bits.
///
/// Cards and shadows get the blur and the noise that a photograph of them would have: the visible
/// plate already has its own, so a pixel far from cards and shadows keeps its bits. The camera's
/// colour fringes, blur and noise, exposure, white balance and sharpening apply to the whole frame.
///
/// # Method
/// The light of the cards and the transmittance of cards and shadows are blurred, the plate is not.
/// Noise is Gaussian (by the ziggurat of Marsaglia and Tsang, 2000), with variance
/// `shot * value + read^2` minus what the visible plate contributes. It depends only on the seed,
/// the pixel and the channel. Noise still to be matched ([`Noise::MatchPlate`]) counts as none.
pub fn finish(
    frame: Image<PremulRgba>,
    deep: &DeepImage,
    plate: Option<&Image<LinearRgb>>,
    finish: &PostProcess,
) -> Image<PremulRgba> {
    let straight = deep.undisplaced();
    let effect = Effect::Still(straight.as_ref().unwrap_or(deep));
    let plate = plate.map(|plate| deep.displaced_plate(plate));
    let plate = plate.as_deref();
    let Some(films) = blurred_films(&effect, plate, finish) else {
        return graded(blurred_alone(frame, plate, finish), &effect, plate, finish);
    };
    let blurred = Effect::Moved(&films);
    graded(blurred.frame(plate), &blurred, plate, finish)
}

/// The finished frame of objects with this effect on the plate as seen, blended into it if `edges`
/// is set to that, after their blur and before any noise.
pub(super) fn finish_exposed(
    effect: &Effect<'_>,
    deep: &DeepImage,
    plate: Option<&Image<LinearRgb>>,
    edges: EdgeTreatment,
    finish: &PostProcess,
) -> Image<PremulRgba> {
    let films = blurred_films(effect, plate, finish);
    let blurred = films.as_ref().map(Effect::Moved);
    let effect = blurred.as_ref().unwrap_or(effect);
    let soft = blurred_alone(effect.frame(plate), plate, finish);
    let blended = if edges == EdgeTreatment::Poisson && plate.is_some() {
        blend(&soft, deep)
    } else {
        soft
    };
    graded(blended, effect, plate, finish)
}

/// Cards and shadows blurred like the plate that they are on; none without a blur or a plate.
fn blurred_films(
    effect: &Effect<'_>,
    plate: Option<&Image<LinearRgb>>,
    finish: &PostProcess,
) -> Option<Image<Film>> {
    let sigma_px = blur_sigma(finish).filter(|_| plate.is_some())?;
    Some(effect.blurred(sigma_px))
}

/// The frame with its blur where there is no plate, which all of it then has.
fn blurred_alone(
    frame: Image<PremulRgba>,
    plate: Option<&Image<LinearRgb>>,
    finish: &PostProcess,
) -> Image<PremulRgba> {
    match blur_sigma(finish).filter(|_| plate.is_none()) {
        Some(sigma_px) => gaussian_blur(&frame, sigma_px),
        None => frame,
    }
}

/// Standard deviation of the blur of cards; none without one.
fn blur_sigma(finish: &PostProcess) -> Option<f32> {
    match finish.blur_px {
        Blur::Known(sigma_px) if sigma_px > 0.0 => Some(sigma_px as f32),
        _ => None,
    }
}

/// The frame with the noise of cards, and everything that applies to the whole frame.
fn graded(
    frame: Image<PremulRgba>,
    effect: &Effect<'_>,
    plate: Option<&Image<LinearRgb>>,
    finish: &PostProcess,
) -> Image<PremulRgba> {
    let noisy = match SensorNoise::of_cards(finish) {
        Some(noise) => noise.add_to(&frame, |at, p| seen_plate(effect, plate, at, p)),
        None => frame,
    };
    let exposed = apply_gain(through_camera(noisy, finish), finish);
    if finish.sharpening == 0.0 {
        return exposed;
    }
    sharpen(&exposed, finish.sharpening as f32)
}

/// The whole frame with a camera's colour fringes, blur and noise.
fn through_camera(frame: Image<PremulRgba>, finish: &PostProcess) -> Image<PremulRgba> {
    let fringed = match finish.chromatic_px {
        0.0 => frame,
        corner_px => spread_colors(&frame, corner_px),
    };
    let soft = match finish.camera_blur_px {
        0.0 => fringed,
        sigma_px => gaussian_blur(&fringed, sigma_px as f32),
    };
    match SensorNoise::of_camera(finish) {
        Some(noise) => noise.add_to(&soft, |_, _| NO_PLATE),
        None => soft,
    }
}

/// The frame with red magnified and blue reduced about its centre, by `corner_px` pixels in the
/// corners.
fn spread_colors(frame: &Image<PremulRgba>, corner_px: f64) -> Image<PremulRgba> {
    work::add(Kind::Filters, 1);
    let [w, h] = [frame.width() as f64, frame.height() as f64];
    let share = 2.0 * corner_px / libm::hypot(w, h);
    let color_at = |scale: f64, x: usize, y: usize| {
        let from_middle = |i: usize, side: f64| (i as f64 + 0.5 - 0.5 * side) / scale + 0.5 * side;
        let p = sample_cubic_clamped(frame, from_middle(x, w), from_middle(y, h));
        p.color().map(|v| v.max(0.0))
    };
    Image::from_fn(frame.width(), frame.height(), |x, y| PremulRgba {
        r: color_at(1.0 + share, x, y).r,
        b: color_at(1.0 - share, x, y).b,
        ..frame[(x, y)]
    })
}

/// Exposure and white balance.
fn apply_gain(frame: Image<PremulRgba>, finish: &PostProcess) -> Image<PremulRgba> {
    let brightening = libm::exp2(finish.exposure_ev) as f32;
    let gain = finish.white_balance.scale(brightening);
    // Finite, since an infinite gain would make NaN of black.
    let gain = gain.map(|gain| gain.min(f32::MAX));
    if gain == LinearRgb::WHITE {
        return frame;
    }
    work::add(Kind::Filters, 1);
    frame.map(|p| with_color(p, p.color() * gain))
}

/// An unsharp mask.
fn sharpen(frame: &Image<PremulRgba>, amount: f32) -> Image<PremulRgba> {
    let soft = gaussian_blur(frame, SHARPENING_SIGMA_PX);
    frame.zip_map(&soft, |p, s| {
        with_color(p, sharpened(p.color(), s.color(), amount))
    })
}

#[inline]
fn sharpened(color: LinearRgb, soft: LinearRgb, amount: f32) -> LinearRgb {
    let sharp = color.scale(1.0 + amount).add_scaled(-amount, soft);
    sharp.map(|v| v.max(0.0))
}

fn with_color(p: PremulRgba, LinearRgb { r, g, b }: LinearRgb) -> PremulRgba {
    PremulRgba { r, g, b, ..p }
}

struct SensorNoise {
    shot: f64,
    read: f64,
    seed: u64,
}

/// The value of [`seen_plate`] if all noise is still to be added.
const NO_PLATE: ([f32; 3], [f32; 3]) = ([0.0; 3], [0.0; 3]);

/// Factor on the plate at a pixel, and the plate; black if there is none.
#[inline(always)]
fn seen_plate(
    effect: &Effect<'_>,
    plate: Option<&Image<LinearRgb>>,
    at: (usize, usize),
    pixel: PremulRgba,
) -> ([f32; 3], [f32; 3]) {
    match plate {
        Some(plate) => (effect.passes_at(at).into(), plate[at].into()),
        None => ([1.0 - pixel.a; 3], [0.0; 3]),
    }
}

impl SensorNoise {
    /// The noise of cards; none if no noise is added.
    fn of_cards(finish: &PostProcess) -> Option<Self> {
        match finish.noise {
            Noise::Known { shot, read } => Self::new(shot, read, noise_seeds(finish)[0]),
            Noise::None | Noise::MatchPlate => None,
        }
    }

    /// The noise of the whole frame; none if no noise is added.
    fn of_camera(finish: &PostProcess) -> Option<Self> {
        let CameraNoise { shot, read } = finish.camera_noise;
        Self::new(shot, read, noise_seeds(finish)[1])
    }

    fn new(shot: f64, read: f64, seed: u64) -> Option<Self> {
        (shot > 0.0 || read > 0.0).then_some(Self { shot, read, seed })
    }

    /// Adds noise to a frame. `seen` gives, for a pixel, the factor on a plate that has this noise
    /// already, and that plate.
    fn add_to(
        &self,
        frame: &Image<PremulRgba>,
        seen: impl Fn((usize, usize), PremulRgba) -> ([f32; 3], [f32; 3]) + Sync,
    ) -> Image<PremulRgba> {
        work::add(Kind::NoisyPixels, frame.pixels().len() as u64);
        Image::from_fn(frame.width(), frame.height(), |x, y| {
            let p = frame[(x, y)];
            let index = (y * frame.width() + x) as u64;
            with_color(p, self.noisy_color(p.color(), seen((x, y), p), index))
        })
    }

    /// A colour with noise; `index` is the number of its pixel in the frame.
    #[inline(always)]
    fn noisy_color(
        &self,
        color: LinearRgb,
        (passes, behind): ([f32; 3], [f32; 3]),
        index: u64,
    ) -> LinearRgb {
        let values: [f32; 3] = color.into();
        let missing: [f64; 3] =
            std::array::from_fn(|c| self.missing_variance(values[c], passes[c], behind[c]));
        if missing.iter().all(|variance| *variance <= 0.0) {
            return color;
        }
        let mut rng = SplitMix64::seed_from_u64(self.seed.wrapping_add(index));
        let noisy: [f32; 3] = std::array::from_fn(|c| {
            let deviate: f64 = StandardNormal.sample(&mut rng);
            (f64::from(values[c]) + missing[c].max(0.0).sqrt() * deviate) as f32
        });
        noisy.into()
    }

    /// Variance that a value should have and that the visible plate does not contribute.
    #[inline(always)]
    fn missing_variance(&self, value: f32, passes: f32, plate: f32) -> f64 {
        let share = f64::from(passes);
        self.variance(value) - share * share * self.variance(plate)
    }

    #[inline(always)]
    fn variance(&self, value: f32) -> f64 {
        self.shot * f64::from(value).max(0.0) + self.read * self.read
    }
}

/// Independent seeds of the noise of cards and of the camera.
fn noise_seeds(finish: &PostProcess) -> [u64; 2] {
    let mut rng = SplitMix64::seed_from_u64(finish.noise_seed);
    std::array::from_fn(|_| rng.next_u64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composite::frame;
    use crate::deep::DeepSample;
    use crate::pixel::{Depth, ObjectId};

    /// The left half bare plate, the right half an opaque card of 0.5.
    fn deep(size: usize) -> DeepImage {
        let card = DeepSample {
            object: ObjectId(1),
            depth: Depth(1.0),
            light: LinearRgb::grey(0.5),
            alpha: 1.0,
            visible: 1.0,
        };
        let list = |i: usize| {
            if i % size < size / 2 {
                vec![]
            } else {
                vec![card]
            }
        };
        DeepImage::from_pixels(
            Image::filled(size, size, LinearRgb::WHITE),
            (0..size * size).map(list),
        )
    }

    fn finished(change: PostProcess) -> (Image<PremulRgba>, Image<PremulRgba>) {
        let deep = deep(64);
        let plate = Image::from_fn(64, 64, |x, y| {
            LinearRgb::grey(0.1 + 0.01 * ((x + y) % 7) as f32)
        });
        let before = frame(&deep, Some(&plate));
        (before.clone(), finish(before, &deep, Some(&plate), &change))
    }

    #[test]
    fn nothing_asked_leaves_every_bit() {
        let (before, after) = finished(PostProcess::default());
        assert_eq!(before, after);
    }

    #[test]
    fn noise_falls_on_cards_alone_with_the_variance_given() {
        let noise = Noise::Known {
            shot: 0.002,
            read: 0.01,
        };
        let (before, after) = finished(PostProcess {
            noise,
            noise_seed: 5,
            ..PostProcess::default()
        });
        let differences = |columns: std::ops::Range<usize>| -> Vec<f64> {
            let pixels = (0..64).flat_map(|y| columns.clone().map(move |x| (x, y)));
            pixels
                .flat_map(|at| [after[at].r - before[at].r, after[at].b - before[at].b])
                .map(f64::from)
                .collect()
        };
        assert!(differences(0..32).iter().all(|d| *d == 0.0));
        let noise = differences(32..64);
        let variance = noise.iter().map(|d| d * d).sum::<f64>() / noise.len() as f64;
        // 4096 values: the variance's own standard deviation is 2.2 %.
        assert!(
            (variance / (0.002 * 0.5 + 0.0001) - 1.0).abs() < 0.1,
            "{variance}"
        );
        let mean = noise.iter().sum::<f64>() / noise.len() as f64;
        assert!(
            mean.abs() < 4.0 * (variance / noise.len() as f64).sqrt(),
            "{mean}"
        );
    }

    #[test]
    fn noise_of_the_camera_falls_everywhere_and_is_another_one() {
        let camera_noise = CameraNoise {
            shot: 0.0,
            read: 0.01,
        };
        let (before, after) = finished(PostProcess {
            camera_noise,
            ..PostProcess::default()
        });
        let of =
            |image: &Image<PremulRgba>, x| (0..64).map(|y| image[(x, y)].g).collect::<Vec<_>>();
        let variance = (0..64).map(|x| {
            let pairs = of(&before, x).into_iter().zip(of(&after, x));
            pairs.map(|(b, a)| f64::from(a - b).powi(2)).sum::<f64>() / 64.0
        });
        // 64 values each: the standard deviation of the variance is 18 %.
        assert!(variance.into_iter().all(|v| (v / 0.0001 - 1.0).abs() < 0.9));
        let noise = Noise::Known {
            shot: 0.0,
            read: 0.01,
        };
        let cards = finished(PostProcess {
            noise,
            ..PostProcess::default()
        });
        assert_ne!(of(&cards.1, 50), of(&after, 50));
    }

    #[test]
    fn blur_of_the_camera_is_of_the_whole_frame() {
        let (before, after) = finished(PostProcess {
            camera_blur_px: 1.5,
            ..PostProcess::default()
        });
        let contrast = |image: &Image<PremulRgba>| (image[(3, 10)].g - image[(4, 10)].g).abs();
        assert!(contrast(&after) < 0.5 * contrast(&before));
    }

    #[test]
    fn red_lies_farther_out_and_blue_farther_in() {
        // A blob in every corner of the frame, two pixels wide.
        let blob = |x: usize, y: usize| {
            let off = |i: usize| (i as f64 + 0.5 - 32.0).abs() - 24.0;
            libm::exp(-(off(x).powi(2) + off(y).powi(2)) / 8.0) as f32
        };
        let frame = Image::from_fn(64, 64, |x, y| LinearRgb::grey(blob(x, y)).opaque());
        let fringed = spread_colors(&frame, 0.8);
        let place = |channel: fn(&PremulRgba) -> f32| {
            let (mut sum, mut at) = (0.0, 0.0);
            for x in 32..64 {
                let light: f32 = (32..64).map(|y| channel(&fringed[(x, y)])).sum();
                sum += f64::from(light);
                at += f64::from(light) * (x as f64 + 0.5 - 32.0);
            }
            at / sum
        };
        let (red, green, blue) = (place(|p| p.r), place(|p| p.g), place(|p| p.b));
        // In the corners, at 32 pixels on either side, it would be 0.8 / sqrt(2).
        let moved = 24.0 / 32.0 * 0.8 / 2.0_f64.sqrt();
        assert!((red - green - moved).abs() < 0.03, "{red} {green} {moved}");
        assert!(
            (green - blue - moved).abs() < 0.03,
            "{green} {blue} {moved}"
        );
    }

    #[test]
    fn another_seed_is_another_noise() {
        let of = |noise_seed| {
            finished(PostProcess {
                noise: Noise::Known {
                    shot: 0.0,
                    read: 0.01,
                },
                noise_seed,
                ..PostProcess::default()
            })
            .1
        };
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
    }

    #[test]
    fn a_stop_doubles_and_balance_scales_each_channel() {
        let white_balance = LinearRgb::new(0.5, 1.0, 2.0);
        let (before, after) = finished(PostProcess {
            exposure_ev: 1.0,
            white_balance,
            ..PostProcess::default()
        });
        let (p, q) = (before[(3, 9)], after[(3, 9)]);
        assert_eq!([q.r, q.g, q.b, q.a], [p.r, 2.0 * p.g, 4.0 * p.b, 1.0]);
    }

    #[test]
    fn noise_is_everywhere_that_of_the_plate_around_soft_cards() {
        // As bright as the card and with its noise, which is put in once more with another seed.
        let noise = Noise::Known {
            shot: 0.0,
            read: 0.01,
        };
        let noisy = |seed, blur_px, plate: &Image<LinearRgb>| {
            let change = PostProcess {
                noise,
                blur_px,
                noise_seed: seed,
                ..PostProcess::default()
            };
            finish(
                frame(&deep(64), Some(plate)),
                &deep(64),
                Some(plate),
                &change,
            )
        };
        let flat = Image::filled(64, 64, LinearRgb::grey(0.5));
        let whole = SensorNoise::new(0.0, 0.01, 7).unwrap();
        let squares = |x: usize| -> f64 {
            let columns = (0..40).map(|seed| {
                let noise = SensorNoise { seed, ..whole };
                let plate = noise.add_to(&flat.map(LinearRgb::opaque), |_, _| NO_PLATE);
                let after = noisy(seed + 100, Blur::Known(1.0), &plate.map(|p| p.color()));
                (0..64)
                    .map(|y| f64::from(after[(x, y)].g - 0.5).powi(2))
                    .sum::<f64>()
                    / 64.0
            });
            columns.sum::<f64>() / 40.0 / 1e-4
        };
        // 2560 values: a standard deviation of 2.8 %.
        for x in 27..37 {
            assert!((squares(x) - 1.0).abs() < 0.12, "{x}: {}", squares(x));
        }
    }

    #[test]
    fn blur_is_of_cards_alone() {
        let (before, after) = finished(PostProcess {
            blur_px: Blur::Known(1.0),
            ..PostProcess::default()
        });
        assert_eq!(before[(20, 30)], after[(20, 30)]);
        // Far from its edges the card stays, on its edge it is half as strong.
        assert!((after[(50, 30)].g - 0.5).abs() < 1e-6);
        let plate = before[(31, 30)].g;
        let mean = (after[(31, 30)].g + after[(32, 30)].g - plate - 0.5).abs();
        assert!(mean < 0.01 && after[(31, 30)].g > plate + 0.05, "{mean}");
    }

    #[test]
    fn sharpening_leaves_flat_parts_and_lifts_edges() {
        let (before, after) = finished(PostProcess {
            sharpening: 1.0,
            ..PostProcess::default()
        });
        assert!((after[(50, 30)].g - before[(50, 30)].g).abs() < 1e-6);
        assert!(after[(32, 30)].g > before[(32, 30)].g + 0.05);
    }
}
