//! The real program in an empty folder, as a person types it.

mod desk;

use desk::{Desk, PETCOMP, SAMPLES, text, words};
use petcomp::io::exr::{ChannelSamples, Part};
use petcomp::io::{self, FromFile, ToFile};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;

impl Desk {
    fn write_picture(&self, name: &str, picture: &Image<impl ToFile>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("inside the desk")).expect("a folder");
        io::write(path, picture).expect("a picture");
    }

    fn read<P: FromFile>(&self, name: &str) -> Image<P> {
        io::read(self.path(name)).expect("a picture")
    }

    /// Of all files, in the order of their names.
    fn content(&self) -> Vec<Vec<u8>> {
        let files = self.files().into_iter();
        files
            .map(|file| std::fs::read(file).expect("a file"))
            .collect()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).expect("a file")
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect("a text")
    }

    /// Runs what must succeed and returns what it printed.
    fn ok(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "petcomp {args:?}\n{out}{err}");
        out
    }

    /// Runs what must fail and returns the one line that says why, having checked that nothing was
    /// left behind.
    fn refused(&self, args: &[&str]) -> String {
        let before = self.files();
        let output = self.run(args);
        let err = text(&output.stderr);
        assert!(!output.status.success(), "petcomp {args:?} succeeded");
        assert!(
            output.status.code().is_some_and(|code| code != 101),
            "petcomp {args:?} panicked: {err}"
        );
        let errors: Vec<&str> = err
            .lines()
            .filter(|line| line.starts_with("error: "))
            .collect();
        assert_eq!(errors.len(), 1, "petcomp {args:?} said:\n{err}");
        assert_eq!(
            self.files(),
            before,
            "petcomp {args:?} left something behind"
        );
        errors[0].to_owned()
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut found = Vec::new();
        walk(self.folder(), &mut found);
        found.sort();
        found
    }
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        if entry.path().is_dir() {
            walk(&entry.path(), found);
        } else {
            found.push(entry.path());
        }
    }
}

fn sample(name: &str) -> String {
    format!("{SAMPLES}/{name}")
}

/// A sample dataset of one picture, in the folder `demo`.
fn demo(desk: &Desk) {
    demo_into(desk, "demo", "-n 1");
}

fn demo_into(desk: &Desk, folder: &str, more: &str) {
    let demo = format!("demo -q {more} -o {folder} --samples");
    desk.ok(&[&words(&demo)[..], &[SAMPLES]].concat());
}

/// A label file with these corners for a picture that need not exist.
fn label(corners: &str) -> String {
    format!(
        r#"{{"format": "plane-label", "version": 1, "image": {{"file": "a.jpg", "width": 640, "height": 480}},
            "surface": {{"id": "tray", "width_m": 0.6, "height_m": 0.4, "corners_px": {corners}}}}}"#
    )
}

const SQUARE: &str = "[[100, 100], [500, 110], [510, 400], [90, 390]]";

#[test]
fn every_subcommand_explains_itself() {
    let desk = Desk::new();
    let help = desk.ok(&["--help"]);
    for stage in [
        "demo", "matte", "capture", "asset", "camera", "scene", "settle", "render", "label",
        "dataset", "diff", "doctor",
    ] {
        assert!(help.contains(stage), "--help does not name {stage}");
        assert!(
            desk.ok(&[stage, "--help"]).len() > 100,
            "{stage} --help says little"
        );
    }
}

#[test]
fn the_program_does_not_load_openimageio() {
    let Ok(ldd) = Command::new("ldd").arg(PETCOMP).output() else {
        return;
    };
    assert!(
        !text(&ldd.stdout).contains("OpenImageIO"),
        "petcomp links OpenImageIO"
    );
}

#[test]
fn doctor_finds_nothing_wrong() {
    Desk::new().ok(&["doctor"]);
}

#[test]
fn global_options_are_explained_once() {
    let desk = Desk::new();
    assert!(
        desk.ok(&["--help"])
            .contains("Global options:\n  -j, --threads <N>")
    );
    let help = desk.ok(&["dataset", "generate", "--help"]);
    let last = help.lines().last().unwrap_or_default();
    assert!(
        last.starts_with("Global options (see `petcomp --help`): -j, -q"),
        "{help}"
    );
    assert!(!help.contains("--oiio <"), "{help}");
    // Hidden in the help, they are taken as before.
    desk.ok(&words("dataset init recipe.toml -q --oiio off -j 1"));
}

#[test]
fn a_check_fails_on_what_needs_review_where_that_is_asked_for() {
    let desk = Desk::new();
    let photo = sample("bottles/b0006_0.png");
    desk.ok(&[
        "asset", "add", &photo, "--class", "none", "--length", "0.2", "-o", "assets",
    ]);
    let said = desk.ok(&["asset", "check", "assets"]);
    assert!(
        said.contains("b0006_0.exr: ") && said.contains("1 to review"),
        "the sample has the screen's hue: {said}"
    );
    let strict = desk.run(&["asset", "check", "assets", "--strict"]);
    assert_eq!(strict.status.code(), Some(1), "{}", text(&strict.stderr));
}

#[test]
fn the_size_of_an_object_is_written_as_every_size() {
    let desk = Desk::new();
    write_slab(&desk.path("slab.png"));
    for size in ["0.2x0.1", "0.2,0.1"] {
        let said = desk.ok(&[
            "asset", "add", "slab.png", "--class", "slab", "--size", size, "-o", "assets",
        ]);
        let (_, told) = said.split_once("slab.exr: ").expect("its size");
        let millimetres = told.split_once(" mm").expect("a unit").0.split(" x ");
        let sides: Vec<f64> = millimetres
            .map(|mm| mm.parse().expect("a number"))
            .collect();
        assert!(
            (sides[0] - 200.0).abs() < 1.0 && (sides[1] - 100.0).abs() < 1.0,
            "{said}"
        );
    }
}

#[test]
fn the_columns_of_a_list_are_as_wide_as_their_longest_words() {
    let desk = Desk::new();
    write_slab(&desk.path("slab.png"));
    for (name, class) in [
        ("a", "b"),
        ("a_name_of_26_characters_abc", "a class of 20 letters"),
    ] {
        let add = [
            "asset", "add", "slab.png", "--length", "0.2", "-o", "assets", "-q",
        ];
        desk.ok(&[&add[..], &["--name", name, "--class", class]].concat());
    }
    let listed = desk.ok(&["asset", "list", "assets"]);
    let places: Vec<_> = listed.lines().map(|line| line.find(" mm (")).collect();
    assert!(
        matches!(places[..], [Some(a), Some(b)] if a == b),
        "{listed}"
    );
}

#[test]
fn an_option_without_the_one_that_it_belongs_to_is_refused() {
    let desk = Desk::new();
    let add = |more: &[&str]| {
        let add = ["asset", "add", "can.png", "--class", "can", "-o", "assets"];
        desk.refused(&[&add[..], more].concat())
    };
    let corners = ["--screen-corners", "-3,-2 600,0 600,400 0,400"];
    for ([option, value], other) in [
        (["--empty", "empty.png"], "--captured"),
        (["--display", "display.toml"], "--captured"),
        (["--display-width", "0.3"], "--captured"),
        (corners, "--screen-size"),
    ] {
        let told = add(&["--length", "0.2", option, value]);
        assert!(
            told.contains(&format!("{option}: given without {other}")),
            "{told}"
        );
    }
    let told = add(&[&["--screen-size", "0.6x0.4"], &corners[..]].concat());
    assert!(told.contains("can.png: no such file"), "{told}");
}

#[test]
fn a_number_below_zero_is_a_value_and_no_option() {
    let desk = Desk::new();
    for (option, line) in [
        ("--count <N>", "dataset generate recipe.toml -o out -n -3"),
        (
            "--threads <N>",
            "dataset generate recipe.toml -o out -n 3 -j -3",
        ),
        (
            "--seed <SEED>",
            "dataset generate recipe.toml -o out -n 3 --seed -3",
        ),
    ] {
        let said = desk.refused(&words(line));
        let expected = format!("error: invalid value '-3' for '{option}': ");
        assert!(said.starts_with(&expected), "{said}");
    }
}

#[test]
fn a_split_takes_the_options_of_its_own_way_alone() {
    let desk = Desk::new();
    for (options, option, own) in [
        ("--by random --guard 3", "--guard", "consecutive"),
        ("--by random --group selection", "--group", "grouped"),
        ("--group selection", "--group", "grouped"),
    ] {
        let told = desk.refused(&words(&format!("dataset split set -o out {options}")));
        let why = format!("{option}: given without --by {own}");
        assert!(told.contains(&why), "{told}");
    }
}

/// A dataset of empty files, both of whose parts are the same.
fn write_unsplit_set(desk: &Desk, folder: &str, images: usize, names: &str) {
    let yaml = format!("train: images\nval: images\nnames: {names}\n");
    desk.write(format!("{folder}/data.yaml"), yaml);
    for i in 0..images {
        desk.write(format!("{folder}/images/{i}.png"), "");
    }
}

#[test]
fn lists_without_images_are_refused() {
    let desk = Desk::new();
    write_unsplit_set(&desk, "set", 12, "[cap]");
    for (line, why) in [
        (
            "split set --guard 3",
            "split: 9 images for training and 0 for validation: too few images for --ratio 0.8 with --guard 3",
        ),
        (
            "subset set --head 0.04",
            "--head: 0.04 leaves none of the 12 images for training",
        ),
    ] {
        let told = desk.refused(&words(&format!("dataset {line} -o out")));
        assert!(told.contains(why), "{told}");
    }
}

#[test]
fn batches_of_sets_that_name_other_classes_are_refused() {
    let desk = Desk::new();
    write_unsplit_set(&desk, "real", 1, "[none, cap]");
    write_unsplit_set(&desk, "made", 1, "[cap, none]");
    let told = desk.refused(&words(
        "dataset batches --real real --synthetic made -o batches.jsonl",
    ));
    let why = r#"classes: ["cap", "none"] in made, expected ["none", "cap"] as in real"#;
    assert!(told.contains(why), "{told}");
}

#[test]
fn what_is_trained_on_twice_or_validates_too_is_told() {
    let desk = Desk::new();
    write_unsplit_set(&desk, "real", 3, "[cap]");
    write_unsplit_set(&desk, "made", 3, "[cap]");
    let kit = "dataset train-kit -o kit --real real --synthetic";
    let output = desk.run(&words(&format!("{kit} made")));
    let told = text(&output.stderr);
    assert!(output.status.success(), "{told}");
    let why = "real: 3 of 3 images for validation are also used for training; see `dataset split`";
    assert!(told.contains(why), "{told}");
    let batches = "dataset batches -o batches.jsonl --real real --synthetic";
    for line in [kit, batches] {
        let told = desk.refused(&words(&format!("{line} ./real")));
        let why = "real/images/0.png is also a real image, expected images that are not in real";
        assert!(told.contains(why), "{told}");
    }
}

#[test]
fn a_set_for_training_alone_has_batches_and_anchors() {
    let desk = Desk::new();
    for set in ["set", "made"] {
        write_slab(&desk.path(format!("{set}/images/a.png")));
        desk.write(format!("{set}/labels/a.txt"), "0 0.5 0.5 0.4 0.4\n");
        desk.write(format!("{set}/none.txt"), "");
        let yaml = "train: images\nval: none.txt\nnames: [cap]\n";
        desk.write(format!("{set}/data.yaml"), yaml);
    }
    desk.ok(&words(
        "dataset batches --real set --synthetic made -o batches.jsonl",
    ));
    let said = desk.ok(&words("dataset anchors set -n 1"));
    assert!(said.contains("mean IoU 1.000"), "{said}");
    desk.write("set/labels/a.txt", "");
    let told = desk.refused(&words("dataset anchors set -n 1"));
    assert!(told.contains("no boxes in the labels"), "{told}");
}

