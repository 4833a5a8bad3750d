//! From a scene without unknowns to a shot.

use crate::asset::{Panorama, SurfaceCache, Texture};
use crate::camera::{Camera, RadialDistortion};
use crate::error::{Error, Result};
use crate::filter::{sample_bilinear_clamped, sample_cubic_clamped};
use crate::geom::{Point2, Pose, Quad};
use crate::image::Image;
use crate::matte::Flow;
use crate::pixel::{LinearRgb, ObjectId};
use crate::scene::check::check_picture_size;
use crate::scene::{
    AreaLight, Blur, CameraSource, Card, EnvironmentMap, Exposure, LightGrid, LightMap, LightTint,
    Noise, Object, Placement, Refraction, Scene, Shot,
};
use std::sync::Arc;

/// Appearance of an object: everything that a shot needs from its asset.
#[derive(Clone, Debug)]
pub struct Appearance {
    /// Index into the class list; none for a distractor.
    pub class: Option<u32>,
    /// The cut-out, premultiplied, scene-linear.
    pub texture: Texture,
    /// What its back shows; none for its front, seen through.
    pub back: Option<Texture>,
    /// Its outline in texture coordinates (0 to 1, right and down), in order.
    pub outline_uv: Arc<[Point2<f64>]>,
    /// How its front and its back displace what is seen through them.
    #[doc(hidden)]
    pub flows: [Option<Arc<Flow>>; 2],
    /// Which surface each texel of its front and of its back shows.
    #[doc(hidden)]
    pub surfaces: [SurfaceCache; 2],
}

impl Appearance {
    /// A card with this appearance, at rest at the object's pose (`world_from_card`).
    fn into_card(self, id: ObjectId, object: &Object, world_from_card: Pose) -> Card {
        Card {
            id,
            class: self.class,
            quad: Quad {
                world_from_card,
                size: object.size,
            },
            texture: self.texture,
            back: self.back,
            outline_uv: self.outline_uv,
            grade: object.grade,
            bend: object.bend,
            refraction: Refraction {
                flows: self.flows,
                thickness: object.thickness,
            },
            surfaces: self.surfaces,
        }
    }
}

impl Scene {
    /// The shot that this scene describes, once it has no unknowns.
    ///
    /// `look` returns an object's appearance, or none if its asset or photo is missing; for a
    /// library that is [`Appearance::from_library`]. `plate` is the background at the picture's
    /// size, or larger if view or lens zooms in; without one, the background is transparent.
    /// `panorama` is the picture that the scene's environment names. Object `i` gets id `i + 1`;
    /// the shadow catcher is the whole plane of the labelled surface.
    ///
    /// # Errors
    /// The first unknown that is left (`objects[3].placement: still falling; settle it first`); an
    /// invalid value ([`check`](Self::check)); an asset or photo that `look` does not find; a plate
    /// of the wrong size; an environment without its picture.
    pub fn resolve(
        &self,
        look: impl Fn(&Object) -> Result<Option<Appearance>>,
        plate: Option<Arc<Image<LinearRgb>>>,
        panorama: Option<Arc<Panorama>>,
    ) -> Result<Shot> {
        self.check()?;
        let camera = self.known_camera()?;
        let exposure = self.known_exposure()?;
        let cast = self.known_cast()?;
        if let Some(plate) = &plate {
            self.check_plate(plate)?;
        }
        let seen = self.view.camera(&self.lens.camera(&camera));
        let distortion = RadialDistortion::new(&seen, self.lens.k1);
        Ok(Shot {
            holdout: self.surface.holdout(&seen, &distortion).map(Arc::new),
            camera: seen,
            k1: self.lens.k1,
            thin_lens: self.lens.thin_lens(&camera),
            plate: plate.map(|plate| self.shown_plate(&camera, plate)),
            catcher: [f64::INFINITY; 2],
            cards: self.cards(look)?,
            lights: self.tinted_lights(cast),
            ambient: self.ambient * cast,
            light_grid: self.light_grid()?,
            interreflection: self.interreflection,
            environment: self.environment_map(panorama)?,
            exposure,
            motion_m: self.belt.map_or([0.0; 2], |belt| belt.motion_m),
            edges: self.edges,
        })
    }

