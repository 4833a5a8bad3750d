//! Key colour: one colour for the screen, and whether the object has it, too.

use super::film::ColorUncertainty;
use super::median::median;
use super::prepared::longer_side;
use super::screen::{masked_pixels, screen_color, screen_pixels, strongest_channel};
use crate::diagnostic::Diagnostic;
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, LinearRgb};
use serde::{Deserialize, Serialize};

/// How the pixels of a screen become one colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeyAverage {
    /// The mean, as the paper has it: what lies on the screen counts.
    Mean,
    /// The mean of what is near the median: dirt, shadows and markers do not count.
    #[default]
    Robust,
}

/// The colour of a screen.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyColor {
    /// Scene-linear.
    pub color: LinearRgb,
    /// Standard deviation of the pixels around it, per channel, by their median distance: noise
    /// and uneven light.
    pub spread: LinearRgb,
    /// A warning where the object has the screen's hue.
    pub diagnostics: Vec<Diagnostic>,
}

/// The colour of the screen, from the pixels outside `mask` and a margin around it.
///
/// `photo` is scene-linear.
///
/// # Method
/// Channel by channel the median, then the mean weighted by [Tukey]'s biweight around it.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) when the mask leaves no background.
/// # Panics
/// When the sizes differ.
///
/// [Tukey]: https://doi.org/10.1080/03610927708827533
pub fn key_color(
    photo: &Image<LinearRgb>,
    mask: &Image<Coverage>,
    average: KeyAverage,
) -> Result<KeyColor> {
    let mean = screen_color(photo, mask)?;
    let background = background(mask);
    let [r, g, b] = [0, 1, 2].map(|c| robust_mean(&channel_values(photo, &background, c)));
    let color = match average {
        KeyAverage::Mean => mean,
        KeyAverage::Robust => LinearRgb::new(r.center, g.center, b.center),
    };
    let diagnostics = screen_hue(photo, mask, color).into_iter().collect();
    Ok(KeyColor {
        color,
        spread: LinearRgb::new(r.sigma, g.sigma, b.sigma),
        diagnostics,
    })
}

/// The pixels outside a mask and a margin around it; those outside the mask where the margin leaves
/// nothing.
fn background(mask: &Image<Coverage>) -> Mask {
    let far = screen_pixels(mask);
    if far.pixels().contains(&true) {
        far
    } else {
        mask.map(|c| c.0 <= 0.0)
    }
}

/// Pixels that are sampled: the median of a noise of 0.01 is known to 1e-4.
const MAX_SAMPLES: usize = 20_000;
/// Distance from the median beyond which nothing counts, in standard deviations (95 % efficient for
/// a Gaussian).
const TUKEY_SIGMAS: f32 = 4.685;
/// Standard deviation of a Gaussian over the median of its absolute values.
const SIGMA_OF_MEDIAN: f32 = 1.4826;
/// Values nearer than a code of an 8-bit picture are the same.
const MIN_SIGMA: f32 = 1e-3;

/// Values of a channel where a mask is set, thinned out; without those that are not finite.
fn channel_values(photo: &Image<LinearRgb>, set: &Mask, channel: usize) -> Vec<f32> {
    sampled_pixels(photo, set)
        .map(|p| p.channels()[channel])
        .filter(|v| v.is_finite())
        .collect()
}

fn sampled_pixels(photo: &Image<LinearRgb>, set: &Mask) -> impl Iterator<Item = LinearRgb> {
    let step = (set.count() / MAX_SAMPLES).max(1);
    masked_pixels(photo, set).step_by(step)
}

/// Location and scale of values, outliers excluded.
struct RobustMean {
    center: f32,
    sigma: f32,
}

fn robust_mean(values: &[f32]) -> RobustMean {
    let center = median_or_zero(values.iter().copied());
    let sigma = SIGMA_OF_MEDIAN * median_or_zero(values.iter().map(|v| (v - center).abs()));
    let reach = TUKEY_SIGMAS * sigma.max(MIN_SIGMA);
    RobustMean {
        center: biweight_mean(values, center, reach).unwrap_or(center),
        sigma,
    }
}

/// Tukey's weight of a deviation in units of the reach.
#[inline]
fn biweight(deviation: f32) -> f32 {
    (1.0 - deviation.powi(2)).max(0.0).powi(2)
}

