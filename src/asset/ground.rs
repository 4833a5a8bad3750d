//! The plane of the screen in a photo, by what lies in it: the screen's own four corners, or a printed marker.

use crate::camera::{self, Camera, CornerOrder, Label, Solution, SolveOptions, any_markers};
use crate::error::{Error, Result};
use crate::geom::{Point2, Vector2, Vector3};
use crate::image::{Image, Roi};
use crate::matte::screen_corners;
use crate::pixel::{LinearRgb, Mix};

/// Noise of a corner that a person clicked or that was found along the screen's border, pixels.
const CORNER_SIGMA_PX: f64 = 1.0;
/// Error of a tape measure beside a side of a screen or marker, as a share.
const TAPE_SIGMA: f64 = 0.003;
/// Error of the height at which the outline of an object lies, as a share of its thickness.
const HEIGHT_SIGMA: f64 = 0.25;
/// What is drawn in from the border of the screen, as a share of its sides: edges and worn corners.
const INSET: f64 = 0.02;
/// A marker has a white margin, at most as wide as so many of its cells of eight.
const MARGIN: f64 = 2.0 / 8.0;

/// Where the camera stands over the screen, and how well the scale is known from that.
pub(super) struct Ground {
    camera: Camera,
    /// Error of a corner as a share of the reference's side.
    sigma: f64,
    /// Mean side of the reference, and where its middle is seen.
    side: f64,
    middle_px: Point2<f64>,
}

/// Scale of a photo at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalScale {
    /// Pixels of the photo for a metre.
    pub(super) px_per_metre: f64,
    /// Its standard error, as a share.
    pub(super) sigma: f64,
}

impl Ground {
    /// From four corners of a rectangle of `size` metres in the screen's plane, known to `sigma_px`.
    fn of(
        image: [u32; 2],
        corners: [Point2<f64>; 4],
        size: [f64; 2],
        sigma_px: f64,
        focal_35mm: Option<f64>,
    ) -> Result<Self> {
        let mut label = Label::new(image, corners.map(Into::into), size);
        (label.surface.corner_sigma_px, label.surface.dimension_sigma_m) =
            (Some(sigma_px), Some(TAPE_SIGMA * size[0].min(size[1])));
        label.camera.focal_35mm = focal_35mm;
        let options = SolveOptions { order: CornerOrder::Auto, ..Default::default() };
        let solution = camera::solve(&label, &options).map_err(|e| unfit(&e.to_string()))?;
        check_fit(&solution, size)?;
        let around: f64 = (0..4).map(|i| (corners[(i + 1) % 4] - corners[i]).norm()).sum();
        let middle = corners.iter().fold(Point2::origin(), |sum, c| sum + c.coords / 4.0);
        let side = 0.5 * (size[0] + size[1]);
        Ok(Self { camera: solution.camera, sigma: sigma_px / (around / 4.0), side, middle_px: middle })
    }

    /// The scale where the photo shows `at`, `height` metres above the screen.
    ///
    /// An error of the corners tilts the plane that they give: its scale is off the more, the farther from them it is
    /// asked for.
    pub(super) fn scale(&self, at: Point2<f64>, height: f64) -> LocalScale {
        let ray = self.camera.ray(at);
        let place = ray.at((height - ray.origin.z) / ray.direction.z);
        let seen = |step: Vector3<f64>| self.camera.project(place + step).map_or(at, |(px, _)| px);
        let step = 1e-4 * self.side;
        let along = [Vector3::x(), Vector3::y()].map(|axis| (seen(axis * step) - seen(-axis * step)) / (2.0 * step));
        let px_per_metre = along[0].perp(&along[1]).abs().sqrt();
        let distance = (self.camera.center() - place).norm();
        let away = (at - self.middle_px).norm() / px_per_metre / self.side;
        let of_height = HEIGHT_SIGMA * 2.0 * height / distance;
        let of_corners = self.sigma * libm::hypot(1.0, 2.0 * away);
        LocalScale { px_per_metre, sigma: libm::hypot(libm::hypot(of_corners, of_height), TAPE_SIGMA) }
    }
}

fn unfit(what: &str) -> Error {
    Error::Photo { what: format!("the screen's scale cannot be told: {what}") }
}

/// Less probable fits are those of another rectangle.
const IMPOSSIBLE: f64 = 1e-6;

