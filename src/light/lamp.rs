//! Where a lamp stands, from the walls of the surface in the plate.

use crate::camera::Camera;
use crate::geom::{Point3, Vector3};
use crate::image::Image;
use crate::light::MeasuredPlate;
use crate::light::irradiance::irradiance;
use crate::pixel::{LinearRgb, Mix};
use crate::quantile::median;
use crate::scene::{AreaLight, CameraSource, EnvironmentMap, LightDirection, Scene};
use std::f64::consts::{PI, TAU};

/// Places on a wall that are looked at: shares of its length and of its height, away from corners,
/// floor and rim.
const ALONG: [usize; 2] = [40, 6];
const LENGTH_SHARES: [f64; 2] = [0.15, 0.85];
const HEIGHT_SHARES: [f64; 2] = [0.25, 0.8];
/// Least share of these places that the plate must show.
const SEEN_SHARE: f64 = 0.5;
/// Fewer walls do not tell a direction.
const FEWEST_WALLS: usize = 3;
/// Directions that are tried: about the vertical, and tangents of the tilt from it.
const AZIMUTHS: usize = 72;
const TILT_TANGENTS: [f64; 10] = [0.15, 0.2, 0.27, 0.37, 0.5, 0.68, 0.92, 1.25, 1.7, 2.3];
/// Shares of the light from all around that reach a wall, with what the other walls reflect.
const WALL_SHARES: [f64; 5] = [0.3, 0.45, 0.6, 0.75, 0.9];
/// How far the brightness of a wall is from the model, over that of the floor. Over 18 photos of
/// three trays whose lamps were known the estimate is then as good as it says.
const MODEL_ERROR: f64 = 0.12;

/// Turns [`LightDirection::MatchWalls`] into a place of the scene's first light and a radiance all
/// around; any other scene comes back as it is, and so does one without a light, without walls, or
/// whose plate shows fewer than three of them: its light stands where it was drawn.
///
/// # Method
/// Photometric stereo with the surface itself: floor and walls are of one material, so that their
/// brightness is their irradiance: `A` on the floor and a share of it on the walls, from all around,
/// and `L max(0, n . d)` from a distant lamp. Of all directions and shares each gets the two
/// strengths that fit best, and a weight by what is left; azimuth, tilt and strength are the weighted
/// means, and their spread is the error. On photos of three trays (`docs/accuracy.md`) the azimuth
/// was off by 7 degrees as a rule and by 25 at most.
pub(super) fn match_lamp(
    scene: Scene,
    plate: MeasuredPlate<'_>,
    environment: Option<&EnvironmentMap>,
) -> Scene {
    let LightDirection::MatchWalls { deviations } = scene.light_direction else {
        return scene;
    };
    let estimate = LampEstimate::from_plate(&scene, &plate);
    let lit = match (estimate, &scene.lights[..]) {
        (Some(estimate), [first, others @ ..]) => {
            let moved = estimate.moved(first, deviations);
            let lights = [&[moved], others].concat();
            Scene {
                ambient: estimate.ambient(&lights, environment),
                lights,
                ..scene
            }
        }
        _ => scene,
    };
    Scene {
        light_direction: LightDirection::Known,
        ..lit
    }
}

/// What the walls tell of a lamp.
#[derive(Clone, Copy, Debug)]
struct LampEstimate {
    /// Radians from the surface's width towards its height, and their standard error.
    azimuth: [f64; 2],
    /// Natural logarithm of the tangent of the tilt from the vertical, and its standard error.
    log_tilt: [f64; 2],
    /// Share of the floor's light that comes from the lamp.
    share: f64,
}

/// A plane of the surface as the plate shows it.
struct SeenFace {
    normal: Vector3<f64>,
    /// Over that of the floor.
    brightness: f64,
}

impl LampEstimate {
    fn from_plate(scene: &Scene, plate: &MeasuredPlate<'_>) -> Option<Self> {
        let CameraSource::Known(camera) = &scene.camera else {
            return None;
        };
        let floor = f64::from(plate.surface(scene)?.color.luminance());
        let wall = scene.surface.wall?;
        let faces = wall.inner_faces(scene.surface.size);
        let seen = faces
            .iter()
            .filter_map(|face| seen_face(face, (scene, camera), plate.image, floor));
        let seen: Vec<SeenFace> = seen.collect();
        (floor > 0.0 && seen.len() >= FEWEST_WALLS).then(|| Self::from_faces(&seen))
    }

