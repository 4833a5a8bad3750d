//! The noise of a photograph.

use crate::filter::halve;
use crate::image::Image;
use crate::light::inner_pixels;
use crate::pixel::LinearRgb;
use crate::quantile::quantile;
use crate::scene::Noise;

/// Groups of pixels of like brightness.
const BRIGHTNESS_GROUPS: usize = 12;
/// Residuals that are looked at: with more the noise is hardly known better (by 1 % with these).
const MAX_RESIDUALS: usize = 65_536;
/// A group of fewer pixels has no noise that could be estimated.
const MIN_GROUP_PIXELS: usize = 200;
/// Texture only makes residuals larger, so the small ones show the noise: a quarter of a normal
/// distribution's magnitudes lies below 0.3186 standard deviations.
const QUARTILE_SIGMAS: f64 = 0.318_639;
/// Standard deviation of the residual of noise of standard deviation 1: the root of the mask's
/// summed squares.
const MASK_GAIN: f64 = 6.0;
/// Factor on the variance of noise when a picture is brought to its full size again.
const HALVING: f64 = 4.0;
/// Brightness at which the noise of two pictures is compared.
const MID_GREY: f64 = 0.18;
/// Variances further apart than this factor do not differ by chance.
const TAKEN_AWAY: f64 = 1.5;
/// Values from here on may be clipped.
const NEARLY_WHITE: f32 = 0.95;

/// The noise of a photograph, from its green channel: [`Noise::None`] for one that is too small.
///
/// JPEG and the denoising of phones take away the finest noise, and a photo at 94 % quality shows
/// a third of it between neighbours, but 0.7 of it between pairs of pixels: where those show clearly
/// more, they count.
///
/// # Method
/// The residual of the difference of two Laplacians, which passes over slopes and straight edges
/// (J. Immerkær, "Fast Noise Variance Estimation", 1996); its lower quartile in groups of like
/// brightness; a line through their variances.
pub fn plate_noise(plate: &Image<LinearRgb>) -> Noise {
    let fine = noise_between_pixels(plate);
    match noise_between_pixels(&halve(plate)) {
        Noise::Known { shot, read } if fine != Noise::None => {
            let coarse = Noise::Known {
                shot: HALVING * shot,
                read: HALVING.sqrt() * read,
            };
            surely_larger(coarse, fine)
        }
        _ => fine,
    }
}

/// The coarse noise where the fine one was taken away.
fn surely_larger(coarse: Noise, fine: Noise) -> Noise {
    let [found, expected] = [coarse, fine].map(|noise| noise.variance(MID_GREY));
    if found > TAKEN_AWAY * expected {
        coarse
    } else {
        fine
    }
}

/// The noise that neighbouring pixels show.
fn noise_between_pixels(plate: &Image<LinearRgb>) -> Noise {
    let mut residuals = residuals_of(plate);
    residuals.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let size = residuals.len() / BRIGHTNESS_GROUPS;
    if size < MIN_GROUP_PIXELS {
        return Noise::None;
    }
    let groups: Vec<_> = residuals.chunks_exact(size).map(group_noise).collect();
    FitSums::new(&groups).noise()
}

/// The residuals around pixels all over the plate but the outermost.
fn residuals_of(plate: &Image<LinearRgb>) -> Vec<(f32, f32)> {
    let every = plate.pixels().len().div_ceil(MAX_RESIDUALS);
    // An odd number meets all places in the blocks of 8 pixels of a JPEG.
    inner_pixels(plate.size(), 1)
        .step_by(every | 1)
        .filter_map(|(x, y)| residual_at(plate, x, y))
        .collect()
}

/// Mean and magnitude of the residual around a pixel; none near white or where something is not
/// finite.
fn residual_at(plate: &Image<LinearRgb>, x: usize, y: usize) -> Option<(f32, f32)> {
    const MASK: [f32; 9] = [1.0, -2.0, 1.0, -2.0, 4.0, -2.0, 1.0, -2.0, 1.0];
    let (mut mean, mut sum) = (0.0, 0.0);
    for (i, weight) in MASK.iter().enumerate() {
        let value = plate[(x + i % 3 - 1, y + i / 3 - 1)].g;
        mean += value / 9.0;
        sum += weight * value;
    }
    let is_clear = mean.is_finite() && sum.is_finite() && mean < NEARLY_WHITE;
    is_clear.then_some((mean, sum.abs()))
}

