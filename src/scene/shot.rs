//! A scene without unknowns: what the renderer takes.

use crate::asset::{SurfaceCache, Texture};
use crate::camera::{Camera, RadialDistortion};
use crate::deep::HoldoutSample;
use crate::geom::{Point2, Quad, Vector3};
use crate::image::Image;
use crate::pixel::{LinearRgb, ObjectId};
use crate::scene::{
    AreaLight, Bend, EdgeTreatment, EnvironmentMap, Grade, LightGrid, Refraction, ThinLens,
};
use std::sync::Arc;

/// Everything that a picture consists of, in memory and known.
///
/// A generator that needs no files may build one in code:
/// `Shot::new(camera).with_plate(plate).with_card(card).with_light(light)`.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The camera; its `image` is the size of the picture.
    pub camera: Camera,
    /// OpenCV's first coefficient of its lens's radial distortion, which the plate already has.
    pub k1: f64,
    /// Its aperture and focus; none if everything is sharp.
    pub thin_lens: Option<ThinLens>,
    /// Background, of the picture's size; none for a transparent one.
    pub plate: Option<Arc<Image<LinearRgb>>>,
    /// Width and height of the part of `z = 0` that receives shadows, metres, centred.
    pub catcher: [f64; 2],
    /// Cards, in any order.
    pub cards: Vec<Card>,
    /// Area lights.
    pub lights: Vec<AreaLight>,
    /// Radiance of a constant environment.
    pub ambient: LinearRgb,
    /// Light from an environment map, in addition to `ambient`.
    pub environment: Option<EnvironmentMap>,
    /// Factors on the light that falls on cards, by their position over the surface.
    pub light_grid: Option<LightGrid>,
    /// Albedo of the surface for interreflection between it and the cards; black for none.
    pub interreflection: LinearRgb,
    /// Factor from rendered radiance to plate values.
    pub exposure: f32,
    /// What stands in front of objects, of the picture's size; none for nothing.
    pub holdout: Option<Arc<Image<HoldoutSample>>>,
    /// How far cards move during the exposure, along x and y, metres.
    #[doc(hidden)]
    pub motion_m: [f64; 2],
    /// Treatment of the edges of cards; labels are made from untreated ones.
    pub edges: EdgeTreatment,
}

/// A textured, see-through object in space, flat or curved.
#[derive(Clone, Debug)]
pub struct Card {
    /// Its name in labels; not 0.
    pub id: ObjectId,
    /// Index into the class list; none for a distractor, which is rendered like any other card but
    /// has no label.
    pub class: Option<u32>,
    /// Position and size.
    pub quad: Quad,
    /// The cut-out, premultiplied, scene-linear.
    pub texture: Texture,
    /// Texture of the back, the side that faces along `-z` of the card, the right way round as seen
    /// from there; none for the front, seen through. Whoever looks through a card (the eye, or a
    /// receiver of light) looks through the side that faces it.
    pub back: Option<Texture>,
    /// Its outline in texture coordinates (0 to 1, right and down), in order.
    pub outline_uv: Arc<[Point2<f64>]>,
    /// Change of its colours.
    pub grade: Grade,
    /// Its bend.
    pub bend: Bend,
    /// How it displaces what is seen through it.
    #[doc(hidden)]
    pub refraction: Refraction,
    /// Which surface each texel of its front and of its back shows.
    #[doc(hidden)]
    pub surfaces: [SurfaceCache; 2],
}

impl Card {
    /// A card of class 0 with its whole texture as the outline, in its own colours.
    pub fn new(id: ObjectId, quad: Quad, texture: impl Into<Texture>) -> Self {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        Self {
            id,
            class: Some(0),
            quad,
            texture: texture.into(),
            back: None,
            outline_uv: corners.map(Point2::from).into(),
            grade: Grade::default(),
            bend: Bend::default(),
            refraction: Refraction::default(),
            surfaces: Default::default(),
        }
    }

    /// Inverse depth of its plane at a pixel position, 1/metres; larger is nearer.
    pub(crate) fn inverse_depth(&self, camera: &Camera, px: Point2<f64>) -> f64 {
        let plane = self.quad.plane();
        let ray = camera.ray(px);
        let distance = plane.offset - plane.normal.dot(&ray.origin.coords);
        plane.normal.dot(&ray.direction) / distance
    }
}

impl Shot {
    /// Factor on the light of a card at a point.
    pub(crate) fn light_factor_at(&self, point: &Vector3<f64>) -> f32 {
        let grid = self.light_grid.as_ref();
        grid.map_or(1.0, |grid| grid.factor_at(point.x, point.y))
    }

    /// An empty shot: no plate, no card, no light, black ambient.
    pub fn new(camera: Camera) -> Self {
        Self {
            camera,
            k1: 0.0,
            thin_lens: None,
            plate: None,
            catcher: [f64::INFINITY; 2],
            cards: Vec::new(),
            lights: Vec::new(),
            ambient: LinearRgb::BLACK,
            environment: None,
            light_grid: None,
            interreflection: LinearRgb::BLACK,
            exposure: 1.0,
            holdout: None,
            motion_m: [0.0; 2],
            edges: EdgeTreatment::AsIs,
        }
    }

    /// With a background.
    ///
    /// # Panics
    /// If its size is not the camera's.
    pub fn with_plate(mut self, plate: Arc<Image<LinearRgb>>) -> Self {
        let size = (self.camera.image[0] as usize, self.camera.image[1] as usize);
        assert_eq!(plate.size(), size, "plate and camera differ in size");
        self.plate = Some(plate);
        self
    }

    /// With a lens of this k1, which the plate already has.
    #[doc(hidden)]
    pub fn with_k1(mut self, k1: f64) -> Self {
        self.k1 = k1;
        self
    }

    /// Maps where the camera would see a point without its lens to where the picture shows it.
    #[doc(hidden)]
    pub fn distortion(&self) -> RadialDistortion {
        RadialDistortion::new(&self.camera, self.k1)
    }

    /// With one more card.
    pub fn with_card(mut self, card: Card) -> Self {
        self.cards.push(card);
        self
    }

    /// With one more light.
    pub fn with_light(mut self, light: AreaLight) -> Self {
        self.lights.push(light);
        self
    }

    /// With a constant environment of this radiance.
    pub fn with_ambient(mut self, ambient: LinearRgb) -> Self {
        self.ambient = ambient;
        self
    }

    /// With light from an environment map.
    pub fn with_environment(mut self, environment: EnvironmentMap) -> Self {
        self.environment = Some(environment);
        self
    }
}
