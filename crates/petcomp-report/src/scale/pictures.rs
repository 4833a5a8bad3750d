//! Synthetic pictures of a kind.

use super::ScaleCase;
use crate::pile::{CAMERA_HEIGHT_M, camera_above, lamp, striped};
use petcomp::DeepImage;
use petcomp::asset::Texture;
use petcomp::camera::Camera;
use petcomp::dataset::{
    Obstructed, Pictures, Plan, Provenance, Sample, SampleRange, Sidecar, Split, Writer, Yolo,
    generate,
};
use petcomp::geom::{Point2, Pose, UnitQuaternion, Vector2, Vector3};
use petcomp::label::{LabelOptions, label};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{
    Appearance, CameraSource, Exposure, Grade, Object, Placement, Scene, Shot, Surface,
};
use petcomp::{Error, Image, LinearRgb, PremulRgba, Result, composite};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

/// What the camera sees of the surface at 1:1, metres per pixel of focal length and width.
const FOCAL_BY_WIDTH: f64 = 1.166;
/// Area of the cards, metres: slightly less than what is visible.
const ROOM_M: [f64; 2] = [0.84, 0.6];
/// Width and length of a card, metres: a bottle.
const CARD_M: [f64; 2] = [0.07, 0.21];
/// Height of the pile, and maximum height that a card adds to it, metres.
const PILE_HEIGHT_M: f64 = 0.25;
const MAX_RISE_M: f64 = 0.006;
const CARD_MASS_KG: f64 = 0.02;
/// Rotation of each card relative to the last, radians.
const CARD_TURN_RAD: f64 = 2.4;
/// Number of different cut-outs.
const CUT_OUT_COUNT: usize = 5;
/// The root of `x^3 = x + 1`.
const PLASTIC_NUMBER: f64 = 1.324_717_957_244_746;

/// Inputs of pictures of a kind.
pub(super) struct PictureInputs {
    scene: Scene,
    shot: Shot,
}

impl PictureInputs {
    pub(super) fn new(case: &ScaleCase) -> Self {
        let scene = heap_scene(case);
        let textures: Vec<_> = (0..CUT_OUT_COUNT)
            .map(|k| Texture::from(cut_out(k)))
            .collect();
        let plate = Arc::new(plate(case.image));
        let shot = scene
            .resolve(
                |object| Ok(Some(appearance(object, &textures))),
                Some(plate),
                None,
            )
            .expect("the scene is known and its plate has its size");
        Self { scene, shot }
    }

    /// Generates a dataset in a temporary folder and returns the layers of one picture.
    pub(super) fn make(&self, pictures: u64) -> Result<f64> {
        let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
        let layers = OnceLock::new();
        let make = |_| {
            let sample = self.sample();
            layers.get_or_init(|| mean_layers(&sample.deep));
            Ok(sample)
        };
        let plan = dataset_plan(folder.path(), pictures);
        generate(&plan, make, &|_| {}, &AtomicBool::new(false))?;
        Ok(layers.into_inner().unwrap_or_default())
    }

    fn sample(&self) -> Sample {
        let deep = render(&self.shot, &RenderOptions::default());
        let frame = composite::frame(&deep, self.shot.plate.as_deref());
        let labels = label(&deep, &self.shot, &LabelOptions::default());
        Sample {
            deep,
            provenance: Some(Provenance::from_scene(self.scene.clone())),
            ..Sample::new(frame, labels)
        }
    }
}

fn appearance(object: &Object, textures: &[Texture]) -> Appearance {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    Appearance {
        class: Some(0),
        texture: textures[object.photo % textures.len()].clone(),
        back: None,
        outline_uv: corners.map(Point2::from).into(),
        flows: Default::default(),
        surfaces: Default::default(),
    }
}

/// A grey plate with some texture.
fn plate([w, h]: [u32; 2]) -> Image<LinearRgb> {
    Image::from_fn(w as usize, h as usize, |x, y| {
        LinearRgb::grey(0.2 + 0.01 * ((7 * x + 13 * y) % 11) as f32)
    })
}

fn dataset_plan(folder: &Path, count: u64) -> Plan {
    Plan {
        folder: folder.into(),
        count,
        range: SampleRange::All,
        seed: 0,
        recipe: serde_json::json!({ "made": "in code" }),
        classes: vec!["bottle".into()],
        split: Split::default(),
        obstructed: Obstructed::Keep,
        writers: writers(),
        archives: None,
        store: None,
        inputs: Default::default(),
    }
}

