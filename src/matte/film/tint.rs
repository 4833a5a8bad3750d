//! The plastic of a photo: which dye, and how much of it, told from the pixels that reflect least.

use super::bright::is_screen;
use crate::image::Image;
use crate::matte::plate::ScreenPlate;
use crate::pixel::{Coverage, LinearRgb};

/// Plastic where it lies flat.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tint {
    /// Its transmittance as measured: two walls looked through, and lit through.
    flat: [f32; 3],
    /// Median misfit of the pixels it was told from, in standard deviations squared.
    misfit: f32,
}

/// Transmittance of two clear walls of PET, looked through and lit through: 8 surfaces that reflect 5 to 10 % each.
pub(in crate::matte) const CLEAR: f32 = 0.56;

/// Absorbances per channel of the dyes that PET bottles have: light blue, green and brown, the fractions that
/// recyclers sort clear bottles from. Only the ratios count; the amount is fitted.
const DYES: [[f32; 3]; 3] = [[1.0, 0.32, 0.03], [1.0, 0.25, 0.78], [0.3, 0.72, 1.0]];
/// Amounts of a dye that are tried: the least that differs from clear, the most that leaves any light, the step.
const AMOUNTS: [f32; 3] = [0.3, 5.0, 0.1];
/// Least transmittance of the screen's channel; plastic that passes less cannot be told from opaque.
const LEAST: f32 = 0.005;
/// Share of the object that reflects least, and tells its tint.
pub(super) const DARKEST: f64 = 0.25;
/// Pixels that are asked for the share above, and of them for the tint.
const ASKED: [usize; 2] = [20_000, 400];
/// Share of the screen's strongest channel from which on, in the screen's shade, a pixel is bare screen: plastic passes
/// three quarters at most.
const BARE: f32 = 0.9;
/// Noise of a pixel: least, and as a share of its value.
const NOISE: [f32; 2] = [0.004, 0.05];
/// Misfit beyond which a pixel is something else than plastic.
const OUTLIER: f32 = 25.0;
/// Weight of thickness: misfit that plastic twice as see-through as it should be counts for.
const THICKNESS: f32 = 1.0;
/// Misfit by which a dye must be better than clear plastic.
const DYED: f32 = 0.4;
/// How much the light that plastic scatters has of its tint: as if it went halfway through.
const BODY: f32 = 0.5;

/// What the light scattered by the plastic itself is multiplied by, per channel; 1 for clear.
pub(super) fn body(flat: [f32; 3]) -> [f32; 3] {
    flat.map(|t| libm::powf(t / CLEAR, BODY))
}

/// The tint that explains the darkest pixels best, and how far those that explain them as well differ from it in some channel.
///
/// `asked` is the share of the object that is asked, the darkest first: all of it where a screen has no hue, since what is
/// dark there may as well be paint. Each hypothesis, clear or a dye of some amount, is held against every asked pixel: how far it is from
/// `u * flat * screen + f * body` with the best thickness factor u and reflection f that are not negative. The lowest median wins.
pub(super) fn fit(
    photo: &Image<LinearRgb>,
    plate: &ScreenPlate,
    inside: &Image<Coverage>,
    key: usize,
    asked: f64,
) -> ([f32; 3], f32) {
    let pixels = darkest(photo, plate, inside, key, asked);
    let clear = judged([CLEAR; 3], &pixels, 0.0);
    let tints = dyed()
        .filter(|flat| flat[key] >= LEAST)
        .map(|flat| judged(flat, &pixels, DYED));
    let tints: Vec<Tint> = std::iter::once(clear).chain(tints).collect();
    let best = tints.iter().fold(clear, |best, tint| {
        if tint.misfit < best.misfit {
            *tint
        } else {
            best
        }
    });
    let alike = tints
        .iter()
        .filter(|tint| tint.misfit <= best.misfit + ALIKE);
    let differs = |tint: &Tint| {
        (0..3)
            .map(|c| (tint.flat[c] - best.flat[c]).abs())
            .fold(0.0, f32::max)
    };
    (best.flat, alike.map(differs).fold(0.0, f32::max))
}

/// Misfit by which tints are as good as each other.
const ALIKE: f32 = 0.1;

/// Transmittance of flat plastic with each dye in each amount.
pub(in crate::matte) fn dyed() -> impl Iterator<Item = [f32; 3]> {
    let count = ((AMOUNTS[1] - AMOUNTS[0]) / AMOUNTS[2]) as usize;
    let amounts = (0..=count).map(|i| AMOUNTS[0] + i as f32 * AMOUNTS[2]);
    amounts.flat_map(|amount| DYES.map(|dye| dye.map(|a| CLEAR * libm::expf(-amount * a))))
}

/// A pixel of the photo and of the screen behind it.
type Pair = ([f32; 3], [f32; 3]);

/// The asked pixels: wholly inside, no bare screen, and darkest in the channels that the screen has little of.
fn darkest(
    photo: &Image<LinearRgb>,
    plate: &ScreenPlate,
    inside: &Image<Coverage>,
    key: usize,
    share: f64,
) -> Vec<Pair> {
    let is_bare = |i: usize| {
        let (pixel, screen): Pair = (photo.pixels()[i].into(), plate.image.pixels()[i].into());
        pixel[key] >= BARE * screen[key] && is_screen(pixel, screen)
    };
    let is_whole = |i: usize| inside.pixels()[i].0 >= OPAQUE && !is_bare(i);
    let whole: Vec<usize> = (0..photo.pixels().len()).filter(|&i| is_whole(i)).collect();
    let step = (whole.len() / ASKED[0]).max(1);
    let others = |i: usize| {
        let p: [f32; 3] = photo.pixels()[i].into();
        p[(key + 1) % 3] + p[(key + 2) % 3]
    };
    let mut asked: Vec<(f32, usize)> = whole
        .into_iter()
        .step_by(step)
        .map(|i| (others(i), i))
        .collect();
    asked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    asked.truncate((asked.len() as f64 * share).ceil() as usize);
    let step = (asked.len() / ASKED[1]).max(1);
    let pair = |(_, i): (f32, usize)| (photo.pixels()[i].into(), plate.image.pixels()[i].into());
    asked.into_iter().step_by(step).map(pair).collect()
}

