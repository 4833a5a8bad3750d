//! A picture from what is in memory: cards over a plate.

use crate::arrays::Given;
use crate::camera::Camera;
use crate::document::parse;
use crate::errors::{to_python, wrong_value};
use crate::sample::{Policy, Sample};
use crate::scene::empty_scene;
use crate::work;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use petcomp::dataset::{self, LabelConfig};
use petcomp::geom::{Pose, Quad, Vector3};
use petcomp::render::{self, RenderOptions};
use petcomp::scene::{AreaLight, Card};
use petcomp::{Error, Image, LinearRgb, ObjectId, PremulRgba, Result, Shot, composite, label};
use pyo3::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Where a card lies and how large it is: id, class, size, position, rows of its rotation.
type Place = (u32, Option<u32>, [f64; 2], [f64; 3], [[f64; 3]; 3]);

/// What a shot is made of, but for its pixels.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    lights: Vec<AreaLight>,
    ambient: LinearRgb,
    exposure: f32,
    render: RenderOptions,
    labels: LabelConfig,
    classes: Vec<String>,
}

/// Renders cards over a plate and labels them.
#[pyfunction]
pub(crate) fn render_shot(
    py: Python<'_>,
    camera: &Bound<'_, Camera>,
    plate: Option<Bound<'_, PyAny>>,
    places: Vec<Place>,
    textures: Vec<Bound<'_, PyAny>>,
    settings: &str,
) -> PyResult<Sample> {
    let camera = camera.get().0;
    let plate = plate
        .map(|p| Given::from_argument("plate", &p))
        .transpose()?;
    let textures = pictures_of(&textures)?;
    let settings: Settings = parse("shot", settings).map_err(to_python)?;
    check_places(&places, textures.len(), &settings)?;
    let policy = settings.policy().map_err(to_python)?;
    let sample = work::run(py, move || {
        let shot = settings.shot(camera, plate, places, textures)?;
        Ok(settings.sample(&shot))
    })?;
    Ok(Sample::new(sample, policy))
}

