//! The effect of objects and their shadows on a plate.

use crate::composite::frame::{frame, over, over_nothing};
use crate::deep::DeepImage;
use crate::filter::gaussian_blur;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};

/// The effect of a picture's objects and their shadows on the plate as seen, displaced where
/// objects bend light.
pub(super) enum Effect<'a> {
    /// That of deep samples.
    Still(&'a DeepImage),
    /// Its mean while the shutter is open.
    Moved(&'a Image<Film>),
}

impl Effect<'_> {
    /// The frame over a plate, or over nothing.
    pub(super) fn frame(&self, plate: Option<&Image<LinearRgb>>) -> Image<PremulRgba> {
        match (self, plate) {
            (Self::Still(deep), _) => frame(deep, plate),
            (Self::Moved(films), Some(plate)) => films.zip_map(plate, over),
            (Self::Moved(films), None) => films.map(over_nothing),
        }
    }

    /// The effect itself blurred, as films.
    pub(super) fn blurred(&self, sigma_px: f32) -> Image<Film> {
        match self {
            Self::Still(deep) => gaussian_blur(&films(deep), sigma_px),
            Self::Moved(films) => gaussian_blur(films, sigma_px),
        }
    }

    /// The factor on the plate at a pixel.
    #[inline(always)]
    pub(super) fn passes_at(&self, at: (usize, usize)) -> LinearRgb {
        match self {
            Self::Still(deep) => deep.flat(at.0, at.1).transmittance() * deep.shadow()[at],
            Self::Moved(films) => films[at].transmittance(),
        }
    }
}

/// The effect of cards and shadows on the plate, as a film in front of it.
fn films(deep: &DeepImage) -> Image<Film> {
    Image::from_fn(deep.width(), deep.height(), |x, y| {
        deep.flat(x, y).shaded(deep.shadow()[(x, y)])
    })
}
