//! The scenes, and what each of them must not pay for.

use super::world::{FILM, FixtureFolder, OPAQUE, dropped, made_of};
use petcomp::LinearRgb;
use petcomp::scene::{Noise, PostProcess, Scene};
use petcomp::work::Kind;
use petcomp::work::Kind::*;

/// A scene and what is asked of it.
#[derive(Clone, Debug)]
pub(super) struct WorkCase {
    /// Its name.
    pub(super) name: &'static str,
    /// What is in it.
    pub(super) about: &'static str,
    /// The scene.
    pub(super) scene: Scene,
    /// What is made of it.
    pub(super) asked: Asked,
    /// Work that it cannot do without.
    pub(super) used: Vec<Kind>,
}

/// What is made of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// What `petcomp render` makes.
    Picture,
    /// What `petcomp label` makes.
    Labels,
    /// What `petcomp dataset generate` makes of one scene.
    Dataset,
}

/// What parts of a scene take.
const CARDS: &[Kind] = &[TextureSamples, Bakes];
const LAMP: &[Kind] = &[LightSamples];
const LIT: &[Kind] = &[ShadowRays, ShadedSamples, ShadowedPixels];
const THROUGH: &[Kind] = &[Transmittances];
const PICTURE: &[Kind] = &[Encodes];
const LABELS: &[Kind] = &[LabelSamples, Masks];

/// What every scene pays for, or may: what it is read from and written to, and levels of detail where cards are small.
const FREE: [Kind; 5] = [BytesWritten, FilesRead, BytesRead, Levels, LargeAllocations];

impl WorkCase {
    /// Work that the scene must not make: all that is not told to be used.
    pub(super) fn absent(&self) -> Vec<Kind> {
        Kind::ALL
            .into_iter()
            .filter(|kind| !FREE.contains(kind) && !self.used.contains(kind))
            .collect()
    }
}

/// Every scene.
pub(super) fn cases(world: &FixtureFolder) -> Vec<WorkCase> {
    let usual = || world.scene();
    let with_map = |strength| Scene {
        environment: Some(world.environment(strength)),
        ..usual()
    };
    let lit: &[&[Kind]] = &[CARDS, LAMP, LIT, THROUGH, PICTURE];
    let case = |name, about, scene, asked, used: &[&[Kind]]| WorkCase {
        name,
        about,
        scene,
        asked,
        used: used.concat(),
    };
    let picture =
        |name, about, scene, used: &[&[Kind]]| case(name, about, scene, Asked::Picture, used);
    let finish = PostProcess {
        noise: Noise::Known {
            shot: 1e-3,
            read: 1e-3,
        },
        sharpening: 0.5,
        ..PostProcess::default()
    };
    let unlit = |scene| Scene {
        lights: vec![],
        ambient: LinearRgb::BLACK,
        ..scene
    };
    let empty = Scene {
        objects: vec![],
        ..usual()
    };
    vec![
        picture(
            "usual",
            "3 see-through cards at rest, a lamp, an even sky: their picture",
            usual(),
            lit,
        ),
        picture(
            "nothing",
            "no cards, no light, no plate",
            unlit(Scene {
                plate: "".into(),
                ..empty.clone()
            }),
            &[PICTURE],
        ),
        picture(
            "plate alone",
            "a plate under a lamp, no cards",
            empty,
            &[PICTURE],
        ),
        picture("dark", "cards, no light", unlit(usual()), &[CARDS, PICTURE]),
        picture(
            "sky alone",
            "no lamp",
            Scene {
                lights: vec![],
                ..usual()
            },
            &[CARDS, LIT, THROUGH, PICTURE],
        ),
        picture(
            "lamp alone",
            "no sky",
            Scene {
                ambient: LinearRgb::BLACK,
                ..usual()
            },
            lit,
        ),
        picture(
            "opaque",
            "cards with alpha 1 all over",
            made_of(OPAQUE, usual()),
            &[CARDS, LAMP, LIT, &[OpaqueEdges], PICTURE],
        ),
        picture(
            "film",
            "cards that pass each channel differently",
            made_of(FILM, usual()),
            &[&lit.concat(), &[FilmSamples]],
        ),
        picture(
            "map",
            "an environment map on top",
            with_map(1.0),
            &[&lit.concat(), &[MapPieces]],
        ),
        picture(
            "dim map",
            "an environment map of strength 0 on top",
            with_map(0.0),
            lit,
        ),
        picture(
            "falling",
            "the same cards, dropped",
            dropped(usual()),
            &[&lit.concat(), &[PhysicsWorlds, PhysicsSteps]],
        ),
        picture(
            "finished",
            "noise and sharpening",
            Scene { finish, ..usual() },
            &[&lit.concat(), &[Filters, NoisyPixels]],
        ),
        case(
            "labels",
            "labels of the usual scene, no picture",
            usual(),
            Asked::Labels,
            &[CARDS, LABELS],
        ),
        case(
            "dataset",
            "picture and labels, as a dataset",
            usual(),
            Asked::Dataset,
            &[&lit.concat(), LABELS],
        ),
    ]
}
