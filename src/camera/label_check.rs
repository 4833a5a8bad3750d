//! Checks for impossible numbers in a label.

use super::error::SolveError;
use super::focal::{plausible_equivalents, plausible_pixels};
use super::label::{Crop, Label, LabelCamera, LabelPoint, LabelSurface, LabelWall};
use crate::bounds::{ALBEDO, Bounds, CAMERA, SLOPE, WALL_HEIGHT, number};
use crate::color::Albedo;
use std::ops::RangeInclusive;

/// Standard deviations of labelled points, pixels: with less, rounding outweighs what the other
/// priors say.
const POINT_NOISE: Bounds = Bounds::new(1e-4, MAX_MAGNITUDE, "pixels");

/// No meaningful label holds larger numbers, or positive ones smaller than one over this.
pub(crate) const MAX_MAGNITUDE: f64 = 1e9;

/// The picture has pixels, everything is finite, and positive where it has to be.
pub(crate) fn check_label(label: &Label) -> Result<(), SolveError> {
    check_image(label)?;
    check_surface(&label.surface)?;
    label.points.iter().try_for_each(check_point)?;
    check_camera(&label.camera)?;
    check_focal(&label.camera, label.taken_size())
}

fn check_image(label: &Label) -> Result<(), SolveError> {
    check_picture(label.image_size())?;
    check_picture(label.taken_size())?;
    let mut crop = label.image.crop.iter();
    crop.try_for_each(|crop| check_crop(crop, label.image_size()))
}

/// A picture of this size lies inside the one that it was cut out of.
fn check_crop(crop: &Crop, size: [u32; 2]) -> Result<(), SolveError> {
    let Crop {
        offset_px,
        width,
        height,
    } = *crop;
    check_finite("image.crop.offset_px", &offset_px)?;
    let mut sides = offset_px.into_iter().zip(size).zip([width, height]);
    if sides.all(|((from, side), whole)| from >= 0.0 && from + f64::from(side) <= whole.into()) {
        return Ok(());
    }
    Err(SolveError::CropOutside {
        size,
        offset_px,
        whole: [width, height],
    })
}

fn check_surface(surface: &LabelSurface) -> Result<(), SolveError> {
    if let Some(corners) = &surface.corners_px {
        check_finite("surface.corners_px", corners.as_flattened())?;
        check_pixels(corners.as_flattened())?;
    }
    check_within(
        "surface.corner_sigma_px",
        surface.corner_sigma_px,
        &POINT_NOISE,
    )?;
    check_albedo(surface.albedo)?;
    check_not_negative("surface.dimension_sigma_m", surface.dimension_sigma_m)?;
    check_sigma(
        "surface.dimension_sigma_m",
        surface.dimension_sigma_m,
        shorter_side(surface),
    )?;
    surface.wall.iter().try_for_each(check_wall)
}

/// The corners are not shares of the picture's sides, as other formats have them.
fn check_pixels(corners: &[f64]) -> Result<(), SolveError> {
    let are_shares = corners.iter().all(|at| (0.0..=1.0).contains(at));
    if !are_shares || corners.iter().all(|&at| at == 0.0) {
        return Ok(());
    }
    Err(SolveError::OutOfBounds {
        at: "surface.corners_px",
        what: "all from 0 to 1, expected pixels; are they shares of the picture's sides?".into(),
    })
}

fn check_wall(wall: &LabelWall) -> Result<(), SolveError> {
    check_within("surface.wall.height_m", wall.height_m, &WALL_HEIGHT)?;
    check_within("surface.wall.slope_deg", wall.slope_deg, &SLOPE)
}

fn check_point(point: &LabelPoint) -> Result<(), SolveError> {
    check_finite("points.xyz_m", &point.xyz_m)?;
    check_finite("points.px", &point.px)?;
    check_within("points.sigma_px", point.sigma_px, &POINT_NOISE)
}

fn shorter_side(surface: &LabelSurface) -> Option<f64> {
    let sides = [surface.width_m, surface.height_m];
    sides.into_iter().flatten().min_by(f64::total_cmp)
}

/// What a length is measured with is less than the length.
fn check_sigma(
    at: &'static str,
    sigma: Option<f64>,
    length: Option<f64>,
) -> Result<(), SolveError> {
    match (sigma, length) {
        (Some(sigma), Some(length)) if sigma >= length => Err(SolveError::OutOfBounds {
            at,
            what: format!(
                "{}, expected less than the {} m that it is the error of; is it in millimetres?",
                number(sigma),
                number(length)
            ),
        }),
        _ => Ok(()),
    }
}

