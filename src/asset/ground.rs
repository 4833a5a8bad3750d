//! The plane of the screen in a photo, by what lies in it: the screen's own four corners, or a printed marker.

use crate::camera::{self, Camera, Label, Marker, Solution, TELLING, any_markers, rectify};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::filter::Pyramid;
use crate::geom::{Point2, Point3, Pose, UnitQuaternion, Vector3};
use crate::image::{Image, Roi};
use crate::io::Header;
use crate::matte::{ScreenCorners, from_top_left, screen_corners};
use crate::pixel::{LinearRgb, Mix};

/// Noise of a corner that a person clicked, pixels.
const CLICKED_SIGMA_PX: f64 = 1.0;
/// Error of a tape measure beside a side of a screen or marker, as a share.
const TAPE_SIGMA: f64 = 0.003;
/// Error of the height at which the outline of an object lies, as a share of its thickness.
const HEIGHT_SIGMA: f64 = 0.25;
/// What is drawn in from the border of the screen, as a share of its sides: edges and worn corners.
const INSET: f64 = 0.02;
/// A marker has a white margin, at most as wide as this share of its black square.
const MARGIN: f64 = 0.35;
/// Less probable fits are those of another rectangle, and worth a look.
const IMPOSSIBLE: f64 = 1e-6;
const IMPROBABLE: f64 = 0.01;
/// Sides that may be exchanged are worth a look where that makes lengths other ones by this share.
const NOTEWORTHY: f64 = 0.01;
/// A camera looks less steeply at a screen than this, as the sine of the angle, or its photo is not for measuring.
const LEAST_SLOPE: f64 = 0.25;
/// Shortest side that can hold an object and its background, pixels.
const LEAST_SIDE_PX: f64 = 16.0;

/// A rectangle of known size in the plane of the screen, and where its corners are seen, from the top left, clockwise.
struct Reference {
    size: [f64; 2],
    corners_px: [Point2<f64>; 4],
    sigma_px: f64,
}

/// Where the camera stands over the screen, and how well the scale is known from that.
struct Ground {
    /// The reference is the plane `z = 0`, centred.
    camera: Camera,
    /// Width and height of the reference as they are seen.
    size: [f64; 2],
    /// Error of a corner as a share of the reference's side.
    corner_sigma: f64,
    /// Error of the camera's height as a share of it.
    height_sigma: f64,
    /// By how much lengths would differ if the sides were exchanged, which the photo does not tell; as a share.
    exchanged: f64,
    /// The corners are hardly those of a rectangle of this size.
    is_odd: bool,
}

impl Ground {
    fn of(reference: &Reference, image: [u32; 2], header: &Header) -> Result<Self> {
        let [w, h] = reference.size;
        let solved = |size| solved(reference, size, image, header);
        let first = solved([w, h]);
        let second = if w == h {
            Err(unfit(""))
        } else {
            solved([h, w])
        };
        let (best, other) = match (first, second) {
            (Ok(first), Ok(second)) if second.fit.chi2 < first.fit.chi2 => (second, Some(first)),
            (Ok(first), second) => (first, second.ok()),
            (Err(_), Ok(second)) => (second, None),
            (Err(error), Err(_)) => return Err(error),
        };
        check_fit(&best, reference.size)?;
        let other = other.filter(|other| other.fit.chi2 < best.fit.chi2 + TELLING);
        let exchanged = other.map_or(0.0, |other| {
            best.fit.px_per_metre / other.fit.px_per_metre - 1.0
        });
        let corners = reference.corners_px;
        let around: f64 = (0..4)
            .map(|i| (corners[(i + 1) % 4] - corners[i]).norm())
            .sum();
        Ok(Self {
            camera: best.camera,
            size: best.size,
            corner_sigma: reference.sigma_px / (around / 4.0),
            height_sigma: best.sigma.center[(2, 2)].max(0.0).sqrt() / best.camera.center().z,
            exchanged: exchanged.abs(),
            is_odd: best.fit.p_value.is_some_and(|p| p < IMPROBABLE),
        })
    }