#[test]
fn a_missing_image_is_found_once() {
    let desk = Desk::new();
    write_slab(&desk.path("set/images/a.png"));
    desk.write("set/labels/a.txt", "0 0.5 0.5 0.4 0.4\n");
    desk.write("set/train.txt", "images/a.png\nimages/gone.png\n");
    desk.write("set/none.txt", "");
    let yaml = "train: train.txt\nval: none.txt\nnames: [cap]\n";
    desk.write("set/data.yaml", yaml);
    let output = desk.run(&words("dataset check set"));
    let told = text(&[output.stdout, output.stderr].concat());
    assert_eq!(told.matches("gone").count(), 1, "{told}");
}

#[test]
fn ignored_lines_of_tags_are_told_with_their_file() {
    let desk = Desk::new();
    write_slab(&desk.path("set/images/a.png"));
    desk.write("set/labels/a.txt", "0 0.5 0.5 0.4 0.4\n");
    desk.write(
        "set/data.yaml",
        "train: images\nval: images\nnames: [cap]\n",
    );
    desk.write("found/a.txt", "0 0.5 0.5 0.4 0.4 0.9\n");
    desk.write("tags.csv", "image,light\nz,dim\na,bright\n");
    let eval = desk.run(&words("eval found set/labels --tags tags.csv -o report"));
    let told = text(&eval.stderr);
    let expected = "tags.csv: 1 lines are ignored, the first: line 2: no image \"z\"";
    assert!(told.contains(expected), "{told}");
}

#[test]
fn detections_of_classes_without_a_name_are_told() {
    let desk = Desk::new();
    write_slab(&desk.path("set/images/a.png"));
    desk.write("set/labels/a.txt", "0 0.5 0.5 0.4 0.4\n");
    let yaml = "train: images\nval: images\nnames: [cap]\n";
    desk.write("set/data.yaml", yaml);
    let eval = words("eval found set/labels -o report");
    for (class, is_told) in [("0", false), ("1", true)] {
        desk.write("found/a.txt", format!("{class} 0.5 0.5 0.4 0.4 0.9\n"));
        let told = text(&desk.run(&eval).stderr);
        let expected = "1 detections of classes up to 1, but data.yaml names 1, numbered from 0";
        assert_eq!(told.contains(expected), is_told, "{told}");
    }
}

#[test]
fn photos_that_would_become_one_cut_out_are_refused() {
    let desk = Desk::new();
    write_slab(&desk.path("one/can.png"));
    write_slab(&desk.path("two/can.png"));
    let told = desk.refused(&words(
        "asset add one/can.png two/can.png --class can --length 0.2 -o assets",
    ));
    assert!(
        told.contains("\"two/can.png\", would give the same cut-out file as photos[0]"),
        "{told}"
    );
}

#[test]
fn a_bad_photo_does_not_stop_those_that_are_added_with_it() {
    let desk = Desk::new();
    write_slab(&desk.path("one.png"));
    write_slab(&desk.path("two.png"));
    desk.write("bad.png", "no picture");
    let add = |photos: &str| {
        let line = format!("asset add {photos} --name can --class can --length 0.2 -o assets -q");
        let done = desk.run(&words(&line));
        (done.status.code(), text(&done.stderr))
    };
    let (status, told) = add("one.png bad.png two.png");
    assert_eq!(status, Some(2), "{told}");
    assert!(
        told.contains("failed: bad.png: ")
            && told.contains("error: 1 of 3 files could not be used; the rest is done"),
        "{told}"
    );
    for file in ["can/one.exr", "can/two.exr", "contact_sheet.png"] {
        assert!(desk.path("assets").join(file).exists(), "{file}");
    }
    let (status, told) = add("bad.png");
    assert_eq!(status, Some(4), "{told}");
    let (status, told) = add("one.png two.png --mass=-1");
    assert_eq!(status, Some(3), "{told}");
    assert_eq!(told.matches("mass: -1").count(), 1, "{told}");
}

/// Adds a photo of a ring of 0.2 m to a folder, and returns what it said of it.
fn add_ring(desk: &Desk, photo: &str, folder: &str) -> String {
    let add = ["asset", "add", photo, "--class", "ring", "--length", "0.2"];
    let done = desk.run(&[&add[..], &["-o", folder]].concat());
    let said = text(&done.stderr);
    assert!(done.status.success(), "{said}");
    said
}

#[test]
fn a_photo_that_its_cut_out_would_replace_is_refused() {
    let desk = Desk::new();
    write_slab(&desk.path("slab/slab.png"));
    let before = std::fs::read(desk.path("slab/slab.png")).expect("a photo");
    let add = ["asset", "add", "slab/slab.png", "--class", "ring"];
    let told = desk.refused(&[&add[..], &["--length", "0.2", "-o", "."]].concat());
    assert!(
        told.contains("slab.png: is an input and would be overwritten"),
        "{told}"
    );
    let after = std::fs::read(desk.path("slab/slab.png")).expect("a photo");
    assert_eq!(after, before);
    add_ring(&desk, "slab/slab.png", "assets");
    for taken in ["assets/slab/slab.exr", "assets/assets.toml"] {
        let told = desk.refused(&["asset", "sheet", "assets", "-o", taken]);
        assert!(
            told.contains("is an input and would be overwritten"),
            "{told}"
        );
    }
}

#[test]
fn pages_of_a_longer_contact_sheet_do_not_stay() {
    let desk = Desk::new();
    write_slab(&desk.path("slab.png"));
    let pages = [2, 3].map(|i| desk.path(format!("assets/contact_sheet_{i}.png")));
    add_ring(&desk, "slab.png", "assets");
    for page in &pages {
        std::fs::write(page, "").expect("a page");
    }
    add_ring(&desk, "slab.png", "assets");
    assert!(pages.iter().all(|page| !page.exists()));
    assert!(desk.path("assets/contact_sheet.png").exists());
}

#[test]
fn another_photo_of_the_same_name_replaces_a_cut_out_with_a_warning() {
    let desk = Desk::new();
    write_slab(&desk.path("x/slab.png"));
    desk.write_picture("y/slab.png", &red_on_green(30..70, 25..55));
    let warning = "slab/slab.exr: replaces the cut-out of another photo";
    for (photo, is_told) in [("x", false), ("x", false), ("y", true)] {
        let said = add_ring(&desk, &format!("{photo}/slab.png"), "assets");
        assert_eq!(said.contains(warning), is_told, "{said}");
    }
}

#[test]
fn spaces_around_the_names_of_classes_are_none_of_them() {
    let desk = Desk::new();
    write_slab(&desk.path("slab.png"));
    let add = [
        "asset", "add", "slab.png", "--length", "0.2", "-o", "assets",
    ];
    let said = desk.ok(&[&add[..], &["--classes", "ring, cup", "--class", " cup"]].concat());
    assert!(said.contains("classes 0 ring, 1 cup;"), "{said}");
}

