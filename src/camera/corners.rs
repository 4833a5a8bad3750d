//! Four labelled corners, checked and put in order.

use super::error::{SolveError, corner_name};
use super::options::CornerOrder;
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::{Point2, Vector2, mean_point};

/// Corners closer than this many pixels are one corner; also closer than [`COINCIDENT_SIGMAS`]
/// times their noise.
pub(super) const COINCIDENT_PX: f64 = 2.0;
const COINCIDENT_SIGMAS: f64 = 4.0;
/// A corner nearer than this many sigmas to the line of two others makes a triangle.
const COLLINEAR_SIGMAS: f64 = 3.0;
/// Below this length of the longest side corner noise is a large part of the picture.
const SMALL_QUAD_PX: f64 = 50.0;

/// Corners in order: convex, clockwise in the picture (y down), starting at the labelled first.
#[derive(Clone, Debug)]
pub(crate) struct OrderedCorners {
    pub(crate) corners: [Point2<f64>; 4],
    pub(crate) warnings: Vec<Diagnostic>,
}

/// Checks four corners (pixels) labelled with noise `sigma` in a picture of size `image`, and
/// repairs their order.
///
/// # Errors
/// [`SolveError`] for corners that no rectangle in front of a camera can have.
pub(crate) fn check(
    labelled: [Point2<f64>; 4],
    sigma: f64,
    image: [u32; 2],
    policy: CornerOrder,
) -> Result<OrderedCorners, SolveError> {
    refuse_coincident(&labelled, sigma)?;
    let (order, repair) = clockwise(&labelled);
    let corners = order.map(|i| labelled[i]);
    refuse_folded(&corners, order, sigma)?;
    if let (CornerOrder::Strict, Some(found)) = (policy, repair.clone()) {
        return Err(SolveError::Order(found));
    }
    let found = repair.into_iter().chain(small_quad(&corners));
    Ok(OrderedCorners {
        corners,
        warnings: found.chain(far_outside(labelled, image)).collect(),
    })
}

/// Twice the signed areas of the triangles that leave out one corner each; in a picture of a
/// rectangle the one without corner `i` is proportional to the depth of corner `i`.
pub(crate) fn triangle_areas(c: &[Vector2<f64>; 4]) -> [f64; 4] {
    OTHER_CORNERS.map(|[i, j, k]| (c[j] - c[i]).perp(&(c[k] - c[i])))
}

/// The three corners other than each.
const OTHER_CORNERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

fn refuse_coincident(c: &[Point2<f64>; 4], sigma: f64) -> Result<(), SolveError> {
    let of_noise_px = COINCIDENT_SIGMAS * sigma;
    let (limit_px, sigmas) = if of_noise_px > COINCIDENT_PX {
        (of_noise_px, COINCIDENT_SIGMAS)
    } else {
        (COINCIDENT_PX, 0.0)
    };
    for [first, second] in CORNER_PAIRS {
        let distance_px = (c[first] - c[second]).norm();
        if distance_px < limit_px {
            return Err(SolveError::Coincident {
                first,
                second,
                distance_px,
                limit_px,
                sigmas,
            });
        }
    }
    Ok(())
}

const CORNER_PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The order in which the corners run clockwise, and what had to be repaired for that.
fn clockwise(c: &[Point2<f64>; 4]) -> ([usize; 4], Option<Diagnostic>) {
    let areas = triangle_areas(&c.map(|p| p.coords));
    if areas.iter().all(|&a| a > 0.0) {
        ([0, 1, 2, 3], None)
    } else if areas.iter().all(|&a| a < 0.0) {
        let what = "the corners run anticlockwise; the second and fourth were swapped";
        let reversed = Diagnostic::warning(Code::CornersReversed, what);
        ([0, 3, 2, 1], Some(reversed))
    } else {
        let what = "the corners cross each other; sorted clockwise, starting at the first";
        let reordered = Diagnostic::warning(Code::CornersReordered, what);
        (by_angle(c), Some(reordered))
    }
}

