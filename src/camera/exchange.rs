//! Cameras in the terms of other programs: Blender, OpenCV, COLMAP.
//!
//! # Method
//! Blender looks along -z with +y up, so its frame is ours turned by diag(1, -1, -1); its lens
//! shifts are in units of the side that the sensor is fitted to. OpenCV's pixel centres are
//! integers. COLMAP's pixels are ours.

use super::pinhole::Camera;
use crate::geom::{Point2, Pose, UnitQuaternion, Vector2};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// Width of the sensor that cameras are given to Blender with, millimetres; any other would do.
const SENSOR_WIDTH_MM: f64 = 36.0;

/// A camera in Blender's terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlenderCamera {
    /// Which side of the picture the sensor is fitted to.
    pub sensor_fit: SensorFit,
    /// Width of the sensor, millimetres.
    pub sensor_width: f64,
    /// Height of the sensor, millimetres; only [`SensorFit::Vertical`] reads it.
    pub sensor_height: f64,
    /// Focal length, millimetres.
    pub lens: f64,
    /// Horizontal lens shift, in sides of the fitted length.
    pub shift_x: f64,
    /// Vertical lens shift, in sides of the fitted length.
    pub shift_y: f64,
    /// Height over width of a pixel.
    pub pixel_aspect: f64,
    /// Pose of the camera object, row by row; the last row is 0 0 0 1.
    pub matrix_world: [[f64; 4]; 4],
}

/// Which side of the picture Blender's sensor is fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum SensorFit {
    /// The longer one.
    Auto,
    /// The width.
    Horizontal,
    /// The height.
    Vertical,
}

/// A camera in OpenCV's terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpencvCamera {
    /// Camera matrix; pixel centres are integers.
    #[serde(rename = "K")]
    pub k: [[f64; 3]; 3],
    /// Rotation from the world to the camera.
    #[serde(rename = "R")]
    pub r: [[f64; 3]; 3],
    /// Translation from the world to the camera, metres.
    pub t: [f64; 3],
}

/// The three text files of a COLMAP model.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColmapModel {
    /// `cameras.txt`
    pub cameras: String,
    /// `images.txt`
    pub images: String,
    /// `points3D.txt`: no points.
    pub points: String,
}

impl SensorFit {
    /// The fitted side, pixels of the picture's width.
    fn fitted_side(self, [w, h]: [f64; 2], pixel_aspect: f64) -> f64 {
        let tall = pixel_aspect * h;
        match self {
            Self::Horizontal => w,
            Self::Vertical => tall,
            Self::Auto => w.max(tall),
        }
    }
}

impl BlenderCamera {
    /// Camera axes from world axes.
    fn rotation(&self) -> Matrix3<f64> {
        let m = &self.matrix_world;
        blender_flip() * Matrix3::from_fn(|i, j| m[i][j]).transpose()
    }

    fn camera_from_world(&self) -> Pose {
        let rotation = self.rotation();
        pose_from(rotation, -(rotation * self.center()))
    }

    /// Where the camera stands, metres.
    fn center(&self) -> Vector3<f64> {
        let m = &self.matrix_world;
        Vector3::new(m[0][3], m[1][3], m[2][3])
    }

    fn sensor_mm(&self) -> f64 {
        if self.sensor_fit == SensorFit::Vertical {
            self.sensor_height
        } else {
            self.sensor_width
        }
    }
}

impl Camera {
    /// The camera in Blender's terms: set these values and a resolution percentage of 100.
    pub fn to_blender(&self) -> BlenderCamera {
        let [w, h] = self.image.map(f64::from);
        let pixel_aspect = self.focal_px.x / self.focal_px.y;
        let view = SensorFit::Auto.fitted_side([w, h], pixel_aspect);
        BlenderCamera {
            sensor_fit: SensorFit::Auto,
            sensor_width: SENSOR_WIDTH_MM,
            sensor_height: SENSOR_WIDTH_MM,
            lens: self.focal_px.x * SENSOR_WIDTH_MM / view,
            shift_x: (w / 2.0 - self.principal_px.x) / view,
            shift_y: (self.principal_px.y - h / 2.0) * pixel_aspect / view,
            pixel_aspect,
            matrix_world: self.matrix_world(),
        }
    }

    fn matrix_world(&self) -> [[f64; 4]; 4] {
        let turned = self.rotation().transpose() * blender_flip();
        let center = self.center();
        let [x, y, z] =
            [0, 1, 2].map(|i| [turned[(i, 0)], turned[(i, 1)], turned[(i, 2)], center[i]]);
        [x, y, z, [0.0, 0.0, 0.0, 1.0]]
    }

