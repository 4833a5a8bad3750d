//! Whether everything is supported, down to the floor.
//!
//! A body is at rest if forces can hold it: pushes at the contacts, with friction, that balance the
//! weight and the moments of every body. Walls are frictionless, so they may prop up a card whose
//! lower edge stands on something, but cannot hold a card in the air: only a chain of contacts down
//! to the floor bears a weight, and only with the centre of mass above it.
//!
//! # Method
//! Each contact becomes stiff springs that only push: along the edges of its friction cone, a
//! pyramid. Each body also hangs on a spring of its own that is softer by [`CONTACT_STIFFNESS`].
//! Bodies that the contacts can hold hardly move; others are left to the soft spring and move by up
//! to their weight over its stiffness, expressed as a share that is 1 for a body in free fall. The
//! energy of such springs is convex and piecewise quadratic: Newton's method finds its minimum in a
//! few steps.

use super::bodies::{touch_distance, typical_length};
use super::contact::{Contact, contacts, perpendicular_axes};
use super::envelope::EnvelopeMatrix;
use super::overlap::{Solid, Touch, falling_from_lowest};
use super::room::Room;
use crate::geom::{Vector3, sides};
use crate::scene::{Scene, SettleOptions};

/// Factor on friction: the test is for bodies that would fall, not for those that would creep.
const FRICTION_FACTOR: f64 = 2.0;
/// Share of its weight above which a body that no contact supports counts as hanging. A card
/// reaches it with its centre of mass a thirtieth of its length beyond its support; of 1,994 heaps
/// at rest one had more, 1,985 none to four digits.
const UNSUPPORTED_SHARE: f64 = 0.1;
/// Stiffness of a contact over that of a body's own spring.
const CONTACT_STIFFNESS: f64 = 1e6;
/// Maximum number of steps of Newton's method.
const MAX_NEWTON_STEPS: usize = 40;
/// Maximum number of times that a step of Newton's method is halved.
const MAX_HALVINGS: usize = 30;
/// Share of the energy that a step must gain for another one to follow.
const MIN_ENERGY_GAIN: f64 = 1e-6;
/// Radius of gyration that scales rotations, as a share of the typical card's longer side: that of
/// a rod.
const GYRATION_RATIO: f64 = 0.3;

/// Ids (index + 1) of the dropped bodies that nothing holds in place; `touching` are the pairs of
/// bodies nearer than [`touch_distance`].
pub(super) fn unsupported(
    scene: &Scene,
    options: &SettleOptions,
    solids: &[Solid],
    touching: &[Touch],
) -> Vec<usize> {
    let invisible = Room::new(scene).invisible;
    let contacts = contacts(solids, touching, invisible, touch_distance(scene));
    let model = SpringModel::new(scene, options, solids, &contacts);
    let mut ids = model.hanging_ids();
    ids.sort_unstable();
    ids
}

/// Degrees of freedom of a body: along three axes and about them.
const DOF_COUNT: usize = 6;

/// A generalised force: along three axes and about them.
type Wrench = [f64; DOF_COUNT];

/// A push of one body on another, or on something stationary.
struct Spring {
    ends: [Option<SpringEnd>; 2],
}

/// The end at which a spring pushes.
struct SpringEnd {
    /// Index of the body in the model's order.
    slot: usize,
    wrench: Wrench,
}

/// Bodies on springs; lengths in units of the typical card, masses of the mean one, forces of its
/// weight.
struct SpringModel {
    /// Index of each dropped body, from the lowest to the highest, so that touching bodies are
    /// close together.
    order: Vec<usize>,
    masses: Vec<f64>,
    weights: Vec<f64>,
    springs: Vec<Spring>,
}

impl SpringModel {
    fn new(scene: &Scene, options: &SettleOptions, solids: &[Solid], contacts: &[Contact]) -> Self {
        let order = falling_from_lowest(solids);
        let masses = relative_masses(scene, &order);
        let geometry = SpringGeometry::new(solids, &order, typical_length(scene));
        Self {
            springs: geometry.springs(contacts, FRICTION_FACTOR * scene.surface.friction),
            weights: weights_along(options.gravity, &masses),
            masses,
            order,
        }
    }

