//! Captures of a known object, made from the formulas.

use super::*;
use crate::color::{from_srgb8, to_srgb8};
use crate::filter;
use crate::geom::{Homography, Point2};
use crate::image::Image;
use crate::io::{Chroma, through_jpeg};
use crate::pixel::{LinearRgb, Mix};

const DISPLAY: Display = Display {
    size_px: [640, 400],
    width: Some(0.32),
};
const PHOTO: (usize, usize) = (960, 660);
/// Middle and radii of the object, pixels of the display.
const MIDDLE: [f64; 2] = [320.0, 205.0];
const RADII: [f64; 2] = [150.0, 60.0];
/// What the display reflects of the room.
const ROOM: f32 = 0.02;

/// What photographing does to the light.
#[derive(Clone, Copy)]
struct Conditions {
    noise: f32,
    is_jpeg: bool,
    /// Exposure of a frame.
    exposure: fn(Frame) -> f32,
    /// Motion of a photo, pixels.
    motion: fn(Frame) -> [f64; 2],
    has_object: bool,
}

const STILL: Conditions = Conditions {
    noise: 0.004,
    is_jpeg: false,
    exposure: |_| 0.8,
    motion: |_| [0.0; 2],
    has_object: true,
};
const BARE: Conditions = Conditions {
    has_object: false,
    ..STILL
};

/// Place in the object, -1 to 1 across it.
fn across([u, v]: [f64; 2]) -> [f64; 2] {
    [(u - MIDDLE[0]) / RADII[0], (v - MIDDLE[1]) / RADII[1]]
}

fn is_inside(at: [f64; 2]) -> bool {
    let [a, b] = across(at);
    a * a + b * b < 1.0
}

/// A cap is opaque.
fn is_cap(at: [f64; 2]) -> bool {
    across(at)[0] > 0.6
}

fn transmittance(at: [f64; 2]) -> LinearRgb {
    let [a, b] = across(at);
    let wall = (0.9 - 0.4 * (a * a + b * b)) as f32;
    if is_cap(at) {
        LinearRgb::BLACK
    } else {
        LinearRgb::new(0.9 * wall, wall, 0.8 * wall)
    }
}

fn reflected(at: [f64; 2]) -> LinearRgb {
    if is_cap(at) {
        LinearRgb::new(0.3, 0.05, 0.04)
    } else {
        LinearRgb::new(0.01, 0.02, 0.01)
    }
}

/// Pixels of the display.
fn displacement(at: [f64; 2]) -> [f64; 2] {
    let [a, b] = across(at);
    [9.0 * a * (1.0 - b * b), -14.0 * b * (1.0 - a * a)]
}

/// Unit noise by place.
fn noise(seed: u64) -> f32 {
    let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((mixed >> 40) as f32 / (1_u64 << 24) as f32 - 0.5) * libm::sqrtf(12.0)
}

/// What a photo shows of the display's plane, by a camera that is tilted a little.
fn display_from_photo([dx, dy]: [f64; 2]) -> Homography {
    let photo_from_display = nalgebra::Matrix3::new(
        1.36,
        0.03,
        40.0 + dx,
        -0.02,
        1.38,
        42.0 + dy,
        2e-5,
        4e-5,
        1.0,
    );
    Homography(photo_from_display).inverse().unwrap()
}

