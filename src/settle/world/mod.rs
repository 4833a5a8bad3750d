//! The physics world. The only folder that knows rapier and glam.
//!
//! # Method
//! Rapier 0.36 with stiff, short contacts: its defaults are made for bodies of a metre and sink 200 mm cards into each
//! other by more than their thickness. The numbers below were tried on 60 boxes of 200 x 80 x 2-20 mm dropped from up to
//! 8 m. The engine has absolute tolerances, so every scene is first brought to that scale ([`Units`]): lengths so that
//! the typical card is 200 mm long, masses so that the typical one is 30 g, and time so that gravity is 9.81 m/s^2. The
//! result does not depend on the unit of length, of mass, or on the strength of gravity.

mod prism;
mod run;
mod units;

use super::is_dropped;
use super::trace::MotionSample;
use crate::allowance::Allowance;
use crate::error::Result;
use crate::geom::{Pose, Vector3};
use crate::scene::{Object, Placement, Scene, SettleOptions};
use crate::work::{self, Kind};
use rapier3d::prelude::{
    CoefficientCombineRule, ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};
use run::Pace;
use units::{Units, vector};

/// Longer side of the typical card in the world, metres.
const CARD: f64 = 0.2;
/// Gravity in the world, m/s^2.
const GRAVITY: f64 = 9.81;
/// Mass of the typical card in the world, kilograms.
const MASS: f64 = 0.03;
/// Lightest and heaviest body relative to the typical one. The solver holds heaps with a spread of 10 and sinks light
/// bodies under ones 100 times heavier; a heap at rest looks the same.
const MASS_SPREAD: f64 = 3.2;
/// Margin around every body in which contacts already push, metres in the world; bodies rest up to twice this apart.
const SKIN: f32 = 0.0002;
/// Nothing falls faster in the world, m/s.
const FASTEST: f64 = 4.0;
/// Share of its start's height that the highest object falls at least: what lies under it is no heap of that height.
const LANDING: f64 = 0.5;
/// Objects that may lie on each other at the step of the options. What lies under many sinks in, by their weight over the
/// square of the rate of steps and iterations: heaps of 100 do at 1/480 s and not at 1/960 s, heaps of 200 not at 1/1920 s.
const FEW: usize = 60;
/// Parts that a step may be cut into at what would be flown through.
const MOST_CUTS: u32 = 100;
/// Iterations in a step that count as one of work.
const USUAL_ITERATIONS: u32 = 4;
/// Half the thickness of floor and walls, metres in the world.
const WALL: f64 = 0.5;

/// What falls together, and how it starts.
pub(super) struct Drop<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a SettleOptions,
    /// Height of each object's centre at the start, metres; where it falls.
    pub(super) heights: &'a [f64],
    /// Steps between samples of the motion, at the step of the options; none where it is 0.
    pub(super) sample_every: usize,
    /// Times that the step is halved, beyond what the number of objects asks for.
    pub(super) finer: u32,
    pub(super) allowance: &'a Allowance<'a>,
}

/// How a fall ended.
#[derive(Clone, Debug, Default)]
pub(super) struct Fall {
    /// Pose of each of the objects that fell, in their order; metres of the scene.
    pub(super) poses: Vec<Pose>,
    /// Whether everything came to rest before the time limit.
    pub(super) rests: bool,
    /// Simulated time, seconds.
    pub(super) seconds: f64,
    /// Most energy that appeared between two steps, as a share of what the drop gave away.
    pub(super) energy_rise: f64,
    /// Least and greatest x and y of the room that was passed through; metres of the scene.
    pub(super) swept: [[f64; 2]; 2],
    /// The motion, as often as was asked for.
    pub(super) samples: Vec<MotionSample>,
}

/// Median of the longer sides of the cards that fall, metres.
///
/// # Panics
/// When nothing falls.
pub(crate) fn typical_length(scene: &Scene) -> f64 {
    median(scene, |object| object.size[0].max(object.size[1]))
}