/// By angle around the mean (clockwise, as y runs down), rotated so that corner 0 stays first.
fn by_angle(c: &[Point2<f64>; 4]) -> [usize; 4] {
    let mean = mean_point(c);
    let angles = c.map(|p| libm::atan2(p.y - mean.y, p.x - mean.x));
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&i: &usize, &j: &usize| angles[i].total_cmp(&angles[j]));
    let first = order.iter().position(|&i| i == 0).unwrap_or(0);
    order.rotate_left(first);
    order
}

/// Ordered corners must be convex, and none within noise of the line of two others; `order` is
/// where they are in the label.
fn refuse_folded(c: &[Point2<f64>; 4], order: [usize; 4], sigma: f64) -> Result<(), SolveError> {
    let areas = triangle_areas(&c.map(|p| p.coords));
    let limit_px = COLLINEAR_SIGMAS * sigma;
    for (left_out, area) in areas.into_iter().enumerate() {
        let height_px = area / longest_side_without(c, left_out);
        if height_px <= -limit_px.max(f64::MIN_POSITIVE) {
            return Err(SolveError::NotConvex);
        }
        if height_px < limit_px || area <= 0.0 {
            return Err(SolveError::Collinear {
                corner: order[(left_out + 2) % 4],
                distance_px: height_px.abs(),
                limit_px,
                sigmas: COLLINEAR_SIGMAS,
            });
        }
    }
    Ok(())
}

/// The longest side of the triangle of the other three corners.
fn longest_side_without(c: &[Point2<f64>; 4], left_out: usize) -> f64 {
    let [i, j, k] = [1, 2, 3].map(|n| c[(left_out + n) % 4]);
    (i - j).norm().max((j - k).norm()).max((k - i).norm())
}

fn small_quad(c: &[Point2<f64>; 4]) -> Option<Diagnostic> {
    let longest_px = longest_side(c);
    (longest_px < SMALL_QUAD_PX).then(|| {
        let what = format!(
            "the longest side is only {longest_px:.1} px; expected at least {SMALL_QUAD_PX}"
        );
        Diagnostic::warning(Code::SmallQuad, what)
    })
}

fn longest_side(c: &[Point2<f64>; 4]) -> f64 {
    (0..4)
        .map(|i| (c[(i + 1) % 4] - c[i]).norm())
        .fold(0.0, f64::max)
}

/// In the order of the label, in which a person looks for them.
fn far_outside(labelled: [Point2<f64>; 4], image: [u32; 2]) -> impl Iterator<Item = Diagnostic> {
    let far = (0..4).filter(move |&corner| is_far_outside(labelled[corner], image));
    far.map(|corner| {
        let name = corner_name(corner);
        let what = format!("the {name} corner is more than a diagonal outside the picture");
        Diagnostic::warning(Code::CornerOutside, what)
    })
}

