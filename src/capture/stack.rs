//! All photos of a capture: aligned, equally exposed, seen from above.

use super::display::Display;
use super::draw::PAPER_LIGHT;
use super::frame::{Frame, SHIFTS, Stripes};
use super::object::MIN_AREA;
use super::recognise::{FramePhoto, map_in_front, refused};
use super::view::{View, clipped};
use crate::bounds::above;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::Homography;
use crate::image::{Image, Mask};
use crate::pixel::{LinearRgb, Mix};
use rayon::prelude::*;

/// Photos that are read on demand.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Their names in messages.
    pub names: &'a [String],
    /// Reads one, scene-linear.
    pub read: &'a (dyn Fn(usize) -> Result<Image<LinearRgb>> + Sync),
}

impl Sources<'_> {
    /// Which frame each shows, and where; so many are read at once, since each is large.
    ///
    /// # Errors
    /// Those of reading, and of [`FramePhoto::read`], naming the photo.
    pub fn recognised(&self, display: &Display, at_once: usize) -> Result<Vec<FramePhoto>> {
        let numbers: Vec<usize> = (0..self.names.len()).collect();
        let mut all = Vec::with_capacity(numbers.len());
        for some in numbers.chunks(at_once.max(1)) {
            let some = some.par_iter().map(|&i| self.recognise(i, display));
            all.extend(some.collect::<Result<Vec<_>>>()?);
        }
        Ok(all)
    }

    fn recognise(&self, i: usize, display: &Display) -> Result<FramePhoto> {
        FramePhoto::read(&(self.read)(i)?, display).map_err(|e| self.named(i, e))
    }

    fn named(&self, i: usize, error: Error) -> Error {
        match error {
            Error::Photo { what } => refused(&format!("{}: {what}", self.names[i])),
            other => other,
        }
    }
}

/// The photos of a capture, and what is known about each.
pub struct Photos<'a> {
    /// Where their pixels are.
    pub sources: Sources<'a>,
    /// What each shows.
    pub recognised: &'a [FramePhoto],
}

/// What the display shows with the object or without, as a camera above sees it.
pub(super) struct Stack {
    pub(super) black: Image<LinearRgb>,
    pub(super) white: Image<LinearRgb>,
    /// Grey light of each photo of black, after its name.
    pub(super) each_black: Vec<(String, Image<f32>)>,
    /// Where each photo of white is clipped, after its name.
    pub(super) clipped_white: Vec<(String, Mask)>,
    /// Nothing where photos of some are missing.
    pub(super) stripes: StripeStack,
}

/// What is seen of the stripes.
#[derive(Default)]
pub(super) struct StripeStack {
    pub(super) light: StripeLight,
    /// Mean of all of them.
    pub(super) mean: Image<LinearRgb>,
}

impl StripeStack {
    pub(super) fn is_empty(&self) -> bool {
        self.mean.is_empty()
    }

    fn add(&mut self, stripes: Stripes, seen: &Image<LinearRgb>) {
        if self.is_empty() {
            self.mean = seen.map(|_| LinearRgb::BLACK);
        }
        let share = 1.0 / Stripes::COUNT as f32;
        self.mean = self.mean.zip_map(seen, |sum, p| sum.add_scaled(share, p));
        let axes = &mut self.light[usize::from(stripes.is_fine)];
        axes[stripes.axis][stripes.shift] = seen.map(LinearRgb::mean);
    }
}

/// Grey light of the stripes, by period (coarse first) and axis, each with its four shifts.
pub(super) type StripeLight = [[[Image<f32>; SHIFTS]; 2]; 2];

/// Motion of the display in the photos up to which the camera stood still: noise of the markers.
const STEADY_PX: f64 = 0.5;
/// Exposures that differ by more are worth a warning.
const MAX_DRIFT: f32 = 0.2;
/// Photos of one frame that differ by more of its white show different things.
const MAX_DIFFERENCE: f32 = 0.1;
/// Blur of that difference, pixels: against noise, and edges that are aligned to a part of a pixel.
pub(super) const DIFFERENCE_BLUR_PX: f32 = 3.0;

/// How photos are brought to the view.
pub(super) struct Alignment<'a> {
    display: &'a Display,
    view: View,
    /// The photo whose exposure all others get.
    reference: &'a FramePhoto,
    /// One map for all photos, where the camera stood still.
    steady: Option<Homography>,
    /// Largest motion of the display between photos, pixels.
    pub(super) motion_px: f64,
}

