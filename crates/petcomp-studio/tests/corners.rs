//! A photo is labelled by clicks, in a real browser.

mod browser;

use browser::studio::{Studio, copy_files, samples};
use browser::{Browser, CTRL, SHIFT};
use petcomp::camera::{self, CameraFile, Label, Solution};
use petcomp::{Image, LinearRgb, io};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;
use tempfile::TempDir;

/// How far from where the floor ends the sides of the sample tray change most, pixels, as a person
/// sees it too: its walls rise from the floor with a rounding.
const MAX_OFF_PX: f64 = 0.7;
const PHOTO_SIZE: [f64; 2] = [1280.0, 960.0];

/// A folder with the sample photos, and with the labels of some.
fn photos(labelled: &[&str]) -> TempDir {
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

/// A browser that shows a sample photo, in a folder with the labels of some.
fn opened(labelled: &[&str], photo: &str) -> Option<(Browser, TempDir, Studio)> {
    let mut browser = Browser::open(1360, 860)?;
    let dir = photos(labelled);
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, photo);
    Some((browser, dir, studio))
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
    let Some((mut browser, dir, _studio)) = opened(&["bg0004"], "bg0004.jpg") else {
        return;
    };
    browser.press("m", 0);
    browser.fill("#width", "0.57");
    browser.wait("document.querySelector('footer').innerText.startsWith('4 markers')");
    assert!(
        browser
            .text("footer")
            .contains("16 corners with known positions")
    );
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
fn a_first_corner_that_is_clicked_anew_stays_the_first() {
    let Some((mut browser, dir, _studio)) = opened(&["bg0000"], "bg0000.jpg") else {
        return;
    };
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    browser.press("1", 0);
    browser.press("Backspace", 0);
    browser.press("s", CTRL);
    browser.wait(
        "document.querySelector('footer').innerText === 'not saved: 3 of 4 corners are marked'",
    );
    assert!(browser.text("#hint").contains("top left"));
    click_corners(&mut browser, &truth("bg0000")[..1]);
    browser.press("s", CTRL);
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let label: Label = io::read_json(dir.path().join("bg0000.label.json")).unwrap();
    assert!(farthest_px(&label, truth("bg0000")) < 2.0);
    browser.assert_content();
}

#[test]
fn a_stale_save_is_asked_about() {
    let Some((mut browser, dir, _studio)) = opened(&["bg0000"], "bg0000.jpg") else {
        return;
    };
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
fn keys_of_corners_rest_while_one_types() {
    let Some((mut browser, dir, _studio)) = opened(&["bg0000"], "bg0000.jpg") else {
        return;
    };
    browser.wait("document.querySelectorAll('#facts dt').length > 5");
    browser.press("1", 0);
    browser.press("ArrowRight", SHIFT);
    browser.eval("document.querySelector('#width').focus()");
    for key in ["z", "ArrowRight", "s"] {
        browser.press(key, CTRL);
    }
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let label: Label = io::read_json(dir.path().join("bg0000.label.json")).unwrap();
    let mut moved = truth("bg0000");
    moved[0][0] += 1.0;
    assert!(farthest_px(&label, moved) < 0.02, "{:?}", label.surface);
}

#[test]
fn a_photo_of_another_size_than_its_label_says_is_not_shown() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0000"]);
    let path = dir.path().join("bg0000.label.json");
    let mut label: Value = io::read_json(&path).unwrap();
    label["image"]["width"] = json!(640);
    label["image"]["height"] = json!(480);
    io::write_json(&path, &label).unwrap();
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0000.jpg");
    let expected =
        "bg0000.jpg: 1280 x 960 pixels in this browser, expected 640 x 480 as in its label";
    assert_eq!(browser.text("footer"), expected);
    let is_disabled = browser.eval("document.querySelector('#save').disabled");
    assert_eq!(is_disabled, true);
}

/// Two sample photos, whose labels name one camera.
fn photos_of_one_camera() -> TempDir {
    let dir = photos(&["bg0000", "bg0003"]);
    for stem in ["bg0000", "bg0003"] {
        let path = dir.path().join(format!("{stem}.label.json"));
        let text = io::read_text(&path).unwrap();
        let shared = text.replace(&stem.replace("bg", "cam-"), "shared");
        io::write_text(&path, &shared).unwrap();
    }
    dir
}

#[test]
fn photos_of_one_camera_are_solved_together() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos_of_one_camera();
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

/// The JSON of an answer.
fn body(answer: &str) -> Value {
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    assert!(head.starts_with("HTTP/1.1 200"), "{answer}");
    serde_json::from_str(body).unwrap()
}

/// Answers of a route wait for `window.goOn()`; `window.asked` counts what it was asked.
fn hold_answers(browser: &mut Browser, route: &str) {
    browser.eval(&format!(
        "(() => {{ const real = window.fetch; window.asked = 0; window.fetch = async (path, options) => {{ \
         if (!String(path).includes('{route}')) return real(path, options); \
         window.asked += 1; const answer = await real(path, options); \
         await new Promise((go) => {{ window.goOn = go; }}); return answer; }}; }})()"
    ));
}

/// Opens another photo by its place in the list.
fn choose_photo(browser: &mut Browser, photo: &str) {
    browser.click_on(&format!("[data-photo='{photo}'] button"));
    browser.wait(&format!(
        "document.querySelector('#title').innerText === '{photo}'"
    ));
}

/// Of bg0000 and bg0001, solved together, the one has a camera and the other a reason.
fn assert_only_the_first_is_solved(studio: &Studio) {
    let photos = r#"{ "photos": ["bg0000.jpg", "bg0001.jpg"] }"#;
    let solved = body(&studio.post("api/corners/joint", photos));
    assert!(solved[0]["focal_px"].is_number(), "{solved}");
    assert!(solved[1]["why"].is_string(), "{solved}");
}

#[test]
fn markers_leave_points_that_were_measured_by_hand() {
    let dir = photos(&["bg0004"]);
    let studio = Studio::over(dir.path());
    let mut label: Value = io::read_json(dir.path().join("bg0004.label.json")).unwrap();
    label["points"] =
        json!([{ "xyz_m": [-0.28, 0.185, 0.0], "px": [253.6, 208.7], "note": "by hand" }]);
    let asked = json!({ "photo": "bg0004.jpg", "label": label }).to_string();
    let found = body(&studio.post("api/corners/markers", &asked));
    let points = found["label"]["points"].as_array().unwrap();
    assert_eq!(points.len(), 1 + 4 * 4);
    assert!(points.iter().any(|point| point["note"] == "by hand"));
}

#[test]
fn a_label_that_cannot_be_read_stands_in_no_other_photos_way() {
    let dir = photos(&["bg0000"]);
    std::fs::write(dir.path().join("bg0001.label.json"), "{ oops").unwrap();
    let studio = Studio::over(dir.path());
    for like in ["bg0001.jpg", "gone.jpg"] {
        let path = format!("api/corners/label?photo=bg0003.jpg&like={like}");
        let begun = body(&studio.get(&path));
        assert_eq!(begun["label"]["image"]["file"], "bg0003.jpg");
        let remark = begun["remark"].as_str().unwrap();
        assert!(remark.contains(like.split('.').next().unwrap()), "{remark}");
    }
    assert_only_the_first_is_solved(&studio);
}

#[test]
fn a_label_that_has_no_camera_keeps_no_other_from_its_own() {
    let dir = photos(&["bg0000", "bg0001"]);
    let path = dir.path().join("bg0001.label.json");
    let mut label: Value = io::read_json(&path).unwrap();
    label["surface"]["corners_px"] = Value::Null;
    io::write_json(&path, &label).unwrap();
    let camera = dir.path().join("bg0001.camera.json");
    std::fs::write(&camera, "of another label").unwrap();
    let studio = Studio::over(dir.path());
    assert_only_the_first_is_solved(&studio);
    assert!(!camera.exists());
}

#[test]
fn a_label_that_no_camera_fits_is_told_why_and_keeps_no_camera_of_before() {
    let dir = photos(&["bg0000", "bg0001"]);
    exchange_sides(&dir.path().join("bg0001.label.json"));
    let camera = dir.path().join("bg0001.camera.json");
    std::fs::write(&camera, "of another label").unwrap();
    let studio = Studio::over(dir.path());
    let asked = r#"{ "photos": ["bg0001.jpg"] }"#;
    let solved = body(&studio.post("api/corners/joint", asked));
    let why = solved[0]["why"].as_str().unwrap();
    assert!(why.contains("swap width_m and height_m"), "{why}");
    assert!(!camera.exists());
}

/// No camera fits the label any more.
fn exchange_sides(path: &Path) {
    let mut label: Value = io::read_json(path).unwrap();
    (label["surface"]["width_m"], label["surface"]["height_m"]) = (json!(0.37), json!(0.56));
    io::write_json(path, &label).unwrap();
}

/// The camera of a label that none fits, as `petcomp camera solve --force` writes it beside it.
fn force_camera(folder: &Path, stem: &str) -> CameraFile {
    let path = folder.join(format!("{stem}.label.json"));
    exchange_sides(&path);
    let label = camera::read_label(&path).unwrap();
    let forced = CameraFile::new(&label, &camera::solve(&label, &Default::default()).unwrap());
    assert!(forced.forced);
    io::write_json(folder.join(format!("{stem}.camera.json")), &forced).unwrap();
    forced
}

#[test]
fn a_camera_that_was_forced_stays_beside_its_label() {
    let dir = photos(&["bg0001"]);
    let forced = force_camera(dir.path(), "bg0001");
    let studio = Studio::over(dir.path());
    let asked = r#"{ "photos": ["bg0001.jpg"] }"#;
    let solved = body(&studio.post("api/corners/joint", asked));
    assert!(solved[0]["why"].is_string(), "{solved}");
    assert_eq!(saved(dir.path(), "bg0001").1, forced);
}

#[test]
fn a_camera_that_was_forced_stays_when_its_label_is_saved_as_it_is_and_no_longer() {
    let dir = photos(&["bg0001"]);
    let forced = force_camera(dir.path(), "bg0001");
    let studio = Studio::over(dir.path());
    let save = |shift_px: f64| {
        let mut read = body(&studio.get("api/corners/label?photo=bg0001.jpg"));
        let x = &mut read["label"]["surface"]["corners_px"][0][0];
        *x = json!(x.as_f64().unwrap() + shift_px);
        let (label, version) = (&read["label"], &read["version"]);
        let asked = json!({ "photo": "bg0001.jpg", "label": label, "version": version });
        let answer = body(&studio.post("api/corners/save", &asked.to_string()));
        assert!(answer["why"].is_string(), "{answer}");
    };
    save(0.0);
    assert_eq!(saved(dir.path(), "bg0001").1, forced);
    save(1.0);
    assert!(!dir.path().join("bg0001.camera.json").exists());
}

#[test]
fn each_photo_without_a_camera_is_told_what_is_wrong_with_its_own_label() {
    let dir = photos_of_one_camera();
    let corners = truth("bg0003");
    let coincident = [corners[0], corners[0], corners[2], corners[3]];
    for (stem, corners) in [("bg0000", Value::Null), ("bg0003", json!(coincident))] {
        let path = dir.path().join(format!("{stem}.label.json"));
        let mut label: Value = io::read_json(&path).unwrap();
        label["surface"]["corners_px"] = corners;
        io::write_json(&path, &label).unwrap();
    }
    let studio = Studio::over(dir.path());
    let asked = r#"{ "photos": ["bg0000.jpg", "bg0003.jpg"] }"#;
    let solved = body(&studio.post("api/corners/joint", asked));
    let expected = ["corners_px is missing", "corner are 0.0 px apart"];
    for (photo, expected) in solved.as_array().unwrap().iter().zip(expected) {
        let why = photo["why"].as_str().unwrap();
        assert!(why.contains(expected) && photo["together"] == 2, "{solved}");
    }
}

#[test]
fn a_label_is_of_the_photo_that_it_names_and_counts_once() {
    let dir = photos(&["bg0000"]);
    let (named, other) = ("bg0000.jpg", "bg0000.jpeg");
    std::fs::copy(dir.path().join(named), dir.path().join(other)).unwrap();
    let studio = Studio::over(dir.path());
    let asked = json!({ "photos": [named, other, named] }).to_string();
    let solved = body(&studio.post("api/corners/joint", &asked));
    assert_eq!(solved.as_array().unwrap().len(), 2);
    let why = "bg0000.label.json: image.file: bg0000.jpg, expected bg0000.jpeg";
    assert_eq!(
        (&solved[0]["photo"], &solved[0]["why"]),
        (&json!(other), &json!(why))
    );
    assert_eq!(
        (&solved[1]["photo"], &solved[1]["together"]),
        (&json!(named), &json!(1))
    );
    assert!(solved[1]["focal_px"].is_number(), "{solved}");
    let listed = body(&studio.get("api/corners/photos"));
    let marks = |photo: &str| {
        let mut listed = listed.as_array().unwrap().iter();
        let entry = listed.find(|entry| entry["photo"] == photo).unwrap();
        [entry["label"] == true, entry["camera"] == true]
    };
    assert_eq!((marks(named), marks(other)), ([true; 2], [false; 2]));
}

#[test]
fn a_photo_is_sent_again_when_its_file_has_changed() {
    let dir = photos(&[]);
    let studio = Studio::over(dir.path());
    let ask = |tag: &str| {
        let (root, host) = (studio.root(), studio.host());
        let answer = studio.send(
            format!(
                "GET {root}api/photo?file=bg0000.jpg HTTP/1.1\r\nHost: {host}\r\n\
                 If-None-Match: {tag}\r\nConnection: close\r\n\r\n"
            )
            .as_bytes(),
        );
        let status = answer.split(' ').nth(1).unwrap().to_owned();
        assert!(answer.contains("no-cache"), "{status}");
        let tag = answer.lines().find_map(|line| line.strip_prefix("etag: "));
        (status, tag.unwrap().to_owned())
    };
    let (status, first) = ask("\"none\"");
    assert_eq!(status, "200");
    assert_eq!(ask(&first), ("304".to_owned(), first.clone()));
    std::fs::copy(dir.path().join("bg0001.jpg"), dir.path().join("bg0000.jpg")).unwrap();
    let (status, second) = ask(&first);
    assert_eq!(status, "200");
    assert_ne!(first, second);
}

#[test]
fn a_photo_that_was_written_anew_is_shown_as_it_is() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, colour: LinearRgb| {
        io::write(dir.path().join(name), &Image::filled(64, 48, colour)).unwrap();
    };
    write("a.png", LinearRgb::WHITE);
    write("b.png", LinearRgb::WHITE);
    let studio = Studio::over(dir.path());
    let middle = "(() => { const c = document.querySelector('#stage canvas'); \
         return c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data[0]; })()";
    open_photo(&mut browser, &studio, "a.png");
    browser.wait(&format!("{middle} > 200"));
    choose_photo(&mut browser, "b.png");
    write("a.png", LinearRgb::new(0.01, 0.0, 0.0));
    choose_photo(&mut browser, "a.png");
    browser.wait(&format!("{middle} < 100"));
    browser.assert_content();
}

