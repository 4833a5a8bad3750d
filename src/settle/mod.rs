//! Settle: dropped objects come to rest on the surface and on each other.
//!
//! [`settle`] turns every [`Placement::Drop`] into a [`Placement::At`] and leaves the rest of the scene alone; a scene in
//! which nothing falls comes back as it is and no physics world is built. Objects fall as thin boxes
//! ([`SettleOptions::half_body`]), between walls that stand on the edges of the surface and have no top. A card lies in
//! the *middle* plane of its box. Objects that already are at rest are obstacles that do not move.
//!
//! The result is judged by an overlap test of its own ([`overlap`]), which shares nothing with the physics engine, and a
//! bad end is tried again from a higher start. Same scene, same bits: on every machine, at any thread count.

mod overlap;
mod world;

pub use crate::scene::{SettleMode, SettleOptions};

use crate::error::{Error, Result};
use crate::geom::Pose;
use crate::scene::{Placement, Scene};
use overlap::Solid;

/// What came of a fall.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The scene at rest; as it was given unless the verdict is [`Verdict::Rested`].
    pub scene: Scene,
    /// How the last try ended.
    pub verdict: Verdict,
    /// Tries made, 0 when nothing fell.
    pub attempts: u32,
    /// Length of the last fall, seconds of a world in which the typical card is 200 mm long.
    pub seconds: f64,
    /// Deepest overlap of a dropped body with another body, the floor or a wall at the end, metres.
    pub overlap: f64,
}

/// How a fall ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Everything lies still, inside the walls, overlapping by no more than is accepted.
    Rested,
    /// Something still moved at the time limit.
    TimedOut,
    /// The centres of these objects (their ids: index + 1) left the walls, the floor, or the numbers.
    Escaped(Vec<usize>),
    /// Bodies overlap by this depth, metres.
    Penetrating(f64),
}

impl Settled {
    /// The scene at rest.
    /// # Errors
    /// [`Error::Unsettled`] for every other verdict.
    pub fn into_scene(self) -> Result<Scene> {
        let what = match self.verdict {
            Verdict::Rested => return Ok(self.scene),
            Verdict::TimedOut => format!("something still moves after {:.1} s", self.seconds),
            Verdict::Escaped(ids) => format!("objects {ids:?} left the surface"),
            Verdict::Penetrating(depth) => format!("bodies overlap by {:.2} mm", depth * 1e3),
        };
        Err(Error::Unsettled { what: format!("{what} ({} tries)", self.attempts) })
    }
}

/// Lets the dropped objects of a scene come to rest.
///
/// A bad end is part of the result, not an error; [`Settled::into_scene`] makes it one.
/// # Errors
/// A scene ([`Scene::check`]) or an option that cannot be right.
pub fn settle(scene: Scene, options: &SettleOptions) -> Result<Settled> {
    scene.check()?;
    options.check()?;
    if !scene.objects.iter().any(|object| matches!(object.placement, Placement::Drop { .. })) {
        return Ok(Settled { scene, verdict: Verdict::Rested, attempts: 0, seconds: 0.0, overlap: 0.0 });
    }
    let mut attempts = 0;
    loop {
        let end = world::fall(&scene, options, raise(attempts));
        attempts += 1;
        let (verdict, overlap) = judge(&scene, options, &end);
        if verdict == Verdict::Rested || attempts == options.attempts {
            let scene = if verdict == Verdict::Rested { at_rest(scene, &end.poses) } else { scene };
            return Ok(Settled { scene, verdict, attempts, seconds: end.seconds, overlap });
        }
    }
}

/// Factor on all heights of the start. Free heights only grow by it, so a start without overlap stays one.
fn raise(attempt: u32) -> f64 {
    1.0 + 0.05 * f64::from(attempt)
}

fn at_rest(mut scene: Scene, poses: &[Pose]) -> Scene {
    for (object, pose) in scene.objects.iter_mut().zip(poses) {
        if let Placement::Drop { .. } = object.placement {
            object.placement = Placement::At(*pose);
        }
    }
    scene
}

fn judge(scene: &Scene, options: &SettleOptions, end: &world::End) -> (Verdict, f64) {
    let solids: Vec<Solid> = scene
        .objects
        .iter()
        .zip(&end.poses)
        .map(|(object, pose)| Solid {
            world_from_body: *pose,
            half: options.half_body(object),
            falls: matches!(object.placement, Placement::Drop { .. }),
        })
        .collect();
    let escaped = overlap::outside(&solids, scene.surface.size);
    if !escaped.is_empty() {
        return (Verdict::Escaped(escaped), f64::INFINITY);
    }
    let depth = overlap::deepest(&solids, scene.surface.size);
    let verdict = match () {
        () if !end.asleep => Verdict::TimedOut,
        () if depth > options.max_overlap * world::typical_length(scene) => Verdict::Penetrating(depth),
        () => Verdict::Rested,
    };
    (verdict, depth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Background, Choice, Range, Recipe};

    pub(super) fn dropped(k: u64, count: usize) -> Scene {
        let tray = Background {
            name: "tray".into(),
            size: [0.6, 0.4],
            corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
            photo: [60, 40],
            focal_px: None,
        };
        let choice = |i: usize| Choice {
            asset: format!("b{i}"),
            photo_sizes: vec![[0.2, 0.07], [0.19, 0.08]],
            thickness: 0.002 + 0.001 * (i % 10) as f64,
            mass: 0.02 + 0.002 * (i % 10) as f64,
        };
        let recipe = Recipe { objects: Range::fixed(count as f64), ..Recipe::default() };
        recipe.scene(0, k, &[tray], &(0..20).map(choice).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    #[ignore]
    fn measure() {
        for count in [1, 5, 10, 20, 30, 60, 120] {
            let n = if count > 30 { 8 } else { 24 };
            let t = std::time::Instant::now();
            let all: Vec<Settled> =
                (0..n).map(|k| settle(dropped(k, count), &SettleOptions::default()).unwrap()).collect();
            let ms = t.elapsed().as_secs_f64() * 1e3 / n as f64;
            let worst = all.iter().map(|s| s.overlap).fold(0.0, f64::max) * 1e3;
            let secs = all.iter().map(|s| s.seconds).sum::<f64>() / n as f64;
            let bad: Vec<_> = all
                .iter()
                .filter(|s| s.verdict != Verdict::Rested || s.attempts > 1)
                .map(|s| (&s.verdict, s.attempts))
                .collect();
            println!("{count:4} {ms:8.1} ms  {secs:.2} s  worst {worst:.3} mm  bad {bad:?}");
        }
    }
}
