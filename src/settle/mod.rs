//! Settle: dropped objects come to rest on the surface and on each other.
//!
//! [`settle`] turns every [`Placement::Drop`] into a [`Placement::At`] and leaves the rest of the
//! scene unchanged; without falling objects it returns the scene as it is and builds no physics
//! world. Objects fall as thin boxes ([`SettleOptions::half_body`]) or as convex prisms
//! ([`Object::outline`](crate::scene::Object::outline)), with sharp or round edges
//! ([`SettleOptions::rounding`]), between the surface's walls or, if it has none, between
//! frictionless walls of infinite height on its edges. A card lies in the *middle* plane of its
//! body. Objects already at rest are stationary obstacles; a card that cannot touch anything needs
//! no physics.
//!
//! The result is judged by tests that are independent of the physics engine: for overlap, for what
//! supports each body, and by its energy. A failed attempt is repeated from other heights, with
//! shorter steps if bodies sank into each other. Same scene, same bits: on every machine, with any
//! number of threads. Work is counted and bounded ([`Allowance`]).
//!
//! # Examples
//! A card dropped alone comes to rest flat on the surface, at half its thickness:
//! ```
//! use petcomp::scene::{Placement, Scene, SettleOptions};
//!
//! let scene: Scene = toml::from_str(
//!     "image = [640, 480]
//!     camera = { rectangle = { corners_px = [[20, 40], [620, 40], [620, 440], [20, 440]], photo = [640, 480] } }
//!     surface = { size = [0.6, 0.4] }
//!     [[objects]]
//!     asset = 'bottle'
//!     size = [0.2, 0.08]
//!     thickness = 0.005
//!     mass = 0.03
//!     placement = { drop = { above = [0.1, 0.0], height = 0.2, rotation = [0, 0, 0, 1] } }",
//! )?;
//! let rest = petcomp::settle::settle(scene, &SettleOptions::default())?.into_scene()?;
//! let Placement::At(pose) = rest.objects[0].placement else { unreachable!() };
//! assert!((pose.translation.z - 0.0025).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod attempt;
mod bodies;
mod columns;
mod contact;
mod envelope;
mod heap;
mod level;
mod overlap;
mod preview;
mod room;
mod support;
mod trace;
mod world;

#[doc(hidden)]
pub use crate::scene::{SettleMode, SettleOptions};
#[doc(hidden)]
pub use bodies::typical_length;
#[doc(hidden)]
pub use heap::{heap, octagon};
#[doc(hidden)]
pub use preview::preview;
#[doc(hidden)]
pub use trace::{MotionSample, csv as trace_csv};

#[doc(hidden)]
pub use crate::allowance::Allowance;
use crate::error::{Error, Result};
use crate::scene::{Placement, Scene};
use attempt::{Attempt, AttemptSeries};
use bodies::{is_dropped, touch_distance};
use room::bodies_in_room;

/// The result of dropping a scene's objects.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The scene at rest; the original scene unless the verdict is [`SettleVerdict::Rested`].
    pub scene: Scene,
    /// How the last attempt ended.
    pub verdict: SettleVerdict,
    /// How the attempts before the last one ended; none of them is [`SettleVerdict::Rested`].
    pub rejected: Vec<SettleVerdict>,
    /// Duration of the last fall, seconds.
    pub seconds: f64,
    /// Deepest overlap of a dropped body with another body, the floor or a wall at the end,
    /// metres.
    pub overlap: f64,
    /// Largest energy gain between two steps of the last fall, as a share of the energy released by
    /// the drop; a drop by less than a quarter of a card counts as one by that much.
    pub energy_rise: f64,
}

/// How a fall ended.
#[derive(Clone, Debug, PartialEq)]
pub enum SettleVerdict {
    /// Everything is at rest, inside the walls, with no more than the accepted overlap.
    Rested,
    /// Something was still moving at the time limit ([`SettleOptions::time_limit`]).
    TimedOut,
    /// The centres of these objects (their ids: index + 1) left the walls or the floor other than
    /// over the rim, or are not finite.
    Escaped(Vec<usize>),
    /// Bodies overlap by this depth, metres.
    Penetrating(f64),
    /// The energy rose between two steps by this share of the energy released by the drop: the
    /// steps were too long for the result to be reliable.
    Exploded(f64),
    /// These objects (their ids) are unsupported: no forces at their contacts hold them in place.
    /// Walls count as frictionless.
    Hanging(Vec<usize>),
}

