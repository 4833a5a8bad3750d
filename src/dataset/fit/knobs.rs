//! Keys of the recipe that are ranges, each with its effect on a picture: a range is fitted by the
//! mean and the variance of that effect.

use super::measured::PixelMeasures;
use super::statistics::{
    Bootstrapped, Grouped, Moments, SAME_SIGN, Weighted, rounds, rounds_within,
};
use crate::eval::Interval;
use crate::scene::{Range, Recipe, white_balance};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// A range of the recipe and a measure of pictures that moves with it, in units in which the two
/// add up.
pub(super) struct Knob {
    /// Its path in a recipe.
    pub(super) key: &'static str,
    /// The measure's unit, in words.
    pub(super) unit: &'static str,
    /// What is measured of a picture.
    pub(super) of_picture: fn(&PixelMeasures) -> f64,
    pub(super) get: fn(&Recipe) -> Range,
    pub(super) set: fn(&mut Recipe, Range),
    /// Converts a value of the key to the measure's unit, and back.
    pub(super) to_measure: fn(f64) -> f64,
    pub(super) to_value: fn(f64) -> f64,
    /// Minimum that the key can add to the measure.
    pub(super) least: f64,
    /// Whether the measure is of neighbouring pixels: it is different for pictures of another size.
    pub(super) is_of_pixels: bool,
}

/// Camera and light of the whole picture.
pub(super) const KNOBS: [Knob; 5] = [
    Knob {
        key: "scene.finish.exposure_ev",
        unit: "EV",
        of_picture: |p| p.exposure_ev,
        get: |recipe| recipe.finish.exposure_ev,
        set: |recipe, range| recipe.finish.exposure_ev = range,
        to_measure: |ev| ev,
        to_value: |ev| ev,
        least: f64::NEG_INFINITY,
        is_of_pixels: false,
    },
    Knob {
        key: "scene.finish.white_k",
        unit: "in the logarithm of red over blue",
        of_picture: |p| p.red_over_blue,
        get: |recipe| recipe.finish.white_k,
        set: |recipe, range| recipe.finish.white_k = range,
        to_measure: log_red_over_blue,
        to_value: white_for,
        least: f64::NEG_INFINITY,
        is_of_pixels: false,
    },
    Knob {
        key: "scene.finish.camera_blur_px",
        unit: "px^2 of blur",
        of_picture: |p| p.blur,
        get: |recipe| recipe.finish.camera_blur_px,
        set: |recipe, range| recipe.finish.camera_blur_px = range,
        to_measure: |sigma| sigma * sigma,
        to_value: f64::sqrt,
        least: 0.0,
        is_of_pixels: true,
    },
    Knob {
        key: "scene.finish.camera_noise.shot",
        unit: "of variance per unit of light",
        of_picture: |p| p.shot,
        get: |recipe| recipe.finish.camera_noise.shot,
        set: |recipe, range| recipe.finish.camera_noise.shot = range,
        to_measure: |shot| shot,
        to_value: |shot| shot,
        least: 0.0,
        is_of_pixels: true,
    },
    Knob {
        key: "scene.finish.camera_noise.read",
        unit: "of variance in the dark",
        of_picture: |p| p.dark,
        get: |recipe| recipe.finish.camera_noise.read,
        set: |recipe, range| recipe.finish.camera_noise.read = range,
        to_measure: |read| read * read,
        to_value: f64::sqrt,
        least: 0.0,
        is_of_pixels: true,
    },
];

/// A slope outside these limits means that something else has moved the measure.
const SLOPES: [f64; 2] = [0.4, 2.5];

/// Range of the temperatures of a camera's white, kelvin.
const WHITES_K: [f64; 2] = [2000.0, 25_000.0];

/// Effect of a white balance on red over blue, natural logarithm.
fn log_red_over_blue(white_k: f64) -> f64 {
    let gains = white_balance(white_k);
    f64::from(gains.r / gains.b).ln()
}

/// The white with this effect, by bisection: higher ones make pictures redder.
fn white_for(wanted: f64) -> f64 {
    let [mut low, mut high] = WHITES_K;
    while high - low > 1.0 {
        let middle = (low + high) / 2.0;
        match log_red_over_blue(middle) < wanted {
            true => low = middle,
            false => high = middle,
        }
    }
    (low + high) / 2.0
}

/// Size of objects, whose measure is taken from boxes, not from pixels.
pub(super) const SCALE: Knob = Knob {
    key: "scene.scale",
    unit: "in the logarithm of the root of a box's area",
    of_picture: |_| f64::NAN,
    get: |recipe| recipe.scale,
    set: |recipe, range| recipe.scale = range,
    to_measure: f64::ln,
    to_value: f64::exp,
    least: f64::NEG_INFINITY,
    is_of_pixels: false,
};

