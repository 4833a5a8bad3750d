//! A small world in a folder, made in code: three assets, one labelled photo, one picture of the surroundings.

use crate::pile::lamp;
use petcomp::asset::{Asset, Manifest, PhotoRecord};
use petcomp::camera::Label;
use petcomp::dataset::DatasetConfig;
use petcomp::geom::{Pose, UnitQuaternion, Vector3};
use petcomp::scene::{
    AreaLight, CameraSource, Environment, Exposure, Grade, Object, Placement, Recipe, Scene,
    Surface,
};
use petcomp::{Error, Film, Image, LinearRgb, PremulRgba, Result, io};
use tempfile::TempDir;

/// Size of the pictures and of the photo, pixels.
pub(super) const IMAGE: [u32; 2] = [320, 240];
/// Where the surface lies in the photo, and its size, metres.
const CORNERS: [[f64; 2]; 4] = [[50.0, 56.0], [251.0, 52.0], [252.0, 183.0], [54.0, 187.5]];
const SURFACE: [f64; 2] = [0.56, 0.37];
/// Focal length of the photo, pixels.
const FOCAL: f64 = 343.7;
/// Texels of a cut-out, and how many of them are a metre.
const TEXELS: [usize; 2] = [96, 48];
const PER_METRE: f64 = 400.0;
/// Cards of the usual scene, and by how much each lies higher than the one below it, metres.
const CARDS: usize = 3;
const RISE: f64 = 0.02;
/// File of the surroundings.
const PANORAMA: &str = "sky.exr";

/// Names of the assets: a cut-out that is half see-through, one that is opaque all over, one that tints.
pub(super) const SEE_THROUGH: &str = "bottle";
pub(super) const OPAQUE: &str = "box";
pub(super) const FILM: &str = "film";

/// The folder; gone when it is dropped.
#[derive(Debug)]
pub(super) struct FixtureFolder {
    folder: TempDir,
}

impl FixtureFolder {
    /// Writes all files.
    pub(super) fn make() -> Result<Self> {
        let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
        let world = Self { folder };
        for kind in ["assets", "photos"] {
            io::create_folder(world.folder.path().join(kind))?;
        }
        world.write_assets()?;
        world.write_photo()?;
        io::write(world.panorama(), &Image::from_fn(32, 16, sky))?;
        Ok(world)
    }

    fn write_assets(&self) -> Result<()> {
        let folder = self.folder.path().join("assets");
        io::write(folder.join(file_of(SEE_THROUGH)), &cut_out(0.5))?;
        io::write(folder.join(file_of(OPAQUE)), &cut_out(1.0))?;
        io::write(folder.join(file_of(FILM)), &cut_out(0.5).map(tinted))?;
        let assets = [SEE_THROUGH, OPAQUE, FILM].map(record).into();
        Manifest {
            classes: vec!["none".into()],
            assets,
        }
        .write(&folder)?;
        Ok(())
    }

    fn write_photo(&self) -> Result<()> {
        let folder = self.folder.path().join("photos");
        let [w, h] = IMAGE.map(|side| side as usize);
        let grain = |x: usize, y: usize| LinearRgb::grey(0.2 + 0.1 * ((x * 7 + y * 13) % 5) as f32);
        io::write(folder.join("tray.png"), &Image::from_fn(w, h, grain))?;
        let mut label = Label::new(IMAGE, CORNERS, SURFACE);
        label.image.file = "tray.png".into();
        label.camera.focal_px = Some(FOCAL);
        io::write_json(folder.join("tray.label.json"), &label)
    }

    fn panorama(&self) -> std::path::PathBuf {
        self.folder.path().join(PANORAMA)
    }

    /// The recipe that names the folders.
    pub(super) fn config(&self) -> DatasetConfig {
        let [assets, backgrounds] = ["assets", "photos"].map(|kind| self.folder.path().join(kind));
        let scene = Recipe {
            image: IMAGE,
            ..Recipe::default()
        };
        DatasetConfig {
            folder: self.folder.path().into(),
            assets,
            backgrounds,
            scene,
            ..DatasetConfig::default()
        }
    }

