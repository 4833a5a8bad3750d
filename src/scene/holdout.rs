//! What stands in front of objects: the near walls of the surface, or what a mask marks.
//!
//! # Method
//! A wall hides an object between the walls if the ray from the object to the camera leaves the
//! room through the wall's inner side, and not over the rim: for walls that turn their outer side
//! to the camera, the inner side is projected, and everything behind it is held out.

use crate::camera::{Camera, RadialDistortion};
use crate::deep::HoldoutSample;
use crate::filter::sample_bilinear_clamped;
use crate::geom::{Plane, Point2, Point3, Vector2, Vector3, sides};
use crate::image::Image;
use crate::pixel::{Coverage, Depth};
use crate::scene::{Scene, Surface};
use std::ops::Range;

/// Near plane of the projection, metres: closer than any lens focuses.
const NEAR_PLANE_M: f64 = 1e-4;
/// Sub-samples per side of a pixel on the outline of a wall.
const SUBSAMPLES: usize = 8;
/// Half the diagonal of a pixel: an edge farther away than this does not pass through it.
const PIXEL_RADIUS_PX: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl Scene {
    /// The visible part of a mask of what hides objects; it is in front of all of them. `photo` is
    /// the camera of the whole mask, which is as large as the picture or larger.
    pub(crate) fn holdout_of_mask(
        &self,
        photo: &Camera,
        mask: &Image<Coverage>,
    ) -> Image<HoldoutSample> {
        let [across, down] = self.detail_of(mask);
        let is_whole = self.view.is_whole() && [across, down] == [1.0; 2];
        let shown;
        let mask = if is_whole && !self.lens.moves_plate() {
            mask
        } else {
            shown = self.shown(photo, |at| {
                sample_bilinear_clamped(mask, at.x * across, at.y * down)
            });
            &shown
        };
        mask.map(|coverage| HoldoutSample {
            coverage: Coverage(coverage.0.clamp(0.0, 1.0)),
            depth: Depth(0.0),
        })
    }
}

impl Surface {
    /// What the walls hide from a camera; none if they hide nothing.
    pub(crate) fn holdout(
        &self,
        camera: &Camera,
        lens: &RadialDistortion,
    ) -> Option<Image<HoldoutSample>> {
        let faces = self.hiding_faces(camera, lens);
        if faces.is_empty() {
            return None;
        }
        let [width, height] = camera.image.map(|side| side as usize);
        let mut picture = Image::filled(width, height, HoldoutSample::default());
        for face in &faces {
            face.draw(camera, lens, &mut picture);
        }
        Some(picture)
    }

    /// The inner sides of the walls that the camera sees from outside, clipped to the picture.
    fn hiding_faces(&self, camera: &Camera, lens: &RadialDistortion) -> Vec<ProjectedFace> {
        let faces = self.wall.map(|wall| wall.inner_faces(self.size));
        faces
            .into_iter()
            .flatten()
            .filter_map(|face| ProjectedFace::new(&face, camera, lens))
            .collect()
    }
}

/// The inner side of a wall in the picture, seen from behind.
struct ProjectedFace {
    plane: Plane,
    /// Lines around it, each with its unit normal inwards and its distance, pixels.
    sides: Vec<(Vector2<f64>, f64)>,
    columns: Range<usize>,
    rows: Range<usize>,
}

impl ProjectedFace {
    /// None for one seen from the front, edge-on or not at all.
    fn new(face: &[Vector3<f64>; 4], camera: &Camera, lens: &RadialDistortion) -> Option<Self> {
        // Its corners run clockwise as seen from inside the room.
        let outward = (face[1] - face[0]).cross(&(face[3] - face[0]));
        let normal = outward.try_normalize(0.0)?;
        if normal.dot(&(camera.center().coords - face[0])) <= 0.0 {
            return None;
        }
        let ring = seen_ring(face, camera);
        let [columns, rows] =
            [0, 1].map(|axis| pixels_around(&ring, axis, camera.image[axis], lens));
        let is_seen = ring.len() > 2 && !columns.is_empty() && !rows.is_empty();
        is_seen.then(|| Self {
            plane: Plane {
                normal,
                offset: normal.dot(&face[0]),
            },
            sides: inner_sides(&ring),
            columns,
            rows,
        })
    }

