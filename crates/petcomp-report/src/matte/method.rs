//! The ways to a cut-out that are compared.

use super::truth::Known;
use petcomp::Image;
use petcomp::Result;
use petcomp::filter;
use petcomp::matte::{
    CutOutOptions, FilmOptions, KeyOptions, Keying, Screen, ScreenPlate, SegmentOptions,
    Segmentation, screen_color, segment, triangulate,
};
use petcomp::{Coverage, Film, LinearRgb, PremulRgba};

/// A way to a cut-out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MattingMethod {
    /// Blender's keyer with the mean colour of the background, masked by the convex hull.
    Paper,
    /// Blender's keyer with a key of its own for every pixel, masked by the tight outline.
    KeyPlate,
    /// Colour difference (Vlahos) against the plate, the screen subtracted.
    Difference,
    /// Film from one screen.
    Physical,
    /// Film from two screens, both shots made of the truth.
    TwoScreen,
}

/// What a method made of a photo.
pub(super) struct Cut {
    /// Light and view transmittance.
    pub(super) film: Image<Film>,
    /// Transmittance with the object's own shadow.
    pub(super) transmittance: Image<LinearRgb>,
    /// What it takes for the object.
    pub(super) outline: Image<Coverage>,
    pub(super) found: Segmentation,
}

impl MattingMethod {
    /// All of them, the paper's first.
    pub const ALL: [Self; 5] = [
        Self::Paper,
        Self::KeyPlate,
        Self::Difference,
        Self::Physical,
        Self::TwoScreen,
    ];

    /// What it is called in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::KeyPlate => "Blender keyer + plate",
            Self::Difference => "colour difference + plate",
            Self::Physical => "physical",
            Self::TwoScreen => "two screens",
        }
    }

    /// Cuts the object out; `shots` are those of the two-screen method.
    pub(super) fn run(self, known: &Known, shots: &[Image<LinearRgb>; 2]) -> Result<Cut> {
        let photo = &known.photo;
        let found = segment(photo, &SegmentOptions::default())?;
        if self == Self::Paper {
            let key = Screen::Color(screen_color(photo, &found.mask)?);
            let keyed = Keying::new(photo, key).run(&KeyOptions::default())?;
            let cut = keyed.cutout.zip_map(&found.mask, |p, m| p.masked(m));
            return Ok(Cut::grey(&cut, found.mask.clone(), found));
        }
        let inside = filter::gaussian_blur(&found.tight, CutOutOptions::default().soften_px);
        let plate = fitted(photo, &found)?;
        Ok(match self {
            Self::Paper | Self::KeyPlate => {
                let keyed =
                    Keying::new(photo, Screen::Plate(&plate.image)).run(&KeyOptions::default())?;
                let cut = keyed.cutout.zip_map(&inside, |p, m| p.masked(m));
                Cut::grey(&cut, found.tight.clone(), found)
            }
            Self::Difference => {
                let keyed = photo.zip_map(&plate.image, difference);
                let cut = keyed.zip_map(&inside, |p, m| p.masked(m));
                Cut::grey(&cut, found.tight.clone(), found)
            }
            Self::Physical => {
                let solved = petcomp::matte::film(photo, &plate, &inside, &FilmOptions::default())?;
                let outline = found.tight.clone();
                Cut {
                    film: solved.film,
                    transmittance: solved.transmittance,
                    outline,
                    found,
                }
            }
            Self::TwoScreen => {
                let plates = [fitted(&shots[0], &found)?, fitted(&shots[1], &found)?];
                let shots = [(&shots[0], &plates[0]), (&shots[1], &plates[1])];
                let solved = triangulate(&shots, &inside, &Default::default())?;
                let outline = found.tight.clone();
                Cut {
                    film: solved.film,
                    transmittance: solved.transmittance,
                    outline,
                    found,
                }
            }
        })
    }
}

impl Cut {
    fn grey(cut: &Image<PremulRgba>, outline: Image<Coverage>, found: Segmentation) -> Self {
        let transmittance = cut.map(|p| LinearRgb::grey(1.0 - p.a.clamp(0.0, 1.0)));
        Self {
            film: cut.map(Film::from),
            transmittance,
            outline,
            found,
        }
    }
}

fn fitted(photo: &Image<LinearRgb>, found: &Segmentation) -> Result<ScreenPlate> {
    ScreenPlate::fit(photo, &found.background(), &CutOutOptions::default().plate)
}

/// Colour difference against the screen's own colour, and what the screen does not explain of the pixel.
///
/// # Method
/// `1 - a = (I_p - max(I_others)) / (K_p - max(K_others))` for the screen's strongest channel `p` (Vlahos' colour
/// difference); the foreground is `I - (1 - a) K`.
fn difference(pixel: LinearRgb, screen: LinearRgb) -> PremulRgba {
    let (i, k): ([f32; 3], [f32; 3]) = (pixel.into(), screen.into());
    let p = (1..3).fold(0, |best, c| if k[c] > k[best] { c } else { best });
    let excess = |c: [f32; 3]| c[p] - c[(p + 1) % 3].max(c[(p + 2) % 3]);
    let through = if excess(k) > 0.0 {
        (excess(i) / excess(k)).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let [r, g, b] = [0, 1, 2].map(|c| (i[c] - through * k[c]).max(0.0));
    PremulRgba::new(r, g, b, 1.0 - through)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_difference_takes_the_screen_away_and_keeps_what_is_grey() {
        let screen = LinearRgb::new(0.05, 0.4, 0.1);
        assert_eq!(difference(screen, screen), PremulRgba::TRANSPARENT);
        assert_eq!(
            difference(LinearRgb::grey(0.3), screen),
            PremulRgba::new(0.3, 0.3, 0.3, 1.0)
        );
        let half = difference(screen.scale(0.5) + LinearRgb::grey(0.1), screen);
        assert!((half.a - 0.5).abs() < 1e-6 && (half.g - 0.1).abs() < 1e-6);
    }
}