impl Settled {
    /// The scene at rest.
    ///
    /// # Errors
    /// [`Error::Unsettled`] for any other verdict.
    pub fn into_scene(self) -> Result<Scene> {
        let attempts = self.rejected.len() + 1;
        match self.verdict {
            SettleVerdict::Rested => Ok(self.scene),
            failure => Err(Error::Unsettled {
                what: format!(
                    "{}, after {attempts} attempts (settle.attempts)",
                    failure.reason(self.seconds)
                ),
            }),
        }
    }

    /// The result of the last attempt at a scene, and its motion.
    fn from_attempts(
        scene: Scene,
        last: Attempt,
        rejected: Vec<SettleVerdict>,
    ) -> (Self, Vec<MotionSample>) {
        let settled = Self {
            scene: last.rested.unwrap_or(scene),
            verdict: last.verdict,
            rejected,
            seconds: last.fall.seconds,
            overlap: last.overlap,
            energy_rise: last.fall.energy_rise,
        };
        (settled, last.fall.samples)
    }

    /// The result for a scene in which nothing falls.
    fn unchanged(scene: Scene) -> Self {
        Self {
            scene,
            verdict: SettleVerdict::Rested,
            rejected: Vec::new(),
            seconds: 0.0,
            overlap: 0.0,
            energy_rise: 0.0,
        }
    }
}

impl SettleVerdict {
    /// The cause of a failed fall of this duration, in words.
    fn reason(&self, seconds: f64) -> String {
        match self {
            Self::Rested => "everything is at rest".into(),
            Self::TimedOut => {
                format!("something still moves after {seconds:.1} s (settle.time_limit)")
            }
            Self::Escaped(ids) => format!("objects {ids:?} left the surface"),
            Self::Penetrating(depth) => format!(
                "bodies overlap by {:.2} mm (settle.max_overlap)",
                depth * 1e3
            ),
            Self::Hanging(ids) => format!("objects {ids:?} are unsupported"),
            Self::Exploded(share) => format!(
                "energy rose by {:.1} % of the drop's in one step (settle.max_energy_rise, settle.step)",
                share * 100.0
            ),
        }
    }
}

/// Lets the dropped objects of a scene come to rest.
///
/// A failed fall is part of the result, not an error; [`Settled::into_scene`] makes it one.
///
/// # Errors
/// An invalid scene ([`Scene::check`]) or option; an object that starts outside the walls; more
/// work than [`SettleOptions::most_work`].
pub fn settle(scene: Scene, options: &SettleOptions) -> Result<Settled> {
    Ok(settle_traced(scene, options, 0)?.0)
}

/// Lets the dropped objects of a scene come to rest, and records the last fall: a sample of every
/// object every `every` steps, ordered by time, then by id; none for `every` 0 and for falls
/// without simulation.
///
/// # Errors
/// As [`settle`].
#[doc(hidden)]
pub fn settle_traced(
    scene: Scene,
    options: &SettleOptions,
    every: usize,
) -> Result<(Settled, Vec<MotionSample>)> {
    settle_within(scene, options, every, &Allowance::new(options.most_work))
}

/// As [`settle_traced`], within an allowance that can be shared with other scenes and interrupted.
///
/// # Errors
/// As [`settle`]; [`Error::Interrupted`] if it is interrupted.
#[doc(hidden)]
pub fn settle_within(
    scene: Scene,
    options: &SettleOptions,
    every: usize,
    allowance: &Allowance,
) -> Result<(Settled, Vec<MotionSample>)> {
    scene.check()?;
    options.check()?;
    check_starts(&scene)?;
    if !scene.objects.iter().any(is_dropped) {
        return Ok((Settled::unchanged(scene), Vec::new()));
    }
    let series = AttemptSeries {
        scene: &scene,
        options,
        sample_every: every,
        allowance,
    };
    let (last, rejected) = series.run()?;
    Ok(Settled::from_attempts(scene, last, rejected))
}