impl<'a> Alignment<'a> {
    /// For all photos of a capture, the first list with the white frame that is the reference.
    pub(super) fn new(
        display: &'a Display,
        view: View,
        reference: &'a FramePhoto,
        all: &[&FramePhoto],
    ) -> Self {
        let motions = all.iter().map(|photo| photo.motion_px(reference, display));
        let motion_px = motions.fold(0.0, f64::max);
        // What was turned has another map, though the camera stood still.
        let offsets = all.iter().map(|photo| photo.offset_px(reference, display));
        let is_steady = offsets.fold(0.0, f64::max) <= STEADY_PX;
        let pairs: Vec<_> = all.iter().flat_map(|photo| &photo.pairs).copied().collect();
        let steady = is_steady.then(|| map_in_front(&pairs)).flatten();
        Self {
            display,
            view,
            reference,
            steady,
            motion_px,
        }
    }

    /// A photo in the view, exposed as the reference, and where it is clipped.
    fn aligned(&self, photos: &Photos<'_>, i: usize) -> Result<(Image<LinearRgb>, Mask)> {
        let photo = &photos.recognised[i];
        let map = self.steady.unwrap_or(photo.photo_from_display);
        let [r, g, b] = photo.exposure_to(self.reference);
        let seen = self.view.seen((photos.sources.read)(i)?, &map);
        // Of the photo as it was exposed.
        let clipped = clipped(&seen);
        let light = seen.map(|p| LinearRgb::new(r * p.r, g * p.g, b * p.b));
        Ok((light, clipped))
    }

    /// The mean of all photos of a frame; none where there is none.
    ///
    /// # Errors
    /// Those of reading; [`Error::Photo`] where they show different things.
    fn frame(&self, photos: &Photos<'_>, frame: Frame) -> Result<Option<SeenFrame>> {
        let numbers = photos.of_frame(frame);
        let Some((&first, others)) = numbers.split_first() else {
            return Ok(None);
        };
        let name = |i: usize| photos.sources.names[i].clone();
        let (first_seen, mask) = self.aligned(photos, first)?;
        let mut clipped = vec![(name(first), mask)];
        let mut each = vec![(name(first), first_seen.map(LinearRgb::mean))];
        let mut sum = first_seen.clone();
        for &other in others {
            let (seen, mask) = self.aligned(photos, other)?;
            if self.differ(&first_seen, &seen) {
                return Err(differing([first, other].map(|i| &*photos.sources.names[i])));
            }
            clipped.push((name(other), mask));
            each.push((name(other), seen.map(LinearRgb::mean)));
            sum = sum.zip_map(&seen, |a, b| a + b);
        }
        let share = 1.0 / numbers.len() as f32;
        Ok(Some(SeenFrame {
            light: sum.map(|p| p.scale(share)),
            each,
            clipped,
        }))
    }

    /// Two photos of a frame differ as with an object and without.
    fn differ(&self, a: &Image<LinearRgb>, b: &Image<LinearRgb>) -> bool {
        let off = a.zip_map(b, |a, b| a.mean() - b.mean());
        let most = MAX_DIFFERENCE * white_light(self.reference);
        // The edges of markers differ most where photos are aligned to half a pixel only.
        let free = self.view.free_area(self.display);
        let differing = filter::gaussian_blur(&off, DIFFERENCE_BLUR_PX)
            .zip_map(&free, |v, free| free && v.abs() > most);
        differing.count() as f64 > MIN_AREA * differing.pixels().len() as f64
    }

    /// All photos of a capture.
    ///
    /// # Errors
    /// Those of reading; [`Error::Photo`] without a black or a white frame, or where photos of a
    /// frame show different things.
    pub(super) fn stack(&self, photos: &Photos<'_>) -> Result<Stack> {
        let black = self.needed(photos, Frame::Black)?;
        let white = self.needed(photos, Frame::White)?;
        Ok(Stack {
            black: black.light,
            white: white.light,
            each_black: black.each,
            clipped_white: white.clipped,
            stripes: self.stripes(photos)?,
        })
    }

    fn needed(&self, photos: &Photos<'_>, frame: Frame) -> Result<SeenFrame> {
        self.frame(photos, frame)?.ok_or_else(|| {
            let names = photos.sources.names.join(", ");
            refused(&format!(
                "no photo of the {frame} frame among {names}; expected at least black and white"
            ))
        })
    }

