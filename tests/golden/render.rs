//! Rendered frames against Cycles.
//!
//! `scene.json` is the file that Blender rendered (its conventions are those of
//! `golden/render/scene_reference.py`); `reference.exr` is the frame over the plate, scene-linear.
//! Held to the root mean square error, the bias and the share of pixels that the case states.

use crate::case::Case;
use petcomp::Quality;
use petcomp::render::{RenderOptions, check};
use petcomp::scene::cycles;
use petcomp::{Image, LinearRgb, PremulRgba, composite, io};

/// Between the default and a reference.
const GOOD: RenderOptions = RenderOptions {
    subsamples: 2,
    light_samples: 4,
    ambient_samples: 64,
    cell_px: 1.0,
    refraction: true,
};

/// The numbers that a case means by a word: a quality, or `good`.
fn sampling(name: &str) -> Result<RenderOptions, String> {
    if name == "good" {
        return Ok(GOOD);
    }
    let quality: Quality = name.parse().map_err(|e| format!("limits: {e}"))?;
    Ok(quality.into())
}

/// Renders a case and compares it with its reference.
pub(crate) fn run(case: &Case) -> Result<(), String> {
    let shot = cycles::import(case.dir.join("scene.json"), None).map_err(|e| e.to_string())?;
    check(&shot).map_err(|e| e.to_string())?;
    let reference: Image<LinearRgb> =
        io::read(case.dir.join("reference.exr")).map_err(|e| e.to_string())?;
    let limits = case
        .table
        .get("limits")
        .and_then(toml::Value::as_table)
        .ok_or("case.toml: no table `limits`")?;
    for (name, limit) in limits {
        let limit = limit
            .as_float()
            .ok_or_else(|| format!("limits.{name}: expected a number"))?;
        let options = sampling(name)?;
        judge(
            case,
            name,
            &composite::picture(&shot, &options),
            &reference,
            limit,
        )?;
    }
    Ok(())
}

fn judge(
    case: &Case,
    name: &str,
    ours: &Image<PremulRgba>,
    theirs: &Image<LinearRgb>,
    rmse: f64,
) -> Result<(), String> {
    if ours.size() != theirs.size() {
        return Err(format!(
            "{:?} pixels, reference has {:?}",
            ours.size(),
            theirs.size()
        ));
    }
    let pairs = ours.pixels().iter().zip(theirs.pixels());
    let differences: Vec<f64> = pairs
        .flat_map(|(a, b)| [a.r - b.r, a.g - b.g, a.b - b.b])
        .map(f64::from)
        .collect();
    let count = differences.len() as f64;
    let bias = differences.iter().sum::<f64>() / count;
    let error = (differences.iter().map(|d| d * d).sum::<f64>() / count).sqrt();
    let fail = bound(case, "fail")?;
    let worst = differences.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    let over = 100.0 * differences.iter().filter(|d| d.abs() > fail).count() as f64 / count;
    let measured =
        format!("{name}: rmse {error:.5}, bias {bias:+.6}, {over:.2} % over, worst {worst:.3}");
    if std::env::var_os("PETCOMP_GOLDEN_VERBOSE").is_some() {
        eprintln!("{}: {measured}", case.name);
    }
    let fine = error <= rmse && bias.abs() <= bound(case, "bias")?;
    let fine = fine && over <= bound(case, "fail_percent")?;
    let fine = fine && worst <= bound(case, "hard_fail")?;
    fine.then_some(()).ok_or(measured)
}

/// A bound of a case; each of them must be there.
fn bound(case: &Case, key: &str) -> Result<f64, String> {
    let table = case.table.get("tolerance");
    let value = table.and_then(|table| table.get(key));
    value.and_then(toml::Value::as_float).ok_or_else(|| {
        let found = value.map_or("missing".into(), toml::Value::to_string);
        format!("tolerance.{key}: {found}, expected a number like 0.02")
    })
}
