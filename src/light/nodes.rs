//! Where an area light is sampled: few points, placed so that smooth integrals come out right.

use crate::geom::{Point3, Vector3};
use crate::light::area::{LightFrame, face_area, frame, side_lengths};
use crate::light::quadrature::gauss_legendre;
use crate::scene::{AreaLight, LightShape};
use std::f64::consts::{PI, TAU};

/// Longest equal pieces of a light, in distances of the receiver from its plane. Of longer ones,
/// the nearest alone would give nearly all of the light.
const LONGEST_EQUAL_PIECE: f64 = 1.5;

/// A point of a light's face and the area it represents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Where.
    pub point: Point3<f64>,
    /// Square metres; [`nodes`] add up to a light's area.
    pub area: f64,
}

/// `cos cos / r^2` on the way from a point of unit normal to one of a light's face; 0 below either
/// horizon.
pub(crate) fn geometry_term(
    way: &Vector3<f64>,
    face_normal: &Vector3<f64>,
    normal: &Vector3<f64>,
) -> f64 {
    let r2 = way.norm_squared();
    let cosines = normal.dot(way).max(0.0) * (-face_normal.dot(way)).max(0.0);
    if r2 > 0.0 { cosines / (r2 * r2) } else { 0.0 }
}

/// How many sample points lie along each side of a light, of which a square one has `per_side` (at
/// least 1): as many in all at most, as far apart along the one side as along the other.
pub fn samples_along(light: &AreaLight, per_side: usize) -> [usize; 2] {
    let (n, [a, b]) = (per_side.max(1), side_lengths(light));
    let ratio = a.max(b) / a.min(b);
    let longer = ((n as f64 * ratio.sqrt()).round() as usize).min(n * n);
    let shorter = n * n / longer;
    if a >= b {
        [longer, shorter]
    } else {
        [shorter, longer]
    }
}

/// Sample points of a light, so many (at least 1) along each side.
///
/// # Method
/// Rectangle: product of two Gauss-Legendre rules. Ellipse: the rings of Shirley and Chiu's
/// concentric map of a square of points, each for the same area, at radii that give the disk its
/// second moment; of an oblong one chords across its longer diameter, at the points of the Gauss rule
/// for their lengths (Chebyshev's polynomials of the second kind), with a Gauss-Legendre rule along
/// each.
pub fn nodes(light: &AreaLight, counts: [usize; 2]) -> Vec<Node> {
    let counts = counts.map(|n| n.max(1));
    match light.shape {
        LightShape::Rectangle => rectangle_nodes(light, counts.map(gauss_legendre)),
        LightShape::Ellipse if counts[0] == counts[1] => ellipse_nodes(light, counts[0]),
        LightShape::Ellipse => oblong_ellipse_nodes(light, counts),
    }
}

fn rectangle_nodes(light: &AreaLight, [along_x, along_y]: [Vec<(f64, f64)>; 2]) -> Vec<Node> {
    let (frame, area) = (frame(light), face_area(light));
    let [half_x, half_y] = half_sides(light);
    let mut nodes = Vec::with_capacity(along_x.len() * along_y.len());
    for (y, wy) in along_y {
        nodes.extend(along_x.iter().map(|&(x, wx)| Node {
            point: frame.point(x * half_x, y * half_y),
            area: area * wx * wy / 4.0,
        }));
    }
    nodes
}

fn half_sides(light: &AreaLight) -> [f64; 2] {
    side_lengths(light).map(|side| 0.5 * side)
}

/// The middles of equal pieces of a light, so many along each side; of an oblong ellipse its
/// [`nodes`].
///
/// Shadows blurred by each piece's width are as soft as the whole light's: the middles' second
/// moment and the pieces' own are the light's together.
fn pieces(light: &AreaLight, counts: [usize; 2]) -> Vec<Node> {
    match light.shape {
        LightShape::Rectangle => rectangle_nodes(light, counts.map(equal_parts)),
        LightShape::Ellipse if counts[0] == counts[1] => ellipse_pieces(light, counts[0]),
        LightShape::Ellipse => oblong_ellipse_nodes(light, counts),
    }
}

/// Middles in -1..1 and lengths of equal parts.
fn equal_parts(count: usize) -> Vec<(f64, f64)> {
    let length = 2.0 / count as f64;
    let middles = (0..count).map(|i| (i as f64 + 0.5) * length - 1.0);
    middles.map(|middle| (middle, length)).collect()
}

