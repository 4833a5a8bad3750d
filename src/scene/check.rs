//! Validation of a scene, once, before any work.

use crate::bounds::{ALBEDO, Bounds, LONGEST_SIDE_PX, MOST_PIXELS};
use crate::camera::Camera;
use crate::color::Albedo;
use crate::error::{Error, Result};
use crate::geom::{Pose, UnitQuaternion};
use crate::pixel::LinearRgb;
use crate::scene::bounds::{
    CAST_SHARE, EV, FOCAL, FRICTION, GRADE, LENGTH, MASS, MAX_LIGHTS, MAX_OBJECTS, PHOTO_SIDE,
    PIXEL, PLACE, RADIANCE, SHARE, SOLVED_EV, TURN,
};
use crate::scene::hull::doubled_corner_area;
use crate::scene::{
    AreaLight, CameraSource, Environment, Exposure, Grade, LightTint, Object, Placement, Scene,
    Surface,
};
use std::fmt::{Debug, Display};

/// Tolerance for the norm of a quaternion, as left by six written decimals.
const UNIT_TOLERANCE: f64 = 1e-5;
/// How far a corner may be outside its card, as a share of the card: from the same rounding.
const OUTLINE_TOLERANCE: f64 = 1e-5;
/// Maximum number of corners of an outline: contacts are searched between all of them.
const MAX_OUTLINE_CORNERS: usize = 256;

impl Scene {
    /// Fails on the first invalid value, named by its path:
    /// `objects[3].size: [0.0, 0.1], expected within 1e-9 to 1000000 (metres)`.
    pub fn check(&self) -> Result<()> {
        self.check_view()?;
        self.check_objects()?;
        self.check_lights()?;
        self.belt.map_or(Ok(()), |belt| belt.check())?;
        self.finish.check()?;
        check_exposure(self.exposure)
    }

    /// Checks the picture, the surface and the camera.
    pub(super) fn check_view(&self) -> Result<()> {
        check_image(self.image)?;
        check_surface(&self.surface)?;
        check_camera(&self.camera)?;
        self.view.check()?;
        self.lens.check()?;
        match &self.camera {
            CameraSource::Known(camera) => {
                check_picture_size(camera, self.image)?;
                self.lens.check_fold(camera)
            }
            CameraSource::Rectangle { .. } => Ok(()),
        }
    }

    fn check_objects(&self) -> Result<()> {
        check_count(self.objects.len(), "objects", MAX_OBJECTS)?;
        check_each(&self.objects, "objects", check_object)
    }

    fn check_lights(&self) -> Result<()> {
        check_count(self.lights.len(), "lights", MAX_LIGHTS)?;
        check_each(&self.lights, "lights", check_light)?;
        check_color(self.ambient, "ambient", &RADIANCE)?;
        self.environment.iter().try_for_each(Environment::check)?;
        check_cast(&self.cast)?;
        self.light_direction.check()?;
        self.light_map.check()?;
        check_color(self.interreflection, "interreflection", &SHARE)
    }
}

fn expect(claim: bool, at: &str, found: impl Debug, expected: impl Display) -> Result<()> {
    if claim {
        Ok(())
    } else {
        Err(Error::value(at, format!("{found:?}, expected {expected}")))
    }
}

/// Path of a field of something: `objects[3].size`.
pub(super) fn field(at: &str, name: &str) -> String {
    format!("{at}.{name}")
}

/// Checks every item of a list by its path: `lights[2]`.
pub(super) fn check_each<T>(
    items: &[T],
    name: &str,
    check: impl Fn(&T, &str) -> Result<()>,
) -> Result<()> {
    items
        .iter()
        .enumerate()
        .try_for_each(|(i, item)| check(item, &format!("{name}[{i}]")))
}

/// Checks that all numbers are within bounds.
fn check_within(numbers: &[f64], at: &str, bounds: &Bounds) -> Result<()> {
    expect(
        numbers.iter().all(|&x| bounds.contains(x)),
        at,
        numbers,
        format_args!("within {bounds}"),
    )
}

/// Checks that a picture of this size can be held in memory.
pub(super) fn check_image(image: [u32; 2]) -> Result<()> {
    let [w, h] = image;
    expect(w > 0 && h > 0, "image", image, "two numbers above 0")?;
    let fits = w.max(h) <= LONGEST_SIDE_PX && u64::from(w) * u64::from(h) <= MOST_PIXELS;
    let expected = format_args!("at most {LONGEST_SIDE_PX} a side and {MOST_PIXELS} in all");
    expect(fits, "image", image, expected)
}

