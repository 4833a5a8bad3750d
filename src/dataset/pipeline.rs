//! The pipeline: recipe and number in, labelled picture out.

use crate::allowance::Allowance;
use crate::asset::{Library, MANIFEST, Manifest, Panorama};
use crate::bounds::LEAST_OBJECT_PX;
use crate::composite::Exposed;
use crate::dataset::background_photo::{BackgroundOptions, BackgroundPhoto};
use crate::dataset::environment_maps::EnvironmentMaps;
use crate::dataset::falls::Falls;
use crate::dataset::fingerprint::fingerprint;
use crate::dataset::{
    DatasetConfig, Inputs, Plan, Provenance, Sample, Sidecar, Split, Times, Writer,
};
use crate::deep::DeepImage;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::label::{self, Labels};
use crate::light;
use crate::pixel::PremulRgba;
use crate::quantile::median;
use crate::render;
use crate::scene::{
    Appearance, AssetVariant, Background, CameraSource, Drawn, Draws, EdgeTreatment, Recipe, Scene,
    Shot, catalog, locate,
};
use crate::stopwatch::Stopwatch;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Everything that pictures are made from, opened once: assets, labelled photos, options. A clone
/// shares what was opened.
#[derive(Clone, Debug)]
pub struct Pipeline {
    config: DatasetConfig,
    library: Arc<Library>,
    places: Arc<[BackgroundPhoto]>,
    backgrounds: Arc<[Background]>,
    catalog: Arc<[AssetVariant]>,
    surroundings: Arc<EnvironmentMaps>,
    falls: Arc<Falls>,
    /// Becomes true when no more pictures are to be finished.
    stop: &'static AtomicBool,
}

/// By default a pipeline is never stopped.
static NEVER: AtomicBool = AtomicBool::new(false);

/// Number of falls that are remembered while a recipe is tuned.
const REMEMBERED_FALLS: usize = 256;

/// Number of falls that are remembered for sequences on a belt, several of which are made at a
/// time.
const REMEMBERED_SEQUENCES: usize = 64;

/// How often a scene that does not settle is resampled.
const MAX_RESAMPLES: usize = 8;

impl Pipeline {
    /// Opens the folders that a config names, by absolute paths, so that the working folder may
    /// change afterwards.
    ///
    /// # Errors
    /// A folder, manifest, label or cut-out that cannot be used; the message names the file, the
    /// field and what was expected.
    pub fn open(config: DatasetConfig) -> Result<Self> {
        let config = config.with_absolute_paths()?;
        let library = Library::open(&config.assets)?;
        Self::with_library(config, library)
    }

    /// As [`open`](Self::open), with the assets in memory, as returned by
    /// [`build`](crate::asset::build).
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn with_library(config: DatasetConfig, library: Library) -> Result<Self> {
        let config = config.with_absolute_paths()?;
        let places = open_backgrounds(&config)?.into();
        let image = config.scene.image;
        Self::new(config, library.into(), places).with_sizes_checked_in(image)
    }

    /// As [`open`](Self::open), for pictures that may be smaller than the recipe's own of `whole`
    /// pixels: objects must be large enough only at that size. Paths, including those in messages,
    /// stay as the config has them: the working folder must not change.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    #[doc(hidden)]
    pub fn open_reduced(config: DatasetConfig, whole: [u32; 2]) -> Result<Self> {
        let library = Library::open(&config.assets)?.into();
        let places = open_backgrounds(&config)?.into();
        Self::new(config, library, places).with_sizes_checked_in(whole)
    }

    /// As [`open_reduced`](Self::open_reduced) for a recipe that is being tuned: falls are
    /// remembered.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    #[doc(hidden)]
    pub fn for_tuning(config: DatasetConfig, whole: [u32; 2]) -> Result<Self> {
        Ok(Self {
            falls: Arc::new(Falls::of_last(REMEMBERED_FALLS)),
            ..Self::open_reduced(config, whole)?
        })
    }

    /// The same pipeline with another config: what both configs name is not opened again, and falls
    /// that have not changed are not computed again. `whole` is as in
    /// [`open_reduced`](Self::open_reduced).
    ///
    /// # Errors
    /// As [`open`](Self::open).
    #[doc(hidden)]
    pub fn with_config(&self, config: DatasetConfig, whole: [u32; 2]) -> Result<Self> {
        // What was opened by absolute paths is known by them.
        let config = match self.config.folder.is_absolute() {
            true => config.with_absolute_paths()?,
            false => config,
        };
        let library = match self.config.assets == config.assets {
            true => self.library.clone(),
            false => Library::open(&config.assets)?.into(),
        };
        let places = match has_same_places(&self.config, &config) {
            true => self.places.clone(),
            false => open_backgrounds(&config)?.into(),
        };
        let tuned = Self {
            falls: self.falls.clone(),
            surroundings: self.surroundings_for(&config),
            ..Self::new(config, library, places)
        };
        tuned.with_sizes_checked_in(whole)
    }

