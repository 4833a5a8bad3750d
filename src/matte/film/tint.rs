//! The plastic of a photo: which dye, and how much of it, found from the pixels that reflect least.

use super::object::OPAQUE;
use crate::image::Image;
use crate::matte::arrays::{dot, largest};
use crate::matte::plate::ScreenPlate;
use crate::matte::screen::{is_keyable, screen_shade};
use crate::pixel::{Coverage, LinearRgb};
use crate::quantile::median;

/// Plastic where it lies flat, as a photo shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tint {
    /// Its transmittance as measured: two walls looked through, and lit through.
    pub(super) flat: [f32; 3],
    /// How far what explains the photo as well, tints or opaque paint, differs from it in some
    /// channel; 0 where nothing explains it.
    pub(super) uncertainty: f32,
}

impl Tint {
    /// One without uncertainty.
    pub(super) fn certain(flat: [f32; 3]) -> Self {
        Self {
            flat,
            uncertainty: 0.0,
        }
    }
}

/// A tint that is tried.
#[derive(Clone, Copy)]
struct TintHypothesis {
    flat: [f32; 3],
    /// How the sampled pixels look as plastic of this tint, the medians.
    seen: PixelFit,
    /// Its misfit with what its thickness and a dye add.
    cost: f32,
}

/// Transmittance of two clear walls of PET, looked through and lit through: 8 surfaces that reflect
/// 5 to 10 % each.
pub(in crate::matte) const CLEAR_TRANSMITTANCE: f32 = 0.56;

/// Absorbances per channel of the dyes that PET bottles have: light blue, green and brown, the
/// fractions that recyclers sort clear bottles from. Only the ratios count; the amount is fitted.
const DYE_ABSORBANCES: [[f32; 3]; 3] = [[1.0, 0.32, 0.03], [1.0, 0.25, 0.78], [0.3, 0.72, 1.0]];
/// Amounts of a dye that are tried: the least that differs from clear, the most that leaves any
/// light, the step.
const DYE_AMOUNTS: [f32; 3] = [0.3, 5.0, 0.1];
/// Least transmittance of the screen's channel; plastic that passes less cannot be distinguished
/// from opaque.
const MIN_KEY_TRANSMITTANCE: f32 = 0.005;
/// Share of the object that reflects least, and shows its tint.
pub(super) const DARKEST_SHARE: f64 = 0.25;
/// Pixels of the object that are sampled.
pub(super) const OBJECT_SAMPLES: usize = 20_000;
/// Pixels among the darkest that are sampled for the tint.
const TINT_SAMPLES: usize = 400;
/// Share of the screen's strongest channel from which on, in the screen's shade, a pixel is bare
/// screen: plastic passes three quarters at most.
const MIN_BARE_SHARE: f32 = 0.9;
/// The same in the object's own shadow: what is darker is not told from dark plastic.
const MIN_SHADOWED_SHARE: f32 = 0.4;
/// No plastic passes more than this many times what two walls do, with the light that its folds
/// gather on the screen.
const MAX_GATHERED: f32 = 2.0;
/// Noise of a pixel as shares of the screen's strongest channel and of its own value: the tint that
/// is found depends on no exposure.
const PIXEL_NOISE: [f32; 2] = [0.01, 0.05];
/// The same at least: a black screen has no share.
const MIN_PIXEL_NOISE: f32 = 1e-6;
/// Misfit beyond which a pixel is something else than plastic.
const MAX_MISFIT: f32 = 25.0;
/// Weight of thickness: the misfit of plastic that is twice as see-through as it should be.
pub(in crate::matte) const THICKNESS_WEIGHT: f32 = 1.0;
/// Misfit by which a dye must be better than clear plastic.
pub(in crate::matte) const DYE_HANDICAP: f32 = 0.4;
/// How much the light that plastic scatters has of its tint: as if it went halfway through.
const SCATTER_DEPTH: f32 = 0.5;
/// Flat plastic passes at most this many times what two walls do.
pub(super) const MAX_THICKNESS_FACTOR: f32 = 1.3;
/// Misfit by which tints are as good as each other.
const EQUAL_MISFIT: f32 = 0.1;

