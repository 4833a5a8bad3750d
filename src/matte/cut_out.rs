//! Cut-out: segmentation, screen plate and matte in one go, trimmed to the object.

mod matted;
mod options;
mod pieces;

pub use options::{Boundary, CutOutOptions, MatteMethod};

use super::check::check_photo;
use super::clipping::clipped_screen;
use super::film::ColorUncertainty;
use super::outline::Outline;
use super::plate::{PlateOptions, ScreenPlate};
use super::prepared::Prepared;
use super::screen::{mean_color, screen_color, screen_pixels};
use super::screen_edge::screen_edge_seen;
use super::segment::hull::sides;
use super::segment::{Segmentation, segment_prepared};
use super::stroke::{Claims, Stroke, StrokesOnPhoto, check_strokes, corrected_coverage, unclaimed};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Mask, Roi};
use crate::pixel::{Coverage, Film, LinearRgb, Mix, PremulRgba};
use crate::stopwatch::Stopwatch;
use matted::Matted;
use pieces::separate_piece;

/// An object without its background.
#[derive(Clone, Debug)]
pub struct CutOut {
    /// The object's own light and what it lets through, scene-linear, trimmed to its hull and a
    /// margin.
    pub film: Image<Film>,
    /// Transmittance as measured, the object's own shadow on the screen included; 1 outside. Of
    /// the size of `film`.
    pub transmittance: Image<LinearRgb>,
    /// Expected error of the transmittance, 0 to 1. Of the size of `film`.
    pub uncertainty: Image<f32>,
    /// Convex hull of the object in pixels of `film`, clockwise as seen.
    pub hull: Vec<Point2<f64>>,
    /// Tight outline of the object in pixels of `film`.
    pub outline: Outline,
    /// The part of the photo that `film` shows.
    pub roi: Roi,
    /// Pixels of `film` for one pixel of the photo: 1 unless the cut-out had to be reduced.
    pub scale: f64,
    /// Mean colour of the screen, scene-linear.
    pub screen: LinearRgb,
    /// How uneven the screen is: 1 minus darkest over brightest.
    pub unevenness: f32,
    /// Where the matte came from.
    pub method: MatteMethod,
    /// Mean matte on the screen outside the object, where it should be 0.
    pub residual_matte: f32,
    /// What makes its colours and its transmittance wrong; for the physical matte only.
    pub color_uncertainty: Option<ColorUncertainty>,
    /// Notes and warnings about the segmentation, the screen and the matte.
    pub diagnostics: Vec<Diagnostic>,
    /// Where the object was found in the photo.
    pub segmentation: Segmentation,
}

impl CutOut {
    /// The cut-out with one alpha for all channels.
    pub fn to_rgba(&self) -> Image<PremulRgba> {
        self.film.map(Film::to_rgba)
    }
}

/// Cuts the one object out of a photo on a uniform screen or board.
///
/// `photo` is scene-linear. On a screen too grey to be keyed the transmittance of plastic is
/// assumed, and a [`Diagnostic`] says so.
///
/// # Errors
/// Those of [`segment`](super::segment()) and of [`ScreenPlate::fit`];
/// [`Error::Photo`](crate::Error::Photo) where the screen has another colour than the given one;
/// [`Error::Value`](crate::Error::Value) (`key.clip_black`, `soften_px`, ..) for an option that
/// cannot be right.
pub fn cut_out(photo: &Image<LinearRgb>, options: &CutOutOptions) -> Result<CutOut> {
    cut_out_corrected(photo, None, &[], options)
}

