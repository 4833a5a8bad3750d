//! Cut-out: segmentation, screen plate and matte in one go, trimmed to the object.

use super::film::{ColorUncertainty, FilmMatte, FilmOptions, PartOf, film_of_part};
use super::key::{KeyOptions, Keying, Screen};
use super::outline::Outline;
use super::plate::{PlateOptions, ScreenPlate};
use super::screen::{screen_color, screen_pixels};
use super::segment::{SegmentOptions, Segmentation, segment};
use crate::bounds::Bounds;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Mask, Roi};
use crate::pixel::{Coverage, Film, LinearRgb, Mix, PremulRgba};
use crate::stopwatch::Stopwatch;
use serde::{Deserialize, Serialize};

/// How a photo becomes a cut-out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CutOutOptions {
    /// How the object is found.
    pub segment: SegmentOptions,
    /// How the screen is fitted.
    pub plate: PlateOptions,
    /// How film is solved for.
    pub film: FilmOptions,
    /// How the object is keyed, where that is asked for.
    pub key: KeyOptions,
    /// Colour of an evenly lit screen, scene-linear; nothing = fitted to the photo. Default: nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub screen: Option<LinearRgb>,
    /// Where the matte comes from; nothing = physical. Default: nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<MatteMethod>,
    /// What a matte is cut to. Default: `tight`.
    pub within: Within,
    /// Softness of the edge that the cut makes, standard deviation in pixels. Default: 0.6.
    pub soften_px: f32,
    /// Empty pixels kept around the hull. Default: 4.
    pub margin_px: usize,
    /// Longer side of the cut-out, pixels; larger ones are reduced to it. Default: 2048.
    pub longest_side: usize,
}

impl Default for CutOutOptions {
    fn default() -> Self {
        Self {
            segment: SegmentOptions::default(),
            plate: PlateOptions::default(),
            film: FilmOptions::default(),
            key: KeyOptions::default(),
            screen: None,
            method: None,
            within: Within::Tight,
            soften_px: 0.6,
            margin_px: 4,
            longest_side: 2048,
        }
    }
}

/// Where a matte comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MatteMethod {
    /// From reflected light and transmittance, solved for in every pixel: see-through plastic keeps its own light only.
    /// Guessed on a screen without a hue, and that is said.
    #[default]
    Physical,
    /// From the screen's colour, as Blender's Keying node does: see-through plastic is see-through.
    Key,
    /// From the object's outline alone: nothing is see-through, and what shines through is part of the object.
    Outline,
}

impl std::fmt::Display for MatteMethod {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Physical => "physical",
            Self::Key => "key",
            Self::Outline => "outline",
        })
    }
}

/// What a matte is cut to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Within {
    /// The outline that follows hollows.
    #[default]
    Tight,
    /// The convex hull, as the paper has it: the screen's shadows stay in the hollows.
    Hull,
}