// What looks like a dye may be opaque paint. The limits lie between what 24 photos of 12 rendered
// dyed bottles and simulations of 30 others have, and what simulations of 60 opaque things have, all
// of these on a green and a blue screen. 50 other opaque things and 24 bottles were not used.

/// Light that the darkest of dyed plastic scatters, were it clear, over the screen's: at most 0.17
/// on screens of 0.34 to 0.5, more on darker ones. Paint that is not almost black has 0.26 and more.
pub(super) const MAX_SCATTERED: f32 = 0.2;
/// The same on a screen so dark that plastic reflects as much as it.
const MAX_SCATTERED_ON_DARK: f32 = 0.5;
/// Misfit of a dye in plastic that has it: 2.3 at most.
const MAX_DYE_MISFIT: f32 = 3.0;
/// Misfit of plastic whose dye is none of those tried, or on a dark screen: yellow PET and rendered
/// bottles have 3.2 to 4.1 there.
const MAX_OTHER_DYE_MISFIT: f32 = 5.0;
/// Paint explains such plastic so many times worse, at least; and paint as well as the dye that it
/// is taken for.
const MIN_PAINT_MISFIT_RATIO: f32 = 4.0;
/// Thickness factor of the darkest of dyed plastic: in rendered bottles 0.37 and more. What is
/// thinner hardly shows the screen, and counts as opaque.
const MIN_DYE_THICKNESS: f32 = 0.3;
/// Misfit up to which paint explains a pixel: what noise alone leaves of three channels after one
/// factor, the median of a chi-squared distribution with two degrees of freedom.
const MAX_PAINT_MISFIT: f32 = 1.4;
/// Misfit from which on paint does not explain it: opaque things that pass for dyed have 1.8 at
/// most, blue and brown plastic on dark cloth 4.9 and more.
const MIN_NO_PAINT_MISFIT: f32 = 3.0;

/// Nothing lies on the screen there: plastic passes less of its strongest channel, `key`.
pub(in crate::matte) fn is_bare_screen(pixel: [f32; 3], screen: [f32; 3], key: usize) -> bool {
    is_screen(pixel, screen, key, MIN_BARE_SHARE)
}

/// In the screen's shade, and no darker than a share of its plate.
fn is_screen(pixel: [f32; 3], screen: [f32; 3], key: usize, least: f32) -> bool {
    pixel[key] >= least * screen[key] && screen_shade(pixel, screen).is_some()
}

/// The shade of a screen on which nothing lies, 1 where it is lit: in a shadow it is still brighter
/// than dyed plastic lets it be.
pub(super) fn bare_shade(
    pixel: [f32; 3],
    screen: [f32; 3],
    flat: [f32; 3],
    key: usize,
) -> Option<f32> {
    let shade = screen_shade(pixel, screen)?;
    let is_lit = pixel[key] >= MIN_BARE_SHARE * screen[key];
    let least_shade = MIN_SHADOWED_SHARE.max(MAX_GATHERED * flat[key]);
    match is_lit {
        true => Some(1.0),
        false => (shade > least_shade).then_some(shade.min(1.0)),
    }
}

/// What the light scattered by the plastic itself is multiplied by, per channel; 1 for clear.
pub(super) fn scattered_tint(flat: [f32; 3]) -> [f32; 3] {
    flat.map(|t| libm::powf(t / CLEAR_TRANSMITTANCE, SCATTER_DEPTH))
}

/// Transmittance of flat plastic with each dye in each amount.
pub(in crate::matte) fn dyed() -> impl Iterator<Item = [f32; 3]> {
    dye_amounts().flat_map(|amount| DYE_ABSORBANCES.map(|dye| dyed_with(amount, dye)))
}

fn dye_amounts() -> impl Iterator<Item = f32> {
    let [least, most, step] = DYE_AMOUNTS;
    let count = ((most - least) / step) as usize;
    (0..=count).map(move |i| least + i as f32 * step)
}