/// As [`cut_out`], with a photo of the empty screen where there is one, corrected by what a person
/// painted on the photo.
///
/// # Errors
/// Those of [`cut_out`] and of [`ScreenPlate::from_photo`]; [`Error::Value`](crate::Error::Value)
/// (`strokes[2].radius_px`) for a stroke that cannot be right.
pub fn cut_out_corrected(
    photo: &Image<LinearRgb>,
    empty: Option<&Image<LinearRgb>>,
    strokes: &[Stroke],
    options: &CutOutOptions,
) -> Result<CutOut> {
    options.check()?;
    check_strokes(strokes)?;
    let mut watch = Stopwatch::start();
    let prepared = Prepared::new(photo, options.segment.working_size)?;
    let strokes = StrokesOnPhoto::new(strokes, photo);
    let claims = PhotoClaims::new(strokes);
    let segmentation = segment_prepared(&prepared, strokes, &options.segment)?;
    watch.lap("segment");
    let screen = CleanScreen::new(photo, empty, &segmentation, &claims, options)?;
    watch.lap("plate");
    let region = ObjectRegion::new(&prepared, &segmentation, &claims, options);
    watch.lap("cut");
    let cut = cut_segmented(
        &prepared,
        segmentation,
        &screen,
        &region,
        options,
        &mut watch,
    )?;
    watch.log("cut out");
    Ok(cut)
}

/// Cuts out an object that is found, on a screen that is known.
fn cut_segmented(
    prepared: &Prepared<'_>,
    segmentation: Segmentation,
    screen: &CleanScreen,
    region: &ObjectRegion,
    options: &CutOutOptions,
    watch: &mut Stopwatch,
) -> Result<CutOut> {
    let matted = Matted::new(prepared, screen, region, options)?;
    watch.lap("matte");
    let mut told = diagnostics(prepared.photo, &segmentation, screen, &matted, options);
    told.extend(separate_piece(&matted.film, region, prepared.photo.size()));
    let cut = region.cut_out(matted, segmentation, screen, told);
    watch.lap("trim");
    Ok(cut)
}

/// What a person says of the pixels of a photo.
struct PhotoClaims {
    outline: Option<Claims>,
    transmittance: Option<Claims>,
}

impl PhotoClaims {
    fn new(strokes: StrokesOnPhoto<'_>) -> Self {
        Self {
            outline: strokes.about_outline(strokes.photo),
            transmittance: strokes.about_transmittance(),
        }
    }
}

/// The screen around and behind the object.
struct CleanScreen {
    /// The pixels that surely show nothing but the screen.
    background: Mask,
    plate: ScreenPlate,
    /// Mean colour of the plate.
    color: LinearRgb,
}

impl CleanScreen {
    fn new(
        photo: &Image<LinearRgb>,
        empty: Option<&Image<LinearRgb>>,
        found: &Segmentation,
        claims: &PhotoClaims,
        options: &CutOutOptions,
    ) -> Result<Self> {
        // What is said not to be the object may be dirt.
        let background = unclaimed(screen_pixels(&found.mask), claims.outline.as_ref());
        let plate = match (empty, options.screen) {
            (Some(empty), _) => ScreenPlate::from_photo(empty, photo, &background, &options.plate)?,
            (None, Some(color)) => even_plate(color, photo, &background)?,
            (None, None) => fitted_plate(photo, &background, &found.mask, &options.plate)?,
        };
        Ok(Self {
            background,
            color: plate.color(),
            plate,
        })
    }
}

/// A given colour may differ from the photo's by this share of the screen's brightness, in the
/// median over the screen: its light is uneven.
const MAX_COLOR_MISMATCH: f32 = 0.3;

/// The plate of a given colour.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) where the photo shows another one.
fn even_plate(
    color: LinearRgb,
    photo: &Image<LinearRgb>,
    background: &Mask,
) -> Result<ScreenPlate> {
    let plate = ScreenPlate::even(color, photo.size());
    let mismatch = plate.mismatch(photo, background);
    check_photo(mismatch <= MAX_COLOR_MISMATCH, || {
        let seen = mean_color(photo.pixels_in(background)).unwrap_or_default();
        let [seen, given] = [seen, color].map(LinearRgb::channels);
        format!(
            "the screen is {seen:.2?} in the photo, expected the given {given:.2?} (scene-linear)"
        )
    })?;
    Ok(plate)
}

