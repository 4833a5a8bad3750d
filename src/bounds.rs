//! Which numbers a setting may have, and why.

use crate::error::{Error, Result};

/// The numbers that a setting may have, both ends included, and the reason for them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    lowest: f64,
    highest: f64,
    unit: &'static str,
    why: &'static str,
}

/// Length of an object, metres: what a person photographs on a screen and drops on a surface.
pub(crate) const OBJECT: Bounds = Bounds::metres(0.005, 5.0, "objects are 5 mm to 5 m long");
/// Width of an object, metres.
pub(crate) const WIDTH: Bounds = Bounds::metres(1e-4, 5.0, "objects are 5 mm to 5 m long");
/// Thickness of the body that falls, metres.
pub(crate) const THICKNESS: Bounds = Bounds::metres(1e-5, 1.0, "from a film to a box");
pub(crate) const HALF_THICKNESS: Bounds =
    Bounds::metres(5e-6, 0.5, "half of that of a film to a box");
/// Mass of an object, kilograms.
pub(crate) const MASS: Bounds = Bounds::new(1e-6, 1e6, "kilograms");
/// Pixels of a photo per metre: for objects of such lengths that fill part of it.
pub(crate) const PX_PER_METRE: Bounds = Bounds::new(1.0, 1e7, "pixels for a metre");
/// Side of the surface that objects lie on, metres.
pub(crate) const SURFACE: Bounds = Bounds::metres(0.01, 50.0, "objects of 5 mm to 5 m lie on it");
/// Height of walls over the surface, metres.
pub(crate) const WALL_HEIGHT: Bounds = Bounds::metres(0.0, 50.0, "0 is a table without walls");
/// How far the walls lean.
pub(crate) const SLOPE: Bounds = Bounds::new(0.0, 80.0, "degrees from upright, outwards");
/// Share of the light that a surface reflects.
pub(crate) const ALBEDO: Bounds = Bounds::new(0.001, 1.0, "a share of the light");
/// Distance of a camera from the surface's centre, metres.
pub(crate) const CAMERA: Bounds = Bounds::metres(0.001, 50.0, "farther off no object is seen");
/// Anything smaller in the picture has no outline to label.
pub(crate) const LEAST_OBJECT_PX: f64 = 8.0;

/// Longest side of a generated picture, pixels: the limit up to which shadows and coverage are tested.
pub(crate) const LONGEST_SIDE_PX: u32 = 16_384;
/// Maximum number of pixels of a generated picture: a thread needs about 100 bytes for each.
pub(crate) const MOST_PIXELS: u64 = 64 << 20;

/// Millimetres and centimetres in a metre, with their names.
const SMALLER_UNITS: [(f64, &str); 2] = [(1000.0, "millimetre"), (100.0, "centimetre")];
/// A length given instead of metres is more likely in millimetres than in centimetres from this
/// value on.
const MIN_LIKELY_MILLIMETRES: f64 = 100.0;

impl Bounds {
    /// From `lowest` to `highest`; `why` ends a message, and may be empty where the range is
    /// inherent in the quantity.
    pub(crate) const fn new(lowest: f64, highest: f64, why: &'static str) -> Self {
        Self {
            lowest,
            highest,
            unit: "",
            why,
        }
    }

    /// Lengths, metres: if a value would be valid in millimetres or centimetres, the message asks
    /// about the unit.
    pub(crate) const fn metres(lowest: f64, highest: f64, why: &'static str) -> Self {
        Self {
            lowest,
            highest,
            unit: " m",
            why,
        }
    }

    /// Whether the number is within the bounds; NaN is not.
    pub(crate) fn contains(&self, value: f64) -> bool {
        (self.lowest..=self.highest).contains(&value)
    }

    /// # Errors
    /// [`Error::Value`] for a number out of bounds.
    pub(crate) fn check(&self, at: &str, value: f64) -> Result<()> {
        if self.contains(value) {
            return Ok(());
        }
        Err(Error::value(at, self.refusal(value)))
    }

    /// The message for a number out of bounds.
    pub(crate) fn refusal(&self, value: f64) -> String {
        format!("{}, expected {self}{}", number(value), self.question(value))
    }

    /// Asks about the unit where a length would be valid in another one.
    pub(crate) fn question(&self, value: f64) -> String {
        match self.unit_meant(value) {
            Some(unit) if !self.unit.is_empty() => format!("; is it in {unit}s?"),
            _ => String::new(),
        }
    }

