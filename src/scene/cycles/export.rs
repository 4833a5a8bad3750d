//! A shot as a folder for the reference renderer.

use super::file::{
    CyclesAperture, CyclesCamera, CyclesEnvironment, CyclesFile, CyclesGround, CyclesLight,
    CyclesPicture, CyclesQuad, CyclesRender, CyclesShape, CyclesSide, CyclesSize, CyclesTray,
};
use crate::asset::Texture;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geom::Vector3;
use crate::image::Image;
use crate::io::{self, Bits, WriteOptions};
use crate::pixel::{Film, LinearRgb};
use crate::scene::{AreaLight, Card, EnvironmentMap, LightShape, Shot};
use nalgebra::SMatrix;
use std::path::Path;

/// The script that renders the folder, written next to the scene.
pub const SCRIPT: &str = "scene_reference.py";
/// Maximum number of bounces of light in a shot with interreflection.
const MAX_BOUNCES: u32 = 4;

const SCRIPT_TEXT: &str = include_str!("../../../golden/render/scene_reference.py");
/// Samples per pixel that the scene requests: noise of about 1e-3.
const SAMPLES_PER_PIXEL: u32 = 1024;
/// Side of an infinite surface for a program that needs a number, metres.
const ENDLESS_SIDE_M: f64 = 1000.0;
/// Clipping range of the camera, metres: everything that a scene may hold. The range costs a ray
/// tracer no precision: pictures differ by 1e-6 from those between 0.01 and 100.
const CLIP_M: [f64; 2] = [1e-6, 1e7];
/// Side of the smallest picture that Blender renders, pixels.
const LEAST_SIDE_PX: u32 = 4;
/// Side of the smallest light, metres: with one of 1e-5, Cycles renders pixels of 200 instead of
/// 0.6.
const LEAST_LIGHT_M: f64 = 1e-4;
/// The darkest albedo that Cycles' shadow catcher distinguishes from zero; its bounces are 1e-5
/// bright.
const LEAST_ALBEDO: f32 = 1e-3;
/// Tolerance of the script, pixels, where a lens has distortion: how far a principal point may be
/// from the centre, and how far non-square pixels may move the picture's side.
const OFF_AXIS_PX: f64 = 0.05;

/// Writes `scene.json`, its plate, textures and environment (float EXR), and the script that
/// renders them in Blender.
///
/// `size` is that of the labelled surface, metres. The script renders the shot's frame as
/// `beauty.exr`: the exposure is multiplied into the lights.
///
/// Light maps and holdout masks are left out, since Cycles has nothing like them.
///
/// # Errors
/// [`Error::File`] for what cannot be written; [`Error::Value`] for ids beyond 65 535, which
/// Blender does not support, for pictures and lights that are too small for it, and for a k1
/// combined with an aperture, an off-centre principal point or non-square pixels, which Cycles'
/// lenses with distortion do not support.
pub fn export(shot: &Shot, size: [f64; 2], folder: impl AsRef<Path>) -> Result<()> {
    check_image(shot.camera.image)?;
    check_lights(&shot.lights)?;
    check_lens(shot)?;
    let folder = folder.as_ref();
    io::create_folder(folder)?;
    io::write_json(folder.join("scene.json"), &scene_file(shot, size, folder)?)?;
    io::write_text(folder.join(SCRIPT), SCRIPT_TEXT)
}

fn check_image([width, height]: [u32; 2]) -> Result<()> {
    if width.min(height) >= LEAST_SIDE_PX {
        return Ok(());
    }
    let what = format!(
        "{width} x {height}, expected at least {LEAST_SIDE_PX} x {LEAST_SIDE_PX}: Blender cannot render a smaller picture"
    );
    Err(Error::value("image", what))
}

