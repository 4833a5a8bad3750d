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

/// The expected result of a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// A cut-out that is right, or flagged.
    Right,
    /// A flagged cut-out: the photo does not show all of the object.
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
        NAMES[self as usize]
    }

    /// The expected result of such a photo.
    pub fn expected(self) -> Expected {
        match self {
            Self::OverBorder | Self::AtBorder => Expected::Flagged,
            Self::Two | Self::Empty | Self::EmptyUneven => Expected::Refused,
            _ => Expected::Right,
        }
    }

    /// The photo in this variant; nothing where it cannot be made of it.
    pub(crate) fn trial(self, known: &Known, seed: u64) -> Option<Trial> {
        let source = VariantSource::new(known, seed);
        let trial = source
            .with_other_outline(self)
            .or_else(|| Some(source.with_photo(source.photo(self)?)))?;
        Some(Trial {
            photo: trial.photo.map(sensor::coded),
            expected: self.expected(),
            ..trial
        })
    }
}

/// What variants are called in tables, in their order.
const NAMES: [&str; PhotoVariant::ALL.len()] = [
    "as taken",
    "screen 15 % uneven",
    "screen 60 % uneven",
    "hard shadow beside",
    "hard shadow across",
    "overexposed 3 times",
    "noise 0.03",
    "out of focus",
    "other screen colour",
    "grey screen",
    "object of the screen's hue",
    "over the border",
    "two objects",
    "empty screen",
    "empty, 60 % uneven",
    "64 pixels",
    "12 megapixels",
    "portrait",
    "box fills 80 %",
    "object of 2 %",
    "thin object",
    "touching the border",
    "JPEG quality 60",
    "a tenth of the light",
    "moved by 6 pixels",
    "defocused by 3 pixels",
    "vignette and gradient",
    "light of two hues",
    "hard shadow of its own",
    "wrinkled screen",
    "dust and specks",
    "screen ends in the picture",
];

/// Turns a seed into a direction: no two of the first hundred are alike.
const GOLDEN_ANGLE: f64 = 2.399_963;

/// A photo and what its variants depend on.
struct VariantSource<'a> {
    known: &'a Known,
    seed: u64,
    /// Where light or motion comes from, radians.
    direction: f64,
    /// Standard deviation of the sensor's read noise.
    read_noise: f32,
}

impl<'a> VariantSource<'a> {
    fn new(known: &'a Known, seed: u64) -> Self {
        Self {
            known,
            seed,
            direction: GOLDEN_ANGLE * seed as f64,
            read_noise: known.noise.read as f32,
        }
    }

    fn plain(&self) -> Trial {
        self.with_photo(self.known.photo.clone())
    }

    /// Another photo of the same outline.
    fn with_photo(&self, photo: Image<LinearRgb>) -> Trial {
        Trial {
            photo,
            mask: self.known.mask.clone(),
            box_px: self.known.box_px,
            expected: Expected::Right,
        }
    }

    /// A variant with another outline; nothing for the others.
    fn with_other_outline(&self, variant: PhotoVariant) -> Option<Trial> {
        self.reframed(variant).or_else(|| self.resized(variant))
    }

    /// Variants of the border and the place of the object.
    fn reframed(&self, variant: PhotoVariant) -> Option<Trial> {
        use PhotoVariant as V;
        Some(match variant {
            V::OverBorder => framing::cut_off(self.plain(), 0.1),
            V::AtBorder => framing::cut_off(self.plain(), 0.0),
            V::Two => framing::two(&self.plain()),
            V::Portrait => framing::upright(&self.plain()),
            V::FullFrame => framing::full_frame(self.plain()),
            _ => return None,
        })
    }

    /// Variants of the size of the photo or the object.
    fn resized(&self, variant: PhotoVariant) -> Option<Trial> {
        use PhotoVariant as V;
        Some(match variant {
            V::Tiny => framing::tiny(&self.plain()),
            V::Huge => self.huge(),
            V::SmallObject => framing::small_object(self.known, self.plain()),
            V::ThinObject => framing::thin_object(self.known, self.plain()),
            _ => return None,
        })
    }

    fn huge(&self) -> Trial {
        let large = framing::huge(&self.plain());
        Trial {
            photo: self.with_read_noise(&large.photo),
            ..large
        }
    }