    fn from_faces(faces: &[SeenFace]) -> Self {
        let fits: Vec<LampFit> = hypotheses().map(|h| h.fit(faces)).collect();
        let least = fits
            .iter()
            .map(|fit| fit.squares)
            .fold(f64::INFINITY, f64::min);
        let weight = |fit: &LampFit| libm::exp((least - fit.squares) / (2.0 * MODEL_ERROR.powi(2)));
        let mean = |value: &dyn Fn(&LampFit) -> f64| {
            let weighted = fits.iter().map(|fit| weight(fit) * value(fit));
            weighted.sum::<f64>() / fits.iter().map(weight).sum::<f64>()
        };
        let log_tilt = mean(&|fit| libm::log(fit.tangent));
        let tilt_variance = mean(&|fit| (libm::log(fit.tangent) - log_tilt).powi(2));
        let [x, y] = [
            mean(&|fit| libm::cos(fit.azimuth)),
            mean(&|fit| libm::sin(fit.azimuth)),
        ];
        Self {
            azimuth: [libm::atan2(y, x), circular_deviation(libm::hypot(x, y))],
            log_tilt: [log_tilt, tilt_variance.sqrt()],
            share: mean(&|fit| fit.share),
        }
    }

    /// A light at its own height where the estimate says, or so many standard errors beside it.
    fn moved(&self, light: &AreaLight, [turn, tilt]: [f64; 2]) -> AreaLight {
        let height = light.position[2];
        let azimuth = self.azimuth[0] + turn * self.azimuth[1];
        let offset = height * libm::exp(self.log_tilt[0] + tilt * self.log_tilt[1]);
        let (sin, cos) = libm::sincos(azimuth);
        AreaLight {
            position: [offset * cos, offset * sin, height],
            ..*light
        }
    }

    /// The radiance all around that leaves the lights their share, less what an environment map
    /// gives of it.
    fn ambient(&self, lights: &[AreaLight], environment: Option<&EnvironmentMap>) -> LinearRgb {
        let direct = lights.iter().fold(LinearRgb::BLACK, |sum, light| {
            sum + irradiance(light, Point3::origin(), Vector3::z())
        });
        let around = direct.scale(((1.0 - self.share) / self.share.max(1e-3) / PI) as f32);
        environment.map_or(around, |map| {
            let own = map.irradiance(&Vector3::z()).scale(1.0 / PI as f32);
            around.add_scaled(-1.0, own).map(|v| v.max(0.0))
        })
    }
}

/// The standard deviation of angles whose mean direction has this length.
fn circular_deviation(length: f64) -> f64 {
    (-2.0 * libm::log(length.clamp(1e-6, 1.0))).sqrt().min(PI)
}

/// A direction of a lamp, and how much of the light from all around reaches a wall.
struct Hypothesis {
    azimuth: f64,
    tangent: f64,
    wall_share: f64,
}

/// What a hypothesis leaves of what is seen.
struct LampFit {
    azimuth: f64,
    tangent: f64,
    share: f64,
    squares: f64,
}

fn hypotheses() -> impl Iterator<Item = Hypothesis> {
    WALL_SHARES.into_iter().flat_map(|wall_share| {
        TILT_TANGENTS.into_iter().flat_map(move |tangent| {
            (0..AZIMUTHS).map(move |k| Hypothesis {
                azimuth: TAU * k as f64 / AZIMUTHS as f64,
                tangent,
                wall_share,
            })
        })
    })
}

impl Hypothesis {
    /// The strengths of lamp and surroundings, none negative, that leave least.
    fn fit(&self, faces: &[SeenFace]) -> LampFit {
        let (sin, cos) = libm::sincos(self.azimuth);
        let toward = Vector3::new(self.tangent * cos, self.tangent * sin, 1.0).normalize();
        // The floor has brightness 1 by definition.
        let rows = faces.iter().map(|face| {
            let direct = face.normal.dot(&toward).max(0.0);
            [self.wall_share, direct, face.brightness]
        });
        let rows: Vec<[f64; 3]> = std::iter::once([1.0, toward.z, 1.0]).chain(rows).collect();
        let [around, lamp] = fit_strengths(&rows);
        let left = |[a, b, seen]: &[f64; 3]| (a * around + b * lamp - seen).powi(2);
        let direct = lamp * toward.z;
        LampFit {
            azimuth: self.azimuth,
            tangent: self.tangent,
            share: direct / (direct + around).max(1e-9),
            squares: rows.iter().map(left).sum(),
        }
    }
}

