//! Recipe: the distributions that scenes are drawn from.

mod compose;
mod narrow;
mod ranges;
mod selection;

pub use ranges::{GradeRanges, LightRanges};
pub use selection::{Collider, Selections};

use crate::bounds::Bounds;
use crate::color::Albedo;
use crate::error::{Error, Result};
use crate::scene::belt::SequencePlace;
use crate::scene::bounds::{BEND, EV, FRICTION, MAX_LIGHTS, MAX_OBJECTS, RADIANCE, SCALE, SHARE};
use crate::scene::check::{check_albedo, check_cast, check_count, check_each, check_image};
use crate::scene::stack::too_large;
use crate::scene::{
    AssetVariant, Background, BeltRanges, Count, DrawLog, Drawn, DropRanges, EdgeTreatment,
    EnvironmentRanges, LensRanges, LightDirectionSource, LightMap, LightTint, PostProcessRanges,
    Range, Scene, SettleOptions, Surface, Take, Variation, ViewRanges, WallRanges,
};
use compose::{Places, SceneNumber};
use serde::{Deserialize, Serialize};

const OBJECT_COUNT: Bounds = Bounds::new(0.0, MAX_OBJECTS as f64, "what comes to rest in a heap");

/// Distributions that scenes are drawn from; every [`Range`] is a uniform distribution named by its
/// path in this document.
///
/// Every field has a default, so a file only needs the values that differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Recipe {
    /// Width and height of the pictures, pixels. Default: `[640, 480]`.
    pub image: [u32; 2],
    /// Sources of variation that are switched off; all other draws stay the same. Default: none.
    pub off: Vec<Variation>,
    /// Labelled backgrounds that objects fall on, each a viewpoint: all, or the first ones.
    /// Default: `"all"`.
    pub viewpoints: Take,
    /// The visible part of the photo. Default: all of it.
    pub view: ViewRanges,
    /// Lens of the camera. Default: that of the photo, in focus everywhere.
    pub lens: LensRanges,
    /// Photos used of each asset: all, or the first ones. Default: `"all"`.
    pub photos: Take,
    /// Number of objects in a scene. Default: `[4, 12]`.
    pub objects: Count,
    /// Number of distractors in a scene: assets of that role fall among the objects, hide them and
    /// cast shadows, but have no label. Default: 0.
    #[serde(skip_serializing_if = "Count::is_zero")]
    pub distractors: Count,
    /// Whether an asset occurs at most once in a scene: more objects (or distractors) than assets
    /// are then an error. Default: false, assets repeat once all are in the scene.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub at_most_once: bool,
    /// Share of scenes without any object or distractor, 0 to 1; they use all backgrounds, whatever
    /// `viewpoints` says. Default: 0.
    pub negatives: f64,
    /// Number of different selections of objects. Default: `"unique"`, a new one for every scene.
    pub selections: Selections,
    /// Factor on an object's size and thickness; the mass follows. Default: `[0.9, 1.1]`.
    pub scale: Range,
    /// Positions and rotations in which objects start.
    pub start: DropRanges,
    /// Change of an object's colours.
    pub grade: GradeRanges,
    /// Bend of an object's card about a random axis in it, degrees from end to end; if positive,
    /// its ends are nearer to a viewer of its front. Default: 0.
    pub bend_deg: Range,
    /// Edge treatments of cut-outs, one drawn for each picture. Default: none, edges stay as they
    /// are.
    pub edges: Vec<EdgeTreatment>,
    /// Lights; `lights = []` gives scenes without shadows. Default: one.
    pub lights: Vec<LightRanges>,
    /// Irradiance of the constant environment on the surface, as a share of what the lights give at
    /// its centre; without lights, its radiance. Default: `[0.3, 0.8]`.
    pub ambient: Range,
    /// Light from an environment map, in addition to `ambient`.
    pub environment: EnvironmentRanges,
    /// Brightness of the objects relative to the plate, EV. Default: `[-0.3, 0.3]`.
    pub gain_ev: Range,
    /// Coefficient of friction in a scene, [`Surface::friction`]. Default: 0.5.
    pub friction: Range,
    /// Coefficient of restitution, [`Surface::restitution`]. Default: 0.
    pub restitution: Range,
    /// Walls on the edges of the surface. Default: those of the background's label or, if it
    /// mentions none, invisible ones that nothing gets over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walls: Option<WallRanges>,
    /// Collision shape of a cut-out. Default: `box`.
    pub collider: Collider,
    /// Albedo of the surface, if known: the exposure is then matched to the surface instead of the
    /// plate's white, and so is the light's colour if the surface's colour is known. Default: that
    /// of the background's label.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface_albedo: Option<Albedo>,
    /// Colour of the light: `{ match_surface = { share = 0.5 } }` takes half of the surface's. If
    /// the surface's own colour is known, white stands for all of it;
    /// `{ match_surface = { share = 0 } }` keeps the light white. Default: white.
    pub cast: LightTint,
    /// Position of the first light: `match_walls` estimates it from which walls of the surface are
    /// bright in the photo, within the error of the estimate; `match_walls_exactly` leaves out the
    /// error. Default: `drawn`.
    #[serde(skip_serializing_if = "LightDirectionSource::is_drawn")]
    pub light_direction: LightDirectionSource,
    /// Distribution of the light over the surface: `{ match_surface = { share = 1 } }` takes the
    /// gradients of the plate. Default: even.
    #[serde(skip_serializing_if = "LightMap::is_even")]
    pub light_map: LightMap,
    /// Interreflection between the surface and the objects above it: a share of the surface's
    /// albedo, or the albedo itself if that is unknown. Default: 0, none.
    #[serde(skip_serializing_if = "Range::is_zero")]
    pub interreflection: Range,
    /// A belt that carries the objects past the camera, in sequences of pictures. Default: none,
    /// every picture is an independent scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub belt: Option<BeltRanges>,
    /// Post-processing of the finished frame. Default: none.
    pub finish: PostProcessRanges,
    /// How objects come to rest.
    pub settle: SettleOptions,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            image: [640, 480],
            off: Vec::new(),
            viewpoints: Take::All,
            view: ViewRanges::default(),
            lens: LensRanges::default(),
            photos: Take::All,
            objects: Range::new(4.0, 12.0).into(),
            distractors: Count::default(),
            at_most_once: false,
            negatives: 0.0,
            selections: Selections::Unique,
            scale: Range::new(0.9, 1.1),
            start: DropRanges::default(),
            grade: GradeRanges::default(),
            bend_deg: Range::fixed(0.0),
            edges: Vec::new(),
            lights: vec![LightRanges::default()],
            ambient: Range::new(0.3, 0.8),
            environment: EnvironmentRanges::default(),
            gain_ev: Range::new(-0.3, 0.3),
            friction: Range::fixed(Surface::new([0.0; 2]).friction),
            restitution: Range::fixed(0.0),
            walls: None,
            collider: Collider::Box,
            surface_albedo: None,
            cast: LightTint::default(),
            light_direction: LightDirectionSource::Drawn,
            light_map: LightMap::default(),
            interreflection: Range::fixed(0.0),
            belt: None,
            finish: PostProcessRanges::default(),
            settle: SettleOptions::default(),
        }
    }
}

