//! Photos of the whole display: the rendered view, and around it what the display shows.

use super::place::{Bottle, Place};
use crate::matte::normal;
use petcomp::capture::{Display, Frame, FramePhoto, Measured, Photos, Sources, View};
use petcomp::capture::{draw_frame, measure};
use petcomp::color::srgb_to_linear;
use petcomp::geom::{Homography, Point2};
use petcomp::pixel::Mix;
use petcomp::{Image, LinearRgb, Result, Srgb8};

/// A sensor's noise: the variance of a value is `shot^2 * value + read^2`.
const SHOT: f64 = 0.006;
const READ: f64 = 0.002;

/// What captures of a place have in common.
pub(super) struct Stage<'a> {
    place: &'a Place,
    display: Display,
    /// The display switched off and white, all of the view.
    black: Image<LinearRgb>,
    white: Image<LinearRgb>,
    /// Of the view's first pixel among those of a photo.
    corner: [usize; 2],
}

impl<'a> Stage<'a> {
    pub(super) fn new(place: &'a Place) -> Result<Self> {
        let (black, white) = (place.empty("black")?, place.empty("white")?);
        let [w, h] = place.display_px.map(|side| side as usize);
        Ok(Self {
            place,
            display: Display {
                size_px: place.display_px,
                width: Some(place.display_m[0]),
            },
            corner: [(w - white.width()) / 2, (h - white.height()) / 2],
            black,
            white,
        })
    }

    /// What is measured with black and white, or with stripes as well; over the display, a pixel
    /// for each of its own.
    pub(super) fn measure(&self, bottle: &Bottle, with_stripes: bool) -> Result<Measured> {
        let frames: Vec<Frame> = Frame::all(with_stripes).collect();
        let with = self.series(&frames, |frame| {
            self.place.photo(bottle, &frame.to_string()).map(Some)
        })?;
        let [x, y, ..] = bottle.crop_px;
        let shots = Series { at: [x, y], ..with };
        let empty = self.series(&[Frame::Black, Frame::White], |_| Ok(None))?;
        let [w, h] = self.display.size_px.map(|side| side as usize);
        let view = View {
            size: (w, h),
            display_px: 1.0,
        };
        shots.with_photos(self, |photos| {
            empty.with_photos(self, |empty| measure(&self.display, &view, photos, empty))
        })
    }

    fn series(
        &self,
        frames: &[Frame],
        photo: impl Fn(Frame) -> Result<Option<Image<LinearRgb>>>,
    ) -> Result<Series> {
        let photos = frames.iter().map(|&frame| Ok((frame, photo(frame)?)));
        Ok(Series {
            at: [0, 0],
            names: frames.iter().map(|frame| format!("{frame}.jpg")).collect(),
            photos: photos.collect::<Result<_>>()?,
        })
    }

    /// A photo of the display, with a part of the view as it was photographed.
    fn whole(
        &self,
        frame: Frame,
        part: Option<(&Image<LinearRgb>, [usize; 2])>,
    ) -> Image<LinearRgb> {
        let shown = draw_frame(&self.display, frame);
        let [left, top] = self.corner.map(|side| side as f64);
        let place = &self.place.display_from_photo;
        let [w, h] = self.display.size_px.map(|side| side as usize);
        let mut photo = Image::from_fn(w, h, |x, y| {
            let view = Point2::new(x as f64 + 0.5 - left, y as f64 + 0.5 - top);
            self.bare(&shown, place, view)
        });
        let mut draw = normal(frame.number() as u64);
        for pixel in photo.pixels_mut() {
            *pixel = pixel.map(|v| noisy(v, draw()));
        }
        if let Some((part, [x, y])) = part {
            paste(&mut photo, part, [self.corner[0] + x, self.corner[1] + y]);
        }
        photo
    }

    /// The empty display at a position of the view, or beyond it as at its border.
    fn bare(&self, shown: &Image<Srgb8>, place: &Homography, view: Point2<f64>) -> LinearRgb {
        let at = place.map(view);
        let light = srgb_to_linear(f32::from(nearest(shown, at).g) / 255.0);
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

/// Photos of some frames; none in the place of one of the empty display.
struct Series {
    names: Vec<String>,
    photos: Vec<(Frame, Option<Image<LinearRgb>>)>,
    at: [usize; 2],
}

impl Series {
    fn with_photos<T>(
        &self,
        stage: &Stage<'_>,
        use_photos: impl FnOnce(&Photos<'_>) -> Result<T>,
    ) -> Result<T> {
        let read = |i: usize| {
            let (frame, part) = &self.photos[i];
            Ok(stage.whole(*frame, part.as_ref().map(|part| (part, self.at))))
        };
        let sources = Sources {
            names: &self.names,
            read: &read,
        };
        let recognised: Vec<FramePhoto> = sources.recognised(&stage.display)?;
        use_photos(&Photos {
            sources,
            recognised: &recognised,
        })
    }
}
