//! Is a scene possible? Asked once, before any work.

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geom::UnitQuaternion;
use crate::pixel::LinearRgb;
use crate::scene::hull::turn;
use crate::scene::{AreaLight, CameraSource, Cast, Exposure, Object, Placement, Scene, Surface};
use std::fmt::Debug;

/// How far the norm of a quaternion may be from 1: what six written decimals leave.
const UNIT_TOLERANCE: f64 = 1e-5;
/// How far a corner may be outside its card, as a share of the card: the same decimals.
const OUTLINE_TOLERANCE: f64 = 1e-5;

impl Scene {
    /// Fails on the first value that cannot be right, by its path: `objects[3].size: [0.0, 0.1], expected two lengths
    /// above 0`.
    pub fn check(&self) -> Result<()> {
        expect(self.image.iter().all(|&n| n > 0), "image", self.image, "two numbers above 0")?;
        expect_lengths(self.surface.size, "surface.size")?;
        let Surface { friction, restitution, .. } = self.surface;
        expect(friction.is_finite() && friction >= 0.0, "surface.friction", friction, "at least 0")?;
        expect((0.0..=1.0).contains(&restitution), "surface.restitution", restitution, "0 to 1")?;
        check_camera(&self.camera)?;
        each(&self.objects, "objects", check_object)?;
        each(&self.lights, "lights", check_light)?;
        expect_color(self.ambient, "ambient")?;
        self.environment.as_ref().map_or(Ok(()), |map| map.check("environment"))?;
        check_cast(&self.cast)?;
        self.finish.check("finish")?;
        match self.exposure {
            Exposure::Ev(ev) => expect(ev.is_finite(), "exposure.ev", ev, "a finite number"),
            Exposure::MatchPlate { gain_ev } => {
                expect(gain_ev.is_finite(), "exposure.match_plate.gain_ev", gain_ev, "a finite number")
            }
            Exposure::MatchSurface { albedo, gain_ev } => {
                expect(is_length(albedo), "exposure.match_surface.albedo", albedo, "a number above 0")?;
                expect(gain_ev.is_finite(), "exposure.match_surface.gain_ev", gain_ev, "a finite number")
            }
        }
    }
}

fn expect(claim: bool, at: &str, found: impl Debug, expected: &str) -> Result<()> {
    if claim { Ok(()) } else { Err(Error::value(at, format!("{found:?}, expected {expected}"))) }
}

fn each<T>(items: &[T], name: &str, check: impl Fn(&T, &str) -> Result<()>) -> Result<()> {
    items.iter().enumerate().try_for_each(|(i, item)| check(item, &format!("{name}[{i}]")))
}

