//! What the program prints: nothing that a terminal obeys, no panic where nobody reads, and with
//! `-q` the answer still.
#![cfg(unix)]

#[allow(dead_code, reason = "other tests need the rest of it")]
mod desk;

use desk::{Desk, text};
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStringExt;
use std::process::{Output, Stdio};

impl Desk {
    /// Both outputs and the exit status of a run with its standard output in a file.
    fn printed_into(&self, args: &[&str], file: &str) -> (Option<i32>, String) {
        let out = std::fs::File::options().write(true).open(file).unwrap();
        let output = self.command(args).stdout(out).output().unwrap();
        (output.status.code(), text(&output.stderr))
    }

    /// A dataset of two images, and what a detector found in them.
    fn with_labels() -> Self {
        let desk = Self::new();
        let grey = |light| petcomp::Image::filled(32, 24, petcomp::LinearRgb::grey(light));
        for (part, light) in [("train", 0.2), ("val", 0.8)] {
            desk.write(
                format!("set/labels/{part}/{part}.txt"),
                "0 0.5 0.5 0.4 0.4\n1 0.2 0.2 0.1 0.1\n",
            );
            std::fs::create_dir_all(desk.path(format!("set/images/{part}"))).unwrap();
            petcomp::io::write(
                desk.path(format!("set/images/{part}/{part}.png")),
                &grey(light),
            )
            .unwrap();
        }
        desk.write(
            "set/data.yaml",
            "train: images/train\nval: images/val\nnc: 2\nnames: [cap, none]\n",
        );
        desk.write(
            "found/val.txt",
            "0 0.5 0.5 0.4 0.4 0.9\n1 0.7 0.7 0.1 0.1 0.6\n",
        );
        petcomp::io::write(desk.path("a.png"), &grey(0.5)).unwrap();
        desk
    }
}

/// Neither colour, cursor nor another line than those that end with one.
fn assert_tame(output: &Output) {
    for shown in [text(&output.stdout), text(&output.stderr)] {
        assert!(
            !shown.contains(|c: char| c.is_control() && c != '\n'),
            "{shown:?}"
        );
    }
}

#[test]
fn an_argument_that_is_not_utf8_is_a_file_name() {
    let desk = Desk::with_labels();
    let odd = OsString::from_vec(b"\xff.png".to_vec());
    let missing = desk.run(&[OsStr::new("diff"), &odd, OsStr::new("a.png")]);
    assert_eq!(missing.status.code(), Some(4), "{}", text(&missing.stderr));
    std::fs::copy(desk.path("a.png"), desk.path(&odd)).unwrap();
    assert_eq!(
        desk.run(&[OsStr::new("diff"), &odd, OsStr::new("a.png")])
            .status
            .code(),
        Some(0)
    );
    let refused = desk.run(&[
        OsStr::new("asset"),
        OsStr::new("add"),
        OsStr::new("--class"),
        &odd,
    ]);
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_one_line_and_a_reader_that_leaves_is_none() {
    let desk = Desk::with_labels();
    let commands: [&[&str]; 9] = [
        &["diff", "a.png", "a.png"],
        &["eval", "found", "set/labels/val"],
        &["dataset", "check", "set"],
        &["dataset", "anchors", "set", "-n", "1"],
        &["dataset", "init", "recipe.toml"],
        &["doctor"],
        &["--help"],
        &["eval", "--help"],
        &["--version"],
    ];
    for args in commands {
        let (status, said) = desk.printed_into(args, "/dev/full");
        assert_eq!(
            said, "error: standard output: no space left on device\n",
            "{args:?}"
        );
        assert_eq!(status, Some(4), "{args:?}");
        let _ = std::fs::remove_file(desk.path("recipe.toml"));
    }
    let mut gone = desk.command(&["eval", "found", "set/labels/val"]);
    let mut child = gone
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        (output.status.code(), text(&output.stderr)),
        (Some(141), String::new())
    );
}

