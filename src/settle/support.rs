//! Does everything lie on something, down to the floor?
//!
//! At rest is what forces can hold: pushes at the contacts, with friction, that balance the weight of every body and its
//! moments. Walls are smooth, so they may prop a card whose lower edge stands on something, and hold none in the air:
//! nothing but a chain of contacts down to the floor bears a weight, and only where the centre of mass is over it.
//!
//! # Method
//! Each contact becomes stiff springs that only push: along the edges of its cone of friction, a pyramid. Each body hangs
//! on a spring of its own that is softer by [`STIFF`]. What the contacts can hold hardly moves; what they cannot is left to
//! the soft spring and moves by up to its weight over that spring: a share of it that is 1 for a body in free fall. The
//! energy of such springs is convex and made of pieces of parabolas: Newton's method finds its minimum in a few steps.

use super::contact::{Contact, across, contacts};
use super::envelope::Envelope;
use super::overlap::{Solid, Touch};
use super::{reach, typical_length};
use crate::geom::Vector3;
use crate::scene::{Scene, SettleOptions};

/// Friction counts so many times: asked is what falls, not what would creep.
const GRIP: f64 = 2.0;
/// Share of its weight from which on a body that no contact holds up hangs in the air. A card whose centre of mass is beyond
/// what it lies on by a thirtieth of its length has as much; of 1,994 heaps at rest one had more, 1,985 none to four digits.
const HANGS: f64 = 0.1;
/// Stiffness of a contact over that of a body's own spring.
const STIFF: f64 = 1e6;
/// Steps of Newton's method: at most, and the share of the energy that one must gain for another.
const STEPS: usize = 40;
const GAIN: f64 = 1e-6;
/// Radius of gyration that turns are measured by, as a share of the typical card's longer side: that of a rod.
const GYRATION: f64 = 0.3;

/// Ids (index + 1) of the bodies that fell and that nothing holds where they are; `touching` are the pairs of bodies nearer
/// than [`reach`].
pub(super) fn hanging(
    scene: &Scene,
    options: &SettleOptions,
    solids: &[Solid],
    touching: &[Touch],
) -> Vec<usize> {
    let contacts = contacts(solids, touching, scene.surface.size, reach(scene));
    let held = Held::of(scene, options, solids, &contacts, typical_length(scene));
    let moved = held.rest();
    let mut ids: Vec<usize> = held
        .order
        .iter()
        .zip(moved.chunks(DOF))
        .filter(|(_, y)| norm(y) > HANGS)
        .map(|(i, _)| i + 1)
        .collect();
    ids.sort_unstable();
    ids
}

/// Ways that a body can move in: along three axes and about them.
const DOF: usize = 6;

/// A push of one body on another, or on what does not move, for each way that they move in.
struct Spring {
    ends: [Option<(usize, [f64; DOF])>; 2],
}

/// Bodies on springs; lengths are in typical cards, masses in the mean one, forces in its weight.
struct Held {
    /// Index of each body that fell, from the lowest to the highest, which keeps what touches together.
    order: Vec<usize>,
    masses: Vec<f64>,
    weights: Vec<f64>,
    springs: Vec<Spring>,
}