#[test]
fn a_scale_that_is_wrong_for_one_photo_does_not_stop_the_others() {
    let desk = Desk::new();
    write_slab(&desk.path("one.png"));
    desk.write_picture("small.png", &red_on_green(50..62, 30..40));
    let line = "asset add small.png one.png --class ring --scale 3000 -o assets";
    let done = desk.run(&words(line));
    let told = text(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{told}");
    assert!(
        told.contains("failed: no cut-out: px_per_metre: 3000, makes the object in small.png"),
        "{told}"
    );
    assert!(desk.path("assets/small/one.exr").exists());
}

#[test]
fn a_list_whose_only_photo_a_person_rejected_leaves_an_empty_sheet() {
    let desk = Desk::new();
    write_slab(&desk.path("one.png"));
    desk.write("photos.csv", "file,asset,class,length\none.png,a,cap,0.3\n");
    let build = ["asset", "build", "photos.csv", "-o", "built"];
    let height = || {
        let sheet = io::read_header(desk.path("built/contact_sheet.png"));
        sheet.expect("a sheet").height
    };
    desk.ok(&build);
    let full = height();
    desk.write(
        "one.review.json",
        r#"{"format": "cut-out-review", "version": 1, "size_px": [120, 80], "verdict": "rejected"}"#,
    );
    desk.ok(&build);
    assert!(height() < full && !desk.path("built/a/one.exr").exists());
    // What gives no cut-out any more keeps its earlier one, on the sheet too.
    std::fs::remove_file(desk.path("one.review.json")).expect("a review");
    desk.ok(&build);
    desk.write_picture("one.png", &Image::filled(120, 80, GREEN));
    assert!(!desk.run(&build).status.success());
    assert!(height() == full && desk.path("built/a/one.png").exists());
}

#[test]
fn an_asset_of_two_classes_or_roles_is_refused_before_any_work() {
    let desk = Desk::new();
    write_slab(&desk.path("one.png"));
    write_slab(&desk.path("two.png"));
    for (second, expected) in [
        (
            "can,",
            "photos[1].class: \"can\", but another photo of the asset has \"cup\"",
        ),
        (
            "cup,distractor",
            "photos[1].role: distractor, but another photo of the asset has object",
        ),
    ] {
        let rows = format!("one.png,a,0.3,cup,\ntwo.png,a,0.3,{second}\n");
        desk.write(
            "photos.csv",
            format!("file,asset,length,class,role\n{rows}"),
        );
        let told = desk.refused(&["asset", "build", "photos.csv", "-o", "built"]);
        assert!(told.contains(expected), "{told}");
    }
    assert!(!desk.path("built").exists());
}

#[test]
fn a_build_without_one_of_its_photos_is_incomplete() {
    let desk = Desk::new();
    write_slab(&desk.path("one.png"));
    desk.write_picture("two.png", &Image::filled(120, 80, GREEN));
    let list = "file,asset,class,length\none.png,a,cap,0.3\ntwo.png,b,cap,0.3\n";
    desk.write("photos.csv", list);
    let built = desk.run(&["asset", "build", "photos.csv", "-o", "built", "-q"]);
    let told = text(&built.stderr);
    assert_eq!(built.status.code(), Some(2), "{told}");
    assert!(
        told.contains("error: 1 of 2 files could not be used; the rest is done"),
        "{told}"
    );
    desk.ok(&["asset", "check", "built"]);
    desk.write("photos.csv", "file,asset,class,length\none.png,b,cap,0.3\n");
    let said = desk.ok(&["asset", "build", "photos.csv", "-o", "built"]);
    assert!(
        said.contains("in the folder but not in the list: a/one.exr\n"),
        "{said}"
    );
}

/// What a terminal shows of a job, from its start.
#[cfg(target_os = "linux")]
#[test]
fn a_progress_bar_begins_at_nothing() {
    let desk = Desk::new();
    let job = format!("stty cols 80; {PETCOMP} asset build list.csv -o assets");
    desk.write(
        "list.csv",
        format!(
            "file,asset,class,length\n{},a,none,0.2\n",
            sample("bottles/b0006_0.png")
        ),
    );
    let mut command = Command::new("script");
    let output = command
        .args(["-qec", &job, "/dev/null"])
        .current_dir(desk.folder())
        .output()
        .expect("Debian has script");
    let shown = text(&output.stdout);
    let first = shown
        .split(['\r', '\n'])
        .find(|line| line.contains("cut-outs"))
        .unwrap_or_default();
    assert!(
        first.contains("0/1") && !first.contains('█'),
        "{first:?} of {shown}"
    );
}

#[test]
fn what_is_no_picture_is_refused_by_name() {
    let desk = Desk::new();
    let whole = std::fs::read(sample("bottles/b0000_0.png")).expect("a sample");
    desk.write("note.png", "this is a note");
    desk.write("half.png", &whole[..whole.len() / 2]);
    let mut without_pixels = whole;
    without_pixels[16..24].fill(0);
    desk.write("empty.png", without_pixels);
    for (name, why) in [
        ("nowhere.png", "nowhere.png: no such file"),
        ("note.png", "expected"),
        ("half.png", ""),
        ("empty.png", ""),
    ] {
        let told = desk.refused(&["matte", "cut", name, "-o", "out.exr"]);
        assert!(told.contains(name) && told.contains(why), "{name}: {told}");
    }
}

#[test]
fn labels_of_three_corners_or_of_none_that_are_convex_are_refused() {
    let desk = Desk::new();
    for (last, why) in [
        ("[510, 400]", "corners_px"),
        ("[200, 150], [90, 390]", "not convex"),
    ] {
        let corners = format!("[[100, 100], [500, 110], {last}]");
        desk.write("a.label.json", label(&corners));
        let told = desk.refused(&["camera", "solve", "a.label.json"]);
        assert!(
            told.contains("a.label.json") && told.contains(why),
            "{told}"
        );
    }
}

#[test]
fn crossed_corners_are_put_in_order_and_said() {
    let desk = Desk::new();
    desk.write(
        "a.label.json",
        label("[[100, 100], [510, 400], [500, 110], [90, 390]]"),
    );
    let output = desk.run(&["camera", "solve", "a.label.json"]);
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(
        output.status.success() && said.contains("sorted clockwise"),
        "{said}"
    );
}

#[test]
fn an_unknown_key_is_met_with_the_one_that_was_meant_and_an_impossible_range_is_named() {
    let desk = Desk::new();
    for (wrong, why) in [
        (
            "objcts = [1, 2]",
            "scene: unknown key \"objcts\", did you mean \"objects\"?",
        ),
        ("scale = [0.0, -1.0]", "scene.scale"),
    ] {
        desk.write("recipe.toml", format!("[scene]\n{wrong}\n"));
        let told = desk.refused(&words("dataset generate recipe.toml -n 1 -o out"));
        assert!(told.contains(&format!("recipe.toml: {why}")), "{told}");
    }
}

#[test]
fn ablations_differ_in_the_switch_that_is_asked_for() {
    let desk = Desk::new();
    desk.write("recipe.toml", "[scene]\nobjects = 3\n");
    let ablate = "dataset ablate recipe.toml -n 0 -o";
    let switches = "--switch scene.friction=0.1 --switch scene.scale=1.5";
    let out = desk.ok(&words(&format!("{ablate} mine {switches}")));
    assert_eq!(out.lines().count(), 3, "{out}");
    let recipe = |folder: &str| desk.text(&format!("{folder}/recipe.toml"));
    let all = recipe("mine/all");
    let own_lines = |folder: &str| {
        let written = recipe(folder);
        let own = written
            .lines()
            .filter(|line| !all.lines().any(|other| other == *line));
        own.map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(
        all.contains("objects = 3") && all.contains("friction = 0.5"),
        "{all}"
    );
    assert_eq!(own_lines("mine/scene.friction=0.1"), ["friction = 0.1"]);
    assert_eq!(own_lines("mine/scene.scale=1.5"), ["scale = 1.5"]);
    let paper = desk.ok(&words(&format!("{ablate} paper")));
    assert_eq!(paper.lines().count(), 7, "{paper}");
    let wrong = format!("{ablate} never --switch scene.frictoin=0.1");
    let told = desk.refused(&words(&wrong));
    assert!(told.contains("did you mean \"friction\"?"), "{told}");
}

#[test]
fn a_switch_that_cannot_work_is_told_before_anything_is_made() {
    let desk = Desk::new();
    demo(&desk);
    let ablate = "dataset ablate demo/recipe.toml -n 1 --switch assets=nowhere -o out";
    let output = desk.run(&words(ablate));
    let told = text(&output.stderr);
    assert!(!output.status.success(), "{told}");
    assert!(told.contains("error: assets=nowhere: "), "{told}");
    assert!(!desk.path("out/all/dataset").exists());
}

#[test]
fn recipes_of_long_switches_are_written() {
    let desk = Desk::new();
    desk.write("recipe.toml", "[scene]\nobjects = 3\n");
    let numbers: Vec<String> = (1..=100).map(|n| n.to_string()).collect();
    let weights = ["1"; 100].join(", ");
    let values = numbers.join(", ");
    let switch = format!("scene.objects={{ values = [{values}], weights = [{weights}] }}");
    let ablate = "dataset ablate recipe.toml -n 0 -o out --switch";
    let out = desk.ok(&[&words(ablate)[..], &[switch.as_str()]].concat());
    let mut recipes = out.lines();
    assert!(recipes.all(|path| desk.path(path).exists()), "{out}");
    assert_eq!(out.lines().count(), 2, "{out}");
}

#[test]
fn a_recipe_beside_a_dataset_is_not_written_over() {
    let desk = Desk::new();
    desk.write("recipe.toml", "[scene]\nobjects = 3\n");
    let ablate = words("dataset ablate recipe.toml -n 0 --switch scene.scale=1.5 -o out");
    desk.ok(&ablate);
    std::fs::create_dir(desk.path("out/scene.scale=1.5/dataset")).unwrap();
    desk.ok(&ablate);
    let recipes = || ["all", "scene.scale=1.5"].map(|s| desk.text(&format!("out/{s}/recipe.toml")));
    let before = recipes();
    let refused = desk.refused(&[&ablate[..], &["--set", "scene.objects=4"]].concat());
    assert!(
        refused.contains("scene.scale=1.5/recipe.toml: differs from this run"),
        "{refused}"
    );
    assert_eq!(recipes(), before);
}

#[test]
fn a_url_is_no_folder_of_its_own_name() {
    let desk = Desk::new();
    desk.write("recipe.toml", "");
    let ablate = "dataset ablate recipe.toml -n 0 --switch scene.scale=1.5 -o";
    for line in [
        ablate,
        "dataset split set -o",
        "dataset subset set --head 0.5 -o",
        "dataset merge shard -o",
        "dataset train-kit --real set --synthetic set -o",
        "eval found truth -o",
        "asset build photos.toml -o",
        "asset add a.png --class cap --length 0.2 -o",
        "capture frames --size 64x48 -o",
        "matte segment a.png -o",
        "demo -o",
        "scene export s.toml recipe.toml --to cycles",
    ] {
        let told = desk.refused(&words(&format!("{line} s3://bucket/data")));
        assert!(told.contains("output: a URL, expected a folder"), "{told}");
    }
    let folder = desk.path("out");
    desk.ok(&words(&format!("{ablate} file://{}", folder.display())));
    assert!(folder.join("all/recipe.toml").exists());
}

#[test]
fn a_folder_takes_no_scratch_folder() {
    let desk = Desk::new();
    desk.write("recipe.toml", "");
    let generate = words("dataset generate recipe.toml -n 1 -o out --scratch x");
    let told = desk.refused(&generate);
    let why = "--scratch: given without an object store as --output";
    assert!(told.contains(why), "{told}");
}

#[test]
fn an_output_folder_that_is_a_file_is_refused() {
    let desk = Desk::new();
    desk.write("taken", "a file");
    let error = desk.refused(&["demo", "--samples", SAMPLES, "-o", "taken"]);
    assert!(error.contains("taken"), "{error}");
}

/// Writes a picture of green that gets brighter from left to right.
fn write_green_ramp(path: &Path, brightest: f32) {
    let green = |x: usize| LinearRgb::new(0.02, brightest * x as f32 / 24.0, 0.05);
    let ramp = Image::from_fn(24, 4, |x, _| green(x));
    io::write(path, &ramp).expect("a picture");
}

#[test]
fn the_frames_of_a_sequence_are_keyed_into_folders() {
    let desk = Desk::new();
    let screen = ["--screen", "0.02,0.6,0.05"];
    std::fs::create_dir(desk.path("shot")).expect("a folder");
    for (k, brightest) in [0.3, 0.5, 0.7].into_iter().enumerate() {
        let (frame, alone) = (format!("shot/{k}.png"), format!("alone_{k}.exr"));
        write_green_ramp(&desk.path(&frame), brightest);
        desk.ok(&[&["matte", "key", &frame, "-o", &alone][..], &screen].concat());
    }
    let frames = ["shot/0.png", "shot/1.png", "shot/2.png"];
    let folders = ["-o", "keyed", "--matte", "mattes"];
    let told = ["--progress", "json"];
    let output = desk.run(&[&["matte", "key"][..], &frames, &folders, &screen, &told].concat());
    assert!(output.status.success());
    let told = text(&output.stderr);
    let first: serde_json::Value =
        serde_json::from_str(told.lines().next().unwrap_or_default()).expect("JSON");
    assert_eq!(
        (&first["done"], &first["of"]),
        (&0.into(), &3.into()),
        "{told}"
    );
    for k in 0..3 {
        let [together, alone] = ["keyed/", "alone_"].map(|at| desk.bytes(&format!("{at}{k}.exr")));
        assert_eq!(together, alone);
        assert!(desk.path(format!("mattes/{k}.exr")).exists());
    }
    let same = ["matte", "key", "shot/0.png", "shot/0.png", "-o", "twice"];
    let refused = desk.run(&[&same[..], &screen].concat());
    assert!(text(&refused.stderr).contains("two files would be written here"));
}

#[test]
fn nothing_that_a_keyer_reads_is_written_over() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("shot")).expect("a folder");
    for frame in ["shot/0.exr", "shot/1.exr"] {
        write_green_ramp(&desk.path(frame), 0.5);
    }
    let before = desk.content();
    let refused = |line: &str| {
        let key = format!("matte key {line} --screen 0.02,0.6,0.05");
        desk.refused(&words(&key))
    };
    for line in [
        "shot/0.exr shot/1.exr -o shot",
        "shot/0.exr shot/1.exr -o keyed --matte ./shot",
        "shot/0.exr shot/1.exr -o keyed --edges shot/../shot",
        "shot/0.exr -o shot/0.exr",
        "shot/0.exr -o 0.exr --garbage shot/1.exr --matte shot/1.exr",
    ] {
        let told = refused(line);
        assert!(
            told.contains("is an input and would be overwritten"),
            "{told}"
        );
    }
    let told = refused("shot/0.exr -o 0.exr --matte ./0.exr");
    assert!(told.contains("two files would be written here"), "{told}");
    assert!(desk.content() == before && !desk.path("keyed").exists());
}

