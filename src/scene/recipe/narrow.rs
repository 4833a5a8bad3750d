//! A recipe with some of its sources of variation switched off.

use crate::scene::{
    EnvironmentRanges, GradeRanges, LightRanges, Recipe, Selections, Take, Variation, ViewRanges,
};

/// Number of selections where they repeat (the paper's 50).
const REPEATED_SELECTIONS: u64 = 50;

impl Recipe {
    /// The recipe with its switches applied: nothing is `off`, and what was does not vary.
    pub fn narrowed(&self) -> Self {
        let all_on = Self {
            off: Vec::new(),
            ..self.clone()
        };
        let off = self.off.iter();
        off.fold(all_on, |recipe, source| recipe.without(*source))
    }

    fn without(self, source: Variation) -> Self {
        match source {
            Variation::Colour => Self {
                grade: GradeRanges::UNCHANGED,
                ..self
            },
            Variation::Viewpoint => Self {
                viewpoints: Take::First(1),
                view: ViewRanges::default(),
                ..self
            },
            Variation::Photo => Self {
                photos: Take::First(1),
                ..self
            },
            Variation::Selection => Self {
                selections: Selections::Count(REPEATED_SELECTIONS),
                ..self
            },
            Variation::Light => self.with_still_light(),
        }
    }

    /// The recipe with its light at the middle of all ranges.
    fn with_still_light(self) -> Self {
        Self {
            lights: self.lights.iter().map(LightRanges::at_middle).collect(),
            ambient: self.ambient.middle(),
            environment: self.environment.at_middle(),
            gain_ev: self.gain_ev.middle(),
            light_direction: self.light_direction.at_middle(),
            ..self
        }
    }
}

impl EnvironmentRanges {
    /// The first picture, without random rotation.
    fn at_middle(&self) -> Self {
        Self {
            files: self.files.first().cloned().into_iter().collect(),
            rotation_deg: self.rotation_deg.middle(),
            strength: self.strength.middle(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::planckian;
    use crate::scene::recipe::tests::{catalog, tray};
    use crate::scene::{AssetVariant, LightDirection, LightDirectionSource, Range, Scene};
    use std::collections::BTreeSet;

    fn scenes(off: &[Variation]) -> Vec<Scene> {
        let recipe = Recipe {
            off: off.to_vec(),
            ..Recipe::default()
        };
        (0..120).map(|k| scene_of(&recipe, k)).collect()
    }

    fn scene_of(recipe: &Recipe, k: u64) -> Scene {
        let three_photos = |variant| AssetVariant {
            photo_sizes: vec![[0.2, 0.07]; 3],
            ..variant
        };
        let catalog: Vec<_> = catalog(9).into_iter().map(three_photos).collect();
        recipe
            .scene(5, k, &[tray("a"), tray("b")], &catalog)
            .unwrap()
    }

    /// The scene with everything that a source varies set to the same values.
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
            // Selections are the same in the first 50 scenes, where none repeats yet.
            for (a, b) in all.iter().zip(&off).take(REPEATED_SELECTIONS as usize) {
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
        assert_eq!(
            distinct(&|s| format!("{:?}", things(s))),
            REPEATED_SELECTIONS as usize
        );
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
    fn light_that_is_off_stays_at_the_middle_of_every_range_that_it_has() {
        let warm = LightRanges {
            temperature_k: Some(Range::new(2500.0, 6500.0)),
            // The share of ambient light is relative to that of a lamp of its size.
            size: Range::new(0.3, 0.3),
            ..LightRanges::default()
        };
        let recipe = Recipe {
            off: vec![Variation::Light],
            lights: vec![warm],
            light_direction: LightDirectionSource::MatchWalls,
            ..Recipe::default()
        };
        let light = |k| {
            let scene = scene_of(&recipe, k);
            let colour = scene.lights[0].color;
            (colour, scene.ambient, scene.light_direction)
        };
        let (colour, ambient, direction) = light(0);
        assert_eq!(colour, planckian(4500.0));
        let deviations = [0.0; 2];
        assert_eq!(direction, LightDirection::MatchWalls { deviations });
        assert!((1..20).all(|k| light(k) == (colour, ambient, direction)));
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