    fn surroundings_for(&self, config: &DatasetConfig) -> Arc<EnvironmentMaps> {
        match self.surroundings.are_of(config) {
            true => self.surroundings.clone(),
            false => EnvironmentMaps::of(config).into(),
        }
    }

    fn with_sizes_checked_in(self, image: [u32; 2]) -> Result<Self> {
        let mut places = self.places.iter();
        places.try_for_each(|place| self.check_size_at(place, image))?;
        Ok(self)
    }

    /// Rejects a place in whose pictures of `w` x `h` pixels the median object is too small to have
    /// an outline: probably a length is in the wrong unit.
    fn check_size_at(&self, place: &BackgroundPhoto, [w, h]: [u32; 2]) -> Result<()> {
        let (Some(median), CameraSource::Known(camera)) =
            (self.median_object_m(), &place.background.camera)
        else {
            return Ok(());
        };
        let Recipe {
            scale, view, image, ..
        } = &self.config.scene;
        let enlarged = f64::from(w) / f64::from(image[0]);
        let factor = scale.middle().min * view.zoom.middle().min * enlarged;
        let px = camera.focal_px.x * median * factor / camera.center().coords.norm();
        if px >= LEAST_OBJECT_PX {
            return Ok(());
        }
        let what = format!(
            "the median object of {median:.3} m is {px:.1} px long in pictures of {w} x {h}, expected at least \
             {LEAST_OBJECT_PX}; are width_m and height_m in metres, and scene.image and scene.scale large enough?"
        );
        Err(Error::value("surface", what).in_file(&place.label))
    }

    /// Median length of the objects in the library, without distractors.
    fn median_object_m(&self) -> Option<f64> {
        let objects = self.library.assets.iter().filter(|a| a.role.is_object());
        let photos = objects.flat_map(|asset| &asset.photos);
        let lengths = photos.map(|photo| photo.record.object_m[0]);
        median(lengths, f64::total_cmp)
    }