/// Nodes drawn in by as much as squares of their areas add to the second moment.
fn ellipse_pieces(light: &AreaLight, per_side: usize) -> Vec<Node> {
    let center = frame(light).center;
    let own_moment = PI / (3 * per_side * per_side) as f64;
    let drawn_in = (1.0 - own_moment).max(0.0).sqrt();
    let nodes = ellipse_nodes(light, per_side).into_iter();
    nodes
        .map(|node| Node {
            point: center + (node.point - center) * drawn_in,
            ..node
        })
        .collect()
}

fn ellipse_nodes(light: &AreaLight, per_side: usize) -> Vec<Node> {
    let (frame, area) = (frame(light), face_area(light));
    let half = half_sides(light);
    let count = (per_side * per_side) as f64;
    let disk = disk_points(per_side).map(|[x, y]| Node {
        point: frame.point(x * half[0], y * half[1]),
        area: area / count,
    });
    disk.collect()
}

fn oblong_ellipse_nodes(light: &AreaLight, counts: [usize; 2]) -> Vec<Node> {
    let (frame, area) = (frame(light), face_area(light));
    let [a, b] = half_sides(light);
    let longer = usize::from(counts[1] > counts[0]);
    let (chords, along) = (counts[longer], gauss_legendre(counts[1 - longer]));
    let mut nodes = Vec::with_capacity(chords * along.len());
    for i in 1..=chords {
        let (half, at) = libm::sincos(PI * i as f64 / (chords + 1) as f64);
        let width = 2.0 * half * half / (chords + 1) as f64;
        nodes.extend(along.iter().map(|&(t, w)| {
            let mut point = [at, half * t];
            point.rotate_right(longer);
            Node {
                point: frame.point(point[0] * a, point[1] * b),
                area: area * width * w / 2.0,
            }
        }));
    }
    nodes
}

/// The `n` x `n` points of a unit disk that stand for equal areas.
fn disk_points(n: usize) -> impl Iterator<Item = [f64; 2]> {
    let squares = (2 - n % 2..=n).step_by(2);
    squares.flat_map(move |side| ring_points(side, n))
}

/// The points of an `n` x `n` square that lie on the boundary of the middle one of this side, laid
/// around a ring.
fn ring_points(side: usize, n: usize) -> impl Iterator<Item = [f64; 2]> {
    let inner = side.saturating_sub(2).pow(2);
    let count = side * side - inner;
    let radius = ring_radius(inner + side * side, n);
    let turned = 0.5 * (side / 2 % 2) as f64;
    (0..count).map(move |i| {
        let (sin, cos) = libm::sincos(TAU * (i as f64 + turned) / count as f64);
        [radius * cos, radius * sin]
    })
}

/// The radius of the mean square of a ring between two shares of a disk, of which `2 n^2` are all;
/// none in the middle, and the others as much farther out as that takes away.
fn ring_radius(shares: usize, n: usize) -> f64 {
    if shares == 1 {
        return 0.0;
    }
    let count = (n * n) as f64;
    let middle = if n % 2 == 1 {
        1.0 / (count * count)
    } else {
        0.0
    };
    (shares as f64 / (2.0 * count * (1.0 - middle))).sqrt()
}

/// Nodes at the middles of equal steps of the sine of the angle under which `point` sees them, along
/// either side of what the receiver's plane leaves of a light; none if equal pieces are short enough.
///
/// Most light comes from where a large light is near, so there the nodes are: as if `point` were as
/// far away as the receiver's ends are, which have the light near elsewhere.
fn pieces_near(
    light: &AreaLight,
    counts: [usize; 2],
    point: Point3<f64>,
    reach: f64,
    horizon: &LightHorizon,
) -> Option<Vec<Node>> {
    let (frame, half) = (frame(light), half_sides(light));
    let way = point - frame.center;
    let distance = frame.normal.dot(&way);
    let longest = (2.0 * half[0] / counts[0] as f64).max(2.0 * half[1] / counts[1] as f64);
    let is_seen = distance > 0.0 && horizon.middle > -horizon.highest_rise(light.shape);
    let apart = distance.hypot(reach);
    if !is_seen || longest <= LONGEST_EQUAL_PIECE * apart {
        return None;
    }
    let foot = [frame.x.dot(&way), frame.y.dot(&way)];
    let steps = |axis: usize, range: [f64; 2]| {
        let ends = range.map(|end| end * half[axis]);
        sine_steps(ends, foot[axis], apart, counts[axis])
    };
    let axes = horizon.axes_by_rise();
    let [outer, inner] = axes;
    let mut nodes = Vec::with_capacity(counts[0] * counts[1]);
    for (a, width) in steps(outer, horizon.extent(light.shape, axes)) {
        let chord = horizon.chord(light.shape, axes, a / half[outer]);
        nodes.extend(steps(inner, chord).map(|(b, length)| {
            let [x, y] = point_on_axes(axes, [a, b]);
            Node {
                point: frame.point(x, y),
                area: width * length,
            }
        }));
    }
    Some(nodes)
}

