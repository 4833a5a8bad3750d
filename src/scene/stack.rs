//! The start of a fall: cards stacked over the surface, none touching another.

use crate::error::{Error, Result};
use crate::geom::{UnitQuaternion, Vector3};
use crate::scene::bounds::{ACROSS, GAP, TILT, TURN};
use crate::scene::fall::half_extent;
use crate::scene::{Draws, Object, Placement, Range, SettleOptions, Surface};
use nalgebra::Unit;
use serde::{Deserialize, Serialize};

/// Times that a card which does not fit between the walls is turned anew.
const TURNS: u32 = 64;

/// How objects start: each over the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Start {
    /// Position along the surface's width: -1 at the left wall, 1 at the right one, 0 in the middle. Default: `[-1, 1]`.
    pub x: Range,
    /// Position along the surface's height: -1 at the lower wall, 1 at the upper one. Default: `[-1, 1]`.
    pub y: Range,
    /// Turn about the vertical, degrees. Default: `[-180, 180]`.
    pub yaw_deg: Range,
    /// Tilt from level, degrees. Default: `[0, 15]`.
    pub tilt_deg: Range,
    /// Direction of the horizontal axis that it tilts about, degrees. Default: `[-180, 180]`.
    pub tilt_axis_deg: Range,
    /// Free height between an object and the highest point below it, metres. Default: `[0.005, 0.02]`.
    pub gap: Range,
}

impl Default for Start {
    fn default() -> Self {
        Self {
            x: Range::new(-1.0, 1.0),
            y: Range::new(-1.0, 1.0),
            yaw_deg: Range::new(-180.0, 180.0),
            tilt_deg: Range::new(0.0, 15.0),
            tilt_axis_deg: Range::new(-180.0, 180.0),
            gap: Range::new(0.005, 0.02),
        }
    }
}

impl Start {
    /// What an object has before it is stacked.
    pub(super) fn unplaced() -> Placement {
        Placement::Drop { above: [0.0; 2], height: 0.0, rotation: UnitQuaternion::identity() }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.x.check("start.x", &ACROSS)?;
        self.y.check("start.y", &ACROSS)?;
        self.yaw_deg.check("start.yaw_deg", &TURN)?;
        self.tilt_deg.check("start.tilt_deg", &TILT)?;
        self.tilt_axis_deg.check("start.tilt_axis_deg", &TURN)?;
        self.gap.check("start.gap", &GAP)
    }
}

/// The column over a surface that objects are stacked in.
pub(super) struct Column<'a> {
    pub(super) surface: Surface,
    pub(super) start: &'a Start,
    pub(super) options: &'a SettleOptions,
    pub(super) draws: &'a Draws<'a>,
}

impl Column<'_> {
    /// Places objects one over the other: between the walls over the edges of the surface, with a gap under each.
    ///
    /// Gaps are between the bodies that fall ([`SettleOptions::half_body`]), by their true extents as they are turned.
    /// # Errors
    /// An object that fits between the walls in none of the directions drawn for it.
    pub(super) fn stack(&self, objects: &mut [Object]) -> Result<()> {
        let mut top = 0.0;
        for (i, object) in objects.iter_mut().enumerate() {
            let path = format!("objects[{i}].start");
            let (rotation, extent) =
                self.fitting_rotation(object, &path).ok_or_else(|| too_large(i, object, self.surface))?;
            let x = self.start.x.draw(self.draws, &format!("{path}.x"));
            let y = self.start.y.draw(self.draws, &format!("{path}.y"));
            let above = [x * self.free(0, extent.x), y * self.free(1, extent.y)];
            let height = top + self.start.gap.draw(self.draws, &format!("{path}.gap")) + extent.z;
            top = height + extent.z;
            object.placement = Placement::Drop { above, height, rotation };
        }
        Ok(())
    }

    /// How far from the middle an object of this half extent may be.
    fn free(&self, axis: usize, extent: f64) -> f64 {
        self.surface.size[axis] / 2.0 - extent
    }

    /// The first turn drawn that fits between the walls, and the half extent of the body turned so.
    fn fitting_rotation(&self, object: &Object, path: &str) -> Option<(UnitQuaternion<f64>, Vector3<f64>)> {
        let turned = |turn| {
            let rotation = self.rotation(path, turn);
            (rotation, half_extent(&rotation, &self.options.half_body(object)))
        };
        (0..TURNS).map(turned).find(|(_, extent)| self.free(0, extent.x) >= 0.0 && self.free(1, extent.y) >= 0.0)
    }

    /// First a turn about the vertical, the `turn`-th drawn for this object, then the tilt.
    fn rotation(&self, path: &str, turn: u32) -> UnitQuaternion<f64> {
        let radians = |range: &Range, name: &str| range.draw(self.draws, &format!("{path}.{name}")).to_radians();
        let yaw_name = if turn == 0 { "yaw_deg".into() } else { format!("yaw_deg#{turn}") };
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), radians(&self.start.yaw_deg, &yaw_name));
        let towards = radians(&self.start.tilt_axis_deg, "tilt_axis_deg");
        let axis = Unit::new_unchecked(Vector3::new(libm::cos(towards), libm::sin(towards), 0.0));
        UnitQuaternion::from_axis_angle(&axis, radians(&self.start.tilt_deg, "tilt_deg")) * yaw
    }
}

