//! The exposure that puts rendered light and a photographed plate on one scale.

use crate::color::Albedo;
use crate::geom::Point3;
use crate::image::Image;
use crate::light::irradiance::white_card_at;
use crate::light::lamp::match_lamp;
use crate::light::light_map::match_light_map;
use crate::light::{MeasuredPlate, match_light_tint};
use crate::pixel::LinearRgb;
use crate::scene::{EnvironmentMap, Exposure, Scene};

/// Share of the plate's pixels that are darker than its white.
///
/// High, since white is the bright end; not the maximum, since a highlight or a dead pixel is not
/// paper.
const WHITE_PERCENTILE: f64 = 0.99;

/// Estimates what a scene leaves to its plate: the position of its light, the colour of the light,
/// how it is spread, the exposure, the blur, the noise.
///
/// `environment` is the map that the scene names. A scene that leaves nothing is returned unchanged.
pub fn match_plate<'a>(
    scene: Scene,
    plate: impl Into<MeasuredPlate<'a>>,
    environment: Option<&EnvironmentMap>,
) -> Scene {
    let plate = plate.into();
    let tinted = match_light_tint(match_lamp(scene, plate, environment), plate);
    let lit = match_light_map(tinted, plate, environment);
    plate.grained(expose(lit, plate, environment))
}

/// Turns [`Exposure::MatchPlate`] and [`Exposure::MatchSurface`] into [`Exposure::Ev`]; a scene
/// whose exposure is known is returned unchanged.
///
/// A matte white card (albedo 1) in the middle of the surface, under the scene's lights and its
/// environment map with nothing in the way, gets the luminance of `plate_white`, times `2^gain_ev`.
///
/// This is an assumption, not a measurement: one photograph does not show which of its pixels are
/// white paper. It holds where the photo was exposed for the place and shows something bright; the
/// surface itself is not used, since a tray may be of any grey. Where that grey is known,
/// `MatchSurface` is the better choice. `gain_ev` overrides. Without any light in the scene, or on
/// a black plate, the exposure is `gain_ev` alone.
pub fn expose<'a>(
    scene: Scene,
    plate: impl Into<MeasuredPlate<'a>>,
    environment: Option<&EnvironmentMap>,
) -> Scene {
    let plate = plate.into();
    let (wanted, gain_ev) = match scene.exposure {
        Exposure::Ev(_) => return scene,
        Exposure::MatchPlate { gain_ev } => (f64::from(plate.white()), gain_ev),
        Exposure::MatchSurface { albedo, gain_ev } => {
            (luminance_of_white(&scene, &plate, albedo), gain_ev)
        }
    };
    let card = white_card_at(&scene, environment, Point3::origin());
    let match_ev = stops_of(wanted / f64::from(card));
    Scene {
        exposure: Exposure::Ev(match_ev + gain_ev),
        ..scene
    }
}

/// Luminance of white paper beside the surface in the plate; 0 where that is not seen.
fn luminance_of_white(scene: &Scene, plate: &MeasuredPlate<'_>, albedo: Albedo) -> f64 {
    let surface = plate.surface(scene).map(|light| light.color);
    let white = albedo.white_beside(surface.unwrap_or_default());
    f64::from(white.luminance())
}

/// A ratio of luminances in stops; 0 for one that cannot be.
fn stops_of(ratio: f64) -> f64 {
    if ratio > 0.0 && ratio.is_finite() {
        libm::log2(ratio)
    } else {
        0.0
    }
}