impl Held {
    fn of(
        scene: &Scene,
        options: &SettleOptions,
        solids: &[Solid],
        contacts: &[Contact],
        typical: f64,
    ) -> Self {
        let mut order: Vec<usize> = (0..solids.len()).filter(|&i| solids[i].falls).collect();
        order.sort_by(|&a, &b| solids[a].center().z.total_cmp(&solids[b].center().z));
        let mut slots = vec![None; solids.len()];
        order
            .iter()
            .enumerate()
            .for_each(|(slot, &i)| slots[i] = Some(slot));
        let mean =
            order.iter().map(|&i| scene.objects[i].mass).sum::<f64>() / order.len().max(1) as f64;
        let masses: Vec<f64> = order
            .iter()
            .flat_map(|&i| [scene.objects[i].mass / mean; DOF])
            .collect();
        let down = Vector3::from(options.gravity).normalize();
        let weights = masses
            .chunks(DOF)
            .flat_map(|m| [m[0] * down.x, m[0] * down.y, m[0] * down.z, 0.0, 0.0, 0.0]);
        let centers: Vec<Vector3<f64>> = solids.iter().map(center_of_mass).collect();
        let spring = |contact: &Contact, force: Vector3<f64>| {
            let end = |body: Option<usize>, force: Vector3<f64>| {
                let (body, slot) = body.and_then(|body| Some((body, slots[body]?)))?;
                let turn = (contact.point - centers[body]).cross(&force) / (GYRATION * typical);
                Some((slot, [force.x, force.y, force.z, turn.x, turn.y, turn.z]))
            };
            Spring {
                ends: [end(Some(contact.body), force), end(contact.by, -force)],
            }
        };
        let cone = |contact| pyramid(contact, GRIP * scene.surface.friction);
        let springs = contacts
            .iter()
            .flat_map(|contact| cone(contact).into_iter().map(move |force| (contact, force)));
        let springs = springs
            .map(|(contact, force)| spring(contact, force))
            .collect();
        Self {
            weights: weights.collect(),
            order,
            masses,
            springs,
        }
    }

    /// How far each body moves, in each way.
    fn rest(&self) -> Vec<f64> {
        let mut y = self.newton(&vec![true; self.springs.len()]);
        let mut energy = self.energy(&y);
        if energy > 0.0 {
            (y, energy) = (vec![0.0; y.len()], 0.0);
        }
        for _ in 0..STEPS {
            let pressed: Vec<bool> = self
                .springs
                .iter()
                .map(|spring| spring.stretch(&y) < 0.0)
                .collect();
            let to = self.newton(&pressed);
            let Some((better, less)) = self.towards(&y, &to, energy) else {
                break;
            };
            let gain = energy - less;
            (y, energy) = (better, less);
            if gain <= GAIN * energy.abs() {
                break;
            }
        }
        y
    }

    /// The minimum if just these springs pushed, and pulled.
    fn newton(&self, pressed: &[bool]) -> Vec<f64> {
        let mut matrix = Envelope::new(self.envelope());
        self.masses
            .iter()
            .enumerate()
            .for_each(|(i, mass)| matrix.add(i, i, *mass));
        for (spring, _) in self
            .springs
            .iter()
            .zip(pressed)
            .filter(|(_, pressed)| **pressed)
        {
            spring.stiffen(&mut matrix);
        }
        matrix.solve(self.weights.clone())
    }

    /// First entry of each row of the matrix: of the lowest body that the row's body touches.
    fn envelope(&self) -> Vec<usize> {
        let mut first: Vec<usize> = (0..self.order.len()).collect();
        for [a, b] in self
            .springs
            .iter()
            .filter_map(|spring| Some([spring.ends[0].as_ref()?.0, spring.ends[1].as_ref()?.0]))
        {
            let (low, high) = (a.min(b), a.max(b));
            first[high] = first[high].min(low);
        }
        first
            .into_iter()
            .flat_map(|slot| [DOF * slot; DOF])
            .collect()
    }

    fn energy(&self, y: &[f64]) -> f64 {
        let own = self
            .masses
            .iter()
            .zip(&self.weights)
            .zip(y)
            .map(|((m, w), y)| (0.5 * m * y - w) * y)
            .sum::<f64>();
        own + 0.5
            * STIFF
            * self
                .springs
                .iter()
                .map(|spring| spring.stretch(y).min(0.0).powi(2))
                .sum::<f64>()
    }

    /// The first place of less energy on the way, halving it; none where there is none.
    fn towards(&self, from: &[f64], to: &[f64], energy: f64) -> Option<(Vec<f64>, f64)> {
        let shares = std::iter::successors(Some(1.0), |share| Some(share / 2.0)).take(HALVINGS);
        let place = |share: f64| {
            from.iter()
                .zip(to)
                .map(|(a, b)| a + share * (b - a))
                .collect::<Vec<_>>()
        };
        shares
            .map(place)
            .map(|y| (self.energy(&y), y))
            .find(|(less, _)| *less < energy)
            .map(|(less, y)| (y, less))
    }
}