    /// Standard error of a length at a place over the screen, as a share.
    ///
    /// An error of the corners tilts the plane that they give: its scale is off the more, the farther from them it is
    /// asked for.
    fn sigma(&self, place: Point3<f64>) -> f64 {
        let [w, h] = self.size;
        let away = libm::hypot(place.x, place.y) / (0.5 * (w + h));
        let of_corners = self.corner_sigma * libm::hypot(1.0, 2.0 * away);
        let share = place.z / (self.camera.center().z - place.z);
        let of_height = share * libm::hypot(2.0 * HEIGHT_SIGMA, self.height_sigma);
        [of_height, TAPE_SIGMA, self.exchanged]
            .into_iter()
            .fold(of_corners, libm::hypot)
    }
}

/// The camera that sees the reference, whose sides are of so many metres.
fn solved(
    reference: &Reference,
    size: [f64; 2],
    image: [u32; 2],
    header: &Header,
) -> Result<Solution> {
    let mut label = Label::new(image, reference.corners_px.map(Into::into), size);
    (
        label.surface.corner_sigma_px,
        label.surface.dimension_sigma_m,
    ) = (
        Some(reference.sigma_px),
        Some(TAPE_SIGMA * size[0].min(size[1])),
    );
    camera::learn(&mut label, header);
    camera::solve(&label, &Default::default()).map_err(|e| unfit(&e.to_string()))
}

fn unfit(what: &str) -> Error {
    let instead = "measure the object's length with a tape instead";
    Error::Photo {
        what: format!("the screen's scale cannot be told: {what}; {instead}"),
    }
}

fn check_fit(solution: &Solution, [w, h]: [f64; 2]) -> Result<()> {
    match solution.fit.p_value {
        Some(p) if p < IMPOSSIBLE => {
            let what =
                format!("its corners are not those of {w} x {h} m; are width and height right?");
            Err(unfit(&what))
        }
        _ => Ok(()),
    }
}

/// A photo as it is seen from straight above, where something in it tells of the screen's plane.
///
/// A camera that is tilted sees an object shorter than it is along one direction, and larger in front than behind: no one
/// scale is right for it.
pub(super) struct OnScreen {
    pub(super) photo: Image<LinearRgb>,
    view: Option<View>,
}

/// A rectangle at the height of an object, seen from straight above.
struct View {
    ground: Ground,
    /// Where the rectangle lies: its own plane `z = 0`, centred.
    ground_from_view: Pose,
    size: [f64; 2],
    px_per_metre: f64,
}

impl OnScreen {
    /// A photo in which nothing tells of the screen's plane.
    pub(super) fn whole(photo: Image<LinearRgb>) -> Self {
        Self { photo, view: None }
    }

    /// The inside of a screen of `size` metres, by its four corners, which are found where they are not known; things are
    /// as large as at `height` metres above it.
    pub(super) fn by_corners(
        photo: Image<LinearRgb>,
        size: [f64; 2],
        corners_px: Option<[[f64; 2]; 4]>,
        height: f64,
        header: &Header,
    ) -> Result<Self> {
        let clicked = |corners: [[f64; 2]; 4]| ScreenCorners {
            corners_px: corners.map(Point2::from),
            sigma_px: CLICKED_SIGMA_PX,
        };
        let ScreenCorners {
            corners_px,
            sigma_px,
        } = corners_px.map_or_else(|| screen_corners(&photo), |corners| Ok(clicked(corners)))?;
        let ground = Ground::of(
            &Reference {
                size,
                corners_px,
                sigma_px,
            },
            size_of(&photo),
            header,
        )?;
        Self::above(&photo, View::of_screen(ground, height))
    }

