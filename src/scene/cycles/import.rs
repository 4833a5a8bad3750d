//! A shot from a file of the reference renderer.

use super::file::{
    CyclesAperture, CyclesEnvironment, CyclesFile, CyclesLight, CyclesQuad, CyclesSide,
};
use crate::asset::{Panorama, Texture};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geom::{Point2, Pose, Quad, UnitQuaternion, Vector2, Vector3};
use crate::image::Image;
use crate::io;
use crate::pixel::{Film, LinearRgb, Mix, ObjectId, PremulRgba};
use crate::scene::{AreaLight, Card, EnvironmentMap, Shot, ThinLens};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Extent of the plane that receives shadows, if the file does not give it, as a multiple of the
/// tray's sides: that of the reference renderer.
const CATCHER_RATIO: f64 = 3.0;

/// Reads the shot that a scene file of the reference renderer describes, at the file's own size or
/// another.
///
/// Every quad has its pose, and its texture is a premultiplied scene-linear EXR. The plate is
/// averaged over the pixels of the picture, as the script does.
///
/// # Errors
/// A file that cannot be read or lacks a key; a picture in it that cannot be read.
pub fn import(path: impl AsRef<Path>, size: Option<[u32; 2]>) -> Result<Shot> {
    let path = path.as_ref();
    let file: CyclesFile = io::read_json(path)?;
    let folder = PictureFolder::for_scene(path)?;
    let size = size.unwrap_or([file.render.width, file.render.height]);
    let mut shot = Shot::new(known_camera(&file).resized(size)).with_k1(file.camera.k1);
    shot.thin_lens = file.camera.aperture.map(thin_lens);
    if let Some(plate) = &file.plate {
        shot = shot.with_plate(Arc::new(folder.read_plate(&plate.path, size)?));
    }
    shot.catcher = catcher_size(&file);
    shot.interreflection = bounced_albedo(&file);
    shot.cards = folder.read_cards(&file.quads)?;
    folder.light(&mut shot, &file)?;
    Ok(shot)
}

/// The pictures of a scene: they are in its folder or, if several scenes share them, in a folder
/// next to it.
struct PictureFolder {
    /// The scene's file.
    scene: PathBuf,
    /// The parent of the scene's own folder.
    root: PathBuf,
    /// Name of the scene's folder in it.
    own: PathBuf,
}

impl PictureFolder {
    fn for_scene(scene: &Path) -> Result<Self> {
        let whole = io::absolute(scene)?;
        let folder = whole.parent().unwrap_or(&whole);
        let root = folder.parent().unwrap_or(folder).to_path_buf();
        Ok(Self {
            scene: scene.into(),
            own: folder.file_name().unwrap_or_default().into(),
            root,
        })
    }

    /// Path of a named picture: at most one level up.
    fn find(&self, name: &str) -> Result<PathBuf> {
        let mut place = self.own.clone();
        for step in Path::new(name).components() {
            match step {
                Component::Normal(step) => place.push(step),
                Component::CurDir => {}
                Component::ParentDir if place.pop() => {}
                _ => return Err(self.outside(name)),
            }
        }
        io::inside(&self.root, place).map_err(|e| e.in_file(&self.scene))
    }

    fn outside(&self, name: &str) -> Error {
        let what = format!("\"{name}\", expected a path below the scene's folder or its parent");
        Error::value("path", what).in_file(&self.scene)
    }

    fn read_plate(&self, name: &str, size: [u32; 2]) -> Result<Image<LinearRgb>> {
        let photo: Image<PremulRgba> = io::read(self.find(name)?)?;
        Ok(averaged(&photo.map(PremulRgba::color), size))
    }

    fn read_cards(&self, quads: &[CyclesQuad]) -> Result<Vec<Card>> {
        quads.iter().map(|quad| self.read_card(quad)).collect()
    }

    fn read_card(&self, quad: &CyclesQuad) -> Result<Card> {
        let placed = Quad {
            world_from_card: pose_of([0, 1, 2].map(|i| quad.pose[i][3]), &quad.pose),
            size: quad.size,
        };
        let back = quad.back.as_ref();
        Ok(Card {
            back: back.map(|back| self.read_texture(back)).transpose()?,
            grade: quad.grade(),
            ..Card::new(ObjectId(quad.id), placed, self.read_texture(&quad.front)?)
        })
    }

    fn read_texture(&self, side: &CyclesSide) -> Result<Texture> {
        let color: Image<PremulRgba> = io::read(self.find(&side.texture)?)?;
        let Some(film) = &side.film else {
            return Ok(color.into());
        };
        let opacity = self.read_opacity(film, color.size())?;
        Ok(color.zip_map(&opacity, film_pixel).into())
    }

