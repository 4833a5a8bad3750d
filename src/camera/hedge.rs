//! The uncertainty of a picture that may have been cropped.
//!
//! # Method
//! Two cameras are solved: of a whole picture, whose principal point is in its middle, and of one
//! that may be a part of a larger picture. As long as the corners allow it the first one is the
//! answer, since most pictures are whole. Its error is what the second one leaves open, and the
//! distance to it: the mean square error of the answer where the picture is cropped after all.

use super::chi::CHI2_99;
use super::import::place_for_more;
use super::label::{Framing, Label};
use super::model::Unknowns;
use super::options::SolveOptions;
use super::pinhole::{Camera, distorted};
use super::rectangle::corner_points;
use super::solution::{Sigma, Solution};
use super::uncertainty::{grid_at_height, repaired_variance};
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::{Point2, Point3, Vector2, Vector3};
use nalgebra::Matrix2;

/// Corners that fit a cropped picture this much better than a whole one belong to a cropped one.
pub(crate) fn is_off_center(whole: f64, loose: f64) -> bool {
    whole > loose + CHI2_99
}

/// How far apart two cameras are.
struct CameraDifference {
    ln_focal: f64,
    tilt: f64,
    center: Vector3<f64>,
    /// Along one axis, root mean square.
    principal_px: f64,
}

impl CameraDifference {
    fn new(from: &Camera, to: &Camera) -> Self {
        let principal = to.principal_px - from.principal_px;
        Self {
            ln_focal: libm::log(to.focal_px.x / from.focal_px.x),
            tilt: to.tilt() - from.tilt(),
            center: to.center() - from.center(),
            principal_px: principal.norm() / std::f64::consts::SQRT_2,
        }
    }
}

impl Solution {
    /// The camera of a picture assumed to be whole, `apart` from that of the same picture if it may
    /// be cropped, with the uncertainty of both.
    pub(crate) fn hedged(
        mut self,
        loose: &Self,
        apart: &Unknowns,
        label: &Label,
        options: &SolveOptions,
    ) -> Self {
        let whole_px = self.sigma.height_px;
        self.sigma = self.sigma_with(loose, apart);
        (self.focal.share, self.focal.from_data_px) = (loose.focal.share, loose.focal.from_data_px);
        (self.focal_source, self.framing) = (loose.focal_source, Framing::Unknown);
        self.warnings.retain(|w| w.code != Code::HeightUncertain);
        self.warnings
            .extend(self.hedged_height_warning(whole_px, label, options));
        self
    }

    /// About points above the surface, which a whole picture would show as well as `whole_px`.
    fn hedged_height_warning(
        &self,
        whole_px: f64,
        label: &Label,
        options: &SolveOptions,
    ) -> Option<Diagnostic> {
        let limit_px = self.height_limit_px(options);
        if whole_px > limit_px {
            self.height_warning(options)
        } else {
            (self.sigma.height_px > limit_px).then(|| self.framing_warning(whole_px, label))
        }
    }

    /// Says that points above the surface would be known better, to `whole_px`, if the picture were
    /// known to be whole.
    fn framing_warning(&self, whole_px: f64, label: &Label) -> Diagnostic {
        let place = place_for_more(label);
        let (height, sigma_px) = (self.sigma.reference_height, self.sigma.height_px);
        Diagnostic::warning(
            Code::FramingUnknown,
            format!(
                "it is not known whether the picture was cropped, so a point {height:.3} m above the surface is known only \
                 to {sigma_px:.1} px; if it was not, write \"cropped\": false under \"image\"{place}, which brings that to \
                 {whole_px:.1} px"
            ),
        )
    }

    /// The camera of a picture that turns out not to be whole, and beside it that of a whole one.
    pub(crate) fn off_center(mut self, whole: Option<Self>) -> Self {
        self.warnings.push(self.off_center_warning());
        self.alternative = self.alternative.or(whole.map(Box::new));
        self
    }

    fn off_center_warning(&self) -> Diagnostic {
        let [w, h] = self.camera.image.map(f64::from);
        let off_px = (self.camera.principal_px - Point2::new(w / 2.0, h / 2.0)).norm();
        let what = format!(
            "the principal point is {off_px:.0} px (+- {:.0}) off the centre of the picture: the picture was cropped, the lens \
             was shifted, or the EXIF focal length is wrong",
            self.sigma.principal_px
        );
        Diagnostic::warning(Code::OffCenter, what)
    }