    /// The photo without its markers, whose black squares have sides of so many metres; the largest tells the plane.
    pub(super) fn by_marker(
        photo: Image<LinearRgb>,
        side: f64,
        height: f64,
        header: &Header,
    ) -> Result<Self> {
        let markers = any_markers(&photo);
        let area = |corners: &[Point2<f64>; 4]| {
            (corners[2] - corners[0])
                .perp(&(corners[3] - corners[1]))
                .abs()
        };
        let largest = markers
            .iter()
            .max_by(|a, b| area(&a.corners_px).total_cmp(&area(&b.corners_px)));
        let none = || unfit("no marker (AprilTag tag36h11, ArUco DICT_4X4_50) was found on it");
        let Marker {
            corners_px,
            sigma_px,
            ..
        } = *largest.ok_or_else(none)?;
        let reference = Reference {
            size: [side; 2],
            corners_px: from_top_left(corners_px),
            sigma_px,
        };
        let ground = Ground::of(&reference, size_of(&photo), header)?;
        let view = View::of_photo(ground, height)?;
        let mut free = photo;
        for marker in &markers {
            let part = around(&marker.corners_px, free.size());
            paint_over(&mut free, part);
        }
        Self::above(&free, view)
    }

    fn above(photo: &Image<LinearRgb>, view: View) -> Result<Self> {
        Ok(Self {
            photo: view.seen(photo)?,
            view: Some(view),
        })
    }

    /// Another photo from the same place in the same way.
    pub(super) fn same_view(&self, other: Image<LinearRgb>) -> Result<Image<LinearRgb>> {
        self.view
            .as_ref()
            .map_or(Ok(other.clone()), |view| view.seen(&other))
    }

    /// Pixels for a metre, where something tells, and the standard error of a length at a place, as a share.
    pub(super) fn scale(&self, at: Point2<f64>) -> Option<[f64; 2]> {
        self.view
            .as_ref()
            .map(|view| [view.px_per_metre, view.ground.sigma(view.place(at))])
    }

    /// The warning about a size that is measured by this.
    pub(super) fn diagnostic(&self) -> Option<Diagnostic> {
        let ground = &self.view.as_ref()?.ground;
        let ([w, h], percent) = (ground.size, 100.0 * ground.exchanged);
        let odd = || {
            let message = format!(
                "the screen hardly looks like one of {w:.3} x {h:.3} m; are width and height right?"
            );
            Diagnostic::warning(Code::ScreenSizeMismatch, message)
        };
        let turned = || {
            let message = format!(
                "the longer side of the screen cannot be identified: lengths may be off by {percent:.0} %"
            );
            Diagnostic::warning(Code::ScreenSidesAmbiguous, message)
        };
        let is_turned = ground.exchanged > NOTEWORTHY;
        ground.is_odd.then(odd).or_else(|| is_turned.then(turned))
    }
}

impl View {
    /// What is seen over the inside of a screen.
    fn of_screen(ground: Ground, height: f64) -> Self {
        // Lines of sight to a rectangle pass a plane above it in a smaller rectangle, nearer to below the camera.
        let (center, share) = (ground.camera.center(), height / ground.camera.center().z);
        let middle = Vector3::new(center.x * share, center.y * share, height);
        let size = ground
            .size
            .map(|side| (1.0 - share) * (1.0 - 2.0 * INSET) * side);
        Self::new(
            ground,
            Pose::from_parts(middle.into(), UnitQuaternion::identity()),
            size,
        )
    }

