//! Deep samples: per pixel, front to back, what each object does to the pixel.

use crate::image::Image;
use crate::pixel::{Coverage, Depth, Film, LinearRgb, Mix, ObjectId};

/// What one object contributes to one pixel, averaged over the pixel.
///
/// `light` and `visible` are already attenuated by what lies in front, so a picture is their plain
/// sum and a label can never disagree with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeepSample {
    /// Whose it is.
    pub object: ObjectId,
    /// Distance of the object at the pixel, metres along the optical axis.
    pub depth: Depth,
    /// Light that reaches the eye from it: held out by what is in front, exposure applied.
    pub light: LinearRgb,
    /// Its own coverage of the pixel, as if alone (amodal).
    pub alpha: f32,
    /// The part of `alpha` that is seen through what lies in front.
    pub visible: f32,
}

/// What of the place itself stands in front of objects in one pixel; the default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HoldoutSample {
    /// Share of the pixel that it fills.
    pub coverage: Coverage,
    /// How far away it is, metres along the optical axis: what is nearer is in front of it. 0 is in
    /// front of everything.
    pub depth: Depth,
}

impl HoldoutSample {
    /// Whether it hides anything of what is this far away.
    #[inline]
    pub(crate) fn hides(&self, depth: f64) -> bool {
        self.coverage.0 > 0.0 && depth > f64::from(self.depth.0)
    }
}

/// A picture of deep samples, and what the shadows leave of the surface's light.
///
/// Film hides another share in each channel: pictures with film have [`tints`](Self::tints) beside
/// the samples, whose `alpha` and `visible` are then the mean over channels. Pictures without film
/// have none and pay for none.
#[derive(Clone, Debug, Default)]
pub struct DeepImage {
    width: usize,
    height: usize,
    starts: Vec<u32>,
    samples: Vec<DeepSample>,
    /// One for each sample where there is film; else empty.
    tints: Vec<LinearRgb>,
    shadow: Image<LinearRgb>,
}

impl DeepImage {
    /// Assembles a picture from its pixels' samples, row by row, each front to back.
    ///
    /// `shadow` has the picture's size: the factor on the plate, 1 where nothing is in the way.
    ///
    /// # Panics
    /// When there is not one list per pixel of `shadow`.
    pub fn from_pixels(
        shadow: Image<LinearRgb>,
        pixels: impl IntoIterator<Item = Vec<DeepSample>>,
    ) -> Self {
        let (width, height) = shadow.size();
        let mut starts = Vec::with_capacity(width * height + 1);
        let mut samples = Vec::new();
        starts.push(0);
        for list in pixels {
            samples.extend(list);
            starts.push(samples.len() as u32);
        }
        assert_eq!(
            starts.len(),
            width * height + 1,
            "one list of samples per pixel"
        );
        Self {
            width,
            height,
            starts,
            samples,
            tints: Vec::new(),
            shadow,
        }
    }

    /// The same picture with what each sample hides, channel by channel: `visible`, of which that
    /// is the mean.
    ///
    /// In the order of the samples, pixel by pixel; none at all for a picture without film.
    ///
    /// # Panics
    /// When there is neither none nor one for each sample.
    pub fn with_tints(self, tints: Vec<LinearRgb>) -> Self {
        assert!(
            tints.is_empty() || tints.len() == self.samples.len(),
            "one tint per sample"
        );
        Self { tints, ..self }
    }

