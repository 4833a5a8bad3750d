//! The projective map of a plane from four or more points, as a first guess.
//!
//! # Method
//! The direct linear transformation with Hartley's normalisation: both point sets to zero mean and
//! RMS distance sqrt 2.

use crate::geom::{Homography, Point2, Vector3, mean_point};
use nalgebra::{Matrix3, SMatrix, SVector};

/// Singular systems have a second eigenvalue below this, a point.
const SINGULAR_EIGENVALUE: f64 = 1e-9;

/// The map that takes each `from` nearest to its `to`; none for fewer than four points or all on a
/// line.
pub(crate) fn homography(pairs: &[(Point2<f64>, Point2<f64>)]) -> Option<Homography> {
    if pairs.len() < 4 {
        return None;
    }
    let (from, to) = normalisations(pairs)?;
    let normalized = pairs
        .iter()
        .map(|(p, q)| (from * p.to_homogeneous(), to * q.to_homogeneous()));
    let square = normal_matrix(normalized);
    let h = null_vector(square, SINGULAR_EIGENVALUE * pairs.len() as f64)?;
    let map = to.try_inverse()? * Matrix3::from_row_slice(h.as_slice()) * from;
    map.iter().all(|v| v.is_finite()).then_some(Homography(map))
}

/// The sum of the squares of all equations.
fn normal_matrix(pairs: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>) -> SMatrix<f64, 9, 9> {
    pairs
        .flat_map(|(p, q)| equations(&p, &q))
        .map(|row| row * row.transpose())
        .sum()
}

/// The two linear equations of a pair of points, one for each coordinate.
fn equations(p: &Vector3<f64>, q: &Vector3<f64>) -> [SVector<f64, 9>; 2] {
    [0, 1].map(|axis| {
        let mut row = SVector::<f64, 9>::zeros();
        for k in 0..3 {
            row[3 * axis + k] = p[k];
            row[6 + k] = -q[axis] * p[k];
        }
        row
    })
}

/// The eigenvector of the smallest eigenvalue, where the second smallest is larger than a
/// threshold.
fn null_vector(square: SMatrix<f64, 9, 9>, threshold: f64) -> Option<SVector<f64, 9>> {
    let eigen = square.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let second = (0..9)
        .filter(|&i| i != smallest)
        .map(|i| eigen.eigenvalues[i])
        .fold(f64::MAX, f64::min);
    (second > threshold).then(|| eigen.eigenvectors.column(smallest).into())
}

/// Those of the points on either side of pairs.
fn normalisations(pairs: &[(Point2<f64>, Point2<f64>)]) -> Option<(Matrix3<f64>, Matrix3<f64>)> {
    let (from, to): (Vec<_>, Vec<_>) = pairs.iter().copied().unzip();
    Some((normalisation(&from)?, normalisation(&to)?))
}

/// The map to zero mean and a root mean square distance of sqrt 2.
fn normalisation(points: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    let mean = mean_point(points);
    let squares = points.iter().map(|p| (p.coords - mean).norm_squared());
    let spread = (squares.sum::<f64>() / points.len() as f64).sqrt();
    let scale = std::f64::consts::SQRT_2 / spread;
    let (x, y) = (-scale * mean.x, -scale * mean.y);
    let matrix = Matrix3::new(scale, 0.0, x, 0.0, scale, y, 0.0, 0.0, 1.0);
    scale.is_finite().then_some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_points_give_the_map_and_a_line_gives_none() {
        let truth = Homography(Matrix3::new(
            900.0, 40.0, 600.0, -30.0, -850.0, 400.0, 0.1, 0.2, 1.0,
        ));
        let at = |x: f64, y: f64| (Point2::new(x, y), truth.map(Point2::new(x, y)));
        let found = homography(&[
            at(0.0, 0.0),
            at(0.5, 0.1),
            at(0.4, 0.6),
            at(-0.1, 0.5),
            at(0.2, 0.9),
        ])
        .unwrap();
        let p = Point2::new(-0.3, 0.25);
        assert!((found.map(p) - truth.map(p)).norm() < 1e-8);
        assert_eq!(
            homography(&[at(0.0, 0.0), at(0.1, 0.1), at(0.2, 0.2), at(0.3, 0.3)]),
            None
        );
    }
}
