//! Pictures through a lens with distortion, compared with the explicit formula.

use super::definition::{HIGH, above, card, difference, pile, plate, same};
use crate::camera::Camera;
use crate::composite;
use crate::deep::DeepImage;
use crate::geom::{Point2, Point3, UnitQuaternion, Vector3, doubled_area};
use crate::image::Image;
use crate::label::{LabelOptions, label};
use crate::pixel::PremulRgba;
use crate::render::{RenderOptions, render, render_coverage, render_reference};
use crate::scene::{AreaLight, Shot};

/// A barrel and a pincushion distortion that move the corners of the pictures here by a tenth of
/// their radius.
const BARREL: f64 = -0.25;
const PINCUSHION: f64 = 0.25;

/// OpenCV's projection, from its documentation.
fn opencv_px(camera: &Camera, k1: f64, world: Point3<f64>) -> Point2<f64> {
    let seen = camera.camera_from_world * world;
    let (x, y) = (seen.x / seen.z, seen.y / seen.z);
    let growth = 1.0 + k1 * (x * x + y * y);
    Point2::new(
        camera.focal_px.x * x * growth + camera.principal_px.x,
        camera.focal_px.y * y * growth + camera.principal_px.y,
    )
}

fn opaque(size: [usize; 2]) -> Image<PremulRgba> {
    Image::filled(size[0], size[1], PremulRgba::new(0.5, 0.5, 0.5, 1.0))
}

/// Coverage of one object in every pixel.
fn coverage(deep: &DeepImage) -> Image<f64> {
    Image::from_fn(deep.width(), deep.height(), |x, y| {
        deep.at(x, y).iter().map(|s| f64::from(s.alpha)).sum()
    })
}

fn centroid(coverage: &Image<f64>) -> Point2<f64> {
    let (mut sum, mut at) = (0.0, Point2::origin());
    for y in 0..coverage.height() {
        for x in 0..coverage.width() {
            let share = coverage[(x, y)];
            sum += share;
            at += share * Point2::new(x as f64 + 0.5, y as f64 + 0.5).coords;
        }
    }
    Point2::from(at.coords / sum)
}

fn tilted() -> Camera {
    Camera {
        principal_px: Point2::new(90.0, 55.0),
        ..Camera::look_at(
            Point3::new(0.1, -0.5, 0.9),
            Point3::new(0.0, 0.0, 0.0),
            170.0,
            [180, 120],
        )
    }
}

#[test]
fn both_ways_agree_through_a_lens() {
    for k1 in [BARREL, PINCUSHION] {
        let shot = pile().with_k1(k1);
        let plate = plate(64, 48);
        let exact = composite::frame(&render_reference(&shot, &HIGH), Some(&plate));
        for (options, limit) in [(RenderOptions::default(), 0.008), (HIGH, 0.005)] {
            let fast = composite::frame(&render(&shot, &options), Some(&plate));
            let off = difference(&fast, &exact);
            assert!(off < limit, "{k1}: {options:?}: {off}");
        }
        let ideal = composite::frame(&render(&pile(), &HIGH), Some(&plate));
        assert!(difference(&ideal, &exact) > 0.02, "the lens does nothing");
    }
}

#[test]
fn world_points_are_where_the_formula_says() {
    for k1 in [BARREL, PINCUSHION] {
        for at in [
            [-0.3, 0.2, 0.0],
            [0.25, -0.15, 0.05],
            [0.0, 0.0, 0.02],
            [0.33, 0.2, 0.1],
        ] {
            let dot = card(
                1,
                at,
                UnitQuaternion::identity(),
                [0.02; 2],
                opaque([64, 64]),
            );
            let shot = Shot::new(tilted()).with_card(dot).with_k1(k1);
            let found = centroid(&coverage(&render(&shot, &HIGH)));
            let expected = opencv_px(&tilted(), k1, Point3::from(at));
            // A perspective dot is a little larger towards the camera.
            assert!((found - expected).norm() < 0.08, "{k1}: {found} {expected}");
        }
    }
}

#[test]
fn a_straight_edge_becomes_the_curve_of_the_formula() {
    // Its lower edge lies along x at y = -0.25, near the picture's lower end.
    let sheet = card(
        1,
        [0.0, 0.75, 0.0],
        UnitQuaternion::identity(),
        [4.0, 2.0],
        opaque([2048, 1024]),
    );
    for k1 in [BARREL, PINCUSHION] {
        let camera = above(160, 120, 160.0);
        let shot = Shot::new(camera).with_card(sheet.clone()).with_k1(k1);
        let found = coverage(&render(&shot, &HIGH));
        let curve: Vec<_> = (-1000..=1000)
            .map(|i| opencv_px(&camera, k1, Point3::new(f64::from(i) * 1e-3, -0.25, 0.0)))
            .collect();
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for x in 2..158 {
            let middle = x as f64 + 0.5;
            let nearest = |a: &&Point2<f64>, b: &&Point2<f64>| {
                (a.x - middle).abs().total_cmp(&(b.x - middle).abs())
            };
            let expected = curve.iter().min_by(nearest).unwrap().y;
            let rows: f64 = (0..120).map(|y| found[(x, y)]).sum();
            // 0.1 px is the contribution of the texture's own border and a step of the curve.
            assert!(
                (rows - expected).abs() < 0.1,
                "{k1}: {x}: {rows} {expected}"
            );
            (low, high) = (low.min(rows), high.max(rows));
        }
        assert!(high - low > 1.0, "{k1}: the edge is straight");
    }
}

