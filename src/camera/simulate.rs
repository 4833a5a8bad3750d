//! Random views of a rectangle with a known camera: what tests, benches and reports measure the
//! solver against.

use super::exchange::pose_from;
use super::label::Label;
use super::pinhole::{Camera, distorted};
use super::rectangle::corner_points;
use crate::geom::{Point2, Vector2, Vector3};
use nalgebra::{Matrix3, Rotation3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// Width of the edge of the picture that corners are kept out of, in picture sides.
const MARGIN_SIDES: f64 = 0.02;
/// Cameras are at least so high above the surface, in distances from the rectangle's centre.
const LEAST_HEIGHT: f64 = 0.05;

/// A kind of view; the default is the ideal camera of the accuracy tables, from straight above,
/// without noise.
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
    /// Distance of the principal point from the picture's middle before that noise, in longer
    /// sides, in a random direction: a cropped picture, or a shifted lens. Where it is 0
    /// labels say that the picture is whole.
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
    /// Noisy corners and the sides as measured; of the camera at most that the picture is whole.
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
struct SharedLens {
    principal_px: Point2<f64>,
    kappa: f64,
    ln_ratio: f64,
}

impl Scenario {
    /// A camera with realistic errors: corners to 1 px, the principal point to 0.005 diagonals, a
    /// slight distortion, the sides to 0.5 %.
    pub fn realistic() -> Self {
        Self {
            corner_sigma_px: 1.0,
            principal_sigma_px: 25.0,
            kappa: 0.01,
            ratio_sigma: 0.005,
            ..Self::default()
        }
    }

    /// The same, tilted by `degrees`.
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
        (0..count)
            .map(|_| {
                let tilt = dice.between(tilts[0], tilts[1]);
                self.tilted(tilt).view_through(&lens, &mut dice)
            })
            .collect()
    }

    fn lens(&self, dice: &mut Dice) -> SharedLens {
        // In this order: the numbers of a seed stay the same.
        let principal_px = self.principal_px(dice);
        let kappa = dice.sign() * self.kappa;
        SharedLens {
            principal_px,
            kappa,
            ln_ratio: dice.normal() * self.ratio_sigma,
        }
    }

    fn principal_px(&self, dice: &mut Dice) -> Point2<f64> {
        let center = Point2::from(self.image.map(|s| f64::from(s) / 2.0));
        let mut off = Vector2::new(dice.normal(), dice.normal()) * self.principal_sigma_px;
        if self.off_center > 0.0 {
            let px = self.off_center * f64::from(self.image[0].max(self.image[1]));
            off += dice.direction() * px;
        }
        center + off
    }

    fn view_through(&self, lens: &SharedLens, dice: &mut Dice) -> View {
        let camera = self.camera(lens, dice);
        let noisy = corner_points(self.size)
            .map(|p| distorted(&camera, lens.kappa, p))
            .map(|p| [0, 1].map(|axis| p[axis] + dice.normal() * self.corner_sigma_px));
        View {
            label: self.label(noisy, lens.ln_ratio),
            camera,
            kappa: lens.kappa,
            size: self.size,
        }
    }

    /// What a person would label who measured another ratio of the sides than there is.
    fn label(&self, corners_px: [[f64; 2]; 4], ln_ratio: f64) -> Label {
        let half = libm::exp(ln_ratio / 2.0);
        let measured = [self.size[0] * half, self.size[1] / half];
        let mut label = Label::new(self.image, corners_px, measured);
        label.surface.corner_sigma_px =
            (self.corner_sigma_px > 0.0).then_some(self.corner_sigma_px);
        label.image.cropped = (self.off_center == 0.0).then_some(false);
        label
    }

    fn camera(&self, lens: &SharedLens, dice: &mut Dice) -> Camera {
        let rotation = self.rotation(dice);
        let t = self.translation(lens, &rotation, dice);
        Camera {
            image: self.image,
            focal_px: Vector2::repeat(self.focal_px),
            principal_px: lens.principal_px,
            camera_from_world: pose_from(*rotation.matrix(), t),
        }
    }

    /// Where the rectangle's centre is in the camera's frame.
    fn translation(
        &self,
        lens: &SharedLens,
        rotation: &Rotation3<f64>,
        dice: &mut Dice,
    ) -> Vector3<f64> {
        let turned = corner_points(self.size).map(|p| rotation * p.coords);
        let image = Vector2::from(self.image.map(f64::from));
        let distance = self.distance(&turned, image);
        let bounds = self.extent(&turned, distance);
        let normal: Vector3<f64> = rotation.matrix().column(2).into();
        let center = self.center_px(lens, bounds, dice, |center| {
            let t = translation(center, distance, self.focal_px);
            -normal.dot(&t) > LEAST_HEIGHT * distance
        });
        translation(center, distance, self.focal_px)
    }

    /// Where the rectangle's centre is seen, relative to the principal point, so that its bounds
    /// are in the picture: random where the camera is then above the surface, or else the
    /// middle.
    fn center_px(
        &self,
        lens: &SharedLens,
        (low, high): (Vector2<f64>, Vector2<f64>),
        dice: &mut Dice,
        is_above: impl Fn(Vector2<f64>) -> bool,
    ) -> Vector2<f64> {
        let image = Vector2::from(self.image.map(f64::from));
        let from = image * MARGIN_SIDES - low - lens.principal_px.coords;
        let to = image * (1.0 - MARGIN_SIDES) - high - lens.principal_px.coords;
        (0..100)
            .map(|_| dice.inside(from, to))
            .find(|&center| is_above(center))
            .unwrap_or_else(|| (image - low - high) / 2.0 - lens.principal_px.coords)
    }

    fn rotation(&self, dice: &mut Dice) -> Rotation3<f64> {
        let azimuth = self.azimuth.unwrap_or_else(|| dice.between(0.0, TAU));
        let axis = Vector3::new(libm::cos(azimuth), libm::sin(azimuth), 0.0);
        let roll = Rotation3::new(Vector3::z() * dice.between(0.0, TAU));
        roll * downwards() * Rotation3::new(axis * self.tilt)
    }

    /// The distance at which the rectangle fills its part of the picture, by bisection.
    fn distance(&self, turned: &[Vector3<f64>; 4], image: Vector2<f64>) -> f64 {
        let nearest = turned.iter().map(|p| p.z.abs()).fold(0.0, f64::max);
        let [mut near, mut far] = [1.05 * nearest + 1e-4 * self.size[0], 1e5 * self.size[0]];
        for _ in 0..100 {
            let middle = (near * far).sqrt();
            let (low, high) = self.extent(turned, middle);
            if (high - low).component_div(&image).max() > self.fill {
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
        let start = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        seen.iter()
            .fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
    }
}

/// The camera's axes when it looks straight down.
fn downwards() -> Rotation3<f64> {
    let diagonal = Vector3::new(1.0, -1.0, -1.0);
    Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&diagonal))
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

    fn below_one(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below_one()
    }

    /// Minus or plus one.
    fn sign(&mut self) -> f64 {
        if self.below_one() < 0.5 { -1.0 } else { 1.0 }
    }

    /// A point of a box.
    fn inside(&mut self, from: Vector2<f64>, to: Vector2<f64>) -> Vector2<f64> {
        let x = self.between(from.x, to.x);
        Vector2::new(x, self.between(from.y, to.y))
    }

    /// A unit vector.
    fn direction(&mut self) -> Vector2<f64> {
        let angle = self.between(0.0, TAU);
        Vector2::new(libm::cos(angle), libm::sin(angle))
    }

    /// Box and Muller's normal deviate.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.below_one())).sqrt();
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
