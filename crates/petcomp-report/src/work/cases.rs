//! The scenes, and the work that each of them must not cause.

use super::world::{FILM, FixtureFolder, OPAQUE, dropped, made_of};
use petcomp::LinearRgb;
use petcomp::scene::{Noise, PostProcess, Scene};
use petcomp::work::Kind;
use petcomp::work::Kind::*;

/// A scene and its output.
#[derive(Clone, Debug)]
pub(super) struct WorkCase {
    /// Its name.
    pub(super) name: &'static str,
    /// Its contents.
    pub(super) about: &'static str,
    /// The scene.
    pub(super) scene: Scene,
    /// What is generated from it.
    pub(super) asked: Asked,
    /// Work that it needs.
    pub(super) used: Vec<Kind>,
}

/// What is generated from a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// The output of `petcomp render`.
    Picture,
    /// The output of `petcomp label`.
    Labels,
    /// The output of `petcomp dataset generate` for one scene.
    Dataset,
}

/// The work that parts of a scene need.
const CARDS: &[Kind] = &[TextureSamples, Bakes];
const LAMP: &[Kind] = &[LightSamples];
const LIT: &[Kind] = &[ShadowRays, ShadedSamples, ShadowedPixels];
const THROUGH: &[Kind] = &[Transmittances];
const PICTURE: &[Kind] = &[Encodes];
const LABELS: &[Kind] = &[LabelSamples, Masks];

/// Work that every scene may need: reading and writing files, and levels of detail for small cards.
const ALWAYS_ALLOWED: [Kind; 6] = [
    BytesWritten,
    SyncedFiles,
    FilesRead,
    BytesRead,
    Levels,
    LargeAllocations,
];

impl WorkCase {
    /// Work that the scene must not cause: everything that is not listed as used.
    pub(super) fn absent(&self) -> Vec<Kind> {
        Kind::ALL
            .into_iter()
            .filter(|kind| !ALWAYS_ALLOWED.contains(kind) && !self.used.contains(kind))
            .collect()
    }
}

/// Every scene.
pub(super) fn cases(world: &FixtureFolder) -> Vec<WorkCase> {
    let mut cases = sparse_scenes(world);
    cases.extend(lit_scenes(world));
    cases.extend(scenes_by_texture(world));
    cases.extend(scenes_with_additions(world));
    cases.extend(other_results(world));
    cases
}

/// Work of a picture of see-through cards under a lamp.
const LIT_PICTURE: &[&[Kind]] = &[CARDS, LAMP, LIT, THROUGH, PICTURE];

fn picture(name: &'static str, about: &'static str, scene: Scene, used: &[&[Kind]]) -> WorkCase {
    WorkCase {
        name,
        about,
        scene,
        asked: Asked::Picture,
        used: used.concat(),
    }
}

/// A picture that takes the work of lit cards and some more.
fn lit_picture(name: &'static str, about: &'static str, scene: Scene, extra: &[Kind]) -> WorkCase {
    picture(name, about, scene, &[&LIT_PICTURE.concat(), extra])
}

fn without_lamp(scene: Scene) -> Scene {
    Scene {
        lights: vec![],
        ..scene
    }
}

fn without_sky(scene: Scene) -> Scene {
    Scene {
        ambient: LinearRgb::BLACK,
        ..scene
    }
}

fn unlit(scene: Scene) -> Scene {
    without_sky(without_lamp(scene))
}

fn without_cards(scene: Scene) -> Scene {
    Scene {
        objects: vec![],
        ..scene
    }
}

fn without_plate(scene: Scene) -> Scene {
    Scene {
        plate: "".into(),
        ..scene
    }
}

fn finished(scene: Scene) -> Scene {
    let noise = Noise::Known {
        shot: 1e-3,
        read: 1e-3,
    };
    Scene {
        finish: PostProcess {
            noise,
            sharpening: 0.5,
            ..PostProcess::default()
        },
        ..scene
    }
}

fn with_map(world: &FixtureFolder, strength: f64) -> Scene {
    Scene {
        environment: Some(world.environment(strength)),
        ..world.scene()
    }
}

fn sparse_scenes(world: &FixtureFolder) -> Vec<WorkCase> {
    let empty = without_cards(world.scene());
    vec![
        lit_picture(
            "usual",
            "3 see-through cards at rest, a lamp, an even sky: their picture",
            world.scene(),
            &[],
        ),
        picture(
            "nothing",
            "no cards, no light, no plate",
            unlit(without_plate(empty.clone())),
            &[PICTURE],
        ),
        picture(
            "plate alone",
            "a plate under a lamp, no cards",
            empty,
            &[PICTURE],
        ),
    ]
}

fn lit_scenes(world: &FixtureFolder) -> Vec<WorkCase> {
    let dark = unlit(world.scene());
    let under_sky = without_lamp(world.scene());
    let under_lamp = without_sky(world.scene());
    vec![
        picture("dark", "cards, no light", dark, &[CARDS, PICTURE]),
        picture(
            "sky alone",
            "no lamp",
            under_sky,
            &[CARDS, LIT, THROUGH, PICTURE],
        ),
        lit_picture("lamp alone", "no sky", under_lamp, &[]),
    ]
}

fn scenes_by_texture(world: &FixtureFolder) -> Vec<WorkCase> {
    let [opaque, film] = [OPAQUE, FILM].map(|asset| made_of(asset, world.scene()));
    vec![
        picture(
            "opaque",
            "cards with alpha 1 all over",
            opaque,
            &[CARDS, LAMP, LIT, &[OpaqueEdges], PICTURE],
        ),
        lit_picture(
            "film",
            "cards that pass each channel differently",
            film,
            &[FilmSamples],
        ),
    ]
}

fn scenes_with_additions(world: &FixtureFolder) -> Vec<WorkCase> {
    let (falling, finished) = (dropped(world.scene()), finished(world.scene()));
    let [map, dim_map] = [1.0, 0.0].map(|strength| with_map(world, strength));
    let about_dim = "an environment map of strength 0 on top";
    vec![
        lit_picture("map", "an environment map on top", map, &[MapPieces]),
        lit_picture("dim map", about_dim, dim_map, &[]),
        lit_picture(
            "falling",
            "the same cards, dropped",
            falling,
            &[PhysicsWorlds, PhysicsSteps],
        ),
        lit_picture(
            "finished",
            "noise and sharpening",
            finished,
            &[Filters, NoisyPixels],
        ),
    ]
}

fn other_results(world: &FixtureFolder) -> [WorkCase; 2] {
    let labels = WorkCase {
        name: "labels",
        about: "labels of the usual scene, no picture",
        scene: world.scene(),
        asked: Asked::Labels,
        used: [CARDS, LABELS].concat(),
    };
    let dataset = WorkCase {
        name: "dataset",
        about: "picture and labels, as a dataset",
        asked: Asked::Dataset,
        used: [&LIT_PICTURE.concat(), LABELS].concat(),
        ..labels.clone()
    };
    [labels, dataset]
}
