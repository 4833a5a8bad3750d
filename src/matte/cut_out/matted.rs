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
use crate::matte::segment::PixelGroups;
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
        let bare = bare_screen(screen, region);
        let inside = well_inside(&region.cut);
        let open = open_pockets(&bare, &inside, region);
        let cut = region
            .cut
            .zip_map(&open, |c, open| if open { Coverage(0.0) } else { c });
        let cutout = region.photo.zip_map(&cut, |p, m| p.opaque().masked(m));
        let enclosed = warning_of_bare(share_inside(&bare, &well_inside(&cut)), ENCLOSED);
        let left_out = warning_of_bare(share_inside(&open, &inside), LEFT_OUT);
        Self {
            diagnostics: enclosed.into_iter().chain(left_out).collect(),
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
/// What becomes of it where the object encloses it.
const ENCLOSED: &str =
    " but is cut out as part of the object; with the method \"physical\" it is see-through";
/// What becomes of it where it reaches the rim.
const LEFT_OUT: &str =
    " up to its rim and is left out; if it belongs to the object, draw the outline there";

/// Where more of an outline would be left out, it is the object that has the screen's colour.
const MAX_OPEN_SHARE: f64 = 0.5;
/// Bare screen reaches so far beyond the pixels without anything else around them.
const EDGE_PX: f64 = 1.5;

/// Bare screen, as between the turns of a wire; none where the screen has no colour to tell it from
/// clear plastic.
fn bare_screen(screen: &CleanScreen, region: &ObjectRegion) -> Mask {
    let (w, h) = region.photo.size();
    if !is_keyable(screen.color) {
        return Image::new(w, h);
    }
    let plate = screen.plate.crop(region.around).image;
    let key = strongest_channel(screen.color);
    let smooth = filter::box_blur(&region.photo, 1);
    let bare = smooth.zip_map(&plate, |p, k| is_bare_screen(p.into(), k.into(), key));
    unclaimed(bare, region.claims.as_ref())
}

/// Bare screen within an outline that was searched, and not drawn, which hangs together with what
/// is outside: that of a corner that the outline cuts off.
fn open_pockets(bare: &Mask, inside: &Mask, region: &ObjectRegion) -> Mask {
    let drawn = region.drawn.as_ref();
    let outside = region.cut.map(|c| c.0 <= 0.5);
    let bare = unclaimed(bare.clone(), drawn);
    let groups = PixelGroups::new(&outside.zip_map(&bare, |outside, bare| outside || bare));
    let reached = groups.sizes(&outside);
    let open = groups.only(|group| reached[group] > 0);
    if share_inside(&open, inside) > MAX_OPEN_SHARE {
        let (w, h) = open.size();
        return Image::new(w, h);
    }
    // What lies along the rim alone is the outline's error.
    let pockets = open.zip_map(inside, |open, inside| open && inside);
    let near = filter::dilate(&pockets, RIM_PX + 1.0);
    let whole = open.zip_map(&near, |open, near| open && near);
    let whole = unclaimed(filter::dilate(&whole, EDGE_PX), drawn);
    unclaimed(whole, region.claims.as_ref())
}

/// What an outline encloses, without its rim.
fn well_inside(cut: &Image<Coverage>) -> Mask {
    filter::erode(&cut.map(|c| c.0 > 0.5), RIM_PX)
}

/// The share of a set of pixels that another one has.
fn share_inside(part: &Mask, inside: &Mask) -> f64 {
    let shared = part.zip_map(inside, |part, inside| part && inside);
    shared.count() as f64 / inside.count().max(1) as f64
}

/// The warning about a share of bare screen within an outline, with what became of it.
fn warning_of_bare(share: f64, what: &str) -> Option<Diagnostic> {
    (share > MAX_BARE_SHARE).then(|| {
        let share = 100.0 * share;
        let message =
            format!("{share:.0} % of what the outline encloses looks like bare screen{what}");
        Diagnostic::warning(Code::ScreenLikeParts, message)
    })
}

/// Mean of a matte where a mask is set; 0 where it is empty.
fn mean_matte(matte: &Image<Coverage>, set: &Mask) -> f32 {
    let pixels = matte.pixels_in(set);
    let (sum, count) = pixels.fold((0.0, 0_u64), |(sum, count), m| {
        (sum + f64::from(m.0), count + 1)
    });
    (sum / count.max(1) as f64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Roi;
    use crate::matte::plate::ScreenPlate;

    const SIZE: (usize, usize) = (120, 100);
    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);
    const RED: LinearRgb = LinearRgb::new(0.5, 0.05, 0.05);

    fn in_box(x: usize, y: usize) -> bool {
        (20..100).contains(&x) && (20..80).contains(&y)
    }

    /// Two bars at a right angle.
    fn is_angle(x: usize, y: usize) -> bool {
        in_box(x, y) && (x < 40 || y >= 60)
    }

    /// The region of a red object on green, by an outline.
    fn region(
        is_object: impl Fn(usize, usize) -> bool + Sync,
        is_within: impl Fn(usize, usize) -> bool + Sync,
    ) -> ObjectRegion {
        let (width, height) = SIZE;
        let whole = Roi::spanning(0..width, 0..height);
        let paint = |x: usize, y: usize| if is_object(x, y) { RED } else { GREEN };
        ObjectRegion {
            around: whole,
            kept: whole,
            scale: 1.0,
            photo: Image::from_fn(width, height, paint),
            cut: Image::from_fn(width, height, is_within).to_coverage(),
            claims: None,
            drawn: None,
        }
    }

    fn by_outline(region: &ObjectRegion) -> Matted {
        let screen = CleanScreen {
            background: Image::new(SIZE.0, SIZE.1),
            plate: ScreenPlate::even(GREEN, SIZE),
            color: GREEN,
        };
        Matted::outline(&screen, region)
    }

    fn is_opaque(matted: &Matted, at: (usize, usize)) -> bool {
        matted.film[at].to_rgba().a > 0.5
    }

    /// An outline from the end of one bar straight to that of the other.
    #[test]
    fn the_screen_in_a_corner_that_the_outline_cuts_off_is_left_out() {
        let is_hull = |x, y| in_box(x, y) && 3 * (y - 20) + 80 >= 2 * x;
        let mut region = region(is_angle, is_hull);
        let searched = by_outline(&region);
        assert!(searched.diagnostics[0].message.contains("is left out"));
        let opaque = Image::from_fn(SIZE.0, SIZE.1, |x, y| is_opaque(&searched, (x, y)));
        let angle = Image::from_fn(SIZE.0, SIZE.1, is_angle);
        // All of the object, and of the 1200 pixels of screen those in the tips of the corner.
        assert_eq!(share_inside(&opaque, &angle), 1.0);
        assert!(opaque.count() < angle.count() + 40, "{}", opaque.count());
        // What a person drew is the outline.
        region.drawn = Some(Image::filled(SIZE.0, SIZE.1, Some(true)));
        let drawn = by_outline(&region);
        assert!(is_opaque(&drawn, (44, 56)) && !is_opaque(&searched, (44, 56)));
        assert_eq!(drawn.diagnostics.len(), 1);
    }

    #[test]
    fn the_screen_that_an_object_encloses_is_kept_and_warned_of() {
        let is_frame = |x, y| in_box(x, y) && !((30..90).contains(&x) && (30..70).contains(&y));
        let matted = by_outline(&region(is_frame, in_box));
        assert!(is_opaque(&matted, (60, 50)) && !is_opaque(&matted, (10, 50)));
        assert_eq!(matted.diagnostics.len(), 1);
    }

    #[test]
    fn an_object_of_the_screen_s_colour_is_no_screen() {
        let matted = by_outline(&region(|_, _| false, in_box));
        assert!(is_opaque(&matted, (60, 50)) && is_opaque(&matted, (21, 21)));
        assert_eq!(matted.diagnostics.len(), 1);
    }
}
