//! The stages in their order, and the bands of rows that run them side by side.

use super::options::KeyOptions;
use super::photo::{Keyer, Photo};
use super::rows::{Rows, Source};
use super::{Keyed, Keying};
use crate::image::Image;
use rayon::prelude::*;

/// Rows of the raw matte.
struct RawMatte<'a, P> {
    photo: &'a Image<P>,
    keyer: Keyer<'a, P>,
}

impl<P: Photo> Rows for RawMatte<'_, P> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.keyer.matte_row(y, self.photo.row(y), out);
    }
}

impl<'a, P: Photo> Keying<'a, P> {
    /// Keys with settings that are in range.
    pub(super) fn compute(&self, opts: &KeyOptions, keyed: &mut Keyed) {
        let (width, height) = self.photo.size();
        fit(&mut keyed.matte, width, height);
        fit(&mut keyed.cutout, width, height);
        if self.photo.is_empty() {
            return;
        }
        let keyer = Keyer::new(self.screen, None, opts);
        let rows = 32;
        let matte = keyed.matte.pixels_mut().par_chunks_mut(width * rows);
        let cutout = keyed.cutout.pixels_mut().par_chunks_mut(width * rows);
        matte.zip(cutout).enumerate().for_each(|(band, (matte, cutout))| {
            let mut source = self.source(keyer, opts);
            let lines = matte.chunks_exact_mut(width).zip(cutout.chunks_exact_mut(width));
            for (y, (matte, cutout)) in (band * rows..).zip(lines) {
                source.row(y, bytemuck::cast_slice_mut(matte));
                keyer.cutout_row(y, self.photo.row(y), matte, cutout);
            }
        });
    }

    fn source(&self, keyer: Keyer<'a, P>, _opts: &KeyOptions) -> Source<'a> {
        Box::new(RawMatte { photo: self.photo, keyer })
    }
}

fn fit<Q: Copy + Default>(image: &mut Image<Q>, width: usize, height: usize) {
    if image.size() != (width, height) {
        *image = Image::new(width, height);
    }
}
