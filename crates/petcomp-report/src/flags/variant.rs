//! Photos made harder, their outlines still known.

mod framing;
mod lens;
mod lighting;
mod screen;
mod sensor;

use super::Trial;
use crate::matte::truth::Known;
use petcomp::Image;
use petcomp::LinearRgb;

/// What should become of a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// A cut-out that is right, or says that it may not be.
    Right,
    /// A cut-out and a doubt: the photo does not show all of the object.
    Flagged,
    /// No cut-out.
    Refused,
}

/// A way in which a photo is harder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PhotoVariant {
    /// As it was taken.
    Plain,
    /// The light falls off by 15 % over the picture.
    Uneven,
    /// By 60 %.
    VeryUneven,
    /// The edge of a hard shadow lies on the screen beside the object.
    ShadowBeside,
    /// The edge of a hard shadow runs across the object.
    ShadowAcross,
    /// Three times the light: highlights, or all of the screen, saturate.
    Overexposed,
    /// Sensor noise of 0.03.
    Noisy,
    /// The lens is out of focus by a blur of 2 pixels.
    Blurred,
    /// A screen of the other colour: of the plastic's own, where it has one.
    OtherScreen,
    /// A grey screen.
    GreyScreen,
    /// What is opaque of the object has the screen's hue.
    ScreenHue,
    /// A tenth of the object lies beyond the border of the photo.
    OverBorder,
    /// Two objects beside each other.
    Two,
    /// The screen without an object.
    Empty,
    /// The same in light that falls off by 60 %.
    EmptyUneven,
    /// 64 pixels wide.
    Tiny,
    /// 12 megapixels.
    Huge,
    /// Upright, as phones take it.
    Portrait,
    /// The object's box fills 80 % of the picture.
    FullFrame,
    /// The object covers 2 % of the picture.
    SmallObject,
    /// The object is an eighth as wide as it was.
    ThinObject,
    /// The object's edge is the border of the photo.
    AtBorder,
    /// Stored as JPEG of quality 60.
    Jpeg,
    /// A tenth of the light: underexposed.
    Dark,
    /// The camera moved by 6 pixels.
    MotionBlur,
    /// A lens that makes a disc of 3 pixels radius of a point.
    Defocused,
    /// The lens darkens the corners by 40 %, the lamp one side by 30 %.
    Vignetted,
    /// Warm light from one side, cool light from the other.
    TwoHues,
    /// A hard lamp: the object's own shadow has an edge.
    CastShadow,
    /// Creases on the screen.
    Wrinkled,
    /// Dust and specks on the screen.
    Specks,
    /// The screen ends in the picture.
    ScreenEdge,
}

impl PhotoVariant {
    /// All of them.
    pub const ALL: [Self; 32] = [
        Self::Plain,
        Self::Uneven,
        Self::VeryUneven,
        Self::ShadowBeside,
        Self::ShadowAcross,
        Self::Overexposed,
        Self::Noisy,
        Self::Blurred,
        Self::OtherScreen,
        Self::GreyScreen,
        Self::ScreenHue,
        Self::OverBorder,
        Self::Two,
        Self::Empty,
        Self::EmptyUneven,
        Self::Tiny,
        Self::Huge,
        Self::Portrait,
        Self::FullFrame,
        Self::SmallObject,
        Self::ThinObject,
        Self::AtBorder,
        Self::Jpeg,
        Self::Dark,
        Self::MotionBlur,
        Self::Defocused,
        Self::Vignetted,
        Self::TwoHues,
        Self::CastShadow,
        Self::Wrinkled,
        Self::Specks,
        Self::ScreenEdge,
    ];

