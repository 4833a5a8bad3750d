//! From the start of a fall to rest.
//!
//! # Method
//! At rest is what the engine has put to sleep (every body slower than 1 cm/s and 0.5 rad/s for 0.5 s), and what only
//! trembles: no end of a card has moved by [`TREMBLE`] for [`STILL`] and the bodies together have less kinetic energy than if all
//! of them moved at [`SLOW`]. A thin card between others may vibrate for ever by hundredths of a millimetre, driven by the contact
//! solver; damping does not stop it.

use super::units::Units;
use super::{CARD, Fall, MASS};
use crate::allowance::Allowance;
use crate::error::Result;
use crate::settle::trace::MotionSample;
use crate::work::{self, Kind};
use rapier3d::prelude::{PhysicsWorld, Pose as RapierPose, RigidBody, RigidBodyHandle};

/// Movement of a card that still counts as rest, metres in the world.
const TREMBLE: f32 = 0.0002;
/// How long it must last, seconds in the world.
const STILL: f64 = 0.5;
/// Speed in the world, m/s.
const SLOW: f64 = 0.01;
/// Mean height in the world, metres, a quarter of a card: a drop by less counts as one by this. Contacts may push bodies
/// apart at 0.2 m/s, which is 2 mm of height, and that is no explosion.
const LEAST_DROP: f64 = 0.05;

/// A world in motion.
pub(super) struct Run<'a> {
    pub(super) world: PhysicsWorld,
    pub(super) bodies: Vec<RigidBodyHandle>,
    /// Of the objects that fall, in the order of `bodies`.
    pub(super) ids: Vec<usize>,
    pub(super) units: Units,
    pub(super) pace: Pace,
    /// Work of a step, for each body and pair.
    pub(super) effort: u64,
    pub(super) allowance: &'a Allowance<'a>,
}

/// Times of a fall, seconds in the world.
pub(super) struct Pace {
    pub(super) step: f64,
    pub(super) time_limit: f64,
    /// Steps between samples; none where it is 0.
    pub(super) sample_every: usize,
}

impl Run<'_> {
    /// Steps until everything rests or the time is over.
    pub(super) fn until_rest(mut self) -> Result<Fall> {
        let Pace {
            step: dt,
            time_limit,
            ..
        } = self.pace;
        let steps = (time_limit / dt).ceil() as usize;
        let (mut stillness, mut energy, mut fall) =
            (Stillness::default(), Energy::of(&self), Fall::default());
        fall.swept = [[f64::INFINITY, -f64::INFINITY]; 2];
        self.sample(&mut fall, 0);
        for step in 1..=steps {
            self.allowance.take(self.work_of_step())?;
            // Nothing is active before the first step.
            self.world.step();
            work::add(Kind::PhysicsSteps, 1);
            let now = step as f64 * dt;
            let kinetic = energy.follow(&self);
            self.sweep(&mut fall.swept);
            self.sample(&mut fall, step);
            fall.seconds = now / self.units.time;
            let asleep = self.world.islands.active_bodies().count() == 0;
            if asleep || (stillness.lasts(&self, now) && kinetic < self.trembling_energy()) {
                fall.rests = self.world.quarantine().is_empty();
                break;
            }
        }
        fall.energy_rise = energy.rise();
        fall.poses = self
            .moving()
            .map(|body| self.units.to_scene(body.position()))
            .collect();
        Ok(fall)
    }

    fn work_of_step(&self) -> u64 {
        (self.bodies.len()
            + self
                .world
                .narrow_phase
                .contact_graph()
                .raw_graph()
                .raw_edges()
                .len()) as u64
            * self.effort
    }

    fn moving(&self) -> impl Iterator<Item = &RigidBody> {
        self.bodies.iter().map(|body| &self.world.bodies[*body])
    }

    fn trembling_energy(&self) -> f64 {
        self.moving()
            .map(|body| f64::from(body.mass()) * SLOW * SLOW / 2.0)
            .sum()
    }

    fn sweep(&self, swept: &mut [[f64; 2]; 2]) {
        for collider in self.moving().flat_map(|body| body.colliders()) {
            let around = self.world.colliders[*collider].compute_aabb();
            let (least, most) = (around.mins, around.maxs);
            for (axis, [low, high]) in [[least.x, most.x], [least.y, most.y]]
                .into_iter()
                .enumerate()
            {
                let [l, h] = &mut swept[axis];
                *l = l.min(f64::from(low) / self.units.length);
                *h = h.max(f64::from(high) / self.units.length);
            }
        }
    }

    fn sample(&self, fall: &mut Fall, step: usize) {
        let Pace {
            step: dt,
            sample_every,
            ..
        } = self.pace;
        if sample_every == 0 || !step.is_multiple_of(sample_every) {
            return;
        }
        let seconds = step as f64 * dt / self.units.time;
        let (per_length, per_time) = (1.0 / self.units.length, self.units.time);
        fall.samples
            .extend(
                self.ids
                    .iter()
                    .zip(self.moving())
                    .map(|(&object, body)| MotionSample {
                        seconds,
                        object,
                        pose: self.units.to_scene(body.position()),
                        speed: f64::from(body.linvel().length()) * per_length * per_time,
                        spin: f64::from(body.angvel().length()) * per_time,
                        kinetic: f64::from(body.kinetic_energy()) / self.units.energy(),
                        potential: potential(body, &self.world) / self.units.energy(),
                    }),
            );
    }
}

