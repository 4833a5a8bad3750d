//! Settle: dropped objects come to rest on the surface and on each other.
//!
//! [`settle`] turns every [`Placement::Drop`] into a [`Placement::At`] and leaves the rest of the scene alone; a scene in
//! which nothing falls comes back as it is and no physics world is built. Objects fall as thin boxes
//! ([`SettleOptions::half_body`]) or as convex prisms ([`Object::outline`]), between walls that stand on the edges of the
//! surface, are smooth and have no top. A card lies in the *middle* plane of its body. Objects that already are at rest are obstacles that
//! do not move; a card that can touch nothing needs no physics.
//!
//! The result is judged by tests of its own, which share nothing with the physics engine, for overlap and for what holds
//! each body up, and by its energy; a bad end is tried again from other heights, with shorter steps where bodies sank into
//! each other. Same scene, same bits: on every machine, at any thread count. Work is counted, and ends ([`Allowance`]).

mod columns;
mod contact;
mod envelope;
mod heap;
mod level;
mod overlap;
mod preview;
mod support;
mod trace;
mod world;

pub use crate::scene::{SettleMode, SettleOptions};
#[doc(hidden)]
pub use heap::{heap, octagon};
pub use preview::preview;
pub use trace::{Sample, csv as trace_csv};
#[doc(hidden)]
pub use world::typical_length;

pub use crate::allowance::Allowance;
use crate::error::{Error, Result};
use crate::geom::Pose;
use crate::scene::{Draws, Object, Placement, Scene};
use overlap::{Solid, Touch};
use world::{Drop, Fall};

/// What came of a fall.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The scene at rest; as it was given unless the verdict is [`Verdict::Rested`].
    pub scene: Scene,
    /// How the last try ended.
    pub verdict: Verdict,
    /// How the tries before the last one ended; none of them is [`Verdict::Rested`].
    pub rejected: Vec<Verdict>,
    /// Length of the last fall, seconds.
    pub seconds: f64,
    /// Deepest overlap of a dropped body with another body, the floor or a wall at the end, metres.
    pub overlap: f64,
    /// Most energy that appeared between two steps of the last fall, as a share of what the drop gave away; a drop by less
    /// than a quarter of a card counts as one by that.
    pub energy_rise: f64,
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
    /// Energy appeared between two steps, this share of what the drop gave away: the steps were too long to believe it.
    Exploded(f64),
    /// These objects (their ids) hang in the air: no forces at what they touch hold them, walls being smooth.
    Hanging(Vec<usize>),
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
            Verdict::Hanging(ids) => format!("objects {ids:?} hang in the air"),
            Verdict::Exploded(share) => format!(
                "energy rose by {:.1} % of the drop's in a step",
                share * 100.0
            ),
        };
        Err(Error::Unsettled {
            what: format!("{what}, after {} tries", self.rejected.len() + 1),
        })
    }
}

/// Lets the dropped objects of a scene come to rest.
///
/// A bad end is part of the result, not an error; [`Settled::into_scene`] makes it one.
/// # Errors
/// A scene ([`Scene::check`]) or an option that cannot be right; an object that starts outside the walls; more work than
/// [`SettleOptions::most_work`].
pub fn settle(scene: Scene, options: &SettleOptions) -> Result<Settled> {
    Ok(settle_traced(scene, options, 0)?.0)
}

/// Lets the dropped objects of a scene come to rest, and tells how the last fall went: a sample of every object in each
/// `every` steps, ordered by time, then by id; none for `every` 0 and for what needs no simulation.
///
/// # Errors
/// As [`settle`].
pub fn settle_traced(
    scene: Scene,
    options: &SettleOptions,
    every: usize,
) -> Result<(Settled, Vec<Sample>)> {
    settle_within(scene, options, every, &Allowance::new(options.most_work))
}

/// Times that tries may halve the step of those before.
const FINEST: u32 = 3;

