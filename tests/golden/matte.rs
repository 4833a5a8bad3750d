//! The keyer against Blender: every bit of every output.

use crate::case::Case;
use petcomp::io::exr::read_channels;
use petcomp::matte::key::{KeyOptions, Keying, Photo, Screen};
use petcomp::matte::{
    ChannelKeyed, ScreenPoint, channel_key, chroma_key, color_spill, difference_key, keying_screen,
};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba};
use serde::de::DeserializeOwned;

/// Runs one case: keys its input and compares with what Blender made of it.
pub(crate) fn run(case: &Case) -> Result<(), String> {
    match text(case, "node")? {
        "keying" => keying(case),
        "chroma_key" => {
            let matte = chroma_key(&photo(case)?, color(case, "screen")?, &options(case)?);
            same_cut(case, &matte)
        }
        "channel_key" => {
            let ChannelKeyed { matte, cutout } = channel_key(&photo(case)?, &options(case)?);
            all([
                same_matte(case, "reference_matte.exr", &matte),
                same_image(case, "reference.exr", &cutout),
            ])
        }
        "difference_key" => {
            let clean = input(case, "second")?.ok_or("second: missing")?;
            let matte = difference_key(&photo(case)?, &clean, &options(case)?)
                .map_err(|e| e.to_string())?;
            same_cut(case, &matte)
        }
        "color_spill" => same_image(
            case,
            "reference.exr",
            &color_spill(&photo(case)?, &options(case)?),
        ),
        "keying_screen" => screen(case),
        other => Err(format!("node: \"{other}\" is not known")),
    }
}

fn keying(case: &Case) -> Result<(), String> {
    let options: KeyOptions = options(case)?;
    let photo = photo(case)?;
    let [plate, garbage, core] = ["plate", "garbage", "core"].map(|name| input(case, name));
    let (plate, garbage, core) = (plate?, garbage?, core?);
    let plate = plate.map(|p| p.map(PremulRgba::color));
    let [garbage, core] = [garbage, core].map(|m| m.map(|m| m.map(|p| Coverage(p.r))));
    let screen = match &plate {
        Some(plate) => Screen::Plate(plate),
        None => Screen::Color(color(case, "screen")?),
    };
    let mut job = Keying::new(&photo, screen);
    job = garbage.iter().fold(job, |job, m| job.with_garbage(m));
    job = core.iter().fold(job, |job, m| job.with_core(m));
    check(case, &job, &options)
}

/// The one node whose bits are not Blender's: it adds up in double precision.
fn screen(case: &Case) -> Result<(), String> {
    #[derive(serde::Deserialize)]
    struct Given {
        size: (usize, usize),
        smoothness: f64,
        points: Vec<Point>,
        tolerance: Tolerance,
    }
    #[derive(serde::Deserialize)]
    struct Point {
        at_px: [f64; 2],
        color: LinearRgb,
    }
    #[derive(serde::Deserialize)]
    struct Tolerance {
        hard_fail: f32,
    }
    let given: Given = case
        .table
        .clone()
        .try_into()
        .map_err(|e: toml::de::Error| e.to_string())?;
    let points: Vec<_> = given
        .points
        .iter()
        .map(|p| ScreenPoint {
            at_px: p.at_px.into(),
            color: p.color,
        })
        .collect();
    let plate = keying_screen(given.size, &points, given.smoothness).map_err(|e| e.to_string())?;
    let [r, g, b, _] = rgba(case, "reference.exr")?;
    let want = r
        .iter()
        .zip(&g)
        .zip(&b)
        .map(|((r, g), b)| LinearRgb::new(*r, *g, *b));
    if plate.pixels().len() != r.len() {
        return Err(format!(
            "{} pixels, expected {}",
            plate.pixels().len(),
            r.len()
        ));
    }
    let limit = given.tolerance.hard_fail;
    let channels = plate.pixels().iter().zip(want).flat_map(|(a, b)| {
        let expected = <[f32; 3]>::from(b);
        <[f32; 3]>::from(*a).into_iter().zip(expected)
    });
    let mut errors = channels.map(|(found, expected)| (found - expected).abs());
    match errors.find(|error| error.is_nan() || *error > limit) {
        None => Ok(()),
        Some(error) => Err(format!("differs by {error:e}")),
    }
}

fn check<P: Photo>(case: &Case, job: &Keying<'_, P>, options: &KeyOptions) -> Result<(), String> {
    let keyed = job.run(options).map_err(|e| e.to_string())?;
    let edges = job.edges(options).map_err(|e| e.to_string())?;
    let alone = job.matte(options).map_err(|e| e.to_string())?;
    all([
        same_matte(case, "reference_matte.exr", &keyed.matte),
        same_matte(case, "reference_edges.exr", &edges),
        same_image(case, "reference.exr", &keyed.cutout),
        same_matte(case, "reference_matte.exr", &alone),
    ])
}