/// Transmittance of flat plastic with an amount of a dye: the law of Beer and Lambert.
fn dyed_with(amount: f32, absorbances: [f32; 3]) -> [f32; 3] {
    absorbances.map(|a| CLEAR_TRANSMITTANCE * libm::expf(-amount * a))
}

/// Share of the screen's light from which on a pixel shows no tint: bare screen, also where it lies
/// in the object's shadow. On boards without a hue, whatever is brighter may be plastic.
fn least_bare_share(plate: &ScreenPlate) -> f32 {
    if is_keyable(plate.color()) {
        MAX_THICKNESS_FACTOR * CLEAR_TRANSMITTANCE
    } else {
        MIN_BARE_SHARE
    }
}

/// The pixels that show a tint.
pub(super) struct TintSamples {
    /// The screen's strongest channel.
    key: usize,
    pixels: Vec<ScreenPair>,
}

/// A pixel of the photo and of the screen behind it.
#[derive(Clone, Copy)]
struct ScreenPair {
    /// Of the pixel in the photo.
    index: usize,
    pixel: [f32; 3],
    screen: [f32; 3],
}

impl TintSamples {
    /// A share of the object, the darkest first in the channels that the screen has little of:
    /// pixels wholly inside that are no bare screen. All of it where a screen has no hue, since
    /// what is dark there may as well be paint.
    pub(super) fn new(
        photo: &Image<LinearRgb>,
        plate: &ScreenPlate,
        inside: &Image<Coverage>,
        key: usize,
        share: f64,
    ) -> Self {
        let (pictures, least_bare) = ([photo, &plate.image], least_bare_share(plate));
        let object: Vec<usize> = (0..photo.pixels().len())
            .filter(|&i| inside.pixels()[i].0 >= OPAQUE)
            .filter(|&i| !ScreenPair::at(pictures, i).is_bare(key, least_bare))
            .collect();
        let sampled = thinned(object, OBJECT_SAMPLES).map(|i| ScreenPair::at(pictures, i));
        let darkest = darkest(sampled.collect(), key, share);
        Self {
            key,
            pixels: thinned(darkest, TINT_SAMPLES).collect(),
        }
    }

    /// The tint that explains the pixels best.
    ///
    /// # Method
    /// Each hypothesis, clear or a dye of some amount, is compared with every pixel: how far it is
    /// from `u * flat * screen + f * scattered` with the best thickness factor u and reflection
    /// f that are not negative. The lowest median wins. What surely is paint (see [`PaintLikelihood`]) has
    /// no dye; where paint of some colour explains the pixels as well, the tint is uncertain by all
    /// that it lets through.
    pub(super) fn fit(&self) -> Tint {
        let tried = self.hypotheses();
        let best = lowest_cost(&tried);
        match best.paint_likelihood(&tried) {
            PaintLikelihood::Sure => Tint::certain([CLEAR_TRANSMITTANCE; 3]),
            PaintLikelihood::Likely => best.or_paint(&tried, [CLEAR_TRANSMITTANCE; 3]),
            PaintLikelihood::Possible => best.or_paint(&tried, best.flat),
            PaintLikelihood::None => best.tint(&tried),
        }
    }

    /// The tint that explains the pixels best as plastic, whatever else they may be.
    pub(super) fn fit_plastic(&self) -> [f32; 3] {
        lowest_cost(&self.hypotheses()).flat
    }

    /// The median of the pixels in another picture of the photo's size; 0 where there are none.
    pub(super) fn median_of(&self, picture: &Image<f32>) -> f32 {
        let values = self.pixels.iter().map(|pair| picture.pixels()[pair.index]);
        median(values, f32::total_cmp).unwrap_or(0.0)
    }

    /// Clear plastic, and then every dye in every amount.
    fn hypotheses(&self) -> Vec<TintHypothesis> {
        let clear = self.judge([CLEAR_TRANSMITTANCE; 3], 0.0);
        let dyes = dyed()
            .filter(|flat| flat[self.key] >= MIN_KEY_TRANSMITTANCE)
            .map(|flat| self.judge(flat, DYE_HANDICAP));
        std::iter::once(clear).chain(dyes).collect()
    }

