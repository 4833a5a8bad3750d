//! Film: reflected light and transmittance of see-through plastic from one photo on a coloured
//! screen.

mod bright;
mod claimed;
mod object;
mod paint;
mod planes;
mod solve;
pub(super) mod tint;
mod uncertainty;
mod view;

pub(super) use object::OPAQUE;
pub use planes::film_planes;
pub(super) use tint::is_bare_screen;
pub use uncertainty::ColorUncertainty;
pub(super) use view::view;

use super::arrays::largest;
use super::check::{check_coverage, check_photo, check_positive, check_value};
use super::clipping::{CLIPPED, clipped_screen, clipping_level};
use super::plate::ScreenPlate;
use super::prepared::{check_finite, longer_side};
use super::screen::{is_keyable, strongest_channel};
use super::stroke::Claims;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, Film, LinearRgb};
use crate::stopwatch::Stopwatch;
use paint::NO_LIGHT;
use serde::{Deserialize, Serialize};
use solve::{Factor, Solver};
use std::borrow::Cow;
use std::ops::RangeInclusive;
use tint::{DARKEST_SHARE, Tint, TintSamples};

/// How film is solved for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmOptions {
    /// Transmittance per channel of the plastic where it lies flat, as seen on a screen beneath
    /// it; none = from the photo. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flat: Option<LinearRgb>,
    /// Scene-linear value at and above which a channel is clipped. A value up to 1.05 holds only for photos
    /// that end at 1; one that is brighter than 1.05 somewhere, such as an EXR, counts as clipped
    /// nowhere. Default: 0.98.
    pub clipped: f32,
    /// How far the thickness of plastic scatters around that of two walls, as a share: the prior
    /// where the photo shows too little. Default: 0.35.
    pub thickness_spread: f32,
    /// How well the reflected light of the screen's channel is inferred from the others, as a
    /// share. Default: 0.15.
    pub reflection_error: f32,
}

impl Default for FilmOptions {
    fn default() -> Self {
        Self {
            flat: None,
            clipped: CLIPPED,
            thickness_spread: 0.35,
            reflection_error: 0.15,
        }
    }
}

/// The film that one photo shows. `F + V * background` composites it over a background with light
/// of its own, `F + T * background` over one that the object itself shades.
#[derive(Clone, Debug)]
pub struct FilmMatte {
    /// Reflected light F and opacity `1 - V` by the view transmittance V, which is *estimated*
    /// from T. Of the photo's size, empty outside the object.
    pub film: Image<Film>,
    /// Transmittance T per channel as *measured*: the screen seen through the object and in its
    /// shadow. 1 outside.
    pub transmittance: Image<LinearRgb>,
    /// Expected error of T in each pixel, 0 to 1: large where the photo does not fix it.
    pub uncertainty: Image<f32>,
    /// T of the plastic where it lies flat: its tint, and what relates V to T.
    pub flat: LinearRgb,
    /// What may make its colours wrong.
    pub color_uncertainty: ColorUncertainty,
    /// Notes and warnings.
    pub diagnostics: Vec<Diagnostic>,
}

/// Solves `photo = F + T * plate` for the reflected light F and the transmittance T of one object.
///
/// `photo` is scene-linear; `inside` is the object's coverage, soft at its outline, and cuts off
/// everything else (the garbage matte). A screen with little colour shows little of T: then what
/// may be plastic by its light is assumed to be plastic, with a [`Diagnostic`].
///
/// # Method
/// Three values a pixel for six unknowns, so two models tie them together. *Transmittance*: the
/// plastic is clear or has one of the dyes of PET ([Beer and Lambert]), found from the pixels that
/// reflect least; a pixel is that plastic times one factor. *Reflection*: a neutral glint plus
/// light scattered in the plastic, of half its tint, so that the screen's channel of F follows from
/// the two others (colour difference is the special case of clear plastic). The factor is then
/// one equation; where dark or strongly tinted plastic makes it ill-conditioned it is drawn to that
/// of flat plastic, or to opaque where more is reflected than plastic can, by their variances, and
/// the uncertainty says how much was measured. `F = photo - T * plate` leaves nothing of the
/// screen's light: there is no spill to remove.
///
/// What is brighter in the screen's hue than the screen itself through plastic, or has a colour
/// that neither glints nor the plastic have, is opaque (a label, a cap). Glints hide what is seen
/// through: the brighter, the more such pixels have the factor of their surroundings, clipped ones
/// all of it.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where `inside` is empty or a pixel of the photo is not a
/// finite number; [`Error::Value`](crate::Error::Value) for an option that cannot be right, or
/// (`mask`) a coverage outside 0 to 1.
/// # Panics
/// When the sizes differ.
///
/// [Beer and Lambert]: https://en.wikipedia.org/wiki/Beer-Lambert_law
pub fn film(
    photo: &Image<LinearRgb>,
    plate: &ScreenPlate,
    inside: &Image<Coverage>,
    options: &FilmOptions,
) -> Result<FilmMatte> {
    options.check()?;
    check_finite(photo)?;
    check_coverage(inside)?;
    let whole = FilmInput {
        photo,
        plate,
        inside,
        screen: plate.color(),
        longer_side: longer_side(photo),
        clipped: clipping_level(photo, options.clipped),
        claims: None,
    };
    let mut matte = solve_film(whole, options)?;
    let clipped = clipped_screen(photo, inside, options.clipped);
    matte.diagnostics.extend(clipped);
    matte.diagnostics.extend(plate.unevenness_warning());
    Ok(matte)
}

