//! The stages in their order, and the bands of rows that run them side by side.

use super::box_blur::box_blurred;
use super::chroma::ChromaBlur;
use super::dilate::Dilate;
use super::edge::{Clip, Edges};
use super::feather::Feather;
use super::limits::{Clamp, Core, Garbage};
use super::model::Behaviour;
use super::options::{KeyOptions, Profile};
use super::photo::{Keyer, Photo};
use super::robust;
use super::rows::{Rows, Source};
use super::{Deviations, Keying};
use crate::image::{Image, ImageView};
use crate::pixel::{Coverage, PremulRgba};
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rows a band has at least, where there are as many.
const MIN_BAND_ROWS: usize = 16;
/// Rows a band has for every row that it must compute beyond itself.
const BAND_PER_HALO: usize = 6;

/// Rows of the raw matte.
struct RawMatte<'a, P> {
    photo: ImageView<'a, P>,
    /// The photo's colour differences, where they are blurred.
    blur: Option<ChromaBlur<'a, P>>,
    keyer: Keyer<'a, P>,
}

impl<P: Photo> Rows for RawMatte<'_, P> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let pixels = self.photo.row(y);
        match &mut self.blur {
            Some(blur) => self.keyer.recolored_matte_row(y, pixels, blur.row(y), out),
            None => self.keyer.matte_row(y, pixels, out),
        }
    }
}

/// Which of the keyer's planes is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Plane {
    /// The finished matte.
    Matte,
    /// The edges that the levels leave alone.
    Edges,
}

/// A keying whose screen is settled: all that the bands share.
pub(super) struct Stream<'a, P> {
    keying: Keying<'a, P>,
    channel: Option<usize>,
    options: &'a KeyOptions,
    clamped: AtomicUsize,
}

impl<'a, P: Photo> Stream<'a, P> {
    /// A keying whose primary channel is given where it does not follow each pixel's own key.
    pub(super) fn new(
        keying: Keying<'a, P>,
        channel: Option<usize>,
        options: &'a KeyOptions,
    ) -> Self {
        Self {
            keying,
            channel,
            options,
            clamped: AtomicUsize::new(0),
        }
    }

    /// Computes a plane, and the cut-out that it makes unless the picture for it is empty.
    pub(super) fn compute_plane(
        &self,
        plane: Plane,
        matte: &mut Image<Coverage>,
        cutout: &mut Image<PremulRgba>,
    ) -> Deviations {
        let (width, height) = self.keying.photo.size();
        fit_size(matte, width, height);
        if matte.is_empty() {
            return Deviations::default();
        }
        let rows = self.band_rows(height);
        let bands = matte.pixels_mut().par_chunks_mut(width * rows).enumerate();
        let cutouts = bands_of(cutout, width * rows, height.div_ceil(rows));
        let seen = bands.zip(cutouts).map(|((band, matte), cutout)| {
            let (first, count) = (band * rows, matte.len() / width);
            self.compute_band(plane, first, matte, cutout);
            robust::count_unusable(&self.keying, self.options, first..first + count)
        });
        // Nothing is computed, and nothing clamped, before the sum.
        let unusable: Deviations = seen.sum();
        Deviations {
            clamped: self.clamped.load(Ordering::Relaxed),
            ..unusable
        }
    }

    fn compute_band(
        &self,
        plane: Plane,
        first: usize,
        matte: &mut [Coverage],
        cutout: &mut [PremulRgba],
    ) {
        let width = self.keying.photo.width();
        let mut plane = match plane {
            Plane::Matte => self.finished_matte(),
            Plane::Edges => self.edge_plane(),
        };
        let keyer = self.keyer();
        let mut cutout = cutout.chunks_exact_mut(width);
        for (y, matte) in (first..).zip(matte.chunks_exact_mut(width)) {
            plane.row(y, bytemuck::cast_slice_mut(matte));
            if let Some(cutout) = cutout.next() {
                keyer.cutout_row(y, self.keying.photo.row(y), matte, cutout);
            }
        }
    }

