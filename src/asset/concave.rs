//! Objects that their convex hull does not represent.

use crate::diagnostic::{Code, Diagnostic};
use crate::matte::Outline;

/// Least share of its convex hull that an object may fill; flattened bottles fill 0.85 and more.
const MIN_SOLIDITY: f64 = 0.75;

/// The warning about a ring or an angle: labels take the hull for the outline, and much may lie in
/// it that the object does not touch.
pub(super) fn concave_warning(outline: &Outline) -> Option<Diagnostic> {
    let solidity = outline.solidity();
    let message = format!(
        "fills {:.0} % of its convex hull, which labels use as its outline; what lies in its gaps counts as over or \
         under it; `labels.outline = \"mask\"` in the recipe uses the border of its mask",
        100.0 * solidity
    );
    (solidity < MIN_SOLIDITY).then(|| Diagnostic::warning(Code::Concave, message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Point2;

    #[test]
    fn an_angle_is_warned_of_and_a_bar_is_not() {
        let outline = |corners: &[[f64; 2]]| Outline {
            rings: vec![corners.iter().map(|&[x, y]| Point2::new(x, y)).collect()],
        };
        let bar = outline(&[[0.0, 0.0], [9.0, 0.0], [9.0, 2.0], [0.0, 2.0]]);
        assert_eq!(concave_warning(&bar), None);
        let angle = [
            [0.0, 0.0],
            [9.0, 0.0],
            [9.0, 2.0],
            [2.0, 2.0],
            [2.0, 9.0],
            [0.0, 9.0],
        ];
        let warning = concave_warning(&outline(&angle)).unwrap();
        assert_eq!(warning.code, Code::Concave);
        // 32 of 56.5 square pixels.
        assert!(
            warning.message.starts_with("fills 57 %"),
            "{}",
            warning.message
        );
        let advice = "`labels.outline = \"mask\"` in the recipe uses the border of its mask";
        assert!(warning.message.ends_with(advice), "{}", warning.message);
    }
}