/// Factors, at least 0, of the first two numbers of each row that come nearest to the third.
fn fit_strengths(rows: &[[f64; 3]]) -> [f64; 2] {
    let sum = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let [aa, ab, bb, as_, bs] = [sum(0, 0), sum(0, 1), sum(1, 1), sum(0, 2), sum(1, 2)];
    let determinant = aa * bb - ab * ab;
    let both = [bb * as_ - ab * bs, aa * bs - ab * as_].map(|x| x / determinant);
    if both[0] < 0.0 {
        [0.0, (bs / bb).max(0.0)]
    } else if both[1] < 0.0 || determinant <= 0.0 {
        [(as_ / aa).max(0.0), 0.0]
    } else {
        both
    }
}

/// A wall in the plate; none where it is turned away or out of the picture.
fn seen_face(
    corners: &[Vector3<f64>; 4],
    (scene, camera): (&Scene, &Camera),
    plate: &Image<LinearRgb>,
    floor: f64,
) -> Option<SeenFace> {
    let [low, high, next_high, _] = corners;
    let normal = (next_high - high).cross(&(high - low)).normalize();
    let eye = camera.center().coords;
    let lens = scene.lens.distortion_of_plate(camera);
    let colors = places_on(corners).filter_map(|place| {
        let turned_here = normal.dot(&(eye - place)) > 0.0;
        let (px, _) = camera.project(place.into()).filter(|_| turned_here)?;
        pixel_at(plate, lens.distort(px))
    });
    let luminances: Vec<f32> = colors.map(|color| color.luminance()).collect();
    let is_seen = luminances.len() as f64 >= SEEN_SHARE * (ALONG[0] * ALONG[1]) as f64;
    let brightness = f64::from(median(luminances.into_iter(), f32::total_cmp)?) / floor;
    is_seen.then_some(SeenFace { normal, brightness })
}

/// Places on a wall, given from its left lower corner on, clockwise.
fn places_on([low, high, _, next_low]: &[Vector3<f64>; 4]) -> impl Iterator<Item = Vector3<f64>> {
    let share =
        |[from, to]: [f64; 2], i: usize, n: usize| from + (to - from) * (i as f64 + 0.5) / n as f64;
    (0..ALONG[0]).flat_map(move |i| {
        (0..ALONG[1]).map(move |j| {
            let along = share(LENGTH_SHARES, i, ALONG[0]);
            let up = share(HEIGHT_SHARES, j, ALONG[1]);
            low + (next_low - low) * along + (high - low) * up
        })
    })
}

