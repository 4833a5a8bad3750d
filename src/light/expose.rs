//! The exposure that puts rendered light and a photographed plate on one scale.

use crate::geom::{Point2, Point3, Vector3};
use crate::image::Image;
use crate::light::irradiance;
use crate::pixel::LinearRgb;
use crate::scene::{CameraSource, Exposure, Scene};
use std::f64::consts::PI;

/// Share of the surface's pixels that are darker than what counts as the plate's white.
///
/// High, since white is the bright end; not the maximum, since a highlight or a dead pixel is not paper.
const WHITE_PERCENTILE: f64 = 0.95;

/// Turns [`Exposure::MatchPlate`] into [`Exposure::Ev`]; a scene whose exposure is known comes back as it is.
///
/// A matte white card (albedo 1) in the middle of the surface, under the scene's lights with nothing in their way, gets
/// the luminance of [`plate_white`], times `2^gain_ev`.
///
/// This is an assumption, not a measurement: one photograph does not tell how white its brightest part is. On a plate
/// whose surface is grey the cards come out too dark by that grey; `gain_ev` is there to say so. Without any light in
/// the scene, or on a black plate, the exposure is `gain_ev` alone.
pub fn expose(scene: Scene, plate: &Image<LinearRgb>) -> Scene {
    let Exposure::MatchPlate { gain_ev } = scene.exposure else { return scene };
    let white = f64::from(plate_white(plate, surface_px(&scene, plate)));
    let card = f64::from(white_card(&scene));
    let ratio = white / card;
    let match_ev = if ratio > 0.0 && ratio.is_finite() { libm::log2(ratio) } else { 0.0 };
    Scene { exposure: Exposure::Ev(match_ev + gain_ev), ..scene }
}

/// Luminance of the plate's white: the 95th percentile inside a convex polygon of pixel positions.
///
/// Pixels that are not finite do not count; a polygon without a pixel stands for the whole plate; 0 for an empty plate.
pub fn plate_white(plate: &Image<LinearRgb>, polygon_px: [Point2<f64>; 4]) -> f32 {
    let inside = luminances(plate, |p| contains(&polygon_px, p));
    let mut values = if inside.is_empty() { luminances(plate, |_| true) } else { inside };
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * WHITE_PERCENTILE).round() as usize;
    *values.select_nth_unstable_by(rank, f32::total_cmp).1
}

/// Luminance of a white card in the middle of the surface.
fn white_card(scene: &Scene) -> f32 {
    let at_center = |light| irradiance(light, Point3::origin(), Vector3::z()).luminance();
    scene.lights.iter().map(at_center).sum::<f32>() / PI as f32 + scene.ambient.luminance()
}

/// The surface's corners in pixels of `plate`; the whole plate where the camera does not see all of them.
fn surface_px(scene: &Scene, plate: &Image<LinearRgb>) -> [Point2<f64>; 4] {
    let (w, h) = (plate.width() as f64, plate.height() as f64);
    let whole = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(Point2::from);
    match &scene.camera {
        CameraSource::Rectangle { corners_px, photo, .. } => {
            corners_px.map(|[x, y]| Point2::new(x * w / f64::from(photo[0]), y * h / f64::from(photo[1])))
        }
        CameraSource::Known(camera) => {
            let camera = camera.resized([plate.width() as u32, plate.height() as u32]);
            let [a, b] = scene.surface.size.map(|s| 0.5 * s);
            let seen = [[-a, b], [a, b], [a, -b], [-a, -b]].map(|[x, y]| camera.project(Point3::new(x, y, 0.0)));
            if seen.iter().all(Option::is_some) {
                seen.map(|c| c.map_or(Point2::origin(), |(px, _)| px))
            } else {
                whole
            }
        }
    }
}

fn luminances(plate: &Image<LinearRgb>, keep: impl Fn(Point2<f64>) -> bool) -> Vec<f32> {
    let rows = plate.rows().enumerate();
    let pixels = rows.flat_map(|(y, row)| row.iter().enumerate().map(move |(x, c)| (x, y, c)));
    let kept = pixels.filter(|&(x, y, c)| c.is_finite() && keep(Point2::new(x as f64 + 0.5, y as f64 + 0.5)));
    kept.map(|(_, _, c)| c.luminance()).collect()
}

/// Is a point on the same side of all edges?
fn contains(polygon: &[Point2<f64>; 4], p: Point2<f64>) -> bool {
    let side = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % 4]);
        (b - a).perp(&(p - a))
    };
    let sides = [side(0), side(1), side(2), side(3)];
    sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::area::tests::square;
    use crate::scene::Surface;

    fn scene(exposure: Exposure) -> Scene {
        Scene {
            image: [40, 30],
            plate: "tray".into(),
            camera: CameraSource::Rectangle {
                corners_px: [[20.0, 20.0], [60.0, 20.0], [60.0, 40.0], [20.0, 40.0]],
                photo: [80, 60],
                focal_px: None,
            },
            surface: Surface { size: [0.4, 0.3] },
            objects: Vec::new(),
            lights: vec![square()],
            ambient: LinearRgb::grey(0.1),
            exposure,
        }
    }

    /// 0.5 inside the surface, 4 outside of it.
    fn plate() -> Image<LinearRgb> {
        let inside = |x, y| (10..30).contains(&x) && (10..20).contains(&y);
        Image::from_fn(40, 30, |x, y| LinearRgb::grey(if inside(x, y) { 0.5 } else { 4.0 }))
    }

    #[test]
    fn a_known_exposure_stays() {
        let known = scene(Exposure::Ev(1.5));
        assert_eq!(expose(known.clone(), &plate()), known);
    }

    #[test]
    fn a_white_card_gets_the_surface_s_white() {
        let Exposure::Ev(ev) = expose(scene(Exposure::MatchPlate { gain_ev: 1.0 }), &plate()).exposure else {
            panic!("still unknown")
        };
        let card = 2.975061 / PI + 0.1;
        assert!((card * libm::exp2(ev) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn exposing_twice_changes_nothing() {
        let once = expose(scene(Exposure::MatchPlate { gain_ev: 0.0 }), &plate());
        assert_eq!(expose(once.clone(), &plate()), once);
    }

    #[test]
    fn darkness_and_broken_pixels_leave_the_gain_alone() {
        let dark =
            Scene { lights: Vec::new(), ambient: LinearRgb::BLACK, ..scene(Exposure::MatchPlate { gain_ev: 0.5 }) };
        assert_eq!(expose(dark, &plate()).exposure, Exposure::Ev(0.5));
        let broken = Image::filled(40, 30, LinearRgb::grey(f32::NAN));
        assert_eq!(expose(scene(Exposure::MatchPlate { gain_ev: 0.5 }), &broken).exposure, Exposure::Ev(0.5));
    }
}
