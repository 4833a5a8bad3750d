//! From the start of a fall to rest.
//!
//! # Method
//! A body is at rest if the engine has put it to sleep (every body slower than 1 cm/s and 0.5 rad/s
//! for 0.5 s), or if it only trembles: no end of a card has moved by [`REST_MOTION_M`] for
//! [`REST_TIME_S`] and the bodies together have less kinetic energy than if all of them moved at
//! [`REST_SPEED_M_PER_S`]. A thin card between others may vibrate forever by hundredths of a
//! millimetre, driven by the contact solver; damping does not stop it.

use super::stride::Stride;
use super::units::WorldUnits;
use super::{CARD_LENGTH_M, CARD_MASS_KG, Fall, GRAVITY_M_PER_S2, set_step};
use crate::allowance::Allowance;
use crate::error::Result;
use crate::geom::Pose;
use crate::settle::room::Room;
use crate::settle::trace::MotionSample;
use crate::work::{self, Kind};
use rapier3d::prelude::{
    Aabb, PhysicsWorld, Pose as RapierPose, RigidBody, RigidBodyHandle, Rotation,
};

/// Motion of a card that still counts as rest, metres in the world: over [`REST_TIME_S`] it
/// corresponds to the speed below which the engine lets bodies sleep.
const REST_MOTION_M: f32 = 0.001;
/// Time that this must last, seconds in the world.
const REST_TIME_S: f64 = 0.1;
/// Mean speed that still counts as rest, m/s in the world.
const REST_SPEED_M_PER_S: f64 = 0.01;
/// Minimum mean height of a drop in the world, metres, a quarter of a card: a smaller drop counts
/// as this one. Contacts may push bodies apart at 0.2 m/s, which is 2 mm of height, and that is no
/// explosion.
const MIN_DROP_M: f64 = 0.05;

/// A world in motion.
pub(super) struct FallRun<'a> {
    pub(super) world: PhysicsWorld,
    pub(super) bodies: Vec<RigidBodyHandle>,
    /// Ids of the objects that fall, in the order of `bodies`.
    pub(super) ids: Vec<usize>,
    pub(super) room: Room,
    pub(super) units: WorldUnits,
    pub(super) pace: Pace,
    /// Iterations of the contact solver, in a step of the options.
    pub(super) iterations: u32,
    /// Work of a step, for each body and pair.
    pub(super) work_per_pair: u64,
    pub(super) allowance: &'a Allowance<'a>,
}

/// Times of a fall, seconds in the world.
pub(super) struct Pace {
    /// The step of the options, called a tick; an actual step lasts one or more.
    pub(super) step: f64,
    pub(super) time_limit: f64,
    /// Ticks between samples; 0 for no samples.
    pub(super) sample_every: usize,
}

