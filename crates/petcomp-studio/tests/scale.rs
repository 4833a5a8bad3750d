//! The scale of a photo by two clicks, in a real browser.

mod browser;

use browser::Browser;
use browser::studio::{Studio, copy_files, samples};
use petcomp::io;

#[test]
fn two_ends_of_a_length_give_pixels_per_metre() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    copy_files(&samples("bottles"), dir.path(), |name| {
        name.ends_with("_0.png") || name == "photos.toml"
    });
    let list = dir.path().join("photos.toml");
    let before = io::read_text(&list).unwrap();
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("scale?photo=b0000_0.png"));
    browser.wait("document.querySelector('#title').innerText === 'b0000_0.png'");
    let [left, top, width, height] = browser.place("#stage canvas");
    let at = |x: f64, y: f64| [left + x * width, top + y * height];
    browser.click(at(0.4, 0.5));
    browser.click(at(0.6, 0.5));
    browser.fill("#width", "0.1");
    browser.wait("document.querySelectorAll('#facts dt').length > 1");
    browser.screenshot("studio_scale");
    browser.click_on("#save");
    browser.wait("document.querySelector('footer').innerText.includes('saved in photos.toml')");
    let after = io::read_text(&list).unwrap();
    assert_ne!(before, after);
    let others = |text: &str| {
        text.split("\n[[photos]]")
            .skip(2)
            .map(str::trim)
            .collect::<Vec<_>>()
            .join("|")
    };
    assert_eq!(others(&before), others(&after));
    assert!(
        after.starts_with("# Rendered bottles"),
        "remarks stay: {after}"
    );
    browser.assert_content();
}

#[test]
fn the_first_page_says_what_is_there() {
    let Some(mut browser) = Browser::open(1200, 760) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("tray");
    copy_files(
        &samples("backgrounds"),
        &folder.join("backgrounds"),
        |name| name.starts_with("bg"),
    );
    copy_files(&samples("bottles"), &folder.join("bottles"), |_| true);
    std::fs::write(
        folder.join("recipe.toml"),
        "assets = \"assets\"\nbackgrounds = \"backgrounds\"\n",
    )
    .unwrap();
    let studio = Studio::over(&folder);
    browser.go(&studio.page(""));
    browser.wait("document.querySelectorAll('.card').length === 6");
    assert_eq!(browser.text("h1"), "tray");
    assert!(browser.text(".card").contains("4 labels"));
    browser.screenshot("studio_index");
    browser.press("?", 0);
    browser.wait_for("dialog");
    browser.screenshot("keys");
    browser.assert_content();
}
