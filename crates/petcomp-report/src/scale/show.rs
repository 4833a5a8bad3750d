//! Tables and charts of what was measured, beside what the model says.

use super::{CostModel, ScaleMeasurements, ScalePoint, forecast, grid};
use petcomp::Result;
use petcomp::plot::{Axis, Chart, Curve, Table};

/// Pictures that are forecast.
const MILLION: f64 = 1e6;
/// Machines that share them.
const MACHINES: [usize; 3] = [1, 10, 100];
const MB: f64 = 1e-6;

/// Tables with their titles: all points and residuals first, then the model, threads, falls, and a million pictures.
///
/// # Errors
/// As [`CostModel::fit`] and [`forecast()`].
pub fn tables(measured: &ScaleMeasurements) -> Result<Vec<(String, Table)>> {
    let model = CostModel::fit(measured)?;
    let titled = |title: &str, table| (title.to_owned(), table);
    Ok(vec![
        titled("Points", points(measured, &model)),
        titled("Cost model", prices(&model)),
        titled("Threads", threads(measured)),
        titled("Falls", falls(measured)),
        titled("A million pictures", million(measured)?),
    ])
}

fn points(measured: &ScaleMeasurements, model: &CostModel) -> Table {
    let mut table = Table::new([
        "threads",
        "image",
        "Mpx",
        "cards",
        "layers",
        "CPU s a picture",
        "model",
        "residual %",
        "unseen %",
        "pictures/s",
        "peak MB",
        "model MB",
        "residual MB %",
    ]);
    let percent = |share: f64| format!("{:+.1}", 100.0 * share);
    let mut alone = model.time.residuals.iter().zip(&model.time.unseen);
    for (point, memory) in measured.points.iter().zip(&model.memory.residuals) {
        let ScalePoint {
            case,
            layers,
            cpu_seconds,
            rate,
            peak_bytes,
            ..
        } = point;
        // Time is fitted to points on one thread.
        let time = if case.threads == 1 {
            alone.next()
        } else {
            None
        };
        table.push([
            case.threads.to_string(),
            format!("{} x {}", case.image[0], case.image[1]),
            format!("{:.2}", case.megapixels()),
            case.cards.to_string(),
            format!("{layers:.3}"),
            format!("{cpu_seconds:.4}"),
            format!("{:.4}", model.seconds(point)),
            time.map_or(String::new(), |(residual, _)| percent(*residual)),
            time.map_or(String::new(), |(_, unseen)| percent(*unseen)),
            format!("{rate:.2}"),
            format!("{:.0}", peak_bytes * MB),
            format!("{:.0}", model.bytes(point) * MB),
            percent(*memory),
        ]);
    }
    table
}

fn prices(model: &CostModel) -> Table {
    let mut table = Table::new(["each", "takes", "of"]);
    let time = model.time.terms.iter().zip(&model.time.prices);
    time.for_each(|(term, price)| {
        table.push([
            (*term).to_owned(),
            format!("{:.4} ms", 1e3 * price),
            "CPU time".into(),
        ])
    });
    let memory = model.memory.terms.iter().zip(&model.memory.prices);
    memory.for_each(|(term, price)| {
        table.push([
            (*term).to_owned(),
            format!("{:.3} MB", price * MB),
            "memory".into(),
        ])
    });
    for (what, fit) in [("CPU time", &model.time), ("memory", &model.memory)] {
        let spread = format!("within {:.0} %", 100.0 * fit.spread());
        table.push([
            "nine in ten points that the fit has not seen".into(),
            spread,
            what.to_owned(),
        ]);
    }
    table
}

/// The usual picture on one thread and on more, in their order.
fn by_threads(measured: &ScaleMeasurements) -> Vec<&ScalePoint> {
    let usual = |point: &&ScalePoint| {
        grid::ScaleCase {
            threads: 1,
            ..point.case
        } == grid::USUAL
    };
    measured.points.iter().filter(usual).collect()
}

fn threads(measured: &ScaleMeasurements) -> Table {
    let mut table = Table::new([
        "threads",
        "pictures/s",
        "times one thread",
        "efficiency %",
        "CPU s a picture",
        "peak MB",
    ]);
    let points = by_threads(measured);
    let one = points.first().map_or(f64::NAN, |point| point.rate);
    for point in points {
        let (threads, times) = (point.case.threads, point.rate / one);
        table.push([
            threads.to_string(),
            format!("{:.2}", point.rate),
            format!("{times:.2}"),
            format!("{:.0}", 100.0 * times / threads as f64),
            format!("{:.4}", point.cpu_seconds),
            format!("{:.0}", point.peak_bytes * MB),
        ]);
    }
    table
}

fn falls(measured: &ScaleMeasurements) -> Table {
    let mut table = Table::new(["cards that fall together", "CPU ms until they lie"]);
    measured
        .falls
        .iter()
        .for_each(|(cards, s)| table.push([cards.to_string(), format!("{:.1}", 1e3 * s)]));
    table
}