fn median(scene: &Scene, of: impl Fn(&Object) -> f64) -> f64 {
    let mut all: Vec<f64> = scene
        .objects
        .iter()
        .filter(|object| is_dropped(object))
        .map(of)
        .collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Times that the step must be halved for so many objects.
fn halvings(objects: usize) -> u32 {
    objects.div_ceil(FEW).max(1).next_power_of_two().ilog2()
}

impl Drop<'_> {
    /// Lets some objects fall until they rest, among all that lies there already.
    ///
    /// # Errors
    /// [`Allowance::take`].
    pub(super) fn fall(&self, members: &[usize]) -> Result<Fall> {
        work::add(Kind::PhysicsWorlds, 1);
        let units = Units::of(self.scene, self.options);
        let halvings = self.finer + halvings(members.len());
        let pace = Pace {
            step: self.options.step / f64::from(1_u32 << halvings),
            time_limit: self.options.time_limit,
            sample_every: self.sample_every << halvings,
        };
        self.check_pace(members, &units, &pace)?;
        let mut world = self.empty_world(pace.step);
        self.enclose(&mut world, &units, members);
        for object in self
            .scene
            .objects
            .iter()
            .filter(|object| !is_dropped(object))
        {
            self.add(&mut world, object, 0.0, &units);
        }
        let add =
            |&i: &usize| self.add(&mut world, &self.scene.objects[i], self.heights[i], &units);
        let bodies: Vec<RigidBodyHandle> = members.iter().map(add).collect();
        let ids: Vec<usize> = members.iter().map(|i| i + 1).collect();
        run::Run {
            world,
            bodies,
            ids,
            units,
            pace,
            effort: self.effort(),
            allowance: self.allowance,
        }
        .until_rest()
    }

    /// Work of a step for each object and pair: iterations, as often as a step may be cut at what is in the way.
    fn effort(&self) -> u64 {
        u64::from(self.options.iterations.div_ceil(USUAL_ITERATIONS))
            * u64::from(self.options.ccd.clamp(1, MOST_CUTS))
    }

    /// Refuses at once what would take more work than is left even if it rested where it lands.
    fn check_pace(&self, members: &[usize], units: &Units, pace: &Pace) -> Result<()> {
        let highest = members.iter().map(|&i| self.heights[i]).fold(0.0, f64::max) * units.length;
        let steps = (highest / FASTEST).min(pace.time_limit) / pace.step * LANDING;
        self.allowance
            .check(steps * members.len() as f64 * self.effort() as f64)
    }

    fn empty_world(&self, step: f64) -> PhysicsWorld {
        let mut world = PhysicsWorld::new();
        let down = Vector3::from(self.options.gravity).normalize();
        world.gravity = vector(&(down * GRAVITY));
        let p = &mut world.integration_parameters;
        p.dt = step as f32;
        p.min_ccd_dt = p.dt / MOST_CUTS as f32;
        p.max_ccd_substeps = self.options.ccd as usize;
        p.num_solver_iterations = self.options.iterations as usize;
        // About a quarter of a card: lengths and speeds below are in this unit.
        p.length_unit = (CARD / 4.0) as f32;
        // The stiffest contacts that still come to rest: a quarter and a half of the rate of solver iterations.
        let rate = self.options.iterations as f32 / p.dt;
        p.contact_softness.natural_frequency = rate / 4.0;
        p.contact_softness.damping_ratio = 2.0;
        p.static_contact_softness.natural_frequency = rate / 2.0;
        p.static_contact_softness.damping_ratio = 2.0;
        // What pushes bodies apart must not become speed. Of 150 heaps 19 gained more than 1 % of their energy in a step at
        // 10 and one unbiased pass, and none at these; at 2 they overlap ten times as far, by 0.3 mm.
        p.normalized_max_corrective_velocity = 4.0;
        p.num_internal_stabilization_iterations = 2;
        p.normalized_max_linear_velocity = (FASTEST / (CARD / 4.0)) as f32;
        world
    }

    /// Floor and four walls, which reach above the highest start. The walls are smooth: what nobody sees holds nothing up.
    fn enclose(&self, world: &mut PhysicsWorld, units: &Units, members: &[usize]) {
        let [x, y] = self
            .scene
            .surface
            .size
            .map(|length| length * units.length / 2.0);
        let top = |&i: &usize| self.heights[i] + self.scene.objects[i].size.iter().sum::<f64>();
        let middle = members.iter().map(top).fold(0.0, f64::max) * units.length / 2.0;
        let (wide, high) = (x.max(y) + 2.0 * WALL, middle + WALL);
        let slabs = [
            ([0.0, 0.0, -WALL], [wide, wide, WALL]),
            ([x + WALL, 0.0, middle], [WALL, wide, high]),
            ([-x - WALL, 0.0, middle], [WALL, wide, high]),
            ([0.0, y + WALL, middle], [wide, WALL, high]),
            ([0.0, -y - WALL, middle], [wide, WALL, high]),
        ];
        for (center, half) in slabs {
            let [hx, hy, hz] = half.map(|length| length as f32);
            let slab = ColliderBuilder::cuboid(hx, hy, hz).translation(vector(&center.into()));
            let friction = if center[2] < 0.0 {
                self.scene.surface.friction
            } else {
                0.0
            };
            let slab = self.touching(slab).friction(friction as f32);
            world.insert_collider(
                slab.friction_combine_rule(CoefficientCombineRule::Min),
                None,
            );
        }
    }

    fn add(
        &self,
        world: &mut PhysicsWorld,
        object: &Object,
        height: f64,
        units: &Units,
    ) -> RigidBodyHandle {
        let (body, pose) = match object.placement {
            Placement::At(pose) => (RigidBodyBuilder::fixed(), pose),
            Placement::Drop {
                above: [x, y],
                rotation,
                ..
            } => (
                RigidBodyBuilder::dynamic(),
                Pose::from_parts([x, y, height].into(), rotation),
            ),
        };
        // Damping: without it one fall in 30 rocks for ever.
        let body = body
            .pose(units.to_world(&pose))
            .linear_damping(0.1)
            .angular_damping(0.5);
        let body = world.insert_body(body);
        let mass = (object.mass * units.mass).clamp(MASS / MASS_SPREAD, MASS * MASS_SPREAD);
        let half = self.options.half_body(object) * units.length;
        for part in prism::colliders(object, &half, units.length, mass) {
            world.insert_collider(self.touching(part), Some(body));
        }
        // Asleep below 1 cm/s: at the default some bodies creep and never sleep.
        world.bodies[body]
            .activation_mut()
            .normalized_linear_threshold = 0.2;
        body
    }

    fn touching(&self, collider: ColliderBuilder) -> ColliderBuilder {
        let surface = &self.scene.surface;
        collider
            .friction(surface.friction as f32)
            .restitution(surface.restitution as f32)
            .contact_skin(SKIN)
    }
}
