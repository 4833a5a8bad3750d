//! The colour of the light on the labelled surface, from the plate.

use crate::camera::{Camera, RadialDistortion};
use crate::color::Albedo;
use crate::geom::{Plane, Point2, Point3};
use crate::image::Image;
use crate::light::MeasuredPlate;
use crate::pixel::LinearRgb;
use crate::quantile::median;
use crate::scene::{CameraSource, LightTint, Scene};

/// Columns and rows of the cells that the surface is looked at in: lamps make gradients, and a
/// pattern on the surface should not be taken for light.
pub(super) const CELLS: [usize; 2] = [5, 4];

/// What a plate shows of a scene's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceLight {
    /// The median colour, channel by channel.
    pub(super) color: LinearRgb,
    /// The median luminance.
    pub(super) luminance: f32,
    /// The same of each cell, the upper row first; none of one that is not seen.
    pub(super) cells: [Option<f32>; CELLS[0] * CELLS[1]],
}

/// Measures the part of a plate that the scene's labelled rectangle fills; none where the camera is
/// not known yet, or does not see it.
pub(super) fn surface_light(scene: &Scene, plate: &Image<LinearRgb>) -> Option<SurfaceLight> {
    let seen = seen_surface(scene, plate);
    Some(SurfaceLight {
        color: LinearRgb::new(
            median_of(&seen, |c| c.r)?,
            median_of(&seen, |c| c.g)?,
            median_of(&seen, |c| c.b)?,
        ),
        luminance: median_of(&seen, |c| c.luminance())?,
        cells: cell_medians(&seen, scene.surface.size),
    })
}

fn cell_medians(
    seen: &[(Point3<f64>, LinearRgb)],
    size: [f64; 2],
) -> [Option<f32>; CELLS[0] * CELLS[1]] {
    let mut luminances: [Vec<f32>; CELLS[0] * CELLS[1]] = Default::default();
    for (point, color) in seen {
        luminances[cell_of(point, size)].push(color.luminance());
    }
    luminances.map(|cell| median(cell.into_iter(), f32::total_cmp))
}

/// The points of a scene's surface that the plate shows, and their colours where those are finite;
/// none where the camera is not known yet, or does not see it.
fn seen_surface(scene: &Scene, plate: &Image<LinearRgb>) -> Vec<(Point3<f64>, LinearRgb)> {
    let CameraSource::Known(camera) = scene.camera else {
        return Vec::new();
    };
    let lens = scene.lens.distortion_of_plate(&camera);
    let places = (0..plate.height()).flat_map(|y| (0..plate.width()).map(move |x| (x, y)));
    places
        .filter_map(|(x, y)| Some((surface_point((&camera, &lens), x, y)?, plate[(x, y)])))
        .filter(|(point, color)| is_on_surface(point, scene.surface.size) && color.is_finite())
        .collect()
}

/// The number of the cell that a point of the surface lies in.
fn cell_of(point: &Point3<f64>, [w, h]: [f64; 2]) -> usize {
    let [u, v] = [point.x / w + 0.5, 0.5 - point.y / h];
    let [column, row] = [(u, CELLS[0]), (v, CELLS[1])]
        .map(|(place, cells)| ((place * cells as f64) as usize).min(cells - 1));
    row * CELLS[0] + column
}

fn is_on_surface(point: &Point3<f64>, [w, h]: [f64; 2]) -> bool {
    point.x.abs() <= 0.5 * w && point.y.abs() <= 0.5 * h
}

/// The point of the plane `z = 0` that a pixel shows.
fn surface_point(
    (camera, lens): (&Camera, &RadialDistortion),
    x: usize,
    y: usize,
) -> Option<Point3<f64>> {
    let px = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
    let ray = camera.ray(lens.undistort(px));
    Plane::surface().intersect(&ray).map(|t| ray.at(t))
}

/// The median of a channel.
fn median_of(
    seen: &[(Point3<f64>, LinearRgb)],
    channel: impl Fn(&LinearRgb) -> f32,
) -> Option<f32> {
    median(seen.iter().map(|(_, color)| channel(color)), f32::total_cmp)
}

