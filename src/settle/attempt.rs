//! Attempts to bring a scene to rest: from which heights, with which steps, and how each ended.

use super::bodies::{is_dropped, max_overlap, touch_distance, typical_length};
use super::overlap::{self, Solid, Touch};
use super::room::{Room, bodies_in_room};
use super::world::{Drop, Fall};
use super::{SettleVerdict, columns, level, support};
use crate::allowance::Allowance;
use crate::error::Result;
use crate::geom::Pose;
use crate::scene::{Draws, Object, Placement, Scene, SettleMode, SettleOptions};

/// Maximum number of times that attempts halve the first one's step.
const MAX_STEP_HALVINGS: u32 = 3;
/// Seed of the starting heights of attempts after the first.
const RETRY_SEED: u64 = 0x5e771e;
/// Maximum rise of one card of a stack in another attempt, as a share of the typical card's length.
const MAX_RAISE_RATIO: f64 = 0.1;

/// The attempts at one scene.
pub(super) struct AttemptSeries<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a SettleOptions,
    /// Steps between samples of the motion; 0 for no samples.
    pub(super) sample_every: usize,
    pub(super) allowance: &'a Allowance<'a>,
}

/// How one attempt ended.
pub(super) struct Attempt {
    pub(super) verdict: SettleVerdict,
    /// The scene at its end, if it rested.
    pub(super) rested: Option<Scene>,
    pub(super) overlap: f64,
    pub(super) fall: Fall,
}

impl AttemptSeries<'_> {
    /// The last attempt, and the verdicts on those before it.
    pub(super) fn run(&self) -> Result<(Attempt, Vec<SettleVerdict>)> {
        let mut rejected = Vec::new();
        let mut halvings = 0;
        loop {
            let attempt = self.attempt(rejected.len(), halvings)?;
            self.log_verdict(&attempt, rejected.len() + 1);
            if self.is_final(&attempt, rejected.len() + 1) {
                return Ok((attempt, rejected));
            }
            halvings = self.next_halvings(&attempt, halvings);
            rejected.push(attempt.verdict);
        }
    }

    fn log_verdict(&self, attempt: &Attempt, count: usize) {
        log::debug!(
            "settle: attempt {count}: {:?} after {:.2} s, {} of work",
            attempt.verdict,
            attempt.fall.seconds,
            self.allowance.taken()
        );
    }

    /// One fall, with a verdict on it.
    fn attempt(&self, number: usize, halvings: u32) -> Result<Attempt> {
        let fall = self.fall(number, halvings)?;
        let end = with_poses(self.scene.clone(), &fall.poses);
        let (verdict, overlap) = self.judge(&end, &fall);
        if verdict == SettleVerdict::TimedOut {
            self.allowance.add_timed_out();
        }
        let rested = (verdict == SettleVerdict::Rested).then_some(end);
        Ok(Attempt {
            verdict,
            rested,
            overlap,
            fall,
        })
    }

    fn fall(&self, number: usize, halvings: u32) -> Result<Fall> {
        match self.options.mode {
            SettleMode::Fall => self.simulate(number, halvings),
            SettleMode::Flat => self.lay_flat(),
        }
    }

    fn simulate(&self, number: usize, halvings: u32) -> Result<Fall> {
        columns::fall(&Drop {
            scene: self.scene,
            options: self.options,
            heights: &start_heights(self.scene, number),
            sample_every: self.sample_every,
            halvings,
            allowance: self.allowance,
        })
    }

    fn lay_flat(&self) -> Result<Fall> {
        let poses = level::flat(self.scene, self.options, self.allowance)?;
        Ok(Fall {
            poses: poses.into_iter().map(Some).collect(),
            rests: true,
            ..Fall::default()
        })
    }

    /// Whether no other attempt follows: it rested, needed no simulation, or was the last allowed.
    fn is_final(&self, attempt: &Attempt, count: usize) -> bool {
        attempt.verdict == SettleVerdict::Rested
            || attempt.fall.seconds == 0.0
            || count >= self.options.attempts as usize
    }

    /// Number of times that the next attempt halves the step.
    ///
    /// Bodies that have sunk in need stiffer contacts, which shorter steps allow; those that have
    /// gained energy hit too hard in one step, and would do so again from most heights.
    fn next_halvings(&self, attempt: &Attempt, halvings: u32) -> u32 {
        let sank = attempt.overlap.is_finite() && self.is_too_deep(attempt.overlap);
        let exploded = matches!(attempt.verdict, SettleVerdict::Exploded(_));
        (halvings + u32::from(sank || exploded)).min(MAX_STEP_HALVINGS)
    }

    /// The verdict on a fall, and the deepest overlap at its end.
    fn judge(&self, end: &Scene, fall: &Fall) -> (SettleVerdict, f64) {
        let bodies = bodies_in_room(self.scene, end, self.options);
        let room = Room::new(self.scene);
        let escaped = overlap::escaped_ids(&bodies, room.limits);
        if !escaped.is_empty() {
            return (SettleVerdict::Escaped(escaped), f64::INFINITY);
        }
        let touching = overlap::touching_pairs(&bodies, touch_distance(self.scene));
        let depth = overlap::deepest(&bodies, &touching, room.invisible);
        let failure = self.judge_motion(fall, depth);
        let verdict = failure.unwrap_or_else(|| self.judge_support(&bodies, &touching));
        (verdict, depth)
    }

    /// What went wrong in a fall that ended with this overlap, if anything did.
    fn judge_motion(&self, fall: &Fall, depth: f64) -> Option<SettleVerdict> {
        if !fall.rests {
            Some(SettleVerdict::TimedOut)
        } else if self.is_too_deep(depth) {
            Some(SettleVerdict::Penetrating(depth))
        } else if fall.energy_rise > self.options.max_energy_rise {
            Some(SettleVerdict::Exploded(fall.energy_rise))
        } else {
            None
        }
    }

    /// Whether bodies at rest are supported. Those laid without physics always are.
    fn judge_support(&self, bodies: &[Solid], touching: &[Touch]) -> SettleVerdict {
        if self.options.mode == SettleMode::Flat {
            return SettleVerdict::Rested;
        }
        let unsupported = support::unsupported(self.scene, self.options, bodies, touching);
        if unsupported.is_empty() {
            SettleVerdict::Rested
        } else {
            SettleVerdict::Hanging(unsupported)
        }
    }

    fn is_too_deep(&self, depth: f64) -> bool {
        depth > max_overlap(self.scene, self.options)
    }
}