/// An object without its background.
#[derive(Clone, Debug)]
pub struct CutOut {
    /// The object's own light and what it lets through, scene-linear, trimmed to its hull and a margin.
    pub film: Image<Film>,
    /// Transmittance as measured, the object's own shadow on the screen included; 1 outside. Of the size of `film`.
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
    pub residue: f32,
    /// What makes its colours and its transmittance wrong; of the physical matte only.
    pub color_uncertainty: Option<ColorUncertainty>,
    /// What a person should know, of the segmentation, the screen and the matte.
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

/// A matte that leaves more than this of the screen is worth a warning: what it leaves veils the object, too.
const RESIDUE: f32 = 0.2;

/// A screen that is clipped in more of its pixels than this is worth a look: a plate goes on under the object, so a corner
/// beside a lamp may be clipped.
const CLIPPED_SCREEN: f32 = 0.1;

/// The warning about a screen that is too bright for the camera; none where the matte does not ask for the screen.
fn clipped_screen(
    photo: &Image<LinearRgb>,
    found: &Segmentation,
    method: MatteMethod,
    clipped: f32,
) -> Option<Diagnostic> {
    if method == MatteMethod::Outline {
        return None;
    }
    let outside = photo
        .pixels()
        .iter()
        .zip(found.mask.pixels())
        .filter(|(_, m)| m.0 <= 0.0);
    let (all, count) = outside.fold((0_u64, 0_u64), |(all, count), (p, _)| {
        (all + 1, count + u64::from(p.r.max(p.g).max(p.b) >= clipped))
    });
    let share = count as f32 / all.max(1) as f32;
    (share > CLIPPED_SCREEN).then(|| {
        let message = format!(
            "{:.0} % of the screen is clipped: transmittance cannot be measured; use a shorter exposure",
            100.0 * share
        );
        Diagnostic::warning(Code::ClippedScreen, message)
    })
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

/// Cuts the one object out of a photo on a uniform screen or board.
///
/// `photo` is scene-linear. On a screen too grey to be keyed what is see-through is guessed, and a [`Diagnostic`] says so.
///
/// # Errors
/// Those of [`segment`] and of [`ScreenPlate::fit`]; [`Error::Value`] (`key.clip_black`, `soften_px`, ..) for an option
/// that cannot be right.
pub fn cut_out(photo: &Image<LinearRgb>, opts: &CutOutOptions) -> Result<CutOut> {
    cut_out_on(photo, None, opts)
}

/// As [`cut_out`], with a photo of the empty screen where there is one.
///
/// # Errors
/// Those of [`cut_out`] and of [`ScreenPlate::from_photo`].
pub fn cut_out_on(
    photo: &Image<LinearRgb>,
    empty: Option<&Image<LinearRgb>>,
    opts: &CutOutOptions,
) -> Result<CutOut> {
    opts.check()?;
    let mut watch = Stopwatch::start();
    let segmentation = segment(photo, &opts.segment).map_err(|e| e.within("segment"))?;
    watch.lap("segment");
    let plate = plate(photo, empty, &segmentation, opts)?;
    watch.lap("plate");
    let screen = plate.color();
    let method = opts.method.unwrap_or_default();
    let whole = match opts.within {
        Within::Tight => &segmentation.tight,
        Within::Hull => &segmentation.mask,
    };
    let roi = trimmed(&segmentation.hull, opts.margin_px, photo.size());
    // There is nothing to solve far from the object; near it blurs must find what they would find in the whole photo.
    let around = trimmed(
        &segmentation.hull,
        opts.margin_px.max(opts.reach_px()),
        photo.size(),
    );
    let part = photo.crop(around);
    let cut = softened(&whole.crop(around), opts.soften_px);
    watch.lap("cut");
    let matted = match method {
        MatteMethod::Physical => {
            let known = PartOf {
                screen,
                longer_side: photo.width().max(photo.height()),
            };
            Matted::physical(&part, &plate.crop(around), &cut, known, opts)?
        }
        MatteMethod::Key => Matted::keyed(photo, &plate, &segmentation, &cut, around, opts)?,
        MatteMethod::Outline => Matted::grey(part.zip_map(&cut, |p, m| p.opaque().masked(m)), 0.0),
    };
    watch.lap("matte");
    let trim = Roi {
        x: roi.x - around.x,
        y: roi.y - around.y,
        ..roi
    };
    let scale = (opts.longest_side as f64 / roi.width.max(roi.height) as f64).min(1.0);
    let corner = Point2::new(roi.x as f64, roi.y as f64);
    let moved = |p: Point2<f64>| Point2::from((p - corner) * scale);
    let mut diagnostics = segmentation.diagnostics.clone();
    diagnostics.extend(matted.diagnostics);
    diagnostics.extend((matted.residue > RESIDUE).then(|| residual_matte(matted.residue)));
    diagnostics.extend(clipped_screen(
        photo,
        &segmentation,
        method,
        opts.film.clipped,
    ));
    let film = reduced(matted.film.crop(trim), scale);
    let transmittance = reduced(matted.transmittance.crop(trim), scale);
    let uncertainty = reduced(matted.uncertainty.crop(trim), scale);
    watch.lap("trim");
    watch.log("cut out");
    Ok(CutOut {
        film,
        transmittance,
        uncertainty,
        hull: segmentation.hull.iter().map(|p| moved(*p)).collect(),
        outline: segmentation.outline.map(moved),
        roi,
        scale,
        screen,
        unevenness: plate.unevenness,
        method,
        residue: matted.residue,
        color_uncertainty: matted.color_uncertainty,
        diagnostics,
        segmentation,
    })
}

/// How far the film of a pixel looks around, pixels: to fill in what is clipped.
const FILM_REACH_PX: usize = 16;
/// Standard deviations at which a soft edge ends.
const SOFT_REACH: f32 = 4.0;

impl CutOutOptions {
    /// How far around the object something may depend on, pixels.
    fn reach_px(&self) -> usize {
        FILM_REACH_PX + (SOFT_REACH * self.soften_px).ceil() as usize
    }

    /// Fails on the first option that cannot be right, of whichever stage.
    pub(crate) fn check(&self) -> Result<()> {
        self.segment.check().map_err(|e| e.within("segment"))?;
        self.plate.check().map_err(|e| e.within("plate"))?;
        self.film.check().map_err(|e| e.within("film"))?;
        self.key.check()?;
        Bounds::new(0.0, 100.0, "pixels").check("soften_px", self.soften_px.into())?;
        Bounds::new(0.0, 10_000.0, "pixels").check("margin_px", self.margin_px as f64)?;
        Bounds::new(16.0, 32_768.0, "pixels").check("longest_side", self.longest_side as f64)?;
        if let Some(screen) = self
            .screen
            .filter(|c| !c.is_finite() || [c.r, c.g, c.b].iter().any(|v| *v < 0.0))
        {
            let what = format!(
                "{:?}, expected numbers of at least 0",
                <[f32; 3]>::from(screen)
            );
            return Err(Error::value("screen", what));
        }
        Ok(())
    }
}

fn plate(
    photo: &Image<LinearRgb>,
    empty: Option<&Image<LinearRgb>>,
    found: &Segmentation,
    opts: &CutOutOptions,
) -> Result<ScreenPlate> {
    let background = screen_pixels(&found.mask);
    match (empty, opts.screen) {
        (Some(empty), _) => ScreenPlate::from_photo(empty, photo, &background, &opts.plate),
        (None, Some(color)) => Ok(ScreenPlate::even(color, photo.size())),
        // A margin around a large object may leave nothing; the mask alone then leaves a rim, which gives a colour.
        (None, None) if !background.pixels().contains(&true) => Ok(ScreenPlate::even(
            screen_color(photo, &found.mask)?,
            photo.size(),
        )),
        (None, None) => {
            ScreenPlate::fit(photo, &background, &opts.plate).map_err(|e| e.within("plate"))
        }
    }
}

/// What a method makes of the part of the photo around the object.
struct Matted {
    film: Image<Film>,
    transmittance: Image<LinearRgb>,
    uncertainty: Image<f32>,
    residue: f32,
    color_uncertainty: Option<ColorUncertainty>,
    diagnostics: Vec<Diagnostic>,
}

impl Matted {
    fn physical(
        photo: &Image<LinearRgb>,
        plate: &ScreenPlate,
        cut: &Image<Coverage>,
        known: PartOf,
        opts: &CutOutOptions,
    ) -> Result<Self> {
        let solved =
            film_of_part(photo, plate, cut, known, &opts.film).map_err(|e| e.within("film"))?;
        let FilmMatte {
            film,
            transmittance,
            uncertainty,
            color_uncertainty,
            diagnostics,
            ..
        } = solved;
        // Film is empty outside the cut.
        Ok(Self {
            film,
            transmittance,
            uncertainty,
            residue: 0.0,
            color_uncertainty: Some(color_uncertainty),
            diagnostics,
        })
    }

    fn keyed(
        photo: &Image<LinearRgb>,
        plate: &ScreenPlate,
        found: &Segmentation,
        cut: &Image<Coverage>,
        around: Roi,
        opts: &CutOutOptions,
    ) -> Result<Self> {
        let keyed = Keying::new(photo, Screen::Plate(&plate.image))
            .run(&opts.key)
            .map_err(|e| e.within("key"))?;
        let residue = mean(&keyed.matte, &screen_pixels(&found.mask));
        Ok(Self::grey(
            keyed.cutout.crop(around).zip_map(cut, |p, m| p.masked(m)),
            residue,
        ))
    }

    /// A cut-out of one alpha for all channels, which is taken for the transmittance as well.
    fn grey(image: Image<PremulRgba>, residue: f32) -> Self {
        Self {
            film: image.map(Film::from),
            transmittance: image.map(|p| LinearRgb::grey(1.0 - p.a)),
            uncertainty: Image::new(image.width(), image.height()),
            residue,
            color_uncertainty: None,
            diagnostics: Vec::new(),
        }
    }
}

fn softened(mask: &Image<Coverage>, sigma_px: f32) -> Image<Coverage> {
    if sigma_px <= 0.0 {
        return mask.clone();
    }
    // The weights of the blur sum to 1 only as far as rounding goes; more than all of a pixel is not sound.
    filter::gaussian_blur(mask, sigma_px).map(|c| Coverage(c.0.clamp(0.0, 1.0)))
}

fn mean(matte: &Image<Coverage>, set: &Mask) -> f32 {
    let chosen = matte
        .pixels()
        .iter()
        .zip(set.pixels())
        .filter(|(_, inside)| **inside);
    let (sum, count) = chosen.fold((0.0, 0u64), |(sum, count), (m, _)| {
        (sum + f64::from(m.0), count + 1)
    });
    if count == 0 {
        0.0
    } else {
        (sum / count as f64) as f32
    }
}

/// The whole pixels that a hull and a margin around it cover.
fn trimmed(hull: &[Point2<f64>], margin_px: usize, (w, h): (usize, usize)) -> Roi {
    let range = |along: fn(&Point2<f64>) -> f64, len: usize| {
        let (low, high) = hull
            .iter()
            .map(along)
            .fold((f64::MAX, 0.0), |(l, h): (f64, f64), v| {
                (l.min(v), h.max(v))
            });
        (low.max(0.0) as usize).min(len)..(high.ceil() as usize).min(len)
    };
    Roi::spanning(range(|p| p.x, w), range(|p| p.y, h)).grown(margin_px, w, h)
}

/// A picture made smaller by a factor.
fn reduced<P: Mix>(image: Image<P>, scale: f64) -> Image<P> {
    if scale >= 1.0 {
        return image;
    }
    let side = |len: usize| ((len as f64 * scale).round() as usize).max(1);
    filter::resize(&image, side(image.width()), side(image.height()))
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!((cut.screen.g - GREEN.g).abs() < 1e-6 && cut.residue < 1e-6);
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
    fn a_white_board_leaves_paint_opaque_and_is_a_doubt() {
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
    fn the_hull_is_told_in_pixels_of_the_cut_out() {
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
        let opts: CutOutOptions = toml::from_str(
            "method = \"key\"\nwithin = \"hull\"\n[segment]\nlevels = 5\nfirst_threshold = { noise = 8.0 }\n[key]\nclip_black = 0.1\n",
        )
        .unwrap();
        assert_eq!(
            (opts.within, opts.segment.first_threshold),
            (Within::Hull, super::super::Threshold::Noise(8.0))
        );
        let back: CutOutOptions = toml::from_str(&toml::to_string(&opts).unwrap()).unwrap();
        assert_eq!(back, opts);
        let wrong = CutOutOptions {
            segment: SegmentOptions {
                levels: Some(99),
                ..Default::default()
            },
            ..opts
        };
        let said = cut_out(&slab(GREEN), &wrong).unwrap_err().to_string();
        assert_eq!(said, "segment.levels: 99, expected 2 to 8");
    }
}