/// Turns [`LightTint::MatchSurface`] into the colour of the surface's light; any other scene is
/// returned unchanged.
///
/// The colour of the surface beyond its own albedo is the colour of the light on it. Where that albedo
/// is not known the surface counts as grey, and a share below 1 takes only a part, since trays and
/// tables may have a colour of their own. Luminance is unchanged.
pub fn match_light_tint<'a>(scene: Scene, plate: impl Into<MeasuredPlate<'a>>) -> Scene {
    let LightTint::MatchSurface { share, albedo } = scene.cast else {
        return scene;
    };
    let surface = plate.into().surface(&scene).map(|light| light.color);
    let white = Albedo::Color(albedo).white_beside(surface.unwrap_or(LinearRgb::BLACK));
    let tint = tint_of(white, share);
    Scene {
        cast: LightTint::Known(tint.scale(1.0 / tint.luminance())),
        ..scene
    }
}

/// A share, as an exponent, of a colour's ratio to grey; white for a colour without some channel.
fn tint_of(color: LinearRgb, share: f64) -> LinearRgb {
    let luminance = color.luminance();
    if color.r > 0.0 && color.g > 0.0 && color.b > 0.0 {
        color.map(|v| libm::pow(f64::from(v / luminance), share) as f32)
    } else {
        LinearRgb::WHITE
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::scene::{Exposure, Surface};

    /// A camera one metre above a surface that fills the middle half of its picture.
    pub(in crate::light) fn scene(cast: LightTint) -> Scene {
        let camera = Camera::looking_down(1.0, 40.0, [40, 30]);
        Scene {
            plate: "tray".into(),
            ambient: LinearRgb::WHITE,
            exposure: Exposure::Ev(0.0),
            cast,
            ..Scene::new(
                [40, 30],
                CameraSource::Known(camera),
                Surface::new([0.5, 0.375]),
            )
        }
    }

    /// A reddish surface with a bright spot on a blue table.
    fn plate() -> Image<LinearRgb> {
        Image::from_fn(40, 30, |x, y| match (x, y) {
            (18..22, 14..16) => LinearRgb::grey(5.0),
            (10..30, 7..23) => LinearRgb::new(0.4, 0.2, 0.1),
            _ => LinearRgb::new(0.0, 0.1, 0.9),
        })
    }

    #[test]
    fn the_surface_is_separated_from_the_table_and_from_highlights() {
        assert_eq!(
            surface_light(&scene(LightTint::default()), &plate())
                .unwrap()
                .color,
            LinearRgb::new(0.4, 0.2, 0.1)
        );
    }

    fn taken(share: f64) -> LightTint {
        LightTint::MatchSurface {
            share,
            albedo: LinearRgb::WHITE,
        }
    }

    #[test]
    fn the_tint_is_the_surface_s_colour_at_luminance_one() {
        let LightTint::Known(tint) = match_light_tint(scene(taken(1.0)), &plate()).cast else {
            panic!("still unknown")
        };
        assert!((tint.luminance() - 1.0).abs() < 1e-6 && (tint.r / tint.g - 2.0).abs() < 1e-5);
        let none = match_light_tint(scene(taken(0.0)), &plate()).cast;
        assert_eq!(none, LightTint::Known(LinearRgb::WHITE));
        let known = scene(LightTint::Known(LinearRgb::new(2.0, 1.0, 0.5)));
        assert_eq!(match_light_tint(known.clone(), &plate()), known);
    }

    #[test]
    fn light_on_a_surface_of_known_colour_has_its_own() {
        let albedo = LinearRgb::new(0.8, 0.2, 0.05);
        let cast = LightTint::MatchSurface { share: 1.0, albedo };
        let LightTint::Known(tint) = match_light_tint(scene(cast), &plate()).cast else {
            panic!("still unknown")
        };
        // The surface is seen as (0.4, 0.2, 0.1), so the light is (0.5, 1, 2) of white.
        assert!((tint.r / tint.g - 0.5).abs() < 1e-5 && (tint.b / tint.g - 2.0).abs() < 1e-5);
    }

    #[test]
    fn a_black_plate_has_no_tint() {
        let black = match_light_tint(scene(taken(1.0)), &Image::filled(40, 30, LinearRgb::BLACK));
        assert_eq!(black.cast, LightTint::Known(LinearRgb::WHITE));
    }
}