impl FallRun<'_> {
    /// Steps until everything rests or the time limit is reached.
    pub(super) fn run_to_rest(mut self) -> Result<Fall> {
        let ticks = (self.pace.time_limit / self.pace.step).ceil() as usize;
        let mut record = FallRecord::new(&self);
        let mut tick = 0;
        while tick < ticks {
            // Nothing is active before the first step.
            let length = self.step_world()?;
            tick += length;
            let comes_to_rest = record.add_step(&self, tick, length);
            if self.let_go() {
                record.energy.rebase(&self);
            } else if comes_to_rest {
                record.fall.rests = self.world.quarantine().is_empty();
                break;
            }
        }
        Ok(record.finish(&self))
    }

    /// Makes a step, as long as the moving bodies allow; returns its length in ticks.
    fn step_world(&mut self) -> Result<usize> {
        self.allowance.take(self.step_work())?;
        let stride = Stride::longest(
            self.moving_bodies(),
            CARD_LENGTH_M as f32 / 2.0,
            self.pace.step,
        );
        let seconds = self.pace.step * stride.ticks as f64;
        let iterations = stride.iterations(self.iterations);
        set_step(
            &mut self.world.integration_parameters,
            seconds as f32,
            iterations,
        );
        self.world.step();
        work::add(Kind::PhysicsSteps, 1);
        Ok(stride.ticks)
    }

    /// Removes from the world the bodies that have gone over the rim; returns whether there were
    /// any.
    fn let_go(&mut self) -> bool {
        let gone = self.gone_bodies();
        for body in &gone {
            self.world.bodies[*body].set_enabled(false);
        }
        !gone.is_empty()
    }

    fn gone_bodies(&self) -> Vec<RigidBodyHandle> {
        let bodies = self.bodies.iter().copied();
        bodies.filter(|body| self.has_gone(*body)).collect()
    }

    fn has_gone(&self, body: RigidBodyHandle) -> bool {
        let body = &self.world.bodies[body];
        let pose = self.units.to_scene(body.position());
        body.is_enabled() && self.room.is_gone(&pose.translation.vector)
    }

    fn step_work(&self) -> u64 {
        let contacts = self.world.narrow_phase.contact_graph().raw_graph();
        (self.bodies.len() + contacts.raw_edges().len()) as u64 * self.work_per_pair
    }

    fn is_asleep(&self) -> bool {
        self.world.islands.active_bodies().count() == 0
    }

    /// All dropped bodies that are not gone.
    fn moving_bodies(&self) -> impl Iterator<Item = &RigidBody> {
        let bodies = self.bodies.iter().map(|body| &self.world.bodies[*body]);
        bodies.filter(|body| body.is_enabled())
    }

    /// Poses of everything that was dropped; none for what is gone.
    fn poses(&self) -> impl Iterator<Item = Option<Pose>> {
        let bodies = self.bodies.iter().map(|body| &self.world.bodies[*body]);
        bodies.map(|body| {
            body.is_enabled()
                .then(|| self.units.to_scene(body.position()))
        })
    }

    fn moving_poses(&self) -> impl Iterator<Item = &RapierPose> {
        self.moving_bodies().map(RigidBody::position)
    }

    fn kinetic_energy(&self) -> f64 {
        self.moving_bodies()
            .map(|body| f64::from(body.kinetic_energy()))
            .sum()
    }

    fn trembling_energy(&self) -> f64 {
        self.moving_bodies()
            .map(|body| f64::from(body.mass()) * REST_SPEED_M_PER_S * REST_SPEED_M_PER_S / 2.0)
            .sum()
    }

    fn extend_swept(&self, swept: &mut [[f64; 2]; 2]) {
        for collider in self.moving_bodies().flat_map(|body| body.colliders()) {
            let around = self.world.colliders[*collider].compute_aabb();
            for (extent, ends) in swept.iter_mut().zip(horizontal_extents(&around)) {
                extend(extent, ends.map(|end| f64::from(end) / self.units.length));
            }
        }
    }

    /// Records all poses at the end of a step of some ticks, if a sample is due.
    fn record_samples(&self, fall: &mut Fall, tick: usize, length: usize) {
        let every = self.pace.sample_every;
        if every > 0 && tick % every < length {
            fall.samples.extend(self.samples_at(tick));
        }
    }

    fn samples_at(&self, tick: usize) -> impl Iterator<Item = MotionSample> {
        let seconds = tick as f64 * self.pace.step / self.units.time;
        let bodies = self.ids.iter().zip(&self.bodies);
        bodies
            .map(|(&id, body)| (id, &self.world.bodies[*body]))
            .filter(|(_, body)| body.is_enabled())
            .map(move |(id, body)| self.motion_sample(id, body, seconds))
    }

    fn motion_sample(&self, object: usize, body: &RigidBody, seconds: f64) -> MotionSample {
        let (per_length, per_time) = (1.0 / self.units.length, self.units.time);
        let energy = self.units.energy();
        MotionSample {
            seconds,
            object,
            pose: self.units.to_scene(body.position()),
            speed: f64::from(body.linvel().length()) * per_length * per_time,
            spin: f64::from(body.angvel().length()) * per_time,
            kinetic: f64::from(body.kinetic_energy()) / energy,
            potential: potential_energy(body, &self.world) / energy,
        }
    }
}

/// What is recorded during a fall.
struct FallRecord {
    stillness: Stillness,
    energy: EnergyTrack,
    fall: Fall,
}

impl FallRecord {
    fn new(run: &FallRun) -> Self {
        let mut fall = Fall {
            swept: [[f64::INFINITY, -f64::INFINITY]; 2],
            ..Fall::default()
        };
        run.record_samples(&mut fall, 0, 1);
        Self {
            stillness: Stillness::default(),
            energy: EnergyTrack::new(run),
            fall,
        }
    }

