//! A photo is labelled by clicks, in a real browser.

mod browser;

use browser::studio::{Studio, copy_files, samples};
use browser::{Browser, CTRL, SHIFT};
use petcomp::camera::{self, CameraFile, Label, Solution};
use petcomp::io;
use std::path::Path;
use std::time::Instant;

/// How far from where the floor ends the sides of the sample tray change most, pixels, as a person
/// sees it too: its walls rise from the floor with a rounding.
const MAX_OFF_PX: f64 = 0.7;
const PHOTO_SIZE: [f64; 2] = [1280.0, 960.0];

/// A folder with the sample photos, and with the labels of some.
fn photos(labelled: &[&str]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    copy_files(&samples("backgrounds"), dir.path(), |name| {
        let stem = name.split('.').next().unwrap();
        name.ends_with(".jpg") || name.ends_with(".label.json") && labelled.contains(&stem)
    });
    dir
}

/// Where the sample's corners truly are.
fn truth(stem: &str) -> [[f64; 2]; 4] {
    let path = samples("backgrounds").join(format!("{stem}.label.json"));
    let label: Label = io::read_json(path).unwrap();
    label.surface.corners_px.unwrap()
}

/// Where a pixel of the photo is on the page, while all of the photo is shown.
fn on_page(browser: &mut Browser, [x, y]: [f64; 2]) -> [f64; 2] {
    let [left, top, width, height] = browser.place("#stage canvas");
    let zoom = 0.94 * (width / PHOTO_SIZE[0]).min(height / PHOTO_SIZE[1]);
    [
        left + (width - PHOTO_SIZE[0] * zoom) / 2.0 + x * zoom,
        top + (height - PHOTO_SIZE[1] * zoom) / 2.0 + y * zoom,
    ]
}

fn open_photo(browser: &mut Browser, studio: &Studio, photo: &str) {
    browser.go(&studio.page(&format!("corners?photo={photo}")));
    browser.wait(&format!(
        "document.querySelector('#title').innerText === '{photo}'"
    ));
}

fn click_corners(browser: &mut Browser, corners: &[[f64; 2]]) {
    for corner in corners {
        let at = on_page(browser, *corner);
        // A mouse has whole pixels, of which each is almost two of the photo.
        browser.click(at.map(f64::round));
    }
}

fn farthest_px(label: &Label, truth: [[f64; 2]; 4]) -> f64 {
    let found = label.surface.corners_px.unwrap();
    let off = (0..4).map(|i| (found[i][0] - truth[i][0]).hypot(found[i][1] - truth[i][1]));
    off.fold(0.0, f64::max)
}

fn saved(folder: &Path, stem: &str) -> (Label, CameraFile) {
    let label = io::read_json(folder.join(format!("{stem}.label.json"))).unwrap();
    let camera = io::read_json(folder.join(format!("{stem}.camera.json"))).unwrap();
    (label, camera)
}

#[test]
fn four_clicks_and_a_size_make_the_label_that_the_command_line_makes() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&[]);
    let studio = Studio::over(dir.path());
    let start = Instant::now();
    open_photo(&mut browser, &studio, "bg0001.jpg");
    click_corners(&mut browser, &truth("bg0001"));
    browser.fill("#width", "0.56");
    browser.fill("#height", "0.37");
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    browser.click_on("#snap");
    browser.wait("document.querySelector('footer').innerText.includes('all four sides')");
    browser.screenshot("studio_corners");
    browser.prefer_dark(true);
    browser.screenshot("studio_corners_dark");
    browser.click_on("#save");
    browser.wait("document.querySelector('footer').innerText.includes('saved')");
    println!(
        "first photo: 4 clicks, 2 numbers, 2 buttons, {:.1} s",
        start.elapsed().as_secs_f64()
    );
    let (label, camera) = saved(dir.path(), "bg0001");
    let off = farthest_px(&label, truth("bg0001"));
    println!("corners to {off:.2} px");
    assert!(off < MAX_OFF_PX, "{off}: {:?}", label.surface);
    assert_same_as_command_line(dir.path(), &label, &camera);
    browser.assert_content();
}

/// The files of `petcomp camera init` with these corners, and of `petcomp camera solve`.
fn assert_same_as_command_line(folder: &Path, label: &Label, camera: &CameraFile) {
    let path = folder.join("bg0001.label.json");
    let mut expected = camera::init_label(&folder.join("bg0001.jpg"), &path, None).unwrap();
    expected.surface = label.surface.clone();
    assert_eq!(
        io::read_text(&path).unwrap(),
        camera::commented(&expected).unwrap()
    );
    let labelled = camera::read_label(&path).unwrap();
    let solution = camera::solve(&labelled, &Default::default()).and_then(Solution::fitting);
    assert_eq!(camera, &CameraFile::new(&labelled, &solution.unwrap()));
}

