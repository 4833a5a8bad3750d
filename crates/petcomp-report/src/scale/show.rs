//! Tables and charts of the measurements, compared with the model.

use super::{
    CostFit, CostModel, FORECAST_PICTURES, Forecast, MB_PER_BYTE, MS_PER_SECOND, ScaleCase,
    ScaleMeasurements, ScalePoint, forecast, grid,
};
use crate::columns::{Column, table_from, table_of};
use petcomp::Result;
use petcomp::plot::{Axis, Chart, Curve, Table};

/// Numbers of machines that share the pictures.
const MACHINES: [usize; 3] = [1, 10, 100];

/// Tables with their titles: all points and residuals first, then the model, threads, falls, and a
/// million pictures.
pub(crate) fn tables(measured: &ScaleMeasurements) -> Result<Vec<(String, Table)>> {
    let model = CostModel::fit(measured)?;
    let forecast = forecast(measured, FORECAST_PICTURES)?;
    let tables = [
        ("Points", points_table(measured, &model)),
        ("Cost model", prices_table(&model)),
        ("Threads", threads_table(measured)),
        ("Falls", falls_table(measured)),
        ("A million pictures", forecast_table(&forecast)),
    ];
    Ok(tables
        .map(|(title, table)| (title.to_owned(), table))
        .into())
}

/// A point, compared with the model's prediction.
struct ModelledPoint {
    point: ScalePoint,
    seconds: f64,
    /// Residual and unseen residual; time is fitted to points on one thread.
    time: Option<[f64; 2]>,
    bytes: f64,
    memory_residual: f64,
}

const POINT_COLUMNS: [Column<ModelledPoint>; 13] = [
    ("threads", |m| m.point.case.threads.to_string()),
    ("image", |m| image_words(m.point.case.image)),
    ("Mpx", |m| format!("{:.2}", m.point.case.megapixels())),
    ("cards", |m| m.point.case.cards.to_string()),
    ("layers", |m| format!("{:.3}", m.point.layers)),
    ("CPU s per picture", |m| {
        format!("{:.4}", m.point.cpu_seconds)
    }),
    ("model", |m| format!("{:.4}", m.seconds)),
    ("residual %", |m| {
        m.time.map_or(String::new(), |[seen, _]| percent(seen))
    }),
    ("held-out %", |m| {
        m.time.map_or(String::new(), |[_, unseen]| percent(unseen))
    }),
    ("pictures/s", |m| format!("{:.2}", m.point.rate)),
    ("peak MB", |m| megabytes(m.point.peak_bytes)),
    ("model MB", |m| megabytes(m.bytes)),
    ("residual MB %", |m| percent(m.memory_residual)),
];

fn image_words([w, h]: [u32; 2]) -> String {
    format!("{w} x {h}")
}

fn percent(share: f64) -> String {
    format!("{:+.1}", 100.0 * share)
}

fn megabytes(bytes: f64) -> String {
    format!("{:.0}", bytes * MB_PER_BYTE)
}

fn points_table(measured: &ScaleMeasurements, model: &CostModel) -> Table {
    let mut single = model.time.residuals.iter().zip(&model.time.unseen);
    let mut modelled = Vec::new();
    for (point, memory) in measured.points.iter().zip(&model.memory.residuals) {
        let is_fitted = point.is_single_threaded();
        let time = if is_fitted { single.next() } else { None };
        modelled.push(ModelledPoint {
            point: point.clone(),
            seconds: model.seconds(point),
            time: time.map(|(seen, unseen)| [*seen, *unseen]),
            bytes: model.bytes(point),
            memory_residual: *memory,
        });
    }
    table_of(&POINT_COLUMNS, &modelled)
}

fn prices_table(model: &CostModel) -> Table {
    let lines = [
        price_lines(&model.time, "CPU time", price_in_ms),
        price_lines(&model.memory, "memory", price_in_mb),
        vec![spread_line(&model.time, "CPU time")],
        vec![spread_line(&model.memory, "memory")],
    ];
    table_from(["each", "takes", "of"], lines.concat())
}

