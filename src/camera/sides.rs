//! The sides of the rectangle as measured, and what follows from them and from points on the
//! surface.

use super::dlt;
use super::error::SolveError;
use super::label::{Label, LabelPoint};
use super::label_check::MAX_MAGNITUDE;
use super::model::StretchShares;
use super::options::{Priors, SolveOptions};
use super::rectangle::{ProjectedRectangle, corner_points};
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::Point2;

/// Sides of a more extreme ratio are a typing error.
const MAX_SIDE_RATIO: f64 = 1e3;
/// Points lower than this part of the shorter side lie on the surface, for a first guess.
const ON_SURFACE_SHARE: f64 = 0.01;
/// A surface longer than this multiple of the span of its points is poorly constrained by them.
const MAX_SPAN_RATIO: f64 = 3.0;

/// The measured sides, metres.
#[derive(Clone, Copy)]
pub(crate) enum MeasuredSides {
    Both([f64; 2]),
    Width(f64),
    Height(f64),
}

impl MeasuredSides {
    pub(crate) fn new(label: &Label, options: &SolveOptions) -> Result<Self, SolveError> {
        let (w, h) = (label.surface.width_m, label.surface.height_m);
        check_sides(w, h)?;
        match (w, h) {
            (Some(w), Some(h)) => Ok(Self::Both([w, h])),
            (Some(w), None) => Ok(Self::Width(w)),
            (None, Some(h)) => Ok(Self::Height(h)),
            (None, None) if options.unit_scale => Ok(Self::Width(1.0)),
            (None, None) => Err(unscaled_error(label)),
        }
    }

    /// Both sides, given width over height for the case that only one is known.
    pub(crate) fn completed(self, ratio: impl Fn() -> f64) -> [f64; 2] {
        match self {
            Self::Both(size) => size,
            Self::Width(w) => [w, w / ratio()],
            Self::Height(h) => [h * ratio(), h],
        }
    }

    /// Where the corners of a rectangle of known sides must be by the further points on its
    /// surface.
    pub(crate) fn predicted_corners(self, label: &Label) -> Option<[Point2<f64>; 4]> {
        let Self::Both(size) = self else { return None };
        let pairs: Vec<_> = points_on_surface(label, size)
            .map(|p| (Point2::new(p.xyz_m[0], p.xyz_m[1]), label.pixel(p.px)))
            .collect();
        let map = dlt::homography(&pairs)?;
        Some(corner_points(size).map(|c| map.map(c.xy())))
    }

    /// The error of a label that has no corners and from which none can be predicted.
    pub(crate) fn missing_corners(self, label: &Label) -> SolveError {
        match self {
            Self::Width(_) if has_four_points(label) => {
                SolveError::PointsNeedSides("surface.height_m is missing")
            }
            Self::Height(_) if has_four_points(label) => {
                SolveError::PointsNeedSides("surface.width_m is missing")
            }
            _ if label.markers.is_some() && label.points.is_empty() => SolveError::NoMarkerCorners,
            _ => SolveError::NoCorners,
        }
    }

    /// A warning, where the points on the surface span much less than it.
    pub(crate) fn span_warning(self, label: &Label) -> Option<Diagnostic> {
        let Self::Both(size) = self else { return None };
        let [along, across] = [0, 1].map(|axis| point_span(label, size, axis));
        let (span, side) = (along.max(across), size[0].max(size[1]));
        let what = format!(
            "the markers span only {span:.3} m of a surface of {side:.3} m: put four of them just inside its corners"
        );
        (side > MAX_SPAN_RATIO * span).then(|| Diagnostic::warning(Code::SmallMarkerSpan, what))
    }

    pub(crate) fn stretch_shares(self) -> StretchShares {
        match self {
            Self::Both(_) => StretchShares::BOTH,
            Self::Width(_) => StretchShares::HEIGHT,
            Self::Height(_) => StretchShares::WIDTH,
        }
    }

    /// Standard deviation of the stretch; infinite where only one side is known.
    pub(crate) fn stretch_sigma(self, label: &Label, priors: &Priors) -> f64 {
        match self {
            Self::Both(size) => stated_ratio_sigma(label, size).unwrap_or(priors.ratio_sigma),
            _ => f64::INFINITY,
        }
    }

    /// Relative standard deviation of both sides together, which scales all lengths; 0 where none
    /// is stated.
    pub(crate) fn scale_sigma(self, label: &Label) -> f64 {
        match self {
            Self::Both(size) => stated_ratio_sigma(label, size).unwrap_or(0.0) / 2.0,
            Self::Width(side) | Self::Height(side) => {
                let sigma = label.surface.dimension_sigma_m;
                sigma.map_or(0.0, |sigma| sigma / side)
            }
        }
    }
}

/// Relative standard deviation of the ratio of two sides by that of each, which is twice that of
/// their geometric mean.
fn stated_ratio_sigma(label: &Label, [w, h]: [f64; 2]) -> Option<f64> {
    let sigma = label.surface.dimension_sigma_m?;
    Some(libm::hypot(sigma / w, sigma / h))
}

/// The error of a label without sides.
fn unscaled_error(label: &Label) -> SolveError {
    if label.surface.corners_px.is_some() {
        SolveError::NoScale
    } else if has_four_points(label) {
        SolveError::PointsNeedSides("both are missing")
    } else {
        SolveError::Empty
    }
}

/// Refuses lengths, or a ratio of two, that no rectangle has.
fn check_sides(width: Option<f64>, height: Option<f64>) -> Result<(), SolveError> {
    let range = 1.0 / MAX_MAGNITUDE..=MAX_MAGNITUDE;
    let [w, h] = [width, height].map(|side| side.unwrap_or(1.0));
    let has_plausible_ratio =
        width.is_none() || height.is_none() || (w / h).max(h / w) <= MAX_SIDE_RATIO;
    if range.contains(&w) && range.contains(&h) && has_plausible_ratio {
        Ok(())
    } else {
        Err(SolveError::BadDimensions([w, h]))
    }
}

/// Points enough to predict corners from.
fn has_four_points(label: &Label) -> bool {
    label.points.len() >= 4
}

/// The points that lie on a surface of this size.
fn points_on_surface(label: &Label, [w, h]: [f64; 2]) -> impl Iterator<Item = &LabelPoint> {
    let near = ON_SURFACE_SHARE * w.min(h);
    label
        .points
        .iter()
        .filter(move |p| p.xyz_m[2].abs() <= near)
}

/// How far the points on a surface of this size reach along an axis, metres.
fn point_span(label: &Label, size: [f64; 2], axis: usize) -> f64 {
    let values = points_on_surface(label, size).map(|p| p.xyz_m[axis]);
    let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], v| {
        [v.min(low), v.max(high)]
    });
    high - low
}

/// Width over height by the right angle, at the focal length that it gives or else at that of the
/// prior.
pub(crate) fn ratio_by_right_angle(projected: &ProjectedRectangle, prior_focal: f64) -> f64 {
    let squared = projected.focal_squared_any_ratio();
    let [short, long] = [0.2 * prior_focal, 5.0 * prior_focal].map(|f| f * f);
    let measured = (short..long).contains(&squared).then(|| squared.sqrt());
    projected
        .ratio(measured.unwrap_or(prior_focal))
        .clamp(1.0 / MAX_SIDE_RATIO, MAX_SIDE_RATIO)
}