/// A photo on its screen, or the part of it around the object: there is nothing to solve elsewhere.
/// All pictures are of one size.
#[derive(Clone, Copy)]
pub(super) struct FilmInput<'a> {
    /// Finite.
    pub(super) photo: &'a Image<LinearRgb>,
    pub(super) plate: &'a ScreenPlate,
    /// Coverage of the object.
    pub(super) inside: &'a Image<Coverage>,
    /// Mean colour of the whole screen.
    pub(super) screen: LinearRgb,
    /// Longer side of the whole photo, pixels.
    pub(super) longer_side: usize,
    /// Value from which on a channel of the photo is clipped; infinite where none is.
    pub(super) clipped: f32,
    /// Which pixels a person says are see-through, and which are not.
    pub(super) claims: Option<&'a Claims>,
}

/// As [`film`], with options that are checked.
pub(super) fn solve_film(object: FilmInput<'_>, options: &FilmOptions) -> Result<FilmMatte> {
    object.check()?;
    Ok(match exposure_gain(object.screen) {
        Some(gain) => object.solve_exposed(gain, options),
        None => solve_as_exposed(object, options),
    })
}

/// Mean light of a screen's strongest channel that the constants of this stage hold for. They were
/// found at 0.3 to 0.45.
const SCREEN_LIGHT: RangeInclusive<f32> = 0.25..=0.55;
/// Screens that are darker by more than this show nothing that noise does not hide.
const MAX_GAIN: f32 = 1000.0;

/// What brings a photo to the nearest exposure that the constants hold for; none where it has one,
/// or nothing that tells it: grey boards are of any brightness.
fn exposure_gain(screen: LinearRgb) -> Option<f32> {
    let light = screen.max_channel();
    let wanted = light.clamp(*SCREEN_LIGHT.start(), *SCREEN_LIGHT.end());
    let is_off = is_keyable(screen) && wanted != light;
    is_off.then(|| (wanted / light).min(MAX_GAIN))
}

/// As [`solve_film`], of a photo that is exposed as it should be.
fn solve_as_exposed(object: FilmInput<'_>, options: &FilmOptions) -> FilmMatte {
    let mut watch = Stopwatch::start();
    let solution = FilmSolution::new(object, options);
    let samples = solution.tint_samples();
    let tint = solution.tint(&samples);
    watch.lap("tint");
    let mut factors = solution.factors(tint.flat);
    watch.lap("factors");
    let color_uncertainty = solution.refine(&mut factors, tint, &samples, &mut watch);
    let matte = solution.composed(&factors, tint.flat.into(), color_uncertainty);
    watch.lap("compose");
    watch.log("film");
    matte
}

impl FilmInput<'_> {
    /// The film by the photo exposed by a factor more, with the light of the photo as it is:
    /// `photo = F + T * plate` holds at any exposure.
    fn solve_exposed(self, gain: f32, options: &FilmOptions) -> FilmMatte {
        let exposed = FilmInput {
            photo: &self.photo.map(|p| p.scale(gain)),
            plate: &self.plate.exposed(gain),
            screen: self.screen.scale(gain),
            clipped: self.clipped * gain,
            ..self
        };
        let matte = solve_as_exposed(exposed, options);
        FilmMatte {
            film: matte.film.map(|f| Film {
                color: f.color.scale(gain.recip()),
                ..f
            }),
            ..matte
        }
    }

    /// # Errors
    /// [`Error::Photo`](crate::Error::Photo) where the mask is empty.
    /// # Panics
    /// When the sizes differ.
    fn check(&self) -> Result<()> {
        let (photo, plate) = (self.photo.size(), self.plate.image.size());
        assert_eq!(photo, plate, "photo and plate differ in size");
        assert_eq!(photo, self.inside.size(), "photo and mask differ in size");
        check_photo(self.inside.pixels().iter().any(|c| c.0 > 0.0), || {
            "the mask of the object is empty".into()
        })
    }
}

