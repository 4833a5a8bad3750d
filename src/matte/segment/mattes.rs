//! What a segmentation tells a keyer: the screen, and what surely is not or surely is the object.

use super::Segmentation;
use crate::filter;
use crate::image::Image;
use crate::matte::screen::{screen_pixels, strongest_channel};
use crate::pixel::{Coverage, LinearRgb};

/// Least depth of core pixels below the outline, pixels: beyond the blur of a lens.
const CORE_DEPTH_PX: f64 = 2.0;
/// A pixel with so little of the screen's strongest channel lets no more than that through.
const CORE_TRANSMITTANCE: f32 = 0.1;

impl Segmentation {
    /// The pixels that surely show nothing but the screen: outside the hull and a margin around it.
    pub fn background(&self) -> Image<bool> {
        screen_pixels(&self.mask)
    }

    /// Garbage matte: 1 at more than `margin_px` from the tight outline, where there is no object.
    pub fn garbage(&self, margin_px: f64) -> Image<Coverage> {
        let near = filter::dilate(&self.tight.map(|c| c.0 > 0.0), margin_px);
        near.map(|near| Coverage(f32::from(u8::from(!near))))
    }

    /// Core matte: 1 where the object is surely opaque, given the photo and its screen plate.
    ///
    /// # Method
    /// Reflected light is not negative, so from `photo = F + T plate` follows `T <= photo / plate` in every channel; where
    /// the screen is strongest, that is below a tenth in the core.
    /// # Panics
    /// When the sizes differ.
    pub fn core(&self, photo: &Image<LinearRgb>, plate: &Image<LinearRgb>) -> Image<Coverage> {
        let deep = filter::erode(&self.tight.map(|c| c.0 >= 1.0), CORE_DEPTH_PX);
        let opaque = photo.zip_map(plate, |p, k| {
            let c = strongest_channel(k);
            <[f32; 3]>::from(p)[c] < CORE_TRANSMITTANCE * <[f32; 3]>::from(k)[c]
        });
        deep.zip_map(&opaque, |deep, opaque| Coverage(f32::from(u8::from(deep && opaque))))
    }
}
