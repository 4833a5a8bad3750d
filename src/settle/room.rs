//! The room that objects fall into: the floor and its walls.
//!
//! Walls that a scene has ([`Wall`](crate::scene::Wall)) are built as sheets with the surface's
//! friction that lean outwards; objects hang over their rim and fall off. Beyond them there is
//! nothing, neither floor nor table: objects that go over the rim are gone. For a scene without
//! walls, they are frictionless planes of infinite height.

use super::bodies::{rectangle, solids_at_rest, typical_length};
use super::overlap::Solid;
use crate::geom::{Pose, UnitQuaternion, Vector3};
use crate::scene::{Scene, SettleOptions, Wall};
use std::f64::consts::FRAC_PI_2;

/// Thickness of walls, as a share of the typical card's longer side: 10 mm for 200 mm.
const SHEET_RATIO: f64 = 0.05;
/// Half the thickness of the floor, in the same unit: nothing passes through it in one step.
const FLOOR_HALF_RATIO: f64 = 2.5;

/// Floor and walls of a scene.
pub(super) struct Room {
    /// The surface with invisible walls over its edges; none if walls are built.
    pub(super) invisible: Option<[f64; 2]>,
    /// Half the sides of the surface.
    edges: [f64; 2],
    /// Distance from the middle within which centres of objects are in the room, along x and y.
    pub(super) limits: [f64; 2],
    /// The floor, then the walls, if they are built; they do not move.
    pub(super) parts: Vec<Solid>,
}

impl Room {
    /// The room of a scene.
    ///
    /// # Panics
    /// If walls are built and nothing falls.
    pub(super) fn new(scene: &Scene) -> Self {
        let size = scene.surface.size;
        let half = size.map(|side| side / 2.0);
        match scene.surface.wall {
            None => Self {
                invisible: Some(size),
                edges: half,
                limits: half,
                parts: Vec::new(),
            },
            Some(wall) => Self::built(half, &wall, typical_length(scene)),
        }
    }

    fn built(half: [f64; 2], wall: &Wall, typical_length: f64) -> Self {
        let sheet = Sheet::new(wall, SHEET_RATIO * typical_length);
        Self {
            invisible: None,
            edges: half,
            limits: half.map(|half| half + sheet.outset()),
            parts: built_parts(half, &sheet, FLOOR_HALF_RATIO * typical_length),
        }
    }

    /// Whether a body with its centre here has gone over the rim.
    pub(super) fn is_gone(&self, center: &Vector3<f64>) -> bool {
        let [x, y] = self.edges;
        let is_beside = center.x.abs() > x || center.y.abs() > y;
        self.invisible.is_none() && center.z < 0.0 && is_beside
    }
}

/// The bodies at the end of a fall, followed by the floor and the walls that are built; those that
/// fall in `start` count as dropped.
pub(super) fn bodies_in_room(start: &Scene, end: &Scene, options: &SettleOptions) -> Vec<Solid> {
    let mut bodies = solids_at_rest(start, end, options);
    bodies.extend(Room::new(start).parts);
    bodies
}

/// One of four walls, placed on the edge at `+x`.
struct Sheet {
    thickness: f64,
    /// Along the slope, from the edge to the rim.
    length: f64,
    slope: f64,
}

impl Sheet {
    fn new(wall: &Wall, thickness: f64) -> Self {
        let slope = wall.slope_deg.to_radians();
        Self {
            thickness,
            length: wall.height / libm::cos(slope),
            slope,
        }
    }

    /// From the edge of the surface to the outer side of the rim.
    fn outset(&self) -> f64 {
        self.length * libm::sin(self.slope) + self.thickness / libm::cos(self.slope)
    }