    /// The stripes, where there are photos of all of them.
    fn stripes(&self, photos: &Photos<'_>) -> Result<StripeStack> {
        let mut stack = StripeStack::default();
        if !photos.missing_stripes().is_empty() {
            return Ok(stack);
        }
        for stripes in Stripes::all() {
            if let Some(seen) = self.frame(photos, Frame::Stripes(stripes))? {
                stack.add(stripes, &seen.light);
            }
        }
        Ok(stack)
    }
}

/// The photos of a frame in the view.
struct SeenFrame {
    /// Their mean.
    light: Image<LinearRgb>,
    /// Grey light of each of them, by its name.
    each: Vec<(String, Image<f32>)>,
    /// Where each of them is clipped, by its name.
    clipped: Vec<(String, Mask)>,
}

impl Photos<'_> {
    fn of_frame(&self, frame: Frame) -> Vec<usize> {
        let photos = self.recognised.iter().enumerate();
        photos
            .filter(|(_, photo)| photo.frame == frame)
            .map(|(i, _)| i)
            .collect()
    }

    /// The first photo of a frame.
    pub fn first_of(&self, frame: Frame) -> Option<&FramePhoto> {
        self.recognised.iter().find(|photo| photo.frame == frame)
    }

    /// The stripes that no photo shows.
    pub(super) fn missing_stripes(&self) -> Vec<Frame> {
        let stripes = Frame::all(true).filter(|frame| matches!(frame, Frame::Stripes(_)));
        stripes
            .filter(|frame| self.first_of(*frame).is_none())
            .collect()
    }

    /// Some stripes were photographed, but not all.
    pub(super) fn incomplete_stripes(&self) -> Option<Diagnostic> {
        let missing = self.missing_stripes();
        let some = self
            .recognised
            .iter()
            .any(|photo| matches!(photo.frame, Frame::Stripes(_)));
        (some && !missing.is_empty()).then(|| {
            let names: Vec<_> = missing.iter().map(ToString::to_string).collect();
            let what = format!(
                "no photo of {}: refraction is not measured; photograph them, too",
                names.join(", ")
            );
            Diagnostic::warning(Code::MissingFrames, what)
        })
    }

    /// Exposures that differ much from that of the reference.
    pub(super) fn drifts(&self, reference: &FramePhoto) -> Vec<Diagnostic> {
        let photos = self.recognised.iter().zip(self.sources.names);
        let warnings = photos.filter_map(|(photo, name)| {
            let drifts = photo.exposure_to(reference).map(|f| (f - 1.0).abs());
            let drift = drifts.into_iter().fold(0.0, f32::max);
            (drift > MAX_DRIFT).then(|| drift_warning(name, drift))
        });
        warnings.collect()
    }
}

/// Grey light of the display's white, by the paper of its markers.
fn white_light(photo: &FramePhoto) -> f32 {
    let papers = photo.paper.iter().flatten();
    let (sum, count) = papers.fold((0.0, 0.0), |(sum, n), paper| (sum + paper.mean(), n + 1.0));
    sum / f32::max(count, 1.0) / PAPER_LIGHT
}

fn differing([a, b]: [&str; 2]) -> Error {
    refused(&format!(
        "{a} and {b} show the same frame but differ by more than {:.0} % of white; \
         photos without the object belong in empty (--empty), and neither the object nor the light may move",
        100.0 * MAX_DIFFERENCE
    ))
}

fn drift_warning(photo: &str, drift: f32) -> Diagnostic {
    let what = format!(
        "{photo}: its exposure or colour differs by {} % from the white frame, expected at most {:.0} %; \
         lock exposure and white balance, and switch the display's automatic brightness off",
        above(100.0 * drift, 100.0 * MAX_DRIFT),
        100.0 * MAX_DRIFT
    );
    Diagnostic::warning(Code::ExposureDrift, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_above_the_limit_is_told_as_one() {
        for (drift, off) in [(0.204, "20.4"), (0.2001, "20.1")] {
            let told = drift_warning("a.jpg", drift).message;
            let expected =
                format!("differs by {off} % from the white frame, expected at most 20 %");
            assert!(told.contains(&expected), "{told}");
        }
    }
}