    /// Ids of the bodies that move by more than [`UNSUPPORTED_SHARE`].
    fn hanging_ids(&self) -> Vec<usize> {
        let moved = self.displacement_at_rest();
        let bodies = self.order.iter().zip(moved.chunks(DOF_COUNT));
        bodies
            .filter(|(_, y)| norm(y) > UNSUPPORTED_SHARE)
            .map(|(i, _)| i + 1)
            .collect()
    }

    /// How far each body moves, in each degree of freedom.
    fn displacement_at_rest(&self) -> Vec<f64> {
        let (mut y, mut energy) = self.start();
        for _ in 0..MAX_NEWTON_STEPS {
            let Some((better, less)) = self.newton_step(&y, energy) else {
                break;
            };
            let gain = energy - less;
            (y, energy) = (better, less);
            if gain <= MIN_ENERGY_GAIN * energy.abs() {
                break;
            }
        }
        y
    }

    /// A step towards the minimum for the springs that are pressed at `y`; none if it gains
    /// nothing.
    fn newton_step(&self, y: &[f64], energy: f64) -> Option<(Vec<f64>, f64)> {
        let springs = self.springs.iter();
        let pressed: Vec<bool> = springs.map(|spring| spring.stretch(y) < 0.0).collect();
        self.line_search(y, &self.quadratic_minimum(&pressed), energy)
    }

    /// The minimum with all springs pressed, or no displacement if that has less energy.
    fn start(&self) -> (Vec<f64>, f64) {
        let y = self.quadratic_minimum(&vec![true; self.springs.len()]);
        let energy = self.energy(&y);
        if energy > 0.0 {
            (vec![0.0; y.len()], 0.0)
        } else {
            (y, energy)
        }
    }

    /// The minimum if exactly these springs were active, both pushing and pulling.
    fn quadratic_minimum(&self, pressed: &[bool]) -> Vec<f64> {
        let mut matrix = self.own_stiffness();
        for (spring, pressed) in self.springs.iter().zip(pressed) {
            if *pressed {
                spring.add_stiffness(&mut matrix);
            }
        }
        matrix.solve(self.weights.clone())
    }

    /// The stiffness of the bodies' own springs, with room for that of the contacts.
    fn own_stiffness(&self) -> EnvelopeMatrix {
        // The row of a body begins with the lowest one that it touches.
        let slots = self.lowest_coupled().into_iter();
        let first = slots.flat_map(|slot| [DOF_COUNT * slot; DOF_COUNT]);
        let mut matrix = EnvelopeMatrix::zeros(first.collect());
        for (i, mass) in self.masses.iter().enumerate() {
            matrix.add(i, i, *mass);
        }
        matrix
    }

    /// For each body the slot of the lowest one that it touches, or its own.
    fn lowest_coupled(&self) -> Vec<usize> {
        let mut lowest: Vec<usize> = (0..self.order.len()).collect();
        for [a, b] in self.springs.iter().filter_map(Spring::coupled_slots) {
            let (low, high) = (a.min(b), a.max(b));
            lowest[high] = lowest[high].min(low);
        }
        lowest
    }

    fn energy(&self, y: &[f64]) -> f64 {
        self.own_energy(y) + self.contact_energy(y)
    }

    fn contact_energy(&self, y: &[f64]) -> f64 {
        let compressions = self.springs.iter().map(|spring| spring.compression(y));
        0.5 * CONTACT_STIFFNESS * compressions.map(|c| c.powi(2)).sum::<f64>()
    }

    /// Energy of the bodies' own springs, less what their weights release.
    fn own_energy(&self, y: &[f64]) -> f64 {
        let loads = self.masses.iter().zip(&self.weights);
        loads.zip(y).map(|((m, w), y)| (0.5 * m * y - w) * y).sum()
    }

    /// The first point with less energy along the way, halving the step; none if there is none.
    fn line_search(&self, from: &[f64], to: &[f64], energy: f64) -> Option<(Vec<f64>, f64)> {
        let shares = std::iter::successors(Some(1.0), |share| Some(share / 2.0));
        shares.take(MAX_HALVINGS).find_map(|share| {
            let y = interpolate(from, to, share);
            let less = self.energy(&y);
            (less < energy).then_some((y, less))
        })
    }
}

