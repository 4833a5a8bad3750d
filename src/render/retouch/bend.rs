//! Curved cards as flat ones that look the same.

use super::Darkroom;
use super::painted_plane::PaintedPlane;
use crate::filter::sample_bilinear;
use crate::geom::{BBox, Point2, Point3};
use crate::image::Image;
use crate::light;
use crate::pixel::{Film, LinearRgb};
use crate::render::light_samples::{LightSamples, LitPatch};
use crate::render::view::ScenePlane;
use crate::scene::{Card, Cylinder};
use std::f32::consts::PI;

/// Positions along a bend at which light is computed: over 60 degrees they are 4 degrees apart, and
/// linear interpolation between two is off by a share of 6e-4.
const SHADING_NODES: usize = 17;
/// Points along each side of a card from which its extent is bounded.
const SIDE_POINTS: usize = 17;

/// The view of a curved card, painted on the plane of the flat one.
///
/// # Method
/// Every texel of the plane shows the point of the cylinder on its ray from the eye, so the picture
/// has the cylinder's exact outline, foreshortening and parallax as long as the card hides no part
/// of itself. Approximate are: the light, which is that on the flat card, shadows included, times
/// the change of unobstructed light with the normal; the card's shadow, which is that of the
/// painted plane; and depth, which is that of the plane. Each is off by about the height of the
/// arc, an eighth of the angle times the length: 9 mm for 200 mm bent by 20 degrees.
pub(super) fn bend(
    flat: &PaintedPlane,
    card: &Card,
    cylinder: &Cylinder,
    shading: &BentShading,
    eye: &Point3<f64>,
) -> PaintedPlane {
    let empty = seen_area(flat, card, cylinder, eye);
    let film = Image::from_fn(empty.film.width(), empty.film.height(), |x, y| {
        let seen = cylinder.seen_point(eye, &empty.point(x as f64 + 0.5, y as f64 + 0.5));
        let [x, y] = flat.position(&seen);
        let film = sample_bilinear(&flat.film, x, y);
        Film {
            color: film.color * shading.at(cylinder.arc_of(&seen)),
            ..film
        }
    });
    PaintedPlane { film, ..empty }
}

/// An empty plane with texels as large as those of another, where the eye sees a curved card.
fn seen_area(
    flat: &PaintedPlane,
    card: &Card,
    cylinder: &Cylinder,
    eye: &Point3<f64>,
) -> PaintedPlane {
    let border = border_points(card.quad.size);
    let seen = border.map(|p| cylinder.on_plane(eye, &cylinder.point(&p)));
    let seen = BBox::around(seen.map(|p| flat.position(&p).into()));
    let (left, top) = (seen.x0.floor() - 1.0, seen.y0.floor() - 1.0);
    let columns = (seen.x1 + 1.0 - left).ceil() as usize;
    PaintedPlane {
        film: Image::new(columns, (seen.y1 + 1.0 - top).ceil() as usize),
        corner: flat.point(left, top),
        texel: flat.texel,
    }
}

/// Points along the sides of a card of this size.
fn border_points([w, h]: [f64; 2]) -> impl Iterator<Item = Point2<f64>> {
    let shares = (0..SIDE_POINTS).map(|k| k as f64 / (SIDE_POINTS - 1) as f64 - 0.5);
    shares.flat_map(move |share| {
        [[share, 0.5], [share, -0.5], [0.5, share], [-0.5, share]]
            .map(|[x, y]| Point2::new(x * w, y * h))
    })
}

/// Unobstructed light along a bend, as a share of that on the flat card.
pub(super) struct BentShading {
    reach: f64,
    shares: Vec<LinearRgb>,
}

impl BentShading {
    /// For a card on the side of the camera.
    pub(super) fn new(
        darkroom: &Darkroom<'_>,
        card: &Card,
        plane: &ScenePlane,
        cylinder: &Cylinder,
    ) -> Self {
        let behind = plane.is_seen_from_behind(&darkroom.view.eye);
        let side = if behind { -1.0 } else { 1.0 };
        let light_at = |arc: f64| {
            let patch = LitPatch {
                center: plane.center,
                normal: card.quad.world_from_card.rotation * cylinder.normal(arc) * side,
                reach: plane.half_length(),
                spread: plane.half_length(),
                occluded: plane.half_length(),
                cell: 0.0,
            };
            open_irradiance(darkroom, &patch)
        };
        let flat = light_at(0.0);
        let nodes = (0..SHADING_NODES).map(|k| {
            let arc = cylinder.reach * (2.0 * k as f64 / (SHADING_NODES - 1) as f64 - 1.0);
            ratio(light_at(arc), flat)
        });
        Self {
            reach: cylinder.reach,
            shares: nodes.collect(),
        }
    }

    /// The share at a position along the bend; beyond the ends, that of the nearer one.
    fn at(&self, arc: f64) -> LinearRgb {
        let place = 0.5 * (arc / self.reach + 1.0) * (SHADING_NODES - 1) as f64;
        let place = place.clamp(0.0, (SHADING_NODES - 1) as f64).max(0.0);
        let before = (place as usize).min(SHADING_NODES - 2);
        let rest = (place - before as f64) as f32;
        let [a, b] = [self.shares[before], self.shares[before + 1]];
        a.mixed(b, rest)
    }
}

/// Irradiance in the middle of a patch over the surface, obstructed only by the surface.
fn open_irradiance(darkroom: &Darkroom<'_>, patch: &LitPatch) -> LinearRgb {
    let (shot, options, normal) = (darkroom.shot, darkroom.options, &patch.normal);
    // A plane at an angle to the surface sees this share of the sky above it.
    let sky = shot.ambient.scale(PI * (0.5 + 0.5 * normal.z) as f32);
    let faces = LightSamples::faces_above(shot, options, patch);
    let lit = faces.iter().fold(sky, |sum, group| {
        let above = group.samples.iter().filter(|sample| sample.at.z > 0.0);
        let irradiance: f64 = above.map(|s| s.irradiance(&patch.center, normal)).sum();
        sum + group.radiance.scale(irradiance as f32)
    });
    let maps = shot.environment.iter().filter(|map| map.strength != 0.0);
    maps.flat_map(|map| light::sky_pieces(map, options.ambient_samples, normal))
        .filter(|piece| piece.direction.z > 0.0)
        .fold(lit, |sum, piece| sum + piece.irradiance)
}

/// 1 if the flat card is in the dark.
fn ratio(light: LinearRgb, flat: LinearRgb) -> LinearRgb {
    light.zip_map(flat, |a, b| if b > 0.0 { a / b } else { 1.0 })
}