fn check_lights(lights: &[AreaLight]) -> Result<()> {
    let sides = lights.iter().map(|light| light.size[0].min(light.size[1]));
    match sides.enumerate().find(|&(_, side)| side < LEAST_LIGHT_M) {
        None => Ok(()),
        Some((i, side)) => {
            let what = format!(
                "{side} m, expected at least {LEAST_LIGHT_M}: smaller lights are noisy in Cycles"
            );
            Err(Error::value(format!("lights[{i}].size"), what))
        }
    }
}

/// Fails on a lens that the script rejects.
fn check_lens(shot: &Shot) -> Result<()> {
    if shot.k1 == 0.0 {
        return Ok(());
    }
    if shot.thin_lens.is_some() {
        return Err(bent_lens(shot.k1, "no f_number with it"));
    }
    if off_axis_px(&shot.camera) > OFF_AXIS_PX {
        let expected = "a centred principal point and square pixels with it";
        return Err(bent_lens(shot.k1, expected));
    }
    Ok(())
}

fn bent_lens(k1: f64, expected: &str) -> Error {
    let what = format!("{k1}, expected {expected}, or 0: Cycles has no other lens with distortion");
    Error::value("lens.k1", what)
}

/// Deviation of the camera from one with square pixels and a centred principal point, pixels.
fn off_axis_px(camera: &Camera) -> f64 {
    let [width, height] = camera.image.map(f64::from);
    let (focal, principal) = (camera.focal_px, camera.principal_px);
    let aspect = focal.x / focal.y;
    let shift_x = principal.x - width / 2.0;
    let shift_y = (principal.y - height / 2.0) * aspect;
    let stretch = (aspect.max(1.0 / aspect) - 1.0) * width;
    shift_x.abs().max(shift_y.abs()).max(stretch)
}

/// The contents of `scene.json`; also writes its pictures.
fn scene_file(shot: &Shot, size: [f64; 2], folder: &Path) -> Result<CyclesFile> {
    let cards = shot.cards.iter();
    let lights = shot.lights.iter();
    Ok(CyclesFile {
        render: render_settings(shot),
        camera: cycles_camera(shot),
        tray: CyclesTray { size },
        plate: write_plate(folder, shot)?,
        quads: cards
            .map(|card| write_card(folder, card))
            .collect::<Result<_>>()?,
        lights: lights
            .map(|light| cycles_light(light, shot.exposure))
            .collect(),
        environment: Some(write_environment(folder, shot)?),
        ground: Some(CyclesGround {
            extent: shot.catcher.map(|side| side.min(ENDLESS_SIDE_M)),
            albedo: bounced_albedo(shot.interreflection),
        }),
    })
}

fn bounced_albedo(surface: LinearRgb) -> Option<f32> {
    let albedo = surface.luminance();
    (albedo > 0.0).then(|| albedo.max(LEAST_ALBEDO))
}

fn render_settings(shot: &Shot) -> CyclesRender {
    let [width, height] = shot.camera.image;
    CyclesRender {
        width,
        height,
        samples: SAMPLES_PER_PIXEL,
        max_bounces: if shot.interreflection.is_black() {
            0
        } else {
            MAX_BOUNCES
        },
    }
}

fn write_plate(folder: &Path, shot: &Shot) -> Result<Option<CyclesPicture>> {
    let Some(plate) = &shot.plate else {
        return Ok(None);
    };
    let path = write_picture(folder, "plate.exr", plate)?;
    Ok(Some(CyclesPicture { path }))
}

fn write_picture<P: io::ToFile>(folder: &Path, name: &str, image: &Image<P>) -> Result<String> {
    let options = WriteOptions {
        bits: Some(Bits::Float),
        ..Default::default()
    };
    io::write_with(folder.join(name), image, &options)?;
    Ok(name.into())
}

fn cycles_camera(shot: &Shot) -> CyclesCamera {
    let camera = &shot.camera;
    let pose = &camera.camera_from_world;
    CyclesCamera {
        K: matrix_rows(camera.intrinsics()),
        R: matrix_rows(*pose.rotation.to_rotation_matrix().matrix()),
        t: pose.translation.vector.into(),
        resolution: Some(camera.image),
        clip: Some(CLIP_M),
        k1: shot.k1,
        aperture: shot.thin_lens.map(|lens| CyclesAperture {
            diameter: lens.aperture_m,
            focus: lens.focus_m,
        }),
    }
}