#[test]
fn no_command_writes_over_what_it_reads() {
    let desk = Desk::new();
    write_slab(&desk.path("a.png"));
    desk.write("a.label.json", label(SQUARE));
    desk.write("set/data.yaml", "train: .\nval: .\nnames: [cap]\n");
    let lists = "train: ../b/train.txt\nval: ../b/val.txt\nnames: [cap]\n";
    desk.write("a/data.yaml", lists);
    desk.write("b/train.txt", "1.png\n2.png\n");
    desk.write("b/val.txt", "3.png\n");
    desk.write("recipe.toml", "");
    desk.write("s.toml", "");
    write_unsplit_set(&desk, "c", 1, "[cap]");
    desk.write("c/images/train/000000.png", "");
    desk.write("c/dataset.json", "{}");
    let files = r#"[{"path":"images/train/000000.png","bytes":0,"crc32":0}]"#;
    let counts = r#""classes":[],"obstructed":0,"knotted":0,"retries":0"#;
    let line = format!(r#"{{"k":0,"part":"train",{counts},"files":{files}}}"#);
    desk.write("c/index.jsonl", line + "\n");
    for joined in [
        "c/annotations/instances_train.json",
        "c/webdataset/train-000000.tar",
    ] {
        desk.write(joined, "joined");
    }
    desk.write("photos/1.png", "");
    desk.write("photos/1.txt", "");
    desk.write("metrics.json", "{}");
    desk.write("res/factors.csv", "image,light\n");
    let before = desk.content();
    for line in [
        "matte cut a.png -o a.png",
        "matte color-spill a.png -o ./a.png",
        "matte film a.exr -o a.exr",
        "camera rectify a.png a.label.json -o a.png",
        "camera solve a.label.json -o a.label.json",
        "camera init a.png --size 1x1 --force -o a.png",
        "camera markers a.png --map a.label.json -o a.png",
        "camera export e.json --to opencv -o e.json",
        "diff a.png a.png -o a.png",
        "scene draw recipe.toml -o recipe.toml",
        "label s.toml -o s.toml",
        "render s.toml recipe.toml -o f.png --resolved recipe.toml",
        "render s.toml -o f.png --resolved ./s.toml",
        "settle s.toml -o s.toml",
        "settle s.toml -o rest.toml --options o.toml --trace o.toml",
        "dataset split set -o ./set",
        "dataset subset set --head 0.5 -o set",
        "dataset split a -o b",
        "dataset subset a --head 0.5 -o b",
        "dataset batches --real c --synthetic a -o c/data.yaml",
        "dataset batches --real c --synthetic a -o ./c/images/0.png",
        "dataset report c -o c/data.yaml",
        "dataset sheet c -o ./c/index.jsonl",
        "dataset sheet c -o c/images/train/000000.png",
        "dataset sheet c -o c/annotations/instances_train.json",
        "dataset report c -o c/webdataset/train-000000.tar",
        "dataset report a -o b/val.txt",
        "dataset report c --beside a -o b/val.txt",
        "dataset report c --beside photos -o photos/1.txt",
        "dataset fit --recipe recipe.toml -o recipe.toml",
        "dataset fit --recipe recipe.toml -o f.toml --page ./recipe.toml",
        "dataset fit c --recipe recipe.toml -o f.toml --page c/data.yaml",
        "dataset fit c --recipe recipe.toml -o c/images/0.png",
        "eval p.json metrics.json -o .",
        "eval p.json t.json --tags res/factors.csv -o res",
    ] {
        let told = desk.refused(&words(line));
        assert!(
            told.contains("is an input and would be overwritten"),
            "{told}"
        );
    }
    assert!(desk.content() == before);
}

#[test]
fn a_fit_finds_out_at_once_where_it_cannot_write() {
    let desk = Desk::new();
    desk.write("recipe.toml", "");
    let refused = |more: &str| {
        let line = format!("dataset fit --recipe recipe.toml {more}");
        desk.refused(&words(&line))
    };
    assert!(refused("-o none/f.toml").contains("no folder none"));
    assert!(refused("-o f.toml --page none/f.html").contains("no folder none"));
    assert!(refused("-o f.toml --page f.toml").contains("two files would be written here"));
}

#[test]
fn an_evaluation_takes_no_option_in_vain() {
    let desk = Desk::new();
    let picture = r#"{"id": 1, "file_name": "a.png"}"#;
    let truth = format!(r#"{{"images": [{picture}], "annotations": [], "categories": []}}"#);
    desk.write("truth.json", truth);
    desk.write("found.json", "[]");
    let eval =
        |more: &'static str| [&words("eval found.json truth.json")[..], &words(more)].concat();
    let told = desk.refused(&eval("--size 64x48"));
    assert!(
        told.contains("--size: given without a folder of YOLO labels"),
        "{told}"
    );
    let told = desk.refused(&eval("--images nowhere"));
    assert!(
        told.contains("nowhere: no such folder, expected the folder of the images"),
        "{told}"
    );
    let output = desk.run(&eval("--rounds 0"));
    let told = text(&output.stderr);
    assert!(
        output.status.success() && told.contains("truth.json: no object"),
        "{told}"
    );
}

#[test]
#[cfg(target_os = "linux")]
fn images_that_no_list_can_name_are_refused() {
    use std::os::unix::ffi::OsStrExt;
    let desk = Desk::new();
    write_unsplit_set(&desk, "set", 1, "[cap]");
    write_unsplit_set(&desk, "made", 1, "[cap]");
    let odd = std::ffi::OsStr::from_bytes(b"set/images/\xff.png");
    desk.write(Path::new(odd), "");
    for command in [
        "dataset batches --real set --synthetic made -o b.jsonl",
        "dataset subset set --head 1 -o half",
        "dataset train-kit --real set --synthetic made -o kit",
    ] {
        let told = desk.refused(&words(command));
        assert!(told.contains("a name that is not UTF-8"), "{told}");
    }
}

#[test]
fn no_picture_of_a_scene_goes_over_what_it_is_made_from() {
    let desk = Desk::new();
    demo(&desk);
    for name in ["bg0003.jpg", "bg0003.label.json"] {
        let file = std::fs::read(sample(&format!("backgrounds/{name}")));
        desk.write(format!("places/{name}"), file.expect("a sample"));
    }
    let draw = |scene| {
        let args = words("scene draw demo/recipe.toml --set backgrounds=\"../places\" -o");
        [&args[..], &[scene]].concat()
    };
    desk.ok(&draw("s.json"));
    let before = desk.content();
    for args in [
        words("render s.json -o places/bg0003.jpg"),
        words("render s.json -o f.png --preview places/bg0003.jpg"),
        words("render s.json -o f.png --resolved places/bg0003.label.json"),
        words("render s.json -o demo/assets/b0001/b0001_0.exr"),
        words("label s.json -o l.json --overlay places/bg0003.jpg"),
        words("label s.json -o demo/assets/assets.toml"),
        draw("places/bg0003.label.json"),
    ] {
        let told = desk.refused(&args);
        assert!(
            told.contains("is an input and would be overwritten"),
            "{told}"
        );
    }
    assert!(desk.content() == before);
}

#[test]
fn the_keyer_is_that_of_its_option_or_of_the_settings() {
    let desk = Desk::new();
    write_green_ramp(&desk.path("0.png"), 0.5);
    // A screen without a hue, which the robust keyer alone refuses.
    let keyed = |more: &[&str]| {
        let key = words("matte key 0.png -o a.exr --screen 0.5,0.5,0.5");
        desk.run(&[&key[..], more].concat())
    };
    let set = ["--set", "key.profile=robust"];
    assert!(keyed(&[]).status.success());
    for robust in [&set[..], &["--profile", "robust"]] {
        assert!(!keyed(robust).status.success(), "{robust:?}");
    }
    let refused = keyed(&[&set[..], &["--profile", "blender-3.4"]].concat());
    let expected = "--profile blender-3.4, but --set key.profile=robust";
    assert!(text(&refused.stderr).contains(expected));
}

#[test]
fn a_frame_that_cannot_be_keyed_does_not_stop_the_others() {
    let desk = Desk::new();
    write_green_ramp(&desk.path("0.png"), 0.5);
    desk.write("1.png", "no picture");
    let done = desk.run(&words(
        "matte key 0.png 1.png -o keyed --screen 0.02,0.6,0.05",
    ));
    assert!(!done.status.success() && desk.path("keyed/0.exr").exists());
    let said = text(&done.stderr);
    assert!(
        said.contains("1.png") && said.contains("1 of 2 files could not be used; the rest is done"),
        "{said}"
    );
    desk.write("0.png", "no picture");
    let all = ["matte", "key", "0.png", "1.png", "-o", "keyed"];
    let none = desk.run(&[&all[..], &["--screen", "0.02,0.6,0.05"]].concat());
    let said = text(&none.stderr);
    assert!(said.ends_with("2 of 2 files could not be used\n"), "{said}");
}

#[test]
fn keyed_frames_are_exr_whatever_they_were() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("shot")).expect("a folder");
    let frames = ["shot/0.jpg", "shot/1.png", "shot/2.tif", "shot/3.exr"];
    for frame in frames {
        write_green_ramp(&desk.path(frame), 0.5);
    }
    let more = words("-o cut --matte mattes --screen 0.02,0.6,0.05");
    desk.ok(&[&["matte", "key"][..], &frames, &more[..]].concat());
    for name in ["0.exr", "1.exr", "2.exr", "3.exr"] {
        for folder in ["cut", "mattes"] {
            assert!(desk.path(folder).join(name).exists(), "{folder}/{name}");
        }
    }
}

#[test]
fn one_frame_goes_into_a_folder_and_several_into_no_file() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("there")).expect("a folder");
    write_green_ramp(&desk.path("a.png"), 0.5);
    write_green_ramp(&desk.path("b.png"), 0.5);
    desk.ok(&words(
        "matte key a.png -o there --matte new/ --edges e.png --screen 0.02,0.6,0.05",
    ));
    for name in ["there/a.exr", "new/a.exr", "e.png"] {
        assert!(desk.path(name).is_file(), "{name}");
    }
    let told = desk.refused(&words(
        "matte key a.png b.png -o cut.exr --screen 0.02,0.6,0.05",
    ));
    let why = "cut.exr: the name of a picture, expected a folder for 2 frames";
    assert!(told.contains(why), "{told}");
}

#[test]
fn what_is_keyed_lies_where_its_exr_does_and_lost_pixels_are_told() {
    let desk = Desk::new();
    let canvas = io::Canvas {
        at: [-3, 7],
        pixel_aspect: 2.0,
        ..Default::default()
    };
    let placed = io::WriteOptions {
        canvas,
        ..Default::default()
    };
    let grey = Image::filled(24, 4, LinearRgb::grey(0.3));
    let photo = desk.path("a.exr");
    io::write_with(&photo, &grey, &placed).expect("a picture");
    let header = |name: &str| io::read_header(desk.path(name)).expect("an EXR");
    let key = words("matte key a.exr -o cut.exr --matte m.exr --screen 0.02,0.6,0.05");
    let warned = "24 x 4 stored pixels, those outside the display window are dropped";
    assert!(!text(&desk.run(&key).stderr).contains(warned));
    for name in ["cut.exr", "m.exr"] {
        assert_eq!(header(name).canvas, canvas, "{name}");
    }
    // The last column of the display window, 20, moves four to the left.
    let mut bytes = std::fs::read(&photo).expect("an EXR");
    let name = b"displayWindow\0box2i\0\x10\0\0\0";
    let found = bytes.windows(name.len()).position(|part| part == name);
    let last = found.expect("an attribute") + name.len() + 8;
    bytes[last..last + 4].copy_from_slice(&16_i32.to_le_bytes());
    std::fs::write(&photo, bytes).expect("a file");
    let told = text(&desk.run(&key).stderr);
    assert!(told.contains(warned), "{told}");
    let cut = header("cut.exr");
    assert_eq!((cut.width, cut.height), (20, 4));
    // So it is under any name.
    std::fs::rename(&photo, desk.path("a.sxr")).expect("a file");
    let key = words("matte key a.sxr -o other.exr --screen 0.02,0.6,0.05");
    let told = text(&desk.run(&key).stderr);
    assert!(told.contains(warned), "{told}");
    assert_eq!(header("other.exr").canvas, canvas);
}

#[test]
fn a_cut_out_keeps_its_place_in_the_photo_unless_it_is_reduced() {
    let desk = Desk::new();
    let canvas = io::Canvas {
        at: [-3, 7],
        ..Default::default()
    };
    let placed = io::WriteOptions {
        canvas,
        ..Default::default()
    };
    let photo = red_on_green(30..90, 25..55);
    io::write_with(desk.path("a.exr"), &photo, &placed).expect("a picture");
    desk.ok(&words("matte cut a.exr -o cut.exr"));
    let header = |name: &str| io::read_header(desk.path(name)).expect("an EXR");
    let cut = header("cut.exr");
    assert_eq!((cut.canvas, cut.width, cut.height), (canvas, 120, 80));
    assert!(cut.data_at[0] > 0 && cut.data_size[0] < 120, "{cut:?}");
    let shown = desk.read::<PremulRgba>("cut.exr");
    assert!(shown[(60, 40)].a > 0.9 && shown[(2, 2)].a == 0.0);
    assert!(shown[(85, 50)].a > 0.9 && shown[(95, 50)].a < 0.1);
    desk.write("small.toml", "longest_side = 40\n");
    desk.ok(&words("matte cut a.exr -o small.exr --options small.toml"));
    let small = header("small.exr");
    assert_eq!((small.canvas.at, small.width), ([0, 0], 40));
}

