//! Pixels of which a person says whether they are see-through.

use super::solve::Factor;
use crate::image::Image;
use crate::matte::stroke::Claims;
use crate::pixel::LinearRgb;
use std::borrow::Cow;

/// Lets nothing through where a person says so.
pub(super) fn make_opaque(factors: &mut Image<Factor>, claims: Option<&Claims>) {
    for (factor, claim) in claimed(factors, claims) {
        if claim == Some(false) {
            *factor = Factor::default();
        }
    }
}

/// Sets a picture to a value where a person says that the plastic is see-through.
pub(super) fn set_see_through(image: &mut Image<f32>, claims: Option<&Claims>, value: f32) {
    for (pixel, claim) in claimed(image, claims) {
        if claim == Some(true) {
            *pixel = value;
        }
    }
}

/// The pixels of a picture with what is said of each; none where nothing is.
fn claimed<'a, P: Copy + Default>(
    image: &'a mut Image<P>,
    claims: Option<&'a Claims>,
) -> impl Iterator<Item = (&'a mut P, Option<bool>)> {
    let claims = claims.into_iter().flat_map(|claims| claims.pixels());
    image.pixels_mut().iter_mut().zip(claims.copied())
}

/// The measured transmittance without the shadow on the screen, where a person says that it is see
/// through: at least that of flat plastic.
pub(super) fn without_shadow<'a>(
    transmittance: &'a Image<LinearRgb>,
    flat: LinearRgb,
    claims: Option<&Claims>,
) -> Cow<'a, Image<LinearRgb>> {
    match claims {
        Some(claims) => Cow::Owned(transmittance.zip_map(claims, |t, claim| match claim {
            Some(true) => t.zip_map(flat, f32::max),
            _ => t,
        })),
        None => Cow::Borrowed(transmittance),
    }
}