/// Checks that there are no more of something than a scene may have.
pub(super) fn check_count(count: usize, at: &str, most: usize) -> Result<()> {
    expect(count <= most, at, count, format_args!("at most {most}"))
}

fn check_surface(surface: &Surface) -> Result<()> {
    check_within(&surface.size, "surface.size", &LENGTH)?;
    FRICTION.check("surface.friction", surface.friction)?;
    SHARE.check("surface.restitution", surface.restitution)?;
    surface.wall.map_or(Ok(()), |wall| wall.check())
}

fn check_color(color: LinearRgb, at: &str, bounds: &Bounds) -> Result<()> {
    check_within(&color.channels().map(f64::from), at, bounds)
}

/// Fails unless every channel is within bounds; the message shows the channels as they were typed,
/// in single precision.
pub(super) fn check_factors(color: LinearRgb, at: &str, bounds: &Bounds) -> Result<()> {
    let factors = color.channels();
    let are_within = factors.iter().all(|&factor| bounds.contains(factor.into()));
    expect(
        are_within,
        at,
        factors,
        format_args!("three numbers of {bounds}"),
    )
}

fn check_rotation(rotation: &UnitQuaternion<f64>, at: &str) -> Result<()> {
    let norm = rotation.as_ref().norm();
    if (norm - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(());
    }
    Err(Error::value(
        at,
        format!("a quaternion of norm {norm}, expected norm 1"),
    ))
}

fn check_pose(pose: &Pose, at: &str) -> Result<()> {
    let translation = pose.translation.vector;
    check_within(translation.as_slice(), &field(at, "translation"), &PLACE)?;
    check_rotation(&pose.rotation, &field(at, "rotation"))
}

pub(super) fn check_cast(cast: &LightTint) -> Result<()> {
    match *cast {
        LightTint::Known(color) => check_color(color, "cast.known", &RADIANCE),
        LightTint::MatchSurface { share, albedo } => {
            CAST_SHARE.check("cast.match_surface.share", share)?;
            check_albedo(Albedo::Color(albedo), "cast.match_surface.albedo")
        }
    }
}

/// Maximum number of rows and of columns of a grid over the surface.
pub(super) const MAX_CELLS: usize = 64;

/// Whether rows form a grid: equally many cells in each, and not too many; an empty list does, too.
pub(super) fn is_grid<T>(rows: &[Vec<T>]) -> bool {
    let columns = rows.first().map_or(1, Vec::len);
    let sizes = 1..=MAX_CELLS;
    let fits = rows.len() <= MAX_CELLS && sizes.contains(&columns);
    fits && rows.iter().all(|row| row.len() == columns)
}

pub(super) fn check_albedo(albedo: Albedo, at: &str) -> Result<()> {
    albedo
        .range()
        .iter()
        .try_for_each(|&share| ALBEDO.check(at, share))
}

fn check_exposure(exposure: Exposure) -> Result<()> {
    match exposure {
        Exposure::Ev(ev) => SOLVED_EV.check("exposure.ev", ev),
        Exposure::MatchPlate { gain_ev } => EV.check("exposure.match_plate.gain_ev", gain_ev),
        Exposure::MatchSurface { albedo, gain_ev } => {
            check_albedo(albedo, "exposure.match_surface.albedo")?;
            EV.check("exposure.match_surface.gain_ev", gain_ev)
        }
    }
}

fn check_camera(camera: &CameraSource) -> Result<()> {
    match camera {
        CameraSource::Known(camera) => check_known_camera(camera),
        CameraSource::Rectangle {
            corners_px,
            photo,
            focal_px,
        } => {
            check_label(corners_px, *photo)?;
            focal_px.map_or(Ok(()), |f| FOCAL.check("camera.rectangle.focal_px", f))
        }
    }
}

/// Checks the corners of a rectangle in a photo of this size.
fn check_label(corners_px: &[[f64; 2]; 4], photo: [u32; 2]) -> Result<()> {
    let corners = corners_px.as_flattened();
    check_within(corners, "camera.rectangle.corners_px", &PIXEL)?;
    let sides = photo.map(f64::from);
    check_within(&sides, "camera.rectangle.photo", &PHOTO_SIDE)
}

fn check_known_camera(camera: &Camera) -> Result<()> {
    let image = camera.image.map(f64::from);
    check_within(&image, "camera.known.image", &PHOTO_SIDE)?;
    let focal = camera.focal_px.as_slice();
    check_within(focal, "camera.known.focal_px", &FOCAL)?;
    let principal = camera.principal_px.coords.as_slice();
    check_within(principal, "camera.known.principal_px", &PIXEL)?;
    check_pose(&camera.camera_from_world, "camera.known.camera_from_world")
}

