//! Segmentation: where the object is, from two bands of a Laplacian pyramid.

mod band;
mod blur;
mod choose;
mod cluster;
mod confidence;
mod holes;
pub(super) mod hull;
mod mattes;
mod options;
mod pass;
mod shadow;
mod shape;
mod snap;
mod threshold;

pub use band::LumaMode;
pub(crate) use cluster::PixelGroups;
#[cfg(feature = "pipeline")]
pub(crate) use cluster::filled;
pub use confidence::Confidence;
pub use options::SegmentOptions;
pub use threshold::Threshold;

use super::Outline;
use super::prepared::Prepared;
use super::stroke::StrokesOnPhoto;
use crate::diagnostic::Diagnostic;
use crate::error::Result;
use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use crate::stopwatch::Stopwatch;
use choose::ChosenSearch;
use shape::ObjectShape;

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
    /// Whether the object reaches the left, top, right and bottom border of the photo: then part
    /// of it is missing.
    pub touches: [bool; 4],
    /// How reliable all this is.
    pub confidence: Confidence,
    /// Which band of the pyramid served as the coarse one.
    pub levels: usize,
    /// Pixels of the photo for a pixel of the picture that was searched; above 1 where noise or
    /// size called for a reduction.
    pub reduction: f64,
    /// Notes and warnings about the photo and the outline.
    pub diagnostics: Vec<Diagnostic>,
    /// Every intermediate picture, in the order of the work.
    pub steps: Vec<SegmentStep>,
}

/// An intermediate picture of the segmentation.
#[derive(Clone, Debug)]
pub struct SegmentStep {
    /// What it is: a file name without ending.
    pub name: &'static str,
    /// The picture, of the size that was searched; bands are in units of noise.
    pub image: Image<f32>,
}

impl SegmentStep {
    /// The picture in the range 0 to 1 that files show: where values go above 1, their logarithms
    /// as shares of the largest.
    pub fn shown(&self) -> Image<f32> {
        let pixels = self.image.pixels().iter();
        let most = pixels.fold(0.0f32, |most, v| most.max(*v));
        if most <= 1.0 {
            return self.image.clone();
        }
        let scale = 1.0 / libm::log1pf(most);
        self.image.map(|v| scale * libm::log1pf(v.max(0.0)))
    }
}

/// Finds the one object on a uniform background.
///
/// `photo` is scene-linear, at least 16 pixels a side. The object may reach up to three borders of
/// the photo (which gives a warning), but not all four.
///
/// # Method
/// A cut of a Laplacian pyramid ([Burt and Adelson 1983]): the finest and the coarsest band,
/// brought to full size, are binarised and combined by AND. Noise has no coarse structure and soft
/// shadows have no fine one, so that what is left are the object's edges; the hull is theirs.
/// Departs from the plain method in that
/// * bands are those of the square roots of the three channels, in units of their noise along the
///   border ([`LumaMode`]);
/// * the thresholds are Otsu's on a logarithmic scale ([`Threshold`]);
/// * the coarsest band is spread by one of its pixels, since it passes through 0 on an edge;
/// * edges are thinned to their ridge and specks dropped;
/// * edges nearer than `join` form clusters, and only the cluster of most edge pixels is kept, so
///   that dirt far away does not blow up the hull;
/// * it is done at several depths and, against noise, picture sizes; the result that agrees best
///   with the others and with the edges is taken, and how well it agrees is its [`Confidence`];
/// * what the edges enclose, gaps bridged, is the object, and its outline is moved to where the
///   photo itself changes;
/// * on a coloured screen the hard shadow that lies beside the object within sharp edges is left out.
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) when there is nothing, only a speck, more than one object,
/// or no background around the object; [`Error::Value`](crate::Error::Value) for an option that
/// cannot be right.
///
/// [Burt and Adelson 1983]: https://doi.org/10.1109/TCOM.1983.1095851
pub fn segment(photo: &Image<LinearRgb>, options: &SegmentOptions) -> Result<Segmentation> {
    options.check()?;
    let prepared = Prepared::new(photo, options.working_size)?;
    let strokes = StrokesOnPhoto::new(&[], photo);
    segment_prepared(&prepared, strokes, options)
}

/// As [`segment`], with options that are checked and a photo that is prepared for their working
/// size; what strokes say of the outline holds.
pub(super) fn segment_prepared(
    prepared: &Prepared<'_>,
    strokes: StrokesOnPhoto<'_>,
    options: &SegmentOptions,
) -> Result<Segmentation> {
    let mut watch = Stopwatch::start();
    let chosen = choose::best_search(&prepared.small, strokes, options)?;
    watch.lap("search");
    let object = chosen.object_area();
    watch.lap("holes");
    let shape = ObjectShape::new(prepared, &chosen, &object, strokes);
    let confidence = shape.confidence(prepared, chosen.confidence);
    watch.lap("outline");
    let mut diagnostics = chosen.diagnostics(prepared.small.width());
    diagnostics.extend(object.diagnostics(&chosen.pass.inside));
    diagnostics.extend(confidence.diagnostics(prepared.reduction(), shape.scale.reduction()));
    let found = Segmentation {
        confidence,
        diagnostics,
        ..Segmentation::new(prepared, chosen, shape)
    };
    watch.lap("masks");
    watch.log("segment");
    Ok(found)
}

impl Segmentation {
    /// The object reaches a border of the photo: part of it is missing.
    pub(crate) fn is_truncated(&self) -> bool {
        self.touches.contains(&true)
    }

    /// With the confidence of the search alone and without diagnostics.
    fn new(prepared: &Prepared<'_>, chosen: ChosenSearch<'_>, shape: ObjectShape) -> Self {
        let [mask, tight] = shape.coverages(prepared.photo.size());
        Self {
            mask,
            tight,
            hull: shape.hull,
            outline: shape.outline,
            touches: chosen.pass.touches,
            confidence: chosen.confidence,
            levels: chosen.levels,
            reduction: shape.scale.reduction(),
            diagnostics: Vec::new(),
            steps: chosen.into_steps(&prepared.small),
        }
    }
}

#[cfg(test)]
mod tests;
