//! The compared matting methods.

use petcomp::matte::{
    CutOutOptions, FilmOptions, KeyOptions, Keying, Screen, ScreenPlate, SegmentOptions,
    Segmentation, film, screen_color, segment, triangulate,
};
use petcomp::{Coverage, Film, Image, LinearRgb, PremulRgba, Result, filter};

/// A matting method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum MattingMethod {
    /// Blender's keyer with the mean colour of the background, masked by the convex hull.
    Paper,
    /// Blender's keyer with a separate key for every pixel, masked by the tight outline.
    KeyPlate,
    /// Colour difference (Vlahos) against the plate, the screen subtracted.
    Difference,
    /// Film from one screen.
    Physical,
    /// Film from two screens, with both shots composed from the truth.
    TwoScreen,
}

/// The result of a method for a photo.
pub(super) struct MethodCutOut {
    /// Light and view transmittance.
    pub(super) film: Image<Film>,
    /// Transmittance with the object's own shadow.
    pub(super) transmittance: Image<LinearRgb>,
    /// The object's outline.
    pub(super) outline: Image<Coverage>,
    pub(super) found: Segmentation,
}

impl MattingMethod {
    /// All of them, the paper's first.
    pub(crate) const ALL: [Self; 5] = [
        Self::Paper,
        Self::KeyPlate,
        Self::Difference,
        Self::Physical,
        Self::TwoScreen,
    ];

    /// Its name in tables.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::KeyPlate => "Blender keyer + plate",
            Self::Difference => "colour difference + plate",
            Self::Physical => "physical",
            Self::TwoScreen => "two screens",
        }
    }

    /// Light and view transmittance of the object in a photo; `shots` are those of the two-screen
    /// method.
    pub(crate) fn film(
        self,
        photo: &Image<LinearRgb>,
        shots: &[Image<LinearRgb>; 2],
    ) -> Result<Image<Film>> {
        Ok(self.run(photo, shots)?.film)
    }

    /// Cuts the object out; `shots` are those of the two-screen method.
    pub(super) fn run(
        self,
        photo: &Image<LinearRgb>,
        shots: &[Image<LinearRgb>; 2],
    ) -> Result<MethodCutOut> {
        let found = segment(photo, &SegmentOptions::default())?;
        if self == Self::Paper {
            return key_by_color(photo, found);
        }
        let plate = fitted_plate(photo, &found)?;
        let prepared = PreparedPhoto {
            photo,
            inside: filter::gaussian_blur(&found.tight, CutOutOptions::default().soften_px),
            found,
            plate,
        };
        match self {
            Self::Paper | Self::KeyPlate => prepared.key_by_plate(),
            Self::Difference => Ok(prepared.color_difference()),
            Self::Physical => prepared.physical_film(),
            Self::TwoScreen => prepared.two_screens(shots),
        }
    }
}

/// The paper's method.
fn key_by_color(photo: &Image<LinearRgb>, found: Segmentation) -> Result<MethodCutOut> {
    let key = Screen::Color(screen_color(photo, &found.mask)?);
    let keyed = Keying::new(photo, key).run(&KeyOptions::default())?;
    let cut = keyed.cutout.zip_map(&found.mask, |p, m| p.masked(m));
    Ok(MethodCutOut::from_grey(&cut, found.mask.clone(), found))
}

fn fitted_plate(photo: &Image<LinearRgb>, found: &Segmentation) -> Result<ScreenPlate> {
    ScreenPlate::fit_outside(photo, &found.mask, &CutOutOptions::default().plate)
}

/// A photo, its object's outline, and its screen.
struct PreparedPhoto<'a> {
    photo: &'a Image<LinearRgb>,
    found: Segmentation,
    inside: Image<Coverage>,
    plate: ScreenPlate,
}

