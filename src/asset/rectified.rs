//! A photo seen from straight above, by what lies in the plane of its screen: the screen's own four
//! corners, or a printed marker.

use super::inpaint::{SeenSquare, inpaint};
use super::screen_pose::{ReferenceRectangle, ScreenPose, scale_unknown};
use super::top_view::{TopView, size_px};
use crate::camera::{Marker, any_markers};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter::sample_nearest;
use crate::geom::Point2;
use crate::image::Image;
use crate::io::Header;
use crate::matte::{ScreenCorners, from_top_left, screen_corners};
use crate::pixel::{LinearRgb, Mix};
use crate::quantile::median;
use std::sync::Arc;

/// Noise of a corner that a person clicked, pixels.
const CLICK_SIGMA_PX: f64 = 1.0;
/// A marker has a white margin, at most as wide as this share of its black square.
const MARKER_MARGIN: f64 = 0.35;
/// Beyond the margin, pixels: a printer's and the corners' own error.
const MARKER_EDGE_PX: f64 = 2.0;
/// What is painted over a marker is seen around it: where more than this share of that is not the
/// screen, something else is smeared over the screen.
const MAX_OTHER_SHARE: f64 = 0.01;
/// Not the screen is what differs from it by this share of its brightest channel: more than its
/// light is uneven around a marker, less than clear plastic dims it.
const MIN_OTHER_DIFFERENCE: f32 = 0.3;
/// Sides that may be exchanged need a review where that makes lengths differ by this share.
const REVIEWED_SWAP_ERROR: f64 = 0.01;

/// A photo as it is seen from straight above, where something in it shows the screen's plane; else
/// as it is.
///
/// A camera that is tilted sees an object shorter than it is along one direction, and larger in
/// front than behind: no one scale is right for it.
pub(super) struct RectifiedPhoto {
    pub(super) photo: Image<LinearRgb>,
    view: Option<TopView>,
}

/// Pixels per metre, and the standard error of a length as a share.
pub(super) struct ScreenScale {
    pub(super) px_per_metre: f64,
    pub(super) sigma: f64,
}

impl RectifiedPhoto {
    /// A photo in which nothing shows the screen's plane.
    pub(super) fn unchanged(photo: Image<LinearRgb>) -> Self {
        Self { photo, view: None }
    }

    /// The inside of a screen of `size` metres, by its four corners, which are found where they are
    /// not given; things are as large as at `height` metres above it.
    pub(super) fn by_corners(
        photo: Image<LinearRgb>,
        size: [f64; 2],
        corners_px: Option<[[f64; 2]; 4]>,
        height: f64,
        header: &Header,
    ) -> Result<Self> {
        let corners = match corners_px {
            Some(clicked) => clicked_corners(clicked),
            None => screen_corners(&photo)?,
        };
        let reference = ReferenceRectangle {
            size,
            corners_px: corners.corners_px,
            sigma_px: corners.sigma_px,
        };
        let pose = ScreenPose::solve(&reference, size_px(&photo), header)?;
        Self::through(TopView::of_screen(pose, height), photo)
    }

    /// The photo without its markers, whose black squares have this `side`, metres; the largest
    /// shows the plane.
    pub(super) fn by_marker(
        photo: Image<LinearRgb>,
        side: f64,
        height: f64,
        header: &Header,
    ) -> Result<Self> {
        let markers = any_markers(&photo);
        let Some(largest) = largest_marker(&markers) else {
            return Err(scale_unknown(
                "no marker (AprilTag tag36h11, ArUco DICT_4X4_50) was found on it",
            ));
        };
        let reference = ReferenceRectangle {
            size: [side; 2],
            corners_px: from_top_left(largest.corners_px),
            sigma_px: largest.sigma_px,
        };
        let pose = ScreenPose::solve(&reference, size_px(&photo), header)?;
        let view = TopView::of_photo(pose, height)?;
        let papers: Vec<_> = markers.iter().filter_map(paper_of).collect();
        Self::through(view, without_markers(photo, &papers)?)
    }

    fn through(view: TopView, photo: Image<LinearRgb>) -> Result<Self> {
        Ok(Self {
            photo: view.rectify(photo)?,
            view: Some(view),
        })
    }

