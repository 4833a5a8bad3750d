//! AprilTags of the family `tag36h11`, found by the AprilTag library.

use super::Marker;
use crate::camera::label::Artwork;
use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::LinearRgb;
use apriltag::{Detection, Detector, Family};

/// The name of the family in marker maps.
pub(super) const FAMILY: &str = "tag36h11";
/// Noise of a tag's corner, pixels; on rendered boards it is 0.06 along each axis.
pub(super) const CORNER_SIGMA_PX: f64 = 0.1;
/// Wrong bits that are corrected; the least distance between two tags is 11.
const MAX_WRONG_BITS: usize = 1;

/// All tags in a scene-linear photo, with corners as they were printed; empty where the library
/// gives up.
///
/// One thread and no decimation: the same corners every time, and the best.
pub(super) fn find(photo: &Image<LinearRgb>, artwork: Artwork) -> Vec<Marker> {
    let (Some(grey), Some(mut detector)) = (linear_grey(photo), exact_detector()) else {
        return Vec::new();
    };
    detector
        .detect(&grey)
        .iter()
        .filter_map(|tag| marker(tag, artwork))
        .collect()
}

/// With one thread and without decimation.
fn exact_detector() -> Option<Detector> {
    let mut detector = Detector::builder()
        .add_family_bits(Family::tag_36h11(), MAX_WRONG_BITS)
        .build()
        .ok()?;
    detector.set_thread_number(1);
    detector.set_decimation(1.0);
    Some(detector)
}

/// The photo in bytes, as bright as fits, and linear: an edge then is where half of the light is.
/// (Display-encoded, white seems to grow by a quarter of a pixel.)
fn linear_grey(photo: &Image<LinearRgb>) -> Option<apriltag::Image> {
    if photo.is_empty() {
        return None;
    }
    let brightest = brightest_luminance(photo);
    let (width, height) = photo.size();
    let mut grey = apriltag::Image::zeros_with_stride(width, height, width).ok()?;
    for (to, from) in grey.as_slice_mut().iter_mut().zip(photo.pixels()) {
        *to = (255.0 * clamped_luminance(from) / brightest).round() as u8;
    }
    Some(grey)
}

fn brightest_luminance(photo: &Image<LinearRgb>) -> f32 {
    photo
        .pixels()
        .iter()
        .map(clamped_luminance)
        .fold(f32::MIN_POSITIVE, f32::max)
}

#[inline]
fn clamped_luminance(pixel: &LinearRgb) -> f32 {
    pixel.luminance().clamp(0.0, 1.0)
}

/// The library lists corners anticlockwise from the bottom left of the official picture; OpenCV
/// prints it upside down.
fn marker(tag: &Detection, artwork: Artwork) -> Option<Marker> {
    let corners = tag.corners();
    Some(Marker {
        id: u32::try_from(tag.id()).ok()?,
        corners_px: corner_order(artwork).map(|i| Point2::from(corners[i])),
        sigma_px: CORNER_SIGMA_PX,
    })
}

