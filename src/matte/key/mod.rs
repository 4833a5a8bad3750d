//! The keyer: a photo before a coloured screen becomes a matte and a cut-out, bit for bit as in Blender's Keying node.
//!
//! A pixel before a green screen is a mixture: `I = a F + (1 - a) K`, the foreground's colour `F` over the key colour
//! `K`. A keyer guesses the share `a`, the **matte**, from one observation: the screen is more saturated than what
//! stands before it.
//!
//! # The method, stage by stage
//!
//! Stages whose size is 0 are skipped. Names in code are fields of [`KeyOptions`].
//!
//! 1. **Pre-blur** (`blur_pre`). Cameras store colour more coarsely than brightness, and noisier. The photo is turned
//!    into brightness and two colour differences (BT.709, studio swing), the differences are box-blurred, and the photo
//!    is put together again. Only the matte sees it; the cut-out is made of the sharp photo.
//! 2. **Raw matte**. Let `p` be the largest channel of the key (of equal ones the later), `lo` and `hi` the other two
//!    in order, and `b = screen_balance`. The *saturation* of a colour `C` is
//!
//!    ```text
//!    v(C)   = b C[lo] + (1 - b) C[hi]           what a colour without screen in it would have in channel p
//!    sat(C) = (C[p] - v(C)) |1 - v(C)|
//!    ```
//!
//!    and with `s = sat(pixel)` and `S = sat(K)` the matte is 1 where `s < 0`, 0 where `s >= S`, else `1 - s / S`. Pixels
//!    with every channel above 1 are foreground. For `K = (0.1, 0.75, 0.2)` a half-covered grey pixel `(0.3, 0.625,
//!    0.35)` gets 0.60: the factor `|1 - v|` ties the matte to brightness, and only greys of brightness `v(K)` come out
//!    exact. `ignore_brightness` leaves the factor out.
//! 3. **Clip** (`clip_black`, `clip_white`). Values up to black become 0, from white on 1, those between are stretched, so
//!    that noise in the screen and shine on the subject vanish. *Edges* are left alone, so that hair survives: a pixel is an
//!    edge if fewer than 9 in 10 of its neighbours within `edge_kernel_radius` differ from it by less than
//!    `edge_kernel_tolerance`. [`Keying::edges`] shows them.
//! 4. **Garbage and core matte**: `min(m, 1 - garbage)`, then `max(m, core)`: what the user knows.
//! 5. **Post-blur** (`blur_post`): a box blur of the matte.
//! 6. **Dilate or erode** (`dilate_distance`): the largest or smallest value within a disc.
//! 7. **Feather** (`feather_distance`): the matte grows along a falloff curve and is blended there with a Gaussian blur of
//!    itself. A negative distance feathers the background inwards.
//! 8. **Cut-out**: the photo times its matte, all four channels. Then the **despill**: with `e = despill_balance`,
//!    `C[p]` loses `despill_factor (C[p] - (e C[lo] + (1 - e) C[hi]))` where that is positive. The result is
//!    premultiplied and goes into [`PremulRgba::over`](crate::composite) as it is. Note what it is not: of `a F + (1 - a)
//!    K` it makes `a I`, not `a F`; `subtract_screen` makes `max(0, I - (1 - M) K)` instead.
//!
//! # Profiles
//!
//! Blender's releases have behaved in three ways, which [`Profile`] names. They differ in roundings, in what lies beyond
//! the border (cut off up to 4.3, repeated from 4.4 on), in the sizes of the blur and edge windows, and in the disc (up
//! to 4.3 its left and bottom tip are missing). The fourth, `robust`, is 3.4 with a full disc and a final matte within 0
//! to 1; it treats pixels that are not numbers as transparent ones of matte 0, refuses keys too grey to work, levels in the
//! wrong order, fills holes in plates, and keys all of a plate by the primary channel of its mean. It counts what it
//! changed: [`Deviations`].
//!
//! # What to watch
//!
//! Noise of `n` in the photo becomes noise of about `n sqrt(1 + b^2 + (1 - b)^2) |1 - v| / S` in the matte. A key whose
//! primary channel exceeds the others by 0.3 makes 0.03 out of half a percent; one that exceeds them by 0.03 makes 0.2,
//! and grey makes a coin toss. Cyan, yellow and magenta sit between two primary channels: over an uneven screen the
//! keyer flips between them.
//!
//! # Cost
//!
//! Stages hand rows to each other, so a frame passes through main memory once; bands of rows run side by side. Where a
//! window sees one value only, which is most of a matte, nothing is computed. The result has the same bits on any number
//! of threads and with any instruction set: sums are made in Blender's order and never contracted.
//!
//! `blur = "running_sum"` ([`Blur`]) gives up Blender's bits, and its rounding, for box blurs that cost the same at any
//! size; `cargo bench --bench matte` prints speed and difference. The feather has no such form: the sum of its Gaussian
//! is 9 to 23 in 100 of its inner loop, measured with AVX-512 and AVX2, and the search for the best candidate beside it
//! cannot run. Half-precision storage would save nothing, since no stage keeps a plane: beyond its output, keying a 4K
//! frame takes less than a hundredth of a channel (`tests/matte_memory.rs`).
//!
//! ```
//! use petcomp::{Image, LinearRgb, matte};
//!
//! let screen = LinearRgb::new(0.1, 0.75, 0.2);
//! let photo = Image::filled(1, 1, LinearRgb::new(0.3, 0.55, 0.25));
//! let keyed = matte::key(&photo, screen, &matte::KeyOptions::default());
//! assert_eq!(keyed.matte[(0, 0)].0, 0.609068632);
//! ```

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
mod running_blur;
mod stream;
mod ycc;