#[test]
fn names_cannot_steer_a_terminal() {
    let desk = Desk::with_labels();
    let evil = "\u{1b}[31mred\nerror: forged\r\u{9b}2J\u{202e}gnp.exe";
    let escaped = "\\x1b[31mred\\nerror: forged\\r\\x9b2J\\x202egnp.exe";
    desk.write(evil, "no picture");
    desk.write("evil.yaml/data.yaml", format!("train: {evil}\n"));
    desk.write(
        "truth.json",
        serde_json::json!({
            "images": [{"id": 1, "file_name": "a.png", "width": 32, "height": 24}],
            "categories": [{"id": 1, "name": evil}],
            "annotations": [{"image_id": 1, "category_id": 1, "bbox": [1, 1, 9, 9]}],
        })
        .to_string(),
    );
    desk.write(
        "found.json",
        r#"[{"image_id": 1, "category_id": 1, "bbox": [20, 1, 9, 9], "score": 0.9}]"#,
    );
    let commands: [&[&str]; 6] = [
        &["matte", "cut", evil, "-o", "x.exr"],
        &["diff", evil, "a.png"],
        &["dataset", "check", evil],
        &["camera", "solve", evil],
        &[evil],
        &["eval", "found.json", "truth.json", "-o", "page"],
    ];
    for args in commands {
        let output = desk.run(args);
        assert_tame(&output);
        let said = text(&output.stderr) + &text(&output.stdout);
        assert!(
            said.contains(escaped) || args[0] == evil,
            "{args:?} said {said}"
        );
        assert!(
            !said.lines().any(|line| line.starts_with("error: forged")) || args[0] == evil,
            "{said}"
        );
    }
    assert_tame(&desk.run(&["dataset", "check", "evil.yaml"]));
    for file in ["eval.html", "confusion.svg", "f1.svg"] {
        let page = std::fs::read_to_string(desk.path("page").join(file)).unwrap();
        assert!(
            !page.contains(|c: char| c.is_control() && c != '\n'),
            "{file}"
        );
    }
}

#[test]
fn words_are_ours_and_not_those_of_rust_or_the_system() {
    let desk = Desk::with_labels();
    desk.write(
        "number.json",
        r#"{"format": "plane-label", "version": "one"}"#,
    );
    desk.write("recipe.toml", "assets = 3\nscene = 4\n");
    desk.write(
        "count.toml",
        "assets = \"a\"\n[scene]\nobjects = \"many\"\n",
    );
    desk.write("truth.json", r#"{"images": [{"id": "a"}]}"#);
    desk.write("list.json", "[3]");
    let commands: [&[&str]; 11] = [
        &["eval", "nowhere", "set/labels/val"],
        &["eval", "found", "set/data.yaml"],
        &["eval", "list.json", "truth.json"],
        &["camera", "solve", "number.json"],
        &["camera", "solve", "list.json"],
        &["dataset", "generate", "recipe.toml", "-n", "1", "-o", "x"],
        &["dataset", "generate", "count.toml", "-n", "1", "-o", "x"],
        &["dataset", "split", "nowhere", "-o", "x"],
        &["dataset", "check", "nowhere"],
        &["dataset", "init", "a.png/recipe.toml"],
        &["asset", "list", "nowhere"],
    ];
    for args in commands {
        let output = desk.run(args);
        let said = text(&output.stderr);
        assert!(
            !output.status.success() && said.starts_with("error: ") && said.lines().count() == 1,
            "{args:?}: {said}"
        );
        for foreign in [
            "os error", "Os {", "Some(", "None", "u32", "u64", "usize", "f64", "i64", "struct ",
            "::",
        ] {
            assert!(!said.contains(foreign), "{args:?}: {said}");
        }
    }
}

#[test]
fn classes_are_called_by_name_wherever_eval_runs_or_it_says_why_not() {
    let desk = Desk::with_labels();
    std::fs::remove_dir_all(desk.path("set/images/train")).unwrap();
    let mut inside = desk.command(&["eval", "../found", "labels/val"]);
    let output = inside.current_dir(desk.path("set")).output().unwrap();
    assert!(text(&output.stdout).contains("| cap |"));
    desk.write("set/data.yaml", "names: {1: cap}\n");
    let output = desk.run(&["eval", "found", "set/labels/val"]);
    let said = text(&output.stderr);
    assert!(
        said.contains("class 1, expected 0; classes are shown by number"),
        "{said}"
    );
    assert!(output.status.success());
}

#[test]
fn quiet_leaves_the_notes_that_strict_fails_for() {
    let desk = Desk::with_labels();
    desk.write(
        "set/data.yaml",
        "train: images/train\nval: images/val\nnc: 3\nnames: [cap, none, lid]\n",
    );
    let output = desk.run(&["-q", "dataset", "check", "set", "--strict"]);
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("set: class \"lid\" has no label in train ["),
        "{said}"
    );
}

#[test]
fn quiet_leaves_the_answer() {
    let desk = Desk::with_labels();
    let said = |args: &[&str]| {
        let output = desk.run(&[&["-q"], args].concat());
        assert_eq!(text(&output.stderr), "", "{args:?}");
        text(&output.stdout)
    };
    let scores = said(&["eval", "found", "set/labels/val", "-o", "scores"]);
    assert!(
        scores.contains("| mAP@0.5 |") && scores.contains("| cap |"),
        "{scores}"
    );
    assert!(!scores.contains("look at"), "{scores}");
    assert!(said(&["diff", "a.png", "a.png"]).contains("PASS"));
    assert!(said(&["dataset", "check", "set"]).contains("set: 2 images, 4 labels, no errors"));
    assert!(said(&["dataset", "anchors", "set", "-n", "1"]).contains("mean IoU"));
    assert_eq!(said(&["dataset", "init", "recipe.toml"]), "");
}
