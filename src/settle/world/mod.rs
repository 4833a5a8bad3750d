//! The physics world. The only folder that uses rapier and glam.
//!
//! # Method
//! Rapier 0.36 with stiff, short-range contacts: its defaults are made for bodies of a metre and
//! let 200 mm cards sink into each other by more than their thickness. The numbers below were tuned
//! on 60 boxes of 200 x 80 x 2-20 mm dropped from up to 8 m. The engine has absolute tolerances, so
//! every scene is first scaled ([`WorldUnits`]): lengths so that the typical card is 200 mm long,
//! masses so that the typical one is 30 g, and time so that gravity is 9.81 m/s^2. The result does
//! not depend on the units of length and mass, or on the strength of gravity.

mod collider;
mod prism;
mod run;
mod stride;
mod units;

use super::overlap::Solid;
use super::room::Room;
use super::trace::MotionSample;
use crate::allowance::Allowance;
use crate::error::Result;
use crate::geom::{Pose, Vector3};
use crate::scene::{Object, Placement, Scene, SettleOptions};
use crate::work::{self, Kind};
use rapier3d::prelude::{
    CoefficientCombineRule, ColliderBuilder, IntegrationParameters, PhysicsWorld, RigidBodyBuilder,
    RigidBodyHandle, SpringCoefficients,
};
use run::{FallRun, Pace};
use units::{WorldUnits, glam_vector};

/// Longer side of the typical card in the world, metres.
const CARD_LENGTH_M: f64 = 0.2;
/// Rapier's unit of length in the world, metres: a quarter of a card.
const LENGTH_UNIT_M: f64 = CARD_LENGTH_M / 4.0;
/// Gravity in the world, m/s^2.
const GRAVITY_M_PER_S2: f64 = 9.81;
/// Mass of the typical card in the world, kilograms.
const CARD_MASS_KG: f64 = 0.03;
/// Maximum ratio of a body's mass to the typical one, and vice versa. The solver copes with heaps
/// with a spread of 10 but lets light bodies sink under ones 100 times heavier; a heap at rest
/// looks the same.
const MASS_SPREAD: f64 = 3.2;
/// Margin around every body within which contacts already push, metres in the world; bodies come to
/// rest up to twice this apart.
const CONTACT_MARGIN_M: f32 = 0.0002;
/// Maximum speed in the world, m/s.
const MAX_SPEED_M_PER_S: f64 = 4.0;
/// Maximum time that a fall may take to land, seconds in the world: 1000 coins of 20 mm, stacked as
/// recipes do, take less.
const MAX_LANDING_S: f64 = 60.0;
/// Minimum share of its starting height that the highest object falls: the heap below it is at most
/// as high as the rest.
const MIN_FALL_SHARE: f64 = 0.5;
/// Number of objects that may lie on each other at the options' step. Those under many others sink
/// in, by the weight above them over the square of the rate of steps and iterations: heaps of 100
/// do at 1/480 s and not at 1/960 s, heaps of 200 not at 1/1920 s.
const OBJECTS_PER_STEP_RATE: usize = 40;
/// Parts that a step may be cut into for a body that would pass through another.
const MAX_SUBSTEPS: u32 = 100;
/// Iterations in a step that count as one of work.
const ITERATIONS_PER_WORK: u32 = 4;
/// Half the thickness of floor and walls, metres in the world.
const WALL_HALF_M: f64 = 0.5;
/// Damping of linear and angular speed: without it one fall in 30 rocks forever. A card that falls
/// flat at 2 m/s loses about as much to the air.
const LINEAR_DAMPING: f32 = 0.5;
const ANGULAR_DAMPING: f32 = 0.5;
/// Speed below which bodies sleep, in units of length per second: 1 cm/s. At the default some
/// bodies creep and never sleep.
const SLEEP_SPEED: f32 = 0.2;
/// Damping ratio of contacts.
const CONTACT_DAMPING_RATIO: f32 = 2.0;
/// Limits on the correction that pushes bodies apart, which must not become speed. Of 150 heaps 19
/// gained more than 1 % of their energy in a step at 10 and one unbiased pass, and none at these;
/// at 2 they overlap ten times as far, by 0.3 mm.
const MAX_CORRECTIVE_SPEED: f32 = 4.0;
const STABILIZATION_ITERATIONS: usize = 2;