    /// What it is called in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "as taken",
            Self::Uneven => "screen 15 % uneven",
            Self::VeryUneven => "screen 60 % uneven",
            Self::ShadowBeside => "hard shadow beside",
            Self::ShadowAcross => "hard shadow across",
            Self::Overexposed => "overexposed 3 times",
            Self::Noisy => "noise 0.03",
            Self::Blurred => "out of focus",
            Self::OtherScreen => "other screen colour",
            Self::GreyScreen => "grey screen",
            Self::ScreenHue => "object of the screen's hue",
            Self::OverBorder => "over the border",
            Self::Two => "two objects",
            Self::Empty => "empty screen",
            Self::EmptyUneven => "empty, 60 % uneven",
            Self::Tiny => "64 pixels",
            Self::Huge => "12 megapixels",
            Self::Portrait => "portrait",
            Self::FullFrame => "box fills 80 %",
            Self::SmallObject => "object of 2 %",
            Self::ThinObject => "thin object",
            Self::AtBorder => "touching the border",
            Self::Jpeg => "JPEG quality 60",
            Self::Dark => "a tenth of the light",
            Self::MotionBlur => "moved by 6 pixels",
            Self::Defocused => "defocused by 3 pixels",
            Self::Vignetted => "vignette and gradient",
            Self::TwoHues => "light of two hues",
            Self::CastShadow => "hard shadow of its own",
            Self::Wrinkled => "wrinkled screen",
            Self::Specks => "dust and specks",
            Self::ScreenEdge => "screen ends in the picture",
        }
    }

    /// What should become of such a photo.
    pub fn expected(self) -> Expected {
        match self {
            Self::OverBorder | Self::AtBorder => Expected::Flagged,
            Self::Two | Self::Empty | Self::EmptyUneven => Expected::Refused,
            _ => Expected::Right,
        }
    }

    /// The photo in this variant; nothing where it cannot be made of it.
    pub(crate) fn of(self, known: &Known, seed: u64) -> Option<Trial> {
        let plain = || Trial {
            photo: known.photo.clone(),
            mask: known.mask.clone(),
            box_px: known.box_px,
            expected: self.expected(),
        };
        let with = |photo: Image<LinearRgb>| Trial { photo, ..plain() };
        let direction = GOLDEN_ANGLE * seed as f64;
        let read = known.noise.read as f32;
        let trial = match self {
            Self::Plain => plain(),
            Self::Uneven => with(lighting::fallen_off(&known.photo, direction, 0.15)),
            Self::VeryUneven => with(lighting::fallen_off(&known.photo, direction, 0.6)),
            Self::ShadowBeside => with(lighting::shadowed(known, 0.5)),
            Self::ShadowAcross => with(lighting::shadowed(known, -0.3)),
            Self::Overexposed => with(known.photo.map(|p| p.scale(3.0))),
            Self::Noisy => with(sensor::noisy(&known.photo, 0.03, seed)),
            Self::Blurred => with(petcomp::filter::gaussian_blur(&known.photo, 2.0)),
            Self::OtherScreen => with(screen::on(known, |k| LinearRgb::new(k.r, k.b, k.g))),
            Self::GreyScreen => with(screen::on(known, |k| {
                LinearRgb::grey(k.r.max(k.g).max(k.b))
            })),
            Self::ScreenHue => with(screen::hued(known)?),
            Self::OverBorder => framing::cut_off(plain(), 0.1),
            Self::Two => framing::two(&plain()),
            Self::Empty => with(sensor::noisy(&known.screen, read, seed)),
            Self::EmptyUneven => with(sensor::noisy(
                &lighting::fallen_off(&known.screen, direction, 0.6),
                read,
                seed,
            )),
            Self::Tiny => framing::tiny(&plain()),
            Self::Huge => {
                let large = framing::huge(&plain());
                Trial {
                    photo: sensor::noisy(&large.photo, read, seed),
                    ..large
                }
            }
            Self::Portrait => framing::upright(&plain()),
            Self::FullFrame => framing::full_frame(plain()),
            Self::SmallObject => framing::small_object(known, plain()),
            Self::ThinObject => framing::thin_object(known, plain()),
            Self::AtBorder => framing::cut_off(plain(), 0.0),
            Self::Jpeg => with(sensor::jpeg(&known.photo, 60)?),
            Self::Dark => with(sensor::noisy(
                &known.photo.map(|p| p.scale(0.1)),
                read,
                seed,
            )),
            Self::MotionBlur => with(lens::moved(&known.photo, direction, 6)),
            Self::Defocused => with(lens::defocused(&known.photo, 3)),
            Self::Vignetted => with(lighting::fallen_off(
                &lens::vignetted(&known.photo, 0.4),
                direction,
                0.3,
            )),
            Self::TwoHues => with(lighting::two_hues(&known.photo, direction)),
            Self::CastShadow => with(lighting::cast(known, direction)),
            Self::Wrinkled => with(screen::wrinkled(known, seed)),
            Self::Specks => with(screen::specks(known, seed)),
            Self::ScreenEdge => with(screen::ending(known)),
        };
        Some(Trial {
            photo: trial.photo.map(sensor::coded),
            ..trial
        })
    }
}

/// Turns a seed into a direction: no two of the first hundred are alike.
const GOLDEN_ANGLE: f64 = 2.399_963;

/// A photo whose every pixel has its own share of the light; places are those of pixels' centres.
fn scaled(photo: &Image<LinearRgb>, light: impl Fn(f64, f64) -> f32 + Sync) -> Image<LinearRgb> {
    let at = |x: usize, y: usize| photo[(x, y)].scale(light(x as f64 + 0.5, y as f64 + 0.5));
    Image::from_fn(photo.width(), photo.height(), at)
}