    /// The unit in which a value that is too large for metres would be within bounds.
    pub(crate) fn unit_meant(&self, value: f64) -> Option<&'static str> {
        let [millimetres, centimetres] = SMALLER_UNITS;
        let first = if value >= MIN_LIKELY_MILLIMETRES {
            millimetres
        } else {
            centimetres
        };
        let order = [first, millimetres, centimetres];
        let meant = order
            .into_iter()
            .find(|(in_a_metre, _)| self.contains(value / in_a_metre));
        meant.filter(|_| value > self.highest).map(|(_, unit)| unit)
    }
}

impl std::fmt::Display for Bounds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            lowest,
            highest,
            unit,
            why,
        } = *self;
        write!(f, "{} to {}{unit}", number(lowest), number(highest))?;
        if why.is_empty() {
            Ok(())
        } else {
            write!(f, " ({why})")
        }
    }
}

/// A number above a limit, with one decimal, never printed as the limit itself.
pub(crate) fn above(value: impl Into<f64>, limit: impl Into<f64>) -> String {
    let [value, limit]: [f64; 2] = [value.into(), limit.into()];
    format!("{:.1}", value.max(limit + 0.1))
}

/// The same below a limit, with two decimals.
pub(crate) fn below(value: f64, limit: f64) -> String {
    format!("{:.2}", value.min(limit - 0.01))
}

/// An offset to the right and down, printed as by [`above`] along each axis where it exceeds the
/// limit.
pub(crate) fn offset_above(offset: [f64; 2], limit: f64) -> String {
    let told = |v: f64| match v.abs() > limit {
        true => v.signum() * v.abs().max(limit + 0.1),
        false => v,
    };
    // A value that rounds to 0 has no sign.
    let [x, y] = offset.map(|v| (10.0 * told(v)).round() / 10.0 + 0.0);
    format!("({x:.1}, {y:.1})")
}

/// A number, with an exponent where it would otherwise have many zeros.
pub(crate) fn number(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e7).contains(&value.abs());
    if plain {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(bounds: Bounds, value: f64) -> String {
        bounds
            .check("x", value)
            .map_or_else(|e| e.to_string(), |()| "fine".into())
    }

    #[test]
    fn both_ends_belong_to_bounds_and_no_number_does_not() {
        let bounds = Bounds::new(1.0, 16.0, "a reason");
        assert_eq!([1.0, 16.0].map(|v| checked(bounds, v)), ["fine"; 2]);
        assert_eq!(checked(bounds, 0.0), "x: 0, expected 1 to 16 (a reason)");
        assert_eq!(
            checked(bounds, f64::NAN),
            "x: NaN, expected 1 to 16 (a reason)"
        );
        assert_eq!(
            checked(Bounds::new(1e-5, 1e9, ""), 1e-300),
            "x: 1e-300, expected 1e-5 to 1e9"
        );
    }

    #[test]
    fn a_number_above_a_limit_is_not_told_as_that() {
        let told = [20.001, 20.14, 20.4].map(|value| above(value, 20.0));
        assert_eq!(told, ["20.1", "20.1", "20.4"]);
        assert_eq!(above(5.501_f32, 5.5_f32), "5.6");
        assert_eq!(offset_above([-3.01, 0.04], 3.0), "(-3.1, 0.0)");
        assert_eq!(offset_above([2.99, 4.0], 3.0), "(3.0, 4.0)");
        assert_eq!(offset_above([12.0, -0.04], 8.0), "(12.0, 0.0)");
        let told = [0.899, 0.4].map(|value| below(value, 0.9));
        assert_eq!(told, ["0.89", "0.40"]);
    }

    #[test]
    fn a_length_in_another_unit_is_asked_about() {
        let object = Bounds::metres(0.005, 5.0, "");
        assert_eq!(
            checked(object, 229.0),
            "x: 229, expected 0.005 to 5 m; is it in millimetres?"
        );
        assert_eq!(
            checked(object, 22.9),
            "x: 22.9, expected 0.005 to 5 m; is it in centimetres?"
        );
        assert_eq!(checked(object, 1e308), "x: 1e308, expected 0.005 to 5 m");
        assert_eq!(checked(object, 0.001), "x: 0.001, expected 0.005 to 5 m");
        assert_eq!(
            checked(Bounds::new(0.0, 5.0, ""), 229.0),
            "x: 229, expected 0 to 5"
        );
    }
}