    /// The wall at this distance from the middle, in one of four directions. It begins below the
    /// floor, so that there is no gap.
    fn solid(&self, quarter: u32, distance: f64, half_width: f64) -> Solid {
        let turn = turned(&Vector3::z(), f64::from(quarter) * FRAC_PI_2);
        let rotation = turn * turned(&Vector3::y(), FRAC_PI_2 + self.slope);
        // The body's `x` points down the slope, its `z` outwards.
        let middle = Vector3::new(self.thickness - self.length, 0.0, self.thickness) / 2.0;
        let edge = turn * Vector3::new(distance, 0.0, 0.0);
        let half_length = (self.length + self.thickness) / 2.0;
        let half = Vector3::new(half_length, half_width, self.thickness / 2.0);
        standing(
            half,
            Pose::from_parts((edge + rotation * middle).into(), rotation),
        )
    }
}

/// The floor, then the walls if they have any height.
fn built_parts([x, y]: [f64; 2], sheet: &Sheet, floor_half: f64) -> Vec<Solid> {
    let floor = standing(
        Vector3::new(x, y, floor_half),
        Pose::translation(0.0, 0.0, -floor_half),
    );
    let walls = (0..if sheet.length > 0.0 { 4 } else { 0 }).map(|quarter| {
        let (distance, across) = if quarter % 2 == 0 { (x, y) } else { (y, x) };
        sheet.solid(quarter, distance, across + sheet.outset())
    });
    [floor].into_iter().chain(walls).collect()
}

fn turned(axis: &Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::new(axis * angle)
}

