//! Synthetic input files of the scenes: three assets, one labelled photo, one environment map.

use crate::pile::lamp;
use petcomp::asset::{Asset, Manifest, PhotoRecord};
use petcomp::camera::Label;
use petcomp::dataset::DatasetConfig;
use petcomp::geom::{Pose, UnitQuaternion, Vector3};
use petcomp::scene::{
    AreaLight, CameraSource, Environment, Exposure, Object, Placement, Recipe, Scene, Surface,
};
use petcomp::{Error, Film, Image, LinearRgb, PremulRgba, Result, io};
use std::path::PathBuf;
use tempfile::TempDir;

/// Size of the pictures and of the photo, pixels.
pub(super) const IMAGE: [u32; 2] = [320, 240];
/// Corners of the surface in the photo, and its size, metres.
const SURFACE_CORNERS_PX: [[f64; 2]; 4] =
    [[50.0, 56.0], [251.0, 52.0], [252.0, 183.0], [54.0, 187.5]];
const SURFACE_SIZE_M: [f64; 2] = [0.56, 0.37];
/// Focal length of the photo, pixels.
const PHOTO_FOCAL_PX: f64 = 343.7;
/// Texels of a cut-out, and their number per metre.
const TEXELS: [usize; 2] = [96, 48];
const TEXELS_PER_METRE: f64 = 400.0;
/// Number of cards of the default scene, and height of each above the one below it, metres.
const CARD_COUNT: usize = 3;
const CARD_RISE_M: f64 = 0.02;
/// File of the environment map.
const PANORAMA: &str = "sky.exr";

/// Names of the assets: a half see-through cut-out, an opaque one, and a tinting one.
pub(super) const SEE_THROUGH: &str = "bottle";
pub(super) const OPAQUE: &str = "box";
pub(super) const FILM: &str = "film";

/// The folder; removed when it is dropped.
#[derive(Debug)]
pub(super) struct FixtureFolder {
    folder: TempDir,
}

impl FixtureFolder {
    /// Writes all files.
    pub(super) fn new() -> Result<Self> {
        let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
        let world = Self { folder };
        world.write_assets()?;
        world.write_photo()?;
        io::write(world.path(PANORAMA), &Image::from_fn(32, 16, sky_color))?;
        Ok(world)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write_assets(&self) -> Result<()> {
        let folder = self.path("assets");
        io::create_folder(&folder)?;
        io::write(folder.join(file_of(SEE_THROUGH)), &striped_cut_out(0.5))?;
        io::write(folder.join(file_of(OPAQUE)), &striped_cut_out(1.0))?;
        io::write(
            folder.join(file_of(FILM)),
            &striped_cut_out(0.5).map(tinted),
        )?;
        manifest().write(&folder)?;
        Ok(())
    }

    fn write_photo(&self) -> Result<()> {
        let folder = self.path("photos");
        io::create_folder(&folder)?;
        let [w, h] = IMAGE.map(|side| side as usize);
        io::write(folder.join("tray.png"), &Image::from_fn(w, h, grain))?;
        let mut label = Label::new(IMAGE, SURFACE_CORNERS_PX, SURFACE_SIZE_M);
        label.image.file = "tray.png".into();
        label.camera.focal_px = Some(PHOTO_FOCAL_PX);
        io::write_json(folder.join("tray.label.json"), &label)
    }

    /// The recipe with these folders.
    pub(super) fn config(&self) -> DatasetConfig {
        let [assets, backgrounds] = ["assets", "photos"].map(|kind| self.path(kind));
        DatasetConfig {
            folder: self.folder.path().into(),
            assets,
            backgrounds,
            scene: Recipe {
                image: IMAGE,
                ..Recipe::default()
            },
            ..DatasetConfig::default()
        }
    }

    /// A few see-through cards at rest over the photo, one on another, under a lamp and an even
    /// sky.
    pub(super) fn scene(&self) -> Scene {
        Scene {
            plate: "tray".into(),
            objects: (0..CARD_COUNT)
                .map(|k| card_at_rest(SEE_THROUGH, k))
                .collect(),
            lights: vec![scene_lamp()],
            ambient: LinearRgb::grey(0.3),
            exposure: Exposure::Ev(0.0),
            ..Scene::new(IMAGE, photo_camera(), Surface::new(SURFACE_SIZE_M))
        }
    }

    /// The light of an environment map.
    pub(super) fn environment(&self, strength: f64) -> Environment {
        Environment {
            file: PANORAMA.into(),
            rotation_deg: 0.0,
            strength,
        }
    }
}

fn manifest() -> Manifest {
    Manifest {
        classes: vec!["none".into()],
        assets: [SEE_THROUGH, OPAQUE, FILM].map(asset_record).into(),
    }
}

fn photo_camera() -> CameraSource {
    CameraSource::Rectangle {
        corners_px: SURFACE_CORNERS_PX,
        photo: IMAGE,
        focal_px: Some(PHOTO_FOCAL_PX),
    }
}

fn scene_lamp() -> AreaLight {
    AreaLight {
        position: [0.3, 0.2, 1.0],
        size: [0.2; 2],
        power: 6.0,
        ..lamp(LinearRgb::WHITE)
    }
}

fn grain(x: usize, y: usize) -> LinearRgb {
    LinearRgb::grey(0.2 + 0.1 * ((x * 7 + y * 13) % 5) as f32)
}

/// Card `k` of a scene, at rest.
fn card_at_rest(asset: &str, k: usize) -> Object {
    let size = TEXELS.map(|n| n as f64 / TEXELS_PER_METRE);
    Object::new(asset, size, 0.005, 0.02, Placement::At(pose_at_rest(k)))
}

fn pose_at_rest(k: usize) -> Pose {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7 * k as f64);
    let at = Vector3::new(0.04 * k as f64 - 0.04, 0.0, CARD_RISE_M * (k + 1) as f64);
    Pose::from_parts(at.into(), turn)
}