/// A film while it is solved.
struct FilmSolution<'a> {
    object: FilmInput<'a>,
    /// The photo that the transmittance is measured in.
    calm: Cow<'a, Image<LinearRgb>>,
    /// The object without its rim.
    interior: Mask,
    /// The screen's strongest channel.
    key: usize,
    is_keyable: bool,
    options: &'a FilmOptions,
}

impl<'a> FilmSolution<'a> {
    fn new(object: FilmInput<'a>, options: &'a FilmOptions) -> Self {
        Self {
            object,
            calm: calmed(object.photo, object.plate.residual),
            interior: object::interior(object.inside, object.longer_side),
            key: strongest_channel(object.screen),
            is_keyable: is_keyable(object.screen),
            options,
        }
    }

    fn diagnostics(&self, uncertainty: ColorUncertainty) -> Vec<Diagnostic> {
        let grey = (!self.is_keyable).then(|| grey_screen(self.object.screen));
        grey.into_iter().chain(uncertainty.diagnostics()).collect()
    }

    /// The given tint, or else that of the photo. On a grey screen all of the object is sampled,
    /// and that the tint may be another is part of the guess.
    fn tint(&self, samples: &TintSamples) -> Tint {
        match self.options.flat {
            Some(flat) => Tint::certain(flat.into()),
            None if self.is_keyable => samples.fit(),
            None => Tint::certain(samples.fit_plastic()),
        }
    }

    /// The object's pixels that show its tint.
    fn tint_samples(&self) -> TintSamples {
        let FilmInput { plate, inside, .. } = self.object;
        let share = if self.is_keyable { DARKEST_SHARE } else { 1.0 };
        TintSamples::new(&self.calm, plate, inside, self.key, share)
    }

    /// By which factor each pixel is flat plastic.
    fn factors(&self, flat: [f32; 3]) -> Image<Factor> {
        let FilmInput { plate, inside, .. } = self.object;
        let solver = Solver::new(self.key, flat, plate.residual, self.options);
        let factor = if self.is_keyable {
            Solver::solve
        } else {
            Solver::guess
        };
        let factors = self
            .calm
            .zip3_map(&plate.image, inside, |pixel, screen, inside| {
                if inside.0 > 0.0 {
                    factor(&solver, pixel.into(), screen.into())
                } else {
                    Factor::default()
                }
            });
        self.claimed_factors(factors, &solver)
    }

    /// The factors as a person corrected them.
    fn claimed_factors(&self, mut factors: Image<Factor>, solver: &Solver) -> Image<Factor> {
        let Some(claims) = self.object.claims else {
            return factors;
        };
        let plate = &self.object.plate.image;
        let plastic = self.calm.zip3_map(plate, claims, |pixel, screen, claim| {
            (claim == Some(true)).then(|| solver.see_through(pixel.into(), screen.into()))
        });
        factors = factors.zip_map(&plastic, |factor, plastic| Factor {
            bare_shade: factor.bare_shade,
            ..plastic.unwrap_or(factor)
        });
        claimed::make_opaque(&mut factors, Some(claims));
        factors
    }

    /// Makes paint opaque, fills what glints hide, and says how certain the colours are.
    fn refine(
        &self,
        factors: &mut Image<Factor>,
        Tint { flat, uncertainty }: Tint,
        samples: &TintSamples,
        watch: &mut Stopwatch,
    ) -> ColorUncertainty {
        let (object, interior, most) = (self.object, &self.interior, largest(flat));
        let spread = self.options.thickness_spread;
        let guessed = uncertainty::guessed(factors, object.inside, spread, most);
        let screen_hue = bright::make_opaque(factors, &self.calm, object, interior);
        let keyed_away =
            uncertainty::keyed_away(factors, &self.calm, object, interior, flat[self.key]);
        watch.lap("paint");
        let clipped = bright::fill_glints(factors, object);
        claimed::make_opaque(factors, object.claims);
        watch.lap("glints");
        let light = self.see_through_light(factors, flat.into());
        let paint = paint::see_through(&light, samples, object, interior);
        // Paint lets nothing through.
        let is_matt = paint::is_matt(&light, object.screen, interior);
        let tint = match self.options.flat {
            None if is_matt => uncertainty.max(most),
            _ => uncertainty,
        };
        watch.lap("see-through paint");
        ColorUncertainty {
            keyed_away,
            screen_hue,
            clipped,
            guessed,
            tint,
            paint,
        }
    }