    /// The opacity of a film whose colour has this size.
    fn read_opacity(&self, name: &str, expected: (usize, usize)) -> Result<Image<PremulRgba>> {
        let path = self.find(name)?;
        let opacity: Image<PremulRgba> = io::read(&path)?;
        let size = opacity.size();
        if size == expected {
            return Ok(opacity);
        }
        let what = format!("{size:?} pixels, but its colour has {expected:?}");
        Err(Error::file(&path, what))
    }

    /// Gives a shot the lights and the environment of a file.
    fn light(&self, shot: &mut Shot, file: &CyclesFile) -> Result<()> {
        shot.lights = file.lights.iter().map(area_light).collect();
        if let Some(around) = &file.environment {
            shot.ambient = around.color.unwrap_or_default().scale(around.strength);
            shot.environment = self.read_environment(around)?;
        }
        Ok(())
    }

    fn read_environment(&self, around: &CyclesEnvironment) -> Result<Option<EnvironmentMap>> {
        let Some(path) = &around.path else {
            return Ok(None);
        };
        Ok(Some(EnvironmentMap {
            panorama: Arc::new(self.read_panorama(path)?),
            rotation: around.rotation_z.to_radians(),
            strength: around.strength,
        }))
    }

    fn read_panorama(&self, name: &str) -> Result<Panorama> {
        let path = self.find(name)?;
        let photo: Image<PremulRgba> = io::read(&path)?;
        Panorama::new(photo.map(PremulRgba::color)).map_err(|e| e.in_file(path))
    }
}

/// Width and height of the part of the floor that receives shadows, metres.
fn catcher_size(file: &CyclesFile) -> [f64; 2] {
    match &file.ground {
        Some(ground) => ground.extent,
        None => file.tray.size.map(|side| CATCHER_RATIO * side),
    }
}

/// Albedo of the surface for interreflection; black for none.
fn bounced_albedo(file: &CyclesFile) -> LinearRgb {
    let ground = file.ground.as_ref().filter(|_| file.render.max_bounces > 0);
    let albedo = ground.and_then(|ground| ground.albedo);
    albedo.map_or(LinearRgb::BLACK, LinearRgb::grey)
}

fn film_pixel(color: PremulRgba, opacity: PremulRgba) -> Film {
    Film {
        color: color.color(),
        opacity: opacity.color(),
    }
}

fn known_camera(file: &CyclesFile) -> Camera {
    let c = &file.camera;
    let rendered = [file.render.width, file.render.height];
    Camera {
        image: c.resolution.unwrap_or(rendered),
        focal_px: Vector2::new(c.K[0][0], c.K[1][1]),
        principal_px: Point2::new(c.K[0][2], c.K[1][2]),
        camera_from_world: pose_of(c.t, &c.R),
    }
}

fn thin_lens(aperture: CyclesAperture) -> ThinLens {
    ThinLens {
        aperture_m: aperture.diameter,
        focus_m: aperture.focus,
    }
}

/// The pose of a translation and of a matrix whose first three rows and columns are a rotation.
fn pose_of<const N: usize>(translation: [f64; 3], rows: &[[f64; N]; N]) -> Pose {
    let matrix = nalgebra::Matrix3::from_fn(|i, j| rows[i][j]);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(matrix);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Pose::from_parts(Vector3::from(translation).into(), rotation)
}

fn area_light(light: &CyclesLight) -> AreaLight {
    AreaLight {
        shape: light.shape.into(),
        position: light.position,
        target: light.target,
        size: light.size.sides(),
        power: light.power,
        color: light.color,
    }
}

/// The photo resampled to this size: each pixel is the mean over the area of the photo that it
/// covers, whether larger or smaller than one of the photo's pixels.
fn averaged(photo: &Image<LinearRgb>, [width, height]: [u32; 2]) -> Image<LinearRgb> {
    let (width, height) = (width as usize, height as usize);
    if photo.size() == (width, height) {
        return photo.clone();
    }
    let columns = covered_shares(width, photo.width());
    let rows = covered_shares(height, photo.height());
    Image::from_fn(width, height, |x, y| {
        weighted_mean(photo, &columns[x], &rows[y])
    })
}

/// The weighted mean over some columns and rows.
fn weighted_mean(
    photo: &Image<LinearRgb>,
    columns: &[(usize, f32)],
    rows: &[(usize, f32)],
) -> LinearRgb {
    let mut sum = LinearRgb::BLACK;
    for &(j, v) in rows {
        for &(i, u) in columns {
            sum = sum.add_scaled(u * v, photo[(i, j)]);
        }
    }
    sum
}