/// Ids (index + 1) of objects that are unsupported at the end of a fall: no forces at their
/// contacts hold them in place. Walls count as frictionless.
///
/// Objects that fall in `before` are the dropped ones; the others stay where their author put them
/// and support what lies on them. None if objects were laid without physics ([`SettleMode::Flat`]).
///
/// # Errors
/// An invalid scene or option; scenes with different numbers of objects.
#[doc(hidden)]
pub fn hanging(before: &Scene, after: &Scene, options: &SettleOptions) -> Result<Vec<usize>> {
    before.check()?;
    after.check()?;
    options.check()?;
    check_same_count(before, after)?;
    if options.mode == SettleMode::Flat || !before.objects.iter().any(is_dropped) {
        return Ok(Vec::new());
    }
    let bodies = bodies_in_room(before, after, options);
    let touching = overlap::touching_pairs(&bodies, touch_distance(before));
    Ok(support::unsupported(before, options, &bodies, &touching))
}

fn check_same_count(before: &Scene, after: &Scene) -> Result<()> {
    let (fell, lie) = (before.objects.len(), after.objects.len());
    if fell == lie {
        return Ok(());
    }
    Err(Error::value("objects", format!("{lie}, but {fell} fell")))
}

/// Fails on the first object that starts outside the walls.
fn check_starts(scene: &Scene) -> Result<()> {
    let [w, h] = scene.surface.size;
    for (i, object) in scene.objects.iter().enumerate() {
        if let Placement::Drop { above: [x, y], .. } = object.placement
            && (x.abs() > w / 2.0 || y.abs() > h / 2.0)
        {
            return Err(starts_outside(i, [x, y], scene.surface.size));
        }
    }
    Ok(())
}

fn starts_outside(i: usize, [x, y]: [f64; 2], [w, h]: [f64; 2]) -> Error {
    Error::value(
        format!("objects[{i}].placement.drop.above"),
        format!("[{x}, {y}], expected a point over the surface of {w} x {h} m around the origin"),
    )
}

#[cfg(test)]
mod tests {
    use super::attempt::start_heights;
    use super::world::Drop;
    use super::*;
    use crate::geom::{Pose, UnitQuaternion, Vector3};

    use std::f64::consts::FRAC_PI_6;

    pub(super) fn dropped(k: u64, count: usize) -> Scene {
        heap(k, count).unwrap()
    }

    /// Cards of 200 x 80 x 5 mm, slightly tilted, over a surface of 0.6 x 0.4 m.
    pub(super) fn falling(starts: &[([f64; 2], f64)]) -> Scene {
        let mut scene = dropped(0, starts.len());
        for (object, &(above, height)) in scene.objects.iter_mut().zip(starts) {
            let rotation = UnitQuaternion::from_euler_angles(0.1, -0.05, 0.3);
            (object.size, object.thickness, object.mass) = ([0.2, 0.08], 0.005, 0.03);
            object.placement = Placement::Drop {
                above,
                height,
                rotation,
            };
        }
        scene
    }

    fn settled(scene: Scene) -> Settled {
        let settled = settle(scene, &SettleOptions::default()).unwrap();
        assert_eq!(settled.verdict, SettleVerdict::Rested);
        settled
    }

    fn pose(settled: &Settled, i: usize) -> Pose {
        let Placement::At(pose) = settled.scene.objects[i].placement else {
            panic!("object {i} still falls")
        };
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

    /// The closed form neglects the slip at first contact: some millimetres.
    #[test]
    fn a_card_that_falls_alone_ends_where_physics_says() {
        let (scene, options) = (falling(&[([0.05, -0.02], 0.1)]), SettleOptions::default());
        let allowance = Allowance::new(options.most_work);
        let drop = Drop {
            scene: &scene,
            options: &options,
            heights: &[0.1],
            sample_every: 0,
            halvings: 0,
            allowance: &allowance,
        };
        let (closed, fall) = (
            pose(&settled(scene.clone()), 0),
            drop.fall(&[0]).unwrap().poses[0].unwrap(),
        );
        assert!((closed.translation.vector - fall.translation.vector).norm() < 0.005);
        assert!(closed.rotation.angle_to(&fall.rotation) < 0.03);
    }

    #[test]
    fn a_stack_of_n_plates_rests_at_their_heights() {
        let mut scene = falling(&[
            ([0.0, 0.0], 0.01),
            ([0.0, 0.0], 0.02),
            ([0.0, 0.0], 0.03),
            ([0.0, 0.0], 0.04),
        ]);
        for object in &mut scene.objects {
            let Placement::Drop { rotation, .. } = &mut object.placement else {
                panic!("dropped")
            };
            *rotation = UnitQuaternion::identity();
        }
        let settled = settled(scene);
        for i in 0..4 {
            // Contacts push from 0.2 mm before bodies touch, on either side.
            let (z, plates) = (pose(&settled, i).translation.z, i as f64 + 0.5);
            assert!(
                (z - 0.005 * plates).abs() < 0.0004 * (plates + 0.5),
                "plate {i} at {z}"
            );
        }
    }

    #[test]
    fn a_card_at_rest_does_not_move_and_is_not_passed_through() {
        let mut scene = falling(&[([0.0, 0.0], 0.05), ([0.02, 0.0], 0.2)]);
        let fixed = Pose::from_parts(
            Vector3::new(0.0, 0.0, 0.05).into(),
            UnitQuaternion::identity(),
        );
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
            let Placement::Drop { above, height, .. } = &mut object.placement else {
                panic!("dropped")
            };
            (*above, *height) = (above.map(|x| 8.0 * x), 8.0 * *height);
        }
        let (small, large) = (settled(scene), settled(large));
        for i in 0..8 {
            let (a, b) = (pose(&small, i), pose(&large, i));
            assert_eq!(
                (a.translation.vector * 8.0, a.rotation),
                (b.translation.vector, b.rotation)
            );
        }
    }