    /// The camera that Blender renders a picture of this size with.
    pub fn from_blender(blender: &BlenderCamera, image: [u32; 2]) -> Self {
        let [w, h] = image.map(f64::from);
        let view = blender.sensor_fit.fitted_side([w, h], blender.pixel_aspect);
        let fx = blender.lens / blender.sensor_mm() * view;
        let principal_px = Point2::new(
            w / 2.0 - blender.shift_x * view,
            h / 2.0 + blender.shift_y * view / blender.pixel_aspect,
        );
        Self {
            image,
            focal_px: Vector2::new(fx, fx / blender.pixel_aspect),
            principal_px,
            camera_from_world: blender.camera_from_world(),
        }
    }

    /// The camera in OpenCV's terms.
    pub fn to_opencv(&self) -> OpencvCamera {
        let mut k = self.intrinsics();
        k[(0, 2)] -= 0.5;
        k[(1, 2)] -= 0.5;
        OpencvCamera {
            k: matrix_rows(&k),
            r: matrix_rows(&self.rotation()),
            t: self.camera_from_world.translation.vector.into(),
        }
    }

    /// The camera that OpenCV means, for a picture of this size.
    pub fn from_opencv(opencv: &OpencvCamera, image: [u32; 2]) -> Self {
        let k = &opencv.k;
        let rotation = Matrix3::from_fn(|i, j| opencv.r[i][j]);
        Self {
            image,
            focal_px: Vector2::new(k[0][0], k[1][1]),
            principal_px: Point2::new(k[0][2] + 0.5, k[1][2] + 0.5),
            camera_from_world: pose_from(rotation, opencv.t.into()),
        }
    }

    /// Python code that creates the camera in Blender.
    pub fn to_blender_script(&self) -> String {
        let blender = self.to_blender();
        let rows: Vec<String> = blender
            .matrix_world
            .iter()
            .map(|row| format!("{row:?}"))
            .collect();
        format!(
            "import bpy\n\
             from mathutils import Matrix\n\n\
             camera = bpy.data.cameras.new('solved')\n\
             camera.sensor_fit, camera.sensor_width = 'AUTO', {:?}\n\
             camera.lens, camera.shift_x, camera.shift_y = {:?}, {:?}, {:?}\n\
             camera.clip_start, camera.clip_end = {:?}, {:?}\n\
             holder = bpy.data.objects.new('solved', camera)\n\
             holder.matrix_world = Matrix(({}))\n\
             scene = bpy.context.scene\n\
             scene.collection.objects.link(holder)\n\
             scene.camera = holder\n\
             scene.render.resolution_x, scene.render.resolution_y = {}, {}\n\
             scene.render.resolution_percentage = 100\n\
             scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.0, {:?}\n",
            blender.sensor_width,
            blender.lens,
            blender.shift_x,
            blender.shift_y,
            1e-3 * self.height_m(),
            1e3 * self.height_m(),
            rows.join(", "),
            self.image[0],
            self.image[1],
            blender.pixel_aspect,
        )
    }

    fn rotation(&self) -> Matrix3<f64> {
        self.camera_from_world
            .rotation
            .to_rotation_matrix()
            .into_inner()
    }
}

/// A pose from a matrix that is a rotation, and a translation.
pub(crate) fn pose_from(rotation: Matrix3<f64>, translation: Vector3<f64>) -> Pose {
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Pose::from_parts(translation.into(), rotation)
}

impl ColmapModel {
    /// A model of named pictures, each with a camera of its own and OpenCV's k1 of its lens.
    pub fn new<'a>(views: impl IntoIterator<Item = (&'a str, &'a Camera, f64)>) -> Self {
        let mut model = Self::default();
        for (i, (name, camera, k1)) in views.into_iter().enumerate() {
            let (id, pose) = (i + 1, colmap_pose(camera));
            // Writing to a string cannot fail.
            let _ = writeln!(model.cameras, "{id} {}", colmap_intrinsics(camera, k1));
            let _ = writeln!(model.images, "{id} {pose} {id} {name}\n");
        }
        model
    }
}

/// COLMAP's model of the lens, and what it takes; its k1 is OpenCV's, of four coefficients.
fn colmap_intrinsics(camera: &Camera, k1: f64) -> String {
    let [w, h] = camera.image;
    let (f, c) = (camera.focal_px, camera.principal_px);
    let pinhole = format!("{w} {h} {:?} {:?} {:?} {:?}", f.x, f.y, c.x, c.y);
    if k1 == 0.0 {
        format!("PINHOLE {pinhole}")
    } else {
        format!("OPENCV {pinhole} {k1:?} 0 0 0")
    }
}

/// Rotation as a quaternion, w first, and translation.
fn colmap_pose(camera: &Camera) -> String {
    let Pose {
        rotation: q,
        translation,
    } = camera.camera_from_world;
    let t = translation.vector;
    [q.w, q.i, q.j, q.k, t.x, t.y, t.z]
        .map(|v| format!("{v:?}"))
        .join(" ")
}