/// Coverage from which on a pixel is wholly inside: one 8-bit code below 1.
pub(in crate::matte) const OPAQUE: f32 = 0.99;

fn judged(flat: [f32; 3], pixels: &[Pair], handicap: f32) -> Tint {
    let scattered = body(flat);
    let fits: Vec<(f32, f32)> = pixels
        .iter()
        .map(|pixel| explained(pixel, flat, scattered))
        .collect();
    let misfit = median(fits.iter().map(|fit| fit.0));
    let thickness = median(fits.iter().map(|fit| fit.1));
    Tint {
        flat,
        misfit: misfit + THICKNESS * (thickness - 1.0).powi(2) + handicap,
    }
}

/// Squared misfit of a pixel and its thickness factor, by least squares with neither coefficient negative.
fn explained((pixel, screen): &Pair, flat: [f32; 3], scattered: [f32; 3]) -> (f32, f32) {
    let noise = pixel.map(|p| NOISE[0] + NOISE[1] * p.max(0.0));
    let through: [f32; 3] = std::array::from_fn(|c| flat[c] * screen[c] / noise[c]);
    let body: [f32; 3] = std::array::from_fn(|c| scattered[c] / noise[c]);
    let seen: [f32; 3] = std::array::from_fn(|c| pixel[c] / noise[c]);
    let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (aa, bb, ab) = (
        dot(&through, &through),
        dot(&body, &body),
        dot(&through, &body),
    );
    let (sa, sb) = (dot(&seen, &through), dot(&seen, &body));
    let determinant = (aa * bb - ab * ab).max(f32::MIN_POSITIVE);
    let u = ((sa * bb - sb * ab) / determinant).clamp(0.0, THICKEST);
    let f = ((sb - u * ab) / bb.max(f32::MIN_POSITIVE)).max(0.0);
    let u = ((sa - f * ab) / aa.max(f32::MIN_POSITIVE)).clamp(0.0, THICKEST);
    let misfit: f32 = (0..3)
        .map(|c| (seen[c] - u * through[c] - f * body[c]).powi(2))
        .sum();
    (misfit.min(OUTLIER), u)
}

/// Flat plastic passes at most so many times what two walls do.
const THICKEST: f32 = 1.3;

fn median(values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<f32> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        0.0
    } else {
        *values.select_nth_unstable_by(middle, f32::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.045, 0.42, 0.085);
    const BLUE: LinearRgb = LinearRgb::new(0.03, 0.095, 0.52);

    /// Plastic of one tint with glints, on a screen.
    fn photo(flat: [f32; 3], screen: LinearRgb) -> Image<LinearRgb> {
        let b = body(flat);
        Image::from_fn(60, 40, |x, y| {
            let (thick, haze) = (0.9 + 0.002 * x as f32, 0.01 + 0.002 * y as f32);
            let k: [f32; 3] = screen.into();
            std::array::from_fn(|c| thick * flat[c] * k[c] + haze * b[c]).into()
        })
    }

    fn found(flat: [f32; 3], screen: LinearRgb, key: usize) -> [f32; 3] {
        let plate = ScreenPlate::even(screen, (60, 40));
        fit(
            &photo(flat, screen),
            &plate,
            &Image::filled(60, 40, Coverage(1.0)),
            key,
            DARKEST,
        )
        .0
    }

    #[test]
    fn clear_plastic_is_clear_on_any_screen() {
        assert_eq!(found([0.56; 3], GREEN, 1), [CLEAR; 3]);
        assert_eq!(found([0.52; 3], BLUE, 2), [CLEAR; 3]);
    }

    #[test]
    fn the_tint_of_plastic_of_the_screens_hue_is_unsure_and_known_to_be() {
        let unsure = |flat: [f32; 3], screen, key| {
            let plate = ScreenPlate::even(screen, (60, 40));
            fit(
                &photo(flat, screen),
                &plate,
                &Image::filled(60, 40, Coverage(1.0)),
                key,
                DARKEST,
            )
            .1
        };
        for green in [[0.05, 0.3, 0.09], [0.03, 0.27, 0.06]] {
            let [on_green, on_blue] = [unsure(green, GREEN, 1), unsure(green, BLUE, 2)];
            assert!(on_green > 0.08 && on_blue < 0.03, "{on_green} {on_blue}");
        }
        assert!(unsure([CLEAR; 3], GREEN, 1) < 0.03 && unsure([CLEAR; 3], BLUE, 2) < 0.03);
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
        let (key, all) = (1, Image::filled(60, 40, Coverage(1.0)));
        let plate = ScreenPlate::even(GREEN, (60, 40));
        assert_eq!(fit(&plate.image, &plate, &all, key, DARKEST).0, [CLEAR; 3]);
        // Half of the mask is a brown bottle: the other half says nothing of it.
        let (bottle, flat) = (photo([0.17, 0.05, 0.015], GREEN), [0.17, 0.05, 0.015]);
        let half = Image::from_fn(60, 40, |x, y| if x < 30 { bottle[(x, y)] } else { GREEN });
        let told = fit(&half, &plate, &all, key, DARKEST).0;
        assert!((0..3).all(|c| (told[c] - flat[c]).abs() < 0.06), "{told:?}");
    }
}
