//! The paper's sources of variation, switched off one at a time.
//!
//! Draws are keyed by their path and not by what was drawn before, so two recipes that differ in one switch give scenes
//! that differ in nothing else: scene `k` of one and scene `k` of the other are a pair.

use crate::scene::{EnvironmentRanges, GradeRanges, LightRanges, Range, Recipe, Selections, Take};
use serde::{Deserialize, Serialize};

/// A source of variation that a recipe can do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variation {
    /// Change of the objects' colours: they keep those of their photos.
    Colour,
    /// Labelled photos of the place: only the first is used.
    Viewpoint,
    /// Photos of an asset: only its first is used.
    Photo,
    /// Where lights are, how bright and of which colour: each stays at the middle of its ranges. How large they are,
    /// which is how soft shadows are, goes on varying.
    Light,
    /// New choices of objects for every scene: there are only 50, as in the paper.
    Selection,
}

impl Variation {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Colour,
        Self::Viewpoint,
        Self::Photo,
        Self::Light,
        Self::Selection,
    ];
}

/// Choices of objects where they repeat (the paper's 50).
const REPEATED: u64 = 50;

/// A dataset of the paper's Table 1: which sources of variation are off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ablation {
    /// Name, as of its folder.
    pub name: &'static str,
    /// What is off.
    pub off: &'static [Variation],
}

impl Ablation {
    /// The paper's datasets, in its order.
    pub const PAPER: [Self; 7] = [
        Self {
            name: "all",
            off: &[],
        },
        Self {
            name: "original_colour",
            off: &[Variation::Colour],
        },
        Self {
            name: "single_viewpoint",
            off: &[Variation::Viewpoint],
        },
        Self {
            name: "single_photo",
            off: &[Variation::Photo],
        },
        Self {
            name: "single_light",
            off: &[Variation::Light],
        },
        Self {
            name: "repeat_selections",
            off: &[Variation::Selection],
        },
        Self {
            name: "all_off",
            off: &Variation::ALL,
        },
    ];
}

impl Recipe {
    /// The recipe with its switches taken at their word: nothing is `off`, and what was does not vary.
    pub fn narrowed(&self) -> Self {
        self.off.iter().fold(
            Self {
                off: Vec::new(),
                ..self.clone()
            },
            |recipe, source| recipe.without(*source),
        )
    }

    fn without(self, source: Variation) -> Self {
        match source {
            Variation::Colour => Self {
                grade: GradeRanges::UNCHANGED,
                ..self
            },
            Variation::Viewpoint => Self {
                viewpoints: Take::First(1),
                ..self
            },
            Variation::Photo => Self {
                photos: Take::First(1),
                ..self
            },
            Variation::Selection => Self {
                selections: Selections::Of(REPEATED),
                ..self
            },
            Variation::Light => Self {
                lights: self.lights.iter().map(LightRanges::still).collect(),
                ambient: self.ambient.middle(),
                environment: self.environment.still(),
                gain_ev: self.gain_ev.middle(),
                ..self
            },
        }
    }
}

impl GradeRanges {
    /// Colours as they are in the photo.
    pub const UNCHANGED: Self = Self {
        hue_deg: Range::fixed(0.0),
        saturation: Range::fixed(1.0),
        value: Range::fixed(1.0),
    };
}

impl EnvironmentRanges {
    /// The first picture, not turned by chance.
    fn still(&self) -> Self {
        Self {
            files: self.files.first().cloned().into_iter().collect(),
            rotation_deg: self.rotation_deg.middle(),
            strength: self.strength.middle(),
        }
    }
}

impl LightRanges {
    /// The light at the middle of its ranges, its size still varying.
    fn still(&self) -> Self {
        Self {
            height: self.height.middle(),
            offset: self.offset.middle(),
            azimuth_deg: self.azimuth_deg.middle(),
            power: self.power.middle(),
            color: self.color.map(|range| range.middle()),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AssetVariant, Background, CameraSource, Scene};
    use std::collections::BTreeSet;

    fn scenes(off: &[Variation]) -> Vec<Scene> {
        let recipe = Recipe {
            off: off.to_vec(),
            ..Recipe::default()
        };
        let camera = CameraSource::Rectangle {
            corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
            photo: [60, 40],
            focal_px: Some(55.0),
        };
        let place = |name: &str| Background {
            name: name.into(),
            size: [0.6, 0.4],
            camera,
        };
        let choice = |i| AssetVariant {
            asset: format!("b{i}"),
            photo_sizes: vec![[0.2, 0.07]; 3],
            photo_outlines: vec![],
            thickness: 0.005,
            mass: 0.03,
        };
        let catalog: Vec<AssetVariant> = (0..9).map(choice).collect();
        (0..120)
            .map(|k| {
                recipe
                    .scene(5, k, &[place("a"), place("b")], &catalog)
                    .unwrap()
            })
            .collect()
    }

    /// The scene with everything that a source decides set to the same.
    fn apart_from(source: Variation, mut scene: Scene) -> Scene {
        match source {
            Variation::Colour => scene
                .objects
                .iter_mut()
                .for_each(|object| object.grade = Default::default()),
            Variation::Viewpoint => scene.plate.clear(),
            Variation::Photo => scene.objects.iter_mut().for_each(|object| object.photo = 0),
            Variation::Light => {
                let size = scene.lights[0].size;
                scene.lights[0] = crate::scene::AreaLight {
                    size,
                    ..scenes(&[])[0].lights[0]
                };
                scene.ambient = Default::default();
                scene.exposure = Default::default();
            }
            Variation::Selection => {}
        }
        scene
    }

    #[test]
    fn pairs_differ_in_what_is_off_and_in_nothing_else() {
        let all = scenes(&[]);
        for source in Variation::ALL {
            let off = scenes(&[source]);
            assert_ne!(off, all, "{source:?} changes nothing");
            // Choices of objects are the same in the first 50 scenes, where none repeats yet.
            for (a, b) in all.iter().zip(&off).take(REPEATED as usize) {
                assert_eq!(
                    apart_from(source, a.clone()),
                    apart_from(source, b.clone()),
                    "{source:?}"
                );
            }
        }
    }

    #[test]
    fn what_is_off_does_not_vary() {
        let off = scenes(&Variation::ALL);
        let distinct =
            |of: &dyn Fn(&Scene) -> String| off.iter().map(of).collect::<BTreeSet<_>>().len();
        assert_eq!(distinct(&|s| s.plate.clone()), 1);
        assert_eq!(
            distinct(&|s| format!("{:?} {:?}", s.lights[0].position, s.exposure)),
            1
        );
        let things = |s: &Scene| {
            s.objects
                .iter()
                .map(|o| (o.asset.clone(), o.photo))
                .collect::<Vec<_>>()
        };
        assert_eq!(distinct(&|s| format!("{:?}", things(s))), REPEATED as usize);
        assert!(
            off.iter()
                .flat_map(|s| &s.objects)
                .all(|o| o.photo == 0 && o.grade == Default::default())
        );
        assert!(
            distinct(&|s| format!("{:?}", s.lights[0].size)) > 100
                && distinct(&|s| format!("{s:?}")) == 120
        );
    }

    #[test]
    fn a_recipe_without_switches_is_its_narrowed_self() {
        let recipe = Recipe::default();
        assert_eq!(recipe.narrowed(), recipe);
        let off = Recipe {
            off: Variation::ALL.to_vec(),
            ..recipe
        };
        assert_eq!(off.narrowed().narrowed(), off.narrowed());
    }
}