#[test]
fn what_the_label_says_of_heights_stays_when_they_are_typed_anew() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = photos(&["bg0000"]);
    let path = dir.path().join("bg0000.label.json");
    let mut label: Value = io::read_json(&path).unwrap();
    label["camera"]["height_m"] = json!(1.02);
    label["camera"]["height_sigma_m"] = json!(0.005);
    label["surface"]["wall"] = json!({ "height_m": 0.05, "slope_deg": 8.0 });
    io::write_json(&path, &label).unwrap();
    let studio = Studio::over(dir.path());
    open_photo(&mut browser, &studio, "bg0000.jpg");
    browser.eval("document.querySelector('#more').open = true");
    for (field, text) in [("#lens", "1.03"), ("#wall", "0.06")] {
        browser.eval(&format!(
            "(() => {{ const field = document.querySelector('{field}'); field.value = ''; \
             field.dispatchEvent(new Event('input')); }})()"
        ));
        browser.fill(field, text);
    }
    browser.press("s", CTRL);
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let label: Label = io::read_json(&path).unwrap();
    let wall = label.surface.wall.unwrap();
    assert_eq!(label.camera.height_m, Some(1.03));
    assert_eq!(label.camera.height_sigma_m, Some(0.005));
    assert_eq!((wall.height_m, wall.slope_deg), (Some(0.06), Some(8.0)));
}