fn pixel_at(plate: &Image<LinearRgb>, px: crate::geom::Point2<f64>) -> Option<LinearRgb> {
    let (w, h) = plate.size();
    let is_inside = px.x >= 0.0 && px.y >= 0.0 && px.x < w as f64 && px.y < h as f64;
    let color = is_inside.then(|| plate[(px.x as usize, px.y as usize)])?;
    color.is_finite().then_some(color)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::Panorama;
    use crate::scene::{LightShape, Wall};
    use std::sync::Arc;

    fn lamp() -> AreaLight {
        AreaLight {
            shape: LightShape::Ellipse,
            ..AreaLight::new([0.0, 0.0, 1.2], [0.2; 2], 10.0)
        }
    }

    fn scene() -> Scene {
        let mut scene = crate::light::surface::tests::scene(Default::default());
        scene.lights = vec![lamp()];
        scene.surface.wall = Some(Wall {
            height: 0.06,
            slope_deg: 10.0,
        });
        scene.light_direction = LightDirection::MatchWalls {
            deviations: [0.0; 2],
        };
        scene
    }

    /// Faces of a tray lit from all around and by a lamp of such a direction and share.
    fn faces(azimuth: f64, tangent: f64, share: f64) -> Vec<SeenFace> {
        let toward =
            Vector3::new(tangent * azimuth.cos(), tangent * azimuth.sin(), 1.0).normalize();
        let wall = scene().surface.wall.unwrap();
        let faces = wall.inner_faces(scene().surface.size);
        let seen = faces.map(|[low, high, next, _]| {
            let normal = (next - high).cross(&(high - low)).normalize();
            let direct = normal.dot(&toward).max(0.0) / toward.z;
            SeenFace {
                normal,
                brightness: 0.6 * (1.0 - share) + share * direct,
            }
        });
        seen.into()
    }

    #[test]
    fn a_lamp_of_known_direction_is_found_within_its_error() {
        for (degrees, tangent, share) in [(10.0, 0.6, 0.6), (130.0, 0.9, 0.5), (-75.0, 0.4, 0.8)] {
            let azimuth = f64::to_radians(degrees);
            let found = LampEstimate::from_faces(&faces(azimuth, tangent, share));
            let off = libm::remainder(found.azimuth[0] - azimuth, TAU);
            assert!(
                off.abs() < 0.12 && found.azimuth[1] < 0.8,
                "{degrees}: {found:?}"
            );
            let tilt = found.log_tilt[0] - tangent.ln();
            assert!(tilt.abs() < 1.5 * found.log_tilt[1], "{degrees}: {found:?}");
            assert!((found.share - share).abs() < 0.2, "{degrees}: {found:?}");
        }
    }

    #[test]
    fn light_from_all_around_has_no_direction() {
        let found = LampEstimate::from_faces(&faces(0.0, 0.5, 0.0));
        assert!(found.azimuth[1] > 1.0 && found.share < 0.4, "{found:?}");
    }

    #[test]
    fn the_light_moves_keeps_its_height_and_leaves_its_share_to_the_surroundings() {
        let found = LampEstimate {
            azimuth: [0.5, 0.1],
            log_tilt: [libm::log(0.8), 0.2],
            share: 0.25,
        };
        let moved = found.moved(&lamp(), [2.0, -1.0]);
        let [x, y, z] = moved.position;
        assert_eq!(z, 1.2);
        assert!((libm::atan2(y, x) - 0.7).abs() < 1e-12);
        assert!((libm::hypot(x, y) / z - 0.8 * libm::exp(-0.2)).abs() < 1e-12);
        let around = found.ambient(&[moved], None).g * PI as f32;
        let direct = irradiance(&moved, Point3::origin(), Vector3::z()).g;
        assert!((direct / (direct + around) - 0.25).abs() < 1e-5);
        // A map that gives two thirds of what comes from around, then one that gives too much.
        let map = |share: f32| EnvironmentMap {
            strength: share * around / PI as f32,
            ..EnvironmentMap::new(Arc::new(
                Panorama::new(Image::filled(64, 32, LinearRgb::WHITE)).unwrap(),
            ))
        };
        let left = |share| found.ambient(&[moved], Some(&map(share))).g * PI as f32 / around;
        assert!((left(2.0 / 3.0) - 1.0 / 3.0).abs() < 1e-3 && left(1.5) == 0.0);
    }

    /// A tray a metre below the camera: each wall as bright as it would be under a lamp at the
    /// right, the floor in the middle.
    #[test]
    fn walls_in_a_plate_turn_the_light() {
        let plate = Image::from_fn(40, 30, |x, y| {
            let is_floor = (10..30).contains(&x) && (8..22).contains(&y);
            let left_wall = x < 10;
            LinearRgb::grey(match (is_floor, left_wall) {
                (true, _) => 0.5,
                (_, true) => 0.45,
                _ => 0.2,
            })
        });
        let lit = match_lamp(scene(), (&plate).into(), None);
        let [x, y, z] = lit.lights[0].position;
        assert!(lit.light_direction.is_known());
        assert!(
            x > 0.3 && y.abs() < 0.3 * x && z == 1.2,
            "{:?}",
            lit.lights[0]
        );
        assert!(lit.ambient.g > 0.0);
    }

    #[test]
    fn without_walls_the_light_stands_where_it_was_drawn() {
        let mut flat = scene();
        flat.surface.wall = None;
        let plate = Image::filled(40, 30, LinearRgb::grey(0.3));
        let lit = match_lamp(flat.clone(), (&plate).into(), None);
        assert_eq!(lit.lights, flat.lights);
        assert_eq!(lit.ambient, flat.ambient);
        assert!(lit.light_direction.is_known());
    }
}