    /// The visible part of the plate.
    fn shown_plate(&self, camera: &Camera, plate: Arc<Image<LinearRgb>>) -> Arc<Image<LinearRgb>> {
        let [across, down] = self.detail_of(&plate);
        if self.lens.moves_plate() {
            return Arc::new(self.shown(camera, |at| {
                sample_cubic_clamped(&plate, at.x * across, at.y * down).map(|v| v.max(0.0))
            }));
        }
        if self.view.is_whole() && [across, down] == [1.0; 2] {
            return plate;
        }
        Arc::new(self.shown(camera, |at| {
            sample_bilinear_clamped(&plate, at.x * across, at.y * down)
        }))
    }

    /// Columns and rows of a plate (or of its mask) per pixel of the picture.
    pub(super) fn detail_of<P: Copy>(&self, plate: &Image<P>) -> [f64; 2] {
        let ([width, height], (w, h)) = (self.image.map(f64::from), plate.size());
        [w as f64 / width, h as f64 / height]
    }

    /// Pixels of the picture per pixel of a plate, as shown.
    pub(crate) fn plate_px(&self, plate: &Image<LinearRgb>) -> f64 {
        self.zoom_used() / self.detail_of(plate)[0]
    }

    /// Magnification relative to the photo.
    pub(crate) fn zoom_used(&self) -> f64 {
        match &self.camera {
            CameraSource::Known(camera) => self.view.zoom_used(camera) * self.lens.zoom(camera),
            CameraSource::Rectangle { .. } => 1.0,
        }
    }

    /// What the view and the lens show of values known all over the photo; `camera` is that of the
    /// whole photo.
    pub(crate) fn shown<P: Copy + Send + Sync>(
        &self,
        camera: &Camera,
        value: impl Fn(Point2<f64>) -> P + Sync,
    ) -> Image<P> {
        if self.lens.moves_plate() {
            let bent = self.lens.camera(camera);
            return self
                .view
                .plate(&bent, |px| value(self.lens.photo_px(camera, px)));
        }
        self.view.plate(camera, value)
    }

    fn cards(&self, look: impl Fn(&Object) -> Result<Option<Appearance>>) -> Result<Vec<Card>> {
        let numbered = self.objects.iter().enumerate();
        let there = numbered.filter(|(_, object)| object.placement != Placement::Gone);
        there
            .map(|(i, object)| Ok(self.carried(resting_card(i, object, &look)?)))
            .collect()
    }

    /// A card where the belt has moved it.
    fn carried(&self, mut card: Card) -> Card {
        if let Some(belt) = &self.belt {
            let [x, y] = belt.offset_m;
            card.quad.world_from_card = Pose::translation(x, y, 0.0) * card.quad.world_from_card;
        }
        card
    }

    fn tinted_lights(&self, tint: LinearRgb) -> Vec<AreaLight> {
        let lights = self.lights.iter();
        lights
            .map(|light| AreaLight {
                color: light.color * tint,
                ..*light
            })
            .collect()
    }

    /// The environment map that it names, in memory.
    pub(crate) fn environment_map(
        &self,
        panorama: Option<Arc<Panorama>>,
    ) -> Result<Option<EnvironmentMap>> {
        let Some(named) = self.environment.as_ref().filter(|named| named.shines()) else {
            return Ok(None);
        };
        let panorama = panorama.ok_or_else(|| missing_panorama(&named.file))?;
        Ok(Some(EnvironmentMap {
            panorama,
            rotation: named.rotation_deg.to_radians(),
            strength: named.strength as f32,
        }))
    }

    fn known_camera(&self) -> Result<Camera> {
        let CameraSource::Known(camera) = self.camera else {
            let what = "still a rectangle in a photo; locate it first";
            return Err(Error::value("camera", what));
        };
        check_picture_size(&camera, self.image)?;
        Ok(camera)
    }

    fn known_exposure(&self) -> Result<f32> {
        match self.exposure {
            Exposure::Ev(ev) => Ok(libm::exp2(ev) as f32),
            Exposure::MatchPlate { .. } | Exposure::MatchSurface { .. } => {
                Err(unmatched("exposure"))
            }
        }
    }

