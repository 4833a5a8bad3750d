//! How light is spread over the labelled surface, from the plate.

use crate::geom::Point3;
use crate::light::MeasuredPlate;
use crate::light::irradiance::white_card_at;
use crate::light::surface::{CELLS, SurfaceLight};
use crate::scene::{EnvironmentMap, LightMap, Scene};

/// What is darker or brighter by more is no gradient of light.
const MOST: f32 = 4.0;

/// Turns [`LightMap::MatchSurface`] into factors; any other scene comes back as it is.
///
/// # Method
/// The median luminance of the plate in each cell of the surface over that of all of it, divided by
/// what the scene's own light gives there over what it gives in its middle. Cells that are not
/// seen have 1, and so has everything where the camera does not see the surface. It takes the
/// surface for one of the same colour all over: its patterns pass for light where they fill half a
/// cell.
pub(super) fn match_light_map(
    scene: Scene,
    plate: MeasuredPlate<'_>,
    environment: Option<&EnvironmentMap>,
) -> Scene {
    let LightMap::MatchSurface { share } = scene.light_map else {
        return scene;
    };
    let (surface, size) = (plate.surface(&scene), scene.surface.size);
    let own = |point| white_card_at(&scene, environment, point);
    let map = surface.and_then(|surface| factors(&surface, size, own, share));
    Scene {
        light_map: LightMap::Known(map.unwrap_or_default()),
        ..scene
    }
}

/// Factors where the scene's own lights make a white card as bright as `own` says; none where nothing
/// is seen but darkness.
fn factors(
    surface: &SurfaceLight,
    size: [f64; 2],
    own: impl Fn(Point3<f64>) -> f32,
    share: f64,
) -> Option<Vec<Vec<f32>>> {
    let middle = own(Point3::origin());
    let cells = cell_middles(size).zip(surface.cells);
    let factors = cells.map(|(point, cell)| {
        let plate = cell.map_or(1.0, |here| here / surface.luminance);
        factor(plate, own(point) / middle, share)
    });
    let factors: Vec<f32> = factors.collect();
    let rows = factors.chunks(CELLS[0]).map(<[f32]>::to_vec);
    (surface.luminance > 0.0).then(|| rows.collect())
}

/// What is missing from the scene's own light to that of the plate.
fn factor(plate: f32, own: f32, share: f64) -> f32 {
    let missing = plate / own;
    if !missing.is_finite() {
        return 1.0;
    }
    libm::pow(f64::from(missing.clamp(1.0 / MOST, MOST)), share) as f32
}

/// The middles of the cells, in order.
fn cell_middles([w, h]: [f64; 2]) -> impl Iterator<Item = Point3<f64>> {
    (0..CELLS[0] * CELLS[1]).map(move |i| {
        let (column, row) = (i % CELLS[0], i / CELLS[0]);
        let u = (column as f64 + 0.5) / CELLS[0] as f64;
        let v = (row as f64 + 0.5) / CELLS[1] as f64;
        Point3::new((u - 0.5) * w, (0.5 - v) * h, 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::Panorama;
    use crate::image::Image;
    use crate::pixel::LinearRgb;
    use crate::scene::{AreaLight, LightShape};
    use std::sync::Arc;

    fn scene() -> Scene {
        Scene {
            light_map: LightMap::MatchSurface { share: 1.0 },
            ..crate::light::surface::tests::scene(Default::default())
        }
    }

    fn rows(scene: Scene, plate: &Image<LinearRgb>) -> Vec<Vec<f32>> {
        let LightMap::Known(rows) = match_light_map(scene, plate.into(), None).light_map else {
            panic!("still unknown")
        };
        rows
    }

    /// The surface fills columns 10 to 30 and rows 7 to 23 or so.
    fn gradient() -> Image<LinearRgb> {
        Image::from_fn(40, 30, |x, _| LinearRgb::grey(0.01 * (x as f32 + 0.5)))
    }

    #[test]
    fn a_gradient_across_the_plate_is_found() {
        let rows = rows(scene(), &gradient());
        assert_eq!((rows.len(), rows[0].len()), (4, 5));
        for row in rows {
            for (column, factor) in row.iter().enumerate() {
                // Cells are 4 pixels wide.
                let brightness = 12.0 + 4.0 * column as f32;
                assert!(
                    (factor - brightness / 20.0).abs() < 0.06,
                    "{column}: {factor}"
                );
            }
        }
    }

    #[test]
    fn an_even_surface_a_dark_one_and_one_that_is_not_seen_have_no_gradient() {
        let even = rows(scene(), &Image::filled(40, 30, LinearRgb::grey(0.3)));
        assert!(even.iter().flatten().all(|factor| *factor == 1.0));
        let dark = rows(scene(), &Image::filled(40, 30, LinearRgb::BLACK));
        assert!(dark.is_empty());
    }

    #[test]
    fn a_scene_lit_by_its_map_alone_takes_the_gradient_of_the_plate() {
        let map = Panorama::new(Image::filled(8, 4, LinearRgb::WHITE)).unwrap();
        let dark = Scene {
            lights: Vec::new(),
            ambient: LinearRgb::BLACK,
            ..scene()
        };
        let environment = EnvironmentMap::new(Arc::new(map));
        let lit = match_light_map(dark, (&gradient()).into(), Some(&environment));
        assert_eq!(lit.light_map, LightMap::Known(rows(scene(), &gradient())));
    }

    /// A lamp of the scene that makes the gradient of the plate needs no factor.
    #[test]
    fn what_the_scene_s_own_lights_do_is_not_done_twice() {
        let lamp = AreaLight {
            shape: LightShape::Ellipse,
            ..AreaLight::new([0.3, 0.0, 0.3], [0.02; 2], 10.0)
        };
        let lit = Scene {
            lights: vec![lamp],
            ambient: LinearRgb::BLACK,
            ..scene()
        };
        let middle = white_card_at(&lit, None, Point3::origin());
        // The camera looks from a metre above with a focal length of 40 pixels, y up.
        let plate = Image::from_fn(40, 30, |x, y| {
            let [x, y] = [x as f64 + 0.5 - 20.0, 15.0 - y as f64 - 0.5].map(|px| px / 40.0);
            LinearRgb::grey(white_card_at(&lit, None, Point3::new(x, y, 0.0)) / middle)
        });
        let factors = rows(lit, &plate).concat();
        let (least, most) = (
            factors.iter().copied().fold(f32::MAX, f32::min),
            factors.iter().copied().fold(0.0, f32::max),
        );
        // The median is not the middle; what is left is one factor for all.
        assert!(most / least < 1.15, "{factors:?}");
    }
}
