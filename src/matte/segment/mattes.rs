//! Garbage and core mattes for a keyer, from a segmentation.

use super::Segmentation;
use crate::filter;
use crate::image::Image;
use crate::matte::screen::strongest_channel;
use crate::pixel::{Coverage, LinearRgb};

/// Width of the zone around the outline that is left to the keyer, pixels of the search: what an
/// outline may be wrong.
const GARBAGE_MARGIN_PX: f64 = 2.0;
/// Least depth of core pixels below the outline, pixels: beyond the blur of a lens.
const CORE_DEPTH_PX: f64 = 2.0;
/// A pixel with so little of the screen's strongest channel lets no more than that through.
const CORE_TRANSMITTANCE: f32 = 0.1;

impl Segmentation {
    /// Garbage and core matte of a photo on a screen plate, as a keyer takes them: what it leaves
    /// of the screen beside the object goes, and what surely lets nothing through stays.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn mattes(
        &self,
        photo: &Image<LinearRgb>,
        plate: &Image<LinearRgb>,
    ) -> [Image<Coverage>; 2] {
        let margin_px = GARBAGE_MARGIN_PX * self.reduction.max(1.0);
        let near = filter::dilate(&self.tight.map(|c| c.0 > 0.0), margin_px);
        [near.complement().to_coverage(), self.core(photo, plate)]
    }

    /// Core matte: 1 where the object is surely opaque, given the photo and its screen plate.
    ///
    /// # Method
    /// Reflected light is not negative, so from `photo = F + T plate` follows `T <= photo / plate`
    /// in every channel; where the screen is strongest, that is below a tenth in the core.
    fn core(&self, photo: &Image<LinearRgb>, plate: &Image<LinearRgb>) -> Image<Coverage> {
        let deep = filter::erode(&self.tight.map(|c| c.0 >= 1.0), CORE_DEPTH_PX);
        let opaque = photo.zip_map(plate, |p, k| {
            let c = strongest_channel(k);
            p.channels()[c] < CORE_TRANSMITTANCE * k.channels()[c]
        });
        deep.zip_map(&opaque, |deep, opaque| deep && opaque)
            .to_coverage()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matte::key::{KeyOptions, Keying, Screen};
    use crate::matte::segment::{SegmentOptions, segment};

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    /// A slab with its corner at (40, 30), red on the left and clear film on the right, and a stain
    /// on the screen.
    fn photo() -> Image<LinearRgb> {
        Image::from_fn(160, 100, |x, y| match (x, y) {
            (40..80, 30..70) => LinearRgb::new(0.5, 0.02, 0.02),
            (80..120, 30..70) => GREEN.scale(0.6) + LinearRgb::grey(0.02),
            (0..4, 0..4) => LinearRgb::grey(0.2),
            _ => GREEN,
        })
    }

    #[test]
    fn garbage_is_the_screen_and_core_is_what_is_opaque() {
        let photo = photo();
        let found = segment(&photo, &SegmentOptions::default()).unwrap();
        let [garbage, core] = found.mattes(&photo, &Image::filled(160, 100, GREEN));
        assert_eq!(
            (garbage[(2, 2)].0, garbage[(60, 50)].0, garbage[(100, 50)].0),
            (1.0, 0.0, 0.0)
        );
        assert_eq!(
            (core[(2, 2)].0, core[(60, 50)].0, core[(100, 50)].0),
            (0.0, 1.0, 0.0)
        );
        assert!(
            garbage
                .pixels()
                .iter()
                .zip(core.pixels())
                .all(|(g, c)| g.0 + c.0 <= 1.0),
            "no pixel is both"
        );
    }

    #[test]
    fn a_keyer_with_both_leaves_no_stain() {
        let photo = photo();
        let found = segment(&photo, &SegmentOptions::default()).unwrap();
        let [garbage, core] = found.mattes(&photo, &Image::filled(160, 100, GREEN));
        let job = Keying::new(&photo, Screen::Color(GREEN));
        let stain =
            |job: &Keying<'_, LinearRgb>| job.run(&KeyOptions::default()).unwrap().matte[(2, 2)].0;
        assert!(stain(&job) > 0.5);
        assert_eq!(stain(&job.with_garbage(&garbage).with_core(&core)), 0.0);
    }
}