    /// Light that see-through pixels reflect, [`NO_LIGHT`] elsewhere. None counts where a person
    /// says that it is see-through, or on a grey screen: all that is see-through is guessed there,
    /// and said to be.
    fn see_through_light(&self, factors: &Image<Factor>, flat: LinearRgb) -> Image<f32> {
        if !self.is_keyable {
            return factors.map(|_| NO_LIGHT);
        }
        let plate = &self.object.plate.image;
        let mut reflected = factors.zip3_map(&self.calm, plate, |f, p, k| {
            paint::reflected(p, k, f.transmittance(flat), self.key)
        });
        claimed::set_see_through(&mut reflected, self.object.claims, NO_LIGHT);
        reflected
    }

    /// What a transmittance leaves of the photo's light.
    fn reflected(&self, transmittance: &Image<LinearRgb>) -> Image<LinearRgb> {
        let plate = &self.object.plate.image;
        self.object
            .photo
            .zip3_map(plate, transmittance, |p, k, t| without(p, t * k))
    }

    /// F, T and V from the factors by which the pixels are flat plastic.
    fn composed(
        &self,
        factors: &Image<Factor>,
        flat: LinearRgb,
        color_uncertainty: ColorUncertainty,
    ) -> FilmMatte {
        let inside = self.object.inside;
        let plastic = factors.map(|f| f.transmittance(flat));
        let transmittance = plastic.zip_map(inside, covered);
        let lit = factors.map(|f| f.lit_transmittance(flat));
        let lit = claimed::without_shadow(&lit, flat, self.object.claims);
        let seen = view(&lit, flat, inside);
        let reflected = self.reflected(&transmittance);
        // What T leaves of the photo is the light of as much of the pixel as the object covers.
        let film = reflected.zip3_map(&seen, inside, |f, v, c| {
            let light = if c.0 > 0.0 { f } else { LinearRgb::BLACK };
            Film::new(light, covered(v, c))
        });
        FilmMatte {
            film,
            transmittance,
            uncertainty: uncertainty_of(factors, inside, flat.max_channel()),
            flat,
            color_uncertainty,
            diagnostics: self.diagnostics(color_uncertainty),
        }
    }
}

/// Expected error of the largest channel of the transmittance.
fn uncertainty_of(factors: &Image<Factor>, inside: &Image<Coverage>, most: f32) -> Image<f32> {
    factors.zip_map(inside, |f, c| match f.is_bare() {
        true => 0.0,
        false => (c.0 * f.sigma * most).min(1.0),
    })
}

impl FilmOptions {
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) for the first option that cannot be right.
    #[doc(hidden)]
    pub fn check(&self) -> Result<()> {
        self.flat.map_or(Ok(()), check_flat)?;
        check_positive("clipped", self.clipped)?;
        check_positive("thickness_spread", self.thickness_spread)?;
        check_positive("reflection_error", self.reflection_error)
    }
}

fn check_flat(LinearRgb { r, g, b }: LinearRgb) -> Result<()> {
    let is_right = [r, g, b].iter().all(|t| (0.001..=1.0).contains(t));
    check_value(is_right, "flat", || {
        format!("({r}, {g}, {b}), expected 0.001 to 1")
    })
}

/// Noise from which on the transmittance is measured in a blurred photo: a twentieth of what a
/// screen at 0.4 shows through two clear walls.
const MAX_SHARP_NOISE: f32 = 0.01;
/// Blur of a noisy photo, standard deviation in pixels: leaves a quarter of the noise, and folds.
const NOISE_BLUR_PX: f32 = 1.0;

/// The photo that the transmittance is measured in.
fn calmed(photo: &Image<LinearRgb>, noise: LinearRgb) -> Cow<'_, Image<LinearRgb>> {
    if noise.max_channel() < MAX_SHARP_NOISE {
        return Cow::Borrowed(photo);
    }
    Cow::Owned(filter::gaussian_blur(photo, NOISE_BLUR_PX))
}

/// A transmittance that holds for the covered share of a pixel only.
pub(super) fn covered(t: LinearRgb, Coverage(c): Coverage) -> LinearRgb {
    t.map(|t| 1.0 - c * (1.0 - t))
}

/// Light that is left when some is taken away; not less than none.
fn without(light: LinearRgb, taken: LinearRgb) -> LinearRgb {
    LinearRgb::new(
        (light.r - taken.r).max(0.0),
        (light.g - taken.g).max(0.0),
        (light.b - taken.b).max(0.0),
    )
}

fn grey_screen(screen: LinearRgb) -> Diagnostic {
    let LinearRgb { r, g, b } = screen;
    Diagnostic::warning(
        Code::GreyScreen,
        format_args!(
            "the background ({r:.2}, {g:.2}, {b:.2}) is too grey to measure transmittance: that of plastic is assumed; \
             for an opaque object set matte = \"outline\""
        ),
    )
}

#[cfg(test)]
mod tests;
