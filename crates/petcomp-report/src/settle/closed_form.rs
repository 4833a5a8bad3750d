//! Cases with a known result: a stack of plates, and a plate on a slope.

use petcomp::Result;
use petcomp::geom::UnitQuaternion;
use petcomp::scene::{Object, Placement, Scene, SettleOptions};
use petcomp::settle::{heap, settle};

/// Plates in the stack of the closed form.
pub(super) const PLATE_COUNT: usize = 10;
const PLATE_THICKNESS_M: f64 = 0.005;
const PLATE_SIZE_M: [f64; 2] = [0.2, 0.08];
const PLATE_MASS_KG: f64 = 0.03;
/// Slopes of the closed form, as shares of the slope at which a plate begins to slide.
const SLOPES: [f64; 4] = [0.8, 0.95, 1.05, 1.2];
/// Where a plate on a slope begins: 0.25 m above the wall that stops it.
const SLIDE_START_M: f64 = -0.15;
/// A plate that stays slips less than this while it lands.
const LANDING_SLIP_M: f64 = 0.1;
/// Height of the lower face of the plate on the slope.
const SLOPE_DROP_M: f64 = 0.001;
const GRAVITY_M_S2: f64 = 9.81;

/// Plates of 200 x 80 mm, level, in the middle of the tray, their lower faces at these heights.
fn level_plates(bottoms: &[f64]) -> Result<Scene> {
    let mut scene = heap(0, bottoms.len())?;
    for (object, bottom) in scene.objects.iter_mut().zip(bottoms) {
        make_plate(object, *bottom);
    }
    Ok(scene)
}

fn make_plate(object: &mut Object, bottom: f64) {
    object.size = PLATE_SIZE_M;
    object.thickness = PLATE_THICKNESS_M;
    object.mass = PLATE_MASS_KG;
    object.placement = Placement::Drop {
        above: [0.0; 2],
        height: bottom + PLATE_THICKNESS_M / 2.0,
        rotation: UnitQuaternion::identity(),
    };
}

/// Deviation of the top of a stack of n plates from n times their thickness, metres; infinite if it
/// does not come to rest.
pub(super) fn stack_error_m(options: &SettleOptions) -> Result<f64> {
    let end = settle(plate_stack()?, &accepting_any_error(options))?;
    let top = end.scene.objects.last().and_then(rest_position);
    let expected = (PLATE_COUNT as f64 - 0.5) * PLATE_THICKNESS_M;
    Ok(top.map_or(f64::INFINITY, |[_, z]| (z - expected).abs()))
}

/// Plates with a gap of one thickness below each.
fn plate_stack() -> Result<Scene> {
    let bottoms: Vec<f64> = (0..PLATE_COUNT)
        .map(|i| 2.0 * PLATE_THICKNESS_M * i as f64 + PLATE_THICKNESS_M)
        .collect();
    level_plates(&bottoms)
}

/// The error is the quantity measured here, so none is too large.
fn accepting_any_error(options: &SettleOptions) -> SettleOptions {
    SettleOptions {
        max_overlap: 1.0,
        max_energy_rise: 1000.0,
        ..*options
    }
}

/// Position of an object at rest along the tray, and its height, metres.
fn rest_position(object: &Object) -> Option<[f64; 2]> {
    match object.placement {
        Placement::At(pose) => Some([pose.translation.x, pose.translation.z]),
        Placement::Drop { .. } | Placement::Gone => None,
    }
}

/// Number of slopes on which a plate slides and should not, or vice versa.
pub(super) fn count_wrong_slopes(options: &SettleOptions) -> Result<usize> {
    let mut wrong = 0;
    for slope in SLOPES {
        wrong += usize::from(!slides_rightly(slope, options)?);
    }
    Ok(wrong)
}

/// Whether a plate on a slope of `share` times the critical one slides if that is more than 1, and
/// stays otherwise.
fn slides_rightly(share: f64, options: &SettleOptions) -> Result<bool> {
    let scene = plate_on_slope()?;
    let options = SettleOptions {
        gravity: gravity_on_slope(libm::atan(share * scene.surface.friction)),
        ..*options
    };
    let end = settle(scene, &options)?;
    let should_slide = share > 1.0;
    let position = end.scene.objects.first().map(rest_position);
    Ok(position.is_some_and(|at| has_slid(at, should_slide)) == should_slide)
}

/// A slope is a level tray with oblique gravity.
fn gravity_on_slope(slope: f64) -> [f64; 3] {
    [libm::sin(slope), 0.0, -libm::cos(slope)].map(|x| GRAVITY_M_S2 * x)
}

/// A plate that is still moving counts as right.
fn has_slid(position: Option<[f64; 2]>, should_slide: bool) -> bool {
    position.map_or(should_slide, |[x, _]| x - SLIDE_START_M > LANDING_SLIP_M)
}

fn plate_on_slope() -> Result<Scene> {
    let mut scene = level_plates(&[SLOPE_DROP_M])?;
    for object in &mut scene.objects {
        if let Placement::Drop { above, .. } = &mut object.placement {
            above[0] = SLIDE_START_M;
        }
    }
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_meets_the_closed_forms() {
        let options = SettleOptions::default();
        // Contacts hold bodies up to twice their margin of 0.2 mm apart.
        assert!(stack_error_m(&options).unwrap() < PLATE_COUNT as f64 * 0.0004);
        assert!(
            SLOPES
                .iter()
                .all(|slope| slides_rightly(*slope, &options).unwrap())
        );
    }
}
