//! The light that an object on a display lets through, reflects and bends.

use super::bend::{BendInput, Refraction};
use super::check;
use super::display::Display;
use super::frame::Frame;
use super::object::{Object, evidence};
use super::recognise::{FramePhoto, refused};
use super::solve::{BlackAndWhite, FilmInput, NoiseModel};
use super::stack::{Alignment, Photos, Stack};
use super::stripes::SeenStripes;
use super::view::View;
use crate::diagnostic::Diagnostic;
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::{Outline, PlateOptions, ScreenPlate, mean_color};
use crate::pixel::{Coverage, Film, LinearRgb};

/// An object as it was measured, over the whole display seen from above.
pub struct Measured {
    /// Reflected light and transmittance of the line of sight; empty outside the object.
    pub film: Image<Film>,
    /// Standard deviation of the transmittance in its least certain channel; 0 outside.
    pub sigma: Image<f32>,
    /// Border of the object.
    pub outline: Outline,
    /// Share of the border at which the object stands out well.
    pub distinct: f64,
    /// Mean light of white over black.
    pub light: LinearRgb,
    /// How uneven that is: 1 minus darkest over brightest.
    pub unevenness: f32,
    /// How lines of sight are bent, where stripes were photographed.
    pub refraction: Option<Refraction>,
    /// Notes and warnings about the capture.
    pub diagnostics: Vec<Diagnostic>,
}

/// Pixels around the object that may show something of it.
const OBJECT_MARGIN_PX: f64 = 6.0;
/// The film is kept so far beyond the outline, pixels: blur.
const KEPT_RIM_PX: f64 = 1.5;
/// Softness of the end of that, standard deviation in pixels.
const RIM_SOFTNESS_PX: f32 = 0.6;

/// Solves for the object that the photos of a capture show; `empty` are photos without it, if
/// any.
///
/// # Errors
/// Those of reading photos; [`Error::Photo`](crate::Error::Photo) where the black or the white
/// frame is missing, photos of a frame show different things, white is clipped or uneven, no object
/// or more than one lies within the display, one of several black photos lacks it, or photos with
/// and without it are swapped.
pub fn measure(
    display: &Display,
    view: &View,
    photos: &Photos<'_>,
    empty: &Photos<'_>,
) -> Result<Measured> {
    let reference = photos
        .first_of(Frame::White)
        .ok_or_else(|| refused("no photo of the white frame"))?;
    let all: Vec<&FramePhoto> = photos.recognised.iter().chain(empty.recognised).collect();
    let alignment = Alignment::new(display, *view, reference, &all);
    let stack = alignment.stack(photos)?;
    let empty_stack = match empty.recognised {
        [] => None,
        _ => Some(alignment.stack(empty)?),
    };
    let mut diagnostics: Vec<Diagnostic> = photos.drifts(reference);
    diagnostics.extend(empty.drifts(reference));
    diagnostics.extend(photos.incomplete_stripes());
    diagnostics.extend(check::camera_motion(alignment.motion_px));
    let area = view.free_area(display);
    if let Some(empty) = &empty_stack {
        diagnostics.extend(check::clipping(&empty.clipped_white, &area)?);
    }
    let scene = CaptureScene::new(display, view, &stack, empty_stack.as_ref());
    let scene = scene.or_else(|error| {
        // What is clipped looks otherwise than the empty display.
        check::clipping(&stack.clipped_white, &area)?;
        Err(error)
    })?;
    scene.solve(diagnostics)
}

/// All that is seen, and where the object is in it.
struct CaptureScene<'a> {
    display: &'a Display,
    view: &'a View,
    stack: &'a Stack,
    empty_stack: Option<&'a Stack>,
    /// The display without the object.
    empty: EmptyDisplay,
    object: Object,
    /// What surely shows the empty display.
    free: Mask,
}

impl<'a> CaptureScene<'a> {
    fn new(
        display: &'a Display,
        view: &'a View,
        stack: &'a Stack,
        empty_stack: Option<&'a Stack>,
    ) -> Result<Self> {
        let area = view.free_area(display);
        let found = |free: &Mask| -> Result<(EmptyDisplay, Object, Image<f32>)> {
            let empty = EmptyDisplay::new(stack, empty_stack, free)?;
            let evidence = evidence([&stack.black, &stack.white], [&empty.black, &empty.white]);
            let object = Object::find(&evidence, &area)?;
            Ok((empty, object, evidence))
        };
        // Once with all of the display, which the object shades a little, once without the object.
        let (_, rough, _) = found(&area)?;
        let (empty, object, evidence) = found(&without(&area, &rough))?;
        object.check_alone(&evidence)?;
        Ok(Self {
            display,
            view,
            stack,
            empty_stack,
            empty,
            free: without(&area, &object),
            object,
        })
    }