#[test]
fn a_mistyped_length_is_named_and_left_behind_with_its_photo() {
    let Some((mut browser, _dir, _studio)) = opened(&["bg0000", "bg0003"], "bg0000.jpg") else {
        return;
    };
    browser.fill("#width", "0,5,6");
    browser.press("s", CTRL);
    browser.wait(
        "document.querySelector('footer').innerText === 'not saved: width: 0,5,6, expected a length (a number)'",
    );
    choose_photo(&mut browser, "bg0003.jpg");
    let valid = browser.eval("document.querySelector('#width').validity.valid");
    assert_eq!(valid, true);
    browser.press("s", CTRL);
    browser.wait("document.querySelector('footer').innerText.startsWith('saved bg0003')");
    browser.assert_content();
}

#[test]
fn what_is_typed_during_a_save_is_not_saved_and_a_save_at_a_time_is_asked_for() {
    let Some((mut browser, dir, _studio)) = opened(&["bg0000"], "bg0000.jpg") else {
        return;
    };
    hold_answers(&mut browser, "corners/save");
    browser.eval("document.querySelector('#more').open = true");
    browser.fill("#surface", "trayB");
    browser.press("s", CTRL);
    browser.wait("!!window.goOn");
    browser.press("s", CTRL);
    assert_eq!(browser.eval("window.asked"), 1);
    browser.fill("#surface", "trayC");
    browser.eval("window.goOn(), 0");
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let mark = browser.text("[data-photo='bg0000.jpg'] .mark");
    assert_eq!(mark, "not saved");
    let label: Label = io::read_json(dir.path().join("bg0000.label.json")).unwrap();
    assert_eq!(label.surface.id, "trayB");
    choose_photo(&mut browser, "bg0001.jpg");
    choose_photo(&mut browser, "bg0000.jpg");
    let typed = browser.eval("document.querySelector('#surface').value");
    assert_eq!(typed, "trayC");
    browser.assert_content();
}