/// The samples that each of `n` equal parts of a line of `len` covers, and their shares of it.
fn covered_shares(n: usize, len: usize) -> Vec<Vec<(usize, f32)>> {
    let scale = len as f64 / n as f64;
    (0..n)
        .map(|k| shares_between(k as f64 * scale, (k + 1) as f64 * scale, scale, len))
        .collect()
}

/// The samples of a line of `len` from one place to another, and their shares of `scale`.
fn shares_between(start: f64, end: f64, scale: f64, len: usize) -> Vec<(usize, f32)> {
    (start as usize..len)
        .map(|i| {
            let covered = end.min((i + 1) as f64) - start.max(i as f64);
            (i, (covered / scale) as f32)
        })
        .take_while(|&(_, share)| share > 0.0)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{SCRIPT, export};
    use super::*;
    use crate::geom::Quad;
    use crate::scene::{Grade, LightShape};

    #[test]
    fn a_scene_names_pictures_beside_it_and_none_further_away() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        io::create_folder(at("set/case")).unwrap();
        io::create_folder(at("set/textures")).unwrap();
        for name in ["set/textures/a.exr", "set/case/b.exr", "secret.exr"] {
            std::fs::write(at(name), "").unwrap();
        }
        let files = PictureFolder::for_scene(&at("set/case/scene.json")).unwrap();
        assert!(files.find("../textures/a.exr").is_ok() && files.find("b.exr").is_ok());
        for outside in [
            "../../secret.exr",
            "../textures/../../secret.exr",
            "/etc/passwd",
        ] {
            assert!(
                files
                    .find(outside)
                    .unwrap_err()
                    .to_string()
                    .contains("expected a path below"),
                "{outside}"
            );
        }
    }

    fn shot() -> Shot {
        let camera = Camera {
            image: [8, 6],
            focal_px: Vector2::new(11.0, 10.5),
            principal_px: Point2::new(4.25, 3.0),
            camera_from_world: Pose::from_parts(
                Vector3::new(0.1, 0.2, 1.0).into(),
                UnitQuaternion::from_euler_angles(3.0, 0.2, 0.1),
            ),
        };
        let film = Film::new(
            LinearRgb::new(0.1, 0.2, 0.0),
            LinearRgb::new(0.5, 0.25, 1.0),
        );
        let quad = Quad {
            world_from_card: Pose::translation(0.1, 0.0, 0.05),
            size: [0.2, 0.1],
        };
        let texture = Image::filled(3, 2, PremulRgba::new(0.25, 0.125, 0.0, 0.5));
        let card = Card {
            back: Some(Image::filled(2, 2, film).into()),
            outline_uv: [].into(),
            grade: Grade {
                hue_deg: 10.0,
                saturation: 0.75,
                value: 1.5,
                ..Grade::default()
            },
            ..Card::new(ObjectId(4), quad, texture)
        };
        let light = AreaLight {
            shape: LightShape::Ellipse,
            position: [0.3, 0.1, 1.0],
            target: [0.0, 0.1, 0.0],
            size: [0.1, 0.2],
            power: 5.0,
            color: LinearRgb::new(1.0, 0.5, 0.25),
        };
        let mut shot = Shot::new(camera)
            .with_card(card)
            .with_light(light)
            .with_ambient(LinearRgb::grey(0.5));
        shot.plate = Some(Arc::new(Image::from_fn(8, 6, |x, y| {
            LinearRgb::new(x as f32, y as f32, 0.5)
        })));
        shot.catcher = [1.0, 0.75];
        shot.exposure = 2.0;
        shot
    }

    #[test]
    fn what_is_written_comes_back_with_the_exposure_in_the_lights() {
        let folder = tempfile::tempdir().unwrap();
        let shot = shot();
        export(&shot, [0.4, 0.3], folder.path()).unwrap();
        assert!(folder.path().join(SCRIPT).exists());
        let back = import(folder.path().join("scene.json"), None).unwrap();
        assert!(
            (back.camera.camera_from_world.inverse() * shot.camera.camera_from_world)
                .rotation
                .angle()
                < 1e-12
        );
        assert_eq!(
            (back.camera.image, back.catcher, back.exposure),
            (shot.camera.image, shot.catcher, 1.0)
        );
        assert_eq!((back.plate, back.ambient), (shot.plate, LinearRgb::WHITE));
        assert_eq!(
            back.lights,
            [AreaLight {
                power: 10.0,
                ..shot.lights[0]
            }]
        );
        let (a, b) = (&back.cards[0], &shot.cards[0]);
        assert_eq!((a.id, a.quad.size, a.grade), (b.id, b.quad.size, b.grade));
        assert_eq!(a.texture.texel(2, 1), b.texture.texel(2, 1));
        assert_eq!(
            a.back.as_ref().unwrap().texel(1, 1),
            b.back.as_ref().unwrap().texel(1, 1)
        );
    }

    #[test]
    fn ambient_and_a_picture_become_one_environment() {
        let folder = tempfile::tempdir().unwrap();
        let panorama = Panorama::new(Image::filled(4, 2, LinearRgb::new(1.0, 2.0, 3.0))).unwrap();
        let map = EnvironmentMap {
            panorama: Arc::new(panorama),
            rotation: 1.0,
            strength: 0.5,
        };
        export(
            &Shot {
                environment: Some(map),
                ..shot()
            },
            [0.4, 0.3],
            folder.path(),
        )
        .unwrap();
        let back = import(folder.path().join("scene.json"), None).unwrap();
        let map = back.environment.unwrap();
        assert_eq!(back.ambient, LinearRgb::BLACK);
        assert!((map.rotation - 1.0).abs() < 1e-12);
        // (picture x 0.5 + ambient 0.5) x exposure 2
        assert_eq!(map.radiance(&Vector3::x()), LinearRgb::new(2.0, 3.0, 4.0));
    }

    #[test]
    fn what_the_script_refuses_is_refused_before() {
        let folder = tempfile::tempdir().unwrap();
        let told = |shot: &Shot| {
            let written = export(shot, [0.4, 0.3], folder.path().join("scene"));
            written.map_err(|e| e.to_string())
        };
        let off_axis = shot().with_k1(0.1);
        let said = told(&off_axis).unwrap_err();
        assert!(
            said.starts_with("lens.k1: 0.1, expected a centred"),
            "{said}"
        );
        let mut bent = off_axis;
        bent.camera.focal_px = Vector2::new(11.0, 11.0);
        bent.camera.principal_px = Point2::new(4.04, 3.0);
        bent.thin_lens = Some(ThinLens {
            aperture_m: 0.001,
            focus_m: 1.0,
        });
        let said = told(&bent).unwrap_err();
        assert!(said.contains("expected no f_number"), "{said}");
        assert!(!folder.path().join("scene").exists());
        bent.thin_lens = None;
        bent.cards[0].grade.hue_deg = -730.0;
        assert_eq!(told(&bent), Ok(()));
        let back = import(folder.path().join("scene/scene.json"), None).unwrap();
        assert_eq!(back.cards[0].grade.hue_deg, -10.0);
    }

    #[test]
    fn what_is_too_small_for_blender_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |shot: &Shot| {
            let written = export(shot, [0.4, 0.3], folder.path().join("scene"));
            written.unwrap_err().to_string()
        };
        let mut narrow = shot();
        narrow.camera.image = [3, 6];
        let said = refused(&narrow);
        assert!(
            said.starts_with("image: 3 x 6, expected at least 4 x 4"),
            "{said}"
        );
        let mut point = shot();
        point
            .lights
            .push(AreaLight::new([0.0, 0.0, 1.0], [0.1, 1e-5], 1.0));
        let said = refused(&point);
        assert!(
            said.starts_with("lights[1].size: 0.00001 m, expected at least 0.0001"),
            "{said}"
        );
        assert!(!folder.path().join("scene").exists());
    }

    #[test]
    fn the_camera_sees_all_and_a_dark_surface_catches_shadows() {
        let folder = tempfile::tempdir().unwrap();
        let mut dark = shot();
        dark.interreflection = LinearRgb::grey(1e-6);
        export(&dark, [0.4, 0.3], folder.path()).unwrap();
        let file: CyclesFile = io::read_json(folder.path().join("scene.json")).unwrap();
        assert_eq!(file.camera.clip, Some([1e-6, 1e7]));
        assert_eq!(file.ground.unwrap().albedo, Some(1e-3));
    }

    #[test]
    fn averaging_keeps_the_mean_and_the_places() {
        let photo = Image::from_fn(4, 1, |x, _| LinearRgb::grey(x as f32));
        let values = |w| {
            averaged(&photo, [w, 1])
                .pixels()
                .iter()
                .map(|c| c.r)
                .collect::<Vec<_>>()
        };
        assert_eq!(values(2), [0.5, 2.5]);
        assert_eq!(values(8), [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        assert!(
            values(3)
                .iter()
                .zip([0.25, 1.5, 2.75])
                .all(|(v, w)| (v - w).abs() < 1e-6)
        );
    }
}
