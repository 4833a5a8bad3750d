//! A dataset is looked through, in a real browser.

mod browser;

use browser::studio::{Studio, copy_files};
use browser::{Browser, tray};
use petcomp::{Image, LinearRgb, io};
use std::fmt::Write as _;
use std::path::Path;

const COUNT: u64 = 10;

fn found(browser: &mut Browser) -> String {
    browser.wait("document.querySelector('#found').dataset.done === 'true'");
    browser.text("#found")
}

fn choose(browser: &mut Browser, id: &str, value: &str) {
    browser.eval(&format!(
        "(() => {{ const e = document.querySelector('#{id}'); e.value = '{value}'; document.querySelector('#found').dataset.done = 'false'; \
         e.dispatchEvent(new Event('change', {{ bubbles: true }})); }})()"
    ));
}

#[test]
fn a_dataset_is_filtered_and_looked_at() {
    let Some(mut browser) = Browser::open(1440, 900) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let dataset = tray::with_dataset(dir.path(), COUNT);
    copy_files(
        &dataset.join("images/train"),
        &dir.path().join("real"),
        |_| true,
    );
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("dataset?folder=dataset"));
    browser.wait_for(".tile .caption b");
    assert_eq!(found(&mut browser), format!("{COUNT} pictures"));
    browser.wait(
        "[...document.querySelectorAll('.tile img')].every((image) => image.naturalWidth > 0)",
    );
    browser.screenshot("studio_dataset_grid");

    // Filters by what the list says, and by what only records say.
    choose(&mut browser, "part", "val");
    assert_eq!(found(&mut browser), format!("2 of {COUNT} pictures"));
    choose(&mut browser, "part", "");
    choose(&mut browser, "labelled", "false");
    choose(&mut browser, "most-seen", "60");
    let hidden = found(&mut browser);
    assert!(hidden.contains(&format!("of {COUNT} pictures")), "{hidden}");
    browser.eval("document.querySelector('[type=reset]').click()");
    browser.wait(&format!(
        "document.querySelector('#found').innerText === '{COUNT} pictures'"
    ));

    // A picture with everything that is known of it, by keys.
    browser.eval("document.querySelector('.tile').click()");
    browser.wait_for("#details .objects tbody tr");
    browser.wait("document.querySelector('.pane img').naturalWidth > 0");
    browser.press("m", 0);
    browser.press("c", 0);
    let draws = browser.text("#details .draws");
    assert!(draws.contains("objects[0].scale"), "{draws}");
    let painted = "(() => { const c = document.querySelector('.pane canvas'); \
        return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0); })()";
    browser.wait(painted);

    // Another folder beside it.
    browser.press("2", 0);
    browser.wait("document.querySelectorAll('.pane').length === 2");
    browser.eval(
        "(() => { const e = document.querySelectorAll('.pane select')[1]; e.value = 'real'; e.dispatchEvent(new Event('change')); })()",
    );
    browser.wait("document.querySelectorAll('.pane .name')[1].innerText.endsWith('1 of 8')");
    browser.wait("document.querySelectorAll('.pane img')[1].naturalWidth > 0");
    browser.press("x", 0);
    browser.screenshot("studio_dataset");
    // A phone's screen, for reviewing.
    browser.prefer_dark(true);
    browser.resize(400, 820);
    browser.screenshot("studio_dataset_phone");
    browser.resize(1440, 900);
    browser.press("Escape", 0);
    browser.wait("document.querySelector('#viewer').hidden");
    browser.assert_content();
}

#[test]
fn a_folder_that_is_listed_again_shifts_no_picture_of_the_first_list() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let add = |name: &str| {
        let grey = Image::filled(40, 30, LinearRgb::grey(0.5));
        io::write(dir.path().join(format!("{name}.png")), &grey).unwrap();
    };
    add("p2");
    add("p4");
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("dataset?folder="));
    browser.wait("document.querySelectorAll('.tile .caption b').length === 2");
    add("p1");
    browser.click_on(".tile[data-row='0']");
    let name = |pane: usize| format!("document.querySelectorAll('.pane .name')[{pane}]?.innerText");
    browser.wait(&format!("{} === 'p2.png · 1 of 2'", name(0)));
    browser.press("2", 0);
    browser.wait(&format!("{} === 'p4.png · 2 of 2'", name(1)));
    browser.eval("document.querySelectorAll('.pane select')[1].dispatchEvent(new Event('change'))");
    browser.wait(&format!("{} === 'p1.png · 1 of 3'", name(1)));
    browser.press("Escape", 0);
    browser.click_on(".tile[data-row='1']");
    browser.wait(&format!("{} === 'p4.png · 2 of 2'", name(0)));
    browser.assert_content();
}

