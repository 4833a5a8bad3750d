//! Settle: dropped objects come to rest on the surface and on each other.
//!
//! [`settle`] turns every [`Placement::Drop`] into a [`Placement::At`] and leaves the rest of the scene alone; a scene in
//! which nothing falls comes back as it is and no physics world is built. Objects fall as thin boxes
//! ([`SettleOptions::half_body`]), between walls that stand on the edges of the surface and have no top. A card lies in
//! the *middle* plane of its box. Objects that already are at rest are obstacles that do not move.
//!
//! The result is judged by an overlap test of its own, which shares nothing with the physics engine, and a
//! bad end is tried again from a higher start. Same scene, same bits: on every machine, at any thread count.

#[cfg(test)]
mod extremes;
mod level;
mod overlap;
mod world;

pub use crate::scene::{SettleMode, SettleOptions};

use crate::error::{Error, Result};
use crate::geom::Pose;
use crate::scene::{Object, Placement, Scene};
use overlap::Solid;
use world::End;

/// What came of a fall.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The scene at rest; as it was given unless the verdict is [`Verdict::Rested`].
    pub scene: Scene,
    /// How the last try ended.
    pub verdict: Verdict,
    /// How the tries before the last one ended; none of them is [`Verdict::Rested`].
    pub rejected: Vec<Verdict>,
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
        Err(Error::Unsettled { what: format!("{what}, after {} tries", self.rejected.len() + 1) })
    }
}

/// Lets the dropped objects of a scene come to rest.
///
/// A bad end is part of the result, not an error; [`Settled::into_scene`] makes it one.
/// # Errors
/// A scene ([`Scene::check`]) or an option that cannot be right; an object that starts outside the walls.
pub fn settle(scene: Scene, options: &SettleOptions) -> Result<Settled> {
    scene.check()?;
    options.check()?;
    check_starts(&scene)?;
    if !scene.objects.iter().any(|object| matches!(object.placement, Placement::Drop { .. })) {
        return Ok(Settled { scene, verdict: Verdict::Rested, rejected: vec![], seconds: 0.0, overlap: 0.0 });
    }
    let mut rejected = Vec::new();
    loop {
        let end = match without_physics(&scene, options) {
            Some(poses) => End { poses, asleep: true, seconds: 0.0 },
            None => world::fall(&scene, options, raise(rejected.len())),
        };
        let (verdict, overlap) = judge(&scene, options, &end);
        if verdict == Verdict::Rested {
            return Ok(Settled { scene: at_rest(scene, &end.poses), verdict, rejected, seconds: end.seconds, overlap });
        }
        if end.seconds == 0.0 || rejected.len() + 1 >= options.attempts as usize {
            return Ok(Settled { scene, verdict, rejected, seconds: end.seconds, overlap });
        }
        log::debug!("settle: try {} ended badly: {verdict:?}", rejected.len() + 1);
        rejected.push(verdict);
    }
}

fn check_starts(scene: &Scene) -> Result<()> {
    let [w, h] = scene.surface.size;
    for (i, object) in scene.objects.iter().enumerate() {
        let Placement::Drop { above: [x, y], .. } = object.placement else { continue };
        if x.abs() > w / 2.0 || y.abs() > h / 2.0 {
            let what = format!("[{x}, {y}], expected over the surface of {w} x {h} m around the origin");
            return Err(Error::value(format!("objects[{i}].placement.drop.above"), what));
        }
    }
    Ok(())
}

fn without_physics(scene: &Scene, options: &SettleOptions) -> Option<Vec<Pose>> {
    match options.mode {
        SettleMode::Fall => level::alone(scene, options),
        SettleMode::Flat => Some(level::flat(scene, options)),
    }
}

/// Factor on all heights of the start. Free heights only grow by it, so a start without overlap stays one.
fn raise(attempt: usize) -> f64 {
    1.0 + 0.05 * attempt as f64
}

fn at_rest(mut scene: Scene, poses: &[Pose]) -> Scene {
    for (object, pose) in scene.objects.iter_mut().zip(poses) {
        if let Placement::Drop { .. } = object.placement {
            object.placement = Placement::At(*pose);
        }
    }
    scene
}

/// The verdict on a fall, and the deepest overlap at its end.
fn judge(scene: &Scene, options: &SettleOptions, end: &End) -> (Verdict, f64) {
    let bodies = solids(scene, options, &end.poses);
    let escaped = overlap::outside(&bodies, scene.surface.size);
    if !escaped.is_empty() {
        return (Verdict::Escaped(escaped), f64::INFINITY);
    }
    let depth = overlap::deepest(&bodies, scene.surface.size);
    if !end.asleep {
        (Verdict::TimedOut, depth)
    } else if depth > options.max_overlap * world::typical_length(scene) {
        (Verdict::Penetrating(depth), depth)
    } else {
        (Verdict::Rested, depth)
    }
}

