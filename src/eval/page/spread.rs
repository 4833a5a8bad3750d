//! Several runs: their mean and spread.

use crate::eval::Interval;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Mean and spread of several runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Number of runs.
    pub runs: usize,
    /// Their mean.
    pub mean: f64,
    /// Sample standard deviation; 0 for a single run.
    pub std: f64,
    /// Where the mean of many more runs would be, with 95 % confidence; none for a single run.
    pub interval: Option<Interval>,
}

impl Spread {
    /// From the values of runs, assumed to be normally distributed.
    ///
    /// # Method
    /// [Student 1908]: mean +- t * std / sqrt(n).
    ///
    /// [Student 1908]: https://doi.org/10.1093/biomet/6.1.1
    pub fn from_values(values: &[f64]) -> Self {
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let std = deviation(values, mean);
        Self {
            runs: values.len(),
            mean,
            std,
            interval: t_quantile(n - 1.0).map(|t| around(mean, t * std / n.sqrt())),
        }
    }
}

fn around(mean: f64, half_width: f64) -> Interval {
    Interval {
        value: mean,
        low: mean - half_width,
        high: mean + half_width,
    }
}

/// Student's t at 97.5 %; none without degrees of freedom.
fn t_quantile(freedom: f64) -> Option<f64> {
    let distribution = StudentsT::new(0.0, 1.0, freedom).ok()?;
    Some(distribution.inverse_cdf(0.975))
}

/// Sample standard deviation; 0 for a single value.
fn deviation(values: &[f64], mean: f64) -> f64 {
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    match values.len() {
        0 | 1 => 0.0,
        n => (squares / (n as f64 - 1.0)).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::SplitMix64;
    use rand_xoshiro::rand_core::SeedableRng;

    #[test]
    fn several_runs_give_mean_and_spread() {
        let spread = Spread::from_values(&[1.0, 2.0, 3.0]);
        assert_eq!((spread.runs, spread.mean, spread.std), (3, 2.0, 1.0));
        let one = Spread::from_values(&[0.5]);
        assert_eq!((one.mean, one.std, one.interval), (0.5, 0.0, None));
    }

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, expected) in [(1.0, 12.7062), (2.0, 4.3027), (5.0, 2.5706), (29.0, 2.0452)] {
            let t = t_quantile(freedom).unwrap();
            assert!((t - expected).abs() < 5e-5, "{freedom}: {t}");
        }
    }

    #[test]
    fn intervals_of_three_runs_hold_the_true_mean_as_often_as_they_say() {
        let mut rng = SplitMix64::seed_from_u64(0);
        let held = (0..1000).filter(|_| {
            let runs: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            let interval = Spread::from_values(&runs).interval.unwrap();
            (interval.low..=interval.high).contains(&0.0)
        });
        let held = held.count();
        assert!(held >= 930, "{held} of 1000");
    }
}