    /// A few see-through cards at rest over the photo, one on another, under a lamp and an even sky.
    pub(super) fn scene(&self) -> Scene {
        let lamp = AreaLight {
            position: [0.3, 0.2, 1.0],
            size: [0.2; 2],
            power: 6.0,
            ..lamp(LinearRgb::WHITE)
        };
        Scene {
            image: IMAGE,
            plate: "tray".into(),
            camera: CameraSource::Rectangle {
                corners_px: CORNERS,
                photo: IMAGE,
                focal_px: Some(FOCAL),
            },
            surface: Surface::new(SURFACE),
            objects: (0..CARDS).map(|k| lying(SEE_THROUGH, k)).collect(),
            lights: vec![lamp],
            ambient: LinearRgb::grey(0.3),
            environment: None,
            exposure: Exposure::Ev(0.0),
            cast: Default::default(),
            finish: Default::default(),
            files: None,
            settings: Default::default(),
        }
    }

    /// The light of a picture of the surroundings.
    pub(super) fn environment(&self, strength: f64) -> Environment {
        Environment {
            file: PANORAMA.into(),
            rotation_deg: 0.0,
            strength,
        }
    }
}

/// Card `k` of a scene, at rest.
fn lying(asset: &str, k: usize) -> Object {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7 * k as f64);
    let at = Vector3::new(0.04 * k as f64 - 0.04, 0.0, RISE * (k + 1) as f64);
    Object {
        asset: asset.into(),
        photo: 0,
        back: None,
        size: TEXELS.map(|n| n as f64 / PER_METRE),
        thickness: 0.005,
        outline: Vec::new(),
        mass: 0.02,
        placement: Placement::At(Pose::from_parts(at.into(), turn)),
        grade: Grade::default(),
    }
}

/// The same objects, still in the air.
pub(super) fn dropped(mut scene: Scene) -> Scene {
    for object in &mut scene.objects {
        let Placement::At(pose) = object.placement else {
            continue;
        };
        let above = [pose.translation.x, pose.translation.y];
        object.placement = Placement::Drop {
            above,
            height: pose.translation.z,
            rotation: pose.rotation,
        };
    }
    scene
}

/// The same scene of another asset.
pub(super) fn made_of(asset: &str, mut scene: Scene) -> Scene {
    scene
        .objects
        .iter_mut()
        .for_each(|object| object.asset = asset.into());
    scene
}

fn file_of(asset: &str) -> String {
    format!("{asset}.exr")
}

fn record(asset: &str) -> Asset<PhotoRecord> {
    let [w, h] = TEXELS.map(|n| n as f64);
    let size_m = [w / PER_METRE, h / PER_METRE];
    let outline_px = vec![[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
    let mut photo = PhotoRecord::new(file_of(asset), PER_METRE, size_m, outline_px);
    photo.source = "made in code".into();
    Asset {
        name: asset.into(),
        class: "none".into(),
        thickness: 0.005,
        mass: 0.02,
        photos: vec![photo],
    }
}

/// Stripes of one alpha.
fn cut_out(alpha: f32) -> Image<PremulRgba> {
    Image::from_fn(TEXELS[0], TEXELS[1], |x, y| {
        let stripe = if (x / 8 + y / 8).is_multiple_of(2) {
            0.75
        } else {
            0.25
        };
        PremulRgba::new(alpha * stripe, alpha * 0.5, alpha * (1.0 - stripe), alpha)
    })
}

/// A film that lets green pass best.
fn tinted(p: PremulRgba) -> Film {
    Film::new(p.color(), LinearRgb::new(0.25, 0.75, 0.5))
}

/// Brighter towards the top, with something like a window.
fn sky(x: usize, y: usize) -> LinearRgb {
    let window = if x / 4 == 2 && y / 2 == 2 { 5.0 } else { 0.0 };
    LinearRgb::grey(1.0 / (1 + y) as f32 + window)
}