    fn draw(&self, camera: &Camera, lens: &RadialDistortion, picture: &mut Image<HoldoutSample>) {
        for y in self.rows.clone() {
            for x in self.columns.clone() {
                let center = lens.undistort(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
                let coverage = self.coverage(center);
                if coverage > 0.0 {
                    let pixel = &mut picture[(x, y)];
                    *pixel = merged(*pixel, coverage, self.depth(camera, center));
                }
            }
        }
    }

    fn depth(&self, camera: &Camera, px: Point2<f64>) -> f64 {
        let depth = self.plane.intersect(&camera.ray(px));
        depth.unwrap_or(f64::INFINITY)
    }

    /// Share of a pixel that it covers.
    fn coverage(&self, center: Point2<f64>) -> f64 {
        let inside = self.inset(center);
        if inside.abs() >= PIXEL_RADIUS_PX {
            return f64::from(inside > 0.0);
        }
        let hits = subsamples().filter(|offset| self.inset(center + offset) >= 0.0);
        hits.count() as f64 / (SUBSAMPLES * SUBSAMPLES) as f64
    }

    /// How far a point is from the nearest side, pixels; negative outside.
    fn inset(&self, px: Point2<f64>) -> f64 {
        let distances = self
            .sides
            .iter()
            .map(|(n, offset)| n.dot(&px.coords) - offset);
        distances.fold(f64::INFINITY, f64::min)
    }
}

/// Adjoining walls share the pixels of their common edge.
fn merged(pixel: HoldoutSample, coverage: f64, depth: f64) -> HoldoutSample {
    let nearest = if pixel.coverage.0 > 0.0 {
        f64::from(pixel.depth.0).min(depth)
    } else {
        depth
    };
    HoldoutSample {
        coverage: Coverage((pixel.coverage.0 + coverage as f32).min(1.0)),
        depth: Depth(nearest as f32),
    }
}

/// Offsets of the sub-samples of a pixel from its centre.
fn subsamples() -> impl Iterator<Item = Vector2<f64>> {
    (0..SUBSAMPLES * SUBSAMPLES).map(|i| {
        let cell = Vector2::new((i % SUBSAMPLES) as f64, (i / SUBSAMPLES) as f64);
        cell.add_scalar(0.5) / SUBSAMPLES as f64 - Vector2::repeat(0.5)
    })
}

/// A polygon as a camera sees it, pixels: the part in front of the camera.
fn seen_ring(face: &[Vector3<f64>; 4], camera: &Camera) -> Vec<Point2<f64>> {
    let in_camera = face.map(|corner| camera.camera_from_world * Point3::from(corner));
    let mut ring = Vec::new();
    for [a, b] in sides(&in_camera) {
        ring.extend((a.z >= NEAR_PLANE_M).then_some(a));
        if (a.z >= NEAR_PLANE_M) != (b.z >= NEAR_PLANE_M) {
            ring.push(a + (b - a) * ((NEAR_PLANE_M - a.z) / (b.z - a.z)));
        }
    }
    ring.iter().map(|p| pixel_of(p, camera)).collect()
}

fn pixel_of(p: &Point3<f64>, camera: &Camera) -> Point2<f64> {
    let seen = (p.coords.xy() / p.z).component_mul(&camera.focal_px);
    camera.principal_px + seen
}

/// The pixels along one side of the picture that the box around a ring touches.
///
/// With a lens, all of them: the ring is not distorted for this.
fn pixels_around(
    ring: &[Point2<f64>],
    axis: usize,
    side: u32,
    lens: &RadialDistortion,
) -> Range<usize> {
    if !lens.is_none() {
        return 0..side as usize;
    }
    let ends = ring.iter().map(|p| p[axis].clamp(0.0, side.into()));
    let low = ends.clone().fold(f64::INFINITY, f64::min);
    let high = ends.fold(0.0, f64::max);
    low.floor() as usize..high.ceil() as usize
}

/// The lines along a convex ring, their normals inwards, whichever way it turns.
fn inner_sides(ring: &[Point2<f64>]) -> Vec<(Vector2<f64>, f64)> {
    let edges: Vec<_> = sides(ring).map(|[a, b]| (a, b - a)).collect();
    let area: f64 = edges.iter().map(|(a, edge)| a.coords.perp(edge)).sum();
    edges
        .into_iter()
        .filter_map(|(a, edge)| {
            let inward = Vector2::new(-edge.y, edge.x) * area.signum();
            let normal = inward.try_normalize(0.0)?;
            Some((normal, normal.dot(&a.coords)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::doubled_area;
    use crate::scene::{CameraSource, View, Wall};

    fn tray(slope_deg: f64) -> Surface {
        let wall = Wall {
            height: 0.075,
            slope_deg,
        };
        Surface {
            wall: Some(wall),
            ..Surface::new([0.56, 0.37])
        }
    }

    fn no_lens(camera: &Camera) -> RadialDistortion {
        RadialDistortion::new(camera, 0.0)
    }

    fn camera() -> Camera {
        let eye = Point3::new(0.25, -0.9, 0.8);
        Camera::look_at(eye, Point3::origin(), 160.0, [160, 120])
    }

    /// Reference: whether the ray from a point in the room to the camera leaves the room through a
    /// wall, found by walking along the ray.
    fn is_hidden(point: Vector3<f64>, eye: Vector3<f64>, surface: &Surface) -> bool {
        let wall = surface.wall.unwrap();
        let slope = wall.slope_deg.to_radians().tan();
        let steps = (0..20_000).map(|i| point + (eye - point) * (f64::from(i) / 20_000.0));
        let mut inside = steps.take_while(|p| p.z <= wall.height);
        inside.any(|p| (0..2).any(|axis| p[axis].abs() > surface.size[axis] / 2.0 + slope * p.z))
    }

    #[test]
    fn what_a_ray_leaves_through_a_wall_is_hidden() {
        let (camera, mut hidden) = (camera(), 0);
        for slope in [0.0, 8.0] {
            let surface = tray(slope);
            let holdout = surface.holdout(&camera, &no_lens(&camera)).unwrap();
            for i in 0..1_000 {
                let share = |k: u32| f64::from(i * k % 1009) / 1009.0;
                let x = 0.55 * (share(97) - 0.5);
                let point = Vector3::new(x, -0.18 + 0.2 * share(31), 0.06 * share(7));
                let (px, depth) = camera.project(point.into()).unwrap();
                let at = holdout[(px.x as usize, px.y as usize)];
                let expected = is_hidden(point, camera.center().coords, &surface);
                // Pixels on the outline are partly covered.
                if at.coverage.0 == 0.0 || at.coverage.0 == 1.0 {
                    let found = at.coverage.0 == 1.0 && depth > f64::from(at.depth.0);
                    assert_eq!(found, expected, "{point} {at:?}");
                }
                hidden += usize::from(expected);
            }
        }
        assert!((100..1_900).contains(&hidden), "{hidden}");
    }

    #[test]
    fn coverage_adds_up_to_the_area_of_the_wall() {
        let (camera, surface) = (camera(), tray(0.0));
        let face = surface.wall.unwrap().inner_faces(surface.size)[2];
        let ring = seen_ring(&face, &camera);
        let area = doubled_area(&ring).abs() / 2.0;
        let holdout = surface
            .holdout(&camera, &RadialDistortion::new(&camera, 0.0))
            .unwrap();
        let covered: f32 = holdout.pixels().iter().map(|p| p.coverage.0).sum();
        assert!((f64::from(covered) / area - 1.0).abs() < 0.005);
    }

    #[test]
    fn a_zoom_shows_the_detail_of_a_larger_mask() {
        let photo = camera();
        let [width, height] = photo.image.map(|side| 4 * side as usize);
        // The zoomed view shows the columns 240 to 400.
        let mask = Image::from_fn(width, height, |x, _| Coverage(f32::from(x >= 300)));
        let view = View {
            zoom: 4.0,
            ..View::default()
        };
        let (known, surface) = (CameraSource::Known(photo), Surface::new([0.56, 0.37]));
        let scene = Scene {
            view,
            ..Scene::new(photo.image, known, surface)
        };
        let held = scene.holdout_of_mask(&photo, &mask);
        for x in (0..160).filter(|x| !(59..61).contains(x)) {
            assert_eq!(held[(x, 60)].coverage.0, f32::from(x > 60), "{x}");
        }
    }

    #[test]
    fn from_above_nothing_is_hidden_and_nothing_is_made() {
        let above = Camera::look_at(
            Point3::new(0.0, 0.0, 1.2),
            Point3::origin(),
            160.0,
            [160, 120],
        );
        assert!(tray(8.0).holdout(&above, &no_lens(&above)).is_none());
        assert!(
            Surface::new([0.56, 0.37])
                .holdout(&camera(), &no_lens(&camera()))
                .is_none()
        );
    }
}