    /// The empty screen from the same place in the same way.
    pub(super) fn same_view(&self, empty: Arc<Image<LinearRgb>>) -> Result<Arc<Image<LinearRgb>>> {
        let Some(view) = &self.view else {
            return Ok(empty);
        };
        check_shape(size_px(&empty), view.pose.camera.image)?;
        view.rectify(Arc::unwrap_or_clone(empty)).map(Arc::new)
    }

    /// The scale at a pixel, where something in the photo shows it.
    pub(super) fn scale(&self, at: Point2<f64>) -> Option<ScreenScale> {
        self.view.as_ref().map(|view| ScreenScale {
            px_per_metre: view.px_per_metre,
            sigma: view.sigma(at),
        })
    }

    /// The warning about a size that is measured by this.
    pub(super) fn diagnostic(&self) -> Option<Diagnostic> {
        let pose = &self.view.as_ref()?.pose;
        if pose.is_poor_fit {
            Some(poor_fit_warning(pose.size))
        } else {
            (pose.swap_error > REVIEWED_SWAP_ERROR).then(|| swap_warning(pose.swap_error))
        }
    }
}

/// Rejects an empty screen that is no resized photo of this size: stretched onto it, or cropped, it
/// is another part of the screen.
fn check_shape([w, h]: [u32; 2], [width, height]: [u32; 2]) -> Result<()> {
    let across = u64::from(w) * u64::from(height);
    let down = u64::from(h) * u64::from(width);
    // Less than a pixel is rounded.
    if across.abs_diff(down) < u64::from(width.max(height)) {
        return Ok(());
    }
    let what = format!(
        "the empty screen is {w} x {h} pixels, expected {width} x {height} like the photo, or another size of that \
         shape"
    );
    Err(Error::Photo { what })
}

fn clicked_corners(corners_px: [[f64; 2]; 4]) -> ScreenCorners {
    ScreenCorners {
        corners_px: corners_px.map(Point2::from),
        sigma_px: CLICK_SIGMA_PX,
    }
}

fn poor_fit_warning([w, h]: [f64; 2]) -> Diagnostic {
    let message = format!("the screen fits {w:.3} x {h:.3} m poorly; are width and height right?");
    Diagnostic::warning(Code::ScreenSizeMismatch, message)
}

fn swap_warning(error: f64) -> Diagnostic {
    let percent = 100.0 * error;
    let message = format!(
        "the longer side of the screen cannot be identified: lengths may be off by {percent:.0} %"
    );
    Diagnostic::warning(Code::ScreenSidesAmbiguous, message)
}

fn largest_marker(markers: &[Marker]) -> Option<&Marker> {
    markers
        .iter()
        .max_by(|a, b| doubled_area(&a.corners_px).total_cmp(&doubled_area(&b.corners_px)))
}

/// By the diagonals of a quadrilateral.
fn doubled_area(corners: &[Point2<f64>; 4]) -> f64 {
    (corners[2] - corners[0])
        .perp(&(corners[3] - corners[1]))
        .abs()
}

fn without_markers(mut photo: Image<LinearRgb>, papers: &[SeenSquare]) -> Result<Image<LinearRgb>> {
    let surrounds = papers
        .iter()
        .map(|paper| Surround::new(paper, &photo, papers));
    let surrounds: Vec<_> = surrounds.collect();
    if !surrounds.iter().all(Surround::is_free) {
        let what = "a marker is too close to the object or the edge of the screen; leave at least half its side free \
                    around it";
        return Err(Error::Photo { what: what.into() });
    }
    for (paper, surround) in papers.iter().zip(&surrounds) {
        inpaint(&mut photo, paper, |seen| surround.screen_for(seen));
    }
    Ok(photo)
}

/// A marker and its white margin.
fn paper_of(marker: &Marker) -> Option<SeenSquare> {
    let side_px = (doubled_area(&marker.corners_px) / 2.0).sqrt();
    let margin = MARKER_MARGIN + MARKER_EDGE_PX / side_px;
    SeenSquare::new(&marker.corners_px, margin)
}

