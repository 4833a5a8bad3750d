//! Segmentation: where the object is, from two bands of a Laplacian pyramid.

mod band;
mod blur;
mod choose;
mod cluster;
mod confidence;
mod holes;
mod hull;
mod mattes;
mod pass;
mod snap;
mod threshold;

pub use band::LumaMode;
pub(super) use cluster::Groups;
pub use confidence::Confidence;
pub use threshold::Threshold;

use super::Outline;
use crate::bounds::Bounds;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, LinearRgb};
use crate::stopwatch::Stopwatch;
use serde::{Deserialize, Serialize};

/// How an object is found on a uniform background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentOptions {
    /// What the pyramid is made of. Default: each channel by itself.
    pub tone: LumaMode,
    /// Which band of the pyramid is the coarse one, 2 to 8; the fine one is the first. Default: nothing = the depth that
    /// the others agree with best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<usize>,
    /// Cut of the first band. Default: Otsu.
    pub first_threshold: Threshold,
    /// Cut of the last band. Default: Otsu.
    pub last_threshold: Threshold,
    /// An edge stands out at least so many times the noise, whatever the cut of the first band. Default: 6.
    pub least_contrast: f32,
    /// An edge pixel is at least so strong beside the strongest within 2 pixels, 0 to 1: thins edges. Default: 0.6.
    pub ridge: f32,
    /// Groups of fewer edge pixels are dirt or noise. Default: 4.
    pub speck: usize,
    /// Edges nearer to each other than this share of the longer side belong together. Default: 0.04.
    pub join: f64,
    /// Longer side of the picture that is searched, pixels; larger photos are reduced to it. Default: 640.
    pub working_size: usize,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            tone: LumaMode::Channels,
            levels: None,
            first_threshold: Threshold::Otsu,
            last_threshold: Threshold::Otsu,
            least_contrast: 6.0,
            ridge: 0.6,
            speck: 4,
            join: 0.04,
            working_size: 640,
        }
    }
}

/// Where the object is in a photo.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// Coverage of the hull, of the photo's size.
    pub mask: Image<Coverage>,
    /// Coverage of the object: like the hull, but follows hollows. Of the photo's size.
    pub tight: Image<Coverage>,
    /// Convex hull of the object, pixel-corner coordinates of the photo, clockwise as seen.
    pub hull: Vec<Point2<f64>>,
    /// The border of `tight`.
    pub outline: Outline,
    /// Whether the object reaches the left, top, right and bottom border of the photo: then part of it is missing.
    pub touches: [bool; 4],
    /// How far all this can be believed.
    pub confidence: Confidence,
    /// Which band of the pyramid served as the coarse one.
    pub levels: usize,
    /// Pixels of the photo for a pixel of the picture that was searched; above 1 where noise or size asked for it.
    pub reduction: f64,
    /// What a person should know.
    pub diagnostics: Vec<Diagnostic>,
    /// Every intermediate picture, in the order of the work.
    pub steps: Vec<Step>,
}

/// An intermediate picture of the segmentation.
#[derive(Clone, Debug)]
pub struct Step {
    /// What it is: a file name without ending.
    pub name: &'static str,
    /// The picture, of the size that was searched; bands are in units of noise.
    pub image: Image<f32>,
}

impl Step {
    /// The picture in the range 0 to 1 that files show: where values go above 1, their logarithms as shares of the
    /// largest.
    pub fn shown(&self) -> Image<f32> {
        let most = self
            .image
            .pixels()
            .iter()
            .fold(0.0f32, |most, v| most.max(*v));
        if most <= 1.0 {
            return self.image.clone();
        }
        let scale = 1.0 / libm::log1pf(most);
        self.image.map(|v| scale * libm::log1pf(v.max(0.0)))
    }
}