/// Places between two ends at the middles of equal steps of the sine of the angle under which they
/// are seen, and the lengths that they stand for; at a distance from the line, over `foot`.
fn sine_steps(
    [from, to]: [f64; 2],
    foot: f64,
    distance: f64,
    count: usize,
) -> impl Iterator<Item = (f64, f64)> {
    let sine = |at: f64| (at - foot) / (at - foot).hypot(distance);
    let first = sine(from);
    let step = (sine(to) - first) / count as f64;
    (0..count).map(move |i| {
        let sine = first + (i as f64 + 0.5) * step;
        let cosine = (1.0 - sine * sine).sqrt();
        let place = foot + distance * sine / cosine;
        (place, step * distance / cosine.powi(3))
    })
}

/// Sample points of the part of a light that is above the plane through `point` with unit `normal`,
/// for a receiver that reaches so far around it, metres:
/// those of [`pieces_near`] of a light that is large and near, else those of [`pieces`] where the
/// plane does not cut the light, and as many on what it leaves where it does.
///
/// # Method
/// What is left of a rectangle is strips across the side that the plane turns away from fastest,
/// each from the plane to the rectangle's end, with a Gauss-Legendre rule along them and one
/// across. What is left of an ellipse is a segment of a disk, stretched: chords at equal angles'
/// cosines.
pub(crate) fn nodes_above(
    light: &AreaLight,
    counts: [usize; 2],
    point: Point3<f64>,
    normal: &Vector3<f64>,
    reach: f64,
) -> Vec<Node> {
    let frame = frame(light);
    let [a, b] = half_sides(light);
    let counts = counts.map(|n| n.max(1));
    let horizon = LightHorizon::new(&frame, [a, b], point, normal);
    if let Some(near) = pieces_near(light, counts, point, reach, &horizon) {
        return near;
    }
    let Some(left) = horizon.visible_part(light.shape, counts) else {
        return pieces(light, counts);
    };
    left.into_iter()
        .map(|([x, y], area)| Node {
            point: frame.point(x * a, y * b),
            area: area * a * b,
        })
        .collect()
}

/// A receiver's plane as a light sees it: its height over the plane is `middle + rise . point`,
/// with the light's sides running from -1 to 1.
struct LightHorizon {
    middle: f64,
    rise: [f64; 2],
}

impl LightHorizon {
    fn new(frame: &LightFrame, half: [f64; 2], point: Point3<f64>, normal: &Vector3<f64>) -> Self {
        Self {
            middle: normal.dot(&(frame.center - point)),
            rise: [
                half[0] * normal.dot(&frame.x),
                half[1] * normal.dot(&frame.y),
            ],
        }
    }

    /// Points and areas of what the plane leaves, with the light's sides running from -1 to 1; none
    /// where it cuts nothing.
    fn visible_part(&self, shape: LightShape, counts: [usize; 2]) -> Option<Vec<([f64; 2], f64)>> {
        (self.middle.abs() < self.highest_rise(shape)).then(|| match shape {
            LightShape::Rectangle => self.strips(counts),
            LightShape::Ellipse => self.chords(counts),
        })
    }

    /// How far the light's highest point is above its middle.
    fn highest_rise(&self, shape: LightShape) -> f64 {
        match shape {
            LightShape::Rectangle => self.rise[0].abs() + self.rise[1].abs(),
            LightShape::Ellipse => self.steepest_rise(),
        }
    }

    fn steepest_rise(&self) -> f64 {
        self.rise[0].hypot(self.rise[1])
    }