    #[test]
    fn a_fall_that_is_cut_short_is_told_and_leaves_the_scene_falling() {
        let options = SettleOptions {
            time_limit: 0.1,
            attempts: 4,
            ..Default::default()
        };
        let scene = dropped(0, 5);
        let settled = settle(scene.clone(), &options).unwrap();
        assert_eq!(
            (&settled.verdict, &settled.scene),
            (&SettleVerdict::TimedOut, &scene)
        );
        assert_eq!(settled.rejected, vec![SettleVerdict::TimedOut; 3]);
        let seconds = settled.seconds;
        let reported = settled.into_scene().unwrap_err().to_string();
        assert_eq!(
            reported,
            format!(
                "settle: something still moves after {seconds:.1} s (settle.time_limit), after 4 attempts (settle.attempts)"
            )
        );
    }

    #[test]
    fn a_verdict_names_the_settings_that_it_follows_from() {
        for (verdict, keys) in [
            (SettleVerdict::Penetrating(2e-4), "settle.max_overlap"),
            (
                SettleVerdict::Exploded(1e-3),
                "settle.max_energy_rise, settle.step",
            ),
        ] {
            let reason = verdict.reason(1.0);
            assert!(reason.ends_with(&format!("({keys})")), "{reason}");
        }
    }

    #[test]
    fn time_is_counted_from_when_the_highest_can_have_landed() {
        // From 44 m at 4 m/s: 11 s.
        let rest = settled(falling(&[([0.0, 0.0], 0.1), ([0.02, 0.0], 44.0)]));
        assert!(rest.seconds > SettleOptions::default().time_limit);
        assert!(rest.rejected.is_empty());
    }

    /// Closed form: on a slope of angle a, a plate stays if tan a < mu, and slides otherwise.
    #[test]
    fn a_plate_on_a_slope_slides_if_it_is_steeper_than_friction_holds() {
        let slid = |friction: f64| {
            let mut scene = falling(&[([-0.15, 0.0], 0.006)]);
            scene.surface.friction = friction;
            scene.objects[0].placement = Placement::Drop {
                above: [-0.15, 0.0],
                height: 0.004,
                rotation: UnitQuaternion::identity(),
            };
            let g = [
                9.81 * libm::sin(FRAC_PI_6),
                0.0,
                -9.81 * libm::cos(FRAC_PI_6),
            ];
            let rest = settle(
                scene,
                &SettleOptions {
                    gravity: g,
                    ..Default::default()
                },
            )
            .unwrap();
            assert_eq!(rest.verdict, SettleVerdict::Rested);
            pose(&rest, 0).translation.x + 0.15
        };
        let steep = libm::tan(FRAC_PI_6);
        assert!(
            slid(1.05 * steep) < 0.001 && slid(0.95 * steep) > 0.3,
            "{} {}",
            slid(1.05 * steep),
            slid(0.95 * steep)
        );
    }

