//! What each method makes of the part of a photo around the object.

use super::{CleanScreen, CutOutOptions, MatteMethod, ObjectRegion};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::clipping::clipping_level;
use crate::matte::film::{ColorUncertainty, FilmInput, FilmMatte, is_bare_screen, solve_film};
use crate::matte::key::{Keying, Screen};
use crate::matte::prepared::Prepared;
use crate::matte::screen::{is_keyable, strongest_channel};
use crate::matte::stroke::unclaimed;
use crate::pixel::{Coverage, Film, LinearRgb, PremulRgba};

/// A matte in the region around the object.
pub(super) struct Matted {
    pub(super) method: MatteMethod,
    pub(super) film: Image<Film>,
    pub(super) transmittance: Image<LinearRgb>,
    pub(super) uncertainty: Image<f32>,
    /// Mean matte on the screen outside the object.
    pub(super) residual_matte: f32,
    pub(super) color_uncertainty: Option<ColorUncertainty>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

impl Matted {
    /// Applies the method of the options.
    pub(super) fn new(
        prepared: &Prepared<'_>,
        screen: &CleanScreen,
        region: &ObjectRegion,
        options: &CutOutOptions,
    ) -> Result<Self> {
        match options.method.unwrap_or_default() {
            MatteMethod::Physical => Self::physical(prepared, screen, region, options),
            MatteMethod::Key => Self::keyed(prepared, screen, region, options),
            MatteMethod::Outline => Ok(Self::outline(screen, region)),
        }
    }

    fn outline(screen: &CleanScreen, region: &ObjectRegion) -> Self {
        let cutout = region
            .photo
            .zip_map(&region.cut, |p, m| p.opaque().masked(m));
        let share = bare_share(screen, region);
        let bare = (share > MAX_BARE_SHARE).then(|| bare_within(share));
        Self {
            diagnostics: bare.into_iter().collect(),
            ..Self::grey(MatteMethod::Outline, cutout, 0.0)
        }
    }

    fn physical(
        prepared: &Prepared<'_>,
        screen: &CleanScreen,
        region: &ObjectRegion,
        options: &CutOutOptions,
    ) -> Result<Self> {
        let object = FilmInput {
            photo: &region.photo,
            plate: &screen.plate.crop(region.around),
            inside: &region.cut,
            screen: screen.color,
            longer_side: prepared.longer_side(),
            clipped: clipping_level(prepared.photo, options.film.clipped),
            claims: region.claims.as_ref(),
        };
        solve_film(object, &options.film).map(Self::from)
    }

    fn keyed(
        prepared: &Prepared<'_>,
        screen: &CleanScreen,
        region: &ObjectRegion,
        options: &CutOutOptions,
    ) -> Result<Self> {
        let keyed = Keying::new(prepared.photo, Screen::Plate(&screen.plate.image))
            .run(&options.key)
            .map_err(|e| e.within("key"))?;
        let cutout = region.with_core(keyed.cutout.into_crop(region.around));
        Ok(Self::grey(
            MatteMethod::Key,
            cutout.zip_map(&region.cut, |p, m| p.masked(m)),
            mean_matte(&keyed.matte, &screen.background),
        ))
    }

    /// A cut-out of one alpha for all channels, which is used as the transmittance as well.
    fn grey(method: MatteMethod, image: Image<PremulRgba>, residual_matte: f32) -> Self {
        Self {
            method,
            film: image.map(Film::from),
            transmittance: image.map(|p| LinearRgb::grey(1.0 - p.a)),
            uncertainty: Image::new(image.width(), image.height()),
            residual_matte,
            color_uncertainty: None,
            diagnostics: Vec::new(),
        }
    }
}

impl From<FilmMatte> for Matted {
    fn from(matte: FilmMatte) -> Self {
        Self {
            method: MatteMethod::Physical,
            film: matte.film,
            transmittance: matte.transmittance,
            uncertainty: matte.uncertainty,
            // Film is empty outside the cut.
            residual_matte: 0.0,
            color_uncertainty: Some(matte.color_uncertainty),
            diagnostics: matte.diagnostics,
        }
    }
}

/// Nearer than this to its rim, what is within an outline may be screen by the outline's error.
const RIM_PX: f64 = 2.0;
/// A larger share of bare screen within an outline is worth a warning.
const MAX_BARE_SHARE: f64 = 0.05;

/// The share of what an outline encloses that is bare screen, as between the turns of a wire; 0
/// where the screen has no colour to tell it from clear plastic.
fn bare_share(screen: &CleanScreen, region: &ObjectRegion) -> f64 {
    if !is_keyable(screen.color) {
        return 0.0;
    }
    let inside = filter::erode(&region.cut.map(|c| c.0 > 0.5), RIM_PX);
    let plate = screen.plate.crop(region.around).image;
    let key = strongest_channel(screen.color);
    let bare = region.photo.zip3_map(&plate, &inside, |p, k, inside| {
        inside && is_bare_screen(p.into(), k.into(), key)
    });
    let bare = unclaimed(bare, region.claims.as_ref());
    bare.count() as f64 / inside.count().max(1) as f64
}

fn bare_within(share: f64) -> Diagnostic {
    Diagnostic::warning(
        Code::ScreenLikeParts,
        format_args!(
            "{:.0} % of what the outline encloses looks like bare screen, and is cut out as if it were the object; with the method \"physical\" it is see-through",
            100.0 * share
        ),
    )
}

/// Mean of a matte where a mask is set; 0 where it is empty.
fn mean_matte(matte: &Image<Coverage>, set: &Mask) -> f32 {
    let pixels = matte.pixels().iter().zip(set.pixels());
    let chosen = pixels.filter(|(_, inside)| **inside);
    let (sum, count) = chosen.fold((0.0, 0u64), |(sum, count), (m, _)| {
        (sum + f64::from(m.0), count + 1)
    });
    if count == 0 {
        0.0
    } else {
        (sum / count as f64) as f32
    }
}
