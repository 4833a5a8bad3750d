//! Corners that may have been marked on a larger copy of the photo.

use petcomp::camera::Label;
use std::fmt::Display;

/// Warns if the corners of a label seem to come from a larger picture.
pub(super) fn warn_of_outside(shown: impl Display, label: &Label) {
    if let Some(question) = question_of_outside(label) {
        log::warn!("{shown}: {question}");
    }
}

/// Whether two or more corners are beyond the picture's right or lower edge, and none beyond the
/// left or upper: a rectangle that really extends beyond the picture does so on any side, pixels of
/// a larger picture only there.
fn question_of_outside(label: &Label) -> Option<String> {
    let ([w, h], corners) = (label.image_size(), label.surface.corners_px?);
    let is_beyond = |&&[x, y]: &&[f64; 2]| x > f64::from(w) || y > f64::from(h);
    let count = corners.iter().filter(is_beyond).count();
    let is_before = corners.iter().flatten().any(|&at| at < 0.0);
    (count > 1 && !is_before).then(|| {
        format!(
            "{count} of 4 corners lie outside the {w} x {h} picture; were they marked on a copy of another size?"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_a_larger_picture_are_asked_about() {
        let asked = |corners| question_of_outside(&Label::new([640, 480], corners, [0.6, 0.4]));
        let larger = [
            [300.0, 200.0],
            [1200.0, 210.0],
            [1190.0, 900.0],
            [290.0, 890.0],
        ];
        let told = asked(larger).unwrap_or_default();
        assert!(told.starts_with("3 of 4 corners lie outside the 640 x 480 picture;"));
        let one = [[10.0, 10.0], [600.0, 10.0], [700.0, 500.0], [10.0, 400.0]];
        assert_eq!(asked(one), None);
        // A surface that more than fills the picture.
        let around = [
            [-300.0, -200.0],
            [1000.0, 0.0],
            [900.0, 700.0],
            [-250.0, 600.0],
        ];
        assert_eq!(asked(around), None);
    }
}