fn all<const N: usize>(results: [Result<(), String>; N]) -> Result<(), String> {
    let wrong: Vec<String> = results.into_iter().filter_map(Result::err).collect();
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(wrong.join("; "))
    }
}

/// A matte, and the photo seen through it.
fn same_cut(case: &Case, matte: &Image<Coverage>) -> Result<(), String> {
    let cutout = photo(case)?.zip_map(matte, PremulRgba::masked);
    all([
        same_matte(case, "reference_matte.exr", matte),
        same_image(case, "reference.exr", &cutout),
    ])
}

fn same_matte(case: &Case, file: &str, got: &Image<Coverage>) -> Result<(), String> {
    let want = channels(case, file)?;
    same_bits(
        file,
        got.width(),
        &[(
            "matte",
            got.pixels().iter().map(|m| m.0).collect(),
            &want[0],
        )],
    )
}

fn same_image(case: &Case, file: &str, got: &Image<PremulRgba>) -> Result<(), String> {
    let [r, g, b, a] = rgba(case, file)?;
    let of = |channel: fn(&PremulRgba) -> f32| got.pixels().iter().map(channel).collect();
    let pairs = [
        ("R", of(|p| p.r), &r),
        ("G", of(|p| p.g), &g),
        ("B", of(|p| p.b), &b),
        ("A", of(|p| p.a), &a),
    ];
    same_bits(file, got.width(), &pairs)
}

/// Equal as numbers, bit by bit; of NaN only that it is one, for which NaN it is differs between
/// processors.
fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

fn same_bits(
    file: &str,
    width: usize,
    pairs: &[(&str, Vec<f32>, &Vec<f32>)],
) -> Result<(), String> {
    let (mut differing, mut first) = (0, String::new());
    for (name, got, want) in pairs {
        if got.len() != want.len() {
            return Err(format!(
                "{file}: {} values of {name}, expected {}",
                got.len(),
                want.len()
            ));
        }
        let wrong = got
            .iter()
            .zip(*want)
            .enumerate()
            .filter(|(_, (a, b))| !same(**a, **b));
        for (i, (a, b)) in wrong {
            if differing == 0 {
                first = format!(
                    "{name} at ({}, {}) is {a:?}, expected {b:?}",
                    i % width,
                    i / width
                );
            }
            differing += 1;
        }
    }
    if differing == 0 {
        Ok(())
    } else {
        Err(format!("{file}: {differing} floats differ; first {first}"))
    }
}

fn options<T: DeserializeOwned>(case: &Case) -> Result<T, String> {
    case.table
        .get("options")
        .ok_or("options: missing")?
        .clone()
        .try_into()
        .map_err(|e| format!("options: {e}"))
}

fn text<'c>(case: &'c Case, key: &str) -> Result<&'c str, String> {
    case.table
        .get(key)
        .and_then(toml::Value::as_str)
        .ok_or_else(|| format!("{key}: missing"))
}

fn color(case: &Case, key: &str) -> Result<LinearRgb, String> {
    let value = case
        .table
        .get(key)
        .ok_or_else(|| format!("{key}: missing"))?;
    value.clone().try_into().map_err(|e| format!("{key}: {e}"))
}

fn photo(case: &Case) -> Result<Image<PremulRgba>, String> {
    input(case, "input")?.ok_or_else(|| "input: missing".into())
}

/// A picture that the case names, if it does.
fn input(case: &Case, key: &str) -> Result<Option<Image<PremulRgba>>, String> {
    let Some(path) = case.table.get(key).and_then(toml::Value::as_str) else {
        return Ok(None);
    };
    petcomp::io::read(case.dir.join(path))
        .map(Some)
        .map_err(|e| e.to_string())
}

/// The float channels of a reference in the order of their names.
fn channels(case: &Case, file: &str) -> Result<Vec<Vec<f32>>, String> {
    let (_, channels) = read_channels(case.dir.join(file)).map_err(|e| e.to_string())?;
    Ok(channels.into_iter().map(|c| c.samples).collect())
}

fn rgba(case: &Case, file: &str) -> Result<[Vec<f32>; 4], String> {
    let [a, b, g, r] = channels(case, file)?
        .try_into()
        .map_err(|_| format!("{file}: expected A, B, G, R"))?;
    Ok([r, g, b, a])
}