pub(crate) fn matrix_rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)]))
}

/// Our camera frame and Blender's: y and z point the other way.
fn blender_flip() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::RadialDistortion;

    fn cameras() -> Vec<Camera> {
        let sizes = [[640, 480], [480, 640], [1000, 1000]];
        let pose = |k: f64| {
            let turn = UnitQuaternion::from_euler_angles(3.0 + 0.3 * k, -0.4 * k, 1.1 * k);
            Pose::from_parts(Vector3::new(0.02 * k, -0.03, 1.1 + k).into(), turn)
        };
        let one = |(k, image): (usize, [u32; 2])| Camera {
            image,
            focal_px: Vector2::new(700.0, 700.0 + 10.0 * k as f64),
            principal_px: Point2::new(311.0, 250.5),
            camera_from_world: pose(k as f64),
        };
        sizes.into_iter().enumerate().map(one).collect()
    }

    fn difference(a: &Camera, b: &Camera) -> f64 {
        let pose = (a.rotation() - b.rotation()).norm()
            + (a.camera_from_world.translation.vector - b.camera_from_world.translation.vector)
                .norm();
        let lens = (a.focal_px - b.focal_px).norm() + (a.principal_px - b.principal_px).norm();
        pose + lens / a.focal_px.x
    }

    #[test]
    fn blender_round_trips() {
        for camera in cameras() {
            let back = Camera::from_blender(&camera.to_blender(), camera.image);
            assert!(
                difference(&camera, &back) < 1e-12,
                "{}",
                difference(&camera, &back)
            );
        }
    }

    #[test]
    fn opencv_round_trips_and_has_integer_pixel_centres() {
        for camera in cameras() {
            let opencv = camera.to_opencv();
            assert_eq!(opencv.k[0][2], camera.principal_px.x - 0.5);
            assert!(difference(&camera, &Camera::from_opencv(&opencv, camera.image)) < 1e-12);
        }
    }

    #[test]
    fn colmap_names_every_picture() {
        let cameras = cameras();
        let model = ColmapModel::new([("a.png", &cameras[0], 0.0), ("b.png", &cameras[1], 0.0)]);
        assert!(
            model
                .cameras
                .starts_with("1 PINHOLE 640 480 700.0 700.0 311.0 250.5\n2 PINHOLE 480 640")
        );
        assert_eq!(model.images.lines().count(), 4);
        assert!(
            model
                .images
                .lines()
                .nth(2)
                .is_some_and(|line| line.ends_with(" 2 b.png"))
        );
    }

    /// Where COLMAP's documentation says that a point is seen: `x = R X + t` with the quaternion
    /// `QW QX QY QZ` of R, then its model of the lens.
    fn seen_by_colmap(model: &ColmapModel, point: Vector3<f64>) -> Point2<f64> {
        let numbers = |words: &str, skipped: usize| {
            let words = words.split_whitespace().skip(skipped);
            words.map_while(|w| w.parse().ok()).collect::<Vec<f64>>()
        };
        let pose = numbers(&model.images, 1);
        let (w, v) = (pose[0], Vector3::new(pose[1], pose[2], pose[3]));
        // The rotation of a point by a quaternion.
        let turned = point + 2.0 * v.cross(&(v.cross(&point) + point * w));
        let seen = turned + Vector3::new(pose[4], pose[5], pose[6]);
        let (u, v) = (seen.x / seen.z, seen.y / seen.z);
        let lens = numbers(&model.cameras, 4);
        let radial = match model.cameras.split_whitespace().nth(1).unwrap() {
            "PINHOLE" => 0.0,
            "OPENCV" => lens[4] * (u * u + v * v),
            other => panic!("{other}"),
        };
        let along = |i: usize, u: f64| lens[i] * (u + u * radial) + lens[i + 2];
        Point2::new(along(0, u), along(1, v))
    }

    #[test]
    fn colmap_sees_what_the_camera_sees_through_its_lens() {
        for camera in cameras() {
            for k1 in [0.0, -0.2, 0.1] {
                let model = ColmapModel::new([("a.png", &camera, k1)]);
                let lens = RadialDistortion::new(&camera, k1);
                for px in [[20.0, 30.0], [400.0, 470.0]] {
                    let point = camera.ray(px.into()).at(1.3);
                    let found = seen_by_colmap(&model, point.coords);
                    let expected = lens.distort(px.into());
                    assert!((found - expected).norm() < 1e-9, "{k1}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_script_says_what_the_values_are() {
        let script = cameras()[0].to_blender_script();
        assert!(script.contains("resolution_x, scene.render.resolution_y = 640, 480"));
        assert!(script.contains(&format!(
            "camera.lens, camera.shift_x, camera.shift_y = {:?}",
            700.0 * 36.0 / 640.0
        )));
    }
}
