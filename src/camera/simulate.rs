//! Random views of a rectangle with a known camera: what tests, benches and reports measure the solver against.

use super::label::Label;
use super::pinhole::distorted;
use super::rectangle::corner_points;
use crate::camera::Camera;
use crate::geom::{Point2, Pose, UnitQuaternion, Vector2, Vector3};
use nalgebra::{Matrix3, Rotation3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// Width of the edge of the picture that corners are kept out of, in picture sides.
const MARGIN: f64 = 0.02;

/// A kind of view; the default is the ideal camera of the accuracy tables, from straight above, without noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scenario {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// Focal length, pixels.
    pub focal_px: f64,
    /// Width and height of the rectangle, metres.
    pub size: [f64; 2],
    /// Part of the picture that the rectangle fills, along the side where it fills more.
    pub fill: f64,
    /// Angle between optical axis and surface normal, radians.
    pub tilt: f64,
    /// The axis of the tilt in the surface, radians from the width; random where there is none.
    pub azimuth: Option<f64>,
    /// Noise of the corners, pixels.
    pub corner_sigma_px: f64,
    /// Noise of the principal point, pixels.
    pub principal_sigma_px: f64,
    /// Distance of the principal point from the picture's middle before that noise, in longer sides, in a random
    /// direction: a cropped picture, or a shifted lens. Where it is 0 labels say that the picture is whole.
    pub off_center: f64,
    /// Radial distortion; its sign is random.
    pub kappa: f64,
    /// Relative noise of the ratio of the sides.
    pub ratio_sigma: f64,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            image: [4000, 3000],
            focal_px: 3200.0,
            size: [0.6, 0.4],
            fill: 0.7,
            tilt: 0.0,
            azimuth: None,
            corner_sigma_px: 0.0,
            principal_sigma_px: 0.0,
            off_center: 0.0,
            kappa: 0.0,
            ratio_sigma: 0.0,
        }
    }
}

/// One view: what a person would label, and the truth.
#[derive(Clone, Debug)]
pub struct View {
    /// Noisy corners and the sides as measured; of the camera it is said at most that the picture is whole.
    pub label: Label,
    /// The camera that took the picture.
    pub camera: Camera,
    /// Its radial distortion.
    pub kappa: f64,
    /// The sides as they are, metres.
    pub size: [f64; 2],
}

/// What the photos of one camera share: its intrinsics, and the tape measure's error.
#[derive(Clone, Copy, Debug)]
struct Lens {
    principal_px: Point2<f64>,
    kappa: f64,
    ln_ratio: f64,
}

impl Scenario {
    /// A camera with errors as real ones have: corners to 1 px, the principal point to 0.005 diagonals, a slight distortion,
    /// the sides to 0.5 %.
    pub fn realistic() -> Self {
        Self {
            corner_sigma_px: 1.0,
            principal_sigma_px: 25.0,
            kappa: 0.01,
            ratio_sigma: 0.005,
            ..Self::default()
        }
    }

    /// The same, tilted by so many degrees.
    pub fn tilted(self, degrees: f64) -> Self {
        Self {
            tilt: degrees.to_radians(),
            ..self
        }
    }

    /// View `k` of a seed.
    pub fn view(&self, seed: u64, k: u64) -> View {
        let mut dice = Dice::new(seed, k);
        let lens = self.lens(&mut dice);
        self.view_through(&lens, &mut dice)
    }

    /// Views of one camera, tilted by anything between two angles in degrees.
    pub fn views(&self, seed: u64, k: u64, count: usize, tilts: [f64; 2]) -> Vec<View> {
        let mut dice = Dice::new(seed, k);
        let lens = self.lens(&mut dice);
        let one = |_| {
            let tilt = dice.between(tilts[0], tilts[1]);
            self.tilted(tilt).view_through(&lens, &mut dice)
        };
        (0..count).map(one).collect()
    }

    fn lens(&self, dice: &mut Dice) -> Lens {
        let center = Point2::from(self.image.map(|s| f64::from(s) / 2.0));
        let mut off = Vector2::new(dice.normal(), dice.normal()) * self.principal_sigma_px;
        if self.off_center > 0.0 {
            let direction = dice.between(0.0, TAU);
            let px = self.off_center * f64::from(self.image[0].max(self.image[1]));
            off += Vector2::new(libm::cos(direction), libm::sin(direction)) * px;
        }
        let kappa = if dice.between(0.0, 1.0) < 0.5 {
            -self.kappa
        } else {
            self.kappa
        };
        Lens {
            principal_px: center + off,
            kappa,
            ln_ratio: dice.normal() * self.ratio_sigma,
        }
    }

