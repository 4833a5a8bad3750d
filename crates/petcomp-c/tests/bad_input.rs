//! Whatever a C program gives: a status and a sentence, no crash.
#![expect(unsafe_code, reason = "calls what C calls")]

use petcomp_c::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ffi::{CStr, c_char};
use std::ptr::{null, null_mut};

const CALLS: usize = 100_000;

fn message() -> String {
    // SAFETY: it stays until the next call.
    let text = unsafe { CStr::from_ptr(petcomp_error_message()) };
    text.to_str().unwrap().to_owned()
}

fn assert_fails(status: Status, expected: Status, what: &str) {
    assert_eq!((status, message().as_str()), (expected, what));
}

/// `size` is width, height and row stride.
fn key_into(matte: &mut [f32], pixels: &[f32], size: [usize; 3], options: *const c_char) -> Status {
    let screen = [0.1, 0.8, 0.1];
    // SAFETY: the sizes of the tests are at most those of the slices, or refused.
    unsafe {
        petcomp_key(
            pixels.as_ptr(),
            size[0],
            size[1],
            size[2],
            screen.as_ptr(),
            options,
            matte.as_mut_ptr(),
            null_mut(),
        )
    }
}

fn key(pixels: &[f32], size: [usize; 3], options: *const c_char) -> Status {
    key_into(&mut [0.0; 64], pixels, size, options)
}

fn solve(corners: [f64; 8], size: [f64; 2], image: [u32; 2], focal_px: f64) -> Status {
    let mut camera = bytemuck::Zeroable::zeroed();
    // SAFETY: arrays of the right length.
    unsafe {
        petcomp_camera_solve(
            corners.as_ptr(),
            size.as_ptr(),
            image.as_ptr(),
            focal_px,
            &mut camera,
            null_mut(),
            0,
            null_mut(),
        )
    }
}

#[test]
fn wrong_sizes_of_a_picture_are_refused() {
    let pixels = [0.5; 16];
    let refused = Status::BadArgument;
    assert_fails(
        key(&pixels, [0, 1, 4], null()),
        refused,
        "width, height: 0 x 1 pixels, expected at least 1 x 1 and at most 32768 a side and 134217728 in total",
    );
    assert_fails(
        key(&pixels, [2, 2, 7], null()),
        refused,
        "row_stride: 7 floats, expected at least 8",
    );
    assert_eq!(key(&pixels, [usize::MAX, 2, usize::MAX], null()), refused);
    assert_eq!(key(&pixels, [1, 2, usize::MAX], null()), refused);
    assert_fails(
        key(&pixels, [2, 2, 1 << 62], null()),
        refused,
        "row_stride: 4611686018427387904 floats, expected at most 1152921504606846975",
    );
    assert_eq!(key(&pixels, [2, 2, 8], null()), Status::Ok);
    assert_eq!(message(), "");
}

#[test]
fn rows_may_have_gaps() {
    let tight: Vec<f32> = (0..16).map(|i| i as f32 / 16.0).collect();
    let gaps: Vec<f32> = tight
        .chunks(8)
        .flat_map(|row| [row, &[f32::NAN; 3]].concat())
        .collect();
    let mattes = [(&tight, 8), (&gaps, 11)].map(|(pixels, stride)| {
        let mut matte = [0.0; 4];
        let status = key_into(&mut matte, pixels, [2, 2, stride], null());
        assert_eq!(status, Status::Ok, "{}", message());
        matte
    });
    assert_eq!(mattes[0], mattes[1]);
}

#[test]
fn numbers_that_are_none_and_wrong_options_are_refused() {
    let mut pixels = [0.5; 16];
    let options = c"{\"clip_black\": 7}";
    assert_eq!(key(&pixels, [2, 2, 8], options.as_ptr()), Status::Value);
    assert!(message().contains("clip_black"), "{}", message());
    assert_eq!(
        key(&pixels, [2, 2, 8], c"\xff".as_ptr()),
        Status::BadArgument
    );
    assert_fails(
        key(&pixels, [2, 2, 8], c"[]".as_ptr()),
        Status::Value,
        r#"options: not a JSON object, expected one such as {"clip_black": 0.1}"#,
    );
    pixels[9] = f32::NAN;
    assert_fails(
        key(&pixels, [2, 2, 8], null()),
        Status::BadArgument,
        "rgba: not finite in column 0, row 1, expected finite numbers",
    );
}

