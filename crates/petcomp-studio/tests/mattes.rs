//! The page `mattes` in a real browser: strokes correct a cut-out, are kept, and hold for builds.

mod browser;

use browser::studio::{Studio, copy_files, samples};
use browser::{Browser, CTRL, SHIFT};
use petcomp::asset::{self, Review, Verdict};
use petcomp::matte::{Claim, Stroke};
use petcomp::{Image, LinearRgb, io};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A red slab of 60 x 30 pixels on a green screen, twice.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let slab = Image::from_fn(160, 100, |x, y| {
        let inside = (50..110).contains(&x) && (35..65).contains(&y);
        let [red, green] = [[0.6, 0.05, 0.05], [0.04, 0.4, 0.08]];
        LinearRgb::from(if inside { red } else { green })
    });
    let mut list = String::from("file,asset,class,px_per_metre\n");
    for name in ["a <b>one.png", "two.png"] {
        io::write(folder.path().join(name), &slab).unwrap();
        list += &format!("{name},slab,slab,200\n");
    }
    std::fs::write(folder.path().join("photos.csv"), list).unwrap();
    folder
}

fn review(folder: &Path) -> Option<Review> {
    Review::of_photo(&folder.join("a <b>one.png")).unwrap()
}

/// Places of the page for places of the photo.
fn on_page(browser: &mut Browser, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    browser.wait("!!document.querySelector('#canvas').dataset.place");
    let script = "document.querySelector('#canvas').dataset.place.split(' ').map(Number)";
    let [scale, x, y]: [f64; 3] = serde_json::from_value(browser.eval(script)).unwrap();
    let [left, top, ..] = browser.place("#canvas");
    let placed = points
        .iter()
        .map(|[px, py]| [left + x + scale * px, top + y + scale * py]);
    placed.collect()
}

/// Moves the slider of the brush, 0 to 100.
fn set_brush(browser: &mut Browser, value: &str) {
    let radius = "document.querySelector('#radius')";
    browser.eval(&format!(
        "{radius}.value = {value}; {radius}.dispatchEvent(new Event('input'))"
    ));
}

/// Does something that changes what is shown, and waits until it is shown.
fn showing(browser: &mut Browser, act: impl FnOnce(&mut Browser)) {
    let shown = "document.querySelector('#canvas')?.dataset.shown";
    let before = browser.eval(shown);
    act(browser);
    browser.wait(&format!("({shown} ?? null) !== {before}"));
}

fn saved(browser: &mut Browser, act: impl FnOnce(&mut Browser)) {
    let saved = "document.querySelector('#canvas')?.dataset.saved";
    let before = browser.eval(saved);
    act(browser);
    browser.wait(&format!("({saved} ?? null) !== {before}"));
}

/// Length of the first cut-out that a build of the folder's list gives, pixels.
fn built_length_px(folder: &Path) -> f64 {
    let (assets, running) = (folder.join("assets"), AtomicBool::new(false));
    let built = asset::build(folder, assets, &|_, _| (), &running).unwrap();
    200.0 * built.lengths[0][0]
}

