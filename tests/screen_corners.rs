//! The corners of a coloured screen, found in photos that a known camera takes of it.

#![cfg(feature = "pipeline")]

use petcomp::camera::project_picture;
use petcomp::filter::Pyramid;
use petcomp::geom::{Pose, UnitQuaternion, Vector3};
use petcomp::matte::screen_corners;
use petcomp::{Camera, Coverage, Image, LinearRgb, Roi};

const BROWN: LinearRgb = LinearRgb {
    r: 0.2,
    g: 0.12,
    b: 0.06,
};
const BLUE: LinearRgb = LinearRgb {
    r: 0.05,
    g: 0.12,
    b: 0.35,
};
const GREEN: LinearRgb = LinearRgb {
    r: 0.05,
    g: 0.4,
    b: 0.1,
};

/// A green screen of 0.6 x 0.4 m on a table, unevenly lit, with a red slab on it; and its
/// camera.
fn photo(tilt: f64, turn: f64, table: LinearRgb) -> (Image<LinearRgb>, Camera) {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    let camera = Camera {
        image: [600, 460],
        focal_px: [600.0; 2].into(),
        principal_px: [300.0, 230.0].into(),
        camera_from_world: Pose::from_parts(Vector3::new(0.0, 0.0, 0.9).into(), down),
    };
    let screen = Image::from_fn(300, 200, |x, y| {
        let slab = (100..190).contains(&x) && (75..115).contains(&y);
        if slab {
            LinearRgb::new(0.6, 0.05, 0.05)
        } else {
            GREEN.scale(0.6 + 0.4 * x as f32 / 300.0)
        }
    });
    let seen = project_picture(&Pyramid::new(screen), &camera, 0.0, [0.6, 0.4]);
    let alpha = project_picture(
        &Pyramid::new(Image::filled(300, 200, Coverage(1.0))),
        &camera,
        0.0,
        [0.6, 0.4],
    );
    (
        seen.zip_map(&alpha, |p, a| p + table.scale(1.0 - a.0)),
        camera,
    )
}

/// Grain of a sensor: the same for the same pixel.
fn noisy(photo: &Image<LinearRgb>, sigma: f32) -> Image<LinearRgb> {
    let (w, _) = photo.size();
    let unit = |seed: u64| {
        ((seed ^ (seed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f32 / 8_388_608.0 - 1.0
    };
    let grain = |seed: u64| 1.73 * sigma * unit(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    Image::from_fn(w, photo.height(), |x, y| {
        let seed = 3 * (y * w + x) as u64 + 1;
        photo[(x, y)] + LinearRgb::new(grain(seed), grain(seed + 1), grain(seed + 2))
    })
}

#[test]
fn corners_are_found_on_tables_of_any_colour() {
    let views = [
        (0.0, 0.0, BROWN),
        (0.3, 0.1, BLUE),
        (-0.4, -0.3, BROWN),
        (0.2, 0.2, LinearRgb::grey(0.02)),
    ];
    for (tilt, turn, table) in views {
        let (photo, camera) = photo(tilt, turn, table);
        let found = screen_corners(&noisy(&photo, 0.01)).unwrap();
        for (found, [x, y]) in
            found
                .corners_px
                .iter()
                .zip([[-0.3, 0.2], [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]])
        {
            let (truth, _) = camera.project([x, y, 0.0].into()).unwrap();
            assert!(
                (found - truth).norm() < 0.25,
                "{tilt} {turn}: {found} instead of {truth}"
            );
        }
        assert!(found.sigma_px < 0.3, "{}", found.sigma_px);
    }
}

#[test]
fn what_shows_no_whole_screen_is_told() {
    let told = |photo: &Image<LinearRgb>| screen_corners(photo).unwrap_err().to_string();
    let (whole, _) = photo(0.0, 0.0, BROWN);
    // One side beyond the border, and all of them.
    for (x, width) in [(150, 450), (150, 300)] {
        let near = whole.crop(Roi {
            x,
            y: 60,
            width,
            height: 330,
        });
        assert!(
            told(&near).contains("it reaches the border of the photo; photograph all of it"),
            "{}",
            told(&near)
        );
    }
    // Then a box that fills the photo is not mistaken for it.
    let boxed = Image::from_fn(200, 150, |x, y| {
        let inside = (50..150).contains(&x) && (40..110).contains(&y);
        if inside {
            LinearRgb::new(0.6, 0.05, 0.05)
        } else {
            GREEN
        }
    });
    assert!(
        told(&boxed).contains("it reaches the border"),
        "{}",
        told(&boxed)
    );
    let grey = Image::filled(90, 60, LinearRgb::grey(0.5));
    assert!(told(&grey).contains("no colour such as green or blue covers a tenth"));
    let disc = Image::from_fn(200, 200, |x, y| {
        let inside = (x as f64 - 100.0).hypot(y as f64 - 100.0) < 80.0;
        if inside { GREEN } else { LinearRgb::grey(0.2) }
    });
    assert!(
        told(&disc).contains("one of its sides has no straight border"),
        "{}",
        told(&disc)
    );
    let nothing: Image<LinearRgb> = Image::new(0, 0);
    assert!(screen_corners(&nothing).is_err());
}