fn standing(half: Vector3<f64>, world_from_body: Pose) -> Solid {
    Solid {
        world_from_body,
        outline: rectangle(half.x, half.y),
        half,
        edge_radius: 0.0,
        falls: false,
        is_gone: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Placement;
    use crate::settle::tests::{dropped, falling};
    use crate::settle::{SettleVerdict, hanging, settle};

    fn room(height: f64, slope_deg: f64) -> Room {
        let mut scene = falling(&[([0.0, 0.0], 0.1)]);
        scene.surface.wall = Some(Wall { height, slope_deg });
        Room::new(&scene)
    }

    #[test]
    fn the_inner_sides_of_sheets_are_those_of_the_walls() {
        let wall = Wall {
            height: 0.075,
            slope_deg: 30.0,
        };
        let room = room(wall.height, wall.slope_deg);
        assert_eq!(room.parts.len(), 5);
        for face in wall.inner_faces([0.6, 0.4]) {
            let inward = (face[2] - face[1]).cross(&(face[1] - face[0])).normalize();
            let depth = |solid: &&Solid| {
                let over = solid.corners().map(|c| (c - face[0]).dot(&inward));
                over.fold(f64::NEG_INFINITY, f64::max)
            };
            let along = room.parts[1..].iter().find(|s| depth(s).abs() < 1e-12);
            let tops = along.expect("a sheet ends there").corners().map(|c| c.z);
            assert!((tops.fold(0.0, f64::max) - 0.075).abs() < 1e-12);
        }
    }

    #[test]
    fn a_table_has_no_walls() {
        let table = room(0.0, 0.0);
        assert_eq!(table.parts.len(), 1);
        assert!(table.is_gone(&Vector3::new(0.4, 0.0, -0.001)));
    }

    fn walled(height: f64, starts: &[([f64; 2], f64)]) -> Scene {
        let mut scene = falling(starts);
        scene.surface.wall = Some(Wall {
            height,
            slope_deg: 0.0,
        });
        scene
    }

    fn rested(scene: &Scene, options: &SettleOptions) -> Scene {
        let rest = settle(scene.clone(), options).unwrap();
        assert_eq!(rest.verdict, SettleVerdict::Rested, "{:?}", rest.rejected);
        rest.scene
    }

    /// Cosine of the angle between a card and the floor at rest; it starts next to the wall at
    /// `+x`, against which its upper edge falls.
    fn leaning_cosine(friction: f64, degrees: f64) -> f64 {
        let mut scene = walled(0.3, &[([0.0, 0.0], 0.1)]);
        scene.surface.friction = friction;
        let (angle, length, thickness) = (degrees.to_radians(), 0.2, 0.005);
        let half = [
            angle.cos() * length + angle.sin() * thickness,
            angle.sin() * length,
        ]
        .map(|side| side / 2.0);
        scene.objects[0].placement = Placement::Drop {
            above: [0.3 - half[0] - 0.0005, 0.0],
            height: half[1] + 0.5 * thickness * angle.cos() + 0.0005,
            rotation: turned(&Vector3::y(), -angle),
        };
        let rest = rested(&scene, &SettleOptions::default());
        let Placement::At(pose) = rest.objects[0].placement else {
            panic!("gone")
        };
        (pose * Vector3::x()).xy().norm()
    }

    /// Closed form: a ladder stands if the tangent of its angle is above `(1 - mu^2) / (2 mu)`,
    /// with the same friction at its foot and its top.
    #[test]
    fn a_card_leans_on_a_wall_as_a_ladder_does() {
        for friction in [0.4_f64, 0.6] {
            let least = ((1.0 - friction * friction) / (2.0 * friction)).atan();
            let steep = least.to_degrees() + 6.0;
            let leans = leaning_cosine(friction, steep);
            assert!((leans - steep.to_radians().cos()).abs() < 0.03, "{leans}");
            let slid = leaning_cosine(friction, steep - 12.0);
            assert!(slid > 0.99, "{slid}");
        }
    }

    /// A card on a slope too steep for friction to hold it.
    fn sliding(height: f64) -> Placement {
        let mut scene = walled(height, &[([0.1, 0.0], 0.006)]);
        scene.surface.friction = 0.1;
        let options = SettleOptions {
            gravity: [5.0, 0.0, -8.0],
            ..SettleOptions::default()
        };
        rested(&scene, &options).objects[0].placement
    }

    #[test]
    fn a_lip_holds_what_slides_off_a_table() {
        assert_eq!(sliding(0.0), Placement::Gone);
        let Placement::At(held) = sliding(0.02) else {
            panic!("gone")
        };
        assert!((0.15..0.3).contains(&held.translation.x), "{held}");
    }

    #[test]
    fn a_card_hangs_over_an_edge_by_less_than_half_of_it() {
        let options = SettleOptions::default();
        let mut scene = walled(0.0, &[([0.28, 0.0], 0.004)]);
        let Placement::Drop { rotation, .. } = &mut scene.objects[0].placement else {
            panic!("dropped")
        };
        *rotation = UnitQuaternion::identity();
        let Placement::At(pose) = rested(&scene, &options).objects[0].placement else {
            panic!("gone")
        };
        assert!((pose.translation.x - 0.28).abs() < 0.002, "{pose}");
        assert!((pose.translation.z - 0.0025).abs() < 0.0005, "{pose}");
    }

    #[test]
    fn what_goes_over_the_rim_is_gone_and_the_rest_lies_in_the_room() {
        let mut scene = dropped(3, 40);
        scene.surface.wall = Some(Wall {
            height: 0.02,
            slope_deg: 20.0,
        });
        let options = SettleOptions::default();
        let rest = rested(&scene, &options);
        let gone = rest
            .objects
            .iter()
            .filter(|o| o.placement == Placement::Gone);
        assert!((1..20).contains(&gone.count()));
        assert_eq!(rested(&scene, &options), rest);
        assert_eq!(rested(&rest, &options), rest);
        assert_eq!(hanging(&scene, &rest, &options).unwrap(), [0; 0]);
        let text = toml::to_string(&rest).unwrap();
        assert_eq!(toml::from_str::<Scene>(&text).unwrap(), rest);
    }

    #[test]
    fn what_stays_inside_of_high_walls_is_all_of_it() {
        let mut scene = dropped(1, 8);
        scene.surface.wall = Some(Wall {
            height: 2.0,
            slope_deg: 0.0,
        });
        let rest = rested(&scene, &SettleOptions::default());
        assert!(rest.objects.iter().all(|o| o.placement != Placement::Gone));
    }
}