fn write_card(folder: &Path, card: &Card) -> Result<CyclesQuad> {
    let id = checked_id(card)?;
    let back = card.back.as_ref();
    Ok(CyclesQuad {
        id,
        size: card.quad.size,
        pose: matrix_rows(card.quad.world_from_card.to_homogeneous()),
        front: write_side(folder, &format!("card_{id}"), &card.texture)?,
        back: back
            .map(|back| write_side(folder, &format!("card_{id}_back"), back))
            .transpose()?,
        hue_shift: card.grade.hue_deg % 360.0,
        saturation: card.grade.saturation,
        value: card.grade.value,
    })
}

/// A card's id, if Blender supports it.
fn checked_id(card: &Card) -> Result<u32> {
    let id = card.id.0;
    if (1..=u32::from(u16::MAX)).contains(&id) {
        return Ok(id);
    }
    let what = format!("id {id}, expected 1 to {}", u16::MAX);
    Err(Error::value("cards", what))
}

fn matrix_rows<const N: usize>(m: SMatrix<f64, N, N>) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

fn write_side(folder: &Path, name: &str, texture: &Texture) -> Result<CyclesSide> {
    let color = format!("{name}.exr");
    match texture {
        Texture::Rgba(pyramid) => Ok(CyclesSide {
            texture: write_picture(folder, &color, pyramid.base())?,
            film: None,
        }),
        Texture::Film(pyramid) => {
            let film = pyramid.base();
            Ok(CyclesSide {
                texture: write_picture(folder, &color, &film.map(|film| film.to_rgba()))?,
                film: Some(write_opacity(folder, name, film)?),
            })
        }
    }
}

fn write_opacity(folder: &Path, name: &str, film: &Image<Film>) -> Result<String> {
    let name = format!("{name}_opacity.exr");
    write_picture(folder, &name, &film.map(|film| film.opacity))
}

fn cycles_light(light: &AreaLight, exposure: f32) -> CyclesLight {
    CyclesLight {
        shape: light.shape.into(),
        size: CyclesSize::Two(light.size),
        power: light.power * f64::from(exposure),
        color: light.color,
        position: light.position,
        target: light_target(light),
    }
}

impl From<LightShape> for CyclesShape {
    fn from(shape: LightShape) -> Self {
        match shape {
            LightShape::Rectangle => Self::Rectangle,
            LightShape::Ellipse => Self::Ellipse,
        }
    }
}

/// A light whose target is its own position shines straight down.
fn light_target(light: &AreaLight) -> [f64; 3] {
    let way = Vector3::from(light.target) - Vector3::from(light.position);
    let [x, y, z] = light.position;
    if way.norm() > 0.0 {
        light.target
    } else {
        [x, y, z - 1.0]
    }
}

/// The environment with the constant one and the picture combined.
fn write_environment(folder: &Path, shot: &Shot) -> Result<CyclesEnvironment> {
    let Some(map) = &shot.environment else {
        return Ok(CyclesEnvironment {
            color: Some(shot.ambient.scale(shot.exposure)),
            path: None,
            strength: 1.0,
            rotation_z: 0.0,
        });
    };
    let picture = joined_environment(map, shot.ambient, shot.exposure);
    Ok(CyclesEnvironment {
        color: None,
        path: Some(write_picture(folder, "environment.exr", &picture)?),
        strength: 1.0,
        rotation_z: map.rotation.to_degrees(),
    })
}

/// A map with a constant environment added, times the exposure.
fn joined_environment(map: &EnvironmentMap, ambient: LinearRgb, exposure: f32) -> Image<LinearRgb> {
    let picture = map.panorama.image();
    picture.map(|c: LinearRgb| (c.scale(map.strength) + ambient).scale(exposure))
}