fn interpolate(from: &[f64], to: &[f64], share: f64) -> Vec<f64> {
    let pairs = from.iter().zip(to);
    pairs.map(|(a, b)| a + share * (b - a)).collect()
}

/// Mass of each body over their mean, for each degree of freedom.
fn relative_masses(scene: &Scene, order: &[usize]) -> Vec<f64> {
    let total: f64 = order.iter().map(|&i| scene.objects[i].mass).sum();
    let mean = total / order.len().max(1) as f64;
    order
        .iter()
        .flat_map(|&i| [scene.objects[i].mass / mean; DOF_COUNT])
        .collect()
}

/// The weight in each degree of freedom.
fn weights_along(gravity: [f64; 3], masses: &[f64]) -> Vec<f64> {
    let down = Vector3::from(gravity).normalize();
    masses
        .chunks(DOF_COUNT)
        .flat_map(|m| [m[0] * down.x, m[0] * down.y, m[0] * down.z, 0.0, 0.0, 0.0])
        .collect()
}

/// What is needed to turn contacts into springs.
struct SpringGeometry {
    /// Index of each body in the model's order; none for stationary ones.
    slots: Vec<Option<usize>>,
    centers_of_mass: Vec<Vector3<f64>>,
    /// Length that moments are divided by, metres.
    gyration: f64,
}

impl SpringGeometry {
    fn new(solids: &[Solid], order: &[usize], typical_length: f64) -> Self {
        let mut slots = vec![None; solids.len()];
        for (slot, &i) in order.iter().enumerate() {
            slots[i] = Some(slot);
        }
        Self {
            slots,
            centers_of_mass: solids.iter().map(center_of_mass).collect(),
            gyration: GYRATION_RATIO * typical_length,
        }
    }

    /// The springs of all contacts.
    fn springs(&self, contacts: &[Contact], friction: f64) -> Vec<Spring> {
        contacts
            .iter()
            .flat_map(|contact| {
                friction_pyramid(contact, friction)
                    .into_iter()
                    .map(|force| self.spring(contact, force))
            })
            .collect()
    }

    fn spring(&self, contact: &Contact, force: Vector3<f64>) -> Spring {
        let pushed = self.spring_end(contact.body, &contact.point, &force);
        let pushing = contact
            .by
            .and_then(|body| self.spring_end(body, &contact.point, &-force));
        Spring {
            ends: [pushed, pushing],
        }
    }

    fn spring_end(
        &self,
        body: usize,
        point: &Vector3<f64>,
        force: &Vector3<f64>,
    ) -> Option<SpringEnd> {
        let slot = self.slots[body]?;
        let moment = (point - self.centers_of_mass[body]).cross(force) / self.gyration;
        let wrench = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
        Some(SpringEnd { slot, wrench })
    }
}

impl Spring {
    /// How far its ends move apart.
    fn stretch(&self, y: &[f64]) -> f64 {
        self.ends.iter().flatten().map(|end| end.advance(y)).sum()
    }

    /// How far its ends move together.
    fn compression(&self, y: &[f64]) -> f64 {
        self.stretch(y).min(0.0)
    }

    /// The slots of its two bodies, if both were dropped.
    fn coupled_slots(&self) -> Option<[usize; 2]> {
        let [a, b] = &self.ends;
        Some([a.as_ref()?.slot, b.as_ref()?.slot])
    }

    fn add_stiffness(&self, matrix: &mut EnvelopeMatrix) {
        for row in self.ends.iter().flatten() {
            for column in self.ends.iter().flatten() {
                if column.slot <= row.slot {
                    row.couple(column, matrix);
                }
            }
        }
    }
}

impl SpringEnd {
    /// How far its body moves along its push.
    fn advance(&self, y: &[f64]) -> f64 {
        let own = &y[DOF_COUNT * self.slot..];
        own.iter().zip(&self.wrench).map(|(y, push)| y * push).sum()
    }

