//! A label in the solver's units: what was seen, what is believed, and where to start.

use super::belief::{Belief, Beliefs};
use super::corners::{self, Checked};
use super::dlt;
use super::error::SolveError;
use super::focal::{self, Witness};
use super::label::{Framing, Label, LabelPoint};
use super::model::{Elastic, Sight, State};
use super::options::{Priors, SolveOptions};
use super::rectangle::View;
use super::refine::Evidence;
use super::warning::Warning;
use crate::geom::{Point2, Point3, Vector2};
use nalgebra::Vector3;

/// Focal lengths beyond this many longer sides, or below one over it, are not followed.
const LONGEST_FOCAL: f64 = 100.0;
/// Sides of a more extreme ratio are a typing error.
const EXTREME_RATIO: f64 = 1e3;
/// Larger numbers, and smaller ones than one over it where they are positive, are in no label that means something.
const LARGEST: f64 = 1e9;
/// Noise of a corner that a person clicked, pixels.
const CORNER_SIGMA_PX: f64 = 1.0;
/// Relative noise of a camera height of which only the value is stated.
const HEIGHT_SIGMA: f64 = 0.03;

/// Points lower than this part of the shorter side lie on the surface, for a first guess.
const ON_SURFACE: f64 = 0.01;
/// A surface more than so many times longer than what its points span is not carried well by them.
const LONE_MARKER: f64 = 3.0;

/// The units of the solver, and what they stand for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Where the principal point is expected, pixels.
    pub(crate) principal_px: Point2<f64>,
    /// One unit in the picture: half its diagonal, pixels.
    pub(crate) unit_px: f64,
    /// One unit of length: the geometric mean of the rectangle's sides, metres.
    pub(crate) unit: f64,
}

/// Everything that the solver needs of a label.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub(crate) image: [u32; 2],
    pub(crate) framing: Framing,
    pub(crate) frame: Frame,
    pub(crate) corners_px: [Point2<f64>; 4],
    pub(crate) view: View,
    /// Sides of the rectangle before they give, metres.
    pub(crate) size: [f64; 2],
    /// How the sides give.
    pub(crate) elastic: Elastic,
    pub(crate) evidence: Evidence,
    pub(crate) witness: Witness,
    pub(crate) warnings: Vec<Warning>,
}

impl Problem {
    /// Checks a label of a picture of some framing and brings it into the solver's units.
    pub(crate) fn new(
        label: &Label,
        framing: Framing,
        options: &SolveOptions,
    ) -> Result<Self, SolveError> {
        Self::with_focal(label, framing, None, options)
    }