    /// A band starts by computing the rows above it that its windows reach; longer bands do so less
    /// often.
    fn band_rows(&self, height: usize) -> usize {
        let threads = rayon::current_num_threads();
        let least = (self.halo_rows() * BAND_PER_HALO).max(MIN_BAND_ROWS);
        let rounds = height / (threads * least);
        height.div_ceil(threads * rounds.max(1)).max(1)
    }

    /// Rows above a band that its windows reach.
    fn halo_rows(&self) -> usize {
        let o = self.options;
        let distances = o.dilate_distance.unsigned_abs() + o.feather_distance.unsigned_abs();
        (o.blur_pre + o.edge_kernel_radius + o.blur_post + distances) as usize
    }

    fn keyer(&self) -> Keyer<'a, P> {
        Keyer::new(self.keying.screen, self.channel, self.options)
    }

    fn raw_matte(&self) -> Source<'_> {
        let (photo, options) = (self.keying.photo, self.options);
        Box::new(RawMatte {
            photo,
            blur: (options.blur_pre > 0).then(|| ChromaBlur::new(photo, options)),
            keyer: self.keyer(),
        })
    }

    fn clipped_matte(&self) -> Source<'_> {
        let raw = self.raw_matte();
        if Clip::is_wanted(self.options) {
            Box::new(Clip::new(raw, self.size(), self.options))
        } else {
            raw
        }
    }

    /// The edges: Blender up to 4.3 looks for them in the clipped matte, later ones in the raw one.
    fn edge_plane(&self) -> Source<'_> {
        let searched = match self.behaviour() {
            Behaviour::V34 | Behaviour::V42 => self.clipped_matte(),
            Behaviour::V45 => self.raw_matte(),
        };
        Box::new(Edges::new(searched, self.size(), self.options))
    }

    fn limited_matte(&self) -> Source<'_> {
        let Keying { garbage, core, .. } = self.keying;
        let (behaviour, careful) = (self.behaviour(), self.options.profile == Profile::Robust);
        let mut source = self.clipped_matte();
        let needs_core = core.is_some() || (garbage.is_some() && behaviour == Behaviour::V45);
        if let Some(garbage) = garbage {
            source = Box::new(Garbage {
                source,
                garbage,
                behaviour,
                careful,
            });
        }
        // Blender 4.5 applies a core matte of 0 where none is given, which matters below a garbage
        // matte above 1.
        if needs_core {
            source = Box::new(Core {
                source,
                core,
                behaviour,
                careful,
            });
        }
        source
    }

    /// The finished matte.
    fn finished_matte(&self) -> Source<'_> {
        let (o, size) = (self.options, self.size());
        let mut source = self.limited_matte();
        if o.blur_post > 0 {
            source = box_blurred(source, o, o.blur_post, size);
        }
        if o.dilate_distance != 0 {
            source = Box::new(Dilate::new(source, size, o));
        }
        if o.feather_distance != 0 {
            source = Box::new(Feather::new(source, size, o));
        }
        if o.profile == Profile::Robust {
            source = Box::new(Clamp {
                source,
                clamped: &self.clamped,
            });
        }
        source
    }

    fn behaviour(&self) -> Behaviour {
        self.options.profile.behaviour()
    }

    fn size(&self) -> (usize, usize) {
        self.keying.photo.size()
    }
}

/// Makes a picture that size, keeping it where it is. Its memory is first touched by the threads
/// that fill it: making 4K pictures on one thread takes several times as long as keying.
pub(super) fn fit_size<Q: Zeroable + Copy>(image: &mut Image<Q>, width: usize, height: usize) {
    if image.size() != (width, height) {
        *image = Image::from_vec(
            width,
            height,
            bytemuck::allocation::zeroed_vec(width * height),
        );
    }
}

/// A picture in bands of that many pixels; empty bands for an empty picture.
fn bands_of(image: &mut Image<PremulRgba>, pixels: usize, count: usize) -> Vec<&mut [PremulRgba]> {
    if image.is_empty() {
        (0..count).map(|_| <&mut [PremulRgba]>::default()).collect()
    } else {
        image.pixels_mut().chunks_mut(pixels).collect()
    }
}