/// The detector's numbers of the corners in our order, from the top left, clockwise.
fn corner_order(artwork: Artwork) -> [usize; 4] {
    match artwork {
        Artwork::Apriltag => [3, 2, 1, 0],
        Artwork::Opencv => [1, 0, 3, 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::{self, Label, MarkerMap, SolveOptions, project_picture, with_markers};
    use crate::diagnostic::Code;
    use crate::filter::Pyramid;
    use crate::geom::Point3;
    use crate::pixel::PremulRgba;

    /// The first tags of the family, and where each of their bits lies, from the highest: row and
    /// column in a square of eight by eight cells (tag36h11.c of the AprilTag library).
    const CODES: [u64; 4] = [0xd_7e00_984b, 0xd_da66_4ca7, 0xd_c4a1_c821, 0xe_17b4_70e9];
    const ROW_AND_COLUMN: [u8; 36] = [
        11, 12, 13, 14, 15, 22, 23, 24, 33, 16, 26, 36, 46, 56, 25, 35, 45, 34, 66, 65, 64, 63, 62,
        55, 54, 53, 44, 61, 51, 41, 31, 21, 52, 42, 32, 43,
    ];
    const BOARD: [f64; 2] = [0.6, 0.4];
    const TAG: f64 = 0.08;
    const CENTERS: [[f64; 2]; 4] = [[-0.23, 0.13], [0.23, 0.13], [0.23, -0.13], [-0.23, -0.13]];
    /// Resolution of the printed board, pixels per metre.
    const PRINT: f64 = 2000.0;

    fn is_white(id: usize, row: usize, column: usize) -> bool {
        let bit = ROW_AND_COLUMN
            .iter()
            .position(|&at| usize::from(at) == 10 * row + column);
        bit.is_some_and(|bit| CODES[id] >> (35 - bit) & 1 == 1)
    }

    /// White paper with tags on it, the first so many, in the official artwork or OpenCV's.
    fn board(tags: usize, artwork: Artwork) -> Image<PremulRgba> {
        let [w, h] = BOARD.map(|s| (s * PRINT).round() as usize);
        Image::from_fn(w, h, |x, y| {
            let (x, y) = (
                (x as f64 + 0.5) / PRINT - BOARD[0] / 2.0,
                BOARD[1] / 2.0 - (y as f64 + 0.5) / PRINT,
            );
            let ink = (0..tags).any(|id| {
                let [u, v] = [
                    (x - CENTERS[id][0]) / TAG + 0.5,
                    0.5 - (y - CENTERS[id][1]) / TAG,
                ];
                let [u, v] = if artwork == Artwork::Opencv {
                    [1.0 - u, 1.0 - v]
                } else {
                    [u, v]
                };
                let inside = (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v);
                inside && !is_white(id, (8.0 * v) as usize, (8.0 * u) as usize)
            });
            let grey = if ink { 0.03 } else { 0.8 };
            PremulRgba {
                r: grey,
                g: grey,
                b: grey,
                a: 1.0,
            }
        })
    }

    /// A photo of the board on a grey table, and its camera.
    fn photo(
        tags: usize,
        artwork: Artwork,
        tilt: f64,
        k: u64,
    ) -> (Image<LinearRgb>, crate::Camera) {
        let scenario = Scenario {
            image: [1280, 960],
            focal_px: 1000.0,
            size: BOARD,
            ..Scenario::default()
        };
        let camera = scenario.tilted(tilt).view(8, k).camera;
        let seen = project_picture(&Pyramid::new(board(tags, artwork)), &camera, 0.0, BOARD);
        let over_table = |p: PremulRgba| 0.25 * (1.0 - p.a);
        (
            seen.map(|p| LinearRgb {
                r: p.r + over_table(p),
                g: p.g + over_table(p),
                b: p.b + over_table(p),
            }),
            camera,
        )
    }

    fn label(artwork: Artwork, camera: &crate::Camera) -> Label {
        let mut label = Label::new(camera.image, [[0.0; 2]; 4], BOARD);
        label.surface.corners_px = None;
        label.camera.focal_px = Some(camera.focal_px.x);
        let map = (0..4)
            .map(|id| (id, [CENTERS[id as usize][0], CENTERS[id as usize][1], 0.0]))
            .collect();
        label.markers = Some(MarkerMap {
            family: FAMILY.into(),
            artwork,
            size_m: TAG,
            map,
        });
        label
    }

    #[test]
    fn tags_are_found_to_a_tenth_of_a_pixel_in_either_artwork() {
        let mut squares = Vec::new();
        for (k, tilt) in [0.0, 15.0, 30.0, 45.0].into_iter().enumerate() {
            for artwork in [Artwork::Apriltag, Artwork::Opencv] {
                let (photo, camera) = photo(4, artwork, tilt, k as u64);
                let mut found = find(&photo, artwork);
                found.sort_by_key(|m| m.id);
                assert_eq!(
                    found.iter().map(|m| m.id).collect::<Vec<_>>(),
                    [0, 1, 2, 3],
                    "{tilt}"
                );
                for (marker, [x, y]) in found.iter().zip(CENTERS) {
                    let half = TAG / 2.0;
                    let printed = [[-half, half], [half, half], [half, -half], [-half, -half]];
                    for ([dx, dy], px) in printed.into_iter().zip(marker.corners_px) {
                        let truth = camera.project(Point3::new(x + dx, y + dy, 0.0)).unwrap().0;
                        squares.push((px - truth).norm_squared());
                        assert!((px - truth).norm() < 0.4, "{tilt}: {px} for {truth}");
                    }
                }
            }
        }
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        println!("corners to {rms:.3} px");
        assert!(rms < 0.1, "{rms}");
    }

    #[test]
    fn a_wrong_artwork_is_seen_and_put_right() {
        for (printed, stated) in [
            (Artwork::Opencv, Artwork::Apriltag),
            (Artwork::Apriltag, Artwork::Apriltag),
        ] {
            let (photo, camera) = photo(4, printed, 25.0, 7);
            let label = with_markers(label(stated, &camera), &photo).unwrap();
            let solution = camera::solve(&label, &SolveOptions::default()).unwrap();
            for corner in [[-0.3, 0.2], [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]] {
                let at = |c: &crate::Camera| {
                    c.project(Point3::new(corner[0], corner[1], 0.0)).unwrap().0
                };
                let error = (at(&solution.camera) - at(&camera)).norm();
                assert!(error < 0.3, "{printed:?}: {error}");
            }
            assert!(
                !solution
                    .warnings
                    .iter()
                    .any(|w| w.code == Code::SmallMarkerSpan)
            );
        }
    }

    #[test]
    fn one_small_marker_for_a_large_surface_is_warned_of() {
        let (photo, camera) = photo(1, Artwork::Apriltag, 10.0, 9);
        let label = with_markers(label(Artwork::Apriltag, &camera), &photo).unwrap();
        let solution = camera::solve(&label, &SolveOptions::default()).unwrap();
        assert!(
            solution
                .warnings
                .iter()
                .any(|w| w.code == Code::SmallMarkerSpan),
            "{:?}",
            solution.warnings
        );
    }
}
