//! How certain the colour and the transmittance of a film are.

use super::FilmInput;
use super::object::share;
use super::solve::Factor;
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::image::{Image, Mask};
use crate::matte::screen::screen_shade;
use crate::pixel::{Coverage, LinearRgb};

/// What makes the colours of a cut-out wrong, 0 where nothing does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColorUncertainty {
    /// Share of the object that looks like the screen in its middle, bare where plastic is, or in
    /// some shade where most of it is opaque: it was keyed out, and may be paint of the screen's
    /// hue.
    pub keyed_away: f32,
    /// Share of the object that is brighter in the screen's hue than the screen through plastic,
    /// and was treated as opaque.
    pub screen_hue: f32,
    /// Share of the object that is clipped.
    pub clipped: f32,
    /// Transmittance that is not measured in the photo but comes from the prior of plastic, mean over
    /// the object.
    pub guessed: f32,
    /// How far other tints, or opaque paint, that explain the photo equally well differ in their
    /// transmittance.
    pub tint: f32,
    /// Share of the object that reflects as much as paint but was left see-through, where it is more
    /// than glints have; all of it where its darkest part does.
    pub paint: f32,
}

impl ColorUncertainty {
    /// Limits from which a person should look at a cut-out. Of 48 rendered photos with ground truth the
    /// 7 that have more keyed away had lost a cap, a label or their tint to the screen; the
    /// most of the others is 0.0022, one of which had lost some, too. The tint of 9 of 10
    /// bottles of the screen's own hue is less certain, that of no other by more than 0.024.
    /// Hue: caps and labels (a fifth of a bottle) are treated as opaque, which they are; where more
    /// has it, it is the plastic itself. Paint: wide glints of 24 rendered photos have 0.03 at
    /// most; of most opaque things that were left see-through it is all, of others 0.05 and more.
    pub const NEEDS_REVIEW: Self = Self {
        keyed_away: 0.005,
        screen_hue: 0.25,
        clipped: 0.3,
        guessed: 0.5,
        tint: 0.04,
        paint: 0.05,
    };

    /// How certain colour and transmittance are, 0 to 1: 0.5 where one cause reaches
    /// [`NEEDS_REVIEW`](Self::NEEDS_REVIEW).
    pub fn confidence(self) -> f64 {
        let all = self.causes().into_iter().zip(Self::NEEDS_REVIEW.causes());
        all.map(|(cause, limit)| certainty(cause.into(), limit.into()))
            .product()
    }

    fn causes(self) -> [f32; 6] {
        [
            self.keyed_away,
            self.screen_hue,
            self.clipped,
            self.guessed,
            self.tint,
            self.paint,
        ]
    }

    /// What is worth reporting.
    pub(super) fn diagnostics(self) -> Vec<Diagnostic> {
        let all = [
            (self.keyed_away > MIN_REPORTED_HUE).then(|| Self::keyed_away(self.keyed_away)),
            (self.screen_hue > MIN_REPORTED_HUE).then(|| Self::screen_hue(self.screen_hue)),
            (self.tint > Self::NEEDS_REVIEW.tint).then(|| Self::tint_uncertain(self.tint)),
            (self.paint > Self::NEEDS_REVIEW.paint).then(|| Self::see_through_paint(self.paint)),
            (self.clipped > MIN_REPORTED_CLIPPED).then(|| Self::clipped_object(self.clipped)),
        ];
        all.into_iter().flatten().collect()
    }

    /// `share` of the object looks like the screen.
    fn keyed_away(share: f32) -> Diagnostic {
        Diagnostic::new(
            Code::KeyedAway,
            warning_above(Self::NEEDS_REVIEW.keyed_away, share),
            format_args!(
                "{:.1} % of the object looks like the screen: keyed out, but it may be paint of the screen's hue; photograph it on another screen colour",
                100.0 * share
            ),
        )
    }

    /// `share` of the object is brighter in the screen's hue than plastic in front of the screen
    /// can be.
    fn screen_hue(share: f32) -> Diagnostic {
        Diagnostic::new(
            Code::ScreenHue,
            warning_above(Self::NEEDS_REVIEW.screen_hue, share),
            format_args!(
                "{:.1} % of the object has the screen's hue: treated as opaque; photograph it on another screen colour to verify",
                100.0 * share
            ),
        )
    }

    /// What explains the photo as well lets through `off` more or less.
    fn tint_uncertain(off: f32) -> Diagnostic {
        Diagnostic::warning(
            Code::TintUncertain,
            format_args!(
                "the plastic may have the screen's hue, or be opaque: its tint is uncertain by +- {off:.2}; photograph it on another screen colour"
            ),
        )
    }

    /// `share` of the object reflects as much as paint.
    fn see_through_paint(share: f32) -> Diagnostic {
        Diagnostic::warning(
            Code::TintUncertain,
            format_args!(
                "{:.0} % of the object is as bright as paint but treated as see-through; if it is opaque, set matte = \"outline\"",
                100.0 * share
            ),
        )
    }

    /// `share` of the object is brighter than the camera can measure.
    fn clipped_object(share: f32) -> Diagnostic {
        Diagnostic::note(
            Code::ClippedObject,
            format_args!(
                "{:.1} % of the object is clipped: its transmittance there is taken from the surrounding pixels",
                100.0 * share
            ),
        )
    }
}