    /// The largest part of a photo that is an upright rectangle in the plane, too.
    fn of_photo(ground: Ground, height: f64) -> Result<Self> {
        let camera = &ground.camera;
        let [w, h] = camera.image.map(f64::from);
        let place = |x: f64, y: f64| {
            let ray = camera.ray(Point2::new(x, y));
            let slope = -ray.direction.normalize().z;
            (slope > LEAST_SLOPE).then(|| ray.at((height - ray.origin.z) / ray.direction.z))
        };
        let places: Option<Vec<Point3<f64>>> = [
            (0.0, 0.0),
            (w, 0.0),
            (w, h),
            (0.0, h),
            (w / 2.0, h / 2.0),
            (w / 2.0 + 1.0, h / 2.0),
        ]
        .map(|(x, y)| place(x, y))
        .into_iter()
        .collect();
        let places =
            places.ok_or_else(|| unfit("the camera looks along it; photograph it from above"))?;
        let across = places[5] - places[4];
        let turn =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), libm::atan2(across.y, across.x));
        let corners = [0, 1, 2, 3].map(|i| turn.inverse() * places[i].coords);
        let inner = |of: fn(&Vector3<f64>) -> f64| {
            let mut sorted = corners.map(|c| of(&c));
            sorted.sort_by(f64::total_cmp);
            [sorted[1], sorted[2]]
        };
        let ([x0, x1], [y0, y1]) = (inner(|c| c.x), inner(|c| c.y));
        let middle = turn * Vector3::new((x0 + x1) / 2.0, (y0 + y1) / 2.0, height);
        Ok(Self::new(
            ground,
            Pose::from_parts(middle.into(), turn),
            [x1 - x0, y1 - y0],
        ))
    }

    /// The finer of the photo's scales in the middle: nothing of it is lost.
    fn new(ground: Ground, ground_from_view: Pose, size: [f64; 2]) -> Self {
        let step = 1e-4 * size[0].min(size[1]);
        let seen = |x: f64, y: f64| {
            let place = ground_from_view * Point3::new(x, y, 0.0);
            ground
                .camera
                .project(place)
                .map_or(Point2::origin(), |(px, _)| px)
        };
        let along = [
            seen(step, 0.0) - seen(-step, 0.0),
            seen(0.0, step) - seen(0.0, -step),
        ];
        let px_per_metre = along
            .map(|way| way.norm() / (2.0 * step))
            .into_iter()
            .fold(0.0, f64::max);
        Self {
            ground,
            ground_from_view,
            size,
            px_per_metre,
        }
    }

    /// The rectangle as it is seen from straight above.
    fn seen(&self, photo: &Image<LinearRgb>) -> Result<Image<LinearRgb>> {
        if self
            .size
            .iter()
            .any(|side| side * self.px_per_metre < LEAST_SIDE_PX)
        {
            return Err(unfit("its corners leave nothing of the photo"));
        }
        let camera = &self.ground.camera;
        let camera_from_view = camera.camera_from_world * self.ground_from_view;
        let camera = Camera {
            camera_from_world: camera_from_view,
            ..*camera
        };
        rectify(
            &Pyramid::new(photo.clone()),
            &camera.resized(size_of(photo)),
            self.size,
            self.px_per_metre,
        )
    }

    /// Where a pixel of the view lies.
    fn place(&self, at: Point2<f64>) -> Point3<f64> {
        let [x, y] = [
            at.x / self.px_per_metre - self.size[0] / 2.0,
            self.size[1] / 2.0 - at.y / self.px_per_metre,
        ];
        self.ground_from_view * Point3::new(x, y, 0.0)
    }
}

fn size_of(photo: &Image<LinearRgb>) -> [u32; 2] {
    [photo.width() as u32, photo.height() as u32]
}

/// A marker and its white margin, in whole pixels.
fn around(corners: &[Point2<f64>; 4], (w, h): (usize, usize)) -> Roi {
    let range = |of: fn(&Point2<f64>) -> f64, len: usize| {
        let values = corners.map(|c| of(&c));
        let (low, high) = values
            .iter()
            .fold((f64::MAX, f64::MIN), |(l, h), v| (v.min(l), v.max(h)));
        let margin = MARGIN * (high - low) + 2.0;
        let [low, high] = [low - margin, high + margin].map(|v| v.clamp(0.0, len as f64) as usize);
        low..high.max(low)
    };
    Roi::spanning(range(|c| c.x, w), range(|c| c.y, h))
}