fn check_fit(solution: &Solution, [w, h]: [f64; 2]) -> Result<()> {
    match solution.fit.p_value {
        Some(p) if p < IMPOSSIBLE => {
            let what = format!("its corners are not those of {w} x {h} m; are width and height right?");
            Err(unfit(&what))
        }
        _ => Ok(()),
    }
}

/// A photo of which only the screen and the object are left.
pub(super) struct OnScreen {
    pub(super) photo: Image<LinearRgb>,
    /// Where it lies in the whole photo.
    part: Roi,
    /// The plane of the screen, where something in it tells of that.
    ground: Option<Ground>,
}

impl OnScreen {
    /// A photo in which nothing tells of the screen's plane.
    pub(super) fn whole(photo: Image<LinearRgb>) -> Self {
        let (width, height) = photo.size();
        Self { photo, part: Roi { x: 0, y: 0, width, height }, ground: None }
    }

    /// The inside of a screen of `size` metres, by its four corners, which are found where they are not known.
    pub(super) fn by_corners(
        photo: &Image<LinearRgb>,
        size: [f64; 2],
        corners_px: Option<[[f64; 2]; 4]>,
        focal_35mm: Option<f64>,
    ) -> Result<Self> {
        let corners = corners_px.map_or_else(|| screen_corners(photo), |corners| Ok(corners.map(Point2::from)))?;
        let ground = Ground::of(size_of(photo), corners, size, CORNER_SIGMA_PX, focal_35mm)?;
        let part = inside(corners, photo.size());
        if part.width < LEAST_SIDE_PX || part.height < LEAST_SIDE_PX {
            return Err(unfit("its corners leave nothing of the photo"));
        }
        Ok(Self { photo: photo.crop(part), part, ground: Some(ground) })
    }

    /// The photo without its markers, whose black squares have sides of so many metres; the largest tells the plane.
    pub(super) fn by_marker(photo: Image<LinearRgb>, side: f64, focal_35mm: Option<f64>) -> Result<Self> {
        let (markers, sigma_px) = any_markers(&photo);
        let area = |corners: &[Point2<f64>; 4]| (corners[2] - corners[0]).perp(&(corners[3] - corners[1])).abs();
        let largest = markers.iter().max_by(|a, b| area(&a.corners_px).total_cmp(&area(&b.corners_px)));
        let none = || unfit("no marker (AprilTag tag36h11, ArUco DICT_4X4_50) was found on it");
        let corners = largest.ok_or_else(none)?.corners_px;
        let ground = Ground::of(size_of(&photo), corners, [side; 2], sigma_px, focal_35mm)?;
        let mut free = Self::whole(photo);
        for marker in &markers {
            let part = around(&marker.corners_px, free.photo.size());
            paint_over(&mut free.photo, part);
        }
        Ok(Self { ground: Some(ground), ..free })
    }

    /// The same part of another photo from the same place.
    pub(super) fn same_part(&self, other: Image<LinearRgb>) -> Image<LinearRgb> {
        let Roi { x, y, width, height } = self.part;
        if other.width() < x + width || other.height() < y + height || other.size() == self.photo.size() {
            return other;
        }
        other.crop(self.part)
    }

    /// The scale at a place of what is left, so many metres above the screen; none where nothing tells.
    pub(super) fn scale(&self, at: Point2<f64>, height: f64) -> Option<LocalScale> {
        let corner = Vector2::new(self.part.x as f64, self.part.y as f64);
        self.ground.as_ref().map(|ground| ground.scale(at + corner, height))
    }
}

/// Shortest side that can hold an object and its background, pixels.
const LEAST_SIDE_PX: usize = 16;

fn size_of(photo: &Image<LinearRgb>) -> [u32; 2] {
    [photo.width() as u32, photo.height() as u32]
}

/// The largest upright rectangle between the opposite sides of a screen that is seen nearly upright.
fn inside(corners: [Point2<f64>; 4], (w, h): (usize, usize)) -> Roi {
    let range = |of: fn(&Point2<f64>) -> f64, len: usize| {
        let mut sorted = corners.map(|c| of(&c));
        sorted.sort_by(f64::total_cmp);
        let inset = INSET * (sorted[3] - sorted[0]);
        let [low, high] = [sorted[1] + inset, sorted[2] - inset].map(|v| v.clamp(0.0, len as f64) as usize);
        low..high.max(low)
    };
    Roi::spanning(range(|c| c.x, w), range(|c| c.y, h))
}

