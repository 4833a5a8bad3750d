//! The scale of a photo by two clicks, in a real browser.

mod browser;

use browser::Browser;
use browser::studio::{Studio, copy_files, samples};
use petcomp::io;
use tempfile::TempDir;

/// A browser that shows a photo of the sample bottles, their list in a folder of its own.
fn opened_bottle() -> Option<(Browser, TempDir, Studio)> {
    let mut browser = Browser::open(1360, 860)?;
    let dir = tempfile::tempdir().unwrap();
    copy_files(&samples("bottles"), dir.path(), |name| {
        name.ends_with("_0.png") || name == "photos.toml"
    });
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("scale?photo=b0000_0.png"));
    browser.wait("document.querySelector('#title').innerText === 'b0000_0.png'");
    Some((browser, dir, studio))
}

#[test]
fn two_ends_of_a_length_give_pixels_per_metre() {
    let Some((mut browser, dir, _studio)) = opened_bottle() else {
        return;
    };
    let list = dir.path().join("photos.toml");
    let before = io::read_text(&list).unwrap();
    // What is mistyped beside one photo is in nobody's way beside another.
    let is_valid = "document.querySelector('#width').validity.valid";
    browser.fill("#width", "0,5,6");
    browser.wait(&format!("!{is_valid}"));
    for photo in ["b0001_0.png", "b0000_0.png"] {
        browser.click_on(&format!("[data-photo='{photo}'] button"));
        browser.wait(&format!(
            "document.querySelector('#title').innerText === '{photo}'"
        ));
    }
    browser.wait(is_valid);
    let [left, top, width, height] = browser.place("#stage canvas");
    let at = |x: f64, y: f64| [left + x * width, top + y * height];
    browser.click(at(0.4, 0.5));
    browser.click(at(0.6, 0.5));
    browser.fill("#width", "0.1");
    browser.wait("document.querySelectorAll('#facts dt').length > 1");
    browser.screenshot("studio_scale");
    // Pressed twice, it saves once.
    browser.eval(
        "(() => { const asked = window.fetch; window.saves = 0; \
         window.fetch = (path, options) => { window.saves += path.includes('scale/save'); return asked(path, options); }; \
         for (let i = 0; i < 2; i++) document.querySelector('#save').click(); })()",
    );
    browser.wait("document.querySelector('footer').innerText.includes('saved in photos.toml')");
    assert_eq!(browser.eval("window.saves"), 1);
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
fn a_scale_is_saved_over_a_list_that_has_changed() {
    let Some((mut browser, dir, _studio)) = opened_bottle() else {
        return;
    };
    let list = dir.path().join("photos.toml");
    let [left, top, width, height] = browser.place("#stage canvas");
    for x in [0.4, 0.6] {
        browser.click([left + x * width, top + 0.5 * height]);
    }
    browser.fill("#width", "0.1");
    let theirs = format!("# theirs\n{}", io::read_text(&list).unwrap());
    io::write_text(&list, &theirs).unwrap();
    browser.click_on("#save");
    browser.click_on("dialog button[value='Save mine']");
    browser.wait("document.querySelector('footer').innerText.includes('saved in photos.toml')");
    let after = io::read_text(&list).unwrap();
    assert!(after.starts_with("# theirs\n"), "{after}");
    assert_ne!(after, theirs);
}

#[test]
fn beside_a_list_that_cannot_be_read_nothing_is_saved() {
    let Some(mut browser) = Browser::open(1360, 860) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let first = |name: &str| name == "b0000_0.png" || name == "photos.toml";
    copy_files(&samples("bottles"), dir.path(), first);
    let broken = dir.path().join("broken");
    copy_files(&samples("bottles"), &broken, |name| name == "b0001_0.png");
    std::fs::write(broken.join("photos.toml"), "[[photos]").unwrap();
    let list = dir.path().join("photos.toml");
    let before = io::read_text(&list).unwrap();
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("scale?photo=b0000_0.png"));
    browser.wait("document.querySelector('#title').innerText === 'b0000_0.png'");
    browser.fill("#width", "0.1");
    browser.eval("document.activeElement.blur()");
    browser.click_on("[data-photo='broken/b0001_0.png'] button");
    browser.wait("document.querySelector('#title').innerText === 'b0001_0.png'");
    let [left, top, width, height] = browser.place("#stage canvas");
    for x in [0.4, 0.6] {
        browser.click([left + x * width, top + 0.5 * height]);
    }
    assert_eq!(
        browser.eval("document.querySelector('#save').disabled"),
        true
    );
    browser.press("Enter", 0);
    browser.click_on("[data-photo='b0000_0.png'] button");
    browser.wait("document.querySelector('#title').innerText === 'b0000_0.png'");
    assert_eq!(io::read_text(&list).unwrap(), before);
    browser
        .complaints
        .retain(|complaint| !complaint.contains("422"));
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

#[test]
fn what_cannot_be_read_is_refused_and_left_as_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let latin_1 = b"# caf\xe9\n";
    let names = ["photos.toml", "recipe.toml", "a.label.json"];
    for name in names {
        std::fs::write(dir.path().join(name), latin_1).unwrap();
    }
    std::fs::write(dir.path().join("a.png"), "").unwrap();
    let studio = Studio::over(dir.path());
    let scale = r#"{ "photo": "a.png", "version": null, "scale": { "px_per_metre": 2000 } }"#;
    let answers = [
        studio.get("api/scale/photo?photo=a.png"),
        studio.post("api/scale/save", scale),
        studio.post("api/recipe/new", r#"{ "file": "recipe.toml" }"#),
        studio.get("api/corners/label?photo=a.png"),
    ];
    for (answer, name) in answers.iter().zip([names[0], names[0], names[1], names[2]]) {
        assert!(answer.starts_with("HTTP/1.1 422"), "{answer}");
        assert!(answer.contains(name), "{answer}");
    }
    for name in names {
        assert_eq!(std::fs::read(dir.path().join(name)).unwrap(), latin_1);
    }
}