#[test]
fn a_matte_is_corrected_by_strokes_that_a_build_keeps_to() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let folder = folder();
    let studio = Studio::over(folder.path());
    showing(&mut browser, |browser| browser.go(&studio.page("mattes")));
    assert!(
        browser
            .text("#photos button .name")
            .starts_with("a <b>one.png")
    );
    assert!(
        browser
            .text("#flags li")
            .starts_with("the object is only 20 px wide")
    );
    assert_eq!(review(folder.path()), None);

    // The right third is none of the object.
    let third = [
        [98.0, 25.0],
        [98.0, 75.0],
        [106.0, 75.0],
        [106.0, 25.0],
        [112.0, 25.0],
        [112.0, 75.0],
    ];
    let third = on_page(&mut browser, &third);
    browser.press("n", 0);
    set_brush(&mut browser, "88");
    showing(&mut browser, |browser| {
        saved(browser, |browser| browser.drag(&third));
    });
    let kept = review(folder.path()).unwrap();
    assert_eq!((kept.strokes.len(), kept.size_px), (1, [160, 100]));
    assert_eq!(kept.strokes[0].says, Claim::NotObject);
    let [x, y] = kept.strokes[0].points_px[0];
    assert!((x - 98.0).abs() < 0.5 && (y - 25.0).abs() < 0.5, "{x}, {y}");
    let length = built_length_px(folder.path());
    let cut_at = 98.0 - kept.strokes[0].radius_px;
    assert!(
        (length - (cut_at - 50.0)).abs() < 2.0,
        "{length}, cut at {cut_at}"
    );

    saved(&mut browser, |browser| browser.press("z", CTRL));
    assert!(review(folder.path()).unwrap().strokes.is_empty());
    saved(&mut browser, |browser| browser.press("z", CTRL | SHIFT));
    assert_eq!(review(folder.path()).unwrap().strokes, kept.strokes);
    saved(&mut browser, |browser| browser.click_on("#clear"));
    assert!(review(folder.path()).unwrap().strokes.is_empty());
    saved(&mut browser, |browser| browser.press("z", CTRL));
    assert_eq!(review(folder.path()).unwrap().strokes, kept.strokes);

    // A verdict goes on to the next photo.
    saved(&mut browser, |browser| browser.press("a", 0));
    assert_eq!(
        review(folder.path()).unwrap().verdict,
        Some(Verdict::Accepted)
    );
    browser.wait("document.querySelectorAll('#photos button')[1].hasAttribute('aria-current')");
    browser.assert_content();
}

#[test]
fn what_another_tab_has_saved_is_not_overwritten() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let folder = folder();
    let studio = Studio::over(folder.path());
    showing(&mut browser, |browser| browser.go(&studio.page("mattes")));
    let other = Review {
        verdict: Some(Verdict::Rejected),
        ..Review::new((160, 100), Vec::new())
    };
    let path = folder.path().join("a <b>one.review.json");
    std::fs::write(path, other.to_json()).unwrap();
    browser.press("o", 0);
    let dot = on_page(&mut browser, &[[60.0, 30.0], [62.0, 30.0]]);
    browser.drag(&dot);
    browser.wait_for("dialog");
    assert!(browser.text("dialog").contains("has changed since"));
    assert_eq!(review(folder.path()), Some(other));
    // The list tells what is in the file.
    let marks =
        "[...document.querySelectorAll('#photos .mark')].map((mark) => mark.textContent).join()";
    assert_eq!(browser.eval(marks), ",");
    browser.click_on("dialog button[value='Load theirs']");
    browser.wait(&format!("{marks} === 'rejected,'"));
    let kept = review(folder.path()).unwrap();
    assert_eq!(kept.verdict, Some(Verdict::Rejected));
}

#[test]
fn nothing_of_another_photo_stands_beside_one_that_cannot_be_read() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let folder = folder();
    std::fs::write(folder.path().join("two.png"), "").unwrap();
    let studio = Studio::over(folder.path());
    showing(&mut browser, |browser| browser.go(&studio.page("mattes")));
    browser.wait_for("#facts dd");
    browser.click_on("[data-photo='two.png'] button");
    browser.wait("document.querySelector('footer').className === 'bad'");
    let told = "document.querySelectorAll('#flags li, #facts dd').length";
    assert_eq!(browser.eval(told), 0);
    let verdicts = "document.querySelectorAll('.verdicts button:disabled').length";
    assert_eq!(browser.eval(verdicts), 2);
}

#[test]
fn arrows_move_the_brush_that_has_the_focus() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let folder = folder();
    let studio = Studio::over(folder.path());
    showing(&mut browser, |browser| browser.go(&studio.page("mattes")));
    browser.press("o", 0);
    browser.eval("document.querySelector('#radius').focus()");
    browser.press("ArrowRight", 0);
    browser.wait("document.querySelector('#radius').value === '46'");
    assert_eq!(browser.eval("document.querySelector('#wipe').value"), "0");
}