#[test]
fn a_frame_s_number_is_no_ending() {
    let desk = Desk::new();
    for number in ["1001", "1002"] {
        write_green_ramp(&desk.path("plate.png"), 0.5);
        let frame = desk.path(format!("plate.{number}"));
        std::fs::rename(desk.path("plate.png"), frame).expect("a file");
        let key = format!("matte key plate.{number} -o keyed/ --screen 0.02,0.6,0.05");
        desk.ok(&words(&key));
    }
    for name in ["plate.1001.exr", "plate.1002.exr"] {
        assert!(desk.path("keyed").join(name).is_file(), "{name}");
    }
}

#[test]
fn no_folder_is_made_for_frames_that_are_not_there() {
    let desk = Desk::new();
    for frames in ["0.png", "0.png 1.png"] {
        let key = format!("matte key {frames} -o keyed/ --screen 0.02,0.6,0.05");
        assert!(!desk.run(&words(&key)).status.success(), "{key}");
        assert!(!desk.path("keyed").exists(), "{key}");
    }
}

#[test]
fn keyers_refuse_settings_out_of_range() {
    let desk = Desk::new();
    write_green_ramp(&desk.path("a.png"), 0.5);
    let screen = ["chroma-key", "--screen", "0.02,0.6,0.05"];
    let clean = ["difference-key", "--clean", "a.png"];
    for (keyer, setting, expected) in [
        (
            &screen[..],
            "key.tolerance=30",
            "1 to 80 degrees, in radians",
        ),
        (&["channel-key"], "key.matte_channel=7", "0 to 2"),
        (&clean, "key.tolerance=-3", "0 to 1"),
        (&["color-spill"], "key.ratio=9", "0.5 to 1.5"),
    ] {
        let more = ["a.png", "-o", "cut.png", "--set", setting];
        let told = desk.refused(&[&["matte"], keyer, &more].concat());
        let expected = format!("{}, expected {expected}", setting.replace('=', ": "));
        assert!(told.contains(&expected), "{told}");
    }
}

#[test]
fn the_example_of_a_setting_is_one_that_each_keyer_takes() {
    let desk = Desk::new();
    write_green_ramp(&desk.path("a.png"), 0.5);
    let screen = ["chroma-key", "--screen", "0.02,0.6,0.05"];
    let clean = ["difference-key", "--clean", "a.png"];
    for keyer in [&screen[..], &clean, &["channel-key"], &["color-spill"]] {
        let help = desk.ok(&["matte", keyer[0], "--help"]);
        let (_, examples) = help.split_once("such as").expect("an example");
        let example = examples.split_whitespace().next().expect("a setting");
        let more = ["a.png", "-o", "cut.png", "--set", example];
        desk.ok(&[&["matte"], keyer, &more].concat());
    }
}

#[test]
fn a_keyer_asks_for_a_screen_in_linear_light_or_for_a_plate() {
    let desk = Desk::new();
    write_green_ramp(&desk.path("a.png"), 0.5);
    let key = ["matte", "key", "a.png", "-o", "cut.exr"];
    let told = text(&desk.run(&key).stderr);
    assert!(told.contains("--screen <R,G,B>|--plate <FILE>"), "{told}");
    let told = desk.refused(&[&key[..], &["--screen", "30,180,60"]].concat());
    assert!(told.contains("are these 8-bit codes?"), "{told}");
}

#[test]
fn lists_that_begin_with_a_minus_are_values() {
    let desk = Desk::new();
    write_green_ramp(&desk.path("a.png"), 0.5);
    let key = ["matte", "key", "a.png", "-o", "cut.exr"];
    let told = desk.refused(&[&key[..], &["--screen", "--plate", "a.png"]].concat());
    let missing = "'--plate' for '--screen <R,G,B>': \"--plate\", expected R,G,B as in";
    assert!(told.contains(missing), "{told}");
    let screen = ["matte", "keying-screen", "a.png", "-o", "plate.exr"];
    let told = desk.refused(&[&screen[..], &["--point", "-1,2"]].concat());
    assert!(told.contains("\"-1,2\", expected X,Y"), "{told}");
    desk.ok(&[&key[..], &["--screen", "-0.2,0.4,-0.1"]].concat());
    let add = "asset add none.png --class a --length 0.2 -o assets";
    let told = desk.refused(&words(&format!("{add} --screen -0.2,0.4,-0.1")));
    assert!(told.contains("none.png"), "{told}");
}

#[test]
fn a_point_where_the_picture_is_not_finite_is_refused() {
    let desk = Desk::new();
    let mut photo = Image::filled(8, 8, LinearRgb::new(0.25, 0.5, 0.125));
    photo[(5, 5)].r = f32::NAN;
    desk.write_picture("a.exr", &photo);
    let told = desk.refused(&words(
        "matte keying-screen a.exr -o plate.exr --point 2,2 --point 5,5",
    ));
    let expected = "--point 5,5: the picture is [NaN, 0.5, 0.125] there, expected finite numbers";
    assert!(told.contains(expected), "{told}");
}

#[test]
fn photos_of_different_size_are_refused() {
    let desk = Desk::new();
    for (name, w, h) in [("a.png", 48, 36), ("b.png", 36, 48)] {
        let screen = LinearRgb::new(0.02, 0.6, 0.05);
        desk.write_picture(name, &Image::filled(w, h, screen));
    }
    let told = desk.refused(&["matte", "triangulate", "a.png", "b.png", "-o", "film.exr"]);
    assert!(
        told.contains("b.png: 36 x 48 pixels, expected 48 x 36 as a.png"),
        "{told}"
    );
    let key = ["matte", "key", "a.png", "-o", "cut.exr", "--auto-mattes"];
    let told = desk.refused(&[&key[..], &["--plate", "b.png"]].concat());
    assert!(
        told.contains("--plate: 36 x 48 pixels, expected 48 x 36 as a.png"),
        "{told}"
    );
}

#[test]
fn film_is_written_into_files_called_exr_alone() {
    let desk = Desk::new();
    for args in [&["film", "a.png"][..], &["triangulate", "a.png", "b.png"]] {
        let told = desk.refused(&[&["matte"], args, &["-o", "film.png"]].concat());
        assert!(
            told.contains("film.png: film needs the extension .exr"),
            "{told}"
        );
    }
}

#[test]
fn a_mask_that_is_no_coverage_is_named() {
    let desk = Desk::new();
    let photos = ["a.exr", "b.exr"];
    let green = Image::filled(32, 32, LinearRgb::new(0.1, 0.6, 0.15));
    let beyond = Image::from_fn(32, 32, |x, y| {
        let is_inside = (12..20).contains(&x) && (12..20).contains(&y);
        LinearRgb::grey(if is_inside { 1.5 } else { 0.0 })
    });
    for (name, picture) in [("a.exr", &green), ("b.exr", &green), ("mask.exr", &beyond)] {
        desk.write_picture(name, picture);
    }
    for (way, count) in [("film", 1), ("triangulate", 2)] {
        let plates = ["--plate", "a.exr", "--plate", "b.exr"];
        let more = ["--mask", "mask.exr", "-o", "film.exr"];
        let told = desk.refused(
            &[
                &["matte", way],
                &photos[..count],
                &plates[..2 * count],
                &more,
            ]
            .concat(),
        );
        assert!(
            told.contains("mask.exr: 1.5, expected 0 to 1"),
            "{way}: {told}"
        );
        assert!(!told.contains("a.exr"), "{way}: {told}");
    }
}

#[test]
fn every_photo_of_a_film_has_a_plate_or_none() {
    let desk = Desk::new();
    let plate = ["-o", "film.exr", "--plate", "p.png"];
    let two = [&["matte", "triangulate", "a.png", "b.png"], &plate[..]].concat();
    let told = desk.refused(&two);
    assert!(told.contains("--plate: 1 given, expected 2"), "{told}");
    let more = ["--plate", "q.png"];
    let told = desk.refused(&[&["matte", "film", "a.png"], &plate[..], &more].concat());
    assert!(told.contains("--plate: 2 given, expected 1"), "{told}");
}

#[test]
fn each_way_to_film_has_an_example_of_its_own_options() {
    let desk = Desk::new();
    let help = |way| desk.ok(&["matte", way, "--help"]);
    assert!(help("film").contains("film.clipped=0.9"));
    assert!(help("triangulate").contains("film.max_sigma=0.1"));
}

#[test]
fn an_object_of_the_hue_of_the_screen_is_warned_of_once_and_a_spot_is_not() {
    let desk = Desk::new();
    for (photo, columns, warnings) in [("half.png", 80..160, 1), ("spot.png", 100..124, 0)] {
        let slab = Image::from_fn(240, 160, |x, y| {
            if columns.contains(&x) && (60..100).contains(&y) {
                LinearRgb::new(0.25, 0.8, 0.3)
            } else if (60..180).contains(&x) && (50..110).contains(&y) {
                RED
            } else {
                GREEN
            }
        });
        desk.write_picture(photo, &slab);
        let add = ["asset", "add", photo, "--class", "can", "--length", "0.2"];
        let done = desk.run(&[&add[..], &["-o", "assets"]].concat());
        let said = text(&done.stderr);
        assert!(done.status.success(), "{said}");
        assert_eq!(said.matches("the screen's hue").count(), warnings, "{said}");
    }
}

const RED: LinearRgb = LinearRgb::new(0.6, 0.05, 0.05);
const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

/// A red slab on a green screen.
fn red_on_green(columns: Range<usize>, rows: Range<usize>) -> Image<LinearRgb> {
    let is_slab = |x: usize, y: usize| columns.contains(&x) && rows.contains(&y);
    Image::from_fn(120, 80, |x, y| if is_slab(x, y) { RED } else { GREEN })
}

/// A red slab in the middle of a green screen.
fn write_slab(path: &Path) {
    std::fs::create_dir_all(path.parent().expect("inside the desk")).expect("a folder");
    io::write(path, &red_on_green(30..90, 25..55)).expect("a picture");
}

#[test]
fn every_step_of_a_search_is_a_picture() {
    let desk = Desk::new();
    write_slab(&desk.path("slab.png"));
    let done = desk.run(&["matte", "segment", "slab.png", "-o", "steps", "-v"]);
    let told = text(&done.stderr);
    assert!(
        told.contains("slab.png: segmented at level 3 of the Laplacian pyramid"),
        "{told}"
    );
    let step = |name: &str| {
        let mut files = desk.files().into_iter();
        let found = files.find(|file| file.to_string_lossy().ends_with(name));
        found.expect("a step")
    };
    let read = |name: &str| io::read::<Coverage>(step(name)).expect("a picture");
    let (middle, corner) = ((60, 40), (5, 5));
    for (name, inside) in [
        ("_hull.png", 1.0),
        ("_outline.png", 1.0),
        ("_garbage.png", 0.0),
    ] {
        let step = read(name);
        assert_eq!(step.size(), (120, 80), "{name}");
        assert_eq!(step[middle].0, inside, "{name}");
        assert_eq!(step[corner].0, 1.0 - inside, "{name}");
    }
    assert_eq!(read("_core.png")[corner].0, 0.0);
    let hull = step("_hull.png");
    write_slab(&hull);
    let photo = hull.to_str().expect("letters");
    let told = desk.refused(&["matte", "segment", photo, "-o", "steps"]);
    assert!(
        told.contains("is an input and would be overwritten"),
        "{told}"
    );
}