/// Objects that fall together, and how they start.
pub(super) struct Drop<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a SettleOptions,
    /// Height of each object's centre at the start, metres; for those that fall.
    pub(super) heights: &'a [f64],
    /// Steps (of the options) between samples of the motion; 0 for no samples.
    pub(super) sample_every: usize,
    /// Number of times that the step is halved, beyond what the number of objects requires.
    pub(super) halvings: u32,
    pub(super) allowance: &'a Allowance<'a>,
}

/// How a fall ended.
#[derive(Clone, Debug, Default)]
pub(super) struct Fall {
    /// Pose of each of the objects that fell, in their order; metres of the scene. None for those
    /// that went over the rim.
    pub(super) poses: Vec<Option<Pose>>,
    /// Whether everything came to rest before the time limit.
    pub(super) rests: bool,
    /// Simulated time, seconds.
    pub(super) seconds: f64,
    /// Largest energy gain between two steps, as a share of the energy released by the drop.
    pub(super) energy_rise: f64,
    /// Least and greatest x and y of the swept space; metres of the scene.
    pub(super) swept: [[f64; 2]; 2],
    /// The motion, sampled as often as requested.
    pub(super) samples: Vec<MotionSample>,
}

/// Number of times that the step must be halved for this number of objects.
fn halvings_for(objects: usize) -> u32 {
    objects
        .div_ceil(OBJECTS_PER_STEP_RATE)
        .max(1)
        .next_power_of_two()
        .ilog2()
}

