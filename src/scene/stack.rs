//! The start of a fall: cards stacked over the surface, none touching another.

use crate::asset::Role;
use crate::error::{Error, Result};
use crate::geom::{UnitQuaternion, Vector3};
use crate::scene::bounds::{ACROSS, GAP, SHARE, TILT, TURN};
use crate::scene::fall::{half_extent, level};
use crate::scene::{Draws, Object, Placement, Range, SettleOptions, Surface, draw_paths};
use nalgebra::Unit;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Maximum number of draws of a card's direction until it fits between the walls.
const MAX_YAW_DRAWS: u32 = 64;
/// How much longer than the space between the walls a card may be, as a share: rounding.
const FIT_TOLERANCE: f64 = 1e-12;

/// Positions and rotations in which objects start, each over the one before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DropRanges {
    /// Position along the surface's width: -1 at the left wall, 1 at the right one, 0 in the
    /// middle. Default: `[-1, 1]`.
    pub x: Range,
    /// Position along the surface's height: -1 at the lower wall, 1 at the upper one. Default:
    /// `[-1, 1]`.
    pub y: Range,
    /// How far apart objects start, drawn once for a scene, 0 to 1: at 0 all start over the middle
    /// of `x` and `y`, in a heap; at 1 they cover the ranges evenly, and those that would reach
    /// through a wall start along it. Default: none, each starts anywhere between the walls,
    /// independently of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spread: Option<Range>,
    /// Weights of the cells of a grid over `x` and `y` in which objects start: rows from the upper
    /// wall to the lower one, each from left to right; objects that would reach through a wall
    /// start along it. Default: none, uniform.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub positions: Vec<Vec<f64>>,
    /// Rotation about the vertical, degrees. Default: `[-180, 180]`.
    pub yaw_deg: Range,
    /// Tilt from horizontal, degrees. Default: `[0, 15]`.
    pub tilt_deg: Range,
    /// Direction of the horizontal tilt axis, degrees. Default: `[-180, 180]`.
    pub tilt_axis_deg: Range,
    /// Vertical clearance between an object and the highest point below it, metres. Default:
    /// `[0.005, 0.02]`.
    pub gap: Range,
    /// Share of the objects that start face down, 0 to 1: they show their backs, which are the
    /// fronts seen through. Default: 0.
    pub face_down: f64,
}

impl Default for DropRanges {
    fn default() -> Self {
        Self {
            x: Range::new(-1.0, 1.0),
            y: Range::new(-1.0, 1.0),
            spread: None,
            positions: Vec::new(),
            yaw_deg: Range::new(-180.0, 180.0),
            tilt_deg: Range::new(0.0, 15.0),
            tilt_axis_deg: Range::new(-180.0, 180.0),
            gap: Range::new(0.005, 0.02),
            face_down: 0.0,
        }
    }
}

impl DropRanges {
    /// Placement of an object before it is stacked.
    pub(super) fn unplaced() -> Placement {
        Placement::Drop {
            above: [0.0; 2],
            height: 0.0,
            rotation: UnitQuaternion::identity(),
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.x.check("start.x", &ACROSS)?;
        self.y.check("start.y", &ACROSS)?;
        self.check_places()?;
        self.yaw_deg.check("start.yaw_deg", &TURN)?;
        self.tilt_deg.check("start.tilt_deg", &TILT)?;
        self.tilt_axis_deg.check("start.tilt_axis_deg", &TURN)?;
        self.gap.check("start.gap", &GAP)?;
        SHARE.check("start.face_down", self.face_down)
    }
}

/// The column over a surface that objects are stacked in.
pub(super) struct DropColumn<'a> {
    /// Name of the background, for messages.
    pub(super) background: &'a str,
    pub(super) surface: Surface,
    pub(super) start: &'a DropRanges,
    pub(super) options: &'a SettleOptions,
    pub(super) draws: &'a Draws<'a>,
}