/// Mean brightness and variance of a group.
fn group_noise(group: &[(f32, f32)]) -> [f64; 2] {
    let sum: f64 = group.iter().map(|p| f64::from(p.0)).sum();
    let residuals = group.iter().map(|p| p.1).collect();
    let quartile = quantile(residuals, 0.25, f32::total_cmp).map_or(0.0, f64::from);
    let sigma = quartile / (QUARTILE_SIGMAS * MASK_GAIN);
    [sum / group.len() as f64, sigma * sigma]
}

/// Sums of a linear regression of variance (y) over mean (x).
struct FitSums {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl FitSums {
    fn new(groups: &[[f64; 2]]) -> Self {
        Self {
            n: groups.len() as f64,
            x: groups.iter().map(|g| g[0]).sum(),
            y: groups.iter().map(|g| g[1]).sum(),
            xx: groups.iter().map(|g| g[0] * g[0]).sum(),
            xy: groups.iter().map(|g| g[0] * g[1]).sum(),
        }
    }

    fn slope(&self) -> f64 {
        let spread = self.n * self.xx - self.x * self.x;
        if spread > 0.0 {
            (self.n * self.xy - self.x * self.y) / spread
        } else {
            0.0
        }
    }

    /// The line of least squares, neither slope nor offset negative.
    fn noise(&self) -> Noise {
        let slope = self.slope();
        let offset = (self.y - slope * self.x) / self.n;
        let (shot, dark) = match (slope > 0.0, offset > 0.0) {
            (true, true) => (slope, offset),
            (true, false) => (self.xy / self.xx.max(f64::MIN_POSITIVE), 0.0),
            (false, _) => (0.0, self.y / self.n),
        };
        Noise::Known {
            shot,
            read: dark.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::Mix;
    use crate::scene::Draws;

    /// A slope with noise of `shot * value + read^2`; sums of twelve uniform numbers are as good as
    /// normal.
    fn noisy(shot: f64, read: f64) -> Image<LinearRgb> {
        Image::from_fn(160, 120, |x, y| {
            let value = 0.05 + 0.7 * x as f64 / 160.0 + 0.05 * (y as f64 / 9.0).sin();
            let draws = Draws::new(1, (y * 160 + x) as u64);
            let normal: f64 = (0..12).map(|i| draws.unit(&i.to_string())).sum::<f64>() - 6.0;
            LinearRgb::grey((value + normal * (shot * value + read * read).sqrt()) as f32)
        })
    }

    #[test]
    fn the_noise_that_was_put_in_is_found() {
        let Noise::Known { shot, read } = plate_noise(&noisy(0.002, 0.01)) else {
            panic!("nothing found")
        };
        let at = |v: f64| (shot * v + read * read) / (0.002 * v + 0.0001);
        assert!(
            [0.1, 0.4, 0.7].iter().all(|&v| (at(v) - 1.0).abs() < 0.15),
            "{shot} {read}"
        );
    }

    /// What compression leaves: a third of the noise within blocks of four pixels, all of it between
    /// them.
    fn compressed(image: &Image<LinearRgb>) -> Image<LinearRgb> {
        let blocks = halve(image);
        Image::from_fn(image.width(), image.height(), |x, y| {
            let mean = blocks[(x / 2, y / 2)].scale(2.0 / 3.0);
            mean.add_scaled(1.0 / 3.0, image[(x, y)])
        })
    }

    #[test]
    fn compression_does_not_hide_noise() {
        let Noise::Known { shot, read } = plate_noise(&compressed(&noisy(0.002, 0.01))) else {
            panic!("nothing found")
        };
        let ratio = |v: f64| (shot * v + read * read) / (0.002 * v + 0.0001);
        assert!(
            [0.1, 0.4, 0.7]
                .iter()
                .all(|&v| (ratio(v) - 1.0).abs() < 0.3),
            "{shot} {read}"
        );
    }

    #[test]
    fn a_smooth_picture_has_none_to_speak_of() {
        let Noise::Known { shot, read } = plate_noise(&noisy(0.0, 0.0)) else {
            panic!("nothing found")
        };
        assert!(shot < 1e-6 && read < 1e-3, "{shot} {read}");
    }

    #[test]
    fn too_little_to_see_is_no_noise() {
        assert_eq!(plate_noise(&Image::new(2, 2)), Noise::None);
        assert_eq!(
            plate_noise(&Image::filled(200, 200, LinearRgb::grey(f32::NAN))),
            Noise::None
        );
    }
}