fn pictures_of(textures: &[Bound<'_, PyAny>]) -> PyResult<Vec<Given>> {
    let textures = textures.iter();
    textures
        .map(|texture| Given::from_argument("texture", texture))
        .collect()
}

fn check_places(places: &[Place], textures: usize, settings: &Settings) -> PyResult<()> {
    let ids: BTreeSet<u32> = places.iter().map(|place| place.0).collect();
    if ids.len() != places.len() || ids.contains(&0) || textures != places.len() {
        return Err(wrong_value(
            "cards",
            "expected a unique id above 0 for each",
        ));
    }
    let classes = settings.classes.len();
    let unknown = places
        .iter()
        .filter_map(|place| place.1)
        .find(|class| *class as usize >= classes);
    match unknown {
        None => Ok(()),
        Some(class) => Err(wrong_value(
            "cards",
            format_args!("class {class}, but there are {classes} classes"),
        )),
    }
}

impl Settings {
    fn policy(&self) -> Result<Policy> {
        let obstructed = self.labels.obstructed;
        Ok(Policy {
            classes: obstructed.classes(&self.classes)?,
            obstructed,
            extent: self.labels.extent(),
        })
    }

    fn shot(
        &self,
        camera: petcomp::Camera,
        plate: Option<Given>,
        places: Vec<Place>,
        textures: Vec<Given>,
    ) -> Result<Shot> {
        self.check(&camera)?;
        let mut shot = Shot::new(camera).with_ambient(self.ambient);
        shot.exposure = self.exposure;
        shot.lights.clone_from(&self.lights);
        if let Some(plate) = plate {
            shot = with_plate(shot, plate)?;
        }
        for (i, (place, texture)) in places.into_iter().zip(textures).enumerate() {
            let card = card_of(place, texture).map_err(|e| e.within(&format!("cards[{i}]")))?;
            shot = shot.with_card(card);
        }
        Ok(shot)
    }

    fn check(&self, camera: &petcomp::Camera) -> Result<()> {
        let mut scene = empty_scene(camera);
        scene.lights.clone_from(&self.lights);
        scene.ambient = self.ambient;
        scene.check()?;
        self.render.check().map_err(|e| e.within("render"))?;
        self.labels.check().map_err(|e| e.within("labels"))?;
        if self.exposure.is_finite() && self.exposure >= 0.0 && self.exposure <= MOST_EXPOSURE {
            return Ok(());
        }
        let what = format!("{}, expected 0 to {MOST_EXPOSURE}", self.exposure);
        Err(Error::value("exposure", what))
    }

    fn sample(&self, shot: &Shot) -> dataset::Sample {
        let deep = render::render(shot, &self.render);
        let frame = composite::frame(&deep, shot.plate.as_deref());
        let labels = label::label(&deep, shot, &self.labels.options);
        dataset::Sample {
            deep,
            ..dataset::Sample::new(frame, labels)
        }
    }
}

/// Factor on light: 20 stops.
const MOST_EXPOSURE: f32 = 1_048_576.0;

fn with_plate(shot: Shot, plate: Given) -> Result<Shot> {
    let plate = plate.decoded("plate")?.into_opaque("plate")?;
    let [width, height] = shot.camera.image.map(|side| side as usize);
    if plate.size() != (width, height) {
        let (w, h) = plate.size();
        let what = format!("{w} x {h} pixels, but the camera has {width} x {height}");
        return Err(Error::value("plate", what));
    }
    Ok(shot.with_plate(Arc::new(plate)))
}

fn card_of((id, class, size, position, rotation): Place, texture: Given) -> Result<Card> {
    check_place(&size, &position)?;
    let quad = Quad {
        world_from_card: Pose::from_parts(Vector3::from(position).into(), rotation_of(&rotation)?),
        size,
    };
    Ok(Card {
        class,
        ..Card::new(ObjectId(id), quad, texture_of(texture)?)
    })
}

fn check_place(size: &[f64; 2], position: &[f64; 3]) -> Result<()> {
    let is_side = |side| (LEAST_SIDE_M..=MOST_SIDE_M).contains(&side);
    check_numbers("size", size, is_side, "0.000001 to 1000 (metres)")?;
    let is_near = |place: f64| place.abs() <= MOST_SIDE_M;
    check_numbers("position", position, is_near, "within 1000 metres")
}

fn texture_of(texture: Given) -> Result<Image<PremulRgba>> {
    let texture = texture.decoded("texture")?.into_premul();
    match texture.pixels().iter().find(|pixel| !pixel.is_sound()) {
        None => Ok(texture),
        Some(bad) => Err(Error::value(
            "texture",
            format!("alpha {}, expected 0 to 1", bad.a),
        )),
    }
}

const LEAST_SIDE_M: f64 = 1e-6;
const MOST_SIDE_M: f64 = 1000.0;
/// What a matrix of a few decimals may miss a rotation by.
const ROTATION_TOLERANCE: f64 = 1e-5;

fn check_numbers(
    at: &str,
    numbers: &[f64],
    is_right: impl Fn(f64) -> bool,
    expected: &str,
) -> Result<()> {
    if numbers.iter().all(|&number| is_right(number)) {
        return Ok(());
    }
    Err(Error::value(
        at,
        format!("{numbers:?}, expected {expected}"),
    ))
}

fn rotation_of(rows: &[[f64; 3]; 3]) -> Result<UnitQuaternion<f64>> {
    let matrix = Matrix3::from_fn(|i, j| rows[i][j]);
    let apart = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    if apart < ROTATION_TOLERANCE && matrix.determinant() > 0.0 {
        let rotation = Rotation3::from_matrix_unchecked(matrix);
        return Ok(UnitQuaternion::from_rotation_matrix(&rotation));
    }
    Err(Error::value(
        "rotation",
        format!("{rows:?}, expected the rows of a rotation matrix"),
    ))
}