    fn frames(&self) -> BlackAndWhite<'_> {
        BlackAndWhite {
            black: &self.stack.black,
            white: &self.stack.white,
            empty_black: &self.empty.black,
            empty_white: &self.empty.white,
        }
    }

    fn solve(self, mut diagnostics: Vec<Diagnostic>) -> Result<Measured> {
        let frames = self.frames();
        let each_black = &self.stack.each_black;
        check::black_without_object(each_black, &frames, &self.object.coverage, &self.free)?;
        let clipped = &self.stack.clipped_white;
        diagnostics.extend(check::clipping(clipped, &self.free)?);
        diagnostics.extend(check::clipped_object(clipped, &self.object.coverage)?);
        if self.empty_stack.is_some() {
            check::exchange(&frames, &self.object.coverage)?;
        }
        diagnostics.extend(check::bands(&frames, &self.free)?);
        diagnostics.extend(check::color_change(frames.empty_white, &self.free));
        let solved = self.film_input().solve(&self.kept());
        let film = solved.film;
        let refraction = self.refraction(&film, &mut diagnostics);
        let light = frames.light();
        Ok(Measured {
            sigma: solved.sigma,
            distinct: self.object.distinct,
            light: mean_where(&light, &self.free),
            unevenness: unevenness(&light, &self.free),
            outline: self.object.outline,
            film,
            refraction,
            diagnostics,
        })
    }

    fn film_input(&self) -> FilmInput<'_> {
        FilmInput {
            frames: self.frames(),
            stripes: &self.stack.stripes.mean,
            noise: self.noise(),
            least_light: self.frames().least_light(&self.free),
            free: &self.free,
            clipped_white: &self.stack.clipped_white,
        }
    }

    /// That of the photos, and of those of the empty display.
    fn noise(&self) -> NoiseModel {
        let frames = self.frames();
        let mut noise = frames.noise(&self.free);
        if self.empty_stack.is_some() {
            noise.empty = noise.of_white(mean_where(frames.empty_white, &self.free).mean());
        }
        noise
    }

    /// How much of the solution is kept: the object and a rim of blur.
    fn kept(&self) -> Image<Coverage> {
        let inside = self.object.coverage.map(|c| c.0 >= 0.5);
        let grown = filter::dilate(&inside, KEPT_RIM_PX).to_coverage();
        filter::gaussian_blur(&grown, RIM_SOFTNESS_PX).map(|c| Coverage(c.0.clamp(0.0, 1.0)))
    }

    fn refraction(
        &self,
        film: &Image<Film>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Refraction> {
        let read = |stack: &Stack| {
            let stripes = &stack.stripes;
            (!stripes.is_empty())
                .then(|| SeenStripes::read(&stripes.light, self.display, self.view))
        };
        let seen = read(self.stack)?;
        let empty = self.empty_stack.and_then(read);
        let frames = self.frames();
        diagnostics.extend(check::object_motion(
            &frames,
            &self.stack.stripes.mean.map(LinearRgb::mean),
            &self.object.coverage,
            &self.free,
        ));
        let light = frames.light();
        // Grey last: a mean of products is not the product of means.
        let passed = film.zip_map(&light, |film, light| (film.transmittance() * light).mean());
        let input = BendInput {
            display: self.display,
            view: self.view,
            seen: &seen,
            empty: empty.as_ref(),
            free: &self.free,
            coverage: &self.object.coverage,
            transmittance: &film.map(|film| film.transmittance().mean()),
            light: &light.map(LinearRgb::mean),
            passed: &passed,
        };
        Some(input.solve())
    }
}

/// What is free around an object.
fn without(area: &Mask, object: &Object) -> Mask {
    let near = filter::dilate(&object.coverage.map(|c| c.0 > 0.0), OBJECT_MARGIN_PX);
    area.zip_map(&near, |area, near| area && !near)
}

/// What black and white look like without the object.
struct EmptyDisplay {
    black: Image<LinearRgb>,
    white: Image<LinearRgb>,
}

impl EmptyDisplay {
    /// As it was photographed, or else fitted to where it is free.
    fn new(stack: &Stack, photographed: Option<&Stack>, free: &Mask) -> Result<Self> {
        if let Some(Stack { black, white, .. }) = photographed {
            return Ok(Self {
                black: black.clone(),
                white: white.clone(),
            });
        }
        let white = fitted(&stack.white, free).map_err(|e| e.within("white"))?;
        // Black may be no light at all, of which no logarithm is fitted.
        let lift = BLACK_LIFT * mean_where(&white, free).max_channel();
        let lifted = stack.black.map(|p| p.map(|v| v + lift));
        let black = fitted(&lifted, free).map_err(|e| e.within("black"))?;
        Ok(Self {
            black: black.map(|p| p.map(|v| v - lift)),
            white,
        })
    }
}

/// What is added to black for its fit, as a share of white.
const BLACK_LIFT: f32 = 0.1;

/// Each channel is fitted by itself: a plate is as smooth as its brightest channel, and from the
/// side the others of a display change while that one may not.
fn fitted(photo: &Image<LinearRgb>, free: &Mask) -> Result<Image<LinearRgb>> {
    let fit = |channel: usize| {
        let light = photo.map(|p| LinearRgb::grey(p.channels()[channel]));
        ScreenPlate::fit(&light, free, &PlateOptions::default()).map(|plate| plate.image)
    };
    let [r, g, b] = [fit(0)?, fit(1)?, fit(2)?];
    Ok(r.zip3_map(&g, &b, |r, g, b| LinearRgb::new(r.r, g.g, b.b)))
}

fn mean_where(image: &Image<LinearRgb>, mask: &Mask) -> LinearRgb {
    mean_color(image.pixels_in(mask)).unwrap_or_default()
}

fn unevenness(light: &Image<LinearRgb>, mask: &Mask) -> f32 {
    let light = light.pixels_in(mask).map(LinearRgb::mean);
    let ends = light.fold([f32::MAX, 0.0], |[low, high], v| [low.min(v), high.max(v)]);
    (1.0 - ends[0] / ends[1].max(1e-6)).clamp(0.0, 1.0)
}