/// Folded film that mirrors light, in an ellipse: what it reflects, and what it lets through.
fn film_at(x: usize, y: usize) -> Option<(LinearRgb, LinearRgb)> {
    let (x, y) = (x as f64, y as f64);
    let (u, v) = ((x - 80.0) / 60.0, (y - 50.0) / 35.0);
    let fold = (0.75 + 0.2 * (0.23 * x + 0.011 * y * y).sin()) as f32;
    let glint = (0.12 * (0.17 * x - 0.29 * y).sin().powi(8)) as f32;
    let reflected = LinearRgb::new(0.03, 0.05, 0.07).map(|light| light + glint);
    let passed = LinearRgb::new(0.25, 0.45, 0.6).scale(fold);
    (u * u + v * v < 1.0).then_some((reflected, passed))
}

#[test]
fn film_on_three_screens_is_what_it_was_made_from() {
    let desk = Desk::new();
    let size = (160, 100);
    let mask = Image::from_fn(size.0, size.1, |x, y| {
        Coverage(f32::from(film_at(x, y).is_some()))
    });
    desk.write_picture("mask.png", &mask);
    for (name, screen) in [
        ("a.exr", [0.045, 0.42, 0.085]),
        ("b.exr", [0.03, 0.095, 0.52]),
        ("c.exr", [0.5, 0.04, 0.05]),
    ] {
        let screen = LinearRgb::from(screen);
        let photo = Image::from_fn(size.0, size.1, |x, y| match film_at(x, y) {
            Some((reflected, passed)) => reflected + passed * screen,
            None => screen,
        });
        desk.write_picture(name, &photo);
    }
    desk.ok(&words(
        "matte triangulate a.exr b.exr c.exr --mask mask.png -o film.exr --plate-out plate.exr",
    ));
    let film = desk.read::<PremulRgba>("film.exr");
    let (mut error, mut count) = (0.0, 0.0);
    for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
        match film_at(x, y) {
            Some((reflected, _)) => {
                error += (film[(x, y)].g - reflected.g).abs();
                count += 1.0;
            }
            None => assert_eq!(film[(x, y)].a, 0.0, "{x} {y}"),
        }
    }
    // Half floats in the photos; exact but for these.
    assert!(error / count < 2e-3, "{}", error / count);
    let plate = desk.read::<LinearRgb>("plate.exr");
    assert!((plate[(80, 50)].g - 0.42).abs() < 2e-3);
}

#[test]
fn a_difference_key_goes_by_the_mean_difference_of_the_channels() {
    let desk = Desk::new();
    let lights = [0.25, 0.375, 1.0].map(LinearRgb::grey);
    desk.write_picture("clean.exr", &Image::filled(3, 1, lights[0]));
    desk.write_picture("photo.exr", &Image::from_fn(3, 1, |x, _| lights[x]));
    desk.ok(&words(
        "matte difference-key photo.exr --clean clean.exr -o cut.exr --matte matte.exr \
         --set key.tolerance=0.0625 --set key.falloff=0.25",
    ));
    let matte = desk.read::<Coverage>("matte.exr");
    let cut = desk.read::<PremulRgba>("cut.exr");
    // (0.125 - 0.0625) / 0.25 in the middle.
    for (x, share, light) in [(0, 0.0, 0.25), (1, 0.25, 0.375), (2, 1.0, 1.0)] {
        assert_eq!(matte[(x, 0)].0, share);
        assert_eq!((cut[(x, 0)].r, cut[(x, 0)].a), (share * light, share));
    }
}

#[test]
fn color_spill_limits_green_by_red_and_has_no_matte() {
    let desk = Desk::new();
    let photo = Image::from_fn(2, 1, |x, _| LinearRgb::new(0.25, [0.125, 0.75][x], 0.5));
    desk.write_picture("photo.exr", &photo);
    let spill = ["matte", "color-spill", "photo.exr", "-o", "clean.exr"];
    desk.ok(&spill);
    let clean = desk.read::<PremulRgba>("clean.exr");
    for (x, green) in [(0, 0.125), (1, 0.25)] {
        let p = clean[(x, 0)];
        assert_eq!([p.r, p.g, p.b, p.a], [0.25, green, 0.5, 1.0]);
    }
    let told = desk.refused(&[&spill[..], &["--matte", "matte.exr"]].concat());
    assert!(told.contains("unexpected argument '--matte'"), "{told}");
}

#[test]
fn diff_speaks_like_idiff() {
    let desk = Desk::new();
    let (a, b) = (sample("bottles/b0000_0.png"), sample("bottles/b0001_0.png"));
    for (args, code) in [
        (&["diff", &a, &a][..], 0),
        (&["diff", &a, &b], 3),
        (&["diff", "-fail", "0.1", &a, "nowhere.png"], 4),
        (&["-j", "1", "diff", "-fail", "0.1", &a, &a], 0),
    ] {
        assert_eq!(desk.run(args).status.code(), Some(code), "{args:?}");
    }
    for limit in ["--fail", "-warn", "--hardfail", "-failrelative"] {
        let refused = desk.refused(&["diff", limit, "nan", &a, &b]);
        assert!(
            refused.contains("expected a number from 0"),
            "{limit}: {refused}"
        );
    }
    for scale in ["nan", "inf", "0"] {
        let refused = desk.refused(&["diff", "--scale", scale, &a, &b]);
        assert!(
            refused.contains("expected a finite number above 0"),
            "{scale}: {refused}"
        );
    }
}

#[test]
fn diff_compares_floats_as_they_are() {
    use tiff::encoder::{TiffEncoder, colortype::RGB32Float};
    let desk = Desk::new();
    for (name, value) in [("a.tif", 2.0), ("b.tif", 3.0)] {
        let file = std::fs::File::create(desk.path(name)).expect("a file");
        let mut encoder = TiffEncoder::new(file).expect("a TIFF");
        let written = encoder.write_image::<RGB32Float>(1, 1, &[value; 3]);
        written.expect("a picture");
    }
    let told = text(&desk.run(&["diff", "a.tif", "b.tif"]).stdout);
    assert!(told.contains("Max error  = 1 "), "{told}");
}

#[test]
fn diff_compares_codes_as_they_are_whatever_the_profile() {
    let desk = Desk::new();
    for (name, code) in [("a.png", 100), ("b.png", 101)] {
        let file = std::fs::File::create(desk.path(name)).expect("a file");
        let mut encoder = png::Encoder::new(file, 1, 1);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_source_gamma(png::ScaledFloat::from_scaled(100_000));
        let mut writer = encoder.write_header().expect("a PNG");
        writer.write_image_data(&[code]).expect("a picture");
    }
    let told = text(&desk.run(&["diff", "a.png", "b.png"]).stdout);
    assert!(told.contains("Max error  = 0.00392"), "{told}");
}

#[test]
fn a_written_difference_shows_one_of_alpha_alone() {
    let desk = Desk::new();
    for (name, alpha) in [("a.exr", 0.25), ("b.exr", 0.5)] {
        let clear = PremulRgba::new(0.0, 0.0, 0.125, alpha);
        desk.write_picture(name, &Image::filled(1, 1, clear));
    }
    let output = desk.run(&words("diff a.exr b.exr --scale 2 -o difference.exr"));
    assert_eq!(output.status.code(), Some(2));
    let written = desk.read::<LinearRgb>("difference.exr");
    assert_eq!(written[(0, 0)], LinearRgb::grey(0.5));
}

#[test]
fn diff_tells_channels_that_it_passes_over() {
    let desk = Desk::new();
    let write = |name: &str, channels: &[&str]| {
        let channels: Vec<_> = channels.iter().map(|&c| (c, vec![0.5; 4])).collect();
        let canvas = io::Canvas::default();
        io::exr::write_channels(desk.path(name), (2, 2), canvas, channels, &[]).expect("an EXR");
    };
    write("colours.exr", &["R", "G", "B"]);
    write("depth.exr", &["R", "G", "B", "Z"]);
    let output = desk.run(&["diff", "colours.exr", "depth.exr"]);
    assert_eq!(output.status.code(), Some(3));
    let told = text(&output.stdout);
    assert!(told.contains("differ in their channels"), "{told}");
    let told = desk.ok(&["diff", "depth.exr", "depth.exr"]);
    assert!(told.contains("none of 1 other channels (Z)"), "{told}");
}

#[test]
fn diff_tells_which_of_several_parts_it_compares() {
    let desk = Desk::new();
    let part = |name: &str, channels: &[&str]| Part {
        name: name.into(),
        channels: channels
            .iter()
            .map(|c| (c.to_string(), ChannelSamples::Float(vec![0.5; 4])))
            .collect(),
        metadata: Vec::new(),
    };
    let parts = [part("beauty", &["R", "G", "B"]), part("depth", &["Z"])];
    let [beauty, depth] = parts.clone();
    let turned = [depth, beauty];
    for (name, parts) in [("a.exr", parts), ("b.exr", turned)] {
        io::exr::write_parts(desk.path(name), (2, 2), &parts).expect("an EXR");
    }
    let told = desk.ok(&["diff", "a.exr", "b.exr"]);
    for name in ["a.exr", "b.exr"] {
        let line = format!("{name}: of 2 parts only \"beauty\" was compared, not depth");
        assert!(told.contains(&line), "{told}");
    }
}

#[test]
fn the_demo_goes_by_the_recipe_that_is_there() {
    let desk = Desk::new();
    desk.write("demo/recipe.toml", "[scene]\nobjcts = 3\n");
    let error = desk.refused(&["demo", "--samples", SAMPLES]);
    assert!(error.contains("scene: unknown key \"objcts\""), "{error}");
    assert_eq!(desk.text("demo/recipe.toml"), "[scene]\nobjcts = 3\n");
}

#[test]
fn the_demo_makes_the_same_files_at_any_thread_count() {
    let desk = Desk::new();
    let demo = |threads: &str, folder: &str| {
        demo_into(&desk, folder, &format!("-n 4 --seed 0 -j {threads}"));
        let root = desk.path(folder);
        let mut files = Vec::new();
        walk(&root, &mut files);
        // How long the run took, and when its inputs were written, are not part of the dataset.
        files.retain(|f| !f.ends_with(".runs.jsonl") && !f.ends_with(".inputs.json"));
        files.sort();
        let named = |f: &PathBuf| f.strip_prefix(&root).expect("below the root").to_owned();
        files
            .iter()
            .map(|f| (named(f), std::fs::read(f).expect("a file")))
            .collect::<Vec<_>>()
    };
    let (one, four) = (demo("1", "one"), demo("4", "four"));
    assert!(one.len() > 20, "the demo wrote only {} files", one.len());
    for ((name, a), (other, b)) in one.iter().zip(&four) {
        assert_eq!(name, other);
        assert!(a == b, "{} depends on the thread count", name.display());
    }
    desk.ok(&["dataset", "check", "one/dataset"]);
    compare_with_pin(&pin(&desk.path("one")));
}

/// Set, the pin is written instead of compared: where bytes change on purpose.
const UPDATE: &str = "PETCOMP_UPDATE_PIN";

/// Checksums of the samples of cut-outs and pictures, whose compression is not ours, and of labels.
fn pin(root: &Path) -> String {
    let mut files = Vec::new();
    for folder in ["assets", "dataset/images", "dataset/labels"] {
        walk(&root.join(folder), &mut files);
    }
    files.sort();
    let rows = files.iter().filter_map(|file| {
        let crc = crc32fast::hash(&content(file)?);
        let name = file.strip_prefix(root).expect("below the root");
        Some(format!("{crc:08x}  {}\n", name.display()))
    });
    rows.collect()
}

fn content(file: &Path) -> Option<Vec<u8>> {
    match file.extension()?.to_str()? {
        "exr" => {
            let (_, channels) = io::exr::read_channels(file).unwrap();
            let samples = channels.iter().flat_map(|channel| &channel.samples);
            Some(samples.flat_map(|v| v.to_le_bytes()).collect())
        }
        "png" if file.components().any(|c| c.as_os_str() == "images") => {
            let picture = io::read::<LinearRgb>(file).unwrap();
            Some(bytemuck::cast_slice(picture.pixels()).to_vec())
        }
        "txt" => std::fs::read(file).ok(),
        _ => None,
    }
}

