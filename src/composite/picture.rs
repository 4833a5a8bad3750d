//! The picture of a shot in one call.

use crate::composite::exposed::Exposed;
use crate::image::Image;
use crate::pixel::PremulRgba;
use crate::render::{RenderOptions, render_unhidden};
use crate::scene::Shot;

/// The picture of a shot in one call: its deep samples, out of focus if its lens makes them so,
/// over its plate, blurred where its cards move; scene-linear, premultiplied.
///
/// ```
/// use petcomp::geom::{Pose, Quad};
/// use petcomp::scene::Card;
/// use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Shot, composite};
/// use std::sync::Arc;
///
/// let quad = Quad { world_from_card: Pose::translation(0.0, 0.0, 0.05), size: [0.2, 0.1] };
/// let red_film = Image::filled(8, 8, PremulRgba::new(0.3, 0.1, 0.1, 0.5));
/// let shot = Shot::new(Camera::looking_down(1.0, 80.0, [64, 48]))
///     .with_plate(Arc::new(Image::filled(64, 48, LinearRgb::grey(0.5))))
///     .with_card(Card::new(ObjectId(1), quad, red_film))
///     .with_ambient(LinearRgb::WHITE);
/// let frame = composite::picture(&shot, &Default::default());
/// assert!(frame[(32, 24)].r > frame[(32, 24)].g);
/// ```
///
/// # Panics
/// If the plate's size is not the camera's.
pub fn picture(shot: &Shot, options: &RenderOptions) -> Image<PremulRgba> {
    Exposed::new(render_unhidden(shot, options), shot, options).frame(shot)
}
