//! The pipeline stage that solves a scene's camera.

use crate::camera::{Camera, Label, Solution, SolveError, SolveOptions, solve};
use crate::error::{Error, Result};
use crate::scene::{CameraSource, Scene};

/// Solves a scene's camera if it is still a labelled rectangle.
///
/// The scene's picture shows the largest middle part of the photo that has its shape.
///
/// A scene whose camera is known is unchanged: `locate(locate(s)) == locate(s)`.
///
/// # Errors
/// [`Error::Camera`](crate::Error::Camera) for corners that no camera can have seen, or that none
/// fits; [`Error::Value`](crate::Error::Value) for a value of the view that cannot be right.
pub fn locate(scene: Scene) -> Result<Scene> {
    let CameraSource::Rectangle {
        corners_px,
        photo,
        focal_px,
    } = scene.camera
    else {
        return Ok(scene);
    };
    scene.check_view()?;
    let mut label = Label::new(photo, corners_px, scene.surface.size);
    label.camera.focal_px = focal_px;
    // The corners were clicked in the plate.
    label.camera.k1 = Some(scene.lens.k1_of_plate()).filter(|&k1| k1 != 0.0);
    let camera = solve_camera(&label, &scene.plate)?.covering(scene.image);
    Ok(Scene {
        camera: CameraSource::Known(camera),
        ..scene
    })
}

fn solve_camera(label: &Label, plate: &str) -> Result<Camera> {
    let solved = solve(label, &SolveOptions::default()).and_then(Solution::fitting);
    let solution = solved.map_err(in_scene)?;
    for warning in &solution.warnings {
        log::info!("{plate}: {warning}");
    }
    Ok(solution.camera)
}

/// What a label and what a scene call the same.
const SCENE_NAMES: [[&str; 2]; 8] = [
    ["surface.corners_px", "camera.rectangle.corners_px"],
    [
        "swap width_m and height_m",
        "swap the sides in surface.size",
    ],
    [" too small a corner_sigma_px,", ""],
    [" (3 times corner_sigma_px)", ""],
    [" (4 times corner_sigma_px)", ""],
    ["without EXIF data or ", "without "],
    ["camera.focal_px", "camera.rectangle.focal_px"],
    ["camera.k1", "lens.k1"],
];

/// The error of a scene's camera, in the scene's words.
fn in_scene(why: SolveError) -> Error {
    let named = |text: String| {
        let names = SCENE_NAMES.iter();
        names.fold(text, |text, [label, scene]| text.replace(label, scene))
    };
    match why.into() {
        Error::Camera { at, what } => Error::Camera {
            at: named(at),
            what: named(what),
        },
        Error::Value { at, what } => Error::value(named(at), named(what)),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Point2, Vector2};
    use crate::scene::Surface;

    fn scene() -> Scene {
        let corners_px = [
            [199.713, 223.218],
            [1003.21, 207.639],
            [1008.381, 733.319],
            [216.899, 750.414],
        ];
        Scene {
            plate: "bg0000".into(),
            ..Scene::new(
                [640, 480],
                CameraSource::Rectangle {
                    corners_px,
                    photo: [1280, 960],
                    focal_px: Some(1374.852),
                },
                Surface::new([0.56, 0.37]),
            )
        }
    }

    #[test]
    fn the_camera_is_known_at_the_scene_s_size_and_stays_so() {
        let once = locate(scene()).unwrap();
        let CameraSource::Known(camera) = once.camera else {
            panic!("still unknown")
        };
        assert_eq!(camera.image, [640, 480]);
        assert!((camera.focal_px.x - 1374.852 / 2.0).abs() < 10.0);
        assert_eq!(locate(once.clone()).unwrap(), once);
    }

    #[test]
    fn a_picture_of_another_shape_shows_the_middle_of_the_photo() {
        let known = |image| match locate(Scene { image, ..scene() }).unwrap().camera {
            CameraSource::Known(camera) => camera,
            CameraSource::Rectangle { .. } => panic!("still unknown"),
        };
        let (whole, square) = (known([640, 480]), known([480, 480]));
        assert_eq!(square.image, [480, 480]);
        assert!((square.focal_px.x - square.focal_px.y).abs() < 1e-9);
        assert!((square.focal_px - whole.focal_px).norm() < 1e-9);
        assert!((square.principal_px - Point2::new(240.0, 240.0)).norm() < 10.0);
        let shift = whole.principal_px - square.principal_px;
        assert!((shift - Vector2::new(80.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn a_picture_without_pixels_is_an_error() {
        let empty = Scene {
            image: [0, 480],
            ..scene()
        };
        let refusal = locate(empty).unwrap_err().to_string();
        assert_eq!(refusal, "image: [0, 480], expected two numbers above 0");
    }

    #[test]
    fn impossible_corners_are_an_error() {
        let CameraSource::Rectangle {
            photo, focal_px, ..
        } = scene().camera
        else {
            unreachable!()
        };
        let corners_px = [[0.0, 0.0]; 4];
        let flat = Scene {
            camera: CameraSource::Rectangle {
                corners_px,
                photo,
                focal_px,
            },
            ..scene()
        };
        let refusal = locate(flat).unwrap_err().to_string();
        assert_eq!(
            refusal,
            "camera.rectangle.corners_px: the first and the second corner are 0.0 px apart, expected at least 4.0"
        );
    }

    #[test]
    fn sides_to_swap_are_those_of_the_scene() {
        let surface = Surface::new([0.37, 0.56]);
        let refusal = locate(Scene { surface, ..scene() })
            .unwrap_err()
            .to_string();
        let advice = ": swap the sides in surface.size (chi squared ";
        assert!(refusal.contains(advice), "{refusal}");
    }
}