    /// Adds the block of the matrix in the rows of this end and the columns of another, up to the
    /// diagonal.
    fn couple(&self, other: &Self, matrix: &mut EnvelopeMatrix) {
        let (row, column) = (DOF_COUNT * self.slot, DOF_COUNT * other.slot);
        for (i, a) in self.wrench.iter().enumerate() {
            let pushes = other.wrench[..self.row_end(i, other)].iter();
            for (j, b) in pushes.enumerate() {
                matrix.add(row + i, column + j, CONTACT_STIFFNESS * a * b);
            }
        }
    }

    /// Entries of a row of that block up to the diagonal of the matrix.
    fn row_end(&self, i: usize, other: &Self) -> usize {
        if self.slot == other.slot {
            i + 1
        } else {
            DOF_COUNT
        }
    }
}

fn norm(y: &[f64]) -> f64 {
    y.iter().map(|y| y * y).sum::<f64>().sqrt()
}

/// Directions of the edges of a contact's friction cone, with a normal component of 1 each.
fn friction_pyramid(contact: &Contact, friction: f64) -> Vec<Vector3<f64>> {
    if !contact.rough || friction == 0.0 {
        return vec![contact.normal];
    }
    let (u, v) = perpendicular_axes(&contact.normal);
    [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]]
        .map(|[a, b]| contact.normal + (u * a + v * b) * friction)
        .into()
}

fn center_of_mass(solid: &Solid) -> Vector3<f64> {
    let [x, y, _] = solid.axes();
    let [a, b] = centroid(&solid.outline);
    solid.center() + x * a + y * b
}

/// Centre of mass of a flat convex ring.
fn centroid(ring: &[[f64; 2]]) -> [f64; 2] {
    let [area, x, y] = ring_moments(ring);
    if area > 0.0 {
        [x, y].map(|moment| moment / (3.0 * area))
    } else {
        [0.0; 2]
    }
}

/// Twice the area of a ring, and six times its first moments.
fn ring_moments(ring: &[[f64; 2]]) -> [f64; 3] {
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    for [a, b] in sides(ring) {
        let cross = a[0] * b[1] - a[1] * b[0];
        area += cross;
        x += cross * (a[0] + b[0]);
        y += cross * (a[1] + b[1]);
    }
    [area, x, y]
}

#[cfg(test)]
mod tests {
    use crate::geom::{Pose, UnitQuaternion, Vector3};
    use crate::scene::{Placement, SettleMode, SettleOptions};
    use crate::settle::hanging;
    use crate::settle::tests::{dropped, falling};
    use std::f64::consts::FRAC_PI_4;

    /// Ids of hanging cards among cards of 200 x 80 x 5 mm in a tray of 0.6 x 0.4 m, given by their
    /// centres and tilts about x.
    fn hang(cards: &[([f64; 3], f64)]) -> Vec<usize> {
        hang_in([0.6, 0.4], cards)
    }

