//! AprilTags of the family `tag36h11`, found by the AprilTag library.

use super::edge::{EdgeSearch, MOST_REACH_PX, RefinedCorners};
use super::{Marker, dictionary, edge};
use crate::camera::label::Artwork;
use crate::color::linear_to_srgb;
use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::LinearRgb;
use apriltag::{Detection, Detector, Family};

/// The name of the family in marker maps.
pub(super) const FAMILY: &str = "tag36h11";
/// Least noise that is stated of a tag's corner, pixels.
pub(super) const CORNER_SIGMA_PX: f64 = 0.1;
/// Noise of a corner as the library finds it, pixels. It is the last resort for tags that are
/// blurred, overexposed or cut off at their margin, and all of that moves it.
const LIBRARY_SIGMA_PX: f64 = 0.5;
/// Cells per side, with the black border.
const CELLS: usize = 8;
/// How far across a side its edge is looked for, as a share of the tag: less than half a cell,
/// since the library's corners are nearly right and out of focus the next cell is not far.
const REACH: f64 = 0.055;
/// Across an edge light rises by more than this share of the tag's white, however dim the photo.
const MIN_RISE: f64 = 0.05;
/// Sides that are farther than this from where the library saw them are other edges, pixels.
const MAX_MOVED_PX: f64 = 1.5;
/// Wrong bits that are corrected; the least distance between two tags is 11.
const MAX_WRONG_BITS: usize = 1;
/// How the library is shown light, until it finds something: linear, where overexposed white grows
/// least over black; then display-encoded, where paper that is dark beside a lamp has steps enough.
const TONES: [fn(f32) -> f32; 2] = [std::convert::identity, linear_to_srgb];

/// All tags in a scene-linear photo, with corners as they were printed; empty where the library
/// gives up.
pub(super) fn find(photo: &Image<LinearRgb>, artwork: Artwork) -> Vec<Marker> {
    let light = photo.map(LinearRgb::luminance);
    let tags = TONES
        .into_iter()
        .map(|tone| detected(&light, tone))
        .find(|tags| !tags.is_empty())
        .unwrap_or_default();
    tags.iter()
        .filter_map(|tag| marker(&light, tag, artwork))
        .collect()
}

/// The library's tags.
///
/// One thread and no decimation: the same corners every time, and the best.
fn detected(light: &Image<f32>, tone: fn(f32) -> f32) -> Vec<Detection> {
    match (grey(light, tone), exact_detector()) {
        (Some(grey), Some(mut detector)) => detector.detect(&grey),
        _ => Vec::new(),
    }
}

fn exact_detector() -> Option<Detector> {
    let mut detector = Detector::builder()
        .add_family_bits(Family::tag_36h11(), MAX_WRONG_BITS)
        .build()
        .ok()?;
    detector.set_thread_number(1);
    detector.set_decimation(1.0);
    Some(detector)
}

/// Light in bytes, as bright as fits.
fn grey(light: &Image<f32>, tone: fn(f32) -> f32) -> Option<apriltag::Image> {
    if light.is_empty() {
        return None;
    }
    let brightest = brightest(light);
    let (width, height) = light.size();
    let mut grey = apriltag::Image::zeros_with_stride(width, height, width).ok()?;
    for (to, from) in grey.as_slice_mut().iter_mut().zip(light.pixels()) {
        *to = (255.0 * tone(from.clamp(0.0, 1.0) / brightest)).round() as u8;
    }
    Some(grey)
}

/// The most light of a pixel, up to 1; more than 0.
fn brightest(light: &Image<f32>) -> f32 {
    let most = light.pixels().iter().copied();
    most.fold(f32::MIN_POSITIVE, f32::max).min(1.0)
}

/// The library lists corners anticlockwise from the bottom left of the official picture; OpenCV
/// prints it upside down.
fn marker(light: &Image<f32>, tag: &Detection, artwork: Artwork) -> Option<Marker> {
    let seen = tag.corners();
    // In our order, from the top left, clockwise.
    let order = match artwork {
        Artwork::Apriltag => [3, 2, 1, 0],
        Artwork::Opencv => [1, 0, 3, 2],
    };
    let rough = order.map(|i: usize| Point2::from(seen[i]));
    let corners = fine_corners(light, &rough).unwrap_or(RefinedCorners {
        px: rough,
        sigma_px: LIBRARY_SIGMA_PX,
    });
    Some(Marker {
        id: u32::try_from(tag.id()).ok()?,
        corners_px: corners.px,
        sigma_px: corners.sigma_px.max(CORNER_SIGMA_PX),
    })
}

/// The corners in the photo's own light; none where a side or the cells are not seen clearly, as
/// where the paper ends at the tag.
fn fine_corners(light: &Image<f32>, rough: &[Point2<f64>; 4]) -> Option<RefinedCorners> {
    let white = dictionary::read_cells::<CELLS>(light, rough)?.bright;
    let search = EdgeSearch {
        light,
        reach: REACH,
        min_rise: MIN_RISE * f64::from(white),
        most_reach_px: MOST_REACH_PX,
    };
    let fine = edge::refined(search, rough).filter(|fine| are_near(&fine.px, rough))?;
    let cells = dictionary::read_cells::<CELLS>(light, &fine.px)?;
    edge::by_cells(&fine, &cells)
}