impl Recipe {
    /// Scene `k`: a pure function of the recipe, `seed` and `k`, the backgrounds and the catalog
    /// (both in their order).
    ///
    /// Objects are dropped: they start in a stack over the surface, without overlap, within its
    /// walls. The camera and the exposure are left to the stages that know the photo.
    ///
    /// # Method
    /// Every number is drawn by its own path ([`Draws`](crate::scene::Draws)), so that one more
    /// object or another range changes no other draw. Objects are drawn without repetition
    /// until the catalog is used up, then again from all of it; distractors likewise from theirs.
    ///
    /// # Errors
    /// An invalid range; no background; an empty catalog although there should be objects; a card
    /// that does not fit the surface in any direction.
    pub fn scene(
        &self,
        seed: u64,
        k: u64,
        backgrounds: &[Background],
        catalog: &[AssetVariant],
    ) -> Result<Scene> {
        self.explained(seed, k, backgrounds, catalog)
            .map(|(scene, _)| scene)
    }

    /// Scene `k` and every draw that it is made from, in order.
    ///
    /// # Errors
    /// As [`scene`](Self::scene).
    pub fn explained(
        &self,
        seed: u64,
        k: u64,
        backgrounds: &[Background],
        catalog: &[AssetVariant],
    ) -> Result<(Scene, Vec<Drawn>)> {
        let log = DrawLog::default();
        let recipe = self.narrowed();
        recipe.check()?;
        let number = SceneNumber {
            seed,
            k,
            place: self.place_in_sequence(k),
        };
        let places = Places {
            viewpoints: recipe.viewpoints.slice_of(backgrounds),
            negatives: self.places_of_negatives(backgrounds),
        };
        let scene = recipe.compose(number, &log, places, catalog)?;
        Ok((scene, log.into_draws()))
    }