/// Checks that a known camera takes the scene's picture.
pub(super) fn check_picture_size(camera: &Camera, image: [u32; 2]) -> Result<()> {
    let expected = format_args!("the scene's image {image:?}");
    let is_same = camera.image == image;
    expect(is_same, "camera.known.image", camera.image, expected)
}

fn check_object(object: &Object, at: &str) -> Result<()> {
    let (asset, is_named) = (&object.asset, !object.asset.is_empty());
    expect(is_named, &field(at, "asset"), asset, "the name of an asset")?;
    check_within(&object.size, &field(at, "size"), &LENGTH)?;
    LENGTH.check(&field(at, "thickness"), object.thickness)?;
    check_outline(&object.outline, object.size, &field(at, "outline"))?;
    MASS.check(&field(at, "mass"), object.mass)?;
    check_grade(&object.grade, &field(at, "grade"))?;
    object.bend.check(&field(at, "bend"))?;
    check_placement(&object.placement, &field(at, "placement"))
}

fn check_grade(grade: &Grade, at: &str) -> Result<()> {
    TURN.check(&field(at, "hue_deg"), grade.hue_deg.into())?;
    GRADE.check(&field(at, "saturation"), grade.saturation.into())?;
    GRADE.check(&field(at, "value"), grade.value.into())?;
    GRADE.check(&field(at, "glints"), grade.glints.into())?;
    check_factors(grade.tint, &field(at, "tint"), &SHARE)
}

fn check_placement(placement: &Placement, at: &str) -> Result<()> {
    match placement {
        Placement::Gone => Ok(()),
        Placement::At(pose) => check_pose(pose, &field(at, "at")),
        Placement::Drop {
            above,
            height,
            rotation,
        } => {
            check_within(above, &field(at, "drop.above"), &PLACE)?;
            LENGTH.check(&field(at, "drop.height"), *height)?;
            check_rotation(rotation, &field(at, "drop.rotation"))
        }
    }
}

/// Checks that an outline is empty or a convex polygon inside its card.
fn check_outline(outline: &[[f64; 2]], size: [f64; 2], at: &str) -> Result<()> {
    check_count(outline.len(), at, MAX_OUTLINE_CORNERS)?;
    let is_polygon = outline.len() != 1 && outline.len() != 2;
    let is_inside = outline.iter().all(|corner| is_on_card(corner, size));
    let is_convex = (0..outline.len()).all(|i| doubled_corner_area(outline, i) > 0.0);
    expect(
        is_polygon && is_inside && is_convex,
        at,
        outline,
        "the corners of a convex polygon on the card, counter-clockwise",
    )
}

fn is_on_card(corner: &[f64; 2], size: [f64; 2]) -> bool {
    (0..2).all(|axis| corner[axis].abs() <= size[axis] * (0.5 + OUTLINE_TOLERANCE))
}