/// Fewer real pictures do not show how much they vary.
const MIN_VARYING: usize = 20;

/// Difference of a measure between the real pictures and the recipe's.
pub(super) struct Difference {
    mean: Bootstrapped,
    /// None with few pictures.
    variance: Option<Bootstrapped>,
}

impl Difference {
    /// From values of pictures, which are resampled: the real ones, and those of the recipe by
    /// photo of the place, of which first the photos and then their pictures are drawn; none if
    /// either has none, or for a single real picture.
    pub(super) fn new(
        real: &[Vec<Weighted>],
        own: &[Vec<Vec<Weighted>>],
        seed: u64,
    ) -> Option<Self> {
        let tells_variance = real.len() >= MIN_VARYING;
        let variance = |moments: &Moments| moments.variance;
        let counts: Vec<usize> = own.iter().map(Vec::len).collect();
        // A different seed from that of the real pictures, of which there may be as many.
        let pairs = rounds(real.len(), seed).zip(rounds_within(&counts, !seed));
        let widening = widening(real.len())?;
        let [real, own] = [Grouped::new(real), Grouped::new(&own.concat())];
        let whole = [Moments::new(&real.all())?, Moments::new(&own.all())?];
        let resampled = pairs.filter_map(|(a, b)| {
            let real = Moments::new(&real.redrawn(&a))?;
            let mean = whole[0].mean + widening * (real.mean - whole[0].mean);
            Some([Moments { mean, ..real }, Moments::new(&own.redrawn(&b))?])
        });
        let resampled: Vec<[Moments; 2]> = resampled.collect();
        Some(Self {
            mean: bootstrapped(&whole, &resampled, |moments| moments.mean),
            variance: tells_variance.then(|| bootstrapped(&whole, &resampled, variance)),
        })
    }

    /// Moments with the significant differences added; none if there are none.
    fn corrected(&self, before: Moments) -> Option<Moments> {
        let [mean, variance] = [Some(&self.mean), self.variance.as_ref()].map(|difference| {
            let decided = difference.filter(|difference| difference.is_decided());
            decided.map(|difference| difference.value)
        });
        (mean.is_some() || variance.is_some()).then(|| Moments {
            mean: before.mean + mean.unwrap_or(0.0),
            variance: (before.variance + variance.unwrap_or(0.0)).max(0.0),
        })
    }

    /// Interval of the difference of the means.
    pub(super) fn mean_interval(&self) -> Interval {
        self.mean.interval()
    }
}

/// How much wider than their bootstrap the interval of the mean of a few values is; none for one.
///
/// # Method
/// The factors by which Student's interval is wider than the normal one with the variance of the
/// values ([Hesterberg 2015], section 5.1). Without it, 5 pictures of the recipe itself would change a
/// key in 7 % of cases instead of 2.5 %, and 2 in 23 %.
///
/// [Hesterberg 2015]: https://doi.org/10.1080/00031305.2015.1089789
fn widening(count: usize) -> Option<f64> {
    let n = count as f64;
    let student = StudentsT::new(0.0, 1.0, n - 1.0).ok()?;
    let normal = Normal::standard();
    let ratio = student.inverse_cdf(SAME_SIGN) / normal.inverse_cdf(SAME_SIGN);
    Some(ratio * (n / (n - 1.0)).sqrt())
}

/// Difference between one moment of the first of two samples and that of the second.
fn bootstrapped(
    whole: &[Moments; 2],
    resampled: &[[Moments; 2]],
    of: fn(&Moments) -> f64,
) -> Bootstrapped {
    let difference = |[real, own]: &[Moments; 2]| of(real) - of(own);
    Bootstrapped::new(difference(whole), resampled.iter().map(difference))
}

impl Knob {
    /// Mean and variance that the recipe's range adds to the measure.
    fn moments(&self, recipe: &Recipe) -> Moments {
        let range = (self.get)(recipe);
        let [low, high] = [range.min, range.max].map(self.to_measure);
        Moments {
            mean: (low + high) / 2.0,
            variance: (high - low).powi(2) / 12.0,
        }
    }

    /// The range whose pictures would be like the real ones; none if those give no significant
    /// reason for a change.
    pub(super) fn fitted(&self, recipe: &Recipe, difference: &Difference) -> Option<Range> {
        let wanted = difference.corrected(self.moments(recipe))?;
        self.range_of(wanted, recipe)
    }