fn too_large(i: usize, object: &Object, surface: Surface) -> Error {
    let (card, room) = (object.size, surface.size);
    let what =
        format!("{:.3} x {:.3} m does not fit between walls of {:.3} x {:.3} m", card[0], card[1], room[0], room[1]);
    Error::value(format!("objects[{i}].size"), what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Grade;

    fn cards(n: usize, size: [f64; 2]) -> Vec<Object> {
        let placement = Start::unplaced();
        let card = |i: usize| Object {
            asset: format!("b{i}"),
            photo: 0,
            back: None,
            size,
            thickness: 0.0002 * (i + 1) as f64,
            outline: vec![],
            mass: 0.03,
            placement,
            grade: Grade::default(),
        };
        (0..n).map(card).collect()
    }

    fn stacked(k: u64, start: &Start, mut objects: Vec<Object>) -> Result<Vec<Object>> {
        let (surface, options) = (Surface::new([0.4, 0.3]), SettleOptions::default());
        Column { surface, start, options: &options, draws: &Draws::new(3, k) }.stack(&mut objects)?;
        Ok(objects)
    }

    /// Corners of the body as it starts, one by one.
    fn corners(object: &Object) -> Vec<Vector3<f64>> {
        let Placement::Drop { above: [x, y], height, rotation } = object.placement else { panic!("not dropped") };
        let half = SettleOptions::default().half_body(object);
        let signs = (0..8).map(|c| Vector3::from_fn(|axis, _| if c >> axis & 1 == 0 { -1.0 } else { 1.0 }));
        signs.map(|s| Vector3::new(x, y, height) + rotation * half.component_mul(&s)).collect()
    }

    #[test]
    fn every_card_starts_wholly_above_the_one_before_it() {
        for k in 0..50 {
            let tilted = Start { tilt_deg: Range::new(0.0, 90.0), ..Start::default() };
            let objects = stacked(k, &tilted, cards(12, [0.2, 0.08])).unwrap();
            let mut top = 0.0;
            for object in &objects {
                let z = || corners(object).into_iter().map(|c| c.z);
                let gap = z().fold(f64::INFINITY, f64::min) - top;
                assert!((0.005 - 1e-12..=0.02 + 1e-12).contains(&gap), "scene {k}: gap {gap}");
                top = z().fold(0.0, f64::max);
            }
        }
    }

    #[test]
    fn every_card_starts_between_the_walls() {
        for k in 0..200 {
            for corner in stacked(k, &Start::default(), cards(5, [0.25, 0.2])).unwrap().iter().flat_map(corners) {
                assert!(corner.x.abs() <= 0.2 + 1e-12 && corner.y.abs() <= 0.15 + 1e-12, "scene {k}: {corner}");
            }
        }
    }

    #[test]
    fn a_card_that_fits_one_way_only_is_turned_until_it_fits() {
        for k in 0..50 {
            stacked(k, &Start::default(), cards(3, [0.39, 0.1])).unwrap();
        }
    }

    #[test]
    fn a_card_that_fits_no_way_is_told() {
        let told = stacked(0, &Start::default(), cards(2, [0.5, 0.31])).unwrap_err().to_string();
        assert_eq!(told, "objects[0].size: 0.500 x 0.310 m does not fit between walls of 0.400 x 0.300 m");
    }
}
