//! Synthetic photos of see-through objects, with everything that a renderer would know about them:
//! for a repository without photos.
//!
//! A bottle is two walls of film around a closed outline, with wrinkles, a bright streak and an
//! opaque label, on a screen that is darker towards its corners. Two flat walls of clear PET
//! transmit three quarters of the light (four surfaces, each of which reflects about 7 %), and dye
//! absorbs its share; the screen is seen through the object and lit through it. In folds and rims
//! the line of sight passes through more plastic, while the light, which comes from all around,
//! does not.

use super::truth::{Known, PhotoNoise};
use petcomp::{Coverage, Image, LinearRgb};

/// Number of photos.
pub(super) const PHOTO_COUNT: usize = TINTS.len();
/// Absorbance of the dye of two flat walls: clear, blue, green, brown.
const TINTS: [[f64; 3]; 4] = [
    [0.0; 3],
    [0.4, 0.13, 0.01],
    [0.35, 0.09, 0.27],
    [0.08, 0.18, 0.25],
];
/// Absorbance of two clear walls, from the reflection of four surfaces.
const CLEAR_ABSORBANCE: f64 = 0.29;
const SIZE_PX: (usize, usize) = (600, 320);
const SCREEN_COLOR: LinearRgb = LinearRgb::new(0.06, 0.42, 0.12);
/// How much darker the screen is, per squared side of the picture from its brightest place.
const SCREEN_FALLOFF: f64 = 0.35;
/// Light reflected by film.
const SHEEN_LIGHT: f64 = 0.02;
/// Paint of the label.
const LABEL_COLOR: [f64; 3] = [0.6, 0.12, 0.1];
/// Half length of the body's axis, radius of its ends, width of an edge, pixels.
const AXIS_PX: f64 = 170.0;
const RADIUS_PX: f64 = 75.0;
const EDGE_PX: f64 = 1.0;
/// Depth to which the wall is seen at a grazing angle.
const RIM_DEPTH_PX: f64 = 6.0;
/// Depth of the streak's maximum, and half its width.
const STREAK_DEPTH_PX: f64 = 30.0;
const STREAK_WIDTH_PX: f64 = 5.0;
/// Distance of the label from the outline.
const LABEL_DEPTH_PX: f64 = 12.0;
/// Noise of a typical camera at base sensitivity.
const CAMERA_NOISE: PhotoNoise = PhotoNoise {
    shot: 0.006,
    read: 0.002,
};
/// Seeds of the photos' noise, different from those of the shots for the two-screen method.
const FIRST_NOISE_SEED: u64 = 1000;

/// Photo `i`.
pub(super) fn photo(i: usize) -> Known {
    enlarged_photo(i, 1)
}

/// Photo `i` from a camera with `times` the pixels along each side, equally sharp and equally noisy
/// per pixel.
pub(super) fn enlarged_photo(i: usize, times: usize) -> Known {
    let known = truth(i, times);
    let photo = known.on(&known.screen, FIRST_NOISE_SEED + i as u64);
    Known { photo, ..known }
}

/// Everything known about photo `i`, which is still black.
fn truth(i: usize, times: usize) -> Known {
    let pixels = bottle_pixels(i, times);
    let (w, h) = pixels.size();
    Known {
        name: format!("made {}", i + 1),
        photo: Image::filled(w, h, LinearRgb::BLACK),
        foreground: pixels.map(|p| color_from(p.foreground)),
        transmittance: pixels.map(|p| color_from(p.transmittance())),
        view: pixels.map(|p| color_from(p.view)),
        screen: uneven_screen(w, h),
        mask: pixels.map(|p| Coverage(p.cover as f32)),
        box_px: bounds(i).map(|side| side / pixel_size(times)),
        noise: CAMERA_NOISE,
        paint: SCREEN_COLOR,
    }
}

/// Size of a pixel in pixels of the smallest photo.
fn pixel_size(times: usize) -> f64 {
    1.0 / times as f64
}

fn bottle_pixels(i: usize, times: usize) -> Image<BottlePixel> {
    let px = pixel_size(times);
    Image::from_fn(times * SIZE_PX.0, times * SIZE_PX.1, |x, y| {
        bottle_at(i, [x, y].map(|v| (v as f64 + 0.5) * px), px)
    })
}