/// Finds the one object on a uniform background.
///
/// `photo` is scene-linear, at least 16 pixels a side. The object may reach the border of the photo (which is warned
/// of), but not all four.
///
/// # Method
/// A cut of a Laplacian pyramid ([Burt and Adelson 1983]): the first and the last band, brought to full size, are
/// binarised and combined by AND. Noise has no coarse structure and soft shadows have no fine one, so that what is left
/// are the object's edges; the hull is theirs. Departs from the plain method in that
/// * bands are those of the square roots of the three channels, in units of their noise along the border ([`LumaMode`]);
/// * the thresholds are Otsu's on a logarithmic scale ([`Threshold`]);
/// * the last band is spread by one of its pixels, since it passes through 0 on an edge;
/// * edges are thinned to their ridge and specks dropped;
/// * edges nearer than `join` form clusters, and only the cluster of most edge pixels is kept, so that dirt far away
///   does not blow up the hull;
/// * it is done at several depths and, against noise, picture sizes; the one that agrees best with the others and with
///   the edges is taken, and how well it does is its [`Confidence`];
/// * what the edges enclose, gaps bridged, is the object, and its outline is moved to where the photo itself changes.
/// # Errors
/// [`Error::Photo`] when there is nothing, only a speck, more than one object, or no background around the object;
/// [`Error::Value`] for an option that cannot be right.
///
/// [Burt and Adelson 1983]: https://doi.org/10.1109/TCOM.1983.1095851
pub fn segment(photo: &Image<LinearRgb>, opts: &SegmentOptions) -> Result<Segmentation> {
    opts.check()?;
    check_photo(photo)?;
    let mut watch = Stopwatch::start();
    let picture = reduced(photo, opts.working_size);
    watch.lap("reduce");
    let chosen = choose::best(&picture, opts)?;
    watch.lap("search");
    let (found, levels, touches) = (&chosen.pass, chosen.levels, chosen.pass.touches);
    let (w, h) = photo.size();
    let scale = [
        w as f64 / found.inside.width() as f64,
        h as f64 / found.inside.height() as f64,
    ];
    let reduction = scale[0].max(scale[1]);
    let to_photo = |p: Point2<f64>| Point2::new(p.x * scale[0], p.y * scale[1]);
    let resized = filter::resize(
        picture.as_ref(),
        found.inside.width(),
        found.inside.height(),
    );
    let margin_px = HOLE_MARGIN * longer_side(&resized) as f64;
    let background = holes::around(&found.inside, margin_px);
    let holed = holes::without_holes(&resized, &found.inside, &background);
    let is_hollow = holed != found.inside;
    // What is like a grey board may be clear plastic before it.
    let solid = if holes::are_told(&resized, &background) {
        holed
    } else {
        found.inside.clone()
    };
    let around = Outline::around(&filter::gaussian_blur(&solid.to_coverage(), CRACK_BLUR_PX));
    watch.lap("holes");
    let roots = photo.map(|p| p.map(|v| v.max(0.0).sqrt()));
    let outline = snap::snapped(&around.map(to_photo), &roots, reduction);
    let tips: Vec<_> = inset(&found.hull, TIP_INSET_PX)
        .into_iter()
        .map(to_photo)
        .collect();
    let hull = Outline {
        rings: outline.rings.iter().cloned().chain([tips]).collect(),
    }
    .hull();
    let confidence = Confidence {
        blur_px: blur::blur_px(&outline, &roots, reduction.max(1.0)),
        width_px: outline.width() / reduction.max(1.0),
        stray_px: hull::growth(&outline.hull(), &hull) / reduction,
        ..chosen.confidence
    };
    let mut diagnostics = found.diagnostics.clone();
    diagnostics.extend(truncation(found.touches));
    diagnostics.extend(is_hollow.then(screen_like_parts));
    let halved = picture.width() as f64 / found.inside.width() as f64;
    diagnostics.extend((halved > 1.0).then(|| noisy(halved)));
    diagnostics.extend(confidence.diagnostics());
    watch.lap("outline");
    let mask = Outline {
        rings: vec![hull.clone()],
    }
    .coverage(w, h);
    let tight = outline.coverage(w, h);
    let steps = steps(chosen, &picture);
    watch.lap("masks");
    watch.log("segment");
    Ok(Segmentation {
        mask,
        tight,
        hull,
        outline,
        touches,
        confidence,
        levels,
        reduction,
        diagnostics,
        steps,
    })
}

/// Width of the zone around the object that is not asked for the screen, as a share of the longer side: contact shadows.
const HOLE_MARGIN: f64 = 0.04;
/// Blur that turns the cracks between pixels into a line, pixels of the search.
const CRACK_BLUR_PX: f32 = 0.7;

/// By how much the hull of the edges is drawn in before it widens that of the outline, pixels of the search: edges are
/// told to a pixel; tips that are too thin to enclose anything reach farther than that.
const TIP_INSET_PX: f64 = 1.0;

/// A convex polygon's corners moved towards its middle.
fn inset(hull: &[Point2<f64>], by: f64) -> Vec<Point2<f64>> {
    let middle = hull.iter().fold(Point2::origin(), |sum, p| {
        sum + p.coords / hull.len() as f64
    });
    let moved = |p: &Point2<f64>| {
        let inwards = middle - p;
        if inwards.norm() > by {
            p + inwards * (by / inwards.norm())
        } else {
            middle
        }
    };
    hull.iter().map(moved).collect()
}

/// The pictures (a) to (e) of the paper's Figure 2, and what lies between.
fn steps(chosen: choose::Chosen, picture: &Image<LinearRgb>) -> Vec<Step> {
    let choose::Chosen {
        pass,
        first,
        first_binary,
        ..
    } = chosen;
    let both = first_binary.zip_map(&pass.last_binary, |a, b| a && b);
    let steps = [
        ("grey", band::root(picture, [1.0; 3])),
        ("first_band", first),
        ("last_band", pass.last),
        ("first_binary", shown(&first_binary)),
        ("last_binary", shown(&pass.last_binary)),
        ("both", shown(&both)),
        ("edges", shown(&pass.edges)),
        ("object", shown(&pass.object)),
        ("inside", shown(&pass.inside)),
    ];
    steps.map(|(name, image)| Step { name, image }).into()
}