    fn judge(&self, flat: [f32; 3], handicap: f32) -> TintHypothesis {
        let scattered = scattered_tint(flat);
        let fits: Vec<PixelFit> = self
            .pixels
            .iter()
            .map(|pair| pair.explained_by(flat, scattered, self.key))
            .collect();
        let seen = PixelFit::median_of(&fits);
        TintHypothesis {
            flat,
            seen,
            cost: seen.misfit + THICKNESS_WEIGHT * (seen.thickness - 1.0).powi(2) + handicap,
        }
    }
}

/// The share of the pixels that reflects least, in that order.
fn darkest(mut pixels: Vec<ScreenPair>, key: usize, share: f64) -> Vec<ScreenPair> {
    pixels.sort_by(|a, b| a.reflected(key).total_cmp(&b.reflected(key)));
    pixels.truncate((pixels.len() as f64 * share).ceil() as usize);
    pixels
}

/// Items at equal steps, about `count` of them.
pub(super) fn thinned<T>(items: Vec<T>, count: usize) -> impl Iterator<Item = T> {
    let step = (items.len() / count).max(1);
    items.into_iter().step_by(step)
}

/// How likely it is that what looks like a dye is opaque paint.
enum PaintLikelihood {
    None,
    /// Either explains the photo, or on a dark screen both reflect as much.
    Possible,
    /// Either does, and the screen is hardly seen; or the dye is none of those tried.
    Likely,
    Sure,
}

impl TintHypothesis {
    fn paint_likelihood(&self, tried: &[Self]) -> PaintLikelihood {
        if self.flat == [CLEAR_TRANSMITTANCE; 3] {
            PaintLikelihood::None
        } else if self.seen.misfit > MAX_DYE_MISFIT {
            match self.is_other_dye() {
                true => PaintLikelihood::Likely,
                false => PaintLikelihood::Sure,
            }
        } else if self.seen.scattered > MAX_SCATTERED {
            let is_on_dark = self.seen.scattered < MAX_SCATTERED_ON_DARK;
            match is_on_dark && tried.iter().all(Self::is_unlike_paint) {
                true => PaintLikelihood::Possible,
                false => PaintLikelihood::Sure,
            }
        } else if self.seen.thickness < MIN_DYE_THICKNESS {
            PaintLikelihood::Likely
        } else if tried.iter().any(Self::is_like_paint) {
            PaintLikelihood::Possible
        } else {
            PaintLikelihood::None
        }
    }

    /// Paint that reflects as this plastic scatters explains the pixels.
    fn is_like_paint(&self) -> bool {
        self.seen.paint_misfit <= MAX_PAINT_MISFIT
    }

    /// Plastic explains the pixels, though not of this dye, and paint does not.
    fn is_other_dye(&self) -> bool {
        self.seen.misfit < MAX_OTHER_DYE_MISFIT
            && self.seen.paint_misfit > MIN_PAINT_MISFIT_RATIO * self.seen.misfit
    }

    /// No paint that reflects as this plastic scatters does.
    fn is_unlike_paint(&self) -> bool {
        self.seen.paint_misfit > MIN_NO_PAINT_MISFIT
    }

    /// This tint, as certain as those allow that explain the pixels as well.
    fn tint(&self, tried: &[Self]) -> Tint {
        Tint {
            flat: self.flat,
            uncertainty: self.uncertainty(tried),
        }
    }

    /// What is taken for `flat` where this tint and paint explain the pixels: uncertain by all that
    /// this tint lets through.
    fn or_paint(&self, tried: &[Self], flat: [f32; 3]) -> Tint {
        Tint {
            flat,
            uncertainty: self.uncertainty(tried).max(largest(self.flat)),
        }
    }

    /// The largest difference in a channel from those that explain the pixels as well; 0 where
    /// this one does not.
    fn uncertainty(&self, tried: &[Self]) -> f32 {
        // What no tint explains is no plastic, and nobody asks for its tint.
        if self.cost >= MAX_MISFIT {
            return 0.0;
        }
        let as_good = tried.iter().filter(|other| other.is_as_good_as(self));
        as_good
            .map(|other| largest_difference(other.flat, self.flat))
            .fold(0.0, f32::max)
    }

