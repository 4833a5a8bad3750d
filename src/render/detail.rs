//! Level of detail at which a card's texture is read.

use crate::asset::Texture;
use crate::geom::Vector3;
use crate::render::pixel_filter::residual_sigma;
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane};

/// Sub-samples per side from which a sharper level of detail pays off.
const DENSE_SUBSAMPLES: usize = 4;

/// Level of detail by matching variance: the texture's own filter adds the part of the pixel's
/// window that the sub-samples lack.
///
/// A level read bilinearly has variance `4^level / 4` texels.
pub(super) fn detail_level(texels_per_pixel: f64, offsets: &[f64]) -> f64 {
    let level = libm::log2(2.0 * residual_sigma(offsets) * texels_per_pixel);
    // A NaN from a card that fills the horizon reads the full texture.
    (level - sharpening(offsets.len()))
        .clamp(0.0, 32.0)
        .max(0.0)
}

/// Texels of the full texture per side of a pixel that shows `target`, or where that is not in
/// front of the eye, the nearest corner that is; 0 if none is.
pub(super) fn texels_per_pixel(
    texture: &Texture,
    plane: &ScenePlane,
    projected: &ProjectedPlane,
    view: &CameraView,
    target: &Vector3<f64>,
) -> f64 {
    let Some(target) = seen_target(plane, view, target) else {
        return 0.0;
    };
    let (width, height) = texture.size();
    let texels = (width * height) as f64;
    projected.cell_metres(view, &target) * (texels / (plane.size[0] * plane.size[1])).sqrt()
}

fn seen_target(
    plane: &ScenePlane,
    view: &CameraView,
    target: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let is_seen = |point: &Vector3<f64>| view.has_in_front(std::slice::from_ref(point));
    if is_seen(target) {
        return Some(*target);
    }
    let distance = |corner: &Vector3<f64>| (corner - view.eye).norm();
    let corners = plane.corners().into_iter().filter(is_seen);
    corners.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// How much sharper a level can be with many sub-samples per side.
fn sharpening(subsamples: usize) -> f64 {
    if subsamples >= DENSE_SUBSAMPLES {
        0.25
    } else {
        0.0
    }
}