    fn hang_in(surface: [f64; 2], cards: &[([f64; 3], f64)]) -> Vec<usize> {
        let mut before = falling(&vec![([0.0; 2], 0.1); cards.len()]);
        before.surface.size = surface;
        let mut after = before.clone();
        for (object, (at, tilt)) in after.objects.iter_mut().zip(cards) {
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), *tilt);
            object.placement = Placement::At(Pose::from_parts((*at).into(), rotation));
        }
        hanging(&before, &after, &SettleOptions::default()).unwrap()
    }

    /// Height of the middle of a card that stands on the floor, 80 mm wide, with this tilt.
    fn standing(tilt: f64) -> f64 {
        0.04 * libm::sin(tilt) + 0.0025 * libm::cos(tilt)
    }

    #[test]
    fn what_lies_on_the_floor_is_held_and_what_lies_on_air_hangs() {
        assert!(hang(&[([0.0, 0.0, 0.0027], 0.0), ([0.0, 0.0, 0.008], 0.0)]).is_empty());
        assert_eq!(
            hang(&[([0.0, 0.0, 0.0027], 0.0), ([0.0, 0.0, 0.02], 0.0)]),
            [2]
        );
    }

    /// The walls push with any force, and hold nothing.
    #[test]
    fn a_card_wedged_between_walls_hangs_and_so_does_what_lies_on_it() {
        // As wide as the distance between the walls at this tilt.
        let tilt: f64 = 0.3;
        let room = 0.08 * libm::cos(tilt) + 0.005 * libm::sin(tilt);
        let upper = 0.4 + 0.0053 / libm::cos(tilt);
        assert_eq!(hang_in([0.6, room], &[([0.0, 0.0, 0.4], tilt)]), [1]);
        assert_eq!(
            hang_in(
                [0.6, room],
                &[([0.0, 0.0, 0.4], tilt), ([0.1, 0.0, upper], tilt)]
            ),
            [1, 2]
        );
        // On the floor the same card leans.
        assert!(hang_in([0.6, room], &[([0.0, 0.0, standing(tilt)], tilt)]).is_empty());
    }

    #[test]
    fn a_card_leans_on_a_wall_where_its_lower_edge_stands_on_something() {
        let reach = 0.04 * libm::cos(FRAC_PI_4) + 0.0025 * libm::sin(FRAC_PI_4);
        let leaning = |z: f64| ([0.0, 0.2 - reach, z], FRAC_PI_4);
        assert!(hang(&[leaning(standing(FRAC_PI_4))]).is_empty());
        assert_eq!(hang(&[leaning(0.1)]), [1]);
        // Away from the wall nothing keeps it from falling over.
        assert_eq!(hang(&[([0.0, 0.0, standing(FRAC_PI_4)], FRAC_PI_4)]), [1]);
    }

    #[test]
    fn a_centre_of_mass_beyond_the_edge_is_held_by_a_counterweight_alone() {
        let (base, over) = (([0.0, 0.0, 0.0027], 0.0), ([0.12, 0.0, 0.0081], 0.0));
        assert_eq!(hang(&[base, over]), [2]);
        assert!(hang(&[base, ([0.08, 0.0, 0.0081], 0.0)]).is_empty());
        // The centre of mass of the two cards over the base is at 0.08.
        assert!(hang(&[base, over, ([0.04, 0.0, 0.0135], 0.0)]).is_empty());
        // A counterweight whose own centre of mass is not over its support falls off.
        assert!(hang(&[base, over, ([0.0, 0.0, 0.0135], 0.0)]).contains(&3));
    }

    #[test]
    fn two_cards_lean_on_each_other_like_a_tent() {
        let tilt: f64 = 1.2;
        let away = 0.04 * libm::cos(tilt) + 0.0025 * libm::sin(tilt) + 0.0002;
        assert!(
            hang(&[
                ([0.0, -away, standing(tilt)], tilt),
                ([0.0, away, standing(tilt)], -tilt)
            ])
            .is_empty()
        );
        assert_eq!(hang(&[([0.0, -away, standing(tilt)], tilt)]), [1]);
    }

    #[test]
    fn what_an_author_put_in_the_air_holds_what_lies_on_it() {
        let before = falling(&[([0.0, 0.0], 0.5), ([0.0, 0.0], 0.6)]);
        let mut placed = before.clone();
        let at = |z: f64| Placement::At(Pose::translation(0.0, 0.0, z));
        placed.objects[0].placement = at(0.3);
        let mut after = placed.clone();
        after.objects[1].placement = at(0.3055);
        let hanging = |before| hanging(before, &after, &SettleOptions::default()).unwrap();
        assert!(hanging(&placed).is_empty());
        assert_eq!(hanging(&before), [1, 2]);
    }

    #[test]
    fn nothing_is_asked_of_cards_that_were_laid_without_physics() {
        let (before, flat) = (
            dropped(0, 3),
            SettleOptions {
                mode: SettleMode::Flat,
                ..Default::default()
            },
        );
        assert!(hanging(&before, &before, &flat).unwrap().is_empty());
        assert!(
            !hanging(&before, &before, &SettleOptions::default())
                .unwrap()
                .is_empty()
        );
    }

    #[test]
    fn scenes_of_different_objects_are_told() {
        let reported = hanging(&dropped(0, 3), &dropped(0, 2), &SettleOptions::default())
            .unwrap_err()
            .to_string();
        assert_eq!(reported, "objects: 2, but 3 fell");
    }
}
