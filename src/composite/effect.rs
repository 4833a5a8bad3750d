//! What objects and their shadows do to a plate.

use crate::composite::frame::frame;
use crate::deep::DeepImage;
use crate::filter::gaussian_blur;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};

/// What the objects of a picture and their shadows do to the plate.
pub(super) enum Effect<'a> {
    /// What deep samples do.
    Still(&'a DeepImage),
    /// The mean of that while the shutter is open.
    Moved(&'a Image<Film>),
}

impl Effect<'_> {
    /// The frame over a plate, or over nothing.
    pub(super) fn frame(&self, plate: Option<&Image<LinearRgb>>) -> Image<PremulRgba> {
        match (self, plate) {
            (Self::Still(deep), _) => frame(deep, plate),
            (Self::Moved(films), Some(plate)) => over_plate(films, plate),
            (Self::Moved(films), None) => films.map(|film| {
                let color = film.color.map(|c| c.max(0.0));
                Film { color, ..film }.to_rgba()
            }),
        }
    }

    /// The frame over a plate, which alone is not blurred.
    pub(super) fn blurred_frame(
        &self,
        plate: &Image<LinearRgb>,
        sigma_px: f32,
    ) -> Image<PremulRgba> {
        let soft = match self {
            Self::Still(deep) => gaussian_blur(&films(deep), sigma_px),
            Self::Moved(films) => gaussian_blur(films, sigma_px),
        };
        over_plate(&soft, plate)
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

/// What cards and shadows do to the plate, as a film in front of it.
fn films(deep: &DeepImage) -> Image<Film> {
    Image::from_fn(deep.width(), deep.height(), |x, y| {
        deep.flat(x, y).shaded(deep.shadow()[(x, y)])
    })
}

fn over_plate(films: &Image<Film>, plate: &Image<LinearRgb>) -> Image<PremulRgba> {
    films.zip_map(plate, |film, behind| {
        let seen = film.over_color(behind);
        let LinearRgb { r, g, b } = film.color;
        // The light that refraction takes away is soft now, and the plate is not.
        let taken = r.min(g).min(b) < 0.0;
        let left = if taken {
            seen.map(|v| v.max(0.0))
        } else {
            seen
        };
        left.opaque()
    })
}