/// As [`settle_traced`], within an allowance that may be shared with other scenes and stopped.
///
/// # Errors
/// As [`settle`]; [`Error::Interrupted`] when it is stopped.
pub fn settle_within(
    scene: Scene,
    options: &SettleOptions,
    every: usize,
    allowance: &Allowance,
) -> Result<(Settled, Vec<Sample>)> {
    scene.check()?;
    options.check()?;
    check_starts(&scene)?;
    let mut rejected = Vec::new();
    if !scene.objects.iter().any(is_dropped) {
        let (verdict, seconds, overlap, energy_rise) = (Verdict::Rested, 0.0, 0.0, 0.0);
        return Ok((
            Settled {
                scene,
                verdict,
                rejected,
                seconds,
                overlap,
                energy_rise,
            },
            Vec::new(),
        ));
    }
    let mut finer = 0;
    loop {
        let heights = start_heights(&scene, rejected.len());
        let drop = Drop {
            scene: &scene,
            options,
            heights: &heights,
            sample_every: every,
            finer,
            allowance,
        };
        let Fall {
            poses,
            rests,
            seconds,
            energy_rise,
            samples,
            ..
        } = match options.mode {
            SettleMode::Fall => columns::fall(&drop)?,
            SettleMode::Flat => Fall {
                poses: level::flat(&scene, options, allowance)?,
                rests: true,
                ..Fall::default()
            },
        };
        let end = with_poses(scene.clone(), &poses);
        let (verdict, overlap) = judge(&scene, &end, options, rests, energy_rise);
        let last = verdict == Verdict::Rested
            || seconds == 0.0
            || rejected.len() + 1 >= options.attempts as usize;
        if last {
            log::debug!(
                "settle: {verdict:?} at try {}, {} of work",
                rejected.len() + 1,
                allowance.taken()
            );
            let scene = if verdict == Verdict::Rested {
                end
            } else {
                scene
            };
            return Ok((
                Settled {
                    scene,
                    verdict,
                    rejected,
                    seconds,
                    overlap,
                    energy_rise,
                },
                samples,
            ));
        }
        log::debug!(
            "settle: try {} ended badly: {verdict:?}",
            rejected.len() + 1
        );
        // What has sunk in needs stiffer contacts, which shorter steps bear; what has gained energy met too hard in one step,
        // and would again from most heights.
        let sank = overlap.is_finite() && overlap > most_overlap(&scene, options);
        finer = (finer + u32::from(sank || matches!(verdict, Verdict::Exploded(_)))).min(FINEST);
        rejected.push(verdict);
    }
}

/// Ids (index + 1) of objects that hang in the air at the end of a fall: no forces at what they touch hold them where they
/// are, walls being smooth.
///
/// `before` says which objects fell; the others stand where their author put them and hold what lies on them. None where
/// they were laid without physics ([`SettleMode::Flat`]).
/// # Errors
/// A scene or an option that cannot be right; scenes with different numbers of objects.
pub fn hanging(before: &Scene, after: &Scene, options: &SettleOptions) -> Result<Vec<usize>> {
    before.check()?;
    after.check()?;
    options.check()?;
    let (fell, lie) = (before.objects.len(), after.objects.len());
    if fell != lie {
        return Err(Error::value("objects", format!("{lie}, but {fell} fell")));
    }
    if options.mode == SettleMode::Flat || !before.objects.iter().any(is_dropped) {
        return Ok(Vec::new());
    }
    let bodies = solids_at_rest(before, after, options);
    Ok(support::hanging(
        before,
        options,
        &bodies,
        &overlap::touching(&bodies, reach(before)),
    ))
}

fn is_dropped(object: &Object) -> bool {
    matches!(object.placement, Placement::Drop { .. })
}

fn check_starts(scene: &Scene) -> Result<()> {
    let [w, h] = scene.surface.size;
    for (i, object) in scene.objects.iter().enumerate() {
        let Placement::Drop { above: [x, y], .. } = object.placement else {
            continue;
        };
        if x.abs() > w / 2.0 || y.abs() > h / 2.0 {
            let what =
                format!("[{x}, {y}], expected over the surface of {w} x {h} m around the origin");
            return Err(Error::value(
                format!("objects[{i}].placement.drop.above"),
                what,
            ));
        }
    }
    Ok(())
}

/// Seed of the heights that are tried after those of the scene.
const RETRY_SEED: u64 = 0x5e771e;
/// Most that one card of a stack is raised in another try, as a share of the typical card's length.
const MOST_RAISE: f64 = 0.1;

