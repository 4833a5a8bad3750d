//! Rendered frames against Cycles.
//!
//! `scene.json` is the file that Blender rendered (its conventions are those of `golden/render/scene_reference.py`);
//! `reference.exr` is the frame over the plate, scene-linear. Held to the root mean square error, the bias and the
//! share of pixels that the case states.

use crate::case::Case;
use petcomp::geom::{Point2, Pose, Quad, UnitQuaternion, Vector2, Vector3};
use petcomp::render::{Quality, RenderOptions, cast, check};
use petcomp::scene::{AreaLight, Card, Grade, LightShape};
use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Shot, composite, io};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// Renders a case and compares it with its reference.
pub(crate) fn run(case: &Case) -> Result<(), String> {
    let shot = shot(&case.dir)?;
    check(&shot).map_err(|e| e.to_string())?;
    let reference: Image<LinearRgb> = io::read(case.dir.join("reference.exr")).map_err(|e| e.to_string())?;
    let limits = case.table.get("limits").and_then(toml::Value::as_table).ok_or("case.toml: no table `limits`")?;
    for (name, limit) in limits {
        let limit = limit.as_float().ok_or_else(|| format!("limits.{name}: expected a number"))?;
        let options = quality(name).ok_or_else(|| format!("limits.{name}: not a quality"))?.options();
        judge(case, name, &render(&shot, &options), &reference, limit)?;
    }
    Ok(())
}

fn quality(name: &str) -> Option<Quality> {
    let named = [Quality::Draft, Quality::Fast, Quality::Good, Quality::High, Quality::Reference];
    ["draft", "fast", "good", "high", "reference"].into_iter().zip(named).find_map(|(n, q)| (n == name).then_some(q))
}

fn render(shot: &Shot, options: &RenderOptions) -> Image<PremulRgba> {
    composite::frame(&cast(shot, options), shot.plate.as_deref())
}

fn judge(
    case: &Case,
    name: &str,
    ours: &Image<PremulRgba>,
    theirs: &Image<LinearRgb>,
    rmse: f64,
) -> Result<(), String> {
    if ours.size() != theirs.size() {
        return Err(format!("{:?} pixels, reference has {:?}", ours.size(), theirs.size()));
    }
    let pairs = ours.pixels().iter().zip(theirs.pixels());
    let differences: Vec<f64> = pairs.flat_map(|(a, b)| [a.r - b.r, a.g - b.g, a.b - b.b]).map(f64::from).collect();
    let count = differences.len() as f64;
    let bias = differences.iter().sum::<f64>() / count;
    let error = (differences.iter().map(|d| d * d).sum::<f64>() / count).sqrt();
    let number = |key: &str| case.table["tolerance"].get(key).and_then(toml::Value::as_float).unwrap_or(0.0);
    let worst = differences.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    let over = 100.0 * differences.iter().filter(|d| d.abs() > number("fail")).count() as f64 / count;
    let measured = format!("{name}: rmse {error:.5}, bias {bias:+.6}, {over:.2} % over, worst {worst:.3}");
    if std::env::var_os("PETCOMP_GOLDEN_VERBOSE").is_some() {
        #[expect(clippy::print_stderr, reason = "the numbers behind a pass, for whoever asks for them")]
        {
            eprintln!("{}: {measured}", case.name);
        }
    }
    let fine = error <= rmse && bias.abs() <= number("bias");
    let fine = fine && over <= number("fail_percent") && worst <= number("hard_fail");
    fine.then_some(()).ok_or(measured)
}

/// The shot that a scene file tells.
fn shot(dir: &Path) -> Result<Shot, String> {
    let text = std::fs::read_to_string(dir.join("scene.json")).map_err(|e| format!("scene.json: {e}"))?;
    let scene: Value = serde_json::from_str(&text).map_err(|e| format!("scene.json: {e}"))?;
    let plate: Image<PremulRgba> = read(dir, &scene["plate"]["path"])?;
    let mut shot = Shot::new(camera(&scene)).with_plate(Arc::new(plate.map(PremulRgba::color)));
    shot.catcher = numbers(&scene["ground"]["extent"]);
    shot.ambient = color(&scene["environment"]["color"]);
    shot.lights = array(&scene["lights"]).iter().map(light).collect();
    shot.cards = array(&scene["quads"]).iter().map(|q| card(dir, q)).collect::<Result<_, _>>()?;
    Ok(shot)
}

fn camera(scene: &Value) -> Camera {
    let c = &scene["camera"];
    let [k, r]: [[[f64; 3]; 3]; 2] = ["K", "R"].map(|m| std::array::from_fn(|i| numbers(&c[m][i])));
    let known = Camera {
        image: numbers::<2>(&c["resolution"]).map(|v| v as u32),
        focal_px: Vector2::new(k[0][0], k[1][1]),
        principal_px: Point2::new(k[0][2], k[1][2]),
        camera_from_world: Pose::from_parts(Vector3::from(numbers(&c["t"])).into(), rotation(r)),
    };
    known.resized(["width", "height"].map(|key| number(&scene["render"][key]) as u32))
}

fn light(l: &Value) -> AreaLight {
    let shape = match l["shape"].as_str() {
        Some("disk" | "ellipse") => LightShape::Ellipse,
        _ => LightShape::Rectangle,
    };
    AreaLight {
        shape,
        position: numbers(&l["position"]),
        target: if l["target"].is_null() { [0.0; 3] } else { numbers(&l["target"]) },
        size: if l["size"].is_array() { numbers(&l["size"]) } else { [number(&l["size"]); 2] },
        power: number(&l["power"]),
        color: if l["color"].is_null() { LinearRgb::WHITE } else { color(&l["color"]) },
    }
}

fn card(dir: &Path, q: &Value) -> Result<Card, String> {
    let rows: [[f64; 4]; 3] = std::array::from_fn(|i| numbers(&q["pose"][i]));
    let rotation = rotation(rows.map(|[a, b, c, _]| [a, b, c]));
    let world_from_card = Pose::from_parts(Vector3::from(rows.map(|row| row[3])).into(), rotation);
    let factor = |key: &str, default: f64| q[key].as_f64().unwrap_or(default) as f32;
    Ok(Card {
        id: ObjectId(number(&q["id"]) as u32),
        class: 0,
        quad: Quad { world_from_card, size: numbers(&q["size"]) },
        texture: read(dir, &q["texture"])?.into(),
        back: None,
        outline_uv: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Point2::from).into(),
        grade: Grade {
            hue_deg: factor("hue_shift", 0.0),
            saturation: factor("saturation", 1.0),
            value: factor("value", 1.0),
        },
    })
}

fn read(dir: &Path, path: &Value) -> Result<Image<PremulRgba>, String> {
    io::read(dir.join(path.as_str().unwrap_or_default())).map_err(|e| e.to_string())
}

fn rotation(rows: [[f64; 3]; 3]) -> UnitQuaternion<f64> {
    let matrix = nalgebra::Matrix3::from_fn(|i, j| rows[i][j]);
    UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(matrix))
}

fn color(v: &Value) -> LinearRgb {
    numbers::<3>(v).map(|c| c as f32).into()
}

fn numbers<const N: usize>(v: &Value) -> [f64; N] {
    std::array::from_fn(|i| number(&v[i]))
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("scene.json: {v} is not a number"))
}

fn array(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}
