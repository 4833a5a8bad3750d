//! A shot as a folder for the reference renderer.

use super::file::{
    CyclesCamera, CyclesEnvironment, CyclesFile, CyclesGround, CyclesLight, CyclesPicture,
    CyclesQuad, CyclesRender, CyclesShape, CyclesSide, CyclesSize, CyclesTray,
};
use crate::asset::Texture;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geom::{Pose, Vector3};
use crate::image::Image;
use crate::io::{self, Bits, WriteOptions};
use crate::pixel::LinearRgb;
use crate::scene::{AreaLight, Card, EnvironmentMap, LightShape, Shot};
use nalgebra::Matrix4;
use std::path::Path;

/// The script that renders the folder, written beside the scene.
pub const SCRIPT: &str = "scene_reference.py";
const SCRIPT_TEXT: &str = include_str!("../../../golden/render/scene_reference.py");
/// Samples that the scene asks for: noise of about 1e-3.
const SAMPLES: u32 = 1024;
/// A surface without end, as far as a program that wants a number is concerned, metres.
const FAR: f64 = 1000.0;

/// Writes `scene.json`, its plate, textures and environment (float EXR), and the script that renders them in Blender.
///
/// `size` is that of the labelled surface, metres. The picture that the script makes, `beauty.exr`, is the shot's frame:
/// the exposure is multiplied into the lights.
///
/// # Errors
/// [`Error::File`] for what cannot be written; [`Error::Value`] for ids beyond 65 535, which Blender does not have.
pub fn export(shot: &Shot, size: [f64; 2], folder: impl AsRef<Path>) -> Result<()> {
    let folder = folder.as_ref();
    io::create_folder(folder)?;
    let plate = shot
        .plate
        .as_ref()
        .map(|plate| picture(folder, "plate.exr", plate))
        .transpose()?;
    let file = CyclesFile {
        render: CyclesRender {
            width: shot.camera.image[0],
            height: shot.camera.image[1],
            samples: SAMPLES,
            max_bounces: 0,
        },
        camera: camera(&shot.camera),
        tray: CyclesTray { size },
        plate: plate.map(|path| CyclesPicture { path }),
        quads: shot
            .cards
            .iter()
            .map(|card| quad(folder, card))
            .collect::<Result<_>>()?,
        lights: shot
            .lights
            .iter()
            .map(|l| light(l, shot.exposure))
            .collect(),
        environment: Some(environment(folder, shot)?),
        ground: Some(CyclesGround {
            extent: shot.catcher.map(|side| side.min(FAR)),
        }),
    };
    io::write_json(folder.join("scene.json"), &file)?;
    io::write_text(folder.join(SCRIPT), SCRIPT_TEXT)
}

fn picture<P: io::ToFile>(folder: &Path, name: &str, image: &Image<P>) -> Result<String> {
    let options = WriteOptions {
        bits: Some(Bits::Float),
        ..Default::default()
    };
    io::write_with(folder.join(name), image, &options)?;
    Ok(name.into())
}

fn camera(camera: &Camera) -> CyclesCamera {
    let rows =
        |m: nalgebra::Matrix3<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
    let pose = &camera.camera_from_world;
    CyclesCamera {
        K: rows(camera.intrinsics()),
        R: rows(*pose.rotation.to_rotation_matrix().matrix()),
        t: pose.translation.vector.into(),
        resolution: Some(camera.image),
    }
}

fn quad(folder: &Path, card: &Card) -> Result<CyclesQuad> {
    let id = card.id.0;
    if !(1..=u32::from(u16::MAX)).contains(&id) {
        return Err(Error::value(
            "cards",
            format!("id {id}, expected 1 to {}", u16::MAX),
        ));
    }
    Ok(CyclesQuad {
        id,
        size: card.quad.size,
        pose: matrix(&card.quad.world_from_card),
        front: side(folder, &format!("card_{id}"), &card.texture)?,
        back: card
            .back
            .as_ref()
            .map(|back| side(folder, &format!("card_{id}_back"), back))
            .transpose()?,
        hue_shift: card.grade.hue_deg,
        saturation: card.grade.saturation,
        value: card.grade.value,
    })
}

fn matrix(pose: &Pose) -> [[f64; 4]; 4] {
    let m: Matrix4<f64> = pose.to_homogeneous();
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

fn side(folder: &Path, name: &str, texture: &Texture) -> Result<CyclesSide> {
    match texture {
        Texture::Rgba(pyramid) => Ok(CyclesSide {
            texture: picture(folder, &format!("{name}.exr"), pyramid.base())?,
            film: None,
        }),
        Texture::Film(pyramid) => Ok(CyclesSide {
            texture: picture(
                folder,
                &format!("{name}.exr"),
                &pyramid.base().map(|film| film.to_rgba()),
            )?,
            film: Some(picture(
                folder,
                &format!("{name}_opacity.exr"),
                &pyramid.base().map(|film| film.opacity),
            )?),
        }),
    }
}

fn light(light: &AreaLight, exposure: f32) -> CyclesLight {
    let apart = (Vector3::from(light.target) - Vector3::from(light.position)).norm() > 0.0;
    let [x, y, z] = light.position;
    CyclesLight {
        shape: match light.shape {
            LightShape::Rectangle => CyclesShape::Rectangle,
            LightShape::Ellipse => CyclesShape::Ellipse,
        },
        size: CyclesSize::Two(light.size),
        power: light.power * f64::from(exposure),
        color: light.color,
        position: light.position,
        // A light whose target is its own position shines straight down.
        target: if apart { light.target } else { [x, y, z - 1.0] },
    }
}

/// One environment for the constant one and the picture.
fn environment(folder: &Path, shot: &Shot) -> Result<CyclesEnvironment> {
    let Some(EnvironmentMap {
        panorama,
        rotation,
        strength,
    }) = &shot.environment
    else {
        let color = Some(shot.ambient.scale(shot.exposure));
        return Ok(CyclesEnvironment {
            color,
            path: None,
            strength: 1.0,
            rotation_z: 0.0,
        });
    };
    let both = panorama
        .image()
        .map(|c: LinearRgb| (c.scale(*strength) + shot.ambient).scale(shot.exposure));
    let path = Some(picture(folder, "environment.exr", &both)?);
    Ok(CyclesEnvironment {
        color: None,
        path,
        strength: 1.0,
        rotation_z: rotation.to_degrees(),
    })
}