fn warning_above(limit: f32, value: f32) -> Severity {
    if value > limit {
        Severity::Warning
    } else {
        Severity::Note
    }
}

/// Share of the object in the screen's hue up to which nothing is reported.
const MIN_REPORTED_HUE: f32 = 0.002;
/// Share of the object that may be clipped without a report: glints.
const MIN_REPORTED_CLIPPED: f32 = 0.03;
/// Transmittance of the screen's channel from which on nothing seems to lie on the screen: two
/// clear walls pass 0.56, one of them three quarters.
const BARE_TRANSMITTANCE: f32 = 0.85;

/// Transmittance of the screen's channel below which nothing seems to be seen through something.
pub(super) const OPAQUE_TRANSMITTANCE: f32 = 0.1;
/// Share of the object that is opaque from which on the rest may be paint, not plastic.
const MIN_OPAQUE_SHARE: f32 = 0.8;
/// Shade of the screen from which on paint of its hue is told from what is dark.
const MIN_SHADE: f32 = 0.15;

/// 1 without a cause, 0.5 where it reaches its limit.
fn certainty(cause: f64, limit: f64) -> f64 {
    limit / (limit + cause)
}

/// The share of the object that looks like the screen, away from its rim, and was left see-through:
/// like bare screen or, in something that is opaque for the most part, like the screen in some
/// shade. `photo` is the one that the transmittance is measured in, `flat` what flat plastic passes
/// in the screen's channel.
pub(super) fn keyed_away(
    factors: &Image<Factor>,
    photo: &Image<LinearRgb>,
    object: FilmInput<'_>,
    interior: &Mask,
    flat: f32,
) -> f32 {
    let inside = object.inside;
    let passed = factors.map(|f| if f.is_bare() { 1.0 } else { f.value * flat });
    let limit = match is_mostly_opaque(&passed, inside) {
        true => OPAQUE_TRANSMITTANCE,
        false => BARE_TRANSMITTANCE,
    };
    let gone = photo.zip3_map(&object.plate.image, &passed, |p, k, passed| {
        passed > BARE_TRANSMITTANCE || passed > limit && is_in_its_hue(p, k)
    });
    if !gone.pixels().contains(&true) {
        return 0.0;
    }
    let gone = gone.zip_map(interior, |gone, inner| gone && inner);
    share(gone.pixels().iter().copied(), inside)
}

fn is_mostly_opaque(passed: &Image<f32>, inside: &Image<Coverage>) -> bool {
    let opaque = passed.pixels().iter().map(|&t| t < OPAQUE_TRANSMITTANCE);
    share(opaque, inside) > MIN_OPAQUE_SHARE
}

/// A pixel is the screen in some shade, and no deep shadow.
fn is_in_its_hue(pixel: LinearRgb, screen: LinearRgb) -> bool {
    screen_shade(pixel.into(), screen.into()).is_some_and(|shade| shade > MIN_SHADE)
}

/// How much of a pixel's standard deviation is the prior's, 0 to 1.
#[inline]
fn prior_share(factor: &Factor, spread: f32) -> f64 {
    if factor.coloured || factor.is_bare() {
        0.0
    } else {
        f64::from((factor.sigma / spread).min(1.0))
    }
}

/// How much of the transmittance is the prior's, mean over the object: none of it where there is
/// paint. `spread` is the deviation of the prior, `flat` the most that flat plastic passes.
pub(super) fn guessed(
    factors: &Image<Factor>,
    inside: &Image<Coverage>,
    spread: f32,
    flat: f32,
) -> f32 {
    let weighted = factors.pixels().iter().zip(inside.pixels());
    let (sum, area) = weighted.fold((0.0, 0.0), |(sum, area), (f, c)| {
        let prior = prior_share(f, spread);
        (sum + f64::from(c.0) * prior * prior, area + f64::from(c.0))
    });
    if area > 0.0 {
        flat * (sum / area) as f32
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_at_its_limit_halves_the_confidence() {
        assert_eq!(ColorUncertainty::default().confidence(), 1.0);
        let tint = ColorUncertainty {
            tint: ColorUncertainty::NEEDS_REVIEW.tint,
            ..ColorUncertainty::default()
        };
        assert!((tint.confidence() - 0.5).abs() < 1e-6);
        let both = ColorUncertainty {
            keyed_away: 0.1,
            ..tint
        };
        let all = ColorUncertainty {
            guessed: 0.56,
            ..both
        };
        assert!(both.confidence() < 0.1 && all.confidence() < 0.05);
    }

    #[test]
    fn what_was_keyed_away_is_not_said_to_be_opaque() {
        let told = |doubt: fn(&mut ColorUncertainty)| {
            let mut doubts = ColorUncertainty::default();
            doubt(&mut doubts);
            let mut told = doubts.diagnostics();
            assert_eq!(told.len(), 1, "{told:?}");
            told.remove(0)
        };
        let keyed = told(|d| d.keyed_away = 0.1).message;
        assert!(
            keyed.contains("keyed out") && !keyed.contains("opaque"),
            "{keyed}"
        );
        let painted = told(|d| d.screen_hue = 0.1).message;
        assert!(painted.contains("treated as opaque"), "{painted}");
        let tint = told(|d| d.tint = 0.1);
        assert!(
            tint.code == Code::TintUncertain && tint.needs_review() && tint.code.is_about_color()
        );
    }
}