impl DropColumn<'_> {
    /// Stacks objects between the walls over the edges of the surface, with a gap under each.
    /// Distractors fall among them.
    ///
    /// Gaps are between the falling bodies ([`SettleOptions::half_body`]), by their true extents as
    /// rotated.
    ///
    /// # Errors
    /// An object that does not fit between the walls in any direction.
    pub(super) fn stack(&self, objects: &mut [Object]) -> Result<()> {
        let paths = draw_paths(objects);
        let places = self.start.places(self.draws);
        let half = self.surface.size.map(|side| side / 2.0);
        let mut top = 0.0;
        for i in self.drop_order(objects, &paths) {
            let (object, path) = (&mut objects[i], format!("{}.start", paths[i]));
            let rotation = self.rotation_of(i, object, &path)?;
            let extent = half_extent(&rotation, &self.options.half_body(object));
            let free = free_offsets(self.surface.size, &extent);
            let above = places.place(i, &path, half, free);
            let height = top + self.draw(&self.start.gap, &path, "gap") + extent.z;
            top = height + extent.z;
            object.placement = Placement::Drop {
                above,
                height,
                rotation,
            };
        }
        Ok(())
    }

    /// Indices from the lowest to the highest: objects in their order, each distractor at a drawn
    /// position among those before it.
    fn drop_order(&self, objects: &[Object], paths: &[String]) -> Vec<usize> {
        let mut order = Vec::with_capacity(objects.len());
        for (i, object) in objects.iter().enumerate() {
            let place = match object.role {
                Role::Object => order.len(),
                Role::Distractor => {
                    let path = format!("{}.start.order", paths[i]);
                    self.draws.choose(&path, order.len() + 1)
                }
            };
            order.insert(place, i);
        }
        order
    }

    fn rotation_of(&self, i: usize, object: &Object, path: &str) -> Result<UnitQuaternion<f64>> {
        let half = self.options.half_body(object);
        self.fitting_rotation(&half, path).ok_or_else(|| {
            let room = self.surface.size;
            let what = too_large(&object.asset, object.size, self.background, room);
            Error::value(format!("objects[{i}].size"), what)
        })
    }

    fn draw(&self, range: &Range, path: &str, name: &str) -> f64 {
        range.draw_field(self.draws, path, name)
    }

    /// The first drawn rotation at which the body fits between the walls, both tilted as it starts
    /// and level as it may end: a body that starts across a room too narrow for it never lies down
    /// there. If none does, one that fits level.
    fn fitting_rotation(&self, half: &Vector3<f64>, path: &str) -> Option<UnitQuaternion<f64>> {
        let room = self.surface.size;
        (0..MAX_YAW_DRAWS)
            .map(|number| self.draw_rotation(path, number))
            .find(|r| fits(room, half, r) && fits(room, half, &level(r)))
            .or_else(|| self.draw_level_rotation(half, path))
    }

    /// One of the level rotations at which the body fits, if there is any.
    fn draw_level_rotation(&self, half: &Vector3<f64>, path: &str) -> Option<UnitQuaternion<f64>> {
        let turns: Vec<_> = self.start.level_turns(self.surface.size, half).collect();
        (!turns.is_empty()).then(|| {
            let turn = self.draws.choose(&format!("{path}.turn"), turns.len());
            turns[turn] * self.draw_side(path)
        })
    }

    /// Turned over or not, then rotated about the vertical by the `number`-th draw for this object,
    /// then tilted.
    fn draw_rotation(&self, path: &str, number: u32) -> UnitQuaternion<f64> {
        let yaw = self.draw(&self.start.yaw_deg, path, &yaw_field(number));
        self.draw_tilt(path) * level_turn(yaw) * self.draw_side(path)
    }

    /// Half a turn about its width for an object that starts face down.
    fn draw_side(&self, path: &str) -> UnitQuaternion<f64> {
        let path = format!("{path}.face_down");
        if Range::chance(self.start.face_down, self.draws, &path) {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI)
        } else {
            UnitQuaternion::identity()
        }
    }

    /// A tilt about a horizontal axis.
    fn draw_tilt(&self, path: &str) -> UnitQuaternion<f64> {
        let towards = self.draw(&self.start.tilt_axis_deg, path, "tilt_axis_deg");
        let tilt = self.draw(&self.start.tilt_deg, path, "tilt_deg");
        UnitQuaternion::from_axis_angle(&horizontal_axis(towards), tilt.to_radians())
    }
}

impl DropRanges {
    /// Whether a card of this size, with the maximum thickness, fits between the walls in some
    /// direction in which it may start.
    pub(super) fn has_room(&self, surface: [f64; 2], [w, h]: [f64; 2]) -> bool {
        let half = Vector3::new(w, h, 0.0) / 2.0;
        self.level_turns(surface, &half).next().is_some()
    }