/// Puts what its four sides show in place of a part of a picture (a Coons patch): no edge is left.
fn paint_over(picture: &mut Image<LinearRgb>, part: Roi) {
    let (w, h) = picture.size();
    let [left, right] = [
        part.x.saturating_sub(1),
        (part.x + part.width).min(w.saturating_sub(1)),
    ];
    let [top, bottom] = [
        part.y.saturating_sub(1),
        (part.y + part.height).min(h.saturating_sub(1)),
    ];
    let source = picture.clone();
    let mix = |a: LinearRgb, b: LinearRgb, t: f32| a.scale(1.0 - t).add_scaled(t, b);
    for y in part.y..part.y + part.height {
        for x in part.x..part.x + part.width {
            let s = (x - left) as f32 / (right - left).max(1) as f32;
            let t = (y - top) as f32 / (bottom - top).max(1) as f32;
            let across = mix(source[(left, y)], source[(right, y)], s);
            let down = mix(source[(x, top)], source[(x, bottom)], t);
            let upper = mix(source[(left, top)], source[(right, top)], s);
            let lower = mix(source[(left, bottom)], source[(right, bottom)], s);
            picture[(x, y)] = across
                .add_scaled(1.0, down)
                .add_scaled(-1.0, mix(upper, lower, t));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AddPhoto, Scale, add_photo};
    use super::*;
    use crate::camera::{printed, project_picture};
    use crate::geom::Vector2;
    use crate::io;
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

    fn reference(camera: &Camera, size: [f64; 2], sigma_px: f64) -> Reference {
        Reference {
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
                // What nobody knows: the lens, the tape's error and the height at which the outline lies.
                let camera = camera(tilt, 1000.0 * libm::exp(0.35 * drawn(8)));
                let mut noisy = reference(&camera, [side; 2], sigma_px);
                noisy.size = [side * (1.0 + TAPE_SIGMA * drawn(9)); 2];
                for (i, corner) in (0..).zip(&mut noisy.corners_px) {
                    *corner += sigma_px * Vector2::new(drawn(2 * i), drawn(2 * i + 1));
                }
                let ground = Ground::of(&noisy, camera.image, &Header::default()).unwrap();
                let height = 0.035 * (1.0 + 2.0 * HEIGHT_SIGMA * drawn(10));
                let [a, b] = [[far, -0.03], [far, 0.07]].map(|at| {
                    let ray = ground.camera.ray(seen(&camera, at, height));
                    ray.at((0.035 - ray.origin.z) / ray.direction.z)
                });
                let (off, told) = ((b - a).norm() / 0.1 - 1.0, ground.sigma(a + (b - a) / 2.0));
                (squares, count) = (squares + (off / told) * (off / told), count + 1);
            }
        }
        let chi = (squares / f64::from(count)).sqrt();
        assert!((0.6..1.4).contains(&chi), "{chi}");
    }

    #[test]
    fn the_error_grows_with_the_distance_from_a_marker() {
        let camera = camera(0.0, 1000.0);
        let ground = Ground::of(
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
            let told = Reference {
                size,
                ..reference(&camera, SCREEN, 0.2)
            };
            let ground = Ground::of(&told, camera.image, &Header::default()).unwrap();
            OnScreen {
                photo: Image::new(0, 0),
                view: Some(View::of_screen(ground, 0.0)),
            }
            .diagnostic()
        };
        assert_eq!(doubt(SCREEN), None);
        assert!(
            doubt([0.5, 0.5])
                .unwrap()
                .message
                .ends_with("0.500 x 0.500 m; are width and height right?")
        );
    }

    #[test]
    fn a_turned_screen_is_measured_by_its_other_side() {
        let camera = camera(0.2, 1000.0);
        let turned = |size| Reference {
            size,
            ..reference(&camera, [0.3, 0.4], 0.3)
        };
        let ground = |size| Ground::of(&turned(size), camera.image, &Header::default()).unwrap();
        for size in [[0.3, 0.4], [0.4, 0.3]] {
            let found = ground(size);
            assert!(
                (found.size[0] - 0.3).abs() < 0.003 && found.exchanged == 0.0,
                "{:?}",
                found.size
            );
        }
        // Sides of nearly the same length: the photo does not tell which is which, and that is part of the error.
        let view = View::of_screen(ground([0.303, 0.4]), 0.0);
        assert!(view.ground.exchanged == 0.0);
        let nearly = Reference {
            size: [0.41, 0.4],
            ..reference(&camera, [0.41, 0.4], 2.0)
        };
        let ground = Ground::of(&nearly, camera.image, &Header::default()).unwrap();
        assert!(
            ground.exchanged > NOTEWORTHY && ground.sigma(Point3::origin()) > ground.exchanged,
            "{}",
            ground.exchanged
        );
        let seen = OnScreen {
            photo: Image::new(0, 0),
            view: Some(View::of_screen(ground, 0.0)),
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

    /// A green screen with a slab across it and, where it is asked for, a marker on it, on a brown table.
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
        let seen = project_picture(&Pyramid::new(screen), camera, SCREEN);
        let alpha = project_picture(
            &Pyramid::new(Image::filled(600, 400, Coverage(1.0))),
            camera,
            SCREEN,
        );
        seen.zip_map(&alpha, |p, a| {
            p + LinearRgb::new(0.2, 0.12, 0.06).scale(1.0 - a.0)
        })
    }

    fn added(photo: &Image<LinearRgb>, scale: Scale) -> Result<[f64; 3]> {
        let folder = tempfile::tempdir().unwrap();
        io::write(folder.path().join("a.png"), photo).unwrap();
        let add = AddPhoto {
            thickness: 1e-4,
            ..AddPhoto::new("a", "slab", scale)
        };
        let record = add_photo(
            folder.path().join("assets"),
            folder.path().join("a.png"),
            &add,
        )?
        .record;
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
        let told = added(&photo.crop(part), Scale::Screen(SCREEN, None))
            .unwrap_err()
            .to_string();
        assert!(
            told.contains(
                "a.png: the corners of the screen cannot be found: it reaches the border"
            ),
            "{told}"
        );
        let told = added(&photo, Scale::Screen([0.6, 0.2], None))
            .unwrap_err()
            .to_string();
        assert!(
            told.contains("its corners are not those of 0.6 x 0.2 m; are width and height right?"),
            "{told}"
        );
    }

    #[test]
    fn a_printed_marker_tells_the_size_of_what_lies_beside_it() {
        let photo = photo(&camera(0.35, 2400.0), true);
        assert_slab(added(&photo, Scale::Marker(MARKER)));
    }

    #[test]
    fn a_marker_is_painted_over_without_an_edge() {
        let slope = |x: usize, y: usize| {
            LinearRgb::new(0.05, 0.3 + 0.001 * x as f32 + 0.0005 * y as f32, 0.1)
        };
        let mut picture = Image::from_fn(80, 60, slope);
        let part = Roi {
            x: 20,
            y: 10,
            width: 30,
            height: 30,
        };
        (0..900).for_each(|i| picture[(20 + i % 30, 10 + i / 30)] = LinearRgb::WHITE);
        paint_over(&mut picture, part);
        let off = picture.zip_map(&Image::from_fn(80, 60, slope), |a, b| (a.g - b.g).abs());
        assert!(off.pixels().iter().all(|off| *off < 1e-5));
        paint_over(
            &mut picture,
            Roi {
                x: 0,
                y: 0,
                width: 80,
                height: 60,
            },
        );
    }

    #[test]
    fn a_photo_without_a_marker_is_told() {
        let photo = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        let told = OnScreen::by_marker(photo, 0.06, 0.0, &Header::default())
            .err()
            .unwrap()
            .to_string();
        assert!(
            told.contains("no marker (AprilTag tag36h11, ArUco DICT_4X4_50) was found"),
            "{told}"
        );
    }
}