#[test]
fn the_next_photo_needs_no_size_and_arrows_move_by_a_tenth_of_a_pixel() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0000"]);
    let studio = Studio::over(dir.path());
    let start = Instant::now();
    open_photo(&mut browser, &studio, "bg0003.jpg");
    assert_eq!(
        browser.eval("document.querySelector('#width').value"),
        "0.56"
    );
    click_corners(&mut browser, &truth("bg0003"));
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    browser.press("s", 0);
    browser.wait("document.querySelector('footer').innerText.includes('all four sides')");
    browser.press("1", 0);
    browser.press("ArrowRight", 0);
    browser.press("ArrowRight", 0);
    browser.press("ArrowLeft", SHIFT);
    browser.press("ArrowRight", SHIFT);
    browser.press("ArrowLeft", 0);
    browser.press("ArrowLeft", 0);
    browser.press("Enter", 0);
    browser.wait("document.querySelector('footer').innerText.includes('saved')");
    println!(
        "second photo: 4 clicks, 8 keys, {:.1} s",
        start.elapsed().as_secs_f64()
    );
    let (label, _) = saved(dir.path(), "bg0003");
    let off = farthest_px(&label, truth("bg0003"));
    assert!(off < MAX_OFF_PX, "{off}");
    assert_eq!(label.surface.id, "tray");
    browser.assert_content();
}

#[test]
fn markers_are_found_by_themselves() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0004"]);
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0004.jpg");
    browser.press("m", 0);
    browser.fill("#width", "0.57");
    browser.wait("document.querySelector('footer').innerText.startsWith('4 markers')");
    assert!(browser.text("footer").contains("16 corners of known place"));
    browser.screenshot("markers");
    // What was typed meanwhile stays.
    browser.press("s", CTRL);
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let label: Label = io::read_json(dir.path().join("bg0004.label.json")).unwrap();
    assert_eq!(
        (label.surface.width_m, label.points.len()),
        (Some(0.57), 16)
    );
    browser.assert_content();
}

#[test]
fn what_is_not_saved_stays_with_its_photo_beside_a_label_that_cannot_be_read() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0000"]);
    std::fs::write(dir.path().join("bg0001.label.json"), "{ oops").unwrap();
    let path = dir.path().join("bg0000.label.json");
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0000.jpg");
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    browser.press("1", 0);
    browser.press("ArrowRight", SHIFT);
    browser.press("s", CTRL);
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let saved = io::read_text(&path).unwrap();
    let mark = "document.querySelector(\"[data-photo='bg0000.jpg'] .mark\").innerText";
    browser.press("z", CTRL);
    browser.wait(&format!("{mark} === 'not saved'"));

    browser.click_on("[data-photo='bg0001.jpg'] button");
    browser.wait("document.querySelector('#title').innerText === 'bg0001.jpg'");
    assert_eq!(browser.text("#facts"), "");
    assert_eq!(
        browser.eval("document.querySelector('#save').disabled"),
        true
    );
    browser.press("Backspace", 0);
    click_corners(&mut browser, &truth("bg0001"));
    browser.press("s", CTRL);

    browser.click_on("[data-photo='bg0000.jpg'] button");
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    assert_eq!(browser.eval(mark), "not saved");
    assert_eq!(io::read_text(&path).unwrap(), saved);
    browser
        .complaints
        .retain(|complaint| !complaint.contains("422"));
    browser.assert_content();
}

#[test]
fn a_stale_save_is_asked_about() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0000"]);
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0000.jpg");
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    let path = dir.path().join("bg0000.label.json");
    let text = io::read_text(&path).unwrap();
    let theirs = text.replace("\"tray\"", "\"their tray\"");
    io::write_text(&path, &theirs).unwrap();
    browser.press("3", 0);
    browser.press("ArrowUp", 0);
    browser.press("Enter", 0);
    browser.wait_for("dialog");
    assert_eq!(io::read_text(&path).unwrap(), theirs);
    browser.click_on("dialog button[value='Load theirs']");
    browser.wait("document.querySelector('#surface').value === 'their tray'");
    assert_eq!(io::read_text(&path).unwrap(), theirs);
}

#[test]
fn photos_of_one_camera_are_solved_together() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0000", "bg0003"]);
    for stem in ["bg0000", "bg0003"] {
        let path = dir.path().join(format!("{stem}.label.json"));
        let text = io::read_text(&path).unwrap();
        let shared = text.replace(&stem.replace("bg", "cam-"), "shared");
        io::write_text(&path, &shared).unwrap();
    }
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0000.jpg");
    browser.click_on("#joint");
    browser.wait_for("dialog table");
    assert!(browser.text("dialog table").contains("2 photos"));
    browser.screenshot("joint");
    let (_, camera) = saved(dir.path(), "bg0003");
    assert_eq!(camera.solved_from.unwrap().together.len(), 2);
}

#[test]
fn a_phone_shows_the_photo_first() {
    let Some(mut browser) = Browser::open(412, 860) else {
        return;
    };
    let dir = photos(&["bg0000"]);
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0000.jpg");
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    let wide = browser.eval("document.documentElement.scrollWidth");
    assert!(wide.as_f64().unwrap() <= 412.0, "{wide}");
    browser.screenshot("studio_phone");
    browser.assert_content();
}