/// Heights that a try starts from: first those of the scene; then each object, from the lowest up, is raised by some more
/// than the one below it, so that what starts apart in height stays apart.
fn start_heights(scene: &Scene, attempt: usize) -> Vec<f64> {
    let height = |object: &Object| match object.placement {
        Placement::Drop { height, .. } => height,
        Placement::At(pose) => pose.translation.z,
    };
    let mut heights: Vec<f64> = scene.objects.iter().map(height).collect();
    if attempt == 0 {
        return heights;
    }
    let (draws, most) = (
        Draws::new(RETRY_SEED, attempt as u64),
        MOST_RAISE * world::typical_length(scene),
    );
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|&a, &b| heights[a].total_cmp(&heights[b]));
    let mut raise = 0.0;
    for i in order {
        raise += most * draws.unit(&format!("objects[{i}].raise"));
        heights[i] += raise;
    }
    heights
}

/// The scene with these poses for the objects that fall, in their order.
fn with_poses(mut scene: Scene, poses: &[Pose]) -> Scene {
    let falling = scene
        .objects
        .iter_mut()
        .filter(|object| matches!(object.placement, Placement::Drop { .. }));
    falling
        .zip(poses)
        .for_each(|(object, pose)| object.placement = Placement::At(*pose));
    scene
}

/// Gap below which bodies at rest touch, as a share of the typical card's longer side: 3 mm for 200 mm. They keep 0.4 mm;
/// what the engine has put to sleep on its way to a support may lack some more.
const REACH: f64 = 0.015;

/// The same, metres.
fn reach(scene: &Scene) -> f64 {
    REACH * world::typical_length(scene)
}

/// Deepest overlap that is accepted, metres.
fn most_overlap(scene: &Scene, options: &SettleOptions) -> f64 {
    options.max_overlap * world::typical_length(scene)
}

/// The verdict on a fall, and the deepest overlap at its end.
fn judge(
    start: &Scene,
    end: &Scene,
    options: &SettleOptions,
    rests: bool,
    energy_rise: f64,
) -> (Verdict, f64) {
    let bodies = solids_at_rest(start, end, options);
    let escaped = overlap::outside(&bodies, end.surface.size);
    if !escaped.is_empty() {
        return (Verdict::Escaped(escaped), f64::INFINITY);
    }
    let touching = overlap::touching(&bodies, reach(start));
    let depth = overlap::deepest(&bodies, &touching, end.surface.size);
    let verdict = if !rests {
        Verdict::TimedOut
    } else if depth > most_overlap(start, options) {
        Verdict::Penetrating(depth)
    } else if energy_rise > options.max_energy_rise {
        Verdict::Exploded(energy_rise)
    } else {
        supported(start, options, &bodies, &touching)
    };
    (verdict, depth)
}

/// Whether bodies that lie still are held by what they lie on. Nothing is asked of what was laid without physics.
fn supported(
    start: &Scene,
    options: &SettleOptions,
    bodies: &[Solid],
    touching: &[Touch],
) -> Verdict {
    if options.mode == SettleMode::Flat {
        return Verdict::Rested;
    }
    let hanging = support::hanging(start, options, bodies, touching);
    if hanging.is_empty() {
        Verdict::Rested
    } else {
        Verdict::Hanging(hanging)
    }
}

/// The bodies at the end of a fall; those fell that fall at its start.
fn solids_at_rest(start: &Scene, end: &Scene, options: &SettleOptions) -> Vec<Solid> {
    let pose = |object: &Object| match object.placement {
        Placement::At(pose) => pose,
        Placement::Drop {
            above: [x, y],
            height,
            rotation,
        } => Pose::from_parts([x, y, height].into(), rotation),
    };
    solids(
        start,
        options,
        &end.objects.iter().map(pose).collect::<Vec<_>>(),
    )
}

/// The bodies that stand for the objects at these poses, one for each object.
fn solids(scene: &Scene, options: &SettleOptions, poses: &[Pose]) -> Vec<Solid> {
    let solid = |(object, pose): (&Object, &Pose)| {
        let half = options.half_body(object);
        Solid {
            world_from_body: *pose,
            half,
            outline: if object.outline.is_empty() {
                rectangle(half.x, half.y)
            } else {
                object.outline.clone()
            },
            falls: matches!(object.placement, Placement::Drop { .. }),
        }
    };
    scene.objects.iter().zip(poses).map(solid).collect()
}