#[test]
fn null_and_misaligned_pointers_are_refused() {
    // SAFETY: null is refused, and so is what is misaligned.
    unsafe {
        let nowhere = petcomp_key(null(), 1, 1, 4, null(), null(), null_mut(), null_mut());
        assert_fails(
            nowhere,
            Status::BadArgument,
            "rgba: null, expected a pointer",
        );
        let status = petcomp_pipeline_open(null(), null(), 0, null_mut());
        assert_fails(
            status,
            Status::BadArgument,
            "pipeline: null, expected a pointer",
        );
        let odd = [0_u64; 2].as_ptr().cast::<u8>().add(1).cast::<f64>();
        let status = petcomp_camera_solve(
            odd,
            null(),
            null(),
            0.0,
            null_mut(),
            null_mut(),
            0,
            null_mut(),
        );
        assert_fails(
            status,
            Status::BadArgument,
            "corners_px: misaligned, expected a multiple of 8",
        );
    }
}

#[test]
fn a_recipe_that_is_not_there_is_named() {
    let mut pipeline = PipelineHandle { id: 7 };
    // SAFETY: a text and a place.
    let status =
        unsafe { petcomp_pipeline_open(c"no/recipe.toml".as_ptr(), null(), 0, &mut pipeline) };
    assert_fails(status, Status::File, "no/recipe.toml: no such file");
    assert_eq!(pipeline.id, 0);
}

#[test]
fn what_is_closed_is_known_to_be() {
    let mut sample = SampleHandle { id: 0 };
    // SAFETY: a place.
    let made = unsafe { petcomp_sample_make(PipelineHandle { id: 0 }, 0, 0, &mut sample) };
    assert_fails(made, Status::Closed, "pipeline 0: closed, or never opened");
    assert_fails(
        petcomp_sample_free(sample),
        Status::Closed,
        "sample 0: closed, or never opened",
    );
}

#[test]
fn corners_that_no_camera_can_have_seen_are_refused() {
    let corners = [0.0, 0.0, 10.0, 0.0, 5.0, 1.0, 0.0, 10.0];
    assert_fails(
        solve(corners, [0.5, 0.4], [100, 100], f64::NAN),
        Status::BadArgument,
        "focal_px: NaN, expected pixels, or 0 for an unknown focal length",
    );
    let status = solve(corners, [0.5, 0.4], [100, 100], 0.0);
    assert_eq!(status, Status::Camera, "{}", message());
}

#[test]
fn arguments_that_cannot_be_right_are_no_matter_of_the_camera() {
    let corners = [236.0, 239.0, 1020.0, 216.0, 1009.0, 701.0, 276.0, 739.0];
    let refused = Status::BadArgument;
    assert_fails(
        solve(corners, [0.56, 0.37], [0, 853], 0.0),
        refused,
        "image: 0 x 853 pixels, expected at least 1 x 1",
    );
    assert_fails(
        solve(corners, [f64::NAN, 0.37], [1280, 853], 0.0),
        refused,
        "size_m: NaN at 0, expected finite numbers",
    );
    let mut odd = corners;
    odd[3] = f64::INFINITY;
    assert_fails(
        solve(odd, [0.56, 0.37], [1280, 853], 0.0),
        refused,
        "corners_px: inf at 3, expected finite numbers",
    );
}

#[test]
fn a_rectangle_in_millimetres_is_refused() {
    let corners = [236.0, 239.0, 1020.0, 216.0, 1009.0, 701.0, 276.0, 739.0];
    for (size, told) in [
        ([560.0, 370.0], "surface.width_m: 560"),
        ([45.0, 30.0], "surface: the camera would be"),
    ] {
        let status = solve(corners, size, [1280, 853], 0.0);
        assert_eq!(status, Status::Value, "{}", message());
        assert!(message().starts_with(told), "{}", message());
    }
}