    /// The same, where a stated distortion is to be understood at this focal length (in units) instead of the believed one.
    pub(crate) fn with_focal(
        label: &Label,
        framing: Framing,
        focal: Option<f64>,
        options: &SolveOptions,
    ) -> Result<Self, SolveError> {
        let image = label.image_size();
        if let Some(size) = [image, label.taken_size()]
            .into_iter()
            .find(|size| size.contains(&0))
        {
            return Err(SolveError::BadImage(size));
        }
        check_numbers(label)?;
        let sigma_px = label.surface.corner_sigma_px.unwrap_or(CORNER_SIGMA_PX);
        if Sides::are_missing(label, options)
            && label.surface.corners_px.is_none()
            && label.points.len() < 4
        {
            return Err(SolveError::Empty);
        }
        let sides = Sides::new(label, options)?;
        let labelled = label
            .surface
            .corners_px
            .map(|corners| corners.map(|c| label.pixel(c)));
        let quad_px = labelled
            .or_else(|| sides.predicted(label))
            .ok_or(SolveError::NoCorners)?;
        let Checked {
            corners: corners_px,
            mut warnings,
        } = corners::check(quad_px, sigma_px, image, options.order)?;

        if labelled.is_none() {
            warnings.extend(sides.lone_marker(label));
        }

        let diagonal = Vector2::from(image.map(f64::from));
        let center = label
            .camera
            .principal_point_px
            .map_or(label.taken_center(), |px| label.pixel(px));
        let (principal_px, unit_px) = (center, diagonal.norm() / 2.0);
        let (mut ln_focal, witness) = focal::belief(label, framing, &options.priors);
        ln_focal.mean -= libm::log(unit_px);
        let usual = focal::usual_px(label.taken_size()) / unit_px;

        let kappa = kappa(
            label,
            focal.unwrap_or_else(|| libm::exp(ln_focal.mean)),
            options,
        );
        let quad = corners_px.map(|c| undistorted((c - principal_px) / unit_px, kappa.mean));
        let view = View::new(&quad);
        let size = sides.completed(|| ratio_without_sides(&view, libm::exp(ln_focal.mean)));
        let frame = Frame {
            principal_px,
            unit_px,
            unit: (size[0] * size[1]).sqrt(),
        };
        let beliefs = Beliefs {
            ln_focal,
            stretch_sigma: sides.stretch_sigma(label, &options.priors),
            principal_sigma: principal_sigma(label, framing, &options.priors),
            kappa,
            ln_height: camera_height(label, &frame),
        };
        let elastic = sides.elastic();
        let corner_sights = corner_points(size)
            .into_iter()
            .zip(corners_px)
            .map(|(p, px)| (p, px, sigma_px, false));
        // Where both sides were measured, so was the point, with the same tape.
        let rigid = elastic != Elastic::BOTH;
        let points = label.points.iter();
        let further = points.map(|p| {
            (
                p.xyz_m.into(),
                label.pixel(p.px),
                p.sigma_px.unwrap_or(sigma_px),
                rigid,
            )
        });
        // Corners that were only predicted are a start and no evidence.
        let corner_sights = corner_sights.take(if labelled.is_some() { 4 } else { 0 });
        let sights = corner_sights
            .chain(further)
            .map(|(p, px, sigma, rigid)| frame.sight(p, px, sigma, rigid));
        let ln_focal_range = [1.0 / LONGEST_FOCAL, LONGEST_FOCAL].map(|f| libm::log(f * usual));
        let evidence = Evidence {
            sights: sights.collect(),
            beliefs,
            ln_focal_range,
        };
        Ok(Self {
            image,
            framing,
            frame,
            corners_px,
            view,
            size,
            elastic,
            evidence,
            witness,
            warnings,
        })
    }

    /// The closed-form camera for a focal length.
    pub(crate) fn start(&self, focal: f64) -> State {
        let stance = self.view.stance(focal, self.unit_size());
        State::new(
            stance,
            focal,
            self.evidence.beliefs.kappa.mean,
            self.elastic,
        )
    }

    /// The sides before they give, in the solver's unit.
    pub(crate) fn unit_size(&self) -> [f64; 2] {
        self.size.map(|s| s / self.frame.unit)
    }

    /// The focal length that the corners give in closed form, where they give one that can be followed.
    pub(crate) fn closed_form_focal(&self) -> Option<f64> {
        let known = self.elastic == Elastic::BOTH;
        let squared = if known {
            self.view.focal_squared(self.size[0] / self.size[1])
        } else {
            self.view.focal_squared_any_ratio()
        };
        let [shortest, longest] = self.evidence.ln_focal_range.map(libm::exp);
        (squared > shortest * shortest && squared < longest * longest).then(|| squared.sqrt())
    }

    /// The sides in a state, metres.
    pub(crate) fn fitted_size(&self, state: &State) -> [f64; 2] {
        [self.size[0] * state.sides[0], self.size[1] * state.sides[1]]
    }
}

impl Frame {
    pub(crate) fn picture(&self, px: Point2<f64>) -> Vector2<f64> {
        (px - self.principal_px) / self.unit_px
    }

    fn sight(&self, point: Point3<f64>, px: Point2<f64>, sigma_px: f64, rigid: bool) -> Sight {
        let point: Vector3<f64> = point.coords / self.unit;
        Sight {
            point,
            rigid,
            seen: self.picture(px),
            weight: self.unit_px / sigma_px,
        }
    }
}

/// The points that lie on a surface of this size.
fn on_surface(label: &Label, size: [f64; 2]) -> impl Iterator<Item = &LabelPoint> {
    let near = ON_SURFACE * size[0].min(size[1]);
    label
        .points
        .iter()
        .filter(move |p| p.xyz_m[2].abs() <= near)
}

