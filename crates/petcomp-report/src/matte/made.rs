//! Photos of see-through objects made in code, with all that a renderer would know of them: for a repository without any.
//!
//! A bottle is two walls of film around a closed outline, with wrinkles, a bright streak and an opaque label, on a screen that
//! is darker towards its corners. Two flat walls of clear PET pass three quarters of the light (four surfaces, each of which
//! reflects some 7 %), and dye takes its share; the screen is seen through the object and lit through it. In folds and rims the
//! sight meets more plastic, while the light, which comes from all around, does not.

use super::truth::{Known, SensorNoise};
use petcomp::Image;
use petcomp::{Coverage, LinearRgb};

/// How many there are.
pub(super) const COUNT: usize = TINTS.len();
/// Absorbance of the dye of two walls that lie flat: clear, blue, green, brown.
const TINTS: [[f64; 3]; 4] = [
    [0.0; 3],
    [0.4, 0.13, 0.01],
    [0.35, 0.09, 0.27],
    [0.08, 0.18, 0.25],
];
/// Absorbance of two clear walls, by what four surfaces reflect.
const CLEAR: f64 = 0.29;
const SIZE: (usize, usize) = (600, 320);
const SCREEN: LinearRgb = LinearRgb::new(0.06, 0.42, 0.12);
/// Light that film throws back.
const SHEEN: f64 = 0.02;
/// Half length of the body's axis, radius of its ends, width of an edge, pixels.
const AXIS_PX: f64 = 170.0;
const RADIUS_PX: f64 = 75.0;
const EDGE_PX: f64 = 1.0;
/// Noise of a typical camera at base sensitivity.
const NOISE: SensorNoise = SensorNoise {
    shot: 0.006,
    read: 0.002,
};

/// What is at one place.
#[derive(Clone, Copy)]
struct Place {
    cover: f64,
    foreground: [f64; 3],
    view: [f64; 3],
    /// What reaches the screen.
    lit: [f64; 3],
}

/// Photo `i`.
pub(super) fn made(i: usize) -> Known {
    enlarged(i, 1)
}

/// Photo `i` by a camera of so many times the pixels along each side: as sharp, and as noisy in each pixel.
pub(super) fn enlarged(i: usize, times: usize) -> Known {
    let (w, h) = (times * SIZE.0, times * SIZE.1);
    let px = 1.0 / times as f64;
    let places = Image::from_fn(w, h, |x, y| {
        place(i, [x, y].map(|v| (v as f64 + 0.5) * px), px)
    });
    let color = |c: [f64; 3]| LinearRgb::from(c.map(|v| v as f32));
    let foreground = places.map(|p| color(p.foreground));
    let transmittance = places.map(|p| color([0, 1, 2].map(|c| p.view[c] * p.lit[c])));
    let view = places.map(|p| color(p.view));
    let mask = places.map(|p| Coverage(p.cover as f32));
    let screen = Image::from_fn(w, h, |x, y| {
        let [dx, dy] = [x as f64 / w as f64 - 0.4, y as f64 / h as f64 - 0.6];
        SCREEN.scale((1.0 - 0.35 * (dx * dx + dy * dy)) as f32)
    });
    let box_px = bounds(i).map(|side| side / px);
    let empty = Image::filled(w, h, LinearRgb::BLACK);
    let name = format!("made {}", i + 1);
    let known = Known {
        name,
        photo: empty,
        foreground,
        transmittance,
        view,
        screen,
        mask,
        box_px,
        noise: NOISE,
        paint: SCREEN,
    };
    let photo = known.on(&known.screen, FIRST_SEED + i as u64);
    Known { photo, ..known }
}

/// Seeds of the photos' noise, apart from those of the shots that the two-screen method gets.
const FIRST_SEED: u64 = 1000;

/// Slope of each bottle's axis, radians.
fn turn(i: usize) -> f64 {
    0.12 * i as f64 - 0.15
}

