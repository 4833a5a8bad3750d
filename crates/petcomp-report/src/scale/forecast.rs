//! Time and memory for many pictures on many machines, from the model of one picture.

use super::{CostModel, SECONDS_PER_HOUR, ScaleMeasurements, ScalePoint, grid, missing_error};
use petcomp::Result;

/// Expected time and memory of a dataset of default pictures.
pub(super) struct Forecast {
    /// CPU seconds per picture with its cards at rest: the model's value, and the interval that
    /// contains nine in ten.
    pub(super) picture_seconds: [f64; 3],
    /// CPU seconds until its cards are at rest.
    pub(super) fall_seconds: f64,
    /// Parallel efficiency: throughput of all threads over `cores` times that of one thread.
    pub(super) efficiency: f64,
    /// Cores of a machine: the largest measured number of threads.
    pub(super) cores: usize,
    /// Core-hours in total: expected, least, most.
    pub(super) core_hours: [f64; 3],
    /// Peak memory of a process on all cores: expected, least, most, bytes.
    pub(super) bytes: [f64; 3],
}

/// Forecasts a dataset of the default pictures: 640 x 480 pixels, 12 cards that fall first.
pub(super) fn forecast(measured: &ScaleMeasurements, images: f64) -> Result<Forecast> {
    let model = CostModel::fit(measured)?;
    let (one, all) = one_and_all_threads(measured)?;
    let cores = all.case.threads;
    let fall_seconds = interpolated_fall(&measured.falls, grid::DEFAULT_PICTURE.cards);
    let efficiency = all.rate / (cores as f64 * one.rate);
    let picture_seconds = interval(model.seconds(one), model.time.spread());
    let core_hours = picture_seconds.map(|s| core_hours(images, s + fall_seconds, efficiency));
    Ok(Forecast {
        picture_seconds,
        fall_seconds,
        efficiency,
        cores,
        core_hours,
        bytes: interval(model.bytes(all), model.memory.spread()),
    })
}

fn core_hours(images: f64, seconds_each: f64, efficiency: f64) -> f64 {
    images * seconds_each / efficiency.min(1.0) / SECONDS_PER_HOUR
}

/// The default picture on one thread and on the largest number of threads.
fn one_and_all_threads(measured: &ScaleMeasurements) -> Result<(&ScalePoint, &ScalePoint)> {
    let points = measured.default_pictures();
    let one = points.iter().find(|point| point.is_single_threaded());
    let all = points.iter().max_by_key(|point| point.case.threads);
    match (one, all) {
        (Some(one), Some(all)) => Ok((one, all)),
        (None, Some(_)) => Err(missing_error("no default pictures on one thread")),
        (_, None) => Err(missing_error("no default pictures")),
    }
}

/// A value, and the same less and plus this share of it.
fn interval(value: f64, share: f64) -> [f64; 3] {
    [value, value * (1.0 - share).max(0.0), value * (1.0 + share)]
}

/// Seconds of a fall of some cards, interpolated linearly between the measured numbers.
fn interpolated_fall(falls: &[(usize, f64)], cards: usize) -> f64 {
    let below = falls.iter().rev().find(|(n, _)| *n <= cards);
    let above = falls.iter().find(|(n, _)| *n >= cards);
    match (below, above) {
        (Some(below), Some(above)) if above.0 > below.0 => between(*below, *above, cards),
        (Some((_, seconds)), _) | (None, Some((_, seconds))) => *seconds,
        (None, None) => 0.0,
    }
}

/// On the line through two falls.
fn between((a, s): (usize, f64), (b, t): (usize, f64), cards: usize) -> f64 {
    s + (t - s) * (cards - a) as f64 / (b - a) as f64
}

impl Forecast {
    /// Hours on a number of machines with [`cores`](Self::cores) cores: expected, least, most.
    pub(super) fn hours_on(&self, machines: usize) -> [f64; 3] {
        let cores = (machines * self.cores) as f64;
        self.core_hours.map(|hours| hours / cores)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::ScaleCase;
    use super::*;

    /// Measurements of a machine that follows the model exactly, with half the efficiency on two
    /// threads.
    pub(in super::super) fn measured() -> ScaleMeasurements {
        let point = |case: ScaleCase| {
            let layers = 0.01 * case.cards as f64 * case.scale * case.scale;
            let in_hand = case.megapixels() * case.threads as f64;
            let cpu_seconds =
                0.01 + case.megapixels() * (0.1 + 0.2 * layers) + 0.001 * case.cards as f64;
            let rate = if case.threads > 1 {
                1.0
            } else {
                1.0 / cpu_seconds
            };
            ScalePoint {
                case,
                layers,
                pictures: 3,
                cpu_seconds,
                rate,
                peak_bytes: 1e7 + in_hand * (1e8 + 5e7 * layers),
            }
        };
        ScaleMeasurements {
            points: grid::cases(2).into_iter().map(point).collect(),
            falls: vec![(10, 0.1), (20, 0.3)],
        }
    }

    #[test]
    fn a_forecast_multiplies_what_one_picture_takes() {
        let mut measured = measured();
        let one = measured
            .points
            .iter()
            .find(|p| p.case == grid::DEFAULT_PICTURE)
            .unwrap()
            .cpu_seconds;
        measured
            .points
            .iter_mut()
            .filter(|p| p.case.threads == 2)
            .for_each(|p| p.rate = 1.0 / one);
        let expected = forecast(&measured, 1e6).unwrap();
        assert!(
            (expected.picture_seconds[0] / one - 1.0).abs() < 1e-6
                && (expected.efficiency - 0.5).abs() < 1e-9
        );
        let hours = 1e6 * (one + 0.14) / 0.5 / 3600.0;
        assert!((expected.core_hours[0] / hours - 1.0).abs() < 1e-6);
        assert!((expected.hours_on(10)[0] / (hours / 20.0) - 1.0).abs() < 1e-6);
        assert!(expected.bytes[1] <= expected.bytes[0] && expected.bytes[0] <= expected.bytes[2]);
    }

    #[test]
    fn falls_between_those_measured_are_in_proportion() {
        let falls = [(10, 0.1), (20, 0.3)];
        assert!((interpolated_fall(&falls, 12) - 0.14).abs() < 1e-12);
        assert_eq!(
            (
                interpolated_fall(&falls, 3),
                interpolated_fall(&falls, 99),
                interpolated_fall(&[], 3)
            ),
            (0.1, 0.3, 0.0)
        );
    }

    #[test]
    fn nothing_measured_is_no_forecast() {
        assert!(
            forecast(
                &ScaleMeasurements {
                    points: vec![],
                    falls: vec![]
                },
                1e6
            )
            .is_err()
        );
    }
}