impl SegmentOptions {
    /// # Errors
    /// [`Error::Value`] for the first option that cannot be right.
    pub(super) fn check(&self) -> Result<()> {
        if let Some(levels) = self.levels.filter(|levels| !(2..=8).contains(levels)) {
            return Err(Error::value("levels", format!("{levels}, expected 2 to 8")));
        }
        let share = |at: &str, value: f64| match (0.0..=1.0).contains(&value) {
            true => Ok(()),
            false => Err(Error::value(at, format!("{value}, expected 0 to 1"))),
        };
        share("ridge", f64::from(self.ridge))?;
        share("join", self.join)?;
        let weights = if let LumaMode::Grey(weights) = self.tone {
            weights
        } else {
            [1.0; 3]
        };
        if !weights.iter().all(|w| (0.0..=1e6).contains(w)) || weights == [0.0; 3] {
            return Err(Error::value(
                "tone.grey",
                format!("{weights:?}, expected weights of 0 to 1e6, not all 0"),
            ));
        }
        let sizes = Bounds::new(LEAST_WORKING_SIZE as f64, 32_768.0, "pixels");
        sizes.check("working_size", self.working_size as f64)
    }
}

/// Least longer side of a picture that is searched, pixels.
const LEAST_WORKING_SIZE: usize = 32;
/// Shortest side that can hold an object and its background, pixels.
const SMALLEST: usize = 16;
/// A photo with a longer side below the first is searched enlarged, to the second at least: bands and gaps of a few pixels
/// are wide beside an object of 20.
const SMALL: [usize; 2] = [128, 256];

fn check_photo(photo: &Image<LinearRgb>) -> Result<()> {
    let (w, h) = photo.size();
    if w.min(h) < SMALLEST {
        return Err(refused(format!(
            "the photo is {w} x {h} pixels, expected at least {SMALLEST} x {SMALLEST}"
        )));
    }
    match photo.pixels().iter().position(|p| !p.is_finite()) {
        Some(i) => Err(refused(format!(
            "pixel ({}, {}) is not a finite number",
            i % w,
            i / w
        ))),
        None => Ok(()),
    }
}

fn refused(what: impl Into<String>) -> Error {
    Error::Photo { what: what.into() }
}

fn longer_side<P: Copy>(image: &Image<P>) -> usize {
    image.width().max(image.height())
}

/// The photo, or a copy whose longer side is `working_size`; a small photo enlarged.
fn reduced(
    photo: &Image<LinearRgb>,
    working_size: usize,
) -> std::borrow::Cow<'_, Image<LinearRgb>> {
    let longer = longer_side(photo);
    if longer < SMALL[0].min(working_size) {
        let times = SMALL[1].div_ceil(longer);
        return std::borrow::Cow::Owned(filter::resize(
            photo,
            times * photo.width(),
            times * photo.height(),
        ));
    }
    if longer <= working_size {
        return std::borrow::Cow::Borrowed(photo);
    }
    let side = |len: usize| {
        (len * working_size)
            .div_ceil(longer)
            .max(LEAST_WORKING_SIZE)
    };
    std::borrow::Cow::Owned(filter::resize(
        photo,
        side(photo.width()),
        side(photo.height()),
    ))
}

fn shown(set: &Mask) -> Image<f32> {
    set.map(|p| f32::from(u8::from(p)))
}

/// Names of the borders in the order of [`Segmentation::touches`].
const BORDERS: [&str; 4] = ["left", "top", "right", "bottom"];

/// The warning about an object that the photo cuts off; none for a whole one.
fn truncation(touches: [bool; 4]) -> Option<Diagnostic> {
    let reached: Vec<_> = BORDERS
        .into_iter()
        .zip(touches)
        .filter(|(_, t)| *t)
        .map(|(name, _)| name)
        .collect();
    (!reached.is_empty()).then(|| {
        let message = format!(
            "the object reaches the {} border: the part beyond is missing from its size",
            reached.join(" and ")
        );
        Diagnostic::warning(Code::Truncated, message)
    })
}

fn screen_like_parts() -> Diagnostic {
    Diagnostic::warning(
        Code::ScreenLikeParts,
        "parts of the object look like the screen: treated as holes, or on a grey board as clear plastic; are they?",
    )
}

/// `reduction` is how many times smaller the picture is that was searched.
fn noisy(reduction: f64) -> Diagnostic {
    Diagnostic::warning(
        Code::Noisy,
        format_args!(
            "the photo is noisy: the outline was found at 1/{reduction:.0} of the resolution and is accurate to one of its pixels"
        ),
    )
}

#[cfg(test)]
mod tests;
