//! A recipe is changed by its sliders, in a real browser.

mod browser;

use browser::studio::Studio;
use browser::{Browser, CTRL, tray};
use petcomp::dataset::DatasetConfig;
use petcomp::io;

const RANGE: &str = ".setting[data-path='scene.scale']";

/// Waits until all pictures of what was last changed are shown.
fn wait_for_pictures(browser: &mut Browser) {
    browser.wait("[...document.querySelectorAll('#pictures figure')].length > 0");
    browser.wait(
        "[...document.querySelectorAll('#pictures figure')].every((figure) => !figure.classList.contains('old') \
         && figure.querySelector('[data-what=after]').complete && figure.querySelector('[data-what=after]').naturalWidth > 0)",
    );
}

/// The mean of a shown picture's codes.
fn brightness(browser: &mut Browser, scene: usize, what: &str) -> f64 {
    let script = format!(
        "(() => {{ const image = document.querySelectorAll('#pictures [data-what={what}]')[{scene}]; \
         const canvas = Object.assign(document.createElement('canvas'), {{ width: 64, height: 48 }}); \
         const pen = canvas.getContext('2d'); pen.drawImage(image, 0, 0, 64, 48); \
         const {{ data }} = pen.getImageData(0, 0, 64, 48); return data.reduce((a, b) => a + b) / data.length; }})()"
    );
    browser.eval(&script).as_f64().unwrap()
}

fn src(browser: &mut Browser) -> String {
    let image = "document.querySelector('#pictures [data-what=after]').src";
    browser.eval(image).as_str().unwrap().into()
}

#[test]
fn the_first_page_finds_the_recipe_that_begins_as_the_template() {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("recipe.toml", DatasetConfig::template()),
        ("other.toml", "backgrounds = 3"),
    ] {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    let found = Studio::over(dir.path()).get("api/overview");
    assert!(found.contains("\"recipes\":[\"recipe.toml\"]"), "{found}");
}

#[test]
fn a_slider_changes_the_pictures_and_the_file_keeps_its_comments() {
    let Some(mut browser) = Browser::open(1440, 900) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    tray::fill(dir.path());
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("recipe?file=recipe.toml"));
    browser.wait_for(".setting");
    wait_for_pictures(&mut browser);
    eprintln!(
        "first pictures after {} ms",
        browser.eval("document.body.dataset.firstMs")
    );

    // Every setting of the template is there, with its words.
    let told = browser.eval("document.querySelectorAll('.setting').length");
    assert!(told.as_u64().unwrap() > 60, "{told}");
    assert!(browser.text(RANGE).contains("factor on an object's width"));

    // A slider that moves shows pictures on its way; keys are as good as a mouse.
    let first = src(&mut browser);
    browser.eval(&format!(
        "document.querySelector(\"{RANGE} [type=range]:last-of-type\").focus()"
    ));
    for _ in 0..12 {
        browser.press("ArrowRight", 0);
    }
    browser.wait(&format!(
        "document.querySelector('#pictures [data-what=after]').src !== '{first}'"
    ));
    wait_for_pictures(&mut browser);
    eprintln!(
        "after a move {} ms",
        browser.eval("document.body.dataset.firstMs")
    );
    assert_eq!(
        browser.eval("document.querySelector('.setting.edited').dataset.path"),
        "scene.scale"
    );

    // Brighter objects; before and after side by side. The edit comes while those of before are made.
    browser.eval("document.querySelector('#compare').click()");
    wait_for_pictures(&mut browser);
    browser.fill(
        ".setting[data-path='scene.gain_ev'] input[type=number]",
        "2.5",
    );
    browser.wait("document.querySelectorAll('.setting.edited').length === 2");
    wait_for_pictures(&mut browser);
    browser.wait("[...document.querySelectorAll('#pictures [data-what=before]')].every((image) => image.naturalWidth > 0)");
    let [before, after] = ["before", "after"].map(|what| brightness(&mut browser, 0, what));
    assert!(after > before + 1.0, "{before} {after}");
    browser.eval("document.querySelector('#settings').parentElement.scrollTop = 0");
    browser.screenshot("studio_recipe");
    browser.prefer_dark(true);
    browser.screenshot("studio_recipe_dark");

    // A value that cannot be is refused in words.
    browser.fill(
        ".setting[data-path='scene.negatives'] input[type=number]",
        "3",
    );
    browser.wait(
        "document.querySelector('footer').className === 'bad' \
         && document.querySelector('footer').innerText.includes('scene.negatives: 3, expected')",
    );
    browser.press("z", CTRL);
    browser.wait(
        "!document.querySelector('#redo').disabled \
         && document.querySelector(\".setting[data-path='scene.negatives'] input[type=number]\").value !== '3'",
    );

    // What is saved is what the command line reads, with the comments of its author.
    browser.press("s", CTRL);
    browser.wait("document.querySelector('#save').disabled");
    let text = io::read_text(dir.path().join("recipe.toml")).unwrap();
    for line in tray::RECIPE.lines() {
        assert!(text.contains(line), "{line:?} is missing in {text}");
    }
    let config = DatasetConfig::read(dir.path().join("recipe.toml"), &[]).unwrap();
    assert!(config.scene.scale.max > 1.1, "{text}");
    assert_eq!(config.scene.gain_ev.max, 2.5);
    // The value that was refused is one that the browser complains of, too.
    browser
        .complaints
        .retain(|complaint| !complaint.contains("422"));
    browser.assert_content();
}