    /// What holds dimensionally holds for the bits, if the factor on time is a power of two.
    #[test]
    fn the_strength_of_gravity_sets_the_time_and_nothing_else() {
        let with = |factor: f64| {
            let gravity = [0.0, 0.0, -9.81 * factor];
            settle(
                dropped(3, 8),
                &SettleOptions {
                    gravity,
                    ..Default::default()
                },
            )
            .unwrap()
        };
        let usual = with(1.0);
        for factor in [0.1, 16.0, 100.0] {
            let other = with(factor);
            assert_eq!(other.scene, usual.scene);
            assert!((other.seconds * factor.sqrt() / usual.seconds - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn prisms_lie_closer_than_their_boxes_and_rest() {
        for k in 0..4 {
            let mut scene = dropped(k, 10);
            scene
                .objects
                .iter_mut()
                .for_each(|object| object.outline = octagon(object.size));
            let rest = settled(scene);
            assert!(rest.energy_rise <= SettleOptions::default().max_energy_rise);
        }
    }

    #[test]
    fn a_sharp_body_stands_on_its_edge_and_a_round_one_falls_over() {
        let uprightness = |rounding: f64| {
            let mut scene = falling(&[([0.0, 0.0], 0.05)]);
            scene.objects[0].thickness = 0.05;
            scene.objects[0].placement = Placement::Drop {
                above: [0.0, 0.0],
                height: 0.05,
                rotation: UnitQuaternion::from_euler_angles(1.2, 0.0, 0.0),
            };
            // Not straight down, or it would be laid flat at once.
            let options = SettleOptions {
                gravity: [0.0, 0.1, -9.8],
                rounding,
                ..Default::default()
            };
            let rest = settle(scene, &options).unwrap();
            assert_eq!(rest.verdict, SettleVerdict::Rested);
            1.0 - (pose(&rest, 0).rotation * Vector3::z()).z.abs()
        };
        let [sharp, round] = [0.0, 0.9].map(uprightness);
        assert!(sharp > 0.99 && round < 0.01, "{sharp} {round}");
    }

    #[test]
    fn round_bodies_rest_without_overlap() {
        let options = SettleOptions {
            rounding: 0.9,
            ..Default::default()
        };
        for k in 0..4 {
            let mut scene = dropped(k, 10);
            for object in &mut scene.objects {
                object.outline = octagon(object.size);
                object.thickness = 0.03;
            }
            let rest = settle(scene, &options).unwrap();
            assert_eq!(rest.verdict, SettleVerdict::Rested);
        }
    }

    #[test]
    fn another_try_raises_each_card_more_than_the_one_below_it() {
        let scene = dropped(2, 9);
        let (first, second) = (start_heights(&scene, 0), start_heights(&scene, 1));
        assert_ne!(start_heights(&scene, 2), second);
        for i in 1..9 {
            assert!(second[i] - second[i - 1] >= first[i] - first[i - 1]);
        }
    }

    #[test]
    fn a_trace_ends_where_the_cards_rest_and_its_energy_falls() {
        let (rest, samples) = settle_traced(dropped(1, 6), &SettleOptions::default(), 8).unwrap();
        assert_eq!(rest.verdict, SettleVerdict::Rested);
        let energy =
            |part: &[MotionSample]| part.iter().map(|s| s.kinetic + s.potential).sum::<f64>();
        let steps: Vec<&[MotionSample]> = samples.chunks(6).collect();
        assert!(
            steps
                .iter()
                .all(|step| (1..=6).eq(step.iter().map(|s| s.object)))
        );
        let drop = energy(steps[0]) - energy(steps[steps.len() - 1]);
        assert!(
            steps
                .windows(2)
                .all(|pair| energy(pair[1]) - energy(pair[0]) < 0.01 * drop)
        );
        let last = steps[steps.len() - 1];
        // The last sample may be seven steps before the end.
        assert!(last.iter().all(|s| {
            (s.pose.translation.vector - pose(&rest, s.object - 1).translation.vector).norm() < 1e-4
        }));
        assert_eq!(trace_csv(&samples).lines().count(), samples.len() + 1);
    }

    #[test]
    fn a_flag_ends_a_fall() {
        let stop = std::sync::atomic::AtomicBool::new(true);
        let options = SettleOptions::default();
        let end = settle_within(
            dropped(0, 5),
            &options,
            0,
            &Allowance::new(options.most_work).stopped_by(&stop),
        );
        assert_eq!(
            end.unwrap_err().to_string(),
            "interrupted: while objects fell"
        );
    }

    /// The longest within bounds.
    #[cfg(feature = "counters")]
    fn endless() -> SettleOptions {
        let slow = SettleOptions {
            step: 1e-4,
            time_limit: 600.0,
            attempts: 100,
            ..SettleOptions::default()
        };
        SettleOptions {
            iterations: 100,
            ccd: 100,
            ..slow
        }
    }

    /// Counted as if everything came to rest where it lands.
    #[cfg(feature = "counters")]
    #[test]
    fn settings_without_an_end_are_refused_before_a_step_is_made() {
        let little = SettleOptions {
            most_work: 1000,
            ..SettleOptions::default()
        };
        for options in [endless(), little] {
            let reported = || settle(dropped(0, 100), &options).unwrap_err().to_string();
            let (reported, work) = crate::work::counted(reported).unwrap();
            assert!(
                reported.starts_with("settle: no rest within the work of one picture, "),
                "{reported}"
            );
            assert_eq!(work[crate::work::Kind::PhysicsSteps], 0);
        }
    }

    #[cfg(feature = "counters")]
    #[test]
    fn settings_without_an_end_end_with_the_work_of_one_picture() {
        let options = SettleOptions {
            most_work: 20_000_000,
            ..endless()
        };
        let reported = || settle(dropped(0, 5), &options).unwrap_err().to_string();
        let (reported, work) = crate::work::counted(reported).unwrap();
        assert!(
            reported.starts_with("settle: no rest within the work of one picture, 20000000 "),
            "{reported}"
        );
        assert!(
            (1..10_000).contains(&work[crate::work::Kind::PhysicsSteps]),
            "{work:?}"
        );
    }

    #[test]
    fn work_is_shared_by_all_tries() {
        // Never at rest: each attempt takes all of its time.
        let options = SettleOptions {
            time_limit: 0.2,
            attempts: 100,
            most_work: 20_000,
            ..Default::default()
        };
        let reported = settle(dropped(0, 5), &options).unwrap_err().to_string();
        assert!(
            reported.starts_with(
                "settle: no rest within the work of one picture, 20000 (settle.most_work)"
            ),
            "{reported}"
        );
        assert!(reported.contains("at settle.time_limit: "), "{reported}");
    }

    #[test]
    fn what_sinks_in_is_tried_again_with_shorter_steps() {
        let heap = || dropped(2, 60);
        // Three times as long as they should be for this many objects.
        let options = SettleOptions {
            step: 1.0 / 240.0,
            iterations: 1,
            ..Default::default()
        };
        let rest = settle(heap(), &options).unwrap();
        assert!(
            matches!(rest.rejected[..], [SettleVerdict::Penetrating(_), ..]),
            "{:?}",
            rest.rejected
        );
        assert_eq!(rest.verdict, SettleVerdict::Rested);
    }

    #[test]
    fn a_card_longer_than_the_room_is_wide_does_not_stay_up_there() {
        // Across the room, tilted so that it just fits.
        let (length, room, tilt) = (0.36, 0.34, 0.34);
        let mut scene = falling(&[([0.0, 0.0], 0.4), ([0.05, 0.0], 0.6)]);
        scene.surface.size = [0.5, room];
        scene.objects[0].size = [0.1, length];
        let Placement::Drop { rotation, .. } = &mut scene.objects[0].placement else {
            panic!("dropped")
        };
        *rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
        let rest = settled(scene.clone());
        assert_eq!(
            hanging(&scene, &rest.scene, &SettleOptions::default()).unwrap(),
            [0; 0]
        );
        let lowest =
            |pose: Pose| pose.translation.z - 0.5 * length * (pose.rotation * Vector3::y()).z.abs();
        assert!(lowest(pose(&rest, 0)) < 0.02, "{:?}", pose(&rest, 0));
    }

    #[test]
    fn a_start_outside_the_walls_is_told() {
        let reported = settle(
            falling(&[([0.0, 0.0], 0.1), ([0.1, -0.3], 0.1)]),
            &SettleOptions::default(),
        )
        .unwrap_err();
        let expected =
            "[0.1, -0.3], expected a point over the surface of 0.6 x 0.4 m around the origin";
        assert_eq!(
            reported.to_string(),
            format!("objects[1].placement.drop.above: {expected}")
        );
    }

    #[test]
    fn a_card_that_cannot_be_inside_is_told() {
        let mut scene = falling(&[([0.0, 0.0], 0.1)]);
        scene.objects[0].size = [1.5, 0.9];
        let settled = settle(scene, &SettleOptions::default()).unwrap();
        assert!(
            matches!(
                settled.verdict,
                SettleVerdict::Penetrating(_) | SettleVerdict::Escaped(_)
            ),
            "{:?}",
            settled.verdict
        );
    }
}