    fn with_read_noise(&self, photo: &Image<LinearRgb>) -> Image<LinearRgb> {
        sensor::noisy(photo, self.read_noise, self.seed)
    }

    /// The photo of a variant with the same outline; nothing where it cannot be made.
    fn photo(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        self.relit(variant)
            .or_else(|| self.shadowed(variant))
            .or_else(|| self.on_other_screen(variant))
            .or_else(|| self.on_worse_screen(variant))
            .or_else(|| self.out_of_focus(variant))
            .or_else(|| self.badly_exposed(variant))
    }

    fn fallen_off(&self, share: f64) -> Image<LinearRgb> {
        lighting::fallen_off(&self.known.photo, self.direction, share)
    }

    /// Variants of the light without a hard shadow.
    fn relit(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        use PhotoVariant as V;
        Some(match variant {
            V::Uneven => self.fallen_off(0.15),
            V::VeryUneven => self.fallen_off(0.6),
            V::Vignetted => {
                let dark_corners = lens::vignetted(&self.known.photo, 0.4);
                lighting::fallen_off(&dark_corners, self.direction, 0.3)
            }
            V::TwoHues => lighting::two_hues(&self.known.photo, self.direction),
            _ => return None,
        })
    }

    /// Variants with a hard shadow.
    fn shadowed(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        use PhotoVariant as V;
        Some(match variant {
            V::ShadowBeside => lighting::shadowed(self.known, 0.5),
            V::ShadowAcross => lighting::shadowed(self.known, -0.3),
            V::CastShadow => lighting::cast_shadow(self.known, self.direction),
            _ => return None,
        })
    }

    /// Variants of the screen's colour, or of the screen alone.
    fn on_other_screen(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        use PhotoVariant as V;
        let known = self.known;
        Some(match variant {
            V::OtherScreen => screen::on_screen(known, |k| LinearRgb::new(k.r, k.b, k.g)),
            V::GreyScreen => screen::on_screen(known, |k| LinearRgb::grey(k.r.max(k.g).max(k.b))),
            V::ScreenHue => screen::hued(known)?,
            V::Empty => self.with_read_noise(&known.screen),
            V::EmptyUneven => {
                let uneven = lighting::fallen_off(&known.screen, self.direction, 0.6);
                self.with_read_noise(&uneven)
            }
            _ => return None,
        })
    }

    /// Variants of what is on the screen.
    fn on_worse_screen(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        use PhotoVariant as V;
        Some(match variant {
            V::Wrinkled => screen::wrinkled(self.known, self.seed),
            V::Specks => screen::specks(self.known, self.seed),
            V::ScreenEdge => screen::ending(self.known),
            _ => return None,
        })
    }

    /// Variants of the lens and of motion.
    fn out_of_focus(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        use PhotoVariant as V;
        let photo = &self.known.photo;
        Some(match variant {
            V::Blurred => petcomp::filter::gaussian_blur(photo, 2.0),
            V::MotionBlur => lens::moved(photo, self.direction, 6),
            V::Defocused => lens::defocused(photo, 3),
            _ => return None,
        })
    }

    /// Variants of the sensor and of the file, and the photo itself.
    fn badly_exposed(&self, variant: PhotoVariant) -> Option<Image<LinearRgb>> {
        use PhotoVariant as V;
        let photo = &self.known.photo;
        Some(match variant {
            V::Plain => photo.clone(),
            V::Overexposed => photo.map(|p| p.scale(3.0)),
            V::Noisy => sensor::noisy(photo, 0.03, self.seed),
            V::Jpeg => sensor::jpeg(photo, 60)?,
            V::Dark => self.with_read_noise(&photo.map(|p| p.scale(0.1))),
            _ => return None,
        })
    }
}

/// A photo whose every pixel has its own share of the light; positions are those of pixels'
/// centres.
fn scaled(photo: &Image<LinearRgb>, light: impl Fn(f64, f64) -> f32 + Sync) -> Image<LinearRgb> {
    Image::from_fn(photo.width(), photo.height(), |x, y| {
        photo[(x, y)].scale(light(x as f64 + 0.5, y as f64 + 0.5))
    })
}
