//! RGB spaces, CIE XYZ and the matrices between them, derived from primaries and white points.
//!
//! Matrices are named `target_from_source` and derived in `f64`; a [`ColorMatrix`] is one of them
//! rounded to `f32`, to be applied to pixels. Only linear values may be passed.

use nalgebra::{Matrix3, Vector3};

/// A linear RGB space: chromaticities (CIE 1931 x, y) of its primaries and of its white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RgbSpace {
    /// Red, green and blue.
    pub primaries: [[f64; 2]; 3],
    /// The colour of (1, 1, 1).
    pub white: [f64; 2],
}

impl RgbSpace {
    /// Rec. 709 primaries and D65, which sRGB shares (ITU-R BT.709-6, IEC 61966-2-1): the library's
    /// working space.
    pub const REC709: Self = Self {
        primaries: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]],
        white: [0.3127, 0.3290],
    };
    /// Rec. 2020 primaries and D65 (ITU-R BT.2020-2).
    pub const REC2020: Self = Self {
        primaries: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]],
        white: [0.3127, 0.3290],
    };
    /// Display P3: P3 primaries and D65 (SMPTE EG 432-1).
    pub const DISPLAY_P3: Self = Self {
        primaries: [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]],
        white: [0.3127, 0.3290],
    };
    /// Adobe RGB (1998) primaries and D65 (4.3.1).
    pub const ADOBE_RGB: Self = Self {
        primaries: [[0.64, 0.33], [0.21, 0.71], [0.15, 0.06]],
        white: [0.3127, 0.3290],
    };
    /// ACEScg: AP1 primaries and the ACES white, which is near D60 but not it (S-2014-004).
    pub const ACESCG: Self = Self {
        primaries: [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]],
        white: [0.32168, 0.33767],
    };
}

/// XYZ of an RGB space's colours, relative to the space's own white: (1, 1, 1) has Y = 1.
///
/// # Method
/// Columns are the primaries, scaled so that they add up to white (SMPTE RP 177).
pub fn xyz_from_rgb(space: &RgbSpace) -> Matrix3<f64> {
    // Of any length, so that primaries without luminance, as those of XYZ itself, are columns like
    // others.
    let primaries = Matrix3::from_columns(
        &space
            .primaries
            .map(|[x, y]| Vector3::new(x, y, 1.0 - x - y)),
    );
    primaries * Matrix3::from_diagonal(&(inverse(&primaries) * xyz_of(space.white)))
}

/// The inverse of [`xyz_from_rgb`]: from XYZ to an RGB space.
pub(crate) fn rgb_from_xyz(space: &RgbSpace) -> Matrix3<f64> {
    inverse(&xyz_from_rgb(space))
}

/// Colours of one RGB space in another, adapted from white to white by [`bradford`].
pub fn rgb_from_rgb(target: &RgbSpace, source: &RgbSpace) -> Matrix3<f64> {
    if target == source {
        return Matrix3::identity();
    }
    rgb_from_xyz(target) * bradford(target.white, source.white) * xyz_from_rgb(source)
}

/// XYZ under one white (chromaticity x, y) of what had been seen under another.
///
/// # Method
/// Linear Bradford adaptation: von Kries scaling in sharpened cone responses (K. M. Lam 1985;
/// ICC.1:2022, Annex E).
pub fn bradford(target_white: [f64; 2], source_white: [f64; 2]) -> Matrix3<f64> {
    let [target, source] = [target_white, source_white].map(|white| CONES_FROM_XYZ * xyz_of(white));
    inverse(&CONES_FROM_XYZ)
        * Matrix3::from_diagonal(&target.component_div(&source))
        * CONES_FROM_XYZ
}

/// Bradford's cone responses of XYZ (ICC.1:2022, Annex E.3).
const CONES_FROM_XYZ: Matrix3<f64> = Matrix3::new(
    0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296,
);

/// XYZ of a chromaticity at Y = 1.
fn xyz_of([x, y]: [f64; 2]) -> Vector3<f64> {
    Vector3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// # Panics
/// When the primaries lie on one line.
fn inverse(m: &Matrix3<f64>) -> Matrix3<f64> {
    m.try_inverse().expect("primaries span a triangle")
}

/// A 3 x 3 matrix in `f32`, to be applied to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorMatrix {
    /// Rows.
    pub rows: [[f32; 3]; 3],
}

impl From<Matrix3<f64>> for ColorMatrix {
    fn from(m: Matrix3<f64>) -> Self {
        Self {
            rows: std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)] as f32)),
        }
    }
}

impl ColorMatrix {
    /// ACEScg values of the library's working colours.
    pub fn acescg_from_linear() -> Self {
        rgb_from_rgb(&RgbSpace::ACESCG, &RgbSpace::REC709).into()
    }

    /// The matrix times a column.
    #[inline(always)]
    pub fn apply(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        self.rows.map(|[a, b, c]| a * x + b * y + c * z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::LinearRgb;

    const SPACES: [RgbSpace; 5] = [
        RgbSpace::REC709,
        RgbSpace::REC2020,
        RgbSpace::DISPLAY_P3,
        RgbSpace::ADOBE_RGB,
        RgbSpace::ACESCG,
    ];

    #[test]
    fn white_stays_white_between_all_spaces() {
        for target in SPACES {
            for source in SPACES {
                let white = rgb_from_rgb(&target, &source) * Vector3::repeat(1.0);
                assert!((white - Vector3::repeat(1.0)).amax() < 1e-14, "{white}");
            }
        }
    }

    #[test]
    fn adaptation_takes_one_white_to_the_other() {
        let [d65, aces] = [RgbSpace::REC709.white, RgbSpace::ACESCG.white];
        assert!((bradford(aces, d65) * xyz_of(d65) - xyz_of(aces)).amax() < 1e-15);
        assert!((bradford(d65, d65) - Matrix3::identity()).amax() < 1e-15);
    }

    #[test]
    fn a_way_and_its_way_back_cancel() {
        for space in SPACES {
            let there = rgb_from_rgb(&space, &RgbSpace::REC709);
            let back = rgb_from_rgb(&RgbSpace::REC709, &space);
            assert!((there * back - Matrix3::identity()).amax() < 1e-14);
        }
    }

    #[test]
    fn the_middle_row_of_xyz_is_luminance() {
        let [_, y, _] = ColorMatrix::from(xyz_from_rgb(&RgbSpace::REC709)).rows;
        let c = LinearRgb::new(0.3, 0.7, 1.9);
        let exact = y[0] * c.r + y[1] * c.g + y[2] * c.b;
        assert!(
            (c.luminance() - exact).abs() < 1e-4,
            "the four-digit weights of the standard are near the exact ones"
        );
    }
}