    fn is_as_good_as(&self, best: &Self) -> bool {
        self.cost <= best.cost + EQUAL_MISFIT
    }
}

/// The first of the hypotheses that explain the pixels best.
fn lowest_cost(tried: &[TintHypothesis]) -> TintHypothesis {
    let (first, rest) = (tried[0], &tried[1..]);
    rest.iter()
        .fold(first, |best, tint| match tint.cost < best.cost {
            true => *tint,
            false => best,
        })
}

fn largest_difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
}

/// How well plastic of a tint explains a pixel.
#[derive(Clone, Copy)]
struct PixelFit {
    /// In standard deviations squared.
    misfit: f32,
    /// Times that the pixel is as see-through as flat plastic.
    thickness: f32,
    /// Light that it scatters, as clear plastic would, over that of the screen's strongest channel.
    scattered: f32,
    /// The misfit of paint that reflects as this plastic scatters.
    paint_misfit: f32,
}

impl PixelFit {
    /// The median of each number.
    fn median_of(fits: &[Self]) -> Self {
        let median =
            |of: fn(&Self) -> f32| median(fits.iter().map(of), f32::total_cmp).unwrap_or(0.0);
        Self {
            misfit: median(|fit| fit.misfit),
            thickness: median(|fit| fit.thickness),
            scattered: median(|fit| fit.scattered),
            paint_misfit: median(|fit| fit.paint_misfit),
        }
    }
}

impl ScreenPair {
    #[inline]
    fn at([photo, screen]: [&Image<LinearRgb>; 2], index: usize) -> Self {
        Self {
            index,
            pixel: photo.pixels()[index].into(),
            screen: screen.pixels()[index].into(),
        }
    }

    /// See [`is_screen`].
    fn is_bare(&self, key: usize, least: f32) -> bool {
        is_screen(self.pixel, self.screen, key, least)
    }

    /// Light of the channels that the screen has little of.
    fn reflected(&self, key: usize) -> f32 {
        self.pixel[(key + 1) % 3] + self.pixel[(key + 2) % 3]
    }

    #[inline(always)]
    fn noise(&self, key: usize) -> [f32; 3] {
        let least = (PIXEL_NOISE[0] * self.screen[key]).max(MIN_PIXEL_NOISE);
        self.pixel.map(|p| least + PIXEL_NOISE[1] * p.max(0.0))
    }

    /// Least squares over the channels, in units of their noise, with neither coefficient negative.
    fn explained_by(&self, flat: [f32; 3], scattered: [f32; 3], key: usize) -> PixelFit {
        let noise = self.noise(key);
        let through = std::array::from_fn(|c| flat[c] * self.screen[c] / noise[c]);
        let body = std::array::from_fn(|c| scattered[c] / noise[c]);
        let seen = std::array::from_fn(|c| self.pixel[c] / noise[c]);
        let (thickness, reflection) = non_negative_fit(seen, through, body);
        let misfit = |thickness: f32, reflection: f32| {
            let left = (0..3).map(|c| seen[c] - thickness * through[c] - reflection * body[c]);
            left.map(|off| off.powi(2)).sum::<f32>().min(MAX_MISFIT)
        };
        PixelFit {
            misfit: misfit(thickness, reflection),
            thickness,
            scattered: reflection / self.screen[key].max(f32::MIN_POSITIVE),
            paint_misfit: misfit(
                0.0,
                dot(seen, body) / dot(body, body).max(f32::MIN_POSITIVE),
            ),
        }
    }
}

