//! Interreflection between the surface and the cards above it.

use crate::camera::RadialDistortion;
use crate::deep::DeepImage;
use crate::filter::{gaussian_blur, sample_bilinear};
use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb};
use crate::quantile::median;
use crate::render::card_texel::card_texel;
use crate::render::view::{
    CameraView, ProjectedPlane, ScenePlane, is_on_texture, pixel_center, visible_planes,
};
use crate::scene::{Card, Shot};

/// How far interreflected light spreads, as a share of the typical card's longer side: 8 mm for 200
/// mm, the order of a pile's height; half and twice as much work equally well.
const BOUNCE_SPREAD_RATIO: f64 = 0.04;

/// Grid points on the surface per spread.
const GRID_STEPS_PER_SPREAD: f64 = 4.0;

/// Maximum number of steps along a side; they are longer if cards are far apart.
const MAX_GRID_STEPS: f64 = 512.0;

/// Maximum albedo product: a white surface under a white card would give infinite light.
const MAX_BOUNCE: f32 = 0.95;

/// Brightens the surface by the light that cards above reflect back to it, if the shot has
/// interreflection.
///
/// Shadow factors may come out above 1.
///
/// # Method
/// `S` is divided by `1 - albedo R`, where `R` is the light that comes back from straight above:
/// the sum over cards upwards of their colour times the squared transmittance of what is below
/// them, blurred over the surface.
pub(super) struct Bounces {
    albedo: LinearRgb,
    /// The surface's sides, metres, in its middle the origin.
    catcher: [f64; 2],
    lens: RadialDistortion,
    /// None if there is nothing to brighten.
    seen: Option<(ProjectedPlane, BounceMap)>,
}

impl Bounces {
    pub(super) fn new(shot: &Shot) -> Self {
        let view = CameraView::from_camera(&shot.camera);
        let surface = || {
            let plane = ScenePlane::shadow_catcher(shot.catcher);
            ProjectedPlane::from_above(&plane, &view)
        };
        let asked_for = !shot.interreflection.is_black();
        Self {
            albedo: shot.interreflection,
            catcher: shot.catcher,
            lens: shot.distortion(),
            seen: asked_for
                .then(|| Some((surface()?, BounceMap::new(shot)?)))
                .flatten(),
        }
    }

    pub(super) fn brighten(&self, deep: DeepImage) -> DeepImage {
        let Some((surface, bounce)) = &self.seen else {
            return deep;
        };
        deep.map_shadow(|x, y, factor| {
            let ideal = self.lens.undistort(pixel_center(x, y).xy().into());
            match surface.point_at(&ideal.to_homogeneous()) {
                Some(point) if self.is_on_surface(&point) => {
                    factor * endless_bounces(self.albedo * bounce.at(&point))
                }
                _ => factor,
            }
        })
    }

    fn is_on_surface(&self, point: &Vector3<f64>) -> bool {
        (0..2).all(|axis| 2.0 * point[axis].abs() <= self.catcher[axis])
    }
}

/// Sum of the geometric series of light that comes back by these shares each time.
fn endless_bounces(back: LinearRgb) -> LinearRgb {
    back.map(|b| 1.0 / (1.0 - b.clamp(0.0, MAX_BOUNCE)))
}

/// Light that comes back from above, on a grid over the part of the surface that is under cards.
struct BounceMap {
    corner: [f64; 2],
    step: f64,
    back: Image<LinearRgb>,
}

impl BounceMap {
    /// None without cards.
    fn new(shot: &Shot) -> Option<Self> {
        let cards = visible_planes(shot);
        let spread = BOUNCE_SPREAD_RATIO * typical_length(&cards)?;
        let (left, width) = extent(&cards, 0, spread)?;
        let (bottom, height) = extent(&cards, 1, spread)?;
        let step = (spread / GRID_STEPS_PER_SPREAD).max(width.max(height) / MAX_GRID_STEPS);
        let [columns, rows] = [width, height].map(|length| (length / step) as usize + 1);
        let back = Image::from_fn(columns, rows, |i, j| {
            // At the centre of a cell: at its corners, rounding would decide at the ends of cards.
            let (x, y) = (i as f64 + 0.5, j as f64 + 0.5);
            let point = Vector3::new(left + x * step, bottom + y * step, 0.0);
            light_from_above(&cards, &point)
        });
        Some(Self {
            corner: [left, bottom],
            step,
            back: gaussian_blur(&back, (spread / step) as f32),
        })
    }

    fn at(&self, point: &Vector3<f64>) -> LinearRgb {
        let [x, y] = [0, 1].map(|axis: usize| (point[axis] - self.corner[axis]) / self.step);
        sample_bilinear(&self.back, x, y)
    }
}

/// Median of the longer sides of cards, metres; none without cards.
fn typical_length(cards: &[(&Card, ScenePlane)]) -> Option<f64> {
    let longer = cards
        .iter()
        .map(|(_, plane)| plane.size[0].max(plane.size[1]));
    median(longer, f64::total_cmp)
}

/// Low end and length of the cards' extent along an axis, with room for the blur.
fn extent(cards: &[(&Card, ScenePlane)], axis: usize, spread: f64) -> Option<(f64, f64)> {
    let ends = cards
        .iter()
        .flat_map(|(_, plane)| plane.corners())
        .map(|corner| corner[axis]);
    let low = ends.clone().reduce(f64::min)? - 3.0 * spread;
    let high = ends.reduce(f64::max)? + 3.0 * spread;
    Some((low, high - low))
}

/// Light that cards straight above a point of the surface reflect back to it.
fn light_from_above(cards: &[(&Card, ScenePlane)], point: &Vector3<f64>) -> LinearRgb {
    let hits = cards
        .iter()
        .filter_map(|(card, plane)| hit_above(card, plane, point));
    let mut hits: Vec<_> = hits.collect();
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut back, mut through) = (LinearRgb::BLACK, LinearRgb::WHITE);
    for (_, film) in hits {
        back = back + through * through * film.color;
        through = through * film.transmittance();
    }
    back
}

/// Height of a card over a point of the surface, and its texel there.
fn hit_above(card: &Card, plane: &ScenePlane, point: &Vector3<f64>) -> Option<(f64, Film)> {
    let height = plane.normal.dot(&(plane.center - point)) / plane.normal.z;
    let uv = plane.texture_coordinates(&(point + Vector3::z() * height));
    let inside = height > 0.0 && height.is_finite() && is_on_texture(uv);
    inside.then(|| (height, card_texel(card, plane, uv, point)))
}