/// Luminance of the plate's white: the 99th percentile over all pixels.
///
/// Pixels that are not finite are left out; 0 for a plate without any other.
pub(super) fn plate_white(plate: &Image<LinearRgb>) -> f32 {
    let finite = plate.pixels().iter().filter(|c| c.is_finite());
    let mut luminances: Vec<f32> = finite.map(|c| c.luminance()).collect();
    if luminances.is_empty() {
        return 0.0;
    }
    let rank = ((luminances.len() - 1) as f64 * WHITE_PERCENTILE).round() as usize;
    *luminances.select_nth_unstable_by(rank, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::Panorama;
    use crate::light::area::tests::square;
    use crate::scene::{CameraSource, LightTint, Surface};
    use std::f64::consts::PI;
    use std::sync::Arc;

    fn scene(exposure: Exposure) -> Scene {
        Scene {
            plate: "tray".into(),
            lights: vec![square()],
            ambient: LinearRgb::grey(0.1),
            exposure,
            ..Scene::new(
                [40, 30],
                CameraSource::Rectangle {
                    corners_px: [[20.0, 20.0], [60.0, 20.0], [60.0, 40.0], [20.0, 40.0]],
                    photo: [80, 60],
                    focal_px: None,
                },
                Surface::new([0.4, 0.3]),
            )
        }
    }

    fn exposed_ev(scene: Scene, plate: &Image<LinearRgb>) -> f64 {
        let Exposure::Ev(ev) = expose(scene, plate, None).exposure else {
            panic!("still unknown")
        };
        ev
    }

    /// Grey 0.2, a fiftieth of it paper of 0.5, one highlight of 40.
    fn plate() -> Image<LinearRgb> {
        let value = |i: usize| {
            if i == 7 {
                40.0
            } else if i.is_multiple_of(50) {
                0.5
            } else {
                0.2
            }
        };
        Image::from_fn(40, 30, |x, y| LinearRgb::grey(value(40 * y + x)))
    }

    #[test]
    fn a_known_exposure_stays() {
        let known = scene(Exposure::Ev(1.5));
        assert_eq!(expose(known.clone(), &plate(), None), known);
    }

    #[test]
    fn a_white_card_gets_the_plate_s_white() {
        let ev = exposed_ev(scene(Exposure::MatchPlate { gain_ev: 1.0 }), &plate());
        let card = 2.975061 / PI + 0.1;
        assert!((card * libm::exp2(ev) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_tint_of_the_light_is_not_darkness() {
        let matched = |tint: LightTint| {
            let cast = Scene {
                cast: tint,
                ..scene(Exposure::MatchPlate { gain_ev: 0.0 })
            };
            exposed_ev(cast, &plate())
        };
        let white = matched(LightTint::Known(LinearRgb::WHITE));
        let dark = matched(LightTint::Known(LinearRgb::grey(0.25)));
        assert!((dark - white - 2.0).abs() < 1e-5, "{white} {dark}");
    }

    #[test]
    fn an_environment_map_counts_as_the_light_that_it_is() {
        let map = |strength: f32| EnvironmentMap {
            strength,
            ..EnvironmentMap::new(Arc::new(
                Panorama::new(Image::filled(64, 32, LinearRgb::grey(2.0))).unwrap(),
            ))
        };
        let exposed = |scene: Scene, environment: Option<&EnvironmentMap>| {
            expose(scene, &plate(), environment).exposure
        };
        let lit = scene(Exposure::MatchPlate { gain_ev: 0.0 });
        let within = Scene {
            // As bright from everywhere as the map.
            ambient: lit.ambient + LinearRgb::grey(3.0),
            ..lit.clone()
        };
        let [Exposure::Ev(by_map), Exposure::Ev(by_ambient)] =
            [exposed(lit, Some(&map(1.5))), exposed(within, None)]
        else {
            panic!("still unknown")
        };
        // The picture of the map has cells.
        assert!((by_map - by_ambient).abs() < 1e-3, "{by_map} {by_ambient}");
    }

    #[test]
    fn a_card_as_grey_as_the_surface_gets_the_surface_s_brightness() {
        let plate = Image::filled(40, 30, LinearRgb::grey(0.3));
        let exposure = Exposure::MatchSurface {
            albedo: Albedo::Luminance(0.5),
            gain_ev: 0.0,
        };
        let scene = Scene {
            lights: Vec::new(),
            ambient: LinearRgb::grey(0.2),
            exposure,
            ..crate::light::surface::tests::scene(Default::default())
        };
        let ev = exposed_ev(scene, &plate);
        assert!((0.2 * 0.5 * libm::exp2(ev) - 0.3).abs() < 1e-6);
    }

    #[test]
    fn exposing_twice_changes_nothing() {
        let once = expose(scene(Exposure::MatchPlate { gain_ev: 0.0 }), &plate(), None);
        assert_eq!(expose(once.clone(), &plate(), None), once);
    }

    #[test]
    fn darkness_and_broken_pixels_leave_the_gain_alone() {
        let dark = Scene {
            lights: Vec::new(),
            ambient: LinearRgb::BLACK,
            ..scene(Exposure::MatchPlate { gain_ev: 0.5 })
        };
        assert_eq!(expose(dark, &plate(), None).exposure, Exposure::Ev(0.5));
        let broken = Image::filled(40, 30, LinearRgb::grey(f32::NAN));
        assert_eq!(
            expose(scene(Exposure::MatchPlate { gain_ev: 0.5 }), &broken, None).exposure,
            Exposure::Ev(0.5)
        );
    }
}