fn check_camera(camera: &LabelCamera) -> Result<(), SolveError> {
    if let Some(principal) = &camera.principal_point_px {
        check_finite("camera.principal_point_px", principal)?;
    }
    check_finite("camera.k1", camera.k1.as_slice())?;
    check_not_negative("camera.focal_sigma", camera.focal_sigma)?;
    check_not_negative(
        "camera.principal_point_sigma_px",
        camera.principal_point_sigma_px,
    )?;
    check_positive("camera.height_m", camera.height_m)?;
    check_within("camera.height_m", camera.height_m, &CAMERA)?;
    check_positive("camera.height_sigma_m", camera.height_sigma_m)?;
    check_sigma(
        "camera.height_sigma_m",
        camera.height_sigma_m,
        camera.height_m,
    )
}

/// The focal length is one that a camera with a picture of this size can have.
fn check_focal(camera: &LabelCamera, image: [u32; 2]) -> Result<(), SolveError> {
    let (px, equivalent) = (camera.focal_px, camera.focal_35mm);
    check_positive("camera.focal_px", px)?;
    check_positive("camera.focal_35mm", equivalent)?;
    let (pixels, equivalents) = (plausible_pixels(image), plausible_equivalents(image));
    check_length("camera.focal_px", px, &pixels, "is it in millimetres?")?;
    let question = "is it the real focal length of a phone?";
    check_length("camera.focal_35mm", equivalent, &equivalents, question)?;
    check_fixed(camera)
}

/// Too short a focal length is asked about.
fn check_length(
    at: &'static str,
    length: Option<f64>,
    expected: &RangeInclusive<f64>,
    question: &str,
) -> Result<(), SolveError> {
    let Some(length) = length.filter(|length| !expected.contains(length)) else {
        return Ok(());
    };
    let [least, most] = [*expected.start(), *expected.end()];
    let asked = if length < least {
        format!("; {question}")
    } else {
        String::new()
    };
    let [length, least, most] = [length, least, most].map(number);
    Err(SolveError::OutOfBounds {
        at,
        what: format!("{length}, expected {least} to {most} for a picture of this size{asked}"),
    })
}

/// What is exact is there.
fn check_fixed(camera: &LabelCamera) -> Result<(), SolveError> {
    if camera.focal_fixed && camera.focal_px.is_none() && camera.focal_35mm.is_none() {
        return Err(SolveError::OutOfBounds {
            at: "camera.focal_fixed",
            what: "true, expected camera.focal_px or focal_35mm with it".into(),
        });
    }
    Ok(())
}

/// Zero is allowed: the value is then exact.
fn check_not_negative(at: &'static str, value: Option<f64>) -> Result<(), SolveError> {
    check_positive(at, value.filter(|&v| v != 0.0))
}

fn check_positive(at: &'static str, value: Option<f64>) -> Result<(), SolveError> {
    match value {
        Some(v) if v <= 0.0 => Err(SolveError::NotPositive { at, value: v }),
        Some(v) if v < 1.0 / MAX_MAGNITUDE => Err(out_of_range(at, v)),
        Some(v) => check_finite(at, &[v]),
        None => Ok(()),
    }
}

fn check_albedo(albedo: Option<Albedo>) -> Result<(), SolveError> {
    let mut shares = albedo.iter().flat_map(Albedo::range);
    shares.try_for_each(|share| check_within("surface.albedo", Some(share), &ALBEDO))
}

fn check_within(at: &'static str, value: Option<f64>, bounds: &Bounds) -> Result<(), SolveError> {
    let Some(value) = value.filter(|&value| !bounds.contains(value)) else {
        return Ok(());
    };
    Err(SolveError::OutOfBounds {
        at,
        what: bounds.refusal(value),
    })
}

/// Finite, and small enough for squares and products of a few of them.
fn check_finite(at: &'static str, values: &[f64]) -> Result<(), SolveError> {
    values.iter().try_for_each(|&value| match value.abs() {
        size if !size.is_finite() => Err(SolveError::NonFinite(at)),
        size if size > MAX_MAGNITUDE => Err(out_of_range(at, value)),
        _ => Ok(()),
    })
}

fn check_picture(size: [u32; 2]) -> Result<(), SolveError> {
    if size.contains(&0) {
        return Err(SolveError::BadImage(size));
    }
    Ok(())
}