fn price_in_ms(seconds: f64) -> String {
    format!("{:.4} ms", MS_PER_SECOND * seconds)
}

fn price_in_mb(bytes: f64) -> String {
    format!("{:.3} MB", bytes * MB_PER_BYTE)
}

fn price_lines(fit: &CostFit, cost: &str, words: fn(f64) -> String) -> Vec<[String; 3]> {
    let prices = fit.terms.iter().zip(&fit.prices);
    prices
        .map(|(term, price)| [(*term).to_owned(), words(*price), cost.to_owned()])
        .collect()
}

fn spread_line(fit: &CostFit, cost: &str) -> [String; 3] {
    [
        "nine in ten held-out points".into(),
        format!("within {:.0} %", 100.0 * fit.spread()),
        cost.to_owned(),
    ]
}

const THREAD_TITLES: [&str; 6] = [
    "threads",
    "pictures/s",
    "speed-up",
    "efficiency %",
    "CPU s per picture",
    "peak MB",
];

fn threads_table(measured: &ScaleMeasurements) -> Table {
    let points = measured.default_pictures();
    let one = points.first().map_or(f64::NAN, |point| point.rate);
    let lines = points.iter().map(|point| thread_line(point, one));
    table_from(THREAD_TITLES, lines)
}

fn thread_line(point: &ScalePoint, rate_of_one: f64) -> [String; 6] {
    let (threads, speed_up) = (point.case.threads, point.rate / rate_of_one);
    [
        threads.to_string(),
        format!("{:.2}", point.rate),
        format!("{speed_up:.2}"),
        format!("{:.0}", 100.0 * speed_up / threads as f64),
        format!("{:.4}", point.cpu_seconds),
        megabytes(point.peak_bytes),
    ]
}

fn falls_table(measured: &ScaleMeasurements) -> Table {
    let lines = measured
        .falls
        .iter()
        .map(|(cards, seconds)| [cards.to_string(), format!("{:.1}", MS_PER_SECOND * seconds)]);
    table_from(
        ["cards that fall together", "CPU ms until they are at rest"],
        lines,
    )
}

fn forecast_table(forecast: &Forecast) -> Table {
    let lines = [picture_lines(forecast), machine_lines(forecast)].concat();
    table_from(["a million pictures", "expected (nine in ten)"], lines)
}

fn picture_lines(forecast: &Forecast) -> Vec<[String; 2]> {
    let ScaleCase { image, cards, .. } = grid::DEFAULT_PICTURE;
    let image = image_words(image);
    let ms = forecast.picture_seconds.map(|s| MS_PER_SECOND * s);
    let fall_ms = MS_PER_SECOND * forecast.fall_seconds;
    vec![
        ["picture".into(), format!("{image}, {cards} cards")],
        ["CPU ms per picture".into(), interval_words(ms, 1)],
        [
            "CPU ms until its cards are at rest".into(),
            format!("{fall_ms:.1}"),
        ],
    ]
}

fn machine_lines(forecast: &Forecast) -> Vec<[String; 2]> {
    let cores = forecast.cores;
    let mut lines = vec![
        [
            format!("efficiency of {cores} threads"),
            format!("{:.0} %", 100.0 * forecast.efficiency),
        ],
        ["core-hours".into(), interval_words(forecast.core_hours, 0)],
    ];
    lines.extend(MACHINES.map(|machines| hours_line(forecast, machines)));
    lines.push([
        format!("memory of a process of {cores} threads, MB"),
        interval_words(forecast.bytes.map(|b| b * MB_PER_BYTE), 0),
    ]);
    lines
}

fn hours_line(forecast: &Forecast, machines: usize) -> [String; 2] {
    let (plural, cores) = (if machines == 1 { "" } else { "s" }, forecast.cores);
    [
        format!("hours on {machines} machine{plural} of {cores} cores"),
        interval_words(forecast.hours_on(machines), 2),
    ]
}