#[test]
fn corners_that_moved_while_edges_were_looked_for_stay() {
    let Some((mut browser, dir, _studio)) = opened(&["bg0000"], "bg0000.jpg") else {
        return;
    };
    hold_answers(&mut browser, "corners/snap");
    browser.press("s", 0);
    browser.wait("!!window.goOn");
    browser.press("r", 0);
    browser.eval("window.goOn(), 0");
    browser.wait("document.querySelector('footer').innerText.includes('moved in the meantime')");
    browser.press("s", CTRL);
    browser.wait("document.querySelector('footer').innerText.startsWith('saved')");
    let label: Label = io::read_json(dir.path().join("bg0000.label.json")).unwrap();
    let mut turned = truth("bg0000");
    turned.rotate_left(1);
    assert_eq!(label.surface.corners_px, Some(turned));
}

#[test]
fn a_photo_that_contradicts_the_others_is_shown_with_its_warning() {
    let Some((mut browser, _dir, _studio)) = opened(&["bg0000", "bg0003"], "bg0000.jpg") else {
        return;
    };
    browser.eval(
        "(() => { const real = window.fetch; window.fetch = (path, options) => \
         String(path).includes('corners/joint') ? Promise.resolve(Response.json([{ photo: 'bg0000.jpg', together: 2, \
         focal_px: 900, focal_sigma: 0.01, rms_px: 0.2, why: 'contradicts the other photos' }])) : real(path, options); })()",
    );
    browser.click_on("#joint");
    browser.wait_for("dialog table");
    let shown = browser.text("dialog table");
    assert!(
        shown.contains("900 px") && shown.contains("contradicts the other photos"),
        "{shown}"
    );
}