    fn known_cast(&self) -> Result<LinearRgb> {
        if self.finish.noise == Noise::MatchPlate {
            return Err(unmatched("finish.noise"));
        }
        if self.finish.blur_px == Blur::MatchPlate {
            return Err(unmatched("finish.blur_px"));
        }
        if !self.light_direction.is_known() {
            return Err(unmatched("light_direction"));
        }
        match self.cast {
            LightTint::Known(color) => Ok(color),
            LightTint::MatchSurface { .. } => Err(unmatched("cast")),
        }
    }

    fn light_grid(&self) -> Result<Option<LightGrid>> {
        match &self.light_map {
            LightMap::Known(rows) => Ok(LightGrid::new(rows, self.surface.size)),
            LightMap::MatchSurface { .. } => Err(unmatched("light_map")),
        }
    }

    fn check_plate(&self, plate: &Image<LinearRgb>) -> Result<()> {
        let ((w, h), [width, height]) = (plate.size(), self.image);
        let [across, down] = self.detail_of(plate);
        // Half a pixel on either side is rounding.
        let tolerance = 1.0 / f64::from(width.min(height));
        if across >= 1.0 && down >= 1.0 && (across - down).abs() < tolerance {
            return Ok(());
        }
        let expected = format!("{width} x {height} or larger with the same aspect ratio");
        let what = format!("{w} x {h} pixels, expected {expected}");
        Err(Error::value("plate", what))
    }
}

fn unmatched(at: &str) -> Error {
    Error::value(at, "not matched to the plate yet; light it first")
}

fn missing_panorama(file: &str) -> Error {
    let what = format!("\"{file}\", but its picture was not given");
    Error::value("environment.file", what)
}

fn resting_card(
    i: usize,
    object: &Object,
    look: impl Fn(&Object) -> Result<Option<Appearance>>,
) -> Result<Card> {
    let Placement::At(pose) = object.placement else {
        let at = format!("objects[{i}].placement");
        return Err(Error::value(at, "still falling; settle it first"));
    };
    let look = look(object).map_err(|e| e.within(&format!("objects[{i}]")))?;
    let look = look.ok_or_else(|| unknown_asset(i, object))?;
    // A scene has few objects, as checked.
    Ok(look.into_card(ObjectId(i as u32 + 1), object, pose))
}