    /// From where to where the part above the plane reaches along one side, `outer` of both.
    fn extent(&self, shape: LightShape, [outer, inner]: [usize; 2]) -> [f64; 2] {
        let [middle, rise, across] = [self.middle, self.rise[outer], self.rise[inner]];
        if shape == LightShape::Rectangle {
            return above(middle + across.abs(), rise);
        }
        let steepest = self.steepest_rise();
        let at = (-middle / steepest).clamp(-1.0, 1.0);
        let half = (1.0 - at * at).sqrt() * across.abs() / steepest;
        let cut = at * rise / steepest;
        [
            if middle > rise { -1.0 } else { cut - half },
            if middle > -rise { 1.0 } else { cut + half },
        ]
    }

    /// From where to where the part above the plane reaches along `inner`, at a place along `outer`.
    fn chord(&self, shape: LightShape, [outer, inner]: [usize; 2], at: f64) -> [f64; 2] {
        let half = match shape {
            LightShape::Rectangle => 1.0,
            LightShape::Ellipse => (1.0 - at * at).max(0.0).sqrt(),
        };
        above(self.middle + self.rise[outer] * at, self.rise[inner])
            .map(|end| end.clamp(-half, half))
    }

    /// Points and areas in the square -1..1 above the plane.
    fn strips(&self, counts: [usize; 2]) -> Vec<([f64; 2], f64)> {
        let (shape, axes) = (LightShape::Rectangle, self.axes_by_rise());
        let [outer, inner] = axes;
        let [strips, along] = [outer, inner].map(|axis| gauss_legendre(counts[axis]));
        let mut points = Vec::with_capacity(strips.len() * along.len());
        for (a, width) in rule_on(self.extent(shape, axes), &strips) {
            for (b, length) in rule_on(self.chord(shape, axes, a), &along) {
                points.push((point_on_axes(axes, [a, b]), width * length));
            }
        }
        points
    }

    /// The side that the plane turns away from fastest, then the other.
    fn axes_by_rise(&self) -> [usize; 2] {
        if self.rise[1].abs() >= self.rise[0].abs() {
            [0, 1]
        } else {
            [1, 0]
        }
    }

    /// Points and areas in the unit disk above the plane.
    fn chords(&self, counts: [usize; 2]) -> Vec<([f64; 2], f64)> {
        let steepest = self.steepest_rise();
        let up = self.rise.map(|r| r / steepest);
        let widest = libm::acos((-self.middle / steepest).clamp(-1.0, 1.0));
        let [n, m] = self.axes_by_rise().map(|axis| counts[axis]);
        // Chords of a nearly whole disk grow and shrink again: n of them miss its area by 2 %.
        let (across, along) = (gauss_legendre(2 * n), gauss_legendre(m));
        let mut points = Vec::with_capacity(2 * n * m);
        for (angle, width) in rule_on([0.0, widest], &across) {
            let (half, at) = libm::sincos(angle);
            points.extend(
                along
                    .iter()
                    .map(|&(t, w)| (point_on_chord(up, at, half * t), width * half * half * w)),
            );
        }
        points
    }
}

/// The point of these coordinates along two axes, of which either may be the first.
#[inline]
fn point_on_axes([outer, inner]: [usize; 2], [a, b]: [f64; 2]) -> [f64; 2] {
    let mut point = [0.0; 2];
    (point[outer], point[inner]) = (a, b);
    point
}

/// A point of the chord across a unit direction at a distance from the middle, so far from the
/// chord's own middle.
#[inline]
fn point_on_chord([x, y]: [f64; 2], at: f64, along: f64) -> [f64; 2] {
    [at * x - along * y, at * y + along * x]
}

/// The part of -1..1 where `start + slope x` is above 0.
fn above(start: f64, slope: f64) -> [f64; 2] {
    let edge = -start / slope;
    match slope {
        s if s > 0.0 => [edge.clamp(-1.0, 1.0), 1.0],
        s if s < 0.0 => [-1.0, edge.clamp(-1.0, 1.0)],
        _ => [-1.0, 1.0],
    }
}