    fn sigma_with(&self, loose: &Self, apart: &Unknowns) -> Sigma {
        let sigma = &loose.sigma;
        let off = CameraDifference::new(&self.camera, &loose.camera);
        Sigma {
            ln_focal: libm::hypot(sigma.ln_focal, off.ln_focal),
            tilt: libm::hypot(sigma.tilt, off.tilt),
            center: sigma.center + off.center * off.center.transpose(),
            corners_px: self.corner_covariances_with(loose),
            reference_height: self.sigma.reference_height,
            height_px: libm::hypot(sigma.height_px, self.height_apart_px(loose)),
            principal_px: libm::hypot(sigma.principal_px, off.principal_px),
            covariance: sigma.covariance + apart * apart.transpose(),
        }
    }

    fn corner_covariances_with(&self, loose: &Self) -> [Matrix2<f64>; 4] {
        let (own, other) = (corner_points(self.size), corner_points(loose.size));
        [0, 1, 2, 3].map(|i| {
            let off = loose.sees(other[i]) - self.sees(own[i]);
            loose.sigma.corners_px[i] + off * off.transpose()
        })
    }

    /// Where the camera sees a grid over the rectangle, at a height.
    fn seen_grid(&self, height: f64) -> impl Iterator<Item = Vector2<f64>> {
        grid_at_height(self.size, height).map(|point| self.sees(point))
    }

    /// Root mean square distance of points at the reference height as two cameras see them.
    fn height_apart_px(&self, other: &Self) -> f64 {
        let height = self.sigma.reference_height;
        let squares: Vec<f64> = self
            .seen_grid(height)
            .zip(other.seen_grid(height))
            .map(|(a, b)| repaired_variance((b - a).norm_squared()))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    fn sees(&self, point: Point3<f64>) -> Vector2<f64> {
        distorted(&self.camera, self.kappa, point).coords
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::solve;

    fn solved(label: &Label) -> Solution {
        solve(label, &SolveOptions::default()).unwrap()
    }

    fn warns(solution: &Solution, code: Code) -> bool {
        solution.warnings.iter().any(|w| w.code == code)
    }

    #[test]
    fn a_picture_of_unknown_framing_is_treated_as_whole_with_a_larger_error() {
        let whole = Scenario::realistic().tilted(25.0).view(1, 3).label;
        let mut unknown = whole.clone();
        unknown.image.cropped = None;
        let (sure, hedged) = (solved(&whole), solved(&unknown));
        assert_eq!(sure.camera, hedged.camera);
        assert_eq!(
            (sure.framing, hedged.framing),
            (Framing::Whole, Framing::Unknown)
        );
        assert!(
            hedged.sigma.ln_focal > 3.0 * sure.sigma.ln_focal,
            "{:?}",
            hedged.sigma.ln_focal
        );
        assert!(hedged.sigma.principal_px > 10.0 * sure.sigma.principal_px);
        assert!(warns(&hedged, Code::FramingUnknown) && !warns(&sure, Code::FramingUnknown));
    }

    #[test]
    fn corners_of_a_cropped_picture_are_noticed() {
        let scenario = Scenario {
            off_center: 0.23,
            corner_sigma_px: 0.5,
            ..Scenario::default()
        }
        .tilted(40.0);
        let view = scenario.view(1, 3);
        let solution = solved(&view.label);
        assert!(warns(&solution, Code::OffCenter), "{:?}", solution.warnings);
        let error = libm::log(solution.camera.focal_px.x / view.camera.focal_px.x).abs();
        assert!(error < 3.0 * solution.sigma.ln_focal, "{error}");
        assert!(
            solution
                .alternative
                .is_some_and(|whole| whole.camera.principal_px.x - 2000.0 < 200.0)
        );
    }

    #[test]
    fn a_stated_principal_point_is_not_hedged() {
        let mut label = Scenario::realistic().tilted(25.0).view(1, 3).label;
        (label.image.cropped, label.camera.principal_point_px) = (None, Some([2000.0, 1500.0]));
        assert_eq!(solved(&label).framing, Framing::Whole);
    }

    #[test]
    fn a_stated_principal_point_is_believed_in_a_cropped_picture_too() {
        let mut label = Scenario::realistic().tilted(25.0).view(1, 3).label;
        (label.image.cropped, label.camera.principal_point_px) =
            (Some(true), Some([2000.0, 1500.0]));
        let by_default = solved(&label);
        // 0.005 of a diagonal of 5000 pixels.
        label.camera.principal_point_sigma_px = Some(25.0);
        let as_stated = solved(&label);
        assert!(by_default.sigma.principal_px <= 25.0);
        let ratio = by_default.sigma.ln_focal / as_stated.sigma.ln_focal;
        assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
    }
}