/// The factors of `through` (no more than plastic can have) and of `body` whose sum is nearest to
/// `seen`.
#[inline(always)]
fn non_negative_fit(seen: [f32; 3], through: [f32; 3], body: [f32; 3]) -> (f32, f32) {
    let (aa, bb, ab) = (dot(through, through), dot(body, body), dot(through, body));
    let (sa, sb) = (dot(seen, through), dot(seen, body));
    let determinant = (aa * bb - ab * ab).max(f32::MIN_POSITIVE);
    let u = ((sa * bb - sb * ab) / determinant).clamp(0.0, MAX_THICKNESS_FACTOR);
    let f = ((sb - u * ab) / bb.max(f32::MIN_POSITIVE)).max(0.0);
    let u = ((sa - f * ab) / aa.max(f32::MIN_POSITIVE)).clamp(0.0, MAX_THICKNESS_FACTOR);
    (u, f)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.045, 0.42, 0.085);
    const BLUE: LinearRgb = LinearRgb::new(0.03, 0.095, 0.52);

    /// Plastic of one tint with glints, on a screen.
    fn photo(flat: [f32; 3], screen: LinearRgb) -> Image<LinearRgb> {
        let b = scattered_tint(flat);
        Image::from_fn(60, 40, |x, y| {
            let (thick, haze) = (0.9 + 0.002 * x as f32, 0.01 + 0.002 * y as f32);
            let k: [f32; 3] = screen.into();
            std::array::from_fn(|c| thick * flat[c] * k[c] + haze * b[c]).into()
        })
    }

    fn fit(photo: &Image<LinearRgb>, plate: &ScreenPlate, key: usize) -> Tint {
        let all = Image::filled(60, 40, Coverage(1.0));
        TintSamples::new(photo, plate, &all, key, DARKEST_SHARE).fit()
    }

    fn found(flat: [f32; 3], screen: LinearRgb, key: usize) -> [f32; 3] {
        let plate = ScreenPlate::even(screen, (60, 40));
        fit(&photo(flat, screen), &plate, key).flat
    }

    #[test]
    fn clear_plastic_is_clear_on_any_screen() {
        assert_eq!(found([0.56; 3], GREEN, 1), [CLEAR_TRANSMITTANCE; 3]);
        assert_eq!(found([0.52; 3], BLUE, 2), [CLEAR_TRANSMITTANCE; 3]);
    }

    #[test]
    fn the_tint_of_plastic_of_the_screens_hue_is_unsure_and_known_to_be() {
        let unsure = |flat: [f32; 3], screen, key| {
            let plate = ScreenPlate::even(screen, (60, 40));
            fit(&photo(flat, screen), &plate, key).uncertainty
        };
        for green in [[0.05, 0.3, 0.09], [0.03, 0.27, 0.06]] {
            let [on_green, on_blue] = [unsure(green, GREEN, 1), unsure(green, BLUE, 2)];
            assert!(on_green > 0.08 && on_blue < 0.03, "{on_green} {on_blue}");
        }
        assert!(
            unsure([CLEAR_TRANSMITTANCE; 3], GREEN, 1) < 0.03
                && unsure([CLEAR_TRANSMITTANCE; 3], BLUE, 2) < 0.03
        );
    }

    #[test]
    fn dyes_are_told_apart_where_they_are_not_the_screens() {
        for (flat, screen, key) in [
            ([0.17, 0.38, 0.54], GREEN, 1),
            ([0.05, 0.3, 0.09], BLUE, 2),
            ([0.17, 0.05, 0.015], GREEN, 1),
        ] {
            let told = found(flat, screen, key);
            assert!(
                (0..3).all(|c| (told[c] - flat[c]).abs() < 0.06),
                "{told:?} for {flat:?}"
            );
        }
    }

    #[test]
    fn bare_screen_under_a_wide_mask_has_no_dye() {
        let plate = ScreenPlate::even(GREEN, (60, 40));
        assert_eq!(fit(&plate.image, &plate, 1).flat, [CLEAR_TRANSMITTANCE; 3]);
        // Half of the mask is a brown bottle: the other half says nothing of it.
        let (bottle, flat) = (photo([0.17, 0.05, 0.015], GREEN), [0.17, 0.05, 0.015]);
        let half = Image::from_fn(60, 40, |x, y| if x < 30 { bottle[(x, y)] } else { GREEN });
        let told = fit(&half, &plate, 1).flat;
        assert!((0..3).all(|c| (told[c] - flat[c]).abs() < 0.06), "{told:?}");
    }
}