    fn view_through(&self, lens: &Lens, dice: &mut Dice) -> View {
        let camera = self.camera(lens, dice);
        let seen = corner_points(self.size).map(|p| distorted(&camera, lens.kappa, p));
        let noisy = seen.map(|p| [0, 1].map(|axis| p[axis] + dice.normal() * self.corner_sigma_px));
        // The person measured another ratio than there is.
        let half = libm::exp(lens.ln_ratio / 2.0);
        let mut label = Label::new(
            self.image,
            noisy,
            [self.size[0] * half, self.size[1] / half],
        );
        label.surface.corner_sigma_px =
            (self.corner_sigma_px > 0.0).then_some(self.corner_sigma_px);
        label.image.cropped = (self.off_center == 0.0).then_some(false);
        View {
            label,
            camera,
            kappa: lens.kappa,
            size: self.size,
        }
    }

    fn camera(&self, lens: &Lens, dice: &mut Dice) -> Camera {
        let rotation = self.rotation(dice);
        let turned = corner_points(self.size).map(|p| rotation * p.coords);
        let image = Vector2::from(self.image.map(f64::from));
        let distance = self.distance(&turned, image);
        let (low, high) = self.extent(&turned, distance);
        let mut center = (image - low - high) / 2.0 - lens.principal_px.coords;
        for _ in 0..100 {
            let from = image * MARGIN - low - lens.principal_px.coords;
            let to = image * (1.0 - MARGIN) - high - lens.principal_px.coords;
            let tried = Vector2::new(dice.between(from.x, to.x), dice.between(from.y, to.y));
            let t = translation(tried, distance, self.focal_px);
            if -rotation.matrix().column(2).dot(&t) > 0.05 * distance {
                center = tried;
                break;
            }
        }
        let t = translation(center, distance, self.focal_px);
        Camera {
            image: self.image,
            focal_px: Vector2::repeat(self.focal_px),
            principal_px: lens.principal_px,
            camera_from_world: Pose::from_parts(
                t.into(),
                UnitQuaternion::from_rotation_matrix(&rotation),
            ),
        }
    }

    fn rotation(&self, dice: &mut Dice) -> Rotation3<f64> {
        let azimuth = self.azimuth.unwrap_or_else(|| dice.between(0.0, TAU));
        let axis = Vector3::new(libm::cos(azimuth), libm::sin(azimuth), 0.0);
        let roll = Rotation3::new(Vector3::z() * dice.between(0.0, TAU));
        let down = Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&Vector3::new(
            1.0, -1.0, -1.0,
        )));
        roll * down * Rotation3::new(axis * self.tilt)
    }

    /// The distance at which the rectangle fills its part of the picture, by bisection.
    fn distance(&self, turned: &[Vector3<f64>; 4], image: Vector2<f64>) -> f64 {
        let nearest = turned.iter().map(|p| p.z.abs()).fold(0.0, f64::max);
        let [mut near, mut far] = [1.05 * nearest + 1e-4 * self.size[0], 1e5 * self.size[0]];
        for _ in 0..100 {
            let middle = (near * far).sqrt();
            let (low, high) = self.extent(turned, middle);
            let filled = (high - low).component_div(&image).max();
            if filled > self.fill {
                near = middle
            } else {
                far = middle
            }
        }
        far
    }

    /// Bounds of the corners in the picture when the rectangle's centre is on the axis, pixels.
    fn extent(&self, turned: &[Vector3<f64>; 4], distance: f64) -> (Vector2<f64>, Vector2<f64>) {
        let seen = turned.map(|p| p.xy() * (self.focal_px / (p.z + distance)));
        let low = seen
            .iter()
            .fold(Vector2::repeat(f64::MAX), |low, p| low.inf(p));
        (
            low,
            seen.iter()
                .fold(Vector2::repeat(f64::MIN), |high, p| high.sup(p)),
        )
    }
}

fn translation(center_px: Vector2<f64>, distance: f64, focal_px: f64) -> Vector3<f64> {
    (center_px / focal_px).push(1.0) * distance
}

/// Random numbers, the same on every machine.
struct Dice(ChaCha8Rng);

impl Dice {
    fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self(rng)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// Box and Muller's normal deviate.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.between(0.0, 1.0))).sqrt();
        radius * libm::cos(self.between(0.0, TAU))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_fills_about_its_part_of_the_picture_and_is_tilted_as_asked() {
        for k in 0..50 {
            let view = Scenario::default().tilted(30.0).view(1, k);
            let corners = view.label.surface.corners_px.unwrap();
            let extent = |axis: usize| {
                let values = corners.map(|c| c[axis]);
                values.into_iter().fold(f64::MIN, f64::max)
                    - values.into_iter().fold(f64::MAX, f64::min)
            };
            // Exact only where the rectangle stands in the middle.
            assert!(
                ((extent(0) / 4000.0).max(extent(1) / 3000.0) - 0.7).abs() < 0.15,
                "{k}: {corners:?}"
            );
            assert!((view.camera.tilt().to_degrees() - 30.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_view_is_a_function_of_seed_and_number() {
        let scenario = Scenario::realistic().tilted(20.0);
        assert_eq!(scenario.view(7, 3).label, scenario.view(7, 3).label);
        assert_ne!(scenario.view(7, 3).label, scenario.view(7, 4).label);
        assert_ne!(scenario.view(7, 3).label, scenario.view(8, 3).label);
    }
}