impl Drop<'_> {
    /// Lets some objects fall until they rest, among all that are already at rest.
    ///
    /// # Errors
    /// [`Allowance::take`].
    pub(super) fn fall(&self, members: &[usize]) -> Result<Fall> {
        work::add(Kind::PhysicsWorlds, 1);
        let units = WorldUnits::new(self.scene, self.options);
        let pace = self.pace(members, &units);
        self.check_work(members, &units, &pace)?;
        self.start(members, units, pace).run_to_rest()
    }

    fn start(&self, members: &[usize], units: WorldUnits, pace: Pace) -> FallRun<'_> {
        let (world, bodies) = self.filled_world(members, &units, pace.step);
        FallRun {
            world,
            bodies,
            ids: members.iter().map(|i| i + 1).collect(),
            room: Room::new(self.scene),
            units,
            pace,
            iterations: self.options.iterations,
            work_per_pair: self.work_per_pair(),
            allowance: self.allowance,
        }
    }

    /// A world with the room, everything stationary, and the falling bodies; also returns the
    /// handles of the latter.
    fn filled_world(
        &self,
        members: &[usize],
        units: &WorldUnits,
        step: f64,
    ) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
        let mut world = self.empty_world(step);
        self.add_room(&mut world, units, members);
        for object in self.standing() {
            self.add_body(&mut world, object, 0.0, units);
        }
        let bodies = members
            .iter()
            .map(|&i| self.add_body(&mut world, &self.scene.objects[i], self.heights[i], units));
        let bodies = bodies.collect();
        (world, bodies)
    }

    fn pace(&self, members: &[usize], units: &WorldUnits) -> Pace {
        let halvings = self.halvings + halvings_for(members.len());
        let landing = self.landing_time(members, units).min(MAX_LANDING_S);
        Pace {
            step: self.options.step / f64::from(1_u32 << halvings),
            time_limit: landing + self.options.time_limit,
            sample_every: self.sample_every << halvings,
        }
    }

    /// Work of a step for each object and pair: iterations, times the number of parts that the
    /// options let a step be cut into at obstacles.
    fn work_per_pair(&self) -> u64 {
        u64::from(self.options.iterations.div_ceil(ITERATIONS_PER_WORK))
            * u64::from(self.options.ccd.clamp(1, MAX_SUBSTEPS))
    }

    /// Rejects at once a fall that would take more work than is left even if it came to rest where
    /// it lands.
    fn check_work(&self, members: &[usize], units: &WorldUnits, pace: &Pace) -> Result<()> {
        let steps = self.fewest_steps(members, units, pace);
        self.allowance
            .check(steps * members.len() as f64 * self.work_per_pair() as f64)
    }

    /// Minimum number of steps of a fall: those until the highest of these objects lands.
    fn fewest_steps(&self, members: &[usize], units: &WorldUnits, pace: &Pace) -> f64 {
        let fall_time = self.landing_time(members, units).min(pace.time_limit);
        fall_time / pace.step * MIN_FALL_SHARE
    }

    /// Time in the world before which the highest of these objects cannot have landed, seconds.
    fn landing_time(&self, members: &[usize], units: &WorldUnits) -> f64 {
        let highest = members.iter().map(|&i| self.heights[i]).fold(0.0, f64::max);
        highest * units.length / MAX_SPEED_M_PER_S
    }

    fn empty_world(&self, step: f64) -> PhysicsWorld {
        let mut world = PhysicsWorld::new();
        let down = Vector3::from(self.options.gravity).normalize();
        world.gravity = glam_vector(&(down * GRAVITY_M_PER_S2));
        self.set_parameters(&mut world.integration_parameters, step as f32);
        world
    }

    fn set_parameters(&self, p: &mut IntegrationParameters, step: f32) {
        p.max_ccd_substeps = self.ccd_substeps();
        p.length_unit = LENGTH_UNIT_M as f32;
        p.normalized_max_corrective_velocity = MAX_CORRECTIVE_SPEED;
        p.num_internal_stabilization_iterations = STABILIZATION_ITERATIONS;
        p.normalized_max_linear_velocity = (MAX_SPEED_M_PER_S / LENGTH_UNIT_M) as f32;
        set_step(p, step, self.options.iterations);
    }

    /// Substeps of continuous collision detection, by which the engine stops bodies at stationary
    /// ones and which takes a quarter of a fall's time. Floor and walls do not need it: of 600
    /// falls into trays whose walls lean by 8 to 75 degrees, 26 attempts were rejected with it, 29
    /// without.
    fn ccd_substeps(&self) -> usize {
        let mut standing = self.standing();
        standing.next().map_or(0, |_| self.options.ccd as usize)
    }

    fn standing(&self) -> impl Iterator<Item = &Object> {
        let objects = self.scene.objects.iter();
        objects.filter(|object| matches!(object.placement, Placement::At(_)))
    }

    fn add_room(&self, world: &mut PhysicsWorld, units: &WorldUnits, members: &[usize]) {
        let room = Room::new(self.scene);
        if room.invisible.is_some() {
            self.add_invisible_room(world, units, members);
        }
        for part in &room.parts {
            self.add_part(world, part, units);
        }
    }

    /// Adds the floor or a built wall.
    fn add_part(&self, world: &mut PhysicsWorld, part: &Solid, units: &WorldUnits) {
        let [hx, hy, hz] = (part.half * units.length)
            .map(|length| length as f32)
            .into();
        let collider = ColliderBuilder::cuboid(hx, hy, hz);
        let placed = collider.position(units.to_world(&part.world_from_body));
        world.insert_collider(self.with_contacts(placed), None);
    }

    /// Adds the floor and four walls, which extend above the highest start. The walls are
    /// frictionless: invisible walls support nothing.
    fn add_invisible_room(&self, world: &mut PhysicsWorld, units: &WorldUnits, members: &[usize]) {
        let surface = &self.scene.surface;
        let half_sides = surface.size.map(|length| length * units.length / 2.0);
        let middle = self.highest_top(members) * units.length / 2.0;
        let [floor, walls @ ..] = room_slabs(half_sides, middle);
        self.add_slab(world, floor, surface.friction);
        for wall in walls {
            self.add_slab(world, wall, 0.0);
        }
    }

    /// Height above all parts of these objects at their start, metres.
    fn highest_top(&self, members: &[usize]) -> f64 {
        members
            .iter()
            .map(|&i| self.heights[i] + self.scene.objects[i].size.iter().sum::<f64>())
            .fold(0.0, f64::max)
    }

    fn add_slab(&self, world: &mut PhysicsWorld, slab: Slab, friction: f64) {
        let [hx, hy, hz] = slab.half.map(|length| length as f32);
        let collider = ColliderBuilder::cuboid(hx, hy, hz);
        let placed = collider.translation(glam_vector(&slab.center.into()));
        let rough = self.with_contacts(placed).friction(friction as f32);
        world.insert_collider(
            rough.friction_combine_rule(CoefficientCombineRule::Min),
            None,
        );
    }

    fn add_body(
        &self,
        world: &mut PhysicsWorld,
        object: &Object,
        height: f64,
        units: &WorldUnits,
    ) -> RigidBodyHandle {
        let body = world.insert_body(rigid_body(object, height, units));
        world.insert_collider(self.collider(object, units), Some(body));
        let activation = world.bodies[body].activation_mut();
        activation.normalized_linear_threshold = SLEEP_SPEED;
        body
    }

    /// The collider of an object, with its mass.
    fn collider(&self, object: &Object, units: &WorldUnits) -> ColliderBuilder {
        self.with_contacts(collider::collider(
            object,
            self.options,
            units.length,
            body_mass(object, units),
        ))
    }

    fn with_contacts(&self, collider: ColliderBuilder) -> ColliderBuilder {
        let surface = &self.scene.surface;
        collider
            .friction(surface.friction as f32)
            .restitution(surface.restitution as f32)
            .contact_skin(CONTACT_MARGIN_M)
    }
}

