//! Photos made more difficult, with outlines that are still known.

mod framing;
mod lens;
mod lighting;
mod screen;
mod sensor;

use super::Trial;
use crate::matte::truth::{Known, in_eight_bits};
use Expected::{Flagged, Refused, Right};
use petcomp::{Image, LinearRgb, filter};

/// The expected result of a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Expected {
    /// A cut-out that is right, or flagged.
    Right,
    /// A flagged cut-out: the photo does not show all of the object.
    Flagged,
    /// No cut-out.
    Refused,
}

/// A way to make a photo more difficult.
pub(super) struct PhotoVariant {
    /// Its name in tables.
    pub(super) name: &'static str,
    expected: Expected,
    /// None if it does not apply to a photo.
    make: fn(&VariantSource<'_>) -> Option<Trial>,
}

impl PhotoVariant {
    const fn new(
        name: &'static str,
        expected: Expected,
        make: fn(&VariantSource<'_>) -> Option<Trial>,
    ) -> Self {
        Self {
            name,
            expected,
            make,
        }
    }

    /// The photo in this variant; none if it does not apply.
    pub(super) fn trial(&self, known: &Known, seed: u64) -> Option<Trial> {
        let trial = (self.make)(&VariantSource::new(known, seed))?;
        Some(Trial {
            photo: trial.photo.map(|p| p.map(in_eight_bits)),
            expected: self.expected,
            ..trial
        })
    }
}

/// All of them.
pub(super) static VARIANTS: [PhotoVariant; 32] = [
    PhotoVariant::new("as taken", Right, |s| Some(s.plain())),
    PhotoVariant::new("screen 15 % uneven", Right, |s| s.with(s.fallen_off(0.15))),
    PhotoVariant::new("screen 60 % uneven", Right, |s| s.with(s.fallen_off(0.6))),
    PhotoVariant::new("hard shadow beside", Right, |s| {
        s.with(lighting::shadowed(s.known, 0.5))
    }),
    PhotoVariant::new("hard shadow across", Right, |s| {
        s.with(lighting::shadowed(s.known, -0.3))
    }),
    PhotoVariant::new("overexposed 3 times", Right, |s| {
        s.with(s.known.photo.map(|p| p.scale(3.0)))
    }),
    PhotoVariant::new("noise 0.03", Right, |s| {
        s.with(sensor::noisy(&s.known.photo, 0.03, s.seed))
    }),
    PhotoVariant::new("out of focus", Right, |s| {
        s.with(filter::gaussian_blur(&s.known.photo, 2.0))
    }),
    // Of the plastic's own colour, if it has one.
    PhotoVariant::new("other screen colour", Right, |s| {
        s.with(screen::on_screen(s.known, |k| {
            LinearRgb::new(k.r, k.b, k.g)
        }))
    }),
    PhotoVariant::new("grey screen", Right, |s| {
        s.with(screen::on_screen(s.known, |k| {
            LinearRgb::grey(k.r.max(k.g).max(k.b))
        }))
    }),
    PhotoVariant::new("object of the screen's hue", Right, |s| {
        s.with(screen::hued(s.known)?)
    }),
    PhotoVariant::new("over the border", Flagged, |s| {
        Some(framing::cut_off(s.plain(), 0.1))
    }),
    PhotoVariant::new("two objects", Refused, |s| Some(framing::two(&s.plain()))),
    PhotoVariant::new("empty screen", Refused, |s| {
        s.with(s.with_read_noise(&s.known.screen))
    }),
    PhotoVariant::new("empty, 60 % uneven", Refused, |s| {
        let uneven = lighting::fallen_off(&s.known.screen, s.direction, 0.6);
        s.with(s.with_read_noise(&uneven))
    }),
    PhotoVariant::new("64 pixels", Right, |s| Some(framing::tiny(&s.plain()))),
    PhotoVariant::new("12 megapixels", Right, |s| {
        let large = framing::huge(&s.plain());
        Some(Trial {
            photo: s.with_read_noise(&large.photo),
            ..large
        })
    }),
    PhotoVariant::new("portrait", Right, |s| Some(framing::upright(&s.plain()))),
    PhotoVariant::new("box fills 80 %", Right, |s| {
        Some(framing::full_frame(s.plain()))
    }),
    PhotoVariant::new("object of 2 %", Right, |s| {
        Some(framing::small_object(s.known, s.plain()))
    }),
    PhotoVariant::new("thin object", Right, |s| {
        Some(framing::thin_object(s.known, s.plain()))
    }),
    PhotoVariant::new("touching the border", Flagged, |s| {
        Some(framing::cut_off(s.plain(), 0.0))
    }),
    PhotoVariant::new("JPEG quality 60", Right, |s| {
        s.with(sensor::jpeg(&s.known.photo, 60)?)
    }),
    PhotoVariant::new("a tenth of the light", Right, |s| {
        let dark = s.known.photo.map(|p| p.scale(0.1));
        s.with(s.with_read_noise(&dark))
    }),
    PhotoVariant::new("moved by 6 pixels", Right, |s| {
        s.with(lens::moved(&s.known.photo, s.direction, 6))
    }),
    PhotoVariant::new("defocused by 3 pixels", Right, |s| {
        s.with(lens::defocused(&s.known.photo, 3))
    }),
    // The lens darkens the corners by 40 %, the lamp one side by 30 %.
    PhotoVariant::new("vignette and gradient", Right, |s| {
        let dark_corners = lens::vignetted(&s.known.photo, 0.4);
        s.with(lighting::fallen_off(&dark_corners, s.direction, 0.3))
    }),
    PhotoVariant::new("light of two hues", Right, |s| {
        s.with(lighting::two_hues(&s.known.photo, s.direction))
    }),
    PhotoVariant::new("hard shadow of its own", Right, |s| {
        s.with(lighting::cast_shadow(s.known, s.direction))
    }),
    PhotoVariant::new("wrinkled screen", Right, |s| {
        s.with(screen::wrinkled(s.known, s.seed))
    }),
    PhotoVariant::new("dust and specks", Right, |s| {
        s.with(screen::specks(s.known, s.seed))
    }),
    PhotoVariant::new("screen ends in the picture", Right, |s| {
        s.with(screen::ending(s.known))
    }),
];

/// Turns a seed into a direction: no two of the first hundred are alike.
const GOLDEN_ANGLE: f64 = 2.399_963;

/// A photo and what its variants depend on.
struct VariantSource<'a> {
    known: &'a Known,
    seed: u64,
    /// Where light or motion comes from, radians.
    direction: f64,
}

impl<'a> VariantSource<'a> {
    fn new(known: &'a Known, seed: u64) -> Self {
        Self {
            known,
            seed,
            direction: GOLDEN_ANGLE * seed as f64,
        }
    }

    fn plain(&self) -> Trial {
        self.trial_of(self.known.photo.clone())
    }

    /// Another photo of the same outline.
    fn with(&self, photo: Image<LinearRgb>) -> Option<Trial> {
        Some(self.trial_of(photo))
    }

    fn trial_of(&self, photo: Image<LinearRgb>) -> Trial {
        Trial {
            photo,
            mask: self.known.mask.clone(),
            box_px: self.known.box_px,
            expected: Right,
        }
    }

    fn with_read_noise(&self, photo: &Image<LinearRgb>) -> Image<LinearRgb> {
        sensor::noisy(photo, self.known.noise.read as f32, self.seed)
    }

    fn fallen_off(&self, share: f64) -> Image<LinearRgb> {
        lighting::fallen_off(&self.known.photo, self.direction, share)
    }
}

/// A photo with a factor on the light of every pixel; positions are those of pixels' centres.
fn scaled(photo: &Image<LinearRgb>, light: impl Fn(f64, f64) -> f32 + Sync) -> Image<LinearRgb> {
    Image::from_fn(photo.width(), photo.height(), |x, y| {
        photo[(x, y)].scale(light(x as f64 + 0.5, y as f64 + 0.5))
    })
}
