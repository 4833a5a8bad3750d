//! An ellipse whose area, pixels and chords have closed forms.

use crate::pile::camera_above;
use petcomp::Image;
use petcomp::geom::{Point2, Pose, Quad, UnitQuaternion, Vector3, sides};
use petcomp::label::RleMask;
use petcomp::scene::{Card, Shot};
use petcomp::{DeepImage, DeepSample};
use petcomp::{Depth, LinearRgb, ObjectId, PremulRgba};
use std::f64::consts::{PI, TAU};

/// Half lengths of the ellipse, metres, and its rotation, radians.
pub(super) const ELLIPSE_HALF_M: [f64; 2] = [0.13, 0.045];
const TURN_RAD: f64 = 0.5;
/// Points of a pixel along each side.
const POINTS_PER_SIDE: usize = 16;

/// The corners of a polygon.
pub(super) type Ring = Vec<Point2<f64>>;

/// The parts of a row line that are in an odd number of rings.
fn spans_inside(rings: &[Ring], y: f64) -> Vec<[f64; 2]> {
    let mut crossings: Vec<f64> = rings
        .iter()
        .flat_map(|ring| sides(ring))
        .filter_map(|side| crossing(side, y))
        .collect();
    crossings.sort_by(f64::total_cmp);
    let pairs = crossings.chunks_exact(2);
    pairs.map(|pair| [pair[0], pair[1]]).collect()
}

/// Where a side crosses a row line.
fn crossing([a, b]: [Point2<f64>; 2], y: f64) -> Option<f64> {
    let is_crossed = (a.y <= y) != (b.y <= y);
    is_crossed.then(|| a.x + (y - a.y) * (b.x - a.x) / (b.y - a.y))
}

fn overlap_length([a, b]: [f64; 2], chord: [f64; 2]) -> f64 {
    (b.min(chord[1]) - a.max(chord[0])).max(0.0)
}

/// The ellipse in a picture.
pub(super) struct Ellipse {
    image: [u32; 2],
    pub(super) center: Point2<f64>,
    half_px: [f64; 2],
}

impl Ellipse {
    pub(super) fn seen_by(image: [u32; 2]) -> Self {
        let camera = camera_above(image, 1.0);
        Self {
            image,
            center: camera.principal_px,
            half_px: ELLIPSE_HALF_M.map(|half| half * camera.focal_px.x),
        }
    }

    pub(super) fn area(&self) -> f64 {
        PI * self.half_px[0] * self.half_px[1]
    }

    /// 1 on the ellipse, less inside.
    pub(super) fn level(&self, x: f64, y: f64) -> f64 {
        // The picture's y runs down, the world's up: the ellipse turns the other way.
        let along = turned_back(x - self.center.x, self.center.y - y);
        (along[0] / self.half_px[0]).powi(2) + (along[1] / self.half_px[1]).powi(2)
    }

    /// The share of a pixel inside.
    fn coverage(&self, x: u32, y: u32) -> f64 {
        let points = POINTS_PER_SIDE * POINTS_PER_SIDE;
        let inside = (0..points).filter(|i| self.holds_subpixel(x, y, *i));
        inside.count() as f64 / points as f64
    }

    /// Whether point `i` of a pixel is inside.
    fn holds_subpixel(&self, x: u32, y: u32, i: usize) -> bool {
        let [dx, dy] = [i % POINTS_PER_SIDE, i / POINTS_PER_SIDE]
            .map(|k| (k as f64 + 0.5) / POINTS_PER_SIDE as f64);
        self.level(f64::from(x) + dx, f64::from(y) + dy) <= 1.0
    }

    pub(super) fn iou(&self, mask: &RleMask) -> f64 {
        let both: f64 = mask.pixels().map(|(x, y)| self.coverage(x, y)).sum();
        both / (mask.area() as f64 + self.area() - both)
    }

    /// The same for the area in an odd number of rings.
    pub(super) fn iou_of_rings(&self, rings: &[Ring]) -> f64 {
        let step = 1.0 / POINTS_PER_SIDE as f64;
        let lines = 0..self.image[1] as usize * POINTS_PER_SIDE;
        let (both, own) = lines.fold((0.0, 0.0), |(both, own), i| {
            let [shared, length] = self.line_lengths(rings, (i as f64 + 0.5) * step);
            (both + step * shared, own + step * length)
        });
        both / (own + self.area() - both)
    }

    /// Lengths of a line in both the rings and the ellipse, and in the rings.
    fn line_lengths(&self, rings: &[Ring], y: f64) -> [f64; 2] {
        let chord = self.chord(y).unwrap_or_default();
        let spans = spans_inside(rings, y);
        let shared = spans.iter().map(|span| overlap_length(*span, chord)).sum();
        [shared, spans.iter().map(|[a, b]| b - a).sum()]
    }

    /// Where the ellipse crosses a row line; none if it does not.
    pub(super) fn chord(&self, y: f64) -> Option<[f64; 2]> {
        // The level is a parabola along the line: through three points of it.
        let [low, middle, high] =
            [-1.0, 0.0, 1.0].map(|dx| self.level(self.center.x + dx, y) - 1.0);
        let (a, b) = (0.5 * (low + high) - middle, 0.5 * (high - low));
        let discriminant = b * b - 4.0 * a * middle;
        let root = discriminant.max(0.0).sqrt();
        (discriminant > 0.0)
            .then(|| [-root, root].map(|root| self.center.x + (root - b) / (2.0 * a)))
    }

    /// A card whose outline has this number of corners on the ellipse.
    pub(super) fn shot(&self, corners: usize) -> Shot {
        let turns = (0..corners).map(|i| TAU * i as f64 / corners as f64);
        let texture = Image::<PremulRgba>::new(2, 2);
        Shot::new(camera_above(self.image, 1.0)).with_card(Card {
            outline_uv: turns.map(place_uv).collect(),
            ..Card::new(ObjectId(1), bounding_quad(), texture)
        })
    }

    /// Deep samples of a perfect renderer.
    pub(super) fn deep(&self) -> DeepImage {
        let [w, h] = self.image;
        let white = Image::filled(w as usize, h as usize, LinearRgb::WHITE);
        let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        let coverage = pixels.map(|(x, y)| self.coverage(x, y) as f32);
        DeepImage::from_pixels(white, coverage.map(deep_samples))
    }
}

/// An offset in the frame of the ellipse's axes.
fn turned_back(dx: f64, dy: f64) -> [f64; 2] {
    let (sin, cos) = (libm::sin(TURN_RAD), libm::cos(TURN_RAD));
    [dx * cos + dy * sin, dy * cos - dx * sin]
}

/// The card that the ellipse fills.
fn bounding_quad() -> Quad {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TURN_RAD);
    Quad {
        world_from_card: Pose::from_parts(Vector3::zeros().into(), rotation),
        size: ELLIPSE_HALF_M.map(|half| 2.0 * half),
    }
}

/// A point on the ellipse's border, on its card.
fn place_uv(turn: f64) -> Point2<f64> {
    Point2::new(0.5 + 0.5 * libm::cos(turn), 0.5 + 0.5 * libm::sin(turn))
}

fn deep_samples(alpha: f32) -> Vec<DeepSample> {
    if alpha == 0.0 {
        return Vec::new();
    }
    vec![DeepSample {
        object: ObjectId(1),
        depth: Depth(1.0),
        light: LinearRgb::BLACK,
        alpha,
        visible: alpha,
    }]
}
