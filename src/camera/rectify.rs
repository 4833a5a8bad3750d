//! The surface as a map: photo to metric top view, and a picture on the surface to the photo.

use super::lens::RadialDistortion;
use super::pinhole::Camera;
use crate::bounds::number;
use crate::error::{Error, Result};
use crate::filter::{Pyramid, sample_bilinear, sample_cubic};
use crate::geom::{Homography, Point2, Vector2, Vector3};
use crate::image::Image;
use crate::pixel::{LinearRgb, Mix};
use nalgebra::{Matrix2, Matrix3};

/// No pixel is the mean of more samples along an axis than this; beyond, they are taken from
/// coarser levels.
const MAX_SAMPLES: f64 = 32.0;
/// Longest axis of a footprint of one sample, pixels of the source.
const MAX_SINGLE_SAMPLE: f64 = 1.5;
/// Larger pictures are treated as typing errors: this many pixels take 800 MB.
const MAX_MAP_PIXELS: f64 = 67_108_864.0;

/// The rectangle of `size` metres seen from straight above, `px_per_metre` pixels to the metre, its
/// top left corner first.
///
/// Takes a scene-linear photo of the camera's size, bent by OpenCV's `k1`; what the photo does not
/// show is black. Interpolated cubically, so that a map as fine as the photo keeps its detail.
///
/// # Errors
/// [`Error::Value`] for a map without pixels or of more than 64 million.
pub fn rectify(
    photo: &Pyramid<LinearRgb>,
    camera: &Camera,
    k1: f64,
    size: [f64; 2],
    px_per_metre: f64,
) -> Result<Image<LinearRgb>> {
    let map = map_size(size, px_per_metre)?;
    let straight_from_map =
        Homography(camera.pixel_from_surface().0 * surface_from_map(size, map).0);
    let lens = RadialDistortion::new(camera, k1);
    let [width, height] = map.map(|side| side as usize);
    let source_from_map = |px| shown(&lens, mapped(&straight_from_map, px)?);
    Ok(warp_by(
        photo,
        sample_light,
        [width, height],
        source_from_map,
    ))
}

/// The cubic value of a photo; black where it would be negative, beside a steep edge.
#[inline]
fn sample_light(photo: &Image<LinearRgb>, x: f64, y: f64) -> LinearRgb {
    sample_cubic(photo, x, y).map(|v| v.max(0.0))
}

/// What a pinhole camera sees, as the lens shows it; none beyond its fold.
fn shown(lens: &RadialDistortion, straight: MappedPoint) -> Option<MappedPoint> {
    if lens.is_none() {
        return Some(straight);
    }
    let px = Point2::from(straight.at);
    lens.shows(px).then(|| MappedPoint {
        at: lens.distort(px).coords,
        slope: lens.distort_slope(px) * straight.slope,
    })
}

/// Width and height of a map, pixels: integers.
fn map_size(size: [f64; 2], px_per_metre: f64) -> Result<[f64; 2]> {
    let [width, height] = size.map(|metres| (metres * px_per_metre).round());
    let (given, [w, h]) = (number(px_per_metre), [width, height].map(number));
    let what = if px_per_metre.is_nan() || px_per_metre <= 0.0 {
        format!("{given}, expected a positive number")
    } else if width.min(height) < 1.0 {
        format!("{given} makes a map of {w} x {h} pixels, expected at least 1 a side")
    } else if width * height > MAX_MAP_PIXELS {
        format!("{given} makes a map of {w} x {h} pixels, expected at most {MAX_MAP_PIXELS}")
    } else {
        return Ok([width, height]);
    };
    Err(Error::value("px_per_metre", what))
}