/// The plate by the photo alone.
fn fitted_plate(
    photo: &Image<LinearRgb>,
    background: &Mask,
    mask: &Image<Coverage>,
    options: &PlateOptions,
) -> Result<ScreenPlate> {
    // A margin around a large object may leave nothing; the mask alone then leaves a rim, which
    // gives a colour.
    if !background.pixels().contains(&true) {
        let color = screen_color(photo, mask)?;
        return Ok(ScreenPlate::even(color, photo.size()));
    }
    ScreenPlate::fit(photo, background, options).map_err(|e| e.within("plate"))
}

/// The part of a photo around the object: there is nothing to solve elsewhere.
struct ObjectRegion {
    /// Its place in the photo. Blurs near the object find in it what they would find in the whole
    /// photo.
    around: Roi,
    /// The hull and the margin that is kept.
    kept: Roi,
    /// Pixels of the cut-out for one pixel of the photo.
    scale: f64,
    photo: Image<LinearRgb>,
    /// What the matte is cut to.
    cut: Image<Coverage>,
    /// What a person says of the transmittance.
    claims: Option<Claims>,
    /// What a person says of the outline.
    drawn: Option<Claims>,
}

impl ObjectRegion {
    fn new(
        prepared: &Prepared<'_>,
        found: &Segmentation,
        claims: &PhotoClaims,
        options: &CutOutOptions,
    ) -> Self {
        let size = prepared.photo.size();
        let around = hull_roi(&found.hull, options.margin_px.max(options.reach_px()), size);
        let cropped = |claims: &Option<Claims>| claims.as_ref().map(|said| said.crop(around));
        let boundary = options.within.of_object(found).crop(around);
        let drawn = cropped(&claims.outline);
        let boundary = corrected_coverage(boundary, drawn.as_ref());
        let kept = hull_roi(&found.hull, options.margin_px, size);
        Self {
            around,
            kept,
            scale: reduction(kept, options.longest_side),
            photo: prepared.photo.crop(around),
            cut: softened(&boundary, options.soften_px),
            claims: cropped(&claims.transmittance),
            drawn,
        }
    }

    /// A keyed picture of the region with the photo itself where a person says that it is opaque.
    fn with_core(&self, keyed: Image<PremulRgba>) -> Image<PremulRgba> {
        match &self.claims {
            Some(claims) => keyed.zip3_map(&self.photo, claims, core_or_keyed),
            None => keyed,
        }
    }

    fn kept_in_region(&self) -> Roi {
        Roi {
            x: self.kept.x - self.around.x,
            y: self.kept.y - self.around.y,
            ..self.kept
        }
    }

    /// The matte of the region, trimmed.
    fn cut_out(
        &self,
        matted: Matted,
        found: Segmentation,
        screen: &CleanScreen,
        diagnostics: Vec<Diagnostic>,
    ) -> CutOut {
        CutOut {
            film: self.cropped(&matted.film).map(Film::clamped),
            transmittance: self
                .cropped(&matted.transmittance)
                .map(|t| t.map(|t| t.clamp(0.0, 1.0))),
            uncertainty: self.cropped(&matted.uncertainty).map(|u| u.clamp(0.0, 1.0)),
            hull: found.hull.iter().map(|p| self.moved(*p)).collect(),
            outline: found.outline.map(|p| self.moved(p)),
            roi: self.kept,
            scale: self.scale,
            screen: screen.color,
            unevenness: screen.plate.unevenness,
            method: matted.method,
            residual_matte: matted.residual_matte,
            color_uncertainty: matted.color_uncertainty,
            diagnostics,
            segmentation: found,
        }
    }

    /// A point of the photo in pixels of the cut-out.
    fn moved(&self, p: Point2<f64>) -> Point2<f64> {
        let corner = Point2::new(self.kept.x as f64, self.kept.y as f64);
        Point2::from((p - corner) * self.scale)
    }

    /// A picture of the region as one of the cut-out; reduced, it may exceed its range by rounding.
    fn cropped<P: Mix>(&self, image: &Image<P>) -> Image<P> {
        let image = image.crop(self.kept_in_region());
        if self.scale >= 1.0 {
            return image;
        }
        let [width, height] = [image.width(), image.height()].map(|side| self.scaled(side));
        filter::resize(&image, width, height)
    }