fn compare_with_pin(found: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/demo.crc32");
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(&path, found).unwrap();
    }
    let pinned = std::fs::read_to_string(&path).unwrap();
    assert_eq!(
        pinned, found,
        "set {UPDATE}=1 to write it, and say why in CHANGELOG.md"
    );
}

#[cfg(unix)]
#[test]
fn files_that_are_written_behind_a_link_name_their_inputs() {
    let desk = Desk::new();
    std::fs::create_dir_all(desk.path("real/a/b")).expect("a folder");
    std::os::unix::fs::symlink("real/a/b", desk.path("link")).expect("a link");
    demo_into(&desk, "link/demo", "-n 1");
    desk.ok(&words(
        "scene draw link/demo/recipe.toml -k 3 --seed 5 -o scene.toml",
    ));
    desk.ok(&words("settle scene.toml -o link/rest.toml"));
    desk.ok(&words("render link/rest.toml -o frame.exr"));
}

#[test]
fn a_scene_goes_through_the_stages_one_by_one() {
    let desk = Desk::new();
    demo(&desk);
    desk.ok(&words(
        "scene draw demo/recipe.toml -k 3 --seed 5 -o scene.toml",
    ));
    desk.ok(&["scene", "check", "scene.toml"]);
    desk.ok(&words(
        "settle scene.toml -o rest.json --trace fall.csv --preview rest.png",
    ));
    assert!(desk.text("fall.csv").starts_with("seconds,object,x,y,z,"));
    assert!(desk.path("rest.png").exists());
    desk.ok(&["render", "rest.json", "demo/recipe.toml", "-o", "frame.exr"]);
    desk.ok(&words("render scene.toml demo/recipe.toml -o again.exr"));
    desk.ok(&["diff", "frame.exr", "again.exr"]);
    desk.ok(&words(
        "label rest.json demo/recipe.toml -o labels.json --overlay overlay.png",
    ));
    assert!(desk.path("overlay.png").exists());

    // Borders of the masks, with every corner and with fewer.
    let corners = |tolerance: &str| -> usize {
        let set = format!("labels.simplify={tolerance}");
        let args = words("label rest.json demo/recipe.toml -o again.json --polygons borders.json");
        desk.ok(&[&args[..], &["--set", &set]].concat());
        let borders: Vec<petcomp::label::Border> =
            io::read_json(desk.path("borders.json")).unwrap();
        let rings = borders.iter().flat_map(|border| &border.amodal);
        rings.map(Vec::len).sum()
    };
    let [all, few] = ["0", "2"].map(corners);
    assert!(few >= 3 && all > 4 * few, "{all} {few}");
    let refused = desk.refused(&words(
        "label rest.json demo/recipe.toml -o no.json --set labels.simplify=-1",
    ));
    assert!(
        refused.contains("labels.simplify: -1, expected 0 to 1000 (pixels)"),
        "{refused}"
    );

    // A JPEG is compressed as the recipe says.
    let length = |set: &str| -> u64 {
        let args = words("render rest.json demo/recipe.toml -o frame.jpg");
        desk.ok(&[&args[..], &["--set", set]].concat());
        desk.path("frame.jpg").metadata().unwrap().len()
    };
    let [plain, poor] = ["95", "5"].map(|q| length(&format!("pictures.jpeg_quality={q}")));
    assert!(4 * poor < plain, "{poor} {plain}");

    // The same picture in parts, at another quality, and for Blender.
    let parts = "render rest.json demo/recipe.toml -o parts.exr --quality draft --aov";
    desk.ok(&words(&format!(
        "{parts} beauty,id,depth,cryptomatte,layers --preview look.png"
    )));
    assert!(desk.path("look.png").exists());
    let told = text(&desk.run(&["diff", "frame.exr", "parts.exr"]).stdout);
    assert!(
        told.contains("SSIM = 0.9") && told.contains("FLIP = 0.0"),
        "{told}"
    );
    let told = text(&desk.run(&words(&format!("{parts} normals"))).stderr);
    assert!(told.contains("expected one of beauty"), "{told}");
    desk.ok(&words(
        "scene export rest.json demo/recipe.toml --to cycles blender",
    ));
    for file in [
        "scene.json",
        "plate.exr",
        "card_1.exr",
        "scene_reference.py",
    ] {
        assert!(desk.path("blender").join(file).exists(), "{file}");
    }
}

#[test]
fn objects_need_be_large_enough_in_the_whole_picture_alone() {
    let desk = Desk::new();
    demo(&desk);
    // The median object is 12 px long, in the preview 6.
    let small = words("dataset generate demo/recipe.toml -o look --set scene.scale=0.08");
    desk.ok(&[&small[..], &["--preview", "1"]].concat());
    assert!(desk.path("look/sheet.png").exists());
    let half = ["-n", "1", "--set", "scene.image=[320,240]"];
    let told = desk.refused(&[&small[..], &half].concat());
    assert!(told.contains("expected at least 8"), "{told}");
    assert!(told.contains("scene.image"), "{told}");
}

#[test]
fn an_environment_map_lies_beside_its_recipe() {
    let desk = Desk::new();
    demo(&desk);
    let sky = Image::filled(8, 4, LinearRgb::new(0.2, 0.4, 0.9));
    desk.write_picture("demo/sky.exr", &sky);
    let set = "--set scene.environment.files=[\"sky.exr\"]";
    let generate = format!("dataset generate demo/recipe.toml -o out {set} -n");
    desk.ok(&words(&format!("{generate} 1")));
    // Its content decides the pictures, so another one is another dataset.
    desk.write_picture("demo/sky.exr", &sky.map(|p| p.scale(2.0)));
    let told = text(&desk.run(&words(&format!("{generate} 2"))).stderr);
    assert!(
        told.contains(
            "out/dataset.json: recipe.environments[sky.exr].content: the dataset was started with"
        ),
        "{told}"
    );
    // A scene file names it as the recipe does, and no file of elsewhere.
    let draw = format!("scene draw demo/recipe.toml -o scene.toml {set}");
    desk.ok(&words(&draw));
    let told = desk.refused(&words(&format!("{draw} --set scene.distractors=2")));
    assert!(told.contains("scene.distractors: 2 requested"), "{told}");
    let render = "render scene.toml demo/recipe.toml -o frame.png";
    desk.ok(&words(&format!("{render} {set}")));
    desk.ok(&words(render));
    let scene = desk.text("scene.toml").replace("sky.exr", "../sky.exr");
    desk.write("scene.toml", scene);
    let refused = desk.refused(&words(render));
    assert!(
        refused.contains(
            "scene.toml: environment.file: \"../sky.exr\", expected one that the recipe lists"
        ),
        "{refused}"
    );
}

/// A label that no camera fits: one corner lies inside the triangle of the others.
const DENTED_LABEL: &str = r#"{
  "format": "plane-label", "version": 1,
  "image": { "file": "other.jpg", "width": 1280, "height": 960 },
  "surface": {
    "id": "tray", "width_m": 0.56, "height_m": 0.37,
    "corners_px": [[235.8, 239.2], [1019.7, 215.7], [500.0, 400.0], [275.6, 738.8]]
  }
}"#;

#[test]
fn a_scene_is_rendered_without_its_recipe() {
    let desk = Desk::new();
    demo(&desk);
    let sky = Image::filled(8, 4, LinearRgb::new(0.2, 0.4, 0.9));
    desk.write_picture("demo/sky.exr", &sky);
    std::fs::create_dir_all(desk.path("far/off")).unwrap();
    let set = words(
        "--set scene.environment.files=[\"sky.exr\"] --set render.subsamples=3 \
         --set scene.settle.max_overlap=0.002",
    );
    let with_set = |args: &[&str]| desk.ok(&[args, &set].concat());
    let scene = "far/off/scene.toml";
    with_set(&["scene", "draw", "demo/recipe.toml", "-k", "2", "-o", scene]);
    with_set(&["render", scene, "demo/recipe.toml", "-o", "recipe.png"]);
    with_set(&["label", scene, "demo/recipe.toml", "-o", "recipe.json"]);

    for line in [
        "render far/off/scene.toml -o alone.png --resolved resolved.json",
        "label far/off/scene.toml -o alone.json",
        "settle far/off/scene.toml -o rest.json",
        "render rest.json -o rest.png",
        "render resolved.json -o resolved.png",
    ] {
        desk.ok(&words(line));
    }
    for name in ["alone.png", "rest.png", "resolved.png"] {
        assert!(
            desk.bytes(name) == desk.bytes("recipe.png"),
            "{name} differs"
        );
    }
    assert!(desk.bytes("alone.json") == desk.bytes("recipe.json"));

    // What a mask beside the photo hides is hidden in labels, with a picture of them and without.
    let petcomp::Scene { plate, .. } = io::read_document(desk.path(scene)).unwrap();
    let front = Image::from_fn(1280, 960, |x, _| Coverage(f32::from(x < 640)));
    desk.write_picture(&format!("places/{plate}.front.png"), &front);
    for end in ["jpg", "label.json"] {
        let name = format!("{plate}.{end}");
        let place = sample(&format!("backgrounds/{name}"));
        std::fs::copy(place, desk.path("places").join(name)).unwrap();
    }
    // Nor does it matter what is wrong with the label of another photo, but where all are opened.
    desk.write("places/other.label.json", DENTED_LABEL);
    let places = ["--set", "backgrounds=\"../places\""];
    let all = ["scene", "draw", "demo/recipe.toml", "-o", "no.toml"];
    let refused = desk.refused(&[&all[..], &places].concat());
    assert!(refused.contains("other.label.json: "), "{refused}");
    desk.write("places/broken.label.json", "no JSON");
    let hidden = |args: &[&str]| {
        with_set(&[&["label", scene, "demo/recipe.toml"], args, &places].concat());
    };
    hidden(&["-o", "hidden.json"]);
    hidden(&["-o", "shown.json", "--overlay", "hidden.png"]);
    let over_places = ["render", scene, "demo/recipe.toml", "-o", "hidden.exr"];
    with_set(&[&over_places[..], &places].concat());
    let boxes = |name: &str| -> Vec<_> {
        let labels: petcomp::label::Labels = io::read_json(desk.path(name)).unwrap();
        let objects = labels.objects.iter();
        objects.map(|object| object.visible_box).collect()
    };
    assert_eq!(boxes("hidden.json"), boxes("shown.json"));
    assert_ne!(boxes("hidden.json"), boxes("recipe.json"));

    // What is missing is named.
    let text = desk.text(scene);
    let bare = text.split("[files]").next().unwrap();
    desk.write("far/off/bare.toml", bare);
    let refused = desk.refused(&["render", "far/off/bare.toml", "-o", "no.png"]);
    assert!(
        refused
            .contains("far/off/bare.toml: files: missing, expected a table that names the folders"),
        "{refused}"
    );
}

#[test]
fn a_scene_has_its_own_size_whatever_the_recipe_says() {
    let desk = Desk::new();
    demo(&desk);
    desk.ok(&words(
        "scene draw demo/recipe.toml --set scene.image=[160,120] -o s.toml",
    ));
    desk.ok(&words("render s.toml -o alone.png"));
    desk.ok(&words("render s.toml demo/recipe.toml -o recipe.png"));
    assert!(desk.bytes("alone.png") == desk.bytes("recipe.png"));
    for recipe in ["", " demo/recipe.toml"] {
        let set = format!("render s.toml{recipe} -o no.exr --set scene.gain_ev=5");
        let told = desk.refused(&words(&set));
        assert!(
            told.contains("scene.gain_ev: decides how scenes are drawn"),
            "{told}"
        );
    }
}