fn is_length(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

fn expect_lengths(size: [f64; 2], at: &str) -> Result<()> {
    expect(size.iter().all(|&x| is_length(x)), at, size, "two lengths above 0")
}

fn expect_finite(numbers: &[f64], at: &str) -> Result<()> {
    expect(numbers.iter().all(|x| x.is_finite()), at, numbers, "finite numbers")
}

fn expect_unit(rotation: &UnitQuaternion<f64>, at: &str) -> Result<()> {
    let norm = rotation.as_ref().norm();
    let found = format_args!("a quaternion of norm {norm}").to_string();
    if (norm - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(());
    }
    Err(Error::value(at, format!("{found}, expected norm 1")))
}

fn expect_color(color: LinearRgb, at: &str) -> Result<()> {
    let LinearRgb { r, g, b } = color;
    expect([r, g, b].iter().all(|x| x.is_finite() && *x >= 0.0), at, [r, g, b], "three numbers of at least 0")
}

fn check_cast(cast: &Cast) -> Result<()> {
    match *cast {
        Cast::Known(color) => expect_color(color, "cast.known"),
        Cast::MatchSurface { share } => {
            expect(share.is_finite(), "cast.match_surface.share", share, "a finite number, 0 to 1 as a rule")
        }
    }
}

fn check_camera(camera: &CameraSource) -> Result<()> {
    match camera {
        CameraSource::Known(camera) => check_known_camera(camera),
        CameraSource::Rectangle { corners_px, photo, focal_px } => {
            let at = |field: &str| format!("camera.rectangle.{field}");
            expect(
                corners_px.iter().flatten().all(|x| x.is_finite()),
                &at("corners_px"),
                corners_px,
                "finite numbers",
            )?;
            expect(photo.iter().all(|&n| n > 0), &at("photo"), photo, "two numbers above 0")?;
            focal_px.map_or(Ok(()), |f| expect(is_length(f), &at("focal_px"), f, "a length above 0"))
        }
    }
}

fn check_known_camera(camera: &Camera) -> Result<()> {
    expect(camera.image.iter().all(|&n| n > 0), "camera.known.image", camera.image, "two numbers above 0")?;
    expect_lengths([camera.focal_px.x, camera.focal_px.y], "camera.known.focal_px")?;
    expect_finite(camera.principal_px.coords.as_slice(), "camera.known.principal_px")?;
    let pose = &camera.camera_from_world;
    expect_finite(pose.translation.vector.as_slice(), "camera.known.camera_from_world.translation")?;
    expect_unit(&pose.rotation, "camera.known.camera_from_world.rotation")
}

fn check_object(object: &Object, at: &str) -> Result<()> {
    let field = |name: &str| format!("{at}.{name}");
    expect(!object.asset.is_empty(), &field("asset"), &object.asset, "the name of an asset")?;
    expect_lengths(object.size, &field("size"))?;
    expect(is_length(object.thickness), &field("thickness"), object.thickness, "a length above 0")?;
    check_outline(&object.outline, object.size, &field("outline"))?;
    expect(is_length(object.mass), &field("mass"), object.mass, "a mass above 0")?;
    let grade = [object.grade.hue_deg, object.grade.saturation, object.grade.value].map(f64::from);
    expect_finite(&grade, &field("grade"))?;
    match &object.placement {
        Placement::At(pose) => {
            expect_finite(pose.translation.vector.as_slice(), &field("placement.at.translation"))?;
            expect_unit(&pose.rotation, &field("placement.at.rotation"))
        }
        Placement::Drop { above, height, rotation } => {
            expect_finite(above, &field("placement.drop.above"))?;
            expect(is_length(*height), &field("placement.drop.height"), height, "a length above 0")?;
            expect_unit(rotation, &field("placement.drop.rotation"))
        }
    }
}

/// A convex polygon inside its card, or nothing.
fn check_outline(outline: &[[f64; 2]], size: [f64; 2], at: &str) -> Result<()> {
    let inside = |p: &[f64; 2]| (0..2).all(|axis| p[axis].abs() <= size[axis] * (0.5 + OUTLINE_TOLERANCE));
    let around = outline.len() != 1 && outline.len() != 2 && outline.iter().all(inside);
    let left = (0..outline.len()).all(|i| turn(outline, i) > 0.0);
    expect(around && left, at, outline, "the corners of a convex polygon on the card, counter-clockwise")
}

fn check_light(light: &AreaLight, at: &str) -> Result<()> {
    let field = |name: &str| format!("{at}.{name}");
    expect_finite(&light.position, &field("position"))?;
    expect_finite(&light.target, &field("target"))?;
    expect(light.position != light.target, &field("target"), light.target, "another point than its position")?;
    expect_lengths(light.size, &field("size"))?;
    expect(light.power.is_finite() && light.power >= 0.0, &field("power"), light.power, "at least 0")?;
    expect_color(light.color, &field("color"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Pose;
    use crate::scene::{Grade, LightShape};

    fn scene() -> Scene {
        let object = Object {
            asset: "b1".into(),
            photo: 0,
            back: None,
            size: [0.2, 0.1],
            thickness: 0.005,
            outline: vec![],
            mass: 0.03,
            placement: Placement::At(Pose::translation(0.1, 0.0, 0.01)),
            grade: Grade::default(),
        };
        let falling = Placement::Drop { above: [0.0; 2], height: 0.3, rotation: UnitQuaternion::identity() };
        let light = AreaLight {
            shape: LightShape::Rectangle,
            position: [0.0, 0.0, 1.0],
            target: [0.0; 3],
            size: [0.1; 2],
            power: 10.0,
            color: LinearRgb::WHITE,
        };
        Scene {
            image: [64, 48],
            plate: "tray".into(),
            camera: CameraSource::Rectangle {
                corners_px: [[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]],
                photo: [10, 10],
                focal_px: None,
            },
            surface: Surface::new([0.4, 0.3]),
            objects: vec![object.clone(), Object { placement: falling, ..object }],
            lights: vec![light],
            ambient: LinearRgb::grey(0.5),
            environment: None,
            exposure: Exposure::MatchPlate { gain_ev: 0.25 },
            cast: Default::default(),
            finish: Default::default(),
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
        let told = complaint(|s| s.objects[1].size = [0.0, 0.1]);
        assert_eq!(told, "objects[1].size: [0.0, 0.1], expected two lengths above 0");
        assert_eq!(complaint(|s| s.image = [0, 3]), "image: [0, 3], expected two numbers above 0");
        let told = complaint(|s| s.surface.restitution = 1.5);
        assert_eq!(told, "surface.restitution: 1.5, expected 0 to 1");
        let clockwise = [[0.0, 0.0], [0.0, 0.05], [0.1, 0.0]];
        let told = complaint(|s| s.objects[0].outline = clockwise.into());
        assert!(told.starts_with("objects[0].outline: [[0.0, 0.0], "), "{told}");
        let told = complaint(|s| s.lights[0].power = f64::NAN);
        assert_eq!(told, "lights[0].power: NaN, expected at least 0");
    }

    #[test]
    fn a_quaternion_that_is_no_rotation_is_told() {
        let long = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(2.0, 0.0, 0.0, 0.0));
        let told = complaint(|s| s.objects[0].placement = Placement::At(Pose::from_parts([0.0; 3].into(), long)));
        assert_eq!(told, "objects[0].placement.at.rotation: a quaternion of norm 2, expected norm 1");
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
                s.objects[0].placement =
                    Placement::Drop { above: [f64::NAN; 2], height: 1.0, rotation: UnitQuaternion::identity() }
            },
            |s| s.lights[0].position[0] = f64::NAN,
            |s| s.lights[0].target = s.lights[0].position,
            |s| s.lights[0].size[0] = -1.0,
            |s| s.ambient.g = f32::NAN,
            |s| s.exposure = Exposure::Ev(f64::NAN),
            |s| s.camera = CameraSource::Rectangle { corners_px: [[f64::NAN; 2]; 4], photo: [1, 1], focal_px: None },
        ];
        spoils.iter().for_each(|spoil| assert!(complaint(spoil).contains("expected")));
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