/// What a photo shows around a marker's paper, but for that of others.
struct Surround {
    colors: Vec<LinearRgb>,
    /// Their median.
    screen: LinearRgb,
}

impl Surround {
    fn new(paper: &SeenSquare, photo: &Image<LinearRgb>, papers: &[SeenSquare]) -> Self {
        let is_free = |at: &Point2<f64>| {
            let mut others = papers.iter().filter(|other| !std::ptr::eq(*other, paper));
            !others.any(|other| other.contains(*at))
        };
        let free = paper.border().filter(is_free);
        let colors: Vec<_> = free
            .filter_map(|at| sample_nearest(photo, at.x, at.y))
            .collect();
        let middle = |channel: fn(&LinearRgb) -> f32| {
            median(colors.iter().map(channel), f32::total_cmp).unwrap_or_default()
        };
        let screen = LinearRgb::new(middle(|c| c.r), middle(|c| c.g), middle(|c| c.b));
        Self { colors, screen }
    }

    /// Nothing else than the screen is there, but for specks.
    fn is_free(&self) -> bool {
        let other = self.colors.iter().filter(|color| self.is_other(**color));
        other.count() as f64 <= MAX_OTHER_SHARE * self.colors.len() as f64
    }

    /// What is painted where a colour is seen: no speck becomes a stripe.
    fn screen_for(&self, seen: LinearRgb) -> LinearRgb {
        if self.is_other(seen) {
            return self.screen;
        }
        seen
    }

    fn is_other(&self, color: LinearRgb) -> bool {
        let off = color.add_scaled(-1.0, self.screen).map(f32::abs);
        off.max_channel() > MIN_OTHER_DIFFERENCE * self.screen.max_channel()
    }
}

#[cfg(test)]
mod tests {
    use super::super::screen_pose::{HEIGHT_SIGMA, TAPE_SIGMA};
    use super::super::{PhotoEntry, Scale, add_photo};
    use super::*;
    use crate::camera::{Camera, printed, project_picture};
    use crate::filter::{Pyramid, resize};
    use crate::geom::{Point3, Pose, UnitQuaternion, Vector2, Vector3};
    use crate::image::Roi;
    use crate::io;
    use crate::matte::CutOutOptions;
    use crate::pixel::Coverage;