fn color_from(channels: [f64; 3]) -> LinearRgb {
    LinearRgb::from(channels.map(|v| v as f32))
}

fn uneven_screen(w: usize, h: usize) -> Image<LinearRgb> {
    Image::from_fn(w, h, |x, y| {
        let [dx, dy] = [x as f64 / w as f64 - 0.4, y as f64 / h as f64 - 0.6];
        SCREEN_COLOR.scale((1.0 - SCREEN_FALLOFF * (dx * dx + dy * dy)) as f32)
    })
}

/// Slope of each bottle's axis, radians.
fn axis_slope(i: usize) -> f64 {
    0.12 * i as f64 - 0.15
}

/// The ends of the axis.
fn axis_ends(i: usize) -> [[f64; 2]; 2] {
    let (w, h) = SIZE_PX;
    let slope = axis_slope(i);
    let [dx, dy] = [AXIS_PX * libm::cos(slope), AXIS_PX * libm::sin(slope)];
    [-1.0, 1.0].map(|s| [0.5 * w as f64 + s * dx, 0.5 * h as f64 + s * dy])
}

/// Radius of the body at its first and last end: the neck is narrower.
const RADII_PX: [f64; 2] = [0.55 * RADIUS_PX, RADIUS_PX];

/// Bounding box of two discs and all discs between them.
fn bounds(i: usize) -> [f64; 4] {
    let [a, b] = axis_ends(i);
    let [neck, foot] = RADII_PX;
    let [left, top] = [0, 1].map(|k| (a[k] - neck).min(b[k] - foot));
    let [right, bottom] = [0, 1].map(|k| (a[k] + neck).max(b[k] + foot));
    [left, top, right, bottom]
}

/// What a photo shows at one position.
#[derive(Clone, Copy)]
struct BottlePixel {
    cover: f64,
    foreground: [f64; 3],
    view: [f64; 3],
    /// Transmittance of the light that reaches the screen.
    lit: [f64; 3],
}

impl BottlePixel {
    /// Transmittance of the screen's own light, which passes the object twice.
    fn transmittance(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| self.view[c] * self.lit[c])
    }
}

/// Properties of bottle `i` at a position; an edge is as wide as `px`.
fn bottle_at(i: usize, [x, y]: [f64; 2], px: f64) -> BottlePixel {
    let (along, depth) = body_at(i, x, y);
    let cover = (depth / (EDGE_PX * px) + 0.5).clamp(0.0, 1.0);
    let inside = cover * cover * (3.0 - 2.0 * cover);
    let walls = Walls {
        flat: flat_walls(i),
        rim: rim(depth),
        wrinkle: wrinkle(i, x, y),
        label: label_at(along, depth),
    };
    BottlePixel {
        cover,
        foreground: walls.light(x, y, depth).map(|v| inside * v),
        view: walls.passes().map(|v| 1.0 - inside * (1.0 - v)),
        lit: walls.flat.map(|v| 1.0 - inside * (1.0 - v)),
    }
}

/// Two walls of film at a position.
struct Walls {
    /// Transmittance where they are flat.
    flat: [f64; 3],
    rim: f64,
    wrinkle: f64,
    /// 1 under the label.
    label: f64,
}

impl Walls {
    /// Transmittance along the line of sight.
    fn passes(&self) -> [f64; 3] {
        let film = self.flat.map(|v| libm::pow(v, self.rim * self.wrinkle));
        film.map(|v| (1.0 - self.label) * v)
    }

    /// Light reflected by them and by the label.
    fn light(&self, x: f64, y: f64, depth: f64) -> [f64; 3] {
        let sheen = SHEEN_LIGHT * self.rim * self.wrinkle + streak(x, depth);
        label_paint(y).map(|paint| self.label * paint + (1.0 - self.label) * sheen)
    }
}

/// Transmittance of two flat walls.
fn flat_walls(i: usize) -> [f64; 3] {
    TINTS[i % PHOTO_COUNT].map(|dye| libm::exp(-CLEAR_ABSORBANCE - dye))
}