fn out_of_range(at: &'static str, value: f64) -> SolveError {
    SolveError::OutOfRange {
        at,
        value,
        most: MAX_MAGNITUDE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::pixel::LinearRgb;

    /// What is said of a label with an impossible number.
    fn refusal(edit: impl FnOnce(&mut Label)) -> String {
        let mut label = Scenario::default().view(1, 0).label;
        edit(&mut label);
        check_label(&label).unwrap_err().to_string()
    }

    #[test]
    fn walls_have_a_height_that_is_possible_and_lean_outwards() {
        for (height, question) in [(-0.07, ""), (75.0, "; is it in centimetres?")] {
            let wall = LabelWall {
                height_m: Some(height),
                slope_deg: None,
            };
            let expected = "expected 0 to 50 m (0 is a table without walls)";
            assert_eq!(
                refusal(|label| label.surface.wall = Some(wall)),
                format!("surface.wall.height_m: {height}, {expected}{question}")
            );
        }
        for slope in [-8.0, 90.0, f64::NAN] {
            let wall = LabelWall {
                height_m: None,
                slope_deg: Some(slope),
            };
            assert_eq!(
                refusal(|label| label.surface.wall = Some(wall)),
                format!(
                    "surface.wall.slope_deg: {slope}, expected 0 to 80 (degrees from upright, outwards)"
                )
            );
        }
    }

    #[test]
    fn errors_of_lengths_that_are_in_millimetres_are_asked_about() {
        let told = refusal(|label| {
            label.surface.set_size([0.56, 0.37]);
            label.surface.dimension_sigma_m = Some(2.0);
        });
        let expected = "surface.dimension_sigma_m: 2, expected less than the 0.37 m that it is the error of; is it in millimetres?";
        assert_eq!(told, expected);
        let told = refusal(|label| {
            (label.camera.height_m, label.camera.height_sigma_m) = (Some(0.82), Some(30.0));
        });
        let expected = "camera.height_sigma_m: 30, expected less than the 0.82 m";
        assert!(told.starts_with(expected), "{told}");
    }

    #[test]
    fn corners_that_are_shares_of_the_picture_are_asked_about() {
        let corners = [[0.3, 0.4], [0.7, 0.26], [0.78, 0.66], [0.27, 0.74]];
        let told = refusal(|label| label.surface.corners_px = Some(corners));
        assert!(
            told.ends_with("are they shares of the picture's sides?"),
            "{told}"
        );
    }

    #[test]
    fn points_have_some_noise() {
        let told = refusal(|label| label.surface.corner_sigma_px = Some(1e-6));
        let expected = "surface.corner_sigma_px: 1e-6, expected 0.0001 to";
        assert!(told.starts_with(expected), "{told}");
    }

    #[test]
    fn a_camera_height_in_millimetres_is_asked_about() {
        let refusal = refusal(|label| label.camera.height_m = Some(1120.0));
        let expected = "camera.height_m: 1120, expected 0.001 to 50 m";
        assert!(refusal.starts_with(expected), "{refusal}");
        assert!(refusal.ends_with("; is it in millimetres?"), "{refusal}");
    }

    #[test]
    fn the_real_focal_length_of_a_phone_is_asked_about() {
        let told = |focal_35mm| {
            refusal(|label| {
                (label.camera.focal_35mm, label.camera.focal_fixed) = (Some(focal_35mm), true);
            })
        };
        let expected = "expected 6.9 to 692.3 for a picture of this size";
        let question = "is it the real focal length of a phone?";
        assert_eq!(
            told(4.2),
            format!("camera.focal_35mm: 4.2, {expected}; {question}")
        );
        assert_eq!(told(5000.0), format!("camera.focal_35mm: 5000, {expected}"));
    }

    #[test]
    fn pixels_that_are_millimetres_are_asked_about() {
        let expected = "expected 200 to 400000 for a picture of this size";
        assert_eq!(
            refusal(|label| label.camera.focal_px = Some(26.0)),
            format!("camera.focal_px: 26, {expected}; is it in millimetres?")
        );
    }

    #[test]
    fn a_focal_length_that_is_exact_is_stated() {
        assert_eq!(
            refusal(|label| label.camera.focal_fixed = true),
            "camera.focal_fixed: true, expected camera.focal_px or focal_35mm with it"
        );
    }

    #[test]
    fn a_picture_is_inside_the_one_it_was_cut_out_of() {
        let mut label = Scenario::default().view(1, 0).label;
        let mut checked = |offset_px: [f64; 2], width: u32| {
            label.image.crop = Some(Crop {
                offset_px,
                width,
                height: 3000,
            });
            check_label(&label).map_err(|refusal| refusal.to_string())
        };
        assert_eq!(checked([0.0, 0.0], 4000), Ok(()));
        assert_eq!(checked([20.5, 0.0], 4021), Ok(()));
        let beyond = checked([200.0, 0.0], 4000).unwrap_err();
        let expected = "image.crop: 4000 x 3000 pixels at 200, 0, expected a part of the whole picture of 4000 x 3000";
        assert!(beyond.starts_with(expected), "{beyond}");
        assert!(checked([-1.0, 0.0], 5000).is_err());
    }

    #[test]
    fn a_surface_reflects_some_of_the_light_and_at_most_all() {
        for impossible in [-0.5, 0.0, 1.5, 10.0] {
            let color = LinearRgb::new(0.5, impossible as f32, 0.5);
            for albedo in [Albedo::Luminance(impossible), Albedo::Color(color)] {
                let refusal = refusal(|label| label.surface.albedo = Some(albedo));
                assert!(refusal.contains("surface.albedo"), "{refusal}");
                assert!(refusal.contains(&impossible.to_string()), "{refusal}");
            }
        }
    }
}
