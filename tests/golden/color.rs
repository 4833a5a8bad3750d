//! Colour against the values that another program gave.

use crate::case::Case;
use nalgebra::Matrix3;
use petcomp::color::{self, ColorMatrix, Curve, Hsv, RgbSpace};
use serde_json::Value;

/// Runs the case named by its folder.
pub(crate) fn run(case: &Case) -> Result<(), String> {
    let path = case.dir.join("reference.json");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let reference: Value =
        serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    match case.name.as_str() {
        "curves" => curves(case, &reference),
        "spaces" => spaces(case, &reference),
        "hsv" => hsv(case, &reference),
        "shift_hsv" => shift_hsv(case, &reference),
        other => Err(format!("no runner for {other}")),
    }
}

/// How far a number may be from its reference: more than both bounds is too far.
#[derive(Clone, Copy)]
pub(crate) struct Tolerance {
    fail: f64,
    fail_relative: f64,
}

impl Tolerance {
    /// `fail` of a table of the case, and `fail_relative`, 0 without it.
    pub(crate) fn of(case: &Case, table: &str) -> Result<Self, String> {
        let bound = |key: &str| {
            let value = case.table.get(table)?.get(key)?;
            let expected = || format!("{table}.{key}: {value}, expected a number like 1e-6");
            Some(value.as_float().ok_or_else(expected))
        };
        Ok(Self {
            fail: bound("fail").ok_or_else(|| format!("{table}.fail: missing"))??,
            fail_relative: bound("fail_relative").unwrap_or(Ok(0.0))?,
        })
    }

    pub(crate) fn check(
        self,
        what: &str,
        ours: impl IntoIterator<Item = f64>,
        theirs: &[f64],
    ) -> Result<(), String> {
        let ours: Vec<f64> = ours.into_iter().collect();
        if ours.len() != theirs.len() {
            return Err(format!(
                "{what}: {} values, expected {}",
                ours.len(),
                theirs.len()
            ));
        }
        let far = |(a, b): &(&f64, &f64)| {
            let error = (*a - *b).abs();
            !(error <= self.fail || error <= self.fail_relative * b.abs())
        };
        match ours
            .iter()
            .zip(theirs)
            .enumerate()
            .find(|(_, pair)| far(pair))
        {
            Some((i, (a, b))) => Err(format!(
                "{what}: value {i} is {a:e}, expected {b:e}, {:e} apart",
                (a - b).abs()
            )),
            None => Ok(()),
        }
    }
}

fn curves(case: &Case, reference: &Value) -> Result<(), String> {
    let near = Tolerance::of(case, "tolerance")?;
    let samples = floats(&reference["samples"]);
    let ours = [
        ("srgb", Curve::Srgb),
        ("rec709", Curve::Rec709),
        ("gamma_2.2", Curve::Gamma(2.2)),
        ("gamma_2.6", Curve::Gamma(2.6)),
    ];
    for (name, curve) in ours {
        let theirs = &reference["curves"][name];
        let encoded = samples.iter().map(|&x| curve.encode(x as f32).into());
        near.check(
            &format!("{name} encoded"),
            encoded,
            &floats(&theirs["encoded"]),
        )?;
        let decoded = samples.iter().map(|&x| curve.decode(x as f32).into());
        near.check(
            &format!("{name} decoded"),
            decoded,
            &floats(&theirs["decoded"]),
        )?;
    }
    Ok(())
}

fn spaces(case: &Case, reference: &Value) -> Result<(), String> {
    let exact = Tolerance::of(case, "matrices")?;
    for (name, matrix) in reference["matrices"]
        .as_object()
        .ok_or("matrices: not a table")?
    {
        let ours = matrix_named(name).ok_or_else(|| format!("no matrix {name}"))?;
        exact.check(name, ours.transpose().iter().copied(), &floats(matrix))?;
    }
    let near = Tolerance::of(case, "tolerance")?;
    let colors = &reference["colors"];
    for (name, matrix) in [
        ("xyz", color::xyz_from_rgb(&RgbSpace::REC709).into()),
        ("acescg", ColorMatrix::acescg_from_linear()),
    ] {
        near.check(
            name,
            each_color(&colors["linear"], |c| matrix.apply(c)),
            &floats(&colors[name]),
        )?;
    }
    let back: ColorMatrix = color::rgb_from_rgb(&RgbSpace::REC709, &RgbSpace::ACESCG).into();
    near.check(
        "linear_from_acescg",
        each_color(&colors["acescg"], |c| back.apply(c)),
        &floats(&colors["linear"]),
    )
}

/// The matrix of a name like `acescg_from_rec709`.
fn matrix_named(name: &str) -> Option<Matrix3<f64>> {
    let space = |name: &str| match name {
        "rec709" => Some(RgbSpace::REC709),
        "rec2020" => Some(RgbSpace::REC2020),
        "acescg" => Some(RgbSpace::ACESCG),
        _ => None,
    };
    let (target, source) = name.split_once("_from_")?;
    let source = space(source)?;
    Some(match (target, target.strip_prefix("bradford_")) {
        ("xyz", _) => color::xyz_from_rgb(&source),
        (_, Some(target)) => color::bradford(space(target)?.white, source.white),
        _ => color::rgb_from_rgb(&space(target)?, &source),
    })
}

fn hsv(case: &Case, reference: &Value) -> Result<(), String> {
    let near = Tolerance::of(case, "tolerance")?;
    let polar = each_color(&reference["rgb"], |rgb| {
        let Hsv { h, s, v } = color::rgb_to_hsv(rgb.into());
        [h, s, v]
    });
    near.check("rgb_to_hsv", polar, &floats(&reference["hsv_of_rgb"]))?;
    let rgb = each_color(&reference["hsv"], |[h, s, v]| {
        color::hsv_to_rgb(Hsv { h, s, v }).into()
    });
    near.check("hsv_to_rgb", rgb, &floats(&reference["rgb_of_hsv"]))
}

fn shift_hsv(case: &Case, reference: &Value) -> Result<(), String> {
    let near = Tolerance::of(case, "tolerance")?;
    for shift in reference["shifts"].as_array().ok_or("shifts: not a list")? {
        let [hue, saturation, value] = ["hue_deg", "saturation", "value"]
            .map(|key| shift[key].as_f64().unwrap_or(f64::NAN) as f32);
        let ours = each_color(&reference["rgb"], |c| {
            color::shift_hsv(c.into(), hue, saturation, value).into()
        });
        near.check(
            &format!("hue {hue}, saturation {saturation}, value {value}"),
            ours,
            &floats(&shift["rgb"]),
        )?;
    }
    Ok(())
}

/// All numbers of a nested list, in order.
fn floats(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(floats).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

/// The channels of a list of colours after a function of each.
fn each_color(colors: &Value, f: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<f64> {
    let channels = floats(colors);
    channels
        .chunks_exact(3)
        .flat_map(|c| f([c[0] as f32, c[1] as f32, c[2] as f32]))
        .map(f64::from)
        .collect()
}