/// The corners of a rectangle of this size, in label order.
pub(crate) fn corner_points(size: [f64; 2]) -> [Point3<f64>; 4] {
    let [x, y] = size.map(|s| s / 2.0);
    [[-x, y], [x, y], [x, -y], [-x, -y]].map(|[x, y]| Point3::new(x, y, 0.0))
}

/// The sides a person measured, metres.
#[derive(Clone, Copy)]
enum Sides {
    Both([f64; 2]),
    Width(f64),
    Height(f64),
}

impl Sides {
    fn new(label: &Label, options: &SolveOptions) -> Result<Self, SolveError> {
        let (w, h) = (label.surface.width_m, label.surface.height_m);
        let possible = |v: f64| (1.0 / LARGEST..=LARGEST).contains(&v);
        let size = [w.unwrap_or(1.0), h.unwrap_or(1.0)];
        if !size.into_iter().all(possible) {
            return Err(SolveError::BadDimensions(size));
        }
        match (w, h) {
            (Some(w), Some(h)) if (w / h).max(h / w) <= EXTREME_RATIO => Ok(Self::Both([w, h])),
            (Some(_), Some(_)) => Err(SolveError::BadDimensions(size)),
            (Some(w), None) => Ok(Self::Width(w)),
            (None, Some(h)) => Ok(Self::Height(h)),
            (None, None) if options.unit_scale => Ok(Self::Width(1.0)),
            (None, None) => Err(SolveError::NoScale),
        }
    }

    fn are_missing(label: &Label, options: &SolveOptions) -> bool {
        label.surface.width_m.is_none() && label.surface.height_m.is_none() && !options.unit_scale
    }

    /// Both sides, given width over height for the case that only one is known.
    fn completed(self, ratio: impl Fn() -> f64) -> [f64; 2] {
        match self {
            Self::Both(size) => size,
            Self::Width(w) => [w, w / ratio()],
            Self::Height(h) => [h * ratio(), h],
        }
    }

    /// Where the corners of a rectangle of known sides must be by the further points on its surface.
    fn predicted(self, label: &Label) -> Option<[Point2<f64>; 4]> {
        let Self::Both(size) = self else { return None };
        let pairs: Vec<_> = on_surface(label, size)
            .map(|p| (Point2::new(p.xyz_m[0], p.xyz_m[1]), label.pixel(p.px)))
            .collect();
        let map = dlt::homography(&pairs)?;
        Some(corner_points(size).map(|c| map.map(c.xy())))
    }

    /// Doubt, where the points on the surface span much less than it.
    fn lone_marker(self, label: &Label) -> Option<Warning> {
        let Self::Both(size) = self else { return None };
        let span = |axis: usize| {
            let along = on_surface(label, size).map(|p| p.xyz_m[axis]);
            let [low, high] = along.fold([f64::MAX, f64::MIN], |[low, high], v| {
                [v.min(low), v.max(high)]
            });
            high - low
        };
        let (span, side) = (span(0).max(span(1)), size[0].max(size[1]));
        (side > LONE_MARKER * span).then_some(Warning::LoneMarker { span, side })
    }

    fn elastic(self) -> Elastic {
        match self {
            Self::Both(_) => Elastic::BOTH,
            Self::Width(_) => Elastic::HEIGHT,
            Self::Height(_) => Elastic::WIDTH,
        }
    }

    fn stretch_sigma(self, label: &Label, priors: &Priors) -> f64 {
        match (self, label.surface.dimension_sigma_m) {
            (Self::Both([w, h]), Some(sigma)) => libm::hypot(sigma / w, sigma / h),
            (Self::Both(_), None) => priors.ratio_sigma,
            _ => f64::INFINITY,
        }
    }
}

/// Width over height from the right angle, at the focal length it gives itself or else at the one believed.
fn ratio_without_sides(view: &View, believed: f64) -> f64 {
    let squared = view.focal_squared_any_ratio();
    let [short, long] = [0.2 * believed, 5.0 * believed].map(|f| f * f);
    let focal = if (short..long).contains(&squared) {
        squared.sqrt()
    } else {
        believed
    };
    view.ratio(focal).clamp(1.0 / EXTREME_RATIO, EXTREME_RATIO)
}