fn interval_words([value, least, most]: [f64; 3], digits: usize) -> String {
    format!("{value:.digits$} ({least:.digits$} to {most:.digits$})")
}

/// Charts with their captions: throughput by threads and memory; time by pixels and by cards.
pub(crate) fn charts(measured: &ScaleMeasurements) -> Result<Vec<(String, String)>> {
    let model = CostModel::fit(measured)?;
    let sizes = by_sizes(measured);
    let machine = [rate_chart(measured), memory_chart(&sizes, &model)];
    let cards = by_cards(measured);
    let time = [
        time_chart(MEGAPIXELS, &sizes, &model),
        time_chart(CARD_COUNT, &cards, &model),
    ];
    Ok(vec![
        (Chart::row(&machine), "Left: every thread renders a picture of its own; the model is one thread times their \
                                number. Right: one picture at a time.".into()),
        (Chart::row(&time), "One thread: rendered, labelled, encoded, written; cards already at rest. By pixels with \
                             12 cards, by cards at 640 x 480.".into()),
    ])
}

/// The variable of a chart's axis: its name, and its value for a point.
type Along = (&'static str, fn(&ScalePoint) -> f64);

const MEGAPIXELS: Along = ("megapixels", |p| p.case.megapixels());
const CARD_COUNT: Along = ("cards", |p| p.case.cards as f64);
const THREAD_COUNT: Along = ("threads", |p| p.case.threads as f64);

/// Points on one thread that differ only in their size.
fn by_sizes(measured: &ScaleMeasurements) -> Vec<&ScalePoint> {
    let ScaleCase { cards, scale, .. } = grid::DEFAULT_PICTURE;
    let mut points = measured.single_threaded();
    points.retain(|p| (p.case.cards, p.case.scale) == (cards, scale));
    points
}

/// Points on one thread that differ only in their number of cards.
fn by_cards(measured: &ScaleMeasurements) -> Vec<&ScalePoint> {
    let ScaleCase { image, scale, .. } = grid::DEFAULT_PICTURE;
    let mut points = measured.single_threaded();
    points.retain(|p| (p.case.image, p.case.scale) == (image, scale));
    points
}

fn rate_chart(measured: &ScaleMeasurements) -> Chart {
    let points = measured.default_pictures();
    let one = points.first().map_or(1.0, |point| point.rate);
    let curves = [
        curve_of(&points, THREAD_COUNT, |p| p.rate),
        curve_of(&points, THREAD_COUNT, |p| one * p.case.threads as f64),
    ];
    model_chart("pictures per second", THREAD_COUNT.0, curves)
}

fn memory_chart(points: &[&ScalePoint], model: &CostModel) -> Chart {
    let curves = [
        curve_of(points, MEGAPIXELS, |p| p.peak_bytes * MB_PER_BYTE),
        curve_of(points, MEGAPIXELS, |p| model.bytes(p) * MB_PER_BYTE),
    ];
    model_chart("peak MB", MEGAPIXELS.0, curves)
}

fn time_chart(along: Along, points: &[&ScalePoint], model: &CostModel) -> Chart {
    let curves = [
        curve_of(points, along, |p| p.cpu_seconds),
        curve_of(points, along, |p| model.seconds(p)),
    ];
    model_chart("CPU s per picture", along.0, curves)
}

fn curve_of(points: &[&ScalePoint], (_, x): Along, y: impl Fn(&ScalePoint) -> f64) -> Curve {
    let mut curve: Curve = points.iter().map(|point| [x(point), y(point)]).collect();
    curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
    curve
}

/// A chart of measured and expected values.
fn model_chart(up: &str, across: &str, curves: [Curve; 2]) -> Chart {
    let places = curves.concat();
    Chart {
        title: format!("{up} by {across}"),
        names: ["measured", "model"].map(String::from).into(),
        across: Axis::over_decades(across, places.iter().map(|p| p[0])),
        up: Axis::over_decades(up, places.iter().map(|p| p[1])),
        curves: curves.into(),
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
        let rows = threads_table(&measured).rows;
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