impl PreparedPhoto<'_> {
    fn key_by_plate(self) -> Result<MethodCutOut> {
        let screen = Screen::Plate(&self.plate.image);
        let keyed = Keying::new(self.photo, screen).run(&KeyOptions::default())?;
        Ok(self.masked_cut_out(&keyed.cutout))
    }

    fn color_difference(self) -> MethodCutOut {
        let keyed = self.photo.zip_map(&self.plate.image, color_difference);
        self.masked_cut_out(&keyed)
    }

    fn physical_film(self) -> Result<MethodCutOut> {
        let options = FilmOptions::default();
        let solved = film(self.photo, &self.plate, &self.inside, &options)?;
        Ok(self.film_cut_out(solved.film, solved.transmittance))
    }

    fn two_screens(self, shots: &[Image<LinearRgb>; 2]) -> Result<MethodCutOut> {
        let [first, second] = shots;
        let plates = [
            fitted_plate(first, &self.found)?,
            fitted_plate(second, &self.found)?,
        ];
        let shots = [(first, &plates[0]), (second, &plates[1])];
        let solved = triangulate(&shots, &self.inside, &Default::default())?;
        Ok(self.film_cut_out(solved.film, solved.transmittance))
    }

    fn masked_cut_out(self, keyed: &Image<PremulRgba>) -> MethodCutOut {
        let cut = keyed.zip_map(&self.inside, |p, m| p.masked(m));
        MethodCutOut::from_grey(&cut, self.found.tight.clone(), self.found)
    }

    fn film_cut_out(self, film: Image<Film>, transmittance: Image<LinearRgb>) -> MethodCutOut {
        MethodCutOut {
            film,
            transmittance,
            outline: self.found.tight.clone(),
            found: self.found,
        }
    }
}

impl MethodCutOut {
    /// A cut-out with the same opacity in every channel.
    fn from_grey(cut: &Image<PremulRgba>, outline: Image<Coverage>, found: Segmentation) -> Self {
        let transmittance = cut.map(|p| LinearRgb::grey(1.0 - p.a.clamp(0.0, 1.0)));
        Self {
            film: cut.map(Film::from),
            transmittance,
            outline,
            found,
        }
    }
}

/// Colour difference against the screen's own colour; the foreground is the part of the pixel that
/// the screen does not explain.
///
/// # Method
/// `1 - a = (I_p - max(I_others)) / (K_p - max(K_others))` for the screen's strongest channel `p`
/// (Vlahos' colour difference); the foreground is `I - (1 - a) K`.
fn color_difference(pixel: LinearRgb, screen: LinearRgb) -> PremulRgba {
    let (i, k): ([f32; 3], [f32; 3]) = (pixel.into(), screen.into());
    let through = share_of_screen(i, k);
    let [r, g, b] = [0, 1, 2].map(|c| (i[c] - through * k[c]).max(0.0));
    PremulRgba::new(r, g, b, 1.0 - through)
}

fn share_of_screen(pixel: [f32; 3], screen: [f32; 3]) -> f32 {
    let strongest = largest_channel(screen);
    let [seen, full] = [pixel, screen].map(|color| excess(color, strongest));
    if full > 0.0 {
        (seen / full).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// The first of the largest channels.
pub(crate) fn largest_channel(color: [f32; 3]) -> usize {
    (1..3).fold(0, |best, c| if color[c] > color[best] { c } else { best })
}

/// How much a channel is above both others.
fn excess(color: [f32; 3], channel: usize) -> f32 {
    color[channel] - color[(channel + 1) % 3].max(color[(channel + 2) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_difference_takes_the_screen_away_and_keeps_what_is_grey() {
        let screen = LinearRgb::new(0.05, 0.4, 0.1);
        assert_eq!(color_difference(screen, screen), PremulRgba::TRANSPARENT);
        assert_eq!(
            color_difference(LinearRgb::grey(0.3), screen),
            PremulRgba::new(0.3, 0.3, 0.3, 1.0)
        );
        let half = color_difference(screen.scale(0.5) + LinearRgb::grey(0.1), screen);
        assert!((half.a - 0.5).abs() < 1e-6 && (half.g - 0.1).abs() < 1e-6);
    }
}
