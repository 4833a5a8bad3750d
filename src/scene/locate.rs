//! The pipeline stage that solves a scene's camera.

use crate::camera::{Camera, Label, SolveOptions, solve};
use crate::error::Result;
use crate::scene::{CameraSource, Scene};

/// Solves a scene's camera if it is still a labelled rectangle, and scales it to the scene's
/// picture size.
///
/// A scene whose camera is known is unchanged: `locate(locate(s)) == locate(s)`.
///
/// # Errors
/// [`Error::Camera`](crate::Error::Camera) for corners that no camera can have seen, or that none
/// fits.
pub fn locate(scene: Scene) -> Result<Scene> {
    let CameraSource::Rectangle {
        corners_px,
        photo,
        focal_px,
    } = scene.camera
    else {
        return Ok(scene);
    };
    let mut label = Label::new(photo, corners_px, scene.surface.size);
    label.camera.focal_px = focal_px;
    // The corners were clicked in the plate.
    label.camera.k1 = Some(scene.lens.k1_of_plate()).filter(|&k1| k1 != 0.0);
    let camera = solve_camera(&label, &scene.plate)?.resized(scene.image);
    Ok(Scene {
        camera: CameraSource::Known(camera),
        ..scene
    })
}

fn solve_camera(label: &Label, plate: &str) -> Result<Camera> {
    let solution = solve(label, &SolveOptions::default())?.fitting()?;
    for warning in &solution.warnings {
        log::info!("{plate}: {warning}");
    }
    Ok(solution.camera)
}

#[cfg(test)]
mod tests {
    use super::*;
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
        assert!(
            locate(flat)
                .unwrap_err()
                .to_string()
                .contains("the first and the second corner are 0.0 px apart")
        );
    }
}