/// The label's light, in stripes.
fn label_paint(y: f64) -> [f64; 3] {
    let stripe = 0.7 + 0.3 * libm::sin(0.3 * y);
    LABEL_COLOR.map(|color| color * stripe)
}

/// Factor on the thickness of the walls near the outline, where they are seen at a grazing angle.
fn rim(depth: f64) -> f64 {
    1.0 + 2.0 * libm::exp(-depth.max(0.0) / RIM_DEPTH_PX)
}

/// Factor on the thickness of the walls where they are folded.
fn wrinkle(i: usize, x: f64, y: f64) -> f64 {
    1.0 + 0.5 * libm::sin(0.11 * x + 0.03 * i as f64) * libm::sin(0.07 * y + 0.05 * x)
}

/// 1 on the label.
fn label_at(along: f64, depth: f64) -> f64 {
    let is_label = (0.45..0.65).contains(&along) && depth > LABEL_DEPTH_PX;
    f64::from(u8::from(is_label))
}

/// Light of the bright streak.
fn streak(x: f64, depth: f64) -> f64 {
    let across = libm::exp(-((depth - STREAK_DEPTH_PX) / STREAK_WIDTH_PX).powi(2));
    0.5 * across * (0.5 + 0.5 * libm::sin(0.05 * x)).powi(4)
}

/// Position of a point along the axis, 0 to 1, and its depth inside the outline, pixels; negative
/// outside.
///
/// # Method
/// The hull of two discs, by the distance to a cone of round ends.
fn body_at(i: usize, x: f64, y: f64) -> (f64, f64) {
    let length = 2.0 * AXIS_PX;
    let [along, across] = along_and_across(axis_ends(i), length, [x, y]);
    // The side leans out by the difference of the radii: its foot lies further back than the point.
    let sine = (RADII_PX[1] - RADII_PX[0]) / length;
    let cosine = (1.0 - sine * sine).sqrt();
    let foot = ((along + across.abs() * sine / cosine) / length).clamp(0.0, 1.0);
    let radius = RADII_PX[0] + foot * (RADII_PX[1] - RADII_PX[0]);
    (foot, radius - libm::hypot(along - foot * length, across))
}

/// A point in the frame of the axis, pixels.
fn along_and_across([a, b]: [[f64; 2]; 2], length: f64, point: [f64; 2]) -> [f64; 2] {
    let axis = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    let from = [point[0] - a[0], point[1] - a[1]];
    [
        from[0] * axis[0] + from[1] * axis[1],
        from[0] * axis[1] - from[1] * axis[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::matte::{SegmentOptions, segment};

    #[test]
    fn the_box_holds_the_mask_tightly() {
        for i in 0..PHOTO_COUNT {
            let known = photo(i);
            let (w, h) = known.mask.size();
            let inside = |x: usize, y: usize| known.mask[(x, y)].0 >= 0.5;
            let columns = (0..w).filter(|&x| (0..h).any(|y| inside(x, y)));
            let rows: Vec<usize> = (0..h).filter(|&y| (0..w).any(|x| inside(x, y))).collect();
            let columns: Vec<usize> = columns.collect();
            let found = [
                columns[0],
                rows[0],
                columns[columns.len() - 1] + 1,
                rows[rows.len() - 1] + 1,
            ];
            let off = found
                .iter()
                .zip(known.box_px)
                .map(|(a, b)| (*a as f64 - b).abs())
                .fold(0.0, f64::max);
            assert!(off <= 1.0, "{found:?} {:?}", known.box_px);
        }
    }

    #[test]
    fn a_photo_is_its_foreground_over_its_screen_and_the_object_is_found() {
        let known = photo(1);
        let off = |x: usize, y: usize| {
            let truth =
                known.foreground[(x, y)] + known.transmittance[(x, y)] * known.screen[(x, y)];
            (known.photo[(x, y)].g - truth.g.min(1.0)).abs()
        };
        assert!(
            (0..300).all(|k| off(2 * k, k) < 0.05),
            "noise and 8 bits only"
        );
        let found = segment(&known.photo, &SegmentOptions::default()).unwrap();
        assert!(super::super::score::overlap(&found.tight, &known.mask) > 0.95);
    }
}