/// Mean weighted by Tukey's biweight around a centre; none where no value is within reach.
fn biweight_mean(values: &[f32], center: f32, reach: f32) -> Option<f32> {
    let (mut sum, mut weights) = (0.0_f64, 0.0_f64);
    for &v in values {
        let weight = f64::from(biweight((v - center) / reach));
        sum += weight * f64::from(v);
        weights += weight;
    }
    (weights > 0.0).then(|| (sum / weights) as f32)
}

fn median_or_zero(values: impl Iterator<Item = f32>) -> f32 {
    median(values, f32::total_cmp).unwrap_or(0.0)
}

/// The screen's own excess of its strongest channel, uneven light included, is below this multiple
/// of its mean; see-through plastic shows less than that.
const SCREEN_EXCESS_FACTOR: f32 = 1.25;
/// Rim of the mask that is left out, as a share of the longer side: bare screen.
const RIM_SHARE: f64 = 0.01;
/// Share of the object below which there is no diagnostic.
const MIN_HUED_SHARE: f32 = 0.002;

/// The diagnostic of an object that has the screen's hue, brighter than the screen.
fn screen_hue(
    photo: &Image<LinearRgb>,
    mask: &Image<Coverage>,
    screen: LinearRgb,
) -> Option<Diagnostic> {
    let channel = strongest_channel(screen);
    let screen_excess = excess(screen, channel);
    let limit = SCREEN_EXCESS_FACTOR * screen_excess;
    let share = object_share(photo, mask, |p| excess(*p, channel) > limit);
    (screen_excess > 0.0 && share > MIN_HUED_SHARE).then(|| ColorUncertainty::screen_hue(share))
}

/// Share of the object's pixels for which a claim holds, its rim left out.
fn object_share(
    photo: &Image<LinearRgb>,
    mask: &Image<Coverage>,
    holds: impl Fn(&LinearRgb) -> bool,
) -> f32 {
    let interior = without_rim(mask);
    let count = masked_pixels(photo, &interior).filter(holds).count();
    count as f32 / interior.count().max(1) as f32
}

fn without_rim(mask: &Image<Coverage>) -> Mask {
    let rim_px = RIM_SHARE * longer_side(mask) as f64;
    filter::erode(&mask.map(|c| c.0 > 0.5), rim_px)
}

/// By how much a channel exceeds the larger of the two others.
fn excess(p: LinearRgb, channel: usize) -> f32 {
    let c = p.channels();
    c[channel] - c[(channel + 1) % 3].max(c[(channel + 2) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Code;

    const GREEN: LinearRgb = LinearRgb::new(0.05, 0.4, 0.1);

    fn slab(paint: LinearRgb) -> (Image<LinearRgb>, Image<Coverage>) {
        let inside = |x: usize, y: usize| (40..120).contains(&x) && (30..70).contains(&y);
        let mask = Image::from_fn(160, 100, |x, y| Coverage(f32::from(u8::from(inside(x, y)))));
        (mask.map(|c| if c.0 > 0.0 { paint } else { GREEN }), mask)
    }

    #[test]
    fn dirt_on_the_screen_moves_the_mean_and_not_the_robust_colour() {
        let (mut photo, mask) = slab(LinearRgb::WHITE);
        (0..160).for_each(|x| (0..12).for_each(|y| photo[(x, y)] = LinearRgb::WHITE));
        let far = |how| (key_color(&photo, &mask, how).unwrap().color.g - GREEN.g).abs();
        assert!(far(KeyAverage::Robust) < 1e-4 && far(KeyAverage::Mean) > 0.05);
    }

    #[test]
    fn an_object_of_the_screens_hue_is_reported() {
        let said = |paint| {
            let (photo, mask) = slab(paint);
            key_color(&photo, &mask, KeyAverage::Robust)
                .unwrap()
                .diagnostics
        };
        assert!(
            matches!(&said(LinearRgb::new(0.1, 0.7, 0.15))[..], [one] if one.code == Code::ScreenHue
                && one.message.starts_with("100.0 % of the object"))
        );
        assert!(said(LinearRgb::new(0.6, 0.6, 0.6)).is_empty());
        assert!(
            said(GREEN.scale(0.6)).is_empty(),
            "as see-through film would look"
        );
    }

    #[test]
    fn a_mask_without_background_is_refused() {
        let full = Image::filled(40, 40, Coverage(1.0));
        assert!(key_color(&Image::filled(40, 40, GREEN), &full, KeyAverage::Robust).is_err());
    }
}
