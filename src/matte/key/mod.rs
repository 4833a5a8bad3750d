//! The keyer: a photo before a coloured screen becomes a matte and a cut-out.

mod box_blur;
mod calm;
mod chroma;
mod cutout;
mod dilate;
mod edge;
mod feather;
mod limits;
mod model;
mod options;
mod photo;
mod raw;
mod robust;
mod rows;
mod stream;

pub(super) use chroma::{differences, from_ycc, to_ycc};
pub use options::{Falloff, KeyOptions, Profile};
pub use photo::Photo;

use crate::error::{Error, Result};
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
use stream::{Plane, Stream, fit};

/// What the photo was taken against.
#[derive(Clone, Copy, Debug)]
pub enum Screen<'a> {
    /// One colour, scene-linear.
    Color(LinearRgb),
    /// A colour for every pixel of the photo, scene-linear, the photo's size.
    Plate(&'a Image<LinearRgb>),
}

/// What a keyer makes of a photo; both pictures have the photo's size.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Keyed {
    /// How much of each pixel is foreground.
    pub matte: Image<Coverage>,
    /// The photo seen through its matte, premultiplied, scene-linear, despilled.
    pub cutout: Image<PremulRgba>,
    /// What the `robust` profile had to change; nothing in the others.
    pub deviations: Deviations,
}

/// How often the `robust` profile departed from Blender 3.4.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Deviations {
    /// Photo pixels that were not finite, or beyond 1e30, and became transparent.
    pub unusable_pixels: usize,
    /// Pixels of the plate that were not finite or too grey to key against, and were filled from around them.
    pub filled_plate: usize,
    /// Values of the garbage and core matte that were no number, and became 0.
    pub unusable_mattes: usize,
    /// Values of the finished matte that lay outside 0 to 1.
    pub clamped: usize,
}

/// Keys a photo against one screen colour.
///
/// Takes a scene-linear photo of any size; returns the matte and the premultiplied cut-out, same size. Settings outside
/// their range are moved to its nearest end, and nothing is refused: [`Keying::run`] is the call that checks, and that
/// takes plates, garbage and core mattes, and photos with alpha.
pub fn key(photo: &Image<LinearRgb>, screen: LinearRgb, opts: &KeyOptions) -> Keyed {
    let opts = opts.clamped();
    let mut keyed = Keyed { cutout: Image::new(photo.width(), photo.height()), ..Keyed::default() };
    let stream = Stream::new(Keying::new(photo, Screen::Color(screen)), None, &opts);
    keyed.deviations = stream.compute(Plane::Matte, &mut keyed.matte, &mut keyed.cutout);
    keyed
}

/// A photo to key, with all that can be said of it.
#[derive(Clone, Copy, Debug)]
pub struct Keying<'a, P> {
    photo: &'a Image<P>,
    screen: Screen<'a>,
    garbage: Option<&'a Image<Coverage>>,
    core: Option<&'a Image<Coverage>>,
}

impl<'a, P: Photo> Keying<'a, P> {
    /// A photo before a screen.
    pub fn new(photo: &'a Image<P>, screen: Screen<'a>) -> Self {
        Self { photo, screen, garbage: None, core: None }
    }

    /// With a garbage matte, the photo's size: 1 where there is surely no foreground.
    pub fn with_garbage(self, garbage: &'a Image<Coverage>) -> Self {
        Self { garbage: Some(garbage), ..self }
    }

    /// With a core matte, the photo's size: 1 where there is surely foreground.
    pub fn with_core(self, core: &'a Image<Coverage>) -> Self {
        Self { core: Some(core), ..self }
    }

    /// The matte and the cut-out.
    ///
    /// # Errors
    /// [`Error::Value`] for a setting out of range, a picture of another size than the photo's, a screen colour that is
    /// not finite, and in the `robust` profile for a key that cannot work.
    pub fn run(&self, opts: &KeyOptions) -> Result<Keyed> {
        let mut keyed = Keyed::default();
        self.run_into(opts, &mut keyed)?;
        Ok(keyed)
    }

    /// As [`run`](Self::run), into pictures that are already there: in a loop over frames no picture is allocated.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_into(&self, opts: &KeyOptions, keyed: &mut Keyed) -> Result<()> {
        let (width, height) = self.photo.size();
        fit(&mut keyed.cutout, width, height);
        keyed.deviations = self.plane(opts, Plane::Matte, &mut keyed.matte, &mut keyed.cutout)?;
        Ok(())
    }

    /// The matte alone, in half the time.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn matte(&self, opts: &KeyOptions) -> Result<Image<Coverage>> {
        let mut matte = Image::default();
        self.matte_into(opts, &mut matte)?;
        Ok(matte)
    }

    /// As [`matte`](Self::matte), into a picture that is already there.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn matte_into(&self, opts: &KeyOptions, matte: &mut Image<Coverage>) -> Result<Deviations> {
        self.plane(opts, Plane::Matte, matte, &mut Image::default())
    }

    /// The edges that the levels leave alone: 1 at edges, 0 elsewhere.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn edges(&self, opts: &KeyOptions) -> Result<Image<Coverage>> {
        let mut edges = Image::default();
        self.plane(opts, Plane::Edges, &mut edges, &mut Image::default())?;
        Ok(edges)
    }

    fn plane(
        &self,
        opts: &KeyOptions,
        plane: Plane,
        matte: &mut Image<Coverage>,
        cutout: &mut Image<PremulRgba>,
    ) -> Result<Deviations> {
        self.check(opts)?;
        let filled = robust::settle(self.screen, opts)?;
        let screen = filled.as_ref().map_or(self.screen, |f| Screen::Plate(&f.plate));
        let stream = Stream::new(Keying { screen, ..*self }, filled.as_ref().map(|f| f.channel), opts);
        let deviations = stream.compute(plane, matte, cutout);
        Ok(Deviations { filled_plate: filled.as_ref().map_or(0, |f| f.count), ..deviations })
    }

    fn check(&self, opts: &KeyOptions) -> Result<()> {
        opts.check()?;
        robust::warn(opts);
        let plate = if let Screen::Plate(p) = self.screen { Some(p.size()) } else { None };
        let others =
            [("plate", plate), ("garbage", self.garbage.map(Image::size)), ("core", self.core.map(Image::size))];
        for (name, size) in others {
            if let Some((w, h)) = size.filter(|&s| s != self.photo.size()) {
                let (width, height) = self.photo.size();
                return Err(Error::value(name, format!("{w} x {h} pixels, expected the photo's {width} x {height}")));
            }
        }
        match self.screen {
            Screen::Color(c) if !c.is_finite() => {
                Err(Error::value("screen", format!("{:?}, expected finite numbers", <[f32; 3]>::from(c))))
            }
            Screen::Color(c) => robust::check_color(c, opts),
            Screen::Plate(_) => Ok(()),
        }
    }
}

impl std::fmt::Display for Deviations {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { unusable_pixels, filled_plate, unusable_mattes, clamped } = self;
        write!(
            f,
            "{unusable_pixels} unusable pixels made transparent, {filled_plate} pixels of the plate filled, \
             {unusable_mattes} unusable values of garbage and core matte taken as 0, {clamped} matte values clamped"
        )
    }
}

impl std::iter::Sum for Deviations {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |a, b| Self {
            unusable_pixels: a.unusable_pixels + b.unusable_pixels,
            filled_plate: a.filled_plate + b.filled_plate,
            unusable_mattes: a.unusable_mattes + b.unusable_mattes,
            clamped: a.clamped + b.clamped,
        })
    }
}