/// Sets the length of a step and its iterations, and contacts to match: the stiffest that still
/// come to rest have a quarter and a half of the rate of iterations.
fn set_step(p: &mut IntegrationParameters, step: f32, iterations: u32) {
    p.dt = step;
    p.min_ccd_dt = step / MAX_SUBSTEPS as f32;
    p.num_solver_iterations = iterations as usize;
    let rate = iterations as f32 / step;
    soften(&mut p.contact_softness, rate / 4.0);
    soften(&mut p.static_contact_softness, rate / 2.0);
}

fn soften(contacts: &mut SpringCoefficients<f32>, frequency: f32) {
    contacts.natural_frequency = frequency;
    contacts.damping_ratio = CONTACT_DAMPING_RATIO;
}

/// The floor or a wall: centre and half lengths, metres in the world.
struct Slab {
    center: [f64; 3],
    half: [f64; 3],
}

/// The floor, then the walls: `x` and `y` are half sides of the surface, `middle` is half the
/// walls' height.
fn room_slabs([x, y]: [f64; 2], middle: f64) -> [Slab; 5] {
    let wall = WALL_HALF_M;
    let (wide, high) = (x.max(y) + 2.0 * wall, middle + wall);
    [
        ([0.0, 0.0, -wall], [wide, wide, wall]),
        ([x + wall, 0.0, middle], [wall, wide, high]),
        ([-x - wall, 0.0, middle], [wall, wide, high]),
        ([0.0, y + wall, middle], [wide, wall, high]),
        ([0.0, -y - wall, middle], [wide, wall, high]),
    ]
    .map(|(center, half)| Slab { center, half })
}

/// A stationary body, or one that falls from a height, damped.
fn rigid_body(object: &Object, height: f64, units: &WorldUnits) -> RigidBodyBuilder {
    let (body, pose) = start_of(object, height);
    body.pose(units.to_world(&pose))
        .linear_damping(LINEAR_DAMPING)
        .angular_damping(ANGULAR_DAMPING)
}

/// Mass of an object in the world, within [`MASS_SPREAD`] of the typical one.
fn body_mass(object: &Object, units: &WorldUnits) -> f64 {
    (object.mass * units.mass).clamp(CARD_MASS_KG / MASS_SPREAD, CARD_MASS_KG * MASS_SPREAD)
}

/// A stationary or falling body, and its pose at the start.
///
/// # Panics
/// If it is gone.
fn start_of(object: &Object, height: f64) -> (RigidBodyBuilder, Pose) {
    match object.placement {
        Placement::Gone => unreachable!("what is gone is not in the world"),
        Placement::At(pose) => (RigidBodyBuilder::fixed(), pose),
        Placement::Drop {
            above: [x, y],
            rotation,
            ..
        } => (
            RigidBodyBuilder::dynamic(),
            Pose::from_parts([x, y, height].into(), rotation),
        ),
    }
}