/// A rule on an interval: points and weights.
fn rule_on([from, to]: [f64; 2], rule: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> {
    let half = 0.5 * (to - from);
    rule.iter()
        .map(move |(x, w)| (from + half * (1.0 + x), half * w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::area::radiance;
    use crate::light::area::tests::{lit_points, square};
    use crate::light::irradiance::unit_irradiance;

    /// Irradiance at a point by unit radiance from the nodes of a light: `cos cos / r^2 dA`; 0 below
    /// either horizon.
    fn irradiance(
        nodes: &[Node],
        light: &AreaLight,
        point: Point3<f64>,
        normal: Vector3<f64>,
    ) -> f64 {
        let face = frame(light).normal;
        nodes
            .iter()
            .map(|n| geometry_term(&(n.point - point), &face, &normal) * n.area)
            .sum()
    }

    #[test]
    fn nine_nodes_match_the_closed_form() {
        for (at, normal, expected) in lit_points() {
            let sum = irradiance(&nodes(&square(), [3; 2]), &square(), at.into(), normal);
            let e = sum * f64::from(radiance(&square()).r);
            assert!(
                (e / expected - 1.0).abs() < 1e-4,
                "{at:?}: {e} against {expected}"
            );
        }
    }

    #[test]
    fn nodes_add_up_to_the_area() {
        let disk = AreaLight {
            shape: LightShape::Ellipse,
            size: [0.4, 0.2],
            ..square()
        };
        for (light, expected) in [(square(), 0.16), (disk, PI * 0.02)] {
            for counts in [[4, 4], [6, 2], [1, 5]] {
                let sum: f64 = nodes(&light, counts).iter().map(|n| n.area).sum();
                assert!((sum - expected).abs() < 1e-12, "{counts:?}");
            }
        }
    }

    /// An upright light whose middle is so high above the origin's level plane, turned about its
    /// own axis.
    fn standing(shape: LightShape, height: f64, target: [f64; 3]) -> AreaLight {
        AreaLight {
            shape,
            position: [1.0, 0.0, height],
            target,
            size: [1.0, 0.8],
            ..square()
        }
    }

    #[test]
    fn a_light_cut_by_the_horizon_is_summed_over_what_is_left_of_it() {
        for shape in [LightShape::Rectangle, LightShape::Ellipse] {
            for (height, target) in [
                (0.0, [0.0; 3]),
                (0.2, [0.0, 0.3, 0.1]),
                (-0.25, [0.0, 0.0, 0.2]),
                (0.3, [0.0; 3]),
            ] {
                let light = standing(shape, height, target);
                let nodes = nodes_above(&light, [3; 2], Point3::origin(), &Vector3::z(), 0.0);
                assert!(nodes.iter().all(|n| n.point.z > 0.0), "{shape:?} {height}");
                let [sum, fine] = [nodes, super::nodes(&light, [400; 2])]
                    .map(|nodes| irradiance(&nodes, &light, Point3::origin(), Vector3::z()));
                assert!(
                    (sum / fine - 1.0).abs() < 0.02,
                    "{shape:?} {height}: {sum} against {fine}"
                );
            }
        }
    }

    #[test]
    fn what_the_horizon_leaves_has_its_area() {
        let half = |shape| standing(shape, 0.0, [0.0; 3]);
        let area = |light: &AreaLight| -> f64 {
            nodes_above(light, [3; 2], Point3::origin(), &Vector3::z(), 0.0)
                .iter()
                .map(|n| n.area)
                .sum()
        };
        assert!((area(&half(LightShape::Rectangle)) - 0.4).abs() < 1e-12);
        assert!((area(&half(LightShape::Ellipse)) - PI * 0.1).abs() < 1e-6);
        // A segment of a disk, stretched: closed form.
        for height in [-0.49, -0.2, 0.1, 0.3, 0.49] {
            let cut = height / 0.5;
            let expected = 0.2 * (PI - libm::acos(cut) + cut * (1.0 - cut * cut).sqrt());
            let found = area(&standing(LightShape::Ellipse, height, [0.0, 0.0, height]));
            assert!(
                (found / expected - 1.0).abs() < 1e-3,
                "{height}: {found} against {expected}"
            );
        }
    }

    #[test]
    fn a_light_that_the_horizon_does_not_cut_is_whole() {
        let light = square();
        assert_eq!(
            nodes_above(&light, [3; 2], Point3::origin(), &Vector3::z(), 0.0),
            pieces(&light, [3; 2])
        );
    }

    /// A level light over the origin, aimed nearly straight down.
    fn nearby(shape: LightShape, size: [f64; 2], height: f64) -> AreaLight {
        AreaLight {
            shape,
            target: [0.3 * height, 0.0, 0.0],
            ..AreaLight::new([0.3 * height, 0.0, height], size, 10.0)
        }
    }

    /// The light's nodes give what the closed form does within a tolerance, none of them most of it.
    fn check_nodes_above(
        light: &AreaLight,
        counts: [usize; 2],
        normal: Vector3<f64>,
        tolerance: f64,
    ) {
        let case = format!("{:?} {:?} {counts:?} {normal:?}", light.shape, light.size);
        let nodes = nodes_above(light, counts, Point3::origin(), &normal, 0.0);
        let sum = irradiance(&nodes, light, Point3::origin(), normal);
        let exact = unit_irradiance(light, Point3::origin(), normal);
        assert!(
            (sum / exact - 1.0).abs() < tolerance,
            "{case}: {sum} against {exact}"
        );
        let brightest = nodes
            .iter()
            .map(|&node| irradiance(&[node], light, Point3::origin(), normal))
            .fold(0.0, f64::max);
        assert!(brightest < 0.35 * sum, "{case}: {brightest} of {sum}");
    }

    #[test]
    fn a_large_light_nearby_is_sampled_where_its_light_comes_from() {
        for shape in [LightShape::Rectangle, LightShape::Ellipse] {
            for (size, height, counts) in
                [(30.0, 1.0, [3; 2]), (1.0, 0.1, [3; 2]), (8.0, 1.0, [2; 2])]
            {
                let light = nearby(shape, [size; 2], height);
                check_nodes_above(&light, counts, Vector3::z(), 0.1);
            }
        }
    }

    #[test]
    fn a_large_light_nearby_that_the_horizon_cuts_is_sampled_where_its_light_comes_from() {
        for shape in [LightShape::Rectangle, LightShape::Ellipse] {
            for (size, height, tilt) in [
                ([30.0, 30.0], 1.0, 0.4),
                ([30.0, 30.0], 1.0, 1.2),
                ([1.0, 1.0], 0.1, 0.7),
                ([8.0, 4.0], 0.5, 0.9),
            ] {
                let light = nearby(shape, size, height);
                for turn in [0.0, 0.6, 2.5] {
                    let (sin, cos) = libm::sincos(tilt);
                    let (y, x) = libm::sincos(turn);
                    let normal = Vector3::new(sin * x, sin * y, cos);
                    check_nodes_above(&light, [3; 2], normal, 0.2);
                }
            }
        }
    }

    #[test]
    fn pieces_with_their_widths_have_the_second_moment_of_the_light() {
        // Of the shorter side: a square of side 2 has a third, a unit disk a quarter.
        for (shape, moment) in [
            (LightShape::Rectangle, 1.0 / 3.0),
            (LightShape::Ellipse, 0.25),
        ] {
            let light = AreaLight { shape, ..square() };
            for per_side in [2, 3, 8] {
                let pieces = pieces(&light, [per_side; 2]);
                let (frame, half) = (frame(&light), half_sides(&light)[0]);
                let moments = pieces.iter().map(|piece| {
                    let x = frame.x.dot(&(piece.point - frame.center));
                    piece.area * (x * x + piece.area / 12.0)
                });
                let found = moments.sum::<f64>() / (face_area(&light) * half * half);
                assert!(
                    (found / moment - 1.0).abs() < 1e-9,
                    "{shape:?} {per_side}: {found}"
                );
            }
        }
    }

    #[test]
    fn asking_for_no_nodes_gives_the_centre() {
        let light = square();
        assert_eq!(nodes(&light, [0; 2]).len(), 1);
        assert!((nodes(&light, [0; 2])[0].point - Point3::from(light.position)).norm() < 1e-12);
    }

    #[test]
    fn a_tube_has_its_samples_along_its_length() {
        let counts = [[0.4, 0.4], [0.4, 0.32], [0.2, 0.4], [1.2, 0.03], [0.0, 1.0]].map(|size| {
            let light = AreaLight { size, ..square() };
            samples_along(&light, 3)
        });
        assert_eq!(counts, [[3, 3], [3, 3], [2, 4], [9, 1], [1, 9]]);
    }

    #[test]
    fn few_nodes_of_an_oblong_light_match_the_closed_form() {
        for shape in [LightShape::Rectangle, LightShape::Ellipse] {
            for size in [[1.2, 0.03], [0.06, 1.0]] {
                let light = AreaLight {
                    shape,
                    size,
                    ..square()
                };
                let nodes = nodes(&light, samples_along(&light, 3));
                let sum = irradiance(&nodes, &light, Point3::origin(), Vector3::z());
                let exact = unit_irradiance(&light, Point3::origin(), Vector3::z());
                assert!((sum / exact - 1.0).abs() < 1e-3, "{shape:?} {size:?}");
            }
        }
    }
}