/// Corners of a rectangle of these half lengths, counter-clockwise.
fn rectangle(x: f64, y: f64) -> Vec<[f64; 2]> {
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{UnitQuaternion, Vector3};

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
        assert_eq!(settled.verdict, Verdict::Rested);
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

    /// The closed form leaves out the slip of the first touch: some millimetres.
    #[test]
    fn a_card_that_falls_alone_ends_where_physics_says() {
        let (scene, options) = (falling(&[([0.05, -0.02], 0.1)]), SettleOptions::default());
        let allowance = Allowance::new(options.most_work);
        let drop = Drop {
            scene: &scene,
            options: &options,
            heights: &[0.1],
            sample_every: 0,
            finer: 0,
            allowance: &allowance,
        };
        let (closed, fall) = (
            pose(&settled(scene.clone()), 0),
            drop.fall(&[0]).unwrap().poses[0],
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
            // Contacts push 0.2 mm before they touch, on either side.
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
            (&Verdict::TimedOut, &scene)
        );
        assert_eq!(settled.rejected, vec![Verdict::TimedOut; 3]);
        let told = settled.into_scene().unwrap_err().to_string();
        assert_eq!(
            told,
            "settle: something still moves after 0.1 s, after 4 tries"
        );
    }

    /// Closed form: on a slope of a a plate stays if tan a < mu, and else slides.
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
            assert_eq!(rest.verdict, Verdict::Rested);
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

    /// What holds for the dimensions holds for the bits, where the factor on time is a power of two.
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
        assert_eq!(rest.verdict, Verdict::Rested);
        let energy = |part: &[Sample]| part.iter().map(|s| s.kinetic + s.potential).sum::<f64>();
        let steps: Vec<&[Sample]> = samples.chunks(6).collect();
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

    /// The longest that is within bounds.
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

    /// Counted as if all of it lay where it lands.
    #[cfg(feature = "counters")]
    #[test]
    fn settings_without_an_end_are_refused_before_a_step_is_made() {
        let little = SettleOptions {
            most_work: 1000,
            ..SettleOptions::default()
        };
        for options in [endless(), little] {
            let told = || settle(dropped(0, 100), &options).unwrap_err().to_string();
            let (told, work) = crate::work::counted(told).unwrap();
            assert!(
                told.starts_with("settle: no rest within the work of one picture, "),
                "{told}"
            );
            assert_eq!(work[crate::work::Kind::PhysicsSteps], 0);
        }
    }

    #[cfg(feature = "counters")]
    #[test]
    fn settings_without_an_end_end_with_the_work_of_one_picture() {
        let told = || settle(dropped(0, 5), &endless()).unwrap_err().to_string();
        let (told, work) = crate::work::counted(told).unwrap();
        assert!(
            told.starts_with("settle: no rest within the work of one picture, 100000000 "),
            "{told}"
        );
        assert!(
            (1..10_000).contains(&work[crate::work::Kind::PhysicsSteps]),
            "{work:?}"
        );
    }

    #[test]
    fn work_is_shared_by_all_tries() {
        // Never at rest: each try takes all of its time.
        let options = SettleOptions {
            time_limit: 0.2,
            attempts: 100,
            most_work: 20_000,
            ..Default::default()
        };
        let told = settle(dropped(0, 5), &options).unwrap_err().to_string();
        assert!(
            told.starts_with(
                "settle: no rest within the work of one picture, 20000 (settle.most_work)"
            ),
            "{told}"
        );
    }

    #[test]
    fn what_sinks_in_is_tried_again_with_shorter_steps() {
        let heap = || dropped(2, 60);
        // Three times as long as they should be for so many.
        let options = SettleOptions {
            step: 1.0 / 240.0,
            iterations: 1,
            ..Default::default()
        };
        let rest = settle(heap(), &options).unwrap();
        assert!(
            matches!(rest.rejected[..], [Verdict::Penetrating(_), ..]),
            "{:?}",
            rest.rejected
        );
        assert_eq!(rest.verdict, Verdict::Rested);
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
        let told = settle(
            falling(&[([0.0, 0.0], 0.1), ([0.1, -0.3], 0.1)]),
            &SettleOptions::default(),
        )
        .unwrap_err();
        let expected = "[0.1, -0.3], expected over the surface of 0.6 x 0.4 m around the origin";
        assert_eq!(
            told.to_string(),
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
                Verdict::Penetrating(_) | Verdict::Escaped(_)
            ),
            "{:?}",
            settled.verdict
        );
    }
}
