//! Photos of the whole display: the rendered view, and around it what the display shows.

use super::place::{Bottle, Place};
use crate::matte::normal;
use petcomp::Mix;
use petcomp::capture::{Display, Frame, Measured, Photos, Sources, View};
use petcomp::capture::{draw_frame, measure};
use petcomp::color::srgb_to_linear;
use petcomp::geom::{Homography, Point2};
use petcomp::{Image, LinearRgb, Result, Srgb8};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A sensor's noise: the variance of a value is `shot^2 * value + read^2`.
const SHOT: f64 = 0.006;
const READ: f64 = 0.002;
/// Samples per side of a pixel that shown pictures are averaged over.
const PARTS: usize = 4;

/// What the captures of a place have in common.
pub(super) struct Stage<'a> {
    place: &'a Place,
    display: Display,
    /// Photos of the whole display without a bottle.
    empty: BTreeMap<Frame, Image<LinearRgb>>,
    /// Position of the view's first pixel in a photo.
    corner: [usize; 2],
}

impl<'a> Stage<'a> {
    pub(super) fn new(place: &'a Place) -> Result<Self> {
        let view = EmptyView::new(place)?;
        let with_stripes = place.bottles.iter().any(|bottle| bottle.with_stripes);
        let frames: Vec<Frame> = Frame::all(with_stripes).collect();
        let empty = frames.par_iter().map(|&frame| (frame, view.whole(frame)));
        Ok(Self {
            place,
            empty: empty.collect(),
            display: view.display,
            corner: view.corner,
        })
    }

    /// Measurement with black and white, or also with stripes; over the display, one pixel per
    /// pixel of its own.
    pub(super) fn measure(&self, bottle: &Bottle, with_stripes: bool) -> Result<Measured> {
        let shots = self.series(with_stripes, |frame| self.shot(bottle, frame))?;
        let empty = self.series(false, |frame| Ok(self.empty[&frame].clone()))?;
        let [w, h] = self.display.size_px.map(|side| side as usize);
        let view = View {
            size: (w, h),
            display_px: 1.0,
        };
        shots.with_photos(&self.display, |shots| {
            empty.with_photos(&self.display, |empty| {
                measure(&self.display, &view, shots, empty)
            })
        })
    }

    /// A photo of a bottle on the whole display.
    fn shot(&self, bottle: &Bottle, frame: Frame) -> Result<Image<LinearRgb>> {
        let part = self.place.photo(bottle, &frame.to_string())?;
        let [x, y, ..] = bottle.crop_px;
        let mut photo = self.empty[&frame].clone();
        paste(&mut photo, &part, [self.corner[0] + x, self.corner[1] + y]);
        Ok(photo)
    }

    fn series(
        &self,
        with_stripes: bool,
        photo: impl Fn(Frame) -> Result<Image<LinearRgb>>,
    ) -> Result<Series> {
        let frames: Vec<Frame> = Frame::all(with_stripes).collect();
        let photos = frames.iter().map(|&frame| photo(frame));
        Ok(Series {
            names: frames.iter().map(|frame| format!("{frame}.jpg")).collect(),
            photos: photos.collect::<Result<_>>()?,
        })
    }
}

/// The display without a bottle, as far as it was rendered.
struct EmptyView {
    display: Display,
    display_from_photo: Homography,
    /// Switched off and white, all of the view.
    black: Image<LinearRgb>,
    white: Image<LinearRgb>,
    corner: [usize; 2],
}

impl EmptyView {
    fn new(place: &Place) -> Result<Self> {
        let (black, white) = (place.empty("black")?, place.empty("white")?);
        let [w, h] = place.display_px.map(|side| side as usize);
        Ok(Self {
            display: Display {
                size_px: place.display_px,
                width: Some(place.display_m[0]),
            },
            display_from_photo: place.display_from_photo(),
            corner: [(w - white.width()) / 2, (h - white.height()) / 2],
            black,
            white,
        })
    }

    /// A photo of the whole display that shows a frame.
    fn whole(&self, frame: Frame) -> Image<LinearRgb> {
        let shown = draw_frame(&self.display, frame);
        let [left, top] = self.corner.map(|side| side as f64);
        let [w, h] = self.display.size_px.map(|side| side as usize);
        let mut photo = Image::from_fn(w, h, |x, y| {
            let view = Point2::new(x as f64 + 0.5 - left, y as f64 + 0.5 - top);
            self.at(&shown, view)
        });
        let mut draw = normal(frame.number() as u64);
        for pixel in photo.pixels_mut() {
            *pixel = pixel.map(|v| noisy(v, draw()));
        }
        photo
    }

    /// Brightness of the shown picture in a pixel, as a share of white: the mean of its samples, as
    /// a camera sees it. Markers found in point-sampled pixels would be off by a fraction of a
    /// pixel.
    fn shown_light(&self, shown: &Image<Srgb8>, middle: Point2<f64>) -> f32 {
        let offset = |i: usize| (i as f64 + 0.5) / PARTS as f64 - 0.5;
        let parts = (0..PARTS * PARTS).map(|i| {
            let part = Point2::new(middle.x + offset(i % PARTS), middle.y + offset(i / PARTS));
            let code = nearest(shown, self.display_from_photo.map(part)).g;
            srgb_to_linear(f32::from(code) / 255.0)
        });
        parts.sum::<f32>() / (PARTS * PARTS) as f32
    }

    /// The light at a position of the view, clamped to its border.
    fn at(&self, shown: &Image<Srgb8>, view: Point2<f64>) -> LinearRgb {
        let light = self.shown_light(shown, view);
        let [black, white] = [&self.black, &self.white].map(|empty| nearest(empty, view));
        black.scale(1.0 - light).add_scaled(light, white)
    }
}

fn noisy(value: f32, normal: f64) -> f32 {
    let deviation = (SHOT * SHOT * f64::from(value.max(0.0)) + READ * READ).sqrt();
    (f64::from(value) + deviation * normal).clamp(0.0, 1.0) as f32
}

fn nearest<P: Copy + Default>(image: &Image<P>, at: Point2<f64>) -> P {
    image.nearest(at.x.floor() as isize, at.y.floor() as isize)
}

fn paste(photo: &mut Image<LinearRgb>, part: &Image<LinearRgb>, [x, y]: [usize; 2]) {
    for (row, pixels) in part.rows().enumerate() {
        photo.row_mut(y + row)[x..x + part.width()].copy_from_slice(pixels);
    }
}

/// Photos of some frames.
struct Series {
    names: Vec<String>,
    photos: Vec<Image<LinearRgb>>,
}

impl Series {
    fn with_photos<T>(
        &self,
        display: &Display,
        use_photos: impl FnOnce(&Photos<'_>) -> Result<T>,
    ) -> Result<T> {
        let read = |i: usize| Ok(self.photos[i].clone());
        let sources = Sources {
            names: &self.names,
            read: &read,
        };
        let recognised = sources.recognised(display, usize::MAX)?;
        use_photos(&Photos {
            sources,
            recognised: &recognised,
        })
    }
}