/// The boxes that stand for the objects at these poses.
fn solids(scene: &Scene, options: &SettleOptions, poses: &[Pose]) -> Vec<Solid> {
    let solid = |(object, pose): (&Object, &Pose)| Solid {
        world_from_body: *pose,
        half: options.half_body(object),
        falls: matches!(object.placement, Placement::Drop { .. }),
    };
    scene.objects.iter().zip(poses).map(solid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{UnitQuaternion, Vector3};
    use crate::scene::{Background, CameraSource, Choice, Range, Recipe};

    pub(super) fn dropped(k: u64, count: usize) -> Scene {
        let tray = Background {
            name: "tray".into(),
            size: [0.6, 0.4],
            camera: CameraSource::Rectangle {
                corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
                photo: [60, 40],
                focal_px: None,
            },
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

    /// Cards of 200 x 80 x 5 mm, slightly tilted, over a surface of 0.6 x 0.4 m.
    pub(super) fn falling(starts: &[([f64; 2], f64)]) -> Scene {
        let mut scene = dropped(0, starts.len());
        for (object, &(above, height)) in scene.objects.iter_mut().zip(starts) {
            let rotation = UnitQuaternion::from_euler_angles(0.1, -0.05, 0.3);
            (object.size, object.thickness, object.mass) = ([0.2, 0.08], 0.005, 0.03);
            object.placement = Placement::Drop { above, height, rotation };
        }
        scene
    }

    fn settled(scene: Scene) -> Settled {
        let settled = settle(scene, &SettleOptions::default()).unwrap();
        assert_eq!(settled.verdict, Verdict::Rested);
        settled
    }

    fn pose(settled: &Settled, i: usize) -> Pose {
        let Placement::At(pose) = settled.scene.objects[i].placement else { panic!("object {i} still falls") };
        pose
    }

    #[test]
    fn with_nothing_to_drop_a_scene_comes_back_as_it_is() {
        let once = settled(dropped(0, 6)).scene;
        let twice = settled(once.clone());
        assert_eq!((twice.rejected, &twice.scene), (vec![], &once));
    }

    #[test]
    fn a_fall_changes_placements_only() {
        let before = dropped(1, 6);
        let mut after = settled(before.clone()).scene;
        for (after, before) in after.objects.iter_mut().zip(&before.objects) {
            assert!(matches!(after.placement, Placement::At(_)));
            after.placement = before.placement;
        }
        assert_eq!(after, before);
    }

    /// The closed form leaves out the slip of the first touch: some millimetres.
    #[test]
    fn a_card_that_falls_alone_ends_where_physics_says() {
        let (scene, options) = (falling(&[([0.05, -0.02], 0.1)]), SettleOptions::default());
        let (closed, fall) = (pose(&settled(scene.clone()), 0), world::fall(&scene, &options, 1.0).poses[0]);
        assert!((closed.translation.vector - fall.translation.vector).norm() < 0.005);
        assert!(closed.rotation.angle_to(&fall.rotation) < 0.03);
    }

    #[test]
    fn a_stack_of_n_plates_rests_at_their_heights() {
        let mut scene = falling(&[([0.0, 0.0], 0.01), ([0.0, 0.0], 0.02), ([0.0, 0.0], 0.03), ([0.0, 0.0], 0.04)]);
        for object in &mut scene.objects {
            let Placement::Drop { rotation, .. } = &mut object.placement else { panic!("dropped") };
            *rotation = UnitQuaternion::identity();
        }
        let settled = settled(scene);
        for i in 0..4 {
            // Contacts push 0.2 mm before they touch, on either side.
            let (z, plates) = (pose(&settled, i).translation.z, i as f64 + 0.5);
            assert!((z - 0.005 * plates).abs() < 0.0004 * (plates + 0.5), "plate {i} at {z}");
        }
    }

    #[test]
    fn a_card_at_rest_does_not_move_and_is_not_passed_through() {
        let mut scene = falling(&[([0.0, 0.0], 0.05), ([0.02, 0.0], 0.2)]);
        let fixed = Pose::from_parts(Vector3::new(0.0, 0.0, 0.05).into(), UnitQuaternion::identity());
        scene.objects[0].placement = Placement::At(fixed);
        let settled = settled(scene);
        assert_eq!(pose(&settled, 0), fixed);
        assert!(pose(&settled, 1).translation.z > 0.05);
    }

    #[test]
    fn the_unit_of_length_does_not_matter() {
        let scene = dropped(3, 8);
        let mut large = scene.clone();
        large.surface.size = large.surface.size.map(|x| 8.0 * x);
        for object in &mut large.objects {
            object.size = object.size.map(|x| 8.0 * x);
            object.thickness *= 8.0;
            let Placement::Drop { above, height, .. } = &mut object.placement else { panic!("dropped") };
            (*above, *height) = (above.map(|x| 8.0 * x), 8.0 * *height);
        }
        let (small, large) = (settled(scene), settled(large));
        for i in 0..8 {
            let (a, b) = (pose(&small, i), pose(&large, i));
            assert_eq!((a.translation.vector * 8.0, a.rotation), (b.translation.vector, b.rotation));
        }
    }

    #[test]
    fn a_fall_that_is_cut_short_is_told_and_leaves_the_scene_falling() {
        let (scene, options) = (dropped(0, 5), SettleOptions { time_limit: 0.1, ..Default::default() });
        let settled = settle(scene.clone(), &options).unwrap();
        assert_eq!((&settled.verdict, &settled.scene), (&Verdict::TimedOut, &scene));
        assert_eq!(settled.rejected, vec![Verdict::TimedOut; 3]);
        let told = settled.into_scene().unwrap_err().to_string();
        assert_eq!(told, "settle: something still moves after 0.1 s, after 4 tries");
    }

    #[test]
    fn a_start_outside_the_walls_is_told() {
        let told = settle(falling(&[([0.0, 0.0], 0.1), ([0.1, -0.3], 0.1)]), &SettleOptions::default()).unwrap_err();
        let expected = "[0.1, -0.3], expected over the surface of 0.6 x 0.4 m around the origin";
        assert_eq!(told.to_string(), format!("objects[1].placement.drop.above: {expected}"));
    }

    #[test]
    fn a_card_that_cannot_be_inside_is_told() {
        let mut scene = falling(&[([0.0, 0.0], 0.1)]);
        scene.objects[0].size = [1.5, 0.9];
        let settled = settle(scene, &SettleOptions::default()).unwrap();
        assert!(matches!(settled.verdict, Verdict::Penetrating(_) | Verdict::Escaped(_)), "{:?}", settled.verdict);
    }
}