    /// How far the measure has moved per unit of difference between two recipes' ranges; 1 if that
    /// is not known.
    pub(super) fn slope(&self, recipes: [&Recipe; 2], response: Option<&Difference>) -> f64 {
        let [before, after] = recipes.map(|recipe| self.moments(recipe).mean);
        let decided = response.filter(|response| response.mean.is_decided());
        decided.map_or(1.0, |response| {
            (response.mean.value / (after - before)).clamp(SLOPES[0], SLOPES[1])
        })
    }

    /// The range moved by the whole difference of the means, significant or not: the second step
    /// after a significant first one.
    pub(super) fn moved(
        &self,
        recipe: &Recipe,
        difference: &Difference,
        slope: f64,
    ) -> Option<Range> {
        let before = self.moments(recipe);
        let wanted = Moments {
            mean: before.mean + difference.mean.value / slope,
            ..before
        };
        self.range_of(wanted, recipe)
    }

    /// The range with these moments; none if it equals the recipe's.
    fn range_of(&self, wanted: Moments, recipe: &Recipe) -> Option<Range> {
        let half = (3.0 * wanted.variance).sqrt();
        let ends = [wanted.mean - half, wanted.mean + half].map(|end| end.max(self.least));
        let [min, max] = ends.map(|end| three_digits((self.to_value)(end)));
        let fitted = Range::new(min, max);
        (fitted != (self.get)(recipe)).then_some(fitted)
    }
}

/// A number rounded to three significant digits, which is as much as is measured.
pub(super) fn three_digits(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 12);
    let unit = 10_f64.powi(digits);
    (value * unit).round() / unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Draws;

    fn drawn(range: Range, seed: u64, count: u64) -> Vec<f64> {
        let values = (0..count).map(|k| range.draw(&Draws::new(seed, k), "v"));
        values.collect()
    }

    /// From real pictures and those of the recipe before one photo.
    fn fitted(real: &[f64], own: &[f64]) -> Option<Range> {
        let [real, own] = [real, own].map(|values| values.iter().map(|v| vec![(*v, 1.0)]));
        let (real, own): (Vec<_>, Vec<_>) = (real.collect(), own.collect());
        let difference = Difference::new(&real, &[own], 1).unwrap();
        KNOBS[0].fitted(&Recipe::default(), &difference)
    }

    #[test]
    fn a_range_is_found_from_what_it_adds() {
        let places = drawn(Range::new(-4.0, -3.0), 9, 200);
        let range = Range::new(0.5, 2.5);
        let real: Vec<f64> = (0..50)
            .map(|k| places[k as usize] + range.draw(&Draws::new(4, k), "ev"))
            .collect();
        let found = fitted(&real, &places).unwrap();
        assert!(
            (found.min - 0.5).abs() < 0.25 && (found.max - 2.5).abs() < 0.25,
            "{found:?}"
        );
    }

    #[test]
    fn what_few_pictures_leave_open_stays() {
        let places = drawn(Range::new(-4.0, -3.0), 9, 200);
        assert_eq!(fitted(&places[..6], &places), None);
    }

    #[test]
    fn pictures_of_the_recipe_itself_leave_a_range() {
        let pictures = |seed, count| drawn(Range::new(-1.0, 1.0), seed, count);
        for real in [2, 3, 5, 48] {
            let is_changed =
                |seed: &u64| fitted(&pictures(*seed, real), &pictures(!seed, 24)).is_some();
            let changed = (0..100).filter(is_changed).count();
            assert!(changed <= 10, "{changed} of 100 with {real} pictures");
        }
    }

    #[test]
    fn intervals_of_few_pictures_are_wider() {
        // Student's and the normal quantile of 98.75 % by R: qt(0.9875, n - 1), qnorm(0.9875).
        for (count, student) in [(2, 25.4517), (5, 3.4954), (20, 2.4334)] {
            let n = f64::from(count);
            let expected = student / 2.2414 * (n / (n - 1.0)).sqrt();
            let found = widening(count as usize).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-4, "{count}: {found}");
        }
        assert_eq!(widening(1), None);
    }

    #[test]
    fn white_is_found_from_what_it_does() {
        for white in [2500.0, 5000.0, 6504.0, 9000.0] {
            assert!((white_for(log_red_over_blue(white)) - white).abs() < 2.0);
        }
    }

    #[test]
    fn a_key_cannot_take_away_what_it_only_adds() {
        let real = vec![vec![(0.1, 1.0)]; 9];
        let difference = Difference::new(&real, &[vec![vec![(0.5, 1.0)]]], 1).unwrap();
        let blur = &KNOBS[2];
        assert_eq!(blur.fitted(&Recipe::default(), &difference), None);
    }

    #[test]
    fn digits_are_those_that_count() {
        let rounded = [0.000123456, 1.23456, -45678.9, 0.0].map(three_digits);
        assert_eq!(rounded, [0.000123, 1.23, -45679.0, 0.0]);
    }
}