fn writers() -> Vec<Arc<dyn Writer>> {
    vec![
        Arc::new(Pictures::default()),
        Arc::new(Sidecar),
        Arc::new(Yolo::default()),
    ]
}

fn mean_layers(deep: &DeepImage) -> f64 {
    let pixels = deep.width() * deep.height();
    let samples: usize = (0..deep.height()).map(|y| samples_in_row(deep, y)).sum();
    samples as f64 / pixels as f64
}

fn samples_in_row(deep: &DeepImage, y: usize) -> usize {
    (0..deep.width()).map(|x| deep.at(x, y).len()).sum()
}

/// Cards in a heap under a lamp and a uniform sky, seen from above.
fn heap_scene(case: &ScaleCase) -> Scene {
    Scene {
        plate: "tray".into(),
        objects: (0..case.cards).map(|k| heap_card(case, k)).collect(),
        lights: vec![lamp(LinearRgb::WHITE)],
        ambient: LinearRgb::grey(0.3),
        exposure: Exposure::Ev(0.0),
        ..Scene::new(
            case.image,
            CameraSource::Known(heap_camera(case.image)),
            Surface::new([1.0, 0.7]),
        )
    }
}

fn heap_camera(image: [u32; 2]) -> Camera {
    Camera {
        focal_px: Vector2::repeat(FOCAL_BY_WIDTH * f64::from(image[0])),
        ..camera_above(image, CAMERA_HEIGHT_M)
    }
}

/// Card `k` of a heap.
fn heap_card(case: &ScaleCase, k: usize) -> Object {
    let rise = MAX_RISE_M.min(PILE_HEIGHT_M / case.cards as f64);
    let size = CARD_M.map(|side| side * case.scale);
    let placement = Placement::At(heap_pose(k, rise));
    Object {
        photo: k,
        grade: Grade {
            hue_deg: (7 * k % 60) as f32,
            saturation: 0.9,
            value: 1.1,
            ..Grade::default()
        },
        ..Object::new("bottle", size, 0.5 * rise, CARD_MASS_KG, placement)
    }
}

/// Spread evenly by the plastic number's sequence (Roberts, "The unreasonable effectiveness of
/// quasirandom sequences", 2018), each a little higher than the one before it.
fn heap_pose(k: usize, rise: f64) -> Pose {
    let [x, y] = [1, 2].map(|power| plastic_share(k, power));
    let center = Vector3::new(ROOM_M[0] * x, ROOM_M[1] * y, rise * (k + 1) as f64);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), CARD_TURN_RAD * k as f64);
    Pose::from_parts(center.into(), turn)
}

/// Number `k` of a sequence, from -0.5 to 0.5.
fn plastic_share(k: usize, power: i32) -> f64 {
    (0.5 + (k + 1) as f64 * PLASTIC_NUMBER.powi(-power)).fract() - 0.5
}

/// A bottle of 192 x 576 texels: soft outline, half see-through, striped.
fn cut_out(k: usize) -> Image<PremulRgba> {
    Image::from_fn(192, 576, |x, y| {
        let is_bright = (y / 6 + k).is_multiple_of(2);
        striped(cut_out_alpha(x, y), if is_bright { 0.75 } else { 0.35 })
    })
}

fn cut_out_alpha(x: usize, y: usize) -> f32 {
    let across = (x as f32 - 95.5).abs() / 96.0;
    let half_width = if y < 115 { 0.35 } else { 0.9 };
    let is_label = (230..346).contains(&y);
    let opacity = if is_label { 0.95 } else { 0.5 };
    (20.0 * (half_width - across)).clamp(0.0, 1.0) * opacity
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: ScaleCase = ScaleCase {
        threads: 2,
        image: [320, 240],
        cards: 5,
        scale: 1.0,
    };

    #[test]
    fn larger_cards_are_more_layers_and_larger_pictures_are_not() {
        let layers = |case| mean_layers(&PictureInputs::new(&case).sample().deep);
        let nominal = layers(SMALL);
        assert!(
            layers(ScaleCase {
                scale: 2.0,
                ..SMALL
            }) > 2.5 * nominal
        );
        assert!(
            (layers(ScaleCase {
                image: [640, 480],
                ..SMALL
            }) / nominal
                - 1.0)
                .abs()
                < 0.15
        );
    }
}
