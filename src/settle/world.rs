//! The physics world. The only file that knows rapier and glam.
//!
//! # Method
//! Rapier 0.36 with stiff, short contacts: its defaults are made for bodies of a metre and sink 200 mm cards into each
//! other by more than their thickness. The numbers below were tried on 60 boxes of 200 x 80 x 2-20 mm dropped from up to
//! 8 m. The engine has absolute tolerances, so every scene is first brought to that scale: lengths so that the typical
//! card is 200 mm long, masses so that the typical one is 30 g, and time so that gravity is 9.81 m/s^2. The result does
//! not depend on the unit of length, of mass, or on gravity.

use crate::geom::{Pose, UnitQuaternion, Vector3};
use crate::scene::{Object, Placement, Scene, SettleOptions};
use nalgebra::Quaternion;
use rapier3d::prelude::{
    ColliderBuilder, PhysicsWorld, Pose as RapierPose, RigidBodyBuilder, RigidBodyHandle, Rotation, Vector,
};

/// Longer side of the typical card in the world, metres.
const CARD: f64 = 0.2;
/// Mass of the typical card in the world, kilograms.
const MASS: f64 = 0.03;
/// Lightest and heaviest body relative to the typical one. The solver holds heaps with a spread of 10 and sinks light
/// bodies under ones 100 times heavier; a heap at rest looks the same.
const MASS_SPREAD: f64 = 3.2;
/// Margin around every body in which contacts already push, metres in the world; bodies rest up to twice this apart.
const SKIN: f32 = 0.0002;
/// Movement of a card that still counts as rest, metres in the world.
const TREMBLE: f32 = 0.0002;
/// How long it must last, seconds in the world.
const STILL: f64 = 0.5;
/// Half the thickness of floor and walls, metres in the world.
const WALL: f64 = 0.5;

/// How a fall ended.
pub(super) struct End {
    /// Pose of every object of the scene, in order; metres of the scene.
    pub(super) poses: Vec<Pose>,
    /// Whether everything came to rest before the time limit.
    pub(super) asleep: bool,
    /// Simulated time.
    pub(super) seconds: f64,
}

/// Median of the longer sides of the cards that fall, metres.
///
/// # Panics
/// When nothing falls.
pub(super) fn typical_length(scene: &Scene) -> f64 {
    median(scene, |object| object.size[0].max(object.size[1]))
}

fn median(scene: &Scene, of: impl Fn(&Object) -> f64) -> f64 {
    let falls = |object: &&Object| matches!(object.placement, Placement::Drop { .. });
    let mut all: Vec<f64> = scene.objects.iter().filter(falls).map(of).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Lets everything fall from `raise` times its height until it sleeps.
pub(super) fn fall(scene: &Scene, options: &SettleOptions, raise: f64) -> End {
    let units = Units { length: CARD / typical_length(scene), mass: MASS / median(scene, |object| object.mass) };
    let mut world = empty_world(options);
    enclose(&mut world, scene, &units, raise, options);
    let bodies: Vec<RigidBodyHandle> =
        scene.objects.iter().map(|object| add(&mut world, object, &units, raise, options)).collect();
    let (asleep, seconds) = run(&mut world, options);
    let pose = |(object, body): (&Object, &RigidBodyHandle)| match object.placement {
        Placement::Drop { .. } => units.to_scene(world.bodies[*body].position()),
        Placement::At(pose) => pose,
    };
    End { poses: scene.objects.iter().zip(&bodies).map(pose).collect(), asleep, seconds }
}

fn empty_world(options: &SettleOptions) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::new(0.0, 0.0, -9.81);
    let p = &mut world.integration_parameters;
    p.dt = options.step as f32;
    p.min_ccd_dt = p.dt / 100.0;
    p.num_solver_iterations = options.iterations as usize;
    // About a quarter of a card: lengths and speeds below are in this unit.
    p.length_unit = (CARD / 4.0) as f32;
    // The stiffest contacts that still come to rest: a quarter and a half of the rate of solver iterations.
    let rate = options.iterations as f32 / p.dt;
    p.contact_softness.natural_frequency = rate / 4.0;
    p.contact_softness.damping_ratio = 2.0;
    p.static_contact_softness.natural_frequency = rate / 2.0;
    p.static_contact_softness.damping_ratio = 2.0;
    p.normalized_max_corrective_velocity = 10.0;
    p.normalized_max_linear_velocity = 80.0;
    world
}