#[test]
fn a_report_that_does_not_fit_says_how_long_it_is() {
    let corners = [236.0, 239.0, 1020.0, 216.0, 1009.0, 701.0, 276.0, 739.0];
    let solve = |camera: &mut CameraModel, report: &mut [c_char], length: &mut usize| {
        // SAFETY: arrays of the right length.
        unsafe {
            petcomp_camera_solve(
                corners.as_ptr(),
                [0.56, 0.37].as_ptr(),
                [1280, 853].as_ptr(),
                0.0,
                camera,
                report.as_mut_ptr(),
                report.len(),
                length,
            )
        }
    };
    let (mut camera, mut length) = (bytemuck::Zeroable::zeroed(), 0);
    assert_eq!(
        solve(&mut camera, &mut [0; 4], &mut length),
        Status::BufferTooSmall
    );
    assert!(camera.focal_px[0] > 100.0);
    let mut report = vec![0; length];
    assert_eq!(
        solve(&mut camera, &mut report, &mut length),
        Status::Ok,
        "{}",
        message()
    );
    let text: Vec<u8> = report[..length - 1].iter().map(|&c| c as u8).collect();
    let document: serde_json::Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(document["format"], "plane-camera");
}

#[test]
fn messages_are_of_their_own_thread() {
    assert_eq!(petcomp_sample_free(SampleHandle { id: 0 }), Status::Closed);
    std::thread::spawn(|| assert_eq!(message(), ""))
        .join()
        .unwrap();
    assert_ne!(message(), "");
}

/// Sizes, strides, handles, numbers and nulls by chance; memory is as large as is said.
#[test]
fn calls_by_chance_never_crash() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut statuses = std::collections::BTreeMap::new();
    for _ in 0..CALLS {
        let status = call_by_chance(&mut random);
        *statuses.entry(format!("{status:?}")).or_insert(0) += 1;
    }
    println!("{statuses:?}");
    assert!(!statuses.contains_key("Internal"), "{statuses:?}");
    assert!(statuses["Ok"] > CALLS / 100, "{statuses:?}");
}

fn call_by_chance(random: &mut ChaCha8Rng) -> Status {
    let handle = random.random_range(0..4);
    match random.random_range(0..5) {
        0 => key_by_chance(random),
        1 => camera_by_chance(random),
        2 => petcomp_sample_free(SampleHandle { id: handle }),
        3 => petcomp_pipeline_close(PipelineHandle { id: handle }),
        // SAFETY: null is refused.
        _ => unsafe { petcomp_sample_size(SampleHandle { id: handle }, null_mut(), null_mut()) },
    }
}

fn number(random: &mut ChaCha8Rng) -> f64 {
    match random.random_range(0..20) {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => -1e300,
        3 => 0.0,
        _ => random.random_range(0.0..300.0),
    }
}

fn key_by_chance(random: &mut ChaCha8Rng) -> Status {
    let pixels: Vec<f32> = (0..256).map(|_| random.random_range(-1.0..2.0)).collect();
    let [width, height] = [0; 2].map(|_| random.random_range(0..5));
    let stride = random.random_range(0..40);
    let options = [
        null(),
        c"{\"blur_pre\": 3}".as_ptr(),
        c"{".as_ptr(),
        c"{\"profile\": 3}".as_ptr(),
    ];
    key(
        &pixels,
        [width, height, stride],
        options[random.random_range(0..4)],
    )
}

fn camera_by_chance(random: &mut ChaCha8Rng) -> Status {
    let corners: [f64; 8] = std::array::from_fn(|_| number(random));
    let size = [number(random), number(random)];
    let image = [random.random_range(0..400), random.random_range(0..400)];
    solve(corners, size, image, number(random))
}