/// Times that a step of Newton's method is halved.
const HALVINGS: usize = 30;

impl Spring {
    /// How far its ends move apart.
    fn stretch(&self, y: &[f64]) -> f64 {
        let along = |(slot, push): &(usize, [f64; DOF])| {
            y[DOF * slot..]
                .iter()
                .zip(push)
                .map(|(y, p)| y * p)
                .sum::<f64>()
        };
        self.ends.iter().flatten().map(along).sum()
    }

    fn stiffen(&self, matrix: &mut Envelope) {
        for (row, of_row) in self.ends.iter().flatten() {
            for (column, of_column) in self
                .ends
                .iter()
                .flatten()
                .filter(|(column, _)| column <= row)
            {
                for (i, a) in of_row.iter().enumerate() {
                    let end = if row == column { i + 1 } else { DOF };
                    let line = of_column[..end].iter().enumerate();
                    line.for_each(|(j, b)| {
                        matrix.add(DOF * row + i, DOF * column + j, STIFF * a * b)
                    });
                }
            }
        }
    }
}

fn norm(y: &[f64]) -> f64 {
    y.iter().map(|y| y * y).sum::<f64>().sqrt()
}

/// Directions of the edges of a contact's cone of friction, the normal part of each 1.
fn pyramid(contact: &Contact, friction: f64) -> Vec<Vector3<f64>> {
    if !contact.rough || friction == 0.0 {
        return vec![contact.normal];
    }
    let (u, v) = across(&contact.normal);
    let slope = |a: f64, b: f64| contact.normal + (u * a + v * b) * friction;
    [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]]
        .map(|[a, b]| slope(a, b))
        .into()
}

fn center_of_mass(solid: &Solid) -> Vector3<f64> {
    let ([x, y, _], [a, b]) = (solid.axes(), centroid(&solid.outline));
    solid.center() + x * a + y * b
}

/// Centre of mass of a flat convex ring.
fn centroid(ring: &[[f64; 2]]) -> [f64; 2] {
    let next = ring.iter().cycle().skip(1);
    let [area, x, y] = ring
        .iter()
        .zip(next)
        .fold([0.0; 3], |[area, x, y], (a, b)| {
            let cross = a[0] * b[1] - a[1] * b[0];
            [
                area + cross,
                x + cross * (a[0] + b[0]),
                y + cross * (a[1] + b[1]),
            ]
        });
    [x, y].map(|moment| {
        if area > 0.0 {
            moment / (3.0 * area)
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use crate::geom::{Pose, UnitQuaternion, Vector3};
    use crate::scene::{Placement, SettleMode, SettleOptions};
    use crate::settle::hanging;
    use crate::settle::tests::{dropped, falling};
    use std::f64::consts::FRAC_PI_4;

    /// Ids of what hangs among cards of 200 x 80 x 5 mm in a tray of 0.6 x 0.4 m, by their centres and tilts about x.
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

    /// Height of the middle of a card that stands on the floor, 80 mm wide, tilted so.
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

    /// The walls push as hard as one likes, and hold nothing.
    #[test]
    fn a_card_wedged_between_walls_hangs_and_so_does_what_lies_on_it() {
        // As wide as it reaches from wall to wall at this tilt.
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
        // The two cards over the base, taken together, have their middle at 0.08.
        assert!(hang(&[base, over, ([0.04, 0.0, 0.0135], 0.0)]).is_empty());
        // A counterweight whose own middle is not over what it lies on falls off.
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
        let told = hanging(&dropped(0, 3), &dropped(0, 2), &SettleOptions::default())
            .unwrap_err()
            .to_string();
        assert_eq!(told, "objects: 2, but 3 fell");
    }
}