    /// A camera 1 m from a screen, tilted.
    fn camera(tilt: f64, focal_px: f64) -> Camera {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt);
        Camera {
            image: [1000, 750],
            focal_px: [focal_px; 2].into(),
            principal_px: [500.0, 375.0].into(),
            camera_from_world: Pose::from_parts(Vector3::new(0.0, 0.0, 1.0).into(), down),
        }
    }

    fn seen(camera: &Camera, [x, y]: [f64; 2], z: f64) -> Point2<f64> {
        camera.project([x, y, z].into()).unwrap().0
    }

    /// The middles and half sides of some rectangles, metres.
    fn rectangle([x, y]: [f64; 2], [w, h]: [f64; 2]) -> [[f64; 2]; 4] {
        [[-w, h], [w, h], [w, -h], [-w, -h]].map(|[dx, dy]| [x + dx / 2.0, y + dy / 2.0])
    }

    fn reference(camera: &Camera, size: [f64; 2], sigma_px: f64) -> ReferenceRectangle {
        ReferenceRectangle {
            size,
            corners_px: rectangle([0.0; 2], size).map(|at| seen(camera, at, 0.0)),
            sigma_px,
        }
    }

    /// Normal numbers of deviation 1, by their place.
    fn normal(k: u64) -> f64 {
        let unit = |i: u64| {
            let seed = (12 * k + i).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            ((seed ^ (seed >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64
                / (1_u64 << 53) as f64
        };
        (0..12).map(unit).sum::<f64>() - 6.0
    }

    #[test]
    fn the_scale_is_that_at_half_the_object_s_height_with_an_honest_error() {
        let (mut squares, mut count) = (0.0, 0);
        for (k, tilt) in (0..24).zip([0.0, 0.2, 0.5].into_iter().cycle()) {
            for (side, sigma_px, far) in [(0.5, 1.0, 0.1), (0.08, 0.15, 0.2)] {
                let drawn = |i: u64| normal(16 * k + i);
                // What nobody knows: the lens, the tape's error and the height at which the outline
                // lies.
                let camera = camera(tilt, 1000.0 * libm::exp(0.35 * drawn(8)));
                let mut noisy = reference(&camera, [side; 2], sigma_px);
                noisy.size = [side * (1.0 + TAPE_SIGMA * drawn(9)); 2];
                for (i, corner) in (0..).zip(&mut noisy.corners_px) {
                    *corner += sigma_px * Vector2::new(drawn(2 * i), drawn(2 * i + 1));
                }
                let ground = ScreenPose::solve(&noisy, camera.image, &Header::default()).unwrap();
                let height = 0.035 * (1.0 + 2.0 * HEIGHT_SIGMA * drawn(10));
                let [a, b] = [[far, -0.03], [far, 0.07]].map(|at| {
                    let ray = ground.camera.ray(seen(&camera, at, height));
                    ray.at((0.035 - ray.origin.z) / ray.direction.z)
                });
                let (off, reported) = ((b - a).norm() / 0.1 - 1.0, ground.sigma(a + (b - a) / 2.0));
                (squares, count) = (squares + (off / reported) * (off / reported), count + 1);
            }
        }
        let chi = (squares / f64::from(count)).sqrt();
        assert!((0.6..1.4).contains(&chi), "{chi}");
    }

    #[test]
    fn the_error_grows_with_the_distance_from_a_marker() {
        let camera = camera(0.0, 1000.0);
        let ground = ScreenPose::solve(
            &reference(&camera, [0.08; 2], 0.3),
            camera.image,
            &Header::default(),
        )
        .unwrap();
        let error = |x: f64| ground.sigma([x, 0.0, 0.005].into());
        assert!(
            error(0.3) > 2.0 * error(0.02) && error(0.3) < 0.1,
            "{} {}",
            error(0.02),
            error(0.3)
        );
    }

    #[test]
    fn a_screen_of_other_proportions_is_doubted() {
        let camera = camera(0.3, 1000.0);
        let doubt = |size| {
            let reported = ReferenceRectangle {
                size,
                ..reference(&camera, SCREEN, 0.2)
            };
            let ground = ScreenPose::solve(&reported, camera.image, &Header::default()).unwrap();
            RectifiedPhoto {
                photo: Image::new(0, 0),
                view: Some(TopView::of_screen(ground, 0.0)),
            }
            .diagnostic()
        };
        assert_eq!(doubt(SCREEN), None);
        assert!(
            doubt([0.5, 0.5])
                .unwrap()
                .message
                .ends_with("0.500 x 0.500 m poorly; are width and height right?")
        );
    }

    #[test]
    fn a_turned_screen_is_measured_by_its_other_side() {
        let camera = camera(0.2, 1000.0);
        let turned = |size| ReferenceRectangle {
            size,
            ..reference(&camera, [0.3, 0.4], 0.3)
        };
        let ground =
            |size| ScreenPose::solve(&turned(size), camera.image, &Header::default()).unwrap();
        for size in [[0.3, 0.4], [0.4, 0.3]] {
            let found = ground(size);
            assert!(
                (found.size[0] - 0.3).abs() < 0.003 && found.swap_error == 0.0,
                "{:?}",
                found.size
            );
        }
        // Sides of nearly the same length: the photo does not tell which is which, and that is part
        // of the error.
        let view = TopView::of_screen(ground([0.303, 0.4]), 0.0);
        assert!(view.pose.swap_error == 0.0);
        let nearly = ReferenceRectangle {
            size: [0.41, 0.4],
            ..reference(&camera, [0.41, 0.4], 2.0)
        };
        let ground = ScreenPose::solve(&nearly, camera.image, &Header::default()).unwrap();
        assert!(
            ground.swap_error > REVIEWED_SWAP_ERROR
                && ground.sigma(Point3::origin()) > ground.swap_error,
            "{}",
            ground.swap_error
        );
        let seen = RectifiedPhoto {
            photo: Image::new(0, 0),
            view: Some(TopView::of_screen(ground, 0.0)),
        };
        assert!(
            seen.diagnostic()
                .unwrap()
                .message
                .starts_with("the longer side of the screen cannot be identified")
        );
    }

    /// Metres of the screen in the photos below, and of the red slab on it.
    const SCREEN: [f64; 2] = [0.6, 0.4];
    const SLAB: [f64; 2] = [0.18, 0.08];
    /// Side of the marker's black square: six of the eight cells of what is printed.
    const MARKER: f64 = 0.072;

    /// A green screen with a slab across it and, where it is asked for, a marker on it, on a brown
    /// table.
    fn photo(camera: &Camera, with_marker: bool) -> Image<LinearRgb> {
        let marker = printed(7, 12);
        let screen = Image::from_fn(600, 400, |x, y| {
            let slab = (300..380).contains(&x) && (110..290).contains(&y);
            match (
                slab,
                with_marker && (150..246).contains(&x) && (130..226).contains(&y),
            ) {
                (true, _) => LinearRgb::new(0.6, 0.05, 0.05),
                (_, true) => marker[(x - 150, y - 130)],
                _ => LinearRgb::new(0.05, 0.4, 0.1).scale(0.8 + 0.2 * x as f32 / 600.0),
            }
        });
        let seen = project_picture(&Pyramid::new(screen), camera, 0.0, SCREEN);
        let alpha = project_picture(
            &Pyramid::new(Image::filled(600, 400, Coverage(1.0))),
            camera,
            0.0,
            SCREEN,
        );
        seen.zip_map(&alpha, |p, a| {
            p + LinearRgb::new(0.2, 0.12, 0.06).scale(1.0 - a.0)
        })
    }

    fn added(photo: &Image<LinearRgb>, scale: Scale) -> Result<[f64; 3]> {
        let folder = tempfile::tempdir().unwrap();
        io::write(folder.path().join("a.png"), photo).unwrap();
        let entry = PhotoEntry {
            thickness: Some(1e-4),
            ..PhotoEntry::new(folder.path().join("a.png"), "a", "slab", scale)
        };
        let record = add_photo(
            folder.path().join("assets"),
            &entry,
            &[],
            &CutOutOptions::default(),
        )?;
        Ok([record.object_m[0], record.object_m[1], record.error_m])
    }

    fn assert_slab(added: Result<[f64; 3]>) {
        let [length, width, error] = added.unwrap();
        assert!(
            (length / SLAB[0] - 1.0).abs() < 0.02 && error < 0.004,
            "{length} +- {error}"
        );
        assert!(
            (length - SLAB[0]).abs() < 3.0 * error,
            "{length} +- {error}"
        );
        assert!((width - SLAB[1]).abs() < 3.0 * error, "{width} +- {error}");
    }

    #[test]
    fn a_screen_tells_the_size_of_what_lies_on_it() {
        // From 20 degrees beside the vertical the slab is seen 6 % shorter than it is.
        let camera = camera(0.35, 1100.0);
        let photo = photo(&camera, false);
        let corners = rectangle([0.0; 2], SCREEN).map(|at| seen(&camera, at, 0.0).into());
        assert_slab(added(&photo, Scale::Screen(SCREEN, None)));
        assert_slab(added(
            &photo,
            Scale::Screen([SCREEN[1], SCREEN[0]], Some(corners)),
        ));
        let part = Roi {
            x: 250,
            y: 0,
            width: 750,
            height: 750,
        };
        let reported = added(&photo.crop(part), Scale::Screen(SCREEN, None))
            .unwrap_err()
            .to_string();
        assert!(
            reported.contains(
                "a.png: the corners of the screen cannot be found: it reaches the border"
            ),
            "{reported}"
        );
        let reported = added(&photo, Scale::Screen([0.6, 0.2], None))
            .unwrap_err()
            .to_string();
        assert!(
            reported.contains("its corners do not fit 0.6 x 0.2 m; are width and height right?"),
            "{reported}"
        );
    }

    #[test]
    fn a_printed_marker_tells_the_size_of_what_lies_beside_it() {
        let photo = photo(&camera(0.35, 2400.0), true);
        assert_slab(added(&photo, Scale::Marker(MARKER)));
    }

    /// A slab on a screen from above, a millimetre a pixel, and a marker turned beside its upper left
    /// corner, which is at (200, 200).
    fn slab_beside_marker(middle: [f64; 2], turn: f64) -> Image<LinearRgb> {
        let marker = printed(7, 12);
        let (sin, cos) = (libm::sin(turn), libm::cos(turn));
        Image::from_fn(500, 400, |x, y| {
            let [dx, dy] = [x as f64 + 0.5 - middle[0], y as f64 + 0.5 - middle[1]];
            let on_paper = [48.0 + cos * dx + sin * dy, 48.0 - sin * dx + cos * dy];
            let slab = (200..380).contains(&x) && (200..280).contains(&y);
            match sample_nearest(&marker, on_paper[0], on_paper[1]) {
                Some(ink) => ink,
                None if slab => LinearRgb::new(0.6, 0.05, 0.05),
                None => LinearRgb::new(0.05, 0.4, 0.1),
            }
        })
    }

    #[test]
    fn a_marker_beside_the_object_leaves_its_size_however_it_is_turned() {
        let turn = std::f64::consts::FRAC_PI_4;
        for (middle, turn) in [([148.0, 148.0], turn), ([130.0, 240.0], 0.0)] {
            assert_slab(added(
                &slab_beside_marker(middle, turn),
                Scale::Marker(MARKER),
            ));
        }
    }

    #[test]
    fn a_marker_that_is_painted_over_with_the_object_is_refused() {
        let turn = std::f64::consts::FRAC_PI_4;
        for (middle, turn) in [([160.0, 160.0], turn), ([142.0, 240.0], 0.0)] {
            let photo = slab_beside_marker(middle, turn);
            let reported = added(&photo, Scale::Marker(MARKER))
                .unwrap_err()
                .to_string();
            assert!(
                reported.contains("a.png: a marker is too close to the object"),
                "{reported}"
            );
        }
    }

    #[test]
    fn a_marker_at_any_distance_leaves_the_size_to_its_error_or_is_refused() {
        let mut refused = 0;
        for step in 0..24 {
            let middle = 138.0 + f64::from(step);
            let photo = slab_beside_marker([middle; 2], std::f64::consts::FRAC_PI_4);
            match added(&photo, Scale::Marker(MARKER)) {
                Err(Error::Photo { .. }) => refused += 1,
                size => {
                    let [length, _, error] = size.unwrap();
                    assert!(
                        (length - SLAB[0]).abs() < 3.0 * error,
                        "{step}: {length} +- {error}"
                    );
                }
            }
        }
        assert!((1..24).contains(&refused), "{refused}");
    }

    /// Transmittance inside the object is compared with the screen at the same place, not with one
    /// that is stretched onto it.
    #[test]
    fn an_empty_screen_of_another_shape_is_refused() {
        let camera = camera(0.2, 1100.0);
        let photo = photo(&camera, false);
        let header = Header::default();
        let rectified =
            RectifiedPhoto::by_corners(photo.clone(), SCREEN, None, 0.0, &header).unwrap();
        let same_view = |width, height| {
            let empty = resize(&photo, width, height);
            rectified.same_view(Arc::new(empty))
        };
        for (width, height) in [(1000, 750), (500, 375), (333, 250), (1501, 1126)] {
            let seen = same_view(width, height).unwrap();
            assert_eq!(seen.size(), rectified.photo.size());
        }
        for (width, height) in [(750, 1000), (1000, 749), (1000, 344), (344, 750)] {
            let reported = same_view(width, height).unwrap_err().to_string();
            let expected = format!(
                "the empty screen is {width} x {height} pixels, expected 1000 x 750 like the photo, or another size \
                 of that shape"
            );
            assert!(reported.ends_with(&expected), "{reported}");
        }
    }

    #[test]
    fn a_photo_without_a_marker_is_told() {
        let photo = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        let reported = RectifiedPhoto::by_marker(photo, 0.06, 0.0, &Header::default())
            .err()
            .unwrap()
            .to_string();
        assert!(
            reported.contains("no marker (AprilTag tag36h11, ArUco DICT_4X4_50) was found"),
            "{reported}"
        );
    }
}