fn principal_sigma(label: &Label, framing: Framing, priors: &Priors) -> f64 {
    let usual = if framing == Framing::Whole {
        priors.principal_sigma
    } else {
        priors.cropped_sigma
    };
    let diagonal_px = |size: [u32; 2]| libm::hypot(f64::from(size[0]), f64::from(size[1]));
    let unit_px = diagonal_px(label.image_size()) / 2.0;
    label
        .camera
        .principal_point_sigma_px
        .unwrap_or(usual * diagonal_px(label.taken_size()))
        / unit_px
}

/// A stated coefficient is a fact, at a focal length.
fn kappa(label: &Label, focal: f64, options: &SolveOptions) -> Belief {
    match label.camera.k1 {
        Some(k1) => Belief {
            mean: k1 / (focal * focal),
            sigma: 0.0,
        },
        None => Belief {
            mean: 0.0,
            sigma: options.priors.kappa_sigma,
        },
    }
}

fn camera_height(label: &Label, frame: &Frame) -> Option<Belief> {
    let height = label.camera.height_m?;
    let sigma = label
        .camera
        .height_sigma_m
        .map_or(HEIGHT_SIGMA, |s| s / height);
    Some(Belief {
        mean: libm::log(height / frame.unit),
        sigma,
    })
}

/// Where a point would be seen without distortion, by fixed-point iteration.
pub(crate) fn undistorted(seen: Vector2<f64>, kappa: f64) -> Vector2<f64> {
    const STEPS: usize = 60;
    const CLOSE: f64 = 1e-12;
    let mut straight = seen;
    for _ in 0..if kappa == 0.0 { 0 } else { STEPS } {
        let next = seen / (1.0 + kappa * straight.norm_squared());
        let moved = (next - straight).norm();
        straight = next;
        if moved < CLOSE {
            break;
        }
    }
    straight
}

/// Everything finite, and positive where it has to be.
fn check_numbers(label: &Label) -> Result<(), SolveError> {
    let (surface, camera) = (&label.surface, &label.camera);
    let finite = |at, values: &[f64]| values.iter().try_for_each(|value| bounded(at, *value));
    finite(
        "surface.corners_px",
        surface
            .corners_px
            .as_ref()
            .map_or(&[], |c| c.as_flattened()),
    )?;
    finite(
        "camera.principal_point_px",
        camera
            .principal_point_px
            .as_ref()
            .map_or(&[], |c| c.as_slice()),
    )?;
    finite(
        "image.crop.offset_px",
        label
            .image
            .crop
            .as_ref()
            .map_or(&[], |c| c.offset_px.as_slice()),
    )?;
    finite("camera.k1", camera.k1.as_slice())?;
    for point in &label.points {
        finite("points.xyz_m", &point.xyz_m)?;
        finite("points.px", &point.px)?;
        positive("points.sigma_px", point.sigma_px)?;
    }
    positive("surface.corner_sigma_px", surface.corner_sigma_px)?;
    positive(
        "surface.dimension_sigma_m",
        surface.dimension_sigma_m.filter(|&s| s != 0.0),
    )?;
    positive("camera.focal_px", camera.focal_px)?;
    positive("camera.focal_35mm", camera.focal_35mm)?;
    positive(
        "camera.focal_sigma",
        camera.focal_sigma.filter(|&s| s != 0.0),
    )?;
    positive(
        "camera.principal_point_sigma_px",
        camera.principal_point_sigma_px.filter(|&s| s != 0.0),
    )?;
    positive("camera.height_m", camera.height_m)?;
    positive("camera.height_sigma_m", camera.height_sigma_m)
}

fn positive(at: &'static str, value: Option<f64>) -> Result<(), SolveError> {
    match value {
        Some(v) if v <= 0.0 => Err(SolveError::NotPositive { at, value: v }),
        Some(v) if v < 1.0 / LARGEST => Err(SolveError::OutOfRange {
            at,
            value: v,
            most: LARGEST,
        }),
        Some(v) => bounded(at, v),
        None => Ok(()),
    }
}

/// Finite, and no larger than what squares and products of a few of them can bear.
fn bounded(at: &'static str, value: f64) -> Result<(), SolveError> {
    match value.abs() {
        size if !size.is_finite() => Err(SolveError::NonFinite(at)),
        size if size > LARGEST => Err(SolveError::OutOfRange {
            at,
            value,
            most: LARGEST,
        }),
        _ => Ok(()),
    }
}