pub(super) use limits::lesser;
#[doc(hidden)]
pub use options::{Blur, Falloff};
pub use options::{KeyOptions, Profile};
#[doc(hidden)]
pub use photo::Photo;
pub(super) use ycc::{differences, from_ycc, to_ycc};

use crate::error::{Error, Result};
use crate::image::{Image, ImageView};
use crate::matte::check::check_size;
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
use stream::{Plane, Stream, fit_size};

/// What the photo was taken against.
#[derive(Clone, Copy, Debug)]
pub enum Screen<'a> {
    /// One colour, scene-linear.
    Color(LinearRgb),
    /// A colour for every pixel of the photo, scene-linear, the photo's size.
    Plate(&'a Image<LinearRgb>),
}

/// Result of a keyer; both pictures have the photo's size.
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
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Deviations {
    /// Photo pixels that were not finite, or beyond 1e30, and became transparent, of raw matte 0.
    pub unusable_pixels: usize,
    /// Pixels of the plate that were not finite or too grey to key against, and were filled from around them.
    pub filled_plate: usize,
    /// Values of the garbage and core matte that were NaN or infinite, and became 0.
    pub unusable_mattes: usize,
    /// Values of the finished matte that lay outside 0 to 1.
    pub clamped: usize,
}

/// Keys a photo against one screen colour.
///
/// Takes a scene-linear photo of any size; returns the matte and the premultiplied cut-out, same size. Settings outside
/// their range are moved to its nearest end, and nothing is refused: [`Keying::run`] is the call that checks, and that
/// takes plates, garbage and core mattes, and photos with alpha.
pub fn key(photo: &Image<LinearRgb>, screen: LinearRgb, options: &KeyOptions) -> Keyed {
    let options = options.clamped();
    let mut keyed = Keyed::default();
    fit_size(&mut keyed.cutout, photo.width(), photo.height());
    let stream = Stream::new(Keying::new(photo, Screen::Color(screen)), None, &options);
    keyed.deviations = stream.compute_plane(Plane::Matte, &mut keyed.matte, &mut keyed.cutout);
    keyed
}

/// A photo to key, its screen, and the mattes that are known for it.
#[derive(Clone, Copy, Debug)]
pub struct Keying<'a, P> {
    photo: ImageView<'a, P>,
    screen: Screen<'a>,
    garbage: Option<&'a Image<Coverage>>,
    core: Option<&'a Image<Coverage>>,
}

impl<'a, P: Photo> Keying<'a, P> {
    /// A photo before a screen.
    pub fn new(photo: &'a Image<P>, screen: Screen<'a>) -> Self {
        Self::of_view(photo.view(), screen)
    }

    /// A borrowed photo before a screen.
    #[doc(hidden)]
    pub fn of_view(photo: ImageView<'a, P>, screen: Screen<'a>) -> Self {
        Self {
            photo,
            screen,
            garbage: None,
            core: None,
        }
    }

    /// With a garbage matte, the photo's size: 1 where there is surely no foreground.
    pub fn with_garbage(self, garbage: &'a Image<Coverage>) -> Self {
        Self {
            garbage: Some(garbage),
            ..self
        }
    }

    /// With a core matte, the photo's size: 1 where there is surely foreground.
    pub fn with_core(self, core: &'a Image<Coverage>) -> Self {
        Self {
            core: Some(core),
            ..self
        }
    }

