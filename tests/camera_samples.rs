//! The sample backgrounds: cameras from their labels, and from their printed markers, against the
//! renderer's truth.

#![cfg(feature = "pipeline")]

use petcomp::camera::{self, CameraFile, Label, SolveOptions};
use petcomp::geom::{Point2, Point3};
use petcomp::{Image, LinearRgb, io};
use std::path::PathBuf;

fn sample(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/samples/backgrounds")
        .join(name)
}

#[test]
fn every_label_gives_the_renderer_s_camera_within_its_own_error() {
    // Focal length and camera height of the renderer (README of the folder, and 0.9648, 1.0760,
    // 1.0765, 1.1610 m).
    let truth = [
        ("bg0000", 1374.85, 0.9648),
        ("bg0001", 1492.55, 1.0760),
        ("bg0003", 1374.05, 1.0765),
        ("bg0004", 1606.72, 1.1610),
    ];
    for (name, focal_px, height) in truth {
        let label: Label = io::read_json(sample(&format!("{name}.label.json"))).unwrap();
        let solution = camera::solve(&label, &SolveOptions::default()).unwrap();
        let sigmas = (solution.camera.focal_px.x / focal_px).ln().abs() / solution.sigma.ln_focal;
        let high =
            (solution.camera.center().z - height).abs() / solution.sigma.center[(2, 2)].sqrt();
        println!(
            "{name}: {:.1} px, {sigmas:.2} sigma; height {high:.2} sigma; {:.2} px",
            solution.camera.focal_px.x, solution.rms_px
        );
        assert!(sigmas < 2.0 && high < 2.0 && solution.rms_px < 1.0);
        let file = CameraFile::new(&label, &solution);
        assert_eq!(
            serde_json::from_str::<CameraFile>(&serde_json::to_string(&file).unwrap()).unwrap(),
            file
        );
    }
}

/// Corners of the tray's floor, and of the four markers (as printed), in `bg0004`.
const FLOOR: [[f64; 2]; 4] = [
    [253.591, 208.675],
    [1030.176, 229.986],
    [1014.839, 740.768],
    [242.072, 721.495],
];
const MARKERS: [[[f64; 2]; 4]; 4] = [
    [
        [275.234, 231.489],
        [330.895, 233.01],
        [329.603, 288.671],
        [273.971, 287.165],
    ],
    [
        [952.244, 249.994],
        [1007.538, 251.506],
        [1005.885, 306.973],
        [950.62, 305.477],
    ],
    [
        [940.186, 661.907],
        [995.262, 663.301],
        [993.622, 718.325],
        [938.575, 716.946],
    ],
    [
        [265.86, 644.835],
        [321.3, 646.239],
        [320.018, 701.453],
        [264.608, 700.065],
    ],
];

#[test]
fn printed_markers_are_found_and_give_the_surface_to_a_third_of_a_pixel() {
    let photo: Image<LinearRgb> = io::read(sample("bg0004.jpg")).unwrap();
    let found = camera::find_markers(&photo);
    assert_eq!(found.iter().map(|m| m.id).collect::<Vec<_>>(), [0, 1, 2, 3]);
    for (marker, truth) in found.iter().zip(MARKERS) {
        let errors = [0, 1, 2, 3].map(|i| (marker.corners_px[i] - Point2::from(truth[i])).norm());
        println!("marker {}: {errors:.3?} px", marker.id);
        assert!(errors.into_iter().all(|e| e < 0.3));
    }
    let mut label: Label = io::read_json(sample("bg0004.label.json")).unwrap();
    label.surface.corners_px = None;
    let label = camera::with_markers(label, &photo).unwrap();
    let solution = camera::solve(&label, &SolveOptions::default()).unwrap();
    let corners = [
        [-0.28, 0.185],
        [0.28, 0.185],
        [0.28, -0.185],
        [-0.28, -0.185],
    ];
    for ([x, y], truth) in corners.into_iter().zip(FLOOR) {
        let seen = solution.camera.project(Point3::new(x, y, 0.0)).unwrap().0;
        println!("corner: {:.3} px", (seen - Point2::from(truth)).norm());
        assert!((seen - Point2::from(truth)).norm() < 0.3);
    }
}