#[test]
fn nothing_of_another_picture_stands_beside_one_whose_record_cannot_be_read() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let dataset = tray::with_dataset(dir.path(), COUNT);
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("dataset?folder=dataset"));
    browser.click_on(".tile[data-row='0']");
    browser.wait_for("#details .objects tbody tr");
    for part in std::fs::read_dir(dataset.join("scenes")).unwrap() {
        for record in std::fs::read_dir(part.unwrap().path()).unwrap() {
            std::fs::write(record.unwrap().path(), "{").unwrap();
        }
    }
    browser.press("ArrowRight", 0);
    browser.wait("document.querySelector('footer').className === 'bad'");
    assert_eq!(browser.text(".pane .name"), format!("2 of {COUNT}"));
    assert_eq!(browser.text("#details"), "");
    let drawn = "document.querySelector('.pane canvas').width";
    assert_eq!(browser.eval(drawn), 0);
}

/// A dataset of which only the list is there, but for its first picture's files.
fn listed_only(folder: &Path, count: usize) {
    let text = r#"{ "format": 1, "classes": ["cap", "none"] }"#;
    io::create_folder(folder).unwrap();
    io::write_text(folder.join("dataset.json"), text).unwrap();
    let mut lines = String::new();
    for k in 0..count {
        let objects = if k == 70_000 { 90 } else { 3 + k % 5 };
        writeln!(
            lines,
            r#"{{"k":{k},"part":"train","classes":[[{objects},2],[1,1]],"obstructed":1,"knotted":0,"retries":0,"files":[{{"path":"images/train/{k:06}.png","bytes":9,"crc32":1}},{{"path":"scenes/train/{k:06}.json","bytes":9,"crc32":1}}]}}"#
        )
        .unwrap();
    }
    io::write_text(folder.join("index.jsonl"), &lines).unwrap();
    io::write_text(
        folder.join("data.yaml"),
        "train: images\nval: images\nnames: [cap, none]\n",
    )
    .unwrap();
}

#[test]
fn a_hundred_thousand_pictures_are_listed_without_reading_them() {
    let Some(mut browser) = Browser::open(1280, 800) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    listed_only(&dir.path().join("large"), 100_000);
    let studio = Studio::over(dir.path());
    let start = std::time::Instant::now();
    browser.go(&studio.page("dataset?folder=large"));
    browser.wait("document.querySelector('#found').innerText === '100,000 pictures'");
    eprintln!(
        "100,000 pictures are listed after {:.1} s",
        start.elapsed().as_secs_f64()
    );
    let tiles = "document.querySelectorAll('.tile').length";
    assert!(browser.eval(tiles).as_u64().unwrap() < 100);
    // To the last one at once.
    browser.eval(
        "(() => { const e = document.querySelector('#grid'); e.scrollTop = e.scrollHeight; })()",
    );
    browser.wait("!!document.querySelector(\".tile[data-row='99999']\")");
    assert!(browser.eval(tiles).as_u64().unwrap() < 100);
    choose(&mut browser, "fewest", "50");
    browser.wait("document.querySelector('#found').innerText === '1 of 100,000 pictures'");
    browser.wait("!!document.querySelector(\".tile[data-row='70000']\")");
}

#[test]
fn no_picture_outside_of_the_folder_is_shown() {
    let dir = tempfile::tempdir().unwrap();
    let (inside, outside) = (dir.path().join("studio/set"), dir.path().join("secret"));
    for folder in [&inside, &outside] {
        io::create_folder(folder).unwrap();
    }
    std::fs::write(outside.join("a.png"), "").unwrap();
    io::write_text(
        inside.join("list.txt"),
        &format!("{}\n", outside.join("a.png").display()),
    )
    .unwrap();
    io::write_text(
        inside.join("data.yaml"),
        "train: list.txt\nval: list.txt\nnames: [cap]\n",
    )
    .unwrap();
    let studio = Studio::over(&dir.path().join("studio"));
    for path in ["picture", "sample"] {
        let answer = studio.get(&format!("api/dataset/{path}?folder=set&row=0"));
        assert!(answer.starts_with("HTTP/1.1 404"), "{answer}");
    }
    let up = studio.get("api/dataset/open?folder=../secret");
    assert!(up.starts_with("HTTP/1.1 404"), "{up}");
}
