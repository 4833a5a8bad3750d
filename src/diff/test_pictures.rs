//! Two pictures measured with other programs; `golden/diff/reference.py` generates the same ones.

use crate::image::Image;

/// A pattern of waves, edges and points, display values.
pub(super) fn pattern() -> Image<[f32; 3]> {
    Image::from_fn(96, 64, |x, y| {
        let (x, y) = (x as f64, y as f64);
        let wave = 0.5 + 0.3 * libm::sin(x / 5.0) * libm::cos(y / 7.0);
        let edge = if x + 2.0 * y > 120.0 { 0.25 } else { 0.0 };
        [wave, 0.2 + 0.006 * x, (wave + edge) * 0.7].map(|v| v as f32)
    })
}

/// The same, shifted, tinted and with points.
pub(super) fn changed() -> Image<[f32; 3]> {
    let base = pattern();
    Image::from_fn(96, 64, |x, y| {
        let [r, g, b] = base[((x + 1).min(95), y)];
        let point = if x % 16 == 3 && y % 12 == 5 { 0.3 } else { 0.0 };
        [(r * 0.95 + point).min(1.0), g, b * 0.9]
    })
}
