//! Printed markers on a tray, in pictures from steep sides.

#![cfg(feature = "pipeline")]

use petcomp::camera::simulate::Scenario;
use petcomp::camera::{self, project_picture};
use petcomp::filter::Pyramid;
use petcomp::geom::{Point2, Point3};
use petcomp::{Camera, Image, LinearRgb, PremulRgba};
use std::sync::LazyLock;

/// The first markers of `DICT_4X4_50`, row by row from the top left, 1 is white.
const CODES: [u16; 4] = [0xb532, 0x0f9a, 0x332d, 0x9946];
/// A board of two sides in metres with markers of 40 mm in its corners, each on white paper of one
/// cell more.
const BOARD: [f64; 2] = [0.56, 0.37];
const SIDE: f64 = 0.04;
const CENTERS: [[f64; 2]; 4] = [
    [-0.244, 0.149],
    [0.244, 0.149],
    [0.244, -0.149],
    [-0.244, -0.149],
];
/// Resolution of the board's picture, pixels per metre: every edge of it lies between two of its
/// pixels.
const PRINT: f64 = 3000.0;

/// Light of the board at a place: paper, ink, or the grey tray.
fn board_light(x: f64, y: f64) -> f32 {
    for (code, [cx, cy]) in CODES.into_iter().zip(CENTERS) {
        let cell = |v: f64| (v / SIDE * 6.0 + 3.0).floor() as i64;
        let (column, row) = (cell(x - cx), cell(cy - y));
        if (-1..=6).contains(&column) && (-1..=6).contains(&row) {
            let paper = column == -1 || column == 6 || row == -1 || row == 6;
            let inner = (1..5).contains(&column) && (1..5).contains(&row);
            let white = paper || (inner && code >> (15 - (4 * (row - 1) + column - 1)) & 1 == 1);
            return if white { 0.8 } else { 0.04 };
        }
    }
    0.2
}

/// The board as printed.
static PRINTED: LazyLock<Pyramid<PremulRgba>> = LazyLock::new(|| {
    let [w, h] = BOARD.map(|side| (side * PRINT).round() as usize);
    Pyramid::new(Image::from_fn(w, h, |x, y| {
        let light = board_light(
            (x as f64 + 0.5) / PRINT - BOARD[0] / 2.0,
            BOARD[1] / 2.0 - (y as f64 + 0.5) / PRINT,
        );
        PremulRgba {
            r: light,
            g: light,
            b: light,
            a: 1.0,
        }
    }))
});

/// A photo of the board on a dark table.
fn photo(camera: &Camera) -> Image<LinearRgb> {
    let seen = project_picture(&PRINTED, camera, 0.0, BOARD);
    seen.map(|p| LinearRgb {
        r: p.r + 0.1 * (1.0 - p.a),
        g: p.g + 0.1 * (1.0 - p.a),
        b: p.b + 0.1 * (1.0 - p.a),
    })
}

/// A mean over five by five pixels, the nearer ones counting more: a lens that is a little out of
/// focus.
fn blurred(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    const WEIGHTS: [f32; 5] = [0.07, 0.24, 0.38, 0.24, 0.07];
    let (w, h) = photo.size();
    let pass = |from: &Image<LinearRgb>, [dx, dy]: [isize; 2]| {
        Image::from_fn(w, h, |x, y| {
            let at = |i: isize| from.nearest(x as isize + i * dx, y as isize + i * dy).r;
            let light = (-2..=2)
                .zip(WEIGHTS)
                .map(|(i, weight)| weight * at(i))
                .sum();
            LinearRgb {
                r: light,
                g: light,
                b: light,
            }
        })
    };
    pass(&pass(photo, [1, 0]), [0, 1])
}

/// The numbers of the markers found, and the distances of their corners from the truth, pixels,
/// each with what its standard deviation makes expect.
fn found(photo: &Image<LinearRgb>, camera: &Camera) -> (Vec<u32>, Vec<[f64; 2]>) {
    let markers = camera::find_markers(photo);
    let mut errors = Vec::new();
    for marker in markers.iter().filter(|m| m.id < 4) {
        let [x, y] = CENTERS[marker.id as usize];
        let half = SIDE / 2.0;
        let printed = [[-half, half], [half, half], [half, -half], [-half, -half]];
        for ([dx, dy], px) in printed.into_iter().zip(marker.corners_px) {
            let truth: Point2<f64> = camera
                .project(Point3::new(x + dx, y + dy, 0.0))
                .expect("in front")
                .0;
            errors.push([
                (px - truth).norm(),
                marker.sigma_px * std::f64::consts::FRAC_PI_2.sqrt(),
            ]);
        }
    }
    (markers.iter().map(|m| m.id).collect(), errors)
}

#[test]
fn markers_are_found_in_steep_views_and_say_how_well() {
    let mut ratios = Vec::new();
    for image in [[1280, 960], [960, 720]] {
        for tilt in [45.0, 59.0, 65.0] {
            for k in 0..2 {
                let focal_px = 1.07 * f64::from(image[0]);
                let scenario = Scenario {
                    image,
                    focal_px,
                    size: BOARD,
                    fill: 0.8,
                    ..Scenario::default()
                };
                let camera = scenario.tilted(tilt).view(6, k).camera;
                let sharp = photo(&camera);
                for (name, picture) in [("sharp", &sharp), ("soft", &blurred(&sharp))] {
                    let (ids, errors) = found(picture, &camera);
                    let worst = errors.iter().map(|[error, _]| *error).fold(0.0, f64::max);
                    let expected = errors
                        .iter()
                        .map(|[_, expected]| *expected)
                        .fold(0.0, f64::max);
                    println!(
                        "{image:?} {tilt} degrees, view {k}, {name}: {ids:?} to {worst:.2} px of {expected:.2}"
                    );
                    ratios.extend(errors.iter().map(|[error, expected]| error / expected));
                    let least = if name == "sharp" && tilt < 60.0 { 4 } else { 2 };
                    assert!(
                        ids.len() >= least,
                        "{image:?} {tilt} degrees, view {k}, {name}: {ids:?}"
                    );
                }
            }
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("errors are {mean:.2} times as large as stated");
    assert!((0.5..1.5).contains(&mean), "{mean}");
}
