//! Light that goes to and fro between the surface and the cards over it.

use crate::deep::DeepImage;
use crate::filter::gaussian_blur;
use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::LinearRgb;
use crate::render::reference::texel;
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane, sheets};
use crate::scene::{Card, Shot};

/// How far light spreads on its way to and fro, metres: the order of a pile's height; 4 to 16 mm do as well.
const BOUNCE_SPREAD_M: f64 = 0.008;

/// Distance of the places on the surface that look up, metres.
const GRID_STEP_M: f64 = 0.002;

/// Most places along a side; more distant ones for larger scenes.
const MAX_GRID_STEPS: f64 = 1024.0;

/// Brightens the surface by what cards above throw back to it; for who knows the surface's albedo.
///
/// Not part of the definition, which leaves bounces out: [`render`](super::render) never does this. A black albedo changes no
/// bit; shadow factors may come out above 1.
///
/// # Method
/// `S` is divided by `1 - albedo R`, with `R` the light that comes back from straight above: the sum over cards upwards
/// of their colour times the squared transmittance of what lies below, blurred over the surface.
pub fn interreflect(deep: DeepImage, shot: &Shot, albedo: LinearRgb) -> DeepImage {
    let view = CameraView::of(&shot.camera);
    let seen =
        ProjectedPlane::of(&ScenePlane::surface(shot.catcher), &view).filter(|s| s.normal.z > 0.0);
    let (Some(seen), Some(above)) = (seen, BounceMap::of(shot)) else {
        return deep;
    };
    deep.map_shadow(|x, y, factor| {
        let p = Vector3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0);
        let w = seen.w.dot(&p);
        if w <= 0.0 {
            return factor;
        }
        let back = albedo * above.at(&(seen.point * p / w));
        // A white surface under a white card would glow for ever.
        factor * back.map(|b| 1.0 / (1.0 - b.clamp(0.0, 0.95)))
    })
}

/// What comes back from above, on a grid over the part of the surface that has cards over it.
struct BounceMap {
    corner: [f64; 2],
    step: f64,
    back: Image<LinearRgb>,
}

impl BounceMap {
    /// None without cards.
    fn of(shot: &Shot) -> Option<Self> {
        let cards = sheets(shot);
        let corners: Vec<_> = cards
            .iter()
            .flat_map(|(_, sheet)| sheet.corners())
            .collect();
        let side = |axis: usize| {
            let low = corners.iter().map(|c| c[axis]).reduce(f64::min)? - 3.0 * BOUNCE_SPREAD_M;
            let high = corners.iter().map(|c| c[axis]).reduce(f64::max)? + 3.0 * BOUNCE_SPREAD_M;
            Some((low, high - low))
        };
        let ((left, width), (bottom, height)) = (side(0)?, side(1)?);
        let step = GRID_STEP_M.max(width.max(height) / MAX_GRID_STEPS);
        let [columns, rows] = [width, height].map(|length| (length / step) as usize + 1);
        let at = |i: usize, j: usize| {
            Vector3::new(left + i as f64 * step, bottom + j as f64 * step, 0.0)
        };
        let back = Image::from_fn(columns, rows, |i, j| straight_above(&cards, &at(i, j)));
        Some(Self {
            corner: [left, bottom],
            step,
            back: gaussian_blur(&back, (BOUNCE_SPREAD_M / step) as f32),
        })
    }

    fn at(&self, point: &Vector3<f64>) -> LinearRgb {
        let place = |axis: usize| (point[axis] - self.corner[axis]) / self.step + 0.5;
        crate::filter::sample_bilinear(&self.back, place(0), place(1))
    }
}

/// Light that cards straight above a point of the surface send back to it.
fn straight_above(cards: &[(&Card, ScenePlane)], point: &Vector3<f64>) -> LinearRgb {
    let hit = |(card, sheet): &(&Card, ScenePlane)| {
        let height = sheet.normal.dot(&(sheet.center - point)) / sheet.normal.z;
        let local = point + Vector3::z() * height - sheet.center;
        let uv = [
            local.dot(&sheet.x) / sheet.size[0] + 0.5,
            0.5 - local.dot(&sheet.y) / sheet.size[1],
        ];
        let inside =
            height > 0.0 && height.is_finite() && uv.iter().all(|c| (0.0..=1.0).contains(c));
        inside.then(|| (height, texel(card, sheet, uv, point)))
    };
    let mut hits: Vec<_> = cards.iter().filter_map(hit).collect();
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut back, mut through) = (LinearRgb::BLACK, LinearRgb::WHITE);
    for (_, film) in hits {
        back = back + through * through * film.color;
        through = through * film.transmittance();
    }
    back
}