    fn scaled(&self, side: usize) -> usize {
        ((side as f64 * self.scale).round() as usize).max(1)
    }
}

fn core_or_keyed(keyed: PremulRgba, photo: LinearRgb, claim: Option<bool>) -> PremulRgba {
    if claim == Some(false) {
        photo.opaque()
    } else {
        keyed
    }
}

impl Boundary {
    fn of_object(self, found: &Segmentation) -> &Image<Coverage> {
        match self {
            Self::Tight => &found.tight,
            Self::Hull => &found.mask,
        }
    }
}

/// The factor that makes the longer side of a region at most this long.
fn reduction(kept: Roi, longest_side: usize) -> f64 {
    let longer = kept.width.max(kept.height);
    (longest_side as f64 / longer as f64).min(1.0)
}

/// The whole pixels that a hull and a margin around it cover.
fn hull_roi(hull: &[Point2<f64>], margin_px: usize, (w, h): (usize, usize)) -> Roi {
    let [left, top, right, bottom] = sides(hull);
    let (xs, ys) = (whole_pixels(left, right, w), whole_pixels(top, bottom, h));
    Roi::spanning(xs, ys).grown(margin_px, w, h)
}

/// The whole pixels of a row of `len` from one coordinate to another.
fn whole_pixels(low: f64, high: f64, len: usize) -> std::ops::Range<usize> {
    (low.max(0.0) as usize).min(len)..(high.ceil() as usize).min(len)
}

fn softened(mask: &Image<Coverage>, sigma_px: f32) -> Image<Coverage> {
    if sigma_px <= 0.0 {
        return mask.clone();
    }
    // The weights of the blur sum to 1 only up to rounding, and no pixel is more than covered.
    filter::gaussian_blur(mask, sigma_px).map(|c| Coverage(c.0.clamp(0.0, 1.0)))
}

/// A matte that leaves more than this of the screen is worth a warning: what it leaves veils the
/// object, too.
const MAX_RESIDUAL_MATTE: f32 = 0.2;

/// Those of the segmentation, the matte and the screen.
fn diagnostics(
    photo: &Image<LinearRgb>,
    found: &Segmentation,
    screen: &CleanScreen,
    matted: &Matted,
    options: &CutOutOptions,
) -> Vec<Diagnostic> {
    let edge = screen_edge_seen(photo, &found.hull, screen.color, &options.segment);
    // A background that is not the screen needs no advice.
    let is_right = |d: &&Diagnostic| edge.is_none() || d.code != Code::GreyScreen;
    let of_matte = matted.diagnostics.iter().filter(is_right).cloned();
    let mut diagnostics = found.diagnostics.clone();
    diagnostics.extend(of_matte);
    diagnostics.extend(edge);
    let residual = matted.residual_matte;
    diagnostics.extend((residual > MAX_RESIDUAL_MATTE).then(|| residual_matte(residual)));
    // An outline alone does not depend on the screen.
    if matted.method != MatteMethod::Outline {
        diagnostics.extend(clipped_screen(photo, &found.mask, options.film.clipped));
        diagnostics.extend(screen.plate.unevenness_warning());
    }
    diagnostics
}