fn million(measured: &ScaleMeasurements) -> Result<Table> {
    let told = forecast(measured, MILLION)?;
    let interval = |[value, least, most]: [f64; 3], digits: usize| {
        format!("{value:.digits$} ({least:.digits$} to {most:.digits$})")
    };
    let mut table = Table::new(["a million pictures", "expected (nine in ten)"]);
    let [w, h] = told.case.image;
    table.push([
        "picture".into(),
        format!("{w} x {h}, {} cards", told.case.cards),
    ]);
    table.push([
        "CPU ms a picture".into(),
        interval(told.picture_seconds.map(|s| 1e3 * s), 1),
    ]);
    table.push([
        "CPU ms until its cards lie".into(),
        format!("{:.1}", 1e3 * told.fall_seconds),
    ]);
    table.push([
        format!("efficiency of {} threads", told.cores),
        format!("{:.0} %", 100.0 * told.efficiency),
    ]);
    table.push(["core hours".into(), interval(told.core_hours, 0)]);
    for machines in MACHINES {
        let plural = if machines == 1 { "" } else { "s" };
        table.push([
            format!(
                "hours on {machines} machine{plural} of {} cores",
                told.cores
            ),
            interval(told.hours(machines), 2),
        ]);
    }
    table.push([
        format!("memory of a process of {} threads, MB", told.cores),
        interval(told.bytes.map(|b| b * MB), 0),
    ]);
    Ok(table)
}

/// Charts with what is to be seen in them: rate by threads and memory; time by pixels and by cards.
///
/// # Errors
/// As [`CostModel::fit`].
pub fn charts(measured: &ScaleMeasurements) -> Result<Vec<(String, String)>> {
    let model = CostModel::fit(measured)?;
    let usual = grid::USUAL;
    let alone = || {
        measured
            .points
            .iter()
            .filter(|point| point.case.threads == 1)
    };
    let sizes: Vec<_> = alone()
        .filter(|p| p.case.cards == usual.cards && p.case.scale == usual.scale)
        .collect();
    let cards: Vec<_> = alone()
        .filter(|p| p.case.image == usual.image && p.case.scale == usual.scale)
        .collect();
    let threads = by_threads(measured);
    let one = threads.first().map_or(1.0, |point| point.rate);
    let pixels = |point: &ScalePoint| point.case.megapixels();
    let rate = both(
        "pictures a second",
        "threads",
        &threads,
        |p| p.case.threads as f64,
        |p| p.rate,
        |p| one * p.case.threads as f64,
    );
    let memory = both(
        "peak MB",
        "megapixels",
        &sizes,
        pixels,
        |p| p.peak_bytes * MB,
        |p| model.bytes(p) * MB,
    );
    let by_pixels = both(
        "CPU s a picture",
        "megapixels",
        &sizes,
        pixels,
        |p| p.cpu_seconds,
        |p| model.seconds(p),
    );
    let by_cards = both(
        "CPU s a picture",
        "cards",
        &cards,
        |p| p.case.cards as f64,
        |p| p.cpu_seconds,
        |p| model.seconds(p),
    );
    Ok(vec![
        (Chart::row(&[rate, memory]), "Left: every thread makes a picture of its own; the model is as many times one thread. Right: one picture in hand.".into()),
        (Chart::row(&[by_pixels, by_cards]), "One thread: rendered, labelled, encoded, written; cards lie already. By pixels with 12 cards, by cards at 640 x 480.".into()),
    ])
}

/// A chart of measured and expected values.
fn both(
    up: &str,
    across: &str,
    points: &[&ScalePoint],
    x: impl Fn(&ScalePoint) -> f64,
    measured: impl Fn(&ScalePoint) -> f64,
    expected: impl Fn(&ScalePoint) -> f64,
) -> Chart {
    let curve = |y: &dyn Fn(&ScalePoint) -> f64| -> Curve {
        let mut curve: Curve = points.iter().map(|point| [x(point), y(point)]).collect();
        curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
        curve
    };
    let curves = vec![curve(&measured), curve(&expected)];
    let values = |axis: usize| {
        curves
            .iter()
            .flatten()
            .map(move |p| p[axis])
            .collect::<Vec<_>>()
    };
    Chart {
        title: format!("{up} by {across}"),
        names: ["measured", "model"].map(String::from).into(),
        across: Axis::over_decades(across, values(0)),
        up: Axis::over_decades(up, values(1)),
        curves,
        defaults: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::forecast::tests::measured;
    use super::*;

    #[test]
    fn every_point_has_a_line_and_residuals_belong_to_their_points() {
        let measured = measured();
        let tables = tables(&measured).unwrap();
        let points = &tables[0].1;
        assert_eq!(points.rows.len(), measured.points.len());
        for row in &points.rows {
            assert_eq!(
                row[7].is_empty(),
                row[0] != "1",
                "time is fitted on one thread alone: {row:?}"
            );
            assert!(
                row[7].is_empty() || row[7].trim_start_matches(['+', '-']) == "0.0",
                "{row:?}"
            );
        }
    }

    #[test]
    fn efficiency_is_the_share_of_so_many_threads() {
        let mut measured = measured();
        measured
            .points
            .iter_mut()
            .for_each(|p| p.rate = if p.case.threads == 2 { 15.0 } else { 10.0 });
        let rows = threads(&measured).rows;
        assert_eq!(
            (
                rows[0][3].as_str(),
                rows[1][2].as_str(),
                rows[1][3].as_str()
            ),
            ("100", "1.50", "75")
        );
    }

    #[test]
    fn charts_show_measured_and_model() {
        let charts = charts(&measured()).unwrap();
        assert!(
            charts.len() == 2
                && charts
                    .iter()
                    .all(|(svg, _)| svg.contains("measured") && !svg.contains("NaN"))
        );
    }
}