fn are_near(fine: &[Point2<f64>; 4], rough: &[Point2<f64>; 4]) -> bool {
    (0..4).all(|i| (fine[i] - rough[i]).norm() < MAX_MOVED_PX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::{self, Camera, Label, MarkerMap, SolveOptions};
    use crate::camera::{project_picture, with_markers};
    use crate::capture::is_white_in_tag;
    use crate::diagnostic::Code;
    use crate::filter::{Pyramid, gaussian_blur};
    use crate::geom::Point3;
    use crate::pixel::PremulRgba;

    const BOARD: [f64; 2] = [0.6, 0.4];
    const TAG: f64 = 0.08;
    const CENTERS: [[f64; 2]; 4] = [[-0.23, 0.13], [0.23, 0.13], [0.23, -0.13], [-0.23, -0.13]];
    /// Resolution of the printed board, pixels per metre.
    const PRINT: f64 = 2000.0;

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
                inside && !is_white_in_tag(id as u32, (8.0 * v) as usize, (8.0 * u) as usize)
            });
            LinearRgb::grey(if ink { 0.03 } else { 0.8 }).opaque()
        })
    }

    /// A photo of the board on a grey table, and its camera.
    fn photo(tags: usize, artwork: Artwork, tilt: f64, k: u64) -> (Image<LinearRgb>, Camera) {
        let scenario = Scenario {
            image: [1280, 960],
            focal_px: 1000.0,
            size: BOARD,
            ..Scenario::default()
        };
        let camera = scenario.tilted(tilt).view(8, k).camera;
        let seen = project_picture(&Pyramid::new(board(tags, artwork)), &camera, 0.0, BOARD);
        let over_table = |p: PremulRgba| p.color() + LinearRgb::grey(0.25 * (1.0 - p.a));
        (seen.map(over_table), camera)
    }

    fn label(artwork: Artwork, camera: &Camera) -> Label {
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

    /// Distances of the corners of all four tags from the truth, pixels.
    fn corner_errors(photo: &Image<LinearRgb>, artwork: Artwork, camera: &Camera) -> Vec<f64> {
        let mut found = find(photo, artwork);
        found.sort_by_key(|m| m.id);
        assert_eq!(found.iter().map(|m| m.id).collect::<Vec<_>>(), [0, 1, 2, 3]);
        let half = TAG / 2.0;
        let printed = [[-half, half], [half, half], [half, -half], [-half, -half]];
        let mut errors = Vec::new();
        for (marker, [x, y]) in found.iter().zip(CENTERS) {
            for ([dx, dy], px) in printed.into_iter().zip(marker.corners_px) {
                let truth = camera.project(Point3::new(x + dx, y + dy, 0.0)).unwrap().0;
                errors.push((px - truth).norm());
            }
        }
        errors
    }

    fn rms(errors: &[f64]) -> f64 {
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        (squares / errors.len() as f64).sqrt()
    }

    fn max(errors: &[f64]) -> f64 {
        errors.iter().copied().fold(0.0, f64::max)
    }

    /// A slightly blurred photo of the official tags in other light, as far as the sensor takes it.
    fn photo_in_light(tilt: f64, light: f32) -> (Image<LinearRgb>, Camera) {
        let (photo, camera) = photo(4, Artwork::Apriltag, tilt, 3);
        let lit = gaussian_blur(&photo, 0.6).map(|p| p.map(|v| (light * v).clamp(0.0, 1.0)));
        (lit, camera)
    }

    /// The photo with a lamp in its corner.
    fn with_lamp(mut photo: Image<LinearRgb>) -> Image<LinearRgb> {
        for (x, y) in (0..20).flat_map(|y| (0..20).map(move |x| (x, y))) {
            photo[(x, y)] = LinearRgb::WHITE;
        }
        photo
    }

    #[test]
    fn tags_are_found_to_a_tenth_of_a_pixel_in_either_artwork() {
        let mut errors = Vec::new();
        for (k, tilt) in [0.0, 15.0, 30.0, 45.0].into_iter().enumerate() {
            for artwork in [Artwork::Apriltag, Artwork::Opencv] {
                let (photo, camera) = photo(4, artwork, tilt, k as u64);
                errors.extend(corner_errors(&photo, artwork, &camera));
            }
        }
        println!("corners to {:.3} px", rms(&errors));
        assert!(rms(&errors) < 0.1, "{}", rms(&errors));
        assert!(max(&errors) < 0.4, "{}", max(&errors));
    }

    #[test]
    fn overexposed_paper_does_not_move_the_corners() {
        for tilt in [15.0, 30.0] {
            for full_scales in [1.7, 3.0] {
                let (photo, camera) = photo_in_light(tilt, full_scales / 0.8);
                let error = rms(&corner_errors(&photo, Artwork::Apriltag, &camera));
                assert!(error < 0.15, "{tilt}, {full_scales}: {error}");
            }
        }
    }

    #[test]
    fn a_lamp_in_a_dim_photo_neither_moves_nor_hides_the_tags() {
        for light in [0.045, 0.0125] {
            let (photo, camera) = photo_in_light(15.0, light);
            let photo = with_lamp(photo);
            let error = rms(&corner_errors(&photo, Artwork::Apriltag, &camera));
            assert!(error < 0.05, "{light}: {error}");
        }
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
                let place = Point3::new(corner[0], corner[1], 0.0);
                let at = |c: &Camera| c.project(place).unwrap().0;
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