#[test]
fn of_three_lights_the_first_is_removed_twice() {
    let Some(mut browser) = Browser::open(1440, 900) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("recipe.toml");
    let light = |power: u32| format!("[[scene.lights]]\npower = {power}\n");
    let recipe = [10, 20, 30].map(light).concat();
    io::write_text(&path, &format!("{}{recipe}", tray::RECIPE)).unwrap();
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("recipe?file=recipe.toml"));
    for left in [2, 1] {
        let first = "details[data-table='scene.lights[0]'] > button";
        browser.wait_for(first);
        browser.eval(&format!("document.querySelector(\"{first}\").click()"));
        let all = "document.querySelectorAll(\"details[data-table^='scene.lights['] > button\")";
        browser.wait(&format!("{all}.length === {left}"));
    }
    browser.press("s", CTRL);
    browser.wait("document.querySelector('#save').disabled");
    let config = DatasetConfig::read(&path, &[]).unwrap();
    let powers = config.scene.lights.iter().map(|light| light.power.min);
    assert_eq!(powers.collect::<Vec<_>>(), [30.0]);
}

const EDITED: &str = "document.querySelectorAll('.setting.edited').length";

/// A browser that shows the page of a recipe alone, its folder and its studio.
fn recipe_alone() -> Option<(Browser, tempfile::TempDir, Studio)> {
    let mut browser = Browser::open(1440, 900)?;
    let dir = tempfile::tempdir().unwrap();
    io::write_text(dir.path().join("recipe.toml"), tray::RECIPE).unwrap();
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("recipe?file=recipe.toml"));
    browser.wait_for(".setting");
    Some((browser, dir, studio))
}

/// The first number of a setting.
fn number(path: &str) -> String {
    format!("document.querySelector(\".setting[data-path='{path}'] input[type=number]\")")
}

fn set_number(browser: &mut Browser, path: &str, value: &str) {
    let field = number(path);
    browser.eval(&format!(
        "{field}.value = '{value}'; {field}.dispatchEvent(new Event('change'))"
    ));
}

/// The title said that another recipe has edits, and its settings were those of the first.
#[test]
fn a_late_draft_of_one_recipe_is_not_shown_as_that_of_another() {
    let Some(mut browser) = Browser::open(1440, 900) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    for name in ["recipe.toml", "other.toml"] {
        io::write_text(dir.path().join(name), tray::RECIPE).unwrap();
    }
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("recipe?file=recipe.toml"));
    browser.wait_for(".setting");
    browser.eval(
        "const real = window.fetch; window.confirm = () => true; window.fetch = async (path, how) => { \
         const reply = await real(path, how); if (!path.includes('draft')) return reply; \
         await new Promise((done) => { window.late = done; }); return reply; }; null",
    );
    set_number(&mut browser, "scene.gain_ev", "0.25");
    browser.wait("window.late !== undefined");
    browser.eval(
        "const files = document.querySelector('#file'); files.value = 'other.toml'; \
         files.dispatchEvent(new Event('change')); null",
    );
    browser.wait("document.title === 'other.toml · petcomp studio'");
    browser.eval("window.late(); new Promise((done) => setTimeout(done, 200)).then(() => null)");
    browser.wait("document.title === 'other.toml · petcomp studio'");
    let edited = browser.eval(EDITED);
    assert_eq!(edited.as_u64(), Some(0));
    let saving = browser.eval("document.querySelector('#save').disabled");
    assert_eq!(saving.as_bool(), Some(true));
}

#[test]
fn settings_show_what_two_undos_at_once_leave() {
    let Some((mut browser, _dir, _studio)) = recipe_alone() else {
        return;
    };
    let gain = format!("{}.value", number("scene.gain_ev"));
    let before = browser.eval(&gain);
    for (path, count) in [("scene.gain_ev", 1), ("scene.scale", 2)] {
        set_number(&mut browser, path, "0.25");
        browser.wait(&format!("{EDITED} === {count}"));
    }
    browser.eval("for (let i = 0; i < 2; i++) document.querySelector('#undo').click()");
    browser.wait(&format!("{EDITED} === 0"));
    assert_eq!(browser.eval(&gain), before);
}

