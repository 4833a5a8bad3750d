//! The cut-out of each method, seen from straight above.

use super::place::{Bottle, Place};
use super::shots::Stage;
use super::window::DisplayWindow;
use crate::matte::MattingMethod;
use petcomp::matte::LightPath;
use petcomp::{Film, Image, Result};

/// A way to photograph and cut out a bottle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DisplayMethod {
    /// The paper's keyer on one painted screen.
    Paper,
    /// One photo on a painted screen.
    OnePhoto,
    /// Two painted screens.
    TwoScreens,
    /// A display that shows black and white.
    BlackAndWhite,
    /// The same, and stripes.
    Stripes,
}

impl DisplayMethod {
    /// All of them, the paper's first.
    pub(super) const ALL: [Self; 5] = [
        Self::Paper,
        Self::OnePhoto,
        Self::TwoScreens,
        Self::BlackAndWhite,
        Self::Stripes,
    ];

    /// Its name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::OnePhoto => "one photo",
            Self::TwoScreens => "two screens",
            Self::BlackAndWhite => "black and white screen",
            Self::Stripes => "with stripes",
        }
    }

    /// The method for photos on painted screens.
    fn painted(self) -> Option<MattingMethod> {
        match self {
            Self::Paper => Some(MattingMethod::Paper),
            Self::OnePhoto => Some(MattingMethod::Physical),
            Self::TwoScreens => Some(MattingMethod::TwoScreen),
            Self::BlackAndWhite | Self::Stripes => None,
        }
    }

    /// Whether there are photos for it.
    pub(super) fn is_possible(self, bottle: &Bottle) -> bool {
        self != Self::Stripes || bottle.with_stripes
    }

    /// Whether it measures displacement.
    pub(super) fn measures_displacement(self) -> bool {
        self == Self::Stripes
    }

    pub(super) fn run(self, stage: &Stage<'_>, place: &Place, bottle: &Bottle) -> Result<SeenFilm> {
        match self.painted() {
            Some(method) => on_paint(method, place, bottle),
            None => on_display(self.measures_displacement(), stage, place, bottle),
        }
    }
}

/// An object seen from straight above, one pixel per pixel of the display.
pub(super) struct SeenFilm {
    pub(super) film: Image<Film>,
    /// Origin of the light, pixels of the display; none where that is not known.
    pub(super) flow: Image<Option<LightPath>>,
}

fn on_paint(method: MattingMethod, place: &Place, bottle: &Bottle) -> Result<SeenFilm> {
    let [paint, other] = Place::paints(bottle);
    let exposure = place.exposure_from(paint);
    // Both with the exposure of the first.
    let as_first = exposure.recip() * place.exposure_from(other);
    let second = place.photo(bottle, other)?;
    let shots = [
        place.photo(bottle, paint)?,
        second.map(|p| p.scale(as_first)),
    ];
    let film = method.film(&shots[0], &shots)?;
    let film = film.crop(place.in_painted(bottle));
    let exposed = film.map(|film| Film {
        color: film.color.scale(exposure),
        ..film
    });
    let window = DisplayWindow::of(place, bottle);
    let (w, h) = window.size();
    Ok(SeenFilm {
        film: window.seen(exposed),
        flow: Image::filled(w, h, None),
    })
}

fn on_display(
    with_stripes: bool,
    stage: &Stage<'_>,
    place: &Place,
    bottle: &Bottle,
) -> Result<SeenFilm> {
    let measured = stage.measure(bottle, with_stripes)?;
    let roi = DisplayWindow::of(place, bottle).roi();
    let flow = match &measured.refraction {
        Some(bent) => {
            let known = bent.known.crop(roi);
            let paths = bent.paths.crop(roi);
            paths.zip_map(&known, |path, known| known.then_some(path))
        }
        None => Image::filled(roi.width, roi.height, None),
    };
    Ok(SeenFilm {
        film: measured.film.crop(roi),
        flow,
    })
}