fn check_light(light: &AreaLight, at: &str) -> Result<()> {
    check_within(&light.position, &field(at, "position"), &PLACE)?;
    check_within(&light.target, &field(at, "target"), &PLACE)?;
    expect(
        light.position != light.target,
        &field(at, "target"),
        light.target,
        "a point other than its position",
    )?;
    check_within(&light.size, &field(at, "size"), &LENGTH)?;
    RADIANCE.check(&field(at, "power"), light.power)?;
    check_color(light.color, &field(at, "color"), &RADIANCE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tilted_camera;

    fn scene() -> Scene {
        let lying = Placement::At(Pose::translation(0.1, 0.0, 0.01));
        let object = Object::new("b1", [0.2, 0.1], 0.005, 0.03, lying);
        let falling = Placement::Drop {
            above: [0.0; 2],
            height: 0.3,
            rotation: UnitQuaternion::identity(),
        };
        Scene {
            plate: "tray".into(),
            objects: vec![
                object.clone(),
                Object {
                    placement: falling,
                    ..object
                },
            ],
            lights: vec![AreaLight::new([0.0, 0.0, 1.0], [0.1; 2], 10.0)],
            ambient: LinearRgb::grey(0.5),
            exposure: Exposure::MatchPlate { gain_ev: 0.25 },
            ..Scene::new(
                [64, 48],
                CameraSource::Rectangle {
                    corners_px: [[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]],
                    photo: [10, 10],
                    focal_px: None,
                },
                Surface::new([0.4, 0.3]),
            )
        }
    }

    fn complaint(spoil: impl Fn(&mut Scene)) -> String {
        let mut scene = scene();
        assert!(scene.check().is_ok());
        spoil(&mut scene);
        scene.check().unwrap_err().to_string()
    }

    #[test]
    fn a_complaint_names_the_field_the_value_and_what_was_expected() {
        let reported = complaint(|s| s.objects[1].size = [0.0, 0.1]);
        assert_eq!(
            reported,
            "objects[1].size: [0.0, 0.1], expected within 1e-9 to 1000000 (metres)"
        );
        assert_eq!(
            complaint(|s| s.image = [0, 3]),
            "image: [0, 3], expected two numbers above 0"
        );
        let reported = complaint(|s| s.image = [60_000, 40_000]);
        assert_eq!(
            reported,
            "image: [60000, 40000], expected at most 16384 a side and 67108864 in all"
        );
        let reported = complaint(|s| s.camera = CameraSource::Known(tilted_camera()));
        let [w, h] = tilted_camera().image;
        assert_eq!(
            reported,
            format!("camera.known.image: [{w}, {h}], expected the scene's image [64, 48]")
        );
        let reported = complaint(|s| s.objects = vec![s.objects[0].clone(); 1_001]);
        assert_eq!(reported, "objects: 1001, expected at most 1000");
        let reported = complaint(|s| s.surface.restitution = 1.5);
        assert_eq!(
            reported,
            "surface.restitution: 1.5, expected 0 to 1 (a share)"
        );
        let clockwise = [[0.0, 0.0], [0.0, 0.05], [0.1, 0.0]];
        let reported = complaint(|s| s.objects[0].outline = clockwise.into());
        assert!(
            reported.starts_with("objects[0].outline: [[0.0, 0.0], "),
            "{reported}"
        );
        let reported = complaint(|s| s.lights[0].power = f64::NAN);
        assert_eq!(
            reported,
            "lights[0].power: NaN, expected 0 to 1e9 (what single precision can sum)"
        );
    }

    #[test]
    fn a_quaternion_that_is_no_rotation_is_told() {
        let long = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(2.0, 0.0, 0.0, 0.0));
        let reported = complaint(|s| {
            s.objects[0].placement = Placement::At(Pose::from_parts([0.0; 3].into(), long))
        });
        assert_eq!(
            reported,
            "objects[0].placement.at.rotation: a quaternion of norm 2, expected norm 1"
        );
    }

    #[test]
    fn a_lens_that_folds_the_pictures_of_a_known_camera_is_told() {
        let reported = complaint(|s| {
            s.camera = CameraSource::Known(tilted_camera());
            s.image = tilted_camera().image;
            s.lens.k1 = -1.5;
        });
        assert!(
            reported.starts_with("lens.k1: -1.5, expected at least -0."),
            "{reported}"
        );
    }

    #[test]
    fn a_solved_exposure_may_be_larger_than_a_typed_gain() {
        let exposed = |exposure| {
            Scene {
                exposure,
                ..scene()
            }
            .check()
        };
        assert!(exposed(Exposure::Ev(60.0)).is_ok());
        assert!(exposed(Exposure::Ev(101.0)).is_err());
        assert!(exposed(Exposure::MatchPlate { gain_ev: 33.0 }).is_err());
    }

    #[test]
    fn every_number_is_asked_to_be_finite() {
        let spoils: [fn(&mut Scene); 12] = [
            |s| s.surface.size[1] = f64::INFINITY,
            |s| s.objects[0].thickness = f64::NAN,
            |s| s.objects[0].mass = 0.0,
            |s| s.objects[0].grade.value = f32::NAN,
            |s| s.objects[0].placement = Placement::At(Pose::translation(0.0, f64::NAN, 0.0)),
            |s| {
                s.objects[0].placement = Placement::Drop {
                    above: [f64::NAN; 2],
                    height: 1.0,
                    rotation: UnitQuaternion::identity(),
                }
            },
            |s| s.lights[0].position[0] = f64::NAN,
            |s| s.lights[0].target = s.lights[0].position,
            |s| s.lights[0].size[0] = -1.0,
            |s| s.ambient.g = f32::NAN,
            |s| s.exposure = Exposure::Ev(f64::NAN),
            |s| {
                s.camera = CameraSource::Rectangle {
                    corners_px: [[f64::NAN; 2]; 4],
                    photo: [1, 1],
                    focal_px: None,
                }
            },
        ];
        spoils
            .iter()
            .for_each(|spoil| assert!(complaint(spoil).contains("expected")));
    }

    #[test]
    fn a_scene_comes_back_from_toml_and_json_as_it_was() {
        let scene = scene();
        let text = toml::to_string(&scene).unwrap();
        assert_eq!(toml::from_str::<Scene>(&text).unwrap(), scene);
        let text = serde_json::to_string(&scene).unwrap();
        assert_eq!(serde_json::from_str::<Scene>(&text).unwrap(), scene);
    }
}
