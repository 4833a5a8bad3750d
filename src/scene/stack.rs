//! The start of a fall: cards stacked over the surface, none touching another.

use crate::error::{Error, Result};
use crate::geom::{UnitQuaternion, Vector3};
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
        self.x.check("start.x", -1.0, 1.0)?;
        self.y.check("start.y", -1.0, 1.0)?;
        self.yaw_deg.check("start.yaw_deg", -f64::INFINITY, f64::INFINITY)?;
        self.tilt_deg.check("start.tilt_deg", -180.0, 180.0)?;
        self.tilt_axis_deg.check("start.tilt_axis_deg", -f64::INFINITY, f64::INFINITY)?;
        self.gap.check_positive("start.gap")
    }

    /// First the turn about the vertical, then the tilt. `turn` counts the times it was drawn for this object.
    fn rotation(&self, draws: &Draws, path: &str, turn: u32) -> UnitQuaternion<f64> {
        let yaw_path = if turn == 0 { format!("{path}.yaw_deg") } else { format!("{path}.yaw_deg#{turn}") };
        let yaw = self.yaw_deg.draw(draws, &yaw_path).to_radians();
        let tilt = self.tilt_deg.draw(draws, &format!("{path}.tilt_deg")).to_radians();
        let towards = self.tilt_axis_deg.draw(draws, &format!("{path}.tilt_axis_deg")).to_radians();
        let axis = Unit::new_unchecked(Vector3::new(libm::cos(towards), libm::sin(towards), 0.0));
        UnitQuaternion::from_axis_angle(&axis, tilt) * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)
    }
}

/// Places objects one over the other: between the walls over the edges of `surface`, with a gap under each.
///
/// Gaps are between the bodies that fall ([`SettleOptions::half_body`]), by their true extents as they are turned.
/// # Errors
/// An object that fits between the walls in none of the directions drawn for it.
pub(super) fn stack(
    objects: &mut [Object],
    surface: Surface,
    start: &Start,
    options: &SettleOptions,
    draws: &Draws,
) -> Result<()> {
    let mut top = 0.0;
    for (i, object) in objects.iter_mut().enumerate() {
        let path = format!("objects[{i}].start");
        let (rotation, extent) = fitting_rotation(object, surface, start, options, draws, &path)
            .ok_or_else(|| too_large(i, object, surface))?;
        let free = |axis: usize| (surface.size[axis] / 2.0 - extent[axis]).max(0.0);
        let above =
            [free(0) * start.x.draw(draws, &format!("{path}.x")), free(1) * start.y.draw(draws, &format!("{path}.y"))];
        let height = top + start.gap.draw(draws, &format!("{path}.gap")) + extent.z;
        top = height + extent.z;
        object.placement = Placement::Drop { above, height, rotation };
    }
    Ok(())
}

fn fitting_rotation(
    object: &Object,
    surface: Surface,
    start: &Start,
    options: &SettleOptions,
    draws: &Draws,
    path: &str,
) -> Option<(UnitQuaternion<f64>, Vector3<f64>)> {
    let turned = |turn| {
        let rotation = start.rotation(draws, path, turn);
        (rotation, half_extent(&rotation, &options.half_body(object)))
    };
    (0..TURNS).map(turned).find(|(_, e)| 2.0 * e.x <= surface.size[0] && 2.0 * e.y <= surface.size[1])
}

fn too_large(i: usize, object: &Object, surface: Surface) -> Error {
    let (card, room) = (object.size, surface.size);
    let what =
        format!("{:.3} x {:.3} m does not fit between walls of {:.3} x {:.3} m", card[0], card[1], room[0], room[1]);
    Error::value(format!("objects[{i}].size"), what)
}