    /// Rotations at which a level body fits between the walls: the ends of the range, and whole
    /// degrees.
    fn level_turns(
        &self,
        surface: [f64; 2],
        half: &Vector3<f64>,
    ) -> impl Iterator<Item = UnitQuaternion<f64>> {
        whole_degrees(self.yaw_deg)
            .map(level_turn)
            .filter(move |rotation| fits(surface, half, rotation))
    }
}

/// Every further draw of a yaw has a path of its own.
fn yaw_field(number: u32) -> String {
    if number == 0 {
        "yaw_deg".into()
    } else {
        format!("yaw_deg#{number}")
    }
}

/// The ends of a range, then the whole degrees in it, over at most one turn.
fn whole_degrees(Range { min, max }: Range) -> impl Iterator<Item = f64> {
    let whole = (0..360)
        .map(move |i| min.ceil() + f64::from(i))
        .take_while(move |degrees| *degrees < max);
    [min, max].into_iter().chain(whole)
}

fn horizontal_axis(degrees: f64) -> Unit<Vector3<f64>> {
    let towards = degrees.to_radians();
    Unit::new_unchecked(Vector3::new(libm::cos(towards), libm::sin(towards), 0.0))
}

fn level_turn(degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians())
}

/// Maximum distance from the middle of an object with this half extent, in both directions.
fn free_offsets(surface: [f64; 2], extent: &Vector3<f64>) -> [f64; 2] {
    [0, 1].map(|axis| surface[axis] / 2.0 - extent[axis])
}

/// Whether a body with this rotation fits between the walls.
fn fits(surface: [f64; 2], half: &Vector3<f64>, rotation: &UnitQuaternion<f64>) -> bool {
    let free = free_offsets(surface, &half_extent(rotation, half));
    free.iter()
        .zip(surface)
        .all(|(free, side)| *free >= -FIT_TOLERANCE * side)
}

