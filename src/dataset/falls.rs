//! Falls that were computed before: a change that does not affect how objects fall needs no new
//! one.
#![cfg_attr(
    not(feature = "settle"),
    allow(dead_code, reason = "without physics nothing falls")
)]

use crate::allowance::Allowance;
use crate::error::{Error, Result};
use crate::scene::{Grade, Placement, Scene, SettleOptions};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Resting places of the objects of the most recently settled scenes; by default none are
/// remembered.
#[derive(Debug, Default)]
pub(crate) struct Falls {
    most: usize,
    /// What fell, and where it came to rest, the latest last.
    known: Mutex<VecDeque<(String, Arc<Fall>)>>,
}

/// How a scene fell; none until it has.
type Fall = Mutex<Option<Outcome>>;

#[derive(Debug)]
enum Outcome {
    /// Where its objects came to rest.
    Rest(Vec<Placement>),
    /// Why they did not, and the work that this took.
    Unsettled(String, u64),
}

impl Falls {
    /// Remembers this many scenes.
    pub(crate) fn of_last(most: usize) -> Self {
        let known = Mutex::default();
        Self { most, known }
    }

    /// The scene with its objects at rest, computed by `fall` unless it is known. If several
    /// threads need the same fall at once, one computes it and the others wait.
    pub(crate) fn settled(
        &self,
        scene: Scene,
        options: &SettleOptions,
        allowance: &Allowance,
        fall: impl FnOnce(Scene) -> Result<Scene>,
    ) -> Result<Scene> {
        if self.most == 0 {
            return fall(scene);
        }
        let known = self.fall_of(what_falls(&scene, options));
        let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(outcome) = &*known {
            return outcome.repeated(scene, allowance);
        }
        let before = allowance.taken();
        let fallen = fall(scene);
        *known = Outcome::of(&fallen, allowance, before);
        fallen
    }

    fn fall_of(&self, key: String) -> Arc<Fall> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, fall)) = known.iter().find(|(own, _)| *own == key) {
            return fall.clone();
        }
        if known.len() == self.most {
            known.pop_front();
        }
        let fall = Arc::default();
        known.push_back((key, Arc::clone(&fall)));
        fall
    }
}

impl Outcome {
    /// What is the same whenever the scene falls: not that its work was more than was left.
    fn of(fallen: &Result<Scene>, allowance: &Allowance, before: u64) -> Option<Self> {
        match fallen {
            Ok(scene) => {
                let placements = scene.objects.iter().map(|object| object.placement);
                Some(Self::Rest(placements.collect()))
            }
            Err(Error::Unsettled { what }) if !allowance.is_spent() => {
                Some(Self::Unsettled(what.clone(), allowance.taken() - before))
            }
            Err(_) => None,
        }
    }

    /// The same again, at the same cost where it counts: whether a picture is rejected must not
    /// depend on what fell before.
    fn repeated(&self, scene: Scene, allowance: &Allowance) -> Result<Scene> {
        match self {
            Self::Rest(placements) => Ok(placed(scene, placements)),
            Self::Unsettled(what, work) => {
                allowance.take(*work)?;
                let what = what.clone();
                Err(Error::Unsettled { what })
            }
        }
    }
}

/// Everything in a scene that decides how it falls.
fn what_falls(scene: &Scene, options: &SettleOptions) -> String {
    let mut scene = scene.clone().unlit();
    for object in &mut scene.objects {
        object.grade = Grade::default();
    }
    let falling = (scene.camera, scene.surface, scene.objects, options);
    serde_json::to_string(&falling).expect("numbers and names are JSON")
}

fn placed(mut scene: Scene, placements: &[Placement]) -> Scene {
    for (object, placement) in scene.objects.iter_mut().zip(placements) {
        object.placement = *placement;
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Pose;
    use std::cell::Cell;

    const SCENE: &str = "image = [64, 48]\n\
        camera = { rectangle = { corners_px = [[1, 1], [9, 1], [9, 9], [1, 9]], photo = [10, 10] } }\n\
        surface = { size = [0.4, 0.3] }\n\
        [[objects]]\nasset = 'a'\nsize = [0.1, 0.1]\nthickness = 0.01\nmass = 0.1\n\
        placement = { drop = { above = [0, 0], height = 0.1, rotation = [0, 0, 0, 1] } }\n";

    #[test]
    fn only_what_changes_the_fall_is_settled_again() {
        let scene: Scene = toml::from_str(SCENE).unwrap();
        let (options, count) = (SettleOptions::default(), Cell::new(0));
        let falls = Falls::of_last(1);
        let settled = |falls: &Falls, scene: &Scene| {
            let allowance = Allowance::new(1);
            let rest = falls.settled(scene.clone(), &options, &allowance, |mut scene| {
                count.set(count.get() + 1);
                scene.objects[0].placement = Placement::At(Pose::translation(0.0, 0.0, 0.005));
                Ok(scene)
            });
            rest.unwrap()
        };
        let first = settled(&falls, &scene);
        let mut redder = scene.clone();
        redder.objects[0].grade.hue_deg = 20.0;
        let redder = settled(&falls, &redder);
        assert_eq!(count.get(), 1);
        assert_eq!(redder.objects[0].placement, first.objects[0].placement);
        assert_eq!(redder.objects[0].grade.hue_deg, 20.0);
        let mut larger = scene.clone();
        larger.objects[0].size = [0.2, 0.1];
        settled(&falls, &larger);
        settled(&falls, &scene);
        assert_eq!(count.get(), 3, "the last one alone is known");
        settled(&Falls::default(), &scene);
        settled(&Falls::default(), &scene);
        assert_eq!(count.get(), 5);
    }

    #[test]
    fn what_found_no_rest_costs_its_work_again_but_does_not_fall_again() {
        let scene: Scene = toml::from_str(SCENE).unwrap();
        let (falls, count) = (Falls::of_last(1), Cell::new(0));
        let left_of = |most| {
            let allowance = Allowance::new(most);
            let options = SettleOptions::default();
            let rest = falls.settled(scene.clone(), &options, &allowance, |_| {
                count.set(count.get() + 1);
                allowance.take(7)?;
                let what = "something still moves".into();
                Err(Error::Unsettled { what })
            });
            (rest.unwrap_err().to_string(), most - allowance.taken())
        };
        let (message, left) = left_of(7);
        assert!(message.contains("something still moves") && left == 0);
        // Nothing was left: with more work it may have come to rest.
        let first = left_of(20);
        assert_eq!((first.1, count.get()), (13, 2));
        assert_eq!(left_of(20), first);
        assert!(left_of(5).0.contains("no rest within the work"));
        assert_eq!(count.get(), 2);
    }
}