    /// The matte and the cut-out.
    ///
    /// # Errors
    /// [`Error::Value`] for a setting out of range, a picture of another size than the photo's, a screen colour that is
    /// not finite or as bright as 8-bit codes are, and in the `robust` profile for a key that cannot work.
    pub fn run(&self, options: &KeyOptions) -> Result<Keyed> {
        let mut keyed = Keyed::default();
        self.run_into(options, &mut keyed)?;
        Ok(keyed)
    }

    /// As [`run`](Self::run), into existing pictures: in a loop over frames no picture is allocated. At 4K
    /// the system's work on the pages of new ones takes three times as long as the keying, unless the allocator asks for
    /// huge pages, as the program's does, and glibc's under `GLIBC_TUNABLES=glibc.malloc.hugetlb=1`.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_into(&self, options: &KeyOptions, keyed: &mut Keyed) -> Result<()> {
        let (width, height) = self.photo.size();
        fit_size(&mut keyed.cutout, width, height);
        keyed.deviations =
            self.compute_plane(options, Plane::Matte, &mut keyed.matte, &mut keyed.cutout)?;
        Ok(())
    }

    /// The matte alone, in half the time.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn matte(&self, options: &KeyOptions) -> Result<Image<Coverage>> {
        let mut matte = Image::default();
        self.matte_into(options, &mut matte)?;
        Ok(matte)
    }

    /// As [`matte`](Self::matte), into an existing picture.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn matte_into(
        &self,
        options: &KeyOptions,
        matte: &mut Image<Coverage>,
    ) -> Result<Deviations> {
        self.compute_plane(options, Plane::Matte, matte, &mut Image::default())
    }

    /// The edges that the levels leave alone: 1 at edges, 0 elsewhere.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn edges(&self, options: &KeyOptions) -> Result<Image<Coverage>> {
        let mut edges = Image::default();
        self.compute_plane(options, Plane::Edges, &mut edges, &mut Image::default())?;
        Ok(edges)
    }

    fn compute_plane(
        &self,
        options: &KeyOptions,
        plane: Plane,
        matte: &mut Image<Coverage>,
        cutout: &mut Image<PremulRgba>,
    ) -> Result<Deviations> {
        self.check(options)?;
        let filled = robust::without_holes(self.screen, options)?;
        let screen = filled
            .as_ref()
            .map_or(self.screen, |f| Screen::Plate(&f.plate));
        let channel = filled.as_ref().map(|f| f.channel);
        let stream = Stream::new(Keying { screen, ..*self }, channel, options);
        let deviations = stream.compute_plane(plane, matte, cutout);
        Ok(Deviations {
            filled_plate: filled.as_ref().map_or(0, |f| f.count),
            ..deviations
        })
    }

    fn check(&self, options: &KeyOptions) -> Result<()> {
        options.check()?;
        robust::warn_of_edge_settings(options);
        self.check_size("garbage", self.garbage.map(Image::size))?;
        self.check_size("core", self.core.map(Image::size))?;
        match self.screen {
            Screen::Color(c) => {
                check_screen(c)?;
                robust::check_color(c, options)
            }
            Screen::Plate(plate) => self.check_size("plate", Some(plate.size())),
        }
    }

    /// Refuses a picture of another size than the photo's.
    fn check_size(&self, name: &str, size: Option<(usize, usize)>) -> Result<()> {
        size.map_or(Ok(()), |size| check_size(name, size, self.photo.size()))
    }
}

/// Four stops over white: no screen is brighter.
const MAX_CHANNEL: f32 = 16.0;

/// What was expected of a colour that cannot be a screen's; none where it can.
#[doc(hidden)]
pub fn expected_of_screen(screen: LinearRgb) -> Option<&'static str> {
    if !screen.is_finite() {
        return Some("expected finite numbers");
    }
    let is_too_bright = screen.channels().iter().any(|&value| value > MAX_CHANNEL);
    is_too_bright.then_some("expected scene-linear values, white is 1; are these 8-bit codes?")
}

fn check_screen(screen: LinearRgb) -> Result<()> {
    expected_of_screen(screen).map_or(Ok(()), |expected| {
        let what = format!("{:?}, {expected}", screen.channels());
        Err(Error::value("screen", what))
    })
}

impl std::fmt::Display for Deviations {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            unusable_pixels,
            filled_plate,
            unusable_mattes,
            clamped,
        } = self;
        write!(
            f,
            "{unusable_pixels} unusable pixels made transparent, {filled_plate} pixels of the plate filled, \
             {unusable_mattes} unusable values of garbage and core matte treated as 0, {clamped} matte values clamped"
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

#[cfg(test)]
mod tests;