/// A review of a picture of this size with so many strokes.
fn painted(size: (usize, usize), count: usize) -> Review {
    let dot = Stroke {
        says: Claim::NotObject,
        radius_px: 4.0,
        points_px: vec![[10.0, 10.0]],
    };
    Review::new(size, vec![dot; count])
}

#[test]
fn strokes_on_another_size_are_not_taken_and_others_taken_back_at_once() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let folder = folder();
    let two = folder.path().join("two.png");
    let larger = painted((320, 200), 1).to_json();
    std::fs::write(folder.path().join("a <b>one.review.json"), larger).unwrap();
    std::fs::write(Review::path_of(&two), painted((160, 100), 2).to_json()).unwrap();
    let studio = Studio::over(folder.path());
    showing(&mut browser, |browser| browser.go(&studio.page("mattes")));
    let expected = "size_px: 320 x 200, expected the photo's 160 x 100; review it again";
    browser.wait(&format!(
        "document.querySelector('footer').innerText.includes(\"{expected}\")"
    ));
    // From here on cut-outs wait.
    browser.eval(
        "(() => { const asked = window.fetch; window.fetch = async (path, options) => { \
         if (path.includes('/solve')) await new Promise((go) => { window.cutOut = go; }); \
         return asked(path, options); }; })()",
    );
    saved(&mut browser, |browser| browser.press("a", 0));
    let accepted = Review {
        verdict: Some(Verdict::Accepted),
        ..painted((160, 100), 0)
    };
    assert_eq!(review(folder.path()), Some(accepted));

    browser.wait("!!window.cutOut && !document.querySelector('#undo').disabled");
    saved(&mut browser, |browser| browser.press("z", CTRL));
    let left = Review::of_photo(&two).unwrap();
    assert_eq!(left, Some(painted((160, 100), 1)));
    showing(&mut browser, |browser| {
        browser.eval("window.cutOut()");
    });
    browser.assert_content();
}

/// What a person paints on the label and on the cap of the first bottle.
const LABEL: &[[f64; 2]] = &[
    [238.0, 100.0],
    [252.0, 202.0],
    [284.0, 92.0],
    [304.0, 192.0],
    [330.0, 84.0],
    [348.0, 184.0],
];
const CAP: &[[f64; 2]] = &[[530.0, 82.0], [532.0, 112.0], [546.0, 80.0], [546.0, 108.0]];

#[test]
fn bottles_are_seen_in_every_way() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    copy_files(&samples("bottles"), folder.path(), |name| {
        name.ends_with(".toml") || name.ends_with(".png")
    });
    copy_files(&samples("backgrounds"), folder.path(), |_| true);
    let studio = Studio::over(folder.path());
    browser.prefer_dark(false);
    showing(&mut browser, |browser| browser.go(&studio.page("mattes")));
    for key in ["2", "3", "4", "5", "6", "7"] {
        showing(&mut browser, |browser| browser.press(key, 0));
        browser.screenshot(&format!("studio_mattes_{key}"));
    }
    showing(&mut browser, |browser| browser.press("1", 0));
    for _ in 0..7 {
        browser.press("ArrowRight", 0);
    }
    // Label and cap have the colours of bottle and screen.
    browser.press("p", 0);
    for (brush, line) in [("74", LABEL), ("50", CAP)] {
        set_brush(&mut browser, brush);
        let line = on_page(&mut browser, line);
        showing(&mut browser, |browser| browser.drag(&line));
    }
    browser.wait("!document.querySelector('.busy')");
    browser.screenshot("studio_mattes");
    browser.prefer_dark(true);
    browser.screenshot("studio_mattes_dark");
    browser.resize(390, 844);
    browser.screenshot("studio_mattes_phone");
    browser.assert_content();
}

#[test]
fn the_first_page_finds_the_folder_that_a_build_makes() {
    let folder = folder();
    built_length_px(folder.path());
    let studio = Studio::over(folder.path());
    let found = studio.get("api/overview");
    assert!(
        found.contains("\"assets\":[\"assets/assets.toml\"]"),
        "{found}"
    );
}