#[test]
fn an_edit_while_a_save_runs_stays_and_is_not_saved() {
    let Some((mut browser, dir, _studio)) = recipe_alone() else {
        return;
    };
    set_number(&mut browser, "scene.scale", "0.25");
    browser.wait(&format!("{EDITED} === 1"));
    // The save has been made, and its end waits.
    browser.eval(
        "(() => { const asked = window.fetch; window.fetch = async (path, options) => { \
         if (path.includes('recipe/open')) await new Promise((go) => { window.answer = go; }); \
         return asked(path, options); }; })()",
    );
    browser.press("s", CTRL);
    browser.wait("!!window.answer");
    set_number(&mut browser, "scene.gain_ev", "0.25");
    browser.wait(&format!("{EDITED} === 2"));
    browser.eval("window.answer()");
    browser.wait(&format!("{EDITED} === 1"));
    let gain = format!("{}.value", number("scene.gain_ev"));
    assert_eq!(browser.eval(&gain), "0.25");
    let can_save = "!document.querySelector('#save').disabled";
    assert_eq!(browser.eval(can_save), true);
    let text = io::read_text(dir.path().join("recipe.toml")).unwrap();
    assert!(text.contains("scale = [0.25"), "{text}");
    assert!(!text.contains("gain_ev"), "{text}");
}

#[test]
fn objects_need_be_large_enough_in_the_pictures_of_the_dataset_alone() {
    let dir = tempfile::tempdir().unwrap();
    tray::fill(dir.path());
    let studio = Studio::over(dir.path());
    let picture = |scale: &str| {
        let asked = format!(
            r#"{{ "file": "recipe.toml", "edits": [["scene.scale", "{scale}"]], "seed": 0, "k": 0, "side": 64, "slot": "a" }}"#
        );
        studio.post("api/recipe/picture", &asked)
    };
    let small = picture("0.2");
    assert!(small.starts_with("HTTP/1.1 200"), "{small}");
    let tiny = picture("0.02");
    assert!(tiny.contains("px long in pictures of 640 x 480"), "{tiny}");
}

#[test]
fn a_recipe_that_leads_out_of_the_folder_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let recipe = "assets = '../assets'\nbackgrounds = '/'\n";
    io::write_text(dir.path().join("recipe.toml"), recipe).unwrap();
    let studio = Studio::over(dir.path());
    let asked =
        r#"{ "file": "recipe.toml", "edits": [], "seed": 0, "k": 0, "side": 64, "slot": "a" }"#;
    let answer = studio.post("api/recipe/picture", asked);
    assert!(answer.starts_with("HTTP/1.1 422"), "{answer}");
    assert!(
        answer.contains("is outside this studio's folder"),
        "{answer}"
    );
}

#[test]
fn a_new_recipe_takes_no_name_of_another_file() {
    let dir = tempfile::tempdir().unwrap();
    io::write_text(dir.path().join("recipe.toml"), tray::RECIPE).unwrap();
    let studio = Studio::over(dir.path());
    let answer = studio.post("api/recipe/new", r#"{ "file": "recipe.toml" }"#);
    let expected = "recipe.toml: already exists";
    assert!(answer.contains(expected), "{answer}");
}

#[test]
fn edits_are_saved_over_what_another_program_has_written() {
    let Some((mut browser, dir, _studio)) = recipe_alone() else {
        return;
    };
    set_number(&mut browser, "scene.scale", "0.25");
    browser.wait(&format!("{EDITED} === 1"));
    let path = dir.path().join("recipe.toml");
    io::write_text(&path, &format!("{}gain_ev = 0.5\n", tray::RECIPE)).unwrap();
    browser.press("s", CTRL);
    browser.click_on("dialog button[value='Save mine']");
    browser.wait("document.querySelector('#save').disabled");
    let text = io::read_text(&path).unwrap();
    assert!(text.contains("gain_ev = 0.5"), "{text}");
    assert!(text.contains("scale = [0.25"), "{text}");
}

#[test]
fn a_stale_save_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    io::write_text(dir.path().join("recipe.toml"), DatasetConfig::template()).unwrap();
    let studio = Studio::over(dir.path());
    let save = r#"{ "file": "recipe.toml", "edits": [["scene.scale", "1"]], "version": "0" }"#;
    let answer = studio.post("api/recipe/save", save);
    assert!(answer.starts_with("HTTP/1.1 409"), "{answer}");
    assert_eq!(
        io::read_text(dir.path().join("recipe.toml")).unwrap(),
        DatasetConfig::template()
    );
}