/// The message for a card that fits nowhere.
pub(super) fn too_large(asset: &str, card: [f64; 2], background: &str, room: [f64; 2]) -> String {
    let ([w, h], [room_w, room_h]) = (card, room);
    format!(
        "\"{asset}\", {w:.3} x {h:.3} m, does not fit between the walls of \"{background}\", \
         {room_w:.3} x {room_h:.3} m: expected a smaller object (scene.scale) or a larger surface"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cards(n: usize, size: [f64; 2]) -> Vec<Object> {
        let placement = DropRanges::unplaced();
        let card = |i: usize| {
            let thickness = 0.0002 * (i + 1) as f64;
            Object::new(format!("b{i}"), size, thickness, 0.03, placement)
        };
        (0..n).map(card).collect()
    }

    fn stacked(k: u64, start: &DropRanges, mut objects: Vec<Object>) -> Result<Vec<Object>> {
        let (surface, options) = (Surface::new([0.4, 0.3]), SettleOptions::default());
        DropColumn {
            background: "tray",
            surface,
            start,
            options: &options,
            draws: &Draws::new(3, k),
        }
        .stack(&mut objects)?;
        Ok(objects)
    }

    /// Corners of the body as it starts.
    fn corners(object: &Object) -> Vec<Vector3<f64>> {
        let Placement::Drop {
            above: [x, y],
            height,
            rotation,
        } = object.placement
        else {
            panic!("not dropped")
        };
        let half = SettleOptions::default().half_body(object);
        let signs =
            (0..8).map(|c| Vector3::from_fn(|axis, _| if c >> axis & 1 == 0 { -1.0 } else { 1.0 }));
        signs
            .map(|s| Vector3::new(x, y, height) + rotation * half.component_mul(&s))
            .collect()
    }

    #[test]
    fn every_card_starts_wholly_above_the_one_before_it() {
        for k in 0..50 {
            let tilted = DropRanges {
                tilt_deg: Range::new(0.0, 90.0),
                ..DropRanges::default()
            };
            let objects = stacked(k, &tilted, cards(12, [0.2, 0.08])).unwrap();
            let mut top = 0.0;
            for object in &objects {
                let z = || corners(object).into_iter().map(|c| c.z);
                let gap = z().fold(f64::INFINITY, f64::min) - top;
                assert!(
                    (0.005 - 1e-12..=0.02 + 1e-12).contains(&gap),
                    "scene {k}: gap {gap}"
                );
                top = z().fold(0.0, f64::max);
            }
        }
    }

    #[test]
    fn every_card_starts_between_the_walls() {
        for k in 0..200 {
            for corner in stacked(k, &DropRanges::default(), cards(5, [0.25, 0.2]))
                .unwrap()
                .iter()
                .flat_map(corners)
            {
                assert!(
                    corner.x.abs() <= 0.2 + 1e-12 && corner.y.abs() <= 0.15 + 1e-12,
                    "scene {k}: {corner}"
                );
            }
        }
    }

    #[test]
    fn the_share_asked_for_starts_face_down_and_lies_where_it_would() {
        let start = |face_down| DropRanges {
            face_down,
            ..DropRanges::default()
        };
        let (mut down, mut all) = (0, 0);
        for k in 0..100 {
            let up = stacked(k, &start(0.0), cards(5, [0.2, 0.08])).unwrap();
            let some = stacked(k, &start(0.3), cards(5, [0.2, 0.08])).unwrap();
            for (up, some) in up.iter().zip(&some) {
                let is_down = normal(some).z < 0.0;
                assert!(normal(up).z > 0.0 && (lying(up) - lying(some)).norm() < 1e-9);
                assert!(
                    (normal(up) * if is_down { -1.0 } else { 1.0 } - normal(some)).norm() < 1e-9
                );
                all += 1;
                down += usize::from(is_down);
            }
        }
        // Binomial: standard deviation 10.2.
        assert!(down.abs_diff(all * 3 / 10) < 41, "{down} of {all}");
    }

    fn normal(object: &Object) -> Vector3<f64> {
        match object.placement {
            Placement::Drop { rotation, .. } => rotation * Vector3::z(),
            Placement::At(_) | Placement::Gone => panic!("not dropped"),
        }
    }

    #[test]
    fn a_card_that_fits_one_way_only_is_turned_until_it_fits() {
        for k in 0..50 {
            stacked(k, &DropRanges::default(), cards(3, [0.39, 0.1])).unwrap();
        }
    }

    #[test]
    fn a_card_that_fits_no_way_is_told() {
        let reported = stacked(0, &DropRanges::default(), cards(2, [0.5, 0.31]))
            .unwrap_err()
            .to_string();
        let expected = "objects[0].size: \"b0\", 0.500 x 0.310 m, does not fit between the walls of \"tray\", 0.400 x 0.300 m: \
                        expected a smaller object (scene.scale) or a larger surface";
        assert_eq!(reported, expected);
    }

    /// Half extents of the level body, rotated as it would come to rest.
    fn lying(object: &Object) -> Vector3<f64> {
        let Placement::Drop { rotation, .. } = object.placement else {
            panic!("not dropped")
        };
        half_extent(
            &level(&rotation),
            &SettleOptions::default().half_body(object),
        )
    }

    #[test]
    fn a_card_longer_than_the_room_is_wide_does_not_start_across_it() {
        for k in 0..200 {
            for object in stacked(k, &DropRanges::default(), cards(5, [0.31, 0.1])).unwrap() {
                let half = lying(&object);
                assert!(
                    half.x <= 0.2 + 1e-12 && half.y <= 0.15 + 1e-12,
                    "scene {k}: {half}"
                );
            }
        }
    }

    #[test]
    fn a_card_as_long_as_the_room_starts_level_and_along_it() {
        for k in 0..20 {
            // So wide that it does not fit along the diagonal, unlike a narrow one.
            let start = DropRanges {
                face_down: 1.0,
                ..DropRanges::default()
            };
            let objects = stacked(k, &start, cards(3, [0.4, 0.28])).unwrap();
            for object in &objects {
                assert!((lying(object).x - 0.2).abs() < 1e-12 && normal(object).z < 0.0);
            }
            objects
                .iter()
                .flat_map(corners)
                .for_each(|c| assert!(c.x.abs() <= 0.2 + 1e-12, "scene {k}: {c}"));
        }
        let one_way = DropRanges {
            yaw_deg: Range::fixed(30.0),
            ..DropRanges::default()
        };
        assert!(stacked(0, &one_way, cards(1, [0.4, 0.28])).is_err());
        assert!(
            one_way.has_room([0.4, 0.3], [0.4, 0.05]) && !one_way.has_room([0.4, 0.3], [0.4, 0.28])
        );
    }
}