/// The heights that an attempt starts from: in the first one those of the scene; in later ones each
/// object, from the lowest up, is raised by somewhat more than the one below it, so that objects
/// that start apart in height stay apart.
pub(super) fn start_heights(scene: &Scene, attempt: usize) -> Vec<f64> {
    let mut heights: Vec<f64> = scene.objects.iter().map(own_height).collect();
    if attempt > 0 {
        let max_raise = MAX_RAISE_RATIO * typical_length(scene);
        let draws = Draws::new(RETRY_SEED, attempt as u64);
        raise_from_lowest(&mut heights, |i| {
            max_raise * draws.unit(&format!("objects[{i}].raise"))
        });
    }
    heights
}

/// Raises each height by its own amount, on top of the raise of the next lower one.
fn raise_from_lowest(heights: &mut [f64], amount: impl Fn(usize) -> f64) {
    let mut raise = 0.0;
    for i in overlap::ascending_by(heights.len(), |i| heights[i]) {
        raise += amount(i);
        heights[i] += raise;
    }
}

fn own_height(object: &Object) -> f64 {
    match object.placement {
        Placement::Drop { height, .. } => height,
        Placement::At(pose) => pose.translation.z,
        Placement::Gone => 0.0,
    }
}

/// The scene with these poses for the objects that fall, in their order; objects without one are
/// gone.
fn with_poses(mut scene: Scene, poses: &[Option<Pose>]) -> Scene {
    let falling = scene.objects.iter_mut().filter(|object| is_dropped(object));
    for (object, pose) in falling.zip(poses) {
        object.placement = pose.map_or(Placement::Gone, Placement::At);
    }
    scene
}