/// `share` is the mean matte on the screen.
fn residual_matte(share: f32) -> Diagnostic {
    Diagnostic::warning(
        Code::ResidualMatte,
        format_args!(
            "residual matte of {:.0} % on the screen: uneven light, or an object of the screen's hue",
            100.0 * share
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matte::Claim;
    use crate::matte::segment::{SegmentOptions, Threshold};

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    /// A slab of 60 x 30 pixels with its corner at (30, 25).
    fn slab(screen: LinearRgb) -> Image<LinearRgb> {
        Image::from_fn(120, 80, |x, y| {
            let inside = (30..90).contains(&x) && (25..55).contains(&y);
            if inside {
                LinearRgb::new(0.5, 0.05, 0.05)
            } else {
                screen
            }
        })
    }

    #[test]
    fn a_coloured_screen_is_keyed_and_gone() {
        let cut = cut_out(&slab(GREEN), &CutOutOptions::default()).unwrap();
        assert_eq!(cut.method, MatteMethod::Physical);
        assert!((cut.screen.g - GREEN.g).abs() < 1e-6 && cut.residual_matte < 1e-6);
        let image = cut.to_rgba();
        let (w, h) = image.size();
        assert_eq!(image[(0, 0)], PremulRgba::TRANSPARENT);
        assert!((image[(w / 2, h / 2)].a - 1.0).abs() < 1e-5);
        assert!(
            w.abs_diff(68) <= 2 && h.abs_diff(38) <= 2,
            "{w} x {h}: the slab and 4 pixels around it"
        );
    }

    #[test]
    fn a_white_board_leaves_paint_opaque_and_gives_a_warning() {
        let cut = cut_out(
            &slab(LinearRgb::new(0.6, 0.62, 0.7)),
            &CutOutOptions::default(),
        )
        .unwrap();
        assert_eq!(cut.method, MatteMethod::Physical);
        let image = cut.to_rgba();
        let centre = image[(image.width() / 2, image.height() / 2)];
        assert!(
            (centre.a - 1.0).abs() < 1e-3 && (centre.r - 0.5).abs() < 1e-3,
            "{centre:?}"
        );
        assert_eq!(image[(0, 0)].a, 0.0);
        assert!(
            cut.diagnostics
                .iter()
                .any(|d| d.code == Code::GreyScreen && d.needs_review()),
            "{:?}",
            cut.diagnostics
        );
    }

    #[test]
    fn softening_covers_no_pixel_more_than_all() {
        for sigma in [0.3, 0.6, 1.0, 2.5] {
            let soft = softened(&Image::filled(40, 30, Coverage(1.0)), sigma);
            assert!(
                soft.pixels()
                    .iter()
                    .all(|c| (0.0..=1.0).contains(&c.0) && c.0 > 0.999)
            );
        }
    }

    #[test]
    fn a_given_colour_of_the_screen_is_one_that_the_photo_shows() {
        let with = |color| {
            let options = CutOutOptions {
                screen: Some(color),
                ..Default::default()
            };
            cut_out(&slab(GREEN), &options)
        };
        let cut = with(GREEN.scale(1.2)).unwrap();
        assert!(opacity_at(&cut, [60, 40]) > 0.9);
        for wrong in [GREEN.scale(2.0), LinearRgb::new(11.0, 107.0, 20.0)] {
            let said = with(wrong).unwrap_err().to_string();
            let expected = "the screen is [0.04, 0.40, 0.08] in the photo";
            assert!(said.contains(expected), "{said}");
        }
    }

    fn painted(says: Claim, radius_px: f64, points_px: &[[f64; 2]]) -> Stroke {
        Stroke {
            says,
            radius_px,
            points_px: points_px.into(),
        }
    }

    fn corrected(photo: &Image<LinearRgb>, strokes: &[Stroke]) -> Result<CutOut> {
        cut_out_corrected(photo, None, strokes, &CutOutOptions::default())
    }

    fn clear_plastic() -> LinearRgb {
        GREEN.scale(0.56) + LinearRgb::grey(0.02)
    }

    /// A clear slab with a patch.
    fn clear_slab(patch: LinearRgb) -> Image<LinearRgb> {
        Image::from_fn(120, 80, |x, y| match (x, y) {
            (50..70, 30..50) => patch,
            (30..90, 25..55) => clear_plastic(),
            _ => GREEN,
        })
    }

    /// A photo cut out without a stroke, and with it.
    fn without_and_with(photo: &Image<LinearRgb>, stroke: Stroke) -> [CutOut; 2] {
        [&[] as &[Stroke], &[stroke]].map(|strokes| corrected(photo, strokes).unwrap())
    }

    /// The film at a pixel of the photo; nothing outside the cut-out.
    fn film_at(cut: &CutOut, [x, y]: [usize; 2]) -> Film {
        let [x, y] = [x.wrapping_sub(cut.roi.x), y.wrapping_sub(cut.roi.y)];
        let (w, h) = cut.film.size();
        if x < w && y < h {
            cut.film[(x, y)]
        } else {
            Film::default()
        }
    }

    fn opacity_at(cut: &CutOut, at: [usize; 2]) -> f32 {
        film_at(cut, at).to_rgba().a
    }

    #[test]
    fn what_is_said_to_be_the_object_is_cut_out_with_it_and_what_is_not_is_left() {
        let slab = slab(GREEN);
        let ear = painted(Claim::Object, 5.0, &[[60.0, 25.0], [60.0, 15.0]]);
        let bite = painted(Claim::NotObject, 6.0, &[[30.0, 40.0]]);
        let whole = corrected(&slab, &[]).unwrap();
        let cut = corrected(&slab, &[ear, bite]).unwrap();
        let covered = |cut: &CutOut, at| cut.segmentation.tight[at].0;
        assert_eq!(
            (covered(&whole, (60, 15)), covered(&cut, (60, 15))),
            (0.0, 1.0)
        );
        assert_eq!(
            (covered(&whole, (33, 40)), covered(&cut, (33, 40))),
            (1.0, 0.0)
        );
        assert!(opacity_at(&whole, [32, 40]) > 0.9 && opacity_at(&cut, [32, 40]) < 0.01);
        assert!(cut.hull.iter().any(|p| p.y + (cut.roi.y as f64) < 12.0));
    }

    #[test]
    fn bare_screen_within_an_outline_is_warned_of() {
        let by_outline = CutOutOptions {
            method: Some(MatteMethod::Outline),
            ..Default::default()
        };
        let warned = |strokes: &[Stroke]| {
            let cut = cut_out_corrected(&slab(GREEN), None, strokes, &by_outline).unwrap();
            let mut codes = cut.diagnostics.iter().map(|d| d.code);
            codes.any(|code| code == Code::ScreenLikeParts)
        };
        let ear = painted(Claim::Object, 10.0, &[[60.0, 25.0], [60.0, 15.0]]);
        assert_eq!([warned(&[]), warned(&[ear])], [false, true]);
    }

    #[test]
    fn a_coin_beside_the_object_is_told_unless_a_person_says_that_it_is_the_object() {
        let with_coin = |gap: usize| {
            let mut photo = slab(GREEN);
            for (x, y) in (0..8).flat_map(|x| (36..44).map(move |y| (x, y))) {
                photo[(90 + gap + x, y)] = LinearRgb::grey(0.3);
            }
            photo
        };
        let told = |gap: usize, strokes: &[Stroke]| {
            let cut = corrected(&with_coin(gap), strokes).unwrap();
            let told = cut.diagnostics.into_iter();
            told.map(|d| d.message)
                .find(|m| m.contains("bare screen separates"))
        };
        let said = told(4, &[]).unwrap();
        assert!(
            said.contains("at 82 % of the width and 50 % of the height"),
            "{said}"
        );
        let coin = painted(Claim::Object, 3.0, &[[98.0, 40.0]]);
        assert_eq!([told(0, &[]), told(4, &[coin])], [None, None]);
    }

    #[test]
    fn a_second_thing_is_no_object_where_a_person_says_so() {
        let mut photo = slab(GREEN);
        for (x, y) in (5..15).flat_map(|x| (5..70).map(move |y| (x, y))) {
            photo[(x, y)] = LinearRgb::new(0.1, 0.1, 0.6);
        }
        let said = corrected(&photo, &[]).unwrap_err().to_string();
        assert!(said.contains("two objects"), "{said}");
        let other = painted(Claim::NotObject, 9.0, &[[10.0, 2.0], [10.0, 73.0]]);
        let cut = corrected(&photo, &[other]).unwrap();
        assert!(cut.hull.iter().all(|p| p.x + cut.roi.x as f64 > 28.0));
        let both = painted(Claim::Object, 4.0, &[[10.0, 40.0], [60.0, 40.0]]);
        let cut = corrected(&photo, &[both]).unwrap();
        assert!(opacity_at(&cut, [9, 20]) > 0.9 && opacity_at(&cut, [60, 40]) > 0.9);
    }

    #[test]
    fn paint_of_the_screen_s_colour_is_opaque_where_a_person_says_so() {
        let photo = clear_slab(GREEN);
        let patch = painted(Claim::Opaque, 9.0, &[[60.0, 40.0]]);
        let [found, cut] = without_and_with(&photo, patch);
        let [before, after] = [&found, &cut].map(|cut| opacity_at(cut, [60, 40]));
        assert!(before < 0.2 && after > 0.99, "{before} {after}");
        let color = film_at(&cut, [60, 40]).color;
        assert!((color.g - GREEN.g).abs() < 0.01, "{color:?}");
        let beside = [&found, &cut].map(|cut| opacity_at(cut, [40, 30]));
        assert!((beside[0] - beside[1]).abs() < 0.02, "{beside:?}");
    }

    #[test]
    fn coloured_light_on_plastic_hides_nothing_where_a_person_says_so() {
        let orange = clear_plastic() + LinearRgb::new(0.3, 0.1, 0.0);
        let patch = painted(Claim::SeeThrough, 14.0, &[[60.0, 40.0]]);
        let [found, cut] = without_and_with(&clear_slab(orange), patch);
        let [before, after] = [&found, &cut].map(|cut| opacity_at(cut, [60, 40]));
        assert!(before > 0.9 && after < 0.4, "{before} {after}");
    }

    #[test]
    fn strokes_correct_a_keyed_cut_out_too() {
        let options = CutOutOptions {
            method: Some(MatteMethod::Key),
            within: Boundary::Hull,
            ..Default::default()
        };
        let strokes = [
            painted(Claim::Opaque, 5.0, &[[60.0, 40.0]]),
            painted(Claim::NotObject, 5.0, &[[80.0, 40.0]]),
        ];
        let clear = clear_slab(clear_plastic());
        let cut = cut_out_corrected(&clear, None, &strokes, &options).unwrap();
        assert!(opacity_at(&cut, [60, 40]) > 0.99 && opacity_at(&cut, [80, 40]) < 0.01);
        assert!((0.05..0.95).contains(&opacity_at(&cut, [45, 40])));
    }

    #[test]
    fn the_hull_is_given_in_pixels_of_the_cut_out() {
        let whole = cut_out(&slab(GREEN), &CutOutOptions::default()).unwrap();
        let left = |cut: &CutOut| cut.hull.iter().map(|p| p.x).fold(f64::MAX, f64::min);
        assert!((left(&whole) + whole.roi.x as f64 - 30.0).abs() <= 1.0);
        let half = CutOutOptions {
            longest_side: whole.film.width() / 2,
            ..Default::default()
        };
        let half = cut_out(&slab(GREEN), &half).unwrap();
        assert!((left(&half) - 0.5 * left(&whole)).abs() < 0.1 && (half.scale - 0.5).abs() < 0.01);
    }

    #[test]
    fn options_are_a_toml_table_and_named_where_they_are_wrong() {
        let options: CutOutOptions = toml::from_str(
            "method = \"key\"\nwithin = \"hull\"\n[segment]\nlevels = 5\nfirst_threshold = { noise = 8.0 }\n[key]\nclip_black = 0.1\n",
        )
        .unwrap();
        assert_eq!(
            (options.within, options.segment.finest_threshold),
            (Boundary::Hull, Threshold::Noise(8.0))
        );
        let back: CutOutOptions = toml::from_str(&toml::to_string(&options).unwrap()).unwrap();
        assert_eq!(back, options);
        let wrong = CutOutOptions {
            segment: SegmentOptions {
                levels: Some(99),
                ..Default::default()
            },
            ..options
        };
        let said = cut_out(&slab(GREEN), &wrong).unwrap_err().to_string();
        assert_eq!(said, "segment.levels: 99, expected 2 to 8");
    }
}