#[test]
fn what_cannot_be_written_is_told_before_anything_is() {
    let desk = Desk::new();
    for line in [
        "render s.toml -o a.exr --preview b.txt",
        "render s.toml -o a.exr --preview no/b.png",
        "render s.toml -o a.exr --resolved b.txt",
        "label s.toml -o a.json --overlay b.abc",
        "label s.toml -o a.json --polygons no/b.json",
        "settle s.toml -o a.toml --preview b.abc",
        "settle s.toml -o a.toml --trace no/b.csv",
    ] {
        let told = desk.refused(&words(line));
        assert!(
            told.contains("b.") && told.contains("expected .") || told.contains("no folder no"),
            "{line}: {told}"
        );
    }
}

#[test]
fn a_summary_tells_what_is_there_and_is_a_result() {
    let desk = Desk::new();
    demo(&desk);
    let made = |folder: &str, set: &str| {
        let few = format!("-n 3 --seed 2 --set scene.objects=6 --set {set}");
        generate_small(&desk, folder, &few)
    };
    let told = made("keep", "labels.obstructed=\"keep\"");
    assert!(
        told.contains("objects      18, 18 labelled, ") && !told.contains(" 0 obstructed"),
        "{told}"
    );
    assert!(
        told.contains(" obstructed (labelled like the others)\n")
            && told.ends_with("keep/data.yaml\n"),
        "{told}"
    );
    let told = made("drop", "labels.obstructed=\"drop\"");
    assert!(told.contains(" obstructed (without a label)\n"), "{told}");
    let told = made("coco", "labels.formats=[\"coco\"]");
    let places: Vec<&str> = told
        .lines()
        .filter(|line| line.starts_with("coco/"))
        .collect();
    assert_eq!(
        places,
        [
            "coco/annotations/instances_train.json",
            "coco/annotations/instances_val.json"
        ]
    );
    assert!(places.iter().all(|place| desk.path(place).is_file()));
}

/// Makes small pictures of the demo's recipe with more options.
fn generate_small(desk: &Desk, folder: &str, more: &str) -> String {
    let small = "-q dataset generate demo/recipe.toml --set scene.image=[160,120]";
    desk.ok(&words(&format!("{small} -o {folder} {more}")))
}

#[test]
fn a_report_tells_chances_by_their_shares_and_what_does_not_vary() {
    let desk = Desk::new();
    demo(&desk);
    let chances = "--set scene.start.face_down=0.3 --set scene.negatives=0.2";
    let more = format!("-n 5 --set scene.objects=4 {chances}");
    generate_small(&desk, "out", &more);
    desk.ok(&["dataset", "report", "out"]);
    let page = desk.text("out/report.html");
    for row in [
        "<td>start.face_down</td><td>0.3</td><td>0.",
        "<td>negative</td><td>0.2</td><td>0.",
        "<td>interreflection</td><td>0</td>",
    ] {
        assert!(page.contains(row), "{row}");
    }
    for title in ["start.face_down", "negative", "interreflection"] {
        assert!(!page.contains(&format!(">{title}<title>")), "{title}");
    }
}

#[test]
fn one_light_gives_the_same_picture_at_any_power() {
    let desk = Desk::new();
    demo(&desk);
    let small = "-n 1 --set scene.objects=4 --set scene.ambient=0 --set";
    for (folder, power) in [("bright", "10"), ("dim", "1e-9")] {
        let more = format!("{small} scene.lights=[{{power={power}}}]");
        generate_small(&desk, folder, &more);
    }
    // A code is 1/255.
    let [bright, dim] = ["bright", "dim"].map(|folder| format!("{folder}/images/val/000000.png"));
    desk.ok(&["diff", "--fail", "0.004", &bright, &dim]);
}

#[test]
fn one_camera_solve_says_what_it_found() {
    let desk = Desk::new();
    desk.write("a.label.json", label(SQUARE));
    let said = desk.ok(&["camera", "solve", "a.label.json"]);
    assert!(
        said.contains("tilt") && desk.path("a.camera.json").exists(),
        "{said}"
    );
}

#[test]
fn one_word_says_how_finely_every_stage_works() {
    let desk = Desk::new();
    demo(&desk);
    let generate = "dataset generate demo/recipe.toml -n 1";
    let made = |options: &str, folder: &str| {
        desk.ok(&words(&format!("{generate} {options} -o {folder}")));
        let at = |part: &str| desk.path(folder).join(format!("images/{part}/000000.png"));
        std::fs::read(at("train"))
            .or_else(|_| std::fs::read(at("val")))
            .expect("a picture")
    };
    let usual = made("-q", "usual");
    assert!(
        usual == made("-q --quality normal", "normal"),
        "normal is what there is without a word"
    );
    let draft = made("-q --quality draft", "draft");
    assert!(usual != draft);
    let finer = made("-q --set render.subsamples=2 --quality draft", "finer");
    assert!(draft != finer, "what is set goes first");
    let told = desk.refused(&words(&format!("{generate} -o x --quality fast")));
    assert!(told.contains("draft, normal, reference"), "{told}");
}

/// Photos of the frames of a folder with a grey slab on them, three eighths as wide as the display.
fn photos_of_frames(desk: &Desk, names: &[&str]) -> Vec<String> {
    let photo = |name: &&str| {
        let shown = desk.read::<LinearRgb>(&format!("frames/{name}.png"));
        let seen = Image::from_fn(shown.width(), shown.height(), |x, y| {
            let inside = (200..440).contains(&x) && (150..250).contains(&y);
            let (reflected, passed) = if inside { (0.05, 0.45) } else { (0.01, 0.85) };
            shown[(x, y)].map(|light| reflected + passed * light)
        });
        let file = format!("photo_{name}.png");
        desk.write_picture(&file, &seen);
        file
    };
    names.iter().map(photo).collect()
}

#[test]
fn an_object_on_a_display_is_measured() {
    let desk = Desk::new();
    let frames = ["capture", "frames", "-o", "frames", "--size", "640x400"];
    let said = desk.ok(&frames);
    assert!(
        said.contains("frames: 2 frames") && said.contains("show.html"),
        "{said}"
    );
    let photos = photos_of_frames(&desk, &["00_black", "01_white"]).join(" ");
    let add = format!("asset add {photos} --class cup -o assets --captured");
    let add = format!("{add} --display frames/display.toml");
    let width = desk.refused(&words(&add));
    assert!(
        width.contains("captured.width: missing, expected the measured width of the whole picture"),
        "{width}"
    );
    let said = desk.ok(&words(&format!("{add} --display-width 0.4")));
    assert!(
        said.contains("captured: 2 photos, transmittance to 0.0"),
        "{said}"
    );
    assert!(said.contains("refraction not measured"), "{said}");
    let length: f64 = said
        .split(": ")
        .nth(1)
        .and_then(|size| size.split(" x ").next()?.parse().ok())
        .expect("a length");
    // 240 of 640 pixels, 2.5 mm over the display as it lies.
    assert!((length - 150.0).abs() < 2.0, "{said}");
    let checked = || desk.ok(&["asset", "check", "assets"]);
    let unknown = "thickness: missing, 0.005 m is assumed";
    let said = checked();
    assert!(
        said.contains("captured: 2 photos") && said.contains(unknown),
        "{said}"
    );
    let thick = format!("{add} --display-width 0.4 --thickness 0.005");
    desk.ok(&words(&thick));
    assert!(!checked().contains(unknown));
    let screen = desk.refused(&words(&format!("{add} --screen 0.1,0.5,0.2")));
    assert!(screen.contains("cannot be used with"), "{screen}");
    let list = "[[photos]]\nfile = \"photo_00_black.png\"\nasset = \"a\"\nclass = \"cup\"\n\
                [photos.captured]\nphotos = [\"photo_01_white.png\"]\ndisplay = \"frames/display.toml\"\nwidth = 0.4\n";
    desk.write("photos.toml", list);
    let said = desk.ok(&["asset", "build", "photos.toml", "-o", "built"]);
    assert!(said.contains("built: 1 photo, 1 asset\n"), "{said}");
    let (_, length) = said.split_once("objects are ").expect("a length");
    let (length, _) = length.split_once(" mm long, to within ").expect("an error");
    assert!(length.parse::<f64>().is_ok(), "{said}");
    let stroke = r#"{"says": "object", "radius_px": 3, "points_px": [[9, 9]]}"#;
    for (said, expected) in [
        (r#""verdict": "rejected""#, "rejected in"),
        (
            &*format!(r#""strokes": [{stroke}]"#),
            "strokes: painted on a capture",
        ),
    ] {
        let review = format!(
            r#"{{"format": "cut-out-review", "version": 1, "size_px": [640, 400], {said}}}"#
        );
        desk.write("photo_00_black.review.json", review);
        let built = desk.run(&["asset", "build", "photos.toml", "-o", "built"]);
        let told = text(&built.stderr);
        assert!(told.contains(expected), "{told}");
        assert_eq!(built.status.success(), said.contains("rejected"), "{told}");
    }
}

#[test]
fn a_capture_that_cannot_be_measured_says_why() {
    let desk = Desk::new();
    let frames = |size: &'static str| ["capture", "frames", "-o", "frames", "--size", size];
    let small = desk.refused(&frames("640x200"));
    assert!(small.contains("size_px: 200, expected 400 to"), "{small}");
    let flat = desk.refused(&[&frames("640x400")[..], &["--diagonal", "0"]].concat());
    assert!(
        flat.contains("--diagonal 0: width: 0, expected 0.01 to 50 m"),
        "{flat}"
    );
    desk.ok(&[&frames("640x400")[..], &["--diagonal", "20"]].concat());
    let narrow = text(&desk.run(&frames("300x1600")).stderr);
    assert!(
        narrow.contains("size_px: 300, expected 400 to") && !narrow.contains("is gone"),
        "{narrow}"
    );
    photos_of_frames(&desk, &["01_white"]);
    let add = "asset add photo_01_white.png --class cup -o assets --captured";
    let one = desk.refused(&words(add));
    assert!(
        one.contains("captured.photos: no second photo, expected at least one of a black"),
        "{one}"
    );
    let beside = format!("{add} photo_01_white.png");
    let display = desk.refused(&words(&beside));
    assert!(display.contains("display.toml"), "{display}");
    let black = format!("{beside} --display frames/display.toml");
    let black = desk.refused(&words(&black));
    assert!(
        black.contains("no photo of the black frame among photo_01_white.png"),
        "{black}"
    );
}

/// Not on the photo, which is innocent.
#[test]
fn a_wrong_option_is_named_where_it_is_given() {
    let desk = Desk::new();
    desk.write_picture("a.png", &red_on_green(45..75, 25..55));
    desk.write_picture("b.png", &red_on_green(45..75, 25..55));
    desk.write_picture("small.png", &Image::filled(12, 8, GREEN));
    desk.write_picture("white.png", &Image::filled(12, 8, LinearRgb::WHITE));
    desk.write("cut.toml", "soften_px = -1\n");
    desk.write("levels.toml", "levels = 99\n");
    for (command, place) in [
        (
            "cut a.png -o o.exr --options cut.toml",
            "cut.toml: soften_px",
        ),
        (
            "segment a.png -o o --options levels.toml",
            "levels.toml: levels",
        ),
        ("film a.png -o o.exr --set film.clipped=0", "film.clipped"),
        (
            "triangulate a.png b.png -o o.exr --set film.max_sigma=0",
            "film.max_sigma",
        ),
        (
            "key a.png -o o.exr --screen 0,1,0 --set key.clip_black=5",
            "key.clip_black",
        ),
        (
            "key a.png -o o.exr --screen 0,1,0 --profile robust --set key.clip_black=5",
            "key.clip_black",
        ),
        (
            "film a.png -o o.exr --plate small.png",
            "small.png: 12 x 8 pixels",
        ),
        (
            "film a.png -o o.exr --mask white.png",
            "white.png: 12 x 8 pixels",
        ),
    ] {
        let told = desk.refused(&words(&format!("matte {command}")));
        assert!(
            told.starts_with(&format!("error: {place}")),
            "{command}: {told}"
        );
    }
}