fn unknown_asset(i: usize, object: &Object) -> Error {
    let what = format!(
        "\"{}\", photo {}, expected one in the library",
        object.asset, object.photo
    );
    Error::value(format!("objects[{i}].asset"), what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{UnitQuaternion, Vector2};
    use crate::pixel::PremulRgba;
    use crate::scene::{Lens, Surface, View};

    fn camera() -> Camera {
        Camera {
            image: [8, 6],
            focal_px: Vector2::new(10.0, 10.0),
            principal_px: Point2::new(4.0, 3.0),
            camera_from_world: Pose::translation(0.0, 0.0, 1.0),
        }
    }

    fn scene() -> Scene {
        let lying = Placement::At(Pose::translation(0.1, 0.0, 0.01));
        let object = Object::new("b1", [0.2, 0.1], 0.005, 0.03, lying);
        Scene {
            objects: vec![object.clone(), object],
            ambient: LinearRgb::WHITE,
            exposure: Exposure::Ev(1.0),
            ..Scene::new(
                [8, 6],
                CameraSource::Known(camera()),
                Surface::new([0.4, 0.3]),
            )
        }
    }

    fn look(object: &Object) -> Result<Option<Appearance>> {
        let texture = Texture::from(Image::filled(2, 2, PremulRgba::default()));
        let outline_uv: Arc<[Point2<f64>]> = Arc::from([Point2::new(0.0, 0.0)]);
        Ok((object.asset == "b1").then_some(Appearance {
            class: Some(3),
            texture,
            back: None,
            outline_uv,
            flows: Default::default(),
            surfaces: Default::default(),
        }))
    }

    fn complaint(spoil: impl Fn(&mut Scene)) -> String {
        let mut scene = scene();
        spoil(&mut scene);
        scene.resolve(look, None, None).unwrap_err().to_string()
    }

    #[test]
    fn a_known_scene_becomes_a_shot() {
        let shot = scene().resolve(look, None, None).unwrap();
        assert_eq!(
            shot.cards.iter().map(|c| c.id).collect::<Vec<_>>(),
            [ObjectId(1), ObjectId(2)]
        );
        assert_eq!(
            (shot.exposure, shot.catcher, shot.cards[0].class),
            (2.0, [f64::INFINITY; 2], Some(3))
        );
    }

    #[test]
    fn an_unknown_is_told_with_the_stage_that_finds_it() {
        let falling = Placement::Drop {
            above: [0.0; 2],
            height: 0.3,
            rotation: UnitQuaternion::identity(),
        };
        let reported = complaint(|s| s.objects[1].placement = falling);
        assert_eq!(
            reported,
            "objects[1].placement: still falling; settle it first"
        );
        type Spoil = fn(&mut Scene);
        let unmatched: [(&str, Spoil); 4] = [
            ("exposure", |s| {
                s.exposure = Exposure::MatchPlate { gain_ev: 0.0 }
            }),
            ("cast", |s| {
                s.cast = LightTint::MatchSurface {
                    share: 1.0,
                    albedo: LinearRgb::WHITE,
                }
            }),
            ("finish.noise", |s| s.finish.noise = Noise::MatchPlate),
            ("finish.blur_px", |s| s.finish.blur_px = Blur::MatchPlate),
        ];
        for (at, spoil) in unmatched {
            let expected = format!("{at}: not matched to the plate yet; light it first");
            assert_eq!(complaint(spoil), expected);
        }
        let rectangle = CameraSource::Rectangle {
            corners_px: [[0.0; 2]; 4],
            photo: [8, 6],
            focal_px: None,
        };
        assert_eq!(
            complaint(|s| s.camera = rectangle),
            "camera: still a rectangle in a photo; locate it first"
        );
    }

    #[test]
    fn an_asset_that_the_library_lacks_is_told() {
        let reported = complaint(|s| s.objects[1].asset = "b9".into());
        assert_eq!(
            reported,
            "objects[1].asset: \"b9\", photo 0, expected one in the library"
        );
    }

    #[test]
    fn what_is_wrong_with_an_object_s_look_is_told_at_the_object() {
        let refuse = |_: &Object| Err(Error::value("back", "9, expected 0"));
        let refusal = scene().resolve(refuse, None, None).unwrap_err();
        assert_eq!(refusal.to_string(), "objects[0].back: 9, expected 0");
    }

    #[test]
    fn a_zoom_shows_the_detail_of_a_larger_plate() {
        // Stripes of one column at three times the picture's size.
        let plate = Image::from_fn(24, 18, |x, _| LinearRgb::grey((x % 2) as f32));
        let view = View {
            zoom: 3.0,
            ..View::default()
        };
        let zoomed = Scene { view, ..scene() };
        let shot = zoomed.resolve(look, Some(Arc::new(plate)), None).unwrap();
        let row: Vec<f32> = shot.plate.unwrap().row(2).iter().map(|c| c.g).collect();
        assert_eq!(row, [0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn a_barrel_that_bends_the_plate_zooms_in() {
        let lens = Lens {
            k1: -0.1,
            bends_plate: true,
            ..Lens::default()
        };
        let bent = Scene { lens, ..scene() };
        let shot = bent.resolve(look, None, None).unwrap();
        let ratio = shot.camera.focal_px.x / camera().focal_px.x;
        assert!(ratio > 1.0);
        assert_eq!(bent.zoom_used(), ratio);
        let unmoved = Lens {
            bends_plate: false,
            ..lens
        };
        let taken_so = Scene {
            lens: unmoved,
            ..scene()
        };
        assert_eq!(taken_so.zoom_used(), 1.0);
    }

    #[test]
    fn a_plate_of_another_size_is_told() {
        let plate = Arc::new(Image::filled(3, 6, LinearRgb::BLACK));
        let reported = scene()
            .resolve(look, Some(plate), None)
            .unwrap_err()
            .to_string();
        assert_eq!(
            reported,
            "plate: 3 x 6 pixels, expected 8 x 6 or larger with the same aspect ratio"
        );
    }
}
