//! Checks for impossible numbers in a label.

use super::error::SolveError;
use super::label::{Label, LabelCamera, LabelPoint, LabelSurface};

/// No meaningful label holds larger numbers, or positive ones smaller than one over this.
pub(crate) const MAX_MAGNITUDE: f64 = 1e9;

/// The picture has pixels, everything is finite, and positive where it has to be.
pub(crate) fn check_label(label: &Label) -> Result<(), SolveError> {
    check_image(label)?;
    check_surface(&label.surface)?;
    label.points.iter().try_for_each(check_point)?;
    check_camera(&label.camera)
}

fn check_image(label: &Label) -> Result<(), SolveError> {
    check_picture(label.image_size())?;
    check_picture(label.taken_size())?;
    let mut crop = label.image.crop.iter();
    crop.try_for_each(|crop| check_finite("image.crop.offset_px", &crop.offset_px))
}

fn check_surface(surface: &LabelSurface) -> Result<(), SolveError> {
    if let Some(corners) = &surface.corners_px {
        check_finite("surface.corners_px", corners.as_flattened())?;
    }
    check_positive("surface.corner_sigma_px", surface.corner_sigma_px)?;
    check_share("surface.albedo", surface.albedo)?;
    check_not_negative("surface.dimension_sigma_m", surface.dimension_sigma_m)
}

fn check_point(point: &LabelPoint) -> Result<(), SolveError> {
    check_finite("points.xyz_m", &point.xyz_m)?;
    check_finite("points.px", &point.px)?;
    check_positive("points.sigma_px", point.sigma_px)
}

fn check_camera(camera: &LabelCamera) -> Result<(), SolveError> {
    if let Some(principal) = &camera.principal_point_px {
        check_finite("camera.principal_point_px", principal)?;
    }
    check_finite("camera.k1", camera.k1.as_slice())?;
    check_positive("camera.focal_px", camera.focal_px)?;
    check_positive("camera.focal_35mm", camera.focal_35mm)?;
    check_not_negative("camera.focal_sigma", camera.focal_sigma)?;
    check_not_negative(
        "camera.principal_point_sigma_px",
        camera.principal_point_sigma_px,
    )?;
    check_positive("camera.height_m", camera.height_m)?;
    check_positive("camera.height_sigma_m", camera.height_sigma_m)
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

fn check_share(at: &'static str, value: Option<f64>) -> Result<(), SolveError> {
    match value {
        Some(value) if !(value > 0.0 && value <= 1.0) => Err(SolveError::NotShare { at, value }),
        _ => Ok(()),
    }
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

    fn refusal_of(albedo: f64) -> String {
        let mut label = Scenario::default().view(1, 0).label;
        label.surface.albedo = Some(albedo);
        check_label(&label).unwrap_err().to_string()
    }

    #[test]
    fn a_surface_reflects_some_of_the_light_and_at_most_all() {
        for impossible in [-0.5, 0.0, 1.5] {
            let refusal = refusal_of(impossible);
            assert!(refusal.contains("surface.albedo"), "{refusal}");
            assert!(refusal.contains(&impossible.to_string()), "{refusal}");
        }
    }
}