/// A marker and its white margin, in whole pixels.
fn around(corners: &[Point2<f64>; 4], (w, h): (usize, usize)) -> Roi {
    let range = |of: fn(&Point2<f64>) -> f64, len: usize| {
        let values = corners.map(|c| of(&c));
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (v.min(l), v.max(h)));
        let margin = MARGIN * (high - low) + 2.0;
        let [low, high] = [low - margin, high + margin].map(|v| v.clamp(0.0, len as f64) as usize);
        low..high.max(low)
    };
    Roi::spanning(range(|c| c.x, w), range(|c| c.y, h))
}

/// Puts what its four sides show in place of a part of a picture (a Coons patch): no edge is left.
fn paint_over(picture: &mut Image<LinearRgb>, part: Roi) {
    let (w, h) = picture.size();
    let [left, right] = [part.x.saturating_sub(1), (part.x + part.width).min(w.saturating_sub(1))];
    let [top, bottom] = [part.y.saturating_sub(1), (part.y + part.height).min(h.saturating_sub(1))];
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
            picture[(x, y)] = across.add_scaled(1.0, down).add_scaled(-1.0, mix(upper, lower, t));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AddPhoto, Scale, add_photo};
    use super::*;
    use crate::camera::{printed, project_picture};
    use crate::filter::Pyramid;
    use crate::geom::{Pose, UnitQuaternion};
    use crate::io;
    use crate::pixel::Coverage;

    /// A camera 1 m above a screen, tilted.
    fn camera(tilt: f64) -> Camera {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt);
        Camera {
            image: [2000, 1500],
            focal_px: [2000.0; 2].into(),
            principal_px: [1000.0, 750.0].into(),
            camera_from_world: Pose::from_parts((down * Vector3::new(0.0, 0.0, -1.0)).into(), down),
        }
    }

    fn seen(camera: &Camera, [x, y]: [f64; 2], z: f64) -> Point2<f64> {
        camera.project([x, y, z].into()).unwrap().0
    }

    fn ground(camera: &Camera, [w, h]: [f64; 2], sigma_px: f64) -> Result<Ground> {
        let corners = [[-w, h], [w, h], [w, -h], [-w, -h]].map(|[x, y]| seen(camera, [x / 2.0, y / 2.0], 0.0));
        Ground::of(camera.image, corners, [w, h], sigma_px, Some(36.0))
    }

    #[test]
    fn the_scale_is_that_at_half_the_object_s_height() {
        for tilt in [0.0, 0.1] {
            let camera = camera(tilt);
            for (reference, sigma_px) in [([0.6, 0.4], 1.0), ([0.08, 0.08], 0.1)] {
                let ground = ground(&camera, reference, sigma_px).unwrap();
                let [a, b] = [[-0.1, 0.02], [0.1, 0.02]].map(|at| seen(&camera, at, 0.035));
                let truth = (b - a).norm() / 0.2;
                let told = ground.scale(a + (b - a) / 2.0, 0.035);
                let off = told.px_per_metre / truth - 1.0;
                assert!(
                    off.abs() < 3.0 * told.sigma && told.sigma < 0.03,
                    "{tilt} {reference:?}: {off} {}",
                    told.sigma
                );
                // On the screen itself it would be 3.5 % smaller.
                assert!(ground.scale(a, 0.0).px_per_metre < 0.98 * told.px_per_metre);
            }
        }
    }

    #[test]
    fn the_error_grows_with_the_distance_from_a_marker() {
        let camera = camera(0.0);
        let ground = ground(&camera, [0.08, 0.08], 0.3).unwrap();
        let error = |x: f64| ground.scale(seen(&camera, [x, 0.0], 0.0), 0.005).sigma;
        assert!(error(0.3) > 2.0 * error(0.02) && error(0.3) < 0.05, "{} {}", error(0.02), error(0.3));
    }

    /// Metres of the screen in the photos below, and of the red slab on it.
    const SCREEN: [f64; 2] = [0.6, 0.4];
    const SLAB: [f64; 2] = [0.18, 0.08];
    /// Side of the marker's black square: six of the eight cells of what is printed.
    const MARKER: f64 = 0.072;

    /// A green screen with a slab and, where it is asked for, a marker on it, on a brown table.
    fn photo(camera: &Camera, with_marker: bool) -> Image<LinearRgb> {
        let marker = printed(7, 12);
        let screen = Image::from_fn(600, 400, |x, y| {
            let slab = (260..440).contains(&x) && (160..240).contains(&y);
            match (slab, with_marker && (80..176).contains(&x) && (40..136).contains(&y)) {
                (true, _) => LinearRgb::new(0.6, 0.05, 0.05),
                (_, true) => marker[(x - 80, y - 40)],
                _ => LinearRgb::new(0.05, 0.4, 0.1).scale(0.8 + 0.2 * x as f32 / 600.0),
            }
        });
        let seen = project_picture(&Pyramid::new(screen), camera, SCREEN);
        let alpha = project_picture(&Pyramid::new(Image::filled(600, 400, Coverage(1.0))), camera, SCREEN);
        seen.zip_map(&alpha, |p, a| p + LinearRgb::new(0.2, 0.16, 0.12).scale(1.0 - a.0))
    }

    fn added(photo: &Image<LinearRgb>, scale: Scale) -> Result<[f64; 3]> {
        let folder = tempfile::tempdir().unwrap();
        io::write(folder.path().join("a.png"), photo).unwrap();
        let add = AddPhoto { thickness: 1e-4, ..AddPhoto::new("a", "slab", scale) };
        let record = add_photo(folder.path().join("assets"), folder.path().join("a.png"), &add)?.record;
        Ok([record.object_m[0], record.object_m[1], record.error_m])
    }

    #[test]
    fn a_screen_tells_the_size_of_what_lies_on_it() {
        let camera = camera(0.05);
        let photo = photo(&camera, false);
        let corners = [[-0.3, 0.2], [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]].map(|at| seen(&camera, at, 0.0).into());
        for corners in [None, Some(corners)] {
            let [length, width, error] = added(&photo, Scale::Screen(SCREEN, corners)).unwrap();
            assert!((length - SLAB[0]).abs() < 3.0 * error && error < 0.002, "{length} +- {error}");
            assert!((width - SLAB[1]).abs() < 3.0 * error, "{width} +- {error}");
        }
        let middle = Roi { x: 500, y: 400, width: 1000, height: 700 };
        let told = added(&photo.crop(middle), Scale::Screen(SCREEN, None)).unwrap_err().to_string();
        assert!(told.contains("a.png: the corners of the screen cannot be found: it reaches the border"), "{told}");
    }

    #[test]
    fn a_printed_marker_tells_the_size_of_what_lies_beside_it() {
        let camera = Camera { focal_px: [4000.0; 2].into(), ..camera(0.05) };
        let [length, width, error] = added(&photo(&camera, true), Scale::Marker(MARKER)).unwrap();
        assert!((length - SLAB[0]).abs() < 3.0 * error && error < 0.01, "{length} +- {error}");
        assert!((width - SLAB[1]).abs() < 3.0 * error, "{width} +- {error}");
    }

    #[test]
    fn another_rectangle_is_told() {
        let camera = camera(0.1);
        let corners = [[-0.3, 0.2], [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]].map(|at| seen(&camera, at, 0.0));
        let told = Ground::of(camera.image, corners, [0.6, 0.2], 1.0, Some(36.0)).err().unwrap().to_string();
        assert!(told.contains("its corners are not those of 0.6 x 0.2 m; are width and height right?"), "{told}");
    }

    #[test]
    fn a_marker_is_painted_over_without_an_edge() {
        let slope = |x: usize, y: usize| LinearRgb::new(0.05, 0.3 + 0.001 * x as f32 + 0.0005 * y as f32, 0.1);
        let mut picture = Image::from_fn(80, 60, slope);
        let part = Roi { x: 20, y: 10, width: 30, height: 30 };
        (0..900).for_each(|i| picture[(20 + i % 30, 10 + i / 30)] = LinearRgb::WHITE);
        paint_over(&mut picture, part);
        let off = picture.zip_map(&Image::from_fn(80, 60, slope), |a, b| (a.g - b.g).abs());
        assert!(off.pixels().iter().all(|off| *off < 1e-5));
        paint_over(&mut picture, Roi { x: 0, y: 0, width: 80, height: 60 });
    }

    #[test]
    fn a_photo_without_a_marker_is_told() {
        let photo = Image::filled(120, 80, LinearRgb::new(0.04, 0.4, 0.08));
        let told = OnScreen::by_marker(photo, 0.06, None).err().unwrap().to_string();
        assert!(told.contains("no marker (AprilTag tag36h11, ArUco DICT_4X4_50) was found"), "{told}");
    }
}