    /// The place of picture `k` in its sequence; without a belt each picture is a sequence of its
    /// own.
    pub(crate) fn place_in_sequence(&self, k: u64) -> SequencePlace {
        let alone = SequencePlace {
            sequence: k,
            first: k,
            frame: 0,
        };
        self.belt.map_or(alone, |belt| belt.place_of(k))
    }

    /// The backgrounds of scenes without objects: all, or only the first without that variation.
    fn places_of_negatives<'a>(&self, backgrounds: &'a [Background]) -> &'a [Background] {
        let take = match self.off.contains(&Variation::Viewpoint) {
            true => Take::First(1),
            false => Take::All,
        };
        take.slice_of(backgrounds)
    }

    /// Fails on the first asset whose largest size does not fit between the walls of some
    /// background in any direction, on a lens that folds over the pictures of some background, and
    /// if there are no assets, more objects and distractors than a scene holds or, with
    /// [`at_most_once`](Self::at_most_once), too few assets: such a scene would be rejected, however
    /// late it comes.
    pub fn check_room(&self, backgrounds: &[Background], catalog: &[AssetVariant]) -> Result<()> {
        let recipe = self.narrowed();
        let most = recipe.objects.max() + recipe.distractors.max();
        check_count(most, "objects and distractors", MAX_OBJECTS)?;
        recipe.check_selections(catalog)?;
        if recipe.negatives > 0.0 {
            recipe.check_folds(self.places_of_negatives(backgrounds))?;
        }
        let viewpoints = recipe.viewpoints.slice_of(backgrounds);
        recipe.check_folds(viewpoints)?;
        for background in viewpoints {
            for variant in catalog.iter().filter(|v| recipe.draws_from(v.role)) {
                recipe.check_fit(background, variant)?;
            }
        }
        Ok(())
    }

    /// Fails on the first background whose pictures the lens folds over.
    fn check_folds(&self, backgrounds: &[Background]) -> Result<()> {
        backgrounds
            .iter()
            .try_for_each(|background| self.lens.check_folds(background))
    }

    /// Fails if a photo of an asset at its largest size does not fit between the walls of a
    /// background in any direction.
    fn check_fit(&self, background: &Background, variant: &AssetVariant) -> Result<()> {
        let sizes = self.photos.slice_of(&variant.photo_sizes).iter();
        let mut largest = sizes.map(|size| size.map(|side| side * self.scale.max));
        let room = background.size;
        match largest.find(|size| !self.start.has_room(room, *size)) {
            Some(size) => {
                let what = too_large(&variant.asset, size, &background.name, room);
                Err(Error::value(self.choice_of(variant.role).at, what))
            }
            None => Ok(()),
        }
    }

    /// Fails on the first impossible value.
    pub fn check(&self) -> Result<()> {
        check_image(self.image)?;
        self.view.check()?;
        self.lens.check()?;
        self.check_objects()?;
        self.check_light()?;
        self.check_surface()?;
        check_cast(&self.cast)?;
        self.light_map.check()?;
        self.interreflection.check("interreflection", &SHARE)?;
        self.belt.map_or(Ok(()), |belt| belt.check())?;
        self.finish.check()?;
        self.settle.check()
    }

    fn check_objects(&self) -> Result<()> {
        self.objects.check("objects", &OBJECT_COUNT)?;
        self.distractors.check("distractors", &OBJECT_COUNT)?;
        SHARE.check("negatives", self.negatives)?;
        self.scale.check("scale", &SCALE)?;
        self.start.check()?;
        self.bend_deg.check("bend_deg", &BEND)?;
        self.grade.check()
    }

    fn check_surface(&self) -> Result<()> {
        self.friction.check("friction", &FRICTION)?;
        self.restitution.check("restitution", &SHARE)?;
        self.walls.map_or(Ok(()), |walls| walls.check())?;
        self.surface_albedo
            .map_or(Ok(()), |albedo| check_albedo(albedo, "surface_albedo"))
    }

    fn check_light(&self) -> Result<()> {
        check_count(self.lights.len(), "lights", MAX_LIGHTS)?;
        check_each(&self.lights, "lights", LightRanges::check)?;
        self.ambient.check("ambient", &RADIANCE)?;
        self.environment.check()?;
        self.gain_ev.check("gain_ev", &EV)
    }
}

#[cfg(test)]
mod tests;