/// More than a diagonal of the picture.
fn is_far_outside(corner: Point2<f64>, image: [u32; 2]) -> bool {
    let size = Vector2::from(image.map(f64::from));
    let inside = Vector2::new(corner.x.clamp(0.0, size.x), corner.y.clamp(0.0, size.y));
    (corner.coords - inside).norm() > size.norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: [[f64; 2]; 4] = [[100.0, 110.0], [600.0, 90.0], [620.0, 410.0], [90.0, 400.0]];

    fn run(c: [[f64; 2]; 4]) -> Result<OrderedCorners, SolveError> {
        check(c.map(Point2::from), 1.0, [640, 480], CornerOrder::Repair)
    }

    fn codes(warnings: &[Diagnostic]) -> Vec<Code> {
        warnings.iter().map(|warning| warning.code).collect()
    }

    fn permutations() -> Vec<[usize; 4]> {
        let all = (0..256).map(|n: usize| [n & 3, (n >> 2) & 3, (n >> 4) & 3, (n >> 6) & 3]);
        all.filter(|p| (0..4).all(|v| p.contains(&v))).collect()
    }

    #[test]
    fn every_order_becomes_the_same_cycle_from_the_labelled_first() {
        let counts = permutations().into_iter().fold([0; 3], |mut counts, p| {
            let checked = run(p.map(|i| QUAD[i])).unwrap();
            let cycle = [0, 1, 2, 3].map(|n| Point2::from(QUAD[(p[0] + n) % 4]));
            assert_eq!(checked.corners, cycle, "{p:?}");
            counts[match codes(&checked.warnings)[..] {
                [] => 0,
                [Code::CornersReversed] => 1,
                ref other => 2 * usize::from(other == [Code::CornersReordered]),
            }] += 1;
            counts
        });
        assert_eq!(counts, [4, 4, 16]);
    }

    #[test]
    fn strict_order_refuses_what_repair_repairs() {
        let crossed = [QUAD[0], QUAD[2], QUAD[1], QUAD[3]].map(Point2::from);
        let strict = check(crossed, 1.0, [640, 480], CornerOrder::Strict);
        let Err(SolveError::Order(found)) = strict else {
            panic!("{strict:?}");
        };
        assert_eq!(found.code, Code::CornersReordered);
    }

    #[test]
    fn a_dent_is_not_convex() {
        let dented = [QUAD[0], QUAD[1], [200.0, 180.0], QUAD[3]];
        assert_eq!(run(dented).unwrap_err(), SolveError::NotConvex);
    }

    #[test]
    fn a_corner_within_noise_of_a_side_is_collinear() {
        for y in [255.0, 256.0, 254.2] {
            let flat = [[100.0, 110.0], [600.0, 90.0], [350.0, y], [100.0, 420.0]];
            assert!(
                matches!(run(flat), Err(SolveError::Collinear { corner: 2, .. })),
                "{y}: {:?}",
                run(flat)
            );
        }
    }

    #[test]
    fn two_corners_at_one_place_are_coincident() {
        let twice = [QUAD[0], [101.0, 110.5], QUAD[2], QUAD[3]];
        assert!(matches!(
            run(twice),
            Err(SolveError::Coincident {
                first: 0,
                second: 1,
                ..
            })
        ));
    }

    #[test]
    fn small_and_far_quads_are_taken_with_a_warning() {
        let small = run([
            [100.0, 100.0],
            [140.0, 100.0],
            [140.0, 130.0],
            [100.0, 130.0],
        ])
        .unwrap();
        assert_eq!(codes(&small.warnings), [Code::SmallQuad]);
        let what = small.warnings[0].to_string();
        assert!(what.contains("40.0 px; expected at least 50"), "{what}");
        let far = run([QUAD[0], [1600.0, 90.0], [1620.0, 410.0], QUAD[3]]).unwrap();
        assert_eq!(
            codes(&far.warnings),
            [Code::CornerOutside, Code::CornerOutside]
        );
        for (warning, corner) in far.warnings.iter().zip(["the second", "the third"]) {
            assert!(warning.message.starts_with(corner), "{warning}");
        }
    }

    #[test]
    fn corners_out_of_order_are_named_as_labelled() {
        let reversed = run([QUAD[0], QUAD[3], [1620.0, 410.0], [1600.0, 90.0]]).unwrap();
        let named: Vec<_> = reversed.warnings.iter().map(ToString::to_string).collect();
        assert!(named[1].starts_with("the third") && named[2].starts_with("the fourth"));
        let flat = [
            [100.0, 110.0],
            [600.0, 90.0],
            [100.0, 420.0],
            [350.0, 255.0],
        ];
        let refusal = run(flat).unwrap_err().to_string();
        assert!(refusal.contains("the fourth corner is"), "{refusal}");
    }
}