/// `-m g . x` of the centre of mass, joules in the world.
fn potential(body: &RigidBody, world: &PhysicsWorld) -> f64 {
    let center = body
        .mass_properties()
        .local_mprops
        .world_com(body.position());
    let product = |a: f32, b: f32| f64::from(a) * f64::from(b);
    let g = world.gravity;
    -f64::from(body.mass())
        * (product(g.x, center.x) + product(g.y, center.y) + product(g.z, center.z))
}

/// The energy of a fall.
struct Energy {
    start: f64,
    last: f64,
    most_rise: f64,
    /// That of [`LEAST_DROP`].
    least: f64,
}

impl Energy {
    fn of(run: &Run) -> Self {
        let start = run.moving().map(|body| potential(body, &run.world)).sum();
        let weight = run.moving().count() as f64 * MASS * super::GRAVITY;
        Self {
            start,
            last: start,
            most_rise: 0.0,
            least: weight * LEAST_DROP,
        }
    }

    /// Looks at the energy after a step; returns the kinetic one, joules in the world.
    fn follow(&mut self, run: &Run) -> f64 {
        let kinetic = run
            .moving()
            .map(|body| f64::from(body.kinetic_energy()))
            .sum::<f64>();
        let now = kinetic
            + run
                .moving()
                .map(|body| potential(body, &run.world))
                .sum::<f64>();
        self.most_rise = self.most_rise.max(now - self.last);
        self.last = now;
        kinetic
    }

    /// The greatest rise between two steps as a share of what the drop gave away.
    fn rise(&self) -> f64 {
        self.most_rise / (self.start - self.last).max(self.least)
    }
}

/// Since when, and where, nothing has moved.
#[derive(Default)]
struct Stillness {
    poses: Vec<RapierPose>,
    since: f64,
}

impl Stillness {
    /// Whether no end of a card has moved by [`TREMBLE`] for the time of [`STILL`].
    fn lasts(&mut self, run: &Run, now: f64) -> bool {
        let poses = || run.moving().map(|body| *body.position());
        let known = self.poses.len() == run.bodies.len();
        let still = known
            && poses()
                .zip(&self.poses)
                .all(|(a, b)| moved(&a, b) < TREMBLE);
        if !still {
            (self.poses, self.since) = (poses().collect(), now);
        }
        still && now - self.since >= STILL
    }
}

/// How far the end of a card has moved, at most: its middle, and half a card times the angle (twice the difference of
/// the quaternions).
fn moved(a: &RapierPose, b: &RapierPose) -> f32 {
    let turned = (a.rotation - b.rotation)
        .length()
        .min((a.rotation + b.rotation).length());
    (a.translation - b.translation).length() + CARD as f32 * turned
}