/// The ends of the axis.
fn ends(i: usize) -> [[f64; 2]; 2] {
    let (w, h) = SIZE;
    let [dx, dy] = [AXIS_PX * libm::cos(turn(i)), AXIS_PX * libm::sin(turn(i))];
    [-1.0, 1.0].map(|s| [0.5 * w as f64 + s * dx, 0.5 * h as f64 + s * dy])
}

/// Radius of the body at the first and at the last end: the neck is narrower.
const RADII: [f64; 2] = [0.55 * RADIUS_PX, RADIUS_PX];

/// Two discs and all discs between them.
fn bounds(i: usize) -> [f64; 4] {
    let [a, b] = ends(i);
    let low = |k: usize| (a[k] - RADII[0]).min(b[k] - RADII[1]);
    let high = |k: usize| (a[k] + RADII[0]).max(b[k] + RADII[1]);
    [low(0), low(1), high(0), high(1)]
}

/// What is at a place; an edge is as wide as `px`.
fn place(i: usize, [x, y]: [f64; 2], px: f64) -> Place {
    let (along, depth) = body(i, x, y);
    let cover = (depth / (EDGE_PX * px) + 0.5).clamp(0.0, 1.0);
    let inside = cover * cover * (3.0 - 2.0 * cover);
    // Walls seen at a grazing angle near the outline are thicker, and wrinkles fold them.
    let rim = 1.0 + 2.0 * libm::exp(-depth.max(0.0) / 6.0);
    let wrinkle =
        1.0 + 0.5 * libm::sin(0.11 * x + 0.03 * i as f64) * libm::sin(0.07 * y + 0.05 * x);
    let label = if (0.45..0.65).contains(&along) && depth > 12.0 {
        1.0
    } else {
        0.0
    };
    let streak = 0.5
        * libm::exp(-((depth - 30.0) / 5.0).powi(2))
        * (0.5 + 0.5 * libm::sin(0.05 * x)).powi(4);
    let flat = TINTS[i % COUNT].map(|dye| libm::exp(-CLEAR - dye));
    let film = flat.map(|v| libm::pow(v, rim * wrinkle));
    let own = |c: usize| {
        let paint = [0.6, 0.12, 0.1][c] * (0.7 + 0.3 * libm::sin(0.3 * y));
        label * paint + (1.0 - label) * (SHEEN * rim * wrinkle + streak)
    };
    Place {
        cover,
        foreground: [0, 1, 2].map(|c| inside * own(c)),
        view: film.map(|v| 1.0 - inside * (1.0 - (1.0 - label) * v)),
        lit: flat.map(|v| 1.0 - inside * (1.0 - v)),
    }
}

/// How far along the axis a point is, 0 to 1, and how deep inside the outline, pixels; negative outside.
///
/// # Method
/// The hull of two discs, by the distance to a cone of round ends.
fn body(i: usize, x: f64, y: f64) -> (f64, f64) {
    let [a, b] = ends(i);
    let length = 2.0 * AXIS_PX;
    let axis = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    let from = [x - a[0], y - a[1]];
    let (along, across) = (
        from[0] * axis[0] + from[1] * axis[1],
        from[0] * axis[1] - from[1] * axis[0],
    );
    // The side leans out by the difference of the radii: its foot lies further back than the point.
    let sine = (RADII[1] - RADII[0]) / length;
    let cosine = (1.0 - sine * sine).sqrt();
    let foot = ((along + across.abs() * sine / cosine) / length).clamp(0.0, 1.0);
    let radius = RADII[0] + foot * (RADII[1] - RADII[0]);
    (foot, radius - libm::hypot(along - foot * length, across))
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::matte::{SegmentOptions, segment};

    #[test]
    fn the_box_holds_the_mask_tightly() {
        for i in 0..COUNT {
            let known = made(i);
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
        let known = made(1);
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