/// The photo that the camera takes of a picture lying on the rectangle of `size` metres, bent by
/// OpenCV's `k1`; empty outside the rectangle.
pub fn project_picture<P: Mix>(
    picture: &Pyramid<P>,
    camera: &Camera,
    k1: f64,
    size: [f64; 2],
) -> Image<P> {
    let (w, h) = picture.base().size();
    let photo_from_picture =
        camera.pixel_from_surface().0 * surface_from_map(size, [w as f64, h as f64]).0;
    let [width, height] = camera.image.map(|n| n as usize);
    let Some(inverse) = photo_from_picture.try_inverse() else {
        return Image::new(width, height);
    };
    // In front of the camera the last coordinate is one over the depth: positive.
    let middle = Vector3::new(w as f64 / 2.0, h as f64 / 2.0, 1.0);
    let center = inverse * photo_from_picture * middle;
    let lens = RadialDistortion::new(camera, k1);
    let picture_from_straight = Homography(inverse * center.z.signum());
    warp_by(picture, sample_bilinear, [width, height], |px| {
        let MappedPoint { at, slope } = mapped(&picture_from_straight, lens.undistort(px))?;
        let slope = slope * lens.undistort_slope(px);
        Some(MappedPoint { at, slope })
    })
}

/// Surface metres from the pixels of a map of this size.
fn surface_from_map(size: [f64; 2], pixels: [f64; 2]) -> Homography {
    let [x, y] = [size[0] / pixels[0], size[1] / pixels[1]];
    let rows = [
        [x, 0.0, -size[0] / 2.0],
        [0.0, -y, size[1] / 2.0],
        [0.0, 0.0, 1.0],
    ];
    Homography(Matrix3::from_fn(|i, j| rows[i][j]))
}

/// A picture seen through a projective map: the value of each target pixel is the mean over what it
/// covers of the source.
///
/// Empty where the map comes from behind (its last coordinate is not positive) or from outside the
/// source.
///
/// # Method
/// The footprint of a pixel is an ellipse, from the map's derivative ([Heckbert]). It is the mean
/// of a grid of samples along its axes, one or more a pixel of the level of the pyramid that they
/// are taken from: the last that is twice as fine as the short axis, so that its own blur hardly
/// adds to the footprint's.
///
/// [Heckbert]: https://www2.eecs.berkeley.edu/Pubs/TechRpts/1989/5504.html
pub fn warp<P: Mix>(
    source: &Pyramid<P>,
    source_from_target: &Homography,
    width: usize,
    height: usize,
) -> Image<P> {
    warp_by(source, sample_bilinear, [width, height], |px| {
        mapped(source_from_target, px)
    })
}

/// The same through any map, with samples of any kind.
fn warp_by<P: Mix>(
    source: &Pyramid<P>,
    sample: impl Fn(&Image<P>, f64, f64) -> P + Sync,
    [width, height]: [usize; 2],
    source_from_target: impl Fn(Point2<f64>) -> Option<MappedPoint> + Sync,
) -> Image<P> {
    Image::from_fn(width, height, |x, y| {
        let center = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
        source_from_target(center).map_or_else(P::default, |point| {
            footprint_mean(source, &sample, point.at, &point.slope)
        })
    })
}

/// Where a map takes a point, and its derivative there.
struct MappedPoint {
    at: Vector2<f64>,
    slope: Matrix2<f64>,
}

/// None where the map comes from behind.
#[inline]
fn mapped(map: &Homography, point: Point2<f64>) -> Option<MappedPoint> {
    let m = &map.0;
    let q = m * point.to_homogeneous();
    if q.z.is_nan() || q.z <= 0.0 {
        return None;
    }
    let at = q.xy() / q.z;
    let slope = (m.fixed_view::<2, 2>(0, 0) - at * m.fixed_view::<1, 2>(2, 0)) / q.z;
    Some(MappedPoint { at, slope })
}

/// The mean over what a pixel covers: one sample, if that is hardly larger than a pixel of the
/// source. In one piece: most of the time of a warp is spent here.
fn footprint_mean<P: Mix>(
    source: &Pyramid<P>,
    sample: &impl Fn(&Image<P>, f64, f64) -> P,
    at: Vector2<f64>,
    slope: &Matrix2<f64>,
) -> P {
    if slope.norm_squared() < MAX_SINGLE_SAMPLE.powi(2) {
        return sample(source.base(), at.x, at.y);
    }
    let axes = footprint_axes(slope);
    let [long, short] = axes.map(|axis| axis.norm());
    let level = level_below((0.5 * short).max(long / MAX_SAMPLES)).min(source.levels() - 1);
    let (picture, scale) = (source.level(level), f64::from(1_u32 << level));
    let counts = [long, short].map(|length| (length / scale).round().clamp(1.0, MAX_SAMPLES));
    let weight = (1.0 / (counts[0] * counts[1])) as f32;
    let mut sum = P::default();
    for i in 0..counts[0] as u32 {
        for j in 0..counts[1] as u32 {
            let [along, across] = [(i, counts[0]), (j, counts[1])]
                .map(|(k, count)| (f64::from(k) + 0.5) / count - 0.5);
            let place = (at + axes[0] * along + axes[1] * across) / scale;
            sum = sum.add_scaled(weight, sample(picture, place.x, place.y));
        }
    }
    sum
}