fn photo(frame: Frame, conditions: Conditions) -> Image<LinearRgb> {
    let shown = from_srgb8(&draw_frame(&DISPLAY, frame));
    let map = display_from_photo((conditions.motion)(frame));
    let sharp = Image::from_fn(PHOTO.0, PHOTO.1, |x, y| {
        let at = map.map(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
        light(&shown, [at.x, at.y], conditions.has_object)
    });
    let seen = filter::gaussian_blur(&sharp, 0.7);
    let (exposure, sigma) = ((conditions.exposure)(frame), conditions.noise);
    let seen = Image::from_fn(PHOTO.0, PHOTO.1, |x, y| {
        let seed = 3 * ((frame.number() * PHOTO.1 + y) * PHOTO.0 + x) as u64;
        let p = seen[(x, y)].scale(exposure);
        LinearRgb::new(
            p.r + sigma * noise(seed),
            p.g + sigma * noise(seed + 1),
            p.b + sigma * noise(seed + 2),
        )
    });
    if conditions.is_jpeg {
        from_srgb8(&through_jpeg(&to_srgb8(&seen), 92, Chroma::Full).unwrap())
    } else {
        seen
    }
}

/// Light from a place of the display, through the object where it is.
fn light(shown: &Image<LinearRgb>, at: [f64; 2], has_object: bool) -> LinearRgb {
    if !has_object || !is_inside(at) {
        return emitted(shown, at);
    }
    let d = displacement(at);
    reflected(at) + transmittance(at) * emitted(shown, [at[0] + d[0], at[1] + d[1]])
}

fn emitted(shown: &Image<LinearRgb>, [u, v]: [f64; 2]) -> LinearRgb {
    let [w, h] = DISPLAY.size_px.map(f64::from);
    if !(0.0..w).contains(&u) || !(0.0..h).contains(&v) {
        return LinearRgb::grey(ROOM);
    }
    // A little darker to one side, and a display's white.
    let shine = (0.95 - 0.1 * u / w) as f32;
    let white = LinearRgb::new(1.0, 0.97, 0.93).scale(shine);
    LinearRgb::grey(ROOM) + white * filter::sample_bilinear_clamped(shown, u, v)
}

fn frames(with_stripes: bool) -> Vec<Frame> {
    Frame::all(with_stripes).collect()
}

/// Measures photos of some frames, and of some without the object.
fn measured(
    frames: &[Frame],
    empty: &[Frame],
    conditions: Conditions,
) -> crate::Result<(View, Measured)> {
    let bare = Conditions {
        has_object: false,
        ..conditions
    };
    measured_of(&shots(frames, conditions), &shots(empty, bare))
}

fn shots(frames: &[Frame], conditions: Conditions) -> Vec<Image<LinearRgb>> {
    let frames = frames.iter();
    frames.map(|&frame| photo(frame, conditions)).collect()
}

/// A photo whose light ends at 1.
fn limited(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    photo.map(|p| p.map(|v| v.min(1.0)))
}

/// A photo of an object that reflects more light, left of a place across it.
fn lit(photo: &Image<LinearRgb>, light: f32, right: f64) -> Image<LinearRgb> {
    let map = display_from_photo([0.0; 2]);
    Image::from_fn(PHOTO.0, PHOTO.1, |x, y| {
        let at = map.map(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
        let at = [at.x, at.y];
        let is_lit = is_inside(at) && across(at)[0] < right;
        photo[(x, y)].map(|v| if is_lit { v + light } else { v })
    })
}

fn measured_of(
    photos: &[Image<LinearRgb>],
    empty: &[Image<LinearRgb>],
) -> crate::Result<(View, Measured)> {
    let names = |count: usize| (0..count).map(|i| format!("photo {i}")).collect::<Vec<_>>();
    let (names, empty_names) = (names(photos.len()), names(empty.len()));
    let (read, read_empty) = (
        |i: usize| Ok(photos[i].clone()),
        |i: usize| Ok(empty[i].clone()),
    );
    let sources = Sources {
        names: &names,
        read: &read,
    };
    let empty_sources = Sources {
        names: &empty_names,
        read: &read_empty,
    };
    let (recognised, empty_recognised) = (
        sources.recognised(&DISPLAY, usize::MAX)?,
        empty_sources.recognised(&DISPLAY, usize::MAX)?,
    );
    let photos = Photos {
        sources,
        recognised: &recognised,
    };
    let empty = Photos {
        sources: empty_sources,
        recognised: &empty_recognised,
    };
    let view = View::of_photo(
        &DISPLAY,
        photos.first_of(Frame::White).unwrap_or(&recognised[0]),
    );
    measure(&DISPLAY, &view, &photos, &empty).map(|measured| (view, measured))
}

/// Pixels of the view that show the object, not its rim or the cap's, and their places.
fn inner_places(view: &View) -> Vec<((usize, usize), [f64; 2])> {
    let (w, h) = view.size;
    let all = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
    let places = all.map(|(x, y)| ((x, y), view.display_at(x, y)));
    places
        .filter(|(_, at)| {
            let [a, b] = across(*at);
            a * a + b * b < 0.9 && (a - 0.6).abs() > 0.04
        })
        .collect()
}

/// Mean absolute errors of V and F inside the object.
fn film_errors(view: &View, measured: &Measured) -> [f32; 2] {
    let places = inner_places(view);
    let mut sums = [0.0_f32; 2];
    for (pixel, at) in &places {
        let film = measured.film[*pixel];
        let off = |a: LinearRgb, b: LinearRgb| a.add_scaled(-1.0, b).map(f32::abs);
        let errors = [
            off(film.transmittance(), transmittance(*at)),
            off(film.color, reflected(*at).scale(0.8)),
        ];
        for (sum, error) in sums.iter_mut().zip(errors) {
            *sum += (error.r + error.g + error.b) / 3.0;
        }
    }
    sums.map(|sum| sum / places.len() as f32)
}

/// Share of the clear part where the displacement is known, and the 90 % quantile of its error,
/// pixels of the photo.
fn bend_errors(view: &View, measured: &Measured) -> [f64; 2] {
    let refraction = measured.refraction.as_ref().unwrap();
    let clear: Vec<_> = inner_places(view)
        .into_iter()
        .filter(|(_, at)| !is_cap(*at))
        .collect();
    let known = clear.iter().filter(|(pixel, _)| refraction.known[*pixel]);
    let mut errors: Vec<f64> = known
        .map(|(pixel, at)| {
            let (got, expected) = (refraction.paths[*pixel].displacement, displacement(*at));
            let off = [0, 1].map(|axis| f64::from(got[axis]) - expected[axis]);
            libm::hypot(off[0], off[1]) / view.display_px
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    [
        errors.len() as f64 / clear.len() as f64,
        errors[errors.len() * 9 / 10],
    ]
}

#[test]
fn black_and_white_give_transmittance_and_reflected_light() {
    let (view, measured) = measured(&frames(false), &[], STILL).unwrap();
    let [v, f] = film_errors(&view, &measured);
    println!("V to {v:.4}, F to {f:.4}");
    assert!(v < 0.01 && f < 0.005, "{v} {f}");
    assert!(measured.refraction.is_none());
    assert_eq!(measured.diagnostics, []);
    let area = measured.outline.area() * view.display_px * view.display_px;
    let expected = std::f64::consts::PI * RADII[0] * RADII[1];
    assert!(
        (area / expected - 1.0).abs() < 0.02,
        "{area} for {expected}"
    );
    let stated = measured.sigma.pixels().iter().filter(|s| **s > 0.0);
    let (sum, count) = stated.fold((0.0, 0), |(sum, n), s| (sum + s, n + 1));
    let stated = sum / count as f32;
    assert!((0.002..0.012).contains(&stated), "{stated}");
}

#[test]
fn exposures_may_drift_and_photos_be_jpegs_of_an_empty_display_too() {
    let conditions = Conditions {
        is_jpeg: true,
        exposure: |frame| if frame == Frame::Black { 0.68 } else { 0.8 },
        ..STILL
    };
    let (view, measured) = measured(&frames(false), &frames(false), conditions).unwrap();
    let [v, f] = film_errors(&view, &measured);
    println!("V to {v:.4}, F to {f:.4}");
    assert!(v < 0.012 && f < 0.008, "{v} {f}");
    assert_eq!(measured.diagnostics, []);
}

#[test]
fn stripes_give_the_displacement() {
    let (view, measured) = measured(&frames(true), &[], STILL).unwrap();
    let [share, off] = bend_errors(&view, &measured);
    println!("known on {share:.3}, to {off:.3} px on 90 %");
    assert!(share > 0.97 && off < 0.7, "{share} {off}");
    let refraction = measured.refraction.unwrap();
    let cap = inner_places(&view)
        .into_iter()
        .filter(|(_, at)| is_cap(*at));
    assert!(
        cap.into_iter().all(|(pixel, _)| !refraction.known[pixel]),
        "nothing is seen through a cap"
    );
    let known = refraction.known.zip_map(&measured.film, |known, film| {
        known && film.opacity.is_black()
    });
    assert_eq!(known.count(), 0);
}

#[test]
fn a_camera_that_moves_a_little_is_followed() {
    let conditions = Conditions {
        motion: |frame| {
            let k = frame.number() as f64;
            [1.3 * libm::sin(1.7 * k), 1.1 * libm::cos(2.3 * k)]
        },
        ..STILL
    };
    let (view, measured) = measured(&frames(true), &[], conditions).unwrap();
    let ([v, _], [share, off]) = (film_errors(&view, &measured), bend_errors(&view, &measured));
    println!("V to {v:.4}, known on {share:.3}, to {off:.3} px on 90 %");
    assert!(v < 0.012 && share > 0.95 && off < 1.0, "{v} {share} {off}");
    assert!(
        measured
            .diagnostics
            .iter()
            .any(|d| d.code == crate::Code::CameraMoved)
    );
}

#[test]
fn what_is_wrong_with_a_capture_is_said() {
    let told = |frames: &[Frame], conditions| match measured(frames, &[], conditions) {
        Ok((_, measured)) => measured
            .diagnostics
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("; "),
        Err(error) => error.to_string(),
    };
    let white = told(&[Frame::Black], STILL);
    assert!(white.contains("no photo of the white frame"), "{white}");
    let black = told(&[Frame::White], STILL);
    assert!(
        black.contains("no photo of the black frame among photo 0"),
        "{black}"
    );
    let first: Vec<_> = frames(true).into_iter().take(3).collect();
    let some = told(&first, STILL);
    assert!(
        some.contains("no photo of stripes_x_coarse_2, stripes_x_coarse_3"),
        "{some}"
    );
    let drifting = Conditions {
        exposure: |frame| if frame == Frame::Black { 0.5 } else { 0.8 },
        ..STILL
    };
    let drift = told(&frames(false), drifting);
    let off = drift
        .split("photo 0: its exposure or colour differs by ")
        .nth(1);
    let off = off.and_then(|off| off.split(" % from the white frame").next());
    let off: Option<f64> = off.and_then(|off| off.parse().ok());
    assert!(off.is_some_and(|off| (off - 60.0).abs() < 0.5), "{drift}");
    let nothing = told(&frames(false), BARE);
    assert!(nothing.contains("nothing lies on the display"), "{nothing}");
}

/// A photo as from the side: across the display green and blue change by a fifth, red not at all.
fn aslant(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    let map = display_from_photo([0.0; 2]);
    Image::from_fn(PHOTO.0, PHOTO.1, |x, y| {
        let at = map.map(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
        let across = (at.x / f64::from(DISPLAY.size_px[0])) as f32;
        let p = photo[(x, y)].scale(1.0 / (0.95 - 0.1 * across));
        let change = 0.9 + 0.2 * across;
        LinearRgb::new(p.r, change * p.g, change * p.b)
    })
}

/// A photo of the bare display, its white yellowish, through a clear blue sheet.
fn through_blue(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    let (yellowish, blue) = (LinearRgb::new(1.0, 0.9, 0.6), LinearRgb::new(0.1, 0.1, 0.9));
    let map = display_from_photo([0.0; 2]);
    Image::from_fn(PHOTO.0, PHOTO.1, |x, y| {
        let at = map.map(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
        let light = yellowish * photo[(x, y)];
        if is_inside([at.x, at.y]) {
            blue * light
        } else {
            light
        }
    })
}

#[test]
fn a_clear_coloured_sheet_has_no_haze_on_a_display_of_another_colour() {
    let bare = shots(&frames(true), BARE);
    let photos: Vec<_> = bare.iter().map(through_blue).collect();
    let (view, measured) = measured_of(&photos, &[]).unwrap();
    let paths = measured.refraction.unwrap().paths;
    let places = inner_places(&view);
    let sum: f32 = places.iter().map(|(pixel, _)| paths[*pixel].haze).sum();
    let haze = sum / places.len() as f32;
    assert!(haze < 0.03, "{haze}");
}

#[test]
fn a_display_whose_colour_changes_from_side_to_side_is_fitted() {
    let above = shots(&frames(false), STILL);
    let photos: Vec<_> = above.iter().map(aslant).collect();
    let (view, measured) = measured_of(&photos, &[]).unwrap();
    let [v, _] = film_errors(&view, &measured);
    assert!(v < 0.015, "{v}");
}

#[test]
fn photos_that_are_exchanged_with_those_of_the_empty_display_are_refused() {
    let [with, without] = [STILL, BARE].map(|conditions| shots(&frames(false), conditions));
    let error = measured_of(&without, &with).err().unwrap().to_string();
    assert!(error.contains("swapped?"), "{error}");
}

#[test]
fn photos_of_a_frame_with_the_object_and_without_are_refused() {
    let [black, white] = [Frame::Black, Frame::White].map(|frame| photo(frame, STILL));
    let with = |again: Vec<Image<LinearRgb>>| {
        let photos = [vec![black.clone(), white.clone()], again].concat();
        measured_of(&photos, &[]).map_err(|e| e.to_string())
    };
    let error = with(shots(&[Frame::White], BARE)).err().unwrap();
    assert!(
        error.contains("photo 1 and photo 2 show the same frame but differ by more than 10 %"),
        "{error}"
    );
    let again = Conditions {
        noise: 0.01,
        exposure: |_| 0.7,
        motion: |_| [1.0, -0.6],
        ..STILL
    };
    assert!(with(shots(&frames(false), again)).is_ok());
}

#[test]
fn a_black_photo_without_the_object_is_named_where_others_show_it() {
    let [black, white] = [Frame::Black, Frame::White].map(|frame| photo(frame, STILL));
    let bare = photo(Frame::Black, BARE);
    // Photos of a frame may differ by more than this object reflects.
    let dim = black.zip_map(&bare, |p, e| p.scale(0.5).add_scaled(0.5, e));
    let with = |others: &[Image<LinearRgb>]| {
        let mut photos = vec![dim.clone(), white.clone()];
        photos.splice(1..1, others.iter().cloned());
        let measured = measured_of(&photos, &[]);
        measured.map(drop).map_err(|e| e.to_string())
    };
    for (count, names) in [(1, "photo 1"), (2, "photo 1 and photo 2")] {
        let error = with(&vec![bare.clone(); count]).unwrap_err();
        let expected = format!("{names}: black frame without the object");
        assert!(error.contains(&expected), "{error}");
    }
    let lamp = lit(&dim, 0.02, 1.0);
    assert_eq!(
        [dim.clone(), lamp].map(|other| with(&[other])),
        [Ok(()), Ok(())]
    );
}

/// A photo of an object with a glint in its middle that clips.
fn glinting(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    let map = display_from_photo([0.0; 2]);
    let bright = Image::from_fn(PHOTO.0, PHOTO.1, |x, y| {
        let at = map.map(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
        let [a, b] = across([at.x, at.y]);
        let light = if a * a + b * b < 0.002 { 0.8 } else { 0.0 };
        photo[(x, y)].map(|v| v + light)
    });
    limited(&bright)
}

#[test]
fn what_clips_in_one_of_several_white_photos_has_no_part_in_the_film() {
    let [black, white] = [Frame::Black, Frame::White].map(|frame| photo(frame, STILL));
    let photos = [black, white.clone(), glinting(&white)];
    let (view, measured) = measured_of(&photos, &[]).unwrap();
    let mut places = inner_places(&view);
    places.retain(|(_, at)| across(*at).iter().map(|v| v * v).sum::<f64>() < 0.0005);
    let off = places
        .iter()
        .map(|(pixel, at)| measured.film[*pixel].transmittance().b - transmittance(*at).b);
    let off = off.sum::<f32>() / places.len() as f32;
    // The mean of both photos would pass all light here, 0.28 more.
    assert!(off.abs() < 0.1, "{off}");
}

/// A photo whose camera says that it was held a quarter turn otherwise.
fn turned(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    let (w, h) = photo.size();
    Image::from_fn(h, w, |x, y| photo[(y, h - 1 - x)])
}

#[test]
fn photos_may_be_turned_against_each_other() {
    let [black, white] = [Frame::Black, Frame::White].map(|frame| photo(frame, STILL));
    let (view, measured) = measured_of(&[turned(&black), white], &[]).unwrap();
    let [v, _] = film_errors(&view, &measured);
    assert!(v < 0.012, "{v}");
    assert_eq!(measured.diagnostics, []);
}

#[test]
fn a_photo_that_clips_is_named_where_the_others_do_not() {
    let limited_shots = |conditions, exposure| {
        let conditions = Conditions {
            exposure,
            ..conditions
        };
        let photos = shots(&frames(false), conditions);
        photos.iter().map(limited).collect::<Vec<_>>()
    };
    let bright: fn(Frame) -> f32 = |_| 1.15;
    for [with, without] in [[STILL.exposure, bright], [bright, STILL.exposure]] {
        let told = measured_of(&limited_shots(STILL, with), &limited_shots(BARE, without)).err();
        let told = told.unwrap().to_string();
        assert!(
            told.contains("photo 1: ") && told.contains("of the white frame is clipped"),
            "{told}"
        );
    }
}

#[test]
fn an_object_that_clips_where_the_display_does_not_is_told() {
    let photos = shots(&frames(false), STILL);
    let with = |right: f64| {
        let photos: Vec<_> = photos
            .iter()
            .map(|photo| limited(&lit(photo, 0.8, right)))
            .collect();
        measured_of(&photos, &[]).map(|(_, measured)| measured.diagnostics)
    };
    let diagnostics = with(-0.6).unwrap();
    let warned = diagnostics.iter().filter(|d| d.needs_review());
    let told: Vec<_> = warned.map(|d| (d.code, d.message.as_str())).collect();
    let [(code, message)] = told[..] else {
        panic!("{told:?}");
    };
    assert_eq!(code, crate::Code::ClippedWhite);
    assert!(
        message.starts_with("photo 1: ")
            && message.contains("of the object is clipped in the white frame"),
        "{message}"
    );
    let error = with(1.0).unwrap_err().to_string();
    assert!(
        error.contains("of the object is clipped in the white frame, expected at most 3 %"),
        "{error}"
    );
}

#[test]
fn a_photo_that_clips_or_has_no_markers_is_refused() {
    let bright = Conditions {
        exposure: |_| 1.6,
        ..STILL
    };
    let photos = shots(&frames(false), bright);
    let photos: Vec<_> = photos.iter().map(limited).collect();
    let error = measured_of(&photos, &[]).err().unwrap().to_string();
    assert!(
        error.contains(
            "of the white frame is clipped, expected at most 0.1 %; use a shorter exposure"
        ),
        "{error}"
    );
    let blank = Image::filled(320, 240, LinearRgb::grey(0.5));
    let error = measured_of(&[blank], &[]).err().unwrap().to_string();
    assert!(
        error.contains("photo 0: 0 of the 4 markers of a frame were found"),
        "{error}"
    );
}