    /// Assembles a picture from samples in any order of pixels, each with its column and row; those
    /// of one pixel come front to back.
    ///
    /// `shadow` has the picture's size; `tints` come in the order of the samples, or there are
    /// none.
    ///
    /// # Panics
    /// When a sample lies outside the picture, or when there are more than `u32` can count.
    pub(crate) fn from_samples(
        shadow: Image<LinearRgb>,
        samples: impl Iterator<Item = (u32, u32, DeepSample)> + Clone,
        tints: impl Iterator<Item = LinearRgb>,
    ) -> Self {
        let (width, height) = shadow.size();
        // Starts become ends as each pixel's samples take their places.
        let mut ends = pixel_starts(width, height, samples.clone());
        let mut placed = vec![DeepSample::default(); last_start(&ends)];
        let mut tints = tints.peekable();
        let mut placed_tints = black_tints(placed.len(), tints.peek().is_some());
        for (x, y, sample) in samples {
            let place = take_place(&mut ends[y as usize * width + x as usize]);
            placed[place] = sample;
            if let Some(tint) = tints.next() {
                placed_tints[place] = tint;
            }
        }
        Self {
            width,
            height,
            starts: starts_from_ends(ends),
            samples: placed,
            tints: placed_tints,
            shadow,
        }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The samples of one pixel, front to back.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> &[DeepSample] {
        &self.samples[self.sample_range(x, y)]
    }

    /// What each sample of a pixel hides of what is behind, per channel, as far as it is itself
    /// seen; empty where no object of the picture is film: every channel is the sample's
    /// `visible` then.
    #[inline(always)]
    pub fn tints(&self, x: usize, y: usize) -> &[LinearRgb] {
        if self.tints.is_empty() {
            &[]
        } else {
            &self.tints[self.sample_range(x, y)]
        }
    }

    /// All that the objects do to one pixel: their light, and what they hide of what is behind, per
    /// channel.
    #[inline(always)]
    pub fn flat(&self, x: usize, y: usize) -> Film {
        // A sum of shares that make up a whole may miss it by a rounding.
        Film {
            color: self.light(x, y),
            opacity: self.hidden(x, y).map(|o| o.min(1.0)),
        }
    }

    /// The sum of what the samples of a pixel send to the camera.
    #[inline]
    fn light(&self, x: usize, y: usize) -> LinearRgb {
        let samples = self.at(x, y).iter();
        samples.fold(LinearRgb::BLACK, |sum, s| sum + s.light)
    }

    /// The sum of what the samples of a pixel hide of the plate.
    #[inline]
    fn hidden(&self, x: usize, y: usize) -> LinearRgb {
        match self.tints(x, y) {
            [] => LinearRgb::grey(self.at(x, y).iter().map(|s| s.visible).sum()),
            tints => tints.iter().fold(LinearRgb::BLACK, |sum, &t| sum + t),
        }
    }

    fn sample_range(&self, x: usize, y: usize) -> std::ops::Range<usize> {
        let i = y * self.width + x;
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// The same picture with other factors on the plate, computed from column, row and factor.
    pub(crate) fn map_shadow(
        self,
        f: impl Fn(usize, usize, LinearRgb) -> LinearRgb + Sync,
    ) -> Self {
        let shadow = Image::from_fn(self.width, self.height, |x, y| f(x, y, self.shadow[(x, y)]));
        Self { shadow, ..self }
    }

    /// The same picture behind what of the place stands in front: the objects are as they were
    /// (`alpha`), less of them is seen, and the plate shows in their place, without the shadows of
    /// what it hides.
    ///
    /// # Panics
    /// When the sizes differ.
    pub(crate) fn held_out(mut self, holdout: Option<&Image<HoldoutSample>>) -> Self {
        let Some(holdout) = holdout else {
            return self;
        };
        let size = (self.width, self.height);
        assert_eq!(holdout.size(), size, "holdout and picture differ in size");
        for y in 0..self.height {
            for x in 0..self.width {
                self.hold_out_pixel(x, y, &holdout[(x, y)]);
            }
        }
        self
    }

    fn hold_out_pixel(&mut self, x: usize, y: usize, place: &HoldoutSample) {
        let passes = 1.0 - place.coverage.0;
        if passes >= 1.0 {
            return;
        }
        for i in self.sample_range(x, y) {
            if place.hides(self.samples[i].depth.0.into()) {
                self.samples[i].light = self.samples[i].light.scale(passes);
                self.samples[i].visible *= passes;
                if let Some(tint) = self.tints.get_mut(i) {
                    *tint = tint.scale(passes);
                }
            }
        }
        let shadow = &mut self.shadow[(x, y)];
        *shadow = shadow
            .scale(passes)
            .add_scaled(place.coverage.0, LinearRgb::WHITE);
    }

    /// The light of one pixel over a plate, or over nothing.
    pub(crate) fn light_over(
        &self,
        x: usize,
        y: usize,
        plate: Option<&Image<LinearRgb>>,
    ) -> LinearRgb {
        let behind = plate.map_or(LinearRgb::BLACK, |plate| {
            self.shadow[(x, y)] * plate[(x, y)]
        });
        self.flat(x, y).over_color(behind)
    }

    /// The same picture with more or less light from behind some objects: what `extra` says for an
    /// object at a column and row, as far as the object and all in front of it let it pass. No more
    /// is taken away than shows there, over this plate.
    pub(crate) fn with_light_from_behind(
        mut self,
        plate: Option<&Image<LinearRgb>>,
        extra: impl Fn(ObjectId, usize, usize) -> Option<LinearRgb>,
    ) -> Self {
        for y in 0..self.height {
            for x in 0..self.width {
                let changed = |s: &DeepSample| extra(s.object, x, y).is_some();
                if self.at(x, y).iter().any(changed) {
                    let all = self.light_over(x, y, plate);
                    self.add_from_behind(self.sample_range(x, y), all, |s| extra(s.object, x, y));
                }
            }
        }
        self
    }

    /// Adds light to the samples of a pixel of which `all` is the light.
    fn add_from_behind(
        &mut self,
        samples: std::ops::Range<usize>,
        all: LinearRgb,
        extra: impl Fn(&DeepSample) -> Option<LinearRgb>,
    ) {
        let (mut behind, mut passes) = (all, LinearRgb::WHITE);
        for i in samples {
            let sample = &mut self.samples[i];
            let hidden = self.tints.get(i).copied();
            let hidden = hidden.unwrap_or(LinearRgb::grey(sample.visible));
            passes = passes.add_scaled(-1.0, hidden).map(|p| p.max(0.0));
            behind = behind
                .add_scaled(-1.0, sample.light)
                .map(|light| light.max(0.0));
            if let Some(extra) = extra(sample) {
                let change = at_least_none(behind, extra * passes);
                sample.light = sample.light + change;
            }
        }
    }

    /// The factor on the plate, per channel.
    pub fn shadow(&self) -> &Image<LinearRgb> {
        &self.shadow
    }
}

/// A change of some light that leaves none of it negative.
fn at_least_none(light: LinearRgb, change: LinearRgb) -> LinearRgb {
    let left = (light + change).map(|left| left.max(0.0));
    left.add_scaled(-1.0, light)
}

/// Where each pixel's samples start, pixel by pixel, and after the last one where they end.
fn pixel_starts(
    width: usize,
    height: usize,
    samples: impl Iterator<Item = (u32, u32, DeepSample)>,
) -> Vec<u32> {
    let mut starts = vec![0_u32; width * height + 1];
    for (x, y, _) in samples {
        starts[y as usize * width + x as usize + 1] += 1;
    }
    for i in 0..width * height {
        starts[i + 1] += starts[i];
    }
    starts
}

#[inline]
fn take_place(next: &mut u32) -> usize {
    let place = *next as usize;
    *next += 1;
    place
}

/// The start of each pixel is the end of the one before it.
fn starts_from_ends(mut ends: Vec<u32>) -> Vec<u32> {
    ends.rotate_right(1);
    ends[0] = 0;
    ends
}

fn last_start(starts: &[u32]) -> usize {
    starts.last().map_or(0, |&n| n as usize)
}

/// None where the samples have no tints.
fn black_tints(samples: usize, is_tinted: bool) -> Vec<LinearRgb> {
    vec![LinearRgb::BLACK; if is_tinted { samples } else { 0 }]
}