/// Floor and four walls, which reach above the highest start.
fn enclose(world: &mut PhysicsWorld, scene: &Scene, units: &Units, raise: f64, options: &SettleOptions) {
    let [x, y] = scene.surface.size.map(|length| length * units.length / 2.0);
    let tops = scene.objects.iter().map(|object| top(object, raise));
    let middle = tops.fold(0.0, f64::max) * units.length / 2.0;
    let (wide, high) = (x.max(y) + 2.0 * WALL, middle + WALL);
    let slabs = [
        ([0.0, 0.0, -WALL], [wide, wide, WALL]),
        ([x + WALL, 0.0, middle], [WALL, wide, high]),
        ([-x - WALL, 0.0, middle], [WALL, wide, high]),
        ([0.0, y + WALL, middle], [wide, WALL, high]),
        ([0.0, -y - WALL, middle], [wide, WALL, high]),
    ];
    for (center, half) in slabs {
        let slab = solid(half.into(), options).translation(vector(&center.into()));
        world.insert_collider(slab, None);
    }
}

/// A height above all of a falling object, metres of the scene.
fn top(object: &Object, raise: f64) -> f64 {
    match object.placement {
        Placement::Drop { height, .. } => height * raise + object.size[0] + object.size[1],
        Placement::At(_) => 0.0,
    }
}

fn add(
    world: &mut PhysicsWorld,
    object: &Object,
    units: &Units,
    raise: f64,
    options: &SettleOptions,
) -> RigidBodyHandle {
    let shape = solid(options.half_body(object) * units.length, options);
    let (body, pose) = match object.placement {
        Placement::At(pose) => (RigidBodyBuilder::fixed(), pose),
        Placement::Drop { above: [x, y], height, rotation } => {
            (RigidBodyBuilder::dynamic(), Pose::from_parts([x, y, height * raise].into(), rotation))
        }
    };
    let mass = (object.mass * units.mass).clamp(MASS / MASS_SPREAD, MASS * MASS_SPREAD);
    // Damping: without it one fall in 30 rocks for ever.
    let body = body.pose(units.to_world(&pose)).linear_damping(0.1).angular_damping(0.5);
    let (body, _) = world.insert(body, shape.mass(mass as f32));
    // Asleep below 1 cm/s: at the default some bodies creep and never sleep.
    world.bodies[body].activation_mut().normalized_linear_threshold = 0.2;
    body
}

fn solid(half: Vector3<f64>, options: &SettleOptions) -> ColliderBuilder {
    ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32)
        .friction(options.friction as f32)
        .restitution(options.restitution as f32)
        .contact_skin(SKIN)
}

/// Steps until everything rests; whether that was before the limit, and the time it took.
///
/// At rest is what the engine has put to sleep, and what only trembles: a thin card between others may vibrate for ever
/// by hundredths of a millimetre, driven by the contact solver. (Damping does not stop it.)
fn run(world: &mut PhysicsWorld, options: &SettleOptions) -> (bool, f64) {
    let steps = (options.time_limit / options.step).ceil() as u64;
    let mut stillness = Stillness::default();
    for step in 1..=steps {
        let now = step as f64 * options.step;
        // Nothing is active before the first step.
        world.step();
        if world.islands.active_bodies().count() == 0 || stillness.lasts(world, now) {
            return (world.quarantine().is_empty(), now);
        }
    }
    (false, steps as f64 * options.step)
}

/// Since when, and where, nothing has moved.
#[derive(Default)]
struct Stillness {
    poses: Vec<RapierPose>,
    since: f64,
}

impl Stillness {
    /// Whether no end of a card has moved by [`TREMBLE`] for the time of [`STILL`].
    fn lasts(&mut self, world: &PhysicsWorld, now: f64) -> bool {
        let poses = || world.rigid_bodies().map(|(_, body)| *body.position());
        let known = self.poses.len() == world.bodies.len();
        let still = known && poses().zip(&self.poses).all(|(a, b)| moved(&a, b) < TREMBLE);
        if !still {
            (self.poses, self.since) = (poses().collect(), now);
        }
        still && now - self.since >= STILL
    }
}

/// How far the end of a card has moved, at most: its middle, and half a card times the angle (twice the difference of
/// the quaternions).
fn moved(a: &RapierPose, b: &RapierPose) -> f32 {
    let turned = (a.rotation - b.rotation).length().min((a.rotation + b.rotation).length());
    (a.translation - b.translation).length() + CARD as f32 * turned
}

/// From the scene's units to those of the world.
struct Units {
    length: f64,
    mass: f64,
}

impl Units {
    fn to_world(&self, pose: &Pose) -> RapierPose {
        let q = pose.rotation;
        let rotation = Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32);
        RapierPose::from_parts(vector(&(pose.translation.vector * self.length)), rotation.normalize())
    }

    fn to_scene(&self, pose: &RapierPose) -> Pose {
        let (t, q) = (pose.translation, pose.rotation);
        let translation = Vector3::new(f64::from(t.x), f64::from(t.y), f64::from(t.z)) / self.length;
        let rotation = Quaternion::new(f64::from(q.w), f64::from(q.x), f64::from(q.y), f64::from(q.z));
        Pose::from_parts(translation.into(), UnitQuaternion::from_quaternion(rotation))
    }
}

fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}