/// The last level of a pyramid whose pixels are at most so large, in pixels of the first.
fn level_below(size: f64) -> usize {
    if size < 2.0 {
        0
    } else {
        libm::log2(size).min(MAX_PYRAMID_LEVELS) as usize
    }
}

/// No picture has more levels.
const MAX_PYRAMID_LEVELS: f64 = 31.0;

/// The long and the short axis of a footprint, whole, pixels of the source: the eigenvectors of the
/// slope times its transpose, as long as the roots of the eigenvalues.
fn footprint_axes(slope: &Matrix2<f64>) -> [Vector2<f64>; 2] {
    let square = slope * slope.transpose();
    let mean = square.trace() / 2.0;
    let half = (square[(0, 0)] - square[(1, 1)]) / 2.0;
    let mixed = square[(0, 1)];
    let spread = (half * half + mixed * mixed).sqrt();
    let along = long_direction(half, mixed, spread);
    [
        along * (mean + spread).sqrt(),
        Vector2::new(-along.y, along.x) * (mean - spread).max(0.0).sqrt(),
    ]
}

/// The eigenvector of the larger eigenvalue; two ways to write the same direction, of which the one
/// that does not cancel.
#[inline]
fn long_direction(half: f64, mixed: f64, spread: f64) -> Vector2<f64> {
    let direction = if half >= 0.0 {
        Vector2::new(spread + half, mixed)
    } else {
        Vector2::new(mixed, spread - half)
    };
    direction.try_normalize(0.0).unwrap_or(Vector2::x())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::geom::Point3;
    use crate::pixel::Coverage;

    fn camera() -> Camera {
        let scenario = Scenario {
            image: [400, 300],
            focal_px: 320.0,
            ..Scenario::default()
        };
        scenario.tilted(35.0).view(1, 0).camera
    }

    fn waves(width: usize, height: usize) -> Image<Coverage> {
        let wave = |x: usize, y: usize| {
            0.5 + 0.25 * (libm::sin(x as f64 / 15.0) + libm::cos(y as f64 / 11.0))
        };
        Image::from_fn(width, height, |x, y| Coverage(wave(x, y) as f32))
    }

    fn grey(picture: &Image<Coverage>) -> Pyramid<LinearRgb> {
        Pyramid::new(picture.map(|value| LinearRgb::grey(value.0)))
    }

    const LENSES: [f64; 3] = [-0.2, 0.0, 0.15];

    #[test]
    fn onto_the_surface_and_back_is_the_picture() {
        let (camera, size) = (camera(), [0.6, 0.4]);
        let picture = waves(240, 160);
        for k1 in LENSES {
            let photo = project_picture(&Pyramid::new(picture.clone()), &camera, k1, size);
            let back = rectify(&grey(&photo), &camera, k1, size, 400.0).unwrap();
            assert_eq!(back.size(), picture.size());
            for y in 10..150 {
                for x in 10..230 {
                    let (a, b) = (back[(x, y)].g, picture[(x, y)].0);
                    assert!((a - b).abs() < 0.03, "{k1} {x} {y}: {a} {b}");
                }
            }
        }
    }

    /// A spot 3 pixels large.
    fn spot(at: Point2<f64>, [width, height]: [u32; 2]) -> Image<Coverage> {
        Image::from_fn(width as usize, height as usize, |x, y| {
            let off = Point2::new(x as f64 + 0.5, y as f64 + 0.5) - at;
            Coverage(libm::exp(-off.norm_squared() / 18.0) as f32)
        })
    }

    fn center_of_mass(picture: &Image<LinearRgb>) -> Point2<f64> {
        let (width, mut sum) = (picture.width(), Vector3::zeros());
        for (i, LinearRgb { g: mass, .. }) in picture.pixels().iter().enumerate() {
            let (x, y) = (i % width, i / width);
            sum += Vector3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0) * f64::from(*mass);
        }
        Point2::from(sum.xy() / sum.z)
    }

    #[test]
    fn a_spot_comes_to_lie_where_it_is_on_the_surface() {
        let camera = camera();
        for k1 in LENSES {
            for (x, y) in [(0.25, 0.15), (-0.25, 0.15), (0.2, -0.15), (0.0, 0.0)] {
                let (straight, _) = camera.project(Point3::new(x, y, 0.0)).unwrap();
                // OpenCV's distortion.
                let off = (straight - camera.principal_px) / 320.0;
                let px = camera.principal_px + off * (1.0 + k1 * off.norm_squared()) * 320.0;
                let photo = grey(&spot(px, camera.image));
                let map = rectify(&photo, &camera, k1, [0.6, 0.4], 400.0).unwrap();
                let found = center_of_mass(&map);
                let expected = Point2::new((x + 0.3) * 400.0, (0.2 - y) * 400.0);
                // The spot is not round on the surface: its middle is off by a part of a pixel.
                assert!((found - expected).norm() < 0.5, "{k1}: {found} {expected}");
            }
        }
    }

    /// Stripes of the surface, 5 to 8 pixels of the photo wide.
    fn stripes(at: Point2<f64>) -> f64 {
        0.5 + 0.4 * libm::sin(300.0 * at.x + 200.0 * at.y)
    }

    #[test]
    fn a_map_as_fine_as_the_photo_keeps_its_detail() {
        let (camera, scale) = (camera(), 500.0);
        let [width, height] = camera.image.map(|side| side as usize);
        let surface_from_pixel = camera.pixel_from_surface().inverse().unwrap();
        let mean = |x: usize, y: usize| {
            let part = |k: usize| (k as f64 + 0.5) / 4.0;
            let places = (0..16).map(|k| [x as f64 + part(k % 4), y as f64 + part(k / 4)]);
            let sum: f64 = places
                .map(|px| stripes(surface_from_pixel.map(px.into())))
                .sum();
            Coverage((sum / 16.0) as f32)
        };
        let photo = grey(&Image::from_fn(width, height, mean));
        let map = rectify(&photo, &camera, 0.0, [0.3, 0.2], scale).unwrap();
        let off = |(i, found): (usize, &LinearRgb)| {
            let (x, y) = ((i % 150) as f64 + 0.5, (i / 150) as f64 + 0.5);
            let at = Point2::new(x / scale - 0.15, 0.1 - y / scale);
            (f64::from(found.g) - stripes(at)).powi(2)
        };
        let rms = (map.pixels().iter().enumerate().map(off).sum::<f64>() / 15000.0).sqrt();
        assert!(rms < 0.03, "{rms}");
    }

    #[test]
    fn the_identity_changes_nothing() {
        let picture = waves(31, 17);
        let same = warp(
            &Pyramid::new(picture.clone()),
            &Homography(Matrix3::identity()),
            31,
            17,
        );
        let worst = same
            .pixels()
            .iter()
            .zip(picture.pixels())
            .map(|(a, b)| (a.0 - b.0).abs())
            .fold(0.0, f32::max);
        assert!(worst < 1e-6, "{worst}");
    }

    /// A zone plate, seen through a map that shrinks it by so much: what `warp` makes of it, and
    /// its mean over each pixel.
    fn shrunk_rings(by: [f64; 2]) -> (Image<Coverage>, Image<Coverage>) {
        let rings = |x: f64, y: f64| 0.5 + 0.4 * libm::cos(4e-3 * (x * x + y * y));
        let mean = |x: usize, y: usize, [w, h]: [f64; 2]| {
            let part = |k: usize, at: usize, side: f64| (at as f64 + (k as f64 + 0.5) / 8.0) * side;
            let sum: f64 = (0..64)
                .map(|k| rings(part(k % 8, x, w), part(k / 8, y, h)))
                .sum();
            Coverage((sum / 64.0) as f32)
        };
        let picture = Image::from_fn(240, 240, |x, y| mean(x, y, [1.0; 2]));
        let (w, h) = ((240.0 / by[0]) as usize, (240.0 / by[1]) as usize);
        let shrink = Homography(Matrix3::from_diagonal(&nalgebra::Vector3::new(
            by[0], by[1], 1.0,
        )));
        (
            warp(&Pyramid::new(picture), &shrink, w, h),
            Image::from_fn(w, h, |x, y| mean(x, y, by)),
        )
    }

    #[test]
    fn a_pixel_is_the_mean_over_what_it_covers() {
        // Bilinear samples blur by a pixel of their level: a seventh of the rings, the finest of
        // which are 3 pixels wide.
        for by in [[1.3, 1.3], [2.0, 2.0], [3.0, 2.5], [1.0, 5.0]] {
            let (found, wanted) = shrunk_rings(by);
            let inner = |i: &usize| {
                (4..found.width() - 4).contains(&(i % found.width())) && *i >= 4 * found.width()
            };
            let square = |i: usize| f64::from(found.pixels()[i].0 - wanted.pixels()[i].0).powi(2);
            let inside: Vec<f64> = (0..found.width() * (found.height() - 4))
                .filter(inner)
                .map(square)
                .collect();
            let rms = (inside.iter().sum::<f64>() / inside.len() as f64).sqrt();
            assert!(rms < 0.04, "{by:?}: {rms}");
        }
    }

    #[test]
    fn axes_are_those_of_the_ellipse() {
        for (a, b, turn) in [
            (3.0, 1.0, 0.3),
            (2.0, 2.0, 1.0),
            (5.0, 0.0, -1.2),
            (4.0, 1.5, 1.6),
        ] {
            let rotation = nalgebra::Rotation2::new(turn).into_inner();
            let [long, short] = footprint_axes(&(rotation * Matrix2::new(a, 0.0, 0.0, b)));
            assert!(
                (long.norm() - a).abs() < 1e-9 && (short.norm() - b).abs() < 1e-6,
                "{long} {short}"
            );
            assert!(
                a == b || long.perp(&(rotation * Vector2::x())).abs() < 1e-9,
                "{long}"
            );
        }
    }

    #[test]
    fn a_fine_board_made_small_is_grey() {
        let board = Image::from_fn(256, 256, |x, y| Coverage(((x / 2 + y / 2) % 2) as f32));
        for (x, y) in [(10.0, 10.0), (16.0, 1.0), (1.0, 30.0)] {
            let shrink = Homography(Matrix3::from_diagonal(&nalgebra::Vector3::new(x, y, 1.0)));
            let (w, h) = ((256.0 / x) as usize, (256.0 / y) as usize);
            let small = warp(&Pyramid::new(board.clone()), &shrink, w, h);
            let inner = (2..w - 2).flat_map(|i| (2..h - 2).map(move |j| (i, j)));
            for p in inner {
                // Half in one direction only, a row of the board keeps its two-pixel squares.
                let slack = if x > 2.0 && y > 2.0 { 0.05 } else { 0.2 };
                assert!(
                    (small[p].0 - 0.5).abs() < slack,
                    "{x} {y} {p:?}: {}",
                    small[p].0
                );
            }
        }
    }

    #[test]
    fn a_map_without_pixels_is_an_error() {
        let photo = grey(&waves(40, 30));
        let refusals = [
            (0.0, "0, expected a positive number"),
            (-3.0, "-3, expected a positive number"),
            (f64::NAN, "NaN, expected a positive number"),
            (
                1e-300,
                "1e-300 makes a map of 0 x 0 pixels, expected at least 1 a side",
            ),
            (
                1.0,
                "1 makes a map of 1 x 0 pixels, expected at least 1 a side",
            ),
            (
                1e9,
                "1e9 makes a map of 6e8 x 4e8 pixels, expected at most 67108864",
            ),
        ];
        for (px_per_metre, what) in refusals {
            let refusal = rectify(&photo, &camera(), 0.0, [0.6, 0.4], px_per_metre).unwrap_err();
            assert_eq!(refusal.to_string(), format!("px_per_metre: {what}"));
        }
    }
}