    /// As [`open`](Self::open), for one existing scene: only the cut-outs of the assets that it
    /// names are read and known, and of the labelled photos only its own.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_for(config: DatasetConfig, scene: &Scene) -> Result<Self> {
        let config = config.with_absolute_paths()?;
        let library = Library::open_some(&config.assets, |name: &str| {
            scene.objects.iter().any(|object| object.asset == name)
        })?;
        let places = if scene.plate.is_empty() {
            Vec::new()
        } else {
            let options = background_options(&config);
            BackgroundPhoto::named(&scene.plate, &config.backgrounds, options)?
        };
        Ok(Self::new(config, library.into(), places.into()))
    }

    fn new(config: DatasetConfig, library: Arc<Library>, places: Arc<[BackgroundPhoto]>) -> Self {
        let backgrounds = places.iter().map(|place| place.background.clone());
        Self {
            backgrounds: backgrounds.collect(),
            catalog: catalog(&library).into(),
            surroundings: EnvironmentMaps::of(&config).into(),
            falls: Arc::new(falls_of(&config)),
            config,
            library,
            places,
            stop: &NEVER,
        }
    }

    /// The same pipeline, whose falls end with [`Error::Interrupted`] once a flag is true.
    pub fn stopped_by(self, stop: &'static AtomicBool) -> Self {
        Self { stop, ..self }
    }

    /// The config that it was opened from.
    pub fn config(&self) -> &DatasetConfig {
        &self.config
    }

    /// The assets.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The files that pictures of a scene may be made from: the assets' manifest and cut-outs, the
    /// photos of the place with the files next to them, the environment maps.
    ///
    /// # Errors
    /// A manifest or label that cannot be read.
    #[doc(hidden)]
    pub fn input_files(&self, scene: &Scene) -> Result<Vec<PathBuf>> {
        let DatasetConfig {
            assets,
            backgrounds,
            folder,
            surface_size,
            ..
        } = &self.config;
        let manifest = Manifest::read(assets)?;
        let photos = manifest.assets.iter().flat_map(|asset| &asset.photos);
        let cut_outs = photos.flat_map(|photo| photo.files());
        let places = match self.places.is_empty() {
            true => Vec::new(),
            false => BackgroundPhoto::files_beside(&scene.plate, backgrounds, *surface_size)?,
        };
        let listed = self.surroundings.files().map(|(_, path)| path);
        let named = scene.environment.iter().map(|map| folder.join(&map.file));
        let files = cut_outs.map(|file| assets.join(file));
        let files = files.chain([assets.join(MANIFEST)]).chain(places);
        Ok(files.chain(listed).chain(named).collect())
    }

    /// The plan for a dataset of `count` pictures in `folder` with the config's formats.
    ///
    /// # Errors
    /// Classes that the config's policy for obstructed objects cannot extend; an asset that does
    /// not fit between the walls of some background in any direction; a photo or an environment map
    /// that cannot be read, or that has changed since pictures were made from it.
    pub fn plan(&self, count: u64, seed: u64, folder: impl Into<PathBuf>) -> Result<Plan> {
        let (scene, labels) = (&self.config.scene, &self.config.labels);
        self.check_room_with(scene)?;
        self.library.warn_of_size();
        let folder: PathBuf = folder.into();
        let mut inputs = Inputs::kept(&folder);
        let recipe = fingerprint(
            &self.config,
            &self.library,
            &self.places,
            &self.surroundings,
            &mut inputs,
        )?;
        let classes = labels.obstructed.classes(&self.library.classes)?;
        Ok(Plan {
            seed,
            recipe,
            split: self.split(),
            obstructed: labels.obstructed,
            writers: self.writers(),
            archives: labels.archives(),
            inputs,
            ..Plan::new(folder, count, classes)
        })
    }

    /// Sequences are for training or for validation as a whole.
    fn split(&self) -> Split {
        let belt = self.config.scene.belt;
        Split {
            sequence: belt.map_or(1, |belt| belt.frames),
            ..self.config.split
        }
    }

    fn writers(&self) -> Vec<Arc<dyn Writer>> {
        let pictures = &self.config.pictures;
        let mut writers: Vec<Arc<dyn Writer>> = vec![Arc::new(pictures.clone()), Arc::new(Sidecar)];
        if self.config.labels.archives().is_none() {
            writers.extend(self.config.labels.writers(pictures));
        }
        writers
    }

    /// Scene `k` as the recipe draws it: objects not settled yet, exposure still open.
    ///
    /// # Errors
    /// As [`Recipe::scene`](crate::scene::Recipe::scene).
    pub fn draw(&self, seed: u64, k: u64) -> Result<Scene> {
        self.explain(seed, k).map(|(scene, _)| scene)
    }

    /// Scene `k` and every draw that it is made with, in order.
    ///
    /// # Errors
    /// As [`draw`](Self::draw).
    pub fn explain(&self, seed: u64, k: u64) -> Result<(Scene, Vec<Drawn>)> {
        self.explain_with(&self.config.scene, seed, k)
    }

    /// The same for another recipe with the same assets and photos.
    pub(super) fn explain_with(
        &self,
        recipe: &Recipe,
        seed: u64,
        k: u64,
    ) -> Result<(Scene, Vec<Drawn>)> {
        let explained = recipe.explained(seed, k, &self.backgrounds, &self.catalog);
        explained.map_err(|e| e.within("scene"))
    }

    /// Fails if a scene of another recipe could not be composed of the same assets and photos.
    pub(super) fn check_room_with(&self, recipe: &Recipe) -> Result<()> {
        let checked = recipe.check_room(&self.backgrounds, &self.catalog);
        checked.map_err(|e| e.within("scene"))
    }

    /// The labelled photos that the config names.
    pub(super) fn places(&self) -> &[BackgroundPhoto] {
        &self.places
    }

    /// Whether it was stopped.
    pub(super) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Sample `k`: a pure function of what was opened, `seed` and `k`.
    ///
    /// # Errors
    /// Files that cannot be read; objects that did not come to rest in any of several scenes.
    pub fn sample(&self, seed: u64, k: u64) -> Result<Sample> {
        let mut rejected = Vec::new();
        let allowance = self.allowance();
        loop {
            let first = self.config.scene.place_in_sequence(k).first;
            let scene_seed = redraw_seed(seed, first, rejected.len());
            let (scene, mut draws) = self.explain(scene_seed, k)?;
            match self.take_within(scene, &allowance) {
                Ok(sample) => {
                    draws.extend(self.config.pictures.drawn(seed, k));
                    let provenance = sample.provenance.map(|provenance| Provenance {
                        rejected,
                        draws,
                        scene_seed,
                        ..provenance
                    });
                    return Ok(Sample {
                        provenance,
                        ..sample
                    });
                }
                Err(Error::Unsettled { what })
                    if rejected.len() < MAX_RESAMPLES && !allowance.is_spent() =>
                {
                    log::info!("scene {k} is resampled: {what}");
                    rejected.push(what);
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Resolves what is unknown in a scene, renders it and labels it.
    ///
    /// # Errors
    /// Those of the stages: no camera, no rest, a name that is not in the folders.
    pub fn take(&self, scene: Scene) -> Result<Sample> {
        self.take_within(scene, &self.allowance())
    }

    fn take_within(&self, scene: Scene, allowance: &Allowance) -> Result<Sample> {
        let drawn = scene.clone();
        let mut watch = Stopwatch::start();
        let (scene, shot) = self.resolve_within(scene, allowance)?;
        watch.lap("settle");
        let free = render::render_unhidden(&shot, &self.config.render);
        watch.lap("render");
        let exposed = Exposed::new(free, &shot, &self.config.render);
        let frame = exposed.finished(&shot, &scene.finish);
        let deep = exposed.into_deep();
        watch.lap("composite");
        let labels = self.label_shot(&deep, &shot);
        watch.lap("label");
        watch.log("picture");
        Ok(Sample {
            frame,
            deep,
            labels,
            provenance: Some(Provenance {
                drawn,
                ..Provenance::from_scene(scene)
            }),
            times: Times {
                settle: watch.took("settle"),
                render: watch.took("render") + watch.took("composite"),
                label: watch.took("label"),
                ..Times::default()
            },
        })
    }

    /// Labels of a shot with these deep samples, regardless of how its edges are treated.
    fn label_shot(&self, deep: &DeepImage, shot: &Shot) -> Labels {
        let options = self.config.labels.options;
        if !shot.edges.reshape_cut_outs() {
            return label::label(deep, shot, &options);
        }
        let plain = Shot {
            edges: EdgeTreatment::AsIs,
            ..shot.clone()
        };
        let deep = render::render_coverage(&plain, &self.config.render);
        label::label(&deep, &plain, &options)
    }

    /// Labels a scene without rendering its picture: nothing is lit, and neither plate nor
    /// environment is read.
    ///
    /// The labels are those of [`take`](Self::take) except for rounding: without light, coverage is
    /// summed in another order, so numbers (`visible_fraction`, `depth`) agree to 1e-6. Masks and
    /// boxes are the same unless a pixel is that close to the threshold.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub fn label(&self, scene: Scene) -> Result<Labels> {
        self.check_plate(&scene)?;
        let plate = scene.plate.clone();
        let (scene, shot) = self.resolve(scene.unlit())?;
        let shot = self.behind_front(&plate, &scene, shot)?;
        Ok(label::label(
            &render::render_coverage(&shot, &self.config.render),
            &shot,
            &self.config.labels.options,
        ))
    }

    /// Renders a shot and applies the scene's finish to its frame.
    pub fn shoot(&self, scene: &Scene, shot: &Shot) -> (DeepImage, Image<PremulRgba>) {
        let free = render::render_unhidden(shot, &self.config.render);
        let exposed = Exposed::new(free, shot, &self.config.render);
        let frame = exposed.finished(shot, &scene.finish);
        (exposed.into_deep(), frame)
    }

    /// Resolves what is unknown in a scene: its camera, the resting places of its objects, its
    /// exposure.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub fn resolve(&self, scene: Scene) -> Result<(Scene, Shot)> {
        self.resolve_within(scene, &self.allowance())
    }

    /// The work that one picture may take.
    fn allowance(&self) -> Allowance<'static> {
        Allowance::new(self.config.scene.settle.most_work).stopped_by(self.stop)
    }

    fn resolve_within(&self, scene: Scene, allowance: &Allowance) -> Result<(Scene, Shot)> {
        let place = self.known_place(&scene.plate)?;
        self.check_plate(&scene)?;
        let mut scene = self.rest(locate(scene)?, allowance)?;
        let panorama = self.panorama(&scene)?;
        let mut plate = None;
        if let Some(place) = place {
            let environment = scene.environment_map(panorama.clone())?;
            let detailed = place.plate_for_zoom(scene.zoom_used())?;
            // By the pixels that are shown, of which there may be more than in the picture.
            scene = detailed.measured().grained(scene);
            scene = light::match_plate(scene, place.plate()?.measured(), environment.as_ref());
            plate = Some(detailed.image);
        }
        let shot = scene.resolve(
            |object| Appearance::from_library(&self.library, object),
            plate,
            panorama,
        )?;
        let shot = self.behind_front(&scene.plate, &scene, shot)?;
        Ok((scene, shot))
    }

    /// The shot with its objects behind what the plate's mask marks, if there is a mask, which
    /// replaces what the walls hide.
    fn behind_front(&self, plate: &str, scene: &Scene, shot: Shot) -> Result<Shot> {
        let place = self.place(plate);
        let mask = place.map_or(Ok(None), |place| place.front_mask(scene.zoom_used()))?;
        Ok(match (mask, scene.camera) {
            (Some(mask), CameraSource::Known(camera)) => Shot {
                holdout: Some(Arc::new(scene.holdout_of_mask(&camera, &mask))),
                ..shot
            },
            _ => shot,
        })
    }

    fn place(&self, name: &str) -> Option<&BackgroundPhoto> {
        self.places
            .iter()
            .find(|place| place.background.name == name)
    }

    #[cfg(feature = "settle")]
    fn rest(&self, scene: Scene, allowance: &Allowance) -> Result<Scene> {
        let options = &self.config.scene.settle;
        self.falls.settled(scene, options, allowance, |scene| {
            let (settled, _) = crate::settle::settle_within(scene, options, 0, allowance)?;
            settled.into_scene()
        })
    }

    #[cfg(not(feature = "settle"))]
    fn rest(&self, scene: Scene, _allowance: &Allowance) -> Result<Scene> {
        Ok(scene)
    }

    /// The environment map that a scene names.
    fn panorama(&self, scene: &Scene) -> Result<Option<Arc<Panorama>>> {
        let shining = scene.environment.as_ref().filter(|map| map.shines());
        shining
            .map(|map| self.surroundings.picture(&map.file))
            .transpose()
    }

    /// The place of this name; none for an empty name.
    fn known_place(&self, name: &str) -> Result<Option<&BackgroundPhoto>> {
        match self.place(name) {
            None if !name.is_empty() => Err(self.unknown_plate(name)),
            place => Ok(place),
        }
    }

    /// Fails on a scene that does not suit its plate.
    fn check_plate(&self, scene: &Scene) -> Result<()> {
        self.check_image(scene)?;
        let place = self.place(&scene.plate);
        place.map_or(Ok(()), |place| place.check_labelled(&scene.camera))
    }

    /// Fails on a scene over a plate that was opened for pictures of another size.
    fn check_image(&self, scene: &Scene) -> Result<()> {
        let ([w, h], [width, height]) = (scene.image, self.config.scene.image);
        if scene.plate.is_empty() || [w, h] == [width, height] {
            return Ok(());
        }
        let what = format!(
            "{w} x {h}, expected {width} x {height}, the recipe's scene.image, for which the plates were opened"
        );
        Err(Error::value("image", what))
    }

    fn unknown_plate(&self, name: &str) -> Error {
        let known = self.backgrounds.iter().map(|b| b.name.as_str());
        let known = known.collect::<Vec<_>>().join(", ");
        Error::value("plate", format!("\"{name}\", expected one of {known}"))
    }
}

/// Only on a belt do several pictures share a fall.
fn falls_of(config: &DatasetConfig) -> Falls {
    match config.scene.belt {
        Some(_) => Falls::of_last(REMEMBERED_SEQUENCES),
        None => Falls::default(),
    }
}

/// The labelled photos that a config names.
fn open_backgrounds(config: &DatasetConfig) -> Result<Vec<BackgroundPhoto>> {
    BackgroundPhoto::all(&config.backgrounds, background_options(config))
}

fn background_options(config: &DatasetConfig) -> BackgroundOptions {
    BackgroundOptions {
        image: config.scene.image,
        surface_size: config.surface_size,
        force: config.force_cameras,
    }
}

/// Whether two configs use the same photos in the same way.
fn has_same_places(a: &DatasetConfig, b: &DatasetConfig) -> bool {
    a.backgrounds == b.backgrounds && background_options(a) == background_options(b)
}

/// The seed of the `n`-th try of scene `k`: the first is the dataset's own. On a belt all pictures
/// of a sequence have that of its first picture.
fn redraw_seed(seed: u64, k: u64, n: usize) -> u64 {
    match n {
        0 => seed,
        n => Draws::new(seed, k).bits(&format!("redraw[{n}]")),
    }
}