/// The same objects, not yet settled.
pub(super) fn dropped(mut scene: Scene) -> Scene {
    for object in &mut scene.objects {
        if let Placement::At(pose) = object.placement {
            object.placement = Placement::Drop {
                above: [pose.translation.x, pose.translation.y],
                height: pose.translation.z,
                rotation: pose.rotation,
            };
        }
    }
    scene
}

/// The same scene with another asset.
pub(super) fn made_of(asset: &str, mut scene: Scene) -> Scene {
    for object in &mut scene.objects {
        object.asset = asset.into();
    }
    scene
}

fn file_of(asset: &str) -> String {
    format!("{asset}.exr")
}

fn asset_record(asset: &str) -> Asset<PhotoRecord> {
    Asset {
        name: asset.into(),
        role: Default::default(),
        class: "none".into(),
        thickness: 0.005,
        mass: 0.02,
        photos: vec![photo_record(asset)],
    }
}

fn photo_record(asset: &str) -> PhotoRecord {
    let [w, h] = TEXELS.map(|n| n as f64);
    let size_m = [w / TEXELS_PER_METRE, h / TEXELS_PER_METRE];
    let outline_px = vec![[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
    let mut photo = PhotoRecord::new(file_of(asset), TEXELS_PER_METRE, size_m, outline_px);
    photo.source = "made in code".into();
    photo
}

/// Stripes of one alpha.
fn striped_cut_out(alpha: f32) -> Image<PremulRgba> {
    Image::from_fn(TEXELS[0], TEXELS[1], |x, y| {
        let is_bright = (x / 8 + y / 8).is_multiple_of(2);
        let stripe = if is_bright { 0.75 } else { 0.25 };
        PremulRgba::new(alpha * stripe, alpha * 0.5, alpha * (1.0 - stripe), alpha)
    })
}

/// A film that transmits green best.
fn tinted(p: PremulRgba) -> Film {
    Film::new(p.color(), LinearRgb::new(0.25, 0.75, 0.5))
}

/// Brighter towards the top, with a bright patch like a window.
fn sky_color(x: usize, y: usize) -> LinearRgb {
    let window = if x / 4 == 2 && y / 2 == 2 { 5.0 } else { 0.0 };
    LinearRgb::grey(1.0 / (1 + y) as f32 + window)
}