#[test]
fn label_and_picture_agree() {
    for k1 in [BARREL, PINCUSHION] {
        let turned = UnitQuaternion::from_euler_angles(0.2, -0.1, 0.6);
        let mut sheet = card(
            1,
            [0.2, 0.12, 0.05],
            turned,
            [0.3, 0.15],
            opaque([256, 128]),
        );
        sheet.outline_uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(Point2::from)
            .into();
        let shot = Shot::new(tilted()).with_card(sheet.clone()).with_k1(k1);
        let deep = render_coverage(&shot, &HIGH);
        let labels = label(&deep, &shot, &LabelOptions::default());
        let object = &labels.objects[0];
        for corner in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            let world = sheet.quad.point(corner[0], corner[1]);
            let seen = opencv_px(&tilted(), k1, world);
            let mut points = object.outline_px.iter().flatten();
            assert!(
                points.any(|p| (p - seen).norm() < 1e-6),
                "{k1}: no corner at {seen}"
            );
        }
        // The area of the outline is the coverage, and the box of the mask that of the outline.
        let ring = &object.outline_px[0];
        let doubled = doubled_area(ring);
        let covered: f64 = coverage(&deep).pixels().iter().sum();
        assert!(
            (0.5 * doubled.abs() / covered - 1.0).abs() < 0.01,
            "{doubled} {covered}"
        );
        let most = ring.iter().fold(f64::MIN, |m, p| m.max(p.x));
        let least = ring.iter().fold(f64::MAX, |m, p| m.min(p.x));
        assert!((object.amodal_box.x1 - most).abs() <= 1.0, "{k1}: {most}");
        assert!((object.amodal_box.x0 - least).abs() <= 1.0, "{k1}: {least}");
    }
}

#[test]
fn depth_is_along_the_axis() {
    let sheet = card(
        1,
        [0.0, 0.0, 0.1],
        UnitQuaternion::identity(),
        [4.0, 4.0],
        opaque([8, 8]),
    );
    let shot = Shot::new(above(64, 48, 60.0))
        .with_card(sheet)
        .with_k1(BARREL);
    let deep = render(&shot, &RenderOptions::default());
    for (x, y) in [(0, 0), (63, 47), (31, 5)] {
        assert!((deep.at(x, y)[0].depth.0 - 0.9).abs() < 1e-6);
    }
}

#[test]
fn a_lens_that_bends_nothing_changes_no_bit() {
    let options = RenderOptions::default();
    let plain = render(&pile(), &options);
    assert!(same(&plain, &render(&pile().with_k1(0.0), &options)));
    // A distortion of a millionth of a pixel changes coverage by as little.
    let bent = render_coverage(&pile().with_k1(1e-9), &options);
    let [a, b] = [&plain, &bent].map(coverage);
    let pairs = a.pixels().iter().zip(b.pixels());
    let most = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    assert!(most < 1e-4, "{most}");
}

#[test]
fn shadows_are_bent_with_what_they_fall_on() {
    let lamp = AreaLight::new([0.0, 0.0, 3.0], [0.01; 2], 10.0);
    let at = Vector3::new(0.3, 0.2, 0.0);
    // Just above the surface: the shadow is where the card is, and seen through it.
    let half = Image::filled(64, 64, PremulRgba::new(0.2, 0.2, 0.2, 0.5));
    let dot = card(
        1,
        [at.x, at.y, 1e-3],
        UnitQuaternion::identity(),
        [0.06; 2],
        half,
    );
    let shot = Shot::new(above(160, 120, 170.0))
        .with_card(dot)
        .with_light(lamp);
    for k1 in [BARREL, PINCUSHION] {
        let deep = render(&shot.clone().with_k1(k1), &HIGH);
        let lost = Image::from_fn(160, 120, |x, y| f64::from(1.0 - deep.shadow()[(x, y)].g));
        let expected = opencv_px(&shot.camera, k1, Point3::from(at));
        let found = centroid(&lost);
        assert!((found - expected).norm() < 0.3, "{k1}: {found} {expected}");
    }
}