    /// Records the state after a step of some ticks; returns whether everything is at rest.
    fn add_step(&mut self, run: &FallRun, tick: usize, length: usize) -> bool {
        let now = tick as f64 * run.pace.step;
        let kinetic = self.energy.update(run);
        run.extend_swept(&mut self.fall.swept);
        run.record_samples(&mut self.fall, tick, length);
        self.fall.seconds = now / run.units.time;
        run.is_asleep() || (self.stillness.lasts(run, now) && kinetic < run.trembling_energy())
    }

    fn finish(mut self, run: &FallRun) -> Fall {
        self.fall.energy_rise = self.energy.relative_rise();
        self.fall.poses = run.poses().collect();
        self.fall
    }
}

fn extend(extent: &mut [f64; 2], [low, high]: [f64; 2]) {
    extent[0] = extent[0].min(low);
    extent[1] = extent[1].max(high);
}

/// Least and greatest x, and y.
fn horizontal_extents(around: &Aabb) -> [[f32; 2]; 2] {
    [
        [around.mins.x, around.maxs.x],
        [around.mins.y, around.maxs.y],
    ]
}

/// `-m g . x` of the centre of mass, joules in the world.
fn potential_energy(body: &RigidBody, world: &PhysicsWorld) -> f64 {
    let center = body
        .mass_properties()
        .local_mprops
        .world_com(body.position());
    let g = world.gravity;
    -f64::from(body.mass())
        * (product(g.x, center.x) + product(g.y, center.y) + product(g.z, center.z))
}

fn product(a: f32, b: f32) -> f64 {
    f64::from(a) * f64::from(b)
}

/// The energy over a fall, joules in the world.
struct EnergyTrack {
    start: f64,
    last: f64,
    max_rise: f64,
    /// That of [`MIN_DROP_M`].
    min_drop: f64,
}

impl EnergyTrack {
    fn new(run: &FallRun) -> Self {
        let start = potential_of_all(run);
        let weight = run.moving_bodies().count() as f64 * CARD_MASS_KG * GRAVITY_M_PER_S2;
        Self {
            start,
            last: start,
            max_rise: 0.0,
            min_drop: weight * MIN_DROP_M,
        }
    }

    /// Records the energy after a step; returns the kinetic one.
    fn update(&mut self, run: &FallRun) -> f64 {
        let kinetic = run.kinetic_energy();
        let now = kinetic + potential_of_all(run);
        self.max_rise = self.max_rise.max(now - self.last);
        self.last = now;
        kinetic
    }

    /// Continues without the bodies that have just been removed from the world.
    fn rebase(&mut self, run: &FallRun) {
        let now = run.kinetic_energy() + potential_of_all(run);
        self.start += now - self.last;
        self.last = now;
    }

    /// The greatest rise between two steps as a share of the energy released by the drop.
    fn relative_rise(&self) -> f64 {
        self.max_rise / (self.start - self.last).max(self.min_drop)
    }
}

fn potential_of_all(run: &FallRun) -> f64 {
    run.moving_bodies()
        .map(|body| potential_energy(body, &run.world))
        .sum()
}

/// Since when, and at which poses, nothing has moved.
#[derive(Default)]
struct Stillness {
    poses: Vec<RapierPose>,
    since: f64,
}

impl Stillness {
    /// Whether no end of a card has moved by [`REST_MOTION_M`] for [`REST_TIME_S`].
    fn lasts(&mut self, run: &FallRun, now: f64) -> bool {
        let still = self.poses.len() == run.moving_bodies().count() && self.is_near(run);
        if !still {
            self.poses = run.moving_poses().copied().collect();
            self.since = now;
        }
        still && now - self.since >= REST_TIME_S
    }

    fn is_near(&self, run: &FallRun) -> bool {
        let mut poses = run.moving_poses().zip(&self.poses);
        poses.all(|(now, before)| motion_between(now, before) < REST_MOTION_M)
    }
}

/// Maximum motion of an end of a card: that of its middle, plus half a card times the angle (twice
/// the difference of the quaternions).
fn motion_between(a: &RapierPose, b: &RapierPose) -> f32 {
    let turned = rotation_between(a.rotation, b.rotation);
    (a.translation - b.translation).length() + CARD_LENGTH_M as f32 * turned
}

/// Distance of two unit quaternions; one and its negative are the same rotation.
fn rotation_between(a: Rotation, b: Rotation) -> f32 {
    (a - b).length().min((a + b).length())
}
