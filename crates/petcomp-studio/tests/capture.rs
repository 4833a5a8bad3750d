//! The frames of a capture, shown in a real browser.

mod browser;

use browser::Browser;
use browser::studio::Studio;

#[test]
fn frames_are_shown_and_written() {
    let Some(mut browser) = Browser::open(1000, 800) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("capture"));
    browser.wait("document.querySelector('#width_px').valueAsNumber >= 400");
    browser.screenshot("studio_capture");
    browser.fill("#width_px", "1000");
    browser.fill("#height_px", "800");
    browser.fill("#width", "0.3");
    browser.click_on("#stripes");
    browser.click_on("#write");
    browser.wait("document.querySelector('footer').innerText.includes('capture/show.html')");
    assert!(dir.path().join("capture/00_black.png").exists());
    assert!(dir.path().join("capture/17_stripes_y_fine_4.png").exists());
    let display = std::fs::read_to_string(dir.path().join("capture/display.toml")).unwrap();
    assert!(display.contains("width = 0.3"), "{display}");
    browser.assert_content();

    let shown = "api/capture/show?width_px=1000&height_px=800&stripes=true";
    browser.go(&studio.page(shown));
    browser.wait("document.querySelectorAll('.frame').length === 18");
    browser.wait(
        "[...document.querySelectorAll('.frame')].every(frame => frame.naturalWidth === 1000)",
    );
    browser.press("ArrowRight", 0);
    browser.press("ArrowRight", 0);
    browser.wait("document.querySelector('.frame.shown').alt === 'white'");
    // Shut off from the studio: it has no origin of its own, and may ask for nothing.
    browser.wait("self.origin === 'null'");
    browser.eval("fetch('../overview').then(() => 'told', () => 'refused').then(said => { window.said = said; }), 0");
    browser.wait("window.said === 'refused'");
}

#[test]
fn a_display_that_cannot_be_is_refused_in_words() {
    let Some(mut browser) = Browser::open(1000, 800) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("capture"));
    browser.wait("document.querySelector('#width_px').valueAsNumber >= 400");
    browser.fill("#width", "345");
    browser.click_on("#write");
    browser.wait(
        "document.querySelector('footer').innerText.includes('width: 345, expected 0.01 to 50 m')",
    );
    assert!(!dir.path().join("capture").exists());
}
